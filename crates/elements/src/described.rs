//! Elements, materials and constraints of a model as its deck describes them, before anything of it is proved.

use crate::Elasticity;
use nalgebra::{Matrix3, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Node and direction, 1 to 6, of a degree of freedom.
pub type NodeDirection = (i64, u8);

/// Elements, materials and constraints of a deck.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DescribedElements {
    /// Elements with the same type and section.
    pub groups: Vec<ElementGroup>,
    /// Positions of the nodes of all elements, also of nodes without rows in the stiffness matrix.
    pub positions: BTreeMap<i64, [f64; 3]>,
    /// Springs and other parts of the stiffness that the deck states as numbers.
    pub direct: Vec<NodeStiffness>,
    /// Degrees of freedom that have no row in the stiffness matrix, since they follow from others.
    pub equations: Vec<Equation>,
    /// Parts of the deck that contribute to the stiffness and are not described here.
    pub not_described: Vec<NotDescribed>,
    /// Deck, for messages.
    pub path: PathBuf,
}

/// Elements with the same type and section.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementGroup {
    /// Type in upper case, as the program names it: `C3D20R`.
    pub kind: String,
    /// Material and its axes.
    pub section: Section,
    /// Numbers of the elements.
    pub ids: Vec<i64>,
    /// Nodes of all elements, those of each element in the order of the program.
    pub nodes: Vec<i64>,
    /// Numbers of the nodes inside the elements that have rows in the stiffness matrix but are not in the deck, the same
    /// number for each element; empty if there are none.
    pub internal: Vec<i64>,
}

/// Section of solid elements: their material and its axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Name of the material.
    pub material: String,
    /// Elasticity along the axes of the section.
    pub elasticity: Elasticity,
    /// Axes of the material.
    pub axes: Axes,
}

/// Axes of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Axes {
    /// Axes of the model.
    Model,
    /// Axes that are the same everywhere: the columns, along the axes of the model.
    Fixed(Matrix3<f64>),
    /// Radius, circumference and axis of a cylinder, about the line through two points.
    Cylinder {
        /// Point on the axis.
        from: Vector3<f64>,
        /// Another point on the axis, in its direction.
        to: Vector3<f64>,
    },
}

/// Stiffness of some degrees of freedom that the deck states as numbers: a spring.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeStiffness {
    /// Element, in words: `spring 12`.
    pub name: String,
    /// Degrees of freedom.
    pub rows: Vec<NodeDirection>,
    /// Matrix by `rows`, row by row.
    pub matrix: Vec<f64>,
}

/// Linear equation that an FE program has eliminated: u(dependent) = sum of factors times u.
#[derive(Debug, Clone, PartialEq)]
pub struct Equation {
    /// Degree of freedom without a row.
    pub dependent: NodeDirection,
    /// Degrees of freedom that it follows, with their factors; these may be dependent themselves.
    pub terms: Vec<(NodeDirection, f64)>,
}

/// Part of a deck that contributes to the stiffness and is not described.
#[derive(Debug, Clone, PartialEq)]
pub struct NotDescribed {
    /// In words, with the reason: `12 elements of type S8R: shells are not proved yet`.
    pub what: String,
    /// Line of the deck, if it is one.
    pub line: Option<usize>,
    /// Nodes that it touches; empty if they are unknown.
    pub nodes: Vec<i64>,
}

impl NotDescribed {
    /// Creates the statement that some elements of a type are not described, for a reason in words.
    ///
    /// * `nodes`: of the elements, in any order and as often as they occur.
    pub fn elements(kind: &str, reason: &str, count: usize, mut nodes: Vec<i64>) -> Self {
        nodes.sort_unstable();
        nodes.dedup();
        let elements = if count == 1 { "element" } else { "elements" };
        Self { what: format!("{count} {elements} of type {kind}: {reason}"), line: None, nodes }
    }
}

impl DescribedElements {
    /// Returns the part of the description that touches some nodes: those of one of several bodies. Nodes inside elements, and
    /// nodes that follow others, belong to the elements and nodes that they are connected to.
    pub fn among(&self, is_kept: impl Fn(i64) -> bool) -> Self {
        let touches = |nodes: &[i64]| nodes.iter().any(|node| is_kept(*node));
        let groups: Vec<ElementGroup> =
            self.groups.iter().map(|group| group.of(touches)).filter(|group| !group.ids.is_empty()).collect();
        let of_rows = |rows: &[NodeDirection]| rows.iter().any(|(node, _)| is_kept(*node));
        let follows = |equation: &&Equation| {
            let terms = equation.terms.iter().any(|((node, _), _)| is_kept(*node));
            terms || is_kept(equation.dependent.0) || equation.terms.is_empty()
        };
        let is_near = |part: &&NotDescribed| part.nodes.is_empty() || touches(&part.nodes);
        let members: BTreeSet<i64> = groups.iter().flat_map(|group| group.nodes.iter().copied()).collect();
        let position = |(id, x): (&i64, &[f64; 3])| members.contains(id).then_some((*id, *x));
        Self {
            positions: self.positions.iter().filter_map(position).collect(),
            groups,
            direct: self.direct.iter().filter(|spring| of_rows(&spring.rows)).cloned().collect(),
            equations: self.equations.iter().filter(follows).cloned().collect(),
            not_described: self.not_described.iter().filter(is_near).cloned().collect(),
            path: self.path.clone(),
        }
    }
}

impl Axes {
    /// Returns the axes at a position as columns, along the axes of the model; `None` on the axis of a cylinder.
    pub fn at(&self, x: &Vector3<f64>) -> Option<Matrix3<f64>> {
        match self {
            Self::Model => Some(Matrix3::identity()),
            Self::Fixed(axes) => Some(*axes),
            Self::Cylinder { from, to } => {
                let along = (to - from).try_normalize(0.0)?;
                let arm = x - from;
                let radius = (arm - along * along.dot(&arm)).try_normalize(f64::MIN_POSITIVE)?;
                Some(Matrix3::from_columns(&[radius, along.cross(&radius), along]))
            }
        }
    }
}

impl Section {
    /// Returns the elasticity along the axes of the model at a position; `None` where the section has no axes.
    pub fn elasticity_at(&self, x: &Vector3<f64>) -> Option<Elasticity> {
        match self.axes {
            Axes::Model => Some(self.elasticity),
            _ => Some(self.elasticity.turned(&self.axes.at(x)?)),
        }
    }
}

impl ElementGroup {
    /// Returns the group with the elements whose nodes pass a test.
    fn of(&self, is_kept: impl Fn(&[i64]) -> bool) -> Self {
        let mut kept = Self { ids: Vec::new(), nodes: Vec::new(), internal: Vec::new(), ..self.clone() };
        for (id, nodes, internal) in self.elements().filter(|(_, nodes, _)| is_kept(nodes)) {
            kept.ids.push(id);
            kept.nodes.extend(nodes);
            kept.internal.extend(internal);
        }
        kept
    }

    /// Returns number, nodes and internal nodes of each element.
    pub fn elements(&self) -> impl Iterator<Item = (i64, &[i64], &[i64])> {
        let count = self.ids.len().max(1);
        let (nodes, internal) = (self.nodes.len() / count, self.internal.len() / count);
        self.ids.iter().enumerate().map(move |(at, id)| {
            let (own, inner) = (at * nodes..(at + 1) * nodes, at * internal..(at + 1) * internal);
            (*id, &self.nodes[own], &self.internal[inner])
        })
    }
}
