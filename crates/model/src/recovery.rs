//! Recovery: rows that read stresses, strains, forces or displacements off the deformed body (theory section 12).

pub(crate) mod stress_labels;
pub(crate) mod stress_nodes;
pub(crate) mod stress_points;

use crate::rows::{centre_and_length, rigid_count};
use crate::wording::name_some;
use crate::{DofLabel, GivenRows, LostRow, Nodes, Rows};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::ties::first_largest;
use flexbody_linalg::{CscMatrix, larger};
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use strum::{EnumString, IntoStaticStr, VariantArray, VariantNames};

/// Physical quantity of a row of a recovery.
#[derive(Debug, Clone, Copy, PartialEq, Eq, EnumString, IntoStaticStr, VariantArray, VariantNames)]
#[strum(serialize_all = "lowercase")]
pub enum Quantity {
    /// Component of the stress.
    Stress,
    /// Component of the strain.
    Strain,
    /// Force, such as a member end force or a section force.
    Force,
    /// Moment.
    Moment,
    /// Displacement or rotation, relative to the frame of the body.
    Displacement,
    /// Any other linear combination of the displacements.
    Other,
}

impl Quantity {
    /// All quantities, in the order of the documentation.
    pub const ALL: &'static [Self] = <Self as VariantArray>::VARIANTS;

    /// Names of all quantities, in the order of `ALL`.
    pub const NAMES: &'static [&'static str] = <Self as VariantNames>::VARIANTS;

    /// Returns the name in tables and files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the quantity with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }

    /// Returns true if a rigid motion of the body leaves the quantity at zero.
    pub fn ignores_rigid_motion(self) -> bool {
        !matches!(self, Self::Displacement | Self::Other)
    }

    /// Returns true if the quantity has a unit of measure.
    pub fn has_unit(self) -> bool {
        !matches!(self, Self::Strain | Self::Other)
    }
}

/// Label of a row of a recovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecoveryRow {
    /// Name, unique within the recovery.
    pub name: String,
    /// Physical quantity.
    pub quantity: Quantity,
    /// Component: `xx`, `yy`, `zz`, `xy`, `yz`, `xz`, a number, or any other text.
    pub component: String,
    /// Unit of the value of the row; empty for a pure number.
    pub unit: String,
    /// Number of the node that the row belongs to.
    pub node: Option<i64>,
    /// Number of the element that the row belongs to.
    pub element: Option<i64>,
}

impl RecoveryRow {
    /// Returns the rows of each quantity and unit, in the order of the first row of each. Values of rows of different units have
    /// no common size.
    pub fn by_unit(rows: &[Self]) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (at, row) in rows.iter().enumerate() {
            let is_alike = |group: &&mut Vec<usize>| {
                let first = &rows[group[0]];
                (first.quantity, &first.unit) == (row.quantity, &row.unit)
            };
            match groups.iter_mut().find(is_alike) {
                Some(group) => group.push(at),
                None => groups.push(vec![at]),
            }
        }
        groups
    }
}

/// Shapes whose stresses an FE program has computed.
#[derive(Debug, Clone, PartialEq)]
pub struct AnsweredShapes {
    /// Node and direction of every row of `displacements`, along the axes of the model, each once.
    pub dofs: Vec<DofLabel>,
    /// Displacements of the shapes, one column per shape.
    pub displacements: Mat<f64>,
    /// Significant decimal digits of the displacements.
    pub digits: u8,
    /// Values of the rows of the recovery under each shape (rows x shapes).
    pub answers: Mat<f64>,
    /// Significant decimal digits of the answers.
    pub answer_digits: u8,
    /// Strain energy of each shape as computed by the FE program, if it was read.
    pub energies: Option<Vec<f64>>,
}

/// Steps of an FE program that `flexbody shapes` has written: modes and static columns as displacements of all nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeSteps {
    /// Mode or static column of each step: `mode 1`, or the name of [`UnitLoad::step`](crate::UnitLoad::step).
    pub columns: Vec<String>,
    /// Factor of each step: a step is the factor times its mode or column.
    pub factors: Vec<f64>,
    /// Numbers of the nodes.
    pub nodes: Vec<i64>,
    /// Displacements of each step and node, axes of the model.
    pub displacements: Vec<Vec<[f64; 3]>>,
    /// True if the modes of the body respond to spin, so that the static columns of spin are what they leave out.
    pub modes_follow_spin: bool,
}

/// Linear map from the displacements of the body to the rows of a recovery.
#[derive(Debug, Clone, PartialEq)]
pub enum RecoveryOperator {
    /// Rows of a matrix R: y = R u.
    Rows {
        /// R', one column per row of the recovery. A reader delivers the rows of the files, a checked model
        /// has its internal rows.
        transposed: CscMatrix,
        /// Label of every row.
        labels: Vec<RecoveryRow>,
        /// Values y0 of the undeformed body, one per row; `None` for zero.
        offset: Option<Vec<f64>>,
    },
    /// Rows known by their values under shapes: R u = S x for u = U x with the displacements U and the values S.
    Shapes {
        /// The shapes with their values.
        shapes: AnsweredShapes,
        /// Label of every row.
        labels: Vec<RecoveryRow>,
    },
    /// Section forces: resultant force and moment that the nodes of one side of a cut exert on the rest of
    /// the body, along the axes of the model.
    Cut {
        /// Numbers of the nodes on this side of the cut.
        nodes: Vec<i64>,
        /// Point that the moment is about, in the coordinates of the model.
        about: [f64; 3],
    },
}

/// Recovery that a model asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelRecovery {
    /// Name, unique in the model.
    pub name: String,
    /// Map from the displacements.
    pub operator: RecoveryOperator,
    /// True for static columns of the inertia of the deformation: terms of higher order in the deformation and the motion.
    pub deformed_inertia: bool,
    /// File of the operator or of the nodes, for messages; empty for data in memory.
    pub path: PathBuf,
}

// Checks of recoveries, and their conversion to the internal order of rows.

/// Longest name of a recovery in bytes, since the name becomes a group name in the file.
const MAX_NAME_BYTES: usize = 200;

/// Largest value of a row of stress, strain, force or moment under a rigid motion, relative to the largest sum of the
/// magnitudes of its terms under any, about the middle of its own nodes. Operators of sound models reach 1e-16, written with six
/// digits 1e-5; exchanged nodes and exchanged directions give 1e-2 to 1 in the rows concerned. A larger limit lets
/// exchanged nodes pass.
const MAX_RIGID_RESPONSE: f64 = 1e-3;

/// Value of a row under a rigid motion, relative to the largest sum of a row of its quantity and unit, below which the row
/// is rounding: a row that vanishes for every motion, such as a stress in a direction without stiffness. Products and
/// averages of a thousand terms leave 1e-13; a larger limit lets wrong rows of very soft parts pass.
const ROW_ROUNDING: f64 = 1e-12;

/// Extent of the nodes of a row, relative to that of the body, below which they count as one place.
const ONE_PLACE: f64 = 1e-9;

/// Rows of the files of a model and their way to the internal order.
pub(crate) struct RowsOfFiles<'a> {
    pub given: &'a GivenRows,
    /// Number of rows of K.
    pub matrix_rows: usize,
    /// Internal row of each row of K, `u32::MAX` for rows that are left out.
    pub to: &'a [u32],
}

impl RowsOfFiles<'_> {
    /// Returns true for the number of rows of K, or of a file of the model.
    pub(crate) fn fit(&self, rows: usize) -> bool {
        rows == self.matrix_rows || self.given.counts().any(|count| count == rows)
    }

    /// Returns columns by the rows of the files in the internal order of rows.
    ///
    /// # Errors
    /// [`LostRow`] for entries in rows that K and M leave empty.
    pub(crate) fn internal(&self, columns: CscMatrix) -> Result<CscMatrix, LostRow> {
        let count = columns.n_cols();
        let given = self.given.sparse_forces(columns)?;
        let mut entries = Vec::with_capacity(given.nnz());
        for j in 0..count {
            let (rows, values) = given.column(j);
            for (&row, &value) in rows.iter().zip(values) {
                match self.to[row as usize] {
                    u32::MAX => return Err(LostRow),
                    to => entries.push((to, j as u32, value)),
                }
            }
        }
        let internal = self.to.iter().filter(|to| **to != u32::MAX).count();
        Ok(CscMatrix::from_triplets(internal, count, &entries))
    }
}

/// Returns the recoveries with operators in the internal order; adds an error for each that is not valid.
pub(crate) fn checked_recoveries(
    asked: Vec<ModelRecovery>,
    of_files: &RowsOfFiles<'_>,
    nodes: &Nodes,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<ModelRecovery> {
    let mut names = HashSet::new();
    let mut checked = Vec::with_capacity(asked.len());
    for ModelRecovery { name, operator, path, deformed_inertia } in asked {
        let complain =
            |(code, message): Problem| Diagnostic::new(code, format!("recovery {message}")).in_file(&path);
        let result = match refuse_name(&name, &mut names) {
            Err(problem) => Err(problem),
            Ok(()) => match operator {
                RecoveryOperator::Rows { transposed, labels, offset } => {
                    in_internal_rows(&name, transposed, &labels, offset.as_deref(), of_files)
                        .map(|transposed| RecoveryOperator::Rows { transposed, labels, offset })
                }
                RecoveryOperator::Shapes { shapes, labels } => refuse_shapes(&name, &shapes, &labels, nodes)
                    .map(|()| RecoveryOperator::Shapes { shapes, labels }),
                RecoveryOperator::Cut { nodes: side, about } => refuse_cut(&name, &side, about, nodes)
                    .map(|()| RecoveryOperator::Cut { nodes: side, about }),
            },
        };
        match result {
            Ok(operator) => checked.push(ModelRecovery { name, operator, path, deformed_inertia }),
            Err(problem) => diagnostics.push(complain(problem)),
        }
    }
    checked
}

/// Code and message about a recovery.
pub(crate) type Problem = (Code, String);

/// Refuses a name that cannot be that of a group in the file, or that is given twice.
pub(crate) fn refuse_name(name: &str, seen: &mut HashSet<String>) -> Result<(), Problem> {
    let wrong = match name {
        "" => "has no name".to_owned(),
        _ if name.len() > MAX_NAME_BYTES || name.chars().any(char::is_control) => format!(
            "`{}` has a name that is longer than {MAX_NAME_BYTES} bytes or has control characters in it",
            name.escape_debug()
        ),
        _ if !seen.insert(name.to_owned()) => format!("`{name}` is given twice"),
        _ => return Ok(()),
    };
    Err((Code::ManifestSyntax, wrong))
}

/// Returns R' in the internal order of rows.
fn in_internal_rows(
    name: &str,
    transposed: CscMatrix,
    labels: &[RecoveryRow],
    offset: Option<&[f64]>,
    of_files: &RowsOfFiles<'_>,
) -> Result<CscMatrix, Problem> {
    let (n, count) = (transposed.n_rows(), transposed.n_cols());
    if !of_files.fit(n) {
        let transposed = if of_files.fit(count) { "; it may be the transposed operator" } else { "" };
        let message = format!(
            "`{name}`: its operator is {count} x {n}, the matrices have {} rows{transposed}",
            of_files.matrix_rows
        );
        return Err((Code::RecoverySize, message));
    }
    refuse_labels(name, labels, count)?;
    if let Some(offset) = offset.filter(|offset| offset.len() != count) {
        let message = format!("`{name}`: its offset has {} values for {count} rows", offset.len());
        return Err((Code::RecoverySize, message));
    }
    for j in 0..count {
        if let Some(value) = transposed.column(j).1.iter().find(|value| !value.is_finite()) {
            return Err((
                Code::MatrixNotFinite,
                format!("`{name}`: row {} of its operator has {value}", j + 1),
            ));
        }
    }
    if let Some(j) = offset.and_then(|offset| offset.iter().position(|value| !value.is_finite())) {
        return Err((
            Code::MatrixNotFinite,
            format!("`{name}`: value {} of its offset is not finite", j + 1),
        ));
    }
    of_files.internal(transposed).map_err(|LostRow| {
        (Code::RecoverySize, format!("`{name}`: its operator has entries in rows that K and M leave empty"))
    })
}

/// Refuses labels that do not describe `count` rows.
fn refuse_labels(name: &str, labels: &[RecoveryRow], count: usize) -> Result<(), Problem> {
    let refuse = |message: String| Err((Code::RecoveryRows, format!("`{name}`: {message}")));
    if labels.len() != count {
        return refuse(format!("its table names {} rows, its operator has {count}", labels.len()));
    }
    let mut seen = HashSet::new();
    for (at, row) in labels.iter().enumerate() {
        if row.name.is_empty() {
            return refuse(format!("row {} has no name", at + 1));
        }
        if [&row.name, &row.component, &row.unit].into_iter().any(|text| text.chars().any(char::is_control)) {
            return refuse(format!("row {} has control characters in its label", at + 1));
        }
        if !seen.insert(row.name.as_str()) {
            return refuse(format!("the row name `{}` occurs twice", row.name));
        }
        if row.quantity.has_unit() && row.unit.is_empty() {
            return refuse(format!("row `{}` is a {} without a unit", row.name, row.quantity.name()));
        }
    }
    Ok(())
}

/// Refuses shapes that do not move all nodes, and values that do not fit them.
fn refuse_shapes(
    name: &str,
    shapes: &AnsweredShapes,
    labels: &[RecoveryRow],
    nodes: &Nodes,
) -> Result<(), Problem> {
    let AnsweredShapes { dofs, displacements, answers, energies, .. } = shapes;
    refuse_labels(name, labels, answers.nrows())?;
    let refuse = |message: String| Err((Code::RecoveryShapes, format!("`{name}`: {message}")));
    let (count, asked) = (answers.ncols(), displacements.ncols());
    if count != asked || energies.as_ref().is_some_and(|energies| energies.len() != asked) {
        return refuse(format!("{count} answers belong to {asked} shapes"));
    }
    if dofs.len() != displacements.nrows() || asked == 0 {
        return refuse("its shapes have no displacements".to_owned());
    }
    let values = displacements.col_iter().chain(answers.col_iter()).flat_map(|column| column.iter());
    let energies = energies.iter().flatten();
    if values.chain(energies).any(|value| !value.is_finite()) {
        return Err((Code::MatrixNotFinite, format!("`{name}`: a value of its shapes is not finite")));
    }
    let moved: HashSet<i64> = dofs.iter().filter(|dof| dof.direction <= 3).map(|dof| dof.node).collect();
    let mut still: Vec<i64> = nodes.ids.iter().copied().filter(|id| !moved.contains(id)).collect();
    still.sort_unstable();
    if !still.is_empty() {
        return refuse(format!(
            "its shapes have no displacements of {} of {} nodes: {}",
            still.len(),
            nodes.len(),
            name_some(&still)
        ));
    }
    Ok(())
}

/// Refuses a cut whose side is empty, unknown, or the whole body.
fn refuse_cut(name: &str, side: &[i64], about: [f64; 3], nodes: &Nodes) -> Result<(), Problem> {
    let known: HashSet<i64> = nodes.ids.iter().copied().collect();
    let members: HashSet<i64> = side.iter().copied().collect();
    let mut unknown: Vec<i64> = members.difference(&known).copied().collect();
    unknown.sort_unstable();
    let message = if side.is_empty() {
        format!("`{name}`: no node lies on this side of the cut")
    } else if !unknown.is_empty() {
        format!("`{name}`: its cut names {} unknown nodes: {}", unknown.len(), name_some(&unknown))
    } else if members.len() == known.len() {
        format!("`{name}`: all {} nodes lie on this side of the cut", known.len())
    } else if about.iter().any(|x| !x.is_finite()) {
        format!("`{name}`: the point of its moments is not finite")
    } else {
        return Ok(());
    };
    Err((Code::RecoveryCut, message))
}

/// Returns an error for each recovery with rows of stress, strain, force or moment that a rigid motion changes.
pub(crate) fn check_rigid_responses(all: &[ModelRecovery], rows: &Rows, nodes: &Nodes) -> Vec<Diagnostic> {
    if all.is_empty() {
        return Vec::new();
    }
    let (centre, _) = centre_and_length(&nodes.positions);
    let fields = rows.rigid_fields(&nodes.positions, centre, 1.0);
    all.iter().filter_map(|one| strained(one, &fields, rows)).collect()
}

fn strained(recovery: &ModelRecovery, fields: &Mat<f64>, rows: &Rows) -> Option<Diagnostic> {
    let RecoveryOperator::Rows { transposed, labels, .. } = &recovery.operator else { return None };
    let checked: Vec<usize> =
        (0..labels.len()).filter(|&j| labels[j].quantity.ignores_rigid_motion()).collect();
    let d = rows.dimension;
    let extent = (0..rows.nodes).map(|node| place(node, fields, d).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let responses: Vec<RigidResponse> =
        checked.iter().map(|&j| RigidResponse::of(transposed.column(j), fields, rows, extent)).collect();
    // Values of different units cannot be compared.
    let mut largest: HashMap<(&str, &str), f64> = HashMap::new();
    let kind = |j: usize| (labels[j].quantity.name(), labels[j].unit.as_str());
    for (&j, response) in checked.iter().zip(&responses) {
        let size = largest.entry(kind(j)).or_default();
        *size = size.max(response.size);
    }
    let part = |(&j, response): (&usize, &RigidResponse)| {
        let is_rounding = response.value <= ROW_ROUNDING * largest[&kind(j)];
        (j, if is_rounding { 0.0 } else { response.value / response.size })
    };
    let wrong: Vec<(usize, f64)> =
        checked.iter().zip(&responses).map(part).filter(|(_, part)| *part > MAX_RIGID_RESPONSE).collect();
    let &(worst, part) = first_largest(&wrong, |pair| pair.1)?;
    let row = &labels[worst];
    let message = format!(
        "recovery `{}`: a rigid motion of the body gives {} of {} rows a value, most of all the {} `{}`: {part:.1e} of the sum of its terms, expected below {MAX_RIGID_RESPONSE:e}",
        recovery.name,
        wrong.len(),
        labels.len(),
        row.quantity.name(),
        row.name
    );
    Some(Diagnostic::new(Code::RecoveryStrained, message).in_file(&recovery.path))
}

/// Response of a row r to the rigid motions t that move none of its nodes by more than one: translations, and rotations
/// about the middle of its nodes.
struct RigidResponse {
    /// Largest |sum r_i t_i|.
    value: f64,
    /// Largest sum |r_i t_i|. Entries that vanish but for rounding may be all that one motion moves: the value is
    /// compared with the sum of the motion with the largest.
    size: f64,
}

impl RigidResponse {
    /// Returns the response of a row with entries `values` at the rows `at` of the matrices.
    ///
    /// * `fields`: rigid motions about the centre of the body, rotations with unit angle.
    /// * `extent`: largest distance of a node from there.
    fn of((at, values): (&[u32], &[f64]), fields: &Mat<f64>, rows: &Rows, extent: f64) -> Self {
        let d = rows.dimension;
        let middle = middle_of(at, fields, d, d * rows.nodes);
        // Rotations displace the farthest node by one; a row of a single place has the extent of the body.
        let displaced = at.iter().map(|&row| row as usize).filter(|row| *row < d * rows.nodes);
        let reach = displaced.map(|row| (place(row / d, fields, d) - middle).norm()).fold(0.0, f64::max);
        let length = if reach > ONE_PLACE * extent { reach } else { extent };
        let mut response = Self { value: 0.0, size: 0.0 };
        for c in 0..rigid_count(d) {
            // A rotation about the middle is one about the centre less the translation of the middle.
            let (shift, unit) = match c.checked_sub(d) {
                Some(turn) => (Vector3::ith(if d == 2 { 2 } else { turn }, 1.0).cross(&middle), 1.0 / length),
                None => (Vector3::zeros(), 1.0),
            };
            let term = |(&row, value): (&u32, &f64)| {
                let translated: f64 = (0..d).map(|k| shift[k] * fields[(row as usize, k)]).sum();
                value * (fields[(row as usize, c)] - translated) * unit
            };
            let (sum, size) = at
                .iter()
                .zip(values)
                .map(term)
                .fold((0.0, 0.0), |(sum, size): (f64, f64), term| (sum + term, size + term.abs()));
            (response.value, response.size) =
                (larger(response.value, sum.abs()), larger(response.size, size));
        }
        response
    }
}

/// Returns the mean position, from the centre of the body, of the nodes whose displacements are in `at`; `displaced`
/// rows are displacements of nodes.
fn middle_of(at: &[u32], fields: &Mat<f64>, d: usize, displaced: usize) -> Vector3<f64> {
    let mut nodes: Vec<usize> =
        at.iter().map(|&row| row as usize).filter(|row| *row < displaced).map(|row| row / d).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let count = nodes.len().max(1) as f64;
    nodes.into_iter().map(|node| place(node, fields, d)).sum::<Vector3<f64>>() / count
}

/// Returns the position of a node from the centre of the body.
fn place(node: usize, fields: &Mat<f64>, d: usize) -> Vector3<f64> {
    if d == 2 {
        return Vector3::new(fields[(2 * node + 1, 2)], -fields[(2 * node, 2)], 0.0);
    }
    // e_z moves x along y by x, e_x along z by y, and e_y along x by z.
    Vector3::new(fields[(3 * node + 1, 5)], fields[(3 * node + 2, 3)], fields[(3 * node, 4)])
}

/// Returns the parts of the recoveries that belong to the body with the rows `kept` and the `nodes`: an operator with
/// entries, or a cut with nodes, in this body.
pub(crate) fn recoveries_of_body(all: &[ModelRecovery], kept: &[usize], nodes: &Nodes) -> Vec<ModelRecovery> {
    let known: HashSet<i64> = nodes.ids.iter().copied().collect();
    let operator = |recovery: &ModelRecovery| match &recovery.operator {
        RecoveryOperator::Cut { nodes: side, about } => side
            .iter()
            .any(|id| known.contains(id))
            .then(|| RecoveryOperator::Cut { nodes: side.clone(), about: *about }),
        RecoveryOperator::Shapes { shapes, .. } => {
            shapes.dofs.iter().any(|dof| known.contains(&dof.node)).then(|| recovery.operator.clone())
        }
        RecoveryOperator::Rows { transposed, labels, offset } => {
            let mut entries = Vec::new();
            for j in 0..transposed.n_cols() {
                let (rows, values) = transposed.column(j);
                let places = rows.iter().map(|row| kept.binary_search(&(*row as usize)));
                entries.extend(
                    places
                        .zip(values)
                        .filter_map(|(place, value)| Some((place.ok()? as u32, j as u32, *value))),
                );
            }
            (!entries.is_empty()).then(|| RecoveryOperator::Rows {
                transposed: CscMatrix::from_triplets(kept.len(), transposed.n_cols(), &entries),
                labels: labels.clone(),
                offset: offset.clone(),
            })
        }
    };
    let one =
        |recovery: &ModelRecovery| Some(ModelRecovery { operator: operator(recovery)?, ..recovery.clone() });
    all.iter().filter_map(one).collect()
}

/// Adds an error for each recovery that reads several bodies. `body_of` returns the body of an internal row, or of a
/// node.
pub(crate) fn refuse_several_bodies(
    all: &[ModelRecovery],
    body_of_row: impl Fn(usize) -> usize,
    body_of_node: impl Fn(i64) -> Option<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for recovery in all {
        let mut bodies: Vec<usize> = match &recovery.operator {
            RecoveryOperator::Rows { transposed, .. } => {
                transposed.row_idx().iter().map(|row| body_of_row(*row as usize) + 1).collect()
            }
            RecoveryOperator::Shapes { shapes, .. } => {
                shapes.dofs.iter().filter_map(|dof| body_of_node(dof.node)).map(|body| body + 1).collect()
            }
            RecoveryOperator::Cut { nodes, .. } => {
                nodes.iter().filter_map(|id| body_of_node(*id)).map(|body| body + 1).collect()
            }
        };
        bodies.sort_unstable();
        bodies.dedup();
        if bodies.len() > 1 {
            let message =
                format!("recovery `{}` reads {} bodies: {}", recovery.name, bodies.len(), name_some(&bodies));
            let diagnostic = Diagnostic::new(Code::BodiesCoupled, message).in_file(&recovery.path);
            diagnostics.push(diagnostic.with_help("give one [[recovery]] for each body"));
        }
    }
}
