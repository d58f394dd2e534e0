//! Reads all files of a model and collects all their problems.

use super::fe_results::{AnswerFiles, read_answers};
use super::jobs::{JobModel, read_job};
use super::labels_of_file::LabelsOfFile;
use super::mapping::Mapping;
use super::matrices::{MatrixRole, MatrixSource, reader_for};
use super::mesh::MeshReading;
use super::model_files::{
    InterfaceNodes, InterfaceSource, MatrixLocation, ModelFiles, ModelSource, NamedLoadSource,
    OperatorSource, RecoverySource,
};
use super::node_file::NodeFile;
use super::node_files::read_node_file;
use super::open_files::OpenFiles;
use super::recovery_files::{OperatorColumns, read_forces, read_offset, read_operator};
use super::rows_of_model::{by_rows_of_model, in_order_of_nodes, refuse_followers, turned};
use super::sets::NodeSets;
use super::tables::{read_node_list, read_recovery_rows};
use super::with_stress::{PlainStiffness, StressMatrix, difference_note, read_stress_matrix};
use flexbody_base::diagnostic::{Code, Diagnostic, Severity};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::{SourceFile, Sources};
use flexbody_base::text::Compression;
use flexbody_base::text::input_file::{InputFile, SeenFile};
use flexbody_base::text::quotes::without_foreign_quotes;
use flexbody_linalg::{CscMatrix, parallel};
use flexbody_model::{
    Damping, DofLabel, Elements, GeometricStiffness, GivenRows, ModelLoad, ModelRecovery, NodeSet, Nodes,
    RawFollowers, RawMatrix, RawModel, RecoveryOperator, Reference, UnitLoad, filled_rows,
};
use std::borrow::Cow;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Number of significant digits below which a matrix gets a warning.
const FEW_DIGITS: u8 = 10;

/// Reads one matrix with both triangles, whichever of them are stored.
///
/// # Errors
/// FB101 to FB106 for a file that cannot be read, FB301 to FB313 for an invalid matrix, all that are found in the file.
pub fn read_matrix(location: &MatrixLocation, role: MatrixRole) -> Result<RawMatrix> {
    read_opened(&InputFile::open_unread(&location.path)?, location.group.as_deref(), role, None)
}

/// Reads all files of a model and computes their fingerprints. The model is parsed, not checked: sizes, symmetry and
/// mechanics are checked by [`flexbody_model`].
///
/// # Errors
/// Every diagnostic of every file, in the order manifest, stiffness, mass, nodes, dofs, damping, geometric stiffness,
/// interfaces, mesh; FB132 for files that changed during reading, in place of other errors.
pub fn read_model(files: &ModelFiles) -> Result<RawModel> {
    let mut opened = OpenFiles::new(roles(files).into_iter().map(|(_, path)| path));
    let read = read_opened_files(files, &opened);
    opened.refuse_changed()?;
    let (model, of_job) = read.map_err(|error| without_outside_quotes(files, error))?;
    of_job.iter().try_for_each(|(_, file)| file.refuse_changed())?;
    opened.forget_bytes();
    let given = files.clone();
    Ok(RawModel { sources: Sources::later(move || sources(&given, &of_job, &opened)), ..model })
}

/// Returns errors for files that name other rows than those of the model.
fn misfits(named: &[LabelsOfFile], matrices: &ModelMatrices, files: &ModelFiles) -> Vec<Diagnostic> {
    let rows = matrices.plain(files.dimension).labels;
    let misfit = |one: &LabelsOfFile| match files.source {
        ModelSource::Job(_) => one.misfit_of_job(&rows),
        ModelSource::Tables(_) => one.misfit(&rows),
    };
    named.iter().filter_map(misfit).collect()
}

/// Returns the error without quotes from files that the manifest or the deck names outside the model.
fn without_outside_quotes(files: &ModelFiles, error: Error) -> Error {
    let main = match (&files.manifest, &files.source) {
        (Some(manifest), _) => manifest,
        (None, ModelSource::Job(job)) => &job.path,
        (None, ModelSource::Tables(_)) => return error,
    };
    let diagnostics = error.into_diagnostics().into_iter();
    Error::new(diagnostics.map(|diagnostic| without_foreign_quotes(diagnostic, main)).collect())
}

/// Role of a file of a job, and the file.
type JobFileRead = (&'static str, SeenFile);

/// Reads the files of a model, and the files of its job.
fn read_opened_files(files: &ModelFiles, opened: &OpenFiles) -> Result<(RawModel, Vec<JobFileRead>)> {
    let parsed = Parsed::of(files, opened);
    let mut diagnostics = Vec::new();
    if let Some(path) = &files.manifest {
        opened.get(path).map(|_| ()).unwrap_or_else(|found| collect(&mut diagnostics, found));
    }
    let matrices = match parsed.matrices {
        Matrices::Tables(tables) => tables.taken(files, &mut diagnostics),
        Matrices::Job(job) => take(&mut diagnostics, *job),
    };
    diagnostics.extend(matrices.iter().flat_map(|matrices| misfits(&parsed.labels, matrices, files)));
    // Damping and geometric stiffness follow K and M to the rows of the model.
    let no_rows = GivenRows::default();
    let rows = matrices.as_ref().map_or(&no_rows, |matrices| &matrices.given_rows);
    let damping = parsed.damping.and_then(|damping| {
        let damping = take(&mut diagnostics, damping)?;
        take(&mut diagnostics, damping.try_map(|raw| by_rows_of_model(raw, rows)))
    });
    let (geometric_stiffness, differences) =
        of_stress(parsed.geometric_stiffness, matrices.as_ref(), files.dimension, &mut diagnostics);
    // Interfaces and surface refer to the nodes.
    let places = NodeLookup::of(matrices.as_ref(), files.dimension);
    let interfaces: Vec<NodeSet> = files
        .interfaces
        .iter()
        .filter_map(|interface| take(&mut diagnostics, places.interface(interface, opened, files)))
        .collect();
    let recoveries = places.recoveries(opened, files, &mut diagnostics);
    let named_loads = read_loads(opened, files, &mut diagnostics);
    let mesh_file = parsed.mesh.and_then(|mesh| take(&mut diagnostics, mesh));
    let mesh = matrices.as_ref().map(|matrices| {
        let from = mesh_file.as_ref().zip(files.mesh.as_deref());
        MeshReading { nodes: &matrices.nodes, elements: &matrices.elements, path: &matrices.nodes_path }
            .mesh(from)
    });
    let mesh = mesh.and_then(|mesh| take(&mut diagnostics, mesh));
    diagnostics.extend(matrices.as_ref().and_then(|matrices| few_digits(&matrices.stiffness)));
    // Errors end here, with all diagnostics that were found.
    let (Some(matrices), false) = (matrices, diagnostics.iter().any(|d| d.severity() == Severity::Error))
    else {
        return Err(Error::new(diagnostics));
    };
    diagnostics.extend(matrices.diagnostics);
    diagnostics.extend(difference_note(&differences));
    let (mesh, partly) = mesh.unwrap_or_default();
    diagnostics.extend(partly);
    let model = RawModel {
        name: files.name.clone(),
        dimension: files.dimension,
        units: files.units.clone(),
        stiffness: matrices.stiffness,
        mass: matrices.mass,
        nodes: matrices.nodes,
        nodes_path: matrices.nodes_path,
        mesh,
        dofs: matrices.dofs,
        dofs_path: matrices.dofs_path,
        given_rows: matrices.given_rows,
        followers: matrices.followers,
        interfaces,
        damping,
        geometric_stiffness,
        recoveries,
        named_loads,
        allow_implausible: files.allow_implausible,
        keep_soft_rotations: files.keep_soft_rotations,
        sources: Sources::default(),
        diagnostics,
    };
    Ok((model, matrices.files))
}

/// Returns the geometric stiffness of every load that could be read; adds errors. Also returns the number of digits that
/// are left of each that is a difference of matrices, with its load.
fn of_stress(
    read: Vec<Found<GeometricStiffness<StressMatrix>>>,
    matrices: Option<&ModelMatrices>,
    dimension: u8,
    diagnostics: &mut Vec<Diagnostic>,
) -> (Vec<GeometricStiffness<RawMatrix>>, Vec<(f64, UnitLoad)>) {
    let (mut geometric_stiffness, mut differences) = (Vec::new(), Vec::new());
    for one in read {
        let (Some(one), Some(matrices)) = (take(diagnostics, one), matrices) else { continue };
        let GeometricStiffness { load, matrix } = one;
        let found = matrix.of_stress(matrices.plain(dimension), &matrices.given_rows);
        let Some(found) = take(diagnostics, found) else { continue };
        differences.extend(found.digits_left.map(|digits| (digits, load.clone())));
        geometric_stiffness.push(GeometricStiffness { load, matrix: found.matrix });
    }
    (geometric_stiffness, differences)
}

type Found<T> = std::result::Result<T, Vec<Diagnostic>>;

/// Parsed content of the files, each with its problems.
struct Parsed {
    matrices: Matrices,
    mesh: Option<Found<NodeFile>>,
    damping: Option<Found<Damping<RawMatrix>>>,
    geometric_stiffness: Vec<Found<GeometricStiffness<StressMatrix>>>,
    /// Labels of the rows of the matrices beside K, which come with tables.
    labels: Vec<LabelsOfFile>,
}

enum Matrices {
    Tables(Box<ParsedTables>),
    Job(Box<Found<ModelMatrices>>),
}

/// Matrices, nodes and labels of a model.
struct ModelMatrices {
    stiffness: RawMatrix,
    mass: RawMatrix,
    nodes: Nodes,
    nodes_path: PathBuf,
    dofs: Option<Vec<DofLabel>>,
    dofs_path: PathBuf,
    given_rows: GivenRows,
    followers: Option<RawFollowers>,
    /// Node sets of a job.
    sets: NodeSets,
    /// Elements by which the part is drawn.
    elements: Elements,
    /// Files of a job.
    files: Vec<JobFileRead>,
    diagnostics: Vec<Diagnostic>,
}

impl ModelMatrices {
    /// Returns K with the labels of its rows, for matrices that hold it with a stress.
    fn plain(&self, dimension: u8) -> PlainStiffness<'_> {
        let labels = || in_order_of_nodes(&self.nodes, dimension);
        let labels = self.dofs.as_deref().map_or_else(|| Cow::Owned(labels()), Cow::Borrowed);
        PlainStiffness { stiffness: &self.stiffness, labels }
    }

    /// Returns the nodes with stiffness or mass; `None` if the rows have no labels and do not follow the nodes.
    fn moving(&self, dimension: u8) -> Option<HashSet<i64>> {
        moving([&self.stiffness, &self.mass], &self.nodes.ids, self.dofs.as_deref(), dimension)
    }
}

/// Returns the nodes with entries in any of the matrices; `None` if the rows have no labels and do not follow the nodes.
fn moving(
    matrices: [&RawMatrix; 2],
    nodes: &[i64],
    labels: Option<&[DofLabel]>,
    dimension: u8,
) -> Option<HashSet<i64>> {
    let n = matrices[0].matrix.n_cols();
    let filled = filled_rows(matrices.map(|one| &one.matrix), n);
    let d = usize::from(dimension);
    let node_of = |row: usize| match labels {
        Some(labels) => labels.get(row).map(|label| label.node),
        None => Some(nodes[row / d]),
    };
    let known = labels.is_some() || d * nodes.len() == n;
    known.then(|| (0..n).filter(|&row| filled[row]).filter_map(node_of).collect())
}

/// Returns an interface of a model in memory: its nodes are listed, or lie in a region.
///
/// # Errors
/// FB220 for a region without nodes; FB801 for a set or a table, which a model in memory does not have.
pub fn interface_in_memory(interface: &InterfaceSource, raw: &RawModel) -> Result<NodeSet> {
    let about = |code: Code, what: &str| {
        Error::from(Diagnostic::new(code, format!("interface `{}`: {what}", interface.name)))
    };
    let nodes = match &interface.nodes {
        InterfaceNodes::Listed(nodes) => nodes.clone(),
        InterfaceNodes::Region(region) => {
            let matrices = [&raw.stiffness, &raw.mass];
            let moving = moving(matrices, &raw.nodes.ids, raw.dofs.as_deref(), raw.dimension);
            let moves = |id: i64| moving.as_ref().is_none_or(|moving| moving.contains(&id));
            let all = raw.nodes.ids.iter().copied().zip(raw.nodes.positions.iter().copied());
            let all = all.filter(|(id, _)| moves(*id));
            let nodes = region.nodes(all.clone());
            if nodes.is_empty() {
                return Err(about(Code::NodeSetUnknown, &region.empty(all)));
            }
            nodes
        }
        InterfaceNodes::File(_) | InterfaceNodes::Set(_) => {
            let what =
                "matrices in memory have neither node sets nor tables: list the nodes, or give a region";
            return Err(about(Code::Usage, what));
        }
    };
    let (name, coupling, reference) = (interface.name.clone(), interface.coupling, interface.reference);
    Ok(NodeSet { name, nodes, coupling, reference, outline: Vec::new() })
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
            files: job.files,
            diagnostics: job.diagnostics,
        }
    }
}

struct ParsedTables {
    stiffness: Found<RawMatrix>,
    mass: Found<RawMatrix>,
    nodes: Found<NodeFile>,
    dofs: Option<Found<Mapping>>,
    /// Labels of the rows in the file of the stiffness matrix, if it names them.
    labels: Option<LabelsOfFile>,
}

impl ParsedTables {
    /// Returns the tables, if all of them could be read.
    fn taken(self, files: &ModelFiles, diagnostics: &mut Vec<Diagnostic>) -> Option<ModelMatrices> {
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
            files: Vec::new(),
            diagnostics: Vec::new(),
        })
    }
}

impl Parsed {
    fn of(files: &ModelFiles, opened: &OpenFiles) -> Self {
        let matrix = |location: &MatrixLocation, role| {
            let file = opened.unread(&location.path)?;
            read_opened(file, location.group.as_deref(), role, files.keep_in.as_deref())
                .map_err(Error::into_diagnostics)
        };
        let matrices = match &files.source {
            ModelSource::Job(job) => Matrices::Job(Box::new(read_job(job).map(ModelMatrices::from))),
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
        let geometric_stiffness = files.geometric_stiffness.iter().map(|one| {
            let other = |location: &MatrixLocation| matrix(location, MatrixRole::GeometricStiffness);
            let matrix = read_stress_matrix(&one.matrix, |path| opened.get(path), other)?;
            Ok(GeometricStiffness { load: one.load.clone(), matrix })
        });
        let geometric_stiffness = geometric_stiffness.collect();
        Self { matrices, mesh, damping, geometric_stiffness, labels }
    }
}

/// Node positions and sets of a model, for interfaces that refer to them.
struct NodeLookup<'m> {
    matrices: Option<&'m ModelMatrices>,
    /// Nodes with stiffness or mass, if the rows are known.
    moving: Option<HashSet<i64>>,
}

impl<'m> NodeLookup<'m> {
    fn of(matrices: Option<&'m ModelMatrices>, dimension: u8) -> Self {
        Self { matrices, moving: matrices.and_then(|matrices| matrices.moving(dimension)) }
    }

    /// Returns the nodes of an interface, as [`node_set`](Self::node_set).
    fn interface(
        &self,
        interface: &InterfaceSource,
        opened: &OpenFiles,
        files: &ModelFiles,
    ) -> Found<NodeSet> {
        self.node_set(&format!("interface `{}`", interface.name), interface, opened, files)
    }

    /// Returns the nodes of an interface, or of one side of a cut. Regions and sets of a model that could not be read are empty; its
    /// files report the reason.
    ///
    /// * `owner`: entry of the manifest that messages name.
    fn node_set(
        &self,
        owner: &str,
        interface: &InterfaceSource,
        opened: &OpenFiles,
        files: &ModelFiles,
    ) -> Found<NodeSet> {
        let mut outline = Vec::new();
        let nodes = match &interface.nodes {
            InterfaceNodes::Listed(nodes) => nodes.clone(),
            InterfaceNodes::File(path) => read_node_list(opened.get(path)?)?,
            InterfaceNodes::Set(name) => {
                let nodes = self.of_set(owner, name, files, &mut outline)?;
                self.refuse_empty(
                    owner,
                    nodes,
                    &format!("no node of the set `{name}` has degrees of freedom"),
                    files,
                )?
            }
            InterfaceNodes::Region(region) => {
                let all = self.matrices.iter().flat_map(|matrices| {
                    matrices.nodes.ids.iter().copied().zip(matrices.nodes.positions.iter().copied())
                });
                let all = all.filter(|(id, _)| self.moves(*id));
                let nodes = region.nodes(all.clone());
                let why = if nodes.is_empty() { region.empty(all) } else { String::new() };
                self.refuse_empty(owner, nodes, &why, files)?
            }
        };
        let (name, coupling, reference) = (interface.name.clone(), interface.coupling, interface.reference);
        Ok(NodeSet { name, nodes, coupling, reference, outline })
    }

    /// Returns the recoveries of the model; adds errors and warnings.
    fn recoveries(
        &self,
        opened: &OpenFiles,
        files: &ModelFiles,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<ModelRecovery> {
        let mut read = Vec::with_capacity(files.recoveries.len());
        for one in &files.recoveries {
            if let Some((recovery, found)) = take(diagnostics, self.recovery(one, opened, files)) {
                diagnostics.extend(found);
                read.push(recovery);
            }
        }
        read
    }

    /// Returns the transposed operator by the rows of the files.
    ///
    /// # Errors
    /// FB322 for labels that are no rows of the matrices, and for labelled rows of a model whose rows are combinations of
    /// those of its files.
    fn by_matrix_rows(
        &self,
        given: OperatorColumns,
        location: &MatrixLocation,
        dimension: u8,
    ) -> Found<CscMatrix> {
        let refuse = |diagnostic: Diagnostic| vec![diagnostic.in_file(&location.path)];
        let labels = match (&given, self.matrices) {
            (OperatorColumns::Matrix(_), _) => Cow::Borrowed(&[][..]),
            (OperatorColumns::Labelled(..), Some(known)) if known.given_rows == GivenRows::default() => {
                known.plain(dimension).labels
            }
            (OperatorColumns::Labelled(..), Some(_)) => {
                let message = "DMIG operator names grids, but the rows of the model are combinations of those of its files";
                let help = "give the operator as a matrix with one column for each matrix row";
                return Err(refuse(Diagnostic::new(Code::RecoverySize, message).with_help(help)));
            }
            // The files of the model report why there are no rows.
            (OperatorColumns::Labelled(..), None) => return Err(Vec::new()),
        };
        given.by_rows(&labels).map_err(refuse)
    }

    /// Returns a recovery with an operator by the rows of the files, with shapes, or with the nodes of its cut; and
    /// warnings about it.
    fn recovery(
        &self,
        source: &RecoverySource,
        opened: &OpenFiles,
        files: &ModelFiles,
    ) -> Found<(ModelRecovery, Vec<Diagnostic>)> {
        let (name, deformed_inertia) = (source.name.clone(), source.deformed_inertia);
        match &source.operator {
            OperatorSource::Rows { operator, rows, offset } => {
                let given = read_operator(opened.get(&operator.path)?, operator.group.as_deref())?;
                let transposed = self.by_matrix_rows(given, operator, files.dimension)?;
                let labels = read_recovery_rows(opened.get(rows)?)?;
                let offset = offset.as_ref();
                let offset =
                    offset.map(|place| read_offset(opened.get(&place.path)?, place.group.as_deref()));
                let operator_path = operator.path.clone();
                let operator = RecoveryOperator::Rows { transposed, labels, offset: offset.transpose()? };
                Ok((ModelRecovery { name, operator, path: operator_path, deformed_inertia }, Vec::new()))
            }
            OperatorSource::Shapes { answers, displacements, energies, listed } => {
                let answer_files = AnswerFiles {
                    answers: opened.unread(answers)?,
                    displacements: opened.unread(displacements)?,
                    energies: energies.as_ref().map(|path| opened.unread(path)).transpose()?,
                    listed: listed.iter().map(|path| opened.unread(path)).collect::<Found<_>>()?,
                };
                let (operator, found) = read_answers(&answer_files, &files.units)?;
                Ok((ModelRecovery { name, operator, path: answers.clone(), deformed_inertia }, found))
            }
            OperatorSource::Cut { nodes, about } => {
                let (coupling, reference) = (None, Reference::Centre);
                let as_set =
                    InterfaceSource { name: name.clone(), nodes: nodes.clone(), coupling, reference };
                let nodes = self.node_set(&format!("recovery `{name}`"), &as_set, opened, files)?.nodes;
                let path = match &as_set.nodes {
                    InterfaceNodes::File(path) => path.clone(),
                    _ => files.manifest.clone().unwrap_or_default(),
                };
                let operator = RecoveryOperator::Cut { nodes, about: about.unwrap_or_default() };
                let assumed = about.is_none().then(|| {
                    let message = format!(
                        "recovery `{name}`: moments of the section are about the origin of the model"
                    );
                    Diagnostic::new(Code::SectionAbout, message).in_file(&path)
                });
                Ok((ModelRecovery { name, operator, path, deformed_inertia }, assumed.into_iter().collect()))
            }
        }
    }

    fn moves(&self, node: i64) -> bool {
        self.moving.as_ref().is_none_or(|moving| moving.contains(&node))
    }

    /// Returns the nodes of a set that have rows. `outline` receives all nodes of the set.
    fn of_set(&self, owner: &str, name: &str, files: &ModelFiles, outline: &mut Vec<i64>) -> Found<Vec<i64>> {
        let Some(matrices) = self.matrices else { return Ok(Vec::new()) };
        match matrices.sets.find(name) {
            Some(Ok(nodes)) => *outline = nodes,
            Some(Err(refused)) => return Err(vec![refused.about(owner)]),
            None => {
                let names: Vec<String> = matrices.sets.names().take(20).collect();
                let message = format!("{owner}: the model has no node set `{name}`");
                let help = if names.is_empty() {
                    "list the nodes, or give a region: the files of the model have no node sets".to_owned()
                } else {
                    format!("name one of the node sets: {}", names.join(", "))
                };
                let unknown = Diagnostic::new(Code::NodeSetUnknown, message);
                return Err(vec![said_in(files, unknown).with_help(help)]);
            }
        }
        Ok(outline.iter().copied().filter(|id| self.moves(*id)).collect())
    }

    fn refuse_empty(&self, owner: &str, nodes: Vec<i64>, why: &str, files: &ModelFiles) -> Found<Vec<i64>> {
        if nodes.is_empty() && self.matrices.is_some() {
            let message = format!("{owner}: {why}");
            return Err(vec![said_in(files, Diagnostic::new(Code::NodeSetUnknown, message))]);
        }
        Ok(nodes)
    }
}

fn said_in(files: &ModelFiles, diagnostic: Diagnostic) -> Diagnostic {
    match (&files.manifest, &files.source) {
        (Some(path), _) => diagnostic.in_file(path),
        (None, ModelSource::Job(job)) => diagnostic.in_file(&job.path),
        _ => diagnostic,
    }
}

fn read_opened(
    file: &InputFile,
    group: Option<&str>,
    role: MatrixRole,
    keep_in: Option<&Path>,
) -> Result<RawMatrix> {
    let compression = Compression::of(file.bytes());
    let reader = reader_for(file, compression)?;
    if !reader.reads_by_itself() {
        file.load()?;
    }
    let read = reader.read(&MatrixSource { file, compression, group, role, keep_in });
    // A change of the file during reading may be the cause of other problems, so it is reported first.
    file.refuse_changed()?;
    read
}

/// Returns the named loads of the model, by the rows of their files; adds errors.
fn read_loads(opened: &OpenFiles, files: &ModelFiles, diagnostics: &mut Vec<Diagnostic>) -> Vec<ModelLoad> {
    let read = |load: &NamedLoadSource| {
        let forces = read_forces(opened.get(&load.vector.path)?, load.vector.group.as_deref())?;
        let path = load.vector.path.clone();
        Ok(ModelLoad { name: load.name.clone(), forces, preload: load.preload, path })
    };
    files.named_loads.iter().filter_map(|load| take(diagnostics, read(load))).collect()
}

/// Returns a warning if the stiffness matrix has few digits. Its digits decide how well rigid motion and bending can be
/// distinguished. Those of the mass matrix enter results unchanged, and exact short numbers are common there.
fn few_digits(stiffness: &RawMatrix) -> Option<Diagnostic> {
    (stiffness.digits < FEW_DIGITS).then(|| {
        let message =
            format!("values of the stiffness matrix carry only {} significant digits", stiffness.digits);
        Diagnostic::new(Code::MatrixDigits, message).in_file(&stiffness.path)
    })
}

fn take<T>(diagnostics: &mut Vec<Diagnostic>, found: Found<T>) -> Option<T> {
    found.map_err(|list| collect(diagnostics, list)).ok()
}

/// Adds the diagnostics that are not in the list yet: a file that is used twice is reported once.
fn collect(diagnostics: &mut Vec<Diagnostic>, found: Vec<Diagnostic>) {
    for diagnostic in found {
        if !diagnostics.contains(&diagnostic) {
            diagnostics.push(diagnostic);
        }
    }
}

/// Returns role and path of every file of the model, in the order of diagnostics and sources.
fn roles(files: &ModelFiles) -> Vec<(&'static str, &Path)> {
    let mut roles: Vec<(&'static str, &Path)> = Vec::new();
    roles.extend(files.manifest.as_deref().map(|path| ("manifest", path)));
    if let Some(tables) = files.tables() {
        roles.push((MatrixRole::Stiffness.name(), &tables.stiffness.path));
        roles.push((MatrixRole::Mass.name(), &tables.mass.path));
        roles.push(("nodes", &tables.nodes));
        roles.extend(tables.dofs.as_deref().map(|path| ("dofs", path)));
    }
    roles.extend(files.mesh.as_deref().map(|path| ("mesh", path)));
    let damping = files.damping.as_ref().and_then(Damping::matrix);
    roles.extend(damping.map(|place| (MatrixRole::Damping.name(), place.path.as_path())));
    let geometric = files.geometric_stiffness.iter().flat_map(|one| one.matrix.files());
    roles.extend(geometric.map(|path| (MatrixRole::GeometricStiffness.name(), path)));
    roles.extend(files.interfaces.iter().filter_map(|interface| match &interface.nodes {
        InterfaceNodes::File(path) => Some(("interface", path.as_path())),
        _ => None,
    }));
    roles.extend(files.named_loads.iter().map(|load| ("named_load", load.vector.path.as_path())));
    roles.extend(files.recoveries.iter().flat_map(RecoverySource::files).map(|path| ("recovery", path)));
    roles
}

/// Returns every file with its fingerprint: the manifest, the files of a job, then the others. Files that were not read
/// completely are read one after the other: a thread that waits for [`Sources`] must not get other work from the pool,
/// which may request the same.
///
/// # Errors
/// FB101 for files that cannot be read, FB132 for files that changed.
fn sources(
    files: &ModelFiles,
    job: &[JobFileRead],
    opened: &OpenFiles,
) -> std::result::Result<Vec<SourceFile>, Diagnostic> {
    let mut of_tables = Vec::new();
    for (role, path) in roles(files) {
        if let Ok(file) = opened.unread(path) {
            let sha256 = file.sha256()?;
            // The manifest was parsed before the other files were opened.
            if role == "manifest" && files.manifest_sha256.as_ref().is_some_and(|parsed| *parsed != sha256) {
                return Err(file.changed("its text is another one"));
            }
            of_tables.push(SourceFile::new(role, path, sha256));
        }
    }
    let of_job = job.iter().map(|(role, file)| SourceFile::new(role, &file.path, file.sha256.clone()));
    let (manifest, others): (Vec<_>, Vec<_>) =
        of_tables.into_iter().partition(|source| source.role == "manifest");
    Ok(manifest.into_iter().chain(of_job).chain(others).collect())
}
