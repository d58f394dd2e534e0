//! Linear springs of a deck: SPRINGA, SPRING1 and SPRING2 with *SPRING.

use super::super::deck::{Card, Deck, fields};
use super::super::deck_mesh::DeckMesh;
use super::rows::Rows;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::scanner::{excerpt, integer, real};
use flexbody_elements::{NodeDirection, NodeStiffness};
use nalgebra::Vector3;
use std::collections::HashMap;

/// Spring constant and directions of a *SPRING, or the reason in words why it is not described.
type Spring = Result<(Vec<u8>, f64), String>;

/// Reads the springs of a type.
pub(super) struct Springs<'d> {
    pub deck: &'d Deck,
    pub mesh: &'d DeckMesh,
    /// Cards *SPRING, and the place of the card of each element.
    pub cards: Vec<&'d Card>,
    pub of_elements: HashMap<i64, usize>,
    pub rows: &'d Rows<'d>,
}

/// Springs that are described, and the reasons for the others, each with its nodes.
#[derive(Debug, Default)]
pub(super) struct ReadSprings {
    pub direct: Vec<NodeStiffness>,
    pub others: Vec<(String, Vec<i64>)>,
}

impl Springs<'_> {
    /// Reads elements with numbers and nodes of the scope, `shift` below those of the model.
    ///
    /// # Errors
    /// FB110 for *SPRING that cannot be read.
    pub(super) fn read(&self, kind: &str, members: &[(i64, Vec<i64>)], shift: i64) -> Diagnosed<ReadSprings> {
        let mut read = ReadSprings::default();
        let mut known: HashMap<usize, Spring> = HashMap::new();
        for (id, nodes) in members {
            let nodes: Vec<i64> = nodes.iter().map(|node| node + shift).collect();
            let Some(at) = self.of_elements.get(id) else {
                read.others.push(("no *SPRING".to_owned(), nodes));
                continue;
            };
            if !known.contains_key(at) {
                known.insert(*at, self.spring(kind, self.cards[*at])?);
            }
            let made = match &known[at] {
                Ok((directions, constant)) => self.stiffness(kind, id + shift, &nodes, directions, *constant),
                Err(reason) => Err(reason.clone()),
            };
            match made {
                Ok(spring) => read.direct.push(spring),
                Err(reason) => read.others.push((reason, nodes)),
            }
        }
        Ok(read)
    }

    /// Reads the directions and the constant of a *SPRING.
    fn spring(&self, kind: &str, card: &Card) -> Diagnosed<Spring> {
        for parameter in ["NONLINEAR", "ORIENTATION", "RTOL", "COMPLEXSTIFFNESS"] {
            if card.parameter(parameter).is_some() {
                return Ok(Err(format!("*SPRING with {parameter}")));
            }
        }
        let lines: Vec<(usize, &[u8])> = self.deck.data(card).collect();
        let n_directions = match kind {
            "SPRING1" => 1,
            "SPRING2" => 2,
            _ => 0,
        };
        let refused = |line: Option<usize>, found: &[u8]| -> Vec<Diagnostic> {
            let form = match n_directions {
                0 => "a blank line, and below it the spring constant",
                1 => "a direction, and below it the spring constant",
                _ => "two directions, and below them the spring constant",
            };
            let message = format!("*SPRING: expected {form}, found `{}`", excerpt(found));
            let diagnostic = match line {
                Some(line) => self.deck.at(card, line, Code::DeckSyntax, message),
                None => self.deck.about(card, Code::DeckSyntax, message),
            };
            vec![diagnostic.with_help("correct the line")]
        };
        // The first line of SPRINGA is blank, or has only commas.
        let is_blank = |line: &[u8]| fields(line).all(<[u8]>::is_empty);
        let mut rest = lines.iter().filter(|(_, text)| !is_blank(text));
        let mut directions = Vec::new();
        if n_directions > 0 {
            let Some((line, text)) = rest.next() else { return Err(refused(None, b"")) };
            let read: Option<Vec<u8>> = fields(text)
                .filter(|field| !field.is_empty())
                .map(|field| integer(field).and_then(|value| u8::try_from(value).ok()))
                .collect();
            directions = read
                .filter(|read| read.len() == n_directions && read.iter().all(|k| (1..=6).contains(k)))
                .ok_or_else(|| refused(Some(*line), text))?;
        }
        let Some((line, text)) = rest.next() else { return Err(refused(None, b"")) };
        let constant = fields(text).next().and_then(real).filter(|value| value.is_finite());
        let constant = constant.ok_or_else(|| refused(Some(*line), text))?;
        Ok(match rest.next() {
            None => Ok((directions, constant)),
            Some(_) => Err("*SPRING whose constant depends on temperature".to_owned()),
        })
    }

    /// Returns the stiffness of a spring.
    fn stiffness(
        &self,
        kind: &str,
        id: i64,
        nodes: &[i64],
        directions: &[u8],
        constant: f64,
    ) -> Result<NodeStiffness, String> {
        // Row of each degree of freedom, and the factor of its displacement in the elongation.
        let elongation: Vec<(NodeDirection, f64)> = match (kind, nodes, directions) {
            ("SPRING1", &[node], &[k]) => vec![((node, k), 1.0)],
            ("SPRING2", &[a, b], &[i, j]) => vec![((a, i), 1.0), ((b, j), -1.0)],
            ("SPRINGA", &[a, b], _) => {
                let place = |node: i64| self.mesh.nodes.get(&node).map(|x| Vector3::from(*x));
                let along = place(a).zip(place(b)).and_then(|(a, b)| (b - a).try_normalize(0.0));
                let along = along.ok_or("ends at one point")?;
                let of = |node: i64, sign: f64| {
                    (1..=3u8).map(move |k| ((node, k), sign * along[usize::from(k) - 1]))
                };
                of(a, -1.0).chain(of(b, 1.0)).collect()
            }
            _ => return Err("an unexpected number of nodes".to_owned()),
        };
        let rows = elongation.iter().map(|(row, _)| self.rows.of_model(*row));
        let factors = || elongation.iter().map(|(_, factor)| *factor);
        let matrix = factors().flat_map(|a| factors().map(move |b| constant * a * b)).collect();
        Ok(NodeStiffness { name: format!("spring {id}"), rows: rows.collect(), matrix })
    }
}
