//! Traces larger than memory: the rows of a CSV or Parquet file, some thousand at a time, as often as they are asked for.
//!
//! The checks of [`super::load()`] are made in one pass when the trace is opened, its corrections each time the trace is read. Resampling
//! needs the whole record at once: it is refused, and the error says what to do instead.

use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use memchr::memrchr;

use super::error::TraceError;
use super::forms::{self, Form};
use super::load::{
    Mapping, SHORTEST, in_drive_units, no_signal, no_torque_constant, scale, scaled, time_column, wanted,
};
use super::missing::{Bridges, Piece};
use super::sampling::{Decimals, Sampling};
use super::table::{Fault, Kind, Table};
use super::{Quantity, Signal, Trace, csv, parquet};

/// Bytes of a CSV file that are read at a time: this bounds the memory in use, whatever the size of the file.
const BLOCK: usize = 8 << 20;
/// Number of steps between time stamps whose median is taken for the usual one.
const STEPS: usize = 1 << 14;

/// A file whose rows are read piece by piece.
struct Rows {
    path: PathBuf,
    kind: Kind,
    /// The columns, without their values.
    head: Table,
}

/// Callback that takes rows, and the first cell of each column that is no number.
type Take<'a> = dyn FnMut(Piece, &[Option<Fault>]) -> Result<(), TraceError> + 'a;

impl Rows {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// When it cannot be read, has no header, or is of a form that cannot be read row by row.
    fn open(path: &Path) -> Result<Self, TraceError> {
        let file = path.display().to_string();
        let (kind, mut open) = Kind::open(path)?;
        let headers = match kind {
            Kind::Parquet => parquet::Source::open(open, &file)?.headers,
            Kind::Csv => {
                let failed = |reason| TraceError::Read { path: path.to_owned(), reason };
                let mut bytes = Vec::new();
                open.rewind().and_then(|()| open.take(BLOCK as u64).read_to_end(&mut bytes)).map_err(failed)?;
                if !matches!(forms::of(&bytes, &file)?, Form::Plain) {
                    let what = "text that has to be brought to CSV first (UTF-16, one byte a letter, JSON, columns set apart by \
                                blanks, a controller's own log) is not streamed; leave --stream out, or write it as CSV in UTF-8";
                    return Err(TraceError::Format { file, what: what.to_owned() });
                }
                csv::Head::find(csv::unmarked(&bytes), &file)?.headers
            }
            Kind::Mat | Kind::Hdf5 | Kind::Packed => {
                return Err(TraceError::Format {
                    file,
                    what: "a file of this form is not streamed; leave --stream out (it is at most 2 GiB), or write it as Parquet \
                           or CSV"
                        .to_owned(),
                });
            }
        };
        let columns = vec![Vec::new(); headers.len()];
        let faults = vec![None; headers.len()];
        Ok(Self {
            path: path.to_owned(),
            kind,
            head: Table { file, headers, columns, faults, lines: Vec::new(), bridge_warnings: Vec::new(), cut: None },
        })
    }

    /// Passes the columns of the indices `wanted` to `take`, from the first row to the last, with missing cells interpolated. Gives the
    /// warnings.
    ///
    /// # Errors
    /// When the file cannot be read or a missing cell is not interpolated; the error of `take`.
    fn each(
        &self,
        wanted: &[usize],
        take: &mut dyn FnMut(&Piece) -> Result<(), TraceError>,
    ) -> Result<Vec<String>, TraceError> {
        let file = &self.head.file;
        let name = |k: usize| self.head.headers[wanted[k]].name.clone();
        let mut bridges = Bridges::new(wanted.len());
        let mut bridged = |piece: Piece, faults: &[Option<Fault>]| {
            let passed = bridges.take(piece, faults).map_err(|(k, fault)| fault.named(file, &name(k)))?;
            passed.map_or(Ok(()), |piece| take(&piece))
        };
        let mut notes = Vec::new();
        match self.kind {
            Kind::Csv => notes.extend(self.each_block(wanted, &mut bridged)?),
            _ => {
                let failed = |reason| TraceError::Read { path: self.path.clone(), reason };
                let source = parquet::Source::open(File::open(&self.path).map_err(failed)?, file)?;
                source.batches(wanted, |first, columns, faults| {
                    bridged(Piece { first, columns, lines: Vec::new() }, faults)
                })?;
            }
        }
        notes.extend(bridges.ended(file, name)?);
        Ok(notes)
    }

    /// The same for a CSV file, [`BLOCK`] bytes at a time, without interpolation. Gives the warning of a last row that is cut off.
    ///
    /// # Errors
    /// When the file cannot be read, a line is longer than a block, or a row has another number of fields; the error of `take`.
    fn each_block(&self, wanted: &[usize], take: &mut Take<'_>) -> Result<Option<String>, TraceError> {
        let failed = |reason| TraceError::Read { path: self.path.clone(), reason };
        let name = &self.head.file;
        let mut file = File::open(&self.path).map_err(failed)?;
        let size = file.metadata().map_err(failed)?.len();
        let mut bytes = Vec::with_capacity(BLOCK);
        (&mut file).take(BLOCK as u64).read_to_end(&mut bytes).map_err(failed)?;
        let start = bytes.len() - csv::unmarked(&bytes).len();
        let head = csv::Head::find(&bytes[start..], name)?;
        let format = csv::Format::of(&head, &bytes[start + head.body..]);
        bytes.drain(..start + head.body);
        let (mut row, mut line) = (0, head.lines + 1);
        loop {
            let before = bytes.len();
            (&mut file).take(BLOCK.saturating_sub(before) as u64).read_to_end(&mut bytes).map_err(failed)?;
            let ended = bytes.len() < BLOCK || file.stream_position().map_err(failed)? >= size;
            let (mut end, mut cut) = (bytes.len(), None);
            if ended {
                (end, cut) = csv::cut::whole(&bytes, &format, row == 0);
            }
            let end = match memrchr(b'\n', &bytes) {
                _ if ended => end,
                Some(at) => at + 1,
                None => {
                    let what = format!("line {line} is longer than {BLOCK} bytes: this is no table of numbers");
                    return Err(TraceError::Format { file: name.clone(), what });
                }
            };
            let rows = csv::rows(&bytes[..end], &format, row, line).map_err(|r| r.named(name, &format))?;
            let count = rows.columns.first().map_or(0, Vec::len);
            let mut columns = Vec::with_capacity(wanted.len());
            let mut all: Vec<Option<Vec<f64>>> = rows.columns.into_iter().map(Some).collect();
            for (k, &column) in wanted.iter().enumerate() {
                // The same column may serve two signals.
                let earlier = wanted[..k].iter().position(|c| *c == column);
                let values = earlier.map_or_else(|| all[column].take(), |at: usize| columns.get(at).cloned());
                columns.push(values.unwrap_or_default());
            }
            if count > 0 {
                let faults: Vec<Option<Fault>> = wanted.iter().map(|c| rows.faults[*c].clone()).collect();
                take(Piece { first: row, columns, lines: rows.lines }, &faults)?;
            }
            row += count;
            line += rows.passed;
            bytes.drain(..end);
            if ended {
                return Ok(cut.map(|text| csv::cut::cut_warning(name, line, &text)));
            }
        }
    }
}

/// Where a signal is in the file: `scale*column + offset` is its value in SI units.
#[derive(Debug, Clone, Copy)]
struct Source {
    column: usize,
    scale: f64,
    offset: f64,
}

/// A trace that is read piece by piece.
pub struct Stream {
    rows: Rows,
    time: Option<Source>,
    signals: Vec<(Signal, Source)>,
    /// A record without samples: start, interval and hold.
    empty: Trace,
    /// Largest distance of a time stamp from the grid, s.
    tolerance: f64,
    length: usize,
    /// Warnings for the user: each is a sentence that says what to do.
    pub warnings: Vec<String>,
    /// As in [`super::Loaded`].
    pub drive: Option<String>,
}

impl Stream {
    /// Opens a trace, and reads its time stamps once.
    ///
    /// # Errors
    /// As [`super::load()`]; and where the file cannot be read row by row, or its time stamps would have to be resampled.
    pub fn open(path: &Path, mapping: &Mapping) -> Result<Self, TraceError> {
        let rows = Rows::open(path)?;
        let mut warnings = Vec::new();
        let mut signals = Vec::new();
        let mut drive = None;
        for (signal, column) in wanted(&rows.head, mapping, &mut warnings)? {
            let (index, scale) = scale(&rows.head, &column, signal.name(), signal.quantity(mapping.motion))?;
            drive = drive.or_else(|| in_drive_units(&rows.head, &column, signal));
            warnings.extend(no_torque_constant(&rows.head, &column, signal, mapping.motion));
            signals.push((signal, Source { column: index, scale, offset: column.offset }));
        }
        if signals.is_empty() {
            return Err(no_signal(&rows.head));
        }
        let time = match time_column(&rows.head, mapping)? {
            None => None,
            Some(column) => {
                let (index, scale) = scale(&rows.head, &column, "time", Quantity::Time)?;
                Some(Source { column: index, scale, offset: column.offset })
            }
        };
        let mut clock = Clock::new(rows.head.file.clone());
        // Every column in use is read once here, so that its warnings are given before the work.
        let columns: Vec<usize> = time.iter().chain(signals.iter().map(|(_, s)| s)).map(|s| s.column).collect();
        let notes = rows.each(&columns, &mut |piece| match time {
            Some(t) => clock.take(&scaled(&piece.columns[0], t.scale, t.offset), piece),
            None => {
                clock.count += piece.columns[0].len();
                Ok(())
            }
        })?;
        warnings.extend(notes);
        clock.finish()?;
        if clock.count < SHORTEST {
            return Err(TraceError::TooShort { file: rows.head.file, found: clock.count, needed: SHORTEST });
        }
        let (start, dt) = match (time, mapping.dt) {
            (Some(_), _) => (clock.first, (clock.last - clock.first) / (clock.count - 1) as f64),
            (None, dt) => (0.0, dt.unwrap_or(1.0)),
        };
        let tolerance = (Sampling::UNIFORM * dt).max(clock.decimals.rounding());
        Ok(Self {
            rows,
            time,
            signals,
            empty: Trace::new(start, dt, mapping.hold.unwrap_or_default()),
            tolerance,
            length: clock.count,
            warnings,
            drive,
        })
    }

    /// Samples of the record.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.length
    }

    /// Whether there is no sample.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// The record without its samples: start, interval, hold.
    #[must_use]
    pub const fn frame(&self) -> &Trace {
        &self.empty
    }

    /// The signals of the record.
    pub fn signals(&self) -> impl Iterator<Item = Signal> + '_ {
        self.signals.iter().map(|(s, _)| *s)
    }

    /// The first `most` samples of the record, or all of a shorter one.
    ///
    /// # Errors
    /// As [`Self::each`].
    pub fn head(&self, most: usize) -> Result<Trace, TraceError> {
        let mut head: Option<Trace> = None;
        let mut whole = false;
        let read = self.each(|_, piece| {
            head = Some(match head.take() {
                None => piece,
                Some(mut all) => {
                    for signal in Signal::ALL {
                        if let (Some(mut values), Some(more)) = (all.remove(signal), piece.get(signal)) {
                            values.extend_from_slice(more);
                            all.put(signal, values);
                        }
                    }
                    all
                }
            });
            whole = head.as_ref().is_some_and(|h| h.len() >= most);
            // What follows is not read: the error ends the pass and goes no further.
            if whole { Err(TraceError::Length { signal: "", found: 0, expected: 0 }) } else { Ok(()) }
        });
        match (head, read) {
            (Some(head), Ok(())) => Ok(head),
            (Some(head), Err(_)) if whole => Ok(head.slice(0..most.min(head.len()))),
            (_, Err(error)) => Err(error),
            (None, Ok(())) => Ok(self.empty.clone()),
        }
    }

    /// Passes the record to `take(first, samples)` piece by piece, in SI units; `first` is the index of the piece's first sample.
    ///
    /// # Errors
    /// [`TraceError`], naming file, row and column; the error of `take`.
    pub fn each(&self, mut take: impl FnMut(usize, Trace) -> Result<(), TraceError>) -> Result<(), TraceError> {
        let columns: Vec<usize> =
            self.time.iter().chain(self.signals.iter().map(|(_, s)| s)).map(|s| s.column).collect();
        let file = &self.rows.head.file;
        self.rows.each(&columns, &mut |piece| {
            let mut own = piece.columns.as_slice();
            if let Some(t) = self.time {
                for (k, stamp) in scaled(&own[0], t.scale, t.offset).into_iter().enumerate() {
                    let off = (stamp - self.empty.time(piece.first + k)).abs();
                    if off > self.tolerance {
                        return Err(TraceError::Format {
                            file: file.clone(),
                            what: format!(
                                "row {}: the time stamp is {:.1} % of a sample off uniform sampling at dt = {:.9e} s, and a \
                                 streamed trace is not resampled; give dt in [signals] and name no time column there, or \
                                 cut the record into parts",
                                piece.line(piece.first + k),
                                100.0 * off / self.empty.dt,
                                self.empty.dt
                            ),
                        });
                    }
                }
                own = &own[1..];
            }
            let mut trace = Trace::new(self.empty.time(piece.first), self.empty.dt, self.empty.hold);
            for ((signal, source), values) in self.signals.iter().zip(own) {
                trace.set(*signal, scaled(values, source.scale, source.offset))?;
            }
            take(piece.first, trace)
        })?;
        Ok(())
    }
}

/// What one pass over the time stamps finds, s.
struct Clock {
    file: String,
    count: usize,
    first: f64,
    last: f64,
    decimals: Decimals,
    /// The first steps, each with the line of its second stamp, until there are [`STEPS`] of them.
    early: Vec<(f64, usize)>,
    /// The median of those.
    usual: Option<f64>,
}

impl Clock {
    fn new(file: String) -> Self {
        Self { file, count: 0, first: 0.0, last: 0.0, decimals: Decimals::default(), early: Vec::new(), usual: None }
    }

    /// Takes the stamps of a piece, s, one a row.
    ///
    /// # Errors
    /// When they do not increase, or leave a gap.
    fn take(&mut self, stamps: &[f64], piece: &Piece) -> Result<(), TraceError> {
        for (k, &stamp) in stamps.iter().enumerate() {
            self.decimals.take(stamp);
            if self.count == 0 {
                self.first = stamp;
            } else {
                let step = stamp - self.last;
                let line = piece.line(piece.first + k);
                if step <= 0.0 {
                    let (file, before) = (self.file.clone(), self.last);
                    return Err(TraceError::NotIncreasing { file, line, before, after: stamp });
                }
                match self.usual {
                    Some(usual) => self.gap(step, line, usual)?,
                    None => {
                        self.early.push((step, line));
                        if self.early.len() == STEPS {
                            self.finish()?;
                        }
                    }
                }
            }
            self.last = stamp;
            self.count += 1;
        }
        Ok(())
    }

    fn gap(&self, gap: f64, line: usize, dt: f64) -> Result<(), TraceError> {
        if gap <= 1.5 * dt {
            return Ok(());
        }
        let missing = ((gap / dt).round() as usize).saturating_sub(1).max(1);
        Err(TraceError::Gap { file: self.file.clone(), line, gap, missing, dt })
    }

    /// Sets the usual step to the median of the early ones, and checks these for gaps.
    ///
    /// # Errors
    /// [`TraceError::Gap`].
    fn finish(&mut self) -> Result<(), TraceError> {
        if self.usual.is_some() || self.early.is_empty() {
            return Ok(());
        }
        let mut steps: Vec<f64> = self.early.iter().map(|(step, _)| *step).collect();
        let middle = steps.len() / 2;
        let (_, &mut usual, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
        self.usual = Some(usual);
        for (step, line) in std::mem::take(&mut self.early) {
            self.gap(step, line, usual)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::load;
    use super::*;

    /// Enough rows for several blocks; comments and blank lines among them.
    fn long(path: &Path) -> usize {
        use std::fmt::Write;
        let mut text = String::from("time [ms],note,T [mN.m],theta1 [deg]\n");
        let rows = 700_000;
        for k in 0..rows {
            if k % 5000 == 9 {
                text.push_str("# a comment\n\n");
            }
            writeln!(text, "{},x,{},{}.25", 0.5 * f64::from(k), k % 977, k % 1013).unwrap();
        }
        assert!(text.len() > 5 * BLOCK / 4);
        std::fs::write(path, text).unwrap();
        rows as usize
    }

    #[test]
    fn a_streamed_file_holds_the_numbers_of_the_whole_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.csv");
        let rows = long(&path);
        let whole = load(&path, &Mapping::default()).unwrap().trace;
        let stream = Stream::open(&path, &Mapping::default()).unwrap();
        assert_eq!((stream.len(), stream.frame().start, stream.frame().dt), (rows, whole.start, whole.dt));
        let mut seen = 0;
        let mut pieces = 0;
        stream
            .each(|first, piece| {
                assert_eq!(first, seen);
                for signal in [Signal::T, Signal::Theta1] {
                    let expected = &whole.get(signal).unwrap()[first..first + piece.len()];
                    assert_eq!(piece.get(signal).unwrap(), expected);
                }
                seen += piece.len();
                pieces += 1;
                Ok(())
            })
            .unwrap();
        assert_eq!(seen, rows);
        assert!(pieces > 1);
    }

    #[test]
    fn a_fault_far_down_is_named_by_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.csv");
        long(&path);
        let text = std::fs::read_to_string(&path).unwrap();
        let at = text.lines().position(|l| l.starts_with("300000,")).unwrap();
        let replaced = |with: &str| {
            let lines: Vec<&str> = text.lines().enumerate().map(|(k, l)| if k == at { with } else { l }).collect();
            std::fs::write(&path, lines.join("\n")).unwrap();
            match Stream::open(&path, &Mapping::default()) {
                Ok(stream) => stream.each(|_, _| Ok(())).unwrap_err().to_string(),
                Err(error) => error.to_string(),
            }
        };
        let line = format!("row {}", at + 1);
        let error = replaced("300000,x,overrun,1.25");
        assert!(error.contains(&format!("{line}, column T")), "{error}");
        let error = replaced("300000,x,1");
        assert!(error.contains(&line) && error.contains("3 fields"), "{error}");
        let error = replaced("300000.2,x,1,1.25");
        assert!(error.contains(&line) && error.contains("not resampled"), "{error}");
        let error = replaced("299000,x,1,1.25");
        assert!(error.contains(&line) && error.contains("must increase"), "{error}");
        let error = replaced("# nothing");
        assert!(error.contains(&format!("row {}", at + 2)) && error.contains("gap"), "{error}");
    }

    #[test]
    fn missing_cells_are_bridged_across_the_ends_of_blocks_as_in_the_whole_file_and_said_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.csv");
        long(&path);
        let text = std::fs::read_to_string(&path).unwrap();
        // Where the second block begins: rows on either side of it lose their torque, one its angle and one its stamp.
        let body = text.find('\n').unwrap() + 1;
        let border = text[..body + BLOCK].matches('\n').count();
        let row = |k: usize, line: &str| -> String {
            let fields: Vec<&str> = line.split(',').collect();
            match (k + 3).checked_sub(border) {
                Some(2..=4) => format!("{},x,,{}", fields[0], fields[3]),
                Some(5) => format!("{},x,{},nan", fields[0], fields[2]),
                Some(9) => format!("-,x,{},{}", fields[2], fields[3]),
                _ => line.to_owned(),
            }
        };
        let mut lines: Vec<String> = text.lines().enumerate().map(|(k, line)| row(k, line)).collect();
        lines.push("350000,x,1".to_owned());
        std::fs::write(&path, lines.join("\n")).unwrap();
        let whole = load(&path, &Mapping::default()).unwrap();
        let stream = Stream::open(&path, &Mapping::default()).unwrap();
        for expected in [
            "column time has no number in 1 of",
            "column T has no number in 3 of",
            "column theta1 has no",
            "is cut off",
        ] {
            for notes in [&whole.warnings, &stream.warnings] {
                assert_eq!(notes.iter().filter(|w| w.contains(expected)).count(), 1, "{expected}: {notes:?}");
            }
        }
        let mut seen = 0;
        stream
            .each(|first, piece| {
                assert_eq!(first, seen);
                for signal in [Signal::T, Signal::Theta1] {
                    assert_eq!(
                        piece.get(signal).unwrap(),
                        &whole.trace.get(signal).unwrap()[first..first + piece.len()]
                    );
                }
                seen += piece.len();
                Ok(())
            })
            .unwrap();
        assert_eq!(seen, whole.trace.len());
        // Four in a row, a text, the first cell: no line is drawn across them, and the stream says what the whole file says.
        for (at, count, cell) in [(4000, 4, ""), (4000, 1, "overflow"), (1, 1, "")] {
            let mut broken: Vec<String> = text.lines().map(str::to_owned).collect();
            for line in &mut broken[at..at + count] {
                let fields: Vec<&str> = line.split(',').collect();
                *line = format!("{},x,{cell},{}", fields[0], fields[3]);
            }
            std::fs::write(&path, broken.join("\n")).unwrap();
            let whole = load(&path, &Mapping::default()).unwrap_err().to_string();
            assert!(whole.contains(&format!("row {}, column T", at + 1)), "{whole}");
            assert_eq!(Stream::open(&path, &Mapping::default()).err().unwrap().to_string(), whole);
        }
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn nulls_of_a_parquet_file_are_bridged_and_numbers_without_bound_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.parquet");
        let time: Vec<f64> = (0..1000).map(|k| 1e-3 * f64::from(k)).collect();
        let with =
            |value: f64| -> Vec<f64> { (0..1000).map(|k| if k == 500 { value } else { f64::from(k) }).collect() };
        let opened = |value: f64| {
            std::fs::write(&path, parquet::pack(&[("time", &time), ("T", &with(value))], &path).unwrap()).unwrap();
            Stream::open(&path, &Mapping::default())
        };
        let stream = opened(f64::NAN).unwrap();
        assert!(stream.warnings.iter().any(|w| w.contains("column T has no number in 1 of 1000 rows")));
        let read = stream.head(1000).unwrap();
        assert_eq!(read.get(Signal::T).unwrap(), with(500.0));
        let error = opened(f64::INFINITY).err().unwrap().to_string();
        assert!(error.contains("row 501, column T: \"inf\""), "{error}");
    }
}
