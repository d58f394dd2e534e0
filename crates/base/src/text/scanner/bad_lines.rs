//! Collector of bad lines.

use crate::diagnostic::{Code, Diagnostic};

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

    /// Returns the diagnostics. If there are more bad lines than are shown, the last diagnostic, with `code`, has their
    /// number and the place of the first of them.
    ///
    /// * `line`: word for a line, such as `row`.
    pub fn into_diagnostics(self, code: Code, line: &str) -> Vec<Diagnostic> {
        let more = self.count - self.shown.len();
        let mut all = self.shown;
        all.extend(self.next.map(|next| {
            let mut message = match more {
                1 => format!("1 more {line} has errors"),
                _ => format!("{more} more {line}s have errors"),
            };
            if next.line().is_some() {
                message += if more == 1 { ": this line" } else { ", the first of them in this line" };
            }
            let mut counted = Diagnostic::new(code, message);
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
    pub fn finish(self, code: Code, line: &str) -> Result<(), Vec<Diagnostic>> {
        if self.is_empty() { Ok(()) } else { Err(self.into_diagnostics(code, line)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
