//! A finite element model, read from files or made of matrices in memory.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::base::units::UnitSystem;
use crate::input::{LoadSource, check_size, read_manifest, read_model};
use crate::model::{CheckedModel, Coupling, Damping, DofLabel, FeModel, NodeSet, Nodes, RawModel};
use crate::numerics::linalg::CscMatrix;
use std::path::Path;

/// A sparse matrix with both triangles of a symmetric one.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix(pub(super) CscMatrix);

impl SparseMatrix {
    /// From compressed columns: column j has the entries `col_ptr[j]..col_ptr[j + 1]` of `row_idx` and
    /// `values`, ascending by rows.
    ///
    /// # Errors
    /// FB303 and FB304 when the slices are no such matrix: pointers that descend or do not end at the number
    /// of entries, rows that do not ascend or are not below `n`; FB313 for too many rows.
    pub fn from_csc(n: usize, col_ptr: &[usize], row_idx: &[usize], values: &[f64]) -> Result<Self> {
        let refuse = |code: Code, what: String| {
            Err(Diagnostic::new(code, format!("compressed columns: {what}")).into())
        };
        if col_ptr.len() != n + 1 || col_ptr[0] != 0 || col_ptr.windows(2).any(|pair| pair[0] > pair[1]) {
            return refuse(
                Code::MatrixCount,
                format!("{} pointers are no ascending ones of {n} columns", col_ptr.len()),
            );
        }
        if row_idx.len() != values.len() || col_ptr[n] != values.len() {
            let (rows, numbers) = (row_idx.len(), values.len());
            return refuse(
                Code::MatrixCount,
                format!("{rows} rows and {numbers} values for {} entries", col_ptr[n]),
            );
        }
        check_size(n as u64, n as u64, values.len() as u64)?;
        let mut triplets = Vec::with_capacity(values.len());
        for column in 0..n {
            let entries = col_ptr[column]..col_ptr[column + 1];
            if let Some(row) = row_idx[entries.clone()].iter().find(|row| **row >= n) {
                return refuse(
                    Code::MatrixIndex,
                    format!("column {column} has an entry in row {row} of {n}"),
                );
            }
            if row_idx[entries.clone()].windows(2).any(|pair| pair[0] >= pair[1]) {
                return refuse(Code::MatrixIndex, format!("the rows of column {column} do not ascend"));
            }
            triplets.extend(entries.map(|k| (row_idx[k] as u32, column as u32, values[k])));
        }
        Ok(Self(CscMatrix::from_triplets(n, n, &triplets)))
    }

    /// From triplets (row, column, value); those of the same place are added.
    ///
    /// # Errors
    /// FB303 when an index is not below `n`; FB313 for too many rows.
    pub fn from_triplets(n: usize, triplets: &[(usize, usize, f64)]) -> Result<Self> {
        if let Some((row, column, _)) = triplets.iter().find(|(row, column, _)| *row >= n || *column >= n) {
            let message = format!("entry ({row}, {column}) lies outside a matrix of {n} rows");
            return Err(Diagnostic::new(Code::MatrixIndex, message).into());
        }
        check_size(n as u64, n as u64, triplets.len() as u64)?;
        let narrow: Vec<_> = triplets.iter().map(|&(i, j, value)| (i as u32, j as u32, value)).collect();
        Ok(Self(CscMatrix::from_triplets(n, n, &narrow)))
    }

    /// From a matrix of `sprs`, compressed by rows or columns.
    pub fn from_sprs(matrix: &sprs::CsMat<f64>) -> Self {
        Self(CscMatrix::from_sprs(matrix))
    }
}

/// A finite element model that passed every check: K and M are symmetric, K has the rigid motions and no
/// other, M is positive semidefinite and fits the nodes.
#[derive(Debug, Clone)]
pub struct Model {
    pub(super) checked: FeModel,
    pub(super) residual_vectors: Vec<LoadSource>,
    diagnostics: Vec<Diagnostic>,
}

impl Model {
    /// Reads the model of a manifest (`model.toml`, docs/input.md).
    ///
    /// # Errors
    /// FB101 to FB209 for the files, FB301 to FB321 for matrices, FB401 to FB439 for the model: all of a
    /// stage together.
    pub fn read(manifest: impl AsRef<Path>) -> Result<Self> {
        let files = read_manifest(manifest)?;
        Self::checked(read_model(&files)?, files.residual_vectors)
    }

    /// A model of matrices in memory: rows node by node, x, y, z in the order of the nodes.
    pub fn builder(name: impl Into<String>, stiffness: SparseMatrix, mass: SparseMatrix) -> ModelBuilder {
        let nodes = Nodes { ids: Vec::new(), positions: Vec::new() };
        ModelBuilder { raw: RawModel::in_memory(name, stiffness.0, mass.0, nodes) }
    }

    fn checked(raw: RawModel, residual_vectors: Vec<LoadSource>) -> Result<Self> {
        let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw)?;
        Ok(Self { checked: model, residual_vectors, diagnostics })
    }

    /// Name.
    pub fn name(&self) -> &str {
        self.checked.name()
    }

    /// Number of degrees of freedom N.
    pub fn n_dofs(&self) -> usize {
        self.checked.stiffness().n()
    }

    /// Node numbers.
    pub fn node_ids(&self) -> &[i64] {
        &self.checked.nodes().ids
    }

    /// Node positions. Unit: length.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.checked.nodes().positions
    }

    /// Warnings and notes of reading and checking.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }
}

/// A model in the making.
#[derive(Debug, Clone)]
pub struct ModelBuilder {
    raw: RawModel,
}

impl ModelBuilder {
    /// Numbers and positions of the nodes.
    pub fn nodes(mut self, ids: Vec<i64>, positions: Vec<[f64; 3]>) -> Self {
        self.raw.nodes = Nodes { ids, positions };
        self
    }

    /// Node number and direction of every row (1 to 3 displacements, 4 to 6 rotations), where rows are not x,
    /// y, z of each node.
    pub fn dofs(mut self, labels: impl IntoIterator<Item = (i64, u8)>) -> Self {
        let labels = labels.into_iter().map(|(node, direction)| DofLabel { node, direction });
        self.raw.dofs = Some(labels.collect());
        self
    }

    /// Units of length, mass and time, as in a manifest: `"m"`, `"kg"`, `"s"`, or a factor to SI.
    ///
    /// # Errors
    /// FB202 for a unit that is not known.
    pub fn units(mut self, length: &str, mass: &str, time: &str) -> Result<Self> {
        let parsed = UnitSystem::parse(length, mass, time);
        self.raw.units =
            parsed.map_err(|message| Error::from(Diagnostic::new(Code::ManifestUnit, message)))?;
        Ok(self)
    }

    /// A set of nodes that joints and loads act on, coupled to its reference point (the mean of the nodes) by
    /// their mean motion.
    pub fn interface(mut self, name: impl Into<String>, nodes: Vec<i64>) -> Self {
        self.raw.interfaces.push(NodeSet::new(name, nodes));
        self
    }

    /// As [`ModelBuilder::interface`], with nodes that move as a rigid body.
    pub fn rigid_interface(mut self, name: impl Into<String>, nodes: Vec<i64>) -> Self {
        let coupling = Some(Coupling::Rigid);
        self.raw.interfaces.push(NodeSet { coupling, ..NodeSet::new(name, nodes) });
        self
    }

    /// The same damping ratio for every mode.
    pub fn damping_ratio(mut self, ratio: f64) -> Self {
        self.raw.damping = Some(Damping::Ratio(ratio));
        self
    }

    /// Checks the model.
    ///
    /// # Errors
    /// FB305 to FB439: what is wrong with matrices, nodes and interfaces, all of a stage together.
    pub fn build(self) -> Result<Model> {
        Model::checked(self.raw, Vec::new())
    }
}
