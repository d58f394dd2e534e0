//! A scene and its body in one frame: axes of the model, origin at the centre of mass or at the carrier.
//!
//! The conversion chooses the frame of a flex-body file, along the axes of the model or others. The meaning
//! of a scene does not depend on this choice: everything is computed in the frame defined here, and vectors
//! of the results are along its axes, which are those of the model.

use super::carrier_motion::carrier_accelerations;
use super::{Axes, Carried, History, Load, Point, Range, Scene, VectorHistory};
use crate::dynamics::{Orientation, RotationVector};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::numbers::significant;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{Carrier, FlexBody};
use nalgebra::{Matrix3, Vector3};
use std::borrow::Cow;

/// Distance of the centre of mass from the origin, relative to the extent of the body, below which both
/// coincide.
const ORIGIN_TOLERANCE: f64 = 1e-10;

/// Relative excess of a prescribed rotation over the limits of the scene that counts as rounding.
const ROUNDING: f64 = 1e-6;

/// Coupling of acceleration and modes, relative to its bound, that counts as rounding.
pub(super) const UNCOUPLED: f64 = 1e-8;

/// Body in the frame of a scene, the scene, and diagnostics about both.
#[derive(Debug, Clone)]
pub struct FramedScene<'a> {
    /// Body in the frame of the scene.
    pub body: Cow<'a, FlexBody>,
    /// Scene with all vectors along the axes of this frame or of the world.
    pub scene: Cow<'a, Scene>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

impl<'a> FramedScene<'a> {
    /// Transforms `body` and `scene` to one frame. A scene that is resolved already, and the body that it
    /// was resolved for, do not change.
    ///
    /// # Errors
    /// FB212 and FB214 if the body does not have the carrier of the scene; FB213 for a prescribed motion beyond the
    /// limits of the scene.
    pub fn new(body: &'a FlexBody, scene: &'a Scene) -> Result<Self> {
        if scene.resolved {
            return Ok(Self {
                body: Cow::Borrowed(body),
                scene: Cow::Borrowed(scene),
                diagnostics: Vec::new(),
            });
        }
        refuse_beyond_range(scene, &body.frame().axes)?;
        refuse_loaded_preloads(body, scene)?;
        let (framed_body, mut diagnostics) = match &scene.carried {
            Some(carried) => {
                let carrier = carried.carrier();
                let carried_body = body.carried(&carrier)?;
                let mut diagnostics = Vec::from_iter(carried_body.unresolved(&carrier, body));
                diagnostics.extend(body.softened(&carrier));
                let is_stiff = |body: &FlexBody| !body.geometric_stiffness().is_empty();
                if is_stiff(body) && !is_stiff(&carried_body) {
                    let message = format!(
                        "the geometric stiffness of the body is not used while {carrier} carries it: {carrier} moves in the modes of the body, and the file does not have the geometric stiffness of that motion"
                    );
                    diagnostics.push(Diagnostic::new(Code::CarriedGeometricStiffness, message));
                }
                (Cow::Owned(carried_body), diagnostics)
            }
            None => {
                refuse_numbered_modes(body, scene)?;
                (centred(body)?, Vec::new())
            }
        };
        let mut resolved = resolved(scene, &body.frame().axes, &framed_body.frame().origin);
        diagnostics.extend(idle(&framed_body, &resolved));
        if let Some(carrier) = scene.carried.as_ref().map(Carried::carrier) {
            let motion = carrier_accelerations(framed_body.frame(), &resolved);
            diagnostics.extend(framed_body.lacks_response(&carrier, body, motion));
        }
        diagnostics.extend(gravity_in_other_units(body.units(), scene));
        diagnostics.extend(released_preloads(body, scene));
        let preloads = body.named_loads().iter().filter(|load| load.preload);
        let acting = preloads.map(|load| Load::named(&load.name, History::Constant(1.0)));
        resolved.loads.extend(acting);
        Ok(Self { body: framed_body, scene: Cow::Owned(resolved), diagnostics })
    }
}

/// Standard acceleration of gravity in m/s^2.
const STANDARD_GRAVITY: f64 = 9.80665;

/// Returns a warning if the size of gravity is the number of the standard gravity in another unit of length.
fn gravity_in_other_units(units: &UnitSystem, scene: &Scene) -> Option<Diagnostic> {
    /// Largest relative difference from the standard gravity: 10 m/s^2 counts as it.
    const TOLERANCE: f64 = 0.03;
    /// Units of acceleration, with their sizes in m/s^2.
    const UNITS: [(&str, f64); 5] =
        [("m/s^2", 1.0), ("mm/s^2", 1e-3), ("cm/s^2", 1e-2), ("in/s^2", 0.0254), ("ft/s^2", 0.3048)];
    let is_standard = |si: f64| (si / STANDARD_GRAVITY - 1.0).abs() <= TOLERANCE;
    let size = scene.gravity?.norm();
    let unit = units.length.to_si() / units.time.to_si().powi(2);
    let (meant, _) =
        UNITS.iter().find(|(_, si)| is_standard(size * si)).filter(|_| !is_standard(size * unit))?;
    let named = format!("{}/{}^2", units.length_name(), units.time_name());
    let message = format!(
        "`gravity` of {} {named} is {} m/s^2: the number is that of gravity in {meant}, and the body has lengths in {} and times in {}",
        significant(size, 6),
        significant(size * unit, 4),
        units.length_name(),
        units.time_name()
    );
    let help = format!(
        "write gravity in the units of the body: {} {named}; nothing to do if another gravity is meant",
        significant(STANDARD_GRAVITY / unit, 6)
    );
    Some(Diagnostic::new(Code::GravityUnits, message).with_help(help))
}

/// Returns an error for a scene that gives a preload an amplitude.
fn refuse_loaded_preloads(body: &FlexBody, scene: &Scene) -> Result<()> {
    let is_preload = |point: &&Point| match point {
        Point::NamedLoad(name) => body.named_loads().iter().any(|load| load.preload && load.name == *name),
        _ => false,
    };
    let Some(point) = scene.loads.iter().map(|load| &load.at).find(is_preload) else { return Ok(()) };
    let message = format!("{point} is a preload, which acts always with amplitude 1");
    let help = "remove this [[load]], or convert the model with `preload = false` in its [[named_load]]";
    Err(Diagnostic::new(Code::SceneContradicts, message).with_help(help).into())
}

/// Returns a warning if the body starts undeformed although it has preloads.
fn released_preloads(body: &FlexBody, scene: &Scene) -> Option<Diagnostic> {
    let preloads = body.named_loads().iter().filter(|load| load.preload);
    let names: Vec<String> = preloads.map(|load| format!("`{}`", load.name)).collect();
    let starts = scene.run.duration.is_some() && !scene.initial.settled && scene.initial.modes.is_empty();
    (starts && !names.is_empty()).then(|| {
        let message = format!(
            "the body starts undeformed under the preload {}, which begins at time zero with a shock",
            names.join(", ")
        );
        Diagnostic::new(Code::PreloadReleased, message)
    })
}

/// Returns an error for initial values of modes by number if the body is simulated in mean axes, where it
/// has other modes.
fn refuse_numbered_modes(body: &FlexBody, scene: &Scene) -> Result<()> {
    if body.conditions().is_mean() || scene.initial.modes.is_empty() {
        return Ok(());
    }
    let message = format!(
        "{}: without a carrier the body is simulated in mean axes, in which the mode numbers of [initial] refer to other modes",
        body.conditions()
    );
    let help = "convert with --frame com, or start from the static equilibrium of a load";
    Err(Diagnostic::new(Code::SceneContradicts, message).with_help(help).into())
}

impl Carried {
    /// Returns the place that the frame of the body is fixed to.
    pub fn carrier(&self) -> Carrier {
        match &self.by {
            Point::Node(number) => Carrier::Node(*number),
            // The reader accepts nodes and interfaces; a body has no carrier of another name.
            Point::Interface(name) | Point::NamedLoad(name) => Carrier::Interface(name.clone()),
        }
    }
}

/// Returns the body in mean axes along the axes of the model, with its origin at the centre of mass.
fn centred(body: &FlexBody) -> Result<Cow<'_, FlexBody>> {
    let mean = body.in_mean_axes()?;
    let invariants = mean.invariants();
    let centre = invariants.first_moment() / invariants.mass();
    let shift = if centre.norm() <= ORIGIN_TOLERANCE * body.extent() { Vector3::zeros() } else { centre };
    if shift == Vector3::zeros() && mean.frame().axes == Matrix3::identity() {
        return Ok(mean);
    }
    Ok(Cow::Owned(mean.in_model_axes(shift)?))
}

/// Returns the scene with its vectors along the axes of the model; `axes` are those of the body in the
/// model, `origin` is that of its frame.
fn resolved(scene: &Scene, axes: &Matrix3<f64>, origin: &Vector3<f64>) -> Scene {
    let mut scene = scene.clone();
    start_with_the_motion(&mut scene, axes);
    let attitude = RotationVector(scene.initial.rotation).axes();
    let in_model = |vector: &mut Vector3<f64>, given: &mut Axes| {
        *vector = match given {
            Axes::Model => *vector,
            Axes::Body => axes * *vector,
            Axes::World => attitude.tr_mul(vector),
        };
        *given = Axes::Model;
    };
    let initial = &mut scene.initial;
    initial.origin += attitude * origin;
    in_model(&mut initial.angular_velocity, &mut initial.axes);
    let turn = |velocity: &mut VectorHistory, given: &mut Axes| match given {
        Axes::Model => (),
        // World axes of a history given in columns stay fixed in space.
        Axes::World if velocity.direction().is_none() => (),
        Axes::Body => (*velocity, *given) = (velocity.turned(axes), Axes::Model),
        Axes::World => (*velocity, *given) = (velocity.turned(&attitude.transpose()), Axes::Model),
    };
    if let Some(spin) = &mut scene.spin {
        turn(&mut spin.velocity, &mut spin.axes);
    }
    if let Some(spin) = scene.carried.as_mut().and_then(|carried| carried.spin.as_mut()) {
        turn(&mut spin.velocity, &mut spin.axes);
    }
    for Load { force, torque, axes: given, .. } in &mut scene.loads {
        if *given == Axes::Body {
            (*force, *torque, *given) = (force.turned(axes), torque.turned(axes), Axes::Model);
        }
    }
    let demands = &mut scene.requirements;
    if demands.motion.axes == Axes::Body {
        let ranges = [&mut demands.motion.angular_velocity, &mut demands.motion.angular_acceleration];
        for range in ranges.into_iter().flatten() {
            if let Range::Axes(components) = range {
                *components = axes * *components;
            }
        }
        demands.motion.axes = Axes::Model;
    }
    if demands.attachment.axes == Axes::Body {
        demands.attachment.inertia = axes * demands.attachment.inertia * axes.transpose();
        demands.attachment.axes = Axes::Model;
    }
    scene.resolved = true;
    scene
}

/// Sets the attitude at time zero to that of the prescribed motion, if it has one; `axes` are those of the
/// body in the model.
fn start_with_the_motion(scene: &mut Scene, axes: &Matrix3<f64>) {
    let carried = scene.carried.as_mut().and_then(|carried| carried.spin.as_mut());
    let spin = scene.spin.as_mut().map(|spin| (&mut spin.start, spin.axes));
    let Some((start, of)) = spin.or(carried.map(|spin| (&mut spin.start, spin.axes))) else { return };
    let Some(start) = start.take() else { return };
    scene.initial.rotation = match of {
        Axes::Body => RotationVector::of_axes(&(start.axes() * axes.transpose())).0,
        Axes::Model | Axes::World => start.0,
    };
}

/// Returns errors for an initial or prescribed rotation beyond the limits of [motion]; `axes` are those of
/// the body in the model.
fn refuse_beyond_range(scene: &Scene, axes: &Matrix3<f64>) -> Result<()> {
    let motion = &scene.requirements.motion;
    let mut diagnostics = Vec::new();
    let mut refuse =
        |what: &str, key: &str| {
            let message = format!("{what} is beyond `{key}` of [motion]");
            diagnostics.push(Diagnostic::new(Code::SceneContradicts, message).with_help(
                "raise the value in [motion]: it must cover the rotation that the scene prescribes",
            ));
        };
    let given = scene.spin.as_ref().map(|spin| (&spin.velocity, spin.axes, "[spin]"));
    let carried = scene.carried.as_ref().and_then(|carried| carried.spin.as_ref());
    let carried = carried.map(|spin| (&spin.velocity, spin.axes, "[carried.spin]"));
    match given.or(carried) {
        Some((history, kind, table)) => {
            let end = scene.run.duration.unwrap_or(f64::INFINITY);
            let (velocity, acceleration) = history.largest_until(end);
            let beyond =
                |range: &Option<Range>, length: f64, components: fn(&VectorHistory, f64) -> Vector3<f64>| {
                    let any_direction = matches!(range, Some(Range::Any(_)));
                    match (history.direction(), kind) {
                        // The components in body axes of a rotation about world axes are known only after
                        // the simulation: compare its length.
                        (None, Axes::World) => {
                            range.is_some_and(|range| length > range.length() * (1.0 + ROUNDING))
                        }
                        _ if any_direction => is_beyond(range, Vector3::x() * length),
                        (None, _) => {
                            is_beyond(range, components(&in_range_axes(scene, axes, history, kind), end))
                        }
                        (Some(direction), _) => {
                            let along = along_range(scene, axes, direction, kind).try_normalize(0.0);
                            is_beyond(range, along.unwrap_or_default() * length)
                        }
                    }
                };
            if beyond(&motion.angular_velocity, velocity, |history, end| history.components_until(end).0) {
                refuse(&format!("the rate {velocity} of {table}"), "angular_velocity");
            }
            if beyond(&motion.angular_acceleration, acceleration, |history, end| {
                history.components_until(end).1
            }) {
                refuse(&format!("the acceleration {acceleration} of {table}"), "angular_acceleration");
            }
        }
        None => {
            let initial = &scene.initial;
            let start = along_range(scene, axes, &initial.angular_velocity, initial.axes);
            if is_beyond(&motion.angular_velocity, start) {
                refuse("`angular_velocity` of [initial]", "angular_velocity");
            }
        }
    }
    if diagnostics.is_empty() { Ok(()) } else { Err(Error::new(diagnostics)) }
}

/// Transforms a history `given` along axes that turn with the body to the axes of the ranges in [motion].
fn in_range_axes(scene: &Scene, axes: &Matrix3<f64>, history: &VectorHistory, given: Axes) -> VectorHistory {
    match (given, scene.requirements.motion.axes) {
        (Axes::Body, Axes::Model | Axes::World) => history.turned(axes),
        (Axes::Model, Axes::Body) => history.turned(&axes.transpose()),
        _ => history.clone(),
    }
}

/// Transforms a vector `given` along some axes to the axes of the ranges in [motion].
fn along_range(scene: &Scene, axes: &Matrix3<f64>, vector: &Vector3<f64>, given: Axes) -> Vector3<f64> {
    let in_model = match given {
        Axes::Body => axes * vector,
        Axes::World => RotationVector(scene.initial.rotation).axes().tr_mul(vector),
        Axes::Model => *vector,
    };
    if scene.requirements.motion.axes == Axes::Body { axes.tr_mul(&in_model) } else { in_model }
}

/// Returns true if a vector exceeds a range by more than rounding.
fn is_beyond(range: &Option<Range>, vector: Vector3<f64>) -> bool {
    match range {
        None => false,
        Some(Range::Any(length)) => vector.norm() > length * (1.0 + ROUNDING),
        Some(Range::Axes(components)) => {
            let slack = ROUNDING * (vector.norm() + components.norm());
            (0..3).any(|k| vector[k].abs() > components[k] + slack)
        }
    }
}

/// Returns warnings about loads without effect.
fn idle(body: &FlexBody, scene: &Scene) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut tell = |message: String, help: Option<&str>| {
        let diagnostic = Diagnostic::new(Code::LoadIdle, message);
        diagnostics.push(match help {
            Some(help) => diagnostic.with_help(help),
            None => diagnostic,
        });
    };
    let leave = Some("remove it, or give it a value");
    let end = scene.run.duration.unwrap_or(f64::INFINITY);
    for load in &scene.loads {
        let place = &load.at;
        if load.force.is_zero_until(end) && load.torque.is_zero_until(end) {
            tell(format!("the load at {place} is zero during the whole run"), leave);
        } else if scene.carried.as_ref().is_some_and(|carried| carried.by == *place) {
            let message = format!(
                "the load at {place} deforms nothing: {place} is carried, and the reaction takes the load"
            );
            tell(message, Some("move the load to another place, or remove [carried]"));
        }
    }
    let Some(gravity) = &scene.gravity else { return diagnostics };
    if *gravity == Vector3::zeros() {
        tell("`gravity` is zero".to_owned(), leave);
    } else if scene.spin.as_ref().is_some_and(|spin| spin.hold) && is_uncoupled(body) {
        let message = "`gravity` deforms nothing: [spin] holds the body by its centre of mass and mean axes, so that all of its mass is supported";
        tell(message.to_owned(), None);
    }
    diagnostics
}

/// Returns true if accelerations of the frame excite no mode.
pub(super) fn is_uncoupled(body: &FlexBody) -> bool {
    let (invariants, modal) = (body.invariants(), body.invariants().modal_mass());
    (0..body.n_modes()).all(|j| {
        let bound = (invariants.mass() * modal[(j, j)]).sqrt();
        (0..3).all(|k| invariants.c1()[(k, j)].abs() <= UNCOUPLED * bound)
    })
}
