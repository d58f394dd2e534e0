//! The text scanner under the line readers: lines with their numbers, words across lines, fields between columns, and
//! the message about text that is not as expected.

use crate::coordinates::excerpt;
use flexbody_base::diagnostic::{Code, Diagnostic};

/// A line of a text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<'a> {
    /// Number of the line, from 1.
    pub number: usize,
    /// The line without its end and the blanks before it.
    pub text: &'a [u8],
}

/// The lines of a text. Bytes behind the last line end are a line, too.
#[derive(Debug, Clone)]
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    /// Where the next line begins.
    pub at: usize,
    /// Number of the line that was given last.
    pub number: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn of(text: &'a [u8]) -> Self {
        Self::below(text, 0)
    }

    /// True if all lines were given.
    pub(crate) fn is_at_end(&self) -> bool {
        self.at >= self.text.len()
    }

    /// The lines of a part of a file that has so many lines `above`.
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

/// The words of a text that blanks separate.
pub(crate) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The field of a line between two columns, trimmed; empty where the line is shorter.
pub(crate) fn field(line: &[u8], columns: std::ops::Range<usize>) -> &[u8] {
    line.get(columns.start..columns.end.min(line.len())).unwrap_or_default().trim_ascii()
}

/// The words of a text on all of its lines.
#[derive(Debug, Clone)]
pub(crate) struct Words<'a> {
    text: &'a [u8],
    /// Where the text begins that was not given yet.
    pub at: usize,
}

impl<'a> Words<'a> {
    pub(crate) fn of(text: &'a [u8]) -> Self {
        Self { text, at: 0 }
    }

    /// The text that was not given yet.
    pub(crate) fn rest(&self) -> &'a [u8] {
        &self.text[self.at..]
    }

    /// The rest of the line, with its end.
    pub(crate) fn line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let end = memchr::memchr(b'\n', rest).map_or(rest.len(), |end| end + 1);
        self.at += end;
        &rest[..end]
    }

    /// Number of the line, from 1, in which the text that was not given begins.
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

/// The diagnostic about text that is not what was expected.
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
