//! Lists of Ansys: `PRNSOL,U` or `PRNSOL,DOF` after `SET` for every mode, in one file.

use super::mode_table::{ModeTable, syntax, unexpected, unreadable};
use crate::digits::written_digits;
use flexbody_base::diagnostic::Diagnosed;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::{Line, Lines, excerpt, integer, real, words};
use flexbody_model::DofLabel;
use std::f64::consts::TAU;

/// Returns true when the text has the heading of a list of degrees of freedom.
pub(super) fn recognises(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    text.contains("NODAL DEGREE OF FREEDOM LISTING")
}

/// State of reading.
#[derive(Default)]
struct AnsysListReader {
    table: ModeTable,
    /// Load step and substep of the mode.
    mode: Option<(i64, i64)>,
    /// Directions of the columns below a heading; `None` for the sum and for columns that are no displacement.
    columns: Option<Vec<Option<u8>>>,
}

/// Reads all lists. Pages and lists of one substep belong to one mode.
pub(super) fn read(file: &InputFile) -> Diagnosed<ModeTable> {
    let mut reading = AnsysListReader::default();
    for Line { number: at, text: line } in Lines::of(file.bytes()) {
        let words = numbers_apart(line);
        let first = words.first().map(Vec::as_slice).unwrap_or_default();
        if first == b"LOAD" || first.starts_with(b"FREQ=") || first.starts_with(b"TIME=") {
            reading.head(file, at, line)?;
        } else if first == b"NODE" {
            reading.columns = columns(&words[1..]);
        } else if line.trim_ascii().starts_with(b"THE FOLLOWING DEGREE OF FREEDOM RESULTS") {
            if !line.windows(6).any(|word| word == b"GLOBAL") {
                let message = format!("the list is not along the axes of the model: `{}`", excerpt(line));
                return Err(syntax(file, at, message)
                    .into_iter()
                    .map(|d| d.with_help("set RSYS,0 before PRNSOL"))
                    .collect());
            }
        } else if let Some(node) = integer(first) {
            reading.node(file, at, node, &words[1..])?;
        } else if !words.is_empty() {
            reading.columns = None;
        }
    }
    let AnsysListReader { mut table, .. } = reading;
    if table.len() == 0 {
        let help = "print SET,1,K and PRNSOL,DOF for every mode K";
        return Err(unreadable(file, "no displacements of modes are in the list", help));
    }
    table.digits = table.digits.max(1);
    table.eigenvalue_digits = table.eigenvalue_digits.max(1);
    Ok(table)
}

impl AnsysListReader {
    /// Reads the heading `LOAD STEP=  1  SUBSTEP=  7`, and below it `FREQ= 3907.0   LOAD CASE=   0`.
    fn head(&mut self, file: &InputFile, at: usize, line: &[u8]) -> Diagnosed<()> {
        self.columns = None;
        if let (Some(step), Some(substep)) =
            (behind(line, b"STEP=").and_then(integer), behind(line, b"SUBSTEP=").and_then(integer))
        {
            if self.mode != Some((step, substep)) {
                self.mode = Some((step, substep));
                self.table.begin(None);
            }
        } else if behind(line, b"TIME=").is_some() {
            return Err(syntax(
                file,
                at,
                "the list belongs to a time, expected the modes of a modal analysis",
            ));
        } else if let Some(text) = behind(line, b"FREQ=") {
            let Some(hertz) = real(text) else {
                return Err(unexpected(file, at, "a frequency", line));
            };
            self.table.eigenvalue_digits = self.table.eigenvalue_digits.max(written_digits(text));
            self.table.state((TAU * hertz).powi(2));
        }
        Ok(())
    }

    /// Reads a line of a node.
    fn node(&mut self, file: &InputFile, at: usize, node: i64, words: &[Vec<u8>]) -> Diagnosed<()> {
        let Some(columns) = &self.columns else { return Ok(()) };
        let values: Option<Vec<f64>> = words.iter().map(|word| real(word)).collect();
        let Some(values) = values.filter(|values| values.len() == columns.len()) else {
            let message = format!("expected node {node} with {} values", columns.len());
            return Err(syntax(file, at, message));
        };
        for ((column, value), word) in columns.iter().zip(values).zip(words) {
            if let Some(direction) = *column {
                self.table.set(file, Some(at), DofLabel { node, direction }, value)?;
                self.table.digits = self.table.digits.max(written_digits(word));
            }
        }
        Ok(())
    }
}

/// Returns the directions of the columns `UX UY UZ USUM`, `ROTX ROTY ROTZ RSUM`; `None` if no column has one.
fn columns(names: &[Vec<u8>]) -> Option<Vec<Option<u8>>> {
    const NAMES: [&[u8]; 6] = [b"UX", b"UY", b"UZ", b"ROTX", b"ROTY", b"ROTZ"];
    let direction = |name: &Vec<u8>| (1..).zip(NAMES).find(|(_, known)| name == known).map(|(k, _)| k);
    let directions: Vec<Option<u8>> = names.iter().map(direction).collect();
    directions.iter().any(Option::is_some).then_some(directions)
}

/// Returns the word after a name in a line.
fn behind<'l>(line: &'l [u8], name: &[u8]) -> Option<&'l [u8]> {
    let is_name = |at: &usize| line[*at..].starts_with(name) && (*at == 0 || line[*at - 1] == b' ');
    let at = (0..line.len()).find(is_name)? + name.len();
    words(&line[at..]).next()
}

/// Returns the words of a line. Numbers of full width touch each other: a minus sign after a digit begins the next
/// number.
fn numbers_apart(line: &[u8]) -> Vec<Vec<u8>> {
    let mut apart: Vec<Vec<u8>> = Vec::new();
    for word in words(line) {
        let mut number = Vec::new();
        for (at, &byte) in word.iter().enumerate() {
            if byte == b'-' && at > 0 && (word[at - 1].is_ascii_digit() || word[at - 1] == b'.') {
                apart.push(std::mem::take(&mut number));
            }
            number.push(byte);
        }
        apart.push(number);
    }
    apart
}
