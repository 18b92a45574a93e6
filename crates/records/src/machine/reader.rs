//! The parts of a TOML document, with their lines.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::super::error::nearest;
use super::MachineError;

/// A value and its place in the text.
pub type Value<'a> = Spanned<DeValue<'a>>;

/// Reads values; its errors name file and line.
pub struct Reader<'a> {
    text: &'a str,
    file: &'a str,
}

/// A table and the lines of its keys.
pub struct Section<'a> {
    table: DeTable<'a>,
    /// Line of the table itself.
    pub own_line: Option<usize>,
    text: &'a str,
}

fn line_at(text: &str, offset: usize) -> usize {
    1 + text.as_bytes()[..offset.min(text.len())].iter().filter(|c| **c == b'\n').count()
}

impl<'a> Section<'a> {
    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&Value<'a>> {
        self.table.get(key)
    }

    /// The table of a key.
    ///
    /// # Errors
    /// When the value of the key is no table.
    pub fn table(&self, reader: &Reader<'a>, key: &str) -> Result<Option<Section<'a>>, MachineError> {
        self.get(key).map(|v| reader.table(v, key)).transpose()
    }

    /// Line of a key.
    pub fn line(&self, key: &str) -> Option<usize> {
        self.table.get_key_value(key).map(|(k, _)| line_at(self.text, k.span().start))
    }

    /// Keys, values and lines, in the order of the map.
    pub fn entries(&self) -> impl Iterator<Item = (&str, &Value<'a>, Option<usize>)> {
        self.table.iter().map(|(k, v)| (k.get_ref().as_ref(), v, Some(line_at(self.text, k.span().start))))
    }
}

impl<'a> Reader<'a> {
    pub const fn new(text: &'a str, file: &'a str) -> Self {
        Self { text, file }
    }

    pub fn error(&self, line: Option<usize>, message: &str) -> MachineError {
        MachineError { file: self.file.to_owned(), line, message: message.to_owned() }
    }

    /// The document.
    ///
    /// # Errors
    /// When the text is no TOML.
    pub fn root(&self) -> Result<Section<'a>, MachineError> {
        let table = DeTable::parse(self.text).map_err(|e| {
            self.error(e.span().map(|s| line_at(self.text, s.start)), e.message().lines().next().unwrap_or("not TOML"))
        })?;
        Ok(Section { table: table.into_inner(), own_line: None, text: self.text })
    }

    fn line(&self, value: &Value) -> Option<usize> {
        Some(line_at(self.text, value.span().start))
    }

    /// Refuses keys other than `allowed`, with the nearest name.
    ///
    /// # Errors
    /// When the section has a key that is not allowed.
    pub fn only(&self, section: &Section, allowed: &[&str], place: &str) -> Result<(), MachineError> {
        for (key, _, line) in section.entries() {
            if !allowed.contains(&key) {
                let near = nearest(key, allowed.iter().copied());
                let list = allowed.join(", ");
                return Err(self.error(line, &format!("{place} has no entry {key:?}{near}; it may have: {list}")));
            }
        }
        Ok(())
    }

    /// A value as a table; `what` names it in the error.
    ///
    /// # Errors
    /// When the value is no table.
    pub fn table(&self, value: &Value<'a>, what: &str) -> Result<Section<'a>, MachineError> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(Section { table: table.clone(), own_line: self.line(value), text: self.text }),
            other => Err(self.wrong(value, what, "a table", other)),
        }
    }

    /// A value as a text; `what` names it in the error.
    ///
    /// # Errors
    /// When the value is no text.
    pub fn text<'v>(&self, value: &'v Value<'a>, what: &str) -> Result<&'v str, MachineError> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text.as_ref()),
            other => Err(self.wrong(value, what, "text in quotes", other)),
        }
    }

    /// A finite number.
    ///
    /// # Errors
    /// When the value is no finite number.
    pub fn number(&self, value: &Value, what: &str) -> Result<f64, MachineError> {
        let parsed = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
            other => return Err(self.wrong(value, what, "a number", other)),
        };
        match parsed {
            Some(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(self.line(value), &format!("{what} must be a finite number"))),
        }
    }

    /// One of several words.
    ///
    /// # Errors
    /// When the value is none of the choices.
    pub fn choice<T: Copy>(&self, value: &Value, what: &str, choices: &[(&str, T)]) -> Result<T, MachineError> {
        let words = || choices.iter().map(|(w, _)| format!("{w:?}")).collect::<Vec<_>>().join(" or ");
        match value.get_ref() {
            DeValue::String(text) => match choices.iter().find(|(word, _)| *word == text.as_ref()) {
                Some((_, choice)) => Ok(*choice),
                None => Err(self.error(self.line(value), &format!("{what} is {text:?}: it must be {}", words()))),
            },
            other => Err(self.wrong(value, what, &words(), other)),
        }
    }

    fn wrong(&self, value: &Value, what: &str, needed: &str, found: &DeValue) -> MachineError {
        self.error(self.line(value), &format!("{what} must be {needed}, not a {}", found.type_str()))
    }
}
