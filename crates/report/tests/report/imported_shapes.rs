//! Imported shapes give the same body as computed modes in any basis, precision, order and file format;
//! shapes that are no modes are reported.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, ImportedShapes, ModalBasis, ModeSettings, Task, free_surface};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_eigen::{Accuracy, Proof, Wanted};
use flexbody_input::{MatrixLocation, read_manifest, read_model, read_shapes};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawShapes, rigid_fields};
use flexbody_report::{Tolerances, compare};
use hdf5_metno::File;
use oracle::counted::counted;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{DofOrder, Numbering, reordered};
use oracle::mesh::Mesh;
use oracle::random::Random;
use std::path::PathBuf;

const COUNT: usize = 12;

/// Returns a bracket whose matrix rows have an arbitrary order.
fn bracket() -> FeModel {
    let raw = Mesh::bracket(ElementKind::Hex8, 4, 2, 0.05)
        .assemble(&Material::STEEL, MassRule::Consistent)
        .raw_model();
    let raw = reordered(&raw, DofOrder::Shuffled(7), Numbering::Gaps(3));
    FeModel::from_raw(raw).expect("a sound model").model
}

fn settings(wanted: Wanted, accuracy: Accuracy) -> ModeSettings {
    ModeSettings { wanted, accuracy, ..ModeSettings::default() }
}

fn free(model: &FeModel) -> Mat<f64> {
    let settings = settings(Wanted::Lowest(COUNT), Accuracy::Certified);
    free_surface(model, &settings, &Context::QUIET).expect("a sound model").solution.vectors
}

/// Reorders columns from internal order to matrix rows.
fn by_matrix_rows(model: &FeModel, columns: &Mat<f64>) -> Mat<f64> {
    let n = columns.nrows();
    let row_of = model.in_internal_order(Mat::from_fn(n, 1, |row, _| row as f64));
    let mut out = Mat::zeros(n, columns.ncols());
    for internal in 0..n {
        for j in 0..columns.ncols() {
            out[(row_of[(internal, 0)] as usize, j)] = columns[(internal, j)];
        }
    }
    out
}

fn imported(model: &FeModel, internal: &Mat<f64>, digits: u8) -> ImportedShapes {
    let matrix = by_matrix_rows(model, internal);
    let raw = RawShapes { matrix, digits, path: PathBuf::new(), source: None };
    ImportedShapes::new(model, raw).expect("shapes of this model")
}

fn modes_of(model: &FeModel, shapes: ImportedShapes, accuracy: Accuracy) -> Result<ModalBasis> {
    let settings = settings(Wanted::Lowest(usize::MAX), accuracy);
    let task = Task { model, settings: &settings, context: &Context::QUIET };
    BasisChoice::Imported(shapes).basis().modes(&task)
}

fn converted(model: &FeModel, basis: BasisChoice, accuracy: Accuracy) -> Conversion {
    let count = if basis == BasisChoice::default() { COUNT } else { usize::MAX };
    let modes = settings(Wanted::Lowest(count), accuracy);
    convert(model, &ConvertSettings { modes, basis, ..ConvertSettings::default() }, &Context::QUIET)
        .expect("a body")
}

fn codes(conversion: &Conversion) -> Vec<Code> {
    conversion.diagnostics.iter().map(|d| d.code()).collect()
}

fn random(rows: usize, cols: usize, random: &mut Random) -> Mat<f64> {
    Mat::from_fn(rows, cols, |_, _| random.signed())
}

#[test]
fn mixed_shapes_with_rigid_motion_in_them_give_the_body_of_the_free_path() {
    let model = bracket();
    let modes = free(&model);
    let free_body = converted(&model, BasisChoice::default(), Accuracy::Standard).body;
    let rigid = rigid_fields(&model.nodes().positions, 3, [0.3, -1.0, 2.0], 0.1);
    for seed in 0..3 {
        let mut r = Random(seed);
        let size = modes.norm_max();
        let shapes = &modes * random(COUNT, COUNT, &mut r)
            + &rigid * random(6, COUNT, &mut r) * faer::Scale(30.0 * size);
        let done =
            converted(&model, BasisChoice::Imported(imported(&model, &shapes, 17)), Accuracy::Standard);
        let strict = Tolerances { invariants: 1e-9, ..Tolerances::default() };
        let comparison = compare(&free_body, &done.body, &strict).expect("comparable");
        assert!(comparison.passed(), "{comparison:#?}");
        assert_eq!(codes(&done), []);
        assert_eq!(done.body.certificate().proved_modes, Some(COUNT), "{}", done.body.certificate().remark);
        let invariants = done.body.invariants();
        let root_mass = invariants.mass().sqrt();
        assert!(invariants.c1().norm_max() < 3e-14 * root_mass, "C1 {:e}", invariants.c1().norm_max());
        let length = (invariants.second_moment().trace() / invariants.mass()).sqrt();
        assert!(
            invariants.c2().norm_max() < 3e-14 * root_mass * length,
            "C2 {:e}",
            invariants.c2().norm_max()
        );
    }
}

#[test]
fn certified_bounds_hold_for_imported_eigenvectors_too() {
    let model = bracket();
    let shapes = imported(&model, &free(&model), 17);
    let found = modes_of(&model, shapes, Accuracy::Certified).expect("eigenvectors").solution;
    let bounds = found.bounds.expect("certified");
    for (j, lambda) in found.eigenvalues.iter().enumerate() {
        assert!(bounds.lower[j] <= *lambda && *lambda <= bounds.upper[j]);
        assert!(bounds.upper[j] - bounds.lower[j] < 1e-9 * lambda, "mode {j}");
    }
}

#[test]
fn accuracy_fast_factors_nothing() {
    let model = bracket();
    let shapes = imported(&model, &free(&model), 17);
    let settings = settings(Wanted::Lowest(usize::MAX), Accuracy::Fast);
    let (found, work) = counted(|context| {
        BasisChoice::Imported(shapes).basis().modes(&Task { model: &model, settings: &settings, context })
    });
    let found = found.expect("shapes").solution;
    assert_eq!((work.factorizations, work.factor_len), (0, 0));
    assert_eq!(found.completeness.proof, Proof::NotProved);
}

#[test]
fn single_precision_costs_what_it_must_and_is_said() {
    let model = bracket();
    let exact = converted(&model, BasisChoice::default(), Accuracy::Standard).body;
    let modes = free(&model);
    let rounded = Mat::from_fn(modes.nrows(), COUNT, |i, j| f64::from(modes[(i, j)] as f32));
    let done = converted(&model, BasisChoice::Imported(imported(&model, &rounded, 7)), Accuracy::Standard);
    for (a, b) in exact.modes().eigenvalue.iter().zip(&done.body.modes().eigenvalue) {
        assert!((a / b - 1.0).abs() < 1e-8, "{a} {b}");
    }
    let tolerances = Tolerances { frequency: 1e-8, invariants: 1e-5, ..Tolerances::default() };
    assert!(compare(&exact, &done.body, &tolerances).expect("comparable").passed());
    assert_eq!(codes(&done), [Code::ShapesSpan]);
    assert_eq!(done.body.certificate().proved_modes, None);
}

#[test]
fn what_adds_nothing_is_left_out_and_named() {
    let model = bracket();
    let modes = free(&model);
    let rigid = rigid_fields(&model.nodes().positions, 3, [0.0; 3], 1.0);
    // Twelve modes, the third repeated, six rigid motions, and a sum of two modes.
    let shapes = Mat::from_fn(modes.nrows(), COUNT + 8, |i, j| match j {
        _ if j < COUNT => modes[(i, j)],
        COUNT => 7.0 * modes[(i, 2)],
        _ if j < COUNT + 7 => rigid[(i, j - COUNT - 1)],
        _ => modes[(i, 0)] - modes[(i, 1)],
    });
    for digits in [17, 7] {
        let found = modes_of(&model, imported(&model, &shapes, digits), Accuracy::Standard).expect("modes");
        assert_eq!(found.solution.eigenvalues.len(), COUNT);
        assert_eq!(found.provenance, vec!["imported shape"; COUNT]);
        let said: Vec<(Code, &str)> = found.diagnostics.iter().map(|d| (d.code(), d.message())).collect();
        let [(Code::ShapesRigid, rigid), (Code::ShapesDependent, dependent)] = said[..] else {
            panic!("{said:?}")
        };
        assert!(rigid.starts_with("6 of 20") && rigid.contains("shape 14"), "{rigid}");
        assert!(dependent.starts_with("2 of 20"), "{dependent}");
        assert!(dependent.contains("shape 13 (") && dependent.contains("shape 20 ("), "{dependent}");
    }
}

#[test]
fn a_mode_that_is_missing_is_counted() {
    let model = bracket();
    let modes = free(&model);
    let without = Mat::from_fn(modes.nrows(), COUNT - 1, |i, j| modes[(i, if j < 3 { j } else { j + 1 })]);
    let shapes = || imported(&model, &without, 17);
    let found = modes_of(&model, shapes(), Accuracy::Standard).expect("modes");
    assert_eq!(found.solution.completeness.proof, Proof::NotProved);
    let [diagnostic] = found.diagnostics.as_slice() else { panic!("{:?}", found.diagnostics) };
    assert_eq!(diagnostic.code(), Code::CompletenessUnproved);
    let message = diagnostic.message();
    assert!(message.contains("12 flexible modes") && message.ends_with("subspace has 11"), "{message}");
    assert!(modes_of(&model, shapes(), Accuracy::Certified).is_err(), "certified is a promise");
}

#[test]
fn shapes_that_are_no_eigenvectors_keep_every_identity() {
    let model = bracket();
    let modes = free(&model);
    let mut r = Random(5);
    // Five modes and four fields of random displacements.
    let fields = random(modes.nrows(), 4, &mut r);
    let shapes =
        Mat::from_fn(modes.nrows(), 9, |i, j| if j < 5 { modes[(i, j)] } else { fields[(i, j - 5)] });
    let done = converted(&model, BasisChoice::Imported(imported(&model, &shapes, 17)), Accuracy::Standard);
    assert_eq!(codes(&done), [Code::ShapesSpan]);
    assert!(done.diagnostics[0].message().starts_with("4 of 9 modes"));
    // The eigenvectors among them are still proved complete, and the report claims no more.
    let certificate = done.body.certificate();
    assert_eq!((certificate.proved_modes, certificate.negative_pivots), (Some(5), Some(11)));
    let invariants = done.body.invariants();
    assert!(invariants.c1().norm_max() < 3e-14 * invariants.mass().sqrt());
    let trace =
        &invariants.s().unwrap()[0][0] + &invariants.s().unwrap()[1][1] + &invariants.s().unwrap()[2][2];
    let identity = Mat::<f64>::identity(9, 9);
    assert!((trace - identity).norm_max() < 3e-14);
    let lambda = &done.body.modes().eigenvalue;
    let diagonal = Mat::from_fn(9, 9, |i, j| if i == j { lambda[i] } else { 0.0 });
    assert!((invariants.modal_stiffness() - diagonal).norm_max() < 1e-12 * lambda[8]);
}

#[test]
fn shapes_that_do_not_fit_are_refused() {
    let model = bracket();
    let n = model.stiffness().n();
    let refused = |matrix: Mat<f64>| {
        ImportedShapes::new(&model, RawShapes { matrix, digits: 17, path: PathBuf::new(), source: None })
            .expect_err("not usable")
    };
    assert!(refused(Mat::zeros(n - 3, 2)).has(Code::ShapesSize));
    assert!(refused(Mat::zeros(n, 0)).has(Code::ShapesSize));
    let both = refused(Mat::from_fn(n, 3, |i, j| [1.0, 0.0, if i == 4 { f64::NAN } else { 1.0 }][j]));
    assert!(both.has(Code::ShapesZero) && both.has(Code::MatrixNotFinite));
    assert!(both.to_string().contains("shape 3 has NaN in row 5"), "{both}");
    let rigid = rigid_fields(&model.nodes().positions, 3, [0.0; 3], 1.0);
    let none = modes_of(&model, imported(&model, &rigid, 17), Accuracy::Standard).expect_err("nothing left");
    assert!(none.has(Code::ShapesNone) && none.has(Code::ShapesRigid));
}

/// Returns a fixture model and eigenvectors computed by scipy, saved by numpy.
fn bar() -> (FeModel, PathBuf) {
    let folder = oracle::fixtures().join("models/bar_c3d8r");
    let files = read_manifest(folder.join("model.toml")).expect("manifest");
    let model = FeModel::from_raw(read_model(&files).expect("files")).expect("model").model;
    (model, folder.join("scipy_modes.npy"))
}

#[test]
fn eigenvectors_of_scipy_give_the_same_invariants() {
    let (model, path) = bar();
    let raw = read_shapes(&MatrixLocation { path, group: None }, &[model.stiffness().n()], "shapes")
        .expect("shapes");
    let shapes = ImportedShapes::new(&model, raw).expect("fits");
    let done = converted(&model, BasisChoice::Imported(shapes), Accuracy::Standard);
    let free_body = converted(&model, BasisChoice::default(), Accuracy::Standard).body;
    let strict = Tolerances { invariants: 1e-9, ..Tolerances::default() };
    let comparison = compare(&free_body, &done.body, &strict).expect("comparable");
    assert!(comparison.passed(), "{comparison:#?}");
    assert_eq!(done.body.certificate().proved_modes, Some(COUNT));
    // The file of scipy includes the six rigid modes, and is listed among the sources.
    assert_eq!(codes(&done), [Code::ShapesRigid]);
    assert_eq!(done.body.source().files.last().map(|file| file.role.as_str()), Some("shapes"));
}

#[test]
fn every_kind_of_file_gives_the_same_shapes() {
    let folder = tempfile::tempdir().expect("folder");
    let (n, k) = (30, 4);
    let value = |i: usize, j: usize| ((i * 7 + j * 3) as f64).sin();
    let upright: Vec<f64> = (0..n * k).map(|at| value(at / k, at % k)).collect();
    let lying: Vec<f64> = (0..n * k).map(|at| value(at % n, at / n)).collect();
    let place = |name: &str| folder.path().join(name);
    let h5 = File::create(place("s.h5")).expect("file");
    h5.create_group("results").expect("group");
    let put = |file: &hdf5_metno::Group, name: &str, shape: [usize; 2], values: &[f64]| {
        file.new_dataset::<f64>()
            .shape(shape)
            .create(name)
            .expect("dataset")
            .write_raw(values)
            .expect("values");
    };
    put(&h5, "results/modes", [n, k], &upright);
    h5.new_dataset_builder().with_data(&[1.0, 2.0]).create("times").expect("dataset");
    h5.close().expect("closed");
    let h5 = File::create(place("two.h5")).expect("file");
    let single: Vec<f32> = upright.iter().map(|&v| v as f32).collect();
    let dataset = h5.new_dataset::<f32>().shape([n, k]).create("single").expect("dataset");
    dataset.write_raw(&single).expect("values");
    put(&h5, "double", [k, n], &lying);
    drop(dataset);
    h5.close().expect("closed");
    let mut text = format!("%%MatrixMarket matrix array real general\n% a comment\n{n} {k}\n");
    lying.iter().for_each(|v| text += &format!("{v:e}\n"));
    std::fs::write(place("s.mtx"), &text).expect("file");
    std::fs::write(
        place("s.mtx.zst"),
        ruzstd::encoding::compress_to_vec(text.as_bytes(), ruzstd::encoding::CompressionLevel::Fastest),
    )
    .expect("file");
    for (order, values) in [("False", &upright), ("True", &lying)] {
        let header = format!("{{'descr': '<f8', 'fortran_order': {order}, 'shape': ({n}, {k}), }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        std::fs::write(place(&format!("{order}.npy")), bytes).expect("file");
    }
    let expected = Mat::from_fn(n, k, value);
    let read = |name: &str| read_shapes(&MatrixLocation::parse(place(name)), &[n], "shapes");
    for name in
        ["s.h5", "s.h5:/results/modes", "two.h5:/double", "s.mtx", "s.mtx.zst", "False.npy", "True.npy"]
    {
        let shapes = read(name).expect(name);
        assert_eq!(shapes.matrix, expected, "{name}");
        assert!(shapes.digits >= 16, "{name}");
    }
    let single = read("two.h5:/single").expect("single");
    assert_eq!((single.matrix[(3, 2)], single.digits), (f64::from(value(3, 2) as f32), 7));
    for (name, code) in [
        ("two.h5", Code::Hdf5Layout),
        ("two.h5:/other", Code::Hdf5Layout),
        ("two.h5:/a/b", Code::Hdf5Layout),
        ("s.h5:/results", Code::Hdf5Layout),
        ("s.mtx:/results", Code::Hdf5Layout),
        ("none.npy", Code::FileUnreadable),
    ] {
        assert!(read(name).expect_err(name).has(code), "{name}");
    }
    assert!(
        read_shapes(&MatrixLocation::parse(place("s.mtx")), &[31], "shapes")
            .expect_err("size")
            .has(Code::ShapesSize)
    );
}
