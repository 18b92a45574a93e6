//! A report as plain data, and pure functions of it: one self-contained HTML file ([`html::page`]) and the
//! terminal's text ([`terminal::render`]).
//!
//! Nothing here reads a file, a clock or the terminal, so the same report gives the same bytes. Every text may come
//! from outside (column names, file names, model names): it is escaped where HTML is made and nowhere else.

pub mod ballbar;
pub mod chain;
pub mod chart;
pub mod circle;
pub mod demo;
pub mod diagnose;
pub mod driven;
pub mod examine;
pub mod format;
pub mod html;
pub mod identify;
pub mod polar;
pub mod terminal;
pub mod validation;

mod decimate;
mod plot;
mod scale;

pub use chain::{ChainDiagram, Place, Symbol};
pub use chart::{Axis, Chart, Colour, Dash, Mark, Range, Series, Shape, When};
pub use polar::PolarPlot;

/// A whole report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// The first heading and the name of the page.
    pub title: String,
    /// What it is about: the machine and the trace.
    pub subject: String,
    /// The sections in reading order.
    pub sections: Vec<Section>,
    /// Last line: what made it, under which settings.
    pub footer: String,
}

/// A heading and what stands under it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// Heading; an empty one is not drawn (the verdict needs none).
    pub heading: String,
    /// Blocks in reading order.
    pub blocks: Vec<Block>,
}

impl Section {
    /// A section of these blocks.
    pub fn new(heading: impl Into<String>, blocks: Vec<Block>) -> Self {
        Self { heading: heading.into(), blocks }
    }
}

/// One piece of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// The result in one sentence.
    Summary(Summary),
    /// Running text.
    Paragraph(String),
    /// Something the reader must know before trusting the figures.
    Warning(String),
    /// A numbered list of things to do.
    Steps(Vec<String>),
    /// Names and values.
    KeyValues(Vec<(String, Cell)>),
    /// A table.
    Table(Table),
    /// One figure over the full width.
    Figure(Box<Figure>),
    /// Figures side by side where the page is wide enough.
    Figures(Vec<Figure>),
    /// Blocks folded away on the screen and open in print; the text is the fold's label.
    Details(String, Vec<Block>),
}

impl Block {
    /// One figure over the full width.
    #[must_use]
    pub fn figure(figure: Figure) -> Self {
        Self::Figure(Box::new(figure))
    }
}

/// The tone of a result. Never shown by the colour alone: each has its own sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Nothing to do.
    Good,
    /// A finding.
    Finding,
    /// The result is not known, or not sure.
    Unsure,
    /// Neither good nor bad.
    Neutral,
}

/// The answer in one sentence.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// How to take it.
    pub tone: Tone,
    /// The sentence.
    pub sentence: String,
    /// What stands behind it, in a sentence or two; may be empty.
    pub detail: String,
    /// A few figures that support it: name and value.
    pub figures: Vec<(String, Cell)>,
}

/// A drawing with its caption.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What is drawn.
    pub drawing: Drawing,
    /// What the reader should see in it; may be empty.
    pub caption: String,
}

impl Figure {
    /// A drawing and its caption.
    pub fn new(drawing: impl Into<Drawing>, caption: impl Into<String>) -> Self {
        Self { drawing: drawing.into(), caption: caption.into() }
    }
}

/// What a figure shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawing {
    /// A plot on two axes.
    Chart(Chart),
    /// A polar plot of a circular test.
    Polar(PolarPlot),
    /// The chain from the command to the trace.
    Chain(ChainDiagram),
}

impl From<Chart> for Drawing {
    fn from(chart: Chart) -> Self {
        Self::Chart(chart)
    }
}

impl From<PolarPlot> for Drawing {
    fn from(plot: PolarPlot) -> Self {
        Self::Polar(plot)
    }
}

impl From<ChainDiagram> for Drawing {
    fn from(chain: ChainDiagram) -> Self {
        Self::Chain(chain)
    }
}

/// A table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// What it holds.
    pub caption: String,
    /// Headings; a unit goes in brackets behind the name.
    pub columns: Vec<String>,
    /// Rows of as many cells as there are columns.
    pub rows: Vec<Row>,
}

impl Table {
    /// An empty table.
    pub fn new<S: Into<String>>(caption: impl Into<String>, columns: impl IntoIterator<Item = S>) -> Self {
        Self { caption: caption.into(), columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Appends a plain row.
    pub fn row(&mut self, cells: Vec<Cell>) {
        self.rows.push(Row { cells, strong: false });
    }

    /// Appends a row that stands out: the winner of a ranking.
    pub fn strong_row(&mut self, cells: Vec<Cell>) {
        self.rows.push(Row { cells, strong: true });
    }
}

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// One cell a column.
    pub cells: Vec<Cell>,
    /// Whether the row stands out.
    pub strong: bool,
}

/// A value as data; [`mod@format`] decides how its digits are written.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Nothing.
    Empty,
    /// Text.
    Text(String),
    /// Text that leads to a file: its path from the page's folder, of letters, digits and `-_./` alone.
    Link(String, String),
    /// A number with so many significant digits, and its unit (may be empty).
    Number(f64, usize, String),
    /// A whole number.
    Count(u64),
    /// An estimate, its standard error, its unit (may be empty).
    Estimate(f64, f64, String),
    /// A share of one, written in per cent.
    Percent(f64),
    /// A share of one in 0..=1, written in per cent beside a bar.
    Bar(f64),
}

impl Cell {
    /// A number with four significant digits and no unit.
    pub fn number(value: f64) -> Self {
        Self::Number(value, 4, String::new())
    }

    /// A number with four significant digits and a unit.
    pub fn quantity(value: f64, unit: impl Into<String>) -> Self {
        Self::Number(value, 4, unit.into())
    }

    /// Text.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// Whether the cell is set flush right, as numbers are.
    pub(crate) fn is_numeric(&self) -> bool {
        !matches!(self, Self::Empty | Self::Text(_) | Self::Link(..))
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}
