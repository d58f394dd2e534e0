//! Named loads: nodal forces that act on the body as one load with an amplitude.

use crate::recovery::{self, Problem, RowsOfFiles};
use crate::rows::{centre_and_length, rigid_count};
use crate::{GeometricStiffness, LoadKind, LostRow, NodeSet, Nodes, Rows, UnitLoad};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use std::collections::HashSet;
use std::path::PathBuf;

/// Nodal forces with a name: a load of unit amplitude, along the axes of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelLoad {
    /// Name, unique in the model and different from those of the interfaces.
    pub name: String,
    /// Forces. A reader delivers the rows of the files, a checked model has its internal rows.
    pub forces: Vec<f64>,
    /// True if the load acts always with amplitude 1.
    pub preload: bool,
    /// File of the forces, for messages; empty for data in memory.
    pub path: PathBuf,
}

/// Columns of the tables of runs whose names no load may have, since its own column has its name.
const OTHER_COLUMNS: [&str; 5] = ["time", "kinetic", "elastic", "work", "mean_axes"];

/// Beginnings of the names of such columns, before a number or an axis.
const OTHER_VECTORS: [&str; 15] = [
    "q_",
    "qd_",
    "qdd_",
    "mean_axes_q_",
    "mean_axes_qd_",
    "mean_axes_qdd_",
    "origin_",
    "attitude_",
    "velocity_",
    "angular_velocity_",
    "linear_momentum_",
    "angular_momentum_",
    "reaction_force_",
    "reaction_torque_",
    "conditions_torque_",
];

/// Largest resultant of a preload, force or moment over the size of the body, relative to the sum of the magnitudes of its
/// forces. Vectors written with ten digits reach 1e-10; a larger limit lets a load pass that moves the body.
const MAX_PRELOAD_RESULTANT: f64 = 1e-9;

/// Returns the loads in the internal order of rows; adds an error for each that is not valid.
pub(crate) fn checked_loads(
    given: Vec<ModelLoad>,
    of_files: &RowsOfFiles<'_>,
    interfaces: &[NodeSet],
    rows: &Rows,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<ModelLoad> {
    let mut names = HashSet::new();
    let mut checked = Vec::with_capacity(given.len());
    for load in given {
        let valid = refuse_name(&load.name, &mut names, interfaces)
            .and_then(|()| in_internal_rows(&load.name, &load.forces, of_files))
            .and_then(|forces| refuse_rows_without_place(&load.name, &forces, rows).map(|()| forces));
        match valid {
            Ok(forces) => checked.push(ModelLoad { forces, ..load }),
            Err((code, message)) => {
                let message = format!("named load {message}");
                diagnostics.push(Diagnostic::new(code, message).in_file(&load.path));
            }
        }
    }
    checked
}

fn refuse_name(name: &str, seen: &mut HashSet<String>, interfaces: &[NodeSet]) -> Result<(), Problem> {
    let is_component = |rest: &str| ["x", "y", "z"].contains(&rest) || rest.parse::<u32>().is_ok();
    let is_other = |name: &str| {
        let is_vector = |first: &&str| name.strip_prefix(*first).is_some_and(is_component);
        OTHER_COLUMNS.contains(&name) || OTHER_VECTORS.iter().any(is_vector)
    };
    let wrong = match name {
        _ if interfaces.iter().any(|set| set.name == name) => "an interface",
        _ if is_other(name) => "a column of the table of a run",
        _ if is_step(name, interfaces) => "a step of `flexbody shapes`",
        _ => return recovery::refuse_name(name, seen),
    };
    Err((Code::ManifestSyntax, format!("`{name}` has the name of {wrong}: give it another one")))
}

/// Returns true for the names that `flexbody shapes` gives to modes, and to static responses to spin and to unit loads at
/// interfaces: `mode 1`, `spin xy`, `tip Fx`.
fn is_step(name: &str, interfaces: &[NodeSet]) -> bool {
    let Some((of, part)) = name.rsplit_once(' ') else { return false };
    match of {
        "mode" => part.parse::<u32>().is_ok(),
        "spin" => part.len() == 2 && part.bytes().all(|axis| b"xyz".contains(&axis)),
        _ => {
            UnitLoad::at_interface(of).iter().any(|load| load.step() == name)
                && interfaces.iter().any(|set| set.name == of)
        }
    }
}

/// Returns the forces in the internal order of rows.
fn in_internal_rows(name: &str, forces: &[f64], of_files: &RowsOfFiles<'_>) -> Result<Vec<f64>, Problem> {
    let refuse = |message: String| (Code::NamedLoadMisfit, format!("`{name}`: {message}"));
    if !of_files.fit(forces.len()) {
        return Err(refuse(format!(
            "its vector has {} values, the matrices have {} rows",
            forces.len(),
            of_files.matrix_rows
        )));
    }
    if let Some(at) = forces.iter().position(|value| !value.is_finite()) {
        return Err((
            Code::MatrixNotFinite,
            format!("`{name}`: value {} of its vector is not finite", at + 1),
        ));
    }
    let nonzero = forces.iter().enumerate().filter(|(_, value)| **value != 0.0);
    let entries: Vec<(u32, u32, f64)> = nonzero.map(|(row, value)| (row as u32, 0, *value)).collect();
    if entries.is_empty() {
        return Err(refuse("all of its forces are zero".to_owned()));
    }
    let column = CscMatrix::from_triplets(forces.len(), 1, &entries);
    let column = of_files
        .internal(column)
        .map_err(|LostRow| refuse("it has forces in rows that K and M leave empty".to_owned()))?;
    let mut internal = vec![0.0; column.n_rows()];
    let (rows, values) = column.column(0);
    rows.iter().zip(values).for_each(|(&row, &value)| internal[row as usize] += value);
    Ok(internal)
}

/// Refuses forces on rows that are no displacements or rotations of nodes: their moment on a deformed body is not known.
fn refuse_rows_without_place(name: &str, forces: &[f64], rows: &Rows) -> Result<(), Problem> {
    let [vectors, others] = rows.without_place();
    let loaded = vectors.chain(others).filter(|&row| forces[row] != 0.0).count();
    if loaded == 0 {
        return Ok(());
    }
    let message = format!("`{name}`: it has forces in {loaded} rows that belong to no position in space");
    Err((Code::NamedLoadMisfit, message))
}

/// Returns an error for each preload with geometric stiffness, which would act always: the stiffness with preload is that of
/// the modes only if it is in K.
pub(crate) fn refuse_stiff_preloads(
    all: &[ModelLoad],
    stiffness: &[GeometricStiffness<SymmetricMatrix>],
) -> Vec<Diagnostic> {
    let is_stiff = |load: &&ModelLoad| {
        let named = |kind: &LoadKind| matches!(kind, LoadKind::Named(name) if *name == load.name);
        load.preload && stiffness.iter().any(|stiffness| named(&stiffness.load.kind))
    };
    let refused = |load: &ModelLoad| {
        let message =
            format!("preload `{}` has geometric stiffness, which no mode of the body would have", load.name);
        let help = "give K with the stress of the preload as stiffness (docs/how_to/geometric_stiffness.md) and leave its [[geometric_stiffness]] out";
        Diagnostic::new(Code::NamedLoadMisfit, message).in_file(&load.path).with_help(help)
    };
    all.iter().filter(is_stiff).map(refused).collect()
}

/// Returns an error for each preload with a resultant.
pub(crate) fn check_preloads(all: &[ModelLoad], rows: &Rows, nodes: &Nodes) -> Vec<Diagnostic> {
    if !all.iter().any(|load| load.preload) {
        return Vec::new();
    }
    let (centre, length) = centre_and_length(&nodes.positions);
    // Rotations are divided by the length, so that all components of the resultant are forces.
    let fields = rows.rigid_fields(&nodes.positions, centre, length);
    let sizes = rows.field_sizes(length);
    let unbalanced = |load: &ModelLoad| {
        let of = |c: usize| load.forces.iter().enumerate().map(|(row, f)| fields[(row, c)] * f).sum::<f64>();
        let components: Vec<f64> = (0..rigid_count(rows.dimension)).map(of).collect();
        let sum: f64 = load.forces.iter().zip(&sizes).map(|(force, size)| (force * size).abs()).sum();
        let resultant = components.iter().map(|value| value * value).sum::<f64>().sqrt();
        let part = resultant / sum;
        (part > MAX_PRELOAD_RESULTANT || part.is_nan()).then(|| {
            let message = format!(
                "preload `{}` is not in equilibrium by itself: its resultant force and moment are {part:.1e} of the sum of its forces, expected below {MAX_PRELOAD_RESULTANT:e}",
                load.name
            );
            Diagnostic::new(Code::PreloadUnbalanced, message).in_file(&load.path)
        })
    };
    all.iter().filter(|load| load.preload).filter_map(unbalanced).collect()
}

/// Returns the parts of the loads that act on the body with the rows `kept`; loads that do not act on it are left out.
pub(crate) fn loads_of_body(all: &[ModelLoad], kept: &[usize]) -> Vec<ModelLoad> {
    let part = |load: &ModelLoad| {
        let forces: Vec<f64> = kept.iter().map(|&row| load.forces[row]).collect();
        forces.iter().any(|force| *force != 0.0).then(|| ModelLoad { forces, ..load.clone() })
    };
    all.iter().filter_map(part).collect()
}

/// Adds an error for each load whose recoveries and preload would be split between several bodies.
pub(crate) fn refuse_loads_of_several_bodies(
    all: &[ModelLoad],
    body_of_row: impl Fn(usize) -> usize,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for load in all {
        let loaded = load.forces.iter().enumerate().filter(|(_, force)| **force != 0.0);
        let bodies: HashSet<usize> = loaded.map(|(row, _)| body_of_row(row)).collect();
        if bodies.len() > 1 {
            let message = format!("named load `{}` acts on {} bodies", load.name, bodies.len());
            let diagnostic = Diagnostic::new(Code::BodiesCoupled, message).in_file(&load.path);
            diagnostics.push(diagnostic.with_help("give one [[named_load]] for each body"));
        }
    }
}
