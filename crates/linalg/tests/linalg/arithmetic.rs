//! Double-double kernels compared with rational arithmetic: their errors are within the documented limits.
#![allow(clippy::needless_range_loop)] // eliminations read best with their indices

use faer::Mat;
use flexbody_linalg::{
    CscMatrix, DoubleDouble, SmallEigen, SymmetricMatrix, gram_compensated, multiply_compensated,
    small_pencil, sum_length,
};
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive, Zero};
use oracle::exact::exact;
use oracle::random::Random;

/// Square of the unit roundoff u.
const U2: f64 = f64::EPSILON * f64::EPSILON / 4.0;

fn value(x: DoubleDouble) -> BigRational {
    exact(x.hi) + exact(x.lo)
}

/// Returns |found - truth| / |truth|.
fn error(found: DoubleDouble, truth: &BigRational) -> f64 {
    ((value(found) - truth) / truth).abs().to_f64().expect("a number")
}

/// Returns a number over thirty decades of either sign, with a full second part.
fn number(r: &mut Random) -> DoubleDouble {
    let hi = r.signed() * 10f64.powf(15.0 * r.signed());
    DoubleDouble::sum(hi, hi * f64::EPSILON * 0.25 * r.signed())
}

#[test]
fn every_operation_keeps_its_bound() {
    let mut r = Random(1);
    for _ in 0..2000 {
        let (a, b) = (number(&mut r), number(&mut r));
        let (x, y) = (value(a), value(b));
        assert!(error(a + b, &(&x + &y)) <= 3.1 * U2, "{a:?} + {b:?}");
        // For nearly equal numbers the difference keeps its relative accuracy.
        let near = DoubleDouble::sum(a.hi, -a.lo);
        assert!(error(a - near, &(&x - value(near))) <= 3.1 * U2, "{a:?} - {near:?}");
        assert!(error(a * b, &(&x * &y)) <= 4.1 * U2, "{a:?} * {b:?}");
        assert!(error(a * b.hi, &(&x * exact(b.hi))) <= 2.1 * U2, "{a:?} * {}", b.hi);
        assert!(error(a / b, &(&x / &y)) <= 15.1 * U2, "{a:?} / {b:?}");
        assert_eq!(value(DoubleDouble::product(a.hi, b.hi)), exact(a.hi) * exact(b.hi));
        let square = a * a;
        let root = value(square.sqrt());
        let defect = ((&root * &root - value(square)) / value(square)).abs().to_f64().expect("a number");
        assert!(defect <= 8.0 * U2, "sqrt of {square:?}: {defect:e}");
        assert!(exact(a.below()) < x && x < exact(a.above()), "{a:?}");
    }
    assert_eq!(DoubleDouble::default().sqrt(), DoubleDouble::default());
}

#[test]
fn products_keep_their_bounds_where_terms_cancel() {
    let mut r = Random(2);
    let n = 60;
    let mut entries = Vec::new();
    for i in 0..n {
        for j in 0..=i {
            let v = r.signed() * 10f64.powf(8.0 * r.signed());
            entries.push((i as u32, j as u32, v));
            if i != j {
                entries.push((j as u32, i as u32, v));
            }
        }
    }
    let a = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric");
    // Two components per row of A, three columns.
    let x = Mat::from_fn(2 * n, 3, |_, _| r.signed() * 10f64.powf(8.0 * r.signed()));
    let y = multiply_compensated(&a, 2, x.as_ref());
    let left = Mat::from_fn(2 * n, 2, |_, _| r.signed());
    let gram = gram_compensated(left.as_ref(), &y);
    for c in 0..3 {
        for row in 0..2 * n {
            let (columns, values) = a.row(row / 2);
            let (mut sum, mut size) = (BigRational::zero(), 0.0);
            for (&j, &v) in columns.iter().zip(values) {
                let other = x[(2 * j as usize + row % 2, c)];
                sum += exact(v) * exact(other);
                size += (v * other).abs();
            }
            let off = (value(y.get(row, c)) - sum).abs().to_f64().expect("a number");
            assert!(off <= 4.0 * U2 * (columns.len() + 1) as f64 * size, "row {row}: {off:e} of {size:e}");
        }
        for (i, gram) in gram.iter().enumerate() {
            let (mut sum, mut size) = (BigRational::zero(), 0.0);
            for row in 0..2 * n {
                let term = exact(left[(row, i)]) * value(y.get(row, c));
                size += term.abs().to_f64().expect("a number");
                sum += term;
            }
            let off = (value(gram[c]) - sum).abs().to_f64().expect("a number");
            assert!(off <= 4.0 * U2 * sum_length(2 * n) * size, "{i}, {c}: {off:e} of {size:e}");
        }
    }
}

#[test]
fn small_pencils_have_the_eigenvalues_of_their_characteristic_polynomial() {
    // P = D (I + small) D with decades in D, Q = I + small: det(P - kappa Q) changes sign around every kappa.
    let mut r = Random(3);
    let n = 6;
    let mut near_identity = |size: f64| {
        let mut a = vec![vec![DoubleDouble::default(); n]; n];
        for i in 0..n {
            for j in 0..i {
                let v = DoubleDouble::sum(size * r.signed(), size * 1e-17 * r.signed());
                (a[i][j], a[j][i]) = (v, v);
            }
            a[i][i] = DoubleDouble::from(1.0);
        }
        a
    };
    let (mut p, q) = (near_identity(1e-3), near_identity(1e-2));
    for (i, row) in p.iter_mut().enumerate() {
        for (j, value) in row.iter_mut().enumerate() {
            *value = *value * 10f64.powi(2 * i as i32 + 2 * j as i32);
        }
    }
    let SmallEigen { values: kappa, vectors } = small_pencil(p.clone(), &q).expect("positive definite");
    let determinant = |kappa: &BigRational| {
        let mut a: Vec<Vec<BigRational>> =
            (0..n).map(|i| (0..n).map(|j| value(p[i][j]) - kappa * value(q[i][j])).collect()).collect();
        let mut product = BigRational::from_integer(1.into());
        for c in 0..n {
            product *= a[c][c].clone();
            for i in c + 1..n {
                let factor = &a[i][c] / &a[c][c];
                for j in c..n {
                    let change = &factor * &a[c][j];
                    a[i][j] -= change;
                }
            }
        }
        product
    };
    for (i, kappa) in kappa.iter().enumerate() {
        let around = |sign: f64| value(*kappa) * (exact(1.0) + exact(sign * 1e-29));
        assert!((determinant(&around(-1.0)) * determinant(&around(1.0))).is_negative(), "eigenvalue {i}");
    }
    assert!(kappa.windows(2).all(|w| w[0].hi < w[1].hi));
    // P x = kappa Q x and x'Qx = 1 to the rounding of x, with each row relative to its own decades.
    for j in 0..n {
        let times = |a: &[Vec<DoubleDouble>], i: usize| {
            (0..n).fold(DoubleDouble::default(), |sum, k| sum + a[i][k] * vectors[(k, j)])
        };
        let norm = (0..n).fold(DoubleDouble::default(), |sum, i| sum + times(&q, i) * vectors[(i, j)]);
        assert!((norm.hi - 1.0).abs() < 1e-15, "vector {j}: {}", norm.hi);
        for i in 0..n {
            let size = (0..n).fold(0.0, |sum, k| sum + (p[i][k].hi * vectors[(k, j)]).abs());
            let left = times(&p, i) - kappa[j] * times(&q, i);
            let allowed = 4.0 * f64::EPSILON * (size + kappa[j].hi * vectors.col(j).norm_max());
            assert!(left.hi.abs() < allowed, "row {i} of vector {j}: {:e} of {allowed:e}", left.hi);
        }
    }
    assert!(small_pencil(p, &vec![vec![DoubleDouble::from(-1.0); n]; n]).is_none());
}
