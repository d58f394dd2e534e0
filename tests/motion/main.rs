//! Equations of motion, scenes and their simulation, and the physics that must come out.

#[path = "../support/mod.rs"]
mod support;

mod carried;
mod continuous_motion;
mod dynamics;
mod dynamics_conservation;
mod dynamics_forms;
mod dynamics_geometric;
mod dynamics_loads;
mod equilibrium;
mod general_equations;
mod histories;
mod joined;
mod motion;
mod nodal_equations;
mod nodal_motion;
mod nodal_turning;
mod physics;
mod scene_frames;
mod settled_rates;
mod simulate;
mod watched;
