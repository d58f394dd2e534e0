//! Bodies converted by the program.

mod interface_frame;
