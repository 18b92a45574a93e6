//! Apache Parquet, read column by column through the `parquet` crate without Arrow.
//!
//! Columns of numbers become columns of a table: floats and integers as they are, decimals scaled, time stamps as seconds
//! since the first row's. Text, lists and the like are columns that are an error only when used; a null is a cell that is no
//! number. A unit stands in brackets behind the column's name, as in CSV.

use std::fs::File;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type as SchemaType};

use super::caught::caught;
use super::error::TraceError;
use super::table::{Fault, Header, MAX_CELLS, MAX_COLUMNS, Table, header};

/// Rows that are decoded at a time.
const BATCH: usize = 1 << 16;

/// What a column's numbers mean.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meaning {
    /// A number, over a power of ten (1 but for decimals): a division rounds once.
    Number(f64),
    /// An unsigned integer of 64 bits, stored in a signed one.
    Unsigned,
    /// A time stamp: so many of them a second.
    Stamp(f64),
    /// No number.
    Other,
}

impl Meaning {
    fn of(column: &ColumnDescriptor) -> Self {
        if column.max_rep_level() > 0 {
            return Self::Other;
        }
        let decimal = |scale: i32| Self::Number(10_f64.powi(scale.clamp(-300, 300)));
        match (column.physical_type(), column.logical_type_ref(), column.converted_type()) {
            (Type::INT64, Some(LogicalType::Timestamp(t)), _) => Self::Stamp(match t.unit {
                TimeUnit::MILLIS => 1e3,
                TimeUnit::MICROS => 1e6,
                TimeUnit::NANOS => 1e9,
            }),
            (Type::INT64, None, ConvertedType::TIMESTAMP_MILLIS) => Self::Stamp(1e3),
            (Type::INT64, None, ConvertedType::TIMESTAMP_MICROS) => Self::Stamp(1e6),
            (Type::INT64, Some(LogicalType::Integer(i)), _) if !i.is_signed => Self::Unsigned,
            (Type::INT64, None, ConvertedType::UINT_64) => Self::Unsigned,
            (Type::INT32 | Type::INT64, Some(LogicalType::Decimal(d)), _) => decimal(d.scale),
            (Type::INT32 | Type::INT64, None, ConvertedType::DECIMAL) => decimal(column.type_scale()),
            (Type::BOOLEAN | Type::INT32 | Type::INT64 | Type::FLOAT | Type::DOUBLE, ..) => Self::Number(1.0),
            _ => Self::Other,
        }
    }
}

/// An open file.
pub(super) struct Source {
    file: String,
    reader: SerializedFileReader<File>,
    /// One a column.
    pub headers: Vec<Header>,
    meanings: Vec<Meaning>,
    /// Rows, as the file says.
    pub rows: usize,
}

/// The numbers of one column of one batch.
struct Batch {
    values: Vec<f64>,
    /// The first number without bound, else the first null or NaN: its row in the batch and what stands there.
    fault: Option<(usize, String)>,
}

impl Source {
    /// Reads the file's description.
    ///
    /// # Errors
    /// When the file is no Parquet, has too many columns, or two of one name.
    pub fn open(open: File, file: &str) -> Result<Self, TraceError> {
        let reader = guarded(file, || SerializedFileReader::new(open))?;
        let described = reader.metadata().file_metadata();
        let columns = described.schema_descr().columns();
        if columns.len() > MAX_COLUMNS {
            let what = format!("{} columns; at most {MAX_COLUMNS} are read", columns.len());
            return Err(TraceError::NoTable { file: file.to_owned(), what });
        }
        let meanings: Vec<Meaning> = columns.iter().map(|c| Meaning::of(c)).collect();
        let mut headers: Vec<Header> = columns.iter().map(|c| header(&c.path().parts().join("."))).collect();
        for (k, (one, meaning)) in headers.iter_mut().zip(&meanings).enumerate() {
            if let (Meaning::Stamp(_), None) = (meaning, &one.unit) {
                one.unit = Some("s".to_owned());
            }
            let name = &columns[k].path().string();
            if let Some(other) = columns[..k].iter().position(|c| c.path().string() == *name) {
                return Err(TraceError::TwiceNamed {
                    file: file.to_owned(),
                    column: one.name.clone(),
                    first: other + 1,
                    second: k + 1,
                });
            }
        }
        let rows = usize::try_from(described.num_rows()).unwrap_or(usize::MAX);
        Ok(Self { file: file.to_owned(), reader, headers, meanings, rows })
    }

    /// Reads these columns from the first row to the last, some thousand rows at a time: `take(first row, columns, the first cell of each
    /// that is no finite number)`.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn batches(
        &self,
        wanted: &[usize],
        mut take: impl FnMut(usize, Vec<Vec<f64>>, &[Option<Fault>]) -> Result<(), TraceError>,
    ) -> Result<(), TraceError> {
        let damaged = |what: String| TraceError::Format { file: self.file.clone(), what };
        let mut row = 0;
        let mut origins: Vec<Option<i64>> = vec![None; wanted.len()];
        for group in 0..self.reader.num_row_groups() {
            let group = guarded(&self.file, || self.reader.get_row_group(group))?;
            let mut readers = Vec::with_capacity(wanted.len());
            for &column in wanted {
                readers.push(guarded(&self.file, || group.get_column_reader(column))?);
            }
            let mut left = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            while left > 0 {
                let mut columns = Vec::with_capacity(wanted.len());
                let mut faults = Vec::with_capacity(wanted.len());
                for ((&column, reader), origin) in wanted.iter().zip(&mut readers).zip(&mut origins) {
                    let count = left.min(BATCH);
                    let meaning = self.meanings[column];
                    let batch = guarded(&self.file, || batch(reader, meaning, origin, count))?;
                    if batch.values.len() != count {
                        let name = &self.headers[column].name;
                        return Err(damaged(format!(
                            "column {name}: {} rows where the file announces {count} from row {} on: it is damaged",
                            batch.values.len(),
                            row + 1
                        )));
                    }
                    faults.push(batch.fault.map(|(at, text)| Fault { line: row + at + 1, text }));
                    columns.push(batch.values);
                }
                take(row, columns, &faults)?;
                let count = left.min(BATCH);
                row += count;
                left -= count;
            }
        }
        if row == self.rows {
            Ok(())
        } else {
            Err(damaged(format!("{row} rows where the file announces {}: it is damaged", self.rows)))
        }
    }
}

/// The whole of a file.
///
/// # Errors
/// When it is damaged, or holds more numbers than are kept in memory.
pub(super) fn read(open: File, file: &str) -> Result<Table, TraceError> {
    let source = Source::open(open, file)?;
    let wanted: Vec<usize> = (0..source.headers.len()).filter(|c| source.meanings[*c] != Meaning::Other).collect();
    if source.rows.saturating_mul(wanted.len()) > MAX_CELLS {
        return Err(TraceError::Format {
            file: file.to_owned(),
            what: format!(
                "{} rows of {} columns are more than is kept in memory ({MAX_CELLS} numbers): write the columns in use to \
                 a file of their own, or `eixo identify --stream` it",
                source.rows,
                wanted.len()
            ),
        });
    }
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); source.headers.len()];
    let mut faults: Vec<Option<Fault>> = source
        .meanings
        .iter()
        .map(|m| (*m == Meaning::Other).then(|| Fault { line: 1, text: "text or a list".to_owned() }))
        .collect();
    source.batches(&wanted, |_, batch, found| {
        for ((&column, values), fault) in wanted.iter().zip(batch).zip(found) {
            columns[column].extend_from_slice(&values);
            if let Some(fault) = fault {
                fault.clone().into_first(&mut faults[column]);
            }
        }
        Ok(())
    })?;
    Ok(Table {
        file: file.to_owned(),
        headers: source.headers,
        columns,
        faults,
        lines: Vec::new(),
        bridge_warnings: Vec::new(),
        cut: None,
    })
}

/// Runs the library on a file that may be damaged in any way: an error or a panic of it is an error of the file.
fn guarded<T>(file: &str, run: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, TraceError> {
    caught(run).map_err(|reason| TraceError::Format {
        file: file.to_owned(),
        what: format!("the Parquet file cannot be read: {reason}. Write it again, or as CSV"),
    })
}

fn batch(
    reader: &mut ColumnReader,
    meaning: Meaning,
    origin: &mut Option<i64>,
    count: usize,
) -> Result<Batch, ParquetError> {
    let Meaning::Number(divisor) = meaning else {
        return match (reader, meaning) {
            (ColumnReader::Int64ColumnReader(r), Meaning::Unsigned) => {
                numbers(r, count, |v| (*v).cast_unsigned() as f64)
            }
            (ColumnReader::Int64ColumnReader(r), Meaning::Stamp(rate)) => {
                // Taken off as integers: nanoseconds since 1970 have more digits than a double.
                numbers(r, count, |v| v.wrapping_sub(*origin.get_or_insert(*v)) as f64 / rate)
            }
            _ => Err(ParquetError::General("a column of another type than the file announces".to_owned())),
        };
    };
    match reader {
        ColumnReader::BoolColumnReader(r) => numbers(r, count, |v| f64::from(u8::from(*v))),
        ColumnReader::Int32ColumnReader(r) => numbers(r, count, |v| f64::from(*v) / divisor),
        ColumnReader::Int64ColumnReader(r) => numbers(r, count, |v| *v as f64 / divisor),
        ColumnReader::FloatColumnReader(r) => numbers(r, count, |v| f64::from(*v)),
        ColumnReader::DoubleColumnReader(r) => numbers(r, count, |v| *v),
        _ => Err(ParquetError::General("a column of another type than the file announces".to_owned())),
    }
}

fn numbers<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    count: usize,
    mut number: impl FnMut(&T::T) -> f64,
) -> Result<Batch, ParquetError> {
    let (mut levels, mut present) = (Vec::new(), Vec::with_capacity(count));
    let (records, ..) = reader.read_records(count, Some(&mut levels), None, &mut present)?;
    let mut values = Vec::with_capacity(records);
    let mut null = None;
    if present.len() == records {
        values.extend(present.iter().map(&mut number));
    } else {
        // Nulls: a value stands where the level is the highest.
        let highest = levels.iter().copied().max().unwrap_or(0);
        let mut next = present.iter();
        for (row, level) in levels.iter().enumerate() {
            let value = if *level == highest && !present.is_empty() { next.next() } else { None };
            if value.is_none() && null.is_none() {
                null = Some((row, "null".to_owned()));
            }
            values.push(value.map_or(f64::NAN, &mut number));
        }
    }
    // An infinite number is reported before a missing one.
    let of = |bad: fn(&f64) -> bool| values.iter().position(bad).map(|row| (row, values[row].to_string()));
    let fault = of(|v| v.is_infinite()).or(null).or_else(|| of(|v| v.is_nan()));
    Ok(Batch { values, fault })
}
/// Columns of numbers as a file, one row group, shorter columns ending in nulls.
///
/// # Errors
/// When the columns cannot be written as Parquet.
pub(super) fn pack(columns: &[(&str, &[f64])], path: &std::path::Path) -> Result<Vec<u8>, TraceError> {
    let rows = columns.iter().map(|(_, v)| v.len()).max().unwrap_or(0);
    let made = || -> Result<Vec<u8>, ParquetError> {
        let mut fields = Vec::with_capacity(columns.len());
        for (name, _) in columns {
            let field = SchemaType::primitive_type_builder(name, Type::DOUBLE).with_repetition(Repetition::OPTIONAL);
            fields.push(Arc::new(field.build()?));
        }
        let schema = Arc::new(SchemaType::group_type_builder("trace").with_fields(fields).build()?);
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(format!("eixo {}", env!("CARGO_PKG_VERSION")))
            .build();
        let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        for (_, values) in columns {
            let Some(mut own) = group.next_column()? else { break };
            let levels: Vec<i16> = (0..rows).map(|k| i16::from(k < values.len())).collect();
            own.typed::<DoubleType>().write_batch(values, Some(&levels), None)?;
            own.close()?;
        }
        group.close()?;
        writer.into_inner()
    };
    made().map_err(|e| TraceError::Format {
        file: path.display().to_string(),
        what: format!("cannot make the Parquet file: {e}"),
    })
}
