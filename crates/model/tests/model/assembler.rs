//! Test models: an error in them would be an error in every oracle.

use flexbody_linalg::CscMatrix;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Assembly, Mesh, entries};
use oracle::random::Random;
use oracle::reference::{dense, dense_modes, rigid_data, symmetric_eigen, unit_cube_eigenvalues};

const KINDS: [ElementKind; 4] =
    [ElementKind::Tet4, ElementKind::Tet10, ElementKind::Hex8, ElementKind::Hex20];

fn product(matrix: &CscMatrix, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; matrix.n_rows()];
    for (r, c, v) in entries(matrix) {
        y[r as usize] += v * x[c as usize];
    }
    y
}

/// Returns the sum of |K_ij x_j| per row, the scale of rounding in `product`.
fn magnitude(matrix: &CscMatrix, x: &[f64]) -> f64 {
    let mut y = vec![0.0; matrix.n_rows()];
    for (r, c, v) in entries(matrix) {
        y[r as usize] += (v * x[c as usize]).abs();
    }
    y.into_iter().fold(0.0, f64::max)
}

/// Returns the field u = a + G x at every node, node-major.
fn linear_field(nodes: &[[f64; 3]], shift: [f64; 3], gradient: [[f64; 3]; 3]) -> Vec<f64> {
    nodes
        .iter()
        .flat_map(|x| (0..3).map(|k| shift[k] + (0..3).map(|l| gradient[k][l] * x[l]).sum::<f64>()))
        .collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// Returns a block with every node moved at random, so that all elements differ. Mid-edge nodes of tetrahedra
/// stay in place.
fn distorted(kind: ElementKind) -> Mesh {
    let mut random = Random(7);
    let corner = random.vector::<3>();
    Mesh::from_cells(kind, &oracle::mesh::grid([3, 2, 2]), |p| {
        let wave = |k: usize| (1.7 * p[k] + corner[k]).sin() * (0.9 * p[(k + 1) % 3]).cos();
        [p[0] + 0.1 * wave(1), 0.7 * p[1] + 0.08 * wave(2), 0.5 * p[2] + 0.05 * wave(0)]
    })
}

fn assemble(mesh: &Mesh) -> Assembly {
    mesh.assemble(&Material { youngs: 3.0, poisson: 0.3, density: 2.0 }, MassRule::Consistent)
}

#[test]
fn rigid_motion_makes_no_force() {
    for kind in KINDS {
        let body = assemble(&distorted(kind));
        for spin in [[[0., 0., 0.], [0., 0., -1.], [0., 1., 0.]], [[0., -1., 0.], [1., 0., 0.], [0., 0., 0.]]]
        {
            let u = linear_field(&body.nodes, [0.3, -0.4, 0.7], spin);
            let force = product(&body.stiffness, &u);
            assert!(
                largest(&force) < 1e-14 * magnitude(&body.stiffness, &u),
                "{kind:?}: {}",
                largest(&force)
            );
        }
    }
}

#[test]
fn matrices_are_symmetric_to_the_last_bit() {
    for kind in KINDS {
        let body = assemble(&distorted(kind));
        assert!(body.stiffness == body.stiffness.transpose(), "{kind:?}");
        assert!(body.scalar_mass == body.scalar_mass.transpose(), "{kind:?}");
    }
}

#[test]
fn patch_test_constant_strain_has_exact_energy_and_no_inner_force() {
    let strain = [[0.4, 0.1, -0.2], [0.1, -0.3, 0.25], [-0.2, 0.25, 0.2]];
    for kind in KINDS {
        let body = assemble(&distorted(kind));
        let (lambda, mu) = (Material { youngs: 3.0, poisson: 0.3, density: 2.0 }).lame();
        let trace: f64 = (0..3).map(|k| strain[k][k]).sum();
        let square: f64 = strain.iter().flatten().map(|e| e * e).sum();
        let (mass, _, _) = rigid_data(&body.nodes, &body.scalar_mass);
        let exact = mass / 2.0 * (0.5 * lambda * trace * trace + mu * square);
        let u = linear_field(&body.nodes, [0.0; 3], strain);
        let force = product(&body.stiffness, &u);
        let energy = 0.5 * u.iter().zip(&force).map(|(a, b)| a * b).sum::<f64>();
        assert!((energy / exact - 1.0).abs() < 1e-13, "{kind:?}: {energy} {exact}");
        let inner: Vec<usize> = inner_nodes(&body, kind);
        assert!(!inner.is_empty());
        for i in inner {
            assert!(
                largest(&force[3 * i..3 * i + 3]) < 1e-14 * magnitude(&body.stiffness, &u),
                "{kind:?} node {i}"
            );
        }
    }
}

/// Returns the nodes inside the distorted block, which belong to eight cells each.
fn inner_nodes(body: &Assembly, kind: ElementKind) -> Vec<usize> {
    let reference = Mesh::block(kind, [3, 2, 2], [3.0, 2.0, 2.0]);
    assert_eq!(reference.nodes.len(), body.nodes.len());
    let inside = |x: &[f64; 3]| x.iter().zip([3.0, 2.0, 2.0]).all(|(v, l)| *v > 1e-9 && *v < l - 1e-9);
    (0..reference.nodes.len()).filter(|&i| inside(&reference.nodes[i])).collect()
}

#[test]
fn cuboid_mass_and_inertia_are_exact() {
    let size = [1.3, 0.4, 0.7];
    let [a, b, c] = size;
    for kind in KINDS {
        let body = assemble(&Mesh::block(kind, [3, 2, 2], size));
        let (mass, com, inertia) = rigid_data(&body.nodes, &body.scalar_mass);
        let m = 2.0 * a * b * c;
        let exact = [b * b + c * c, a * a + c * c, a * a + b * b].map(|s| m * s / 12.0);
        assert!((mass / m - 1.0).abs() < 1e-13, "{kind:?} {:e}", mass / m - 1.0);
        for k in 0..3 {
            assert!((com[k] / size[k] - 0.5).abs() < 1e-13, "{kind:?}");
            assert!((inertia[(k, k)] / exact[k] - 1.0).abs() < 1e-13, "{kind:?}");
            assert!(inertia[(k, (k + 1) % 3)].abs() < 1e-14 * exact[1], "{kind:?}");
        }
    }
}

#[test]
fn linear_tetrahedra_have_the_textbook_mass() {
    // Entries rho V / 20 (1 + delta_ij).
    let nodes = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.0], [0.3, 1.5, 0.2], [0.1, 0.2, 1.1]];
    let material = Material { youngs: 1.0, poisson: 0.25, density: 3.0 };
    let (_, mass) = ElementKind::Tet4.matrices(&nodes, &material, MassRule::Consistent);
    let edge = |i: usize| nalgebra::Vector3::from(nodes[i]) - nalgebra::Vector3::from(nodes[0]);
    let volume = edge(1).dot(&edge(2).cross(&edge(3))) / 6.0;
    for i in 0..4 {
        for j in 0..4 {
            let exact = 3.0 * volume / 20.0 * if i == j { 2.0 } else { 1.0 };
            assert!((mass[4 * i + j] / exact - 1.0).abs() < 1e-14);
        }
    }
}

#[test]
fn quadratic_tetrahedra_have_the_textbook_mass() {
    // Entries rho V / 420 times: corners 6, 1; corner to its edge -4, to another edge -6; edges 32, adjacent
    // 16, opposite 8.
    let nodes = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let edges = oracle::elements::TET_EDGES;
    let mut all = nodes.to_vec();
    all.extend(
        edges
            .iter()
            .map(|&(a, b)| -> [f64; 3] { std::array::from_fn(|k| (nodes[a][k] + nodes[b][k]) / 2.0) }),
    );
    let material = Material { youngs: 1.0, poisson: 0.25, density: 420.0 * 6.0 };
    let (_, mass) = ElementKind::Tet10.matrices(&all, &material, MassRule::Consistent);
    let ends = |i: usize| if i < 4 { vec![i] } else { vec![edges[i - 4].0, edges[i - 4].1] };
    for i in 0..10 {
        for j in 0..10 {
            let common = ends(i).iter().filter(|e| ends(j).contains(e)).count();
            let exact = match (i < 4, j < 4, common) {
                (true, true, 1) => 6.0,
                (true, true, _) => 1.0,
                (true, false, 1) | (false, true, 1) => -4.0,
                (true, false, _) | (false, true, _) => -6.0,
                (false, false, 2) => 32.0,
                (false, false, 1) => 16.0,
                (false, false, _) => 8.0,
            };
            assert!((mass[10 * i + j] - exact).abs() < 1e-12, "{i} {j}: {}", mass[10 * i + j]);
        }
    }
}

#[test]
fn one_trilinear_cube_has_its_closed_form_spectrum() {
    // Parity separates the 24 modes of the unit cube: first those of K alone, then lambda of the free body.
    let unit = Material { youngs: 1.0, poisson: 0.2, density: 1.0 };
    let body = Mesh::block(ElementKind::Hex8, [1; 3], [1.0; 3]).assemble(&unit, MassRule::Consistent);
    let (lambda, mu) = unit.lame();
    let (found, _) = symmetric_eigen(dense(&body.stiffness).as_ref());
    let mut stiffness = vec![0.0; 6];
    for (value, times) in [
        (1.5 * lambda + mu, 1),               // dilatation x
        (mu, 5),                              // constant deviatoric strain
        ((2.0 * lambda + 3.0 * mu) / 6.0, 3), // bending (x y, 0, z y), both curvatures in phase
        (mu / 2.0, 3),                        // bending with both curvatures in opposite phase
        (2.0 * mu / 3.0, 1),                  // warping (y z, x z, x y)
        (mu / 6.0, 2),                        // twist
        ((lambda + 4.0 * mu) / 18.0, 3),      // x y z
    ] {
        stiffness.extend(vec![value; times]);
    }
    stiffness.sort_by(f64::total_cmp);
    for (value, exact) in found.iter().zip(&stiffness) {
        assert!((value - exact).abs() < 1e-14, "{value} {exact}");
    }
    let modes = dense_modes(&body);
    for (value, exact) in modes.eigenvalues.iter().zip(unit_cube_eigenvalues(lambda, mu)) {
        assert!((value / exact - 1.0).abs() < 1e-13, "{value} {exact}");
    }
}

#[test]
fn dense_reference_satisfies_its_equations() {
    for (kind, rule) in [
        (ElementKind::Hex8, MassRule::Consistent),
        (ElementKind::Hex8, MassRule::Reduced),
        (ElementKind::Tet10, MassRule::Reduced),
    ] {
        let body = Mesh::block(kind, [3, 2, 1], [0.3, 0.1, 0.08]).assemble(&Material::STEEL, rule);
        let modes = dense_modes(&body);
        assert_eq!(modes.zero, 6);
        assert_eq!(modes.zero + modes.infinite + modes.eigenvalues.len(), body.n_dofs());
        assert_eq!(modes.infinite > 0, rule == MassRule::Reduced);
        let m = body.mass();
        for (j, lambda) in modes.eigenvalues.iter().enumerate().take(20) {
            let psi: Vec<f64> = (0..body.n_dofs()).map(|i| modes.shapes[(i, j)]).collect();
            let (k_psi, m_psi) = (product(&body.stiffness, &psi), product(&m, &psi));
            let residual: Vec<f64> = k_psi.iter().zip(&m_psi).map(|(a, b)| a - lambda * b).collect();
            assert!(
                largest(&residual) < 1e-9 * largest(&k_psi),
                "{kind:?} mode {j}: {:e}",
                largest(&residual)
            );
            let norm: f64 = psi.iter().zip(&m_psi).map(|(a, b)| a * b).sum();
            assert!((norm - 1.0).abs() < 1e-9, "{kind:?} mode {j}: {norm}");
        }
    }
}

#[test]
fn mechanisms_and_separate_bodies_have_more_zero_modes() {
    let unit = Material { youngs: 1.0, poisson: 0.3, density: 1.0 };
    for (mesh, zero) in [
        (Mesh::hinge(ElementKind::Hex8, 2), 7),
        (Mesh::two_bodies(ElementKind::Hex8, 2), 12),
        (Mesh::bracket(ElementKind::Hex8, 4, 1, 1.0), 6),
        (Mesh::ball(ElementKind::Hex8, 1, 1.0), 6),
        (Mesh::cylinder(ElementKind::Hex8, 1, 2, 1.0, 2.0), 6),
        (Mesh::hinge(ElementKind::Tet10, 1), 7),
    ] {
        assert_eq!(dense_modes(&mesh.assemble(&unit, MassRule::Consistent)).zero, zero);
    }
}
