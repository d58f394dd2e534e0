//! The kinds of bases, with their names.

/// A kind of basis: the shapes that the deformation of a body is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BasisKind {
    /// Free-surface modes, and the residual vectors that the model or the scene asks for.
    #[default]
    Free,
    /// Modes with the interfaces held, and the static responses to motions of these (Craig and Bampton).
    CraigBampton,
    /// Free-surface modes, and the static responses to loads at the interfaces (Craig and Chang).
    CraigChang,
    /// Shapes that were computed elsewhere: they are read from a file.
    Imported,
    /// The fewest shapes that the motion of a scene is made of; another motion may need others.
    Scene,
}

impl BasisKind {
    /// Every kind, in the order of the documentation.
    pub const ALL: [Self; 5] =
        [Self::Free, Self::CraigBampton, Self::CraigChang, Self::Imported, Self::Scene];

    /// Name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::CraigBampton => "craig-bampton",
            Self::CraigChang => "craig-chang",
            Self::Imported => "imported",
            Self::Scene => "scene",
        }
    }

    /// Returns the kind of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }

    /// True if free-surface modes are its only modes, or are what its shapes are chosen from. Loads of a scene join
    /// these, and its band may choose their number.
    pub fn follows_scene(self) -> bool {
        matches!(self, Self::Free | Self::Scene)
    }

    /// True if the modes are searched for among the free-surface modes: residual vectors may join them.
    pub fn searches_free_modes(self) -> bool {
        self.follows_scene() || self == Self::CraigChang
    }
}
