//! Matrices of OUTPUT4 in the folder of a deck, and the choice of K and M among several matrices.

use super::bulk::Bulk;
use super::rows;
use crate::dmig::Point;
use crate::jobs::{Found, JobSibling, beginning_alike, both, missing};
use crate::nastran_names::{named_pair, pair};
use crate::output4;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_model::RawMatrix;
use std::path::{Path, PathBuf};

const HELP: &str = "write them with PARAM,EXTOUT,DMIGPCH, EXTSEOUT(DMIGPCH), or OUTPUT4 KGG,MGG";

/// K and M as in their files.
pub(super) struct Read {
    pub stiffness: RawMatrix,
    pub mass: RawMatrix,
    /// Points of the rows, ascending.
    pub points: Vec<Point>,
    /// Files in the folder of the deck from which they were read.
    pub files: Vec<SeenFile>,
}

/// OUTPUT4 files in the folder of a deck.
pub(super) struct Outputs {
    files: Vec<(InputFile, output4::Contents)>,
    pub names: Vec<String>,
    /// Index of the file of each name, and index of the matrix in the file.
    places: Vec<(usize, usize)>,
}

impl Outputs {
    pub(super) fn of(paths: Vec<PathBuf>) -> Found<Self> {
        let mut all = Self { files: Vec::new(), names: Vec::new(), places: Vec::new() };
        for path in paths {
            let file = InputFile::open(&path).map_err(|diagnostic| vec![diagnostic])?;
            let found = output4::Contents::of(&file);
            let contents = found.map_err(|diagnostic| vec![diagnostic.in_file(&path)])?;
            let names = contents.names();
            all.places.extend((0..names.len()).map(|at| (all.files.len(), at)));
            all.names.extend(names);
            all.files.push((file, contents));
        }
        Ok(all)
    }

    /// Returns the indices of matrices with the rows of a set of the deck, or of all matrices if there is none.
    pub(super) fn fitting(&self, bulk: &Bulk) -> Vec<usize> {
        let fits = |name: &usize| {
            let (file, at) = self.places[*name];
            let rows = self.files[file].1.square(at);
            rows.is_some_and(|rows| rows::is_set(bulk, rows))
        };
        let fitting: Vec<usize> = (0..self.names.len()).filter(fits).collect();
        if fitting.is_empty() { (0..self.names.len()).collect() } else { fitting }
    }

    pub(super) fn matrices(&self, bulk: &Bulk, (k, m): (usize, usize)) -> Found<Read> {
        let matrix = |name: usize| {
            let (file, at) = self.places[name];
            let (file, contents) = &self.files[file];
            contents.matrix(file, at).map_err(|diagnostic| vec![diagnostic.in_file(file.path())])
        };
        let (stiffness, mass) = both(matrix(k), matrix(m))?;
        let [rows, others] = [&stiffness, &mass].map(|raw| raw.matrix.n_cols());
        if rows != others {
            let message = format!("{} has {rows} rows, {} has {others}", self.names[k], self.names[m]);
            return Err(vec![Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(&mass.path)]);
        }
        let points = rows::points(bulk, rows, &self.names[k], &stiffness.path);
        let points = points.map_err(|diagnostic| vec![diagnostic])?;
        let [k_file, m_file] = [k, m].map(|name| self.places[name].0);
        let mut files = vec![self.files[k_file].0.seen()];
        files.extend((m_file != k_file).then(|| self.files[m_file].0.seen()));
        let files = files.into_iter().collect::<Result<_, _>>().map_err(|diagnostic| vec![diagnostic])?;
        Ok(Read { stiffness, mass, points, files })
    }
}

/// Returns the indices of K and M among `names`: those that the user names (`stated`), else the pair among
/// `candidates`.
///
/// # Errors
/// All pairs, if there is not exactly one.
pub(super) fn choose_pair(
    names: &[String],
    candidates: &[usize],
    stated: Option<&[String; 2]>,
) -> Result<(usize, usize), Vec<(usize, usize)>> {
    if let Some(stated) = stated {
        return named_pair(names, stated);
    }
    let some: Vec<String> = candidates.iter().map(|&k| names[k].clone()).collect();
    let whole = |(k, m): (usize, usize)| (candidates[k], candidates[m]);
    pair(&some).map(whole).map_err(|pairs| pairs.into_iter().map(whole).collect())
}

/// Returns FB109 if there is no pair of matrices, FB111 if there are several.
pub(super) fn no_pair(
    names: &[String],
    pairs: &[(usize, usize)],
    stated: Option<&[String; 2]>,
    path: &Path,
) -> Vec<Diagnostic> {
    if pairs.is_empty() {
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let wanted = match stated {
            Some([k, m]) => format!("the matrices {k} and {m}"),
            None => "a stiffness and a mass matrix (names that begin with K and M".to_owned(),
        };
        let end = if stated.is_some() { format!(" (found: {found})") } else { format!("; found: {found})") };
        return vec![missing(path, &format!("{wanted}{end}"), HELP)];
    }
    let all: Vec<String> = pairs.iter().map(|&(k, m)| format!("{} and {}", names[k], names[m])).collect();
    let help = format!(
        "name the pair: --matrices {},{}, or matrices = [\"{0}\", \"{1}\"] in [files] of a manifest",
        names[pairs[0].0], names[pairs[0].1]
    );
    let message = format!("{} pairs of matrices can be used: {}", pairs.len(), all.join("; "));
    vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(path).with_help(help)]
}

/// Returns FB109 for a deck without any matrix file; `absent` are the missing files that the deck assigns.
pub(super) fn no_files(path: &Path, absent: &[PathBuf]) -> Vec<Diagnostic> {
    let what = match absent.first() {
        Some(file) => format!("{}, which the deck assigns to OUTPUT4,", file.display()),
        None => "beside the deck, a file of matrices (job.pch, job.op4)".to_owned(),
    };
    // A file of another job may be the intended one.
    let is_like =
        |file: &JobSibling| !file.is_of_job && [".pch", ".op4"].iter().any(|end| file.rest.ends_with(end));
    let mut others: Vec<String> = beginning_alike(path)
        .iter()
        .filter(|file| is_like(file))
        .filter_map(|file| Some(file.path.file_name()?.to_string_lossy().into_owned()))
        .collect();
    others.sort();
    match others.first() {
        Some(other) => {
            let help = format!(
                "{HELP}; {other} is named like that of another job: rename it if it belongs to this one"
            );
            vec![missing(path, &what, &help)]
        }
        None => vec![missing(path, &what, HELP)],
    }
}
