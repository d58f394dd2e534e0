//! Comparison of the named loads of two bodies.

use super::body_comparison::BodyComparison;
use super::modal_rows::ModalRows;
use super::pair::Pair;
use super::relative_difference::{relative, relative_difference};
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, NamedLoad};
use flexbody_linalg::larger;
use nalgebra::Vector3;
use std::ops::Range;

impl BodyComparison {
    /// Compares the named loads of the same names: kinds, modal loads by groups of modes, resultants and first moments about
    /// the origin of the first body, and compliances. `basis` transforms the modes of the second body to those of the first.
    pub(super) fn named_loads(&mut self, pair: &Pair<'_>, basis: Option<&Mat<f64>>, tolerance: f64) {
        let has = |body: &FlexBody| !body.named_loads().is_empty();
        let neither = !has(pair.a) && !has(pair.b);
        if neither || self.leave_out(pair, "named loads", "/named_loads", has) {
            return;
        }
        let shift: Vector3<f64> = pair.change.shift;
        let (a, b) = (pair.a.named_loads(), pair.b.named_loads_in(&shift, &pair.change.axes));
        let (mut differing, mut in_modes, mut resultants) = (0, 0.0, 0.0);
        for own in a {
            let other = b.iter().find(|other| other.name == own.name);
            let Some(other) = other.filter(|other| other.preload == own.preload) else {
                let what = if other.is_some() {
                    "is a preload in one body only"
                } else {
                    "is in the first body only"
                };
                self.notes.push(format!("named load `{}` {what}", own.name));
                differing += 1;
                continue;
            };
            in_modes = larger(in_modes, difference_in_modes(own, other, basis, &pair.groups));
            resultants = larger(resultants, difference_of_resultants(own, other, pair.a.extent()));
        }
        for other in b.iter().filter(|other| a.iter().all(|own| own.name != other.name)) {
            self.notes.push(format!("named load `{}` is in the second body only", other.name));
            differing += 1;
        }
        let meaning = "number of named loads that differ in name or kind";
        self.row("named loads", meaning, differing as f64, 0.0);
        let meaning = "modal loads and torques by the modes, over a group of modes / largest norm";
        self.row("loads on the modes", meaning, in_modes, tolerance);
        let meaning = "resultants, first moments and compliances / largest of the load";
        self.row("resultants", meaning, resultants, tolerance);
    }
}

/// Returns the largest difference of modal loads and of torques by the modes over a group of modes, relative to the largest norm
/// of its kind.
fn difference_in_modes(
    a: &NamedLoad,
    b: &NamedLoad,
    basis: Option<&Mat<f64>>,
    groups: &[Range<usize>],
) -> f64 {
    let modal = |of: &NamedLoad| Mat::from_fn(1, of.modal.len(), |_, j| of.modal[j]);
    let worst = |a: &Mat<f64>, b: &Mat<f64>| {
        let rows: Vec<(usize, f64)> = (0..a.nrows()).map(|k| (k, 1.0)).collect();
        ModalRows::new(a, b, basis).difference(&rows, groups)
    };
    larger(worst(&modal(a), &modal(b)), worst(&a.turning, &b.turning))
}

/// Returns the largest difference of force, torque, first moments and compliance. Forces and moments of one load are
/// compared with the largest of them all, moments over the `extent` of the body, since those of a balanced load are rounding.
fn difference_of_resultants(a: &NamedLoad, b: &NamedLoad, extent: f64) -> f64 {
    let all = |of: &NamedLoad| -> Vec<f64> {
        let moments = of.torque.iter().chain(&of.moments).map(|moment| moment / extent);
        of.force.iter().copied().chain(moments).collect()
    };
    let resultants = all(a).into_iter().zip(all(b)).map(|(a, b)| (1.0, a, b));
    let compliances = match (a.compliance, b.compliance) {
        (Some(a), Some(b)) => relative((a - b).abs(), larger(a.abs(), b.abs())),
        _ => 0.0,
    };
    larger(relative_difference(resultants), compliances)
}
