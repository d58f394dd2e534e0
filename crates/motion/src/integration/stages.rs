//! Stages of an implicit step, decoupled by the eigenvalues of the method.

use nalgebra::{Complex, DMatrix};

/// Number of stages of the method of the highest order.
pub const STAGES: usize = 3;

/// Eigenvalue mu of the matrix A of the method, with its part of every stage: the sum over all eigenvalues
/// of right_i mu left_j is A_ij. Of a conjugate pair only the eigenvalue above the real axis is stored, and
/// twice the real part of its contribution counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageMode {
    /// Eigenvalue mu; mu and mu^2 lie to the right of the imaginary axis.
    pub value: Complex<f64>,
    /// Weights that extract the part of this eigenvalue from the stages.
    pub left: [Complex<f64>; STAGES],
    /// Weights that distribute this part to the stages.
    pub right: [Complex<f64>; STAGES],
    /// True if there is a conjugate eigenvalue.
    pub paired: bool,
}

/// Returns the eigenvalues of the first `stages` rows and columns of A, which are distinct.
pub(super) fn stage_modes(a: &[[f64; STAGES]; STAGES], stages: usize) -> Vec<StageMode> {
    let matrix = DMatrix::from_fn(stages, stages, |i, j| a[i][j]);
    let complex = matrix.map(|entry| Complex::new(entry, 0.0));
    let values = matrix.complex_eigenvalues();
    let identity = DMatrix::<Complex<f64>>::identity(stages, stages);
    let mode = |value: Complex<f64>, at: usize| {
        // The projector prod (A - nu) / (mu - nu) over all other nu, of rank one.
        let others = (0..stages).filter(|&other| other != at).map(|other| values[other]);
        let projector = others.fold(identity.clone(), |product, other| {
            product * (&complex - &identity * other) / (value - other)
        });
        let (row, column) = largest_entry(&projector);
        let entry = |i: usize, j: usize| {
            if i < stages && j < stages { projector[(i, j)] } else { Complex::new(0.0, 0.0) }
        };
        StageMode {
            value,
            left: std::array::from_fn(|j| entry(row, j) / projector[(row, column)]),
            right: std::array::from_fn(|i| entry(i, column)),
            paired: is_paired(value),
        }
    };
    let mut modes: Vec<StageMode> =
        (0..stages).filter(|&at| !below(values[at])).map(|at| mode(values[at], at)).collect();
    modes.sort_by(|a, b| a.value.im.total_cmp(&b.value.im));
    for mode in modes.iter_mut().filter(|mode| !mode.paired) {
        mode.value.im = 0.0;
        mode.left.iter_mut().chain(&mut mode.right).for_each(|entry| entry.im = 0.0);
    }
    modes
}

/// Returns the position of the entry of largest magnitude.
fn largest_entry(matrix: &DMatrix<Complex<f64>>) -> (usize, usize) {
    let places = (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| (i, j)));
    let size = |at: &(usize, usize)| matrix[*at].norm_sqr();
    places.max_by(|a, b| size(a).total_cmp(&size(b))).expect("a matrix with entries")
}

/// Imaginary part relative to the real part that counts as rounding.
const IMAGINARY_ROUNDING: f64 = 1e-9;

fn is_paired(value: Complex<f64>) -> bool {
    value.im.abs() > IMAGINARY_ROUNDING * value.re.abs()
}

fn below(value: Complex<f64>) -> bool {
    is_paired(value) && value.im < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_and_their_parts_make_the_matrix() {
        let b = 15.0_f64.sqrt();
        let matrices = [
            ([[0.5, 0.0, 0.0], [0.0; 3], [0.0; 3]], 1),
            (
                [
                    [0.25, 0.25 - 3.0_f64.sqrt() / 6.0, 0.0],
                    [0.25 + 3.0_f64.sqrt() / 6.0, 0.25, 0.0],
                    [0.0; 3],
                ],
                2,
            ),
            (
                [
                    [5.0 / 36.0, 2.0 / 9.0 - b / 15.0, 5.0 / 36.0 - b / 30.0],
                    [5.0 / 36.0 + b / 24.0, 2.0 / 9.0, 5.0 / 36.0 - b / 24.0],
                    [5.0 / 36.0 + b / 30.0, 2.0 / 9.0 + b / 15.0, 5.0 / 36.0],
                ],
                3,
            ),
        ];
        for (a, stages) in matrices {
            let modes = stage_modes(&a, stages);
            assert_eq!(modes.len(), stages.div_ceil(2));
            for (i, row) in a.iter().enumerate().take(stages) {
                for (j, entry) in row.iter().enumerate().take(stages) {
                    let part = |mode: &StageMode| {
                        let own = mode.right[i] * mode.value * mode.left[j];
                        if mode.paired { 2.0 * own.re } else { own.re }
                    };
                    let sum: f64 = modes.iter().map(part).sum();
                    assert!((sum - entry).abs() < 1e-14, "{stages} stages: ({i}, {j})");
                }
            }
            for mode in modes {
                let square = mode.value * mode.value;
                assert!(mode.value.re > 0.0 && square.re > 0.0 && square.im >= 0.0, "{mode:?}");
            }
        }
    }
}
