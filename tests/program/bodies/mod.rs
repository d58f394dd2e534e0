//! Bodies, as the program converts them.

mod interface_frame;
