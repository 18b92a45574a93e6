//! `eixo serve`.

use std::path::PathBuf;
use std::process::ExitCode;

use super::stdout::out_line;
use crate::serve::{Settings, serve};

/// Arguments of `eixo serve`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo serve --folder diagnoses")]
pub struct Args {
    /// The folder that keeps the logs and what is made of them; it is made where it is missing
    #[arg(long, value_name = "FOLDER", default_value = "eixo-logs")]
    folder: PathBuf,
    /// The port on 127.0.0.1; 0 for any that is free
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Largest log that is taken, MB
    #[arg(long, value_name = "MB", default_value_t = 512, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    most: u64,
}

/// Runs the command.
///
/// # Errors
/// When the folder or the port cannot be used.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let folder = args.folder.display().to_string();
    serve(Settings { folder: args.folder, port: args.port, most: args.most * 1_000_000 }, |address| {
        out_line!("{address}")?;
        out_line!("Open this address in a browser of this computer: it is served to no other, and nothing leaves it.")?;
        out_line!("Logs and results are kept in {folder}. Ctrl-C ends it.")?;
        Ok(())
    })?;
    Ok(ExitCode::SUCCESS)
}
