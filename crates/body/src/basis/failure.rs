//! Conversion of failures of the eigen-solver to messages that name nodes.

use super::modal_basis::{ALL_DIGITS, input_error};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Error;
use flexbody_eigen::{EigenFailure, Unresisted, unresisted_motions};
use flexbody_linalg::largest;
use flexbody_model::{FeModel, rigid_count};

/// Returns a diagnostic for a failure that a single-precision factor may have caused itself, so that it
/// says nothing about the model. Failures about energies are excluded: energies come from K in double
/// precision.
fn too_poor(failure: &EigenFailure) -> Option<Diagnostic> {
    let (code, why) = match failure {
        EigenFailure::NotConverged { converged, wanted } => {
            (Code::NotConverged, format!("{converged} of {wanted} modes converged"))
        }
        EigenFailure::NotPositiveDefinite { shift } => {
            (Code::FactorizationFailed, format!("rounded, K + {shift:.3e} M is not positive definite"))
        }
        EigenFailure::Inaccurate { residual } => {
            (Code::FactorizationFailed, format!("a probe has a relative residual of {residual:.1e}"))
        }
        _ => return None,
    };
    let message = format!("the modes cannot be found with a single-precision factor: {why}");
    Some(
        Diagnostic::new(code, message)
            .with_help("use --factor auto or f64: the model may be too thin for single precision"),
    )
}

/// Converts a failure of the eigen-solver to a diagnostic that names nodes.
pub(super) fn explain(model: &FeModel, failure: EigenFailure) -> Error {
    let diagnostic = match failure {
        EigenFailure::SinglePrecision(failure) => match too_poor(&failure) {
            Some(found) => found,
            None => return explain(model, *failure),
        },
        EigenFailure::NotConverged { converged, wanted } => {
            Diagnostic::new(Code::NotConverged, format!("{converged} of {wanted} modes converged"))
        }
        EigenFailure::NotPositiveDefinite { shift } => not_positive_definite(model, shift),
        EigenFailure::NegativeEigenvalue { eigenvalue, vector } => {
            let moved = most_moved(model, &vector);
            let message =
                format!("eigenvalue {eigenvalue:.6e} is negative; its mode moves nodes {moved} most");
            Diagnostic::new(Code::StiffnessIndefinite, message)
        }
        EigenFailure::MassIndefinite => {
            Diagnostic::new(Code::MassIndefinite, "mass matrix has negative eigenvalues beyond rounding")
        }
        // The eigenvalues are rounding and would differ between machines: do not print them.
        EigenFailure::ZeroEnergy { count, vectors, .. } => mechanism(model, count, &vectors),
        EigenFailure::CountDiffers { found, counted, shift } => Diagnostic::new(
            Code::CompletenessFailed,
            format!(
                "{found} flexible modes were found below lambda = {shift:.6e}, the inertia count says {counted}"
            ),
        ),
        EigenFailure::Inaccurate { residual } => Diagnostic::new(
            Code::FactorizationFailed,
            format!("factorisation leaves a relative residual of {residual:.1e} in a probe"),
        ),
        EigenFailure::NotCertified { why } => not_certified(why),
        EigenFailure::Memory { bytes, available } => memory_short(bytes, available),
        EigenFailure::TooLong { wanted, seconds, bytes } => too_long(model, wanted, seconds, bytes),
        EigenFailure::TooLarge => Diagnostic::new(
            Code::MemoryShort,
            "the ordering fails: it is out of memory, or the node graph has more than 2^31 entries",
        ),
    };
    diagnostic.into()
}

/// Returns the reason why K + tau M cannot be factored: motions without energy, or an indefinite matrix.
fn not_positive_definite(model: &FeModel, shift: f64) -> Diagnostic {
    let Some(Unresisted { count, vectors }) = unresisted_motions(&model.pencil(), shift, input_error(model))
    else {
        let message = format!("K + {shift:.3e} M is not positive definite: K or M is indefinite");
        return Diagnostic::new(Code::StiffnessIndefinite, message);
    };
    let moved = most_moved(model, &vectors);
    let message = match count {
        1 => format!("one motion has neither strain energy nor mass: it moves nodes {moved} most"),
        _ => format!("{count} motions have neither strain energy nor mass: they move nodes {moved} most"),
    };
    Diagnostic::new(Code::Mechanism, message).with_help(
        "use more elements across, or full integration: elements with reduced integration (C3D20R, C3D8R) have such motions in meshes one element across",
    )
}

/// Returns the numbers of the nodes that the columns of `vectors` move most.
fn most_moved(model: &FeModel, vectors: &Mat<f64>) -> String {
    let d = model.dimension();
    let square = |i: usize| {
        (0..vectors.ncols())
            .flat_map(|j| (0..d).map(move |k| (d * i + k, j)))
            .map(|(row, j)| vectors[(row, j)].powi(2))
            .sum::<f64>()
    };
    let squares: Vec<f64> = (0..model.nodes().len()).map(square).collect();
    // Nodes with equal motion up to rounding are named in their order.
    let millionth = 1e-6 * largest(squares.iter().copied());
    let mut moved: Vec<(usize, f64)> =
        squares.iter().map(|square| (square / millionth).round()).enumerate().collect();
    moved.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let named: Vec<String> = moved.iter().take(5).map(|(i, _)| model.nodes().ids[*i].to_string()).collect();
    named.join(", ")
}

/// Returns the error for zero-energy modes: several separate bodies, or a part that is free to move.
fn mechanism(model: &FeModel, count: usize, vectors: &Mat<f64>) -> Diagnostic {
    let rigid = rigid_count(model.dimension());
    let (all, moved) = (count + rigid, most_moved(model, vectors));
    let message = format!(
        "{all} zero-energy modes: {rigid} rigid ones and {count} more, which move nodes {moved} most"
    );
    if all % rigid == 0 {
        let message = format!("{message}; {} separate bodies have as many", all / rigid);
        Diagnostic::new(Code::Mechanism, message).with_help(
            "remove the negligible entries that join the bodies and use --split, or connect the bodies",
        )
    } else {
        let help = "connect the parts or remove the free degree of freedom; use more elements across where a mesh of elements with reduced integration is one element across; in a very thin body, or with large stiffness contrasts, rounding has removed the softest stiffnesses from K";
        let digits = model.digits();
        Diagnostic::new(Code::Mechanism, message).with_help(if digits < ALL_DIGITS {
            format!("{help}: its values have {digits} digits, write all of them")
        } else {
            help.to_owned()
        })
    }
}

fn not_certified(why: &str) -> Diagnostic {
    let message = format!("eigenvalue bounds cannot be guaranteed: {why}");
    Diagnostic::new(Code::FactorizationFailed, message).with_help("use --accuracy standard")
}

fn memory_short(bytes: u64, available: u64) -> Diagnostic {
    let message = format!(
        "the factor and the vectors need {:.3} GB on top of the matrices, {:.3} GB are available",
        bytes as f64 * 1e-9,
        available as f64 * 1e-9
    );
    Diagnostic::new(Code::MemoryShort, message)
}

fn too_long(model: &FeModel, wanted: usize, seconds: f64, bytes: u64) -> Diagnostic {
    let message = format!(
        "{wanted} modes of a model with {} degrees of freedom take about {:.1} hours on one processor, and {:.3} GB",
        model.stiffness().n(),
        seconds / 3600.0,
        bytes as f64 * 1e-9
    );
    Diagnostic::new(Code::WorkLong, message)
        .with_help("ask for fewer modes or a lower frequency, or use --allow-long")
}
