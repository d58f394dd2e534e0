//! Exact rational arithmetic as an oracle.

use num_rational::BigRational;
use num_traits::Zero;

/// Returns the exact value of an f64.
pub fn exact(value: f64) -> BigRational {
    BigRational::from_float(value).expect("finite")
}

/// Returns the number of eigenvalues of the pencil (K, M) below `sigma`: the negative eigenvalues of K - sigma M, by
/// exact elimination with pivots of one or two rows (Sylvester's law of inertia).
pub fn count_below(k: &[Vec<f64>], m: &[Vec<f64>], sigma: f64) -> usize {
    let n = k.len();
    let sigma = exact(sigma);
    let mut a: Vec<Vec<BigRational>> =
        (0..n).map(|i| (0..n).map(|j| exact(k[i][j]) - &sigma * exact(m[i][j])).collect()).collect();
    let zero = BigRational::zero();
    let mut left: Vec<usize> = (0..n).collect();
    let mut negative = 0;
    while !left.is_empty() {
        let one = left.iter().position(|&i| a[i][i] != zero);
        if one.is_none() {
            // Only off-diagonal entries are left: adding a row and its column to another is a congruence.
            let pair =
                left.iter().flat_map(|&i| left.iter().map(move |&j| (i, j))).find(|&(i, j)| a[i][j] != zero);
            let Some((i, j)) = pair else { break };
            for &c in &left {
                let value = a[j][c].clone();
                a[i][c] += value;
            }
            for &c in &left {
                let value = a[c][j].clone();
                a[c][i] += value;
            }
            continue;
        }
        // Elimination by a pivot of one row, whose sign counts.
        let p = left.swap_remove(one.expect("just tested"));
        let pivot = a[p][p].clone();
        negative += usize::from(pivot < zero);
        for &i in &left {
            if a[i][p] == zero {
                continue;
            }
            let factor = &a[i][p] / &pivot;
            for &j in &left {
                let change = &factor * &a[p][j];
                a[i][j] -= change;
            }
        }
    }
    negative
}
