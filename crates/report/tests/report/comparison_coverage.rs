//! `compare` compares every entry of the flex-body file or lists it as not compared. The entries are those of
//! `docs/reference/file_format.md`.

use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    FixedInterface, FlexBody, FreeEstimate, GeometricStiffness, Guarantee, Interface, InterfaceCoordinates,
    InternalRows, LoadColumns, LoadKind, LumpedBody, MassStructure, MotionColumns, MotionLoad, NamedLoad,
    Parts, Quantity, Recovery, RecoveryRow, ReferenceConditions, RotatedStiffness, Storage, SurfaceMesh,
    TermDecision, TermGroup, UnitLoad,
};
use flexbody_body::invariants::{BodyFrame, DIGITS, Frame, GeneralTerms, InertiaStiffness};
use flexbody_file::contents;
use flexbody_model::{Coupling, NodeMoments};
use flexbody_report::{BodyComparison, Tolerances, compare};
use nalgebra::{Matrix3, Rotation3, Vector3};
use oracle::report_bodies::block;
use std::collections::BTreeMap;

/// Returns a body with every entry of the file.
fn complete() -> FlexBody {
    let mut parts = block(BodyFrame::Principal).into_parts();
    let (n, nf) = (parts.nodes.ids.len(), parts.modes.eigenvalue.len());
    let number = |i: usize, j: usize| ((3 * i + 7 * j + 1) as f64).sin();
    let symmetric = |size: usize| Mat::from_fn(size, size, |i, j| number(i.min(j), i.max(j)));
    let solid = parts.invariants.clone();
    let rotation = Mat::from_fn(3 * n, nf, number);
    let moments = |i: usize| NodeMoments {
        first: Vector3::from_fn(|k, _| number(i, k)),
        second: Matrix3::from_fn(|k, l| number(i + k, l)),
    };
    let moments = (0..n).map(moments).collect();
    parts.inertia_stiffness = Some(InertiaStiffness::new(moments, rotation.as_ref(), 3));
    parts.modes.rotation = Some(rotation);
    let dofs = vec![[901, 1], [901, 2], [901, 3], [902, 5]];
    parts.modes.internal = Some(InternalRows { dofs, shape: Mat::from_fn(4, nf, number) });
    parts.modes.modal_damping = Some(symmetric(nf));
    parts.modes.damping_ratio = vec![0.01; nf];
    parts.modes.provenance = vec!["free mode".to_owned(); nf];
    parts.lumped = vec![LumpedBody {
        scheme: "row-sum".to_owned(),
        invariants: solid.clone(),
        negative_masses: 0,
        comparison: vec![("mass".to_owned(), 0.0)],
    }];
    parts.source.mass_structure = MassStructure::General;
    parts.invariants.primary_mut().general = Some(GeneralTerms {
        w0: Mat::from_fn(3, 3 * nf, number),
        w3: solid.w3().expect("all groups").clone(),
        modal_mass: solid.modal_mass().clone(),
        plane: false,
    });
    let load =
        |kind, component| GeometricStiffness { load: UnitLoad { kind, component }, matrix: symmetric(nf) };
    parts.geometric_stiffness = vec![
        load(LoadKind::Acceleration, 0),
        load(LoadKind::Spin, 2),
        load(LoadKind::Force("left".to_owned()), 1),
        load(LoadKind::Named("preload".to_owned()), 0),
    ];
    let rotated = |own: &GeometricStiffness<_>| RotatedStiffness {
        load: own.load.clone(),
        modes: Mat::from_fn(nf, 3, number),
        rotation: symmetric(3),
    };
    parts.rotated_stiffness = parts.geometric_stiffness.iter().map(rotated).collect();
    let interface = |name: &str, nodes: [usize; 4], x: f64| Interface {
        name: name.to_owned(),
        nodes: nodes.to_vec(),
        coupling: Some(Coupling::Averaging),
        reference: Some([x, 0.1, -0.2]),
    };
    parts.estimated_stiffness = vec![load(LoadKind::Spin, 0)];
    parts.interfaces = vec![interface("left", [0, 1, 2, 5], -1.5), interface("right", [6, 7, 8, 11], 1.5)];
    parts.coordinates = Some(InterfaceCoordinates {
        names: (0..nf).map(|i| format!("coordinate {i}")).collect(),
        stiffness: symmetric(nf),
        mass: symmetric(nf),
        of_modes: Mat::from_fn(nf, nf, number),
    });
    let lambda = parts.modes.eigenvalue.clone();
    parts.certificate.guarantee = Some(Guarantee {
        shift_below: 1.0,
        pivots_below: 6,
        eigenvalue_lower: lambda.iter().map(|l| 0.9 * l).collect(),
        eigenvalue_upper: lambda.iter().map(|l| 1.1 * l).collect(),
        shape_error: vec![1e-3; nf],
        digits: DIGITS.map(|_| 12.0),
    });
    parts.certificate.fixed_interface = Some(FixedInterface {
        modes: 0,
        interface_motions: nf,
        counted: Some(0),
        shift: 1.0,
        next: Some(2.0),
        residual: 0.0,
        eigenvalues: Vec::new(),
        free: Some(FreeEstimate {
            estimate: lambda.clone(),
            lower: lambda.iter().map(|l| 0.9 * l).collect(),
        }),
    });
    parts.terms = vec![TermDecision {
        group: TermGroup::W1,
        kept: true,
        reason: "needed".to_owned(),
        tier: 1,
        bound: 0.1,
        limit: 0.2,
    }];
    parts.recoveries = vec![Recovery {
        name: "gauge".to_owned(),
        rows: vec![RecoveryRow {
            name: "g1".to_owned(),
            quantity: Quantity::Strain,
            component: "xx".to_owned(),
            unit: String::new(),
            node: None,
            element: Some(1),
        }],
        offset: vec![0.5],
        modes: Mat::from_fn(1, nf, number),
        spin: Mat::from_fn(1, 6, number),
        loads: vec![LoadColumns { interface: "left".to_owned(), columns: Mat::from_fn(1, 6, number) }],
        named: Mat::from_fn(1, 1, number),
        motion: MotionLoad::ALL
            .iter()
            .map(|&load| MotionColumns { load, columns: Mat::from_fn(1, load.components() * nf, number) })
            .collect(),
    }];
    parts.named_loads = vec![NamedLoad {
        name: "bolts".to_owned(),
        preload: false,
        modal: (0..nf).map(|j| number(0, j)).collect(),
        force: Vector3::new(1.0, -0.5, 0.25),
        torque: Vector3::new(0.5, 1.0, -2.0),
        moments: Matrix3::from_fn(number),
        turning: Mat::from_fn(3, nf, number),
        compliance: Some(1.0),
    }];
    parts.conditions = ReferenceConditions::Interface("right".to_owned());
    parts.mesh = Some(SurfaceMesh::new(vec![[0, 1, 4]], vec![[0, 1]], n).expect("a triangle"));
    FlexBody::new(parts).unwrap_or_else(|e| panic!("{e}"))
}

/// An entry of the file, and a change of it.
type Change = (&'static str, fn(&mut Parts));

/// Primary entries that a comparison covers, each with a change.
const CHANGES: &[Change] = &[
    ("/@dimension", flatten),
    ("/@units_length", |p| p.description.units = UnitSystem::parse("mm", "kg", "s").expect("units")),
    ("/@units_mass", |p| p.description.units = UnitSystem::parse("m", "t", "s").expect("units")),
    ("/@units_time", |p| p.description.units = UnitSystem::parse("m", "kg", "ms").expect("units")),
    ("/@units_stated", |p| p.description.units.stated = !p.description.units.stated),
    ("/@storage", |p| p.storage = Storage::F32),
    ("/frame@reference_conditions", |p| p.conditions = ReferenceConditions::MeanAxes),
    ("/frame/origin", |p| p.frame.origin.y += 1e-3),
    ("/frame/axes", |p| p.frame.axes *= Rotation3::from_euler_angles(1e-3, 2e-3, 0.0).matrix()),
    ("/nodes/id", |p| p.nodes.ids.swap(0, 7)),
    ("/nodes/position", |p| p.nodes.positions[3][1] += 1e-3),
    ("/nodes/rotational_first_moment", |p| moments(p).first.x += 1e-3),
    ("/nodes/rotational_second_moment", |p| moments(p).second[(1, 2)] += 1e-3),
    ("/modes/eigenvalue", |p| p.modes.eigenvalue[2] *= 1.001),
    ("/modes/damping_ratio", |p| p.modes.damping_ratio[2] *= 1.001),
    ("/modes/shape", |p| p.modes.shape[(5, 2)] += 1e-3),
    ("/modes/rotation", |p| p.modes.rotation.as_mut().expect("rotations")[(5, 2)] += 1e-3),
    ("/modes/internal_dof", |p| p.modes.internal.as_mut().expect("rows").dofs[3] = [902, 6]),
    ("/modes/internal", |p| p.modes.internal.as_mut().expect("rows").shape[(3, 2)] += 1e-3),
    ("/invariants/mass", |p| p.invariants.primary_mut().mass *= 1.001),
    ("/invariants/first_moment", |p| p.invariants.primary_mut().first_moment.x += 1e-3),
    ("/invariants/second_moment", |p| p.invariants.primary_mut().second_moment[(0, 0)] *= 1.001),
    ("/invariants/C1", |p| p.invariants.primary_mut().c1[(1, 2)] += 1e-3),
    ("/invariants/Ibar", |p| p.invariants.primary_mut().ibar[0][2][2] += 1e-3),
    ("/invariants/S", |p| p.invariants.primary_mut().s[0][0][(2, 2)] += 1e-3),
    ("/invariants/modal_stiffness", |p| p.invariants.primary_mut().modal_stiffness[(2, 2)] *= 1.001),
    ("/invariants/W0", |p| general(p).w0[(1, 2)] += 1e-3),
    ("/invariants/W3", |p| general(p).w3[(1, 2)] += 1e-3),
    ("/invariants/modal_mass", |p| general(p).modal_mass[(2, 2)] += 1e-3),
    ("/invariants/modal_damping", |p| p.modes.modal_damping.as_mut().expect("damping")[(2, 2)] += 1e-3),
    ("/interfaces/<name>/node_id", |p| p.interfaces[0].nodes[1] = 3),
    ("/interfaces/<name>@coupling", |p| p.interfaces[0].coupling = Some(Coupling::Rigid)),
    ("/interfaces/<name>/reference", |p| p.interfaces[0].reference = Some([-1.5, 0.1, -0.199])),
    ("/geometric_stiffness/<load>/stiffness", |p| p.geometric_stiffness[0].matrix[(2, 2)] += 1e-3),
    ("/inertia_stiffness/<load>/stiffness", |p| inertia(p).stiffness[4].matrix[(2, 2)] += 1e-3),
    ("/recovery/<name>@rows", |p| p.recoveries[0].rows[0].component = "yy".to_owned()),
    ("/recovery/<name>@loaded_interfaces", |p| p.recoveries[0].loads[0].interface = "right".to_owned()),
    ("/recovery/<name>/offset", |p| p.recoveries[0].offset[0] += 1e-3),
    ("/recovery/<name>/modes", |p| p.recoveries[0].modes[(0, 2)] += 1e-3),
    ("/recovery/<name>/spin", |p| p.recoveries[0].spin[(0, 2)] += 1e-3),
    ("/recovery/<name>/damping", |p| p.recoveries[0].motion[0].columns[(0, 2)] += 1e-3),
    ("/recovery/<name>/acceleration", |p| p.recoveries[0].motion[1].columns[(0, 2)] += 1e-3),
    ("/recovery/<name>/turning", |p| p.recoveries[0].motion[2].columns[(0, 2)] += 1e-3),
    ("/recovery/<name>/centrifugal", |p| p.recoveries[0].motion[3].columns[(0, 2)] += 1e-3),
    ("/recovery/<name>@named_loads", |p| p.named_loads[0].name = "nuts".to_owned()),
    ("/recovery/<name>/named", |p| p.recoveries[0].named[(0, 0)] += 1e-3),
    ("/named_loads/<name>@preload", |p| p.named_loads[0].preload = true),
    ("/named_loads/<name>/modal", |p| p.named_loads[0].modal[2] += 1e-3),
    ("/named_loads/<name>/force", |p| p.named_loads[0].force.x += 1e-3),
    ("/named_loads/<name>/torque", |p| p.named_loads[0].torque.y += 1e-3),
    ("/named_loads/<name>/moments", |p| p.named_loads[0].moments[(1, 2)] += 1e-3),
    ("/named_loads/<name>/turning", |p| p.named_loads[0].turning[(1, 2)] += 1e-3),
    ("/named_loads/<name>@compliance", |p| p.named_loads[0].compliance = Some(1.001)),
    ("/recovery/<name>/loads", |p| p.recoveries[0].loads[0].columns[(0, 2)] += 1e-3),
];

fn inertia(parts: &mut Parts) -> &mut InertiaStiffness {
    parts.inertia_stiffness.as_mut().expect("stiffness of inertia")
}

fn moments(parts: &mut Parts) -> &mut NodeMoments {
    &mut inertia(parts).moments[3]
}

fn general(parts: &mut Parts) -> &mut GeneralTerms {
    parts.invariants.primary_mut().general.as_mut().expect("general terms")
}

/// Turns the body into a plane body.
fn flatten(parts: &mut Parts) {
    parts.dimension = 2;
    parts.frame = Frame::model();
    parts.nodes.positions.iter_mut().for_each(|x| x[2] = 0.0);
    (2..parts.modes.shape.nrows()).step_by(3).for_each(|i| parts.modes.shape.row_mut(i).fill(0.0));
    parts.inertia_stiffness = None;
    parts.estimated_stiffness.clear();
    general(parts).plane = true;
}

/// Returns the paths of the entries of `docs/reference/file_format.md` (attributes after `@`). The flag is true for
/// entries marked "derived" or "always", which carry no information of their own.
fn documented() -> Vec<(String, bool)> {
    let page = include_str!("../../../../docs/reference/file_format.md");
    let (mut group, mut separator, mut found) = ("", '/', Vec::new());
    for line in page.lines() {
        if let Some(path) = line.strip_prefix("## `").and_then(|rest| rest.strip_suffix('`')) {
            group = if path == "/" { "" } else { path };
        } else if line.starts_with("| dataset |") {
            separator = '/';
        } else if line.starts_with("| attribute |") {
            separator = '@';
        } else if let Some(rest) = line.strip_prefix("| `") {
            let name = rest.split('`').next().expect("a name");
            let root = if group.is_empty() && separator == '@' { "/" } else { "" };
            let follows = line.contains("(*derived*)") || line.contains("; always ");
            found.push((format!("{group}{root}{separator}{name}"), follows));
        }
    }
    assert!(found.len() > 100, "the tables of the page are understood");
    found
}

/// Returns every entry of the file of a body as text.
fn entries(body: &FlexBody) -> BTreeMap<String, String> {
    let (attributes, arrays) = contents(body);
    let arrays = arrays.into_iter().map(|array| (format!("/{}", array.path), format!("{:?}", array.values)));
    let attributes = attributes.into_iter().flat_map(|group| {
        let path = if group.path == "/" { "/".to_owned() } else { format!("/{}", group.path) };
        group.values.into_iter().map(move |(name, value)| (format!("{path}@{name}"), value.to_string()))
    });
    arrays.chain(attributes).collect()
}

/// Returns true if `path` matches `pattern` (`<name>` is any name).
fn is_of(pattern: &str, path: &str) -> bool {
    let parts = |text: &str| -> Vec<String> { text.split(['/', '@']).map(str::to_owned).collect() };
    let (pattern, path) = (parts(pattern), parts(path));
    pattern.len() == path.len() && pattern.iter().zip(&path).all(|(p, x)| p.starts_with('<') || p == x)
}

/// Returns the paths that the output lists as not compared.
fn listed(comparison: &BodyComparison) -> Vec<String> {
    let text = comparison.text();
    let lines = text.lines().filter_map(|line| line.strip_prefix("not compared: "));
    let paths = |line: &str| -> Vec<String> {
        let inner = line.rsplit_once('(').and_then(|(_, rest)| rest.strip_suffix(')')).expect("paths");
        inner.split(", ").map(str::to_owned).collect()
    };
    lines.flat_map(paths).collect()
}

#[test]
fn every_entry_of_the_file_is_compared_or_derived_or_listed_as_not_compared() {
    let body = complete();
    let itself = compare(&body, &body, &Tolerances::default()).expect("comparable");
    assert!(itself.passed(), "{}", itself.text());
    let before = entries(&body);
    let not_compared = listed(&itself);
    for (path, follows) in documented() {
        let is_listed = not_compared.iter().any(|listed| {
            path.strip_prefix(listed.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', '@']))
        });
        let change = CHANGES.iter().find(|(changed, _)| *changed == path);
        let Some((_, change)) = change else {
            // Digests depend on the written numbers.
            let told = follows || is_listed || ["/@digests", "/@sha256"].contains(&path.as_str());
            assert!(told, "{path} is neither compared nor listed");
            continue;
        };
        assert!(!is_listed, "{path} is compared, but listed as not compared");
        let mut parts = body.clone().into_parts();
        change(&mut parts);
        let other = FlexBody::new(parts).unwrap_or_else(|e| panic!("{path}: {e}"));
        let after = entries(&other);
        assert!(
            before.iter().any(|(at, value)| is_of(&path, at) && after.get(at) != Some(value))
                || after.keys().any(|at| is_of(&path, at) && !before.contains_key(at)),
            "{path} is changed"
        );
        for (a, b) in [(&body, &other), (&other, &body)] {
            let Ok(found) = compare(a, b, &Tolerances::default()) else { continue };
            assert!(!found.passed() || found.notes() != itself.notes(), "{path}:\n{}", found.text());
        }
    }
}

fn differing(change: impl FnOnce(&mut Parts)) -> (Vec<&'static str>, String) {
    // Rows under loads at an interface differ with the interface.
    let mut parts = complete().into_parts();
    parts.recoveries.clear();
    let body = FlexBody::new(parts.clone()).expect("less of it");
    change(&mut parts);
    let other = FlexBody::new(parts).unwrap_or_else(|e| panic!("{e}"));
    let found = compare(&body, &other, &Tolerances::default()).expect("comparable");
    (found.rows().iter().filter(|row| !row.passed).map(|row| row.quantity).collect(), found.text())
}

#[test]
fn interfaces_that_differ_are_named() {
    let (rows, text) = differing(|p| {
        let (left, right) = (p.interfaces[0].name.clone(), p.interfaces[1].name.clone());
        p.interfaces[0].name = right;
        p.interfaces[1].name = left;
    });
    assert_eq!(rows, ["interfaces", "reference points"], "{text}");
    assert!(
        text.contains("interface `left` has 4 nodes in the first body only, 4 in the second only"),
        "{text}"
    );
    let (rows, text) = differing(|p| p.interfaces[1].reference = Some([1.5, 0.1, -0.19]));
    assert_eq!(rows, ["reference points"], "{text}");
    let (rows, text) = differing(|p| p.interfaces[1].coupling = None);
    assert_eq!(rows, ["interfaces"], "{text}");
    assert!(
        text.contains("`right` is `averaging` in the first body and `not stated` in the second"),
        "{text}"
    );
    let (rows, text) = differing(|p| drop(p.interfaces.remove(0)));
    assert_eq!(rows, ["interfaces"], "{text}");
    assert!(text.contains("interface `left` is in the first body only"), "{text}");
    // The order of interfaces and of their nodes carries no information.
    let (rows, text) = differing(|p| {
        p.interfaces.reverse();
        p.interfaces[0].nodes.reverse();
    });
    assert!(rows.is_empty(), "{text}");
}

#[test]
fn damping_and_stiffness_of_loads_that_differ_are_named() {
    let (rows, text) = differing(|p| p.modes.modal_damping = None);
    assert_eq!(rows, ["damping"], "{text}");
    let (rows, text) = differing(|p| {
        p.rotated_stiffness.clear();
        p.geometric_stiffness.remove(2);
    });
    assert_eq!(rows, ["geometric stiffness"], "{text}");
    assert!(text.contains("geometric stiffness for force y at `left`: none in the second body"), "{text}");
    let (rows, text) = differing(|p| p.inertia_stiffness = None);
    assert_eq!(rows, ["stiffness of inertia"], "{text}");
}

/// The sign of a modal load relative to the mode is not that of the mode.
#[test]
fn named_loads_with_another_sign_differ() {
    let (rows, text) = differing(|p| p.named_loads[0].modal[2] *= -1.0);
    assert_eq!(rows, ["loads on the modes"], "{text}");
    let (rows, text) = differing(|p| p.named_loads[0].turning[(1, 2)] *= -1.0);
    assert_eq!(rows, ["loads on the modes"], "{text}");
}

/// A file of another program may lack interfaces, damping and other data; they are listed as not compared.
#[test]
fn what_a_file_of_another_program_has_none_of_is_listed() {
    let (body, mut parts) = (complete(), complete().into_parts());
    parts.source.n_dofs = 0;
    parts.frame = Frame::model();
    parts.interfaces.clear();
    parts.recoveries.clear();
    parts.conditions = ReferenceConditions::Unstated;
    parts.geometric_stiffness.clear();
    parts.rotated_stiffness.clear();
    parts.inertia_stiffness = None;
    (parts.modes.modal_damping, parts.modes.rotation, parts.modes.internal) = (None, None, None);
    parts.modes.damping_ratio.fill(0.0);
    let foreign = FlexBody::new(parts).expect("less of it");
    for (a, b) in [(&body, &foreign), (&foreign, &body)] {
        let found = compare(a, b, &Tolerances::default()).expect("comparable");
        assert!(found.passed(), "{}", found.text());
        let left_out =
            ["/interfaces", "/recovery", "/geometric_stiffness", "/inertia_stiffness", "/modes/rotation"];
        for path in left_out.into_iter().chain(["/modes/internal", "/invariants/modal_damping"]) {
            assert!(listed(&found).iter().any(|listed| listed == path), "{path}: {}", found.text());
        }
    }
}

/// The result is the same in other frames, in other bases and without common nodes.
#[test]
fn frames_signs_and_node_numbers_make_no_difference_to_what_is_beside_the_invariants() {
    // The invariants of this body are made up, so that its static responses depend on the frame.
    let mut parts = complete().into_parts();
    parts.recoveries.clear();
    let body = FlexBody::new(parts).expect("less of it");
    let with = |change: &dyn Fn(&mut Parts)| {
        let mut parts = body.clone().into_parts();
        change(&mut parts);
        FlexBody::new(parts).unwrap_or_else(|e| panic!("{e}"))
    };
    let moved = body.in_model_axes(Vector3::new(0.7, -0.3, 2.0)).expect("another frame");
    let flipped = with(&|p| {
        let nf = p.modes.eigenvalue.len();
        let sign = |j: usize| if j.is_multiple_of(2) { -1.0 } else { 1.0 };
        let t = Mat::from_fn(nf, nf, |i, j| if i == j { sign(j) } else { 0.0 });
        let square = |a: &mut Mat<f64>| *a = Mat::from_fn(nf, nf, |i, j| sign(i) * sign(j) * a[(i, j)]);
        let columns = |a: &mut Mat<f64>| *a = &*a * &t;
        columns(&mut p.modes.shape);
        p.modes.rotation.iter_mut().for_each(columns);
        p.modes.internal.iter_mut().for_each(|rows| columns(&mut rows.shape));
        p.modes.modal_damping.iter_mut().for_each(square);
        p.geometric_stiffness.iter_mut().for_each(|stiffness| square(&mut stiffness.matrix));
        inertia(p).stiffness.iter_mut().for_each(|stiffness| square(&mut stiffness.matrix));
        for load in &mut p.named_loads {
            load.modal.iter_mut().enumerate().for_each(|(j, value)| *value *= sign(j));
            columns(&mut load.turning);
        }
        p.invariants = p.invariants.with_basis(t.as_ref());
    });
    for other in [&moved, &flipped] {
        for (a, b) in [(&body, other), (other, &body)] {
            let found = compare(a, b, &Tolerances::default()).expect("comparable");
            assert!(found.passed() && found.same_nodes(), "{}", found.text());
        }
    }
    for of in [&body, &moved, &flipped] {
        let mut parts = of.clone().into_parts();
        parts.nodes.ids.iter_mut().for_each(|id| *id += 1000);
        let renumbered = FlexBody::new(parts).expect("other numbers");
        let found = compare(&body, &renumbered, &Tolerances::default()).expect("comparable");
        assert!(found.passed() && !found.same_nodes(), "{}", found.text());
        assert!(found.not_compared().iter().any(|entry| entry.contains("/interfaces/<name>/node_id")));
    }
}

/// Returns the complete body with two rows of the given quantities and units in its recovery; the second row has `factor` times the
/// numbers of the first.
fn with_two_rows(labels: [(Quantity, &str); 2], factor: f64) -> FlexBody {
    let mut parts = complete().into_parts();
    let recovery = &mut parts.recoveries[0];
    let first = recovery.rows[0].clone();
    let row = |(quantity, unit): (Quantity, &str)| RecoveryRow {
        name: quantity.name().to_owned(),
        quantity,
        unit: unit.to_owned(),
        ..first.clone()
    };
    recovery.rows = labels.map(row).to_vec();
    let twice = |columns: &Mat<f64>| {
        Mat::from_fn(
            2,
            columns.ncols(),
            |i, c| if i == 0 { columns[(0, c)] } else { factor * columns[(0, c)] },
        )
    };
    recovery.offset.push(factor * recovery.offset[0]);
    recovery.modes = twice(&recovery.modes);
    recovery.spin = twice(&recovery.spin);
    recovery.named = twice(&recovery.named);
    recovery.loads.iter_mut().for_each(|load| load.columns = twice(&load.columns));
    recovery.motion.iter_mut().for_each(|own| own.columns = twice(&own.columns));
    FlexBody::new(parts).expect("valid")
}

/// A row of small numbers in one unit is not hidden by large numbers in another.
#[test]
fn rows_of_different_units_are_compared_apart() {
    let body = with_two_rows([(Quantity::Stress, "MPa"), (Quantity::Displacement, "mm")], 1e-12);
    let changes: [fn(&mut Recovery); 4] = [
        |own| own.modes[(1, 2)] *= 1.01,
        |own| own.spin[(1, 2)] *= 1.01,
        |own| own.loads[0].columns[(1, 2)] *= 1.01,
        |own| own.motion[0].columns[(1, 2)] *= 1.01,
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let mut parts = body.clone().into_parts();
        change(&mut parts.recoveries[0]);
        let other = FlexBody::new(parts).expect("valid");
        let found = compare(&body, &other, &Tolerances::default()).expect("comparable");
        assert!(!found.passed(), "change {number}: {}", found.text());
    }
}

/// Moments of a section that vanish beside its forces may differ by rounding.
#[test]
fn moments_are_compared_with_the_forces_of_their_section() {
    let length = complete().units().length_name();
    let moment = format!("N {length}");
    let body = with_two_rows([(Quantity::Force, "N"), (Quantity::Moment, &moment)], 1e-16);
    let mut parts = body.clone().into_parts();
    parts.recoveries[0].loads[0].columns[(1, 2)] *= -1.0;
    let other = FlexBody::new(parts).expect("valid");
    let found = compare(&body, &other, &Tolerances::default()).expect("comparable");
    assert!(found.passed(), "{}", found.text());
}
