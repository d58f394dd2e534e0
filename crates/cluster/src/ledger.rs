//! Ledger of a batch, stored beside its list: a body is made again only if something has changed.

use super::sealed;
use flexbody_base::error::Result;
use flexbody_base::output::OutputSlot;
use flexbody_base::provenance::{Fingerprint, generator, sha256_of_file};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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
