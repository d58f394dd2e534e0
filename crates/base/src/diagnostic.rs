//! Messages of the program. The table of codes (`codes.rs`) gives each code its severity, exit code, title, cause and
//! default help; `docs/reference/codes.md` is generated from it, and `fixtures/cases/` triggers each code.

mod codes;

pub use crate::explanation::Explanation;
pub use codes::Code;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Severity of a diagnostic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, strum::IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Severity {
    /// Fact that the user should know.
    Note,
    /// Valid result with an unusual property.
    Warning,
    /// Operation that cannot be done, or whose result cannot be trusted.
    Error,
}

impl Severity {
    /// Returns the name of the severity: `note`, `warning` or `error`.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Subjects of the codes, by their first digit.
pub(crate) const SUBJECTS: [(char, &str); 9] = [
    ('1', "files, and input decks of FE programs"),
    ('2', "manifest, tables, scene file"),
    ('3', "matrices and arrays"),
    ('4', "checks of the model: mass, stiffness, rigid motion, units, interfaces"),
    ('5', "modes, bases, simulation, selection"),
    ('6', "memory, disk, time, processes"),
    ('7', "flex-body files, files of other programs, cluster, batches"),
    ('8', "command line"),
    ('9', "internal errors"),
];

/// Returns the content of `docs/reference/codes.md`: the table of codes and the exit codes.
pub fn codes_markdown() -> String {
    let mut out = String::from(
        "<!-- Generated from the table in crates/base/src/diagnostic/codes.rs: FLEXBODY_BLESS=1 cargo test --test program docs_generated -->\n\n\
         # Diagnostics and exit codes\n\n\
         A message begins with its severity and its code (`error[FB101]: ...`); its line `help:` says what to do next. The\n\
         table of [codes](#codes) has the cause and the general help of each code; the message of a run may have a more precise\n\
         help. `flexbody explain FB408` prints the row of a code, `flexbody explain` lists all codes.\n\n\
         ## Exit codes\n\n\
         | exit code | meaning |\n|---|---|\n\
         | 0 | the work was done |\n\
         | 1 | a check failed or a tolerance was exceeded; the inputs themselves were readable |\n\
         | 2 | bad input or usage |\n\
         | 3 | no trustworthy numerical result: not converged, mechanism, indefinite mass |\n\
         | 4 | not enough memory or disk, or an output that may not be written (no permission, a read-only file system: FB121) |\n\
         | 70 | internal error: a bug of flexbody |\n\
         | 130 | interrupted (Ctrl-C), terminated (SIGTERM) or disconnected from its terminal (SIGHUP); no unfinished file is left |\n\n\
         Any other signal that ends programs also ends this one, after its unfinished files are removed: a shell reports\n\
         128 + the number of the signal. With exit code 0 all outputs are in their places, with 1 too unless the message\n\
         says that nothing is written. With 2, 3, 4, 70, 130 and after a signal no output is, and the files that they\n\
         would have replaced are there ([output files](runs.md#output-files)).\n\n\
         A process ends with the exit code of its first error; warnings and notes do not change it, unless\n\
         `--deny-warnings` treats a warning as a failed check (1): then nothing is written.\n\n\
         ## Codes\n\n\
         A **warning** means that the result may be wrong or incomplete for your purpose. A **note** states a fact or a\n\
         choice of the program; act on it only if its help says so.\n\n\
         | codes | subject |\n|---|---|\n",
    );
    for (hundred, subject) in SUBJECTS {
        out.push_str(&format!("| FB{hundred}xx | {subject} |\n"));
    }
    out.push_str("\n| code | severity | exit code | meaning | cause | help |\n|---|---|---|---|---|---|\n");
    for code in Code::ALL {
        let severity = code.severity().name();
        let exit = if code.severity() == Severity::Error {
            (code.exit_code() as u8).to_string()
        } else {
            String::new()
        };
        let (id, title, cause, help) = (code.id(), code.title(), code.cause(), code.help());
        out.push_str(&format!("| {id} | {severity} | {exit} | {title} | {cause} | {help} |\n"));
    }
    out
}

/// Diagnostic: its message, its location and its help.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    code: Code,
    message: String,
    file: Option<PathBuf>,
    line: Option<usize>,
    help: Option<String>,
}

/// Value of a step, or the errors that prevent it.
pub type Diagnosed<T> = Result<T, Vec<Diagnostic>>;

impl Diagnostic {
    /// Creates a diagnostic with `message`, a lowercase text that says what is wrong, with the facts.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), file: None, line: None, help: None }
    }

    /// Adds the file.
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        self.file = Some(file.as_ref().to_path_buf());
        self
    }

    /// Adds the line (from 1) of the file.
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// Replaces the help of the table by a more precise one.
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Prefixes the message with its subject.
    pub fn about(mut self, what: impl std::fmt::Display) -> Self {
        self.message = format!("{what}: {}", self.message);
        self
    }

    /// Replaces every quotation between backticks by dots.
    pub fn without_quotes(mut self) -> Self {
        let parts: Vec<&str> = self.message.split('`').collect();
        // Every second part is between backticks.
        let shown =
            |(k, part): (usize, &&str)| if k % 2 == 1 { "...".to_owned() } else { (*part).to_owned() };
        self.message = parts.iter().enumerate().map(shown).collect::<Vec<_>>().join("`");
        self
    }

    /// Returns the code.
    pub fn code(&self) -> Code {
        self.code
    }

    /// Returns the severity, from the table.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }

    /// Returns the message: what is wrong, with the facts.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns the file of the problem.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// Returns the line (from 1) of the problem.
    pub fn line(&self) -> Option<usize> {
        self.line
    }

    /// Returns the advice.
    pub fn help(&self) -> &str {
        self.help.as_deref().unwrap_or(self.code.help())
    }
}

impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let severity = self.severity().name();
        write!(f, "{severity}[{}]: {}", self.code.id(), printable(&self.message))?;
        if let Some(file) = &self.file {
            let name = file.display().to_string().replace('\n', "\\n");
            write!(f, "\n  in {}", printable(&name))?;
            if let Some(line) = self.line {
                write!(f, ", line {line}")?;
            }
        }
        write!(f, "\n  help: {}", printable(self.help()))
    }
}

/// Returns the text with escaped terminal commands: control characters except line ends and tabs, and characters that
/// change the direction of writing, are shown by their numbers, such as `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_command) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| if is_command(c) { c.escape_unicode().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(shown).collect())
}

fn is_command(c: char) -> bool {
    c.is_control() && !matches!(c, '\n' | '\t')
        || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}')
}

impl serde::Serialize for Diagnostic {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct;
        let mut s = serializer.serialize_struct("Diagnostic", 6)?;
        s.serialize_field("code", self.code.id())?;
        s.serialize_field("severity", &self.severity())?;
        s.serialize_field("message", &self.message)?;
        s.serialize_field("file", &self.file.as_ref().map(|f| f.display().to_string()))?;
        s.serialize_field("line", &self.line)?;
        s.serialize_field("help", self.help())?;
        s.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_take_for_a_command_is_shown_by_its_number() {
        let diagnostic = Diagnostic::new(Code::Hdf5Layout, "group `\u{1b}]0;t\u{7}K\u{9b}31m` \u{202e}x")
            .in_file("a\nb\u{1b}[31m.h5")
            .with_help("\u{1b}[2J");
        let told = diagnostic.to_string();
        assert!(!told.contains(is_command), "{told:?}");
        assert!(
            told.contains("`\\u{1b}]0;t\\u{7}K\\u{9b}31m`") && told.contains("a\\nb\\u{1b}[31m.h5"),
            "{told}"
        );
        assert_eq!(printable("a\tb\nc"), "a\tb\nc");
    }

    #[test]
    fn quotes_are_left_out() {
        let of = |message: &str| Diagnostic::new(Code::TableHeader, message).without_quotes().message;
        assert_eq!(of("column `root:$6$` is not `node`"), "column `...` is not `...`");
        assert_eq!(of("file does not exist"), "file does not exist");
        assert_eq!(of("an open `quote"), "an open `...");
    }
}
