//! Geometric stiffness of a body, or the centrifugal softening without it.

use crate::notation::numbers::{frequencies, significant};
use flexbody_body::flex_body::{FlexBody, LoadKind};
use flexbody_body::invariants::relative_norm;
use nalgebra::Matrix3;
use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct GeometricStiffnessFacts {
    /// Unit load along body axes: `spin xx`.
    pub load: String,
    /// Largest relative change of the stiffness of any motion by one unit of the load.
    pub relative_norm: f64,
    /// True if the axes of the body are not those of the model.
    #[serde(skip)]
    is_turned: bool,
}

impl GeometricStiffnessFacts {
    pub(crate) fn of(body: &FlexBody) -> Vec<Self> {
        let stiffness = body.invariants().modal_stiffness().as_ref();
        let is_turned = body.frame().axes != Matrix3::identity();
        body.geometric_stiffness()
            .iter()
            .map(|one| Self {
                load: one.load.to_string(),
                relative_norm: relative_norm(one.matrix.as_ref(), stiffness).unwrap_or(f64::NAN),
                is_turned,
            })
            .collect()
    }

    /// Returns the effect of the load: `spin xx: up to 1.2e-3 of the stiffness of a motion per unit`; with `
    /// (body axes)` if the body axes differ from the model axes.
    pub(crate) fn in_words(&self) -> String {
        format!(
            "{}{}: up to {} of the stiffness of a motion per unit",
            self.load,
            if self.is_turned { " (body axes)" } else { "" },
            significant(self.relative_norm, 3)
        )
    }
}

/// Motions of the frame at which the stiffness of inertia matters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct InertiaStiffnessFacts {
    /// Spin in hertz, acceleration and angular acceleration of the frame at which the stiffness of inertia is
    /// 1 % of the stiffness of a motion, for any direction; null if it is zero.
    pub one_percent_spin_hz: Option<f64>,
    pub one_percent_acceleration: Option<f64>,
    pub one_percent_angular_acceleration: Option<f64>,
    #[serde(skip)]
    words: String,
}

impl InertiaStiffnessFacts {
    pub(crate) fn of(body: &FlexBody) -> Option<Self> {
        let rates = body.inertia_rates(0.01)?;
        Some(Self {
            one_percent_spin_hz: rates.spin_hz,
            one_percent_acceleration: rates.acceleration,
            one_percent_angular_acceleration: rates.angular_acceleration,
            words: rates.in_words(body.units(), |_| true),
        })
    }

    /// Returns the motions in words: `of turning nodes: 1 % of a stiffness at a spin of 12.3 Hz, ...`.
    pub(crate) fn in_words(&self) -> String {
        match self.words.as_str() {
            "" => "of turning nodes: none".to_owned(),
            words => format!("of turning nodes: 1 % of the stiffness of a motion at {words}"),
        }
    }
}

/// Returns the origin of stress stiffness that was computed from elements: `spin, interfaces, from 50 elements that K proves:
/// C3D20 (20 nodes, 3 x 3 x 3 points)`; `None` without any.
pub(super) fn stress_stiffness_in_words(body: &FlexBody) -> Option<String> {
    let settings = &body.source().settings;
    let loads: Vec<&str> =
        settings["stress_stiffness"].as_array()?.iter().filter_map(serde_json::Value::as_str).collect();
    let elements = settings["elements"].as_array()?;
    let count: u64 = elements.iter().filter_map(|element| element["count"].as_u64()).sum();
    let kind = |one: &serde_json::Value| {
        Some(format!("{} ({})", one["type"].as_str()?, one["formulation"].as_str()?))
    };
    let kinds: Vec<String> = elements.iter().filter_map(kind).collect();
    Some(format!("{}, from {count} elements that K proves: {}", loads.join(", "), kinds.join(", ")))
}

/// Returns the spin about each axis of the model at which the centrifugal term takes 1 % of the stiffness of
/// the motion that it softens most. Unit: Hz. Returns `None` for a body with geometric stiffness for spin or
/// without W2. An axis has no value if no mode moves perpendicular to it, or if a plane body does not spin
/// about it.
pub(super) fn softening_hz(body: &FlexBody) -> Option<[Option<f64>; 3]> {
    let given = body.geometric_stiffness().iter().any(|stiffness| stiffness.load.kind == LoadKind::Spin);
    (!given && body.groups().w2).then(|| {
        [0, 1, 2].map(|axis| {
            let spins = body.dimension() == 3 || axis == 2;
            let rate = spins.then(|| body.softening_rate(axis)).flatten();
            rate.map(|rate| body.units().frequency_of(rate * rate))
        })
    })
}

/// Returns the spin about each axis of the model at which the missing stress stiffness, by its estimate, changes 1 % of the
/// stiffness of some motion. Unit: Hz. Returns `None` for a body that lacks none.
pub(super) fn stress_hz(body: &FlexBody) -> Option<[Option<f64>; 3]> {
    (!body.missing_stiffness(true).is_empty()).then(|| {
        [0, 1, 2].map(|axis| {
            let spins = body.dimension() == 3 || axis == 2;
            let rate = spins.then(|| body.missing_rate(axis)).flatten();
            rate.map(|rate| body.units().frequency_of(rate * rate))
        })
    })
}

/// Returns what a body without geometric stiffness of spin leaves out, and the option that computes it where the elements of
/// the deck would give it; `None` for a body that lacks none.
///
/// * `offered`: loads of the option, empty where the elements are not known.
pub(super) fn missing_stiffness_in_words(
    softening: Option<&[Option<f64>; 3]>,
    stress: Option<&[Option<f64>; 3]>,
    is_partial: bool,
    offered: &[&str],
) -> Option<String> {
    let words = missing_in_words(softening, stress?, is_partial);
    let option = offered.join(",");
    Some(if offered.is_empty() {
        words
    } else {
        format!("{words}; --geometric-stiffness {option} computes it from the elements of the deck")
    })
}

/// Ratio of the rotation that takes all of a stiffness to the one that takes 1 % of it.
const CRITICAL_RATIO: f64 = 10.0;

/// Returns the rotations in words at which 1 % of a stiffness is missing, and the critical speeds below them, where the
/// centrifugal term takes all of a stiffness: `no geometric stiffness: about 1 % of a stiffness is missing at 12.5 Hz of
/// rotation about z of the model (estimate); critical speed about x from 115 Hz`.
fn missing_in_words(
    softening: Option<&[Option<f64>; 3]>,
    stress: &[Option<f64>; 3],
    is_partial: bool,
) -> String {
    let of_axes = |hertz: &dyn Fn(usize) -> Option<f64>| -> Vec<(&str, f64)> {
        ["x", "y", "z"].into_iter().enumerate().filter_map(|(at, axis)| Some((axis, hertz(at)?))).collect()
    };
    let told = |known: &[(&str, f64)]| {
        let (rates, unit) = frequencies(&known.iter().map(|(_, hz)| *hz).collect::<Vec<f64>>(), 3);
        let axes: Vec<&str> = known.iter().map(|(axis, _)| *axis).collect();
        (format!("{} {unit}", rates.join(", ")), axes.join(", "))
    };
    let critical = |at: usize| softening?[at].map(|hz| CRITICAL_RATIO * hz);
    let is_below = |at: usize, hz: f64| critical(at).is_some_and(|critical| critical < hz);
    let missing = of_axes(&|at| stress[at].filter(|hz| !is_below(at, *hz)));
    let critical = of_axes(&|at| critical(at).filter(|_| stress[at].is_none_or(|hz| is_below(at, hz))));
    let mut parts = Vec::new();
    if !missing.is_empty() {
        let (rates, axes) = told(&missing);
        let what =
            if is_partial { "geometric stiffness of some spins only" } else { "no geometric stiffness" };
        parts.push(format!(
            "{what}: about 1 % of a stiffness is missing at {rates} of rotation about {axes} of the model (estimate)"
        ));
    }
    if !critical.is_empty() {
        let (rates, axes) = told(&critical);
        parts.push(format!("critical speed about {axes} from {rates}"));
    }
    if parts.is_empty() {
        "no rotation changes the stiffness of a motion".to_owned()
    } else {
        parts.join("; ")
    }
}
