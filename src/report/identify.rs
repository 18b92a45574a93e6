//! The report of an identification: estimates with their errors, how well they fit, how they were reached.

use std::borrow::Cow;
use std::sync::Arc;

use super::chart::{Axis, Chart, Colour, Dash, Mark, Range, Series, Shape};
use super::format::{self, Medium};
use super::{Block, Cell, Figure, Report, Section, Table, Tone, Verdict};
use crate::identify::earned::FOLLOWS;
use crate::identify::frequency;
use crate::identify::result::{
    Estimate, FrequencyResponse, Identification, MethodResult, OutputFit, ResponseOf, Series as Curve,
};
use crate::trace::{Signal, Trace};

/// Dashes of series that may lie on one another.
const DASHES: [Dash; 3] = [Dash::Solid, Dash::Dashed, Dash::Dotted];

/// The whole report; with the record it opens with what was measured and what the estimates make of it.
#[must_use]
pub fn report(found: &Identification, record: Option<&Trace>) -> Report {
    let mut top = vec![Block::Verdict(verdict(found))];
    top.extend(found.warnings.iter().cloned().map(Block::Warning));
    top.extend(follows(found, record));
    if let Some(best) = recommended(found) {
        top.push(Block::Table(estimates(best)));
    }
    let mut sections = vec![Section::new("", top)];
    if is_compared(found) {
        sections.push(Section::new("How well the model follows the machine", fit(found)));
    }
    if let Some(frf) = &found.frequency_response {
        sections.push(Section::new("Frequency response", frequency_response(frf)));
    }
    if found.methods.len() > 1 {
        sections.push(Section::new("The methods side by side", side_by_side(found)));
    }
    if found.methods.iter().any(|m| m.history.is_some()) {
        sections.push(Section::new("How the estimates were reached", histories(found)));
    }
    sections.push(Section::new("The excitation, and what the model makes of it", excitation(found)));
    Report {
        title: format!("Identification of {}", found.machine),
        subject: subject(found),
        sections,
        footer: format!("eixo {}", env!("CARGO_PKG_VERSION")),
    }
}

/// The short form for the terminal.
#[must_use]
pub fn short(found: &Identification) -> Vec<Block> {
    let mut blocks = vec![Block::Verdict(verdict(found))];
    blocks.extend(found.warnings.iter().cloned().map(Block::Warning));
    if let Some(best) = recommended(found) {
        blocks.push(Block::Table(estimates(best)));
    }
    if found.methods.len() > 1 {
        blocks.push(Block::Table(compare(found)));
    }
    if has_reference(found) {
        blocks.push(Block::Table(errors(found)));
    }
    if is_compared(found) {
        blocks.push(Block::Table(fits(found)));
    }
    if let Some(frf) = &found.frequency_response {
        blocks.push(Block::Table(resonances(frf)));
    }
    blocks
}

/// Whether a simulation was compared with the record: not with a streamed one.
fn is_compared(found: &Identification) -> bool {
    found.methods.iter().any(|m| !m.outputs.is_empty())
}

fn subject(found: &Identification) -> String {
    let t = &found.trace;
    let rate = if t.dt > 0.0 { format::number(1.0 / t.dt, 4, Medium::Page) } else { "?".to_owned() };
    let mut out = format!(
        "{}: {} samples at {rate} Hz, {} s",
        t.file,
        format::count(t.samples as u64),
        format::number(t.duration, 4, Medium::Page)
    );
    if let Some(period) = t.period {
        out.push_str(&format!(", period {} samples", format::count(period as u64)));
    }
    out
}

/// The method to trust, else the first that has an estimate.
fn recommended(found: &Identification) -> Option<&MethodResult> {
    match &found.recommended {
        Some(r) => found.methods.get(r.method),
        None => found.methods.iter().find(|m| m.failure.is_none()),
    }
}

fn verdict(found: &Identification) -> Verdict {
    let Some(best) = recommended(found).filter(|m| !m.parameters.is_empty()) else {
        return Verdict {
            tone: Tone::Unsure,
            sentence: "No method could identify the axis from this trace.".to_owned(),
            detail: found
                .methods
                .iter()
                .filter_map(|m| m.failure.as_ref().map(|f| format!("{}: {f}.", m.title)))
                .collect::<Vec<_>>()
                .join(" "),
            figures: Vec::new(),
        };
    };
    let worst = best.outputs.iter().min_by(|a, b| a.fit_percent.total_cmp(&b.fit_percent));
    let sentence = match worst {
        Some(o) if best.outputs.len() == 1 => {
            format!(
                "{} identifies the axis: its simulation follows {} to {}.",
                best.title,
                o.signal.name(),
                fit_percent(o.fit_percent)
            )
        }
        Some(o) => format!(
            "{} identifies the axis: its simulation follows every output to {} or better ({} the least).",
            best.title,
            fit_percent(o.fit_percent),
            o.signal.name()
        ),
        None => format!("{} identifies the axis.", best.title),
    };
    let earned = &found.earned;
    let tone = if earned.identified { Tone::Neutral } else { Tone::Unsure };
    let poor = worst.filter(|o| o.fit_percent < FOLLOWS);
    let sentence = match poor {
        _ if earned.identified => sentence,
        Some(o) if o.fit_percent > 0.0 => format!(
            "The model does not follow the machine: with the estimates of {} its simulation follows {} to {} only.",
            best.title,
            o.signal.name(),
            fit_percent(o.fit_percent)
        ),
        Some(o) => format!(
            "The model does not follow the machine: with the estimates of {} its simulation is further from {} than its mean.",
            best.title,
            o.signal.name()
        ),
        None => format!("{} does not identify the axis from this record.", best.title),
    };
    let known = best.modal.iter().chain(best.parameters.iter()).filter(|e| is_shown(e));
    let figures =
        if earned.identified { known.take(4).map(|e| (e.name.to_owned(), value(e))).collect() } else { Vec::new() };
    let detail = if earned.identified {
        found.recommended.as_ref().map_or_else(String::new, |r| sentence_of(&r.why))
    } else {
        let mut words = earned.doubts.clone();
        words.push(earned.advice.clone());
        words.retain(|w| !w.is_empty());
        words.join(" ")
    };
    Verdict { tone, sentence, detail, figures }
}

/// A remark as a sentence: capital letter, full stop.
fn sentence_of(text: &str) -> String {
    let mut chars = text.chars();
    let head: String = chars.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    let stop = if text.ends_with(['.', '!', '?']) { "" } else { "." };
    format!("{head}{}{stop}", chars.as_str())
}

fn fit_percent(fit: f64) -> String {
    format::percent(fit / 100.0, Medium::Page)
}

/// Whether an estimate is one: finite, and larger than its standard error.
fn is_shown(e: &Estimate) -> bool {
    // What no axis has is not shown as a value of it.
    let negative = e.value < 0.0 && matches!(e.name, "I" | "I1" | "I2" | "B" | "K" | "wn" | "zeta");
    e.value.is_finite() && !negative && e.std.is_none_or(|s| s.is_finite() && (s < e.value.abs() || e.value == 0.0))
}

fn value(e: &Estimate) -> Cell {
    if !is_shown(e) {
        return Cell::text("not determined");
    }
    match e.std {
        Some(std) => Cell::Estimate(e.value, std, e.unit.to_owned()),
        None => Cell::Number(e.value, 5, e.unit.to_owned()),
    }
}

/// Parameters and modal parameters of one method.
fn estimates(m: &MethodResult) -> Table {
    let all: Vec<&Estimate> = m.parameters.iter().chain(&m.modal).collect();
    let reference = all.iter().any(|e| e.reference.is_some());
    let mut columns = vec!["parameter", "estimate", "standard error"];
    if reference {
        columns.extend(["reference", "error"]);
    }
    let mut table = Table::new(format!("Estimates of {} ({})", m.title, m.formulation), columns);
    for e in all {
        let mut cells = vec![
            Cell::text(e.name),
            value(e),
            e.std.filter(|_| is_shown(e) && e.value != 0.0).map_or(Cell::Empty, |s| Cell::Percent((s / e.value).abs())),
        ];
        if reference {
            cells.push(e.reference.map_or(Cell::Empty, |r| Cell::Number(r, 5, e.unit.to_owned())));
            cells.push(e.error_percent.map_or(Cell::Empty, |p| Cell::Percent(p / 100.0)));
        }
        table.row(cells);
    }
    table
}

/// One row a method: how well its simulation follows each output, and whether what is left is noise.
fn fits(found: &Identification) -> Table {
    let signals: Vec<Signal> = {
        let mut all: Vec<Signal> = Vec::new();
        for o in found.methods.iter().flat_map(|m| &m.outputs) {
            if !all.contains(&o.signal) {
                all.push(o.signal);
            }
        }
        all
    };
    let columns = std::iter::once("method".to_owned())
        .chain(signals.iter().map(|s| format!("fit of {}", s.name())))
        .chain(["what is left is white noise".to_owned()]);
    let mut table = Table::new("A simulation with the estimates against the measured outputs", columns);
    for m in found.methods.iter().filter(|m| !m.outputs.is_empty()) {
        let mut cells = vec![Cell::text(&*m.title)];
        for s in &signals {
            let fit = m.outputs.iter().find(|o| o.signal == *s);
            cells.push(fit.map_or(Cell::Empty, |o| {
                if o.fit_percent >= -100.0 {
                    Cell::Percent(o.fit_percent / 100.0)
                } else {
                    Cell::text("does not follow")
                }
            }));
        }
        let coloured: Vec<&str> =
            m.outputs.iter().filter(|o| !o.whiteness.white && !o.is_rounding()).map(|o| o.signal.name()).collect();
        cells.push(Cell::text(if m.outputs.iter().all(OutputFit::is_rounding) {
            "nothing is left but rounding".to_owned()
        } else if coloured.is_empty() {
            "yes".to_owned()
        } else {
            format!("not of {}", coloured.join(", "))
        }));
        table.row(cells);
    }
    table
}

fn fit(found: &Identification) -> Vec<Block> {
    let mut blocks = vec![Block::Table(fits(found))];
    if let Some(best) = recommended(found) {
        let figures = best
            .outputs
            .iter()
            .map(|o| {
                let chart = Chart::new(
                    format!("What {} leaves of {}", best.title, o.signal.name()),
                    Axis::linear("time", o.residual.x_unit),
                    Axis::linear(format!("measured minus simulated, {}", o.signal.name()), o.residual.y_unit),
                )
                .with(line("", &o.residual));
                let w = &o.whiteness;
                let caption = if o.is_rounding() {
                    "Rounding of the simulation: nothing is left.".to_owned()
                } else {
                    format!(
                        "{}: Ljung-Box over {} lags, p = {}.",
                        if w.white {
                            "White, as noise is"
                        } else {
                            "Not white: the model leaves something out, or the noise is coloured"
                        },
                        w.lags,
                        format::number(w.p_value, 2, Medium::Page)
                    )
                };
                Figure::new(chart, caption)
            })
            .collect::<Vec<_>>();
        if !figures.is_empty() {
            blocks.push(Block::Figures(figures));
        }
    }
    blocks
}

/// Most outputs that are drawn at the head of the page.
const DRAWN: usize = 2;

/// Measured against simulated, of the method to trust.
fn follows(found: &Identification, record: Option<&Trace>) -> Option<Block> {
    let best = recommended(found)?;
    let record = compared(found, record?, best);
    let figure = |o: &OutputFit| {
        let (time, measured, simulated) = pair(o, best, &record)?;
        let time: Arc<[f64]> = time.into();
        let chart = Chart::new(
            format!("{}, measured and simulated", o.signal.name()),
            Axis::linear("time", o.residual.x_unit),
            Axis::linear(o.signal.name(), o.residual.y_unit),
        )
        .with(Series::line("measured", time.clone(), measured).in_colour(Colour::Ink).with_dash(Dash::Broad))
        .with(Series::line(format!("simulated with {}", best.title), time, simulated).in_colour(Colour::Blue));
        let per = format::number(o.fit_percent, 4, Medium::Page);
        Some(Figure::new(chart, format!("Fit {per} %: how much of the deviation from the mean is followed.")))
    };
    let figures: Vec<Figure> = best.outputs.iter().filter_map(figure).take(DRAWN).collect();
    match figures.len() {
        0 => None,
        1 => figures.into_iter().next().map(Block::Figure),
        _ => Some(Block::Figures(figures)),
    }
}

/// What the simulation was compared with: the record, or the average of its periods.
fn compared<'a>(found: &Identification, record: &'a Trace, best: &MethodResult) -> Cow<'a, Trace> {
    let end = best.outputs.iter().filter_map(|o| o.residual.x.last()).fold(f64::NEG_INFINITY, |m, t| m.max(*t));
    let short = record.len() > 1 && end < record.time(record.len() - 1) - 0.5 * record.dt;
    let average = || frequency::average(record, &frequency::measure(record, found.trace.period?)?).ok();
    match short.then(average).flatten() {
        Some(average) => Cow::Owned(average),
        None => Cow::Borrowed(record),
    }
}

/// Time, measured and simulated values of an output; none where the values are not those that were compared.
fn pair(o: &OutputFit, m: &MethodResult, record: &Trace) -> Option<(Vec<f64>, Vec<f64>, Vec<f64>)> {
    if o.signal == Signal::T {
        // A rigid axis is compared in torque, in means over windows: the record itself is not what was compared.
        let e = m.excitation.as_ref().filter(|e| e.estimate.x == e.error.x)?;
        let measured = e.estimate.y.iter().zip(&e.error.y).map(|(estimate, error)| estimate - error).collect();
        return Some((e.estimate.x.clone(), measured, e.estimate.y.clone()));
    }
    let values = record.get(o.signal)?;
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let rms = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64).sqrt();
    if (rms - o.rms).abs() > 1e-6 * o.rms {
        return None;
    }
    let at = |t: f64| {
        let k = ((t - record.start) / record.dt).round();
        (k >= 0.0).then_some(k as usize).and_then(|k| values.get(k)).copied()
    };
    let measured = o.residual.x.iter().map(|t| at(*t)).collect::<Option<Vec<f64>>>()?;
    let simulated = measured.iter().zip(&o.residual.y).map(|(y, e)| y - e).collect();
    Some((o.residual.x.clone(), measured, simulated))
}

fn line(name: &str, curve: &Curve) -> Series {
    Series::line(name, curve.x.as_slice(), curve.y.as_slice())
}

fn resonances(frf: &FrequencyResponse) -> Table {
    let mut table = Table::new(
        format!("Measured frequency response, {} periods of {} samples", frf.periods, frf.period),
        ["output", "antiresonance", "resonance", "error of the model"],
    );
    let hertz = |f: Option<f64>| f.map_or(Cell::Empty, |f| Cell::quantity(f, "Hz"));
    for o in &frf.outputs {
        table.row(vec![
            Cell::text(o.signal.name()),
            hertz(o.antiresonance),
            hertz(o.resonance),
            Cell::Percent(o.error_percent / 100.0),
        ]);
    }
    table
}

fn frequency_response(frf: &FrequencyResponse) -> Vec<Block> {
    let f: Arc<[f64]> = frf.frequency.as_slice().into();
    let mut figures = Vec::new();
    for o in &frf.outputs {
        figures.push(Figure::new(magnitude(&f, o), "Grey: two standard deviations from the scatter between periods."));
        figures.push(Figure::new(phase(&f, o), ""));
    }
    vec![Block::Table(resonances(frf)), Block::Figures(figures)]
}

fn magnitude(f: &Arc<[f64]>, o: &ResponseOf) -> Chart {
    let name = o.signal.name();
    let low: Vec<f64> = o.magnitude.iter().zip(&o.std).map(|(m, s)| (m - 2.0 * s).max(0.05 * m)).collect();
    let high: Vec<f64> = o.magnitude.iter().zip(&o.std).map(|(m, s)| m + 2.0 * s).collect();
    let mut chart = Chart::new(
        format!("From torque to {name}"),
        Axis::log("frequency", "Hz"),
        Axis::log(format!("gain, {name}/T"), ""),
    )
    .with(Series::band("", f.clone(), low, high).in_colour(Colour::Grey))
    .with(Series::points("measured", f.clone(), o.magnitude.as_slice()).in_colour(Colour::Ink))
    .with(Series::line("model", f.clone(), o.model_magnitude.as_slice()).in_colour(Colour::Blue));
    for (at, what) in [(o.antiresonance, "antiresonance"), (o.resonance, "resonance")] {
        if let Some(at) = at {
            chart.marks.push(Mark::X(at, format!("{what} {} Hz", format::number(at, 3, Medium::Page))));
        }
    }
    chart
}

fn phase(f: &Arc<[f64]>, o: &ResponseOf) -> Chart {
    let (measured, model) = unwrapped(&o.phase, &o.model_phase);
    Chart::new(
        format!("Phase from torque to {}", o.signal.name()),
        Axis::log("frequency", "Hz"),
        Axis::linear("phase", "°"),
    )
    .with(Series::points("measured", f.clone(), measured).in_colour(Colour::Ink))
    .with(Series::line("model", f.clone(), model).in_colour(Colour::Blue))
}

/// Phases in degrees without jumps of a turn: the model's along the frequency, which has no noise, and each measured one
/// within half a turn of it.
fn unwrapped(measured: &[f64], model: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let near = |angle: f64, to: f64| angle + 360.0 * ((to - angle) / 360.0).round();
    let mut last: Option<f64> = None;
    let model: Vec<f64> = model
        .iter()
        .map(|p| {
            let p = p.to_degrees();
            // A lag is told below zero.
            let next = last.map_or(if p > 90.0 { p - 360.0 } else { p }, |l| near(p, l));
            if next.is_finite() {
                last = Some(next);
            }
            next
        })
        .collect();
    let measured = measured.iter().zip(&model).map(|(p, m)| near(p.to_degrees(), *m)).collect();
    (measured, model)
}

fn has_reference(found: &Identification) -> bool {
    found.methods.iter().flat_map(|m| m.parameters.iter().chain(&m.modal)).any(|e| e.reference.is_some())
}

/// Names of all that was estimated, in the order of first appearance.
fn names(found: &Identification) -> Vec<(&'static str, &'static str)> {
    let mut out: Vec<(&str, &str)> = Vec::new();
    for e in
        found.methods.iter().flat_map(|m| m.parameters.iter()).chain(found.methods.iter().flat_map(|m| m.modal.iter()))
    {
        if !out.iter().any(|(n, _)| *n == e.name) {
            out.push((e.name, e.unit));
        }
    }
    out
}

/// One row a parameter, one column a method; `cell` of the method's estimate.
fn matrix(found: &Identification, caption: &str, units: bool, cell: impl Fn(&Estimate) -> Cell) -> Table {
    let methods: Vec<&MethodResult> = found.methods.iter().filter(|m| m.failure.is_none()).collect();
    let mut table = Table::new(caption, std::iter::once("parameter").chain(methods.iter().map(|m| m.method)));
    for (name, unit) in names(found) {
        let label = if units && !unit.is_empty() && unit != "1" {
            format!("{name} [{}]", format::unit(unit, Medium::Page))
        } else {
            name.to_owned()
        };
        let mut cells = vec![Cell::Text(label)];
        cells.extend(
            methods
                .iter()
                .map(|m| m.parameters.iter().chain(&m.modal).find(|e| e.name == name).map_or(Cell::Empty, &cell)),
        );
        table.row(cells);
    }
    table
}

pub(super) fn compare(found: &Identification) -> Table {
    matrix(found, "Estimates by method", true, |e| match e.std {
        Some(std) => Cell::Estimate(e.value, std, String::new()),
        None => Cell::Number(e.value, 5, String::new()),
    })
}

pub(super) fn errors(found: &Identification) -> Table {
    matrix(found, "Error against the reference", false, |e| {
        e.error_percent.map_or(Cell::Empty, |p| Cell::Percent(p / 100.0))
    })
}

fn side_by_side(found: &Identification) -> Vec<Block> {
    let mut blocks = vec![Block::Table(compare(found))];
    if has_reference(found) {
        blocks.push(Block::Table(errors(found)));
    }
    let mut table = Table::new("What each method is", ["method", "in words", "regression or model", "remarks"]);
    for m in &found.methods {
        let mut remarks = m.notes.clone();
        if let Some(failure) = &m.failure {
            remarks.insert(0, format!("no estimate: {failure}"));
        }
        if let Some(n) = m.iterations {
            remarks.push(format!("{n} iterations"));
        }
        table.row(vec![
            Cell::text(m.method),
            Cell::text(&*m.title),
            Cell::text(&*m.formulation),
            Cell::text(remarks.join("; ")),
        ]);
    }
    blocks.push(Block::Table(table));
    blocks
}

/// Histories of every parameter, the recursive methods in one chart each (the paper's Figures 6 to 9).
pub(super) fn histories(found: &Identification) -> Vec<Block> {
    let mut figures = Vec::new();
    for (name, unit) in names(found) {
        let mut chart = Chart::new(
            format!("{name} as it is estimated"),
            Axis::linear("time", "s"),
            Axis::linear(name, unit).over(Range::Robust),
        );
        for (k, m) in found.methods.iter().filter(|m| m.history.is_some()).enumerate() {
            let Some(history) = &m.history else { continue };
            if let Some((_, values)) = history.parameters.iter().find(|(n, _)| *n == name) {
                let dash = DASHES[k % 3];
                chart.series.push(Series::line(&*m.title, history.time.as_slice(), values.as_slice()).with_dash(dash));
            }
        }
        let estimates = found.methods.iter().flat_map(|m| m.parameters.iter()).filter(|e| e.name == name);
        if let Some(reference) = estimates.filter_map(|e| e.reference).next() {
            chart.marks.push(Mark::Y(reference, "reference".into()));
        }
        if !chart.series.is_empty() {
            figures.push(Figure::new(chart, ""));
        }
    }
    figures.extend(distances(found));
    vec![Block::Figures(figures)]
}

/// How near each recursive method comes to the reference, where there is one.
fn distances(found: &Identification) -> Vec<Figure> {
    let mut figures = Vec::new();
    for m in &found.methods {
        let Some(history) = &m.history else { continue };
        let mut chart = Chart::new(
            format!("Distance from the reference, {}", m.title),
            Axis::linear("time", "s"),
            Axis::log("|estimate/reference - 1|", ""),
        );
        for (k, (name, values)) in history.parameters.iter().enumerate() {
            let reference = m.parameters.iter().find(|e| e.name == *name).and_then(|e| e.reference);
            if let Some(r) = reference.filter(|r| *r != 0.0) {
                let distance: Vec<f64> = values.iter().map(|v| (v / r - 1.0).abs()).collect();
                chart.series.push(Series::line(*name, history.time.as_slice(), distance).with_dash(DASHES[k % 3]));
            }
        }
        if !chart.series.is_empty() {
            figures.push(Figure::new(chart, ""));
        }
    }
    figures
}

/// How far each method's parameters lead the torque's estimate astray.
pub(super) fn excitation_errors(found: &Identification) -> Table {
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
fn excitation(found: &Identification) -> Vec<Block> {
    let torque =
        Chart::new("Excitation", Axis::linear("time", found.torque.x_unit), Axis::linear("T", found.torque.y_unit))
            .with(line("", &found.torque).in_colour(Colour::Ink));
    let mut blocks = vec![Block::Figure(Figure::new(torque, ""))];
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_that_passes_half_a_turn_does_not_jump() {
        // A lag from -100 to -500 degrees, wrapped as an argument is, and measured with some degrees of noise.
        let true_ones: Vec<f64> = (0..41).map(|k| -100.0 - 10.0 * f64::from(k)).collect();
        let wrap = |d: f64| ((d + 180.0).rem_euclid(360.0) - 180.0).to_radians();
        let model: Vec<f64> = true_ones.iter().map(|d| wrap(*d)).collect();
        let measured: Vec<f64> = true_ones.iter().enumerate().map(|(k, d)| wrap(d + 40.0 * (k as f64).sin())).collect();
        let (measured, model) = unwrapped(&measured, &model);
        for (k, d) in true_ones.iter().enumerate() {
            assert!((model[k] - d).abs() < 1e-9, "{k}: {} against {d}", model[k]);
            assert!((measured[k] - d - 40.0 * (k as f64).sin()).abs() < 1e-9, "{k}: {}", measured[k]);
        }
    }
}
