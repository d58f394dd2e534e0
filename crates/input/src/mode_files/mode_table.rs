//! Values of modes as read from a file: node by node, mode by mode; and the errors of files of modes.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::expected;
use flexbody_model::{DofLabel, RawModes};
use std::collections::HashMap;

/// Modes of a file, all of the same nodes and directions.
#[derive(Debug, Default)]
pub(super) struct ModeTable {
    labels: Vec<DofLabel>,
    /// Row of each label.
    index: HashMap<DofLabel, usize>,
    modes: Vec<Mode>,
    /// Row after the last one that was set: files list the nodes in one order for every mode.
    next: usize,
    /// Significant digits of the eigenvalues and of the values.
    pub eigenvalue_digits: u8,
    pub digits: u8,
    /// True if values are along the axes of the rows of their nodes.
    along_nodes: bool,
}

#[derive(Debug)]
struct Mode {
    eigenvalue: Option<f64>,
    /// Values by rows; NaN where none is set.
    values: Vec<f64>,
}

impl ModeTable {
    /// Creates a table without modes for values and eigenvalues with these numbers of digits.
    pub(super) fn new(digits: u8, eigenvalue_digits: u8) -> Self {
        Self { digits, eigenvalue_digits, ..Self::default() }
    }

    /// Marks the values as components along the axes of the rows of their nodes.
    pub(super) fn along_nodes(self) -> Self {
        Self { along_nodes: true, ..self }
    }

    /// Begins the next mode.
    pub(super) fn begin(&mut self, eigenvalue: Option<f64>) {
        self.modes.push(Mode { eigenvalue, values: Vec::with_capacity(self.labels.len()) });
        self.next = 0;
    }

    /// Sets the eigenvalue of the last mode.
    pub(super) fn state(&mut self, eigenvalue: f64) {
        if let Some(mode) = self.modes.last_mut() {
            mode.eigenvalue = Some(eigenvalue);
        }
    }

    /// Returns the number of modes.
    pub(super) fn len(&self) -> usize {
        self.modes.len()
    }

    /// Sets a value of the last mode; `line` is its line in a text file.
    ///
    /// # Errors
    /// FB128 for a value that is set twice, or without a mode; FB306 for a value that is not finite.
    pub(super) fn set(
        &mut self,
        file: &InputFile,
        line: Option<usize>,
        label: DofLabel,
        value: f64,
    ) -> Diagnosed<()> {
        let number = self.modes.len();
        let wrong = |code, message: String| {
            let diagnostic = Diagnostic::new(code, message).in_file(file.path());
            Err(vec![match line {
                Some(line) => diagnostic.at_line(line),
                None => diagnostic,
            }])
        };
        let Some(mode) = self.modes.last_mut() else {
            return wrong(Code::ModeFileSyntax, "values come before the first mode".to_owned());
        };
        if !value.is_finite() {
            return wrong(Code::MatrixNotFinite, format!("mode {number} has {value} at {label}"));
        }
        let row = match self.labels.get(self.next) {
            Some(expected) if *expected == label => self.next,
            _ => *self.index.entry(label).or_insert_with(|| {
                self.labels.push(label);
                self.labels.len() - 1
            }),
        };
        if mode.values.len() <= row {
            mode.values.resize(row + 1, f64::NAN);
        }
        if !mode.values[row].is_nan() {
            return wrong(Code::ModeFileSyntax, format!("mode {number} has two values at {label}"));
        }
        mode.values[row] = value;
        self.next = row + 1;
        Ok(())
    }

    /// Returns all modes by the same rows.
    ///
    /// # Errors
    /// FB128 if there is no mode, or if modes have different nodes.
    pub(super) fn into_modes(mut self, file: &InputFile, source: SourceFile) -> Diagnosed<RawModes> {
        let n = self.labels.len();
        if n == 0 {
            let help = "write the displacements of the modes: see docs/how_to/import_modes.md";
            return Err(unreadable(file, "the file has no modes", help));
        }
        for (number, mode) in self.modes.iter_mut().enumerate() {
            mode.values.resize(n, f64::NAN);
            if let Some(row) = mode.values.iter().position(|value| value.is_nan()) {
                let message = format!(
                    "mode {} has no value at {}, which other modes have",
                    number + 1,
                    self.labels[row]
                );
                return Err(unreadable(file, message, "write the file again: it may be cut off"));
            }
        }
        let matrix = Mat::from_fn(n, self.modes.len(), |i, j| self.modes[j].values[i]);
        Ok(RawModes {
            labels: self.labels,
            along_nodes: self.along_nodes,
            matrix,
            eigenvalues: self.modes.iter().map(|mode| mode.eigenvalue).collect(),
            eigenvalue_digits: self.eigenvalue_digits,
            digits: self.digits,
            path: file.path().to_path_buf(),
            source,
        })
    }
}

/// Returns FB128 at a line.
pub(super) fn syntax(file: &InputFile, line: usize, message: impl Into<String>) -> Vec<Diagnostic> {
    vec![Diagnostic::new(Code::ModeFileSyntax, message).in_file(file.path()).at_line(line)]
}

/// Returns FB128 about a file as a whole.
pub(super) fn unreadable(file: &InputFile, message: impl Into<String>, help: &str) -> Vec<Diagnostic> {
    vec![Diagnostic::new(Code::ModeFileSyntax, message).in_file(file.path()).with_help(help)]
}

/// Returns FB128 for a line of an unexpected form.
pub(super) fn unexpected(file: &InputFile, line: usize, what: &str, found: &[u8]) -> Vec<Diagnostic> {
    vec![expected(Code::ModeFileSyntax, what, found).in_file(file.path()).at_line(line)]
}
