//! The way from matrices to modes, as tests take it.

use super::mesh::Assembly;
use flexbody::basis::{FreeSurfaceModes, ModeSettings, free_surface};
use flexbody::eigen::{Accuracy, Method, Proof, Wanted};
use flexbody::error::Result;
use flexbody::model::{FeModel, RawModel, check};
use flexbody::progress::SILENT;

/// A checked model and its lowest flexible modes, in model axes.
pub struct Body {
    pub model: FeModel,
    pub modes: FreeSurfaceModes,
}

impl Body {
    /// Frequencies in cycles per time unit.
    pub fn frequencies(&self) -> Vec<f64> {
        self.eigenvalues().iter().map(|l| l.sqrt() / std::f64::consts::TAU).collect()
    }

    pub fn eigenvalues(&self) -> &[f64] {
        &self.modes.solution.eigenvalues
    }
}

/// The lowest `count` flexible modes at certified accuracy by `method`.
pub fn try_modes(raw: RawModel, count: usize, method: Method) -> Result<Body> {
    let model = check(raw)?.model;
    let settings = ModeSettings { wanted: Wanted::Lowest(count), accuracy: Accuracy::Certified, method };
    let modes = free_surface(&model, &settings, SILENT)?;
    Ok(Body { model, modes })
}

/// The lowest `count` flexible modes of a sound body, with their completeness proved: the inertia count says that
/// none is missed.
pub fn modes(body: &Assembly, count: usize) -> Body {
    let body = try_modes(body.raw_model(), count, Method::Auto).expect("a sound body");
    let completeness = &body.modes.solution.completeness;
    assert_eq!(completeness.proof, Proof::InertiaCount, "{}", completeness.remark);
    assert_eq!(completeness.negative_pivots, Some(6 + completeness.modes_below));
    body
}
