//! Isoparametric solid elements: shape functions, quadrature, stiffness and scalar mass matrix of one element.

/// Isotropic linear elastic material.
#[derive(Debug, Clone, Copy)]
pub struct Material {
    pub youngs: f64,
    pub poisson: f64,
    pub density: f64,
}

impl Material {
    pub const STEEL: Material = Material { youngs: 210e9, poisson: 0.3, density: 7850.0 };

    /// Returns Lame's first parameter and the shear modulus.
    pub fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.youngs, self.poisson);
        (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
    }
}

/// Quadrature of the mass matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassRule {
    /// Exact quadrature for elements with straight edges and parallel faces.
    Consistent,
    /// Too few points, as in some programs: one for hex8, four for tet10. The mass matrix is then singular.
    Reduced,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementKind {
    Tet4,
    Tet10,
    Hex8,
    Hex20,
}

/// Pairs of corners whose mid-edge nodes are the nodes 4..10 of a tet10.
pub const TET_EDGES: [(usize, usize); 6] = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];

/// Quadrature point: reference coordinates and weight.
type Point = ([f64; 3], f64);

impl ElementKind {
    /// Returns the reference coordinates -1, 0, 1 of the nodes of a hexahedron: corners first, then mid-edge nodes.
    pub fn hex_signs(self) -> Vec<[i32; 3]> {
        let all = (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]);
        let with_zeros =
            |n: usize| all.clone().filter(move |s: &[i32; 3]| s.iter().filter(|v| **v == 0).count() == n);
        match self {
            ElementKind::Hex8 => with_zeros(0).collect(),
            ElementKind::Hex20 => with_zeros(0).chain(with_zeros(1)).collect(),
            ElementKind::Tet4 | ElementKind::Tet10 => panic!("not a hexahedron"),
        }
    }

    /// Returns the shape functions and their gradients in reference coordinates.
    pub fn shape(self, xi: [f64; 3]) -> (Vec<f64>, Vec<[f64; 3]>) {
        match self {
            ElementKind::Tet4 | ElementKind::Tet10 => {
                let l = [1.0 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]];
                let g = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                if self == ElementKind::Tet4 {
                    return (l.to_vec(), g.to_vec());
                }
                let corners =
                    (0..4).map(|i| (l[i] * (2.0 * l[i] - 1.0), g[i].map(|v| (4.0 * l[i] - 1.0) * v)));
                let middles = TET_EDGES.iter().map(|&(i, j)| {
                    let gradient = std::array::from_fn(|k| 4.0 * (l[i] * g[j][k] + l[j] * g[i][k]));
                    (4.0 * l[i] * l[j], gradient)
                });
                corners.chain(middles).unzip()
            }
            ElementKind::Hex8 | ElementKind::Hex20 => {
                self.hex_signs().iter().map(|s| self.hex_shape(*s, xi)).unzip()
            }
        }
    }

    /// Returns the shape function, with its gradient, of the node of a hexahedron at the reference coordinates `sign`.
    fn hex_shape(self, sign: [i32; 3], xi: [f64; 3]) -> (f64, [f64; 3]) {
        let s = sign.map(f64::from);
        // One factor per axis with its derivative; corners of the serendipity element have the additional factor `sum`.
        let f: [(f64, f64); 3] = std::array::from_fn(|k| match sign[k] {
            0 => (1.0 - xi[k] * xi[k], -2.0 * xi[k]),
            _ => (0.5 * (1.0 + s[k] * xi[k]), 0.5 * s[k]),
        });
        let product = f[0].0 * f[1].0 * f[2].0;
        let gradient = [f[0].1 * f[1].0 * f[2].0, f[0].0 * f[1].1 * f[2].0, f[0].0 * f[1].0 * f[2].1];
        if self == ElementKind::Hex20 && !sign.contains(&0) {
            let sum = s[0] * xi[0] + s[1] * xi[1] + s[2] * xi[2] - 2.0;
            (product * sum, std::array::from_fn(|k| gradient[k] * sum + product * s[k]))
        } else {
            (product, gradient)
        }
    }

    /// Returns the quadrature points of the stiffness matrix.
    fn stiffness_rule(self) -> Vec<Point> {
        match self {
            ElementKind::Tet4 => tet_rule(1),
            ElementKind::Tet10 => tet_rule(3),
            ElementKind::Hex8 => hex_rule(2),
            ElementKind::Hex20 => hex_rule(3),
        }
    }

    /// Returns the quadrature points of the mass matrix.
    fn mass_rule(self, rule: MassRule) -> Vec<Point> {
        match (self, rule) {
            (ElementKind::Tet4, MassRule::Consistent) => tet_rule(3),
            (ElementKind::Tet10, MassRule::Consistent) => tet_rule(4),
            (ElementKind::Hex8, MassRule::Consistent) => hex_rule(2),
            (ElementKind::Hex20, MassRule::Consistent) => hex_rule(3),
            (ElementKind::Tet10, MassRule::Reduced) => {
                let (a, b) = ((5.0 + 3.0 * 5f64.sqrt()) / 20.0, (5.0 - 5f64.sqrt()) / 20.0);
                [[b, b, b], [a, b, b], [b, a, b], [b, b, a]].map(|p| (p, 1.0 / 24.0)).to_vec()
            }
            (ElementKind::Tet4, MassRule::Reduced) => tet_rule(1),
            (ElementKind::Hex8, MassRule::Reduced) => hex_rule(1),
            (ElementKind::Hex20, MassRule::Reduced) => hex_rule(2),
        }
    }

    /// Returns the stiffness (3m x 3m, row-major, node-major x, y, z) and the scalar mass (m x m) of an element with
    /// `nodes`.
    ///
    /// Both are exactly symmetric: one triangle is computed and mirrored.
    pub fn matrices(self, nodes: &[[f64; 3]], material: &Material, rule: MassRule) -> (Vec<f64>, Vec<f64>) {
        let m = nodes.len();
        let (lambda, mu) = material.lame();
        // Upper triangle of the integral of lambda div u div v + 2 mu eps(u):eps(v).
        let mut stiffness = vec![0.0; 9 * m * m];
        for (xi, weight) in self.stiffness_rule() {
            let (_, reference) = self.shape(xi);
            let (gradient, det) = physical_gradients(nodes, &reference);
            let w = weight * det;
            for a in 0..m {
                for b in a..m {
                    let (ga, gb) = (gradient[a], gradient[b]);
                    let dot = ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2];
                    for i in 0..3 {
                        for j in 0..3 {
                            let direct = if i == j { mu * dot } else { 0.0 };
                            let value = w * (lambda * (ga[i] * gb[j]) + mu * (ga[j] * gb[i]) + direct);
                            stiffness[(3 * a + i) * 3 * m + 3 * b + j] += value;
                        }
                    }
                }
            }
        }
        // Upper triangle of the integral of rho N_a N_b.
        let mut mass = vec![0.0; m * m];
        for (xi, weight) in self.mass_rule(rule) {
            let (shape, reference) = self.shape(xi);
            let w = weight * physical_gradients(nodes, &reference).1 * material.density;
            for a in 0..m {
                for b in a..m {
                    mass[a * m + b] += w * (shape[a] * shape[b]);
                }
            }
        }
        mirror(&mut stiffness, 3 * m);
        mirror(&mut mass, m);
        (stiffness, mass)
    }
}

impl ElementKind {
    /// Returns the scalar geometric stiffness (m x m, row-major): the integral of grad N_a' sigma grad N_b with the
    /// stress that the displacements `moved` of the nodes cause. The geometric stiffness of the element is its
    /// Kronecker product with I3.
    pub fn geometric_stiffness(
        self,
        nodes: &[[f64; 3]],
        moved: &[[f64; 3]],
        material: &Material,
    ) -> Vec<f64> {
        let m = nodes.len();
        let (lambda, mu) = material.lame();
        let mut stiffness = vec![0.0; m * m];
        for (xi, weight) in self.stiffness_rule() {
            let (gradient, det) = physical_gradients(nodes, &self.shape(xi).1);
            let slope: nalgebra::Matrix3<f64> = moved
                .iter()
                .zip(&gradient)
                .map(|(u, g)| nalgebra::Vector3::from(*u) * nalgebra::RowVector3::from(*g))
                .sum();
            let strain = 0.5 * (slope + slope.transpose());
            let stress = nalgebra::Matrix3::identity() * (lambda * strain.trace()) + strain * (2.0 * mu);
            for a in 0..m {
                let traction = stress * nalgebra::Vector3::from(gradient[a]);
                for b in a..m {
                    stiffness[a * m + b] +=
                        weight * det * traction.dot(&nalgebra::Vector3::from(gradient[b]));
                }
            }
        }
        mirror(&mut stiffness, m);
        stiffness
    }
}

impl ElementKind {
    /// Returns the stresses xx, yy, zz, xy, yz, xz at every quadrature point of the stiffness (6 per point) for unit
    /// displacements of the nodes (3m columns): sigma = lambda tr(eps) I + 2 mu eps.
    pub fn stresses(self, nodes: &[[f64; 3]], material: &Material) -> Vec<Vec<f64>> {
        let (lambda, mu) = material.lame();
        let mut rows = Vec::new();
        for (xi, _) in self.stiffness_rule() {
            let (gradient, _) = physical_gradients(nodes, &self.shape(xi).1);
            for (i, j) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)] {
                let entry = |(g, k): (&[f64; 3], usize)| {
                    let volume = if i == j { lambda * g[k] } else { 0.0 };
                    let along = |a: usize, b: usize| if k == a { g[b] } else { 0.0 };
                    volume + mu * (along(i, j) + along(j, i))
                };
                rows.push(gradient.iter().flat_map(|g| [0, 1, 2].map(|k| entry((g, k)))).collect());
            }
        }
        rows
    }
}

/// Copies the upper triangle to the lower one.
fn mirror(matrix: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            matrix[i * n + j] = matrix[j * n + i];
        }
    }
}

/// Returns the gradients in physical coordinates and the determinant of the Jacobian.
fn physical_gradients(nodes: &[[f64; 3]], reference: &[[f64; 3]]) -> (Vec<[f64; 3]>, f64) {
    let mut jacobian = nalgebra::Matrix3::zeros();
    for (x, g) in nodes.iter().zip(reference) {
        jacobian += nalgebra::Vector3::from(*x) * nalgebra::RowVector3::from(*g);
    }
    let det = jacobian.determinant();
    assert!(det > 0.0, "element is inverted: determinant {det}");
    let inverse = jacobian.try_inverse().expect("determinant is positive");
    let physical = reference.iter().map(|g| (nalgebra::RowVector3::from(*g) * inverse).transpose().into());
    (physical.collect(), det)
}

/// Returns the Gauss-Legendre points and weights on [-1, 1].
fn gauss(n: usize) -> Vec<(f64, f64)> {
    match n {
        1 => vec![(0.0, 2.0)],
        2 => [-1.0, 1.0].map(|s| (s / 3f64.sqrt(), 1.0)).to_vec(),
        3 => vec![(-0.6f64.sqrt(), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6f64.sqrt(), 5.0 / 9.0)],
        4 => [-1.0, 1.0]
            .iter()
            .flat_map(|s| {
                let root = 2.0 / 7.0 * 1.2f64.sqrt();
                let (inner, outer) = ((3.0 / 7.0 - root).sqrt(), (3.0 / 7.0 + root).sqrt());
                let w = 30f64.sqrt() / 36.0;
                [(s * inner, 0.5 + w), (s * outer, 0.5 - w)]
            })
            .collect(),
        _ => panic!("no rule with {n} points"),
    }
}

fn hex_rule(n: usize) -> Vec<Point> {
    let line = gauss(n);
    let mut points = Vec::new();
    for &(x, wx) in &line {
        for &(y, wy) in &line {
            points.extend(line.iter().map(|&(z, wz)| ([x, y, z], wx * wy * wz)));
        }
    }
    points
}

/// Returns Gauss-Legendre points in collapsed coordinates, exact up to the total degree 2 n - 3 on the unit
/// tetrahedron.
fn tet_rule(n: usize) -> Vec<Point> {
    if n == 1 {
        return vec![([0.25; 3], 1.0 / 6.0)];
    }
    let collapse = |([x, y, z], w): Point| {
        let [u, v, t] = [x, y, z].map(|c| 0.5 * (1.0 + c));
        let point = [u, (1.0 - u) * v, (1.0 - u) * (1.0 - v) * t];
        (point, w / 8.0 * (1.0 - u) * (1.0 - u) * (1.0 - v))
    };
    hex_rule(n).into_iter().map(collapse).collect()
}
