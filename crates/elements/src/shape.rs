//! Shape functions of tetrahedra, wedges and hexahedra, with nodes in the order of Abaqus and CalculiX.

/// Largest number of nodes of a shape.
pub(crate) const MAX_NODES: usize = 20;

/// Functions of one point: the value of each, and its derivatives along the natural coordinates.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Function {
    /// Value.
    pub(crate) value: f64,
    /// Derivatives along the natural coordinates.
    pub(crate) slope: [f64; 3],
}

/// Family of shape functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Tetrahedron, linear.
    Tet4,
    /// Tetrahedron, quadratic.
    Tet10,
    /// Wedge, linear in the triangle and along the axis.
    Wedge6,
    /// Wedge, quadratic without functions inside the faces.
    Wedge15,
    /// Hexahedron, trilinear.
    Hex8,
    /// Hexahedron, quadratic without functions inside the faces.
    Hex20,
}

/// Corners of the hexahedron in natural coordinates.
pub(crate) const HEX_CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

const TET_CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

const WEDGE_CORNERS: [[f64; 3]; 6] =
    [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];

const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

const WEDGE_EDGES: [[usize; 2]; 9] = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];

const HEX_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

impl Shape {
    /// Returns the number of nodes.
    pub(crate) const fn n_nodes(self) -> usize {
        match self {
            Self::Tet4 => 4,
            Self::Tet10 => 10,
            Self::Wedge6 => 6,
            Self::Wedge15 => 15,
            Self::Hex8 => 8,
            Self::Hex20 => 20,
        }
    }

    /// Returns the nodes in natural coordinates.
    pub(crate) fn nodes(self) -> Vec<[f64; 3]> {
        let (corners, edges): (&[[f64; 3]], &[[usize; 2]]) = match self {
            Self::Tet4 => (&TET_CORNERS, &[]),
            Self::Tet10 => (&TET_CORNERS, &TET_EDGES),
            Self::Wedge6 => (&WEDGE_CORNERS, &[]),
            Self::Wedge15 => (&WEDGE_CORNERS, &WEDGE_EDGES),
            Self::Hex8 => (&HEX_CORNERS, &[]),
            Self::Hex20 => (&HEX_CORNERS, &HEX_EDGES),
        };
        let middle = |&[a, b]: &[usize; 2]| std::array::from_fn(|d| 0.5 * (corners[a][d] + corners[b][d]));
        corners.iter().copied().chain(edges.iter().map(middle)).collect()
    }

    /// Returns the shape functions at a point, one for each node.
    pub(crate) fn functions(self, at: [f64; 3]) -> Vec<Function> {
        match self {
            Self::Tet4 => tet_coordinates(at).to_vec(),
            Self::Tet10 => tet10(at),
            Self::Wedge6 => wedge6(at),
            Self::Wedge15 => wedge15(at),
            Self::Hex8 => HEX_CORNERS.iter().map(|&corner| hex_corner(corner, at)).collect(),
            Self::Hex20 => self.nodes().iter().map(|&node| hex20(node, at)).collect(),
        }
    }
}

impl Function {
    /// Returns the product of two functions.
    fn times(self, other: Self) -> Self {
        let slope = |d: usize| self.value * other.slope[d] + self.slope[d] * other.value;
        Self { value: self.value * other.value, slope: std::array::from_fn(slope) }
    }

    /// Returns `factor * self + constant`.
    fn scaled(self, factor: f64, constant: f64) -> Self {
        Self { value: factor * self.value + constant, slope: self.slope.map(|slope| factor * slope) }
    }

    /// Returns the sum of two functions.
    fn plus(self, other: Self) -> Self {
        let slope = |d: usize| self.slope[d] + other.slope[d];
        Self { value: self.value + other.value, slope: std::array::from_fn(slope) }
    }

    /// Returns `constant + factor * at[direction]`.
    fn line(direction: usize, constant: f64, factor: f64, at: [f64; 3]) -> Self {
        let mut slope = [0.0; 3];
        slope[direction] = factor;
        Self { value: constant + factor * at[direction], slope }
    }
}

/// Returns the four volume coordinates of a tetrahedron.
fn tet_coordinates(at: [f64; 3]) -> [Function; 4] {
    let [x, y, z] = at;
    let first = Function { value: 1.0 - x - y - z, slope: [-1.0; 3] };
    let other = |d| Function::line(d, 0.0, 1.0, at);
    [first, other(0), other(1), other(2)]
}

fn tet10(at: [f64; 3]) -> Vec<Function> {
    let volume = tet_coordinates(at);
    let corners = volume.map(|l| l.times(l.scaled(2.0, -1.0)));
    let edges = TET_EDGES.map(|[a, b]| volume[a].times(volume[b]).scaled(4.0, 0.0));
    corners.into_iter().chain(edges).collect()
}

/// Returns the three area coordinates of a wedge.
fn wedge_coordinates(at: [f64; 3]) -> [Function; 3] {
    let first = Function { value: 1.0 - at[0] - at[1], slope: [-1.0, -1.0, 0.0] };
    [first, Function::line(0, 0.0, 1.0, at), Function::line(1, 0.0, 1.0, at)]
}

fn wedge6(at: [f64; 3]) -> Vec<Function> {
    let area = wedge_coordinates(at);
    let ends = [-1.0, 1.0].map(|side| Function::line(2, 0.5, 0.5 * side, at));
    (0..6).map(|n| area[n % 3].times(ends[n / 3])).collect()
}

fn wedge15(at: [f64; 3]) -> Vec<Function> {
    let area = wedge_coordinates(at);
    let sides = [-1.0, 1.0].map(|side| Function::line(2, 0.0, side, at));
    let corner = |n: usize| {
        let (l, side) = (area[n % 3], sides[n / 3]);
        let third = l.scaled(2.0, -2.0).plus(side);
        l.times(side.scaled(0.5, 0.5)).times(third)
    };
    let edge = |n: usize| {
        let [a, b] = WEDGE_EDGES[n];
        if n < 6 {
            area[a % 3].times(area[b % 3]).times(sides[n / 3].scaled(2.0, 2.0))
        } else {
            area[a].times(sides[1].times(sides[1]).scaled(-1.0, 1.0))
        }
    };
    (0..6).map(corner).chain((0..9).map(edge)).collect()
}

/// Returns the trilinear function of a corner.
fn hex_corner(corner: [f64; 3], at: [f64; 3]) -> Function {
    let factor = |d: usize| Function::line(d, 0.5, 0.5 * corner[d], at);
    factor(0).times(factor(1)).times(factor(2))
}

/// Returns the quadratic function of a corner or of the middle of an edge.
fn hex20(node: [f64; 3], at: [f64; 3]) -> Function {
    if let Some(along) = node.iter().position(|&c| c == 0.0) {
        let line = Function::line(along, 0.0, 1.0, at);
        let bubble = line.times(line).scaled(-1.0, 1.0);
        let across = |d: usize| Function::line(d, 0.5, 0.5 * node[d], at);
        return bubble.times(across((along + 1) % 3)).times(across((along + 2) % 3));
    }
    let sum = (0..3).map(|d| Function::line(d, 0.0, node[d], at)).fold(Function::default(), Function::plus);
    hex_corner(node, at).times(sum.scaled(1.0, -2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [Shape; 6] =
        [Shape::Tet4, Shape::Tet10, Shape::Wedge6, Shape::Wedge15, Shape::Hex8, Shape::Hex20];

    #[test]
    fn each_function_is_one_at_its_node_and_zero_at_the_others() {
        for shape in SHAPES {
            let nodes = shape.nodes();
            assert_eq!(nodes.len(), shape.n_nodes());
            for (n, &node) in nodes.iter().enumerate() {
                for (f, function) in shape.functions(node).iter().enumerate() {
                    let expected = if f == n { 1.0 } else { 0.0 };
                    assert!((function.value - expected).abs() < 1e-15, "{shape:?} {f} at {n}");
                }
            }
        }
    }

    #[test]
    fn slopes_are_those_of_the_values() {
        let at = [0.21, 0.34, 0.17];
        for shape in SHAPES {
            let functions = shape.functions(at);
            for d in 0..3 {
                let moved = |step: f64| {
                    let mut place = at;
                    place[d] += step;
                    shape.functions(place)
                };
                let (before, after) = (moved(-1e-5), moved(1e-5));
                let total: f64 = functions.iter().map(|function| function.slope[d]).sum();
                assert!(total.abs() < 1e-14);
                for (n, function) in functions.iter().enumerate() {
                    let slope = (after[n].value - before[n].value) / 2e-5;
                    assert!((slope - function.slope[d]).abs() < 1e-9, "{shape:?} {n} along {d}");
                }
            }
        }
    }
}
