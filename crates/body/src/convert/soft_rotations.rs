//! Note about the frequencies that a model has without the terms that make soft rotations follow their elements.

use crate::basis::ModalBasis;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_linalg::ties::first_largest;
use flexbody_model::FeModel;

/// Number of modes whose change is computed.
const COMPARED_MODES: usize = 40;

/// Relative change of a frequency that is reported.
const REPORTED_CHANGE: f64 = 1e-4;

/// Returns a note about the lowest frequency that changes because soft rotations follow their elements, and about the
/// one that changes most; `None` if the model has no soft rotation.
///
/// The frequencies without the terms are those of the span of the modes and of the released rotations, which are
/// not below those of the model.
pub(super) fn effect_of_soft_rotations(model: &FeModel, found: &ModalBasis) -> Option<Diagnostic> {
    let soft = model.soft_rotations();
    if soft.is_empty() {
        return None;
    }
    let count = found.solution.eigenvalues.len().min(COMPARED_MODES);
    let (shapes, eigenvalues) =
        (found.solution.vectors.as_ref().subcols(0, count), &found.solution.eigenvalues[..count]);
    let released = soft.released_eigenvalues(model.stiffness(), shapes, eigenvalues);
    let hertz = |eigenvalue: f64| model.units().frequency_of(eigenvalue.max(0.0));
    let frequencies = eigenvalues.iter().zip(&released).map(|(with, without)| [*with, *without].map(hertz));
    let frequencies: Vec<[f64; 2]> = frequencies.collect();
    let change = |mode: usize| 1.0 - frequencies[mode][1] / frequencies[mode][0];
    let words = |mode: usize| {
        let [with, without] = frequencies[mode];
        format!(
            "{} Hz, at most about {} Hz with these rotations as in K",
            significant(with, 6),
            significant(without, 3)
        )
    };
    let message = match (0..count).find(|mode| change(*mode) > REPORTED_CHANGE) {
        None => format!(
            "no frequency of the first {count} modes changes by more than {REPORTED_CHANGE:.0e} because soft rotations follow the nodes around"
        ),
        Some(lowest) => {
            let most = first_largest((0..count).map(|mode| (mode, change(mode))), |pair| pair.1);
            let more = most.filter(|(mode, _)| *mode != lowest);
            let more = more.map(|(mode, _)| format!("; mode {} changes most: {}", mode + 1, words(mode)));
            format!(
                "mode {} is the lowest that changes because soft rotations follow the nodes around: {}{}",
                lowest + 1,
                words(lowest),
                more.unwrap_or_default()
            )
        }
    };
    Some(Diagnostic::new(Code::SoftRotationsEffect, message))
}
