//! Number of instances of a group of the flex-body file.

/// Number of instances of a group in a file: one for the body, or one for each object of this kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Per {
    Body,
    LumpingScheme,
    Interface,
    UnitLoad,
    RotatedLoad,
    EstimatedLoad,
    InertiaLoad,
    Recovery,
    NamedLoad,
}

impl Per {
    /// Returns true if the order of the objects is data: rows and coordinates elsewhere follow it.
    pub(crate) fn is_ordered(self) -> bool {
        matches!(self, Self::Interface | Self::Recovery | Self::NamedLoad)
    }
}
