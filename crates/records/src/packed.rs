//! NumPy archives (`.npz`) and Excel workbooks (`.xlsx`): archives of arrays and of sheets.
//!
//! Sources: numpy.lib.format (NEP 1) for the arrays; workbooks through the `calamine` crate.

use std::io::{Cursor, Read};

use calamine::{Data, Reader, Xlsx};

use super::error::TraceError;
use super::table::{Fault, Header, MAX_CELLS, MAX_COLUMNS, Table, header};

/// Most bytes that an archive may unfold to.
const UNFOLDED: u64 = 2 << 30;

/// What an archive holds, by the names of its entries.
///
/// # Errors
/// When the archive is damaged, unfolds to too much, or holds no table.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let wrong = |what: String| TraceError::Format { file: file.to_owned(), what };
    let damaged = |e: zip::result::ZipError| wrong(format!("a damaged archive ({e}); copy it again"));
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    let mut names = Vec::with_capacity(archive.len());
    let mut size = 0_u64;
    for k in 0..archive.len() {
        let entry = archive.by_index_raw(k).map_err(damaged)?;
        size = size.saturating_add(entry.size());
        names.push(entry.name().map_err(damaged)?.into_owned());
    }
    if size > UNFOLDED {
        return Err(wrong(format!("it unfolds to {size} bytes, more than {UNFOLDED}; write Parquet or CSV")));
    }
    if names.iter().any(|n| n == "[Content_Types].xml") {
        drop(archive);
        return sheet(bytes, file);
    }
    if !names.iter().any(|n| n.ends_with(".npy")) {
        let hint = if names.iter().any(|n| n == "modelDescription.xml") {
            "it is an FMU, not a trace"
        } else {
            "it holds no .npy"
        };
        return Err(wrong(format!("an archive that is neither .npz nor .xlsx: {hint}; give a trace")));
    }
    let mut table = Table {
        file: file.to_owned(),
        headers: Vec::new(),
        columns: Vec::new(),
        faults: Vec::new(),
        lines: Vec::new(),
        bridge_warnings: Vec::new(),
        cut: None,
    };
    for name in names.iter().filter(|n| n.ends_with(".npy")) {
        let mut array = Vec::new();
        // No more is read than the size that the archive declares, which may be wrong.
        let entry = archive.by_name(name).map_err(damaged)?;
        entry.take(UNFOLDED).read_to_end(&mut array).map_err(|e| wrong(format!("{name}: damaged ({e})")))?;
        add(&mut table, name.trim_end_matches(".npy"), &array).map_err(|what| wrong(format!("{name}: {what}")))?;
    }
    if table.headers.is_empty() {
        return Err(wrong("no array of it has one or two dimensions of numbers".to_owned()));
    }
    // Arrays shorter than the longest become columns that are an error when used.
    let rows = table.columns.iter().map(Vec::len).max().unwrap_or(0);
    for k in 0..table.columns.len() {
        let found = table.columns[k].len();
        if found < rows {
            table.columns[k].resize(rows, f64::NAN);
            table.faults[k] = Some(Fault { line: found + 1, text: format!("{found} values where others have {rows}") });
        }
    }
    Ok(table)
}

/// The columns of one array.
fn add(table: &mut Table, name: &str, bytes: &[u8]) -> Result<(), String> {
    let npy = Npy::of(bytes)?;
    let (rows, width) = match npy.shape[..] {
        [] | [0] | [1] => return Ok(()),
        [rows] => (rows, 1),
        [rows, width] if width > 0 => (rows, width),
        _ => return Ok(()),
    };
    let cells =
        rows.checked_mul(width).filter(|c| *c <= MAX_CELLS).ok_or("too many numbers; cut the record into parts")?;
    if table.headers.len() + width > MAX_COLUMNS {
        return Err(format!("more than {MAX_COLUMNS} columns"));
    }
    if npy.data.len() < cells * npy.size {
        return Err(format!("{} bytes of data, {} are needed: it is cut off", npy.data.len(), cells * npy.size));
    }
    for c in 0..width {
        let at = |r: usize| if npy.fortran { c * rows + r } else { r * width + c };
        let values: Vec<f64> = (0..rows).map(|r| npy.value(at(r))).collect();
        let fault = values.iter().position(|v| !v.is_finite());
        let of = header(name);
        let own = if width == 1 { of } else { Header { name: format!("{}(:,{})", of.name, c + 1), unit: of.unit } };
        table.headers.push(own);
        table.faults.push(fault.map(|r| Fault { line: r + 1, text: values[r].to_string() }));
        table.columns.push(values);
    }
    Ok(())
}

/// An array as numpy writes it.
struct Npy<'a> {
    kind: u8,
    big: bool,
    size: usize,
    fortran: bool,
    shape: Vec<usize>,
    data: &'a [u8],
}

impl<'a> Npy<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, String> {
        let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("no numpy array")?;
        let (length, from) = match rest {
            [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 4),
            [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 6),
            _ => return Err("a version of numpy's form that is not known".to_owned()),
        };
        let text = rest.get(from..from + length).ok_or("its header is cut off")?;
        let text = std::str::from_utf8(text).map_err(|_| "its header is no text")?;
        let value = |key: &str| -> Option<&str> {
            let at = text.find(&format!("'{key}'"))? + key.len() + 2;
            text[at..].trim_start().strip_prefix(':').map(str::trim_start)
        };
        let descr = value("descr")
            .and_then(|v| v.strip_prefix('\'')?.split('\'').next())
            .ok_or("an array of records or objects; save plain numbers")?;
        let fortran = value("fortran_order").is_some_and(|v| v.starts_with("True"));
        let shape = value("shape").and_then(|v| v.strip_prefix('(')?.split(')').next()).ok_or("no shape")?;
        let shape: Result<Vec<usize>, _> =
            shape.split(',').map(str::trim).filter(|s| !s.is_empty()).map(str::parse).collect();
        let shape = shape.map_err(|_| "its shape is no list of numbers")?;
        let order = descr.as_bytes().first().copied().unwrap_or_default();
        let kind = descr.as_bytes().get(1).copied().unwrap_or_default();
        let size: usize =
            descr.get(2..).and_then(|s| s.parse().ok()).ok_or_else(|| format!("its type {descr} is not read"))?;
        if !matches!((kind, size), (b'f', 4 | 8) | (b'i' | b'u', 1 | 2 | 4 | 8) | (b'b', 1)) {
            return Err(format!("its type {descr} is no plain number; save float64"));
        }
        Ok(Self { kind, big: order == b'>', size, fortran, shape, data: &rest[from + length..] })
    }

    fn value(&self, index: usize) -> f64 {
        let mut b = [0_u8; 8];
        let own = &self.data[index * self.size..(index + 1) * self.size];
        b[..self.size].copy_from_slice(own);
        if self.big {
            b[..self.size].reverse();
        }
        match (self.kind, self.size) {
            (b'f', 8) => f64::from_le_bytes(b),
            (b'f', _) => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            (b'i', size) => {
                let shift = 64 - 8 * size as u32;
                ((i64::from_le_bytes(b) << shift) >> shift) as f64
            }
            _ => u64::from_le_bytes(b) as f64,
        }
    }
}

/// The first sheet of a workbook that holds a table, as lines of text: what CSV understands of headers, units and lines above
/// them holds for it, too.
fn sheet(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let wrong = |what: String| TraceError::Format { file: file.to_owned(), what };
    let mut book: Xlsx<_> = Xlsx::new(Cursor::new(bytes))
        .map_err(|e| wrong(format!("a workbook that cannot be read ({e}); save it as CSV")))?;
    let mut refused = None;
    for name in book.sheet_names() {
        let range = book.worksheet_range(&name).map_err(|e| wrong(format!("sheet {name:?}: {e}; save it as CSV")))?;
        if range.is_empty() {
            continue;
        }
        if range.get_size().0.saturating_mul(range.get_size().1) > MAX_CELLS / 8 {
            return Err(wrong(format!("sheet {name:?}: too many cells; save it as CSV or Parquet")));
        }
        // Rows above the first used one count, so that messages name the row of the sheet.
        let mut text = "\n".repeat(range.start().map_or(0, |s| s.0 as usize));
        for row in range.rows() {
            let mut width = row.len();
            while width > 1
                && matches!(row[width - 1], Data::Empty)
                && range.rows().next().is_some_and(|r| r.len() > width)
            {
                width -= 1;
            }
            for (k, cell) in row.iter().enumerate() {
                if k > 0 {
                    text.push('\t');
                }
                match cell {
                    Data::Float(v) => text.push_str(&v.to_string()),
                    Data::Int(v) => text.push_str(&v.to_string()),
                    Data::Bool(v) => text.push(if *v { '1' } else { '0' }),
                    // Days as Excel counts them, brought to seconds.
                    Data::DateTime(v) => text.push_str(&(v.as_f64() * 86400.0).to_string()),
                    Data::Empty => {}
                    other => text.push_str(&other.to_string().replace(['\t', '\n', '\r', '"'], " ")),
                }
            }
            text.push('\n');
        }
        match super::csv::parse(text.as_bytes(), file) {
            Ok(table) if table.rows() > 0 => return Ok(table),
            Ok(_) => {}
            Err(e) => refused = refused.or(Some(e)),
        }
    }
    Err(refused.unwrap_or_else(|| wrong("no sheet of it holds a table".to_owned())))
}
