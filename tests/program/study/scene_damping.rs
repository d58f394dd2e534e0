//! Damping of bodies and scenes: precedence if both state damping, and bodies made for a scene do not keep
//! the damping of the scene.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_body::convert::ConvertSettings;
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{Damping, FeModel};
use flexbody_motion::integration::free_oscillation;
use flexbody_motion::scene::{LoadCases, Scene, simulate};
use flexbody_study::tailoring::Tailoring;
use oracle::fixtures;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const SHAKEN: &str = "[run]\nduration = 0.004\noutputs = 50\n[band]\nfrequency = 9000\n[[load]]\ninterface = \"bolt_wall\"\n\
     force = [0, 20, 0]\naxes = \"body\"\nhistory = { amplitude = 1, frequency = 300 }\n[[watch]]\ninterface = \"bolt_base\"\n";

/// Creates a folder with the bracket with `damping` at the end of its manifest, its body with eight modes,
/// and scenes: `plain.toml`, `own.toml` with a damping ratio and `replacing.toml` with a ratio that replaces
/// another.
fn folder(damping: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let model = fixtures().join("models/bracket_hex20");
    for entry in fs::read_dir(&model).expect("a model") {
        let entry = entry.expect("an entry");
        fs::copy(entry.path(), place.join(entry.file_name())).expect("copied");
    }
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    fs::write(place.join("model.toml"), format!("{manifest}\n{damping}")).expect("written");
    for (name, text) in [
        ("plain.toml", ""),
        ("own.toml", "[damping]\nratio = 0.03\n"),
        ("replacing.toml", "[damping]\nratio = 0.03\nreplace = true\n"),
    ] {
        fs::write(place.join(name), format!("{SHAKEN}{text}")).expect("written");
    }
    let words =
        ["convert", "model.toml", "--modes", "8", "-o", "body.flex.h5", "--lumped", "none", "--quiet"];
    assert!(flexbody(place, &words).status.success());
    folder
}

fn scene(place: &Path, name: &str) -> Scene {
    LoadCases::read_single(place.join(name), None).expect("a scene")
}

fn body(place: &Path) -> FlexBody {
    flexbody_file::read(place.join("body.flex.h5")).expect("a body")
}

const RAYLEIGH: &str = "[damping]\nrayleigh = { alpha = 900.0, beta = 2e-7 }\n";

#[test]
fn a_simulation_takes_one_damping() {
    let (damped, bare) = (folder(RAYLEIGH), folder(""));
    let q = |place: &Path, name: &str| {
        simulate(&body(place), &scene(place, name), &Context::QUIET)
            .map(|(recording, _)| recording.states.into_iter().map(|state| state.q).collect::<Vec<_>>())
    };
    let error = q(damped.path(), "own.toml").expect_err("two dampings");
    assert!(error.has(Code::SceneDamping), "{error}");
    assert!(error.to_string().contains("replace = true"), "{error}");
    let replaced = q(damped.path(), "replacing.toml").expect("one damping");
    assert_eq!(replaced, q(bare.path(), "own.toml").expect("one damping"));
    assert_eq!(replaced, q(bare.path(), "replacing.toml").expect("one damping"));
    let own = q(damped.path(), "plain.toml").expect("one damping");
    assert_ne!(own, replaced);
    assert_ne!(own, q(bare.path(), "plain.toml").expect("none"));
}

#[test]
fn every_command_refuses_two_dampings_and_takes_one_that_replaces() {
    for damping in [RAYLEIGH, "[damping]\nratio = 0.02\n"] {
        let folder = folder(damping);
        let place = folder.path();
        for command in [
            "simulate body.flex.h5 -o run.h5",
            "select body.flex.h5",
            "select model.toml --modes 8",
            "trade body.flex.h5 --repeat 1",
            "convert model.toml --modes 8 -o made.flex.h5 --lumped none",
            "convert model.toml --modes 8 --basis scene -o made.flex.h5 --lumped none",
            "response body.flex.h5 --points 20",
            "response model.toml --modes 8 --points 20 --solves 2",
        ] {
            for (name, is_taken) in [("own.toml", false), ("replacing.toml", true), ("plain.toml", true)] {
                let words: Vec<&str> = command.split(' ').chain(["--scene", name, "--quiet"]).collect();
                let run = flexbody(place, &words);
                let told = String::from_utf8_lossy(&run.stderr);
                assert_eq!(told.contains("error[FB225]"), !is_taken, "{command} {name}: {told}");
                if is_taken {
                    assert!(matches!(run.status.code(), Some(0 | 1)), "{command} {name}: {told}")
                } else {
                    assert_eq!(run.status.code(), Some(2), "{command}: {told}")
                }
            }
        }
        let words = ["response", "body.flex.h5", "--scene", "plain.toml", "--damping", "0.01", "--quiet"];
        let run = flexbody(place, &words);
        assert_eq!(run.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&run.stderr).contains("error[FB225]"));
    }
}

#[test]
fn a_body_keeps_the_damping_of_its_model_alone() {
    for (damping, name) in [("", "own.toml"), (RAYLEIGH, "replacing.toml"), (RAYLEIGH, "plain.toml")] {
        let folder = folder(damping);
        let place = folder.path();
        for basis in ["free", "scene"] {
            let words = ["convert", "model.toml", "--modes", "8", "--basis", basis, "-o", "made.flex.h5"];
            let more = ["--lumped", "none", "--quiet", "--scene", name];
            let run = flexbody(place, &[&words[..], &more].concat());
            let told = String::from_utf8_lossy(&run.stderr);
            assert!(run.status.success(), "{told}");
            let made = flexbody_file::read(place.join("made.flex.h5")).expect("a body");
            assert!(basis == "free" || made.n_modes() < 5, "shapes of the motion: {told}");
            let modes = made.modes();
            if damping.is_empty() {
                assert_eq!(
                    (&modes.modal_damping, modes.damping_ratio.iter().copied().fold(0.0, f64::max)),
                    (&None, 0.0)
                );
                continue;
            }
            // Damping alpha M + beta K of the modes.
            for (ratio, lambda) in modes.damping_ratio.iter().zip(&modes.eigenvalue) {
                let expected = 0.5 * (900.0 / lambda.sqrt() + 2e-7 * lambda.sqrt());
                assert!((ratio / expected - 1.0).abs() < 1e-6, "{basis} {name}: {ratio} {expected}");
            }
        }
    }
}

/// The errors of the body are estimated with the damping of the scene that replaces that of the model.
#[test]
fn estimates_take_the_damping_that_replaces_that_of_the_model() {
    let folder = folder("");
    let place = folder.path();
    let raw = read_model(&read_manifest(place.join("model.toml")).expect("a manifest")).expect("a model");
    let scene = scene(place, "replacing.toml");
    let mut settings = ConvertSettings { lumped: Vec::new(), ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(8);
    let lacks = |damping: Option<Damping<_>>| -> Vec<f64> {
        let model = FeModel::from_raw(raw.clone().with(|data| data.damping = damping)).expect("sound").model;
        let tailoring = Tailoring { settings: settings.clone(), by_band: false, of_motion: false };
        let made = tailoring.convert(&model, &scene.clone().into(), &Context::QUIET).expect("a body");
        made.rounds[0].iter().map(|round| round.worst).collect()
    };
    let bare = lacks(None);
    assert!(!bare.is_empty());
    assert_eq!(lacks(Some(Damping::Rayleigh { alpha: 4e3, beta: 1e-5 })), bare);
    assert_eq!(lacks(Some(Damping::Ratio(0.3))), bare);
}

/// Bands of 1, 10 and 100 % and one ratio above critical damping: free modes decay like the closed form,
/// including overdamped ones; exports hold the damping.
#[test]
fn bands_and_ratios_beyond_the_critical_damping_are_those_of_the_modes() {
    let folder = folder("");
    let place = folder.path();
    let hertz = body(place).frequencies_hz();
    let (first, second) = (0.5 * (hertz[0] + hertz[1]), 0.5 * (hertz[2] + hertz[3]));
    let bands = format!(
        "bands = [{{ to_hz = {first}, ratio = 0.01 }}, {{ to_hz = {second}, ratio = 0.1 }}, {{ ratio = 1 }}]"
    );
    let (amplitude, duration) = (1e-9, 0.002);
    // Times the tolerance of the scene: with tolerances of 1e-8 to 1e-11 the steps happen to give 2 to 2500 at an overdamped
    // mode, whose two rates are 34 times apart.
    const BOUND: f64 = 10_000.0 * 1e-10;
    for (damping, ratio_of) in [
        (bands.as_str(), [0.01, 0.1, 0.1, 1.0, 1.0, 1.0, 1.0, 1.0]),
        ("ratio = 3.0", [3.0; 8]),
        ("bands = [{ ratio = 0.5 }]", [0.5; 8]),
    ] {
        let modes: String = (1..=8)
            .map(|number| format!("[[initial.mode]]\nnumber = {number}\namplitude = {amplitude}\n"))
            .collect();
        let text = format!(
            "[run]\nduration = {duration}\noutputs = 20\ntolerance = 1e-10\n{modes}[damping]\n{damping}\n"
        );
        fs::write(place.join("fades.toml"), text).expect("written");
        let (recording, _) =
            simulate(&body(place), &scene(place, "fades.toml"), &Context::QUIET).expect("a motion");
        for (time, state) in recording.time.iter().zip(&recording.states) {
            for (j, (lambda, ratio)) in body(place).modes().eigenvalue.iter().zip(ratio_of).enumerate() {
                let decay = ratio * lambda.sqrt();
                let [c, s] = free_oscillation(*lambda, decay, *time);
                let expected = amplitude * (c + s * decay);
                let error = (state.q[j] - expected).abs() / amplitude;
                assert!(error < BOUND, "{damping}: mode {} at {}: {error:e}", j + 1, time);
            }
        }
    }
    // Damping in the file of the model gives the same ratios.
    let damped = self::folder(&format!("[damping]\n{bands}\n"));
    let place = damped.path();
    let own = body(place);
    assert_eq!(own.modes().damping_ratio, [0.01, 0.1, 0.1, 1.0, 1.0, 1.0, 1.0, 1.0]);
    for (format, file) in
        [("mbdyn", "b.fem"), ("sid", "b.SID_FEM"), ("json", "b.json"), ("embedded", "b.bin")]
    {
        let words = ["export", "body.flex.h5", "--to", format, "-o", file, "--quiet"];
        let run = flexbody(place, &words);
        assert!(run.status.success(), "{format}: {}", String::from_utf8_lossy(&run.stderr));
    }
    for format in ["mbdyn", "sid"] {
        let file = if format == "mbdyn" { "b.fem" } else { "b.SID_FEM" };
        let words = ["convert", file, "--from", format, "--units", "mm,t,s", "-o", "back.flex.h5", "--quiet"];
        let run = flexbody(place, &words);
        assert!(run.status.success(), "{format}: {}", String::from_utf8_lossy(&run.stderr));
        let back = flexbody_file::read(place.join("back.flex.h5")).expect("a body");
        for (found, given) in back.modes().damping_ratio.iter().zip(&own.modes().damping_ratio) {
            assert!((found / given - 1.0).abs() < 1e-6, "{format}: {found} {given}");
        }
    }
    let words = [
        "response",
        "body.flex.h5",
        "--band",
        "0..9000",
        "--from",
        "bolt_wall",
        "--to",
        "bolt_base",
        "--quiet",
    ];
    assert!(
        flexbody(self::folder("").path(), &[&words[..], &["--damping", "1.5"]].concat()).status.success()
    );
}
