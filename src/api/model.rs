//! Finite element model, read from files or made of matrices in memory.

use super::FlexBody;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::units::UnitSystem;
use flexbody_body::verification::model_of;
use flexbody_input::{
    InterfaceSource, LoadSource, ModelFiles, check_size, interface_in_memory, parse_damping, read_manifest,
    read_model,
};
use flexbody_linalg::CscMatrix;
use flexbody_model::{
    Accepted, CheckedModel, Coupling, Damping, DampingBand, DofLabel, FeModel, NodalStress, NodeSet, Nodes,
    RawMatrix, RawModel, Reference, StressNodes, SurfaceMesh,
};
use std::path::{Path, PathBuf};

/// Sparse matrix; a symmetric one has both triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix(pub(super) CscMatrix);

impl SparseMatrix {
    /// Creates a matrix from compressed columns: column j has the entries `col_ptr[j]..col_ptr[j + 1]` of `row_idx` and
    /// `values`, with ascending rows.
    ///
    /// # Errors
    /// FB303 and FB304 if the slices do not describe such a matrix: pointers descend or do not end at the number of
    /// entries, rows do not ascend or are not below `n`; FB313 for too many rows.
    pub fn from_csc(n: usize, col_ptr: &[usize], row_idx: &[usize], values: &[f64]) -> Result<Self> {
        let refuse = |code: Code, what: String| {
            Err(Diagnostic::new(code, format!("compressed columns: {what}")).into())
        };
        if col_ptr.len() != n + 1 || col_ptr[0] != 0 || col_ptr.windows(2).any(|pair| pair[0] > pair[1]) {
            return refuse(
                Code::MatrixCount,
                format!("{} column pointers are not ascending or do not fit {n} columns", col_ptr.len()),
            );
        }
        if row_idx.len() != values.len() || col_ptr[n] != values.len() {
            let (rows, numbers) = (row_idx.len(), values.len());
            return refuse(
                Code::MatrixCount,
                format!("{rows} row indices and {numbers} values, expected {} of each", col_ptr[n]),
            );
        }
        check_size(n as u64, n as u64, values.len() as u64)?;
        // Rows must ascend in each column, which also excludes repeated positions.
        let mut triplets = Vec::with_capacity(values.len());
        for column in 0..n {
            let entries = col_ptr[column]..col_ptr[column + 1];
            if let Some(row) = row_idx[entries.clone()].iter().find(|row| **row >= n) {
                return refuse(
                    Code::MatrixIndex,
                    format!("column {column} has an entry in row {row}, but the matrix has {n} rows"),
                );
            }
            if row_idx[entries.clone()].windows(2).any(|pair| pair[0] >= pair[1]) {
                return refuse(
                    Code::MatrixIndex,
                    format!("the row indices of column {column} are not ascending"),
                );
            }
            triplets.extend(entries.map(|k| (row_idx[k] as u32, column as u32, values[k])));
        }
        Ok(Self(CscMatrix::from_triplets(n, n, &triplets)))
    }

    /// Creates a matrix from triplets (row, column, value). Values of equal positions are added.
    ///
    /// # Errors
    /// FB303 if an index is not below `n`; FB313 for too many rows.
    pub fn from_triplets(n: usize, triplets: &[(usize, usize, f64)]) -> Result<Self> {
        if let Some((row, column, _)) = triplets.iter().find(|(row, column, _)| *row >= n || *column >= n) {
            let message = format!("entry ({row}, {column}) lies outside a matrix of {n} rows");
            return Err(Diagnostic::new(Code::MatrixIndex, message).into());
        }
        check_size(n as u64, n as u64, triplets.len() as u64)?;
        let narrow: Vec<_> = triplets.iter().map(|&(i, j, value)| (i as u32, j as u32, value)).collect();
        Ok(Self(CscMatrix::from_triplets(n, n, &narrow)))
    }

    /// Converts a matrix of `sprs`, compressed by rows or columns.
    pub fn from_sprs(matrix: &sprs::CsMat<f64>) -> Self {
        Self(CscMatrix::from_sprs(matrix))
    }
}

/// Finite element model that has passed every check: K and M are symmetric, K has the rigid motions and no other
/// zero-energy motion, M is positive semidefinite and matches the nodes.
#[derive(Debug, Clone)]
pub struct Model {
    pub(super) checked: FeModel,
    pub(super) residual_vectors: Vec<LoadSource>,
    diagnostics: Vec<Diagnostic>,
}

impl Model {
    /// Reads the model of a manifest (`model.toml`, docs/reference/input.md).
    ///
    /// # Errors
    /// FB101 to FB209 for the files, FB301 to FB321 for matrices, FB401 to FB439 for the model: all errors of a stage
    /// together.
    pub fn read(manifest: impl AsRef<Path>) -> Result<Self> {
        let mut files = read_manifest(manifest)?;
        files.describe_elements = true;
        Self::checked(read_model(&files)?, files.residual_vectors)
    }

    /// Reads the output of an FE program (docs/how_to/from_fe_programs.md): the deck or another main file of a job.
    ///
    /// * `program`: name of the program as on the command line; `None` to detect it from the files.
    /// * `units`: units of length, mass and time, as in a manifest; `None` if not stated.
    /// * `interfaces`: names of interfaces, each with a node set of the deck (or a region, as `--interface` has it) and a
    ///   coupling.
    /// * `damping`: damping of the model as `--damping` has it: a ratio, `rayleigh=ALPHA,BETA`, `bands=...` or
    ///   `matrix=FILE`.
    ///
    /// # Errors
    /// The errors of [`Model::read`]; FB108 to FB112 for errors of the job, FB220 for a set that the job does not have;
    /// [`Usage`](Code::Usage) for another text of damping.
    pub fn read_job(
        path: impl AsRef<Path>,
        program: Option<&str>,
        units: Option<[&str; 3]>,
        interfaces: &[(&str, &str, Option<Coupling>)],
        damping: Option<&str>,
    ) -> Result<Self> {
        let source = |&(name, nodes, coupling): &(&str, &str, Option<Coupling>)| {
            InterfaceSource::named(name, nodes, coupling, 3)
        };
        let interfaces = interfaces.iter().map(source).collect::<Result<Vec<_>>>()?;
        let units = units.map(|units| units.join(","));
        let path = path.as_ref();
        let mut files = ModelFiles::from_job(path, program.map(str::to_owned), interfaces, units.as_deref())?;
        files.damping = damping.map(parse_damping).transpose()?;
        files.describe_elements = true;
        Self::checked(read_model(&files)?, Vec::new())
    }

    /// Returns the model with stresses at nodes as a recovery `name`: means over the elements of one material around each
    /// node, from the elements of its deck, whose assembled stiffness has to be K.
    ///
    /// # Errors
    /// FB462 if the elements are not known or K does not prove them; FB323 for nodes of no element; FB201 for a name that is
    /// given twice.
    pub fn with_stresses(&self, name: impl Into<String>, nodes: StressNodes) -> Result<Self> {
        let mut model = self.clone();
        let asked = NodalStress { name: name.into(), nodes, path: PathBuf::new() };
        model.checked.add_nodal_stresses(std::slice::from_ref(&asked))?;
        Ok(model)
    }

    /// Returns the names of the FE programs whose output [`Model::read_job`] reads.
    pub fn programs() -> Vec<&'static str> {
        flexbody_input::job_programs().collect()
    }

    /// Reads the model that `body` was made of, from its manifest or the output of an FE program, for
    /// [`FlexBody::check`]: all of the matrices, or the part of one of several bodies.
    ///
    /// # Errors
    /// The errors of [`Model::read`] and [`Model::read_job`]; FB707 if the matrices hold other bodies.
    pub fn read_for(body: &FlexBody, path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let is_manifest = path.extension().is_some_and(|extension| extension == "toml");
        let mut files = if is_manifest {
            read_manifest(path)?
        } else {
            ModelFiles::from_job(path, None, Vec::new(), None)?
        };
        files.describe_elements = true;
        let CheckedModel { model, diagnostics, .. } = model_of(&body.0, read_model(&files)?)?;
        Ok(Self { checked: model, residual_vectors: files.residual_vectors, diagnostics })
    }

    /// Starts a model of matrices in memory. By default the rows are x, y, z of each node, in the order of the nodes.
    pub fn builder(name: impl Into<String>, stiffness: SparseMatrix, mass: SparseMatrix) -> ModelBuilder {
        let nodes = Nodes { ids: Vec::new(), positions: Vec::new() };
        let raw = RawModel::in_memory(name, stiffness.0, mass.0, nodes);
        ModelBuilder { raw, regions: Vec::new(), residual_vectors: Vec::new() }
    }

    fn checked(raw: RawModel, residual_vectors: Vec<LoadSource>) -> Result<Self> {
        let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw)?;
        Ok(Self { checked: model, residual_vectors, diagnostics })
    }

    /// Returns the name of the model.
    pub fn name(&self) -> &str {
        self.checked.name()
    }

    /// Returns the number of degrees of freedom N.
    pub fn n_dofs(&self) -> usize {
        self.checked.stiffness().n()
    }

    /// Returns the node numbers.
    pub fn node_ids(&self) -> &[i64] {
        &self.checked.nodes().ids
    }

    /// Returns the node positions. Unit: length.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.checked.nodes().positions
    }

    /// Returns the warnings and notes of reading and checking.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }
}

/// Builder of a model from matrices in memory.
#[derive(Debug, Clone)]
pub struct ModelBuilder {
    raw: RawModel,
    regions: Vec<GivenRegion>,
    residual_vectors: Vec<LoadSource>,
}

/// Interface of a region, as [`ModelBuilder::interface_in`] is given it.
#[derive(Debug, Clone)]
struct GivenRegion {
    name: String,
    region: String,
    coupling: Option<Coupling>,
    reference: Option<Reference>,
}

impl ModelBuilder {
    /// Sets numbers and positions of the nodes. Interfaces, labels of rows, loads and scenes refer to nodes by these
    /// numbers; [`ModelBuilder::mesh`] by indices from 0.
    pub fn nodes(mut self, ids: Vec<i64>, positions: Vec<[f64; 3]>) -> Self {
        self.raw.nodes = Nodes { ids, positions };
        self
    }

    /// Sets the surface for drawing: triangles, counterclockwise seen from outside, and edges, both as node indices.
    /// The nodes must be set before.
    ///
    /// # Errors
    /// FB125 for an invalid index, a triangle or an edge with a repeated node, or neither triangles nor edges.
    pub fn mesh(mut self, triangles: Vec<[u32; 3]>, edges: Vec<[u32; 2]>) -> Result<Self> {
        let mesh = SurfaceMesh::new(triangles, edges, self.raw.nodes.len());
        self.raw.data.mesh = Some(mesh.map_err(|problem| Diagnostic::new(Code::MeshForeign, problem))?);
        Ok(self)
    }

    /// Sets node number and direction of every row (1 to 3 displacements, 4 to 6 rotations), if rows are not x, y, z of
    /// each node.
    pub fn dofs(mut self, labels: impl IntoIterator<Item = (i64, u8)>) -> Self {
        let labels = labels.into_iter().map(|(node, direction)| DofLabel { node, direction });
        self.raw.dofs = Some(labels.collect());
        self
    }

    /// Sets the units of length, mass and time, as in a manifest: `"m"`, `"kg"`, `"s"`, or a factor to SI.
    ///
    /// # Errors
    /// FB202 for an unknown unit.
    pub fn units(mut self, length: &str, mass: &str, time: &str) -> Result<Self> {
        let parsed = UnitSystem::parse(length, mass, time);
        self.raw.data.description.units =
            parsed.map_err(|message| Error::from(Diagnostic::new(Code::ManifestUnit, message)))?;
        Ok(self)
    }

    /// Adds a set of nodes that joints and loads act on. It is coupled to its reference point by the mean motion of the
    /// nodes; the point is the mean of the nodes.
    pub fn interface(mut self, name: impl Into<String>, nodes: Vec<i64>) -> Self {
        self.raw.data.interfaces.push(NodeSet::new(name, nodes));
        self
    }

    /// Adds an interface whose nodes move as a rigid body. The reference point is the mean of the nodes.
    pub fn rigid_interface(mut self, name: impl Into<String>, nodes: Vec<i64>) -> Self {
        let coupling = Some(Coupling::Rigid);
        self.raw.data.interfaces.push(NodeSet { coupling, ..NodeSet::new(name, nodes) });
        self
    }

    /// Adds an interface with a coupling and a reference point in model axes; `None` for the mean of the nodes.
    pub fn coupled_interface(
        mut self,
        name: impl Into<String>,
        nodes: Vec<i64>,
        coupling: Coupling,
        reference: Option<[f64; 3]>,
    ) -> Self {
        let coupling = Some(coupling);
        let reference = reference.map_or(Reference::Centre, Reference::Point);
        self.raw.data.interfaces.push(NodeSet { coupling, reference, ..NodeSet::new(name, nodes) });
        self
    }

    /// Adds an interface with the nodes of a region, in the words of `--interface` of the command line
    /// (docs/reference/input.md): `cylinder:0/0/0:0/0/10:5`. Nodes without stiffness and mass do not count.
    /// [`ModelBuilder::build`] finds the nodes.
    ///
    /// * `coupling`: `None` for a named node set.
    /// * `reference`: reference point in model axes; `None` for a point on the axis of a cylinder, and the centre of the
    ///   interface of other regions.
    pub fn interface_in(
        mut self,
        name: impl Into<String>,
        region: impl Into<String>,
        coupling: Option<Coupling>,
        reference: Option<[f64; 3]>,
    ) -> Self {
        let reference = reference.map(Reference::Point);
        self.regions.push(GivenRegion { name: name.into(), region: region.into(), coupling, reference });
        self
    }

    /// Declares a plane model: nodes lie in z = 0 and have rows x and y (directions 1, 2 and the rotation 6).
    pub fn plane(mut self) -> Self {
        self.raw.dimension = 2;
        self
    }

    /// Sets the loads whose static responses join free modes as residual vectors: unit forces and torques at every
    /// interface, centrifugal loads, or both.
    pub fn residual_vectors(mut self, interfaces: bool, centrifugal: bool) -> Self {
        let loads = [(centrifugal, LoadSource::Centrifugal), (interfaces, LoadSource::Interfaces)];
        self.residual_vectors =
            loads.into_iter().filter_map(|(wanted, load)| wanted.then_some(load)).collect();
        self
    }

    /// Sets one damping ratio for all modes.
    pub fn damping_ratio(mut self, ratio: f64) -> Self {
        self.raw.data.damping = Some(Damping::Ratio(ratio));
        self
    }

    /// Sets damping ratios of modes by frequency: (end in hertz, ratio), with ascending ends, the last
    /// [`f64::INFINITY`]. A mode belongs to the first band whose end its frequency does not exceed. Invalid bands are
    /// refused by [`ModelBuilder::build`].
    pub fn damping_bands(mut self, bands: &[(f64, f64)]) -> Self {
        let band = |&(to_hz, ratio): &(f64, f64)| DampingBand { to_hz, ratio };
        self.raw.data.damping = Some(Damping::Bands(bands.iter().map(band).collect()));
        self
    }

    /// Sets Rayleigh damping D = alpha M + beta K. Units: 1/time, time.
    pub fn rayleigh_damping(mut self, alpha: f64, beta: f64) -> Self {
        self.raw.data.damping = Some(Damping::Rayleigh { alpha, beta });
        self
    }

    /// Sets a damping matrix with the rows of K. Unit: mass/time.
    pub fn damping_matrix(mut self, damping: SparseMatrix) -> Self {
        let matrix = RawMatrix { matrix: damping.0, digits: 17, path: PathBuf::new() };
        self.raw.data.damping = Some(Damping::Matrix(matrix));
        self
    }

    /// Treats implausible densities, mass coupling between nodes without stiffness, and stresses of recoveries that
    /// contradict the stiffness, as warnings instead of errors.
    pub fn allow_implausible(mut self) -> Self {
        self.raw.allow_implausible = self.raw.allow_implausible.and(true.into());
        self
    }

    /// Treats the findings of single checks as warnings instead of errors: codes of the errors FB410 (rotations strain
    /// the stiffness), FB433 (mass without stiffness), FB437 (density) or FB460 (stresses), separated by commas.
    ///
    /// # Errors
    /// FB801 for another code.
    pub fn accept(mut self, codes: &str) -> Result<Self> {
        let accepted = Accepted::from_codes(codes).map_err(|code| {
            let message = format!("findings of the check `{code}` cannot be accepted");
            Diagnostic::new(Code::Usage, message).with_help(format!("use one of {}", Accepted::possible()))
        })?;
        self.raw.allow_implausible = self.raw.allow_implausible.and(accepted);
        Ok(self)
    }

    /// Leaves rotations that only elements that are not quite coplanar hold as K has them, as shells without
    /// drilling stiffness have them about their normals. By default they follow the nodes around them.
    pub fn keep_soft_rotations(mut self) -> Self {
        self.raw.keep_soft_rotations = true;
        self
    }

    /// Checks the model.
    ///
    /// # Errors
    /// FB220 and FB801 for an invalid region; FB305 to FB439 for errors of matrices, nodes and interfaces,
    /// all errors of a stage together.
    pub fn build(mut self) -> Result<Model> {
        for given in std::mem::take(&mut self.regions) {
            let GivenRegion { name, region, coupling, reference } = given;
            let mut interface = InterfaceSource::named(&name, &region, coupling, self.raw.dimension)?;
            interface.reference = reference.unwrap_or(interface.reference);
            let set = interface_in_memory(&interface, &self.raw)?;
            self.raw.data.interfaces.push(set);
        }
        Model::checked(self.raw, self.residual_vectors)
    }
}
