//! What ties the frame to the body.

use super::NodalError;
use crate::model::{DofLabel, FeModel};

/// The conditions C u = 0 on the displacements, as many as rigid motions, that say where the frame of the deformed body is.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum ReferenceConditions {
    /// R'M u = 0 with the rigid motions R (Tisserand): no deformation carries momentum to first order. What free-surface modes
    /// fulfil.
    #[default]
    MeanAxes,
    /// These degrees of freedom are zero: the frame is fixed to nodes. Six, of a plane body three.
    Held(Vec<DofLabel>),
}

/// Numbers of each row for the six rigid motions; zero for those that a plane body does not have.
pub(super) type Motions = Vec<[f64; 6]>;

impl ReferenceConditions {
    /// C', given M R; none of the held rows is without mass.
    pub(super) fn columns(
        &self,
        model: &FeModel,
        moving: &[usize],
        mass_rigid: &Motions,
    ) -> Result<Motions, NodalError> {
        let Self::Held(held) = self else { return Ok(mass_rigid.clone()) };
        if held.len() != moving.len() {
            return Err(NodalError::ConditionCount { expected: moving.len(), found: held.len() });
        }
        let (pencil, mut columns) = (model.pencil(), vec![[0.0; 6]; model.rows().len()]);
        for (dof, &column) in held.iter().zip(moving) {
            let row = (0..columns.len()).find(|&row| model.label(row) == *dof);
            let row = row.ok_or(NodalError::DofUnknown(*dof))?;
            if pencil.mass().row(row / pencil.block()).0.is_empty() {
                return Err(NodalError::HeldWithoutMass(*dof));
            }
            columns[row][column] = 1.0;
        }
        Ok(columns)
    }
}
