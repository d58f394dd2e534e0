//! Sparse Cholesky of K + tau M, and the inertia of K - sigma M by Bunch-Kaufman pivoting inside supernodes; both
//! share one symbolic analysis.

use super::{Pencil, SymmetricMatrix, nested_dissection};
use dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::prelude::ReborrowMut;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

/// Elimination order and structure of the factor of K - sigma M: valid for every sigma.
#[derive(Debug)]
pub struct Analysis {
    symbolic: SymbolicCholesky<usize>,
    flops: f64,
}

impl Analysis {
    /// Orders and analyses the pencil; `None` when memory runs out.
    pub fn new(pencil: &Pencil<'_>) -> Option<Self> {
        let forward = nested_dissection(pencil.stiffness(), pencil.block())?;
        Self::with_order(pencil, forward)
    }

    fn with_order(pencil: &Pencil<'_>, forward: Vec<usize>) -> Option<Self> {
        let (pointers, rows, _) = pencil.shifted_lower(-1.0);
        let n = pencil.n();
        let mut inverse = vec![0; n];
        for (new, &old) in forward.iter().enumerate() {
            inverse[old] = new;
        }
        let symbolic = factorize_symbolic_cholesky(
            SymbolicSparseColMatRef::new_checked(n, n, &pointers, None, &rows),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n)),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .ok()?;
        let flops = supernodal_flops(&symbolic);
        Some(Self { symbolic, flops })
    }

    /// Row that is eliminated as the i-th, for each i.
    fn elimination_order(&self) -> &[usize] {
        self.symbolic.perm().map_or(&[], |perm| perm.arrays().0)
    }

    /// Threads for a factorisation: only its dense kernels are parallel, and below this work their barriers cost more
    /// than they gain. The bits are the same either way.
    fn parallelism(&self) -> Par {
        if self.flops > 3e11 { Par::rayon(0) } else { Par::Seq }
    }

    /// Numbers stored in a factor.
    pub fn factor_len(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Multiplications and additions of one Cholesky factorisation.
    pub fn flops(&self) -> f64 {
        self.flops
    }
}

/// Sum over supernodes of w columns and r rows below: w^3/3 + w^2 r + w r^2.
fn supernodal_flops(symbolic: &SymbolicCholesky<usize>) -> f64 {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Simplicial(_) => 0.0,
        SymbolicCholeskyRaw::Supernodal(s) => (0..s.n_supernodes())
            .map(|i| {
                let w = (s.supernode_end()[i] - s.supernode_begin()[i]) as f64;
                let r = s.supernode(i).pattern().len() as f64;
                w * w * w / 3.0 + w * w * r + w * r * r
            })
            .sum(),
    }
}

/// Cholesky factor of K + tau M.
#[derive(Debug)]
pub struct Cholesky<'a> {
    analysis: &'a Analysis,
    values: Vec<f64>,
    tau: f64,
}

/// Something that solves with K + tau M: the sparse factor, or the dense one of a small model.
pub trait Solve {
    /// The shift tau.
    fn shift(&self) -> f64;

    /// Replaces X (n x k) by (K + tau M)^-1 X.
    fn solve_in_place(&self, x: MatMut<'_, f64>);
}

impl<'a> Cholesky<'a> {
    /// Factors K + tau M; `None` when the matrix is not positive definite.
    pub fn new(analysis: &'a Analysis, pencil: &Pencil<'_>, tau: f64) -> Option<Self> {
        let (pointers, rows, a) = pencil.shifted_lower(-tau);
        let n = pencil.n();
        let matrix =
            SparseColMatRef::new(SymbolicSparseColMatRef::new_checked(n, n, &pointers, None, &rows), &a);
        let symbolic = &analysis.symbolic;
        let par = analysis.parallelism();
        let params = Spec::default();
        let mut values = vec![0.0; symbolic.len_val()];
        let mut memory = MemBuffer::new(symbolic.factorize_numeric_llt_scratch::<f64>(par, params));
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix,
                Side::Lower,
                LltRegularization::default(),
                par,
                MemStack::new(&mut memory),
                params,
            )
            .ok()?;
        Some(Self { analysis, values, tau })
    }
}

impl Solve for Cholesky<'_> {
    fn shift(&self) -> f64 {
        self.tau
    }

    /// Columns go in blocks of eight, each on one thread: the factor is
    /// streamed once per block, and the sums do not depend on the number of threads.
    fn solve_in_place(&self, mut x: MatMut<'_, f64>) {
        let factor = LltRef::new(&self.analysis.symbolic, &self.values);
        let mut memory =
            MemBuffer::new(self.analysis.symbolic.solve_in_place_scratch::<f64>(x.ncols().min(8), Par::Seq));
        let mut start = 0;
        while start < x.ncols() {
            let width = 8.min(x.ncols() - start);
            factor.solve_in_place_with_conj(
                Conj::No,
                x.rb_mut().subcols_mut(start, width),
                Par::Seq,
                MemStack::new(&mut memory),
            );
            start += width;
        }
    }
}

/// Whether `mass` is positive semidefinite up to rounding: its Cholesky factorisation succeeds after the diagonal has
/// been raised by 1e-9 of itself (massless nodes get a one, which couples to nothing in such a matrix). Uses the node order of `analysis`, whose pencil has `block` rows per node.
pub fn is_positive_semidefinite(mass: &SymmetricMatrix, analysis: &Analysis, block: usize) -> bool {
    let raised = mass.with_raised_diagonal(1.0 + 1e-9);
    let pencil = Pencil::new(&raised, &raised, 1);
    let nodes = analysis.elimination_order().iter().filter(|&row| row % block == 0).map(|row| row / block);
    Analysis::with_order(&pencil, nodes.collect())
        .is_some_and(|analysis| Cholesky::new(&analysis, &pencil, 0.0).is_some())
}

/// Signs of the eigenvalues of K - sigma M, equal in number to those of the pencil on either side of sigma when M
/// is positive semidefinite (Sylvester).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Eigenvalues below zero: modes below sigma.
    pub negative: usize,
    /// Zero pivots.
    pub zero: usize,
    /// |b - (K - sigma M) x| / (|b| + |K - sigma M| |x|) of a solved probe: a large one means that element growth
    /// spoilt the factor and with it the count.
    pub probe_residual: f64,
}

impl Inertia {
    /// Factors K - sigma M as L B L' (B of 1x1 and 2x2 blocks) and counts.
    pub fn new(analysis: &Analysis, pencil: &Pencil<'_>, sigma: f64) -> Self {
        let (pointers, rows, a) = pencil.shifted_lower(sigma);
        let n = pencil.n();
        let matrix =
            SparseColMatRef::new(SymbolicSparseColMatRef::new_checked(n, n, &pointers, None, &rows), &a);
        let symbolic = &analysis.symbolic;
        let par = analysis.parallelism();
        let params = Spec::default();
        let mut values = vec![0.0; symbolic.len_val()];
        let mut subdiagonal = vec![0.0; n];
        let (mut forward, mut inverse) = (vec![0usize; n], vec![0usize; n]);
        let mut memory =
            MemBuffer::new(symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(par, params));
        let factor = symbolic.factorize_numeric_intranode_lblt(
            &mut values,
            &mut subdiagonal,
            &mut forward,
            &mut inverse,
            matrix,
            Side::Lower,
            par,
            MemStack::new(&mut memory),
            params,
        );
        drop(memory);
        let mut probe = faer::Mat::from_fn(n, 1, |i, _| if i % 3 == i % 2 { 1.0 } else { -0.5 });
        let b = probe.clone();
        let mut memory = MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        factor.solve_in_place_with_conj(Conj::No, probe.as_mut(), Par::Seq, MemStack::new(&mut memory));
        let probe_residual = relative_residual(&pointers, &rows, &a, &probe, &b);
        let (negative, zero) = count_pivots(symbolic, &values, &subdiagonal);
        Self { negative, zero, probe_residual }
    }
}

/// Negative and zero eigenvalues of the block diagonal B, read from the supernodes' diagonals.
fn count_pivots(symbolic: &SymbolicCholesky<usize>, values: &[f64], subdiagonal: &[f64]) -> (usize, usize) {
    let SymbolicCholeskyRaw::Supernodal(s) = symbolic.raw() else {
        unreachable!("the analysis asks for supernodes")
    };
    let (mut negative, mut zero) = (0, 0);
    for i in 0..s.n_supernodes() {
        let (start, end) = (s.supernode_begin()[i], s.supernode_end()[i]);
        let height = end - start + s.supernode(i).pattern().len();
        let at = s.col_ptr_for_val()[i];
        let diagonal = |j: usize| values[at + (j - start) * (height + 1)];
        let mut j = start;
        while j < end {
            let off = subdiagonal[j];
            if off == 0.0 || j + 1 == end {
                negative += usize::from(diagonal(j) < 0.0);
                zero += usize::from(diagonal(j) == 0.0 || diagonal(j).is_nan());
                j += 1;
            } else {
                let (d1, d2) = (diagonal(j), diagonal(j + 1));
                // Signs of the two eigenvalues, by determinant and trace; scaled against overflow.
                let determinant = (d1 / off) * (d2 / off) - 1.0;
                if determinant < 0.0 {
                    negative += 1;
                } else if determinant > 0.0 {
                    negative += 2 * usize::from(d1 < 0.0);
                } else {
                    negative += usize::from(d1 + d2 < 0.0);
                    zero += 1;
                }
                j += 2;
            }
        }
    }
    (negative, zero)
}

/// |b - A x| / (|b| + |A| |x|) in the maximum norm, A given by its lower triangle.
fn relative_residual(
    pointers: &[usize],
    rows: &[usize],
    values: &[f64],
    x: &faer::Mat<f64>,
    b: &faer::Mat<f64>,
) -> f64 {
    let n = x.nrows();
    let mut r: Vec<f64> = (0..n).map(|i| b[(i, 0)]).collect();
    let mut scale: Vec<f64> = (0..n).map(|i| b[(i, 0)].abs()).collect();
    for j in 0..n {
        for k in pointers[j]..pointers[j + 1] {
            let (i, v) = (rows[k], values[k]);
            r[i] -= v * x[(j, 0)];
            scale[i] += (v * x[(j, 0)]).abs();
            if i != j {
                r[j] -= v * x[(i, 0)];
                scale[j] += (v * x[(i, 0)]).abs();
            }
        }
    }
    let worst = r.iter().fold(0.0f64, |m, v| if v.is_nan() { f64::INFINITY } else { m.max(v.abs()) });
    worst / scale.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(*v))
}
