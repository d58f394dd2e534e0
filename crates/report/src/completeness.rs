//! Completeness of the modes in a sentence that claims no more than the certificate proves.

use super::craig_bampton;
use super::numbers::{counted, frequency, plain};
use flexbody_body::basis::BasisKind;
use flexbody_body::flex_body::{FlexBody, is_static};

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
    /// Counted number of flexible modes below the shift.
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
        let shift_hz = (c.shift >= 0.0).then(|| c.shift.sqrt() * hertz);
        let (proved, sentence) = judge(body, shift_hz);
        let (verdict, head) = head(body, proved);
        Self {
            proved,
            verdict,
            head,
            sentence,
            proved_modes: c.proved_modes,
            rigid_modes: c.rigid_modes,
            negative_pivots: c.negative_pivots,
            shift: c.shift,
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
