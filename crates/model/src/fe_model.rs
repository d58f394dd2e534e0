//! Checked model: every used node has d displacements (d: the dimension), and row d i + k is direction k of
//! node i; other rows follow in the order of [`Rows`].

pub(crate) mod assemble;
pub(crate) mod drilling;
pub(crate) mod element_around;
pub(crate) mod inertial_rows;
pub(crate) mod layout;
pub(crate) mod nodal_stress;
pub(crate) mod origin;
pub(crate) mod proved_elements;
pub(crate) mod raw;
pub(crate) mod references;
pub(crate) mod soft_rotations;

use crate::directors::mass_structure::MassForm;
use crate::fe_model::assemble::Assembled;
use crate::{
    BodyNumber, Damping, Description, DirectorMass, DofLabel, Followers, GeometricStiffness, GivenRows,
    ModelData, ModelLoad, ModelRecovery, NodalStress, NodeSet, Nodes, Rows, SoftRotations, SurfaceMesh,
};
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::provenance::SourceFile;
use flexbody_base::units::UnitSystem;
use flexbody_elements::ProvedElements;
use flexbody_linalg::{CscMatrix, EliminationOrder, Pencil, SymmetricMatrix, larger};
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// Checked free body. Internal order of degrees of freedom: node-major x, y, z (in the plane x, y) in the
/// order of `nodes`, then the other rows given by [`rows`](FeModel::rows).
#[derive(Debug, Clone)]
pub struct FeModel {
    data: ModelData<SymmetricMatrix>,
    nodes: Nodes,
    rows: Rows,
    stiffness: SymmetricMatrix,
    soft_rotations: Arc<SoftRotations>,
    /// Ms, or its closest approximation.
    mean_mass: SymmetricMatrix,
    /// M, if it is not Ms kron I_d.
    whole_mass: Option<SymmetricMatrix>,
    commutes: bool,
    /// True if M equals Ms kron I_d exactly.
    exact_scalar_mass: bool,
    digits: u8,
    rigid_residual: f64,
    mass_deviation: f64,
    /// Part of the mass that does not turn with the nodes; zero if it is rounding.
    fixed_mass_share: f64,
    diagonal_mass: bool,
    /// Internal row of each matrix row, `u32::MAX` for rows that are left out; `None` if the orders are
    /// equal.
    row_to_internal: Option<Vec<u32>>,
    given_rows: Arc<GivenRows>,
    elimination: EliminationOrder,
    /// Points with mass that follow nodes, if M is not Ms kron I_d.
    followers: Option<Arc<Followers>>,
    /// M on points and directors, computed on demand.
    director_mass: OnceLock<Option<Arc<DirectorMass>>>,
    /// Elements that K proves, or the reasons why it does not, found on demand.
    proved: OnceLock<std::result::Result<Arc<ProvedElements>, Vec<Diagnostic>>>,
}

impl FeModel {
    pub(crate) fn new(body: Assembled, form: MassForm, rigid_residual: f64, diagonal_mass: bool) -> Self {
        let Assembled { data, nodes, rows, stiffness, mass, soft, .. } = body;
        let scalar = form.commutes && rows.len() == rows.displacements();
        Self {
            data,
            nodes,
            rows,
            stiffness,
            soft_rotations: Arc::new(soft),
            mean_mass: form.scalar,
            whole_mass: (!scalar).then_some(mass),
            commutes: form.commutes,
            exact_scalar_mass: form.commutes && form.exact,
            digits: body.origin.stiffness.digits,
            rigid_residual,
            mass_deviation: form.deviation,
            fixed_mass_share: 0.0,
            diagonal_mass,
            row_to_internal: body.row_to_internal,
            given_rows: Arc::new(body.given_rows),
            elimination: EliminationOrder::default(),
            followers: None,
            director_mass: OnceLock::new(),
            proved: OnceLock::new(),
        }
    }

    /// Returns the model with points that follow its nodes. If the mass commutes with rotations, the points are
    /// not needed: their mass is that of points at rest between the nodes.
    pub(crate) fn with_followers(self, followers: Option<Followers>) -> Self {
        let followers = followers.filter(|_| !self.commutes).map(Arc::new);
        Self { followers, ..self }
    }

    /// Returns the points with mass that follow nodes by constraints and turn with them.
    pub fn followers(&self) -> Option<&Followers> {
        self.followers.as_deref()
    }

    /// Returns the nodes of a body made of the model: those of the model, then the points that follow them.
    pub fn nodes_of_body(&self) -> Cow<'_, Nodes> {
        let Some(followers) = &self.followers else { return Cow::Borrowed(&self.nodes) };
        let (mut nodes, points) = (self.nodes.clone(), followers.points());
        nodes.ids.extend(&points.ids);
        nodes.positions.extend(&points.positions);
        Cow::Owned(nodes)
    }

    /// Returns the index among [`nodes_of_body`](Self::nodes_of_body) of a node of [`DirectorMass::nodes`].
    pub fn node_of_body(&self, node: u32) -> usize {
        let (node, nodes) = (node as usize, self.nodes.len());
        if node < nodes { node } else { node - self.rows.vectors() }
    }

    /// Returns true if a body made of the model has rotations of nodes.
    pub fn has_rotations(&self) -> bool {
        !self.rows.rotations().is_empty() || self.followers.as_ref().is_some_and(|points| points.turn())
    }

    /// Returns name and units of the model.
    pub fn description(&self) -> &Description {
        &self.data.description
    }

    /// Returns the name of the model.
    pub fn name(&self) -> &str {
        &self.data.description.name
    }

    /// Returns the number of displacements per node: 3, or 2 for a body in the plane.
    pub fn dimension(&self) -> usize {
        self.rows.dimension
    }

    /// Returns the units of all numbers.
    pub fn units(&self) -> &UnitSystem {
        &self.data.description.units
    }

    /// Returns the nodes with degrees of freedom, in the order of the node table.
    pub fn nodes(&self) -> &Nodes {
        &self.nodes
    }

    /// Returns the surface, by indices of the nodes, if elements are known.
    pub fn mesh(&self) -> Option<&SurfaceMesh> {
        self.data.mesh.as_ref()
    }

    /// Returns K: row d i + k for direction k of node i, then the other rows.
    pub fn stiffness(&self) -> &SymmetricMatrix {
        &self.stiffness
    }

    /// Returns the rotations that [`stiffness`](Self::stiffness) makes follow their elements although the
    /// matrix as read gives them a stiffness.
    pub fn soft_rotations(&self) -> &SoftRotations {
        &self.soft_rotations
    }

    /// Returns the model with its whole mass lumped: `masses` (one per node) at the displacements of the
    /// nodes, zero at other rows. Mass-proportional damping follows the new mass.
    ///
    /// # Panics
    /// When the number of masses is not the number of nodes.
    pub fn with_nodal_masses(&self, masses: &[f64]) -> Self {
        assert_eq!(masses.len(), self.nodes.len(), "one mass for each node");
        let d = self.dimension();
        let diagonal = |masses: &mut dyn Iterator<Item = f64>, rows: usize| {
            let entries: Vec<_> = masses.enumerate().map(|(i, mass)| (i as u32, i as u32, mass)).collect();
            let matrix = CscMatrix::from_triplets(rows, rows, &entries);
            SymmetricMatrix::new(matrix).expect("a diagonal matrix is symmetric")
        };
        let by_row = &mut masses.iter().flat_map(|mass| std::iter::repeat_n(*mass, d));
        Self {
            mean_mass: diagonal(&mut masses.iter().copied(), self.mean_mass.n()),
            whole_mass: (!self.rows.are_plain()).then(|| diagonal(by_row, self.rows.len())),
            commutes: true,
            exact_scalar_mass: true,
            mass_deviation: 0.0,
            fixed_mass_share: 0.0,
            diagonal_mass: true,
            elimination: EliminationOrder::default(),
            followers: None,
            director_mass: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Returns the meaning of the rows of the matrices.
    pub fn rows(&self) -> &Rows {
        &self.rows
    }

    /// Returns Ms with M = Ms kron I_d for the displacements of nodes and then of vectors without a
    /// position, if no other row carries mass. Returns `None` if M does not have this form.
    pub fn scalar_mass(&self) -> Option<&SymmetricMatrix> {
        self.commutes.then_some(&self.mean_mass)
    }

    /// Returns true if [`scalar_mass`](Self::scalar_mass) is the mass matrix as stored, and not the mean of
    /// directions that differ by rounding.
    pub fn has_exact_scalar_mass(&self) -> bool {
        self.exact_scalar_mass
    }

    /// Returns M on points and directors; `None` if no rotation of a node carries mass and no point follows
    /// nodes. Computed at the first call.
    pub fn director_mass(&self) -> Option<&Arc<DirectorMass>> {
        let made = || match &self.followers {
            Some(followers) => Some(Arc::new(DirectorMass::with_followers(followers, self.rows.len()))),
            None => DirectorMass::new(self.whole_mass.as_ref()?, &self.rows).map(Arc::new),
        };
        self.director_mass.get_or_init(made).as_ref()
    }

    /// Returns the mean over the directions of the mass between displacements of nodes (n x n), the input
    /// of lumping.
    pub fn nodal_mass(&self) -> Cow<'_, SymmetricMatrix> {
        let n = self.nodes.len();
        match self.rows.vectors() {
            0 => Cow::Borrowed(&self.mean_mass),
            _ => Cow::Owned(self.mean_mass.principal(&(0..n).collect::<Vec<_>>())),
        }
    }

    /// Returns the damping, if given; a matrix D has the rows of K.
    pub fn damping(&self) -> Option<&Damping<SymmetricMatrix>> {
        self.data.damping.as_ref()
    }

    /// Returns the geometric stiffness of unit loads along the axes of the model, if given, with the rows
    /// of K.
    pub fn geometric_stiffness(&self) -> &[GeometricStiffness<SymmetricMatrix>] {
        &self.data.geometric_stiffness
    }

    /// Returns the rows to read off the body; operators have the internal rows.
    pub fn recoveries(&self) -> &[ModelRecovery] {
        &self.data.recoveries
    }

    /// Returns the nodal forces with a name, by internal rows.
    pub fn named_loads(&self) -> &[ModelLoad] {
        &self.data.named_loads
    }

    /// Returns the elimination order shared by all factors of [`pencil`](Self::pencil).
    pub fn elimination(&self) -> &EliminationOrder {
        &self.elimination
    }

    /// Returns K and M.
    pub fn pencil(&self) -> Pencil<'_> {
        match &self.whole_mass {
            None => Pencil::new(&self.stiffness, &self.mean_mass, self.dimension()),
            Some(mass) => Pencil::new(&self.stiffness, mass, 1),
        }
    }

    /// Returns the rigid fields (one row per row of K) about `centre`: translations, then rotations divided
    /// by `length`. See [`Rows::rigid_fields`].
    pub fn rigid_fields(&self, centre: [f64; 3], length: f64) -> Mat<f64> {
        self.rows.rigid_fields(&self.nodes.positions, centre, length)
    }

    /// Returns the length of the longest displacement of a node for the displacements `u` of all rows.
    pub fn longest_displacement(&self, u: &[f64]) -> f64 {
        let d = self.dimension();
        let squares = u[..d * self.nodes.len()].chunks_exact(d).map(|u| u.iter().map(|u| u * u).sum::<f64>());
        squares.fold(0.0, larger).sqrt()
    }

    /// Adds a recovery in the internal order of rows.
    pub(crate) fn push_recovery(&mut self, recovery: ModelRecovery) {
        self.data.recoveries.push(recovery);
    }

    /// Takes the requests of stresses at nodes out of the model.
    pub(crate) fn take_nodal_stresses(&mut self) -> Vec<NodalStress> {
        std::mem::take(&mut self.data.nodal_stresses)
    }

    /// Returns the named node sets.
    pub fn interfaces(&self) -> &[NodeSet] {
        &self.data.interfaces
    }

    /// Computes the fingerprints of the files of the model that were not computed while reading.
    ///
    /// # Errors
    /// FB101, FB132 for a file that changed since it was read.
    pub(crate) fn find_sources(&self) -> Result<(), Diagnostic> {
        self.data.sources.find()
    }

    /// Returns the files that the model was read from.
    pub fn sources(&self) -> &[SourceFile] {
        &self.data.sources
    }

    /// Returns the significant decimal digits of the stiffness values.
    pub fn digits(&self) -> u8 {
        self.digits
    }

    /// Returns max over the rows of |K R| / sum |K|: the accuracy with which K annihilates rigid motion.
    pub fn rigid_residual(&self) -> f64 {
        self.rigid_residual
    }

    /// Returns the largest deviation of a mass block from a multiple of the identity, relative to
    /// sqrt(alpha_ii alpha_jj).
    pub fn mass_deviation(&self) -> f64 {
        self.mass_deviation
    }

    /// Returns the largest entry of the part of M that keeps the axes of the body while its nodes turn,
    /// relative to sqrt(M_ii M_jj): blocks of displacements that are no multiples of I and, for
    /// [`DirectorMass`], symmetric blocks between displacements and rotations. Zero if it is rounding.
    pub fn fixed_mass_share(&self) -> f64 {
        self.fixed_mass_share
    }

    /// Finds the part of M that does not turn; parts up to `rounding` count as zero.
    pub(crate) fn find_fixed_mass(&mut self, rounding: f64) {
        let share = match (self.scalar_mass(), &self.whole_mass) {
            (None, Some(_)) if self.followers.is_some() => {
                let followers = self.followers.as_ref().expect("there are some");
                DirectorMass::share(followers.mass(), followers.rows())
            }
            (None, Some(mass)) => DirectorMass::rest_share(mass, &self.rows).unwrap_or(self.mass_deviation),
            (None, None) => self.mass_deviation,
            (Some(_), _) => 0.0,
        };
        self.fixed_mass_share = if share > rounding { share } else { 0.0 };
    }

    /// Returns true if M is diagonal (lumped by the FE program).
    pub fn has_diagonal_mass(&self) -> bool {
        self.diagonal_mass
    }

    /// Returns the number of rows of the matrices as read, including rows that are empty in all matrices.
    pub fn matrix_rows(&self) -> usize {
        self.row_to_internal.as_ref().map_or(self.stiffness.n(), Vec::len)
    }

    /// Returns true if a row of the matrices as read has neither stiffness nor mass and is left out.
    pub fn is_left_out(&self, row: usize) -> bool {
        self.row_to_internal.as_ref().is_some_and(|to| to[row] == u32::MAX)
    }

    /// Returns columns given by the rows of the matrices as read, in the internal order.
    ///
    /// # Panics
    /// When the number of rows differs.
    pub fn in_internal_order(&self, columns: Mat<f64>) -> Mat<f64> {
        assert_eq!(columns.nrows(), self.matrix_rows(), "rows of the matrices");
        let Some(to) = &self.row_to_internal else { return columns };
        let mut ordered = Mat::zeros(self.stiffness.n(), columns.ncols());
        for j in 0..columns.ncols() {
            for (row, &internal) in to.iter().enumerate().filter(|(_, internal)| **internal != u32::MAX) {
                ordered[(internal as usize, j)] = columns[(row, j)];
            }
        }
        ordered
    }

    /// Returns the maps for shapes and loads from the rows of the files to the rows of K and M as read.
    pub fn given_rows(&self) -> &GivenRows {
        &self.given_rows
    }

    /// Returns the numbers of rows that shapes and loads may have: that of K, and those of other files.
    pub fn row_counts(&self) -> Vec<usize> {
        std::iter::once(self.matrix_rows()).chain(self.given_rows.counts()).collect()
    }

    /// Returns the number of this body if the matrices held several bodies; `None` for a model that was not
    /// split.
    pub fn number(&self) -> Option<BodyNumber> {
        self.data.description.number
    }

    /// Returns the label of an internal row.
    pub fn label(&self, row: usize) -> DofLabel {
        self.rows.label(&self.nodes, row)
    }
}
