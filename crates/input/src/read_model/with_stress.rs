//! Geometric stiffness as the difference of two stiffness matrices: that of the undeformed part with a stress, and K.

use super::rows_of_model::by_rows_of_model;
use crate::jobs::read_calculix_stiffness;
use crate::model_files::{MatrixLocation, StressStiffnessSource};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::input_file::InputFile;
use flexbody_linalg::ties::first_smallest;
use flexbody_linalg::{CscMatrix, parallel};
use flexbody_model::{DofLabel, GivenRows, RawMatrix, UnitLoad};
use libm::log10;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

/// Differences of two entries below this many units in their last digit are rounding.
const ROUNDED_UNITS: f64 = 2.0;

/// Least number of digits of the difference by which a geometric stiffness can be judged to 1 %.
const MIN_DIGITS: f64 = 3.0;

/// Number of columns per parallel task.
const COLUMNS_PER_TASK: usize = 256;

const UNSTRESSED_HELP: &str = "give the stress of a larger load, and assemble the matrix after it: in CalculiX *INITIAL CONDITIONS, TYPE=STRESS, a *STATIC step with all nodes held, then *STEP, PERTURBATION with *FREQUENCY, SOLVER=MATRIXSTORAGE and *BOUNDARY, OP=NEW";

/// Matrix of a stress as read: K_geo, or K with the stress.
pub(super) struct StressMatrix {
    raw: RawMatrix,
    /// Labels of the rows, if the file has rows of its own instead of those of K.
    labels: Option<Vec<DofLabel>>,
    /// Size of the load whose stress K has; `None` for K_geo.
    load_size: Option<f64>,
}

/// K of the model, with the labels of its rows.
pub(super) struct PlainStiffness<'m> {
    pub stiffness: &'m RawMatrix,
    pub labels: Cow<'m, [DofLabel]>,
}

/// Geometric stiffness of one unit of a load.
pub(super) struct OfStress {
    pub matrix: RawMatrix,
    /// Significant digits of the difference; `None` if the file holds K_geo itself.
    pub digits_left: Option<f64>,
}

/// Reads the matrix of a stress.
///
/// * `opened` returns a file whose bytes are in memory.
/// * `other` reads a matrix in one of the formats of K and M.
///
/// # Errors
/// Errors of the files.
pub(super) fn read_stress_matrix<'f>(
    source: &StressStiffnessSource,
    opened: impl Fn(&Path) -> Diagnosed<&'f InputFile>,
    other: impl Fn(&MatrixLocation) -> Diagnosed<RawMatrix>,
) -> Diagnosed<StressMatrix> {
    let load_size = source.with_stress.as_ref().map(|with| with.load_size);
    if let Some(dofs) = source.with_stress.as_ref().and_then(|with| with.dofs.as_ref()) {
        let (raw, labels) = read_calculix_stiffness(opened(&source.location.path)?, opened(dofs)?)?;
        return Ok(StressMatrix { raw, labels: Some(labels), load_size });
    }
    Ok(StressMatrix { raw: other(&source.location)?, labels: None, load_size })
}

impl StressMatrix {
    /// Returns K_geo of one unit of the load by the rows of K.
    ///
    /// * `rows` maps the rows of the files of the model to those of `plain`.
    ///
    /// # Errors
    /// FB112 for rows that are not those of K, FB308 for a matrix of another size, FB452 for a matrix that is K.
    pub(super) fn of_stress(self, plain: PlainStiffness<'_>, rows: &GivenRows) -> Diagnosed<OfStress> {
        let Self { raw, labels, load_size } = self;
        if let Some(row) = rows.dependent().first().filter(|_| load_size.is_some()) {
            let message = format!(
                "{} follows others by a constraint of the deck, so that K and the matrix with stress have other rows",
                row.label
            );
            let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(&raw.path);
            return Err(vec![diagnostic.with_help("give the geometric stiffness itself, without load_size")]);
        }
        if labels.as_ref().is_some_and(|labels| rows.counts().any(|count| count == labels.len())) {
            let message = "rows of K are along axes of nodes (GLOBAL=NO), and it is not known along which axes those of the matrix with stress are";
            let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(&raw.path);
            return Err(vec![diagnostic.with_help("write both matrices without GLOBAL=NO")]);
        }
        let matrix = match &labels {
            Some(labels) => in_rows_of(raw, labels, &plain.labels)?,
            None => by_rows_of_model(raw, rows)?,
        };
        let Some(load_size) = load_size else { return Ok(OfStress { matrix, digits_left: None }) };
        difference(&matrix, plain.stiffness, load_size).map_err(|diagnostic| vec![diagnostic])
    }
}

/// Returns a matrix with the rows `own` by the rows `wanted`.
///
/// # Errors
/// FB112 if the rows are not the same.
fn in_rows_of(raw: RawMatrix, own: &[DofLabel], wanted: &[DofLabel]) -> Diagnosed<RawMatrix> {
    let refuse = |label: &DofLabel, has: &str, lacks: &str| {
        let message = format!(
            "{has} a row for node {} direction {}, which {lacks}: K and the matrix with stress are those of different constraints or elements",
            label.node, label.direction
        );
        let help = "write both matrices of the same elements, without supports and constraints";
        Err(vec![Diagnostic::new(Code::DeckRows, message).in_file(&raw.path).with_help(help)])
    };
    let place: HashMap<DofLabel, u32> = wanted.iter().copied().zip(0..).collect();
    let mut to = Vec::with_capacity(own.len());
    for label in own {
        match place.get(label) {
            Some(row) => to.push(*row),
            None => return refuse(label, "the matrix with stress has", "the model does not have"),
        }
    }
    let mut is_given = vec![false; wanted.len()];
    for (label, row) in own.iter().zip(&to) {
        if std::mem::replace(&mut is_given[*row as usize], true) {
            return refuse(label, "the matrix with stress has twice", "is not unique");
        }
    }
    match is_given.iter().position(|given| !given) {
        Some(row) => refuse(&wanted[row], "the model has", "the matrix with stress does not have"),
        None => Ok(RawMatrix { matrix: raw.matrix.permuted(&to), ..raw }),
    }
}

/// Returns (K with stress - K) / size of the load, without entries that are rounding.
///
/// # Errors
/// FB308 for matrices of different sizes, FB452 for a difference with too few digits.
fn difference(stressed: &RawMatrix, plain: &RawMatrix, load_size: f64) -> Result<OfStress, Diagnostic> {
    let (n, path) = (plain.matrix.n_cols(), &stressed.path);
    if (stressed.matrix.n_rows(), stressed.matrix.n_cols()) != (plain.matrix.n_rows(), n) {
        let message = format!(
            "matrix with stress is {} x {}, but the stiffness matrix is {} x {n}",
            stressed.matrix.n_rows(),
            stressed.matrix.n_cols(),
            plain.matrix.n_rows(),
        );
        return Err(Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(path));
    }
    let digits = stressed.digits.min(plain.digits);
    let rounded = ROUNDED_UNITS * 10f64.powi(1 - i32::from(digits));
    let entries: Vec<(u32, u32, f64)> = parallel::concat(n, COLUMNS_PER_TASK, |columns| {
        columns.flat_map(|j| column_difference(&stressed.matrix, &plain.matrix, j, rounded)).collect()
    });
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |most, value| most.max(value.abs()));
    let of_stiffness = largest(&mut plain.matrix.values().iter().copied());
    let of_stress = largest(&mut entries.iter().map(|entry| entry.2));
    let left = f64::from(digits) + log10(of_stress / of_stiffness);
    if left.is_nan() || left < MIN_DIGITS {
        let message = if of_stress > 0.0 {
            format!(
                "matrix with stress differs from K by {:.1e} of its largest entry, of which {digits} digits show {:.1}: the stress is too small",
                of_stress / of_stiffness,
                left.max(0.0)
            )
        } else {
            "matrix with stress is K itself: it was written without the stress".to_owned()
        };
        let unstressed = Diagnostic::new(Code::GeometricStiffnessUnstressed, message).in_file(path);
        return Err(unstressed.with_help(UNSTRESSED_HELP));
    }
    let scaled: Vec<_> = entries.into_iter().map(|(row, col, value)| (row, col, value / load_size)).collect();
    let matrix = CscMatrix::from_triplets(n, n, &scaled);
    let digits = (left.floor() as u8).clamp(1, digits);
    Ok(OfStress { matrix: RawMatrix { matrix, digits, path: path.clone() }, digits_left: Some(left) })
}

/// Returns the entries of column `j` of a - b that exceed `rounded` times the larger of both entries.
fn column_difference(a: &CscMatrix, b: &CscMatrix, j: usize, rounded: f64) -> Vec<(u32, u32, f64)> {
    let ((mut a_rows, mut a_values), (mut b_rows, mut b_values)) = (a.column(j), b.column(j));
    let mut entries = Vec::with_capacity(a_rows.len());
    loop {
        let row = match (a_rows.first(), b_rows.first()) {
            (Some(a), Some(b)) => *a.min(b),
            (Some(row), None) | (None, Some(row)) => *row,
            (None, None) => return entries,
        };
        let take = |rows: &mut &[u32], values: &mut &[f64]| {
            let value = if rows.first() == Some(&row) { values[0] } else { return 0.0 };
            (*rows, *values) = (&rows[1..], &values[1..]);
            value
        };
        let (with, without) = (take(&mut a_rows, &mut a_values), take(&mut b_rows, &mut b_values));
        if (with - without).abs() > rounded * with.abs().max(without.abs()) {
            entries.push((row, j as u32, with - without));
        }
    }
}

/// Returns a note with the digits of geometric stiffness that is a difference; `None` if none is.
pub(super) fn difference_note(differences: &[(f64, UnitLoad)]) -> Option<Diagnostic> {
    let (digits, load) = first_smallest(differences, |pair| pair.0)?;
    let count = differences.len();
    let message = format!(
        "geometric stiffness of {count} load{} is the difference of two stiffness matrices; {digits:.1} digits are left, the fewest for {load}",
        if count == 1 { "" } else { "s" }
    );
    Some(Diagnostic::new(Code::GeometricStiffnessDifference, message))
}
