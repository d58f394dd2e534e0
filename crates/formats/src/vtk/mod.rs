//! Meshes of VTK, for ParaView and other programs that show results.

mod format;
mod grid;

pub(crate) use format::Vtk;
