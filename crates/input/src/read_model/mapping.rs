//! The degree of freedom of each matrix row: the table of this program, or files that Ansys writes with its matrices.

use crate::matrices::matrix_market::read_array;
use crate::tables::read_dofs;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::scanner::{Lines, integer, words};
use flexbody_base::text::{Compression, InputFile};
use flexbody_model::DofLabel;
use std::path::Path;

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
    pub(super) fn read(file: &InputFile) -> Diagnosed<Self> {
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
    pub(super) fn labels(self, n: usize, path: &Path) -> Diagnosed<Vec<DofLabel>> {
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

fn node_array(file: &InputFile) -> Diagnosed<Vec<i64>> {
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
