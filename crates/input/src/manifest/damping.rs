//! The table `[damping]`.

use super::{ManifestWalk, MatrixLocation, TomlTable};
use flexbody_base::diagnostic::Code;
use flexbody_model::{Damping, damping_bands};
use std::path::Path;

pub(super) const DAMPING: &[&str] = &["ratio", "bands", "rayleigh", "matrix"];
pub(super) const RAYLEIGH: &[&str] = &["alpha", "beta"];

impl ManifestWalk<'_, '_> {
    /// Reads the damping. `None` means that there is no table, or that `found` has errors.
    pub(super) fn damping(&mut self, top: &TomlTable) -> Option<Damping<MatrixLocation>> {
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
            "bands" => Damping::Bands(damping_bands(self, table.get(key)?)?),
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
}
