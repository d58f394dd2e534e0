//! The text scanner behind the line readers: lines with their numbers, words across lines, fields by separator or
//! column, numbers, excerpts for messages, and the collector of bad lines.
//!
//! Blanks are those of ASCII. A reader adds what its format alone has: comments, keywords and continuations.

use crate::diagnostic::{Code, Diagnosed, Diagnostic};
use std::cell::Cell;

/// Returns the text, or its beginning, in printable form for a message.
pub fn excerpt(text: &[u8]) -> String {
    const MAX_CHARACTERS: usize = 60;
    match std::str::from_utf8(text) {
        Ok(text) if text.len() <= MAX_CHARACTERS && !text.contains(|c: char| c.is_control() && c != '\t') => {
            text.to_owned()
        }
        _ if text.len() <= MAX_CHARACTERS => text.escape_ascii().to_string(),
        _ => format!("{}...", text[..MAX_CHARACTERS].escape_ascii()),
    }
}

/// Returns the diagnostic about unexpected text.
pub fn expected(code: Code, what: &str, found: &[u8]) -> Diagnostic {
    Diagnostic::new(code, format!("expected {what}, found `{}`", excerpt(found)))
}

/// Returns the text without the byte order mark of UTF-8; `None` for UTF-16.
pub fn without_mark(text: &[u8]) -> Option<&[u8]> {
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
        return None;
    }
    Some(text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text))
}

// Lines with their numbers, and words across lines.

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

// Fields of a line, by separator or by column.

/// Returns the words of a text, separated by blanks.
#[inline]
pub fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Returns the field of a line in these columns, trimmed; empty if the line is shorter.
#[inline]
pub fn field(line: &[u8], columns: std::ops::Range<usize>) -> &[u8] {
    line.get(columns.start..columns.end.min(line.len())).unwrap_or_default().trim_ascii()
}

/// Separator of the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// One byte; two of them in a row have an empty field between them.
    Byte(u8),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    /// Returns the separator of a line: a semicolon, a tab, a comma or, without any of these, blanks.
    pub fn of(line: &[u8]) -> Self {
        [b';', b'\t', b','].into_iter().find(|byte| line.contains(byte)).map_or(Self::Blanks, Self::Byte)
    }

    /// Replaces `fields` by the fields of the line, without surrounding blanks and quotes. Separators inside quotes do
    /// not count.
    pub fn split_into<'a>(self, line: &'a [u8], fields: &mut Vec<&'a [u8]>) {
        fields.clear();
        let separates = |byte: u8| match self {
            Self::Byte(separator) => byte == separator,
            Self::Blanks => byte == b' ' || byte == b'\t',
        };
        let (mut from, mut quoted) = (0, false);
        for (at, &byte) in line.iter().enumerate() {
            quoted ^= byte == b'"';
            if separates(byte) && !quoted {
                fields.push(unquoted(&line[from..at]));
                from = at + 1;
            }
        }
        fields.push(unquoted(&line[from..]));
        if self == Self::Blanks {
            fields.retain(|field| !field.is_empty());
        }
    }

    /// Returns the fields of a line as [`Self::split_into`] does.
    pub fn split(self, line: &[u8]) -> Vec<&[u8]> {
        let mut fields = Vec::new();
        self.split_into(line, &mut fields);
        fields
    }
}

fn unquoted(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).map_or(field, <[u8]>::trim_ascii)
}

// Numbers in fields.

/// Returns the whole number in a field; `None` if it is none.
#[inline]
pub fn whole(field: &[u8]) -> Option<i64> {
    /// Number of digits that fit into an i64, whichever digits they are.
    const MAX_DIGITS: usize = 18;
    let digits = match field {
        [b'+' | b'-', digits @ ..] => digits,
        digits => digits,
    };
    if digits.is_empty() || digits.len() > MAX_DIGITS {
        return std::str::from_utf8(field).ok()?.parse().ok();
    }
    let mut number = 0;
    for digit in digits {
        number = 10 * number + i64::from(digit.is_ascii_digit().then(|| digit - b'0')?);
    }
    Some(if field[0] == b'-' { -number } else { number })
}

/// Returns the whole number in a field. `3.0` and `3e0`, as numerical tools write them, are accepted.
#[inline]
pub fn integer(field: &[u8]) -> Option<i64> {
    whole(field).or_else(|| {
        let value = fast_float2::parse::<f64, _>(field).ok()?;
        // Beyond 2^53 a float does not determine the whole number.
        (value.fract() == 0.0 && value.abs() <= 9_007_199_254_740_992.0).then_some(value as i64)
    })
}

/// Returns the number in a field. The exponent may have the letter D, as Fortran writes it.
#[inline]
pub fn number(field: &[u8]) -> Option<f64> {
    match exponent_letter(field).filter(|&at| matches!(field[at], b'd' | b'D')) {
        Some(at) => with_exponent(&field[..at], &field[at + 1..]),
        None => fast_float2::parse(field).ok(),
    }
}

/// Returns the number in a field in any form of Fortran: `1.0D+05`, `1.0Q5`, and `1.0-105` of exponents with three
/// digits. In fields without a separator or column of their own the last form is ambiguous: see [`number`].
#[inline]
pub fn real(field: &[u8]) -> Option<f64> {
    if let Some(at) = exponent_letter(field).filter(|&at| matches!(field[at], b'd' | b'D' | b'q' | b'Q')) {
        return with_exponent(&field[..at], &field[at + 1..]);
    }
    if let Ok(value) = fast_float2::parse(field) {
        return Some(value);
    }
    let sign = (1..field.len()).find(|&k| matches!(field[k], b'+' | b'-'))?;
    if !matches!(field[sign - 1], b'0'..=b'9' | b'.') {
        return None;
    }
    with_exponent(&field[..sign], &field[sign..])
}

/// Returns the position of the last byte that is neither a digit nor a sign: only those follow the letter of an
/// exponent.
#[inline]
fn exponent_letter(field: &[u8]) -> Option<usize> {
    field.iter().rposition(|b| !matches!(b, b'0'..=b'9' | b'+' | b'-'))
}

/// Parses a mantissa and an exponent with the letter E between them.
fn with_exponent(mantissa: &[u8], exponent: &[u8]) -> Option<f64> {
    let length = mantissa.len() + 1 + exponent.len();
    let (mut short, mut long) = ([0; 64], Vec::new());
    let text = match short.get_mut(..length) {
        Some(text) => text,
        None => {
            long.resize(length, 0);
            &mut long[..]
        }
    };
    text[..mantissa.len()].copy_from_slice(mantissa);
    text[mantissa.len()] = b'e';
    text[mantissa.len() + 1..].copy_from_slice(exponent);
    fast_float2::parse(&*text).ok()
}

// Collector of bad lines.

/// Bad lines of a file: the first few one by one, and the number of others.
#[derive(Debug, Clone, Default)]
pub struct BadLines {
    shown: Vec<Diagnostic>,
    /// First one that is only counted.
    next: Option<Diagnostic>,
    count: usize,
}

impl BadLines {
    /// Number of bad lines that are reported one by one.
    pub const MAX_SHOWN: usize = 5;

    /// Adds the diagnostic of a line.
    pub fn add(&mut self, diagnostic: Diagnostic) {
        self.count += 1;
        if self.shown.len() < Self::MAX_SHOWN {
            self.shown.push(diagnostic);
        } else {
            self.next.get_or_insert(diagnostic);
        }
    }

    /// Adds the bad lines of the next part of the text, which has `above` lines above it.
    pub fn append(&mut self, part: Self, above: usize) {
        let count = self.count + part.count;
        for diagnostic in part.shown.into_iter().chain(part.next) {
            let line = diagnostic.line().map(|line| line + above);
            self.add(match line {
                Some(line) => diagnostic.at_line(line),
                None => diagnostic,
            });
        }
        self.count = count;
    }

    /// Returns the number of bad lines.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns true if there are no bad lines.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the diagnostics. If there are more bad lines than are shown, the last diagnostic has their number and the
    /// place of the first of them. Its code is `code`, or that of all shown lines if they have one.
    ///
    /// * `line`: word for a line, such as `row`.
    pub fn into_diagnostics(self, code: Code, line: &str) -> Vec<Diagnostic> {
        let more = self.count - self.shown.len();
        let mut all = self.shown;
        let is_common = |next: &Diagnostic| all.iter().all(|shown| shown.code() == next.code());
        let common = self.next.as_ref().filter(|next| is_common(next)).map(Diagnostic::code);
        all.extend(self.next.map(|next| {
            let mut message = match more {
                1 => format!("1 more {line} has errors"),
                _ => format!("{more} more {line}s have errors"),
            };
            if next.line().is_some() {
                message += if more == 1 { ": this line" } else { ", the first of them in this line" };
            }
            let mut counted = match common.filter(|common| *common != code) {
                Some(common) => Diagnostic::new(common, format!("{message}: {}", next.message())),
                None => Diagnostic::new(code, message),
            };
            if let Some(file) = next.file() {
                counted = counted.in_file(file);
            }
            match next.line() {
                Some(line) => counted.at_line(line),
                None => counted,
            }
        }));
        all
    }

    /// Ends the collection.
    ///
    /// # Errors
    /// The diagnostics of [`Self::into_diagnostics`] if there are bad lines.
    pub fn finish(self, code: Code, line: &str) -> Diagnosed<()> {
        if self.is_empty() { Ok(()) } else { Err(self.into_diagnostics(code, line)) }
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

    #[test]
    fn fields_end_with_their_line() {
        let line = b"  12  ab";
        assert_eq!([field(line, 0..4), field(line, 4..12), field(line, 8..12)], [&b"12"[..], b"ab", b""]);
    }

    #[test]
    fn fields_between_separators() {
        for (line, fields) in [
            ("a;b,c;", &["a", "b,c", ""][..]),
            ("\"x, far\" , \" y \",", &["x, far", "y", ""]),
            ("  1 \"2 3\"  4 ", &["1", "2 3", "4"]),
            ("1\t\t2", &["1", "", "2"]),
        ] {
            let found = Separator::of(line.as_bytes()).split(line.as_bytes());
            assert_eq!(found, fields.iter().map(|field| field.as_bytes()).collect::<Vec<_>>(), "{line}");
        }
    }

    #[test]
    fn whole_numbers() {
        for (text, value) in [("7", 7), ("-3", -3), ("+4", 4), ("1.0", 1), ("2.000e+01", 20)] {
            assert_eq!(integer(text.as_bytes()), Some(value), "{text}");
            assert_eq!(whole(text.as_bytes()), Some(value).filter(|_| !text.contains('.')), "{text}");
        }
        for text in ["", "1.5", "x", "nan", "inf", "1e300", "1 2", "+", "9223372036854775808"] {
            assert_eq!(integer(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn numbers_in_every_form() {
        for (text, value) in [
            ("1.0D+05", 1e5),
            ("1.0d5", 1e5),
            ("-1.5Q-3", -1.5e-3),
            ("+2.5e+1", 25.0),
            ("1.25-105", 1.25e-105),
            ("-.5+003", -500.0),
            (".5", 0.5),
            ("5.", 5.0),
        ] {
            assert_eq!(real(text.as_bytes()), Some(value), "{text}");
            let is_fortran_only = matches!(text, "-1.5Q-3" | "1.25-105" | "-.5+003");
            assert_eq!(number(text.as_bytes()), Some(value).filter(|_| !is_fortran_only), "{text}");
        }
        for text in ["", "D", "1.0D", "1,5", "--1", "1e5e5", "0x10", "1_000", "+", "1-", "e5", "1.5-2-3"] {
            assert_eq!((real(text.as_bytes()), number(text.as_bytes())), (None, None), "{text}");
        }
    }

    #[test]
    fn parts_have_the_lines_of_the_file() {
        let bad = |lines: std::ops::Range<usize>| {
            let mut bad = BadLines::default();
            lines.for_each(|line| bad.add(Diagnostic::new(Code::TableRow, "bad").at_line(line)));
            bad
        };
        for (first, second) in [(1..4, 1..9), (1..9, 1..4), (1..6, 1..7)] {
            let above = first.end - 1;
            let mut all = bad(first);
            all.append(bad(second), above);
            let count = all.count();
            let found = all.into_diagnostics(Code::TableRow, "row");
            let lines: Vec<Option<usize>> = found.iter().map(Diagnostic::line).collect();
            assert_eq!(lines, [1, 2, 3, 4, 5, 6].map(Some));
            assert!(found[5].message().starts_with(&format!("{} more rows", count - 5)), "{found:?}");
        }
    }
}
