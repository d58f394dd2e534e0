//! Oracles of the tests: exact small finite element models, rational arithmetic, dense reference solutions, and
//! equations of motion written from definitions; and the fixtures. Nothing here belongs to the published crates.
//!
//! Each feature adds the modules that need one crate more, so that the tests of a crate build no crate above it.

pub mod cases;
pub mod counted;
pub mod cuboid;
pub mod damage;
pub mod elements;
pub mod equations;
pub mod exact;
pub mod integrate;
pub mod models;
pub mod random;

#[cfg(feature = "model")]
pub mod attached;
#[cfg(feature = "model")]
pub mod beams;
#[cfg(feature = "model")]
pub mod brackets;
#[cfg(feature = "model")]
pub mod carried_mass;
#[cfg(feature = "model")]
pub mod files;
#[cfg(feature = "model")]
pub mod general;
#[cfg(feature = "model")]
pub mod held;
#[cfg(feature = "model")]
pub mod mesh;
#[cfg(feature = "model")]
pub mod plane;
#[cfg(feature = "model")]
pub mod reference;
#[cfg(feature = "model")]
pub mod rounding;
#[cfg(feature = "model")]
pub mod sheet;
#[cfg(feature = "model")]
pub mod turned_energy;
#[cfg(feature = "model")]
pub mod turning;

#[cfg(feature = "body")]
pub mod craig_bampton;
#[cfg(feature = "body")]
pub mod file_bodies;
#[cfg(feature = "body")]
pub mod jobs;
#[cfg(feature = "body")]
pub mod nodal;
#[cfg(feature = "body")]
pub mod partial;
#[cfg(feature = "body")]
pub mod pipeline;

#[cfg(feature = "motion")]
pub mod flexible;
#[cfg(feature = "motion")]
pub mod motion;
#[cfg(feature = "motion")]
pub mod scenes;
#[cfg(feature = "motion")]
pub mod unreduced;

#[cfg(feature = "formats")]
pub mod exported;

#[cfg(feature = "report")]
pub mod report_bodies;

use std::path::{Path, PathBuf};

/// Returns the folder of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the folder of shared models and sample files beside the workspace, or the folder in `FLEXBODY_SHARED`. Tests
/// that use it skip it if it is missing.
pub fn shared() -> PathBuf {
    std::env::var_os("FLEXBODY_SHARED").map_or_else(|| root().join("../shared"), PathBuf::from)
}

/// Returns the folder of the fixtures.
pub fn fixtures() -> PathBuf {
    root().join("fixtures")
}

/// Returns the names of the entries of a folder, sorted.
pub fn members(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("an entry").file_name().into_string().expect("our own names")).collect();
    names.sort();
    names
}
