//! Selections, trade studies and responses by the program.

mod load_cases;
mod measured_run;
mod missing_stress;
mod recommended_command;
mod response;
mod scene_damping;
mod select_command;
mod tailoring;
mod trade;
