//! Binary glTF 2.0: a body in motion, for viewers and the web.

mod animations;
mod binary;
mod format;
mod vertices;

pub(crate) use format::Gltf;
