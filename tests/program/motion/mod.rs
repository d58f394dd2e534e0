//! Motion of bodies, as the program simulates it and examples join it.

mod carried;
mod joined;
mod mechanisms;
mod simulate;
