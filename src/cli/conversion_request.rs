//! Request of a conversion, as the command line of `convert` states it.

use super::arguments::{ConvertArguments, EnrichmentName, StatedArguments};
use super::models::of_manifest_or_job;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::convert::{Lumping, MeshChoice};
use flexbody_body::flex_body::Subset;
use flexbody_body::invariants::LumpedScheme;
use flexbody_input::{
    LoadSource, MatrixLocation, ModelFiles, NodalStressSource, StressNodesSource, read_nodal_masses,
};
use flexbody_study::conversion::ConversionRequest;
use flexbody_study::tailoring::StatedParts;
use std::path::PathBuf;

impl ConvertArguments {
    /// Returns the request, without the lumped masses, which are read from files ([`Scheme::read`]).
    ///
    /// # Errors
    /// FB801 for options that cannot be read.
    pub(super) fn request(&self) -> Result<ConversionRequest> {
        Ok(ConversionRequest {
            modes: self.modes.map(|modes| modes as usize),
            max_frequency: self.max_frequency,
            basis: self.basis,
            shapes: self.shapes.as_ref().map(MatrixLocation::parse),
            residual_vectors: self.residual_vectors.as_deref().map(load_sources).transpose()?,
            accuracy: self.accuracy,
            factor: self.factor,
            frame: self.frame.clone().unwrap_or_default(),
            lumped: Vec::new(),
            lumped_modes: self.lumped_modes,
            mesh: match (self.no_mesh, self.mesh_triangles) {
                (true, _) => MeshChoice::Without,
                (false, Some(most)) => MeshChoice::AtMost(most as usize),
                (false, None) => MeshChoice::Whole,
            },
            stress_stiffness: self.geometric_stiffness,
            storage: self.storage,
            stated: stated_parts(&self.stated)?,
            allow_unjudged: self.allow_unjudged,
            scene_file: self.scene.clone(),
        })
    }

    /// Returns the files of the model, without reading them.
    ///
    /// # Errors
    /// The errors of the manifest; FB801 for options that contradict it.
    pub(super) fn model_files(&self) -> Result<ModelFiles> {
        let mut files = match (&self.model, &self.stiffness, &self.mass, &self.nodes) {
            (Some(model), ..) => of_manifest_or_job(model, &self.job)?,
            (None, Some(stiffness), Some(mass), Some(nodes)) => {
                let (dofs, units) = (self.dofs.clone(), self.job.units.as_deref());
                self.job.state_in(ModelFiles::from_arguments(stiffness, mass, nodes, dofs, units)?)?
            }
            _ => {
                let message = "give a manifest, a job, or --stiffness, --mass and --nodes";
                return Err(Diagnostic::new(Code::Usage, message).into());
            }
        };
        files.allow_implausible = files.allow_implausible.and(self.allow_implausible.unwrap_or_default());
        files.keep_soft_rotations |= self.keep_soft_rotations;
        // The summary names what the elements would give, unless the command line leaves it out.
        files.describe_elements |= self.geometric_stiffness.is_none_or(|loads| !loads.is_empty());
        files.nodal_stresses.extend(self.stress.iter().map(|nodes| stress_at(nodes, self.stress.len())));
        Ok(files)
    }
}

/// Returns the stresses at the nodes that the command line names, as recovery `stress`, or under the name of the nodes if there
/// are several.
fn stress_at(nodes: &str, count: usize) -> NodalStressSource {
    let name = if count == 1 { "stress" } else { nodes };
    NodalStressSource { name: name.to_owned(), nodes: StressNodesSource::parse(nodes) }
}

/// Returns the parts of the body that the command line states; `None` if it states none, so that a scene selects them.
fn stated_parts(arguments: &StatedArguments) -> Result<Option<StatedParts>> {
    let StatedArguments { terms, keep_modes, fixed_interface_modes, motion_shapes, enrichment } = arguments;
    let is_fine = *enrichment == EnrichmentName::Fine;
    if !arguments.states_any() {
        if is_fine {
            let message = "--enrichment fine needs --terms, --keep-modes, --fixed-interface-modes or --motion-shapes: a selection takes the standard one";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        return Ok(None);
    }
    Ok(Some(StatedParts {
        motion_shapes: motion_shapes.map(|count| count as usize),
        subset: subset(terms.as_deref(), keep_modes.as_deref(), fixed_interface_modes.as_deref())?,
        is_fine,
    }))
}

/// Parses the modes and groups of terms that a command line states.
pub(super) fn subset(
    terms: Option<&str>,
    keep_modes: Option<&str>,
    fixed_interface_modes: Option<&str>,
) -> Result<Subset> {
    Ok(Subset {
        fixed_interface_modes: fixed_interface_modes.map(Subset::parse_some_modes).transpose()?,
        modes: keep_modes.map(Subset::parse_modes).transpose()?,
        groups: terms.map(Subset::parse_groups).transpose()?.unwrap_or_default(),
    })
}

/// Parses the loads of residual vectors named on the command line.
pub(super) fn load_sources(text: &str) -> Result<Vec<LoadSource>> {
    let mut sets = Vec::new();
    let mut names: Vec<&str> = text.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
    if names == ["none"] {
        return Ok(sets);
    }
    for text in &names {
        let (name, hertz) = LoadSource::with_frequency(text);
        let loads = match (name, name.strip_prefix("loads=")) {
            ("centrifugal", _) => LoadSource::Centrifugal,
            ("interfaces", _) => LoadSource::Interfaces,
            (_, Some(path)) if !path.is_empty() => LoadSource::File(MatrixLocation::parse(path)),
            _ => {
                let message = format!("`{text}` is not a set of loads for residual vectors");
                return Err(Diagnostic::new(Code::Usage, message)
                    .with_help("give centrifugal, interfaces or loads=FILE, separated by commas; append @HZ for the responses at a frequency")
                    .into());
            }
        };
        sets.push(loads.at(hertz));
    }
    names.sort_unstable();
    if names.windows(2).any(|pair| pair[0] == pair[1]) {
        let message = format!("loads are named twice in `{text}`");
        return Err(Diagnostic::new(Code::Usage, message).into());
    }
    Ok(sets)
}

/// Lumping scheme named on the command line.
pub(super) enum Scheme {
    Ready(Lumping),
    User(PathBuf),
}

impl Scheme {
    /// Returns the lumping, with the masses of its file.
    ///
    /// # Errors
    /// The errors of the file of masses.
    pub(super) fn read(&self) -> Result<Lumping> {
        match self {
            Self::Ready(lumping) => Ok(lumping.clone()),
            Self::User(path) => read_nodal_masses(path).map(Lumping::User),
        }
    }

    /// Returns the file of masses.
    pub(super) fn file(&self) -> Option<&PathBuf> {
        match self {
            Self::Ready(_) => None,
            Self::User(path) => Some(path),
        }
    }
}

/// Parses the lumping schemes named on the command line.
pub(super) fn lumping_schemes(text: &str) -> Result<Vec<Scheme>> {
    let mut schemes = Vec::new();
    for scheme in text.split(',').map(str::trim).filter(|scheme| *scheme != "none") {
        let (name, path) = scheme.split_once('=').map_or((scheme, None), |(name, path)| (name, Some(path)));
        schemes.push(match (LumpedScheme::from_name(name), path) {
            (Some(LumpedScheme::RowSum), None) => Scheme::Ready(Lumping::RowSum),
            (Some(LumpedScheme::DiagonalScaling), None) => Scheme::Ready(Lumping::DiagonalScaling),
            (Some(LumpedScheme::User), Some(path)) if !path.is_empty() => Scheme::User(path.into()),
            _ => {
                let message = format!("`{scheme}` is not a lumping scheme");
                return Err(Diagnostic::new(Code::LumpedScheme, message).into());
            }
        });
    }
    let mut names: Vec<&str> =
        text.split(',').map(|name| name.split('=').next().unwrap_or(name).trim()).collect();
    names.sort_unstable();
    if names.windows(2).any(|pair| pair[0] == pair[1]) {
        let message = format!("a lumping scheme is named twice in `{text}`");
        return Err(Diagnostic::new(Code::LumpedScheme, message).into());
    }
    Ok(schemes)
}
