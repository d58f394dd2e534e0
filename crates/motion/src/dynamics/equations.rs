//! Constants of the equations of motion, laid out for their evaluation; as plain matrices, for files that other programs
//! evaluate; and the number of multiplications in an evaluation.

use super::kernels::{ModalMass, ModalMatrix, Panels};
use faer::Mat;
use flexbody_body::flex_body::{FlexBody, TermGroups};
use flexbody_body::invariants::Invariants;
use flexbody_model::LoadKind;
use nalgebra::{Matrix3, Vector3};

/// Largest deviation of m_ff from the identity that counts as rounding for mass-normalised modes.
const MASS_ROUNDING: f64 = 1e-12;

/// Largest off-diagonal entry of K_ff and D, relative to sqrt(a_ii a_jj), that counts as rounding of
/// products with K for modes of very different stiffness.
const STIFFNESS_ROUNDING: f64 = 1e-10;

/// Order of the entries of a symmetric 3x3 matrix in all arrays here.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// First rows of W0, W1, C1 and C2 in [`EquationsOfMotion::linear`], and their total.
pub(super) const W0: usize = 0;
pub(super) const W1: usize = 9;
pub(super) const C1: usize = 15;
const C2: usize = 18;
pub(super) const LINEAR: usize = 21;

/// Equations of motion of one flexible body in constant invariants (theory section 6, which is section 3
/// for solids).
///
/// ```text
/// Mc(q) nu' + h_nu + (0, 0, K_ff q + D qd) = (F, tau, Q),    nu = (V, omega, qd)
/// ```
///
/// V is the velocity of the origin of the body frame, omega the angular velocity of the frame, both in body
/// axes. F, tau (about the origin) and Q are the generalised forces with the power F'V + tau'omega + Q'qd.
/// Vectors have 6 + nf entries in this order, for a plane body 3 + nf: V_x, V_y, omega_z, qd. Units are
/// those of the body: length/time, 1/time and, since q are the amplitudes of mass-normalised modes,
/// mass^(1/2) length/time.
///
/// [`Evaluation`](super::Evaluation) evaluates the equations, which hold for the mass matrices of solids
/// and for general ones. Geometric stiffness of the body (theory 7.3) for spin, acceleration and angular
/// acceleration is part of the kinetic energy. It belongs to motion of second order in q, which adds
/// q'K^a_k q / 2 to the first moment and q'K^alpha_k to row k of C(q), and subtracts q'K^omega(omega) q / 2
/// from T (theory 7.4).
///
/// ```
/// # fn check(body: &flexbody_body::flex_body::FlexBody) {
/// use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
/// let equations = EquationsOfMotion::new(body, Terms::ALL);
/// let mut evaluation = Evaluation::new(&equations);
/// let (q, nu) = (vec![0.0; equations.n_modes()], vec![0.1; equations.n_velocities()]);
/// evaluation.set(&q, &nu);
/// let (free, mut acceleration) = (vec![0.0; nu.len()], vec![0.0; nu.len()]);
/// evaluation.accelerations(&free, &mut acceleration).expect("a body with mass");
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct EquationsOfMotion {
    /// Existing rigid motions, as indices into (V, omega).
    pub(super) rigid: &'static [usize],
    /// Axes that the body turns about.
    pub(super) axes: &'static [usize],
    /// Entries of [`PAIRS`] for these axes.
    pub(super) pairs: &'static [(usize, usize)],
    pub(super) nf: usize,
    pub(super) mass: f64,
    pub(super) first_moment: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
    /// Arrays linear in q ([`LINEAR`] x nf, row-major): W0 (row 3 k + b), W1 ([`PAIRS`]), C1, C2.
    pub(super) linear: Vec<f64>,
    /// Matrix `linear` in a layout for products.
    pub(super) linear_panels: Panels,
    /// E_ab = (W2_ab + W2_ab') / 2 for each of `pairs`, minus geometric stiffness for spin: T depends only
    /// on this part of W2.
    pub(super) w2: Option<Panels>,
    /// W3_a' for each of `axes`, with geometric stiffness for angular acceleration.
    pub(super) w3: Option<Panels>,
    /// W3_a' - W3_a, if it is not 2 W3_a' because the blocks are not skew.
    pub(super) w3_skew: Option<Panels>,
    /// Geometric stiffness for acceleration along each axis that the body moves along.
    pub(super) accelerated: Option<Panels>,
    pub(super) modal_mass: ModalMass,
    pub(super) stiffness: ModalMatrix,
    pub(super) damping: ModalMatrix,
    terms: Terms,
}

impl EquationsOfMotion {
    /// Creates the equations of `body` with those of the given terms that the body holds.
    ///
    /// Rounding is removed: m_ff within 1e-12 of the identity (for arrays of 32-bit floats within their
    /// rounding) becomes the identity; K_ff and D with off-diagonal entries below 1e-10 of sqrt(a_ii a_jj)
    /// become diagonal. D is the modal damping of the body or, if there is none, diag(2 zeta_j omega_j).
    pub fn new(body: &FlexBody, terms: Terms) -> Self {
        let parts = EquationParts::new(body, terms);
        let (invariants, nf) = (parts.invariants, parts.nf);
        let linear = parts.linear();
        let (w3, w3_skew) = parts.w3();
        Self {
            rigid: parts.rigid,
            axes: parts.axes,
            pairs: parts.pairs,
            nf,
            mass: invariants.mass(),
            first_moment: parts.first_moment(),
            inertia: parts.inertia(),
            linear_panels: Panels::new(LINEAR, nf, |row, j| linear[row * nf + j]),
            linear,
            w2: parts.w2(),
            w3,
            w3_skew,
            accelerated: parts.accelerated(),
            modal_mass: ModalMass::new(
                invariants.modal_mass().as_ref(),
                MASS_ROUNDING + body.storage().rounding(),
            ),
            stiffness: ModalMatrix::new(invariants.modal_stiffness().as_ref(), STIFFNESS_ROUNDING),
            damping: ModalMatrix::new(body.damping().as_ref(), STIFFNESS_ROUNDING),
            terms: parts.terms,
        }
    }

    /// Returns the number of modes nf.
    pub fn n_modes(&self) -> usize {
        self.nf
    }

    /// Returns the number of rigid motions: 6, for a plane body 3.
    pub fn n_rigid(&self) -> usize {
        self.rigid.len()
    }

    /// Returns the number of velocities in nu: 6 + nf, for a plane body 3 + nf.
    pub fn n_velocities(&self) -> usize {
        self.rigid.len() + self.nf
    }

    /// Returns the elastic energy q'K_ff q / 2.
    ///
    /// # Panics
    /// When the length of `q` is not the number of modes.
    pub fn elastic_energy(&self, q: &[f64]) -> f64 {
        0.5 * self.stiffness.quadratic(q)
    }

    /// Returns the terms that the equations contain.
    pub fn terms(&self) -> Terms {
        self.terms
    }

    /// Returns a row of `linear`.
    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.linear[row * self.nf..][..self.nf]
    }

    /// Returns V, omega and the modal part of a vector in the order of nu.
    pub(crate) fn split<'v>(&self, nu: &'v [f64]) -> (Vector3<f64>, Vector3<f64>, &'v [f64]) {
        assert_eq!(nu.len(), self.n_velocities(), "one entry per rigid motion and mode");
        let (rigid, modal) = nu.split_at(self.rigid.len());
        let mut both = [Vector3::zeros(); 2];
        for (&axis, &value) in self.rigid.iter().zip(rigid) {
            both[axis / 3][axis % 3] = value;
        }
        let [velocity, omega] = both;
        (velocity, omega, modal)
    }

    /// Returns row `axis` of [C1(q); C(q)].
    pub(super) fn coupling_row<'v>(&self, coupling: &'v [f64], axis: usize) -> &'v [f64] {
        &coupling[axis * self.nf..][..self.nf]
    }

    /// Returns the number of axes that the body moves along.
    pub(super) fn translations(&self) -> usize {
        if self.rigid.len() == 3 { 2 } else { 3 }
    }

    /// Computes y += factor (K_ff q + D qd).
    #[inline(always)]
    pub(super) fn add_internal(&self, factor: f64, q: &[f64], qd: &[f64], y: &mut [f64]) {
        self.stiffness.add_product(factor, q, y);
        self.damping.add_product(factor, qd, y);
    }

    /// Returns true if the modes are mass-normalised.
    pub(super) fn is_normalised(&self) -> bool {
        matches!(self.modal_mass, ModalMass::Identity)
    }

    /// Returns stiffness and damping of mode `j`, if the modes are mass-normalised.
    pub(super) fn oscillator(&self, j: usize) -> Option<(f64, f64)> {
        self.is_normalised().then(|| (self.stiffness.get(j, j), self.damping.get(j, j)))
    }

    /// Returns qd'D qd, the power dissipated by damping.
    pub(super) fn dissipation(&self, qd: &[f64]) -> f64 {
        self.damping.quadratic(qd)
    }

    /// Writes the entries of a force and a torque that belong to rigid motions of the body.
    pub(super) fn put_rigid(&self, force: Vector3<f64>, torque: Vector3<f64>, rigid: &mut [f64]) {
        let at = |axis: usize| if axis < 3 { force[axis] } else { torque[axis - 3] };
        rigid.iter_mut().zip(self.rigid).for_each(|(entry, &axis)| *entry = at(axis));
    }
}

/// Inputs for the constants of the equations: the body, the requested terms that it holds, and the axes of
/// its motion.
struct EquationParts<'b> {
    body: &'b FlexBody,
    invariants: &'b Invariants,
    nf: usize,
    rigid: &'static [usize],
    axes: &'static [usize],
    pairs: &'static [(usize, usize)],
    terms: Terms,
}

impl<'b> EquationParts<'b> {
    fn new(body: &'b FlexBody, terms: Terms) -> Self {
        let (rigid, axes, pairs): (&[usize], &[usize], &[(usize, usize)]) = if body.dimension() == 2 {
            (&[0, 1, 5], &[2], &PAIRS[2..3])
        } else {
            (&[0, 1, 2, 3, 4, 5], &[0, 1, 2], &PAIRS)
        };
        let invariants = body.invariants();
        let terms = terms.held(invariants.groups());
        Self { body, invariants, nf: body.n_modes(), rigid, axes, pairs, terms }
    }

    fn turns(&self, a: usize) -> bool {
        self.axes.contains(&a)
    }

    fn moves(&self, k: usize) -> bool {
        self.rigid.contains(&k)
    }

    fn first_moment(&self) -> Vector3<f64> {
        Vector3::from_fn(|k, _| if self.moves(k) { self.invariants.first_moment()[k] } else { 0.0 })
    }

    fn inertia(&self) -> Matrix3<f64> {
        let inertia = self.invariants.inertia();
        Matrix3::from_fn(|k, l| {
            if self.turns(k) && self.turns(l) { 0.5 * (inertia[(k, l)] + inertia[(l, k)]) } else { 0.0 }
        })
    }

    /// Returns the rows of [`EquationsOfMotion::linear`].
    fn linear(&self) -> Vec<f64> {
        let (invariants, nf) = (self.invariants, self.nf);
        let (w0, c2) = (invariants.w0(), invariants.c2());
        let w1 = invariants.w1().filter(|_| self.terms.w1);
        let entry = |row: usize, j: usize| match row {
            row if row < W1 => {
                let (k, b) = (row / 3, row % 3);
                if self.moves(k) && self.turns(b) { w0[(k, b * nf + j)] } else { 0.0 }
            }
            row if row < C1 => {
                let (a, b) = PAIRS[row - W1];
                let mean = |w1: &Mat<f64>| 0.5 * (w1[(a, b * nf + j)] + w1[(b, a * nf + j)]);
                w1.as_ref().filter(|_| self.turns(a) && self.turns(b)).map_or(0.0, mean)
            }
            row if row < C2 => f64::from(self.moves(row - C1)) * invariants.c1()[(row - C1, j)],
            row => f64::from(self.turns(row - C2)) * c2[(row - C2, j)],
        };
        (0..LINEAR * nf).map(|at| entry(at / nf, at % nf)).collect()
    }

    /// Returns the symmetric parts of W2, minus geometric stiffness for spin.
    fn w2(&self) -> Option<Panels> {
        let nf = self.nf;
        let spin = self.geometric(LoadKind::Spin);
        let w2 = self.invariants.w2().filter(|_| self.terms.w2);
        (w2.is_some() || spin.is_some()).then(|| {
            self.stacked(self.pairs.len(), &|at, i, j| {
                let (a, b) = self.pairs[at];
                let own = w2
                    .as_ref()
                    .map_or(0.0, |w2| 0.5 * (w2[(a * nf + i, b * nf + j)] + w2[(a * nf + j, b * nf + i)]));
                let component = LoadKind::SPIN.iter().position(|&axes| axes == (a, b));
                let taken = spin.as_ref().zip(component).map_or(0.0, |(spin, c)| spin(c, i, j));
                // w'E w contains both orders of a pair of axes, the load only one.
                own - if a == b { taken } else { 0.5 * taken }
            })
        })
    }

    /// Returns W3' with geometric stiffness for angular acceleration, and W3' - W3 if it is not twice W3'.
    fn w3(&self) -> (Option<Panels>, Option<Panels>) {
        let (nf, axes) = (self.nf, self.axes);
        let turned = self.geometric(LoadKind::AngularAcceleration);
        if !(self.terms.w3 || turned.is_some()) {
            return (None, None);
        }
        let w3 = self.invariants.w3().filter(|_| self.terms.w3);
        // (W3_a)_ij and (W3_a)_ji.
        let entries = |at: usize, i: usize, j: usize| {
            let a = axes[at];
            w3.as_ref().map_or((0.0, 0.0), |w3| (w3[(a * nf + i, j)], w3[(a * nf + j, i)]))
        };
        let general = self.invariants.general().is_some();
        let transposed = self.stacked(axes.len(), &|at, i, j| {
            let (own, mirrored) = entries(at, i, j);
            // The blocks of a solid are skew: W3 + W3' is rounding.
            let w3 = if general { mirrored } else { 0.5 * (mirrored - own) };
            w3 + turned.as_ref().map_or(0.0, |turned| turned(axes[at], i, j))
        });
        let skew = |at: usize, i: usize, j: usize| {
            let (own, mirrored) = entries(at, i, j);
            mirrored - own
        };
        (Some(transposed), (general || turned.is_some()).then(|| self.stacked(axes.len(), &skew)))
    }

    /// Returns the geometric stiffness for acceleration.
    fn accelerated(&self) -> Option<Panels> {
        let along = self.geometric(LoadKind::Acceleration)?;
        Some(self.stacked(if self.body.dimension() == 2 { 2 } else { 3 }, &along))
    }

    fn geometric(&self, kind: LoadKind) -> Option<impl Fn(usize, usize, usize) -> f64 + use<'b>> {
        let is_used = match kind {
            LoadKind::Spin => self.terms.stiffens_by_spin(),
            _ => self.terms.geometric_stiffness,
        };
        let which = if is_used { Stiffening::All } else { Stiffening::OfInertia };
        stiffness_under(self.body, &kind, which)
    }

    /// Returns `count` square matrices stacked vertically, with the entries (matrix, i, j).
    fn stacked(&self, count: usize, entry: &dyn Fn(usize, usize, usize) -> f64) -> Panels {
        let block = |at| Mat::from_fn(self.nf, self.nf, |i, j| entry(at, i, j));
        Panels::stacked(&(0..count).map(block).collect::<Vec<_>>())
    }
}

// Stiffness of inertia and geometric stiffness of a body, in the form for the equations of motion.

/// Selection of the stiffness of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stiffening {
    /// Stiffness of inertia only, which is a part of the kinetic energy.
    OfInertia,
    /// Stiffness of inertia and geometric stiffness together.
    All,
}

/// Returns the entries (component, i, j) of the stiffness for a kind of load, zero for components that are
/// not given; `None` if no component is given.
pub fn stiffness_under<'b>(
    body: &'b FlexBody,
    kind: &LoadKind,
    which: Stiffening,
) -> Option<impl Fn(usize, usize, usize) -> f64 + use<'b>> {
    let mut matrices: Vec<Vec<&'b Mat<f64>>> = vec![Vec::new(); kind.components().len()];
    let of_inertia = body.inertia_stiffness().into_iter().flat_map(|own| &own.stiffness);
    let given = body.geometric_stiffness().iter().filter(|_| which == Stiffening::All);
    for stiffness in of_inertia.chain(given).filter(|stiffness| stiffness.load.kind == *kind) {
        matrices[stiffness.load.component].push(&stiffness.matrix);
    }
    matrices.iter().any(|known| !known.is_empty()).then_some(move |component: usize, i, j| {
        matrices[component].iter().map(|matrix| 0.5 * (matrix[(i, j)] + matrix[(j, i)])).sum()
    })
}

/// Included terms, by group of the kinetic energy (theory section 7).
///
/// A group is included or dropped in all places: mass matrix, inertia forces, momenta and energy. The
/// result is the equations of motion of a truncated kinetic energy, which conserve that energy and both
/// momenta for any choice. m, c, I0, C1, C2, W0 and m_ff are always included. Without W2, W3 and geometric
/// stiffness the cost of an evaluation is proportional to nf instead of nf^2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Terms {
    /// W1: inertia linear in q, and the constant centrifugal load of the modes.
    pub w1: bool,
    /// W2: inertia quadratic in q, and the centrifugal load that grows with q.
    pub w2: bool,
    /// W3: coupling of rotation and modes through q, and the Coriolis force among modes.
    pub w3: bool,
    /// Geometric stiffness for the motion of the frame and for forces at interfaces (theory 7.4), if the
    /// body has it. The stress of the spin stiffens as W2 softens, so that its stiffness acts with W2 only.
    pub geometric_stiffness: bool,
    /// True if the geometric stiffness of spin acts without W2 too, for a comparison of motions with and without it.
    pub stress_without_w2: bool,
}

impl Terms {
    /// All terms that the body has: the exact equations.
    pub const ALL: Self =
        Self { w1: true, w2: true, w3: true, geometric_stiffness: true, stress_without_w2: false };
    /// No term that depends on the deformation except the first moment c + C1 q.
    pub const NONE: Self =
        Self { w1: false, w2: false, w3: false, geometric_stiffness: false, stress_without_w2: false };

    /// Returns true if the geometric stiffness of spin acts.
    pub fn stiffens_by_spin(self) -> bool {
        self.geometric_stiffness && (self.w2 || self.stress_without_w2)
    }

    /// Returns the terms that a body with `groups` can provide.
    pub fn held(self, groups: TermGroups) -> Self {
        Self { w1: self.w1 && groups.w1, w2: self.w2 && groups.w2, w3: self.w3 && groups.w3, ..self }
    }
}

impl Default for Terms {
    /// Returns [`Terms::ALL`]: terms are dropped only on request.
    fn default() -> Self {
        Self::ALL
    }
}

// Constants of the equations as plain matrices, for files that other programs evaluate.

/// Constants of [`EquationsOfMotion`] for the rigid motions that the body has: T translations (3, in the
/// plane 2) and A axes that it turns about (3, in the plane 1), with P pairs of axes xx, yy, zz, yz, xz, xy
/// (in the plane zz). Stacked matrices are nf x nf each.
pub struct Constants {
    /// (m, c, I0): 1 + T + P entries.
    pub rigid: Vec<f64>,
    /// Arrays linear in q, one row each: W0 (translation by translation, T A rows), W1 (P rows, if held),
    /// C1 (T), C2 (A).
    pub linear: Mat<f64>,
    /// E of each pair (6.7), minus geometric stiffness for spin (7.4).
    pub w2: Option<Mat<f64>>,
    /// W3' of each axis, with geometric stiffness for angular acceleration.
    pub w3: Option<Mat<f64>>,
    /// W3' - W3 of each axis; `None` if it is twice `w3` because the blocks are skew.
    pub w3_skew: Option<Mat<f64>>,
    /// Geometric stiffness for acceleration along each translation.
    pub acceleration: Option<Mat<f64>>,
    /// m_ff and L of m_ff = L L'; `None` for the identity.
    pub modal_mass: Option<(Mat<f64>, Option<Mat<f64>>)>,
    /// K_ff: full (nf x nf), or its diagonal (nf x 1).
    pub stiffness: Mat<f64>,
    /// D: full (nf x nf), or its diagonal (nf x 1); `None` without damping.
    pub damping: Option<Mat<f64>>,
}

impl EquationsOfMotion {
    /// Returns the constants.
    pub fn constants(&self) -> Constants {
        let (nf, translations) = (self.nf, self.translations());
        let has_w1 = self.terms().w1;
        let pair_rows = |first: usize| {
            let own = |at: usize| self.axes.len() == 3 || at == 2;
            (0..6).filter(move |&at| own(at)).map(move |at| first + at)
        };
        let w0 = (0..translations).flat_map(|k| self.axes.iter().map(move |b| W0 + 3 * k + b));
        let w1 = pair_rows(W1).filter(|_| has_w1);
        let c2 = self.axes.iter().map(|a| C2 + a);
        let rows: Vec<usize> = w0.chain(w1).chain((0..translations).map(|k| C1 + k)).chain(c2).collect();

        let moment = self.first_moment.iter().take(translations).copied();
        let inertia = self.pairs.iter().map(|&pair| self.inertia[pair]);
        let stacked = |panels: &Option<Panels>, count: usize| {
            let panels = panels.as_ref()?;
            let rows: Vec<Vec<f64>> = (0..count * nf).map(|row| panels.row(row).collect()).collect();
            Some(Mat::from_fn(count * nf, nf, |row, j| rows[row][j]))
        };
        Constants {
            rigid: [self.mass].into_iter().chain(moment).chain(inertia).collect(),
            linear: Mat::from_fn(rows.len(), nf, |row, j| self.row(rows[row])[j]),
            w2: stacked(&self.w2, self.pairs.len()),
            w3: stacked(&self.w3, self.axes.len()),
            w3_skew: stacked(&self.w3_skew, self.axes.len()),
            acceleration: stacked(&self.accelerated, translations),
            modal_mass: match &self.modal_mass {
                ModalMass::Identity => None,
                ModalMass::Full { matrix, factor } => {
                    let lower = |at: &Vec<f64>| {
                        Mat::from_fn(nf, nf, |i, j| if j <= i { at[i * nf + j] } else { 0.0 })
                    };
                    let matrix = Mat::from_fn(nf, nf, |i, j| matrix.get(i, j));
                    Some((matrix, factor.as_ref().map(lower)))
                }
            },
            stiffness: cheapest(&self.stiffness, nf),
            damping: Some(cheapest(&self.damping, nf))
                .filter(|d| d.col_iter().any(|column| column.iter().any(|value| *value != 0.0))),
        }
    }
}

fn cheapest(matrix: &ModalMatrix, nf: usize) -> Mat<f64> {
    match matrix {
        ModalMatrix::Diagonal(diagonal) => Mat::from_fn(nf, 1, |i, _| diagonal[i]),
        ModalMatrix::Full { .. } => Mat::from_fn(nf, nf, |i, j| matrix.get(i, j)),
    }
}

impl EquationsOfMotion {
    /// Returns the number of multiplications of one evaluation with
    /// [`Evaluation::set`](super::Evaluation::set) and
    /// [`Evaluation::accelerations`](super::Evaluation::accelerations): one call of an explicit integrator,
    /// here or in the momenta of a motion.
    ///
    /// Counted from the arrays in memory, including the rows that pad a panel. With nf modes, r rigid
    /// motions, a axes and p pairs of axes to turn about, and t axes to move along:
    ///
    /// | what | multiplications |
    /// |---|---|
    /// | terms linear in q | 2 rows nf, and (3 + 9) nf and, with W1, 6 nf in momenta and forces |
    /// | W2 | rows nf + 3 p nf |
    /// | W3 | 2 rows nf + 2 a nf; skew blocks of their own: rows nf more |
    /// | geometric stiffness for acceleration | 2 rows nf + 5 t nf |
    /// | elimination of the modes | (r (r + 1) / 2 + 2 r) nf, and r + 2 solutions with the factor of a full m_ff |
    /// | K_ff and D | 2 nf each, or nf (nf + 1) where they are full |
    ///
    /// Some hundred operations with 3-vectors and 6 x 6 matrices, independent of nf, and the forces of the
    /// surroundings are not counted.
    pub fn multiplications(&self) -> usize {
        let (nf, r, a, t) = (self.nf, self.rigid.len(), self.axes.len(), self.translations());
        let panels = |panels: &Option<Panels>| panels.as_ref().map_or(0, |panels| panels.padded_rows() * nf);
        let there = |panels: &Option<Panels>, count: usize| if panels.is_some() { count * nf } else { 0 };
        let w1 = if self.terms().w1 { PAIRS.len() * nf } else { 0 };
        let linear = 2 * self.linear_panels.padded_rows() * nf + (3 + 9) * nf + w1;
        let w2 = panels(&self.w2) + there(&self.w2, 3 * self.pairs.len());
        let w3 = 2 * panels(&self.w3) + there(&self.w3, 2 * a) + panels(&self.w3_skew);
        let accelerated = 2 * panels(&self.accelerated) + there(&self.accelerated, 5 * t);
        let triangles = match &self.modal_mass {
            ModalMass::Identity => 0,
            ModalMass::Full { .. } => (r + 2) * nf * (nf + 1) / 2,
        };
        let elimination = (r * (r + 1) / 2 + 2 * r) * nf + triangles;
        let internal = [&self.stiffness, &self.damping].map(|matrix| match matrix {
            ModalMatrix::Diagonal(_) => 2 * nf,
            ModalMatrix::Full { .. } => nf * (nf + 1),
        });
        linear + w2 + w3 + accelerated + elimination + internal[0] + internal[1]
    }
}
