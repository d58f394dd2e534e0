//! Content of the files of a model as read, each with its problems.

use super::diagnostics::take;
use super::labels_of_file::LabelsOfFile;
use super::mapping::Mapping;
use super::matrix::read_opened;
use super::model_matrices::ModelMatrices;
use super::open_files::OpenFiles;
use super::rows_of_model::{in_order_of_nodes, refuse_followers, turned};
use super::with_stress::{StressMatrix, read_stress_matrix};
use crate::jobs::read_job;
use crate::matrices::MatrixRole;
use crate::model_files::{MatrixLocation, ModelFiles, ModelSource};
use crate::node_file::NodeFile;
use crate::node_files::read_node_file;
use flexbody_base::diagnostic::{Diagnosed, Diagnostic};
use flexbody_base::error::Error;
use flexbody_linalg::parallel;
use flexbody_model::{Damping, GeometricStiffness, GivenRows, RawMatrix};

/// Parsed content of the files, each with its problems.
pub(super) struct Parsed {
    pub matrices: Matrices,
    pub mesh: Option<Diagnosed<NodeFile>>,
    pub damping: Option<Diagnosed<Damping<RawMatrix>>>,
    pub geometric_stiffness: Vec<Diagnosed<GeometricStiffness<StressMatrix>>>,
    /// Labels of the rows of the matrices beside K, which come with tables.
    pub labels: Vec<LabelsOfFile>,
}

/// Matrices, nodes and labels by their source.
pub(super) enum Matrices {
    Tables(Box<ParsedTables>),
    Job(Box<Diagnosed<ModelMatrices>>),
}

/// Content of the tables of a model.
pub(super) struct ParsedTables {
    stiffness: Diagnosed<RawMatrix>,
    mass: Diagnosed<RawMatrix>,
    nodes: Diagnosed<NodeFile>,
    dofs: Option<Diagnosed<Mapping>>,
    /// Labels of the rows in the file of the stiffness matrix, if it names them.
    labels: Option<LabelsOfFile>,
}

impl ParsedTables {
    /// Returns the tables, if all of them could be read.
    pub(super) fn taken(
        self,
        files: &ModelFiles,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<ModelMatrices> {
        let stiffness = take(diagnostics, self.stiffness);
        let mass = take(diagnostics, self.mass);
        let nodes = take(diagnostics, self.nodes);
        let dofs = match self.dofs {
            Some(dofs) => Some(take(diagnostics, dofs)?),
            None => None,
        };
        let tables = files.tables().expect("tables were read");
        let (stiffness, mass, nodes) = (stiffness?, mass?, nodes?);
        let NodeFile { nodes, sets, elements, followers, axes } = nodes;
        let dofs_path = tables.dofs.clone().unwrap_or_default();
        let dofs = match dofs {
            Some(mapping) => Some(take(diagnostics, mapping.labels(stiffness.matrix.n_rows(), &dofs_path))?),
            None => None,
        };
        let named = self.labels.as_ref();
        diagnostics.extend(named.zip(dofs.as_ref()).and_then(|(named, stated)| named.misfit(stated)));
        let dofs = dofs.or(self.labels.map(|named| named.labels));
        let (mut stiffness, mut mass, mut given_rows) = (stiffness, mass, GivenRows::default());
        if !followers.is_empty() || !axes.is_empty() {
            let labels = dofs.clone().unwrap_or_else(|| in_order_of_nodes(&nodes, files.dimension));
            take(diagnostics, refuse_followers(&followers, &labels, &tables.nodes))?;
            ([stiffness, mass], given_rows) = take(diagnostics, turned([stiffness, mass], &labels, axes))?;
        }
        Some(ModelMatrices {
            stiffness,
            mass,
            nodes,
            nodes_path: tables.nodes.clone(),
            dofs,
            dofs_path,
            given_rows,
            followers: None,
            sets,
            elements,
            described: None,
            files: Vec::new(),
            diagnostics: Vec::new(),
        })
    }
}

impl Parsed {
    /// Reads all files of a model that do not depend on others.
    pub(super) fn of(files: &ModelFiles, opened: &OpenFiles) -> Self {
        let matrix = |location: &MatrixLocation, role| {
            let file = opened.unread(&location.path)?;
            read_opened(file, location.group.as_deref(), role, files.keep_in.as_deref())
                .map_err(Error::into_diagnostics)
        };
        let matrices = match &files.source {
            ModelSource::Job(job) => {
                // Files of elements stand in place of the deck.
                let describe = files.describes_elements() && files.elements.is_empty();
                Matrices::Job(Box::new(read_job(job, describe).map(ModelMatrices::from)))
            }
            ModelSource::Tables(tables) => {
                let ((stiffness, mass), (nodes, dofs)) = parallel::join(
                    || {
                        parallel::join(
                            || matrix(&tables.stiffness, MatrixRole::Stiffness),
                            || matrix(&tables.mass, MatrixRole::Mass),
                        )
                    },
                    || {
                        parallel::join(
                            || read_node_file(opened.get(&tables.nodes)?, files.dimension),
                            || tables.dofs.as_ref().map(|path| Mapping::read(opened.get(path)?)),
                        )
                    },
                );
                let labels = LabelsOfFile::of(&tables.stiffness, MatrixRole::Stiffness, opened);
                Matrices::Tables(Box::new(ParsedTables { stiffness, mass, nodes, dofs, labels }))
            }
        };
        let labels = LabelsOfFile::of_others(files, opened);
        let mesh = files.mesh.as_ref().map(|path| read_node_file(opened.get(path)?, files.dimension));
        let damping = files.damping.as_ref();
        let damping = damping.map(|d| d.borrowed().try_map(|place| matrix(place, MatrixRole::Damping)));
        let geometric_stiffness = files.geometric_stiffness.iter().map(|stiffness| {
            let other = |location: &MatrixLocation| matrix(location, MatrixRole::GeometricStiffness);
            let matrix = read_stress_matrix(&stiffness.matrix, |path| opened.get(path), other)?;
            Ok(GeometricStiffness { load: stiffness.load.clone(), matrix })
        });
        let geometric_stiffness = geometric_stiffness.collect();
        Self { matrices, mesh, damping, geometric_stiffness, labels }
    }
}
