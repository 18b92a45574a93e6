//! `eixo effects`.

use std::fmt::Write as _;
use std::process::ExitCode;

use super::stdout::{layout, out};
use crate::effects::{EFFECTS, Effect, EffectInfo, Role};
use crate::report::{Block, Cell, Table, terminal};

/// Arguments of `eixo effects`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: eixo effects\n         eixo effects backlash")]
pub struct Args {
    /// Tell all of this effect: equation, parameters, signature, literature
    #[arg(value_parser = super::names::effect(), hide_possible_values = true)]
    effect: Option<String>,
    /// Write the list as a Markdown table
    #[arg(long, conflicts_with = "effect")]
    markdown: bool,
}

/// Runs the command.
///
/// # Errors
/// An unknown effect.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let text = match &args.effect {
        Some(id) => detail(Effect::from_id(id)?.info()),
        None if args.markdown => markdown(),
        None => list(),
    };
    out!("{text}")?;
    Ok(ExitCode::SUCCESS)
}

fn list() -> String {
    let mut table = Table::new("", ["effect", "place", "what it is"]);
    for effect in EFFECTS {
        let e = effect.info();
        table.row([e.id, e.place.as_str(), e.title].map(Cell::text).to_vec());
    }
    let more = "`eixo effects ID` tells more of one; parameters are set as ID.NAME=VALUE, all off by default";
    terminal::blocks(&[Block::Table(table), Block::Paragraph(more.to_owned())], layout(WHOLE))
}

/// A line as long as it is, where it goes to no terminal.
const WHOLE: u16 = u16::MAX;

/// A text behind its label, wrapped to the width of the terminal.
fn labelled(label: &str, text: &str) -> String {
    let room = layout(WHOLE).width.saturating_sub(11);
    format!("{label:<11}{}\n", terminal::wrapped(text, room, "           "))
}

fn detail(e: &EffectInfo) -> String {
    let room = layout(WHOLE).width;
    let mut out = terminal::wrapped(&format!("{}: {}", e.id, e.title), room, "") + "\n\n";
    for (label, text) in [
        ("place", e.place.as_str()),
        ("family", e.family.as_str()),
        ("equation", e.equation),
        ("signature", e.signature),
        ("source", e.reference),
    ] {
        out += &labelled(label, text);
    }
    for p in e.parameters {
        let unit = if p.unit.is_empty() { "1" } else { p.unit };
        let meaning = if p.role == Role::Size { "off at" } else { "default" };
        let text = format!("{}; {meaning} {}, from {} to {}", p.doc, p.off, p.min, p.max);
        let text = terminal::wrapped(&text, room.saturating_sub(4), "    ");
        let _ = writeln!(out, "\n{}.{} [{unit}]\n    {text}", e.id, p.name);
    }
    out
}

fn markdown() -> String {
    let mut out =
        String::from("| effect | place | what it is | signature in the residual torques |\n|---|---|---|---|\n");
    for effect in EFFECTS {
        let e = effect.info();
        let _ = writeln!(out, "| `{}` | {} | {} | {} |", e.id, e.place.as_str(), e.title, e.signature);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readme_has_the_table_of_effects() {
        let readme = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md"));
        assert!(readme.contains(&markdown()), "put the output of `eixo effects --markdown` into README.md");
    }

    #[test]
    fn every_parameter_of_every_effect_is_told() {
        for e in EFFECTS.iter().map(|e| e.info()) {
            let text = detail(e);
            for p in e.parameters {
                assert!(text.contains(&format!("\n{}.{} [", e.id, p.name)), "{text}");
            }
        }
    }
}
