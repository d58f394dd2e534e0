//! The cases of `fixtures/codes/`: a command, and its files told as changes of files that are well.

use crate::fixtures;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The contents of files by their names.
pub type Files = BTreeMap<String, Vec<u8>>;

/// What `case.toml` says; the head of `tests/program/bad_input.rs` describes it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    pub what: String,
    pub command: String,
    pub body: Option<String>,
    base: Option<PathBuf>,
    #[serde(default)]
    take: BTreeMap<String, PathBuf>,
    #[serde(default)]
    files: BTreeMap<String, String>,
    #[serde(default)]
    replace: Vec<(String, String, String)>,
    #[serde(default)]
    append: BTreeMap<String, String>,
    #[serde(skip)]
    folder: PathBuf,
}

impl Case {
    pub fn read(folder: &Path) -> Case {
        let file = folder.join("case.toml");
        let text = fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let case: Case = toml::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        Case { folder: folder.to_owned(), ..case }
    }

    /// The files that the command finds, but for the body.
    pub fn files(&self) -> Files {
        let mut files = self.base.as_ref().map(|base| contents(&fixtures().join(base))).unwrap_or_default();
        let taken = self.take.iter().map(|(name, path)| (name.clone(), content(&fixtures().join(path))));
        let written = self.files.iter().map(|(name, text)| (name.clone(), text.clone().into_bytes()));
        for (name, content) in taken.chain(self.own_files()).chain(written) {
            assert!(files.get(&name) != Some(&content), "{}: {name} is that of the base", self.place());
            files.insert(name, content);
        }
        for (name, old, new) in &self.replace {
            let found = self.text(&files, name);
            let times = found.matches(old).count();
            assert!(times == 1, "{}: {name} has {old:?} {times} times, expected once", self.place());
            files.insert(name.clone(), found.replace(old, new).into_bytes());
        }
        for (name, more) in &self.append {
            files.insert(name.clone(), (self.text(&files, name) + more).into_bytes());
        }
        files
    }

    /// The files that lie beside `case.toml`, but for the report.
    pub fn own_files(&self) -> Files {
        let mut files = contents(&self.folder);
        files.retain(|name, _| name != "case.toml" && name != "expected.txt");
        files
    }

    fn text(&self, files: &Files, name: &str) -> String {
        let bytes =
            files.get(name).unwrap_or_else(|| panic!("{}: there is no {name} to change", self.place()));
        String::from_utf8(bytes.clone()).unwrap_or_else(|_| panic!("{}: {name} is no text", self.place()))
    }

    fn place(&self) -> String {
        self.folder.display().to_string()
    }
}

/// The files of a folder.
pub fn contents(folder: &Path) -> Files {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
    paths.map(|path| (name(&path), content(&path))).collect()
}

fn content(file: &Path) -> Vec<u8> {
    fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}
