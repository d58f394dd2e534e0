//! Check of geometric stiffness by its behaviour under rigid motion (theory section 7).

mod check;
mod fit;
mod loads;
mod relations;

pub(super) use check::check_stress;
