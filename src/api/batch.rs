//! Bodies of a list, each made by a process of its own.

use super::ReportFormat;
use super::progress::{Listener, heard};
use crate::cli::{BatchTask, batch_failure};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_cluster::read_batch_list;
use flexbody_report::BatchFacts;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Settings of a batch. By default it takes the free memory, starts no programs that the list names, and makes each body
/// by the program `flexbody` on the path.
#[derive(Debug, Clone, Default)]
pub struct BatchOptions {
    memory_limit: Option<u64>,
    allow_programs: bool,
    program: Option<Vec<OsString>>,
}

impl BatchOptions {
    /// Limits the memory of all parallel conversions. Unit: bytes.
    pub fn memory_limit(mut self, bytes: u64) -> Self {
        self.memory_limit = Some(bytes);
        self
    }

    /// Lets the options of the list name programs to start (`--mpiexec`, `--python`).
    pub fn allow_programs(mut self) -> Self {
        self.allow_programs = true;
        self
    }

    /// Sets the words that start the program `flexbody`, without its arguments.
    pub fn program(mut self, words: impl IntoIterator<Item = impl Into<OsString>>) -> Self {
        self.program = Some(words.into_iter().map(Into::into).collect());
        self
    }
}

/// Bodies of a list, made by the program `flexbody`.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    facts: BatchFacts,
    list: PathBuf,
}

/// Body of a batch.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BatchedBody {
    /// Flex-body file, written or not.
    pub output: String,
    /// State: `done`, `unchanged` (made by an earlier run) or `failed`.
    pub state: &'static str,
    /// First error of the conversion; `None` without errors.
    pub error: Option<String>,
    /// Number of modes.
    pub n_modes: Option<u64>,
    /// First and last frequency. Unit: Hz.
    pub frequencies_hz: Option<[f64; 2]>,
}

impl Batch {
    /// Makes the bodies of a list (docs/how_to/batch.md) that are missing or have changed inputs, as many in parallel as
    /// fit into the memory, like `flexbody batch`. A failed body does not end the batch.
    ///
    /// # Errors
    /// FB770 for a list that cannot be read or has invalid options; FB104 and FB105 if its ledger cannot be written;
    /// FB605 if the listener stops it, which ends it when the conversions that run have ended.
    pub fn run(list: impl AsRef<Path>, options: &BatchOptions, listener: Listener<'_>) -> Result<Self> {
        let path = list.as_ref();
        let list = read_batch_list(path)?;
        let program = options.program.clone().filter(|words| !words.is_empty());
        let task = BatchTask {
            path,
            list: &list,
            reports: &[],
            memory_limit: options.memory_limit,
            allow_programs: options.allow_programs,
            program: &program.unwrap_or_else(|| vec!["flexbody".into()]),
        };
        let facts = heard(listener, |context| task.run(context.watch))?;
        Ok(Self { facts, list: path.to_owned() })
    }

    /// Returns the bodies, in the order of the list.
    pub fn bodies(&self) -> Vec<BatchedBody> {
        let rows = self.facts.bodies().iter();
        rows.map(|row| BatchedBody {
            output: row.output.clone(),
            state: row.state,
            error: row.error.clone(),
            n_modes: row.modes,
            frequencies_hz: row.frequencies_hz,
        })
        .collect()
    }

    /// Returns the number of failed bodies.
    pub fn failed(&self) -> usize {
        self.facts.failed()
    }

    /// Returns the error about failed bodies (FB771); empty if all were made.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        batch_failure(&self.facts, &self.list).into_iter().collect()
    }

    /// Returns the report of `flexbody batch`.
    pub fn report(&self, format: ReportFormat) -> String {
        self.facts.render(format.inner())
    }
}
