//! Reference conditions, which tie the frame to the body.

use super::motions::Motions;
use super::{NodalError, NodalPoint};
use flexbody_model::{DofLabel, FeModel};

/// Conditions C u = 0 on the displacements, as many as rigid motions, that define the frame of the deformed
/// body.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum ReferenceConditions {
    /// R'M u = 0 with the rigid motions R (Tisserand): deformation carries no momentum to first order.
    /// Free-surface modes fulfil it.
    #[default]
    MeanAxes,
    /// Degrees of freedom that are zero, which fixes the frame to nodes: six, for a plane body three.
    Held(Vec<DofLabel>),
    /// Point at rest in displacement and rotation, which carries the frame.
    AtRest(NodalPoint),
}

impl ReferenceConditions {
    /// Returns C', given M R; all held rows have mass.
    pub(super) fn columns(
        &self,
        model: &FeModel,
        moving: &[usize],
        mass_rigid: &Motions,
    ) -> Result<Motions, NodalError> {
        let held = match self {
            Self::MeanAxes => return Ok(mass_rigid.clone()),
            Self::AtRest(point) => return of_point(model, moving, point),
            Self::Held(held) => held,
        };
        if held.len() != moving.len() {
            return Err(NodalError::ConditionCount { expected: moving.len(), found: held.len() });
        }
        let mut columns = vec![[0.0; 6]; model.rows().len()];
        for (dof, &column) in held.iter().zip(moving) {
            let row = (0..columns.len()).find(|&row| model.label(row) == *dof);
            let row = row.ok_or(NodalError::DofUnknown(*dof))?;
            refuse_massless(model, row)?;
            columns[row][column] = 1.0;
        }
        Ok(columns)
    }
}

/// Returns C' of a point at rest: its weights.
fn of_point(model: &FeModel, moving: &[usize], point: &NodalPoint) -> Result<Motions, NodalError> {
    let loads = point.unit_loads(model);
    let mut columns = vec![[0.0; 6]; model.rows().len()];
    for (row, columns) in columns.iter_mut().enumerate() {
        moving.iter().enumerate().for_each(|(at, &motion)| columns[motion] = loads[(row, at)]);
        if columns.iter().any(|weight| *weight != 0.0) {
            refuse_massless(model, row)?;
        }
    }
    Ok(columns)
}

/// Returns an error for a condition on a row without mass, which does not constrain the motion.
fn refuse_massless(model: &FeModel, row: usize) -> Result<(), NodalError> {
    let pencil = model.pencil();
    if pencil.mass().row(row / pencil.block()).0.is_empty() {
        Err(NodalError::HeldWithoutMass(model.label(row)))
    } else {
        Ok(())
    }
}
