//! Readers of numbers in a scene.
//!
//! A function that returns `None` has added a diagnostic to `found`.

use flexbody_base::text::walk::{TomlTable, Walk};
use std::ops::Range;

/// Reads a required finite number.
pub(super) fn finite(walk: &mut Walk<'_>, table: &TomlTable, key: &str, span: &Range<usize>) -> Option<f64> {
    let number = walk.number(table, key, span)?;
    if !number.is_finite() {
        walk.wrong(place_of(table, key, span), format!("`{key}` is {number}, expected a finite number"));
        return None;
    }
    Some(number)
}

/// Reads a required positive number.
pub(super) fn positive(
    walk: &mut Walk<'_>,
    table: &TomlTable,
    key: &str,
    span: &Range<usize>,
) -> Option<f64> {
    let number = finite(walk, table, key, span)?;
    if number <= 0.0 {
        walk.wrong(place_of(table, key, span), format!("`{key}` is {number}, expected a positive number"));
        return None;
    }
    Some(number)
}

/// Returns the position of the value of `key` in the file; `span` is that of its table.
pub(super) fn place_of(table: &TomlTable, key: &str, span: &Range<usize>) -> Range<usize> {
    table.get(key).map_or_else(|| span.clone(), |value| value.span())
}
