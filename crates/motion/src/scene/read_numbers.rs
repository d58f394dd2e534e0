//! Reads the numbers of a scene.
//!
//! Every function gives `None` only with something in `found`.

use flexbody_base::text::walk::{TomlTable, Walk};
use std::ops::Range;

/// A finite number that must be there.
pub(super) fn finite(walk: &mut Walk<'_>, table: &TomlTable, key: &str, span: &Range<usize>) -> Option<f64> {
    let number = walk.number(table, key, span)?;
    if !number.is_finite() {
        walk.wrong(place_of(table, key, span), format!("`{key}` is {number}, expected a finite number"));
        return None;
    }
    Some(number)
}

/// A positive number that must be there.
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

/// Where the value of `key` stands; `span` is that of its table.
pub(super) fn place_of(table: &TomlTable, key: &str, span: &Range<usize>) -> Range<usize> {
    table.get(key).map_or_else(|| span.clone(), |value| value.span())
}
