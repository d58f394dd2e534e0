//! Models with rotations of nodes, internal rows and masses that do not commute with rotations, from reading
//! to the file.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_body::basis::{BasisChoice, FreeSurface, Loads, ModeSettings};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, MassStructure};
use flexbody_body::invariants::{BodyFrame, primary_differences};
use flexbody_eigen::{Method, Wanted};
use flexbody_input::{ModelFiles, read_model};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{DofLabel, FeModel, Nodes, RawModel};
use nalgebra::{Matrix3, Vector3};
use oracle::general::{FIXTURES, raw_fixture as raw};
use oracle::random::Random;
use serde_json::Value;

fn settings(modes: usize, method: Method) -> ConvertSettings {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), method, ..ModeSettings::default() };
    ConvertSettings { modes, ..ConvertSettings::default() }
}

fn converted(raw: RawModel, modes: usize, method: Method) -> Conversion {
    let model = FeModel::from_raw(raw).expect("a body").model;
    convert(&model, &settings(modes, method), &Context::QUIET).expect("converts")
}

fn refused(raw: RawModel) -> Error {
    FeModel::from_raw(raw).expect_err("not a body as labelled")
}

/// Two frames of beams with six degrees of freedom per node; the references were computed by scipy.
#[test]
fn frames_of_beams_agree_with_their_references() {
    let root = oracle::shared();
    for name in ["j_frame_own", "j_frame_ops_cmass"] {
        let folder = root.join("models").join(name);
        if !folder.is_dir() {
            continue;
        }
        let path = |file: &str| folder.join(file);
        let (k, m) = (path("K.mtx.gz"), path("M.mtx.gz"));
        let files = ModelFiles::from_arguments(k, m, path("nodes.csv"), Some(path("dofs.csv")), None);
        let raw = read_model(&files.expect("no units")).expect("readable");
        let text = std::fs::read_to_string(path("ref.json")).expect("reference");
        let reference: Value = serde_json::from_str(&text).expect("JSON");
        let numbers = |v: &Value| -> Vec<f64> {
            v.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
        };
        let lambda = numbers(&reference["modes"]["lambda_"]);
        let rigid = &reference["consistent"];
        // The reference is dense: eigenvalues that should be zero show its rounding.
        let noise = numbers(&reference["modes"]["rigid_lambda"]).iter().fold(0.0, |m: f64, l| m.max(l.abs()));
        assert!(noise < 1e-8 * lambda[0], "{name}");
        for method in [Method::Dense, Method::Lanczos] {
            let conversion = converted(raw.clone(), lambda.len(), method);
            let body = &conversion.body;
            assert_eq!(body.source().mass_structure, MassStructure::General);
            let properties = &conversion.mass_properties;
            let mass = rigid["mass"].as_f64().expect("mass");
            assert!((properties.mass / mass - 1.0).abs() < 1e-13, "{name}");
            let com = Vector3::from_iterator(numbers(&rigid["com"]));
            assert!((properties.centre_of_mass - com).norm() < 1e-13, "{name}");
            let rows = rigid["inertia_com"].as_array().expect("a matrix");
            let inertia = Matrix3::from_row_iterator(rows.iter().flat_map(numbers));
            let error = (properties.inertia - inertia).norm() / inertia.norm();
            assert!(error < 1e-13, "{name}: inertia {error:e}");
            for (found, expected) in body.modes().eigenvalue.iter().zip(&lambda) {
                let error = (found - expected).abs();
                assert!(error < noise + 1e-11 * expected, "{name}: {found} {expected} {error:e}");
            }
            assert_eq!(body.certificate().proved_modes, Some(lambda.len()), "{name}");
        }
    }
}

/// A larger frame of the project with masses on its nodes; its reference was computed by scipy in extended
/// precision.
#[test]
fn the_car_frame_agrees_with_its_reference() {
    let path = oracle::fixtures().join("models/car_frame/expected.json");
    let reference: Value =
        serde_json::from_str(&std::fs::read_to_string(path).expect("reference")).expect("JSON");
    let lambda = reference["flexible_eigenvalues"].as_array().expect("a list");
    let conversion = converted(raw("car_frame"), lambda.len(), Method::Lanczos);
    assert_eq!(conversion.body.source().mass_structure, MassStructure::General);
    let mass = reference["rigid_body"]["mass"].as_f64().expect("mass");
    assert!((conversion.mass_properties.mass / mass - 1.0).abs() < 1e-13);
    let principal = reference["rigid_body"]["principal_inertia"].as_array().expect("a list");
    for (found, expected) in conversion.mass_properties.principal_moments.iter().zip(principal) {
        assert!((found / expected.as_f64().expect("a number") - 1.0).abs() < 1e-12);
    }
    for (found, expected) in conversion.body.modes().eigenvalue.iter().zip(lambda) {
        let error = (found / expected.as_f64().expect("a number") - 1.0).abs();
        assert!(error < 1e-11, "{found} {expected} {error:e}");
    }
    assert_eq!(conversion.body.certificate().proved_modes, Some(lambda.len()));
}

#[test]
fn dense_and_iterative_searches_give_the_same_body() {
    for name in FIXTURES {
        let [a, b] = [Method::Dense, Method::Lanczos].map(|method| converted(raw(name), 6, method).body);
        for (x, y) in a.modes().eigenvalue.iter().zip(&b.modes().eigenvalue) {
            assert!((x / y - 1.0).abs() < 1e-10, "{name}");
        }
        for (what, error) in primary_differences(a.invariants(), b.invariants()) {
            assert!(error < 1e-8, "{name} {what}: {error:e}");
        }
    }
}

/// The order of rows and of node numbers does not change the body.
#[test]
fn the_order_of_rows_and_nodes_does_not_matter() {
    for name in FIXTURES {
        let straight = raw(name);
        let labels = straight.dofs.clone().expect("labels");
        let mut random = Random(11);
        let n = labels.len();
        let order = random.permutation(n);
        let to: Vec<u32> = order.iter().map(|&i| i as u32).collect();
        let mut mixed = straight.clone();
        mixed.stiffness.matrix = straight.stiffness.matrix.permuted(&to);
        mixed.mass.matrix = straight.mass.matrix.permuted(&to);
        let mut dofs = labels.clone();
        labels.iter().zip(&order).for_each(|(label, &i)| dofs[i] = *label);
        mixed.dofs = Some(dofs);
        let places = random.permutation(straight.nodes.len());
        mixed.nodes = Nodes {
            ids: places.iter().map(|&i| straight.nodes.ids[i]).collect(),
            positions: places.iter().map(|&i| straight.nodes.positions[i]).collect(),
        };
        let (a, b) = (converted(straight, 6, Method::Auto).body, converted(mixed, 6, Method::Auto).body);
        for (what, error) in primary_differences(a.invariants(), &b.invariants().clone()) {
            assert!(error < 1e-8, "{name} {what}: {error:e}");
        }
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    for name in FIXTURES {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| converted(raw(name), 8, Method::Lanczos).body)
        };
        let one = run(1);
        assert!(run(2) == one && run(3) == one, "{name}");
    }
}

#[test]
fn bodies_come_back_from_their_files_to_the_last_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in FIXTURES {
        let body = converted(raw(name), 8, Method::Auto).body;
        let path = folder.path().join(format!("{name}.flex.h5"));
        flexbody_file::write(&body, &path).expect("written");
        assert!(flexbody_file::read(&path).expect("read") == body, "{name}");
    }
}

/// Invariants about another origin and in other axes agree with those of a conversion there, also in the
/// plane.
#[test]
fn invariants_follow_the_frame() {
    for name in FIXTURES {
        let model = FeModel::from_raw(raw(name)).expect("a body").model;
        let [own, other] = [BodyFrame::Principal, BodyFrame::Model].map(|frame| {
            let settings = ConvertSettings { frame: frame.into(), ..settings(6, Method::Auto) };
            convert(&model, &settings, &Context::QUIET).expect("converts").body
        });
        let frame = own.frame();
        // x_model = r0 + A x: rotates back, then shifts the origin to -r0.
        let moved = own.invariants().rotated(&frame.axes.transpose()).shifted(-frame.origin);
        let signs = faer::Mat::from_fn(6, 6, |i, j| {
            let (a, b) = (own.modes(), other.modes());
            // The sign of a mode is that of the product of both rotated shapes.
            let turned = |row: usize| -> f64 {
                (0..3).map(|l| frame.axes[(row % 3, l)] * a.shape[(row / 3 * 3 + l, j)]).sum()
            };
            let product: f64 = (0..a.shape.nrows()).map(|row| turned(row) * b.shape[(row, j)]).sum();
            if i == j { product.signum() } else { 0.0 }
        });
        let moved = moved.with_basis(signs.as_ref());
        for (what, error) in primary_differences(other.invariants(), &moved) {
            assert!(error < 1e-11, "{name} {what}: {error:e}");
        }
    }
}

fn relabelled(mut raw: RawModel, to: impl Fn(u8) -> u8) -> RawModel {
    for DofLabel { direction, .. } in raw.dofs.as_mut().expect("labels") {
        *direction = to(*direction);
    }
    raw
}

#[test]
fn rotations_labelled_as_displacements_are_recognised() {
    let swapped = relabelled(raw("frame_beams"), |d| if d > 3 { d - 3 } else { d + 3 });
    let error = refused(swapped);
    assert!(error.diagnostics().iter().any(|d| d.code() == Code::RigidMotionStrained));
    assert!(error.to_string().contains("rotations are labelled as displacements"), "{error}");

    let mut flat = relabelled(raw("plane_frame"), |d| if d == 6 { 3 } else { d });
    flat.dimension = 3;
    let error = refused(flat);
    assert!(error.diagnostics().iter().any(|d| d.code() == Code::RigidMotionStrained));
    assert!(error.to_string().contains("label the rotations with direction 6"), "{error}");

    let mut unlabelled = raw("frame_beams");
    unlabelled.dofs = None;
    let error = refused(unlabelled);
    assert_eq!(error.diagnostics()[0].code(), Code::DofCount);
    assert!(error.to_string().contains("labels the 6 rows of each node"), "{error}");

    let mut blocked = raw("cube_hex8");
    let n = blocked.nodes.len() as u32;
    blocked.stiffness.matrix = blocked.stiffness.matrix.permuted(&component_blocked(&blocked, n));
    blocked.mass.matrix = blocked.mass.matrix.permuted(&component_blocked(&blocked, n));
    blocked.dofs = None;
    let error = refused(blocked);
    assert!(error.to_string().contains("rows are those of x for all nodes"), "{error}");
}

/// Returns the position of each row of a solid when all rows of x come first.
fn component_blocked(raw: &RawModel, n: u32) -> Vec<u32> {
    let place = |id: i64| raw.nodes.ids.iter().position(|&i| i == id).expect("a node") as u32;
    let labels = raw.dofs.as_ref().expect("labels");
    labels.iter().map(|label| (u32::from(label.direction) - 1) * n + place(label.node)).collect()
}

/// A frame and a block with a reference node in one pair of matrices, with disjoint node numbers.
#[test]
fn bodies_with_rotations_and_inner_rows_are_taken_apart() {
    let parts = [raw("frame_beams"), raw("hex8_bubbles"), raw("spring_ends")];
    let mut together = parts[0].clone();
    let (mut k, mut m) = (Vec::new(), Vec::new());
    (together.dofs, together.nodes) = (Some(Vec::new()), Nodes::default());
    let mut first = 0;
    for (i, part) in parts.iter().enumerate() {
        let number = |id: i64| id + 10_000 * i as i64;
        together.nodes.ids.extend(part.nodes.ids.iter().map(|&id| number(id)));
        together.nodes.positions.extend(&part.nodes.positions);
        let labels = part.dofs.as_ref().expect("labels");
        let renumbered = labels.iter().map(|l| DofLabel { node: number(l.node), ..*l });
        together.dofs.as_mut().expect("labels").extend(renumbered);
        for (matrix, entries) in [(&part.stiffness.matrix, &mut k), (&part.mass.matrix, &mut m)] {
            for j in 0..matrix.n_cols() {
                let (rows, values) = matrix.column(j);
                entries.extend(rows.iter().zip(values).map(|(&i, &v)| (first + i, first + j as u32, v)));
            }
        }
        first += labels.len() as u32;
    }
    let n = first as usize;
    together.stiffness.matrix = CscMatrix::from_triplets(n, n, &k);
    together.mass.matrix = CscMatrix::from_triplets(n, n, &m);
    assert_eq!(refused(together.clone()).diagnostics()[0].code(), Code::BodiesSeveral);

    let bodies = FeModel::bodies_from_raw(together).expect("three bodies");
    assert_eq!(bodies.len(), 3);
    for (checked, part) in bodies.iter().zip(parts) {
        let alone = FeModel::from_raw(part).expect("a body").model;
        let [a, b] = [&checked.model, &alone]
            .map(|model| convert(model, &settings(6, Method::Auto), &Context::QUIET).expect("converts").body);
        assert_eq!(a.invariants(), b.invariants(), "{}", checked.model.name());
        assert_eq!(a.modes().rotation, b.modes().rotation);
    }
}

#[test]
fn certified_says_what_it_does_not_cover() {
    let model = FeModel::from_raw(raw("frame_beams")).expect("a body").model;
    let mut settings = settings(6, Method::Auto);
    settings.modes.accuracy = flexbody_eigen::Accuracy::Certified;
    let error = convert(&model, &settings, &Context::QUIET).expect_err("rotations");
    assert_eq!(error.diagnostics()[0].code(), Code::Usage);
    // Bubbles are displacements.
    let model = FeModel::from_raw(raw("hex8_bubbles")).expect("a body").model;
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    let digits = body.certificate().guarantee.as_ref().expect("certified").digits;
    assert!(digits.iter().all(|d| *d > 13.0), "{digits:?}");
}

/// Returns f'K^+ f of the load of a constant spin from the invariants alone: sum_j (w' W1_j w / 2)^2 /
/// lambda_j.
fn spin_compliance(body: &FlexBody, spin: Vector3<f64>) -> f64 {
    let (w1, nf) = (body.invariants().w1().expect("held"), body.n_modes());
    let load = |j: usize| {
        let block = Matrix3::from_fn(|k, b| w1[(k, b * nf + j)]);
        0.5 * spin.dot(&(block * spin))
    };
    body.modes().eigenvalue.iter().enumerate().map(|(j, lambda)| load(j).powi(2) / lambda).sum()
}

/// With centrifugal residual vectors a few modes respond to spin like all modes, for bodies with rotations.
#[test]
fn centrifugal_vectors_carry_the_response_that_all_modes_have() {
    for name in ["frame_beams", "shell_folded", "mpc_block", "hex8_edges", "plane_frame"] {
        let all = converted(raw(name), usize::MAX, Method::Dense).body;
        let few = converted(raw(name), 5, Method::Auto).body;
        let mut settings = settings(5, Method::Auto);
        let vectors = FreeSurface { residual_vectors: vec![Loads::Centrifugal] };
        settings.basis = BasisChoice::Free(vectors);
        let model = FeModel::from_raw(raw(name)).expect("a body").model;
        let completed = convert(&model, &settings, &Context::QUIET).expect("converts").body;
        let plane = all.dimension() == 2;
        for spin in [Vector3::new(0.3, -1.0, 0.7), Vector3::new(1.0, 0.2, -0.4)] {
            let spin = if plane { Vector3::z() } else { spin };
            let exact = spin_compliance(&all, spin);
            let error = (spin_compliance(&completed, spin) / exact - 1.0).abs();
            assert!(error < 1e-9, "{name}: {error:e}");
            assert!(1.0 - spin_compliance(&few, spin) / exact > 1e-4, "{name}: the modes alone do it");
        }
    }
}

/// Straight beams have modes without any displacement of the nodes (torsion), or along one axis only
/// (extension).
#[test]
fn straight_beams_fulfil_every_identity() {
    // Along and across the axes zeros have rounding of either sign.
    let directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 2.0, 3.0], [-2.0, 0.3, 0.7], [0.1, -0.9, 0.4]];
    for (parts, direction) in [1, 2, 10].into_iter().flat_map(|parts| directions.map(|d| (parts, d))) {
        let direction = Vector3::from(direction).normalize();
        let body = converted(straight_beam(parts, direction), usize::MAX, Method::Dense).body;
        assert_eq!(body.n_modes(), 6 * parts, "all flexible modes");
        for check in body.identities(BodyFrame::Com) {
            assert!(check.passed, "{parts} parts along {direction:?}: {check:?}");
        }
    }
}

/// Returns a bar with extension, torsion and bending: unit lumped inertia at its nodes, springs between
/// relative motions of neighbours.
fn straight_beam(parts: usize, direction: Vector3<f64>) -> RawModel {
    let n = parts + 1;
    let place = |i: usize| direction * (i as f64 / parts as f64);
    let (mut k, mut m) = (Vec::new(), Vec::new());
    for i in 0..n as u32 {
        for axis in 0..3 {
            m.push((6 * i + axis, 6 * i + axis, 1.0));
            m.push((6 * i + 3 + axis, 6 * i + 3 + axis, 0.01));
        }
    }
    for i in 0..parts {
        // Relative displacement at the middle of the segment, and relative rotation.
        let half = 0.5 * (place(i + 1) - place(i));
        let mut rows = vec![[0.0; 12]; 6];
        for a in 0..3 {
            let lever = Vector3::ith(a, 1.0).cross(&half);
            rows[a][a] = -1.0;
            rows[a][6 + a] = 1.0;
            rows[3 + a][3 + a] = -1.0;
            rows[3 + a][9 + a] = 1.0;
            for (row, value) in lever.iter().enumerate() {
                rows[row][3 + a] -= value;
                rows[row][9 + a] -= value;
            }
        }
        let stiffness = [3e4, 1e4, 2e4, 100.0, 50.0, 70.0];
        for a in 0..12 {
            for b in 0..12 {
                let value: f64 = (0..6).map(|s| stiffness[s] * rows[s][a] * rows[s][b]).sum();
                if value != 0.0 {
                    k.push((6 * i as u32 + a as u32, 6 * i as u32 + b as u32, value));
                }
            }
        }
    }
    let nodes = Nodes { ids: (1..=n as i64).collect(), positions: (0..n).map(|i| place(i).into()).collect() };
    let matrix = |entries: &[(u32, u32, f64)]| CscMatrix::from_triplets(6 * n, 6 * n, entries);
    let mut raw = RawModel::in_memory("straight", matrix(&k), matrix(&m), nodes);
    raw.dofs = Some(
        (1..=n as i64).flat_map(|node| (1..=6).map(move |direction| DofLabel { node, direction })).collect(),
    );
    raw
}
