//! Random scenes: every feature of a scene is randomly present or absent.

use crate::bodies::{self, FREQUENT, KINDS, turns};
use crate::draws::{axis, between, direction, one_in, pick, stream};
use crate::subject::{Basis, Subject, frames};
use crate::{named_loads, recoveries};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_linalg::context::Context;
use flexbody_model::RawModel;
use flexbody_motion::dynamics::RotationVector;
use flexbody_motion::scene::{
    AttachmentKind, Axes, Carried, CarriedSpin, Drive, History, Initial, Interpolation, Load, PerQuantity,
    Point, Range, RecoveryLimit, RecoveryTolerance, Samples, Scene, Scheme, Spin, VectorHistory, trace,
};
use nalgebra::{Matrix3, Vector3};
use oracle::random::Random;
use oracle::scenes::nothing_happens;
use std::f64::consts::TAU;

/// Largest deflection under the loads, relative to the extent of the body.
const DEFLECTION: f64 = 2e-3;

/// Relative tolerance of the time integration.
const TOLERANCE: f64 = 1e-12;

/// Number of modes of a body.
const MODES: usize = 8;

/// Generator of a scene: a source of random numbers and the scales of the body.
struct Scales<'r> {
    random: &'r mut Random,
    /// Lowest natural circular frequency.
    rate: f64,
    /// Extent of the body.
    extent: f64,
    /// Mass of the body times the square of its extent.
    inertia: f64,
    /// Duration of the scene.
    duration: f64,
    /// Number of dimensions.
    dimension: usize,
}

/// Returns the subject of a seed.
///
/// # Errors
/// The errors of the conversion and of the motion that scales the loads.
pub fn subject(seed: u64) -> Result<Subject> {
    let random = &mut stream(seed, 1);
    let frequent = pick(random, FREQUENT);
    // Draws of their own, so that other features of a seed do not depend on the later kinds.
    let own = &mut stream(seed, 10);
    let kind = if one_in(own, 6) { FREQUENT + pick(own, KINDS.len() - FREQUENT) } else { frequent };
    let raw = bodies::body(kind, random);
    let scene = nothing_happens("crossing", 1.0, TOLERANCE);
    let frame = FrameChoice::Mean(BodyFrame::ALL[pick(random, BodyFrame::ALL.len())]);
    let frame = if one_in(&mut stream(seed, 9), 3) { frames(&raw).pop().unwrap_or(frame) } else { frame };
    let subject = Subject {
        kind: KINDS[kind],
        raw,
        basis: Basis::Lowest(MODES),
        frame,
        scene,
        cases: 1,
        second: None,
        stored: false,
        written: false,
        by_table: false,
    };
    let probe = subject.body()?;
    let rate = probe.modes().eigenvalue[0].sqrt();
    let duration = between(random, 0.5, 1.5) * TAU / rate;
    let scene_of = |purpose: u64, duration: f64| {
        let random = &mut stream(seed, purpose);
        let dimension = subject.dimension();
        let inertia = probe.invariants().mass() * probe.extent().powi(2);
        Scales { rate, extent: probe.extent(), inertia, duration, dimension, random }
            .scene(&subject.raw, &probe)
    };
    let scene = scene_of(2, duration)?;
    let second = if one_in(random, 5) {
        Some(Scene { name: "second".to_owned(), ..scene_of(4, 0.7 * duration)? })
    } else {
        None
    };
    Ok(Subject { scene, second, ..subject })
}

impl Scales<'_> {
    fn scene(&mut self, raw: &RawModel, probe: &FlexBody) -> Result<Scene> {
        let mut scene = nothing_happens("crossing", self.duration, TOLERANCE);
        scene.run.scheme = Scheme::Adaptive { tolerance: TOLERANCE };
        scene.run.outputs = 12;
        self.moving(&mut scene, raw);
        let loads = pick(self.random, 4);
        scene.loads = (0..loads).map(|_| self.load(raw)).collect();
        scale_loads(&mut scene, probe)?;
        if one_in(self.random, 3) {
            let size = 0.5 * DEFLECTION * self.extent * self.rate * self.rate;
            scene.gravity = Some(direction(self.random, self.dimension) * size);
        }
        scene.initial.settled = one_in(self.random, 3);
        self.demands(&mut scene);
        let node = raw.nodes.ids[pick(self.random, raw.nodes.len())];
        scene.watched = vec![Point::Node(node), Point::Interface("tip".to_owned())];
        Ok(scene)
    }

    /// Sets the initial state and the prescribed motion of the frame.
    fn moving(&mut self, scene: &mut Scene, raw: &RawModel) {
        let speed = between(self.random, 0.005, 0.05) * self.rate;
        if one_in(self.random, 2) {
            scene.initial.rotation = axis(self.random, self.dimension) * between(self.random, 0.1, 2.5);
            scene.initial.origin = direction(self.random, self.dimension) * self.extent;
        }
        let velocity = direction(self.random, self.dimension) * (speed * self.extent);
        match pick(self.random, 4) {
            0 => {
                scene.initial = Initial {
                    velocity,
                    angular_velocity: axis(self.random, self.dimension) * speed,
                    axes: if one_in(self.random, 2) { Axes::World } else { Axes::Model },
                    ..scene.initial.clone()
                }
            }
            1 => {
                let hold = one_in(self.random, 2);
                let (velocity_of_spin, axes) = self.turning(speed);
                let start = self.attitude(&velocity_of_spin, axes, scene);
                scene.spin = Some(Spin { velocity: velocity_of_spin, axes, start, hold });
                scene.initial.velocity = if hold { Vector3::zeros() } else { velocity };
            }
            _ => {
                let mut carried = self.carried(speed, raw);
                if let Some(spin) = &mut carried.spin {
                    spin.start = self.attitude(&spin.velocity, spin.axes, scene);
                }
                scene.carried = Some(carried);
            }
        }
    }

    /// Returns the initial attitude that `attitude_from` needs, for columns along axes of the model.
    fn attitude(
        &mut self,
        velocity: &VectorHistory,
        axes: Axes,
        scene: &mut Scene,
    ) -> Option<RotationVector> {
        if velocity.direction().is_some() || axes != Axes::Model {
            return None;
        }
        scene.initial.rotation = Vector3::zeros();
        Some(RotationVector(axis(self.random, self.dimension) * between(self.random, 0.1, 2.5)))
    }

    /// Returns an angular velocity of about this size over time, and its axes.
    fn turning(&mut self, speed: f64) -> (VectorHistory, Axes) {
        let world = one_in(self.random, 2);
        let axes = if world { Axes::World } else { Axes::Model };
        let turn = axis(self.random, self.dimension);
        let velocity = match pick(self.random, 4) {
            0 => VectorHistory::Along { direction: turn, factor: History::Constant(speed) },
            1 | 2 => {
                let start = if one_in(self.random, 2) { 0.0 } else { speed };
                let duration = self.duration * between(self.random, 0.5, 1.2);
                let factor = History::Ramp { from: start, to: 1.5 * speed, start: 0.0, duration };
                VectorHistory::Along { direction: turn, factor }
            }
            _ => self.columns(speed, true),
        };
        (velocity, axes)
    }

    /// Returns three columns of a smooth vector of about this size; a plane rotation is about z.
    fn columns(&mut self, size: f64, turns: bool) -> VectorHistory {
        const ROWS: usize = 9;
        let mut value = || match (self.dimension, turns) {
            (2, true) => Vector3::z() * self.random.signed(),
            (dimension, _) => direction(self.random, dimension),
        };
        let [a, b] = [value() * size, value() * size];
        let times: Vec<f64> = (0..ROWS).map(|i| self.duration * i as f64 / (ROWS - 1) as f64).collect();
        let rows: Vec<Vector3<f64>> = times.iter().map(|t| a + b * (1.5 * t * self.rate).sin()).collect();
        VectorHistory::Columns(Samples::new(times, &rows, Interpolation::Cubic, true))
    }

    fn carried(&mut self, speed: f64, raw: &RawModel) -> Carried {
        let turning: Vec<i64> = raw.nodes.ids.iter().copied().filter(|&id| turns(raw, id)).collect();
        let by = if turning.is_empty() || one_in(self.random, 2) {
            Point::Interface("root".to_owned())
        } else {
            Point::Node(turning[pick(self.random, turning.len())])
        };
        let spin = one_in(self.random, 2).then(|| {
            let (velocity, axes) = self.turning(speed);
            let place = Vector3::from(raw.nodes.positions[0]);
            let through = one_in(self.random, 2);
            let offset = direction(self.random, self.dimension) * self.extent;
            CarriedSpin { velocity, axes, start: None, through: through.then_some(place + offset) }
        });
        let translation = one_in(self.random, 2).then(|| self.drive());
        Carried { by, spin, translation }
    }

    /// Returns a motion of the carrier that deflects the body by about [`DEFLECTION`].
    fn drive(&mut self) -> Drive {
        let acceleration = DEFLECTION * self.extent * self.rate * self.rate;
        let frequency = between(self.random, 0.1, 1.5) * self.rate / TAU;
        let circular = TAU * frequency;
        let turn = direction(self.random, self.dimension);
        let sine = |amplitude: f64| VectorHistory::Along {
            direction: turn,
            factor: History::Sine { amplitude, frequency, phase: 0.0 },
        };
        match pick(self.random, 4) {
            0 => Drive::Displacement(sine(acceleration / (circular * circular))),
            1 => Drive::Velocity(sine(acceleration / circular)),
            2 => Drive::Acceleration(sine(acceleration)),
            _ => Drive::Acceleration(self.columns(acceleration, false)),
        }
    }

    /// Returns a load of about unit size.
    fn load(&mut self, raw: &RawModel) -> Load {
        if one_in(self.random, 6) {
            return Load::named(named_loads::WIND, self.history());
        }
        let node = raw.nodes.ids[pick(self.random, raw.nodes.len())];
        let at = if one_in(self.random, 3) { Point::Interface("tip".to_owned()) } else { Point::Node(node) };
        let takes_torque = at == Point::Interface("tip".to_owned()) || turns(raw, node);
        let factor = self.history();
        let force = if one_in(self.random, 4) {
            self.columns(1.0, false)
        } else {
            VectorHistory::Along { direction: direction(self.random, self.dimension), factor: factor.clone() }
        };
        let torque = if takes_torque && one_in(self.random, 2) {
            let turn = axis(self.random, self.dimension) * (0.3 * self.extent);
            VectorHistory::Along { direction: turn, factor }
        } else {
            VectorHistory::nothing()
        };
        Load { at, force, torque, axes: [Axes::World, Axes::Model][pick(self.random, 2)] }
    }

    /// Returns a history of about unit size.
    fn history(&mut self) -> History {
        let frequency = between(self.random, 0.1, 2.0) * self.rate / TAU;
        let part = between(self.random, 0.3, 1.0);
        match pick(self.random, 6) {
            0 => History::Constant(1.0),
            1 => History::Sine { amplitude: 1.0, frequency, phase: 0.0 },
            2 => History::Sine { amplitude: 1.0, frequency, phase: between(self.random, 0.5, 2.5) },
            3 => History::Ramp { from: 0.0, to: 1.0, start: 0.0, duration: part * self.duration },
            _ => {
                let times: Vec<f64> = [0.0, 0.3, 0.55, 1.0].map(|x| x * part * self.duration).to_vec();
                let values = vec![0.0, self.random.signed(), 1.0, self.random.signed()];
                if one_in(self.random, 2) {
                    History::Table { times, values }
                } else {
                    History::samples(times, &values, Interpolation::Cubic, true)
                }
            }
        }
    }

    /// Sets damping and tolerances of the scene.
    fn demands(&mut self, scene: &mut Scene) {
        scene.requirements.damping = one_in(self.random, 3).then_some(0.02.into());
        // The models may have damping of their own.
        scene.requirements.replaces_damping = true;
        if one_in(self.random, 4) {
            // The limit exceeds the rates of all scenes; far higher rates would leave a held body without
            // stiffness.
            let spin = scene.carried.as_ref().and_then(|carried| carried.spin.as_ref());
            let carried = spin.map(|spin| 1.3 * spin.velocity.largest_until(f64::INFINITY).0);
            let allowed = carried.unwrap_or(0.15 * self.rate);
            scene.requirements.motion.angular_velocity = Some(Range::Any(allowed));
        }
        if one_in(self.random, 4) {
            let attachment = &mut scene.requirements.attachment;
            attachment.kind =
                [AttachmentKind::Free, AttachmentKind::Soft, AttachmentKind::Stiff][pick(self.random, 3)];
            let moments = self.random.vector::<3>().map(|x| (1.0 + 0.5 * x) * 0.05 * self.inertia);
            attachment.inertia = Matrix3::from_diagonal(&Vector3::from(moments));
            attachment.first_frequency = one_in(self.random, 2).then_some(0.8 * self.rate / TAU);
        }
        let tolerance = 10f64.powf(between(self.random, -2.3, -0.8));
        scene.requirements.tolerance.errors =
            PerQuantity { recovery: f64::INFINITY, ..PerQuantity::all(tolerance) };
        if one_in(self.random, 4) {
            scene.requirements.tolerance.errors.recovery = 1.0;
            scene.requirements.recoveries = vec![RecoveryTolerance {
                recovery: recoveries::GAUGES.to_owned(),
                limit: RecoveryLimit::Relative(10f64.powf(between(self.random, -2.3, -0.8))),
                static_columns: one_in(self.random, 2),
            }];
        }
    }
}

/// Scales the loads so that they deflect the free body by [`DEFLECTION`].
fn scale_loads(scene: &mut Scene, probe: &FlexBody) -> Result<()> {
    if scene.loads.is_empty() {
        return Ok(());
    }
    let mut alone = scene.clone();
    (alone.spin, alone.carried, alone.initial) = (None, None, Initial::default());
    alone.run.scheme = Scheme::Adaptive { tolerance: 1e-6 };
    let small = 1e-9 * probe.modes().eigenvalue[0] * probe.invariants().mass() * probe.extent();
    alone.loads.iter_mut().for_each(|load| *load = scaled(load, small));
    let (motion, _) = trace(probe, &alone, &Context::QUIET)?;
    let factor = small * DEFLECTION / motion.extremes.deflection.value.max(f64::MIN_POSITIVE);
    scene.loads.iter_mut().for_each(|load| *load = scaled(load, factor));
    Ok(())
}

/// Returns a load times a factor.
pub fn scaled(load: &Load, factor: f64) -> Load {
    Load { force: load.force.scaled(factor), torque: load.torque.scaled(factor), ..load.clone() }
}
