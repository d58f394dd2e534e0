//! Metamorphic matrix: scene features crossed with transformations that must not change the physics, and with
//! the commands that judge a motion.

#![allow(unreachable_pub)] // tests export nothing

mod bodies;
mod carried_mass;
mod commands;
mod correspondence;
mod draws;
mod features;
mod matrix;
mod named_loads;
mod nodes_in_world;
mod outputs;
mod recoveries;
mod scenes;
mod shrink;
mod stress;
mod subject;
mod text;
mod transformations;

/// Number of crossings of the plain test: about half a minute on two cores.
const FEW: u64 = 30;

/// Number of crossings of the slow test: within three minutes on two cores.
const MANY: u64 = 90;

#[test]
fn crossings_keep_the_physics() {
    matrix::hold(1, FEW);
}

#[test]
#[ignore = "slow"]
fn many_crossings_keep_the_physics() {
    matrix::hold(1011, MANY);
}
