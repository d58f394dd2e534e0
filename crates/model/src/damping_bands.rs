//! Damping ratios by frequency in TOML files of users.

use crate::DampingBand;
use flexbody_base::text::walk::{Value, Walk};
use toml::de::DeValue;

/// Keys of a damping band.
pub const DAMPING_BAND_KEYS: &[&str] = &["to_hz", "ratio"];

/// Reads damping ratios by frequency from manifests and scenes: a list of `{ to_hz, ratio }` with ends in
/// hertz. The values are not checked. If it returns `None`, it has added a diagnostic to `walk`.
pub fn damping_bands(walk: &mut Walk<'_>, value: &Value) -> Option<Vec<DampingBand>> {
    const EXPECTED: &str = "a list of tables { to_hz, ratio }, the last without to_hz";
    let DeValue::Array(list) = value.get_ref() else {
        walk.mistyped("bands", value, EXPECTED);
        return None;
    };
    let mut bands = Vec::new();
    for item in list.iter() {
        let DeValue::Table(table) = item.get_ref() else {
            walk.mistyped("bands", item, EXPECTED);
            return None;
        };
        walk.known_keys(table, "a damping band", DAMPING_BAND_KEYS);
        let end = table.contains_key("to_hz").then(|| walk.number(table, "to_hz", &item.span()));
        let ratio = walk.number(table, "ratio", &item.span())?;
        bands.push(DampingBand { to_hz: end.unwrap_or(Some(f64::INFINITY))?, ratio });
    }
    Some(bands)
}
