//! Identities between the arrays of the frames, arrays that are zero although others require them, and frequencies.

use super::arrays::{Array, Arrays, FrameArrays};
use super::body::{Declared, Layout};
use super::parse::Listed;
use crate::import::AuditCheck;
use flexbody_base::diagnostic::Code;
use flexbody_linalg::larger;
use flexbody_linalg::ties::first_largest;
use libm::pow;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;

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

// Violation of an identity between arrays, compared with the digits of the file.

/// Violation of identities allowed beyond the digits of the file, relative to the Cauchy-Schwarz bounds of
/// their arrays: the rounding of sums over the nodes of a large model in double precision.
const ROUNDING: f64 = 1e-10;

/// Number of last-digit roundings that one identity may accumulate. A smaller value reports rounding as
/// contradictions.
const TERMS: f64 = 10.0;

/// Violation of an identity, with the scale of its terms and half a unit of their last digits.
pub(super) struct Violation {
    pub by: f64,
    pub scale: f64,
    pub rounding: f64,
}

impl Violation {
    pub(super) fn check(
        self,
        name: &'static str,
        formula: &'static str,
        code: Code,
        meaning: impl Into<String>,
    ) -> AuditCheck {
        let relative = |v: f64| if v == 0.0 { 0.0 } else { v / self.scale };
        let limit = ROUNDING + TERMS * relative(self.rounding);
        AuditCheck { name, formula, value: relative(self.by), limit, code, meaning: meaning.into() }
    }

    pub(super) fn passes(self) -> bool {
        self.check("", "", Code::AuditIdentity, "").passed()
    }
}

/// Returns the largest magnitude of `entry` over all rows and columns. A NaN, from numbers beyond double
/// precision, is returned as NaN and fails every check.
pub(super) fn largest_entry(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> f64 {
    let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    places.map(|(i, j)| entry(i, j).abs()).fold(0.0, larger)
}

// Detection of arrays that are zero although other arrays require them.

/// Largest part of its bound for which an array counts as zero. A larger value reports small arrays as
/// missing.
const ZERO_ARRAY: f64 = 1e-9;

/// Missing arrays, and the contradictions in words.
pub(crate) struct Missing {
    arrays: Vec<&'static str>,
    why: Vec<String>,
}

/// Largest entries of arrays and of their parts.
struct Sizes {
    mdcm1: f64,
    ct0: f64,
    cr0: f64,
    /// All of Cr1, and its part that is skew in the modes.
    cr1: [f64; 2],
    j1: f64,
    gr0: f64,
    /// Symmetric and skew part of the blocks of Gr.
    gr_parts: [f64; 2],
    ge: f64,
    oe0: f64,
    oe1: f64,
}

impl Sizes {
    fn of(arrays: &Arrays, layout: &Layout) -> Self {
        let nq = arrays.nq;
        let [constant, linear] = [0, 1].map(|order| move |array: &Array| array.sizes()[order]);
        let largest = |part: &dyn Fn(Matrix3<f64>) -> Matrix3<f64>| {
            (0..nq).map(|k| 0.5 * part(layout.gr.gr(arrays, k)).amax()).fold(0.0, f64::max)
        };
        let skew = |a: usize| largest_entry(nq, nq, |k, l| arrays.cr1_skew(k, l, a));
        Self {
            mdcm1: linear(&arrays.first_moment),
            ct0: constant(&arrays.ct),
            cr0: constant(&arrays.cr),
            cr1: [linear(&arrays.cr), (0..3).map(skew).fold(0.0, f64::max)],
            j1: linear(&arrays.inertia),
            gr0: constant(&arrays.gr),
            gr_parts: [largest(&|gr| gr + gr.transpose()), largest(&|gr| gr - gr.transpose())],
            ge: constant(&arrays.ge),
            oe0: constant(&arrays.oe),
            oe1: linear(&arrays.oe),
        }
    }

    /// Returns true if the modes move neither the centre of mass nor the angular momentum, like free modes,
    /// for which Cr0 is zero.
    fn are_free(&self, arrays: &Arrays) -> bool {
        let [bound_t, bound_r, _] = arrays.bounds();
        self.ct0.max(self.mdcm1) <= ZERO_ARRAY * bound_t && self.cr0 <= ZERO_ARRAY * bound_r
    }
}

/// Returns true if Cr0 is zero like for free modes, so that a skew part of Gr is an error of Gr.
pub(crate) fn is_free(arrays: &Arrays, layout: &Layout) -> bool {
    Sizes::of(arrays, layout).are_free(arrays)
}

impl Missing {
    pub(crate) fn find(arrays: &Arrays, layout: &Layout, declared: &Declared) -> Self {
        let mut found = Self { arrays: Vec::new(), why: Vec::new() };
        let sizes = Sizes::of(arrays, layout);
        let [bound_t, bound_r, bound_e] = arrays.bounds();
        let is = |size: f64, bound: f64| size > ZERO_ARRAY * bound;
        let [gr_even, gr_skew] = sizes.gr_parts.map(|part| is(part, bound_r));
        let [j1, cr0, oe0] = [sizes.j1, sizes.cr0, sizes.oe0].map(|size| is(size, bound_r));

        found.add_if_missing("Ct", sizes.ct0, &[(is(sizes.mdcm1, bound_t), "mdCM1 is not")]);
        found.add_if_missing("mdCM1", sizes.mdcm1, &[(is(sizes.ct0, bound_t), "Ct is not")]);
        if !sizes.are_free(arrays) {
            found.add_if_missing("Cr0", sizes.cr0, &[(gr_skew, "Gr has a skew part")]);
        }
        found.add_if_missing("Gr", sizes.gr0, &[(j1, "J1 is not"), (cr0, "Cr0 is not")]);
        found.add_if_missing("J1", sizes.j1, &[(gr_even, "Gr has a symmetric part"), (oe0, "Oe0 is not")]);
        found.add_if_missing("Oe0", sizes.oe0, &[(j1, "J1 is not")]);
        found.add_if_missing("Ge", sizes.ge, &[(is(sizes.cr1[1], bound_e), "Cr1 is not")]);
        let ge = is(sizes.ge, bound_e);
        if sizes.cr1[0] == 0.0 {
            found.add_if_missing("Cr1", 0.0, &[(ge, "Ge is not")]);
        } else if sizes.cr1[1] == 0.0 && ge {
            found.arrays.push("Cr1");
            found.why.push("Cr1 is symmetric in the modes although Ge is not zero".to_owned());
        }
        found.add_if_missing("Oe1", sizes.oe1, &[(bound_e > 0.0 && !declared.without_w2, "Me is not")]);
        found
    }

    fn add_if_missing(&mut self, name: &'static str, size: f64, witnesses: &[(bool, &str)]) {
        let because: Vec<&str> = witnesses.iter().filter(|(is, _)| *is).map(|(_, why)| *why).collect();
        if size == 0.0 && !because.is_empty() {
            self.arrays.push(name);
            self.why.push(format!("{name} is zero although {}", because.join(" and ")));
        }
    }

    /// Returns true if none of the arrays `names` is missing.
    pub(crate) fn none_of(&self, names: &[&str]) -> bool {
        names.iter().all(|name| !self.arrays.contains(name))
    }

    pub(crate) fn check(&self) -> AuditCheck {
        let why = if self.why.is_empty() { "nothing".to_owned() } else { self.why.join(", ") };
        AuditCheck {
            name: "coupling_is_there",
            formula: "number of arrays that are zero but must not be",
            value: self.arrays.len() as f64,
            limit: 0.0,
            code: Code::AuditCoupling,
            meaning: format!("the coupling of rigid motion and deformation is incomplete: {why}"),
        }
    }
}

// Comparison of the frequencies in the texts of the modes with those of the matrices.

/// Relative tolerance of frequencies in texts, which are often those of the model before its reduction. A
/// smaller value reports the error of the reduction.
const FREQUENCY: f64 = 0.01;

/// Largest entries of Ke off the diagonal, relative to the diagonal, for which the diagonal gives the
/// frequencies.
const DIAGONAL: f64 = 1e-6;

/// Returns the frequency in a text such as `Eigen Mode 1 : 9.089 Hz` in the unit of the text, half a unit of
/// its last digit, and true if the unit is radians.
fn frequency_of(text: &str) -> Option<(f64, f64, bool)> {
    let words: Vec<&str> =
        text.split([' ', '\t', ':', '=', ',', ';']).filter(|word| !word.is_empty()).collect();
    let unit = |word: &str| {
        let word = word.to_lowercase();
        if word == "rad/s" { Some(true) } else { (word == "hz" || word.starts_with("1/")).then_some(false) }
    };
    words.windows(2).find_map(|pair| {
        let radians = unit(pair[1])?;
        let value: f64 = pair[0].replace(['D', 'd'], "e").parse().ok().filter(|v: &f64| v.is_finite())?;
        let (mantissa, exponent) = pair[0].split_once(['e', 'E', 'd', 'D']).unwrap_or((pair[0], "0"));
        let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len()) as f64;
        let exponent: f64 = exponent.parse().unwrap_or(0.0);
        Some((value, 0.5 * pow(10.0, exponent - decimals), radians))
    })
}

/// Returns the check of the text with the largest difference; `None` if no text has a frequency or the modes
/// are coupled by Ke.
pub(crate) fn frequencies(listed: &Listed<'_>, arrays: &Arrays) -> Option<AuditCheck> {
    let (ke, me, nq) = (&arrays.ke.m0, &arrays.me.m0, arrays.nq);
    let coupled = (0..nq).any(|i| {
        (0..nq).any(|j| i != j && ke[(i, j)].abs() > DIAGONAL * (ke[(i, i)] * ke[(j, j)]).abs().sqrt())
    });
    if coupled {
        return None;
    }
    // Compared values: mode, frequency of the text, frequency of the matrices, and the relative difference
    // beyond the digits of the text.
    let compared = |&(mode, text): &(usize, &str)| {
        let (said, half, radians) = frequency_of(text)?;
        let lambda = (mode < nq).then(|| ke[(mode, mode)] / me[(mode, mode)])?;
        let computed = lambda.sqrt() / if radians { 1.0 } else { TAU };
        let apart = ((said - computed).abs() - half).max(0.0) / computed;
        Some((mode, said / computed, if lambda > 0.0 { apart } else { f64::NAN }))
    };
    let all: Vec<(usize, f64, f64)> = listed.mode_texts.iter().filter_map(compared).collect();
    let &(mode, ratio, value) = first_largest(&all, |one| one.2)?;
    let known = [
        (TAU, "2 pi, as if radians per second were meant"),
        (1.0 / TAU, "1 / (2 pi), as if radians per second were meant"),
        (1000.0, "1000, as if milliseconds were mixed with seconds"),
        (0.001, "1/1000, as if milliseconds were mixed with seconds"),
        (
            1000f64.sqrt(),
            "sqrt(1000), as if a mass or length were in a unit 1000 times too large or too small",
        ),
        (
            0.001f64.sqrt(),
            "1/sqrt(1000), as if a mass or length were in a unit 1000 times too large or too small",
        ),
        (60.0, "60, as if revolutions per minute were meant"),
    ];
    let factor = known.iter().find(|(factor, _)| (ratio / factor - 1.0).abs() < FREQUENCY);
    let factor = factor.map_or_else(|| format!("{ratio:.4}"), |(_, words)| (*words).to_owned());
    Some(AuditCheck {
        name: "frequencies",
        formula: "frequency of the text of each mode = sqrt(Ke/Me) / (2 pi)",
        value,
        limit: FREQUENCY,
        code: Code::AuditUnits,
        meaning: format!(
            "the frequency in the text of mode {} differs from that of stiffness and mass by the factor {factor}",
            mode + 1
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_of_texts() {
        let (value, half, radians) = frequency_of("Eigen Mode    1 :        9.089 Hz").expect("a frequency");
        assert!(value == 9.089 && (half - 5e-4).abs() < 1e-16 && !radians);
        let (value, half, _) = frequency_of("Eigen Mode 3 : 1.25e-3 1/ms").expect("a frequency");
        assert!(value == 1.25e-3 && (half - 5e-6).abs() < 1e-18);
        assert_eq!(frequency_of("7 rad/s").map(|f| (f.0, f.2)), Some((7.0, true)));
        assert_eq!(frequency_of("MatMorembs ansatz function #1"), None);
    }
}
