//! Traces of machine controls in forms of their own: Siemens Sinumerik and Heidenhain TNCscope.
//!
//! Sinumerik (trace of HMI Operate, saved as XML): `traceData/dataFrame` holds a `dataSignal` for each signal, with its `id`,
//! `name` and `interval` (s), and a `rec` for each sample, whose attributes are `time` (s) and the values by the signals' ids;
//! a signal that is sampled more slowly is missing in some of them. The units are not in the file in a form that is described:
//! `[signals]` gives them. Source: the readers and the format chapter of the viewer "Industrial Oscilloscope" (MIT licence).
//!
//! TNCscope (`*.sco`): lines that begin with `%` name the curves, each a block `%[CURVE...]` of `%CHANNELTYPE=`, `%AXISTYPE=`,
//! `%DIMENSION=`, `%COUNT=` and `%CYCLETIME=` (microseconds); behind `%[DATA]` stand rows of time and values, each closed by a
//! semicolon. Source: the public MATLAB reader `read_tncscope_file`. No export of a control was at hand for either.

use super::csv::cut::{cut_warning, excerpt};
use super::error::TraceError;
use super::forms::Filled;
use super::table::{Table, header};
use super::units::Unit;
use crate::xml::{Document, Element};

/// Whether the text begins as XML does.
pub(super) fn is_xml(text: &[u8]) -> bool {
    let first = text.trim_ascii_start();
    first.starts_with(b"<?xml") || first.starts_with(b"<trace")
}

/// Whether the text is a file of TNCscope.
pub(super) fn is_tncscope(text: &[u8]) -> bool {
    let head = &text[..text.len().min(1 << 16)];
    head.trim_ascii_start().starts_with(b"%") && memchr::memmem::find(head, b"%[CURVE").is_some()
}

/// A name with its unit, where that is one of a motion or a drive.
fn named(name: &str, unit: &str) -> String {
    let unit = unit.trim();
    if Unit::parse(unit).is_some() { format!("{name} [{unit}]") } else { name.to_owned() }
}

/// A trace of Sinumerik.
///
/// # Errors
/// When the file is damaged, or holds no table.
pub(super) fn sinumerik(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let wrong = |what: String| TraceError::Format { file: file.to_owned(), what };
    let mut cut = None;
    let document = Document::parse(bytes).or_else(|e| {
        closed(bytes)
            .and_then(|closed| {
                cut = closed.begun.map(|(line, text)| cut_warning(file, line, &text));
                Document::parse(&closed.whole).ok()
            })
            .ok_or_else(|| {
                wrong(format!(
                    "line {}: XML that is not well-formed ({}); save the trace again",
                    e.position.line, e.message
                ))
            })
    })?;
    let within = |e: &Element, names: &[&str]| -> Option<Element> {
        names.iter().try_fold(e.clone(), |e, name| if e.name == *name { Some(e) } else { e.child(name).cloned() })
    };
    let frame = within(&document.root, &["traceData", "dataFrame"]).ok_or_else(|| {
        wrong("XML without traceData/dataFrame, which a trace of Sinumerik has; give a trace".to_owned())
    })?;
    let mut filled = Filled::default();
    let mut signals: Vec<(&str, String)> = Vec::new();
    for signal in frame.children_named("dataSignal") {
        let Some(id) = signal.get("id") else { continue };
        let key = signal.get("key").unwrap_or(id);
        let name = signal.get("name").filter(|n| !n.trim().is_empty()).unwrap_or(key);
        // Two signals of one name are distinguished by their ids.
        let taken = signals.iter().any(|(_, other)| header(other).name == header(name).name);
        let name = if taken { format!("{name} ({id})") } else { name.to_owned() };
        signals.push((id, named(&name, signal.get("unitsType").unwrap_or_default())));
    }
    if signals.is_empty() {
        return Err(wrong("its dataFrame has no dataSignal: there is nothing in the trace".to_owned()));
    }
    for rec in frame.children_named("rec") {
        let line = rec.position.line as usize;
        // A record of the slow signals alone, or of an event, has nothing of the others.
        let present = signals.iter().filter(|(id, _)| rec.get(id).is_some()).count();
        if present == 0 {
            continue;
        }
        let value = |text: &str| text.trim().parse::<f64>().ok();
        let time = rec.get("time").unwrap_or_default();
        filled.put("time [s]", value(time), || time.to_owned(), line, file)?;
        for (id, name) in &signals {
            if let Some(text) = rec.get(id) {
                filled.put(name, value(text), || text.to_owned(), line, file)?;
            }
        }
        filled.end(line);
    }
    if filled.rows() == 0 {
        return Err(wrong("its dataFrame has no rec: no sample was recorded".to_owned()));
    }
    Ok(Table { cut, ..filled.table(file, 1) })
}

/// A trace of Sinumerik that was cut off, closed after its last complete sample.
struct Closed {
    whole: Vec<u8>,
    /// Line and text of the incomplete sample after it.
    begun: Option<(usize, String)>,
}

/// Closes a trace of Sinumerik that is cut off; None where it has no complete sample.
fn closed(bytes: &[u8]) -> Option<Closed> {
    let end = memchr::memmem::rfind(bytes, b"/>")? + 2;
    let begun = bytes[end..].trim_ascii();
    let mut whole = bytes[..end].to_vec();
    for name in ["dataFrame", "traceData", "traceDataRoot"] {
        let opened = [">", " "].iter().any(|b| memchr::memmem::find(bytes, format!("<{name}{b}").as_bytes()).is_some());
        if opened {
            whole.extend_from_slice(format!("</{name}>").as_bytes());
        }
    }
    let line = 1 + memchr::memchr_iter(b'\n', &bytes[..bytes.trim_ascii_end().len()]).count();
    // The end of an element is no sample.
    let sample = !begun.is_empty() && !begun.starts_with(b"</");
    Some(Closed { whole, begun: sample.then(|| (line, excerpt(begun))) })
}

/// A file of TNCscope.
///
/// # Errors
/// When the file is damaged, or holds no table.
pub(super) fn tncscope(bytes: &[u8], file: &str) -> Result<Table, TraceError> {
    let wrong = |what: String| TraceError::Format { file: file.to_owned(), what };
    let text = String::from_utf8_lossy(bytes);
    // Name, unit and cycle time (s) of each curve.
    let mut curves: Vec<[String; 4]> = Vec::new();
    let mut lines = text.lines().enumerate();
    let mut inside = false;
    let mut data = false;
    for (_, line) in lines.by_ref() {
        let line = line.trim();
        if line.starts_with("%[CURVE") {
            inside = true;
            curves.push(Default::default());
        } else if line.starts_with("%[DATA]") {
            data = true;
            break;
        } else if line == "%" || line.starts_with("%[") {
            inside = false;
        } else if let (true, Some(curve), Some((key, value))) = (inside, curves.last_mut(), line.split_once('=')) {
            let keys = ["%CHANNELTYPE", "%AXISTYPE", "%DIMENSION", "%CYCLETIME"];
            if let Some(at) = keys.iter().position(|k| key.trim() == *k) {
                value.trim().clone_into(&mut curve[at]);
            }
        }
    }
    if !data || curves.is_empty() {
        return Err(wrong("a TNCscope file without %[DATA] or without a curve; export the recording again".to_owned()));
    }
    let cycle = |text: &str| text.parse::<f64>().ok().filter(|us| *us > 0.0 && us.is_finite()).map(|us| us * 1e-6);
    let dt = cycle(&curves[0][3]).ok_or_else(|| {
        wrong(format!("%CYCLETIME of the first curve is {:?}: a number of microseconds is expected", curves[0][3]))
    })?;
    let mut names: Vec<String> = Vec::new();
    for [kind, axis, unit, _] in &curves {
        let name = format!("{kind} {axis}");
        let name = name.trim();
        let count = names.iter().filter(|n| header(n).name == name || n.starts_with(&format!("{name} ("))).count();
        let name = if count > 0 { format!("{name} ({})", count + 1) } else { name.to_owned() };
        names.push(named(&name, unit));
    }
    let mut rows: Vec<(usize, &str)> = lines
        .map(|(number, line)| (number + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('%'))
        .collect();
    let mut cut = None;
    if let [.., (_, before), (at, last)] = rows[..] {
        let cells = |row: &str| row.matches(';').count();
        // Each row is closed by a semicolon.
        if before.ends_with(';') && cells(last) < cells(before) {
            cut = Some(cut_warning(file, at, &excerpt(last.as_bytes())));
            rows.pop();
        }
    }
    let mut filled = Filled::default();
    let mut row = 0_u32;
    for (at, line) in rows {
        // The first cell is the control's own count of time; the cycle time is what spaces the samples.
        let cells: Vec<&str> = line.trim_end_matches(';').split(';').map(str::trim).collect();
        if cells.len() > names.len() + 1 {
            let what =
                format!("row {at}: {} cells where the time and {} curves are expected", cells.len(), names.len());
            return Err(wrong(what));
        }
        filled.put("time [s]", Some(f64::from(row) * dt), String::new, at, file)?;
        for ((name, curve), cell) in names.iter().zip(&curves).zip(&cells[1..]) {
            // A curve of another cycle time is not of the same instants.
            let value = if cycle(&curve[3]) == Some(dt) { cell.parse().ok() } else { None };
            let text = || {
                if cycle(&curve[3]) == Some(dt) { (*cell).to_owned() } else { format!("cycle time {} us", curve[3]) }
            };
            filled.put(name, value, text, at, file)?;
        }
        filled.end(at);
        row += 1;
    }
    if row == 0 {
        return Err(wrong("no sample stands behind %[DATA]".to_owned()));
    }
    Ok(Table { cut, ..filled.table(file, 1) })
}
