//! Equations of motion, their integration, and the resulting physics.

#![allow(unreachable_pub)] // tests export nothing

mod carried_response;
mod carried_stiffness;
mod channels;
mod definiteness;
mod dynamics;
mod dynamics_conservation;
mod dynamics_forms;
mod dynamics_geometric;
mod dynamics_loads;
mod equilibrium;
mod exponential_steps;
mod general_equations;
mod integration;
mod motion;
mod nodal_equations;
mod nodal_motion;
mod nodal_turning;
mod output_errors;
mod partial_bodies;
mod recovery;
mod rotation;
mod settled_rates;
mod slow_motion;
mod turning_nodes;
mod variations;
mod watched;
