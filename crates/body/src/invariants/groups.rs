//! Groups of the kinetic energy that a body holds (theory section 7).

/// Group of the kinetic energy: all terms that one invariant causes.
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
    /// All groups, in the order of the documentation.
    pub const ALL: [TermGroup; 3] = [Self::W1, Self::W2, Self::W3];

    /// Returns the name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::W1 => "W1",
            Self::W2 => "W2",
            Self::W3 => "W3",
        }
    }
}

/// Set of groups of the kinetic energy. Terms independent of q, and W0, always belong to the kinetic
/// energy.
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
    /// All groups: the exact kinetic energy.
    pub const ALL: Self = Self { w1: true, w2: true, w3: true };
    /// No group: the kinetic energy of a body whose inertia does not depend on its deformation.
    pub const NONE: Self = Self { w1: false, w2: false, w3: false };

    /// Returns true if `group` is in the set.
    pub fn has(self, group: TermGroup) -> bool {
        match group {
            TermGroup::W1 => self.w1,
            TermGroup::W2 => self.w2,
            TermGroup::W3 => self.w3,
        }
    }

    /// Returns the set with `group` added.
    pub fn with(mut self, group: TermGroup) -> Self {
        match group {
            TermGroup::W1 => self.w1 = true,
            TermGroup::W2 => self.w2 = true,
            TermGroup::W3 => self.w3 = true,
        }
        self
    }

    /// Returns the groups that are not in this set.
    pub fn complement(self) -> Self {
        Self { w1: !self.w1, w2: !self.w2, w3: !self.w3 }
    }

    /// Returns all groups but one.
    pub fn without(group: TermGroup) -> Self {
        Self { w1: group != TermGroup::W1, w2: group != TermGroup::W2, w3: group != TermGroup::W3 }
    }

    /// Returns the groups that are in both sets.
    pub fn and(self, other: Self) -> Self {
        Self { w1: self.w1 && other.w1, w2: self.w2 && other.w2, w3: self.w3 && other.w3 }
    }

    /// Returns the groups that are in at least one of the sets.
    pub fn or(self, other: Self) -> Self {
        Self { w1: self.w1 || other.w1, w2: self.w2 || other.w2, w3: self.w3 || other.w3 }
    }

    /// Returns the groups that are missing from this set.
    pub fn dropped(self) -> impl Iterator<Item = TermGroup> {
        TermGroup::ALL.into_iter().filter(move |group| !self.has(*group))
    }
}

impl Default for TermGroups {
    /// Returns [`TermGroups::ALL`]: groups are dropped only on request.
    fn default() -> Self {
        Self::ALL
    }
}
