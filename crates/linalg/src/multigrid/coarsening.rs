//! Construction of the next coarser level: smoothed motions P of the groups, and P'AP.

use super::blocks::{BlockMatrix, Entries};
use crate::parallel;
use crate::ties::first_largest;

/// Number of nodes per parallel task.
const NODES_PER_TASK: usize = 256;
/// Number of groups per parallel task.
const GROUPS_PER_TASK: usize = 16;

/// Length of a motion of a group after orthogonalisation, relative to its full length, up to which it counts as
/// dependent.
const DEPENDENT_MOTION_LENGTH: f64 = 1e-5;

/// Size of a pivot of a node's diagonal block, relative to its diagonal entry, up to which it counts as zero.
const ZERO_PIVOT_RATIO: f64 = 1e-10;

/// Block in double precision.
pub(super) type Block<const R: usize, const C: usize> = [[f64; C]; R];

/// Symmetric matrix from which a level is built, block row by block row.
pub(super) trait SymmetricBlocks<const B: usize>: Sync {
    fn nodes(&self) -> usize;

    /// Calls `take` with column and block of every entry of a row, ascending.
    fn visit(&self, row: usize, take: impl FnMut(usize, &Block<B, B>));
}

impl<const B: usize> SymmetricBlocks<B> for BlockMatrix<B, B> {
    fn nodes(&self) -> usize {
        self.n_rows()
    }

    fn visit(&self, row: usize, mut take: impl FnMut(usize, &Block<B, B>)) {
        self.row(row).for_each(|(column, block)| take(column, &wide(block)));
    }
}

fn wide<const R: usize, const C: usize>(block: &[[f32; C]; R]) -> Block<R, C> {
    block.map(|row| row.map(f64::from))
}

pub(super) fn narrow<const R: usize, const C: usize>(block: &Block<R, C>) -> [[f32; C]; R] {
    block.map(|row| row.map(|value| value as f32))
}

/// Motions of each node: its rows of the near-null-space vectors.
pub(super) type Motions<const B: usize, const C: usize> = Vec<Block<B, C>>;

/// Returns the matrix in single precision.
pub(super) fn stored<const B: usize>(a: &impl SymmetricBlocks<B>) -> BlockMatrix<B, B> {
    let row = |node: usize| {
        let mut row = Vec::new();
        a.visit(node, |column, block| row.push((column as u32, narrow(block))));
        row
    };
    BlockMatrix::from_rows(parallel::concat(a.nodes(), NODES_PER_TASK, |nodes| nodes.map(row).collect()))
}

/// Returns the diagonal block of each node.
pub(super) fn diagonal<const B: usize>(a: &impl SymmetricBlocks<B>) -> Vec<Block<B, B>> {
    let block_of = |node: usize| {
        let mut found = [[0.0; B]; B];
        a.visit(node, |column, block| {
            if column == node {
                found = *block;
            }
        });
        found
    };
    parallel::values(a.nodes(), NODES_PER_TASK, block_of)
}

/// Returns the inverse of a symmetric positive definite matrix by its Cholesky factor; `None` for any other matrix.
pub(super) fn inverse<const B: usize>(a: &Block<B, B>) -> Option<Block<B, B>> {
    let mut l = [[0.0; B]; B];
    for j in 0..B {
        // Cholesky factor L, column by column.
        let pivot = a[j][j] - l[j][..j].iter().map(|x| x * x).sum::<f64>();
        if pivot.is_nan() || pivot <= ZERO_PIVOT_RATIO * a[j][j] {
            return None;
        }
        l[j][j] = pivot.sqrt();
        for i in j + 1..B {
            let rest = a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            l[i][j] = rest / l[j][j];
        }
    }
    // L^-1, and A^-1 = L^-T L^-1.
    let mut lower = [[0.0; B]; B];
    for j in 0..B {
        lower[j][j] = 1.0 / l[j][j];
        for i in j + 1..B {
            let sum: f64 = (j..i).map(|k| l[i][k] * lower[k][j]).sum();
            lower[i][j] = -sum / l[i][i];
        }
    }
    let entry = |i: usize, j: usize| (i.max(j)..B).map(|k| lower[k][i] * lower[k][j]).sum();
    Some(std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))))
}

/// Returns the neighbours whose coupling block exceeds `least` relative to the diagonal blocks, in the Frobenius norm.
pub(super) fn strong_couplings<const B: usize>(
    a: &impl SymmetricBlocks<B>,
    diagonal: &[Block<B, B>],
    least: f64,
) -> Strong {
    let square = |block: &Block<B, B>| block.iter().flatten().map(|x| x * x).sum::<f64>();
    let sizes: Vec<f64> = diagonal.iter().map(|block| square(block).sqrt()).collect();
    let row = |node: usize| {
        let mut row = Vec::new();
        a.visit(node, |column, block| {
            let strength = square(block) / (sizes[node] * sizes[column]);
            if column != node && strength > least * least {
                row.push((column as u32, strength as f32));
            }
        });
        row
    };
    Strong::from_rows(parallel::concat(a.nodes(), NODES_PER_TASK, |nodes| nodes.map(row).collect()))
}

/// Groups of a level, with an orthonormal basis of the motions of each.
pub(super) struct Aggregates<const B: usize, const C: usize> {
    pub count: usize,
    /// Group of each node.
    of_node: Vec<u32>,
    /// Rows of each node in the basis of its group.
    basis: Motions<B, C>,
    /// Motions of the groups, expressed in these bases.
    pub motions: Motions<C, C>,
}

impl<const B: usize, const C: usize> Aggregates<B, C> {
    pub(super) fn new(strong: &Strong, motions: &Motions<B, C>) -> Self {
        // Members of each group.
        let (of_node, count) = aggregates(strong);
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
        of_node.iter().enumerate().for_each(|(node, &group)| members[group as usize].push(node as u32));
        // Orthonormalise the motions of each group.
        let of_group =
            |group: usize| orthonormal(members[group].iter().map(|&node| motions[node as usize]).collect());
        let found: Vec<(Motions<B, C>, Block<C, C>)> =
            parallel::concat(count, GROUPS_PER_TASK, |groups| groups.map(of_group).collect());
        // Rows of each node in the basis of its group.
        let mut basis = vec![[[0.0; C]; B]; of_node.len()];
        for (members, (rows_of_group, _)) in members.iter().zip(&found) {
            members.iter().zip(rows_of_group).for_each(|(&node, rows)| basis[node as usize] = *rows);
        }
        Self { count, of_node, basis, motions: found.into_iter().map(|(_, motions)| motions).collect() }
    }

    /// Returns the mass matrix of each group along its motions, from the masses of the nodes.
    pub(super) fn masses(&self, nodes: &[Block<B, B>]) -> Vec<Block<C, C>> {
        let mut masses = vec![[[0.0; C]; C]; self.count];
        for ((&group, basis), mass) in self.of_node.iter().zip(&self.basis).zip(nodes) {
            // B' M B of the node, added to its group.
            let mut moved = [[0.0; C]; B];
            add_product(&mut moved, mass, basis);
            let transposed = std::array::from_fn(|c| std::array::from_fn(|b| basis[b][c]));
            add_product::<C, B, C>(&mut masses[group as usize], &transposed, &moved);
        }
        masses
    }

    /// Returns the smoothed prolongation (1 - omega D^-1 A) times the basis of the groups.
    pub(super) fn smoothed(
        &self,
        a: &impl SymmetricBlocks<B>,
        inverse: &[Block<B, B>],
        omega: f64,
    ) -> BlockMatrix<B, C> {
        let row = |sums: &mut Sums<B, C>, node: usize| {
            // Row of A times the basis, summed by groups.
            a.visit(node, |column, block| {
                add_product(sums.at(self.of_node[column]), block, &self.basis[column]);
            });
            // Basis minus omega D^-1 times that row.
            sums.take(|column, force| {
                let mut moved = [[0.0; C]; B];
                add_product(&mut moved, &inverse[node], force);
                let is_in_group = column == self.of_node[node];
                let entry = |b: usize, c: usize| {
                    let tentative = if is_in_group { self.basis[node][b][c] } else { 0.0 };
                    (tentative - omega * moved[b][c]) as f32
                };
                std::array::from_fn(|b| std::array::from_fn(|c| entry(b, c)))
            })
        };
        BlockMatrix::from_rows(parallel::values_with_memory(
            a.nodes(),
            NODES_PER_TASK,
            || Sums::new(self.count),
            row,
        ))
    }
}

/// Orthonormalises the motions of some nodes by Gram-Schmidt, applied twice. Returns the basis, and the coefficients of
/// the given motions in it. Motions that depend on earlier ones become zero.
fn orthonormal<const B: usize, const C: usize>(mut motions: Motions<B, C>) -> (Motions<B, C>, Block<C, C>) {
    let mut coefficients = [[0.0; C]; C];
    let product = |motions: &Motions<B, C>, i: usize, j: usize| -> f64 {
        motions.iter().flatten().map(|row| row[i] * row[j]).sum()
    };
    for j in 0..C {
        // Remove the parts along the motions before; twice, against rounding.
        let before = product(&motions, j, j).sqrt();
        for _ in 0..2 {
            for i in 0..j {
                let along = product(&motions, i, j);
                coefficients[i][j] += along;
                motions.iter_mut().flatten().for_each(|row| row[j] -= along * row[i]);
            }
        }
        // Normalise, or drop a dependent motion.
        let length = product(&motions, j, j).sqrt();
        let is_new = length > DEPENDENT_MOTION_LENGTH * before;
        coefficients[j][j] = if is_new { length } else { 0.0 };
        let scale = if is_new { 1.0 / length } else { 0.0 };
        motions.iter_mut().flatten().for_each(|row| row[j] *= scale);
    }
    (motions, coefficients)
}

/// Returns P'AP, computed from A P. `empty` is the diagonal entry of rows that no motion reaches.
pub(super) fn galerkin<const B: usize, const C: usize>(
    a: &impl SymmetricBlocks<B>,
    p: &BlockMatrix<B, C>,
    r: &BlockMatrix<C, B>,
    empty: f32,
) -> BlockMatrix<C, C> {
    let count = r.n_rows();
    // Rows of A P, then rows of P' (A P).
    let forces = |sums: &mut Sums<B, C>, node: usize| {
        a.visit(node, |column, block| {
            p.row(column).for_each(|(group, entry)| add_product(sums.at(group as u32), block, &wide(entry)));
        });
        sums.take(|_, sum| narrow(sum))
    };
    let ap = BlockMatrix::from_rows(parallel::values_with_memory(
        a.nodes(),
        NODES_PER_TASK,
        || Sums::new(count),
        forces,
    ));
    let row = |sums: &mut Sums<C, C>, group: usize| {
        for (node, motion) in r.row(group) {
            for (other, force) in ap.row(node) {
                add_product(sums.at(other as u32), &wide(motion), &wide(force));
            }
        }
        sums.take(|column, sum| {
            let mut block = narrow(sum);
            let unmoved = |(c, row): &(usize, &mut [f32; C])| column as usize == group && row[*c] == 0.0;
            block.iter_mut().enumerate().filter(unmoved).for_each(|(c, row)| row[c] = empty);
            block
        })
    };
    BlockMatrix::from_rows(parallel::values_with_memory(count, GROUPS_PER_TASK, || Sums::new(count), row))
}

/// Adds a b to c.
#[inline(always)]
fn add_product<const R: usize, const S: usize, const C: usize>(
    c: &mut Block<R, C>,
    a: &Block<R, S>,
    b: &Block<S, C>,
) {
    for i in 0..R {
        for k in 0..S {
            for j in 0..C {
                c[i][j] += a[i][k] * b[k][j];
            }
        }
    }
}

/// Sums of the blocks of one row.
struct Sums<const R: usize, const C: usize> {
    /// Index of each column among the blocks, from 1; 0 for a column without a block.
    places: Vec<u32>,
    blocks: Vec<(u32, Block<R, C>)>,
}

impl<const R: usize, const C: usize> Sums<R, C> {
    fn new(columns: usize) -> Self {
        Self { places: vec![0; columns], blocks: Vec::new() }
    }

    fn at(&mut self, column: u32) -> &mut Block<R, C> {
        let place = &mut self.places[column as usize];
        if *place == 0 {
            self.blocks.push((column, [[0.0; C]; R]));
            *place = self.blocks.len() as u32;
        }
        &mut self.blocks[*place as usize - 1].1
    }

    /// Returns the entries that `of` computes from the sums, in ascending order of columns, and clears the sums.
    fn take(&mut self, of: impl Fn(u32, &Block<R, C>) -> [[f32; C]; R]) -> Entries<R, C> {
        self.blocks.iter().for_each(|(column, _)| self.places[*column as usize] = 0);
        self.blocks.sort_unstable_by_key(|(column, _)| *column);
        let entries = self.blocks.iter().map(|(column, sum)| (*column, of(*column, sum))).collect();
        self.blocks.clear();
        entries
    }
}

// Groups of neighbouring nodes, each of which becomes one node of the next coarser level (Vanek, Mandel and Brezina,
// Computing 56 (1996) 179, section 5.1).

/// Marks a node without a group.
const UNASSIGNED: u32 = u32::MAX;

/// Strongly coupled neighbours of each node, without the node itself, with the strength of the coupling.
pub(super) struct Strong {
    pointers: Vec<usize>,
    neighbours: Vec<(u32, f32)>,
}

impl Strong {
    pub(super) fn from_rows(rows: Vec<Vec<(u32, f32)>>) -> Self {
        let mut pointers = vec![0];
        for row in &rows {
            pointers.push(pointers[pointers.len() - 1] + row.len());
        }
        Self { pointers, neighbours: rows.into_iter().flatten().collect() }
    }

    fn around(&self, node: usize) -> &[(u32, f32)] {
        &self.neighbours[self.pointers[node]..self.pointers[node + 1]]
    }
}

/// Returns the group of each node, and the number of groups. A node whose neighbours are all free forms a group with
/// them. Other nodes join the neighbouring group with the strongest coupling. Nodes that touch no group form their own.
fn aggregates(strong: &Strong) -> (Vec<u32>, usize) {
    let n = strong.pointers.len() - 1;
    let (mut group, mut count) = (vec![UNASSIGNED; n], 0u32);
    // Groups of a node and its free neighbours.
    for node in 0..n {
        let around = strong.around(node);
        let all_free = || around.iter().all(|&(other, _)| group[other as usize] == UNASSIGNED);
        if group[node] == UNASSIGNED && !around.is_empty() && all_free() {
            group[node] = count;
            around.iter().for_each(|&(other, _)| group[other as usize] = count);
            count += 1;
        }
    }
    // Remaining nodes join the group of their strongest neighbour.
    let first = group.clone();
    for (node, assigned) in group.iter_mut().enumerate().filter(|(_, assigned)| **assigned == UNASSIGNED) {
        let grouped = strong.around(node).iter().filter(|(other, _)| first[*other as usize] != UNASSIGNED);
        if let Some(&(other, _)) = first_largest(grouped, |(_, strength)| (*strength).into()) {
            *assigned = first[other as usize];
        }
    }
    // Nodes without a neighbouring group form new groups.
    for node in 0..n {
        if group[node] == UNASSIGNED {
            group[node] = count;
            for &(other, _) in strong.around(node) {
                if group[other as usize] == UNASSIGNED {
                    group[other as usize] = count;
                }
            }
            count += 1;
        }
    }
    (group, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_is_one_and_an_indefinite_block_has_none() {
        let a = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.25], [-0.5, 0.25, 2.0]];
        let inverted = inverse(&a).expect("positive definite");
        for (i, j) in (0..9).map(|at| (at / 3, at % 3)) {
            let entry: f64 = (0..3).map(|k| a[i][k] * inverted[k][j]).sum();
            assert!((entry - f64::from(u8::from(i == j))).abs() < 1e-15, "({i}, {j}): {entry}");
        }
        assert_eq!(inverse(&[[1.0, 2.0], [2.0, 1.0]]), None);
        assert_eq!(inverse(&[[1.0, f64::NAN], [f64::NAN, 1.0]]), None);
    }

    #[test]
    fn motions_of_a_group_are_combinations_of_its_basis() {
        // Translation, rotation and their sum, for three nodes on a line.
        let motions: Motions<2, 3> =
            (0..3).map(|k| [[1.0, 0.0, 1.0], [0.0, f64::from(k), f64::from(k)]]).collect();
        let (basis, coefficients) = orthonormal(motions.clone());
        assert_eq!(coefficients[2][2], 0.0, "the sum depends on the others");
        for (given, basis_row) in motions.iter().flatten().zip(basis.iter().flatten()) {
            for j in 0..3 {
                let combined: f64 = (0..3).map(|k| basis_row[k] * coefficients[k][j]).sum();
                assert!((combined - given[j]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn every_node_of_a_chain_has_a_group_of_neighbours() {
        let n = 20u32;
        let row = |k: u32| {
            let others = [k.checked_sub(1), (k + 1 < n).then_some(k + 1)];
            others.into_iter().flatten().map(|other| (other, 1.0)).collect()
        };
        let (group, count) = aggregates(&Strong::from_rows((0..n).map(row).collect()));
        assert!(group.is_sorted() && group.iter().all(|assigned| (*assigned as usize) < count), "{group:?}");
        let sizes =
            (0..count as u32).map(|assigned| group.iter().filter(|other| **other == assigned).count());
        assert!(sizes.clone().all(|size| (2..=4).contains(&size)), "{group:?}");
    }

    #[test]
    fn a_node_that_is_coupled_to_nothing_is_a_group() {
        let strong = Strong::from_rows(vec![vec![(1, 1.0)], vec![(0, 1.0)], vec![]]);
        assert_eq!(aggregates(&strong), (vec![0, 0, 1], 2));
    }
}
