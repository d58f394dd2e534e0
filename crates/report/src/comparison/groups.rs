//! Comparison of the groups of the kinetic energy that two bodies hold.

use super::body_comparison::BodyComparison;
use super::relative_difference::relative;
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, TermGroup};
use flexbody_body::invariants::{CauchySchwarz, Invariants};
use flexbody_linalg::larger;

/// Treatment of groups of the kinetic energy that only one of the bodies holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OneSidedGroups {
    /// Such a group is a difference of its own size.
    Differ,
    /// Such a group is left out, as the user asks for the common parts of the bodies.
    LeftOut,
}

impl BodyComparison {
    /// Compares the groups of the kinetic energy that one body dropped and the other holds with zero. Their size does not depend on
    /// the signs of modes.
    pub(super) fn groups(&mut self, a: &FlexBody, b: &FlexBody, one_sided: OneSidedGroups, tolerance: f64) {
        for group in TermGroup::ALL {
            let name = group.name();
            let (whose, holder) = match (a.groups().has(group), b.groups().has(group)) {
                (true, true) => continue,
                (false, true) => ("the first body", Some(b)),
                (true, false) => ("the second body", Some(a)),
                (false, false) => ("both bodies", None),
            };
            let Some(holder) = holder.filter(|_| one_sided == OneSidedGroups::Differ) else {
                self.notes.push(format!("{name} was dropped from {whose}: it is not compared"));
                continue;
            };
            let size = size_of(holder.invariants(), group);
            let (quantity, meaning) = labels(group);
            self.row(quantity, meaning, size, tolerance);
            let outcome =
                if size <= tolerance { "the other body holds zeros there" } else { "--common leaves it out" };
            self.notes.push(format!("{name} was dropped from {whose}: {outcome}"));
        }
    }
}

/// Returns the name of the row of a group that only one body holds, and the reference value of its size.
fn labels(group: TermGroup) -> (&'static str, &'static str) {
    match group {
        TermGroup::W1 => {
            ("W1 of one body", "dropped from the other body; largest entry / 2 sqrt(I0_kk) |psi_p|")
        }
        TermGroup::W2 => ("W2 of one body", "dropped from the other body; largest entry / |psi_p| |psi_q|"),
        TermGroup::W3 => ("W3 of one body", "dropped from the other body; largest entry / |psi_p| |psi_q|"),
    }
}

/// Returns the largest entry of a group, relative to its Cauchy-Schwarz bound.
fn size_of(invariants: &Invariants, group: TermGroup) -> f64 {
    let bound = CauchySchwarz::of(invariants);
    let nf = invariants.n_modes();
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);
    match group {
        TermGroup::W1 => largest(invariants.w1(), |k, column| bound.w1(k, column / nf, column % nf)),
        TermGroup::W2 => largest(invariants.w2(), by_modes),
        TermGroup::W3 => largest(invariants.w3(), by_modes),
    }
}

/// Returns the largest entry of a matrix relative to its bound; zeros count as zero whatever their bound.
fn largest(matrix: Option<Mat<f64>>, bound: impl Fn(usize, usize) -> f64) -> f64 {
    let Some(matrix) = matrix else { return 0.0 };
    let places = (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| (i, j)));
    places.map(|(i, j)| relative(matrix[(i, j)], bound(i, j))).fold(0.0, larger)
}
