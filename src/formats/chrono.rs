//! Project Chrono: matrices for `ChModalAssembly::DoModalReduction(M, K, Cq, ...)` and
//! `ChModalDampingReductionR(R)` as Matrix Market files.
//!
//! These calls take the matrices of boundary nodes, then internal nodes, six coordinates each. The boundary
//! nodes are the frames; the amplitudes of the fixed-interface modes stand in the place of internal nodes,
//! filled up to six by coordinates without mass, which no mode moves.

use super::export::interface_matrices::{InterfaceMatrices, matrix_losses};
use super::export::{ExportFormat, ExportOptions, Exported};
use crate::base::error::Result;
use crate::body::flex_body::FlexBody;
use faer::Mat;
use std::fmt::Write;

/// The format.
pub(crate) struct Chrono;

impl ExportFormat for Chrono {
    fn name(&self) -> &'static str {
        "chrono"
    }

    fn reader(&self) -> &'static str {
        "Project Chrono, ChModalAssembly: matrices for DoModalReduction"
    }

    fn losses(&self, body: &FlexBody, options: &ExportOptions) -> Vec<String> {
        matrix_losses(body, options)
    }

    fn write(&self, body: &FlexBody, _: &ExportOptions) -> Result<Exported> {
        let told = InterfaceMatrices::of(body, "chrono")?;
        let size = told.mass.nrows();
        let modal = size - 6 * told.frames.len();
        let filled = size.next_multiple_of(6);
        // Any stiffness will do where there is no mass; one of the size of the others does no harm to their
        // digits.
        let stiffness = told.stiffness.norm_max();
        let matrix = |a: &Mat<f64>, fill: f64| {
            matrix_market(filled, |i, j| match (i < size, j < size) {
                (true, true) => a[(i, j)],
                _ if i == j => fill,
                _ => 0.0,
            })
        };
        let mut table = format!(
            "# boundary nodes in the order of the matrices, then {} internal nodes in place of {modal} fixed-interface modes\nname,x,y,z\n",
            (filled - 6 * told.frames.len()) / 6
        );
        for (name, [x, y, z]) in &told.frames {
            let name = name.replace('"', "\"\"");
            writeln!(table, "\"{name}\",{x:e},{y:e},{z:e}").expect("writing to a String cannot fail");
        }
        let mut beside = vec![
            ("M.mtx".into(), matrix(told.mass, 0.0)),
            ("K.mtx".into(), matrix(told.stiffness, stiffness)),
        ];
        beside.extend(told.damping.as_ref().map(|damping| ("R.mtx".into(), matrix(damping, 0.0))));
        Ok(Exported { file: table.into_bytes(), beside })
    }
}

/// A symmetric matrix in all its entries, since readers of the general kind are the most common; zeros are
/// left out.
fn matrix_market(size: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<u8> {
    let places = (0..size).flat_map(|j| (0..size).map(move |i| (i, j)));
    let entries: Vec<(usize, usize, f64)> =
        places.map(|(i, j)| (i + 1, j + 1, entry(i, j))).filter(|(_, _, v)| *v != 0.0).collect();
    let mut text =
        format!("%%MatrixMarket matrix coordinate real general\n{size} {size} {}\n", entries.len());
    for (i, j, v) in entries {
        writeln!(text, "{i} {j} {v:e}").expect("writing to a String cannot fail");
    }
    text.into_bytes()
}
