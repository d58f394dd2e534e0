//! Reads every file of a model and collects all that is wrong with any of them.

use super::bytes::InputFile;
use super::compression::Compression;
use super::model_files::{InterfaceNodes, MatrixLocation, ModelFiles};
use super::reader::{MatrixRole, MatrixSource};
use super::readers::reader_for;
use super::tables::{read_dofs, read_masses, read_node_list, read_nodes};
use crate::base::diagnostic::{Code, Diagnostic, Severity};
use crate::base::error::{Error, Result};
use crate::base::provenance::SourceFile;
use crate::model::{Damping, GeometricStiffness, NodeSet, RawMatrix, RawModel};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Below this many significant digits a matrix is warned about.
const FEW_DIGITS: u8 = 10;

/// Reads one matrix: both triangles, whatever is stored.
///
/// # Errors
/// FB101 to FB106 and FB301 to FB313, all that are found in the file.
pub fn read_matrix(location: &MatrixLocation, role: MatrixRole) -> Result<RawMatrix> {
    read_opened(&InputFile::open(&location.path)?, location.group.as_deref(), role)
}

/// Reads all files of a model and takes their fingerprints. The model is parsed, not yet checked: sizes,
/// symmetry and mechanics are the business of [`crate::model`].
///
/// # Errors
/// Every diagnostic of every file, in the order manifest, stiffness, mass, nodes, dofs, damping, geometric
/// stiffness, interfaces.
pub fn read_model(files: &ModelFiles) -> Result<RawModel> {
    let opened = OpenFiles::new(files);
    let (parsed, fingerprints) = rayon::join(|| parse(files, &opened), || opened.fingerprints());
    let Parsed { manifest, stiffness, mass, nodes, dofs, damping, geometric_stiffness, interfaces } = parsed;

    let mut diagnostics = Vec::new();
    manifest.unwrap_or_else(|found| collect(&mut diagnostics, found));
    let stiffness = take(&mut diagnostics, stiffness);
    let mass = take(&mut diagnostics, mass);
    let nodes = take(&mut diagnostics, nodes);
    let dofs = dofs.and_then(|dofs| take(&mut diagnostics, dofs));
    let damping = damping.and_then(|damping| take(&mut diagnostics, damping));
    let geometric_stiffness =
        geometric_stiffness.into_iter().filter_map(|one| take(&mut diagnostics, one)).collect();
    let interfaces: Vec<NodeSet> =
        interfaces.into_iter().filter_map(|interface| take(&mut diagnostics, interface)).collect();
    diagnostics.extend(stiffness.as_ref().and_then(few_digits));
    let (Some(stiffness), Some(mass), Some(nodes), false) =
        (stiffness, mass, nodes, diagnostics.iter().any(|d| d.severity() == Severity::Error))
    else {
        return Err(Error::new(diagnostics));
    };
    Ok(RawModel {
        name: files.name.clone(),
        dimension: files.dimension,
        units: files.units.clone(),
        stiffness,
        mass,
        nodes,
        nodes_path: files.nodes.clone(),
        dofs,
        dofs_path: files.dofs.clone().unwrap_or_default(),
        interfaces,
        damping,
        geometric_stiffness,
        allow_implausible: files.allow_implausible,
        sources: sources(files, &fingerprints),
        diagnostics,
    })
}

/// Reads nodal masses, `node,mass`: what a multibody package would have imported.
///
/// # Errors
/// FB101 to FB106, FB203 to FB205 and FB803.
pub fn read_nodal_masses(path: &Path) -> Result<Vec<(i64, f64)>> {
    read_masses(&InputFile::open(path)?).map_err(Error::new)
}

type Found<T> = std::result::Result<T, Vec<Diagnostic>>;

struct Parsed {
    manifest: Found<()>,
    stiffness: Found<RawMatrix>,
    mass: Found<RawMatrix>,
    nodes: Found<crate::model::Nodes>,
    dofs: Option<Found<Vec<crate::model::DofLabel>>>,
    damping: Option<Found<Damping<RawMatrix>>>,
    geometric_stiffness: Vec<Found<GeometricStiffness<RawMatrix>>>,
    interfaces: Vec<Found<NodeSet>>,
}

fn parse(files: &ModelFiles, opened: &OpenFiles) -> Parsed {
    let matrix = |location: &MatrixLocation, role| {
        let file = opened.get(&location.path)?;
        read_opened(file, location.group.as_deref(), role).map_err(Error::into_diagnostics)
    };
    let ((stiffness, mass), (nodes, dofs)) = rayon::join(
        || {
            rayon::join(
                || matrix(&files.stiffness, MatrixRole::Stiffness),
                || matrix(&files.mass, MatrixRole::Mass),
            )
        },
        || {
            rayon::join(
                || read_nodes(opened.get(&files.nodes)?, files.dimension),
                || files.dofs.as_ref().map(|path| read_dofs(opened.get(path)?)),
            )
        },
    );
    let interfaces = files.interfaces.iter().map(|interface| {
        let nodes = match &interface.nodes {
            InterfaceNodes::Listed(nodes) => nodes.clone(),
            InterfaceNodes::File(path) => read_node_list(opened.get(path)?)?,
        };
        let (name, coupling, reference) = (interface.name.clone(), interface.coupling, interface.reference);
        Ok(NodeSet { name, nodes, coupling, reference })
    });
    let interfaces = interfaces.collect();
    let damping = files.damping.as_ref();
    let damping = damping.map(|d| d.borrowed().try_map(|place| matrix(place, MatrixRole::Damping)));
    let geometric_stiffness = files.geometric_stiffness.iter().map(|one| {
        let matrix = matrix(&one.matrix, MatrixRole::GeometricStiffness)?;
        Ok(GeometricStiffness { load: one.load.clone(), matrix })
    });
    let geometric_stiffness = geometric_stiffness.collect();
    let manifest = files.manifest.as_ref().map_or(Ok(()), |path| opened.get(path).map(|_| ()));
    Parsed { manifest, stiffness, mass, nodes, dofs, damping, geometric_stiffness, interfaces }
}

fn read_opened(file: &InputFile, group: Option<&str>, role: MatrixRole) -> Result<RawMatrix> {
    let compression = Compression::of(file.bytes());
    let reader = reader_for(file, compression)?;
    reader.read(&MatrixSource { file, compression, group, role })
}

/// Digits of the stiffness matrix decide how well rigid motion and bending are told apart; those of the mass
/// matrix enter results as they are, and exact short numbers are common there.
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

/// Adds what is not there yet: a file used twice is complained about once.
fn collect(diagnostics: &mut Vec<Diagnostic>, found: Vec<Diagnostic>) {
    for diagnostic in found {
        if !diagnostics.contains(&diagnostic) {
            diagnostics.push(diagnostic);
        }
    }
}

/// Every file of the model, opened once.
struct OpenFiles {
    files: Vec<(PathBuf, std::result::Result<InputFile, Diagnostic>)>,
}

impl OpenFiles {
    fn new(files: &ModelFiles) -> Self {
        let mut opened: Vec<(PathBuf, _)> = Vec::new();
        for (_, path) in roles(files) {
            if opened.iter().all(|(known, _)| known != path) {
                opened.push((path.to_path_buf(), InputFile::open(path)));
            }
        }
        Self { files: opened }
    }

    fn get(&self, path: &Path) -> Found<&InputFile> {
        let (_, file) =
            self.files.iter().find(|(known, _)| known == path).expect("every path of the model is opened");
        file.as_ref().map_err(|diagnostic| vec![diagnostic.clone()])
    }

    /// Path and SHA-256 of every file that could be opened.
    fn fingerprints(&self) -> Vec<(&Path, String)> {
        self.files
            .par_iter()
            .filter_map(|(path, file)| Some((path.as_path(), file.as_ref().ok()?.sha256())))
            .collect()
    }
}

/// Role and path of every file of the model, in the order of diagnostics and sources.
fn roles(files: &ModelFiles) -> Vec<(&'static str, &Path)> {
    let mut roles: Vec<(&'static str, &Path)> = Vec::new();
    roles.extend(files.manifest.as_deref().map(|path| ("manifest", path)));
    roles.push((MatrixRole::Stiffness.name(), &files.stiffness.path));
    roles.push((MatrixRole::Mass.name(), &files.mass.path));
    roles.push(("nodes", &files.nodes));
    roles.extend(files.dofs.as_deref().map(|path| ("dofs", path)));
    let damping = files.damping.as_ref().and_then(Damping::matrix);
    roles.extend(damping.map(|place| (MatrixRole::Damping.name(), place.path.as_path())));
    let geometric = files.geometric_stiffness.iter().map(|one| one.matrix.path.as_path());
    roles.extend(geometric.map(|path| (MatrixRole::GeometricStiffness.name(), path)));
    roles.extend(files.interfaces.iter().filter_map(|interface| match &interface.nodes {
        InterfaceNodes::File(path) => Some(("interface", path.as_path())),
        InterfaceNodes::Listed(_) => None,
    }));
    roles
}

fn sources(files: &ModelFiles, fingerprints: &[(&Path, String)]) -> Vec<SourceFile> {
    let source = |(role, path): (&str, &Path)| {
        let (_, sha256) = fingerprints.iter().find(|(known, _)| *known == path)?;
        Some(SourceFile::new(role, path, sha256.clone()))
    };
    roles(files).into_iter().filter_map(source).collect()
}
