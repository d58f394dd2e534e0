//! Reasons why a model or a state has no nodal equations.

use flexbody_model::DofLabel;

/// Reason why a model, or a state of it, has no nodal equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NodalError {
    /// A condition names a degree of freedom that the model does not have.
    DofUnknown(DofLabel),
    /// The number of held degrees of freedom is not six, in the plane three.
    ConditionCount {
        /// Number of rigid motions.
        expected: usize,
        /// Number of held degrees of freedom.
        found: usize,
    },
    /// The conditions leave a rigid motion free.
    ConditionsDependent,
    /// A held degree of freedom without mass.
    HeldWithoutMass(DofLabel),
    /// Degrees of freedom are held, and M has null vectors besides its empty rows.
    HeldMassSingular {
        /// Number of null vectors besides the empty rows.
        null_vectors: usize,
    },
    /// M is not positive semidefinite, or so nearly singular that its null vectors cannot be identified.
    MassIndefinite,
    /// K does not resist a massless motion.
    MasslessUnheld,
    /// M has more null vectors than dense storage allows.
    NullSpaceTooLarge {
        /// Number of null vectors.
        null_vectors: usize,
        /// Number of rows.
        rows: usize,
    },
    /// Damping is given by ratios of modes.
    DampingOfModes,
    /// The body does not belong to the model.
    OtherBody,
    /// Nodal rotations or rows without a position tie the frame to the body.
    FrameTied,
    /// The displacements do not fulfil the reference conditions.
    ConditionsViolated {
        /// Size of the rigid motion in the displacements, relative to the largest displacement.
        part: f64,
    },
}

impl std::fmt::Display for NodalError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::DofUnknown(dof) => write!(f, "{dof} is to be held, but is no degree of freedom of the model"),
            Self::ConditionCount { expected, found } => write!(
                f,
                "{found} degrees of freedom are held; help: hold {expected}, as many as the body has rigid motions"
            ),
            Self::ConditionsDependent => f.write_str(
                "the reference conditions leave a rigid motion free; help: hold three of one node, two of another and one of a third",
            ),
            Self::HeldWithoutMass(dof) => {
                write!(f, "{dof} is to be held, but carries no mass; help: hold others, or take mean axes")
            }
            Self::HeldMassSingular { null_vectors } => write!(
                f,
                "degrees of freedom are held, but the mass matrix has {null_vectors} null vectors; help: take mean axes"
            ),
            Self::MassIndefinite => f.write_str(
                "the mass matrix is indefinite or nearly singular; help: export the consistent mass, or take the reduced equations",
            ),
            Self::MasslessUnheld => f.write_str(
                "the stiffness does not hold all that carries no mass; help: remove these degrees of freedom or give them mass",
            ),
            Self::NullSpaceTooLarge { null_vectors, rows } => write!(
                f,
                "the mass matrix of {rows} rows has {null_vectors} null vectors, too many for dense storage; help: take full integration of the mass, or the reduced equations"
            ),
            Self::DampingOfModes => f.write_str(
                "damping ratios belong to modes, which these equations know of no body; help: give the body (`of_body`), Rayleigh damping or a damping matrix",
            ),
            Self::OtherBody => f.write_str("the body has other rows than the model, or modes that depend on each other"),
            Self::FrameTied => f.write_str(
                "the frame of a body with nodal rotations or rows without a place cannot be changed; help: start without deformation",
            ),
            Self::ConditionsViolated { part } => write!(
                f,
                "the displacements hold rigid motion, {part:.1e} of the largest of them; help: change the frame (`reframed`), or take less deformation"
            ),
        }
    }
}

impl std::error::Error for NodalError {}
