//! With `--json` every command prints one object according to `schemas/output.schema.json`, for every
//! outcome; denied warnings end a run.

use crate::program::flexbody;
use flexbody::program::Arguments;
use jsonschema::{Retrieve, Uri};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::mesh::Mesh;
use serde_json::Value;
use std::error::Error;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const SCENE: &str = "[run]\nduration = 0.001\noutputs = 20\n[initial]\nangular_velocity = [10, 30, 5]\n";

const LIST: &str =
    "[[body]]\nmodel = \"model.toml\"\noutput = \"listed.h5\"\noptions = [\"--modes\", \"4\"]\n";

const CUT: &str = "\n[[recovery]]\nname = \"root\"\nbox = { min = [-1, -1, -1], max = [0.2, 1, 1] }\n";

/// Retriever of schemas in the folder of the referring schema.
struct Folder;

impl Retrieve for Folder {
    fn retrieve(&self, uri: &Uri<String>) -> Result<Value, Box<dyn Error + Send + Sync>> {
        let name = uri.path().as_str().rsplit('/').next().unwrap_or_default();
        let path = oracle::root().join("schemas").join(name);
        Ok(serde_json::from_str(&fs::read_to_string(path)?)?)
    }
}

fn schema() -> jsonschema::Validator {
    let schema: Value = serde_json::from_str(include_str!("../../schemas/output.schema.json")).expect("JSON");
    let options = jsonschema::options().with_base_uri("file:///schemas/output.schema.json");
    options.with_retriever(Folder).build(&schema).expect("a schema")
}

/// Creates a folder with a block with a lumped mass, which causes a warning, its body and a scene.
pub fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = Mesh::block(ElementKind::Hex8, [3, 2, 1], [0.4, 0.15, 0.1]);
    let raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).with_lumped_mass().raw_model();
    write_model(folder.path(), &raw, Triangle::Lower);
    fs::write(folder.path().join("scene.toml"), SCENE).expect("written");
    let manifest = fs::read_to_string(folder.path().join("model.toml")).expect("a manifest");
    fs::write(folder.path().join("cut.toml"), manifest + CUT).expect("written");
    fs::write(folder.path().join("list.toml"), LIST).expect("written");
    let words = ["convert", "model.toml", "--modes", "4", "--quiet", "-o", "b.h5"];
    assert!(flexbody(folder.path(), &words).status.success());
    folder
}

/// Returns the output of a run: one object that the schema accepts, with its exit code, and nothing on
/// stderr.
fn told(place: &Path, line: &str) -> Value {
    let words: Vec<&str> = line.split_whitespace().collect();
    let run = flexbody(place, &words);
    assert!(run.stderr.is_empty(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
    let told: Value = serde_json::from_slice(&run.stdout)
        .unwrap_or_else(|e| panic!("{line}: {e}: {}", String::from_utf8_lossy(&run.stdout)));
    let wrong: Vec<String> = schema().iter_errors(&told).map(|error| error.to_string()).collect();
    assert!(wrong.is_empty(), "{line}: {wrong:?}");
    assert_eq!(told["exit_code"].as_i64(), run.status.code().map(i64::from), "{line}");
    told
}

fn codes(told: &Value) -> Vec<&str> {
    let all = told["diagnostics"].as_array().expect("a list");
    all.iter().map(|diagnostic| diagnostic["code"].as_str().expect("a code")).collect()
}

#[test]
fn every_command_prints_an_object_of_the_schema() {
    let folder = folder();
    let place = folder.path();
    let lines = [
        ("convert model.toml --modes 4 -o new.h5", 0),
        ("convert model.toml --modes 4 -o new.h5 --split", 0),
        ("convert model.toml --max-frequency 1 -o none.h5", 2),
        ("prepare model.toml --modes 4 -o job", 0),
        ("prepare nothing.toml -o job", 2),
        ("assemble job -o assembled.h5", 2),
        ("batch list.toml", 0),
        ("batch nothing.toml", 2),
        ("inspect b.h5", 0),
        ("inspect b.h5 --structure", 0),
        ("inspect nothing.h5", 2),
        ("check b.h5", 0),
        ("check b.h5 --against model.toml", 0),
        ("compare b.h5 b.h5", 0),
        ("select b.h5 --scene scene.toml", 0),
        ("simulate b.h5 --scene scene.toml", 0),
        ("simulate b.h5 --scene model.toml", 2),
        ("simulate b.h5 --scene scene.toml --csv run.csv", 0),
        ("measure b.h5 --scene scene.toml --history run.csv", 0),
        ("measure b.h5 --scene scene.toml --history scene.toml", 2),
        ("convert cut.toml --modes 4 -o cut.h5", 0),
        ("recover cut.h5 --history run.csv -o rows.csv", 0),
        ("recover b.h5 --history run.csv -o rows.csv", 2),
        ("shapes b.h5 --model model.toml --to csv -o ask.csv", 0),
        ("shapes b.h5 --model model.toml -o ask.inp", 2),
        ("trade b.h5 --scene scene.toml --repeat 1", 0),
        ("response b.h5 --band 0..1000 --from 1 --to 2", 0),
        (
            "response model.toml b.h5 --band 10..20 --from 1 --to 1:z --solves 2 --points 4 --tolerance 1000",
            0,
        ),
        ("response b.h5 --band 0..1000 --from nowhere --to 2", 2),
        ("view b.h5 -o b.html", 0),
        ("view b.h5 --simulation scene.toml -o b.html", 2),
        ("export b.h5 --to sid -o b.sid --allow-loss", 0),
        ("export b.h5 --to nothing -o b.x", 2),
        ("audit b.sid", 0),
        ("audit b.h5 --from sid", 2),
        ("reduce b.h5 --keep-modes 1 --terms W1 -o small.h5", 0),
        ("reduce b.h5 -o same.h5", 2),
        ("advise b.h5 --spin 10", 0),
        ("advise b.h5 --attached heavy", 2),
        ("recipe calculix", 0),
        ("recipe patran", 2),
        ("explain FB408", 0),
        ("explain", 0),
        ("explain FB000", 2),
        ("doctor", 0),
        ("completions bash", 0),
        ("completions tcsh", 2),
        ("man convert", 0),
        ("man melt", 2),
    ];
    let mut commands = Vec::new();
    for (line, code) in lines {
        let told = told(place, &format!("{line} --json"));
        let command = line.split(' ').next().expect("a command");
        assert_eq!(told["command"], command);
        assert_eq!(
            (&told["exit_code"], &told["passed"]),
            (&code.into(), &(code == 0).into()),
            "{line}: {told:#}"
        );
        commands.push(command);
    }
    // A new command needs a line in this test.
    for command in <Arguments as clap::CommandFactory>::command().get_subcommands() {
        assert!(command.get_name() == "help" || commands.contains(&command.get_name()), "{command}");
    }
    assert_eq!(told(place, "melt --json")["command"], Value::Null);
    assert_eq!(told(place, "check --json")["command"], "check");
}

#[test]
fn a_check_tells_its_warnings() {
    let folder = folder();
    let place = folder.path();
    assert!(codes(&told(place, "check b.h5 --against model.toml --json")).is_empty());
    let nodes = fs::read_to_string(place.join("nodes.csv")).expect("a table");
    fs::write(place.join("nodes.csv"), nodes + "\n").expect("written");
    let warned = told(place, "check b.h5 --against model.toml --json");
    assert_eq!(
        (codes(&warned), &warned["warnings"], &warned["passed"]),
        (vec!["FB706"], &1.into(), &true.into())
    );
    assert_eq!(warned["results"]["identities"][0]["name"], "finite");
    let denied = told(place, "check b.h5 --against model.toml --json --deny-warnings");
    assert_eq!((codes(&denied), &denied["passed"]), (vec!["FB706"], &false.into()));
    assert_eq!((&denied["exit_code"], &denied["results"]), (&1.into(), &warned["results"]));
}

#[test]
fn errors_come_with_the_warnings_before_them() {
    let folder = folder();
    let refused = told(folder.path(), "convert model.toml --max-frequency 1 -o none.h5 --json");
    assert_eq!(codes(&refused), ["FB412", "FB512"]);
}

#[test]
fn denied_warnings_leave_nothing_behind() {
    let folder = folder();
    let place = folder.path();
    let names = || {
        let mut names: Vec<_> =
            fs::read_dir(place).expect("a folder").map(|e| e.expect("an entry").file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    let lines = [
        ("convert model.toml --modes 4 -o new.h5 --report new.html", "FB412"),
        ("convert model.toml --modes 4 -o new.h5 --split", "FB412"),
    ];
    for (line, code) in lines {
        let denied = told(place, &format!("{line} --json --deny-warnings"));
        let found = codes(&denied);
        assert!(found.contains(&code) && found.last() == Some(&"FB715"), "{line}: {found:?}");
        assert_eq!((&denied["exit_code"], &denied["results"]), (&1.into(), &Value::Null), "{line}");
        assert_eq!(names(), before, "{line}");
    }
    let words = ["convert", "model.toml", "--modes", "4", "-o", "new.h5", "--deny-warnings"];
    let run = flexbody(place, &words);
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(said.contains("warning[FB412]") && said.contains("error[FB715]"), "{said}");
    assert_eq!(said.matches("FB412]").count(), 1, "{said}");
}
