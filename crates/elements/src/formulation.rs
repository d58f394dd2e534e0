//! Formulations: shape functions, integration rule and strain of an element, by the names of its types in FE programs.

use crate::rule::Rule;
use crate::shape::Shape;

/// A way to compute the matrices of solid elements: shape functions, integration points, and how strain follows from
/// displacement. Nodes stand in the order of Abaqus and CalculiX ([`Formulation::node_order`] has that of Nastran).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formulation {
    /// Tetrahedron with 4 nodes: constant strain.
    Tet4,
    /// Tetrahedron with 10 nodes and 4 points.
    Tet10,
    /// Wedge with 6 nodes and 2 points: the centre of the triangle, 2 Gauss points along the axis.
    Wedge6,
    /// Wedge with 6 nodes and 3 x 2 points.
    Wedge6Full,
    /// Wedge with 15 nodes and 3 x 3 points.
    Wedge15,
    /// Hexahedron with 8 nodes and 2 x 2 x 2 points, full integration: C3D8 of CalculiX.
    Hex8,
    /// Hexahedron with 8 nodes and 2 x 2 x 2 points, the dilatation of each replaced by its mean over the volume (B-bar,
    /// selectively reduced integration): C3D8 of Abaqus.
    Hex8MeanDilatation,
    /// Hexahedron with 8 nodes and 2 x 2 x 2 points, with the functions 1 - xi^2, 1 - eta^2 and 1 - zeta^2 as three
    /// internal nodes: C3D8I of CalculiX. A linear displacement makes a constant stress only in parallelepipeds.
    Hex8Incompatible,
    /// Hexahedron with 8 nodes and 1 point, the mean strain over the volume, with the hourglass stiffness of Flanagan and
    /// Belytschko: C3D8R of CalculiX.
    Hex8UniformStrain,
    /// Hexahedron with 20 nodes and 2 x 2 x 2 points, reduced integration.
    Hex20Reduced,
    /// Hexahedron with 20 nodes and 3 x 3 x 3 points.
    Hex20,
}

/// Strain of an element as a function of the displacements of its nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Strain {
    /// Symmetric part of the gradient of the displacement.
    OfGradient,
    /// Symmetric part of the gradient with its trace replaced by the mean over the volume.
    MeanDilatation,
    /// Symmetric part of the gradient, in which three functions of internal nodes take part.
    Incompatible,
    /// Mean over the volume of the symmetric part of the gradient.
    Mean,
}

impl Formulation {
    /// All formulations.
    pub const ALL: [Self; 11] = [
        Self::Tet4,
        Self::Tet10,
        Self::Wedge6,
        Self::Wedge6Full,
        Self::Wedge15,
        Self::Hex8,
        Self::Hex8MeanDilatation,
        Self::Hex8Incompatible,
        Self::Hex8UniformStrain,
        Self::Hex20Reduced,
        Self::Hex20,
    ];

    /// Returns the formulations that elements of a type (`C3D8`, `CHEXA`, in upper case; `SOLID` for a solid of unknown type)
    /// may have in FE programs, the most likely first; empty if the type is unknown or has another number of nodes.
    pub fn candidates(kind: &str, nodes: usize) -> Vec<Self> {
        let candidates: &[Self] = match (kind, nodes) {
            ("C3D4" | "CTETRA", 4) => &[Self::Tet4],
            ("C3D10" | "C3D10T" | "CTETRA", 10) => &[Self::Tet10],
            ("C3D6", 6) => &[Self::Wedge6, Self::Wedge6Full],
            ("CPENTA", 6) => &[Self::Wedge6Full, Self::Wedge6],
            ("C3D15" | "CPENTA", 15) => &[Self::Wedge15],
            ("C3D8", 8) => &[Self::Hex8, Self::Hex8MeanDilatation],
            ("C3D8I", 8) => &[Self::Hex8Incompatible],
            ("C3D8R", 8) => &[Self::Hex8UniformStrain],
            ("CHEXA", 8) => &[Self::Hex8MeanDilatation, Self::Hex8],
            ("C3D20", 20) => &[Self::Hex20],
            ("C3D20R", 20) => &[Self::Hex20Reduced],
            ("CHEXA", 20) => &[Self::Hex20Reduced, Self::Hex20],
            ("SOLID", 4) => &[Self::Tet4],
            ("SOLID", 6) => &[Self::Wedge6Full, Self::Wedge6],
            ("SOLID", 8) => &[Self::Hex8, Self::Hex8MeanDilatation, Self::Hex8UniformStrain],
            ("SOLID", 10) => &[Self::Tet10],
            ("SOLID", 15) => &[Self::Wedge15],
            ("SOLID", 20) => &[Self::Hex20Reduced, Self::Hex20],
            _ => &[],
        };
        candidates.to_vec()
    }

    /// Returns for each node of a formulation its place among the nodes of an element of a type, since Nastran has the
    /// middles of vertical edges before those of the upper face; `None` if the type has no formulation.
    pub fn node_order(kind: &str, nodes: usize) -> Option<Vec<usize>> {
        if Self::candidates(kind, nodes).is_empty() {
            return None;
        }
        // First of the vertical edges, and their number.
        let (first, edges) = match (kind, nodes) {
            ("CHEXA", 20) => (12, 4),
            ("CPENTA", 15) => (9, 3),
            _ => (nodes, 0),
        };
        let upper = first + edges..first + 2 * edges;
        Some((0..first).chain(upper).chain(first..first + edges).collect())
    }

    /// Returns nodes, points and strain in words: `8 nodes, 2 x 2 x 2 points`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tet4 => "4 nodes, 1 point",
            Self::Tet10 => "10 nodes, 4 points",
            Self::Wedge6 => "6 nodes, 1 x 2 points",
            Self::Wedge6Full => "6 nodes, 3 x 2 points",
            Self::Wedge15 => "15 nodes, 3 x 3 points",
            Self::Hex8 => "8 nodes, 2 x 2 x 2 points",
            Self::Hex8MeanDilatation => "8 nodes, 2 x 2 x 2 points, mean dilatation",
            Self::Hex8Incompatible => "8 nodes, 2 x 2 x 2 points, incompatible modes",
            Self::Hex8UniformStrain => "8 nodes, mean strain, hourglass control",
            Self::Hex20Reduced => "20 nodes, 2 x 2 x 2 points",
            Self::Hex20 => "20 nodes, 3 x 3 x 3 points",
        }
    }

    /// Returns the number of nodes, without internal ones.
    pub fn n_nodes(self) -> usize {
        self.shape().n_nodes()
    }

    /// Returns the number of internal nodes, which follow the others in all vectors and matrices.
    pub fn n_internal(self) -> usize {
        match self.strain() {
            Strain::Incompatible => 3,
            _ => 0,
        }
    }

    /// Returns the number of nodes and internal nodes.
    pub fn n_functions(self) -> usize {
        self.n_nodes() + self.n_internal()
    }

    /// Returns the number of points with a stress.
    pub fn n_points(self) -> usize {
        match self.strain() {
            Strain::Mean => 1,
            _ => self.rule().n_points(),
        }
    }

    /// Returns the shape functions of the nodes.
    pub(crate) const fn shape(self) -> Shape {
        match self {
            Self::Tet4 => Shape::Tet4,
            Self::Tet10 => Shape::Tet10,
            Self::Wedge6 | Self::Wedge6Full => Shape::Wedge6,
            Self::Wedge15 => Shape::Wedge15,
            Self::Hex8 | Self::Hex8MeanDilatation | Self::Hex8Incompatible | Self::Hex8UniformStrain => {
                Shape::Hex8
            }
            Self::Hex20Reduced | Self::Hex20 => Shape::Hex20,
        }
    }

    /// Returns the integration rule; that of the means over the volume, if the strain is one.
    pub(crate) const fn rule(self) -> Rule {
        match self {
            Self::Tet4 => Rule::Tet1,
            Self::Tet10 => Rule::Tet4,
            Self::Wedge6 => Rule::Wedge2,
            Self::Wedge6Full => Rule::Wedge6,
            Self::Wedge15 => Rule::Wedge9,
            Self::Hex8
            | Self::Hex8MeanDilatation
            | Self::Hex8Incompatible
            | Self::Hex8UniformStrain
            | Self::Hex20Reduced => Rule::Hex8,
            Self::Hex20 => Rule::Hex27,
        }
    }

    /// Returns how strain follows from displacements.
    pub(crate) const fn strain(self) -> Strain {
        match self {
            Self::Hex8MeanDilatation => Strain::MeanDilatation,
            Self::Hex8Incompatible => Strain::Incompatible,
            Self::Hex8UniformStrain => Strain::Mean,
            _ => Strain::OfGradient,
        }
    }
}
