//! Text tables: a header of column names, then one row per line.

use super::compression::refuse_packed;
use super::input_file::InputFile;
use crate::diagnostic::{Code, Diagnostic};
use std::path::Path;

/// Number of bad rows that are reported one by one.
const MAX_SHOWN: usize = 5;

/// Column that a table may have.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Name in lower case.
    pub name: &'static str,
    /// True if the column is required.
    pub required: bool,
}

/// Table with its header read. The fields of a row are in the order of `columns`; those of missing columns are empty.
pub struct Table<'a> {
    path: &'a Path,
    separator: Separator,
    /// Index of the column of each field of a line.
    order: Vec<usize>,
    columns: usize,
    rest: &'a [u8],
    header_line: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    Byte(u8),
    Blanks,
}

impl<'a> Table<'a> {
    /// Reads the header: the first line that is neither blank nor a comment (`#`).
    ///
    /// # Errors
    /// FB102 if the file is compressed, FB106 if it has no lines, FB203 if a required column is missing or a column is
    /// unknown.
    pub fn open(file: &'a InputFile, columns: &[Column]) -> Result<Self, Diagnostic> {
        refuse_packed(file, "table")?;
        let path = file.path();
        let bytes = file.bytes();
        let header_error = |line: usize, message: String| {
            let names: Vec<&str> = columns.iter().filter(|c| c.required).map(|c| c.name).collect();
            Diagnostic::new(Code::TableHeader, message)
                .in_file(path)
                .at_line(line)
                .with_help(format!("name the columns in the first line: `{}`", names.join(",")))
        };
        if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
            return Err(header_error(1, "file is UTF-16".into()).with_help("save it as UTF-8 or ASCII text"));
        }
        let mut lines = Lines { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), number: 0 };
        let Some((header_line, header)) = lines.next() else {
            return Err(Diagnostic::new(Code::FileEmpty, "table has no lines").in_file(path));
        };
        // Separator of the header, then its columns in their order.
        let separator = [b';', b'\t', b',']
            .into_iter()
            .find(|separator| header.contains(separator))
            .map_or(Separator::Blanks, Separator::Byte);
        let mut order = Vec::new();
        for field in separator.split(header) {
            let name = String::from_utf8_lossy(field).to_lowercase();
            let known = columns.iter().position(|column| column.name == name);
            match known {
                Some(column) if order.contains(&column) => {
                    return Err(header_error(header_line, format!("column `{name}` occurs twice")));
                }
                Some(column) => order.push(column),
                None if fast_float2::parse::<f64, _>(field).is_ok() => {
                    return Err(header_error(
                        header_line,
                        "header is missing: the table begins with numbers".into(),
                    ));
                }
                None => {
                    return Err(header_error(
                        header_line,
                        format!("column `{}` is not known", printable(field)),
                    ));
                }
            }
        }
        let missing = columns.iter().enumerate().find(|(k, column)| column.required && !order.contains(k));
        if let Some((_, column)) = missing {
            return Err(header_error(header_line, format!("column `{}` is missing", column.name)));
        }
        Ok(Self { path, separator, order, columns: columns.len(), rest: lines.rest, header_line })
    }

    /// Returns true if the table has the column at this index of the list given to [`Table::open`].
    pub fn has(&self, column: usize) -> bool {
        self.order.contains(&column)
    }

    /// Reads all rows with `read`, which receives the line number and one field per column.
    ///
    /// # Errors
    /// The first few bad rows and the number of others; FB204 if there is no row.
    pub fn rows<T>(
        &self,
        mut read: impl FnMut(usize, &[&'a [u8]]) -> Result<T, Diagnostic>,
    ) -> Result<Vec<T>, Vec<Diagnostic>> {
        let mut rows = Vec::with_capacity(self.rest.len() / 32);
        let mut bad = BadRows::new(self.path);
        let mut fields: Vec<&[u8]> = vec![b""; self.columns];
        let lines = Lines { rest: self.rest, number: self.header_line };
        for (number, line) in lines {
            let mut count = 0;
            for field in self.separator.split(line) {
                if let Some(&column) = self.order.get(count) {
                    fields[column] = field;
                }
                count += 1;
            }
            let row = if count == self.order.len() {
                read(number, &fields)
            } else {
                let message = format!(
                    "row has {count} fields, the header has {}: `{}`",
                    self.order.len(),
                    printable(line)
                );
                Err(Diagnostic::new(Code::TableRow, message))
            };
            match row {
                Ok(row) => rows.push(row),
                Err(diagnostic) => bad.add(diagnostic.at_line(number)),
            }
        }
        if rows.is_empty() && bad.count == 0 {
            let message = "table has a header but no rows";
            return Err(vec![Diagnostic::new(Code::TableRow, message).in_file(self.path)]);
        }
        bad.finish()?;
        Ok(rows)
    }
}

/// Collector of bad rows: keeps the first few, and counts the others.
pub struct BadRows<'a> {
    path: &'a Path,
    shown: Vec<Diagnostic>,
    count: usize,
}

impl<'a> BadRows<'a> {
    /// Creates an empty collector for the file at `path`.
    pub fn new(path: &'a Path) -> Self {
        Self { path, shown: Vec::new(), count: 0 }
    }

    /// Adds the error of a row.
    pub fn add(&mut self, diagnostic: Diagnostic) {
        self.count += 1;
        if self.shown.len() < MAX_SHOWN {
            self.shown.push(diagnostic.in_file(self.path));
        }
    }

    /// Ends the collection.
    ///
    /// # Errors
    /// All collected diagnostics, if there are any.
    pub fn finish(mut self) -> Result<(), Vec<Diagnostic>> {
        let more = self.count - self.shown.len();
        if more > 0 {
            let message = format!("{more} more rows have errors");
            self.shown.push(Diagnostic::new(Code::TableRow, message).in_file(self.path));
        }
        if self.shown.is_empty() { Ok(()) } else { Err(self.shown) }
    }
}

/// Iterator over lines that are neither blank nor comments, trimmed, with their numbers.
struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
            let line = self.rest[..end].trim_ascii();
            self.rest = &self.rest[(end + 1).min(self.rest.len())..];
            self.number += 1;
            if !line.is_empty() && line[0] != b'#' {
                return Some((self.number, line));
            }
        }
        None
    }
}

impl Separator {
    /// Returns the fields without surrounding blanks and quotes.
    fn split(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        line.split(move |&b| match self {
            Self::Byte(separator) => b == separator,
            Self::Blanks => b == b' ' || b == b'\t',
        })
        .map(|field| {
            let field = field.trim_ascii();
            field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field)
        })
        .filter(move |field| self != Self::Blanks || !field.is_empty())
    }
}

/// Parses a whole number. `3.0` and `3e0`, as numerical tools write them, are accepted.
pub fn integer(field: &[u8]) -> Option<i64> {
    // Fast path for up to 18 digits, as in nearly all fields.
    if (1..=18).contains(&field.len()) && field.iter().all(u8::is_ascii_digit) {
        return Some(field.iter().fold(0, |number, digit| 10 * number + i64::from(digit - b'0')));
    }
    let text = std::str::from_utf8(field).ok()?;
    text.parse().ok().or_else(|| {
        let value = fast_float2::parse::<f64, _>(field).ok()?;
        // Beyond 2^53 a float does not determine the whole number.
        (value.fract() == 0.0 && value.abs() <= 9_007_199_254_740_992.0).then_some(value as i64)
    })
}

/// Returns text of a file in a form that can be shown in a message.
pub fn printable(text: &[u8]) -> String {
    const MAX_CHARACTERS: usize = 60;
    let end = if text.len() > MAX_CHARACTERS { "..." } else { "" };
    format!("{}{end}", text[..text.len().min(MAX_CHARACTERS)].escape_ascii())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers() {
        for (text, value) in [("7", 7), ("-3", -3), ("+4", 4), ("1.0", 1), ("2.000e+01", 20)] {
            assert_eq!(integer(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["", "1.5", "x", "nan", "inf", "1e300", "1 2"] {
            assert_eq!(integer(text.as_bytes()), None, "{text}");
        }
    }
}
