//! Arguments of the commands that judge a body without a study, by ranges of motion and by a run of another program, and
//! of the commands for stresses: `shapes`, which asks an FE program for them, and `recover`, over a run.

use super::headings::OUTPUT;
use super::{Deflection, JobArguments, Printing, deflection, ratio};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `advise`.
#[derive(Debug, Args)]
pub struct AdviseArguments {
    /// Flex-body file with all terms
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Largest rotation rate of the body, in Hz
    #[arg(long, value_name = "HZ", default_value_t = 0.0)]
    pub spin: f64,
    /// Largest deflection of a node, in the unit of length of the body, or as a percentage of its largest extent [default: that which
    /// the rotation causes]
    #[arg(long, value_name = "LENGTH|PERCENT%", value_parser = deflection)]
    pub deflection: Option<Deflection>,
    /// Duration of the motions, in the unit of time of the body [default: five revolutions]
    #[arg(long, value_name = "TIME")]
    pub duration: Option<f64>,
    /// Mass attached to the body, in its unit of mass, at an interface or at the farthest node: MASS or MASS@INTERFACE
    #[arg(long, value_name = "MASS[@INTERFACE]")]
    pub attached: Option<String>,
    /// The rotation is prescribed by joints, as that of a driven crank
    #[arg(long)]
    pub rotation_given: bool,
    /// Largest error of attitude (rad), deflection and stress, and largest relative size of a term that a guideline leaves out
    #[arg(long, value_name = "REL", value_parser = ratio, default_value_t = 0.05)]
    pub limit: f64,
    /// Report to write, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `measure`.
#[derive(Debug, Args)]
pub struct MeasureArguments {
    /// Flex-body file of the body that the other program simulated
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Scene that the other program simulated
    #[arg(long, value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Load case of the scene, if it has several
    #[arg(long, value_name = "NAME")]
    pub case: Option<String>,
    /// Run of the other program: a table with the columns time, q_1 to q_n and, if known, attitude_0 to attitude_3
    #[arg(long, value_name = "RUN.csv")]
    pub history: PathBuf,
    /// Flex-body file with more modes of the same model, whose motion is the reference [default: the body itself]
    #[arg(long, value_name = "BODY.flex.h5", requires = "model")]
    pub reference: Option<PathBuf>,
    /// Model of both bodies: its manifest, or a job of an FE program
    #[arg(long, value_name = "MODEL", requires = "reference")]
    pub model: Option<PathBuf>,
    /// Report to write, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `recover`.
#[derive(Debug, Args)]
pub struct RecoverArguments {
    /// Flex-body file of a body with recoveries, whose motion the run is
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Run of any program: a table with the columns time, q_1 to q_n, angular_velocity_x to _z and, for every loaded
    /// interface, NAME force_x to _z and NAME torque_x to _z, along the axes of the model, which turn with the body
    #[arg(long, value_name = "RUN.csv")]
    pub history: PathBuf,
    /// Rows over time, format by extension: .csv or .h5
    #[arg(short, long, value_name = "FILE", required_unless_present = "channels", help_heading = OUTPUT)]
    pub output: Option<PathBuf>,
    /// Recovery to compute (repeatable) [default: all]
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Interface, or number of the node, that carries the body in the run of `simulate`: the motion is that of its frame,
    /// which matters to recoveries with the inertia of the deformation
    #[arg(long, value_name = "NAME")]
    pub carried_by: Option<String>,
    /// File to write the factor of each FE step over time to, .csv or .h5, for a fatigue program that superposes the
    /// results of these steps
    #[arg(long, value_name = "FILE.csv|FILE.h5", requires = "shapes", help_heading = OUTPUT)]
    pub channels: Option<PathBuf>,
    /// With --channels: archive that `flexbody shapes` wrote with the steps
    #[arg(long, value_name = "ASK.npz", requires = "channels")]
    pub shapes: Option<PathBuf>,
    /// File to write the largest stresses of every point of the recoveries over the run to: a table (.csv), or the body
    /// with them at its nodes (.vtu)
    #[arg(long, value_name = "FILE.csv|FILE.vtu", help_heading = OUTPUT)]
    pub envelope: Option<PathBuf>,
    /// Report to write, format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `shapes`.
#[derive(Debug, Args)]
pub struct ShapesArguments {
    /// Flex-body file whose modes and static columns are the shapes
    #[arg(value_name = "BODY.flex.h5")]
    pub body: PathBuf,
    /// Model of the body: its manifest, or the job of an FE program
    #[arg(long, value_name = "MODEL")]
    pub model: PathBuf,
    /// Job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Format to write
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = ShapeFormat::Calculix)]
    pub to: ShapeFormat,
    /// With --to calculix: deck of the model, from which elements and materials are taken [default: the deck of the
    /// model]
    #[arg(long, value_name = "DECK.inp")]
    pub deck: Option<PathBuf>,
    /// With --to calculix: nodes with stresses, as surface, all, or a table with the column node
    #[arg(long, value_name = "NODES", default_value = "surface")]
    pub nodes: String,
    /// With --to calculix: places of the stresses
    #[arg(long, value_enum, value_name = "PLACES", default_value_t = PlacesName::Nodes)]
    pub at: PlacesName,
    /// Also the six uniform strains, under which the stiffness knows the stresses of a solid: convert then compares the
    /// answers with it (component order, signs, units)
    #[arg(long)]
    pub uniform_strains: bool,
    /// Whole static responses to unit spin and unit loads at the interfaces instead of the shapes of a body, with a
    /// script that assembles the stiffness with the stress of each: geometric stiffness by CalculiX
    #[arg(long, conflicts_with = "uniform_strains")]
    pub geometric_stiffness: bool,
    /// Stresses that CalculiX printed for these responses: writes the deck of each load with its stress, and the tables
    /// of the manifest that read the results (the script calls this)
    #[arg(long, value_name = "STRESSES.dat", requires = "geometric_stiffness")]
    pub stresses: Option<PathBuf>,
    /// File to write; the archive from which the answers are read has its name with the extension .npz
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    pub output: PathBuf,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Format of shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ShapeFormat {
    /// Deck with a linear static step for each shape
    Calculix,
    /// Table step,column,node,ux,uy,uz
    Csv,
    /// Archive of NumPy: nodes, displacements (shapes x nodes x 3)
    Npz,
}

/// Places of stresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PlacesName {
    /// Nodes, with 15 digits; means over the elements at a node
    Nodes,
    /// Integration points of the elements at the nodes, with 7 digits
    IntegrationPoints,
}
