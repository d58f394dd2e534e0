//! Command `flexbody recipe`.

use super::arguments::RecipeArguments;
use super::outcome::Outcome;
use flexbody_base::error::Result;
use flexbody_input::Recipe;

pub(super) fn run(arguments: &RecipeArguments) -> Result<Outcome> {
    let recipe = Recipe::of(&arguments.program)?;
    let steps = recipe.steps.iter();
    let steps: Vec<_> =
        steps.map(|step| serde_json::json!({ "place": step.place, "lines": step.lines })).collect();
    let json = serde_json::json!({ "program": recipe.program, "steps": steps, "mind": recipe.mind });
    Ok(Outcome { text: recipe.to_string(), json: format!("{json:#}"), diagnostics: Vec::new(), passed: true })
}
