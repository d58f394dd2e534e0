//! Layout of functions in the stub.

use super::StubFunction;
use std::collections::BTreeMap;

/// Largest number of characters of a line.
const WIDTH: usize = 120;

/// Returns the lines of a function: its parameters in one line, in a line of their own, or in one line each.
pub(super) fn function(stated: &StubFunction, indent: &str) -> String {
    let end = if stated.doc.is_empty() { ": ..." } else { ":" };
    let (name, parameters) = (&stated.name, stated.parameters.join(", "));
    let returns = format!(") -> {}{end}", stated.returns);
    let fits = |line: &str| line.chars().count() <= WIDTH;
    let decorators: String = stated.decorators.iter().map(|one| format!("{indent}@{one}\n")).collect();
    let (line, inner) =
        (format!("{indent}def {name}({parameters}{returns}"), format!("{indent}    {parameters}"));
    let head = if fits(&line) {
        line
    } else if fits(&inner) {
        format!("{indent}def {name}(\n{inner}\n{indent}{returns}")
    } else {
        let lines: String = stated.parameters.iter().map(|one| format!("{indent}    {one},\n")).collect();
        format!("{indent}def {name}(\n{lines}{indent}{returns}")
    };
    format!("{decorators}{head}\n{}", docstring(&stated.doc, &format!("{indent}    ")))
}

/// Returns the lines of a docstring; nothing for an empty one.
pub(super) fn docstring(doc: &str, indent: &str) -> String {
    if doc.is_empty() {
        return String::new();
    }
    let doc = doc.replace('\\', "\\\\").replace("\"\"\"", "\\\"\\\"\\\"");
    let lines: Vec<String> = doc
        .lines()
        .enumerate()
        .map(|(at, line)| match at {
            0 => format!("{indent}\"\"\"{line}"),
            _ if line.is_empty() => String::new(),
            _ => format!("{indent}{line}"),
        })
        .collect();
    // A quotation mark before the three of the end would be one of them.
    let end = if lines.len() > 1 || doc.ends_with('"') {
        format!("\n{indent}\"\"\"\n")
    } else {
        "\"\"\"\n".to_owned()
    };
    lines.join("\n") + &end
}

/// Returns the defaults in a `text_signature`, as in `($self, *, basis="free")`, by their parameters.
pub(super) fn defaults(text_signature: &str) -> BTreeMap<String, String> {
    let inner = text_signature.trim_start_matches('(').trim_end_matches(')');
    let parameters = inner.split(", ").filter_map(|one| one.split_once('='));
    parameters.map(|(name, default)| (name.to_owned(), default.to_owned())).collect()
}
