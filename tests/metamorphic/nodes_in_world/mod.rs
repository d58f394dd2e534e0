//! An oracle outside of the kinematics of the library: positions of all nodes in the world, a constant mass matrix, and
//! an elastic force that a rotation of the nodes carries along. It shares no code with `crates/motion`.

mod absolute;
mod corotation;
mod integration;
mod tests;
