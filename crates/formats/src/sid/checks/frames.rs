//! Identities between the arrays of the frames.

use super::missed::{Violation, largest_entry};
use crate::import::AuditCheck;
use crate::sid::read::arrays::{Array, FrameArrays};
use crate::sid::read::parse::Listed;
use flexbody_base::diagnostic::Code;
use flexbody_linalg::larger;
use nalgebra::{Matrix3, Vector3};

/// Returns the checks of the frames; empty for a file that has no frames and states none.
pub(super) fn frame_checks(listed: &Listed<'_>, frames: &[FrameArrays]) -> Vec<AuditCheck> {
    if frames.is_empty() && listed.stated_frames.unwrap_or(0) == 0 {
        return Vec::new();
    }
    let nq = listed.nq;
    let identity = |name, formula, meaning: &str, missed: &dyn Fn(&FrameArrays) -> Option<Violation>| {
        over_all_frames(listed, frames, missed).check(name, formula, meaning)
    };
    let mut all = vec![
        number_of_frames(listed, frames),
        identity(
            "origin_m1_is_phi",
            "origin.M1_k = phi_k",
            "the motion of the origin of a frame and the work of forces there contradict each other",
            &|frame| Some(origin_missed(frame, nq)),
        ),
        identity(
            "ap_m1_is_psi",
            "AP.M1_k = (psi_k)~",
            "the rotation of the axes of a frame and the work of torques there contradict each other",
            &|frame| axes_missed(frame, nq),
        ),
    ];
    type Chosen = fn(&FrameArrays) -> Option<&Array>;
    let stiffening: [(_, _, Chosen); 2] = [
        ("phi1_symmetric", "phi.M1(k,l) = phi.M1(l,k)", |frame| Some(&frame.phi)),
        ("psi1_symmetric", "psi.M1(k,l) = psi.M1(l,k)", |frame| frame.psi.as_ref()),
    ];
    for (name, formula, chosen) in stiffening {
        let missed = |frame: &FrameArrays| symmetry_missed(chosen(frame)?, nq);
        if frames.iter().any(|frame| missed(frame).is_some()) {
            let meaning = "the geometric stiffness of a load at a frame is not symmetric";
            all.push(identity(name, formula, meaning, &missed));
        }
    }
    all.push(undeformed_axes(listed, frames));
    all
}

fn number_of_frames(listed: &Listed<'_>, frames: &[FrameArrays]) -> AuditCheck {
    let stated = listed.stated_frames.unwrap_or(frames.len());
    AuditCheck {
        name: "number_of_frames",
        formula: "frames of the file = nodes of its first line",
        value: stated.abs_diff(frames.len()) as f64,
        limit: 0.0,
        code: Code::AuditIdentity,
        meaning: format!("the first line states {stated} nodes, the file has {}", frames.len()),
    }
}

/// Worst value of an identity over all frames, with the label of that frame.
struct WorstFrame<'l> {
    missed: Violation,
    label: Option<&'l str>,
}

fn over_all_frames<'l>(
    listed: &'l Listed<'_>,
    frames: &[FrameArrays],
    missed: &dyn Fn(&FrameArrays) -> Option<Violation>,
) -> WorstFrame<'l> {
    let (mut total, mut label) = (Violation { by: 0.0, scale: 0.0, rounding: 0.0 }, None);
    for (frame, listed) in frames.iter().zip(&listed.frames) {
        let Some(own) = missed(frame) else { continue };
        if own.by > total.by || own.by.is_nan() {
            (total.by, label) = (own.by, Some(listed.label.as_str()));
        }
        total.scale = total.scale.max(own.scale);
        total.rounding = total.rounding.max(own.rounding);
    }
    WorstFrame { missed: total, label }
}

impl WorstFrame<'_> {
    fn check(self, name: &'static str, formula: &'static str, meaning: &str) -> AuditCheck {
        let place = self.label.map_or_else(String::new, |label| format!(", most at node {label}"));
        self.missed.check(name, formula, Code::AuditIdentity, format!("{meaning}{place}"))
    }
}

/// Returns the difference of origin.M1 and phi.
fn origin_missed(frame: &FrameArrays, nq: usize) -> Violation {
    Violation {
        by: largest_entry(3, nq, |a, k| frame.origin.linear(k, a, 0) - frame.phi.m0[(a, k)]),
        scale: frame.origin.sizes()[1].max(frame.phi.sizes()[0]),
        rounding: frame.origin.rounding[1] + frame.phi.rounding[0],
    }
}

/// Returns the difference of AP.M1 and the skew matrices of psi; `None` if the frame omissions one of them.
fn axes_missed(frame: &FrameArrays, nq: usize) -> Option<Violation> {
    let (psi, ap) = (frame.psi.as_ref()?, frame.ap.as_ref()?);
    let missed_by_mode = |k: usize| {
        let skew = Vector3::from_fn(|a, _| psi.m0[(a, k)]).cross_matrix();
        largest_entry(3, 3, |i, j| ap.linear(k, i, j) - skew[(i, j)])
    };
    Some(Violation {
        by: (0..nq).map(missed_by_mode).fold(0.0, larger),
        scale: psi.sizes()[0].max(ap.sizes()[1]),
        rounding: psi.rounding[0] + ap.rounding[1],
    })
}

/// Returns the asymmetry of M1 of phi or psi in its modes; `None` without M1.
fn symmetry_missed(array: &Array, nq: usize) -> Option<Violation> {
    array.m1.as_ref()?;
    let missed_along = |a: usize| largest_entry(nq, nq, |k, l| array.linear(l, a, k) - array.linear(k, a, l));
    Some(Violation {
        by: (0..3).map(missed_along).fold(0.0, larger),
        scale: array.sizes()[1],
        rounding: 2.0 * array.rounding[1],
    })
}

/// Checks that the undeformed axes of every frame are a rotation. A mirrored frame belongs to another body.
fn undeformed_axes(listed: &Listed<'_>, frames: &[FrameArrays]) -> AuditCheck {
    let (mut total, mut what) = (Violation { by: 0.0, scale: 1.0, rounding: 0.0 }, String::new());
    for (frame, listed) in frames.iter().zip(&listed.frames) {
        let Some(ap) = &frame.ap else { continue };
        let axes = Matrix3::from_fn(|i, j| ap.m0[(i, j)]);
        let by =
            larger((axes.transpose() * axes - Matrix3::identity()).amax(), (axes.determinant() - 1.0).abs());
        total.rounding = total.rounding.max(ap.rounding[0]);
        if by > total.by || by.is_nan() {
            total.by = by;
            let how =
                if axes.determinant() < 0.0 { "a mirror image of the body axes" } else { "not orthonormal" };
            what = format!("the undeformed axes of node {} are {how}", listed.label);
        }
    }
    total.check("ap_is_a_rotation", "AP0' AP0 = 1, det AP0 = 1", Code::AuditFrame, what)
}
