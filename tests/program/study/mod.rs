//! What a scene needs and what accuracy costs, as the program says it.

mod load_cases;
mod response;
mod scene_damping;
mod select_command;
mod tailoring;
mod trade;
