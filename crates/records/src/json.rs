//! JSON: a line an object (JSON Lines, jsonlines.org), an array of objects, or an object of arrays.

use serde_json::Value;

use super::csv::cut::{cut_warning, excerpt};
use super::error::TraceError;
use super::forms::Filled;
use super::table::Table;

/// JSON Lines, an array of objects, or an object of arrays.
///
/// # Errors
/// When the text is no JSON, or holds no table.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let wrong = |what: String| TraceError::Format { file: file.to_owned(), what };
    let mut filled = Filled::default();
    let mut cut = None;
    let row = |filled: &mut Filled, value: &Value, line: usize| -> Result<(), TraceError> {
        let Value::Object(object) = value else {
            return Err(wrong(format!("row {line}: not an object such as {{\"time\": 0.0, \"T\": 0.1}}")));
        };
        for (name, value) in object {
            cell(filled, name, value, line, file)?;
        }
        filled.end(line);
        Ok(())
    };
    let mut whole = serde_json::from_slice::<Value>(bytes);
    let mut begun = None;
    if whole.as_ref().is_err_and(serde_json::Error::is_eof)
        && let Some((closed, rest)) = closed(bytes)
    {
        whole = serde_json::from_slice(&closed);
        begun = rest;
    }
    match whole {
        Ok(Value::Array(rows)) => {
            for (k, value) in rows.iter().enumerate() {
                row(&mut filled, value, k + 1)?;
            }
        }
        // An array of objects, next to metadata of the logger.
        Ok(Value::Object(object)) if object.values().filter(|v| is_rows(v)).count() == 1 => {
            for value in object.values().filter(|v| is_rows(v)).filter_map(Value::as_array) {
                for (k, value) in value.iter().enumerate() {
                    row(&mut filled, value, k + 1)?;
                }
            }
        }
        Ok(Value::Object(object)) if object.values().any(Value::is_array) => {
            let rows = object.values().filter_map(Value::as_array).map(Vec::len).max().unwrap_or(0);
            for k in 0..rows {
                for (name, values) in &object {
                    let Some(value) = values.as_array().and_then(|v| v.get(k)) else { continue };
                    cell(&mut filled, name, value, k + 1, file)?;
                }
                filled.end(k + 1);
            }
        }
        _ => {
            let last = bytes.trim_ascii_end().split(|b| *b == b'\n').count();
            for (k, line) in bytes.split(|b| *b == b'\n').enumerate() {
                let line = line.trim_ascii();
                if line.is_empty() {
                    continue;
                }
                match serde_json::from_slice(line) {
                    Ok(value) => row(&mut filled, &value, k + 1)?,
                    // An object that ends before it is closed, behind whole ones.
                    Err(e) if e.is_eof() && k + 1 == last && filled.rows() > 0 => {
                        cut = Some(cut_warning(file, last, &excerpt(line)));
                    }
                    Err(e) => {
                        return Err(wrong(format!("row {}: not JSON ({e}); a record is one object a line", k + 1)));
                    }
                }
            }
        }
    }
    // Rows of an array are numbered from the first.
    cut = cut.or_else(|| begun.map(|text| cut_warning(file, filled.rows() + 1, &text)));
    if filled.is_empty() {
        return Err(wrong("the file holds no columns; a record is one object of numbers a line".to_owned()));
    }
    Ok(Table { cut, ..filled.table(file, 1) })
}

/// An array of objects that was cut off, closed after its last complete object, and the text after that.
fn closed(bytes: &[u8]) -> Option<(Vec<u8>, Option<String>)> {
    let mut open: Vec<u8> = Vec::new();
    let (mut quoted, mut escaped) = (false, false);
    let mut whole = None;
    for (k, &byte) in bytes.iter().enumerate() {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if quoted => escaped = true,
            b'"' => quoted = !quoted,
            _ if quoted => {}
            b'[' | b'{' => open.push(byte),
            b']' | b'}' => {
                open.pop();
                if byte == b'}' && open.last() == Some(&b'[') {
                    whole = Some((k + 1, open.clone()));
                }
            }
            _ => {}
        }
    }
    let (end, open) = whole?;
    let mut closed = bytes[..end].to_vec();
    closed.extend(open.iter().rev().map(|b| if *b == b'[' { b']' } else { b'}' }));
    let begun = bytes[end..].trim_ascii();
    let begun = begun.strip_prefix(b",").unwrap_or(begun).trim_ascii();
    Some((closed, (!begun.is_empty()).then(|| excerpt(begun))))
}

/// Whether a value is an array of objects.
fn is_rows(value: &Value) -> bool {
    value.as_array().and_then(|a| a.first()).is_some_and(Value::is_object)
}

/// A value of a row: a number, the text of a number or of a time stamp; of an object each of its values, as `axis.torque`.
fn cell(filled: &mut Filled, name: &str, value: &Value, line: usize, file: &str) -> Result<(), TraceError> {
    match value {
        Value::Object(inner) => inner.iter().try_for_each(|(part, value)| match value {
            // No deeper: a name of three parts is no channel.
            Value::Object(_) => Ok(()),
            value => cell(filled, &format!("{name}.{part}"), value, line, file),
        }),
        Value::String(text) => {
            filled.put(name, super::csv::number(text.as_bytes(), false), || text.clone(), line, file)
        }
        _ => filled.put(name, value.as_f64(), || value.to_string(), line, file),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &[u8]) -> Table {
        Table::parse(text, "log").unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn json_in_its_three_forms_is_one_table() {
        for text in [
            "{\"time\": 0, \"T [mN.m]\": 1.5}\n{\"time\": 0.1, \"T [mN.m]\": -2}\n",
            "[{\"time\": 0, \"T [mN.m]\": 1.5}, {\"time\": 0.1, \"T [mN.m]\": -2}]",
            "{\"time\": [0, 0.1], \"T [mN.m]\": [1.5, -2]}",
        ] {
            let table = table(text.as_bytes());
            assert_eq!(table.rows(), 2, "{text}");
            let at = table.position("T").unwrap();
            assert_eq!(table.column(at).unwrap(), [1.5, -2.0]);
            assert_eq!(table.headers[at].unit.as_deref(), Some("mN.m"));
        }
        let table = table(b"{\"time\": 0, \"T\": 1}\n{\"time\": 1}\n");
        assert!(table.column(table.position("T").unwrap()).unwrap_err().to_string().contains("row 2"));
        let error = Table::parse(b"{\"time\": 0}\n{\"time\": \n{\"time\": 2}\n", "log").unwrap_err().to_string();
        assert!(error.contains("row 2") && error.contains("not JSON"), "{error}");
        // The last object was never closed: the logger was stopped.
        let table = Table::parse(b"{\"time\": 0}\n{\"time\": 1}\n{\"time\": ", "log").unwrap();
        assert_eq!(table.rows(), 2);
        assert!(table.cut.unwrap().contains("log: row 3, the last, is cut off"));
        // So is an array, but where it breaks in the middle.
        let whole = "{\"rows\": [{\"t\": 0, \"a\": {\"T\": 1}}, {\"t\": 1, \"a\": {\"T\": 2}}]}";
        for (end, rows, cut) in [(2, 2, false), (4, 1, true), (9, 1, true)] {
            let table = Table::parse(&whole.as_bytes()[..whole.len() - end], "log").unwrap();
            assert_eq!((table.rows(), table.cut.is_some()), (rows, cut), "{end}");
        }
        let error = Table::parse(b"[{\"t\": 0}, {\"t\": x}, {\"t\": 2}", "log").unwrap_err().to_string();
        assert!(error.contains("row 1: not JSON"), "{error}");
    }

    #[test]
    fn json_of_nested_objects_and_rows_beside_other_things_is_a_table() {
        let text = br#"{"logger": "x", "rows": [
            {"t": "2026-03-01T12:00:00Z", "axis": {"T": 1.5, "q": 0.1}}, {"t": "2026-03-01T12:00:01Z", "axis": {"T": -2.5, "q": 0.2}}]}"#;
        let table = table(text);
        assert_eq!(table.names(), "t, axis.T, axis.q");
        assert_eq!(table.column(1).unwrap(), [1.5, -2.5]);
        assert_eq!(table.column(0).unwrap()[1] - table.column(0).unwrap()[0], 1.0);
    }
}
