//! Groups of the kinetic energy that a body holds (theory section 7).

/// A group of the kinetic energy: the terms that one invariant makes, in every place where they act.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TermGroup {
    /// Inertia linear in q, and the constant centrifugal load of the modes.
    W1,
    /// Inertia quadratic in q, and the centrifugal load that grows with q.
    W2,
    /// Coupling of rotation and modes through q, and the Coriolis force among modes.
    W3,
}

impl TermGroup {
    /// Every group, in the order of the documentation.
    pub const ALL: [TermGroup; 3] = [Self::W1, Self::W2, Self::W3];

    /// Name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::W1 => "W1",
            Self::W2 => "W2",
            Self::W3 => "W3",
        }
    }
}

/// Which groups of the kinetic energy there are. What does not depend on q, and W0, always is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TermGroups {
    /// [`TermGroup::W1`].
    pub w1: bool,
    /// [`TermGroup::W2`].
    pub w2: bool,
    /// [`TermGroup::W3`].
    pub w3: bool,
}

impl TermGroups {
    /// The exact kinetic energy.
    pub const ALL: Self = Self { w1: true, w2: true, w3: true };
    /// That of a body whose inertia does not depend on its deformation.
    pub const NONE: Self = Self { w1: false, w2: false, w3: false };

    /// Whether `group` is there.
    pub fn has(self, group: TermGroup) -> bool {
        match group {
            TermGroup::W1 => self.w1,
            TermGroup::W2 => self.w2,
            TermGroup::W3 => self.w3,
        }
    }

    /// These and `group`.
    pub fn with(mut self, group: TermGroup) -> Self {
        match group {
            TermGroup::W1 => self.w1 = true,
            TermGroup::W2 => self.w2 = true,
            TermGroup::W3 => self.w3 = true,
        }
        self
    }

    /// Those that are not in these.
    pub fn complement(self) -> Self {
        Self { w1: !self.w1, w2: !self.w2, w3: !self.w3 }
    }

    /// All but one.
    pub fn without(group: TermGroup) -> Self {
        Self { w1: group != TermGroup::W1, w2: group != TermGroup::W2, w3: group != TermGroup::W3 }
    }

    /// Those that are in both.
    pub fn and(self, other: Self) -> Self {
        Self { w1: self.w1 && other.w1, w2: self.w2 && other.w2, w3: self.w3 && other.w3 }
    }

    /// Those that are in one of them.
    pub fn or(self, other: Self) -> Self {
        Self { w1: self.w1 || other.w1, w2: self.w2 || other.w2, w3: self.w3 || other.w3 }
    }

    /// Those that are not there.
    pub fn dropped(self) -> impl Iterator<Item = TermGroup> {
        TermGroup::ALL.into_iter().filter(move |group| !self.has(*group))
    }
}

impl Default for TermGroups {
    /// [`TermGroups::ALL`]: nothing is dropped unless asked for.
    fn default() -> Self {
        Self::ALL
    }
}
