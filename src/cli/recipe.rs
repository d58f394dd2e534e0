//! Command `flexbody recipe`.

use super::arguments::RecipeArguments;
use super::outcome::Outcome;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_input::RECIPES;

pub(super) fn run(arguments: &RecipeArguments) -> Result<Outcome> {
    let recipe = RECIPES.iter().find(|recipe| recipe.program == arguments.program);
    let Some(recipe) = recipe else {
        let message = format!("`{}` has no recipe", arguments.program);
        return Err(Diagnostic::new(Code::Usage, message).into());
    };
    let steps = recipe.steps.iter().map(|step| format!("{}:\n\n{}\n\n", step.place, step.lines));
    let text = steps.collect::<String>() + &format!("Mind: {}.\n", recipe.mind);
    let steps = recipe.steps.iter();
    let steps: Vec<_> =
        steps.map(|step| serde_json::json!({ "place": step.place, "lines": step.lines })).collect();
    let json = serde_json::json!({ "program": recipe.program, "steps": steps, "mind": recipe.mind });
    Ok(Outcome { text, json: format!("{json:#}"), diagnostics: Vec::new(), passed: true })
}
