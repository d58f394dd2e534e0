//! Elements of a keyword deck that no body is made of: those that are refused, and dashpots, which are left out.

use super::deck_mesh::DeckMesh;
use super::element_kinds::is_axisymmetric;
use super::job::damping_left_out;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use std::collections::BTreeSet;
use std::path::Path;

/// Returns FB111 for elements of bodies of revolution, whose rows cannot be those of a body in space.
pub(super) fn refuse_axisymmetric(mesh: &DeckMesh, deck: &Path) -> Diagnosed<()> {
    let why = "axisymmetric models have radius and axis for coordinates, and no motion across their plane";
    let help = "revolve the mesh, and write K and M of solid elements in space";
    refuse_elements(mesh, is_axisymmetric, why, help, deck)
}

/// Returns FB111 if the deck has elements whose type `is_refused`; `why` says in words what they are.
pub(super) fn refuse_elements(
    mesh: &DeckMesh,
    is_refused: impl Fn(&str) -> bool,
    why: &str,
    help: &'static str,
    deck: &Path,
) -> Diagnosed<()> {
    let kinds = mesh.elements.iter().map(|elements| elements.kind.as_str()).filter(|kind| is_refused(kind));
    let kinds: Vec<&str> = kinds.collect::<BTreeSet<_>>().into_iter().collect();
    if kinds.is_empty() {
        return Ok(());
    }
    let message = format!("elements of type {}: {why}", kinds.join(", "));
    Err(vec![Diagnostic::new(Code::DeckUnsupported, message).in_file(deck).with_help(help)])
}

/// Returns the warning about dashpots of a keyword deck, if it has some.
pub(super) fn dashpots_left_out(mesh: &DeckMesh, deck: &Path) -> Option<Diagnostic> {
    let dashpots = mesh.elements.iter().filter(|elements| elements.kind.starts_with("DASHPOT"));
    damping_left_out(dashpots.map(|elements| elements.members.len()).sum(), "dashpots", deck)
}
