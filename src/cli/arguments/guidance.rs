//! Arguments of the commands that guide: `doctor`, `completions`, `man`, `recipe`, `explain`.

use super::Printing;
use clap::Args;
use clap::builder::PossibleValue;
use flexbody_input::RECIPES;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
pub struct DoctorArguments {
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// Shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Command of the page [default: the program]
    #[arg(value_name = "COMMAND")]
    pub command: Option<String>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `recipe`.
#[derive(Debug, Args)]
pub struct RecipeArguments {
    /// FE program
    #[arg(value_name = "PROGRAM", value_parser = recipes())]
    pub program: String,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// Code of a message: FB408, fb408 or 408 [default: all codes, in one line each]
    #[arg(value_name = "CODE")]
    pub code: Option<String>,
    /// Options of printing.
    #[command(flatten)]
    pub printing: Printing,
}

/// Returns the names of the programs with recipes.
fn recipes() -> clap::builder::PossibleValuesParser {
    RECIPES.iter().map(|recipe| PossibleValue::new(recipe.program)).collect::<Vec<_>>().into()
}
