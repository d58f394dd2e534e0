//! Steps of the comparison of two bodies.

use super::body_comparison::BodyComparison;
use super::common_modes::{CommonModes, clusters};
use super::comparable::{Comparable, in_own_frame, is_placed};
use super::entries::not_compared;
use super::groups::OneSidedGroups;
use super::mode_pair::{Pairing, assurance};
use super::pair::{FrameChange, Pair};
use super::shapes::{common_nodes, turned};
use super::tolerances::Tolerances;
use faer::Mat;
#[cfg(doc)]
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use nalgebra::Matrix3;
use std::borrow::Cow;

/// Compares `b` with `a`, in the frame of `a`.
///
/// If both bodies have the same node numbers (in any order), `b` is rotated and shifted into the frame of `a`
/// and its modes are aligned inside each cluster of close eigenvalues
/// ([`align`](flexbody_body::invariants::align), plain product of the nodal components). Positions, shapes
/// and every primary invariant are then compared. Otherwise the comparison covers the quantities that need no
/// common node: mass, centre of mass, inertia, frequencies, and the norms of the invariants over clusters of
/// modes, which do not depend on signs or basis. Damping, geometric stiffness, stiffness of inertia and
/// interfaces are compared in both cases. [`BodyComparison::not_compared`] lists the entries of the file that
/// are not compared.
///
/// A group of the kinetic energy that one body has dropped is a difference of its own size; [`compare_common`] leaves it out.
/// Bodies with different reference conditions are compared in mean axes.
///
/// The place of the body frame in the model is unknown for a body imported from another program. If one body
/// is such an import, the two body frames are assumed to coincide.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) when dimensions or numbers of modes differ, units of which only one
/// body states its own, or reference conditions that cannot be changed to mean axes; [`compare_common`] compares bodies with
/// different numbers of modes.
pub fn compare(a: &FlexBody, b: &FlexBody, tolerances: &Tolerances) -> Result<BodyComparison> {
    let bodies = Comparable::of(a, b)?;
    bodies.require_equal_numbers_of_modes()?;
    let mut comparison = compared(&bodies, tolerances, OneSidedGroups::Differ)?;
    comparison.say_of_modes();
    Ok(comparison)
}

/// Returns the comparison of [`compare`] without the notes on modes.
fn compared(
    bodies: &Comparable<'_>,
    tolerances: &Tolerances,
    one_sided: OneSidedGroups,
) -> Result<BodyComparison> {
    let (a, b) = (&*bodies.a, &*bodies.b);
    let placed = is_placed(a) && is_placed(b);
    let (in_own_a, in_own_b);
    // A body without a known place in the model is compared in its own frame.
    let (a, b) = if placed {
        (a, b)
    } else {
        (in_own_a, in_own_b) = (in_own_frame(a)?, in_own_frame(b)?);
        (&in_own_a, &in_own_b)
    };
    let mut comparison = BodyComparison {
        a: a.description().name.clone(),
        b: b.description().name.clone(),
        passed: true,
        same_nodes: false,
        paired: Pairing::Order,
        modes: Vec::new(),
        rows: Vec::new(),
        notes: bodies.notes.clone(),
        not_compared: Vec::new(),
    };
    // Quantities that need no common basis or node.
    comparison.rigid(a, b, tolerances);
    // Invariants of b in the frame of a.
    let change = FrameChange::new(a, b);
    let in_a = b.invariants().shifted(change.shift).rotated(&change.axes);
    let groups = clusters(&a.modes().eigenvalue, &b.modes().eigenvalue);
    let pair = Pair { a, b, change, in_a, groups };
    // Mode by mode with common nodes, otherwise by norms over clusters of modes.
    let order = common_nodes(&a.nodes().ids, &b.nodes().ids);
    comparison.not_compared = not_compared(a, b, order.is_some());
    comparison.not_compared.extend(bodies.left_out.iter().cloned());
    let common = match order {
        Some(order) => Some(comparison.mode_by_mode(&pair, &order, tolerances)),
        None => {
            comparison.norms_only(&pair, tolerances.invariants);
            None
        }
    };
    let (basis, assurance) = common.map(|common| (common.basis, common.assurance)).unzip();
    comparison.frequencies(a, b, assurance.as_ref(), tolerances.frequency);
    comparison.modal_matrices(&pair, basis.as_ref(), tolerances.invariants);
    comparison.recoveries(&pair, basis.as_ref(), tolerances.invariants)?;
    comparison.named_loads(&pair, basis.as_ref(), tolerances.invariants);
    comparison.interfaces(&pair, tolerances.centre_of_mass);
    // Notes on the limits of the comparison.
    if !placed {
        let note = "a body comes from a file of another program, which does not state the position of its frame in the model: the body frames are assumed to be the same";
        comparison.notes.push(note.to_owned());
    }
    comparison.groups(a, b, one_sided, tolerances.invariants);
    if a.storage() != b.storage() {
        comparison.notes.push("one of the bodies is rounded to 32-bit floats".to_owned());
    }
    if a.units().stated != b.units().stated {
        comparison
            .notes
            .push("only one of the bodies has stated units, the other assumes m, kg, s".to_owned());
    }
    comparison.passed = comparison.rows.iter().all(|row| row.passed);
    Ok(comparison)
}

/// Compares what two bodies have in common: one may have fewer modes, and groups of the kinetic energy that one has dropped are
/// left out. Each mode of the smaller body is paired with a mode
/// of the larger one: with that of its shape, others in ascending order, so that the frequencies deviate least. The notes list the
/// modes that were compared, and the modes and groups that were left out.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) when units or dimensions differ, when reference conditions cannot be changed to
/// mean axes, or when the bodies have no mode in common.
pub fn compare_common(a: &FlexBody, b: &FlexBody, tolerances: &Tolerances) -> Result<BodyComparison> {
    let bodies = Comparable::of(a, b)?;
    let (a, b) = (&*bodies.a, &*bodies.b);
    if a.n_modes() == b.n_modes() {
        let mut comparison = compared(&bodies, tolerances, OneSidedGroups::LeftOut)?;
        comparison.say_of_modes();
        return Ok(comparison);
    }
    let common = CommonModes::of(a, b, assurance_of_all(a, b).as_ref())?;
    let some = |body: &FlexBody, modes: &[usize]| body.reduced(modes, body.groups(), Vec::new());
    let reduced = Comparable {
        a: Cow::Owned(some(a, &common.a)?),
        b: Cow::Owned(some(b, &common.b)?),
        notes: bodies.notes.clone(),
        left_out: bodies.left_out.clone(),
    };
    let mut comparison = compared(&reduced, tolerances, OneSidedGroups::LeftOut)?;
    comparison.number_modes(&common.a, &common.b);
    comparison.say_of_modes();
    comparison.notes.splice(0..0, common.notes);
    Ok(comparison)
}

/// Returns the modal assurance criterion of each mode of `a` with each mode of `b`; `None` if the node numbers differ.
fn assurance_of_all(a: &FlexBody, b: &FlexBody) -> Option<Mat<f64>> {
    let order = common_nodes(&a.nodes().ids, &b.nodes().ids)?;
    let axes = if is_placed(a) && is_placed(b) { FrameChange::new(a, b).axes } else { Matrix3::identity() };
    let shapes = turned(b.modes().shape.as_ref(), &axes, &order);
    Some(assurance(a.modes().shape.as_ref(), shapes.as_ref()))
}
