//! Stresses of a tumbling body: a few modes with static columns, against all modes.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::flex_body::{Carrier, FlexBody, ModalMotion, Quantity, RecoveryState};
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::Context;
use flexbody_model::{NodeSet, RawModel, RecoveryOperator};
use flexbody_motion::dynamics::{
    Configuration, EmptySpace, EquationsOfMotion, EulerParameters, Motion, Terms,
};
use flexbody_motion::integration::{Explicit, Failure, Method, integrate};
use flexbody_motion::scene::{
    ExtremeSearch, LoadCases, RowLayout, RowMap, RowStates, StressPoint, simulate_with_envelope,
};
use nalgebra::Vector3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::flexible::body_of;
use oracle::mesh::{Mesh, grid};

/// Returns a rubber-like arm without symmetry, with its stresses.
pub fn arm_model() -> RawModel {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([6, 2, 1]), |[x, y, z]| {
        [0.3 * x + 0.03 * y, 0.2 * y * (1.0 - 0.05 * x), 0.25 * z * (1.0 + 0.1 * y)]
    });
    let mut raw = mesh.assemble(&rubber, MassRule::Consistent).raw_model();
    raw.data.recoveries = vec![mesh.stresses(&rubber)];
    raw
}

fn arm(modes: usize) -> FlexBody {
    body_of(arm_model(), modes, BodyFrame::Com)
}

/// Returns the spinning body at rest in its frame: with the modes at their static response to the spin.
fn at_equilibrium(body: &FlexBody, omega: Vector3<f64>) -> Configuration {
    let (nf, w1) = (body.n_modes(), body.invariants().w1().expect("all groups"));
    let load = |j: usize| -> f64 {
        let pairs = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
        pairs.map(|(k, l)| 0.5 * omega[k] * omega[l] * w1[(l, k * nf + j)]).sum()
    };
    Configuration {
        origin: Vector3::zeros(),
        attitude: EulerParameters([1.0, 0.0, 0.0, 0.0]),
        velocity: Vector3::zeros(),
        omega,
        q: (0..nf).map(|j| load(j) / body.modes().eigenvalue[j]).collect(),
        qd: vec![0.0; nf],
    }
}

/// Returns the stresses at each time, with and without the static columns.
fn stresses(body: &FlexBody, omega: Vector3<f64>, instants: &[f64]) -> [Vec<Vec<f64>>; 2] {
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let start = at_equilibrium(body, omega);
    let (mut motion, mut state) = Motion::new(&equations, &EmptySpace, &start);
    let (mut other, _) = Motion::new(&equations, &EmptySpace, &start);
    let mut method = Method::Explicit(Explicit::new(state.len(), 1e-10, f64::INFINITY));
    let (mut with, mut alone) = (Vec::new(), Vec::new());
    let recovery = &body.recoveries()[0];
    integrate(&mut method, &mut motion, &mut state, instants, &[], |time, state| {
        let now = other.evaluate(time, state)?;
        let q = now.evaluation().modal_coordinates();
        let omega = now.evaluation().rigid_velocity().1;
        let at = |angular_velocity| {
            let motion = ModalMotion::steady(q, angular_velocity);
            recovery.values(&RecoveryState { motion, loads: &[], named: &[] })
        };
        with.push(at(omega));
        alone.push(at(Vector3::zeros()));
        Ok::<(), Failure>(())
    })
    .expect("integrates");
    [with, alone]
}

#[test]
fn stresses_of_a_tumbling_body_are_those_of_all_modes() {
    let (whole, few) = (arm(10_000), arm(6));
    let rate = 0.1 * whole.modes().eigenvalue[0].sqrt();
    let omega = Vector3::new(0.3, 1.0, 0.2).normalize() * rate;
    let instants: Vec<f64> = (0..=40).map(|i| f64::from(i) * 0.05 * std::f64::consts::TAU / rate).collect();
    let [exact, of_modes] = stresses(&whole, omega, &instants);
    let [with, alone] = stresses(&few, omega, &instants);
    let all = |a: &[Vec<f64>]| a.iter().flatten().copied().collect::<Vec<f64>>();
    let size = all(&exact).iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let distance = |a: &[Vec<f64>]| {
        all(a).iter().zip(all(&exact)).fold(0.0f64, |most, (a, b)| most.max((a - b).abs())) / size
    };
    println!(
        "with {:.1e}, modes alone {:.1e}, all modes {:.1e}",
        distance(&with),
        distance(&alone),
        distance(&of_modes)
    );
    // All modes leave nothing for the columns.
    assert!(distance(&of_modes) < 1e-9, "{:e}", distance(&of_modes));
    // The rest is of the order of (0.1 f1 / f7)^2.
    assert!(distance(&with) < 5e-3, "{:e}", distance(&with));
    assert!(distance(&alone) > 20.0 * distance(&with), "{:e}", distance(&alone));
}

/// Returns numbers between -1 and 1 that look random.
fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// The bounded search finds the largest values that the evaluation of all rows at all instants finds, for each unit of the
/// rows, in one piece of the history or several, and evaluates few of them.
#[test]
fn extremes_are_those_of_all_rows_and_instants() {
    let body = arm(8);
    let recovery = &body.recoveries()[0];
    let layout = RowLayout::new(&body, [recovery]);
    let mut map = RowMap::new(recovery, &layout);
    // The larger values of some rows are in another unit.
    let first = map.rows.len() / 3;
    map.rows[..first].iter_mut().for_each(|row| "other".clone_into(&mut row.unit));
    for seed in 0..20 {
        let mut random = numbers(seed);
        // Three motions of different size and frequency, and a spin that grows.
        let phases: Vec<[f64; 2]> = (0..body.n_modes()).map(|_| [random(), 4.0 * random()]).collect();
        let mut states = RowStates::new(layout.clone());
        for i in 0..300 {
            let time = 0.01 * f64::from(i);
            let q: Vec<f64> = phases
                .iter()
                .enumerate()
                .map(|(j, [phase, rate])| 1e-3 / (1.0 + j as f64).powi(3) * (rate * time + phase).sin())
                .collect();
            let spin = Vector3::new(0.1, 0.2 * time, -0.05) * random();
            states.push(time, &layout.state(&q, &spin));
        }
        let mut search = ExtremeSearch::new(1, false);
        search.see(std::slice::from_ref(&map), &states);
        let found = &search.finish()[0];
        let values: Vec<Vec<f64>> = states.iter().map(|z| map.values(z)).collect();
        let largest = |of: &dyn Fn(&[f64]) -> Vec<f64>| {
            values.iter().flat_map(|rows| of(rows)).fold(0.0f64, |most, value| most.max(value))
        };
        let points = |measure: &'static dyn Fn(&StressPoint, &[f64]) -> f64| {
            let map = &map;
            move |rows: &[f64]| map.points.iter().map(|point| measure(point, rows)).collect::<Vec<f64>>()
        };
        let expected = [
            largest(&|rows| rows[..first].iter().map(|value| value.abs()).collect()),
            largest(&|rows| rows[first..].iter().map(|value| value.abs()).collect()),
            largest(&points(&StressPoint::von_mises)),
            largest(&points(&|point, rows| point.principal(rows)[0])),
            largest(&points(&|point, rows| -point.principal(rows)[2])),
        ];
        let [other, row] = found.rows.as_slice() else { panic!("two units: {:?}", found.rows) };
        let own = [Some(*other), Some(*row), found.von_mises, found.tension, found.compression];
        for (own, expected) in own.iter().zip(expected) {
            let own = own.expect("an extreme").value.abs();
            assert!((own - expected).abs() <= 1e-12 * expected, "{own:e} {expected:e}");
        }
        assert!(found.evaluated < map.rows.len() / 2, "{} of {}", found.evaluated, map.rows.len());
    }
}

/// Envelopes of a carried body are those of its rows. Displacements relative to an interface are left out of a free motion
/// in mean axes, and named (FB556); stresses stay.
#[test]
fn a_carried_body_has_envelopes_and_a_free_one_no_displacements_of_another_frame() {
    let mut raw = arm_model();
    let mut displacements = raw.data.recoveries[0].clone();
    "place".clone_into(&mut displacements.name);
    if let RecoveryOperator::Rows { labels, .. } = &mut displacements.operator {
        labels.iter_mut().for_each(|label| label.quantity = Quantity::Displacement);
    }
    raw.data.recoveries.push(displacements);
    raw.data.interfaces = vec![NodeSet::new("root", (0..6).map(|row| 1 + 7 * row).collect())];
    let body = body_of(raw, 6, BodyFrame::Com);
    let scene = "[run]\nduration = 0.01\n[carried]\ninterface = \"root\"\n[carried.spin]\naxis = [0, 0, 1]\nrate = 1\n";
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).expect("written");
    let scene = LoadCases::read_single(&path, None).expect("a scene");
    let names_it = |diagnostic: &Diagnostic| {
        diagnostic.code() == Code::RecoveryLeftOut && diagnostic.message().contains("`place`")
    };
    let at_root = body.carried(&Carrier::Interface("root".to_owned())).expect("a body at its root");
    let free = folder.path().join("free.toml");
    std::fs::write(&free, "[run]\nduration = 0.01\n").expect("written");
    let free = LoadCases::read_single(&free, None).expect("a scene");
    let (recording, found) = simulate_with_envelope(&at_root, &free, &Context::QUIET).expect("a motion");
    assert!(found.iter().any(names_it), "{found:?}");
    assert_eq!(recording.recovered.expect("stresses").recoveries.len(), 1);
    let (recording, found) = simulate_with_envelope(&body, &scene, &Context::QUIET).expect("a motion");
    assert!(!found.iter().any(names_it), "{found:?}");
    let recovered = recording.recovered.expect("recoveries");
    assert_eq!(recovered.recoveries.len(), 2);
    // The envelope of the points has the largest of all, and no point is below its value at an output.
    let envelope = &recovered.envelopes.as_ref().expect("envelopes")[0];
    let largest = envelope.iter().fold(0.0f64, |most, own| most.max(own.von_mises.value));
    let known = recovered.extremes[0].von_mises.expect("stresses").value;
    assert!((largest - known).abs() <= 1e-9 * known, "{largest} {known}");
    let map = &recovered.recoveries[0];
    for z in recovered.states.iter() {
        let rows = map.values(z);
        for (point, own) in map.points.iter().zip(envelope) {
            let [most, _, least] = point.principal(&rows);
            let limit = |value: f64| 1.01 * value + 1e-3 * known;
            assert!(point.von_mises(&rows) <= limit(own.von_mises.value));
            assert!(most <= limit(own.tension.value) && -least <= limit(own.compression.value));
        }
    }
}
