//! Comma-separated values; numbers round-trip.

/// Adds a row to the table.
pub(crate) fn push_row(table: &mut String, cells: impl IntoIterator<Item = String>) {
    table.push_str(&cells.into_iter().collect::<Vec<_>>().join(","));
    table.push('\n');
}

/// Returns the cell of a number; empty for `None`.
pub(crate) fn number(value: impl Into<Option<f64>>) -> String {
    value.into().map_or_else(String::new, |value| format!("{value:e}"))
}

/// Returns the cell of a text, quoted if it contains a separator.
pub(crate) fn text(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
