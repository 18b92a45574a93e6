//! From the columns of a file to a trace: which column is which signal, in which unit, and on which grid.

use std::ops::Range;
use std::path::Path;

use super::error::{TraceError, nearest};
use super::sampling::{NoGrid, Sampling, grid, resample, resample_far};
use super::signal::{Motion, Quantity, Signal};
use super::table::Table;
use super::units::Unit;
use super::{Grid, Hold, Trace, guess};

/// Least samples of a trace.
pub(super) const SHORTEST: usize = 16;

/// Where a signal stands in a log: `value = scale*column + offset`, after the column's unit is brought to SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name of the column, without unit.
    pub column: String,
    /// Unit, where the header has none in brackets.
    pub unit: Option<String>,
    /// Factor to SI, or from the drive's units to the torque.
    pub scale: f64,
    /// Added after scaling, SI.
    pub offset: f64,
}

impl Column {
    /// A column of that name in SI units.
    #[must_use]
    pub fn named(column: &str) -> Self {
        Self { column: column.to_owned(), unit: None, scale: 1.0, offset: 0.0 }
    }

    fn is_plain(&self) -> bool {
        self.unit.is_none() && self.scale == 1.0 && self.offset == 0.0
    }
}

/// How a log's columns become signals: `[signals]` of axis.toml.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    /// The column of time; its unit must be a time.
    pub time: Column,
    /// Sampling interval, s, for a log without a time column.
    pub dt: Option<f64>,
    /// The signals that are mapped; empty: every column that has a signal's name.
    pub signals: Vec<(Signal, Column)>,
    /// What the torque does between samples.
    pub hold: Hold,
    /// Rotary or linear units.
    pub motion: Motion,
    /// First time used, s, as the file counts it.
    pub from: Option<f64>,
    /// Last time used, s.
    pub to: Option<f64>,
}

impl Default for Mapping {
    fn default() -> Self {
        Self {
            time: Column::named("time"),
            dt: None,
            signals: Vec::new(),
            hold: Hold::Zoh,
            motion: Motion::Rotary,
            from: None,
            to: None,
        }
    }
}

/// A trace and what the user should know about it.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The record.
    pub trace: Trace,
    /// The time stamps of its samples as they were logged, s; None where the file has none.
    pub stamps: Option<Vec<f64>>,
    /// Each a sentence that says what to do.
    pub warnings: Vec<String>,
}

/// Reads a trace file.
///
/// # Errors
/// [`TraceError`], naming file, row and column.
pub fn load(path: &Path, mapping: &Mapping) -> Result<Loaded, TraceError> {
    from_table(&Table::read(path)?, mapping)
}

/// Makes the trace of a table.
///
/// # Errors
/// [`TraceError`], naming file, row and column.
pub fn from_table(table: &Table, mapping: &Mapping) -> Result<Loaded, TraceError> {
    let mut warnings = Vec::new();
    let wanted = wanted(table, mapping, &mut warnings)?;
    if table.rows() < SHORTEST {
        return Err(TraceError::TooShort { file: table.file.clone(), found: table.rows(), needed: SHORTEST });
    }
    let Clock { grid, rows, stamps, resampling } = clock(table, mapping, &mut warnings)?;
    let mut trace = Trace::new(grid.start, grid.dt, mapping.hold);
    for (signal, column) in wanted {
        let mut values = values(table, &column, signal.name(), signal.quantity(mapping.motion), &rows)?;
        if let Some(word) = unwrap(&mut values, table, &column, signal, mapping.motion)? {
            warnings.push(word);
        }
        let held = matches!(signal, Signal::T | Signal::Command) && mapping.hold == Hold::Zoh;
        if let Some(time) = &stamps {
            values = match resampling {
                Resampling::None => values,
                // The torque belongs to its sample under either hold: only the motion is read off at the grid's times.
                Resampling::Near if matches!(signal, Signal::T | Signal::Command) => values,
                Resampling::Near => resample(time, &values, &grid),
                Resampling::Far { samples } => resample_far(time, &values, &grid, samples, held),
            };
        }
        trace.set(signal, values)?;
    }
    if trace.is_empty() {
        return Err(no_signal(table));
    }
    Ok(Loaded { trace, stamps, warnings })
}

/// The signals that the file has, and where.
pub(super) fn wanted(
    table: &Table,
    mapping: &Mapping,
    warnings: &mut Vec<String>,
) -> Result<Vec<(Signal, Column)>, TraceError> {
    let named = |s: Signal| table.own(s).map(|k| (s, Column::named(&table.headers[k].name)));
    if mapping.signals.iter().all(|(s, _)| s.is_of_the_loop()) {
        let mut all: Vec<_> = Signal::ALL.into_iter().filter_map(named).collect();
        let there = mapping.signals.iter().filter(|(_, c)| table.position(&c.column).is_some());
        for (signal, column) in there {
            all.retain(|(s, _)| s != signal);
            all.push((*signal, column.clone()));
        }
        return Ok(all);
    }
    // The log of the axis file, or a trace this program wrote: one or the other, never a mixture.
    let mapped = |c: &Column| table.position(&c.column).is_some();
    let own = |s: Signal| table.own(s).is_some();
    if !mapping.signals.iter().any(|(s, c)| !s.is_of_the_loop() && mapped(c))
        && mapping.signals.iter().any(|(s, _)| own(*s))
    {
        warnings.push(format!(
            "{}: none of the columns that [signals] maps are there; the columns with the signals' own names are used, \
             in SI units without scale or offset",
            table.file
        ));
        let present = mapping.signals.iter().filter(|(s, c)| own(*s) && !c.column.is_empty());
        return Ok(present.filter_map(|(s, _)| named(*s)).collect());
    }
    let mut there = mapping.signals.clone();
    there.retain(|(signal, column)| (!signal.is_of_the_loop() || mapped(column)) && !column.column.is_empty());
    for (signal, column) in &there {
        if !mapped(column) {
            return Err(missing(table, signal.name(), &column.column));
        }
    }
    // Signals that [signals] does not speak of are found by their own names, where no other signal has the column.
    for (signal, column) in Signal::ALL.into_iter().filter_map(named) {
        let spoken = mapping.signals.iter().any(|(s, _)| *s == signal);
        let taken = there.iter().any(|(_, c)| table.position(&c.column) == table.position(&column.column));
        if !spoken && !taken {
            there.push((signal, column));
        }
    }
    there.sort_by_key(|(signal, _)| *signal);
    Ok(there)
}

fn missing(table: &Table, signal: &'static str, wanted: &str) -> TraceError {
    TraceError::MissingColumn {
        file: table.file.clone(),
        signal,
        wanted: wanted.to_owned(),
        hint: nearest(wanted, table.headers.iter().map(|h| h.name.as_str())),
        present: table.names(),
    }
}

/// Which column it is, and the factor that brings it to SI.
pub(super) fn scale(
    table: &Table,
    column: &Column,
    signal: &'static str,
    quantity: Quantity,
) -> Result<(usize, f64), TraceError> {
    let index = table.position(&column.column).ok_or_else(|| missing(table, signal, &column.column))?;
    let mut scale = column.scale;
    // A column found by the signal's own name has the unit at that name's end; one that [signals] names has none but there.
    let own = Signal::from_name(signal).is_some_and(|s| table.own(s) == Some(index))
        || (signal == "time" && time_name(&table.headers[index].name));
    let behind = || guess::suffix(&table.headers[index].name).filter(|_| own).map(|(_, unit)| unit.symbol.to_owned());
    let written = table.headers[index].unit.clone().or_else(|| column.unit.clone()).or_else(behind);
    if let Some(text) = &written {
        let unit = Unit::parse(text).ok_or_else(|| TraceError::UnknownUnit {
            file: table.file.clone(),
            column: column.column.clone(),
            unit: text.clone(),
            signal,
            needed: quantity,
        })?;
        let drives = matches!(quantity, Quantity::Torque | Quantity::Force) && unit.quantity == Quantity::Drive;
        if unit.quantity != quantity && !drives {
            return Err(TraceError::WrongUnit {
                file: table.file.clone(),
                column: column.column.clone(),
                unit: text.clone(),
                is: unit.quantity,
                signal,
                needed: quantity,
            });
        }
        scale *= unit.factor;
    }
    Ok((index, scale))
}

/// Raw values scaled.
pub(super) fn scaled(raw: &[f64], scale: f64, offset: f64) -> Vec<f64> {
    if scale == 1.0 && offset == 0.0 { raw.to_vec() } else { raw.iter().map(|v| v * scale + offset).collect() }
}

/// The values of a column in SI units, scaled.
fn values(
    table: &Table,
    column: &Column,
    signal: &'static str,
    quantity: Quantity,
    rows: &Range<usize>,
) -> Result<Vec<f64>, TraceError> {
    let (index, scale) = scale(table, column, signal, quantity)?;
    Ok(scaled(table.part(index, rows)?, scale, column.offset))
}

/// Whether a column is called as times are: `t`, `Time`, `time_ms`, `timestamp`.
fn time_name(name: &str) -> bool {
    let stem = guess::suffix(name).filter(|(_, unit)| unit.quantity == Quantity::Time).map_or(name, |(stem, _)| stem);
    stem == "t" || ["time", "timestamp", "zeit"].iter().any(|n| stem.eq_ignore_ascii_case(n))
}

/// The column of time; none where the mapping gives the interval and the file has no such column.
pub(super) fn time_column(table: &Table, mapping: &Mapping) -> Result<Option<Column>, TraceError> {
    let column = mapping.time.clone();
    if table.position(&column.column).is_some() {
        return Ok(Some(column));
    }
    if mapping.dt.is_some() {
        return Ok(None);
    }
    if table.position("time").is_some() {
        return Ok(Some(Column::named("time")));
    }
    if column.is_plain()
        && column.column == "time"
        && let Some(header) = table.headers.iter().find(|h| time_name(&h.name))
    {
        return Ok(Some(Column::named(&header.name)));
    }
    if column.is_plain() && column.column == "time" {
        return Err(TraceError::NoTable {
            file: table.file.clone(),
            what: format!(
                "no column \"time\"; the columns are: {}. Name the column of time in [signals] of the axis file \
                 (time = \"...\"), or give the interval there (dt = 0.001)",
                table.names()
            ),
        });
    }
    Ok(Some(column))
}

/// No column is a signal.
pub(super) fn no_signal(table: &Table) -> TraceError {
    TraceError::NoTable {
        file: table.file.clone(),
        what: format!(
            "no column has a signal's name ({}); the columns are: {}. `eixo init` guesses which is which and writes the axis \
             file for --axis, whose [signals] maps them",
            Signal::ALL.map(Signal::name).join(", "),
            table.names()
        ),
    }
}

/// Counters of limited width go on where they start anew; says so. A counter of 16 or 32 bits is one whose whole numbers jump
/// by nearly its width; an angle within one turn jumps by nearly that.
fn unwrap(
    values: &mut [f64],
    table: &Table,
    column: &Column,
    signal: Signal,
    motion: Motion,
) -> Result<Option<String>, TraceError> {
    let (_, factor) = scale(table, column, signal.name(), signal.quantity(motion))?;
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let whole = |v: &f64| ((v - column.offset) / factor).fract() == 0.0;
    let position = matches!(signal.quantity(motion), Quantity::Angle | Quantity::Length);
    let turn = signal.quantity(motion) == Quantity::Angle;
    let mut widths: Vec<(f64, &str)> = Vec::new();
    if values.iter().take(4096).all(whole) {
        widths.extend([(65_536.0, "a counter of 16 bits"), (4_294_967_296.0, "a counter of 32 bits")]);
        widths.iter_mut().for_each(|w| w.0 *= factor.abs());
    }
    if turn {
        widths.push((std::f64::consts::TAU * column.scale.abs(), "an angle within one turn"));
    }
    for (width, name) in widths {
        let jumps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).filter(|d| d.abs() > 0.5 * width).collect();
        // What wraps stays within its width, reaches both ends of it, and leaps nearly all of it at once.
        let wraps = high - low <= 1.001 * width
            && high - low > 0.8 * width
            && !jumps.is_empty()
            && jumps.iter().all(|d| d.abs() > 0.8 * width)
            && (position || name.starts_with("a counter"));
        if !wraps {
            continue;
        }
        let mut turns = 0.0;
        let mut before = values[0];
        for v in values.iter_mut() {
            let step = *v - before;
            before = *v;
            if step.abs() > 0.5 * width {
                turns -= step.signum();
            }
            *v += turns * width;
        }
        // Where it began is not known: the record is kept near zero for a signal that is no position.
        if !position && values[0] > 0.5 * width {
            values.iter_mut().for_each(|v| *v -= width);
        }
        return Ok(Some(format!(
            "{}: column {} starts anew {} times ({name}); it was unwrapped",
            table.file,
            column.column,
            jumps.len()
        )));
    }
    Ok(None)
}

/// How the columns are brought to the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Resampling {
    /// They lie on it.
    None,
    /// Each sample is moved by less than half an interval.
    Near,
    /// The grid has its own samples: stamps that a computer took, some samples lost.
    Far { samples: usize },
}

/// The grid of a record, and the rows of the file that it is.
struct Clock {
    grid: Grid,
    rows: Range<usize>,
    stamps: Option<Vec<f64>>,
    resampling: Resampling,
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
fn clock(table: &Table, mapping: &Mapping, warnings: &mut Vec<String>) -> Result<Clock, TraceError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn csv(header: &str, row: impl Fn(usize) -> String) -> Table {
        let mut text = header.to_owned();
        for k in 0..20 {
            text.push('\n');
            text.push_str(&row(k));
        }
        Table::parse(text.as_bytes(), "log.csv").unwrap()
    }

    #[test]
    fn units_in_the_header_are_brought_to_si() {
        let table = csv("time [ms],T [mN.m],theta1 [deg],x2 [um]", |k| format!("{k},250,90,{k}"));
        let trace = from_table(&table, &Mapping::default()).unwrap().trace;
        assert!((trace.dt() - 1e-3).abs() < 1e-15);
        assert!((trace.get(Signal::T).unwrap()[3] - 0.25).abs() < 1e-15);
        assert!((trace.get(Signal::Theta1).unwrap()[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((trace.get(Signal::X2).unwrap()[7] - 7e-6).abs() < 1e-18);
    }

    #[test]
    fn a_wrong_or_unknown_unit_names_the_units_that_fit() {
        let table = csv("time [s],T [N]", |k| format!("{k},1"));
        let error = from_table(&table, &Mapping::default()).unwrap_err().to_string();
        assert!(error.contains("a force") && error.contains("N.m"), "{error}");
        let table = csv("time [s],theta1 [grads]", |k| format!("{k},1"));
        let error = from_table(&table, &Mapping::default()).unwrap_err().to_string();
        assert!(error.contains("[grads]") && error.contains("mrad"), "{error}");
    }

    #[test]
    fn a_mapped_column_is_scaled_and_a_missing_one_gets_a_near_name() {
        let table = csv("t_s,iq_meas_A,theta_motor_rad", |k| format!("{},2,{k}", 0.5 * k as f64));
        let mut mapping = Mapping {
            time: Column::named("t_s"),
            signals: vec![
                (Signal::T, Column { scale: 0.52, offset: -0.04, ..Column::named("iq_meas_A") }),
                (Signal::Theta1, Column::named("theta_motor_rad")),
            ],
            ..Mapping::default()
        };
        let trace = from_table(&table, &mapping).unwrap().trace;
        assert_eq!(trace.get(Signal::T).unwrap()[0], 1.0);
        assert_eq!(trace.dt(), 0.5);
        mapping.signals[1].1.column = "theta_moter_rad".into();
        let error = from_table(&table, &mapping).unwrap_err().to_string();
        assert!(error.contains("did you mean \"theta_motor_rad\""), "{error}");
    }

    #[test]
    fn a_trace_of_our_own_is_read_with_the_axis_file_of_a_foreign_log() {
        let table = csv("time,T,theta1", |k| format!("{k},1,2"));
        let mapping = Mapping {
            time: Column::named("t_s"),
            signals: vec![(Signal::T, Column { scale: 3.0, ..Column::named("iq") })],
            ..Mapping::default()
        };
        let loaded = from_table(&table, &mapping).unwrap();
        assert_eq!(loaded.trace.get(Signal::T).unwrap()[0], 1.0);
        assert!(!loaded.trace.has(Signal::Theta1));
        assert_eq!(loaded.warnings.len(), 1);
    }

    #[test]
    fn a_gap_and_a_short_trace_name_row_and_file() {
        let table = csv("time,T", |k| format!("{},1", if k < 9 { k } else { k + 4 }));
        let error = from_table(&table, &Mapping::default()).unwrap_err().to_string();
        assert!(error.contains("log.csv: row 11") && error.contains("4 missing"), "{error}");
        let table = Table::parse(b"time,T\n0,1\n1,1\n", "log.csv").unwrap();
        assert!(from_table(&table, &Mapping::default()).unwrap_err().to_string().contains("2 samples"));
    }

    #[test]
    fn jitter_is_resampled_with_a_warning() {
        let stamp = |k: usize| k as f64 + if k % 2 == 1 { 0.137 } else { 0.0 };
        let table = csv("time,T,theta1", |k| {
            let t = if k == 19 { 19.0 } else { stamp(k) };
            format!("{t},{k},{}", 3.0 * t)
        });
        let loaded = from_table(&table, &Mapping::default()).unwrap();
        assert_eq!(loaded.warnings.len(), 1);
        for k in 0..20 {
            assert!((loaded.trace.get(Signal::Theta1).unwrap()[k] - 3.0 * k as f64).abs() < 1e-9);
            assert_eq!(loaded.trace.get(Signal::T).unwrap()[k], k as f64);
        }
    }
}
