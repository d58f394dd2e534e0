//! Record groups of a file, read like MBDyn: for each group the count of numbers given by the header. MBDyn
//! silently skips further text after the numbers; this reader records it.

use crate::import::digits::Digits;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{self, line_number};
use std::collections::BTreeMap;
use std::path::Path;

/// Beginning of the last line.
const END: &str = "** END OF FILE";
/// Beginning of the comment in files of flexbody for a mass that does not commute with rotations.
const GENERAL_MASS: &str = "** GENERAL MASS";

/// Groups required by MBDyn.
const REQUIRED: [usize; 8] = [1, 2, 5, 6, 7, 8, 9, 10];

/// Contents of a file.
#[derive(Default)]
pub(crate) struct Records {
    /// Word before the counts; MBDyn ignores it.
    pub(crate) revision: String,
    pub(crate) n_nodes: usize,
    pub(crate) n_modes: usize,
    pub(crate) labels: Vec<String>,
    /// Shapes: six numbers for each node of each mode.
    pub(crate) shapes: Vec<f64>,
    /// Numbers of the groups without special structure, by group.
    numbers: BTreeMap<usize, Vec<f64>>,
    /// Index and matrix of group 19.
    pub(crate) stiffening: Vec<(usize, Vec<f64>)>,
    /// True if the file states that record groups 9 and 18 need not agree.
    pub(crate) general: bool,
    /// True if the last line of the file is present.
    pub(crate) ended: bool,
    pub(crate) digits: Digits,
    /// Text that MBDyn skips, with the preceding record group; `None` before the first group.
    pub(crate) skipped: Vec<(Option<usize>, Surplus)>,
}

impl Records {
    pub(crate) fn read(file: &InputFile) -> Result<Self> {
        let text = std::str::from_utf8(file.bytes()).map_err(|e| {
            let line = line_number(file.bytes(), e.valid_up_to());
            Words::new(file.path(), "").refuse_at(line, "the file is not UTF-8 text")
        })?;
        let mut words = Words::new(file.path(), text);
        let mut records = Self::default();
        let mut seen: Vec<usize> = Vec::new();
        let mut rejected = 0;
        while !records.ended {
            let line = words.at();
            let Some(text) = words.take_line() else { break };
            let Some(title) = text.strip_prefix(GROUP) else {
                records.comment(line, text, seen.last().copied());
                continue;
            };
            let group = group_number(title, &seen).map_err(|what| words.refuse_at(line, what))?;
            seen.push(group);
            if group == 1 {
                rejected = records.header(&mut words)?;
            } else {
                records.group(group, rejected, line, &mut words)?;
            }
            records.skip(Some(group), words.surplus());
        }
        let missing: Vec<String> =
            REQUIRED.iter().filter(|group| !seen.contains(group)).map(usize::to_string).collect();
        if !missing.is_empty() {
            return Err(words.incomplete(format!(
                "the file has no record groups {}, which are required",
                missing.join(", ")
            )));
        }
        records.digits = words.digits;
        Ok(records)
    }

    /// Processes a line between record groups; `group` is the previous group.
    fn comment(&mut self, line: usize, text: &str, group: Option<usize>) {
        self.ended = text.starts_with(END);
        self.general |= text.starts_with(GENERAL_MASS);
        if !text.starts_with("**") {
            self.skip(group, Surplus::of(line, text));
        }
    }

    /// Records words at a place where none are expected.
    fn skip(&mut self, group: Option<usize>, surplus: Surplus) {
        if surplus.words == 0 {
            return;
        }
        match self.skipped.last_mut() {
            Some((last, found)) if *last == group && found.numbers == surplus.numbers => {
                found.words += surplus.words;
                found.zero &= surplus.zero;
            }
            _ => self.skipped.push((group, surplus)),
        }
    }

    /// Reads record group 1. Returns the number of rejected modes, whose shapes come first.
    fn header(&mut self, words: &mut Words<'_>) -> Result<usize> {
        const WHAT: &str = "record group 1";
        words.take_line();
        self.revision = words.expect(WHAT)?.to_owned();
        self.n_nodes = words.count(WHAT)?;
        let (mut modes, mut rejected) = (0usize, 0);
        for kind in 0..4 {
            let count = words.count(WHAT)?;
            if kind < 3 {
                modes = modes.saturating_add(count);
            } else {
                rejected = count;
            }
        }
        self.n_modes = modes.checked_sub(rejected).filter(|modes| *modes > 0).ok_or_else(|| {
            words.refuse(format!(
                "{WHAT} leaves no mode: it states {modes} modes, of which {rejected} are rejected"
            ))
        })?;
        Ok(rejected)
    }

    fn group(&mut self, group: usize, rejected: usize, line: usize, words: &mut Words<'_>) -> Result<()> {
        let (n, nf) = (self.n_nodes, self.n_modes);
        let square = nf.saturating_mul(nf);
        let what = format!("record group {group}");
        let before = words.digits;
        match group {
            2 => {
                while self.labels.len() < n {
                    let label = words.expect(&what)?.to_owned();
                    self.labels.push(label);
                }
            }
            8 => self.shapes(rejected, words)?,
            19 => {
                for _ in 0..words.count(&what)? {
                    let index = words.count(&what)?;
                    self.stiffening.push((index, words.numbers(square, &what)?));
                }
            }
            _ => {
                let count = match group {
                    3 | 4 => nf,
                    5..=7 => n,
                    9 | 10 | 13 => square,
                    11 => n.saturating_mul(6),
                    12 => 13,
                    14 | 15 => nf.saturating_mul(3),
                    16 => nf.saturating_mul(9),
                    17 => square.saturating_mul(3),
                    18 => square.saturating_mul(9),
                    _ => {
                        return Err(
                            words.refuse_at(line, format!("{what} is unknown: groups are numbered 1 to 19"))
                        );
                    }
                };
                let values = words.numbers(count, &what)?;
                self.numbers.insert(group, values);
            }
        }
        // Coordinates and initial values may have few digits on purpose, so that their digits do not count.
        if matches!(group, 2..=7) {
            words.digits = before;
        }
        Ok(())
    }

    fn shapes(&mut self, rejected: usize, words: &mut Words<'_>) -> Result<()> {
        const WHAT: &str = "record group 8";
        let numbers_per_mode = self.n_nodes.saturating_mul(6);
        for mode in 0..rejected.saturating_add(self.n_modes) {
            words
                .take_title()
                .map_err(|line| words.refuse_at(line, format!("{WHAT}: mode {} has no title", mode + 1)))?;
            let values = words.numbers(numbers_per_mode, WHAT)?;
            if mode >= rejected {
                self.shapes.extend(values);
            }
            self.skip(Some(8), words.surplus_of_line());
        }
        Ok(())
    }

    /// Returns half a unit of the last digit of a number of size one; 0 if the file has too few numbers to
    /// tell.
    pub(crate) fn rounding(&self) -> f64 {
        if self.digits.are_few() { 0.0 } else { self.digits.rounding(1.0) }
    }

    /// Returns the numbers of a group.
    pub(crate) fn get(&self, group: usize) -> Option<&[f64]> {
        self.numbers.get(&group).map(Vec::as_slice)
    }

    /// Returns true if the group is present.
    pub(crate) fn has(&self, group: usize) -> bool {
        self.numbers.contains_key(&group) || group == 19 && !self.stiffening.is_empty()
    }

    /// Returns a component of a shape: 0 to 2 translation, 3 to 5 rotation.
    pub(crate) fn shape(&self, node: usize, component: usize, mode: usize) -> f64 {
        self.shapes[(mode * self.n_nodes + node) * 6 + component]
    }

    /// Returns the position of a node; groups 5 to 7 are required.
    pub(crate) fn position(&self, node: usize) -> [f64; 3] {
        [5, 6, 7].map(|group| self.get(group).map_or(f64::NAN, |values| values[node]))
    }
}

/// Returns the number in the title of a record group, after checking that it may follow the groups in `seen`.
fn group_number(title: &str, seen: &[usize]) -> std::result::Result<usize, String> {
    let digits = title.trim_start();
    let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    let Ok(group) = digits[..end].parse::<usize>() else {
        return Err("a record group has no number".to_owned());
    };
    if seen.contains(&group) {
        return Err(format!("record group {group} occurs twice"));
    }
    if seen.is_empty() && group != 1 {
        return Err(format!("record group {group} precedes record group 1, which has the counts"));
    }
    Ok(group)
}

// Words and lines of a file by the text scanner, with the rules of MBDyn: fields that touch, comments, and words that
// are skipped. Numbers are those of C++, which has no exponent with the letter D.

/// First words of a record group.
pub(crate) const GROUP: &str = "** RECORD GROUP ";

/// Reading position in the text.
struct Words<'t> {
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

    fn refuse_at(&self, line: usize, what: impl Into<String>) -> Error {
        Diagnostic::new(Code::ForeignUnreadable, what).in_file(self.path).at_line(line).into()
    }

    pub(crate) fn incomplete(&self, what: impl Into<String>) -> Error {
        Diagnostic::new(Code::ForeignIncomplete, what).in_file(self.path).into()
    }

    /// Returns the rest of the line and advances to the next line.
    fn take_line(&mut self) -> Option<&'t str> {
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
    fn surplus_of_line(&mut self) -> Surplus {
        let line = self.at();
        Surplus::of(line, self.take_line().unwrap_or(""))
    }

    /// Consumes the title of a mode: a comment, or a blank line before the numbers. The error is the line
    /// where the title should be.
    fn take_title(&mut self) -> std::result::Result<(), usize> {
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
