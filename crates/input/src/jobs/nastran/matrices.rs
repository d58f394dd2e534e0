//! K and M of a deck, and their transformation from the rows of the files to those of the model.

use super::bulk::Bulk;
use super::carried_mass::CarriedMass;
use super::elimination::{Elimination, Followers, GridPlaces};
use crate::jobs::job::{JobFile, both, missing};
use crate::jobs::siblings::{JobSibling, beginning_alike, siblings};
use crate::matrices::dmig::{Dmigs, Point, label};
use crate::matrices::named_matrices::{named_pair, pair};
use crate::matrices::output4;
use crate::matrices::turn::Turn;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_elements::{Equation, NotDescribed};
use flexbody_linalg::CscMatrix;
use flexbody_model::{
    DofLabel, GivenRows, NodeAxes as Axes, Nodes, RawFollowers, RawMatrix, RowMap, filled_rows,
};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// K and M with the labels of their rows.
pub(super) struct Matrices {
    pub stiffness: RawMatrix,
    pub mass: RawMatrix,
    pub labels: Vec<DofLabel>,
    /// Files in the folder of the deck from which they were read.
    pub files: Vec<SeenFile>,
    /// Number of rows in the files.
    n_given: usize,
    /// Elimination of dependent rows by constraints of the deck with the names of the constraints, if the files contain
    /// these rows.
    followers: Option<(Elimination, String)>,
    /// Mass of points that follow several grids, before the elimination.
    carried: Option<CarriedMass>,
    /// Rotation of the rows to the axes of the model, if they had others.
    turn: Option<CscMatrix>,
    /// Rows that were kept, if others were left out.
    retained: Option<Vec<usize>>,
}

impl Matrices {
    /// Reads the matrices of the deck, else those of the files in its folder: either punch files or OUTPUT4.
    pub(super) fn of(bulk: &Bulk, dmigs: Dmigs, job: &JobFile, places: &GridPlaces<'_>) -> Diagnosed<Self> {
        let (path, stated) = (&job.path, job.matrices.as_ref());
        let names = dmigs.names();
        // Beside elements, DMIG matrices are a part of the model, which its K and M contain.
        if !names.is_empty() && !bulk.has_elements {
            let pair = choose_pair(&names, &dmigs.candidates(), stated)
                .map_err(|pairs| no_pair(&names, &pairs, stated, path))?;
            return Self::of_dmigs(bulk, dmigs, pair, places);
        }
        let (punches, outputs) = files_beside(bulk, job)?;
        let punched = Dmigs::of(&punches)?;
        let outputs = Outputs::of(outputs)?;
        // Exactly one kind of file must have a pair; else all pairs are reported.
        let punch_pair = choose_pair(&punched.names(), &punched.candidates(), stated);
        match (punch_pair, choose_pair(&outputs.names, &outputs.fitting(bulk), stated)) {
            (Ok(pair), Err(_)) => Self::of_dmigs(bulk, punched, pair, places),
            (Err(_), Ok(pair)) => Self::new(bulk, outputs.matrices(bulk, pair)?, places),
            (punch_pair, output_pair) => {
                let names = [punched.names(), outputs.names].concat();
                let shift = punched.names().len();
                let shifted = |(k, m): (usize, usize)| (k + shift, m + shift);
                let mut pairs = punch_pair.map_or_else(|pairs| pairs, |pair| vec![pair]);
                let others = output_pair.map_or_else(|pairs| pairs, |pair| vec![pair]);
                pairs.extend(others.into_iter().map(shifted));
                Err(no_pair(&names, &pairs, stated, path))
            }
        }
    }

    fn of_dmigs(
        bulk: &Bulk,
        mut dmigs: Dmigs,
        (k, m): (usize, usize),
        places: &GridPlaces<'_>,
    ) -> Diagnosed<Self> {
        let mut points: BTreeSet<Point> = dmigs.points(&[k, m]).into_iter().collect();
        // Rows that others follow must exist, even if they are zero.
        let followers = followers(bulk, |point| points.contains(point), places)?;
        points.extend(followers.iter().flat_map(|followed| followed.leaders()));
        // Rows that are rotated together must exist as well.
        let turned: Vec<Point> = points.iter().filter(|(id, _)| places.are_turned(*id)).copied().collect();
        for (id, component) in turned {
            let first = if component > 3 { 4 } else { 1 };
            points.extend((first..first + 3).map(|component| (id, component)));
        }
        let points: Vec<Point> = points.into_iter().collect();
        let mut matrix = |at| dmigs.take_matrix(at, &points).map_err(|diagnostic| vec![diagnostic]);
        let (stiffness, mass) = both(matrix(k), matrix(m))?;
        let files = dmigs.files;
        Self::new(bulk, Read { stiffness, mass, points, files }, places)
    }

    fn new(bulk: &Bulk, read: Read, places: &GridPlaces<'_>) -> Diagnosed<Self> {
        let Read { stiffness, mass, points, files } = read;
        let followers = followers(bulk, |point| points.binary_search(point).is_ok(), places)?;
        let in_file = |diagnostic: Diagnostic| vec![diagnostic.in_file(&stiffness.path)];
        let eliminated = followers.map(|all| Ok((all.eliminate(&points)?, all.some_names())));
        let followers = eliminated.transpose().map_err(in_file)?;
        let n_given = points.len();
        let labels = points.into_iter().map(label).collect();
        Ok(Self {
            stiffness,
            mass,
            labels,
            files,
            n_given,
            followers,
            carried: None,
            turn: None,
            retained: None,
        })
    }

    /// Returns the equations of the components that follow others, along the axes of the model, and those that are not
    /// described: a grid with axes of its own whose displacements, or rotations, do not all follow others. If the matrices
    /// of the files contain the constraints already, they are those of the deck.
    pub(super) fn equations(
        &self,
        bulk: &Bulk,
        places: &GridPlaces<'_>,
    ) -> (Vec<Equation>, Vec<NotDescribed>) {
        let has: HashSet<Point> = self.labels.iter().map(|label| (label.node, label.direction)).collect();
        let all = || Followers::new(&bulk.constraints.supported(), places).ok();
        let open = followers(bulk, |point| has.contains(point), places).ok().flatten();
        let Some(followers) = open.or_else(all) else { return Default::default() };
        // Each term along the axes of the model.
        let mut sums: BTreeMap<Point, BTreeMap<Point, f64>> = BTreeMap::new();
        for (point, terms) in followers.sums() {
            let sum = sums.entry(*point).or_default();
            for &(leader, factor) in terms {
                along_model(leader, places)
                    .for_each(|(term, part)| *sum.entry(term).or_default() += part * factor);
            }
        }
        let (mut equations, mut open) = (Vec::new(), BTreeSet::new());
        for &(grid, component) in sums.keys() {
            let first = if component > 3 { 4 } else { 1 };
            let own = [0, 1, 2].map(|k| sums.get(&(grid, first + k)));
            let mut terms: BTreeMap<Point, f64> = BTreeMap::new();
            if !places.are_turned(grid) || component == 0 {
                terms.clone_from(&sums[&(grid, component)]);
            } else if let [Some(x), Some(y), Some(z)] = own {
                // Component of the model: the sum of the displacements along the axes of the grid.
                for (k, sum) in (0u8..).zip([x, y, z]) {
                    let part = places.axis((grid, first + k))[usize::from(component - first)];
                    sum.iter().for_each(|(term, factor)| *terms.entry(*term).or_default() += part * factor);
                }
            } else {
                open.insert(grid);
                continue;
            }
            let terms = terms.into_iter().filter(|(_, factor)| *factor != 0.0).collect();
            equations.push(Equation { dependent: (grid, component), terms });
        }
        let what = "constraints of some components of grids with axes of their own (CD)".to_owned();
        let nodes: Vec<i64> = open.into_iter().collect();
        let not_described = (!nodes.is_empty()).then_some(NotDescribed { what, line: None, nodes });
        (equations, not_described.into_iter().collect())
    }

    /// Returns the matrices without the rows that follow others by constraints of the deck.
    pub(super) fn without_followers(self, diagnostics: &mut Vec<Diagnostic>) -> Self {
        let Some((elimination, names)) = &self.followers else { return self };
        let followers = self.n_given - elimination.points.len();
        let message = format!("{followers} rows depend on others and are eliminated: {names}");
        diagnostics.push(Diagnostic::new(Code::DeckConstrained, message).in_file(&self.stiffness.path));
        let all: Vec<u32> = (0..elimination.points.len() as u32).collect();
        let map = RowMap::new(elimination.follows.clone(), elimination.picks.clone(), all);
        let rows = GivenRows::new(vec![map], HashMap::new());
        let labels = elimination.points.iter().copied().map(label).collect();
        let points: Vec<Point> = self.labels.iter().map(|label| (label.node, label.direction)).collect();
        let carried = CarriedMass::new(&points, &self.mass.matrix, elimination);
        let [stiffness, mass] = [&self.stiffness, &self.mass].map(|raw| {
            let matrix = rows.matrix(raw.matrix.clone()).expect("all rows are kept");
            RawMatrix { matrix, digits: raw.digits, path: raw.path.clone() }
        });
        Self { stiffness, mass, labels, carried, ..self }
    }

    /// Returns the points with mass that follow several grids, for the rows as they are now. `axes` are the row axes
    /// of the grids.
    pub(super) fn carried(&self, nodes: &Nodes, axes: &HashMap<i64, Axes>) -> Option<RawFollowers> {
        let (elimination, _) = self.followers.as_ref()?;
        let n = elimination.points.len();
        let mut follows = match &self.turn {
            Some(turn) => product(turn, &elimination.follows),
            None => elimination.follows.clone(),
        };
        if let Some(retained) = &self.retained {
            follows = product(&columns_of_identity(n, retained).transpose(), &follows);
        }
        self.carried.as_ref()?.followers(&follows, nodes, axes)
    }

    /// Returns the matrices with all rows along the axes of the basic system.
    pub(super) fn turned(self, axes: &HashMap<i64, Axes>) -> Diagnosed<Self> {
        if !self.labels.iter().any(|label| axes.contains_key(&label.node)) {
            return Ok(self);
        }
        let turn = Turn::new(&self.labels, axes).map_err(|node| {
            let message = format!(
                "rows of grid {node} are along the axes of its CD, but not each of its directions occurs once"
            );
            vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(&self.stiffness.path)]
        })?;
        let turned = |raw: RawMatrix| turn.turned(raw).map_err(|diagnostic| vec![diagnostic]);
        let (stiffness, mass) = both(turned(self.stiffness), turned(self.mass))?;
        Ok(Self { stiffness, mass, turn: Some(turn.axes()), ..self })
    }

    /// Returns the matrices without rows that are empty in both: rotations of solids, and all rows of points to which
    /// nothing is attached.
    pub(super) fn without_empty_rows(self, diagnostics: &mut Vec<Diagnostic>) -> Self {
        let labels = &self.labels;
        let filled = filled_rows([&self.stiffness.matrix, &self.mass.matrix], labels.len());
        let rows = || labels.iter().zip(&filled);
        let moving: HashSet<i64> =
            rows().filter(|(_, filled)| **filled).map(|(label, _)| label.node).collect();
        // A displacement without stiffness and mass is an error if the node has other rows.
        let keeps = |(label, filled): (&DofLabel, &bool)| {
            *filled || label.direction <= 3 && moving.contains(&label.node)
        };
        let retained: Vec<usize> =
            (0..labels.len()).filter(|&row| keeps((&labels[row], &filled[row]))).collect();
        if retained.len() == labels.len() {
            return self;
        }
        let turning = rows().filter(|(label, filled)| !**filled && moving.contains(&label.node)).count();
        let left_out = labels.len() - retained.len();
        let message = format!(
            "{left_out} rows without stiffness and mass are left out: {turning} rotations, {} of points that nothing is fixed to",
            left_out - turning
        );
        diagnostics.push(Diagnostic::new(Code::RowsEmpty, message).in_file(&self.stiffness.path));
        let labels = retained.iter().map(|&row| labels[row]).collect();
        let [stiffness, mass] = [self.stiffness, self.mass].map(|raw| principal(raw, &retained));
        Self { stiffness, mass, labels, retained: Some(retained), ..self }
    }

    /// Returns FB111 for modal coordinates: rows of scalar points with mass. K and M do not contain their shapes, and
    /// thus not the change of the inertia with them.
    pub(super) fn refuse_modal(&self, bulk: &Bulk) -> Diagnosed<()> {
        let is_modal = |(row, label): (usize, &DofLabel)| {
            !bulk.grids.contains_key(&label.node)
                && bulk.scalars.contains(&label.node)
                && !self.mass.matrix.column(row).0.is_empty()
        };
        let modal = self.labels.iter().enumerate().filter(|row| is_modal(*row)).count();
        if modal == 0 {
            return Ok(());
        }
        let message = format!(
            "{modal} scalar points have mass: modal coordinates, whose shapes are not in the matrices"
        );
        let help = "give K and M of all grids, and the modes by --basis craig-bampton or --basis imported; or condense to grids alone (no QSET, SPOINT)";
        let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(&self.mass.path);
        Err(vec![diagnostic.with_help(help)])
    }

    /// Returns the number of grids with rows.
    pub(super) fn grids(&self, bulk: &Bulk) -> usize {
        let named = self.labels.iter().map(|label| label.node);
        named.filter(|node| bulk.grids.contains_key(node)).collect::<HashSet<i64>>().len()
    }

    /// Returns the maps from data by rows of the files, or by the remaining rows, to data by rows of K and M in this
    /// model. `axes` are the row axes of the grids.
    pub(super) fn given_rows(&self, axes: HashMap<i64, Axes>) -> GivenRows {
        let n = self.followers.as_ref().map_or(self.n_given, |(elimination, _)| elimination.points.len());
        let all = || (0..n).collect::<Vec<usize>>();
        let retained = self.retained.clone().unwrap_or_else(all);
        if self.followers.is_none() && self.turn.is_none() && retained.len() == n {
            return GivenRows::default();
        }
        let turn = self.turn.clone().unwrap_or_else(|| columns_of_identity(n, &all()));
        let rows = || retained.iter().map(|&row| row as u32).collect::<Vec<u32>>();
        // Maps for rows of the files, for rows without dependent ones, and for rows that are also not empty.
        let whole = match &self.followers {
            Some((elimination, _)) => {
                RowMap::new(product(&turn, &elimination.follows), product(&turn, &elimination.picks), rows())
            }
            None => RowMap::new(turn.clone(), turn.clone(), rows()),
        };
        let left = RowMap::new(turn.clone(), turn.clone(), rows());
        let turned = product(&turn, &columns_of_identity(n, &retained));
        let least = RowMap::new(turned.clone(), turned, rows());
        let mut maps = vec![whole];
        for map in [left, least] {
            if maps.iter().all(|known| known.n_given() != map.n_given()) {
                maps.push(map);
            }
        }
        GivenRows::new(maps, axes)
    }
}

/// Returns columns of the identity matrix with n rows.
fn columns_of_identity(n: usize, columns: &[usize]) -> CscMatrix {
    let entries: Vec<(u32, u32, f64)> =
        (0u32..).zip(columns).map(|(at, &row)| (row as u32, at, 1.0)).collect();
    CscMatrix::from_triplets(n, columns.len(), &entries)
}

/// Returns the product of two sparse matrices.
fn product(a: &CscMatrix, b: &CscMatrix) -> CscMatrix {
    let mut entries = Vec::with_capacity(a.nnz().max(b.nnz()));
    for column in 0..b.n_cols() {
        let (rows, values) = b.column(column);
        for (row, factor) in rows.iter().zip(values) {
            let (to, values_of_column) = a.column(*row as usize);
            entries.extend(
                to.iter().zip(values_of_column).map(|(to, value)| (*to, column as u32, value * factor)),
            );
        }
    }
    CscMatrix::from_triplets(a.n_rows(), b.n_cols(), &entries)
}

/// Returns the matrix files in the folder of a deck: punch files, and files of OUTPUT4. A file with the name of the
/// deck takes precedence over files whose names continue it.
fn files_beside(bulk: &Bulk, job: &JobFile) -> Diagnosed<(Vec<PathBuf>, Vec<PathBuf>)> {
    let path = &job.path;
    let with = |extension: &str| {
        let beside = siblings(path).filter(|(rest, file)| rest.ends_with(extension) && file != path);
        let mut files: Vec<(String, PathBuf)> = beside.collect();
        files.sort();
        if files.iter().any(|(rest, _)| rest == extension) {
            files.retain(|(rest, _)| rest == extension);
        }
        files.into_iter().map(|(_, file)| file).collect::<Vec<PathBuf>>()
    };
    let (punches, mut outputs) = (with(".pch"), with(".op4"));
    let assigned = bulk.assigned.outputs(path);
    let (there, absent): (Vec<PathBuf>, Vec<PathBuf>) = assigned.into_iter().partition(|file| file.is_file());
    outputs.extend(there.into_iter().filter(|file| !outputs.contains(file)).collect::<Vec<_>>());
    if punches.is_empty() && outputs.is_empty() {
        return Err(no_files(path, &absent));
    }
    Ok((punches, outputs))
}

/// Returns the dependent points by constraints that the matrices do not contain yet; `has` returns true for points with
/// rows.
fn followers(
    bulk: &Bulk,
    has: impl Fn(&Point) -> bool,
    places: &GridPlaces<'_>,
) -> Diagnosed<Option<Followers>> {
    let one = |diagnostic| vec![diagnostic];
    let open = bulk.constraints.open(has).map_err(one)?;
    if open.is_empty() {
        return Ok(None);
    }
    Followers::new(&open, places).map(Some).map_err(one)
}

/// Returns the components along the axes of the model, with their factors, of a component along those of its grid.
fn along_model((grid, component): Point, places: &GridPlaces<'_>) -> impl Iterator<Item = (Point, f64)> {
    let is_turned = places.are_turned(grid) && component > 0;
    let first = if component > 3 { 4 } else { 1 };
    let axis = places.axis((grid, component));
    let all =
        (0u8..3).map(move |k| ((grid, first + k), axis[usize::from(k)])).filter(|(_, part)| *part != 0.0);
    let own = std::iter::once(((grid, component), 1.0));
    all.filter(move |_| is_turned).chain(own.filter(move |_| !is_turned))
}

/// Returns the rows `retained` (ascending) and the same columns of a matrix that has no entries elsewhere.
fn principal(raw: RawMatrix, retained: &[usize]) -> RawMatrix {
    let mut local = vec![u32::MAX; raw.matrix.n_rows()];
    retained.iter().enumerate().for_each(|(to, &row)| local[row] = to as u32);
    let mut col_ptr = vec![0];
    let (mut row_idx, mut values) = (Vec::new(), Vec::new());
    for &column in retained {
        let (rows, values_of_column) = raw.matrix.column(column);
        row_idx.extend(rows.iter().map(|&row| local[row as usize]));
        values.extend_from_slice(values_of_column);
        col_ptr.push(row_idx.len());
    }
    let matrix = CscMatrix::from_parts(retained.len(), retained.len(), col_ptr, row_idx, values);
    RawMatrix { matrix, ..raw }
}

// Matrices of OUTPUT4 in the folder of a deck, and the choice of K and M among several matrices.

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
struct Outputs {
    files: Vec<(InputFile, output4::Contents)>,
    pub names: Vec<String>,
    /// Index of the file of each name, and index of the matrix in the file.
    places: Vec<(usize, usize)>,
}

impl Outputs {
    pub(super) fn of(paths: Vec<PathBuf>) -> Diagnosed<Self> {
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
    fn fitting(&self, bulk: &Bulk) -> Vec<usize> {
        let fits = |name: &usize| {
            let (file, at) = self.places[*name];
            let rows = self.files[file].1.square(at);
            rows.is_some_and(|rows| is_set_of_rows(bulk, rows))
        };
        let fitting: Vec<usize> = (0..self.names.len()).filter(fits).collect();
        if fitting.is_empty() { (0..self.names.len()).collect() } else { fitting }
    }

    pub(super) fn matrices(&self, bulk: &Bulk, (k, m): (usize, usize)) -> Diagnosed<Read> {
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
        let points = points_of_rows(bulk, rows, &self.names[k], &stiffness.path);
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
fn choose_pair(
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
fn no_pair(
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
fn no_files(path: &Path, absent: &[PathBuf]) -> Vec<Diagnostic> {
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

// The labels of matrix rows without names: rows of OUTPUT4 follow the points in ascending order, six per grid and one
// per scalar point, without the points outside the set of the matrix.

/// Returns true when matrices of `n` rows may be those of a set of the deck.
fn is_set_of_rows(bulk: &Bulk, n: usize) -> bool {
    bulk.resequenced || points_of_rows(bulk, n, "", Path::new("")).is_ok()
}

/// Returns the points of the rows of matrices with `n` rows. The first set with this number of rows is chosen among:
/// the g-set, the a-set of the deck, the g-set without dependent points, this one without supported points, and, if all
/// elements are solids, the g-set with displacements and independent points of constraints only.
///
/// # Errors
/// FB112 if no set has this number.
fn points_of_rows(bulk: &Bulk, n: usize, name: &str, path: &Path) -> Result<Vec<Point>, Diagnostic> {
    if bulk.resequenced {
        let message = "SEQGP changes the order of the rows, which OUTPUT4 does not record";
        let help = "remove the SEQGP cards, or write the matrices as DMIG";
        return Err(Diagnostic::new(Code::DeckUnsupported, message).in_file(path).with_help(help));
    }
    // The g-set.
    let all = || {
        let grids = bulk.grids.keys().flat_map(|&id| (1..=6).map(move |component| (id, component)));
        grids.chain(bulk.scalars.iter().map(|&id| (id, 0))).collect::<BTreeSet<Point>>()
    };
    let (grids, scalars) = (bulk.grids.len(), bulk.scalars.len());
    let mut counted = vec![(format!("{grids} grids and {scalars} scalar points"), 6 * grids + scalars)];
    if n == counted[0].1 {
        return Ok(all().into_iter().collect());
    }
    // The a-set.
    let boundary = bulk.boundary();
    if !boundary.is_empty() {
        counted.push(("the a-set".to_owned(), boundary.len()));
        if boundary.len() == n {
            return Ok(boundary.into_iter().collect());
        }
    }
    // The g-set without dependent points.
    let (followers, followed) = bulk.constraints.points();
    let left: BTreeSet<Point> = all().difference(&followers).copied().collect();
    if !followers.is_empty() {
        counted.push(("without rows dependent by constraints".to_owned(), left.len()));
        if left.len() == n {
            return Ok(left.into_iter().collect());
        }
    }
    // The g-set without dependent and supported points.
    let supported = bulk.supported();
    if !supported.is_empty() {
        let free: Vec<Point> = left.difference(&supported).copied().collect();
        counted.push(("without supports".to_owned(), free.len()));
        if free.len() == n {
            return Ok(free);
        }
    }
    // Displacements and independent points of constraints.
    if bulk.has_elements && !bulk.has_rotations {
        let moves = |point: &Point| point.1 <= 3 || followed.contains(point);
        let displacements: Vec<Point> = left.into_iter().filter(moves).collect();
        counted.push(("displacements only".to_owned(), displacements.len()));
        if displacements.len() == n {
            return Ok(displacements);
        }
    }
    let counted_rows: Vec<usize> = counted.iter().map(|(_, rows)| *rows).collect();
    let counted: Vec<String> = counted.into_iter().map(|(what, rows)| format!("{what} {rows}")).collect();
    let message = format!("matrix {name} has {n} rows, the deck gives other numbers: {}", counted.join(", "));
    let is_reduced = counted_rows.iter().any(|count| n < *count) && !name.contains("GG");
    let help = if is_reduced {
        "write KGG and MGG, or the matrices of the a-set that ASET cards of the deck name; if AUTOSPC has removed rows without stiffness (rotations of solids, normals of shells), write PARAM,AUTOSPC,NO"
    } else {
        "write KGG and MGG, or the matrices of the a-set that ASET cards of the deck name"
    };
    Err(Diagnostic::new(Code::DeckRows, message).in_file(path).with_help(help))
}
