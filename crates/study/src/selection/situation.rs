//! Motion that a scene implies for a body: rotation rates, modal amplitudes, loads on the modes, and the source of each
//! number.

use super::bounds::{Driven, ModalLoad, Rotation, Start, TurnedTorques, Variation};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::Invariants;
use flexbody_motion::dynamics::{BodyPoint, EquationsOfMotion, Evaluation, Terms};
use flexbody_motion::scene::{AttachmentKind, Axes, Load, Range, Scene, VectorHistory};
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::f64::consts::TAU;

/// Deflection, relative to the largest extent of the body, at which linear elasticity is assumed to end. It bounds the
/// amplitudes if the scene states no limit.
const LINEAR_RANGE: f64 = 0.1;

/// Duration of a scene that states none, in periods of the first mode.
const PERIODS: f64 = 100.0;

/// Largest C1, C2 and c, relative to their bounds, that count as zero. Above it the modes are not free-surface modes
/// about the centre of mass.
const ROUNDING: f64 = 1e-8;

/// Number that decisions depend on.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name of the number.
    pub name: &'static str,
    /// Value, in the units of the body.
    pub value: f64,
    /// Source of the value: a key of the scene, or a default.
    pub source: String,
}

/// Sizes of the motion that a scene implies for a body: rates, amplitudes, duration.
#[derive(Debug, Clone)]
pub struct Situation {
    /// Largest angular velocity of the frame.
    pub spin: Input,
    /// Largest angular acceleration of the frame.
    pub acceleration: Input,
    /// Duration of the motion.
    pub duration: Input,
    /// Largest |q|.
    pub amplitude: Input,
    /// Largest amplitude of every mode.
    pub mode_amplitudes: Vec<f64>,
    /// Inertia tensor about the centre of mass, with the attached bodies.
    pub inertia: Matrix3<f64>,
    /// First circular frequency of the assembly.
    pub first_rate: Input,
    /// Quantities for guaranteed bounds, or the reason why there are no bounds.
    pub driven: Result<Driven, String>,
}

impl Situation {
    /// Evaluates `scene` for `body`, which must match. `points` are the points of the loads.
    pub fn new(body: &FlexBody, scene: &Scene, points: &[BodyPoint]) -> Self {
        let (demands, eigenvalues) = (&scene.requirements, &body.modes().eigenvalue);
        let inertia = body.invariants().inertia() + demands.attachment.inertia;
        let softest = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
        // Duration and first frequency: stated by the scene, else derived from the softest mode.
        let duration = match scene.run.duration {
            Some(value) => Input { name: "duration", value, source: "[run] duration".to_owned() },
            None => Input {
                name: "duration",
                value: PERIODS * TAU / softest,
                source: format!("default: {PERIODS} periods of the first mode"),
            },
        };
        let first_rate = match demands.attachment.first_frequency {
            Some(frequency) => (TAU * frequency, "[attachment] first_frequency"),
            None => (softest, "first mode of the free body"),
        };
        // Largest spin, angular acceleration and modal amplitudes.
        let (spin, acceleration) = turning(scene, &inertia, duration.value, points);
        let mode_amplitudes = amplitudes(body, scene);
        let limits = &demands.limits;
        let named = [
            (limits.deflection.is_some(), "deflection"),
            (limits.stress.is_some(), "stress"),
            (!limits.modes.is_empty(), "mode"),
        ];
        let named: Vec<&str> = named.into_iter().filter(|(given, _)| *given).map(|(_, name)| name).collect();
        let amplitude = Input {
            name: "modal amplitude",
            value: mode_amplitudes.iter().map(|q| q * q).sum::<f64>().sqrt(),
            source: if named.is_empty() {
                "default: deflections of 10 % of the extent of the body".to_owned()
            } else {
                format!("[limits] {}", named.join(", "))
            },
        };
        let driven = driven(body, scene, points, &spin, &acceleration, duration.value);
        Self {
            spin,
            acceleration,
            duration,
            amplitude,
            mode_amplitudes,
            inertia,
            first_rate: Input {
                name: "first circular frequency",
                value: first_rate.0,
                source: first_rate.1.to_owned(),
            },
            driven,
        }
    }

    /// Returns all inputs, in the order of a report.
    pub fn inputs(&self) -> [&Input; 5] {
        [&self.spin, &self.acceleration, &self.duration, &self.amplitude, &self.first_rate]
    }
}

/// Size of a motion, and its source.
type Sourced = (f64, String);

/// Returns the largest angular velocity and acceleration of the frame.
fn turning(scene: &Scene, inertia: &Matrix3<f64>, duration: f64, points: &[BodyPoint]) -> (Input, Input) {
    let motion = &scene.requirements.motion;
    let [spin, acceleration] = turning_of_run(scene, inertia, duration, points);
    // A range stated for a free body replaces the worst case of its loads; a prescribed spin is only increased by the
    // range.
    let larger = |range: &Option<Range>, (value, source): Sourced, key: &str| match range {
        Some(range) if !scene.prescribes() || range.length() > value => {
            (range.length(), format!("[motion] {key}"))
        }
        _ => (value, source),
    };
    let (spin, spin_source) = larger(&motion.angular_velocity, spin, "angular_velocity");
    // Free rotation has angular accelerations of the order of the squared angular velocity.
    let (acceleration, acceleration_source) = match (&motion.angular_acceleration, &motion.angular_velocity) {
        (None, Some(_)) if spin * spin > acceleration.0 => {
            (spin * spin, "default: square of the angular velocity".to_owned())
        }
        (range, _) => larger(range, acceleration, "angular_acceleration"),
    };
    (
        Input { name: "angular velocity", value: spin, source: spin_source },
        Input { name: "angular acceleration", value: acceleration, source: acceleration_source },
    )
}

/// Difference of principal moments of inertia, relative to the larger, up to which they are equal.
const EQUAL_MOMENTS: f64 = 1e-9;

/// Returns the largest angular velocity and acceleration in the run of the scene.
fn turning_of_run(
    scene: &Scene,
    inertia: &Matrix3<f64>,
    duration: f64,
    points: &[BodyPoint],
) -> [Sourced; 2] {
    match (scene.rotation(), &scene.carried) {
        (Some(velocity), carried) => {
            let rate = Variation::of_vector(velocity, duration);
            let source = if carried.is_some() { "[carried.spin] rate" } else { "[spin] rate" }.to_owned();
            [(rate.largest, source.clone()), (rate.rate, source)]
        }
        (None, Some(_)) => {
            let source = "[carried], which does not rotate".to_owned();
            [(0.0, source.clone()), (0.0, source)]
        }
        (None, None) => {
            // Angular momentum of a free body: the initial one plus the impulse of the torques.
            let start = inertia * scene.initial.angular_velocity;
            let torque = largest_torque(scene, duration, points);
            let principal = inertia.symmetric_eigenvalues();
            let (least, most) = (principal.min(), principal.max());
            let spin = (start.norm() + torque * duration) / least;
            let source = if scene.loads.is_empty() {
                "[initial] angular_velocity (estimate for a rigid body)"
            } else {
                "[initial] angular_velocity and [[load]] (estimate for a rigid body)"
            };
            // |omega x I omega| is at most (I_max - I_min) |omega|^2; equal moments differ by rounding.
            let spread = if most - least > EQUAL_MOMENTS * most { most - least } else { 0.0 };
            let acceleration = (spread * spin * spin + torque) / least;
            [(spin, source.to_owned()), (acceleration, source.to_owned())]
        }
    }
}

/// Returns the largest torque of the loads on the undeformed body.
fn largest_torque(scene: &Scene, duration: f64, points: &[BodyPoint]) -> f64 {
    let torque = |(load, point): (&Load, &BodyPoint)| {
        let largest = |history: &VectorHistory| Variation::of_vector(history, duration).largest;
        largest(&load.force) * point.lever() + largest(&load.torque)
    };
    scene.loads.iter().zip(points).map(torque).sum()
}

/// Returns the largest amplitude of every mode: the amplitude at which the mode alone reaches the strictest limit.
/// Higher modes are also limited to the amplitude under a load that brings the first mode to its limit, q_1 lambda_1 /
/// lambda_p (\[WP19\] 5.2).
fn amplitudes(body: &FlexBody, scene: &Scene) -> Vec<f64> {
    let limits = &scene.requirements.limits;
    let deflection = limits.deflection.unwrap_or(LINEAR_RANGE * body.extent());
    let alone = |j: usize| {
        let stress = limits.stress.as_ref().and_then(|(limit, modes)| Some(limit / modes.get(j)?));
        let own = limits.modes.iter().filter(|(mode, _)| *mode == j).map(|(_, amplitude)| *amplitude);
        own.chain(stress).fold(deflection / body.largest_displacement(j), f64::min)
    };
    let eigenvalues = &body.modes().eigenvalue;
    let first = alone(0) * eigenvalues[0];
    eigenvalues.iter().enumerate().map(|(j, lambda)| alone(j).min(first / lambda)).collect()
}

/// Returns the quantities for guaranteed bounds, or the reason why bounds do not hold for the body and the scene.
fn driven(
    body: &FlexBody,
    scene: &Scene,
    points: &[BodyPoint],
    spin: &Input,
    acceleration: &Input,
    duration: f64,
) -> Result<Driven, String> {
    let rotation = given_rotation(scene, spin, acceleration, duration)?;
    refuse_beyond_bounds(body, scene)?;
    let root: Vec<f64> = body.modes().eigenvalue.iter().map(|l| l.sqrt()).collect();
    let damping = damping_norm(body, &root);
    Ok(Driven {
        loads: modal_loads(body, scene, points, &rotation, &root),
        turned: turned_torques(body, scene, points, duration, &root),
        settled: scene.initial.settled,
        start: start_of_modes(scene, damping, &root),
        rotation,
        damping,
    })
}

/// Returns the rotation of the frame, if the scene prescribes it.
fn given_rotation(
    scene: &Scene,
    spin: &Input,
    acceleration: &Input,
    duration: f64,
) -> Result<Rotation, String> {
    let spin_of_run = scene.spin.as_ref().filter(|_| spin.source.starts_with("[spin]"));
    match (spin_of_run, scene.requirements.attachment.kind) {
        (Some(spin), _) => {
            let rate = Variation::of_vector(&spin.velocity, duration);
            // Seen from the body, the angular acceleration about world axes also changes because the axes turn with
            // omega.
            let turned = if spin.axes == Axes::World { rate.largest * rate.total } else { 0.0 };
            Ok(Rotation {
                axis: spin.velocity.direction().and_then(|direction| direction.try_normalize(0.0)),
                of_run: true,
                largest: rate.largest,
                start: rate.start,
                variation: rate.total,
                acceleration: rate.rate,
                jerk: rate.rate_total + turned,
                duration,
            })
        }
        (None, AttachmentKind::Stiff) if spin.value > 0.0 => Ok(Rotation {
            axis: None,
            of_run: false,
            largest: spin.value,
            start: spin.value,
            variation: acceleration.value * duration,
            acceleration: acceleration.value,
            jerk: f64::INFINITY,
            duration,
        }),
        _ => Err("its rotation is not given: the scene has neither [spin] nor a stiff attachment".to_owned()),
    }
}

/// Returns an error with the reason if bounds do not hold for the body and the scene.
fn refuse_beyond_bounds(body: &FlexBody, scene: &Scene) -> Result<(), String> {
    let reason = if scene.carried.is_some() {
        "the body is carried, so that the motion of its frame excites its modes"
    } else if body.invariants().general().is_some() {
        "the mass matrix does not commute with rotations"
    } else if body.inertia_stiffness().is_some() || !body.geometric_stiffness().is_empty() {
        "the body has stiffness of inertia or geometric stiffness"
    } else if !is_about_centre(body.invariants()) {
        "the frame is not that of free-surface modes about the centre of mass"
    } else {
        return Ok(());
    };
    Err(reason.to_owned())
}

/// Returns the loads of the scene on the modes. `root` is sqrt(Lambda).
fn modal_loads(
    body: &FlexBody,
    scene: &Scene,
    points: &[BodyPoint],
    rotation: &Rotation,
    root: &[f64],
) -> Vec<ModalLoad> {
    let rows = PointRows::new(body);
    let modal_load = |psi: DMatrix<f64>, axes: Axes, history: &VectorHistory| {
        let duration = rotation.duration;
        // A fixed direction needs one row of the modes. World axes turn relative to the body and vary the load.
        let (psi, factor) = match (axes, history) {
            (Axes::Model | Axes::Body, VectorHistory::Along { direction, factor }) => {
                let along = DMatrix::from_fn(1, root.len(), |_, j| psi.column(j).dot(direction));
                (along, Variation::of(factor, duration))
            }
            (Axes::Model | Axes::Body, history) => (psi, Variation::of_vector(history, duration)),
            (Axes::World, history) => {
                (psi, Variation::of_vector(history, duration).times(&Variation::direction(rotation)))
            }
        };
        ModalLoad { force: PointRows::norm(&psi), energy: energy_norm(&psi, root), factor }
    };
    let mut loads = Vec::new();
    for (load, point) in scene.loads.iter().zip(points) {
        if !load.force.is_nothing() {
            loads.push(modal_load(rows.of(point), load.axes, &load.force));
        }
        if !load.torque.is_nothing() {
            loads.push(modal_load(rows.of_rotation(point), load.axes, &load.torque));
        }
    }
    loads
}

/// Returns |Lambda^(-1/2) Psi'| of a few rows Psi. `root` is sqrt(Lambda).
fn energy_norm(rows: &DMatrix<f64>, root: &[f64]) -> f64 {
    PointRows::norm(&PointRows::weighted(rows, |j| 1.0 / root[j]))
}

/// Returns the change of the modal forces of torques with deformation. A torque t does work on the rotation vector
/// theta = Theta q of its point as G(theta) t, with G = integral_0^1 exp(-s theta~) ds. G changes by at most half the
/// change of theta.
fn turned_torques(
    body: &FlexBody,
    scene: &Scene,
    points: &[BodyPoint],
    duration: f64,
    root: &[f64],
) -> TurnedTorques {
    let rows = PointRows::new(body);
    let mut turned = TurnedTorques::default();
    for (load, point) in scene.loads.iter().zip(points).filter(|(load, _)| !load.torque.is_nothing()) {
        let theta = rows.of_rotation(point);
        let per_torque = 0.5 * PointRows::norm(&theta) * energy_norm(&theta, root);
        let torque = Variation::of_vector(&load.torque, duration);
        turned.force += per_torque * torque.largest;
        turned.rate += per_torque * torque.rate;
    }
    turned
}

/// Returns |D| or an upper bound of it.
fn damping_norm(body: &FlexBody, root: &[f64]) -> f64 {
    let nf = body.n_modes();
    match &body.modes().modal_damping {
        Some(damping) => {
            (0..nf).map(|j| (0..nf).map(|i| damping[(i, j)].powi(2)).sum::<f64>()).sum::<f64>().sqrt()
        }
        None => (0..nf).map(|j| 2.0 * body.modes().damping_ratio[j] * root[j]).fold(0.0, f64::max),
    }
}

/// Returns the summed energies of the modes that do not start at rest.
fn start_of_modes(scene: &Scene, damping: f64, root: &[f64]) -> Start {
    let starts = scene.initial.modes.iter().map(|start| {
        let omega = root[start.mode];
        let energy = start.rate.abs() + omega * start.amplitude.abs();
        let acceleration = omega * omega * start.amplitude.abs() + damping * start.rate.abs();
        Start { energy, rate_energy: acceleration + omega * start.rate.abs() }
    });
    starts.fold(Start::default(), |sum, one| Start {
        energy: sum.energy + one.energy,
        rate_energy: sum.rate_energy + one.rate_energy,
    })
}

/// Returns true if C1, C2 and c vanish and m_ff is the identity, up to rounding.
fn is_about_centre(invariants: &Invariants) -> bool {
    let (nf, c2, m) = (invariants.n_modes(), invariants.c2(), invariants.modal_mass());
    let inertia = invariants.inertia().trace();
    let size = (inertia / invariants.mass()).sqrt();
    let small = |value: f64, scale: f64| value.abs() <= ROUNDING * scale;
    (0..3).all(|k| {
        small(invariants.first_moment()[k], invariants.mass() * size)
            && (0..nf).all(|j| {
                small(invariants.c1()[(k, j)], invariants.mass().sqrt()) && small(c2[(k, j)], inertia.sqrt())
            })
    }) && (0..nf).all(|i| (0..nf).all(|j| small(m[(i, j)] - f64::from(i == j), 1.0)))
}

// Displacements and rotations of points by the modes.

/// Displacements of points of a body at rest by its modes.
pub(super) struct PointRows<'b> {
    body: &'b FlexBody,
    equations: EquationsOfMotion,
}

impl<'b> PointRows<'b> {
    pub(super) fn new(body: &'b FlexBody) -> Self {
        Self { body, equations: EquationsOfMotion::new(body, Terms::NONE) }
    }

    /// Returns Psi of a point (3 x nf), body axes.
    pub(super) fn of(&self, point: &BodyPoint) -> DMatrix<f64> {
        self.works(|rest, axis, forces| point.add_force(rest, axis, forces))
    }

    /// Returns the rows (3 x nf), body axes, whose product with a force is the torque that the force gains by deformation.
    pub(super) fn of_lever(point: &BodyPoint) -> DMatrix<f64> {
        let rows = point.lever_rows();
        DMatrix::from_fn(3, rows.ncols(), |k, j| rows[(k, j)])
    }

    /// Returns the rotations of a point by the modes (3 x nf), body axes. The point must have an orientation.
    pub(super) fn of_rotation(&self, point: &BodyPoint) -> DMatrix<f64> {
        self.works(|rest, axis, forces| point.add_torque(rest, axis, forces))
    }

    /// Returns the modal forces of a unit load along each axis.
    fn works(&self, add: impl Fn(&Evaluation<'_>, &Vector3<f64>, &mut [f64])) -> DMatrix<f64> {
        let rest = Evaluation::new(&self.equations);
        let rows = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
            let mut forces = vec![0.0; self.equations.n_velocities()];
            add(&rest, &axis, &mut forces);
            forces.split_off(self.equations.n_rigid())
        });
        DMatrix::from_fn(3, self.body.n_modes(), |k, j| rows[k][j])
    }

    /// Returns Psi of a node (3 x nf).
    pub(super) fn of_node(&self, node: usize) -> DMatrix<f64> {
        let shape = &self.body.modes().shape;
        DMatrix::from_fn(3, self.body.n_modes(), |k, j| shape[(3 * node + k, j)])
    }

    /// Returns the rows with column j multiplied by `weight(j)`.
    pub(super) fn weighted(rows: &DMatrix<f64>, weight: impl Fn(usize) -> f64) -> DMatrix<f64> {
        DMatrix::from_fn(rows.nrows(), rows.ncols(), |k, j| rows[(k, j)] * weight(j))
    }

    /// Returns the largest singular value of a few rows.
    pub(super) fn norm(rows: &DMatrix<f64>) -> f64 {
        (rows * rows.transpose()).symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}
