//! The time of a record: which rows of the file are used, and on which uniform grid.

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
    /// The samples lie on it.
    None,
    /// Each sample is moved by less than half an interval.
    Near,
    /// The grid has another number of samples than the rows: a computer took the stamps, samples are lost, or an interval was asked for.
    Far { samples: usize },
}

/// The grid of one piece of a record, and the rows of the file that are in it.
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

/// The clocks of a record: the longest piece without gaps, and the others.
pub(super) struct Clocks {
    /// Of the longest piece.
    pub longest: Clock,
    /// Of the others, in the order of the file.
    pub others: Vec<Clock>,
    /// Warning of the gaps, where there are any: how many pieces they leave. The caller adds which pieces it uses.
    pub gaps: Option<String>,
}

/// Converts stamps that count from a calendar's epoch to seconds from the first stamp. They have no unit: it is found by their size.
///
/// # Errors
/// As [`scale`].
fn calendar_stamps(
    time: &mut [f64],
    table: &Table,
    column: &Column,
    warnings: &mut Vec<String>,
) -> Result<(), TraceError> {
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

/// Largest step over the overflow of a clock, as a share of the clock's range: a larger one means that many samples are lost.
const LARGEST_LOSS: f64 = 0.01;

/// Unwraps a clock that overflows: a time of day at midnight, a counter of 16 or 32 bits. Gives the warning; `None` where the stamps
/// do not overflow.
///
/// # Errors
/// As [`scale`].
fn unwrap_time(time: &mut [f64], table: &Table, column: &Column) -> Result<Option<String>, TraceError> {
    let (_, factor) = scale(table, column, "time", Quantity::Time)?;
    let back: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).filter(|d| *d < 0.0).collect();
    let widths = [
        (86_400.0, "a clock at midnight"),
        (65_536.0 * factor, "a counter of 16 bits"),
        (4_294_967_296.0 * factor, "a counter of 32 bits"),
    ];
    let of = |width: f64| !back.is_empty() && back.iter().all(|d| (0.0..LARGEST_LOSS * width).contains(&(d + width)));
    let Some((width, name)) = widths.into_iter().find(|(w, _)| of(*w)) else { return Ok(None) };
    let (mut turns, mut before) = (0.0, time[0]);
    for t in time.iter_mut() {
        turns += f64::from(u8::from(*t < before));
        before = *t;
        *t += turns * width;
    }
    Ok(Some(format!(
        "{}: column {} starts anew {} times ({name}); the time goes on there",
        table.file,
        column.column,
        back.len()
    )))
}

/// A gap of more than so many intervals is not bridged: the record is cut there.
const BRIDGED: f64 = 6.0;
/// Share of the samples that may be missing in bridged gaps.
const MISSING: f64 = 0.05;

/// The grids of a record: cut by `from` and `to` and at gaps, with even steps where those of the stamps are not.
///
/// # Errors
/// When the time column is missing, has a cell that is no number or a wrong unit, gives no sampling interval, or too few rows are left.
pub(super) fn clock(table: &Table, mapping: &Mapping, warnings: &mut Vec<String>) -> Result<Clocks, TraceError> {
    let file = || table.file.clone();
    let count = table.rows();
    let short = |found: usize| TraceError::Cut { file: file(), found, rows: count, needed: SHORTEST };
    let one_piece = |longest: Clock| Clocks { longest, others: Vec::new(), gaps: None };
    let Some(column) = time_column(table, mapping)? else {
        let dt = mapping.dt.unwrap_or(1.0);
        let index = |t: f64| (t / dt).round().clamp(0.0, count as f64) as usize;
        let rows = mapping.from.map_or(0, index)..mapping.to.map_or(count, |t| (index(t) + 1).min(count));
        if rows.len() < SHORTEST {
            return Err(short(rows.len()));
        }
        let start = rows.start as f64 * dt;
        let grid = Grid { start, dt, sampling: Sampling::Uniform };
        return Ok(one_piece(Clock { grid, rows, stamps: None, resampling: Resampling::None }));
    };
    let mut time = values(table, &column, "time", Quantity::Time, &(0..count))?;
    warnings.extend(table.position(&column.column).and_then(|k| table.bridge_warning(k)).map(str::to_owned));
    calendar_stamps(&mut time, table, &column, warnings)?;
    warnings.extend(unwrap_time(&mut time, table, &column)?);
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
    let line = |k: usize| table.line(rows.start + k);
    let Err(NoGrid::Gap { row, gap, dt: middle }) = grid(&time) else {
        return even(table, rows, time, mapping, warnings).map(one_piece);
    };
    // Stamps that a computer took come in clusters: the mean of the steps without lost samples is the rate.
    let steps = || time.windows(2).map(|w| w[1] - w[0]).filter(|s| *s <= 2.5 * middle);
    let usual = (steps().sum::<f64>() / steps().count().max(1) as f64).max(middle);
    let wide = |k: usize| time[k] - time[k - 1] > BRIDGED * usual;
    let missing: f64 =
        (1..time.len()).map(|k| ((time[k] - time[k - 1]) / usual).round() - 1.0).filter(|m| *m > 0.0).sum();
    let (mut pieces, mut start) = (Vec::new(), 0);
    for k in 1..=time.len() {
        if k == time.len() || wide(k) {
            pieces.push(start..k);
            start = k;
        }
    }
    // Of pieces of equal length the first is taken.
    let best = pieces.iter().fold(0..0, |best: Range<usize>, p| if p.len() > best.len() { p.clone() } else { best });
    let bridges = missing <= MISSING * time.len() as f64;
    if best.len() < SHORTEST || (best.len() == time.len() && !bridges) {
        let missing = ((gap / usual).round() as usize).saturating_sub(1).max(1);
        return Err(TraceError::Gap { file: file(), line: line(row), gap, missing, dt: usual });
    }
    if pieces.len() == 1 {
        return even(table, rows, time, mapping, warnings).map(one_piece);
    }
    let gaps = format!(
        "{}: the record has gaps and is {} pieces (the first ends before row {})",
        table.file,
        pieces.len(),
        line(pieces[1].start)
    );
    let of = |piece: &Range<usize>, warnings: &mut Vec<String>| {
        let part = rows.start + piece.start..rows.start + piece.end;
        even(table, part, time[piece.clone()].to_vec(), mapping, warnings)
    };
    let longest = of(&best, warnings)?;
    // Warnings are given for the longest piece alone; another piece that cannot be used is left out.
    let mut others: Vec<Clock> = pieces
        .iter()
        .filter(|p| **p != best && p.len() >= LEAST_PIECE)
        .filter_map(|p| of(p, &mut Vec::new()).ok())
        .collect();
    others.retain(|o| (o.grid.dt / longest.grid.dt - 1.0).abs() < SAME_RATE);
    Ok(Clocks { longest, others, gaps: Some(gaps) })
}

/// Least samples of a piece other than the longest.
const LEAST_PIECE: usize = 64;
/// Relative difference of the sampling intervals of pieces of one record.
const SAME_RATE: f64 = 1e-3;

/// The grid of rows without gaps; `time` holds the stamp of each row, s.
///
/// # Errors
/// When the stamps do not increase or are too few, and as [`resampled`].
fn even(
    table: &Table,
    rows: Range<usize>,
    time: Vec<f64>,
    mapping: &Mapping,
    warnings: &mut Vec<String>,
) -> Result<Clock, TraceError> {
    let file = || table.file.clone();
    let line = |k: usize| table.line(rows.start + k);
    let found = grid(&time);
    let named = |e: NoGrid| match e {
        NoGrid::TooShort => TraceError::TooShort { file: file(), found: time.len(), needed: SHORTEST },
        NoGrid::NotIncreasing { row } => {
            TraceError::NotIncreasing { file: file(), line: line(row), before: time[row - 1], after: time[row] }
        }
        NoGrid::Gap { row, gap, dt } => TraceError::Gap {
            file: file(),
            line: line(row),
            gap,
            missing: ((gap / dt).round() as usize).saturating_sub(1).max(1),
            dt,
        },
        NoGrid::Jitter { row, jitter, dt } => TraceError::Jitter {
            file: file(),
            line: line(row),
            jitter: 100.0 * jitter,
            limit: 100.0 * Sampling::RESAMPLED,
            dt,
        },
    };
    if let (Some(dt), Ok(_) | Err(NoGrid::Gap { .. } | NoGrid::Jitter { .. })) = (mapping.resample, &found) {
        return resampled(table, rows, time, dt, warnings);
    }
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

/// The grid of interval `dt` (s) that was asked for, from the first to the last of the stamps `time` (s).
///
/// # Errors
/// [`TraceError::Resample`] when it has fewer than [`SHORTEST`] samples or more than [`MOST_SAMPLES`].
fn resampled(
    table: &Table,
    rows: Range<usize>,
    time: Vec<f64>,
    dt: f64,
    warnings: &mut Vec<String>,
) -> Result<Clock, TraceError> {
    let (start, length) = (time[0], time[time.len() - 1] - time[0]);
    let samples = length / dt * (1.0 + 1e-9) + 1.0;
    if samples < SHORTEST as f64 || samples > MOST_SAMPLES {
        return Err(TraceError::Resample { file: table.file.clone(), dt, length });
    }
    let samples = samples as usize;
    let logged = length / (time.len() - 1) as f64;
    // Both the stamps and the new grid bound what is left of the motion.
    let band = 0.1 / logged.max(dt);
    let folded = if dt > 1.5 * logged {
        format!("; what moves faster than {:.4} Hz is folded into slower motion, as no filter is applied", 0.5 / dt)
    } else {
        String::new()
    };
    warnings.push(format!(
        "{}: resampled to dt = {dt:.9e} s as asked for, {samples} samples from {} stamps; the motion is kept up to about \
         {band:.4} Hz (97 % of an amplitude), what moves faster is smeared{folded}",
        table.file,
        time.len()
    ));
    let grid = Grid { start, dt, sampling: Sampling::Jittered { jitter: 0.5 } };
    Ok(Clock { grid, rows, stamps: Some(time), resampling: Resampling::Far { samples } })
}

/// Most samples that a record is resampled to.
const MOST_SAMPLES: f64 = 1e8;
