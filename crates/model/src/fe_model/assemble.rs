//! Conversion from a model as delivered by the readers to matrices in the internal order, with the checks
//! of matrices and tables by themselves.

use crate::directors::followers::GivenFollowers;
use crate::fe_model::drilling::{Following, with_following_rotations};
use crate::fe_model::layout::{Layout, layout};
use crate::fe_model::origin::Origin;
use crate::fe_model::references::resolve_references;
use crate::geometric_stiffness::check_loads;
use crate::named_load::checked_loads;
use crate::recovery::{RowsOfFiles, checked_recoveries};
use crate::rounding::rounding;
use crate::rows::{extents, rigid_count};
use crate::wording::name_some;
use crate::{
    Damping, DependentRow, DofLabel, GeometricStiffness, GivenRows, ModelData, NodeSet, Nodes, RawMatrix,
    RawModel, Rows, SoftRotations, SurfaceMesh,
};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Result, stop_on_error};
use flexbody_linalg::{CscMatrix, SymmetricMatrix, parallel};
use std::collections::{BTreeSet, HashSet};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Name of geometric stiffness in messages.
const GEOMETRIC_STIFFNESS: &str = "geometric stiffness";

/// Checks the matrices and tables by themselves and converts them to the internal order; also returns the
/// warnings and notes so far.
pub(crate) fn assemble(mut raw: RawModel) -> Result<(Assembled, Vec<Diagnostic>)> {
    let mut found = std::mem::take(&mut raw.diagnostics);
    check_as_read(&raw, &mut found);
    stop_on_error(&mut found)?;
    let layout = layout(&raw, &mut found);
    stop_on_error(&mut found)?;
    let layout = layout.expect("a missing layout comes with an error");
    let nodes = layout.used_nodes(&raw.nodes);
    check_tables(&mut raw, &nodes, &mut found);
    let mesh = mesh_of_used(&mut raw, &nodes, &mut found);
    stop_on_error(&mut found)?;
    let mut order = InternalOrder { layout: &layout, nodes: &nodes, found: &mut found };
    let stiffness = order.symmetric(&mut raw.stiffness, "stiffness");
    let mass = order.symmetric(&mut raw.mass, "mass");
    let data = order.data(&mut raw.data, &raw.given_rows, mesh);
    stop_on_error(&mut found)?;
    let (Some(stiffness), Some(mass)) = (stiffness, mass) else {
        unreachable!("an asymmetric matrix is an error")
    };
    let label = |row: usize| layout.rows.label(&nodes, row);
    check_diagonal(&stiffness, "stiffness", &raw.stiffness.path, label, &mut found);
    check_diagonal(&mass, "mass", &raw.mass.path, label, &mut found);
    found.extend(check_magnitudes(&stiffness, &mass, &nodes, &raw));
    stop_on_error(&mut found)?;
    (raw.nodes, raw.dofs) = (Nodes::default(), None);
    let given_rows = std::mem::take(&mut raw.given_rows);
    let followers = raw.followers.take().map(|raw| {
        let to_internal = layout.row_to_internal.clone();
        GivenFollowers { raw: Arc::new(raw), to_internal }
    });
    let row_to_internal = (!layout.is_identity()).then_some(layout.row_to_internal);
    let rows = layout.rows;
    let following = with_following_rotations(&raw, &rows, &nodes, stiffness, mass);
    found.extend(following.found);
    let Following { stiffness, mass, soft, .. } = following;
    check_empty_rows([&stiffness, &mass], |row| rows.label(&nodes, row), &raw, &mut found);
    stop_on_error(&mut found)?;
    #[cfg(debug_assertions)]
    let [stiffness, mass] = crate::test_rounding::rounded([stiffness, mass]);
    let body = Assembled {
        data,
        origin: Origin::from(raw),
        nodes,
        rows,
        given_rows,
        stiffness,
        mass,
        soft,
        followers,
        row_to_internal,
    };
    Ok((body, found))
}

/// Checks the matrices before their rows are known, and the numbers beside them.
fn check_as_read(raw: &RawModel, diagnostics: &mut Vec<Diagnostic>) {
    check_matrix(&raw.stiffness, "stiffness", diagnostics);
    check_matrix(&raw.mass, "mass", diagnostics);
    let (nk, nm) = (raw.stiffness.matrix.n_cols(), raw.mass.matrix.n_cols());
    if nk != nm {
        let message = format!("stiffness matrix has {nk} rows, mass matrix {nm}");
        diagnostics.push(Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(&raw.mass.path));
    }
    if !(2..=3).contains(&raw.dimension) {
        let message = format!("`dimension` is {}, expected 2 or 3", raw.dimension);
        diagnostics.push(Diagnostic::new(Code::ManifestSyntax, message));
    }
    if let Some(problem) = raw.data.damping.as_ref().and_then(Damping::problem) {
        diagnostics.push(Diagnostic::new(Code::ManifestSyntax, problem));
    }
    let damping = raw.data.damping.as_ref().and_then(Damping::matrix).map(|matrix| (matrix, "damping"));
    let geometric =
        raw.data.geometric_stiffness.iter().map(|stiffness| (&stiffness.matrix, GEOMETRIC_STIFFNESS));
    for (other, name) in damping.into_iter().chain(geometric) {
        check_matrix(other, name, diagnostics);
        let rows = other.matrix.n_cols();
        if rows != nk {
            let message = format!("stiffness matrix has {nk} rows, {name} matrix {rows}");
            diagnostics.push(Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(&other.path));
        }
    }
}

/// Checks the tables for the `nodes` that have rows: positions, interfaces with their reference points,
/// loads.
fn check_tables(raw: &mut RawModel, nodes: &Nodes, diagnostics: &mut Vec<Diagnostic>) {
    check_places(raw, nodes, diagnostics);
    check_names(raw, diagnostics);
    resolve_references(raw, nodes, diagnostics);
    check_members(raw, nodes, diagnostics);
    let dimension = usize::from(raw.dimension);
    check_loads(&raw.data.geometric_stiffness, &raw.data.interfaces, dimension, diagnostics);
    let rows = raw.stiffness.matrix.n_cols();
    if rows <= rigid_count(dimension) {
        let message = format!("model has {rows} degrees of freedom");
        diagnostics.push(Diagnostic::new(Code::ModelTooSmall, message));
    }
}

/// Returns the surface on the `nodes` that have rows; adds a diagnostic about triangles that are lost with
/// other nodes, since they leave holes.
fn mesh_of_used(raw: &mut RawModel, nodes: &Nodes, diagnostics: &mut Vec<Diagnostic>) -> Option<SurfaceMesh> {
    let mesh = raw.data.mesh.take()?;
    if mesh.least_nodes() > raw.nodes.len() {
        let message = format!("mesh has {} nodes, the node table {}", mesh.least_nodes(), raw.nodes.len());
        diagnostics.push(Diagnostic::new(Code::MeshForeign, message));
        return None;
    }
    let used = mesh.among(&raw.nodes.ids, &nodes.ids);
    let left = used.as_ref().map_or(0, |used| used.triangles().len());
    let all = mesh.triangles().len();
    if left < all {
        let message = format!(
            "{} of {all} triangles have nodes without degrees of freedom: they are not drawn",
            all - left
        );
        diagnostics.push(Diagnostic::new(Code::MeshPartial, message));
    }
    used
}

/// Checks that coordinates are finite, and that those of a plane model lie in its plane.
fn check_places(raw: &RawModel, nodes: &Nodes, diagnostics: &mut Vec<Diagnostic>) {
    if nodes.positions.iter().flatten().any(|x| !x.is_finite()) {
        let message = "a node coordinate is not a finite number";
        diagnostics.push(Diagnostic::new(Code::CoordinateNotFinite, message).in_file(&raw.nodes_path));
    }
    if let Some(i) = nodes.positions.iter().position(|x| raw.dimension == 2 && x[2] != 0.0) {
        let message = format!("node {} of a plane model has z = {}", nodes.ids[i], nodes.positions[i][2]);
        diagnostics.push(Diagnostic::new(Code::DirectionOutOfPlane, message).in_file(&raw.nodes_path));
    }
}

/// Checks that interfaces refer to nodes that have rows.
fn check_members(raw: &RawModel, nodes: &Nodes, diagnostics: &mut Vec<Diagnostic>) {
    let known: HashSet<i64> = nodes.ids.iter().copied().collect();
    let placed: HashSet<i64> = raw.nodes.ids.iter().copied().collect();
    for set in &raw.data.interfaces {
        let others = set.nodes.iter().filter(|id| !known.contains(id)).copied();
        let (at_rest, unknown): (Vec<i64>, Vec<i64>) = others.partition(|id| placed.contains(id));
        for (members, what) in [(unknown, "unknown nodes"), (at_rest, "nodes without stiffness and mass")] {
            if !members.is_empty() {
                let (count, named) = (members.len(), name_some(&members));
                let message = format!("interface `{}` names {count} {what}: {named}", set.name);
                diagnostics.push(Diagnostic::new(Code::InterfaceNode, message));
            }
        }
        diagnostics.extend(refuse_dependent_members(set, raw.given_rows.dependent()));
    }
}

/// Returns an error for an interface with nodes that follow others by constraints: a load on such a node acts on the
/// nodes that it follows, and a motion of the node is theirs.
fn refuse_dependent_members(set: &NodeSet, dependent: &[DependentRow]) -> Option<Diagnostic> {
    let members: HashSet<i64> = set.nodes.iter().copied().collect();
    let of_members: Vec<&DependentRow> =
        dependent.iter().filter(|row| members.contains(&row.label.node)).collect();
    let sorted = |nodes: &mut dyn Iterator<Item = i64>| nodes.collect::<BTreeSet<i64>>();
    let nodes = sorted(&mut of_members.iter().map(|row| row.label.node));
    let leaders = sorted(&mut of_members.iter().flat_map(|row| &row.leaders).map(|label| label.node));
    let [nodes, leaders] = [nodes, leaders].map(|nodes| nodes.into_iter().collect::<Vec<i64>>());
    (!nodes.is_empty()).then(|| {
        let message = format!(
            "interface `{}` names {} nodes with directions that follow other nodes by constraints of the deck: {}",
            set.name,
            nodes.len(),
            name_some(&nodes)
        );
        let help = format!("name the nodes that they follow instead: {}", name_some(&leaders));
        Diagnostic::new(Code::InterfaceNode, message).with_help(help)
    })
}

/// Conversion of the matrices of a model to the internal order, one after the other: each is released
/// before the next is copied.
struct InternalOrder<'o> {
    layout: &'o Layout,
    nodes: &'o Nodes,
    found: &'o mut Vec<Diagnostic>,
}

impl InternalOrder<'_> {
    /// Converts the data of a model, with its surface on the nodes that have rows. The loads, files and digits of
    /// geometric stiffness stay in `given`.
    fn data(
        &mut self,
        given: &mut ModelData<RawMatrix>,
        given_rows: &GivenRows,
        mesh: Option<SurfaceMesh>,
    ) -> ModelData<SymmetricMatrix> {
        let damping = given.damping.take().and_then(|damping| self.damping(damping));
        let geometric_stiffness = self.geometric_stiffness(&mut given.geometric_stiffness);
        let to = &self.layout.row_to_internal;
        let of_files = RowsOfFiles { given: given_rows, matrix_rows: to.len(), to };
        let asked = std::mem::take(&mut given.recoveries);
        let recoveries = checked_recoveries(asked, &of_files, self.nodes, self.found);
        let loads = std::mem::take(&mut given.named_loads);
        let interfaces = std::mem::take(&mut given.interfaces);
        let named_loads = checked_loads(loads, &of_files, &interfaces, &self.layout.rows, self.found);
        ModelData {
            description: std::mem::take(&mut given.description),
            interfaces,
            mesh,
            damping,
            geometric_stiffness,
            recoveries,
            nodal_stresses: std::mem::take(&mut given.nodal_stresses),
            named_loads,
            elements: given.elements.take(),
            sources: std::mem::take(&mut given.sources),
        }
    }

    /// Takes a matrix out of `raw` and returns it; `None` with a diagnostic if it is not symmetric.
    fn symmetric(&mut self, raw: &mut RawMatrix, name: &str) -> Option<SymmetricMatrix> {
        let (layout, nodes) = (self.layout, self.nodes);
        symmetric(raw, layout, name, |row| layout.rows.label(nodes, row), self.found)
    }

    /// Converts damping; `None` if its matrix is invalid, which an error reports.
    fn damping(&mut self, damping: Damping<RawMatrix>) -> Option<Damping<SymmetricMatrix>> {
        let (layout, nodes) = (self.layout, self.nodes);
        let mut ordered = |mut matrix: RawMatrix| {
            let symmetric = self.symmetric(&mut matrix, "damping")?;
            let label = |row| layout.rows.label(nodes, row);
            check_diagonal(&symmetric, "damping", &matrix.path, label, self.found);
            Some(symmetric)
        };
        damping.try_map(|matrix| ordered(matrix).ok_or(())).ok()
    }

    /// Converts geometric stiffness, which may have negative diagonal entries; files and digits stay in
    /// `given`.
    fn geometric_stiffness(
        &mut self,
        given: &mut [GeometricStiffness<RawMatrix>],
    ) -> Vec<GeometricStiffness<SymmetricMatrix>> {
        let ordered = |stiffness: &mut GeometricStiffness<RawMatrix>| {
            let matrix = self.symmetric(&mut stiffness.matrix, GEOMETRIC_STIFFNESS)?;
            Some(GeometricStiffness { load: stiffness.load.clone(), matrix })
        };
        given.iter_mut().filter_map(ordered).collect()
    }
}

/// Checks for names that no file can hold, before a long run instead of after it.
fn check_names(raw: &RawModel, diagnostics: &mut Vec<Diagnostic>) {
    let mut seen = HashSet::new();
    for set in &raw.data.interfaces {
        let name = &set.name;
        let wrong = match name.as_str() {
            "" => Some("an interface has no name".to_owned()),
            _ if !seen.insert(name) => Some(format!("interface `{name}` is given twice")),
            _ if name.len() > 200 || name.chars().any(char::is_control) => Some(format!(
                "interface name `{}` is longer than 200 bytes or has control characters in it",
                name.escape_debug()
            )),
            _ if set.nodes.is_empty() => Some(format!("interface `{name}` has no nodes")),
            _ => None,
        };
        diagnostics.extend(wrong.map(|message| Diagnostic::new(Code::ManifestSyntax, message)));
    }
    for (field, _) in raw.data.description.texts().iter().filter(|(_, text)| text.contains('\0')) {
        let message = format!("the model {field} has a NUL character in it");
        diagnostics.push(Diagnostic::new(Code::ManifestSyntax, message));
    }
}

// Conditions on each matrix by itself: finite, symmetric to rounding, no negative diagonal entry.

/// Adds an error for a matrix that is not square, empty, or not finite.
fn check_matrix(raw: &RawMatrix, name: &str, diagnostics: &mut Vec<Diagnostic>) {
    let matrix = &raw.matrix;
    if matrix.n_rows() != matrix.n_cols() {
        let message = format!("{name} matrix has {} rows and {} columns", matrix.n_rows(), matrix.n_cols());
        diagnostics.push(Diagnostic::new(Code::MatrixNotSquare, message).in_file(&raw.path));
    } else if matrix.nnz() == 0 {
        let message = format!("{name} matrix has no nonzero entries");
        diagnostics.push(Diagnostic::new(Code::MatrixEmpty, message).in_file(&raw.path));
    }
    let not_finite = |values: &[f64]| values.iter().any(|v| !v.is_finite());
    if parallel::any(matrix.values().chunks(1 << 16), not_finite) {
        let at = matrix.values().iter().position(|v| !v.is_finite()).expect("just found");
        let column = matrix.col_ptr().partition_point(|&p| p <= at);
        let message = format!(
            "{name} matrix has {} in row {}, column {column}",
            matrix.values()[at],
            matrix.row_idx()[at] + 1
        );
        diagnostics.push(Diagnostic::new(Code::MatrixNotFinite, message).in_file(&raw.path));
    }
}

/// Takes a matrix out of `raw` and returns it symmetric and in internal order; `None` with a diagnostic if
/// it is not symmetric to rounding.
fn symmetric(
    raw: &mut RawMatrix,
    layout: &Layout,
    name: &str,
    label: impl Fn(usize) -> DofLabel,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<SymmetricMatrix> {
    let matrix = std::mem::take(&mut raw.matrix);
    let ordered = if layout.is_identity() { matrix } else { matrix.permuted(&layout.row_to_internal) };
    let ordered = match SymmetricMatrix::try_from(ordered) {
        Ok(symmetric) => return Some(symmetric),
        Err(ordered) => ordered,
    };
    let n = ordered.n_cols();
    let Asymmetry { worst, at, one_sided } = Asymmetry::of(&ordered);
    if worst > rounding(raw.digits, 2) {
        let (i, j) = at;
        let message = format!(
            "{name} matrix is not symmetric: {} at ({}, {}), {} at the mirrored place",
            ordered.get(i, j),
            label(i),
            label(j),
            ordered.get(j, i)
        );
        let mut diagnostic = Diagnostic::new(Code::MatrixAsymmetric, message).in_file(&raw.path);
        if one_sided * 2 >= ordered.nnz().saturating_sub(n) * 2 && one_sided > 0 {
            diagnostic = diagnostic.with_help("declare the matrix symmetric: only one triangle is stored");
        }
        diagnostics.push(diagnostic);
        return None;
    }
    Some(SymmetricMatrix::symmetrised(ordered))
}

/// Difference between a matrix and its transpose.
#[derive(Clone, Copy, Default)]
struct Asymmetry {
    /// Largest difference relative to the size of the entries or of their diagonal entries, and the first
    /// entry with this difference.
    worst: f64,
    at: (usize, usize),
    /// Number of entries without a mirrored entry.
    one_sided: usize,
}

impl Asymmetry {
    fn of(matrix: &CscMatrix) -> Self {
        /// Number of columns per parallel task.
        const COLUMNS_PER_TASK: usize = 256;
        let n = matrix.n_cols();
        let size: Vec<f64> = (0..n).map(|i| matrix.get(i, i).abs().sqrt()).collect();
        let of_column = |j: usize| {
            let mut task = Self::default();
            let (rows, values) = matrix.column(j);
            for (&i, &v) in rows.iter().zip(values) {
                let i = i as usize;
                let other = matrix.get(j, i);
                task.one_sided += usize::from(other == 0.0);
                // An entry larger than the root of its diagonal entries, which occurs in indefinite
                // matrices only, is compared with itself.
                let scale = (size[i] * size[j]).max(v.abs()).max(other.abs());
                let difference = (v - other).abs() / scale;
                if difference > task.worst {
                    (task.worst, task.at) = (difference, (i, j));
                }
            }
            task
        };
        let of_columns = |columns: Range<usize>| columns.map(of_column).fold(Self::default(), Self::and);
        let parts = parallel::map(parallel::ranges(n, COLUMNS_PER_TASK), of_columns);
        parts.into_iter().fold(Self::default(), Self::and)
    }

    /// Combines the results of some columns and of the columns after them.
    fn and(self, next: Self) -> Self {
        let first = if next.worst > self.worst { next } else { self };
        Self { one_sided: self.one_sided + next.one_sided, ..first }
    }
}

fn check_empty_rows(
    matrices: [&SymmetricMatrix; 2],
    label: impl Fn(usize) -> DofLabel,
    raw: &RawModel,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let is_empty = |&row: &usize| matrices.iter().all(|matrix| matrix.row(row).0.is_empty());
    let both: Vec<DofLabel> = (0..matrices[0].n()).filter(is_empty).map(label).collect();
    if !both.is_empty() {
        let message = format!("{} rows are empty in both matrices: {}", both.len(), name_some(&both));
        diagnostics.push(Diagnostic::new(Code::PencilSingular, message).in_file(&raw.stiffness.path));
    }
}

fn check_diagonal(
    matrix: &SymmetricMatrix,
    name: &str,
    path: &Path,
    label: impl Fn(usize) -> DofLabel,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let negative: Vec<DofLabel> =
        matrix.diagonal().iter().enumerate().filter(|(_, d)| **d < 0.0).map(|(i, _)| label(i)).collect();
    if !negative.is_empty() {
        let message = format!(
            "{} diagonal entries of the {name} matrix are negative: {}",
            negative.len(),
            name_some(&negative)
        );
        diagnostics.push(Diagnostic::new(Code::DiagonalNegative, message).in_file(path));
    }
}

/// Largest size, and reciprocal of the smallest, of a quantity: squares of all quantities then stay
/// twenty-eight decades within the range of double precision, a margin for modes and rounding errors.
const MAX_MAGNITUDE: f64 = 1e140;

/// Returns an error if K, M, the size of the body, or quantities derived from them are so large or small
/// that products overflow or vanish.
fn check_magnitudes(
    stiffness: &SymmetricMatrix,
    mass: &SymmetricMatrix,
    nodes: &Nodes,
    raw: &RawModel,
) -> Option<Diagnostic> {
    let largest = |m: &SymmetricMatrix| {
        let of_part = |part: &[f64]| part.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        parallel::map(m.as_csc().values().chunks(1 << 16), of_part).into_iter().fold(0.0, f64::max)
    };
    let (k, m) = (largest(stiffness), largest(mass));
    let far = nodes.positions.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let size = extents(&nodes.positions).into_iter().fold(0.0, f64::max);
    if [k, m, size].contains(&0.0) {
        return None; // other checks report zeros
    }
    let (stiffness_file, mass_file, nodes_file) = (&raw.stiffness.path, &raw.mass.path, &raw.nodes_path);
    let quantities = [
        ("stiffness", k, stiffness_file),
        ("mass", m, mass_file),
        ("length", size, nodes_file),
        ("distance from the origin", far.max(size), nodes_file),
        ("stiffness / mass", k / m, mass_file),
        ("mass length^2", m * size * size, mass_file),
    ];
    let fits = |value: f64| (MAX_MAGNITUDE.recip()..=MAX_MAGNITUDE).contains(&value);
    let (name, value, file) = quantities.into_iter().find(|&(_, value, _)| !fits(value))?;
    let message = format!(
        "{name} is of the order of {value:.0e}, not within {:.0e} and {MAX_MAGNITUDE:.0e}",
        MAX_MAGNITUDE.recip()
    );
    Some(Diagnostic::new(Code::MagnitudeExtreme, message).in_file(file))
}

/// Model in the internal order whose matrices are valid by themselves.
pub(crate) struct Assembled {
    /// Data in the internal order; the surface is on `nodes`.
    pub data: ModelData<SymmetricMatrix>,
    /// Files, for messages and tolerances.
    pub origin: Origin,
    /// Nodes with degrees of freedom.
    pub nodes: Nodes,
    /// Meaning of the rows; the motion of rows without a position is not known yet.
    pub rows: Rows,
    /// Maps for shapes and loads from the rows of the files to the rows of K and M as read.
    pub given_rows: GivenRows,
    /// K.
    pub stiffness: SymmetricMatrix,
    /// M.
    pub mass: SymmetricMatrix,
    /// Rotations that K holds by misaligned elements only, with the terms of K that make them follow.
    pub soft: SoftRotations,
    /// Points with mass that follow nodes by constraints.
    pub followers: Option<GivenFollowers>,
    /// Internal row of each matrix row, `u32::MAX` for rows that are left out; `None` if the orders are
    /// equal, or for one of several bodies.
    pub row_to_internal: Option<Vec<u32>>,
}

impl Assembled {
    /// Returns true if the numbers can be compared with real materials: units are stated, or the model
    /// comes from files, whose numbers default to m, kg, s. Matrices in memory without units may be
    /// dimensionless.
    pub(crate) fn has_units(&self) -> bool {
        self.data.description.units.stated || !self.origin.stiffness.path.as_os_str().is_empty()
    }
}
