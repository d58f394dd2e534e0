//! Recoveries held to the model: rows under constant loads in any basis and frame.

use crate::recovery::{body, bracket, mesh};
use faer::{Mat, Scale};
use flexbody_body::basis::{BasisChoice, CraigBampton, FreeSurface, Loads};
use flexbody_body::flex_body::{FlexBody, Parts};
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::verify;
use flexbody_model::{Coupling, FeModel, ModelLoad};

/// Rows under constant unit loads belong to the model: they are the same for any modes, basis and frame.
#[test]
fn static_rows_depend_neither_on_the_modes_nor_on_the_frame() {
    let made = |basis: BasisChoice, modes: usize, frame: BodyFrame| {
        body(bracket(&mesh(), Coupling::Averaging), basis, modes, frame)
    };
    let free = || BasisChoice::Free(FreeSurface { residual_vectors: Vec::new() });
    let whole = made(free(), 8, BodyFrame::Com);
    let expected = whole.static_rows(&whole.recoveries()[0]);
    let size = |of: &Mat<f64>| of.norm_max();
    for (basis, modes, frame) in [
        (free(), 3, BodyFrame::Principal),
        (free(), 8, BodyFrame::Model),
        (
            BasisChoice::Free(FreeSurface { residual_vectors: vec![Loads::Centrifugal] }),
            4,
            BodyFrame::Principal,
        ),
    ] {
        let other = made(basis, modes, frame);
        let found = other.static_rows(&other.recoveries()[0]);
        assert!((&found.spin - &expected.spin).norm_max() < 1e-8 * size(&expected.spin), "{modes} {frame:?}");
        for (own, known) in found.loads.iter().zip(&expected.loads) {
            assert!(
                (&own.columns - &known.columns).norm_max() < 1e-8 * size(&known.columns),
                "{modes} {frame:?}"
            );
        }
    }
    // Also without some of the fixed-interface modes of a Craig-Bampton basis.
    let coupled = made(BasisChoice::CraigBampton(CraigBampton), 6, BodyFrame::Com);
    for kept in [vec![0, 1, 4], Vec::new()] {
        let fewer = coupled.with_fixed_interface_modes(&kept).expect("a body");
        let found = fewer.static_rows(&fewer.recoveries()[0]);
        assert!((&found.spin - &expected.spin).norm_max() < 1e-8 * size(&expected.spin), "{kept:?}");
        for (own, known) in found.loads.iter().zip(&expected.loads) {
            assert!((&own.columns - &known.columns).norm_max() < 1e-8 * size(&known.columns), "{kept:?}");
        }
    }
    // With fewer modes the columns hold more.
    let part = |modes: usize| {
        let body = made(free(), modes, BodyFrame::Com);
        body.part_of_static_columns(&body.recoveries()[0])
    };
    let (many, few) = (part(12), part(3));
    assert!(few > 1.05 * many && many > 0.01, "{few} {many}");
}

/// Name of a part, and a change of it.
type Change = (&'static str, fn(&mut Parts));

/// `check --against` computes recoveries and named loads again: they hold for any basis, frame, reduction and storage, and
/// a change of any of their numbers is found.
#[test]
fn every_number_of_recoveries_and_named_loads_is_computed_again() {
    let raw = || {
        let mut raw = bracket(&mesh(), Coupling::Averaging);
        let n = raw.stiffness.matrix.n_rows();
        let forces = (0..n).map(|i| ((7 * i + 3) % 11) as f64 - 5.0).collect();
        let (name, path) = ("wind".to_owned(), "f.npy".into());
        raw.data.named_loads = vec![ModelLoad { name, forces, preload: false, path }];
        raw
    };
    let model = FeModel::from_raw(raw()).expect("a model").model;
    let failed = |body: &FlexBody| -> Vec<&'static str> {
        let checks = verify(body, &model).expect("the same model");
        assert!(checks.iter().any(|check| check.name == "recoveries_recomputed"));
        assert!(checks.iter().any(|check| check.name == "named_loads_recomputed"));
        checks.iter().filter(|check| !check.passed).map(|check| check.name).collect()
    };
    let free = |residual_vectors| BasisChoice::Free(FreeSurface { residual_vectors });
    for (basis, frame) in [
        (free(Vec::new()), BodyFrame::Com),
        (free(vec![Loads::Centrifugal]), BodyFrame::Principal),
        (BasisChoice::CraigBampton(CraigBampton), BodyFrame::Model),
    ] {
        let made = body(raw(), basis, 6, frame);
        assert_eq!(failed(&made), [""; 0], "{frame:?}");
        let short = made.rounded_to_f32().expect("in range");
        assert_eq!(failed(&short), [""; 0], "{frame:?} short");
    }
    let whole = body(raw(), free(Vec::new()), 6, BodyFrame::Principal);
    let fewer = whole.reduced(&[0, 2, 3], whole.groups(), Vec::new()).expect("fewer modes");
    assert_eq!(failed(&fewer), [""; 0]);
    let changes: [Change; 11] = [
        ("modes", |p| p.recoveries[0].modes *= Scale(2.0)),
        ("spin", |p| p.recoveries[0].spin *= Scale(-1.0)),
        ("loads", |p| p.recoveries[0].loads[1].columns *= Scale(0.0)),
        ("named", |p| p.recoveries[0].named *= Scale(1.0001)),
        ("offset", |p| p.recoveries[0].offset[0] += 1.0),
        ("rows", |p| p.recoveries[0].rows.swap(0, 1)),
        ("force", |p| p.named_loads[0].force *= 2.0),
        ("modal", |p| p.named_loads[0].modal.swap(0, 1)),
        ("torque", |p| p.named_loads[0].torque *= -1.0),
        ("moments", |p| p.named_loads[0].moments *= 1.0001),
        ("turning", |p| p.named_loads[0].turning *= Scale(0.0)),
    ];
    for (what, change) in changes {
        let mut parts = whole.clone().into_parts();
        change(&mut parts);
        assert!(!failed(&FlexBody::new(parts).expect("a body")).is_empty(), "{what}");
    }
}
