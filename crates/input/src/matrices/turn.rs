//! Transformation of rows along axes of their nodes to the axes of the model: K becomes A K A', where the columns of A
//! are the row axes of each node.

use super::assemble::{Entry, StoredEntries, assemble, push};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, NodeAxes as Block, RawMatrix};
use std::collections::HashMap;

/// Three rows that are rotated together, or a single row that is not.
struct RowTriple {
    rows: [u32; 3],
    /// Unit vectors along the rows; `None` for rows that are not rotated.
    axes: Option<Block>,
}

/// Rotation of the rows.
pub(crate) struct Turn {
    groups: Vec<RowTriple>,
    /// Group of each row, and index of the row in the group.
    group_of: Vec<(u32, u8)>,
}

impl Turn {
    /// Creates the rotation from the labels of the rows and the unit vectors along the rows of some nodes.
    ///
    /// # Errors
    /// The number of a node that has some displacements, or some rotations, but not each of them once.
    pub(crate) fn new(labels: &[DofLabel], axes: &HashMap<i64, Block>) -> Result<Self, i64> {
        let mut triples: HashMap<(i64, bool), [u32; 3]> = HashMap::new();
        for (row, label) in labels.iter().enumerate().filter(|(_, label)| axes.contains_key(&label.node)) {
            let triple = triples.entry((label.node, label.direction > 3)).or_insert([u32::MAX; 3]);
            triple[usize::from(label.direction - 1) % 3] = row as u32;
        }
        let (mut groups, mut group_of) = (Vec::new(), vec![(u32::MAX, 0); labels.len()]);
        for (row, label) in labels.iter().enumerate() {
            if group_of[row].0 != u32::MAX {
                continue;
            }
            let number = groups.len() as u32;
            let Some(axes_of_node) = axes.get(&label.node) else {
                group_of[row] = (number, 0);
                groups.push(RowTriple { rows: [row as u32; 3], axes: None });
                continue;
            };
            let rows = triples[&(label.node, label.direction > 3)];
            // Two rows have one direction: component 0 of a grid counts as its first.
            if !rows.contains(&(row as u32)) {
                return Err(label.node);
            }
            for (k, &row) in rows.iter().enumerate() {
                *group_of.get_mut(row as usize).ok_or(label.node)? = (number, k as u8);
            }
            groups.push(RowTriple { rows, axes: Some(*axes_of_node) });
        }
        Ok(Self { groups, group_of })
    }

    /// Returns the matrix with its rows and columns along the basic axes. Blocks that are a multiple of the identity
    /// are unchanged if both their nodes have equal axes.
    pub(crate) fn turned(&self, raw: RawMatrix) -> Result<RawMatrix, Diagnostic> {
        let mut pieces = Vec::new();
        for group in &self.groups {
            let mut blocks: Vec<(u32, u8, u8, f64)> = Vec::new();
            for (k, &column) in group.rows[..group.count()].iter().enumerate() {
                let (rows, values) = raw.matrix.column(column as usize);
                blocks.extend(rows.iter().zip(values).map(|(&row, &value)| {
                    let (other, j) = self.group_of[row as usize];
                    (other, j, k as u8, value)
                }));
            }
            blocks.sort_by_key(|block| block.0);
            for same in blocks.chunk_by(|a, b| a.0 == b.0) {
                let other = &self.groups[same[0].0 as usize];
                let mut block = [[0.0; 3]; 3];
                same.iter().for_each(|&(_, j, k, value)| block[usize::from(j)][usize::from(k)] = value);
                let block = turned_block(block, other, group);
                for (j, &row) in other.rows[..other.count()].iter().enumerate() {
                    for (k, &col) in group.rows[..group.count()].iter().enumerate() {
                        push(&mut pieces, Entry { row, col, value: block[j][k] });
                    }
                }
            }
        }
        let RawMatrix { digits, path, .. } = raw;
        let turned = assemble(self.group_of.len(), pieces, StoredEntries::Full, 17, &path)?;
        Ok(RawMatrix { digits, ..turned })
    }
}

impl Turn {
    /// Returns A: column i holds the rows of the model that move with row i.
    pub(crate) fn axes(&self) -> CscMatrix {
        let mut entries = Vec::new();
        for (row, &(group, k)) in (0u32..).zip(&self.group_of) {
            let RowTriple { rows, axes } = &self.groups[group as usize];
            match axes {
                None => entries.push((row, row, 1.0)),
                Some(axes) => {
                    let along = rows.iter().zip(axes[usize::from(k)]);
                    entries.extend(along.map(|(&target, value)| (target, row, value)));
                }
            }
        }
        CscMatrix::from_triplets(self.group_of.len(), self.group_of.len(), &entries)
    }
}

impl RowTriple {
    fn count(&self) -> usize {
        if self.axes.is_some() { 3 } else { 1 }
    }
}

/// Returns A B C', where the columns of A and C are the axes of the rows and of the columns.
fn turned_block(block: Block, rows: &RowTriple, columns: &RowTriple) -> Block {
    let is_multiple = (0..3).all(|j| (0..3).all(|k| block[j][k] == if j == k { block[0][0] } else { 0.0 }));
    if rows.axes == columns.axes && (is_multiple || rows.axes.is_none()) {
        return block;
    }
    let mut half = block;
    if let Some(axes) = rows.axes {
        half = [0, 1, 2].map(|i| [0, 1, 2].map(|k| (0..3).map(|j| axes[j][i] * block[j][k]).sum()));
    }
    let Some(axes) = columns.axes else { return half };
    [0, 1, 2].map(|i| [0, 1, 2].map(|l| (0..3).map(|k| half[i][k] * axes[k][l]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn a_direction_that_is_there_twice_is_refused() {
        let labels: Vec<DofLabel> =
            [1, 1, 2, 3].map(|direction| DofLabel { node: 7, direction }).into_iter().collect();
        let axes = HashMap::from([(7, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])]);
        assert_eq!(Turn::new(&labels, &axes).err(), Some(7));
    }

    /// A spring along the first axis of two nodes with different axes, and a mass.
    #[test]
    fn a_spring_between_turned_nodes_pulls_along_its_line() {
        let labels: Vec<DofLabel> =
            (1..=2).flat_map(|node| (1..=3).map(move |direction| DofLabel { node, direction })).collect();
        let along_z = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let axes = HashMap::from([(1, along_z)]);
        let turn = Turn::new(&labels, &axes).expect("whole nodes");
        let raw = |triplets: &[(u32, u32, f64)]| RawMatrix {
            matrix: CscMatrix::from_triplets(6, 6, triplets),
            digits: 12,
            path: PathBuf::new(),
        };
        // The spring acts along the first row of node 1 and the third of node 2, which are both along z.
        let spring = raw(&[(0, 0, 5.0), (0, 5, -5.0), (5, 0, -5.0), (5, 5, 5.0)]);
        let turned = turn.turned(spring).expect("turned");
        let expected = [(2, 2, 5.0), (2, 5, -5.0), (5, 2, -5.0), (5, 5, 5.0)];
        assert_eq!(turned.matrix, CscMatrix::from_triplets(6, 6, &expected));
        assert_eq!(turned.digits, 12);
        let mass: Vec<(u32, u32, f64)> = (0..6).map(|i| (i, i, 3.0)).collect();
        assert_eq!(turn.turned(raw(&mass)).expect("turned"), RawMatrix { digits: 12, ..raw(&mass) });
        assert_eq!(Turn::new(&labels[1..], &axes).err(), Some(1), "a displacement is missing");
    }
}
