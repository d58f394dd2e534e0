//! Warning about rotary inertia of nodes that no rigid mass has.

use crate::flex_body::FlexBody;
use crate::invariants::bounds_broken;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_model::{DirectorMass, FeModel};

/// Excess over the bounds of points of mass, relative to the modal mass, that counts as rounding or as the
/// rest of a consistent mass.
const REPORTED_EXCESS: f64 = 1e-6;

/// Returns a warning if the modes of a body whose nodes turn have diagonal blocks S_kk below zero, or
/// |W3| above |m_ff|: points and directors with positive second moments have neither. `model` names the
/// node of the most negative second moment; a file alone names none.
///
/// A disc of which only the inertia about its axis was given is sound, and its second moment about the
/// axis is minus half of it.
pub fn unusual_node_inertia(body: &FlexBody, model: Option<&FeModel>) -> Option<Diagnostic> {
    body.inertia_stiffness()?;
    let broken = bounds_broken(body.invariants());
    if broken.s_negative.max(broken.w3_excess) <= REPORTED_EXCESS {
        return None;
    }
    let node = match model.map(|model| (model, model.director_mass())) {
        None => String::new(),
        Some((model, mass)) => of_node(model, mass?)?,
    };
    let message = format!(
        "rotary inertia of nodes is that of no rigid mass{node}: S_kk of the modes reaches {}, |W3| {} of the modal mass, where points of mass have no S_kk below 0 and no |W3| above 1",
        significant(-broken.s_negative, 3),
        significant(1.0 + broken.w3_excess, 3),
    );
    Some(Diagnostic::new(Code::NodeInertia, message))
}

/// Returns a text about the node with the most negative second moment; `None` if no node has one.
fn of_node(model: &FeModel, mass: &DirectorMass) -> Option<String> {
    let (node, smallest, count) = mass.negative_moments()?;
    let id = model.nodes_of_body().ids[model.node_of_body(node)];
    let others = match count {
        1 => String::new(),
        _ => format!(", one of {count} such nodes"),
    };
    Some(format!(", at node {id}{others} (second moment about an axis {})", significant(smallest, 3)))
}
