//! Conditions on the loads of geometric stiffness.

use super::wording::name_some;
use super::{GeometricStiffness, LoadKind, NodeSet, RawMatrix, UnitLoad};
use flexbody_base::diagnostic::{Code, Diagnostic};

/// Longest name of a load in bytes, since the name becomes a group name in the file.
const MAX_NAME_BYTES: usize = 200;

/// Adds errors about the loads by themselves.
pub(super) fn check_loads(
    given: &[GeometricStiffness<RawMatrix>],
    interfaces: &[NodeSet],
    dimension: usize,
    found: &mut Vec<Diagnostic>,
) {
    for (i, GeometricStiffness { load, matrix }) in given.iter().enumerate() {
        let mut complain =
            |code, message: String| found.push(Diagnostic::new(code, message).in_file(&matrix.path));
        let (kind, name) = (&load.kind, load.to_string());
        if !kind.of_dimension(dimension).contains(&load.component) {
            let have: Vec<&str> =
                kind.of_dimension(dimension).iter().map(|&c| kind.components()[c]).collect();
            let have = have.join(", ");
            complain(
                Code::ManifestSyntax,
                format!(
                    "geometric stiffness is given for {name}; a body of dimension {dimension} has {have}"
                ),
            );
        } else if matches!(kind, LoadKind::Named(name) if name.is_empty() || name.len() > MAX_NAME_BYTES || name.contains('\0'))
        {
            let message =
                "a load of geometric stiffness has no name, or one that is too long or has a NUL in it";
            complain(Code::ManifestSyntax, message.to_owned());
        } else if given[..i].iter().any(|other| other.load == *load) {
            complain(Code::ManifestSyntax, format!("geometric stiffness for {name} is given twice"));
        } else if let Some(at) = kind.interface()
            && interfaces.iter().all(|set| set.name != at)
        {
            let known: Vec<&String> = interfaces.iter().map(|set| &set.name).collect();
            let known = if known.is_empty() { "none".to_owned() } else { name_some(&known) };
            let message =
                format!("geometric stiffness is given for {name}; interfaces of the model: {known}");
            let complaint = Diagnostic::new(Code::InterfaceNode, message).in_file(&matrix.path);
            found.push(complaint.with_help("name an [[interface]] of the manifest"));
        }
    }
}

/// Returns a note about each kind of load with only some components given.
pub(super) fn missing_components<K>(given: &[GeometricStiffness<K>], dimension: usize) -> Option<Diagnostic> {
    let loads: Vec<&UnitLoad> = given.iter().map(|one| &one.load).collect();
    let mut missing: Vec<UnitLoad> = Vec::new();
    for kind in loads.iter().map(|load| &load.kind) {
        for &component in kind.of_dimension(dimension) {
            let load = UnitLoad { kind: kind.clone(), component };
            if !loads.contains(&&load) && !missing.contains(&load) {
                missing.push(load);
            }
        }
    }
    (!missing.is_empty()).then(|| {
        let message = format!("geometric stiffness is taken as zero for {}", name_some(&missing));
        Diagnostic::new(Code::GeometricStiffnessPartial, message)
    })
}
