//! Oracle independent of the kinematics of the library: positions of all nodes in the world, a constant mass
//! matrix, and an elastic force carried by a rotation of the nodes. It shares no code with `crates/motion`.

mod absolute;
mod corotation;
mod integration;
mod tests;
