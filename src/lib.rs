//! Exact flexible bodies for multibody simulation from finite element matrices.
//!
//! `flexbody` reads the consistent mass matrix M and stiffness matrix K of a free body, computes its
//! free-surface mass-normalised modes and condenses the nodal floating-frame equations of motion, without a
//! lumped-mass approximation, into the constant invariants I0, W1, W2, W3. Sources of every equation and the
//! errata of the literature: `docs/theory.md`.
//!
//! Rooms and the arrows between them: `ARCHITECTURE.md`; `tests/program/architecture.rs` holds them.

pub mod base;
pub mod body;
pub mod cli;
pub mod formats;
pub mod input;
pub mod model;
pub mod motion;
pub mod numerics;
pub mod report;
pub mod study;
