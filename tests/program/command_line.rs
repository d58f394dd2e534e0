//! The program on the command line: exit codes, output on stdout and stderr, files left on disk.

#[allow(dead_code)] // `main` of the example is unused
#[path = "../../examples/from_memory.rs"]
mod from_memory;

use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{DofOrder, Numbering, Triangle, reordered, write_model};
use oracle::members;
use oracle::mesh::{Assembly, Mesh};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Exit code and output of a run of the program.
struct Run {
    code: i32,
    out: String,
    err: String,
}

impl Run {
    fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}: {}", self.out))
    }

    /// Returns the results in the JSON output of the command.
    fn results(&self) -> Value {
        self.json()["results"].take()
    }
}

/// Runs `flexbody` in `folder` with the words of `line`.
fn flexbody(folder: &Path, line: &str) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    Run {
        code: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Runs `flexbody`, asserts that it succeeds, and returns the run.
fn done(folder: &Path, line: &str) -> Run {
    let run = flexbody(folder, line);
    assert_eq!(run.code, 0, "{line}: {}{}", run.out, run.err);
    run
}

fn fixture(name: &str) -> PathBuf {
    oracle::fixtures().join("models").join(name)
}

fn block() -> Assembly {
    Mesh::block(ElementKind::Hex8, [4, 2, 2], [0.4, 0.15, 0.1])
        .assemble(&Material::STEEL, MassRule::Consistent)
}

/// Creates a folder with a small steel block: `model.toml`, `K.mtx`, `M.mtx`, `nodes.csv`.
fn model() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_model(folder.path(), &block().raw_model(), Triangle::Lower);
    folder
}

#[test]
fn usage_errors_end_with_2_say_what_is_wrong_and_write_nothing() {
    let folder = model();
    let before = members(folder.path());
    for (line, said) in [
        ("", "Usage: flexbody <COMMAND>"),
        ("melt", "unrecognized subcommand 'melt'"),
        ("convert", "--output <BODY.flex.h5>"),
        ("convert model.toml", "--output <BODY.flex.h5>"),
        ("convert -o b.h5", "<MODEL.toml|JOB.inp>"),
        (
            "convert model.toml -o b.h5 --interface a=B",
            "--interface applies to --stiffness and jobs; add [[interface]]",
        ),
        ("convert model.toml -o b.h5 --format calculix", "--format applies to jobs"),
        ("convert job.inp -o b.h5 --format patran", "[possible values: calculix, abaqus, nastran]"),
        ("convert job.inp -o b.h5 --interface a=B,glued", "`glued` is not a coupling"),
        ("convert job.inp -o b.h5 --interface =B", "expected NAME=NODES"),
        ("convert job.inp -o b.h5", "error[FB101]"),
        ("select b.h5 --scene s.toml --units mm,t,s", "--units applies to the jobs of FE programs"),
        ("trade b.h5 --scene s.toml --interface A", "--interface applies to the jobs of FE programs"),
        ("response model.toml --format calculix --band 0..9", "--format applies to jobs"),
        ("response job.inp --band 0..9 --from 1 --to 1", "error[FB101]"),
        ("check b.h5 --units mm,t,s", "--units describes the job of --against"),
        ("check model.toml --against model.toml --units mm,t,s", "error[FB701]"),
        ("convert model.toml -o b.h5 --modes 0", "--basis craig-bampton for static condensation"),
        ("convert model.toml -o b.h5 --modes ten", "invalid digit"),
        ("convert model.toml -o b.h5 --modes 5 --max-frequency 100", "cannot be used with"),
        ("convert model.toml -o b.h5 --max-frequency=-1", "expected a positive number"),
        ("convert model.toml -o b.h5 --max-frequency nan", "expected a positive number"),
        ("convert model.toml -o b.h5 --threads 0", "0 is not in 1.."),
        ("convert model.toml -o b.h5 --accuracy exact", "[possible values: fast, standard, certified]"),
        ("convert model.toml -o b.h5 --frame moon", "expected com, principal, model or interface=NAME"),
        ("convert model.toml -o b.h5 --stiffness K.mtx", "cannot be used with"),
        ("convert --stiffness K.mtx -o b.h5", "--mass <FILE>"),
        ("convert --stiffness K.mtx --mass M.mtx --nodes nodes.csv --units m,kg -o b.h5", "error[FB202]"),
        ("convert model.toml -o b.h5 --report b.pdf", "error[FB801]: report b.pdf has no known extension"),
        ("convert model.toml -o b.h5 --lumped best", "error[FB802]: `best` is not a lumping scheme"),
        ("convert model.toml -o b.h5 --lumped user=", "error[FB802]: `user=` is not a lumping scheme"),
        (
            "convert model.toml -o b.h5 --lumped row-sum,row-sum",
            "error[FB802]: a lumping scheme is named twice",
        ),
        ("convert absent.toml -o b.h5", "error[FB101]"),
        ("compare a.h5", "<B.flex.h5>"),
        ("compare a.h5 b.h5 --mass 0", "expected a positive number"),
        ("compare a.h5 b.h5 --frequency 1%%", "expected a positive number or percentage (0.01 or 1%)"),
        (
            "advise b.h5 --deflection 1x",
            "expected a positive length, or a percentage of the largest extent (1%)",
        ),
        ("advise b.h5 --limit=-5%", "expected a positive number or percentage"),
        ("inspect absent.h5", "error[FB101]"),
        ("check model.toml", "error[FB701]"),
    ] {
        let run = flexbody(folder.path(), line);
        assert_eq!(run.code, 2, "{line}: {}", run.err);
        assert!(run.err.contains(said), "{line}: {}", run.err);
        assert_eq!(run.out, "", "{line}");
        assert_eq!(members(folder.path()), before, "{line}");
    }
}

#[test]
fn help_and_version_are_results() {
    let folder = tempfile::tempdir().unwrap();
    assert!(done(folder.path(), "help convert").out.contains("--lumped-modes"));
    assert!(done(folder.path(), "--help").out.contains("Exit codes: 0 done;"));
    assert_eq!(done(folder.path(), "--version").out, format!("flexbody {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let folder = model();
    fs::create_dir(folder.path().join("taken")).unwrap();
    let before = members(folder.path());
    for (line, code, said) in [
        ("-o no/such/b.h5", 2, "error[FB105]: cannot write no/such/b.h5: folder no/such does not exist"),
        ("-o taken", 2, "error[FB107]: cannot write taken: it is a folder"),
        ("-o b.h5 --report taken/no/r.json", 2, "error[FB105]: cannot write taken/no/r.json"),
        ("-o b.h5 --report taken/", 2, "error[FB801]: report taken/ has no known extension"),
    ] {
        // The missing matrix would be reported if the program read files before it checked the options.
        fs::rename(folder.path().join("K.mtx"), folder.path().join("K.away")).unwrap();
        let run = flexbody(folder.path(), &format!("convert model.toml {line}"));
        fs::rename(folder.path().join("K.away"), folder.path().join("K.mtx")).unwrap();
        assert_eq!(run.code, code, "{line}: {}", run.err);
        assert!(run.err.contains(said), "{line}: {}", run.err);
        assert!(!run.err.contains("FB101"), "{line}: {}", run.err);
        assert_eq!(members(folder.path()), before, "{line}");
    }
}

#[test]
fn no_output_replaces_an_input_or_another_output() {
    let folder = model();
    let path = folder.path();
    fs::create_dir(path.join("sub")).unwrap();
    fs::write(path.join("masses.json"), "node,mass\n").unwrap();
    fs::write(path.join("left.json"), "node\n1\n").unwrap();
    let manifest = fs::read_to_string(path.join("model.toml")).unwrap();
    let interface = "[[interface]]\nname = \"left\"\nnodes_file = \"left.json\"\n";
    fs::write(path.join("model.toml"), manifest + interface).unwrap();
    let contents = || -> Vec<_> {
        members(path).iter().filter(|n| *n != "sub").map(|n| fs::read(path.join(n)).unwrap()).collect()
    };
    let before = (members(path), contents());
    for line in [
        "-o K.mtx",
        "-o ./M.mtx",
        "-o sub/../nodes.csv",
        "-o model.toml",
        "-o b.h5 --lumped user=masses.json --report masses.json",
        "-o b.h5 --report left.json",
        "-o same.json --report same.json",
        "-o b.h5 --report r.json --report ./r.json",
    ] {
        let run = flexbody(path, &format!("convert model.toml {line}"));
        assert_eq!(run.code, 2, "{line}: {}", run.err);
        assert!(run.err.contains("error[FB801]: output"), "{line}: {}", run.err);
        assert!(run.err.contains("is an input or another output of this run"), "{line}: {}", run.err);
        assert_eq!((members(path), contents()), before, "{line}");
    }
}

#[test]
#[ignore = "slow"]
fn the_file_is_the_same_bytes_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = fixture("bracket_hex20").join("model.toml");
    let bytes: Vec<Vec<u8>> = [1, 2, 3]
        .map(|threads| {
            let run = done(
                folder.path(),
                &format!(
                    "convert {} -o {threads}.h5 --lumped-modes --json --threads {threads}",
                    manifest.display()
                ),
            );
            assert_eq!(run.results()["run"]["threads"], threads);
            fs::read(folder.path().join(format!("{threads}.h5"))).unwrap()
        })
        .into();
    assert!(bytes[0].len() > 100_000);
    assert!(bytes[0] == bytes[1], "2 threads give another file than 1");
    assert!(bytes[0] == bytes[2], "3 threads give another file than 1");
}

#[test]
fn json_is_all_that_is_printed_and_holds_the_facts() {
    let folder = model();
    let run =
        done(folder.path(), "convert model.toml -o b.h5 --modes 7 --json --report r.json --report r.txt");
    assert_eq!(run.err, "");
    let json = run.results();
    assert_eq!(json["format"], "flexbody-report");
    assert_eq!(json["modes"]["count"], 7);
    let exact = 7850.0 * 0.4 * 0.15 * 0.1;
    assert!((json["body"]["mass"].as_f64().unwrap() / exact - 1.0).abs() < 1e-12, "{}", json["body"]);
    assert_eq!(json["completeness"]["proved"], true);
    // The report agrees with the JSON output except for the cost of writing it.
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("r.json")).unwrap()).unwrap();
    for key in ["model", "body", "modes", "completeness", "lumped", "diagnostics"] {
        assert_eq!(report[key], json[key], "{key}");
    }
    assert!(fs::read_to_string(folder.path().join("r.txt")).unwrap().contains("7 flexible"));
    assert_eq!(
        members(folder.path()),
        ["K.mtx", "M.mtx", "b.h5", "model.toml", "nodes.csv", "r.json", "r.txt"]
    );
}

#[test]
fn json_tells_errors_too() {
    let folder = model();
    let run = flexbody(folder.path(), "convert model.toml -o b.h5 --max-frequency 1 --json");
    assert_eq!((run.code, run.err.as_str()), (2, ""));
    let json = run.json();
    assert_eq!((&json["exit_code"], &json["errors"]), (&2.into(), &1.into()));
    let diagnostic = &json["diagnostics"][0];
    assert_eq!((&diagnostic["code"], &diagnostic["severity"]), (&"FB512".into(), &"error".into()));
    assert!(diagnostic["message"].as_str().unwrap().contains("first flexible mode"), "{diagnostic}");
    assert!(!folder.path().join("b.h5").exists());
}

#[test]
fn json_tells_usage_errors_too() {
    let folder = model();
    for (line, said) in [
        ("--json", "unexpected argument '--json' found"),
        ("melt --json", "unrecognized subcommand 'melt'"),
        (
            "convert --json model.toml",
            "the following required arguments were not provided: --output <BODY.flex.h5>",
        ),
        (
            "convert model.toml -o b.h5 --modes ten --json",
            "invalid value 'ten' for '--modes <N>': invalid digit",
        ),
        ("convert model.toml -o b.h5 --report b.pdf --json", "report b.pdf has no known extension"),
    ] {
        let run = flexbody(folder.path(), line);
        assert_eq!((run.code, run.err.as_str()), (2, ""), "{line}");
        let json = run.json();
        assert_eq!((&json["exit_code"], &json["errors"]), (&2.into(), &1.into()), "{line}");
        let diagnostic = &json["diagnostics"][0];
        assert_eq!(diagnostic["code"], "FB801", "{line}");
        assert!(diagnostic["message"].as_str().unwrap().starts_with(said), "{line}: {diagnostic}");
    }
    // Help is printed as text even with `--json`; words after `--` are no options.
    assert!(done(folder.path(), "convert --json --help").out.starts_with("Make a flexible body"));
    let run = flexbody(folder.path(), "inspect -- a --json");
    assert!(run.code == 2 && run.out.is_empty() && run.err.starts_with("error: unexpected"), "{}", run.err);
}

#[test]
fn quiet_prints_errors_only() {
    let folder = model();
    let run = done(folder.path(), "convert model.toml -o b.h5 --accuracy fast --quiet");
    assert_eq!((run.out.as_str(), run.err.as_str()), ("", ""));
    let run = flexbody(folder.path(), "convert absent.toml -o b.h5 --quiet");
    assert!(run.code == 2 && run.out.is_empty() && run.err.starts_with("error[FB101]"), "{}", run.err);
}

#[test]
fn matrices_on_the_command_line_are_the_model_of_the_manifest() {
    let folder = model();
    done(folder.path(), "convert model.toml -o a.h5");
    done(folder.path(), "convert --stiffness K.mtx --mass M.mtx --nodes nodes.csv -o b.h5");
    assert!(done(folder.path(), "compare a.h5 b.h5").out.ends_with("the bodies agree\n"));
}

#[test]
fn modes_up_to_a_frequency_are_those_below_it() {
    let folder = model();
    let all = done(folder.path(), "convert model.toml -o a.h5 --json").results();
    let hz = |json: &Value| -> Vec<f64> {
        json["modes"]["frequency_hz"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let all = hz(&all);
    let limit = 0.5 * (all[6] + all[7]);
    let below =
        hz(&done(folder.path(), &format!("convert model.toml -o b.h5 --max-frequency {limit} --json"))
            .results());
    assert_eq!(below.len(), 7);
    assert!(below.iter().zip(&all).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{below:?} {all:?}");
}

#[test]
fn compare_agrees_on_a_model_in_another_order_and_differs_beyond_tolerance() {
    // A cube has repeated eigenvalues and nodes of equal displacement, so that signs and bases depend on the
    // order of nodes.
    let cube = |material: &Material| {
        Mesh::block(ElementKind::Hex8, [5; 3], [0.2; 3]).assemble(material, MassRule::Consistent).raw_model()
    };
    let folders = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let shuffled = reordered(&cube(&Material::STEEL), DofOrder::Shuffled(5), Numbering::Consecutive);
    let stiffer = Material { youngs: Material::STEEL.youngs * (1.0 + 1e-6), ..Material::STEEL };
    write_model(folders[0].path(), &cube(&Material::STEEL), Triangle::Lower);
    write_model(folders[1].path(), &shuffled, Triangle::General);
    write_model(folders[2].path(), &cube(&stiffer), Triangle::Upper);
    let [a, b, c] = [0, 1, 2].map(|i| {
        let path = folders[i].path();
        done(path, "convert model.toml -o body.h5 --accuracy certified --modes 12 --quiet");
        path.join("body.h5").display().to_string()
    });
    let folder = folders[0].path();
    assert!(fs::read(&a).unwrap() != fs::read(&b).unwrap(), "nothing was reordered");
    let same = done(folder, &format!("compare {a} {b}"));
    assert!(same.out.ends_with("the bodies agree\n"), "{}", same.out);
    assert_eq!(done(folder, &format!("compare {a} {b} --json")).json()["passed"], true);

    let other = flexbody(folder, &format!("compare {a} {c}"));
    assert_eq!(other.code, 1, "{}", other.out);
    let frequency = other.out.lines().find(|l| l.starts_with("frequency")).unwrap();
    assert!(frequency.contains("5e-7") && frequency.contains("DIFFERS"), "{frequency}");
    let mass = other.out.lines().find(|l| l.starts_with("mass ")).unwrap();
    assert!(!mass.contains("DIFFERS"), "{mass}");
    let json = flexbody(folder, &format!("compare {a} {c} --json"));
    assert_eq!((json.code, &json.json()["passed"]), (1, &false.into()));
    // The tolerance of frequencies is raised; the modal stiffness is an invariant and needs its own
    // tolerance.
    assert_eq!(flexbody(folder, &format!("compare {a} {c} --frequency 1e-6")).code, 1);
    done(folder, &format!("compare {a} {c} --frequency 1e-6 --invariants 2e-6"));
    // Bodies with different units cannot be compared.
    let manifest = fs::read_to_string(folders[2].path().join("model.toml")).unwrap();
    let units =
        "allow_implausible = true\n[model.units]\nlength = \"m\"\nmass = \"kg\"\ntime = \"ms\"\n[files]";
    fs::write(folders[2].path().join("model.toml"), manifest.replace("[files]", units)).unwrap();
    done(folders[2].path(), "convert model.toml -o body.h5 --modes 12 --quiet");
    let run = flexbody(folder, &format!("compare {a} {c}"));
    assert!(run.code == 2 && run.err.contains("error[FB707]"), "{}", run.err);
}

#[test]
#[ignore = "slow"]
fn check_passes_on_what_convert_wrote_and_recomputes_it_from_the_matrices() {
    for name in ["bar_c3d8r", "bracket_hex20", "connecting_rod", "cube_hex8"] {
        let folder = tempfile::tempdir().unwrap();
        let manifest = fixture(name).join("model.toml").display().to_string();
        done(folder.path(), &format!("convert {manifest} -o b.h5 --quiet"));
        let own = done(folder.path(), "check b.h5");
        assert!(own.out.contains("all 23 identities hold"), "{name}: {}", own.out);
        let against = done(folder.path(), &format!("check b.h5 --against {manifest}"));
        // Interfaces add two identities: their definition, and their reference points.
        let has_interfaces = fs::read_to_string(&manifest).unwrap().contains("[[interface]]");
        let count = if has_interfaces { 31 } else { 29 };
        assert!(against.out.contains(&format!("all {count} identities hold")), "{name}: {}", against.out);
        assert!(!against.err.contains("FB706"), "{name}: {}", against.err);
    }
}

#[test]
fn check_allows_for_what_rounding_takes_from_a_slender_body() {
    // The stiffest element is 1e9 times as stiff as the first bending mode: psi' K psi loses nine digits.
    let folder = tempfile::tempdir().unwrap();
    let beam = Mesh::block(ElementKind::Hex20, [40, 1, 1], [4.0, 0.03, 0.02]);
    let raw = beam.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    write_model(folder.path(), &raw, Triangle::Lower);
    done(folder.path(), "convert model.toml -o b.h5 --quiet");
    let json = done(folder.path(), "check b.h5 --against model.toml --json").results();
    let check =
        json["identities"].as_array().unwrap().iter().find(|c| c["name"] == "stiffness_recomputed").unwrap();
    assert!(check["value"].as_f64().unwrap() > 1e-12, "no rounding to allow for: {check}");
    assert!(check["limit"].as_f64().unwrap() < 1e-5, "{check}");
}

#[test]
fn check_finds_a_model_that_changed() {
    let folder = model();
    done(folder.path(), "convert model.toml -o b.h5 --quiet");
    let stiffer = Material { youngs: Material::STEEL.youngs * (1.0 + 1e-9), ..Material::STEEL };
    let mesh = Mesh::block(ElementKind::Hex8, [4, 2, 2], [0.4, 0.15, 0.1]);
    let changed = mesh.assemble(&stiffer, MassRule::Consistent).raw_model();
    write_model(folder.path(), &changed, Triangle::Lower);
    let run = flexbody(folder.path(), "check b.h5 --against model.toml");
    assert_eq!(run.code, 1, "{}", run.out);
    assert!(run.err.contains("warning[FB706]: stiffness file K.mtx differs from"), "{}", run.err);
    assert!(!run.err.contains("mass file"), "{}", run.err);
    let failed: Vec<_> = run.out.lines().filter(|l| l.ends_with("FAILED")).collect();
    assert!(failed[0].starts_with("stiffness_recomputed"), "{failed:?}");
    let json = flexbody(folder.path(), "check b.h5 --against model.toml --json");
    let names: Vec<_> = json.results()["identities"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|check| check["passed"] == false)
        .map(|check| check["name"].clone())
        .collect();
    assert!(json.code == 1 && names.contains(&"stiffness_recomputed".into()), "{names:?}");
    assert!(!names.contains(&"invariants_recomputed".into()), "{names:?}");

    let smaller = Mesh::block(ElementKind::Hex8, [3, 2, 2], [0.4, 0.15, 0.1]);
    write_model(
        folder.path(),
        &smaller.assemble(&Material::STEEL, MassRule::Consistent).raw_model(),
        Triangle::Lower,
    );
    let run = flexbody(folder.path(), "check b.h5 --against model.toml");
    assert!(run.code == 2 && run.err.contains("error[FB707]"), "{}", run.err);
}

#[test]
fn check_finds_an_identity_that_is_broken() {
    let folder = model();
    done(folder.path(), "convert model.toml -o b.h5 --quiet");
    {
        let file = hdf5_metno::File::open_rw(folder.path().join("b.h5")).unwrap();
        let moment = file.dataset("invariants/first_moment").unwrap();
        moment.write_raw(&[0.0, 0.01, 0.0]).unwrap();
    }
    let run = flexbody(folder.path(), "check b.h5");
    assert_eq!(run.code, 1, "{}{}", run.out, run.err);
    assert!((run.out + &run.err).contains("first_moment"));
    fs::write(folder.path().join("b.h5"), "no body").unwrap();
    let run = flexbody(folder.path(), "check b.h5");
    assert!(run.code == 2 && run.err.contains("error[FB701]"), "{}", run.err);
}

#[test]
fn inspect_tells_what_the_file_holds() {
    let folder = model();
    let converted = done(folder.path(), "convert model.toml -o b.h5 --modes 9 --json").results();
    let text = done(folder.path(), "inspect b.h5").out;
    assert!(text.contains("45 nodes, 135 degrees of freedom, consistent mass"), "{text}");
    assert!(text.contains("9 flexible") && text.contains("proved      9 flexible + 6 rigid modes"), "{text}");
    assert!(!text.contains("wall") && !text.contains("frequency"), "{text}");
    let all = done(folder.path(), "inspect b.h5 --verbose").out;
    assert!(all.contains("proved: 9 flexible + 6 rigid modes") && all.contains("\nfrequency"), "{all}");
    let json = done(folder.path(), "inspect b.h5 --json").results();
    for key in ["model", "body", "modes", "completeness", "lumped"] {
        assert_eq!(json[key], converted[key], "{key}");
    }
    assert_eq!(json["run"], Value::Null);
    let structure = done(folder.path(), "inspect b.h5 --structure").json().to_string();
    assert!(structure.contains("shape") && structure.contains("W2"), "{structure}");
}

#[test]
fn the_summary_says_what_is_approximate() {
    let folder = tempfile::tempdir().unwrap();
    let model = oracle::fixtures().join("models/plane_frame/model.toml");
    let line = format!("convert {} -o b.h5 --modes 4 --storage f32", model.display());
    let text = done(folder.path(), &line).out;
    for part in ["PLANE model", "W1, W2 and W3 take a part of the mass", "rounded to 32-bit floats"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn exports_tell_what_they_lose_in_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let model = oracle::fixtures().join("models/mpc_block/model.toml");
    done(folder.path(), &format!("convert {} -o b.h5 --modes 4", model.display()));
    let lost = |scene: &str| {
        let line = format!("export b.h5 --to exudyn -o b.hdf5 --allow-loss {scene}");
        done(folder.path(), &line).err
    };
    let plain = lost("");
    assert!(plain.contains("changes deflections by 1 % and frequencies by 0.5 % at a spin of"), "{plain}");
    let share = |rate: f64| {
        let scene = format!("[run]\nduration = 1e-4\n[spin]\nrate = {rate}\n");
        std::fs::write(folder.path().join("s.toml"), scene).unwrap();
        let told = lost("--scene s.toml");
        let (_, rest) = told.split_once("at most ").expect("a share");
        rest.split_once(" %").expect("a percentage").0.parse::<f64>().unwrap()
    };
    // The share grows with the square of the spin.
    let (slow, fast) = (share(4e3), share(8e3));
    assert!(slow > 0.1 && (fast / slow - 4.0).abs() < 0.2, "{slow} {fast}");
}

/// Every option of a ratio takes a percentage; a deflection is then relative to the largest extent of the body.
#[test]
fn ratios_may_be_percentages() {
    let folder = tempfile::tempdir().unwrap();
    let model = oracle::fixtures().join("small/brick/model.toml");
    done(folder.path(), &format!("convert {} -o b.h5 --modes 4", model.display()));
    let advice =
        |options: &str| done(folder.path(), &format!("advise b.h5 --spin 10 {options} --json")).json();
    assert_eq!(advice("--limit 2%")["results"], advice("--limit 0.02")["results"]);
    let part = |options: &str| advice(options)["results"]["deflection_ratio"].as_f64().expect("a number");
    assert!((part("--deflection 2%") - 0.02).abs() < 1e-12 && part("") != 0.02);
    done(folder.path(), "compare b.h5 b.h5 --frequency 1% --mass 0.5%");
}

/// Returns the error norms of one scheme of a report.
fn norms<'a>(json: &'a Value, scheme: &str) -> &'a Value {
    let lumped = json["lumped"].as_array().unwrap();
    &lumped.iter().find(|l| l["scheme"] == scheme).unwrap_or_else(|| panic!("no {scheme}"))["error_norms"]
}

#[test]
fn nodal_masses_of_the_user_are_compared_like_any_other_scheme() {
    let folder = model();
    // Row sums written by a user, with the nodes in another order.
    let mut sums = vec![0.0; block().nodes.len()];
    oracle::mesh::entries(&block().scalar_mass).for_each(|(row, _, value)| sums[row as usize] += value);
    let mut rows: Vec<_> = sums.iter().enumerate().map(|(i, m)| format!("{},{m:e}\n", i + 1)).collect();
    rows.reverse();
    fs::write(folder.path().join("masses.csv"), "node,mass\n".to_owned() + &rows.concat()).unwrap();
    let json =
        done(folder.path(), "convert model.toml -o b.h5 --lumped row-sum,user=masses.csv --json").results();
    assert_eq!(json["lumped"].as_array().unwrap().len(), 2);
    let (own, given) = (norms(&json, "row-sum"), norms(&json, "user"));
    assert!(own["W2_spectral"].as_f64().unwrap() > 1e-3, "{own}");
    for (name, value) in own.as_object().unwrap() {
        let difference = value.as_f64().unwrap() - given[name].as_f64().unwrap();
        assert!(difference.abs() < 1e-12, "{name}: {value} {}", given[name]);
    }
    assert!(done(folder.path(), "inspect b.h5").out.contains("user"));

    rows.pop();
    fs::write(folder.path().join("masses.csv"), "node,mass\n".to_owned() + &rows.concat()).unwrap();
    let run = flexbody(folder.path(), "convert model.toml -o c.h5 --lumped user=masses.csv");
    assert!(
        run.code == 2 && run.err.contains("error[FB803]: 1 nodes have no mass, node 1 first"),
        "{}",
        run.err
    );
    assert!(!folder.path().join("c.h5").exists());
    let json = done(folder.path(), "convert model.toml -o d.h5 --lumped none --json").results();
    assert_eq!(json["lumped"], Value::Array(Vec::new()));
}

#[test]
fn lumped_modes_never_have_higher_frequencies_than_the_consistent_ones() {
    // M_lumped - M is positive semidefinite for row sums of a mass matrix without negative entries.
    let folder = model();
    let run =
        done(folder.path(), "convert model.toml -o b.h5 --modes 8 --lumped row-sum --lumped-modes --json");
    let json = run.results();
    let lumped = &json["lumped_modes"][0];
    assert_eq!((&lumped["scheme"], &lumped["done"]), (&"row-sum".into(), &true.into()));
    let of = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let (low, high) = (of(&lumped["frequency_hz"]), of(&json["modes"]["frequency_hz"]));
    assert_eq!((low.len(), high.len()), (8, 8));
    assert!(low.iter().zip(&high).all(|(a, b)| a < b && *a > 0.5 * b), "{low:?} {high:?}");
    let cosine = lumped["subspace_cosine"].as_f64().unwrap();
    assert!(cosine > 0.0 && cosine < 1.0, "{cosine}");
    let text =
        done(folder.path(), "convert model.toml -o b.h5 --modes 8 --lumped row-sum --lumped-modes").out;
    assert!(text.lines().any(|l| l.starts_with("own modes") && l.contains("off by -")), "{text}");
    assert_eq!(
        done(folder.path(), "convert model.toml -o c.h5 --json").results()["lumped_modes"],
        Value::Array(Vec::new())
    );
}

#[test]
fn fast_accuracy_says_not_proved_everywhere() {
    let folder = model();
    let run =
        done(folder.path(), "convert model.toml -o b.h5 --accuracy fast --report r.json --report r.html");
    let line = run.out.lines().find(|l| l.starts_with("complete")).unwrap();
    assert!(line.contains("NOT PROVED: accuracy `fast`"), "{line}");
    assert!(run.err.contains("warning[FB507]"), "{}", run.err);
    let json: Value = serde_json::from_slice(&fs::read(folder.path().join("r.json")).unwrap()).unwrap();
    assert_eq!(json["completeness"]["proved"], false);
    assert_eq!(json["completeness"]["proved_modes"], Value::Null);
    assert_eq!(json["completeness"]["negative_pivots"], Value::Null);
    assert!(fs::read_to_string(folder.path().join("r.html")).unwrap().contains("Not proved complete."));
    // The file alone reports the missing proof too.
    assert!(done(folder.path(), "inspect b.h5").out.contains("NOT PROVED"));
    assert_eq!(done(folder.path(), "inspect b.h5 --json").results()["completeness"]["proved"], false);
    let proved = done(folder.path(), "convert model.toml -o c.h5");
    assert!(
        proved.out.contains("\nproved      20 flexible + 6 rigid modes") && !proved.err.contains("FB507")
    );
}

#[test]
fn an_old_output_stays_when_the_run_fails_and_is_replaced_when_it_succeeds() {
    let folder = model();
    fs::write(folder.path().join("b.h5"), "old").unwrap();
    let run = flexbody(folder.path(), "convert model.toml -o b.h5 --max-frequency 1");
    assert_eq!(run.code, 2, "{}", run.err);
    assert_eq!(fs::read(folder.path().join("b.h5")).unwrap(), b"old");
    done(folder.path(), "convert model.toml -o b.h5");
    done(folder.path(), "check b.h5");
    assert_eq!(members(folder.path()), ["K.mtx", "M.mtx", "b.h5", "model.toml", "nodes.csv"]);
}

#[test]
fn a_body_made_by_the_library_from_memory_is_one_like_any_other() {
    let folder = tempfile::tempdir().unwrap();
    let body = from_memory::write_truss(&folder.path().join("truss.flex.h5")).unwrap();
    let run = done(folder.path(), "check truss.flex.h5");
    assert!(run.out.contains("all 23 identities hold"), "{}", run.out);
    let json = done(folder.path(), "inspect truss.flex.h5 --json").results();
    assert_eq!(json["model"]["name"], "truss");
    assert_eq!(json["modes"]["count"], 8);
    assert_eq!(json["modes"]["frequency_hz"][0], body.frequencies_hz()[0]);
    assert_eq!(json["model"]["interfaces"][0]["n_nodes"], 16);
}
