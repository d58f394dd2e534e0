//! Quantities that do not change when the body is rotated, shifted, renumbered, reordered or measured in
//! other units.

use faer::Mat;
use flexbody_body::invariants::{BodyFrame, Invariants, compare_invariants};
use flexbody_eigen::Method;
use flexbody_linalg::CscMatrix;
use flexbody_model::RawModel;
use nalgebra::Matrix3;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{DofOrder, Numbering, reordered};
use oracle::mesh::{Assembly, Mesh, grid};
use oracle::pipeline::{Body, proved};
use oracle::random::Random;
use std::collections::HashMap;

const METHODS: [Method; 2] = [Method::Dense, Method::Lanczos];

/// Returns a bracket with a taper and unequal arms, without symmetry or repeated eigenvalues.
fn mesh() -> Mesh {
    let cells: Vec<_> = grid([6, 3, 5]).into_iter().filter(|c| c[0] < 2 || c[2] < 2).collect();
    Mesh::from_cells(ElementKind::Hex8, &cells, |[x, y, z]| {
        [0.125 * x, 0.125 * y * (1.0 + 0.0625 * x), 0.125 * z]
    })
}

fn assemble(mesh: &Mesh) -> Assembly {
    mesh.assemble(&Material::STEEL, MassRule::Consistent)
}

fn solved(raw: RawModel, method: Method) -> Body {
    proved(raw, 12, method)
}

/// Returns the largest relative difference of the eigenvalues of `b` from `scale` times those of `a`.
fn eigenvalue_difference(a: &Body, b: &Body, scale: f64) -> f64 {
    let pairs = a.eigenvalues().iter().zip(b.eigenvalues());
    pairs.map(|(a, b)| (b / (a * scale) - 1.0).abs()).fold(0.0, f64::max)
}

/// Returns the differences of the invariants about the centre of mass in model axes, relative to their
/// Cauchy-Schwarz bounds, if the nodes of `b` are those of `a` at x_b = R x_a + d. Signs of modes may differ.
fn moved_differences(a: &Body, b: &Body, turn: &Matrix3<f64>) -> Vec<(String, f64)> {
    let (condensed_a, condensed_b) = (a.condensed(BodyFrame::Com), b.condensed(BodyFrame::Com));
    let turned = condensed_a.invariants.rotated(&turn.transpose());
    let shapes_a = Mat::from_fn(condensed_a.shapes.nrows(), condensed_a.shapes.ncols(), |row, j| {
        (0..3).map(|k| turn[(row % 3, k)] * condensed_a.shapes[(row / 3 * 3 + k, j)]).sum()
    });
    differences(&turned, &condensed_b.invariants, a, &shapes_a, &condensed_b.shapes)
}

/// Returns the differences of the invariants of two sets of modes that are equal up to signs; `body` gives
/// the mass matrix.
fn differences(
    a: &Invariants,
    b: &Invariants,
    body: &Body,
    shapes_a: &Mat<f64>,
    shapes_b: &Mat<f64>,
) -> Vec<(String, f64)> {
    let mass = body.model.scalar_mass().expect("a solid");
    let weighted = Mat::from_fn(shapes_b.nrows(), shapes_b.ncols(), |row, j| {
        let (columns, values) = mass.row(row / 3);
        columns.iter().zip(values).map(|(&c, v)| v * shapes_b[(3 * c as usize + row % 3, j)]).sum::<f64>()
    });
    let cross = shapes_a.transpose() * weighted;
    let singles: Vec<_> = (0..cross.nrows()).map(|j| j..j + 1).collect();
    let (alignment, differences) = compare_invariants(a, b, cross.as_ref(), &singles);
    assert!((alignment.agreement - 1.0).abs() < 1e-6, "other modes: {}", alignment.agreement);
    differences
}

fn largest(differences: &[(String, f64)]) -> f64 {
    differences.iter().fold(0.0, |m, (_, d)| m.max(*d))
}

#[test]
fn turning_changes_nothing() {
    let mut random = Random(11);
    let turn = random.rotation();
    for method in METHODS {
        let a = solved(assemble(&mesh()).raw_model(), method);
        let b = solved(assemble(&mesh().moved(&turn, [0.0; 3])).raw_model(), method);
        assert!(eigenvalue_difference(&a, &b, 1.0) < 1e-12);
        let found = moved_differences(&a, &b, &turn);
        assert!(largest(&found) < 1e-12, "{found:?}");
        let moments = |body: &Body| body.condensed(BodyFrame::Principal).invariants.inertia().diagonal();
        assert!((moments(&a) - moments(&b)).norm() < 1e-13 * moments(&a).norm());
    }
}

#[test]
fn a_distant_origin_changes_nothing_where_coordinates_stay_exact() {
    // Multiples of 2^-7 m shifted by 2^20 m: every coordinate is exact, so that results differ by rounding
    // only.
    for method in METHODS {
        let mut raw = assemble(&mesh()).raw_model();
        let near = solved(raw.clone(), method);
        for x in &mut raw.nodes.positions {
            *x = [x[0] + 1048576.0, x[1] - 524288.0, x[2] + 262144.0];
        }
        let far = solved(raw, method);
        assert!(eigenvalue_difference(&near, &far, 1.0) < 1e-12);
        for (name, difference) in moved_differences(&near, &far, &Matrix3::identity()) {
            // The origin itself has a rounding of half the spacing of numbers at 2^20, 2^-33 m.
            let limit = if name == "first_moment" { 2e-9 } else { 1e-12 };
            assert!(difference < limit, "{name}: {difference:e}");
        }
    }
}

#[test]
fn a_body_assembled_a_million_lengths_away_keeps_the_digits_of_its_coordinates() {
    // Coordinates near 1e6 m have a rounding of 1e-10 m, and so has every element.
    let shift = [0.7e6, -0.5e6, 0.6e6];
    for method in METHODS {
        let near = solved(assemble(&mesh()).raw_model(), method);
        let far = solved(assemble(&mesh().moved(&Matrix3::identity(), shift)).raw_model(), method);
        assert!(eigenvalue_difference(&near, &far, 1.0) < 1e-8);
        let found = moved_differences(&near, &far, &Matrix3::identity());
        assert!(largest(&found) < 1e-8, "{found:?}");
    }
}

/// Returns the body in units of the size 1/length, 1/mass, 1/time.
fn in_units(raw: &RawModel, length: f64, mass: f64, time: f64) -> RawModel {
    let scaled = |m: &CscMatrix, factor: f64| {
        let values: Vec<f64> = m.values().iter().map(|v| v * factor).collect();
        CscMatrix::from_parts(m.n_rows(), m.n_cols(), m.col_ptr().to_vec(), m.row_idx().to_vec(), values)
    };
    let mut other = raw.clone();
    other.stiffness.matrix = scaled(&raw.stiffness.matrix, mass / (time * time));
    other.mass.matrix = scaled(&raw.mass.matrix, mass);
    for x in &mut other.nodes.positions {
        *x = x.map(|v| v * length);
    }
    other
}

/// Returns the invariants of the body in other units.
fn invariants_in_units(a: &Invariants, length: f64, mass: f64, time: f64) -> Invariants {
    let root = mass.sqrt();
    let mut b = a.clone();
    b.primary_mut().mass *= mass;
    b.primary_mut().first_moment *= mass * length;
    b.primary_mut().second_moment *= mass * length * length;
    b.primary_mut().c1 = a.c1() * faer::Scale(root);
    b.primary_mut().ibar.iter_mut().flatten().flatten().for_each(|v| *v *= root * length);
    b.primary_mut().modal_stiffness = a.modal_stiffness() * faer::Scale(time.powi(-2));
    b
}

#[test]
fn units_change_nothing_but_the_numbers() {
    // mm-t-s, micrometre-kg-s and micrometre-pg-us (MEMS), km-kt-ms, ft-slug-s, a resonator of 50 micrometres
    // in SI units, and powers of four: exact in binary, so that every bit must agree.
    for (length, mass, time) in [
        (1e3, 1e-3, 1.0),
        (1e6, 1.0, 1.0),
        (1e6, 1e15, 1e6),
        (1e-3, 1e-6, 1e3),
        (1.0 / 0.3048, 1.0 / 14.593902937206365, 1.0),
        (5e-5, 3e-13, 1e-4),
        (1024.0, 1.0 / 4096.0, 256.0),
    ] {
        for method in METHODS {
            let raw = assemble(&mesh()).raw_model();
            let a = solved(raw.clone(), method);
            let b = solved(in_units(&raw, length, mass, time), method);
            let (ca, cb) = (a.condensed(BodyFrame::Principal), b.condensed(BodyFrame::Principal));
            let expected = invariants_in_units(&ca.invariants, length, mass, time);
            // Mass-normalised shapes scale with 1 / sqrt(mass).
            let shapes = &ca.shapes * faer::Scale(mass.sqrt());
            let found = differences(&expected, &cb.invariants, &a, &shapes, &cb.shapes);
            let eigenvalues = eigenvalue_difference(&a, &b, time.powi(-2));
            let limit = if length == 1024.0 && method == Method::Lanczos { 0.0 } else { 1e-12 };
            assert!(largest(&found) <= limit && eigenvalues <= limit, "{length} {mass} {time}: {found:?}");
            let moved = (ca.frame.origin * length - cb.frame.origin).norm();
            assert!(moved <= limit * length, "{length} {mass} {time}: {moved:e}");
        }
    }
}

#[test]
fn order_of_rows_and_node_numbers_change_nothing() {
    let raw = assemble(&mesh()).raw_model();
    for method in METHODS {
        let a = solved(raw.clone(), method);
        let place: HashMap<[u64; 3], usize> =
            raw.nodes.positions.iter().enumerate().map(|(i, x)| (x.map(f64::to_bits), i)).collect();
        for (order, numbering, limit) in [
            // The internal order is that of the node table, so that the numbers are identical here.
            (DofOrder::NodeMajor, Numbering::Consecutive, 0.0),
            (DofOrder::ComponentMajor, Numbering::Consecutive, 0.0),
            (DofOrder::Shuffled(4), Numbering::Consecutive, 0.0),
            (DofOrder::NodeMajor, Numbering::Gaps(3), 1e-12),
            (DofOrder::Shuffled(5), Numbering::Gaps(6), 1e-12),
        ] {
            let b = solved(reordered(&raw, order, numbering), method);
            assert!(eigenvalue_difference(&a, &b, 1.0) <= limit, "{order:?} {numbering:?}");
            // Shapes of `b` in the node order of `a`.
            let home: Vec<usize> =
                b.model.nodes().positions.iter().map(|x| place[&x.map(f64::to_bits)]).collect();
            let mut row = vec![0; 3 * home.len()];
            for (i, node) in home.iter().enumerate() {
                (0..3).for_each(|k| row[3 * node + k] = 3 * i + k);
            }
            let (ca, cb) = (a.condensed(BodyFrame::Com), b.condensed(BodyFrame::Com));
            let shapes = Mat::from_fn(row.len(), ca.shapes.ncols(), |i, j| cb.shapes[(row[i], j)]);
            let found = differences(&ca.invariants, &cb.invariants, &a, &ca.shapes, &shapes);
            assert!(largest(&found) <= limit, "{order:?} {numbering:?}: {found:?}");
        }
    }
}
