//! Guaranteed lower and upper bounds of every eigenvalue of the exact K and M as they are stored (theory section 8,
//! "Certified").
//!
//! With A = K + tau M = L L', the eigenvalues of the pencil (A, M) are omega = lambda + tau, and those of S = L^-1 M
//! L^-T are mu = 1 / omega: M may be singular. The Lehmann-Goerisch method turns a count of the eigenvalues on one side
//! of a shift s into bounds of the eigenvalues on the other side. The bounds differ from the eigenvalues by the square
//! of the residuals (Kato-Temple for one mode, a block for repeated ones). All quantities are evaluated in
//! double-double arithmetic, with a bound of the rounding of that arithmetic.

use super::canonical::clusters;
use super::count::count_below;
use super::failure::EigenFailure;
use super::problem::Task;
use faer::{Mat, MatRef};
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Analysis, Cholesky, CompensatedBlock, DoubleDouble, LANES, Pencil, Solve, gram_compensated, largest,
    multiply_compensated, small_pencil, sum_length,
};

/// Guaranteed bounds of the eigenvalues of K and M as they are stored, at
/// [`Accuracy::Certified`](super::Accuracy::Certified).
#[derive(Debug, Clone, PartialEq)]
pub struct EigenvalueBounds {
    /// Lower bounds, ascending: lower\[j\] <= lambda_j.
    pub lower: Vec<f64>,
    /// Upper bounds, ascending: lambda_j <= upper\[j\].
    pub upper: Vec<f64>,
    /// Upper bound of the distance of each mode to the exact eigenspace of its cluster, in the norm of M.
    pub shape_error: Vec<f64>,
    /// Shift between the rigid modes and the first flexible mode.
    pub shift_below: f64,
    /// Number of negative pivots of K - shift_below M: the number of rigid modes.
    pub pivots_below: usize,
}

impl EigenvalueBounds {
    /// Moves eigenvalues that lie outside their bounds onto them: the bounds have more digits than a projection in f64.
    pub(super) fn clamp(&self, eigenvalues: &mut [f64]) {
        for ((lambda, lower), upper) in eigenvalues.iter_mut().zip(&self.lower).zip(&self.upper) {
            *lambda = lambda.clamp(*lower, *upper);
        }
    }
}

/// Unit roundoff of f64.
const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Factor that covers the rounding of the bounds themselves where they are evaluated in f64.
const ROUNDING_MARGIN: f64 = 1.0 + 1e-6;

/// Shift between the rigid and the flexible modes, relative to the first flexible eigenvalue. Rigid modes whose
/// rounding comes near this shift have been refused before.
const RIGID_SHIFT_FRACTION: f64 = 0.5;

/// Values of tau relative to the first eigenvalue, in the order of their use. A larger tau makes K + tau M better
/// conditioned and the bounds wider.
const RELATIVE_SHIFTS: [f64; 4] = [1.0, 1e2, 1e4, 1e6];

/// Counts the eigenvalues below the modes and encloses the eigenvalues between the two shifts.
///
/// * `vectors` (N x m, m > 0): nearly M-orthonormal approximate modes, one for every flexible eigenvalue
///   below `high`.
/// * `eigenvalues`: approximate eigenvalues of `vectors`, ascending.
/// * `high`: shift above all of `eigenvalues`; an inertia count found m flexible eigenvalues and the rigid ones below
///   it.
/// * `gap`: relative gap between clusters, see [`clusters`].
///
/// # Errors
/// [`EigenFailure::CountDiffers`] if the number of eigenvalues below half the first flexible one is not the number of
/// rigid modes; [`EigenFailure::NotCertified`] if K + tau M cannot be proved positive definite in f64, or if bounds
/// contradict the counts.
pub(super) fn enclose(
    task: &Task<'_>,
    vectors: MatRef<'_, f64>,
    eigenvalues: &[f64],
    high: f64,
    gap: f64,
) -> Result<EigenvalueBounds, EigenFailure> {
    let Task { problem, analysis, context, .. } = *task;
    let pencil = &problem.pencil;
    let low = RIGID_SHIFT_FRACTION * eigenvalues[0];
    let (rigid, pivots_below) = (problem.rigid.ncols(), count_below(problem, analysis, low, context)?);
    if pivots_below != rigid {
        let counted = pivots_below.saturating_sub(rigid);
        return Err(EigenFailure::CountDiffers { found: 0, counted, shift: low });
    }
    let factor = RELATIVE_SHIFTS
        .iter()
        .find_map(|part| ProvedFactor::new(analysis, pencil, part * eigenvalues[0], context))
        .ok_or(EigenFailure::NotCertified {
            why: "the lowest eigenvalue of K + tau M does not exceed its rounding error",
        })?;
    let tau = factor.tau;
    let omega: Vec<f64> = eigenvalues.iter().map(|lambda| lambda + tau).collect();
    let trial = Trial::new(&factor, vectors, omega, context);
    let shift = |sigma: f64| DoubleDouble::sum(sigma, tau);
    let lambda = |omega: DoubleDouble| omega - DoubleDouble::from(tau);
    let below = trial.lehmann(shift(high), Side::Above);
    let above = trial.lehmann(shift(low), Side::Below);
    let count = eigenvalues.len();
    let bounds = |side: Option<Vec<Option<DoubleDouble>>>, trivial: f64, round: fn(DoubleDouble) -> f64| {
        let side = side.unwrap_or_else(|| vec![None; count]);
        side.into_iter()
            .map(|omega| omega.map_or(trivial, |omega| round(lambda(omega))))
            .collect::<Vec<f64>>()
    };
    let mut lower = bounds(below, low, DoubleDouble::below);
    let mut upper = bounds(above, high, DoubleDouble::above);
    // Bounds that follow from the counts alone; both lists ascend as the eigenvalues do.
    for j in 0..count {
        lower[j] = lower[j].max(low).max(if j > 0 { lower[j - 1] } else { low });
    }
    for j in (0..count).rev() {
        upper[j] = upper[j].min(high).min(if j + 1 < count { upper[j + 1] } else { high });
    }
    if lower.iter().zip(&upper).any(|(lower, upper)| lower > upper) {
        // Bounds hold if the counts do: crossed bounds disprove a count.
        return Err(EigenFailure::NotCertified { why: "bounds of the eigenvalues contradict their counts" });
    }
    let shape_error = trial.shape_errors(&lower, &upper, (low, high), tau, &clusters(eigenvalues, gap));
    Ok(EigenvalueBounds { lower, upper, shape_error, shift_below: low, pivots_below })
}

/// Cholesky factor of A - alpha D, with A = K + tau M and the diagonal D of A. The existence of the factor proves A >=
/// margin D, with all rounding counted.
struct ProvedFactor<'a> {
    pencil: Pencil<'a>,
    factor: Cholesky<'a>,
    tau: f64,
    /// Diagonal D of A.
    diagonal: Vec<f64>,
    margin: f64,
    /// Upper bound of |D^-1/2 (|K| + tau |M|) D^-1/2| in the 2-norm.
    size: f64,
    /// Largest number of entries in a row of K or M.
    row: f64,
}

impl<'a> ProvedFactor<'a> {
    /// Factors A - alpha D. Returns `None` if A is not positive definite by more than rounding.
    ///
    /// If the Cholesky factorisation of a matrix with the diagonal d runs to its end, its factor is that of a
    /// matrix whose entries differ by at most gamma sqrt(d_i d_j) with gamma = (k + 2) u and k entries in the
    /// row of L (S. M. Rump, *Verification of positive definiteness*, BIT 46, 2006). Relative to D that is at
    /// most u times the entries of L.
    fn new(analysis: &'a Analysis, pencil: &Pencil<'a>, tau: f64, context: &Context<'_>) -> Option<Self> {
        let (k, m, block) = (pencil.stiffness(), pencil.mass(), pencil.block());
        let n = pencil.n();
        let (k_diagonal, m_diagonal) = (k.diagonal(), m.diagonal());
        let diagonal: Vec<f64> = (0..n).map(|i| k_diagonal[i] + tau * m_diagonal[i / block]).collect();
        if !diagonal.iter().all(|d| *d > 0.0 && d.is_finite()) {
            return None;
        }
        // The spectral norm of a symmetric matrix without negative entries is at most its largest row sum.
        let root: Vec<f64> = diagonal.iter().map(|d| d.sqrt()).collect();
        let (mut size, mut row) = (0.0f64, 0);
        for i in 0..n {
            let (columns, values) = k.row(i);
            let mut sum: f64 = columns.iter().zip(values).map(|(&j, v)| v.abs() / root[j as usize]).sum();
            row = row.max(columns.len());
            let (columns, values) = m.row(i / block);
            let at = |j: u32| j as usize * block + i % block;
            sum += tau * columns.iter().zip(values).map(|(&j, v)| v.abs() / root[at(j)]).sum::<f64>();
            size = size.max(sum / root[i]);
            row = row.max(columns.len());
        }
        let size = size * ROUNDING_MARGIN;
        let rounding =
            2.0 * UNIT_ROUNDOFF * (analysis.factor_len() + 3 * n) as f64 + 8.0 * UNIT_ROUNDOFF * size;
        let alpha = 3.0 * rounding;
        let lowered = k.with_diagonal(|i, value| value - alpha * diagonal[i])?;
        context.count(|work| work.factorizations += 1);
        let factor = Cholesky::new(analysis, &Pencil::new(&lowered, m, block), tau)?;
        let margin = 1.9 * rounding;
        Some(Self { pencil: *pencil, factor, tau, diagonal, margin, size, row: row as f64 })
    }

    /// Returns an upper bound of |x| in the norm of D.
    fn norm(&self, x: impl Iterator<Item = f64>) -> f64 {
        ROUNDING_MARGIN * x.zip(&self.diagonal).map(|(x, d)| x * x * d).sum::<f64>().sqrt()
    }

    /// Returns an upper bound of |r| in the norm of D^-1.
    fn dual_norm(&self, r: impl Iterator<Item = f64>) -> f64 {
        ROUNDING_MARGIN * r.zip(&self.diagonal).map(|(r, d)| r * r / d).sum::<f64>().sqrt()
    }

    /// Returns K X and M X in double-double arithmetic.
    fn products(&self, x: MatRef<'_, f64>) -> (CompensatedBlock, CompensatedBlock) {
        let k = multiply_compensated(self.pencil.stiffness(), 1, x);
        (k, multiply_compensated(self.pencil.mass(), self.pencil.block(), x))
    }

    /// Returns upper bounds of |r|^2 in the norm of A^-1 for the columns r of a block.
    ///
    /// For any z, r = A z + e gives |r| <= sqrt(z'Az) + |e|, and |e|^2 <= |e|^2_(D^-1) / margin.
    fn residual_norms(&self, r: MatRef<'_, f64>, context: &Context<'_>) -> Vec<f64> {
        let (n, count) = (r.nrows(), r.ncols());
        let mut z = r.to_owned();
        self.factor.solve_in_place(z.as_mut());
        let rest = |z: &Mat<f64>| {
            let (kz, mz) = self.products(z.as_ref());
            Mat::from_fn(n, count, |i, c| {
                (DoubleDouble::from(r[(i, c)]) - kz.get(i, c) - mz.get(i, c) * self.tau).hi
            })
        };
        // Two steps of iterative refinement of A z = r.
        for _ in 0..2 {
            let mut correction = rest(&z);
            self.factor.solve_in_place(correction.as_mut());
            z += correction;
        }
        let e = rest(&z);
        context.count(|work| {
            work.solved_columns += 3 * count as u64;
            work.stiffness_columns += 3 * count as u64;
            work.mass_columns += 3 * count as u64;
        });
        (0..count)
            .map(|c| {
                let (z, r, e) = (z.col(c), r.col(c), e.col(c));
                let along: f64 = z.iter().zip(r.iter()).map(|(z, r)| z * r).sum();
                // z'Az = z'r - z'e; the computed sum may be off by n u of the sum of its magnitudes.
                let slack: f64 = (0..n)
                    .map(|i| z[i].abs() * (e[i].abs() + (n as f64 + 2.0) * UNIT_ROUNDOFF * r[i].abs()))
                    .sum();
                // e was rounded to f64 and evaluated to 8 u^2 of its terms.
                let left = self.dual_norm(e.iter().copied())
                    + 8.0
                        * UNIT_ROUNDOFF
                        * UNIT_ROUNDOFF
                        * (self.row + 16.0)
                        * self.size
                        * self.norm(z.iter().copied());
                let norm =
                    (along + slack).max(0.0).sqrt() + (1.0 + UNIT_ROUNDOFF) * left / self.margin.sqrt();
                ROUNDING_MARGIN * norm * norm
            })
            .collect()
    }
}

/// Side of all enclosed eigenvalues on which the shift lies.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Above,
    Below,
}

/// Approximate modes X with the quantities that their bounds need.
struct Trial {
    /// Nearest f64 to lambda + tau.
    omega: Vec<f64>,
    /// Gram matrices X'AX and X'MX.
    stiffness: Vec<Vec<DoubleDouble>>,
    mass: Vec<Vec<DoubleDouble>>,
    /// Factors of the error bounds: entry (i, j) of X'AX is exact to `error[i] * error[j]`, and entry (i, j) of X'MX to
    /// that bound divided by tau.
    error: Vec<f64>,
    tau: f64,
    /// Upper bounds of |A x - omega M x|^2 in the norm of A^-1.
    residual: Vec<f64>,
}

impl Trial {
    fn new(factor: &ProvedFactor<'_>, x: MatRef<'_, f64>, omega: Vec<f64>, context: &Context<'_>) -> Self {
        let (n, count, tau) = (x.nrows(), x.ncols(), factor.tau);
        let zero = vec![vec![DoubleDouble::default(); count]; count];
        let mut trial =
            Self { stiffness: zero.clone(), mass: zero, error: Vec::new(), tau, residual: Vec::new(), omega };
        let terms = 8.0 * UNIT_ROUNDOFF * UNIT_ROUNDOFF * (sum_length(n) + factor.row + 16.0) * factor.size;
        for start in (0..count).step_by(LANES) {
            let width = LANES.min(count - start);
            let block = x.subcols(start, width);
            context.count(|work| work.stiffness_columns += width as u64);
            context.count(|work| work.mass_columns += width as u64);
            let (kx, mx) = factor.products(block);
            let (gk, gm) = (gram_compensated(x, &kx), gram_compensated(x, &mx));
            // Both triangles from the upper one: the Gram matrices are symmetric.
            for c in 0..width {
                for i in 0..=start + c {
                    let value = gk[i][c] + gm[i][c] * tau;
                    trial.stiffness[i][start + c] = value;
                    trial.stiffness[start + c][i] = value;
                    trial.mass[i][start + c] = gm[i][c];
                    trial.mass[start + c][i] = gm[i][c];
                }
            }
            // Residuals R = A X - M X Omega = K X + M X (tau - Omega).
            let shifts: Vec<DoubleDouble> =
                (0..width).map(|c| DoubleDouble::sum(tau, -trial.omega[start + c])).collect();
            let r = Mat::from_fn(n, width, |i, c| (kx.get(i, c) + mx.get(i, c) * shifts[c]).hi);
            let norms = factor.residual_norms(r.as_ref(), context);
            for (c, norm) in norms.into_iter().enumerate() {
                let size = factor.norm(x.col(start + c).iter().copied());
                trial.error.push((2.0 * terms).sqrt() * size);
                // The residual was rounded to f64, after an evaluation in double-double.
                let ratio = 1.0 + trial.omega[start + c] / tau;
                let rounding = UNIT_ROUNDOFF * factor.dual_norm(r.col(c).iter().copied())
                    + 8.0 * UNIT_ROUNDOFF * UNIT_ROUNDOFF * (factor.row + 16.0) * ratio * factor.size * size;
                let norm = norm.sqrt() + ROUNDING_MARGIN * rounding / factor.margin.sqrt();
                trial.residual.push(ROUNDING_MARGIN * norm * norm);
            }
        }
        trial
    }

    /// Returns the Lehmann-Goerisch bounds of omega, ascending: lower bounds for a shift s above the eigenvalues, upper
    /// bounds for a shift below. `None` for all, or for one, means that the trial vectors are not accurate enough.
    ///
    /// For G_A = X'AX, G_M = X'MX and T >= X'M A^-1 M X, the eigenvalues kappa of (G_A - s G_M) v = kappa
    /// (G_A - 2 s G_M + s^2 T) v give the bounds s - s / (1 - kappa). With R = A X - M X Omega, Omega T Omega
    /// = G_M Omega + Omega G_M - G_A + R'A^-1 R, and R'A^-1 R <= m diag(|r_j|^2).
    fn lehmann(&self, s: DoubleDouble, side: Side) -> Option<Vec<Option<DoubleDouble>>> {
        let count = self.omega.len();
        let sign = if side == Side::Above { -1.0 } else { 1.0 };
        let empty = || vec![vec![DoubleDouble::default(); count]; count];
        let (mut p, mut q) = (empty(), empty());
        // The two matrices of the small pencil, scaled by Omega from both sides, with bounds of the errors of their
        // entries.
        let (mut p_error, mut q_error) = (vec![vec![0.0; count]; count], vec![vec![0.0; count]; count]);
        for i in 0..count {
            for j in 0..count {
                let (a, m) = (self.stiffness[i][j], self.mass[i][j]);
                let (wi, wj) = (self.omega[i], self.omega[j]);
                let known_residual =
                    if i == j { count as f64 * self.residual[i] * ROUNDING_MARGIN } else { 0.0 };
                let t = m * wi + m * wj - a + DoubleDouble::from(known_residual);
                let scaled = |value: DoubleDouble| value * wi * wj;
                p[i][j] = scaled(a - s * m) * sign;
                q[i][j] = scaled(a - s * m * 2.0) + s * s * t;
                // Errors of the Gram matrices, and 32 u^2 of all terms for the rounding of the lines above.
                let (da, dm) = (self.error[i] * self.error[j], self.error[i] * self.error[j] / self.tau);
                let da = da + 32.0 * UNIT_ROUNDOFF * UNIT_ROUNDOFF * a.hi.abs();
                let dm = dm + 32.0 * UNIT_ROUNDOFF * UNIT_ROUNDOFF * m.hi.abs();
                p_error[i][j] = ROUNDING_MARGIN * wi * wj * (da + s.hi * dm);
                q_error[i][j] = ROUNDING_MARGIN
                    * (wi * wj * (da + 2.0 * s.hi * dm)
                        + s.hi
                            * s.hi
                            * ((wi + wj) * dm + da + 32.0 * UNIT_ROUNDOFF * UNIT_ROUNDOFF * known_residual));
            }
        }
        let (p_slack, q_slack) = (Slack::of(&p, &p_error)?, Slack::of(&q, &q_error)?);
        // Both matrices are scaled so that Q has a diagonal of ones.
        for matrix in [&mut p, &mut q] {
            for (row, si) in matrix.iter_mut().zip(&q_slack.scale) {
                for (value, sj) in row.iter_mut().zip(&q_slack.scale) {
                    *value = *value * *si * *sj;
                }
            }
        }
        let kappa = small_pencil(p, &q)?.values;
        // Every kappa is moved by its relative error to the side where the bound still holds.
        let slack = p_slack.relative + q_slack.relative + (count as f64 + 10.0) * 2f64.powi(-96);
        let one = DoubleDouble::from(1.0);
        let bound = |kappa: DoubleDouble| {
            let kappa = kappa * (1.0 - ROUNDING_MARGIN * slack);
            match side {
                Side::Above => Some(s * kappa / (one + kappa)),
                Side::Below => Some(kappa - one).filter(|over| over.hi > 0.0).map(|over| s * kappa / over),
            }
        };
        let mut bounds: Vec<_> = kappa.into_iter().map(bound).collect();
        if side == Side::Below {
            bounds.reverse();
        }
        Some(bounds)
    }

    /// Returns for each mode a bound of its distance from the exact eigenspace of its cluster, in the norm of M:
    /// |r| sqrt(omega') / |omega - omega'| with the nearest eigenvalue omega' outside the cluster, on either side.
    fn shape_errors(
        &self,
        lower: &[f64],
        upper: &[f64],
        (low, high): (f64, f64),
        tau: f64,
        clusters: &[std::ops::Range<usize>],
    ) -> Vec<f64> {
        let mut errors = Vec::with_capacity(self.omega.len());
        for cluster in clusters {
            let below = if cluster.start == 0 { low } else { upper[cluster.start - 1] } + tau;
            let above = if cluster.end == lower.len() { high } else { lower[cluster.end] } + tau;
            // The modes of a cluster are rotated afterwards: no rotated mode is worse than all modes of the cluster
            // together.
            let square: f64 = cluster
                .clone()
                .map(|j| {
                    let distance = |other: f64, gap: f64| other / (gap.max(0.0) * gap.max(0.0));
                    let omega = self.omega[j];
                    self.residual[j] * distance(below, omega - below).max(distance(above, above - omega))
                })
                .sum();
            // Two unit vectors are at most 1 apart in this measure.
            errors.extend(cluster.clone().map(|_| (ROUNDING_MARGIN * square.sqrt()).min(1.0)));
        }
        errors
    }
}

/// Bound of the distance of a computed symmetric matrix from the exact one.
struct Slack {
    /// Factors that scale the diagonal of the matrix to ones.
    scale: Vec<f64>,
    /// Relative distance d: the exact matrix lies between (1 - d) and (1 + d) times the computed one.
    relative: f64,
}

impl Slack {
    /// Computes the distance from bounds of the errors of the entries. Returns `None` if the matrix is not clearly
    /// positive definite.
    fn of(matrix: &[Vec<DoubleDouble>], error: &[Vec<f64>]) -> Option<Self> {
        let count = matrix.len();
        let scale: Vec<f64> = (0..count).map(|i| matrix[i][i].hi.sqrt().recip()).collect();
        if !scale.iter().all(|s| *s > 0.0 && s.is_finite()) {
            return None;
        }
        let row = |i: usize, entry: &dyn Fn(usize) -> f64| {
            (0..count).map(|j| entry(j) * scale[i] * scale[j]).sum::<f64>()
        };
        let off = largest((0..count).map(|i| row(i, &|j| if i == j { 0.0 } else { matrix[i][j].hi.abs() })));
        let slack = largest((0..count).map(|i| row(i, &|j| error[i][j])));
        // The smallest eigenvalue of the scaled matrix is at least 1 - off.
        (off < 0.5 && slack < 0.25).then(|| Self { scale, relative: ROUNDING_MARGIN * slack / (1.0 - off) })
    }
}
