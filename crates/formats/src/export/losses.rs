//! Sentences about properties that formats cannot hold, shared by several formats, with the size of the loss.

use crate::export::Holding::{self, Held, Lost, NotApplicable};
use crate::export::{ExportOptions, InertiaInScene};
use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::CauchySchwarz;
use flexbody_model::UnitLoad;

/// Largest difference, relative to a Cauchy-Schwarz bound, that counts as rounding and not as a loss. A
/// larger value hides small losses; a smaller one reports rounding.
const ROUNDING: f64 = 1e-12;

/// Part of the stiffness of a motion from which the stiffness of inertia is reported. A larger value reports
/// it for faster motions only.
const MIN_REPORTED_STIFFNESS: f64 = 0.01;

/// Returns the holding of the restriction to a plane, for a format in space.
pub(crate) fn plane(body: &FlexBody) -> Holding {
    if body.dimension() != 2 {
        return NotApplicable;
    }
    Lost("the restriction to the plane z = 0: inertia and stiffness out of the plane are missing, so hold the body in its plane with a joint".to_owned())
}

/// Returns the holding of W0 of a mass that does not commute with rotations, for a format whose first moment
/// is c + C1 q.
pub(crate) fn general_w0(body: &FlexBody) -> Holding {
    let invariants = body.invariants();
    let bound = CauchySchwarz::of(invariants);
    let nf = body.n_modes();
    // Without the information in M, W0 follows from C1.
    let (stated, implied) = (invariants.w0(), invariants.as_solid().w0());
    let lost = largest(&stated, &implied, |_, column| bound.c1(column % nf));
    lost_beyond_rounding(lost, "W0 other than -C1~ (how modes move the coupling of translation and rotation)")
}

/// Returns the holding of the symmetric part of the blocks of W3, for a format that takes them as skew.
pub(crate) fn general_w3(body: &FlexBody) -> Holding {
    let bound = CauchySchwarz::of(body.invariants());
    let nf = body.n_modes();
    let Some(w3) = body.invariants().w3() else { return NotApplicable };
    let mirrored = Mat::from_fn(3 * nf, nf, |row, j| -w3[(row / nf * nf + j, row % nf)]);
    let lost = 0.5 * largest(&w3, &mirrored, |row, j| bound.s(row % nf, j));
    lost_beyond_rounding(lost, "the symmetric part of W3")
}

fn largest(a: &Mat<f64>, b: &Mat<f64>, bound: impl Fn(usize, usize) -> f64) -> f64 {
    let places = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j)));
    places
        .filter(|&(i, j)| a[(i, j)] != b[(i, j)])
        .map(|(i, j)| (a[(i, j)] - b[(i, j)]).abs() / bound(i, j))
        .fold(0.0, f64::max)
}

/// Returns the loss of a difference that exceeds rounding; for a smaller difference the property is held.
pub(crate) fn lost_beyond_rounding(lost: f64, what: &str) -> Holding {
    Holding::held_but_for((lost > ROUNDING).then(|| {
        format!(
            "{what}: up to {lost:.1e} of its Cauchy-Schwarz bound, from nodes with rotations or constraints"
        )
    }))
}

/// Returns true if the body has damping: a matrix, or ratios.
pub(crate) fn is_damped(body: &FlexBody) -> bool {
    body.modes().modal_damping.is_some() || body.modes().damping_ratio.iter().any(|ratio| *ratio != 0.0)
}

/// Returns the holding of damping, for a format without damping.
#[cfg(feature = "hdf5")]
pub(crate) fn damping(body: &FlexBody) -> Holding {
    if is_damped(body) { Lost("the damping of the modes".to_owned()) } else { NotApplicable }
}

/// Returns the holding of geometric stiffness, for a format that takes the loads for which `holds` returns
/// true.
pub(crate) fn geometric_stiffness(body: &FlexBody, holds: impl Fn(&UnitLoad) -> bool) -> Holding {
    let lost: Vec<String> = body
        .geometric_stiffness()
        .iter()
        .filter(|one| !holds(&one.load))
        .map(|one| one.load.to_string())
        .collect();
    Holding::held_but_for(
        (!lost.is_empty()).then(|| format!("the geometric stiffness for {}", lost.join(", "))),
    )
}

/// Returns the holding of the stiffness of inertia, for a format that takes the loads for which `holds`
/// returns true. The loss states its size in a scene, or otherwise the motion from which it matters.
pub(crate) fn inertia_stiffness(
    body: &FlexBody,
    options: &ExportOptions,
    holds: impl Fn(&UnitLoad) -> bool,
) -> Holding {
    const WHAT: &str = "the stiffness of inertia of turning nodes";
    let Some(inertia) = body.inertia_stiffness() else { return NotApplicable };
    let all = inertia.stiffness.iter().filter(|one| one.matrix.norm_max() > 0.0);
    let lost: Vec<&UnitLoad> = all.map(|one| &one.load).filter(|load| !holds(load)).collect();
    if lost.is_empty() {
        return Held;
    }
    if let Some(InertiaInScene { scene, share }) = &options.in_scene {
        let percent = 100.0 * share;
        return Lost(format!(
            "{WHAT}: at most {percent:.2} % of the stiffness of a motion in the scene `{scene}`"
        ));
    }
    let Some(rates) = body.inertia_rates(MIN_REPORTED_STIFFNESS) else { return NotApplicable };
    let rates = rates.in_words(body.units(), |kind| lost.iter().any(|load| load.kind == *kind));
    Lost(format!("{WHAT}, which reaches 1 % of the stiffness of a motion at {rates}"))
}

/// Returns the holding of rotations of nodes, for a format without rotations.
#[cfg(feature = "hdf5")]
pub(crate) fn rotations(body: &FlexBody) -> Holding {
    if body.modes().rotation.is_none() {
        return NotApplicable;
    }
    Lost("the rotations of the nodes in the modes".to_owned())
}

/// Returns the holding of rows of the modes that belong to no node.
pub(crate) fn internal_rows(body: &FlexBody) -> Holding {
    let Some(internal) = &body.modes().internal else { return NotApplicable };
    Lost(format!("{} rows of the modes that belong to no node", internal.shape.nrows()))
}

/// Returns the holding of the groups of the kinetic energy, for a format with the inertia of the undeformed
/// body; `w1` names the lost part of W1.
pub(crate) fn changing_inertia(body: &FlexBody, w1: &str, why: &str) -> Holding {
    let groups = body.groups();
    let held = [(groups.w1, w1), (groups.w2, "W2"), (groups.w3, "W3")];
    let lost: Vec<&str> = held.into_iter().filter(|(held, _)| *held).map(|(_, name)| name).collect();
    if lost.is_empty() {
        return NotApplicable;
    }
    Lost(format!("the change of the inertia with the deformation ({}): {why}", lost.join(", ")))
}
