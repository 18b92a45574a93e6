//! HDF5: MATLAB 7.3 files (`save -v7.3`), and plain files of data sets such as Python writes.
//!
//! The columns are those of [`super::mat`]: a vector by its name, a matrix split along its shorter side, the fields of a
//! structure (the members of a group) by their own names where these are unique. MATLAB stores an array with its sizes
//! turned round and marks it with the attribute `MATLAB_class`; text, cells, sparse matrices and objects are passed over.
//!
//! How much a file may ask for is bounded here: before data are read, what they unfold to is held against the size of the file
//! and [`MAX_CELLS`], and the objects that are looked at are counted, since links can form a ring.

use hdf5_pure::{AttrValue, DType, Dataset, File, Group};

use super::caught::caught;
use super::error::TraceError;
use super::mat::{self, DEEPEST, Order, Vector};
use super::table::{MAX_CELLS, Table};

/// Most objects that are looked at.
const MAX_OBJECTS: usize = 1 << 14;
/// MATLAB's classes of numbers.
const NUMERIC: [&str; 11] =
    ["double", "single", "logical", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"];
/// What a byte can unfold to at most: deflate's limit, and a third of it again for what stands around.
const DENSEST: u64 = 1400;

/// The table in the bytes of a file. `file` names it in messages.
///
/// # Errors
/// When the file is damaged, or holds no vector of numbers that can be read.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let failed = |what: String| TraceError::Format {
        file: file.to_owned(),
        what: format!(
            "the HDF5 (MATLAB 7.3) file cannot be read: {what}. Save it in MATLAB with -v7, or as CSV or Parquet"
        ),
    };
    mat::table(caught(|| vectors(bytes)).map_err(failed)?, file)
}

fn vectors(bytes: &[u8]) -> Result<Vec<Vector>, String> {
    let open = File::from_bytes(bytes.to_vec()).map_err(|e| plain(&e))?;
    let mut reader = Reader { size: bytes.len() as u64, cells: 0, objects: 0, vectors: Vec::new() };
    reader.group(&open.root(), &mut Vec::new())?;
    Ok(reader.vectors)
}

/// The crate's error without the part that repeats the message around it.
fn plain(error: &hdf5_pure::Error) -> String {
    let text = error.to_string();
    text.strip_prefix("HDF5 format error: ").map_or_else(|| text.clone(), str::to_owned)
}

struct Reader {
    /// Bytes of the file.
    size: u64,
    cells: usize,
    objects: usize,
    vectors: Vec<Vector>,
}

impl Reader {
    /// The vectors of a group and of the groups in it.
    fn group(&mut self, group: &Group, path: &mut Vec<String>) -> Result<(), String> {
        let within = |e: hdf5_pure::Error, path: &[String]| format!("group /{}: {}", path.join("/"), plain(&e));
        let sets = group.datasets().map_err(|e| within(e, path))?;
        let groups = group.groups().map_err(|e| within(e, path))?;
        self.objects += sets.len() + groups.len();
        if self.objects > MAX_OBJECTS {
            return Err(format!("it holds more than {MAX_OBJECTS} data sets and groups"));
        }
        for name in sets {
            path.push(name);
            self.set(group, path).map_err(|e| format!("data set /{}: {e}", path.join("/")))?;
            path.pop();
        }
        for name in groups {
            // What MATLAB keeps cells and objects in.
            if name.starts_with('#') || path.len() > DEEPEST {
                continue;
            }
            let inner = group.group(&name).map_err(|e| within(e, path))?;
            path.push(name);
            if !inner.attrs().map_err(|e| within(e, path))?.contains_key("MATLAB_sparse") {
                self.group(&inner, path)?;
            }
            path.pop();
        }
        Ok(())
    }

    /// The vectors of the data set that the path ends with; none where it holds no numbers.
    fn set(&mut self, group: &Group, path: &[String]) -> Result<(), String> {
        let Some(name) = path.last() else { return Ok(()) };
        let set = group.dataset(name).map_err(|e| plain(&e))?;
        let kind = set.dtype().map_err(|e| plain(&e))?;
        let complex = complex(&kind);
        if !complex && !number(&kind) {
            return Ok(());
        }
        let attributes = set.attrs().map_err(|e| plain(&e))?;
        let class = attributes.get("MATLAB_class").and_then(text);
        if class.is_some_and(|c| !NUMERIC.contains(&c)) || attributes.contains_key("MATLAB_empty") {
            return Ok(());
        }
        let shape = set.shape().map_err(|e| plain(&e))?;
        // The last size runs fastest: MATLAB's first.
        let (m, n) = match shape[..] {
            [n] => (n, 1),
            [n, m] => (m, n),
            _ => return Ok(()),
        };
        let count = self.count(&set, m, n)?;
        if count < 2 {
            return Ok(());
        }
        let values = if complex { vec![0.0; count] } else { set.read_f64().map_err(|e| plain(&e))? };
        if values.len() != count {
            return Err(format!("{} numbers where {m} x {n} are announced", values.len()));
        }
        self.cells += count;
        let order = if class.is_some() || shape.len() == 1 { Order::Columns } else { Order::Rows };
        let sizes = (usize::try_from(m).unwrap_or(count), usize::try_from(n).unwrap_or(count));
        self.vectors.extend(Vector::split(path, values, sizes, complex, order));
        Ok(())
    }

    /// Numbers of an m x n data set, where they and its chunks are no more than may be unfolded.
    fn count(&self, set: &Dataset, m: u64, n: u64) -> Result<usize, String> {
        let most = self.size.saturating_mul(DENSEST);
        let width = set.element_size().map_err(|e| plain(&e))?;
        let bytes = |sizes: &[u64]| sizes.iter().try_fold(width, |all, size| all.checked_mul(*size));
        let chunk = set.chunk_shape().map_err(|e| plain(&e))?.unwrap_or_default();
        if bytes(&[m, n]).is_none_or(|all| all > most) || bytes(&chunk).is_none_or(|all| all > most) {
            return Err("it announces more numbers than the file can hold".to_owned());
        }
        m.checked_mul(n)
            .and_then(|count| usize::try_from(count).ok())
            .filter(|count| count.checked_add(self.cells).is_some_and(|all| all <= MAX_CELLS))
            .ok_or_else(|| format!("with it the file holds more than {MAX_CELLS} numbers"))
    }
}

/// Whether a type is a number that MATLAB has too.
fn number(kind: &DType) -> bool {
    use DType::{F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
    matches!(kind, F32 | F64 | I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64)
}

/// Whether a type is a complex number as MATLAB and Python store it.
fn complex(kind: &DType) -> bool {
    let DType::Compound(fields) = kind else { return false };
    matches!(&fields[..], [(re, a), (im, b)]
        if matches!((&re[..], &im[..]), ("real", "imag") | ("r", "i")) && number(a) && number(b))
}

/// The text of an attribute.
fn text(value: &AttrValue) -> Option<&str> {
    match value {
        AttrValue::String(text) | AttrValue::AsciiString(text) => Some(text),
        AttrValue::VarLenString(text) | AttrValue::VarLenAsciiString(text) => Some(text),
        _ => None,
    }
}
