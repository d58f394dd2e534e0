//! Histories and rigid motion from files: equivalent to the same numbers in the scene, recorded motions are
//! reproduced when fed back, and the number of rows has no effect.

use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::context::Context;
use flexbody_motion::dynamics::{EulerParameters, Orientation, RotationVector};
use flexbody_motion::scene::{LoadCases, Recording, simulate};
use flexbody_report::simulation_csv;
use nalgebra::{Matrix3, Vector3};
use oracle::brackets::footed_block;
use oracle::flexible::body_of;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;

fn body(modes: usize) -> FlexBody {
    body_of(footed_block(), modes, BodyFrame::Principal)
}

/// Simulates a scene with these accompanying files.
fn run(body: &FlexBody, text: &str, files: &[(&str, &str)]) -> Recording {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).expect("written");
    }
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).expect("written");
    let scene = LoadCases::read_single(&path, None).unwrap_or_else(|error| panic!("{error}\n{text}"));
    simulate(body, &scene, &Context::QUIET).unwrap_or_else(|error| panic!("{error}\n{text}")).0
}

/// Returns rows of numbers as a table.
fn table(head: &str, rows: impl Iterator<Item = Vec<f64>>) -> String {
    rows.fold(format!("{head}\n"), |mut text, row| {
        let cells: Vec<String> = row.iter().map(|value| format!("{value:e}")).collect();
        writeln!(text, "{}", cells.join(",")).expect("a String");
        text
    })
}

/// Returns the largest difference of the modal coordinates, relative to the largest.
fn apart(a: &Recording, b: &Recording) -> f64 {
    assert_eq!(a.time, b.time);
    let most = |size: &dyn Fn(usize, usize) -> f64| {
        let nf = a.states[0].q.len();
        (0..a.time.len())
            .flat_map(|i| (0..nf).map(move |j| (i, j)))
            .map(|(i, j)| size(i, j))
            .fold(0.0, f64::max)
    };
    most(&|i, j| (a.states[i].q[j] - b.states[i].q[j]).abs()) / most(&|i, j| a.states[i].q[j].abs())
}

fn largest_torque(recording: &Recording) -> f64 {
    recording.reactions.iter().flatten().map(|(_, torque)| torque.norm()).fold(0.0, f64::max)
}

const LOADS: &str = "[[load]]\nnode = 3\nforce = [2e-3, 1e-3, -3e-3]\nhistory = { amplitude = 1, frequency = 0.3 }\n\
                     [[load]]\ninterface = \"foot\"\nforce = [1e-3, 0, 2e-3]\ntorque = [0, 1e-3, 0]\naxes = \"model\"\n\
                     history = { to = 1, duration = 2 }\n";

/// Returns a free run under loads, whose rotation changes its axis.
fn free(outputs: usize) -> String {
    format!(
        "gravity = [0.02, -0.01, -0.05]\n[run]\nduration = 6\ntolerance = 1e-12\noutputs = {outputs}\n\
         [initial]\nvelocity = [0.1, -0.2, 0.3]\nrotation = [0.4, -0.3, 0.8]\nangular_velocity = [0.1, 0.5, -0.2]\n{LOADS}"
    )
}

/// Returns the run with its rotation prescribed.
fn driven(spin: &str) -> String {
    let start = if spin.contains("attitude_from") { "" } else { "rotation = [0.4, -0.3, 0.8]\n" };
    format!(
        "gravity = [0.02, -0.01, -0.05]\n[run]\nduration = 6\ntolerance = 1e-12\noutputs = 60\n\
         [initial]\nvelocity = [0.1, -0.2, 0.3]\n{start}{LOADS}[spin]\n{spin}\n"
    )
}

/// A recorded free motion that is fed back as prescribed rotation is reproduced with zero torque, more
/// accurately with more rows: the error of a cubic spline through the angular velocity falls with the fourth
/// power of the distance of the rows, that of its derivative with the third.
#[test]
fn a_free_motion_that_is_fed_back_is_reproduced_without_a_torque() {
    let body = body(6);
    let axes = body.frame().axes;
    let reference = run(&body, &free(60), &[]);
    // The scale is the torque that this spin needs on a body of this inertia.
    let spin = reference.states.iter().map(|state| state.omega.norm()).fold(0.0, f64::max);
    let scale = body.invariants().inertia().trace() * spin * spin;
    let ways = [
        "angular_velocity_from = { file = \"run.csv\", columns = [\"angular_velocity_x\", \"angular_velocity_y\", \"angular_velocity_z\"] }",
        "axes = \"world\"\nangular_velocity_from = { file = \"other.csv\", columns = [2, 3, 4] }",
        "axes = \"body\"\nangular_velocity_from = { file = \"other.csv\", columns = [5, 6, 7] }",
        "attitude_from = { file = \"run.csv\", columns = [\"attitude_0\", \"attitude_1\", \"attitude_2\", \"attitude_3\"] }",
        "axes = \"body\"\nattitude_from = { file = \"other.csv\", columns = [8, 9, 10, 11] }",
    ];
    let errors = |rows: usize| -> Vec<[f64; 3]> {
        let recorded = run(&body, &free(rows), &[]);
        let seen_otherwise = table(
            "time,w1,w2,w3,b1,b2,b3,p0,p1,p2,p3",
            recorded.time.iter().zip(&recorded.states).enumerate().map(|(row, (time, state))| {
                let attitude = state.attitude.axes();
                // Euler parameters of either sign describe one rotation.
                let own =
                    EulerParameters::of_axes(&(attitude * axes)).0.map(|p| if row % 3 == 1 { -p } else { p });
                let (world, own_axes) = (attitude * state.omega, axes.tr_mul(&state.omega));
                [&[*time][..], world.as_slice(), own_axes.as_slice(), &own].concat()
            }),
        );
        let files = [("run.csv", &*simulation_csv(&recorded)), ("other.csv", &*seen_otherwise)];
        let one = |way: &&str| {
            let again = run(&body, &driven(way), &files);
            let turned = |i: usize| {
                let [a, b] = [&reference, &again].map(|run| run.states[i].attitude.axes());
                RotationVector::of_axes(&a.tr_mul(&b)).0.norm()
            };
            let attitude = (0..again.time.len()).map(turned).fold(0.0, f64::max);
            [apart(&reference, &again), largest_torque(&again) / scale, attitude]
        };
        ways.iter().map(one).collect()
    };
    let (few, many) = (errors(240), errors(480));
    for (way, (few, many)) in ways.iter().zip(few.iter().zip(&many)) {
        let order = |k: usize| (few[k] / many[k]).log2();
        assert!(many[0] < 1e-4 && many[1] < 1e-4 && many[2] < 1e-6, "{way}: {few:?}, {many:?}");
        // Attitudes are differentiated twice, which costs one order at the ends of the file.
        let of_torque = if way.contains("attitude_from") { 1.8 } else { 2.7 };
        assert!(order(0) > 2.7 && order(1) > of_torque, "{way}: {few:?}, {many:?}");
    }
}

/// Three columns along one direction are equivalent to a rate about this axis: with lines and cubics, along
/// axes of the model, the body and the world.
#[test]
fn columns_of_one_direction_are_the_spin_about_an_axis() {
    let body = body(5);
    // The table extends beyond the end of the run, because a table of the scene holds the last rate after its
    // last row.
    let (times, rates) = ([0.0, 0.7, 1.9, 3.0, 4.2, 7.0], [0.0, 0.3, 0.2, 0.5, 0.1, 0.4]);
    let axis = Vector3::new(1.0, 2.0, -1.0).normalize();
    let start = RotationVector(Vector3::new(0.4, -0.3, 0.8)).axes();
    let along = [("model", axis), ("body", body.frame().axes.tr_mul(&axis)), ("world", start * axis)];
    for interpolation in ["linear", "cubic"] {
        let rate = format!(
            "rate = {{ times = {times:?}, values = {rates:?}, interpolation = \"{interpolation}\" }}"
        );
        for hold in [false, true] {
            let single = run(
                &body,
                &driven(&format!("axis = [1, 2, -1]\nhold = {hold}\n{rate}")).replace(
                    "velocity = [0.1, -0.2, 0.3]\n",
                    if hold { "" } else { "velocity = [0.1, -0.2, 0.3]\n" },
                ),
                &[],
            );
            for (axes, axis) in along {
                let rows = times.iter().zip(rates).map(|(time, rate)| {
                    let omega = axis * rate;
                    vec![*time, omega.x, omega.y, omega.z]
                });
                let spin = format!(
                    "axes = \"{axes}\"\nhold = {hold}\nangular_velocity_from = {{ file = \"spin.csv\", columns = [\"x\", \"y\", \"z\"], interpolation = \"{interpolation}\" }}"
                );
                let scene = driven(&spin).replace(
                    "velocity = [0.1, -0.2, 0.3]\n",
                    if hold { "" } else { "velocity = [0.1, -0.2, 0.3]\n" },
                );
                let columns = run(&body, &scene, &[("spin.csv", &table("t,x,y,z", rows))]);
                let error = apart(&single, &columns);
                assert!(error < 1e-9, "{interpolation}, {axes}: {error:e}");
                let torques = |run: &Recording| run.reactions.clone().expect("prescribed");
                let (a, b) = (torques(&single), torques(&columns));
                let far = a.iter().zip(&b).map(|(a, b)| (a.1 - b.1).norm()).fold(0.0, f64::max);
                assert!(far < 1e-8 * largest_torque(&single), "{interpolation}, {axes}: {far:e}");
            }
        }
    }
}

/// Loads in columns equal the loads with these numbers in the scene, with changed units and times.
#[test]
fn loads_from_columns_are_those_of_the_scene() {
    let body = body(5);
    let (times, values) = ([0.0, 0.7, 1.9, 3.0, 6.0], [0.0, 3.0, -2.0, 1.0, 2.0]);
    let head = "[run]\nduration = 6\ntolerance = 1e-12\noutputs = 60\n[[watch]]\nnode = 3\n";
    // Factors kilo and milli: values times 1e-3, times from 2000 on in thousandths.
    let rows = times
        .iter()
        .zip(values)
        .map(|(time, value)| vec![2000.0 + 1e3 * time, 9.0, 2.0 * value, -value, 0.5 * value, 1e3 * value]);
    let file = table("\"t [ms]\",other,\"Fx [mN]\",\"Fy [mN]\",\"Fz [mN]\",factor", rows);
    let reading = "file = \"loads.csv\", time = \"t\", time_scale = 1e-3, time_zero = 2000, scale = 1e-3";
    for interpolation in ["linear", "cubic"] {
        let typed =
            format!("{{ times = {times:?}, values = {values:?}, interpolation = \"{interpolation}\" }}");
        for axes in ["world", "model", "body"] {
            let load = |rest: &str| {
                format!(
                    "{head}[initial]\nangular_velocity = [0.1, 0.5, -0.2]\n[[load]]\ninterface = \"foot\"\naxes = \"{axes}\"\n{rest}\n"
                )
            };
            let own = load(&format!(
                "force = [2e-3, -1e-3, 5e-4]\ntorque = [2e-3, -1e-3, 5e-4]\nhistory = {typed}"
            ));
            let one =
                format!("history = {{ {reading}, value = \"factor\", interpolation = \"{interpolation}\" }}");
            let one = load(&format!("force = [2e-3, -1e-3, 5e-4]\ntorque = [2e-3, -1e-3, 5e-4]\n{one}"));
            let columns = format!(
                "{{ {reading}, columns = [\"Fx\", 4, \"Fz [mN]\"], interpolation = \"{interpolation}\" }}"
            );
            let three = load(&format!("force_from = {columns}\ntorque_from = {columns}"));
            let reference = run(&body, &own, &[]);
            for scene in [one, three] {
                let error = apart(&reference, &run(&body, &scene, &[("loads.csv", &file)]));
                assert!(error < 1e-9, "{interpolation}, {axes}: {error:e}");
            }
        }
    }
}

/// The carrier of a body may follow columns or an axis and a direction; displacement, velocity and
/// acceleration describe one motion.
#[test]
fn a_carried_body_follows_columns() {
    let body = body(8);
    let (frequency, amplitude) = (0.2, 0.05);
    let omega = TAU * frequency;
    let rate = |time: f64| 0.3 * (1.0 - (0.9 * time).cos());
    let angle = |time: f64| 0.3 * (time - (0.9 * time).sin() / 0.9);
    let axis = Vector3::new(1.0, 2.0, -1.0).normalize();
    let along = Vector3::new(1.0, 0.0, 1.0).normalize() * amplitude;
    let start = RotationVector(Vector3::new(0.4, -0.3, 0.8)).axes();
    let rows = (0..=400).map(|i| {
        let time = 6.0 * f64::from(i) / 400.0;
        let (sin, cos) = (omega * time).sin_cos();
        let attitude: Matrix3<f64> = start * RotationVector(axis * angle(time)).axes();
        let derivatives = [along * sin, along * (omega * cos), along * (-omega * omega * sin)];
        let motion = derivatives.iter().flat_map(|v| v.iter().copied().collect::<Vec<_>>());
        let turning = (axis * rate(time))
            .iter()
            .copied()
            .chain(EulerParameters::of_axes(&attitude).0)
            .collect::<Vec<_>>();
        [time].into_iter().chain(motion).chain(turning).collect()
    });
    let file = table("t,x,y,z,vx,vy,vz,ax,ay,az,w1,w2,w3,p0,p1,p2,p3", rows);
    let head = "gravity = [0.02, -0.01, -0.05]\n[run]\nduration = 6\noutputs = 60\ntolerance = 1e-11\n";
    let scene = |rotation: &str, spin: &str, translation: &str| {
        format!(
            "{head}{rotation}[carried]\ninterface = \"foot\"\n[carried.spin]\nthrough = [2, -3, 1]\n{spin}\n[carried.translation]\n{translation}\n"
        )
    };
    let turned = "[initial]\nrotation = [0.4, -0.3, 0.8]\n";
    let rate =
        "axis = [1, 2, -1]\nrate = { file = \"way.csv\", value = \"rate\", interpolation = \"cubic\" }";
    let rates = table(
        "t,rate",
        (0..=400).map(|i| {
            let time = 6.0 * f64::from(i) / 400.0;
            vec![time, 0.3 * (1.0 - (0.9 * time).cos())]
        }),
    );
    let files = [("motion.csv", &*file), ("way.csv", &*rates)];
    let from = |columns: &str| format!("{{ file = \"motion.csv\", columns = {columns} }}");
    let velocity = format!(
        "direction = [1, 0, 1]\nvelocity = {{ amplitude = {}, frequency = {frequency}, phase = {} }}",
        amplitude * omega,
        TAU / 4.0
    );
    let reference = run(&body, &scene(turned, rate, &velocity), &files);
    let omega_from = format!("angular_velocity_from = {}", from("[\"w1\", \"w2\", \"w3\"]"));
    let attitude_from = format!("attitude_from = {}", from("[\"p0\", \"p1\", \"p2\", \"p3\"]"));
    let force = |run: &Recording| run.reactions.clone().expect("carried");
    for (rotation, spin, translation) in [
        (turned, &omega_from, format!("velocity_from = {}", from("[\"vx\", \"vy\", \"vz\"]"))),
        ("", &attitude_from, format!("displacement_from = {}", from("[\"x\", \"y\", \"z\"]"))),
        (turned, &omega_from, format!("displacement_from = {}", from("[2, 3, 4]"))),
    ] {
        let own = run(&body, &scene(rotation, spin, &translation), &files);
        let error = apart(&reference, &own);
        let size = force(&reference).iter().map(|r| r.0.norm()).fold(0.0, f64::max);
        let far =
            force(&reference).iter().zip(&force(&own)).map(|(a, b)| (a.0 - b.0).norm()).fold(0.0, f64::max);
        assert!(error < 2e-4 && far < 2e-4 * size, "{translation}: {error:e}, {:e}", far / size);
    }
}

/// A history of 100,000 rows needs about as many integration steps as the sine that it samples.
#[test]
fn rows_are_no_steps() {
    let body = body(4);
    let rows = 100_000;
    let file = table(
        "t F",
        (0..=rows).map(|i| {
            let time = 6.0 * f64::from(i) / f64::from(rows);
            vec![time, (TAU * 0.3 * time).sin()]
        }),
    );
    let file = file.replace(',', " ");
    let scene = |history: &str| {
        format!(
            "[run]\nduration = 6\noutputs = 50\n[[load]]\nnode = 3\nforce = [2e-3, 1e-3, -3e-3]\nhistory = {history}\n"
        )
    };
    let sine = run(&body, &scene("{ amplitude = 1, frequency = 0.3 }"), &[]);
    let sampled = scene("{ file = \"F.csv\", value = \"F\", interpolation = \"cubic\" }");
    let sampled = run(&body, &sampled, &[("F.csv", &file)]);
    assert!(sampled.work.steps <= sine.work.steps + 2, "{}, {}", sampled.work.steps, sine.work.steps);
    assert!(apart(&sine, &sampled) < 1e-8);
}

/// Outside its rows a history is extended only if the scene allows it; an end that differs from that of the
/// run by rounding is accepted.
#[test]
fn a_file_covers_the_run_or_the_scene_says_what_is_outside() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = |text: &str, rows: &str| {
        fs::write(folder.path().join("F.csv"), rows).expect("written");
        fs::write(folder.path().join("scene.toml"), text).expect("written");
        LoadCases::read_single(folder.path().join("scene.toml"), None)
    };
    let scene = |rest: &str| {
        format!(
            "[run]\nduration = 6\n[[load]]\nnode = 3\nforce = [1, 0, 0]\nhistory = {{ file = \"F.csv\", value = 2{rest} }}\n"
        )
    };
    let error = place(&scene(""), "1 2\n5 4\n").expect_err("not covered");
    assert!(error.has(Code::SeriesRange), "{error}");
    let held = place(&scene(", outside = \"hold\""), "1 2\n5 4\n").expect("a scene");
    let at = |time: f64| held.loads[0].force.at(time).0.x;
    assert_eq!([at(0.0), at(1.0), at(3.0), at(5.0), at(6.0)], [2.0, 2.0, 3.0, 4.0, 4.0]);
    assert_eq!(held.breaks(), [1.0, 5.0]);
    let near = place(&scene(""), "0 2\n5.9999999 4\n").expect("a scene");
    let (value, rate) = near.loads[0].force.at(6.0);
    assert!((value.x - 4.0).abs() < 1e-6 && rate.x > 0.3 && near.breaks().is_empty());
    let unknown = scene("").replace("duration = 6", "outputs = 6");
    assert!(place(&unknown, "0 2\n5 4\n").expect_err("no duration").has(Code::SeriesRange));
    assert!(place(&unknown.replace("value = 2", "value = 2, outside = \"hold\""), "0 2\n5 4\n").is_ok());
}

/// Two rows whose times differ by rounding alone would give an infinite rate; every table refuses them and
/// names their position. Close rows with a real distance are accepted: a step of a nanosecond, and dates in
/// seconds.
#[test]
fn rows_that_rounding_alone_tells_apart_are_refused() {
    let run = "[run]\nduration = 1\n";
    let load =
        |history: &str| format!("{run}[[load]]\nnode = 3\nforce = [1, 0, 0]\nhistory = {{ {history} }}\n");
    let columns = |key: &str, count: usize| {
        let names = ["\"a\"", "\"b\"", "\"c\"", "\"d\""][..count].join(", ");
        format!("{run}[spin]\n{key} = {{ file = \"rows.csv\", time = \"t\", columns = [{names}] }}\n")
    };
    let of_file = |more: &str| load(&format!("file = \"rows.csv\", value = \"a\"{more}"));
    let scenes = [
        (load("times = [0, 0.3, T, 1], values = [0, 1, 2, 0]"), "scene.toml, line 6"),
        (
            load("times = [0, 0.3, T, 1], values = [0, 1, 2, 0], interpolation = \"cubic\""),
            "scene.toml, line 6",
        ),
        (of_file(""), "rows.csv, line 4"),
        (of_file(", interpolation = \"cubic\""), "rows.csv, line 4"),
        (
            of_file(", interpolation = \"cubic\", time_zero = -5, time_scale = 1e3, outside = \"hold\""),
            "rows.csv, line 4",
        ),
        (columns("angular_velocity_from", 3), "rows.csv, line 4"),
        (columns("attitude_from", 4), "rows.csv, line 4"),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let read = |scene: &str, rows: &str| {
        fs::write(place.join("rows.csv"), rows).expect("written");
        fs::write(place.join("scene.toml"), scene).expect("written");
        LoadCases::read_single(place.join("scene.toml"), None)
    };
    let rows = |time: &str| {
        let values = ["1,0,0,0", "1,1e-9,0,0", "1,2e-9,0,0", "1,3e-9,0,0"];
        format!("t,a,b,c,d\n0,{}\n0.3,{}\n{time},{}\n1,{}\n", values[0], values[1], values[2], values[3])
    };
    for (scene, place) in &scenes {
        for time in ["0.30000000000000004", "0.3000000000000001", "0.30000000000005"] {
            let error = read(&scene.replace('T', time), &rows(time)).expect_err("close rows");
            let text = error.to_string();
            assert!(error.has(Code::SeriesRow) || error.has(Code::SceneSyntax), "{text}");
            assert!(text.contains("rounding") && text.contains(place), "{place}: {text}");
            assert!(text.contains(time) && text.contains("0.3"), "{text}");
        }
        let sound = read(&scene.replace('T', "0.300000001"), &rows("0.300000001"));
        assert!(!sound.is_err_and(|error| error.to_string().contains("rounding")), "{scene}");
    }
    // Dates in seconds, one row per millisecond.
    let date = |row: u32| 1.7e9 + 1e-3 * f64::from(row);
    let dated = table("t,a", (0..=1100).map(|row| vec![date(row), f64::from(row)]));
    let scene = of_file(", time_zero = 1.7e9");
    assert!(read(&scene, &dated).is_ok());
}
