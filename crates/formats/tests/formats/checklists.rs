//! Checklists of all formats compared with their files: a held property changes the file, a property that is
//! not applicable does not, and only a picture may omit a property that affects the motion without a message.

use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    FlexBody, InternalRows, NamedLoad, Parts, Quantity, Recovery, RecoveryRow, Storage, SurfaceMesh,
};
use flexbody_formats::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, Holding};
use flexbody_formats::{FORMATS, export};
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};
use nalgebra::{Matrix3, Vector3};
use oracle::exported::jointed_bodies;

/// A property of a body and its entry in the checklist.
struct Property {
    name: &'static str,
    /// True if the property affects the motion of the body.
    moves: bool,
    /// Removes the property or replaces it by another one.
    remove: fn(&mut Parts),
    entry: fn(&ExportChecklist) -> &Holding,
}

const PROPERTIES: &[Property] = &[
    Property {
        name: "damping",
        moves: true,
        remove: |parts| {
            parts.modes.damping_ratio.fill(0.0);
            parts.modes.modal_damping = None;
        },
        entry: |list| &list.damping,
    },
    Property {
        name: "geometric stiffness",
        moves: true,
        remove: |parts| {
            parts.geometric_stiffness.clear();
            parts.rotated_stiffness.clear();
        },
        entry: |list| &list.geometric_stiffness,
    },
    Property {
        name: "stiffness of inertia",
        moves: true,
        remove: |parts| parts.inertia_stiffness = None,
        entry: |list| &list.inertia_stiffness,
    },
    Property {
        name: "internal rows",
        moves: false,
        remove: |parts| parts.modes.internal = None,
        entry: |list| &list.internal_rows,
    },
    Property {
        name: "surface",
        moves: false,
        remove: |parts| parts.mesh = None,
        entry: |list| &list.surface,
    },
    Property {
        name: "named loads",
        moves: true,
        remove: |parts| {
            parts.named_loads.clear();
            parts
                .recoveries
                .iter_mut()
                .for_each(|recovery| recovery.named = Mat::zeros(recovery.rows.len(), 0));
        },
        entry: |list| &list.named_loads,
    },
    Property {
        name: "recoveries",
        moves: true,
        remove: |parts| parts.recoveries.clear(),
        entry: |list| &list.recoveries,
    },
    Property {
        name: "origins of the modes",
        moves: false,
        remove: |parts| parts.modes.provenance.clear(),
        entry: |list| &list.origins_of_modes,
    },
    Property {
        name: "units",
        moves: false,
        remove: |parts| parts.description.units = UnitSystem::parse("mm", "t", "s").expect("units"),
        entry: |list| &list.units,
    },
    Property {
        name: "storage",
        moves: false,
        remove: |parts| parts.storage = Storage::F64,
        entry: |list| &list.storage,
    },
    Property {
        name: "interfaces",
        moves: false,
        remove: |parts| {
            let reference = parts.interfaces[0].reference.as_mut().expect("a coupled interface");
            reference[0] += 1e-3;
        },
        entry: |list| &list.interfaces,
    },
];

/// Returns a body with all of these properties, and with K and M in the motions of its interfaces.
fn body_with_everything() -> FlexBody {
    let (_, body) =
        jointed_bodies().iter().find(|(name, _)| name == "car_frame, jointed").expect("a body of beams");
    let mut parts = body.rounded_to_f32().expect("a body").into_parts();
    let (n, nf) = (parts.nodes.len(), parts.modes.eigenvalue.len());
    assert!(parts.inertia_stiffness.is_some() && parts.coordinates.is_some());
    assert!(parts.modes.provenance.len() == nf && parts.modes.rotation.is_some() && n > 3);
    parts.modes.damping_ratio.fill(0.02);
    let load = UnitLoad { kind: LoadKind::Acceleration, component: 0 };
    parts.rotated_stiffness.clear();
    parts.geometric_stiffness.retain(|stiffness| stiffness.load != load);
    let matrix = Mat::from_fn(nf, nf, |i, j| 1e-3 * ((i + j) as f64 + 1.0));
    parts.geometric_stiffness.push(GeometricStiffness { load, matrix });
    parts.modes.internal =
        Some(InternalRows { dofs: vec![[9999, 1]], shape: Mat::from_fn(1, nf, |_, j| j as f64) });
    parts.mesh = Some(SurfaceMesh::new(vec![[0, 1, 2]], Vec::new(), n).expect("a surface"));
    let mut stresses = nodal_stresses(&parts.nodes.ids[..2], nf);
    stresses.named = Mat::full(stresses.rows.len(), 1, 0.25);
    parts.recoveries = vec![stresses];
    parts.named_loads = vec![NamedLoad {
        name: "bolts".to_owned(),
        preload: false,
        modal: vec![0.5; nf],
        force: Vector3::x(),
        torque: Vector3::y(),
        moments: Matrix3::identity(),
        turning: Mat::full(3, nf, 0.1),
        compliance: Some(2.0),
    }];
    FlexBody::new(parts).expect("a body")
}

/// Returns made-up stresses of nodes, without static columns.
pub(crate) fn nodal_stresses(nodes: &[i64], nf: usize) -> Recovery {
    let row = |node: i64, component: &str| RecoveryRow {
        name: format!("{node} {component}"),
        quantity: Quantity::Stress,
        component: component.to_owned(),
        unit: "MPa".to_owned(),
        node: Some(node),
        element: None,
    };
    let of_node = |node: &i64| ["xx", "yy", "zz", "xy", "yz", "xz"].map(|component| row(*node, component));
    let rows: Vec<RecoveryRow> = nodes.iter().flat_map(of_node).collect();
    Recovery {
        name: "stresses".to_owned(),
        offset: (0..rows.len()).map(|i| 0.5 * i as f64).collect(),
        modes: Mat::from_fn(rows.len(), nf, |i, j| ((i * nf + j) as f64).sin()),
        spin: Mat::zeros(rows.len(), 6),
        loads: Vec::new(),
        named: Mat::zeros(rows.len(), 0),
        motion: Vec::new(),
        rows,
    }
}

fn options(format: &dyn ExportFormat) -> Vec<ExportOptions> {
    let dialect =
        |name: Option<&str>| ExportOptions { dialect: name.map(str::to_owned), ..ExportOptions::default() };
    match format.dialects() {
        [] => vec![dialect(None)],
        dialects => dialects.iter().map(|name| dialect(Some(name))).collect(),
    }
}

#[test]
fn every_entry_of_every_checklist_is_that_of_the_file() {
    let whole = body_with_everything();
    let mut wrong = Vec::new();
    for format in FORMATS.iter().copied() {
        for options in options(format) {
            let file = |body: &FlexBody| -> Exported {
                export(body, format, &options, true).unwrap_or_else(|e| panic!("{}: {e}", format.name())).0
            };
            let (checklist, bytes) = (format.checklist(&whole, &options), file(&whole));
            for property in PROPERTIES {
                let mut parts = whole.parts().clone();
                (property.remove)(&mut parts);
                let differs = file(&FlexBody::new(parts).expect(property.name)) != bytes;
                let problem = match (property.entry)(&checklist) {
                    Holding::Held if !differs => "held, but the file is the same without it",
                    Holding::NotApplicable if differs => "not applicable, but in the file",
                    Holding::NotApplicable if property.moves && !format.is_picture() => {
                        "lost without a message"
                    }
                    _ => continue,
                };
                wrong.push(format!("{} {:?}: {}: {problem}", format.name(), options.dialect, property.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// No format loses a property that the body does not have.
#[test]
fn nothing_is_lost_of_a_body_without_it() {
    for format in FORMATS.iter().copied() {
        for options in options(format) {
            let mut parts = body_with_everything().into_parts();
            PROPERTIES.iter().for_each(|property| (property.remove)(&mut parts));
            let checklist = format.checklist(&FlexBody::new(parts).expect("a body"), &options);
            let lost = PROPERTIES
                .iter()
                .find(|one| matches!((one.entry)(&checklist), Holding::Lost(_) | Holding::Slight(_)));
            assert!(lost.is_none(), "{}: {}", format.name(), lost.map_or("", |one| one.name));
        }
    }
}
