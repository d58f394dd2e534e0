//! Reference points of interfaces: their positions, and checks of these.

use super::interface_centre::{InterfaceCentre, InterfaceNodes};
use super::{Coupling, Nodes, RawModel, Reference, centre_and_length, span};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use nalgebra::Vector3;
use std::collections::HashMap;

/// Distance of a reference point from the middle of the nodes, relative to the largest distance of a node,
/// above which it is an error, usually of units. Rotations about a point this far away lose four digits.
const MAX_RELATIVE_DISTANCE: f64 = 100.0;

/// Distance of a reference point from the middle of its nodes, relative to the extent of the nodes, above
/// which a warning is given.
const WARNING_DISTANCE: f64 = 3.0;
/// Smallest extent of the nodes of an interface, relative to the body, that [`WARNING_DISTANCE`] is applied to.
const MIN_RELATIVE_EXTENT: f64 = 0.05;

/// Distance of the default point of an interface from the mean of its nodes, relative to the largest
/// distance between two of them, above which a warning is given.
const MEAN_POINT_DISTANCE: f64 = 0.01;
/// Length, relative to the body, below which a distance or a coordinate counts as rounding.
const ROUNDING_LENGTH: f64 = 1e-9;

/// Replaces the definitions of reference points by positions, and adds errors for invalid ones.
pub(super) fn resolve_references(raw: &mut RawModel, used: &Nodes, found: &mut Vec<Diagnostic>) {
    let (centre, size) = centre_and_length(&used.positions);
    let body = Extent { centre, size };
    let index: HashMap<i64, u32> = raw.nodes.ids.iter().copied().zip(0..).collect();
    let positions = &raw.nodes.positions;
    for set in &mut raw.interfaces {
        let is_free = set.coupling == Some(Coupling::Free);
        if is_free && set.reference.is_stated() {
            let message = format!("interface `{}` is free, but has a reference point", set.name);
            found.push(Diagnostic::new(Code::ManifestSyntax, message));
        }
        let places = |ids: &[i64]| ids.iter().filter_map(|id| index.get(id)).copied().collect::<Vec<u32>>();
        let nodes = places(&set.nodes);
        let member_positions: Vec<[f64; 3]> = nodes.iter().map(|&node| positions[node as usize]).collect();
        match set.reference {
            Reference::Node(id) => match index.get(&id) {
                Some(&node) => set.reference = Reference::Point(positions[node as usize]),
                None => {
                    let message = format!("reference node {id} of interface `{}` is unknown", set.name);
                    found.push(Diagnostic::new(Code::InterfaceNode, message));
                }
            },
            Reference::Centre | Reference::Axis { .. } if !is_free => {
                let mut outline = places(if set.outline.is_empty() { &set.nodes } else { &set.outline });
                outline.sort_unstable();
                outline.dedup();
                let members = InterfaceNodes { nodes: &nodes, outline: &outline, positions };
                let centre = InterfaceCentre::new(&members, raw.mesh.as_ref(), &set.reference);
                found.extend(beside_the_mean(&set.name, &centre, &member_positions, body.size));
                set.reference = Reference::Default(centre.point);
            }
            _ => {}
        }
        if let Some(x) = set.reference.point() {
            let problem = impossible(&set.name, x, raw.dimension, &body);
            found.extend(problem.or_else(|| far_reference(&set.name, x, &member_positions, body.size)));
        }
    }
}

/// Extent of the nodes of a body: their mean, and the largest distance from it.
struct Extent {
    centre: [f64; 3],
    size: f64,
}

/// Returns an error for a reference point that is invalid.
fn impossible(name: &str, reference: [f64; 3], dimension: u8, body: &Extent) -> Option<Diagnostic> {
    if reference.iter().any(|x| !x.is_finite()) {
        let message = format!("reference point of interface `{name}` is not finite");
        return Some(Diagnostic::new(Code::CoordinateNotFinite, message));
    }
    if dimension == 2 && reference[2] != 0.0 {
        let message =
            format!("reference point of interface `{name}` in a plane model has z = {}", reference[2]);
        return Some(Diagnostic::new(Code::DirectionOutOfPlane, message));
    }
    let away = (Vector3::from(reference) - Vector3::from(body.centre)).norm() / body.size;
    (away.is_nan() || away > MAX_RELATIVE_DISTANCE).then(|| {
        let message = format!(
            "reference point of interface `{name}` is {away:.1e} times the size of the body away from its middle"
        );
        let help = "give the reference point in model axes and in the unit of length of the nodes";
        Diagnostic::new(Code::InterfaceCoupling, message).with_help(help)
    })
}

/// Returns a warning for a default reference point that differs from the mean of the nodes, the default of
/// earlier versions.
fn beside_the_mean(
    name: &str,
    centre: &InterfaceCentre,
    nodes: &[[f64; 3]],
    size: f64,
) -> Option<Diagnostic> {
    let away = (Vector3::from(centre.point) - Vector3::from(centre.mean)).norm();
    let extent = span(nodes);
    (away > MEAN_POINT_DISTANCE * extent && away > ROUNDING_LENGTH * size).then(|| {
        let [point, mean] = [centre.point, centre.mean].map(|x| in_words(x, size));
        let (percent, away) = (significant(100.0 * away / extent, 2), significant(away, 4));
        let message = format!(
            "interface `{name}`: the reference point is {}, at ({point}); the mean of its nodes, ({mean}), is {away} away from it, {percent} % of the extent of the nodes ({})",
            centre.origin,
            significant(extent, 4)
        );
        Diagnostic::new(Code::InterfaceCentre, message)
    })
}

/// Formats a point as `120, 0, -3.25`, with six digits; rounding relative to `size` becomes zero.
fn in_words(point: [f64; 3], size: f64) -> String {
    point.map(|x| significant(if x.abs() <= ROUNDING_LENGTH * size { 0.0 } else { x }, 6)).join(", ")
}

/// Returns a warning for a reference point that is far from its nodes compared with their extent, in a body
/// of the given size.
fn far_reference(name: &str, reference: [f64; 3], nodes: &[[f64; 3]], size: f64) -> Option<Diagnostic> {
    let (centre, radius) = match nodes {
        [] => return None,
        [only] => (*only, 0.0),
        _ => centre_and_length(nodes),
    };
    let away = (Vector3::from(reference) - Vector3::from(centre)).norm();
    let reach = radius.max(MIN_RELATIVE_EXTENT * size);
    (away > WARNING_DISTANCE * reach).then(|| {
        let message = format!(
            "reference point of interface `{name}` is {away:.3e} away from the middle of its nodes, which reach {radius:.3e} from there, in a body of {size:.3e}"
        );
        Diagnostic::new(Code::InterfaceFar, message)
    })
}
