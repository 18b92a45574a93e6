//! `eixo man`.

use std::io::Write as _;
use std::process::ExitCode;

use clap::CommandFactory;

use super::stdout::out;

/// Arguments of `eixo man`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo man > eixo.1 && man ./eixo.1")]
pub struct Args {}

/// Runs the command: the program's page, then each command's, as one.
///
/// # Errors
/// When standard output cannot be written.
pub fn run(_args: Args) -> anyhow::Result<ExitCode> {
    out!("{}", String::from_utf8(page()?)?)?;
    Ok(ExitCode::SUCCESS)
}

fn page() -> std::io::Result<Vec<u8>> {
    let mut program = super::Cli::command().disable_help_subcommand(true);
    program.build();
    let mut text = Vec::new();
    let page = clap_mangen::Man::new(program.clone());
    page.render_title(&mut text)?;
    page.render_name_section(&mut text)?;
    page.render_synopsis_section(&mut text)?;
    page.render_description_section(&mut text)?;
    for command in program.get_subcommands() {
        writeln!(text, ".SH \"EIXO {}\"", command.get_name().to_uppercase())?;
        let mut part = Vec::new();
        let page = clap_mangen::Man::new(command.clone());
        page.render_description_section(&mut part)?;
        page.render_synopsis_section(&mut part)?;
        page.render_options_section(&mut part)?;
        if command.get_after_help().is_some() {
            page.render_extra_section(&mut part)?;
        }
        // A command's sections become the parts of its own section.
        text.extend_from_slice(
            String::from_utf8_lossy(&part).replace(".SH EXTRA", ".SS EXAMPLES").replace(".SH ", ".SS ").as_bytes(),
        );
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_tells_every_command() {
        let text = String::from_utf8(page().unwrap()).unwrap();
        for command in crate::cli::Cli::command().get_subcommands() {
            assert!(text.contains(&format!(".SH \"EIXO {}\"", command.get_name().to_uppercase())), "{text}");
        }
    }
}
