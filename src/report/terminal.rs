//! The same report as text: verdict, paragraphs, values and tables. Figures stay in the page.

use std::fmt::Write as _;

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Width, presets};

use super::format::{self, Medium, printable};
use super::{Block, Cell, Report, Summary, Table, Tone};

/// How the text is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Characters a line.
    pub width: u16,
    /// Whether escape sequences for bold and colour are wanted.
    pub colour: bool,
}

impl Default for Layout {
    fn default() -> Self {
        Self { width: 100, colour: false }
    }
}

/// The whole report.
#[must_use]
pub fn render(report: &Report, layout: Layout) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{}", bold(&printable(&report.title), layout));
    if !report.subject.is_empty() {
        let _ = writeln!(out, "{}", wrapped(&report.subject, layout.width, ""));
    }
    for section in &report.sections {
        let mut text = blocks(&section.blocks, layout);
        if text.trim().is_empty() {
            continue;
        }
        out.push('\n');
        if !section.heading.is_empty() {
            text.insert_str(0, &format!("{}\n", bold(&printable(&section.heading), layout)));
        }
        out.push_str(&text);
    }
    out
}

/// Some blocks, each ending in a line end, an empty line between.
#[must_use]
pub fn blocks(blocks: &[Block], layout: Layout) -> String {
    let mut parts = Vec::new();
    for b in blocks {
        let text = match b {
            Block::Summary(v) => verdict(v, layout),
            Block::Paragraph(text) => wrapped(text, layout.width, ""),
            Block::Warning(text) => {
                let lines = wrapped(&format!("warning: {text}"), layout.width.saturating_sub(2), "  ");
                lines.replacen("warning:", &painted("warning:", Tone::Finding, layout), 1)
            }
            Block::Steps(steps) => steps
                .iter()
                .enumerate()
                .map(|(i, s)| format!("{}. {}", i + 1, wrapped(s, layout.width.saturating_sub(3), "   ")))
                .collect::<Vec<_>>()
                .join("\n"),
            Block::KeyValues(pairs) => key_values(pairs),
            Block::Table(t) => table(t, layout),
            Block::Figure(_) | Block::Figures(_) | Block::Details(..) => continue,
        };
        parts.push(text);
    }
    if parts.is_empty() { String::new() } else { parts.join("\n\n") + "\n" }
}

/// A table within the width of the layout.
#[must_use]
pub fn table(t: &Table, layout: Layout) -> String {
    let mut out = comfy_table::Table::new();
    out.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic).set_width(layout.width);
    // A column of its own for the mark of rows that stand out.
    let marked = t.rows.iter().any(|r| r.strong);
    let lead = |mark: &str| marked.then(|| mark.to_owned());
    out.set_header(lead("").into_iter().chain(t.columns.iter().map(|c| printable(c).into_owned())));
    for r in &t.rows {
        let cells = r.cells.iter().map(|c| printable(&format::cell(c, Medium::Terminal)).into_owned());
        out.add_row(lead(if r.strong { ">" } else { "" }).into_iter().chain(cells));
    }
    // A name or a number is not broken, unless a line has no room for them all.
    let unbroken: Vec<usize> = (0..t.columns.len())
        .map(|i| {
            let cells = t.rows.iter().filter_map(|r| r.cells.get(i)).map(|c| format::cell(c, Medium::Terminal));
            2 + cells.flat_map(|c| longest_word(&c)).chain(longest_word(&t.columns[i])).max().unwrap_or(0)
        })
        .collect();
    let room = usize::from(layout.width).saturating_sub(2 * usize::from(marked));
    let most = if unbroken.iter().sum::<usize>() <= room { room } else { room / unbroken.len().max(1) };
    for (i, column) in out.column_iter_mut().enumerate() {
        column.set_padding((0, if marked && i == 0 { 1 } else { 2 }));
        let Some(i) = i.checked_sub(usize::from(marked)) else { continue };
        let least = u16::try_from(unbroken[i].min(most)).unwrap_or(layout.width);
        column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(least)));
        let mut cells = t.rows.iter().filter_map(|r| r.cells.get(i)).filter(|c| **c != Cell::Empty).peekable();
        if cells.peek().is_some() && cells.all(Cell::is_numeric) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let mut text = String::new();
    if !t.caption.is_empty() {
        let _ = writeln!(text, "{}", wrapped(&t.caption, layout.width, ""));
    }
    for (i, line) in out.lines().enumerate() {
        let line = line.trim_end();
        let _ = writeln!(text, "{}", if i == 0 { bold(line, layout) } else { line.to_owned() });
    }
    text.truncate(text.trim_end().len());
    text
}

fn verdict(v: &Summary, layout: Layout) -> String {
    let sign = match v.tone {
        Tone::Good => "✓",
        Tone::Finding => "!",
        Tone::Unsure => "?",
        Tone::Neutral => "i",
    };
    let mut out = format!(
        "{} {}",
        painted(sign, v.tone, layout),
        bold(&wrapped(&v.sentence, layout.width.saturating_sub(2), "  "), layout)
    );
    if !v.detail.is_empty() {
        let _ = write!(out, "\n  {}", wrapped(&v.detail, layout.width.saturating_sub(2), "  "));
    }
    if !v.figures.is_empty() {
        let _ = write!(out, "\n{}", key_values(&v.figures));
    }
    out
}

fn key_values(pairs: &[(String, Cell)]) -> String {
    let names: Vec<_> = pairs.iter().map(|(k, _)| printable(k)).collect();
    let widest = names.iter().map(|n| n.chars().count()).max().unwrap_or(0);
    let lines = names.iter().zip(pairs).map(|(name, (_, c))| {
        let value = format::cell(c, Medium::Terminal);
        format!("  {name}{}  {}", " ".repeat(widest - name.chars().count()), printable(&value))
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Characters of the longest word, if there is one.
fn longest_word(text: &str) -> Option<usize> {
    text.split_whitespace().map(|word| word.chars().count()).max()
}

/// Text broken at spaces to at most `width` characters a line; further lines begin with `indent`.
pub(crate) fn wrapped(text: &str, width: u16, indent: &str) -> String {
    let width = usize::from(width.max(20));
    let mut lines: Vec<String> = Vec::new();
    for paragraph in printable(text).lines() {
        let mut line = String::new();
        // A percent sign stays with its number.
        for word in paragraph.replace(" %", "\u{a0}%").split([' ', '\t']).filter(|w| !w.is_empty()) {
            if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > width {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        lines.push(line);
    }
    lines.join(&format!("\n{indent}")).replace('\u{a0}', " ")
}

fn bold(text: &str, layout: Layout) -> String {
    if layout.colour { format!("\u{1b}[1m{text}\u{1b}[0m") } else { text.to_owned() }
}

fn painted(text: &str, tone: Tone, layout: Layout) -> String {
    let code = match tone {
        Tone::Good => 32,
        Tone::Finding => 33,
        Tone::Unsure => 35,
        Tone::Neutral => 36,
    };
    if layout.colour { format!("\u{1b}[1;{code}m{text}\u{1b}[0m") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_keeps_its_percent_sign_and_a_name_its_letters() {
        let text = "On held-out data the model's error falls from 2.28 % of the signal to 5.1e-4 % in all.";
        for width in 20..60 {
            let lines = wrapped(text, width, "");
            assert!(lines.lines().all(|l| !l.starts_with('%') && l.chars().count() <= usize::from(width)), "{lines}");
            assert_eq!(lines.replace('\n', " "), text);
        }
        let mut long = Table::new("", ["cause", "parameter", "value"]);
        let cause = "friction of motor and screw that yields before it breaks away, as ever";
        let cells = [cause, "presliding_motor.damping", "6.391058e-4 ± 2.5e-9 N.m.s/rad"];
        long.row(cells.map(|c| Cell::Text(c.to_owned())).to_vec());
        let shown = table(&long, Layout { width: 70, colour: false });
        assert!(shown.contains("presliding_motor.damping"), "{shown}");
    }
}
