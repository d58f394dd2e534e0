//! Text tables: a header of column names, then one row per line.

use super::compression::refuse_packed;
use super::input_file::InputFile;
use super::last_field::LastFields;
use super::scanner::{BadLines, Line, Lines, Separator, excerpt, number, without_mark};
use crate::diagnostic::{Code, Diagnosed, Diagnostic};
use std::path::Path;

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
    /// Lines below the header.
    rest: Lines<'a>,
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
        let header_error = |line: usize, message: String| {
            let names: Vec<&str> = columns.iter().filter(|c| c.required).map(|c| c.name).collect();
            Diagnostic::new(Code::TableHeader, message)
                .in_file(path)
                .at_line(line)
                .with_help(format!("name the columns in the first line: `{}`", names.join(",")))
        };
        let Some(text) = without_mark(file.bytes()) else {
            return Err(header_error(1, "file is UTF-16".into()).with_help("save it as UTF-8 or ASCII text"));
        };
        let mut rest = Lines::of(text);
        let Some(Line { number: header_line, text: header }) = rest.by_ref().find_map(content) else {
            return Err(Diagnostic::new(Code::FileEmpty, "table has no lines").in_file(path));
        };
        // Separator of the header, then its columns in their order.
        let separator = Separator::of(header);
        let mut order = Vec::new();
        for field in separator.split(header) {
            let name = String::from_utf8_lossy(field).to_lowercase();
            let known = columns.iter().position(|column| column.name == name);
            match known {
                Some(column) if order.contains(&column) => {
                    return Err(header_error(header_line, format!("column `{name}` occurs twice")));
                }
                Some(column) => order.push(column),
                None if number(field).is_some() => {
                    return Err(header_error(
                        header_line,
                        "header is missing: the table begins with numbers".into(),
                    ));
                }
                None => {
                    return Err(header_error(
                        header_line,
                        format!("column `{}` is not known", excerpt(field)),
                    ));
                }
            }
        }
        let missing = columns.iter().enumerate().find(|(k, column)| column.required && !order.contains(k));
        if let Some((_, column)) = missing {
            return Err(header_error(header_line, format!("column `{}` is missing", column.name)));
        }
        Ok(Self { path, separator, order, columns: columns.len(), rest })
    }

    /// Returns true if the table has the column at this index of the list given to [`Table::open`].
    pub fn has(&self, column: usize) -> bool {
        self.order.contains(&column)
    }

    /// Reads all rows with `read`, which receives the line number and one field per column.
    ///
    /// # Errors
    /// The first few bad rows and the number of others; FB204 if there is no row, and if the file may
    /// end within its last number.
    pub fn rows<T>(
        &self,
        mut read: impl FnMut(usize, &[&'a [u8]]) -> Result<T, Diagnostic>,
    ) -> Diagnosed<Vec<T>> {
        let mut rows = Vec::with_capacity(self.rest.rest().len() / 32);
        let mut bad = BadLines::default();
        let mut columns: Vec<&[u8]> = vec![b""; self.columns];
        let mut fields: Vec<&[u8]> = Vec::new();
        let mut last = LastFields::default();
        for Line { number, text } in self.rest.clone().filter_map(content) {
            self.separator.split_into(text, &mut fields);
            last.row(number, fields.last().copied().unwrap_or_default());
            let row = if fields.len() == self.order.len() {
                self.order.iter().zip(&fields).for_each(|(&column, field)| columns[column] = *field);
                read(number, &columns)
            } else {
                let message = format!(
                    "row has {} fields, the header has {}: `{}`",
                    fields.len(),
                    self.order.len(),
                    excerpt(text)
                );
                Err(Diagnostic::new(Code::TableRow, message))
            };
            match row {
                Ok(row) => rows.push(row),
                Err(diagnostic) => bad.add(diagnostic.in_file(self.path).at_line(number)),
            }
        }
        if rows.is_empty() && bad.is_empty() {
            let message = "table has a header but no rows";
            return Err(vec![Diagnostic::new(Code::TableRow, message).in_file(self.path)]);
        }
        bad.finish(Code::TableRow, "row")?;
        match last.cut_off(self.rest.rest(), Code::TableRow) {
            Some(cut_off) => Err(vec![cut_off.in_file(self.path)]),
            None => Ok(rows),
        }
    }
}

/// Returns a line that is neither blank nor a comment, trimmed.
fn content(line: Line<'_>) -> Option<Line<'_>> {
    line.content().filter(|line| line.text[0] != b'#')
}
