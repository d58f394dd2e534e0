//! Extreme bodies: accuracy that remains, and their errors. `evidence/programs/make_stability.py` compares such cases with
//! high precision and writes `evidence/pages/stability.md`.

use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::invariants::{BodyFrame, Frame, RigidMotion, compare_invariants, condense_general};
use flexbody_body::verification::verify;
use flexbody_eigen::{Method, Wanted};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, SymmetricMatrix, gram};
use flexbody_model::{FeModel, RawModel, check};
use nalgebra::{Matrix3, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::mesh::{Assembly, Mesh, entries};
use oracle::random::Random;

/// Material with unit Young's modulus and density, which powers of two scale without rounding.
const UNIT: Material = Material { youngs: 1.0, poisson: 0.25, density: 1.0 };

/// Returns a block of 0.75 x 0.5 x 0.25 with distinct frequencies; coordinates, K and M have few binary
/// digits.
fn bar() -> Mesh {
    Mesh::block(ElementKind::Hex8, [3, 2, 1], [0.75, 0.5, 0.25])
}

/// Returns a mesh of `inner` material for elements whose first node has x between `from` and `to`, and of
/// `outer` material elsewhere.
fn layered(mesh: &Mesh, (from, to): (f64, f64), inner: Material, outer: Material) -> Assembly {
    let inside = |x: [f64; 3]| (from..to).contains(&x[0]);
    let part =
        |kept: &dyn Fn([f64; 3]) -> bool, of: &Material| mesh.part(kept).assemble(of, MassRule::Consistent);
    part(&inside, &inner).plus(&part(&|x| !inside(x), &outer))
}

fn try_convert(raw: RawModel, modes: usize, method: Method) -> Result<(FeModel, Conversion)> {
    let checked = check(raw)?;
    let mut settings = ConvertSettings { lumped: Vec::new(), ..ConvertSettings::default() };
    (settings.modes.wanted, settings.modes.method) = (Wanted::Lowest(modes), method);
    let mut done = convert(&checked.model, &settings, &Context::QUIET)?;
    done.diagnostics.splice(0..0, checked.diagnostics);
    Ok((checked.model, done))
}

/// Returns a body after asserting its own identities and those against its model.
fn converted(raw: RawModel, modes: usize, method: Method) -> Conversion {
    let (model, done) = try_convert(raw, modes, method).expect("a body");
    let body = &done.body;
    let own = body.identities(BodyFrame::Com);
    for check in own.into_iter().chain(verify(body, &model).expect("the same model")) {
        assert!(check.passed, "{}: {:e} > {:e}", check.name, check.value, check.limit);
    }
    done
}

fn codes(diagnostics: &[Diagnostic]) -> Vec<Code> {
    diagnostics.iter().map(Diagnostic::code).collect()
}

fn refusal(raw: RawModel, modes: usize) -> Vec<Code> {
    match try_convert(raw, modes, Method::Auto) {
        Ok(_) => Vec::new(),
        Err(error) => codes(error.diagnostics()),
    }
}

/// Returns the model with K 2^k, M 2^m, x 2^x.
fn scaled(raw: &RawModel, [k, m, x]: [i32; 3]) -> RawModel {
    let by = |exponent: i32| f64::from(exponent).exp2();
    let times = |matrix: &CscMatrix, factor: f64| {
        let all: Vec<_> = entries(matrix).map(|(i, j, v)| (i, j, v * factor)).collect();
        CscMatrix::from_triplets(matrix.n_rows(), matrix.n_cols(), &all)
    };
    let mut raw = raw.clone();
    raw.stiffness.matrix = times(&raw.stiffness.matrix, by(k));
    raw.mass.matrix = times(&raw.mass.matrix, by(m));
    raw.nodes.positions.iter_mut().flatten().for_each(|v| *v *= by(x));
    raw
}

#[test]
fn powers_of_two_in_the_units_change_exponents_and_no_digit() {
    let raw = bar().assemble(&UNIT, MassRule::Consistent).raw_model();
    // Exponents are even, because modes scale with the root of the mass and shifts with that of an
    // eigenvalue.
    let scales = [
        [0, 0, -20],
        [0, 30, 10],
        [400, 0, 0],
        [-400, 0, 0],
        [0, 400, 0],
        [0, -400, 0],
        [0, 0, 220],
        [0, 0, -220],
        [440, 440, 0],
        [-440, -440, 0],
        [440, 440, -300],
        [-440, -440, 300],
        [0, 440, -440],
        [0, -440, 440],
    ];
    for method in [Method::Dense, Method::Lanczos] {
        let base = converted(raw.clone(), 8, method).body;
        for scale in scales {
            let own = converted(scaled(&raw, scale), 8, method).body;
            let [k, m, x] = scale.map(f64::from);
            let same = |what: &str, a: &[f64], b: &[f64], exponent: f64| {
                let expected: Vec<f64> = b.iter().map(|b| b * exponent.exp2()).collect();
                assert_eq!(a, expected, "{method:?} {scale:?} {what}");
            };
            let (a, b) = (own.invariants(), base.invariants());
            let column = |matrix: Mat<f64>| -> Vec<f64> {
                (0..matrix.ncols()).flat_map(|j| matrix.col_as_slice(j).to_vec()).collect()
            };
            same("lambda", &own.modes().eigenvalue, &base.modes().eigenvalue, k - m);
            same("m", &[a.mass()], &[b.mass()], m);
            same("I0", a.inertia().as_slice(), b.inertia().as_slice(), m + 2.0 * x);
            same("W1", &column(a.w1().expect("held")), &column(b.w1().expect("held")), 0.5 * m + x);
            same("W2", &column(a.w2().expect("held")), &column(b.w2().expect("held")), 0.0);
            same("W3", &column(a.w3().expect("held")), &column(b.w3().expect("held")), 0.0);
            same("K_ff", &column(a.modal_stiffness().clone()), &column(b.modal_stiffness().clone()), k - m);
        }
    }
}

#[test]
fn numbers_whose_products_leave_double_precision_are_refused_by_name() {
    let raw = bar().assemble(&UNIT, MassRule::Consistent).raw_model();
    let far = [
        [500, 0, 0],
        [-500, 0, 0],
        [0, 500, 0],
        [0, -500, 0],
        [0, 0, 500],
        [0, 0, -500],
        [500, 500, 0],
        [-500, -500, 0],
        [300, -300, 0],
        [-300, 300, 0],
        [0, 300, 200],
        [0, -300, -200],
        [0, 0, 1000],
        [-1000, -1000, 0],
    ];
    for scale in far {
        assert_eq!(refusal(scaled(&raw, scale), 8), [Code::MagnitudeExtreme], "{scale:?}");
    }
}

#[test]
fn body_a_billion_lengths_away_is_the_same_as_far_as_its_coordinates_are() {
    let near_and_far = |mesh: &Mesh, by: [f64; 3]| {
        let near = mesh.assemble(&UNIT, MassRule::Consistent).raw_model();
        let mut far = near.clone();
        far.nodes.positions.iter_mut().for_each(|x| (0..3).for_each(|k| x[k] += by[k]));
        let [a, b] = [near, far].map(|raw| converted(raw, 8, Method::Auto));
        let cross = gram(a.body.modes().shape.as_ref(), b.body.modes().shape.as_ref());
        let differences = compare_invariants(a.body.invariants(), b.body.invariants(), cross.as_ref(), &[]).1;
        (differences, codes(&b.diagnostics).contains(&Code::NodesRounded))
    };
    // Coordinates are multiples of 1/4: exact up to 2^50.
    let (differences, told) = near_and_far(&bar(), [2f64.powi(30), -(2f64.powi(29)), 2f64.powi(28)]);
    for (what, error) in differences {
        assert!(error < 1e-13, "{what}: {error:e}");
    }
    assert!(!told);
    // Coordinates for which the spacing of numbers leaves seven digits.
    let oblong = Mesh::block(ElementKind::Hex8, [3, 2, 1], [0.7, 0.47, 0.26]);
    let (differences, told) = near_and_far(&oblong, [1e9 / 3.0, 1e9, -1e9 / 7.0]);
    let lost = differences.iter().find(|(name, _)| name == "second_moment").expect("J").1;
    assert!(told && (1e-10..1e-6).contains(&lost), "{lost:e}");
}

#[test]
fn inertia_of_needles_and_foils_keeps_all_digits() {
    let mut random = Random(7);
    for size in [[1e5, 1.0, 1.0], [1e3, 1.0, 0.5], [1e3, 1e3, 1.0], [1.0, 1.0, 1.0]] {
        // Along the axes of the model the coordinates have all digits of the small sides.
        let raw =
            Mesh::block(ElementKind::Hex8, [2, 2, 2], size).assemble(&UNIT, MassRule::Consistent).raw_model();
        let body = converted(raw, 4, Method::Auto).body;
        let mass = size[0] * size[1] * size[2];
        let mut expected: Vec<f64> =
            [(1, 2), (2, 0), (0, 1)].map(|(k, l)| mass * (size[k].powi(2) + size[l].powi(2)) / 12.0).into();
        expected.sort_by(f64::total_cmp);
        for (k, expected) in expected.into_iter().enumerate() {
            let found = body.invariants().inertia()[(k, k)];
            assert!((found / expected - 1.0).abs() < 1e-14, "{size:?} {k}: {found}, expected {expected}");
        }
    }
    // Masses with rotary inertia on an oblique line: the moment about the line is that of their rotations
    // alone.
    let direction = Vector3::new(random.signed(), random.signed(), random.signed()).normalize();
    let (count, rotary) = (5, 1e-10);
    let entries: Vec<(u32, u32, f64)> = (0..6 * count)
        .map(|row| (row as u32, row as u32, if row < 3 * count { 1.0 } else { rotary }))
        .collect();
    let mass =
        SymmetricMatrix::new(CscMatrix::from_triplets(6 * count, 6 * count, &entries)).expect("diagonal");
    let normal = direction.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[direction, normal, direction.cross(&normal)]);
    let mut fields = Mat::zeros(6 * count, 6);
    for node in 0..count {
        let x = direction * (node as f64 - 2.0);
        for k in 0..3 {
            let turned = Vector3::ith(k, 1.0).cross(&x);
            fields[(3 * node + k, k)] = 1.0;
            fields[(3 * count + 3 * node + k, 3 + k)] = 1.0;
            (0..3).for_each(|l| fields[(3 * node + l, 3 + k)] = turned[l]);
        }
    }
    Frame { origin: Vector3::zeros(), axes }.rotate_rigid(&mut fields);
    let motion = RigidMotion { fields: fields.as_ref(), displacements: 3 * count, axes };
    let none = Mat::zeros(6 * count, 0);
    let inertia = condense_general(&mass, &motion, none.as_ref(), Mat::zeros(0, 0)).inertia();
    let expected = rotary * count as f64;
    assert!(
        (inertia[(0, 0)] / expected - 1.0).abs() < 1e-13,
        "{} about the line, expected {expected}",
        inertia[(0, 0)]
    );
}

/// A slender or thin body is accurate up to its rounding and reports it, or is refused with the reason.
#[test]
fn thin_bodies_lose_digits_and_say_so_or_are_refused() {
    let plate = |ratio: f64| {
        let size = [ratio, 0.8 * ratio, 1.0];
        Mesh::block(ElementKind::Hex8, [2, 2, 1], size).assemble(&UNIT, MassRule::Consistent).raw_model()
    };
    assert!(!codes(&converted(plate(10.0), 6, Method::Auto).diagnostics).contains(&Code::NoiseFloor));
    assert!(codes(&converted(plate(1e3), 6, Method::Auto).diagnostics).contains(&Code::NoiseFloor));
    for ratio in [1e4, 1e5] {
        let found = refusal(plate(ratio), 6);
        assert!(matches!(found[..], [Code::Mechanism | Code::RigidMotionStrained]), "{ratio:e}: {found:?}");
    }
}

#[test]
fn density_contrast_of_a_trillion_costs_no_digit() {
    for contrast in [1e-6, 1e6, 1e12] {
        let heavy = Material { density: contrast, ..UNIT };
        let raw = layered(&bar(), (0.25, 0.5), heavy, UNIT).raw_model();
        let [a, b] = [Method::Dense, Method::Lanczos].map(|method| converted(raw.clone(), 8, method).body);
        for (x, y) in a.modes().eigenvalue.iter().zip(&b.modes().eigenvalue) {
            assert!((x / y - 1.0).abs() < 1e-13, "{contrast:e}: lambda {x} and {y}");
        }
        let cross = gram(a.modes().shape.as_ref(), b.modes().shape.as_ref());
        for (what, error) in compare_invariants(a.invariants(), b.invariants(), cross.as_ref(), &[]).1 {
            assert!(error < 2e-11, "{contrast:e} {what}: {error:e}");
        }
    }
}

#[test]
fn stiffness_contrast_is_told_and_never_makes_a_body_that_fails_its_own_checks() {
    for (soft, told) in [(1e-3, false), (1e-6, false), (1e-12, true)] {
        let middle = Material { youngs: soft, ..UNIT };
        let raw = layered(&bar(), (0.25, 0.5), middle, UNIT).raw_model();
        for method in [Method::Dense, Method::Lanczos] {
            let found = codes(&converted(raw.clone(), 8, method).diagnostics);
            assert_eq!(found.contains(&Code::NoiseFloor), told, "{soft:e} {method:?}");
        }
    }
    let middle = Material { youngs: 1e-16, ..UNIT };
    assert_eq!(refusal(layered(&bar(), (0.25, 0.5), middle, UNIT).raw_model(), 8), [Code::Mechanism]);
}

#[test]
fn every_mode_of_one_element_and_of_a_block_together_is_the_whole_body() {
    for cells in [[1, 1, 1], [2, 1, 1], [2, 2, 1]] {
        let mesh = Mesh::block(ElementKind::Hex8, cells, [0.75, 0.5, 0.375]);
        let raw = mesh.assemble(&UNIT, MassRule::Consistent).raw_model();
        let flexible = raw.stiffness.matrix.n_cols() - 6;
        let done = converted(raw, flexible, Method::Auto);
        // A density of one is implausible for any material.
        assert_eq!(codes(&done.diagnostics), [Code::InertiaImplausible]);
        let body = done.body;
        assert_eq!((body.n_modes(), body.certificate().proved_modes), (flexible, Some(flexible)));
        let invariants = body.invariants();
        // Parseval: the stretch x_k e_k along an axis has no rigid part about the centre of mass.
        for k in 0..3 {
            let sum: f64 = invariants.ibar().unwrap()[k][k].iter().map(|v| v * v).sum();
            let whole = invariants.second_moment()[(k, k)];
            assert!((sum / whole - 1.0).abs() < 1e-13, "{cells:?} axis {k}: {sum}, expected {whole}");
        }
    }
}

#[test]
fn hinges_are_refused_whether_free_or_of_a_stiffness_that_rounding_hides() {
    let free = Mesh::hinge(ElementKind::Hex8, 2).assemble(&UNIT, MassRule::Consistent).raw_model();
    assert_eq!(refusal(free.clone(), 6), [Code::Mechanism]);
    // A spring between the two blocks, beside the hinge at x = y = 2.
    let x = &free.nodes.positions;
    let node = |at: [f64; 3]| x.iter().position(|x| *x == at).expect("a node");
    let (a, b) = (node([2.0, 0.0, 0.0]), node([4.0, 2.0, 0.0]));
    let along = (Vector3::from(x[b]) - Vector3::from(x[a])).normalize();
    let sprung = |stiffness: f64| {
        let mut raw = free.clone();
        let mut all: Vec<_> = entries(&raw.stiffness.matrix).collect();
        for (i, j, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
            for k in 0..3 {
                for l in 0..3 {
                    all.push((
                        (3 * i + k) as u32,
                        (3 * j + l) as u32,
                        sign * stiffness * along[k] * along[l],
                    ));
                }
            }
        }
        raw.stiffness.matrix = CscMatrix::from_triplets(3 * x.len(), 3 * x.len(), &all);
        raw
    };
    assert!(converted(sprung(1e-3), 6, Method::Auto).body.modes().eigenvalue[0] > 0.0);
    for stiffness in [1e-16, 1e-18] {
        assert_eq!(refusal(sprung(stiffness), 6), [Code::Mechanism], "{stiffness:e}");
    }
}

/// The change of the first eigenvalue by rounding of the matrices to their digits is reported if it exceeds
/// 1e-6.
#[test]
fn digits_of_files_are_told_when_they_are_gone_and_only_then() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = |size| {
        Mesh::block(ElementKind::Hex8, [3, 1, 1], size).assemble(&Material::STEEL, MassRule::Consistent)
    };
    for (size, thin) in [([1.0, 0.21, 0.3], false), ([100.0, 1.1, 0.9], true)] {
        let raw = mesh(size).raw_model();
        let exact = converted(raw.clone(), 6, Method::Auto).body.modes().eigenvalue[0];
        for digits in 8..=17usize {
            let mut cut = raw.clone();
            for matrix in [&mut cut.stiffness.matrix, &mut cut.mass.matrix] {
                let round = |v: f64| format!("{v:.*e}", digits - 1).parse::<f64>().expect("a number");
                let all: Vec<_> = entries(matrix).map(|(i, j, v)| (i, j, round(v))).collect();
                *matrix = CscMatrix::from_triplets(matrix.n_rows(), matrix.n_cols(), &all);
            }
            let path = write_model(folder.path(), &cut, Triangle::Lower);
            let read = read_model(&read_manifest(&path).expect("a manifest")).expect("readable");
            let (_, done) = try_convert(read, 6, Method::Auto).expect("a body");
            let found = codes(&done.diagnostics);
            let change = (done.body.modes().eigenvalue[0] / exact - 1.0).abs();
            assert_eq!(found.contains(&Code::MatrixDigits), digits < 10, "{digits} digits of {size:?}");
            let told = found.contains(&Code::NoiseFloor);
            assert!(told || change < 3e-6, "{digits} digits of {size:?}: {change:e} not told");
            assert!(!told || (thin && digits <= 11), "{digits} digits of {size:?}: {change:e} told");
        }
    }
}
