//! Arguments of the command that writes shapes for the stresses of an FE program.

use super::{JobArguments, Printing};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

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
    /// File to write; the archive from which the answers are read has its name with the extension .npz
    #[arg(short, long, value_name = "FILE")]
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
