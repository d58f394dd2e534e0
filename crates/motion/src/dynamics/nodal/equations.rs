//! Constants of the nodal equations of motion.

use super::conditions::{Motions, ReferenceConditions, add_motion, sums};
use super::directors::{Directors, Massless, NULL_PIVOT};
use super::error::NodalError;
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, Frame};
use flexbody_linalg::{SparseLdl, SymmetricMatrix, multiply_vector};
use flexbody_model::{Damping, FeModel, centre_and_length};
use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

/// Smallest ratio of the smallest to the largest singular value of C R for which the conditions fix the
/// frame.
const MIN_SINGULAR_VALUE_RATIO: f64 = 1e-8;

/// Equations of motion of all nodes in a floating frame (theory 6.9 to 6.13; \[ZG19\] eq. 67 to 98 for
/// solids): nothing is reduced, K and M are the matrices of the model.
///
/// ```text
/// vbar = R (V, omega) + omega x u + u',    w = M vbar,    (p, h) = B'w,    B = [Phi_t, B_x + B(u)],    C u = 0
/// w' + omega x w + K u + D u' = f + C'lambda
/// p' + omega x p = F,    h' + omega x h + V x p = tau
/// ```
///
/// u (N) are the displacements of all rows of the model relative to the moving frame, in the rows and axes
/// of the model; omega x turns displacements. V, omega and all other frame quantities are in the axes of
/// `frame`, as for a [`FlexBody`](flexbody_body::flex_body::FlexBody) with an equal frame. M is any
/// symmetric positive semidefinite matrix; massless motions are condensed exactly.
///
/// If rotations carry mass, nodes are points and directors d_a = exp(theta~) e_a with the mass E of
/// [`DirectorMass`](flexbody_model::DirectorMass), for rotations theta of any size. With their velocities
/// Yd, V + omega x (x + u) + u' and (omega + J(theta) theta') x d_a,
///
/// ```text
/// T = 1/2 Yd'E Yd + ...,    w = dT/du',    (p, h) = dT/d(V, omega),    w' - dT/du + K u + D u' = f + C'lambda
/// ```
///
/// where the dots stand for the part of M outside E, along the axes of the frame. A massless motion that
/// turns a node with mass is held in the position where K has no load along it; the error is of second
/// order in the rotations.
///
/// [`NodalEvaluation`](super::NodalEvaluation) evaluates the equations, [`NodalMotion`](super::NodalMotion)
/// integrates them. One evaluation costs a product with K, a solve with a factor of M made here, and a few
/// dot products, which suits models of some thousand rows. If rotations carry mass it takes 7 to 30 such
/// solves and products with E.
///
/// ```
/// # fn check(model: &flexbody_model::FeModel, body: &flexbody_body::flex_body::FlexBody,
/// # start: &flexbody_motion::dynamics::Configuration)
/// # -> Result<(), Box<dyn std::error::Error>> {
/// use flexbody_motion::dynamics::{NodalEquations, NodalModes, NodalMotion, ReferenceConditions};
/// use flexbody_motion::integration::{Explicit, Failure, Method, integrate};
/// let equations = NodalEquations::new(model, body.frame(), &ReferenceConditions::MeanAxes)?;
/// let modes = NodalModes::new(&equations, body).ok_or("modes of another model")?;
/// let mut state = equations.state(&modes.lift(start))?;
/// let mut method = Method::Explicit(Explicit::new(state.len(), 1e-10, f64::INFINITY));
/// let mut motion = NodalMotion::free(&equations);
/// integrate(&mut method, &mut motion, &mut state, &[0.0, 1.0], &[], |_, _| Ok::<(), Failure>(()))?;
/// let end = modes.project(&motion.evaluate(1.0, &state)?.configuration());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct NodalEquations<'m> {
    pub(super) model: &'m FeModel,
    pub(super) frame: Frame,
    /// Positions of the nodes about the origin of the frame, model axes.
    pub(super) positions: Vec<Vector3<f64>>,
    pub(super) length: f64,
    /// Indices of the existing components of (V, omega).
    pub(super) moving: &'static [usize],
    /// R: rigid motions about the origin of the frame, model axes.
    pub(super) rigid: Motions,
    pub(super) mass_rigid: Motions,
    /// R'M R; motions that a plane body does not have get the identity.
    pub(super) rigid_mass: Matrix6<f64>,
    /// C', the conditions as columns.
    pub(super) conditions: Motions,
    /// True if the conditions hold points at rest; false for mean axes.
    pub(super) is_held: bool,
    /// R'C', completed by the identity for motions that do not exist.
    pub(super) conditions_rigid: Matrix6<f64>,
    /// (C R)^-1.
    pub(super) rigid_part: Matrix6<f64>,
    pub(super) factor: SparseLdl,
    pub(super) massless: Massless,
    /// M^-1 C', and E = C M^-1 C', completed by the identity for motions that do not exist.
    pub(super) answered: Motions,
    pub(super) answer: Matrix6<f64>,
    /// Damping of the model; damping by modal ratios is in `modal_damping`.
    pub(super) damping: Option<&'m Damping<SymmetricMatrix>>,
    pub(super) modal_damping: Option<ModalDamping>,
    /// Nodes with rotational mass, if there are any.
    pub(super) directors: Option<Directors<'m>>,
}

/// Returns R and M R: rigid motions of the frame at the rows of the model, zero for motions that a plane
/// body does not have.
fn rigid_motions(model: &FeModel, frame: &Frame, moving: &[usize]) -> (Motions, Motions) {
    let (pencil, n) = (model.pencil(), model.rows().len());
    let fields = model.rigid_fields(frame.origin.into(), 1.0);
    let (mut rigid, mut mass_rigid) = (vec![[0.0; 6]; n], vec![[0.0; 6]; n]);
    let mut product = vec![0.0; n];
    for (column, &motion) in moving.iter().enumerate() {
        let field = fields.col_as_slice(column);
        multiply_vector(pencil.mass(), pencil.block(), field, &mut product);
        for row in 0..n {
            (rigid[row][motion], mass_rigid[row][motion]) = (field[row], product[row]);
        }
    }
    (rigid, mass_rigid)
}

impl<'m> NodalEquations<'m> {
    /// Creates the equations of `model` in a frame that coincides with `frame` before deformation.
    ///
    /// Factors M and condenses massless rows and null vectors: u of the empty rows of M, and along any null
    /// vector z, follows from z'(K u - f) = 0.
    ///
    /// # Errors
    /// [`NodalError`] for conditions that do not fix the frame, for K that does not resist a massless
    /// motion, for M that is indefinite or has more null vectors than dense storage allows, and for damping
    /// by modal ratios.
    pub fn new(
        model: &'m FeModel,
        frame: &Frame,
        conditions: &ReferenceConditions,
    ) -> Result<Self, NodalError> {
        if matches!(model.damping(), Some(Damping::Ratio(_) | Damping::Bands(_))) {
            return Err(NodalError::DampingOfModes);
        }
        Self::undamped_modes(model, frame, conditions)
    }

    /// Creates the equations of `model` in the frame of `body`, a body of this model. If the model has no
    /// damping matrix of its own, the damping of the modes is used: D = M Psi m_ff^-1 D_ff m_ff^-1 Psi'M,
    /// which gives Psi'D Psi = D_ff of the body.
    ///
    /// # Errors
    /// The errors of [`NodalEquations::new`]; [`NodalError::OtherBody`] if the body has other rows, or
    /// modes that depend on each other.
    pub fn of_body(
        model: &'m FeModel,
        body: &FlexBody,
        conditions: &ReferenceConditions,
    ) -> Result<Self, NodalError> {
        if matches!(model.damping(), Some(Damping::Rayleigh { .. } | Damping::Matrix(_))) {
            return Self::undamped_modes(model, body.frame(), conditions);
        }
        Self::of_damped_body(model, body, conditions)
    }

    /// Creates the equations of `model` in the frame of `body` with the damping of the modes of the body in
    /// place of that of the model.
    ///
    /// # Errors
    /// The errors of [`NodalEquations::of_body`].
    pub fn of_damped_body(
        model: &'m FeModel,
        body: &FlexBody,
        conditions: &ReferenceConditions,
    ) -> Result<Self, NodalError> {
        let mut equations = Self::undamped_modes(model, body.frame(), conditions)?;
        equations.damping = None;
        equations.modal_damping = ModalDamping::new(model, body).ok_or(NodalError::OtherBody)?;
        Ok(equations)
    }

    fn undamped_modes(
        model: &'m FeModel,
        frame: &Frame,
        conditions: &ReferenceConditions,
    ) -> Result<Self, NodalError> {
        if model.followers().is_some() {
            return Err(NodalError::MassFollows);
        }
        let moving: &[usize] = if model.dimension() == 2 { &[0, 1, 5] } else { &[0, 1, 2, 3, 4, 5] };
        let (rigid, mass_rigid) = rigid_motions(model, frame, moving);
        let factor = SparseLdl::new(model.pencil().mass(), NULL_PIVOT).ok_or(NodalError::MassIndefinite)?;
        let massless = Massless::new(model, &factor)?;
        let columns = conditions.columns(model, moving, &mass_rigid)?;
        if *conditions != ReferenceConditions::MeanAxes && massless.n_vectors() > 0 {
            return Err(NodalError::HeldMassSingular { null_vectors: massless.n_vectors() });
        }

        let (_, length) = centre_and_length(&model.nodes().positions);
        // The conditions fix the frame if C R is regular.
        let conditions_rigid = products(&rigid, &columns, moving);
        let independent = match conditions {
            ReferenceConditions::MeanAxes => true,
            ReferenceConditions::Held(_) | ReferenceConditions::AtRest(_) => {
                let values = equilibrated(&conditions_rigid, length).singular_values();
                values.min() > MIN_SINGULAR_VALUE_RATIO * values.max()
            }
        };
        let rigid_part = conditions_rigid.transpose().try_inverse().filter(|_| independent);
        let rigid_part = rigid_part.ok_or(NodalError::ConditionsDependent)?;
        // For mean axes C' = M R, so that M^-1 C' = R.
        let answered = match conditions {
            ReferenceConditions::MeanAxes => rigid.clone(),
            _ => answers(model, &factor, &columns, moving),
        };
        let positions = model.nodes().positions.iter().map(|x| Vector3::from(*x) - frame.origin).collect();
        let rigid_mass = products(&rigid, &mass_rigid, moving);
        Ok(Self {
            model,
            frame: *frame,
            positions,
            length,
            moving,
            directors: Directors::new(model, &rigid, &rigid_mass),
            rigid_mass,
            rigid,
            mass_rigid,
            answer: products(&columns, &answered, moving),
            answered,
            damping: model.damping(),
            modal_damping: None,
            conditions: columns,
            is_held: *conditions != ReferenceConditions::MeanAxes,
            conditions_rigid,
            rigid_part,
            factor,
            massless,
        })
    }

    /// Returns the model.
    pub fn model(&self) -> &'m FeModel {
        self.model
    }

    /// Returns the frame in its position before deformation.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns the number of entries of the factor of M below the diagonal.
    pub fn factor_entries(&self) -> usize {
        self.factor.entries()
    }

    /// Returns the number of rows N of the model.
    pub fn n_rows(&self) -> usize {
        self.rigid.len()
    }

    pub(super) fn stiffness(&self) -> &'m SymmetricMatrix {
        self.model.stiffness()
    }

    /// Computes y = M x.
    pub(super) fn weigh(&self, x: &[f64], y: &mut [f64]) {
        let pencil = self.model.pencil();
        multiply_vector(pencil.mass(), pencil.block(), x, y);
    }

    /// Computes x <- M^-1 x for x in the range of M, up to null vectors.
    pub(super) fn solve(&self, x: &mut [f64], scratch: &mut [f64]) {
        self.factor.solve_in_place(self.model.pencil().block(), x, scratch);
    }

    /// Computes y += factor omega x x at displacements.
    pub(super) fn add_turned(&self, factor: f64, omega: &Vector3<f64>, x: &[f64], y: &mut [f64]) {
        add_turned(self.model, factor, omega, x, y);
    }

    /// Returns sum_i x_i x y_i over displacements, which is B(x)'y.
    pub(super) fn moment(&self, x: &[f64], y: &[f64]) -> Vector3<f64> {
        let end = self.model.rows().displacements();
        if self.model.dimension() == 2 {
            let pairs = x[..end].as_chunks::<2>().0.iter().zip(y[..end].as_chunks::<2>().0);
            return Vector3::new(0.0, 0.0, pairs.map(|(x, y)| x[0] * y[1] - x[1] * y[0]).sum());
        }
        let mut sum = [0.0; 3];
        for (x, y) in x[..end].as_chunks::<3>().0.iter().zip(y[..end].as_chunks::<3>().0) {
            sum[0] += x[1] * y[2] - x[2] * y[1];
            sum[1] += x[2] * y[0] - x[0] * y[2];
            sum[2] += x[0] * y[1] - x[1] * y[0];
        }
        sum.into()
    }

    /// Returns B'C' at the displacements u, completed to an invertible matrix.
    pub(super) fn conditions_at(&self, u: &[f64]) -> Matrix6<f64> {
        let d = self.model.dimension();
        let mut sum = [[0.0; 6]; 3];
        let end = self.model.rows().displacements();
        for (x, c) in u[..end].chunks_exact(d).zip(self.conditions.chunks_exact(d)) {
            for j in 0..6 {
                sum[2][j] += x[0] * c[1][j] - x[1] * c[0][j];
                if d == 3 {
                    sum[0][j] += x[1] * c[2][j] - x[2] * c[1][j];
                    sum[1][j] += x[2] * c[0][j] - x[0] * c[2][j];
                }
            }
        }
        let mut matrix = self.conditions_rigid;
        for (k, row) in sum.iter().enumerate() {
            (0..6).for_each(|j| matrix[(3 + k, j)] += row[j]);
        }
        matrix
    }

    /// Computes x += factor B_r nu at the displacements u.
    pub(super) fn add_frame(&self, factor: f64, nu: &Vector6<f64>, u: &[f64], x: &mut [f64]) {
        add_motion(&self.rigid, factor, nu, x);
        self.add_turned(factor, &nu.fixed_rows::<3>(3).into_owned(), u, x);
    }

    /// Returns B_r'x at the displacements u.
    pub(super) fn onto_frame(&self, u: &[f64], x: &[f64]) -> Vector6<f64> {
        let mut both = sums(&self.rigid, x);
        let mut angular = both.fixed_rows_mut::<3>(3);
        angular += self.moment(u, x);
        both
    }

    /// Returns (C R)^-1 C u, the rigid motion contained in displacements.
    pub(super) fn rigid_motion(&self, u: &[f64]) -> Vector6<f64> {
        self.rigid_part * sums(&self.conditions, u)
    }

    /// Removes the rigid motion, u - R (C R)^-1 C u, and returns it.
    pub(super) fn take_rigid(&self, u: &mut [f64]) -> Vector6<f64> {
        let part = self.rigid_motion(u);
        add_motion(&self.rigid, -1.0, &part, u);
        part
    }

    /// Returns (V, omega) in model axes, without components that a plane body does not have.
    pub(super) fn in_model(&self, linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
        let (linear, angular) = (self.frame.axes * linear, self.frame.axes * angular);
        let both = Vector6::from_iterator(linear.iter().chain(&angular).copied());
        Vector6::from_fn(|k, _| if self.moving.contains(&k) { both[k] } else { 0.0 })
    }
}

/// Returns M^-1 C'.
fn answers(model: &FeModel, factor: &SparseLdl, columns: &Motions, moving: &[usize]) -> Motions {
    let n = columns.len();
    let (mut answered, mut scratch) = (vec![[0.0; 6]; n], vec![0.0; n]);
    for &motion in moving {
        let mut column: Vec<f64> = columns.iter().map(|row| row[motion]).collect();
        factor.solve_in_place(model.pencil().block(), &mut column, &mut scratch);
        answered.iter_mut().zip(column).for_each(|(row, value)| row[motion] = value);
    }
    answered
}

/// Computes y += factor omega x x at the displacements of the rows of `model`.
fn add_turned(model: &FeModel, factor: f64, omega: &Vector3<f64>, x: &[f64], y: &mut [f64]) {
    let end = model.rows().displacements();
    let w = omega * factor;
    if model.dimension() == 2 {
        for (x, y) in x[..end].as_chunks::<2>().0.iter().zip(y[..end].as_chunks_mut::<2>().0) {
            y[0] -= w.z * x[1];
            y[1] += w.z * x[0];
        }
        return;
    }
    for (x, y) in x[..end].as_chunks::<3>().0.iter().zip(y[..end].as_chunks_mut::<3>().0) {
        y[0] += w.y * x[2] - w.z * x[1];
        y[1] += w.z * x[0] - w.x * x[2];
        y[2] += w.x * x[1] - w.y * x[0];
    }
}

/// Returns A'B of two sets of motions, with ones on the diagonal for motions that do not exist.
pub(super) fn products(a: &Motions, b: &Motions, moving: &[usize]) -> Matrix6<f64> {
    let mut sum = Matrix6::zeros();
    for (a, b) in a.iter().zip(b) {
        sum += Vector6::from(*a) * Vector6::from(*b).transpose();
    }
    (0..6).filter(|k| !moving.contains(k)).for_each(|k| sum[(k, k)] = 1.0);
    sum
}

/// Returns R'C' with rotations divided by the `length` of the body and columns scaled to unit size.
fn equilibrated(matrix: &Matrix6<f64>, length: f64) -> Matrix6<f64> {
    let mut scaled = *matrix;
    scaled.fixed_rows_mut::<3>(3).unscale_mut(length);
    for mut column in scaled.column_iter_mut() {
        let size = column.norm();
        if size > 0.0 {
            column.unscale_mut(size);
        }
    }
    scaled
}

// Damping of modes as forces on nodes.

/// Damping matrix D = W G W' with W = M Psi (N x nf): the modal damping of a body as forces on the nodes of
/// its model. With G = m_ff^-1 D_ff m_ff^-1 and m_ff = Psi'M Psi, Psi'D Psi = D_ff; for mass-normalised
/// modes D = sum_j 2 zeta_j omega_j (M psi_j)(M psi_j)'. Motions M-orthogonal to the modes are not damped.
#[derive(Debug, Clone)]
pub(super) struct ModalDamping {
    /// W.
    weighted: Mat<f64>,
    /// G.
    matrix: DMatrix<f64>,
}

/// Work arrays for the products of [`ModalDamping`].
#[derive(Debug, Clone, Default)]
pub(super) struct Amplitudes {
    of_modes: Vec<f64>,
    forces: Vec<f64>,
}

impl ModalDamping {
    /// Returns the damping of `body`; the inner option is `None` without damping. Returns `None` if the
    /// body has other rows than `model`, or modes that depend on each other.
    pub(super) fn new(model: &FeModel, body: &FlexBody) -> Option<Option<Self>> {
        let vectors = body.vectors_of(model)?;
        let damping = body.damping();
        let nf = damping.nrows();
        let damping = DMatrix::from_fn(nf, nf, |i, j| damping[(i, j)]);
        if damping.iter().all(|entry| *entry == 0.0) {
            return Some(None);
        }
        let mass = body.invariants().modal_mass();
        let mass = DMatrix::from_fn(nf, nf, |i, j| mass[(i, j)]).cholesky()?;
        let half = mass.solve(&damping);
        let matrix = mass.solve(&half.transpose());
        Some(Some(Self { weighted: model.pencil().apply_mass(vectors.as_ref()), matrix }))
    }

    pub(super) fn workspace(&self) -> Amplitudes {
        let zeros = || vec![0.0; self.weighted.ncols()];
        Amplitudes { of_modes: zeros(), forces: zeros() }
    }

    /// Computes forces += factor D ud.
    pub(super) fn add(&self, factor: f64, ud: &[f64], forces: &mut [f64], workspace: &mut Amplitudes) {
        for (j, amplitude) in workspace.of_modes.iter_mut().enumerate() {
            let column = self.weighted.col_as_slice(j);
            *amplitude = factor * column.iter().zip(ud).map(|(w, u)| w * u).sum::<f64>();
        }
        for (i, force) in workspace.forces.iter_mut().enumerate() {
            *force = self.matrix.column(i).iter().zip(&workspace.of_modes).map(|(g, a)| g * a).sum();
        }
        for (j, force) in workspace.forces.iter().enumerate().filter(|(_, force)| **force != 0.0) {
            let column = self.weighted.col_as_slice(j);
            forces.iter_mut().zip(column).for_each(|(sum, w)| *sum += force * w);
        }
    }
}
