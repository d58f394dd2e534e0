//! Comparison of the interfaces of a body with those of its model.

use crate::convert::interfaces_in_frame;
use crate::flex_body::{FlexBody, Interface};
use crate::invariants::IdentityCheck;
use flexbody_model::{FeModel, centre_and_length};
use std::collections::BTreeSet;

/// Allowed difference of reference points, relative to the coordinates of the nodes: the rounding of the
/// change of frame.
const MAX_POINT_DIFFERENCE: f64 = 1e-12;

/// Compares names, nodes, couplings and reference points; empty if neither has interfaces. Bodies from
/// files of versions without reference points have none. A body of an earlier version has the mean of the
/// nodes as reference point if the model states none; this is accepted.
pub(super) fn interface_checks(body: &FlexBody, model: &FeModel) -> Vec<IdentityCheck> {
    let (stored, in_model) = (body.interfaces(), interfaces_in_frame(model, body.frame(), false));
    if stored.is_empty() && in_model.is_empty() {
        return Vec::new();
    }
    let of = |name: &str| stored.iter().find(|interface| interface.name == name);
    let unknown =
        stored.iter().filter(|interface| in_model.iter().all(|other| other.name != interface.name)).count();
    let differing = in_model
        .iter()
        .filter(|in_model| of(&in_model.name).is_none_or(|stored| !is_same(stored, in_model, model)))
        .count();
    let positions = body.nodes().positions.iter().flatten();
    let size = positions.fold(body.frame().origin.amax().max(f64::MIN_POSITIVE), |m, x| m.max(x.abs()));
    let apart = |x: [f64; 3], y: [f64; 3]| (0..3).map(|k| (x[k] - y[k]).abs()).fold(0.0, f64::max) / size;
    let moved = in_model.iter().filter_map(|in_model| {
        let (x, y) = (in_model.reference?, of(&in_model.name)?.reference?);
        let away = apart(x, y);
        let set = model.interfaces().iter().find(|set| set.name == in_model.name)?;
        let mean = || {
            let positions: Vec<[f64; 3]> =
                in_model.nodes.iter().map(|&i| body.nodes().positions[i]).collect();
            centre_and_length(&positions).0
        };
        Some(if set.reference.is_stated() { away } else { away.min(apart(mean(), y)) })
    });
    vec![
        IdentityCheck::new(
            "interfaces",
            "number of interfaces with other names, nodes or coupling than in the model",
            (unknown + differing) as f64,
            0.0,
        ),
        IdentityCheck::new(
            "reference_points",
            "x_ref = A' (x_model - origin)",
            moved.fold(0.0, f64::max),
            MAX_POINT_DIFFERENCE,
        ),
    ]
}

/// Returns true if `stored` has the nodes, the coupling and the kind of reference point of `in_model`. A basis
/// that needs a coupling uses `averaging` if the model states none.
fn is_same(stored: &Interface, in_model: &Interface, model: &FeModel) -> bool {
    let set = model.interfaces().iter().find(|set| set.name == in_model.name);
    let taken = set.map(|set| set.coupling());
    let nodes = |interface: &Interface| interface.nodes.iter().copied().collect::<BTreeSet<_>>();
    nodes(stored) == nodes(in_model)
        && (stored.coupling == in_model.coupling || stored.coupling == taken)
        && (stored.reference.is_some() == in_model.reference.is_some())
}
