//! Sentences about properties that formats cannot hold, shared by several formats, with the size of the loss.

use crate::export::ExportOptions;
use crate::export::Holding::{self, Held, Lost, NotApplicable, Slight};
use faer::Mat;
use flexbody_base::numbers::significant;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{CauchySchwarz, InertiaShares, relative_norm};
use flexbody_linalg::ties::first_largest;
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};
use flexbody_motion::scene::{FrameMotion, Omission};

/// Largest difference, relative to a Cauchy-Schwarz bound, that counts as rounding and not as a loss. A
/// larger value hides small losses; a smaller one reports rounding.
pub(crate) const ROUNDING: f64 = 1e-12;

/// Part of a stiffness for which the motion is stated that reaches it.
const REPORTED_STIFFNESS: f64 = 0.01;

/// Largest part of a stiffness in a scene that may be lost without permission. A larger value lets files with
/// larger errors pass with a warning.
const MAX_SLIGHT_STIFFNESS: f64 = 0.05;

/// Largest change of the attitude in a scene, in radians, that a loss without permission may cause.
const MAX_SLIGHT_ATTITUDE: f64 = 0.05;

/// Returns the holding of the restriction to a plane, for a format in space.
pub(crate) fn plane(body: &FlexBody) -> Holding {
    if body.dimension() != 2 {
        return NotApplicable;
    }
    Lost("the restriction to the plane z = 0: inertia and stiffness out of the plane are missing, so hold the body in its plane with a joint".to_owned())
}

/// Returns the holding of W0 of a mass that does not commute with rotations, for a format whose first moment
/// is c + C1 q.
pub(crate) fn general_w0(body: &FlexBody) -> Holding {
    let invariants = body.invariants();
    let bound = CauchySchwarz::of(invariants);
    let nf = body.n_modes();
    // Without the information in M, W0 follows from C1.
    let (stated, implied) = (invariants.w0(), invariants.as_solid().w0());
    let lost = largest(&stated, &implied, |_, column| bound.c1(column % nf));
    lost_beyond_rounding(lost, "W0 other than -C1~ (how modes move the coupling of translation and rotation)")
}

/// Returns the holding of the symmetric part of the blocks of W3, for a format that takes them as skew.
///
/// The force on the modes of a symmetric block S_a is d/dt(w_a S_a q) - w_a S_a q' = w_a' S_a q: a stiffness of the
/// angular acceleration.
pub(crate) fn general_w3(body: &FlexBody, options: &ExportOptions) -> Holding {
    let bound = CauchySchwarz::of(body.invariants());
    let nf = body.n_modes();
    let Some(w3) = body.invariants().w3() else { return NotApplicable };
    let mirrored = Mat::from_fn(3 * nf, nf, |row, j| -w3[(row / nf * nf + j, row % nf)]);
    let lost = 0.5 * largest(&w3, &mirrored, |row, j| bound.s(row % nf, j));
    if lost <= ROUNDING {
        return Held;
    }
    let symmetric = |body: &FlexBody| {
        let w3 = body.invariants().w3()?;
        let block = |component: usize| {
            let entry = |i: usize, j: usize| w3[(component * nf + i, j)];
            let matrix = Mat::from_fn(nf, nf, |i, j| 0.5 * (entry(i, j) + entry(j, i)));
            GeometricStiffness { load: UnitLoad { kind: LoadKind::AngularAcceleration, component }, matrix }
        };
        Some((0..3).map(block).collect())
    };
    in_motion(body, options, "the symmetric part of W3", symmetric)
}

fn largest(a: &Mat<f64>, b: &Mat<f64>, bound: impl Fn(usize, usize) -> f64) -> f64 {
    let places = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j)));
    places
        .filter(|&(i, j)| a[(i, j)] != b[(i, j)])
        .map(|(i, j)| (a[(i, j)] - b[(i, j)]).abs() / bound(i, j))
        .fold(0.0, f64::max)
}

/// Returns the loss of a difference that exceeds rounding; for a smaller difference the property is held.
pub(crate) fn lost_beyond_rounding(lost: f64, what: &str) -> Holding {
    Holding::held_but_for((lost > ROUNDING).then(|| {
        format!(
            "{what}: up to {lost:.1e} of its Cauchy-Schwarz bound, from nodes with rotations or constraints"
        )
    }))
}

/// Returns true if the body has damping: a matrix, or ratios.
pub(crate) fn is_damped(body: &FlexBody) -> bool {
    body.modes().modal_damping.is_some() || body.modes().damping_ratio.iter().any(|ratio| *ratio != 0.0)
}

/// Returns the holding of damping, for a format without that of the body; `what` names the lost damping.
pub(crate) fn damping(body: &FlexBody, options: &ExportOptions, what: &str) -> Holding {
    if !is_damped(body) {
        return NotApplicable;
    }
    if let Some(measured) = in_scene(options, &Omission::Damping, what) {
        return measured;
    }
    // An oscillating load at the part r of the frequency of a mode deflects it by 1 / (1 - r^2) without, and by
    // 1 / sqrt((1 - r^2)^2 + (2 zeta r)^2) with the damping ratio zeta.
    let apart = ((1.0 + REPORTED_STIFFNESS).powi(2) - 1.0).sqrt();
    let from = |(lambda, ratio): (&f64, &f64)| {
        let relative = ratio / apart;
        lambda.sqrt() * ((relative.powi(2) + 1.0).sqrt() - relative)
    };
    let modes = body.modes();
    let damped = modes.eigenvalue.iter().zip(&modes.damping_ratio).filter(|(_, ratio)| **ratio > 0.0);
    let rate = damped.map(from).fold(f64::INFINITY, f64::min);
    let hertz = significant(body.units().frequency_of(rate * rate), 3);
    Slight(format!(
        "{what}, which changes deflections under an oscillating load by 1 % from {hertz} Hz on, and without which vibrations do not decay"
    ))
}

/// Returns the holding of geometric stiffness, for a format that takes the loads for which `holds` returns
/// true.
pub(crate) fn geometric_stiffness(
    body: &FlexBody,
    options: &ExportOptions,
    holds: impl Fn(&UnitLoad) -> bool,
) -> Holding {
    let lost: Vec<GeometricStiffness<Mat<f64>>> =
        body.geometric_stiffness().iter().filter(|stiffness| !holds(&stiffness.load)).cloned().collect();
    if lost.is_empty() {
        return Held;
    }
    let loads: Vec<UnitLoad> = lost.iter().map(|one| one.load.clone()).collect();
    let names: Vec<String> = loads.iter().map(UnitLoad::to_string).collect();
    let what = format!("the geometric stiffness for {}", names.join(", "));
    if let Some(measured) = in_scene(options, &Omission::GeometricStiffness(loads), &what) {
        return measured;
    }
    from_one_percent(body, &what, &lost)
}

/// Returns the loss of stiffnesses of unit loads, with the sizes of motions and loads at which it reaches 1 % of the stiffness
/// of the body.
fn from_one_percent(body: &FlexBody, what: &str, lost: &[GeometricStiffness<Mat<f64>>]) -> Holding {
    let own = body.invariants().modal_stiffness();
    let Some(shares) = InertiaShares::of(lost, own.as_ref()) else {
        return Lost(format!("{what}, whose effect is not known"));
    };
    let rates = body.rates_of(&shares, REPORTED_STIFFNESS).in_words(body.units(), |_| true);
    // Loads at interfaces and named loads, each by its size.
    let at_place = lost.iter().filter_map(|stiffness| {
        let share = relative_norm(stiffness.matrix.as_ref(), own.as_ref()).filter(|share| *share > 0.0)?;
        let size = significant(REPORTED_STIFFNESS / share, 3);
        let units = body.units();
        let (mass, length, time) = (units.mass.name(), units.length.name(), units.time.name());
        match stiffness.load.kind {
            LoadKind::Force(_) => Some(format!("{} of {size} {mass} {length}/{time}^2", stiffness.load)),
            LoadKind::Moment(_) => Some(format!("{} of {size} {mass} {length}^2/{time}^2", stiffness.load)),
            LoadKind::Named(_) => Some(format!("{size} times {}", stiffness.load)),
            _ => None,
        }
    });
    let all: Vec<String> =
        Some(rates).filter(|rates| !rates.is_empty()).into_iter().chain(at_place).collect();
    Slight(format!("{what}, which changes deflections by 1 % and frequencies by 0.5 % at {}", all.join(", ")))
}

/// Returns the loss of a property by the largest change of the motion in the load cases without it; `None` without a
/// scene. It is slight up to a change of deflections by 5 %, and of the attitude by 0.05 radians.
fn in_scene(options: &ExportOptions, omission: &Omission, what: &str) -> Option<Holding> {
    let change = |case: &FrameMotion| {
        let errors = case.change_without(omission)?;
        Some((errors.deflection.unwrap_or(0.0), errors.attitude.unwrap_or(0.0), case.scene.clone()))
    };
    let all = options.in_scene.iter().map(change).collect::<Option<Vec<_>>>()?;
    let (deflection, attitude, scene) =
        first_largest(all, |(deflection, attitude, _)| deflection.max(*attitude))?;
    if !deflection.is_finite() || !attitude.is_finite() {
        return Some(Lost(format!("{what}: the scene `{scene}` cannot be simulated without it")));
    }
    let turned = if attitude > ROUNDING {
        format!(", the attitude by {} radians", significant(attitude, 2))
    } else {
        String::new()
    };
    let deflections = significant(100.0 * deflection, 2);
    let text = format!("{what}: in the scene `{scene}` deflections change by {deflections} %{turned}");
    let is_slight = deflection <= MAX_SLIGHT_STIFFNESS && attitude <= MAX_SLIGHT_ATTITUDE;
    Some(if is_slight { Slight(text) } else { Lost(text) })
}

/// Returns the holding of the stiffness of inertia, for a format that takes the loads for which `holds`
/// returns true. The loss states its size in a scene, or otherwise the motion from which it matters.
pub(crate) fn inertia_stiffness(
    body: &FlexBody,
    options: &ExportOptions,
    holds: impl Fn(&UnitLoad) -> bool,
) -> Holding {
    let lost = |body: &FlexBody| {
        let all =
            body.inertia_stiffness()?.stiffness.iter().filter(|stiffness| stiffness.matrix.norm_max() > 0.0);
        Some(all.filter(|one| !holds(&one.load)).cloned().collect::<Vec<_>>())
    };
    match lost(body) {
        None => NotApplicable,
        Some(none) if none.is_empty() => Held,
        Some(_) => in_motion(body, options, "the stiffness of inertia of turning nodes", lost),
    }
}

/// Returns the loss of a stiffness that the motion of the frame causes. The text states the largest errors in the
/// scene, or otherwise the motion at which they reach 1 %. If a part s of the stiffness is lost, every deflection under a
/// given load changes by at most s / (1 - s), and every frequency by at most half of that.
///
/// * `lost`: returns the stiffnesses of unit motions that the file does not hold, in the frame of the body that it is
///   given; `None` if that body does not have the property.
pub(crate) fn in_motion(
    body: &FlexBody,
    options: &ExportOptions,
    what: &str,
    lost: impl Fn(&FlexBody) -> Option<Vec<GeometricStiffness<Mat<f64>>>>,
) -> Holding {
    let shares = options.in_scene.iter().map(|case| {
        let share = lost(&case.body).map_or(Some(0.0), |lost| case.largest_share(&lost));
        (share.unwrap_or(f64::INFINITY), &case.scene)
    });
    if let Some((share, scene)) = first_largest(shares, |pair| pair.0) {
        let error = if share < 1.0 { share / (1.0 - share) } else { f64::INFINITY };
        let percent = |error: f64| format!("{} %", significant(100.0 * error, 2));
        let size = if error.is_finite() {
            format!(
                "in the scene `{scene}` deflections change by at most {}, frequencies by at most {}",
                percent(error),
                percent(0.5 * error)
            )
        } else {
            format!("in the scene `{scene}` it exceeds the stiffness of the body")
        };
        let text = format!("{what}: {size}");
        return if error <= MAX_SLIGHT_STIFFNESS { Slight(text) } else { Lost(text) };
    }
    match lost(body) {
        Some(lost) => from_one_percent(body, what, &lost),
        None => Lost(format!("{what}, whose effect is not known")),
    }
}

/// Returns the holding of rows of the modes that belong to no node.
pub(crate) fn internal_rows(body: &FlexBody) -> Holding {
    let Some(internal) = &body.modes().internal else { return NotApplicable };
    Lost(format!("{} rows of the modes that belong to no node", internal.shape.nrows()))
}

/// Returns the holding of the groups of the kinetic energy, for a format with the inertia of the undeformed
/// body; `w1` names the lost part of W1.
pub(crate) fn changing_inertia(body: &FlexBody, options: &ExportOptions, w1: &str, why: &str) -> Holding {
    let groups = body.groups();
    let held = [(groups.w1, w1), (groups.w2, "W2"), (groups.w3, "W3")];
    let lost: Vec<&str> = held.into_iter().filter(|(held, _)| *held).map(|(_, name)| name).collect();
    if lost.is_empty() {
        return NotApplicable;
    }
    let what = format!("the change of the inertia with the deformation ({}; {why})", lost.join(", "));
    in_scene(options, &Omission::DeformedInertia, &what).unwrap_or(Lost(what))
}
