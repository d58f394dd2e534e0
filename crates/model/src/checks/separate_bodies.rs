//! Several bodies in one pair of matrices: found by the graph of K and M together, each made a model of its
//! own.

use crate::checks::{CheckedModel, check_body, groups};
use crate::fe_model::assemble::{Assembled, assemble};
use crate::named_load::{loads_of_body, refuse_loads_of_several_bodies};
use crate::recovery::{recoveries_of_body, refuse_several_bodies};
use crate::wording::{in_words, name_some};
use crate::{
    BodyNumber, Damping, Description, FeModel, GeometricStiffness, ModelData, NodeSet, Nodes, RawModel, Rows,
    rigid_count,
};
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic, Severity};
use flexbody_base::error::{Error, Result};
use flexbody_linalg::SymmetricMatrix;
use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::convert::Infallible;
use std::sync::Arc;

impl FeModel {
    /// Checks matrices that hold several bodies, as [`from_raw`](FeModel::from_raw) does for one: each body
    /// becomes a model of its own.
    ///
    /// # Errors
    /// The errors of [`check_bodies`].
    pub fn bodies_from_raw(raw: RawModel) -> Result<Vec<CheckedModel>> {
        check_bodies(raw)
    }
}

/// Checks `raw`, separates its bodies and checks each. Two nodes belong to one body if K or M couples them,
/// directly or through others. The nodes of a body keep their order, and its model is named
/// `<name>-<number>`.
///
/// # Errors
/// The errors of [`check`](crate::check), with the bodies named in the messages, the body with the highest
/// exit code first; [`ModelTooSmall`](Code::ModelTooSmall) for bodies with no more rows than rigid motions;
/// [`InterfaceAcross`](Code::InterfaceAcross) for an interface with nodes of several bodies;
/// [`BodiesCoupled`](Code::BodiesCoupled) for a damping or geometric stiffness matrix that couples bodies.
pub fn check_bodies(raw: RawModel) -> Result<Vec<CheckedModel>> {
    let (whole, shared) = assemble(raw)?;
    let bodies = match separate(whole) {
        Ok(bodies) => bodies,
        Err(found) => return Err(Error::new(shared.into_iter().chain(found).collect())),
    };
    let count = bodies.len();
    let (mut checked, mut failed) = (Vec::new(), Vec::new());
    for (i, body) in bodies.into_iter().enumerate() {
        let number = BodyNumber { number: i + 1, of: count };
        match check_body(body, Vec::new()) {
            Ok(mut one) => {
                let numbered = one.diagnostics.into_iter().map(|diagnostic| diagnostic.about(number));
                one.diagnostics = shared.iter().cloned().chain(numbered).collect();
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

/// Returns the bodies, in the order of their first nodes.
fn separate(whole: Assembled) -> Diagnosed<Vec<Assembled>> {
    let component = whole.rows.components(&[&whole.stiffness, &whole.mass]);
    let members = whole.rows.separated(&component);
    let mut diagnostics = Vec::new();
    diagnostics.extend(too_small(&whole, &component, &members));
    let interfaces = distribute(&whole.data.interfaces, &component, &whole.nodes, &mut diagnostics);
    check_couplings(&whole, &component, &mut diagnostics);
    check_loads_of_others(&whole, &component, &interfaces, &mut diagnostics);
    let body: HashMap<i64, usize> = whole.nodes.ids.iter().copied().zip(component.iter().copied()).collect();
    let of_row = |row: usize| component[whole.rows.vertex(row)];
    refuse_loads_of_several_bodies(&whole.data.named_loads, of_row, &mut diagnostics);
    refuse_several_bodies(&whole.data.recoveries, of_row, |id| body.get(&id).copied(), &mut diagnostics);
    if diagnostics.iter().any(|d| d.severity() == Severity::Error) {
        return Err(diagnostics);
    }
    let nodes = nodes_of_bodies(&whole.nodes, &component, members.len());
    let count = members.len();
    let parts = members.into_iter().zip(nodes.into_iter().zip(interfaces));
    let mut bodies = Vec::with_capacity(count);
    for (i, ((kept, rows), (nodes, interfaces))) in parts.enumerate() {
        let number = BodyNumber { number: i + 1, of: count };
        bodies.push(body_model(&whole, number, &kept, rows, nodes, interfaces));
    }
    Ok(bodies)
}

/// Returns an error about bodies with no more rows than rigid motions.
fn too_small(whole: &Assembled, component: &[usize], members: &[(Vec<usize>, Rows)]) -> Option<Diagnostic> {
    let bodies = groups(component, &whole.rows, &whole.nodes);
    let rigid = rigid_count(whole.rows.dimension);
    let few = bodies.iter().zip(members).filter(|(_, (body_rows, _))| body_rows.len() <= rigid);
    let small: Vec<Vec<i64>> = few.map(|(numbers, _)| numbers.clone()).collect();
    (!small.is_empty()).then(|| {
        let message = format!(
            "{} of {} bodies have no flexible degree of freedom: {}",
            small.len(),
            bodies.len(),
            in_words(&small)
        );
        Diagnostic::new(Code::ModelTooSmall, message)
            .in_file(&whole.origin.stiffness.path)
            .with_help("connect these nodes, or remove them from the matrices")
    })
}

/// Adds errors about damping and geometric stiffness that couple bodies.
fn check_couplings(whole: &Assembled, component: &[usize], diagnostics: &mut Vec<Diagnostic>) {
    let damping = whole.data.damping.as_ref().and_then(Damping::matrix).map(|d| (d, "damping".to_owned()));
    let geometric = whole
        .data
        .geometric_stiffness
        .iter()
        .map(|g| (&g.matrix, format!("geometric stiffness for {}", g.load)));
    for (matrix, name) in damping.into_iter().chain(geometric) {
        diagnostics.extend(coupling(matrix, &name, component, &whole.rows, &whole.nodes));
    }
}

/// Adds errors about geometric stiffness of a load at an interface that stiffens another body than that of
/// the interface.
fn check_loads_of_others(
    whole: &Assembled,
    component: &[usize],
    interfaces: &[Vec<NodeSet>],
    diagnostics: &mut Vec<Diagnostic>,
) {
    let Assembled { data, nodes, rows, .. } = whole;
    let body_of = |row: usize| component[rows.vertex(row)];
    for GeometricStiffness { load, matrix } in &data.geometric_stiffness {
        let at = load.kind.interface();
        let body_of_load =
            interfaces.iter().position(|sets| sets.iter().any(|set| at == Some(set.name.as_str())));
        let elsewhere = |b| (0..matrix.n()).find(|&row| body_of(row) != b && !matrix.row(row).0.is_empty());
        if let Some((body, row)) = body_of_load.and_then(|b| Some((b + 1, elsewhere(b)?))) {
            let (node, other) = (rows.label(nodes, row).node, body_of(row) + 1);
            let message = format!(
                "geometric stiffness for {load} has entries at node {node} of body {other}, the interface belongs to body {body}"
            );
            diagnostics.push(Diagnostic::new(Code::BodiesCoupled, message));
        }
    }
}

/// Returns the nodes of each body, in the order of the node table.
fn nodes_of_bodies(nodes: &Nodes, component: &[usize], bodies: usize) -> Vec<Nodes> {
    let mut nodes_of_body = vec![Nodes::default(); bodies];
    for (node, &body) in component.iter().enumerate().take(nodes.len()) {
        nodes_of_body[body].ids.push(nodes.ids[node]);
        nodes_of_body[body].positions.push(nodes.positions[node]);
    }
    nodes_of_body
}

/// Returns the body with this number, made of the rows `kept`.
fn body_model(
    whole: &Assembled,
    number: BodyNumber,
    kept: &[usize],
    rows: Rows,
    nodes: Nodes,
    interfaces: Vec<NodeSet>,
) -> Assembled {
    let all = &whole.data;
    let damping = all.damping.as_ref().map(|damping| {
        let principal = |matrix: &SymmetricMatrix| Ok::<_, Infallible>(matrix.principal(kept));
        let Ok(restricted) = damping.borrowed().try_map(principal);
        restricted
    });
    // Drop loads that have no entries in rows of this body.
    let geometric_stiffness = all
        .geometric_stiffness
        .iter()
        .map(|stiffness| GeometricStiffness {
            load: stiffness.load.clone(),
            matrix: stiffness.matrix.principal(kept),
        })
        .filter(|stiffness| stiffness.matrix.as_csc().nnz() > 0)
        .collect();
    let name = format!("{}-{}", all.description.name, number.number);
    let own: HashSet<i64> = nodes.ids.iter().copied().collect();
    let data = ModelData {
        description: Description { name, number: Some(number), ..all.description.clone() },
        interfaces,
        mesh: all.mesh.as_ref().and_then(|mesh| mesh.among(&whole.nodes.ids, &nodes.ids)),
        damping,
        geometric_stiffness,
        recoveries: recoveries_of_body(&all.recoveries, kept, &nodes),
        nodal_stresses: all.nodal_stresses.iter().filter_map(|asked| asked.among(&own)).collect(),
        named_loads: loads_of_body(&all.named_loads, kept),
        elements: all.elements.as_ref().map(|elements| Arc::new(elements.among(|node| own.contains(&node)))),
        sources: all.sources.clone(),
    };
    Assembled {
        data,
        origin: whole.origin.clone(),
        nodes,
        rows,
        given_rows: whole.given_rows.of_body(),
        stiffness: whole.stiffness.principal(kept),
        mass: whole.mass.principal(kept),
        soft: whole.soft.of_body(kept),
        followers: whole.followers.as_ref().map(|followers| followers.of_body(kept)),
        row_to_internal: None,
    }
}

/// Returns the interfaces of every body; adds an error for each interface that belongs to several.
fn distribute(
    interfaces: &[NodeSet],
    component: &[usize],
    nodes: &Nodes,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Vec<NodeSet>> {
    let body: HashMap<i64, usize> = nodes.ids.iter().copied().zip(component.iter().copied()).collect();
    let mut sets_of_body = vec![Vec::new(); component.iter().max().map_or(0, |last| last + 1)];
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
                name_some(&named)
            );
            diagnostics.push(Diagnostic::new(Code::InterfaceAcross, message));
        } else if let Some((&b, _)) = first.first_key_value() {
            sets_of_body[b].push(set.clone());
        }
    }
    sets_of_body
}

/// Returns an error if an entry of the matrix called `name` couples two bodies.
fn coupling(
    matrix: &SymmetricMatrix,
    name: &str,
    component: &[usize],
    rows: &Rows,
    nodes: &Nodes,
) -> Option<Diagnostic> {
    let body_of = |row: usize| component[rows.vertex(row)];
    let (a, b) = (0..matrix.n()).find_map(|row| {
        let other = |&column: &u32| (body_of(row) != body_of(column as usize)).then_some(column);
        matrix.row(row).0.iter().find_map(other).map(|column| (row, column as usize))
    })?;
    let place = |row: usize| format!("node {} of body {}", rows.label(nodes, row).node, body_of(row) + 1);
    let message = format!("{name} couples {} with {}", place(a), place(b));
    Some(Diagnostic::new(Code::BodiesCoupled, message))
}
