//! Arguments of the commands that read bodies of other programs.

use super::headings::MODEL;
use super::{Printing, ratio};
use clap::Args;
use clap::builder::PossibleValue;
use flexbody_formats::IMPORT_FORMATS;
use std::path::PathBuf;

/// Arguments of `convert` for a body of another program.
#[derive(Debug, Clone, Args)]
pub struct ForeignArguments {
    /// Convert the body in a file of another program instead of making one from a model
    #[arg(long, value_name = "FORMAT", value_parser = foreign_formats(), conflicts_with_all = ["modes", "max_frequency", "basis", "shapes", "residual_vectors", "accuracy", "factor", "memory_limit", "allow_long", "lumped", "lumped_modes", "scene", "case", "split", "terms", "keep_modes", "fixed_interface_modes", "motion_shapes", "allow_implausible", "keep_soft_rotations", "like", "mesh_triangles", "no_mesh", "format", "matrices", "dimension", "interface", "damping", "geometric_stiffness", "stress"], help_heading = MODEL)]
    pub from: Option<String>,
}

/// Arguments of `audit`.
#[derive(Debug, Args)]
pub struct AuditArguments {
    /// SID_FEM, MBDyn .fem, MBSim or Exudyn file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Format of the file [default: detected from its content]
    #[arg(long, value_name = "FORMAT", value_parser = foreign_formats())]
    pub from: Option<String>,
    /// Tolerance of the identities, relative to the size of their terms
    #[arg(long, value_name = "REL", default_value_t = 1e-6, value_parser = ratio)]
    pub tolerance: f64,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Returns the names of the formats that can be read.
fn foreign_formats() -> clap::builder::PossibleValuesParser {
    IMPORT_FORMATS.iter().map(|format| PossibleValue::new(format.name())).collect::<Vec<_>>().into()
}
