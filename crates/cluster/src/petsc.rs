//! Matrices and vectors in the binary form of PETSc: written for `MatLoad` and `VecLoad`, vectors read from `VecView`.
//! All numbers are big-endian.

use faer::{Mat, MatRef};
use flexbody_base::provenance::Fingerprint;
use flexbody_linalg::SymmetricMatrix;
use flexbody_model::FeModel;
use std::io::{BufWriter, Read, Result, Write};

const MATRIX: i64 = 1_211_216;
const VECTOR: i64 = 1_211_214;

/// Size of the integers of a file, which depends on the configuration of PETSc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IndexBytes {
    Four,
    Eight,
}

impl IndexBytes {
    /// Returns the size with this number of bytes; `None` for other numbers than 4 and 8.
    pub(crate) fn of(bytes: u64) -> Option<Self> {
        match bytes {
            4 => Some(Self::Four),
            8 => Some(Self::Eight),
            _ => None,
        }
    }

    /// Returns the number of bytes.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Self::Four => 4,
            Self::Eight => 8,
        }
    }

    /// Returns the largest integer.
    pub(crate) fn largest(self) -> u64 {
        match self {
            Self::Four => i32::MAX as u64,
            Self::Eight => i64::MAX as u64,
        }
    }

    fn put(self, to: &mut impl Write, number: i64) -> Result<()> {
        match self {
            // Numbers that do not fit were refused earlier.
            Self::Four => to.write_all(&(number as i32).to_be_bytes()),
            Self::Eight => to.write_all(&number.to_be_bytes()),
        }
    }

    fn get(self, from: &mut impl Read) -> Result<i64> {
        let mut bytes = [0; 8];
        match self {
            Self::Four => {
                from.read_exact(&mut bytes[..4])?;
                let [a, b, c, d, ..] = bytes;
                Ok(i64::from(i32::from_be_bytes([a, b, c, d])))
            }
            Self::Eight => {
                from.read_exact(&mut bytes)?;
                Ok(i64::from_be_bytes(bytes))
            }
        }
    }
}

/// Writer that computes the fingerprint of the bytes.
struct Sealing<W> {
    out: W,
    fingerprint: Fingerprint,
}

impl<W: Write> Write for Sealing<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let written = self.out.write(bytes)?;
        self.fingerprint.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> Result<()> {
        self.out.flush()
    }
}

/// Size of the write buffer in bytes.
const BUFFER_BYTES: usize = 1 << 20;

fn sealing<W: Write>(out: W, fill: impl FnOnce(&mut BufWriter<Sealing<W>>) -> Result<()>) -> Result<String> {
    let mut to = BufWriter::with_capacity(BUFFER_BYTES, Sealing { out, fingerprint: Fingerprint::default() });
    fill(&mut to)?;
    let mut sealing = to.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    sealing.flush()?;
    Ok(sealing.fingerprint.hex())
}

/// Square matrix, given row by row.
pub(super) trait Rows {
    /// Returns the number of rows.
    fn n(&self) -> usize;

    /// Returns the number of entries of all rows.
    fn entries(&self) -> u64;

    /// Replaces `entries` by columns, ascending, and values of a row.
    fn row(&self, row: usize, entries: &mut Vec<(u32, f64)>);
}

/// Writes a matrix row by row, without a copy of it. Returns the SHA-256 of the bytes.
pub(super) fn write_matrix(out: impl Write, rows: &impl Rows, index: IndexBytes) -> Result<String> {
    let (n, mut entries) = (rows.n(), Vec::new());
    sealing(out, |to| {
        // PETSc stores header, row lengths, column indices and values one after the other: pass over the rows for each.
        for number in [MATRIX, n as i64, n as i64, rows.entries() as i64] {
            index.put(to, number)?;
        }
        for row in 0..n {
            rows.row(row, &mut entries);
            index.put(to, entries.len() as i64)?;
        }
        for row in 0..n {
            rows.row(row, &mut entries);
            entries.iter().try_for_each(|(column, _)| index.put(to, i64::from(*column)))?;
        }
        for row in 0..n {
            rows.row(row, &mut entries);
            entries.iter().try_for_each(|(_, value)| to.write_all(&value.to_be_bytes()))?;
        }
        Ok(())
    })
}

/// Writes columns as consecutive vectors. Returns the SHA-256 of the bytes.
pub(super) fn write_vectors(out: impl Write, columns: MatRef<'_, f64>, index: IndexBytes) -> Result<String> {
    sealing(out, |to| {
        for j in 0..columns.ncols() {
            index.put(to, VECTOR)?;
            index.put(to, columns.nrows() as i64)?;
            columns.col(j).iter().try_for_each(|value| to.write_all(&value.to_be_bytes()))?;
        }
        Ok(())
    })
}

/// Reads the next vector of `n` numbers; `None` if the file holds something else.
pub(super) fn read_vector(from: &mut impl Read, n: usize, index: IndexBytes) -> Result<Option<Vec<f64>>> {
    if index.get(from)? != VECTOR || index.get(from)? != n as i64 {
        return Ok(None);
    }
    let (mut values, mut bytes) = (Vec::with_capacity(n), [0; 8]);
    for _ in 0..n {
        from.read_exact(&mut bytes)?;
        values.push(f64::from_be_bytes(bytes));
    }
    Ok(Some(values))
}

// Row order in files for other solvers: node by node, with the rotations of a node after its displacements. The rows
// of one node are then on one rank, and multigrid finds blocks.

/// Permutation between rows of the files and internal rows.
pub(super) struct RowOrder {
    /// Internal row of each row of the files.
    internal: Vec<u32>,
    /// Row of the files of each internal row.
    written: Vec<u32>,
    /// Number of rows of every node, if it is equal for all nodes and there are no other rows; else 1.
    pub block_size: usize,
}

impl RowOrder {
    pub(crate) fn of(model: &FeModel) -> Self {
        let rows = model.rows();
        let (d, n, displacements) = (model.dimension(), rows.len(), rows.displacements());
        // Vertex and component: displacements, then rotations; rows without a position come last.
        let key = |row: usize| match row.checked_sub(displacements) {
            None => (row / d, row % d),
            Some(after) => match rows.rotations().get(after) {
                Some(&(node, axis)) => (node as usize, d + usize::from(axis)),
                None => (usize::MAX, row),
            },
        };
        let mut internal: Vec<u32> = (0..n as u32).collect();
        internal.sort_by_key(|&row| key(row as usize));
        let mut written = vec![0; n];
        for (to, &from) in internal.iter().enumerate() {
            written[from as usize] = to as u32;
        }
        let nodes = model.nodes().len();
        let turning = rows.rotations().len();
        let whole = rows.vectors() == 0 && n == displacements + turning && turning.is_multiple_of(nodes);
        let block_size = if whole { d + turning / nodes } else { 1 };
        Self { internal, written, block_size }
    }

    /// Returns columns, given in internal rows, in the order of the files.
    pub(crate) fn to_written(&self, columns: MatRef<'_, f64>) -> Mat<f64> {
        Mat::from_fn(columns.nrows(), columns.ncols(), |i, j| columns[(self.internal[i] as usize, j)])
    }

    /// Returns the internal row of a row of the files.
    pub(crate) fn internal(&self, row: usize) -> usize {
        self.internal[row] as usize
    }
}

/// Matrix that turns displacements by one radian about an axis b: psi becomes e_b x psi at every node, and other rows
/// become zero. The products of the turned shapes T_b Psi with M are the integrals of psi_k psi_l from which W2 and W3
/// are made, in addition to M and the moments of the rigid modes.
pub(super) struct TurnedRows<'a> {
    order: &'a RowOrder,
    pub axis: usize,
    dimension: usize,
    displacements: usize,
}

impl<'a> TurnedRows<'a> {
    /// Returns the matrices of all axes of rotation of the model: the third axis only in the plane.
    pub(crate) fn of(model: &FeModel, order: &'a RowOrder) -> Vec<Self> {
        let (dimension, displacements) = (model.dimension(), model.rows().displacements());
        let axes = if dimension == 2 { 2..3 } else { 0..3 };
        axes.map(|axis| Self { order, axis, dimension, displacements }).collect()
    }

    /// Returns the internal row from which a row takes its value, and the sign; `None` for zero rows.
    pub(crate) fn source(&self, internal: usize) -> Option<(usize, f64)> {
        let (vertex, to) = (internal / self.dimension, internal % self.dimension);
        if internal >= self.displacements || to == self.axis {
            return None;
        }
        // (e_b x psi)_k = psi_l if (k, b, l) is cyclic, and -psi_l otherwise.
        let sign = if self.axis == (to + 1) % 3 { 1.0 } else { -1.0 };
        Some((vertex * self.dimension + 3 - self.axis - to, sign))
    }
}

impl Rows for TurnedRows<'_> {
    fn n(&self) -> usize {
        self.order.internal.len()
    }

    fn entries(&self) -> u64 {
        (0..self.n()).filter(|&row| self.source(row).is_some()).count() as u64
    }

    fn row(&self, row: usize, entries: &mut Vec<(u32, f64)>) {
        entries.clear();
        let source = self.source(self.order.internal(row));
        entries.extend(source.map(|(from, sign)| (self.order.written[from], sign)));
    }
}

/// Matrix A kron I_block in the row order of the files.
pub(super) struct WrittenRows<'a> {
    pub matrix: &'a SymmetricMatrix,
    pub block: usize,
    pub order: &'a RowOrder,
}

impl Rows for WrittenRows<'_> {
    fn n(&self) -> usize {
        self.matrix.n() * self.block
    }

    /// The diagonal is always written, even if it is zero, since solvers need its position.
    fn row(&self, row: usize, entries: &mut Vec<(u32, f64)>) {
        entries.clear();
        let internal = self.order.internal(row);
        let (vertex, component) = (internal / self.block, internal % self.block);
        let (columns, values) = self.matrix.row(vertex);
        let column = |j: u32| self.order.written[j as usize * self.block + component];
        entries.extend(columns.iter().zip(values).map(|(&j, &value)| (column(j), value)));
        if entries.iter().all(|(j, _)| *j as usize != row) {
            entries.push((row as u32, 0.0));
        }
        if !entries.is_sorted_by_key(|(j, _)| *j) {
            entries.sort_unstable_by_key(|(j, _)| *j);
        }
    }

    fn entries(&self) -> u64 {
        let matrix = self.matrix;
        let stored = |i: usize| {
            let (columns, _) = matrix.row(i);
            columns.len() as u64 + u64::from(columns.binary_search(&(i as u32)).is_err())
        };
        self.block as u64 * (0..matrix.n()).map(stored).sum::<u64>()
    }
}
