//! Time integration by extrapolation of Gragg's midpoint rule: order 12, fixed step, with errors far below the
//! tolerances of the tests.

use nalgebra::DVector;

/// Numbers of substeps of the extrapolated solutions.
const SUBSTEPS: [usize; 6] = [2, 4, 6, 8, 10, 12];

/// Performs one step of y' = f(y).
pub fn step(y: &DVector<f64>, length: f64, f: &impl Fn(&DVector<f64>) -> DVector<f64>) -> DVector<f64> {
    let start = f(y);
    let mut table: Vec<DVector<f64>> = Vec::new();
    for (row, &n) in SUBSTEPS.iter().enumerate() {
        let h = length / n as f64;
        let (mut before, mut now) = (y.clone(), y + &start * h);
        for _ in 1..n {
            let next = before + f(&now) * (2.0 * h);
            (before, now) = (now, next);
        }
        // Extrapolation by Aitken and Neville, in powers of h^2.
        let mut value = (&now + &before + f(&now) * h) * 0.5;
        for column in 0..row {
            let ratio = (n as f64 / SUBSTEPS[row - 1 - column] as f64).powi(2);
            let better = &value + (&value - &table[column]) / (ratio - 1.0);
            table[column] = std::mem::replace(&mut value, better);
        }
        table.push(value);
    }
    table.pop().expect("six rows")
}
