//! Arguments of the commands that guide: `doctor`, `completions`, `man`, `recipe`.

use super::Printing;
use clap::Args;
use clap::builder::PossibleValue;
use flexbody_input::RECIPES;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
pub struct DoctorArguments {
    /// How to print.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
    /// How to print.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Command that the page is about [default: the program]
    #[arg(value_name = "COMMAND")]
    pub command: Option<String>,
    /// How to print.
    #[command(flatten)]
    pub printing: Printing,
}

/// Arguments of `recipe`.
#[derive(Debug, Args)]
pub struct RecipeArguments {
    /// FE program
    #[arg(value_name = "PROGRAM", value_parser = recipes())]
    pub program: String,
    /// How to print.
    #[command(flatten)]
    pub printing: Printing,
}

/// Names of the programs that there are recipes for.
fn recipes() -> clap::builder::PossibleValuesParser {
    RECIPES.iter().map(|recipe| PossibleValue::new(recipe.program)).collect::<Vec<_>>().into()
}
