//! What a scene needs of a body, and what accuracy costs.

#[path = "../support/mod.rs"]
mod support;

mod load_cases;
mod nodal_reference;
mod output_errors;
mod random_verdicts;
mod reference;
mod response;
mod scene_damping;
mod select_command;
mod selection_bounds;
mod selection_verdicts;
mod tailoring;
mod trade;
