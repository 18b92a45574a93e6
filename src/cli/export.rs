//! `eixo export`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;

use super::drives::Drives;
use super::outputs;
use super::stdout::{out, out_line};
use crate::fmu::archive::{Archive, Limits};
use crate::fmu::description::{Description, Fmi};
use crate::fmu::isolation;
use crate::fmu::output;
use crate::fmu::package::{Package, XyTable};
use crate::fmu::validation::{Options, validate};
use crate::trace::{Machine, write_text};

/// Arguments of `eixo export`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  eixo export axis.fmu --axis axis.toml\n  eixo export table.ssp --axis x.toml --y y.toml"
)]
pub struct Args {
    /// The FMU to write; with the name's end .ssp an XY table of two axes and their drives (SSP 1.0)
    pub fmu: PathBuf,
    /// Machine whose parameters and effects become the start values; without it the paper's axis with every effect off
    #[arg(long, value_name = "AXIS.TOML")]
    pub axis: Option<PathBuf>,
    /// Version of FMI
    #[arg(long, value_enum, default_value_t = Version::Two, conflicts_with = "y")]
    pub fmi: Version,
    /// Write the FMU of the axis' drive in place of the axis
    #[arg(long, conflicts_with = "y")]
    pub drive: bool,
    /// For an XY table (FILE.ssp): the Y axis, stacked on the X axis of --axis; as X without
    #[arg(long, value_name = "AXIS.TOML")]
    pub y: Option<PathBuf>,
    /// For an XY table: no connectors of the system itself, for tools that know only its components (ecos)
    #[arg(long)]
    pub bare: bool,
    /// Validate the FMU that was written, as `eixo validate` does
    #[arg(long, conflicts_with = "y")]
    pub check: bool,
    /// The drives.
    #[command(flatten)]
    pub drives: Drives,
}

/// A version of FMI.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Version {
    /// FMI 2.0
    #[value(name = "2")]
    Two,
    /// FMI 3.0
    #[value(name = "3")]
    Three,
}

/// Runs the command.
///
/// # Errors
/// When the axis file cannot be used, or the FMU cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    outputs::check(args.axis.as_deref().into_iter().chain(args.y.as_deref()), [], [Some(&args.fmu)])?;
    let x = args.axis.as_deref().map(Machine::read).transpose()?;
    if args.fmu.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp")) {
        anyhow::ensure!(args.fmi == Version::Two, "--fmi 3 writes an FMU: give {} the end .fmu", args.fmu.display());
        anyhow::ensure!(!args.drive, "--drive writes an FMU: give {} the end .fmu", args.fmu.display());
        anyhow::ensure!(!args.check, "--check is for an FMU: give {} the end .fmu", args.fmu.display());
        return table(&args, x.unwrap_or_default());
    }
    anyhow::ensure!(
        args.y.is_none() && !args.bare,
        "--y and --bare are for an XY table: give {} the end .ssp",
        args.fmu.display()
    );
    let file = || args.axis.as_ref().map_or_else(String::new, |path| path.display().to_string());
    let package = match x {
        Some(machine) if !args.drive => Package::of(&machine).with_context(file)?,
        None if !args.drive => Package::default(),
        machine => {
            let machine = machine.unwrap_or_default();
            let [axis, _] = args.drives.axes(&machine, &machine)?;
            let (gains, rho, motion) = (axis.servo.gains, axis.parameters.rho, machine.signals.motion);
            Package::drive("drive", &gains, rho, args.drives.dt, motion).with_context(file)?
        }
    };
    let (fmi, spelt) = match args.fmi {
        Version::Two => (Fmi::Two, "2.0"),
        Version::Three => (Fmi::Three, "3.0"),
    };
    let package = Package { fmi, ..package };
    let bytes = package.archive()?;
    read_back(&bytes, "modelDescription.xml").with_context(file)?;
    write_text(&args.fmu, &bytes)?;
    let platforms: Vec<&str> = Package::platforms().collect();
    out_line!("{}: FMI {spelt} co-simulation, {}, for {}", args.fmu.display(), package.name, platforms.join(" and "))?;
    if args.check { check(&args.fmu) } else { Ok(ExitCode::SUCCESS) }
}

/// Validates what was written; the FMU runs in child processes, as any other.
fn check(fmu: &Path) -> anyhow::Result<ExitCode> {
    let options = Options::new(std::env::current_exe().context("cannot find this program's own file")?);
    isolation::adopt_orphans();
    let report = validate(fmu, &options, &|_, _| {});
    isolation::end_orphans();
    let report = report?;
    out!("{}", output::text(&report, false, false, false))?;
    Ok(if report.passes(false) { ExitCode::SUCCESS } else { ExitCode::from(super::FINDINGS) })
}

/// Reads an archive back before it has its name: every part whole, the description one that a tool can read.
pub(super) fn read_back(bytes: &[u8], description: &str) -> anyhow::Result<()> {
    let read = || -> anyhow::Result<()> {
        let mut archive = Archive::from_bytes(bytes.to_vec(), Limits::default())?;
        archive.test()?;
        let text = archive.read(description)?;
        if description == "modelDescription.xml" {
            Description::parse(&text)?;
            return Ok(());
        }
        for entry in archive.entries().iter().map(|e| e.name.clone()).collect::<Vec<_>>() {
            if entry.ends_with(".fmu") {
                read_back(&archive.read(&entry)?, "modelDescription.xml")?;
            }
        }
        Ok(())
    };
    read().context("what was made does not read back; nothing is written. Is there an odd character in its name?")
}

/// The XY table: X carries Y.
fn table(args: &Args, x: Machine) -> anyhow::Result<ExitCode> {
    let y = args.y.as_deref().map(Machine::read).transpose()?.unwrap_or_else(|| x.clone());
    let [of_x, of_y] = args.drives.axes(&x, &y)?;
    let name = if x.name == y.name { x.name.clone() } else { format!("{} and {}", x.name, y.name) };
    let axes = [(of_x, x.signals.motion), (of_y, y.signals.motion)];
    let table = XyTable { name, axes, dt: args.drives.dt, connectors: !args.bare };
    let bytes = table.archive()?;
    read_back(&bytes, "SystemStructure.ssd")?;
    write_text(&args.fmu, &bytes)?;
    let step = args.drives.dt;
    out_line!(
        "{}: SSP 1.0, {}: x_axis, x_drive, y_axis, y_drive, made for steps of {step} s",
        args.fmu.display(),
        table.name
    )?;
    Ok(ExitCode::SUCCESS)
}
