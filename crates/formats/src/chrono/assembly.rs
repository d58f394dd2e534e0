//! The coordinates of an assembly of Chrono in which its automatic gravity is that of the body.
//!
//! `ChModalAssembly` multiplies M with the acceleration of gravity on the translations of all nodes, internal ones
//! too, and keeps the rows of translations alone. Amplitudes of modes in the place of internal translations get a
//! weight that they do not have, and torques of gravity at the boundary nodes are lost. Both are right if gravity
//! on all translations is a rigid translation of the body, and if M times it has no rows of rotations.
//!
//! The translation of the first internal node is therefore the displacement of the centre of mass,
//! `N^-1 R' M q`, with R the rigid translations in the coordinates q and N = R' M R. All of the weight then acts
//! there, and the reduction of Chrono hands it on to boundary nodes and modes with its torques. Translations of
//! further internal nodes are amplitudes of modes on top of that displacement, rotations are amplitudes alone.
//!
//! The modes need not move the centre of mass in all directions. Three further coordinates, displacements of the mass
//! that moves in no mode (the *rest*), complete the basis, and modes that are coupled to nothing fill the last node:
//! the eigensolvers of Chrono want fewer modes than coordinates, and a mass matrix that is positive definite.
//! Frequencies of both lie above those of all modes: a reduction to as many modes as the body has leaves them out and
//! is the body again.

use crate::export::interface_matrices::InterfaceMatrices;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_linalg::combine;
use nalgebra::Matrix3;

/// Frequency of the rest mass over the highest of the fixed-interface modes. Higher values cost digits of the
/// stiffness: 4 leaves 3e-11 of a deflection, 10 leaves 4e-10 (cantilever of two interfaces and six modes).
const REST_FREQUENCY: f64 = 4.0;

/// Frequency of the modes that fill the last node over that of the rest mass.
const FILL_FREQUENCY: f64 = 2.0;

/// Share of the mass that is added to the rest mass, so that the basis is complete where the modes have all mass.
const REST_SHARE: f64 = 0.01;

/// Matrices of boundary nodes and internal nodes, six coordinates each.
pub(super) struct Assembly {
    /// M.
    pub(super) mass: Mat<f64>,
    /// K.
    pub(super) stiffness: Mat<f64>,
    /// R, of a body with damping.
    pub(super) damping: Option<Mat<f64>>,
    /// Number of fixed-interface modes.
    pub(super) n_modes: usize,
}

impl Assembly {
    /// Number of modes that Chrono must be asked for. Its eigensolvers find one at least: of a body without
    /// fixed-interface modes those of the rest mass are requested.
    pub(super) fn modes_to_request(n_modes: usize) -> usize {
        if n_modes == 0 { 3 } else { n_modes }
    }

    /// Changes the coordinates of `given`.
    ///
    /// # Errors
    /// [`ExportLoses`](Code::ExportLoses) if the mass matrix is none of a body, or numbers leave double precision.
    pub(super) fn of(given: &InterfaceMatrices<'_>) -> Result<Self> {
        let refuse = |what: &str| {
            let message = format!("chrono needs the centre of mass of the body: {what}");
            let help = "convert the model again: flexbody convert --basis craig-bampton";
            Diagnostic::new(Code::ExportLoses, message).with_help(help)
        };
        let extended = Extended::of(given);
        let change = extended.change().ok_or_else(|| {
            refuse("its coordinates have no mass, or its fixed-interface modes have more than all of it")
        })?;
        let in_nodes = |a: &Mat<f64>| {
            let half = combine(change.transpose(), a.as_ref());
            let whole = combine(half.as_ref(), change.as_ref());
            Mat::from_fn(whole.nrows(), whole.ncols(), |i, j| 0.5 * (whole[(i, j)] + whole[(j, i)]))
        };
        let (mass, stiffness) = (in_nodes(&extended.mass), in_nodes(&extended.stiffness));
        let damping = given.damping.as_ref().map(|damping| in_nodes(&extended.padded(damping)));
        let finite = |a: &Mat<f64>| a.col_iter().all(|column| column.iter().all(|v| v.is_finite()));
        if ![Some(&mass), Some(&stiffness), damping.as_ref()].into_iter().flatten().all(finite) {
            return Err(refuse("its matrices leave the range of double precision").into());
        }
        Ok(Self { mass, stiffness, damping, n_modes: extended.n_modes })
    }
}

/// The matrices of a body with the rest mass: coordinates of the interfaces, amplitudes of the fixed-interface modes,
/// amplitudes that fill the last node, three displacements of the rest mass.
struct Extended {
    /// Number of coordinates of the interfaces.
    n_boundary: usize,
    /// Number of fixed-interface modes.
    n_modes: usize,
    /// Number of amplitudes that fill the last node.
    n_fill: usize,
    mass: Mat<f64>,
    stiffness: Mat<f64>,
    /// Momentum of rigid translations R' M, without the rest mass (3 x coordinates of the body).
    momentum: Mat<f64>,
    /// N = R' M R.
    total: Matrix3<f64>,
    /// Momentum of rigid translations in the displacements of the rest mass.
    rest: Matrix3<f64>,
}

impl Extended {
    fn of(given: &InterfaceMatrices<'_>) -> Self {
        let n_boundary = 6 * given.frames.len();
        let m = given.mass;
        let n_modes = m.nrows() - n_boundary;
        let momentum = Mat::from_fn(3, m.nrows(), |a, j| (a..n_boundary).step_by(6).map(|i| m[(i, j)]).sum());
        let total = Matrix3::from_fn(|a, b| (b..n_boundary).step_by(6).map(|j| momentum[(a, j)]).sum());
        let modal = momentum.subcols(n_boundary, n_modes);
        let of_modes = combine(modal, modal.transpose());
        // Momentum that moves in no mode, R'(M_BB - M_Bf M_fB) R, and a share of all.
        let rest = (1.0 + REST_SHARE) * total - Matrix3::from_fn(|a, b| of_modes[(a, b)]);
        let mut extended = Self {
            n_boundary,
            n_modes,
            n_fill: (n_modes + 3).next_multiple_of(6) - n_modes - 3,
            mass: Mat::new(),
            stiffness: Mat::new(),
            momentum,
            total,
            rest,
        };
        (extended.mass, extended.stiffness) = extended.matrices(given);
        extended
    }

    /// Returns M and K of all coordinates.
    fn matrices(&self, given: &InterfaceMatrices<'_>) -> (Mat<f64>, Mat<f64>) {
        let (nb, nf) = (self.n_boundary, self.n_modes);
        let (mut mass, mut stiffness) = (self.padded(given.mass), self.padded(given.stiffness));
        let (filled, first) = (nb + nf, self.size() - 3);
        let square = self.rest_frequency_squared(given);
        // Modes that fill the last node move alone.
        for i in filled..first {
            (mass[(i, i)], stiffness[(i, i)]) = (1.0, FILL_FREQUENCY.powi(2) * square);
        }
        // The rest mass moves with the interfaces, R'(M_BB - M_Bf M_fB), and in no mode.
        let modal = self.momentum.as_ref().subcols(nb, nf);
        let of_modes = combine(modal, given.mass.as_ref().submatrix(nb, 0, nf, nb));
        for a in 0..3 {
            for j in 0..nb {
                let coupling = (1.0 + REST_SHARE) * self.momentum[(a, j)] - of_modes[(a, j)];
                (mass[(first + a, j)], mass[(j, first + a)]) = (coupling, coupling);
            }
            for b in 0..3 {
                // Twice what its momentum is: M stays positive.
                mass[(first + a, first + b)] = 2.0 * self.rest[(a, b)];
                stiffness[(first + a, first + b)] = 2.0 * square * self.rest[(a, b)];
            }
        }
        (mass, stiffness)
    }

    /// Number of coordinates.
    fn size(&self) -> usize {
        self.n_boundary + self.n_modes + self.n_fill + 3
    }

    /// Returns a matrix of the body with zeros for all other coordinates.
    fn padded(&self, a: &Mat<f64>) -> Mat<f64> {
        let inner = self.n_boundary + self.n_modes;
        let of_body = |i: usize, j: usize| if i < inner && j < inner { a[(i, j)] } else { 0.0 };
        Mat::from_fn(self.size(), self.size(), of_body)
    }

    /// Eigenvalue of the rest mass: above those of all fixed-interface modes; without any, above what the interfaces
    /// vibrate with when all others are held.
    fn rest_frequency_squared(&self, given: &InterfaceMatrices<'_>) -> f64 {
        let all = if self.n_modes == 0 { 0..self.n_boundary } else { self.n_boundary..given.mass.nrows() };
        let highest = all.map(|i| given.stiffness[(i, i)] / given.mass[(i, i)]);
        REST_FREQUENCY.powi(2) * highest.filter(|v| v.is_finite()).fold(0.0, f64::max)
    }

    /// Returns all coordinates for those of the nodes (square), or `None` if the mass is not positive.
    fn change(&self) -> Option<Mat<f64>> {
        let (nb, nf) = (self.n_boundary, self.n_modes + self.n_fill);
        self.total.cholesky()?;
        let inverse = self.rest.cholesky()?.inverse();
        let mut change = Mat::zeros(self.size(), self.size());
        (0..nb).for_each(|i| change[(i, i)] = 1.0);
        // The nodes have amplitudes divided by sqrt(m): lengths, as the first three columns.
        let scale = (self.total.trace() / 3.0).sqrt();
        for k in 0..nf {
            let (row, column) = (nb + k, nb + 3 + k);
            change[(row, column)] = scale;
            if (3 + k) % 6 < 3 {
                change[(row, nb + k % 3)] = -scale;
            }
        }
        // N u = R' M q + rest z for the displacement u of the first internal node gives z.
        let of_body = combine(self.momentum.as_ref(), change.as_ref().subrows(0, nb + self.n_modes));
        let moment = |a: usize, j: usize| {
            let own = if (nb..nb + 3).contains(&j) { self.total[(a, j - nb)] } else { 0.0 };
            own - of_body[(a, j)]
        };
        for j in 0..change.ncols() {
            for a in 0..3 {
                change[(nb + nf + a, j)] = (0..3).map(|b| inverse[(a, b)] * moment(b, j)).sum();
            }
        }
        Some(change)
    }
}
