//! Check of the connection of the nodes by the matrices: one body, or several parts.

use super::assembled::Assembled;
use super::wording::in_words;
use super::{Nodes, Rows};
use flexbody_base::diagnostic::{Code, Diagnostic};

/// Checks that K and M together make one body, and that K alone holds it together.
pub(super) fn check_connections(body: &Assembled, found: &mut Vec<Diagnostic>) {
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
    // K R = 0 holds for each part by itself: each has rigid motions of its own for any mass coupling.
    let parts = groups(&component, rows, nodes);
    let message = format!(
        "the stiffness matrix separates {} parts that only the mass matrix couples, each with its rigid motions: {}",
        parts.len(),
        in_words(&parts)
    );
    found.push(Diagnostic::new(Code::Mechanism, message).in_file(&raw.stiffness.path));
}

/// Returns the node numbers of every component, in the order of their first nodes.
pub(super) fn groups(component: &[usize], rows: &Rows, nodes: &Nodes) -> Vec<Vec<i64>> {
    let mut groups = vec![Vec::new(); component.iter().max().map_or(0, |last| last + 1)];
    for (vertex, &c) in component.iter().enumerate() {
        groups[c].push(rows.number(nodes, vertex));
    }
    groups
}
