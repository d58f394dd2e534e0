//! Exports that are sets of named arrays, and decks of solvers: `json`, `npz`, `adams-invariants`, `openradioss`, `chrono`, `simscape`. Each is
//! read back by a strict reader of its layout and compared with the body, for all fixture models.

#[path = "../export_support/mod.rs"]
mod export_support;
#[path = "../store_support/mod.rs"]
mod store_support;
#[path = "../support/mod.rs"]
mod support;

mod adams;
mod entries;
mod losses;
mod matrices;
mod openradioss;
mod readers;
