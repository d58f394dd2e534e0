//! Condensation without S, from the products of M with rigid motion alone, for a body that holds neither W2
//! nor W3.

use super::condense::{
    Aligned, LANE_COLUMNS, Lane, MassTimes, NodalMass, ROWS_PER_PRODUCT, SolidColumns, rigid_part,
    sum_of_groups,
};
use super::{Invariants, LumpedMasses, PrimaryData, TermGroups, s_of_modal_mass};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use flexbody_linalg::{SymmetricMatrix, gram, parallel};
use pulp::Arch;

/// Condenses mass-normalised modes without W2 and W3: multiplies four columns by Ms instead of 4 + 3 nf,
/// and assumes m_ff = I. m, c, J, C1, C2 and W1 agree with [`condense`](super::condense()) to rounding.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_linear(
    mass: &SymmetricMatrix,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let nf = shapes.ncols();
    of_rigid_products(mass, SolidColumns { positions, shapes }, modal_stiffness, &Mat::identity(nf, nf))
}

/// Condenses lumped masses without W2 and W3 (see [`condense_lumped`](super::condense_lumped)). m_ff, which
/// is no identity for lumped masses, is computed.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_lumped_linear(
    masses: &LumpedMasses,
    positions: &[[f64; 3]],
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let m = masses.masses();
    assert_eq!(m.len(), positions.len(), "nodal masses and positions");
    let weighted = Mat::from_fn(shapes.nrows(), shapes.ncols(), |row, p| m[row / 3] * shapes[(row, p)]);
    let product = gram(shapes, weighted.as_ref());
    let modal_mass =
        Mat::from_fn(shapes.ncols(), shapes.ncols(), |p, q| 0.5 * (product[(p, q)] + product[(q, p)]));
    of_rigid_products(m, SolidColumns { positions, shapes }, modal_stiffness, &modal_mass)
}

fn of_rigid_products<M: NodalMass + ?Sized>(
    mass: &M,
    columns: SolidColumns<'_>,
    modal_stiffness: Mat<f64>,
    modal_mass: &Mat<f64>,
) -> Invariants {
    let nf = columns.shapes.ncols();
    columns.assert_sizes(mass, modal_stiffness.as_ref());
    let products = rigid_products(mass, columns);
    let psi = |k: usize, p: usize| 4 + 3 * p + k;
    // J is symmetric except for rounding: use one half of it.
    let rigid = Mat::from_fn(4, 4, |i, j| products[(i.min(j), i.max(j))]);
    let (mass, first_moment, second_moment) = rigid_part(rigid.as_ref());
    Invariants(PrimaryData {
        mass,
        first_moment,
        second_moment,
        c1: Mat::from_fn(3, nf, |k, p| products[(psi(k, p), 0)]),
        ibar: [0, 1, 2].map(|k| [0, 1, 2].map(|l| (0..nf).map(|p| products[(psi(l, p), 1 + k)]).collect())),
        s: s_of_modal_mass(nf, Some(modal_mass), None),
        modal_stiffness,
        general: None,
        groups: TermGroups { w1: true, ..TermGroups::NONE },
    })
}

/// Returns X' Ms [1, x, y, z], in the partition of the full condensation; columns beyond the fourth have no
/// meaning.
fn rigid_products<M: NodalMass + ?Sized>(mass: &M, columns: SolidColumns<'_>) -> Mat<f64> {
    let (n, count) = (columns.rows(), columns.count());
    let mut x: Vec<Lane> = vec![[0.0; LANE_COLUMNS]; n];
    parallel::for_each(x.chunks_mut(ROWS_PER_PRODUCT).enumerate(), |(chunk, rows)| {
        columns.by_node(chunk * ROWS_PER_PRODUCT, 0..4, LANE_COLUMNS, rows.as_flattened_mut());
    });
    let arch = Arch::new();
    sum_of_groups(n, (count, LANE_COLUMNS), |nodes| {
        let mut block = Aligned::zeros(ROWS_PER_PRODUCT * count);
        let mut product = [[0.0; LANE_COLUMNS]; ROWS_PER_PRODUCT];
        let mut sum = Mat::<f64>::zeros(count, LANE_COLUMNS);
        for first in nodes.clone().step_by(ROWS_PER_PRODUCT) {
            let rows = ROWS_PER_PRODUCT.min(nodes.end - first);
            let product = &mut product[..rows];
            arch.dispatch(MassTimes { mass, first, x: &x, lanes: 1, targets: product });
            let block = &mut block.get_mut()[..rows * count];
            columns.by_node(first, 0..count, count, block);
            // Rows of nodes are columns of the transpose.
            let transposed = |values, width| MatRef::from_column_major_slice(values, width, rows);
            let product = transposed(product.as_flattened(), LANE_COLUMNS).transpose();
            matmul(&mut sum, Accum::Add, transposed(block, count), product, 1.0, Par::Seq);
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::super::condense::condense_with;
    use super::*;
    use flexbody_linalg::CscMatrix;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Mass that counts the lanes of rows that are multiplied.
    struct Counted(SymmetricMatrix, AtomicUsize);

    impl NodalMass for Counted {
        fn count(&self) -> usize {
            self.0.n()
        }

        fn row_times(&self, i: usize, x: &[Lane], lanes: usize, lane: usize) -> Lane {
            self.1.fetch_add(1, Ordering::Relaxed);
            self.0.row_times(i, x, lanes, lane)
        }
    }

    #[test]
    fn rigid_motion_alone_is_multiplied_and_gives_the_same() {
        let (n, nf) = (300, 12);
        let at = |i: usize| u32::try_from(i % n).expect("a small number");
        let wave = |i: usize| (1.7 * i as f64).sin();
        let entries: Vec<(u32, u32, f64)> = (0..n)
            .flat_map(|i| [(at(i), at(i), 3.0 + wave(i)), (at(i), at(i + 1), 0.5), (at(i + 1), at(i), 0.5)])
            .collect();
        let matrix = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric");
        let mass = Counted(matrix, AtomicUsize::new(0));
        let positions: Vec<[f64; 3]> = (0..n).map(|i| [0, 7, 11].map(|k| wave(i + k))).collect();
        let shapes = Mat::from_fn(3 * n, nf, |row, p| wave(row * (p + 2)));
        let columns = SolidColumns { positions: &positions, shapes: shapes.as_ref() };
        let stiffness = || Mat::zeros(nf, nf);
        let linear = of_rigid_products(&mass, columns, stiffness(), &Mat::identity(nf, nf));
        assert_eq!(mass.1.swap(0, Ordering::Relaxed), n, "one lane holds four columns");
        let whole = condense_with(&mass, &positions, shapes.as_ref(), stiffness());
        assert_eq!(mass.1.load(Ordering::Relaxed), n * (4 + 3 * nf).div_ceil(LANE_COLUMNS));
        let near = |a: f64, b: f64, size: f64| assert!((a - b).abs() <= 1e-13 * size, "{a} is not {b}");
        near(linear.mass(), whole.mass(), whole.mass());
        for k in 0..3 {
            near(linear.first_moment()[k], whole.first_moment()[k], whole.mass());
            for l in 0..3 {
                near(linear.second_moment()[(k, l)], whole.second_moment()[(k, l)], whole.mass());
                (0..nf).for_each(|p| {
                    near(linear.ibar().unwrap()[k][l][p], whole.ibar().unwrap()[k][l][p], whole.mass())
                });
            }
            (0..nf).for_each(|p| near(linear.c1()[(k, p)], whole.c1()[(k, p)], whole.mass()));
        }
        assert_eq!(linear.modal_mass(), Mat::<f64>::identity(nf, nf));
        assert_eq!((linear.w1().is_some(), linear.w2(), linear.w3()), (true, None, None));
    }
}
