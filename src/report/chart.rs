//! Plots on two axes, as data.
//!
//! Colours are those of Okabe and Ito ("Color Universal Design", 2008), which stay apart for colour-blind readers; the
//! page's style sheet gives them their values for light and dark. Series differ by dash as well.

use std::sync::Arc;

/// A plot as data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Heading above the plot.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, the first at the bottom.
    pub series: Vec<Series>,
    /// Lines and spans that point something out.
    pub marks: Vec<Mark>,
}

impl Chart {
    /// An empty plot.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, series: Vec::new(), marks: Vec::new() }
    }

    /// With one more series; a series without a colour of its own takes the next one of the palette.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// With one more mark.
    #[must_use]
    pub fn mark(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }
}

/// An axis of a plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// What is shown.
    pub label: String,
    /// Its unit in ASCII (`kg.m2`); may be empty.
    pub unit: String,
    /// Logarithmic instead of linear; what is not positive is left out.
    pub log: bool,
    /// Limits.
    pub range: Range,
    /// Steps between ticks, the finest first, that are asked before those of 1, 2 and 5 times a power of ten.
    pub steps: &'static [f64],
}

impl Axis {
    /// A linear axis over all the data.
    pub fn linear(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), log: false, range: Range::Auto, steps: &[] }
    }

    /// A logarithmic axis over all the data.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { log: true, ..Self::linear(label, unit) }
    }

    /// The same axis with other limits.
    #[must_use]
    pub fn over(mut self, range: Range) -> Self {
        self.range = range;
        self
    }

    /// The same axis with ticks at multiples of one of these steps, the finest first, where one of them suits what is shown.
    #[must_use]
    pub fn by(mut self, steps: &'static [f64]) -> Self {
        self.steps = steps;
        self
    }
}

/// Steps of an axis of angles in degrees: the reversals of an axis, at right angles, are among the ticks.
pub const DEGREES: [f64; 4] = [15.0, 30.0, 45.0, 90.0];

/// Limits of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Range {
    /// All the data.
    #[default]
    Auto,
    /// All the data and zero.
    WithZero,
    /// What most of the data need: a start-up transient may leave the plot.
    Robust,
    /// These.
    Fixed(f64, f64),
}

/// A line, cloud or band of a plot. `x` and `y` have the same length; the longer one is cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; may be empty.
    pub name: String,
    /// Abscissae.
    pub x: Arc<[f64]>,
    /// Ordinates.
    pub y: Arc<[f64]>,
    /// How it is drawn.
    pub shape: Shape,
    /// Its colour; none takes the next of the palette.
    pub colour: Option<Colour>,
    /// Its dash.
    pub dash: Dash,
    /// Whether it belongs to the model before or after: where a plot has both, the page can switch between them.
    pub when: Option<When>,
}

/// Which of two models a series belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// The model as it was given.
    Before,
    /// The model as it was improved.
    After,
}

impl When {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::After => "after",
        }
    }
}

impl Series {
    /// A series of this shape.
    pub fn new(name: impl Into<String>, shape: Shape, x: impl Into<Arc<[f64]>>, y: impl Into<Arc<[f64]>>) -> Self {
        Self { name: name.into(), x: x.into(), y: y.into(), shape, colour: None, dash: Dash::Solid, when: None }
    }

    /// A line.
    pub fn line(name: impl Into<String>, x: impl Into<Arc<[f64]>>, y: impl Into<Arc<[f64]>>) -> Self {
        Self::new(name, Shape::Line, x, y)
    }

    /// A cloud of points.
    pub fn points(name: impl Into<String>, x: impl Into<Arc<[f64]>>, y: impl Into<Arc<[f64]>>) -> Self {
        Self::new(name, Shape::Points, x, y)
    }

    /// A band from `low` to `high`.
    pub fn band(
        name: impl Into<String>,
        x: impl Into<Arc<[f64]>>,
        low: impl Into<Arc<[f64]>>,
        high: impl Into<Arc<[f64]>>,
    ) -> Self {
        Self::new(name, Shape::Band { low: low.into() }, x, high)
    }

    /// The same in this colour.
    #[must_use]
    pub fn in_colour(mut self, colour: Colour) -> Self {
        self.colour = Some(colour);
        self
    }

    /// The same as part of this model.
    #[must_use]
    pub fn of_model(mut self, when: When) -> Self {
        self.when = Some(when);
        self
    }

    /// The same with this dash.
    #[must_use]
    pub fn with_dash(mut self, dash: Dash) -> Self {
        self.dash = dash;
        self
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Joined points.
    Line,
    /// Points.
    Points,
    /// Points on stalks from zero (from the bottom on a logarithmic axis).
    Stem,
    /// Each value held until the next.
    Step,
    /// The space between `low` and the series' `y`.
    Band {
        /// Lower edge, as long as `x`.
        low: Arc<[f64]>,
    },
}

/// The palette. `Ink` is the page's own text colour: what was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// The text's own.
    Ink,
    /// Blue.
    Blue,
    /// Vermillion.
    Vermillion,
    /// Bluish green.
    Green,
    /// Reddish purple.
    Purple,
    /// Orange.
    Orange,
    /// Sky blue.
    Sky,
    /// Grey, for what stands behind.
    Grey,
}

impl Colour {
    const PALETTE: [Self; 6] = [Self::Blue, Self::Vermillion, Self::Green, Self::Purple, Self::Orange, Self::Sky];

    /// The colour of the n-th series.
    pub(super) fn nth(n: usize) -> Self {
        Self::PALETTE[n % Self::PALETTE.len()]
    }

    /// Its class in the style sheet.
    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Ink => "c-ink",
            Self::Blue => "c-blue",
            Self::Vermillion => "c-vermillion",
            Self::Green => "c-green",
            Self::Purple => "c-purple",
            Self::Orange => "c-orange",
            Self::Sky => "c-sky",
            Self::Grey => "c-grey",
        }
    }
}

/// The dash of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dash {
    /// Unbroken.
    #[default]
    Solid,
    /// Long dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// Unbroken, broad and pale: what other lines are drawn over.
    Broad,
}

impl Dash {
    pub(super) fn pattern(self) -> Option<&'static str> {
        match self {
            Self::Solid | Self::Broad => None,
            Self::Dashed => Some("7 4"),
            Self::Dotted => Some("1.5 3.5"),
        }
    }

    pub(super) fn class(self) -> &'static str {
        if self == Self::Broad { "line broad" } else { "line" }
    }
}

/// Something pointed out.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A vertical line at an abscissa.
    X(f64, String),
    /// A horizontal line at an ordinate.
    Y(f64, String),
    /// A stretch of the abscissa.
    Span(f64, f64, String),
}
