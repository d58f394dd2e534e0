//! Modes computed on a cluster: the files of `prepare`, and the bodies that `assemble` makes or refuses. The
//! tests write results in the form of the driver, from modes of the built-in solver; `tests/peers` runs the
//! driver itself.

use crate::program::flexbody;
use faer::Mat;
use flexbody_base::provenance::sha256_hex;
use flexbody_body::basis::{ModeSettings, free_surface, rigid_modes};
use flexbody_cluster::Budget;
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use nalgebra::Vector3;
use oracle::{fixtures, members};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const MODES: usize = 6;

/// A prepared folder `job` and the result of a cluster for it.
struct Job {
    place: TempDir,
    vectors: Mat<f64>,
    result: Value,
    model: FeModel,
}

fn manifest(model: &str) -> PathBuf {
    fixtures().join("models").join(model).join("model.toml")
}

/// Returns the two lines of a file of the cluster: head with checksum, and body.
fn sealed(format: &str, content: &Value) -> String {
    let body = content.to_string();
    let head = json!({ "format": format, "version": 1, "sha256": sha256_hex(body.as_bytes()) });
    format!("{head}\n{body}\n")
}

fn content(path: &Path) -> Value {
    let text = fs::read_to_string(path).expect("a file");
    serde_json::from_str(text.lines().nth(1).expect("two lines")).expect("JSON")
}

/// Returns X' M X of X = [rigid modes, e_b x modes for each axis b, modes] of a solid.
fn condensed(model: &FeModel, modes: &Mat<f64>) -> Mat<f64> {
    let rigid = rigid_modes(model, &model.pencil()).expect("rigid modes");
    let (n, count, first) = (modes.nrows(), modes.ncols(), rigid.ncols());
    let x = Mat::from_fn(n, first + 4 * count, |row, j| {
        match j.checked_sub(first).map(|j| (j / count, j % count)) {
            None => rigid[(row, j)],
            Some((3, mode)) => modes[(row, mode)],
            Some((axis, mode)) => {
                let node = row - row % 3;
                let shape = Vector3::from_fn(|k, _| modes[(node + k, mode)]);
                Vector3::ith(axis, 1.0).cross(&shape)[row % 3]
            }
        }
    });
    x.transpose() * model.pencil().apply_mass(x.as_ref())
}

/// Returns columns in the vector format of PETSc.
fn petsc(columns: &Mat<f64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for j in 0..columns.ncols() {
        bytes.extend(1_211_214_i32.to_be_bytes());
        bytes.extend((columns.nrows() as i32).to_be_bytes());
        columns.col(j).iter().for_each(|value| bytes.extend(value.to_be_bytes()));
    }
    bytes
}

impl Job {
    /// Prepares `job` from a model of solids, whose rows are written in the order of the model.
    fn new(model: &str) -> Self {
        let place = tempfile::tempdir().expect("a folder");
        let path = manifest(model).display().to_string();
        let modes = MODES.to_string();
        let run = flexbody(place.path(), &["prepare", &path, "--modes", &modes, "-o", "job"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let raw = read_model(&read_manifest(manifest(model)).expect("a manifest")).expect("a model");
        let model = FeModel::from_raw(raw).expect("a model").model;
        let settings = ModeSettings { wanted: Wanted::Lowest(MODES), ..ModeSettings::default() };
        let found = free_surface(&model, &settings, &Context::QUIET).expect("modes").solution;
        let prepared = content(&place.path().join("job/prepared.jsonl"));
        let completeness = found.completeness;
        let result = json!({
            "matrices": prepared["matrices"], "wanted": MODES, "modes": found.eigenvalues.len(), "index_bytes": 4,
            "eigenvalues": found.eigenvalues, "residuals": found.residuals, "next_eigenvalue": found.next_eigenvalue,
            "count": { "negative": completeness.negative_pivots, "zero": 0, "shift": completeness.shift, "by": "the tests" },
            "solver": "mumps", "slepc": "0", "petsc": "0", "ranks": 2, "seconds": {}, "factor": {},
        });
        Self { place, vectors: found.vectors, result, model }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.place.path().join("job").join(name)
    }

    /// Writes the result with matching checksums.
    fn write(&mut self) {
        let bytes = petsc(&self.vectors);
        self.result["modes_sha256"] = sha256_hex(&bytes).into();
        fs::write(self.path("modes.petsc"), bytes).expect("written");
        self.write_condensed(&condensed(&self.model, &self.vectors));
    }

    /// Writes the result with these products of condensation.
    fn write_condensed(&mut self, products: &Mat<f64>) {
        let bytes = petsc(products);
        self.result["condensed_sha256"] = sha256_hex(&bytes).into();
        fs::write(self.path("condensed.petsc"), bytes).expect("written");
        fs::write(self.path("result.jsonl"), sealed("flexbody-result", &self.result)).expect("written");
    }

    /// Runs `assemble` with further words; returns exit code and messages.
    fn assemble(&self, more: &[&str]) -> (i32, String) {
        let words = [&["assemble", "job", "-o", "body.flex.h5"], more].concat();
        let run = flexbody(self.place.path(), &words);
        let said = String::from_utf8_lossy(&run.stderr) + String::from_utf8_lossy(&run.stdout);
        (run.status.code().expect("a code"), said.into_owned())
    }

    /// Asserts that the result is refused with this code, exit code and message, and that nothing is written.
    fn refused(&self, more: &[&str], code: &str, exit: i32, words: &str) {
        let before = members(self.place.path());
        let (found, said) = self.assemble(more);
        assert!(found == exit && said.contains(code) && said.contains(words), "{found}: {said}");
        assert_eq!(members(self.place.path()), before, "nothing is left");
    }
}

#[test]
fn a_body_of_a_cluster_is_that_of_the_built_in_engine() {
    let mut job = Job::new("bracket_hex20");
    job.write();
    let names =
        ["condensed.petsc", "driver.py", "mass.petsc", "modes.petsc", "prepared.jsonl", "result.jsonl"];
    let more = ["rigid.petsc", "stiffness.petsc", "turn-x.petsc", "turn-y.petsc", "turn-z.petsc"];
    assert_eq!(members(&job.path("")), [&names[..], &more].concat());
    let (exit, said) = job.assemble(&[]);
    assert_eq!(exit, 0, "{said}");
    assert!(said.contains("by the tests (2 ranks)") && said.contains("not recomputed"), "{said}");
    assert!(said.contains("FB765"), "{said}");
    let model = manifest("bracket_hex20").display().to_string();
    let modes = MODES.to_string();
    let own = flexbody(job.place.path(), &["convert", &model, "--modes", &modes, "-o", "own.flex.h5"]);
    assert!(own.status.success());
    let strict = ["--frequency", "1e-12", "--invariants", "1e-11"];
    let compare = [&["compare", "own.flex.h5", "body.flex.h5"][..], &strict].concat();
    let compared = flexbody(job.place.path(), &compare);
    assert!(compared.status.success(), "{}", String::from_utf8_lossy(&compared.stdout));
    let first = fs::read(job.place.path().join("body.flex.h5")).expect("a body");
    assert_eq!(job.assemble(&["--threads", "1"]).0, 0);
    assert_eq!(fs::read(job.place.path().join("body.flex.h5")).expect("a body"), first, "the same bytes");
}

#[test]
fn the_count_of_our_own_is_made_where_it_is_asked_for() {
    let mut job = Job::new("bracket_hex20");
    job.result["count"] = Value::Null;
    job.write();
    let (exit, said) = job.assemble(&[]);
    assert!(exit == 0 && said.contains("NOT PROVED: the solver made no inertia count"), "{said}");
    let (exit, said) = job.assemble(&["--prove"]);
    assert!(exit == 0 && said.contains("proved      6 flexible + 6 rigid modes"), "{said}");
}

#[test]
fn what_the_model_or_the_result_contradicts_is_refused() {
    let mut job = Job::new("bracket_hex20");
    job.refused(&[], "FB763", 2, "no mode is saved yet");
    let parts = json!([{ "file": "kept-0001.petsc", "sha256": "", "vectors": 4 }]);
    let kept = json!({ "matrices": job.result["matrices"], "parts": parts });
    fs::write(job.path("checkpoint.jsonl"), sealed("flexbody-kept", &kept)).expect("written");
    job.refused(&[], "FB763", 2, "4 modes are saved");
    job.write();
    let other = manifest("cube_hex8").display().to_string();
    job.refused(&["--model", &other], "FB762", 2, "differ from those that the folder was prepared with");

    let matrices = std::mem::replace(&mut job.result["matrices"], "another".into());
    job.write();
    job.refused(&[], "FB762", 2, "other matrices");
    job.result["matrices"] = matrices;

    let last = job.vectors.ncols() - 1;
    let right = job.vectors[(7, last)];
    job.vectors[(7, last)] += 1e-3 * right.abs().max(1e-3);
    job.write();
    job.refused(&[], "FB764", 3, "not eigenvectors of the model");
    job.vectors[(7, last)] = f64::NAN;
    job.write();
    job.refused(&[], "FB760", 2, "finite numbers");
    job.vectors[(7, last)] = right;

    let stated = job.result["eigenvalues"][2].as_f64().expect("a number");
    job.result["eigenvalues"][2] = (1.01 * stated).into();
    job.write();
    job.refused(&[], "FB764", 3, "Rayleigh quotient");
    job.result["eigenvalues"][2] = stated.into();
    let counted = job.result["count"]["negative"].as_u64().expect("a count");
    job.result["count"]["negative"] = (counted + 1).into();
    job.write();
    job.refused(&[], "FB506", 3, "its inertia count is 13");
    job.result["count"]["negative"] = counted.into();
    job.write();
    assert_eq!(job.assemble(&[]).0, 0, "the result as it was is taken");
}

#[test]
fn products_of_condensation_are_held_to_the_mass_matrix() {
    let mut job = Job::new("bracket_hex20");
    job.write();
    let whole = condensed(&job.model, &job.vectors);
    let last = whole.ncols() - 1;
    for (i, j) in [(0, 0), (3, last), (8, 8), (last, last)] {
        let mut products = whole.clone();
        products[(i, j)] += 1e-9 * whole[(i, i)].abs().max(1e-3);
        job.write_condensed(&products);
        job.refused(&[], "FB764", 3, "products of condensation differ from those of the mass matrix");
    }
    job.write_condensed(&whole.subcols(0, last).to_owned());
    job.refused(&[], "FB760", 2, "cannot be read");
    job.write_condensed(&whole);
    assert_eq!(job.assemble(&[]).0, 0);
    let mut bytes = fs::read(job.path("condensed.petsc")).expect("a file");
    bytes[100] ^= 1;
    fs::write(job.path("condensed.petsc"), &bytes).expect("written");
    job.refused(&[], "FB761", 1, "the products of condensation changed since");
    // Drivers of earlier versions did not compute these products.
    job.result.as_object_mut().expect("a table").remove("condensed_sha256");
    fs::write(job.path("result.jsonl"), sealed("flexbody-result", &job.result)).expect("written");
    assert_eq!(job.assemble(&[]).0, 0);
}

#[test]
fn a_mode_that_is_missing_is_seen_by_the_count_of_our_own() {
    let mut job = Job::new("bracket_hex20");
    let kept: Vec<usize> = (0..job.vectors.ncols()).filter(|j| *j != 2).collect();
    let vectors = job.vectors.clone();
    job.vectors = Mat::from_fn(vectors.nrows(), kept.len(), |i, j| vectors[(i, kept[j])]);
    let eigenvalues = job.result["eigenvalues"].as_array().expect("a list").clone();
    job.result["eigenvalues"] = kept.iter().map(|&j| eigenvalues[j].clone()).collect();
    job.result["modes"] = kept.len().into();
    job.result["count"]["negative"] = (6 + kept.len()).into();
    job.write();
    job.refused(&["--prove"], "FB5", 3, "flexible modes below");
}

#[test]
fn files_that_were_changed_are_refused() {
    let mut job = Job::new("bracket_hex20");
    job.write();
    let whole = fs::read(job.path("modes.petsc")).expect("a file");
    let mut bytes = whole.clone();
    bytes[100] ^= 1;
    fs::write(job.path("modes.petsc"), &bytes).expect("written");
    job.refused(&[], "FB761", 1, "the modes changed since");
    fs::write(job.path("modes.petsc"), &whole[..whole.len() - 8]).expect("written");
    job.refused(&[], "FB761", 1, "the modes changed since");
    fs::remove_file(job.path("modes.petsc")).expect("removed");
    job.refused(&[], "FB760", 2, "cannot be read");
    fs::write(job.path("modes.petsc"), &whole).expect("written");

    for (name, old, new) in
        [("result.jsonl", "\"ranks\":2", "\"ranks\":3"), ("prepared.jsonl", "\"modes\":6", "\"modes\":5")]
    {
        let text = fs::read_to_string(job.path(name)).expect("a file");
        assert!(text.contains(old), "{text}");
        fs::write(job.path(name), text.replace(old, new)).expect("written");
        job.refused(&[], "FB761", 1, "the content of the file changed since it was written");
        fs::write(job.path(name), text.replace("\"version\":1", "\"version\":2")).expect("written");
        job.refused(&[], "FB760", 2, "version 2");
        fs::write(job.path(name), "no lines").expect("written");
        job.refused(&[], "FB760", 2, "file is not a `flexbody-");
        fs::write(job.path(name), text).expect("written");
    }
    assert_eq!(job.assemble(&[]).0, 0, "the files as they were are taken");
}

#[test]
fn where_mpi_or_python_are_not_there_it_is_said() {
    let place = tempfile::tempdir().expect("a folder");
    let model = manifest("cube_hex8").display().to_string();
    let convert = ["convert", &model, "--engine", "slepc", "-o", "body.flex.h5"];
    for (more, code, exit, words) in [
        (&["--mpiexec", "no-such-mpi"][..], "FB766", 2, "`no-such-mpi` cannot be started"),
        (
            &["--python", "no-such-python", "--mpiexec", "true"],
            "FB766",
            2,
            "no-such-python cannot be started",
        ),
        (&["--python", "false", "--mpiexec", "true"], "FB766", 2, "no Python with petsc4py"),
        (&["--python", "true", "--mpiexec", "false"], "FB767", 3, "false ended with"),
        (&["--python", "true", "--mpiexec", "true"], "FB763", 2, "there is no result"),
        (&["--basis", "craig-bampton"], "FB801", 2, "needs --basis free"),
        (&["--accuracy", "certified"], "FB801", 2, "certified needs --engine built-in"),
    ] {
        let run = flexbody(place.path(), &[&convert, more].concat());
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(exit) && said.contains(code) && said.contains(words), "{said}");
        assert!(!place.path().join("body.flex.h5").exists());
    }
    // Files for a later resumption remain if the cluster run was started.
    assert_eq!(members(place.path()), ["body.flex.h5.cluster"]);
}

/// Writes a list of two bodies; `more` is added to the second.
fn list(place: &Path, more: &str) {
    let model = |name: &str| manifest(name).display().to_string();
    let (one, two) = (model("cube_hex8"), model("bracket_hex20"));
    let bodies = format!(
        "[[body]]\nmodel = \"{one}\"\noutput = \"one.flex.h5\"\n[[body]]\nmodel = \"{two}\"\noutput = \"two.flex.h5\"\noptions = [{more}]\n"
    );
    fs::write(place.join("list.toml"), format!("options = [\"--lumped\", \"none\"]\n{bodies}"))
        .expect("written");
}

fn batch(place: &Path) -> (i32, Value) {
    let run =
        flexbody(place, &["batch", "list.toml", "--json", "--report", "all.html", "--report", "all.txt"]);
    (run.status.code().expect("a code"), serde_json::from_slice(&run.stdout).expect("JSON"))
}

fn states(told: &Value) -> Vec<&str> {
    let bodies = told["results"]["bodies"].as_array().expect("a list");
    bodies.iter().map(|body| body["state"].as_str().expect("a state")).collect()
}

#[test]
fn a_batch_makes_what_is_not_there_and_tells_of_all() {
    let place = tempfile::tempdir().expect("a folder");
    let place = place.path();
    list(place, "\"--modes\", \"1000\", \"--memory-limit\", \"1M\"");
    let (exit, told) = batch(place);
    assert_eq!((exit, states(&told)), (1, vec!["done", "failed"]), "{told:#}");
    assert_eq!(told["diagnostics"][0]["code"], "FB771");
    assert!(told["results"]["bodies"][1]["error"].as_str().expect("a text").starts_with("FB601"), "{told:#}");
    let first = fs::metadata(place.join("one.flex.h5")).expect("a body").modified().expect("a time");
    list(place, "\"--modes\", \"4\"");
    let (exit, told) = batch(place);
    assert_eq!((exit, states(&told)), (0, vec!["unchanged", "done"]), "{told:#}");
    assert_eq!(fs::metadata(place.join("one.flex.h5")).expect("a body").modified().expect("a time"), first);
    assert_eq!(told["results"]["bodies"][1]["modes"], 4);
    assert!(fs::read_to_string(place.join("all.html")).expect("a page").contains("two.flex.h5"));
    // A changed body is converted again.
    fs::write(place.join("two.flex.h5"), "no body").expect("written");
    let (exit, told) = batch(place);
    assert_eq!((exit, states(&told)), (0, vec!["unchanged", "done"]), "{told:#}");
    let (exit, told) = batch(place);
    assert_eq!((exit, states(&told)), (0, vec!["unchanged", "unchanged"]), "{told:#}");
}

/// A note before the error is not reported as the cause of a failure.
#[test]
fn a_batch_tells_the_first_error_of_what_fails() {
    let place = tempfile::tempdir().expect("a folder");
    let place = place.path();
    let brick = fixtures().join("small/brick");
    for file in members(&brick) {
        fs::copy(brick.join(&file), place.join(&file)).expect("copied");
    }
    // Node 9 has no rows, which gives a note; node 8 is displaced, so that rigid motion strains the body.
    let nodes = fs::read_to_string(place.join("nodes.csv")).expect("nodes");
    let moved: String = nodes
        .lines()
        .map(|line| if line.starts_with("8,") { "8,0.3,0.3,0.3\n".to_owned() } else { format!("{line}\n") })
        .collect();
    fs::write(place.join("nodes.csv"), moved + "9,1,1,1\n").expect("written");
    fs::write(place.join("list.toml"), "[[body]]\nmodel = \"model.toml\"\noutput = \"b.h5\"\n")
        .expect("written");
    let (exit, told) = batch(place);
    let error = told["results"]["bodies"][0]["error"].as_str().expect("a text");
    assert!(exit == 1 && error.starts_with("FB410"), "{told:#}");
}

#[test]
fn a_list_that_cannot_be_read_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let place = place.path();
    for (text, words) in [
        ("", "has no [[body]]"),
        ("[[body]]\nmodel = \"a.toml\"\n", "missing field `output`"),
        ("parallel = 0\n[[body]]\nmodel = \"a.toml\"\noutput = \"a.h5\"\n", "at least 1"),
        ("[[body]]\nmodel = \"a.toml\"\noutput = \"a.h5\"\noptions = [\"--melt\"]\n", "--melt"),
    ] {
        fs::write(place.join("list.toml"), text).expect("written");
        let run = flexbody(place, &["batch", "list.toml"]);
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.code() == Some(2) && said.contains("FB770") && said.contains(words), "{said}");
        assert_eq!(members(place), ["list.toml"]);
    }
}

#[test]
fn a_batch_begins_what_fits_the_memory() {
    let budget = Budget { memory: 100, parallel: 2 };
    assert_eq!(budget.next(&[60, 30], &[]), Some(0));
    assert_eq!(budget.next(&[60, 30], &[50]), Some(1), "a small one passes a large one");
    assert_eq!(budget.next(&[60], &[50]), None);
    assert_eq!(budget.next(&[10], &[10, 10]), None, "as many as there may be");
    assert_eq!(budget.next(&[500], &[]), Some(0), "what never fits runs alone, and says so itself");
    assert_eq!(budget.next(&[500], &[10]), None);
    assert_eq!(budget.next(&[], &[]), None);
    assert_eq!((budget.limit(40), budget.limit(90)), (50, 100));
}
