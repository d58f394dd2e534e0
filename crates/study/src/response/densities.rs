//! Spectral densities of random excitation, read from a table.

use super::Complex;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::InputFile;
use flexbody_base::text::series::{ColumnKey, has_column, read_series};
use flexbody_linalg::symmetric_eigen;
use libm::{log, pow};
use nalgebra::DMatrix;
use std::path::Path;

/// Largest negative eigenvalue of a table of coherences, relative to 1, that counts as rounding of its digits.
const ROUNDING: f64 = 1e-6;

/// One-sided spectral densities of some inputs over frequency, per hertz.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SpectralDensities {
    /// Frequencies in hertz, ascending.
    hertz: Vec<f64>,
    /// Density of every input at each frequency.
    own: Vec<Vec<f64>>,
    /// Coherence S_ab / sqrt(S_aa S_bb) of the inputs at each frequency.
    coherence: Vec<DMatrix<Complex<f64>>>,
}

impl SpectralDensities {
    /// Reads a table with the column `hertz`, a column for every input by its name (`big_end:z`) and, for inputs that are
    /// correlated, two columns `A * B re` and `A * B im`. Inputs without a column are at rest.
    ///
    /// # Errors
    /// FB215 if no input has a column, or a cross density has one of its two; FB216 for rows that cannot be read, negative
    /// densities, and densities that belong to no random process: a cross density beyond those of its inputs.
    pub(super) fn read(path: &Path, inputs: &[String]) -> Result<Self> {
        let file = InputFile::open(path)?;
        let excited: Vec<bool> = inputs.iter().map(|name| has_column(&file, name)).collect();
        if !excited.contains(&true) {
            let message =
                format!("no column has the density of an input; the inputs are {}", inputs.join(", "));
            let help = "name the columns hertz and, for each input, PLACE:DIRECTION as in --from or --base";
            return Err(Diagnostic::new(Code::SeriesColumn, message).in_file(path).with_help(help).into());
        }
        let mut wanted: Vec<String> = inputs
            .iter()
            .zip(&excited)
            .filter(|(_, excited)| **excited)
            .map(|(name, _)| name.clone())
            .collect();
        // A cross density is in the table if one of its two columns is; then both must be.
        let mut pairs = Vec::new();
        for (a, first) in inputs.iter().enumerate() {
            for (b, second) in inputs.iter().enumerate() {
                let parts = ["re", "im"].map(|part| format!("{first} * {second} {part}"));
                if a != b && parts.iter().any(|name| has_column(&file, name)) {
                    pairs.push((a, b));
                    wanted.extend(parts);
                }
            }
        }
        let keys: Vec<ColumnKey> = wanted.into_iter().map(ColumnKey::Name).collect();
        let all = read_series(&file, &ColumnKey::Name("hertz".to_owned()), &keys).map_err(Error::new)?;
        let wrong = |row: usize, message: String| {
            Error::from(Diagnostic::new(Code::SeriesRow, message).in_file(path).at_line(all.lines[row]))
        };
        let places: Vec<Option<usize>> = excited
            .iter()
            .scan(0, |next, excited| {
                *next += usize::from(*excited);
                Some(excited.then(|| *next - 1))
            })
            .collect();
        let first_cross = excited.iter().filter(|excited| **excited).count();
        let (mut own, mut coherence) = (Vec::new(), Vec::new());
        for row in 0..all.times.len() {
            let density = |at: &Option<usize>| at.map_or(0.0, |at| all.columns[at][row]);
            let densities: Vec<f64> = places.iter().map(density).collect();
            if all.times[row] < 0.0 || densities.iter().any(|value| *value < 0.0) {
                return Err(wrong(row, "a frequency or a spectral density is negative".to_owned()));
            }
            let mut table = DMatrix::identity(inputs.len(), inputs.len());
            for (at, &(a, b)) in pairs.iter().enumerate() {
                let parts = [0, 1].map(|k| all.columns[first_cross + 2 * at + k][row]);
                let size = (densities[a] * densities[b]).sqrt();
                if size == 0.0 && parts != [0.0; 2] {
                    let message = format!(
                        "inputs `{}` and `{}` are correlated, and one of them has no density",
                        inputs[a], inputs[b]
                    );
                    return Err(wrong(row, message));
                }
                let value = if size > 0.0 {
                    Complex::new(parts[0] / size, parts[1] / size)
                } else {
                    Complex::default()
                };
                (table[(a, b)], table[(b, a)]) = (value, value.conj());
            }
            if !is_coherence(&table) {
                let message = "the cross densities are larger than those of their inputs allow: no random process has them".to_owned();
                return Err(wrong(row, message));
            }
            own.push(densities);
            coherence.push(table);
        }
        Ok(Self { hertz: all.times, own, coherence })
    }

    /// Returns the frequencies of the table, in hertz.
    pub(super) fn frequencies(&self) -> impl Iterator<Item = f64> + '_ {
        self.hertz.iter().copied()
    }

    /// Returns the densities S (inputs x inputs) at a frequency: powers of the frequency between the rows of the table,
    /// straight lines where a row is zero, and straight lines of the coherence; zero outside of the table.
    pub(super) fn at(&self, hertz: f64) -> DMatrix<Complex<f64>> {
        let inputs = self.own[0].len();
        let last = self.hertz.len() - 1;
        if !(self.hertz[0]..=self.hertz[last]).contains(&hertz) {
            return DMatrix::zeros(inputs, inputs);
        }
        let at = self.hertz.partition_point(|known| *known <= hertz).clamp(1, last);
        let (low, high) = (self.hertz[at - 1], self.hertz[at]);
        let part = (hertz - low) / (high - low);
        let density = |i: usize| {
            let (a, b) = (self.own[at - 1][i], self.own[at][i]);
            if a > 0.0 && b > 0.0 && low > 0.0 {
                a * pow(b / a, log(hertz / low) / log(high / low))
            } else {
                a + (b - a) * part
            }
        };
        let roots: Vec<f64> = (0..inputs).map(|i| density(i).sqrt()).collect();
        DMatrix::from_fn(inputs, inputs, |i, j| {
            let (a, b) = (self.coherence[at - 1][(i, j)], self.coherence[at][(i, j)]);
            (a + (b - a) * Complex::new(part, 0.0)) * roots[i] * roots[j]
        })
    }
}

/// Returns true if a Hermitian matrix with unit diagonal is positive semidefinite.
fn is_coherence(table: &DMatrix<Complex<f64>>) -> bool {
    // The eigenvalues of the real matrix of twice the size are those of the Hermitian one, each twice.
    let n = table.nrows();
    let real = Mat::from_fn(2 * n, 2 * n, |i, j| {
        let value = table[(i % n, j % n)];
        match (i < n, j < n) {
            (true, true) | (false, false) => value.re,
            (true, false) => -value.im,
            (false, true) => value.im,
        }
    });
    symmetric_eigen(real.as_ref()).is_some_and(|eigen| eigen.values.iter().all(|value| *value >= -ROUNDING))
}
