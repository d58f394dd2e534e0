//! Sparse linear algebra: sums beyond rounding, in exact arithmetic.

#![allow(unreachable_pub)] // nothing outside reads a test

mod arithmetic;
