//! The surface by which a part is drawn, from the elements of its files.

use super::node_file::NodeFile;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_model::{ElementShape, Elements, Nodes, Skin, SurfaceMesh, extents, skin};
use std::collections::HashMap;
use std::path::Path;

/// Largest distance of a node of a mesh from the node of the model, relative to the largest extent of the model: meshes
/// are written with few digits.
const APART: f64 = 1e-3;

/// Number of kinds of elements that a message names.
const MAX_NAMED: usize = 6;

/// Sources of the surface of a model.
pub(super) struct MeshReading<'m> {
    pub nodes: &'m Nodes,
    /// Elements that were read with the nodes.
    pub elements: &'m Elements,
    /// File of the nodes.
    pub path: &'m Path,
}

impl MeshReading<'_> {
    /// Returns the surface by the elements of the file `from`, else by the elements that were read with the nodes.
    ///
    /// # Errors
    /// FB125 if `from` is not a mesh on the nodes of the model.
    pub(crate) fn mesh(
        &self,
        from: Option<(&NodeFile, &Path)>,
    ) -> Diagnosed<(Option<SurfaceMesh>, Vec<Diagnostic>)> {
        let Some((mesh, path)) = from else {
            return Ok(self.drawn(self.elements, self.path));
        };
        let foreign = |message: String| vec![Diagnostic::new(Code::MeshForeign, message).in_file(path)];
        if mesh.elements.is_empty() {
            return Err(foreign("file has no elements that can be drawn".to_owned()));
        }
        if let Some(message) = self.stranger(&mesh.nodes) {
            return Err(foreign(message));
        }
        let (drawn, partly) = self.drawn(&mesh.elements, path);
        match drawn {
            Some(_) => Ok((drawn, partly)),
            None => Err(foreign("no element of the mesh has all of its nodes in the model".to_owned())),
        }
    }

    /// Returns a message about a node of a mesh with another position in the model; `None` if there is none.
    fn stranger(&self, mesh: &Nodes) -> Option<String> {
        let index: HashMap<i64, usize> = self.nodes.ids.iter().copied().zip(0..).collect();
        let allowed = APART * extents(&self.nodes.positions).into_iter().fold(0.0, f64::max);
        let elsewhere = |(id, x): (&i64, &[f64; 3])| {
            let in_model = &self.nodes.positions[*index.get(id)?];
            let apart = (0..3).map(|k| (x[k] - in_model[k]).powi(2)).sum::<f64>().sqrt();
            (apart > allowed).then(|| {
                format!("node {id} of the mesh lies at {x:?}, the node of the model at {in_model:?}")
            })
        };
        mesh.ids.iter().zip(&mesh.positions).find_map(elsewhere)
    }

    fn drawn(&self, elements: &Elements, path: &Path) -> (Option<SurfaceMesh>, Vec<Diagnostic>) {
        let Skin { mesh, without_nodes } = skin(elements, self.nodes);
        let left_out: Vec<String> =
            elements.left_out().map(|(kind, count)| format!("{count} of {kind}")).collect();
        let mut partly = Vec::new();
        let mut tell = |message: String| {
            partly.push(Diagnostic::new(Code::MeshPartial, message).in_file(path));
        };
        if !left_out.is_empty() {
            let more = if left_out.len() > MAX_NAMED { ", and of other kinds" } else { "" };
            let named = left_out[..left_out.len().min(MAX_NAMED)].join(", ");
            tell(format!("elements that are not drawn: {named}{more}"));
        }
        if without_nodes > 0 {
            let all = elements.len();
            tell(format!(
                "{without_nodes} of {all} elements have nodes that are not in the model: they are not drawn"
            ));
        }
        (mesh, partly)
    }
}

// Nodes of second-order elements in the order of Nastran, Patran and Exodus: the mid-edge nodes of the upright edges
// of bricks and wedges precede those of the upper face.

/// Indices of the mid-edge nodes of a hexahedron among its nodes.
const HEXAHEDRON: [usize; 12] = [8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];

/// Indices of the mid-edge nodes of a wedge among its nodes.
const WEDGE: [usize; 9] = [6, 7, 8, 12, 13, 14, 9, 10, 11];

/// Returns the corners, then the mid-edge nodes in the order of the shape; other elements are unchanged.
pub(super) fn in_order_of_shape(shape: ElementShape, nodes: &[i64]) -> Vec<i64> {
    let middles: &[usize] = match shape {
        ElementShape::Hexahedron if nodes.len() >= 20 => &HEXAHEDRON,
        ElementShape::Wedge if nodes.len() >= 15 => &WEDGE,
        _ => return nodes.to_vec(),
    };
    nodes[..shape.corners()].iter().copied().chain(middles.iter().map(|&k| nodes[k])).collect()
}
