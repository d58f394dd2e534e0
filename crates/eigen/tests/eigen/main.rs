//! The eigen-solver: modes, bounds, counts, responses and refusals, against closed forms and exact arithmetic.

#![allow(unreachable_pub)] // nothing outside reads a test

mod beyond_rounding;
mod certified;
mod counts;
mod failures;
mod grid;
mod responses;
mod ways;
