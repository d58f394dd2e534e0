//! Checks of the statements of a file against its own numbers and against the model: counts of the certificate, rigid
//! interfaces, interface coordinates, errors of lumped comparators, and the interfaces of the model.

use crate::basis::FREE_MODE;
use crate::convert::interfaces_in_frame;
use crate::flex_body::{FixedInterface, FlexBody, Interface, LumpedBody, magnitudes, worst_entry};
use crate::invariants::{IdentityCheck, error_norms};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{combine, gram, larger, largest};
use flexbody_model::{Coupling, FeModel, centre_and_length, rigid_count};
use std::collections::BTreeSet;

/// Allowed rounding error of a rigid motion of the nodes of an interface, relative to its largest motion.
const MAX_RIGID_ROUNDING: f64 = 1e-8;
/// Motion relative to the largest of the modes below which an interface counts as at rest, such as the interface that
/// carries the frame: its nodes move by the rounding of the rigid motion that was taken from the modes, 1e-12 of their
/// largest motion.
const LARGEST_AT_REST: f64 = 1e-3;
/// Allowed rounding error of error norms, which are relative differences of nearly equal numbers.
const MAX_NORM_ROUNDING: f64 = 1e-9;
/// Allowed rounding error between coordinates computed from the shapes in two ways.
const MAX_COORDINATE_ROUNDING: f64 = 1e-9;

/// Returns the checks of all statements that the body makes.
pub(super) fn recounts(body: &FlexBody) -> Vec<IdentityCheck> {
    let one_each =
        [counted_modes(body), fixed_interface_modes(body), rigid_interfaces(body), lumped_errors(body)];
    one_each.into_iter().flatten().chain(coordinates_of_modes(body)).collect()
}

/// Returns the difference of two counts as a number.
fn apart(a: usize, b: usize) -> f64 {
    a.abs_diff(b) as f64
}

/// Compares the proof with the inertia count and with the eigenvalues below its shift. A body of only the
/// lowest free modes has fewer than were counted, and its residual vectors may stand for some of the others.
fn counted_modes(body: &FlexBody) -> Option<IdentityCheck> {
    let certificate = body.certificate();
    let proved = certificate.proved_modes?;
    let rigid = rigid_count(body.dimension());
    let below = body.modes().eigenvalue.iter().filter(|lambda| **lambda < certificate.shift).count();
    let pivots =
        certificate.negative_pivots.map_or(f64::INFINITY, |n| apart(n, proved.saturating_add(rigid)));
    let is_free = |from: &&String| *from == FREE_MODE;
    let free = match body.modes().provenance.iter().filter(is_free).count() {
        0 => body.n_modes(),
        count => count,
    };
    let counted = below.clamp(proved.min(free), proved);
    let value = pivots + apart(certificate.rigid_modes, rigid) + apart(below, counted);
    let formula = "negative pivots = rigid + proved modes; modes below sigma are proved";
    Some(IdentityCheck::new("counted_modes", formula, value, 0.0))
}

/// Compares the statements of a Craig-Bampton body about its basis with its interface coordinates or, without
/// these, with the eigenvalues of its fixed-interface modes.
fn fixed_interface_modes(body: &FlexBody) -> Option<IdentityCheck> {
    let fixed = body.certificate().fixed_interface.as_ref()?;
    let FixedInterface { modes, interface_motions, counted, shift, next, .. } = fixed;
    let lambda = body.fixed_interface_eigenvalues()?;
    let all = modes.saturating_add(*interface_motions);
    // Without interface coordinates the modes of the body must fit into the span of the basis.
    let missing = match body.coordinates() {
        Some(coordinates) => apart(coordinates.names.len(), all),
        None => (body.n_modes() + rigid_count(body.dimension())).saturating_sub(all) as f64,
    };
    let below = lambda.iter().filter(|lambda| **lambda < *shift).count();
    let count = counted.map_or(0.0, |counted| apart(below, counted.min(*modes)));
    let order =
        next.is_some_and(|next| lambda.iter().any(|lambda| *lambda > next * (1.0 + MAX_RIGID_ROUNDING)));
    let value = apart(lambda.len(), *modes) + missing + count + f64::from(order);
    let formula = "coordinates = interface motions + fixed-interface modes; those below sigma are counted";
    Some(IdentityCheck::new("fixed_interface_modes", formula, value, 0.0))
}

/// Measures the deformation of interfaces that the basis couples rigidly. Free modes do not consider
/// couplings; a warning reports their deformation.
fn rigid_interfaces(body: &FlexBody) -> Option<IdentityCheck> {
    let coupled = body.certificate().fixed_interface.is_some() || body.coordinates().is_some();
    if !coupled || !body.has_rigid_interfaces() {
        return None;
    }
    let rigid = body.interfaces().iter().filter(|interface| interface.coupling == Some(Coupling::Rigid));
    let value = largest(rigid.map(|interface| deformation(body, interface)));
    let limit = MAX_RIGID_ROUNDING + 4.0 * body.storage().rounding();
    let formula = "nodes of rigid interfaces move as their reference points";
    Some(IdentityCheck::new("rigid_interfaces", formula, value, limit))
}

/// Returns the deviation of the nodes of an interface from the rigid motion of its reference point;
/// displacements and rotations are each relative to the largest in any mode.
fn deformation(body: &FlexBody, interface: &Interface) -> f64 {
    let modes = body.modes();
    let rotation = modes.rotation.as_ref();
    let rows =
        interface.rows(body.nodes(), modes.shape.as_ref(), rotation.map(Mat::as_ref), body.dimension());
    let Some(rows) = rows else { return f64::INFINITY };
    let displaced = rows.deformation_beside(LARGEST_AT_REST * modes.shape.norm_max());
    let (Some(rotation), Some(turns)) = (rotation, &rows.rotation) else { return displaced };
    let (mut left, mut size) = (0.0, larger(turns.norm_max(), LARGEST_AT_REST * rotation.norm_max()));
    for &node in &interface.nodes {
        for k in 0..3 {
            let row = rotation.as_ref().subrows(3 * node + k, 1);
            let row_size = row.norm_max();
            // Nodes may have some rotations, or none.
            if row_size > 0.0 {
                size = larger(size, row_size);
                left = larger(left, (row.to_owned() - turns.as_ref().subrows(k, 1)).norm_max());
            }
        }
    }
    larger(displaced, if left == 0.0 { 0.0 } else { left / size })
}

/// Compares the interface coordinates of the modes with the motion of the reference points in the modes,
/// and checks that the momentum of the modes, computed with the mass in interface coordinates, is zero.
fn coordinates_of_modes(body: &FlexBody) -> Option<IdentityCheck> {
    let coordinates = body.coordinates()?;
    let rigid = body.parts().rigid_coordinates()?;
    let (b, mass, inertia) = (&coordinates.of_modes, &coordinates.mass, body.parts().rigid_mass());
    let product =
        |r: &Mat<f64>, m: &Mat<f64>, b: &Mat<f64>| gram(r.as_ref(), combine(m.as_ref(), b.as_ref()).as_ref());
    let momentum = product(&rigid, mass, b);
    let sums = product(&magnitudes(&rigid), &magnitudes(mass), &magnitudes(b));
    let certificate = body.certificate();
    let limit = MAX_COORDINATE_ROUNDING
        + 10.0 * certificate.rigid_noise
        + certificate.eigenvalue_rounding
        + body.storage().rounding();
    let (name, formula) = ("interface_modes", "B = reference points in the modes; R' M B = 0");
    let of_momentum = worst_entry(name, formula, (momentum.nrows(), momentum.ncols()), limit, |i, j| {
        let size = inertia[(i, i)].sqrt();
        (momentum[(i, j)] / size, sums[(i, j)] / size)
    });
    Some(of_momentum.or_worse(IdentityCheck::new(name, formula, reference_difference(body, b), limit)))
}

/// Returns the largest difference of the coordinates of reference points from their motion in the modes;
/// translations and rotations are each relative to their largest.
fn reference_difference(body: &FlexBody, b: &Mat<f64>) -> f64 {
    let (modes, d) = (body.modes(), body.dimension());
    let (mut first, mut worst) = (0, 0.0);
    for interface in body.interfaces() {
        if interface.reference.is_none() {
            let nodes: std::collections::BTreeSet<usize> = interface.nodes.iter().copied().collect();
            first += d * nodes.len();
            continue;
        }
        let rotation = modes.rotation.as_ref().map(Mat::as_ref);
        let Some(rows) = interface.rows(body.nodes(), modes.shape.as_ref(), rotation, d) else {
            return f64::INFINITY;
        };
        let turns = rigid_count(d) - d;
        let difference_at = |rows: &Mat<f64>, from: usize, count: usize, at: usize| {
            let stored = b.as_ref().subrows(at, count);
            let difference = (stored.to_owned() - rows.as_ref().subrows(from, count)).norm_max();
            if difference == 0.0 { 0.0 } else { difference / stored.norm_max() }
        };
        worst = larger(worst, difference_at(&rows.translation, 0, d, first));
        if let Some(rotation) = &rows.rotation {
            worst = larger(worst, difference_at(rotation, 3 - turns, turns, first + d));
        }
        first += rigid_count(d);
    }
    worst
}

/// Compares the error norms of lumped comparators with norms recomputed from their invariants; norms of
/// other programs are not checked.
fn lumped_errors(body: &FlexBody) -> Option<IdentityCheck> {
    let recount = |lumped: &LumpedBody| {
        let norms = error_norms(body.invariants(), &lumped.invariants);
        let differences: Vec<f64> = lumped
            .comparison
            .iter()
            .filter_map(|(name, stored)| {
                let (_, value) = norms.iter().find(|(known, _)| known == name)?;
                Some((stored - value).abs() / value.abs().max(1.0))
            })
            .collect();
        largest(differences)
    };
    if body.lumped().is_empty() {
        return None;
    }
    let limit = MAX_NORM_ROUNDING + 100.0 * body.storage().rounding();
    let formula = "error norms of the lumped comparators";
    Some(IdentityCheck::new("lumped_errors", formula, largest(body.lumped().iter().map(recount)), limit))
}

/// Allowed difference of reference points, relative to the coordinates of the nodes: the rounding of the
/// change of frame.
const MAX_POINT_DIFFERENCE: f64 = 1e-12;

/// Compares names, nodes, couplings and reference points; empty if neither has interfaces. Bodies from
/// files of versions without reference points have none. A body of an earlier version has the mean of the
/// nodes as reference point if the model states none; this is accepted.
pub(super) fn interface_checks(body: &FlexBody, model: &FeModel) -> Vec<IdentityCheck> {
    let (stored, in_model) = (body.interfaces(), interfaces_in_frame(model, body.frame(), false));
    // A model that states no interfaces contradicts none; a note says so.
    if in_model.is_empty() {
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

/// Returns a note about the interfaces of the body that the model does not state, or states differently, with the options
/// that state them.
pub(super) fn interface_note(body: &FlexBody, model: &FeModel) -> Option<Diagnostic> {
    let in_model = interfaces_in_frame(model, body.frame(), false);
    let differs = |stored: &&Interface| {
        let same = in_model.iter().find(|other| other.name == stored.name);
        !same.is_some_and(|same| is_same(stored, same, model))
    };
    let missed: Vec<&Interface> = body.interfaces().iter().filter(differs).collect();
    let names: Vec<String> = missed.iter().map(|one| format!("`{}`", one.name)).collect();
    let option = |interface: &&Interface| match interface.coupling {
        Some(coupling) => format!("--interface {}=NODES,{}", interface.name, coupling.name()),
        None => format!("--interface {}=NODES", interface.name),
    };
    let options: Vec<String> = missed.iter().map(option).collect();
    let message = match (missed.is_empty(), in_model.is_empty()) {
        (true, _) => return None,
        (false, true) => format!(
            "the model states no interfaces: {} with nodes, coupling and reference point are taken from the body and not compared",
            names.join(", ")
        ),
        (false, false) => {
            format!(
                "{} are missing in the model, or have other nodes or another coupling there",
                names.join(", ")
            )
        }
    };
    let help = format!(
        "to compare them, give {} (NODES: a node set, a list or a region), or [[interface]] with these names in the manifest",
        options.join(" ")
    );
    Some(Diagnostic::new(Code::InterfacesUncompared, message).with_help(help))
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
