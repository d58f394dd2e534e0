//! Reference points of interfaces: where they lie, and whether they can lie there.

use super::{Coupling, Nodes, RawModel, Reference, centre_and_length};
use crate::base::diagnostic::{Code, Diagnostic};
use nalgebra::Vector3;
use std::collections::HashMap;

/// Distance of a reference point from the middle of the nodes, relative to their largest, beyond which it is
/// a mistake, of units as a rule. Rotations about a point so far away lose four digits.
const FARTHEST: f64 = 100.0;

/// Distance from the middle of its nodes, relative to how far these reach, beyond which a reference point is
/// asked about; nodes closer together than this part of the body count as if they reached so far.
const REACH: f64 = 3.0;
const SMALLEST: f64 = 0.05;

/// Puts the places of reference points in place of what says where they are, and complains about those that
/// cannot be.
pub(super) fn resolve_references(raw: &mut RawModel, used: &Nodes, found: &mut Vec<Diagnostic>) {
    let (centre, size) = centre_and_length(&used.positions);
    let places: HashMap<i64, [f64; 3]> =
        raw.nodes.ids.iter().copied().zip(raw.nodes.positions.iter().copied()).collect();
    for set in &mut raw.interfaces {
        let name = &set.name;
        if set.coupling == Some(Coupling::Free) && set.reference != Reference::Mean {
            let message = format!("interface `{name}` is free, but has a reference point");
            found.push(Diagnostic::new(Code::ManifestSyntax, message));
        }
        match set.reference {
            Reference::Node(id) => match places.get(&id) {
                Some(&place) => set.reference = Reference::Point(place),
                None => {
                    let message = format!("reference node {id} of interface `{name}` is unknown");
                    found.push(Diagnostic::new(Code::InterfaceNode, message));
                }
            },
            Reference::Mean if set.coupling != Some(Coupling::Free) => {
                let positions: Vec<[f64; 3]> =
                    set.nodes.iter().filter_map(|id| places.get(id)).copied().collect();
                set.reference = Reference::Point(centre_and_length(&positions).0);
            }
            Reference::Mean | Reference::Point(_) => {}
        }
        if let Reference::Point(x) = set.reference {
            if x.iter().any(|x| !x.is_finite()) {
                let message = format!("reference point of interface `{name}` is not finite");
                found.push(Diagnostic::new(Code::CoordinateNotFinite, message));
            } else if raw.dimension == 2 && x[2] != 0.0 {
                let message =
                    format!("reference point of interface `{name}` in a plane model has z = {}", x[2]);
                found.push(Diagnostic::new(Code::DirectionOutOfPlane, message));
            } else {
                let away = (Vector3::from(x) - Vector3::from(centre)).norm() / size;
                if away.is_nan() || away > FARTHEST {
                    let message = format!(
                        "reference point of interface `{name}` is {away:.1e} times the size of the body away from its middle"
                    );
                    let help = "it is in model axes and in the unit of length of the nodes";
                    found.push(Diagnostic::new(Code::InterfaceCoupling, message).with_help(help));
                } else {
                    let own = set.nodes.iter().filter_map(|id| places.get(id)).copied().collect::<Vec<_>>();
                    found.extend(far_reference(name, x, &own, size));
                }
            }
        }
    }
}

/// A warning for a reference point that lies far from the nodes beside their own size, in a body of this
/// size.
fn far_reference(name: &str, reference: [f64; 3], nodes: &[[f64; 3]], size: f64) -> Option<Diagnostic> {
    let (centre, radius) = match nodes {
        [] => return None,
        [only] => (*only, 0.0),
        _ => centre_and_length(nodes),
    };
    let away = (Vector3::from(reference) - Vector3::from(centre)).norm();
    let reach = radius.max(SMALLEST * size);
    (away > REACH * reach).then(|| {
        let message = format!(
            "reference point of interface `{name}` is {away:.3e} away from the middle of its nodes, which reach {radius:.3e} from there, in a body of {size:.3e}"
        );
        Diagnostic::new(Code::InterfaceFar, message)
    })
}
