//! The eigen-solver: modes, bounds, counts, responses and refusals, against closed forms and exact arithmetic.

#![allow(unreachable_pub)] // tests export nothing

mod beyond_rounding;
mod certified;
mod counts;
mod failures;
mod grid;
mod responses;
mod ways;
