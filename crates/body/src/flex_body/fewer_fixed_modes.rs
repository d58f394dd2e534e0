//! Craig-Bampton bodies with some of their fixed-interface modes (theory section 5).
//!
//! A body with the interface coordinates c = [u_b; eta] = B p of its modes leaves out the fixed-interface modes D by
//! B_D p = 0: rigid motions have no amplitudes eta, so that they stay. The new modes are those of K in the null space of
//! B_D. All motions of the interfaces stay in the span, and with them the static response to loads at the interfaces; the
//! body is that of a conversion with these fixed-interface modes alone.

use super::modal_change::ModalChange;
use super::{Certificate, FixedInterface, FlexBody, InterfaceCoordinates, InternalRows, Storage};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_linalg::{combine, dense_cholesky, solve_lower};
use flexbody_model::GeometricStiffness;

impl FlexBody {
    /// Returns the amplitudes eta of the fixed-interface modes in each mode (their number x nf); `None` if the body has no
    /// interface coordinates, or no fixed-interface modes.
    pub fn fixed_interface_amplitudes(&self) -> Option<Mat<f64>> {
        let coordinates = self.coordinates()?;
        let rows = amplitudes(coordinates);
        (!rows.is_empty() && self.certificate().fixed_interface.is_some())
            .then(|| picked(&coordinates.of_modes, &rows))
    }

    /// Returns the deformation of each fixed-interface mode with amplitude 1 in the modes (nf x their number), relative to
    /// the frame: B'M e. `None` as for [`FlexBody::fixed_interface_amplitudes`].
    pub fn fixed_interface_shapes(&self) -> Option<Mat<f64>> {
        let coordinates = self.coordinates()?;
        let rows = amplitudes(coordinates);
        let momenta = picked(&coordinates.mass, &rows);
        (!rows.is_empty() && self.certificate().fixed_interface.is_some()).then(|| {
            flexbody_linalg::gram(coordinates.of_modes.as_ref(), momenta.transpose().to_owned().as_ref())
        })
    }

    /// Returns the body with the fixed-interface modes `kept` (indices, ascending) and all motions of its interfaces.
    ///
    /// Static columns of recoveries take over what the other modes contribute to the static response. The proof about the
    /// modes does not carry over; that about the fixed-interface modes does if the lowest are kept.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for a body without interface coordinates, and if the indices do not ascend or are not below
    /// the number of fixed-interface modes; the errors of [`FlexBody::new`].
    pub fn with_fixed_interface_modes(&self, kept: &[usize]) -> Result<Self> {
        Ok(self.fewer_fixed_interface_modes(kept)?.0)
    }

    /// Returns the body of [`FlexBody::with_fixed_interface_modes`], and its modes as combinations of those of this body
    /// (nf x nf').
    ///
    /// # Errors
    /// The errors of [`FlexBody::with_fixed_interface_modes`].
    pub fn fewer_fixed_interface_modes(&self, kept: &[usize]) -> Result<(Self, Mat<f64>)> {
        let (Some(coordinates), Some(fixed)) =
            (self.coordinates(), self.certificate().fixed_interface.as_ref())
        else {
            let message =
                "the body has no interface coordinates, by which fixed-interface modes are told apart";
            let help = "give a body of --basis craig-bampton with all its modes, with the frame at the centre of mass";
            return Err(refused(message.to_owned(), help));
        };
        let rows = amplitudes(coordinates);
        if kept.windows(2).any(|pair| pair[0] >= pair[1])
            || kept.last().is_some_and(|last| *last >= rows.len())
        {
            let message = format!(
                "a fixed-interface mode is asked for that is not among the {} of the body",
                rows.len()
            );
            return Err(refused(message, "give ascending numbers from 1, as in 1,3,5-9, or none"));
        }
        if kept.len() == rows.len() {
            return Ok((self.clone(), Mat::identity(self.n_modes(), self.n_modes())));
        }
        if rows.len() - kept.len() >= self.n_modes() {
            let message = "no mode is left: the only motions of the interfaces are those of the rigid body";
            return Err(refused(message.to_owned(), "keep one fixed-interface mode at least"));
        }
        let dropped: Vec<usize> =
            (0..rows.len()).filter(|at| kept.binary_search(at).is_err()).map(|at| rows[at]).collect();
        let constraint = picked(&coordinates.of_modes, &dropped);
        let change = ModalChange::in_span(self.invariants(), &null_space(&constraint))
            .map_err(|reason| refused(reason, "keep more fixed-interface modes"))?;

        let mut parts = self.changed(&change, self.conditions().clone())?.into_parts();
        // The frame is the former one: what a change of frame loses is still known.
        let old = self.parts();
        let Some(lost) = self.lost_flexibility(&constraint) else {
            let message = "the amplitudes of the fixed-interface modes depend on each other in this body";
            return Err(refused(message.to_owned(), "convert again with fewer fixed-interface modes"));
        };
        parts.recoveries = self.combined_recoveries(&change, &lost);
        parts.estimated_stiffness = old
            .estimated_stiffness
            .iter()
            .map(|one| GeometricStiffness { load: one.load.clone(), matrix: change.congruent(&one.matrix) })
            .collect();
        parts.modes.internal = old.modes.internal.as_ref().map(|internal| InternalRows {
            dofs: internal.dofs.clone(),
            shape: change.combined(&internal.shape),
        });
        parts.modes.truncation = Vec::new();
        parts.modes.provenance = vec!["combination of modes".to_owned(); parts.modes.eigenvalue.len()];
        parts.coordinates = Some(without(coordinates, &dropped, &change));
        parts.certificate = Certificate {
            remark: remark(&old.certificate, kept.len(), rows.len()),
            fixed_interface: Some(of_some(fixed, &coordinates.fixed_interface_eigenvalues(), kept)),
            ..parts.certificate
        };
        let mut body = Self::new(parts)?;
        if self.storage() == Storage::F32 {
            body = body.rounded_to_f32()?;
        }
        Ok((body, change.combined(&Mat::identity(self.n_modes(), self.n_modes()))))
    }

    /// Returns the static flexibility (nf x nf) that the modes lose by B_D p = 0, with B_D = `constraint`: that of the
    /// complement Y = Lambda^-1 B_D' in the norm of K, Y (Y'Lambda Y)^-1 Y'.
    /// `None` if the rows of B_D depend on each other.
    fn lost_flexibility(&self, constraint: &Mat<f64>) -> Option<Mat<f64>> {
        let stiffness = self.invariants().modal_stiffness();
        let complement = Mat::from_fn(constraint.ncols(), constraint.nrows(), |j, d| {
            constraint[(d, j)] / stiffness[(j, j)]
        });
        let gram = combine(constraint.as_ref(), complement.as_ref());
        let lower = dense_cholesky(gram)?;
        let half = solve_lower(&lower, &complement.transpose().to_owned());
        Some(flexbody_linalg::gram(half.as_ref(), half.as_ref()))
    }
}

/// Returns the coordinates that are amplitudes of fixed-interface modes.
fn amplitudes(coordinates: &InterfaceCoordinates) -> Vec<usize> {
    let names = coordinates.names.iter().enumerate();
    names.filter(|(_, name)| InterfaceCoordinates::is_amplitude(name)).map(|(row, _)| row).collect()
}

fn picked(matrix: &Mat<f64>, rows: &[usize]) -> Mat<f64> {
    Mat::from_fn(rows.len(), matrix.ncols(), |i, j| matrix[(rows[i], j)])
}

/// Returns an orthonormal basis of the null space of a matrix with independent rows.
fn null_space(rows: &Mat<f64>) -> Mat<f64> {
    let (rank, size) = (rows.nrows(), rows.ncols());
    let all = rows.transpose().to_owned().qr().compute_Q();
    all.as_ref().subcols(rank, size - rank).to_owned()
}

/// Returns the coordinates without the rows `dropped`, of the modes after a change; fixed-interface modes are numbered
/// again.
fn without(
    coordinates: &InterfaceCoordinates,
    dropped: &[usize],
    change: &ModalChange,
) -> InterfaceCoordinates {
    let InterfaceCoordinates { names, stiffness, mass, of_modes } = coordinates;
    let kept: Vec<usize> = (0..names.len()).filter(|row| dropped.binary_search(row).is_err()).collect();
    let block = |matrix: &Mat<f64>| Mat::from_fn(kept.len(), kept.len(), |i, j| matrix[(kept[i], kept[j])]);
    let mut count = 0;
    let mut renamed = |row: &usize| {
        if !InterfaceCoordinates::is_amplitude(&names[*row]) {
            return names[*row].clone();
        }
        count += 1;
        InterfaceCoordinates::amplitude(count)
    };
    InterfaceCoordinates {
        names: kept.iter().map(&mut renamed).collect(),
        stiffness: block(stiffness),
        mass: block(mass),
        of_modes: change.combined(&picked(of_modes, &kept)),
    }
}

/// Returns the facts about the fixed-interface modes `kept`, of all with the eigenvalues `all`. The count proves the kept
/// ones complete if they are the lowest.
fn of_some(fixed: &FixedInterface, all: &[f64], kept: &[usize]) -> FixedInterface {
    let lowest = kept.iter().enumerate().all(|(at, mode)| at == *mode);
    FixedInterface {
        modes: kept.len(),
        counted: fixed.counted.filter(|_| lowest),
        next: all.get(kept.len()).copied().filter(|_| lowest),
        eigenvalues: Vec::new(),
        free: None,
        ..*fixed
    }
}

fn remark(certificate: &Certificate, kept: usize, of: usize) -> String {
    let own = format!("{kept} of {of} fixed-interface modes were kept, with all motions of the interfaces");
    if certificate.remark.is_empty() { own } else { format!("{}; {own}", certificate.remark) }
}

fn refused(message: String, help: &str) -> Error {
    Diagnostic::new(Code::Usage, message).with_help(help.to_owned()).into()
}
