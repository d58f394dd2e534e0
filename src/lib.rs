//! Exact flexible bodies for multibody simulation from finite element matrices.
//!
//! `flexbody` reads the consistent mass matrix M and stiffness matrix K of a free body, computes its
//! free-surface mass-normalised modes and condenses the nodal floating-frame equations of motion, without a
//! lumped-mass approximation, into the constant invariants I0, W1, W2, W3. Sources of every equation and the
//! errata of the literature: `docs/theory.md`.
//!
//! Rooms and the arrows between them: `ARCHITECTURE.md`; `tests/architecture.rs` holds them.

pub mod basis;
pub mod cli;
pub mod convert;
pub mod diagnostic;
pub mod dynamics;
pub mod eigen;
pub mod error;
pub mod export;
pub mod flex_body;
pub mod foreign;
mod hdf5_file;
pub mod input;
pub mod integration;
pub mod invariants;
pub mod linalg;
pub mod memory;
pub mod model;
pub mod output;
pub mod progress;
pub mod provenance;
pub mod report;
pub mod scene;
pub mod selection;
pub mod store;
pub mod tailoring;
pub mod trade;
pub mod units;
pub mod verification;
