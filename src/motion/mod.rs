//! How bodies move: equations of motion, reduced and of all nodes, and the scene, which says what a body is
//! to do. No decisions about terms and modes.

pub mod dynamics;
pub mod scene;
