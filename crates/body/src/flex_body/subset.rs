//! Reduction of a body to some of its modes and of the groups of its kinetic energy, and the text in which a user states
//! such a subset.

use super::{
    Certificate, FixedInterface, FlexBody, FreeEstimate, Guarantee, InternalRows, LumpedBody, Modes, Parts,
    RotatedStiffness, Storage, TermDecision, TermGroup, TermGroups,
};
use crate::invariants::{InertiaStiffness, error_norms};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::joined_runs;
use flexbody_model::GeometricStiffness;

impl FlexBody {
    /// Returns the body with the modes `modes` (indices, ascending) and the groups of its kinetic energy
    /// that are in `groups`.
    ///
    /// `terms` gives the reasons; for groups that it does not name, the earlier decisions stay. If modes
    /// are dropped, data about all modes are dropped as well: interface coordinates, the truncation errors
    /// of residual vectors and, unless the lowest modes are kept, the proof of completeness, which the
    /// remark of the certificate then mentions. Bounds and digits of the remaining data stay valid.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) if the indices do not ascend or are not below the number of modes; the errors
    /// of [`FlexBody::new`] if `terms` contradict the groups.
    pub fn reduced(&self, modes: &[usize], groups: TermGroups, terms: Vec<TermDecision>) -> Result<Self> {
        let nf = self.n_modes();
        if modes.is_empty() || modes.windows(2).any(|w| w[0] >= w[1]) || modes[modes.len() - 1] >= nf {
            let message = format!("modes {modes:?} of {nf}, expected ascending indices below {nf}");
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let parts = self.parts();
        let all = modes.len() == nf;
        let invariants = parts.invariants.with_modes(modes).with_groups(groups);
        let unchanged = all && invariants.groups() == parts.invariants.groups();
        let lumped = |lumped: &LumpedBody| {
            let reduced = lumped.invariants.with_modes(modes).with_groups(groups);
            LumpedBody {
                // Another program may use other norms: recompute them only if the data changed.
                comparison: if unchanged {
                    lumped.comparison.clone()
                } else {
                    error_norms(&invariants, &reduced)
                },
                invariants: reduced,
                scheme: lumped.scheme.clone(),
                negative_masses: lumped.negative_masses,
            }
        };
        let stiffness = |stiffness: &GeometricStiffness<Mat<f64>>| GeometricStiffness {
            load: stiffness.load.clone(),
            matrix: square(&stiffness.matrix, modes),
        };
        let rotated = |stiffness: &RotatedStiffness| RotatedStiffness {
            modes: Mat::from_fn(modes.len(), 3, |i, k| stiffness.modes[(modes[i], k)]),
            ..stiffness.clone()
        };
        let before = parts.terms.iter().filter(|old| terms.iter().all(|new| new.group != old.group));
        let body = Self::new(Parts {
            description: parts.description.clone(),
            source: parts.source.clone(),
            dimension: parts.dimension,
            frame: parts.frame,
            conditions: parts.conditions.clone(),
            nodes: parts.nodes.clone(),
            mesh: parts.mesh.clone(),
            modes: parts.modes.some(modes),
            geometric_stiffness: parts.geometric_stiffness.iter().map(stiffness).collect(),
            rotated_stiffness: parts.rotated_stiffness.iter().map(rotated).collect(),
            estimated_stiffness: parts.estimated_stiffness.iter().map(stiffness).collect(),
            inertia_stiffness: parts.inertia_stiffness.as_ref().map(|inertia| InertiaStiffness {
                moments: inertia.moments.clone(),
                stiffness: inertia.stiffness.iter().map(stiffness).collect(),
            }),
            lumped: parts.lumped.iter().map(lumped).collect(),
            certificate: parts.certificate.of_some(modes, &parts.modes),
            interfaces: parts.interfaces.clone(),
            coordinates: parts.coordinates.clone().filter(|_| all),
            recoveries: self.reduced_recoveries(modes, invariants.groups()),
            named_loads: parts.named_loads.iter().map(|load| load.of_modes(modes)).collect(),
            terms: before.cloned().chain(terms.iter().cloned()).collect(),
            invariants,
            storage: parts.storage,
        })?;
        // W3 without S is stored on its own, as the difference of two rounded numbers: round it again.
        if parts.storage == Storage::F32 { body.rounded_to_f32() } else { Ok(body) }
    }
}

impl Modes {
    fn some(&self, modes: &[usize]) -> Self {
        let all = modes.len() == self.eigenvalue.len();
        Self {
            eigenvalue: entries(&self.eigenvalue, modes),
            residual: entries(&self.residual, modes),
            provenance: if self.provenance.is_empty() {
                Vec::new()
            } else {
                entries(&self.provenance, modes)
            },
            truncation: if all { self.truncation.clone() } else { Vec::new() },
            damping_ratio: entries(&self.damping_ratio, modes),
            modal_damping: self.modal_damping.as_ref().map(|damping| square(damping, modes)),
            shape: columns(&self.shape, modes),
            rotation: self.rotation.as_ref().map(|rotation| columns(rotation, modes)),
            internal: self.internal.as_ref().map(|internal| InternalRows {
                dofs: internal.dofs.clone(),
                shape: columns(&internal.shape, modes),
            }),
        }
    }
}

impl Certificate {
    /// Returns the certificate for a subset of the modes of this one.
    fn of_some(&self, modes: &[usize], of: &Modes) -> Self {
        let nf = of.eigenvalue.len();
        let all = modes.len() == nf;
        // The lowest modes of a complete set are complete.
        let lowest = modes[modes.len() - 1] + 1 == modes.len();
        let below = of.eigenvalue.iter().filter(|l| **l < self.shift).count();
        let complete = all || lowest && self.proved_modes.is_some_and(|count| below == count.min(nf));
        let left_out = || {
            let proved =
                |count: usize| format!(", of which the {count} below the shift were proved complete");
            let proved = self.proved_modes.map_or_else(String::new, proved);
            let remark = format!("{} of {nf} modes were kept{proved}", modes.len());
            if self.remark.is_empty() { remark } else { format!("{}; {remark}", self.remark) }
        };
        let guarantee = |guarantee: &Guarantee| Guarantee {
            eigenvalue_lower: entries(&guarantee.eigenvalue_lower, modes),
            eigenvalue_upper: entries(&guarantee.eigenvalue_upper, modes),
            shape_error: entries(&guarantee.shape_error, modes),
            ..*guarantee
        };
        Self {
            proved_modes: self.proved_modes.filter(|_| complete),
            remark: if complete { self.remark.clone() } else { left_out() },
            guarantee: self.guarantee.as_ref().map(guarantee),
            fixed_interface: self.fixed_interface.as_ref().map(|fixed| FixedInterface {
                eigenvalues: fixed.eigenvalues.clone(),
                free: fixed.free.as_ref().map(|free| FreeEstimate {
                    estimate: entries(&free.estimate, modes),
                    lower: entries(&free.lower, modes),
                }),
                ..*fixed
            }),
            ..*self
        }
    }
}

fn entries<T: Clone>(of_modes: &[T], modes: &[usize]) -> Vec<T> {
    modes.iter().map(|&j| of_modes[j].clone()).collect()
}

fn columns(a: &Mat<f64>, modes: &[usize]) -> Mat<f64> {
    Mat::from_fn(a.nrows(), modes.len(), |i, j| a[(i, modes[j])])
}

fn square(a: &Mat<f64>, modes: &[usize]) -> Mat<f64> {
    Mat::from_fn(modes.len(), modes.len(), |i, j| a[(modes[i], modes[j])])
}

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
    /// Indices of the fixed-interface modes of a Craig-Bampton body (from 0, ascending), beside all motions of its
    /// interfaces; `None` for all.
    pub fixed_interface_modes: Option<Vec<usize>>,
    /// Indices of the modes (from 0, ascending), of those that the fixed-interface modes leave; `None` for all.
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

    /// Parses numbers as [`Subset::parse_modes`] does, or `none` for no mode at all.
    ///
    /// # Errors
    /// The errors of [`Subset::parse_modes`].
    pub fn parse_some_modes(text: &str) -> Result<Vec<usize>> {
        if text.trim().eq_ignore_ascii_case("none") { Ok(Vec::new()) } else { Self::parse_modes(text) }
    }

    /// Returns the modes in the form that [`Subset::parse_some_modes`] reads.
    pub fn some_modes_text(modes: &[usize]) -> String {
        if modes.is_empty() { "none".to_owned() } else { Self::modes_text(modes) }
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
        let names: Vec<&str> = groups.kept().map(TermGroup::name).collect();
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
        if let Some(kept) = &subset.fixed_interface_modes {
            let others = Subset { fixed_interface_modes: None, ..subset.clone() };
            return self.with_fixed_interface_modes(kept)?.subset(&others);
        }
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
