//! Every eigenvalue lies between its bounds, by exact counts; the bounds are tight; the counts on both sides
//! are those of the rigid modes and of all modes.

use faer::Mat;
use flexbody_eigen::{
    Accuracy, EigenFailure, EigenProblem, EigenSettings, EigenSolution, EigenvalueBounds, Method, Wanted,
    solve,
};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, Pencil, SymmetricMatrix};
use oracle::exact::count_below;
use proptest::prelude::*;

/// Springs and masses on one line, with one rigid motion.
#[derive(Debug)]
struct Body {
    k: Vec<Vec<f64>>,
    m: Vec<Vec<f64>>,
}

impl Body {
    fn empty(n: usize) -> Self {
        Self { k: vec![vec![0.0; n]; n], m: vec![vec![0.0; n]; n] }
    }

    /// Adds a bar between two nodes: stiffness `k`, mass `m` consistent (off-diagonal 1/6) or lumped.
    fn add(&mut self, (i, j): (usize, usize), k: f64, m: f64, consistent: bool) {
        for (a, b, k, m) in [
            (i, i, k, if consistent { m / 3.0 } else { m / 2.0 }),
            (j, j, k, if consistent { m / 3.0 } else { m / 2.0 }),
            (i, j, -k, if consistent { m / 6.0 } else { 0.0 }),
            (j, i, -k, if consistent { m / 6.0 } else { 0.0 }),
        ] {
            self.k[a][b] += k;
            self.m[a][b] += m;
        }
    }

    fn solve(&self, wanted: Wanted, method: Method) -> Result<EigenSolution, EigenFailure> {
        self.solve_to(Accuracy::Certified, wanted, method)
    }

    fn solve_to(
        &self,
        accuracy: Accuracy,
        wanted: Wanted,
        method: Method,
    ) -> Result<EigenSolution, EigenFailure> {
        let n = self.k.len();
        let matrix = |a: &[Vec<f64>]| {
            let entries: Vec<(u32, u32, f64)> =
                (0..n).flat_map(|i| (0..n).map(move |j| (i as u32, j as u32, a[i][j]))).collect();
            SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric")
        };
        let (stiffness, mass) = (matrix(&self.k), matrix(&self.m));
        let total: f64 = self.m.iter().flatten().sum();
        let rigid = Mat::from_fn(n, 1, |_, _| total.sqrt().recip());
        // Rayleigh quotient of a ramp without its mean.
        let form = |a: &[Vec<f64>], x: &[f64], y: &[f64]| -> f64 {
            (0..n).map(|i| (0..n).map(|j| x[i] * a[i][j] * y[j]).sum::<f64>()).sum()
        };
        let ramp: Vec<f64> = (0..n).map(|i| i as f64).collect();
        let mean = form(&self.m, &ramp, &vec![1.0; n]) / total;
        let ramp: Vec<f64> = ramp.iter().map(|x| x - mean).collect();
        let problem = EigenProblem {
            pencil: Pencil::new(&stiffness, &mass, 1),
            rigid: rigid.as_ref(),
            first_estimate: form(&self.k, &ramp, &ramp) / form(&self.m, &ramp, &ramp),
            input_error: 0.0,
            order: None,
        };
        solve(
            &problem,
            &EigenSettings { wanted, accuracy, method, ..EigenSettings::default() },
            &Context::QUIET,
        )
    }

    /// Asserts every bound by exact counts; returns the largest relative width.
    fn assert_enclosed(&self, found: &EigenSolution) -> f64 {
        let EigenvalueBounds { lower, upper, shift_below, pivots_below, .. } =
            found.bounds.as_ref().expect("certified");
        assert_eq!((*pivots_below, count_below(&self.k, &self.m, *shift_below)), (1, 1));
        let completeness = &found.completeness;
        assert_eq!(
            completeness.negative_pivots,
            Some(count_below(&self.k, &self.m, completeness.shift)),
            "count above"
        );
        let mut widest = 0.0f64;
        for (j, &lambda) in found.eigenvalues.iter().enumerate() {
            assert!(lower[j] <= lambda && lambda <= upper[j], "{j}: {} {lambda} {}", lower[j], upper[j]);
            // Number of eigenvalues below the bounds, including the rigid one. `next_up` includes an
            // eigenvalue on the bound itself.
            let below = count_below(&self.k, &self.m, lower[j].next_down());
            let up_to = count_below(&self.k, &self.m, upper[j].next_up());
            assert!(
                below <= j + 1 && up_to >= j + 2,
                "{j}: {below} and {up_to} around [{}, {}]",
                lower[j],
                upper[j]
            );
            widest = widest.max((upper[j] - lower[j]) / lambda);
        }
        widest
    }
}

/// Returns n equal masses on n - 1 equal springs.
fn chain(n: usize) -> Body {
    let mut body = Body::empty(n);
    for i in 0..n - 1 {
        body.add((i, i + 1), 1.0, 0.0, false);
    }
    for i in 0..n {
        body.m[i][i] = 1.0;
    }
    body
}

#[test]
fn free_chains_have_the_eigenvalues_of_their_closed_form() {
    for n in [2, 3, 7, 18] {
        let found = chain(n).solve(Wanted::Lowest(n - 1), Method::Auto).expect("a sound body");
        let width = chain(n).assert_enclosed(&found);
        assert!(width < 2e-15, "{n} masses: {width:e}");
        for (j, lambda) in found.eigenvalues.iter().enumerate() {
            let angle = (j + 1) as f64 * std::f64::consts::PI / (2 * n) as f64;
            let exact = 4.0 * angle.sin().powi(2);
            assert!((lambda / exact - 1.0).abs() < 1e-15, "{n} masses, mode {j}: {lambda} {exact}");
        }
    }
}

#[test]
fn a_long_chain_keeps_its_digits_by_the_iterative_path() {
    // 700 masses exceed the dense path. lambda_1 / lambda_max = 5e-6, so that plain products would lose
    // digits down to ten.
    let n = 700;
    let found = chain(n).solve(Wanted::Lowest(6), Method::Lanczos).expect("a sound body");
    let bounds = found.bounds.as_ref().expect("certified");
    for j in 0..6 {
        let angle = (j + 1) as f64 * std::f64::consts::PI / (2 * n) as f64;
        let exact = 4.0 * angle.sin().powi(2);
        let rounding = 1e-15 * exact;
        assert!(bounds.lower[j] <= exact + rounding && exact - rounding <= bounds.upper[j], "{j}");
        assert!(
            (bounds.upper[j] - bounds.lower[j]) / exact < 1e-13,
            "{j}: {:e}",
            bounds.upper[j] - bounds.lower[j]
        );
    }
}

#[test]
fn repeated_eigenvalues_are_enclosed_as_a_block() {
    // Five equal arms of two bars at one hub: every antisymmetric pair of arms vibrates alike, four times
    // each.
    let mut body = Body::empty(11);
    for arm in 0..5 {
        body.add((0, 1 + 2 * arm), 3.0, 0.75, true);
        body.add((1 + 2 * arm, 2 + 2 * arm), 1.5, 0.3, true);
    }
    let found = body.solve(Wanted::Lowest(10), Method::Auto).expect("a sound body");
    let bounds = found.bounds.as_ref().expect("certified");
    let fourfold = (0..7).filter(|j| (bounds.upper[j + 3] / bounds.lower[*j] - 1.0).abs() < 1e-12).count();
    assert_eq!(fourfold, 2, "{:?}", found.eigenvalues);
    for j in 0..10 {
        assert!((bounds.upper[j] - bounds.lower[j]) / bounds.upper[j] < 1e-13);
        // Sturm counts of the exact matrix, whose eigenvalues repeat exactly or are split by rounding of the
        // entries.
        assert!(count_below(&body.k, &body.m, bounds.lower[j].next_down()) <= j + 1);
        assert!(count_below(&body.k, &body.m, bounds.upper[j].next_up()) >= j + 2);
    }
}

#[test]
fn modes_beyond_a_cut_do_not_disturb_the_bounds_below_it() {
    let body = chain(12);
    let cut = 4.0 * (5.5 * std::f64::consts::PI / 24.0).sin().powi(2);
    let found = body.solve(Wanted::Below(cut), Method::Auto).expect("a sound body");
    assert_eq!(found.eigenvalues.len(), 5);
    assert!(body.assert_enclosed(&found) < 1e-14);
}

#[test]
fn other_levels_promise_no_bounds() {
    for accuracy in [Accuracy::Fast, Accuracy::Standard] {
        let found = chain(5).solve_to(accuracy, Wanted::Lowest(4), Method::Auto).expect("a sound body");
        assert_eq!(found.bounds, None);
    }
}

#[test]
fn modes_are_as_near_to_exact_ones_as_they_are_said_to_be() {
    // Exact modes of the chain: cos(j pi (i + 1/2) / n).
    let n = 40;
    for method in [Method::Dense, Method::Lanczos] {
        let found = chain(n).solve(Wanted::Lowest(8), method).expect("a sound body");
        for (j, error) in found.bounds.expect("certified").shape_error.into_iter().enumerate() {
            let exact: Vec<f64> = (0..n)
                .map(|i| ((j + 1) as f64 * std::f64::consts::PI * (i as f64 + 0.5) / n as f64).cos())
                .map(|c| c * (2.0 / n as f64).sqrt())
                .collect();
            let along: f64 = exact.iter().enumerate().map(|(i, x)| x * found.vectors[(i, j)]).sum();
            let off: f64 = (0..n).map(|i| (found.vectors[(i, j)] - along * exact[i]).powi(2)).sum();
            // The cosines themselves are accurate to 1e-15.
            assert!(off.sqrt() <= error + 2e-15, "{method:?}, mode {j}: {:e}, bound {error:e}", off.sqrt());
            assert!(error < 1e-11, "{method:?}, mode {j}: {error:e}");
        }
    }
}

/// Stiffness and mass over five decades, additional bars, some nodes without mass.
fn bodies() -> impl Strategy<Value = Body> {
    let bar = (-2.5..2.5f64, -2.5..2.5f64, any::<bool>());
    (4usize..12).prop_flat_map(move |n| {
        let bars = prop::collection::vec(bar.clone(), n - 1);
        let extra = prop::collection::vec((0..n, 0..n, -3.0..1.0f64), 0..4);
        let massless = prop::collection::vec(prop::bool::weighted(0.15), n - 1);
        (bars, extra, massless).prop_map(move |(bars, extra, massless)| {
            let mut body = Body::empty(n);
            for (i, (k, m, consistent)) in bars.into_iter().enumerate() {
                body.add((i, i + 1), 10f64.powf(k), 10f64.powf(m), consistent && !massless[i]);
            }
            for (i, j, k) in extra.into_iter().filter(|(i, j, _)| i != j) {
                body.add((i, j), 10f64.powf(k), 0.0, false);
            }
            // A lumped node can lose its mass, which gives an infinite eigenvalue.
            for i in 1..n - 1 {
                if massless[i - 1] && massless[i] {
                    body.m[i][i] = 0.0;
                }
            }
            body
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, max_global_rejects: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = "slow"]
    fn random_bodies_are_enclosed(body in bodies(), wanted in 1usize..12, lanczos in any::<bool>()) {
        let method = if lanczos { Method::Lanczos } else { Method::Dense };
        let found = body.solve(Wanted::Lowest(wanted), method);
        // The highest modes for extreme contrasts may not reach the residual of 1e-12; few of the bodies are
        // affected.
        prop_assume!(!matches!(found, Err(EigenFailure::NotConverged { .. })));
        let found = found.expect("a sound body");
        let width = body.assert_enclosed(&found);
        prop_assert!(width < 1e-12, "{width:e}");
    }
}
