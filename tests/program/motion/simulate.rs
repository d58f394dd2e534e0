//! Command `flexbody simulate`: its output agrees with the library and is reproducible.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::Terms;
use flexbody_motion::scene::{LoadCases, simulate};
use hdf5_metno as hdf5;
use nalgebra::Vector3;
use oracle::fixtures;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

fn done(folder: &Path, words: &[&str]) -> Output {
    let run = flexbody(folder, words);
    assert!(run.status.success(), "{words:?}: {}", String::from_utf8_lossy(&run.stderr));
    run
}

/// Creates a folder with `body.flex.h5` of a model of the fixtures.
fn folder_with(model: &str, modes: usize) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = fixtures().join("models").join(model).join("model.toml");
    let modes = modes.to_string();
    let words = ["convert", manifest.to_str().unwrap(), "--modes", &modes, "-o", "body.flex.h5", "--quiet"];
    done(folder.path(), &words);
    folder
}

fn scene(folder: &Path, text: &str) {
    fs::write(folder.join("scene.toml"), text).expect("written");
}

/// Returns head and rows of a table.
fn table(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    let head = lines.next().expect("a head").split(',').map(str::to_owned).collect();
    let numbers = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    (head, lines.map(numbers).collect())
}

#[test]
#[ignore = "slow"]
fn scenes_of_the_fixtures_fit_their_schema_and_run() {
    let schema: Value =
        serde_json::from_str(include_str!("../../../schemas/scene.schema.json")).expect("a schema");
    let schema = jsonschema::validator_for(&schema).expect("a schema");
    let scenes = [
        ("tumbling", "bracket_hex20"),
        ("spin_up", "connecting_rod"),
        ("connecting_rod_8000rpm", "connecting_rod"),
        ("connecting_rod_run", "connecting_rod"),
        ("car_frame_road", "car_frame"),
        ("car_frame_cases", "car_frame"),
        ("satellite_tumbling", "satellite"),
        ("turbine_blade_runup", "turbine_blade"),
        ("mems_gyroscope", "mems_gyroscope"),
        ("robot_link", "robot_link"),
        ("robot_link_slow", "robot_link"),
        ("gear_disc", "gear_disc"),
        ("conveyor_plate", "conveyor_plate"),
        ("block_79_periods", "cube_hex8"),
    ];
    let files = fs::read_dir(fixtures().join("scenes")).expect("scenes");
    let files = files
        .filter(|file| file.as_ref().expect("a file").path().extension().is_some_and(|e| e == "toml"))
        .count();
    assert_eq!(files, scenes.len(), "every scene has its model");
    for (file, model) in scenes {
        let path = fixtures().join("scenes").join(file).with_extension("toml");
        let text = fs::read_to_string(&path).expect("a scene");
        let json = serde_json::to_value(toml::from_str::<toml::Table>(&text).expect("TOML")).expect("JSON");
        assert!(schema.is_valid(&json), "{file}");
        let folder = folder_with(model, 6);
        let run =
            done(folder.path(), &["simulate", "body.flex.h5", "--scene", path.to_str().unwrap(), "--json"]);
        let results = serde_json::from_slice::<Value>(&run.stdout).expect("JSON")["results"].take();
        // A scene with several load cases reports facts of each.
        let cases = results["cases"].as_array().map_or(std::slice::from_ref(&results), Vec::as_slice);
        for facts in cases {
            for drift in ["linear_momentum_drift", "angular_momentum_drift", "energy_drift"] {
                assert!(facts[drift].as_f64().expect("a number") < 1e-7, "{file}: {facts:#}");
            }
            assert!(facts["largest_deflection"].as_f64().expect("a number") < 0.1, "{file}: {facts:#}");
        }
    }
}

/// A drive motion a cos(w1 t) and a steady spin excite the sense mode by the Coriolis force alone, 2 spin W3
/// a w1 sin(w1 t).
#[test]
fn the_gyroscope_senses_its_rate() {
    let folder = folder_with("mems_gyroscope", 6);
    let text = fs::read_to_string(fixtures().join("scenes/mems_gyroscope.toml")).expect("a scene");
    let steady = text.replace("rate = { to = 8.7e-6, duration = 500 }", "rate = 8.7e-6");
    assert_ne!(steady, text);
    scene(folder.path(), &steady);
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let described = LoadCases::read_single(folder.path().join("scene.toml"), None).expect("a scene");
    let (recording, _) = simulate(&body, &described, &Context::QUIET).expect("a motion");
    let (drive, sense) = (1, 2);
    let [w1, w2] = [drive, sense].map(|j| body.modes().eigenvalue[j].sqrt());
    let coupling = body.invariants().w3().expect("held")[(2 * body.n_modes() + drive, sense)];
    assert!(coupling.abs() > 0.95, "both move the whole mass: {coupling}");
    let size = 2.0 * 8.7e-6 * coupling * 0.002 * w1 / (w2 * w2 - w1 * w1);
    for (t, state) in recording.time.iter().zip(&recording.states) {
        let expected = size * ((w1 * t).sin() - w1 / w2 * (w2 * t).sin());
        // The expected motion is of first order in the spin; the reaction of the sense motion on the drive is
        // neglected.
        let error = (state.q[sense] - expected).abs() / size.abs();
        assert!(error < 1e-3, "at {t} us: {}, expected {expected}", state.q[sense]);
    }
}

#[test]
fn files_hold_what_the_library_computes_and_are_the_same_every_time() {
    let folder = folder_with("bracket_hex20", 5);
    let place = folder.path();
    scene(
        place,
        "[run]\nduration = 0.002\noutputs = 40\n[initial]\nangular_velocity = [30, 900, 10]\n\
         mode = [{ number = 2, amplitude = 1e-4, rate = 3 }]\n[[watch]]\nnode = 20000\n[[watch]]\ninterface = \"bolt_base\"\n",
    );
    let files = ["motion.h5", "motion.csv", "motion.json", "motion.txt", "motion.html"];
    let run = |into: &Path| {
        let body = place.join("body.flex.h5");
        let scene = place.join("scene.toml");
        let mut words = vec!["simulate", body.to_str().unwrap(), "--scene", scene.to_str().unwrap()];
        words.extend(["-o", files[0], "--csv", files[1]]);
        files[2..].iter().for_each(|file| words.extend(["--report", file]));
        done(into, &words);
    };
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(first.path());
    run(second.path());
    for file in &files[..2] {
        let [a, b] = [&first, &second].map(|folder| fs::read(folder.path().join(file)).expect("a file"));
        assert!(a == b, "{file} differs between runs");
    }

    let body = flexbody_file::read(place.join("body.flex.h5")).expect("a body");
    let described = LoadCases::read_single(place.join("scene.toml"), None).expect("a scene");
    let (recording, _) = simulate(&body, &described, &Context::QUIET).expect("a motion");
    assert_eq!(recording.time.len(), 41);
    let file = hdf5::File::open(first.path().join("motion.h5")).expect("HDF5");
    let array = |name: &str| file.dataset(name).expect(name).read_raw::<f64>().expect("numbers");
    let flat = |of: fn(&flexbody_motion::dynamics::Configuration) -> Vec<f64>| -> Vec<f64> {
        recording.states.iter().flat_map(of).collect()
    };
    assert_eq!(array("time"), recording.time);
    assert_eq!(array("frame/attitude"), flat(|s| s.attitude.0.to_vec()));
    assert_eq!(array("frame/angular_velocity"), flat(|s| s.omega.as_slice().to_vec()));
    assert_eq!(array("modes/q"), flat(|s| s.q.clone()));
    assert_eq!(array("modes/qd"), flat(|s| s.qd.clone()));
    assert_eq!(file.dataset("modes/q").unwrap().shape(), [41, 5]);
    // Tables of scenes with one mode are matrices too.
    let one = body.reduced(&[0], body.groups(), Vec::new()).expect("a mode");
    let mut of_one_mode = described.clone();
    of_one_mode.initial.modes.clear();
    let (recorded, _) = simulate(&one, &of_one_mode, &Context::QUIET).expect("a motion");
    let single = place.join("single.h5");
    let slot = flexbody_file::OutputSlot::prepare(&single).expect("a place");
    flexbody_file::fill_simulation(&recorded, one.units(), &slot).expect("written");
    slot.commit().expect("in its place");
    let of_one = hdf5::File::open(&single).expect("HDF5");
    for name in ["modes/q", "modes/qd"] {
        assert_eq!(of_one.dataset(name).unwrap().shape(), [41, 1], "{name}");
    }
    assert_eq!(of_one.dataset("energy/work").unwrap().shape(), [41]);
    of_one.close().expect("closed");
    let read = flexbody_file::read_simulation(&single).expect("readable");
    assert_eq!((read.modes, read.q.len()), (1, 41));
    let places: Vec<f64> = recording.paths[1].place.iter().flat_map(|v| v.as_slice().to_vec()).collect();
    assert_eq!(array("points/interface bolt_base/place"), places);
    let all = |vectors: &[Vector3<f64>]| -> Vec<f64> {
        vectors.iter().flat_map(|v| v.as_slice().to_vec()).collect()
    };
    assert_eq!(array("points/interface bolt_base/velocity"), all(&recording.paths[1].velocity));
    assert_eq!(array("points/node 20000/acceleration"), all(&recording.paths[0].acceleration));
    assert_eq!(array("conditions/torque"), all(recording.conditions.as_ref().expect("mean axes")));

    let (head, rows) = table(&first.path().join("motion.csv"));
    assert_eq!(rows.len(), 41);
    assert!(rows.iter().all(|row| row.len() == head.len()));
    let column = |name: &str| {
        let at = head.iter().position(|cell| cell == name).unwrap_or_else(|| panic!("{name} in {head:?}"));
        rows.iter().map(|row| row[at]).collect::<Vec<f64>>()
    };
    assert_eq!(column("q_2"), recording.states.iter().map(|s| s.q[1]).collect::<Vec<f64>>());
    assert_eq!(column("elastic"), recording.balances.iter().map(|b| b.elastic).collect::<Vec<f64>>());
    assert_eq!(
        column("node 20000 deflection_z"),
        recording.paths[0].deflection.iter().map(|d| d.z).collect::<Vec<f64>>()
    );

    let path = &recording.paths[1];
    assert_eq!(
        column("interface bolt_base velocity_x"),
        path.velocity.iter().map(|v| v.x).collect::<Vec<f64>>()
    );
    assert_eq!(
        column("interface bolt_base acceleration_z"),
        path.acceleration.iter().map(|a| a.z).collect::<Vec<f64>>()
    );
    let torques = recording.conditions.as_ref().expect("mean axes");
    assert_eq!(column("conditions_torque_y"), torques.iter().map(|t| t.y).collect::<Vec<f64>>());

    let page = fs::read_to_string(first.path().join("motion.html")).unwrap();
    assert!(page.matches("<polyline").count() >= 10 && !page.contains("NaN"), "plots are drawn");
    let facts: Value =
        serde_json::from_str(&fs::read_to_string(first.path().join("motion.json")).unwrap()).unwrap();
    assert_eq!(facts["steps"].as_u64(), Some(recording.work.steps));
    let last = path.acceleration.last().expect("an instant");
    assert_eq!(facts["points"][1]["last_acceleration"], serde_json::json!([last.x, last.y, last.z]));
    let largest = torques.iter().map(|t| t.norm()).fold(0.0, f64::max);
    assert_eq!(facts["largest_conditions_torque"].as_f64(), Some(largest));
    assert!(facts["reaction"].is_null(), "a free body");
}

#[test]
fn prescribed_spin_takes_the_torque_of_a_rigid_body_and_that_of_the_load() {
    // The rotation is so slow that the body stays rigid: the torque is I alpha plus the torque that balances
    // the load.
    let folder = folder_with("connecting_rod", 4);
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let inertia = body.invariants().inertia()[(2, 2)];
    scene(
        folder.path(),
        "[run]\nduration = 1\noutputs = 10\nmethod = \"conserving\"\nstep = 1e-3\n\
         [spin]\nrate = { times = [0, 1], values = [0, 0.5] }\nhold = true\n\
         [[load]]\ninterface = \"small_end\"\ntorque = [0, 0, 3]\nhistory = { times = [0.5, 0.6], values = [0, 1] }\n",
    );
    done(folder.path(), &["simulate", "body.flex.h5", "--scene", "scene.toml", "--csv", "motion.csv"]);
    let (head, rows) = table(&folder.path().join("motion.csv"));
    let at = head.iter().position(|cell| cell == "reaction_torque_z").expect("a reaction");
    for (row, load) in [(2, 0.0), (9, 3.0)] {
        let torque = rows[row][at];
        let expected = inertia * 0.5 - load;
        assert!((torque - expected).abs() < 2e-3 * expected.abs(), "{torque}, {expected}");
    }
}

#[test]
fn plane_bodies_move_in_their_plane() {
    let folder = folder_with("plane_frame", 4);
    scene(
        folder.path(),
        "gravity = [0, -9.81, 0]\n[run]\nduration = 0.02\noutputs = 20\n[initial]\nvelocity = [1, 2, 0]\nangular_velocity = [0, 0, 40]\n",
    );
    done(folder.path(), &["simulate", "body.flex.h5", "--scene", "scene.toml", "--csv", "motion.csv"]);
    let (head, rows) = table(&folder.path().join("motion.csv"));
    let column = |name: &str| head.iter().position(|cell| cell == name).expect("a column");
    for row in &rows {
        for name in ["origin_z", "attitude_1", "attitude_2", "angular_velocity_x", "velocity_z"] {
            assert_eq!(row[column(name)], 0.0, "{name}");
        }
    }
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let momentum = |row: &[f64]| row[column("linear_momentum_y")];
    let impulse = momentum(rows.last().unwrap()) - momentum(&rows[0]);
    let weight = 9.81 * body.invariants().mass();
    assert!((impulse + weight * 0.02).abs() < 1e-12 * weight, "{impulse:e}");
}

#[test]
fn terms_are_those_of_the_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let read = |terms: &str| {
        scene(folder.path(), &format!("[run]\nduration = 1\n{terms}"));
        LoadCases::read_single(folder.path().join("scene.toml"), None).expect("a scene").run.terms
    };
    assert_eq!(read(""), Terms::ALL);
    assert_eq!(read("terms = [\"W1\", \"W3\"]"), Terms { w2: false, ..Terms::ALL });
    assert_eq!(read("terms = []"), Terms { geometric_stiffness: true, ..Terms::NONE });
    assert_eq!(read("geometric_stiffness = false"), Terms { geometric_stiffness: false, ..Terms::ALL });
    assert_eq!(read("terms = []\ngeometric_stiffness = false"), Terms::NONE);
}

/// The scene switches the geometric stiffness of a blade off: without it the blade is softer, and the report says so.
#[test]
fn geometric_stiffness_can_be_switched_off_and_is_reported() {
    let folder = folder_with("turbine_blade", 4);
    let run = |setting: &str| -> Value {
        let text = format!(
            "[run]\nduration = 0.004\n{setting}\n[spin]\naxis = [0, 0, 1]\nrate = 1500\n[initial]\ndeformation = \"static\"\n"
        );
        scene(folder.path(), &text);
        let run = done(folder.path(), &["simulate", "body.flex.h5", "--scene", "scene.toml", "--json"]);
        serde_json::from_slice::<Value>(&run.stdout).expect("JSON")["results"].take()
    };
    let (on, off) = (run(""), run("geometric_stiffness = false"));
    assert_eq!(on["geometric_stiffness"]["acts"], true, "{on:#}");
    assert_eq!(on["geometric_stiffness"]["loads"][0], "spin");
    assert_eq!(off["geometric_stiffness"]["acts"], false);
    assert_eq!(off["geometric_stiffness"]["is_off"], true);
    let deflection = |facts: &Value| facts["largest_deflection"].as_f64().expect("a number");
    assert!(deflection(&off) > 1.02 * deflection(&on), "{} and {}", deflection(&off), deflection(&on));
    scene(folder.path(), "[run]\nduration = 1\ngeometric_stiffness = \"no\"\n");
    let refused = flexbody(folder.path(), &["simulate", "body.flex.h5", "--scene", "scene.toml"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("true or false"));
}

#[test]
fn a_recording_that_does_not_fit_is_refused_before_any_work() {
    let folder = folder_with("bracket_hex20", 2);
    scene(folder.path(), "[run]\nduration = 1e-3\noutputs = 1000000\n");
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let described = LoadCases::read_single(folder.path().join("scene.toml"), None).expect("a scene");
    let error = simulate(&body, &described, &Context { memory: Some(1_000_000_000), ..Context::QUIET })
        .expect_err("a gigabyte is not enough");
    assert_eq!(error.diagnostics()[0].code(), Code::MemoryShort);
    assert_eq!(
        error.diagnostics()[0].message(),
        "recording 1000001 instants takes 1.683 GB of memory, 1.000 GB are available"
    );
}

#[test]
fn no_output_replaces_an_input() {
    let folder = folder_with("bracket_hex20", 2);
    scene(folder.path(), "[run]\nduration = 1e-4\n");
    let before = fs::read(folder.path().join("body.flex.h5")).unwrap();
    let words = ["simulate", "body.flex.h5", "--scene", "scene.toml", "-o", "body.flex.h5"];
    let run = flexbody(folder.path(), &words);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("FB801"));
    assert_eq!(fs::read(folder.path().join("body.flex.h5")).unwrap(), before);
}
