//! A body in other units: energies, momenta, accelerations and recoveries change by their units only.

use flexbody_base::units::UnitSystem;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, LOAD_COMPONENTS, ModalMotion, Recovery, RecoveryState};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_file::in_units;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, LoadKind};
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use nalgebra::Vector3;
use oracle::file_bodies;
use oracle::flexible::{fixture, stressed};
use oracle::general::raw_fixture;
use oracle::random::Random;

/// Returns units that no fixture model uses.
fn other() -> UnitSystem {
    UnitSystem::parse("in", "lb", "ms").expect("known units")
}

/// Returns the factors of numbers of mass, length and time.
fn factors(body: &FlexBody) -> [f64; 3] {
    let (old, new) = (body.units(), other());
    [
        old.mass.to_si() / new.mass.to_si(),
        old.length.to_si() / new.length.to_si(),
        old.time.to_si() / new.time.to_si(),
    ]
}

fn worst(pairs: impl IntoIterator<Item = (f64, f64)>, size: f64) -> f64 {
    pairs.into_iter().map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max)
}

#[test]
fn equations_of_motion_keep_their_meaning() {
    let loads = [LoadKind::Spin, LoadKind::Acceleration, LoadKind::AngularAcceleration];
    for name in ["turbine_blade", "bracket_hex20", "frame_beams", "plane_frame"] {
        let mut random = Random(3);
        let mut body = fixture(name, 6, BodyFrame::Model);
        if body.geometric_stiffness().is_empty() {
            body = stressed(body, &loads, 1.0, &mut random);
        }
        let [mass, length, time] = factors(&body);
        let modal = mass.sqrt() * length;
        let in_other = in_units(&body, &other()).expect("a body");
        let (a, b) =
            (EquationsOfMotion::new(&body, Terms::ALL), EquationsOfMotion::new(&in_other, Terms::ALL));
        let (r, n) = (a.n_rigid(), a.n_velocities());
        // Unit of each entry of nu, and of the conjugate forces.
        let translations = if r == 3 { 2 } else { 3 };
        let unit = |i: usize| match i {
            i if i < translations => length / time,
            i if i < r => 1.0 / time,
            _ => modal / time,
        };
        let energy = mass * length * length / (time * time);
        // Deflections are small because the geometric stiffness is random.
        let amplitude = |j: usize| 1e-6 * body.extent() / body.largest_displacement(j);
        let q: Vec<f64> = (0..a.n_modes()).map(|j| amplitude(j) * random.signed()).collect();
        let nu: Vec<f64> = (0..n).map(|_| random.signed()).collect();
        let applied: Vec<f64> = (0..n).map(|_| random.signed()).collect();
        let (mut first, mut second) = (Evaluation::new(&a), Evaluation::new(&b));
        first.set(&q, &nu);
        let scaled = |values: &[f64], factor: &dyn Fn(usize) -> f64| -> Vec<f64> {
            values.iter().enumerate().map(|(i, v)| v * factor(i)).collect()
        };
        second.set(&scaled(&q, &|_| modal), &scaled(&nu, &unit));
        for (one, two) in [
            (first.kinetic_energy(), second.kinetic_energy()),
            (first.elastic_energy(), second.elastic_energy()),
        ] {
            assert!((one * energy / two - 1.0).abs() < 1e-11, "{name}: {one:e} {two:e}");
        }
        let mut accelerations = [vec![0.0; n], vec![0.0; n]];
        first.accelerations(&applied, &mut accelerations[0]).expect(name);
        let force = |i: usize| energy / (unit(i) * time);
        second.accelerations(&scaled(&applied, &force), &mut accelerations[1]).expect(name);
        let [one, two] = accelerations;
        let expected = scaled(&one, &|i| unit(i) / time);
        for (i, (expected, found)) in expected.iter().zip(&two).enumerate() {
            let size = one.iter().fold(0.0f64, |m, v| m.max(v.abs())) * unit(i) / time;
            assert!((expected - found).abs() < 1e-10 * size, "{name} {i}: {expected:e} {found:e}");
        }
        for (found, expected) in in_other.frequencies_hz().iter().zip(body.frequencies_hz()) {
            assert!((found / expected - 1.0).abs() < 1e-13, "{name}");
        }
    }
}

#[test]
fn interfaces_and_identities_come_along_and_the_way_back_is_the_body() {
    let model = FeModel::from_raw(raw_fixture("bracket_hex20")).expect("a body").model;
    let settings = ConvertSettings {
        modes: ModeSettings { wanted: Wanted::Lowest(4), ..ModeSettings::default() },
        basis: BasisChoice::CraigBampton(CraigBampton),
        ..ConvertSettings::default()
    };
    let body: FlexBody = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    assert!(body.coordinates().is_some() && body.interfaces().iter().any(|i| i.reference.is_some()));
    let there = in_units(&body, &other()).expect("a body");
    let failed: Vec<_> = there.identities(BodyFrame::Com).into_iter().filter(|c| !c.passed).collect();
    assert!(failed.is_empty(), "{failed:?}");
    let back = in_units(&there, body.units()).expect("a body");
    let (a, b) = (body.coordinates().expect("there"), back.coordinates().expect("there"));
    for (one, two) in [(&a.stiffness, &b.stiffness), (&a.mass, &b.mass), (&a.of_modes, &b.of_modes)] {
        let entries =
            (0..one.nrows()).flat_map(|i| (0..one.ncols()).map(move |j| (one[(i, j)], two[(i, j)])));
        assert!(worst(entries, one.norm_max()) < 1e-14);
    }
    let (a, b) = (&body.modes().shape, &back.modes().shape);
    let entries = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (a[(i, j)], b[(i, j)])));
    assert!(worst(entries, a.norm_max()) < 1e-14);
    let reference = |body: &FlexBody| body.interfaces()[0].reference.expect("a point");
    let pairs = reference(&body).into_iter().zip(reference(&back));
    assert!(worst(pairs, body.extent()) < 1e-14);
    let inches = reference(&body).map(|x| x * factors(&body)[1]);
    assert!(worst(inches.into_iter().zip(reference(&there)), there.extent()) < 1e-14);
}

/// Random bodies have columns of every kind: modes, spin, loads, named loads and forces of motion.
#[test]
fn recoveries_keep_their_values() {
    for seed in 0..8 {
        let body = file_bodies::body(seed, 3, 5, 0, 2);
        let there = in_units(&body, &other()).expect("a body");
        let [mass, length, time] = factors(&body);
        let (modal, force) = (mass.sqrt() * length, mass * length / (time * time));
        let mut random = Random(seed);
        let mut coordinates = || -> Vec<f64> { (0..body.n_modes()).map(|_| random.signed()).collect() };
        let motion = [coordinates(), coordinates(), coordinates()];
        let [w, alpha] = [(); 2].map(|()| Vector3::from_fn(|_, _| random.signed()));
        let mut load = || -> [f64; LOAD_COMPONENTS] { std::array::from_fn(|_| random.signed()) };
        let loads = [load(), load()];
        let in_other = |load: &[f64; LOAD_COMPONENTS]| -> [f64; LOAD_COMPONENTS] {
            std::array::from_fn(|a| load[a] * if a < 3 { force } else { force * length })
        };
        for (a, b) in body.recoveries().iter().zip(there.recoveries()) {
            let values = |of: &Recovery, modal: f64, time: f64, loads: &[[f64; LOAD_COMPONENTS]]| {
                let scaled = |order: usize| -> Vec<f64> {
                    motion[order].iter().map(|value| value * modal / time.powi(order as i32)).collect()
                };
                let [q, rate, acceleration] = [0, 1, 2].map(scaled);
                let motion = ModalMotion {
                    q: &q,
                    rate: &rate,
                    acceleration: &acceleration,
                    angular_velocity: w / time,
                    angular_acceleration: alpha / (time * time),
                };
                of.values(&RecoveryState { motion, loads: &loads[..of.loads.len()], named: &[0.3, -0.7] })
            };
            let expected = values(a, 1.0, 1.0, &loads);
            let found = values(b, modal, time, &loads.each_ref().map(in_other));
            assert!(worst(expected.into_iter().zip(found), 1.0) < 1e-12, "{seed}");
        }
    }
}
