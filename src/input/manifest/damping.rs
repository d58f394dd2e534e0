//! The table `[damping]`.

use super::{MatrixLocation, Table, Value, Walk};
use crate::base::diagnostic::Code;
use crate::model::{Damping, DampingBand};
use std::path::Path;
use toml::de::DeValue;

pub(super) const DAMPING: &[&str] = &["ratio", "bands", "rayleigh", "matrix"];
pub(super) const BAND: &[&str] = &["to_hz", "ratio"];
pub(super) const RAYLEIGH: &[&str] = &["alpha", "beta"];

impl Walk<'_> {
    /// `None` without the table, and with something in `found` when it is wrong.
    pub(super) fn damping(&mut self, top: &Table) -> Option<Damping<MatrixLocation>> {
        let (table, span) = self.table(top, "damping")?;
        self.known_keys(table, "[damping]", DAMPING);
        let given: Vec<&str> = DAMPING.iter().copied().filter(|key| table.contains_key(*key)).collect();
        let &[key] = given.as_slice() else {
            let found = if given.is_empty() { "nothing".to_owned() } else { given.join(", ") };
            let message = format!("[damping] has {found}, expected one of {}", DAMPING.join(", "));
            self.complain(Code::ManifestSyntax, span, message);
            return None;
        };
        let damping = match key {
            "ratio" => Damping::Ratio(self.number(table, key, &span)?),
            "bands" => Damping::Bands(self.damping_bands(table.get(key)?)?),
            "rayleigh" => {
                let (table, span) = self.table(table, key)?;
                self.known_keys(table, "`rayleigh`", RAYLEIGH);
                let (alpha, beta) = (self.number(table, "alpha", &span), self.number(table, "beta", &span));
                Damping::Rayleigh { alpha: alpha?, beta: beta? }
            }
            _ => {
                let folder = self.path.parent().unwrap_or(Path::new(""));
                Damping::Matrix(MatrixLocation::parse(self.string(table, key)?).relative_to(folder))
            }
        };
        if let Some(problem) = damping.problem() {
            self.complain(Code::ManifestSyntax, span, problem);
            return None;
        }
        Some(damping)
    }

    /// Damping ratios by frequency, a list of `{ to_hz, ratio }` with ends in hertz; whether the numbers are sound is for
    /// the caller to see. `None` only with something in `found`.
    pub(crate) fn damping_bands(&mut self, value: &Value) -> Option<Vec<DampingBand>> {
        const EXPECTED: &str = "a list of tables { to_hz, ratio }, the last without to_hz";
        let DeValue::Array(list) = value.get_ref() else {
            self.mistyped("bands", value, EXPECTED);
            return None;
        };
        let mut bands = Vec::new();
        for item in list.iter() {
            let DeValue::Table(table) = item.get_ref() else {
                self.mistyped("bands", item, EXPECTED);
                return None;
            };
            self.known_keys(table, "a damping band", BAND);
            let end = table.contains_key("to_hz").then(|| self.number(table, "to_hz", &item.span()));
            let ratio = self.number(table, "ratio", &item.span())?;
            bands.push(DampingBand { to_hz: end.unwrap_or(Some(f64::INFINITY))?, ratio });
        }
        Some(bands)
    }
}
