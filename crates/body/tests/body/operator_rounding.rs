//! Operators with rounding where exact ones have zeros.

use crate::recovery::{bracket, mesh};
use flexbody_base::diagnostic::Code;
use flexbody_linalg::CscMatrix;
use flexbody_model::{Coupling, FeModel, RecoveryOperator};
use oracle::random::Random;

/// Entries that are rounding, alone in what a rigid motion moves, are no fault: neither in a row of other entries nor in a row of
/// their own beside others of its unit. A wrong row beside much stiffer ones is found.
#[test]
fn rounding_in_an_operator_is_no_strain_of_a_rigid_motion() {
    let plain = bracket(&mesh(), Coupling::Averaging);
    let with = |change: &dyn Fn(&mut Vec<(u32, u32, f64)>)| {
        let mut raw = plain.clone();
        let RecoveryOperator::Rows { transposed, .. } = &mut raw.data.recoveries[0].operator else {
            panic!()
        };
        let mut all: Vec<_> = oracle::mesh::entries(transposed).collect();
        change(&mut all);
        *transposed = CscMatrix::from_triplets(transposed.n_rows(), transposed.n_cols(), &all);
        FeModel::from_raw(raw)
    };
    let largest = |all: &[(u32, u32, f64)], column: u32| {
        all.iter().filter(|entry| entry.1 == column).fold(0.0f64, |most, entry| most.max(entry.2.abs()))
    };
    // The first row is a stress along one axis of a model: entries of the directions alone, and noise.
    let rounding = |all: &mut Vec<(u32, u32, f64)>| {
        let size = 1e-16 * largest(all, 0);
        let mut random = Random(4);
        // A spring between two nodes along x with rounding along y: y alone moves in a translation along y.
        all.retain(|entry| entry.1 != 0);
        all.extend([(0, 0, 1e16 * size), (3, 0, -1e16 * size), (1, 0, size * random.signed())]);
    };
    with(&rounding).expect("rounding beside the entries of the row");
    let row_of_rounding = |all: &mut Vec<(u32, u32, f64)>| {
        let mut random = Random(5);
        all.iter_mut().filter(|entry| entry.1 == 1).for_each(|entry| entry.2 = 1e-4 * random.signed());
    };
    with(&row_of_rounding).expect("rounding beside the other rows");
    let soft = |all: &mut Vec<(u32, u32, f64)>| {
        let mut random = Random(6);
        all.iter_mut().filter(|entry| entry.1 == 1).for_each(|entry| entry.2 *= 1e-8 * random.signed());
    };
    assert!(with(&soft).expect_err("a wrong row").has(Code::RecoveryStrained));
}
