//! Which matrix is meant of a file that holds several under names.

use super::reader::MatrixRole;
use flexbody_base::diagnostic::{Code, Diagnostic};

/// How a format calls what holds a matrix, in messages.
pub(super) struct NamedMatrices {
    /// One of them, as in `group`.
    pub holder: &'static str,
    /// A file, as in `FILE.h5`.
    pub file: &'static str,
    /// Several matrices, as in `sparse matrices`.
    pub matrices: &'static str,
}

impl NamedMatrices {
    /// The only matrix of the file, or the only one named after its role. `names` are paths from `/`.
    ///
    /// # Errors
    /// FB310 when the only matrix is named like another one, or when names do not tell which is meant.
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

    /// The help that names what there is.
    pub(super) fn listing(&self, names: &[&str]) -> String {
        let more = if names.len() > 8 { ", ..." } else { "" };
        let shown = names[..names.len().min(8)].join(", ");
        format!("name the {0} as {1}:/{0}; the file has {shown}{more}", self.holder, self.file)
    }
}
