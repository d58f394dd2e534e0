//! Pseudo-free-surface modes from any shapes (theory section 5): the rigid part is removed, the remainder
//! is M-orthonormalised, and the small eigenproblem is solved. Every identity of theory section 10 then
//! holds for any shapes.

use super::massless::MasslessMotions;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{
    Pencil, column_products, combine, gram, side_by_side, subtract_combination, symmetric_eigen,
};

/// Relative M-norm after removal of rigid motion below which a shape counts as a rigid motion. Rigid
/// motions from eigen-solvers leave 1e-6 and less.
const RIGID_REMAINDER: f64 = 1e-5;

/// Squared M-norm of a shape relative to sum_i M_ii psi_i^2 below which the shape moves no mass: rounding
/// leaves 1e-15.
const MASSLESS_SHAPE: f64 = 1e-12;

/// Limit of this ratio for the remainder of a shape after projection against others. With a singular M some
/// combinations of shapes have almost no mass. Below the limit such a remainder, once normalised, would be
/// so large and its eigenvalue so high that the other shapes lose their digits.
const MASSLESS_REMAINDER: f64 = 1e-4;

/// Elastic energy of the remainder of a shape, relative to that of the whole shape, above which the
/// remainder is a massless motion and not the rounding error of a dependent shape.
const MIN_ELASTIC_ENERGY: f64 = 1e-10;

/// Linearly independent deformations in a set of shapes, and the removed shapes by reason (indices from 0).
#[derive(Debug, Clone)]
pub(super) struct Independent {
    /// M-orthonormal up to rounding over the dependence limit, and M-orthogonal to the rigid modes.
    pub vectors: Mat<f64>,
    /// Indices of the kept shapes: column j lies in the span of the shapes up to kept\[j\].
    pub retained: Vec<usize>,
    pub rigid: Vec<usize>,
    pub massless: Vec<usize>,
    /// Shapes that depend on the shapes before them, with the M-norm that projection leaves.
    pub dependent: Vec<(usize, f64)>,
}

/// Removes the rigid part, Psi - R R'M Psi (`rigid` R is M-orthonormal), and M-orthonormalises the columns
/// in their order by the modified Gram-Schmidt process, repeated once. Columns whose relative M-norm falls
/// below `dependent` after projection against the columns before them, or after removal of rigid motion,
/// are dropped, and so are columns that move no mass. The square of such a column may be rounding, which only the `motions`
/// without mass of the model tell.
///
/// Returns `None` if M is indefinite: a column has a negative squared M-norm beyond rounding.
pub(super) fn independent(
    pencil: &Pencil<'_>,
    rigid: MatRef<'_, f64>,
    shapes: Mat<f64>,
    dependent: f64,
    motions: Option<&MasslessMotions<'_>>,
) -> Option<Independent> {
    let mut set = ShapeSet::new(pencil, shapes, motions);
    set.scale_to_unit_size();
    set.scale_to_unit_mass()?;
    // Remove rigid motion twice: a shape may differ from a rigid motion only in its last digits.
    set.remove_rigid(rigid);
    set.leave_out_rigid(RIGID_REMAINDER.max(dependent));
    set.remove_rigid(rigid);
    let (mut found, without_mass) = set.orthonormalised(dependent);
    found.vectors = in_equilibrium(pencil, rigid, found.vectors, &without_mass);
    Some(found)
}

/// Working set of the shapes during orthonormalisation.
struct ShapeSet<'a> {
    pencil: &'a Pencil<'a>,
    motions: Option<&'a MasslessMotions<'a>>,
    mass_diagonal: Vec<f64>,
    shapes: Mat<f64>,
    /// True for each shape that is still in the set.
    is_in: Vec<bool>,
    /// Removed directions with no mass or almost none.
    without_mass: Vec<Mat<f64>>,
    outcome: Independent,
}

impl<'a> ShapeSet<'a> {
    fn new(pencil: &'a Pencil<'a>, shapes: Mat<f64>, motions: Option<&'a MasslessMotions<'a>>) -> Self {
        let outcome = Independent {
            vectors: Mat::zeros(0, 0),
            retained: Vec::new(),
            rigid: Vec::new(),
            massless: Vec::new(),
            dependent: Vec::new(),
        };
        let is_in = vec![true; shapes.ncols()];
        let (mass_diagonal, without_mass) = (pencil.mass_diagonal(), Vec::new());
        Self { pencil, motions, mass_diagonal, shapes, is_in, without_mass, outcome }
    }

    /// Scales the shapes to unit size, so that their squares stay in the range of numbers for any unit.
    fn scale_to_unit_size(&mut self) {
        for j in 0..self.shapes.ncols() {
            let factor = 1.0 / self.shapes.col(j).norm_max();
            if factor.is_finite() {
                scale(&mut self.shapes, j, factor);
            }
        }
    }

    /// Returns the squared M-norms.
    fn squares(&self) -> Vec<f64> {
        column_products(self.shapes.as_ref(), self.pencil.apply_mass(self.shapes.as_ref()).as_ref())
    }

    /// Scales the shapes to unit M-norm and removes those without mass. Returns `None` if a squared M-norm
    /// is negative beyond rounding.
    fn scale_to_unit_mass(&mut self) -> Option<()> {
        for (j, square) in self.squares().into_iter().enumerate() {
            let bound = diagonal_square(&self.mass_diagonal, &self.shapes, j);
            if square < -MASSLESS_SHAPE.sqrt() * bound {
                return None;
            }
            let shape = self.shapes.as_ref().subcols(j, 1);
            let is_massless = self.motions.is_some_and(|motions| motions.make_up(shape));
            if square <= MASSLESS_SHAPE * bound || is_massless {
                self.outcome.massless.push(j);
                self.without_mass.push(shape.to_owned());
                self.is_in[j] = false;
            } else {
                scale(&mut self.shapes, j, 1.0 / square.sqrt());
            }
        }
        Some(())
    }

    fn remove_rigid(&mut self, rigid: MatRef<'_, f64>) {
        let products = self.pencil.apply_mass(self.shapes.as_ref());
        let along = gram(rigid, products.as_ref());
        subtract_combination(self.shapes.as_mut(), rigid, along.as_ref());
    }

    /// Removes shapes that were rigid motions and scales the others to unit M-norm.
    fn leave_out_rigid(&mut self, rigid: f64) {
        for (j, square) in self.squares().into_iter().enumerate() {
            let left = square.max(0.0).sqrt();
            if self.is_in[j] && left < rigid {
                self.outcome.rigid.push(j);
                self.is_in[j] = false;
            } else if self.is_in[j] {
                scale(&mut self.shapes, j, 1.0 / left);
            }
        }
    }

    /// Runs the Gram-Schmidt process; also returns removed directions without mass. The vectors found so
    /// far are the first columns of the shapes and of their products with M.
    fn orthonormalised(self, dependent: f64) -> (Independent, Vec<Mat<f64>>) {
        let Self { pencil, motions, mass_diagonal, mut shapes, is_in, mut without_mass, mut outcome } = self;
        let mut products = pencil.apply_mass(shapes.as_ref());
        for j in (0..shapes.ncols()).filter(|&j| is_in[j]) {
            let found = outcome.retained.len();
            let (vector, product) = beside_first(found, &shapes, &products, j);
            let left = column_products(vector.as_ref(), product.as_ref())[0].max(0.0).sqrt();
            if left < dependent {
                if is_elastic(pencil, &vector, shapes.as_ref().subcols(j, 1)) {
                    without_mass.push(vector);
                }
                outcome.dependent.push((j, left));
                continue;
            }
            if motions.is_some_and(|motions| motions.make_up(vector.as_ref())) {
                outcome.massless.push(j);
                without_mass.push(vector);
                continue;
            }
            // Compute the product with M directly: the updated product is a difference of larger numbers.
            let product = pencil.apply_mass(vector.as_ref());
            let square = column_products(vector.as_ref(), product.as_ref())[0];
            // With a singular M the remainder of shapes that have mass may have none.
            let bound = diagonal_square(&mass_diagonal, &vector, 0);
            if square <= MASSLESS_REMAINDER * bound {
                outcome.massless.push(j);
                if square <= MASSLESS_SHAPE * bound {
                    without_mass.push(vector);
                }
                continue;
            }
            let norm = square.sqrt();
            for i in 0..shapes.nrows() {
                shapes[(i, found)] = vector[(i, 0)] / norm;
                products[(i, found)] = product[(i, 0)] / norm;
            }
            outcome.retained.push(j);
        }
        outcome.vectors = shapes.as_ref().subcols(0, outcome.retained.len()).to_owned();
        (outcome, without_mass)
    }
}

/// Returns true if the remainder `left` of a shape has elastic energy of its own.
fn is_elastic(pencil: &Pencil<'_>, left: &Mat<f64>, shape: MatRef<'_, f64>) -> bool {
    let energy = |x: MatRef<'_, f64>| column_products(x, pencil.apply_stiffness(x).as_ref())[0];
    energy(left.as_ref()) > MIN_ELASTIC_ENERGY * energy(shape)
}

/// Moves the massless motions Z `without_mass` in the vectors V to elastic equilibrium, V - Z (Z'K Z)^-1
/// Z'K V, and M-orthonormalises again, also against the `rigid` motions. Ritz vectors of finite frequency
/// in the span of both contain Z in no other way.
fn in_equilibrium(
    pencil: &Pencil<'_>,
    rigid: MatRef<'_, f64>,
    mut vectors: Mat<f64>,
    without_mass: &[Mat<f64>],
) -> Mat<f64> {
    if without_mass.is_empty() || vectors.ncols() == 0 {
        return vectors;
    }
    let motions = side_by_side(&without_mass.iter().map(Mat::as_ref).collect::<Vec<_>>());
    let forces = pencil.apply_stiffness(motions.as_ref());
    // K-orthonormalise Z, without directions of rounding.
    let energy = gram(motions.as_ref(), forces.as_ref());
    let sizes: Vec<f64> = (0..energy.nrows()).map(|j| energy[(j, j)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = Mat::from_fn(sizes.len(), sizes.len(), |i, j| energy[(i, j)] / (sizes[i] * sizes[j]));
    let Some(eigen) = symmetric_eigen(scaled.as_ref()) else { return vectors };
    let retained: Vec<usize> = (0..sizes.len()).filter(|&k| eigen.values[k] > MIN_ELASTIC_ENERGY).collect();
    let unit =
        |j: usize, k: usize| eigen.vectors[(j, retained[k])] / (sizes[j] * eigen.values[retained[k]].sqrt());
    let unit = Mat::from_fn(sizes.len(), retained.len(), unit);
    let (motions, forces) =
        (combine(motions.as_ref(), unit.as_ref()), combine(forces.as_ref(), unit.as_ref()));
    // V - Z Z'K V.
    let part = gram(forces.as_ref(), vectors.as_ref());
    subtract_combination(vectors.as_mut(), motions.as_ref(), part.as_ref());
    // M-orthogonal to rigid motion again.
    let along = gram(rigid, pencil.apply_mass(vectors.as_ref()).as_ref());
    subtract_combination(vectors.as_mut(), rigid, along.as_ref());
    // M-orthonormal again, in the order of the columns.
    let mut products = pencil.apply_mass(vectors.as_ref());
    for j in 0..vectors.ncols() {
        let (vector, _) = beside_first(j, &vectors, &products, j);
        let product = pencil.apply_mass(vector.as_ref());
        let norm = column_products(vector.as_ref(), product.as_ref())[0].sqrt();
        for i in 0..vectors.nrows() {
            vectors[(i, j)] = vector[(i, 0)] / norm;
            products[(i, j)] = product[(i, 0)] / norm;
        }
    }
    vectors
}

/// Returns shape j after projection against the first `found` columns, and its product with M.
fn beside_first(found: usize, shapes: &Mat<f64>, products: &Mat<f64>, j: usize) -> (Mat<f64>, Mat<f64>) {
    let mut vector = shapes.as_ref().subcols(j, 1).to_owned();
    let mut product = products.as_ref().subcols(j, 1).to_owned();
    for _ in 0..2 {
        let along = gram(shapes.as_ref().subcols(0, found), product.as_ref());
        subtract_combination(vector.as_mut(), shapes.as_ref().subcols(0, found), along.as_ref());
        subtract_combination(product.as_mut(), products.as_ref().subcols(0, found), along.as_ref());
    }
    (vector, product)
}

/// Returns sum_i M_ii psi_i^2 of column j.
fn diagonal_square(mass_diagonal: &[f64], a: &Mat<f64>, j: usize) -> f64 {
    mass_diagonal.iter().zip(a.col(j).iter()).map(|(m, s)| m * s * s).sum()
}

impl Independent {
    /// Returns diagnostics about the removed shapes. `what` names the set, such as `imported shapes`;
    /// `name` names a shape.
    pub(super) fn notes(
        &self,
        what: &str,
        criterion: f64,
        name: impl Fn(usize) -> String,
    ) -> Vec<Diagnostic> {
        let all = self.retained.len() + self.rigid.len() + self.massless.len() + self.dependent.len();
        let mut notes = Vec::new();
        if !self.rigid.is_empty() {
            let which = named(self.rigid.iter().map(|&j| name(j)).collect());
            let message =
                format!("{} of {all} {what} are rigid motions and are removed: {which}", self.rigid.len());
            notes.push(Diagnostic::new(Code::ShapesRigid, message));
        }
        if !self.massless.is_empty() {
            let which = named(self.massless.iter().map(|&j| name(j)).collect());
            let message =
                format!("{} of {all} {what} move no mass and are left out: {which}", self.massless.len());
            notes.push(Diagnostic::new(Code::ShapesDependent, message));
        }
        if !self.dependent.is_empty() {
            let left = |&(j, left): &(usize, f64)| format!("{} ({})", name(j), norm_in_words(left));
            let which = named(self.dependent.iter().map(left).collect());
            let message = format!(
                "{} of {all} {what} depend on those before them (less than {criterion:.0e} of the M-norm is left) and are left out: {which}",
                self.dependent.len()
            );
            notes.push(Diagnostic::new(Code::ShapesDependent, message));
        }
        notes
    }
}

/// Returns a relative norm as text for messages: values below the rounding of one have no digits.
pub(super) fn norm_in_words(left: f64) -> String {
    if left < f64::EPSILON { "rounding".to_owned() } else { format!("{left:.0e}") }
}

/// Joins names as `a, b, c`, or `a, b, c, d, e and 7 more`.
pub(super) fn named(columns: Vec<String>) -> String {
    match columns.len() {
        0..=6 => columns.join(", "),
        count => format!("{} and {} more", columns[..5].join(", "), count - 5),
    }
}

fn scale(a: &mut Mat<f64>, j: usize, factor: f64) {
    a.as_mut().col_mut(j).iter_mut().for_each(|value| *value *= factor);
}

/// Returns, for each mode, the shape with the largest share in it and that share: the square of its
/// amplitude in `parts` (shapes x modes) for M-orthonormal shapes and modes.
pub(super) fn largest_shares(parts: MatRef<'_, f64>) -> Vec<(usize, f64)> {
    let shares = |p: usize| parts.col(p).iter().map(|a| a * a).enumerate();
    let largest = |p: usize| first_largest(shares(p), |pair| pair.1).unwrap_or((0, 0.0));
    (0..parts.ncols()).map(largest).collect()
}
