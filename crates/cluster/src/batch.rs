//! Batches: the list of the bodies (`LIST.toml`), their order, and the ledger.

use super::sealed;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::{Fingerprint, generator, sha256_of_file};
use flexbody_base::read_files::{note_read, read_text};
use flexbody_body::basis::{ModeSettings, search_plan};
use flexbody_linalg::context::Context;
use flexbody_model::FeModel;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest size of a list in bytes: some hundred thousand bodies.
const MAX_BYTES: u64 = 64 << 20;

/// Bodies to make, and the resources for them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatchList {
    /// Largest number of conversions that run in parallel.
    pub parallel: Option<usize>,
    /// Number of threads of each conversion.
    pub threads: Option<u16>,
    /// Command-line options of every conversion.
    #[serde(default)]
    pub options: Vec<String>,
    /// Bodies of the list.
    #[serde(rename = "body", default)]
    pub bodies: Vec<BatchBody>,
}

/// One body of the list.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatchBody {
    /// Manifest or job, relative to the folder of the list.
    pub model: PathBuf,
    /// Flex-body file to write, relative to the folder of the list.
    pub output: PathBuf,
    /// Command-line options of this conversion, in addition to the common ones.
    #[serde(default)]
    pub options: Vec<String>,
    /// Memory of the conversion in bytes, if it is better known than by the estimate.
    pub memory: Option<u64>,
}

/// Reads a list. Paths are resolved relative to its folder.
///
/// # Errors
/// [`BatchSyntax`](Code::BatchSyntax) for a list that cannot be read or is invalid.
pub fn read_batch_list(path: &Path) -> Result<BatchList> {
    let wrong = |message: String| Error::from(Diagnostic::new(Code::BatchSyntax, message).in_file(path));
    note_read(path);
    let text = read_text(path, MAX_BYTES).map_err(|e| wrong(format!("the list cannot be read: {e}")))?;
    let mut list: BatchList = toml::from_str(&text).map_err(|e| {
        let line = e.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
        let diagnostic = Diagnostic::new(Code::BatchSyntax, e.message().to_owned());
        Error::from(diagnostic.in_file(path).at_line(line))
    })?;
    if list.bodies.is_empty() {
        return Err(wrong("the list has no [[body]]".to_owned()));
    }
    if list.parallel == Some(0) || list.threads == Some(0) {
        return Err(wrong("`parallel` and `threads` must be at least 1".to_owned()));
    }
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    for body in &mut list.bodies {
        body.model = folder.join(&body.model);
        body.output = folder.join(&body.output);
    }
    let mut outputs: Vec<&PathBuf> = list.bodies.iter().map(|body| &body.output).collect();
    outputs.sort();
    if let Some(twice) = outputs.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(wrong(format!("two bodies have the output {}", twice[0].display())));
    }
    Ok(list)
}

// Order of the bodies of a batch: the next one is the first of the list that fits into the free memory, so that a
// large body at the front does not block small ones. No body is overtaken forever, since the number of parallel
// conversions is limited.

/// Memory of a process before it has read anything, in bytes.
const PROCESS_BYTES: u64 = 60_000_000;

/// Bytes per entry of a matrix while it is read: the stored entry and its source.
const BYTES_PER_ENTRY: u64 = 40;

/// Returns the largest memory of a conversion of a model in bytes: that of the search by its plan, and that of the
/// matrices.
///
/// # Errors
/// The errors of the analysis of a model without a factor.
pub fn conversion_bytes(model: &FeModel, settings: &ModeSettings) -> Result<u64> {
    let pencil = model.pencil();
    let entries = pencil.stiffness().as_csc().nnz() + pencil.mass().as_csc().nnz();
    Ok(PROCESS_BYTES
        + BYTES_PER_ENTRY * entries as u64
        + search_plan(model, settings, &Context::QUIET)?.bytes())
}

/// Resources for parallel conversions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Memory in bytes.
    pub memory: u64,
    /// Number of conversions.
    pub parallel: usize,
}

impl Budget {
    /// Returns the index of the next body to start, given the memory of the `waiting` and the `running` ones in bytes.
    /// A body that needs more than the whole memory runs alone: its conversion reports the shortage.
    pub fn next(&self, waiting: &[u64], running: &[u64]) -> Option<usize> {
        if running.len() >= self.parallel {
            return None;
        }
        let free = self.memory.saturating_sub(running.iter().sum());
        let fits = waiting.iter().position(|&need| need <= free);
        fits.or_else(|| (running.is_empty() && !waiting.is_empty()).then_some(0))
    }

    /// Returns the memory limit in bytes of a conversion with this need.
    pub fn limit(&self, need: u64) -> u64 {
        // A quarter more: the estimate bounds the search, but not the memory that reading retains.
        (need + need / 4).min(self.memory)
    }
}

// Ledger of a batch, stored beside its list: a body is made again only if something has changed.

const FORMAT: &str = "flexbody-batch";

/// Body that was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DoneBody {
    /// Fingerprint of the program, the options and the inputs.
    pub inputs: String,
    /// SHA-256 of the file that was written.
    pub output: String,
    /// Facts about the body for the report.
    #[serde(rename = "told")]
    pub summary: serde_json::Value,
}

/// Bodies that were made, by the paths of their files.
#[derive(Debug, Clone, PartialEq)]
pub struct Ledger {
    path: PathBuf,
    done: BTreeMap<String, DoneBody>,
}

impl Ledger {
    /// Reads the ledger of a list; empty if there is none, or if it is unusable.
    pub fn of(list: &Path) -> Self {
        let mut path = list.as_os_str().to_owned();
        path.push(".done");
        let path = PathBuf::from(path);
        let done = sealed::open_unrecorded(&path, FORMAT).unwrap_or_default();
        Self { path, done }
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the entry of a body that was made of these inputs and whose file is unchanged.
    pub fn done(&self, output: &Path, inputs: &str) -> Option<&DoneBody> {
        let body = self.done.get(&output.display().to_string())?;
        let is_unchanged = || sha256_of_file(output).ok().is_some_and(|sha| sha == body.output);
        (body.inputs == inputs && is_unchanged()).then_some(body)
    }

    /// Checks before the work that the ledger can be written.
    ///
    /// # Errors
    /// The errors of [`OutputSlot::prepare`].
    pub fn reserve(&self) -> Result<()> {
        OutputSlot::prepare(&self.path).map(drop)
    }

    /// Records that a body was made.
    ///
    /// # Errors
    /// The errors of [`OutputSlot`].
    pub fn add(&mut self, output: &Path, inputs: String, summary: serde_json::Value) -> Result<()> {
        let Ok(sha) = sha256_of_file(output) else { return Ok(()) };
        self.done.insert(output.display().to_string(), DoneBody { inputs, output: sha, summary });
        let slot = OutputSlot::prepare(&self.path)?;
        slot.fill(sealed::seal(FORMAT, &self.done).as_bytes())?;
        OutputSlot::keep_all([slot])
    }
}

/// Returns the fingerprint of this program, the options of a conversion and the files that it reads. A missing file
/// counts as empty.
pub fn inputs_fingerprint(words: &[String], files: &[PathBuf]) -> String {
    let mut all = Fingerprint::default();
    let mut add = |text: &str| {
        all.update(text.as_bytes());
        all.update(b"\n");
    };
    add(&generator());
    words.iter().for_each(|word| add(word));
    for file in files {
        add(&sha256_of_file(file).unwrap_or_default());
    }
    all.hex()
}
