//! Static and harmonic responses compared with the closed-form sum over all modes.

use super::grid::{Exact, Grid};
use faer::Mat;
use flexbody_eigen::{
    EigenFailure, Precision, ResponseAccuracy, dynamic_responses, static_responses, static_responses_twice,
};
use flexbody_linalg::context::{Context, WorkCounter};
use flexbody_linalg::uniform;

/// Returns loads without symmetry that are not in equilibrium.
fn loads(grid: &Grid) -> Mat<f64> {
    Mat::from_fn(grid.rows(), 3, |i, j| uniform(11, i as u64, j as u64) + if i == 5 * j { 4.0 } else { 0.0 })
}

/// Returns sum_j psi_j psi_j' f / (lambda_j - square) over the modes from number `first` on.
fn modal_sum(grid: &Grid, f: &Mat<f64>, first: usize, square: f64) -> Mat<f64> {
    let modes: Vec<Exact> = grid.exact().split_off(first);
    let shapes = grid.shapes(&modes);
    let parts = shapes.transpose() * f;
    let scaled =
        Mat::from_fn(parts.nrows(), parts.ncols(), |i, j| parts[(i, j)] / (modes[i].eigenvalue - square));
    shapes * scaled
}

#[test]
fn static_responses_are_the_sum_over_all_modes() {
    let grid = Grid::new([17, 12], 3.0, 0.5);
    let (problem, f) = (grid.problem(), loads(&grid));
    let exact = grid.exact();
    for known in [0, 6] {
        let modes = grid.shapes(&exact[..known]);
        for precision in [Precision::Double, Precision::Single] {
            let first = exact[0].eigenvalue;
            let x = static_responses(
                &problem,
                modes.as_ref(),
                f.clone(),
                first,
                precision,
                ResponseAccuracy::FULL,
                &Context::QUIET,
            );
            let x = x.expect("responses");
            let expected = modal_sum(&grid, &f, known, 0.0);
            let off = (&x - &expected).norm_max() / expected.norm_max();
            assert!(off < 1e-10, "{known} modes known, {precision:?}: off by {off:e}");
        }
    }
}

#[test]
fn further_responses_take_no_further_factor() {
    let grid = Grid::new([17, 12], 3.0, 0.5);
    let counter = WorkCounter::default();
    let context = Context::QUIET.with_counter(&counter);
    let first = grid.exact()[0].eigenvalue;
    let [x, y] = static_responses_twice(
        &grid.problem(),
        loads(&grid),
        Clone::clone,
        first,
        Precision::Double,
        ResponseAccuracy::FULL,
        &context,
    )
    .expect("responses");
    assert_eq!(counter.total().factorizations, 1);
    // The expected responses are K^+ K^+ f.
    let expected = modal_sum(&grid, &x, 0, 0.0);
    assert!((&y - &expected).norm_max() < 1e-9 * expected.norm_max());
}

#[test]
fn oscillating_responses_are_the_sum_over_all_modes() {
    let grid = Grid::new([14, 11], 3.0, 0.5);
    let (f, exact) = (loads(&grid), grid.exact());
    let none = Mat::zeros(grid.rows(), 0);
    // Squares of frequencies between two modes, below all modes and above many.
    for square in [
        0.3 * exact[0].eigenvalue,
        0.5 * (exact[4].eigenvalue + exact[5].eigenvalue),
        0.9 * exact[60].eigenvalue + 0.1 * exact[61].eigenvalue,
    ] {
        let x = dynamic_responses(&grid.problem(), none.as_ref(), f.clone(), square, &Context::QUIET)
            .expect("responses");
        let expected = modal_sum(&grid, &f, 0, square);
        let off = (&x - &expected).norm_max() / expected.norm_max();
        assert!(off < 1e-9, "{square}: off by {off:e}");
    }
    // At an eigenvalue the response is undefined.
    let at_mode = dynamic_responses(&grid.problem(), none.as_ref(), f, exact[3].eigenvalue, &Context::QUIET);
    assert!(matches!(at_mode, Err(EigenFailure::Inaccurate { .. })));
}
