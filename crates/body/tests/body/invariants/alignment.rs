//! Comparison of modes that differ in sign and inside repeated eigenvalues.

use super::bodies::{Body, random_matrix};
use faer::{Mat, MatRef};
use flexbody_body::invariants::{Invariants, align, compare_invariants, condense};
use oracle::random::Random;

/// Returns the rotation by an angle in the plane of modes p and q.
fn plane_rotation(nf: usize, p: usize, q: usize, angle: f64) -> Mat<f64> {
    let mut t = Mat::<f64>::identity(nf, nf);
    (t[(p, p)], t[(p, q)], t[(q, p)], t[(q, q)]) = (angle.cos(), -angle.sin(), angle.sin(), angle.cos());
    t
}

fn condensed(body: &Body, shapes: MatRef<'_, f64>) -> Invariants {
    let nf = shapes.ncols();
    condense(&body.scalar_mass, &body.positions, shapes, Mat::identity(nf, nf))
}

/// Returns the modes of b: changed signs, 1..3 rotated, 4..7 reflected and rotated.
fn disguise() -> Mat<f64> {
    let mut t = plane_rotation(8, 1, 2, 2.1) * plane_rotation(8, 4, 6, -0.7) * plane_rotation(8, 5, 6, 1.3);
    for column in [0, 4, 7] {
        for row in 0..8 {
            t[(row, column)] = -t[(row, column)];
        }
    }
    t
}

#[test]
fn signs_and_rotations_of_repeated_modes_are_undone_with_any_inner_product() {
    let body = Body::cuboid(31, 8);
    let (a, shapes) = (condensed(&body, body.shapes.as_ref()), &body.shapes * disguise());
    let b = condensed(&body, shapes.as_ref());
    let groups = [1..3, 4..7];
    let plain = body.shapes.transpose() * &shapes;
    let weights = Mat::from_fn(shapes.nrows(), 8, |row, p| (1.0 + (row % 7) as f64) * shapes[(row, p)]);
    let weighted = body.shapes.transpose() * weights;
    for cross in [plain, weighted] {
        let (alignment, differences) = compare_invariants(&a, &b, cross.as_ref(), &groups);
        for (name, value) in differences {
            assert!(value < 1e-13, "{name}: {value:e}");
        }
        let product = alignment.basis.transpose() * &alignment.basis - Mat::<f64>::identity(8, 8);
        assert!(product.norm_max() < 1e-14, "orthogonal");
        assert_eq!(alignment.basis[(0, 0)], -1.0);
        assert_eq!((alignment.basis[(3, 3)], alignment.basis[(3, 4)]), (1.0, 0.0));
        assert!(alignment.agreement > 0.0);
    }
}

#[test]
fn without_the_groups_the_rotations_show() {
    let body = Body::cuboid(32, 8);
    let shapes = &body.shapes * disguise();
    let (a, b) = (condensed(&body, body.shapes.as_ref()), condensed(&body, shapes.as_ref()));
    let cross = body.shapes.transpose() * &shapes;
    let (_, differences) = compare_invariants(&a, &b, cross.as_ref(), &[]);
    let of = |name: &str| differences.iter().find(|(n, _)| n == name).expect("in the table").1;
    assert!(of("Ibar") > 1e-3 && of("S") > 1e-3 && of("C1") > 1e-4);
    assert_eq!((of("mass"), of("second_moment")), (0.0, 0.0));
}

#[test]
fn a_real_difference_survives_the_alignment() {
    let body = Body::cuboid(33, 8);
    let mut shapes = &body.shapes * disguise();
    shapes[(10, 5)] += 1e-6;
    let (a, b) = (condensed(&body, body.shapes.as_ref()), condensed(&body, shapes.as_ref()));
    let cross = body.shapes.transpose() * &shapes;
    let (_, differences) = compare_invariants(&a, &b, cross.as_ref(), &[1..3, 4..7]);
    let worst = differences.iter().fold(0.0f64, |m, (_, v)| m.max(*v));
    assert!(worst > 1e-9 && worst < 1e-5, "{worst:e}");
}

#[test]
fn agreement_is_the_cosine_between_subspaces() {
    // Orthonormal cross-Gram blocks: a plane tilted by 60 degrees has the singular values 1 and 1/2.
    let cross = Mat::from_fn(3, 3, |p, q| match (p, q) {
        (0, 0) => 1.0,
        (1, 1) => 0.5,
        (2, 2) => -0.9,
        _ => 0.0,
    });
    let alignment = align(cross.as_ref(), std::slice::from_ref(&(0..2)));
    assert!((alignment.agreement - 0.5).abs() < 1e-15);
    assert_eq!(alignment.basis[(2, 2)], -1.0);
}

#[test]
fn numbers_that_are_not_finite_are_reported() {
    let mut cross = random_matrix(&mut Random(1), 3, 3);
    cross[(1, 2)] = f64::NAN;
    assert!(align(cross.as_ref(), std::slice::from_ref(&(0..3))).agreement.is_nan());
    // Entries outside of every block have no effect.
    assert!(align(cross.as_ref(), &[]).agreement.is_finite());
    assert_eq!(align(Mat::<f64>::zeros(0, 0).as_ref(), &[]).basis.nrows(), 0);
}
