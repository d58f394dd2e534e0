//! Damping of modes as forces on nodes.

use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_model::FeModel;
use nalgebra::DMatrix;

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
