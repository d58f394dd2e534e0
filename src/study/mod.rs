//! What a scene needs of a body, and what accuracy costs there.

pub mod selection;
pub mod tailoring;
pub mod trade;
