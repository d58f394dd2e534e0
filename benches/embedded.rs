//! Cost of the evaluation in C beside the library: `cargo bench --bench embedded`; with `-- --write` the
//! table goes into docs/reference/formats/embedded.md.
//!
//! Accelerations of a free body from its state, each state another. Library and C programs take turns;
//! seconds are of the processor, the ratio of every turn is formed by itself, and medians are told.

use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_formats::export::{ExportOptions, Points};
use flexbody_formats::find_format;
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use oracle::flexible::{fixture, moving_state};
use oracle::general::quasi_velocities;
use oracle::random::Random;
use std::process::Command;

const BODY: &str = "bracket_hex20";

const MODES: [usize; 4] = [10, 20, 50, 100];

/// Dialect and flags of each C program.
const PROGRAMS: [(&str, &[&str]); 4] = [
    ("double", &["-O2"]),
    ("double", &["-O3", "-march=native"]),
    ("float", &["-O2"]),
    ("float", &["-O3", "-march=native"]),
];

const TURNS: usize = 11;

const STATES: usize = 16;

/// Seconds of one turn of the library, about.
const TURN: f64 = 0.05;

/// Seconds of the processor so far, on Linux; else of the clock.
fn seconds(work: impl FnOnce()) -> f64 {
    let processor = || -> Option<f64> {
        let told = std::fs::read_to_string("/proc/self/schedstat").ok()?;
        Some(told.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
    };
    let (clock, before) = (std::time::Instant::now(), processor());
    work();
    let elapsed = clock.elapsed().as_secs_f64();
    before.zip(processor()).map_or(elapsed, |(before, after)| after - before)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// States as tests/embedded/evaluation.c takes them, no forces applied.
fn states(body: &FlexBody) -> Vec<Vec<f64>> {
    let mut random = Random(1);
    let own = (0..STATES).map(|_| moving_state(&mut random, body));
    own.map(|state| {
        let (q, nu) = (state.q.as_slice(), quasi_velocities(&state));
        [q, nu.as_slice(), &vec![0.0; nu.len() + 9]].concat()
    })
    .collect()
}

/// The C program in a folder of its own.
struct Program {
    folder: tempfile::TempDir,
    bytes: usize,
}

impl Program {
    fn new(body: &FlexBody, dialect: &str, flags: &[&str], states: &[Vec<f64>]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let options = ExportOptions {
            dialect: Some(dialect.to_owned()),
            points: Points::Some(Vec::new()),
            ..ExportOptions::default()
        };
        let format = find_format("embedded").expect("registered");
        let exported = format.write(body, &options).expect("exports");
        std::fs::write(path("body.h"), &exported.beside[0].1).expect("writable");
        std::fs::write(path("body.bin"), &exported.file).expect("writable");
        let number = |v: &f64| match dialect {
            "float" => (*v as f32).to_le_bytes().to_vec(),
            _ => v.to_le_bytes().to_vec(),
        };
        let numbers: Vec<u8> = states.iter().flatten().flat_map(number).collect();
        std::fs::write(path("states"), numbers).expect("writable");
        let root = oracle::root();
        let name = format!("flexbody_{BODY}_");
        let compiled = Command::new("cc")
            .args(flags)
            .arg(format!("-DBODY_HEADER=\"{}\"", path("body.h").display()))
            .args([format!("-DSMALL={name}"), format!("-DCAPITAL={}", name.to_uppercase())])
            .args([root.join("tests/embedded/evaluation.c"), root.join("benches/embedded.c")])
            .arg("-o")
            .arg(path("program"))
            .status()
            .expect("a C compiler");
        assert!(compiled.success());
        Self { folder, bytes: exported.file.len() }
    }

    fn seconds(&self, calls: usize) -> f64 {
        let path = |name: &str| self.folder.path().join(name);
        let calls = calls.to_string();
        let output = Command::new(path("program"))
            .args([path("body.bin"), path("states")])
            .args([&calls, &calls])
            .output()
            .expect("the program runs");
        assert!(output.status.success());
        // The first warms up.
        let text = String::from_utf8(output.stdout).expect("numbers");
        text.lines().last().and_then(|line| line.parse().ok()).expect("seconds")
    }
}

fn row(nf: usize) -> String {
    let body = fixture(BODY, nf, BodyFrame::Principal);
    let states = states(&body);
    let equations = EquationsOfMotion::new(&body, Terms::ALL);
    let mut evaluation = Evaluation::new(&equations);
    let mut acceleration = vec![0.0; 6 + nf];
    let mut library = |calls: usize| {
        let work = || {
            for state in states.iter().cycle().take(calls) {
                evaluation.set(&state[..nf], &state[nf..6 + 2 * nf]);
                evaluation
                    .accelerations(&state[6 + 2 * nf..][..6 + nf], &mut acceleration)
                    .expect("a body with mass");
                std::hint::black_box(&acceleration);
            }
        };
        seconds(work) / calls as f64
    };
    // Long enough to tell how many calls make a turn.
    let mut calls = 1000;
    while library(calls) * (calls as f64) < 0.5 * TURN {
        calls *= 2;
    }
    let programs = PROGRAMS.map(|(dialect, flags)| Program::new(&body, dialect, flags, &states));
    let mut own = Vec::new();
    let mut times = [const { Vec::new() }; PROGRAMS.len()];
    let mut ratios = [const { Vec::new() }; PROGRAMS.len()];
    for _ in 0..TURNS {
        let library = library(calls);
        own.push(library);
        for (at, program) in programs.iter().enumerate() {
            let seconds = program.seconds(calls);
            times[at].push(seconds);
            ratios[at].push(seconds / library);
        }
    }
    let cells = times
        .into_iter()
        .zip(ratios)
        .map(|(times, ratios)| format!("{:.2} ({:.2})", median(times) * 1e6, median(ratios)));
    let cells: Vec<String> = cells.collect();
    let [double, _, float, _] = &programs;
    format!(
        "| {nf} | {:.0} / {:.0} | {:.2} | {} |",
        double.bytes as f64 / 1024.0,
        float.bytes as f64 / 1024.0,
        median(own) * 1e6,
        cells.join(" | ")
    )
}

fn main() {
    let programs = PROGRAMS.map(|(dialect, flags)| format!("{dialect}, `{}`", flags.join(" ")));
    let mut table = format!(
        "| modes | file, KiB (double / float) | library, µs | {} |\n|{}\n",
        programs.join(" | "),
        "---|".repeat(3 + PROGRAMS.len())
    );
    for nf in MODES {
        table += &row(nf);
        table += "\n";
    }
    let compiler = Command::new("cc").arg("--version").output().expect("a C compiler").stdout;
    let compiler = String::from_utf8_lossy(&compiler).lines().next().unwrap_or_default().to_owned();
    let processor = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let processor = processor.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let text = format!(
        "{table}\n`{BODY}`; {}; {compiler}; medians of {TURNS} turns.\n",
        processor.map_or("unknown processor", |(_, name)| name.trim())
    );
    println!("{text}");
    if std::env::args().any(|argument| argument == "--write") {
        let path = oracle::root().join("docs/reference/formats/embedded.md");
        let page = std::fs::read_to_string(&path).expect("the page");
        let (before, rest) = page.split_once("<!-- times -->\n").expect("a place for the table");
        let (_, after) = rest.split_once("<!-- end of times -->").expect("an end of the table");
        std::fs::write(&path, format!("{before}<!-- times -->\n{text}<!-- end of times -->{after}"))
            .expect("writable");
    }
}
