//! Drawn parts of a body: points, and triangles and lines between them, in model axes.

use crate::export::Points;
use crate::export::frames::{ExportFrame, frames};
use faer::MatRef;
use flexbody_body::flex_body::{FlexBody, SurfaceMesh};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// Points of a body with their motion in every mode: nodes in the order of the body, then the reference
/// points of interfaces that are no nodes.
pub(crate) struct Drawn<'b> {
    body: &'b FlexBody,
    /// Indices of the nodes, ascending.
    nodes: Vec<usize>,
    references: Vec<ExportFrame>,
    mesh: Option<SurfaceMesh>,
}

impl<'b> Drawn<'b> {
    /// Returns the nodes of the surface, or all nodes of a body without a surface.
    pub(crate) fn surface(body: &'b FlexBody) -> Self {
        Self::of(body, surface_nodes(body), Vec::new())
    }

    /// Returns the nodes of the surface with the nodes and reference points of the interfaces, or the places
    /// named by `points`.
    pub(crate) fn places(body: &'b FlexBody, points: &Points) -> Self {
        let mut nodes = match points {
            Points::Usual => {
                let held = body.interfaces().iter().flat_map(|interface| interface.nodes.iter().copied());
                surface_nodes(body).into_iter().chain(held).collect()
            }
            Points::Nodes => (0..body.n_nodes()).collect(),
            Points::Interfaces | Points::InterfacesAnd(_) | Points::Some(_) => indices(body, points.named()),
        };
        let mut references = match points {
            Points::Some(_) => Vec::new(),
            _ if body.interfaces().is_empty() => Vec::new(),
            _ => frames(body, &Points::Interfaces),
        };
        let of_nodes: Vec<i64> = references.iter().map(|frame| frame.id).collect();
        let of_nodes = indices(body, &of_nodes);
        references.retain(|frame| of_nodes.iter().all(|&node| body.nodes().ids[node] != frame.id));
        nodes.extend(of_nodes);
        Self::of(body, nodes, references)
    }

    fn of(body: &'b FlexBody, mut nodes: Vec<usize>, references: Vec<ExportFrame>) -> Self {
        nodes.sort_unstable();
        nodes.dedup();
        let numbers: Vec<i64> = nodes.iter().map(|&node| body.nodes().ids[node]).collect();
        let mesh = body.mesh().and_then(|mesh| mesh.among(&body.nodes().ids, &numbers));
        Self { body, nodes, references, mesh }
    }

    /// Returns the number of points.
    pub(crate) fn len(&self) -> usize {
        self.nodes.len() + self.references.len()
    }

    /// Returns the numbers of the points.
    pub(crate) fn numbers(&self) -> Vec<i64> {
        let nodes = self.nodes.iter().map(|&node| self.body.nodes().ids[node]);
        nodes.chain(self.references.iter().map(|frame| frame.id)).collect()
    }

    /// Returns the undeformed positions in model coordinates. Unit: length.
    pub(crate) fn positions(&self) -> Vec<[f64; 3]> {
        let nodes = self.nodes.iter().map(|&node| self.body.nodes().positions[node]);
        let all = nodes.chain(self.references.iter().map(|frame| frame.position));
        all.map(|x| self.body.frame().to_model(x)).collect()
    }

    /// Returns the displacements in mode `j`, model axes.
    pub(crate) fn shape(&self, j: usize) -> Vec<[f64; 3]> {
        let shape = self.body.modes().shape.as_ref();
        let nodes = self.nodes.iter().map(|&node| turned(self.axes(), shape, 3 * node, j));
        let references =
            self.references.iter().map(|frame| turned(self.axes(), frame.translation.as_ref(), 0, j));
        nodes.chain(references).collect()
    }

    /// Returns the rotations in mode `j`, zero for points without rotations; `None` for a body whose nodes
    /// have none.
    pub(crate) fn rotation(&self, j: usize) -> Option<Vec<[f64; 3]>> {
        let rotation = self.body.modes().rotation.as_ref()?.as_ref();
        let nodes = self.nodes.iter().map(|&node| turned(self.axes(), rotation, 3 * node, j));
        let reference = |frame: &ExportFrame| match &frame.rotation {
            Some(own) => turned(self.axes(), own.as_ref(), 0, j),
            None => [0.0; 3],
        };
        Some(nodes.chain(self.references.iter().map(reference)).collect())
    }

    /// Returns the triangles as point indices, counterclockwise seen from outside.
    pub(crate) fn triangles(&self) -> &[[u32; 3]] {
        self.mesh.as_ref().map_or(&[], |mesh| mesh.triangles())
    }

    /// Returns the lines as point indices.
    pub(crate) fn edges(&self) -> &[[u32; 2]] {
        self.mesh.as_ref().map_or(&[], |mesh| mesh.edges())
    }

    /// Returns the points that belong to no triangle and no line.
    pub(crate) fn loose(&self) -> Vec<u32> {
        let drawn = self.mesh.as_ref().map_or_else(Vec::new, SurfaceMesh::drawn_nodes);
        let mut drawn = drawn.into_iter().peekable();
        (0..self.len())
            .filter_map(|i| u32::try_from(i).ok())
            .filter(|i| drawn.next_if_eq(i).is_none())
            .collect()
    }

    /// Returns the name of each interface with a mark (0 or 1) for each point that is one of its nodes.
    pub(crate) fn interfaces(&self) -> Vec<(&'b str, Vec<u8>)> {
        let mut all = Vec::new();
        for interface in self.body.interfaces() {
            let mut marks = vec![0; self.len()];
            for at in interface.nodes.iter().filter_map(|node| self.nodes.binary_search(node).ok()) {
                marks[at] = 1;
            }
            all.push((interface.name.as_str(), marks));
        }
        all
    }

    /// Returns a mark (0 or 1) for each point that is a reference point and no node; `None` without such
    /// points.
    pub(crate) fn references(&self) -> Option<Vec<u8>> {
        let nodes = self.nodes.iter().map(|_| 0);
        (!self.references.is_empty()).then(|| nodes.chain(self.references.iter().map(|_| 1)).collect())
    }

    fn axes(&self) -> &Matrix3<f64> {
        &self.body.frame().axes
    }
}

/// Returns the vector of column `j` that begins in row `row`, in model axes.
fn turned(axes: &Matrix3<f64>, of: MatRef<'_, f64>, row: usize, j: usize) -> [f64; 3] {
    (axes * Vector3::from_fn(|k, _| of[(row + k, j)])).into()
}

fn surface_nodes(body: &FlexBody) -> Vec<usize> {
    match body.mesh() {
        Some(mesh) => mesh.drawn_nodes().into_iter().map(|node| node as usize).collect(),
        None => (0..body.n_nodes()).collect(),
    }
}

/// Returns the indices of the nodes with these numbers.
fn indices(body: &FlexBody, numbers: &[i64]) -> Vec<usize> {
    let index: HashMap<i64, usize> = body.nodes().ids.iter().copied().zip(0..).collect();
    numbers.iter().filter_map(|number| index.get(number).copied()).collect()
}
