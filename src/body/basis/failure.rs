//! Failures of the eigen-solver as messages that name nodes.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Error;
use crate::model::{FeModel, rigid_count};
use crate::numerics::eigen::EigenFailure;
use faer::Mat;

/// A failure that a single-precision factor may have caused by itself: nothing is known about the model then. Energies are
/// another matter: they come from K in double precision.
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
            .with_help("use --factor auto or f64: the model may be too thin, or unsound"),
    )
}

/// Turns a failure of the eigen-solver into a diagnostic that names nodes.
pub(super) fn explain(model: &FeModel, failure: EigenFailure) -> Error {
    let d = model.dimension();
    let rigid = rigid_count(d);
    let moving = |vectors: &Mat<f64>| {
        let mut size: Vec<(usize, f64)> = (0..model.nodes().len())
            .map(|i| {
                let square = (0..vectors.ncols())
                    .flat_map(|j| (0..d).map(move |k| (d * i + k, j)))
                    .map(|(r, j)| vectors[(r, j)].powi(2))
                    .sum::<f64>();
                (i, square)
            })
            .collect();
        size.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let named: Vec<String> =
            size.iter().take(5).map(|(i, _)| model.nodes().ids[*i].to_string()).collect();
        named.join(", ")
    };
    let diagnostic = match failure {
        EigenFailure::SinglePrecision(failure) => match too_poor(&failure) {
            Some(found) => found,
            None => return explain(model, *failure),
        },
        EigenFailure::NotConverged { converged, wanted } => {
            Diagnostic::new(Code::NotConverged, format!("{converged} of {wanted} modes converged"))
        }
        EigenFailure::NotPositiveDefinite { shift } => Diagnostic::new(
            Code::StiffnessIndefinite,
            format!("K + {shift:.3e} M is not positive definite: K or M is indefinite"),
        ),
        EigenFailure::NegativeEigenvalue { eigenvalue, vector } => Diagnostic::new(
            Code::StiffnessIndefinite,
            format!("eigenvalue {eigenvalue:.6e} is negative; its mode moves nodes {} most", moving(&vector)),
        ),
        EigenFailure::MassIndefinite => {
            Diagnostic::new(Code::MassIndefinite, "mass matrix has negative eigenvalues beyond rounding")
        }
        // Their eigenvalues are rounding: no two machines would print the same.
        EigenFailure::ZeroEnergy { count, vectors, .. } => {
            let (all, moved) = (count + rigid, moving(&vectors));
            let message = format!(
                "{all} zero-energy modes: {rigid} rigid ones and {count} more, which move nodes {moved} most"
            );
            if all % rigid == 0 {
                let message = format!("{message}; {} separate bodies have as many", all / rigid);
                Diagnostic::new(Code::Mechanism, message).with_help(
                    "bodies that are joined by negligible entries only: remove these entries and use --split, or connect the bodies",
                )
            } else {
                Diagnostic::new(Code::Mechanism, message).with_help(
                    "connect the parts or remove the free degree of freedom; of a body very thin, or with stiffnesses far apart, K has lost its softest ones to rounding",
                )
            }
        }
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
        EigenFailure::NotCertified { why } => Diagnostic::new(
            Code::FactorizationFailed,
            format!("eigenvalue bounds cannot be guaranteed: {why}"),
        )
        .with_help("use --accuracy standard"),
        EigenFailure::Memory { bytes, available } => Diagnostic::new(
            Code::MemoryShort,
            format!(
                "the factor and the vectors need {:.3} GB on top of the matrices, {:.3} GB are left",
                bytes as f64 * 1e-9,
                available as f64 * 1e-9
            ),
        ),
        EigenFailure::TooLong { wanted, seconds, bytes } => Diagnostic::new(
            Code::WorkLong,
            format!(
                "{wanted} modes of a model with {} degrees of freedom take about {:.1} hours on one processor, and {:.3} GB",
                model.stiffness().n(),
                seconds / 3600.0,
                bytes as f64 * 1e-9
            ),
        )
        .with_help("ask for fewer modes or a lower frequency, or say --allow-long"),
        EigenFailure::TooLarge => Diagnostic::new(
            Code::MemoryShort,
            "the ordering fails: it is out of memory, or the node graph has more than 2^31 entries",
        ),
    };
    diagnostic.into()
}
