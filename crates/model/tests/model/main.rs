//! Finite element models assembled from own elements.

#![allow(unreachable_pub)] // tests export nothing

mod assembler;
mod internal_rows;
mod strained;
mod stress_components;
mod stress_relations;
mod uniform_strains;
