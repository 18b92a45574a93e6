//! `modelDescription.xml` from the variable table (FMI 2.0.4, section 2.2).

use std::io;

use super::common::{
    self, Xml, default_experiment, identifier, identity, items, log_categories, range, type_definitions,
    unit_definitions,
};
use crate::variables::{Causality, Enumeration, Model, Starts, Type, Variable};

/// The document, for an axis of that name with these start values.
pub(super) fn document(name: &str, starts: &Starts) -> io::Result<Vec<u8>> {
    common::document("2.0", "guid", name, starts, content)
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
    unit_definitions(xml, starts)?;
    type_definitions(xml, starts.model, simple_type)?;
    log_categories(xml, "fmi2")?;
    default_experiment(xml, starts)?;
    xml.create_element("ModelVariables").write_inner_content(|xml| {
        for (index, v) in starts.model.all().enumerate() {
            variable(xml, &v, starts.values[index], starts)?;
        }
        Ok(())
    })?;
    xml.create_element("ModelStructure").write_inner_content(|xml| structure(xml, starts.model))?;
    Ok(())
}

fn simple_type(xml: &mut Xml, kind: &Enumeration) -> io::Result<()> {
    xml.create_element("SimpleType")
        .with_attributes([("name", kind.name), ("description", kind.doc)])
        .write_inner_content(|xml| {
            xml.create_element("Enumeration").write_inner_content(|xml| items(xml, kind))?;
            Ok(())
        })?;
    Ok(())
}

fn variable(xml: &mut Xml, v: &Variable, start: f64, starts: &Starts) -> io::Result<()> {
    identity(xml.create_element("ScalarVariable"), v).write_inner_content(|xml| {
        let kind = match v.kind {
            Type::Real => "Real",
            Type::Enumeration(_) => "Enumeration",
        };
        range(xml.create_element(kind), v, start, starts).write_empty()?;
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
