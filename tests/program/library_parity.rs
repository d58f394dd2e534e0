//! Every command of the program has a function of the library that gives the same results, or a reason why it has none.

use crate::json_output::folder;
use crate::program::{flexbody, program};
use flexbody::program::Arguments;
use flexbody::{
    Audit, Batch, BatchOptions, ComparisonFormat, ConvertOptions, Explanation, ExportOptions, FlexBody,
    LoadedHistory, Model, MotionHistory, Progress, Ranges, Recipe, RecordedMotion, Recovered, ReportFormat,
    ResponseOptions, Scene, Tolerances, TradeOptions,
};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

const RUN: &str = "select b.h5 --scene scene.toml";

/// What the library has for a command.
enum Counterpart {
    /// Function of the library, with a comparison of its results with those of the command.
    Function(&'static str, fn(&Place)),
    /// Reason why a library has no such function.
    Absent(&'static str),
}
use Counterpart::{Absent, Function};

/// All commands of the program.
const COMMANDS: &[(&str, Counterpart)] = &[
    ("convert", Function("Model::convert, Model::convert_for, FlexBody::import", convert)),
    ("prepare", Absent("writes a folder for another machine: its result is files that `assemble` reads")),
    ("assemble", Absent("reads a folder of `prepare` after the run of a cluster")),
    ("shapes", Absent("writes a deck for an FE program: its result is a file that the program reads")),
    ("batch", Function("Batch::run", batch)),
    ("inspect", Function("FlexBody::report", inspect)),
    ("check", Function("FlexBody::check", check)),
    ("compare", Function("FlexBody::compare", compare)),
    ("select", Function("Model::select, FlexBody::select", select)),
    ("simulate", Function("FlexBody::simulate", simulate)),
    ("trade", Function("Model::trade, FlexBody::trade", trade)),
    ("advise", Function("FlexBody::advise", advise)),
    ("measure", Function("FlexBody::measure", measure)),
    ("recover", Function("FlexBody::recover", recover)),
    ("reduce", Function("FlexBody::subset", reduce)),
    ("response", Function("Model::response, FlexBody::response", response)),
    ("view", Function("FlexBody::view", view)),
    ("export", Function("FlexBody::export", export)),
    ("recipe", Function("Recipe::of", recipe)),
    ("explain", Function("Explanation::of", explain)),
    ("audit", Function("Audit::of", audit)),
    ("doctor", Absent("describes the program and the machine that it runs on")),
    ("completions", Absent("is about the command line")),
    ("man", Absent("is about the command line")),
];

/// Folder with the files that commands and functions share.
struct Place(PathBuf);

impl Place {
    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Runs a command, which must succeed, and returns its results as JSON.
    fn results(&self, line: &str) -> Value {
        let mut words: Vec<&str> = line.split_whitespace().collect();
        words.push("--json");
        let run = flexbody(&self.0, &words);
        let told: Value = serde_json::from_slice(&run.stdout).expect("JSON");
        assert_eq!(told["exit_code"], 0, "{line}: {told:#}");
        told["results"].clone()
    }

    /// Asserts that two files have the same bytes.
    fn assert_same(&self, a: &str, b: &str) {
        let [a, b] = [a, b].map(|name| fs::read(self.path(name)).expect("a file"));
        assert!(!a.is_empty() && a == b);
    }

    fn body(&self) -> FlexBody {
        FlexBody::read(self.path("b.h5")).expect("a body")
    }

    fn model(&self) -> Model {
        Model::read(self.path("model.toml")).expect("a model")
    }

    fn scene(&self) -> Scene {
        Scene::read(self.path("scene.toml")).expect("a scene")
    }
}

fn go_on(_: Progress<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Asserts that a report of the library has the results of a command, apart from times, memory, messages and paths.
fn assert_same_results(report: &str, results: &Value) {
    let own: Value = serde_json::from_str(report).expect("JSON");
    let (mut own, mut results) = (own, results.clone());
    own.as_object().expect("an object").keys().for_each(|key| assert!(results.get(key).is_some(), "{key}"));
    for report in [&mut own, &mut results] {
        without_measurements(report);
    }
    assert_eq!(own, results);
}

/// Removes what depends on the run: times, memory, threads, messages, and the paths of files.
fn without_measurements(report: &mut Value) {
    const OF_A_RUN: &[&str] = &[
        "diagnostics",
        "run",
        "wall_seconds",
        "cpu_seconds",
        "threads",
        "seconds",
        "history",
        "command",
        "list",
        "output",
        "memory_bytes",
        "peak_memory_bytes",
        "memory_estimate_bytes",
        "median_seconds",
    ];
    match report {
        Value::Object(entries) => {
            entries.retain(|key, _| !OF_A_RUN.contains(&key.as_str()));
            entries.values_mut().for_each(without_measurements);
        }
        Value::Array(items) => items.iter_mut().for_each(without_measurements),
        _ => {}
    }
}

fn convert(place: &Place) {
    place.results("convert model.toml --modes 4 -o command.h5");
    let model = place.model();
    let made = model.convert(&ConvertOptions::default().modes(4)).expect("a body").body;
    made.write(place.path("library.h5")).expect("written");
    place.assert_same("command.h5", "library.h5");
    place.results("export b.h5 --to sid --allow-loss -o foreign.sid");
    place.results("convert foreign.sid --from sid --units m,kg,s -o command.h5");
    let imported = FlexBody::import(place.path("foreign.sid"), "sid", Some("m,kg,s"), None).expect("a body");
    imported.body.write(place.path("library.h5")).expect("written");
    place.assert_same("command.h5", "library.h5");
}

fn batch(place: &Place) {
    let options = BatchOptions::default().program([program()]);
    let list = place.path("list.toml");
    let made = Batch::run(&list, &options, &go_on).expect("a batch");
    assert_eq!((made.failed(), made.bodies()[0].state), (0, "done"));
    assert!(made.diagnostics().is_empty() && made.bodies()[0].n_modes == Some(4));
    let again = Batch::run(&list, &options, &go_on).expect("a batch");
    let results = place.results(&format!("batch {}", list.display()));
    assert_same_results(&again.report(ReportFormat::Json), &results);
    let text = fs::read_to_string(&list).expect("a list");
    fs::write(place.path("wrong.toml"), text.replace("model.toml", "none.toml")).expect("written");
    let failed = Batch::run(place.path("wrong.toml"), &options, &go_on).expect("a batch");
    assert_eq!((failed.failed(), failed.diagnostics()[0].code().id()), (1, "FB771"));
}

fn inspect(place: &Place) {
    let report = place.body().report(ReportFormat::Json);
    assert_same_results(&report, &place.results("inspect b.h5"));
}

fn check(place: &Place) {
    let body = place.body();
    let alone = body.check(None).expect("checks");
    assert_same_results(&alone.json(), &place.results("check b.h5"));
    let model = Model::read_for(&body, place.path("model.toml")).expect("a model");
    let against = body.check(Some(&model)).expect("checks");
    assert_same_results(&against.json(), &place.results("check b.h5 --against model.toml"));
    assert!(against.passed() && against.identities().len() > alone.identities().len());
    assert!(against.text().contains("identities hold"));
    // One of several bodies in the matrices.
    place.results("convert model.toml --modes 4 -o part.h5 --split");
    let part = FlexBody::read(place.path("part-1.h5")).expect("a body");
    let model = Model::read_for(&part, place.path("model.toml")).expect("a model");
    assert!(part.check(Some(&model)).expect("checks").passed());
}

fn compare(place: &Place) {
    place.results("reduce b.h5 --keep-modes 1,2 -o two.h5");
    let (body, two) = (place.body(), FlexBody::read(place.path("two.h5")).expect("a body"));
    let tolerances = Tolerances::default();
    let same = body.compare(&body, &tolerances).expect("a comparison");
    assert!(same.passed() && !same.rows().is_empty());
    place.results("compare b.h5 b.h5 --report c.json --report c.html --report c.xml --report c.md");
    for (name, format) in [
        ("c.json", ComparisonFormat::Json),
        ("c.html", ComparisonFormat::Html),
        ("c.xml", ComparisonFormat::JUnit),
        ("c.md", ComparisonFormat::Markdown),
    ] {
        let written = fs::read_to_string(place.path(name)).expect("a report");
        // A page of the program states its command line, which a library does not have.
        let command = written.find("<p class=\"quiet\"><code>");
        let written = command.map_or(written.clone(), |at| {
            let end = at + written[at..].find("</p>").expect("the end of a paragraph") + "</p>".len();
            assert!(written[at..end].contains("compare b.h5 b.h5 --report c.json"), "{}", &written[at..end]);
            written[..at].to_owned() + &written[end..]
        });
        assert_eq!(same.clone().named("b.h5", "b.h5").report(format), written, "{name}");
    }
    assert!(body.compare(&two, &tolerances).expect_err("other modes").to_string().contains("FB707"));
    let common = body.compare_common(&two, &tolerances).expect("a comparison");
    let results = place.results("compare b.h5 two.h5 --common");
    assert_same_results(&common.report(ComparisonFormat::Json), &results);
}

fn select(place: &Place) {
    let selection = place.body().select(&place.scene()).expect("a selection");
    assert_same_results(&selection.report(ReportFormat::Json), &place.results(RUN));
    let of_model = place.model().select(&place.scene(), Some(6)).expect("a selection");
    let results = place.results("select model.toml --modes 6 --scene scene.toml");
    assert_same_results(&of_model.report(ReportFormat::Json), &results);
    assert_eq!(of_model.command("model.toml").as_deref(), results["command"].as_str());
}

fn simulate(place: &Place) {
    let motion = place.body().simulate(&place.scene()).expect("a motion");
    motion.write(place.path("library.h5")).expect("written");
    let results = place.results("simulate b.h5 --scene scene.toml -o command.h5 --csv command.csv");
    assert_same_results(&motion.report(ReportFormat::Json), &results);
    place.assert_same("command.h5", "library.h5");
    assert_eq!(motion.csv(), fs::read_to_string(place.path("command.csv")).expect("a table"));
}

fn trade(place: &Place) {
    let options = TradeOptions::default().repeat(1);
    let study = place.body().trade(&place.scene(), &options, &go_on).expect("a study");
    let results = place.results("trade b.h5 --scene scene.toml --repeat 1");
    let own: Value = serde_json::from_str(&study.report(ReportFormat::Json)).expect("JSON");
    // The seconds of a candidate may change its place among equals.
    assert_eq!(own["rows"].as_array().map(Vec::len), results["rows"].as_array().map(Vec::len));
    assert_eq!(own["rows"][0]["modes"], results["rows"][0]["modes"]);
}

fn advise(place: &Place) {
    let body = place.body();
    let ranges = Ranges {
        spin_hz: 10.0,
        deflection: None,
        duration: None,
        attached: None,
        is_rotation_given: false,
        limit: 0.05,
    };
    let advice = body.advise(ranges).expect("advice");
    let results = place.results("advise b.h5 --spin 10");
    assert_same_results(&advice.report("b.h5", ReportFormat::Json), &results);
    assert_eq!(results["guideline"], advice.guideline());
}

fn measure(place: &Place) {
    place.results("simulate b.h5 --scene scene.toml --csv run.csv");
    let body = place.body();
    let history = MotionHistory::read(place.path("run.csv"), body.n_modes()).expect("a history");
    let measured = body.measure(&place.scene(), &history, None, &go_on).expect("errors");
    let results = place.results("measure b.h5 --scene scene.toml --history run.csv");
    assert_same_results(&measured.report(ReportFormat::Json), &results);
}

fn recover(place: &Place) {
    place.results("convert cut.toml --modes 4 -o cut.h5");
    place.results("simulate cut.h5 --scene scene.toml --csv run.csv");
    let body = FlexBody::read(place.path("cut.h5")).expect("a body");
    assert_eq!(body.recoveries(), ["root"]);
    // From the directory of the files, so that the path of the run is the same in both files.
    let history = LoadedHistory::read(place.path("run.csv"), &body).expect("a history");
    let recovered = body.recover(&history, &["root"]).expect("rows");
    let results = place.results("recover cut.h5 --history run.csv -o command.csv");
    assert_same_results(&recovered.report(&body, ReportFormat::Json).expect("a report"), &results);
    assert_eq!(recovered.csv(), fs::read_to_string(place.path("command.csv")).expect("a table"));
    let run = place.path("run.csv").display().to_string();
    place.results(&format!("recover cut.h5 --history {run} -o command.h5"));
    recovered.write(&body, place.path("library.h5")).expect("written");
    place.assert_same("command.h5", "library.h5");
    // The same rows from numbers.
    let rows = recovered.rows().remove(0);
    assert_eq!((rows.values.rows(), rows.values.columns()), (recovered.times().len(), rows.labels.len()));
    let motion = body.simulate(&place.scene()).expect("a motion");
    place.results("simulate cut.h5 --scene scene.toml --rows command.h5");
    let simulated = motion.recovered().expect("rows");
    simulated.write(&body, place.path("library.h5")).expect("written");
    place.assert_same("command.h5", "library.h5");
    // A cut has no stresses: there is no envelope.
    for rows in [&recovered, &simulated] {
        assert!(rows.write_envelope(&body, place.path("envelope.csv")).is_err());
    }
    assert!(recovered.write_envelope(&body, place.path("envelope.pdf")).is_err());
    assert!(Recovered::write_envelope_of_cases(&[], &body, place.path("envelope.csv")).is_err());
    // Factors of FE steps.
    place.results("shapes cut.h5 --model cut.toml --to npz -o ask.npz");
    let channels = body.channels(&history, place.path("ask.npz")).expect("channels");
    for file in ["command_channels.csv", "command_channels.h5"] {
        place.results(&format!("recover cut.h5 --history {run} --channels {file} --shapes ask.npz"));
    }
    let table = fs::read_to_string(place.path("command_channels.csv")).expect("a table");
    let own = LoadedHistory::read(&run, &body).expect("a history");
    let channels_of_run = body.channels(&own, place.path("ask.npz")).expect("channels");
    assert_eq!((channels.csv(), channels_of_run.csv()), (table.clone(), table));
    channels_of_run.write(&body, place.path("library_channels.h5")).expect("written");
    place.assert_same("command_channels.h5", "library_channels.h5");
    assert_eq!(channels.values().columns(), channels.names().len());
    let q = (0..motion.times().len()).map(|at| motion.modal_coordinates(at).to_vec()).collect();
    let omega: Vec<[f64; 3]> =
        (0..motion.times().len()).map(|at| motion.angular_velocity(at).into()).collect();
    let history = LoadedHistory::new(motion.times().to_vec(), q).expect("a history");
    let history = history.angular_velocity(&omega).expect("a spin");
    let own = body.recover(&history, &[]).expect("rows").rows().remove(0);
    let largest = rows.values.values().iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let differ = own.values.values().iter().zip(rows.values.values()).map(|(a, b)| (a - b).abs());
    assert!(largest > 0.0 && differ.fold(0.0, f64::max) <= 1e-9 * largest);
    let loaded = history.load("nowhere", &vec![[1.0; 3]; omega.len()], &vec![[0.0; 3]; omega.len()]);
    assert!(
        body.recover(&loaded.expect("a load"), &[]).expect_err("no interface").to_string().contains("FB212")
    );
    let other = LoadedHistory::new(vec![0.0], vec![vec![0.0; 3]]).expect("a history");
    assert!(body.recover(&other, &[]).expect_err("3 of 4 modes").to_string().contains("FB804"));
    assert!(LoadedHistory::new(vec![0.0, 0.0], vec![vec![]; 2]).is_err());
}

fn reduce(place: &Place) {
    place.results("reduce b.h5 --keep-modes 1,3 --terms W1 -o command.h5");
    let small = place.body().subset(Some(&[1, 3]), "W1").expect("a body");
    small.write(place.path("library.h5")).expect("written");
    place.assert_same("command.h5", "library.h5");
    place.results("reduce b.h5 --storage f32 -o command.h5");
    place.body().rounded_to_f32().expect("a body").write(place.path("library.h5")).expect("written");
    place.assert_same("command.h5", "library.h5");
}

fn response(place: &Place) {
    let options = ResponseOptions::default().from("1").to("1:z").band_hz(10.0, 5000.0).points(50).solves(4);
    let line = "--band 10..5000 --from 1 --to 1:z --points 50 --solves 4 --tolerance 1000 --csv command.csv";
    let alone = place.body().response(&options.clone().tolerance(1000.0), &go_on).expect("a response");
    let results = place.results(&format!("response b.h5 {line}"));
    assert_same_results(&alone.report(ReportFormat::Json), &results);
    assert_eq!(alone.csv(), fs::read_to_string(place.path("command.csv")).expect("a table"));
    let functions = alone.functions();
    assert_eq!((functions.len(), functions[0].to_direction.as_str()), (3, "z"));
    assert_eq!(functions[0].reduced.len(), alone.frequencies_hz().len());
    let whole = options.clone().tolerance(1000.0).modes(4);
    let whole = place.model().response(None, &whole, &go_on).expect("a response");
    let results = place.results(&format!("response model.toml --modes 4 {line}"));
    assert_same_results(&whole.report(ReportFormat::Json), &results);
    assert!(whole.holds() && whole.functions()[0].full.iter().any(Option::is_some));
    let impossible = [
        options.clone().points(1),
        options.clone().solves(0),
        options.clone().tolerance(f64::NAN),
        options.clone().damping_ratio(-0.1),
        options.band_hz(2.0, 1.0),
        ResponseOptions::default().from("1").to("1"),
    ];
    for options in impossible {
        let error = place.body().response(&options, &go_on).expect_err("impossible");
        assert_eq!(error.diagnostics()[0].code().id(), "FB801", "{options:?}");
    }
}

fn view(place: &Place) {
    let results = place.results("view b.h5 -o command.html");
    let page = place.body().view(None, None).expect("a page");
    page.write(place.path("library.html")).expect("written");
    place.assert_same("command.html", "library.html");
    assert_same_results(&page.report(ReportFormat::Json), &results);
    place.results("simulate b.h5 --scene scene.toml -o motion.h5");
    place.results("view b.h5 --simulation motion.h5 -o command.html --triangles 4");
    let motion = RecordedMotion::read(place.path("motion.h5")).expect("a motion");
    let page = place.body().view(Some(&motion), Some(4)).expect("a page");
    assert_eq!(page.html(), fs::read_to_string(place.path("command.html")).expect("a page"));
    let simulated = RecordedMotion::from(&place.body().simulate(&place.scene()).expect("a motion"));
    assert_eq!(simulated, motion);
}

fn export(place: &Place) {
    let body = place.body();
    place.results(
        "export b.h5 --to sid --dialect py-sid --points 1,2 --to-units mm,t,s --allow-loss -o c.sid",
    );
    let options = ExportOptions::default().dialect("py-sid").points("1,2").to_units("mm,t,s").allow_loss();
    body.export("sid", place.path("l.sid"), &options).expect("written");
    place.assert_same("c.sid", "l.sid");
    place.results("export b.h5 --to gltf --modes 2 -o c.glb");
    body.export("gltf", place.path("l.glb"), &ExportOptions::default().modes(2)).expect("written");
    place.assert_same("c.glb", "l.glb");
    place.results("simulate b.h5 --scene scene.toml -o motion.h5");
    place.results("export b.h5 --to gltf --simulation motion.h5 -o c.glb");
    let motion = body.simulate(&place.scene()).expect("a motion");
    body.export("gltf", place.path("l.glb"), &ExportOptions::default().motion(&motion)).expect("written");
    place.assert_same("c.glb", "l.glb");
    // Loss is refused unless it is allowed, as by the command.
    let small = body.subset(None, "none").expect("a body");
    small.write(place.path("small.h5")).expect("written");
    for (format, _) in FlexBody::export_formats() {
        let run = flexbody(&place.0, &["export", "small.h5", "--to", format, "-o", "c.x", "--json"]);
        let refused = small.export(format, place.path("l.x"), &ExportOptions::default());
        assert_eq!(run.status.success(), refused.is_ok(), "{format}");
    }
    for options in
        [ExportOptions::default().points("all"), ExportOptions::default().dialect("none").allow_loss()]
    {
        assert!(body.export("sid", place.path("l.sid"), &options).is_err());
    }
    assert_eq!(FlexBody::export_dialects("json").expect("a format"), &[] as &[&str]);
}

fn recipe(place: &Place) {
    let run = flexbody(&place.0, &["recipe", "calculix"]);
    let text = Recipe::of("calculix").expect("a recipe").to_string();
    assert_eq!(String::from_utf8(run.stdout).expect("UTF-8"), text);
    assert!(Recipe::of("patran").is_err());
}

fn explain(place: &Place) {
    for code in [None, Some("FB408"), Some("fb721")] {
        let words: Vec<&str> = ["explain"].into_iter().chain(code).collect();
        let run = flexbody(&place.0, &words);
        let text = Explanation::of(code).expect("an explanation").to_string();
        assert_eq!(String::from_utf8(run.stdout).expect("UTF-8"), text);
    }
    assert!(Explanation::of(Some("FB000")).is_err());
}

fn audit(place: &Place) {
    place.results("export b.h5 --to sid --allow-loss -o foreign.sid");
    let audit = Audit::of(place.path("foreign.sid"), None, Audit::TOLERANCE).expect("an audit");
    let path = place.path("foreign.sid").display().to_string();
    assert_same_results(&audit.json(), &place.results(&format!("audit {path}")));
    assert!(audit.passed() && audit.findings().is_empty() && audit.format() == "sid");
    assert!(audit.text().contains("checks passed") && !audit.dialect().is_empty());
    assert!(Audit::of(place.path("model.toml"), None, Audit::TOLERANCE).is_err());
}

#[test]
fn every_command_has_a_function_or_a_reason() {
    let commands: BTreeSet<String> = <Arguments as clap::CommandFactory>::command()
        .get_subcommands()
        .map(|command| command.get_name().to_owned())
        .filter(|name| name != "help")
        .collect();
    let listed: BTreeSet<String> = COMMANDS.iter().map(|(name, _)| (*name).to_owned()).collect();
    assert_eq!(commands, listed, "a new command needs a line in COMMANDS");
    for (name, counterpart) in COMMANDS {
        let said = match counterpart {
            Function(function, _) => function,
            Absent(reason) => reason,
        };
        assert!(!said.is_empty(), "{name}");
    }
}

#[test]
fn functions_of_the_library_give_the_results_of_the_commands() {
    let folder = folder();
    let place = Place(Path::new(folder.path()).to_path_buf());
    let differs = |(name, counterpart): &(&'static str, Counterpart)| match counterpart {
        Function(function, same) => {
            std::panic::catch_unwind(|| same(&place)).is_err().then_some((*name, *function))
        }
        Absent(_) => None,
    };
    let differing: Vec<_> = COMMANDS.iter().filter_map(differs).collect();
    assert!(differing.is_empty(), "{differing:?}");
}
