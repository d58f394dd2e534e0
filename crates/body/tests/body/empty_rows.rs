//! Rows and directions that are empty in both K and M: nodes without elements, rotations of solids, normals
//! of shells without drilling stiffness. The body equals the one without them.

use oracle::elements::{ElementKind, MassRule, Material};

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::basis::{BasisChoice, FreeSurface, Loads, ModeSettings, UserLoads};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::{Method, Wanted};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{CheckedModel, DofLabel, FeModel, NodeSet, Nodes, RawModel, RawShapes};
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use oracle::mesh::Mesh;
use oracle::turning;
use std::path::PathBuf;

fn converted(model: &FeModel, modes: usize, method: Method) -> Conversion {
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), method, ..ModeSettings::default() };
    convert(model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("converts")
}

fn told(diagnostics: &[Diagnostic], code: Code) -> String {
    diagnostics
        .iter()
        .find(|diagnostic| diagnostic.code() == code)
        .unwrap_or_else(|| panic!("{diagnostics:?}"))
        .message()
        .to_owned()
}

fn block() -> RawModel {
    Mesh::block(ElementKind::Hex8, [3, 2, 2], [0.3, 0.15, 0.1])
        .assemble(&Material::STEEL, MassRule::Consistent)
        .raw_model()
}

/// Returns the block with six rows per node, of which the rotations are empty, and with two nodes without
/// elements, whose rows are in the middle.
fn block_with_empty_rows() -> RawModel {
    let plain = block();
    let ids = plain.nodes.ids.clone();
    let after = ids.len() / 2;
    let mut nodes = plain.nodes.clone();
    let orphans = [(9001, [9.0, 9.0, 9.0]), (9002, [0.1, 0.05, 0.05])];
    for (id, position) in orphans {
        nodes.ids.insert(after, id);
        nodes.positions.insert(after, position);
    }
    let labels: Vec<DofLabel> = nodes
        .ids
        .iter()
        .flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction }))
        .collect();
    let row = |old: usize| {
        let (node, k) = (old / 3, old % 3);
        (6 * if node < after { node } else { node + orphans.len() } + k) as u32
    };
    let n = labels.len();
    let spread = |matrix: &CscMatrix| {
        let entries: Vec<(u32, u32, f64)> = (0..matrix.n_cols())
            .flat_map(|j| {
                let (rows, values) = matrix.column(j);
                rows.iter().zip(values).map(move |(&i, &v)| (row(i as usize), row(j), v))
            })
            .collect();
        CscMatrix::from_triplets(n, n, &entries)
    };
    let (stiffness, mass) = (spread(&plain.stiffness.matrix), spread(&plain.mass.matrix));
    RawModel { dofs: Some(labels), ..RawModel::in_memory("block", stiffness, mass, nodes) }
}

#[test]
fn empty_rows_are_left_out_and_told() {
    let plain = FeModel::from_raw(block()).expect("a body").model;
    let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(block_with_empty_rows()).expect("a body");
    let rotations = 3 * plain.nodes().len();
    let message = told(&diagnostics, Code::RowsEmpty);
    assert_eq!(
        message,
        format!(
            "{} rows without stiffness and mass are left out: 12 of nodes without elements (9002, 9001), {rotations} rotations of other nodes",
            12 + rotations
        )
    );
    assert!(diagnostics.iter().all(|diagnostic| diagnostic.code() != Code::NodesUnused), "{diagnostics:?}");
    assert_eq!(model.nodes(), plain.nodes());
    assert_eq!((model.stiffness(), model.matrix_rows()), (plain.stiffness(), 6 * (plain.nodes().len() + 2)));
    let [a, b] = [&plain, &model].map(|model| converted(model, 5, Method::Auto).body);
    assert_eq!((a.modes(), a.invariants()), (b.modes(), b.invariants()));
}

#[test]
fn what_is_said_of_left_out_rows_is_refused() {
    let mut raw = block_with_empty_rows();
    raw.data.interfaces = vec![NodeSet::new("hook", vec![9001])];
    let error = FeModel::from_raw(raw).expect_err("an interface of a node that is not there");
    assert!(error.to_string().contains("names 1 nodes without stiffness and mass: 9001"), "{error}");

    // Loads by rows of the matrices: on a node of the block, and on a node without elements.
    let model = FeModel::from_raw(block_with_empty_rows()).expect("a body").model;
    let load = |row: usize| {
        let matrix = Mat::from_fn(model.matrix_rows(), 1, |i, _| f64::from(i == row));
        UserLoads::new(&model, RawShapes { matrix, digits: 17, path: PathBuf::new(), source: None })
    };
    load(1).expect("a load on the block");
    let orphan = 6 * (model.nodes().len() / 2) + 1;
    let error = load(orphan).expect_err("a load on nothing");
    assert!(
        error.has(Code::ShapesSize) && error.to_string().contains("neither stiffness nor mass"),
        "{error}"
    );

    // A displacement without stiffness and mass at a node with other rows is an error.
    let mut raw = block();
    let n = raw.stiffness.matrix.n_cols();
    for matrix in [&mut raw.stiffness.matrix, &mut raw.mass.matrix] {
        let entries: Vec<(u32, u32, f64)> = (0..n)
            .flat_map(|j| {
                matrix.column(j).0.iter().zip(matrix.column(j).1).map(move |(&i, &v)| (i, j as u32, v))
            })
            .filter(|(i, j, _)| *i != 4 && *j != 4)
            .collect();
        *matrix = CscMatrix::from_triplets(n, n, &entries);
    }
    assert!(FeModel::from_raw(raw).expect_err("a row of nothing").has(Code::PencilSingular));
}

/// Returns a plate of 4 x 3 nodes in the plane x, y: bars along edges and diagonals with out-of-plane bending
/// and torsion only. Rotations about z have neither stiffness nor mass. Returns positions of the nodes, K and
/// M (six rows per node).
fn plate() -> (Vec<Vector3<f64>>, DMatrix<f64>, DMatrix<f64>) {
    let at = |i: usize, j: usize| 4 * j + i;
    let places: Vec<Vector3<f64>> = (0..12)
        .map(|node| {
            let (i, j) = ((node % 4) as f64, (node / 4) as f64);
            Vector3::new(0.1 * i + 0.01 * j * j, 0.12 * j - 0.015 * i, 0.0)
        })
        .collect();
    let mut edges = Vec::new();
    for (i, j) in (0..4).flat_map(|i| (0..3).map(move |j| (i, j))) {
        edges.extend((i < 3).then(|| (at(i, j), at(i + 1, j))));
        edges.extend((j < 2).then(|| (at(i, j), at(i, j + 1))));
        edges.extend((i < 3 && j < 2).then(|| (at(i, j), at(i + 1, j + 1))));
    }
    let n = 6 * places.len();
    let (mut k, mut m) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for (a, b) in edges {
        let (along, length) = ((places[b] - places[a]).normalize(), (places[b] - places[a]).norm());
        let across = Vector3::z().cross(&along);
        // Displacement (from 0) or rotation (from 3) of a node along a direction, as a row.
        let part = |node: usize, from: usize, direction: &Vector3<f64>| {
            let mut row = DVector::zeros(n);
            (0..3).for_each(|axis| row[6 * node + from + axis] = direction[axis]);
            row
        };
        let difference =
            |from: usize, direction: &Vector3<f64>| part(b, from, direction) - part(a, from, direction);
        let mut add = |stiffness: f64, row: DVector<f64>| k += stiffness * &row * row.transpose();
        add(2e7 / length, difference(0, &along));
        add(90.0 / length, difference(3, &along));
        // Slopes of the deflection relative to the chord: w' = -theta across.
        let chord = difference(0, &Vector3::z()) / length;
        let slopes = [a, b].map(|node| -part(node, 3, &across) - &chord);
        add(2.0 * 150.0 / length, &slopes[0] + &slopes[1]);
        add(2.0 * 150.0 / length, slopes[0].clone());
        add(2.0 * 150.0 / length, slopes[1].clone());
        for node in [a, b] {
            (0..3).for_each(|axis| m[(6 * node + axis, 6 * node + axis)] += 0.4 * length);
            (3..5).for_each(|axis| m[(6 * node + axis, 6 * node + axis)] += 2e-4 * length);
        }
    }
    (places, k, m)
}

/// Returns the rotated plate.
fn turned(rotation: &Rotation3<f64>) -> RawModel {
    let (places, k, m) = plate();
    let n = k.nrows();
    let mut all = DMatrix::zeros(n, n);
    for block in 0..n / 3 {
        all.view_mut((3 * block, 3 * block), (3, 3)).copy_from(rotation.matrix());
    }
    let sparse = |matrix: &DMatrix<f64>| {
        let matrix = &all * matrix * all.transpose();
        let matrix = 0.5 * (&matrix + matrix.transpose());
        // Rounding in empty rows remains in the matrix, like in files of FE programs.
        turning::sparse(&matrix)
    };
    let nodes = Nodes {
        ids: (1..=places.len() as i64).collect(),
        positions: places.iter().map(|place| (rotation * place).into()).collect(),
    };
    let labels =
        nodes.ids.iter().flat_map(|&node| (1..=6).map(move |direction| DofLabel { node, direction }));
    let dofs = Some(labels.collect());
    RawModel { dofs, ..RawModel::in_memory("plate", sparse(&k), sparse(&m), nodes) }
}

/// Returns the eigenvalues of the plate without its rotations about z, by dense algebra.
fn reference() -> Vec<f64> {
    let (_, k, m) = plate();
    let kept: Vec<usize> = (0..k.nrows()).filter(|row| row % 6 != 5).collect();
    let root: Vec<f64> = kept.iter().map(|&row| m[(row, row)].sqrt()).collect();
    let scaled = DMatrix::from_fn(kept.len(), kept.len(), |i, j| k[(kept[i], kept[j])] / root[i] / root[j]);
    let mut values: Vec<f64> = scaled.symmetric_eigen().eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values.split_off(6)
}

#[test]
fn rotations_about_a_normal_follow_the_nodes_around() {
    let expected = reference();
    let tilt = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let flat = FeModel::from_raw(turned(&Rotation3::identity())).expect("a body");
    let tilted = FeModel::from_raw(turned(&tilt)).expect("a body");
    for model in [&flat, &tilted] {
        assert_eq!(
            told(&model.diagnostics, Code::RotationsFollow),
            "rotations of 12 nodes have neither stiffness nor mass about one direction: they follow the nodes around (1, 2, 3, 4, 5 and 7 more)"
        );
    }
    let mut moments = Vec::new();
    for (model, method) in
        [(&flat.model, Method::Auto), (&tilted.model, Method::Dense), (&tilted.model, Method::Lanczos)]
    {
        let body = converted(model, 8, method).body;
        for (found, expected) in body.modes().eigenvalue.iter().zip(&expected) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{method:?}: {found} {expected}");
        }
        let checks = body_identities(&body).into_iter().chain(verify(&body, model).expect("the same model"));
        let broken: Vec<_> = checks.filter(|check| !check.passed).collect();
        assert!(broken.is_empty(), "{method:?}: {broken:?}");
        let mut own: Vec<f64> = body.invariants().inertia().symmetric_eigenvalues().iter().copied().collect();
        own.sort_by(f64::total_cmp);
        moments.push(Vector3::from_vec(own));
    }
    let apart = |a: &Vector3<f64>, b: &Vector3<f64>| (a - b).norm() / a.norm();
    assert!(apart(&moments[0], &moments[1]) < 1e-12 && apart(&moments[0], &moments[2]) < 1e-12);

    // The rotation about the normal follows the neighbouring nodes, in a mode that rotates them in the plane.
    let body = converted(&tilted.model, 20, Method::Dense).body;
    let (shape, rotation) = (&body.modes().shape, body.modes().rotation.as_ref().expect("rotations"));
    let normal = body.frame().axes.transpose() * (tilt * Vector3::z());
    let of =
        |matrix: &Mat<f64>, node: usize, j: usize| Vector3::from_fn(|axis, _| matrix[(3 * node + axis, j)]);
    let largest =
        |matrix: &Mat<f64>, j: usize| (0..12).map(|node| of(matrix, node, j).norm()).fold(0.0, f64::max);
    for j in 0..20 {
        let drilling = (0..12).map(|node| of(rotation, node, j).dot(&normal).abs()).fold(0.0, f64::max);
        assert!(drilling < 40.0 * largest(shape, j) / 0.1, "mode {j}: {drilling}");
    }
}

/// A moment about the normal acts on the nodes around: its residual vector is the same however the plate lies.
#[test]
fn a_moment_about_a_normal_acts_on_the_nodes_around() {
    let with_moment = |rotation: &Rotation3<f64>| {
        let model = FeModel::from_raw(turned(rotation)).expect("a body").model;
        let (node, moment) = (5, rotation * Vector3::z());
        let first = 6 * node + 3;
        let matrix = Mat::from_fn(72, 1, |row, _| {
            row.checked_sub(first).filter(|k| *k < 3).map_or(0.0, |k| moment[k])
        });
        let loads = RawShapes { matrix, digits: 17, path: PathBuf::new(), source: None };
        let loads = UserLoads::new(&model, loads).expect("loads");
        let basis = BasisChoice::Free(FreeSurface { residual_vectors: vec![Loads::User(loads)] });
        let modes = ModeSettings { wanted: Wanted::Lowest(8), ..ModeSettings::default() };
        let settings = ConvertSettings { modes, basis, ..ConvertSettings::default() };
        convert(&model, &settings, &Context::QUIET).expect("converts").body.modes().eigenvalue.clone()
    };
    let flat = with_moment(&Rotation3::identity());
    assert_eq!(flat.len(), 9);
    let tilted = with_moment(&Rotation3::from_euler_angles(0.4, -0.7, 1.1));
    for (flat, tilted) in flat.iter().zip(&tilted) {
        assert!((flat / tilted - 1.0).abs() < 1e-8, "{flat} {tilted}");
    }
}

/// A stiffness about the normal counts, however small it is; a mass without stiffness is a mechanism.
#[test]
fn rotations_with_a_stiffness_or_a_mass_are_left_alone() {
    let tilt = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let normal = tilt * Vector3::z();
    let with = |size: f64, to_mass: bool| {
        let mut raw = turned(&tilt);
        let n = raw.stiffness.matrix.n_cols();
        let matrix = if to_mass { &mut raw.mass.matrix } else { &mut raw.stiffness.matrix };
        let mut entries: Vec<(u32, u32, f64)> = (0..n)
            .flat_map(|j| {
                matrix.column(j).0.iter().zip(matrix.column(j).1).map(move |(&i, &v)| (i, j as u32, v))
            })
            .collect();
        // Stiffness acts between neighbours, so that rigid motion is free.
        for (a, b) in [(0u32, 1u32), (4, 5)] {
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let value = size * normal[i] * normal[j];
                let row = |node: u32, axis: usize| 6 * node + 3 + axis as u32;
                entries.extend([(row(a, i), row(a, j), value), (row(b, i), row(b, j), value)]);
                if !to_mass {
                    entries.extend([(row(a, i), row(b, j), -value), (row(b, i), row(a, j), -value)]);
                }
            }
        }
        *matrix = CscMatrix::from_triplets(n, n, &entries);
        FeModel::from_raw(raw).expect("rows by themselves are sound").diagnostics
    };
    for (size, to_mass) in [(1e-4, false), (1e-6, true)] {
        let message = told(&with(size, to_mass), Code::RotationsFollow);
        assert!(message.starts_with("rotations of 8 nodes"), "{message}");
    }
}

/// A thin sheet written with few digits.
#[test]
fn digits_do_not_hide_a_direction_without_stiffness() {
    let tilt = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let mut raw = turned(&tilt);
    for matrix in [&mut raw.stiffness, &mut raw.mass] {
        let n = matrix.matrix.n_cols();
        let short = |value: f64| format!("{value:.9e}").parse::<f64>().expect("a number");
        let entries: Vec<(u32, u32, f64)> = (0..n)
            .flat_map(|j| {
                let (rows, values) = matrix.matrix.column(j);
                rows.iter().zip(values).map(move |(&i, &v)| (i, j as u32, short(v)))
            })
            .collect();
        (matrix.matrix, matrix.digits) = (CscMatrix::from_triplets(n, n, &entries), 10);
    }
    let CheckedModel { model, diagnostics, .. } = FeModel::from_raw(raw).expect("a body");
    assert!(told(&diagnostics, Code::RotationsFollow).starts_with("rotations of 12 nodes"));
    for (found, expected) in
        converted(&model, 6, Method::Dense).body.modes().eigenvalue.iter().zip(reference())
    {
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    }
}
