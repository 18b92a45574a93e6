//! From the columns of a file to a trace: which column is which signal, in which unit, and on which grid.

use std::ops::Range;
use std::path::Path;

use super::clock::{Clock, Clocks, Resampling, clock};
use super::error::{TraceError, nearest};
use super::sampling::{resample, resample_far};
use super::signal::{AxisKind, Quantity, Signal};
use super::table::Table;
use super::units::Unit;
use super::wrap::unwrap;
use super::{Hold, Trace, guess};

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
    /// What the torque does between samples; None where nobody says, and it is taken as held until the record tells otherwise.
    pub hold: Option<Hold>,
    /// Rotary or linear units.
    pub motion: AxisKind,
    /// First time used, s, as the file counts it.
    pub from: Option<f64>,
    /// Last time used, s.
    pub to: Option<f64>,
    /// Interval that the record is resampled to, s, whatever its stamps.
    pub resample: Option<f64>,
}

impl Default for Mapping {
    fn default() -> Self {
        Self {
            time: Column::named("time"),
            dt: None,
            signals: Vec::new(),
            hold: None,
            motion: AxisKind::Rotary,
            from: None,
            to: None,
            resample: None,
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
    /// Warnings for the user: each is a sentence that says what to do.
    pub warnings: Vec<String>,
    /// Unit of a current, a voltage or a percentage that stands for the torque one to one.
    pub drive: Option<String>,
}

/// A record, cut at its gaps.
#[derive(Debug, Clone)]
pub struct LoadedPieces {
    /// The longest piece, and what the user should know about the whole.
    pub longest: Loaded,
    /// The other pieces, in the order of the file: trace and stamps.
    pub others: Vec<(Trace, Option<Vec<f64>>)>,
}

/// Reads a trace file.
///
/// # Errors
/// [`TraceError`], naming file, row and column.
pub fn load(path: &Path, mapping: &Mapping) -> Result<Loaded, TraceError> {
    from_table(&Table::read(path)?, mapping)
}

/// Reads a trace file with all its pieces.
///
/// # Errors
/// [`TraceError`], naming file, row and column.
pub fn load_pieces(path: &Path, mapping: &Mapping) -> Result<LoadedPieces, TraceError> {
    pieces(&Table::read(path)?, mapping, true)
}

/// Makes the trace of a table: of one with gaps the longest piece.
///
/// # Errors
/// [`TraceError`], naming file, row and column.
pub fn from_table(table: &Table, mapping: &Mapping) -> Result<Loaded, TraceError> {
    pieces(table, mapping, false).map(|p| p.longest)
}

/// Makes the traces of a table: the longest piece, and `with_others` the other pieces, too.
///
/// # Errors
/// [`TraceError`], naming file, row and column.
fn pieces(table: &Table, mapping: &Mapping, with_others: bool) -> Result<LoadedPieces, TraceError> {
    let mut warnings: Vec<String> = table.cut.iter().cloned().collect();
    let wanted = wanted(table, mapping, &mut warnings)?;
    if table.rows() < SHORTEST {
        return Err(TraceError::TooShort { file: table.file.clone(), found: table.rows(), needed: SHORTEST });
    }
    let Clocks { longest: clock, others, gaps } = clock(table, mapping, &mut warnings)?;
    let others = if with_others { others } else { Vec::new() };
    let longest = trace(table, mapping, &wanted, &clock, &mut warnings)?;
    let others: Vec<(Trace, Option<Vec<f64>>)> = others
        .into_iter()
        .filter_map(|mut other| {
            let mut piece = trace(table, mapping, &wanted, &other, &mut Vec::new()).ok()?;
            // The rate is the same but for the rounding of the stamps.
            piece.dt = longest.dt;
            Some((piece, other.stamps.take()))
        })
        .collect();
    if let Some(gaps) = gaps {
        let used = longest.len() + others.iter().map(|(t, _)| t.len()).sum::<usize>();
        let end = longest.time(longest.len() - 1);
        warnings.push(if others.is_empty() {
            format!(
                "{gaps}; the longest is used, {used} samples, {:.6} s to {end:.6} s. Another is taken with --from and --to",
                longest.start
            )
        } else {
            gaps
        });
    }
    let drive = wanted.iter().find_map(|(signal, column)| in_drive_units(table, column, *signal));
    let longest = Loaded { trace: longest, stamps: clock.stamps, warnings, drive };
    Ok(LoadedPieces { longest, others })
}

/// The trace of the `wanted` columns, in SI units, on the grid of `clock`.
///
/// # Errors
/// As [`values`] and [`unwrap`]; and when no column is a signal.
fn trace(
    table: &Table,
    mapping: &Mapping,
    wanted: &[(Signal, Column)],
    clock: &Clock,
    warnings: &mut Vec<String>,
) -> Result<Trace, TraceError> {
    let Clock { grid, rows, stamps, resampling } = clock;
    let mut trace = Trace::new(grid.start, grid.dt, mapping.hold.unwrap_or_default());
    for (signal, column) in wanted {
        let mut values = values(table, column, signal.name(), signal.quantity(mapping.motion), rows)?;
        let at = table.position(&column.column);
        warnings.extend(at.and_then(|k| table.bridge_warning(k)).map(str::to_owned));
        if let Some(warning) = unwrap(&mut values, table, column, *signal, mapping.motion)? {
            warnings.push(warning);
        }
        warnings.extend(no_torque_constant(table, column, *signal, mapping.motion));
        let held = matches!(signal, Signal::T | Signal::Command) && mapping.hold.unwrap_or_default() == Hold::Zoh;
        if let Some(time) = stamps {
            values = match *resampling {
                Resampling::None => values,
                // The torque stays as sampled under either hold: only the motion is interpolated to the grid's times.
                Resampling::Near if matches!(signal, Signal::T | Signal::Command) => values,
                Resampling::Near => resample(time, &values, grid),
                Resampling::Far { samples } => resample_far(time, &values, grid, samples, held),
            };
        }
        trace.set(*signal, values)?;
    }
    if trace.is_empty() {
        return Err(no_signal(table));
    }
    Ok(trace)
}

/// The unit that `[signals]` gives to a drive's number of no unit, as a servo's bus or a controller's trace has it.
pub const COUNTS: &str = "counts";

/// Unit of the torque where its column is a drive's quantity (current, voltage, percentage, counts) and `[signals]` gives no factor to
/// N.m; `None` otherwise. The unit is that of the header, of `[signals]`, or the one that the column's name ends in.
pub(super) fn in_drive_units(table: &Table, column: &Column, signal: Signal) -> Option<String> {
    let index = table.position(&column.column)?;
    let header = &table.headers[index];
    #[allow(clippy::float_cmp, reason = "the scale that nobody gave")]
    let plain = column.scale == 1.0;
    if header.unit.is_none() && column.unit.as_deref() == Some(COUNTS) {
        return (signal == Signal::T && plain).then(|| COUNTS.to_owned());
    }
    let given = header.unit.as_deref().or(column.unit.as_deref()).and_then(Unit::parse);
    // The unit that a mapped column's name ends in is told, but not converted from.
    let converted = given.is_some() || table.own(signal) == Some(index);
    let unit = given.or_else(|| guess::suffix(&header.name).map(|(_, unit)| unit))?;
    let base = if converted { unit.symbol.trim_start_matches('m') } else { unit.symbol };
    (signal == Signal::T && unit.quantity == Quantity::Drive && plain).then(|| base.to_owned())
}

/// Warning where the torque is in a drive's unit and no torque constant is given: inertia and stiffness then come out in that unit.
pub(super) fn no_torque_constant(table: &Table, column: &Column, signal: Signal, motion: AxisKind) -> Option<String> {
    let written = in_drive_units(table, column, signal)?;
    let turn = motion.unit("rad");
    Some(format!(
        "{}: column {} is in {written}, and no torque constant is given: {written} stands for the torque, and inertia comes out in \
         {written}.s2/{turn}, stiffness in {written}/{turn}; give the constant as scale of T in [signals] to have SI units",
        table.file, column.column,
    ))
}

/// The signals of the file, each with its column: what `[signals]` maps, and what has a signal's own name. Appends a warning where
/// `[signals]` does not fit the file and is not used.
///
/// # Errors
/// When a column of `[signals]` is not in the table.
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
    // Either the columns that [signals] maps, or those of a trace that this program wrote: never some of both.
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
    // Signals that [signals] does not name are found by their own names, where no other signal has the column.
    for (signal, column) in Signal::ALL.into_iter().filter_map(named) {
        let is_mapped = mapping.signals.iter().any(|(s, _)| *s == signal);
        let taken = there.iter().any(|(_, c)| table.position(&c.column) == table.position(&column.column));
        if !is_mapped && !taken {
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

/// Index of a column in the table, and the factor from its numbers to SI units: the scale of `[signals]` times the factor of its unit.
///
/// # Errors
/// When the column is missing, or its unit is unknown or of another quantity.
pub(super) fn scale(
    table: &Table,
    column: &Column,
    signal: &'static str,
    quantity: Quantity,
) -> Result<(usize, f64), TraceError> {
    let index = table.position(&column.column).ok_or_else(|| missing(table, signal, &column.column))?;
    let mut scale = column.scale;
    // A unit at the end of a column's name counts only where the column was found by the signal's own name, not by [signals].
    let own = Signal::from_name(signal).is_some_and(|s| table.own(s) == Some(index))
        || (signal == "time" && time_name(&table.headers[index].name));
    let suffixed = || guess::suffix(&table.headers[index].name).filter(|_| own).map(|(_, unit)| unit.symbol.to_owned());
    let written = table.headers[index].unit.clone().or_else(|| column.unit.clone()).or_else(suffixed);
    let counts = matches!(quantity, Quantity::Torque | Quantity::Force) && written.as_deref() == Some(COUNTS);
    if let Some(text) = written.as_ref().filter(|_| !counts) {
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

/// `scale*raw + offset` for each value.
pub(super) fn scaled(raw: &[f64], scale: f64, offset: f64) -> Vec<f64> {
    if scale == 1.0 && offset == 0.0 { raw.to_vec() } else { raw.iter().map(|v| v * scale + offset).collect() }
}

/// The values of a column in SI units, scaled.
///
/// # Errors
/// As [`scale`]; and when a cell among the rows is no finite number.
pub(super) fn values(
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
pub(super) fn time_name(name: &str) -> bool {
    let stem = guess::suffix(name).filter(|(_, unit)| unit.quantity == Quantity::Time).map_or(name, |(stem, _)| stem);
    stem == "t" || ["time", "timestamp", "zeit"].iter().any(|n| stem.eq_ignore_ascii_case(n))
}

/// The column of time; none where the mapping gives the interval and the file has no such column.
///
/// # Errors
/// When there is no column of time and no interval is given.
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

/// The error where no column is a signal.
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
    fn a_current_that_stands_for_the_torque_is_told() {
        let table = csv("time [s],current [A]", |k| format!("{k},1"));
        let warnings = |scale: f64| {
            let column = Column { scale, ..Column::named("current") };
            let mapping = Mapping { signals: vec![(Signal::T, column)], ..Mapping::default() };
            from_table(&table, &mapping).unwrap().warnings
        };
        let text = warnings(1.0).join("\n");
        assert!(text.contains("column current is in A, and no torque constant is given"), "{text}");
        assert_eq!(warnings(0.5), Vec::<String>::new());
    }

    #[test]
    fn a_torque_in_counts_keeps_them_until_a_constant_is_given_and_no_other_signal_has_them() {
        let table = csv("time [s],load,theta1", |k| format!("{k},{},{k}", 100 * k));
        let read = |scale: f64, theta1: Column| {
            let load = Column { unit: Some(COUNTS.into()), scale, ..Column::named("load") };
            let signals = vec![(Signal::T, load), (Signal::Theta1, theta1)];
            from_table(&table, &Mapping { signals, ..Mapping::default() })
        };
        let loaded = read(1.0, Column::named("theta1")).unwrap();
        assert_eq!((loaded.drive.as_deref(), loaded.trace.get(Signal::T).unwrap()[3]), (Some("counts"), 300.0));
        let loaded = read(0.5, Column::named("theta1")).unwrap();
        assert_eq!((loaded.drive, loaded.trace.get(Signal::T).unwrap()[3]), (None, 150.0));
        let error = read(1.0, Column { unit: Some(COUNTS.into()), ..Column::named("theta1") }).unwrap_err().to_string();
        assert!(error.contains("counts"), "{error}");
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

    #[test]
    fn few_missing_values_are_bridged_with_a_word_and_many_or_those_at_an_end_are_refused() {
        let table = |missing: &[usize]| {
            let mut text = String::from("time [s],T [N.m]");
            for k in 0..200 {
                let cell = if missing.contains(&k) { "NaN".to_owned() } else { format!("{}", 2 * k) };
                text.push_str(&format!("\n{k},{cell}"));
            }
            Table::parse(text.as_bytes(), "log.csv").unwrap()
        };
        let loaded = from_table(&table(&[40, 41]), &Mapping::default()).unwrap();
        assert_eq!(loaded.trace.get(Signal::T).unwrap()[39..43], [78.0, 80.0, 82.0, 84.0]);
        let text = loaded.warnings.join("\n");
        assert!(text.contains("column T has no number in 2 of 200 rows, the first row 42"), "{text}");
        for missing in [&[0][..], &[199], &[40, 80, 120], &[40, 41, 42, 43]] {
            let error = from_table(&table(missing), &Mapping::default()).unwrap_err().to_string();
            assert!(error.contains(&format!("row {}, column T", missing[0] + 2)), "{missing:?}: {error}");
        }
    }

    #[test]
    fn counters_and_clocks_that_start_anew_go_on() {
        // An encoder of 12 bits and a clock of 16 bits of microseconds, both across their ends.
        let mut text = String::from("time [us],theta1");
        for k in 0..200 {
            text.push_str(&format!("\n{},{}", (65_000 + 100 * k) % 65_536, (4000 + 50 * k) % 4096));
        }
        let table = Table::parse(text.as_bytes(), "log.csv").unwrap();
        let loaded = from_table(&table, &Mapping::default()).unwrap();
        assert!((loaded.trace.dt() - 1e-4).abs() < 1e-12);
        let theta = loaded.trace.get(Signal::Theta1).unwrap();
        assert!(theta.windows(2).all(|w| w[1] - w[0] == 50.0), "{theta:?}");
        let text = loaded.warnings.join("\n");
        assert!(text.contains("time starts anew 1 times (a counter of 16 bits)"), "{text}");
        assert!(text.contains("theta1 starts anew 3 times (a counter of 12 bits)"), "{text}");
    }
}
