//! What `modelDescription.xml` has alike in FMI 2.0 and 3.0: the head, units, log categories, default experiment, and what a
//! variable declares.

use std::borrow::Cow;
use std::io;

use quick_xml::events::{BytesDecl, Event};
use quick_xml::{ElementWriter, Writer};

use super::units;
use crate::fmi2::LOG_CATEGORIES;
use crate::variables::{Causality, Enumeration, FIXED, Model, Starts, Type, Variability, Variable, guid};

pub(super) type Xml = Writer<Vec<u8>>;
/// An element whose attributes are being written.
type Element<'a> = ElementWriter<'a, Vec<u8>>;

/// Name of the binary, and prefix of nothing: the functions are exported as the standard names them.
pub(super) const fn identifier(model: Model) -> &'static str {
    match model {
        Model::Axis => "eixo",
        Model::Drive => "eixo_drive",
    }
}

const fn description(model: Model) -> &'static str {
    match model {
        Model::Axis => "Drive axis of a machine tool: motor and table joined by spring and damper, with effects",
        Model::Drive => "Drive of a machine tool's axis: position loop, velocity loop, feed-forward, torque limit",
    }
}

/// Samples of the paper's simulation (Table 1), at its own step.
const SAMPLES: f64 = 2048.0;

/// The document of an FMI version, for an axis of that name with these start values; `token` is the version's name of the
/// attribute that binary and XML have in common.
pub(super) fn document(
    fmi_version: &str,
    token: &str,
    name: &str,
    starts: &Starts,
    content: fn(&mut Xml, &Starts) -> io::Result<()>,
) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("fmiModelDescription")
        .with_attributes([
            ("fmiVersion", fmi_version),
            ("modelName", name),
            (token, guid(starts).to_string().as_str()),
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
    xml.create_element("UnitDefinitions").write_inner_content(|xml| {
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
    })?;
    Ok(())
}

/// The enumerations that variables are of, each written by `definition`; a drive has none.
pub(super) fn type_definitions(
    xml: &mut Xml,
    model: Model,
    definition: fn(&mut Xml, &Enumeration) -> io::Result<()>,
) -> io::Result<()> {
    if model != Model::Axis {
        return Ok(());
    }
    let kinds = FIXED.iter().filter_map(|v| if let Type::Enumeration(kind) = v.kind { Some(kind) } else { None });
    xml.create_element("TypeDefinitions").write_inner_content(|xml| {
        for kind in kinds {
            definition(xml, kind)?;
        }
        Ok(())
    })?;
    Ok(())
}

/// The items of an enumeration.
pub(super) fn items(xml: &mut Xml, kind: &Enumeration) -> io::Result<()> {
    for (value, (name, doc)) in (1_i32..).zip(kind.items) {
        xml.create_element("Item")
            .with_attributes([("name", *name), ("value", value.to_string().as_str()), ("description", doc)])
            .write_empty()?;
    }
    Ok(())
}

/// The log categories, whose descriptions name the version's functions by `prefix`.
pub(super) fn log_categories(xml: &mut Xml, prefix: &str) -> io::Result<()> {
    xml.create_element("LogCategories").write_inner_content(|xml| {
        for (name, description) in LOG_CATEGORIES {
            xml.create_element("Category")
                .with_attributes([("name", name), ("description", description.replace("fmi2", prefix).as_str())])
                .write_empty()?;
        }
        Ok(())
    })?;
    Ok(())
}

pub(super) fn default_experiment(xml: &mut Xml, starts: &Starts) -> io::Result<()> {
    let step = starts.values[starts.model.internal_step()];
    xml.create_element("DefaultExperiment")
        .with_attributes([
            ("startTime", "0"),
            ("stopTime", number(SAMPLES * step).as_str()),
            ("stepSize", number(step).as_str()),
        ])
        .write_empty()?;
    Ok(())
}

/// Adds what a variable is: name, reference, description, causality, variability and initial.
pub(super) fn identity<'a>(element: Element<'a>, v: &Variable) -> Element<'a> {
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
    let element = element.with_attributes([
        ("name", v.to_string().as_str()),
        ("valueReference", v.reference.to_string().as_str()),
        ("description", v.doc),
        ("causality", causality),
        ("variability", variability),
    ]);
    match v.causality {
        // An input has no `initial`.
        Causality::Input => element,
        Causality::Output => element.with_attribute(("initial", "calculated")),
        Causality::Parameter => element.with_attribute(("initial", "exact")),
    }
}

/// Adds what a variable's values are: unit or type, limits, nominal, and the start value.
pub(super) fn range<'a>(mut element: Element<'a>, v: &Variable, start: f64, starts: &Starts) -> Element<'a> {
    match v.kind {
        Type::Real => {
            let unit = units::of(v.unit, starts.motion);
            element = element.with_attribute(("unit", unit.as_ref()));
            if let Some(display) = units::display(unit.as_ref()) {
                element = element.with_attribute(("displayUnit", display.name));
            }
        }
        Type::Enumeration(kind) => element = element.with_attribute(("declaredType", kind.name)),
    }
    for (name, value) in [("min", v.min), ("max", v.max)] {
        if let Some(value) = value {
            element = element.with_attribute((name, number(value).as_str()));
        }
    }
    if v.kind == Type::Real && v.nominal != 1.0 {
        element = element.with_attribute(("nominal", number(v.nominal).as_str()));
    }
    if v.causality != Causality::Output {
        element = element.with_attribute(("start", number(start).as_str()));
    }
    element
}
