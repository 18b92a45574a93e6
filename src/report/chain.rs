//! The chain from the command to the trace, with the place of the gap marked.
//!
//! ```text
//! command --> [input] --> T --> [motor: I1] == [coupling: K, B] == [table: I2] --> [sensor] --> trace
//! command --> [input] --> T --> [rigid axis: I] --> [sensor] --> trace
//! ```

use std::fmt::Write as _;

use maud::{Markup, html};

use super::format::{self, Medium};
use super::plot::{Size, cut, px};

/// The chain as data: its places in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChainDiagram {
    /// Heading above the drawing.
    pub title: String,
    /// The places from the command to the trace.
    pub places: Vec<Place>,
}

/// One place of the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Its name.
    pub name: String,
    /// What it is drawn as.
    pub symbol: Symbol,
    /// A line under the name: its parameters, or the effect found there.
    pub note: String,
    /// Its share of the gap, 0..=1.
    pub share: Option<f64>,
    /// Whether the gap lies here.
    pub marked: bool,
}

/// What a place is drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symbol {
    /// A drive: a held command.
    Input,
    /// An inertia with a rotor.
    Motor,
    /// A spring and a damper.
    Coupling,
    /// An inertia on a slide.
    Table,
    /// Motor, coupling and table as one inertia.
    Axis,
    /// An encoder.
    Sensor,
}

/// The drawing as one `svg` element: left to right where it is wide, downwards where it is narrow.
pub(super) fn svg(chain: &ChainDiagram, size: Size) -> Markup {
    if size.width > 600.0 { wide(chain, size.width) } else { narrow(chain, size.width) }
}

fn wide(chain: &ChainDiagram, width: f64) -> Markup {
    let n = chain.places.len().max(1) as f64;
    // Room for the signal's name before the first place and behind the last.
    let ends = 34.0;
    let column = (width - 2.0 * ends) / n;
    let (middle, height) = (78.0, 206.0);
    let centre = |i: usize| ends + column * (i as f64 + 0.5);
    html! {
        (open(chain, width, height, html! {
            @for (i, p) in chain.places.iter().enumerate() {
                @if p.marked {
                    rect class="here" x=(px(centre(i) - 0.5 * column + 10.0)) y="22" width=(px(column - 20.0)) height=(px(height - 26.0)) rx="8" {}
                    text class="tag" x=(px(centre(i))) y="15" text-anchor="middle" { "▼ the gap is here" }
                }
            }
            @for (i, p) in chain.places.iter().enumerate() {
                @let cx = centre(i);
                @if i == 0 {
                    (arrow(4.0, cx - 40.0, middle, true))
                    text class="note" x="4" y=(px(middle - 8.0)) { "command" }
                }
                @match chain.places.get(i + 1) {
                    Some(next) => {
                        @let shaft = is_shaft(p.symbol, next.symbol);
                        (link(cx + 40.0, cx + column - 40.0, middle, shaft, true))
                        @if p.symbol == Symbol::Input {
                            text class="note" x=(px(cx + 0.5 * column)) y=(px(middle - 8.0)) text-anchor="middle" { "T" }
                        }
                    }
                    None => {
                        (arrow(cx + 40.0, width - 4.0, middle, true))
                        text class="note" x=(px(width - 6.0)) y=(px(middle - 8.0)) text-anchor="end" { "trace" }
                    }
                }
                (symbol(p.symbol, cx, middle))
                text class="name" x=(px(cx)) y="138" text-anchor="middle" { (p.name) }
                text class="note" x=(px(cx)) y="156" text-anchor="middle" { (cut(&p.note, column - 28.0)) }
                (share(p, cx - 55.0, 172.0, 110.0))
            }
        }))
    }
}

fn narrow(chain: &ChainDiagram, width: f64) -> Markup {
    let row = 84.0;
    let height = row * chain.places.len() as f64 + 36.0;
    let cx = 62.0;
    html! {
        (open(chain, width, height, html! {
            text class="note" x=(px(cx + 10.0)) y="13" { "command" }
            @for (i, p) in chain.places.iter().enumerate() {
                @let cy = 18.0 + row * (i as f64 + 0.5);
                @if p.marked {
                    rect class="here" x="4" y=(px(cy - 0.5 * row + 5.0)) width=(px(width - 8.0)) height=(px(row - 10.0)) rx="8" {}
                }
                @let before = i.checked_sub(1).and_then(|k| chain.places.get(k));
                @match before {
                    Some(b) => {
                        (link(cy - row + 32.0, cy - 32.0, cx, is_shaft(b.symbol, p.symbol), false))
                        @if b.symbol == Symbol::Input { text class="note" x=(px(cx + 10.0)) y=(px(cy - 0.5 * row + 4.0)) { "T" } }
                    }
                    None => { (arrow(2.0, cy - 24.0, cx, false)) }
                }
                (symbol(p.symbol, cx, cy))
                text class="name" x="124" y=(px(cy - 14.0)) { (p.name) }
                @if p.marked { text class="tag" x=(px(width - 14.0)) y=(px(cy - 14.0)) text-anchor="end" { "◀ the gap is here" } }
                text class="note" x="124" y=(px(cy + 4.0)) { (cut(&p.note, width - 136.0)) }
                (share(p, 124.0, cy + 14.0, 110.0))
            }
            (arrow(height - 50.0, height - 4.0, cx, false))
            text class="note" x=(px(cx + 10.0)) y=(px(height - 5.0)) { "trace" }
        }))
    }
}

fn open(chain: &ChainDiagram, width: f64, height: f64, inner: Markup) -> Markup {
    html! {
        svg class="chain" xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (px(width)) " " (px(height)) } role="img" aria-label=(summary(chain)) {
            title { (chain.title) }
            (inner)
        }
    }
}

fn share(p: &Place, x: f64, y: f64, room: f64) -> Markup {
    let Some(value) = p.share else { return html! {} };
    let bar = room - 52.0;
    html! {
        rect class="bar-back" x=(px(x)) y=(px(y)) width=(px(bar)) height="8" rx="2" {}
        rect class=(if p.marked { "bar on" } else { "bar" }) x=(px(x)) y=(px(y)) width=(px(bar * value.clamp(0.0, 1.0))) height="8" rx="2" {}
        text class="note" x=(px(x + bar + 6.0)) y=(px(y + 8.0)) { (format::percent(value, Medium::Page)) }
    }
}

/// Whether two neighbours are joined by a shaft rather than by a signal.
fn is_shaft(a: Symbol, b: Symbol) -> bool {
    let mechanical = |s| matches!(s, Symbol::Motor | Symbol::Coupling | Symbol::Table | Symbol::Axis);
    mechanical(a) && mechanical(b)
}

fn link(from: f64, to: f64, across: f64, shaft: bool, level: bool) -> Markup {
    if !shaft {
        return arrow(from, to, across, level);
    }
    let d = [-4.0, 4.0].iter().fold(String::new(), |mut d, off| {
        let _ = if level {
            write!(d, "M{} {}H{}", px(from), px(across + off), px(to))
        } else {
            write!(d, "M{} {}V{}", px(across + off), px(from), px(to))
        };
        d
    });
    html! { path class="wire" d=(d) {} }
}

fn arrow(from: f64, to: f64, across: f64, level: bool) -> Markup {
    let (wire, head) = if level {
        (format!("M{} {}H{}", px(from), px(across), px(to - 6.0)), format!("M{} {}l-8 -4.5v9Z", px(to), px(across)))
    } else {
        (format!("M{} {}V{}", px(across), px(from), px(to - 6.0)), format!("M{} {}l-4.5 -8h9Z", px(across), px(to)))
    };
    html! { path class="wire" d=(wire) {} path class="head" d=(head) {} }
}

/// A symbol in a box of 80 by 64 about its centre.
fn symbol(symbol: Symbol, cx: f64, cy: f64) -> Markup {
    let at = format!("translate({} {})", px(cx), px(cy));
    html! {
        g class="symbol" transform=(at) {
            @match symbol {
                Symbol::Input => {
                    rect x="-40" y="-24" width="80" height="48" rx="4" {}
                    path d="M-28 10h9v-14h10v-8h10v14h10v8h9v-6h8" {}
                }
                Symbol::Motor => {
                    rect x="-40" y="-28" width="80" height="56" rx="6" {}
                    circle cx="-6" cy="0" r="18" {}
                    path d="M24 -28v56" {}
                    text x="-6" y="5" text-anchor="middle" { "I₁" }
                }
                Symbol::Coupling => {
                    rect class="blank" x="-40" y="-30" width="80" height="60" {}
                    path d="M-40 -4h8M-40 4h8M-32 -20v40M32 -20v40M32 -4h8M32 4h8" {}
                    path d="M-32 -14h8l3 -7l6 14l6 -14l6 14l6 -14l6 14l3 -7h20" transform="translate(0 -1)" {}
                    path d="M-32 14h24M-8 5v18M4 3h-10M4 25h-10M4 3M2 14h30" {}
                    path d="M-6 5h14M-6 23h14M-1 8v12" {}
                }
                Symbol::Table => {
                    rect x="-40" y="-26" width="80" height="38" rx="3" {}
                    path d="M-48 22h96M-26 12v10M26 12v10" {}
                    text x="0" y="-2" text-anchor="middle" { "I₂" }
                }
                Symbol::Axis => {
                    rect x="-40" y="-26" width="80" height="38" rx="3" {}
                    circle cx="-20" cy="-7" r="12" {}
                    path d="M-48 22h96M-26 12v10M26 12v10" {}
                    text x="14" y="-2" text-anchor="middle" { "I" }
                }
                Symbol::Sensor => {
                    rect x="-40" y="-24" width="80" height="48" rx="4" {}
                    path d="M-28 8v-16M-20 8v-9M-12 8v-9M-4 8v-16M4 8v-9M12 8v-9M20 8v-16M28 8v-9M-30 8h60" {}
                }
            }
        }
    }
}

/// The chain in words, for who cannot see it.
fn summary(chain: &ChainDiagram) -> String {
    let mut out =
        format!("{}: ", if chain.title.is_empty() { "The chain from command to trace" } else { &chain.title });
    for (i, p) in chain.places.iter().enumerate() {
        let _ = write!(out, "{}{}", if i > 0 { ", " } else { "" }, p.name);
        if let Some(share) = p.share {
            let _ = write!(out, " {}", format::percent(share, Medium::Page));
        }
        if p.marked {
            out.push_str(" (the gap is here)");
        }
    }
    out.push('.');
    out
}
