//! Sparse linear algebra: factors compared with dense algebra, compensated sums with exact arithmetic.

#![allow(unreachable_pub)] // tests export nothing

mod arithmetic;
mod factors;
mod parallel;
