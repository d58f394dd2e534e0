//! Words and lines of a file by the text scanner, with the rules of MBDyn: fields that touch, comments, and words that
//! are skipped. Numbers are those of C++, which has no exponent with the letter D.

use crate::import::digits::Digits;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::scanner;
use std::path::Path;

/// First words of a record group.
pub(crate) const GROUP: &str = "** RECORD GROUP ";

/// Reading position in the text.
pub(crate) struct Words<'t> {
    path: &'t Path,
    text: &'t str,
    words: scanner::Words<'t>,
    /// Number format of the record groups that no program writes with few digits on purpose.
    pub(crate) digits: Digits,
}

impl<'t> Words<'t> {
    pub(crate) fn new(path: &'t Path, text: &'t str) -> Self {
        Self { path, text, words: scanner::Words::of(text.as_bytes()), digits: Digits::default() }
    }

    /// Returns the number of the current line, from 1.
    pub(crate) fn at(&self) -> usize {
        self.words.line_number()
    }

    pub(crate) fn refuse(&self, what: impl Into<String>) -> Error {
        self.refuse_at(self.at(), what)
    }

    pub(crate) fn refuse_at(&self, line: usize, what: impl Into<String>) -> Error {
        Diagnostic::new(Code::ForeignUnreadable, what).in_file(self.path).at_line(line).into()
    }

    pub(crate) fn incomplete(&self, what: impl Into<String>) -> Error {
        Diagnostic::new(Code::ForeignIncomplete, what).in_file(self.path).into()
    }

    /// Returns the rest of the line and advances to the next line.
    pub(crate) fn take_line(&mut self) -> Option<&'t str> {
        let rest = self.rest_of_line();
        let length = self.words.line().len();
        (length > 0).then_some(rest)
    }

    fn rest_of_line(&self) -> &'t str {
        let line = self.words.clone().line();
        self.text[self.words.at..self.words.at + line.len()].trim_end_matches(['\r', '\n'])
    }

    /// Returns the next word, on this line or a later one.
    pub(crate) fn word(&mut self) -> Option<&'t str> {
        let length = self.words.next()?.len();
        Some(&self.text[self.words.at - length..self.words.at])
    }

    /// Returns the next word of an incomplete record; an error at the end of the record group.
    pub(crate) fn expect(&mut self, what: &str) -> Result<&'t str> {
        match self.word() {
            Some(word) if word.starts_with("**") => {
                Err(self.refuse(format!("{what}: the record group ends too early")))
            }
            Some(word) => Ok(word),
            None => {
                let last = scanner::Lines::of(self.text.as_bytes()).count();
                Err(self.refuse_at(last, format!("{what}: the file ends too early")))
            }
        }
    }

    /// Returns the next number. Adjacent Fortran fields without a blank are separated where the next number
    /// begins.
    pub(crate) fn number(&mut self, what: &str) -> Result<f64> {
        let word = self.expect(what)?;
        let (word, touching) = word.split_at(end_of_number(word));
        let could_be_exponent = |part: &str| part.bytes().skip(1).all(|b| b.is_ascii_digit());
        if !touching.is_empty() && !word.contains(['e', 'E']) && could_be_exponent(touching) {
            return Err(self.refuse(format!(
                "{what}: `{word}{touching}` is not a finite number (MBDyn reads it as two numbers): write the letter of the exponent"
            )));
        }
        if !touching.is_empty() {
            self.words.at -= touching.len();
        }
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.digits.see(word);
                Ok(value)
            }
            _ => Err(self.refuse(format!("{what}: expected a finite number, found {word:?}"))),
        }
    }

    /// Returns `count` numbers. The memory grows with the numbers in the file, because the count in a header
    /// may be wrong.
    pub(crate) fn numbers(&mut self, count: usize, what: &str) -> Result<Vec<f64>> {
        let mut values = Vec::new();
        while values.len() < count {
            values.push(self.number(what)?);
        }
        Ok(values)
    }

    /// Returns an integer that is not negative.
    pub(crate) fn count(&mut self, what: &str) -> Result<usize> {
        let word = self.expect(what)?;
        word.parse().map_err(|_| self.refuse(format!("{what}: expected a count, found {word:?}")))
    }

    /// Returns the words up to the next comment, which is not consumed; none are expected after a complete
    /// record group.
    pub(crate) fn surplus(&mut self) -> Surplus {
        let mut found = Surplus::of(self.at(), "");
        while !self.rest_of_line().trim_start().starts_with("**") {
            let line = self.at();
            let Some(text) = self.take_line() else { break };
            found.see(line, text);
        }
        found
    }

    /// Returns the words up to the end of the line where none are expected.
    pub(crate) fn surplus_of_line(&mut self) -> Surplus {
        let line = self.at();
        Surplus::of(line, self.take_line().unwrap_or(""))
    }

    /// Consumes the title of a mode: a comment, or a blank line before the numbers. The error is the line
    /// where the title should be.
    pub(crate) fn take_title(&mut self) -> std::result::Result<(), usize> {
        let first = self.at();
        while self.rest_of_line().trim().is_empty() && self.take_line().is_some() {}
        let title = self.rest_of_line();
        if title.starts_with("**") && !title.starts_with(GROUP) {
            self.take_line();
            return Ok(());
        }
        if self.at() > first && !title.starts_with("**") { Ok(()) } else { Err(first) }
    }
}

/// Words at a place where none are expected.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Surplus {
    /// Line of the first word.
    pub(crate) line: usize,
    pub(crate) words: usize,
    /// True if all of the words are zeros.
    pub(crate) zero: bool,
    /// True if all of the words are numbers.
    pub(crate) numbers: bool,
}

impl Surplus {
    /// Returns the words of a line.
    pub(crate) fn of(line: usize, text: &str) -> Self {
        let mut found = Self { line, words: 0, zero: true, numbers: true };
        found.see(line, text);
        found
    }

    fn see(&mut self, line: usize, text: &str) {
        for word in text.split_whitespace() {
            if self.words == 0 {
                self.line = line;
            }
            self.words += 1;
            let number = word.parse::<f64>().ok();
            self.zero &= number == Some(0.0);
            self.numbers &= number.is_some();
        }
    }
}

/// Returns the length in bytes of the number at the beginning of a word: up to a sign that is neither the
/// first character nor follows the letter of an exponent.
fn end_of_number(word: &str) -> usize {
    let bytes = word.as_bytes();
    let is_next = |&at: &usize| matches!(bytes[at], b'+' | b'-') && !matches!(bytes[at - 1], b'e' | b'E');
    (1..bytes.len()).find(is_next).unwrap_or(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_touch_are_two() {
        let numbers = |text: &str, count| Words::new(Path::new("body.fem"), text).numbers(count, "group 9");
        assert_eq!(
            numbers("-0.12E+01-0.5E-01+3 .5\n1.5-2.5", 6).expect("six"),
            [-1.2, -0.05, 3.0, 0.5, 1.5, -2.5]
        );
        let error = numbers("1.2345678901-101 2", 2).expect_err("an exponent without its letter");
        assert!(error.to_string().contains("letter of the exponent"), "{error}");
    }
}
