//! The eigen-solver, against exact counts.

#![allow(unreachable_pub)] // nothing outside reads a test

mod beyond_rounding;
mod certified;
