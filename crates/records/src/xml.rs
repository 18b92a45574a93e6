//! An XML document as a tree whose every element and attribute knows its line and column.
//!
//! Bounded in depth and in number of nodes; entities other than the five predefined ones and character references are
//! an error, so nothing expands. Encodings: UTF-8 (with or without byte order mark), UTF-16 with byte order mark,
//! ISO-8859-1, Windows-1252 (read as ISO-8859-1) and US-ASCII.

use quick_xml::Reader;
use quick_xml::escape::unescape;
use quick_xml::events::{BytesStart, Event};

/// Deepest nesting that is read.
const MAX_DEPTH: usize = 200;
/// Largest number of elements and attributes together.
const MAX_NODES: usize = 20_000_000;

/// A place in a text file, counted from one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, serde::Serialize, serde::Deserialize)]
pub struct Position {
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
}

impl std::fmt::Display for Position {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// A document that is not well-formed, or beyond the limits.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{position}: {message}")]
pub struct XmlError {
    /// Where.
    pub position: Position,
    /// What is wrong.
    pub message: String,
}

/// An attribute.
#[derive(Debug, Clone)]
pub struct Attribute {
    /// Name with its prefix, as written.
    pub name: String,
    /// Value, normalised.
    pub value: String,
    /// Place of the name.
    pub position: Position,
}

/// An element.
#[derive(Debug, Clone)]
pub struct Element {
    /// Name with its prefix, as written.
    pub name: String,
    /// Attributes in the order of the file.
    pub attributes: Vec<Attribute>,
    /// Child elements in the order of the file.
    pub children: Vec<Element>,
    /// Whether there is text other than white space directly inside.
    pub has_text: bool,
    /// Place of the opening `<`.
    pub position: Position,
}

impl Element {
    /// The value of an attribute.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&str> {
        self.attribute(name).map(|a| a.value.as_str())
    }

    /// An attribute.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    /// The first child of this name.
    #[must_use]
    pub fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|e| e.name == name)
    }

    /// All children of this name.
    pub fn children_named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Element> {
        self.children.iter().filter(move |e| e.name == name)
    }

    /// The place of an attribute, or of the element when it has no such attribute.
    #[must_use]
    pub fn position_of(&self, attribute: &str) -> Position {
        self.attribute(attribute).map_or(self.position, |a| a.position)
    }
}

/// A well-formed document.
#[derive(Debug, Clone)]
pub struct Document {
    /// The root element.
    pub root: Element,
    /// The text as decoded, for quoting lines.
    pub source: String,
}

impl Document {
    /// Parses a document.
    ///
    /// # Errors
    /// When it is not well-formed, in an unknown encoding, or beyond the limits.
    pub fn parse(bytes: &[u8]) -> Result<Self, XmlError> {
        let source = decode(bytes)?;
        let root = Parser { source: &source, last: (0, Position { line: 1, column: 1 }), nodes: 0 }.parse()?;
        Ok(Self { root, source })
    }
}

fn at_start(message: impl Into<String>) -> XmlError {
    XmlError { position: Position { line: 1, column: 1 }, message: message.into() }
}

fn decode(bytes: &[u8]) -> Result<String, XmlError> {
    if let Some(rest) = bytes.strip_prefix(&[0xEF, 0xBB, 0xBF]) {
        return utf8(rest);
    }
    type FromUnits = fn([u8; 2]) -> u16;
    for (mark, from) in [([0xFE, 0xFF], u16::from_be_bytes as FromUnits), ([0xFF, 0xFE], u16::from_le_bytes)] {
        if let Some(rest) = bytes.strip_prefix(&mark) {
            let units: Vec<u16> = rest.chunks_exact(2).map(|pair| from([pair[0], pair[1]])).collect();
            return String::from_utf16(&units).map_err(|_| at_start("the text is not valid UTF-16"));
        }
    }
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]);
    let declared = head.strip_prefix("<?xml").and_then(|rest| {
        let declaration = rest.split("?>").next()?;
        let value = declaration.split("encoding").nth(1)?.trim_start().strip_prefix('=')?.trim_start();
        let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        value[1..].split(quote).next().map(str::to_ascii_lowercase)
    });
    match declared.as_deref() {
        None | Some("utf-8" | "utf8" | "us-ascii" | "ascii") => utf8(bytes),
        Some("iso-8859-1" | "latin1" | "iso8859-1" | "windows-1252" | "cp1252") => {
            Ok(bytes.iter().map(|&byte| char::from(byte)).collect())
        }
        Some(other) => Err(at_start(format!("the encoding {other} is not known; FMI asks for UTF-8"))),
    }
}

fn utf8(bytes: &[u8]) -> Result<String, XmlError> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => {
            let good = String::from_utf8_lossy(&bytes[..error.valid_up_to()]).into_owned();
            let end = good.len();
            let position = advance(&good, (0, Position { line: 1, column: 1 }), end);
            Err(XmlError { position, message: "a byte that is not valid UTF-8".into() })
        }
    }
}

fn advance(source: &str, (from, mut position): (usize, Position), to: usize) -> Position {
    for c in source[from..to].chars() {
        if c == '\n' {
            position.line += 1;
            position.column = 1;
        } else {
            position.column += 1;
        }
    }
    position
}

struct Parser<'a> {
    source: &'a str,
    last: (usize, Position),
    nodes: usize,
}

impl Parser<'_> {
    /// Line and column of a byte offset; offsets mostly grow, so the walk resumes from the last one.
    fn position(&mut self, offset: usize) -> Position {
        let mut offset = offset.min(self.source.len());
        while !self.source.is_char_boundary(offset) {
            offset -= 1;
        }
        let from = if offset >= self.last.0 { self.last } else { (0, Position { line: 1, column: 1 }) };
        let position = advance(self.source, from, offset);
        self.last = (offset, position);
        position
    }

    fn error<T>(&mut self, offset: usize, message: impl Into<String>) -> Result<T, XmlError> {
        Err(XmlError { position: self.position(offset), message: message.into() })
    }

    fn parse(mut self) -> Result<Element, XmlError> {
        let source = self.source;
        let mut reader = Reader::from_str(source);
        reader.config_mut().check_comments = true;
        let mut stack: Vec<Element> = Vec::new();
        let mut root: Option<Element> = None;
        loop {
            let start = reader.buffer_position() as usize;
            let event = match reader.read_event() {
                Ok(event) => event,
                Err(error) => return self.error(reader.error_position() as usize, error.to_string()),
            };
            let (open, empty) = match event {
                Event::Start(open) => (open, false),
                Event::Empty(open) => (open, true),
                Event::End(_) => {
                    let Some(done) = stack.pop() else { return self.error(start, "an end tag without a start tag") };
                    attach(done, &mut stack, &mut root);
                    continue;
                }
                Event::Text(text) => {
                    if let Some(bad) = text.chars().find(|&c| !is_xml_char(c)) {
                        return self.error(start, format!("the character {bad:?} is not allowed in XML"));
                    }
                    self.text(&mut stack, start, text.trim().is_empty())?;
                    continue;
                }
                Event::CData(_) => {
                    self.text(&mut stack, start, false)?;
                    continue;
                }
                Event::GeneralRef(reference) => {
                    if let Err(error) = unescape(&format!("&{};", &*reference)) {
                        return self.error(start, error.to_string());
                    }
                    self.text(&mut stack, start, false)?;
                    continue;
                }
                Event::Eof => break,
                Event::Decl(_) if start > 0 => return self.error(start, "the XML declaration must come first"),
                Event::Decl(_) | Event::Comment(_) | Event::PI(_) | Event::DocType(_) => continue,
            };
            if stack.is_empty() && root.is_some() {
                return self.error(start, "a second root element");
            }
            if stack.len() >= MAX_DEPTH {
                return self.error(start, format!("elements nested deeper than {MAX_DEPTH}"));
            }
            let element = self.open(&open, start)?;
            if empty {
                attach(element, &mut stack, &mut root);
            } else {
                stack.push(element);
            }
        }
        if let Some(open) = stack.last() {
            let message = format!("the element {}, opened at {}, is never closed", open.name, open.position);
            return self.error(source.len(), message);
        }
        match root {
            Some(root) => Ok(root),
            None => self.error(0, "no root element"),
        }
    }

    fn text(&mut self, stack: &mut [Element], start: usize, blank: bool) -> Result<(), XmlError> {
        match stack.last_mut() {
            _ if blank => Ok(()),
            Some(element) => {
                element.has_text = true;
                Ok(())
            }
            None => self.error(start, "text outside the root element"),
        }
    }

    fn open(&mut self, open: &BytesStart<'_>, start: usize) -> Result<Element, XmlError> {
        let name = open.name().into_inner().to_owned();
        if !is_xml_name(&name) {
            return self.error(start, format!("`{name}` is not an element name"));
        }
        let position = self.position(start);
        let mut attributes = Vec::new();
        for attribute in open.attributes() {
            let attribute = match attribute {
                Ok(attribute) => attribute,
                Err(error) => return self.error(start, format!("element {name}: {error}")),
            };
            let key = attribute.key.into_inner();
            // The key borrows from the source; its address gives its place.
            let offset = (key.as_ptr() as usize).checked_sub(self.source.as_ptr() as usize);
            let offset = offset.filter(|&o| o < self.source.len()).unwrap_or(start);
            if !is_xml_name(key) {
                return self.error(offset, format!("element {name}: `{key}` is not an attribute name"));
            }
            if attribute.value.contains('<') || attribute.value.chars().any(|c| !is_xml_char(c)) {
                let message = format!("element {name}: the attribute {key} holds a character not allowed there");
                return self.error(offset, message);
            }
            let spaced: String =
                attribute.value.chars().map(|c| if matches!(c, '\t' | '\n' | '\r') { ' ' } else { c }).collect();
            let value = match unescape(&spaced) {
                Ok(value) => value.into_owned(),
                Err(error) => return self.error(offset, format!("element {name}, attribute {key}: {error}")),
            };
            attributes.push(Attribute { name: key.to_owned(), value, position: self.position(offset) });
        }
        self.nodes += 1 + attributes.len();
        if self.nodes > MAX_NODES {
            return self.error(start, format!("more than {MAX_NODES} elements and attributes"));
        }
        Ok(Element { name, attributes, children: Vec::new(), has_text: false, position })
    }
}

fn attach(done: Element, stack: &mut [Element], root: &mut Option<Element>) {
    match stack.last_mut() {
        Some(parent) => parent.children.push(done),
        None => *root = Some(done),
    }
}

fn is_xml_char(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r' | '\u{20}'..='\u{D7FF}' | '\u{E000}'..='\u{FFFD}' | '\u{10000}'..)
}

fn is_xml_name(name: &str) -> bool {
    let start = |c: char| c.is_alphabetic() || c == '_' || c == ':';
    name.chars().next().is_some_and(start)
        && name.chars().all(|c| start(c) || c.is_numeric() || matches!(c, '-' | '.' | '\u{B7}' | '\u{300}'..='\u{36F}'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_and_attributes_know_their_line_and_column() {
        let document = Document::parse(b"<a>\n  <b x='1'\n     y='2'/>\n</a>").unwrap();
        let b = document.root.child("b").unwrap();
        assert_eq!(b.position, Position { line: 2, column: 3 });
        assert_eq!(b.position_of("x"), Position { line: 2, column: 6 });
        assert_eq!(b.position_of("y"), Position { line: 3, column: 6 });
    }

    #[test]
    fn encodings_are_decoded() {
        let latin = b"<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><a x=\"\xE9\"/>";
        assert_eq!(Document::parse(latin).unwrap().root.get("x"), Some("\u{e9}"));
        let marked = b"\xEF\xBB\xBF<a x=\"\xC3\xA9\"/>";
        assert_eq!(Document::parse(marked).unwrap().root.get("x"), Some("\u{e9}"));
        let wide: Vec<u8> =
            std::iter::once(0xFEFF_u16).chain("<a x='1'/>".encode_utf16()).flat_map(u16::to_le_bytes).collect();
        assert_eq!(Document::parse(&wide).unwrap().root.get("x"), Some("1"));
        assert!(Document::parse(b"<?xml version=\"1.0\" encoding=\"klingon\"?><a/>").is_err());
    }

    #[test]
    fn what_is_not_well_formed_is_refused_with_its_place() {
        for (text, line) in [
            ("<a>", 1),
            ("<a></b>", 1),
            ("<a/>\n<b/>", 2),
            ("<a>\n<b x='1' x='2'/></a>", 2),
            ("<a x='&bad;'/>", 1),
            ("<a>&bad;</a>", 1),
            ("text", 1),
            ("<a/>text", 1),
            ("<a x=1/>", 1),
            ("<a x='<'/>", 1),
            ("", 1),
        ] {
            let error = Document::parse(text.as_bytes()).expect_err(text);
            assert_eq!(error.position.line, line, "{text}: {error}");
        }
        let deep = "<a>".repeat(5000) + &"</a>".repeat(5000);
        assert!(Document::parse(deep.as_bytes()).is_err());
    }
}
