//! Arguments of the command for frequency responses.

use super::headings::{COST, MODES, OUTPUT, SCENE};
use super::{JobArguments, Printing, names, ratio};
use clap::Args;
use flexbody_body::basis::BasisKind;
use flexbody_study::response::{Band, ResponseSettings};
use std::path::PathBuf;

/// Heading of the options that state places and frequencies.
const PLACES: &str = "Places and frequencies";

/// Arguments of `response`.
#[derive(Debug, Args)]
pub struct ResponseArguments {
    /// Manifest of the model or the job of an FE program, whose matrices determine the errors; or a flex-body file
    /// alone, whose errors are then unknown
    #[arg(value_name = "MODEL.toml|JOB.inp|BODY.flex.h5")]
    pub model: PathBuf,
    /// Flex-body file that was made of the model [default: the model is converted]
    #[arg(value_name = "BODY.flex.h5")]
    pub body: Option<PathBuf>,
    /// Job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Place of unit forces: an interface or a node number, optionally a colon and directions of x, y, z, rx, ry, rz
    /// with commas [default: the displacements; with --scene the places of its loads] (repeatable)
    #[arg(long, value_name = "PLACE[:DIRECTIONS]", help_heading = PLACES)]
    pub from: Vec<String>,
    /// Interface whose acceleration excites the body, in place of forces: its other directions are at rest
    #[arg(long, value_name = "INTERFACE[:DIRECTIONS]", conflicts_with = "from", help_heading = PLACES)]
    pub base: Option<String>,
    /// Rows of a recovery of the body, all of them or one (repeatable)
    #[arg(long, value_name = "RECOVERY[:ROW]", help_heading = PLACES)]
    pub rows: Vec<String>,
    /// Place of measured displacements, in the same form [default: with --scene its watched points] (repeatable)
    #[arg(long, value_name = "PLACE[:DIRECTIONS]", help_heading = PLACES)]
    pub to: Vec<String>,
    /// Frequencies in hertz [default: up to the band of the scene]
    #[arg(long, value_name = "LOW..HIGH", value_parser = band, help_heading = PLACES)]
    pub band: Option<Band>,
    /// Scene whose loads, watched points, band and damping are used unless stated otherwise
    #[arg(long, value_name = "SCENE.toml", help_heading = SCENE)]
    pub scene: Option<PathBuf>,
    /// Load case of the scene, by name (required for a scene with load cases)
    #[arg(long, value_name = "NAME", requires = "scene", help_heading = SCENE)]
    pub case: Option<String>,
    /// Largest relative error; if it is exceeded the exit code is 1
    #[arg(long, value_name = "REL", default_value_t = ResponseSettings::TOLERANCE, value_parser = ratio, help_heading = COST)]
    pub tolerance: f64,
    /// Approximate number of frequencies of the curves
    #[arg(long, value_name = "N", default_value_t = ResponseSettings::POINTS as u32, value_parser = clap::value_parser!(u32).range(2..=100_000), help_heading = COST)]
    pub points: u32,
    /// Approximate number of frequencies at which the equations of all nodes are solved; half of them lie at resonances
    #[arg(long, value_name = "N", default_value_t = ResponseSettings::SOLVES as u32, value_parser = clap::value_parser!(u32).range(2..=10_000), help_heading = COST)]
    pub solves: u32,
    /// For a model without a body: number of modes [default: 20]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = MODES)]
    pub modes: Option<u32>,
    /// For a model without a body: basis [default: free]
    #[arg(long, value_parser = names::basis(), help_heading = MODES)]
    pub basis: Option<BasisKind>,
    /// For a model without a body: static responses to add to free modes, as in `convert`
    #[arg(long, value_name = "LOADS", help_heading = MODES)]
    pub residual_vectors: Option<String>,
    /// Allow work that is estimated to take more than half an hour
    #[arg(long, help_heading = COST)]
    pub allow_long: bool,
    /// Table of the functions to write
    #[arg(long, value_name = "RESPONSE.csv", help_heading = OUTPUT)]
    pub csv: Option<PathBuf>,
    /// Table of spectral densities of a random excitation: one-sided, per hertz, with the column hertz and a column
    /// PLACE:DIRECTION for each input of --from or --base; adds root mean squares
    #[arg(long, value_name = "PSD.csv", help_heading = PLACES)]
    pub psd: Option<PathBuf>,
    /// Root mean squares of all rows and points to write: .csv, or .vtu with the von Mises stress at the nodes
    #[arg(long, value_name = "RMS.csv|.vtu", requires = "psd", help_heading = OUTPUT)]
    pub rms: Option<PathBuf>,
    /// Report to write, with plots as .html; format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    pub report: Vec<PathBuf>,
    /// Number of threads; results are independent of it [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), help_heading = COST)]
    pub threads: Option<u16>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Parses a band such as `0..2000`.
fn band(text: &str) -> Result<Band, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let ends = text.split_once("..").and_then(|(low, high)| Some((number(low)?, number(high)?)));
    let band = ends.and_then(|(low, high)| Band::new(low, high));
    band.ok_or_else(|| "expected two frequencies in hertz, the lower one first, as in 0..2000".to_owned())
}
