//! Components of a stress by their usual spellings, and notes about stresses of which no equivalent stress is formed.

use super::wording::name_some;
use super::{FeModel, ModelRecovery, Quantity, RecoveryOperator, RecoveryRow, StressPoint};
use flexbody_base::diagnostic::{Code, Diagnostic};
use std::collections::{BTreeMap, BTreeSet};

/// Component of a stress of a row, and the part of the name of the row before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct StressLabel<'r> {
    /// Place among xx, yy, zz, xy, yz, xz.
    pub component: usize,
    /// Name of the row without its component.
    pub name: &'r str,
}

/// Characters between the parts of a name.
const SEPARATORS: [char; 5] = [' ', '_', '-', '.', ':'];

/// Words for a stress before its axes, longest first.
const STRESS_WORDS: [&str; 7] = ["stress", "sigma", "sig", "tau", "\u{3c3}", "\u{3c4}", "s"];

/// Returns the component of a row of stress, and the name of its point; `None` if the component is not known or the name does not
/// end with it.
pub(super) fn labels_of(row: &RecoveryRow) -> Option<StressLabel<'_>> {
    let component = component(&row.component)?;
    let name = row.name.trim_end_matches(SEPARATORS);
    let before = without_suffix(name, row.component.trim_end_matches(SEPARATORS))
        .or_else(|| before_component(name, component))?
        .trim_end_matches(SEPARATORS);
    // The words of `p sigma_xx` and `p tau_xy` differ, their point is one.
    let last = before.rfind(SEPARATORS).map_or(0, |at| at + 1);
    let is_word = |word: &&str| word.len() > 1 && before[last..].eq_ignore_ascii_case(word);
    let name =
        if STRESS_WORDS.iter().any(is_word) { before[..last].trim_end_matches(SEPARATORS) } else { before };
    Some(StressLabel { component, name })
}

/// Returns `name` without `suffix`, whatever the case of its letters.
fn without_suffix<'n>(name: &'n str, suffix: &str) -> Option<&'n str> {
    let at = name.len().checked_sub(suffix.len())?;
    let end = name.get(at..)?;
    end.eq_ignore_ascii_case(suffix).then(|| &name[..at])
}

/// Returns the part of `name` before its last word, if this word is another spelling of the component.
fn before_component(name: &str, own: usize) -> Option<&str> {
    let at = name.rfind(SEPARATORS).map_or(0, |at| at + 1);
    (component(&name[at..]) == Some(own)).then(|| &name[..at])
}

/// Returns the place of a component among xx, yy, zz, xy, yz, xz by its usual spellings, whatever the case: two axes as letters
/// or numbers in any order (`xz`, `ZX`, `13`), after a word for a stress (`sxx`, `S11`, `sigma_xx`, `tau-xy`), and one axis after
/// such a word (`SX`, `sigma_y`).
fn component(text: &str) -> Option<usize> {
    let lower = text.to_lowercase();
    let text = lower.trim_matches(SEPARATORS);
    let word = STRESS_WORDS.iter().find(|word| text.starts_with(**word));
    let axes = word.map_or(text, |word| text[word.len()..].trim_start_matches(SEPARATORS));
    let axis = |c: char| match c {
        'x' | '1' => Some(0),
        'y' | '2' => Some(1),
        'z' | '3' => Some(2),
        _ => None,
    };
    let pair = match axes.chars().collect::<Vec<_>>()[..] {
        [a, b] if a.is_ascii_digit() == b.is_ascii_digit() => (axis(a)?, axis(b)?),
        // S1 to S3 are principal stresses.
        [a] if word.is_some() && a.is_ascii_alphabetic() => (axis(a)?, axis(a)?),
        _ => return None,
    };
    match pair {
        (a, b) if a == b => Some(a),
        (0, 1) | (1, 0) => Some(3),
        (1, 2) | (2, 1) => Some(4),
        _ => Some(5),
    }
}

/// Least number of different components at one place that look like a tensor.
const TENSOR: usize = 3;

/// Adds a note for each recovery with plane states, and for each whose rows look like tensors of which no equivalent stress is
/// formed.
pub(super) fn note_stress_points(model: &FeModel, found: &mut Vec<Diagnostic>) {
    for one in model.recoveries() {
        let labels = match &one.operator {
            RecoveryOperator::Rows { labels, .. } | RecoveryOperator::Shapes { labels, .. } => labels,
            RecoveryOperator::Cut { .. } => continue,
        };
        let points = StressPoint::among(labels);
        found.extend(note_of_plane_states(one, &points));
        found.extend(note_of_tensors(one, labels, &points));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_have_their_usual_spellings() {
        for (place, spellings) in [
            (0, &["xx", "XX", "11", "S11", "sxx", "SX", "sigma_xx", "Sigma-x", "stress xx", "\u{3c3}xx"][..]),
            (1, &["yy", "22", "s_yy", "SY"]),
            (2, &["zz", "33", "sig.zz"]),
            (3, &["xy", "yx", "12", "21", "S12", "SXY", "tau_xy"]),
            (4, &["yz", "zy", "23", "32", "S23"]),
            (5, &["xz", "zx", "ZX", "13", "31", "S31", "tau zx"]),
        ] {
            for text in spellings {
                assert_eq!(component(text), Some(place), "{text}");
            }
        }
        for text in ["", "x", "1", "S1", "S2", "s", "xxx", "x1", "44", "von Mises", "rr", "gauge", "max"] {
            assert_eq!(component(text), None, "{text}");
        }
    }
}
