//! Data lines: a fast path for the form of nearly all files, and a slow path that reads every dialect and describes
//! errors. The fast path goes from byte to byte, without finding the line and its fields first; the slow path has them
//! from the text scanner.

use super::{COUNTED, Entry, most_entries, written_digits};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{BadLines, excerpt, expected, line_end, real, words};

/// Limits from the header that apply to every line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub n: u32,
    pub integer: bool,
}

/// Parsed piece of a file.
#[derive(Debug, Default)]
pub(super) struct EntryLines {
    pub entries: Vec<Entry>,
    pub lines: usize,
    /// Bad lines, numbered from 1 within the piece.
    pub bad: BadLines,
    /// First lines (from 1) with a nonzero entry below and above the diagonal.
    pub lower: Option<usize>,
    pub upper: Option<usize>,
    /// Largest number of written significant digits among the first entries of the piece.
    pub written: u8,
}

/// Parses whole lines.
pub(super) fn parse(text: &[u8], limits: Limits) -> EntryLines {
    let mut piece = EntryLines { entries: Vec::with_capacity(most_entries(text)), ..EntryLines::default() };
    let mut at = 0;
    while at < text.len() {
        piece.lines += 1;
        at = skip_blanks(text, at);
        if let Some((entry, number, next)) = fast(text, at, limits) {
            piece.push(entry, number);
            at = next;
            continue;
        }
        let end = line_end(text, at);
        let line = text[at..end].trim_ascii();
        if !line.is_empty() && line[0] != b'%' {
            match slow(line, limits) {
                Ok((entry, number)) => piece.push(entry, number),
                Err(bad) => piece.bad.add(bad.at_line(piece.lines)),
            }
        }
        at = end;
    }
    piece
}

impl EntryLines {
    fn push(&mut self, entry: Entry, number: &[u8]) {
        if self.entries.len() < COUNTED && entry.value != 0.0 {
            self.written = self.written.max(written_digits(number));
        }
        if entry.row != entry.col && entry.value != 0.0 {
            let side = if entry.row > entry.col { &mut self.lower } else { &mut self.upper };
            side.get_or_insert(self.lines);
        }
        self.entries.push(entry);
    }
}

/// Parses `row col value` with blanks, plain exponents and a line end; returns `None` for other forms. Returns also the
/// number as written and the start of the next line.
fn fast(text: &[u8], at: usize, limits: Limits) -> Option<(Entry, &[u8], usize)> {
    let (row, at) = fast_index(text, at, limits.n)?;
    let (col, at) = fast_index(text, at, limits.n)?;
    let (value, length) = fast_float2::parse_partial::<f64, _>(&text[at..]).ok()?;
    let end = skip_blanks(text, at + length);
    if !value.is_finite()
        || text.get(end).is_some_and(|&b| b != b'\n')
        || (limits.integer && value.fract() != 0.0)
    {
        return None;
    }
    Some((Entry { row, col, value }, &text[at..at + length], end + 1))
}

/// Parses an index from 1 to n with blanks after it. Returns it from 0.
fn fast_index(text: &[u8], start: usize, n: u32) -> Option<(u32, usize)> {
    let (mut index, mut at) = (0u64, start);
    while let Some(digit @ b'0'..=b'9') = text.get(at) {
        index = index * 10 + u64::from(digit - b'0');
        at += 1;
        if at - start > 10 {
            return None;
        }
    }
    let next = skip_blanks(text, at);
    (next > at && index >= 1 && index <= u64::from(n)).then(|| (index as u32 - 1, next))
}

fn skip_blanks(text: &[u8], mut at: usize) -> usize {
    while matches!(text.get(at), Some(b' ' | b'\t' | b'\r')) {
        at += 1;
    }
    at
}

/// Parses a trimmed line with content in any dialect.
fn slow(line: &[u8], limits: Limits) -> Result<(Entry, &[u8]), Diagnostic> {
    let content = line.split(|&b| b == b'%').next().unwrap_or(line); // a comment may follow the value
    let fields: Vec<&[u8]> = words(content).take(5).collect();
    let &[row, col, number] = fields.as_slice() else {
        return Err(expected(Code::MatrixSyntax, "row, column and value", line));
    };
    let (row, col) = (index(row, "row", limits.n)?, index(col, "column", limits.n)?);
    let value = real(number).ok_or_else(|| {
        let message = format!("value `{}` is not a number", excerpt(number));
        let bad = Diagnostic::new(Code::MatrixSyntax, message);
        if number.contains(&b',') { bad.with_help("write numbers with a decimal point") } else { bad }
    })?;
    let place = format!("entry ({}, {})", row + 1, col + 1);
    if !value.is_finite() {
        return Err(Diagnostic::new(Code::MatrixNotFinite, format!("{place} is `{}`", excerpt(number))));
    }
    if limits.integer && value.fract() != 0.0 {
        let message = format!("{place} is `{}` in a matrix declared integer", excerpt(number));
        let help = "write `real` instead of `integer` in the first line";
        return Err(Diagnostic::new(Code::MatrixSyntax, message).with_help(help));
    }
    Ok((Entry { row, col, value }, number))
}

fn index(field: &[u8], which: &str, n: u32) -> Result<u32, Diagnostic> {
    let text = std::str::from_utf8(field).ok();
    match text.and_then(|t| t.parse::<i128>().ok()) {
        Some(index) if index >= 1 && index <= i128::from(n) => Ok((index - 1) as u32),
        Some(index) => {
            let message = format!("{which} {index} is out of range, expected 1 to {n}");
            Err(Diagnostic::new(Code::MatrixIndex, message))
        }
        None => {
            let message = format!("{which} `{}` is not a whole number", excerpt(field));
            Err(Diagnostic::new(Code::MatrixSyntax, message))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { n: 9, integer: false };

    #[test]
    fn the_fast_and_the_slow_path_agree() {
        for text in ["1 2 3.5", "9 9 -1e-3", "3 1 0", "4 4 +7", "5 6 1E300"] {
            let (entry, number, next) = fast(text.as_bytes(), 0, LIMITS).expect(text);
            assert_eq!(slow(text.as_bytes(), LIMITS).expect(text), (entry, number));
            assert_eq!(next, text.len() + 1);
        }
    }

    #[test]
    fn the_fast_path_never_reads_into_the_next_line() {
        for text in
            ["1 2\n3 4 5\n", "1\n2 3 4\n", "1 2 3 4\n", "1 2 1e999\n", "0 1 1\n", "10 1 1\n", "1 2 nan\n"]
        {
            assert!(fast(text.as_bytes(), 0, LIMITS).is_none(), "{text:?}");
        }
    }

    #[test]
    fn bad_lines_are_numbered_and_counted() {
        let piece =
            parse(b"% c\n1 1 1\n\n1 2\nx 1 1\n2 2 nan\n1 0 1 % c\n3 3 1 %c\n1 1 1 1\n4 4 z\n", LIMITS);
        assert_eq!(piece.entries.len(), 2);
        assert_eq!((piece.lines, piece.bad.count()), (10, 6));
        let bad = piece.bad.into_diagnostics(Code::MatrixSyntax, "line");
        assert_eq!(bad.iter().filter_map(Diagnostic::line).collect::<Vec<_>>(), [4, 5, 6, 7, 9, 10]);
        assert_eq!(bad[2].code(), Code::MatrixNotFinite);
        assert_eq!(bad[3].code(), Code::MatrixIndex);
    }
}
