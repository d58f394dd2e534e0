//! Maps from the rows of files to the rows of the model if they differ: turned from the axes of nodes to
//! those of the model, without dependent rows, without empty rows, with dependent rows of nodes that have other rows.

use crate::DofLabel;
use faer::Mat;
use flexbody_linalg::CscMatrix;
use std::collections::{BTreeMap, HashMap};

/// Unit vectors along the rows of a node, in the axes of the model.
pub type NodeAxes = [[f64; 3]; 3];

/// Largest allowed entry in rows that the model does not have, relative to the largest entry of the matrix.
const MAX_FOREIGN_ENTRY: f64 = 1e-12;

/// Maps from data given by rows, or along the axes of nodes, to the rows of the model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GivenRows {
    maps: Vec<RowMap>,
    axes: HashMap<i64, NodeAxes>,
    dependent: Vec<DependentRow>,
}

/// Row without mass that a constraint of the FE program makes the sum of others: `terms` are rows of K and M as read,
/// with their factors. K holds it there by a spring, which no motion of the model strains.
#[derive(Debug, Clone, PartialEq)]
pub struct DependentRow {
    /// Node and direction of the row.
    pub label: DofLabel,
    /// Rows that it follows, and their factors.
    pub terms: Vec<(u32, f64)>,
    /// Labels of these rows.
    pub leaders: Vec<DofLabel>,
}

/// Map from the rows of a file to those of the model: x_file = T x.
#[derive(Debug, Clone, PartialEq)]
pub struct RowMap {
    /// T' (all rows, including empty ones, by rows of the file).
    follows: CscMatrix,
    /// P, of the shape of `follows`, with P T = I: selects the motion of the model from that of the file.
    picks: CscMatrix,
    /// Rows in the model, ascending.
    kept: Vec<u32>,
}

impl RowMap {
    /// Creates a map of rows of a file. Column i of `follows` is the combination of rows that row i of the
    /// file moves with, column i of `picks` defines the rows that take the motion of row i of the file, and
    /// `kept` are the rows in the model, ascending.
    ///
    /// # Panics
    /// If the shapes of `follows` and `picks` differ.
    pub fn new(follows: CscMatrix, picks: CscMatrix, kept: Vec<u32>) -> Self {
        let shape = |matrix: &CscMatrix| (matrix.n_rows(), matrix.n_cols());
        assert_eq!(shape(&follows), shape(&picks), "shapes of a map of rows");
        Self { follows, picks, kept }
    }

    /// Returns the map of files without any of the dependent rows: all `n` rows of the model in their order.
    fn identity(n: usize) -> Self {
        let entries: Vec<(u32, u32, f64)> = (0..n as u32).map(|row| (row, row, 1.0)).collect();
        let all = CscMatrix::from_triplets(n, n, &entries);
        Self::new(all.clone(), all, (0..n as u32).collect())
    }

    /// Returns the map to a model that has `dependent` rows after all others. Matrices and forces of the file have no
    /// part in them; their motion is the sum of the motions that they follow.
    fn with_dependent(&self, dependent: &[DependentRow]) -> Self {
        let (all, n_given) = (self.follows.n_rows(), self.follows.n_cols());
        let mut followers: HashMap<u32, Vec<(u32, f64)>> = HashMap::new();
        for (row, dependent) in (all as u32..).zip(dependent) {
            for &(term, factor) in &dependent.terms {
                followers.entry(self.kept[term as usize]).or_default().push((row, factor));
            }
        }
        let extended = |matrix: &CscMatrix, with_sums: bool| {
            let mut entries = Vec::with_capacity(matrix.nnz());
            for (row, given, value) in matrix.triplets() {
                entries.push((row, given, value));
                let sums = followers.get(&row).filter(|_| with_sums).into_iter().flatten();
                entries.extend(sums.map(|&(to, factor)| (to, given, factor * value)));
            }
            CscMatrix::from_triplets(all + dependent.len(), n_given, &entries)
        };
        let added = all as u32..(all + dependent.len()) as u32;
        let kept = self.kept.iter().copied().chain(added).collect();
        Self::new(extended(&self.follows, false), extended(&self.picks, true), kept)
    }

    /// Returns the number of rows of the file.
    pub fn n_given(&self) -> usize {
        self.follows.n_cols()
    }

    /// Maps a matrix A to T' A T.
    ///
    /// # Errors
    /// [`LostRow`] if A has entries in rows that the model does not have.
    fn matrix(&self, matrix: &CscMatrix) -> Result<CscMatrix, LostRow> {
        let mut entries = Vec::with_capacity(matrix.nnz());
        let mut largest = 0.0f64;
        for column in 0..matrix.n_cols() {
            let (rows, values) = matrix.column(column);
            for (&row, &value) in rows.iter().zip(values) {
                largest = largest.max(value.abs());
                for (p, a) in self.followed(row as usize) {
                    entries.extend(self.followed(column).map(|(q, b)| (p, q, a * value * b)));
                }
            }
        }
        let n = self.follows.n_rows();
        let all = CscMatrix::from_triplets(n, n, &entries);
        let lost = (0..n).find(|&column| {
            let (rows, values) = all.column(column);
            let target = self.place(column as u32);
            let is_lost = |row: u32, value: f64| {
                (target.is_none() || self.place(row).is_none()) && value.abs() > MAX_FOREIGN_ENTRY * largest
            };
            rows.iter().zip(values).any(|(row, value)| is_lost(*row, *value))
        });
        if lost.is_some() {
            return Err(LostRow);
        }
        let kept = |(row, column): (u32, u32), value| Some((self.place(row)?, self.place(column)?, value));
        let entries: Vec<(u32, u32, f64)> = (0..n as u32)
            .flat_map(|column| {
                let (rows, values) = all.column(column as usize);
                rows.iter().zip(values).filter_map(move |(row, value)| kept((*row, column), *value))
            })
            .collect();
        Ok(CscMatrix::from_triplets(self.kept.len(), self.kept.len(), &entries))
    }

    fn followed(&self, given: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let (rows, values) = self.follows.column(given);
        rows.iter().copied().zip(values.iter().copied())
    }

    /// Returns the row of the model for a row, if the model has it.
    fn place(&self, row: u32) -> Option<u32> {
        self.kept.binary_search(&row).ok().map(|place| place as u32)
    }

    /// Multiplies `by` with columns; returns the rows in the model, and the largest absolute value of the
    /// others.
    fn columns(&self, by: &CscMatrix, columns: &Mat<f64>) -> (Mat<f64>, f64) {
        let mut all: Mat<f64> = Mat::zeros(by.n_rows(), columns.ncols());
        for given in 0..by.n_cols() {
            let (rows, values) = by.column(given);
            for (row, value) in rows.iter().zip(values) {
                for j in 0..columns.ncols() {
                    all[(*row as usize, j)] += value * columns[(given, j)];
                }
            }
        }
        let kept = Mat::from_fn(self.kept.len(), all.ncols(), |i, j| all[(self.kept[i] as usize, j)]);
        let others = (0..by.n_rows() as u32).filter(|row| self.place(*row).is_none());
        let size = |row: u32| (0..all.ncols()).map(|j| all[(row as usize, j)].abs()).fold(0.0, f64::max);
        (kept, others.map(size).fold(0.0, f64::max))
    }
}

/// Error: a matrix or a load has entries in rows that the model does not have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LostRow;

impl GivenRows {
    /// Creates the maps for files with different numbers of rows, and the unit vectors along the rows of
    /// nodes whose results are along axes of their own. If two maps have one number of rows, the first
    /// counts.
    pub fn new(maps: Vec<RowMap>, axes: HashMap<i64, NodeAxes>) -> Self {
        Self { maps, axes, dependent: Vec::new() }
    }

    /// Returns the maps to a model that has `dependent` rows after its other `n` rows.
    pub fn with_dependent(mut self, n: usize, dependent: Vec<DependentRow>) -> Self {
        if self.map(n).is_none() {
            self.maps.push(RowMap::identity(n));
        }
        self.maps = self.maps.iter().map(|map| map.with_dependent(&dependent)).collect();
        self.dependent = dependent;
        self
    }

    /// Returns the rows of the model that follow others by constraints.
    pub fn dependent(&self) -> &[DependentRow] {
        &self.dependent
    }

    /// Returns the numbers of rows, besides that of the model, that files may have.
    pub fn counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.maps.iter().map(RowMap::n_given)
    }

    fn map(&self, n_given: usize) -> Option<&RowMap> {
        self.maps.iter().find(|map| map.n_given() == n_given)
    }

    /// Maps a symmetric matrix A to T' A T. A matrix with another number of rows does not change.
    ///
    /// # Errors
    /// [`LostRow`] if entries belong to rows that the model does not have.
    pub fn matrix(&self, matrix: CscMatrix) -> Result<CscMatrix, LostRow> {
        match self.map(matrix.n_cols()) {
            Some(map) if matrix.n_rows() == matrix.n_cols() => map.matrix(&matrix),
            _ => Ok(matrix),
        }
    }

    /// Maps displacements, one column each. Columns with another number of rows do not change.
    pub fn motions(&self, columns: Mat<f64>) -> Mat<f64> {
        match self.map(columns.nrows()) {
            Some(map) => map.columns(&map.picks, &columns).0,
            None => columns,
        }
    }

    /// Maps forces f to T' f, one column each. Columns with another number of rows do not change.
    ///
    /// # Errors
    /// [`LostRow`] if forces act on rows that the model does not have.
    pub fn forces(&self, columns: Mat<f64>) -> Result<Mat<f64>, LostRow> {
        let Some(map) = self.map(columns.nrows()) else { return Ok(columns) };
        let (forces, lost) = map.columns(&map.follows, &columns);
        if lost > MAX_FOREIGN_ENTRY * columns.norm_max() { Err(LostRow) } else { Ok(forces) }
    }

    /// Maps forces f to T' f as [`GivenRows::forces`] does, for sparse columns.
    ///
    /// # Errors
    /// [`LostRow`] if forces act on rows that the model does not have.
    pub fn sparse_forces(&self, columns: CscMatrix) -> Result<CscMatrix, LostRow> {
        let Some(map) = self.map(columns.n_rows()) else { return Ok(columns) };
        let largest = columns.values().iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let mut entries = Vec::with_capacity(columns.nnz());
        for j in 0..columns.n_cols() {
            let (rows, values) = columns.column(j);
            for (&row, &value) in rows.iter().zip(values) {
                for (followed, weight) in map.followed(row as usize) {
                    entries.push((followed, j as u32, weight * value));
                }
            }
        }
        let all = CscMatrix::from_triplets(map.follows.n_rows(), columns.n_cols(), &entries);
        entries.clear();
        for j in 0..all.n_cols() {
            let (rows, values) = all.column(j);
            for (&row, &value) in rows.iter().zip(values) {
                match map.place(row) {
                    Some(place) => entries.push((place, j as u32, value)),
                    None if value.abs() > MAX_FOREIGN_ENTRY * largest => return Err(LostRow),
                    None => {}
                }
            }
        }
        Ok(CscMatrix::from_triplets(map.kept.len(), all.n_cols(), &entries))
    }

    /// Turns displacements given along the axes of the nodes to the axes of the model: rows by `labels`,
    /// one column each.
    ///
    /// # Errors
    /// The number of a node with some but not all three of its displacements, or of its rotations.
    pub fn turn(&self, labels: &[DofLabel], columns: &mut Mat<f64>) -> Result<(), i64> {
        let mut vectors: BTreeMap<(i64, bool), [Option<usize>; 3]> = BTreeMap::new();
        for (row, label) in
            labels.iter().enumerate().filter(|(_, label_of_row)| self.axes.contains_key(&label_of_row.node))
        {
            let vector = vectors.entry((label.node, label.direction > 3)).or_default();
            vector[usize::from(label.direction - 1) % 3] = Some(row);
        }
        for ((node, _), rows) in vectors {
            let [Some(x), Some(y), Some(z)] = rows else { return Err(node) };
            let (axes, rows) = (self.axes[&node], [x, y, z]);
            for j in 0..columns.ncols() {
                let local = rows.map(|row| columns[(row, j)]);
                for (k, row) in rows.into_iter().enumerate() {
                    columns[(row, j)] = (0..3).map(|axis| axes[axis][k] * local[axis]).sum();
                }
            }
        }
        Ok(())
    }

    /// Returns only the axes of nodes, for a part of the model: no file has the rows of a part.
    pub(crate) fn of_body(&self) -> Self {
        Self { axes: self.axes.clone(), ..Self::default() }
    }
}
