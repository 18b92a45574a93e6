//! `modelDescription.xml` from the variable table (FMI 2.0.4, section 2.2).

use std::borrow::Cow;
use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};

use super::units;
use crate::fmi2::LOG_CATEGORIES;
use crate::variables::{Causality, Enumeration, FIXED, Model, Starts, Type, Variability, Variable, guid};

pub(super) type Xml = Writer<Vec<u8>>;

/// Name of the binary, and prefix of nothing: the functions are exported as the standard names them.
pub(super) const fn identifier(model: Model) -> &'static str {
    match model {
        Model::Axis => "eixo",
        Model::Drive => "eixo_drive",
    }
}

pub(super) const fn description(model: Model) -> &'static str {
    match model {
        Model::Axis => "Drive axis of a machine tool: motor and table joined by spring and damper, with effects",
        Model::Drive => "Drive of a machine tool's axis: position loop, velocity loop, feed-forward, torque limit",
    }
}

/// Samples of the paper's simulation (Table 1), at its own step.
pub(super) const SAMPLES: f64 = 2048.0;

/// The document, for an axis of that name with these start values.
pub(super) fn document(name: &str, starts: &Starts) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("fmiModelDescription")
        .with_attributes([
            ("fmiVersion", "2.0"),
            ("modelName", name),
            ("guid", guid(starts).to_string().as_str()),
            ("description", description(starts.model)),
            ("author", "the eixo authors"),
            ("version", env!("CARGO_PKG_VERSION")),
            ("license", env!("CARGO_PKG_LICENSE")),
            ("generationTool", concat!("eixo ", env!("CARGO_PKG_VERSION"))),
            ("variableNamingConvention", "structured"),
        ])
        .write_inner_content(|xml| content(xml, starts))?;
    let mut bytes = xml.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

fn content(xml: &mut Xml, starts: &Starts) -> io::Result<()> {
    xml.create_element("CoSimulation")
        .with_attributes([
            ("modelIdentifier", identifier(starts.model)),
            ("canHandleVariableCommunicationStepSize", "true"),
            // A drive samples its inputs: what they do until its next sample is nothing to it.
            ("canInterpolateInputs", if starts.model == Model::Axis { "true" } else { "false" }),
            ("maxOutputDerivativeOrder", "1"),
            ("canNotUseMemoryManagementFunctions", "true"),
            ("canGetAndSetFMUstate", "true"),
            ("canSerializeFMUstate", "true"),
            // A drive puts out what earlier inputs made: no derivative is of use.
            ("providesDirectionalDerivative", if starts.model == Model::Axis { "true" } else { "false" }),
        ])
        .write_empty()?;
    xml.create_element("UnitDefinitions").write_inner_content(|xml| unit_definitions(xml, starts))?;
    if starts.model == Model::Axis {
        xml.create_element("TypeDefinitions").write_inner_content(type_definitions)?;
    }
    xml.create_element("LogCategories").write_inner_content(|xml| {
        for (name, description) in LOG_CATEGORIES {
            xml.create_element("Category")
                .with_attributes([("name", name), ("description", description)])
                .write_empty()?;
        }
        Ok(())
    })?;
    let step = starts.values[starts.model.internal_step()];
    xml.create_element("DefaultExperiment")
        .with_attributes([
            ("startTime", "0"),
            ("stopTime", number(SAMPLES * step).as_str()),
            ("stepSize", number(step).as_str()),
        ])
        .write_empty()?;
    xml.create_element("ModelVariables").write_inner_content(|xml| {
        for (index, v) in starts.model.all().enumerate() {
            variable(xml, &v, starts.values[index], starts)?;
        }
        Ok(())
    })?;
    xml.create_element("ModelStructure").write_inner_content(|xml| structure(xml, starts.model))?;
    Ok(())
}

/// A number as the XML writes it: the shortest text that reads back as the same.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e15).contains(&size) { format!("{value:e}") } else { value.to_string() }
}

pub(super) fn unit_definitions(xml: &mut Xml, starts: &Starts) -> io::Result<()> {
    let mut names: Vec<Cow<'static, str>> =
        starts.model.all().map(|v| units::of(v.unit, starts.motion)).filter(|u| !u.is_empty()).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let name = name.as_ref();
        xml.create_element("Unit").with_attribute(("name", name)).write_inner_content(|xml| {
            units::base_element(xml, "BaseUnit", name)?;
            if let Some(display) = units::display(name) {
                xml.create_element("DisplayUnit")
                    .with_attributes([("name", display.name), ("factor", number(display.factor).as_str())])
                    .write_empty()?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

fn type_definitions(xml: &mut Xml) -> io::Result<()> {
    let kinds: Vec<&Enumeration> = FIXED
        .iter()
        .filter_map(|v| match v.kind {
            Type::Enumeration(kind) => Some(kind),
            Type::Real => None,
        })
        .collect();
    for kind in kinds {
        xml.create_element("SimpleType")
            .with_attributes([("name", kind.name), ("description", kind.doc)])
            .write_inner_content(|xml| {
                xml.create_element("Enumeration").write_inner_content(|xml| {
                    for (value, (name, doc)) in (1_i32..).zip(kind.items) {
                        xml.create_element("Item")
                            .with_attributes([
                                ("name", *name),
                                ("value", value.to_string().as_str()),
                                ("description", doc),
                            ])
                            .write_empty()?;
                    }
                    Ok(())
                })?;
                Ok(())
            })?;
    }
    Ok(())
}

fn variable(xml: &mut Xml, v: &Variable, start: f64, starts: &Starts) -> io::Result<()> {
    let causality = match v.causality {
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Parameter => "parameter",
    };
    let variability = match v.variability {
        Variability::Fixed => "fixed",
        Variability::Tunable => "tunable",
        Variability::Continuous => "continuous",
    };
    let mut element = xml.create_element("ScalarVariable").with_attributes([
        ("name", v.to_string().as_str()),
        ("valueReference", v.reference.to_string().as_str()),
        ("description", v.doc),
        ("causality", causality),
        ("variability", variability),
    ]);
    // An input has no `initial`.
    match v.causality {
        Causality::Input => {}
        Causality::Output => element = element.with_attribute(("initial", "calculated")),
        Causality::Parameter => element = element.with_attribute(("initial", "exact")),
    }
    element.write_inner_content(|xml| {
        let mut kind = match v.kind {
            Type::Real => {
                let unit = units::of(v.unit, starts.motion);
                let unit = unit.as_ref();
                let mut real = xml.create_element("Real").with_attribute(("unit", unit));
                if let Some(display) = units::display(unit) {
                    real = real.with_attribute(("displayUnit", display.name));
                }
                real
            }
            Type::Enumeration(kind) => xml.create_element("Enumeration").with_attribute(("declaredType", kind.name)),
        };
        for (name, value) in [("min", v.min), ("max", v.max)] {
            if let Some(value) = value {
                kind = kind.with_attribute((name, number(value).as_str()));
            }
        }
        if v.kind == Type::Real && v.nominal != 1.0 {
            kind = kind.with_attribute(("nominal", number(v.nominal).as_str()));
        }
        if v.causality != Causality::Output {
            kind = kind.with_attribute(("start", number(start).as_str()));
        }
        kind.write_empty()?;
        Ok(())
    })?;
    Ok(())
}

fn structure(xml: &mut Xml, model: Model) -> io::Result<()> {
    let outputs = || (0..model.count()).filter(|&i| model.at(i).causality == Causality::Output);
    let unknown = |xml: &mut Xml, output: usize, known: &dyn Fn(usize) -> bool| -> io::Result<()> {
        let indices: Vec<String> = (0..model.count()).filter(|&i| known(i)).map(|i| (i + 1).to_string()).collect();
        xml.create_element("Unknown")
            .with_attributes([
                ("index", (output + 1).to_string().as_str()),
                ("dependencies", indices.join(" ").as_str()),
            ])
            .write_empty()?;
        Ok(())
    };
    xml.create_element("Outputs")
        .write_inner_content(|xml| outputs().try_for_each(|o| unknown(xml, o, &|i| model.depends_on_input(o, i))))?;
    xml.create_element("InitialUnknowns")
        .write_inner_content(|xml| outputs().try_for_each(|o| unknown(xml, o, &|i| model.depends_at_start(o, i))))?;
    Ok(())
}
