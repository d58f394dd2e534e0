//! Text files: a header with the format of the numbers, a line for each column or string, and the numbers,
//! side by side without blanks.

use super::layout::{Column, Columns, Header, cut_off};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::input::bulk_cards::whole;
use crate::input::coordinates::{excerpt, real};
use crate::input::digits::written_digits;

/// Whether a file begins with the header of a matrix.
pub(super) fn begins(head: &[u8]) -> bool {
    let line = head.split(|&b| b == b'\n').next().unwrap_or_default();
    Heading::of(line.trim_ascii_end()).is_some()
}

/// Numbers in a line, and columns that each takes.
#[derive(Debug, Clone, Copy)]
struct Format {
    per_line: usize,
    width: usize,
}

/// The header line of a matrix.
struct Heading<'a> {
    /// Columns, rows, form, type.
    numbers: [i64; 4],
    name: &'a [u8],
    format: Format,
}

impl<'a> Heading<'a> {
    fn of(line: &'a [u8]) -> Option<Self> {
        let (line, wide) = match line.strip_suffix(b"|I16") {
            Some(line) => (line, 16),
            None => (line, 8),
        };
        let ends = [wide, 2 * wide, 2 * wide + 8, 2 * wide + 16, 2 * wide + 24];
        let field = |k: usize| {
            let start = if k == 0 { 0 } else { ends[k - 1] };
            line.get(start..ends[k].min(line.len())).filter(|field| !field.is_empty())
        };
        let mut numbers = [0; 4];
        for (k, number) in numbers.iter_mut().enumerate() {
            *number = whole(field(k)?.trim_ascii())?;
        }
        let [columns, rows, form, kind] = numbers;
        let is_matrix = columns > 0 && rows != 0 && (1..=15).contains(&form) && (1..=4).contains(&kind);
        let name = field(4)?.trim_ascii();
        let is_name = name.iter().all(u8::is_ascii_graphic);
        let format = format(line.get(ends[4]..).unwrap_or_default().trim_ascii())?;
        (is_matrix && is_name).then_some(Self { numbers, name, format })
    }
}

/// `1P,5E16.9`, `3E24.16`; without a format the first of these.
fn format(text: &[u8]) -> Option<Format> {
    if text.is_empty() {
        return Some(Format { per_line: 5, width: 16 });
    }
    let text = std::str::from_utf8(text).ok()?.to_ascii_uppercase();
    let text = text.trim_matches(['(', ')', ' ']);
    let text = text.strip_prefix("1P").map_or(text, |rest| rest.trim_start_matches([',', ' ']));
    let (per_line, rest) = text.split_once(['E', 'D'])?;
    let width = rest.split('.').next()?;
    let format = Format { per_line: per_line.parse().ok()?, width: width.parse().ok()? };
    ((1..=100).contains(&format.per_line) && (8..=100).contains(&format.width)).then_some(format)
}

/// A text file while it is read.
pub(super) struct Text<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Text<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, line: 0 }
    }

    /// Goes through the matrices; the columns of the one that `take` gives a place for.
    pub(super) fn walk(
        mut self,
        take: &mut dyn FnMut(&Header) -> Option<Columns>,
    ) -> Result<Option<Columns>, Diagnostic> {
        let mut wanted = None;
        while let Some(line) = self.next_line() {
            if line.is_empty() {
                continue;
            }
            let heading = Heading::of(line).ok_or_else(|| self.expected("the header of a matrix", line))?;
            let [columns, rows, form, kind] = heading.numbers;
            let header =
                Header::new(columns, rows, form, kind, heading.name).map_err(|d| d.at_line(self.line))?;
            let mut place = take(&header);
            self.columns(&header, heading.format, &mut place)?;
            if place.is_some() {
                wanted = place;
            }
        }
        Ok(wanted)
    }

    /// All columns of a matrix, and what ends it.
    fn columns(
        &mut self,
        header: &Header,
        format: Format,
        place: &mut Option<Columns>,
    ) -> Result<(), Diagnostic> {
        loop {
            let line = self.next_line().ok_or_else(|| cut_off(&header.name))?;
            let [column, start, words] =
                integers(line).ok_or_else(|| self.expected("column, row and number of words", line))?;
            let at = self.line;
            match header.column(column).map_err(|d| d.at_line(at))? {
                Column::End => {
                    // The number that stands there has a format of its own.
                    let lines = words.clamp(1, 1 << 20).unsigned_abs().div_ceil(format.per_line as u64);
                    return match (0..lines).all(|_| self.next_line().is_some()) {
                        true => Ok(()),
                        false => Err(cut_off(&header.name)),
                    };
                }
                Column::Number(column) if start != 0 => {
                    self.string(header, (column, start, words), format, place)?
                }
                Column::Number(column) => self.strings(header, column, words, format, place)?,
            }
        }
    }

    /// A column as strings of nonzeros.
    fn strings(
        &mut self,
        header: &Header,
        column: u32,
        words: i64,
        format: Format,
        place: &mut Option<Columns>,
    ) -> Result<(), Diagnostic> {
        let per_value = if header.is_single() { 1 } else { 2 };
        let mut left = words;
        while left > 0 {
            let line = self.next_line().ok_or_else(|| cut_off(&header.name))?;
            let (start, length, head) = if header.is_big {
                let [length, start] = integers(line).ok_or_else(|| self.expected("length and row", line))?;
                (start, length.saturating_sub(1), 2)
            } else {
                let [word] =
                    integers(line).ok_or_else(|| self.expected("length and row in one number", line))?;
                let (start, length) = Header::unpacked(word);
                (start, length, 1)
            };
            if length < per_value || length % per_value != 0 || length > left {
                return Err(self.expected("a string of the column", line));
            }
            self.string(header, (column, start, length / per_value), format, place)?;
            left -= length + head;
        }
        Ok(())
    }

    /// Values below one another: column, first row, number of values.
    fn string(
        &mut self,
        header: &Header,
        (column, start, count): (u32, i64, i64),
        format: Format,
        place: &mut Option<Columns>,
    ) -> Result<(), Diagnostic> {
        let line = self.line;
        let (count, text) = self.numbers(header, count, format)?;
        let Some(columns) = place else { return Ok(()) };
        let first = header.first_row(start, count).map_err(|d| d.at_line(line))?;
        let mut row = first;
        for (k, line) in text.iter().enumerate() {
            for field in line.chunks(format.width) {
                let at = self.line + 1 + k - text.len();
                let number = field.trim_ascii();
                let value = real(number).filter(|_| field.len() == format.width).ok_or_else(|| {
                    let message = format!(
                        "expected a number of {} characters, found `{}`",
                        format.width,
                        excerpt(field)
                    );
                    Diagnostic::new(Code::MatrixSyntax, message).at_line(at).with_help("write the file again")
                })?;
                columns.written = columns.written.max(written_digits(number));
                columns.push(row, column, value).map_err(|d| d.at_line(at))?;
                row += 1;
            }
        }
        Ok(())
    }

    /// The lines of some numbers, each with as many characters as its numbers take.
    fn numbers(
        &mut self,
        header: &Header,
        count: i64,
        format: Format,
    ) -> Result<(usize, Vec<&'a [u8]>), Diagnostic> {
        let count = usize::try_from(count).ok().filter(|count| *count > 0);
        let count = count.ok_or_else(|| {
            Diagnostic::new(Code::MatrixSyntax, "a column has no values").at_line(self.line)
        })?;
        let mut lines = Vec::new();
        let mut left = count;
        while left > 0 {
            let line = self.next_line().ok_or_else(|| cut_off(&header.name))?;
            let here = left.min(format.per_line);
            let width = here * format.width;
            if line.len() != width {
                return Err(self.expected(&format!("{here} numbers of {} characters", format.width), line));
            }
            lines.push(line);
            left -= here;
        }
        Ok((count, lines))
    }

    fn next_line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = memchr::memchr(b'\n', self.rest);
        let (line, rest) = match end {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &self.rest[self.rest.len()..]),
        };
        self.rest = rest;
        self.line += 1;
        Some(line.trim_ascii_end())
    }

    fn expected(&self, what: &str, line: &[u8]) -> Diagnostic {
        let message = format!("expected {what}, found `{}`", excerpt(line));
        let diagnostic = Diagnostic::new(Code::MatrixSyntax, message).at_line(self.line);
        diagnostic.with_help("write the file again with OUTPUT4")
    }
}

/// Whole numbers that fill a line: between blanks, or in fields of 8 or 16 characters.
fn integers<const N: usize>(line: &[u8]) -> Option<[i64; N]> {
    let apart: Option<Vec<i64>> =
        line.split(|b| *b == b' ').filter(|word| !word.is_empty()).map(whole).collect();
    if let Some(Ok(numbers)) = apart.map(<[i64; N]>::try_from) {
        return Some(numbers);
    }
    [8, 16].into_iter().find_map(|width| {
        let fields: Option<Vec<i64>> = line.chunks(width).map(|field| whole(field.trim_ascii())).collect();
        <[i64; N]>::try_from(fields.filter(|_| line.len() == N * width)?).ok()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_and_lines_of_numbers_are_told_apart() {
        assert!(begins(b"      31      25       2       2RMAT    1P,5E16.9\n       2"));
        assert!(begins(b"              31             -25       2       2RMAT    1P,3E23.16|I16\n"));
        for other in ["3 3 3\n", "%%MatrixMarket matrix coordinate real general\n", "", "node,x,y,z\n"] {
            assert!(!begins(other.as_bytes()), "{other}");
        }
        assert_eq!(integers::<3>(b"       2       7      17"), Some([2, 7, 17]));
        assert_eq!(integers::<3>(b"       21234567812345678"), Some([2, 12_345_678, 12_345_678]));
        assert_eq!(integers::<3>(b"       2       7"), None);
        assert_eq!(Header::unpacked(196_615), (7, 2));
    }
}
