//! Pairs of modes of two bodies, and the modal assurance criterion of their shapes.

use super::shapes::product;
use crate::notation::numbers::{frequency, significant};
use faer::{Mat, MatRef};
use flexbody_linalg::ties::sort_descending;
use serde::Serialize;

/// Least assurance of a pair of modes with one shape. Modes without such a partner are paired in ascending order, and their
/// frequencies are not those of one mode.
const MIN_ASSURANCE: f64 = 0.5;

/// Two modes that are compared, numbered from 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModePair {
    /// Mode of the first body.
    pub mode_a: usize,
    /// Mode of the second body.
    pub mode_b: usize,
    /// Frequency of the first mode in hertz.
    pub frequency_a_hz: f64,
    /// Frequency of the second mode in hertz.
    pub frequency_b_hz: f64,
    /// Difference of the frequencies relative to that of the first body; positive if the second one is higher.
    pub difference: f64,
    /// Modal assurance criterion of the displacements of the nodes, 1 for equal shapes; `None` if the bodies have
    /// different nodes.
    pub assurance: Option<f64>,
}

impl ModePair {
    /// Returns true if the shapes of the two modes are known and are not one.
    pub(super) fn is_of_strangers(&self) -> bool {
        self.assurance.is_some_and(|assurance| assurance < MIN_ASSURANCE)
    }

    /// Returns the numbers of the modes, their frequencies and the difference in words.
    pub(super) fn in_words(&self) -> String {
        let [a, b] = [self.frequency_a_hz, self.frequency_b_hz].map(|hertz| frequency(hertz, 7));
        let second = if self.mode_a == self.mode_b {
            "in the second".to_owned()
        } else {
            format!("in the second (its mode {})", self.mode_b)
        };
        format!(
            "mode {}: {a} in the first body, {b} {second}, {}",
            self.mode_a,
            signed_percent(self.difference)
        )
    }
}

/// Way in which the modes of two bodies are paired.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Pairing {
    /// By the displacements of their common nodes; modes whose shape is that of no mode of the other body in ascending order.
    Shape,
    /// In ascending order of the frequencies.
    Order,
}

impl Pairing {
    /// Returns the way in words.
    pub(super) fn in_words(self) -> &'static str {
        match self {
            Pairing::Shape => "paired by their shapes",
            Pairing::Order => "paired by their frequencies",
        }
    }
}

/// Returns a relative difference in percent with its sign, such as `+1.25 %`.
pub(super) fn signed_percent(difference: f64) -> String {
    let sign = if difference > 0.0 { "+" } else { "" };
    format!("{sign}{} %", significant(100.0 * difference, 3))
}

/// Returns the modal assurance criterion (`g_ij`² / (|a_i|² |b_j|²)) of all pairs of columns of `a` and `b`, whose nodes have
/// the same order.
pub(super) fn assurance(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let gram = product(a.transpose(), b);
    let squares = |shapes: MatRef<'_, f64>| -> Vec<f64> {
        (0..shapes.ncols()).map(|j| shapes.col(j).squared_norm_l2()).collect()
    };
    let (of_a, of_b) = (squares(a), squares(b));
    Mat::from_fn(gram.nrows(), gram.ncols(), |i, j| {
        let scale = of_a[i] * of_b[j];
        if scale > 0.0 { gram[(i, j)].powi(2) / scale } else { 0.0 }
    })
}

/// Returns for each mode of the first body the mode of the second with its shape, the pairs of the largest assurance first; `None`
/// for a mode without a partner of its shape.
pub(super) fn by_shape(assurance: &Mat<f64>) -> Vec<Option<usize>> {
    let (n, m) = (assurance.nrows(), assurance.ncols());
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (0..m).map(move |j| (i, j))).collect();
    pairs.retain(|&(i, j)| assurance[(i, j)] >= MIN_ASSURANCE);
    sort_descending(&mut pairs, |pair| assurance[*pair]);
    let (mut found, mut taken) = (vec![None; n], vec![false; m]);
    for (i, j) in pairs {
        if found[i].is_none() && !taken[j] {
            (found[i], taken[j]) = (Some(j), true);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_paired_by_their_shapes() {
        let of = |a: &Mat<f64>, b: &Mat<f64>| by_shape(&assurance(a.as_ref(), b.as_ref()));
        let identity = Mat::<f64>::identity(3, 3);
        let exchanged = Mat::from_fn(3, 3, |i, j| identity[([1, 0, 2][i], j)]);
        assert_eq!(of(&identity, &exchanged), [Some(1), Some(0), Some(2)]);
        let mixed = Mat::from_fn(3, 3, |_, j| if j == 0 { 1.0 } else { 0.1 });
        assert_eq!(of(&identity, &mixed), [None; 3]);
        let scaled = Mat::from_fn(3, 3, |i, j| -2.0 * identity[(i, j)]);
        assert_eq!(of(&identity, &scaled), [Some(0), Some(1), Some(2)]);
        let fewer = Mat::from_fn(3, 2, |i, j| identity[(i, [2, 1][j])]);
        assert_eq!(of(&fewer, &identity), [Some(2), Some(1)]);
        assert_eq!(of(&identity, &fewer), [None, Some(1), Some(0)]);
        assert_eq!(assurance(identity.as_ref(), Mat::zeros(3, 3).as_ref())[(0, 0)], 0.0);
    }

    #[test]
    fn differences_have_their_sign() {
        assert_eq!(signed_percent(0.0125), "+1.25 %");
        assert_eq!(signed_percent(-0.0125), "-1.25 %");
    }
}
