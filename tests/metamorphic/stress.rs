//! Geometric stiffness of solids under the centrifugal forces of a spin.

use flexbody_linalg::CscMatrix;
use flexbody_model::{GeometricStiffness, LoadKind, RawMatrix, RawModel, UnitLoad};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::elements::Material;
use oracle::mesh::{Mesh, entries};
use oracle::reference::dense;

/// Eigenvalues of K below this part of the largest belong to rigid motions.
const RIGID: f64 = 1e-10;

fn matrix(a: &CscMatrix) -> DMatrix<f64> {
    let a = dense(a);
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

/// Returns K_geo for a unit of every product of two components of an angular velocity about the centre of
/// mass, for a model of these parts.
pub fn of_spin(raw: &RawModel, parts: &[(Mesh, Material)]) -> Vec<GeometricStiffness<RawMatrix>> {
    let (stiffness, mass) = (matrix(&raw.stiffness.matrix), matrix(&raw.mass.matrix));
    let n = raw.nodes.len();
    let unit = |k: usize| DVector::from_fn(3 * n, |row, _| if row % 3 == k { 1.0 } else { 0.0 });
    let total = unit(0).dot(&(&mass * unit(0)));
    let place = |i: usize| Vector3::from(raw.nodes.positions[i]);
    let field = DVector::from_fn(3 * n, |row, _| place(row / 3)[row % 3]);
    let centre = Vector3::from_fn(|k, _| unit(k).dot(&(&mass * &field)) / total);
    let arm = |i: usize| place(i) - centre;

    // Rigid motions about the centre of mass, used to balance the forces.
    let mut rigid = DMatrix::zeros(3 * n, 6);
    for i in 0..n {
        rigid.view_mut((3 * i, 0), (3, 3)).fill_with_identity();
        rigid.view_mut((3 * i, 3), (3, 3)).copy_from(&-arm(i).cross_matrix());
    }
    let weighted = &mass * &rigid;
    let own = rigid.tr_mul(&weighted).try_inverse().expect("a rigid body with inertia");
    let eigen = stiffness.symmetric_eigen();
    let largest = eigen.eigenvalues.amax();
    let solve = |force: DVector<f64>| -> DVector<f64> {
        let balanced = &force - &weighted * (&own * rigid.tr_mul(&force));
        let mut along = eigen.eigenvectors.tr_mul(&balanced);
        for (value, lambda) in along.iter_mut().zip(&eigen.eigenvalues) {
            *value = if *lambda > RIGID * largest { *value / lambda } else { 0.0 };
        }
        &eigen.eigenvectors * along
    };
    let of_load = |component: usize| {
        let (k, l) = LoadKind::SPIN[component];
        // Coefficient of w_k w_l in w x (w x x).
        let centripetal = |x: Vector3<f64>| {
            if k == l { Vector3::ith(k, x[k]) - x } else { Vector3::ith(k, x[l]) + Vector3::ith(l, x[k]) }
        };
        let acceleration = DVector::from_fn(3 * n, |row, _| centripetal(arm(row / 3))[row % 3]);
        let moved = solve(-(&mass * acceleration));
        let of_part = |(mesh, material): &(Mesh, Material)| {
            entries(&mesh.geometric_stiffness(material, moved.as_slice())).collect::<Vec<_>>()
        };
        let all: Vec<_> = parts.iter().flat_map(of_part).collect();
        let matrix = CscMatrix::from_triplets(3 * n, 3 * n, &all);
        let load = UnitLoad { kind: LoadKind::Spin, component };
        GeometricStiffness { load, matrix: RawMatrix { matrix, ..raw.stiffness.clone() } }
    };
    (0..LoadKind::SPIN.len()).map(of_load).collect()
}
