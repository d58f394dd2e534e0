//! Places of the degrees of freedom of elements among the rows of the stiffness matrix.

use crate::{DescribedElements, Equation, NodeDirection};
use std::collections::{BTreeSet, HashMap};

/// Depth of equations whose terms are dependent themselves, above which they are taken to be circular.
const MAX_DEPTH: usize = 50;

/// Rows that a displacement of a node consists of: u = sum of factors times rows. Most nodes have rows of their own.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Place {
    /// A row of its own.
    Row(u32),
    /// Rows of other degrees of freedom with their factors; none if the displacement is held at zero.
    Follows(Vec<(u32, f64)>),
}

/// Nodes of elements, with the places of their displacements.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Places {
    /// Numbers of the nodes: those of the deck in ascending order, then those inside elements.
    pub nodes: Vec<i64>,
    /// Positions of the nodes of the deck.
    pub positions: Vec<[f64; 3]>,
    /// Places along x, y, z for each node.
    pub of_nodes: Vec<[Place; 3]>,
    index: HashMap<i64, u32>,
}

impl Places {
    /// Returns the places of the nodes of all elements in a matrix whose rows are `labels`.
    ///
    /// # Errors
    /// The degrees of freedom that have no row and no equation, ascending.
    pub(crate) fn of(
        described: &DescribedElements,
        labels: &[NodeDirection],
    ) -> Result<Self, Vec<NodeDirection>> {
        let members = described.groups.iter().flat_map(|group| &group.nodes);
        let of_deck: BTreeSet<i64> = members.copied().collect();
        let inside = described.groups.iter().flat_map(|group| &group.internal).copied();
        let nodes: Vec<i64> = of_deck.iter().copied().chain(inside).collect();
        let position = |id: &i64| described.positions.get(id).copied().unwrap_or([f64::NAN; 3]);
        let positions = of_deck.iter().map(position).collect();
        let rows = Rows::new(labels, &described.equations);
        let mut missing = Vec::new();
        let mut place = |at: NodeDirection| {
            rows.place(at).unwrap_or_else(|| {
                missing.push(at);
                Place::Follows(Vec::new())
            })
        };
        let of_nodes =
            nodes.iter().map(|&node| [1, 2, 3].map(|direction| place((node, direction)))).collect();
        let index = nodes.iter().copied().zip(0..).collect();
        if missing.is_empty() { Ok(Self { nodes, positions, of_nodes, index }) } else { Err(missing) }
    }

    /// Returns the index of a node.
    ///
    /// # Panics
    /// If no element has the node.
    pub(crate) fn index(&self, node: i64) -> usize {
        self.index[&node] as usize
    }
}

/// Rows of a matrix by their labels, and the equations of degrees of freedom without rows.
pub(crate) struct Rows<'d> {
    rows: HashMap<NodeDirection, u32>,
    equations: HashMap<NodeDirection, &'d Equation>,
}

impl<'d> Rows<'d> {
    pub(crate) fn new(labels: &[NodeDirection], equations: &'d [Equation]) -> Self {
        Self {
            rows: labels.iter().copied().zip(0..).collect(),
            equations: equations.iter().map(|equation| (equation.dependent, equation)).collect(),
        }
    }

    /// Returns the place of a degree of freedom; `None` if it has neither a row nor an equation, or if its equations are
    /// circular.
    pub(crate) fn place(&self, at: NodeDirection) -> Option<Place> {
        if let Some(&row) = self.rows.get(&at) {
            return Some(Place::Row(row));
        }
        let mut terms = Vec::new();
        self.add_terms(at, 1.0, 0, &mut terms)?;
        terms.sort_by_key(|&(row, _)| row);
        terms.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 += next.1;
            }
            same
        });
        Some(Place::Follows(terms))
    }

    fn add_terms(
        &self,
        at: NodeDirection,
        factor: f64,
        depth: usize,
        terms: &mut Vec<(u32, f64)>,
    ) -> Option<()> {
        if let Some(&row) = self.rows.get(&at) {
            terms.push((row, factor));
            return Some(());
        }
        let equation = self.equations.get(&at).filter(|_| depth < MAX_DEPTH)?;
        equation
            .terms
            .iter()
            .try_for_each(|&(next, own)| self.add_terms(next, factor * own, depth + 1, terms))
    }
}

impl Place {
    /// Calls `with` with each row and its factor.
    pub(crate) fn for_each(&self, mut with: impl FnMut(u32, f64)) {
        match self {
            Self::Row(row) => with(*row, 1.0),
            Self::Follows(terms) => terms.iter().for_each(|&(row, factor)| with(row, factor)),
        }
    }

    /// Returns the displacement for values of all rows.
    pub(crate) fn value(&self, of_row: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        self.for_each(|row, factor| sum += factor * of_row(row as usize));
        sum
    }
}
