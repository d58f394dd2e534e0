//! Kinds of bases and their names.

/// Kind of basis: the shapes that span the deformation of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BasisKind {
    /// Free-surface modes, and the residual vectors that the model or the scene requests.
    #[default]
    Free,
    /// Modes with the interfaces held, and the static responses to motions of the interfaces (Craig and
    /// Bampton).
    CraigBampton,
    /// Free-surface modes, and the static responses to loads at the interfaces (Craig and Chang).
    CraigChang,
    /// Shapes computed elsewhere and read from a file.
    Imported,
    /// Smallest set of shapes that spans the motion of a scene; another motion may need others.
    Scene,
}

impl BasisKind {
    /// All kinds, in the order of the documentation.
    pub const ALL: [Self; 5] =
        [Self::Free, Self::CraigBampton, Self::CraigChang, Self::Imported, Self::Scene];

    /// Returns the name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::CraigBampton => "craig-bampton",
            Self::CraigChang => "craig-chang",
            Self::Imported => "imported",
            Self::Scene => "scene",
        }
    }

    /// Returns the kind with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }

    /// Returns true if the basis consists of free-surface modes only, or if its shapes are chosen from
    /// them. Residual vectors for the loads of a scene may be added, and the frequency band of the scene
    /// may set the number of modes.
    pub fn follows_scene(self) -> bool {
        matches!(self, Self::Free | Self::Scene)
    }

    /// Returns true if the search is for free-surface modes, to which residual vectors may be added.
    pub fn searches_free_modes(self) -> bool {
        self.follows_scene() || self == Self::CraigChang
    }
}
