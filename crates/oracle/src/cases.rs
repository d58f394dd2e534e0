//! The cases of `fixtures/cases/`: a command, its files as changes of valid files, and its report.

use crate::{fixtures, members};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Contents of files by file name.
pub type Files = BTreeMap<String, Vec<u8>>;

/// Content of the file of a case, as `fixtures/cases/README.md` describes it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    pub what: String,
    pub command: String,
    /// Expected report of the program.
    #[serde(default)]
    pub expected: String,
    pub body: Option<String>,
    /// Models of further bodies by file name.
    #[serde(default)]
    pub bodies: BTreeMap<String, String>,
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
    file: PathBuf,
}

impl Case {
    /// Reads the case `name`, for instance `FB201-interfaces`.
    pub fn read(name: &str) -> Case {
        Self::open(&fixtures().join("cases").join(name).with_extension("toml"))
    }

    /// Reads every case, in the order of the names.
    pub fn all() -> Vec<Case> {
        let files = members(&fixtures().join("cases")).into_iter().filter(|name| name.ends_with(".toml"));
        files.map(|name| Self::open(&fixtures().join("cases").join(name))).collect()
    }

    fn open(file: &Path) -> Case {
        let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let case: Case = toml::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        Case { file: file.to_owned(), ..case }
    }

    /// Returns the name of the case, which begins with the code.
    pub fn name(&self) -> String {
        self.file.file_stem().expect("a name").to_string_lossy().into_owned()
    }

    /// Returns the code that the case tests.
    pub fn code(&self) -> String {
        self.name().split('-').next().expect("a first part").to_owned()
    }

    /// Writes `report` as the expected one into the file of the case.
    ///
    /// # Panics
    /// If the report contains three apostrophes, which would end the text.
    pub fn bless(&self, report: &str) {
        const BEGIN: &str = "expected = '''\n";
        const END: &str = "'''\n";
        assert!(!report.contains("'''"), "{}: {report}", self.place());
        let text = fs::read_to_string(&self.file).expect("it was read");
        let written = match text.split_once(BEGIN) {
            Some((before, rest)) => {
                let (_, after) = rest.split_once(END).expect("the report ends");
                format!("{before}{BEGIN}{report}{END}{after}")
            }
            // A new case gets the report before its tables.
            None => {
                let tables = ["\n[bodies]", "\n[take]", "\n[files]", "\n[append]"];
                let at = tables.iter().filter_map(|table| text.find(table)).min().unwrap_or(text.len());
                let (before, after) = text.split_at(at);
                format!("{}\n{BEGIN}{report}{END}{after}", before.trim_end())
            }
        };
        fs::write(&self.file, written).expect("a writable case");
    }

    /// Returns the files that the command finds, without the body.
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

    /// Returns the files of `fixtures/cases/files` for the case: binary and long files.
    pub fn own_files(&self) -> Files {
        let folder = fixtures().join("cases").join("files").join(self.name());
        if folder.is_dir() { contents(&folder) } else { Files::new() }
    }

    fn text(&self, files: &Files, name: &str) -> String {
        let bytes =
            files.get(name).unwrap_or_else(|| panic!("{}: there is no {name} to change", self.place()));
        String::from_utf8(bytes.clone()).unwrap_or_else(|_| panic!("{}: {name} is no text", self.place()))
    }

    fn place(&self) -> String {
        self.file.display().to_string()
    }
}

/// Returns the files of a folder.
pub fn contents(folder: &Path) -> Files {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
    paths.map(|path| (name(&path), content(&path))).collect()
}

fn content(file: &Path) -> Vec<u8> {
    fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}
