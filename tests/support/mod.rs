//! What tests share: exact small FE models, a dense eigen-solver as independent oracle, random numbers.
//! Every test binary uses its own part of it.
#![allow(dead_code)]

pub mod elements;
pub mod files;
pub mod mesh;
pub mod pipeline;
pub mod random;
pub mod reference;
