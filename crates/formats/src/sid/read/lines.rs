//! Lines of a file: keywords and assignments.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner;
use std::path::Path;

/// A line that is not blank.
pub(crate) struct Line<'t> {
    /// Number of the line from 1.
    pub(crate) number: usize,
    /// Text of the line without surrounding blanks.
    pub(crate) text: &'t str,
    /// Text before the first `=`: lower case, words separated by one blank.
    pub(crate) key: String,
    /// Text after the first `=`, without surrounding blanks.
    pub(crate) value: Option<&'t str>,
}

/// Iterator over the lines of a file.
pub(crate) struct Lines<'t> {
    path: &'t Path,
    text: &'t str,
    lines: scanner::Lines<'t>,
    /// Number of the last line returned.
    last: usize,
}

impl<'t> Lines<'t> {
    pub(crate) fn new(path: &'t Path, text: &'t str) -> Self {
        Self { path, text, lines: scanner::Lines::of(text.as_bytes()), last: 0 }
    }

    /// Returns the diagnostic FB730 at a line.
    pub(crate) fn unreadable(&self, line: usize, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Code::ForeignUnreadable, message).in_file(self.path).at_line(line)
    }

    /// Returns the next line; an error if the file ends within `inside`.
    pub(crate) fn next(&mut self, inside: &str) -> Result<Line<'t>, Diagnostic> {
        loop {
            let start = self.lines.at;
            let Some(line) = self.lines.next() else { break };
            let text = self.text[start..start + line.text.len()].trim();
            if text.is_empty() {
                continue;
            }
            self.last = line.number;
            let (key, value) = match text.split_once('=') {
                Some((key, value)) => (key, Some(value.trim())),
                None => (text, None),
            };
            let words: Vec<&str> = key.split_whitespace().collect();
            let key = words.join(" ").to_lowercase();
            return Ok(Line { number: line.number, text, key, value });
        }
        Err(self.unreadable(self.last.max(1), format!("the file ends inside of `{inside}`")))
    }

    /// Returns an error if a line that is not blank follows the end.
    pub(crate) fn finish(mut self) -> Result<(), Diagnostic> {
        match self.next("") {
            Ok(line) => Err(self.unreadable(line.number, "text follows `end part`")),
            Err(_) => Ok(()),
        }
    }

    /// Returns the value of a line as an integer that is not negative.
    pub(crate) fn count(&self, line: &Line<'_>) -> Result<usize, Diagnostic> {
        let value = line.value.unwrap_or("");
        value.parse().map_err(|_| {
            self.unreadable(line.number, format!("`{}` is `{value}`, expected a whole number", line.key))
        })
    }

    /// Returns the value of a line as a finite number, with exponent letter E or D, and its text.
    pub(crate) fn number(&self, line: &Line<'t>) -> Result<(f64, &'t str), Diagnostic> {
        let value = line.value.unwrap_or("");
        match scanner::number(value.as_bytes()) {
            Some(number) if number.is_finite() => Ok((number, value)),
            _ => {
                let message = format!("`{}` is `{value}`, expected a finite number", line.key);
                Err(self.unreadable(line.number, message))
            }
        }
    }
}
