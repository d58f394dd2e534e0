//! Bodies converted by the program.

mod checked_against;
mod interface_frame;
