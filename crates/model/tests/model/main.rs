//! Finite element models assembled from own elements.

#![allow(unreachable_pub)] // nothing outside reads a test

mod assembler;
mod stress_relations;
