//! Runner of the crossings.

use crate::commands::{self, Command};
use crate::draws::{one_in, pick, stream};
use crate::features::features;
use crate::outputs::{Outputs, Violation};
use crate::scenes;
use crate::shrink::smallest;
use crate::subject::Subject;
use crate::text::Text;
use crate::transformations::{self, Pair, Transformation};
use flexbody_base::diagnostic::Code;
use flexbody_base::error::{Error, Result};
use flexbody_body::invariants::FrameChoice;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Returns the value of an environment variable, or `usual`.
fn asked(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(usual)
}

/// Time limit of the search for the smallest scene of a violation.
const LONGEST: Duration = Duration::from_secs(40);

/// Crossings that take longer are listed by name.
const SLOW: Duration = Duration::from_secs(5);

/// A crossing of one scene, one transformation and one command.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    seed: u64,
    transformation: usize,
    command: usize,
}

/// Outcome of a crossing.
enum Outcome {
    /// The transformation does not apply to the scene.
    Apart,
    /// Both subjects are refused for the same reason.
    Refused(String),
    /// The outputs correspond, up to this fraction of the allowed difference; the violation of an open output
    /// is allowed.
    Same(f64, Option<Violation>),
    /// The outputs do not correspond.
    Violated(Violation),
}

/// Returns true for an output that is known to depend on axes.
fn is_open(name: &str) -> bool {
    commands::OPEN.iter().any(|open| name.contains(open))
}

/// Returns the outcome of an error. Random scenes are valid except for a torque at a point without rotation
/// (FB212), bodies that `trade --reference nodal` does not support (FB801), and motions that its iteration does not
/// follow (FB540).
fn refused(error: &Error) -> Outcome {
    match code(error) {
        code if ["FB212", "FB801", "FB540"].contains(&&*code) => Outcome::Refused(code),
        _ => violated(format!("a sound scene is refused: {error}")),
    }
}

/// Returns a violation without numbers.
fn violated(detail: String) -> Outcome {
    Outcome::Violated(Violation { output: "outcome".to_owned(), size: f64::INFINITY, detail })
}

/// Returns the codes of an error.
fn code(error: &Error) -> String {
    commands::codes(error.diagnostics())
}

impl Crossing {
    /// Returns the crossing of a number. Transformations alternate, and half of all crossings run `simulate`,
    /// which has the most outputs; with `FLEXBODY_SIMULATED_CROSSINGS` all of them. `FLEXBODY_TRANSFORMATION`
    /// names the only transformation.
    fn of(number: u64) -> Self {
        let random = &mut stream(number, 7);
        let only = std::env::var("FLEXBODY_TRANSFORMATION").ok();
        let named = |name: String| {
            let found = transformations::ALL.iter().position(|one| one.name == name);
            found.unwrap_or_else(|| panic!("FLEXBODY_TRANSFORMATION: no transformation `{name}`"))
        };
        let transformation = only.map_or(number as usize % transformations::ALL.len(), named);
        let Transformation { reach, .. } = transformations::ALL[transformation];
        let met: Vec<usize> = (0..commands::ALL.len()).filter(|&i| (commands::ALL[i].meets)(reach)).collect();
        let simulated = one_in(random, 2) || std::env::var_os("FLEXBODY_SIMULATED_CROSSINGS").is_some();
        let command = if simulated { 0 } else { met[pick(random, met.len())] };
        Self { seed: number, transformation, command }
    }

    fn names(&self) -> (&'static str, &'static str) {
        (transformations::ALL[self.transformation].name, commands::ALL[self.command].name)
    }

    /// Returns the pair of the scene, with the second case transformed in the same way.
    fn pair(&self, subject: &Subject) -> Result<Option<Pair>> {
        let of = |subject: &Subject| {
            (transformations::ALL[self.transformation].apply)(subject, &mut stream(self.seed, 3))
        };
        let Some(second) = &subject.second else { return of(subject) };
        let alone = Subject { scene: second.clone(), second: None, ..subject.clone() };
        let (Some(mut pair), Some(other)) = (of(subject)?, of(&alone)?) else { return Ok(None) };
        pair.original.second = Some(other.original.scene);
        pair.changed.second = Some(other.changed.scene);
        Ok(Some(pair))
    }

    /// Returns true for an output that the transformation must not change.
    fn counts(&self, name: &str) -> bool {
        let changed = |(output, by): &(&str, &str)| name.contains(output) && *by == self.names().0;
        !is_open(name) && !commands::CHANGED.iter().any(changed)
    }

    fn run(&self, subject: &Subject) -> Outcome {
        let command = commands::ALL[self.command].run;
        let pair = match self.pair(subject) {
            Ok(Some(pair)) => pair,
            Ok(None) => return Outcome::Apart,
            Err(error) => return refused(&error),
        };
        // Verdicts about modes are those of bodies in mean axes.
        let has_mean_axes = |subject: &Subject| matches!(subject.frame, FrameChoice::Mean(_));
        let takes_frames = ["simulate", "response"].contains(&self.names().1);
        if !takes_frames && ![&pair.original, &pair.changed].into_iter().all(has_mean_axes) {
            return Outcome::Apart;
        }
        let (own, other): (Result<Outputs>, Result<Outputs>) =
            (command(&pair.original), command(&pair.changed));
        match (own, other) {
            (Ok(own), Ok(other)) => match own.compare(&other, &pair.map, |name| self.counts(name)) {
                (_, Some(violation)) => Outcome::Violated(violation),
                (size, None) => Outcome::Same(size, own.compare(&other, &pair.map, is_open).1),
            },
            (Err(own), Err(other)) if code(&own) == code(&other) => refused(&own),
            // The inertia of the deformation of a carried run cannot be recovered from a table.
            (Ok(_), Err(other)) if self.names().0 == "recover the table" && other.has(Code::SceneBody) => {
                Outcome::Apart
            }
            (Err(own), Err(other)) => violated(format!("refused by `{own}` and by `{other}`")),
            (Ok(_), Err(other)) => violated(format!("the changed scene is refused: {other}")),
            (Err(own), Ok(_)) => violated(format!("the original scene is refused: {own}")),
        }
    }

    /// Returns a violation with the smallest scene that shows it.
    fn told(&self, subject: &Subject, found: &Violation) -> String {
        let started = Instant::now();
        let fails = |subject: &Subject| {
            started.elapsed() < LONGEST
                && matches!(self.run(subject), Outcome::Violated(other) if other.output == found.output)
        };
        let small = smallest(subject, fails);
        let (transformation, command) = self.names();
        let mut told = format!(
            "crossing {}: {transformation} x {command}: {}, {:.1e} times what is allowed: {}\nbody: {}, {:?}, frame {:?}\nfeatures: {}\n",
            self.seed,
            found.output,
            found.size,
            found.detail,
            small.kind,
            small.basis,
            small.frame,
            features(&small).join(", ")
        );
        let changed = self.pair(&small).ok().flatten().map(|pair| pair.changed);
        if let Some(changed) = changed.as_ref().filter(|changed| changed.frame != small.frame) {
            let _ = writeln!(told, "changed frame: {:?}", changed.frame);
        }
        let changed = changed.map(|changed| changed.scene);
        for (name, scene) in [("scene", Some(small.scene)), ("changed scene", changed)] {
            let Some(scene) = scene else { continue };
            let text = Text::of(&scene);
            let _ = writeln!(told, "--- {name}\n{}", text.scene);
            for (name, table) in text.tables {
                let _ = writeln!(told, "--- {name}\n{table}");
            }
        }
        told
    }
}

/// A crossing that was run.
struct Run {
    /// Features of the scene.
    features: Vec<&'static str>,
    /// Outcome; for a violation the detail contains the smallest scene.
    outcome: Outcome,
}

impl Run {
    fn of(number: u64) -> Self {
        let crossing = Crossing::of(number);
        let subject = match scenes::subject(number) {
            Ok(subject) => subject,
            Err(error) => return Self { features: Vec::new(), outcome: refused(&error) },
        };
        let outcome = match crossing.run(&subject) {
            Outcome::Violated(found) => {
                let detail = crossing.told(&subject, &found);
                Outcome::Violated(Violation { detail, ..found })
            }
            outcome => outcome,
        };
        Self { features: features(&subject), outcome }
    }
}

/// Counts and violations of many crossings.
#[derive(Default)]
struct Matrix {
    /// Number of crossings of feature and transformation.
    counts: BTreeMap<(&'static str, &'static str), usize>,
    /// Number of crossings of transformation and command.
    commands: BTreeMap<(&'static str, &'static str), usize>,
    /// Largest differences by transformation.
    largest: BTreeMap<&'static str, f64>,
    refused: BTreeMap<String, usize>,
    apart: usize,
    scenes: usize,
    /// Differences of open outputs by output and transformation: number, and first difference with its
    /// crossing.
    open: BTreeMap<(String, &'static str), (usize, u64, String)>,
    violations: Vec<String>,
}

impl Matrix {
    fn add(&mut self, number: u64, run: Run) {
        let (transformation, command) = Crossing::of(number).names();
        match run.outcome {
            Outcome::Apart => self.apart += 1,
            Outcome::Refused(code) => *self.refused.entry(code).or_default() += 1,
            Outcome::Same(size, open) => {
                self.scenes += 1;
                if let Some(Violation { output, detail, .. }) = open {
                    self.open.entry((output, transformation)).or_insert((0, number, detail)).0 += 1;
                }
                let largest = self.largest.entry(transformation).or_default();
                *largest = largest.max(size);
                *self.commands.entry((transformation, command)).or_default() += 1;
                for feature in run.features {
                    *self.counts.entry((feature, transformation)).or_default() += 1;
                }
            }
            Outcome::Violated(violation) => self.violations.push(violation.detail),
        }
    }

    /// Returns the counts as a table.
    fn table(&self) -> String {
        let mut table = String::new();
        let crossings: usize = self.counts.values().sum();
        let _ = writeln!(
            table,
            "{} scenes, {crossings} crossings of feature and transformation, {} where the transformation does not apply, refused: {:?}",
            self.scenes, self.apart, self.refused
        );
        for ((output, transformation), (count, first, detail)) in &self.open {
            let _ = writeln!(
                table,
                "open: {output} x {transformation}: {count}, first in crossing {first}: {detail}"
            );
        }
        let mut features: Vec<&str> = self.counts.keys().map(|(feature, _)| *feature).collect();
        features.dedup();
        for (i, Transformation { name, .. }) in transformations::ALL.iter().enumerate() {
            let largest = self.largest.get(name).copied().unwrap_or(0.0);
            let by_command: Vec<String> = commands::ALL
                .iter()
                .map(|Command { name: command, .. }| {
                    format!("{command} {}", self.commands.get(&(*name, *command)).unwrap_or(&0))
                })
                .collect();
            let _ = writeln!(
                table,
                "{i:>2} {name}: {}; largest difference {largest:.1e} of what is allowed",
                by_command.join(", ")
            );
        }
        for feature in features {
            let row: String = transformations::ALL
                .iter()
                .map(|Transformation { name, .. }| {
                    format!("{:>4}", self.counts.get(&(feature, *name)).unwrap_or(&0))
                })
                .collect();
            let _ = writeln!(table, "{feature:>24}{row}");
        }
        table
    }
}

/// Runs `few` crossings from number `first` on, or those requested by `FLEXBODY_CROSSINGS` and
/// `FLEXBODY_FIRST_CROSSING`.
///
/// # Panics
/// Panics with the smallest scene of every violation.
pub fn hold(first: u64, few: u64) {
    let (first, crossings) = (asked("FLEXBODY_FIRST_CROSSING", first), asked("FLEXBODY_CROSSINGS", few));
    let started = Instant::now();
    let (next, matrix) = (AtomicU64::new(first), Mutex::new(Matrix::default()));
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= first + crossings {
                return;
            }
            let before = Instant::now();
            let run = Run::of(number);
            let took = before.elapsed();
            if took > SLOW {
                println!("crossing {number} {:?} took {took:.1?}", Crossing::of(number).names());
            }
            if let Outcome::Violated(violation) = &run.outcome {
                println!("{}", violation.detail);
            }
            matrix.lock().expect("no panic").add(number, run);
        }
    };
    let threads = std::thread::available_parallelism().map_or(2, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let matrix = matrix.into_inner().expect("no panic");
    println!("{}{:.1?}", matrix.table(), started.elapsed());
    let Matrix { violations, .. } = matrix;
    assert!(violations.is_empty(), "{} violations:\n{}", violations.len(), violations.join("\n"));
}
