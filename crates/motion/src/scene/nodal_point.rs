//! Points of a scene among the nodes of a model.

use super::Point;
use crate::dynamics::NodalPoint;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_model::FeModel;

/// Finds `point` among the nodes of `model`. Returns `None` if the model has no such node, or no such
/// interface with a reference point.
///
/// # Errors
/// [`InterfaceNode`](Code::InterfaceNode) if the model has no interfaces.
pub fn find_nodal_point(model: &FeModel, point: &Point) -> Result<Option<NodalPoint>> {
    match point {
        Point::Interface(name) => NodalPoint::interface(model, name),
        Point::Node(number) => {
            let node = model.nodes().ids.iter().position(|id| id == number);
            Ok(node.map(|node| NodalPoint::node(model, node)))
        }
    }
}

/// Finds `point` among the nodes of `model`, which must exist.
///
/// # Errors
/// FB212 when the model has no such node, or no such interface with a reference point.
pub fn nodal_point(model: &FeModel, point: &Point) -> Result<NodalPoint> {
    find_nodal_point(model, point)?
        .ok_or_else(|| Diagnostic::new(Code::SceneBody, format!("the model has no {point}")).into())
}
