//! Selections and trade studies compared with motions of all nodes.

#![allow(unreachable_pub)] // tests export nothing

mod advice;
mod continuous_motion;
mod forces_of_motion;
mod named_loads;
mod nodal_reference;
mod random_response;
mod random_verdicts;
mod recovery_limits;
mod reference;
mod scene_frames;
mod selection_bounds;
mod selection_carried;
mod selection_craig_bampton;
mod selection_reasons;
mod selection_verdicts;
mod skewed_beam;
mod stresses_in_motion;
