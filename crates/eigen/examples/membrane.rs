//! The lowest modes of a sparse pencil, with proof: a free square membrane of 300 x 300 masses joined by springs.
//!
//! ```text
//! cargo run --release -p flexbody-eigen --example membrane
//! ```
//!
//! Its eigenvalues are 4 sin^2(pi i / 2n) + 4 sin^2(pi j / 2n), with a null space of one constant field.

use faer::Mat;
use flexbody_eigen::{EigenFailure, EigenProblem, EigenSettings, Wanted, solve};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, EliminationOrder, Pencil, SymmetricMatrix};

/// Masses along a side.
const SIDE: usize = 300;

/// K of the springs between neighbours, and M = I.
fn membrane() -> [SymmetricMatrix; 2] {
    let n = SIDE * SIDE;
    let mut springs = Vec::new();
    for at in 0..n {
        let right = (at % SIDE + 1 < SIDE).then_some(at + 1);
        let below = (at + SIDE < n).then_some(at + SIDE);
        for other in right.into_iter().chain(below) {
            let (a, b) = (at as u32, other as u32);
            springs.extend([(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)]);
        }
    }
    let masses: Vec<_> = (0..n as u32).map(|at| (at, at, 1.0)).collect();
    [springs, masses].map(|of| SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &of)).expect("symmetric"))
}

fn main() -> Result<(), EigenFailure> {
    let [k, m] = membrane();
    let constant = Mat::from_fn(k.n(), 1, |_, _| (k.n() as f64).sqrt().recip());
    let order = EliminationOrder::default();
    let problem = EigenProblem::new(Pencil::new(&k, &m, 1), constant.as_ref(), &order)?;
    let settings = EigenSettings { wanted: Wanted::Lowest(12), ..EigenSettings::default() };
    let modes = solve(&problem, &settings, &Context::QUIET)?;
    println!("{:?}", modes.eigenvalues);
    println!(
        "{:?}: {} modes lie below {:e}",
        modes.completeness.proof, modes.completeness.modes_below, modes.completeness.shift
    );

    // The closed form.
    let square = |i: usize| 4.0 * (std::f64::consts::FRAC_PI_2 * i as f64 / SIDE as f64).sin().powi(2);
    let mut exact: Vec<f64> = (0..SIDE * SIDE).map(|at| square(at / SIDE) + square(at % SIDE)).collect();
    exact.sort_by(f64::total_cmp);
    for (found, exact) in modes.eigenvalues.iter().zip(&exact[1..]) {
        assert!((found / exact - 1.0).abs() < 1e-9, "{found:e}, expected {exact:e}");
    }
    Ok(())
}
