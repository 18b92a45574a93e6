//! `modelDescription.xml` of FMI 3.0 from the variable table (FMI 3.0, section 2.4).

use std::io;

use super::common::{
    self, Xml, default_experiment, identifier, identity, items, log_categories, range, type_definitions,
    unit_definitions,
};
use crate::fmi3::TIME_REFERENCE;
use crate::variables::{Causality, Enumeration, Model, Starts, Type, Variable};

/// The document, for an axis of that name with these start values.
pub(super) fn document(name: &str, starts: &Starts) -> io::Result<Vec<u8>> {
    common::document("3.0", "instantiationToken", name, starts, content)
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
    unit_definitions(xml, starts)?;
    type_definitions(xml, starts.model, enumeration_type)?;
    log_categories(xml, "fmi3")?;
    default_experiment(xml, starts)?;
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

fn enumeration_type(xml: &mut Xml, kind: &Enumeration) -> io::Result<()> {
    xml.create_element("EnumerationType")
        .with_attributes([("name", kind.name), ("description", kind.doc)])
        .write_inner_content(|xml| items(xml, kind))?;
    Ok(())
}

fn variable(xml: &mut Xml, v: &Variable, start: f64, starts: &Starts) -> io::Result<()> {
    let kind = match v.kind {
        Type::Real => "Float64",
        Type::Enumeration(_) => "Enumeration",
    };
    range(identity(xml.create_element(kind), v), v, start, starts).write_empty()?;
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
