//! Values at the nodes of a body that colour its picture: equivalent stresses of its modes, or the largest ones of a
//! motion.

use super::drawing::Drawing;
use super::initial_view::MarkedPlace;
use super::packed::Packed;
use crate::notation::numbers::significant;
use flexbody_body::flex_body::{FlexBody, Recovery};
use flexbody_motion::scene::{CasePeak, Envelope, RecoveryEnvelope, StressPoint};
use serde::Serialize;
use std::collections::HashMap;

/// Integer that stands for the largest value of a set.
const STEPS: f64 = 32767.0;
/// Integer that stands for a node without a value.
const UNKNOWN: i16 = -1;

/// Values that colour a picture: one set for each mode, or a single one.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    label: String,
    unit: String,
    is_per_mode: bool,
    sets: Vec<ValueSet>,
}

/// Values at all nodes of a body.
#[derive(Debug, Clone)]
struct ValueSet {
    /// Value at each node; NaN at nodes without one.
    values: Vec<f64>,
    /// Index of the node with the largest value.
    node: usize,
    /// Place and time of the largest value in words.
    words: String,
}

/// Values of a page for its script.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct ShownField<'f> {
    label: &'f str,
    unit: &'f str,
    is_per_mode: bool,
    sets: Vec<ShownSet>,
}

#[derive(Serialize)]
struct ShownSet {
    largest: f64,
    /// Undeformed position of the node with the largest value, in model coordinates.
    place: [f64; 3],
    /// Vertex of this node; `None` if the page does not draw the node.
    vertex: Option<u32>,
    words: String,
}

impl Field {
    /// Returns the equivalent stresses of the first `modes` modes, each for a largest displacement of one unit of length.
    ///
    /// # Errors
    /// The reason why the recovery cannot be drawn.
    pub(crate) fn of_modes(body: &FlexBody, recovery: &Recovery, modes: usize) -> Result<Self, String> {
        let points = StressPoint::among(&recovery.rows);
        let places = Places::of(body);
        let node_of = |point: &StressPoint| recovery.rows[point.first_row()].node;
        places.refuse_undrawable(
            points.iter().map(|point| (node_of(point), recovery.rows[point.first_row()].element)),
        )?;
        let set = |j: usize| {
            let size = body.largest_displacement(j);
            let size = if size > 0.0 { 1.0 / size } else { 0.0 };
            let stress = |point: &StressPoint| {
                size * StressPoint::von_mises_of(&point.stress(|row| recovery.modes[(row, j)]))
            };
            let (values, _) =
                places.largest(body.n_nodes(), points.iter().map(|own| (node_of(own), stress(own))));
            ValueSet::new(values, |node| format!("at node {}", body.nodes().ids[node]))
        };
        let [point, length] = [&points[0].unit, body.units().length.name()];
        Ok(Self {
            label: format!("{}: von Mises", recovery.name),
            unit: format!("{point} per {length} of the largest displacement"),
            is_per_mode: true,
            sets: (0..modes.min(body.n_modes())).map(set).collect(),
        })
    }

    /// Returns the largest equivalent stresses of a recovery over a motion, or over several load cases (`scope`, as in
    /// "the run").
    ///
    /// # Errors
    /// The reason why the recovery cannot be drawn.
    pub(crate) fn of_envelope(
        body: &FlexBody,
        envelope: &Envelope,
        recovery: &RecoveryEnvelope,
        scope: &str,
    ) -> Result<Self, String> {
        let places = Places::of(body);
        places.refuse_undrawable(recovery.points.iter().map(|point| (point.node, point.element)))?;
        let all = recovery.points.iter().map(|point| (point.node, point.von_mises.value));
        let (values, points) = places.largest(body.n_nodes(), all);
        let time = body.units().time.name();
        let words = |node: usize| {
            let point = &recovery.points[points[node]];
            let CasePeak { time: at, .. } = point.von_mises;
            let case = envelope.case_of(&point.von_mises);
            let case = case.map_or_else(String::new, |case| format!(" of load case `{case}`"));
            format!("at node {}, at {} {time}{case}", body.nodes().ids[node], significant(at, 6))
        };
        Ok(Self {
            label: format!("{}: largest von Mises of {scope}", recovery.name),
            unit: recovery.points[0].unit.clone(),
            is_per_mode: false,
            sets: vec![ValueSet::new(values, words)],
        })
    }

    /// Returns the number of sets of values.
    pub(crate) fn sets(&self) -> usize {
        self.sets.len()
    }

    /// Returns the name of the values.
    #[cfg(feature = "hdf5")]
    pub(crate) fn label(&self) -> &str {
        &self.label
    }

    /// Returns the largest value of a single set with its unit, place and time: `surface: largest von Mises of the run:
    /// 412 MPa at node 17, at 0.01 s`; `None` for values of modes.
    pub(crate) fn in_words(&self) -> Option<String> {
        let set = self.sets.first().filter(|_| !self.is_per_mode)?;
        let value = significant(set.largest(), 4);
        Some(format!("{}: {value} {} {}", self.label, self.unit, set.words))
    }

    /// Returns values, unit, and index of the node with the largest value of a field with one set.
    pub(super) fn single(&self) -> Option<(&[f64], &str, usize)> {
        let set = self.sets.first().filter(|_| !self.is_per_mode)?;
        Some((&set.values, &self.unit, set.node))
    }

    /// Returns the place of the largest value of the first set; `None` without values.
    pub(super) fn marked(&self, body: &FlexBody, drawing: &Drawing<'_>) -> Option<MarkedPlace> {
        let set = self.sets.first().filter(|set| !set.words.is_empty())?;
        let position = body.frame().to_model(body.nodes().positions[set.node]);
        Some(MarkedPlace { position, vertex: drawing.vertex(set.node) })
    }

    /// Returns the texts and numbers of the page.
    pub(super) fn shown(&self, body: &FlexBody, drawing: &Drawing<'_>) -> ShownField<'_> {
        let set = |set: &ValueSet| ShownSet {
            largest: set.largest(),
            place: body.frame().to_model(body.nodes().positions[set.node]),
            vertex: drawing.vertex(set.node),
            words: set.words.clone(),
        };
        ShownField {
            label: &self.label,
            unit: &self.unit,
            is_per_mode: self.is_per_mode,
            sets: self.sets.iter().map(set).collect(),
        }
    }

    /// Returns the values at the drawn nodes, set by set, in steps of the largest value of their set.
    fn packed<'f>(&'f self, drawing: &'f Drawing<'_>) -> impl Iterator<Item = i16> + 'f {
        self.sets.iter().flat_map(|set| {
            let largest = set.largest();
            drawing.nodes().iter().map(move |&node| in_steps(set.values[node as usize], largest))
        })
    }
}

/// Returns a value from 0 to `largest` as an integer.
#[allow(clippy::cast_possible_truncation)] // values are clamped to the range
fn in_steps(value: f64, largest: f64) -> i16 {
    match value.is_nan() {
        true => UNKNOWN,
        false if largest > 0.0 => (value / largest * STEPS).round().clamp(0.0, STEPS) as i16,
        false => 0,
    }
}

impl ValueSet {
    fn new(values: Vec<f64>, words: impl Fn(usize) -> String) -> Self {
        let known = (0..values.len()).filter(|&node| !values[node].is_nan());
        let node = known.fold(None, |best: Option<usize>, node| match best {
            Some(best) if values[best] >= values[node] => Some(best),
            _ => Some(node),
        });
        let words = node.map_or_else(String::new, words);
        Self { values, node: node.unwrap_or(0), words }
    }

    fn largest(&self) -> f64 {
        self.values.get(self.node).copied().filter(|value| value.is_finite()).unwrap_or(0.0)
    }
}

/// Places of the nodes of a body by their numbers.
struct Places(HashMap<i64, usize>);

impl Places {
    fn of(body: &FlexBody) -> Self {
        Self(body.nodes().ids.iter().copied().zip(0..).collect())
    }

    /// Returns the largest value at each of `n` nodes, NaN without a value, and the point that has it.
    fn largest(&self, n: usize, points: impl Iterator<Item = (Option<i64>, f64)>) -> (Vec<f64>, Vec<usize>) {
        let (mut values, mut of) = (vec![f64::NAN; n], vec![0; n]);
        for (point, (node, value)) in points.enumerate() {
            let Some(&at) = node.and_then(|node| self.0.get(&node)) else { continue };
            // Several elements may have a point at this node.
            if values[at].is_nan() || value > values[at] {
                (values[at], of[at]) = (value, point);
            }
        }
        (values, of)
    }

    /// Refuses points of which none is a node of the body.
    fn refuse_undrawable(
        &self,
        points: impl Iterator<Item = (Option<i64>, Option<i64>)>,
    ) -> Result<(), String> {
        let all: Vec<(Option<i64>, Option<i64>)> = points.collect();
        let is_known = |(node, _): &(Option<i64>, _)| node.is_some_and(|node| self.0.contains_key(&node));
        if all.iter().any(is_known) {
            return Ok(());
        }
        Err(match all.first() {
            None => "no six of its rows are the stresses xx, yy, zz, xy, yz, xz of one point",
            Some((None, Some(_))) => "its points belong to elements, and only nodes are drawn",
            Some((None, None)) => "its rows have no nodes (column node)",
            Some((Some(_), _)) => "its nodes are not nodes of the body",
        }
        .to_owned())
    }
}

/// Fields of a picture, and the recoveries that cannot be drawn, with reasons.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fields {
    pub drawn: Vec<Field>,
    pub left_out: Vec<String>,
}

impl Fields {
    /// Returns the stresses of the modes of the first recovery that can be drawn.
    pub(crate) fn of_modes(body: &FlexBody, modes: usize) -> Self {
        let mut own = Self::default();
        for recovery in body.recoveries() {
            if own.drawn.is_empty() {
                own.add(&recovery.name, Field::of_modes(body, recovery, modes));
            }
        }
        own
    }

    /// Returns the largest stresses of every recovery over each of `envelopes`, which have a scope ("the run").
    pub(crate) fn of_envelopes(body: &FlexBody, envelopes: &[(String, &Envelope)]) -> Self {
        let mut own = Self::default();
        for (scope, envelope) in envelopes {
            for recovery in &envelope.recoveries {
                own.add(&recovery.name, Field::of_envelope(body, envelope, recovery, scope));
            }
        }
        own
    }

    fn add(&mut self, name: &str, field: Result<Field, String>) {
        match field {
            Ok(field) => self.drawn.push(field),
            Err(reason) => {
                let words = format!("recovery {name} is not drawn: {reason}");
                if !self.left_out.contains(&words) {
                    self.left_out.push(words);
                }
            }
        }
    }

    /// Returns the number of sets of values of all fields.
    pub(crate) fn sets(&self) -> usize {
        self.drawn.iter().map(Field::sets).sum()
    }

    /// Returns the values at the drawn nodes, field by field, as the page reads them; `None` without a field.
    pub(crate) fn array(&self, drawing: &Drawing<'_>) -> Option<Packed> {
        let values = self.drawn.iter().flat_map(|field| field.packed(drawing));
        (!self.drawn.is_empty()).then(|| Packed::i16("values", values))
    }
}
