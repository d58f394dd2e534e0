//! Pencils without trustworthy modes are refused with the reason, by every method.

use super::grid::{Grid, entries, matrix};
use faer::Mat;
use flexbody_eigen::{
    EigenFailure, EigenProblem, EigenSettings, FactorChoice, Method, Precision, Wanted, solve,
    unresisted_motions,
};
use flexbody_linalg::Pencil;
use flexbody_linalg::context::Context;

/// Returns the failure of each method for changed matrices of a grid.
fn failures(change: impl Fn(&mut Vec<(u32, u32, f64)>, &mut Vec<(u32, u32, f64)>)) -> [EigenFailure; 2] {
    let grid = Grid::new([26, 25], 1.0, 1.0);
    let (mut k, mut m) = (entries(&grid.stiffness), entries(&grid.mass));
    change(&mut k, &mut m);
    let [k, m] = [k, m].map(|entries| matrix(grid.rows(), &entries));
    let problem = EigenProblem { pencil: Pencil::new(&k, &m, 1), ..grid.problem() };
    [Method::Dense, Method::Lanczos].map(|method| {
        let settings = EigenSettings { wanted: Wanted::Lowest(6), method, ..EigenSettings::default() };
        solve(&problem, &settings, &Context::QUIET)
            .map(|found| found.eigenvalues)
            .expect_err("no modes to be trusted")
    })
}

#[test]
fn a_grid_in_two_parts_has_a_motion_without_strain_energy() {
    // All springs between the 13th and the 14th line of nodes are removed.
    let cut = |i: u32, j: u32| (i / 26 == 12) != (j / 26 == 12) && (i / 26).max(j / 26) == 13;
    let found = failures(|k, _| {
        let lost: Vec<(u32, f64)> = k.iter().filter(|e| cut(e.0, e.1)).map(|e| (e.0, e.2)).collect();
        k.retain(|e| !cut(e.0, e.1));
        k.extend(lost.into_iter().map(|(i, v)| (i, i, v)));
    });
    for failure in found {
        assert!(matches!(failure, EigenFailure::ZeroEnergy { count: 1, .. }), "{failure}");
    }
}

#[test]
fn a_negative_spring_is_found() {
    for failure in failures(|k, _| k.push((40, 40, -3.0))) {
        let is_told = matches!(
            failure,
            EigenFailure::NegativeEigenvalue { .. } | EigenFailure::NotPositiveDefinite { .. }
        );
        assert!(is_told, "{failure}");
    }
}

#[test]
fn a_negative_mass_is_found() {
    for failure in failures(|_, m| m.push((7, 7, -1.5))) {
        assert!(matches!(failure, EigenFailure::MassIndefinite), "{failure}");
    }
}

#[test]
fn a_spring_without_mass_that_hangs_on_nothing_is_found() {
    let grid = Grid::new([9, 7], 1.0, 1.0);
    let n = grid.rows() + 2;
    let (a, b) = (n as u32 - 2, n as u32 - 1);
    let spring = [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)];
    let k = matrix(n, &[entries(&grid.stiffness), spring.to_vec()].concat());
    let m = matrix(n, &entries(&grid.mass));
    let rigid = Mat::from_fn(n, 1, |i, _| if i + 2 < n { grid.rigid[(0, 0)] } else { 0.0 });
    let problem = EigenProblem { pencil: Pencil::new(&k, &m, 1), rigid: rigid.as_ref(), ..grid.problem() };
    let settings =
        EigenSettings { wanted: Wanted::Lowest(3), method: Method::Lanczos, ..EigenSettings::default() };
    let failure = solve(&problem, &settings, &Context::QUIET).expect_err("a singular factor");
    assert!(matches!(failure, EigenFailure::NotPositiveDefinite { .. }), "{failure}");
    let found = unresisted_motions(&problem.pencil, 1.0, 0.0).expect("the row");
    assert_eq!(found.count, 1);
    let ends = [n - 2, n - 1].map(|row| found.vectors[(row, 0)]);
    assert!((ends[0] - ends[1]).abs() < 1e-9 && (ends[0].abs() - 1.0).abs() < 1e-9, "{ends:?}");
}

#[test]
fn limits_are_kept_before_any_work() {
    let grid = Grid::new([40, 40], 1.0, 1.0);
    let settings =
        EigenSettings { wanted: Wanted::Lowest(6), method: Method::Lanczos, ..EigenSettings::default() };
    let within = |context: Context<'_>| solve(&grid.problem(), &settings, &context);
    let little = within(Context { memory: Some(1_000_000), ..Context::QUIET }).expect_err("a megabyte");
    assert!(
        matches!(little, EigenFailure::Memory { available: 1_000_000, bytes } if bytes > 1_000_000),
        "{little}"
    );
    let hasty = within(Context { longest: Some(1e-9), ..Context::QUIET }).expect_err("no time");
    assert!(matches!(hasty, EigenFailure::TooLong { wanted: 6, .. }), "{hasty}");
}

/// A contrast of 10^9 in the springs exceeds a factor in single precision: if single precision is forced, the
/// failure names it; otherwise double precision follows.
#[test]
fn single_precision_that_fails_is_blamed_or_followed_by_double() {
    let grid = Grid::new([26, 25], 1.0, 1.0);
    let stiff = |i: u32| (i % 26) < 13;
    let scaled = entries(&grid.stiffness).into_iter().filter(|e| e.0 != e.1).flat_map(|(i, j, v)| {
        let v = if stiff(i) && stiff(j) { 1e9 * v } else { v };
        [(i, j, v), (i, i, -v)]
    });
    let k = matrix(grid.rows(), &scaled.collect::<Vec<_>>());
    let problem = EigenProblem { pencil: Pencil::new(&k, &grid.mass, 1), ..grid.problem() };
    let with = |factor, single_pays| {
        let settings = EigenSettings {
            wanted: Wanted::Lowest(6),
            method: Method::Lanczos,
            factor,
            single_pays,
            ..EigenSettings::default()
        };
        solve(&problem, &settings, &Context::QUIET)
    };
    let forced = with(FactorChoice::Always(Precision::Single), f64::INFINITY).expect_err("too poor");
    assert!(matches!(forced, EigenFailure::SinglePrecision(_)), "{forced}");
    let double = with(FactorChoice::Always(Precision::Double), f64::INFINITY).expect("modes");
    let open = with(FactorChoice::Auto, 0.0).expect("modes");
    assert!(open.plan.as_ref().expect("no dense path").has_failed(flexbody_eigen::Way::SinglePrecision));
    assert_eq!(open.eigenvalues, double.eigenvalues, "the same search");
}
