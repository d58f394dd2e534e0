//! Comparison of frequencies mode by mode: pairs of modes by their shapes, otherwise in ascending order.

use super::body_comparison::BodyComparison;
use super::mode_pair::{ModePair, Pairing, by_shape};
use super::relative_difference::relative;
use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::larger;
use flexbody_linalg::ties::first_largest;

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
