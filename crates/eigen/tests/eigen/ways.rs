//! Every method for modes agrees with the closed form, in any units and any order of rows.

use super::grid::{Grid, entries, matrix};
use faer::Mat;
use flexbody_eigen::{
    Accuracy, EigenProblem, EigenSettings, FactorChoice, Method, Precision, Proof, Wanted, Way, solve,
};
use flexbody_linalg::Pencil;
use flexbody_linalg::context::Context;

fn settings(count: usize, method: Method, factor: FactorChoice) -> EigenSettings {
    EigenSettings { wanted: Wanted::Lowest(count), method, factor, ..EigenSettings::default() }
}

#[test]
fn every_way_finds_the_modes_of_a_grid() {
    let grid = Grid::new([45, 37], 1.0, 1.0);
    let single = FactorChoice::Always(Precision::Single);
    for (count, method, factor, way) in [
        (20, Method::Dense, FactorChoice::Auto, None),
        (20, Method::Lanczos, FactorChoice::Auto, Some(Way::DoublePrecision)),
        (20, Method::Lanczos, single, Some(Way::SinglePrecision)),
        (80, Method::Lanczos, FactorChoice::Auto, Some(Way::SecondShift)),
    ] {
        let found = grid.solve(&settings(count, method, factor)).expect("modes");
        let what = format!("{way:?}");
        assert_eq!(found.plan.as_ref().map(|plan| plan.current().way), way);
        assert_eq!(found.eigenvalues.len(), count);
        grid.assert_exact(&found, 1e-9, &what);
        assert_eq!(found.completeness.proof, Proof::InertiaCount, "{what}");
        assert_eq!(found.completeness.negative_pivots, Some(found.completeness.modes_below + 1), "{what}");
        for (residual, floor) in found.residuals.iter().zip(&found.rounding_floors) {
            assert!(*residual <= floor.max(1e-9), "{what}: {residual:e}, floor {floor:e}");
        }
    }
}

/// A square grid has pairs of equal eigenvalues. Whatever the number of requested modes, pairs are complete
/// and equal in all methods.
#[test]
fn repeated_eigenvalues_are_found_together() {
    let grid = Grid::new([30, 30], 1.0, 1.0);
    for count in [1, 2, 4, 7, 12] {
        let [dense, lanczos] = [Method::Dense, Method::Lanczos]
            .map(|method| grid.solve(&settings(count, method, FactorChoice::Auto)).expect("modes"));
        grid.assert_exact(&lanczos, 1e-9, &format!("{count} modes"));
        let off = (&dense.vectors - &lanczos.vectors).norm_max();
        assert!(off < 1e-7, "{count} modes: the canonical bases differ by {off:e}");
    }
}

#[test]
fn units_scale_the_eigenvalues_and_the_shapes() {
    let plain = Grid::new([40, 23], 1.0, 1.0);
    let one = plain.solve(&settings(12, Method::Lanczos, FactorChoice::Auto)).expect("modes");
    for (spring, mass) in [(2.1e11, 7.85e3), (1e-12, 1e6), (3e5, 2e-9)] {
        let scaled = Grid::new([40, 23], spring, mass);
        let other = scaled.solve(&settings(12, Method::Lanczos, FactorChoice::Auto)).expect("modes");
        for (a, b) in one.eigenvalues.iter().zip(&other.eigenvalues) {
            assert!((a * spring / mass / b - 1.0).abs() < 1e-11, "{spring:e} {mass:e}: {a} {b}");
        }
        let off = (&one.vectors - &other.vectors * faer::Scale(mass.sqrt())).norm_max();
        assert!(off < 1e-8, "{spring:e} {mass:e}: shapes off by {off:e}");
    }
}

#[test]
fn the_order_of_the_rows_changes_nothing_but_their_places() {
    let grid = Grid::new([31, 17], 1.0, 1.0);
    let n = grid.rows();
    // A fixed permutation: 100 has no common factor with the 527 rows.
    let place = |row: usize| (100 * row + 7) % n;
    let moved = |(i, j, v): (u32, u32, f64)| (place(i as usize) as u32, place(j as usize) as u32, v);
    let [stiffness, mass] = [&grid.stiffness, &grid.mass]
        .map(|a| matrix(n, &entries(a).into_iter().map(moved).collect::<Vec<_>>()));
    let rigid = grid.rigid.clone();
    let problem =
        EigenProblem { pencil: Pencil::new(&stiffness, &mass, 1), rigid: rigid.as_ref(), ..grid.problem() };
    let settings = settings(10, Method::Lanczos, FactorChoice::Auto);
    let (one, other) =
        (grid.solve(&settings).expect("modes"), solve(&problem, &settings, &Context::QUIET).expect("modes"));
    for (a, b) in one.eigenvalues.iter().zip(&other.eigenvalues) {
        assert!((a / b - 1.0).abs() < 1e-11, "{a} {b}");
    }
    let moved = Mat::from_fn(n, 10, |i, j| other.vectors[(place(i), j)]);
    for j in 0..10 {
        // The entry that determines the sign among equal ones depends on the order.
        let along: f64 = (0..n).map(|i| one.vectors[(i, j)] * moved[(i, j)]).sum();
        assert!((along.abs() - 1.0).abs() < 1e-9, "mode {j}: {along}");
    }
}

#[test]
fn accuracy_decides_what_is_promised() {
    let grid = Grid::new([29, 23], 1.0, 1.0);
    let with = |accuracy| EigenSettings { accuracy, ..settings(8, Method::Lanczos, FactorChoice::Auto) };
    let fast = grid.solve(&with(Accuracy::Fast)).expect("modes");
    assert_eq!((fast.completeness.proof, fast.bounds.is_none()), (Proof::NotProved, true));
    grid.assert_exact(&fast, 1e-9, "fast");
    let certified = grid.solve(&with(Accuracy::Certified)).expect("modes");
    let bounds = certified.bounds.as_ref().expect("certified");
    for (j, exact) in grid.exact().iter().take(8).enumerate() {
        // The closed form has rounding too.
        let room = 4.0 * f64::EPSILON * exact.eigenvalue;
        assert!(
            bounds.lower[j] - room <= exact.eigenvalue && exact.eigenvalue <= bounds.upper[j] + room,
            "mode {j}"
        );
        assert!(bounds.upper[j] / bounds.lower[j] - 1.0 < 1e-10, "mode {j}");
    }
}
