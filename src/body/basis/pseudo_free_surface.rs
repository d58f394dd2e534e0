//! Pseudo-free-surface modes from any shapes (theory section 5): the rigid part is removed, what is left M-orthonormalised,
//! and the small eigenproblem solved. Every identity of theory section 10 then holds, whatever the shapes were.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::numerics::linalg::{Pencil, column_products, gram, subtract_combination};
use faer::{Mat, MatRef};

/// A shape of which rigid motion leaves less than this part of its M-norm is a rigid motion: those that eigen-solvers give
/// stand at 1e-6 and below.
const RIGID: f64 = 1e-5;

/// Squared M-norm of a shape relative to sum_i M_ii psi_i^2 below which it moves no mass: rounding leaves 1e-15.
const MASSLESS: f64 = 1e-12;

/// The same for what is left of a shape beside others: a singular M sees almost nothing of some combinations of shapes that it sees.
/// Below, such a shape would be so large, and its eigenvalue so high, that the others lose their digits beside it.
const NEARLY_MASSLESS: f64 = 1e-4;

/// The part of a set of shapes that spans deformations, and what became of the rest (indices from 0).
#[derive(Debug, Clone)]
pub(super) struct Independent {
    /// M-orthonormal to rounding over the criterion of dependence; M-orthogonal to the rigid modes.
    pub vectors: Mat<f64>,
    /// Which shapes they are made of: column j lies in the span of the shapes up to kept\[j\].
    pub kept: Vec<usize>,
    pub rigid: Vec<usize>,
    pub massless: Vec<usize>,
    /// Those that the shapes before them span, with the part of the M-norm that is left.
    pub dependent: Vec<(usize, f64)>,
}

/// Removes the rigid part, Psi - R R'M Psi (`rigid` R is M-orthonormal), and M-orthonormalises the columns in their order by the modified
/// Gram-Schmidt process, twice. A column of which less than `dependent` of its M-norm is left after those before it is
/// left out.
///
/// `None`: a column has a negative M-norm beyond rounding, M is indefinite.
pub(super) fn independent(
    pencil: &Pencil<'_>,
    rigid: MatRef<'_, f64>,
    mut shapes: Mat<f64>,
    dependent: f64,
) -> Option<Independent> {
    let (n, k) = (shapes.nrows(), shapes.ncols());
    let diagonal = pencil.mass_diagonal();
    let diagonal_square = |a: &Mat<f64>, j: usize| -> f64 {
        diagonal.iter().zip(a.col(j).iter()).map(|(m, s)| m * s * s).sum()
    };
    let mut out = Independent {
        vectors: Mat::zeros(0, 0),
        kept: Vec::new(),
        rigid: Vec::new(),
        massless: Vec::new(),
        dependent: Vec::new(),
    };
    // Unit size first: squares of shapes in any unit stay in range.
    for j in 0..k {
        let factor = 1.0 / shapes.col(j).norm_max();
        if factor.is_finite() {
            scale(&mut shapes, j, factor);
        }
    }
    let mut products = pencil.apply_mass(shapes.as_ref());
    let mut moving = vec![true; k];
    for (j, square) in column_products(shapes.as_ref(), products.as_ref()).into_iter().enumerate() {
        let bound = diagonal_square(&shapes, j);
        if square < -MASSLESS.sqrt() * bound {
            return None;
        }
        if square <= MASSLESS * bound {
            out.massless.push(j);
            moving[j] = false;
        } else {
            scale(&mut shapes, j, 1.0 / square.sqrt());
        }
    }
    for pass in 0..2 {
        // Twice: a shape may be rigid motion but for its last digits.
        products = pencil.apply_mass(shapes.as_ref());
        let along = gram(rigid, products.as_ref());
        subtract_combination(shapes.as_mut(), rigid, along.as_ref());
        if pass == 0 {
            products = pencil.apply_mass(shapes.as_ref());
            for (j, square) in column_products(shapes.as_ref(), products.as_ref()).into_iter().enumerate() {
                let left = square.max(0.0).sqrt();
                if moving[j] && left < RIGID {
                    out.rigid.push(j);
                    moving[j] = false;
                } else if moving[j] {
                    scale(&mut shapes, j, 1.0 / left);
                }
            }
        }
    }
    products = pencil.apply_mass(shapes.as_ref());
    // The vectors found so far are the first columns of both blocks.
    for j in (0..k).filter(|&j| moving[j]) {
        let found = out.kept.len();
        let mut vector = shapes.as_ref().subcols(j, 1).to_owned();
        let mut product = products.as_ref().subcols(j, 1).to_owned();
        for _ in 0..2 {
            let along = gram(shapes.as_ref().subcols(0, found), product.as_ref());
            subtract_combination(vector.as_mut(), shapes.as_ref().subcols(0, found), along.as_ref());
            subtract_combination(product.as_mut(), products.as_ref().subcols(0, found), along.as_ref());
        }
        let left = column_products(vector.as_ref(), product.as_ref())[0].max(0.0).sqrt();
        if left < dependent {
            out.dependent.push((j, left));
            continue;
        }
        // Afresh: the product was the difference of larger ones.
        product = pencil.apply_mass(vector.as_ref());
        let square = column_products(vector.as_ref(), product.as_ref())[0];
        // A singular M: what is left of shapes with mass may have none.
        if square <= NEARLY_MASSLESS * diagonal_square(&vector, 0) {
            out.massless.push(j);
            continue;
        }
        let norm = square.sqrt();
        for i in 0..n {
            shapes[(i, found)] = vector[(i, 0)] / norm;
            products[(i, found)] = product[(i, 0)] / norm;
        }
        out.kept.push(j);
    }
    out.vectors = shapes.as_ref().subcols(0, out.kept.len()).to_owned();
    Some(out)
}

impl Independent {
    /// What the user should know of the shapes that were left out; `what` names them, as in `imported shapes`, and `name` each.
    pub fn notes(&self, what: &str, criterion: f64, name: impl Fn(usize) -> String) -> Vec<Diagnostic> {
        let all = self.kept.len() + self.rigid.len() + self.massless.len() + self.dependent.len();
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
            let left = |&(j, left): &(usize, f64)| format!("{} ({left:.0e})", name(j));
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

/// `a, b, c`, or `a, b, c, d, e and 7 more`.
pub(super) fn named(columns: Vec<String>) -> String {
    match columns.len() {
        0..=6 => columns.join(", "),
        count => format!("{} and {} more", columns[..5].join(", "), count - 5),
    }
}

fn scale(a: &mut Mat<f64>, j: usize, factor: f64) {
    a.as_mut().col_mut(j).iter_mut().for_each(|value| *value *= factor);
}

/// For each mode, the shape with the largest share in it, and that share: the square of its amplitude in `parts` (shapes x modes) for
/// M-orthonormal shapes and modes.
pub(super) fn largest_shares(parts: MatRef<'_, f64>) -> Vec<(usize, f64)> {
    let shares = |p: usize| parts.col(p).iter().map(|a| a * a).enumerate();
    let largest = |p: usize| shares(p).fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most });
    (0..parts.ncols()).map(largest).collect()
}
