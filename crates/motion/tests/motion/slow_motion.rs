//! Motions that are slow compared with the modes: long implicit steps, and the progress of runs.

use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::{Context, Event};
use flexbody_motion::scene::{LoadCases, Recording, Scene, simulate, trace, trace_at};
use nalgebra::Vector3;
use oracle::flexible::fixture;
use std::sync::Mutex;

/// Swing of 5 Hz, far below the modes of some kHz; `run` has the method.
fn swing(run: &str) -> Scene {
    let text = format!(
        "gravity = [0, 0, -9810]\n[run]\nduration = 0.2\noutputs = 20\n{run}\n[initial]\ndeformation = \"static\"\n\
         [carried]\ninterface = \"bolt_base\"\n[carried.spin]\naxis = [0, 1, 0.3]\nrate = {{ amplitude = 2, frequency = 5 }}\n\
         [[load]]\ninterface = \"bolt_wall\"\naxes = \"world\"\nforce = [0, 0, -300]\n[[watch]]\ninterface = \"bolt_wall\"\n\
         [damping]\nratio = 0.02\n"
    );
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    LoadCases::read_single(path, None).expect("a scene")
}

/// Returns the largest difference of two series relative to the largest value of the second.
fn difference(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let largest = b.iter().map(|b| b.norm()).fold(0.0, f64::max);
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / largest
}

/// The modes of a carried body are coupled by its mass matrix. Implicit steps of many periods of every mode and the
/// exponential ones of the adaptive method follow the slow motion alike; explicit steps would take 6 for each period of the
/// fastest mode.
#[test]
fn long_steps_of_a_carried_body_follow_a_slow_motion() {
    let body = fixture("bracket_hex20", 6, BodyFrame::Principal);
    let lowest = body.frequencies_hz()[0];
    let run = |scene: &Scene| -> Recording { simulate(&body, scene, &Context::QUIET).expect("a motion").0 };
    let step = 2e-3;
    assert!(step * lowest > 2.0, "several periods of the first mode ({lowest} Hz) in a step");
    let long = run(&swing(&format!("method = \"conserving\"\nstep = {step}")));
    let fine = run(&swing(""));
    let periods = 0.2 * body.frequencies_hz()[5];
    assert!((fine.work.rates as f64) < 6.0 * periods, "{:?} in {periods} periods", fine.work);
    let deflection = difference(&long.paths[0].deflection, &fine.paths[0].deflection);
    let reactions = |recording: &Recording| -> Vec<Vector3<f64>> {
        recording.reactions.as_ref().expect("a carried body").iter().map(|(force, _)| *force).collect()
    };
    let reaction = difference(&reactions(&long), &reactions(&fine));
    assert!(deflection < 1e-4 && reaction < 1e-4, "{deflection:e} and {reaction:e}");
}

/// Every run announces itself, and its fractions ascend to 1 with the simulated time.
#[test]
fn runs_report_the_part_of_the_time_that_is_simulated() {
    let body = fixture("bracket_hex20", 4, BodyFrame::Principal);
    let scene = swing("method = \"conserving\"\nstep = 2e-3");
    let heard = Mutex::new((0usize, Vec::<f64>::new()));
    let watch = |event: Event<'_>| {
        let mut heard = heard.lock().expect("no panic");
        match event {
            Event::Run => heard.0 += 1,
            Event::Fraction(part) => heard.1.push(part),
            _ => {}
        }
    };
    let context = Context::with_listener(&watch);
    let check = |what: &str| {
        let (runs, parts) = std::mem::take(&mut *heard.lock().expect("no panic"));
        assert_eq!(runs, 1, "{what}");
        assert!(parts.len() > 50 && parts.is_sorted(), "{what}: {parts:?}");
        assert_eq!(parts.last(), Some(&1.0), "{what}");
    };
    simulate(&body, &scene, &context).expect("a motion");
    check("simulate");
    let (motion, _) = trace(&body, &scene, &context).expect("a motion");
    check("trace");
    trace_at(&body, &scene, &motion.time, &context).expect("a motion");
    check("trace_at");
}
