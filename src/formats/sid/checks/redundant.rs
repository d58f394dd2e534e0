//! What the redundant arrays of a file must fulfil.

use super::frequencies::frequencies;
use super::missing::{Missing, is_free};
use crate::base::diagnostic::Code;
use crate::formats::import::AuditCheck;
use crate::formats::import::redundant::worst as larger;
use crate::formats::sid::read::arrays::{Array, Arrays, FrameArrays, PAIRS, largest};
use crate::formats::sid::read::body::Declared;
use crate::formats::sid::read::layout::{Blocks, Layout};
use crate::formats::sid::read::parse::Listed;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};

/// What identities may be missed by, relative to the Cauchy-Schwarz bounds of their arrays, beside the digits of the file: sums over the
/// nodes of a large model in double precision.
const ROUNDING: f64 = 1e-10;

/// Roundings of the last digit that one identity may add up.
const TERMS: f64 = 10.0;

/// Digits that a number may lack, relative to the largest of its array.
const LOST: f64 = 1e-8;

/// What was found.
pub(crate) struct Found {
    pub(crate) checks: Vec<AuditCheck>,
    /// Whether Oe1 holds more than Me does: geometric stiffness for spin, or inertia that does not belong to Me.
    pub(crate) spin_in_oe: bool,
}

/// One identity: by how much it is missed, the size of its terms, and half units of their last digits.
struct Missed {
    by: f64,
    scale: f64,
    rounding: f64,
}

impl Missed {
    fn check(
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

    fn passes(self) -> bool {
        self.check("", "", Code::AuditIdentity, "").passed()
    }
}

/// Every check.
pub(crate) fn checks(
    listed: &Listed<'_>,
    arrays: &Arrays,
    frames: &[FrameArrays],
    layout: &Layout,
    declared: &Declared,
) -> Found {
    let mut all = vec![digits(listed, arrays, frames)];
    let missing = Missing::find(arrays, layout, declared);
    all.push(missing.check());
    let there = |names: &[&str]| missing.none_of(names);
    let [bound_t, bound_r, bound_e] = arrays.bounds();
    let scale = |bound: f64, terms: &[f64]| terms.iter().fold(bound.max(0.0), |most, v| most.max(*v));
    let nq = arrays.nq;

    if there(&["mdCM1", "Ct"]) {
        let by = worst(nq, 3, |k, a| arrays.first_moment.linear(k, a, 0) - arrays.ct.m0[(k, a)]);
        let (moment, ct) = (arrays.first_moment.sizes()[1], arrays.ct.sizes()[0]);
        let rounding = arrays.first_moment.rounding[1] + arrays.ct.rounding[0];
        all.push(Missed { by, scale: scale(bound_t, &[moment, ct]), rounding }.check(
            "mdcm1_is_ct0",
            "mdCM1_k = Ct0_k",
            Code::AuditIdentity,
            "the first moment moves with the modes in another way than the modes couple to translation",
        ));
    }
    let [even, odd] = layout.gr.gr_misfit(arrays);
    let (gr, gr_rounding) = (arrays.gr.sizes()[0], arrays.gr.rounding[0]);
    if there(&["Gr", "J1"]) {
        let rounding = gr_rounding + arrays.inertia.rounding[1];
        all.push(
            Missed { by: even, scale: scale(bound_r, &[gr, arrays.inertia.sizes()[1]]), rounding }.check(
                "gr_symmetric_is_j1",
                "sym(Gr_k) = J1_k",
                Code::AuditIdentity,
                "the gyroscopic torque does not belong to the inertia that changes with the modes",
            ),
        );
    }
    let (ge, cr1) = (arrays.ge.sizes()[0], arrays.cr.sizes()[1]);
    let ge_rounding = arrays.ge.rounding[0] + 2.0 * arrays.cr.rounding[1];
    let ge_scale = scale(bound_e, &[ge, cr1]);
    if there(&["Ge", "Cr1"]) {
        let missed = |by: f64| Missed { by, scale: ge_scale, rounding: ge_rounding };
        let doubled = missed(layout.ge.ge_doubled(arrays)).passes();
        all.push(missed(layout.ge.ge_misfit(arrays)).check(
            "ge_is_twice_cr1",
            "Ge(k,l) = Cr1(k,l) - Cr1(l,k), which is 2 Cr1 of a solid",
            Code::AuditIdentity,
            if doubled {
                "Ge is 2 Cr1 with its part that is symmetric in the modes, as FEMBS writes it: geometric stiffness for angular acceleration, which is in Cr1, is no Coriolis force"
            } else {
                "the Coriolis forces among modes do not belong to the coupling of rotation and modes that grows with q"
            },
        ));
    }
    all.extend(layouts(arrays, layout, scale(bound_r, &[gr]), ge_scale, [gr_rounding, ge_rounding]));
    let oe = arrays.oe.sizes();
    if there(&["Oe0", "J1"]) {
        all.extend(constant_centrifugal(arrays, scale(bound_r, &[oe[0], arrays.inertia.sizes()[1]])));
    }
    let mut two_masses = false;
    let mut spin_in_oe = declared.stiffened == Some(true);
    if there(&["Oe1"]) {
        all.push(symmetric_in_modes(
            &arrays.oe,
            scale(bound_e, &[oe[1]]),
            "oe1_symmetric",
            "Oe1(k,l) = Oe1(l,k)",
            "centrifugal forces that grow with q are no gradient of an energy",
        ));
        if oe[1] > 0.0 {
            let sum = trace(arrays, scale(bound_e, &[oe[1]]));
            spin_in_oe |= !(sum.passed() || declared.general);
            // Where the file says that there is more in Oe1, nothing has to fit.
            if !(declared.stiffened == Some(true) || declared.general) {
                two_masses = !sum.passed();
                all.push(sum);
            }
        }
    }
    if there(&["Gr", "Cr0"]) {
        let rounding = gr_rounding + arrays.cr.rounding[0];
        // Where Oe1 does not belong to Me either, the two come from two masses.
        let (code, meaning) = if two_masses {
            (
                Code::AuditLumped,
                "the gyroscopic torque and the coupling of rotation and modes come from different masses",
            )
        } else if is_free(arrays, layout) {
            (
                Code::AuditIdentity,
                "Cr0, Ct and mdCM1 are zero as of free modes, but Gr has a skew part: Gr is wrong, or all of the three are missing",
            )
        } else {
            (
                Code::AuditIdentity,
                "the gyroscopic torque does not belong to the coupling of rotation and modes",
            )
        };
        let missed = Missed { by: odd, scale: scale(bound_r, &[gr, arrays.cr.sizes()[0]]), rounding };
        all.push(missed.check("gr_skew_is_cr0", "skew(Gr_k) = -(Cr0_k)~", code, meaning));
    }
    if arrays.ct.m1.is_some() {
        all.push(symmetric_in_modes(
            &arrays.ct,
            arrays.ct.sizes()[1],
            "ct1_symmetric",
            "Ct1(k,l) = Ct1(l,k)",
            "the geometric stiffness for acceleration is no symmetric matrix",
        ));
    }
    let de = &arrays.de.m0;
    let missed = Missed {
        by: worst(nq, nq, |i, j| de[(i, j)] - de[(j, i)]),
        scale: largest(de),
        rounding: 2.0 * arrays.de.rounding[0],
    };
    let meaning = "the damping matrix is not symmetric";
    all.push(missed.check("de_symmetric", "De = De'", Code::AuditIdentity, meaning));
    all.extend(of_frames(listed, frames));
    all.extend(frequencies(listed, arrays));
    Found { checks: all, spin_in_oe }
}

/// The largest magnitude. A NaN, from numbers beyond the range of double precision, passes nothing.
pub(crate) fn worst(rows: usize, columns: usize, f: impl Fn(usize, usize) -> f64) -> f64 {
    let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    places.map(|(i, j)| f(i, j).abs()).fold(0.0, larger)
}

/// Digits that were lost in writing.
fn digits(listed: &Listed<'_>, arrays: &Arrays, frames: &[FrameArrays]) -> AuditCheck {
    let of_body = [
        ("mdCM", &arrays.first_moment),
        ("J", &arrays.inertia),
        ("Ct", &arrays.ct),
        ("Cr", &arrays.cr),
        ("Me", &arrays.me),
        ("Gr", &arrays.gr),
        ("Ge", &arrays.ge),
        ("Oe", &arrays.oe),
        ("Ke", &arrays.ke),
        ("De", &arrays.de),
    ];
    let mut parts: Vec<(&str, usize, f64, f64)> = Vec::new();
    for (name, array) in of_body {
        let sizes = array.sizes();
        parts.extend([0, 1].map(|order| (name, order, array.rounding[order], sizes[order])));
    }
    for (name, order) in [("origin", 0), ("phi", 0), ("psi", 0)] {
        let of_frame = |frame: &FrameArrays| {
            let array = match name {
                "origin" => Some(&frame.origin),
                "phi" => Some(&frame.phi),
                _ => frame.psi.as_ref(),
            };
            array.map_or((0.0, 0.0), |array| (array.rounding[order], array.sizes()[order]))
        };
        let most = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
        let (rounding, size) = frames.iter().map(of_frame).fold((0.0, 0.0), most);
        parts.push((name, order, rounding, size));
    }
    parts.push(("mass", 0, arrays.mass_rounding, arrays.mass.abs()));
    let lost =
        |&(.., rounding, size): &(&str, usize, f64, f64)| if size > 0.0 { rounding / size } else { 0.0 };
    let most = parts.iter().max_by(|a, b| lost(a).total_cmp(&lost(b)));
    let (value, place) = most.map_or((0.0, String::new()), |most| {
        let (name, order, _, size) = most;
        (lost(most), format!("{name} (m{order}), whose largest is {size:.1e}"))
    });
    AuditCheck {
        name: "digits",
        formula: "half a unit of the last digit beside the largest number of each array",
        value,
        limit: LOST,
        code: Code::AuditDigits,
        meaning: format!("numbers have {}, which is least for {place}", listed.digits().words()),
    }
}

/// Gr and Ge in the order that the dialect has.
fn layouts(
    arrays: &Arrays,
    layout: &Layout,
    gr_scale: f64,
    ge_scale: f64,
    rounding: [f64; 2],
) -> Vec<AuditCheck> {
    let expected = match layout.declared {
        Some((name, gr, ge)) => (format!("the dialect is {name}"), gr, ge),
        // No dialect has Gr by components and Ge by modes; with every other order there is one.
        None if layout.gr == Blocks::Component => {
            ("Gr is component-blocked".to_owned(), layout.gr, layout.gr)
        }
        None => return Vec::new(),
    };
    let (why, gr, ge) = expected;
    let meaning = |array: &str, own: Blocks, there: Blocks| {
        format!("{why}, which has {array} {}, but the numbers are {}", own.words(), there.words())
    };
    let [even, odd] = gr.gr_misfit(arrays);
    // Where neither order fits, that is another finding.
    let gr_by = if gr == layout.gr { 0.0 } else { even.max(odd) };
    let ge_by = if ge == layout.ge { 0.0 } else { ge.ge_misfit(arrays) };
    vec![
        Missed { by: gr_by, scale: gr_scale, rounding: rounding[0] }.check(
            "gr_layout",
            "Gr in the order of columns of the dialect gives J1 and Cr0",
            Code::AuditLayout,
            meaning("Gr", gr, layout.gr),
        ),
        Missed { by: ge_by, scale: ge_scale, rounding: rounding[1] }.check(
            "ge_layout",
            "Ge in the order of columns of the dialect gives Cr1",
            Code::AuditLayout,
            meaning("Ge", ge, layout.ge),
        ),
    ]
}

/// Oe0 against J1, and whether its last two columns are exchanged.
fn constant_centrifugal(arrays: &Arrays, scale: f64) -> Vec<AuditCheck> {
    let nq = arrays.nq;
    let misfit = |exchanged: bool| {
        worst(nq, 6, |k, column| {
            let (a, b) = PAIRS[if exchanged && column > 3 { 9 - column } else { column }];
            let part = if a == b { 0.5 } else { 1.0 };
            arrays.oe.m0[(k, column)] + part * arrays.j1(k)[(a, b)]
        })
    };
    let (own, other) = (misfit(false), misfit(true));
    let rounding = arrays.oe.rounding[0] + arrays.inertia.rounding[1];
    let missed = |by: f64| Missed { by, scale, rounding };
    let exchanged = other < 0.1 * own && missed(other).passes();
    let identity = missed(if exchanged { other } else { own }).check(
        "oe0_is_j1",
        "Oe0(k) = -[J1_11/2, J1_22/2, J1_33/2, J1_12, J1_23, J1_13]_k",
        Code::AuditIdentity,
        "the constant centrifugal load does not belong to the inertia that changes with the modes",
    );
    let order = missed(if exchanged { own } else { 0.0 }).check(
        "oe_layout",
        "Oe has its columns in the order 11, 22, 33, 12, 23, 13",
        Code::AuditLayout,
        "the last two columns of Oe are exchanged",
    );
    vec![identity, order]
}

/// M1 symmetric in its row and its mode.
fn symmetric_in_modes(
    array: &Array,
    scale: f64,
    name: &'static str,
    formula: &'static str,
    meaning: &'static str,
) -> AuditCheck {
    let columns = 0..array.m0.ncols();
    let of_column = |c: usize| {
        worst(array.m0.nrows(), array.m0.nrows(), |k, l| array.linear(l, k, c) - array.linear(k, l, c))
    };
    let by = columns.map(of_column).fold(0.0, larger);
    Missed { by, scale, rounding: 2.0 * array.rounding[1] }.check(name, formula, Code::AuditIdentity, meaning)
}

/// Oe1 against Me.
fn trace(arrays: &Arrays, scale: f64) -> AuditCheck {
    let nq = arrays.nq;
    let sum = |k: usize, l: usize| (0..3).map(|c| arrays.oe.linear(l, k, c)).sum::<f64>();
    let by = worst(nq, nq, |k, l| sum(k, l) + 2.0 * arrays.me.m0[(k, l)]);
    let ratio = |k: usize| -0.5 * sum(k, k) / arrays.me.m0[(k, k)];
    let worst_mode = (0..nq).max_by(|&a, &b| (ratio(a) - 1.0).abs().total_cmp(&(ratio(b) - 1.0).abs()));
    let facts = worst_mode.map_or_else(String::new, |k| {
        format!(": of mode {} Oe1 has {:.4} of the modal mass", k + 1, ratio(k))
    });
    let rounding = 3.0 * arrays.oe.rounding[1] + 2.0 * arrays.me.rounding[0];
    Missed { by, scale, rounding }.check(
        "oe1_is_me",
        "Oe1_11 + Oe1_22 + Oe1_33 = -2 Me",
        Code::AuditLumped,
        format!(
            "centrifugal forces and modal mass come from different masses{facts}; lumped masses do that, rotational inertia of \
             nodes that is left out, or geometric stiffness that the file does not declare"
        ),
    )
}

/// What the arrays of the frames say of each other.
fn of_frames(listed: &Listed<'_>, frames: &[FrameArrays]) -> Vec<AuditCheck> {
    if frames.is_empty() && listed.stated_frames.unwrap_or(0) == 0 {
        return Vec::new();
    }
    let nq = listed.nq;
    let stated = listed.stated_frames.unwrap_or(frames.len());
    let mut all = vec![AuditCheck {
        name: "number_of_frames",
        formula: "frames of the file = nodes of its first line",
        value: stated.abs_diff(frames.len()) as f64,
        limit: 0.0,
        code: Code::AuditIdentity,
        meaning: format!("the first line states {stated} nodes, the file has {}", frames.len()),
    }];
    let skew = |psi: &Mat<f64>, k: usize| Vector3::from_fn(|a, _| psi[(a, k)]).cross_matrix();
    let mut identity = |name, formula, meaning: &str, of: &dyn Fn(&FrameArrays) -> Option<Missed>| {
        let (mut total, mut place) = (Missed { by: 0.0, scale: 0.0, rounding: 0.0 }, None);
        for (frame, listed) in frames.iter().zip(&listed.frames) {
            let Some(missed) = of(frame) else { continue };
            if missed.by > total.by || missed.by.is_nan() {
                (total.by, place) = (missed.by, Some(&listed.label));
            }
            total.scale = total.scale.max(missed.scale);
            total.rounding = total.rounding.max(missed.rounding);
        }
        let place = place.map_or_else(String::new, |label| format!(", most at node {label}"));
        all.push(total.check(name, formula, Code::AuditIdentity, format!("{meaning}{place}")));
    };
    identity(
        "origin_m1_is_phi",
        "origin.M1_k = phi_k",
        "the place of a frame moves in another way than forces there do work",
        &|frame| {
            let by = worst(3, nq, |a, k| frame.origin.linear(k, a, 0) - frame.phi.m0[(a, k)]);
            let scale = frame.origin.sizes()[1].max(frame.phi.sizes()[0]);
            Some(Missed { by, scale, rounding: frame.origin.rounding[1] + frame.phi.rounding[0] })
        },
    );
    identity(
        "ap_m1_is_psi",
        "AP.M1_k = (psi_k)~",
        "the axes of a frame turn in another way than torques there do work",
        &|frame| {
            let (psi, ap) = (frame.psi.as_ref()?, frame.ap.as_ref()?);
            let by = (0..nq).fold(0.0, |most: f64, k| {
                let skew = skew(&psi.m0, k);
                let now = worst(3, 3, |i, j| ap.linear(k, i, j) - skew[(i, j)]);
                larger(most, now)
            });
            let scale = psi.sizes()[0].max(ap.sizes()[1]);
            Some(Missed { by, scale, rounding: psi.rounding[0] + ap.rounding[1] })
        },
    );
    for (name, formula, of_moment) in [
        ("phi1_symmetric", "phi.M1(k,l) = phi.M1(l,k)", false),
        ("psi1_symmetric", "psi.M1(k,l) = psi.M1(l,k)", true),
    ] {
        let array = |frame: &'_ FrameArrays| -> Option<(f64, f64, f64)> {
            let array = if of_moment { frame.psi.as_ref()? } else { &frame.phi };
            array.m1.as_ref()?;
            let by = (0..3).fold(0.0, |most: f64, a| {
                most.max(worst(nq, nq, |k, l| array.linear(l, a, k) - array.linear(k, a, l)))
            });
            Some((by, array.sizes()[1], 2.0 * array.rounding[1]))
        };
        if frames.iter().any(|frame| array(frame).is_some()) {
            identity(
                name,
                formula,
                "the geometric stiffness of a load at a frame is no symmetric matrix",
                &|frame| array(frame).map(|(by, scale, rounding)| Missed { by, scale, rounding }),
            );
        }
    }
    all.push(axes(listed, frames));
    all
}

/// The undeformed axes of every frame. Those of the body have no other, so that a mirrored frame is one of another body.
fn axes(listed: &Listed<'_>, frames: &[FrameArrays]) -> AuditCheck {
    let (mut total, mut what) = (Missed { by: 0.0, scale: 1.0, rounding: 0.0 }, String::new());
    for (frame, listed) in frames.iter().zip(&listed.frames) {
        let Some(ap) = &frame.ap else { continue };
        let axes = Matrix3::from_fn(|i, j| ap.m0[(i, j)]);
        let by =
            larger((axes.transpose() * axes - Matrix3::identity()).amax(), (axes.determinant() - 1.0).abs());
        total.rounding = total.rounding.max(ap.rounding[0]);
        if by > total.by || by.is_nan() {
            total.by = by;
            let how =
                if axes.determinant() < 0.0 { "a mirror image of the body's" } else { "not orthonormal" };
            what = format!("the undeformed axes of node {} are {how}", listed.label);
        }
    }
    total.check("ap_is_a_rotation", "AP0' AP0 = 1, det AP0 = 1", Code::AuditFrame, what)
}
