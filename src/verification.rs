//! A body against the model it was made of: every invariant and every mode recomputed from the matrices.

use crate::convert::{BodyModes, Place};
use crate::diagnostic::{Code, Diagnostic};
use crate::eigen::rounding_residual;
use crate::error::Result;
use crate::flex_body::FlexBody;
use crate::invariants::{IdentityCheck, condense_certified, primary_differences};
use crate::linalg::gram;
use crate::model::FeModel;
use faer::{Mat, Scale};

/// Recomputed invariants agree to rounding of their sums, relative to their Cauchy-Schwarz bounds.
const RECOMPUTED: f64 = 1e-12;

/// Name of K_ff among the [`primary_differences`].
const STIFFNESS: &str = "modal_stiffness";

/// What another evaluation of K psi may leave, in units of the rounding estimate eps | |K| |psi| |: the shapes were also
/// turned into body axes and back.
const ROUNDING: f64 = 30.0;

/// Recomputes invariants, residuals and orthogonality of `body` from the matrices of `model`.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) when the nodes differ.
pub fn verify(body: &FlexBody, model: &FeModel) -> Result<Vec<IdentityCheck>> {
    if body.dimension() != model.dimension() {
        let message = format!("the body has dimension {}, the model {}", body.dimension(), model.dimension());
        return Err(Diagnostic::new(Code::BodyIncomparable, message).into());
    }
    if body.nodes().ids != model.nodes().ids {
        let message = format!(
            "the body has {} nodes, the model {} with other numbers or in another order",
            body.nodes().ids.len(),
            model.nodes().ids.len()
        );
        return Err(Diagnostic::new(Code::BodyIncomparable, message).into());
    }
    let check = |name, formula, value: f64, limit: f64| IdentityCheck {
        name,
        formula,
        value,
        limit,
        passed: value <= limit,
    };
    let frame = body.frame();
    let place = Place::new(model, *frame);
    let Some(modes) = BodyModes::of_body(model, body) else {
        let message = "the rows of the body's modes are not those of the model";
        return Err(Diagnostic::new(Code::BodyIncomparable, message).into());
    };
    let positions = &place.positions;
    let size = positions.iter().flatten().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let moved = positions
        .iter()
        .flatten()
        .zip(body.nodes().positions.iter().flatten())
        .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    let in_model = &modes.vectors;
    let pencil = model.pencil();
    let kx = pencil.apply_stiffness(in_model.as_ref());
    let mx = pencil.apply_mass(in_model.as_ref());
    let modal_stiffness = gram(in_model.as_ref(), kx.as_ref());
    let own = modes.condensed(model, &place, modal_stiffness);
    let differences = primary_differences(body.invariants(), &own);
    let worst_of = |kept: &dyn Fn(&str) -> bool| {
        let kept = differences.iter().filter(|(name, _)| kept(name));
        kept.fold(0.0f64, |m, (_, d)| if d.is_nan() { f64::INFINITY } else { m.max(*d) })
    };
    // K is huge beside its lowest eigenvalues: what its products round away is no error of the body.
    let rounding = rounding_residual(model.stiffness(), in_model.as_ref());
    let (mut residual, mut stored, mut long, mut loose) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for (j, &lambda) in body.modes().eigenvalue.iter().enumerate() {
        let r = kx.col(j) - mx.col(j) * Scale(lambda);
        let size = kx.col(j).norm_l2() + lambda.abs() * mx.col(j).norm_l2();
        residual = residual.max(r.norm_l2() / size);
        stored = stored.max(body.modes().residual[j]).max(ROUNDING * rounding[j] / size);
        // |psi_p' d(K psi_q)| <= |psi_p| |d(K psi_q)|, relative to sqrt(lambda_p lambda_q).
        long = long.max(in_model.col(j).norm_l2() / lambda.sqrt());
        loose = loose.max(rounding[j] / lambda.sqrt());
    }
    let orthonormality =
        gram(in_model.as_ref(), mx.as_ref()) - Mat::<f64>::identity(in_model.ncols(), in_model.ncols());
    let mut checks = vec![
        check("positions", "x_body = A' (x_model - origin)", moved / size, 1e-12),
        check(
            "invariants_recomputed",
            "m, c, J, C1, Ibar, S from the matrices",
            worst_of(&|name| name != STIFFNESS),
            RECOMPUTED,
        ),
        check(
            "stiffness_recomputed",
            "K_ff = Psi' K Psi",
            worst_of(&|name| name == STIFFNESS),
            RECOMPUTED + long * loose,
        ),
        check(
            "residual_recomputed",
            "|K psi - lambda M psi| / (|K psi| + |lambda M psi|)",
            residual,
            2.0 * stored,
        ),
        check("orthonormal_recomputed", "Psi' M Psi = I", orthonormality.norm_max(), 1e-9),
    ];
    if let (Some(guarantee), Some(mass)) = (&body.certificate().guarantee, model.scalar_mass()) {
        let (stored, shapes) = (&body.nodes().positions, modes.displacements.as_ref());
        let own = condense_certified(mass, stored, shapes, model.stiffness(), &frame.axes);
        let excess =
            primary_differences(body.invariants(), &own.invariants).iter().zip(&guarantee.digits).fold(
                0.0f64,
                |m, ((_, d), digits)| {
                    if d.is_nan() { f64::INFINITY } else { m.max(0.5 * d * 10f64.powf(*digits)) }
                },
            );
        // Stored modes are rounded: their quotients follow the eigenvalues to what any other check of modes allows.
        let bounds = guarantee.eigenvalue_lower.iter().zip(&guarantee.eigenvalue_upper);
        let modal_mass = own.invariants.modal_mass();
        let outside = bounds.enumerate().fold(0.0f64, |m, (j, (lower, upper))| {
            let quotient = own.invariants.modal_stiffness[(j, j)] / modal_mass[(j, j)];
            m.max((lower - quotient) / lower).max((quotient - upper) / upper)
        });
        checks.push(check("digits_recomputed", "invariants to their guaranteed digits", excess, 1.0));
        checks.push(check(
            "bounds_recomputed",
            "psi' K psi / psi' M psi between the bounds of lambda",
            outside,
            1e-9 + body.certificate().rigid_noise,
        ));
    }
    Ok(checks)
}

/// Warnings for every file of `body`'s provenance whose fingerprint differs from the model's.
pub fn changed_sources(body: &FlexBody, model: &FeModel) -> Vec<Diagnostic> {
    body.source()
        .files
        .iter()
        .filter_map(|file| {
            let now = model.sources().iter().find(|other| other.role == file.role)?;
            (now.sha256 != file.sha256).then(|| {
                let message =
                    format!("{} file {} has other bytes than {} had", file.role, now.name, file.name);
                Diagnostic::new(Code::BodySourceChanged, message)
            })
        })
        .collect()
}
