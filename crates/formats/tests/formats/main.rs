//! Files of other programs: exports, imports, round trips.

#![allow(unreachable_pub)] // tests export nothing

mod checklists;
mod export_arrays;
mod export_embedded;
mod export_mbs;
mod export_sid;
mod import_mbs;
mod import_sid;
mod loss_errors;
mod round_trips;
mod stresses;
