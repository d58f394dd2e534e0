//! Modal bases: which shapes span the deformation of a body, each kind in one file.

mod free_surface;

pub use free_surface::{FreeSurfaceModes, ModeSettings, free_surface, free_surface_of, free_surface_resumed};
