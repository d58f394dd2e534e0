//! Components of a stress by their usual spellings.

use crate::RecoveryRow;

/// Names of the components of stress and strain, also of the uniform strains of [`uniform_strains`](crate::uniform_strains), in
/// their order.
pub const STRAIN_NAMES: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Component of a stress of a row, and the part of the name of the row before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StressLabel<'r> {
    /// Place among xx, yy, zz, xy, yz, xz.
    pub component: usize,
    /// Name of the row without its component.
    pub name: &'r str,
}

/// Characters between the parts of a name.
pub(crate) const SEPARATORS: [char; 5] = [' ', '_', '-', '.', ':'];

/// Words for a stress before its axes, longest first.
const STRESS_WORDS: [&str; 7] = ["stress", "sigma", "sig", "tau", "\u{3c3}", "\u{3c4}", "s"];

/// Returns the component of a row of stress, and the name of its point; `None` if the component is not known or the name does not
/// end with it.
pub(crate) fn labels_of(row: &RecoveryRow) -> Option<StressLabel<'_>> {
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
pub(crate) fn without_suffix<'n>(name: &'n str, suffix: &str) -> Option<&'n str> {
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
pub(crate) fn component(text: &str) -> Option<usize> {
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
