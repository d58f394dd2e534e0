//! Comparison of interfaces: names, nodes, couplings, reference points.

use super::{BodyComparison, Pair, is_placed, relative};
use crate::mass_properties::gyration_radius;
use flexbody_body::flex_body::{FlexBody, Interface};
use flexbody_linalg::larger;
use nalgebra::Vector3;
use std::collections::BTreeSet;

impl BodyComparison {
    /// Compares the interfaces of the same names; `tolerance` applies to reference points, relative to the
    /// radius of gyration.
    pub(super) fn interfaces(&mut self, pair: &Pair<'_>, tolerance: f64) {
        let (a, b) = (pair.a.interfaces(), pair.b.interfaces());
        let neither = a.is_empty() && b.is_empty();
        if neither || self.leave_out(pair, "interfaces", "/interfaces", |body| !body.interfaces().is_empty())
        {
            return;
        }
        let mut notes = Vec::new();
        let (mut differing, mut farthest) = (0, 0.0);
        for own in a {
            let Some(other) = b.iter().find(|other| other.name == own.name) else {
                notes.push(format!("interface `{}` is in the first body only", own.name));
                differing += 1;
                continue;
            };
            let found = self.differences(pair, own, other);
            differing += usize::from(!found.is_empty());
            notes.extend(found);
            if let (Some(x), Some(y)) = (own.reference, other.reference) {
                farthest = larger(farthest, (pair.change.point(&y) - Vector3::from(x)).norm());
            }
        }
        for other in b.iter().filter(|other| a.iter().all(|own| own.name != other.name)) {
            notes.push(format!("interface `{}` is in the second body only", other.name));
            differing += 1;
        }
        let meaning =
            "number of interfaces that differ in name, nodes, coupling, or presence of a reference point";
        self.row("interfaces", meaning, differing as f64, 0.0);
        let radius = gyration_radius(pair.a.invariants());
        let origin = pair.a.frame().origin.amax().max(pair.b.frame().origin.amax());
        self.row(
            "reference points",
            "of interfaces, largest distance / radius of gyration",
            relative(farthest, radius),
            tolerance + 8.0 * f64::EPSILON * relative(origin, radius),
        );
        self.notes.extend(notes);
    }

    /// Returns the differences of two interfaces of one name in words.
    fn differences(&self, pair: &Pair<'_>, a: &Interface, b: &Interface) -> Vec<String> {
        let name = &a.name;
        let mut found = Vec::new();
        let (of_a, of_b) = (node_numbers(pair.a, a), node_numbers(pair.b, b));
        if self.same_nodes && of_a != of_b {
            let only = |x: &BTreeSet<i64>, y: &BTreeSet<i64>| x.difference(y).count();
            found.push(format!(
                "interface `{name}` has {} nodes in the first body only, {} in the second only",
                only(&of_a, &of_b),
                only(&of_b, &of_a)
            ));
        }
        let stated = |interface: &Interface| interface.coupling.map_or("not stated", |c| c.name());
        // The format of another program may not store the coupling.
        let unknown =
            |body: &FlexBody, interface: &Interface| !is_placed(body) && interface.coupling.is_none();
        if a.coupling != b.coupling && !unknown(pair.a, a) && !unknown(pair.b, b) {
            found.push(format!(
                "the coupling of interface `{name}` is `{}` in the first body and `{}` in the second",
                stated(a),
                stated(b)
            ));
        }
        if a.reference.is_some() != b.reference.is_some() {
            let whose = if a.reference.is_some() { "first" } else { "second" };
            found.push(format!("interface `{name}` has a reference point in the {whose} body only"));
        }
        found
    }
}

fn node_numbers(body: &FlexBody, interface: &Interface) -> BTreeSet<i64> {
    interface.nodes.iter().map(|&node| body.nodes().ids[node]).collect()
}
