//! Errors of files with node positions.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_base::text::scanner::expected;

/// Returns FB115 at a line.
pub(super) fn syntax(file: &InputFile, line: usize, message: String) -> Vec<Diagnostic> {
    vec![Diagnostic::new(Code::NodeFileSyntax, message).in_file(file.path()).at_line(line)]
}

/// Returns FB115 for a line of an unexpected form.
pub(super) fn unexpected(file: &InputFile, line: usize, what: &str, found: &[u8]) -> Vec<Diagnostic> {
    vec![expected(Code::NodeFileSyntax, what, found).in_file(file.path()).at_line(line)]
}

/// Returns FB115 about a file without lines.
pub(super) fn refused(file: &InputFile, message: String, help: &str) -> Vec<Diagnostic> {
    vec![Diagnostic::new(Code::NodeFileSyntax, message).in_file(file.path()).with_help(help)]
}
