//! What can be said on the command line about transfer functions.

use super::{JobArguments, Printing, names, positive};
use clap::Args;
use flexbody_body::basis::BasisKind;
use flexbody_study::response::{Band, ResponseSettings};
use std::path::PathBuf;

/// Arguments of `response`.
#[derive(Debug, Args)]
pub struct ResponseArguments {
    /// Manifest of the model or the job of an FE program, whose matrices say how large the errors are; or a
    /// flex-body file alone, whose error is then not known
    #[arg(value_name = "MODEL.toml|JOB.inp|BODY.flex.h5")]
    pub model: PathBuf,
    /// Flex-body file that was made of the model [default: the model is converted]
    #[arg(value_name = "BODY.flex.h5")]
    pub body: Option<PathBuf>,
    /// The job of an FE program.
    #[command(flatten)]
    pub job: JobArguments,
    /// Where unit forces act: an interface or a node number, and after a colon directions of x, y, z, rx, ry,
    /// rz with commas [default: the displacements; with --scene where its loads act] (repeatable)
    #[arg(long, value_name = "PLACE[:DIRECTIONS]")]
    pub from: Vec<String>,
    /// Where displacements are read, in the same way [default: with --scene what it watches] (repeatable)
    #[arg(long, value_name = "PLACE[:DIRECTIONS]")]
    pub to: Vec<String>,
    /// Frequencies in hertz [default: up to the band of the scene]
    #[arg(long, value_name = "LOW..HIGH", value_parser = band)]
    pub band: Option<Band>,
    /// Scene whose loads, watched points, band and damping are taken where nothing else is said
    #[arg(long, value_name = "SCENE.toml")]
    pub scene: Option<PathBuf>,
    /// Load case of the scene to take, by its name (a scene with cases needs one)
    #[arg(long, value_name = "NAME", requires = "scene")]
    pub case: Option<String>,
    /// Damping ratio of the modes of a body that has no damping of its own
    #[arg(long, value_name = "RATIO", value_parser = damping_ratio)]
    pub damping: Option<f64>,
    /// Largest relative error; beyond it the exit code is 1
    #[arg(long, value_name = "REL", default_value_t = ResponseSettings::TOLERANCE, value_parser = positive)]
    pub tolerance: f64,
    /// About as many frequencies the curves have
    #[arg(long, value_name = "N", default_value_t = ResponseSettings::POINTS as u32, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub points: u32,
    /// At about as many frequencies the equations of all nodes are solved; half of them lie at resonances
    #[arg(long, value_name = "N", default_value_t = ResponseSettings::SOLVES as u32, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    pub solves: u32,
    /// Of a model without a body: number of modes [default: 20]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub modes: Option<u32>,
    /// Of a model without a body: what the modes are made of [default: free]
    #[arg(long, value_parser = names::basis())]
    pub basis: Option<BasisKind>,
    /// Of a model without a body: static responses to add to free modes, as `convert` has them
    #[arg(long, value_name = "LOADS")]
    pub residual_vectors: Option<String>,
    /// Do work that is estimated to take more than half an hour
    #[arg(long)]
    pub allow_long: bool,
    /// Table to write the functions to
    #[arg(long, value_name = "RESPONSE.csv")]
    pub csv: Option<PathBuf>,
    /// Report to write, with plots as .html; format by extension: .html, .json or .txt (repeatable)
    #[arg(long, value_name = "FILE")]
    pub report: Vec<PathBuf>,
    /// Threads; results do not depend on it [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// How to print.
    #[command(flatten)]
    pub printing: Printing,
}

/// `0..2000`.
fn band(text: &str) -> Result<Band, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let ends = text.split_once("..").and_then(|(low, high)| Some((number(low)?, number(high)?)));
    let band = ends.and_then(|(low, high)| Band::new(low, high));
    band.ok_or_else(|| "two frequencies in hertz are expected, the lower one first: 0..2000".to_owned())
}

/// A finite number from 0.
fn damping_ratio(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ratio) if ratio.is_finite() && ratio >= 0.0 => Ok(ratio),
        _ => Err("a finite number from 0 is expected (2 % is 0.02, critical damping is 1)".to_owned()),
    }
}
