//! Files of recoveries: operators, which have one row for each value and one column for each matrix row of the model,
//! and values of the undeformed body.

use crate::array::Array;
use crate::matrices::assemble::Entry;
use crate::matrices::operator::OperatorColumns;
use crate::matrices::rectangular::Rectangular;
use crate::matrices::with_reader;
use crate::shapes;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_linalg::CscMatrix;

/// Reads an operator R (rows x matrix rows of the model) in any of the formats of K, or as a dense array. `name` is the
/// matrix of a file with several.
///
/// # Errors
/// FB102 for other formats; FB103, FB301 to FB313 for files that cannot be read.
pub(super) fn read_operator(file: &InputFile, name: Option<&str>) -> Diagnosed<OperatorColumns> {
    let about = |found: Vec<Diagnostic>| in_file(found, file);
    let sparse = with_reader(file, name, |reader, source| reader.read_operator(source));
    if let Some(found) = sparse {
        return found.map_err(about);
    }
    let array = shapes::read(file, name).map_err(|found| about(with_formats(found)))?;
    transposed_array(&array).map(OperatorColumns::Matrix).map_err(|diagnostic| about(vec![diagnostic]))
}

/// Returns the diagnostics with the file, where they name none.
fn in_file(diagnostics: Vec<Diagnostic>, file: &InputFile) -> Vec<Diagnostic> {
    let located = |diagnostic: Diagnostic| {
        if diagnostic.file().is_none() { diagnostic.in_file(file.path()) } else { diagnostic }
    };
    diagnostics.into_iter().map(located).collect()
}

/// Reads one value per row.
///
/// # Errors
/// The errors of dense arrays; FB322 for an array with several columns and several rows.
pub(super) fn read_offset(file: &InputFile, dataset: Option<&str>) -> Diagnosed<Vec<f64>> {
    read_vector(file, dataset, (Code::RecoverySize, "of the offset"))
}

/// Reads the nodal forces of a named load.
///
/// # Errors
/// The errors of dense arrays; FB328 for an array with several columns and several rows.
pub(super) fn read_forces(file: &InputFile, dataset: Option<&str>) -> Diagnosed<Vec<f64>> {
    read_vector(file, dataset, (Code::NamedLoadMisfit, "of a named load"))
}

/// Reads an array with one row or one column; `misfit` is the code and the name of any other.
fn read_vector(file: &InputFile, dataset: Option<&str>, misfit: (Code, &str)) -> Diagnosed<Vec<f64>> {
    let about = |found: Vec<Diagnostic>| in_file(found, file);
    let Array { rows, cols, values, .. } = shapes::read(file, dataset).map_err(about)?;
    if rows != 1 && cols != 1 {
        let (code, name) = misfit;
        let message = format!("array {name} is {rows} x {cols}, expected one value for each row");
        return Err(about(vec![Diagnostic::new(code, message)]));
    }
    Ok(values)
}

/// Names the formats of operators in the help about a file of unknown format.
fn with_formats(diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let help = "give the operator in a format of stiffness matrices (Matrix Market, scipy.sparse.save_npz, HDF5, MATLAB, PETSc, OUTPUT4, DMIG) or as a NumPy array (.npy)";
    let named = |diagnostic: Diagnostic| match diagnostic.code() {
        Code::FileFormatUnknown => diagnostic.with_help(help),
        _ => diagnostic,
    };
    diagnostics.into_iter().map(named).collect()
}

/// Returns the transpose of a dense array without its zeros.
fn transposed_array(array: &Array) -> Result<CscMatrix, Diagnostic> {
    let Array { rows, cols, row_major, values, .. } = array;
    let at = |i: usize, j: usize| if *row_major { values[i * cols + j] } else { values[j * rows + i] };
    let mut entries = Vec::new();
    for i in 0..*rows {
        for j in 0..*cols {
            let value = at(i, j);
            if value != 0.0 {
                entries.push(Entry { row: i as u32, col: j as u32, value });
            }
        }
    }
    Ok(Rectangular { rows: *rows, columns: *cols, entries }.checked()?.transposed())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    /// Returns an array of NumPy with one extent.
    fn npy(kind: &str, count: usize, bytes: &[u8]) -> Vec<u8> {
        let shape = if kind.starts_with('<') { format!("({count},)") } else { "()".to_owned() };
        let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
        while (head.len() + 11) % 64 != 0 {
            head.push(' ');
        }
        head.push('\n');
        let length = u16::try_from(head.len()).expect("a short head").to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], head.as_bytes(), bytes].concat()
    }

    fn integers(values: &[i64]) -> Vec<u8> {
        npy("<i8", values.len(), &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>())
    }

    /// Returns an archive of a matrix with two rows and three columns, [[0, 2, 3], [4, 0, 0]].
    fn archive(form: &str, data: &[f64], lists: &[(&str, &[i64])]) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut zip = ZipWriter::new(&mut bytes);
        let mut put = |name: &str, content: &[u8]| {
            zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).expect("memory");
            zip.write_all(content).expect("memory");
        };
        for (name, values) in lists {
            put(name, &integers(values));
        }
        put("format", &npy("|S3", 1, form.as_bytes()));
        put("shape", &integers(&[2, 3]));
        put("data", &npy("<f8", data.len(), &data.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>()));
        zip.finish().expect("memory");
        bytes.into_inner()
    }

    fn read(name: &str, bytes: &[u8]) -> Diagnosed<CscMatrix> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        let operator = read_operator(&InputFile::open(&path).expect("a file"), None)?;
        Ok(operator.by_rows(&[]).expect("a matrix"))
    }

    #[test]
    fn operators_that_are_not_square_are_read_in_every_format() {
        let expected = CscMatrix::from_triplets(3, 2, &[(1, 0, 2.0), (2, 0, 3.0), (0, 1, 4.0)]);
        let dense: Vec<u8> =
            [0.0, 2.0, 3.0, 4.0, 0.0, 0.0].iter().flat_map(|v: &f64| v.to_le_bytes()).collect();
        let mut array = npy("<f8", 6, &dense);
        let at = array.windows(4).position(|w| w == b"(6,)").expect("a shape");
        array.splice(at..at + 4, *b"(2,3)");
        let blank = array.iter().position(|&b| b == b'}').expect("an end") + 1;
        array.remove(blank);
        let files: [(&str, Vec<u8>); 6] = [
            ("csr.npz", archive("csr", &[2.0, 3.0, 4.0], &[("indices", &[1, 2, 0]), ("indptr", &[0, 2, 3])])),
            (
                "csc.npz",
                archive("csc", &[4.0, 2.0, 3.0], &[("indices", &[1, 0, 0]), ("indptr", &[0, 1, 2, 3])]),
            ),
            ("coo.npz", archive("coo", &[3.0, 4.0, 2.0], &[("row", &[0, 1, 0]), ("col", &[2, 0, 1])])),
            (
                "R.mtx",
                b"%%MatrixMarket matrix coordinate real general\n2 3 3\n1 2 2\n1 3 3\n2 1 4\n".to_vec(),
            ),
            ("dense.mtx", b"%%MatrixMarket matrix array real general\n2 3\n0\n4\n2\n0\n3\n0\n".to_vec()),
            ("R.npy", array),
        ];
        for (name, bytes) in files {
            assert_eq!(read(name, &bytes), Ok(expected.clone()), "{name}");
        }
    }

    #[test]
    fn damaged_operators_are_refused() {
        let good = archive("csr", &[2.0, 3.0, 4.0], &[("indices", &[1, 2, 0]), ("indptr", &[0, 2, 3])]);
        for (name, bytes, code) in [
            ("short.npz", good[..good.len() / 2].to_vec(), Code::FileCompressionBroken),
            (
                "pointers.npz",
                archive("csr", &[2.0, 3.0, 4.0], &[("indices", &[1, 2, 0]), ("indptr", &[0, 4, 3])]),
                Code::MatrixSyntax,
            ),
            (
                "index.npz",
                archive("csr", &[2.0, 3.0, 4.0], &[("indices", &[1, 3, 0]), ("indptr", &[0, 2, 3])]),
                Code::MatrixIndex,
            ),
            (
                "negative.npz",
                archive("coo", &[3.0, 4.0, 2.0], &[("row", &[0, -1, 0]), ("col", &[2, 0, 1])]),
                Code::MatrixIndex,
            ),
            (
                "nan.npz",
                archive("coo", &[f64::NAN, 4.0, 2.0], &[("row", &[0, 1, 0]), ("col", &[2, 0, 1])]),
                Code::MatrixNotFinite,
            ),
            ("form.npz", archive("dia", &[1.0], &[("offsets", &[0])]), Code::MatrixKind),
            (
                "row.mtx",
                b"%%MatrixMarket matrix coordinate real general\n2 3 1\n3 1 2\n".to_vec(),
                Code::MatrixIndex,
            ),
            (
                "count.mtx",
                b"%%MatrixMarket matrix coordinate real general\n2 3 2\n1 1 2\n".to_vec(),
                Code::MatrixCount,
            ),
            ("text.csv", b"one,two\n".to_vec(), Code::FileFormatUnknown),
        ] {
            let found = read(name, &bytes).expect_err(name);
            assert_eq!(found[0].code(), code, "{name}: {}", found[0].message());
        }
    }
}
