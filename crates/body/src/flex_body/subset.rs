//! Modes and groups of terms that a user states, instead of a selection for a scene.

use super::{FlexBody, TermDecision, TermGroup, TermGroups};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::joined_runs;

/// Reason of a group that a stated subset leaves out.
const LEFT_OUT: &str = "left out on request; no scene has judged it";

/// Names of the guidelines of \[WP19\] section 8, with the groups that hold their terms. Groups are kept or dropped as a
/// whole, so that a body conserves its own energy and momenta.
const GUIDELINES: [(&str, TermGroups); 4] = [
    ("I", TermGroups::NONE),
    ("II", TermGroups { w1: true, w2: false, w3: false }),
    ("III", TermGroups { w1: true, w2: true, w3: false }),
    ("IV", TermGroups::ALL),
];

/// Modes and groups of the kinetic energy that a body keeps.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Subset {
    /// Indices of the modes (from 0, ascending); `None` for all.
    pub modes: Option<Vec<usize>>,
    /// Groups of the kinetic energy; groups that the body does not hold stay missing.
    pub groups: TermGroups,
}

impl Subset {
    /// Parses numbers of modes from 1, with commas and ranges: `1,3,5-9`. Returns ascending indices from 0.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for text that is no number, the number 0, descending ranges and repeated numbers.
    pub fn parse_modes(text: &str) -> Result<Vec<usize>> {
        let mut numbers = Vec::new();
        for piece in text.split(',').map(str::trim) {
            let (first, last) = piece.split_once('-').unwrap_or((piece, piece));
            let number = |text: &str| {
                text.trim().parse::<usize>().ok().filter(|number| (1..=MOST_MODES).contains(number))
            };
            let (Some(first), Some(last)) = (number(first), number(last)) else {
                return Err(refused(format!("`{piece}` is not a number of a mode or a range of numbers")));
            };
            if first > last {
                return Err(refused(format!("the range `{piece}` descends")));
            }
            numbers.extend(first..=last);
        }
        Self::modes_of(numbers)
    }

    /// Returns the ascending indices (from 0) of modes that are given by their numbers, from 1.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for the number 0 and for repeated numbers.
    pub fn modes_of(mut numbers: Vec<usize>) -> Result<Vec<usize>> {
        numbers.sort_unstable();
        if let Some(pair) = numbers.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(refused(format!("mode {} is named twice", pair[0])));
        }
        let index =
            |number: usize| number.checked_sub(1).ok_or_else(|| refused("there is no mode 0".to_owned()));
        numbers.into_iter().map(index).collect()
    }

    /// Parses groups of terms: names with commas (`W1,W3`), `none`, `all`, or a guideline of \[WP19\] section 8 (`I`,
    /// `II`, `III`, `IV`).
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for other names.
    pub fn parse_groups(text: &str) -> Result<TermGroups> {
        let text = text.trim();
        match text.to_ascii_lowercase().as_str() {
            "none" => return Ok(TermGroups::NONE),
            "all" => return Ok(TermGroups::ALL),
            _ => {}
        }
        if let Some((_, groups)) = GUIDELINES.iter().find(|(name, _)| text.eq_ignore_ascii_case(name)) {
            return Ok(*groups);
        }
        text.split(',').map(str::trim).try_fold(TermGroups::NONE, |groups, name| {
            let named = TermGroup::ALL.into_iter().find(|group| group.name().eq_ignore_ascii_case(name));
            named.map(|group| groups.with(group)).ok_or_else(|| {
                let message = format!("`{name}` is not a group of terms");
                let help = "give W1, W2, W3 (with commas), none, all, or a guideline: I, II, III, IV";
                Diagnostic::new(Code::Usage, message).with_help(help).into()
            })
        })
    }

    /// Returns the modes in the form that [`Subset::parse_modes`] reads.
    pub fn modes_text(modes: &[usize]) -> String {
        let numbers: Vec<usize> = modes.iter().map(|mode| mode + 1).collect();
        joined_runs(&numbers, ",")
    }

    /// Returns the groups in the form that [`Subset::parse_groups`] reads.
    pub fn groups_text(groups: TermGroups) -> String {
        let names: Vec<&str> =
            TermGroup::ALL.into_iter().filter(|group| groups.has(*group)).map(TermGroup::name).collect();
        match names.len() {
            0 => "none".to_owned(),
            3 => "all".to_owned(),
            _ => names.join(","),
        }
    }
}

/// Largest number of a mode that is read: far beyond any body, and small enough that a range fits into memory.
const MOST_MODES: usize = 1_000_000;

fn refused(message: String) -> flexbody_base::error::Error {
    Diagnostic::new(Code::Usage, message).with_help("give numbers of modes from 1, as in 1,3,5-9").into()
}

impl FlexBody {
    /// Returns the body with the modes and groups of a stated subset; a body that has no others is returned as it is.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) if the body has fewer modes; the errors of [`FlexBody::new`].
    pub fn subset(self, subset: &Subset) -> Result<Self> {
        let all: Vec<usize> = (0..self.n_modes()).collect();
        let modes = subset.modes.as_deref().unwrap_or(&all);
        if let Some(beyond) = modes.iter().find(|mode| **mode >= all.len()) {
            let message = format!("mode {} is asked for, and the body has {} modes", beyond + 1, all.len());
            return Err(refused(message));
        }
        let groups = subset.groups.and(self.groups());
        if modes.len() == all.len() && groups == self.groups() {
            return Ok(self);
        }
        let left_out = |group: TermGroup| TermDecision {
            group,
            kept: false,
            tier: 2,
            bound: f64::INFINITY,
            limit: f64::INFINITY,
            reason: LEFT_OUT.to_owned(),
        };
        let held = self.groups();
        let newly = groups.dropped().filter(|group| held.has(*group)).map(left_out).collect();
        self.reduced(modes, groups, newly)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_modes_are_read_as_they_are_written() {
        for text in ["1", "1,3", "1-4", "1,3,5-9,12", "2-3,7"] {
            assert_eq!(Subset::modes_text(&Subset::parse_modes(text).unwrap()), text);
        }
        assert_eq!(Subset::parse_modes("5,1-3").unwrap(), [0, 1, 2, 4]);
        for text in ["", "0", "a", "3-1", "1,1", "1-3,2", "-1", "1-", "99999999999999999999", "1-99999999"] {
            assert!(Subset::parse_modes(text).is_err(), "{text}");
        }
    }

    #[test]
    fn groups_are_read_as_they_are_written() {
        for bits in 0..8 {
            let groups = TermGroups { w1: bits & 1 != 0, w2: bits & 2 != 0, w3: bits & 4 != 0 };
            assert_eq!(Subset::parse_groups(&Subset::groups_text(groups)).unwrap(), groups);
        }
        assert_eq!(Subset::parse_groups(" w1 , W3 ").unwrap(), TermGroups::without(TermGroup::W2));
        assert_eq!(Subset::parse_groups("II").unwrap(), TermGroups::NONE.with(TermGroup::W1));
        for text in ["", "W4", "W1,", "V", "none,W1"] {
            assert!(Subset::parse_groups(text).is_err(), "{text}");
        }
    }
}
