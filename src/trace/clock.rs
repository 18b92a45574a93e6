//! The time of a record: which rows of the file it is, and on which grid.

use std::ops::Range;

use super::Grid;
use super::error::TraceError;
use super::load::{Column, Mapping, SHORTEST, scale, time_column, values};
use super::sampling::{NoGrid, Sampling, grid};
use super::signal::Quantity;
use super::table::Table;

/// How the columns are brought to the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Resampling {
    /// They lie on it.
    None,
    /// Each sample is moved by less than half an interval.
    Near,
    /// The grid has its own samples: stamps that a computer took, some samples lost.
    Far { samples: usize },
}

/// The grid of a record, and the rows of the file that it is.
pub(super) struct Clock {
    /// The grid.
    pub grid: Grid,
    /// Rows of the file.
    pub rows: Range<usize>,
    /// Their time stamps as logged, s.
    pub stamps: Option<Vec<f64>>,
    /// How the columns are brought to it.
    pub resampling: Resampling,
}

/// Stamps that count from a calendar's beginning, in a unit that only their size tells, brought to seconds from the first.
fn epoch(time: &mut [f64], table: &Table, column: &Column, warnings: &mut Vec<String>) -> Result<(), TraceError> {
    let given = scale(table, column, "time", Quantity::Time)?;
    let has_unit = given.1 != 1.0 || table.headers[given.0].unit.is_some() || column.unit.is_some();
    let Some(first) = time.first().copied().filter(|t| *t > 1e8 && !has_unit) else { return Ok(()) };
    // Seconds, milli-, micro- and nanoseconds since 1970 of the years 1973 to 2286; FILETIME of Windows counts tenths of a
    // microsecond since 1601.
    let (name, factor) = match first {
        t if t < 1e10 => ("seconds", 1.0),
        t if (1e11..1e13).contains(&t) => ("milliseconds", 1e-3),
        t if (1e14..1e16).contains(&t) => ("microseconds", 1e-6),
        t if (1e17..5e17).contains(&t) => ("tenths of a microsecond (FILETIME)", 1e-7),
        t if (5e17..1e19).contains(&t) => ("nanoseconds", 1e-9),
        _ => return Ok(()),
    };
    time.iter_mut().for_each(|t| *t = (*t - first) * factor);
    warnings.push(format!(
        "{}: the time stamps of column {} are taken for {name} of a calendar and count from the first one; --from and --to count \
         from there",
        table.file, column.column
    ));
    Ok(())
}

/// A gap of more than so many intervals is not bridged: the record is cut there.
const BRIDGED: f64 = 6.0;
/// Share of the samples that may be missing in bridged gaps.
const MISSING: f64 = 0.05;

/// The grid: cut by `from` and `to`, at gaps, and brought to even steps where the stamps are not.
pub(super) fn clock(table: &Table, mapping: &Mapping, warnings: &mut Vec<String>) -> Result<Clock, TraceError> {
    let file = || table.file.clone();
    let count = table.rows();
    let short = |found: usize| TraceError::Cut { file: file(), found, rows: count, needed: SHORTEST };
    let Some(column) = time_column(table, mapping)? else {
        let dt = mapping.dt.unwrap_or(1.0);
        let index = |t: f64| (t / dt).round().clamp(0.0, count as f64) as usize;
        let rows = mapping.from.map_or(0, index)..mapping.to.map_or(count, |t| (index(t) + 1).min(count));
        if rows.len() < SHORTEST {
            return Err(short(rows.len()));
        }
        let start = rows.start as f64 * dt;
        let grid = Grid { start, dt, sampling: Sampling::Uniform };
        return Ok(Clock { grid, rows, stamps: None, resampling: Resampling::None });
    };
    let mut time = values(table, &column, "time", Quantity::Time, &(0..count))?;
    epoch(&mut time, table, &column, warnings)?;
    let mut rows = 0..count;
    if mapping.from.is_some() || mapping.to.is_some() {
        let (from, to) = (mapping.from.unwrap_or(f64::NEG_INFINITY), mapping.to.unwrap_or(f64::INFINITY));
        // Half a sample of tolerance, as stamps are written with few digits.
        let slack = if count > 1 { 0.5 * (time[count - 1] - time[0]).abs() / (count - 1) as f64 } else { 0.0 };
        let first = time.iter().position(|t| *t >= from - slack).unwrap_or(count);
        let last = time.iter().rposition(|t| *t <= to + slack).map_or(0, |k| k + 1);
        rows = first..last.max(first);
        if rows.len() < SHORTEST {
            return Err(short(rows.len()));
        }
        time = time[rows.clone()].to_vec();
    }
    let line = |rows: &Range<usize>, k: usize| table.line(rows.start + k);
    let mut found = grid(&time);
    if let Err(NoGrid::Gap { row, gap, dt: middle }) = found {
        // Stamps that a computer took come in clusters: the mean of the steps without lost samples is the rate.
        let steps = || time.windows(2).map(|w| w[1] - w[0]).filter(|s| *s <= 2.5 * middle);
        let usual = (steps().sum::<f64>() / steps().count().max(1) as f64).max(middle);
        let dt = usual;
        let wide = |k: usize| time[k] - time[k - 1] > BRIDGED * usual;
        let missing: f64 =
            (1..time.len()).map(|k| ((time[k] - time[k - 1]) / usual).round() - 1.0).filter(|m| *m > 0.0).sum();
        let (mut best, mut start) = (0..0, 0);
        for k in 1..=time.len() {
            if k == time.len() || wide(k) {
                if k - start > best.len() {
                    best = start..k;
                }
                start = k;
            }
        }
        let refused = TraceError::Gap {
            file: file(),
            line: line(&rows, row),
            gap,
            missing: ((gap / dt).round() as usize).saturating_sub(1).max(1),
            dt,
        };
        let bridges = missing <= MISSING * time.len() as f64;
        if best.len() < SHORTEST || (best.len() == time.len() && !bridges) {
            return Err(refused);
        }
        if best.len() < time.len() {
            let pieces = 1 + (1..time.len()).filter(|k| wide(*k)).count();
            warnings.push(format!(
                "{}: the record has gaps and is {pieces} pieces (the first ends before row {}); the longest is used, {} of {} \
                 samples, {:.6} s to {:.6} s. Another is taken with --from and --to",
                table.file,
                line(&rows, (1..time.len()).find(|k| wide(*k)).unwrap_or(row)),
                best.len(),
                time.len(),
                time[best.start],
                time[best.end - 1]
            ));
            rows = rows.start + best.start..rows.start + best.end;
            time = time[best].to_vec();
            found = grid(&time);
        }
    }
    let named = |e: NoGrid| match e {
        NoGrid::TooShort => TraceError::TooShort { file: file(), found: time.len(), needed: SHORTEST },
        NoGrid::NotIncreasing { row } => {
            TraceError::NotIncreasing { file: file(), line: line(&rows, row), before: time[row - 1], after: time[row] }
        }
        NoGrid::Gap { row, gap, dt } => TraceError::Gap {
            file: file(),
            line: line(&rows, row),
            gap,
            missing: ((gap / dt).round() as usize).saturating_sub(1).max(1),
            dt,
        },
        NoGrid::Jitter { row, jitter, dt } => TraceError::Jitter {
            file: file(),
            line: line(&rows, row),
            jitter: 100.0 * jitter,
            limit: 100.0 * Sampling::RESAMPLED,
            dt,
        },
    };
    let (grid, resampling) = match found {
        Ok(grid) => match grid.sampling {
            Sampling::Uniform => (grid, Resampling::None),
            Sampling::Jittered { jitter } => {
                warnings.push(format!(
                    "{}: the time stamps are up to {:.1} % of a sample off uniform sampling; the trace was resampled to dt = \
                     {:.9e} s. If the sampling is uniform and only its stamps are not, give dt in [signals] and leave the time \
                     column out",
                    table.file,
                    100.0 * jitter,
                    grid.dt
                ));
                (grid, Resampling::Near)
            }
        },
        Err(NoGrid::Gap { dt: middle, .. } | NoGrid::Jitter { dt: middle, .. }) => {
            let (start, end) = (time[0], time[time.len() - 1]);
            let steps = || time.windows(2).map(|w| w[1] - w[0]).filter(|s| *s <= 2.5 * middle);
            let dt = steps().sum::<f64>() / steps().count().max(1) as f64;
            let samples = ((end - start) / dt).round() as usize + 1;
            let grid =
                Grid { start, dt: (end - start) / (samples - 1) as f64, sampling: Sampling::Jittered { jitter: 0.5 } };
            warnings.push(format!(
                "{}: the steps between time stamps are uneven ({} stamps for {samples} samples at an even rate); the trace \
                 was resampled to dt = {:.9e} s. What moves faster than about {:.4} Hz is smeared by it",
                table.file,
                time.len(),
                grid.dt,
                // A cubic through four samples keeps 97 % of an amplitude up to a tenth of the sampling rate.
                0.1 / grid.dt
            ));
            (grid, Resampling::Far { samples })
        }
        Err(e) => return Err(named(e)),
    };
    Ok(Clock { grid, rows, stamps: Some(time), resampling })
}
