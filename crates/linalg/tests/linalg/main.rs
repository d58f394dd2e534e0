//! Sparse linear algebra: factors compared with dense algebra, compensated sums with exact arithmetic.

#![allow(unreachable_pub)] // nothing outside reads a test

mod arithmetic;
mod factors;
