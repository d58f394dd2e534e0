//! Arrays of shapes or loads, one for each column (or row), in NumPy, HDF5 or Matrix Market files, recognised by
//! content. Shapes may also come by nodes, as FE programs write modes.

use super::array::Array;
use super::matrices::{HEAD, READERS, with_reader};
use super::mode_files::read_modes;
use super::model_files::MatrixLocation;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::Compression;
use flexbody_base::text::InputFile;
use flexbody_model::{RawModes, RawShapes};

/// Shapes as read from a file.
#[derive(Debug, Clone, PartialEq)]
pub enum ImportedColumns {
    /// Shapes by matrix rows.
    Rows(RawShapes),
    /// Modes by nodes, with eigenvalues.
    Modes(RawModes),
}

/// Reads shapes by rows, whose number must be one of `counts`, or by nodes. `role` is the role of the file in the
/// provenance.
///
/// # Errors
/// The errors of [`read_shapes`]; FB128 and FB306 for files of modes.
pub fn read_imported(location: &MatrixLocation, counts: &[usize], role: &str) -> Result<ImportedColumns> {
    let file = InputFile::open_unread(&location.path)?;
    match read_modes(&file, role).filter(|_| location.group.is_none()) {
        Some(modes) => modes.map(ImportedColumns::Modes).map_err(Error::new),
        None => read_shapes(location, counts, role).map(ImportedColumns::Rows),
    }
}

/// Reads shapes or loads: an array n x k, or k x n, where n is one of `counts` (the numbers of rows of the files of a
/// model) and k is none of them. `role` is the role of the file in the provenance.
///
/// # Errors
/// FB101 to FB106 and FB301 to FB313 for files that cannot be read, FB320 if the array has no extent n.
pub fn read_shapes(location: &MatrixLocation, counts: &[usize], role: &str) -> Result<RawShapes> {
    let file = InputFile::open_unread(&location.path)?;
    let path = file.path();
    let array = read(&file, location.group.as_deref());
    file.refuse_changed()?;
    let array = array.and_then(|array| oriented(array, counts).map_err(|diagnostic| vec![diagnostic]));
    let (matrix, digits) =
        array.map_err(|found| Error::new(found.into_iter().map(|d| d.in_file(path)).collect()))?;
    let source = Some(SourceFile::new(role, path, file.sha256()?));
    Ok(RawShapes { matrix, digits, path: path.to_path_buf(), source })
}

/// Reads a dense array in any of the formats: the `dataset` of a file with several.
pub(super) fn read(file: &InputFile, dataset: Option<&str>) -> Diagnosed<Array> {
    if let Some(found) = with_reader(file, dataset, |reader, source| reader.read_array(source)) {
        return found;
    }
    if let Some(dataset) = dataset {
        let message = format!("dataset `{dataset}` is named, but the file is not HDF5");
        return Err(vec![Diagnostic::new(Code::Hdf5Layout, message).with_help("give the file alone")]);
    }
    let compression = Compression::of(file.bytes());
    let head = compression.head(file, HEAD);
    let start = &head[..head.len().min(24)];
    let is_packed = compression != Compression::None;
    let what = if is_packed && READERS.iter().any(|reader| reader.recognises(&head)) {
        "file is compressed as a whole".to_owned()
    } else {
        format!("file begins with `{}`", start.escape_ascii())
    };
    Err(vec![Diagnostic::new(Code::FileFormatUnknown, what).with_help(
        "give a NumPy array (.npy), an HDF5 file (FILE.h5:/dataset), a Matrix Market array (.mtx) or a matrix of OUTPUT4 (FILE.op4:/PHIG)",
    )])
}

/// Returns the array with one shape per column, and its number of digits.
fn oriented(array: Array, counts: &[usize]) -> std::result::Result<(Mat<f64>, u8), Diagnostic> {
    let Array { rows, cols, row_major, values, digits } = array;
    let upright = match (counts.contains(&rows), counts.contains(&cols)) {
        (true, false) => true,
        (false, true) => false,
        (true, true) => {
            let message = format!("array is {rows} x {cols}: its rows and its columns may be the shapes");
            return Err(Diagnostic::new(Code::ShapesSize, message).with_help("give fewer shapes"));
        }
        (false, false) => {
            let mut counts: Vec<String> = counts.iter().map(usize::to_string).collect();
            counts.dedup();
            let message = format!("array is {rows} x {cols}, the matrices have {} rows", counts.join(" or "));
            return Err(Diagnostic::new(Code::ShapesSize, message));
        }
    };
    let (n, k) = if upright { (rows, cols) } else { (cols, rows) };
    // Shapes are contiguous: rows of a row-major array of rows, or columns of a column-major array of columns.
    let one_by_one = row_major != upright;
    let at = |i: usize, j: usize| if one_by_one { j * n + i } else { i * k + j };
    Ok((Mat::from_fn(n, k, |i, j| values[at(i, j)]), digits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_orientation_and_order_gives_the_same_columns() {
        let value = |i: usize, j: usize| (10 * i + j) as f64;
        let expected = Mat::from_fn(7, 2, value);
        for (rows, cols) in [(7, 2), (2, 7)] {
            let entry = |r: usize, c: usize| if rows == 7 { value(r, c) } else { value(c, r) };
            for row_major in [true, false] {
                let values =
                    (0..14)
                        .map(|at| {
                            if row_major { entry(at / cols, at % cols) } else { entry(at % rows, at / rows) }
                        })
                        .collect();
                let array = Array { rows, cols, row_major, values, digits: 17 };
                assert_eq!(oriented(array, &[7]), Ok((expected.clone(), 17)));
            }
        }
    }
}
