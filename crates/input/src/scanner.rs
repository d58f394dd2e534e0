//! The text scanner behind the line readers: lines with their numbers, words across lines, fields of fixed columns, and
//! the message about unexpected text.

use crate::coordinates::excerpt;
use flexbody_base::diagnostic::{Code, Diagnostic};

/// Line of a text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<'a> {
    /// Number of the line, from 1.
    pub number: usize,
    /// Text of the line without its end and trailing blanks.
    pub text: &'a [u8],
}

/// Iterator over the lines of a text. Bytes after the last line end count as a line.
#[derive(Debug, Clone)]
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    /// Start of the next line.
    pub at: usize,
    /// Number of the last line.
    pub number: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn of(text: &'a [u8]) -> Self {
        Self::below(text, 0)
    }

    /// Returns true when there are no more lines.
    pub(crate) fn is_at_end(&self) -> bool {
        self.at >= self.text.len()
    }

    /// Returns the lines of a part of a file with `above` lines above it.
    pub(crate) fn below(text: &'a [u8], above: usize) -> Self {
        Self { text, at: 0, number: above }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        let rest = self.text.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = memchr::memchr(b'\n', rest).unwrap_or(rest.len());
        self.at = (self.at + length + 1).min(self.text.len());
        self.number += 1;
        Some(Line { number: self.number, text: rest[..length].trim_ascii_end() })
    }
}

/// Returns the words of a text, separated by blanks.
pub(crate) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Returns the field of a line in these columns, trimmed; empty if the line is shorter.
pub(crate) fn field(line: &[u8], columns: std::ops::Range<usize>) -> &[u8] {
    line.get(columns.start..columns.end.min(line.len())).unwrap_or_default().trim_ascii()
}

/// Iterator over the words of a text on all its lines.
#[derive(Debug, Clone)]
pub(crate) struct Words<'a> {
    text: &'a [u8],
    /// Start of the text that has not been read.
    pub at: usize,
}

impl<'a> Words<'a> {
    pub(crate) fn of(text: &'a [u8]) -> Self {
        Self { text, at: 0 }
    }

    /// Returns the text that has not been read.
    pub(crate) fn rest(&self) -> &'a [u8] {
        &self.text[self.at..]
    }

    /// Returns the rest of the line, with its end, and moves behind it.
    pub(crate) fn line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let end = memchr::memchr(b'\n', rest).map_or(rest.len(), |end| end + 1);
        self.at += end;
        &rest[..end]
    }

    /// Returns the number of the line, from 1, at which the unread text begins.
    pub(crate) fn line_number(&self) -> usize {
        1 + memchr::memchr_iter(b'\n', &self.text[..self.at]).count()
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Some(&rest[start..start + length])
    }
}

/// Returns the diagnostic about unexpected text.
pub(crate) fn expected(code: Code, what: &str, found: &[u8]) -> Diagnostic {
    Diagnostic::new(code, format!("expected {what}, found `{}`", excerpt(found)))
}

#[cfg(test)]
mod tests {
    use super::{Lines, Words, field};

    #[test]
    fn lines_have_numbers_and_no_ends() {
        let of = |text: &'static [u8]| -> Vec<(usize, &[u8])> {
            Lines::below(text, 4).map(|line| (line.number, line.text)).collect()
        };
        assert_eq!(of(b" a \r\n\nb"), [(5, &b" a"[..]), (6, b""), (7, b"b")]);
        assert_eq!(of(b"a\n"), [(5, &b"a"[..])]);
        assert_eq!(of(b""), []);
    }

    #[test]
    fn words_know_their_lines() {
        let mut words = Words::of(b"a b\n\n c rest of\nd");
        let found: Vec<(&[u8], usize)> =
            (0..3).map(|_| (words.next().expect("a word"), words.line_number())).collect();
        assert_eq!(found, [(&b"a"[..], 1), (b"b", 1), (b"c", 3)]);
        assert_eq!((words.line(), words.line_number()), (&b" rest of\n"[..], 4));
        assert_eq!((words.next(), words.next(), words.rest()), (Some(&b"d"[..]), None, &b""[..]));
    }

    #[test]
    fn fields_end_with_their_line() {
        let line = b"  12  ab";
        assert_eq!([field(line, 0..4), field(line, 4..12), field(line, 8..12)], [&b"12"[..], b"ab", b""]);
    }
}
