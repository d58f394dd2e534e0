//! Matrices stored in full as one array of NumPy (`numpy.save`).

use super::compressed::assemble_array;
use super::reader::{ArraySource, MatrixSource, Reader};
use crate::array::Array;
use crate::npy;
use flexbody_base::diagnostic::{Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::RawMatrix;

/// Reader of arrays of NumPy.
pub(crate) struct Npy;

const HELP: &str = "write it again: numpy.save(file, K)";
const BOTH_TRIANGLES: &str = "save both triangles: K + numpy.tril(K, -1).T";

impl Reader for Npy {
    fn name(&self) -> &'static str {
        "NumPy"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["npy"]
    }

    fn recognises(&self, head: &[u8]) -> bool {
        npy::recognises(head)
    }

    fn read(&self, source: &MatrixSource<'_>) -> Result<RawMatrix> {
        let read = source.has_one_matrix("an array of NumPy").and_then(|()| read(source));
        read.map_err(|diagnostic| Error::from(diagnostic.in_file(source.file.path())))
    }

    fn read_array(&self, source: &ArraySource<'_>) -> Option<Diagnosed<Array>> {
        let read = || {
            source.file.load()?;
            npy::read(source.file.bytes())
        };
        source.is_plain_of_one().then(|| read().map_err(|diagnostic| vec![diagnostic]))
    }
}

fn read(source: &MatrixSource<'_>) -> std::result::Result<RawMatrix, Diagnostic> {
    let array = npy::read(source.not_packed("NumPy array")?)?;
    assemble_array(array, HELP, BOTH_TRIANGLES, source.file.path())
}
