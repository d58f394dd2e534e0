//! Elements, materials and springs of a keyword deck, of which its stiffness matrix is assembled.

mod constraints;
mod internal;
mod materials;
mod orientations;
mod rows;
mod springs;

pub(super) use rows::{Program, Rows as DescribedRows};

use super::deck::{Card, Deck};
use super::deck_mesh::{DeckMesh, PlacedScope};
use super::deck_scope::Elements;
use super::element_kinds::{Role, n_nodes, role};
use crate::element_source::is_isotropic;
use crate::sets::{comparable, dotted};
pub(super) use constraints::constraints;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_elements::{Axes, DescribedElements, Elasticity, ElementGroup, NotDescribed, Section};
use internal::with_internal_nodes;
use materials::{Material, materials};
use orientations::orientation;
use rows::Rows;
use springs::{ReadSprings, Springs};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Elements of a deck that are described, and their stated properties.
#[derive(Debug, Default)]
pub(super) struct Requested {
    /// Element set, or node set whose elements are meant; `None` for all elements.
    pub set: Option<String>,
    /// Type in place of that of the deck.
    pub kind: Option<String>,
    /// Elasticity in place of the materials of the deck.
    pub elasticity: Option<Elasticity>,
}

/// Describes the elements of a deck whose scopes were kept.
///
/// # Errors
/// FB110 for cards that cannot be read, FB220 for an unknown set.
pub(super) fn described(
    deck: &Deck,
    mesh: &DeckMesh,
    rows: &Rows<'_>,
    requested: &Requested,
) -> Diagnosed<DescribedElements> {
    let mut reading = Describing {
        deck,
        mesh,
        rows,
        requested,
        materials: materials(deck)?,
        described: DescribedElements { path: deck.path().to_path_buf(), ..DescribedElements::default() },
        others: BTreeMap::new(),
    };
    let mut is_found = false;
    for scope in &mesh.scopes {
        let meant = reading.meant(scope)?;
        is_found |= meant.as_ref().is_none_or(|meant| !meant.is_empty());
        reading.scope(scope, meant.as_ref())?;
    }
    if let Some(set) = requested.set.as_ref().filter(|_| !is_found) {
        let message = format!("the deck has no elements in the set `{set}`");
        let diagnostic = Diagnostic::new(Code::NodeSetUnknown, message).in_file(deck.path());
        return Err(vec![diagnostic.with_help("name an element set or a node set of the deck")]);
    }
    let mut described = reading.finished();
    let (equations, not_described) = constraints(deck, mesh, rows)?;
    described.equations = equations;
    described.not_described.extend(not_described);
    Ok(with_internal_nodes(described, rows, |node| mesh.nodes.contains_key(&node)))
}

/// Describes the elements of the deck of a job, whose matrices are sound without them: a card that cannot be read is a reason
/// why nothing is described.
pub(super) fn described_of_job(deck: &Deck, mesh: &DeckMesh, rows: &Rows<'_>) -> DescribedElements {
    described(deck, mesh, rows, &Requested::default()).unwrap_or_else(|found| {
        let reason = found.first().map_or("the deck cannot be read", Diagnostic::message);
        let line = found.first().and_then(Diagnostic::line);
        let mut described = nothing(deck, reason);
        described.not_described.iter_mut().for_each(|part| part.line = line);
        described
    })
}

/// Returns the description of a deck of which nothing is described, with the reason in words.
pub(super) fn nothing(deck: &Deck, reason: &str) -> DescribedElements {
    let not_described = vec![NotDescribed { what: reason.to_owned(), line: None, nodes: Vec::new() }];
    DescribedElements { not_described, path: deck.path().to_path_buf(), ..DescribedElements::default() }
}

/// Elements that are not described: their number and nodes.
#[derive(Debug, Default)]
struct Others {
    count: usize,
    nodes: Vec<i64>,
}

/// State of describing a deck.
struct Describing<'d> {
    deck: &'d Deck,
    mesh: &'d DeckMesh,
    rows: &'d Rows<'d>,
    requested: &'d Requested,
    materials: HashMap<String, Material>,
    described: DescribedElements,
    /// Elements that are not described, by type and reason.
    others: BTreeMap<(String, String), Others>,
}

/// Section, or the reason in words why it is not described.
type ReadSection = Result<Section, String>;

/// Sections of a scope, and the section of each element by its number.
struct Sections {
    all: Vec<ReadSection>,
    of_elements: HashMap<i64, usize>,
}

impl<'d> Describing<'d> {
    /// Returns the numbers in a scope of the elements that are requested; `None` for all.
    fn meant(&self, scope: &PlacedScope) -> Diagnosed<Option<HashSet<i64>>> {
        let Some(set) = &self.requested.set else { return Ok(None) };
        let sets = &self.mesh.sets;
        let of_instance = || {
            let own = dotted(set)
                .find(|(name, _)| sets.instance(name).is_some_and(|at| Some(at) == scope.instance));
            own.and_then(|(_, rest)| sets.elements_of(scope.instance, rest))
        };
        if let Some(elements) = sets.elements_of(scope.instance, set).or_else(of_instance) {
            return Ok(Some(elements.into_iter().collect()));
        }
        let Some(nodes) = sets.find(set) else { return Ok(Some(HashSet::new())) };
        let nodes: HashSet<i64> = nodes.map_err(|diagnostic| vec![diagnostic])?.into_iter().collect();
        let members = scope.scope.elements.iter().flat_map(|elements| elements.members.iter());
        let is_within = |own: &[i64]| own.iter().all(|node| nodes.contains(&(node + scope.shift)));
        Ok(Some(members.filter(|(_, own)| is_within(own)).map(|(id, _)| *id).collect()))
    }

    fn scope(&mut self, scope: &PlacedScope, meant: Option<&HashSet<i64>>) -> Diagnosed<()> {
        let sections = self.sections(scope)?;
        let (cards, of_elements) = self.cards(scope, "SPRING")?;
        let springs = Springs { deck: self.deck, mesh: self.mesh, rows: self.rows, cards, of_elements };
        for Elements { kind, members } in scope.scope.elements.iter() {
            let chosen: Vec<(i64, Vec<i64>)>;
            let members = match meant {
                Some(meant) => {
                    chosen = members.iter().filter(|(id, _)| meant.contains(id)).cloned().collect();
                    &chosen
                }
                None => members.as_ref(),
            };
            match role(kind) {
                Role::Solid => self.solids(scope, kind, members, &sections),
                Role::Spring => {
                    let ReadSprings { direct, others } = springs.read(kind, members, scope.shift)?;
                    self.described.direct.extend(direct);
                    others.iter().for_each(|(reason, nodes)| self.leave_out(kind, reason, nodes));
                }
                Role::WithoutStiffness => {}
                Role::Other(reason) => {
                    let of_model =
                        |nodes: &[i64]| nodes.iter().map(|node| node + scope.shift).collect::<Vec<_>>();
                    members.iter().for_each(|(_, nodes)| self.leave_out(kind, reason, &of_model(nodes)));
                }
            }
        }
        Ok(())
    }

    /// Counts an element that is not described.
    fn leave_out(&mut self, kind: &str, reason: &str, nodes: &[i64]) {
        let others = self.others.entry((kind.to_owned(), reason.to_owned())).or_default();
        others.count += 1;
        others.nodes.extend(nodes);
    }

    /// Returns the cards of a keyword in a scope, and the place of the last one that names each element.
    ///
    /// # Errors
    /// FB110 for a card whose element set is unknown.
    fn cards(&self, scope: &PlacedScope, keyword: &str) -> Diagnosed<(Vec<&'d Card>, HashMap<i64, usize>)> {
        let cards = scope.scope.cards.iter().map(|at| &self.deck.cards()[*at]);
        let cards: Vec<&Card> = cards.filter(|card| card.keyword == keyword).collect();
        let mut of_elements = HashMap::new();
        for (at, card) in cards.iter().enumerate() {
            let set = card.parameter("ELSET").unwrap_or_default();
            let members = self.mesh.sets.elements_of(scope.instance, set).ok_or_else(|| {
                let message = format!("*{}: element set `{set}` is unknown", card.title);
                let diagnostic = self.deck.about(card, Code::DeckSyntax, message);
                vec![diagnostic.with_help("name an element set that the deck defines")]
            })?;
            of_elements.extend(members.into_iter().map(|id| (id, at)));
        }
        Ok((cards, of_elements))
    }

    /// Returns the sections of a scope.
    ///
    /// # Errors
    /// FB110 for cards that cannot be read.
    fn sections(&self, scope: &PlacedScope) -> Diagnosed<Sections> {
        if let Some(elasticity) = self.requested.elasticity {
            let section = Section { material: "stated".to_owned(), elasticity, axes: Axes::Model };
            let elements = scope.scope.elements.iter().flat_map(|elements| elements.members.iter());
            let of_elements = elements.map(|(id, _)| (*id, 0)).collect();
            return Ok(Sections { all: vec![Ok(section)], of_elements });
        }
        let (cards, of_elements) = self.cards(scope, "SOLIDSECTION")?;
        let all = cards.into_iter().map(|card| self.section(scope, card)).collect::<Diagnosed<_>>()?;
        Ok(Sections { all, of_elements })
    }

    /// Reads material and axes of a *SOLID SECTION.
    fn section(&self, scope: &PlacedScope, card: &Card) -> Diagnosed<ReadSection> {
        if card.parameter("COMPOSITE").is_some() {
            return Ok(Err("*SOLID SECTION, COMPOSITE".to_owned()));
        }
        let name = card.parameter("MATERIAL").unwrap_or_default();
        let elasticity = match self.materials.get(&comparable(name)) {
            Some(Ok(elasticity)) => *elasticity,
            Some(Err(reason)) => return Ok(Err(format!("material `{name}`: {reason}"))),
            None => {
                let message = format!("*SOLID SECTION: material `{name}` is unknown");
                let diagnostic = self.deck.about(card, Code::DeckSyntax, message);
                return Err(vec![diagnostic.with_help("name a material that the deck defines")]);
            }
        };
        let axes = match card.name("ORIENTATION").filter(|name| !name.is_empty()) {
            Some(orientation) if !is_isotropic(&elasticity) => self.axes(scope, card, &orientation)?,
            _ if is_isotropic(&elasticity) || scope.moved.rotation().angle() == 0.0 => Ok(Axes::Model),
            _ => Err("an anisotropic material without *ORIENTATION in a rotated instance".to_owned()),
        };
        Ok(axes.map(|axes| Section { material: name.to_owned(), elasticity, axes }))
    }

    /// Returns the axes of the orientation that a section of a scope names.
    fn axes(&self, scope: &PlacedScope, section: &Card, name: &str) -> Diagnosed<Result<Axes, String>> {
        let of = |scope: &PlacedScope| {
            let cards = scope.scope.cards.iter().rev().map(|at| &self.deck.cards()[*at]);
            cards
                .filter(|card| card.keyword == "ORIENTATION")
                .find(|card| card.name("NAME").as_deref() == Some(name))
        };
        match of(scope) {
            Some(card) => orientation(self.deck, card, &scope.moved),
            None => {
                let message = format!("*{}: orientation `{name}` is unknown", section.title);
                let diagnostic = self.deck.about(section, Code::DeckSyntax, message);
                Err(vec![diagnostic.with_help("name an *ORIENTATION that the deck defines")])
            }
        }
    }

    /// Adds solid elements of one type.
    fn solids(&mut self, scope: &PlacedScope, kind: &str, members: &[(i64, Vec<i64>)], sections: &Sections) {
        let mut groups: BTreeMap<(usize, usize), ElementGroup> = BTreeMap::new();
        for (id, nodes) in members {
            // CalculiX ignores what follows the nodes of an element on its line.
            let count = n_nodes(kind).unwrap_or(nodes.len());
            let nodes: Vec<i64> = nodes.iter().take(count).map(|node| node + scope.shift).collect();
            let at = sections.of_elements.get(id).copied();
            let section = match at.map(|at| &sections.all[at]) {
                Some(Ok(section)) => section,
                Some(Err(reason)) => {
                    self.leave_out(kind, reason, &nodes);
                    continue;
                }
                None => {
                    self.leave_out(kind, "no *SOLID SECTION", &nodes);
                    continue;
                }
            };
            if let Some(node) = nodes.iter().find(|node| !self.mesh.nodes.contains_key(node)) {
                self.leave_out(kind, &format!("node {node} is not in the deck"), &nodes);
                continue;
            }
            // Elements with other numbers of nodes are separate groups, so that all of a group have equally many.
            let group = groups.entry((at.unwrap_or_default(), nodes.len())).or_insert_with(|| ElementGroup {
                kind: self.requested.kind.clone().unwrap_or_else(|| kind.to_owned()),
                section: section.clone(),
                ids: Vec::new(),
                nodes: Vec::new(),
                internal: Vec::new(),
            });
            group.ids.push(id + scope.shift);
            for node in &nodes {
                self.described.positions.insert(*node, self.mesh.nodes[node]);
            }
            group.nodes.extend(nodes);
        }
        groups.into_values().for_each(|group| self.join(group));
    }

    /// Adds a group, to the group with the same type and section if there is one.
    fn join(&mut self, group: ElementGroup) {
        let nodes_each = |group: &ElementGroup| group.nodes.len() / group.ids.len().max(1);
        let same = self.described.groups.iter_mut().find(|other| {
            other.kind == group.kind
                && other.section == group.section
                && nodes_each(other) == nodes_each(&group)
        });
        match same {
            Some(other) => {
                other.ids.extend(group.ids);
                other.nodes.extend(group.nodes);
            }
            None => self.described.groups.push(group),
        }
    }

    fn finished(mut self) -> DescribedElements {
        for ((kind, reason), Others { count, nodes }) in self.others {
            self.described.not_described.push(NotDescribed::elements(&kind, &reason, count, nodes));
        }
        self.described
    }
}

#[cfg(test)]
mod tests;
