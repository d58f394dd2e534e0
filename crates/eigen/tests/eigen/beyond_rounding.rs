//! Modes of a body whose K-residuals are limited by rounding: a free slender beam with so many elements that
//! K x in double precision loses most digits of the first modes.

use faer::Mat;
use flexbody_eigen::{
    Accuracy, EigenProblem, EigenSettings, EigenSolution, Method, Wanted, modes_of_span, solve,
};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, Pencil, SymmetricMatrix, gram, uniform};

/// Number of elements; a power of two, so that K and M are exact.
const ELEMENTS: usize = 2048;

/// Roots of cos(b) cosh(b) = 1 for the free beam.
const ROOTS: [f64; 4] =
    [4.730_040_744_862_704, 7.853_204_624_095_838, 10.995_607_838_001_67, 14.137_165_491_257_46];

/// Returns K and 420 M of cubic beam elements with EI, mass and length one; deflection and slope of each
/// node.
fn beam() -> [SymmetricMatrix; 2] {
    let h = (ELEMENTS as f64).recip();
    let stiffness =
        [[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]];
    let mass = [
        [156.0, 22.0, 54.0, -13.0],
        [22.0, 4.0, 13.0, -3.0],
        [54.0, 13.0, 156.0, -22.0],
        [-13.0, -3.0, -22.0, 4.0],
    ];
    let length = |i: usize| if i % 2 == 1 { h } else { 1.0 };
    let assembled = |of: [[f64; 4]; 4], factor: f64| {
        let mut triplets = Vec::new();
        for element in 0..ELEMENTS {
            for (i, row) in of.iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    let scale = factor * length(i) * length(j);
                    triplets.push(((2 * element + i) as u32, (2 * element + j) as u32, value * scale));
                }
            }
        }
        let n = 2 * (ELEMENTS + 1);
        SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &triplets)).expect("symmetric")
    };
    [assembled(stiffness, (h * h * h).recip()), assembled(mass, h)]
}

/// Returns translation and rotation of the beam, orthonormal in 420 M.
fn rigid() -> Mat<f64> {
    let h = (ELEMENTS as f64).recip();
    Mat::from_fn(2 * (ELEMENTS + 1), 2, |row, k| {
        let deflection = row % 2 == 0;
        let field = match (k, deflection) {
            (0, _) => f64::from(u8::from(deflection)),
            (_, true) => (row / 2) as f64 * h - 0.5,
            (_, false) => 1.0,
        };
        // The mass is one, the moment of inertia 1/12.
        field / if k == 0 { 420f64.sqrt() } else { 35f64.sqrt() }
    })
}

fn settings(accuracy: Accuracy) -> EigenSettings {
    EigenSettings {
        wanted: Wanted::Lowest(10),
        accuracy,
        method: Method::Lanczos,
        ..EigenSettings::default()
    }
}

/// Runs the test on modes whose K-residuals are rounding.
fn with_modes(test: impl FnOnce(&EigenProblem<'_>, EigenSolution)) {
    let ([stiffness, mass], rigid) = (beam(), rigid());
    let problem = EigenProblem {
        pencil: Pencil::new(&stiffness, &mass, 1),
        rigid: rigid.as_ref(),
        first_estimate: ROOTS[0].powi(4) / 420.0,
        input_error: 0.5 * f64::EPSILON,
        order: None,
    };
    let solution = solve(&problem, &settings(Accuracy::Standard), &Context::QUIET).expect("modes");
    assert!(solution.is_noisy(), "floors {:?}", solution.rounding_floors);
    test(&problem, solution);
}

#[test]
fn eigenvalues_keep_the_digits_that_products_in_double_precision_lose() {
    with_modes(|problem, solution| {
        let plain = problem.pencil.apply_stiffness(solution.vectors.as_ref());
        let mut lost = 0.0f64;
        for (j, root) in ROOTS.iter().enumerate() {
            // Error of cubic elements: (b h)^4 / 720.
            let expected = root.powi(4) / 420.0 * (1.0 + (root / ELEMENTS as f64).powi(4) / 720.0);
            let error = solution.eigenvalues[j] / expected - 1.0;
            assert!(error.abs() < 1e-11, "mode {j}: {error:e}");
            let energy = (solution.vectors.col(j).transpose() * plain.col(j)) / expected - 1.0;
            lost = lost.max(energy.abs());
        }
        assert!(lost > 1e-9, "{lost:e}: this body no longer shows what is tested");
    });
}

#[test]
fn modes_are_those_of_their_span_whatever_vectors_it_is_given_by() {
    with_modes(|problem, solution| {
        let (n, count) = (solution.vectors.nrows(), solution.vectors.ncols());
        let mixed = Mat::from_fn(count, count, |i, j| {
            uniform(1, i as u64, j as u64) + if i == j { 2.0 } else { 0.0 }
        });
        let span = &solution.vectors * mixed;
        let again =
            modes_of_span(problem, span, &settings(Accuracy::Fast), &Context::QUIET).expect("the same modes");
        for j in 0..count {
            let (one, other) = (solution.vectors.col(j), again.vectors.col(j));
            let sign = if one.transpose() * other < 0.0 { -1.0 } else { 1.0 };
            let difference = Mat::from_fn(n, 1, |i, _| one[i] - sign * other[i]);
            let mass = problem.pencil.apply_mass(difference.as_ref());
            let size = gram(difference.as_ref(), mass.as_ref())[(0, 0)].sqrt();
            assert!(size < 1e-11, "mode {j}: {size:e}");
            let relative = again.eigenvalues[j] / solution.eigenvalues[j] - 1.0;
            assert!(relative.abs() < 1e-13, "eigenvalue {j}: {relative:e}");
        }
    });
}
