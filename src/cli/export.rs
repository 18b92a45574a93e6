//! `eixo export`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;

use crate::fmu::package::Package;
use crate::trace::Machine;

/// Arguments of `eixo export`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The FMU to write
    pub fmu: PathBuf,
    /// Machine whose parameters and effects become the start values; without it the paper's axis with every effect off
    #[arg(long, value_name = "AXIS.TOML")]
    pub axis: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the axis file cannot be used, or the FMU cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let package = match &args.axis {
        None => Package::default(),
        Some(path) => {
            let machine = Machine::read(path)?;
            Package::of(&machine).with_context(|| path.display().to_string())?
        }
    };
    package.write(&args.fmu)?;
    let platforms: Vec<&str> = Package::platforms().collect();
    println!("{}: FMI 2.0 co-simulation, {}, for {}", args.fmu.display(), package.name, platforms.join(" and "));
    Ok(ExitCode::SUCCESS)
}
