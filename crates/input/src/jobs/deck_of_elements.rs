//! Cards of a CalculiX deck that define nodes, elements and materials: the part of a deck by which the stresses of given
//! displacements are computed.

use super::deck::{Card, Deck};
use super::deck_mesh::DeckMesh;
use super::element_kinds::{Family, family};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::text::compression::refuse_packed;
use flexbody_base::text::input_file::InputFile;
use flexbody_model::{Nodes, skin};
use std::collections::BTreeMap;
use std::path::Path;

/// Keywords that are kept, in the form of comparison. Constraints, supports and contacts are left out since all nodes
/// have given displacements, thermal expansion and inelastic materials since the stresses have to be linear.
const KEPT: &[&str] = &[
    "NODE",
    "ELEMENT",
    "NSET",
    "ELSET",
    "SURFACE",
    "MATERIAL",
    "ELASTIC",
    "DENSITY",
    "USERMATERIAL",
    "DEPVAR",
    "ORIENTATION",
    "DISTRIBUTION",
    "SOLIDSECTION",
    "SPRING",
    "DASHPOT",
    "MASS",
    "USERELEMENT",
    "USERSECTION",
];

/// Keywords without which the deck has another stiffness.
const REFUSED: &[&str] = &[
    "PART",
    "INSTANCE",
    "ASSEMBLY",
    "SHELLSECTION",
    "BEAMSECTION",
    "MEMBRANESECTION",
    "HYPERELASTIC",
    "SUBSTRUCTUREGENERATE",
];

/// Nodes, elements and materials of a CalculiX deck.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementDeck {
    /// Cards as text.
    pub text: Vec<u8>,
    /// Titles of the cards that are left out, each once.
    pub left_out: Vec<String>,
    /// Positions of all nodes.
    pub nodes: BTreeMap<i64, [f64; 3]>,
    /// Numbers and nodes of the solid elements.
    pub solids: Vec<(i64, Vec<i64>)>,
    /// Nodes of all elements, ascending.
    pub element_nodes: Vec<i64>,
    /// Nodes on the surface, ascending.
    pub surface: Vec<i64>,
}

impl ElementDeck {
    /// Reads a deck up to its first step.
    ///
    /// # Errors
    /// FB101, FB102 and FB110 for files that cannot be read, FB111 for elements that CalculiX expands and for decks of
    /// parts.
    pub fn read(path: &Path) -> Result<Self> {
        let packed = InputFile::open(path).and_then(|file| refuse_packed(&file, "deck"));
        packed.map_err(Error::from)?;
        let deck = Deck::read(path).map_err(Error::new)?;
        let mesh = DeckMesh::of(&deck).map_err(Error::new)?;
        let cards = deck.cards().iter().take_while(|card| card.keyword != "STEP");
        let (mut text, mut left_out) = (Vec::new(), Vec::<String>::new());
        for card in cards {
            if REFUSED.contains(&card.keyword.as_str()) {
                let message = format!("*{} cannot be used for stresses of given displacements", card.title);
                return Err(refused(deck.about(card, Code::DeckUnsupported, message)));
            }
            if is_kept(card) {
                text.extend(card.head().into_bytes());
                text.extend(deck.text(card).1);
                if !text.ends_with(b"\n") {
                    text.push(b'\n');
                }
            } else if card.keyword != "HEADING" && !left_out.contains(&card.title) {
                left_out.push(card.title.clone());
            }
        }
        let mut solids = Vec::new();
        let mut element_nodes = Vec::new();
        for elements in &mesh.elements {
            match family(&elements.kind) {
                Some(Family::Solid) => solids.extend(elements.members.iter().cloned()),
                Some(Family::Mass) | None => {}
                Some(_) => {
                    let message = format!(
                        "elements of type {} have nodes that CalculiX makes itself, whose displacements cannot be given",
                        elements.kind
                    );
                    let diagnostic = Diagnostic::new(Code::DeckUnsupported, message).in_file(path);
                    return Err(refused(diagnostic));
                }
            }
            element_nodes.extend(elements.members.iter().flat_map(|(_, nodes)| nodes.iter().copied()));
        }
        if solids.is_empty() {
            let message = "the deck has no solid elements";
            return Err(refused(Diagnostic::new(Code::DeckUnsupported, message).in_file(path)));
        }
        element_nodes.sort_unstable();
        element_nodes.dedup();
        let surface = surface(&mesh);
        Ok(Self { text, left_out, nodes: mesh.nodes, solids, element_nodes, surface })
    }
}

/// Returns the nodes on the surface of the elements.
fn surface(mesh: &DeckMesh) -> Vec<i64> {
    let (ids, positions) = mesh.nodes.iter().map(|(id, x)| (*id, *x)).unzip();
    let nodes = Nodes { ids, positions };
    let skin = skin(&mesh.drawn(), &nodes).mesh;
    let on_surface = skin.iter().flat_map(|skin| skin.triangles().iter().flatten());
    let mut on_surface: Vec<i64> = on_surface.map(|node| nodes.ids[*node as usize]).collect();
    on_surface.sort_unstable();
    on_surface.dedup();
    on_surface
}

/// Returns true if a card defines nodes, elements, materials, or the temperature at which these are taken.
fn is_kept(card: &Card) -> bool {
    let is_temperature =
        card.keyword == "INITIALCONDITIONS" && card.name("TYPE").as_deref() == Some("TEMPERATURE");
    KEPT.contains(&card.keyword.as_str()) || is_temperature
}

fn refused(diagnostic: Diagnostic) -> Error {
    diagnostic
        .with_help("write the shapes with --to csv or --to npz, and prescribe them in the FE program")
        .into()
}
