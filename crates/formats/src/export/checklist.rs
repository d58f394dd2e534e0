//! Checklist of an export: every property of a body, and its holding by the file.

/// Holding of one property of a body by an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Holding {
    /// The file holds the property.
    Held,
    /// The file does not hold a property of the body. The text completes the sentence "FORMAT cannot hold
    /// ...".
    Lost(String),
    /// The body does not have the property, or the readers of the format do not use it; nothing is reported.
    NotApplicable,
}

impl Holding {
    /// Returns [`Lost`](Self::Lost) with the text, or [`Held`](Self::Held) without a text.
    pub(crate) fn held_but_for(lost: Option<String>) -> Self {
        lost.map_or(Self::Held, Self::Lost)
    }

    fn lost(self) -> Option<String> {
        match self {
            Self::Lost(text) => Some(text),
            Self::Held | Self::NotApplicable => None,
        }
    }
}

/// Holdings of all properties of a body, in the order in which losses are reported. The type has no default,
/// so that a new property compiles only after every format has stated its holding, by itself or with formats
/// of the same contents. The origin and proof of the numbers (certificate, lumped comparators, fingerprints
/// of the inputs) are in the flex-body file alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportChecklist {
    /// Coupling of rigid motion and modes in the kinetic energy.
    pub rigid_coupling: Holding,
    /// Restriction of a plane body to its plane.
    pub plane: Holding,
    /// Inertia of the deformed body (W1, W2, W3).
    pub deformed_inertia: Holding,
    /// W0 of a mass that does not commute with rotations.
    pub general_w0: Holding,
    /// Coriolis force of modes that move the centre of mass, on the frame.
    pub coriolis_force: Holding,
    /// W3 with its symmetric part.
    pub general_w3: Holding,
    /// W2 apart from the modal mass.
    pub separate_w2: Holding,
    /// Geometric stiffness.
    pub geometric_stiffness: Holding,
    /// Stiffness of inertia of rotating nodes.
    pub inertia_stiffness: Holding,
    /// Damping of the modes.
    pub damping: Holding,
    /// Displacements of nodes or frames in the modes.
    pub shapes: Holding,
    /// Rotations of nodes or frames in the modes.
    pub rotations: Holding,
    /// Rows of the modes that belong to no node.
    pub internal_rows: Holding,
    /// Point of action of gravity on the deformed body.
    pub gravity: Holding,
    /// Positions of the interfaces.
    pub interfaces: Holding,
    /// Surface for drawing the body.
    pub surface: Holding,
    /// Origin of each mode (free mode, residual vector, ...).
    pub origins_of_modes: Holding,
    /// Units of the numbers.
    pub units: Holding,
    /// Storage of large arrays in 32-bit floats.
    pub storage: Holding,
}

impl ExportChecklist {
    /// Returns the losses as completions of "FORMAT cannot hold ...", the most important first.
    pub fn losses(self) -> Vec<String> {
        let Self {
            rigid_coupling,
            plane,
            deformed_inertia,
            general_w0,
            coriolis_force,
            general_w3,
            separate_w2,
            geometric_stiffness,
            inertia_stiffness,
            damping,
            shapes,
            rotations,
            internal_rows,
            gravity,
            interfaces,
            surface,
            origins_of_modes,
            units,
            storage,
        } = self;
        let motion = [
            rigid_coupling,
            plane,
            deformed_inertia,
            general_w0,
            coriolis_force,
            general_w3,
            separate_w2,
            geometric_stiffness,
            inertia_stiffness,
            damping,
        ];
        let contents = [
            shapes,
            rotations,
            internal_rows,
            gravity,
            interfaces,
            surface,
            origins_of_modes,
            units,
            storage,
        ];
        motion.into_iter().chain(contents).filter_map(Holding::lost).collect()
    }
}
