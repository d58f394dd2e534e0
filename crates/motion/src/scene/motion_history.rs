//! Motions that another program computed.

use crate::dynamics::EulerParameters;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::InputFile;
use flexbody_base::text::series::{ColumnKey, Series, has_column, read_series};
use std::path::{Path, PathBuf};

/// Time by which a history may begin after 0 or end beside the scene, relative to the duration: times are often written
/// with about six digits.
const ROUNDING: f64 = 1e-6;
/// Largest difference of the length of Euler parameters from 1 that counts as rounding of their digits.
const NOT_UNIT: f64 = 1e-2;

/// Motion of a body, computed by another program, at its own instants.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionHistory {
    /// File of the history.
    pub path: PathBuf,
    /// Times, ascending.
    pub time: Vec<f64>,
    /// Attitude of the axes of the model in the world; `None` if the file does not have it.
    pub attitude: Option<Vec<EulerParameters>>,
    /// Modal coordinates of the body at each time.
    pub q: Vec<Vec<f64>>,
}

impl MotionHistory {
    /// Reads the columns `time`, `q_1` to `q_n` for `n_modes` modes and, if there is one of them, `attitude_0` to
    /// `attitude_3`, which are those of `simulate --csv`. Other columns are ignored.
    ///
    /// # Errors
    /// FB215 for missing columns; FB216 for rows that cannot be read, for times that do not ascend and for Euler
    /// parameters whose length is not 1; the errors of [`InputFile::open`].
    pub fn read(path: &Path, n_modes: usize) -> Result<Self> {
        let file = InputFile::open(path)?;
        let named = |prefix: &str, first: usize, count: usize| -> Vec<ColumnKey> {
            (first..first + count).map(|k| ColumnKey::Name(format!("{prefix}{k}"))).collect()
        };
        // The attitude is in the file if any of its columns is; then all must be.
        let has_attitude = (0..4).any(|k| has_column(&file, &format!("attitude_{k}")));
        let mut keys = named("q_", 1, n_modes);
        keys.extend(has_attitude.then(|| named("attitude_", 0, 4)).into_iter().flatten());
        let time = ColumnKey::Name("time".to_owned());
        let all = read_series(&file, &time, &keys).map_err(Error::new)?;
        let row = |i: usize, columns: &[Vec<f64>]| columns.iter().map(|column| column[i]).collect::<Vec<_>>();
        let (modal, attitude) = all.columns.split_at(n_modes);
        let rows = 0..all.times.len();
        let q = rows.clone().map(|i| row(i, modal)).collect();
        let attitude = match has_attitude {
            true => Some(rows.map(|i| unit(&row(i, attitude), &all, i, path)).collect::<Result<Vec<_>>>()?),
            false => None,
        };
        Ok(Self { path: path.to_owned(), time: all.times, attitude, q })
    }

    /// Returns the history with its first and last time at 0 and `duration`, from which they may differ by rounding.
    ///
    /// # Errors
    /// FB217 if the history does not cover the time of the scene, or goes beyond it.
    pub fn covering(mut self, duration: f64) -> Result<Self> {
        let (first, last) =
            (self.time.first().copied().unwrap_or(0.0), self.time.last().copied().unwrap_or(0.0));
        let rounding = ROUNDING * duration;
        if first.abs() > rounding || (last - duration).abs() > rounding {
            let message = format!(
                "the history covers the times {first} to {last}, but the scene those from 0 to {duration}"
            );
            let help =
                "write the whole run, from 0 to `duration` of [run], with the time in the unit of the body";
            let uncovered = Diagnostic::new(Code::SeriesRange, message).in_file(&self.path);
            return Err(uncovered.with_help(help).into());
        }
        if let Some(first) = self.time.first_mut() {
            *first = 0.0;
        }
        if let Some(last) = self.time.last_mut() {
            *last = duration;
        }
        Ok(self)
    }
}

/// Returns Euler parameters of row `i` with length 1.
fn unit(values: &[f64], all: &Series, i: usize, path: &Path) -> Result<EulerParameters> {
    let length = values.iter().map(|value| value * value).sum::<f64>().sqrt();
    if (length - 1.0).abs() > NOT_UNIT {
        let message =
            format!("the Euler parameters attitude_0 to attitude_3 have the length {length}, not 1");
        let help =
            "write the four Euler parameters of the axes of the model, the cosine of half the angle first";
        let at = Diagnostic::new(Code::SeriesRow, message).in_file(path).at_line(all.lines[i]);
        return Err(at.with_help(help).into());
    }
    Ok(EulerParameters(std::array::from_fn(|k| values[k] / length)))
}
