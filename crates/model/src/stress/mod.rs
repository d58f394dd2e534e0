//! Geometric stiffness against what the stress of its load makes it do under rigid motion (theory section 7).

mod check;
mod fit;
mod loads;
mod relations;

pub(super) use check::check_stress;
