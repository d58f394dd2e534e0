//! The way from matrices to modes and invariants, for tests.

use super::mesh::Assembly;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::basis::{ModalBasis, ModeSettings, free_surface};
use flexbody_body::invariants::{BodyFrame, Frame, Invariants, choose_frame, condense};
use flexbody_eigen::{Accuracy, Method, Proof, Wanted};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, RawModel, check};

/// Checked model and its lowest flexible modes, in model axes.
pub struct Body {
    pub model: FeModel,
    pub modes: ModalBasis,
}

/// Body in its frame.
pub struct Condensed {
    pub frame: Frame,
    pub positions: Vec<[f64; 3]>,
    pub shapes: Mat<f64>,
    pub invariants: Invariants,
}

impl Body {
    /// Returns the frequencies in cycles per unit of time.
    pub fn frequencies(&self) -> Vec<f64> {
        self.eigenvalues().iter().map(|l| l.sqrt() / std::f64::consts::TAU).collect()
    }

    pub fn eigenvalues(&self) -> &[f64] {
        &self.modes.solution.eigenvalues
    }

    /// Returns the shapes in model axes.
    pub fn shapes(&self) -> &Mat<f64> {
        &self.modes.solution.vectors
    }

    /// Returns the exact invariants about the chosen frame.
    pub fn condensed(&self, choice: BodyFrame) -> Condensed {
        let mass = self.model.scalar_mass().expect("a solid");
        let (frame, _) = choose_frame(mass, &self.model.nodes().positions, choice).expect("a body with mass");
        let positions = frame.to_body(&self.model.nodes().positions);
        let mut shapes = self.shapes().clone();
        frame.rotate_shapes(&mut shapes);
        let invariants = condense(mass, &positions, shapes.as_ref(), self.modal_stiffness());
        Condensed { frame, positions, shapes, invariants }
    }

    fn modal_stiffness(&self) -> Mat<f64> {
        let lambda = self.eigenvalues();
        Mat::from_fn(lambda.len(), lambda.len(), |i, j| if i == j { lambda[i] } else { 0.0 })
    }
}

/// Computes the flexible modes that `settings` request.
pub fn solve(raw: RawModel, settings: &ModeSettings) -> Result<Body> {
    let model = check(raw)?.model;
    let modes = free_surface(&model, settings, &Context::QUIET)?;
    Ok(Body { model, modes })
}

/// Computes the lowest `count` flexible modes at certified accuracy by `method`.
pub fn try_modes(raw: RawModel, count: usize, method: Method) -> Result<Body> {
    solve(
        raw,
        &ModeSettings {
            wanted: Wanted::Lowest(count),
            accuracy: Accuracy::Certified,
            method,
            ..ModeSettings::default()
        },
    )
}

/// Computes the lowest `count` flexible modes of a valid body. The inertia count must prove that none is missing.
pub fn modes(body: &Assembly, count: usize) -> Body {
    proved(body.raw_model(), count, Method::Auto)
}

/// Computes the lowest `count` flexible modes of any raw model by a given method. The inertia count must prove that
/// none is missing.
pub fn proved(raw: RawModel, count: usize, method: Method) -> Body {
    let body = try_modes(raw, count, method).expect("a sound body");
    let completeness = &body.modes.solution.completeness;
    assert_eq!(completeness.proof, Proof::InertiaCount, "{}", completeness.remark);
    assert_eq!(completeness.negative_pivots, Some(6 + completeness.modes_below));
    body
}
