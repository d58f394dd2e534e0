//! Files in the folder of the main file of a job whose names begin with its stem.

use std::path::{Path, PathBuf};

/// Returns true when a path is that of a keyword deck, by its name.
pub(super) fn is_deck(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("inp"))
}

/// Returns the files in the folder of the main file of a job that are named like it, in any case: its stem, then a dot,
/// an underscore or the like, or a matrix name of Abaqus. Each comes as the rest of its name after the stem, in lower
/// case, and the path.
pub(super) fn siblings(main: &Path) -> impl Iterator<Item = (String, PathBuf)> {
    let siblings = beginning_alike(main).into_iter().filter(|file| file.is_of_job);
    siblings.map(|JobSibling { rest, path, .. }| (rest, path))
}

/// File in the folder of the main file of a job whose name begins with the stem of the job.
pub(super) struct JobSibling {
    /// Rest of the name, in lower case.
    pub rest: String,
    pub path: PathBuf,
    /// False for files of other decks, whose names continue the stem (`job_2.op4` beside `job_2.bdf`), and for files
    /// that a letter or a number distinguishes from the job (`job2.op4`, `job_2.op4`, `job_v2.op4`).
    pub is_of_job: bool,
}

/// Returns the files in the folder of the main file of a job whose names begin with its stem, in any case.
pub(super) fn beginning_alike(main: &Path) -> Vec<JobSibling> {
    let Some(stem) = main.file_stem().map(|stem| stem.to_string_lossy().to_lowercase()) else {
        return Vec::new();
    };
    let folder = match main.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let listed = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let rest_of = |name: std::ffi::OsString| {
        let lower = name.to_string_lossy().to_lowercase();
        Some((lower.strip_prefix(&stem)?.to_owned(), main.with_file_name(name)))
    };
    let all: Vec<(String, PathBuf)> = listed.filter_map(|file| rest_of(file.file_name())).collect();
    let decks: Vec<String> = all.iter().filter_map(|(rest, _)| stem_of_deck(rest)).collect();
    // A file belongs to another deck if its name continues the stem of that deck.
    let continues = |rest: &str, deck: &String| {
        rest.strip_prefix(deck.as_str()).is_some_and(|more| !more.starts_with(char::is_alphanumeric))
    };
    // A name that continues the stem by a letter or a version number belongs to another job, except for the matrices of
    // Abaqus.
    let is_of_job = |rest: &str| {
        let name = rest.trim_start_matches(|c: char| !c.is_alphanumeric());
        let version = name.strip_prefix('v').unwrap_or(name);
        let is_of_abaqus = ["stif", "mass"].iter().any(|kind| rest.starts_with(kind));
        (is_of_abaqus || !rest.starts_with(char::is_alphanumeric))
            && !version.starts_with(|c: char| c.is_ascii_digit())
            && !decks.iter().any(|deck| continues(rest, deck))
    };
    let beside = |(rest, path): (String, PathBuf)| JobSibling { is_of_job: is_of_job(&rest), rest, path };
    all.into_iter().map(beside).collect()
}

/// Returns the part of the stem of another deck after the stem of the job; `rest` is that part of its file name.
fn stem_of_deck(rest: &str) -> Option<String> {
    const DECKS: &[&str] = &[".inp", ".bdf", ".dat", ".nas"];
    let stem = DECKS.iter().find_map(|extension| rest.strip_suffix(extension))?;
    (!stem.is_empty()).then(|| stem.to_owned())
}
