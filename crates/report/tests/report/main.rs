//! Reports and comparisons of bodies.

#![allow(unreachable_pub)] // tests export nothing

mod comparison_coverage;
mod comparison_metamorphic;
mod craig_bampton;
mod damping;
mod first_view;
mod geometric_stiffness;
mod histories;
mod import_body;
mod imported_shapes;
mod partial_files;
mod report;
mod report_comparison;
