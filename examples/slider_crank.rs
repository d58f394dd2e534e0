//! A slider-crank of two flexible bodies: a crank of 1 m on a hinge and a rod of 3 m, whose end slides along
//! the axis x, both trusses. It turns freely under its weight.
//!
//!     cargo run --release --example slider_crank
//!
//! It prints how the place of the slider and the angular velocity of the crank differ from the rigid
//! mechanism in closed form (kinematics; energy), what the impulses of hinge, guide and weight lack of the
//! change of momentum, and how the energy drifted. With four times the stiffness a quarter of the difference
//! of the places is left, and half of that of the velocities, which is a vibration.

#![allow(unreachable_pub)] // modules that several examples share

#[allow(dead_code)] // The other example uses all of it.
mod joints;
#[allow(dead_code)] // The tower is the example `from_memory`.
mod truss;

use flexbody::dynamics::Evaluation;
use flexbody::{ConvertOptions, FlexBody, Model, SparseMatrix};
use joints::{Assembly, End, Joint, Start, ground_force, momentum, step};
use nalgebra::{Matrix3, Vector3};
use std::error::Error;

const GRAVITY: f64 = 9.81; // m/s^2
/// Of the crank at the start, where it points to the slider.
const SPEED: f64 = 12.0; // rad/s
const DURATION: f64 = 0.5; // s, about a turn
const STEP: f64 = 2e-4; // s, of the stiffness of steel; the frequencies grow with its root
const MODES: usize = 4;
/// Bays along the crank and the rod.
const BAYS: [i32; 2] = [2, 6];
const LENGTHS: [f64; 2] = [2.0 * truss::BAY, 6.0 * truss::BAY];

/// Results of a run: the largest value of each quantity.
pub struct Run {
    /// Difference of the slider's place from that of the rigid mechanism at the same angle of the crank,
    /// relative to the crank.
    pub slider: f64,
    /// Difference of the crank's angular velocity from the rigid one at the same angle, root mean square,
    /// relative to that at the start.
    pub speed: f64,
    /// Change of the energy, relative to the kinetic energy of the start.
    pub energy: f64,
    /// Change of momentum minus the impulses, relative to the largest momentum.
    pub impulse: f64,
    /// The largest force of the guide.
    pub guide: f64,
    /// The largest force of the hinge.
    pub hinge: f64,
    /// The largest gap of a joint, relative to the crank.
    pub gap: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("stiffness  slider    speed     energy    impulse   guide (N)  hinge (N)");
    for factor in [1.0, 4.0] {
        let Run { slider, speed, energy, impulse, guide, hinge, .. } = run(factor, DURATION)?;
        println!(
            "{factor:>9}  {slider:.2e}  {speed:.2e}  {energy:.1e}   {impulse:.1e}   {guide:>8.0}  {hinge:>8.0}"
        );
    }
    Ok(())
}

/// A truss of so many bays, of steel times a factor, with its ends as interfaces: `foot`, the two sides of
/// it, and `head`.
fn body(bays: i32, factor: f64) -> flexbody::Result<FlexBody> {
    let (stiffness, mass, positions) = truss::truss_of([1, 1, bays], factor * truss::YOUNGS);
    let ids: Vec<i64> = (1..=positions.len() as i64).collect();
    let nodes = |keep: &dyn Fn(&[f64; 3]) -> bool| -> Vec<i64> {
        ids.iter().zip(&positions).filter(|(_, x)| keep(x)).map(|(&id, _)| id).collect()
    };
    let top = f64::from(bays) * truss::BAY;
    let interfaces = [
        ("foot", nodes(&|x| x[2] == 0.0)),
        ("foot_left", nodes(&|x| x[2] == 0.0 && x[1] == 0.0)),
        ("foot_right", nodes(&|x| x[2] == 0.0 && x[1] > 0.0)),
        ("head", nodes(&|x| x[2] == top)),
    ];
    let (k, m) = (SparseMatrix::from_sprs(&stiffness), SparseMatrix::from_sprs(&mass));
    let mut model =
        Model::builder("truss", k, m).nodes(ids.clone(), positions.clone()).units("m", "kg", "s")?;
    for (name, nodes) in interfaces {
        model = model.interface(name, nodes);
    }
    Ok(model.build()?.convert(&ConvertOptions::default().modes(MODES))?.body)
}

/// The joints: a hinge about y at the origin, a ball between the bodies, and the end of the rod on the axis
/// x.
fn joints(bodies: &[FlexBody; 2]) -> flexbody::Result<Vec<Joint>> {
    let end = |body: usize, name: &str| {
        Ok::<End, flexbody::Error>(End::Body(body, bodies[body].interface_point(name)?))
    };
    let half = Vector3::new(0.0, 0.5 * truss::BAY, 0.0);
    Ok(vec![
        Joint { ends: [end(0, "foot_left")?, End::Ground(-half)], axes: [true; 3] },
        Joint { ends: [end(0, "foot_right")?, End::Ground(half)], axes: [true, false, true] },
        Joint { ends: [end(1, "foot")?, end(0, "head")?], axes: [true; 3] },
        Joint { ends: [end(1, "head")?, End::Ground(Vector3::zeros())], axes: [false, true, true] },
    ])
}

/// A body whose foot is at a place; its length, z of the model, lies along the axis x of the world, and it
/// turns about y.
fn start(body: &FlexBody, foot: Vector3<f64>, velocity: Vector3<f64>, omega: f64) -> flexbody::Result<Start> {
    let model: Matrix3<f64> = Matrix3::from_columns(&[-Vector3::z(), Vector3::y(), Vector3::x()]);
    let axes = model * body.frame().1;
    let equations = body.equations_of_motion();
    let foot_in_body = body.interface_point("foot")?.place(&Evaluation::new(&equations));
    let arm = -(axes * foot_in_body);
    let turn = Vector3::y() * omega;
    Ok(Start { origin: foot + arm, axes, velocity: velocity + turn.cross(&arm), omega: axes.tr_mul(&turn) })
}

/// The motion over a time, of bodies with so many times the stiffness of steel.
pub fn run(factor: f64, duration: f64) -> Result<Run, Box<dyn Error>> {
    let bodies = [body(BAYS[0], factor)?, body(BAYS[1], factor)?];
    let equations = bodies.each_ref().map(FlexBody::equations_of_motion);
    let rigid = Rigid::new(&bodies);
    let assembly = Assembly {
        bodies: &equations,
        masses: bodies.iter().map(FlexBody::mass).collect(),
        joints: joints(&bodies)?,
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
    };
    let [crank, rod] = LENGTHS;
    let (pin, rise) = (Vector3::new(crank, 0.0, 0.0), Vector3::new(0.0, 0.0, crank * SPEED));
    let mut y = assembly.state(&[
        // The angle of the crank grows from x to z, which is about -y.
        start(&bodies[0], Vector3::zeros(), Vector3::zeros(), -SPEED)?,
        start(&bodies[1], pin, rise, crank / rod * SPEED)?,
    ]);
    assembly.settle(&mut y)?;
    let (head, slider) = (bodies[0].interface_point("head")?, bodies[1].interface_point("head")?);
    let (energy, begin) = (assembly.energy(&y), momentum(&assembly, &y));
    let weight = assembly.gravity * (bodies[0].mass() + bodies[1].mass());
    let mut found =
        Run { slider: 0.0, speed: 0.0, energy: 0.0, impulse: 0.0, guide: 0.0, hinge: 0.0, gap: 0.0 };
    let (mut impulse, mut largest, mut squares) = (Vector3::zeros(), 0.0f64, 0.0);
    let width = STEP / factor.sqrt();
    let steps = (duration / width).round() as usize;
    for _ in 0..steps {
        let multipliers = step(&assembly, &mut y, width)?;
        impulse += (ground_force(&assembly, &multipliers) + weight) * width;
        let pin = assembly.place(&y, 0, &head);
        let angle = pin.z.atan2(pin.x);
        let at = assembly.place(&y, 1, &slider).x;
        let omega = -(assembly.axes(&y, 0) * assembly.evaluation(&y, 0).rigid_velocity().1).y;
        found.slider = found.slider.max((at - Rigid::slider(angle)).abs() / crank);
        squares += (omega / rigid.speed(angle) - 1.0).powi(2);
        found.energy = found.energy.max((assembly.energy(&y) - energy).abs() / rigid.kinetic());
        found.gap = found.gap.max(assembly.violation(&y)?.0 / crank);
        // Rows of the joints: three and two of the hinge, three of the pin, two of the guide.
        found.guide = found.guide.max(multipliers[9].abs());
        found.hinge = found
            .hinge
            .max((0..2).map(|k| multipliers[2 * k] + multipliers[3 + k]).map(|f| f * f).sum::<f64>().sqrt());
        largest = largest.max(momentum(&assembly, &y).norm());
    }
    found.speed = (squares / steps as f64).sqrt();
    found.impulse = (momentum(&assembly, &y) - begin - impulse).norm() / largest;
    Ok(found)
}

/// The mechanism of rigid bodies in closed form.
struct Rigid {
    masses: [f64; 2],
    /// Of the crank about the hinge and of the rod about its centre of mass, about y.
    inertias: [f64; 2],
}

impl Rigid {
    fn new(bodies: &[FlexBody; 2]) -> Self {
        // Width of the truss, y of the model, along the axes of the body; the centre of mass is in the
        // middle.
        let about = |body: &FlexBody| {
            let axis = body.frame().1.tr_mul(&Vector3::y());
            axis.dot(&(body.inertia() * axis))
        };
        let masses = bodies.each_ref().map(FlexBody::mass);
        let crank = about(&bodies[0]) + masses[0] * (0.5 * LENGTHS[0]).powi(2);
        Self { masses, inertias: [crank, about(&bodies[1])] }
    }

    /// Place of the slider at an angle of the crank.
    fn slider(angle: f64) -> f64 {
        let [r, l] = LENGTHS;
        r * angle.cos() + (l * l - (r * angle.sin()).powi(2)).sqrt()
    }

    /// Twice the kinetic energy over the square of the angular velocity of the crank.
    fn inertia(&self, angle: f64) -> f64 {
        let [r, l] = LENGTHS;
        let (sin, cos) = angle.sin_cos();
        // sin(rod) = -r/l sin(crank).
        let rod_cos = (1.0 - (r / l * sin).powi(2)).sqrt();
        let rod_rate = -r / l * cos / rod_cos;
        let x = -r * sin + 0.5 * r * sin * rod_rate;
        let z = 0.5 * r * cos;
        self.inertias[0] + self.masses[1] * (x * x + z * z) + self.inertias[1] * rod_rate * rod_rate
    }

    /// Potential energy: the middles of both bodies are at half the height of the pin.
    fn potential(&self, angle: f64) -> f64 {
        (self.masses[0] + self.masses[1]) * GRAVITY * 0.5 * LENGTHS[0] * angle.sin()
    }

    /// Kinetic energy at the start.
    fn kinetic(&self) -> f64 {
        0.5 * self.inertia(0.0) * SPEED * SPEED
    }

    /// Angular velocity of the crank, from the energy.
    fn speed(&self, angle: f64) -> f64 {
        (2.0 * (self.kinetic() - self.potential(angle)) / self.inertia(angle)).sqrt()
    }
}
