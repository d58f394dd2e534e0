//! Invariants of certified bodies compared with exact rational sums: every entry has the guaranteed digits.

use faer::Mat;
use flexbody_body::invariants::{
    CauchySchwarz, CertifiedInvariants, DIGITS, Derived, Invariants, condense, condense_certified,
};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use nalgebra::{Matrix3, Vector3};
use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};
use oracle::exact::exact;
use oracle::random::Random;

/// Ms, nodes, modes, K and body axes without physical meaning, which the sums do not need.
struct Case {
    mass: Vec<Vec<f64>>,
    stiffness: Vec<Vec<f64>>,
    positions: Vec<[f64; 3]>,
    shapes: Mat<f64>,
    axes: Matrix3<f64>,
}

const N: usize = 5;
const NF: usize = 3;

impl Case {
    /// Builds a case with entries of Ms and K over `decades`, and nodes `far` from the origin.
    fn new(seed: u64, decades: f64, far: f64) -> Self {
        let mut r = Random(seed);
        let mut gram = |n: usize| {
            // B B' with graded rows: symmetric to the last bit, positive semidefinite up to rounding.
            let scale: Vec<f64> = (0..n).map(|_| 10f64.powf(0.5 * decades * r.signed())).collect();
            let b: Vec<Vec<f64>> = (0..n).map(|_| (0..n).map(|_| r.signed()).collect()).collect();
            let entry =
                |i: usize, j: usize| (0..n).map(|c| b[i][c] * b[j][c]).sum::<f64>() * scale[i] * scale[j];
            (0..n).map(|i| (0..n).map(|j| entry(i.max(j), i.min(j))).collect()).collect::<Vec<Vec<f64>>>()
        };
        let (mass, stiffness) = (gram(N), gram(3 * N));
        Self {
            mass,
            stiffness,
            positions: (0..N).map(|_| [(); 3].map(|()| far + r.signed())).collect(),
            shapes: Mat::from_fn(3 * N, NF, |_, _| r.signed()),
            axes: r.rotation(),
        }
    }

    fn certified(&self) -> CertifiedInvariants {
        let (mass, stiffness) = (symmetric(&self.mass), symmetric(&self.stiffness));
        condense_certified(&mass, &self.positions, self.shapes.as_ref(), &stiffness, &self.axes)
    }

    /// Returns the columns 1, x_k, psi_pk in exact numbers.
    fn column(&self, index: Column) -> Vec<BigRational> {
        (0..N)
            .map(|i| match index {
                Column::One => exact(1.0),
                Column::X(k) => exact(self.positions[i][k]),
                Column::Psi(k, p) => exact(self.shapes[(3 * i + k, p)]),
            })
            .collect()
    }

    /// Returns a' Ms b.
    fn product(&self, a: Column, b: Column) -> BigRational {
        form(&self.mass, &self.column(a), &self.column(b))
    }

    fn stiffness(&self, p: usize, q: usize) -> BigRational {
        let turned = |p: usize| -> Vec<BigRational> {
            (0..3 * N)
                .map(|row| {
                    (0..3).fold(BigRational::zero(), |sum, l| {
                        sum + exact(self.axes[(row % 3, l)]) * exact(self.shapes[(row - row % 3 + l, p)])
                    })
                })
                .collect()
        };
        form(&self.stiffness, &turned(p), &turned(q))
    }
}

#[derive(Clone, Copy)]
enum Column {
    One,
    X(usize),
    Psi(usize, usize),
}
use Column::{One, Psi, X};

fn form(a: &[Vec<f64>], x: &[BigRational], y: &[BigRational]) -> BigRational {
    let mut sum = BigRational::zero();
    for (row, x) in a.iter().zip(x) {
        for (value, y) in row.iter().zip(y) {
            sum += exact(*value) * x * y;
        }
    }
    sum
}

fn symmetric(a: &[Vec<f64>]) -> SymmetricMatrix {
    let n = a.len();
    let entries: Vec<(u32, u32, f64)> =
        (0..n).flat_map(|i| (0..n).map(move |j| (i as u32, j as u32, a[i][j]))).collect();
    SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric")
}

/// Returns the largest error of each of [`DIGITS`] relative to the Cauchy-Schwarz bound.
fn errors(case: &Case, body: &Invariants) -> [f64; DIGITS.len()] {
    let bound = CauchySchwarz::of(body);
    let Derived { inertia, c2, w1, w2, w3, modal_mass } = body.derived();
    let [w1, w2, w3] = [w1, w2, w3].map(|group| group.expect("held"));
    let mut worst = [0.0f64; DIGITS.len()];
    let mut see = |which: usize, found: f64, truth: BigRational, scale: f64| {
        let error = (exact(found) - truth).to_f64().expect("a number").abs();
        worst[which] = worst[which].max(error / scale);
    };
    let int = |value: i64| exact(value as f64);
    let j = |k: usize, l: usize| case.product(X(k), X(l));
    let ibar = |k: usize, l: usize, p: usize| case.product(X(k), Psi(l, p));
    let s = |k: usize, l: usize, p: usize, q: usize| case.product(Psi(k, p), Psi(l, q));
    let other = |k: usize| ((k + 1) % 3, (k + 2) % 3);
    see(0, body.mass(), case.product(One, One), body.mass().abs());
    for k in 0..3 {
        see(1, body.first_moment()[k], case.product(One, X(k)), bound.first_moment(k));
        for l in 0..3 {
            see(2, body.second_moment()[(k, l)], j(k, l), bound.second_moment(k, l));
            let (a, b) = other(k);
            let moment = if k == l { j(a, a) + j(b, b) } else { -j(k, l) };
            see(7, inertia[(k, l)], moment, bound.inertia(k, l));
        }
        for p in 0..NF {
            let (a, b) = other(k);
            see(3, body.c1()[(k, p)], case.product(One, Psi(k, p)), bound.c1(p));
            see(11, c2[(k, p)], ibar(a, b, p) - ibar(b, a, p), bound.c2(k, p));
            for l in 0..3 {
                see(4, body.ibar().unwrap()[k][l][p], ibar(k, l, p), bound.ibar(k, p));
                let truth = if k == l {
                    int(2) * (ibar(a, a, p) + ibar(b, b, p))
                } else {
                    -(ibar(k, l, p) + ibar(l, k, p))
                };
                see(8, w1[(k, l * NF + p)], truth, bound.w1(k, l, p));
            }
            for q in 0..NF {
                for l in 0..3 {
                    see(5, body.s().unwrap()[k][l][(p, q)], s(k, l, p, q), bound.s(p, q));
                    let truth = if k == l { s(a, a, p, q) + s(b, b, p, q) } else { -s(l, k, p, q) };
                    see(9, w2[(k * NF + p, l * NF + q)], truth, bound.s(p, q));
                }
                see(10, w3[(k * NF + p, q)], s(a, b, p, q) - s(b, a, p, q), bound.s(p, q));
            }
        }
    }
    let k_ff = body.modal_stiffness();
    for p in 0..NF {
        for q in 0..NF {
            see(6, k_ff[(p, q)], case.stiffness(p, q), (k_ff[(p, p)] * k_ff[(q, q)]).abs().sqrt());
            let truth = s(0, 0, p, q) + s(1, 1, p, q) + s(2, 2, p, q);
            see(12, modal_mass[(p, q)], truth, bound.s(p, q));
        }
    }
    worst
}

#[test]
fn every_invariant_has_its_guaranteed_digits_and_not_many_more() {
    for (seed, decades, far) in [(1, 0.0, 0.0), (2, 4.0, 0.0), (3, 10.0, 0.0), (4, 2.0, 1e4), (5, 8.0, 1e6)] {
        let case = Case::new(seed, decades, far);
        let found = case.certified();
        let errors = errors(&case, &found.invariants);
        for ((name, digits), error) in DIGITS.iter().zip(found.digits).zip(errors) {
            let promised = 10f64.powf(-digits);
            assert!(error <= promised, "seed {seed}: {name} is off by {error:e}, promised {promised:e}");
            // Rounding the exact number to f64 costs 1e-16; derived entries add a few such errors.
            assert!(digits > 14.5, "seed {seed}: {name} has {digits} digits, its error is {error:e}");
            // A stored number is rounded by 2^-53 of itself.
            assert!(
                10f64.powf(-digits) >= 0.999 * 0.5f64.powi(53),
                "seed {seed}: {name} claims {digits} digits"
            );
        }
    }
}

#[test]
fn plain_sums_lose_what_compensated_ones_keep() {
    // Heavy masses of either sign between the first and the last node, which move alike: the large terms of
    // every sum cancel, with small terms between them.
    let mut case = Case::new(7, 0.0, 0.0);
    let last = N - 1;
    for (i, j, sign) in [(0, 0, 1.0), (last, last, 1.0), (0, last, -1.0), (last, 0, -1.0)] {
        case.mass[i][j] = sign * 1e12;
    }
    case.positions[last] = case.positions[0];
    for k in 0..3 {
        for p in 0..NF {
            case.shapes[(3 * last + k, p)] = case.shapes[(k, p)];
        }
    }
    let found = case.certified();
    let certified = errors(&case, &found.invariants);
    let plain = condense(
        &symmetric(&case.mass),
        &case.positions,
        case.shapes.as_ref(),
        found.invariants.modal_stiffness().clone(),
    );
    let plain = errors(&case, &plain);
    for (which, name) in DIGITS.iter().enumerate().filter(|(_, name)| ["mass", "S", "W2"].contains(name)) {
        assert!(certified[which] <= 10f64.powf(-found.digits[which]), "{name}");
        assert!(certified[which] < 1e-15 && plain[which] > 1e-8, "{name}: {:e}", plain[which]);
    }
}

#[test]
fn the_certified_condensation_equals_the_plain_one_up_to_rounding() {
    // More nodes than a chunk, more columns than a block.
    let (n, nf) = (700, 7);
    let mut r = Random(11);
    let entries: Vec<(u32, u32, f64)> = (0..n as u32)
        .flat_map(|i| {
            let next = (i + 1) % n as u32;
            [(i, i, 4.0), (i, next, 1.0), (next, i, 1.0)]
        })
        .collect();
    let mass = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric");
    let diagonal: Vec<(u32, u32, f64)> = (0..3 * n as u32).map(|i| (i, i, 1.0 + f64::from(i % 7))).collect();
    let stiffness =
        SymmetricMatrix::new(CscMatrix::from_triplets(3 * n, 3 * n, &diagonal)).expect("symmetric");
    let positions: Vec<[f64; 3]> = (0..n).map(|_| [(); 3].map(|()| r.signed())).collect();
    let shapes = Mat::from_fn(3 * n, nf, |_, _| r.signed());
    let modal = Mat::from_fn(nf, nf, |p, q| {
        (0..3 * n).map(|i| shapes[(i, p)] * stiffness.as_csc().get(i, i) * shapes[(i, q)]).sum()
    });
    let axes = Matrix3::from_columns(&[Vector3::y(), Vector3::z(), Vector3::x()]);
    let unturned = condense_certified(&mass, &positions, shapes.as_ref(), &stiffness, &Matrix3::identity());
    let plain = condense(&mass, &positions, shapes.as_ref(), modal);
    for (name, difference) in flexbody_body::invariants::primary_differences(&unturned.invariants, &plain) {
        assert!(difference < 1e-14, "{name}: {difference:e}");
    }
    // The axes affect K_ff only.
    let turned = condense_certified(&mass, &positions, shapes.as_ref(), &stiffness, &axes).invariants;
    assert_eq!(turned.s(), unturned.invariants.s());
    assert_ne!(turned.modal_stiffness(), unturned.invariants.modal_stiffness());
}
