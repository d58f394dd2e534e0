//! `compare` on one body in other units, frames, reference conditions and modal signs, which agrees with itself, and on bodies with
//! other rows, loads and terms, which do not.

use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, Parts, Quantity, Recovery, Subset, TermGroup, TermGroups};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, ModelRecovery, NodeSet, RawModel, RecoveryOperator};
use flexbody_report::{BodyComparison, Tolerances, compare, compare_common};
use nalgebra::{Matrix3, Rotation3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, grid};
use std::path::PathBuf;

/// Rubber of which a small beam has frequencies far above rigid motion.
const RUBBER: Material = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };

/// Returns a skewed beam with stresses, a section and interfaces at its ends.
fn model() -> RawModel {
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([5, 1, 1]), |[x, y, z]| {
        [0.4 * x + 0.06 * y, 0.4 * y * (1.0 - 0.05 * x), 0.3 * z * (1.0 + 0.1 * y)]
    });
    let raw = mesh.assemble(&RUBBER, MassRule::Consistent).raw_model();
    let nodes = |inside: &dyn Fn(f64) -> bool| -> Vec<i64> {
        raw.nodes
            .ids
            .iter()
            .zip(&raw.nodes.positions)
            .filter(|(_, at)| inside(at[0]))
            .map(|(id, _)| *id)
            .collect()
    };
    let set =
        |name: &str, nodes| NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new(name, nodes) };
    let interfaces = vec![set("root", nodes(&|x| x < 0.1)), set("tip", nodes(&|x| x > 1.95))];
    let cut = ModelRecovery {
        name: "cut".to_owned(),
        operator: RecoveryOperator::Cut { nodes: nodes(&|x| x < 0.7), about: [0.7, 0.2, 0.1] },
        path: PathBuf::new(),
        deformed_inertia: true,
    };
    raw.with(|data| {
        data.interfaces = interfaces;
        data.recoveries = vec![mesh.stresses(&RUBBER), cut];
    })
}

fn converted(frame: impl Into<FrameChoice>) -> FlexBody {
    let model = FeModel::from_raw(model()).expect("a sound model").model;
    let settings = ConvertSettings {
        frame: frame.into(),
        modes: ModeSettings { wanted: Wanted::Lowest(8), ..ModeSettings::default() },
        lumped: Vec::new(),
        ..ConvertSettings::default()
    };
    let body = convert(&model, &settings, &Context::QUIET).expect("a body").body;
    changed(&body, |parts| parts.description.units.stated = true)
}

fn changed(body: &FlexBody, change: impl FnOnce(&mut Parts)) -> FlexBody {
    let mut parts = body.clone().into_parts();
    change(&mut parts);
    FlexBody::new(parts).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the results of both orders of two bodies.
fn compared(a: &FlexBody, b: &FlexBody) -> [BodyComparison; 2] {
    [(a, b), (b, a)].map(|(a, b)| compare(a, b, &Tolerances::default()).unwrap_or_else(|e| panic!("{e}")))
}

fn agree(a: &FlexBody, b: &FlexBody, what: &str) -> String {
    let [found, reverse] = compared(a, b);
    for found in [&found, &reverse] {
        assert!(found.passed(), "{what}: {}", found.text());
    }
    found.text()
}

fn failed(comparison: &BodyComparison) -> Vec<&'static str> {
    comparison.rows().iter().filter(|row| !row.passed).map(|row| row.quantity).collect()
}

/// Returns the rows of a recovery times `factor`, with another unit.
fn in_unit(recovery: &mut Recovery, from: &str, to: &str, factor: f64) {
    for i in 0..recovery.rows.len() {
        if recovery.rows[i].unit != from {
            continue;
        }
        recovery.rows[i].unit = to.to_owned();
        recovery.offset[i] *= factor;
        let arrays = [&mut recovery.modes, &mut recovery.spin, &mut recovery.named];
        let loads = recovery.loads.iter_mut().map(|load| &mut load.columns);
        let motion = recovery.motion.iter_mut().map(|one| &mut one.columns);
        for array in arrays.into_iter().chain(loads).chain(motion) {
            (0..array.ncols()).for_each(|c| array[(i, c)] *= factor);
        }
    }
}

/// Returns the body with the signs of every second mode changed.
fn flipped(body: &FlexBody) -> FlexBody {
    let nf = body.n_modes();
    let sign = |j: usize| if (j % nf).is_multiple_of(2) { -1.0 } else { 1.0 };
    changed(body, |parts| {
        let t = Mat::from_fn(nf, nf, |i, j| if i == j { sign(j) } else { 0.0 });
        let columns = |a: &mut Mat<f64>| *a = Mat::from_fn(a.nrows(), a.ncols(), |i, j| sign(j) * a[(i, j)]);
        columns(&mut parts.modes.shape);
        parts.invariants = parts.invariants.with_basis(t.as_ref());
        for recovery in &mut parts.recoveries {
            columns(&mut recovery.modes);
            recovery.motion.iter_mut().for_each(|own| columns(&mut own.columns));
        }
        for load in &mut parts.named_loads {
            load.modal.iter_mut().enumerate().for_each(|(j, value)| *value *= sign(j));
            columns(&mut load.turning);
        }
    })
}

#[test]
fn one_body_in_other_units_frames_and_signs_agrees() {
    let body = converted(BodyFrame::Com);
    assert_eq!(body.recoveries().len(), 2);
    assert!(!body.recoveries()[1].motion.is_empty(), "forces of motion");
    let millimetres =
        flexbody_file::in_units(&body, &UnitSystem::parse("mm", "t", "s").expect("units")).expect("a body");
    agree(&body, &millimetres, "units of the body");
    let relabelled = changed(&millimetres, |parts| {
        in_unit(&mut parts.recoveries[0], "Pa", "N/mm^2", 1e-6);
        in_unit(&mut parts.recoveries[1], "N m", "N mm", 1e3);
        in_unit(&mut parts.recoveries[1], "N", "kN", 1e-3);
    });
    let text = agree(&body, &relabelled, "units of rows");
    assert!(text.contains("converted: N mm to N m, N/mm^2 to Pa, kN to N"), "{text}");
    agree(&body, &flipped(&body), "signs of modes");
    let axes: Matrix3<f64> = Rotation3::from_euler_angles(0.4, -1.1, 2.3).into_inner();
    let turned = body.in_frame(Vector3::new(0.7, -0.3, 2.0), axes).expect("a body");
    let text = agree(&body, &turned, "frame");
    assert!(text.contains("rows of forces of motion"), "{text}");
    agree(&turned, &flipped(&relabelled), "all of them");
}

/// The modes of a frame on an interface span the space of those in mean axes with rigid motion.
#[test]
fn a_body_with_its_frame_on_an_interface_agrees_with_one_in_mean_axes() {
    let [free, held] = [converted(BodyFrame::Com), converted(FrameChoice::Interface("root".to_owned()))];
    let text = agree(&free, &held, "reference conditions");
    assert!(text.contains("compared in mean axes") && text.contains("rows of forces of motion"), "{text}");
    let tip = converted(FrameChoice::Interface("tip".to_owned()));
    agree(&held, &tip, "two interfaces");
    let stiffer = changed(&held, |parts| {
        parts.modes.eigenvalue[7] *= 1.001;
        parts.invariants.primary_mut().modal_stiffness[(7, 7)] *= 1.001;
    });
    for found in compared(&free, &stiffer) {
        assert!(failed(&found).contains(&"frequency"), "{}", found.text());
    }
    // Rows of displacements are relative to the frame of their file.
    let moving = |body: &FlexBody| {
        changed(body, |parts| {
            let recovery = &mut parts.recoveries[0];
            recovery.rows.iter_mut().for_each(|row| row.quantity = Quantity::Displacement);
        })
    };
    let text = agree(&moving(&free), &moving(&held), "displacements");
    assert!(
        text.contains("not compared: rows of displacements") && text.contains("/recovery/stress"),
        "{text}"
    );
    // Without W3 the change to mean axes is not known.
    let groups = TermGroups::without(TermGroup::W3);
    let decision = Subset { groups, ..Subset::default() };
    let partial = held.clone().subset(&decision).expect("a body");
    let refused = compare(&free, &partial, &Tolerances::default()).expect_err("no mean axes").to_string();
    assert!(refused.contains("W3") && refused.contains("--frame"), "{refused}");
}

/// A change of one row of a recovery.
type RowChange = (&'static str, fn(&mut Recovery));

/// Multiplies all numbers of the row 5.
fn scale_row(recovery: &mut Recovery, factor: f64) {
    let unit = std::mem::replace(&mut recovery.rows[5].unit, "changed".to_owned());
    in_unit(recovery, "changed", &unit, factor);
}

#[test]
fn changed_rows_differ_with_and_without_common_nodes() {
    let body = converted(BodyFrame::Com);
    let changes: [RowChange; 4] = [
        ("flipped row", |own| scale_row(own, -1.0)),
        ("flipped row in the modes", |own| (0..own.modes.ncols()).for_each(|j| own.modes[(5, j)] *= -1.0)),
        ("doubled row", |own| scale_row(own, 2.0)),
        ("one sign", |own| own.modes[(5, 2)] *= -1.0),
    ];
    for (what, change) in changes {
        let other = changed(&body, |parts| change(&mut parts.recoveries[0]));
        let renumbered = changed(&other, |parts| parts.nodes.ids.iter_mut().for_each(|id| *id += 1000));
        for (kind, other) in
            [("common nodes", &other), ("other nodes", &renumbered), ("signs", &flipped(&other))]
        {
            for found in compared(&body, other) {
                assert!(failed(&found).contains(&"rows in the modes"), "{what}, {kind}: {}", found.text());
            }
        }
    }
    let other = changed(&body, |parts| {
        for own in &mut parts.recoveries[1].motion {
            own.columns.row_mut(1).iter_mut().for_each(|value| *value *= -1.0);
        }
    });
    for found in compared(&body, &other) {
        assert_eq!(failed(&found), ["rows of forces of motion"], "{}", found.text());
    }
    // Units of other quantities, and names that are no units.
    for (from, to) in [("Pa", "N"), ("Pa", "beans")] {
        let other = changed(&body, |parts| in_unit(&mut parts.recoveries[0], from, to, 1.0));
        for found in compared(&body, &other) {
            assert_eq!(failed(&found), ["recoveries"], "{}", found.text());
        }
    }
}

/// A dropped group is a difference of its size; the common parts are compared only if the user asks for them.
#[test]
fn dropped_groups_differ() {
    let body = converted(BodyFrame::Com);
    for group in TermGroup::ALL {
        let groups = TermGroups::without(group);
        let subset = Subset { groups, ..Subset::default() };
        let partial = body.clone().subset(&subset).expect("a body");
        let quantity = format!("{} of one body", group.name());
        for found in compared(&body, &partial) {
            let row = found.rows().iter().find(|row| row.quantity == quantity).expect("a row");
            assert!(!row.passed && row.difference > 1e-3, "{}", found.text());
            assert!(
                !found.passed() && found.notes().iter().any(|note| note.contains("--common")),
                "{}",
                found.text()
            );
        }
        for (a, b) in [(&body, &partial), (&partial, &body)] {
            let common = compare_common(a, b, &Tolerances::default()).expect("comparable");
            assert!(common.passed(), "{group:?}: {}", common.text());
            let note = format!("{} was dropped from", group.name());
            assert!(common.notes().iter().any(|own| own.starts_with(&note)), "{}", common.text());
        }
        agree(&partial, &partial, "without the group");
    }
}
