//! Craig-Bampton bodies with some of their fixed-interface modes (theory section 5).
//!
//! A body with the interface coordinates c = [u_b; eta] = B p of its modes leaves out the fixed-interface modes D by
//! B_D p = 0: rigid motions have no amplitudes eta, so that they stay. The new modes are those of K in the null space of
//! B_D. All motions of the interfaces stay in the span, and with them the static response to loads at the interfaces; the
//! body is that of a conversion with these fixed-interface modes alone.

use super::modal_change::ModalChange;
use super::{Certificate, FixedInterface, FlexBody, InterfaceCoordinates, Storage};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_linalg::{combine, dense_cholesky, gram, solve_lower};

impl FlexBody {
    /// Returns the interface coordinates of a Craig-Bampton body, and those that are amplitudes of fixed-interface modes;
    /// `None` if the body has no interface coordinates.
    fn fixed_interface_coordinates(&self) -> Option<(&InterfaceCoordinates, Vec<usize>)> {
        let coordinates = self.coordinates().filter(|_| self.certificate().fixed_interface.is_some())?;
        Some((coordinates, coordinates.amplitudes()))
    }

    /// Returns the amplitudes eta of the fixed-interface modes in each mode (their number x nf); `None` if the body has no
    /// interface coordinates, or no fixed-interface modes.
    pub fn fixed_interface_amplitudes(&self) -> Option<Mat<f64>> {
        let (coordinates, amplitudes) = self.fixed_interface_coordinates()?;
        (!amplitudes.is_empty()).then(|| picked(&coordinates.of_modes, &amplitudes))
    }

    /// Returns the deformation of each fixed-interface mode with amplitude 1 in the modes (nf x their number), relative to
    /// the frame: B'M e. `None` if the body has no interface coordinates.
    pub fn fixed_interface_shapes(&self) -> Option<Mat<f64>> {
        let (coordinates, amplitudes) = self.fixed_interface_coordinates()?;
        let momenta = picked(&coordinates.mass, &amplitudes);
        Some(gram(coordinates.of_modes.as_ref(), momenta.transpose().to_owned().as_ref()))
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
        let (coordinates, amplitudes) = self.fixed_interface_coordinates().ok_or_else(without_coordinates)?;
        let dropped = dropped(&amplitudes, kept, self.n_modes())?;
        if dropped.is_empty() {
            return Ok((self.clone(), Mat::identity(self.n_modes(), self.n_modes())));
        }
        let constraint = picked(&coordinates.of_modes, &dropped);
        let change = ModalChange::in_span(self.invariants(), &null_space(&constraint))
            .map_err(|reason| refused(reason, "keep more fixed-interface modes"))?;
        let lost = self.lost_flexibility(&constraint).ok_or_else(|| {
            let message = "the amplitudes of the fixed-interface modes depend on each other in this body";
            refused(message.to_owned(), "convert again with fewer fixed-interface modes")
        })?;

        let mut parts = self.changed(&change, self.conditions().clone())?.into_parts();
        // The frame is the former one, so that rows which rigid motion changes stay known.
        parts.recoveries = self.combined_recoveries(&change, &lost);
        parts.modes.truncation = Vec::new();
        parts.coordinates = Some(without(coordinates, &dropped, &change));
        let (own, all) = (self.certificate(), coordinates.fixed_interface_eigenvalues());
        parts.certificate = Certificate {
            remark: remark(own, kept.len(), all.len()),
            fixed_interface: own.fixed_interface.as_ref().map(|fixed| of_some(fixed, &all, kept)),
            ..parts.certificate
        };
        let mut body = Self::new(parts)?;
        if self.storage() == Storage::F32 {
            body = body.rounded_to_f32()?;
        }
        Ok((body, change.modes().clone()))
    }

    /// Returns the static flexibility (nf x nf) that the modes lose by B_D p = 0, with B_D = `constraint`: that of the
    /// complement Y = Lambda^-1 B_D' in the norm of K, Y (Y'Lambda Y)^-1 Y'.
    /// `None` if the rows of B_D depend on each other.
    fn lost_flexibility(&self, constraint: &Mat<f64>) -> Option<Mat<f64>> {
        let stiffness = self.invariants().modal_stiffness();
        let complement = Mat::from_fn(constraint.ncols(), constraint.nrows(), |j, d| {
            constraint[(d, j)] / stiffness[(j, j)]
        });
        let lower = dense_cholesky(combine(constraint.as_ref(), complement.as_ref()))?;
        let half = solve_lower(&lower, &complement.transpose().to_owned());
        Some(gram(half.as_ref(), half.as_ref()))
    }
}

/// Returns the coordinates among `amplitudes` of the fixed-interface modes that are not `kept` (indices, ascending).
///
/// # Errors
/// [`Usage`](Code::Usage) for indices that do not ascend or are too large, and if none of the `n_modes` modes is left.
fn dropped(amplitudes: &[usize], kept: &[usize], n_modes: usize) -> Result<Vec<usize>> {
    let count = amplitudes.len();
    if kept.windows(2).any(|pair| pair[0] >= pair[1]) || kept.last().is_some_and(|last| *last >= count) {
        let message =
            format!("a fixed-interface mode is asked for that is not among the {count} of the body");
        return Err(refused(message, "give ascending numbers from 1, as in 1,3,5-9, or none"));
    }
    if count - kept.len() >= n_modes {
        let message = "no mode is left: the only motions of the interfaces are those of the rigid body";
        return Err(refused(message.to_owned(), "keep one fixed-interface mode at least"));
    }
    Ok((0..count).filter(|at| kept.binary_search(at).is_err()).map(|at| amplitudes[at]).collect())
}

fn without_coordinates() -> Error {
    let message = "the body has no interface coordinates, which name its fixed-interface modes";
    let help =
        "give a body of --basis craig-bampton with all its modes, with the frame at the centre of mass";
    refused(message.to_owned(), help)
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
