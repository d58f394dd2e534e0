//! Rotating bodies compared with closed forms: unstable middle axis, extension of a spinning bar, precession
//! of the vibration of a spinning ring.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_motion::dynamics::{
    AlongFrame, Configuration, EmptySpace, EquationsOfMotion, EulerParameters, Evaluation, Place, Prescribed,
    Surroundings, Terms,
};
use nalgebra::{Matrix3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::body_of;
use oracle::mesh::Mesh;
use oracle::motion::{adaptive, conserving, run};
use std::f64::consts::{PI, TAU};

/// Returns the body at rest at the origin.
fn rest(body: &FlexBody) -> Configuration {
    Configuration {
        origin: Vector3::zeros(),
        attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
        velocity: Vector3::zeros(),
        omega: Vector3::zeros(),
        q: vec![0.0; body.n_modes()],
        qd: vec![0.0; body.n_modes()],
    }
}

/// Returns the complete elliptic integral of the first kind of modulus k, by the arithmetic-geometric mean.
fn elliptic_k(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    0.5 * PI / a
}

/// Returns half the period of a rigid top (Landau, Lifshitz, Mechanics, 37): the time between two flips about
/// the middle axis.
fn rigid_flip(moments: [f64; 3], omega: Vector3<f64>) -> f64 {
    let [a, b, c] = moments;
    let double_energy = a * omega.x * omega.x + b * omega.y * omega.y + c * omega.z * omega.z;
    let square = (a * omega.x).powi(2) + (b * omega.y).powi(2) + (c * omega.z).powi(2);
    let (over, under) = (double_energy * c - square, square - double_energy * a);
    assert!(square > double_energy * b, "turns about the axis of the largest moment");
    let rate = ((c - b) * under / (a * b * c)).sqrt();
    let k = ((b - a) * over / ((c - b) * under)).sqrt();
    2.0 * elliptic_k(k) / rate
}

#[test]
fn a_flexible_body_flips_about_its_middle_axis_like_a_rigid_top_as_it_stiffens() {
    let mesh = Mesh::block(ElementKind::Hex8, [4, 3, 2], [0.4, 0.25, 0.1]);
    let body =
        body_of(mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model(), 4, BodyFrame::Principal);
    let inertia = body.invariants().inertia();
    let moments = [0, 1, 2].map(|k| inertia[(k, k)]);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let error = |ratio: f64| {
        let spin = ratio * body.modes().eigenvalue[0].sqrt();
        let mut start = rest(&body);
        start.omega = Vector3::new(0.05, 1.0, 0.1) * spin;
        // Starts in equilibrium with the centrifugal load to avoid vibration: K q = W1' part, to first order.
        let mut evaluation = Evaluation::new(&equations);
        let mut nu = vec![0.0; 6 + body.n_modes()];
        nu[3..6].copy_from_slice(start.omega.as_slice());
        evaluation.set(&start.q, &nu);
        let load = evaluation.velocity_forces()[6..].to_vec();
        start.q = load.iter().zip(&body.modes().eigenvalue).map(|(h, lambda)| -h / lambda).collect();
        let flip = rigid_flip(moments, start.omega);
        let instants: Vec<f64> = (0..=3000).map(|i| f64::from(i) * 1e-3 * flip).collect();
        let (states, _) = run(&equations, &EmptySpace, &start, adaptive(1e-10), &instants, &[]);
        let crossings: Vec<f64> = (1..states.len())
            .filter(|&i| states[i - 1].omega.y * states[i].omega.y < 0.0)
            .map(|i| {
                let (before, after) = (states[i - 1].omega.y, states[i].omega.y);
                instants[i - 1] + (instants[i] - instants[i - 1]) * before / (before - after)
            })
            .collect();
        assert!(crossings.len() >= 2, "it flips: {crossings:?}");
        ((crossings[1] - crossings[0]) / flip - 1.0).abs()
    };
    // The deformation is proportional to the square of spin over frequency.
    let (fast, slow) = (error(0.04), error(0.02));
    let order = (fast / slow).log2();
    assert!(slow < 0.02 && (order - 2.0).abs() < 0.2, "{fast:e}, {slow:e}: order {order}");
}

/// Spin about the third axis, from zero to `rate`.
struct SpinUp {
    rate: f64,
    duration: f64,
}

impl Surroundings for SpinUp {
    fn add_forces(&self, _: f64, _: &Place, _: &Evaluation<'_>, _: &mut [f64]) {}

    fn prescribed(&self, time: f64, _: &Matrix3<f64>) -> (Prescribed, Prescribed) {
        let phase = TAU * (time / self.duration).min(1.0);
        let about = |value: f64| Prescribed { linear: None, angular: Some(AlongFrame(Vector3::z() * value)) };
        (
            about(self.rate * (phase - phase.sin()) / TAU),
            about(self.rate / self.duration * (1.0 - phase.cos())),
        )
    }
}

/// (E A u')' + rho A w^2 (x + u) = 0 with free ends gives the extension of half a bar of length 2 l: tan(k
/// l)/k - l with k = w sqrt(rho/E). Without W2 the load does not grow with u: rho w^2 l^3 / 3E.
#[test]
fn a_spinning_bar_stretches_as_far_as_the_closed_form_says() {
    // Without lateral contraction a bar of hexahedra follows the formula.
    let material = Material { youngs: 1.0, poisson: 0.0, density: 1.0 };
    let length = 2.0;
    let spin = 0.5; // k l = 0.5
    let stretch = |cells: i32, terms: Terms| {
        let mesh = Mesh::block(ElementKind::Hex8, [cells, 1, 1], [length, 0.1, 0.1]);
        let raw = mesh.assemble(&material, MassRule::Consistent).raw_model();
        let all = 3 * raw.nodes.ids.len() - 6;
        let mut parts = body_of(raw, all, BodyFrame::Com).into_parts();
        parts.modes.damping_ratio = vec![0.7; all];
        let body = FlexBody::new(parts).expect("a body");
        let equations = EquationsOfMotion::new(&body, terms);
        let surroundings = SpinUp { rate: spin, duration: 20.0 };
        let (states, _) =
            run(&equations, &surroundings, &rest(&body), conserving(4, 0.1), &[0.0, 60.0], &[20.0]);
        let end = (0..body.nodes().positions.len())
            .max_by(|&a, &b| body.nodes().positions[a][0].total_cmp(&body.nodes().positions[b][0]))
            .expect("nodes");
        states[1].q.iter().enumerate().map(|(j, q)| body.modes().shape[(3 * end, j)] * q).sum::<f64>()
    };
    let half = 0.5 * length;
    let full = (spin * half).tan() / spin - half;
    let linear = spin * spin * half.powi(3) / 3.0;
    let without = Terms { w2: false, ..Terms::ALL };
    let [coarse, fine] = [4, 8].map(|cells| (stretch(cells, Terms::ALL) / full - 1.0).abs());
    let order = (coarse / fine).log2();
    assert!(fine < 5e-3 && (order - 2.0).abs() < 0.25, "{full}: {coarse:e}, {fine:e}, order {order}");
    // Linear elements extend exactly at their nodes under a given load.
    let error = (stretch(4, without) / linear - 1.0).abs();
    assert!(error < 1e-11, "{error:e}");
    assert!((full / linear - 1.0) > 0.05, "the closed forms differ");
}

/// Bryan's effect: in-plane vibration with n waves of a thin ring that spins at W precesses at g W against
/// the modes of the ring, in their plane of amplitudes, g = 2n / (n^2 + 1); the two frequencies of the pair
/// are split by 2 g W (G. H. Bryan, On the beats in the vibrations of a revolving cylinder or bell, 1890).
#[test]
fn the_vibration_of_a_spinning_ring_turns_with_bryans_factor() {
    let mesh = Mesh::ring(ElementKind::Hex20, 24, 1.0, 0.03);
    let body =
        body_of(mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model(), 8, BodyFrame::Principal);
    // The axis of the ring is that of the largest moment, the third; W3 about it couples the pair of modes.
    let (w3, nf) = (body.invariants().w3().expect("held"), body.n_modes());
    let coupling = |j: usize| w3[(2 * nf + j, j + 1)].abs();
    let pair = (0..nf - 1).max_by(|&a, &b| coupling(a).total_cmp(&coupling(b))).expect("modes");
    let factor = 0.8;
    assert!((coupling(pair) / factor - 1.0).abs() < 2e-3, "W3 of the pair: {}", coupling(pair));

    let frequency = body.modes().eigenvalue[pair].sqrt();
    let spin = 1e-3 * frequency;
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let mut start = rest(&body);
    start.omega = Vector3::z() * spin;
    start.q[pair] = 1e-3 * body.invariants().mass().sqrt();
    // Half the time in which the vibration transfers to the other mode, and all of it.
    let over = PI / (2.0 * factor * spin);
    let instants = [0.0, 0.5 * over, over];
    let (states, _) = run(&equations, &EmptySpace, &start, adaptive(1e-10), &instants, &[]);
    let amplitude =
        |state: &Configuration, j: usize| state.q[j].hypot(state.qd[j] / frequency) / start.q[pair];
    for (state, [own, other]) in states.iter().zip([[1.0, 0.0], [0.5_f64.sqrt(); 2], [0.0, 1.0]]) {
        let found = [amplitude(state, pair), amplitude(state, pair + 1)];
        assert!(
            (found[0] - own).abs() < 5e-3 && (found[1] - other).abs() < 5e-3,
            "{found:?}, {own}, {other}"
        );
    }
}
