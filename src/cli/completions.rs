//! `eixo completions`.

use std::process::ExitCode;

use clap::CommandFactory;

use super::stdout::out;

/// Arguments of `eixo completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo completions bash > ~/.local/share/bash-completion/completions/eixo")]
pub struct Args {
    /// The shell
    shell: clap_complete::Shell,
}

/// Runs the command.
///
/// # Errors
/// When standard output cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut super::Cli::command(), "eixo", &mut text);
    out!("{}", String::from_utf8(text)?)?;
    Ok(ExitCode::SUCCESS)
}
