//! Errors of a motion relative to a reference: known errors of artificial motions, and bodies in two bases.

use faer::Mat;
use flexbody_body::basis::{BasisChoice, FreeSurface, Loads, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_linalg::{gram, multiply};
use flexbody_model::FeModel;
use flexbody_motion::dynamics::{EulerParameters, Orientation};
use flexbody_motion::scene::{
    Axes, FramedScene, History, Initial, Measure, OtherModes, OutputErrors, Resolution, Scene, Spin,
    Tolerance, Trace, VectorHistory, trace, trace_at,
};
use nalgebra::Vector3;
use oracle::flexible::soft_block;
use oracle::scenes::nothing_happens;

fn scene(duration: f64) -> Scene {
    let angular_velocity = Vector3::new(0.02, 0.1, 0.01);
    let mut scene = nothing_happens("made up", duration, 1e-9);
    scene.run.outputs = 40;
    scene.initial = Initial { angular_velocity, axes: Axes::Body, ..Initial::default() };
    scene
}

fn motion(body: &FlexBody, scene: &Scene) -> Trace {
    trace(body, scene, &Context::QUIET).expect("a motion").0
}

/// Returns the motion with other modal coordinates.
fn changed(motion: &Trace, change: impl Fn(usize, &mut Vec<f64>)) -> Trace {
    let mut other = motion.clone();
    other.q.iter_mut().enumerate().for_each(|(i, q)| change(i, q));
    other
}

/// Returns the largest of nonnegative values.
fn most(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

#[test]
fn a_motion_is_no_distance_from_itself() {
    let body = soft_block(6);
    let recording = motion(&body, &scene(30.0));
    let errors =
        Measure::new(&body, &scene(30.0), &recording).of_subset(&recording, &[0, 1, 2, 3, 4, 5]).largest();
    let none = OutputErrors { reaction: None, recovery: None, ..OutputErrors::all(Some(0.0)) };
    assert_eq!(errors, none);
    assert!(errors.within(&Tolerance::default()));
}

#[test]
fn the_attitude_is_apart_by_the_angle_of_a_turn() {
    let body = soft_block(4);
    let recording = motion(&body, &scene(30.0));
    for angle in [1e-9, 1e-3, 3.0] {
        let (sin, cos) = f64::sin_cos(0.5 * angle);
        // A rotation about the x axis of the body after its attitude; the sign of Euler parameters has no
        // meaning.
        let mut turned = recording.clone();
        for attitude in &mut turned.attitude {
            let [a, b, c, d] = attitude.0;
            let both = [a * cos - b * sin, b * cos + a * sin, c * cos + d * sin, d * cos - c * sin];
            *attitude = EulerParameters(both.map(|e| -e));
        }
        let axes = (recording.attitude[7].axes().transpose() * turned.attitude[7].axes()).trace();
        let found = Measure::new(&body, &scene(30.0), &recording)
            .of_subset(&turned, &[0, 1, 2, 3])
            .largest()
            .attitude
            .expect("an attitude");
        assert!((found - angle).abs() < 1e-15 + 1e-7 * angle, "{found} {angle}");
        assert!((axes - (1.0 + 2.0 * angle.cos())).abs() < 1e-13, "the turn is one by {angle}");
    }
}

#[test]
fn deformations_are_apart_by_their_elastic_energy_and_the_nodes_that_move_most() {
    let body = soft_block(5);
    let recording = motion(&body, &scene(30.0));
    let measure = Measure::new(&body, &scene(30.0), &recording);
    let amplitude = 1e-3;
    let other = changed(&recording, |_, q| q[2] += amplitude);
    let errors = measure.of_subset(&other, &[0, 1, 2, 3, 4]).largest();
    let most_energy = most(recording.elastic.iter().copied());
    let expected = (0.5 * body.modes().eigenvalue[2] * amplitude * amplitude / most_energy).sqrt();
    let stress = errors.stress.expect("a deformed body");
    // The motion between the evaluated times adds slightly to its largest energy.
    assert!((stress / expected - 1.0).abs() < 1e-3 && stress <= expected, "{stress} {expected}");
    // No node moves further than the one with the largest displacement along an axis.
    let shape = &body.modes().shape;
    let of_node = |q: &[f64], i: usize| {
        Vector3::from_fn(|k, _| q.iter().enumerate().map(|(j, q)| shape[(3 * i + k, j)] * q).sum::<f64>())
            .norm()
    };
    let longest = |q: &[f64]| most((0..body.n_nodes()).map(|i| of_node(q, i)));
    let largest = most(recording.q.iter().map(|q| longest(q)));
    let difference = longest(&[0.0, 0.0, amplitude, 0.0, 0.0]);
    let deflection = errors.deflection.expect("a deformed body");
    assert!(
        (deflection / (difference / largest) - 1.0).abs() < 0.05,
        "{deflection} {}",
        difference / largest
    );
}

#[test]
fn modes_that_are_not_there_are_missing() {
    let body = soft_block(5);
    let recording = motion(&body, &scene(30.0));
    let kept = [4, 1];
    let fewer = changed(&recording, |_, q| *q = kept.iter().map(|&j| q[j]).collect());
    let stress = Measure::new(&body, &scene(30.0), &recording).of_subset(&fewer, &kept).largest().stress;
    let energy = |q: &[f64], modes: &[usize]| -> f64 {
        modes.iter().map(|&j| 0.5 * body.modes().eigenvalue[j] * q[j].powi(2)).sum()
    };
    let largest = |modes: &[usize]| most(recording.q.iter().map(|q| energy(q, modes)));
    let expected = (largest(&[0, 2, 3]) / largest(&[0, 1, 2, 3, 4])).sqrt();
    assert!((stress.expect("a deformed body") / expected - 1.0).abs() < 1e-3);
}

#[test]
fn watched_points_and_reactions_count_relative_to_their_largest() {
    let body = soft_block(4);
    let spin = Spin {
        velocity: VectorHistory::Along {
            direction: Vector3::z(),
            factor: History::Sine { amplitude: 0.05, frequency: 0.1, phase: 0.0 },
        },
        axes: Axes::Body,
        start: None,
        hold: true,
    };
    let recording = motion(&body, &Scene { spin: Some(spin), ..scene(20.0) });
    let instants = recording.time.len();
    let mut other = recording.clone();
    let reactions = other.reactions.as_mut().expect("a prescribed spin");
    let largest = most(recording.reactions.iter().flatten().map(|(_, torque)| torque.norm()));
    reactions.iter_mut().for_each(|(_, torque)| torque.x += 0.02 * largest);
    let along_x = |values: Vec<f64>| values.into_iter().map(|x| Vector3::new(x, 0.0, 0.0)).collect();
    let (mut a, mut b) = (recording.clone(), other);
    a.deflections = vec![along_x(recording.time.clone()), along_x(vec![0.0; instants])];
    let tenth = recording.time.iter().map(|t| 0.1 * t).collect();
    b.deflections = vec![along_x(recording.time.clone()), along_x(tenth)];
    let history = Measure::new(&body, &scene(20.0), &a).of_subset(&b, &[0, 1, 2, 3]);
    let errors = history.largest();
    assert!((errors.reaction.expect("a reaction") - 0.02).abs() < 1e-4);
    assert!((errors.deflection.expect("a path") - 0.1).abs() < 1e-15);
    // A linearly growing error is twice as large at the end as in the middle of the run, for any distribution
    // of evaluated times.
    let grown = history.growth(&a, &Tolerance::default());
    assert!((1.8..2.1).contains(&grown.expect("an error that grows")), "{grown:?}");
    let mut tolerant = Tolerance::default();
    tolerant.errors.deflection = 2.0;
    assert_eq!(history.growth(&a, &tolerant), None);
    let mut tolerance = Tolerance::default();
    tolerance.errors.deflection = 0.05;
    assert!((errors.worst(&tolerance) - 2.0).abs() < 1e-12 && !errors.within(&tolerance));
}

#[test]
fn what_is_too_small_to_count_is_measured_against_the_least_that_counts() {
    let body = soft_block(4);
    let at_rest = Scene { initial: Initial::default(), ..scene(1.0) };
    let recording = motion(&body, &at_rest);
    let other = changed(&recording, |_, q| q[0] += 1e-20);
    let errors = Measure::new(&body, &scene(30.0), &recording).of_subset(&other, &[0, 1, 2, 3]).largest();
    // The extent of a body is measured along the axes of the model.
    let least = Resolution::new(&FramedScene::new(&body, &at_rest).expect("a stage").body, None);
    let lambda = body.modes().eigenvalue[0];
    let expected = (0.5 * lambda).sqrt() * 1e-20 / least.root_energy;
    assert!((errors.stress.expect("modes") / expected - 1.0).abs() < 1e-12);
    assert!(errors.deflection.expect("nodes") < 1e-12 && errors.reaction.is_none());
}

#[test]
fn what_is_not_a_number_is_not_within_a_tolerance() {
    let errors = OutputErrors { deflection: Some(f64::NAN), reaction: None, ..OutputErrors::all(Some(0.0)) };
    assert!(!errors.within(&Tolerance::default()));
}

/// Returns bodies of free modes alone, and with residual vectors for spin.
fn bodies(model: &FeModel) -> [FlexBody; 2] {
    let made = |count: usize, residual_vectors: Vec<Loads>| {
        let modes = ModeSettings { wanted: Wanted::Lowest(count), ..ModeSettings::default() };
        let basis = BasisChoice::Free(FreeSurface { residual_vectors });
        convert(model, &ConvertSettings { modes, basis, ..ConvertSettings::default() }, &Context::QUIET)
            .expect("converts")
            .body
    };
    [made(4, Vec::new()), made(3, vec![Loads::Centrifugal])]
}

#[test]
fn two_bases_of_one_model_are_apart_by_the_energy_of_the_difference_of_displacements() {
    let folder = oracle::fixtures().join("models/cube_hex8");
    let files = flexbody_input::read_manifest(folder.join("model.toml")).expect("a manifest");
    let raw = flexbody_input::read_model(&files).expect("a model");
    let model = FeModel::from_raw(raw).expect("a body").model;
    let [candidate, reference] = bodies(&model);
    let vectors = [&candidate, &reference].map(|body| body.vectors_of(&model).expect("its model"));
    let weighted = |vectors: &Mat<f64>| {
        let mut product = Mat::zeros(vectors.nrows(), vectors.ncols());
        multiply(model.stiffness(), 1, vectors.as_ref(), product.as_mut());
        product
    };
    let shared = gram(vectors[0].as_ref(), weighted(&vectors[1]).as_ref());
    let modes = OtherModes::new(&candidate, &reference, shared.as_ref()).expect("bodies of one model");

    let rate = reference.modes().eigenvalue[0].sqrt();
    let mut turning = scene(3.0 / rate);
    turning.initial.angular_velocity *= 0.3 * rate;
    let whole = motion(&reference, &turning);
    let recordings = [trace_at(&candidate, &turning, &whole.time, &Context::QUIET).expect("a motion"), whole];
    let found = Measure::new(&reference, &turning, &recordings[1]).of_other(&recordings[0], &modes).largest();

    // Displacements of all rows and their energy, one time after the other.
    let displacements = |which: usize, i: usize| {
        let q = &recordings[which].q[i];
        Mat::from_fn(vectors[which].nrows(), 1, |row, _| {
            q.iter().enumerate().map(|(j, q)| vectors[which][(row, j)] * q).sum::<f64>()
        })
    };
    let energy = |u: &Mat<f64>| 0.5 * gram(u.as_ref(), weighted(u).as_ref())[(0, 0)];
    let largest = |of: &dyn Fn(usize) -> f64| most((0..recordings[1].time.len()).map(of));
    let expected = (largest(&|i| energy(&(displacements(0, i) - displacements(1, i))))
        / largest(&|i| energy(&displacements(1, i))))
    .sqrt();
    let stress = found.stress.expect("a deformed body");
    assert!(expected > 1e-3, "residual vectors matter here: {expected}");
    assert!((stress / expected - 1.0).abs() < 1e-3, "{stress} {expected}");
    // A basis has zero distance from itself, to the square root of the rounding in K.
    let own = gram(vectors[1].as_ref(), weighted(&vectors[1]).as_ref());
    let itself = OtherModes::new(&reference, &reference, own.as_ref()).expect("one body");
    let errors =
        Measure::new(&reference, &turning, &recordings[1]).of_other(&recordings[1], &itself).largest();
    assert!(errors.stress.expect("a deformed body") < 1e-6 && errors.attitude == Some(0.0));
}
