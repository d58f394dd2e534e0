//! Facts of a Craig-Bampton body: its coordinates, their proof of completeness, and the frequency up to which
//! it represents the free body.

use crate::notation::numbers::{counted, frequency, percent};
use flexbody_body::flex_body::{FixedInterface, FlexBody, FreeEstimate, ReferenceConditions};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// Largest relative error of a frequency that counts as accurate.
const ACCURATE_FREQUENCY_ERROR: f64 = 0.01;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CraigBamptonFacts {
    pub fixed_interface_modes: usize,
    /// Requested number of fixed-interface modes; `None` if unknown, or if all below a frequency were
    /// requested.
    pub fixed_interface_asked: Option<usize>,
    /// Frequency below which all fixed-interface modes were requested. Unit: Hz.
    pub fixed_interface_asked_below_hz: Option<f64>,
    /// Frequencies of the fixed-interface modes; `None` if the body keeps only some of its modes, or comes
    /// from an older file. Unit: Hz.
    pub fixed_interface_hz: Option<Vec<f64>>,
    pub interface_motions: usize,
    pub rigid_modes: usize,
    /// Number of fixed-interface modes below `shift_hz` by the inertia count; `None` if not counted.
    pub counted: Option<usize>,
    /// Shift of the count; `None` for a negative shift. Unit: Hz.
    pub shift_hz: Option<f64>,
    /// Frequency of the first fixed-interface mode that was left out; `None` if not computed. Unit: Hz.
    pub next_hz: Option<f64>,
    /// Worst residual of the fixed-interface modes.
    pub worst_residual: f64,
    /// Frequencies beside those of the free body; `None` if the modes are held at an interface.
    #[serde(flatten, serialize_with = "or_nulls")]
    pub free: Option<FreeBodyFacts>,
    /// True if the free body of the comparison keeps some interfaces rigid, like the basis.
    pub rigid_interfaces: bool,
}

/// Frequencies of a Craig-Bampton body beside those of the free body.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FreeBodyFacts {
    /// Estimated frequencies of the free body (nf); upper bounds. Unit: Hz.
    pub free_hz: Vec<f64>,
    /// Lower bounds of the frequencies of the free body; `None` without a bound. Unit: Hz.
    pub free_lower_hz: Vec<Option<f64>>,
    /// Estimated relative excess of the frequencies of the reduced body.
    pub too_high: Vec<f64>,
    /// Upper bounds of the relative excess; `None` without a bound.
    pub too_high_at_most: Vec<Option<f64>>,
    /// Number of lowest frequencies that are at most 1 % too high.
    pub within_one_percent: usize,
}

/// Writes the facts with their names; absent facts are written as `null` under the same names.
fn or_nulls<S: Serializer>(free: &Option<FreeBodyFacts>, serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(None)?;
    map.serialize_entry("free_hz", &free.as_ref().map(|free| &free.free_hz))?;
    map.serialize_entry("free_lower_hz", &free.as_ref().map(|free| &free.free_lower_hz))?;
    map.serialize_entry("too_high", &free.as_ref().map(|free| &free.too_high))?;
    map.serialize_entry("too_high_at_most", &free.as_ref().map(|free| &free.too_high_at_most))?;
    map.serialize_entry("within_one_percent", &free.as_ref().map(|free| free.within_one_percent))?;
    map.end()
}

impl CraigBamptonFacts {
    pub(crate) fn of(body: &FlexBody) -> Option<Self> {
        let fixed = body.certificate().fixed_interface.as_ref()?;
        let hertz = |lambda: f64| body.units().frequency_of(lambda);
        let asked = &body.source().settings;
        Some(Self {
            fixed_interface_modes: fixed.modes,
            fixed_interface_asked: asked["modes"].as_u64().and_then(|count| usize::try_from(count).ok()),
            fixed_interface_asked_below_hz: asked["max_eigenvalue"].as_f64().map(hertz),
            fixed_interface_hz: body
                .fixed_interface_eigenvalues()
                .map(|all| all.into_iter().map(hertz).collect()),
            interface_motions: fixed.interface_motions,
            rigid_modes: body.certificate().rigid_modes,
            counted: fixed.counted,
            shift_hz: (fixed.shift >= 0.0).then(|| hertz(fixed.shift)),
            next_hz: fixed.next.map(hertz),
            worst_residual: fixed.residual,
            free: fixed.free.as_ref().map(|free| FreeBodyFacts::of(free, body)),
            rigid_interfaces: body.has_rigid_interfaces(),
        })
    }

    /// Returns the frequencies of the fixed-interface modes; `None` if there are none or they are unknown.
    pub(crate) fn held_hz(&self) -> Option<&[f64]> {
        self.fixed_interface_hz.as_deref().filter(|hz| !hz.is_empty())
    }

    /// Returns the composition of the basis: `10 fixed-interface modes (10 asked for) + 12 interface motions
    /// - 6 rigid-body motions`.
    pub(crate) fn made_of(&self) -> String {
        let asked = match (self.fixed_interface_asked, self.fixed_interface_asked_below_hz) {
            (Some(count), _) => format!(" ({count} requested)"),
            (None, Some(hertz)) => format!(" (all below {} requested)", frequency(hertz, 5)),
            (None, None) => String::new(),
        };
        format!(
            "{}{asked} + {} - {}",
            counted(self.fixed_interface_modes, "fixed-interface mode"),
            counted(self.interface_motions, "interface motion"),
            counted(self.rigid_modes, "rigid-body motion")
        )
    }

    /// Returns in words up to which frequency the reduced body represents the free body, and the error of the
    /// first frequency beyond. `hertz` are the frequencies of the reduced body. Returns `None` without estimates
    /// of the free body.
    pub(crate) fn holds(&self, hertz: &[f64]) -> Option<String> {
        let free = self.free.as_ref()?;
        let good = free.within_one_percent;
        let kept = if self.rigid_interfaces { " (with the same rigid interfaces)" } else { "" };
        let holds = match good {
            0 => format!("no frequency is within 1 % of that of the free body{kept}"),
            1 => format!("mode 1 ({}) is within 1 % of the free body{kept}", frequency(hertz[0], 5)),
            _ => format!(
                "modes 1 to {good} (up to {}) are within 1 % of the free body{kept}",
                frequency(hertz[good - 1], 5)
            ),
        };
        let Some(own) = hertz.get(good) else { return Some(holds) };
        let most = free.too_high_at_most[good]
            .map_or_else(String::new, |most| format!(", at most {}", percent(most)));
        Some(format!(
            "{holds}; mode {} ({}) is too high by about {}{most}",
            good + 1,
            frequency(*own, 5),
            percent(free.too_high[good])
        ))
    }
}

impl FreeBodyFacts {
    fn of(free: &FreeEstimate, body: &FlexBody) -> Self {
        let (theta, nf) = (&body.modes().eigenvalue, body.n_modes());
        let hertz = |lambda: f64| body.units().frequency_of(lambda);
        Self {
            free_hz: free.estimate.iter().copied().map(hertz).collect(),
            free_lower_hz: free.lower.iter().map(|l| (*l > 0.0).then(|| hertz(*l))).collect(),
            too_high: (0..nf).map(|j| free.excess(j, theta[j])).collect(),
            too_high_at_most: (0..nf).map(|j| free.largest_excess(j, theta[j])).collect(),
            within_one_percent: free.holding(theta, ACCURATE_FREQUENCY_ERROR),
        }
    }
}

/// Judges the proof of completeness of the fixed-interface modes of a body.
pub(super) fn judge(fixed: &FixedInterface, body: &FlexBody) -> (bool, String) {
    let hertz = |lambda: f64| frequency(body.units().frequency_of(lambda.max(0.0)), 5);
    let modes = counted(fixed.modes, "fixed-interface mode");
    let Some(count) = fixed.counted else {
        return (false, format!("NOT PROVED: no inertia count was made of the {modes}"));
    };
    let counted_below = format!("inertia count {count} below {}", hertz(fixed.shift));
    if !fixed.is_proved() {
        return (false, format!("NOT PROVED: the body has {modes}, but the {counted_below}"));
    }
    let proof = match (fixed.modes, fixed.next) {
        (0, Some(next)) => format!(
            "static condensation, without fixed-interface modes, of which the first is at {} ({counted_below})",
            hertz(next)
        ),
        (_, Some(next)) => format!("{modes}, of which the next is at {} ({counted_below})", hertz(next)),
        _ => format!("{modes} below {} (inertia count {count})", hertz(fixed.shift)),
    };
    let whole = (fixed.modes + fixed.interface_motions).saturating_sub(body.certificate().rigid_modes);
    let kept = if body.n_modes() < whole {
        format!("; {} of {whole} modes of the basis are kept", body.n_modes())
    } else {
        String::new()
    };
    // The count holds for the basis, whose span does not depend on the frame.
    let held = match body.conditions() {
        ReferenceConditions::Interface(name) => {
            format!("; the modes of the body held at `{name}` follow from them and the interface motions")
        }
        ReferenceConditions::MeanAxes | ReferenceConditions::Unstated => String::new(),
    };
    (true, format!("proved: {proof}{kept}{held}"))
}
