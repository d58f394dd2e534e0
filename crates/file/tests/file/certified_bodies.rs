//! Finite element bodies: exact counts around every bound, from the model through the file to `check`.

use flexbody_base::diagnostic::Code;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::verify;
use flexbody_eigen::{Accuracy, Method, Wanted};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, SymmetricMatrix};
use flexbody_model::{FeModel, RawModel, check};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::exact::count_below;
use oracle::mesh::{Mesh, entries};

fn settings(accuracy: Accuracy, count: usize, frame: BodyFrame) -> ConvertSettings {
    let modes = ModeSettings {
        wanted: Wanted::Lowest(count),
        accuracy,
        method: Method::Auto,
        ..ModeSettings::default()
    };
    ConvertSettings { modes, frame: frame.into(), ..ConvertSettings::default() }
}

fn model(kind: ElementKind, cells: [i32; 3], rule: MassRule) -> FeModel {
    let mesh = Mesh::block(kind, cells, [0.4, 0.15, 0.1]);
    check(mesh.assemble(&Material::STEEL, rule).raw_model()).expect("a sound body").model
}

/// Returns A (kron I_block) as rows.
fn dense(a: &SymmetricMatrix, block: usize) -> Vec<Vec<f64>> {
    let n = a.n() * block;
    let entry =
        |i: usize, j: usize| if i % block == j % block { a.as_csc().get(i / block, j / block) } else { 0.0 };
    (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
}

#[test]
#[ignore = "slow"]
fn eigenvalues_of_a_cuboid_of_tetrahedra_lie_between_their_bounds() {
    let model = model(ElementKind::Tet4, [1, 1, 1], MassRule::Consistent);
    let conversion =
        convert(&model, &settings(Accuracy::Certified, 18, BodyFrame::Principal), &Context::QUIET)
            .expect("sound");
    let guarantee = conversion.body.certificate().guarantee.as_ref().expect("certified");
    let (k, m) = (dense(model.stiffness(), 1), dense(model.scalar_mass().expect("a solid"), 3));
    assert_eq!(count_below(&k, &m, guarantee.shift_below), 6);
    for j in [0, 1, 8, 17] {
        let (lower, upper) = (guarantee.eigenvalue_lower[j], guarantee.eigenvalue_upper[j]);
        assert!(count_below(&k, &m, lower.next_down()) <= 6 + j, "mode {j}");
        assert!(count_below(&k, &m, upper.next_up()) > 6 + j, "mode {j}");
        assert!((upper - lower) / lower < 1e-14, "mode {j}: {:e}", (upper - lower) / lower);
    }
}

#[test]
fn certified_bodies_keep_their_guarantees_through_file_and_check() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    // Includes singular masses and rotated frames.
    for (kind, rule, frame) in [
        (ElementKind::Hex8, MassRule::Consistent, BodyFrame::Principal),
        (ElementKind::Tet10, MassRule::Reduced, BodyFrame::Model),
    ] {
        let model = model(kind, [3, 2, 1], rule);
        let conversion =
            convert(&model, &settings(Accuracy::Certified, 10, frame), &Context::QUIET).expect("sound");
        flexbody_file::write(&conversion.body, &path).expect("written");
        let body = flexbody_file::read(&path).expect("read");
        let guarantee = body.certificate().guarantee.as_ref().expect("certified");
        assert_eq!(Some(guarantee), conversion.body.certificate().guarantee.as_ref());
        for (j, lambda) in body.modes().eigenvalue.iter().enumerate() {
            let width = (guarantee.eigenvalue_upper[j] - guarantee.eigenvalue_lower[j]) / lambda;
            assert!(width < 1e-13, "{kind:?}, mode {j}: {width:e}");
            assert!(guarantee.shape_error[j] < 1e-9, "{kind:?}, mode {j}: {:e}", guarantee.shape_error[j]);
        }
        assert!(guarantee.digits.iter().all(|d| *d > 15.0), "{kind:?}: {:?}", guarantee.digits);
        let checks = verify(&body, &model).expect("the same nodes");
        for name in ["digits_recomputed", "bounds_recomputed"] {
            let check = checks.iter().find(|c| c.name == name).expect("a certified body");
            assert!(check.passed, "{kind:?}: {check:?}");
        }
    }
}

#[test]
fn check_finds_invariants_and_bounds_that_do_not_keep_their_guarantees() {
    let model = model(ElementKind::Hex8, [2, 1, 1], MassRule::Consistent);
    let conversion =
        convert(&model, &settings(Accuracy::Certified, 6, BodyFrame::Principal), &Context::QUIET)
            .expect("sound");
    let failed = |change: &dyn Fn(&mut flexbody_body::flex_body::Parts)| -> Vec<&'static str> {
        let mut parts = conversion.body.clone().into_parts();
        change(&mut parts);
        let body = flexbody_body::flex_body::FlexBody::new(parts).expect("consistent in itself");
        let checks = verify(&body, &model).expect("the same nodes");
        checks.iter().filter(|c| !c.passed).map(|c| c.name).collect()
    };
    assert!(failed(&|_| {}).is_empty());
    assert_eq!(
        failed(
            &|parts| parts.invariants.primary_mut().ibar[0][1][2] += 1e-14 * parts.invariants.mass().sqrt()
        ),
        ["digits_recomputed"]
    );
    let moved = failed(&|parts| {
        let guarantee = parts.certificate.guarantee.as_mut().expect("certified");
        for column in
            [&mut parts.modes.eigenvalue, &mut guarantee.eigenvalue_lower, &mut guarantee.eigenvalue_upper]
        {
            column.iter_mut().for_each(|v| *v *= 1.0 + 1e-8);
        }
    });
    assert_eq!(moved, ["residual_recomputed", "bounds_recomputed"]);
}

#[test]
fn guarantees_do_not_depend_on_the_number_of_threads() {
    // The model has more rows than one task takes.
    let model = model(ElementKind::Hex8, [10, 6, 4], MassRule::Consistent);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let settings = settings(Accuracy::Certified, 12, BodyFrame::Principal);
        pool.install(|| convert(&model, &settings, &Context::QUIET)).expect("sound").body
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn other_levels_store_no_guarantees() {
    let model = model(ElementKind::Hex8, [2, 1, 1], MassRule::Consistent);
    let conversion = convert(&model, &settings(Accuracy::Standard, 6, BodyFrame::Principal), &Context::QUIET)
        .expect("sound");
    assert_eq!(conversion.body.certificate().guarantee, None);
}

/// Returns a model whose mass is equal along all axes, with entries (row, column, value) changed by `change`.
fn with_mass(change: impl Fn(u32, u32, f64) -> f64) -> RawModel {
    let mesh = Mesh::block(ElementKind::Hex8, [2, 2, 1], [0.4, 0.15, 0.1]);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let changed: Vec<_> = entries(&raw.mass.matrix).map(|(i, j, v)| (i, j, change(i, j, v))).collect();
    let n = raw.mass.matrix.n_rows();
    raw.mass.matrix = CscMatrix::from_triplets(n, n, &changed);
    raw
}

/// Three equal entries are their own mean, but a third of their rounded sum may be another number.
#[test]
fn a_mass_that_is_the_same_along_all_axes_is_bounded_as_stored() {
    // A third of three times a number differs from it for a quarter of all mantissas above 4/3.
    let is_rounded = |v: f64| (v + v + v) / 3.0 != v;
    let scaled = |k: u32| with_mass(move |_, _, v| v * (1.0 + 0.07 * f64::from(k)));
    let some_are = |raw: &RawModel| entries(&raw.mass.matrix).any(|(_, _, v)| is_rounded(v));
    let raw = (0..20).map(scaled).find(some_are).expect("mantissas of all kinds");
    let stored: Vec<(u32, u32, f64)> = entries(&raw.mass.matrix).collect();
    let model = check(raw).expect("a sound body").model;
    assert!(model.has_exact_scalar_mass());
    let scalar = model.scalar_mass().expect("a solid").as_csc();
    for (i, j, v) in stored {
        assert_eq!(scalar.get(i as usize / 3, j as usize / 3), v, "({i}, {j})");
    }
}

/// Bounds for the mean of the directions would belong to another model.
#[test]
fn a_mass_that_differs_along_an_axis_by_rounding_is_not_certified() {
    let certified = settings(Accuracy::Certified, 6, BodyFrame::Principal);
    let sound = check(with_mass(|_, _, v| v)).expect("a sound body").model;
    let body = convert(&sound, &certified, &Context::QUIET).expect("certified").body;
    let failed = |model: &FeModel| -> Vec<&'static str> {
        let checks = verify(&body, model).expect("the same nodes");
        checks.iter().filter(|c| !c.passed).map(|c| c.name).collect()
    };
    assert!(failed(&sound).is_empty());
    let (one_ulp, coupled) = (|v: f64| v.next_up(), 1e-15);
    let along_z = with_mass(|i, j, v| if i % 3 == 2 && j % 3 == 2 { one_ulp(v) } else { v });
    let one_entry = with_mass(|i, j, v| if (i, j) == (4, 4) { one_ulp(v) } else { v });
    let mut across = with_mass(|_, _, v| v);
    let size = across.mass.matrix.get(0, 0) * coupled;
    let more: Vec<_> = entries(&across.mass.matrix).chain([(0, 1, size), (1, 0, size)]).collect();
    let n = across.mass.matrix.n_rows();
    across.mass.matrix = CscMatrix::from_triplets(n, n, &more);
    for raw in [along_z, one_entry, across] {
        let model = check(raw).expect("a sound body").model;
        assert!(model.scalar_mass().is_some() && !model.has_exact_scalar_mass());
        let error = convert(&model, &certified, &Context::QUIET).expect_err("another mass matrix");
        assert_eq!(error.diagnostics()[0].code(), Code::Usage);
        assert!(error.to_string().contains("differs along x, y and z"), "{error}");
        let standard = settings(Accuracy::Standard, 6, BodyFrame::Principal);
        convert(&model, &standard, &Context::QUIET).expect("standard takes the mean");
        assert_eq!(failed(&model), ["certified_mass"]);
    }
}
