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

// The choice of a matrix among several in a file of Nastran, by their names, whose first letter is the role.

/// Returns true when Nastran gives this name to a matrix of this role: `K...`, `M...`, `B...`, and `KD...` for
/// differential stiffness. `K4...` is structural damping.
fn is_called(role: MatrixRole, name: &str) -> bool {
    let name = name.to_ascii_uppercase();
    let begins = |head: &str| name.starts_with(head);
    match role {
        MatrixRole::Stiffness => begins("K") && !begins("K4") && !begins("KD"),
        MatrixRole::Mass => begins("M"),
        MatrixRole::Damping => begins("B") || begins("D"),
        MatrixRole::GeometricStiffness => begins("KD") || begins("KG"),
    }
}

/// Returns the index of the matrix that a user has named, or of the only one of its role.
///
/// # Errors
/// FB310 if there is none, or more than one.
pub(super) fn choose(names: &[String], role: MatrixRole, group: Option<&str>) -> Result<usize, Diagnostic> {
    let refused = |message: String| Diagnostic::new(Code::Hdf5Layout, message).with_help(listing(names));
    if let Some(group) = group {
        let wanted = group.trim_matches('/');
        let mut found = (0..names.len()).filter(|&k| names[k].eq_ignore_ascii_case(wanted));
        return match (found.next(), found.next()) {
            (Some(only), None) => Ok(only),
            (None, _) => Err(refused(format!("the file has no matrix `{wanted}`"))),
            _ => Err(refused(format!("the file has several matrices `{wanted}`"))),
        };
    }
    let mut of_role = (0..names.len()).filter(|&k| is_called(role, &names[k]));
    match (of_role.next(), of_role.next(), names) {
        (Some(only), None, _) => Ok(only),
        (None, _, [only]) => {
            let other = MatrixRole::ALL.iter().find(|other| is_called(**other, only));
            match other {
                None => Ok(0),
                Some(other) => {
                    let message = format!(
                        "the only matrix of the file, `{only}`, is named like a {} matrix",
                        other.name()
                    );
                    Err(refused(message))
                }
            }
        }
        (first, _, _) => {
            let count = if first.is_none() { "none" } else { "several" };
            let message = format!(
                "of {} matrices {count} {} named like a {} matrix",
                names.len(),
                if first.is_none() { "is" } else { "are" },
                role.name()
            );
            Err(refused(message))
        }
    }
}

/// Returns the index of the matrix that a user has named, or of the only one of a file.
///
/// # Errors
/// FB310 if there is none, or more than one.
pub(super) fn named_or_only(names: &[String], name: Option<&str>) -> Result<usize, Diagnostic> {
    match (name, names.len()) {
        (Some(_), _) => choose(names, MatrixRole::Stiffness, name),
        (None, 1) => Ok(0),
        (None, count) => {
            let message = format!("the file has {count} matrices; which is the operator?");
            Err(Diagnostic::new(Code::Hdf5Layout, message).with_help(listing(names)))
        }
    }
}

fn listing(names: &[String]) -> String {
    const MAX_SHOWN: usize = 12;
    if names.is_empty() {
        return "write the matrix again".to_owned();
    }
    let more = if names.len() > MAX_SHOWN { ", ..." } else { "" };
    let shown = &names[..names.len().min(MAX_SHOWN)];
    format!("name the matrix as FILE:/NAME; the file has {}{more}", shown.join(", "))
}

/// Returns the indices of the stiffness and mass matrix that a user has named; their names may begin with a `/`.
///
/// # Errors
/// An empty list of pairs, if there is not exactly one matrix of each name.
pub(crate) fn named_pair(
    names: &[String],
    stated: &[String; 2],
) -> Result<(usize, usize), Vec<(usize, usize)>> {
    let [k, m] = stated.each_ref().map(|wanted| {
        let is_wanted = |k: &usize| names[*k].eq_ignore_ascii_case(wanted.trim_matches('/'));
        let mut found = (0..names.len()).filter(is_wanted);
        found.next().filter(|_| found.next().is_none())
    });
    k.zip(m).ok_or_else(Vec::new)
}

/// Returns the pair of stiffness and mass matrix among the matrices of a job: names that differ in their first letter
/// only, or the only two.
///
/// # Errors
/// The candidate pairs, if there is not exactly one.
pub(crate) fn pair(names: &[String]) -> Result<(usize, usize), Vec<(usize, usize)>> {
    let of = |role| (0..names.len()).filter(move |&k| is_called(role, &names[k])).collect::<Vec<_>>();
    let (stiffness, mass) = (of(MatrixRole::Stiffness), of(MatrixRole::Mass));
    let rest = |k: usize| names[k].get(1..).unwrap_or_default();
    let all = || stiffness.iter().flat_map(|&k| mass.iter().map(move |&m| (k, m)));
    let alike: Vec<(usize, usize)> = all().filter(|&(k, m)| rest(k).eq_ignore_ascii_case(rest(m))).collect();
    let pairs = if alike.is_empty() { all().collect() } else { alike };
    match pairs.as_slice() {
        &[pair] => Ok(pair),
        _ => Err(pairs),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn a_pair_has_names_that_differ_in_their_first_letter() {
        assert_eq!(pair(&names("KAAX MAAX K4AAX BAAX PAX")), Ok((0, 1)));
        assert_eq!(pair(&names("STIFF MASS KMAT")), Ok((2, 1)));
        assert_eq!(pair(&names("KGG MGG KAA MAA")), Err(vec![(0, 1), (2, 3)]));
        assert_eq!(pair(&names("KGG KAA")), Err(vec![]));
    }

    #[test]
    fn a_matrix_is_chosen_by_its_name_or_its_role() {
        let all = names("KAAX MAAX K4AAX KDAA");
        assert_eq!(choose(&all, MatrixRole::Stiffness, None), Ok(0));
        assert_eq!(choose(&all, MatrixRole::GeometricStiffness, None), Ok(3));
        assert_eq!(choose(&all, MatrixRole::Stiffness, Some("/k4aax")), Ok(2));
        assert!(choose(&all, MatrixRole::Damping, None).is_err());
        assert!(choose(&names("MGG"), MatrixRole::Stiffness, None).is_err());
        assert_eq!(choose(&names("XYZ"), MatrixRole::Stiffness, None), Ok(0));
    }
}
