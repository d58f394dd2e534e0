//! What must hold before any work is done on a model: each failure named with its facts.

use super::density::{Densities, check_density};
use super::exchanged::check_exchanged_matrices;
use super::geometric_stiffness::{check_loads, missing_components};
use super::interface::resolve_references;
use super::layout::{Layout, layout, name_some};
use super::local_mass::{LocalMass, SoundSpeed, check_exchanged, check_speed};
use super::magnitude::check_magnitudes;
use super::mass_structure::{MassForm, mass_form};
use super::node_pairs::check_mass_pairs;
use super::placeless::{check_massless, misplaced, recover};
use super::rigid::{centre_and_length, extents, rigid_count, rigid_residuals};
use super::rigid_motion::{check_inertia, check_rigid_motion};
use super::{BodyNumber, Damping, DofLabel, FeModel, GeometricStiffness, Nodes, RawMatrix, RawModel, Rows};
use crate::base::diagnostic::{Code, Diagnostic, Severity};
use crate::base::error::{Error, Result};
use crate::numerics::linalg::SymmetricMatrix;
use rayon::prelude::*;
use std::collections::HashSet;
use std::path::Path;

/// Name of geometric stiffness in messages.
const GEOMETRIC: &str = "geometric stiffness";

/// A model that passed, with the warnings and notes on the way.
#[derive(Debug, Clone)]
pub struct CheckedModel {
    /// The model.
    pub model: FeModel,
    /// Warnings and notes, in the order found.
    pub diagnostics: Vec<Diagnostic>,
    /// What they say of the place and the size of the mass was judged by.
    pub plausibility: Plausibility,
}

/// How the mass fits the stiffness and the positions; in the units of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plausibility {
    /// Pairs of nodes that the mass couples.
    pub mass_pairs: usize,
    /// Those of them that the stiffness does not couple.
    pub foreign_pairs: usize,
    /// Pairs of nodes whose masses fit their stiffness only when exchanged.
    pub exchanged_pairs: usize,
    /// Speeds of sound; none where no motion stretches the body.
    pub sound_speed: Option<SoundSpeed>,
    /// Densities of solid elements; none where too few are recognised.
    pub densities: Option<Densities>,
}

/// Checks `raw` and brings it into the internal order.
///
/// # Errors
/// All errors found in the first stage that has any: matrices by themselves; labels; mass; connections and rigid motion.
pub fn check(raw: RawModel) -> Result<CheckedModel> {
    let (assembled, found) = assemble(raw)?;
    finish(assembled, None, found)
}

/// A model in the internal order whose matrices are sound by themselves.
pub(super) struct Assembled {
    /// What was read, without matrices, nodes and labels.
    pub raw: RawModel,
    /// Nodes with degrees of freedom.
    pub nodes: Nodes,
    /// What the rows are; how those without a place move is not known yet.
    pub rows: Rows,
    /// K.
    pub stiffness: SymmetricMatrix,
    /// M.
    pub mass: SymmetricMatrix,
    /// Internal row of each matrix row; none when they are the same, or when this is one of several bodies.
    pub row_to_internal: Option<Vec<u32>>,
    /// Damping, a matrix in the same order.
    pub damping: Option<Damping<SymmetricMatrix>>,
    /// Geometric stiffness, in the same order.
    pub geometric_stiffness: Vec<GeometricStiffness<SymmetricMatrix>>,
}

/// The checks of the matrices and tables by themselves, and the internal order; with the warnings and notes so far.
pub(super) fn assemble(mut raw: RawModel) -> Result<(Assembled, Vec<Diagnostic>)> {
    let mut found = std::mem::take(&mut raw.diagnostics);
    check_matrix(&raw.stiffness, "stiffness", &mut found);
    check_matrix(&raw.mass, "mass", &mut found);
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
    let geometric = raw.geometric_stiffness.iter().map(|one| (&one.matrix, GEOMETRIC));
    for (other, name) in damping.into_iter().chain(geometric) {
        check_matrix(other, name, &mut found);
        let rows = other.matrix.n_cols();
        if rows != nk {
            let message = format!("stiffness matrix has {nk} rows, {name} matrix {rows}");
            found.push(Diagnostic::new(Code::MatrixSizesDiffer, message).in_file(&other.path));
        }
    }
    stop_on_error(&mut found)?;

    let dimension = usize::from(raw.dimension);
    let layout = layout(&raw, &mut found);
    stop_on_error(&mut found)?;
    let layout = layout.expect("a missing layout comes with an error");
    let rows = &layout.rows;
    let nodes = Nodes {
        ids: layout.used.iter().map(|&i| raw.nodes.ids[i]).collect(),
        positions: layout.used.iter().map(|&i| raw.nodes.positions[i]).collect(),
    };
    if nodes.positions.iter().flatten().any(|x| !x.is_finite()) {
        let message = "a node coordinate is not a finite number";
        found.push(Diagnostic::new(Code::CoordinateNotFinite, message).in_file(&raw.nodes_path));
    }
    if let Some(i) = nodes.positions.iter().position(|x| dimension == 2 && x[2] != 0.0) {
        let message = format!("node {} of a plane model has z = {}", nodes.ids[i], nodes.positions[i][2]);
        found.push(Diagnostic::new(Code::DirectionOutOfPlane, message).in_file(&raw.nodes_path));
    }
    check_names(&raw, &mut found);
    resolve_references(&mut raw, &nodes, &mut found);
    let known: HashSet<i64> = nodes.ids.iter().copied().collect();
    for set in &raw.interfaces {
        let unknown: Vec<i64> = set.nodes.iter().filter(|id| !known.contains(id)).copied().collect();
        if !unknown.is_empty() {
            let message = format!(
                "interface `{}` names {} unknown nodes: {}",
                set.name,
                unknown.len(),
                name_some(&unknown)
            );
            found.push(Diagnostic::new(Code::InterfaceNode, message));
        }
    }
    check_loads(&raw.geometric_stiffness, &raw.interfaces, dimension, &mut found);
    if nk <= rigid_count(dimension) {
        let message = format!("model has {nk} degrees of freedom");
        found.push(Diagnostic::new(Code::ModelTooSmall, message));
    }
    stop_on_error(&mut found)?;

    let label = |row: usize| rows.label(&nodes, row);
    let stiffness = symmetric(&mut raw.stiffness, &layout, "stiffness", label, &mut found);
    let mass = symmetric(&mut raw.mass, &layout, "mass", label, &mut found);
    let damping = raw.damping.take().and_then(|damping| {
        // Without the matrix there is an error among the diagnostics.
        let mut ordered = |mut matrix: RawMatrix| {
            let symmetric = symmetric(&mut matrix, &layout, "damping", label, &mut found)?;
            check_diagonal(&symmetric, "damping", &matrix.path, label, &mut found);
            Some(symmetric)
        };
        damping.try_map(|matrix| ordered(matrix).ok_or(())).ok()
    });
    let geometric_stiffness = std::mem::take(&mut raw.geometric_stiffness)
        .into_iter()
        .filter_map(|GeometricStiffness { load, mut matrix }| {
            let matrix = symmetric(&mut matrix, &layout, GEOMETRIC, label, &mut found)?;
            Some(GeometricStiffness { load, matrix })
        })
        .collect();
    stop_on_error(&mut found)?;
    let (Some(stiffness), Some(mass)) = (stiffness, mass) else {
        unreachable!("an asymmetric matrix is an error")
    };
    check_diagonals(&stiffness, &mass, label, &raw, &mut found);
    found.extend(check_magnitudes(&stiffness, &mass, &nodes, &raw));
    stop_on_error(&mut found)?;
    (raw.nodes, raw.dofs) = (Nodes::default(), None);
    let row_to_internal = (!layout.is_identity()).then_some(layout.row_to_internal);
    let rows = layout.rows;
    Ok((
        Assembled { raw, nodes, rows, stiffness, mass, row_to_internal, damping, geometric_stiffness },
        found,
    ))
}

/// The checks of a body: its mass, its connections, its rigid motion.
pub(super) fn finish(
    mut body: Assembled,
    number: Option<BodyNumber>,
    mut found: Vec<Diagnostic>,
) -> Result<CheckedModel> {
    found.extend(check_exchanged_matrices(&body));
    stop_on_error(&mut found)?;
    let [mass_pairs, foreign_pairs] = check_mass_pairs(&body, &mut found);
    stop_on_error(&mut found)?;
    let digits = body.raw.mass.digits;
    let form = match mass_form(&body.mass, &body.rows, block_tolerance(digits)) {
        Ok(form) => Some(form),
        Err(diagnostic) => {
            found.push(diagnostic.in_file(&body.raw.mass.path));
            None
        }
    };
    check_connections(&body, &mut found);
    if let Err(diagnostic) = recover(&body.stiffness, &mut body.rows, &body.nodes) {
        found.push(diagnostic.in_file(&body.raw.stiffness.path));
        stop_on_error(&mut found)?;
    }
    let label = |row: usize| body.rows.label(&body.nodes, row);
    if let Some(diagnostic) = misplaced(&body.rows) {
        found.push(diagnostic.in_file(&body.raw.nodes_path));
    }
    if let Err(diagnostic) = check_massless(&body.stiffness, &body.mass, label) {
        found.push(diagnostic.in_file(&body.raw.stiffness.path));
    }
    let written = body.raw.stiffness.digits;
    let limits = (rounding(written, 1).max(1e-9), rounding(written, 3).max(1e-6));
    let rigid_residual = check_rigid_motion(&body, limits, &mut found);
    check_rigid_damping(&body, &mut found);
    found.extend(missing_components(&body.geometric_stiffness, body.rows.dimension));
    stop_on_error(&mut found)?;
    let mut form = form.expect("a missing mass comes with an error");
    // Vectors that rigid motion moves have no x of their own in the formulas for Ms.
    form.commutes &= body.rows.are_still();
    if !form.commutes {
        check_inertia(&body, rounding(digits, 3).max(1e-9), &mut found);
        stop_on_error(&mut found)?;
    }
    let diagonal_mass = is_diagonal(&body.mass);
    note_structure(&body, &form, diagonal_mass, &mut found);
    let plausibility = Plausibility {
        mass_pairs,
        foreign_pairs,
        ..check_local_mass(&body, &form, diagonal_mass, &mut found)
    };
    stop_on_error(&mut found)?;
    let model = FeModel::new(body, form, rigid_residual, diagonal_mass, number);
    Ok(CheckedModel { model, diagnostics: found, plausibility })
}

/// Where the mass sits, and whether density and speed of sound are those of matter; the pairs are not counted here.
fn check_local_mass(
    body: &Assembled,
    form: &MassForm,
    diagonal_mass: bool,
    found: &mut Vec<Diagnostic>,
) -> Plausibility {
    let local = LocalMass::new(body, &form.scalar);
    // Lumping has moved mass between the nodes of an element.
    let exchanged_pairs = if diagonal_mass { 0 } else { check_exchanged(body, &local, found) };
    let before = found.len();
    let densities = Densities::new(body, &local, diagonal_mass);
    let density = check_density(body, densities, &local, found);
    if found.len() == before {
        check_plausibility(&form.scalar, &body.nodes, &body.raw, found);
    }
    check_speed(body, &local, density, found);
    let sound_speed = local.sound_speed(body.rows.dimension);
    Plausibility { mass_pairs: 0, foreign_pairs: 0, exchanged_pairs, sound_speed, densities }
}

fn is_diagonal(m: &SymmetricMatrix) -> bool {
    (0..m.n()).all(|i| m.row(i).0.iter().all(|&j| j as usize == i))
}

/// What kind of mass and of rows the body has, where it is not the plain one.
fn note_structure(body: &Assembled, form: &MassForm, diagonal_mass: bool, found: &mut Vec<Diagnostic>) {
    let (raw, rows) = (&body.raw, &body.rows);
    if diagonal_mass {
        let message = "mass matrix is diagonal: it was lumped before it came here";
        found.push(Diagnostic::new(Code::MassDiagonal, message).in_file(&raw.mass.path));
    }
    let [vectors, others] = rows.without_place();
    if !(vectors.is_empty() && others.is_empty()) {
        let labels: Vec<DofLabel> =
            vectors.clone().chain(others.clone()).map(|row| rows.label(&body.nodes, row)).collect();
        let message = format!(
            "{} rows have no coordinates: {} in {} vectors with mass, {} massless and condensed: {}",
            labels.len(),
            vectors.len(),
            rows.vectors(),
            others.len(),
            name_some(&labels)
        );
        found.push(Diagnostic::new(Code::RowsWithoutPlace, message).in_file(&raw.nodes_path));
    }
    if !form.commutes {
        let (a, b) = form.worst;
        let label = |row| rows.label(&body.nodes, row);
        let why = if form.deviation > block_tolerance(raw.mass.digits) {
            let place = match a == b {
                true => format!("at {}", label(a)),
                false => format!("between {} and {}", label(a), label(b)),
            };
            let deviation = form.deviation;
            format!("its blocks deviate by {deviation:.1e} from multiples of the identity, most {place}")
        } else {
            "rows that are no displacements of nodes carry mass".to_owned()
        };
        let message = format!("mass matrix does not commute with rotations: {why}");
        found.push(Diagnostic::new(Code::MassBlockStructure, message).in_file(&raw.mass.path));
    }
}

fn stop_on_error(found: &mut Vec<Diagnostic>) -> Result<()> {
    if found.iter().any(|d| d.severity() == Severity::Error) {
        return Err(Error::new(std::mem::take(found)));
    }
    Ok(())
}

/// Names that no file could hold, before the long run rather than after it.
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

/// Relative size below which a difference is rounding of values with `digits` significant digits.
fn rounding(digits: u8, margin: i32) -> f64 {
    10f64.powi(margin - i32::from(digits)).clamp(1e-12, 1e-4)
}

fn block_tolerance(digits: u8) -> f64 {
    rounding(digits, 3).max(1e-10)
}

fn check_matrix(raw: &RawMatrix, name: &str, found: &mut Vec<Diagnostic>) {
    let matrix = &raw.matrix;
    if matrix.n_rows() != matrix.n_cols() {
        let message = format!("{name} matrix has {} rows and {} columns", matrix.n_rows(), matrix.n_cols());
        found.push(Diagnostic::new(Code::MatrixNotSquare, message).in_file(&raw.path));
    } else if matrix.nnz() == 0 {
        let message = format!("{name} matrix has no nonzero entries");
        found.push(Diagnostic::new(Code::MatrixEmpty, message).in_file(&raw.path));
    }
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    if !matrix.values().par_chunks(1 << 16).all(finite) {
        let at = matrix.values().iter().position(|v| !v.is_finite()).expect("just found");
        let column = matrix.col_ptr().partition_point(|&p| p <= at);
        let message = format!(
            "{name} matrix has {} in row {}, column {column}",
            matrix.values()[at],
            matrix.row_idx()[at] + 1
        );
        found.push(Diagnostic::new(Code::MatrixNotFinite, message).in_file(&raw.path));
    }
}

/// The matrix in internal order, symmetric, taken out of `raw`; `None` with a diagnostic when it is not symmetric to
/// rounding.
fn symmetric(
    raw: &mut RawMatrix,
    layout: &Layout,
    name: &str,
    label: impl Fn(usize) -> DofLabel,
    found: &mut Vec<Diagnostic>,
) -> Option<SymmetricMatrix> {
    let matrix = std::mem::take(&mut raw.matrix);
    let ordered = if layout.is_identity() { matrix } else { matrix.permuted(&layout.row_to_internal) };
    let ordered = match SymmetricMatrix::try_from(ordered) {
        Ok(symmetric) => return Some(symmetric),
        Err(ordered) => ordered,
    };
    let n = ordered.n_cols();
    let size: Vec<f64> = (0..n).map(|i| ordered.get(i, i).abs().sqrt()).collect();
    let (mut worst, mut at) = (0.0f64, (0, 0));
    let mut one_sided = 0usize;
    for j in 0..n {
        let (rows, values) = ordered.column(j);
        for (&i, &v) in rows.iter().zip(values) {
            let i = i as usize;
            let other = ordered.get(j, i);
            one_sided += usize::from(other == 0.0);
            // Beyond the diagonal, as only indefinite matrices go, an entry is compared with itself.
            let scale = (size[i] * size[j]).max(v.abs()).max(other.abs());
            let difference = (v - other).abs() / scale;
            if difference > worst {
                (worst, at) = (difference, (i, j));
            }
        }
    }
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
            diagnostic = diagnostic.with_help("only one triangle is stored: declare the matrix symmetric");
        }
        found.push(diagnostic);
        return None;
    }
    Some(SymmetricMatrix::symmetrised(&ordered))
}

fn check_diagonals(
    stiffness: &SymmetricMatrix,
    mass: &SymmetricMatrix,
    label: impl Fn(usize) -> DofLabel,
    raw: &RawModel,
    found: &mut Vec<Diagnostic>,
) {
    check_diagonal(stiffness, "stiffness", &raw.stiffness.path, &label, found);
    check_diagonal(mass, "mass", &raw.mass.path, &label, found);
    let empty = |m: &SymmetricMatrix, i: usize| m.row(i).0.is_empty();
    let both: Vec<DofLabel> =
        (0..stiffness.n()).filter(|&i| empty(stiffness, i) && empty(mass, i)).map(&label).collect();
    if !both.is_empty() {
        let message = format!("{} rows are empty in both matrices: {}", both.len(), name_some(&both));
        found.push(Diagnostic::new(Code::PencilSingular, message).in_file(&raw.stiffness.path));
    }
}

fn check_diagonal(
    matrix: &SymmetricMatrix,
    name: &str,
    path: &Path,
    label: impl Fn(usize) -> DofLabel,
    found: &mut Vec<Diagnostic>,
) {
    let negative: Vec<DofLabel> =
        matrix.diagonal().iter().enumerate().filter(|(_, d)| **d < 0.0).map(|(i, _)| label(i)).collect();
    if !negative.is_empty() {
        let message = format!(
            "{} diagonal entries of the {name} matrix are negative: {}",
            negative.len(),
            name_some(&negative)
        );
        found.push(Diagnostic::new(Code::DiagonalNegative, message).in_file(path));
    }
}

/// K and M together make one body, and K alone holds it together.
fn check_connections(body: &Assembled, found: &mut Vec<Diagnostic>) {
    let Assembled { raw, nodes, rows, stiffness, mass, .. } = body;
    let component = rows.components(&[stiffness]);
    if component.iter().all(|&c| c == 0) {
        return;
    }
    let bodies = groups(&rows.components(&[stiffness, mass]), rows, nodes);
    if bodies.len() > 1 {
        let message = format!("the matrices hold {} separate bodies: {}", bodies.len(), in_words(&bodies));
        found.push(Diagnostic::new(Code::BodiesSeveral, message).in_file(&raw.stiffness.path));
        return;
    }
    // K R = 0 holds for each part by itself: each has rigid motions of its own, whatever the mass couples.
    let parts = groups(&component, rows, nodes);
    let message = format!(
        "stiffness leaves {} parts that only the mass couples, each with rigid motions of its own: {}",
        parts.len(),
        in_words(&parts)
    );
    found.push(Diagnostic::new(Code::Mechanism, message).in_file(&raw.stiffness.path));
}

/// Node numbers of every component, in the order of their first nodes.
pub(super) fn groups(component: &[usize], rows: &Rows, nodes: &Nodes) -> Vec<Vec<i64>> {
    let mut groups = vec![Vec::new(); component.iter().max().map_or(0, |last| last + 1)];
    for (vertex, &c) in component.iter().enumerate() {
        groups[c].push(rows.number(nodes, vertex));
    }
    groups
}

/// `8 nodes (1, 2, 3, 4, 5 and 3 more), 1 node (9)`.
pub(super) fn in_words(groups: &[Vec<i64>]) -> String {
    let group = |nodes: &Vec<i64>| {
        let plural = if nodes.len() == 1 { "" } else { "s" };
        format!("{} node{plural} ({})", nodes.len(), name_some(nodes))
    };
    name_some(&groups.iter().map(group).collect::<Vec<_>>())
}

/// A warning when D damps rigid motion: what acts on the motion of the whole body is not in the modes.
fn check_rigid_damping(body: &Assembled, found: &mut Vec<Diagnostic>) {
    /// As much as node tables written with few digits leave.
    const LIMIT: f64 = 1e-6;
    let Some(damping) = body.damping.as_ref().and_then(Damping::matrix) else { return };
    let (centre, length) = centre_and_length(&body.nodes.positions);
    let fields = body.rows.rigid_fields(&body.nodes.positions, centre, length);
    let residuals = rigid_residuals(damping, &fields, &body.rows.field_sizes(length));
    let damped = residuals.iter().filter(|r| **r > LIMIT).count();
    if damped > 0 {
        let worst = residuals.iter().fold(0.0f64, |m, &r| m.max(r));
        let message = format!(
            "D R is not zero for {damped} of {} rows: |D R| reaches {worst:.1e} of the row sum of |D|; only the damping of the modes is kept",
            residuals.len()
        );
        found.push(Diagnostic::new(Code::DampingRigid, message));
    }
}

/// Densities between aerogel and osmium, for the box around the nodes: all that is known of bodies other than solids.
const DENSITY: (f64, f64) = (0.1, 30_000.0);

fn check_plausibility(mass: &SymmetricMatrix, nodes: &Nodes, raw: &RawModel, found: &mut Vec<Diagnostic>) {
    if !raw.units.stated {
        return;
    }
    let total: f64 = mass.as_csc().values().iter().sum::<f64>() * raw.units.mass.to_si();
    let [x, y, z] = extents(&nodes.positions).map(|extent| extent * raw.units.length.to_si());
    let volume = x * y * z;
    if volume <= 0.0 {
        return;
    }
    let density = total / volume;
    if !(DENSITY.0..=DENSITY.1).contains(&density) {
        let message =
            format!("{total:.3e} kg in a box of {x:.3e} x {y:.3e} x {z:.3e} m is {density:.1e} kg/m^3");
        found.push(Diagnostic::new(Code::InertiaImplausible, message));
    }
}
