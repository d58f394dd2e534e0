//! Exports that are sets of named arrays, and decks of solvers: `json`, `npz`, `adams-invariants`,
//! `openradioss`, `chrono`, `simscape`. Each is read back by a strict reader of its layout and compared with
//! the body, for all fixture models.

mod adams;
mod chrono;
mod entries;
mod losses;
mod matrices;
mod openradioss;
mod readers;
