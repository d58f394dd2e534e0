//! The properties of element types of Abaqus and CalculiX: nodes, directions and shapes.

use flexbody_model::ElementShape;

/// Family of an element type, by the degrees of freedom of its nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Family {
    /// Displacements in space: solids.
    Solid,
    /// Displacements in a plane: plane stress, plane strain.
    Plane,
    /// Displacements and rotations in space: shells and beams.
    Turning,
    /// Displacements and the rotation in a plane: beams.
    PlaneTurning,
    /// Displacements along a line or in a membrane.
    Pulling,
    /// Mass at a node.
    Mass,
    /// Rotary inertia of a node.
    Turner,
}

impl Family {
    /// Returns the directions that a node of such an element has, 1 to 6.
    pub(super) fn directions(self) -> &'static [u8] {
        match self {
            Self::Solid | Self::Pulling | Self::Mass => &[1, 2, 3],
            Self::Plane => &[1, 2],
            Self::Turning => &[1, 2, 3, 4, 5, 6],
            Self::PlaneTurning => &[1, 2, 6],
            Self::Turner => &[4, 5, 6],
        }
    }
}

/// Returns true for elements of bodies of revolution in the plane of radius and axis.
pub(super) fn is_axisymmetric(kind: &str) -> bool {
    ["CAX", "CGAX", "SAX", "MAX"].iter().any(|head| kind.starts_with(head))
}

/// Returns the family of an element type; `None` if it is unknown.
pub(super) fn family(kind: &str) -> Option<Family> {
    let begins = |heads: &[&str]| heads.iter().any(|head| kind.starts_with(head));
    if begins(&["C3D", "SC6", "SC8", "CSS8"]) {
        Some(Family::Solid)
    } else if begins(&["CPS", "CPE", "T2D"]) {
        Some(Family::Plane)
    } else if begins(&["MASS"]) {
        Some(Family::Mass)
    } else if begins(&["ROTARYI"]) {
        Some(Family::Turner)
    } else if begins(&["T3D", "M3D"]) {
        Some(Family::Pulling)
    } else if begins(&["S3", "S4", "S6", "S8", "STRI", "B31", "B32", "B33"]) {
        Some(Family::Turning)
    } else if begins(&["B21", "B22", "B23"]) {
        Some(Family::PlaneTurning)
    } else {
        None
    }
}

/// Returns the number of nodes of an element type if its name contains it: `C3D20R`, `S8R`, `B32`.
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
        [b'B', b'2' | b'3', b'1' | b'3', ..] => Some(2),
        [b'B', b'2' | b'3', b'2', ..] => Some(3),
        [b'T', b'2' | b'3', b'D', n @ (b'2' | b'3'), ..] => Some(usize::from(n - b'0')),
        _ => None,
    }
}

/// Returns true when elements of the type have internal nodes, which are not in the deck but have rows in the matrices.
pub(super) fn has_internal_nodes(kind: &str) -> bool {
    kind.starts_with("B33") || kind.starts_with("B23") || kind.starts_with('B') && kind.ends_with('H')
}

/// Contribution of an element type to the stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Solid with a material.
    Solid,
    /// Spring.
    Spring,
    /// Type without stiffness.
    WithoutStiffness,
    /// Type that is not described, with the reason.
    Other(&'static str),
}

/// Returns the contribution of an element type to the stiffness.
pub(super) fn role(kind: &str) -> Role {
    let begins = |heads: &[&str]| heads.iter().any(|head| kind.starts_with(head));
    if begins(&["C3D"]) {
        return Role::Solid;
    }
    if matches!(kind, "SPRINGA" | "SPRING1" | "SPRING2") {
        return Role::Spring;
    }
    // The element of a distributing coupling only names its reference node.
    if begins(&["DASHPOT", "HEATCAP"]) || kind == "DCOUP3D" {
        return Role::WithoutStiffness;
    }
    match family(kind) {
        Some(Family::Mass | Family::Turner) => Role::WithoutStiffness,
        Some(Family::Solid) => Role::Other("continuum shells are not described"),
        Some(Family::Plane) if kind.starts_with('T') => Role::Other("trusses are not described"),
        Some(Family::Plane) => Role::Other("elements of plane models are not described"),
        Some(Family::Turning) if kind.starts_with('B') => Role::Other("beams are not described"),
        Some(Family::Turning) => Role::Other("shells are not described"),
        Some(Family::PlaneTurning) => Role::Other("beams are not described"),
        Some(Family::Pulling) if kind.starts_with('T') => Role::Other("trusses are not described"),
        Some(Family::Pulling) => Role::Other("membranes are not described"),
        None if kind.starts_with('U') => Role::Other("user elements are not described"),
        None if kind.starts_with("GAP") => Role::Other("gaps are not described"),
        None => Role::Other("the type is unknown"),
    }
}

/// Drawing of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Drawing {
    /// Shape, and its nodes in the order of the shape.
    Shape(ElementShape, Vec<i64>),
    /// A point, which is not drawn.
    Nothing,
    /// Unknown type or number of nodes.
    Unknown,
}

/// Returns the drawing of an element of a type with these nodes.
pub(super) fn drawing(kind: &str, nodes: &[i64]) -> Drawing {
    let is_line =
        ["T2D", "T3D", "B21", "B22", "B23", "B31", "B32", "B33"].iter().any(|head| kind.starts_with(head));
    // Beams may have an additional node, which defines their orientation.
    let count = if is_line { n_nodes(kind).unwrap_or(nodes.len()).min(nodes.len()) } else { nodes.len() };
    let shape = match (family(kind), count) {
        (Some(Family::Mass | Family::Turner), _) => return Drawing::Nothing,
        // Element of the reference node of a distributing coupling.
        (None, 1) if kind == "DCOUP3D" => return Drawing::Nothing,
        (Some(Family::Solid), 4 | 10) => ElementShape::Tetrahedron,
        (Some(Family::Solid), 5 | 13) => ElementShape::Pyramid,
        (Some(Family::Solid), 6 | 15 | 18) => ElementShape::Wedge,
        (Some(Family::Solid), 8 | 20 | 27) => ElementShape::Hexahedron,
        (Some(_), 2 | 3) if is_line => {
            // The middle node is between the end nodes in the element, but after them in the shape.
            let ends_first =
                if count == 3 { vec![nodes[0], nodes[2], nodes[1]] } else { nodes[..2].to_vec() };
            return Drawing::Shape(ElementShape::Line, ends_first);
        }
        (Some(Family::Plane | Family::Turning | Family::Pulling), 3 | 6) => ElementShape::Triangle,
        (Some(Family::Plane | Family::Turning | Family::Pulling), 4 | 8 | 9) => ElementShape::Quadrilateral,
        _ => return Drawing::Unknown,
    };
    Drawing::Shape(shape, nodes.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_drawn_by_type_and_number_of_nodes() {
        let nodes: Vec<i64> = (1..=27).collect();
        for (kind, count, shape) in [
            ("C3D10M", 10, ElementShape::Tetrahedron),
            ("C3D15V", 18, ElementShape::Wedge),
            ("C3D27", 27, ElementShape::Hexahedron),
            ("SC8R", 8, ElementShape::Hexahedron),
            ("SC6R", 6, ElementShape::Wedge),
            ("STRI65", 6, ElementShape::Triangle),
            ("S8R", 8, ElementShape::Quadrilateral),
            ("CPS3", 3, ElementShape::Triangle),
            ("M3D8R", 8, ElementShape::Quadrilateral),
        ] {
            let drawn = drawing(kind, &nodes[..count]);
            assert_eq!(drawn, Drawing::Shape(shape, nodes[..count].to_vec()), "{kind}");
        }
        assert_eq!(drawing("B32", &[1, 2, 3]), Drawing::Shape(ElementShape::Line, vec![1, 3, 2]));
        assert_eq!(drawing("B31", &[1, 2, 99]), Drawing::Shape(ElementShape::Line, vec![1, 2]));
        assert_eq!(drawing("MASS", &[1]), Drawing::Nothing);
        for (kind, count) in [("SPRINGA", 2), ("C3D8", 7), ("B31", 1), ("S4", 0)] {
            assert_eq!(drawing(kind, &nodes[..count]), Drawing::Unknown, "{kind}");
        }
    }

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
            ("B33", 2, Family::Turning),
            ("B23H", 2, Family::PlaneTurning),
            ("T2D2", 2, Family::Plane),
            ("T3D2", 2, Family::Pulling),
        ] {
            assert_eq!((n_nodes(kind), family(kind)), (Some(nodes), Some(of)), "{kind}");
        }
        assert_eq!(family("GAPUNI"), None);
    }
}
