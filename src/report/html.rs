//! One self-contained HTML page: inline style and SVG and one small script of ours, nothing fetched. Without the script the
//! page is whole; with it plots can be zoomed and read.
//!
//! Every text is escaped by the template (maud escapes all that is not markup of ours); what could steer a terminal or
//! the direction of the text is taken out of the finished page. The page's own policy forbids the network, and every script but
//! the one whose hash it names.

use maud::{DOCTYPE, Markup, html};
use sha2::{Digest, Sha256};

use super::chart::{Colour, Dash, Mark, Shape, When};
use super::format::{self, Medium};
use super::plot::{self, Size};
use super::{Block, Cell, Drawing, Figure, Report, Section, Summary, Table, Tone, chain, polar};

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("script.js");

/// What the page may do: show its own style, and run the script of this hash (Content Security Policy Level 3, section 2.3.1).
fn policy() -> String {
    format!(
        "default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{}'; img-src data:; form-action 'none'; base-uri 'none'",
        base64(&Sha256::digest(SCRIPT))
    )
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for three in bytes.chunks(3) {
        let word = three.iter().fold(0_u32, |w, b| w << 8 | u32::from(*b)) << (8 * (3 - three.len()));
        for k in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * k) & 63) as usize];
            out.push(if k > three.len() { '=' } else { char::from(letter) });
        }
    }
    out
}

/// The page as one string.
#[must_use]
pub fn page(report: &Report) -> String {
    let headings: Vec<(usize, &str)> = report
        .sections
        .iter()
        .enumerate()
        .filter(|(_, s)| !s.heading.is_empty())
        .map(|(i, s)| (i, s.heading.as_str()))
        .collect();
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy" content=(policy());
                title { (report.title) }
                style { (maud::PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (report.title) }
                    @if !report.subject.is_empty() { p class="subject" { (report.subject) } }
                }
                @if headings.len() > 2 {
                    nav aria-label="Sections" { @for (i, h) in &headings { a href={ "#s" (i) } { (h) } } }
                }
                main { @for (i, s) in report.sections.iter().enumerate() { (section(i, s)) } }
                @if !report.footer.is_empty() { footer { (report.footer) } }
                @if has_plots(report) { script { (maud::PreEscaped(SCRIPT)) } }
            }
        }
    };
    format::printable(&markup.into_string()).into_owned()
}

/// Whether there is anything for the script to do.
fn has_plots(report: &Report) -> bool {
    fn any(blocks: &[Block]) -> bool {
        let plot = |f: &Figure| !matches!(f.drawing, Drawing::Chain(_));
        blocks.iter().any(|b| match b {
            Block::Figure(f) => plot(f),
            Block::Figures(all) => all.iter().any(plot),
            Block::Details(_, inner) => any(inner),
            _ => false,
        })
    }
    report.sections.iter().any(|s| any(&s.blocks))
}

fn section(index: usize, section: &Section) -> Markup {
    html! {
        section id={ "s" (index) } {
            @if !section.heading.is_empty() { h2 { (section.heading) } }
            @for b in &section.blocks { (block(b)) }
        }
    }
}

fn block(block: &Block) -> Markup {
    match block {
        Block::Summary(v) => verdict(v),
        Block::Paragraph(text) => html! { p { (prose(text)) } },
        Block::Warning(text) => {
            html! { p class="warning" role="note" { span class="sign" aria-hidden="true" { "!" } span { (prose(text)) @if text.ends_with(char::is_alphanumeric) { "." } } } }
        }
        Block::Steps(steps) => html! { ol class="steps" { @for s in steps { li { (prose(s)) } } } },
        Block::KeyValues(pairs) => key_values(pairs),
        Block::Table(t) => table(t),
        Block::Figure(f) => html! { div class="full" { (figure(f, Size { width: 1040.0, height: 330.0 })) } },
        // One alone has the whole width, and is drawn for it: scaled up, its letters were twice those of the page.
        Block::Figures(all) if all.len() == 1 => html! { @for f in all { (self::block(&Block::figure(f.clone()))) } },
        Block::Figures(all) => {
            html! { div class="grid2" { @for f in all { (figure(f, Size { width: 510.0, height: 310.0 })) } } }
        }
        Block::Details(summary, blocks) => {
            html! { details { summary { (prose(summary)) } @for b in blocks { (self::block(b)) } } }
        }
    }
}

fn verdict(v: &Summary) -> Markup {
    let (class, sign, name) = match v.tone {
        Tone::Good => ("good", "✓", "Good"),
        Tone::Finding => ("finding", "!", "Finding"),
        Tone::Unsure => ("unsure", "?", "Not sure"),
        Tone::Neutral => ("neutral", "i", "Result"),
    };
    html! {
        div class={ "verdict " (class) } {
            div class="sentence" {
                span class="sign" role="img" aria-label=(name) { (sign) }
                p { (prose(&v.sentence)) }
            }
            @if !v.detail.is_empty() { p class="detail" { (prose(&v.detail)) } }
            @if !v.figures.is_empty() {
                dl class="figures" { @for (k, c) in &v.figures { div { dt { (prose(k)) } dd { (format::cell(c, Medium::Page)) } } } }
            }
        }
    }
}

fn key_values(pairs: &[(String, Cell)]) -> Markup {
    html! { dl class="pairs" { @for (k, c) in pairs { div { dt { (prose(k)) } dd { (format::cell(c, Medium::Page)) } } } } }
}

fn table(t: &Table) -> Markup {
    // A column is set flush right when all that stands in it is numbers.
    let numeric: Vec<bool> = (0..t.columns.len())
        .map(|c| {
            let mut cells = t.rows.iter().filter_map(|r| r.cells.get(c)).filter(|c| **c != Cell::Empty).peekable();
            cells.peek().is_some() && cells.all(Cell::is_numeric)
        })
        .collect();
    // What fits on no phone is set a row after the other there, each cell behind its heading; print shrinks by the columns.
    let room = match t.columns.len() {
        0..4 => "",
        4..8 => " many",
        _ => " many very",
    };
    let class = |c: usize| numeric.get(c).copied().unwrap_or(false).then_some("num");
    html! {
        div class={ "scroll" (room) } role="region" tabindex="0" aria-label=(prose(&t.caption)) {
            table {
                @if !t.caption.is_empty() { caption { (prose(&t.caption)) } }
                thead { tr { @for (c, name) in t.columns.iter().enumerate() { th scope="col" class=[class(c)] { (broken(&heading(name))) } } } }
                tbody {
                    @for r in &t.rows {
                        tr class=[r.strong.then_some("strong")] {
                            @for (c, cell) in r.cells.iter().enumerate() {
                                td class=[class(c).or(short(cell))] data-head=[t.columns.get(c).map(|n| heading(n))] { (cell_markup(cell)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Words as short as a date or an effect's name are not cut within, however narrow the page.
fn short(cell: &Cell) -> Option<&'static str> {
    let brief = |text: &str| text.chars().count() <= 16 && !text.is_empty();
    matches!(cell, Cell::Text(text) | Cell::Link(text, _) if brief(text)).then_some("short")
}

/// A sentence of the page.
fn prose(text: &str) -> std::borrow::Cow<'_, str> {
    format::prose(text, Medium::Page)
}

/// A heading with the unit in its brackets typeset.
fn heading(name: &str) -> String {
    match (name.rfind('['), name.ends_with(']')) {
        (Some(at), true) => format!("{}[{}]", &name[..at], format::unit(&name[at + 1..name.len() - 1], Medium::Page)),
        _ => name.to_owned(),
    }
}

/// A heading that may be broken within a parameter's name, so that no column is as wide as `viscous_motor.coefficient`.
fn broken(name: &str) -> Markup {
    html! { @for part in name.split_inclusive(['.', '_']) { (part) wbr; } }
}

fn cell_markup(cell: &Cell) -> Markup {
    let text = format::cell(cell, Medium::Page);
    match cell {
        Cell::Bar(share) => {
            let width = if share.is_finite() { share.clamp(0.0, 1.0) * 100.0 } else { 0.0 };
            html! {
                span class="share" {
                    span class="track" aria-hidden="true" { span style=(format!("width:{width:.1}%")) {} }
                    span { (text) }
                }
            }
        }
        Cell::Link(_, path) if is_plain(path) => html! { a href=(path) { (text) } },
        _ => html! { (text) },
    }
}

/// Whether a path leads to a file in the folder of the page or below it: no scheme, no `..`.
fn is_plain(path: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
    path.chars().all(plain) && !path.starts_with('/') && !path.split('/').any(|part| part == "..")
}

/// A figure in two layouts of which the style sheet shows the one that suits the room it has.
fn figure(f: &Figure, wide: Size) -> Markup {
    let narrow = Size { width: 350.0, height: 270.0 };
    let square = Size { width: 430.0, height: 430.0 };
    html! {
        figure {
            @match &f.drawing {
                Drawing::Chart(c) => {
                    @if !c.title.is_empty() { h3 { (c.title) } }
                    (legend(c.series.iter().enumerate().map(|(i, s)| {
                        let sign = match s.shape { Shape::Points => Sign::Dot, Shape::Band { .. } => Sign::Patch, _ => Sign::Line(s.dash) };
                        Entry { index: Some(i), name: &s.name, colour: s.colour.unwrap_or(Colour::nth(i)), sign, when: s.when }
                    }).chain(c.marks.iter().filter_map(|m| {
                        // The name of a line across the plot would stand in the middle of the data.
                        let Mark::Y(_, name) = m else { return None };
                        Some(Entry { index: None, name, colour: Colour::Grey, sign: Sign::Mark, when: None })
                    }))))
                    div class="wide" { (plot::svg(c, wide)) }
                    div class="narrow" { (plot::svg(c, narrow)) }
                }
                Drawing::Polar(p) => {
                    @if !p.title.is_empty() { h3 { (p.title) } }
                    (legend(p.traces.iter().enumerate().map(|(i, t)| {
                        Entry { index: Some(i), name: &t.name, colour: t.colour.unwrap_or(Colour::nth(i)), sign: Sign::Line(t.dash), when: None }
                    })))
                    div class="square" { (polar::svg(p, square)) }
                }
                Drawing::Chain(c) => {
                    @if !c.title.is_empty() { h3 { (c.title) } }
                    div class="wide" { (chain::svg(c, wide)) }
                    div class="narrow" { (chain::svg(c, narrow)) }
                }
            }
            @if !f.caption.is_empty() { figcaption { (prose(&f.caption)) } }
        }
    }
}

/// What stands before a name in the legend.
enum Sign {
    Line(Dash),
    Dot,
    Patch,
    Mark,
}

/// A line of the legend: which series it is of; none of a reference line.
struct Entry<'a> {
    index: Option<usize>,
    name: &'a str,
    colour: Colour,
    sign: Sign,
    when: Option<When>,
}

fn legend<'a>(entries: impl Iterator<Item = Entry<'a>>) -> Markup {
    let named: Vec<Entry> = entries.filter(|e| !e.name.is_empty()).collect();
    html! {
        @if !named.is_empty() {
            ul class="legend" {
                @for e in &named {
                    li data-s=[e.index] data-when=[e.when.map(When::name)] {
                        svg class=(e.colour.class()) viewBox="0 0 28 12" width="28" height="12" aria-hidden="true" {
                            @match &e.sign {
                                Sign::Line(dash) => { path class=(dash.class()) stroke-dasharray=[dash.pattern()] d="M1 6H27" {} }
                                Sign::Dot => { path class="dots" d="M7 6h0M14 6h0M21 6h0" {} }
                                Sign::Mark => { path class="mark" d="M1 6H27" {} }
                                Sign::Patch => { path class="band" d="M1 1H27V11H1Z" {} }
                            }
                        }
                        (prose(e.name))
                    }
                }
            }
        }
    }
}
