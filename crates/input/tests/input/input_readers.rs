//! Matrix readers: every registered format on its fixtures, every dialect of Matrix Market.

use flexbody_base::diagnostic::Code;
use flexbody_input::{MatrixLocation, MatrixRole, READERS, read_matrix};
use flexbody_linalg::CscMatrix;
use flexbody_model::RawMatrix;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

fn read_file(path: &Path) -> flexbody_base::error::Result<RawMatrix> {
    read_matrix(&MatrixLocation { path: path.into(), group: None }, MatrixRole::Stiffness)
}

fn read_bytes(name: &str, bytes: &[u8]) -> flexbody_base::error::Result<RawMatrix> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_file(&path)
}

fn read_text(text: &str) -> flexbody_base::error::Result<RawMatrix> {
    read_bytes("K.mtx", text.as_bytes())
}

/// Returns the reference matrix of `fixtures/readers`.
fn reference() -> CscMatrix {
    let mut triplets = Vec::new();
    for i in 0..6u32 {
        for j in i.saturating_sub(2)..(i + 3).min(6) {
            let value = if i == j { f64::from(i + j + 1) / 7.0 } else { -1.0 / f64::from(3 + i + j) };
            triplets.push((i, j, value));
        }
    }
    CscMatrix::from_triplets(6, 6, &triplets)
}

#[test]
fn every_registered_reader_reads_its_fixtures_and_nobody_elses() {
    for reader in READERS {
        let folder = reader.name().to_lowercase().replace(' ', "-");
        let folder = oracle::fixtures().join("readers").join(folder);
        let files: Vec<PathBuf> = std::fs::read_dir(&folder)
            .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
            .map(|entry| entry.unwrap().path())
            .collect();
        assert!(files.len() >= 2, "{} has too few fixtures", reader.name());
        for path in files {
            let shown = path.display();
            let raw = read_file(&path).unwrap_or_else(|e| panic!("{shown}: {e}"));
            assert_eq!(raw.matrix, reference(), "{shown}");
            assert!((15..=17).contains(&raw.digits), "{shown}: {} digits", raw.digits);
            assert_eq!(raw.path, path);

            let bytes = std::fs::read(&path).unwrap();
            let packed = path.extension().is_some_and(|e| e == "gz" || e == "zst");
            if !packed {
                let by_content: Vec<&str> =
                    READERS.iter().filter(|r| r.recognises(&bytes)).map(|r| r.name()).collect();
                assert_eq!(by_content, [reader.name()], "{shown}");
                // The format is detected from the content, not from the name.
                assert_eq!(read_bytes("matrix.unknown", &bytes).unwrap().matrix, reference(), "{shown}");
            }
            let name = path.file_name().unwrap().to_str().unwrap();
            assert!(read_bytes(name, &bytes[..bytes.len() / 2]).is_err(), "half of {shown}");
            let elsewhere = MatrixLocation { path: path.clone(), group: Some("/no/such/group".into()) };
            let error = read_matrix(&elsewhere, MatrixRole::Stiffness).expect_err("no such group");
            assert!(error.has(Code::Hdf5Layout), "{shown}: {error}");
        }
    }
}

/// Returns a NumPy array in C order.
fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    npy_in_order("False", descr, shape, data)
}

/// Returns a NumPy array; the first index runs fastest if `fortran` is `True`.
fn npy_in_order(fortran: &str, descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    [&b"\x93NUMPY\x01\0"[..], &(header.len() as u16).to_le_bytes(), header.as_bytes(), data].concat()
}

fn archive(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in members {
        zip.start_file(format!("{name}.npy"), stored).expect("a member");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("an archive").into_inner()
}

/// Valid and invalid SciPy archives of a matrix with two rows.
#[test]
fn archives_of_scipy_are_read_or_refused() {
    let whole = |values: &[i16]| {
        let data: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        npy(">i2", &format!("({},)", values.len()), &data)
    };
    let bytes_of = |values: &[f64]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let real = |values: &[f64]| npy("<f8", &format!("({},)", values.len()), &bytes_of(values));
    let form = |name: &str| npy("|S3", "()", name.as_bytes());
    let coo = |form_name: &str, rows: &[i16], columns: &[i16], values: &[f64]| {
        archive(&[
            ("row", whole(rows)),
            ("col", whole(columns)),
            ("format", form(form_name)),
            ("shape", whole(&[2, 2])),
            ("data", real(values)),
        ])
    };
    let good = read_bytes("K.npz", &coo("coo", &[0, 1, 0, 1], &[0, 1, 1, 0], &[2.0, 3.0, 1.0, 1.0]));
    let expected = CscMatrix::from_triplets(2, 2, &[(0, 0, 2.0), (1, 1, 3.0), (0, 1, 1.0), (1, 0, 1.0)]);
    assert_eq!(good.expect("a matrix").matrix, expected);
    let csc = |pointers: &[i16]| {
        archive(&[
            ("indices", whole(&[0, 1])),
            ("indptr", whole(pointers)),
            ("format", form("csc")),
            ("shape", whole(&[2, 2])),
            ("data", real(&[2.0, 3.0])),
        ])
    };
    assert_eq!(read_bytes("K.npz", &csc(&[0, 1, 2])).expect("a matrix").matrix.values(), [2.0, 3.0]);
    // Blocks of 2 x 1, in both NumPy orders.
    let bsr = |fortran: &str, shape: &str, columns: &[i16], pointers: &[i16], values: &[f64]| {
        archive(&[
            ("indices", whole(columns)),
            ("indptr", whole(pointers)),
            ("format", form("bsr")),
            ("shape", whole(&[2, 2])),
            ("data", npy_in_order(fortran, "<f8", shape, &bytes_of(values))),
        ])
    };
    for (fortran, values) in [("False", [2.0, 1.0, 1.0, 3.0]), ("True", [2.0, 1.0, 1.0, 3.0])] {
        let read = read_bytes("K.npz", &bsr(fortran, "(2, 2, 1)", &[0, 1], &[0, 2], &values));
        assert_eq!(read.expect("a matrix").matrix, expected, "{fortran}");
    }
    for (bytes, code) in [
        (coo("dia", &[0], &[0], &[1.0]), Code::MatrixKind),
        (bsr("False", "(2, 2)", &[0, 1], &[0, 2], &[1.0; 4]), Code::MatrixKind),
        (bsr("False", "(2, 2, 2)", &[0, 1], &[0, 2], &[1.0; 4]), Code::MatrixCount),
        (bsr("False", "(2, 1, 2)", &[0], &[0, 1, 2], &[1.0; 4]), Code::MatrixCount),
        (bsr("False", "(1, 4, 1)", &[0], &[0, 1], &[1.0; 4]), Code::MatrixCount),
        (bsr("False", "(2, 2, 1)", &[0, 1], &[0, 1, 2], &[1.0; 4]), Code::MatrixCount),
        (bsr("False", "(2, 2, 1)", &[0, 1], &[1, 2], &[1.0; 4]), Code::MatrixSyntax),
        (bsr("False", "(2, 2, 1)", &[0, 2], &[0, 2], &[1.0; 4]), Code::MatrixIndex),
        (bsr("False", "(2, 2, 1)", &[0, 1], &[0, 2], &[1.0, 0.0, 1.0, 1.0]), Code::MatrixAsymmetric),
        (coo("coo", &[0, 2], &[0, 0], &[1.0, 1.0]), Code::MatrixIndex),
        (coo("coo", &[0, -1], &[0, 0], &[1.0, 1.0]), Code::MatrixIndex),
        (coo("coo", &[0, 1], &[0], &[1.0, 1.0]), Code::MatrixCount),
        (coo("coo", &[0, 1], &[0, 1], &[1.0, f64::NAN]), Code::MatrixNotFinite),
        (coo("coo", &[0, 1, 1], &[0, 1, 0], &[1.0, 1.0, 0.5]), Code::MatrixAsymmetric),
        (csc(&[0, 2, 1]), Code::MatrixSyntax),
        (csc(&[0, 2]), Code::MatrixCount),
        (archive(&[("format", form("coo"))]), Code::MatrixSyntax),
        (archive(&[("shape", real(&[2.0, 2.0])), ("format", form("coo"))]), Code::MatrixKind),
    ] {
        let error = read_bytes("K.npz", &bytes).expect_err("refused");
        assert!(error.has(code), "{code:?}: {error}");
    }
}

#[test]
fn dialects_of_matrix_market_mean_the_same() {
    let expected = CscMatrix::from_triplets(3, 3, &[(0, 0, 2e5), (1, 0, -1.5), (0, 1, -1.5), (2, 2, 4.0)]);
    for text in [
        "%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n1 1 2e5\n2 1 -1.5\n3 3 4\n",
        // Upper triangle, any case, comments and blank lines anywhere, CRLF, tabs, a blank for the last line end.
        "%%MATRIXMARKET Matrix COORDINATE Real SYMMETRIC\r\n% c\r\n\r\n 3\t3  3\r\n%\r\n1 2 -1.5\r\n\r\n  3 3 4.0 \r\n% c\r\n1 1 200000. ",
        // Fortran exponents.
        "%%MatrixMarket matrix coordinate real symmetric\n3 3 3\n 1 1 0.2D+06\n 2 1 -.15d1\n 3 3 +4.0D+00\n",
        // General matrix, explicit zeros, duplicates, any order.
        "%%MatrixMarket matrix coordinate real general\n3 3 8\n3 3 1\n1 2 -1.5\n2 2 0.0\n2 1 -1.5\n3 3 3\n1 1 2e5\n2 3 0\n3 2 -0.0\n",
        // An explicit zero in the other triangle is no entry; duplicates that cancel are none.
        "%%MatrixMarket matrix coordinate real symmetric\n3 3 6\n1 1 2e5\n2 1 -1.5\n3 3 4\n1 3 0\n3 2 7\n3 2 -7\n",
        // Integer values are read as reals; comment after a value; byte order mark.
        "\u{feff}%%MatrixMarket matrix coordinate integer symmetric\n3 3 4\n1 1 200000\n2 1 -1 % half\n3 3 4\n2 1 0\n",
    ] {
        let expected = if text.contains("integer") {
            CscMatrix::from_triplets(3, 3, &[(0, 0, 2e5), (1, 0, -1.0), (0, 1, -1.0), (2, 2, 4.0)])
        } else {
            expected.clone()
        };
        assert_eq!(read_text(text).unwrap_or_else(|e| panic!("{text}\n{e}")).matrix, expected, "{text}");
    }
}

#[test]
fn a_last_number_without_a_line_end_is_cut_off() {
    let text = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 0.5\n2 2 0.25";
    for cut in [text, &text[..text.len() - 1]] {
        let error = read_text(cut).unwrap_err();
        assert!(error.has(Code::MatrixSyntax), "{error}");
        assert!(error.to_string().contains("ends within its last number"), "{error}");
    }
    for whole in [format!("{text}\n"), format!("{text}\n% seven"), format!("{text} ")] {
        assert_eq!(read_text(&whole).unwrap().matrix.values(), [0.5, 0.25]);
    }
}

#[test]
fn a_diagonal_matrix_may_be_declared_either_way() {
    for symmetry in ["symmetric", "general"] {
        let text = format!("%%MatrixMarket matrix coordinate real {symmetry}\n2 2 2\n1 1 0.5\n2 2 0.25\n");
        assert_eq!(read_text(&text).unwrap().matrix.values(), [0.5, 0.25]);
    }
}

#[test]
fn an_unsymmetric_general_matrix_is_delivered_as_it_is() {
    let text = "%%MatrixMarket matrix coordinate real general\n2 2 3\n1 1 1\n1 2 5\n2 1 -3\n";
    let matrix = read_text(text).unwrap().matrix;
    assert_eq!((matrix.get(0, 1), matrix.get(1, 0)), (5.0, -3.0));
}

#[test]
fn line_numbers_count_across_pieces_and_packing() {
    // The text has several blocks of one MiB; the invalid line is in a late one.
    let n = 150_000;
    let mut text = format!("%%MatrixMarket matrix coordinate real symmetric\n% c\n{n} {n} {n}\n");
    for i in 1..=n {
        text += &(if i == 140_000 { "140000 140000 oops\n".to_owned() } else { format!("{i} {i} 1.25\n") });
    }
    let packed =
        ruzstd::encoding::compress_to_vec(text.as_bytes(), ruzstd::encoding::CompressionLevel::Fastest);
    for (name, bytes) in [("K.mtx", text.as_bytes()), ("K.mtx.zst", &packed)] {
        let error = read_bytes(name, bytes).unwrap_err();
        let found: Vec<_> = error.diagnostics().iter().map(|d| (d.code(), d.line())).collect();
        assert_eq!(found, [(Code::MatrixSyntax, Some(140_003))], "{error}");
    }
}

#[test]
fn the_same_bits_at_any_number_of_threads() {
    let n = 20_000u64;
    let mut text = format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {}\n", 10 * n);
    for k in 0..10 * n {
        // A fixed pseudo-random sequence with many duplicates whose sums depend on the order.
        let mixed = k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
        let (i, j) = (k % n, mixed % (k % n + 1) % 3);
        text +=
            &format!("{} {} {:e}\n", i + 1, j + 1, (mixed as f64).sqrt() * 10f64.powi((k % 9) as i32 - 4));
    }
    let read = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| read_text(&text).unwrap().matrix)
    };
    let one = read(1);
    assert!(one.nnz() < 2 * 10 * n as usize, "there are duplicates");
    for threads in [2, 5] {
        let other = read(threads);
        assert_eq!(one, other);
        assert!(one.values().iter().zip(other.values()).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn digits_follow_the_values_not_the_padding() {
    let file = |format: &dyn Fn(f64) -> String| {
        let mut text = "%%MatrixMarket matrix coordinate real symmetric\n300 300 300\n".to_owned();
        for i in 1..=300 {
            text += &format!("{i} {i} {}\n", format(f64::from(i).sqrt()));
        }
        read_text(&text).unwrap().digits
    };
    assert_eq!(file(&|v| format!("{v:e}")), 17);
    assert_eq!(file(&|v| format!("{v:.13e}")), 14);
    assert_eq!(file(&|v| format!("{:.16e}", format!("{v:.13e}").parse::<f64>().unwrap())), 14);
    assert_eq!(file(&|v| format!("{v:.5e}")), 6);
    assert_eq!(file(&|v| format!("{:.16e}", format!("{v:.5e}").parse::<f64>().unwrap())), 6);
}

/// Format variant of a written matrix.
#[derive(Debug, Clone)]
struct Dialect {
    general: bool,
    upper: bool,
    crlf: bool,
    comments: bool,
    final_newline: bool,
    packing: u8,
    numbers: u8,
}

fn dialect() -> impl Strategy<Value = Dialect> {
    (any::<[bool; 5]>(), 0..5u8, 0..5u8).prop_map(|(b, packing, numbers)| Dialect {
        general: b[0],
        upper: b[1],
        crlf: b[2],
        comments: b[3],
        final_newline: b[4],
        packing,
        numbers,
    })
}

fn number(value: f64, style: u8) -> String {
    let plain = format!("{value:e}");
    match style {
        0 => plain,
        1 => plain.replace('e', "D"),
        2 if plain.contains("e-") => plain.to_uppercase(),
        2 => plain.replace('e', "E+"),
        3 => plain.replace("e-", "-").replace('e', "+"), // Fortran with three exponent digits
        _ if value >= 0.0 => format!("+{value:?}"),
        _ => format!("{value:?}"),
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn write(n: usize, entries: &[(usize, usize, f64)], dialect: &Dialect) -> (String, Vec<u8>) {
    let end = if dialect.crlf { "\r\n" } else { "\n" };
    let symmetry = if dialect.general { "general" } else { "symmetric" };
    let mut lines = vec![format!("%%MatrixMarket matrix coordinate real {symmetry}")];
    let mut data = Vec::new();
    for (k, &(i, j, value)) in entries.iter().enumerate() {
        let (i, j) = if dialect.upper { (j, i) } else { (i, j) };
        data.push(format!("{} {} {}", i + 1, j + 1, number(value, dialect.numbers)));
        if dialect.general && i != j {
            data.push(format!("{}\t{}  {}", j + 1, i + 1, number(value, dialect.numbers)));
        }
        if dialect.comments && k % 3 == 0 {
            data.push(["% comment", "", "   "][k % 9 / 3].into());
        }
    }
    let count = data.iter().filter(|line| line.ends_with(|c: char| c.is_ascii_digit() || c == '.')).count();
    lines.push(format!("{n} {n} {count}"));
    lines.extend(data);
    let mut text = lines.join(end);
    // A text that ends in a number may be cut off.
    text += if dialect.final_newline { end } else { " " };
    let bytes = text.as_bytes();
    let (head, tail) = bytes.split_at(bytes.len() / 2);
    match dialect.packing {
        0 => ("K.mtx".into(), bytes.to_vec()),
        1 => ("K.mtx.gz".into(), gzip(bytes)),
        2 => ("K.mtx.gz".into(), [gzip(head), gzip(tail)].concat()),
        3 => (
            "K.mtx.zst".into(),
            ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest),
        ),
        _ => (
            "K".into(),
            ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest),
        ), // no extension
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// The result does not depend on triangle, order, duplicates, compression and number style, to the last
    /// bit.
    #[test]
    fn a_symmetric_matrix_in_any_dialect_comes_back(
        n in 1..9usize,
        raw in proptest::collection::vec((0..9usize, 0..9usize, -1e3..1e3f64, -120..120i32, any::<bool>()), 1..40),
        dialect in dialect(),
    ) {
        let entries: Vec<(usize, usize, f64)> = raw
            .into_iter()
            .map(|(i, j, mantissa, exponent, zero)| {
                let (i, j) = (i % n, j % n);
                let value = if zero && mantissa > 500.0 { 0.0 } else { mantissa * 10f64.powi(exponent) };
                (i.max(j), i.min(j), value)
            })
            .collect();
        let mut sums: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for &(i, j, value) in entries.iter().filter(|e| e.2 != 0.0) {
            sums.entry((i, j)).and_modify(|sum| *sum += value).or_insert(value);
        }
        let mut triplets = Vec::new();
        for (&(i, j), &value) in sums.iter().filter(|(_, value)| **value != 0.0) {
            triplets.push((i as u32, j as u32, value));
            if i != j {
                triplets.push((j as u32, i as u32, value));
            }
        }
        let (name, bytes) = write(n, &entries, &dialect);
        let result = read_bytes(&name, &bytes);
        if triplets.is_empty() {
            prop_assert!(result.unwrap_err().has(Code::MatrixEmpty));
        } else {
            let raw = result.map_err(|e| TestCaseError::fail(e.to_string()))?;
            prop_assert_eq!(raw.matrix, CscMatrix::from_triplets(n, n, &triplets));
        }
    }
}

/// Real matrices, if the folder with them exists.
#[test]
fn real_models_are_read_with_the_digits_they_have() {
    let Some(models) = shared_models() else { return };
    for (model, n, nnz, digits) in [
        ("a_beam_c3d20", 5463, 2 * 308_836 - 5463, 14),
        ("b_conrod_30k", 36117, 2 * 1_275_214 - 36117, 14),
        ("i_plane_stress", 6074, 134_900, 17),
    ] {
        let raw = read_file(&models.join(model).join("K.mtx.gz")).unwrap_or_else(|e| panic!("{model}: {e}"));
        assert_eq!((raw.matrix.n_rows(), raw.matrix.nnz(), raw.digits), (n, nnz, digits), "{model}");
        assert_eq!(raw.matrix, raw.matrix.transpose(), "{model}");
    }
}

fn shared_models() -> Option<PathBuf> {
    let shared = oracle::shared();
    Some(shared.join("models")).filter(|models| models.is_dir())
}
