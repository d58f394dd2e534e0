//! Explanations of codes for `flexbody explain`, from the table of which `docs/reference/codes.md` is made.

use crate::diagnostic::{Code, Diagnostic, SUBJECTS, Severity};
use crate::error::Result;
use std::fmt;

/// Page of the documentation with all codes.
const PAGE: &str = "docs/reference/codes.md";

/// Number of codes that the message about an unknown code names.
const NAMED_NEAREST: usize = 4;

/// Codes with their meaning, cause and help: one code in full, or all codes in one line each. `to_string` gives the
/// text that `flexbody explain` prints.
///
/// ```
/// use flexbody_base::diagnostic::Explanation;
/// let text = Explanation::of(Some("408"))?.to_string();
/// assert!(text.starts_with("FB408 (error, exit code 2)"));
/// # Ok::<(), flexbody_base::error::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Explanation {
    /// One code.
    One(Code),
    /// All codes.
    All,
}

impl Explanation {
    /// Returns the explanation of a code (`FB408`, `fb408` or `408`), or of all codes without one.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage), with the nearest codes, if there is no such code.
    pub fn of(code: Option<&str>) -> Result<Self> {
        let Some(given) = code else { return Ok(Self::All) };
        let wanted = given.trim().to_uppercase();
        let wanted = wanted.strip_prefix("FB").unwrap_or(&wanted);
        let found = Code::ALL.iter().find(|code| digits(**code) == wanted);
        found.map(|code| Self::One(*code)).ok_or_else(|| {
            let nearest: Vec<&str> = nearest(wanted).into_iter().map(Code::id).collect();
            let help = format!(
                "the nearest codes are {}; flexbody explain without a code lists all of them",
                nearest.join(", ")
            );
            Diagnostic::new(Code::Usage, format!("`{given}` is not the code of a message"))
                .with_help(help)
                .into()
        })
    }

    /// Returns the codes that are explained.
    pub fn codes(self) -> Vec<Code> {
        match self {
            Self::One(code) => vec![code],
            Self::All => Code::ALL.to_vec(),
        }
    }
}

fn digits(code: Code) -> &'static str {
    code.id().trim_start_matches("FB")
}

/// Returns the codes whose digits are nearest to `wanted`: by the number of changed characters, then by value.
fn nearest(wanted: &str) -> Vec<Code> {
    let number = wanted.parse::<i64>().ok();
    let distance = |code: &Code| {
        let own = digits(*code);
        let value = own.parse::<i64>().unwrap_or(0);
        let apart = number.map_or(0, |number| (number - value).abs());
        (strsim::damerau_levenshtein(wanted, own), apart)
    };
    let mut codes = Code::ALL.to_vec();
    codes.sort_by_key(|code| (distance(code), code.id()));
    codes.truncate(NAMED_NEAREST);
    codes.sort_by_key(|code| code.id());
    codes
}

/// Returns the heading of a code, such as `FB408 (error, exit code 2)`.
fn heading(code: Code) -> String {
    match code.severity() {
        Severity::Error => format!("{} (error, exit code {})", code.id(), code.exit_code() as u8),
        other => format!("{} ({})", code.id(), other.name()),
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One(code) => {
                writeln!(f, "{}", heading(*code))?;
                writeln!(f, "  meaning: {}", code.title())?;
                writeln!(f, "  cause: {}", code.cause())?;
                writeln!(f, "  help: {}", code.help())?;
                writeln!(
                    f,
                    "The message of a run adds the facts of the model, and may have a more precise help. All codes: {PAGE}"
                )
            }
            Self::All => {
                for (hundred, subject) in SUBJECTS {
                    writeln!(f, "FB{hundred}xx: {subject}")?;
                    for code in Code::ALL.iter().filter(|code| digits(**code).starts_with(hundred)) {
                        writeln!(f, "  {} {:7} {}", code.id(), code.severity().name(), code.title())?;
                    }
                }
                writeln!(f, "flexbody explain CODE explains one of them.")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_is_found_however_it_is_written() {
        for written in ["FB408", "fb408", "408", " Fb408 "] {
            assert_eq!(Explanation::of(Some(written)).unwrap(), Explanation::One(Code::MassDirectional));
        }
    }

    #[test]
    fn unknown_codes_name_the_nearest() {
        for (unknown, near) in [("FB405", "FB404"), ("FB417", "FB416"), ("FB4O8", "FB408"), ("40", "FB40")] {
            let error = Explanation::of(Some(unknown)).unwrap_err();
            let help = error.diagnostics()[0].help().to_owned();
            assert!(help.contains(near), "{unknown}: {help}");
        }
        assert!(Explanation::of(Some("")).is_err());
    }

    #[test]
    fn the_list_has_every_code_once() {
        let list = Explanation::All.to_string();
        for code in Code::ALL {
            assert_eq!(list.matches(code.id()).count(), 1, "{}", code.id());
        }
    }

    #[test]
    fn every_cause_is_a_sentence_of_its_own() {
        for code in Code::ALL {
            let cause = code.cause();
            assert!(
                cause.ends_with('.') && cause.starts_with(|c: char| c.is_uppercase() || c == '-'),
                "{cause}"
            );
            assert!(!cause.contains('|'), "{cause} would break the table");
            let others = Code::ALL.iter().filter(|other| other.cause() == cause);
            assert_eq!(others.count(), 1, "{cause}");
        }
    }
}
