//! Sparse linear algebra: factors against dense algebra, sums beyond rounding against exact arithmetic.

#![allow(unreachable_pub)] // nothing outside reads a test

mod arithmetic;
mod factors;
