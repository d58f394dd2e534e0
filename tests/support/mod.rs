//! What tests share: exact small FE models, a dense eigen-solver as independent oracle, random numbers.
//! Every test binary uses its own part of it.
#![allow(dead_code)]

pub mod attached;
pub mod beams;
pub mod cases;
pub mod cuboid;
pub mod elements;
pub mod equations;
pub mod exported;
pub mod file_bodies;
pub mod files;
pub mod flexible;
pub mod general;
pub mod held;
pub mod integrate;
pub mod jointed;
pub mod mesh;
pub mod models;
pub mod motion;
pub mod nodal;
pub mod partial;
pub mod pipeline;
pub mod plane;
pub mod program;
pub mod random;
pub mod reference;
pub mod report_bodies;
pub mod scenes;
pub mod turned_energy;
pub mod turning;
pub mod unreduced;
