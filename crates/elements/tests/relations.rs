//! Relations that element matrices fulfil without a reference: rigid motions, constant strain, work, rotation of the model.

use flexbody_elements::{Axes, Elasticity, Formulation, Section};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

/// Returns a skewed element: nodes in natural coordinates, moved and turned.
fn element(formulation: Formulation) -> Vec<[f64; 3]> {
    let skew = Matrix3::new(1.3, 0.2, 0.1, -0.3, 1.1, 0.2, 0.15, -0.25, 0.9);
    let mut state = 7 + formulation.n_nodes() as u64;
    let corners: Vec<Vector3<f64>> =
        corners(formulation).iter().map(|corner| skew * corner + random(&mut state) * 0.15).collect();
    let middles: Vec<Vector3<f64>> = edges(formulation)
        .iter()
        .map(|&[a, b]| (corners[a] + corners[b]) * 0.5 + random(&mut state) * 0.04)
        .collect();
    corners.into_iter().chain(middles).map(Into::into).collect()
}

/// Returns three numbers between -1 and 1.
fn random(state: &mut u64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    })
}

fn corners(formulation: Formulation) -> Vec<Vector3<f64>> {
    let ground: &[[f64; 2]] = match formulation.n_nodes() {
        4 | 10 => {
            let corner = |d: usize| Vector3::from_fn(|row, _| if row + 1 == d { 1.0 } else { 0.0 });
            return (0..4).map(corner).collect();
        }
        6 | 15 => &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        _ => &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
    };
    [-1.0, 1.0].iter().flat_map(|&z| ground.iter().map(move |&[x, y]| Vector3::new(x, y, z))).collect()
}

fn edges(formulation: Formulation) -> Vec<[usize; 2]> {
    let ring = |count: usize, first: usize| (0..count).map(move |n| [first + n, first + (n + 1) % count]);
    let upright = |count: usize| (0..count).map(move |n| [n, n + count]);
    match formulation.n_nodes() {
        10 => ring(3, 0).chain((0..3).map(|n| [n, 3])).collect(),
        15 => ring(3, 0).chain(ring(3, 3)).chain(upright(3)).collect(),
        20 => ring(4, 0).chain(ring(4, 4)).chain(upright(4)).collect(),
        _ => Vec::new(),
    }
}

fn steel() -> Section {
    let elasticity = Elasticity::isotropic(2.1, 0.3).expect("a material");
    Section { material: "steel".to_owned(), elasticity, axes: Axes::Model }
}

fn wood(axes: Axes) -> Section {
    let elasticity = Elasticity::orthotropic_constants([1.2, 0.9, 0.5], [0.3, 0.25, 0.4], [0.7, 0.8, 0.3])
        .expect("a material");
    Section { material: "wood".to_owned(), elasticity, axes }
}

fn cylinder() -> Axes {
    Axes::Cylinder { from: Vector3::new(0.3, -4.0, 0.2), to: Vector3::new(0.5, -3.6, 1.4) }
}

fn stiffness(formulation: Formulation, x: &[[f64; 3]], section: &Section) -> DMatrix<f64> {
    let size = 3 * formulation.n_functions();
    DMatrix::from_row_slice(size, size, &formulation.stiffness(x, section).expect("an element"))
}

/// Returns displacements of the nodes by their positions, and zeros for the internal nodes.
fn displace(
    formulation: Formulation,
    x: &[[f64; 3]],
    of: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> Vec<[f64; 3]> {
    let mut u: Vec<[f64; 3]> = x.iter().map(|&place| of(Vector3::from(place)).into()).collect();
    u.resize(formulation.n_functions(), [0.0; 3]);
    u
}

fn flat(u: &[[f64; 3]]) -> DVector<f64> {
    DVector::from_iterator(3 * u.len(), u.iter().flatten().copied())
}

/// Returns the sum of magnitudes of the rows of a matrix, the largest.
fn row_sum(matrix: &DMatrix<f64>) -> f64 {
    matrix.row_iter().map(|row| row.lp_norm(1)).fold(0.0, f64::max)
}

fn tensor(stress: &[f64; 6]) -> Matrix3<f64> {
    let [xx, yy, zz, xy, yz, xz] = *stress;
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

fn vector(tensor: &Matrix3<f64>) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|place| tensor[place])
}

/// Returns stresses that differ from point to point.
fn stresses(formulation: Formulation) -> Vec<[f64; 6]> {
    let mut state = 3;
    (0..formulation.n_points())
        .map(|_| {
            let (normal, shear) = (random(&mut state), random(&mut state));
            [normal.x, normal.y, normal.z, shear.x, shear.y, shear.z]
        })
        .collect()
}

#[test]
fn rigid_motions_have_no_forces() {
    for formulation in Formulation::ALL {
        let x = element(formulation);
        for section in [steel(), wood(cylinder())] {
            let matrix = stiffness(formulation, &x, &section);
            assert_eq!(matrix, matrix.transpose());
            let turn = |place: Vector3<f64>| Vector3::new(0.3, -0.5, 0.7).cross(&place);
            let moved = matrix.clone() * flat(&displace(formulation, &x, |_| Vector3::new(0.2, 0.9, -0.4)));
            assert!(moved.amax() < 1e-14 * row_sum(&matrix), "{}", formulation.name());
            let turned = matrix.clone() * flat(&displace(formulation, &x, turn));
            let error = turned.amax() / row_sum(&matrix);
            // The hourglass control of CalculiX has forces under rotation.
            let limit = if formulation == Formulation::Hex8UniformStrain { 1e-2 } else { 1e-14 };
            assert!(error < limit, "{} {error:e}", formulation.name());
            let lowest = matrix.clone().symmetric_eigenvalues().min();
            assert!(lowest > -1e-13 * row_sum(&matrix), "{} {lowest:e}", formulation.name());
        }
    }
}

#[test]
fn a_linear_displacement_has_a_constant_stress() {
    let slope = Matrix3::new(0.1, 0.3, -0.2, 0.05, -0.15, 0.4, 0.2, 0.1, 0.25);
    for formulation in Formulation::ALL {
        let x = element(formulation);
        let section = wood(Axes::Model);
        let u = displace(formulation, &x, |place| slope * place);
        let strain = [0, 1, 2].map(|k| slope[(k, k)]);
        let shear = [(0, 1), (1, 2), (0, 2)].map(|(i, j)| slope[(i, j)] + slope[(j, i)]);
        let strain = DVector::from_iterator(6, strain.into_iter().chain(shear));
        let expected = section.elasticity.0 * &strain;
        let strains = formulation.strains(&x, &u).expect("an element");
        let found = formulation.stresses(&x, &u, &section).expect("an element");
        for (at, stress) in strains.iter().zip(&found) {
            assert!((DVector::from_column_slice(at) - &strain).amax() < 1e-14, "{}", formulation.name());
            assert!((DVector::from_column_slice(stress) - expected).amax() < 1e-14, "{}", formulation.name());
        }
        let forces = formulation.forces(&x, &found).expect("an element");
        let total: Vector3<f64> = forces[..x.len()].iter().map(|&force| Vector3::from(force)).sum();
        assert!(total.amax() < 1e-13, "{}: {total}", formulation.name());
        let moment: Vector3<f64> =
            x.iter().zip(&forces).map(|(&x, &f)| Vector3::from(x).cross(&Vector3::from(f))).sum();
        assert!(moment.amax() < 1e-13, "{}: {moment}", formulation.name());
    }
}

#[test]
fn the_stress_of_a_patch_of_incompatible_elements_is_not_constant() {
    let formulation = Formulation::Hex8Incompatible;
    let section = steel();
    let x = element(formulation);
    let u = displace(formulation, &x, |place| Vector3::new(0.1 * place.x, 0.0, 0.0));
    let forces = stiffness(formulation, &x, &section) * flat(&u);
    assert!(forces.rows(24, 9).amax() > 1e-3, "forces at internal nodes move them");
    // A parallelepiped has none.
    let skew = Matrix3::new(1.3, 0.2, 0.1, -0.3, 1.1, 0.2, 0.15, -0.25, 0.9);
    let even: Vec<[f64; 3]> = corners(formulation).iter().map(|corner| (skew * corner).into()).collect();
    let u = displace(formulation, &even, |place| Vector3::new(0.1 * place.x, 0.0, 0.0));
    let forces = stiffness(formulation, &even, &section) * flat(&u);
    assert!(forces.rows(24, 9).amax() < 1e-15);
}

#[test]
fn the_forces_of_displacements_are_those_of_their_stresses() {
    let section = wood(cylinder());
    for formulation in Formulation::ALL {
        let x = element(formulation);
        let mut state = 11;
        let u: Vec<[f64; 3]> = (0..formulation.n_functions()).map(|_| random(&mut state).into()).collect();
        let matrix = stiffness(formulation, &x, &section);
        let found = formulation.stresses(&x, &u, &section).expect("an element");
        let forces = flat(&formulation.forces(&x, &found).expect("an element"));
        let difference = (&matrix * flat(&u) - forces).amax() / row_sum(&matrix);
        // The hourglass control has forces without stress.
        let limit = if formulation == Formulation::Hex8UniformStrain { 1e-2 } else { 1e-14 };
        assert!(difference < limit, "{} {difference:e}", formulation.name());
        let rows = formulation.stress_rows(&x, &section).expect("an element");
        assert_eq!(rows.len(), 6 * formulation.n_points());
        for (row, stress) in rows.iter().zip(found.iter().flatten()) {
            let product: f64 = row.iter().zip(u.iter().flatten()).map(|(a, b)| a * b).sum();
            assert!((product - stress).abs() < 1e-13, "{}", formulation.name());
        }
        let nodal = formulation.nodal_stress_rows(&x, &section).expect("an element");
        assert_eq!(nodal.len(), 6 * formulation.n_nodes());
        for (at, row) in nodal.iter().enumerate() {
            let product: f64 = row.iter().zip(u.iter().flatten()).map(|(a, b)| a * b).sum();
            let weights = &formulation.nodal_extrapolation()[at / 6];
            let stress: f64 = weights.iter().zip(&found).map(|(w, stress)| w * stress[at % 6]).sum();
            assert!((product - stress).abs() < 1e-12, "{}", formulation.name());
        }
    }
}

#[test]
fn the_mean_dilatation_replaces_that_of_all_points() {
    let x = element(Formulation::Hex8);
    let mut state = 5;
    let u: Vec<[f64; 3]> = (0..8).map(|_| random(&mut state).into()).collect();
    let strains = |formulation: Formulation| formulation.strains(&x, &u).expect("an element");
    let (full, mean) = (strains(Formulation::Hex8), strains(Formulation::Hex8MeanDilatation));
    let uniform = strains(Formulation::Hex8UniformStrain)[0];
    let dilatation = |strain: &[f64; 6]| strain[..3].iter().sum::<f64>();
    for (full, mean) in full.iter().zip(&mean) {
        assert!((dilatation(mean) - dilatation(&uniform)).abs() < 1e-14);
        for k in 0..6 {
            let part =
                |strain: &[f64; 6]| if k < 3 { strain[k] - dilatation(strain) / 3.0 } else { strain[k] };
            assert!((part(full) - part(mean)).abs() < 1e-14);
        }
    }
}

#[test]
fn volumes_of_points_add_up_to_that_of_the_element() {
    for formulation in Formulation::ALL {
        let x = element(formulation);
        let points = formulation.points(&x).expect("an element");
        assert_eq!(points.len(), formulation.n_points());
        let volume: f64 = points.iter().map(|point| point.volume).sum();
        // The volume by the divergence of the position: rules that are exact for constant strain have it.
        let unit: Vec<[f64; 6]> = points.iter().map(|_| [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]).collect();
        let forces = formulation.forces(&x, &unit).expect("an element");
        let work: f64 = x.iter().flatten().zip(forces.iter().flatten()).map(|(x, f)| x * f).sum();
        assert!((work - 3.0 * volume).abs() < 1e-13 * volume, "{}", formulation.name());
    }
    let x = element(Formulation::Hex8);
    let tetrahedra = [[0, 1, 3, 4], [1, 2, 3, 6], [1, 4, 5, 6], [3, 4, 6, 7], [1, 3, 4, 6]];
    let cut: f64 = tetrahedra
        .iter()
        .map(|nodes| {
            let edge = |k: usize| Vector3::from(x[nodes[k]]) - Vector3::from(x[nodes[0]]);
            edge(1).cross(&edge(2)).dot(&edge(3)) / 6.0
        })
        .sum();
    let volume: f64 =
        Formulation::Hex8.points(&x).expect("an element").iter().map(|point| point.volume).sum();
    // Faces are not plane: the tetrahedra have nearly the same volume.
    assert!((volume - cut).abs() < 0.05 * volume, "{volume} {cut}");
}

#[test]
fn the_geometric_stiffness_of_the_positions_is_the_force_of_the_stress() {
    for formulation in Formulation::ALL {
        let x = element(formulation);
        let stresses = stresses(formulation);
        let size = formulation.n_functions();
        let values = formulation.geometric_stiffness(&x, &stresses).expect("an element");
        let scalar = DMatrix::from_row_slice(size, size, &values);
        assert_eq!(scalar, scalar.transpose());
        let mut ones = DVector::zeros(size);
        ones.rows_mut(0, x.len()).fill(1.0);
        assert!((&scalar * ones).amax() < 1e-13, "{}", formulation.name());
        if formulation == Formulation::Hex8MeanDilatation {
            continue; // The geometric stiffness has the gradients of the points, the forces those of the mean dilatation.
        }
        let forces = formulation.forces(&x, &stresses).expect("an element");
        for d in 0..3 {
            let mut positions = DVector::zeros(size);
            for (n, place) in x.iter().enumerate() {
                positions[n] = place[d];
            }
            let found = &scalar * positions;
            for (force, value) in forces.iter().zip(found.iter()) {
                assert!((force[d] - value).abs() < 1e-13, "{}", formulation.name());
            }
        }
    }
}

/// Returns the forces of a material with stress proportional to the strain of Green, deformed.
fn large_forces(
    formulation: Formulation,
    x: &[[f64; 3]],
    u: &[[f64; 3]],
    first: &[[f64; 6]],
) -> DVector<f64> {
    // Forces of the first Piola-Kirchhoff stress F S: those of the symmetric stresses along each direction in turn.
    let size = formulation.n_functions();
    let values = |direction: usize, stress: &dyn Fn(usize) -> Vector3<f64>| {
        let rows: Vec<[f64; 6]> = (0..formulation.n_points())
            .map(|p| {
                // A stress with the given row alone would not be symmetric: twice the row with its transpose, less its trace.
                let mut tensor = Matrix3::zeros();
                tensor.set_row(direction, &stress(p).transpose());
                vector(&(tensor + tensor.transpose() - Matrix3::from_diagonal(&tensor.diagonal())))
            })
            .collect();
        formulation
            .forces(x, &rows)
            .expect("an element")
            .iter()
            .map(|force| force[direction])
            .collect::<Vec<_>>()
    };
    let mut slopes = vec![Matrix3::<f64>::zeros(); formulation.n_points()];
    for d in 0..3 {
        // Gradients of one component, by the strains of a displacement along x, y and z.
        for along in 0..3 {
            let moved: Vec<[f64; 3]> =
                u.iter().map(|u| std::array::from_fn(|k| if k == along { u[d] } else { 0.0 })).collect();
            for (slope, strain) in slopes.iter_mut().zip(formulation.strains(x, &moved).expect("an element"))
            {
                slope[(d, along)] = strain[along];
            }
        }
    }
    let mut forces = DVector::zeros(3 * size);
    for d in 0..3 {
        let row = |p: usize| {
            let deformation = Matrix3::identity() + slopes[p];
            (deformation * tensor(&first[p])).row(d).transpose()
        };
        for (node, force) in values(d, &row).into_iter().enumerate() {
            forces[3 * node + d] = force;
        }
    }
    forces
}

#[test]
fn the_geometric_stiffness_is_the_derivative_of_the_forces_of_a_constant_stress() {
    for formulation in Formulation::ALL {
        if formulation == Formulation::Hex8MeanDilatation {
            continue; // The strains do not have the gradients of the points.
        }
        let x = element(formulation);
        let stresses = stresses(formulation);
        let size = formulation.n_functions();
        let values = formulation.geometric_stiffness(&x, &stresses).expect("an element");
        let matrix = DMatrix::from_row_slice(size, size, &values).kronecker(&DMatrix::<f64>::identity(3, 3));
        let mut state = 23;
        let u: Vec<[f64; 3]> = (0..size).map(|_| random(&mut state).into()).collect();
        let scaled = |factor: f64| -> Vec<[f64; 3]> { u.iter().map(|u| u.map(|c| factor * c)).collect() };
        let after = large_forces(formulation, &x, &scaled(0.5), &stresses);
        let before = large_forces(formulation, &x, &scaled(-0.5), &stresses);
        let error = (&matrix * flat(&u) - (after - before)).amax();
        assert!(error < 1e-13 * row_sum(&matrix), "{} {error:e}", formulation.name());
    }
}

#[test]
fn a_linear_field_is_extrapolated_to_itself() {
    for formulation in Formulation::ALL {
        let weights = formulation.nodal_extrapolation();
        assert_eq!(weights.len(), formulation.n_nodes());
        // A parallelepiped or wedge with straight edges, so that a field is linear in natural coordinates too.
        let nodes = corners(formulation);
        let middles = edges(formulation);
        let middles = middles.iter().map(|&[a, b]| (nodes[a] + nodes[b]) * 0.5);
        let x: Vec<[f64; 3]> = nodes.iter().copied().chain(middles).map(Into::into).collect();
        let points = formulation.points(&x).expect("an element");
        for (node, weights) in x.iter().zip(&weights) {
            assert_eq!(weights.len(), formulation.n_points());
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            for (d, place) in node.iter().enumerate() {
                let found: f64 = weights.iter().zip(&points).map(|(w, point)| w * point.position[d]).sum();
                let constant = formulation.n_points() == 1 || (formulation.n_points() == 2 && d < 2);
                let expected = if constant { points[0].position[d] } else { *place };
                assert!((found - expected).abs() < 1e-13, "{} {found} {expected}", formulation.name());
            }
        }
    }
}

#[test]
fn matrices_turn_with_the_model() {
    let turn = Rotation3::from_euler_angles(0.4, -1.1, 2.3);
    for formulation in Formulation::ALL {
        if formulation == Formulation::Hex8UniformStrain {
            continue; // The hourglass control of CalculiX prefers z.
        }
        let x = element(formulation);
        let turned: Vec<[f64; 3]> = x.iter().map(|&place| (turn * Vector3::from(place)).into()).collect();
        let axes = *Rotation3::from_euler_angles(-0.3, 0.8, 0.1).matrix();
        let Axes::Cylinder { from, to } = cylinder() else { unreachable!("a cylinder") };
        let pairs = [
            (Axes::Fixed(axes), Axes::Fixed(turn.matrix() * axes)),
            (cylinder(), Axes::Cylinder { from: turn * from, to: turn * to }),
        ];
        for (before, after) in pairs {
            let matrix = stiffness(formulation, &x, &wood(before));
            let size = formulation.n_functions();
            let all = DMatrix::<f64>::identity(size, size).kronecker(turn.matrix());
            let expected = &all * &matrix * all.transpose();
            let found = stiffness(formulation, &turned, &wood(after));
            assert!((found - expected).amax() < 1e-14 * row_sum(&matrix), "{}", formulation.name());
        }
    }
}

#[test]
fn inverted_elements_and_axes_that_are_nowhere_have_no_matrices() {
    for formulation in Formulation::ALL {
        let x = element(formulation);
        let mirrored: Vec<[f64; 3]> = x.iter().map(|&[x, y, z]| [x, y, -z]).collect();
        assert_eq!(formulation.stiffness(&mirrored, &steel()), None, "{}", formulation.name());
        let flat: Vec<[f64; 3]> = x.iter().map(|&[x, y, _]| [x, y, 0.0]).collect();
        assert_eq!(formulation.stiffness(&flat, &steel()), None, "{}", formulation.name());
        let place = Vector3::from(formulation.points(&x).expect("an element")[0].position);
        let through = Axes::Cylinder { from: place, to: place + Vector3::z() };
        assert_eq!(formulation.stiffness(&x, &wood(through)), None, "{}", formulation.name());
        assert_eq!(formulation.stiffness(&x, &steel()), formulation.stiffness(&x, &steel()));
    }
}

#[test]
fn types_have_formulations_with_their_number_of_nodes() {
    let types = [
        ("C3D4", 4),
        ("C3D6", 6),
        ("C3D8", 8),
        ("C3D8I", 8),
        ("C3D8R", 8),
        ("C3D10", 10),
        ("C3D15", 15),
        ("C3D20", 20),
        ("C3D20R", 20),
        ("CTETRA", 4),
        ("CTETRA", 10),
        ("CPENTA", 6),
        ("CPENTA", 15),
        ("CHEXA", 8),
        ("CHEXA", 20),
    ];
    for (kind, nodes) in types {
        let candidates = Formulation::candidates(kind, nodes);
        assert!(!candidates.is_empty(), "{kind} {nodes}");
        assert!(candidates.iter().all(|candidate| candidate.n_nodes() == nodes));
        let mut order = Formulation::node_order(kind, nodes).expect("an order");
        assert_eq!(
            order == (0..nodes).collect::<Vec<_>>(),
            !(kind.starts_with("CHEXA") && nodes == 20 || kind == "CPENTA" && nodes == 15)
        );
        order.sort_unstable();
        assert_eq!(order, (0..nodes).collect::<Vec<_>>());
        assert!(Formulation::candidates(kind, nodes + 1).is_empty());
    }
    assert_eq!(Formulation::candidates("S8R", 8), []);
    assert_eq!(Formulation::node_order("S8R", 8), None);
}
