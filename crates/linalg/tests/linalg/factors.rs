//! Factors of random sparse matrices compared with dense algebra: solutions, inertia, semidefiniteness, and
//! equal bits on any number of threads.

use faer::Mat;
use flexbody_linalg::{
    Analysis, Cholesky, CscMatrix, Indefinite, Inertia, Pencil, Solve, SparseLdl, SymmetricMatrix,
    connected_components, is_positive_semidefinite, symmetric_eigen, uniform,
};
use proptest::prelude::*;

/// Returns a symmetric matrix with about `degree` entries to the left of the diagonal in each row. The
/// diagonal exceeds the sum of the magnitudes of the other entries of its row by `excess`.
fn random_matrix(n: usize, degree: usize, excess: f64, seed: u64) -> SymmetricMatrix {
    let mut entries = Vec::new();
    let mut sums = vec![excess; n];
    for i in 1..n {
        for d in 0..degree {
            let at = 0.5 * (uniform(seed, i as u64, d as u64) + 1.0);
            let j = ((at * i as f64) as usize).min(i - 1);
            let value = uniform(seed + 1, i as u64, d as u64);
            entries.extend([(i as u32, j as u32, value), (j as u32, i as u32, value)]);
            sums[i] += value.abs();
            sums[j] += value.abs();
        }
    }
    entries.extend(sums.iter().enumerate().map(|(i, sum)| (i as u32, i as u32, *sum)));
    SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric")
}

fn dense(a: &SymmetricMatrix) -> Mat<f64> {
    let mut d = Mat::zeros(a.n(), a.n());
    for i in 0..a.n() {
        let (columns, values) = a.row(i);
        columns.iter().zip(values).for_each(|(&j, &v)| d[(i, j as usize)] = v);
    }
    d
}

fn columns(n: usize, count: usize) -> Mat<f64> {
    Mat::from_fn(n, count, |i, j| uniform(3, i as u64, j as u64))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn solutions_are_those_of_dense_algebra(n in 1usize..160, degree in 0usize..4, seed: u16, count in 1usize..12) {
        let (k, m) = (random_matrix(n, degree, 1e-3, seed.into()), random_matrix(n, degree, 0.5, 99));
        let pencil = Pencil::new(&k, &m, 1);
        let analysis = Analysis::new(&pencil).expect("small");
        let tau = 0.37;
        let a = dense(&k) + dense(&m) * faer::Scale(tau);
        let x = columns(n, count);
        let b = &a * &x;
        let size = a.norm_max() * n as f64;
        let double = Cholesky::<f64>::new(&analysis, &pencil, tau).expect("positive definite");
        let mut y = b.clone();
        double.solve_in_place(y.as_mut());
        // The diagonal exceeds the other entries by tau / 2, so that the norm of the inverse is at most 2 /
        // tau.
        prop_assert!((&y - &x).norm_max() < 1e-13 * size / tau);
        let single = Cholesky::<f32>::new(&analysis, &pencil, tau).expect("positive definite");
        let mut y = b.clone();
        single.solve_in_place(y.as_mut());
        prop_assert!((&y - &x).norm_max() < 1e-5 * size / tau);
    }

    /// By Sylvester's law the negative pivots of K - sigma M count the eigenvalues below sigma, those of K
    /// for M = 1.
    #[test]
    fn negative_pivots_are_the_eigenvalues_below_the_shift(n in 2usize..120, degree in 0usize..4, seed: u16, part in 0.0f64..1.0) {
        let k = random_matrix(n, degree, 0.0, seed.into());
        let identity: Vec<_> = (0..n as u32).map(|i| (i, i, 1.0)).collect();
        let m = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &identity)).expect("symmetric");
        let values = symmetric_eigen(dense(&k).as_ref()).expect("eigenvalues").values;
        let sigma = part * values[n - 1];
        prop_assume!(values.iter().all(|value| (value - sigma).abs() > 1e-9 * values[n - 1].max(1.0)));
        let below = values.iter().filter(|value| **value < sigma).count();
        let pencil = Pencil::new(&k, &m, 1);
        let analysis = Analysis::new(&pencil).expect("small");
        let inertia = Inertia::new(&analysis, &pencil, sigma);
        prop_assert_eq!((inertia.negative, inertia.zero), (below, 0));
        let factor = Indefinite::<f64>::new(&analysis, &pencil, sigma);
        prop_assert_eq!(factor.inertia().negative, below);
        let x = columns(n, 3);
        let a = dense(&k) - dense(&m) * faer::Scale(sigma);
        let mut y = &a * &x;
        factor.solve_in_place(y.as_mut());
        let nearest = values.iter().map(|value| (value - sigma).abs()).fold(f64::INFINITY, f64::min);
        prop_assert!((&y - &x).norm_max() < 1e-12 * n as f64 * values[n - 1].max(1.0) / nearest);
    }

    /// A factor row by row agrees, and names the rows without a pivot of a semidefinite matrix: one for each
    /// connected part if the rows sum to zero.
    #[test]
    fn a_semidefinite_matrix_has_a_null_row_for_each_part(n in 1usize..100, degree in 0usize..3, seed: u16) {
        let a = random_matrix(n, degree, 0.0, seed.into());
        // Entries are made negative: a graph Laplacian.
        let laplacian: Vec<_> = (0..n)
            .flat_map(|i| {
                let (columns, values) = a.row(i);
                columns.iter().zip(values).map(move |(&j, &v)| {
                    (i as u32, j, if j as usize == i { v.abs() } else { -v.abs() })
                }).collect::<Vec<_>>()
            })
            .collect();
        // Repeated entries at one place may partly cancel; the diagonal is their sum.
        let mut sums = vec![0.0; n];
        laplacian.iter().filter(|e| e.0 != e.1).for_each(|e| sums[e.0 as usize] -= e.2);
        let entries: Vec<_> = laplacian
            .into_iter()
            .filter(|e| e.0 != e.1)
            .chain(sums.iter().enumerate().map(|(i, sum)| (i as u32, i as u32, *sum)))
            .collect();
        let a = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric");
        let parts = connected_components(&[&a], 1).iter().copied().collect::<std::collections::BTreeSet<_>>().len();
        let factor = SparseLdl::new(&a, 1e-10).expect("semidefinite");
        prop_assert_eq!(factor.null_rows().len(), parts);
        let pencil = Pencil::new(&a, &a, 1);
        prop_assert!(is_positive_semidefinite(&pencil, &Analysis::new(&pencil).expect("small")));
    }
}

#[test]
fn what_is_no_mass_is_told_from_what_is() {
    let check = |entries: &[(u32, u32, f64)]| {
        let n = entries.iter().map(|e| e.0 + 1).max().expect("entries") as usize;
        let m = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, entries)).expect("symmetric");
        let pencil = Pencil::new(&m, &m, 1);
        is_positive_semidefinite(&pencil, &Analysis::new(&pencil).expect("small"))
    };
    assert!(check(&[(0, 0, 2.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 2.0)]), "a consistent bar");
    assert!(check(&[(0, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 1.0)]), "one null vector");
    assert!(check(&[(0, 0, 1.0), (2, 2, 1.0)]), "a row without mass");
    assert!(!check(&[(0, 0, 1.0), (0, 1, 1.1), (1, 0, 1.1), (1, 1, 1.0)]), "indefinite");
    assert!(!check(&[(0, 0, 1.0), (1, 1, -0.5)]), "a negative mass");
    assert!(!check(&[(0, 0, 1.0), (0, 1, 0.1), (1, 0, 0.1)]), "a row without mass that couples");
    assert!(!check(&[(0, 0, 1.0), (1, 1, -1.0), (0, 1, 2.0), (1, 0, 2.0)]), "both");
}

#[test]
fn factors_have_the_same_bits_on_any_number_of_threads() {
    let n = 3000;
    let (k, m) = (random_matrix(n, 3, 1e-3, 5), random_matrix(n, 3, 0.5, 6));
    let pencil = Pencil::new(&k, &m, 1);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let analysis = Analysis::new(&pencil).expect("small");
            let mut x = columns(n, 5);
            Cholesky::<f64>::new(&analysis, &pencil, 0.1)
                .expect("positive definite")
                .solve_in_place(x.as_mut());
            let factor = Indefinite::<f64>::new(&analysis, &pencil, 0.8);
            let mut y = columns(n, 5);
            factor.solve_in_place(y.as_mut());
            (x, y, factor.inertia().negative)
        })
    };
    let one = on(1);
    for threads in [2, 3] {
        let other = on(threads);
        assert!(one.0 == other.0 && one.1 == other.1 && one.2 == other.2, "{threads} threads");
    }
}
