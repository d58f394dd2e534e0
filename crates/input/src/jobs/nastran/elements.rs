//! The shapes by which elements of a deck are drawn.

use crate::bulk_cards::Card;
use crate::upright_order::in_order_of_shape;
use flexbody_model::{ElementShape, Elements};

/// Elements that are points or connect coincident points, and are not drawn: springs, masses, dampers, fasteners.
const NOTHING_TO_DRAW: &[&str] =
    &["CELAS", "CBUSH", "CMASS", "CONM", "CDAMP", "CVISC", "CGAP", "CFAST", "CWELD", "CSEAM", "CHBDY"];

/// Adds the element of a card to the elements for drawing.
pub(super) fn add(card: &Card, elements: &mut Elements) {
    let name = card.name.as_str();
    let Some((shape, first, most)) = shape(name) else {
        if !NOTHING_TO_DRAW.iter().any(|head| name.starts_with(head)) {
            elements.leave_out(name, 1);
        }
        return;
    };
    let grids: Vec<i64> = (first..first + most).map(|k| card.integer(k).unwrap_or(0)).collect();
    let (corners, middles) = grids.split_at(shape.corners());
    if corners.iter().any(|&grid| grid <= 0) {
        elements.leave_out(name, 1);
    } else if middles.is_empty() || middles.contains(&0) {
        elements.add(name, shape, corners);
    } else {
        elements.add(name, shape, &in_order_of_shape(shape, &grids));
    }
}

/// Returns the shape of an element, the field of its first grid, and its largest number of grids.
fn shape(name: &str) -> Option<(ElementShape, usize, usize)> {
    Some(match name {
        "CTETRA" => (ElementShape::Tetrahedron, 2, 10),
        "CPYRAM" | "CPYRA" => (ElementShape::Pyramid, 2, 13),
        "CPENTA" => (ElementShape::Wedge, 2, 15),
        "CHEXA" | "CHEXA20" => (ElementShape::Hexahedron, 2, 20),
        "CHEXA8" => (ElementShape::Hexahedron, 2, 8),
        "CTRIA3" | "CTRIAR" => (ElementShape::Triangle, 2, 3),
        "CTRIA6" => (ElementShape::Triangle, 2, 6),
        "CQUAD4" | "CQUADR" | "CSHEAR" => (ElementShape::Quadrilateral, 2, 4),
        "CQUAD8" => (ElementShape::Quadrilateral, 2, 8),
        "CBAR" | "CBEAM" | "CBEND" | "CROD" | "CTUBE" => (ElementShape::Line, 2, 2),
        "CONROD" => (ElementShape::Line, 1, 2),
        _ => return None,
    })
}
