//! What element types of Abaqus and CalculiX are made of.

/// Family of an element type: what its nodes can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Family {
    /// Displacements in space.
    Solid,
    /// Displacements in a plane: plane stress, plane strain.
    Plane,
    /// Displacements and rotations in space: shells and beams.
    Turning,
    /// Displacements along a line or in a membrane.
    Pulling,
    /// A mass at a node.
    Mass,
    /// The inertia of a turning node.
    Turner,
}

impl Family {
    /// Directions that a node of such an element has, 1 to 6.
    pub(super) fn directions(self) -> &'static [u8] {
        match self {
            Self::Solid | Self::Pulling | Self::Mass => &[1, 2, 3],
            Self::Plane => &[1, 2],
            Self::Turning => &[1, 2, 3, 4, 5, 6],
            Self::Turner => &[4, 5, 6],
        }
    }
}

/// Family of an element type; `None` of one that is not known.
pub(super) fn family(kind: &str) -> Option<Family> {
    let begins = |heads: &[&str]| heads.iter().any(|head| kind.starts_with(head));
    if begins(&["C3D", "SC6", "SC8", "CSS8"]) {
        Some(Family::Solid)
    } else if begins(&["CPS", "CPE"]) {
        Some(Family::Plane)
    } else if begins(&["MASS"]) {
        Some(Family::Mass)
    } else if begins(&["ROTARYI"]) {
        Some(Family::Turner)
    } else if begins(&["T3D", "M3D"]) {
        Some(Family::Pulling)
    } else if begins(&["S3", "S4", "S6", "S8", "STRI", "B31", "B32", "B33"]) {
        Some(Family::Turning)
    } else {
        None
    }
}

/// Number of nodes of an element type where it is in its name: `C3D20R`, `S8R`, `B32`.
pub(super) fn n_nodes(kind: &str) -> Option<usize> {
    let digits = |text: &str| -> Option<usize> {
        let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
        text[..end].parse().ok()
    };
    for head in ["C3D", "CPS", "CPE", "M3D", "STRI", "SC"] {
        if let Some(rest) = kind.strip_prefix(head) {
            return match (head, digits(rest)) {
                ("STRI", Some(65)) => Some(6),
                (_, n) => n.filter(|n| *n > 0),
            };
        }
    }
    match kind.as_bytes() {
        [b'S', b'3' | b'4' | b'6' | b'8' | b'9', ..] => Some(usize::from(kind.as_bytes()[1] - b'0')),
        [b'B', b'3', b'1', ..] => Some(2),
        [b'B', b'3', b'2', ..] => Some(3),
        [b'T', b'3', b'D', n @ (b'2' | b'3'), ..] => Some(usize::from(n - b'0')),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_families_and_numbers_of_nodes() {
        for (kind, nodes, of) in [
            ("C3D20R", 20, Family::Solid),
            ("C3D10", 10, Family::Solid),
            ("C3D8I", 8, Family::Solid),
            ("C3D4", 4, Family::Solid),
            ("CPS8", 8, Family::Plane),
            ("CPE4R", 4, Family::Plane),
            ("S8R", 8, Family::Turning),
            ("S4", 4, Family::Turning),
            ("STRI65", 6, Family::Turning),
            ("B31", 2, Family::Turning),
            ("B32R", 3, Family::Turning),
            ("T3D2", 2, Family::Pulling),
        ] {
            assert_eq!((n_nodes(kind), family(kind)), (Some(nodes), Some(of)), "{kind}");
        }
        assert_eq!(family("GAPUNI"), None);
    }
}
