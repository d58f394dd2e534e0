//! Text files: a header with the format of the numbers, a line for each column or string, and the numbers, side by side
//! without blanks.

use super::columns::{ColumnRecord, Columns, Header, SINGLE_DIGITS, Stored, cut_off, unpadded};
use crate::digits::written_digits;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Lines, expected, real, whole};

/// Returns true when a file begins with the header of a matrix.
pub(super) fn begins(head: &[u8]) -> bool {
    Lines::of(head).next().is_some_and(|line| Heading::of(line.text).is_some())
}

/// Numbers per line, and the width of each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Format {
    per_line: usize,
    width: usize,
}

/// Header line of a matrix.
struct Heading<'a> {
    /// Numbers of columns and rows, form and type.
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
        let name = unpadded(field(4)?);
        let is_name = name.iter().all(u8::is_ascii_graphic);
        let format = format(line.get(ends[4]..).unwrap_or_default().trim_ascii())?;
        (is_matrix && is_name).then_some(Self { numbers, name, format })
    }
}

/// Parses a format such as `1P,5E16.9` or `3E24.16`; the first is the default for an empty text.
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

/// Returns the positions of the columns of the matrices, and the format of their numbers.
///
/// # Errors
/// FB301, FB303, FB304 for lines that do not belong to a matrix.
pub(super) fn contents(file: &InputFile) -> Result<Vec<(Stored, Format)>, Diagnostic> {
    let mut text = Text { lines: Lines::of(file.bytes()) };
    let mut all = Vec::new();
    while let Some(line) = text.next_line() {
        if line.is_empty() {
            continue;
        }
        let heading = Heading::of(line).ok_or_else(|| text.expected("the header of a matrix", line))?;
        let [columns, rows, form, kind] = heading.numbers;
        let header =
            Header::new(columns, rows, form, kind, heading.name).map_err(|d| d.at_line(text.lines.number))?;
        let mut stored = Stored::new(header);
        loop {
            let (start, above) = (text.lines.at, text.lines.number);
            let (column, values) = match text.column(&stored.header, heading.format, None)? {
                Some(found) => found,
                None => break,
            };
            let end = text.lines.at;
            stored.add(column, values, start..end, above);
        }
        all.push((stored, heading.format));
    }
    Ok(all)
}

/// Returns the entries of some columns of a matrix, below `line` lines.
///
/// # Errors
/// FB301 for lines that cannot be parsed, FB303 for indices outside the matrix, FB306 for values that are not finite.
pub(super) fn columns(
    bytes: &[u8],
    line: usize,
    header: &Header,
    format: Format,
) -> Result<Columns, Diagnostic> {
    let mut text = Text { lines: Lines::below(bytes, line) };
    let mut columns = Columns::with_capacity(bytes.len() / format.width);
    columns.written = if header.is_single() { SINGLE_DIGITS } else { 0 };
    while !text.lines.is_at_end() && text.column(header, format, Some(&mut columns))?.is_some() {}
    Ok(columns)
}

/// State of reading a text file.
struct Text<'a> {
    lines: Lines<'a>,
}

impl<'a> Text<'a> {
    /// Reads the next column of a matrix into `place`. Returns its number and its number of values; `None` at the end
    /// of the matrix.
    fn column(
        &mut self,
        header: &Header,
        format: Format,
        place: Option<&mut Columns>,
    ) -> Result<Option<(u32, usize)>, Diagnostic> {
        let line = self.next_line().ok_or_else(|| cut_off(&header.name))?;
        let [column, start, words] =
            integers(line).ok_or_else(|| self.expected("column, row and number of words", line))?;
        let values = match header.column(column).map_err(|d| d.at_line(self.lines.number))? {
            ColumnRecord::End => {
                // The number after the last column has a separate format.
                let lines = words.clamp(1, 1 << 20).unsigned_abs().div_ceil(format.per_line as u64);
                return if (0..lines).all(|_| self.next_line().is_some()) {
                    Ok(None)
                } else {
                    Err(cut_off(&header.name))
                };
            }
            ColumnRecord::Number(column) if start != 0 => {
                (column, self.string(header, (column, start, words), format, place)?)
            }
            ColumnRecord::Number(column) => (column, self.strings(header, column, words, format, place)?),
        };
        Ok(Some(values))
    }

    /// Reads a column as strings of nonzeros. Returns its number of values.
    fn strings(
        &mut self,
        header: &Header,
        column: u32,
        words: i64,
        format: Format,
        mut place: Option<&mut Columns>,
    ) -> Result<usize, Diagnostic> {
        let per_value = if header.is_single() { 1 } else { 2 };
        // Each string has a line with its start and length, which count as words of the column.
        let (mut left, mut values) = (words, 0);
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
            let string = (column, start, length / per_value);
            values += self.string(header, string, format, place.as_deref_mut())?;
            left -= length + head;
        }
        Ok(values)
    }

    /// Reads consecutive values: column, first row, number of values. Returns the number of values.
    fn string(
        &mut self,
        header: &Header,
        (column, start, count): (u32, i64, i64),
        format: Format,
        mut place: Option<&mut Columns>,
    ) -> Result<usize, Diagnostic> {
        let count = usize::try_from(count).ok().filter(|count| *count > 0);
        let count = count.ok_or_else(|| {
            Diagnostic::new(Code::MatrixSyntax, "a column has no values").at_line(self.lines.number)
        })?;
        let mut row = match place {
            Some(_) => header.first_row(start, count).map_err(|d| d.at_line(self.lines.number))?,
            None => 0,
        };
        let mut left = count;
        while left > 0 {
            let line = self.next_line().ok_or_else(|| cut_off(&header.name))?;
            let here = left.min(format.per_line);
            if line.len() != here * format.width {
                return Err(self.expected(&format!("{here} numbers of {} characters", format.width), line));
            }
            if let Some(columns) = place.as_deref_mut() {
                for field in line.chunks_exact(format.width) {
                    self.value(field, (row, column), columns)?;
                    row += 1;
                }
            }
            left -= here;
        }
        Ok(count)
    }

    /// Adds the number in a field of the last line.
    fn value(
        &self,
        field: &[u8],
        (row, column): (u32, u32),
        columns: &mut Columns,
    ) -> Result<(), Diagnostic> {
        /// Number of values, for each of the [`Columns`], whose written digits are counted.
        const MAX_COUNTED_VALUES: usize = 512;
        let number = field.trim_ascii();
        let value = real(number).ok_or_else(|| {
            let what = format!("a number of {} characters", field.len());
            let diagnostic = expected(Code::MatrixSyntax, &what, field).at_line(self.lines.number);
            diagnostic.with_help("write the file again")
        })?;
        if columns.count() < MAX_COUNTED_VALUES {
            columns.written = columns.written.max(written_digits(number));
        }
        columns.push(row, column, value).map_err(|d| d.at_line(self.lines.number))
    }

    fn next_line(&mut self) -> Option<&'a [u8]> {
        self.lines.next().map(|line| line.text)
    }

    fn expected(&self, what: &str, line: &[u8]) -> Diagnostic {
        let diagnostic = expected(Code::MatrixSyntax, what, line).at_line(self.lines.number);
        diagnostic.with_help("write the file again with OUTPUT4")
    }
}

/// Parses integers that fill a line: between blanks, or in fields of 8 or 16 characters.
fn integers<const N: usize>(line: &[u8]) -> Option<[i64; N]> {
    let apart = || exactly(line.split(|b| *b == b' ').filter(|word| !word.is_empty()));
    let in_fields = |width: usize| {
        exactly(line.chunks(width).map(<[u8]>::trim_ascii)).filter(|_| line.len() == N * width)
    };
    apart().or_else(|| in_fields(8)).or_else(|| in_fields(16))
}

/// Parses exactly N integers; returns `None` for another number of words or other words.
fn exactly<'a, const N: usize>(mut words: impl Iterator<Item = &'a [u8]>) -> Option<[i64; N]> {
    let mut numbers = [0; N];
    for number in &mut numbers {
        *number = whole(words.next()?)?;
    }
    words.next().is_none().then_some(numbers)
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
