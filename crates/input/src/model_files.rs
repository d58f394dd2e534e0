//! Which files make up a model.

use super::jobs::JobFile;
use super::region::Region;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::units::UnitSystem;
use flexbody_model::{Coupling, Damping, GeometricStiffness, Reference};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The files of one model and what is said about them, from a manifest or from the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFiles {
    /// Name of the model.
    pub name: String,
    /// 3 or 2.
    pub dimension: u8,
    /// Units of the numbers in the files.
    pub units: UnitSystem,
    /// Whether findings that a person has looked at are warnings: see [`RawModel`](flexbody_model::RawModel).
    pub allow_implausible: bool,
    /// Where matrices, nodes and labels come from.
    pub source: ModelSource,
    /// File whose elements the part is drawn by, where it is not the one of the nodes.
    pub mesh: Option<PathBuf>,
    /// Named node sets.
    pub interfaces: Vec<InterfaceSource>,
    /// Damping, where it is given.
    pub damping: Option<Damping<MatrixLocation>>,
    /// Geometric stiffness of unit loads.
    pub geometric_stiffness: Vec<GeometricStiffness<MatrixLocation>>,
    /// Loads whose static responses are to join the modes.
    pub residual_vectors: Vec<LoadSource>,
    /// The manifest, when there is one.
    pub manifest: Option<PathBuf>,
    /// SHA-256 of the manifest as it was parsed, lowercase hex.
    pub manifest_sha256: Option<String>,
    /// The folder in which the numbers of K and M are kept, in files that go with them, instead of in memory:
    /// those of sorted compressed columns in HDF5. `None`: all are held in memory.
    pub keep_in: Option<PathBuf>,
}

/// Where matrices, nodes and labels of a model come from.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelSource {
    /// A file each.
    Tables(TableFiles),
    /// What an FE program has written.
    Job(JobFile),
}

/// Matrices and tables in files of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct TableFiles {
    /// Stiffness matrix K.
    pub stiffness: MatrixLocation,
    /// Mass matrix M.
    pub mass: MatrixLocation,
    /// Node table.
    pub nodes: PathBuf,
    /// Labels of the matrix rows; without it node-major x, y, z in the order of the node table.
    pub dofs: Option<PathBuf>,
}

/// An interface and where its nodes are listed.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceSource {
    /// Name, unique within the model.
    pub name: String,
    /// Nodes of the interface.
    pub nodes: InterfaceNodes,
    /// How it is coupled to its reference point, where that is said.
    pub coupling: Option<Coupling>,
    /// Reference point of the interface.
    pub reference: Reference,
}

/// Nodes of an interface.
#[derive(Debug, Clone, PartialEq)]
pub enum InterfaceNodes {
    /// Node numbers in the manifest.
    Listed(Vec<i64>),
    /// A table with the column `node`.
    File(PathBuf),
    /// A node set of the job, by its name in any case.
    Set(String),
    /// Nodes that lie in a region.
    Region(Region),
}

/// Loads of residual vectors and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub enum LoadSource {
    /// The six centrifugal loads.
    Centrifugal,
    /// Unit forces and torques at every interface.
    Interfaces,
    /// Nodal forces by matrix rows in a file.
    File(MatrixLocation),
    /// Loads whose responses at a frequency are wanted instead of the static ones.
    At {
        /// The loads, not these again.
        loads: Box<LoadSource>,
        /// Positive; in hertz.
        hertz: f64,
    },
}

impl LoadSource {
    /// The same loads at a frequency; static at zero.
    pub fn at(self, hertz: f64) -> Self {
        if hertz == 0.0 { self } else { Self::At { loads: Box::new(self), hertz } }
    }

    /// The file that they come from.
    pub fn file(&self) -> Option<&MatrixLocation> {
        match self {
            Self::Centrifugal | Self::Interfaces => None,
            Self::File(location) => Some(location),
            Self::At { loads, .. } => loads.file(),
        }
    }

    /// `NAME@HZ` in its parts; the frequency is zero where the text names none.
    ///
    /// ```
    /// use flexbody_input::LoadSource;
    /// assert_eq!(LoadSource::with_frequency("interfaces@500"), ("interfaces", 500.0));
    /// assert_eq!(LoadSource::with_frequency("loads=at@home.npy"), ("loads=at@home.npy", 0.0));
    /// ```
    pub fn with_frequency(text: &str) -> (&str, f64) {
        let parts = text.rsplit_once('@').and_then(|(name, hertz)| Some((name, hertz.parse::<f64>().ok()?)));
        parts.filter(|(_, hertz)| hertz.is_finite() && *hertz >= 0.0).unwrap_or((text, 0.0))
    }
}

/// A matrix file and, for formats that hold several matrices, the group within it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MatrixLocation {
    /// The file.
    pub path: PathBuf,
    /// Group within the file, with its leading `/`; `None`: the only one, or the one named after its role.
    pub group: Option<String>,
}

impl MatrixLocation {
    /// Reads `FILE` or `FILE:/group`. A single letter before the `:/` is a Windows drive, not a file.
    ///
    /// ```
    /// use flexbody_input::MatrixLocation;
    /// let location = MatrixLocation::parse("C:/models/beam.h5:/fe/K");
    /// assert_eq!(location.path.to_str(), Some("C:/models/beam.h5"));
    /// assert_eq!(location.group.as_deref(), Some("/fe/K"));
    /// assert_eq!(MatrixLocation::parse("C:/K.mtx").group, None);
    /// ```
    pub fn parse(text: impl AsRef<OsStr>) -> Self {
        let text = text.as_ref();
        if let Some((file, group)) = text.to_str().and_then(|t| t.rsplit_once(":/")) {
            let drive = file.len() == 1 && file.starts_with(|c: char| c.is_ascii_alphabetic());
            if !file.is_empty() && !drive {
                return Self { path: file.into(), group: Some(format!("/{group}")) };
            }
        }
        Self { path: text.into(), group: None }
    }

    /// The same, with a relative path taken from `folder`.
    pub fn relative_to(mut self, folder: &Path) -> Self {
        self.path = folder.join(self.path);
        self
    }
}

impl std::fmt::Display for MatrixLocation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.path.display())?;
        self.group.as_ref().map_or(Ok(()), |group| write!(f, ":{group}"))
    }
}

impl ModelFiles {
    /// The files of the matrices and tables; `None` of a job.
    pub fn tables(&self) -> Option<&TableFiles> {
        match &self.source {
            ModelSource::Tables(tables) => Some(tables),
            ModelSource::Job(_) => None,
        }
    }

    /// Every file that they name, but those of [`ModelFiles::residual_vectors`], which a conversion may
    /// replace. Of a job, the main file and those beside it that have its name.
    pub fn paths(&self) -> Vec<PathBuf> {
        let interfaces = self.interfaces.iter().filter_map(|interface| match &interface.nodes {
            InterfaceNodes::File(path) => Some(path.clone()),
            _ => None,
        });
        let damping = self.damping.as_ref().and_then(Damping::matrix).map(|place| place.path.clone());
        let geometric = self.geometric_stiffness.iter().map(|one| one.matrix.path.clone());
        let own = match &self.source {
            ModelSource::Tables(TableFiles { stiffness, mass, nodes, dofs }) => {
                [&stiffness.path, &mass.path, nodes].into_iter().chain(dofs).cloned().collect()
            }
            ModelSource::Job(job) => job.family(),
        };
        own.into_iter()
            .chain(self.manifest.clone())
            .chain(self.mesh.clone())
            .chain(damping)
            .chain(geometric)
            .chain(interfaces)
            .collect()
    }

    /// The job of an FE program without a manifest, named after its main file; `units` as in
    /// [`ModelFiles::from_arguments`].
    ///
    /// # Errors
    /// FB202 when the units are not three known ones.
    pub fn from_job(
        path: impl Into<PathBuf>,
        program: Option<String>,
        interfaces: Vec<InterfaceSource>,
        units: Option<&str>,
    ) -> Result<Self> {
        let path = path.into();
        let (name, job) = (stem(&path), JobFile { path, program, matrices: None });
        let own = Self::of(name, ModelSource::Job(job), units)?;
        Ok(Self { interfaces, ..own })
    }

    fn of(name: String, source: ModelSource, units: Option<&str>) -> Result<Self> {
        Ok(Self {
            name,
            dimension: 3,
            units: units.map_or_else(|| Ok(UnitSystem::default()), parse_units)?,
            allow_implausible: false,
            source,
            mesh: None,
            interfaces: Vec::new(),
            damping: None,
            geometric_stiffness: Vec::new(),
            residual_vectors: Vec::new(),
            manifest: None,
            manifest_sha256: None,
            keep_in: None,
        })
    }

    /// A three-dimensional model without a manifest, named after its stiffness file; `units` is
    /// `length,mass,time` as in `m,kg,s`.
    ///
    /// # Errors
    /// FB202 when the units are not three known ones.
    pub fn from_arguments(
        stiffness: impl AsRef<OsStr>,
        mass: impl AsRef<OsStr>,
        nodes: impl Into<PathBuf>,
        dofs: Option<PathBuf>,
        units: Option<&str>,
    ) -> Result<Self> {
        let stiffness = MatrixLocation::parse(stiffness);
        let name = stem(&stiffness.path);
        let tables = TableFiles { stiffness, mass: MatrixLocation::parse(mass), nodes: nodes.into(), dofs };
        Self::of(name, ModelSource::Tables(tables), units)
    }
}

/// Units as a command line names them: `length,mass,time`.
///
/// # Errors
/// FB202 when they are not three known ones.
pub fn parse_units(text: &str) -> Result<UnitSystem> {
    let names: Vec<&str> = text.split(',').map(str::trim).collect();
    let &[length, mass, time] = names.as_slice() else {
        let message = format!("units are `{text}`, expected length,mass,time as in `mm,t,s`");
        return Err(Diagnostic::new(Code::ManifestUnit, message).into());
    };
    UnitSystem::parse(length, mass, time).map_err(|unknown| {
        Diagnostic::new(Code::ManifestUnit, format!("unit of {unknown} is not known")).into()
    })
}

/// File name up to its first dot.
pub(super) fn stem(path: &Path) -> String {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    match name.split('.').next() {
        Some(stem) if !stem.is_empty() => stem.to_owned(),
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_told_from_drives() {
        for (text, path, group) in [
            ("K.h5:/K", "K.h5", Some("/K")),
            ("K.h5:/", "K.h5", Some("/")),
            ("C:/K.mtx", "C:/K.mtx", None),
            ("C:\\x\\K.h5:/fe/K", "C:\\x\\K.h5", Some("/fe/K")),
            ("c:/a.h5:/K", "c:/a.h5", Some("/K")),
            ("dir/K.mtx", "dir/K.mtx", None),
            (":/K", ":/K", None),
        ] {
            let location = MatrixLocation::parse(text);
            assert_eq!((location.path.to_str(), location.group.as_deref()), (Some(path), group), "{text}");
            assert_eq!(location.to_string(), text);
        }
    }

    #[test]
    fn units_on_the_command_line() {
        let files = |units| ModelFiles::from_arguments("d/K.mtx.gz", "M.mtx", "n.csv", None, units);
        let model = files(Some("mm, t,s")).unwrap();
        assert_eq!((model.name.as_str(), model.units.mass.to_si()), ("K", 1000.0));
        assert!(!files(None).unwrap().units.stated);
        for bad in ["mm,t", "mm,t,s,K", "mm,stone,s", "mm,-1,s", ""] {
            assert!(files(Some(bad)).unwrap_err().has(Code::ManifestUnit), "{bad}");
        }
    }
}
