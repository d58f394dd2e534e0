//! Several bodies in one pair of matrices: found by the graph of K and M together, each made a model of its own.

use super::checks::{Assembled, CheckedModel, assemble, finish, groups, in_words};
use super::{Damping, GeometricStiffness, NodeSet, Nodes, RawModel, Rows, rigid_count};
use crate::base::diagnostic::{Code, Diagnostic, Severity};
use crate::base::error::{Error, Result};
use crate::numerics::linalg::SymmetricMatrix;
use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};
use std::convert::Infallible;

/// Which of several bodies in the same matrices a model is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyNumber {
    /// From 1, in the order of the first node of each body in the node table.
    pub number: usize,
    /// How many bodies there are.
    pub of: usize,
}

impl std::fmt::Display for BodyNumber {
    /// `body 1 of 2`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "body {} of {}", self.number, self.of)
    }
}

/// Checks `raw`, takes the bodies in it apart and checks each. Two nodes belong to one body when K or M couples them,
/// directly or through others. The nodes of a body keep their order, and its model is named `<name>-<number>`.
///
/// # Errors
/// As [`check`](super::check), the bodies named in the messages, the body with the highest exit code first;
/// [`ModelTooSmall`](Code::ModelTooSmall) for bodies with no more rows than rigid motions;
/// [`InterfaceAcross`](Code::InterfaceAcross) for an interface with nodes of several bodies;
/// [`BodiesCoupled`](Code::BodiesCoupled) for a damping or geometric stiffness matrix that couples bodies.
pub fn check_bodies(raw: RawModel) -> Result<Vec<CheckedModel>> {
    let (whole, shared) = assemble(raw)?;
    let bodies = match separate(whole) {
        Ok(bodies) => bodies,
        Err(found) => return Err(Error::new(shared.into_iter().chain(found).collect())),
    };
    let of = bodies.len();
    let (mut checked, mut failed) = (Vec::new(), Vec::new());
    for (i, body) in bodies.into_iter().enumerate() {
        let number = BodyNumber { number: i + 1, of };
        match finish(body, Some(number), Vec::new()) {
            Ok(mut one) => {
                let own = one.diagnostics.into_iter().map(|diagnostic| diagnostic.about(number));
                one.diagnostics = shared.iter().cloned().chain(own).collect();
                checked.push(one);
            }
            Err(error) => failed.push(error.about(number)),
        }
    }
    if failed.is_empty() {
        return Ok(checked);
    }
    failed.sort_by_key(|error| Reverse(error.exit_code()));
    Err(Error::new(shared.into_iter().chain(failed.into_iter().flat_map(Error::into_diagnostics)).collect()))
}

/// The bodies, in the order of their first nodes.
fn separate(whole: Assembled) -> std::result::Result<Vec<Assembled>, Vec<Diagnostic>> {
    let Assembled { raw, nodes, rows, stiffness, mass, damping, geometric_stiffness, .. } = whole;
    let component = rows.components(&[&stiffness, &mass]);
    let bodies = groups(&component, &rows, &nodes);
    let mut found = Vec::new();
    let members = rows.separated(&component);
    let rigid = rigid_count(rows.dimension);
    let few = bodies.iter().zip(&members).filter(|(_, (own, _))| own.len() <= rigid);
    let small: Vec<Vec<i64>> = few.map(|(numbers, _)| numbers.clone()).collect();
    if !small.is_empty() {
        let message = format!(
            "{} of {} bodies have no flexible degree of freedom: {}",
            small.len(),
            bodies.len(),
            in_words(&small)
        );
        found.push(
            Diagnostic::new(Code::ModelTooSmall, message)
                .in_file(&raw.stiffness.path)
                .with_help("connect these nodes, or remove them from the matrices"),
        );
    }
    let interfaces = distribute(&raw.interfaces, &component, &nodes, &mut found);
    let damping_matrix = damping.as_ref().and_then(Damping::matrix).map(|d| (d, "damping".to_owned()));
    let geometric =
        geometric_stiffness.iter().map(|g| (&g.matrix, format!("geometric stiffness for {}", g.load)));
    for (matrix, name) in damping_matrix.into_iter().chain(geometric) {
        found.extend(coupling(matrix, &name, &component, &rows, &nodes));
    }
    let of = |row: usize| component[rows.vertex(row)];
    for GeometricStiffness { load, matrix } in &geometric_stiffness {
        let at = load.kind.interface();
        let own = interfaces.iter().position(|sets| sets.iter().any(|set| at == Some(set.name.as_str())));
        let elsewhere = |b| (0..matrix.n()).find(|&row| of(row) != b && !matrix.row(row).0.is_empty());
        if let Some((body, row)) = own.and_then(|b| Some((b + 1, elsewhere(b)?))) {
            let (node, other) = (rows.label(&nodes, row).node, of(row) + 1);
            let message = format!(
                "geometric stiffness for {load} has entries at node {node} of body {other}, the interface belongs to body {body}"
            );
            found.push(Diagnostic::new(Code::BodiesCoupled, message));
        }
    }
    if found.iter().any(|d| d.severity() == Severity::Error) {
        return Err(found);
    }
    let mut own = vec![Nodes::default(); bodies.len()];
    for (node, &body) in component.iter().enumerate().take(nodes.len()) {
        own[body].ids.push(nodes.ids[node]);
        own[body].positions.push(nodes.positions[node]);
    }
    let mut all = Vec::with_capacity(bodies.len());
    for (i, ((kept, rows), (nodes, interfaces))) in
        members.into_iter().zip(own.into_iter().zip(interfaces)).enumerate()
    {
        let damping = damping.as_ref().map(|damping| {
            let principal = |matrix: &SymmetricMatrix| Ok::<_, Infallible>(matrix.principal(&kept));
            let Ok(own) = damping.borrowed().try_map(principal);
            own
        });
        // What a load does to the other bodies is nothing: no rows of it are theirs.
        let geometric_stiffness = geometric_stiffness
            .iter()
            .map(|one| GeometricStiffness { load: one.load.clone(), matrix: one.matrix.principal(&kept) })
            .filter(|one| one.matrix.as_csc().nnz() > 0)
            .collect();
        all.push(Assembled {
            raw: RawModel { name: format!("{}-{}", raw.name, i + 1), interfaces, ..raw.clone() },
            nodes,
            rows,
            stiffness: stiffness.principal(&kept),
            mass: mass.principal(&kept),
            row_to_internal: None,
            damping,
            geometric_stiffness,
        });
    }
    Ok(all)
}

/// The interfaces of every body; a complaint about each that belongs to several.
fn distribute(
    interfaces: &[NodeSet],
    component: &[usize],
    nodes: &Nodes,
    found: &mut Vec<Diagnostic>,
) -> Vec<Vec<NodeSet>> {
    let body: HashMap<i64, usize> = nodes.ids.iter().copied().zip(component.iter().copied()).collect();
    let mut own = vec![Vec::new(); component.iter().max().map_or(0, |last| last + 1)];
    for set in interfaces {
        let mut first: BTreeMap<usize, i64> = BTreeMap::new();
        for id in &set.nodes {
            first.entry(body[id]).or_insert(*id);
        }
        if let ([_, _, ..], bodies) = (first.keys().collect::<Vec<_>>().as_slice(), &first) {
            let named: Vec<String> =
                bodies.iter().map(|(b, id)| format!("node {id} of body {}", b + 1)).collect();
            let message = format!(
                "interface `{}` has nodes of {} bodies: {}",
                set.name,
                bodies.len(),
                super::layout::name_some(&named)
            );
            found.push(Diagnostic::new(Code::InterfaceAcross, message));
        } else if let Some((&b, _)) = first.first_key_value() {
            own[b].push(set.clone());
        }
    }
    own
}

/// A complaint when an entry of the matrix called `name` couples two bodies.
fn coupling(
    matrix: &SymmetricMatrix,
    name: &str,
    component: &[usize],
    rows: &Rows,
    nodes: &Nodes,
) -> Option<Diagnostic> {
    let of = |row: usize| component[rows.vertex(row)];
    let (a, b) = (0..matrix.n()).find_map(|row| {
        let other = |&column: &u32| (of(row) != of(column as usize)).then_some(column);
        matrix.row(row).0.iter().find_map(other).map(|column| (row, column as usize))
    })?;
    let place = |row: usize| format!("node {} of body {}", rows.label(nodes, row).node, of(row) + 1);
    let message = format!("{name} couples {} with {}", place(a), place(b));
    Some(Diagnostic::new(Code::BodiesCoupled, message))
}
