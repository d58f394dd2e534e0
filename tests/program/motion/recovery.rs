//! Recoveries from the manifest to the rows over a run, through the command line.

use crate::program::flexbody;
use flexbody_body::flex_body::{FlexBody, ModalMotion, RecoveryState};
use flexbody_model::{RawModel, RecoveryOperator};
use nalgebra::Vector3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::mesh::{Mesh, entries};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn mesh() -> Mesh {
    Mesh::from_cells(ElementKind::Hex8, &oracle::mesh::grid([4, 1, 1]), |[x, y, z]| {
        [0.1 * x + 0.01 * y, 0.05 * y, 0.04 * z]
    })
}

/// Writes a block with its stresses as operator, a cut, and two interfaces; the operator is a Matrix Market file.
fn folder() -> (TempDir, RawModel) {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = mesh();
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.data.recoveries = vec![mesh.stresses(&Material::STEEL)];
    write_model(folder.path(), &raw, Triangle::Lower);
    let RecoveryOperator::Rows { transposed, labels, .. } = &raw.data.recoveries[0].operator else {
        panic!("rows")
    };
    let mut operator = format!(
        "%%MatrixMarket matrix coordinate real general\n{} {} {}\n",
        transposed.n_cols(),
        transposed.n_rows(),
        transposed.nnz()
    );
    for (row, column, value) in entries(transposed) {
        writeln!(operator, "{} {} {value:.17e}", column + 1, row + 1).expect("memory");
    }
    let mut rows = "row,name,quantity,component,unit,element\n".to_owned();
    for (i, label) in labels.iter().enumerate() {
        let element = label.element.expect("an element");
        writeln!(rows, "{i},{},stress,{},Pa,{element}", label.name, label.component).expect("memory");
    }
    let ends = |x: f64| {
        let at_end = (1..).zip(&mesh.nodes).filter(|(_, p)| (p[0] - 0.01 * p[1] / 0.05 - x).abs() < 1e-9);
        at_end.map(|(id, _): (i64, _)| id.to_string()).collect::<Vec<_>>().join(", ")
    };
    let side = |p: &[f64; 3]| p[0] < 0.25;
    let mut cut = "node\n".to_owned();
    for (id, _) in (1..).zip(&mesh.nodes).filter(|(_, p)| side(p)) {
        writeln!(cut, "{id}").expect("memory");
    }
    let manifest = fs::read_to_string(folder.path().join("model.toml")).expect("a manifest");
    let manifest = format!(
        "{manifest}\n[[interface]]\nname = \"left\"\nnodes = [{}]\n[[interface]]\nname = \"right\"\nnodes = [{}]\n\
         [[recovery]]\nname = \"stress\"\noperator = \"R.mtx\"\nrows = \"rows.csv\"\n\
         [[recovery]]\nname = \"root\"\ncut = \"side.csv\"\nabout = [0.2, 0, 0]\n",
        ends(0.0),
        ends(0.4)
    );
    for (name, text) in
        [("R.mtx", &operator), ("rows.csv", &rows), ("side.csv", &cut), ("model.toml", &manifest)]
    {
        fs::write(folder.path().join(name), text).expect("written");
    }
    (folder, raw)
}

fn runs(place: &Path, line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    let run = flexbody(place, &words);
    assert!(run.status.success(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).expect("UTF-8")
}

fn refused(place: &Path, line: &str, code: &str) {
    let words: Vec<&str> = line.split_whitespace().collect();
    let run = flexbody(place, &words);
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(!run.status.success() && said.contains(code), "{line}: {said}");
}

/// Writes a run with loads at one interface and returns its modal coordinates, angular velocities and loads.
fn write_run(place: &Path, body: &FlexBody, spin: bool) -> Vec<(Vec<f64>, Vector3<f64>, [f64; 6])> {
    let nf = body.n_modes();
    let mut head = "time".to_owned();
    (1..=nf).for_each(|j| write!(head, ",q_{j}").expect("memory"));
    if spin {
        head.push_str(",angular_velocity_x,angular_velocity_y,angular_velocity_z");
    }
    for what in ["force", "torque"] {
        ["x", "y", "z"].iter().for_each(|k| write!(head, ",right {what}_{k}").expect("memory"));
    }
    let mut table = head + "\n";
    let mut states = Vec::new();
    for i in 0..4 {
        let number = |k: usize| f64::from(i + 1) * ((k + 1) as f64 * 1.3).sin();
        let q: Vec<f64> = (0..nf).map(|j| 1e-4 * number(j)).collect();
        let omega = Vector3::from_fn(|k, _| if spin { 100.0 * number(7 + k) } else { 0.0 });
        let load: [f64; 6] = std::array::from_fn(|a| 1e3 * number(20 + a));
        let numbers = std::iter::once(0.1 * f64::from(i)).chain(q.iter().copied());
        let numbers = numbers.chain(omega.iter().copied().filter(|_| spin)).chain(load);
        let cells: Vec<String> = numbers.map(|v| format!("{v:e}")).collect();
        table += &(cells.join(",") + "\n");
        states.push((q, omega, load));
    }
    fs::write(place.join("run.csv"), table).expect("written");
    states
}

#[test]
fn rows_of_a_run_are_those_of_the_body() {
    let (folder, _) = folder();
    let place = folder.path();
    runs(place, "convert model.toml --modes 6 --frame principal -o body.h5 --quiet");
    let text = runs(place, "inspect body.h5");
    assert!(text.contains("stress: 192 x stress") && text.contains("root: 3 x force, 3 x moment"), "{text}");
    let body = flexbody_file::read(place.join("body.h5")).expect("a body");
    let states = write_run(place, &body, true);
    let text = runs(place, "recover body.h5 --history run.csv -o out.csv");
    assert!(text.contains("Unloaded    left: the table has no columns of their loads"), "{text}");
    let table = fs::read_to_string(place.join("out.csv")).expect("a table");
    let mut lines = table.lines();
    let head = lines.next().expect("a head");
    assert!(head.starts_with("time,stress 1 1 xx,") && head.ends_with("root Mz"), "{head}");
    let axes = body.frame().axes.transpose();
    for ((q, omega, load), line) in states.iter().zip(lines) {
        let along = |first: usize| axes * Vector3::new(load[first], load[first + 1], load[first + 2]);
        let (force, torque) = (along(0), along(3));
        let right = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        let found: Vec<f64> = line.split(',').skip(1).map(|cell| cell.parse().expect("a number")).collect();
        let state = RecoveryState {
            motion: ModalMotion::steady(q, axes * omega),
            loads: &[[0.0; 6], right],
            named: &[],
        };
        let mut expected = body.recoveries()[0].values(&state);
        let measures = |s: &[f64]| {
            let stress = nalgebra::Matrix3::new(s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2]);
            let deviator = stress - nalgebra::Matrix3::identity() * (stress.trace() / 3.0);
            let von_mises = (1.5 * deviator.norm_squared()).sqrt();
            let mut principal: Vec<f64> = stress.symmetric_eigenvalues().iter().copied().collect();
            principal.sort_by(|a, b| b.total_cmp(a));
            let sign = if principal[0] >= -principal[2] { 1.0 } else { -1.0 };
            [von_mises, sign * von_mises, principal[0], principal[1], principal[2]]
        };
        let points: Vec<f64> = expected.chunks_exact(6).flat_map(measures).collect();
        expected.extend(points);
        expected.extend(body.recoveries()[1].values(&state));
        let size = expected.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= 1e-13 * size));
    }
    // The same numbers in HDF5, of one recovery.
    runs(place, "recover body.h5 --history run.csv --only root -o rows.h5");
    let file = hdf5_metno::File::open(place.join("rows.h5")).expect("a file");
    let values: Vec<f64> = file.dataset("recovery/root/values").expect("values").read_raw().expect("numbers");
    let of_table = table.lines().skip(1).flat_map(|line| line.split(',').skip(1 + 192 + 5 * 32));
    let of_table: Vec<f64> = of_table.map(|cell| cell.parse().expect("a number")).collect();
    assert_eq!(values, of_table);
    assert!(file.group("recovery/stress").is_err());
    let told: Value =
        serde_json::from_str(&runs(place, "recover body.h5 --history run.csv -o out.csv --json"))
            .expect("JSON");
    assert_eq!(told["results"]["unloaded"], serde_json::json!(["left"]));
}

#[test]
fn runs_and_names_that_do_not_fit_are_refused() {
    let (folder, _) = folder();
    let place = folder.path();
    runs(place, "convert model.toml --modes 6 -o body.h5 --quiet");
    let body = flexbody_file::read(place.join("body.h5")).expect("a body");
    // The angular velocity is missing, a modal coordinate is missing, a vector has two components.
    write_run(place, &body, false);
    refused(place, "recover body.h5 --history run.csv -o out.csv", "FB215");
    write_run(place, &body, true);
    let run = fs::read_to_string(place.join("run.csv")).expect("a table");
    fs::write(place.join("other.csv"), run.replace("q_6", "p_6")).expect("written");
    refused(place, "recover body.h5 --history other.csv -o out.csv", "FB215");
    fs::write(place.join("other.csv"), run.replace("right force_z", "force_z")).expect("written");
    refused(place, "recover body.h5 --history other.csv -o out.csv", "FB215");
    // A number that is none does not count as a load of zero.
    let last = run.trim_end().rfind(',').expect("a column") + 1;
    fs::write(place.join("other.csv"), format!("{}x\n", &run[..last])).expect("written");
    refused(place, "recover body.h5 --history other.csv -o out.csv", "FB216");
    refused(place, "recover body.h5 --history run.csv --only nothing -o out.csv", "FB221");
    refused(place, "recover body.h5 --history run.csv -o out.txt", "out.txt");
    assert!(!place.join("out.csv").exists());
    // A body without recoveries.
    let plain = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    let plain = &plain[..plain.find("[[recovery]]").expect("a recovery")];
    fs::write(place.join("plain.toml"), plain).expect("written");
    runs(place, "convert plain.toml --modes 6 -o plain.h5 --quiet");
    refused(place, "recover plain.h5 --history run.csv -o out.csv", "FB221");
}

/// The formats of the operator give the same body: Matrix Market, dense NumPy array.
#[test]
fn every_format_of_the_operator_gives_the_same_rows() {
    let (folder, raw) = folder();
    let place = folder.path();
    let RecoveryOperator::Rows { transposed, .. } = &raw.data.recoveries[0].operator else { panic!("rows") };
    let (rows, columns) = (transposed.n_cols(), transposed.n_rows());
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    let mut head = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    while (head.len() + 11) % 64 != 0 {
        head.push(' ');
    }
    head.push('\n');
    bytes.extend((head.len() as u16).to_le_bytes());
    bytes.extend(head.as_bytes());
    for i in 0..rows {
        bytes.extend((0..columns).flat_map(|j| transposed.get(j, i).to_le_bytes()));
    }
    fs::write(place.join("R.npy"), bytes).expect("written");
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    fs::write(place.join("dense.toml"), manifest.replace("R.mtx", "R.npy")).expect("written");
    runs(place, "convert model.toml --modes 4 -o sparse.h5 --quiet");
    runs(place, "convert dense.toml --modes 4 -o dense.h5 --quiet");
    let read = |name: &str| flexbody_file::read(place.join(name)).expect("a body");
    let (sparse, dense) = (read("sparse.h5"), read("dense.h5"));
    assert_eq!(sparse.recoveries(), dense.recoveries());
}

/// Returns the columns of a table with their names.
fn columns(path: &Path) -> Vec<(String, Vec<f64>)> {
    let text = fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    let head = lines.next().expect("a head").split(',').map(str::to_owned);
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    head.enumerate().map(|(c, name)| (name, rows.iter().map(|row| row[c]).collect())).collect()
}

/// The rows of `simulate` are those that `recover` computes from its table of the motion, for a free body and for one that
/// an interface carries, and its extremes are not below any instant.
#[test]
fn rows_of_a_simulation_are_those_of_its_table() {
    let (folder, _) = folder();
    let place = folder.path();
    runs(
        place,
        "convert model.toml --modes 6 --residual-vectors interfaces --frame principal -o body.h5 --quiet",
    );
    assert_rows_of_tables(place, 0.0);
}

/// The rows of `simulate` are those of its table also for a body with columns of damping forces and of the inertia of the
/// deformation. A table without the rates gives the rows without these forces, with a warning; the table of a carried body
/// needs its carrier.
#[test]
fn rows_with_forces_of_motion_are_those_of_the_table() {
    let (folder, _) = folder();
    let place = folder.path();
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    let manifest = manifest
        .replace("rows = \"rows.csv\"\n", "rows = \"rows.csv\"\ndeformed_inertia = true\n")
        .replacen("[[interface]]", "[damping]\nrayleigh = { alpha = 900, beta = 1e-6 }\n[[interface]]", 1);
    fs::write(place.join("model.toml"), manifest).expect("written");
    let convert = "convert model.toml --modes 6 --residual-vectors interfaces --frame principal -o";
    runs(place, &format!("{convert} body.h5 --quiet"));
    assert_rows_of_tables(place, 1e-6);
    refused(place, "recover body.h5 --history run.csv -o again.csv", "--carried-by");
    let free = "[run]\nduration = 2e-4\n[initial]\nangular_velocity = [100, 50, 300]\n";
    fs::write(place.join("scene.toml"), free).expect("written");
    runs(place, "simulate body.h5 --scene scene.toml --csv run.csv --quiet");
    let table = fs::read_to_string(place.join("run.csv")).expect("a table");
    assert!(table.contains(",angular_acceleration_x,") && table.contains(",qdd_6"), "{}", &table[..900]);
    let without = |columns: &str| {
        let all = table.lines().next().expect("a head").split(',').filter(|name| name.starts_with(columns));
        let renamed = all.fold(table.clone(), |text, name| text.replacen(name, &format!("other {name}"), 1));
        fs::write(place.join("less.csv"), renamed).expect("written");
        refused(place, "recover body.h5 --history less.csv -o again.csv --deny-warnings", "FB564");
        runs(place, "recover body.h5 --history less.csv -o again.csv --quiet");
    };
    ["qd_", "qdd_", "angular_acceleration_"].into_iter().for_each(without);
}

/// The table of a body that turns with a prescribed spin is taken as it is, also of a body without W3, whose torque of mean
/// axes is not known, and in whose table no column of this torque tells the frame.
#[test]
fn a_table_of_a_prescribed_spin_is_no_table_of_a_carried_body() {
    let (folder, _) = folder();
    let place = folder.path();
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    let manifest =
        manifest.replace("rows = \"rows.csv\"\n", "rows = \"rows.csv\"\ndeformed_inertia = true\n");
    fs::write(place.join("model.toml"), manifest).expect("written");
    let spin = "[run]\nduration = 2e-4\noutputs = 10\n[spin]\naxis = [0, 0, 1]\nrate = 300\n";
    fs::write(place.join("scene.toml"), spin).expect("written");
    runs(place, "convert model.toml --modes 6 -o whole.h5 --quiet");
    runs(place, "reduce whole.h5 --terms W1 -o reduced.h5 --quiet");
    for (body, conditions) in [("whole", "conditions_torque_x"), ("reduced", "mean_axes")] {
        runs(place, &format!("simulate {body}.h5 --scene scene.toml --csv run.csv --rows right.csv --quiet"));
        let table = columns(&place.join("run.csv"));
        assert!(table.iter().any(|(name, _)| name == conditions), "{body}");
        runs(place, &format!("recover {body}.h5 --history run.csv -o again.csv --quiet"));
        let read = |name: &str| fs::read_to_string(place.join(name)).expect("a table");
        assert_eq!(read("again.csv"), read("right.csv"), "{body}");
    }
}

/// Compares the rows of `simulate` with those that `recover` computes from its table, of the body `body.h5` in `place`.
///
/// * `beta`: of damping in proportion to the stiffness, by which static columns are late. Between the rows of the table,
///   loads of the frequency f are linear, which changes them by beta times half the step times (2 pi f)^2.
fn assert_rows_of_tables(place: &Path, beta: f64) {
    let load = "[[load]]\ninterface = \"right\"\nforce = [300, -200, 1000]\ntorque = [5, 4, 3]\naxes = \"world\"\n\
                history = { amplitude = 1, frequency = 700 }\n";
    let free = "[run]\nduration = 2e-3\noutputs = 400\n[initial]\nangular_velocity = [100, 50, 300]\n";
    let carried = "gravity = [0, 0, -9.81]\n[run]\nduration = 2e-3\noutputs = 400\n[carried]\ninterface = \"left\"\n\
                   [carried.spin]\naxis = [0, 0, 1]\nrate = 200\n";
    for (name, scene) in [("free", free), ("carried", carried)] {
        fs::write(place.join("scene.toml"), format!("{scene}{load}")).expect("written");
        let told = runs(place, "simulate body.h5 --scene scene.toml --csv run.csv --rows rows.csv --json");
        runs(place, "simulate body.h5 --scene scene.toml --rows rows.h5 --quiet");
        let carrier = if name == "carried" { " --carried-by left" } else { "" };
        runs(place, &format!("recover body.h5 --history run.csv -o again.csv --quiet{carrier}"));
        let (own, again) = (columns(&place.join("rows.csv")), columns(&place.join("again.csv")));
        assert_eq!(own.len(), again.len());
        let size = |prefix: &str| {
            let all = own.iter().filter(|(name, _)| name.starts_with(prefix)).flat_map(|(_, values)| values);
            all.fold(0.0f64, |most, value| most.max(value.abs()))
        };
        for ((own_name, own), (again_name, again)) in own.iter().zip(&again) {
            assert_eq!(own_name, again_name);
            let late = beta * 0.5 * 5e-6 * (TAU * 700.0).powi(2);
            let allowed = (1e-9 + late) * size(own_name.split(' ').next().expect("a word"));
            let largest = own.iter().zip(again).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
            assert!(
                largest <= allowed,
                "{name}: {own_name} differs by {largest:e} of {size:e}",
                size = size("stress")
            );
        }
        // The binary file has the same numbers.
        let file = hdf5_metno::File::open(place.join("rows.h5")).expect("a file");
        let values: Vec<f64> =
            file.dataset("recovery/root/values").expect("values").read_raw().expect("numbers");
        let of_table =
            |i: usize| own.iter().filter(|(name, _)| name.starts_with("root")).map(move |(_, v)| v[i]);
        assert_eq!(values, (0..401).flat_map(of_table).collect::<Vec<f64>>());
        let told: Value = serde_json::from_str(&told).expect("JSON");
        let stress = &told["results"]["recoveries"][0];
        for (measure, end, sign) in [
            ("von_mises", " von Mises", 1.0),
            ("tension", "principal 1", 1.0),
            ("compression", "principal 3", -1.0),
        ] {
            let of_points = own.iter().filter(|(name, _)| name.ends_with(end) && !name.contains("signed"));
            let at_instants =
                of_points.flat_map(|(_, v)| v).fold(0.0f64, |most, value| most.max(sign * value));
            let said = sign * stress[measure]["value"].as_f64().expect("a number");
            assert!(
                at_instants <= 1.0001 * said && said < 1.1 * at_instants,
                "{name} {measure}: {said} {at_instants}"
            );
        }
    }
    refused(place, "simulate body.h5 --scene scene.toml --rows rows.txt", "rows.txt");
    // A load at a node has no columns.
    let at_node = load.replace("interface = \"right\"", "node = 1").replace("torque = [5, 4, 3]\n", "");
    fs::write(place.join("scene.toml"), format!("{free}{at_node}")).expect("written");
    refused(place, "simulate body.h5 --scene scene.toml --deny-warnings", "FB553");
}

/// A scene that limits the errors of recoveries: `select`, `trade` with all nodes and `measure` judge by them, and
/// limits that cannot be understood are refused.
#[test]
fn limits_of_recoveries_decide_selections_and_trades() {
    let (folder, _) = folder();
    let place = folder.path();
    runs(place, "convert model.toml --modes 20 -o body.h5 --quiet");
    let scene = "[run]\nduration = 2e-3\n[initial]\nangular_velocity = [100, 50, 300]\ndeformation = \"static\"\n\
                 [[load]]\ninterface = \"right\"\nforce = [300, -200, 1000]\nhistory = { amplitude = 1, frequency = 700 }\n";
    let judged = |limits: &str, line: &str| -> Value {
        fs::write(place.join("scene.toml"), format!("{scene}[tolerance]\n{limits}\n")).expect("written");
        let run = flexbody(place, &line.split_whitespace().collect::<Vec<_>>());
        assert!(run.status.code() < Some(2), "{line}: {}", String::from_utf8_lossy(&run.stderr));
        serde_json::from_slice(&run.stdout).expect("JSON")
    };
    let select = "select body.h5 --scene scene.toml --json";
    let modes = |told: &Value| told["results"]["modes"]["kept"].as_array().map_or(0, Vec::len);
    let with_columns =
        judged("recovery = { stress = 0.05, root = 0.05 }\ndeflection = 1.5\nattitude = 1.0", select);
    let alone = judged(
        "recovery = { stress = { limit = 0.05, static_columns = false } }\ndeflection = 1.5\nattitude = 1.0",
        select,
    );
    for told in [&with_columns, &alone] {
        let (chosen, tolerance) = (&told["results"]["chosen"], &told["results"]["tolerance"]);
        let error = chosen["errors"]["recovery"].as_f64().expect("an error");
        assert!(error > 0.0 && error <= 1.0, "{chosen}");
        assert!(tolerance["recovery"] == 1.0 && tolerance["stress"].is_null(), "{tolerance}");
    }
    assert!(0 < modes(&with_columns) && modes(&with_columns) < modes(&alone), "{with_columns} {alone}");
    // Errors relative to all nodes, with a value as limit.
    let limit = "recovery = { stress = \"1 MPa\" }\nstress = 0.5";
    let trade = "trade model.toml --modes 6 --scene scene.toml --reference nodal --repeat 1 --json";
    let told = judged(limit, trade);
    let rows = told["results"]["rows"].as_array().expect("rows");
    let errors: Vec<f64> =
        rows.iter().filter_map(|row| row["measured"]["errors"]["recovery"].as_f64()).collect();
    assert!(errors.len() > 5 && errors.iter().any(|error| *error > 1.0), "{errors:?}");
    assert_eq!(told["results"]["tolerance"]["stress"], 0.5);
    // The run of the body itself has no error but that of its steps.
    runs(place, "simulate body.h5 --scene scene.toml --csv run.csv --quiet");
    let told =
        judged("recovery = { stress = 0.01 }", "measure body.h5 --history run.csv --scene scene.toml --json");
    let error = told["results"]["errors"]["recovery"].as_f64().expect("an error");
    assert!(error < 1e-3, "{told}");
    for (limits, code) in [
        ("recovery = { stress = \"5\" }", "FB211"),
        ("recovery = { stress = -1 }", "FB211"),
        ("recovery = { stress = { limit = 0.1, columns = true } }", "FB211"),
        ("recovery = { stress = { static_columns = false } }", "FB211"),
        ("recovery = 0.01", "FB211"),
        ("recovery = { gauges = 0.01 }", "FB221"),
        ("recovery = { stress = \"5 mm\" }", "FB212"),
    ] {
        fs::write(place.join("scene.toml"), format!("{scene}[tolerance]\n{limits}\n")).expect("written");
        refused(place, "select body.h5 --scene scene.toml", code);
    }
}

/// `response` reads rows, moves an interface, and computes root mean squares of all rows and points; what it cannot do is
/// refused with a code and leaves no file.
#[test]
fn random_vibration_of_an_interface_is_written() {
    let (folder, _) = folder();
    let place = folder.path();
    runs(place, "convert model.toml --modes 12 --residual-vectors interfaces -o body.h5 --quiet");
    fs::write(place.join("psd.csv"), "hertz,left:y\n100,4\n8000,16\n").expect("written");
    let line =
        "response model.toml body.h5 --base left:y --damping 0.02 --band 100..8000 --solves 4 --points 30";
    let told: Value = serde_json::from_str(&runs(
        place,
        &format!("{line} --psd psd.csv --to right:y --rows root --rms rms.csv --csv response.csv --json"),
    ))
    .expect("JSON");
    let results = &told["results"];
    let random = &results["random"];
    let [low, high] = [100.0f64, 8000.0];
    // The density is a power of the frequency: 4 (f / 100)^p with p = ln 4 / ln 80.
    let power = 4.0f64.ln() / 80.0f64.ln();
    let expected = 4.0 * low / (power + 1.0) * ((high / low).powf(power + 1.0) - 1.0);
    let of_input = random["inputs"][0]["rms"].as_f64().expect("a number");
    assert!((of_input / expected.sqrt() - 1.0).abs() < 1e-6, "{of_input} {}", expected.sqrt());
    assert_eq!(random["displacements"][0]["name"], "interface right y");
    let table = fs::read_to_string(place.join("rms.csv")).expect("a table");
    let kinds = |kind: &str| table.lines().filter(|line| line.split(',').nth(1) == Some(kind)).count();
    assert_eq!((kinds("displacement"), kinds("row"), kinds("von Mises")), (1, 198, 32), "{table}");
    for recovery in random["recoveries"].as_array().expect("recoveries") {
        let error = recovery["errors"]["rows"].as_f64().expect("an error");
        assert!(error < 0.02, "{recovery}");
    }
    let names: Vec<&str> =
        results["pairs"].as_array().expect("pairs").iter().filter_map(|pair| pair["to"].as_str()).collect();
    assert_eq!(names, ["interface right", "recovery root"]);
    assert!(
        fs::read_to_string(place.join("response.csv"))
            .expect("a table")
            .contains("recovery root Mz reduced re")
    );
    for (words, code) in [
        ("--psd psd.csv --rms rms.vtu", "FB221"),
        ("--rows nothing", "FB218"),
        ("--rows root:Mw", "FB218"),
        ("--to right:y --psd none.csv", "FB101"),
        ("--to right:y --from right", "cannot be used with"),
    ] {
        refused(place, &format!("{line} {words}"), code);
    }
    refused(place, "response body.h5 --base left:y --band 100..8000 --psd psd.csv", "FB801");
    refused(place, "response body.h5 --base 3:y --band 100..8000 --rows root --damping 0.02", "FB218");
    refused(place, "response body.h5 --from right:y --band 100..8000 --psd psd.csv --damping 0.02", "FB215");
    assert!(!place.join("rms.vtu").exists());
}

/// Writes nodal forces as a Matrix Market array.
fn write_vector(place: &Path, name: &str, forces: &[f64]) {
    let mut text = format!("%%MatrixMarket matrix array real general\n{} 1\n", forces.len());
    forces.iter().for_each(|force| writeln!(text, "{force:.17e}").expect("memory"));
    fs::write(place.join(name), text).expect("written");
}

/// Returns the rows of a table without its first line.
fn numbers(path: &Path) -> Vec<Vec<f64>> {
    let table = fs::read_to_string(path).expect("a table");
    let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    table.lines().skip(1).map(row).collect()
}

/// A named load and a preload of the manifest act in a simulation, and its table gives the same rows to `recover`.
#[test]
fn named_loads_of_the_manifest_act_and_are_recovered() {
    let (folder, raw) = folder();
    let place = folder.path();
    let last = 3 * (raw.nodes.len() - 1);
    let (mut push, mut bolts) = (vec![0.0; 3 * raw.nodes.len()], vec![0.0; 3 * raw.nodes.len()]);
    push[last + 1] = 1e3;
    // Opposite forces along the connection of two nodes.
    let x = &raw.nodes.positions;
    let along = (Vector3::from(x[last / 3]) - Vector3::from(x[0])).normalize() * 1e4;
    (0..3).for_each(|k| (bolts[k], bolts[last + k]) = (along[k], -along[k]));
    write_vector(place, "push.mtx", &push);
    write_vector(place, "bolts.mtx", &bolts);
    runs(place, "convert model.toml --modes 6 -o plain.h5 --quiet");
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    let loads = "[[named_load]]\nname = \"push\"\nvector = \"push.mtx\"\n\
                 [[named_load]]\nname = \"bolts\"\nvector = \"bolts.mtx\"\npreload = true\n";
    fs::write(place.join("model.toml"), manifest + loads).expect("written");
    runs(place, "convert model.toml --modes 6 --frame principal -o body.h5 --quiet");
    let minor = |name: &str| {
        flexbody_file::structure(place.join(name)).expect("a file")["attributes"]["format_minor"].clone()
    };
    // Both have an estimate of the stress stiffness of spin, since 1.13.
    assert_eq!((minor("plain.h5"), minor("body.h5")), (13.into(), 13.into()));
    let text = runs(place, "inspect body.h5");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("push: load, ") && text.contains("bolts: preload, "), "{text}");
    let scene = "[run]\nduration = 0.002\noutputs = 20\n[initial]\nangular_velocity = [10, 20, 30]\n\
                 deformation = \"static\"\n[[load]]\nnamed_load = \"push\"\n\
                 history = { amplitude = 2, frequency = 700, phase = 0 }\n";
    fs::write(place.join("push.toml"), scene).expect("written");
    runs(place, "simulate body.h5 --scene push.toml --csv run.csv --rows rows.csv --quiet");
    runs(place, "recover body.h5 --history run.csv -o again.csv --quiet");
    let (rows, again) = (numbers(&place.join("rows.csv")), numbers(&place.join("again.csv")));
    let largest = rows.iter().flat_map(|row| &row[1..]).fold(0.0f64, |most, v| most.max(v.abs()));
    assert_eq!((rows.len(), rows[0].len()), (again.len(), again[0].len()));
    for (a, b) in rows.iter().flatten().zip(again.iter().flatten()) {
        assert!((a - b).abs() < 1e-9 * largest, "{a:e} {b:e}");
    }
    // At rest there is the stress of the preload, of which no column tells; without the column of the other load its static
    // stresses are missing, and the program says so.
    assert!(rows[0][1..].iter().any(|v| v.abs() > 1e-3 * largest));
    let table = fs::read_to_string(place.join("run.csv")).expect("a table");
    assert!(table.lines().next().is_some_and(|head| head.ends_with(",push,bolts")));
    fs::write(place.join("other.csv"), table.replacen(",push,", ",other,", 1)).expect("written");
    let text = runs(place, "recover body.h5 --history other.csv -o less.csv");
    assert!(text.contains("push: the table has no columns of their loads"), "{text}");
    let less = numbers(&place.join("less.csv"));
    let apart = rows.iter().flatten().zip(less.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) > 1e-3 * largest);
    // Formats that have no place for the loads say so.
    refused(place, "export body.h5 --to mbsim -o body.xml", "named-loads");
    runs(place, "compare body.h5 body.h5");
    let run = flexbody(place, &["compare", "plain.h5", "body.h5"]);
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(!run.status.success() && said.contains("named load `push` is in the second body only"), "{said}");
}
