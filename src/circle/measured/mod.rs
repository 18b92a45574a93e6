//! A measured circular test: one or two files of angle and radius, or of the positions of X and Y, into turns.
//!
//! Which way a turn goes is taken, in this order, from `--directions`, from a column that says it, from the order of the
//! points where they are positions or where a file holds turns against each other, from a header line, from the file's name,
//! and from the order of the angles.

mod columns;
mod part;
mod text;

use std::f64::consts::{PI, TAU};
use std::path::{Path as File, PathBuf};

use super::Path;
use super::trace::{Turn, turns};
use crate::trace::{Table, TraceError};
use columns::{Points, pick};
pub use part::Part;
use text::Declared;

/// A measured test that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeasuredError {
    /// The file is no table.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The file is no circular test.
    #[error("{file}: {what}")]
    File {
        /// The file.
        file: String,
        /// What is wrong and the way out.
        what: String,
    },
    /// The files do not fit together.
    #[error("{0}")]
    Mismatch(String),
}

/// What is given in addition to the files.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Given {
    /// Nominal radius, m.
    pub radius: Option<f64>,
    /// Feed along the circle, m/s.
    pub feed: Option<f64>,
    /// Whether each turn is clockwise, in the order of the files.
    pub clockwise: Vec<bool>,
    /// The part of each file that is used.
    pub part: Part,
}

/// A measured circular test.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// One turn, or two of unlike directions, counter-clockwise first, about their common centre.
    pub turns: Vec<Turn>,
    /// Nominal radius, m.
    pub radius: f64,
    /// Feed along the circle, m/s, where it is known.
    pub feed: Option<f64>,
    /// The centre that was taken off, m.
    pub centre: (f64, f64),
    /// What was decided on the way, in sentences.
    pub notes: Vec<String>,
}

/// Most bytes of a file.
const MOST: u64 = 256 << 20;
/// Part of the turn that must be covered, and the largest gap in it, rad.
const COVERED: f64 = 350.0 / 360.0 * TAU;
const GAP: f64 = 15.0 / 180.0 * PI;
/// Fewest points of a turn: two to the degree of a reversal's spike would be better.
const FEWEST: usize = 180;

/// Reads a test of one or two files.
///
/// # Errors
/// When a file cannot be read or is no circular test, or two do not fit together.
pub fn read(files: &[PathBuf], given: &Given) -> Result<Measured, MeasuredError> {
    let mut runs = Vec::new();
    let mut declared = Declared::default();
    for file in files {
        let (found, own) = runs_of(file, given)?;
        declared = declared.or(own);
        runs.extend(found);
    }
    let mut notes = Vec::new();
    if !given.clockwise.is_empty() {
        if given.clockwise.len() != runs.len() {
            return Err(MeasuredError::Mismatch(format!(
                "--directions names {} and the files have {} turns; name one for each turn, in the order of the files",
                given.clockwise.len(),
                runs.len()
            )));
        }
        runs.iter_mut().zip(&given.clockwise).for_each(|(r, c)| r.clockwise = *c);
    }
    let before = runs.len();
    let mut chosen: Vec<Run> = Vec::new();
    for run in runs {
        if chosen.iter().all(|c| c.clockwise != run.clockwise) {
            chosen.push(run);
        }
    }
    if files.len() == 2 && chosen.len() == 1 {
        let direction = if chosen[0].clockwise { "clockwise" } else { "counter-clockwise" };
        return Err(MeasuredError::Mismatch(format!(
            "{} and {}: both turn {direction}, as far as their columns, header lines, names and the order of their points tell; say it \
             with --directions ccw,cw, one for each of the {before} turns",
            files[0].display(),
            files[1].display()
        )));
    }
    if before > chosen.len() {
        notes.push(format!("{before} turns were found; the first of each direction is used."));
    }
    chosen.sort_by_key(|r| r.clockwise);
    let radius = radius(&chosen, given.radius.or(declared.radius), &mut notes)?;
    let paths: Vec<(bool, Path)> = chosen.iter().map(|r| (r.clockwise, r.path(radius))).collect();
    let no_circle = || MeasuredError::Mismatch("the points are no circle".to_owned());
    let (turns, centre) = turns(&paths, radius).ok_or_else(no_circle)?;
    for (turn, run) in turns.iter().zip(&chosen) {
        let worst = turn.deviation.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        let broken = turn.deviation.iter().chain(&turn.angle).any(|d| !d.is_finite());
        if worst > 0.1 * radius || broken {
            return Err(MeasuredError::File {
                file: run.file.clone(),
                what: format!(
                    "a point lies {} mm off the circle of {} mm: leave out the ways in and out, or check the units and --radius",
                    figure(1e3 * worst),
                    figure(1e3 * radius)
                ),
            });
        }
    }
    let measured = chosen.iter().filter_map(|r| r.feed(radius)).reduce(|a, b| 0.5 * (a + b));
    let feed = given.feed.or(declared.feed).or(measured);
    for r in &chosen {
        notes.extend(r.notes.iter().cloned());
    }
    notes.dedup();
    Ok(Measured { turns, radius, feed, centre, notes })
}

/// A number for a message.
fn figure(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// One turn as it was read.
#[derive(Debug, Clone)]
struct Run {
    file: String,
    clockwise: bool,
    points: Points,
    notes: Vec<String>,
}

impl Run {
    /// Positions about where the file has its zero, given the nominal radius, m.
    fn path(&self, radius: f64) -> Path {
        let polar = |angle: &[f64], r: &dyn Fn(usize) -> f64| {
            let (x, y) = angle.iter().enumerate().map(|(k, a)| (r(k) * a.cos(), r(k) * a.sin())).unzip();
            Path { x, y }
        };
        match &self.points {
            Points::Cartesian { x, y, .. } => Path { x: x.clone(), y: y.clone() },
            Points::Radius { angle, radius: r } => polar(angle, &|k| r[k]),
            Points::Deviation { angle, deviation } => polar(angle, &|k| radius + deviation[k]),
        }
    }

    /// Feed along the circle from the time of the points, m/s.
    fn feed(&self, radius: f64) -> Option<f64> {
        let Points::Cartesian { x, y, time: Some(time) } = &self.points else { return None };
        let (first, last) = (time.first()?, time.last()?);
        let path = radius * span(&angles(x, y));
        let feed = path / (last - first);
        (feed.is_finite() && feed > 0.0).then_some(feed)
    }
}

/// The nominal radius: as given, else the round number that the points lie about.
fn radius(runs: &[Run], given: Option<f64>, notes: &mut Vec<String>) -> Result<f64, MeasuredError> {
    if let Some(given) = given {
        if given.is_finite() && given > 0.0 {
            return Ok(given);
        }
        return Err(MeasuredError::Mismatch(format!("the radius is {given} m: it must be greater than zero")));
    }
    let mut means = Vec::new();
    for run in runs {
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        match &run.points {
            Points::Radius { radius, .. } => means.push(mean(radius)),
            Points::Cartesian { x, y, .. } => {
                let (cx, cy) =
                    super::roundness::least_squares_centre(&Path { x: x.clone(), y: y.clone() }).unwrap_or_default();
                means.push(mean(&x.iter().zip(y).map(|(x, y)| (x - cx).hypot(y - cy)).collect::<Vec<_>>()));
            }
            Points::Deviation { .. } => {
                return Err(MeasuredError::File {
                    file: run.file.clone(),
                    what: "the deviations say nothing of the radius; give it with --radius, in m".to_owned(),
                });
            }
        }
    }
    let mean = means.iter().sum::<f64>() / means.len().max(1) as f64;
    // The roundest number within half a millimetre per metre, as machines are that good: 1 mm, 0.1 mm, ...
    let round = (0..6)
        .map(|digits| 10f64.powi(3 + digits))
        .map(|per| (mean * per).round() / per)
        .find(|r| *r > 0.0 && (mean - r).abs() <= 5e-4 * mean);
    let radius = round.unwrap_or(mean);
    if !(radius.is_finite() && radius > 0.0) {
        return Err(MeasuredError::Mismatch("the points are no circle: their mean radius is zero".to_owned()));
    }
    notes.push(format!(
        "The nominal radius is taken as {} mm, the round number next to the mean of {} mm; --radius sets it.",
        figure(1e3 * radius),
        figure(1e3 * mean)
    ));
    Ok(radius)
}

/// The turns of one file, and what its header lines declare.
fn runs_of(file: &File, given: &Given) -> Result<(Vec<Run>, Declared), MeasuredError> {
    let name = file.display().to_string();
    let failed = |what: String| MeasuredError::File { file: name.clone(), what };
    let read = |reason| TraceError::Read { path: file.to_owned(), reason };
    if !file.is_file() {
        let table = Table::read(file)?;
        return split(&table, &Declared::default(), &name, given).map(|runs| (runs, Declared::default()));
    }
    let size = std::fs::metadata(file).map_err(read)?.len();
    if size > MOST {
        return Err(failed(format!("{size} bytes; a circular test has at most {MOST}")));
    }
    let bytes = std::fs::read(file).map_err(read)?;
    let Some(plain) = text::of(&bytes) else {
        let table = Table::read(file)?;
        return split(&table, &Declared::default(), &name, given).map(|runs| (runs, Declared::default()));
    };
    let table = Table::parse(plain.table.as_bytes(), &name)?;
    let declared = plain.declared.or(text::of_name(file));
    split(&table, &declared, &name, given).map(|runs| (runs, declared))
}

/// Takes a table apart into turns.
fn split(table: &Table, declared: &Declared, file: &str, given: &Given) -> Result<Vec<Run>, MeasuredError> {
    let mut runs = Vec::new();
    let part = given.part.rows(table)?;
    for picked in pick(table, given.radius.or(declared.radius))? {
        let picked = match &part {
            Some(rows) => picked.of_rows(rows),
            None => picked,
        };
        let angle = picked.points.angle();
        let all = stretches(&angle, picked.direction.as_deref());
        let whole = |forward: bool| {
            all.iter()
                .any(|(a, b, f)| *f == forward && b - a >= FEWEST && span(&angles_unwrapped(&angle[*a..*b])) >= COVERED)
        };
        let by_order = matches!(picked.points, Points::Cartesian { .. }) || (whole(true) && whole(false));
        for (from, to, forward) in all {
            let mut points = picked.points.part(from, to);
            let mut notes = picked.notes.clone();
            let own = angles_unwrapped(&points.angle());
            let covered = span(&own);
            if to - from < FEWEST || covered < COVERED {
                continue;
            }
            if covered > TAU + 0.02 {
                // The middle turn: the ends are the ways in and out.
                let spare = 0.5 * (covered - TAU);
                let travel = |k: usize| (own[k] - own[0]).abs();
                let first = (0..own.len()).find(|k| travel(*k) >= spare).unwrap_or(0);
                let last = (0..own.len()).rfind(|k| travel(*k) <= spare + TAU).unwrap_or(own.len() - 1).max(first);
                points = points.part(first, last + 1);
                notes.push(format!("{:.0} degrees were measured; the middle turn is used.", covered.to_degrees()));
            }
            let signed = picked.direction.as_ref().filter(|_| picked.signed).map(|d| d[from] < 0.0);
            let ordered = by_order.then_some(!forward);
            let clockwise = signed.or(picked.clockwise).or(ordered).or(declared.clockwise).unwrap_or(!forward);
            runs.push(Run { file: file.to_owned(), clockwise, points, notes });
        }
    }
    if runs.is_empty() {
        let rows = match part {
            Some(part) => format!("the {} of its {} rows that --from and --to leave", part.len(), table.rows()),
            None => format!("its {} rows", table.rows()),
        };
        return Err(MeasuredError::File {
            file: file.to_owned(),
            what: format!(
                "no whole turn in {rows}: at least {FEWEST} points over 350 degrees without a gap of more than 15 are \
                 needed; the angles or positions must stand in the order of the measurement"
            ),
        });
    }
    Ok(runs)
}

fn angles(x: &[f64], y: &[f64]) -> Vec<f64> {
    let (cx, cy) = super::roundness::least_squares_centre(&Path { x: x.to_vec(), y: y.to_vec() }).unwrap_or_default();
    angles_unwrapped(&x.iter().zip(y).map(|(x, y)| (y - cy).atan2(x - cx)).collect::<Vec<_>>())
}

/// The angles without jumps of a turn.
fn angles_unwrapped(angle: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(angle.len());
    let mut last: Option<f64> = None;
    for a in angle {
        let next = last.map_or(*a, |l: f64| l + (a - l + PI).rem_euclid(TAU) - PI);
        out.push(next);
        last = Some(next);
    }
    out
}

fn span(unwrapped: &[f64]) -> f64 {
    match (unwrapped.first(), unwrapped.last()) {
        (Some(a), Some(b)) => (b - a).abs() * (1.0 + 1.0 / unwrapped.len() as f64),
        _ => 0.0,
    }
}

/// Stretches that turn one way without a gap and with one direction: first point, one past the last, and whether the angle grows.
fn stretches(angle: &[f64], direction: Option<&[f64]>) -> Vec<(usize, usize, bool)> {
    let unwrapped = angles_unwrapped(angle);
    let n = unwrapped.len();
    // The sense over a few points: noise of an angle may step back.
    let half_width = (n / 720).max(1);
    let sense = |k: usize| {
        let (a, b) = (k.saturating_sub(half_width), (k + half_width).min(n - 1));
        unwrapped[b] - unwrapped[a]
    };
    let mut out = Vec::new();
    let mut from = 0;
    for k in 1..=n {
        let turned = k == n
            || (unwrapped[k] - unwrapped[k - 1]).abs() > GAP
            || direction.is_some_and(|d| d[k] != d[k - 1])
            || sense(k) * sense(from + (k - from) / 2) < 0.0;
        if turned {
            let forward = unwrapped[k - 1] > unwrapped[from];
            let mut to = k;
            // Standstill at either end is no part of the turn.
            let still = 0.1 * (unwrapped[to - 1] - unwrapped[from]).abs() / (to - from) as f64;
            while to - from > 2 && (unwrapped[to - 1] - unwrapped[to - 2]).abs() < still {
                to -= 1;
            }
            while to - from > 2 && (unwrapped[from + 1] - unwrapped[from]).abs() < still {
                from += 1;
            }
            out.push((from, to, forward));
            from = k;
        }
    }
    out
}

#[cfg(test)]
mod tests;
