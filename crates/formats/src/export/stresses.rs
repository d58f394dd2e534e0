//! Stresses of nodes in the modes, for formats that hold six stresses of every node.

use super::Holding::{self, Lost, NotApplicable};
use flexbody_body::flex_body::{FlexBody, Recovery};
use flexbody_motion::scene::StressPoint;
use nalgebra::Matrix3;
use std::collections::HashMap;

/// Stresses of the nodes of a file in the modes, along body axes.
pub(crate) struct NodalStresses<'b> {
    recovery: &'b Recovery,
    /// Rows of the stresses of each node of the file; `None` for a node without stresses.
    points: Vec<Option<StressPoint>>,
    /// Axes of the body in the axes of the rows.
    axes: Matrix3<f64>,
}

impl<'b> NodalStresses<'b> {
    /// Returns the stresses of the nodes with these numbers, from the first recovery that has six stresses of any of
    /// them and no second ones of the same node; `None` without such a recovery.
    pub(crate) fn new(body: &'b FlexBody, numbers: impl Iterator<Item = i64> + Clone) -> Option<Self> {
        let axes = body.frame().axes;
        body.recoveries().iter().find_map(|recovery| {
            let mut rows = HashMap::new();
            for point in StressPoint::among(&recovery.rows) {
                let node = recovery.rows[point.first_row()].node?;
                if rows.insert(node, point).is_some() {
                    return None;
                }
            }
            let points: Vec<_> = numbers.clone().map(|number| rows.get(&number).cloned()).collect();
            points.iter().any(Option::is_some).then_some(Self { recovery, points, axes })
        })
    }

    /// Returns the six stresses xx, yy, zz, xy, yz, xz of a node in mode `mode`, along body axes; zero for a node
    /// without stresses.
    pub(crate) fn in_mode(&self, node: usize, mode: usize) -> [f64; 6] {
        self.along_body(node, |row| self.recovery.modes[(row, mode)])
    }

    /// Returns the six stresses of a node of the undeformed body, along body axes.
    pub(crate) fn at_rest(&self, node: usize) -> [f64; 6] {
        self.along_body(node, |row| self.recovery.offset[row])
    }

    /// Returns true if the undeformed body has stresses.
    pub(crate) fn has_offset(&self) -> bool {
        (0..self.points.len()).any(|node| self.at_rest(node) != [0.0; 6])
    }

    fn along_body(&self, node: usize, value: impl Fn(usize) -> f64) -> [f64; 6] {
        let Some(point) = &self.points[node] else { return [0.0; 6] };
        let [xx, yy, zz, xy, yz, xz] = point.stress(value);
        let stress = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let own = self.axes.transpose() * stress * self.axes;
        [own[(0, 0)], own[(1, 1)], own[(2, 2)], own[(0, 1)], own[(1, 2)], own[(0, 2)]]
    }

    /// Returns the holding of the recoveries by a file with these stresses in the modes.
    ///
    /// * `holds_offset`: true if the file holds the stresses of the undeformed body.
    pub(crate) fn holding(found: Option<&Self>, body: &FlexBody, holds_offset: bool) -> Holding {
        let Some(own) = found else { return without_recoveries(body) };
        let mut lost = Vec::new();
        let part = body.part_of_static_columns(own.recovery);
        if part > ROUNDING {
            lost.push(format!("its static columns, up to {:.2} % of a stress at rest", 100.0 * part));
        }
        if own.has_offset() && !holds_offset {
            lost.push("the stresses of the undeformed body".to_owned());
        }
        let others: Vec<String> = body
            .recoveries()
            .iter()
            .filter(|recovery| recovery.name != own.recovery.name)
            .map(|recovery| format!("`{}`", recovery.name))
            .collect();
        if !others.is_empty() {
            lost.push(format!("the recoveries {}", others.join(", ")));
        }
        let found = own.points.iter().flatten().count();
        Holding::held_but_for((!lost.is_empty()).then(|| {
            format!(
                "has the stresses of recovery `{}` in the modes at {found} of {} nodes, without {}",
                own.recovery.name,
                own.points.len(),
                lost.join(" and ")
            )
        }))
    }
}

/// Part of the static response that counts as rounding.
const ROUNDING: f64 = 1e-9;

/// Returns the holding of the named loads by a file without any.
pub(crate) fn without_named_loads(body: &FlexBody) -> Holding {
    let names: Vec<String> = body.named_loads().iter().map(|load| format!("`{}`", load.name)).collect();
    match names.as_slice() {
        [] => NotApplicable,
        names if body.named_loads().iter().any(|load| load.preload) => {
            Lost(format!("named loads, among them preloads, which act always: {}", names.join(", ")))
        }
        names => Lost(format!("named loads: {}", names.join(", "))),
    }
}

/// Returns the holding of the recoveries by a file without any.
pub(crate) fn without_recoveries(body: &FlexBody) -> Holding {
    match body.recoveries() {
        [] => NotApplicable,
        [one] => Lost(format!("has no recoveries: `{}` is left out", one.name)),
        [one, more @ ..] => {
            Lost(format!("has no recoveries: `{}` and {} more are left out", one.name, more.len()))
        }
    }
}
