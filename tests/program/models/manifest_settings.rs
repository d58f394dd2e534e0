//! Settings of a manifest other than the matrices: residual vectors and geometric stiffness, in the manifest
//! and on the command line.

use flexbody_linalg::CscMatrix;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, matrix_market, write_model};
use oracle::mesh::Mesh;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// Runs `flexbody` in `folder` with the words of `line`; returns exit code, stdout, stderr.
fn flexbody(folder: &Path, line: &str) -> (i32, String, String) {
    let run = Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (run.status.code().expect("an exit code"), text(run.stdout), text(run.stderr))
}

fn json(folder: &Path, line: &str) -> Value {
    let (code, out, err) = flexbody(folder, line);
    assert_eq!(code, 0, "{line}: {out}{err}");
    let mut told: Value = serde_json::from_str(&out).expect("JSON");
    // The results of the JSON output.
    told.get_mut("results").map(Value::take).unwrap_or(told)
}

/// Creates a block with two interfaces, nodal loads `F.mtx`, a geometric stiffness `Kg.mtx`, and `more` at
/// the end of the manifest.
fn model(more: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = Mesh::block(ElementKind::Hex8, [4, 2, 1], [0.4, 0.15, 0.1]);
    let body = mesh.assemble(&Material::STEEL, MassRule::Consistent);
    let n = body.n_dofs();
    let manifest = write_model(folder.path(), &body.raw_model(), Triangle::Lower);
    let stretched: Vec<f64> =
        (0..n).map(|i| if i % 3 == 0 { 1e-6 * body.nodes[i / 3][0] } else { 0.0 }).collect();
    let stiffness = mesh.geometric_stiffness(&Material::STEEL, &stretched);
    let save = |name: &str, text: String| fs::write(folder.path().join(name), text).expect("written");
    // A string of unit tension along x, from node 1 to node 5 at a distance of 0.4.
    let string = (0..3u32).flat_map(|k| {
        let [a, b] = [k, 12 + k];
        [(a, a, 2.5), (b, b, 2.5), (a, b, -2.5), (b, a, -2.5)]
    });
    let string = CscMatrix::from_triplets(n, n, &string.collect::<Vec<_>>());
    save("Kg.mtx", matrix_market(&string, Triangle::Lower));
    save("Kg2.mtx", matrix_market(&stiffness, Triangle::Upper));
    let loads: Vec<String> =
        (0..2 * n).map(|i| f64::from(u8::from(i == 4 || i == n + 30)).to_string()).collect();
    save("F.mtx", format!("%%MatrixMarket matrix array real general\n{n} 2\n{}\n", loads.join("\n")));
    let interfaces =
        "[[interface]]\nname = \"left\"\nnodes = [1, 6]\n[[interface]]\nname = \"tip\"\nnodes = [5]\n";
    let text = fs::read_to_string(&manifest).expect("a manifest");
    save("model.toml", format!("{text}{interfaces}{more}"));
    folder
}

fn loads(report: &Value) -> Vec<&str> {
    let list = report["modes"]["truncation"].as_array().expect("a list");
    list.iter().map(|load| load["load"].as_str().expect("a name")).collect()
}

#[test]
fn residual_vectors_of_the_manifest_are_those_of_the_command_line_which_replaces_them() {
    let plain = model("");
    let stated = model("[basis]\nresidual_vectors = [\"centrifugal\", \"interfaces\"]\nloads = \"F.mtx\"\n");
    let run = |folder: &TempDir, options: &str| {
        json(folder.path(), &format!("convert model.toml -o b.h5 --modes 5 --json {options}"))
    };
    let asked = run(&plain, "--residual-vectors centrifugal,interfaces,loads=F.mtx");
    let told = run(&stated, "");
    assert_eq!(told["modes"], asked["modes"]);
    assert_eq!(told["model"]["settings"], asked["model"]["settings"]);
    assert_eq!(
        told["model"]["settings"]["residual_vectors"],
        serde_json::json!(["centrifugal", "interfaces", "loads"])
    );
    let names = loads(&told);
    assert_eq!(names.len(), 6 + 12 + 2);
    for name in ["centrifugal xz", "left torque y", "tip force z", "load 2"] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    for load in told["modes"]["truncation"].as_array().expect("a list") {
        assert!(load["after"].as_f64().expect("a number") < 1e-9, "{load}");
    }
    let roles: Vec<_> =
        told["model"]["files"].as_array().expect("a list").iter().map(|f| &f["role"]).collect();
    assert!(roles.contains(&&serde_json::json!("loads")), "{roles:?}");

    let replaced = run(&stated, "--residual-vectors interfaces");
    assert!(loads(&replaced).iter().all(|name| name.starts_with("left") || name.starts_with("tip")));
    // Without residual vectors the report states the truncation errors of free modes at the interfaces.
    let without = run(&stated, "--residual-vectors=");
    assert_eq!(loads(&without).len(), 12);
    assert_eq!(without["model"]["settings"]["residual_vectors"], serde_json::json!([]));
    for load in without["modes"]["truncation"].as_array().expect("a list") {
        assert_eq!(load["before"], load["after"], "{load}");
    }
}

#[test]
fn residual_vectors_that_cannot_be_are_refused_wherever_they_are_asked_for() {
    let stated = model("[basis]\nloads = \"F.mtx\"\n");
    for (options, said) in [
        ("--residual-vectors gravity", "`gravity` is not a set of loads for residual vectors"),
        ("--residual-vectors interfaces,interfaces", "loads are named twice"),
        ("--residual-vectors loads=", "`loads=` is not a set of loads"),
        ("--basis imported --shapes F.mtx", "residual vectors need --basis free"),
        ("--accuracy certified", "residual vectors are not eigenvectors and cannot be certified"),
        ("--lumped-modes", "--lumped-modes compares free-surface modes, not residual vectors"),
        ("--split", "--split cannot be used with nodal loads, whose rows belong to all bodies together"),
        ("--report F.mtx.txt --residual-vectors loads=F.mtx.txt", "output F.mtx.txt is an input"),
    ] {
        let (code, _, err) = flexbody(stated.path(), &format!("convert model.toml -o b.h5 {options}"));
        assert_eq!(code, 2, "{options}: {err}");
        assert!(err.contains("error[FB801]") && err.contains(said), "{options}: {err}");
        assert!(!stated.path().join("b.h5").exists());
    }
    let (code, _, err) = flexbody(stated.path(), "convert model.toml -o F.mtx");
    assert!(code == 2 && err.contains("output F.mtx is an input"), "{err}");
    let (code, _, err) =
        flexbody(model("").path(), "convert model.toml -o b.h5 --residual-vectors loads=no.npy");
    assert!(code == 2 && err.contains("error[FB101]"), "{err}");
}

#[test]
fn geometric_stiffness_goes_from_the_manifest_to_the_file_and_is_recomputed() {
    let folder = model(
        "[[geometric_stiffness]]\nfile = \"Kg.mtx\"\nforce = \"x\"\ninterface = \"tip\"\n\
         [[geometric_stiffness]]\nfile = \"Kg2.mtx\"\nload = \"stretch\"\n[damping]\nrayleigh = { alpha = 2.0, beta = 1e-6 }\n",
    );
    let path = folder.path();
    let report = json(path, "convert model.toml -o b.h5 --modes 8 --frame com --json");
    let given = report["modes"]["geometric_stiffness"].as_array().expect("a list");
    let names: Vec<_> = given.iter().map(|one| one["load"].as_str().expect("a name")).collect();
    assert_eq!(names, ["force x at `tip`", "load `stretch`"]);
    let notes: Vec<_> =
        report["diagnostics"].as_array().expect("a list").iter().map(|d| &d["code"]).collect();
    assert_eq!(notes, ["FB420", "FB531", "FB526"]);
    let (code, _, err) = flexbody(path, "check b.h5 --against model.toml");
    assert_eq!((code, err.as_str()), (0, ""), "no file has changed");
    let checks = json(path, "check b.h5 --against model.toml --json");
    let text = checks.to_string();
    assert!(text.contains("damping_recomputed") && text.contains("geometric_stiffness_recomputed"), "{text}");
    let structure = json(path, "inspect b.h5 --structure");
    let group = &structure["groups"]["geometric_stiffness"]["groups"]["force_x_tip"];
    assert_eq!(group["attributes"]["interface"], "tip");
    assert_eq!(group["attributes"]["load_units"], "kg m s^-2");
    assert_eq!(group["datasets"]["stiffness"]["shape"], serde_json::json!([8, 8]));

    // Doubled geometric stiffness: the file no longer agrees with the model.
    let stretched = fs::read_to_string(path.join("Kg2.mtx")).expect("a matrix");
    let doubled = |(at, line): (usize, &str)| match (at, line.rsplit_once(' ')) {
        (2.., Some((place, value))) => format!("{place} {}\n", 2.0 * value.parse::<f64>().expect("a number")),
        _ => format!("{line}\n"),
    };
    fs::write(path.join("Kg2.mtx"), stretched.lines().enumerate().map(doubled).collect::<String>())
        .expect("written");
    let (code, out, err) = flexbody(path, "check b.h5 --against model.toml");
    assert_eq!(code, 1, "{out}{err}");
    assert!(err.contains("warning[FB706]: geometric_stiffness file Kg2.mtx differs from"), "{err}");
    let (code, _, err) = flexbody(path, "convert model.toml -o Kg.mtx");
    assert!(code == 2 && err.contains("output Kg.mtx is an input"), "{err}");
}

#[test]
fn each_of_several_bodies_gets_its_own_residual_vectors() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = Mesh::two_bodies(ElementKind::Hex8, 2).assemble(&Material::STEEL, MassRule::Consistent);
    let manifest = write_model(folder.path(), &body.raw_model(), Triangle::Lower);
    let text = fs::read_to_string(&manifest).expect("a manifest");
    fs::write(&manifest, format!("{text}[basis]\nresidual_vectors = [\"centrifugal\"]\n")).expect("written");
    let reports = json(folder.path(), "convert model.toml -o b.h5 --split --modes 5 --json");
    for report in reports["bodies"].as_array().expect("a list") {
        assert_eq!(loads(report).len(), 6);
    }
}
