//! Picture exports `vtk` and `gltf`. Each is read back by a strict reader of its layout and compared with the
//! body, for all fixture models, for random bodies, and for a motion.

mod gltf;
mod motion;
mod options;
mod readers;
mod vtk;
