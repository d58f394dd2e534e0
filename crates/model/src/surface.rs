//! Surface of a part, for drawing.

mod decimate;
mod features;
mod quadric;
mod rings;
mod skin;

pub use skin::{Skin, skin};

use std::collections::HashMap;

/// Triangles of the surface of a part, and lines: its feature edges, the rims of shells, and beams, all by
/// indices of nodes. The mesh is used for drawing only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SurfaceMesh {
    triangles: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
}

impl SurfaceMesh {
    /// Creates a mesh on `nodes` nodes. The corners of a triangle run counterclockwise seen from outside,
    /// if there is an outside.
    ///
    /// # Errors
    /// A text with the reason: an index beyond the nodes, a triangle or an edge with a node twice, or
    /// neither triangles nor edges.
    pub fn new(triangles: Vec<[u32; 3]>, edges: Vec<[u32; 2]>, nodes: usize) -> Result<Self, String> {
        let mesh = Self { triangles, edges };
        if mesh.triangles.is_empty() && mesh.edges.is_empty() {
            return Err("a mesh without triangles and edges".to_owned());
        }
        if let Some(index) = mesh.indices().find(|index| *index as usize >= nodes) {
            return Err(format!("a mesh with node index {index}, expected indices below {nodes}"));
        }
        if let Some(t) = mesh.triangles.iter().position(|&[a, b, c]| a == b || b == c || c == a) {
            return Err(format!("a mesh whose triangle {t} has a node twice"));
        }
        if let Some(e) = mesh.edges.iter().position(|[a, b]| a == b) {
            return Err(format!("a mesh whose edge {e} has a node twice"));
        }
        Ok(mesh)
    }

    /// Creates a mesh from valid parts; `None` if there is nothing to draw.
    fn of_parts(triangles: Vec<[u32; 3]>, edges: Vec<[u32; 2]>) -> Option<Self> {
        (!triangles.is_empty() || !edges.is_empty()).then_some(Self { triangles, edges })
    }

    /// Returns the triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the edges.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    fn indices(&self) -> impl Iterator<Item = u32> {
        self.triangles.as_flattened().iter().chain(self.edges.as_flattened()).copied()
    }

    /// Returns one more than the highest index.
    pub fn least_nodes(&self) -> usize {
        self.indices().max().map_or(0, |highest| highest as usize + 1)
    }

    /// Returns the indices of the drawn nodes, ascending.
    pub fn drawn_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.indices().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Returns the part of the mesh whose nodes are among the nodes `to`, with the indices of that list;
    /// `from` holds the numbers of the present nodes. Returns `None` if no part is left.
    pub fn among(&self, from: &[i64], to: &[i64]) -> Option<Self> {
        if from == to {
            return Some(self.clone());
        }
        let index: HashMap<i64, u32> = to.iter().zip(0..).map(|(&id, i)| (id, i)).collect();
        let moved: Vec<Option<u32>> = from.iter().map(|id| index.get(id).copied()).collect();
        let at = |i: u32| moved.get(i as usize).copied().flatten();
        Self::of_parts(
            self.triangles.iter().filter_map(|&[a, b, c]| Some([at(a)?, at(b)?, at(c)?])).collect(),
            self.edges.iter().filter_map(|&[a, b]| Some([at(a)?, at(b)?])).collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_names_nodes_that_there_are_and_none_twice() {
        let mesh = |triangles: &[[u32; 3]], edges: &[[u32; 2]]| {
            SurfaceMesh::new(triangles.to_vec(), edges.to_vec(), 4).map(|mesh| mesh.least_nodes())
        };
        assert_eq!(mesh(&[[0, 1, 3]], &[]), Ok(4));
        assert_eq!(mesh(&[], &[[0, 1]]), Ok(2));
        assert!(mesh(&[], &[]).is_err());
        assert!(mesh(&[[0, 1, 4]], &[]).unwrap_err().contains("index 4"));
        assert!(mesh(&[[0, 1, 1]], &[]).unwrap_err().contains("triangle 0"));
        assert!(mesh(&[], &[[0, 1], [2, 2]]).unwrap_err().contains("edge 1"));
    }

    #[test]
    fn a_part_of_the_nodes_keeps_what_lies_among_them() {
        let mesh = SurfaceMesh::new(vec![[0, 1, 2], [1, 2, 3]], vec![[0, 3]], 4).expect("a mesh");
        let part = mesh.among(&[10, 20, 30, 40], &[40, 30, 20]).expect("a part");
        assert_eq!((part.triangles(), part.edges()), (&[[2, 1, 0]][..], &[][..]));
        assert_eq!(mesh.among(&[10, 20, 30, 40], &[10, 20]), None);
    }
}
