//! The flex-body file: round trips, refusals, digest, schema.

#![allow(unreachable_pub)] // tests export nothing

mod body_units;
mod certified_bodies;
mod general_models;
mod statements;
mod store_digest;
mod store_output;
mod store_refusals;
mod store_roundtrip;
mod store_schema;
