//! The choice of a matrix in a file that holds several under names.

use super::reader::MatrixRole;
use flexbody_base::diagnostic::{Code, Diagnostic};

/// Words of a format for messages.
pub(super) struct NamedMatrices {
    /// Holder of a matrix, as in `group`.
    pub holder: &'static str,
    /// Pattern of a file name, as in `FILE.h5`.
    pub file: &'static str,
    /// Plural of the matrices, as in `sparse matrices`.
    pub matrices: &'static str,
}

impl NamedMatrices {
    /// Returns the index of the only matrix of the file, or of the only one named after its role. `names` are paths
    /// from `/`.
    ///
    /// # Errors
    /// FB310 if the only matrix is named after another role, or if the names do not determine the matrix.
    pub(super) fn choose(&self, names: &[&str], role: MatrixRole) -> Result<usize, Diagnostic> {
        let last = |name: &str| name.rsplit('/').next().unwrap_or("").to_owned();
        if let [name] = names {
            let named = |other: &&MatrixRole| **other != role && other.is_named(&last(name));
            let Some(other) = MatrixRole::ALL.iter().find(named).map(|other| other.name()) else {
                return Ok(0);
            };
            let message = format!("the only matrix of the file, `{name}`, is named like the {other} matrix");
            let help = format!(
                "if it is the {} matrix, name the {}: {}:{name}",
                role.name(),
                self.holder,
                self.file
            );
            return Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(help));
        }
        let mut by_name = (0..names.len()).filter(|&k| role.is_named(&last(names[k])));
        match (by_name.next(), by_name.next()) {
            (Some(only), None) => Ok(only),
            _ => {
                let (count, role) = (names.len(), role.name());
                let message = format!("file holds {count} {}; which is the {role} matrix?", self.matrices);
                Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(self.listing(names)))
            }
        }
    }

    /// Returns the help that lists the matrices of the file.
    pub(super) fn listing(&self, names: &[&str]) -> String {
        let more = if names.len() > 8 { ", ..." } else { "" };
        let shown = names[..names.len().min(8)].join(", ");
        format!("name the {0} as {1}:/{0}; the file has {shown}{more}", self.holder, self.file)
    }
}
