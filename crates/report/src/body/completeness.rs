//! Completeness of the modes in a sentence that claims no more than the certificate proves.

use super::craig_bampton;
use crate::notation::markup::plain;
use crate::notation::numbers::{counted, frequency, significant};
use flexbody_body::basis::BasisKind;
use flexbody_body::flex_body::{FlexBody, TermGroup, is_static};
use flexbody_body::invariants::{DIGITS, digits_of_error};
use flexbody_linalg::ties::first_smallest;
use serde::{Serialize, Serializer};

/// Judged certificate of a body.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(super) struct Completeness {
    /// True if the certificate proves that no mode of the basis is missing: modes of the free body or, for
    /// Craig-Bampton, fixed-interface modes. Static shapes have no completeness.
    pub proved: bool,
    /// Verdict: `proved`; `given` (shapes that are not claimed to be modes); `open`.
    pub verdict: &'static str,
    #[serde(skip)]
    pub head: &'static str,
    pub sentence: String,
    /// Counted number of flexible modes below the shift; of a Craig-Bampton body, of fixed-interface modes.
    pub proved_modes: Option<usize>,
    pub rigid_modes: usize,
    pub negative_pivots: Option<usize>,
    /// Shift sigma. Unit: 1/time^2.
    pub shift: f64,
    /// Frequency sqrt(sigma) / (2 pi) of the shift; `None` for a negative shift. Unit: Hz.
    pub shift_hz: Option<f64>,
    pub remark: String,
    pub rigid_noise: f64,
    pub rigid_residual: f64,
}

impl Completeness {
    pub(crate) fn of(body: &FlexBody) -> Self {
        let c = body.certificate();
        let hertz = body.units().hertz() / std::f64::consts::TAU;
        // The proof of a Craig-Bampton body is a count with the interfaces held.
        let (shift, proved_modes, negative_pivots) = match &c.fixed_interface {
            Some(fixed) => (fixed.shift, fixed.counted, fixed.counted),
            None => (c.shift, c.proved_modes, c.negative_pivots),
        };
        let shift_hz = (shift >= 0.0).then(|| shift.sqrt() * hertz);
        let (proved, sentence) = judge(body, shift_hz);
        let (verdict, head) = head(body, proved);
        Self {
            proved,
            verdict,
            head,
            sentence,
            proved_modes,
            rigid_modes: c.rigid_modes,
            negative_pivots,
            shift,
            shift_hz,
            remark: c.remark.clone(),
            rigid_noise: c.rigid_noise,
            rigid_residual: c.rigid_residual,
        }
    }
}

/// Returns the number of modes of the body that are static shapes.
fn static_shapes(body: &FlexBody) -> usize {
    body.modes().provenance.iter().filter(|origin| is_static(origin)).count()
}

/// Verdict for shapes that are not claimed to be complete.
const GIVEN: &str = "given";

/// Returns true if another program counted as many modes as the body has.
fn counted_elsewhere(body: &FlexBody) -> bool {
    let c = body.certificate();
    let below = body.modes().eigenvalue.iter().filter(|&&l| l < c.shift).count();
    let flexible = c.negative_pivots.and_then(|count| count.checked_sub(c.rigid_modes));
    body.source().settings["engine"].is_string()
        && c.proved_modes.is_none()
        && below == body.n_modes()
        && flexible.is_some_and(|flexible| flexible >= below)
}

/// Returns the verdict in one word and in a short sentence.
fn head(body: &FlexBody, proved: bool) -> (&'static str, &'static str) {
    match (&body.certificate().fixed_interface, proved) {
        (Some(fixed), true) if fixed.modes == 0 => ("proved", "Static condensation."),
        (Some(_), true) => ("proved", "No fixed-interface mode is missing."),
        (Some(_), false) => ("open", "Fixed-interface modes not proved complete."),
        (None, true) if static_shapes(body) > 0 => ("proved", "No free mode is missing."),
        (None, true) => ("proved", "No mode is missing."),
        // Files of earlier versions state the proof in the remark only.
        (None, false) if body.basis() == Some(BasisKind::CraigBampton) => (GIVEN, "Craig-Bampton basis."),
        // Without a count there is no evidence against completeness either.
        (None, false)
            if body.basis() == Some(BasisKind::Imported) && body.certificate().negative_pivots.is_none() =>
        {
            (GIVEN, "Shapes taken as given.")
        }
        (None, false) if counted_elsewhere(body) => {
            (GIVEN, "No mode is missing by the count of another program.")
        }
        (None, false) => ("open", "Not proved complete."),
    }
}

/// Judges the certificate of a body. It is a proof only if its numbers agree with each other and with the
/// modes of the body.
fn judge(body: &FlexBody, shift_hz: Option<f64>) -> (bool, String) {
    let (c, nf) = (body.certificate(), body.n_modes());
    if let Some(fixed) = &c.fixed_interface {
        return craig_bampton::judge(fixed, body);
    }
    let Some(flexible) = c.proved_modes else {
        let why = if c.remark.is_empty() { "no inertia count was made".to_owned() } else { plain(&c.remark) };
        let verdict = match head(body, false).0 {
            _ if counted_elsewhere(body) => "counted elsewhere",
            GIVEN => "not proved",
            _ => "NOT PROVED",
        };
        return (false, format!("{verdict}: {why}"));
    };
    let shift = frequency(shift_hz.unwrap_or(f64::NAN), 5);
    // The count must agree with the claim, and the body must hold the claimed modes.
    let below = body.modes().eigenvalue.iter().filter(|&&l| l < c.shift).count();
    let count = c.negative_pivots.map_or("missing".to_owned(), |n| n.to_string());
    if c.negative_pivots != flexible.checked_add(c.rigid_modes) {
        let claim = format!("{flexible} flexible + {} rigid modes", c.rigid_modes);
        return (false, format!("NOT PROVED: {claim} are claimed, but the inertia count is {count}"));
    }
    if below != flexible.min(nf) {
        let have = format!("the body has {below} of the {flexible} flexible modes below {shift}");
        return (false, format!("NOT PROVED: {have} (inertia count {count})"));
    }
    let proof = format!(
        "{flexible} flexible + {} below {shift} (inertia count {count})",
        counted(c.rigid_modes, "rigid mode")
    );
    // Modes above the count must be static shapes for a complete proof.
    let statics = static_shapes(body);
    match flexible.cmp(&nf) {
        std::cmp::Ordering::Less if nf - flexible == statics => (
            true,
            format!(
                "proved: {proof}; {} {} not modes",
                counted(statics, "static shape"),
                if statics == 1 { "is" } else { "are" }
            ),
        ),
        std::cmp::Ordering::Less => (
            false,
            format!(
                "PROVED IN PART: {proof}; {} above this frequency not proved",
                counted(nf - flexible, "mode")
            ),
        ),
        std::cmp::Ordering::Equal => (true, format!("proved: {proof}")),
        std::cmp::Ordering::Greater => (true, format!("proved: {proof}, the lowest {nf} of them kept")),
    }
}

// Guarantees of the accuracy `certified` in quotable numbers.

/// Guarantees of a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct GuaranteeFacts {
    /// Lower bound of each eigenvalue. Unit: 1/time^2.
    pub eigenvalue_lower: Vec<f64>,
    /// Upper bound of each eigenvalue. Unit: 1/time^2.
    pub eigenvalue_upper: Vec<f64>,
    /// Guaranteed digits of each eigenvalue: -log10 of the larger distance to a bound, relative to the
    /// eigenvalue.
    pub eigenvalue_digits: Vec<f64>,
    pub shape_error: Vec<f64>,
    #[serde(serialize_with = "as_map")]
    pub invariant_digits: Vec<(&'static str, f64)>,
    /// Shift between the rigid modes and the first flexible one. Unit: 1/time^2.
    pub shift_below: f64,
    pub shift_below_hz: f64,
    pub negative_pivots_below: usize,
}

fn as_map<S: Serializer>(pairs: &[(&'static str, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().copied())
}

impl GuaranteeFacts {
    pub(crate) fn of(body: &FlexBody) -> Option<Self> {
        let guarantee = body.certificate().guarantee.as_ref()?;
        let bounds = guarantee.eigenvalue_lower.iter().zip(&guarantee.eigenvalue_upper);
        let digits = |(value, (lower, upper)): (&f64, (&f64, &f64))| {
            let error = (value - lower).max(upper - value) / value;
            digits_of_error(error)
        };
        Some(Self {
            eigenvalue_digits: body.modes().eigenvalue.iter().zip(bounds).map(digits).collect(),
            eigenvalue_lower: guarantee.eigenvalue_lower.clone(),
            eigenvalue_upper: guarantee.eigenvalue_upper.clone(),
            shape_error: guarantee.shape_error.clone(),
            invariant_digits: DIGITS.into_iter().zip(guarantee.digits).collect(),
            shift_below: guarantee.shift_below,
            shift_below_hz: body.units().frequency_of(guarantee.shift_below.max(0.0)),
            negative_pivots_below: guarantee.pivots_below,
        })
    }

    /// Returns the guarantees of the eigenvalues and the inertia count below them in words.
    pub(crate) fn eigenvalues(&self) -> String {
        let (digits, mode) = least(self.eigenvalue_digits.iter().copied().zip(1..));
        let rigid = counted(self.negative_pivots_below, "rigid mode");
        format!(
            "every eigenvalue to {digits} digits or more (mode {mode} worst); only {rigid} below {} (inertia count {})",
            frequency(self.shift_below_hz, 5),
            self.negative_pivots_below
        )
    }

    /// Returns the guarantees of the invariants, and the distance of the modes from the exact modes, in
    /// words.
    pub(crate) fn invariants(&self) -> String {
        let (digits, name) = least(self.invariant_digits.iter().map(|&(name, digits)| (digits, name)));
        let shape = self.shape_error.iter().copied().fold(0.0, f64::max);
        format!(
            "invariants of the stored modes to {digits} digits or more ({name} worst); modes within {} of the exact modes",
            significant(shape, 2)
        )
    }
}

/// Returns a number of digits rounded down to one decimal, never more than is guaranteed.
pub(super) fn cut(digits: f64) -> String {
    significant((10.0 * digits).floor() / 10.0, 3)
}

/// Returns the smallest number of digits and its name.
fn least<T>(digits: impl Iterator<Item = (f64, T)>) -> (String, T) {
    let (digits, whose) = first_smallest(digits, |pair| pair.0).expect("bodies have modes and invariants");
    (cut(digits), whose)
}

// Groups of the kinetic energy in a body, with the reasons for keeping or dropping them.

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TermFacts {
    /// Name of the group: `W1`, `W2`, `W3`.
    pub group: &'static str,
    pub kept: bool,
    /// Decision about the group; `None` if no selection was made.
    pub decision: Option<DecisionFacts>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DecisionFacts {
    pub tier: u8,
    /// Bound of the error without the group; infinite if unknown.
    pub bound: f64,
    /// Limit of the error; infinite without a limit.
    pub limit: f64,
    pub reason: String,
}

impl TermFacts {
    /// Collects the facts of every group.
    pub(crate) fn of(body: &FlexBody) -> Vec<Self> {
        let facts = |group: TermGroup| Self {
            group: group.name(),
            kept: body.groups().has(group),
            decision: body.terms().iter().find(|term| term.group == group).map(|term| DecisionFacts {
                tier: term.tier,
                bound: term.bound,
                limit: term.limit,
                reason: term.reason.clone(),
            }),
        };
        TermGroup::ALL.map(facts).to_vec()
    }

    /// Returns the group in words: `W1 dropped, error without it up to 0.0001 of 0.001 allowed: slow spin`.
    pub(crate) fn in_words(&self) -> String {
        let what = if self.kept { "kept" } else { "dropped" };
        let Some(decision) = &self.decision else { return format!("{} {what}", self.group) };
        let error = match (decision.bound.is_finite(), decision.limit.is_finite()) {
            (false, _) => String::new(),
            (true, false) => format!(", error without it up to {}", significant(decision.bound, 3)),
            (true, true) => format!(
                ", error without it up to {}, tolerance {}",
                significant(decision.bound, 3),
                significant(decision.limit, 3)
            ),
        };
        format!("{} {what}{error}: {}", self.group, decision.reason)
    }
}

/// Returns a note for every group that `body` dropped, since no check covers it.
pub fn dropped_text(body: &FlexBody) -> String {
    let note = |group: TermGroup| format!("note: {} was dropped and is not checked\n", group.name());
    body.groups().dropped().map(note).collect()
}
