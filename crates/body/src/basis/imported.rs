//! Shapes computed elsewhere, in a file or from a motion: checked, reordered to the rows of the model,
//! freed from rigid motion, and M-orthonormalised. Nothing is factored unless eigenvectors are to be proved
//! complete.

use super::BasisKind;
use super::failure::explain;
use super::modal_basis::{Basis, ModalBasis, Task, problem_of_span, rigid_modes};
use super::pseudo_free_surface::independent;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::SourceFile;
use flexbody_eigen::{Accuracy, EigenFailure, EigenSolution, Proof, Wanted, modes_of_span};
use flexbody_linalg::{Analysis, CscMatrix, Indefinite, Pencil, SymmetricMatrix, column_products, gram};
use flexbody_model::{FeModel, LostRow, RawModes, RawShapes};
use libm::log10;
use std::collections::HashMap;
use std::path::PathBuf;

/// Shapes in the order of the degrees of freedom of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedShapes {
    /// Shapes by internal rows (N x k).
    shapes: Mat<f64>,
    digits: u8,
    source: Option<SourceFile>,
    origin: Origin,
    /// Data of the modes as stated by the file.
    stated: Option<StatedModes>,
    /// Diagnostics about changes of the shapes.
    notes: Vec<Diagnostic>,
}

/// Origin of imported shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// File given by the user.
    User,
    /// Motion of a body in a scene.
    Motion,
}

/// Decimal digits of shapes computed by this program.
const COMPUTED_DIGITS: u8 = 15;

impl ImportedShapes {
    /// Creates shapes for `model` from values on its matrix rows.
    ///
    /// # Errors
    /// [`ShapesSize`](Code::ShapesSize) if the rows are not those of the matrices;
    /// [`MatrixNotFinite`](Code::MatrixNotFinite) and [`ShapesZero`](Code::ShapesZero), one diagnostic per
    /// finding.
    pub fn new(model: &FeModel, raw: RawShapes) -> Result<Self> {
        let (digits, source) = (raw.digits, raw.source.clone());
        let shapes = columns(model, raw, Given::Shapes)?;
        Ok(Self { shapes, digits, source, origin: Origin::User, stated: None, notes: Vec::new() })
    }

    /// Reads modes of `model` that an FE program wrote by nodes. Missing rows follow from the others by the
    /// equations of motion, and the eigenvalues of the file are compared with K and M.
    ///
    /// # Errors
    /// [`ShapesSize`](Code::ShapesSize) if the nodes are not those of the model, or too few of them;
    /// [`ShapesZero`](Code::ShapesZero) for a zero shape.
    pub fn of_modes(model: &FeModel, raw: RawModes) -> Result<Self> {
        let raw = along_the_model(model, raw)?;
        let (shapes, notes) = by_rows(model, &raw)?;
        let (digits, source, stated) = (raw.digits, Some(raw.source.clone()), Some(StatedModes::of(raw)));
        Ok(Self { shapes, digits, source, origin: Origin::User, stated, notes })
    }

    /// Creates shapes that were derived from a motion (N x k, by the rows of the model).
    pub fn of_motion(shapes: Mat<f64>) -> Self {
        let digits = COMPUTED_DIGITS;
        Self { shapes, digits, source: None, origin: Origin::Motion, stated: None, notes: Vec::new() }
    }

    /// Returns the singular and plural name of the shapes for messages.
    fn names(&self) -> (&'static str, &'static str) {
        match self.origin {
            Origin::User => ("imported shape", "imported shapes"),
            Origin::Motion => ("shape of the motion", "shapes of the motion"),
        }
    }

    /// Returns the file that the shapes were read from, if any.
    pub fn source(&self) -> Option<&SourceFile> {
        self.source.as_ref()
    }

    /// Returns the smallest relative M-norm that a shape must keep after projection against the shapes
    /// before it, given by the digits of its values.
    fn dependent(&self) -> f64 {
        10f64.powi(2 - i32::from(self.digits)).clamp(1e-8, 0.1)
    }
}

impl Basis for ImportedShapes {
    fn kind(&self) -> BasisKind {
        match self.origin {
            Origin::User => BasisKind::Imported,
            Origin::Motion => BasisKind::Scene,
        }
    }

    fn modes(&self, task: &Task<'_>) -> Result<ModalBasis> {
        let Task { model, settings, context } = *task;
        let rigid = rigid_modes(model, &model.pencil())?;
        let problem = problem_of_span(model, rigid.as_ref());
        let criterion = self.dependent();
        let (one, several) = self.names();
        let failed = |failure| explain(model, failure);
        let independent = independent(&problem.pencil, rigid.as_ref(), self.shapes.clone(), criterion, None)
            .ok_or_else(|| failed(EigenFailure::MassIndefinite))?;
        let notes = independent.notes(several, criterion, |j| format!("shape {}", j + 1));
        if independent.retained.is_empty() {
            let message = format!("none of {} {several} deforms the body", self.shapes.ncols());
            return Err(Error::new([vec![Diagnostic::new(Code::ShapesNone, message)], notes].concat()));
        }
        let solution = modes_of_span(&problem, independent.vectors, settings, context).map_err(failed)?;
        let mut basis = ModalBasis::new(model, &problem, settings, solution, one)?;
        let compared = self
            .stated
            .as_ref()
            .map(|stated| stated.beside(model, self.shapes.as_ref(), &independent.retained, &basis.solution));
        basis.diagnostics.extend(self.notes.iter().cloned().chain(compared.flatten()).chain(notes));
        let given = basis.solution.eigenvalues.len();
        if let Wanted::Lowest(wanted) = settings.wanted
            && wanted > given
            && wanted < usize::MAX
        {
            let message = format!("{wanted} modes were requested, the shapes give {given}");
            basis.diagnostics.push(Diagnostic::new(Code::ModesClamped, message));
        }
        basis.describe_span(settings.accuracy);
        Ok(basis)
    }
}

impl ModalBasis {
    /// Adds notes about the modes of a subspace: the modes that are no eigenvectors, and the completeness
    /// of the others.
    fn describe_span(&mut self, accuracy: Accuracy) {
        let solution = &self.solution;
        let (residuals, completeness) = (&solution.residuals, &solution.completeness);
        let promised = accuracy.residual();
        let worst = residuals.iter().copied().fold(0.0, f64::max);
        let others = solution.residuals.len() - solution.eigenvectors(accuracy);
        if others > 0 {
            let message = format!(
                "{others} of {} modes are not eigenvectors but the best approximations in the span of the shapes: K-residual up to {worst:.0e}, expected at most {promised:.0e}",
                residuals.len()
            );
            self.diagnostics.push(Diagnostic::new(Code::ShapesSpan, message));
        }
        if completeness.proof == Proof::NotProved && others < residuals.len() {
            let message = format!("completeness of the modes is not proved: {}", completeness.remark);
            self.diagnostics.push(Diagnostic::new(Code::CompletenessUnproved, message));
        }
    }
}

// Shapes or loads from outside: checks, and transformation to the rows of the model.

/// Kind of columns given by rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Given {
    /// Displacements.
    Shapes,
    /// Forces.
    Loads,
}

impl Given {
    fn name(self) -> &'static str {
        match self {
            Self::Shapes => "shape",
            Self::Loads => "load",
        }
    }
}

/// Returns the columns of `raw` in the model's order of degrees of freedom.
///
/// # Errors
/// [`ShapesSize`](Code::ShapesSize) if the rows are not those of the matrices, or a load acts on a row that
/// has neither stiffness nor mass; [`MatrixNotFinite`](Code::MatrixNotFinite) and
/// [`ShapesZero`](Code::ShapesZero), one diagnostic per finding.
pub(super) fn columns(model: &FeModel, raw: RawShapes, given: Given) -> Result<Mat<f64>> {
    let (n, k, what) = (raw.matrix.nrows(), raw.matrix.ncols(), given.name());
    let path = raw.path.clone();
    let refuse = |code, message: String| Diagnostic::new(code, message).in_file(&path);
    if !model.row_counts().contains(&n) || k == 0 {
        let message = format!("{k} {what}s have {n} rows, the matrices have {}", model.matrix_rows());
        return Err(refuse(Code::ShapesSize, message).into());
    }
    let mut diagnostics = Vec::new();
    for j in 0..k {
        let column = raw.matrix.col(j);
        if let Some(row) = column.iter().position(|value| !value.is_finite()) {
            let message = format!("{what} {} has {} in row {}", j + 1, column[row], row + 1);
            diagnostics.push(refuse(Code::MatrixNotFinite, message));
        } else if column.iter().all(|&value| value == 0.0) {
            diagnostics.push(refuse(Code::ShapesZero, format!("{what} {} is zero everywhere", j + 1)));
        }
    }
    if !diagnostics.is_empty() {
        return Err(Error::new(diagnostics));
    }
    let rows = match given {
        Given::Shapes => model.given_rows().motions(raw.matrix),
        Given::Loads => {
            let lost =
                |LostRow| refuse(Code::ShapesSize, "loads act on rows that K and M leave empty".to_owned());
            model.given_rows().forces(raw.matrix).map_err(lost)?
        }
    };
    let mut acting = (0..k).flat_map(|j| (0..rows.nrows()).map(move |row| (row, j)));
    let left_out = |&(row, j): &(usize, usize)| model.is_left_out(row) && rows[(row, j)] != 0.0;
    if let Some((row, j)) = acting.find(left_out).filter(|_| given == Given::Loads) {
        let message = format!("load {} acts on row {}, which has neither stiffness nor mass", j + 1, row + 1);
        return Err(refuse(Code::ShapesSize, message).into());
    }
    Ok(model.in_internal_order(rows))
}

// Modes written by an FE program node by node: reordered to the rows of the model, completed where rows
// are missing, and checked against K and M.

/// Backward error of a factorisation above which missing rows are not completed with it. It corresponds to
/// the digits of the shapes.
const MAX_BACKWARD_ERROR: f64 = 1e-7;

/// Returns the modes with their values along the axes of the model.
///
/// # Errors
/// [`ShapesSize`](Code::ShapesSize) if a node has values for only some of the directions that turn
/// together.
fn along_the_model(model: &FeModel, mut raw: RawModes) -> Result<RawModes> {
    if std::mem::take(&mut raw.along_nodes) {
        model.given_rows().turn(&raw.labels, &mut raw.matrix).map_err(|node| {
            let message = format!(
                "values of node {node} are along local axes, and the file does not have all three directions"
            );
            Diagnostic::new(Code::ShapesSize, message).in_file(&raw.path)
        })?;
    }
    Ok(raw)
}

/// Returns the shapes by internal rows (N x k), and diagnostics about completed rows.
///
/// # Errors
/// [`ShapesSize`](Code::ShapesSize), [`ShapesZero`](Code::ShapesZero).
fn by_rows(model: &FeModel, raw: &RawModes) -> Result<(Mat<f64>, Vec<Diagnostic>)> {
    // Place of each row in the file.
    let places: HashMap<_, usize> =
        raw.labels.iter().enumerate().map(|(place, label)| (*label, place)).collect();
    let n = model.stiffness().n();
    let place: Vec<Option<usize>> = (0..n).map(|row| places.get(&model.label(row)).copied()).collect();
    let missing: Vec<usize> = (0..n).filter(|row| place[*row].is_none()).collect();
    refuse_too_few(model, raw, &missing)?;
    // Values of the file; missing rows are zero until they are completed.
    let value = |row: usize, mode: usize| place[row].map_or(0.0, |at| raw.matrix[(at, mode)]);
    let mut shapes = Mat::from_fn(n, raw.matrix.ncols(), value);
    if let Some(mode) = (0..shapes.ncols()).find(|mode| shapes.col(*mode).norm_max() == 0.0) {
        let message = format!("mode {} is zero at all nodes of the model", mode + 1);
        return Err(Diagnostic::new(Code::ShapesZero, message).in_file(&raw.path).into());
    }
    if missing.is_empty() {
        return Ok((shapes, Vec::new()));
    }
    complete(model, &mut shapes, &missing, raw)?;
    let message = format!(
        "the file has no values for {} of {n} rows, of {}",
        missing.len(),
        some_nodes(model, &missing)
    );
    Ok((shapes, vec![Diagnostic::new(Code::ModesCompleted, message).in_file(&raw.path)]))
}

/// Returns an error if the file has less than half of the displacements of the nodes, too few to determine
/// the others.
fn refuse_too_few(model: &FeModel, raw: &RawModes, missing: &[usize]) -> Result<()> {
    let all = model.dimension() * model.nodes().len();
    let absent = missing.partition_point(|row| *row < all);
    if 2 * absent < all {
        return Ok(());
    }
    let message = format!(
        "the file has no values for {absent} of {all} displacements of the model, as of {}",
        some_nodes(model, missing)
    );
    let help = "write the modes of all nodes, by the numbers that they have in the model";
    Err(Diagnostic::new(Code::ShapesSize, message).in_file(&raw.path).with_help(help).into())
}

/// Returns the first nodes that rows belong to, as text.
fn some_nodes(model: &FeModel, rows: &[usize]) -> String {
    let mut nodes: Vec<i64> = rows.iter().map(|row| model.label(*row).node).collect();
    nodes.dedup();
    let named: Vec<String> = nodes.iter().take(5).map(i64::to_string).collect();
    let more = if nodes.len() > named.len() { ", ..." } else { "" };
    format!("node{} {}{more}", if nodes.len() == 1 { "" } else { "s" }, named.join(", "))
}

/// Computes the missing rows i from (K - lambda M) x = 0: x_i = -(K - lambda M)_ii^-1 (K - lambda M)_ib
/// x_b.
fn complete(model: &FeModel, shapes: &mut Mat<f64>, missing: &[usize], raw: &RawModes) -> Result<()> {
    let whole = model.pencil();
    // Submatrices of the missing rows.
    let stiffness = whole.stiffness().principal(missing);
    let mass = principal_mass(&whole, missing);
    let pencil = Pencil::new(&stiffness, &mass, 1);
    let refuse = |why: &str| {
        let message = format!("the file has no values for rows of {}, and {why}", some_nodes(model, missing));
        let help = "write the modes of all nodes, with their rotations where the model has them";
        Diagnostic::new(Code::ShapesSize, message).in_file(&raw.path).with_help(help)
    };
    let analysis = Analysis::new(&pencil)
        .ok_or_else(|| refuse("there are too many to compute them from the other rows"))?;
    for (mode, eigenvalue) in raw.eigenvalues.iter().enumerate() {
        let lambda = eigenvalue.unwrap_or(0.0).max(0.0);
        let shape = shapes.as_ref().subcols(mode, 1);
        // Force of the known rows on the missing ones.
        let (elastic, inertial) = (whole.apply_stiffness(shape), whole.apply_mass(shape));
        let force = |i: usize, _| lambda * inertial[(missing[i], 0)] - elastic[(missing[i], 0)];
        let mut values = Mat::from_fn(missing.len(), 1, force);
        // Solve for the missing rows, unless the factor is inaccurate.
        let factor = Indefinite::<f64>::new(&analysis, &pencil, lambda);
        let inertia = factor.inertia();
        if inertia.zero > 0 || inertia.backward_error.is_nan() || inertia.backward_error > MAX_BACKWARD_ERROR
        {
            return Err(refuse("they cannot be computed from the other rows").into());
        }
        factor.solve_in_place(values.as_mut());
        missing.iter().enumerate().for_each(|(i, row)| shapes[(*row, mode)] = values[(i, 0)]);
    }
    Ok(())
}

/// Returns the submatrix of M on some rows (ascending) and equal columns.
fn principal_mass(pencil: &Pencil<'_>, rows: &[usize]) -> SymmetricMatrix {
    let (mass, block) = (pencil.mass(), pencil.block());
    if block == 1 {
        return mass.principal(rows);
    }
    let mut entries = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let (columns, values) = mass.row(row / block);
        for (column, value) in columns.iter().zip(values) {
            if let Ok(j) = rows.binary_search(&(*column as usize * block + row % block)) {
                entries.push((i as u32, j as u32, *value));
            }
        }
    }
    let matrix = CscMatrix::from_triplets(rows.len(), rows.len(), &entries);
    SymmetricMatrix::new(matrix).expect("rows and the same columns of a symmetric matrix")
}

/// Eigenvalues in a mode file, with the digits of eigenvalues and shapes.
#[derive(Debug, Clone, PartialEq)]
struct StatedModes {
    eigenvalues: Vec<Option<f64>>,
    eigenvalue_digits: u8,
    digits: u8,
    path: PathBuf,
}

/// Share of a mode, in the M-norm, that must lie in modes of its frequency.
const MIN_FREQUENCY_SHARE: f64 = 0.99;

/// Relative distance of eigenvalues below which modes count as one frequency: any mixture of their shapes
/// is valid.
const SAME_FREQUENCY_DISTANCE: f64 = 1e-3;

/// Largest number of modes that a message names one by one.
const MAX_NAMED_MODES: usize = 3;

/// Mode that differs from the data in its file.
struct Difference {
    mode: usize,
    stated: f64,
    /// Rayleigh quotient x'Kx / x'Mx.
    rayleigh: f64,
    /// Modal assurance criterion: share of the mode in modes of its frequency.
    assurance: f64,
    /// True if the digits of the shape explain the difference.
    rounded: bool,
}

impl StatedModes {
    pub(super) fn of(raw: RawModes) -> Self {
        let RawModes { eigenvalues, eigenvalue_digits, digits, path, .. } = raw;
        Self { eigenvalues, eigenvalue_digits, digits, path }
    }

    /// Compares the modes of the file (columns of `shapes`, of which those in `flexible` deform the body)
    /// with K and M. Returns `None` if they agree.
    pub(super) fn beside(
        &self,
        model: &FeModel,
        shapes: MatRef<'_, f64>,
        flexible: &[usize],
        solution: &EigenSolution,
    ) -> Option<Diagnostic> {
        let different = self.differences(model, shapes, flexible, solution);
        let worst = different.first()?;
        let hertz = |eigenvalue: f64| model.units().frequency_of(eigenvalue.max(0.0));
        let said = |one: &Difference| {
            let (stated, computed) = (hertz(one.stated), hertz(one.rayleigh));
            let assurance = if one.assurance < MIN_FREQUENCY_SHARE {
                format!(", MAC {:.2}", one.assurance)
            } else {
                String::new()
            };
            format!(
                "mode {} has {stated:.6} Hz in the file, {computed:.6} Hz by K and M{assurance}",
                one.mode + 1
            )
        };
        let named: Vec<String> = different.iter().take(MAX_NAMED_MODES).map(said).collect();
        let more = if different.len() > MAX_NAMED_MODES { "; ..." } else { "" };
        let message = format!(
            "{} of {} flexible modes differ: {}{more}",
            different.len(),
            flexible.len(),
            named.join("; ")
        );
        let diagnostic = Diagnostic::new(Code::ModesDiffer, message).in_file(&self.path);
        Some(if worst.rounded && different.iter().all(|one| one.rounded) {
            diagnostic.with_help(format!(
                "write the shapes with more than {} digits, which explain the difference, or compute the modes here",
                self.digits
            ))
        } else {
            diagnostic
        })
    }

    fn differences(
        &self,
        model: &FeModel,
        shapes: MatRef<'_, f64>,
        flexible: &[usize],
        solution: &EigenSolution,
    ) -> Vec<Difference> {
        let pencil = model.pencil();
        let moved = pencil.apply_mass(shapes);
        let masses = column_products(shapes, moved.as_ref());
        let energies = column_products(shapes, pencil.apply_stiffness(shapes).as_ref());
        let stiffness = pencil.stiffness().diagonal();
        let shares = gram(solution.vectors.as_ref(), moved.as_ref());
        // The share is known only if the solution contains all modes.
        let is_whole = solution.eigenvalues.len() == flexible.len();
        let precision = 10f64.powi(2 - i32::from(self.eigenvalue_digits));
        let of_mode = |&mode: &usize| {
            let stated = self.eigenvalues[mode]?;
            let rayleigh = energies[mode] / masses[mode];
            let square = |p: usize| shares[(p, mode)].powi(2);
            let all: f64 = (0..solution.eigenvalues.len()).map(square).sum();
            let is_close =
                |p: &usize| (solution.eigenvalues[*p] - rayleigh).abs() <= SAME_FREQUENCY_DISTANCE * rayleigh;
            let close = (0..solution.eigenvalues.len()).filter(is_close).map(square).fold(0.0, |a, b| a + b);
            let assurance = if is_whole && all > 0.0 { close / all } else { 1.0 };
            let difference = (stated - rayleigh).abs();
            if difference <= precision * stated.abs().max(rayleigh) && assurance >= MIN_FREQUENCY_SHARE {
                return None;
            }
            let noise = self.rounding_energy(&stiffness, shapes, mode) / masses[mode];
            let rounded = difference <= precision * stated.abs() + 10.0 * noise && stated > 0.0;
            Some(Difference { mode, stated, rayleigh, assurance, rounded })
        };
        flexible.iter().filter_map(of_mode).collect()
    }

    /// Returns twice the strain energy expected from rounding the values of a shape to their digits: the
    /// sum of K_ii u_i^2 / 12, where u_i is one unit of the last digit of the value.
    fn rounding_energy(&self, stiffness: &[f64], shapes: MatRef<'_, f64>, mode: usize) -> f64 {
        let unit = |value: f64| {
            if value == 0.0 {
                0.0
            } else {
                10f64.powi(log10(value.abs()).floor() as i32 + 1 - i32::from(self.digits))
            }
        };
        let column = shapes.col(mode);
        stiffness.iter().zip(column.iter()).map(|(k, value)| k * unit(*value).powi(2) / 12.0).sum()
    }
}
