//! From matrices in memory to a flex-body file: a steel truss of 3 x 3 x 8 bays, its rods with consistent
//! mass.
//!
//!     cargo run --release --example from_memory -- truss.flex.h5

#![allow(unreachable_pub)] // modules that several examples share

mod truss;

use flexbody::{ConvertOptions, FlexBody, Model, Result, SparseMatrix};
use std::path::Path;

fn main() -> Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "truss.flex.h5".to_owned());
    let body = write_truss(Path::new(&path))?;
    println!("{path}: mass {} kg, frequencies {:?} Hz", body.mass(), body.frequencies_hz());
    Ok(())
}

/// Converts the truss with 8 modes and writes it.
pub fn write_truss(path: &Path) -> Result<FlexBody> {
    let (stiffness, mass, positions) = truss::truss();
    let ids: Vec<i64> = (1..=positions.len() as i64).collect();
    let foot = ids.iter().zip(&positions).filter(|(_, x)| x[2] == 0.0).map(|(&id, _)| id).collect();
    // Every check that the program makes is made here; warnings and notes come with the model.
    let model = Model::builder("truss", SparseMatrix::from_sprs(&stiffness), SparseMatrix::from_sprs(&mass))
        .nodes(ids, positions)
        .units("m", "kg", "s")?
        .interface("foot", foot)
        .build()?;
    let body = model.convert(&ConvertOptions::default().modes(8))?.body;
    body.write(path)?;
    Ok(body)
}
