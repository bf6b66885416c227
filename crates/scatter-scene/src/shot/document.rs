//! A TOML text with its lines: turns parser errors and keys such as `camera.eye` into `line 5: camera.eye`.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use crate::error::{Checked, Fault};

/// A parsed text whose keys have places.
pub(super) struct Document<'a> {
    text: &'a str,
    entries: Vec<Entry>,
}

/// One key, or one element of an array of tables.
struct Entry {
    /// `camera.eye`, `lights[1].direction`.
    path: String,
    /// From the key to the end of its value; of a table's header only the header.
    range: Range<usize>,
}

impl<'a> Document<'a> {
    /// Parses the text as `T`; every error names line, key and cure.
    pub(super) fn parse<T: DeserializeOwned>(text: &'a str) -> Checked<(Self, T)> {
        let mut document = Self { text, entries: Vec::new() };
        let table = DeTable::parse(text).map_err(|error| document.fault_of(&error))?;
        document.collect("", table.get_ref());
        let value = toml::from_str(text).map_err(|error| document.fault_of(&error))?;
        Ok((document, value))
    }

    /// `line 5: camera.eye`; for a key that is not there, the line of what should hold it.
    pub(super) fn place(&self, key: &str) -> String {
        let mut path = key;
        loop {
            if let Some(entry) = self.entries.iter().find(|entry| entry.path == path) {
                return format!("line {}: {key}", self.line(entry.range.start));
            }
            match path.rfind(['.', '[']) {
                Some(end) => path = &path[..end],
                None => return key.to_owned(),
            }
        }
    }

    fn collect(&mut self, prefix: &str, table: &DeTable<'_>) {
        for (key, value) in table.iter() {
            let path = if prefix.is_empty() {
                key.get_ref().to_string()
            } else {
                format!("{prefix}.{}", key.get_ref())
            };
            let range = key.span().start..value.span().end.max(key.span().end);
            self.entries.push(Entry { path: path.clone(), range });
            match value.get_ref() {
                DeValue::Table(table) => self.collect(&path, table),
                DeValue::Array(array) => {
                    for (i, element) in array.iter().enumerate() {
                        if let DeValue::Table(table) = element.get_ref() {
                            let path = format!("{path}[{i}]");
                            self.entries.push(Entry { path: path.clone(), range: element.span() });
                            self.collect(&path, table);
                        }
                    }
                }
                _ => {}
            }
        }
    }

    fn fault_of(&self, error: &toml::de::Error) -> Fault {
        let span = error.span().unwrap_or(0..0);
        let start = span.start;
        // The narrowest key around the error; a table as a whole begins at its bracket, before its key.
        let around = self.entries.iter().filter(|entry| entry.range.contains(&start));
        let within = || self.entries.iter().find(|entry| span.contains(&entry.range.start));
        let key =
            around.min_by_key(|entry| entry.range.len()).or_else(within).map(|entry| entry.path.as_str());
        let line = self.line(start);
        let place = match key {
            Some(key) => format!("line {line}: {key}"),
            None => format!("line {line}"),
        };
        let message = error.message();
        let cure = if message.starts_with("missing field") {
            "add it"
        } else if message.starts_with("unknown field") {
            "correct or remove it"
        } else if self.entries.is_empty() {
            "the text must be TOML"
        } else {
            "correct the value"
        };
        Fault::invalid(place, message, cure)
    }

    fn line(&self, offset: usize) -> usize {
        let before = self.text.as_bytes().get(..offset).unwrap_or_default();
        1 + before.iter().filter(|&&b| b == b'\n').count()
    }
}
