//! Files of a model while they are read.

use flexbody_base::diagnostic::{Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::input_file::InputFile;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Files of the model, each opened once.
pub(super) struct OpenFiles {
    files: Vec<std::result::Result<InputFile, Diagnostic>>,
    places: HashMap<PathBuf, usize>,
}

impl OpenFiles {
    /// Opens the files of the given paths.
    pub(super) fn new<'p>(paths: impl Iterator<Item = &'p Path>) -> Self {
        let (mut files, mut places) = (Vec::new(), HashMap::new());
        for path in paths {
            if !places.contains_key(path) {
                places.insert(path.to_path_buf(), files.len());
                files.push(InputFile::open_unread(path));
            }
        }
        Self { files, places }
    }

    /// Returns a file whose bytes are in memory.
    pub(super) fn get(&self, path: &Path) -> Diagnosed<&InputFile> {
        let file = self.unread(path)?;
        file.load().map_err(|diagnostic| vec![diagnostic])?;
        Ok(file)
    }

    /// Returns a file whose bytes may not be in memory yet.
    pub(super) fn unread(&self, path: &Path) -> Diagnosed<&InputFile> {
        let place = self.places.get(path).expect("every path of the model is opened");
        self.files[*place].as_ref().map_err(|diagnostic| vec![diagnostic.clone()])
    }

    /// Returns the files that could be opened.
    pub(super) fn all(&self) -> impl Iterator<Item = &InputFile> {
        self.files.iter().filter_map(|file| file.as_ref().ok())
    }

    /// Checks that no file has changed.
    ///
    /// # Errors
    /// FB132 for every file that is no longer the one that was opened.
    pub(super) fn refuse_changed(&self) -> Result<()> {
        let changed: Vec<Diagnostic> = self.all().filter_map(|file| file.refuse_changed().err()).collect();
        if changed.is_empty() { Ok(()) } else { Err(Error::new(changed)) }
    }

    /// Frees the bytes of all files.
    pub(super) fn forget_bytes(&mut self) {
        self.files.iter_mut().filter_map(|file| file.as_mut().ok()).for_each(InputFile::forget_bytes);
    }
}
