//! Notes and warnings about a finished body.

use crate::flex_body::{FlexBody, Interface};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_model::Coupling;

/// Relative error of a frequency above which a note reports it.
const REPORTED_FREQUENCY_ERROR: f64 = 0.01;

/// Returns a note about the frequencies of the free body that a Craig-Bampton body does not reproduce.
pub(super) fn free_frequencies(body: &FlexBody) -> Option<Diagnostic> {
    let fixed = body.certificate().fixed_interface.as_ref()?;
    let (theta, hertz) = (&body.modes().eigenvalue, body.frequencies_hz());
    let holding = fixed.holding(theta, REPORTED_FREQUENCY_ERROR);
    let first = *theta.get(holding)?;
    let kept = if body.has_rigid_interfaces() { " with the same rigid interfaces" } else { "" };
    let holds = match holding {
        0 => format!("none is within 1 % of that of the free body{kept}"),
        count => format!(
            "the lowest {count} (up to {:.6} Hz) are within 1 % of those of the free body{kept}",
            hertz[count - 1]
        ),
    };
    let percent = |part: f64| format!("{:.2} %", 100.0 * part);
    let most = fixed.largest_excess(holding, first).map(|most| format!(", {} at most", percent(most)));
    let message = format!(
        "of the {} frequencies of the Craig-Bampton body {holds}; that of mode {}, {:.6} Hz, is too high by {}{}",
        theta.len(),
        holding + 1,
        hertz[holding],
        percent(fixed.excess(holding, first)),
        most.unwrap_or_default(),
    );
    Some(Diagnostic::new(Code::FreeFrequencies, message))
}

/// Part of the static compliance at an interface above which a note reports it.
const REPORTED_COMPLIANCE: f64 = 0.01;

/// Returns a note about the truncated part of the static compliance at each interface, if it is known and
/// above one percent. Compliance is f'K^+ f of a unit force or moment f, the square of the norm in
/// [`Truncation`].
///
/// [`Truncation`]: crate::flex_body::Truncation
pub fn interface_compliance(body: &FlexBody) -> Option<Diagnostic> {
    let worst = |interface: &Interface| {
        let of_interface = body.modes().truncation.iter().filter_map(|one| {
            let direction = one.load.strip_prefix(interface.name.as_str())?.strip_prefix(' ')?;
            Some((one.after.powi(2), direction))
        });
        let (missing, direction) = of_interface.reduce(|a, b| if b.0 > a.0 { b } else { a })?;
        let named = || format!("`{}` {:.0} % ({direction})", interface.name, 100.0 * missing);
        (missing > REPORTED_COMPLIANCE).then(named)
    };
    let found: Vec<String> = body.interfaces().iter().filter_map(worst).collect();
    (!found.is_empty()).then(|| {
        let message = format!(
            "the {} modes do not contain the whole static compliance at the interfaces: missing {}",
            body.n_modes(),
            found.join(", ")
        );
        Diagnostic::new(Code::InterfaceCompliance, message)
    })
}

/// Deformation of an interface, relative to its motion, that counts as rounding.
const ROUNDING_DEFORMATION: f64 = 1e-8;

/// Returns warnings about interfaces that are declared rigid but deform in the modes of the body.
pub fn poor_fits(body: &FlexBody) -> Vec<Diagnostic> {
    body.interfaces().iter().filter_map(|interface| poor_fit(interface, body)).collect()
}

fn poor_fit(interface: &Interface, body: &FlexBody) -> Option<Diagnostic> {
    if interface.coupling != Some(Coupling::Rigid) {
        return None;
    }
    let modes = body.modes();
    let rotations = modes.rotation.as_ref().map(Mat::as_ref);
    let rows = interface.rows(body.nodes(), modes.shape.as_ref(), rotations, body.dimension())?;
    let (mode, part) = rows.deformation();
    (part > ROUNDING_DEFORMATION + 4.0 * body.storage().rounding()).then(|| {
        let message = format!(
            "interface `{}` was declared rigid, but deforms by {:.2} % of its largest motion in mode {}: its mean rigid motion is used",
            interface.name,
            100.0 * part,
            mode + 1
        );
        Diagnostic::new(Code::InterfaceFit, message)
    })
}
