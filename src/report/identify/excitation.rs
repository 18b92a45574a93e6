//! The excitation, and what each method's parameters make of it.

use super::{DASHES, line};
use crate::identify::result::{Identification, Series as Curve};
use crate::report::chart::{Axis, Chart, Colour, Dash, Range, Series, Shape};
use crate::report::{Block, Cell, Figure, Table};

/// How far the torque that each method's parameters give is from the measured one.
pub fn excitation_errors(found: &Identification) -> Table {
    let mut table =
        Table::new("The torque estimated from the motion", ["method", "equation", "rms error over rms torque"]);
    for m in &found.methods {
        if let Some(e) = &m.excitation {
            table.row(vec![Cell::text(&*m.title), Cell::text(e.formulation), Cell::Percent(e.error_percent / 100.0)]);
        }
    }
    table
}

/// Excitation, its spectrum, and what each method's parameters make of it (the paper's Figures 4, 5 and 10 to 13).
pub fn excitation(found: &Identification) -> Vec<Block> {
    let torque =
        Chart::new("Excitation", Axis::linear("time", found.torque.x_unit), Axis::linear("T", found.torque.y_unit))
            .with(line("", &found.torque).in_colour(Colour::Ink));
    let mut blocks = vec![Block::figure(Figure::new(torque, ""))];
    let measured = line("measured", &found.torque_spectrum).in_colour(Colour::Ink);
    let spectrum = |title: &str| {
        let unit = found.torque_spectrum.y_unit;
        let mut frequency = Axis::linear("frequency", "Hz");
        if let Some(band) = excited(&found.torque_spectrum) {
            frequency.range = Range::Fixed(0.0, band);
        }
        Chart::new(title, frequency, Axis::linear("amplitude", unit).over(Range::WithZero))
    };
    let own = Series { shape: Shape::Stem, name: String::new(), ..measured.clone() };
    let mut estimated = spectrum("Spectra of the estimated torque").with(measured.with_dash(Dash::Broad));
    let mut errors = Vec::new();
    for (k, m) in found.methods.iter().enumerate() {
        let Some(e) = &m.excitation else { continue };
        let colour = Colour::nth(k);
        estimated.series.push(line(&m.title, &e.spectrum).in_colour(colour).with_dash(DASHES[k % 3]));
        let error = Chart::new(
            format!("Error of the torque estimated by {}", m.title),
            Axis::linear("time", e.error.x_unit),
            Axis::linear("estimate minus measured", e.error.y_unit),
        )
        .with(line("", &e.error).in_colour(colour));
        errors.push(Figure::new(error, ""));
    }
    let mut figures = Vec::new();
    // A streamed record has none.
    if !own.x.is_empty() {
        figures.push(Figure::new(spectrum("Spectrum of the excitation").with(own), ""));
    }
    if !errors.is_empty() {
        figures.push(Figure::new(estimated, ""));
    }
    figures.extend(errors);
    let table = excitation_errors(found);
    if !table.rows.is_empty() {
        blocks.push(Block::Table(table));
    }
    blocks.push(Block::Figures(figures));
    blocks
}

/// Where the band of an excitation ends, with a margin; none where it fills the spectrum.
fn excited(spectrum: &Curve) -> Option<f64> {
    let largest = spectrum.y.iter().copied().fold(0.0, f64::max);
    let last = spectrum.x.iter().zip(&spectrum.y).filter(|(_, y)| **y > 1e-2 * largest).map(|(x, _)| *x).next_back()?;
    let end = spectrum.x.last().copied()?;
    (1.5 * last < end).then_some(1.5 * last)
}
