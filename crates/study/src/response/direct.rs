//! Equations of all nodes at one frequency, solved with a factor of the dynamic stiffness.

use super::modal_sum::clear_rows;
use faer::{Mat, Scale};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::CoupledModel;
use flexbody_linalg::context::Context;
use flexbody_linalg::{
    Analysis, Indefinite, Pencil, add_combination, gram, largest_entry, side_by_side, subtract_combination,
};
use nalgebra::{Complex, DMatrix};

/// Largest backward error of a factor that serves as preconditioner.
const GROWTH_LIMIT: f64 = 1e-4;

/// Largest number of iterative refinements of a solution.
const MAX_REFINEMENTS: usize = 4;
/// Largest number of refinements where the factor knows the damping of the modes only: what they leave out is stiff
/// beside its damping force, w beta times its stiffness.
const MAX_ITERATIONS: usize = 30;
/// Relative change of a solution at which refinement stops.
const REFINEMENT_TOLERANCE: f64 = 1e-11;
/// Largest relative change after the last refinement at which the solution is accepted.
const MAX_SOLUTION_ERROR: f64 = 1e-6;

/// Floating-point operations per second that estimates of time assume.
const FLOPS_PER_SECOND: f64 = 4e9;

/// Frequency response of a free body: H(w) = L'(K + i w D - w^2 M)^-1 B. Matrices, loads and the N rows are those of
/// the model under the couplings of the body.
pub(super) struct DirectSolver<'m> {
    pencil: Pencil<'m>,
    analysis: Analysis,
    /// Rigid modes Phi (N x 6), orthonormal in M, and M Phi.
    rigid: Mat<f64>,
    rigid_products: Mat<f64>,
    /// Loads B without the part that accelerates the body as a whole (N x inputs), and outputs L (N x outputs).
    loads: Mat<f64>,
    measured: Mat<f64>,
    /// Rigid accelerations L'Phi Phi'B.
    rigid_gain: Mat<f64>,
    /// U (N x m) and C (m x m) of D = U C U', for the columns that have damping; `None` without damping.
    damping: Option<(Mat<f64>, Mat<f64>)>,
    /// beta and C' of D = U C' U' + beta K, where the damping is in proportion to the stiffness too.
    whole: Option<(f64, Mat<f64>)>,
}

/// Frequency response at one frequency.
pub(super) struct DirectSolution {
    /// Response matrix (outputs x inputs).
    pub response: DMatrix<Complex<f64>>,
    /// Number of flexible natural frequencies of the model below this frequency: negative pivots minus rigid motions.
    pub modes_below: usize,
}

/// Columns of real parts, followed by columns of imaginary parts if there is damping.
type Parts = Mat<f64>;

impl<'m> DirectSolver<'m> {
    /// Prepares the solution at `solves` frequencies.
    ///
    /// * `loads`, `measured`: B and L in all rows of the model.
    /// * `moving`: true for outputs that move with the body, false for those relative to its frame.
    /// * `damping`: the products M Psi and the modal matrix C of D = M Psi C (M Psi)'.
    /// * `whole`: beta and C' = C - beta K_ff, if the damping is D = M Psi C' (M Psi)' + beta K.
    ///
    /// # Errors
    /// [`MemoryShort`](Code::MemoryShort) and [`WorkLong`](Code::WorkLong), before any solution.
    pub(super) fn new(
        model: &'m CoupledModel<'_>,
        [loads, measured]: [&Mat<f64>; 2],
        moving: &[bool],
        damping: Option<(&Mat<f64>, &Mat<f64>)>,
        whole: Option<(f64, Mat<f64>)>,
        solves: usize,
        context: &Context<'_>,
    ) -> Result<Self> {
        let pencil = model.pencil();
        let ordering =
            || Diagnostic::new(Code::MemoryShort, "the memory does not suffice to order the equations");
        let analysis = Analysis::new(&pencil).ok_or_else(ordering)?;
        let rigid = model.rigid_modes()?;
        let [mut loads, measured] = [loads, measured].map(|columns| model.restrict(columns.clone()));
        // Split the rigid acceleration off the loads: B <- (1 - M Phi Phi') B.
        let rigid_products = pencil.apply_mass(rigid.as_ref());
        let rigid_loads = gram(rigid.as_ref(), loads.as_ref());
        let mut rigid_gain = gram(gram(rigid.as_ref(), measured.as_ref()).as_ref(), rigid_loads.as_ref());
        clear_rows(&mut rigid_gain, moving);
        subtract_combination(loads.as_mut(), rigid_products.as_ref(), rigid_loads.as_ref());
        let damping = damping.and_then(|(u, c)| damped_columns(&model.restrict(u.clone()), c));
        // Damping in proportion to the stiffness leaves no mode without.
        let is_whole = |(_, beside): &(f64, Mat<f64>)| {
            damping.as_ref().is_some_and(|(_, c)| c.ncols() == beside.ncols())
        };
        let whole = whole.filter(is_whole);
        let solver =
            Self { pencil, analysis, rigid, rigid_products, loads, measured, rigid_gain, damping, whole };
        solver.refuse_too_much(solves, context)?;
        Ok(solver)
    }

    /// Refuses solutions that need more memory or time than the context allows.
    fn refuse_too_much(&self, solves: usize, context: &Context<'_>) -> Result<()> {
        let (n, columns) = (self.pencil.n(), self.columns());
        let numbers = self.analysis.peaks(rayon::current_num_threads()).inertia;
        let bytes = 8 * (numbers + self.analysis.factor_len() as u64 + (4 * n * columns) as u64);
        if let Some(available) = context.memory.filter(|available| bytes > *available) {
            let message = format!(
                "solving the equations of all {n} rows at a frequency needs {:.3} GB on top of the matrices, {:.3} GB are left",
                bytes as f64 * 1e-9,
                available as f64 * 1e-9
            );
            return Err(Diagnostic::new(Code::MemoryShort, message).into());
        }
        let each = 2.0 * self.analysis.flops() + 12.0 * (self.analysis.factor_len() * columns) as f64;
        let seconds = solves as f64 * each / FLOPS_PER_SECOND;
        if context.longest.is_some_and(|longest| seconds > longest) {
            let message = format!(
                "solving the equations of all {n} rows at {solves} frequencies takes about {:.1} hours on one processor",
                seconds / 3600.0
            );
            let help = "give fewer --solves, or add --allow-long";
            return Err(Diagnostic::new(Code::WorkLong, message).with_help(help).into());
        }
        Ok(())
    }

    /// Returns the number of columns that are solved for with one factor.
    fn columns(&self) -> usize {
        let inputs = self.loads.ncols();
        self.damping.as_ref().map_or(inputs, |(u, _)| 2 * inputs + u.ncols())
    }

    /// Returns the number of multiplications and additions of one factorisation.
    pub(super) fn flops(&self) -> f64 {
        self.analysis.flops()
    }

    /// Returns the response at w > 0, in radians per unit of time.
    ///
    /// # Errors
    /// [`FactorizationFailed`](Code::FactorizationFailed) if the factor or the solution is too inaccurate.
    pub(super) fn at(&self, omega: f64) -> Result<DirectSolution> {
        let factor = Indefinite::new(&self.analysis, &self.pencil, omega * omega);
        let inertia = factor.inertia();
        if inertia.zero > 0 || inertia.backward_error.is_nan() || inertia.backward_error > GROWTH_LIMIT {
            return Err(inaccurate(omega, inertia.backward_error));
        }
        // Flexible part by the factor, rigid part -L'Phi Phi'B / w^2 in closed form.
        let point = Point { solver: self, damped: self.damped_at(&factor, omega), factor, omega };
        let x = point.solution()?;
        let product = gram(self.measured.as_ref(), x.as_ref());
        let inputs = self.loads.ncols();
        let response = DMatrix::from_fn(product.nrows(), inputs, |o, i| {
            let imaginary = if product.ncols() > inputs { product[(o, inputs + i)] } else { 0.0 };
            Complex::new(product[(o, i)] - self.rigid_gain[(o, i)] / (omega * omega), imaginary)
        });
        Ok(DirectSolution { response, modes_below: inertia.negative.saturating_sub(self.rigid.ncols()) })
    }

    /// Returns Z = A^-1 U and (1 + i w C U'Z)^-1 i w C, with A = K - w^2 M; `None` without damping.
    fn damped_at(&self, factor: &Indefinite<'_>, omega: f64) -> Option<Damped> {
        let (u, c) = self.damping.as_ref()?;
        let mut z = u.clone();
        factor.solve_in_place(z.as_mut());
        self.deflate(&mut z);
        let m = c.nrows();
        let c = DMatrix::from_fn(m, m, |i, j| Complex::new(0.0, omega * c[(i, j)]));
        let g = gram(u.as_ref(), z.as_ref());
        let g = DMatrix::from_fn(m, m, |i, j| Complex::new(g[(i, j)], 0.0));
        let gain = (DMatrix::identity(m, m) + &c * g).lu().solve(&c)?;
        Some(Damped { z, gain })
    }

    /// Removes rigid motion from displacements: X <- (1 - Phi Phi'M) X.
    fn deflate(&self, x: &mut Mat<f64>) {
        let along = gram(self.rigid_products.as_ref(), x.as_ref());
        subtract_combination(x.as_mut(), self.rigid.as_ref(), along.as_ref());
    }

    /// Removes the resultants from forces: F <- (1 - M Phi Phi') F.
    fn equilibrate(&self, f: &mut Mat<f64>) {
        let along = gram(self.rigid.as_ref(), f.as_ref());
        subtract_combination(f.as_mut(), self.rigid_products.as_ref(), along.as_ref());
    }
}

/// Returns U and C restricted to the columns that have damping; `None` if there are none.
fn damped_columns(u: &Mat<f64>, c: &Mat<f64>) -> Option<(Mat<f64>, Mat<f64>)> {
    let damped: Vec<usize> =
        (0..c.ncols()).filter(|&j| (0..c.nrows()).any(|i| c[(i, j)] != 0.0 || c[(j, i)] != 0.0)).collect();
    let m = damped.len();
    (m > 0).then(|| {
        (
            Mat::from_fn(u.nrows(), m, |i, j| u[(i, damped[j])]),
            Mat::from_fn(m, m, |i, j| c[(damped[i], damped[j])]),
        )
    })
}

fn inaccurate(omega: f64, residual: f64) -> flexbody_base::error::Error {
    let message = format!(
        "the equations of all nodes at {omega:.6e} rad per unit of time are solved only with a relative error of {residual:.1e}"
    );
    Diagnostic::new(Code::FactorizationFailed, message).into()
}

/// Woodbury correction for damping: (A + i w U C U')^-1 = A^-1 - Z gain U'A^-1.
struct Damped {
    z: Mat<f64>,
    gain: DMatrix<Complex<f64>>,
}

/// Factor and damping correction at one frequency.
struct Point<'s, 'm> {
    solver: &'s DirectSolver<'m>,
    factor: Indefinite<'s>,
    damped: Option<Damped>,
    omega: f64,
}

impl Point<'_, '_> {
    /// Returns X = (K + i w D - w^2 M)^-1 B, refined iteratively.
    fn solution(&self) -> Result<Parts> {
        let loads = &self.solver.loads;
        let nothing = Mat::zeros(loads.nrows(), loads.ncols());
        let loads = match self.damped {
            Some(_) => side_by_side(&[loads.as_ref(), nothing.as_ref()]),
            None => loads.clone(),
        };
        let mut x = self.solved(loads.clone());
        let mut change = f64::INFINITY;
        let refinements = if self.solver.whole.is_some() { MAX_ITERATIONS } else { MAX_REFINEMENTS };
        for _ in 0..refinements {
            let mut residual = &loads - self.product(&x);
            self.solver.equilibrate(&mut residual);
            let correction = self.solved(residual);
            change = largest_entry(correction.as_ref()) / largest_entry(x.as_ref()).max(f64::MIN_POSITIVE);
            x += correction;
            if change <= REFINEMENT_TOLERANCE {
                break;
            }
        }
        // This condition also rejects NaN.
        if change <= MAX_SOLUTION_ERROR { Ok(x) } else { Err(inaccurate(self.omega, change)) }
    }

    /// Returns (A + i w U C U')^-1 times self-equilibrated columns, without refinement.
    fn solved(&self, columns: Parts) -> Parts {
        let mut x = columns;
        self.factor.solve_in_place(x.as_mut());
        self.solver.deflate(&mut x);
        if let (Some(damped), Some((u, _))) = (&self.damped, &self.solver.damping) {
            let amplitudes = &damped.gain * complex(&gram(u.as_ref(), x.as_ref()));
            subtract_combination(x.as_mut(), damped.z.as_ref(), real(&amplitudes).as_ref());
        }
        x
    }

    /// Returns (K + i w D - w^2 M) X.
    fn product(&self, x: &Parts) -> Parts {
        let DirectSolver { pencil, damping, whole, .. } = self.solver;
        let elastic = pencil.apply_stiffness(x.as_ref());
        let mut product = &elastic - pencil.apply_mass(x.as_ref()) * Scale(self.omega * self.omega);
        if let Some((beta, _)) = whole {
            // i w beta K X.
            let (columns, factor) = (x.ncols() / 2, self.omega * beta);
            for j in 0..columns {
                for i in 0..x.nrows() {
                    product[(i, j)] -= factor * elastic[(i, columns + j)];
                    product[(i, columns + j)] += factor * elastic[(i, j)];
                }
            }
        }
        if let Some((u, c)) = damping {
            let c = whole.as_ref().map_or(c, |(_, beside)| beside);
            let c = DMatrix::from_fn(c.nrows(), c.ncols(), |i, j| Complex::new(0.0, self.omega * c[(i, j)]));
            let forces = c * complex(&gram(u.as_ref(), x.as_ref()));
            add_combination(product.as_mut(), u.as_ref(), real(&forces).as_ref());
        }
        product
    }
}

/// Returns complex columns from columns of real parts followed by columns of imaginary parts.
fn complex(parts: &Mat<f64>) -> DMatrix<Complex<f64>> {
    let columns = parts.ncols() / 2;
    DMatrix::from_fn(parts.nrows(), columns, |i, j| Complex::new(parts[(i, j)], parts[(i, columns + j)]))
}

/// Returns columns of real parts followed by columns of imaginary parts from complex columns.
fn real(matrix: &DMatrix<Complex<f64>>) -> Mat<f64> {
    let columns = matrix.ncols();
    Mat::from_fn(matrix.nrows(), 2 * columns, |i, j| match j.checked_sub(columns) {
        None => matrix[(i, j)].re,
        Some(j) => matrix[(i, j)].im,
    })
}
