//! Recoveries held to the model: stresses against its stiffness, rows under constant loads in any basis and frame.

use crate::recovery::{body, bracket, mesh};
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::{BasisChoice, FreeSurface, Loads};
use flexbody_body::invariants::BodyFrame;
use flexbody_linalg::CscMatrix;
use flexbody_model::{Coupling, FeModel, RecoveryOperator};

/// Stresses in another unit than their rows say, or of another material, are noticed: of the right operator the root mean
/// square stress under shear is that of the stiffness, so that a factor of 100 decides.
#[test]
fn stresses_that_do_not_fit_the_stiffness_are_reported() {
    let said = |factor: f64, unit: &str| {
        let mut raw = bracket(&mesh(), Coupling::Averaging);
        raw.units = UnitSystem::parse("m", "kg", "s").expect("units");
        let RecoveryOperator::Rows { transposed, labels, .. } = &mut raw.recoveries[0].operator else {
            panic!("rows")
        };
        let entries: Vec<_> = oracle::mesh::entries(transposed).map(|(r, c, v)| (r, c, v * factor)).collect();
        *transposed = CscMatrix::from_triplets(transposed.n_rows(), transposed.n_cols(), &entries);
        labels.iter_mut().for_each(|label| unit.clone_into(&mut label.unit));
        let checked = FeModel::from_raw(raw).expect("a model");
        checked.diagnostics.iter().any(|one| one.code() == Code::RecoveryScale)
    };
    assert!(!said(1.0, "Pa") && !said(1e-6, "MPa") && !said(1.0 / 6_894.757_293_168_361, "psi"));
    // Within a hundred of the expected stress, and beyond.
    assert!(!said(99.0, "Pa") && said(101.0, "Pa") && !said(1.0 / 99.0, "Pa") && said(1.0 / 101.0, "Pa"));
    assert!(said(1.0, "MPa") && said(1e-6, "Pa") && said(1e-3, "Pa"));
    // An unknown unit cannot be compared.
    assert!(!said(1.0, "slug/in/s^2"));
}

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
    // With fewer modes the columns hold more.
    let part = |modes: usize| {
        let body = made(free(), modes, BodyFrame::Com);
        body.part_of_static_columns(&body.recoveries()[0])
    };
    let (many, few) = (part(12), part(3));
    assert!(few > 1.05 * many && many > 0.01, "{few} {many}");
}
