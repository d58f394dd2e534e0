//! Matrices, nodes and labels of a model, from tables or from a job.

use super::rows_of_model::in_order_of_nodes;
use super::with_stress::PlainStiffness;
use crate::jobs::JobModel;
use crate::sets::NodeSets;
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::text::input_file::SeenFile;
use flexbody_elements::DescribedElements;
use flexbody_model::{DofLabel, Elements, GivenRows, Nodes, RawFollowers, RawMatrix, filled_rows};
use std::borrow::Cow;
use std::collections::HashSet;
use std::path::PathBuf;

/// Role of a file of a job, and the file.
pub(super) type JobFileRead = (&'static str, SeenFile);

/// Matrices, nodes and labels of a model.
pub(super) struct ModelMatrices {
    pub stiffness: RawMatrix,
    pub mass: RawMatrix,
    pub nodes: Nodes,
    pub nodes_path: PathBuf,
    pub dofs: Option<Vec<DofLabel>>,
    pub dofs_path: PathBuf,
    pub given_rows: GivenRows,
    pub followers: Option<RawFollowers>,
    /// Node sets of a job.
    pub sets: NodeSets,
    /// Elements by which the part is drawn.
    pub elements: Elements,
    /// Elements, materials and constraints of the deck of a job, if they were requested.
    pub described: Option<DescribedElements>,
    /// Files of a job.
    pub files: Vec<JobFileRead>,
    pub diagnostics: Vec<Diagnostic>,
}

impl ModelMatrices {
    /// Returns K with the labels of its rows, for matrices that hold it with a stress.
    pub(super) fn plain(&self, dimension: u8) -> PlainStiffness<'_> {
        let labels = || in_order_of_nodes(&self.nodes, dimension);
        let labels = self.dofs.as_deref().map_or_else(|| Cow::Owned(labels()), Cow::Borrowed);
        PlainStiffness { stiffness: &self.stiffness, labels }
    }

    /// Returns the nodes with stiffness or mass; `None` if the rows have no labels and do not follow the nodes.
    pub(super) fn moving(&self, dimension: u8) -> Option<HashSet<i64>> {
        moving([&self.stiffness, &self.mass], &self.nodes.ids, self.dofs.as_deref(), dimension)
    }
}

impl From<JobModel> for ModelMatrices {
    fn from(job: JobModel) -> Self {
        let path = |role: &str| {
            let file = job.files.iter().find(|(file_role, _)| *file_role == role).or(job.files.first());
            file.map(|(_, file)| file.path.clone()).unwrap_or_default()
        };
        Self {
            nodes_path: path("deck"),
            dofs_path: path("dofs"),
            stiffness: job.stiffness,
            mass: job.mass,
            nodes: job.nodes,
            dofs: Some(job.dofs),
            given_rows: job.given_rows,
            followers: job.followers,
            sets: job.sets,
            elements: job.elements,
            described: job.described,
            files: job.files,
            diagnostics: job.diagnostics,
        }
    }
}

/// Returns the nodes with entries in any of the matrices; `None` if the rows have no labels and do not follow the nodes.
pub(super) fn moving(
    matrices: [&RawMatrix; 2],
    nodes: &[i64],
    labels: Option<&[DofLabel]>,
    dimension: u8,
) -> Option<HashSet<i64>> {
    let n = matrices[0].matrix.n_cols();
    let filled = filled_rows(matrices.map(|matrix| &matrix.matrix), n);
    let d = usize::from(dimension);
    let node_of = |row: usize| match labels {
        Some(labels) => labels.get(row).map(|label| label.node),
        None => Some(nodes[row / d]),
    };
    let known = labels.is_some() || d * nodes.len() == n;
    known.then(|| (0..n).filter(|&row| filled[row]).filter_map(node_of).collect())
}
