//! Corrections of approximate modes: conjugate gradients for (K - theta M) t = r in the M-orthogonal complement of the
//! mode itself, with multigrid cycles as preconditioner (the correction equation of Sleijpen and van der Vorst, SIAM J.
//! Matrix Anal. Appl. 17 (1996) 401). [`Deflation`] removes the modes below and handles those above, so that K - theta
//! M is positive definite on the rest.

use super::blocks::{BlockMatrix, Rows, WIDTH};
use super::level::products;
use crate::{contiguous_mut, parallel};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use std::ops::Range;

/// Number of nodes per parallel task.
const NODES_PER_TASK: usize = 512;

/// Largest number of steps for which other columns wait for a column.
const MAX_AWAITED_STEPS: usize = 6;

/// Part of the error that the first step is expected to leave.
const FIRST_STEP_ERROR_FRACTION: f64 = 0.2;

/// Part of the error below which single precision allows no further gain.
const SINGLE_PRECISION_ERROR_FLOOR: f64 = 1e-4;

/// Goal of a correction.
#[derive(Debug, Clone, Copy)]
pub struct CorrectionTarget {
    /// Index of the corrected pair among the modes [near](super::DeflationSpace) it.
    pub pair: usize,
    /// Part of the error of the correction that may remain.
    pub left: f64,
}

/// K + tau M and M, scaled to single precision.
pub(super) struct SmallPencil<'a, const B: usize> {
    /// (K + tau M) / size.
    pub a: &'a BlockMatrix<B, B>,
    /// M / heaviest, one entry for each block of `a`.
    pub mass: &'a [f32],
    pub tau: f64,
    /// Ratio heaviest / size.
    pub ratio: f64,
}

/// Correction equations of a set of approximate pairs.
pub(super) struct Corrections<'a, F, const B: usize> {
    pub pencil: SmallPencil<'a, B>,
    /// Approximate solution with `a` by one multigrid cycle.
    pub cycle: F,
    pub deflation: Deflation<'a>,
    /// Eigenvalues of the pairs.
    pub eigenvalues: &'a [f64],
}

/// Column in work.
#[derive(Debug, Clone, Copy)]
struct Slot {
    column: usize,
    target: CorrectionTarget,
    steps: usize,
    /// r'z of the first and of the last step.
    first: f64,
    last: f64,
    /// True if the goal is reached, or the column is no longer waited for.
    is_reached: bool,
    /// True if further steps gain nothing.
    is_at_end: bool,
}

/// Active columns (one per SIMD lane) and the queue of pending ones.
struct Work<'a, const B: usize> {
    /// Forces, which are replaced by their corrections.
    columns: Vec<&'a mut [f64]>,
    waiting: std::iter::Rev<Range<usize>>,
    slots: [Option<Slot>; WIDTH],
    /// Residual, solution so far, and last search direction.
    r: Vec<Rows<B>>,
    t: Vec<Rows<B>>,
    p: Vec<Rows<B>>,
}

impl<F, const B: usize> Corrections<'_, F, B>
where
    F: Fn(&[Rows<B>]) -> Vec<Rows<B>>,
{
    /// Replaces each force, of about unit size, by its correction. Columns are processed side by side. Columns that
    /// have reached their goal continue as long as others are waited for, since this costs nothing. Returns the number
    /// of columns of cycles.
    pub(super) fn solve(&self, targets: &[CorrectionTarget], forces: MatMut<'_, f64>) -> u64 {
        let mut work = Work::new(self.pencil.a.n_rows(), forces);
        let mut columns = 0;
        loop {
            work.fill_slots(targets);
            let active = work.slots.iter().flatten().count();
            if active == 0 {
                return columns;
            }
            columns += active as u64;
            self.step(&mut work);
            work.store_finished();
        }
    }

    /// Makes one step of conjugate gradients for all active columns.
    fn step(&self, work: &mut Work<'_, B>) {
        let pairs = work.slots.map(|slot| slot.map(|slot| slot.target.pair));
        // Precondition and project the residual, update the direction, step along it.
        let mut z = (self.cycle)(&work.r);
        self.deflation.project(&mut z, &pairs);
        let rz = products(&work.r, &z);
        work.update_directions(&z, &rz);
        let q = self.applied(&work.p, &pairs);
        let pq = products(&work.p, &q);
        work.advance(&q, &rz, &pq);
    }

    /// Returns (K - theta M) p / size.
    fn applied(&self, p: &[Rows<B>], pairs: &[Option<usize>; WIDTH]) -> Vec<Rows<B>> {
        let SmallPencil { a, mass, tau, ratio } = self.pencil;
        let theta =
            pairs.map(|pair| pair.map_or(0.0, |pair| ((self.eigenvalues[pair] + tau) * ratio) as f32));
        a.apply_pencil(mass, &theta, p)
    }
}

impl<'a, const B: usize> Work<'a, B> {
    fn new(nodes: usize, forces: MatMut<'a, f64>) -> Self {
        let columns: Vec<_> = forces.col_iter_mut().map(contiguous_mut).collect();
        // The highest pairs first, which take the most steps.
        let waiting = (0..columns.len()).rev();
        let [r, t, p] = [(); 3].map(|()| vec![[[0.0; WIDTH]; B]; nodes]);
        Self { columns, waiting, slots: [None; WIDTH], r, t, p }
    }

    /// Fills free slots with waiting columns.
    fn fill_slots(&mut self, targets: &[CorrectionTarget]) {
        let Self { columns, waiting, slots, r, t, p } = self;
        // Assign one waiting column to each free slot.
        let mut fresh: Vec<(usize, &[f64])> = Vec::new();
        for (w, slot) in slots.iter_mut().enumerate().filter(|(_, slot)| slot.is_none()) {
            let Some(column) = waiting.next() else { break };
            let target = targets[column];
            *slot = Some(Slot {
                column,
                target,
                steps: 0,
                first: 0.0,
                last: 0.0,
                is_reached: false,
                is_at_end: false,
            });
            fresh.push((w, &*columns[column]));
        }
        if fresh.is_empty() {
            return;
        }
        // Start from t = 0: the residual is the force, in single precision.
        let tasks =
            r.chunks_mut(NODES_PER_TASK).zip(t.chunks_mut(NODES_PER_TASK)).zip(p.chunks_mut(NODES_PER_TASK));
        parallel::for_each(tasks.enumerate(), |(task, ((r, t), p))| {
            for (node, ((r, t), p)) in (task * NODES_PER_TASK..).zip(r.iter_mut().zip(t).zip(p)) {
                for &(w, force) in &fresh {
                    for b in 0..B {
                        r[b][w] = force[node * B + b] as f32;
                        (t[b][w], p[b][w]) = (0.0, 0.0);
                    }
                }
            }
        });
    }

    /// Computes the next search direction: p <- z + beta p.
    fn update_directions(&mut self, z: &[Rows<B>], rz: &[f64; WIDTH]) {
        let mut beta = [0.0f32; WIDTH];
        for ((slot, &rz), beta) in self.slots.iter_mut().zip(rz).zip(&mut beta) {
            let Some(slot) = slot else { continue };
            let mut left = FIRST_STEP_ERROR_FRACTION;
            if slot.steps == 0 {
                slot.first = rz;
            } else {
                *beta = (rz / slot.last) as f32;
                // Estimate of the error after this step, if it gains as much as the step before.
                left = (rz / slot.first).sqrt() * (rz / slot.last).sqrt();
            }
            slot.last = rz;
            slot.steps += 1;
            slot.is_reached |= left <= slot.target.left || slot.steps >= MAX_AWAITED_STEPS;
            slot.is_at_end = left <= SINGLE_PRECISION_ERROR_FLOOR;
        }
        // A column with NaN gets a zero direction.
        let is_number = rz.map(f64::is_finite);
        parallel::for_each_mut(&mut self.p, NODES_PER_TASK, |node, p| {
            let z = &z[node];
            for b in 0..B {
                for w in 0..WIDTH {
                    p[b][w] = if is_number[w] { z[b][w] + beta[w] * p[b][w] } else { 0.0 };
                }
            }
        });
    }

    /// Steps along p, with q = (K - theta M) p. A column whose matrix proves indefinite ends.
    fn advance(&mut self, q: &[Rows<B>], rz: &[f64; WIDTH], pq: &[f64; WIDTH]) {
        let mut alpha = [0.0f32; WIDTH];
        for (w, slot) in self.slots.iter_mut().enumerate() {
            let Some(slot) = slot else { continue };
            if rz[w] > 0.0 && pq[w] > 0.0 {
                alpha[w] = (rz[w] / pq[w]) as f32;
                continue;
            }
            // In the first step, the result of the cycle alone is a correction too.
            alpha[w] = f32::from(u8::from(slot.steps == 1));
            (slot.is_reached, slot.is_at_end) = (true, true);
        }
        parallel::for_each_mut(&mut self.t, NODES_PER_TASK, |node, t| {
            let p = &self.p[node];
            for b in 0..B {
                (0..WIDTH).for_each(|w| t[b][w] += alpha[w] * p[b][w]);
            }
        });
        parallel::for_each_mut(&mut self.r, NODES_PER_TASK, |node, r| {
            let q = &q[node];
            for b in 0..B {
                (0..WIDTH).for_each(|w| r[b][w] -= alpha[w] * q[b][w]);
            }
        });
    }

    /// Stores the columns that gain nothing more, those that have reached their goal if others wait for their slot, and
    /// all columns if all have reached their goals.
    fn store_finished(&mut self) {
        let is_last = self.waiting.len() == 0 && self.slots.iter().flatten().all(|slot| slot.is_reached);
        let has_others = self.waiting.len() > 0;
        let ends = |slot: &Slot| is_last || slot.is_at_end || (slot.is_reached && has_others);
        let Self { columns, slots, r, t, p, .. } = self;
        let mut ended = Vec::new();
        for (w, slot) in slots.iter_mut().enumerate() {
            let Some(Slot { column, .. }) = slot.take_if(|slot| ends(slot)) else { continue };
            let tasks = columns[column].chunks_mut(NODES_PER_TASK * B).zip(t.chunks(NODES_PER_TASK));
            parallel::for_each(tasks, |(rows, t)| {
                rows.iter_mut().zip(t.as_flattened()).for_each(|(row, t)| *row = f64::from(t[w]));
            });
            ended.push(w);
        }
        if ended.is_empty() || is_last {
            return;
        }
        for x in [r, p] {
            parallel::for_each_mut(x, NODES_PER_TASK, |_, x| {
                ended.iter().for_each(|&w| x.iter_mut().for_each(|row| row[w] = 0.0));
            });
        }
    }
}

// Deflation: projection off known modes, in single precision.

/// Number of rows per partial product.
const ROWS_PER_PARTIAL_PRODUCT: usize = 4096;

/// Distance of two eigenvalues, relative to one of them, up to which only M-orthogonality is applied: (K - theta
/// M)-orthogonality would divide by a small number.
const NEAR_EIGENVALUE_DISTANCE: f64 = 0.1;

/// Modes from which corrections are kept apart.
pub struct DeflationSpace<'a> {
    /// Rigid modes, M-orthonormal, and M times these.
    pub rigid: [MatRef<'a, f64>; 2],
    /// Approximate modes, M-orthonormal.
    pub modes: MatRef<'a, f64>,
    /// K times the approximate modes.
    pub k_modes: MatRef<'a, f64>,
    /// M times the approximate modes.
    pub m_modes: MatRef<'a, f64>,
    /// Eigenvalues of the approximate modes, ascending.
    pub eigenvalues: &'a [f64],
}

/// Modes of a [`DeflationSpace`], in single precision.
pub(super) struct Deflation<'a> {
    rigid: usize,
    eigenvalues: &'a [f64],
    /// Rigid and approximate modes, scaled to a largest entry of one.
    x: Mat<f32>,
    /// M times the modes, divided by the scale of `x`.
    mx: Mat<f32>,
    /// K / `unit` times the approximate modes, divided by the scale of `x`.
    kx: Mat<f32>,
    /// Scale of K: the highest eigenvalue.
    unit: f64,
}

impl<'a> Deflation<'a> {
    pub(super) fn new(near: &DeflationSpace<'a>) -> Self {
        let [rigid, m_rigid] = near.rigid;
        let sizes: Vec<f64> =
            [rigid, near.modes].iter().flat_map(|x| x.col_iter()).map(|x| x.norm_max()).collect();
        let highest = near.eigenvalues.last().copied().unwrap_or(0.0);
        let unit = if highest > 0.0 { highest } else { 1.0 };
        Self {
            rigid: rigid.ncols(),
            eigenvalues: near.eigenvalues,
            x: narrow(&[rigid, near.modes], &sizes, |size| 1.0 / size),
            mx: narrow(&[m_rigid, near.m_modes], &sizes, |size| size),
            kx: narrow(&[near.k_modes], &sizes[rigid.ncols()..], |size| size / unit),
            unit,
        }
    }

    /// Projects each column z, which belongs to the given pair with eigenvalue theta. It becomes M-orthogonal to the
    /// rigid modes, to the mode of its pair and to modes near it, and (K - theta M)-orthogonal to the other modes. The
    /// remaining equation is then also correct along the other modes, whereas M-orthogonality would drop their coupling
    /// to the correction (deflated conjugate gradients: Saad, Yeung, Erhel and Guyomarc'h, SIAM J. Sci. Comput. 21
    /// (2000) 1909).
    fn project<const B: usize>(&self, z: &mut [Rows<B>], pairs: &[Option<usize>; WIDTH]) {
        let nodes = ROWS_PER_PARTIAL_PRODUCT / B;
        // Partial products of a chunk of rows with M X and K X.
        let products = |(chunk, z): (usize, &[Rows<B>])| {
            let (start, rows) = (chunk * nodes * B, z.len() * B);
            let z = MatRef::from_row_major_slice(z.as_flattened().as_flattened(), rows, WIDTH);
            [&self.mx, &self.kx].map(|block| {
                let mut part = Mat::zeros(block.ncols(), WIDTH);
                let block = block.as_ref().subrows(start, rows).transpose();
                matmul(part.as_mut(), Accum::Replace, block, z, 1.0, Par::Seq);
                part
            })
        };
        // Products with M X and K X, summed in fixed order; then subtract X times the coefficients.
        let parts: Vec<[Mat<f32>; 2]> = parallel::map(z.chunks(nodes).enumerate(), products);
        let sum = |block: usize, i: usize, w: usize| -> f64 {
            parts.iter().map(|part| f64::from(part[block][(i, w)])).sum()
        };
        // Coefficients: conjugate for modes apart from the pair, M-orthogonal for all others.
        let along = Mat::from_fn(self.x.ncols(), WIDTH, |i, w| {
            let (heavy, mode) = (sum(0, i, w), i.checked_sub(self.rigid));
            let conjugate = mode.zip(pairs[w]).and_then(|(mode, pair)| {
                let theta = self.eigenvalues[pair];
                let distance = self.eigenvalues[mode] - theta;
                let is_apart = mode != pair && distance.abs() > NEAR_EIGENVALUE_DISTANCE * theta.abs();
                is_apart.then(|| (self.unit * sum(1, mode, w) - theta * heavy) / distance)
            });
            conjugate.unwrap_or(heavy) as f32
        });
        // z <- z - X times the coefficients.
        parallel::for_each(z.chunks_mut(nodes).enumerate(), |(chunk, z)| {
            let (start, rows) = (chunk * nodes * B, z.len() * B);
            let z = MatMut::from_row_major_slice_mut(z.as_flattened_mut().as_flattened_mut(), rows, WIDTH);
            matmul(z, Accum::Add, self.x.as_ref().subrows(start, rows), along.as_ref(), -1.0, Par::Seq);
        });
    }
}

/// Returns the columns of the blocks, each multiplied by `scale(size)`; zero for columns of size zero.
fn narrow(blocks: &[MatRef<'_, f64>], sizes: &[f64], scale: impl Fn(f64) -> f64 + Sync) -> Mat<f32> {
    let columns: Vec<_> = blocks.iter().flat_map(|block| block.col_iter()).collect();
    let mut narrowed = Mat::zeros(blocks[0].nrows(), columns.len());
    parallel::for_each(narrowed.col_iter_mut().zip(columns).zip(sizes), |((to, from), &size)| {
        let scale = if size > 0.0 { scale(size) } else { 0.0 };
        to.iter_mut().zip(from.iter()).for_each(|(to, from)| *to = (scale * from) as f32);
    });
    narrowed
}
