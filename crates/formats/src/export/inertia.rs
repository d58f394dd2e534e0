//! The nine invariants for programs whose mass commutes with rotations.

use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::Numbered;

/// Returns I1 to I9 of a body for programs that take I5_jk as antisymmetric in j and k and use I9 twice: its
/// part that is symmetric in a and b for W2, the other part for W3 (Coriolis). I5 and I9 are always present,
/// zero if the body does not hold them.
///
/// For a mass that commutes with rotations the result is
/// [`Invariants::numbered`](flexbody_body::invariants::Invariants::numbered). For other masses, and for a
/// body that holds only one of W2 and W3, I9_jk(a,b) = -(W2 + W2')/2 -+ W3_c / 2 is assembled from the terms
/// of the body, with the antisymmetric part of W3: the equations then conserve momentum and energy like those
/// of the body. The omitted part is the loss reported by [`general_w3`](super::losses::general_w3).
pub(crate) fn inertia(body: &FlexBody) -> Numbered {
    let invariants = body.invariants();
    let nf = body.n_modes();
    let mut numbered = invariants.numbered();
    if invariants.general().is_none() && numbered.groups.w2 && numbered.groups.w3 {
        return numbered;
    }
    let w3 = numbered.i5.take().unwrap_or_else(|| Mat::zeros(3 * nf, nf));
    let w2 = numbered.i9.take().unwrap_or_else(|| Mat::zeros(3 * nf, 3 * nf));
    let i5 = |c: usize, j: usize, k: usize| 0.5 * (w3[(c * nf + j, k)] - w3[(c * nf + k, j)]);
    let i9 = |row: usize, column: usize| {
        let (a, j, b, k) = (row / nf, row % nf, column / nf, column % nf);
        let symmetric = 0.5 * (w2[(row, column)] + w2[(b * nf + j, a * nf + k)]);
        match (3 + b - a) % 3 {
            0 => symmetric,
            1 => symmetric - 0.5 * i5(3 - a - b, j, k),
            _ => symmetric + 0.5 * i5(3 - a - b, j, k),
        }
    };
    numbered.i9 = Some(Mat::from_fn(3 * nf, 3 * nf, i9));
    numbered.i5 = Some(Mat::from_fn(3 * nf, nf, |row, k| i5(row / nf, row % nf, k)));
    numbered
}
