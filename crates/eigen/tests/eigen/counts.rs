//! Counts of eigenvalues, and modes of a given span, compared with the closed form.

use super::grid::Grid;
use faer::Mat;
use flexbody_eigen::{Accuracy, EigenFailure, EigenSettings, Method, Proof, Wanted, modes_of_span};
use flexbody_linalg::context::Context;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// The number of modes below a bound agrees with the closed form for any grid and bound.
    #[test]
    fn all_modes_below_a_bound_are_found(n in 3usize..40, m in 1usize..30, part in 0.0f64..0.2, lanczos: bool) {
        let grid = Grid::new([n, m], 1.0, 1.0);
        let exact = grid.exact();
        let bound = part * exact.last().expect("two nodes at least").eigenvalue;
        // An eigenvalue on the bound may count on either side.
        prop_assume!(exact.iter().all(|mode| (mode.eigenvalue - bound).abs() > 1e-9));
        let method = if lanczos { Method::Lanczos } else { Method::Dense };
        let settings = EigenSettings { wanted: Wanted::Below(bound), method, ..EigenSettings::default() };
        let expected = exact.iter().filter(|mode| mode.eigenvalue < bound).count();
        let found = grid.solve(&settings).expect("modes");
        prop_assert_eq!(found.eigenvalues.len(), expected);
        prop_assert_eq!(found.completeness.negative_pivots, Some(expected + 1));
        grid.assert_exact(&found, 1e-9, "below a bound");
    }
}

#[test]
fn exact_modes_of_a_span_are_proved_and_a_missing_one_is_seen() {
    let grid = Grid::new([23, 16], 1.0, 1.0);
    let exact = grid.exact();
    let settings = EigenSettings { wanted: Wanted::Lowest(usize::MAX), ..EigenSettings::default() };
    let of = |modes: &[_]| modes_of_span(&grid.problem(), grid.shapes(modes), &settings, &Context::QUIET);
    let all = of(&exact[..9]).expect("modes");
    assert_eq!((all.completeness.proof, all.completeness.negative_pivots), (Proof::InertiaCount, Some(10)));
    grid.assert_exact(&all, 1e-9, "all");
    let without = of(&[&exact[..4], &exact[5..9]].concat()).expect("modes");
    assert_eq!(without.completeness.proof, Proof::NotProved);
    let remark = &without.completeness.remark;
    assert!(
        remark.contains("the body has 9 flexible modes") && remark.contains("the given subspace has 8"),
        "{remark}"
    );
}

#[test]
fn vectors_that_are_no_modes_are_ritz_vectors_and_not_proved() {
    let grid = Grid::new([23, 16], 1.0, 1.0);
    let polynomials = Mat::from_fn(grid.rows(), 3, |row, j| {
        let (x, y) = ((row % 23) as f64 / 22.0, (row / 23) as f64 / 15.0);
        [x, y, x * y][j]
    });
    let settings = EigenSettings { wanted: Wanted::Lowest(usize::MAX), ..EigenSettings::default() };
    let found =
        modes_of_span(&grid.problem(), polynomials.clone(), &settings, &Context::QUIET).expect("vectors");
    assert_eq!(found.completeness.proof, Proof::NotProved);
    // Rayleigh-Ritz: no value is below the eigenvalue with its number.
    for (value, exact) in found.eigenvalues.iter().zip(grid.exact()) {
        assert!(*value > exact.eigenvalue, "{value} {exact:?}");
    }
    let certified = EigenSettings { accuracy: Accuracy::Certified, ..settings };
    let refused =
        modes_of_span(&grid.problem(), polynomials, &certified, &Context::QUIET).expect_err("no modes");
    assert!(matches!(refused, EigenFailure::NotCertified { .. }), "{refused}");
}
