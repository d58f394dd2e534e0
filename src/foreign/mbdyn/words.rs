//! Lines and blank-separated words of a file, with their places.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::foreign::digits::Digits;
use std::path::Path;

/// A place in the text.
pub(super) struct Words<'t> {
    path: &'t Path,
    lines: Vec<&'t str>,
    /// Index of the line that is read.
    line: usize,
    /// What is left of it.
    rest: &'t str,
    /// Digits of the numbers of record groups that no program writes short on purpose.
    pub(super) digits: Digits,
}

impl<'t> Words<'t> {
    pub(super) fn new(path: &'t Path, text: &'t str) -> Self {
        let lines: Vec<&str> = text.lines().collect();
        let rest = lines.first().copied().unwrap_or("");
        Self { path, lines, line: 0, rest, digits: Digits::default() }
    }

    /// Number of the line that is read, from 1.
    pub(super) fn at(&self) -> usize {
        self.line + 1
    }

    pub(super) fn refuse(&self, what: impl Into<String>) -> Error {
        self.refuse_at(self.at(), what)
    }

    pub(super) fn refuse_at(&self, line: usize, what: impl Into<String>) -> Error {
        Diagnostic::new(Code::ForeignUnreadable, what).in_file(self.path).at_line(line).into()
    }

    pub(super) fn incomplete(&self, what: impl Into<String>) -> Error {
        Diagnostic::new(Code::ForeignIncomplete, what).in_file(self.path).into()
    }

    /// What is left of the line, and on to the next one.
    pub(super) fn take_line(&mut self) -> Option<&'t str> {
        if self.line >= self.lines.len() {
            return None;
        }
        let rest = self.rest;
        self.line += 1;
        self.rest = self.lines.get(self.line).copied().unwrap_or("");
        Some(rest)
    }

    /// The next word, wherever it stands.
    pub(super) fn word(&mut self) -> Option<&'t str> {
        loop {
            let rest = self.rest.trim_start();
            if rest.is_empty() {
                self.take_line()?;
                continue;
            }
            let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
            self.rest = &rest[end..];
            return Some(&rest[..end]);
        }
    }

    /// The next word of a record that is not complete yet.
    pub(super) fn expect(&mut self, what: &str) -> Result<&'t str> {
        match self.word() {
            Some(word) if word.starts_with("**") => {
                Err(self.refuse(format!("{what}: the record group ends too early")))
            }
            Some(word) => Ok(word),
            None => {
                let last = self.lines.len();
                Err(self.refuse_at(last, format!("{what}: the file ends too early")))
            }
        }
    }

    /// The next number.
    pub(super) fn number(&mut self, what: &str) -> Result<f64> {
        let word = self.expect(what)?;
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.digits.see(word);
                Ok(value)
            }
            _ => Err(self.refuse(format!("{what}: {word:?} is no finite number"))),
        }
    }

    /// `count` numbers, as far as the file has them: what a header promises is not believed.
    pub(super) fn numbers(&mut self, count: usize, what: &str) -> Result<Vec<f64>> {
        let mut values = Vec::new();
        while values.len() < count {
            values.push(self.number(what)?);
        }
        Ok(values)
    }

    /// A whole number that is not negative.
    pub(super) fn count(&mut self, what: &str) -> Result<usize> {
        let word = self.expect(what)?;
        word.parse().map_err(|_| self.refuse(format!("{what}: {word:?} is no count")))
    }

    /// The end of a record group: nothing but blanks up to the next comment, which is not taken.
    pub(super) fn end(&mut self, what: &str) -> Result<()> {
        loop {
            let rest = self.rest.trim_start();
            if rest.starts_with("**") || self.line >= self.lines.len() {
                return Ok(());
            }
            if !rest.is_empty() {
                return Err(self.refuse(format!("{what}: more values than the header says")));
            }
            self.take_line();
        }
    }
}
