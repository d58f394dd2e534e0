//! Lines with their numbers, and words across lines.

use std::cell::Cell;

/// Line of a text.
#[derive(Debug, Clone, Copy)]
pub struct Line<'a> {
    /// Number of the line, from 1.
    pub number: usize,
    /// Text of the line without its end and trailing blanks.
    pub text: &'a [u8],
}

impl Line<'_> {
    /// Returns the line without blanks around its text; `None` for a blank line.
    #[inline]
    pub fn content(self) -> Option<Self> {
        let text = self.text.trim_ascii_start();
        (!text.is_empty()).then_some(Self { text, ..self })
    }
}

/// Iterator over the lines of a text. Bytes after the last line end count as a line.
#[derive(Debug, Clone)]
pub struct Lines<'a> {
    text: &'a [u8],
    /// Start of the next line.
    pub at: usize,
    /// Number of the last line.
    pub number: usize,
}

impl<'a> Lines<'a> {
    /// Returns the lines of a whole file.
    pub fn of(text: &'a [u8]) -> Self {
        Self::below(text, 0)
    }

    /// Returns true when there are no more lines.
    pub fn is_at_end(&self) -> bool {
        self.at >= self.text.len()
    }

    /// Returns the text below the last line.
    pub fn rest(&self) -> &'a [u8] {
        &self.text[self.at..]
    }

    /// Returns the lines of a part of a file with `above` lines above it.
    pub fn below(text: &'a [u8], above: usize) -> Self {
        Self::starting_at(text, 0, above)
    }

    /// Returns the lines from the byte `at` on, where a line begins with `above` lines above it.
    pub fn starting_at(text: &'a [u8], at: usize, above: usize) -> Self {
        Self { text, at, number: above }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    #[inline]
    fn next(&mut self) -> Option<Line<'a>> {
        if self.is_at_end() {
            return None;
        }
        let end = line_end(self.text, self.at);
        let text = self.text[self.at..end].trim_ascii_end();
        self.at = end;
        self.number += 1;
        Some(Line { number: self.number, text })
    }
}

/// Returns the start of the line below the one at `at`.
#[inline]
pub fn line_end(text: &[u8], at: usize) -> usize {
    memchr::memchr(b'\n', &text[at..]).map_or(text.len(), |length| at + length + 1)
}

/// Returns the number of the line, from 1, with the byte `at`.
pub fn line_number(text: &[u8], at: usize) -> usize {
    1 + memchr::memchr_iter(b'\n', &text[..at]).count()
}

/// Iterator over the words of a text on all its lines.
#[derive(Debug, Clone)]
pub struct Words<'a> {
    text: &'a [u8],
    /// Start of the text that has not been read.
    pub at: usize,
    /// Last place whose line was asked for, and the number of the line: line ends are counted once.
    counted: Cell<(usize, usize)>,
}

impl<'a> Words<'a> {
    /// Returns the words of a whole file.
    pub fn of(text: &'a [u8]) -> Self {
        Self { text, at: 0, counted: Cell::new((0, 1)) }
    }

    /// Returns the text that has not been read.
    pub fn rest(&self) -> &'a [u8] {
        &self.text[self.at..]
    }

    /// Returns the rest of the line, with its end, and moves behind it.
    #[inline]
    pub fn line(&mut self) -> &'a [u8] {
        let start = self.at;
        self.at = line_end(self.text, start);
        &self.text[start..self.at]
    }

    /// Returns the number of the line, from 1, at which the unread text begins.
    pub fn line_number(&self) -> usize {
        let (from, number) = self.counted.get();
        let (from, number) = if from <= self.at { (from, number) } else { (0, 1) };
        let number = number - 1 + line_number(&self.text[from..], self.at - from);
        self.counted.set((self.at, number));
        number
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Some(&rest[start..start + length])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
