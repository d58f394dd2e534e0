//! Orders of convergence under refinement: frequencies, and errors of lumped masses.

use faer::{Mat, MatRef};
use flexbody_body::invariants::{
    BodyFrame, LumpedMasses, choose_frame, condense, condense_lumped, error_norms,
};
use flexbody_linalg::SymmetricMatrix;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Assembly, Mesh};
use oracle::pipeline::modes;
use std::f64::consts::PI;

const STEEL: Material = Material::STEEL;

/// Returns log2 of the ratio of successive errors: the order of convergence for a mesh width that is halved
/// each time.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).abs().log2()).collect()
}

/// Returns the relative error of the eigenvalue whose mode is closest to `field`.
fn error_of(body: &Assembly, field: impl Fn([f64; 3]) -> [f64; 3], exact: f64) -> f64 {
    let found = modes(body, 18);
    let field: Vec<f64> = body.nodes.iter().flat_map(|x| field(*x)).collect();
    let size = field.iter().map(|v| v * v).sum::<f64>().sqrt();
    let cosine = |j: usize| {
        let column = found.shapes().col(j);
        let dot: f64 = field.iter().enumerate().map(|(i, f)| column[i] * f).sum();
        dot.abs() / (column.norm_l2() * size)
    };
    let mode = (0..18).max_by(|&i, &j| cosine(i).total_cmp(&cosine(j))).expect("eighteen modes");
    assert!(cosine(mode) > 0.97, "no mode is the one looked for: {}", cosine(mode));
    found.eigenvalues()[mode] / exact - 1.0
}

/// Returns the error for the Lame equivoluminal mode of a square prism of side 1 and height 1/3 with cells of
/// side 1/n: u = (cos a sin b, -sin a cos b, 0), a = pi x, b = pi y. All faces are free of traction and the
/// volume does not change, so that lambda = 2 pi^2 mu / rho exactly, for any Poisson's ratio and height.
fn lame_error(kind: ElementKind, n: i32) -> f64 {
    let body = Mesh::block(kind, [n, n, n / 3], [1.0, 1.0, 1.0 / 3.0]).assemble(&STEEL, MassRule::Consistent);
    let (_, mu) = STEEL.lame();
    let field = |x: [f64; 3]| {
        let (a, b) = (PI * x[0], PI * x[1]);
        [a.cos() * b.sin(), -a.sin() * b.cos(), 0.0]
    };
    error_of(&body, field, 2.0 * PI * PI * mu / STEEL.density)
}

/// Returns the error for the first axial mode of a rod 1 x 1/8 x 1/8 without lateral contraction with cells
/// of side 1/n: lambda = pi^2 E / rho.
fn rod_error(kind: ElementKind, n: i32) -> f64 {
    let material = Material { poisson: 0.0, ..STEEL };
    let body =
        Mesh::block(kind, [n, n / 8, n / 8], [1.0, 0.125, 0.125]).assemble(&material, MassRule::Consistent);
    error_of(&body, |x| [(PI * x[0]).cos(), 0.0, 0.0], PI * PI * STEEL.youngs / STEEL.density)
}

#[test]
#[ignore = "slow"]
fn linear_hexahedra_converge_with_order_two() {
    let errors = [6, 12, 24].map(|n| lame_error(ElementKind::Hex8, n));
    assert!(errors[2] > 0.0 && errors[2] < 4e-3, "{errors:?}");
    let orders = orders(&errors);
    assert!((orders[1] - 2.0).abs() < 0.05 && orders[0] < orders[1], "{orders:?}");
}

#[test]
#[ignore = "slow"]
fn quadratic_hexahedra_converge_with_order_four() {
    let errors = [3, 6, 12].map(|n| lame_error(ElementKind::Hex20, n));
    let orders = orders(&errors);
    assert!(errors[2] > 0.0 && errors[2] < 2e-5, "{errors:?}");
    assert!((orders[1] - 4.0).abs() < 0.05, "{orders:?}");
}

#[test]
#[ignore = "slow"]
fn quadratic_tetrahedra_converge_with_order_four() {
    // The split of hexahedra into tetrahedra has no mirror symmetry: free faces add a term of order five, so
    // that the observed order approaches four linearly in the mesh width.
    for errors in [
        [8, 16, 32].map(|n| rod_error(ElementKind::Tet10, n)),
        [3, 6, 12].map(|n| lame_error(ElementKind::Tet10, n)),
    ] {
        let orders = orders(&errors);
        assert!(errors[2] > 0.0 && errors[2] < 1e-4, "{errors:?}");
        assert!(orders[1] > 3.65 && orders[1] < 4.0, "{orders:?}");
        assert!((2.0 * orders[1] - orders[0] - 4.0).abs() < 0.15, "{orders:?}");
    }
}

#[test]
fn refinement_lowers_every_frequency() {
    // The function spaces of nested meshes with exact mass are nested, so that Rayleigh quotients can only
    // fall.
    for kind in [ElementKind::Tet4, ElementKind::Hex8, ElementKind::Tet10] {
        let found: Vec<Vec<f64>> =
            [1, 2, 4].iter().map(|&s| modes(&block(kind, s), 12).eigenvalues().to_vec()).collect();
        for pair in found.windows(2) {
            for (j, (coarse, fine)) in pair[0].iter().zip(&pair[1]).enumerate() {
                assert!(fine < coarse, "{kind:?} mode {j}: {coarse} {fine}");
            }
        }
    }
}

/// Returns the relative Frobenius errors of I0 and W2 from row sums and from the scaled diagonal, for the
/// given shapes.
fn lumped_errors(body: &Assembly, shapes: MatRef<'_, f64>) -> [[f64; 2]; 2] {
    let mass = SymmetricMatrix::new(body.scalar_mass.clone()).expect("symmetric");
    let (frame, _) = choose_frame(&mass, &body.nodes, BodyFrame::Com).expect("a body with mass");
    let positions = frame.to_body(&body.nodes);
    let no_stiffness = || Mat::zeros(shapes.ncols(), shapes.ncols());
    let exact = condense(&mass, &positions, shapes, no_stiffness());
    let scaled = LumpedMasses::diagonal_scaling(&mass).expect("positive diagonal");
    [LumpedMasses::row_sum(&mass), scaled].map(|masses| {
        let lumped = condense_lumped(&masses, &positions, shapes, no_stiffness());
        let norms = error_norms(&exact, &lumped);
        let norm = |name: &str| norms.iter().find(|(n, _)| n == name).expect("a known norm").1;
        [norm("I0_frobenius"), norm("W2_frobenius")]
    })
}

const SIZE: [f64; 3] = [1.0, 0.62, 0.45];

fn block(kind: ElementKind, s: i32) -> Assembly {
    Mesh::block(kind, [2 * s, s, s], SIZE).assemble(&STEEL, MassRule::Consistent)
}

/// Returns three smooth fields, independent of the mesh, at the nodes.
fn smooth_shapes(nodes: &[[f64; 3]]) -> Mat<f64> {
    Mat::from_fn(3 * nodes.len(), 3, |row, j| {
        let ([x, y, z], k) = (nodes[row / 3], (row % 3) as f64);
        match j {
            0 => (3.0 * x + k).cos(),
            1 => (2.0 * x + 3.0 * y - z + 2.0 * k).cos(),
            _ => (2.0 * x - k).sin() * (1.0 + z * (y + k)),
        }
    })
}

#[test]
fn row_sums_of_linear_hexahedra_err_by_two_over_n_squared_in_every_second_moment() {
    // Trapezoidal rule: the sum of x^2 over n cells is (1 + 2 / n^2) times the integral.
    let cells = [5, 4, 3];
    let body = Mesh::block(ElementKind::Hex8, cells, SIZE).assemble(&STEEL, MassRule::Consistent);
    let mass = SymmetricMatrix::new(body.scalar_mass.clone()).expect("symmetric");
    let (frame, _) = choose_frame(&mass, &body.nodes, BodyFrame::Com).expect("a body with mass");
    let positions = frame.to_body(&body.nodes);
    let none = Mat::zeros(3 * positions.len(), 0);
    let lumped = condense_lumped(&LumpedMasses::row_sum(&mass), &positions, none.as_ref(), Mat::zeros(0, 0));
    let total = STEEL.density * SIZE.iter().product::<f64>();
    assert!((lumped.mass() / total - 1.0).abs() < 1e-13);
    for k in 0..3 {
        let exact = total * SIZE[k] * SIZE[k] / 12.0;
        let n = f64::from(cells[k]);
        let expected = 1.0 + 2.0 / (n * n);
        assert!((lumped.second_moment()[(k, k)] / exact / expected - 1.0).abs() < 1e-13);
    }
}

#[test]
fn lumping_errors_of_linear_hexahedra_have_order_two() {
    let errors = [2, 4, 8].map(|s| {
        let body = block(ElementKind::Hex8, s);
        lumped_errors(&body, modes(&body, 5).shapes().as_ref())
    });
    for scheme in 0..2 {
        for (norm, tolerance) in [(0, 1e-9), (1, 0.05)] {
            let orders = orders(&errors.map(|e| e[scheme][norm]));
            assert!((orders[1] - 2.0).abs() < tolerance, "scheme {scheme}, norm {norm}: {orders:?}");
        }
    }
}

#[test]
#[ignore = "slow"]
fn row_sum_errors_of_quadratic_tetrahedra_have_order_four() {
    let bodies = [4, 8].map(|s| block(ElementKind::Tet10, s));
    let smooth = bodies.each_ref().map(|body| lumped_errors(body, smooth_shapes(&body.nodes).as_ref()));
    // x x' is quadratic, and row sums of straight quadratic tetrahedra integrate quadratic functions exactly.
    assert!(smooth.iter().all(|e| e[0][0] < 1e-13), "{smooth:?}");
    let order =
        |errors: &[[[f64; 2]; 2]; 2], scheme: usize, norm: usize| orders(&errors.map(|e| e[scheme][norm]))[0];
    assert!((order(&smooth, 0, 1) - 4.0).abs() < 0.05, "{}", order(&smooth, 0, 1));
    // The scaled diagonal is less accurate although all its masses are positive.
    assert!((order(&smooth, 1, 0) - 2.0).abs() < 1e-9);
    assert!((order(&smooth, 1, 1) - 2.0).abs() < 0.05, "{}", order(&smooth, 1, 1));
    // Modes of the meshes include the discretisation error near free faces; the observed order is 3.65.
    let of_modes = bodies.each_ref().map(|body| lumped_errors(body, modes(body, 5).shapes().as_ref()));
    let observed = order(&of_modes, 0, 1);
    assert!(observed > 3.5 && observed < 4.1, "{observed}");
    assert!(
        of_modes[1][0][1] < 1e-4 && of_modes[1][1][1] > 5e-3,
        "row sums are far better here: {of_modes:?}"
    );
}
