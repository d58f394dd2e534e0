//! Largest stresses at rigid interfaces, which depend on the coupling.

use super::{Peak, PointEnvelope, RecoveredMotion, RowMap};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::flex_body::FlexBody;
use flexbody_model::Coupling;
use std::collections::HashMap;

/// Returns a note for every recovery of `body` whose largest equivalent stress in `motion` is at a node of a rigid
/// interface, with the largest value away from all interfaces if the motion has the largest stresses of every point.
pub fn stresses_at_rigid_interfaces(body: &FlexBody, motion: &RecoveredMotion) -> Vec<Diagnostic> {
    let ids = &body.nodes().ids;
    // Interface of each node; a rigid one where a node belongs to several.
    let mut interfaces: HashMap<i64, (&str, bool)> = HashMap::new();
    for interface in body.interfaces() {
        let is_rigid = interface.coupling == Some(Coupling::Rigid);
        for &node in &interface.nodes {
            let known = interfaces.entry(ids[node]).or_insert((&interface.name, is_rigid));
            if is_rigid && !known.1 {
                *known = (&interface.name, true);
            }
        }
    }
    let note = |(at, map): (usize, &RowMap)| {
        let extreme = motion.extremes.get(at)?.von_mises?;
        let node_of = |point: usize| map.rows[map.points[point].first_row()].node;
        let node = node_of(extreme.place)?;
        let (interface, _) = interfaces.get(&node).filter(|(_, is_rigid)| *is_rigid)?;
        let unit = &map.points[extreme.place].unit;
        let away = match motion.envelopes.as_ref().and_then(|all| all.get(at)) {
            Some(peaks) => {
                let is_away =
                    |point: usize| node_of(point).is_none_or(|node| !interfaces.contains_key(&node));
                largest_of(peaks, is_away).map_or_else(
                    || "all points of the recovery are nodes of interfaces".to_owned(),
                    |(point, peak)| {
                        let (name, value) = (&map.points[point].name, rounded(peak.value));
                        format!(
                            "the largest value away from interfaces is {value} {unit}, {name}, at {}",
                            rounded(peak.time)
                        )
                    },
                )
            }
            None => "--envelope finds the largest value away from interfaces".to_owned(),
        };
        let message = format!(
            "recovery `{}`: the largest equivalent stress, {} {unit}, is at node {node} of the rigid interface `{interface}`, where stresses depend on the coupling (concentration at the edge of the rigid region); {away}",
            map.name,
            rounded(extreme.value)
        );
        Some(Diagnostic::new(Code::StressAtInterface, message))
    };
    motion.recoveries.iter().enumerate().filter_map(note).collect()
}

/// Returns the point with the largest equivalent stress among those that `is_counted`.
fn largest_of(peaks: &[PointEnvelope], is_counted: impl Fn(usize) -> bool) -> Option<(usize, Peak)> {
    let counted = peaks.iter().enumerate().filter(|(point, _)| is_counted(*point));
    counted
        .map(|(point, peak)| (point, peak.von_mises))
        .reduce(|a, b| if b.1.value > a.1.value { b } else { a })
}

/// Returns the value rounded to five digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}
