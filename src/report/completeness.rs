//! Whether the modes are all there, in one sentence that claims no more than the certificate proves.

use super::numbers::{counted, plain, significant};
use crate::flex_body::FlexBody;

/// The certificate of a body, judged.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(super) struct Completeness {
    /// The certificate proves that no mode is missing among the first `n_modes`.
    pub proved: bool,
    pub sentence: String,
    /// Flexible modes below the shift, as counted.
    pub proved_modes: Option<usize>,
    pub rigid_modes: usize,
    pub negative_pivots: Option<usize>,
    /// sigma. Unit: 1/time^2.
    pub shift: f64,
    /// sqrt(sigma) / (2 pi) in hertz; `None` for a negative shift.
    pub shift_hz: Option<f64>,
    pub remark: String,
    pub rigid_noise: f64,
    pub rigid_residual: f64,
}

impl Completeness {
    pub fn of(body: &FlexBody) -> Self {
        let c = body.certificate();
        let hertz = body.units().hertz() / std::f64::consts::TAU;
        let shift_hz = (c.shift >= 0.0).then(|| c.shift.sqrt() * hertz);
        let (proved, sentence) = judge(body, shift_hz);
        Self {
            proved,
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

/// A certificate is proof only when its numbers agree with each other and with the modes of the body.
fn judge(body: &FlexBody, shift_hz: Option<f64>) -> (bool, String) {
    let (c, nf) = (body.certificate(), body.n_modes());
    let Some(flexible) = c.proved_modes else {
        let why = if c.remark.is_empty() { "no inertia count was made".to_owned() } else { plain(&c.remark) };
        return (false, format!("NOT PROVED: {why}"));
    };
    let shift = significant(shift_hz.unwrap_or(f64::NAN), 5);
    let below = body.modes().eigenvalue.iter().filter(|&&l| l < c.shift).count();
    let count = c.negative_pivots.map_or("missing".to_owned(), |n| n.to_string());
    if c.negative_pivots != flexible.checked_add(c.rigid_modes) {
        let claim = format!("{flexible} flexible + {} rigid modes", c.rigid_modes);
        return (false, format!("NOT PROVED: {claim} are claimed, but the inertia count is {count}"));
    }
    if below != flexible.min(nf) {
        let have = format!("the body has {below} of the {flexible} flexible modes below {shift} Hz");
        return (false, format!("NOT PROVED: {have} (inertia count {count})"));
    }
    let proof = format!(
        "{flexible} flexible + {} below {shift} Hz (inertia count {count})",
        counted(c.rigid_modes, "rigid mode")
    );
    match flexible.cmp(&nf) {
        std::cmp::Ordering::Less => {
            (false, format!("PROVED IN PART: {proof}; {} above are not", counted(nf - flexible, "mode")))
        }
        std::cmp::Ordering::Equal => (true, format!("proved: {proof}")),
        std::cmp::Ordering::Greater => (true, format!("proved: {proof}, the lowest {nf} of them kept")),
    }
}
