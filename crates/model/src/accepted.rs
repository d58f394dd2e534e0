//! Checks whose findings a user accepted.

use flexbody_base::diagnostic::Code;

/// Checks that a user may accept, each by the code of its error. The first [`OF_TRUE`] of them are those that the value
/// `true` accepts.
const CHECKS: [Code; 4] =
    [Code::MassOrder, Code::DensityImplausible, Code::RecoveryContradicts, Code::RigidMotionStrained];

/// Number of checks that `true` accepts, as versions before the choice of single checks did.
const OF_TRUE: usize = 3;

/// Checks whose findings are warnings instead of errors because the user accepted them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Accepted {
    /// True for each accepted one of the checks.
    checks: [bool; CHECKS.len()],
}

impl Accepted {
    /// Reads codes separated by commas, as `FB433,FB437`.
    ///
    /// # Errors
    /// A word that is not the code of such a check.
    pub fn from_codes(text: &str) -> Result<Self, String> {
        let mut accepted = Self::default();
        for word in text.split(',').map(str::trim) {
            let at = CHECKS.iter().position(|code| code.id().eq_ignore_ascii_case(word));
            accepted.checks[at.ok_or_else(|| word.to_owned())?] = true;
        }
        Ok(accepted)
    }

    /// Returns the codes of all checks that may be accepted, separated by commas.
    pub fn possible() -> String {
        CHECKS.map(Code::id).join(", ")
    }

    /// Returns the codes of the accepted checks.
    pub fn codes(self) -> Vec<&'static str> {
        let accepted = CHECKS.into_iter().zip(self.checks).filter(|(_, is_accepted)| *is_accepted);
        accepted.map(|(code, _)| code.id()).collect()
    }

    /// Returns true if the findings of the check with the code of its error are accepted.
    pub fn accepts(self, check: Code) -> bool {
        CHECKS.iter().zip(self.checks).any(|(code, accepted)| *code == check && accepted)
    }

    /// Returns the checks that are accepted here or in `other`.
    pub fn and(self, other: Self) -> Self {
        let mut both = self;
        both.checks.iter_mut().zip(other.checks).for_each(|(check, also)| *check |= also);
        both
    }
}

/// `true` accepts implausible densities, mass coupling without stiffness, and stresses that contradict the stiffness.
impl From<bool> for Accepted {
    fn from(all: bool) -> Self {
        let mut accepted = Self::default();
        accepted.checks[..OF_TRUE].fill(all);
        accepted
    }
}

/// Returns how a user accepts the findings of a check, in words.
pub(crate) fn acceptance(check: Code) -> String {
    format!("--allow-implausible={0} (or allow_implausible = [\"{0}\"] in [model])", check.id())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_accepts_its_check_alone() {
        for code in CHECKS {
            let accepted = Accepted::from_codes(code.id()).expect("a check");
            assert_eq!(accepted.codes(), [code.id()]);
            assert!(CHECKS.iter().all(|other| accepted.accepts(*other) == (*other == code)));
        }
        assert_eq!(Accepted::from_codes("FB410,FB436"), Err("FB436".to_owned()));
        assert!(!Accepted::from(true).accepts(Code::RigidMotionStrained), "true is what it was");
        assert_eq!(Accepted::from(false), Accepted::default());
        let both = Accepted::from_codes("FB433").expect("a check").and(Accepted::from(false));
        assert_eq!(both.codes(), ["FB433"]);
    }
}
