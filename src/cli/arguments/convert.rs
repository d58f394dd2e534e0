//! Arguments of the command that makes bodies.

#[cfg(feature = "cluster")]
use super::EngineArguments;
use super::headings::{COMPARISON, COST, FRAME, MODEL, MODES, OUTPUT, SCENE, STRESS};
#[cfg(feature = "import")]
use super::import::ForeignArguments;
use super::{JobArguments, Printing, StatedArguments, accepted, memory_size, names, positive, stress_loads};
use clap::Args;
use flexbody_body::basis::BasisKind;
use flexbody_body::convert::StressLoads;
use flexbody_body::flex_body::Storage;
use flexbody_body::invariants::FrameChoice;
use flexbody_eigen::{Accuracy, FactorChoice};
use flexbody_model::Accepted;
use std::path::PathBuf;

/// Arguments of `convert`.
#[derive(Debug, Clone, Args)]
pub struct ConvertArguments {
    /// Manifest of the model (see docs/reference/input.md), or the job of an FE program
    /// (docs/how_to/from_fe_programs.md); with --from the body of another program
    #[arg(value_name = "MODEL.toml|JOB.inp", required_unless_present = "stiffness", conflicts_with_all = ["stiffness", "mass", "nodes", "dofs"])]
    pub model: Option<PathBuf>,
    /// Body of another program.
    #[cfg(feature = "import")]
    #[command(flatten)]
    pub foreign: ForeignArguments,
    /// Job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Stiffness matrix: Matrix Market (.mtx, .gz, .zst), HDF5 (FILE.h5:/group), SciPy (.npz), NumPy (.npy), MATLAB
    /// (FILE.mat:/K), PETSc or Nastran (FILE.op4:/KGG)
    #[arg(long, value_name = "FILE", requires_all = ["mass", "nodes"], conflicts_with_all = ["format", "matrices"], help_heading = MODEL)]
    pub stiffness: Option<PathBuf>,
    /// Mass matrix, consistent
    #[arg(long, value_name = "FILE", requires = "stiffness", help_heading = MODEL)]
    pub mass: Option<PathBuf>,
    /// Nodes: a table node,x,y,z, a mesh (Gmsh, VTK, Exodus) or a deck
    #[arg(long, value_name = "FILE", requires = "stiffness", help_heading = MODEL)]
    pub nodes: Option<PathBuf>,
    /// Labels of the matrix rows: node,dir [default: node-major x, y, z]
    #[arg(long, value_name = "FILE", requires = "stiffness", help_heading = MODEL)]
    pub dofs: Option<PathBuf>,
    /// Treat findings as warnings instead of errors, each check by its code: FB437 (density, speed of sound), FB433 (mass
    /// coupling without stiffness), FB460 (stresses of a recovery that contradict K), FB410 (rotations that strain K while
    /// translations do not). Without codes: FB433, FB437 and FB460
    #[arg(long, value_name = "CODES", value_parser = accepted, num_args = 0..=1, require_equals = true, default_missing_value = "all", help_heading = MODEL)]
    pub allow_implausible: Option<Accepted>,
    /// Leave rotations that only elements that are not quite coplanar hold as K has them, instead of making them
    /// follow the nodes around them (FB428)
    #[arg(long, help_heading = MODEL)]
    pub keep_soft_rotations: bool,
    /// Convert each of several bodies in the matrices, to BODY-1.flex.h5, BODY-2.flex.h5, ... (reports likewise)
    #[arg(long, conflicts_with = "shapes", help_heading = MODEL)]
    pub split: bool,
    /// Number of flexible modes, up to all of them; static shapes of the basis are added, and with --basis
    /// craig-bampton may be the only ones (0: static condensation) [default: 20; imported shapes: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32), conflicts_with = "max_frequency", help_heading = MODES)]
    pub modes: Option<u32>,
    /// All flexible modes up to this frequency instead
    #[arg(long, value_name = "HZ", value_parser = positive, help_heading = MODES)]
    pub max_frequency: Option<f64>,
    /// Basis of the body
    #[arg(long, value_parser = names::basis(), default_value = BasisKind::default().name(), help_heading = MODES)]
    pub basis: BasisKind,
    /// Shapes for --basis imported, by matrix rows: .npy, HDF5 (FILE.h5:/dataset) or a Matrix Market array;
    /// or modes by nodes: CalculiX (.frd), Nastran (.pch, .op2), lists of Ansys
    #[arg(long, value_name = "FILE", required_if_eq("basis", BasisKind::Imported.name()), help_heading = MODES)]
    pub shapes: Option<PathBuf>,
    /// Static responses to add to free modes (--basis free or craig-chang): centrifugal, interfaces, loads=FILE (nodal
    /// forces by matrix rows), comma-separated; empty for none. With @HZ the responses at that frequency. Replaces
    /// [basis] of the manifest
    #[arg(long, value_name = "LOADS", help_heading = MODES)]
    pub residual_vectors: Option<String>,
    /// Body whose settings are used: basis, modes, accuracy, residual vectors, frame, comparators and storage
    #[arg(long, value_name = "BODY.flex.h5", conflicts_with_all = ["modes", "max_frequency", "basis", "shapes", "residual_vectors", "accuracy", "frame", "lumped", "storage", "scene"], help_heading = MODES)]
    pub like: Option<PathBuf>,
    /// Accuracy of the modes
    #[arg(long, value_parser = names::accuracy(), default_value = Accuracy::default().name(), help_heading = COST)]
    pub accuracy: Accuracy,
    /// Precision of the factor: auto uses f32 if f64 does not fit into the memory or is slower, and no factor if the
    /// body is large and compact
    #[arg(long, value_parser = names::factor(), default_value = FactorChoice::default().name(), help_heading = COST)]
    pub factor: FactorChoice,
    /// Memory that the program may use: a number with K, M, G or T [default: all that the machine and its control
    /// groups have free]
    #[arg(long, value_name = "SIZE", value_parser = memory_size, help_heading = COST)]
    pub memory_limit: Option<u64>,
    /// Allow work that is estimated to take more than half an hour for its number of modes
    #[arg(long, help_heading = COST)]
    pub allow_long: bool,
    /// Number of threads, at most four for each processor or 64; results are independent of it [default: all
    /// processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), help_heading = COST)]
    pub threads: Option<u16>,
    /// Frame of the body: com (centre of mass, axes of the model), principal (centre of mass, principal axes), model
    /// (frame of the model), or interface=NAME (reference point of an interface, which is then at rest in every mode)
    /// [default: com; with --from: that of the file]
    #[arg(long, value_name = "FRAME", help_heading = FRAME)]
    pub frame: Option<FrameChoice>,
    /// Lumped masses for comparison: row-sum, diagonal-scaling, user=FILE (node,mass), or none
    #[arg(long, value_name = "SCHEMES", default_value = "row-sum,diagonal-scaling", help_heading = COMPARISON)]
    pub lumped: String,
    /// Compute the modes of each lumped mass too, as a program without the mass matrix would, and compare their
    /// frequencies and invariants with the exact ones, after aligning the subspaces (free modes only; see
    /// docs/reference/report.md)
    #[arg(long, help_heading = COMPARISON)]
    pub lumped_modes: bool,
    /// Write only the terms and modes that this scene needs (see docs/reference/select.md); its loads and band choose
    /// residual vectors and modes unless these are stated
    #[arg(long, value_name = "SCENE.toml", conflicts_with = "split", help_heading = SCENE)]
    pub scene: Option<PathBuf>,
    /// Load case of the scene, by name [default: all, which one body must serve]
    #[arg(long, value_name = "NAME", requires = "scene", help_heading = SCENE)]
    pub case: Option<String>,
    /// Require that the body holds in the standard variations of the scene too: loads turned by 10 degrees, 10 % larger, 10 %
    /// faster
    #[arg(long, requires = "scene", help_heading = SCENE)]
    pub robust: bool,
    /// Modes and terms that are stated instead of selected.
    #[command(flatten)]
    pub stated: StatedArguments,
    /// Write the body for a scene even if its selection does not hold, or cannot be judged (FB557)
    #[arg(long, requires = "scene", help_heading = SCENE)]
    pub allow_unjudged: bool,
    /// Loads whose stress stiffness is computed from the elements of the deck, which K has to prove (FB462): spin,
    /// interfaces (unit forces and moments), loads (named ones, except preloads), comma-separated, or none [default: none,
    /// and the summary names the option where the deck describes its elements]
    #[arg(long, value_name = "LOADS", value_parser = stress_loads, help_heading = STRESS)]
    pub geometric_stiffness: Option<StressLoads>,
    /// Recover stresses from the elements of the deck, which K has to prove (FB462), as recovery `stress`: at all nodes
    /// (nodes), at those on the surface (surface), or at those of a node set, by its name [repeatable]
    #[arg(long, value_name = "NODES", help_heading = STRESS)]
    pub stress: Vec<String>,
    /// Solver for the modes.
    #[cfg(feature = "cluster")]
    #[command(flatten)]
    pub engine: EngineArguments,
    /// Flex-body file to write
    #[arg(short, long, value_name = "BODY.flex.h5", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Floats of shapes and of the inertia of the modes in the file: f32 takes half the space and has 7 digits
    #[arg(long, value_parser = names::storage(), default_value = Storage::default().name(), help_heading = OUTPUT)]
    pub storage: Storage,
    /// Largest number of triangles of the surface for drawing [default: all of the elements of the model]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = OUTPUT)]
    pub mesh_triangles: Option<u32>,
    /// Leave the surface out of the file
    #[arg(long, conflicts_with = "mesh_triangles", help_heading = OUTPUT)]
    pub no_mesh: bool,
    /// Report to write, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Print all facts about the body instead of a summary
    #[arg(short, long, help_heading = OUTPUT)]
    pub verbose: bool,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

impl ConvertArguments {
    /// Returns the format of the body of another program that is converted; `None` for a model.
    #[cfg(feature = "import")]
    pub fn foreign_format(&self) -> Option<&str> {
        self.foreign.from.as_deref()
    }

    /// Returns `None`: a build without the feature `import` converts models only.
    #[cfg(not(feature = "import"))]
    pub fn foreign_format(&self) -> Option<&str> {
        None
    }
}
