//! Arguments of the commands for clusters and batches.

use super::headings::{COMPARISON, COST, FRAME, MODEL, MODES, OUTPUT};
use super::{JobArguments, Printing, accepted, memory_size, names, positive};
use clap::builder::TypedValueParser;
use clap::{Args, ValueEnum};
use flexbody_body::flex_body::Storage;
use flexbody_body::invariants::FrameChoice;
use flexbody_cluster::Solver;
use flexbody_eigen::Accuracy;
use flexbody_model::Accepted;
use std::path::PathBuf;

/// Heading of the options of computations on a cluster.
const CLUSTER: &str = "Cluster";

/// Arguments of `prepare`.
#[derive(Debug, Args)]
pub struct PrepareArguments {
    /// Manifest of the model (see docs/reference/input.md), or the job of an FE program
    /// (docs/how_to/from_fe_programs.md)
    #[arg(value_name = "MODEL.toml|JOB.inp")]
    pub model: PathBuf,
    /// Job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Treat findings as warnings instead of errors, each check by its code: FB437 (density, speed of sound), FB433 (mass
    /// coupling without stiffness), FB460 (stresses of a recovery that contradict K), FB410 (rotations that strain K while
    /// translations do not). Without codes: FB433, FB437 and FB460
    #[arg(long, value_name = "CODES", value_parser = accepted, num_args = 0..=1, require_equals = true, default_missing_value = "all", help_heading = MODEL)]
    pub allow_implausible: Option<Accepted>,
    /// Leave rotations that only elements that are not quite coplanar hold as K has them, instead of making them
    /// follow the nodes around them (FB428)
    #[arg(long, help_heading = MODEL)]
    pub keep_soft_rotations: bool,
    /// Folder to write, with all that the cluster needs; it is created if it does not exist
    #[arg(short, long, value_name = "DIR", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Number of flexible modes [default: 20]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "max_frequency", help_heading = MODES)]
    pub modes: Option<u32>,
    /// All flexible modes up to this frequency instead
    #[arg(long, value_name = "HZ", value_parser = positive, help_heading = MODES)]
    pub max_frequency: Option<f64>,
    /// Accuracy of the modes: fast or standard
    #[arg(long, value_parser = names::accuracy(), default_value = Accuracy::default().name(), help_heading = COST)]
    pub accuracy: Accuracy,
    /// Bits of the integers of the PETSc on the cluster; matrices of more than two billion entries need 64
    #[arg(long, value_name = "BITS", default_value = "32", value_parser = ["32", "64"], help_heading = CLUSTER)]
    pub indices: String,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `assemble`.
#[derive(Debug, Args)]
pub struct AssembleArguments {
    /// Folder that `prepare` has written and the driver has run in
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Model, if it has moved since `prepare` has read it
    #[arg(long, value_name = "MODEL.toml|JOB.inp", help_heading = MODEL)]
    pub model: Option<PathBuf>,
    /// Flex-body file to write
    #[arg(short, long, value_name = "BODY.flex.h5", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Number of modes to use [default: as many as were requested]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = MODES)]
    pub modes: Option<u32>,
    /// Also make the built-in inertia count, which factors K - sigma M on this machine
    #[arg(long, help_heading = MODES)]
    pub prove: bool,
    /// Floats of shapes and of the inertia of the modes in the file: f32 takes half the space and has 7 digits
    #[arg(long, value_parser = names::storage(), default_value = Storage::default().name(), help_heading = OUTPUT)]
    pub storage: Storage,
    /// Memory that the program may use: a number with K, M, G or T [default: all that the machine and its control
    /// groups have free]
    #[arg(long, value_name = "SIZE", value_parser = memory_size, help_heading = COST)]
    pub memory_limit: Option<u64>,
    /// Frame of the body: com (centre of mass, axes of the model), principal (centre of mass, principal axes), model
    /// (frame of the model), or interface=NAME (reference point of an interface, which is then at rest in every mode)
    /// [default: com]
    #[arg(long, value_name = "FRAME", help_heading = FRAME)]
    pub frame: Option<FrameChoice>,
    /// Lumped masses for comparison: row-sum, diagonal-scaling, user=FILE (node,mass), or none
    #[arg(long, value_name = "SCHEMES", default_value = "row-sum,diagonal-scaling", help_heading = COMPARISON)]
    pub lumped: String,
    /// Leave the surface out of the file
    #[arg(long, help_heading = OUTPUT)]
    pub no_mesh: bool,
    /// Report to write, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Number of threads; results are independent of it [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), help_heading = COST)]
    pub threads: Option<u16>,
    /// Print all facts about the body instead of a summary
    #[arg(short, long, help_heading = OUTPUT)]
    pub verbose: bool,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `batch`.
#[derive(Debug, Args)]
pub struct BatchArguments {
    /// List of bodies (see docs/how_to/batch.md)
    #[arg(value_name = "LIST.toml")]
    pub list: PathBuf,
    /// Memory that all conversions together may use: a number with K, M, G or T [default: all that the machine and its
    /// control groups have free]
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    /// Report about all bodies, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Allow a list whose options start programs (--mpiexec, --python); otherwise such a list is refused
    #[arg(long)]
    pub allow_programs: bool,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Solver for the modes.
#[derive(Debug, Clone, Args)]
pub struct EngineArguments {
    /// Solver for the free modes: this program, or SLEPc over MPI (docs/how_to/cluster.md)
    #[arg(long, value_enum, default_value_t = EngineName::BuiltIn, help_heading = CLUSTER)]
    pub engine: EngineName,
    /// Number of MPI ranks of --engine slepc
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), help_heading = CLUSTER)]
    pub ranks: u32,
    /// Method of --engine slepc
    #[arg(long, value_parser = solver(), default_value = Solver::default().name(), help_heading = CLUSTER)]
    pub solver: Solver,
    /// Command that starts MPI, before `-n N` [default: FLEXBODY_MPIEXEC, else mpiexec]
    #[arg(long, value_name = "WORDS", help_heading = CLUSTER)]
    pub mpiexec: Option<String>,
    /// Python with petsc4py and slepc4py, started by -I: without PYTHONPATH and packages of the current folder
    /// [default: FLEXBODY_PYTHON, else python3 or /usr/bin/python3]
    #[arg(long, value_name = "PYTHON", help_heading = CLUSTER)]
    pub python: Option<PathBuf>,
    /// Working folder of --engine slepc, which is kept [default: BODY.flex.h5.cluster, which is kept only if the run
    /// fails, to continue from it]
    #[arg(long, value_name = "DIR", help_heading = CLUSTER)]
    pub cluster_folder: Option<PathBuf>,
}

impl Default for EngineArguments {
    /// Returns the built-in solver.
    fn default() -> Self {
        Self {
            engine: EngineName::BuiltIn,
            ranks: 1,
            solver: Solver::default(),
            mpiexec: None,
            python: None,
            cluster_folder: None,
        }
    }
}

/// Names of the engines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EngineName {
    /// This program
    BuiltIn,
    /// SLEPc over MPI
    Slepc,
}

/// Returns the parser of the solvers of SLEPc.
fn solver() -> impl TypedValueParser<Value = Solver> {
    names::one_of(Solver::ALL, Solver::name, |solver| match solver {
        Solver::Mumps => "Krylov-Schur, shift-invert, on one factor of MUMPS",
        Solver::Slices => "Spectrum slicing, one factor for each part of the spectrum: hundreds of modes",
        Solver::Gamg => "Krylov-Schur on conjugate gradients with algebraic multigrid: no factor, no count",
        Solver::Lobpcg => "LOBPCG with algebraic multigrid: no factor, no count",
    })
}
