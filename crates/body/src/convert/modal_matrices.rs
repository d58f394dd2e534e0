//! Damping and geometric stiffness of the modes: the damping of the model, reduced to the modes, and matrices of unit
//! loads given by the user, reduced to the modes and turned to body axes.

use super::body_modes::reduced;
use crate::basis::{BasisChoice, Loads};
use crate::flex_body::{
    FlexBody, Frame, SOFTENING, SplitStiffness, along, axis_in_words, diagonal_ratios, proportional_damping,
    split, stiffness_about,
};
use crate::invariants::Invariants;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_eigen::energy_noise;
use flexbody_linalg::ties::first_smallest;
use flexbody_linalg::{SymmetricMatrix, side_by_side, symmetric_eigen};
use flexbody_model::{Damping, FeModel, GeometricStiffness, LoadKind, ratio_at};
use nalgebra::Vector3;

/// Number of standard deviations of the noise due to the digits of D that count as rounding.
const NOISE_DEVIATIONS: f64 = 30.0;

/// Smallest eigenvalue of the damping, scaled to a unit diagonal, that counts as rounding.
const MIN_SCALED_EIGENVALUE: f64 = -1e-8;

/// Damping of modes.
pub struct ModalDamping {
    /// Psi' D Psi (nf x nf). Unit: 1/time.
    pub matrix: Mat<f64>,
    /// Damping ratios: diagonal of `matrix` over 2 omega_j.
    pub ratio: Vec<f64>,
    /// Warning about modes damped beyond critical damping.
    pub warning: Option<Diagnostic>,
}

/// Returns the damping of the modes `vectors` (N x nf, model axes); `None` if the model has no damping.
///
/// # Errors
/// [`DampingIndefinite`](Code::DampingIndefinite) if the damping adds energy to a motion.
pub fn modal_damping(
    model: &FeModel,
    vectors: MatRef<'_, f64>,
    eigenvalues: &[f64],
    invariants: &Invariants,
) -> Result<Option<ModalDamping>> {
    let Some(damping) = model.damping() else { return Ok(None) };
    let critical: Vec<f64> = eigenvalues.iter().map(|lambda| 2.0 * lambda.sqrt()).collect();
    let from_ratios = |ratio: Vec<f64>| {
        let diagonal = |i: usize, j: usize| if i == j { ratio[j] * critical[j] } else { 0.0 };
        (Mat::from_fn(critical.len(), critical.len(), diagonal), ratio)
    };
    let from_matrix = |matrix: Mat<f64>| {
        let ratio = diagonal_ratios(&matrix, eigenvalues);
        (matrix, ratio)
    };
    let (matrix, ratio): (Mat<f64>, Vec<f64>) = match damping {
        Damping::Ratio(ratio) => from_ratios(vec![*ratio; critical.len()]),
        Damping::Bands(bands) => {
            let hertz = eigenvalues.iter().map(|&lambda| model.units().frequency_of(lambda));
            from_ratios(hertz.map(|f| ratio_at(bands, f)).collect())
        }
        Damping::Rayleigh { alpha, beta } => from_matrix(proportional_damping(invariants, *alpha, *beta)),
        Damping::Matrix(d) => {
            let matrix = reduced(d, vectors);
            check_semidefinite(model, d, vectors, &matrix)?;
            from_matrix(matrix)
        }
    };
    if let Some(j) = ratio.iter().position(|ratio| !ratio.is_finite()) {
        let message = format!("damping of mode {} is not a finite number", j + 1);
        return Err(Diagnostic::new(Code::DampingIndefinite, message).into());
    }
    let over = ratio.iter().filter(|ratio| **ratio > 1.0).count();
    let warning = (over > 0).then(|| {
        let worst = (0..ratio.len()).fold(0, |w, j| if ratio[j] > ratio[w] { j } else { w });
        let message = format!(
            "{over} of {} modes are overdamped, mode {} most: its damping ratio is {}",
            ratio.len(),
            worst + 1,
            significant(ratio[worst], 4)
        );
        Diagnostic::new(Code::ModesOverdamped, message)
    });
    Ok(Some(ModalDamping { matrix, ratio, warning }))
}

/// Returns an error if D adds energy to any motion of the modes beyond the noise of its digits.
fn check_semidefinite(
    model: &FeModel,
    d: &SymmetricMatrix,
    vectors: MatRef<'_, f64>,
    reduced: &Mat<f64>,
) -> Result<()> {
    let input_error = 0.5 * 10f64.powi(1 - i32::from(model.digits()));
    let noise = energy_noise(d, vectors, input_error);
    let raised = |j: usize| reduced[(j, j)] + NOISE_DEVIATIONS * noise[j];
    let refuse = |message: String| Err(Diagnostic::new(Code::DampingIndefinite, message).into());
    if let Some(j) = (0..noise.len()).find(|&j| raised(j).is_nan() || raised(j) < 0.0) {
        return refuse(format!(
            "damping of mode {} is negative: psi' D psi = {:.3e}",
            j + 1,
            reduced[(j, j)]
        ));
    }
    // Scale to a unit diagonal, so that slow modes count as much as fast ones.
    let size: Vec<f64> = (0..noise.len()).map(|j| raised(j).sqrt().max(f64::MIN_POSITIVE)).collect();
    let scaled = Mat::from_fn(size.len(), size.len(), |i, j| {
        if i == j { raised(j) / size[j] / size[j] } else { reduced[(i, j)] / size[i] / size[j] }
    });
    match symmetric_eigen(scaled.as_ref()) {
        Some(eigen) if eigen.values[0] >= MIN_SCALED_EIGENVALUE => Ok(()),
        Some(eigen) => {
            let most = (0..size.len()).fold(0, |w, j| {
                if eigen.vectors[(j, 0)].abs() > eigen.vectors[(w, 0)].abs() { j } else { w }
            });
            refuse(format!(
                "the reduced damping matrix, scaled to a unit diagonal, has the eigenvalue {:.3e}, most of it in mode {}",
                eigen.values[0],
                most + 1
            ))
        }
        None => refuse("the reduced damping matrix has entries that are not finite".to_owned()),
    }
}

/// Largest entry whose products stay finite.
const MAX_ENTRY: f64 = 1e290;

/// Returns Psi' K_geo Psi of the modes `vectors` (rows and axes of the model, signs of the body), and K_geo of unit
/// rotations about the axes of the body, for unit loads along the axes of `frame`. Components that are not given count
/// as zero, so that K_geo of any load is equal in all axes. Components without any contribution are omitted. Kinds are
/// in the order of the model, components in their own order.
///
/// * `computed`: S' K_geo S for the modes S and then the rotations of [`unit_rotations`], of loads that are not given.
/// * `shift`: origin of the frame relative to the point that spin and angular acceleration refer to, frame
///   axes; zero except for a frame on an interface. Unit: length.
///
/// # Errors
/// [`MatrixNotFinite`](Code::MatrixNotFinite) if the products overflow.
pub fn modal_geometric_stiffness(
    model: &FeModel,
    vectors: &Mat<f64>,
    computed: Vec<GeometricStiffness<Mat<f64>>>,
    frame: &Frame,
    shift: &Vector3<f64>,
) -> Result<SplitStiffness> {
    if model.geometric_stiffness().is_empty() && computed.is_empty() {
        return Ok((Vec::new(), Vec::new()));
    }
    let mut out: Vec<GeometricStiffness<Mat<f64>>> = Vec::new();
    let shapes = side_by_side(&[vectors.as_ref(), unit_rotations(model, frame).as_ref()]);
    for GeometricStiffness { load, matrix } in model.geometric_stiffness() {
        out.push(GeometricStiffness { load: load.clone(), matrix: reduced(matrix, shapes.as_ref()) });
    }
    out.extend(computed);
    for GeometricStiffness { load, matrix } in &out {
        if matrix.col_iter().any(|column| column.iter().any(|v| v.is_nan() || v.abs() > MAX_ENTRY)) {
            let message = format!("geometric stiffness for {load} overflows on the modes");
            return Err(Diagnostic::new(Code::MatrixNotFinite, message).into());
        }
    }
    let kinds: Vec<LoadKind> = out.iter().map(|stiffness| stiffness.load.kind.clone()).collect();
    let place = |kind: &LoadKind| kinds.iter().position(|one| one == kind);
    let mut out = stiffness_about(&along(&out, &frame.axes), shift, model.dimension());
    out.sort_by_key(|stiffness| (place(&stiffness.load.kind), stiffness.load.component));
    Ok(split(out))
}

/// Returns unit rotations (N x 3) about the origin and the axes of the frame; in the plane those about x and y are zero.
pub fn unit_rotations(model: &FeModel, frame: &Frame) -> Mat<f64> {
    let fields = model.rigid_fields(frame.origin.into(), 1.0);
    match model.dimension() {
        2 => Mat::from_fn(fields.nrows(), 3, |i, k| if k == 2 { fields[(i, 2)] } else { 0.0 }),
        _ => {
            let about = |i: usize, k: usize| (0..3).map(|l| fields[(i, 3 + l)] * frame.axes[(l, k)]).sum();
            Mat::from_fn(fields.nrows(), 3, about)
        }
    }
}

/// Help of the warning about missing geometric stiffness where the deck describes its elements.
const COMPUTE_FROM_ELEMENTS: &str = "convert with --geometric-stiffness spin, which computes it from the elements of the deck, or keep to spin rates far below the value in the message";

/// Returns a warning if the basis contains centrifugal loads, which means that the body spins, but the body has no geometric
/// stiffness of spin. The warning states the rotation at which 1 % of a stiffness is missing: by the estimate of the body, or
/// by the softening alone if it has none.
pub(super) fn softening_warning(model: &FeModel, basis: &BasisChoice, body: &FlexBody) -> Option<Diagnostic> {
    let BasisChoice::Free(free) = basis else { return None };
    if body.has_spin_stiffness() || !free.residual_vectors.contains(&Loads::Centrifugal) {
        return None;
    }
    let reached = if body.estimated_stiffness().is_empty() { softened(body)? } else { missing(body)? };
    let message = format!("centrifugal loads are wanted without geometric stiffness for spin: {reached}");
    let warning = Diagnostic::new(Code::GeometricStiffnessNone, message);
    Some(if model.describes_elements() { warning.with_help(COMPUTE_FROM_ELEMENTS) } else { warning })
}

/// Returns the rotation in words at which the centrifugal term takes 1 % of a stiffness; `None` if it takes nothing.
fn softened(body: &FlexBody) -> Option<String> {
    let (axis, part) = body.worst_spin().filter(|(_, part)| *part > 0.0)?;
    let hertz = significant(body.units().frequency_of(SOFTENING / part), 4);
    let axis = axis_in_words(&axis);
    Some(format!(
        "the centrifugal term takes 1 % of the stiffness of a motion at {hertz} Hz about axis {axis} of the model"
    ))
}

/// Returns the slowest rotation about an axis of the model in words at which the missing stress stiffness is 1 % of a
/// stiffness; `None` if no rotation changes a stiffness.
fn missing(body: &FlexBody) -> Option<String> {
    let axes = if body.dimension() == 2 { 2..3 } else { 0..3 };
    let rates = axes.filter_map(|axis| Some((axis, body.missing_rate(axis)?)));
    let (axis, rate) = first_smallest(rates, |(_, rate)| *rate)?;
    let hertz = significant(body.units().frequency_of(rate * rate), 4);
    let axis = axis_in_words(&Vector3::ith(axis, 1.0));
    Some(format!(
        "about 1 % of the stiffness of a motion is missing at {hertz} Hz of rotation about {axis} of the model (estimate)"
    ))
}
