//! Named arrays: the entries of the flex-body file in containers that need no HDF5. Nothing is lost.

use super::{ExportFormat, ExportOptions, Exported};
use crate::error::Result;
use crate::flex_body::FlexBody;
use crate::store::{NamedArray, NamedAttributes, Numbers, contents};
use serde::{Serialize, Serializer};
use serde_json::ser::{Formatter, Serializer as JsonSerializer};
use std::io::{self, Write};

/// A JSON document.
pub(super) struct Json;

impl ExportFormat for Json {
    fn name(&self) -> &'static str {
        "json"
    }

    fn reader(&self) -> &'static str {
        "any language: the entries of the flex-body file as JSON"
    }

    fn losses(&self, _: &FlexBody, _: &ExportOptions) -> Vec<String> {
        Vec::new()
    }

    fn write(&self, body: &FlexBody, _: &ExportOptions) -> Result<Exported> {
        let (attributes, arrays) = contents(body);
        let mut file = Vec::new();
        Document::new(&attributes, &arrays, true)
            .serialize(&mut JsonSerializer::with_formatter(&mut file, KeyPerLine))
            .expect("texts and finite numbers are valid JSON");
        file.push(b'\n');
        Ok(Exported::single(file))
    }
}

/// Groups with their attributes, and arrays, by their paths in the flex-body file.
#[derive(Serialize)]
struct Document<'a> {
    attributes: Ordered<'a, Ordered<'a, &'a serde_json::Value>>,
    arrays: Ordered<'a, Entry<'a>>,
}

#[derive(Serialize)]
struct Entry<'a> {
    symbol: &'a str,
    units: &'a str,
    description: &'a str,
    shape: &'a [usize],
    #[serde(skip_serializing_if = "Option::is_none")]
    values: Option<Values<'a>>,
}

impl<'a> Document<'a> {
    /// With the numbers of the arrays, or without.
    fn new(attributes: &'a [NamedAttributes], arrays: &'a [NamedArray], values: bool) -> Self {
        let group = |group: &'a NamedAttributes| {
            (
                group.path.as_str(),
                Ordered(group.values.iter().map(|(name, value)| (name.as_str(), value)).collect()),
            )
        };
        let entry = |array: &'a NamedArray| Entry {
            symbol: array.symbol,
            units: &array.units,
            description: array.description,
            shape: &array.shape,
            values: values.then_some(Values(array)),
        };
        Self {
            attributes: Ordered(attributes.iter().map(group).collect()),
            arrays: Ordered(arrays.iter().map(|array| (array.path.as_str(), entry(array))).collect()),
        }
    }
}

/// A map that keeps the order of the file: that of the interfaces counts.
struct Ordered<'a, T>(Vec<(&'a str, T)>);

impl<T: Serialize> Serialize for Ordered<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

/// The numbers of an array, nested row by row.
struct Values<'a>(&'a NamedArray);

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let shape = &self.0.shape;
        match &self.0.values {
            Numbers::Floats(values) => Nested(shape, values).serialize(serializer),
            Numbers::Ints(values) => Nested(shape, values).serialize(serializer),
        }
    }
}

struct Nested<'a, T>(&'a [usize], &'a [T]);

impl<T: Serialize> Serialize for Nested<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        match self.0 {
            [] | [_] => self.1.serialize(serializer),
            [_, inner @ ..] => {
                let row = inner.iter().product::<usize>().max(1);
                serializer.collect_seq(self.1.chunks(row).map(|row| Nested(inner, row)))
            }
        }
    }
}

/// Every key on a line of its own, every array on a single one.
struct KeyPerLine;

impl Formatter for KeyPerLine {
    fn begin_object_key<W: Write + ?Sized>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        writer.write_all(if first { b"\n" } else { b",\n" })
    }

    fn end_object<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b"\n}")
    }
}
