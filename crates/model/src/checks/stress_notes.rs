//! Notes about stresses of which no equivalent stress is formed.

use crate::recovery::stress_labels::{SEPARATORS, component, without_suffix};
use crate::wording::name_some;
use crate::{FeModel, ModelRecovery, Quantity, RecoveryOperator, RecoveryRow, StressPoint};
use flexbody_base::diagnostic::{Code, Diagnostic};
use std::collections::{BTreeMap, BTreeSet};

/// Least number of different components at one place that look like a tensor.
const TENSOR: usize = 3;

/// Adds a note for each recovery with plane states, and for each whose rows look like tensors of which no equivalent stress is
/// formed.
pub(crate) fn note_stress_points(model: &FeModel, diagnostics: &mut Vec<Diagnostic>) {
    for recovery in model.recoveries() {
        let labels = match &recovery.operator {
            RecoveryOperator::Rows { labels, .. } | RecoveryOperator::Shapes { labels, .. } => labels,
            RecoveryOperator::Cut { .. } => continue,
        };
        let points = StressPoint::among(labels);
        diagnostics.extend(note_of_plane_states(recovery, &points));
        diagnostics.extend(note_of_tensors(recovery, labels, &points));
    }
}

fn note_of_plane_states(recovery: &ModelRecovery, points: &[StressPoint]) -> Option<Diagnostic> {
    let plane: Vec<&StressPoint> = points.iter().filter(|point| point.is_plane()).collect();
    let first = plane.first()?;
    let missing =
        if plane.iter().all(|point| point.rows[2].is_some()) { "yz and xz" } else { "zz, yz and xz" };
    let message = format!(
        "recovery `{}`: {} of {} points, the first of them `{}`, have no stresses {missing}: they count as zero",
        recovery.name,
        plane.len(),
        points.len(),
        first.name
    );
    Some(Diagnostic::new(Code::RecoveryPlane, message).in_file(&recovery.path))
}

/// Node, element and the common part of the names of rows.
type Place<'r> = (Option<i64>, Option<i64>, &'r str);

fn note_of_tensors(
    recovery: &ModelRecovery,
    labels: &[RecoveryRow],
    points: &[StressPoint],
) -> Option<Diagnostic> {
    let mut is_of_point = vec![false; labels.len()];
    points.iter().flat_map(|point| point.rows).flatten().for_each(|row| is_of_point[row] = true);
    // Components at each place: at a node and element, or of rows whose names are equal before the component.
    let mut places: BTreeMap<Place<'_>, BTreeSet<&str>> = BTreeMap::new();
    for (row, _) in labels
        .iter()
        .zip(&is_of_point)
        .filter(|(row, of_point)| row.quantity == Quantity::Stress && !**of_point)
    {
        let has_place = row.node.is_some() || row.element.is_some();
        let name = if has_place { "" } else { before_last_word(row) };
        places.entry((row.node, row.element, name)).or_default().insert(&row.component);
    }
    let tensors: Vec<&BTreeSet<&str>> =
        places.values().filter(|components| components.len() >= TENSOR).collect();
    let first = tensors.first()?;
    let names: Vec<String> = first.iter().map(|component| format!("`{component}`")).collect();
    let unknown = first.iter().any(|text| component(text).is_none());
    let reason = if unknown {
        "not all of them are known components of a stress"
    } else if first.len() < 6 {
        "they are neither all six nor those of a plane state (xx, yy, xy)"
    } else {
        "the names of their rows do not end with their components and are not equal before them, or their units differ"
    };
    let message = format!(
        "recovery `{}`: no von Mises and principal stresses of {} of its places, the first with the components {}: {reason}",
        recovery.name,
        tensors.len(),
        name_some(&names),
    );
    Some(Diagnostic::new(Code::RecoveryNoEquivalent, message).in_file(&recovery.path))
}

/// Returns the name of a row without its component, or else without its last word.
fn before_last_word(row: &RecoveryRow) -> &str {
    let name = without_suffix(&row.name, &row.component);
    name.unwrap_or_else(|| row.name.rfind(SEPARATORS).map_or("", |at| &row.name[..at]))
        .trim_end_matches(SEPARATORS)
}
