//! Knots of CalculiX: nodes where expanded shells meet at an angle, or with different thicknesses or offsets.
//!
//! The solids into which CalculiX expands the shells have nodes of their own on both sides of such a node. With the
//! vector p from the node of the deck to one of them it moves by u + theta x p + e p: CalculiX gives the node of the
//! deck the displacement u, the next new number the rotation theta (as directions 1 to 3), and the number after that the
//! stretch e (as direction 1). Both numbers are above those of the deck, and knots are made in the order of their nodes.
//!
//! The stretch stays zero in rigid motion. Its natural frequencies are those of waves through the thickness of the
//! shell, so it follows the other rows statically, e = -K_ee^-1 K_eo u_o. This changes no static deflection, and
//! frequencies by a part of the order of the square of their ratio to these waves (1e-10 for sheets).

use super::deck_mesh::DeckMesh;
use super::expanded::solved;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use flexbody_model::{DofLabel, GivenRows, RawMatrix, RowMap};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Part of the largest entry of a column below which an entry of the static response of the stretches is zero. The
/// response decays along a fold by a constant factor for each node; a larger value leaves rigid motion with strain.
const NEGLIGIBLE: f64 = 1e-16;

/// Mass over stiffness of a stretch, relative to the largest of any row, that counts as rounding. Stretches of solids with
/// mass have 1e-2 or so.
const ROUNDING_MASS: f64 = 1e-12;

/// Number of columns that are solved together.
const COLUMNS: usize = 256;

/// Knots of a deck.
#[derive(Debug, Default)]
pub(super) struct Knots {
    /// Node of the deck of each rotation node.
    nodes: BTreeMap<i64, i64>,
    /// Rows of the stretches, ascending.
    stretches: Vec<u32>,
}

impl Knots {
    /// Finds the knots by the labels of the rows. `rotations` are the rotation nodes of constraints.
    ///
    /// # Errors
    /// FB111 if the nodes of the deck that are knots cannot be identified.
    pub(super) fn of(
        mesh: &DeckMesh,
        labels: &[DofLabel],
        rotations: &HashMap<i64, i64>,
        path: &Path,
    ) -> Diagnosed<Self> {
        let mut directions: BTreeMap<i64, Vec<u8>> = BTreeMap::new();
        labels.iter().for_each(|label| directions.entry(label.node).or_default().push(label.direction));
        let made = |node: &i64| !mesh.nodes.contains_key(node) && !rotations.contains_key(node);
        // A stretch has a single row; the number before it has the rotation.
        let turning: Vec<i64> = directions
            .iter()
            .filter(|(node, own)| made(node) && own.as_slice() == [1])
            .map(|(node, _)| node - 1)
            .collect();
        if turning.is_empty() {
            return Ok(Self::default());
        }
        // Expanded nodes of shells have several rows of one direction, knots one.
        let of_shells: HashSet<i64> = mesh
            .elements
            .iter()
            .filter(|elements| elements.kind.starts_with('S'))
            .flat_map(|elements| elements.members.iter())
            .flat_map(|(_, nodes)| nodes.iter().copied())
            .collect();
        let is_point = |own: &Vec<u8>| own.as_slice() == [1, 2, 3];
        let candidates: Vec<i64> = directions
            .iter()
            .filter(|(node, own)| of_shells.contains(node) && is_point(own))
            .map(|(node, _)| *node)
            .collect();
        // Between shells with one normal the rotation about it is held.
        let turns = |node: &i64| {
            let own = directions.get(node);
            made(node)
                && own.is_some_and(|own| own.len() >= 2 && own.windows(2).all(|pair| pair[0] < pair[1]))
        };
        if candidates.len() != turning.len() || !turning.iter().all(turns) {
            let message = format!(
                "rows of {} nodes outside the deck are stretches of knots of shells, but {} nodes of the deck may be knots: the rows cannot be identified",
                turning.len(),
                candidates.len()
            );
            let help = "remove loads and supports of rotations at the nodes of shells, and shells that share nodes with beams or solids; or use solid elements";
            return Err(vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(path).with_help(help)]);
        }
        let stretched: HashSet<i64> = turning.iter().map(|node| node + 1).collect();
        let rows = labels.iter().zip(0..);
        let stretches = rows.filter(|(label, _)| stretched.contains(&label.node)).map(|(_, row)| row);
        Ok(Self { stretches: stretches.collect(), nodes: turning.into_iter().zip(candidates).collect() })
    }

    /// Returns true if there are none.
    pub(super) fn are_absent(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Returns the labels without the stretches; rotations have the directions 4 to 6 of their knots.
    pub(super) fn labels(&self, labels: Vec<DofLabel>) -> Vec<DofLabel> {
        let stretch: HashSet<u32> = self.stretches.iter().copied().collect();
        let kept = labels.into_iter().zip(0..).filter(|(_, row)| !stretch.contains(row));
        let turned = |(label, _): (DofLabel, u32)| match self.nodes.get(&label.node) {
            Some(knot) => DofLabel { node: *knot, direction: label.direction + 3 },
            None => label,
        };
        kept.map(turned).collect()
    }

    /// Returns K, M and the map of other data without the rows of the stretches, which follow the others statically.
    ///
    /// # Errors
    /// FB111 if K does not hold the stretches.
    pub(super) fn condensed(
        &self,
        [stiffness, mass]: [RawMatrix; 2],
        path: &Path,
    ) -> Diagnosed<([RawMatrix; 2], GivenRows)> {
        let refuse = || {
            let message = "the stiffness of the stretches of knots of shells is not positive";
            let help = "run CalculiX again: the matrices may belong to another deck";
            vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(path).with_help(help)]
        };
        let map = self.map(&stiffness.matrix).ok_or_else(refuse)?;
        let mass = self.without_rounding(mass, &stiffness.matrix);
        let rows = GivenRows::new(vec![map], HashMap::new());
        let without = |raw: RawMatrix| {
            let RawMatrix { matrix, digits, path } = raw;
            rows.matrix(matrix).map(|matrix| RawMatrix { matrix, digits, path }).map_err(|_| refuse())
        };
        let matrices = [without(stiffness)?, without(mass)?];
        Ok((matrices, rows))
    }

    /// Returns M without the rows of stretches whose mass is rounding: solids with one integration point across have none.
    /// The mass that condensation would add to rotations without mass may be negative.
    fn without_rounding(&self, mass: RawMatrix, stiffness: &CscMatrix) -> RawMatrix {
        let n = mass.matrix.n_cols();
        let ratio = |row: usize| {
            let stiffness = stiffness.get(row, row);
            if stiffness > 0.0 { mass.matrix.get(row, row).abs() / stiffness } else { 0.0 }
        };
        let largest = (0..n).map(ratio).fold(0.0, f64::max);
        let is_rounding = |row: &&u32| ratio(**row as usize) <= ROUNDING_MASS * largest;
        let empty: HashSet<u32> = self.stretches.iter().filter(is_rounding).copied().collect();
        if empty.is_empty() {
            return mass;
        }
        let mut entries = Vec::with_capacity(mass.matrix.nnz());
        for column in 0..n as u32 {
            let (rows, values) = mass.matrix.column(column as usize);
            let kept =
                rows.iter().zip(values).filter(|(row, _)| !empty.contains(row) && !empty.contains(&column));
            entries.extend(kept.map(|(&row, &value)| (row, column, value)));
        }
        RawMatrix { matrix: CscMatrix::from_triplets(n, n, &entries), ..mass }
    }

    /// Returns the map x_file = T x, in which the stretches respond statically to the other rows.
    fn map(&self, stiffness: &CscMatrix) -> Option<RowMap> {
        let n = stiffness.n_cols();
        let index: HashMap<u32, u32> = self.stretches.iter().copied().zip(0..).collect();
        let count = self.stretches.len();
        // K_ee, and the entries of K_eo by columns.
        let mut own = Vec::new();
        let mut columns: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
        for (&stretch, at) in self.stretches.iter().zip(0..) {
            let (rows, values) = stiffness.column(stretch as usize);
            for (&row, &value) in rows.iter().zip(values) {
                match index.get(&row) {
                    Some(&other) => own.push((other, at, value)),
                    None => columns.entry(row).or_default().push((at, value)),
                }
            }
        }
        let own = SymmetricMatrix::symmetrised(CscMatrix::from_triplets(count, count, &own));
        let is_kept = |row: &u32| !index.contains_key(row);
        let kept: Vec<u32> = (0..n as u32).filter(is_kept).collect();
        let units: Vec<(u32, u32, f64)> = kept.iter().map(|&row| (row, row, 1.0)).collect();
        let mut follows = units.clone();
        let columns: Vec<(u32, Vec<(u32, f64)>)> = columns.into_iter().collect();
        for some in columns.chunks(COLUMNS) {
            let mut load = Mat::zeros(count, some.len());
            for (j, (_, entries)) in some.iter().enumerate() {
                entries.iter().for_each(|&(i, value)| load[(i as usize, j)] = -value);
            }
            let response = solved(&own, &load)?;
            for (j, (row, _)) in some.iter().enumerate() {
                let least = NEGLIGIBLE * (0..count).map(|i| response[(i, j)].abs()).fold(0.0, f64::max);
                let filled = (0..count).filter(|&i| response[(i, j)].abs() > least);
                follows.extend(filled.map(|i| (*row, self.stretches[i], response[(i, j)])));
            }
        }
        let picks = CscMatrix::from_triplets(n, n, &units);
        Some(RowMap::new(CscMatrix::from_triplets(n, n, &follows), picks, kept))
    }
}
