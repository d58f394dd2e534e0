//! Conversion from a model as delivered by the readers to matrices in the internal order, with the checks
//! of matrices and tables by themselves.

use super::assembled::Assembled;
use super::drilling::{Following, with_following_rotations};
use super::layout::{Layout, layout};
use super::load_checks::check_loads;
use super::magnitude::check_magnitudes;
use super::matrix_checks::{check_diagonal, check_diagonals, check_matrix, symmetric};
use super::recovery_checks::{RowsOfFiles, checked_recoveries};
use super::references::resolve_references;
use super::rigid::rigid_count;
use super::wording::name_some;
use super::{Damping, GeometricStiffness, Nodes, RawMatrix, RawModel, SurfaceMesh};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Result, stop_on_error};
use flexbody_linalg::SymmetricMatrix;
use std::collections::HashSet;

/// Name of geometric stiffness in messages.
const GEOMETRIC_STIFFNESS: &str = "geometric stiffness";

/// Checks the matrices and tables by themselves and converts them to the internal order; also returns the
/// warnings and notes so far.
pub(super) fn assemble(mut raw: RawModel) -> Result<(Assembled, Vec<Diagnostic>)> {
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
    let damping = raw.damping.take().and_then(|damping| order.damping(damping));
    let geometric_stiffness = order.geometric_stiffness(&mut raw.geometric_stiffness);
    let matrix_rows = layout.row_to_internal.len();
    let of_files = RowsOfFiles { given: &raw.given_rows, matrix_rows, to: &layout.row_to_internal };
    let asked = std::mem::take(&mut raw.recoveries);
    let recoveries = checked_recoveries(asked, &of_files, &nodes, &mut found);
    stop_on_error(&mut found)?;
    let (Some(stiffness), Some(mass)) = (stiffness, mass) else {
        unreachable!("an asymmetric matrix is an error")
    };
    check_diagonals(&stiffness, &mass, |row| layout.rows.label(&nodes, row), &raw, &mut found);
    found.extend(check_magnitudes(&stiffness, &mass, &nodes, &raw));
    stop_on_error(&mut found)?;
    (raw.nodes, raw.dofs) = (Nodes::default(), None);
    let row_to_internal = (!layout.is_identity()).then_some(layout.row_to_internal);
    let rows = layout.rows;
    let Following { stiffness, mass, note } = with_following_rotations(&raw, &rows, &nodes, stiffness, mass);
    found.extend(note);
    let body = Assembled {
        raw,
        nodes,
        mesh,
        rows,
        stiffness,
        mass,
        row_to_internal,
        damping,
        geometric_stiffness,
        recoveries,
    };
    Ok((body, found))
}

/// Checks the matrices before their rows are known, and the numbers beside them.
fn check_as_read(raw: &RawModel, found: &mut Vec<Diagnostic>) {
    check_matrix(&raw.stiffness, "stiffness", found);
    check_matrix(&raw.mass, "mass", found);
    let (nk, nm) = (raw.stiffness.matrix.n_cols(), raw.mass.matrix.n_cols());
    if nk != nm {
        let message = format!("stiffness matrix has {nk} rows, mass matrix {nm}");
        found.push(Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(&raw.mass.path));
    }
    if !(2..=3).contains(&raw.dimension) {
        let message = format!("`dimension` is {}, expected 2 or 3", raw.dimension);
        found.push(Diagnostic::new(Code::ManifestSyntax, message));
    }
    if let Some(problem) = raw.damping.as_ref().and_then(Damping::problem) {
        found.push(Diagnostic::new(Code::ManifestSyntax, problem));
    }
    let damping = raw.damping.as_ref().and_then(Damping::matrix).map(|matrix| (matrix, "damping"));
    let geometric = raw.geometric_stiffness.iter().map(|one| (&one.matrix, GEOMETRIC_STIFFNESS));
    for (other, name) in damping.into_iter().chain(geometric) {
        check_matrix(other, name, found);
        let rows = other.matrix.n_cols();
        if rows != nk {
            let message = format!("stiffness matrix has {nk} rows, {name} matrix {rows}");
            found.push(Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(&other.path));
        }
    }
}

/// Checks the tables for the `nodes` that have rows: positions, interfaces with their reference points,
/// loads.
fn check_tables(raw: &mut RawModel, nodes: &Nodes, found: &mut Vec<Diagnostic>) {
    check_places(raw, nodes, found);
    check_names(raw, found);
    resolve_references(raw, nodes, found);
    check_members(raw, nodes, found);
    let dimension = usize::from(raw.dimension);
    check_loads(&raw.geometric_stiffness, &raw.interfaces, dimension, found);
    let rows = raw.stiffness.matrix.n_cols();
    if rows <= rigid_count(dimension) {
        let message = format!("model has {rows} degrees of freedom");
        found.push(Diagnostic::new(Code::ModelTooSmall, message));
    }
}

/// Returns the surface on the `nodes` that have rows; adds a diagnostic about triangles that are lost with
/// other nodes, since they leave holes.
fn mesh_of_used(raw: &mut RawModel, nodes: &Nodes, found: &mut Vec<Diagnostic>) -> Option<SurfaceMesh> {
    let mesh = raw.mesh.take()?;
    if mesh.least_nodes() > raw.nodes.len() {
        let message = format!("mesh has {} nodes, the node table {}", mesh.least_nodes(), raw.nodes.len());
        found.push(Diagnostic::new(Code::MeshForeign, message));
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
        found.push(Diagnostic::new(Code::MeshPartial, message));
    }
    used
}

/// Checks that coordinates are finite, and that those of a plane model lie in its plane.
fn check_places(raw: &RawModel, nodes: &Nodes, found: &mut Vec<Diagnostic>) {
    if nodes.positions.iter().flatten().any(|x| !x.is_finite()) {
        let message = "a node coordinate is not a finite number";
        found.push(Diagnostic::new(Code::CoordinateNotFinite, message).in_file(&raw.nodes_path));
    }
    if let Some(i) = nodes.positions.iter().position(|x| raw.dimension == 2 && x[2] != 0.0) {
        let message = format!("node {} of a plane model has z = {}", nodes.ids[i], nodes.positions[i][2]);
        found.push(Diagnostic::new(Code::DirectionOutOfPlane, message).in_file(&raw.nodes_path));
    }
}

/// Checks that interfaces refer to nodes that have rows.
fn check_members(raw: &RawModel, nodes: &Nodes, found: &mut Vec<Diagnostic>) {
    let known: HashSet<i64> = nodes.ids.iter().copied().collect();
    let placed: HashSet<i64> = raw.nodes.ids.iter().copied().collect();
    for set in &raw.interfaces {
        let others = set.nodes.iter().filter(|id| !known.contains(id)).copied();
        let (at_rest, unknown): (Vec<i64>, Vec<i64>) = others.partition(|id| placed.contains(id));
        for (members, what) in [(unknown, "unknown nodes"), (at_rest, "nodes without stiffness and mass")] {
            if !members.is_empty() {
                let (count, named) = (members.len(), name_some(&members));
                let message = format!("interface `{}` names {count} {what}: {named}", set.name);
                found.push(Diagnostic::new(Code::InterfaceNode, message));
            }
        }
    }
}

/// Conversion of the matrices of a model to the internal order, one after the other: each is released
/// before the next is copied.
struct InternalOrder<'o> {
    layout: &'o Layout,
    nodes: &'o Nodes,
    found: &'o mut Vec<Diagnostic>,
}

impl InternalOrder<'_> {
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
        let ordered = |one: &mut GeometricStiffness<RawMatrix>| {
            let matrix = self.symmetric(&mut one.matrix, GEOMETRIC_STIFFNESS)?;
            Some(GeometricStiffness { load: one.load.clone(), matrix })
        };
        given.iter_mut().filter_map(ordered).collect()
    }
}

/// Checks for names that no file can hold, before a long run instead of after it.
fn check_names(raw: &RawModel, found: &mut Vec<Diagnostic>) {
    let mut seen = HashSet::new();
    for set in &raw.interfaces {
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
        found.extend(wrong.map(|message| Diagnostic::new(Code::ManifestSyntax, message)));
    }
    if raw.name.contains('\0') {
        found.push(Diagnostic::new(Code::ManifestSyntax, "the model name has a NUL character in it"));
    }
}
