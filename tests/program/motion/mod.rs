//! Motion of bodies, simulated by the program and joined by examples.

mod carried;
mod joined;
mod mechanisms;
mod recovery;
mod shapes;
mod simulate;
mod stiffening;
