//! Rows of a recovery from the answers of an FE program to shapes: modes and static columns as combinations of the
//! shapes, found by least squares in the M-norm with rigid motions added.

use crate::basis::rigid_modes;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{column_products, combine, gram, side_by_side, subtract_combination, symmetric_eigen};
use flexbody_model::{AnsweredShapes, DofLabel, FeModel, ModelRecovery, RecoveryOperator};
use std::collections::{BTreeSet, HashMap};

/// Largest misfit of a mode or a static column. Shapes that were written for the body reach 1e-12; a shape that is
/// missing gives 1e-2 to 1. A larger limit lets stresses of other modes pass.
const MAX_MISFIT: f64 = 1e-3;

/// Digits of the displacements above which the misfit is judged by the strain energy too. Rounding a displacement to
/// fewer digits alone has a strain energy above the limit on slender bodies.
const MIN_DIGITS_OF_ENERGY: u8 = 12;

/// Size of a static column, relative to the whole static response, below which its misfit is judged relative to this
/// size: the column is then rounding, and the body does not need it.
const MIN_RESPONSE: f64 = 1e-6;

/// Eigenvalue of the Gram matrix of the shapes, relative to the largest, below which a combination of shapes is zero.
const MIN_EIGENVALUE: f64 = 1e-14;

/// Number of refinements of the least squares. Each reduces the error by the square of the condition of the shapes times
/// the rounding.
const REFINEMENTS: usize = 3;

/// Difference of strain energies, relative, above which a warning is given. Printed energies have seven digits.
const MAX_ENERGY_DIFFERENCE: f64 = 1e-3;

/// Difference of strain energies above which the deck is not that of K, whatever the elements are.
const MAX_FOREIGN_ENERGY: f64 = 0.5;

/// Number of misfits that a message names.
const MAX_NAMED: usize = 5;

/// Displacements whose rows are wanted.
pub(super) struct Targets<'a> {
    /// Modes (N x nf).
    pub modes: &'a Mat<f64>,
    /// Static responses outside the modes (N x m).
    pub responses: &'a Mat<f64>,
    /// M-norms of the whole static responses (m).
    pub sizes: Vec<f64>,
    /// Names of the loads (m).
    pub names: Vec<String>,
}

/// Rows in the modes and under the loads.
pub(super) struct MappedAnswers {
    /// R Psi (rows x nf).
    pub modes: Mat<f64>,
    /// R G_r F (rows x m).
    pub columns: Mat<f64>,
    /// Misfits, and differences of the strain energy.
    pub diagnostics: Vec<Diagnostic>,
}

/// Returns the rows of `targets` from the answers to shapes.
///
/// # Errors
/// [`RecoveryUnanswered`](Code::RecoveryUnanswered) if a mode or a column is no combination of the shapes,
/// [`RecoveryEnergy`](Code::RecoveryEnergy) if the FE program has another stiffness.
pub(super) fn mapped_answers(
    model: &FeModel,
    recovery: &ModelRecovery,
    shapes: &AnsweredShapes,
    targets: &Targets<'_>,
) -> Result<MappedAnswers> {
    let known = KnownRows::new(model, shapes);
    let warning = known.refuse_other_energies(model, recovery, shapes)?;
    let wanted = known.restricted(side_by_side(&[targets.modes.as_ref(), targets.responses.as_ref()]));
    let rigid = known.restricted(rigid_modes(model, &model.pencil())?);
    let fit = Fit::new(model, &known.shapes, &rigid, wanted)?;
    let judged = fit.misfits(model, targets, known.is_whole && shapes.digits >= MIN_DIGITS_OF_ENERGY);
    let note = judged.accepted(recovery, shapes, targets)?;
    let rows = combine(shapes.answers.as_ref(), fit.coefficients.as_ref().subrows(0, shapes.answers.ncols()));
    let modes = targets.modes.ncols();
    Ok(MappedAnswers {
        modes: rows.as_ref().subcols(0, modes).to_owned(),
        columns: rows.as_ref().subcols(modes, rows.ncols() - modes).to_owned(),
        diagnostics: warning.into_iter().chain([note]).collect(),
    })
}

/// Shapes by the internal rows of the model.
struct KnownRows {
    /// Displacements (N x s), zero in rows that are not known.
    shapes: Mat<f64>,
    is_known: Vec<bool>,
    /// True if all rows are known.
    is_whole: bool,
}

impl KnownRows {
    fn new(model: &FeModel, shapes: &AnsweredShapes) -> Self {
        let places: HashMap<DofLabel, usize> =
            shapes.dofs.iter().enumerate().map(|(place, dof)| (*dof, place)).collect();
        let n = model.stiffness().n();
        let internal = model.rows().without_place();
        let is_placed = |row: &usize| !internal.iter().any(|range| range.contains(row));
        let place_of = |row: usize| places.get(&model.label(row)).copied().filter(|_| is_placed(&row));
        let place: Vec<Option<usize>> = (0..n).map(place_of).collect();
        let value = |row: usize, shape: usize| place[row].map_or(0.0, |at| shapes.displacements[(at, shape)]);
        let is_known: Vec<bool> = place.iter().map(Option::is_some).collect();
        Self {
            shapes: Mat::from_fn(n, shapes.displacements.ncols(), value),
            is_whole: is_known.iter().all(|known| *known),
            is_known,
        }
    }

    /// Returns the fields with zeros in the rows that are not known.
    fn restricted(&self, mut fields: Mat<f64>) -> Mat<f64> {
        for (row, _) in self.is_known.iter().enumerate().filter(|(_, known)| !**known) {
            fields.row_mut(row).fill(0.0);
        }
        fields
    }

    /// Compares the strain energies of the FE program with u'Ku / 2. Returns a warning about shapes whose energies
    /// differ.
    fn refuse_other_energies(
        &self,
        model: &FeModel,
        recovery: &ModelRecovery,
        shapes: &AnsweredShapes,
    ) -> Result<Option<Diagnostic>> {
        let Some(energies) = shapes.energies.as_ref().filter(|_| self.is_whole) else { return Ok(None) };
        let loads = model.pencil().apply_stiffness(self.shapes.as_ref());
        let products = column_products(self.shapes.as_ref(), loads.as_ref());
        let ratios: Vec<f64> =
            energies.iter().zip(products).map(|(energy, product)| energy / (0.5 * product)).collect();
        let difference = |ratio: &f64| (ratio - 1.0).abs();
        let mut sorted = ratios.clone();
        sorted.sort_by(f64::total_cmp);
        let (lowest, median, highest) = (sorted[0], sorted[sorted.len() / 2], sorted[sorted.len() - 1]);
        let is_factor = highest - lowest <= MAX_ENERGY_DIFFERENCE * highest.abs();
        let is_far = difference(&median) > MAX_ENERGY_DIFFERENCE;
        if !median.is_finite() || difference(&median) > MAX_FOREIGN_ENERGY || is_factor && is_far {
            let message = format!(
                "recovery `{}`: strain energies of the FE program are {lowest:.4} to {highest:.4} times u'Ku / 2, median {median:.4}",
                recovery.name
            );
            return Err(Diagnostic::new(Code::RecoveryEnergy, message).in_file(&recovery.path).into());
        }
        let different = ratios.iter().filter(|ratio| difference(ratio) > MAX_ENERGY_DIFFERENCE).count();
        Ok((different > 0).then(|| {
            let message = format!(
                "recovery `{}`: strain energies of {different} of {} shapes differ: they are {lowest:.4} to {highest:.4} times u'Ku / 2",
                recovery.name,
                ratios.len()
            );
            Diagnostic::new(Code::RecoveryEnergyDiffers, message).in_file(&recovery.path)
        }))
    }
}

/// Combinations of shapes and rigid motions nearest to the wanted fields in the M-norm.
struct Fit {
    /// Coefficients of the shapes, then of the rigid motions.
    coefficients: Mat<f64>,
    wanted: Mat<f64>,
    /// Wanted fields less the combinations.
    left: Mat<f64>,
}

impl Fit {
    fn new(model: &FeModel, shapes: &Mat<f64>, rigid: &Mat<f64>, wanted: Mat<f64>) -> Result<Self> {
        let pencil = model.pencil();
        let mut sources = side_by_side(&[shapes.as_ref(), rigid.as_ref()]);
        // Unit norms, so that small eigenvalues mean dependent shapes.
        let squares = column_products(sources.as_ref(), pencil.apply_mass(sources.as_ref()).as_ref());
        let scales: Vec<f64> =
            squares.iter().map(|square| if *square > 0.0 { square.sqrt().recip() } else { 0.0 }).collect();
        for (j, scale) in scales.iter().enumerate() {
            sources.col_mut(j).iter_mut().for_each(|value| *value *= scale);
        }
        let moved = pencil.apply_mass(sources.as_ref());
        let products = gram(sources.as_ref(), moved.as_ref());
        let Some(eigen) = symmetric_eigen(products.as_ref()) else {
            let message = "products of the shapes of a recovery are not finite";
            return Err(Diagnostic::new(Code::MatrixNotFinite, message).into());
        };
        let largest = eigen.values.last().copied().unwrap_or(0.0);
        let inverse = |value: f64| if value > MIN_EIGENVALUE * largest { value.recip() } else { 0.0 };
        let mut coefficients = Mat::zeros(sources.ncols(), wanted.ncols());
        let mut left = wanted.clone();
        for _ in 0..=REFINEMENTS {
            let projected = gram(moved.as_ref(), left.as_ref());
            let mut along = gram(eigen.vectors.as_ref(), projected.as_ref());
            for (i, value) in eigen.values.iter().enumerate() {
                along.row_mut(i).iter_mut().for_each(|entry| *entry *= inverse(*value));
            }
            let step = combine(eigen.vectors.as_ref(), along.as_ref());
            subtract_combination(left.as_mut(), sources.as_ref(), step.as_ref());
            coefficients += step;
        }
        for (i, scale) in scales.iter().enumerate() {
            coefficients.row_mut(i).iter_mut().for_each(|entry| *entry *= scale);
        }
        Ok(Self { coefficients, wanted, left })
    }

    /// Returns the misfit of every wanted field: the norm of what is left, relative to that of the field; the larger one
    /// of the M-norm and, if `by_energy`, of the strain energy.
    fn misfits(&self, model: &FeModel, targets: &Targets<'_>, by_energy: bool) -> Misfits {
        let pencil = model.pencil();
        let norms = |x: MatRef<'_, f64>, of: Mat<f64>| -> Vec<f64> {
            column_products(x, of.as_ref()).into_iter().map(|square| square.max(0.0).sqrt()).collect()
        };
        let by_mass = |x: &Mat<f64>| norms(x.as_ref(), pencil.apply_mass(x.as_ref()));
        let by_stiffness = |x: &Mat<f64>| norms(x.as_ref(), pencil.apply_stiffness(x.as_ref()));
        let (sizes, left) = (by_mass(&self.wanted), by_mass(&self.left));
        let modes = targets.modes.ncols();
        // Static columns that are small beside the whole response are rounding.
        let floor: Vec<f64> = (0..sizes.len())
            .map(|j| j.checked_sub(modes).map_or(0.0, |at| MIN_RESPONSE * targets.sizes[at]))
            .collect();
        let part = |part: f64, whole: f64| if part > 0.0 { part / whole } else { 0.0 };
        let mut all: Vec<f64> = (0..sizes.len()).map(|j| part(left[j], sizes[j].max(floor[j]))).collect();
        if by_energy {
            let (energies, left) = (by_stiffness(&self.wanted), by_stiffness(&self.left));
            for (j, misfit) in all.iter_mut().enumerate() {
                if sizes[j] > floor[j] {
                    *misfit = misfit.max(part(left[j], energies[j]));
                }
            }
        }
        Misfits { all, modes }
    }
}

/// Misfits of modes and static columns.
struct Misfits {
    all: Vec<f64>,
    /// Number of modes.
    modes: usize,
}

impl Misfits {
    /// Returns a note with the misfits if they are small enough.
    fn accepted(
        &self,
        recovery: &ModelRecovery,
        shapes: &AnsweredShapes,
        targets: &Targets<'_>,
    ) -> Result<Diagnostic> {
        let name = |j: usize| match j.checked_sub(self.modes) {
            Some(column) => format!("column {}", targets.names[column]),
            None => format!("mode {}", j + 1),
        };
        let is_fit = |j: &usize| self.all[*j] <= MAX_MISFIT;
        let wrong: Vec<usize> = (0..self.all.len()).filter(|j| !is_fit(j)).collect();
        if !wrong.is_empty() {
            let named: Vec<String> =
                wrong.iter().take(MAX_NAMED).map(|&j| format!("{} ({:.1e})", name(j), self.all[j])).collect();
            let more = if wrong.len() > named.len() { ", ..." } else { "" };
            let message = format!(
                "recovery `{}`: {} of {} modes and static columns are no combinations of its {} shapes; misfits, expected at most {MAX_MISFIT:.0e}: {}{more}",
                recovery.name,
                wrong.len(),
                self.all.len(),
                shapes.answers.ncols(),
                named.join(", ")
            );
            return Err(Diagnostic::new(Code::RecoveryUnanswered, message).in_file(&recovery.path).into());
        }
        let worst = |range: std::ops::Range<usize>| {
            let worst = first_largest(range, |j| self.all[*j]);
            worst.map_or("none".to_owned(), |j| format!("{:.1e} ({})", self.all[j], name(j)))
        };
        let energies = match shapes.energies {
            Some(_) => "",
            None => "; the results have no strain energies to compare with K",
        };
        let message = format!(
            "recovery `{}`: {} rows{} from {} shapes; values have {} digits; largest misfit of a mode {}, of a static column {}{energies}",
            recovery.name,
            shapes.answers.nrows(),
            units_of(recovery),
            shapes.answers.ncols(),
            shapes.answer_digits,
            worst(0..self.modes),
            worst(self.modes..self.all.len())
        );
        Ok(Diagnostic::new(Code::RecoveryMapped, message).in_file(&recovery.path))
    }
}

/// Returns the units of the rows of answered shapes, such as ` in MPa`; empty for rows without units. No file of answers states
/// them.
fn units_of(recovery: &ModelRecovery) -> String {
    let RecoveryOperator::Shapes { labels, .. } = &recovery.operator else { return String::new() };
    let units: BTreeSet<&str> =
        labels.iter().map(|row| row.unit.as_str()).filter(|unit| !unit.is_empty()).collect();
    if units.is_empty() {
        String::new()
    } else {
        format!(" in {}", units.into_iter().collect::<Vec<_>>().join(", "))
    }
}
