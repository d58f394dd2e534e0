//! Two flexible bodies connected by joints: compared with Exudyn, and in the limit of stiff bodies with the
//! rigid double pendulum.

use crate::jointed::{Assembly, End, Joint, Jointed, Scales, Start};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_model::{Coupling, NodeSet, Reference};
use flexbody_motion::dynamics::{BodyPoint, EquationsOfMotion, Terms};
use nalgebra::{DVector, Matrix3, Rotation3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::body_of;
use oracle::general::raw_fixture;
use oracle::integrate;
use oracle::mesh::Mesh;
use serde::Deserialize;

/// Results of Exudyn, written by tests/peers/mechanisms.py.
const EXUDYN: &str = include_str!("mechanisms.json");

#[derive(Deserialize)]
struct Recorded {
    double_pendulum: Mechanism,
    slider_crank: Mechanism,
}

#[derive(Deserialize)]
struct Mechanism {
    bodies: Vec<Placed>,
    joints: Vec<Held>,
    shown: Vec<Seat>,
    gravity: [f64; 3],
    duration: f64,
    /// Change by the last extrapolation to step zero.
    error: f64,
    /// Origins of the bodies, then the recorded points, at equal intervals.
    places: Vec<Vec<[f64; 3]>>,
}

#[derive(Deserialize)]
struct Placed {
    model: String,
    modes: usize,
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
}

#[derive(Deserialize)]
struct Held {
    ends: [Seat; 2],
    axes: [bool; 3],
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Seat {
    Ground { ground: [f64; 3] },
    Interface { body: usize, interface: String },
    Node { body: usize, node: i64 },
}

/// Returns a body of the fixtures with joints at the means of its interfaces, like those of the record.
fn placed(one: &Placed) -> FlexBody {
    let mut raw = raw_fixture(&one.model);
    for set in &mut raw.data.interfaces {
        let index = |id: &i64| raw.nodes.ids.iter().position(|own| own == id).expect("a node");
        let places = set.nodes.iter().map(|id| Vector3::from(raw.nodes.positions[index(id)]));
        set.reference = Reference::Point((places.sum::<Vector3<f64>>() / set.nodes.len() as f64).into());
    }
    body_of(raw, one.modes, BodyFrame::Principal)
}

fn interface(body: &FlexBody, name: &str) -> BodyPoint {
    let found = body.interfaces().iter().find(|one| one.name == name).expect("an interface");
    BodyPoint::interface(body, found, Terms::ALL).expect("a reference point")
}

fn at_rest(origin: Vector3<f64>, axes: Matrix3<f64>) -> Start {
    Start { origin, axes, velocity: Vector3::zeros(), omega: Vector3::zeros() }
}

impl Mechanism {
    fn seat(&self, seat: &Seat, bodies: &[FlexBody]) -> End {
        match seat {
            Seat::Ground { ground } => End::Ground(Vector3::from(*ground)),
            Seat::Interface { body, interface: name } => End::Body(*body, interface(&bodies[*body], name)),
            Seat::Node { body, node } => {
                let index = bodies[*body].nodes().ids.iter().position(|id| id == node).expect("a node");
                End::Body(*body, BodyPoint::node(&bodies[*body], index))
            }
        }
    }

    /// Asserts that the motion agrees with Exudyn, and that the energy is conserved.
    fn check(&self, what: &str) {
        let bodies: Vec<FlexBody> = self.bodies.iter().map(placed).collect();
        let equations: Vec<EquationsOfMotion> =
            bodies.iter().map(|body| EquationsOfMotion::new(body, Terms::ALL)).collect();
        let gravity = Vector3::from(self.gravity);
        let joint = |held: &Held| Joint {
            ends: [self.seat(&held.ends[0], &bodies), self.seat(&held.ends[1], &bodies)],
            axes: held.axes,
        };
        let assembly = Assembly {
            bodies: &equations,
            masses: bodies.iter().map(|body| body.invariants().mass()).collect(),
            joints: self.joints.iter().map(joint).collect(),
            gravity,
        };
        let mut system = Jointed {
            assembly,
            scales: Scales { length: 100.0, rate: std::f64::consts::TAU / self.duration },
        };
        let shown: Vec<End> = self.shown.iter().map(|seat| self.seat(seat, &bodies)).collect();
        let starts: Vec<Start> = self
            .bodies
            .iter()
            .map(|one| {
                let axes = Matrix3::from_fn(|i, j| one.axes[i][j]);
                at_rest(Vector3::from(one.origin), axes)
            })
            .collect();
        let mut y = system.assembly.state(&starts);
        let (gap, _) = system.assembly.violation(&y).expect("a body with mass");
        assert!(gap < 1e-9, "{what}: joints are open by {gap:e}");
        let energy = system.assembly.energy(&y);
        let rate = system.scales.rate;
        let count = self.places.len();
        let instants: Vec<f64> = (1..=count).map(|i| self.duration * i as f64 / count as f64).collect();
        let (mut worst, mut drift, mut open, mut fall) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        system.run(&mut y, &instants, 1e-9, |assembly, at, y| {
            let origins = (0..bodies.len()).map(|body| assembly.origin(y, body));
            let points = shown.iter().map(|end| match end {
                End::Ground(place) => *place,
                End::Body(body, point) => assembly.place(y, *body, point),
            });
            for (found, expected) in origins.chain(points).zip(&self.places[at]) {
                worst = worst.max((found - Vector3::from(*expected)).amax());
            }
            let lift: f64 = (0..bodies.len())
                .map(|body| -assembly.masses[body] * gravity.dot(&Vector3::from(self.places[at][body])))
                .sum();
            drift = drift.max((assembly.energy(y) - energy).abs());
            fall = fall.max((lift - energy).abs());
            let (gap, speed) = assembly.violation(y).expect("a body with mass");
            open = open.max(gap).max(speed / rate);
        });
        println!(
            "{what}: {worst:e} from Exudyn, whose error is about {:e}; energy {:e}",
            self.error,
            drift / fall
        );
        assert!(worst < 3.0 * self.error && worst < 1e-4, "{what}: {worst:e} from Exudyn");
        assert!(drift < 1e-8 * fall && open < 1e-9, "{what}: energy {:e}, joints {open:e}", drift / fall);
    }
}

#[test]
#[ignore = "slow"]
fn a_double_pendulum_moves_as_in_exudyn() {
    let recorded: Recorded = serde_json::from_str(EXUDYN).expect("what the script writes");
    recorded.double_pendulum.check("double pendulum");
}

#[test]
#[ignore = "slow"]
fn a_slider_crank_moves_as_in_exudyn() {
    let recorded: Recorded = serde_json::from_str(EXUDYN).expect("what the script writes");
    recorded.slider_crank.check("slider-crank");
}

const LENGTH: f64 = 1.0;

/// Returns a bar along x about the origin with interfaces at its ends.
fn bar(youngs: f64) -> FlexBody {
    let mesh = Mesh::block(ElementKind::Hex8, [6, 1, 1], [LENGTH, 0.1, 0.08]);
    let mesh = mesh.moved(&Matrix3::identity(), [-0.5 * LENGTH, -0.05, -0.04]);
    let end = |name: &str, x: f64| {
        let kept = mesh.nodes.iter().enumerate().filter(|(_, node)| (node[0] - x).abs() < 1e-9);
        let nodes = kept.map(|(i, _)| i as i64 + 1).collect();
        NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new(name, nodes) }
    };
    let material = Material { youngs, poisson: 0.3, density: 1000.0 };
    let mut raw = mesh.assemble(&material, MassRule::Consistent).raw_model();
    raw.data.interfaces = vec![end("left", -0.5 * LENGTH), end("right", 0.5 * LENGTH)];
    body_of(raw, 4, BodyFrame::Com)
}

const GRAVITY: f64 = 9.81;
const ANGLES: [f64; 2] = [1.2, 2.0];
const DURATION: f64 = 1.0;

/// Returns the tips of a flexible double pendulum in the plane after a time.
fn tips(youngs: f64) -> Vec<Vector3<f64>> {
    let body = bar(youngs);
    let equations = [0, 1].map(|_| EquationsOfMotion::new(&body, Terms::ALL));
    let (left, right) = (interface(&body, "left"), interface(&body, "right"));
    let all = [true; 3];
    let assembly = Assembly {
        bodies: &equations,
        masses: vec![body.invariants().mass(); 2],
        joints: vec![
            Joint { ends: [End::Body(0, left.clone()), End::Ground(Vector3::zeros())], axes: all },
            Joint { ends: [End::Body(1, left.clone()), End::Body(0, right.clone())], axes: all },
        ],
        gravity: Vector3::new(0.0, -GRAVITY, 0.0),
    };
    let scales = Scales { length: LENGTH, rate: (GRAVITY / LENGTH).sqrt() };
    let mut system = Jointed { assembly, scales };
    // Angles from the hanging position.
    let axes = ANGLES.map(|angle| {
        *Rotation3::from_axis_angle(&Vector3::z_axis(), angle - 0.5 * std::f64::consts::PI).matrix()
    });
    let half = Vector3::new(0.5 * LENGTH, 0.0, 0.0);
    let origins = [axes[0] * half, axes[0] * half * 2.0 + axes[1] * half];
    let mut y = system.assembly.state(&[0, 1].map(|i| at_rest(origins[i], axes[i])));
    let energy = system.assembly.energy(&y);
    let mut tips = Vec::new();
    system.run(&mut y, &[DURATION], 1e-10, |assembly, _, y| {
        tips = vec![assembly.place(y, 0, &right), assembly.place(y, 1, &right)];
        let drift = (assembly.energy(y) - energy).abs() / (assembly.masses[0] * GRAVITY * LENGTH);
        assert!(drift < 1e-9, "energy {drift:e}");
    });
    tips
}

/// Returns the tips of the rigid double pendulum, from its two equations for the angles.
fn rigid_tips() -> Vec<Vector3<f64>> {
    let body = bar(1.0);
    let (m, l, d) = (body.invariants().mass(), LENGTH, 0.5 * LENGTH);
    let j = body.invariants().inertia()[(2, 2)];
    let rate = |y: &DVector<f64>| {
        let (a, b, a_rate, b_rate) = (y[0], y[1], y[2], y[3]);
        let (sin, cos) = (a - b).sin_cos();
        let coupling = m * l * d;
        let matrix =
            nalgebra::Matrix2::new(j + m * d * d + m * l * l, coupling * cos, coupling * cos, j + m * d * d);
        let force = nalgebra::Vector2::new(
            -coupling * sin * b_rate * b_rate - (m * d + m * l) * GRAVITY * a.sin(),
            coupling * sin * a_rate * a_rate - m * d * GRAVITY * b.sin(),
        );
        let turned = matrix.lu().solve(&force).expect("a mass");
        DVector::from_vec(vec![a_rate, b_rate, turned[0], turned[1]])
    };
    let mut y = DVector::from_vec(vec![ANGLES[0], ANGLES[1], 0.0, 0.0]);
    for _ in 0..100 {
        y = integrate::step(&y, DURATION / 100.0, &rate);
    }
    let along = |angle: f64| Vector3::new(angle.sin(), -angle.cos(), 0.0) * LENGTH;
    vec![along(y[0]), along(y[0]) + along(y[1])]
}

/// Sixteen times the stiffness gives a sixteenth of the difference.
#[test]
fn stiff_bodies_make_the_rigid_double_pendulum() {
    let rigid = rigid_tips();
    let difference = |youngs: f64| {
        let found = tips(youngs);
        found.iter().zip(&rigid).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let (soft, stiff) = (difference(1e8), difference(1.6e9));
    println!("from the rigid pendulum: {soft:e}, {stiff:e}");
    assert!(soft < 0.05 && stiff < 0.004, "{soft:e} {stiff:e}");
    let ratio = soft / stiff;
    assert!((10.0..25.0).contains(&ratio), "{ratio}");
}
