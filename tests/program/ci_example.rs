//! The example of continuous integration: it repeats the settings of released bodies, and fails where it should.

use crate::program::{flexbody, program};
use oracle::fixtures;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `examples/ci/check_bodies.sh` for two models, with the program of this build on the path.
fn check(place: &Path, frequency: &str) -> Output {
    let script = fixtures().join("../examples/ci/check_bodies.sh");
    let folder = program().parent().expect("a folder").to_owned();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let model = |name: &str| fixtures().join("models").join(name).join("model.toml");
    let mut run = Command::new("bash");
    run.arg(script).args(["released", "reports"]).args([model("robot_link"), model("cube_hex8")]);
    run.current_dir(place).env("PATH", path).env("FREQUENCY", frequency).output().expect("a shell")
}

#[test]
fn bodies_with_any_settings_are_made_again_and_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    fs::create_dir(place.join("released")).expect("a folder");
    let release = |name: &str, options: &[&str]| {
        let model = fixtures().join("models").join(name).join("model.toml");
        let output = format!("released/{name}.flex.h5");
        let words = ["convert", model.to_str().expect("a path"), "-o", &output, "--quiet"];
        assert!(flexbody(place, &[&words, options].concat()).status.success(), "{name}");
    };
    release("robot_link", &["--modes", "4", "--basis", "craig-bampton", "--storage", "f32"]);
    release("cube_hex8", &["--max-frequency", "20000", "--accuracy", "fast", "--frame", "principal"]);
    let run = check(place, "1e-7");
    let told = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(run.status.success() && told.matches("The bodies agree.").count() == 2, "{told}");
    // A body that cannot be compared has a test case with the reason; the other one is compared all the same.
    fs::remove_file(place.join("released/robot_link.flex.h5")).expect("removed");
    let run = check(place, "1e-7");
    assert_eq!(run.status.code(), Some(1));
    let cases = fs::read_to_string(place.join("reports/robot_link.xml")).expect("test cases");
    assert!(cases.contains("errors=\"1\"") && cases.contains("FB101"), "{cases}");
    assert!(place.join("reports/cube_hex8.xml").exists());
}
