//! What is known of a body between its modes and its invariants, so that a scene can rule out what need not be computed.

use super::damping::modal_damping;
use super::{BodyModes, Place};
use crate::error::Result;
use crate::flex_body::{Groups, Interface, TermDecision};
use crate::invariants::{Frame, Invariants, MassProperties};
use crate::model::{FeModel, Nodes};
use crate::units::UnitSystem;
use faer::{Mat, MatRef};
use nalgebra::{Matrix3, Vector3};

/// Modes and rigid inertia of a body before W1, W2 and W3 exist. Components along the body axes, about the origin of the body frame.
#[derive(Debug, Clone, Copy)]
pub struct Spectrum<'a> {
    /// 3, or 2 for a body that moves in its plane z = 0 only.
    pub dimension: usize,
    /// Units of all numbers.
    pub units: &'a UnitSystem,
    /// Body frame in model coordinates.
    pub frame: &'a Frame,
    /// Mass properties in model axes.
    pub mass_properties: &'a MassProperties,
    /// m. Unit: mass.
    pub mass: f64,
    /// c. Unit: mass length.
    pub first_moment: Vector3<f64>,
    /// I0. Unit: mass length^2.
    pub inertia: Matrix3<f64>,
    /// lambda, ascending (nf). Unit: 1/time^2.
    pub eigenvalues: &'a [f64],
    /// Modal damping ratios (nf), 0 where no damping is given.
    pub damping_ratio: &'a [f64],
    /// Where each mode comes from (nf).
    pub provenance: &'a [String],
    /// Node numbers and positions in the body frame.
    pub nodes: &'a Nodes,
    /// Shapes (3n x nf), row 3 i + k: component k of node i, mass-normalised.
    pub shape: MatRef<'a, f64>,
    /// Rotations of the nodes (3n x nf) in the same way; `None` for models of displacements.
    pub rotation: Option<MatRef<'a, f64>>,
    /// Interfaces.
    pub interfaces: &'a [Interface],
}

/// Decides about the groups of the kinetic energy; what it does not name is kept.
pub type Decide<'a> = &'a dyn Fn(&Spectrum<'_>) -> Result<Vec<TermDecision>>;

/// What a decision needs besides the modes.
pub(super) struct Known<'a> {
    pub model: &'a FeModel,
    pub place: &'a Place,
    pub mass_properties: &'a MassProperties,
    pub eigenvalues: &'a [f64],
    pub provenance: &'a [String],
    pub nodes: &'a Nodes,
    pub interfaces: &'a [Interface],
}

/// What was decided, and what it was decided on.
pub(super) struct Decided {
    /// The invariants without W2 and W3.
    pub linear: Invariants,
    pub terms: Vec<TermDecision>,
}

impl Decided {
    /// Asks `decide`. Nothing but products of M with rigid motion is formed for that.
    pub fn new(
        known: &Known<'_>,
        modes: &BodyModes,
        modal_stiffness: Mat<f64>,
        decide: Decide<'_>,
    ) -> Result<Self> {
        let Known { model, place, .. } = known;
        let linear = modes.condensed_linear(model, place, modal_stiffness);
        let damping = modal_damping(model, modes.vectors.as_ref(), known.eigenvalues, &linear)?;
        let terms = decide(&Spectrum {
            dimension: model.dimension(),
            units: model.units(),
            frame: &place.frame,
            mass_properties: known.mass_properties,
            mass: linear.mass,
            first_moment: linear.first_moment,
            inertia: linear.inertia(),
            eigenvalues: known.eigenvalues,
            damping_ratio: &damping
                .map_or_else(|| vec![0.0; known.eigenvalues.len()], |damping| damping.ratio),
            provenance: known.provenance,
            nodes: known.nodes,
            shape: modes.of_nodes(),
            rotation: modes.rotations.as_ref().map(Mat::as_ref),
            interfaces: known.interfaces,
        })?;
        Ok(Self { linear, terms })
    }

    /// The groups that no decision drops.
    pub fn groups(&self) -> Groups {
        let dropped = self.terms.iter().filter(|term| !term.kept);
        dropped.fold(Groups::ALL, |groups, term| groups.and(Groups::without(term.group)))
    }
}
