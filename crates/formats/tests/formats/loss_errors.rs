//! Errors that an export states for losses which motion causes, beside those of the body that is read back from the
//! exported file: the stiffness of both under the same motions, from their equations of motion.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, relative_norm};
use flexbody_formats::export::{AllowedLosses, ExportOptions, Loss, Points};
use flexbody_formats::import::import_body;
use flexbody_formats::{export, find_format, find_import_format, motion_of_losses};
use flexbody_linalg::context::Context;
use flexbody_linalg::symmetric_eigen;
use flexbody_model::RigidAcceleration;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use flexbody_motion::scene::{Axes, FrameMotion, History, Load, Point, Scene, VectorHistory};
use nalgebra::{Matrix3, Vector3};
use oracle::flexible::fixture;
use oracle::scenes::nothing_happens;
use std::path::Path;

const MODES: usize = 6;

fn exported(body: &FlexBody, format: &str, options: &ExportOptions) -> FlexBody {
    let format = find_format(format).expect("a format");
    let (exported, _) = export(body, format, options, true).expect("written");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.file");
    std::fs::write(&path, &exported.file).expect("a place");
    let file = InputFile::open(&path).expect("readable");
    let read = find_import_format(format.name()).expect("a reader").read(&file).expect("its file");
    let source = SourceFile::new("body", Path::new("body.file"), "0".repeat(64));
    import_body(&read, source, UnitSystem::default(), None).expect("a body").body
}

/// Returns the stiffness of small deformations of a body whose frame moves: the derivative of the forces of the modes by
/// the modal coordinates, in which the equations are quadratic.
fn stiffness(body: &FlexBody, motion: &RigidAcceleration, omega: &Vector3<f64>) -> Mat<f64> {
    let nf = body.n_modes();
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let mut evaluation = Evaluation::new(&equations);
    let mut velocities = vec![0.0; 6 + nf];
    let mut accelerations = vec![0.0; 6 + nf];
    (0..3).for_each(|k| {
        velocities[3 + k] = omega[k];
        (accelerations[k], accelerations[3 + k]) = (motion.linear[k], motion.angular[k]);
    });
    // Amplitudes with the energy of unit stiffness: the forces have equal rounding.
    let step: Vec<f64> = body.modes().eigenvalue.iter().map(|lambda| 1e-3 / lambda.sqrt()).collect();
    let mut forces = |j: usize, sign: f64| {
        let mut q = vec![0.0; nf];
        q[j] = sign * step[j];
        evaluation.set(&q, &velocities);
        let mut forces = vec![0.0; 6 + nf];
        evaluation.balance(&accelerations, &mut forces);
        forces.split_off(6)
    };
    let columns: Vec<[Vec<f64>; 2]> = (0..nf).map(|j| [forces(j, 1.0), forces(j, -1.0)]).collect();
    let entry = |i: usize, j: usize| (columns[j][0][i] - columns[j][1][i]) / (2.0 * step[j]);
    Mat::from_fn(nf, nf, |i, j| 0.5 * (entry(i, j) + entry(j, i)))
}

/// Returns directions all around.
fn directions() -> Vec<Vector3<f64>> {
    let steps = -2..=2;
    let all = steps.clone().flat_map(|x| steps.clone().flat_map(move |y| (-2..=2).map(move |z| [x, y, z])));
    let vectors = all.map(|v| Vector3::from(v.map(f64::from))).filter(|v| v.norm() > 0.0);
    vectors.map(|v| v.normalize()).collect()
}

/// Motions of one kind in all directions, as a load case has them.
struct Motions {
    omegas: Vec<Vector3<f64>>,
    motion: Vec<RigidAcceleration>,
}

impl Motions {
    fn new(kind: usize, size: f64) -> Self {
        let zero = Vector3::zeros();
        let omegas = directions().into_iter().map(|v| if kind == 0 { v * size } else { zero }).collect();
        let of = |v: Vector3<f64>| match kind {
            0 => RigidAcceleration::new(zero, zero, &(v * size)),
            1 => RigidAcceleration { linear: v * size, angular: zero, spin: Matrix3::zeros() },
            _ => RigidAcceleration { linear: zero, angular: v * size, spin: Matrix3::zeros() },
        };
        Self { omegas, motion: directions().into_iter().map(of).collect() }
    }

    /// Returns the largest changes of a stiffness relative to that of the body at rest, and of a frequency, from the body
    /// to the one that was read back.
    fn measured(&self, body: &FlexBody, back: &FlexBody) -> [f64; 2] {
        let own = body.invariants().modal_stiffness();
        let mut largest = [0.0f64; 2];
        for (motion, omega) in self.motion.iter().zip(&self.omegas) {
            let pair = [stiffness(body, motion, omega), stiffness(back, motion, omega)];
            let lost = &pair[0] - &pair[1];
            let share = relative_norm(lost.as_ref(), own.as_ref()).expect("a stiff body");
            let [a, b] = pair.map(|k| symmetric_eigen(k.as_ref()).expect("finite").values);
            let change = a.iter().zip(&b).map(|(a, b)| ((a / b).sqrt() - 1.0).abs()).fold(0.0, f64::max);
            largest = [largest[0].max(share), largest[1].max(change)];
        }
        largest
    }
}

/// Returns the two percentages of a loss in a scene, as parts.
fn stated(loss: &Loss) -> [f64; 2] {
    let parts: Vec<f64> =
        loss.text.split(" %").filter_map(|part| part.rsplit(' ').next()?.parse().ok()).collect();
    <[f64; 2]>::try_from(parts).unwrap_or_else(|_| panic!("{}", loss.text)).map(|percent| 0.01 * percent)
}

/// The stated errors of all losses of a motion together bound those of the file, and the largest change of a deflection is
/// at most twice as large.
#[test]
fn stated_errors_are_those_of_the_body_in_the_file() {
    let mut compared = 0;
    for name in ["frame_beams", "shell_folded"] {
        let body = fixture(name, MODES, BodyFrame::Principal);
        let rates = body.inertia_rates(0.02).expect("turning nodes");
        let spin = rates.spin_hz.expect("a spin") * std::f64::consts::TAU / body.units().hertz();
        let sizes = [spin, rates.acceleration.expect("one"), rates.angular_acceleration.expect("one")];
        for format in ["exudyn", "mbsim"] {
            let plain = ExportOptions { points: Points::Nodes, ..ExportOptions::default() };
            let back = exported(&body, format, &plain);
            for (kind, size) in sizes.into_iter().enumerate() {
                let motions = Motions::new(kind, size);
                let case = FrameMotion {
                    scene: "turn".into(),
                    body: body.clone(),
                    motion: motions.motion.clone(),
                    run: None,
                };
                let options = ExportOptions { in_scene: vec![case], ..plain.clone() };
                let checklist = find_format(format).expect("a format").checklist(&body, &options);
                let losses =
                    checklist.losses().into_iter().filter(|loss| loss.text.contains("deflections change"));
                let stated: Vec<[f64; 2]> = losses.map(|loss| stated(&loss)).collect();
                let sum = [0, 1].map(|k| stated.iter().map(|own| own[k]).sum::<f64>());
                let measured = motions.measured(&body, &back);
                println!("{name} {format} motion {kind}: stated {stated:?}, measured {measured:?}");
                assert!(sum[0] > 0.01, "{name} {format} {kind}: {stated:?}");
                // Losses may cancel in part, and half the change of a deflection bounds that of a frequency, whichever
                // the shape of its mode.
                for (k, least) in [0.5, 0.4].into_iter().enumerate() {
                    let largest = stated.iter().map(|own| own[k]).fold(0.0, f64::max);
                    // Texts have two digits.
                    assert!(measured[k] < 1.06 * sum[k], "{name} {format} {kind}: {measured:?} {stated:?}");
                    assert!(measured[k] > least * largest, "{name} {format} {kind}: {measured:?} {stated:?}");
                }
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 12);
}

/// Without a scene the file is written with warnings, and with one whose errors are large it is not.
#[test]
fn files_of_frames_are_written_unless_a_scene_makes_their_losses_large() {
    let body = fixture("frame_beams", MODES, BodyFrame::Principal);
    let rates = body.inertia_rates(0.01).expect("turning nodes");
    let one_percent = rates.spin_hz.expect("a spin") * std::f64::consts::TAU / body.units().hertz();
    let case = |part: f64| {
        let motion = Motions::new(0, one_percent * (part / 0.01).sqrt()).motion;
        ExportOptions {
            in_scene: vec![FrameMotion { scene: "spin".into(), body: body.clone(), motion, run: None }],
            ..ExportOptions::default()
        }
    };
    for format in ["exudyn", "mbsim", "mbdyn"] {
        let format = find_format(format).expect("a format");
        let written =
            |options: &ExportOptions, allowed: AllowedLosses| export(&body, format, options, allowed);
        let (plain, found) = written(&ExportOptions::default(), AllowedLosses::None).expect("written");
        let texts: Vec<&str> = found.iter().map(|diagnostic| diagnostic.message()).collect();
        assert!(texts.iter().any(|text| text.contains("changes deflections by 1 %")), "{texts:?}");
        let (slow, found) = written(&case(0.005), AllowedLosses::None).expect("written");
        assert!(plain == slow && found.iter().any(|one| one.message().contains("in the scene `spin`")));
        if format.name() != "mbdyn" {
            let error = written(&case(0.2), AllowedLosses::None).expect_err("a large error");
            assert!(
                error.to_string().contains("in the scene `spin` deflections change by at most"),
                "{error}"
            );
            let (fast, _) = written(&case(0.2), AllowedLosses::All).expect("allowed");
            assert!(plain == fast);
        }
        // Names are all that may be lost.
        let named = AllowedLosses::named(vec!["damping".into()]).expect("a name");
        assert!(written(&ExportOptions::default(), named).is_err());
    }
}

/// Returns what an export says of a loss in a scene: the message, and true if the file is written without permission.
fn in_scene(body: &FlexBody, format: &str, scene: &Scene, property: &str) -> (String, bool) {
    let format = find_format(format).expect("a format");
    let plain = ExportOptions::default();
    let cases = scene.clone().into();
    let in_scene = motion_of_losses(body, format, &plain, &cases, &Context::QUIET).expect("a motion");
    let options = ExportOptions { in_scene, ..plain };
    let losses = format.checklist(body, &options).losses();
    let loss = losses.into_iter().find(|loss| loss.property == property).expect("a loss");
    assert!(loss.text.contains("in the scene `losses` deflections change by"), "{}", loss.text);
    (loss.text, loss.is_slight)
}

/// Properties whose loss no motion of the frame bounds are judged by the motion of the body without them: damping hardly
/// changes slow deflections and limits those at resonance; the inertia of the deformed body matters if the body turns.
#[test]
fn other_losses_are_judged_by_the_motion_without_them() {
    let mut parts = fixture("bracket_hex20", MODES, BodyFrame::Com).into_parts();
    parts.modes.damping_ratio.fill(0.02);
    let body = FlexBody::new(parts).expect("a body");
    let first = body.modes().eigenvalue[0].sqrt() / std::f64::consts::TAU;
    let size = 1e-7 * body.extent() * body.invariants().mass() * body.modes().eigenvalue[0];
    let pushed = |frequency: f64, spin: f64| {
        let mut scene = nothing_happens("losses", 20.0 / first, 1e-9);
        scene.initial.angular_velocity = Vector3::x() * spin;
        scene.loads = vec![Load {
            at: Point::Node(body.nodes().ids[0]),
            force: VectorHistory::Along {
                direction: Vector3::z() * size,
                factor: History::Sine { amplitude: 1.0, frequency, phase: 0.0 },
            },
            torque: VectorHistory::nothing(),
            axes: Axes::Body,
        }];
        scene
    };
    let (text, written) = in_scene(&body, "openradioss", &pushed(0.02 * first, 0.0), "damping");
    assert!(written, "{text}");
    let (text, written) = in_scene(&body, "openradioss", &pushed(first, 0.0), "damping");
    assert!(!written, "{text}");
    let (text, written) = in_scene(&body, "openradioss", &pushed(0.02 * first, 0.0), "deformed-inertia");
    assert!(written, "{text}");
    let fast = 0.3 * std::f64::consts::TAU * first;
    let (text, written) = in_scene(&body, "openradioss", &pushed(0.02 * first, fast), "deformed-inertia");
    assert!(!written, "{text}");
    // Without a scene the warning states the frequency from which the load would have to oscillate: 0.87 of the first.
    let losses =
        find_format("openradioss").expect("a format").checklist(&body, &ExportOptions::default()).losses();
    let loss = losses.iter().find(|loss| loss.property == "damping").expect("a loss");
    let hertz = loss.text.split("from ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
    let part = hertz.expect("a frequency") / (body.units().frequency_of(body.modes().eigenvalue[0]));
    let response = |damped: f64| ((1.0 - part * part).powi(2) + damped * (2.0 * 0.02 * part).powi(2)).sqrt();
    assert!(loss.is_slight && (response(1.0) / response(0.0) - 1.01).abs() < 1e-3, "{part}: {}", loss.text);
}

/// The loader of Exudyn ignores the damping of the file, so a note refers to the program beside it; the help of a loss names the
/// formats that hold the property, and the option that measures its effect or allows it.
#[test]
fn advice_names_the_program_and_the_formats_that_hold_a_property() {
    let mut parts = fixture("bracket_hex20", MODES, BodyFrame::Com).into_parts();
    parts.modes.damping_ratio.fill(0.02);
    let body = FlexBody::new(parts).expect("a body");
    let to = |name: &str, allowed: bool| {
        export(&body, find_format(name).expect("a format"), &ExportOptions::default(), allowed)
    };
    let (exported, found) = to("exudyn", true).expect("written");
    let [need] = &found[..] else { panic!("{found:?}") };
    assert!(need.code() == Code::ExportNeeds && need.message().contains("`add_body`"), "{need}");
    let (name, program) = &exported.beside[0];
    let program = String::from_utf8_lossy(program);
    assert!(
        name == "_exudyn.py" && program.contains("def add_body(") && program.contains("dampingMatrixReduced")
    );
    let (_, found) = to("openradioss", true).expect("written");
    let lost = found.iter().find(|one| one.message().ends_with("(damping)")).expect("a loss");
    let formats = "exudyn, sid, mbdyn, mbsim, chrono, simscape, npz, json, embedded";
    assert_eq!(
        lost.help(),
        format!(
            "give --scene SCENE to measure the effect in your motion, or export to a format that holds it: {formats}"
        )
    );
    let refused = to("openradioss", false).expect_err("the inertia of the deformed body is lost");
    let help = refused.diagnostics()[0].help();
    assert!(
        help.starts_with("write the file without it by --allow-loss=deformed-inertia, or export"),
        "{help}"
    );
}
