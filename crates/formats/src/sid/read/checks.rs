//! Checks of the redundant arrays of a SID file.

use super::arrays::{Array, Arrays, FrameArrays, PAIRS, largest};
use super::body::{Blocks, Declared, Layout};
use super::frame_checks::{Missing, Violation, frame_checks, frequencies, is_free, largest_entry};
use super::parse::Listed;
use crate::import::AuditCheck;
use flexbody_base::diagnostic::Code;
use flexbody_linalg::larger;
use flexbody_linalg::ties::first_largest;

/// Checks of a file, and their conclusion about Oe1.
pub(crate) struct RedundancyChecks {
    pub(crate) checks: Vec<AuditCheck>,
    /// True if Oe1 holds more than Me implies: geometric stiffness for spin, or inertia that does not belong
    /// to Me.
    pub(crate) spin_in_oe: bool,
}

/// Compares the arrays of a file with each other. The checks are in the order of a report.
pub(crate) fn checks(
    listed: &Listed<'_>,
    arrays: &Arrays,
    frames: &[FrameArrays],
    layout: &Layout,
    declared: &Declared,
) -> RedundancyChecks {
    let missing = Missing::find(arrays, layout, declared);
    let mut all = vec![digits(listed, arrays, frames), missing.check()];
    let identities = Identities { arrays, layout, declared, missing };
    let centrifugal = identities.linear_centrifugal();
    all.extend(identities.first_moment());
    all.extend(identities.gyroscopic_symmetric());
    all.extend(identities.coriolis());
    all.extend(identities.layouts());
    all.extend(identities.constant_centrifugal());
    all.extend(centrifugal.checks);
    all.extend(identities.gyroscopic_skew(centrifugal.two_masses));
    all.extend(identities.acceleration_stiffness());
    all.push(identities.damping());
    all.extend(frame_checks(listed, frames));
    all.extend(frequencies(listed, arrays));
    RedundancyChecks { checks: all, spin_in_oe: centrifugal.spin_in_oe }
}

/// Arrays of the body, their layout and the missing arrays. Identities of missing arrays are skipped.
struct Identities<'a> {
    arrays: &'a Arrays,
    layout: &'a Layout,
    declared: &'a Declared,
    missing: Missing,
}

/// Checks of Oe1, and their conclusion about the masses behind the arrays.
struct LinearCentrifugal {
    checks: Vec<AuditCheck>,
    /// True if Oe1 belongs to another mass than Me although it should not.
    two_masses: bool,
    spin_in_oe: bool,
}

impl Identities<'_> {
    /// Compares mdCM1 with Ct0.
    fn first_moment(&self) -> Option<AuditCheck> {
        if !self.missing.none_of(&["mdCM1", "Ct"]) {
            return None;
        }
        let (moment, ct) = (&self.arrays.first_moment, &self.arrays.ct);
        let [bound, ..] = self.arrays.bounds();
        let missed = Violation {
            by: largest_entry(self.arrays.nq, 3, |k, a| moment.linear(k, a, 0) - ct.m0[(k, a)]),
            scale: scale(bound, &[moment.sizes()[1], ct.sizes()[0]]),
            rounding: moment.rounding[1] + ct.rounding[0],
        };
        Some(missed.check(
            "mdcm1_is_ct0",
            "mdCM1_k = Ct0_k",
            Code::AuditIdentity,
            "the change of the first moment with the modes and the coupling of the modes to translation contradict each other",
        ))
    }

    /// Compares the symmetric part of Gr with J1.
    fn gyroscopic_symmetric(&self) -> Option<AuditCheck> {
        if !self.missing.none_of(&["Gr", "J1"]) {
            return None;
        }
        let (gr, inertia) = (&self.arrays.gr, &self.arrays.inertia);
        let [_, bound, _] = self.arrays.bounds();
        let [even, _] = self.layout.gr.gr_misfit(self.arrays);
        let missed = Violation {
            by: even,
            scale: scale(bound, &[gr.sizes()[0], inertia.sizes()[1]]),
            rounding: gr.rounding[0] + inertia.rounding[1],
        };
        Some(missed.check(
            "gr_symmetric_is_j1",
            "sym(Gr_k) = J1_k",
            Code::AuditIdentity,
            "the gyroscopic torque and the change of the inertia with the modes contradict each other",
        ))
    }

    /// Compares the skew part of Gr with Cr0. If Oe1 does not belong to Me either, the two arrays come from
    /// different masses.
    fn gyroscopic_skew(&self, two_masses: bool) -> Option<AuditCheck> {
        if !self.missing.none_of(&["Gr", "Cr0"]) {
            return None;
        }
        let (gr, cr) = (&self.arrays.gr, &self.arrays.cr);
        let (code, meaning) = if two_masses {
            (
                Code::AuditLumped,
                "the gyroscopic torque and the coupling of rotation and modes come from different mass matrices",
            )
        } else if is_free(self.arrays, self.layout) {
            (
                Code::AuditIdentity,
                "Cr0, Ct and mdCM1 are zero, as for free modes, but Gr has a skew part: Gr is wrong, or all three arrays are missing",
            )
        } else {
            (
                Code::AuditIdentity,
                "the gyroscopic torque and the coupling of rotation and modes contradict each other",
            )
        };
        let [_, bound, _] = self.arrays.bounds();
        let [_, odd] = self.layout.gr.gr_misfit(self.arrays);
        let missed = Violation {
            by: odd,
            scale: scale(bound, &[gr.sizes()[0], cr.sizes()[0]]),
            rounding: gr.rounding[0] + cr.rounding[0],
        };
        Some(missed.check("gr_skew_is_cr0", "skew(Gr_k) = -(Cr0_k)~", code, meaning))
    }

    /// Compares Ge with Cr1.
    fn coriolis(&self) -> Option<AuditCheck> {
        if !self.missing.none_of(&["Ge", "Cr1"]) {
            return None;
        }
        let doubled = self.missed_of_ge(self.layout.ge.ge_doubled(self.arrays)).passes();
        Some(self.missed_of_ge(self.layout.ge.ge_misfit(self.arrays)).check(
            "ge_is_twice_cr1",
            "Ge(k,l) = Cr1(k,l) - Cr1(l,k), which is 2 Cr1 of a solid",
            Code::AuditIdentity,
            if doubled {
                "Ge is 2 Cr1 including its part that is symmetric in the modes, as FEMBS writes it: this part is geometric stiffness for angular acceleration and not a Coriolis force"
            } else {
                "the Coriolis forces among modes (Ge) and the coupling of rotation and modes linear in q (Cr1) contradict each other"
            },
        ))
    }

    fn missed_of_ge(&self, by: f64) -> Violation {
        let (ge, cr) = (&self.arrays.ge, &self.arrays.cr);
        let [.., bound] = self.arrays.bounds();
        Violation {
            by,
            scale: scale(bound, &[ge.sizes()[0], cr.sizes()[1]]),
            rounding: ge.rounding[0] + 2.0 * cr.rounding[1],
        }
    }

    /// Compares the column orders of Gr and Ge with those of the dialect.
    fn layouts(&self) -> Vec<AuditCheck> {
        let (arrays, own) = (self.arrays, self.layout);
        let (why, gr, ge) = match own.declared {
            Some((name, gr, ge)) => (format!("the dialect is {name}"), gr, ge),
            // No dialect has Gr by components and Ge by modes; every other combination belongs to a dialect.
            None if own.gr == Blocks::Component => ("Gr is component-blocked".to_owned(), own.gr, own.gr),
            None => return Vec::new(),
        };
        let meaning = |array: &str, expected: Blocks, found: Blocks| {
            format!("{why}, which has {array} {}, but the numbers are {}", expected.words(), found.words())
        };
        let [_, bound, _] = arrays.bounds();
        let [even, odd] = gr.gr_misfit(arrays);
        // If neither order fits, the mismatch is another finding.
        let gr_by = if gr == own.gr { 0.0 } else { even.max(odd) };
        let ge_by = if ge == own.ge { 0.0 } else { ge.ge_misfit(arrays) };
        let gr_scale = scale(bound, &[arrays.gr.sizes()[0]]);
        vec![
            Violation { by: gr_by, scale: gr_scale, rounding: arrays.gr.rounding[0] }.check(
                "gr_layout",
                "Gr in the order of columns of the dialect gives J1 and Cr0",
                Code::AuditLayout,
                meaning("Gr", gr, own.gr),
            ),
            self.missed_of_ge(ge_by).check(
                "ge_layout",
                "Ge in the order of columns of the dialect gives Cr1",
                Code::AuditLayout,
                meaning("Ge", ge, own.ge),
            ),
        ]
    }

    /// Compares Oe0 with J1, and detects exchanged last two columns.
    fn constant_centrifugal(&self) -> Vec<AuditCheck> {
        if !self.missing.none_of(&["Oe0", "J1"]) {
            return Vec::new();
        }
        let (oe, inertia) = (&self.arrays.oe, &self.arrays.inertia);
        let [_, bound, _] = self.arrays.bounds();
        let scale = scale(bound, &[oe.sizes()[0], inertia.sizes()[1]]);
        let (own, other) = (self.oe0_misfit(false), self.oe0_misfit(true));
        let rounding = oe.rounding[0] + inertia.rounding[1];
        let missed = |by: f64| Violation { by, scale, rounding };
        let exchanged = other < 0.1 * own && missed(other).passes();
        let identity = missed(if exchanged { other } else { own }).check(
            "oe0_is_j1",
            "Oe0(k) = -[J1_11/2, J1_22/2, J1_33/2, J1_12, J1_23, J1_13]_k",
            Code::AuditIdentity,
            "the constant centrifugal load and the change of the inertia with the modes contradict each other",
        );
        let order = missed(if exchanged { own } else { 0.0 }).check(
            "oe_layout",
            "Oe has its columns in the order 11, 22, 33, 12, 23, 13",
            Code::AuditLayout,
            "the last two columns of Oe are swapped",
        );
        vec![identity, order]
    }

    /// Returns the largest |Oe0 + J1 terms|, with the last two columns `exchanged` or in their given order.
    fn oe0_misfit(&self, exchanged: bool) -> f64 {
        largest_entry(self.arrays.nq, 6, |k, column| {
            let (a, b) = PAIRS[if exchanged && column > 3 { 9 - column } else { column }];
            let part = if a == b { 0.5 } else { 1.0 };
            self.arrays.oe.m0[(k, column)] + part * self.arrays.j1(k)[(a, b)]
        })
    }

    /// Checks that Oe1 is symmetric and agrees with Me.
    fn linear_centrifugal(&self) -> LinearCentrifugal {
        let stiffened = self.declared.stiffened == Some(true);
        let mut found = LinearCentrifugal { checks: Vec::new(), two_masses: false, spin_in_oe: stiffened };
        if !self.missing.none_of(&["Oe1"]) {
            return found;
        }
        let size = self.arrays.oe.sizes()[1];
        let [.., bound] = self.arrays.bounds();
        let scale = scale(bound, &[size]);
        found.checks.push(symmetric_in_modes(
            &self.arrays.oe,
            scale,
            "oe1_symmetric",
            "Oe1(k,l) = Oe1(l,k)",
            "the centrifugal forces linear in q are not the gradient of an energy",
        ));
        if size > 0.0 {
            let trace = trace(self.arrays, scale);
            let general = self.declared.general;
            found.spin_in_oe |= !(trace.passed() || general);
            // The trace need not agree if the file declares further contents of Oe1.
            if !(stiffened || general) {
                found.two_masses = !trace.passed();
                found.checks.push(trace);
            }
        }
        found
    }

    /// Checks the symmetry of Ct1; `None` if the file has no Ct1.
    fn acceleration_stiffness(&self) -> Option<AuditCheck> {
        let ct = &self.arrays.ct;
        ct.m1.as_ref()?;
        Some(symmetric_in_modes(
            ct,
            ct.sizes()[1],
            "ct1_symmetric",
            "Ct1(k,l) = Ct1(l,k)",
            "the geometric stiffness for acceleration is not symmetric",
        ))
    }

    fn damping(&self) -> AuditCheck {
        let (de, nq) = (&self.arrays.de.m0, self.arrays.nq);
        let missed = Violation {
            by: largest_entry(nq, nq, |i, j| de[(i, j)] - de[(j, i)]),
            scale: largest(de),
            rounding: 2.0 * self.arrays.de.rounding[0],
        };
        let meaning = "the damping matrix is not symmetric";
        missed.check("de_symmetric", "De = De'", Code::AuditIdentity, meaning)
    }
}

/// Returns the scale of an identity: the bound set by the mass, or the largest entry of the arrays if that is
/// larger.
fn scale(bound: f64, sizes: &[f64]) -> f64 {
    sizes.iter().fold(bound.max(0.0), |most, size| most.max(*size))
}

/// Checks that M1 is symmetric in its row and mode indices.
fn symmetric_in_modes(
    array: &Array,
    scale: f64,
    name: &'static str,
    formula: &'static str,
    meaning: &'static str,
) -> AuditCheck {
    let nq = array.m0.nrows();
    let missed_in_column =
        |c: usize| largest_entry(nq, nq, |k, l| array.linear(l, k, c) - array.linear(k, l, c));
    let by = (0..array.m0.ncols()).map(missed_in_column).fold(0.0, larger);
    Violation { by, scale, rounding: 2.0 * array.rounding[1] }.check(
        name,
        formula,
        Code::AuditIdentity,
        meaning,
    )
}

/// Compares the trace of Oe1 with Me.
fn trace(arrays: &Arrays, scale: f64) -> AuditCheck {
    let nq = arrays.nq;
    let sum = |k: usize, l: usize| (0..3).map(|c| arrays.oe.linear(l, k, c)).sum::<f64>();
    let by = largest_entry(nq, nq, |k, l| sum(k, l) + 2.0 * arrays.me.m0[(k, l)]);
    let ratio = |k: usize| -0.5 * sum(k, k) / arrays.me.m0[(k, k)];
    let worst_mode = first_largest(0..nq, |&k| (ratio(k) - 1.0).abs());
    let facts = worst_mode.map_or_else(String::new, |k| {
        format!(" (for mode {} Oe1 gives {:.4} of the modal mass)", k + 1, ratio(k))
    });
    let rounding = 3.0 * arrays.oe.rounding[1] + 2.0 * arrays.me.rounding[0];
    Violation { by, scale, rounding }.check(
        "oe1_is_me",
        "Oe1_11 + Oe1_22 + Oe1_33 = -2 Me",
        Code::AuditLumped,
        format!(
            "centrifugal forces and modal mass come from different mass matrices{facts}: possible causes are lumped masses, omitted rotational inertia of nodes, and geometric stiffness that the file does not declare"
        ),
    )
}

// Check of the digits that were lost in writing.

/// Largest relative rounding of an array that is not reported as lost digits. A larger value accepts files
/// with fewer digits.
const MAX_DIGIT_ROUNDING: f64 = 1e-8;

/// Constant (order 0) or linear (order 1) part of an array, with half a unit of its last digit and its
/// largest number.
struct Part {
    array: &'static str,
    order: usize,
    rounding: f64,
    size: f64,
}

impl Part {
    fn lost(&self) -> f64 {
        if self.size > 0.0 { self.rounding / self.size } else { 0.0 }
    }
}

/// Returns the check of the part with the largest loss of digits.
fn digits(listed: &Listed<'_>, arrays: &Arrays, frames: &[FrameArrays]) -> AuditCheck {
    let mut parts = parts_of_body(arrays);
    parts.extend(parts_of_frames(frames));
    parts.push(Part { array: "mass", order: 0, rounding: arrays.mass_rounding, size: arrays.mass.abs() });
    let most = first_largest(&parts, |part| part.lost());
    let (value, place) = most.map_or((0.0, String::new()), |most| {
        let Part { array, order, size, .. } = most;
        (most.lost(), format!("{array} (m{order}), whose largest is {size:.1e}"))
    });
    AuditCheck {
        name: "digits",
        formula: "half a unit of the last digit / largest number of each array",
        value,
        limit: MAX_DIGIT_ROUNDING,
        code: Code::AuditDigits,
        meaning: format!("numbers have {}; the loss is largest in {place}", listed.digits().words()),
    }
}

fn parts_of_body(arrays: &Arrays) -> Vec<Part> {
    let named = [
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
    let both_orders = |(name, array): (&'static str, &Array)| {
        let sizes = array.sizes();
        [0, 1].map(|order| Part { array: name, order, rounding: array.rounding[order], size: sizes[order] })
    };
    named.into_iter().flat_map(both_orders).collect()
}

/// Returns the constant parts of the arrays of frames, each from the frame with the largest loss.
fn parts_of_frames(frames: &[FrameArrays]) -> [Part; 3] {
    type Chosen = fn(&FrameArrays) -> Option<&Array>;
    let named: [(&'static str, Chosen); 3] = [
        ("origin", |frame| Some(&frame.origin)),
        ("phi", |frame| Some(&frame.phi)),
        ("psi", |frame| frame.psi.as_ref()),
    ];
    named.map(|(name, chosen)| {
        let rounding_and_size = |frame: &FrameArrays| {
            chosen(frame).map_or((0.0, 0.0), |array| (array.rounding[0], array.sizes()[0]))
        };
        let most = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
        let (rounding, size) = frames.iter().map(rounding_and_size).fold((0.0, 0.0), most);
        Part { array: name, order: 0, rounding, size }
    })
}
