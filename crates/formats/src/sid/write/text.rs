//! Text of SID_FEM: objects, their entries and numbers.

use super::dialect::Dialect;
use faer::Mat;
use std::fmt::Write;

/// Reason why `write!` cannot fail here.
const TO_A_STRING: &str = "writing to a String cannot fail";

/// Meaning of the listed entries of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Structure {
    /// All entries are zero.
    Zero,
    Symmetric,
    Full,
}

/// An object M0 + sum_k M1_k q_k of the file.
pub(crate) struct Taylor {
    pub(crate) name: &'static str,
    pub(crate) structure: Structure,
    /// Constant part (nrow x ncol).
    pub(crate) m0: Mat<f64>,
    /// Linear parts, nq matrices of nrow x ncol; `None` for an object of order 0.
    pub(crate) m1: Option<Vec<Mat<f64>>>,
}

impl Taylor {
    pub(crate) fn constant(name: &'static str, m0: Mat<f64>) -> Self {
        Self { name, structure: Structure::Full, m0, m1: None }
    }

    pub(crate) fn symmetric(name: &'static str, m0: Mat<f64>) -> Self {
        Self { structure: Structure::Symmetric, ..Self::constant(name, m0) }
    }

    pub(crate) fn zero(name: &'static str, nrow: usize, ncol: usize) -> Self {
        Self { structure: Structure::Zero, ..Self::constant(name, Mat::zeros(nrow, ncol)) }
    }

    pub(crate) fn linear(name: &'static str, m0: Mat<f64>, m1: Vec<Mat<f64>>) -> Self {
        Self { m1: Some(m1), ..Self::constant(name, m0) }
    }

    fn is_diagonal(&self) -> bool {
        let m0 = &self.m0;
        (0..m0.ncols()).all(|j| (0..m0.nrows()).all(|i| i == j || m0[(i, j)] == 0.0))
    }
}

/// Text of a file under construction.
pub(crate) struct Text<'d> {
    pub(crate) out: String,
    dialect: &'d Dialect,
    nq: usize,
}

impl<'d> Text<'d> {
    pub(crate) fn new(dialect: &'d Dialect, nq: usize) -> Self {
        Self { out: String::new(), dialect, nq }
    }

    /// Writes a line that is no assignment.
    pub(crate) fn line(&mut self, indent: usize, line: &str) {
        writeln!(self.out, "{:indent$}{line}", "").expect(TO_A_STRING);
    }

    /// Writes `key = value` with aligned signs of equality.
    pub(crate) fn value(&mut self, indent: usize, key: &str, value: impl std::fmt::Display) {
        let width = 48usize.saturating_sub(indent);
        writeln!(self.out, "{:indent$}{key:width$}= {value}", "").expect(TO_A_STRING);
    }

    /// Returns a number with 17 significant digits and an exponent of at least two digits:
    /// ` 1.2345678901234567D+00`.
    pub(crate) fn number(&self, value: f64) -> String {
        let text = format!("{value: >23.16e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let (sign, digits) = exponent.strip_prefix('-').map_or(('+', exponent), |digits| ('-', digits));
        format!("{mantissa}{}{sign}{digits:0>2}", self.dialect.exponent)
    }

    /// Writes an object with its nonzero entries.
    pub(crate) fn taylor(&mut self, indent: usize, object: &Taylor) {
        let Taylor { name, structure, m0, m1 } = object;
        self.line(indent, name);
        let symmetric = *structure == Structure::Symmetric;
        let code = match structure {
            Structure::Zero => 0,
            Structure::Symmetric if m1.is_none() && object.is_diagonal() => 1,
            Structure::Symmetric => 2,
            Structure::Full => 3,
        };
        let (inner, order) = (indent + 5, usize::from(m1.is_some()));
        let sizes = [("order", order), ("nrow", m0.nrows()), ("ncol", m0.ncols()), ("nq", self.nq)];
        for (key, value) in sizes.into_iter().chain([("nqn", 0), ("structure", code)]) {
            self.value(inner, key, format_args!("{value:4}"));
        }
        for i in 0..m0.nrows() {
            let columns = if symmetric && self.dialect.triangle { i + 1 } else { m0.ncols() };
            for j in 0..columns {
                let value = m0[(i, j)];
                if value != 0.0 {
                    let value = self.number(value);
                    self.value(inner, &format!("m0({:2},{:2})", i + 1, j + 1), value);
                }
            }
        }
        for (k, m1) in m1.iter().flatten().enumerate() {
            for i in 0..m1.nrows() {
                for j in 0..m1.ncols() {
                    let value = m1[(i, j)];
                    if value == 0.0 {
                        continue;
                    }
                    let indices = self.dialect.mode_index.indices([i, j, k], m1.nrows(), self.nq);
                    let [first, middle, last] = indices.map(|i| i + 1);
                    let value = self.number(value);
                    self.value(inner, &format!("m1({first:2},{middle:2},{last:2})"), value);
                }
            }
        }
        self.line(indent, &format!("end {name}"));
    }
}
