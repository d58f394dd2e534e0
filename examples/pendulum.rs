//! A flexible pendulum: a truss of 3 m that hangs from a ball joint, released at rest, with the constraint
//! force of the joint.
//!
//!     cargo run --release --example pendulum
//!
//! It prints its period and the impulse of the joint from one passage through the vertical to the next beside
//! those of the rigid body in closed form, how the energy drifted, and what the impulses of joint and weight
//! lack of the change of momentum. With four times the stiffness the period is off by a quarter.

#![allow(unreachable_pub)] // modules that several examples share

#[allow(dead_code)] // The other example uses all of it.
mod joints;
#[allow(dead_code)] // The tower is the example `from_memory`.
mod truss;

use flexbody::{ConvertOptions, FlexBody, Model, SparseMatrix};
use joints::{Assembly, End, Joint, Start, ground_force, momentum, step};
use nalgebra::{Rotation3, Vector3};
use std::error::Error;
use std::f64::consts::PI;

const GRAVITY: f64 = 9.81; // m/s^2
/// From the vertical, at the start.
const ANGLE: f64 = 0.9;
const STEP: f64 = 1.2e-3; // s, of the stiffness of steel; the frequencies grow with its root
const MODES: usize = 2;

/// Results of a swing.
pub struct Swing {
    /// Period of the flexible body.
    pub period: f64,
    /// Period of the rigid body in closed form.
    pub rigid_period: f64,
    /// Change of the energy, relative to what falls.
    pub energy: f64,
    /// Change of momentum minus the impulses of joint and weight, relative to the impulse of the weight.
    pub impulse: f64,
    /// Impulse of the joint from one passage through the vertical to the next, relative to that on the rigid
    /// body in closed form: along, and upwards.
    pub passage: [f64; 2],
    /// The largest gap of the joint, relative to the length.
    pub gap: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "stiffness  period      rigid       difference  impulse of the joint / rigid  energy   momentum"
    );
    for factor in [1.0, 4.0] {
        let Swing { period, rigid_period, energy, impulse, passage: [along, up], .. } = swing(factor)?;
        let difference = period / rigid_period - 1.0;
        println!(
            "{factor:>9}  {period:.7} s {rigid_period:.7} s {difference:>10.1e}  {along:.6} along, {up:.6} up  {energy:>8.1e} {impulse:>8.1e}"
        );
    }
    Ok(())
}

/// The truss of 1 x 1 x 6 bays, of steel times a factor, made without files.
fn body(factor: f64) -> flexbody::Result<FlexBody> {
    let (stiffness, mass, positions) = truss::truss_of([1, 1, 6], factor * truss::YOUNGS);
    let ids: Vec<i64> = (1..=positions.len() as i64).collect();
    let top = 6.0 * truss::BAY;
    let held = ids.iter().zip(&positions).filter(|(_, x)| x[2] == top).map(|(&id, _)| id).collect();
    let model =
        Model::builder("pendulum", SparseMatrix::from_sprs(&stiffness), SparseMatrix::from_sprs(&mass))
            .nodes(ids, positions)
            .units("m", "kg", "s")?
            .interface("top", held)
            .build()?;
    Ok(model.convert(&ConvertOptions::default().modes(MODES))?.body)
}

/// Swings from rest until the pendulum comes back.
pub fn swing(factor: f64) -> Result<Swing, Box<dyn Error>> {
    let body = body(factor)?;
    let equations = [body.equations_of_motion()];
    let top = body.interface_point("top")?;
    let rest = top.place(&flexbody::dynamics::Evaluation::new(&equations[0]));
    let assembly = Assembly {
        bodies: &equations,
        masses: vec![body.mass()],
        joints: vec![Joint {
            ends: [End::Body(0, top.clone()), End::Ground(Vector3::zeros())],
            axes: [true; 3],
        }],
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
    };
    let axes = Rotation3::from_axis_angle(&Vector3::y_axis(), ANGLE).into_inner() * body.frame().1;
    let zero = Vector3::zeros();
    let mut y = assembly.state(&[Start { origin: -axes * rest, axes, velocity: zero, omega: zero }]);

    let (arm, weight) = (rest.norm(), body.mass() * GRAVITY);
    // About the joint and the axis y: that of the swing.
    let about = axes.tr_mul(&Vector3::y());
    let inertia = about.dot(&(body.inertia() * about)) + body.mass() * arm * arm;
    let rigid_period = rigid_period(weight * arm, inertia);
    let fall = weight * arm * (1.0 - ANGLE.cos());
    let (energy, begin) = (assembly.energy(&y), momentum(&assembly, &y));
    let mut found =
        Swing { period: 0.0, rigid_period, energy: 0.0, impulse: 0.0, passage: [0.0; 2], gap: 0.0 };
    let width = STEP / factor.sqrt();
    let (mut time, mut impulse, mut passages) = (0.0, zero, Vec::new());
    while passages.len() < 2 {
        let before = assembly.origin(&y, 0).x;
        let push = ground_force(&assembly, &step(&assembly, &mut y, width)?) * width;
        impulse += push;
        time += width;
        let after = assembly.origin(&y, 0).x;
        if before.signum() != after.signum() {
            // The part of the step that is behind the vertical.
            let part = after / (after - before);
            passages.push((time - part * width, impulse - push * part));
        }
        found.energy = found.energy.max((assembly.energy(&y) - energy).abs() / fall);
        found.gap = found.gap.max(assembly.violation(&y)?.0 / arm);
    }
    // Half a period; the rigid body turns its momentum round, and the joint carries the weight.
    found.period = 2.0 * (passages[1].0 - passages[0].0);
    let passed = passages[1].1 - passages[0].1;
    let turned = 2.0 * body.mass() * arm * (2.0 * fall / inertia).sqrt();
    found.passage = [passed.x.abs() / turned, passed.z / (0.5 * weight * rigid_period)];
    let left = momentum(&assembly, &y) - begin - impulse - assembly.gravity * (body.mass() * time);
    found.impulse = left.norm() / (weight * time);
    Ok(found)
}

/// 4 sqrt(J / (m g d)) K(sin(angle / 2)), the complete elliptic integral K by the arithmetic-geometric mean.
fn rigid_period(moment: f64, inertia: f64) -> f64 {
    let (mut a, mut b): (f64, f64) = (1.0, (0.5 * ANGLE).cos());
    while a - b > 1e-15 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    4.0 * (inertia / moment).sqrt() * PI / (2.0 * a)
}
