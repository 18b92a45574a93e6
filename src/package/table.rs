//! An XY table as an SSP: two axes and two drives as FMUs, joined (System Structure and Parameterization 1.0).
//!
//! The system's inputs are where the table shall be in X and Y, its outputs where it is. All settings are start values
//! of the FMUs themselves, so that no parameter set is needed.

use std::io::{self, Cursor};
use std::path::Path;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use zip::ZipWriter;

use super::{Package, PackageError, add, units};
use crate::axis::substeps;
use crate::circle::{Feedback, ServoAxis};
use crate::trace::{AxisKind, write_text};
use crate::variables::{Causality, Model, Slot, Starts, Variable};

type Xml = Writer<Vec<u8>>;

const SCHEME_EXACT: f64 = 2.0;
const COMMON: &str = "http://ssp-standard.org/SSP1/SystemStructureCommon";
const DESCRIPTION: &str = "http://ssp-standard.org/SSP1/SystemStructureDescription";

/// Two axes under control, Y stacked on X.
#[derive(Debug, Clone, PartialEq)]
pub struct XyTable {
    /// Name of the system.
    pub name: String,
    /// X, with the mass of Y in its inertia, and Y; each with its units.
    pub axes: [(ServoAxis, AxisKind); 2],
    /// Sampling interval of the drives, s: the communication step that the system is made for.
    pub dt: f64,
    /// Whether the system has connectors of its own; without them, the drives' references are fed by name.
    pub connectors: bool,
}

/// One FMU in the system.
struct Component {
    name: &'static str,
    package: Package,
}

impl XyTable {
    fn components(&self) -> Result<Vec<Component>, PackageError> {
        let mut components = Vec::new();
        for ((axis, motion), [of_axis, of_drive]) in
            self.axes.iter().zip([["x_axis", "x_drive"], ["y_axis", "y_drive"]])
        {
            let mut starts = Starts::of(&axis.parameters, axis.structure, &axis.effects, *motion);
            // As `circle` steps: exact between the samples, and as often as the effects ask for.
            let per = substeps(&axis.parameters, axis.structure, &axis.effects, self.dt);
            starts.values[Slot::Scheme as usize] = SCHEME_EXACT;
            starts.values[Slot::DtInternal as usize] = self.dt / per as f64;
            components.push(Component { name: of_axis, package: Package::checked(of_axis, starts)? });
            let drive = Package::drive(of_drive, &axis.servo.gains, axis.parameters.rho, self.dt, *motion)?;
            components.push(Component { name: of_drive, package: drive });
        }
        Ok(components)
    }

    /// From element and connector to element and connector; an empty element is the system.
    fn connections(&self) -> Vec<[&'static str; 4]> {
        let mut connections = Vec::new();
        let names = [["x_axis", "x_drive", "x_reference", "x"], ["y_axis", "y_drive", "y_reference", "y"]];
        for ((axis, _), [of_axis, of_drive, reference, position]) in self.axes.iter().zip(names) {
            let encoder = match axis.servo.feedback {
                Feedback::Motor => "theta1",
                Feedback::Table => "theta2",
            };
            connections.extend([
                ["", reference, of_drive, "reference"],
                [of_axis, encoder, of_drive, "theta"],
                [of_axis, "omega1", of_drive, "omega"],
                [of_drive, "T", of_axis, "T"],
                [of_axis, "x2", "", position],
            ]);
        }
        connections.retain(|[from, _, to, _]| self.connectors || !from.is_empty() && !to.is_empty());
        connections
    }

    /// `SystemStructure.ssd`.
    fn structure(&self, components: &[Component]) -> io::Result<Vec<u8>> {
        let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
        xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        xml.create_element("ssd:SystemStructureDescription")
            .with_attributes([
                ("xmlns:ssc", COMMON),
                ("xmlns:ssd", DESCRIPTION),
                ("version", "1.0"),
                ("name", self.name.as_str()),
                ("description", "XY table of a machine tool, Y stacked on X: two axes, each with its drive"),
                ("generationTool", concat!("eixo ", env!("CARGO_PKG_VERSION"))),
            ])
            .write_inner_content(|xml| {
                xml.create_element("ssd:System").with_attribute(("name", "table")).write_inner_content(|xml| {
                    let ends = ["x_reference", "y_reference"].map(|n| (n, Causality::Input, "m"));
                    let ways = ["x", "y"].map(|n| (n, Causality::Output, "m"));
                    if self.connectors {
                        connectors(xml, ends.into_iter().chain(ways))?;
                    }
                    xml.create_element("ssd:Elements")
                        .write_inner_content(|xml| components.iter().try_for_each(|c| component(xml, c)))?;
                    xml.create_element("ssd:Connections").write_inner_content(|xml| {
                        self.connections().into_iter().try_for_each(|c| connection(xml, c))
                    })?;
                    Ok(())
                })?;
                xml.create_element("ssd:Units").write_inner_content(|xml| self.units(xml, components))?;
                xml.create_element("ssd:DefaultExperiment")
                    .with_attributes([("startTime", "0"), ("stopTime", "1")])
                    .write_empty()?;
                Ok(())
            })?;
        let mut bytes = xml.into_inner();
        bytes.push(b'\n');
        Ok(bytes)
    }

    fn units(&self, xml: &mut Xml, components: &[Component]) -> io::Result<()> {
        let mut names: Vec<String> = vec!["m".to_owned()];
        for c in components {
            names.extend(ports(c).map(|v| units::of(v.unit, c.package.starts.motion).into_owned()));
        }
        names.sort_unstable();
        names.dedup();
        for name in names {
            xml.create_element("ssc:Unit")
                .with_attribute(("name", name.as_str()))
                .write_inner_content(|xml| units::base_element(xml, "ssc:BaseUnit", &name))?;
        }
        Ok(())
    }

    /// The archive.
    ///
    /// # Errors
    /// See [`PackageError`].
    pub fn archive(&self) -> Result<Vec<u8>, PackageError> {
        let components = self.components()?;
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        add(&mut zip, "SystemStructure.ssd", &self.structure(&components)?, 0o644)?;
        for c in &components {
            add(&mut zip, &source(c), &c.package.archive()?, 0o644)?;
        }
        Ok(zip.finish()?.into_inner())
    }

    /// Writes the archive: beside the target first, then renamed.
    ///
    /// # Errors
    /// See [`PackageError`].
    pub fn write(&self, path: &Path) -> Result<(), PackageError> {
        Ok(write_text(path, &self.archive()?)?)
    }
}

fn source(c: &Component) -> String {
    format!("resources/{}.fmu", c.name)
}

/// Inputs and outputs of a component.
fn ports(c: &Component) -> impl Iterator<Item = Variable> {
    let model: Model = c.package.starts.model;
    model.all().filter(|v| v.causality != Causality::Parameter)
}

fn component(xml: &mut Xml, c: &Component) -> io::Result<()> {
    xml.create_element("ssd:Component")
        .with_attributes([("name", c.name), ("type", "application/x-fmu-sharedlibrary"), ("source", &source(c))])
        .write_inner_content(|xml| {
            let motion = c.package.starts.motion;
            let ports: Vec<_> =
                ports(c).map(|v| (v.name, v.causality, units::of(v.unit, motion).into_owned())).collect();
            connectors(xml, ports.iter().map(|(name, causality, unit)| (*name, *causality, unit.as_str())))
        })?;
    Ok(())
}

fn connectors<'a>(xml: &mut Xml, list: impl Iterator<Item = (&'a str, Causality, &'a str)>) -> io::Result<()> {
    xml.create_element("ssd:Connectors").write_inner_content(|xml| {
        for (name, causality, unit) in list {
            let kind = if causality == Causality::Input { "input" } else { "output" };
            xml.create_element("ssd:Connector").with_attributes([("name", name), ("kind", kind)]).write_inner_content(
                |xml| {
                    xml.create_element("ssc:Real").with_attribute(("unit", unit)).write_empty()?;
                    Ok(())
                },
            )?;
        }
        Ok(())
    })?;
    Ok(())
}

fn connection(xml: &mut Xml, [from, start, to, end]: [&str; 4]) -> io::Result<()> {
    let mut element = xml.create_element("ssd:Connection");
    for (name, value) in [("startElement", from), ("startConnector", start), ("endElement", to), ("endConnector", end)]
    {
        // The system itself goes unnamed.
        if !value.is_empty() {
            element = element.with_attribute((name, value));
        }
    }
    element.write_empty()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Parameters, Structure};
    use crate::circle::Servo;
    use crate::effects::Settings;
    use crate::fmu::archive::{Archive, Limits};
    use crate::fmu::description::Description;

    fn table(feedback: Feedback) -> XyTable {
        let parameters = Parameters::PAPER;
        let servo = Servo { feedback, ..Servo::tuned(&parameters, 80.0, None) };
        let axis = ServoAxis { parameters, structure: Structure::TwoInertia, effects: Settings::default(), servo };
        XyTable { name: "a < b".into(), axes: [(axis, AxisKind::Rotary); 2], dt: 1e-3, connectors: true }
    }

    #[test]
    fn every_connection_joins_an_output_to_an_input_of_the_same_unit_and_every_input_has_one() {
        for feedback in [Feedback::Motor, Feedback::Table] {
            let table = table(feedback);
            let components = table.components().unwrap();
            let find = |element: &str, name: &str| {
                let c = components.iter().find(|c| c.name == element)?;
                ports(c).find(|v| v.name == name)
            };
            let mut fed = std::collections::BTreeSet::new();
            for [from, start, to, end] in table.connections() {
                let unit = |v: Option<Variable>| v.map_or("m", |v| v.unit);
                let (source, sink) = (find(from, start), find(to, end));
                assert!(from.is_empty() || source.is_some_and(|v| v.causality == Causality::Output), "{from}.{start}");
                assert!(to.is_empty() || sink.is_some_and(|v| v.causality == Causality::Input), "{to}.{end}");
                assert_eq!(unit(source), unit(sink), "{from}.{start} {to}.{end}");
                assert!(fed.insert((to, end)), "{to}.{end} is fed twice");
            }
            let bare = XyTable { connectors: false, ..table }.connections();
            assert!(bare.len() == 6 && bare.iter().all(|[from, _, to, _]| !from.is_empty() && !to.is_empty()));
            for c in &components {
                for v in ports(c).filter(|v| v.causality == Causality::Input) {
                    assert!(fed.contains(&(c.name, v.name)), "{}.{v} is not fed", c.name);
                }
            }
        }
    }

    #[test]
    fn the_archive_holds_the_structure_and_four_fmus_that_read_back() {
        let bytes = table(Feedback::Motor).archive().unwrap();
        assert!(bytes == table(Feedback::Motor).archive().unwrap());
        let mut archive = Archive::from_bytes(bytes, Limits::default()).unwrap();
        let structure = String::from_utf8(archive.read("SystemStructure.ssd").unwrap()).unwrap();
        assert!(structure.contains("name=\"a &lt; b\""), "{structure}");
        for name in ["x_axis", "x_drive", "y_axis", "y_drive"] {
            let fmu = archive.read(&format!("resources/{name}.fmu")).unwrap();
            let mut fmu = Archive::from_bytes(fmu, Limits::default()).unwrap();
            let description = Description::parse(&fmu.read("modelDescription.xml").unwrap()).unwrap();
            assert_eq!(description.model_name, name);
        }
    }
}
