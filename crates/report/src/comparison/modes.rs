//! Comparison of frequencies mode by mode: pairs of modes by their shapes, otherwise in ascending order.

use super::{BodyComparison, product, relative};
use crate::notation::numbers::frequency;
use faer::{Mat, MatRef};
use flexbody_base::numbers::significant;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::larger;
use flexbody_linalg::ties::{first_largest, sort_descending};
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
    pub(crate) fn is_of_strangers(&self) -> bool {
        self.assurance.is_some_and(|assurance| assurance < MIN_ASSURANCE)
    }

    /// Returns the numbers of the modes, their frequencies and the difference in words.
    pub(crate) fn in_words(&self) -> String {
        let [a, b] = [self.frequency_a_hz, self.frequency_b_hz].map(|hertz| frequency(hertz, 7));
        let second = match self.mode_a == self.mode_b {
            true => "in the second".to_owned(),
            false => format!("in the second (its mode {})", self.mode_b),
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
    pub(crate) fn in_words(self) -> &'static str {
        match self {
            Pairing::Shape => "paired by their shapes",
            Pairing::Order => "paired by their frequencies",
        }
    }
}

impl BodyComparison {
    /// Compares the frequencies of all modes, and names the worst pair if it exceeds the tolerance. `assurance` is the
    /// modal assurance criterion of all pairs of modes.
    pub(super) fn frequencies(
        &mut self,
        a: &FlexBody,
        b: &FlexBody,
        assurance: Option<&Mat<f64>>,
        tolerance: f64,
    ) {
        let by_shape = assurance.map_or_else(|| vec![None; a.n_modes()], by_shape);
        let has_shapes = by_shape.iter().any(Option::is_some);
        self.paired = if has_shapes { Pairing::Shape } else { Pairing::Order };
        // Modes without a partner of their shape take the others in ascending order.
        let mut others = (0..b.n_modes()).filter(|j| !by_shape.contains(&Some(*j)));
        let partners: Vec<usize> = by_shape.iter().filter_map(|one| one.or_else(|| others.next())).collect();
        let (of_a, of_b) = (a.frequencies_hz(), b.frequencies_hz());
        let pair = |(i, j): (usize, usize)| ModePair {
            mode_a: i + 1,
            mode_b: j + 1,
            frequency_a_hz: of_a[i],
            frequency_b_hz: of_b[j],
            difference: relative(of_b[j] - of_a[i], of_a[i]).copysign(of_b[j] - of_a[i]),
            assurance: assurance.map(|values| values[(i, j)]),
        };
        self.modes = partners.into_iter().enumerate().map(pair).collect();
        let alike = self.modes.iter().filter(|pair| !has_shapes || !pair.is_of_strangers());
        let largest = alike.map(|pair| pair.difference.abs()).fold(0.0, larger);
        let meaning = if has_shapes {
            "relative, largest of all modes of one shape"
        } else {
            "relative, largest of all modes"
        };
        self.row("frequency", meaning, largest, tolerance);
        // In reports the rows stand among the quantities that need no common node.
        let place = self.rows.iter().position(|row| row.quantity == "inertia").map_or(0, |at| at + 1);
        self.rows[place..].rotate_right(1);
        if assurance.is_some() {
            let strangers = self.modes.iter().filter(|pair| pair.is_of_strangers()).count();
            let meaning = "number of modes whose shape is that of no mode of the other body";
            self.row("modes without partner", meaning, strangers as f64, 0.0);
            self.rows[place + 1..].rotate_right(1);
        }
    }

    /// Numbers the modes as in bodies of which only the modes `of_a` and `of_b` (from 0) were compared.
    pub(super) fn number_modes(&mut self, of_a: &[usize], of_b: &[usize]) {
        for pair in &mut self.modes {
            pair.mode_a = of_a[pair.mode_a - 1] + 1;
            pair.mode_b = of_b[pair.mode_b - 1] + 1;
        }
    }

    /// Adds notes about the modes: other orders, shapes without a partner, and the worst frequency beyond its tolerance.
    pub(super) fn say_of_modes(&mut self) {
        let alike = || self.modes.iter().filter(|pair| !pair.is_of_strangers());
        let is_moved = |pair: &&ModePair| alike().any(|other| crosses(pair, other));
        let moved: Vec<String> =
            alike().filter(is_moved).map(|pair| format!("{} is {}", pair.mode_a, pair.mode_b)).collect();
        if self.paired == Pairing::Shape && !moved.is_empty() {
            self.notes.push(format!(
                "by their shapes, modes of the first body have another order in the second: {}",
                first_of(&moved)
            ));
        }
        let strangers: Vec<String> = self
            .modes
            .iter()
            .filter(|pair| pair.is_of_strangers())
            .map(|pair| pair.mode_a.to_string())
            .collect();
        if self.same_nodes && !strangers.is_empty() {
            let (modes, have) = if strangers.len() == 1 { ("mode", "has") } else { ("modes", "have") };
            self.notes.push(format!(
                "{modes} {} of the first body {have} the shape of no mode of the second: the table shows the next frequency beside each, which is not that of the same mode",
                first_of(&strangers)
            ));
        }
        let failed = self.rows.iter().any(|row| row.quantity == "frequency" && !row.passed);
        if let Some(worst) = self.worst_mode().filter(|_| failed) {
            self.notes.push(format!("the frequency that differs most is that of {}", worst.in_words()));
        }
    }

    /// Returns the pair of modes whose frequencies differ most, among those with one shape as far as the shapes are known.
    pub fn worst_mode(&self) -> Option<&ModePair> {
        let alike = self.modes.iter().filter(|pair| !pair.is_of_strangers());
        first_largest(alike, |pair| pair.difference.abs())
    }
}

/// Returns true if two pairs have opposite orders in the two bodies.
fn crosses(one: &ModePair, other: &ModePair) -> bool {
    (one.mode_a < other.mode_a) != (one.mode_b < other.mode_b) && one.mode_a != other.mode_a
}

/// Returns the first entries, as many as a note names, and the number of the others.
fn first_of(all: &[String]) -> String {
    let (some, rest) = all.split_at(all.len().min(MAX_NAMED));
    let more = if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
    some.join(", ") + &more
}

/// Number of modes that a note names.
const MAX_NAMED: usize = 6;

/// Returns a relative difference in percent with its sign, such as `+1.25 %`.
pub(crate) fn signed_percent(difference: f64) -> String {
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
pub(crate) fn by_shape(assurance: &Mat<f64>) -> Vec<Option<usize>> {
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
