//! Variations of a scene file equal scenes that state the changed loads themselves.

use flexbody_base::diagnostic::Code;
use flexbody_motion::scene::{LoadCases, Scene, Variations};
use nalgebra::Vector3;
use std::fs;

const SCENE: &str = "[run]\nduration = 1\n\
    [spin]\naxis = [0, 0, 1]\nrate = 10\n\
    [[load]]\nnode = 1\nforce = [1, 2, 3]\naxes = \"body\"\nhistory = { to = 1, duration = 0.5 }\n\
    [[load]]\nnode = 2\ntorque = [0, 0, 4]\n";

fn read(text: &str) -> Result<LoadCases, flexbody_base::error::Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).expect("written");
    LoadCases::read(path, None)
}

fn varied(variation: &str) -> Scene {
    let cases = read(&format!("{SCENE}[[variation]]\nname = \"v\"\n{variation}\n"));
    let cases = cases.unwrap_or_else(|error| panic!("{error}"));
    let mut all = cases.variations(3);
    assert_eq!(all.len(), 1);
    all.remove(0).scene
}

/// Returns the scene of another text with the provenance of `like`.
fn scene(text: &str, like: &Scene) -> Scene {
    let mut own = read(text).unwrap_or_else(|error| panic!("{error}"))[0].clone();
    own.source.clone_from(&like.source);
    own
}

#[test]
fn changes_equal_scenes_written_by_hand() {
    let by_hand = [
        ("scale = { factor = 2, load = 2 }", SCENE.replace("[0, 0, 4]", "[0, 0, 4]\nhistory = 2")),
        ("move = { load = 1, interface = \"tip\" }", SCENE.replace("node = 1", "interface = \"tip\"")),
        ("speed = 1.5", SCENE.replace("rate = 10", "rate = 15")),
        ("run.duration = 3", SCENE.replace("duration = 1\n", "duration = 3\n")),
        (
            "spin = { axis = [1, 0, 0], rate = 7 }",
            SCENE.replace("axis = [0, 0, 1]\nrate = 10", "axis = [1, 0, 0]\nrate = 7"),
        ),
    ];
    for (variation, text) in by_hand {
        let own = varied(variation);
        assert_eq!(own, scene(&text, &own), "{variation}");
    }
}

#[test]
fn a_turn_turns_force_and_torque_about_its_axis() {
    let own = varied("turn = { axis = [0, 0, 2], degrees = 90 }");
    let near = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-14;
    assert!(near(own.loads[0].force.at(1.0).0, Vector3::new(-2.0, 1.0, 3.0)));
    assert!(near(own.loads[1].torque.at(0.0).0, Vector3::new(0.0, 0.0, 4.0)));
    let one = varied("turn = { axis = [1, 0, 0], degrees = 180, load = 2 }");
    assert!(near(one.loads[0].force.at(1.0).0, Vector3::new(1.0, 2.0, 3.0)));
    assert!(near(one.loads[1].torque.at(0.0).0, Vector3::new(0.0, 0.0, -4.0)));
}

#[test]
fn standard_variations_stay_near_the_scene() {
    let cases = read(SCENE).expect("a scene");
    assert_eq!(*cases.stated_variations(), Variations::Standard);
    assert!(!cases.requires_variations() && cases.clone().robust().requires_variations());
    let all = cases.variations(3);
    let names: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
    // The larger part of the force is along z.
    let turned = |axis: &str| format!("loads turned by 10 degrees about {axis}");
    assert_eq!(names, [&*turned("x"), &*turned("y"), "loads larger by 10 %", "10 % faster"]);
    let force = |at: usize| all[at].scene.loads[0].force.at(1.0).0;
    let near = |at: usize, expected: [f64; 3]| {
        assert!((force(at) - Vector3::from(expected)).norm() < 1e-14, "{at}: {}", force(at));
    };
    let (sin, cos) = 10f64.to_radians().sin_cos();
    near(0, [1.0, 2.0 * cos - 3.0 * sin, 2.0 * sin + 3.0 * cos]);
    near(1, [cos + 3.0 * sin, 2.0, 3.0 * cos - sin]);
    near(2, [1.1, 2.2, 3.3]);
    near(3, [1.0, 2.0, 3.0]);
    let rate = all[3].scene.spin.as_ref().expect("a spin").velocity.at(0.0).0;
    assert!((rate.z - 11.0).abs() < 1e-13, "{rate}");
    assert_eq!(cases.variations(2).len(), 3);
    // A robust scene has the same variations, as a requirement.
    let robust = read(&format!("robust = true\n{SCENE}")).expect("a scene");
    let of_robust: Vec<String> = robust.variations(3).into_iter().map(|variation| variation.name).collect();
    assert!(robust.requires_variations() && of_robust == names);
    // A scene that was not read from a file has none.
    assert!(LoadCases::from(cases[0].clone()).variations(3).is_empty());
    // A body that only falls freely has nothing to vary.
    assert!(
        read("gravity = [0, 0, -9.81]\n[run]\nduration = 1\n").expect("a scene").variations(3).is_empty()
    );
}

#[test]
fn variations_belong_to_their_load_cases() {
    let text = format!(
        "{SCENE}[[case]]\nname = \"a\"\n[[case]]\nname = \"b\"\nspin = {{ axis = [1, 0, 0], rate = 5 }}\n\
         [[variation]]\nname = \"faster\"\nspeed = 2\n[[variation]]\nname = \"only b\"\nof = \"b\"\nscale = 3\n"
    );
    let cases = read(&text).unwrap_or_else(|error| panic!("{error}"));
    let told: Vec<(String, usize)> =
        cases.variations(3).into_iter().map(|variation| (variation.name, variation.case)).collect();
    assert_eq!(told, [("faster".to_owned(), 0), ("faster".to_owned(), 1), ("only b".to_owned(), 1)]);
    let rate = cases.variations(3)[1].scene.spin.as_ref().expect("a spin").velocity.at(0.0).0;
    assert_eq!(rate, Vector3::new(10.0, 0.0, 0.0));
}

#[test]
fn wrong_variations_are_refused_with_their_line() {
    let wrong = [
        ("speed = 0", "positive"),
        ("speed = 1", "changes nothing"),
        ("turn = { degrees = 90 }", "axis"),
        ("turn = { axis = [0, 0, 0], degrees = 90 }", "direction"),
        ("scale = \"big\"", "number"),
        ("scale = { factor = 2, load = 3 }", "load"),
        ("move = { interface = \"tip\" }", "which of 2 loads"),
        ("move = { load = 1 }", "node"),
        ("of = \"c\"\nspeed = 2", "cases"),
        ("sped = 2", "sped"),
    ];
    for (variation, expected) in wrong {
        let error = read(&format!("{SCENE}[[variation]]\nname = \"v\"\n{variation}\n")).expect_err(variation);
        let told = error.to_string();
        assert!(error.has(Code::SceneSyntax) && told.contains(expected), "{variation}: {told}");
    }
    let twice =
        format!("{SCENE}[[variation]]\nname = \"v\"\nspeed = 2\n[[variation]]\nname = \"v\"\nspeed = 3\n");
    assert!(read(&twice).expect_err("twice").has(Code::SceneContradicts));
    let ranges = "[motion]\nangular_velocity = 3\n[[variation]]\nname = \"v\"\nspeed = 2\n[spin]\naxis = [0, 0, 1]\nrate = 1\n";
    assert!(read(ranges).is_err());
}
