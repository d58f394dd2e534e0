//! The degree of freedom of each matrix row: the table of this program, or files that Ansys writes with its matrices.

use super::matrix_market::read_array;
use super::tables::read_dofs;
use crate::assemble::{Entry, StoredEntries, assemble, push};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::scanner::{Lines, integer, words};
use flexbody_base::text::{Compression, InputFile};
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, NodeAxes as Block, RawMatrix};
use std::collections::HashMap;
use std::path::Path;

type Found<T> = Result<T, Vec<Diagnostic>>;

/// Content of a file about the rows.
pub(super) enum Mapping {
    /// Label of every row.
    Labels(Vec<DofLabel>),
    /// Nodes in the order of the rows, each with an equal number of directions (`*EXPORT` of Ansys).
    Nodes(Vec<i64>),
}

impl Mapping {
    /// Reads a table of labels (`node,dir`), a Matrix Market array of node numbers, or lines `row node direction` with
    /// directions such as `UX` (the mapping of `HBMAT`).
    ///
    /// # Errors
    /// FB203 to FB208 for a table that is not valid, FB301, FB302 for an array that is not valid.
    pub(super) fn read(file: &InputFile) -> Found<Self> {
        let bytes = file.bytes();
        if bytes.get(..14).is_some_and(|start| start.eq_ignore_ascii_case(b"%%MatrixMarket")) {
            return node_array(file).map(Self::Nodes);
        }
        match named_directions(bytes) {
            Some(labels) => Ok(Self::Labels(labels)),
            None => read_dofs(file).map(Self::Labels),
        }
    }

    /// Returns the labels of a matrix of `n` rows.
    ///
    /// # Errors
    /// FB402 if the rows are not an equal number (2, 3 or 6) for each node.
    pub(super) fn labels(self, n: usize, path: &Path) -> Found<Vec<DofLabel>> {
        let nodes = match self {
            Self::Labels(labels) => return Ok(labels),
            Self::Nodes(nodes) => nodes,
        };
        let each = n / nodes.len().max(1);
        if nodes.is_empty() || each * nodes.len() != n || !matches!(each, 2 | 3 | 6) {
            let message = format!(
                "{} nodes cannot share the {n} rows of the matrices equally, by 2, 3 or 6",
                nodes.len()
            );
            let help = "write labels of the rows as a table: node,dir";
            return Err(vec![Diagnostic::new(Code::DofCount, message).in_file(path).with_help(help)]);
        }
        let label = |node| (1..=each as u8).map(move |direction| DofLabel { node, direction });
        Ok(nodes.into_iter().flat_map(label).collect())
    }
}

fn node_array(file: &InputFile) -> Found<Vec<i64>> {
    let array = read_array(file, Compression::of(file.bytes()))
        .map_err(|found| found.into_iter().map(|d| d.in_file(file.path())).collect::<Vec<_>>())?;
    let wrong = |what: String| vec![Diagnostic::new(Code::TableRow, what).in_file(file.path())];
    if array.cols != 1 {
        return Err(wrong(format!("mapping has {} columns, expected one of node numbers", array.cols)));
    }
    let whole = |value: &f64| {
        if value.fract() == 0.0 && value.abs() < 9e15 {
            Ok(*value as i64)
        } else {
            Err(wrong(format!("{value} is not a node number")))
        }
    };
    array.values.iter().map(whole).collect()
}

/// Reads labels from lines `row node direction` with named directions; returns `None` if a line has another form, or a
/// row is missing.
fn named_directions(bytes: &[u8]) -> Option<Vec<DofLabel>> {
    const NAMES: [&str; 6] = ["UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"];
    let mut rows: Vec<(i64, DofLabel)> = Vec::new();
    for line in Lines::of(bytes) {
        let words: Vec<&[u8]> = words(line.text).collect();
        let &[row, node, name] = words.as_slice() else {
            // Headings and blank lines may precede the first row.
            if rows.is_empty() || words.is_empty() {
                continue;
            }
            return None;
        };
        let name = String::from_utf8_lossy(name).to_uppercase();
        let direction = NAMES.iter().position(|known| *known == name);
        match (integer(row), integer(node), direction) {
            (Some(row), Some(node), Some(at)) => rows.push((row, DofLabel { node, direction: at as u8 + 1 })),
            _ if rows.is_empty() => {}
            _ => return None,
        }
    }
    rows.sort_by_key(|(row, _)| *row);
    let complete = !rows.is_empty() && rows.iter().enumerate().all(|(k, (row, _))| *row == k as i64 + 1);
    complete.then(|| rows.into_iter().map(|(_, label)| label).collect())
}

// A cache of the indices of recent labels in a list of labels.

/// Cache that numbers labels as they come. A label that was displaced by others is added to the list again.
pub(super) struct Recent<T> {
    slots: Vec<Option<(T, u32)>>,
}

impl<T: Copy + PartialEq> Recent<T> {
    const BITS: u32 = 12;

    pub(super) fn new() -> Self {
        Self { slots: vec![None; 1 << Self::BITS] }
    }

    /// Returns the index of a label in `labels`, to which the label is added if it is not in the cache. Labels of one
    /// node differ in `direction`.
    pub(super) fn place(&mut self, label: T, (node, direction): (i64, u8), labels: &mut Vec<T>) -> u32 {
        let key = (node as u64).wrapping_mul(8).wrapping_add(u64::from(direction));
        let slot = &mut self.slots[(key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (64 - Self::BITS)) as usize];
        match *slot {
            Some((known, at)) if known == label => at,
            _ => {
                let at = labels.len() as u32;
                labels.push(label);
                *slot = Some((label, at));
                at
            }
        }
    }
}

// Transformation of rows along axes of their nodes to the axes of the model: K becomes A K A', where the columns of A
// are the row axes of each node.

/// Three rows that are rotated together, or a single row that is not.
struct RowTriple {
    rows: [u32; 3],
    /// Unit vectors along the rows; `None` for rows that are not rotated.
    axes: Option<Block>,
}

/// Rotation of the rows.
pub(super) struct Turn {
    groups: Vec<RowTriple>,
    /// Group of each row, and index of the row in the group.
    group_of: Vec<(u32, u8)>,
}

impl Turn {
    /// Creates the rotation from the labels of the rows and the unit vectors along the rows of some nodes.
    ///
    /// # Errors
    /// The number of a node that has some displacements, or some rotations, but not each of them once.
    pub(super) fn new(labels: &[DofLabel], axes: &HashMap<i64, Block>) -> Result<Self, i64> {
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
    pub(super) fn turned(&self, raw: RawMatrix) -> Result<RawMatrix, Diagnostic> {
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
    pub(super) fn axes(&self) -> CscMatrix {
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
