//! Reasons why a model has no nodal equations.

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
    /// Points with mass follow several nodes by constraints.
    MassFollows,
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
            Self::DofUnknown(dof) => write!(f, "{dof} is to be held, but is not a degree of freedom of the model"),
            Self::ConditionCount { expected, found } => write!(
                f,
                "{found} degrees of freedom are held, expected {expected}; help: hold as many as the body has rigid motions"
            ),
            Self::ConditionsDependent => f.write_str(
                "the reference conditions leave a rigid motion free; help: hold three degrees of freedom of one node, two of a second and one of a third",
            ),
            Self::HeldWithoutMass(dof) => {
                write!(f, "{dof} is to be held, but carries no mass; help: hold another degree of freedom, or use mean axes")
            }
            Self::HeldMassSingular { null_vectors } => write!(
                f,
                "degrees of freedom are held, but the mass matrix has {null_vectors} null vectors; help: use mean axes"
            ),
            Self::MassIndefinite => f.write_str(
                "the mass matrix is indefinite or nearly singular; help: export the consistent mass, or use the reduced equations",
            ),
            Self::MasslessUnheld => f.write_str(
                "some degrees of freedom have neither mass nor stiffness; help: remove them, or give them mass",
            ),
            Self::NullSpaceTooLarge { null_vectors, rows } => write!(
                f,
                "the mass matrix of {rows} rows has {null_vectors} null vectors, too many for dense storage; help: integrate the mass fully, or use the reduced equations"
            ),
            Self::MassFollows => f.write_str(
                "points with mass follow several nodes by constraints (RBE3, MPC), and turn with them only in the reduced equations; help: give these points rows of their own, tied by RBE2 or stiff beams",
            ),
            Self::DampingOfModes => f.write_str(
                "damping ratios need the modes of a body, and none is given; help: give the body (`of_body`), Rayleigh damping or a damping matrix",
            ),
            Self::OtherBody => f.write_str("the rows of the body and the model differ, or the modes are linearly dependent"),
            Self::FrameTied => f.write_str(
                "the frame of a body with nodal rotations or rows without a position cannot be changed; help: start without deformation",
            ),
            Self::ConditionsViolated { part } => write!(
                f,
                "the displacements contain rigid motion, {part:.1e} of the largest displacement; help: change the frame (`reframed`), or reduce the deformation"
            ),
        }
    }
}

impl std::error::Error for NodalError {}
