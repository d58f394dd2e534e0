//! Files of bodies: our own, and those of other programs.

#[path = "../support/mod.rs"]
mod support;

mod exchange_command;
mod export_arrays;
mod export_embedded;
mod export_mbs;
mod export_pictures;
mod export_sid;
mod import_body;
mod import_mbs;
mod import_sid;
mod partial_files;
mod round_trips;
mod short_storage;
mod store_body;
mod store_digest;
mod store_output;
mod store_refusals;
mod store_roundtrip;
mod store_schema;
