//! Means among the stresses at nodes: over elements of several materials, and over the corners of elements.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::text::InputFile;

/// Number of nodes that a message names.
const MAX_NAMED: usize = 5;

/// Number of a node and six stresses at it.
pub(super) type NodeStress = (i64, [f64; 6]);

/// Means among the stresses at nodes.
#[derive(Debug, Default)]
pub(super) struct Averaged {
    /// Nodes whose stresses are means over elements of several materials.
    pub over_materials: Vec<i64>,
    over_corners: Option<CornerMeans>,
}

/// Means over the corners of elements.
#[derive(Debug, Clone, Copy)]
struct CornerMeans {
    /// Number of nodes with several corners.
    nodes: usize,
    /// Largest difference of a corner from the mean, relative to the largest stress of its step, and its node.
    spread: f64,
    at: i64,
}

impl Averaged {
    /// Adds the means of one step over corners.
    ///
    /// * `corners`: node and stresses of every corner, by ascending nodes.
    /// * `means`: node and mean of each of these nodes, in the same order.
    pub(super) fn add_step(&mut self, corners: &[NodeStress], means: &[NodeStress]) {
        let largest =
            corners.iter().flat_map(|(_, values)| values).fold(0.0, |most: f64, value| most.max(value.abs()));
        let groups = corners.chunk_by(|one, other| one.0 == other.0);
        let mut nodes = 0;
        for (corners, (node, mean)) in groups.zip(means).filter(|(corners, _)| corners.len() > 1) {
            nodes += 1;
            let apart = |values: &[f64; 6]| (0..6).map(|k| (values[k] - mean[k]).abs()).fold(0.0, f64::max);
            let apart = corners.iter().map(|(_, values)| apart(values)).fold(0.0, f64::max);
            let spread = if apart > 0.0 { apart / largest } else { 0.0 };
            if self.over_corners.is_none_or(|known| spread > known.spread) {
                self.over_corners = Some(CornerMeans { nodes, spread, at: *node });
            }
        }
        self.over_corners = self.over_corners.map(|means| CornerMeans { nodes, ..means });
    }

    /// Returns a warning about nodes between materials and a note about means over corners.
    pub(super) fn diagnostics(&self, file: &InputFile) -> Vec<Diagnostic> {
        let mut found = Vec::new();
        if !self.over_materials.is_empty() {
            let mut nodes = self.over_materials.clone();
            nodes.sort_unstable();
            let named: Vec<String> = nodes.iter().take(MAX_NAMED).map(i64::to_string).collect();
            let more = if nodes.len() > named.len() { ", ..." } else { "" };
            let message = format!(
                "stresses of {} nodes are means over elements of several materials: node {}{more}",
                nodes.len(),
                named.join(", ")
            );
            found.push(Diagnostic::new(Code::RecoveryAveraged, message));
        }
        if let Some(CornerMeans { nodes, spread, at }) = self.over_corners {
            let message = format!(
                "stresses of {nodes} nodes are means over the corners of their elements, which differ from the mean by up to {:.2} % of the largest stress, at node {at}",
                100.0 * spread
            );
            found.push(Diagnostic::new(Code::RecoveryCorners, message));
        }
        found.into_iter().map(|diagnostic| diagnostic.in_file(file.path())).collect()
    }
}
