//! `eixo-fmi-crate-importer FMU STEP [NAME=VALUE...] < torques > outputs`: one torque a line in, the outputs after each
//! step out, separated by spaces. First line: the outputs after initialisation.

use std::io::{self, BufRead, Write};

use fmi::fmi2::import::Fmi2Import;
use fmi::fmi2::instance::{CoSimulation, Common};
use fmi::import;
use fmi::traits::FmiImport;

const OUTPUTS: [&str; 7] = ["theta1", "omega1", "alpha1", "theta2", "omega2", "alpha2", "x2"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().ok_or("no FMU given")?;
    let step: f64 = args.next().ok_or("no step given")?.parse()?;
    let import: Fmi2Import = import::from_path(path)?;
    let reference = |name: &str| {
        let variables = &import.model_description().model_variables.variables;
        variables
            .iter()
            .find(|v| v.name == name)
            .map(|v| v.value_reference)
            .ok_or_else(|| format!("no variable {name}"))
    };
    let outputs = OUTPUTS.map(reference).into_iter().collect::<Result<Vec<_>, _>>()?;
    let torque = reference("T")?;
    let mut instance = import.instantiate_cs("axis", false, true)?;
    for setting in args {
        let (name, value) = setting.split_once('=').ok_or("write NAME=VALUE")?;
        instance.set_real(&[reference(name)?], &[value.parse()?])?;
    }
    instance.setup_experiment(None, 0.0, None)?;
    instance.enter_initialization_mode()?;
    let mut values = [0.0; OUTPUTS.len()];
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut k = 0;
    for line in io::stdin().lock().lines() {
        instance.set_real(&[torque], &[line?.trim().parse()?])?;
        if k == 0 {
            instance.exit_initialization_mode()?;
            print(&mut out, &mut instance, &outputs, &mut values)?;
        }
        instance.do_step(f64::from(k) * step, step, true)?;
        print(&mut out, &mut instance, &outputs, &mut values)?;
        k += 1;
    }
    instance.terminate()?;
    Ok(out.flush()?)
}

fn print(
    out: &mut impl Write,
    instance: &mut impl Common,
    references: &[u32],
    values: &mut [f64],
) -> Result<(), Box<dyn std::error::Error>> {
    instance.get_real(references, values)?;
    let texts: Vec<String> = values.iter().map(|v| format!("{v:e}")).collect();
    writeln!(out, "{}", texts.join(" "))?;
    Ok(())
}
