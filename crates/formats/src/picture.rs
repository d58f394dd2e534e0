//! Shared code of pictures of a body: the drawn points, lines and triangles, the names of modes, the played
//! motion.

use crate::export::frames::{ExportFrame, frames};
use crate::export::{ExportOptions, Points};
use faer::MatRef;
use flexbody_body::flex_body::{FlexBody, SurfaceMesh, is_static};
use flexbody_file::RecordedMotion;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::collections::HashMap;

/// Points of a body with their motion in every mode: nodes in the order of the body, then the reference
/// points of interfaces that are no nodes.
pub(crate) struct Drawn<'b> {
    body: &'b FlexBody,
    /// Indices of the nodes, ascending.
    nodes: Vec<usize>,
    references: Vec<ExportFrame>,
    mesh: Option<SurfaceMesh>,
}

impl<'b> Drawn<'b> {
    /// Returns the nodes of the surface, or all nodes of a body without a surface.
    pub(crate) fn surface(body: &'b FlexBody) -> Self {
        Self::of(body, surface_nodes(body), Vec::new())
    }

    /// Returns the nodes of the surface with the nodes and reference points of the interfaces, or the places
    /// named by `points`.
    pub(crate) fn places(body: &'b FlexBody, points: &Points) -> Self {
        let mut nodes = match points {
            Points::Usual => {
                let held = body.interfaces().iter().flat_map(|interface| interface.nodes.iter().copied());
                surface_nodes(body).into_iter().chain(held).collect()
            }
            Points::Nodes => (0..body.n_nodes()).collect(),
            Points::Interfaces | Points::InterfacesAnd(_) | Points::Some(_) => indices(body, points.named()),
        };
        let mut references = match points {
            Points::Some(_) => Vec::new(),
            _ if body.interfaces().is_empty() => Vec::new(),
            _ => frames(body, &Points::Interfaces),
        };
        let of_nodes: Vec<i64> = references.iter().map(|frame| frame.id).collect();
        let of_nodes = indices(body, &of_nodes);
        references.retain(|frame| of_nodes.iter().all(|&node| body.nodes().ids[node] != frame.id));
        nodes.extend(of_nodes);
        Self::of(body, nodes, references)
    }

    fn of(body: &'b FlexBody, mut nodes: Vec<usize>, references: Vec<ExportFrame>) -> Self {
        nodes.sort_unstable();
        nodes.dedup();
        let numbers: Vec<i64> = nodes.iter().map(|&node| body.nodes().ids[node]).collect();
        let mesh = body.mesh().and_then(|mesh| mesh.among(&body.nodes().ids, &numbers));
        Self { body, nodes, references, mesh }
    }

    /// Returns the number of points.
    pub(crate) fn len(&self) -> usize {
        self.nodes.len() + self.references.len()
    }

    /// Returns the numbers of the points.
    pub(crate) fn numbers(&self) -> Vec<i64> {
        let nodes = self.nodes.iter().map(|&node| self.body.nodes().ids[node]);
        nodes.chain(self.references.iter().map(|frame| frame.id)).collect()
    }

    /// Returns the undeformed positions in model coordinates. Unit: length.
    pub(crate) fn positions(&self) -> Vec<[f64; 3]> {
        let nodes = self.nodes.iter().map(|&node| self.body.nodes().positions[node]);
        let all = nodes.chain(self.references.iter().map(|frame| frame.position));
        all.map(|x| self.body.frame().to_model(x)).collect()
    }

    /// Returns the displacements in mode `j`, model axes.
    pub(crate) fn shape(&self, j: usize) -> Vec<[f64; 3]> {
        let shape = self.body.modes().shape.as_ref();
        let nodes = self.nodes.iter().map(|&node| turned(self.axes(), shape, 3 * node, j));
        let references =
            self.references.iter().map(|frame| turned(self.axes(), frame.translation.as_ref(), 0, j));
        nodes.chain(references).collect()
    }

    /// Returns the rotations in mode `j`, zero for points without rotations; `None` for a body whose nodes
    /// have none.
    pub(crate) fn rotation(&self, j: usize) -> Option<Vec<[f64; 3]>> {
        let rotation = self.body.modes().rotation.as_ref()?.as_ref();
        let nodes = self.nodes.iter().map(|&node| turned(self.axes(), rotation, 3 * node, j));
        let reference = |frame: &ExportFrame| match &frame.rotation {
            Some(own) => turned(self.axes(), own.as_ref(), 0, j),
            None => [0.0; 3],
        };
        Some(nodes.chain(self.references.iter().map(reference)).collect())
    }

    /// Returns the triangles as point indices, counterclockwise seen from outside.
    pub(crate) fn triangles(&self) -> &[[u32; 3]] {
        self.mesh.as_ref().map_or(&[], |mesh| mesh.triangles())
    }

    /// Returns the lines as point indices.
    pub(crate) fn edges(&self) -> &[[u32; 2]] {
        self.mesh.as_ref().map_or(&[], |mesh| mesh.edges())
    }

    /// Returns the points that belong to no triangle and no line.
    pub(crate) fn loose(&self) -> Vec<u32> {
        let drawn = self.mesh.as_ref().map_or_else(Vec::new, SurfaceMesh::drawn_nodes);
        let mut drawn = drawn.into_iter().peekable();
        (0..self.len())
            .filter_map(|i| u32::try_from(i).ok())
            .filter(|i| drawn.next_if_eq(i).is_none())
            .collect()
    }

    /// Returns the name of each interface with a mark (0 or 1) for each point that is one of its nodes.
    pub(crate) fn interfaces(&self) -> Vec<(&'b str, Vec<u8>)> {
        let mut all = Vec::new();
        for interface in self.body.interfaces() {
            let mut marks = vec![0; self.len()];
            for at in interface.nodes.iter().filter_map(|node| self.nodes.binary_search(node).ok()) {
                marks[at] = 1;
            }
            all.push((interface.name.as_str(), marks));
        }
        all
    }

    /// Returns a mark (0 or 1) for each point that is a reference point and no node; `None` without such
    /// points.
    pub(crate) fn references(&self) -> Option<Vec<u8>> {
        let nodes = self.nodes.iter().map(|_| 0);
        (!self.references.is_empty()).then(|| nodes.chain(self.references.iter().map(|_| 1)).collect())
    }

    fn axes(&self) -> &Matrix3<f64> {
        &self.body.frame().axes
    }
}

/// Returns the vector of column `j` that begins in row `row`, in model axes.
fn turned(axes: &Matrix3<f64>, of: MatRef<'_, f64>, row: usize, j: usize) -> [f64; 3] {
    (axes * Vector3::from_fn(|k, _| of[(row + k, j)])).into()
}

fn surface_nodes(body: &FlexBody) -> Vec<usize> {
    match body.mesh() {
        Some(mesh) => mesh.drawn_nodes().into_iter().map(|node| node as usize).collect(),
        None => (0..body.n_nodes()).collect(),
    }
}

/// Returns the indices of the nodes with these numbers.
fn indices(body: &FlexBody, numbers: &[i64]) -> Vec<usize> {
    let index: HashMap<i64, usize> = body.nodes().ids.iter().copied().zip(0..).collect();
    numbers.iter().filter_map(|number| index.get(number).copied()).collect()
}

// Names of modes in pictures, and names of files.

/// Number of significant digits of a frequency.
const DIGITS: usize = 5;

/// Returns `mode_001 (123.4 Hz)` for each of the first `count` modes, or `mode_021 (residual vector: tip x)`
/// for a static shape, whose frequency is no resonance.
pub(crate) fn mode_names(body: &FlexBody, count: usize) -> Vec<String> {
    let width = body.n_modes().to_string().len().max(3);
    let name = |(j, hertz): (usize, &f64)| {
        let origin = body.modes().provenance.get(j).map(String::as_str).unwrap_or_default();
        let what = if is_static(origin) { printable(origin) } else { format!("{} Hz", rounded(*hertz)) };
        format!("mode_{:0width$} ({what})", j + 1)
    };
    body.frequencies_hz().iter().enumerate().take(count).map(name).collect()
}

/// Returns a text of a body for a picture file. Characters that XML forbids or that control a terminal are
/// replaced.
pub(crate) fn printable(text: &str) -> String {
    let strange = |c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|c| if strange(c) { '\u{fffd}' } else { c }).collect()
}

/// Returns advice on the file name if viewers, which detect formats by the extension, would not recognise it.
pub(crate) fn named(options: &ExportOptions, extension: &str) -> Option<String> {
    let name = options.name.as_ref()?;
    let known = name.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
    let wanted = name.with_extension(extension);
    let wanted = wanted.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    (!known).then(|| format!("viewers recognise this format by the extension of the file: name it {wanted}"))
}

/// Returns a number with a few digits.
pub(crate) fn rounded(value: f64) -> String {
    let text = format!("{value:.*e}", DIGITS - 1);
    match text.parse::<f64>() {
        Ok(value) if value == 0.0 || (1e-3..1e7).contains(&value) => value.to_string(),
        Ok(value) => format!("{value:e}"),
        Err(_) => text,
    }
}

// A motion for playback in pictures.

/// Selected output times of a motion.
pub(crate) struct Played<'m> {
    motion: &'m RecordedMotion,
    /// Indices of the selected times.
    chosen: Vec<usize>,
}

impl<'m> Played<'m> {
    /// Selects at most `most` output times of a motion.
    pub(crate) fn new(motion: &'m RecordedMotion, most: usize) -> Self {
        Self { motion, chosen: motion.some_instants(most) }
    }

    /// Returns the name of the scene.
    pub(crate) fn scene(&self) -> &'m str {
        &self.motion.scene
    }

    /// Returns the number of selected times.
    pub(crate) fn len(&self) -> usize {
        self.chosen.len()
    }

    /// Returns a selected time.
    pub(crate) fn time(&self, instant: usize) -> f64 {
        self.motion.time[self.chosen[instant]]
    }

    /// Returns the duration from the first to the last selected time.
    pub(crate) fn duration(&self) -> f64 {
        self.len().checked_sub(1).map_or(0.0, |last| self.time(last) - self.time(0))
    }

    /// Returns the modal coordinates at a selected time.
    pub(crate) fn q(&self, instant: usize) -> &'m [f64] {
        let (at, modes) = (self.chosen[instant], self.motion.modes);
        &self.motion.q[at * modes..(at + 1) * modes]
    }

    /// Returns the origin of the frame at a selected time, world axes.
    pub(crate) fn origin(&self, instant: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.motion.origins[3 * self.chosen[instant]..][..3])
    }

    /// Returns the rotation from the model axes, which turn with the body, to the world axes.
    pub(crate) fn attitude(&self, instant: usize) -> UnitQuaternion<f64> {
        let [w, i, j, k] = [0, 1, 2, 3].map(|part| self.motion.attitudes[4 * self.chosen[instant] + part]);
        UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 0.0).unwrap_or_default()
    }

    /// Returns the origin of the frame in model coordinates.
    pub(crate) fn origin_in_model(&self) -> Vector3<f64> {
        self.motion.origin_in_model.into()
    }

    /// Returns the positions of points at a selected time, and their deflections from the undeformed body,
    /// both in world axes; `shapes` are the shapes of the modes in the picture.
    pub(crate) fn places(
        &self,
        instant: usize,
        positions: &[[f64; 3]],
        shapes: &[Vec<[f64; 3]>],
    ) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let (q, turn, origin) = (self.q(instant), self.attitude(instant), self.origin(instant));
        let deflection = |point: usize| -> Vector3<f64> {
            shapes.iter().zip(q).map(|(shape, q)| Vector3::from(shape[point]) * *q).sum()
        };
        let one = |(point, x): (usize, &[f64; 3])| -> ([f64; 3], [f64; 3]) {
            let u = turn * deflection(point);
            let rigid = origin + turn * (Vector3::from(*x) - self.origin_in_model());
            ((rigid + u).into(), u.into())
        };
        positions.iter().enumerate().map(one).unzip()
    }

    /// Returns the number of times in words: `all 101 instants`, `50 of 101 instants`.
    pub(crate) fn in_words(&self) -> String {
        match (self.len(), self.motion.time.len()) {
            (some, all) if some == all => format!("all {all} instants"),
            (some, all) => format!("{some} of {all} instants"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_have_five_digits() {
        for (value, text) in [
            (123.4, "123.4"),
            (1_234_567.0, "1234600"),
            (0.012_345_678, "0.012346"),
            (1e-9, "1e-9"),
            (0.0, "0"),
            (3.0e15, "3e15"),
        ] {
            assert_eq!(rounded(value), text);
        }
    }

    #[test]
    fn what_xml_cannot_hold_is_replaced() {
        assert_eq!(printable("a\u{1}b\n\u{fffe}é"), "a\u{fffd}b\u{fffd}\u{fffd}é");
    }
}
