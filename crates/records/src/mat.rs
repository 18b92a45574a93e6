//! MATLAB files of level 5 (versions 5 to 7.2, `save -v6` and `-v7`): the numeric vectors in them.
//!
//! A vector is a column by its variable's name, a matrix one column each `name(:,k)` along its shorter side; the fields of a
//! structure are columns by their own names where these are unique in the file, else `structure.field`. The length that most
//! of them have is the length of the table; one of another length is an error only when used. Scalars, text, cells, sparse
//! matrices and objects are passed over.
//!
//! Source: MAT-File Format (The MathWorks), chapter 1, "Level 5 MAT-File Format". The readers that are published stop at an
//! integer-valued vector that MATLAB stored in short integers, or at a structure, and unfold compressed data without a
//! limit; all that is needed of the format stands here.

use std::collections::BTreeMap;
use std::io::Read;

use super::error::TraceError;
use super::table::{Fault, Header, MAX_CELLS, MAX_COLUMNS, Table};

/// Deepest nesting of structures that is followed.
pub(super) const DEEPEST: usize = 16;
/// Most elements of a file.
const MAX_ELEMENTS: usize = 1 << 20;
/// Most columns a matrix is split into.
const MAX_SPLIT: usize = 64;

/// Types of data (table 1-3).
mod mi {
    pub const INT8: u32 = 1;
    pub const INT32: u32 = 5;
    pub const UINT32: u32 = 6;
    pub const MATRIX: u32 = 14;
    pub const COMPRESSED: u32 = 15;
    pub const UTF8: u32 = 16;
}

/// Classes of arrays (table 1-1, array types).
const STRUCTURE: u32 = 2;
const NUMERIC: std::ops::RangeInclusive<u32> = 6..=15;

/// A vector on the way to a column.
pub(super) struct Vector {
    /// The variable, and the fields below it.
    path: Vec<String>,
    values: Vec<f64>,
    complex: bool,
}

/// How the columns of a matrix are written where it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// MATLAB: the first index runs fastest.
    Columns,
    /// C: the last index runs fastest; the sizes are given turned round.
    #[cfg_attr(not(feature = "hdf5"), expect(dead_code, reason = "HDF5 alone has it"))]
    Rows,
}

impl Vector {
    /// The numbers of an m x n array, whose first index runs fastest, as one vector, or split along the shorter side.
    pub fn split(path: &[String], values: Vec<f64>, (m, n): (usize, usize), complex: bool, order: Order) -> Vec<Self> {
        let (rows, columns) = if m >= n { (m, n) } else { (n, m) };
        if columns == 1 {
            return vec![Self { path: path.to_vec(), values, complex }];
        }
        if !(1..=MAX_SPLIT).contains(&columns) {
            return Vec::new();
        }
        (0..columns)
            .map(|k| {
                let values: Vec<f64> = if m >= n {
                    values[k * rows..(k + 1) * rows].to_vec()
                } else {
                    values.iter().skip(k).step_by(m).copied().collect()
                };
                let mut path = path.to_vec();
                if let Some(own) = path.last_mut() {
                    let second = (m >= n) == (order == Order::Columns);
                    *own = if second { format!("{own}(:,{})", k + 1) } else { format!("{own}({},:)", k + 1) };
                }
                Self { path, values, complex }
            })
            .collect()
    }
}

/// The vectors of a file. `file` names it in messages.
///
/// # Errors
/// When the file is damaged or holds no vector of numbers.
pub(super) fn parse(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let damaged = |what: &str| TraceError::Format {
        file: file.to_owned(),
        what: format!("the MATLAB file cannot be read: {what}. Save it again (save -v7), or as CSV"),
    };
    let big = match bytes.get(126..128) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err(damaged("it has no header of level 5")),
    };
    let mut reader = Reader { big, vectors: Vec::new(), cells: 0, elements: 0 };
    reader.file(&bytes[128..]).map_err(|e| damaged(&e))?;
    table(reader.vectors, file)
}

/// The table of all vectors that are as long as most of them.
///
/// # Errors
/// When there is no vector of numbers, there are too many, or two have one name.
pub(super) fn table(vectors: Vec<Vector>, file: &str) -> Result<Table, TraceError> {
    // The most frequent length; of two, the longer.
    let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
    for vector in vectors.iter().filter(|v| v.values.len() > 1) {
        *lengths.entry(vector.values.len()).or_default() += 1;
    }
    let Some((rows, _)) = lengths.into_iter().max_by_key(|(length, count)| (*count, *length)) else {
        let what = "it holds no vector of numbers; save time, T, theta1 and so on as vectors of one length".to_owned();
        return Err(TraceError::NoTable { file: file.to_owned(), what });
    };
    let vectors: Vec<Vector> = vectors.into_iter().filter(|v| v.values.len() > 1).collect();
    if vectors.len() > MAX_COLUMNS {
        let what = format!("{} vectors; at most {MAX_COLUMNS} are read", vectors.len());
        return Err(TraceError::NoTable { file: file.to_owned(), what });
    }
    let mut uses: BTreeMap<&str, usize> = BTreeMap::new();
    for own in vectors.iter().filter_map(|v| v.path.last()) {
        *uses.entry(own).or_default() += 1;
    }
    let name = |v: &Vector| match v.path.last() {
        Some(own) if uses.get(own.as_str()) == Some(&1) => own.clone(),
        _ => v.path.join("."),
    };
    let headers: Vec<Header> = vectors.iter().map(|v| Header { name: name(v), unit: None }).collect();
    for (k, one) in headers.iter().enumerate() {
        if let Some(other) = headers[..k].iter().position(|h| h.name == one.name) {
            return Err(TraceError::TwiceNamed {
                file: file.to_owned(),
                column: one.name.clone(),
                first: other + 1,
                second: k + 1,
            });
        }
    }
    let fault = |v: &Vector| {
        if v.complex {
            return Some(Fault { line: 1, text: "a complex number".to_owned() });
        }
        if v.values.len() != rows {
            let text = format!("one of {} values, where the other vectors have {rows},", v.values.len());
            return Some(Fault { line: v.values.len().min(rows) + 1, text });
        }
        let row = v.values.iter().position(|v| !v.is_finite())?;
        Some(Fault { line: row + 1, text: v.values[row].to_string() })
    };
    let faults = vectors.iter().map(fault).collect();
    let columns = vectors
        .into_iter()
        .map(|mut v| {
            v.values.resize(rows, f64::NAN);
            v.values
        })
        .collect();
    Ok(Table {
        file: file.to_owned(),
        headers,
        columns,
        faults,
        lines: Vec::new(),
        bridge_warnings: Vec::new(),
        cut: None,
    })
}

struct Reader {
    big: bool,
    vectors: Vec<Vector>,
    cells: usize,
    elements: usize,
}

/// One element: its type, its data, and the bytes after it.
struct Element<'a> {
    kind: u32,
    data: &'a [u8],
    rest: &'a [u8],
}

const CUT_OFF: &str = "it is cut off";

impl Reader {
    fn u32(&self, bytes: &[u8]) -> Result<u32, String> {
        let four: [u8; 4] = bytes.get(..4).and_then(|b| b.try_into().ok()).ok_or(CUT_OFF)?;
        Ok(if self.big { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) })
    }

    /// The element at the start; `packed`: no padding behind it.
    fn element<'a>(&mut self, bytes: &'a [u8], padded: bool) -> Result<Element<'a>, String> {
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return Err(format!("it has more than {MAX_ELEMENTS} elements"));
        }
        let first = self.u32(bytes)?;
        let (short, kind) = (first >> 16, first & 0xffff);
        if short != 0 {
            // Small form: up to four bytes beside the tag.
            let data = bytes.get(4..4 + short as usize).filter(|_| short <= 4).ok_or(CUT_OFF)?;
            return Ok(Element { kind, data, rest: bytes.get(8..).ok_or(CUT_OFF)? });
        }
        let size = self.u32(&bytes[4..])? as usize;
        let data = bytes.get(8..).and_then(|b| b.get(..size)).ok_or(CUT_OFF)?;
        let step = if padded && kind != mi::COMPRESSED { size.next_multiple_of(8) } else { size };
        Ok(Element { kind, data, rest: bytes.get(8 + step..).unwrap_or_default() })
    }

    fn file(&mut self, mut bytes: &[u8]) -> Result<(), String> {
        while bytes.len() >= 8 {
            let element = self.element(bytes, true)?;
            bytes = element.rest;
            match element.kind {
                mi::MATRIX => self.matrix(element.data, &mut Vec::new(), None)?,
                mi::COMPRESSED => {
                    let unfolded = self.unfold(element.data)?;
                    let inner = self.element(&unfolded, true)?;
                    if inner.kind == mi::MATRIX {
                        self.matrix(inner.data, &mut Vec::new(), None)?;
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Decompresses one element; never more than it announces in its first bytes.
    fn unfold(&mut self, packed: &[u8]) -> Result<Vec<u8>, String> {
        let mut decoder = flate2::read::ZlibDecoder::new(packed);
        let mut out = vec![0; 8];
        decoder.read_exact(&mut out).map_err(|e| format!("its compressed data are damaged ({e})"))?;
        let size = self.u32(&out[4..])? as usize;
        if size > 8 * (MAX_CELLS - self.cells) {
            return Err(format!("it unfolds to more than {MAX_CELLS} numbers"));
        }
        decoder
            .take(size as u64)
            .read_to_end(&mut out)
            .map_err(|e| format!("its compressed data are damaged ({e})"))?;
        if out.len() == size + 8 { Ok(out) } else { Err(CUT_OFF.to_owned()) }
    }

    /// An array; a field of a structure has its name from there.
    fn matrix(&mut self, bytes: &[u8], path: &mut Vec<String>, field: Option<&str>) -> Result<(), String> {
        if bytes.is_empty() {
            return Ok(());
        }
        let flags = self.element(bytes, true)?;
        if flags.kind != mi::UINT32 {
            return Err("an array has no flags".to_owned());
        }
        let word = self.u32(flags.data)?;
        let (class, complex) = (word & 0xff, word & 0x0800 != 0);
        if class != STRUCTURE && !NUMERIC.contains(&class) {
            return Ok(());
        }
        let dimensions = self.element(flags.rest, true)?;
        // Some writers take the unsigned type.
        if !matches!(dimensions.kind, mi::INT32 | mi::UINT32) {
            return Err("an array has no dimensions".to_owned());
        }
        let mut sizes = Vec::new();
        for four in dimensions.data.chunks_exact(4).take(8) {
            sizes.push(self.u32(four)? as usize);
        }
        let name = self.element(dimensions.rest, true)?;
        if !matches!(name.kind, mi::INT8 | mi::UTF8) {
            return Err("an array has no name".to_owned());
        }
        path.push(field.map_or_else(|| String::from_utf8_lossy(name.data).into_owned(), str::to_owned));
        let done = if class == STRUCTURE {
            self.structure(name.rest, &sizes, path)
        } else {
            self.numeric(name.rest, &sizes, complex, path)
        };
        path.pop();
        done
    }

    fn structure(&mut self, bytes: &[u8], sizes: &[usize], path: &mut Vec<String>) -> Result<(), String> {
        // Arrays of structures have no columns of their own.
        if path.len() > DEEPEST || sizes.iter().any(|n| *n != 1) {
            return Ok(());
        }
        let length = self.element(bytes, true)?;
        let size = self.u32(length.data)? as usize;
        let names = self.element(length.rest, true)?;
        if size == 0 || names.kind != mi::INT8 {
            return Err(format!("the names of the fields of {} are missing", path.join(".")));
        }
        let mut rest = names.rest;
        for name in names.data.chunks(size) {
            let end = name.iter().position(|b| *b == 0).unwrap_or(name.len());
            let field = String::from_utf8_lossy(&name[..end]).into_owned();
            let element = self.element(rest, true)?;
            rest = element.rest;
            if element.kind == mi::MATRIX {
                self.matrix(element.data, path, Some(&field))?;
            }
        }
        Ok(())
    }

    fn numeric(&mut self, bytes: &[u8], sizes: &[usize], complex: bool, path: &[String]) -> Result<(), String> {
        let &[m, n] = sizes else { return Ok(()) };
        let element = self.element(bytes, true)?;
        let values =
            self.numbers(element.kind, element.data).map_err(|e| format!("variable {}: {e}", path.join(".")))?;
        if m.checked_mul(n) != Some(values.len()) {
            return Err(format!("variable {}: {} numbers where {m} x {n} are announced", path.join("."), values.len()));
        }
        self.cells += values.len();
        if self.cells > MAX_CELLS {
            return Err(format!("it holds more than {MAX_CELLS} numbers"));
        }
        self.vectors.extend(Vector::split(path, values, (m, n), complex, Order::Columns));
        Ok(())
    }

    /// Numbers as they are stored: MATLAB writes whole numbers in the shortest type that holds them.
    fn numbers(&self, kind: u32, data: &[u8]) -> Result<Vec<f64>, String> {
        macro_rules! of {
            ($type:ty, $f64:expr) => {{
                const SIZE: usize = size_of::<$type>();
                if !data.chunks_exact(SIZE).remainder().is_empty() {
                    return Err(CUT_OFF.to_owned());
                }
                let number = |bytes: &[u8]| {
                    let mut own = [0; SIZE];
                    own.copy_from_slice(bytes);
                    $f64(if self.big { <$type>::from_be_bytes(own) } else { <$type>::from_le_bytes(own) })
                };
                Ok(data.chunks_exact(SIZE).map(number).collect())
            }};
        }
        match kind {
            mi::INT8 => of!(i8, f64::from),
            2 => of!(u8, f64::from),
            3 => of!(i16, f64::from),
            4 => of!(u16, f64::from),
            mi::INT32 => of!(i32, f64::from),
            mi::UINT32 => of!(u32, f64::from),
            7 => of!(f32, f64::from),
            9 => of!(f64, |v| v),
            12 => of!(i64, |v| v as f64),
            13 => of!(u64, |v| v as f64),
            _ => Err(format!("numbers of the unknown type {kind}")),
        }
    }
}
