//! Full matrices in archives of NumPy and in plain text.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_input::{MatrixLocation, MatrixRole, read_matrix, read_shapes};
use flexbody_linalg::CscMatrix;
use flexbody_model::RawMatrix;
use std::io::Write;

fn read(name: &str, bytes: &[u8], group: Option<&str>, role: MatrixRole) -> Result<RawMatrix> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    read_matrix(&MatrixLocation { path, group: group.map(str::to_owned) }, role)
}

fn text(text: &str) -> Result<RawMatrix> {
    read("K.txt", text.as_bytes(), None, MatrixRole::Stiffness)
}

/// Returns the Matrix Market file of the matrix [[2, -1, 0], [-1, 3, 0.5], [0, 0.5, 4]].
fn reference() -> RawMatrix {
    let text =
        "%%MatrixMarket matrix coordinate real symmetric\n3 3 5\n1 1 2\n2 1 -1\n2 2 3\n3 2 0.5\n3 3 4\n";
    read("K.mtx", text.as_bytes(), None, MatrixRole::Stiffness).expect("a matrix")
}

const VALUES: [f64; 9] = [2.0, -1.0, 0.0, -1.0, 3.0, 0.5, 0.0, 0.5, 4.0];

fn npy(descr: &str, shape: &str, values: &[f64]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    [&b"\x93NUMPY\x01\0"[..], &(header.len() as u16).to_le_bytes(), header.as_bytes(), &data].concat()
}

fn npz(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in members {
        let options = zip::write::SimpleFileOptions::default();
        archive.start_file(format!("{name}.npy"), options).expect("a member");
        archive.write_all(bytes).expect("written");
    }
    archive.finish().expect("an archive").into_inner()
}

#[test]
fn an_array_of_an_archive_is_chosen_by_its_name_or_its_role() {
    let k = npy("<f8", "(3, 3)", &VALUES);
    let m = npy("<f8", "(3, 3)", &VALUES.map(|value| value / 2.0));
    let rows = npy("<f8", "(3,)", &VALUES[..3]);
    let both = npz(&[("rows", rows.clone()), ("mass", m.clone()), ("K", k.clone())]);
    let stiffness = read("model.npz", &both, None, MatrixRole::Stiffness).expect("K");
    assert_eq!(stiffness.matrix, reference().matrix);
    for group in ["/mass", "mass"] {
        let mass = read("model.npz", &both, Some(group), MatrixRole::Stiffness).expect("M");
        assert_eq!(mass.matrix.get(0, 0), 1.0);
    }
    let only = npz(&[("arr_0", k.clone()), ("arr_1", rows)]);
    assert_eq!(read("a.npz", &only, None, MatrixRole::Mass).expect("K").matrix, reference().matrix);
    let unnamed = npz(&[("arr_0", k.clone()), ("arr_1", m)]);
    for (bytes, group, words) in [
        (&unnamed, None, "name the array as FILE.npz:/array; the file has /arr_0, /arr_1"),
        (&both, Some("/D"), "array `D` is not in the archive"),
        (&both, Some("/D"), "the file has /rows, /mass, /K"),
        (&npz(&[("mass", k)]), None, "is named like the mass matrix"),
        (&npz(&[("a", npy("<f8", "(2, 3)", &VALUES[..6]))]), None, "no sparse matrix and no square array"),
    ] {
        let error = read("a.npz", bytes, group, MatrixRole::Stiffness).expect_err("refused");
        assert!(error.has(Code::Hdf5Layout) && error.to_string().contains(words), "{error}");
        assert!(error.to_string().contains("a.npz"), "{error}");
    }
}

#[test]
fn archives_of_invalid_arrays_are_refused() {
    let nan = {
        let mut values = VALUES;
        values[4] = f64::NAN;
        values
    };
    let lower = {
        let mut values = VALUES;
        (values[1], values[5]) = (0.0, 0.0);
        values
    };
    for (array, code) in [
        (npy("<f8", "(3, 3)", &nan), Code::MatrixNotFinite),
        (npy("<f8", "(3, 3)", &lower), Code::MatrixAsymmetric),
        (npy("<f8", "(3, 3)", &[0.0; 9]), Code::MatrixEmpty),
        (npy("<f8", "(3, 3)", &VALUES[..8]), Code::MatrixCount),
        (npy("<f8", "(2, 3)", &VALUES[..6]), Code::MatrixNotSquare),
        (npy("<f8", "(3,)", &VALUES[..3]), Code::MatrixNotSquare),
        (npy("<f8", "(4294967297, 4294967297)", &VALUES), Code::MatrixTooLarge),
        (npy("<f8", "(4294967295, 4294967295)", &VALUES), Code::MatrixCount),
        (npy("<c16", "(3, 3)", &VALUES), Code::MatrixKind),
        (npy("|O", "()", &VALUES), Code::MatrixKind),
        (b"no array".to_vec(), Code::MatrixSyntax),
    ] {
        let error = read("a.npz", &npz(&[("K", array)]), Some("/K"), MatrixRole::Stiffness);
        let error = error.expect_err("refused");
        assert!(error.has(code) && error.diagnostics().len() == 1, "{code:?}: {error}");
    }
    let whole = npz(&[("K", npy("<f8", "(3, 3)", &VALUES))]);
    for length in 1..whole.len() {
        assert!(read("K.npz", &whole[..length], None, MatrixRole::Stiffness).is_err(), "{length} bytes");
    }
}

#[test]
fn dialects_of_plain_text_mean_the_same() {
    let expected = reference();
    for dialect in [
        "2 -1 0\n-1 3 0.5\n0 0.5 4\n",
        "# of numpy.savetxt\n2.0e+00 -1.0e+00 0\n-1 3 5.0E-1 # half\n\n0 .5 4.\n",
        "% of MATLAB\r\n   2.0\t-1\t0\r\n -1\t3\t0.5\r\n 0\t0.5\t4\r\n",
        "2,-1,0\n-1,3,0.5\n0,0.5,4\n",
        "2, -1, 0,\n-1, 3, 0.5,\n0, 0.5, 4,\n",
        "\u{feff}2;-1;0\n-1;3;0.5\n0;0.5;4\n% end",
        "  2.D0  -1.D0 0\n  -1 3 0.05D+1\n0 +0.5 4",
    ] {
        let dialect = if dialect.ends_with('4') { format!("{dialect} ") } else { dialect.to_owned() };
        let raw = text(&dialect).unwrap_or_else(|error| panic!("{dialect}: {error}"));
        assert_eq!((raw.matrix, raw.digits), (expected.matrix.clone(), expected.digits), "{dialect}");
    }
    // Only the content decides about the format, unless a list `row column value` is meant.
    let error = read("K.mtx", b"1 1 2.5\n2 2 3.5\n3 3 4.5\n", None, MatrixRole::Stiffness);
    assert!(error.expect_err("a list").to_string().contains("expected `%%MatrixMarket"));
}

/// A wide matrix, whose first line is longer than what the detection of the format looks at.
#[test]
fn a_text_of_long_lines_is_read() {
    let n = 400;
    let value = |i: usize, j: usize| if i.abs_diff(j) < 2 { 1.0 / (1 + i + j) as f64 } else { 0.0 };
    let mut content = String::new();
    let mut triplets = Vec::new();
    for i in 0..n {
        for j in 0..n {
            content += &format!("{:.16e} ", value(i, j));
            triplets.push((i as u32, j as u32, value(i, j)));
        }
        content += "\n";
    }
    triplets.retain(|entry| entry.2 != 0.0);
    assert_eq!(text(&content).expect("a matrix").matrix, CscMatrix::from_triplets(n, n, &triplets));
}

#[test]
fn texts_that_are_no_square_arrays_are_refused_by_their_line() {
    for (content, code, line, words) in [
        ("2 1 0\n1 2 1\n", Code::MatrixNotSquare, None, "2 rows and 3 columns"),
        ("2 1\n1 2\n0 1\n", Code::MatrixNotSquare, Some(3), "more than 2 rows and 2 columns"),
        ("1\n2\n3\n", Code::MatrixNotSquare, Some(2), "one number on each line"),
        ("1 1 5.5\n2 2 6.5\n3 3 7.5\n4 4 8.5\n", Code::MatrixNotSquare, Some(4), "row column value"),
        ("2 1\n1 2 3\n", Code::MatrixCount, Some(2), "the row has 3 values, the first row has 2"),
        ("2 1\n1\n", Code::MatrixCount, Some(2), "the row has 1 values"),
        ("# K\n2 1\n1 nan\n", Code::MatrixNotFinite, Some(3), "entry (1, 1), counted from 0, is NaN"),
        ("2 1\n1 x\n", Code::MatrixSyntax, Some(2), "value `x` is not a number"),
        ("2;1\n1,5;2\n", Code::MatrixSyntax, Some(2), "value `1,5` is not a number"),
        ("2,1\n1 2\n", Code::MatrixCount, Some(2), "the row has 1 values"),
        ("2,,1\n1,2,3\n", Code::FileFormatUnknown, None, "begins with"),
        ("2 1\n1+2 5\n", Code::MatrixSyntax, Some(2), "value `1+2`"),
        ("2 1\n1 2", Code::MatrixSyntax, Some(2), "ends within its last number"),
        ("2 0\n1 2\n", Code::MatrixAsymmetric, None, "only the lower triangle"),
        ("0 0\n0 0\n", Code::MatrixEmpty, None, "2 x 2"),
        ("K M\n1 2\n", Code::FileFormatUnknown, None, "begins with"),
    ] {
        let error = text(content).expect_err(content);
        let first = error.first_error();
        assert_eq!((first.code(), first.line()), (code, line), "{content}: {error}");
        assert!(
            error.to_string().contains(words) && error.to_string().contains("K.txt"),
            "{content}: {error}"
        );
    }
}

#[test]
fn shapes_are_read_from_full_arrays() {
    let folder = tempfile::tempdir().expect("a folder");
    let expected = [[1.0, 4.0], [2.0, 5.0], [3.0, 6.5]];
    let archive = npz(&[
        ("rows", npy("<f8", "(1,)", &[0.0])),
        ("Psi", npy("<f8", "(2, 3)", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.5])),
    ]);
    for (name, bytes, group) in [
        ("Psi.npz", archive, Some("/Psi")),
        ("Psi.csv", b"1,4\n2,5\n3,6.5\n".to_vec(), None),
        ("Psi.txt", b"# by columns\n1 2 3\n4 5 6.5\n".to_vec(), None),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        let location = MatrixLocation { path, group: group.map(str::to_owned) };
        let shapes = read_shapes(&location, &[3], "shapes").expect(name).matrix;
        for (row, values) in expected.iter().enumerate() {
            assert_eq!([shapes[(row, 0)], shapes[(row, 1)]], *values, "{name}");
        }
    }
}
