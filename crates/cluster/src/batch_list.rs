//! List of the bodies of a batch: `LIST.toml`.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::read_files::{note_read, read_text};
use serde::Deserialize;
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
        let found = Diagnostic::new(Code::BatchSyntax, e.message().to_owned());
        Error::from(found.in_file(path).at_line(line))
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
