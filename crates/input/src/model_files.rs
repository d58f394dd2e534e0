//! The files of a model.

use super::element_source::ElementSource;
use super::jobs::{JobFile, family};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_base::units::UnitSystem;
use flexbody_linalg::ties::{first_smallest, sort_ascending};
use flexbody_model::{Accepted, Coupling, Damping, Description, GeometricStiffness, Reference};
use libm::hypot;
use nalgebra::Vector3;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Files of a model with their settings, from a manifest or from the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFiles {
    /// Name of the model and units of the numbers in the files.
    pub description: Description,
    /// Number of dimensions: 3 or 2.
    pub dimension: u8,
    /// Checks whose findings are warnings because the user accepted them: see [`RawModel`](flexbody_model::RawModel).
    pub allow_implausible: Accepted,
    /// True if soft rotations stay as K has them: see [`RawModel`](flexbody_model::RawModel).
    pub keep_soft_rotations: bool,
    /// Source of matrices, nodes and labels.
    pub source: ModelSource,
    /// File whose elements draw the part, if it is not the file of the nodes.
    pub mesh: Option<PathBuf>,
    /// True if the elements of the deck of a job are described in the model, also without stresses at nodes.
    pub describe_elements: bool,
    /// Files of elements, materials and constraints of which K is assembled; in place of the deck of a job.
    pub elements: Vec<ElementSource>,
    /// Named node sets.
    pub interfaces: Vec<InterfaceSource>,
    /// Damping, if it is given.
    pub damping: Option<Damping<MatrixLocation>>,
    /// Geometric stiffness of unit loads.
    pub geometric_stiffness: Vec<GeometricStiffness<StressStiffnessSource>>,
    /// Rows to read off the body.
    pub recoveries: Vec<RecoverySource>,
    /// Stresses at nodes, from the elements of the deck.
    pub nodal_stresses: Vec<NodalStressSource>,
    /// Nodal forces with a name.
    pub named_loads: Vec<NamedLoadSource>,
    /// Loads whose static responses join the modes.
    pub residual_vectors: Vec<LoadSource>,
    /// Path of the manifest, if there is one.
    pub manifest: Option<PathBuf>,
    /// SHA-256 of the manifest as it was parsed, in lowercase hex.
    pub manifest_sha256: Option<String>,
    /// Folder in which the numbers of K and M are stored, in temporary files instead of in memory. This applies to
    /// sorted compressed columns in HDF5. `None`: all numbers are held in memory.
    pub keep_in: Option<PathBuf>,
}

/// Source of matrices, nodes and labels of a model.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelSource {
    /// One file each.
    Tables(TableFiles),
    /// Output of an FE program.
    Job(JobFile),
}

/// Matrices and tables in separate files.
#[derive(Debug, Clone, PartialEq)]
pub struct TableFiles {
    /// Stiffness matrix K.
    pub stiffness: MatrixLocation,
    /// Mass matrix M.
    pub mass: MatrixLocation,
    /// Node table.
    pub nodes: PathBuf,
    /// Labels of the matrix rows; without it rows are node-major x, y, z in the order of the node table.
    pub dofs: Option<PathBuf>,
}

/// Interface and the source of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceSource {
    /// Name, unique within the model.
    pub name: String,
    /// Nodes of the interface.
    pub nodes: InterfaceNodes,
    /// Coupling to the reference point, if it is given.
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

/// Nodal forces with a name, and their file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedLoadSource {
    /// Name, unique within the model.
    pub name: String,
    /// File of the forces, one value for each matrix row of the model.
    pub vector: MatrixLocation,
    /// True if the load acts always with amplitude 1.
    pub preload: bool,
}

/// Stresses at nodes, from the elements of the deck, as a recovery.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalStressSource {
    /// Name of the recovery, unique within the model.
    pub name: String,
    /// Nodes whose stresses are wanted.
    pub nodes: StressNodesSource,
}

/// Nodes whose stresses are wanted, by name.
#[derive(Debug, Clone, PartialEq)]
pub enum StressNodesSource {
    /// All nodes of elements.
    All,
    /// Nodes on the surface.
    Surface,
    /// A node set of the job, by its name in any case.
    Set(String),
}

impl StressNodesSource {
    /// Returns the nodes that a text names: `nodes`, `surface`, or the name of a set.
    pub fn parse(text: &str) -> Self {
        match text {
            "nodes" => Self::All,
            "surface" => Self::Surface,
            name => Self::Set(name.to_owned()),
        }
    }
}

/// Rows to read off the body, and the files of their operator.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoverySource {
    /// Name, unique within the model.
    pub name: String,
    /// Source of the operator.
    pub operator: OperatorSource,
    /// True for static columns of the inertia of the deformation.
    pub deformed_inertia: bool,
}

/// Source of the operator of a recovery.
#[derive(Debug, Clone, PartialEq)]
pub enum OperatorSource {
    /// Matrix R, one row per row of the recovery and one column per matrix row of the model.
    Rows {
        /// File of R.
        operator: MatrixLocation,
        /// Table of the labels of the rows.
        rows: PathBuf,
        /// File of the values of the undeformed body.
        offset: Option<MatrixLocation>,
    },
    /// Answers of an FE program to shapes.
    Shapes {
        /// Stresses and displacements of every shape.
        answers: PathBuf,
        /// Displacements of all nodes in the shapes.
        displacements: PathBuf,
        /// Printed results with the strain energies of the shapes.
        energies: Option<PathBuf>,
        /// Files that the answers or the displacements list (.pvd).
        listed: Vec<PathBuf>,
    },
    /// Section forces of the nodes on one side of a cut.
    Cut {
        /// Nodes on this side.
        nodes: InterfaceNodes,
        /// Point that the moments are about; `None` if none is stated, which means the origin.
        about: Option<[f64; 3]>,
    },
}

/// Matrix of a stress: K_geo, or K with the stress.
#[derive(Debug, Clone, PartialEq)]
pub struct StressStiffnessSource {
    /// File of the matrix.
    pub location: MatrixLocation,
    /// Properties of a matrix that holds K and the stiffness of the stress; `None` for K_geo.
    pub with_stress: Option<WithStress>,
}

/// Stress of a matrix that holds K as well.
#[derive(Debug, Clone, PartialEq)]
pub struct WithStress {
    /// Number of units of the load whose stress the matrix has, positive.
    pub load_size: f64,
    /// Labels of the rows as CalculiX writes them (.dof); `None` for a matrix with the rows of K.
    pub dofs: Option<PathBuf>,
}

impl WithStress {
    /// Creates the properties of the matrix in `file`: a `.sti` of CalculiX, packed or not, has a `.dof` with its labels
    /// beside it.
    pub fn new(file: &Path, load_size: f64) -> Self {
        let has = |path: &Path, wanted: &str| {
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
        };
        let is_packed = has(file, "gz") || has(file, "zst");
        let unpacked = if is_packed { file.with_extension("") } else { file.to_path_buf() };
        let dofs = has(&unpacked, "sti").then(|| unpacked.with_extension("dof"));
        Self { load_size, dofs }
    }
}

impl StressStiffnessSource {
    /// Returns the files of the matrix.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let dofs = self.with_stress.as_ref().and_then(|with| with.dofs.as_deref());
        std::iter::once(self.location.path.as_path()).chain(dofs)
    }
}

/// Loads of residual vectors and their source.
#[derive(Debug, Clone, PartialEq)]
pub enum LoadSource {
    /// The six centrifugal loads.
    Centrifugal,
    /// Unit forces and torques at every interface.
    Interfaces,
    /// Nodal forces by matrix rows in a file.
    File(MatrixLocation),
    /// Loads whose responses at a frequency replace the static ones.
    At {
        /// Loads without a frequency.
        loads: Box<LoadSource>,
        /// Frequency in hertz, positive.
        hertz: f64,
    },
}

impl RecoverySource {
    /// Returns the files of the recovery.
    pub fn files(&self) -> Vec<&Path> {
        match &self.operator {
            OperatorSource::Rows { operator, rows, offset } => {
                let offset = offset.as_ref().map(|offset| offset.path.as_path());
                [operator.path.as_path(), rows.as_path()].into_iter().chain(offset).collect()
            }
            OperatorSource::Shapes { answers, displacements, energies, listed } => {
                let named = [answers.as_path(), displacements].into_iter().chain(energies.as_deref());
                named.chain(listed.iter().map(PathBuf::as_path)).collect()
            }
            OperatorSource::Cut { nodes: InterfaceNodes::File(path), .. } => vec![path],
            OperatorSource::Cut { .. } => Vec::new(),
        }
    }
}

impl LoadSource {
    /// Returns the loads at a frequency; at zero hertz the static loads themselves.
    pub fn at(self, hertz: f64) -> Self {
        if hertz == 0.0 { self } else { Self::At { loads: Box::new(self), hertz } }
    }

    /// Returns the file of the loads, if they come from one.
    pub fn file(&self) -> Option<&MatrixLocation> {
        match self {
            Self::Centrifugal | Self::Interfaces => None,
            Self::File(location) => Some(location),
            Self::At { loads, .. } => loads.file(),
        }
    }

    /// Splits `NAME@HZ` into its parts; the frequency is zero if the text names none.
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

/// Matrix file and, for formats with several matrices, the group within it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MatrixLocation {
    /// The file.
    pub path: PathBuf,
    /// Group within the file, with its leading `/`; `None` for the only one, or the one named after its role.
    pub group: Option<String>,
}

impl MatrixLocation {
    /// Parses `FILE` or `FILE:/group`. A single letter before the `:/` is a Windows drive, not a file. After the extensions
    /// `.op4`, `.pch` and `.mat`, whose matrices have names and no folders, the `/` may be missing.
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
        if let Some((file, name)) = text.to_str().and_then(|t| t.rsplit_once(':')) {
            let lower = file.to_lowercase();
            if [".op4", ".pch", ".mat"].iter().any(|ending| lower.ends_with(ending)) && !name.is_empty() {
                return Self { path: file.into(), group: Some(format!("/{name}")) };
            }
        }
        Self { path: text.into(), group: None }
    }

    /// Returns the location with a relative path taken from `folder`.
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
    /// Returns true if the elements of the deck are needed: for stresses at nodes, or as requested.
    pub(crate) fn describes_elements(&self) -> bool {
        self.describe_elements || !self.nodal_stresses.is_empty()
    }

    /// Returns the files of the matrices and tables; `None` for a job.
    pub fn tables(&self) -> Option<&TableFiles> {
        match &self.source {
            ModelSource::Tables(tables) => Some(tables),
            ModelSource::Job(_) => None,
        }
    }

    /// Returns every named file except those of [`ModelFiles::residual_vectors`], which a conversion may replace. For a
    /// job these are the main file and the files in its folder with its name.
    pub fn paths(&self) -> Vec<PathBuf> {
        let interfaces = self.interfaces.iter().filter_map(|interface| match &interface.nodes {
            InterfaceNodes::File(path) => Some(path.clone()),
            _ => None,
        });
        let damping = self.damping.as_ref().and_then(Damping::matrix).map(|place| place.path.clone());
        let geometric = self.geometric_stiffness.iter().flat_map(|stiffness| stiffness.matrix.files());
        let geometric = geometric.map(Path::to_path_buf);
        let paths = match &self.source {
            ModelSource::Tables(TableFiles { stiffness, mass, nodes, dofs }) => {
                [&stiffness.path, &mass.path, nodes].into_iter().chain(dofs).cloned().collect()
            }
            ModelSource::Job(job) => family(job),
        };
        paths
            .into_iter()
            .chain(self.manifest.clone())
            .chain(self.mesh.clone())
            .chain(self.elements.iter().map(|elements| elements.path.clone()))
            .chain(damping)
            .chain(geometric)
            .chain(interfaces)
            .chain(self.recoveries.iter().flat_map(RecoverySource::files).map(Path::to_path_buf))
            .chain(self.named_loads.iter().map(|load| load.vector.path.clone()))
            .collect()
    }

    /// Creates the files of a job of an FE program without a manifest, named after its main file. `units` is as in
    /// [`ModelFiles::from_arguments`].
    ///
    /// # Errors
    /// FB202 if the units are not three known ones.
    pub fn from_job(
        path: impl Into<PathBuf>,
        program: Option<String>,
        interfaces: Vec<InterfaceSource>,
        units: Option<&str>,
    ) -> Result<Self> {
        let path = path.into();
        let (name, job) = (stem(&path), JobFile { path, program, matrices: None });
        let files = Self::of(name, ModelSource::Job(job), units)?;
        Ok(Self { interfaces, ..files })
    }

    fn of(name: String, source: ModelSource, units: Option<&str>) -> Result<Self> {
        Ok(Self {
            description: Description::new(
                name,
                units.map_or_else(|| Ok(UnitSystem::default()), parse_units)?,
            ),
            dimension: 3,
            allow_implausible: Accepted::default(),
            keep_soft_rotations: false,
            source,
            mesh: None,
            describe_elements: false,
            elements: Vec::new(),
            interfaces: Vec::new(),
            damping: None,
            geometric_stiffness: Vec::new(),
            recoveries: Vec::new(),
            nodal_stresses: Vec::new(),
            named_loads: Vec::new(),
            residual_vectors: Vec::new(),
            manifest: None,
            manifest_sha256: None,
            keep_in: None,
        })
    }

    /// Creates the files of a three-dimensional model without a manifest, named after its stiffness file. `units` is
    /// `length,mass,time` as in `m,kg,s`.
    ///
    /// # Errors
    /// FB202 if the units are not three known ones.
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

/// Parses units as on the command line: `length,mass,time`.
///
/// # Errors
/// FB202 if they are not three known ones.
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

/// Returns the file name up to its first dot.
pub(super) fn stem(path: &Path) -> String {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    match name.split('.').next() {
        Some(stem) if !stem.is_empty() => stem.to_owned(),
        _ => name,
    }
}

// Node sets by geometry: the nodes in a box, about an axis, in a plane, or nearest to a point.

/// Region that contains the nodes of a set, in model axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// Box between two corners, including its faces.
    Box {
        /// Smallest coordinates.
        min: [f64; 3],
        /// Largest coordinates.
        max: [f64; 3],
    },
    /// Hollow cylinder: distances from an axis, between its ends.
    Cylinder {
        /// One end of the axis.
        from: [f64; 3],
        /// Other end of the axis.
        to: [f64; 3],
        /// Smallest and largest distance from the axis.
        radius: [f64; 2],
    },
    /// Layer on both sides of a plane.
    Plane {
        /// A point of the plane.
        point: [f64; 3],
        /// Normal of the plane, of any length.
        normal: [f64; 3],
        /// Largest distance from the plane.
        within: f64,
    },
    /// Nodes nearest to a point.
    Nearest {
        /// Point from which distances are measured.
        point: [f64; 3],
        /// Number of nodes.
        count: usize,
    },
}

impl Region {
    /// Returns the nodes among `nodes` (number and position) in the region, in their order. Among equally near nodes
    /// the first ones are chosen.
    pub fn nodes(&self, nodes: impl Iterator<Item = (i64, [f64; 3])>) -> Vec<i64> {
        if let Self::Nearest { point, count } = *self {
            let away = |x: [f64; 3]| (Vector3::from(x) - Vector3::from(point)).norm();
            let mut all: Vec<(f64, usize, i64)> =
                nodes.enumerate().map(|(at, (id, x))| (away(x), at, id)).collect();
            sort_ascending(&mut all, |node| node.0);
            all.truncate(count);
            all.sort_by_key(|(_, at, _)| *at);
            return all.into_iter().map(|(_, _, id)| id).collect();
        }
        nodes.filter(|(_, x)| self.holds(*x)).map(|(id, _)| id).collect()
    }

    /// Returns the sentence that none of `nodes` (number and position) lies in the region, with the distance of the nearest.
    pub(super) fn empty(&self, nodes: impl Iterator<Item = (i64, [f64; 3])>) -> String {
        let all = nodes.map(|(id, x)| (self.distance(x), id, x));
        match first_smallest(all, |node| node.0) {
            None => {
                "no node of the model lies in the region: the model has no nodes that can move".to_owned()
            }
            Some((away, id, x)) => {
                let [away, x, y, z] = [away, x[0], x[1], x[2]].map(|value| significant(value, 5));
                format!(
                    "no node of the model lies in the region: the nearest, node {id} at {x}, {y}, {z}, is {away} away from it"
                )
            }
        }
    }

    /// Returns the distance of a point from the region, zero inside. Unit: length.
    fn distance(&self, x: [f64; 3]) -> f64 {
        let beyond = |value: f64, low: f64, high: f64| (low - value).max(value - high).max(0.0);
        match *self {
            Self::Box { min, max } => Vector3::from_fn(|k, _| beyond(x[k], min[k], max[k])).norm(),
            Self::Cylinder { from, to, radius } => {
                let [along, away, length] = beside_axis(from, to, x);
                hypot(beyond(along, 0.0, length), beyond(away, radius[0], radius[1]))
            }
            Self::Plane { point, normal, within } => {
                let (point, normal) = (Vector3::from(point), Vector3::from(normal));
                beyond((Vector3::from(x) - point).dot(&normal.normalize()).abs(), 0.0, within)
            }
            Self::Nearest { point, .. } => (Vector3::from(x) - Vector3::from(point)).norm(),
        }
    }

    /// Returns the default reference point of an interface in the region: on the axis for a cylinder, at the centre for
    /// others.
    pub fn reference(&self) -> Reference {
        match *self {
            Self::Cylinder { from, to, .. } => {
                Reference::Axis { point: from, direction: [0, 1, 2].map(|k| to[k] - from[k]) }
            }
            Self::Box { .. } | Self::Plane { .. } | Self::Nearest { .. } => Reference::Centre,
        }
    }

    /// Returns the reason why the region is empty by definition, in words; `None` if it is not.
    pub(super) fn problem(&self) -> Option<&'static str> {
        match self {
            Self::Box { min, max } if (0..3).any(|k| min[k] > max[k]) => Some("`min` lies beyond `max`"),
            Self::Cylinder { from, to, .. } if from == to => {
                Some("`from` and `to` are one point: there is no axis")
            }
            Self::Plane { normal, .. } if normal.iter().all(|x| *x == 0.0) => Some("`normal` is zero"),
            _ => None,
        }
    }

    fn holds(&self, x: [f64; 3]) -> bool {
        match *self {
            Self::Box { min, max } => (0..3).all(|k| (min[k]..=max[k]).contains(&x[k])),
            Self::Cylinder { from, to, radius } => {
                let [along, away, length] = beside_axis(from, to, x);
                // Ends and surfaces belong to the region, whatever the rounding of the coordinates.
                let slack = 1e-9 * (length + radius[1]);
                (-slack..=length + slack).contains(&along)
                    && (radius[0] - slack..=radius[1] + slack).contains(&away)
            }
            Self::Plane { point, normal, within } => {
                let (point, normal) = (Vector3::from(point), Vector3::from(normal));
                (Vector3::from(x) - point).dot(&normal.normalize()).abs() <= within
            }
            Self::Nearest { .. } => false,
        }
    }
}

/// Returns the distance of the point `x` from `from` along the axis that ends at `to`, its distance from the axis, and the
/// length of the axis.
fn beside_axis(from: [f64; 3], to: [f64; 3], x: [f64; 3]) -> [f64; 3] {
    let (from, to, x) = (Vector3::from(from), Vector3::from(to), Vector3::from(x));
    let length = (to - from).norm();
    let axis = (to - from) / length;
    let along = (x - from).dot(&axis);
    [along, (x - from - along * axis).norm(), length]
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
        assert_eq!((model.description.name.as_str(), model.description.units.mass.to_si()), ("K", 1000.0));
        assert!(!files(None).unwrap().description.units.stated);
        for bad in ["mm,t", "mm,t,s,K", "mm,stone,s", "mm,-1,s", ""] {
            assert!(files(Some(bad)).unwrap_err().has(Code::ManifestUnit), "{bad}");
        }
    }

    /// Returns a block of 5 x 3 x 3 nodes, numbered from 10.
    fn block() -> impl Iterator<Item = (i64, [f64; 3])> {
        (0..45).map(|k| (10 + k, [(k % 5) as f64, (k / 5 % 3) as f64, (k / 15) as f64]))
    }

    #[test]
    fn regions_hold_what_lies_in_them() {
        let ends = Region::Box { min: [4.0, 0.0, 0.0], max: [9.0, 9.0, 9.0] };
        assert_eq!(ends.nodes(block()).len(), 9);
        let ring = Region::Cylinder { from: [0.0, 1.0, 1.0], to: [2.0, 1.0, 1.0], radius: [0.9, 1.1] };
        assert_eq!(ring.nodes(block()).len(), 3 * 4, "the four nearest of three layers");
        let turned = Region::Plane { point: [0.0; 3], normal: [2.0, -2.0, 0.0], within: 1e-6 };
        assert!(turned.nodes(block()).iter().all(|id| (id - 10) % 5 == (id - 10) / 5 % 3));
        let near = Region::Nearest { point: [0.1, 0.0, 0.0], count: 2 };
        assert_eq!(near.nodes(block()), [10, 11]);
    }
}
