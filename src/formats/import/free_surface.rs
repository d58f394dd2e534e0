//! Free-surface mass-normalised modes from any modes, with nothing but their invariants (theory 5.2).

use super::any_body::{ANY_BODY, DIGITS};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Result;
use crate::body::invariants::{
    Expected, GeneralTerms, IdentityCheck, Invariants, identities, symmetric_part,
};
use crate::numerics::linalg::{dense_cholesky, larger, solve_lower, solve_upper, symmetric_eigen};
use faer::Mat;

/// A mode of which less than this part of its squared M-norm is left without rigid motion is a rigid motion.
const RIGID: f64 = 1e-10;

/// What the digits of FE matrices leave of K_ff beside its diagonal, and more: so near to it, eigenvalues
/// differ from the diagonal by the square of this.
const NEARLY_DIAGONAL: f64 = 1e-6;

/// How far the modes are from mass-normalised free-surface modes, the worst of the identities that say so;
/// `None` when they are such modes.
pub(crate) fn is_free_surface(invariants: &Invariants) -> Option<f64> {
    let about_modes = ["modal_mass_identity", "c1_zero", "c2_zero"];
    let missed = of_modes(invariants)
        .into_iter()
        .filter(|check| about_modes.contains(&check.name) && !check.passed)
        .map(|check| check.value)
        .fold(0.0, larger);
    let beside = beside_diagonal(invariants);
    let k = invariants.modal_stiffness();
    let nearly = |j: usize| k[(j - 1, j - 1)] - k[(j, j)] <= DIGITS * k[(j, j)];
    let ascending = k[(0, 0)] > 0.0 && (1..k.ncols()).all(nearly);
    let diagonal = beside <= NEARLY_DIAGONAL;
    let missed = if diagonal { missed } else { missed.max(beside) };
    // A value that is no number is not zero either.
    (missed != 0.0 || !diagonal || !ascending).then_some(missed)
}

/// The largest entry of K_ff beside its diagonal, relative to the diagonal entries of its row and column.
pub(crate) fn beside_diagonal(invariants: &Invariants) -> f64 {
    let diagonal = of_modes(invariants).into_iter().find(|check| check.name == "modal_stiffness_diagonal");
    diagonal.map_or(f64::NAN, |check| check.value)
}

/// The identities of mass-normalised free-surface modes with the frequencies that the diagonal of K_ff tells.
fn of_modes(invariants: &Invariants) -> Vec<IdentityCheck> {
    let eigenvalues: Vec<f64> =
        (0..invariants.n_modes()).map(|j| invariants.modal_stiffness()[(j, j)]).collect();
    let expected =
        Expected { mass_normalised: true, free_surface: true, eigenvalues: Some(&eigenvalues), ..ANY_BODY };
    identities(invariants, &expected)
}

/// The change of modes psi' = (Psi - R A) X with the rigid motions R and X of the small eigenproblem.
pub(crate) struct FreeSurface {
    /// A (6 x nf): rigid motion in each mode.
    rigid: Mat<f64>,
    /// X (nf x nf').
    modes: Mat<f64>,
    /// Modes of the file that are rigid motions (from 0).
    dropped: Vec<usize>,
}

impl FreeSurface {
    /// # Errors
    /// [`ForeignIncomplete`](Code::ForeignIncomplete).
    pub(crate) fn new(invariants: &Invariants) -> Result<Self> {
        let nf = invariants.n_modes();
        let mass = invariants.mass_matrix();
        let rigid = mass.as_ref().submatrix(0, 0, 6, 6).to_owned();
        let Some(lower) = dense_cholesky(rigid) else {
            return refuse("the mass matrix of rigid motion is not positive definite");
        };
        let whitened = solve_lower(&lower, &mass.as_ref().submatrix(0, 6, 6, nf).to_owned());
        let left = |i: usize, j: usize| {
            mass[(6 + i, 6 + j)] - (0..6).map(|k| whitened[(k, i)] * whitened[(k, j)]).sum::<f64>()
        };
        if let Some(j) = (0..nf).find(|&j| left(j, j) < -RIGID * mass[(6 + j, 6 + j)]) {
            return refuse(&format!(
                "mode {} and rigid motion together have negative kinetic energy: mass, coupling and modal mass do not belong together",
                j + 1
            ));
        }
        let (dropped, kept): (Vec<usize>, Vec<usize>) =
            (0..nf).partition(|&j| left(j, j) <= RIGID * mass[(6 + j, 6 + j)]);
        let elastic = Mat::from_fn(kept.len(), kept.len(), |i, j| left(kept[i], kept[j]));
        let modes = eigenmodes(invariants, elastic, &kept)?;
        Ok(Self { rigid: solve_upper(&lower, &whitened), modes, dropped })
    }

    /// The note that the modes were changed: those of the file miss the identities of free-surface modes by
    /// `missed`.
    pub(crate) fn note(&self, missed: f64) -> Diagnostic {
        let mut message = format!(
            "modes of the file are no mass-normalised free-surface modes (by {missed:.1e}): they were made such"
        );
        if !self.dropped.is_empty() {
            let numbers: Vec<String> = self.dropped.iter().map(|j| (j + 1).to_string()).collect();
            message.push_str(&format!("; rigid motions left out: {}", numbers.join(", ")));
        }
        Diagnostic::new(Code::ForeignChanged, message)
    }

    /// X'A X.
    pub(crate) fn congruent(&self, a: &Mat<f64>) -> Mat<f64> {
        symmetric_part(&(self.modes.transpose() * a * &self.modes))
    }

    /// A X: what is taken from each new mode.
    fn taken(&self) -> Mat<f64> {
        &self.rigid * &self.modes
    }

    pub(crate) fn shapes(&self, shape: &Mat<f64>, positions: &[[f64; 3]]) -> Mat<f64> {
        let (new, taken) = (shape * &self.modes, self.taken());
        Mat::from_fn(new.nrows(), new.ncols(), |row, j| {
            let (x, k) = (positions[row / 3], row % 3);
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            new[(row, j)] - taken[(k, j)] - (taken[(3 + l, j)] * x[m] - taken[(3 + m, j)] * x[l])
        })
    }

    /// Rotations of the frames that have some.
    pub(crate) fn rotations(&self, rotation: &Mat<f64>, turns: &[bool]) -> Mat<f64> {
        let (new, taken) = (rotation * &self.modes, self.taken());
        Mat::from_fn(new.nrows(), new.ncols(), |row, j| {
            if turns[row / 3] { new[(row, j)] - taken[(3 + row % 3, j)] } else { 0.0 }
        })
    }

    /// The invariants in the new modes. Where M does not commute with rotations, what S does not tell of W3
    /// is taken as that of the modes, none of it as that of the rigid motion in them.
    pub(crate) fn invariants(&self, old: &Invariants) -> Invariants {
        let nf = old.n_modes();
        let taken = self.taken();
        let t = Mat::from_fn(6 + nf, self.modes.ncols(), |i, j| match i.checked_sub(6) {
            None => -taken[(i, j)],
            Some(mode) => self.modes[(mode, j)],
        });
        let mut new = old.with_rigid_modes().with_basis(t.as_ref());
        if let Some(general) = old.general() {
            let (own, mut w3) = (old.w3_of_s(), new.w3_of_s());
            let count = new.n_modes();
            for a in 0..3 {
                let beside = Mat::from_fn(nf, nf, |i, j| general.w3[(a * nf + i, j)] - own[(a * nf + i, j)]);
                let change = self.modes.transpose() * beside * &self.modes;
                (0..count).for_each(|i| (0..count).for_each(|j| w3[(a * count + i, j)] += change[(i, j)]));
            }
            let (w0, modal_mass) = (new.w0(), Mat::identity(count, count));
            new = new.with_general(GeneralTerms { w0, w3, modal_mass, plane: false });
        }
        new.with_groups(old.groups())
    }
}

fn refuse<T>(message: &str) -> Result<T> {
    let help = "flexbody audit says what is wrong with the file; write it anew";
    Err(Diagnostic::new(Code::ForeignIncomplete, message).with_help(help).into())
}

/// X (nf x nf'): the eigenmodes of the stiffness of the modes `kept`, with their mass `elastic` beside rigid
/// motion.
fn eigenmodes(invariants: &Invariants, elastic: Mat<f64>, kept: &[usize]) -> Result<Mat<f64>> {
    let Some(factor) = dense_cholesky(elastic).filter(|_| !kept.is_empty()) else {
        return refuse(
            "modes are rigid motions or depend on each other: their mass matrix is not positive definite",
        );
    };
    let stiffness =
        Mat::from_fn(kept.len(), kept.len(), |i, j| invariants.modal_stiffness()[(kept[i], kept[j])]);
    let half = solve_lower(&factor, &stiffness);
    let small = solve_lower(&factor, &half.transpose().to_owned());
    let eigen = symmetric_eigen(small.as_ref());
    let Some(eigen) = eigen.filter(|eigen| eigen.values.first().is_some_and(|first| *first > 0.0)) else {
        return refuse("the stiffness of the modes is not positive definite beside their mass");
    };
    let kept_modes = solve_upper(&factor, &eigen.vectors);
    let mut modes = Mat::zeros(invariants.n_modes(), kept.len());
    for j in 0..kept.len() {
        // The largest part of each new mode keeps its sign.
        let largest = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
        let sign = kept_modes.col(j).iter().fold(0.0, largest).signum();
        for (i, &row) in kept.iter().enumerate() {
            modes[(row, j)] = sign * kept_modes[(i, j)];
        }
    }
    Ok(modes)
}
