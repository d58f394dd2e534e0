//! Operators with rounding where exact ones have zeros.

use flexbody_base::diagnostic::Code;
use flexbody_linalg::CscMatrix;
use flexbody_model::{FeModel, RecoveryOperator};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;
use oracle::random::Random;

/// Row, column and value.
type Entry = (u32, u32, f64);

/// Entries that are rounding, alone in what a rigid motion moves, are no fault: neither in a row of other entries nor in a
/// row of their own beside others of its unit. Wrong entries, and a wrong row beside much stiffer ones, are found.
#[test]
fn rounding_in_an_operator_is_no_strain_of_a_rigid_motion() {
    let mesh = Mesh::block(ElementKind::Hex8, [3, 2, 1], [0.75, 0.5, 0.25]);
    let mut plain = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    plain.data.recoveries = vec![mesh.stresses(&Material::STEEL)];
    // Rows of no known component are not compared with the uniform strains of K.
    if let RecoveryOperator::Rows { labels, .. } = &mut plain.data.recoveries[0].operator {
        labels.iter_mut().enumerate().for_each(|(number, row)| row.component = format!("part {number}"));
    }
    let with = |change: &dyn Fn(&mut Vec<Entry>)| {
        let mut raw = plain.clone();
        let RecoveryOperator::Rows { transposed, .. } = &mut raw.data.recoveries[0].operator else {
            panic!()
        };
        let mut all: Vec<_> = oracle::mesh::entries(transposed).collect();
        change(&mut all);
        *transposed = CscMatrix::from_triplets(transposed.n_rows(), transposed.n_cols(), &all);
        FeModel::from_raw(raw)
    };
    let largest = |all: &[Entry], column: u32| {
        all.iter().filter(|entry| entry.1 == column).fold(0.0f64, |most, entry| most.max(entry.2.abs()))
    };
    // A spring along x between nodes on one line, with rounding along y, which alone a translation along y moves.
    let at = &plain.nodes.positions;
    let beside = |i: &usize| at[*i][0] != at[0][0] && at[*i][1] == at[0][1] && at[*i][2] == at[0][2];
    let other = 3 * (0..at.len()).find(beside).expect("a node on the line") as u32;
    let rounding = |all: &mut Vec<Entry>| {
        let size = largest(all, 0);
        all.retain(|entry| entry.1 != 0);
        all.extend([(0, 0, size), (other, 0, -size), (1, 0, 1e-17 * size)]);
    };
    with(&rounding).expect("rounding beside the entries of the row");
    let wrong = |all: &mut Vec<Entry>| {
        rounding(all);
        all.push((1, 0, 1e-2 * largest(all, 0)));
    };
    assert!(with(&wrong).expect_err("a wrong entry").has(Code::RecoveryStrained));
    let row_of_rounding = |all: &mut Vec<Entry>| {
        let mut random = Random(5);
        all.iter_mut().filter(|entry| entry.1 == 1).for_each(|entry| entry.2 = 1e-4 * random.signed());
    };
    with(&row_of_rounding).expect("rounding beside the other rows");
    let soft = |all: &mut Vec<Entry>| {
        let mut random = Random(6);
        all.iter_mut().filter(|entry| entry.1 == 1).for_each(|entry| entry.2 *= 1e-8 * random.signed());
    };
    assert!(with(&soft).expect_err("a wrong row").has(Code::RecoveryStrained));
}
