//! Arguments of the command line.

#[cfg(feature = "cluster")]
mod cluster;
mod convert;
mod guidance;
mod headings;
#[cfg(feature = "import")]
mod import;
mod judgement;
mod names;
mod parsing;
#[cfg(feature = "response")]
mod response;

use clap::builder::PossibleValue;
use clap::{Args, Parser, Subcommand};
use flexbody_base::numbers::parse_ratio;
use flexbody_body::convert::StressLoads;
use flexbody_body::flex_body::Storage;
use flexbody_formats::FORMATS;
use flexbody_formats::export::ExportFormat;
use flexbody_model::Accepted;
use flexbody_study::trade::ReferenceChoice;
use headings::{COST, FORMAT, LOSSES, MODEL, MODES, OUTPUT, SCENE};
use std::path::PathBuf;

#[cfg(feature = "cluster")]
pub(super) use cluster::{AssembleArguments, BatchArguments, EngineArguments, EngineName, PrepareArguments};
pub(super) use convert::ConvertArguments;
pub(super) use guidance::{
    CompletionsArguments, DoctorArguments, ExplainArguments, ManArguments, RecipeArguments,
};
#[cfg(feature = "import")]
pub(super) use import::AuditArguments;
pub(super) use judgement::{
    AdviseArguments, MeasureArguments, PlacesName, RecoverArguments, ShapeFormat, ShapesArguments,
};
#[cfg(feature = "response")]
pub(super) use response::ResponseArguments;

/// Exact flexible bodies for multibody simulation from finite element mass and stiffness matrices.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100, disable_help_subcommand = false)]
#[command(
    after_help = "Exit codes: 0 done; 1 a check or tolerance failed; 2 bad input or usage; 3 no trustworthy \
    numerical result; 4 not enough memory or disk, or an output that may not be written; 70 internal error; 130 interrupted (SIGINT, SIGTERM, SIGHUP). Other signals: 128 + number. \
    With 0 all output files are written; with 2 to 130 and after signals none is, and no unfinished file is left. Messages have codes: flexbody explain CODE tells more (all codes: flexbody explain, docs/reference/codes.md)."
)]
pub struct Arguments {
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands of the program.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make a flexible body from the matrices of an FE model
    #[command(
        after_help = "Examples:\n  flexbody convert model.toml -o rod.flex.h5\n  flexbody convert job.inp --units mm,t,s --interface bore=SET_BORE,rigid -o rod.flex.h5\n  flexbody convert --stiffness K.mtx \
        --mass M.mtx.gz --nodes nodes.csv --units mm,t,s --modes 40 -o rod.flex.h5 --report rod.html"
    )]
    Convert(Box<ConvertArguments>),
    /// Write the files that a cluster needs to find the modes of a model by SLEPc over MPI, including its driver
    #[cfg(feature = "cluster")]
    #[command(
        after_help = "Example:\n  flexbody prepare model.toml --modes 40 -o job\n  mpiexec -n 64 python3 job/driver.py job\n  flexbody assemble job -o rod.flex.h5"
    )]
    Prepare(PrepareArguments),
    /// Make a body of the modes that a cluster has found in a folder of `prepare`
    #[cfg(feature = "cluster")]
    Assemble(AssembleArguments),
    /// Make the bodies of a list, as many in parallel as fit into the memory; unchanged bodies are kept
    #[cfg(feature = "cluster")]
    Batch(BatchArguments),
    /// Show the content of a flex-body file
    Inspect(InspectArguments),
    /// Check a flex-body file: its schema and every identity that must hold
    Check(CheckArguments),
    /// Compare two flex-body files, independent of the signs and bases of their modes
    #[command(
        after_help = "Example:\n  flexbody compare released.flex.h5 new.flex.h5 --frequency 1e-6 --report comparison.html --report comparison.xml"
    )]
    Compare(CompareArguments),
    /// Select the terms and modes that a body needs in a scene, with the bound or the measurement behind each
    #[command(
        after_help = "Example:\n  flexbody select rod.flex.h5 --scene crank.toml --report selection.html"
    )]
    Select(SelectArguments),
    /// Simulate a body in a scene: free or loaded, from initial conditions
    #[command(
        after_help = "Example:\n  flexbody simulate rod.flex.h5 --scene tumble.toml -o tumble.h5 --csv tumble.csv --report tumble.html"
    )]
    Simulate(SimulateArguments),
    /// Measure the cost of accuracy in a scene: compare candidate bodies with a reference, and recommend one
    #[command(
        after_help = "Examples:\n  flexbody trade rod.flex.h5 --scene tumble.toml --report trade.html\n  flexbody trade model.toml --modes 20 --scene tumble.toml --reference nodal --csv trade.csv"
    )]
    Trade(TradeArguments),
    /// Tell which terms of the equations of motion a body needs for ranges of spin, deflection and attached mass,
    /// without a scene, and the settings of other programs that keep them
    #[command(
        after_help = "Example:\n  flexbody advise rod.flex.h5 --spin 130 --deflection 0.5 --attached 0.4@big_end"
    )]
    Advise(AdviseArguments),
    /// Measure the error of a run of another program: compare its modal coordinates and attitude with an accurate motion
    #[command(
        after_help = "Examples:\n  flexbody measure small.flex.h5 --scene tumble.toml --history run.csv\n  flexbody measure small.flex.h5 --scene tumble.toml --history run.csv --reference full.flex.h5 --model model.toml"
    )]
    Measure(MeasureArguments),
    /// Compute the recoveries of a body (stresses, strains, section forces) over a run of any program, from its modal
    /// coordinates, angular velocity and loads
    #[command(after_help = "Example:\n  flexbody recover rod.flex.h5 --history run.csv -o stress.h5")]
    Recover(RecoverArguments),
    /// Write the modes and static columns of a body as shapes for an FE program, whose stresses then make a recovery
    #[command(
        after_help = "Example:\n  flexbody shapes rod.flex.h5 --model model.toml --to calculix -o ask.inp\n  ccx ask"
    )]
    Shapes(Box<ShapesArguments>),
    /// Write a body with some of its modes and groups of terms, as a selection or a trade study recommends
    #[command(
        after_help = "Example:\n  flexbody reduce rod.flex.h5 --keep-modes 1,3,5-9 --terms W1 -o small.flex.h5"
    )]
    Reduce(ReduceArguments),
    /// Compute the frequency response of a body between places, and its difference from the response of all nodes of
    /// its model
    #[cfg(feature = "response")]
    #[command(
        after_help = "Examples:\n  flexbody response model.toml --modes 20 --band 0..2000 --from big_end --to small_end --damping 0.01 --report response.html\n  flexbody response model.toml rod.flex.h5 --scene crank.toml --csv response.csv\n  flexbody response rod.flex.h5 --band 10..2000 --from big_end:z --to 17:x,z"
    )]
    Response(Box<ResponseArguments>),
    /// Write a page that shows the modes of a body, or a simulation, in motion: one file for any browser
    #[command(
        after_help = "Examples:\n  flexbody view rod.flex.h5 -o rod.html\n  flexbody view rod.flex.h5 --simulation tumble.h5 -o tumble.html"
    )]
    View(ViewArguments),
    /// Write a body in the format of another program
    #[command(
        after_help = "Examples:\n  flexbody export rod.flex.h5 --to exudyn -o rod.hdf5\n  flexbody export rod.flex.h5 --to sid --dialect py-sid --points interfaces -o rod.SID_FEM\n  flexbody export rod.flex.h5 --to gltf -o rod.glb"
    )]
    Export(ExportArguments),
    /// Print how an FE program writes its matrices: the lines of the deck, and the command that continues from there
    #[command(after_help = "Example:\n  flexbody recipe calculix")]
    Recipe(RecipeArguments),
    /// Explain the code of a message: its meaning, why it arises, and what to do
    #[command(after_help = "Examples:\n  flexbody explain FB408\n  flexbody explain")]
    Explain(ExplainArguments),
    /// Check a flexible-body file of another program: dialect, identities, digits, units, in plain words
    #[cfg(feature = "import")]
    #[command(after_help = "Example:\n  flexbody audit rod.SID_FEM")]
    Audit(AuditArguments),
    /// Print the components of the program and the resources of this machine: threads, memory, instructions
    Doctor(DoctorArguments),
    /// Print the completions of a shell
    #[command(
        after_help = "Example:\n  flexbody completions bash > ~/.local/share/bash-completion/completions/flexbody"
    )]
    Completions(CompletionsArguments),
    /// Print a page of the manual
    #[command(after_help = "Example:\n  flexbody man convert > flexbody-convert.1")]
    Man(ManArguments),
}

/// Modes and terms that a command line states instead of a selection.
#[derive(Debug, Clone, Default, Args)]
pub struct StatedArguments {
    /// Groups of terms of the body instead of a selection: W1, W2, W3 with commas, none, all, or the groups of a
    /// guideline of Witteveen and Pichler: I, II, III, IV
    #[arg(long, value_name = "GROUPS", help_heading = SCENE)]
    pub terms: Option<String>,
    /// Numbers of the modes that the body keeps, instead of a selection: 1,3,5-9
    #[arg(long, value_name = "NUMBERS", conflicts_with = "split", help_heading = SCENE)]
    pub keep_modes: Option<String>,
    /// With --basis craig-bampton: numbers of the fixed-interface modes that the body keeps beside all motions of its
    /// interfaces, instead of a selection: 1,3,5-9 or none
    #[arg(long, value_name = "NUMBERS", conflicts_with = "split", help_heading = SCENE)]
    pub fixed_interface_modes: Option<String>,
    /// With --basis scene: number of shapes of the motion [default: the fewest that suffice]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = SCENE)]
    pub motion_shapes: Option<u32>,
    /// With --scene and stated parts: static responses are added until the truncation error of the body is estimated
    /// to be below a tenth of the tolerances (standard) or a hundredth (fine, as for trade --reference fine)
    #[arg(long, value_enum, default_value_t = EnrichmentName::Standard, requires = "scene", help_heading = SCENE)]
    pub enrichment: EnrichmentName,
}

impl StatedArguments {
    /// Returns true if the command line states modes or terms.
    pub fn states_any(&self) -> bool {
        self.terms.is_some()
            || self.keep_modes.is_some()
            || self.fixed_interface_modes.is_some()
            || self.motion_shapes.is_some()
    }
}

/// Extent to which a body is enriched for a scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum EnrichmentName {
    /// Truncation error within a tenth of the tolerances.
    #[default]
    Standard,
    /// Truncation error within a hundredth of the tolerances.
    Fine,
}

/// Arguments of `reduce`.
#[derive(Debug, Args)]
pub struct ReduceArguments {
    /// Flex-body file
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Numbers of the modes to keep: 1,3,5-9 [default: all]
    #[arg(long, value_name = "NUMBERS")]
    pub keep_modes: Option<String>,
    /// Numbers of the fixed-interface modes of a Craig-Bampton body to keep beside all motions of its interfaces: 1,3,5-9
    /// or none [default: all]. --keep-modes refers to the modes of the body that this leaves
    #[arg(long, value_name = "NUMBERS")]
    pub fixed_interface_modes: Option<String>,
    /// Groups of terms to keep: W1, W2, W3 with commas, none, all, or the groups of a guideline of Witteveen and
    /// Pichler: I, II, III, IV [default: all]
    #[arg(long, value_name = "GROUPS")]
    pub terms: Option<String>,
    /// Floats of shapes and of the inertia of the modes in the file [default: as in BODY]
    #[arg(long, value_parser = names::storage())]
    pub storage: Option<Storage>,
    /// Flex-body file to write
    #[arg(short, long, value_name = "SMALL.flex.h5", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `view`.
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Flex-body file
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Page to write
    #[arg(short, long, value_name = "VIEW.html", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Motion of the body to play instead of its modes: a file written by `simulate -o`
    #[arg(long, value_name = "MOTION.h5")]
    pub simulation: Option<PathBuf>,
    /// Colour the modes by the equivalent stress of this recovery
    #[arg(long, value_name = "NAME", conflicts_with_all = ["simulation", "envelope"])]
    pub recovery: Option<String>,
    /// Colour the body by the largest equivalent stresses of a run: a table written by `simulate` or `recover --envelope`
    #[arg(long, value_name = "ENVELOPE.csv", help_heading = OUTPUT)]
    pub envelope: Option<PathBuf>,
    /// Largest number of triangles of the surface [default: as many as keep the page below 10 MB]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub triangles: Option<u32>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `export`.
#[derive(Debug, Args)]
pub struct ExportArguments {
    /// Flex-body file
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Format to write
    #[arg(long, value_name = "FORMAT", value_parser = export_formats(), help_heading = FORMAT)]
    pub to: String,
    /// Variant of the format, one of those listed above [default: the first]
    #[arg(long, value_name = "NAME", help_heading = FORMAT)]
    pub dialect: Option<String>,
    /// With --to mbdyn: the last record group that the reader supports; short for --dialect level13 or level19
    #[arg(long, value_name = "LEVEL", value_parser = ["13", "19"], conflicts_with = "dialect", help_heading = FORMAT)]
    pub mbdyn_level: Option<String>,
    /// Places of the body to write: nodes, interfaces, node numbers with commas, or both as in interfaces,17,23
    /// [default: the interfaces if the format has frames and the body has interfaces, else all nodes]
    #[arg(long, value_name = "POINTS", help_heading = FORMAT)]
    pub points: Option<String>,
    /// With --to vtk or gltf: number of modes to show, the first N [default: vtk all, gltf 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = FORMAT)]
    pub modes: Option<u32>,
    /// With --to vtk (.pvd) or gltf: the motion to show instead of modes, a file written by `simulate -o`
    #[arg(long, value_name = "MOTION.h5", conflicts_with = "to_units", help_heading = FORMAT)]
    pub simulation: Option<PathBuf>,
    /// Scene for which the errors of losses are stated that grow with the motion, the largest over its load cases;
    /// above 5 % of a deflection they need --allow-loss [default: the motion at which they reach 1 %]
    #[arg(long, value_name = "SCENE.toml", help_heading = LOSSES)]
    pub scene: Option<PathBuf>,
    /// Units to write in [default: those of the body]
    #[arg(long, value_name = "L,M,T", help_heading = FORMAT)]
    pub to_units: Option<String>,
    /// Write the file even if the format cannot hold all of the body; with names, such as damping,rotations, only these
    /// may be lost (without the option: losses that are small, or that only fast motions make large)
    #[arg(long, value_name = "NAMES", num_args = 0..=1, require_equals = true, value_delimiter = ',', help_heading = LOSSES)]
    pub allow_loss: Option<Vec<String>>,
    /// File to write; further files have its name and another extension
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Returns the names of the formats, each with the programs that read it and its dialects. Adams passes, so that the message about its
/// format is that of [`find_format`](flexbody_formats::find_format).
fn export_formats() -> clap::builder::PossibleValuesParser {
    let value = |format: &&dyn ExportFormat| {
        let dialects = match format.dialects() {
            [] => String::new(),
            dialects => format!(" (dialects: {})", dialects.join(", ")),
        };
        let named = PossibleValue::new(format.name()).aliases(format.other_names());
        named.help(format!("{}{dialects}", format.reader()))
    };
    let adams = PossibleValue::new("adams").alias("mnf").hide(true);
    FORMATS.iter().map(value).chain([adams]).collect::<Vec<_>>().into()
}

/// Returns the names of the FE programs whose jobs can be read.
fn job_programs() -> clap::builder::PossibleValuesParser {
    flexbody_input::job_programs().map(PossibleValue::new).collect::<Vec<_>>().into()
}

/// Properties of the job of an FE program that a manifest would state, for every command that takes a model.
#[derive(Debug, Clone, Default, Args)]
pub struct JobArguments {
    /// FE program that has written the job [default: detected from its files]
    #[arg(long, value_name = "PROGRAM", value_parser = job_programs(), help_heading = MODEL)]
    pub format: Option<String>,
    /// Names of the stiffness and the mass matrix of the job, if it has several pairs (Nastran), or of their files beside
    /// the deck (Abaqus)
    #[arg(long, value_name = "K,M", help_heading = MODEL)]
    pub matrices: Option<String>,
    /// Units of length, mass and time if no manifest states them [default: m,kg,s; refused if the density is
    /// implausible]
    #[arg(long, value_name = "L,M,T", help_heading = MODEL)]
    pub units: Option<String>,
    /// 2 for a plane model, with x and y only, if no manifest states it [default: 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=3), help_heading = MODEL)]
    pub dimension: Option<u8>,
    /// Interface of a model without a manifest: NAME=SET of its node sets, or in place of SET nodes:1/2/3, file:TABLE.csv,
    /// box:X/Y/Z:X/Y/Z (corners), cylinder:X/Y/Z:X/Y/Z:R (ends of the axis, largest radius or least/largest),
    /// plane:X/Y/Z:X/Y/Z:WITHIN (point, normal, distance) or nearest:X/Y/Z:COUNT; then a coupling (rigid, averaging,
    /// free) and a reference point in model axes or node:N, each after a comma, as in bore=SET_BORE,rigid,0/0/12.5
    /// (repeatable) [default point: the centre of its faces, of a cylinder a point on its axis]
    #[arg(long, value_name = "NAME=NODES[,COUPLING][,POINT]", help_heading = MODEL)]
    pub interface: Vec<String>,
    /// Damping of a model without a manifest: a ratio of every mode (0.02 or 2%), rayleigh=ALPHA,BETA,
    /// bands=100:0.01,1000:0.1,1 (ends in hertz with ratios, the last without end) or matrix=FILE
    #[arg(long, value_name = "RATIO|NAME=VALUES", allow_hyphen_values = true, help_heading = MODEL)]
    pub damping: Option<String>,
}

/// Arguments of `trade`.
#[derive(Debug, Args)]
pub struct TradeArguments {
    /// Flex-body file, whose modes and groups of terms are candidates; or a model (its manifest or the job of an FE
    /// program), for which settings of `convert` are candidates as well
    #[arg(value_name = "BODY.flex.h5|MODEL.toml|JOB.inp")]
    pub body: PathBuf,
    /// Job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Scene with the motion and the tolerances (see docs/reference/scenes.md)
    #[arg(long, value_name = "SCENE.toml", help_heading = SCENE)]
    pub scene: PathBuf,
    /// Load case of the scene, by name [default: all; the worst case of a candidate counts]
    #[arg(long, value_name = "NAME", requires = "scene", help_heading = SCENE)]
    pub case: Option<String>,
    /// Require that the body holds in the standard variations of the scene too: loads turned by 10 degrees, 10 % larger, 10 %
    /// faster
    #[arg(long, help_heading = SCENE)]
    pub robust: bool,
    /// Reference of the errors: full, the body with all modes and groups, for a model with twice the modes and residual
    /// vectors; nodal, the unreduced equations (models only)
    #[arg(long, value_parser = names::reference(), default_value = ReferenceChoice::default().name(), help_heading = COST)]
    pub reference: ReferenceChoice,
    /// Largest number of free modes of the candidates of a model
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..100_000), help_heading = MODES)]
    pub modes: Option<u32>,
    /// Timing runs per candidate (the median is reported)
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..), help_heading = COST)]
    pub repeat: u16,
    /// Table of the candidates to write
    #[arg(long, value_name = "TRADE.csv", help_heading = OUTPUT)]
    pub csv: Option<PathBuf>,
    /// Folder to write the body of every candidate to, as candidate_NNN.flex.h5 with its number: for timing in another
    /// program
    #[arg(long, value_name = "FOLDER", help_heading = OUTPUT)]
    pub bodies: Option<PathBuf>,
    /// Allow work that is estimated to take more than half an hour: modes, or the motion of all nodes
    #[arg(long, help_heading = COST)]
    pub allow_long: bool,
    /// Report to write, with the plot as .html; format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Number of threads, at most four for each processor or 64; all results except times are independent of it
    /// [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), help_heading = COST)]
    pub threads: Option<u16>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `select`.
#[derive(Debug, Args)]
pub struct SelectArguments {
    /// Flex-body file with all modes and terms to select from, or a model: its manifest or the job of an FE program
    #[arg(value_name = "BODY.flex.h5|MODEL.toml|JOB.inp")]
    pub body: PathBuf,
    /// Job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Scene with the motion and the tolerances (see docs/reference/scenes.md)
    #[arg(long, value_name = "SCENE.toml", help_heading = SCENE)]
    pub scene: PathBuf,
    /// Load case of the scene, by name [default: all, which one body must serve]
    #[arg(long, value_name = "NAME", requires = "scene", help_heading = SCENE)]
    pub case: Option<String>,
    /// Require that the body holds in the standard variations of the scene too: loads turned by 10 degrees, 10 % larger, 10 %
    /// faster
    #[arg(long, help_heading = SCENE)]
    pub robust: bool,
    /// For a model: number of free modes to select from [default: up to twice the band of the scene, else 20]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = MODES)]
    pub modes: Option<u32>,
    /// Allow work that is estimated to take more than half an hour for its number of modes
    #[arg(long, help_heading = COST)]
    pub allow_long: bool,
    /// Report to write, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Number of threads, at most four for each processor or 64; results are independent of it [default: all
    /// processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), help_heading = COST)]
    pub threads: Option<u16>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub struct SimulateArguments {
    /// Flex-body file
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Scene with the motion (see docs/reference/scenes.md)
    #[arg(long, value_name = "SCENE.toml", help_heading = SCENE)]
    pub scene: PathBuf,
    /// Load case of the scene, by name [default: all, one after the other; file names contain the case names]
    #[arg(long, value_name = "NAME", requires = "scene", help_heading = SCENE)]
    pub case: Option<String>,
    /// Number of threads, at most four for each processor or 64; results are independent of it [default: all
    /// processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), help_heading = COST)]
    pub threads: Option<u16>,
    /// HDF5 file to write the motion to
    #[arg(short, long, value_name = "MOTION.h5", help_heading = OUTPUT)]
    pub output: Option<PathBuf>,
    /// Table to write the motion to
    #[arg(long, value_name = "MOTION.csv", help_heading = OUTPUT)]
    pub csv: Option<PathBuf>,
    /// File to write the rows of all recoveries of the body to, .csv or .h5
    #[arg(long, value_name = "ROWS.csv|ROWS.h5", help_heading = OUTPUT)]
    pub rows: Option<PathBuf>,
    /// File to write the largest stresses of every point of the recoveries over the motion to, over all load cases: a table
    /// (.csv), or the body with them at its nodes (.vtu); reports draw them as well
    #[arg(long, value_name = "FILE.csv|FILE.vtu", help_heading = OUTPUT)]
    pub envelope: Option<PathBuf>,
    /// Report to write, with plots as .html; format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub struct InspectArguments {
    /// Flex-body file
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Print groups, datasets, shapes and attributes as JSON instead (schemas/flexbody-file.schema.json)
    #[arg(long)]
    pub structure: bool,
    /// Report to write, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", conflicts_with = "structure", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Print all facts about the body instead of a summary
    #[arg(short, long, help_heading = OUTPUT)]
    pub verbose: bool,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Flex-body file
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Also recompute invariants and residuals from the matrices of this model, a manifest or the job of an FE program
    #[arg(long, value_name = "MODEL.toml|JOB.inp")]
    pub against: Option<PathBuf>,
    /// Job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct CompareArguments {
    /// Reference body
    #[arg(value_name = "A.flex.h5")]
    pub a: PathBuf,
    /// Body to compare with the reference
    #[arg(value_name = "B.flex.h5")]
    pub b: PathBuf,
    /// Compare what the bodies have in common: the modes of the body with fewer, each with the closest of the other, and
    /// the groups of the kinetic energy (W1, W2, W3) that both hold
    #[arg(long)]
    pub common: bool,
    /// Largest relative difference of a frequency
    #[arg(long, value_name = "REL", value_parser = ratio)]
    pub frequency: Option<f64>,
    /// Largest relative difference of the mass
    #[arg(long, value_name = "REL", value_parser = ratio)]
    pub mass: Option<f64>,
    /// Largest difference of the centre of mass relative to the radius of gyration
    #[arg(long, value_name = "REL", value_parser = ratio)]
    pub centre_of_mass: Option<f64>,
    /// Largest relative difference of the inertia
    #[arg(long, value_name = "REL", value_parser = ratio)]
    pub inertia: Option<f64>,
    /// Largest difference of an invariant relative to its Cauchy-Schwarz bound
    #[arg(long, value_name = "REL", value_parser = ratio)]
    pub invariants: Option<f64>,
    /// Report to write, whether the bodies agree or not; format by extension: .html, .json, .txt, .md (Markdown) or
    /// .xml (JUnit test cases) (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Options of printing.
#[derive(Debug, Clone, Copy, Args)]
pub struct Printing {
    /// Print one JSON object: results, diagnostics, whether all passed (schemas/output.schema.json)
    #[arg(long, help_heading = OUTPUT)]
    pub json: bool,
    /// Treat a warning as a failed check: exit code 1, and no file is written
    #[arg(long, help_heading = OUTPUT)]
    pub deny_warnings: bool,
    /// Print errors only
    #[arg(short, long, help_heading = OUTPUT)]
    pub quiet: bool,
}

/// Parses a number of bytes: `20G`, `512M`, `1.5GB`; powers of 1000.
fn memory_size(text: &str) -> Result<u64, String> {
    let text = text.trim_end_matches(['b', 'B']);
    let (number, factor) = match text.char_indices().last() {
        Some((at, unit)) if unit.is_ascii_alphabetic() => {
            let power = "kmgt".find(unit.to_ascii_lowercase()).ok_or("the unit is K, M, G or T")?;
            (&text[..at], 1000f64.powi(power as i32 + 1))
        }
        _ => (text, 1.0),
    };
    let bytes = number.trim().parse::<f64>().map_err(|e| e.to_string())? * factor;
    if (1.0..1e18).contains(&bytes) { Ok(bytes as u64) } else { Err("not a size of memory".to_owned()) }
}

/// Parses a positive ratio: `0.01` or `1%`.
fn ratio(text: &str) -> Result<f64, String> {
    let ratio = parse_ratio(text).filter(|value| *value > 0.0 && value.is_finite());
    ratio.ok_or_else(|| "expected a positive number or percentage (0.01 or 1%)".to_owned())
}

/// Parses a positive length, or a percentage of the largest extent of the body.
fn deflection(text: &str) -> Result<Deflection, String> {
    let deflection = if text.contains('%') {
        ratio(text).map(Deflection::PartOfExtent)
    } else {
        positive(text).map(Deflection::Length)
    };
    deflection
        .map_err(|_| "expected a positive length, or a percentage of the largest extent (1%)".to_owned())
}

/// Largest deflection of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Deflection {
    /// In the unit of length of the body.
    Length(f64),
    /// Relative to the largest extent of the body.
    PartOfExtent(f64),
}

fn stress_loads(text: &str) -> Result<StressLoads, String> {
    let names = StressLoads::NAMES.join(", ");
    StressLoads::parse(text).map_err(|name| format!("`{name}` is none of {names}, none"))
}

/// Reads the codes of accepted checks, or `all`.
fn accepted(text: &str) -> Result<Accepted, String> {
    if text == "all" {
        return Ok(Accepted::from(true));
    }
    Accepted::from_codes(text).map_err(|code| format!("`{code}` is none of {}", Accepted::possible()))
}

/// Parses a positive number.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}
