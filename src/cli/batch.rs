//! Command `flexbody batch`: makes the bodies of a list, each by a process of its own, as many in parallel as fit into
//! the memory.

use super::arguments::{Arguments, BatchArguments, Command, ConvertArguments};
use super::outcome::{Outcome, refuse_replacing, refuse_replacing_read};
use super::resources::{for_threads, memory_left};
use super::run::Run;
use super::terminal::Watcher;
use flexbody_base::children;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, ExitCode, Result};
use flexbody_body::basis::ModeSettings;
use flexbody_cluster::{
    BatchBody, BatchList, Budget, Ledger, conversion_bytes, inputs_fingerprint, read_batch_list,
};
use flexbody_input::read_model;
use flexbody_linalg::context::{Event, Watch};
use flexbody_model::FeModel;
use flexbody_report::{BatchFacts, BatchRow};
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::sync::{OnceLock, mpsc};
use std::time::Instant;

/// Number of threads of a conversion unless the list states it.
const THREADS: u16 = 1;

/// Largest number of parallel conversions, whatever the list states: each needs a thread, a process and two pipes.
const MOST_PARALLEL: usize = 1024;

/// Memory for reading a body of another program, in bytes: such files are small.
const IMPORT: u64 = 500_000_000;

/// Body to be made.
struct Body {
    words: Vec<String>,
    output: PathBuf,
    /// Fingerprint of its inputs.
    inputs: String,
    need: u64,
}

/// Task of making the bodies of a list.
#[derive(Clone, Copy)]
pub(crate) struct BatchTask<'a> {
    /// File of the list.
    pub path: &'a Path,
    pub list: &'a BatchList,
    /// Reports on the batch, which must not replace inputs or bodies.
    pub reports: &'a [PathBuf],
    /// Memory of all parallel conversions in bytes; `None` for the free memory.
    pub memory_limit: Option<u64>,
    /// True if the options of the list may name programs to start.
    pub allow_programs: bool,
    /// Words that start the program `flexbody`.
    pub program: &'a [OsString],
}

static PROGRAM: OnceLock<Vec<OsString>> = OnceLock::new();

/// Sets the words that start the program `flexbody`, for a process whose executable is another one. Only the first call
/// has an effect.
pub fn set_program(words: Vec<OsString>) {
    PROGRAM.get_or_init(|| words);
}

/// Returns the words that start this program again.
fn this_program() -> Result<Vec<OsString>> {
    if let Some(words) = PROGRAM.get() {
        return Ok(words.clone());
    }
    let own = std::env::current_exe().map_err(|e| {
        Error::from(Diagnostic::new(Code::MemoryShort, format!("this program cannot be started again: {e}")))
    })?;
    Ok(vec![own.into_os_string()])
}

pub(super) fn run(arguments: &BatchArguments) -> Result<Outcome> {
    let list = read_batch_list(&arguments.list)?;
    let mut run = Run::begin(arguments.printing, [&arguments.list], None, &arguments.report)?;
    let watcher = Watcher::new(arguments.printing.quiet || arguments.printing.json, "reading the list");
    let task = BatchTask {
        path: &arguments.list,
        list: &list,
        reports: &arguments.report,
        memory_limit: arguments.memory_limit,
        allow_programs: arguments.allow_programs,
        program: &this_program()?,
    };
    let made = task.run(&|event| watcher.hear(event));
    watcher.clear();
    let facts = made?;
    let failed = failed(&facts, &arguments.list);
    let passed = failed.is_none();
    run.note(failed);
    run.end(None, |format| facts.render(format), passed)
}

/// Returns the error about failed bodies; `None` if all were made.
pub(crate) fn failed(facts: &BatchFacts, list: &Path) -> Option<Diagnostic> {
    (facts.failed() > 0).then(|| {
        let message = format!("{} of {} bodies failed", facts.failed(), facts.bodies().len());
        Diagnostic::new(Code::BatchFailed, message).in_file(list)
    })
}

impl BatchTask<'_> {
    /// Makes the bodies that are missing or have changed inputs, as many in parallel as fit into the memory. A failed
    /// body does not end the batch.
    ///
    /// # Errors
    /// FB770 for options of the list that are not those of a conversion; the errors of the ledger.
    pub(crate) fn run(&self, watch: Watch<'_>) -> Result<BatchFacts> {
        let list = self.list;
        let parsed = list.bodies.iter().map(|body| parse(list, body)).collect::<Result<Vec<_>>>()?;
        if !self.allow_programs {
            list.bodies.iter().zip(&parsed).try_for_each(|(body, (_, own))| refuse_programs(body, own))?;
        }
        let mut ledger = Ledger::of(self.path);
        ledger.reserve()?;
        let budget = Budget {
            memory: memory_left(self.memory_limit).unwrap_or(u64::MAX),
            parallel: parallel(list).min(MOST_PARALLEL),
        };
        // Skip unchanged bodies, and estimate the memory of the others.
        let mut rows: Vec<BatchRow> = Vec::new();
        let mut waiting: Vec<(usize, Body)> = Vec::new();
        for (index, (body, (words, converted))) in list.bodies.iter().zip(&parsed).enumerate() {
            let mut row = empty_row(body);
            let inputs = inputs_of(words, converted);
            match ledger.done(&body.output, &inputs) {
                Some(done) => {
                    row.read(&done.summary);
                    row.state = "unchanged";
                }
                None => match need(body, converted, watch) {
                    Ok(need) => {
                        row.memory_estimate_bytes = need;
                        let (words, output) = (words.clone(), body.output.clone());
                        waiting.push((index, Body { words, output, inputs, need }));
                    }
                    Err(error) => fail(&mut row, &error),
                },
            }
            rows.push(row);
        }
        self.refuse_replacing_inputs(&parsed, &ledger)?;
        watch(Event::Phase("converting"));
        self.convert(waiting, budget, &mut rows, &mut ledger, watch)?;
        Ok(BatchFacts::new(self.path.display().to_string(), budget.memory, budget.parallel, rows))
    }

    /// Refuses outputs of the list and reports that would replace an input of any of its bodies or another output.
    fn refuse_replacing_inputs(
        &self,
        parsed: &[(Vec<String>, Box<ConvertArguments>)],
        ledger: &Ledger,
    ) -> Result<()> {
        let files = |converted: &ConvertArguments| match converted.foreign_format() {
            Some(_) => converted.model.iter().cloned().collect(),
            None => converted.model_files().map(|files| files.paths()).unwrap_or_default(),
        };
        let mut inputs: Vec<PathBuf> = parsed.iter().flat_map(|(_, converted)| files(converted)).collect();
        inputs.push(self.path.to_path_buf());
        let own = ledger.path().to_path_buf();
        let outputs = || self.list.bodies.iter().map(|body| &body.output).chain(self.reports).chain([&own]);
        refuse_replacing(inputs.iter(), outputs())?;
        refuse_replacing_read(outputs())
    }

    /// Runs all waiting conversions, as many in parallel as fit. Each success is recorded in the ledger at once.
    fn convert(
        &self,
        mut waiting: Vec<(usize, Body)>,
        budget: Budget,
        rows: &mut [BatchRow],
        ledger: &mut Ledger,
        watch: Watch<'_>,
    ) -> Result<()> {
        let (program, all) = (self.program, waiting.len());
        let (ended, of) = mpsc::channel::<FinishedConversion>();
        std::thread::scope(|scope| {
            let mut running: Vec<u64> = Vec::new();
            loop {
                let needs =
                    |waiting: &[(usize, Body)]| waiting.iter().map(|(_, body)| body.need).collect::<Vec<_>>();
                while let Some(next) = budget.next(&needs(&waiting), &running) {
                    let (index, body) = waiting.remove(next);
                    running.push(body.need);
                    let ended = ended.clone();
                    let (need, limit) = (body.need, budget.limit(body.need));
                    // The loop receives one message from every running conversion.
                    let work = move || drop(ended.send(convert(program, index, body, limit)));
                    if let Err(error) = std::thread::Builder::new().spawn_scoped(scope, work) {
                        running.pop();
                        rows[index].error = Some(format!("it cannot be started: {error}"));
                        rows[index].exit_code = ExitCode::Resources as i32;
                        rows[index].memory_estimate_bytes = need;
                    }
                }
                if running.is_empty() {
                    return Ok(());
                }
                watch(Event::Fraction(1.0 - (waiting.len() + running.len()) as f64 / all as f64));
                let Ok(done) = of.recv() else { return Ok(()) };
                running.iter().position(|need| *need == done.need).map(|at| running.swap_remove(at));
                let row = &mut rows[done.index];
                row.read(&done.json);
                (row.exit_code, row.seconds) = (done.exit_code, done.seconds);
                if done.exit_code == 0 {
                    row.state = "done";
                    ledger.add(&done.output, done.inputs, done.json)?;
                } else if row.error.is_none() {
                    row.error = Some(format!("its process ended with code {}", done.exit_code));
                }
            }
        })
    }
}

/// Returns the number of parallel conversions: as stated in the list, or as many as have processors for their threads.
fn parallel(list: &BatchList) -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    list.parallel.unwrap_or_else(|| (processors / usize::from(list.threads.unwrap_or(THREADS))).max(1))
}

/// Returns the words of the command line of a conversion, and the parsed arguments.
fn parse(list: &BatchList, body: &BatchBody) -> Result<(Vec<String>, Box<ConvertArguments>)> {
    let (model, output) = (body.model.display().to_string(), body.output.display().to_string());
    let own = ["convert".to_owned(), model, "--output".to_owned(), output, "--json".to_owned()];
    let threads = ["--threads".to_owned(), list.threads.unwrap_or(THREADS).to_string()];
    let more = own.into_iter().chain(threads).chain(list.options.clone()).chain(body.options.clone());
    let words: Vec<String> = more.collect();
    let program = std::iter::once("flexbody".to_owned());
    match Arguments::parse_words(program.chain(words.clone()).map(OsString::from))
        .map(|parsed| parsed.command)
    {
        Ok(Command::Convert(converted)) => Ok((words, converted)),
        Ok(_) => Err(refused(body, "its options belong to another command")),
        Err(error) => {
            let text = error.render().to_string();
            let first = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
            Err(refused(body, &first))
        }
    }
}

/// Refuses a list that names programs to start: a list is data, unless the command line allows programs.
fn refuse_programs(body: &BatchBody, converted: &ConvertArguments) -> Result<()> {
    let named =
        [("--mpiexec", converted.engine.mpiexec.is_some()), ("--python", converted.engine.python.is_some())];
    match named.iter().find(|(_, is_named)| *is_named) {
        None => Ok(()),
        Some((option, _)) => {
            let message = format!("{}: {option} would start a program", body.output.display());
            let help =
                "set FLEXBODY_MPIEXEC and FLEXBODY_PYTHON, or allow it with flexbody batch --allow-programs";
            Err(Diagnostic::new(Code::BatchSyntax, message).with_help(help).into())
        }
    }
}

fn refused(body: &BatchBody, why: &str) -> Error {
    Diagnostic::new(Code::BatchSyntax, format!("{}: {why}", body.output.display())).into()
}

/// Returns the fingerprint of the options of a conversion and of every file that they or the model name.
fn inputs_of(words: &[String], converted: &ConvertArguments) -> String {
    let mut files = converted.model_files().map(|files| files.paths()).unwrap_or_default();
    let named = words.iter().skip(1).map(|word| word.rsplit('=').next().unwrap_or(word)).map(PathBuf::from);
    files.extend(named.filter(|path| *path != converted.output && path.is_file()));
    inputs_fingerprint(words, &files)
}

/// Returns the memory of a conversion in bytes: as stated in the list, or estimated from its plan, for which the model
/// is read.
fn need(body: &BatchBody, converted: &ConvertArguments, watch: Watch<'_>) -> Result<u64> {
    if let Some(known) = body.memory {
        return Ok(known);
    }
    if converted.foreign_format().is_some() {
        return Ok(IMPORT);
    }
    watch(Event::Phase("estimating"));
    let model = FeModel::from_raw(read_model(&converted.model_files()?)?)?.model;
    let wanted = converted.request()?.mode_settings(model.units()).wanted;
    let settings = ModeSettings { wanted, ..ModeSettings::default() };
    for_threads(converted.threads, || conversion_bytes(&model, &settings))
}

fn empty_row(body: &BatchBody) -> BatchRow {
    BatchRow {
        output: body.output.display().to_string(),
        state: "failed",
        exit_code: 0,
        error: None,
        warnings: 0,
        memory_estimate_bytes: 0,
        peak_memory_bytes: None,
        seconds: 0.0,
        n_dofs: None,
        modes: None,
        frequencies_hz: None,
        complete: None,
    }
}

fn fail(row: &mut BatchRow, error: &Error) {
    row.exit_code = error.exit_code() as i32;
    let cause = error.first_error();
    row.error = Some(format!("{} {}", cause.code().id(), cause.message()));
}

/// Result of a conversion that has ended.
struct FinishedConversion {
    index: usize,
    need: u64,
    output: PathBuf,
    inputs: String,
    exit_code: i32,
    json: Value,
    seconds: f64,
}

/// Runs one conversion as a separate process, so that one that ends for lack of memory does not end the others.
fn convert(program: &[OsString], index: usize, body: Body, limit: u64) -> FinishedConversion {
    let Body { words, output, inputs, need } = body;
    let begun = Instant::now();
    let mut process = Process::new(&program[0]);
    process.args(&program[1..]).args(&words).stdin(Stdio::null());
    if !words.iter().any(|word| word.starts_with("--memory-limit")) {
        process.args(["--memory-limit", &limit.to_string()]);
    }
    let ended = children::output(&mut process);
    let (exit_code, json) = match ended {
        Ok(ended) => {
            let json = serde_json::from_slice(&ended.stdout).unwrap_or(Value::Null);
            (ended.status.code().unwrap_or(-1), json)
        }
        Err(_) => (-1, Value::Null),
    };
    FinishedConversion {
        index,
        need,
        output,
        inputs,
        exit_code,
        json,
        seconds: begun.elapsed().as_secs_f64(),
    }
}
