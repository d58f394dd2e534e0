//! Finite element models of own elements.

#![allow(unreachable_pub)] // nothing outside reads a test

mod assembler;
mod stress_relations;
