//! `modelDescription.xml` of FMI 3.0 from the variable table (FMI 3.0, section 2.4).

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};

use super::units;
use super::xml::{SAMPLES, Xml, description, identifier, number, unit_definitions};
use crate::fmi2::LOG_CATEGORIES;
use crate::fmi3::TIME_REFERENCE;
use crate::variables::{Causality, FIXED, Model, Starts, Type, Variability, Variable, guid};

/// The document, for an axis of that name with these start values.
pub(super) fn document(name: &str, starts: &Starts) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("fmiModelDescription")
        .with_attributes([
            ("fmiVersion", "3.0"),
            ("modelName", name),
            ("instantiationToken", guid(starts).to_string().as_str()),
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
            ("canGetAndSetFMUState", "true"),
            ("canSerializeFMUState", "true"),
            // A drive puts out what earlier inputs made: no derivative is of use.
            ("providesDirectionalDerivatives", if starts.model == Model::Axis { "true" } else { "false" }),
            ("canHandleVariableCommunicationStepSize", "true"),
            ("maxOutputDerivativeOrder", "1"),
        ])
        .write_empty()?;
    xml.create_element("UnitDefinitions").write_inner_content(|xml| unit_definitions(xml, starts))?;
    if starts.model == Model::Axis {
        xml.create_element("TypeDefinitions").write_inner_content(type_definitions)?;
    }
    xml.create_element("LogCategories").write_inner_content(|xml| {
        for (name, description) in LOG_CATEGORIES {
            let description = description.replace("fmi2", "fmi3");
            xml.create_element("Category")
                .with_attributes([("name", name), ("description", description.as_str())])
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
        xml.create_element("Float64")
            .with_attributes([
                ("name", "time"),
                ("valueReference", TIME_REFERENCE.to_string().as_str()),
                ("description", "Time of the communication point"),
                ("causality", "independent"),
                ("variability", "continuous"),
                ("unit", "s"),
            ])
            .write_empty()?;
        for (index, v) in starts.model.all().enumerate() {
            variable(xml, &v, starts.values[index], starts)?;
        }
        Ok(())
    })?;
    xml.create_element("ModelStructure").write_inner_content(|xml| structure(xml, starts.model))?;
    Ok(())
}

fn type_definitions(xml: &mut Xml) -> io::Result<()> {
    let kinds = FIXED.iter().filter_map(|v| if let Type::Enumeration(kind) = v.kind { Some(kind) } else { None });
    for kind in kinds {
        xml.create_element("EnumerationType")
            .with_attributes([("name", kind.name), ("description", kind.doc)])
            .write_inner_content(|xml| {
                for (value, (name, doc)) in (1_i32..).zip(kind.items) {
                    let value = value.to_string();
                    xml.create_element("Item")
                        .with_attributes([("name", *name), ("value", value.as_str()), ("description", doc)])
                        .write_empty()?;
                }
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
    let element = match v.kind {
        Type::Real => "Float64",
        Type::Enumeration(_) => "Enumeration",
    };
    let mut element = xml.create_element(element).with_attributes([
        ("name", v.to_string().as_str()),
        ("valueReference", v.reference.to_string().as_str()),
        ("description", v.doc),
        ("causality", causality),
        ("variability", variability),
    ]);
    match v.causality {
        Causality::Input => {}
        Causality::Output => element = element.with_attribute(("initial", "calculated")),
        Causality::Parameter => element = element.with_attribute(("initial", "exact")),
    }
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
    element.write_empty()?;
    Ok(())
}

fn structure(xml: &mut Xml, model: Model) -> io::Result<()> {
    let outputs = || (0..model.count()).filter(|&i| model.at(i).causality == Causality::Output);
    let mut unknown = |element: &str, output: usize, known: &dyn Fn(usize) -> bool| -> io::Result<()> {
        let known = (0..model.count()).filter(|&i| known(i)).map(|i| model.at(i).reference.to_string());
        xml.create_element(element)
            .with_attributes([
                ("valueReference", model.at(output).reference.to_string().as_str()),
                ("dependencies", known.collect::<Vec<_>>().join(" ").as_str()),
            ])
            .write_empty()?;
        Ok(())
    };
    outputs().try_for_each(|o| unknown("Output", o, &|i| model.depends_on_input(o, i)))?;
    outputs().try_for_each(|o| unknown("InitialUnknown", o, &|i| model.depends_at_start(o, i)))
}
