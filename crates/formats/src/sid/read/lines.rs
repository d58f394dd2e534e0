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

// Lines before `part`: the numbers of nodes and modes, and free text.

/// Contents of the lines before `part`.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Head {
    /// Free text after the counts, and the whole text of further lines.
    pub(crate) comment: String,
    /// Numbers of nodes and modes, if stated.
    pub(crate) stated: Option<(usize, usize)>,
}

impl Head {
    /// Reads up to and including `part`. The first line is `21 4 :No. nodes, No. modes:text` or, from
    /// FEMBeam, `3 nodes, 2 modes, text`; further lines are text.
    pub(crate) fn read(lines: &mut Lines<'_>) -> Result<Self, Diagnostic> {
        let mut head: Option<Self> = None;
        loop {
            let line = lines.next("part")?;
            match (line.key.as_str(), &mut head) {
                ("part", head) => return Ok(head.take().unwrap_or_default()),
                ("new modal", _) => {
                    return Err(lines.unreadable(line.number, "`new modal`, expected `part`"));
                }
                (_, Some(head)) => {
                    head.comment.push('\n');
                    head.comment.push_str(line.text);
                }
                (_, head) => {
                    let message = "the first line has no counts of nodes and modes";
                    let first = Self::of_line(line.text);
                    *head = Some(first.ok_or_else(|| lines.unreadable(line.number, message))?);
                }
            }
        }
    }

    fn of_line(line: &str) -> Option<Self> {
        let stated =
            |nodes: &str, modes: &str| Some((nodes.trim().parse().ok()?, modes.trim().parse().ok()?));
        if let Some((nodes, rest)) = line.split_once(" nodes, ")
            && nodes.trim().parse::<usize>().is_ok()
        {
            let (modes, comment) = rest.split_once(',').unwrap_or((rest, ""));
            let modes = modes.strip_suffix(" modes").or_else(|| modes.strip_suffix(" coordinates"))?;
            return Some(Self { comment: comment.trim().to_owned(), stated: Some(stated(nodes, modes)?) });
        }
        let (counts, rest) = line.split_once(':').unwrap_or((line, ""));
        let comment = rest.split_once(':').map_or(rest, |(_, text)| text).trim().to_owned();
        match counts.split_whitespace().collect::<Vec<_>>()[..] {
            [nodes, modes] => Some(Self { comment, stated: Some(stated(nodes, modes)?) }),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_lines_of_three_writers() {
        let head = |line: &str| Head::of_line(line).map(|head| (head.stated, head.comment));
        let expected = |nodes, modes, comment: &str| Some((Some((nodes, modes)), comment.to_owned()));
        assert_eq!(head("21   4  :No. nodes, No. modes:by: PY_SID"), expected(21, 4, "by: PY_SID"));
        assert_eq!(head("3   2"), expected(3, 2, ""));
        let line = "3 nodes, 2 modes, generated by FEMBeam2SID MATLAB script on 22-Nov-2026 04:30:00 by a";
        assert_eq!(
            head(line),
            expected(3, 2, "generated by FEMBeam2SID MATLAB script on 22-Nov-2026 04:30:00 by a")
        );
        assert_eq!(head("3 nodes, 12 coordinates, generated by a"), expected(3, 12, "generated by a"));
        assert_eq!(head("3 nodes, many modes, generated by a"), None);
        assert_eq!(head("3 legs: 4"), None);
    }
}
