//! Points with mass that follow several grids by constraints which the reader eliminates: their mass before the
//! constraint, by which the model knows with what it turns.

use super::elimination::Elimination;
use crate::matrices::dmig::Point;
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, GivenRows, NodeAxes as Axes, Nodes, RawFollowers, RowMap};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Mass before the elimination of dependent rows, and the grids that carry it.
pub(super) struct CarriedMass {
    /// Mass by the rows of the file.
    mass: CscMatrix,
    /// Rows of the file of every grid: three displacements, then three rotations or none.
    grids: BTreeMap<i64, Vec<u32>>,
    /// Number of other grids with dependent rows that carry mass and follow several grids.
    others: usize,
}

impl CarriedMass {
    /// Finds the dependent grids with mass that follow several grids, with all their displacements and with
    /// all rotations that carry mass; `None` if there are none.
    ///
    /// * `points`: points of the rows of the file, ascending;
    /// * `mass`: mass by the rows of the file.
    pub(super) fn new(points: &[Point], mass: &CscMatrix, elimination: &Elimination) -> Option<Self> {
        let (mut grids, mut others) = (BTreeMap::new(), 0);
        let rows: Vec<usize> = (0..points.len()).collect();
        for of_grid in rows.chunk_by(|a, b| points[*a].0 == points[*b].0) {
            let follows = |row: &&usize| elimination.points.binary_search(&points[**row]).is_err();
            let has_mass = |row: &usize| !mass.column(*row).0.is_empty();
            let dependent: Vec<usize> = of_grid.iter().filter(follows).copied().collect();
            let leaders = dependent.iter().flat_map(|row| elimination.follows.column(*row).0);
            let leaders: BTreeSet<i64> = leaders.map(|at| elimination.points[*at as usize].0).collect();
            if leaders.len() < 2 || !dependent.iter().any(has_mass) {
                continue;
            }
            let of = |first: u8| -> Vec<usize> {
                let is_one = |row: &usize| (first..first + 3).contains(&points[*row].1);
                dependent.iter().copied().filter(is_one).collect()
            };
            let (displacements, mut rotations) = (of(1), of(4));
            if rotations.len() < 3 {
                rotations.clear();
            }
            let is_whole =
                |row: &usize| displacements.contains(row) || rotations.contains(row) || !has_mass(row);
            if displacements.len() == 3 && of_grid.iter().all(is_whole) {
                let rows = displacements.iter().chain(&rotations).map(|row| *row as u32);
                grids.insert(points[of_grid[0]].0, rows.collect::<Vec<u32>>());
            } else {
                others += 1;
            }
        }
        (!grids.is_empty()).then(|| Self { mass: mass.clone(), grids, others })
    }

    /// Returns the points for rows of the model, along the axes of the model.
    ///
    /// * `follows`: column i is the sum of rows of the model that row i of the file is;
    /// * `axes`: axes of the rows of grids, if they are not those of the model.
    pub(super) fn followers(
        &self,
        follows: &CscMatrix,
        nodes: &Nodes,
        axes: &HashMap<i64, Axes>,
    ) -> Option<RawFollowers> {
        let n = follows.n_rows();
        let mut points = Nodes::default();
        let (mut labels, mut sums) = (Vec::new(), Vec::new());
        // Columns of rows of the file that are rows of points, in rows of the model and then of the points.
        let mut carried: HashMap<u32, Vec<(u32, f64)>> = HashMap::new();
        for (&grid, rows) in &self.grids {
            points.ids.push(grid);
            points.positions.push(nodes.positions[nodes.ids.iter().position(|id| *id == grid)?]);
            let unit = |k: usize| std::array::from_fn(|l| f64::from(k == l));
            let along: Axes = axes.get(&grid).copied().unwrap_or_else(|| std::array::from_fn(unit));
            for triple in rows.chunks(3) {
                let first = labels.len() as u32;
                for direction in 0..3 {
                    let component = if triple[0] == rows[0] { 1 } else { 4 };
                    labels.push(DofLabel { node: grid, direction: component + direction as u8 });
                    for (row, axis) in triple.iter().zip(&along) {
                        let (leaders, weights) = follows.column(*row as usize);
                        let sum = leaders.iter().zip(weights);
                        sums.extend(
                            sum.map(|(to, weight)| {
                                (*to, first + direction, weight * axis[direction as usize])
                            }),
                        );
                        carried
                            .entry(*row)
                            .or_default()
                            .push((n as u32 + first + direction, axis[direction as usize]));
                    }
                }
            }
        }
        let all = n + labels.len();
        let mut entries = Vec::new();
        for row in 0..follows.n_cols() as u32 {
            match carried.get(&row) {
                Some(own) => entries.extend(own.iter().map(|&(to, weight)| (to, row, weight))),
                None => {
                    let (leaders, weights) = follows.column(row as usize);
                    entries.extend(leaders.iter().zip(weights).map(|(to, weight)| (*to, row, *weight)));
                }
            }
        }
        let extended = CscMatrix::from_triplets(all, follows.n_cols(), &entries);
        let map = RowMap::new(extended.clone(), extended, (0..all as u32).collect());
        let mass = GivenRows::new(vec![map], HashMap::new()).matrix(self.mass.clone()).ok()?;
        let follows = CscMatrix::from_triplets(n, labels.len(), &sums);
        Some(RawFollowers { points, labels, follows, mass, others: self.others })
    }
}
