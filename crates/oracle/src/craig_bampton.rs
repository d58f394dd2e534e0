//! Craig-Bampton bodies for tests.

use flexbody_base::error::Result;
use flexbody_body::basis::{Basis, BasisChoice, CraigBampton, ModalBasis, ModeSettings, Task};
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::flex_body::{FixedInterface, FlexBody};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModel};

/// Checks a valid model.
pub fn model(raw: RawModel) -> FeModel {
    FeModel::from_raw(raw).expect("a sound model").model
}

/// Returns settings for the lowest `count` modes.
pub fn lowest(count: usize) -> ModeSettings {
    ModeSettings { wanted: Wanted::Lowest(count), ..ModeSettings::default() }
}

/// Computes the modes of a basis.
pub fn modes_of(model: &FeModel, basis: &dyn Basis, settings: &ModeSettings) -> Result<ModalBasis> {
    modes_within(model, basis, settings, &Context::QUIET)
}

/// Computes the modes of a basis within the limits of `context`.
pub fn modes_within(
    model: &FeModel,
    basis: &dyn Basis,
    settings: &ModeSettings,
    context: &Context<'_>,
) -> Result<ModalBasis> {
    basis.modes(&Task { model, settings, context })
}

/// Computes a Craig-Bampton basis with `count` fixed-interface modes.
pub fn craig_bampton(model: &FeModel, count: usize) -> ModalBasis {
    modes_of(model, &CraigBampton, &lowest(count)).expect("a basis")
}

/// Converts a model with `count` modes of a basis.
pub fn converted(model: &FeModel, basis: BasisChoice, count: usize, frame: BodyFrame) -> Conversion {
    let settings =
        ConvertSettings { modes: lowest(count), basis, frame: frame.into(), ..ConvertSettings::default() };
    convert(model, &settings, &Context::QUIET).expect("a body")
}

/// Converts a model to a Craig-Bampton body with `count` fixed-interface modes, in its principal axes.
pub fn body(model: &FeModel, count: usize) -> FlexBody {
    converted(model, BasisChoice::CraigBampton(CraigBampton), count, BodyFrame::Principal).body
}

/// Returns the eigenvalues of the fixed-interface modes of a basis.
pub fn fixed(basis: &ModalBasis) -> Vec<f64> {
    let coordinates = &basis.coordinates.as_ref().expect("a Craig-Bampton basis").coordinates;
    let all = coordinates.names.iter().enumerate();
    all.filter(|(_, name)| name.starts_with("fixed-interface mode "))
        .map(|(i, _)| coordinates.stiffness[(i, i)])
        .collect()
}

/// Returns the record of the fixed-interface modes in a Craig-Bampton body.
pub fn record(body: &FlexBody) -> &FixedInterface {
    body.certificate().fixed_interface.as_ref().expect("a Craig-Bampton body")
}

/// Fails if `found` differs from `expected` by more than the relative tolerance.
pub fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found}, expected {expected}");
}
