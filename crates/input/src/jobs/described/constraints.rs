//! Degrees of freedom that a deck eliminates: constraints and supports.

use super::super::couplings::Coupling;
use super::super::deck::{Card, Deck, fields};
use super::super::deck_mesh::DeckMesh;
use super::super::deck_surfaces::Surfaces;
use super::rows::{Program, Rows};
use flexbody_base::diagnostic::{Code, Diagnosed};
use flexbody_base::text::scanner::{excerpt, integer, real};
use flexbody_elements::{Equation, NodeDirection, NotDescribed};
use nalgebra::Vector3;
use std::collections::{BTreeSet, HashSet};

/// Keywords that change the stiffness and are not described.
const OTHERS: &[&str] = &[
    "MPC",
    "NETWORKMPC",
    "CYCLICSYMMETRYMODEL",
    "PRETENSIONSECTION",
    "CONTACTPAIR",
    "CONTACT",
    "MODELCHANGE",
    "SUBMODEL",
    "EMBEDDEDELEMENT",
    "SHELLTOSOLIDCOUPLING",
    "FASTENER",
    "CONNECTORSECTION",
    "FOUNDATION",
    "SUBSTRUCTUREPROPERTY",
    "MATRIXASSEMBLE",
    "JOINT",
    "COHESIVESECTION",
    "GASKETSECTION",
];

/// Constraints of a deck.
pub(super) struct Constraints<'d> {
    deck: &'d Deck,
    mesh: &'d DeckMesh,
    rows: &'d Rows<'d>,
    equations: Vec<Equation>,
    dependent: HashSet<NodeDirection>,
    not_described: Vec<NotDescribed>,
    /// Nodes with axes of their own (*TRANSFORM).
    turned: BTreeSet<i64>,
}

/// Returns the equations of a deck, and the constraints that are not described.
///
/// # Errors
/// FB110 for cards that cannot be read.
pub(in super::super) fn constraints(
    deck: &Deck,
    mesh: &DeckMesh,
    rows: &Rows<'_>,
) -> Diagnosed<(Vec<Equation>, Vec<NotDescribed>)> {
    let turned = deck.cards().iter().filter(|card| card.keyword == "TRANSFORM");
    let turned =
        turned.filter_map(|card| nodes_of(mesh, card.parameter("NSET")?.as_bytes())).flatten().collect();
    let mut reading = Constraints {
        deck,
        mesh,
        rows,
        equations: Vec::new(),
        dependent: HashSet::new(),
        not_described: Vec::new(),
        turned,
    };
    let mut is_within_part = false;
    for card in deck.cards() {
        match card.keyword.as_str() {
            "PART" | "INSTANCE" => is_within_part = true,
            "ENDPART" | "ENDINSTANCE" => is_within_part = false,
            keyword if is_within_part => {
                let is_constraint = matches!(keyword, "EQUATION" | "RIGIDBODY" | "COUPLING" | "TIE");
                if is_constraint || OTHERS.contains(&keyword) {
                    reading.leave_out(card, "constraints of a part are not described", Vec::new());
                }
            }
            _ => reading.card(card)?,
        }
    }
    reading.couplings()?;
    Ok((reading.equations, reading.not_described))
}

/// Returns the node with a number, or the nodes of a set; `None` for an unknown set.
fn nodes_of(mesh: &DeckMesh, field: &[u8]) -> Option<Vec<i64>> {
    let set = || mesh.set(String::from_utf8_lossy(field).trim_matches('"'));
    integer(field).map(|node| vec![node]).or_else(set)
}

impl Constraints<'_> {
    fn card(&mut self, card: &Card) -> Diagnosed<()> {
        let is_calculix = self.rows.program == Program::Calculix;
        match card.keyword.as_str() {
            "BOUNDARY" => self.boundary(card),
            "EQUATION" => self.equations_of(card),
            "RIGIDBODY" if is_calculix => self.rigid_body(card),
            "DISTRIBUTINGCOUPLING" if is_calculix => self.distributing(card),
            "RIGIDBODY" | "COUPLING" | "DISTRIBUTINGCOUPLING" if !is_calculix => {
                self.leave_out(card, "the constraints of Abaqus are not described", Vec::new());
                Ok(())
            }
            "TIE" => {
                let nodes = self.tied(card);
                self.leave_out(card, "ties are not described", nodes);
                Ok(())
            }
            "STEP" if card.parameter("PERTURBATION").is_some() => {
                // CalculiX 2.20: without an earlier step, initial stresses have no effect.
                if self.deck.cards().iter().filter(|card| card.keyword == "STEP").count() > 1 {
                    let reason = "the stiffness has the stress of an earlier step";
                    self.leave_out(card, reason, Vec::new());
                }
                Ok(())
            }
            keyword if OTHERS.contains(&keyword) => {
                let lines = self.deck.data(card).flat_map(|(_, line)| fields(line).collect::<Vec<_>>());
                let is_mpc = keyword == "MPC";
                let nodes = lines.filter(|_| is_mpc).filter_map(|field| nodes_of(self.mesh, field)).flatten();
                let nodes = nodes.collect();
                self.leave_out(card, "the constraint is not described", nodes);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Notes a card that is not described.
    fn leave_out(&mut self, card: &Card, reason: &str, mut nodes: Vec<i64>) {
        nodes.sort_unstable();
        nodes.dedup();
        let what = format!("*{}: {reason}", card.title);
        self.not_described.push(NotDescribed { what, line: self.deck.line(card), nodes });
    }

    /// Adds an equation for a degree of freedom that has no row. The first equation of a degree of freedom counts.
    /// Returns false if it has a row.
    fn add(&mut self, dependent: NodeDirection, terms: Vec<(NodeDirection, f64)>) -> bool {
        let dependent = self.rows.of_model(dependent);
        if self.rows.has(dependent) {
            return false;
        }
        if self.dependent.insert(dependent) {
            let terms = terms.into_iter().map(|(term, factor)| (self.rows.of_model(term), factor)).collect();
            self.equations.push(Equation { dependent, terms });
        }
        true
    }

    /// Adds equations of a card whose dependent degrees of freedom have no rows.
    fn add_all(&mut self, card: &Card, equations: Vec<Equation>) {
        let mut with_rows = Vec::new();
        for Equation { dependent, terms } in equations {
            if !self.add(dependent, terms) {
                with_rows.push(dependent.0);
            }
        }
        if !with_rows.is_empty() {
            self.leave_out(card, "its dependent degrees of freedom have rows", with_rows);
        }
    }

    fn syntax<T>(&self, card: &Card, line: usize, expected: &str, text: &[u8]) -> Diagnosed<T> {
        let message = format!("*{}: expected {expected}, found `{}`", card.title, excerpt(text));
        Err(vec![self.deck.at(card, line, Code::DeckSyntax, message).with_help("correct the line")])
    }

    /// Reads supports: lines `node or set, first direction, last direction, value`. A given displacement leaves the rows
    /// out as a support does.
    fn boundary(&mut self, card: &Card) -> Diagnosed<()> {
        for (line, text) in self.deck.data(card) {
            let given: Vec<&[u8]> = fields(text).collect();
            let nodes = given.first().and_then(|field| nodes_of(self.mesh, field));
            let (Some(nodes), Some(directions)) = (nodes, directions(&given)) else {
                return self.syntax(card, line, "a node or node set and its directions", text);
            };
            for node in nodes {
                if !self.turned.contains(&node) {
                    directions.iter().for_each(|direction| _ = self.add((node, *direction), Vec::new()));
                } else if (1..=3).all(|k| !self.rows.has(self.rows.of_model((node, k)))) {
                    (1..=3).for_each(|direction| _ = self.add((node, direction), Vec::new()));
                } else {
                    self.leave_out(card, "the node has axes of its own (*TRANSFORM)", vec![node]);
                }
            }
        }
        Ok(())
    }

    /// Reads linear equations: the number of terms, and lines with node, direction and factor of up to four terms.
    fn equations_of(&mut self, card: &Card) -> Diagnosed<()> {
        if card.parameter("REMOVE").is_some() {
            return Ok(());
        }
        let mut equations = Vec::new();
        let mut lines = self.deck.data(card);
        while let Some((line, text)) = lines.next() {
            let count = fields(text).next().and_then(integer).and_then(|count| usize::try_from(count).ok());
            let Some(count) = count.filter(|count| *count > 0) else {
                return self.syntax(card, line, "the number of terms", text);
            };
            let mut terms: Vec<(NodeDirection, f64)> = Vec::new();
            while terms.len() < count {
                let Some((line, text)) = lines.next() else {
                    return self.syntax(card, line, "a line with the terms", text);
                };
                let given: Vec<&[u8]> = fields(text).collect();
                for term in given.chunks(3).filter(|term| term.iter().any(|field| !field.is_empty())) {
                    match self.term(term) {
                        Some(term) => terms.push(term),
                        None => return self.syntax(card, line, "node, direction and factor of terms", text),
                    }
                }
            }
            let nodes: Vec<i64> = terms.iter().map(|((node, _), _)| *node).collect();
            let (dependent, factor) = terms.remove(0);
            if nodes.iter().any(|node| self.turned.contains(node)) {
                self.leave_out(card, "nodes of the equation have axes of their own (*TRANSFORM)", nodes);
            } else if factor == 0.0 {
                self.leave_out(card, "the factor of the first term is zero", nodes);
            } else {
                let terms = terms.into_iter().map(|(term, other)| (term, -other / factor)).collect();
                equations.push(Equation { dependent, terms });
            }
        }
        self.add_all(card, equations);
        Ok(())
    }

    /// Returns a term of an equation. A set must have a single node.
    fn term(&self, fields: &[&[u8]]) -> Option<(NodeDirection, f64)> {
        let &[node, direction, factor] = fields else { return None };
        let nodes = nodes_of(self.mesh, node)?;
        let &[node] = nodes.as_slice() else { return None };
        let direction =
            integer(direction).and_then(|k| u8::try_from(k).ok()).filter(|k| (1..=6).contains(k))?;
        Some(((node, direction), real(factor).filter(|value| value.is_finite())?))
    }

    /// Reads *RIGID BODY: all nodes move as u + theta x r with the displacement u of REF NODE, the displacement theta of
    /// ROT NODE, and r from the reference node to the node.
    fn rigid_body(&mut self, card: &Card) -> Diagnosed<()> {
        let node = |name: &str| card.parameter(name).and_then(|text| integer(text.as_bytes()));
        let nodes = match (card.parameter("NSET"), card.parameter("ELSET")) {
            (Some(set), _) => self.mesh.set(set),
            (None, Some(set)) => self.mesh.nodes_of_elements(set),
            (None, None) => None,
        };
        let (Some(reference), Some(rotation), Some(nodes)) = (node("REFNODE"), node("ROTNODE"), nodes) else {
            let message = "*RIGID BODY: its nodes, REF NODE or ROT NODE are unknown";
            let help = "write *RIGID BODY, NSET=SET, REF NODE=A, ROT NODE=B";
            return Err(vec![self.deck.about(card, Code::DeckSyntax, message).with_help(help)]);
        };
        let turns = [1, 2, 3].map(|k| self.rows.of_model((rotation, k)));
        self.follow(card, &nodes, &[1, 2, 3], reference, turns)
    }

    /// Adds that directions of nodes follow a reference node, whose rotations are `turns`.
    fn follow(
        &mut self,
        card: &Card,
        nodes: &[i64],
        directions: &[u8],
        reference: i64,
        turns: [NodeDirection; 3],
    ) -> Diagnosed<()> {
        let place = |node: i64| {
            self.mesh.nodes.get(&node).map(|x| Vector3::from(*x)).ok_or_else(|| {
                let message = format!("*{}: node {node} is not in the deck", card.title);
                let diagnostic = self.deck.about(card, Code::DeckSyntax, message);
                vec![diagnostic.with_help("name nodes of the deck")]
            })
        };
        let origin = place(reference)?;
        let mut equations = Vec::new();
        for node in nodes.iter().filter(|node| **node != reference) {
            let arm = place(*node)? - origin;
            for direction in directions {
                let i = usize::from(*direction) - 1;
                // Component i of e_k x r for each axis k.
                let turned = (0..3).map(|k| (turns[k], Vector3::ith(k, 1.0).cross(&arm)[i]));
                let own = std::iter::once(((reference, *direction), 1.0));
                let terms = own.chain(turned.filter(|(_, factor)| *factor != 0.0)).collect();
                equations.push(Equation { dependent: (*node, *direction), terms });
            }
        }
        if nodes.iter().any(|node| self.turned.contains(node)) {
            self.leave_out(card, "nodes have axes of their own (*TRANSFORM)", nodes.to_vec());
        } else {
            self.add_all(card, equations);
        }
        Ok(())
    }

    /// Reads *DISTRIBUTING COUPLING of CalculiX: the reference node moves as the weighted mean of its nodes, the first of
    /// which has no rows.
    fn distributing(&mut self, card: &Card) -> Diagnosed<()> {
        let element = card.parameter("ELSET").and_then(|set| self.mesh.nodes_of_elements(set));
        let Some(&[reference]) = element.as_deref() else { return Ok(()) };
        let mut weights: Vec<(i64, f64)> = Vec::new();
        for (line, text) in self.deck.data(card) {
            let given: Vec<&[u8]> = fields(text).collect();
            let nodes = given.first().and_then(|field| nodes_of(self.mesh, field));
            let weight = given.get(1).and_then(|field| real(field)).filter(|weight| weight.is_finite());
            let (Some(nodes), Some(weight)) = (nodes, weight) else {
                return self.syntax(card, line, "a node or node set and its weight", text);
            };
            weights.extend(nodes.into_iter().map(|node| (node, weight)));
        }
        let Some(&(first, own)) = weights.first() else { return Ok(()) };
        let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
        let nodes: HashSet<i64> = weights.iter().map(|(node, _)| *node).collect();
        if own == 0.0 || nodes.len() != weights.len() {
            let nodes = weights.iter().map(|(node, _)| *node).collect();
            self.leave_out(card, "its weights are zero, or a node is named twice", nodes);
            return Ok(());
        }
        let equation = |direction: u8| {
            let others = weights[1..].iter().map(|(node, weight)| ((*node, direction), -weight / own));
            let terms = std::iter::once(((reference, direction), total / own)).chain(others).collect();
            Equation { dependent: (first, direction), terms }
        };
        self.add_all(card, (1..=3).map(equation).collect());
        Ok(())
    }

    /// Reads kinematic couplings: directions of the nodes of a surface follow the reference node.
    fn couplings(&mut self) -> Diagnosed<()> {
        if self.rows.program != Program::Calculix {
            return Ok(());
        }
        let surfaces = Surfaces::of(self.deck, self.mesh);
        for coupling in Coupling::all(self.deck) {
            let card = coupling.card;
            let reference = coupling.reference(self.deck, self.mesh)?;
            let nodes = card.name("SURFACE").and_then(|surface| surfaces.nodes(&surface));
            let nodes: Vec<i64> = nodes.into_iter().flatten().collect();
            let turns = [4, 5, 6].map(|k| (reference, k));
            let is_turned = card.parameter("ORIENTATION").is_some();
            if nodes.is_empty() || is_turned || !turns.iter().any(|turn| self.rows.has(*turn)) {
                let reason = "its axes, surface or rotations are not described";
                self.leave_out(card, reason, nodes);
                continue;
            }
            let mut directions = BTreeSet::new();
            for (line, text) in coupling.kinematic.iter().flat_map(|card| self.deck.data(card)) {
                // The form of supports, without a node.
                let given: Vec<&[u8]> = std::iter::once(&b""[..]).chain(fields(text)).collect();
                match self::directions(&given) {
                    Some(range) => directions.extend(range.into_iter().filter(|k| *k <= 3)),
                    None => return self.syntax(card, line, "the first and the last direction", text),
                }
            }
            let directions: Vec<u8> = directions.into_iter().collect();
            self.follow(card, &nodes, &directions, reference, turns)?;
        }
        Ok(())
    }

    /// Returns the nodes of the surfaces of a *TIE; empty if a surface is unknown.
    fn tied(&self, card: &Card) -> Vec<i64> {
        let surfaces = Surfaces::of(self.deck, self.mesh);
        let names: Vec<String> = self
            .deck
            .data(card)
            .flat_map(|(_, line)| fields(line).take(2).collect::<Vec<_>>())
            .map(|field| crate::sets::comparable(&String::from_utf8_lossy(field)))
            .collect();
        let found: Option<Vec<BTreeSet<i64>>> = names.iter().map(|name| surfaces.nodes(name)).collect();
        found.unwrap_or_default().into_iter().flatten().collect()
    }
}

/// Returns the directions of a support, 1 to 6, by the second and the third field of its line, or by a name of Abaqus.
/// Directions of temperature and other quantities are left out.
fn directions(fields: &[&[u8]]) -> Option<Vec<u8>> {
    let first = *fields.get(1)?;
    let named: Option<&[u8]> = match first.to_ascii_uppercase().as_slice() {
        b"ENCASTRE" => Some(&[1, 2, 3, 4, 5, 6]),
        b"PINNED" => Some(&[1, 2, 3]),
        b"XSYMM" => Some(&[1, 5, 6]),
        b"YSYMM" => Some(&[2, 4, 6]),
        b"ZSYMM" => Some(&[3, 4, 5]),
        b"XASYMM" => Some(&[2, 3, 4]),
        b"YASYMM" => Some(&[1, 3, 5]),
        b"ZASYMM" => Some(&[1, 2, 6]),
        _ => None,
    };
    if let Some(named) = named {
        return Some(named.to_vec());
    }
    let first = integer(first)?;
    let last = match fields.get(2) {
        Some(field) if !field.is_empty() => integer(field)?,
        _ => first,
    };
    Some((first.max(1)..=last.min(6)).map(|k| k as u8).collect())
}
