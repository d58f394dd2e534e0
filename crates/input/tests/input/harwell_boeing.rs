//! Harwell-Boeing and Rutherford-Boeing files, valid and invalid.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_input::{MatrixLocation, MatrixRole, read_matrix};
use flexbody_linalg::CscMatrix;
use flexbody_model::RawMatrix;

fn read(text: &str) -> Result<RawMatrix> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.rsa");
    std::fs::write(&path, text).expect("written");
    read_matrix(&MatrixLocation { path, group: None }, MatrixRole::Stiffness)
}

/// The matrix [[2, -1, 0], [-1, 3, 0.5], [0, 0.5, 4]].
const SYMMETRIC: &str = "\
K of three springs                                                      SPRINGS
             5             1             1             2             1
RSA                        3             3             5             0
(10I4)          (10I4)          (1P,3D12.4)         (3E12.4)
F                          1             0
   1   3   5   6
   1   2   2   3   3
  2.0000D+00 -1.0000D+00  3.0000D+00
  5.0000D-01  4.0000D+00
  1.0000E+00  1.0000E+00  1.0000E+00
";

fn expected() -> CscMatrix {
    let entries =
        [(0, 0, 2.0), (1, 0, -1.0), (0, 1, -1.0), (1, 1, 3.0), (2, 1, 0.5), (1, 2, 0.5), (2, 2, 4.0)];
    CscMatrix::from_triplets(3, 3, &entries)
}

#[test]
fn every_kind_of_a_real_matrix_is_read() {
    let upper = SYMMETRIC
        .replace("   1   3   5   6\n   1   2   2   3   3\n", "   1   2   4   6\n   1   1   2   2   3\n");
    let unsymmetric = "\
K
             3             1             1             1
rua                        3             3             7             0
(4I5)           (7I1)           (7F4.1)
    1    3    6    8
1212323
 2.0-1.0-1.0 3.0 0.5 0.5 4.0
";
    let whole = unsymmetric.replace("rua", "isa").replace("            7 ", "            5 ");
    let whole = whole
        .replace("(7F4.1)", "(5I4)")
        .replace("    1    3    6    8\n1212323\n", "    1    3    5    6\n12233\n");
    let whole = whole.replace(" 2.0-1.0-1.0 3.0 0.5 0.5 4.0", "   4  -2   6   1   8");
    let doubled = CscMatrix::from_parts(
        3,
        3,
        expected().col_ptr().to_vec(),
        expected().row_idx().to_vec(),
        expected().values().iter().map(|value| 2.0 * value).collect::<Vec<f64>>(),
    );
    for (text, matrix) in [
        (SYMMETRIC, expected()),
        (&SYMMETRIC.replace('\n', "   \r\n"), expected()),
        (&upper, expected()),
        (unsymmetric, expected()),
        (&whole, doubled),
        // Nothing below the values is read.
        (&SYMMETRIC.replace("  1.0000E+00  1.0000E+00  1.0000E+00\n", "any"), expected()),
    ] {
        let raw = read(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(raw.matrix, matrix, "{text}");
    }
}

#[test]
fn what_does_not_fit_the_head_is_refused_by_its_line() {
    for (from, to, code, line, words) in [
        ("RSA", "PSA", Code::MatrixKind, Some(3), "stores no values"),
        ("RSA", "CSA", Code::MatrixKind, Some(3), "is complex"),
        ("RSA", "RZA", Code::MatrixKind, Some(3), "skew-symmetric"),
        ("RSA", "RSE", Code::MatrixKind, Some(3), "element by element"),
        ("RSA", "RHA", Code::MatrixKind, Some(3), "Hermitian"),
        ("RSA", "RUA", Code::MatrixAsymmetric, None, "only the lower triangle"),
        (
            "   3             3 ",
            "   3             4 ",
            Code::MatrixNotSquare,
            Some(3),
            "3 rows and 4 columns",
        ),
        (
            "     5             0",
            "     6             0",
            Code::MatrixSyntax,
            Some(6),
            "do not rise from 1 to 7",
        ),
        (
            "     5             0",
            "999999             0",
            Code::MatrixCount,
            Some(5),
            "head states 1 lines of rows",
        ),
        (
            "   1             2             1",
            "   1             3             1",
            Code::MatrixCount,
            Some(5),
            "head states 3 lines of values",
        ),
        (
            "(10I4)          (10I4)",
            "(10I4)          (10X4)",
            Code::MatrixSyntax,
            Some(4),
            "format `(10X4)` is not read",
        ),
        (
            "(10I4)          (10I4)",
            "(3I4)           (10I4)",
            Code::MatrixCount,
            Some(5),
            "head states 1 lines of starts",
        ),
        ("   1   3   5   6\n", "   1   5   3   6\n", Code::MatrixSyntax, Some(6), "do not rise"),
        ("   1   3   5   6\n", "   0   2   4   5\n", Code::MatrixSyntax, Some(6), "do not rise"),
        (
            "   1   3   5   6\n",
            "   1   3   5\n",
            Code::MatrixCount,
            Some(6),
            "has 3 numbers of 4 columns, expected 4",
        ),
        ("   1   3   5   6\n", "   1   3   x   6\n", Code::MatrixSyntax, Some(6), "`x` among the starts"),
        (
            "   1   2   2   3   3\n",
            "   1   2   2   3   4\n",
            Code::MatrixIndex,
            Some(7),
            "row 4 is out of range",
        ),
        (
            "   1   2   2   3   3\n",
            "   1   2   2   3   0\n",
            Code::MatrixIndex,
            Some(7),
            "row 0 is out of range",
        ),
        ("   1   2   2   3   3\n", "   1   2   1   3   3\n", Code::MatrixTriangles, None, "both sides"),
        ("  5.0000D-01", "         NaN", Code::MatrixNotFinite, Some(9), "is NaN"),
        ("  5.0000D-01", "      0.5   ", Code::MatrixSyntax, Some(9), "has no exponent"),
        ("  5.0000D-01", "       5D-01", Code::MatrixSyntax, Some(9), "has no decimal point"),
        ("  5.0000D-01", "            ", Code::MatrixSyntax, Some(9), "is not a number"),
        ("  4.0000D+00\n", "  4.0000D+00  4.0000D+00\n", Code::MatrixCount, Some(9), "has 3 numbers"),
    ] {
        assert!(SYMMETRIC.contains(from), "{from}");
        let error = read(&SYMMETRIC.replacen(from, to, 1)).expect_err(to);
        let first = error.first_error();
        assert_eq!((first.code(), first.line()), (code, line), "{to}: {error}");
        assert!(error.to_string().contains(words) && error.to_string().contains("K.rsa"), "{to}: {error}");
    }
}

#[test]
fn a_file_that_ends_early_is_refused() {
    let end = SYMMETRIC.find("  1.0000E+00").expect("right-hand sides") - 1;
    assert_eq!(read(&format!("{}\n", &SYMMETRIC[..end])).expect("a matrix").matrix, expected());
    // The last number fills its columns, so that no digit can be missing.
    assert_eq!(read(&SYMMETRIC[..end]).expect("a matrix").matrix, expected());
    for length in 1..end {
        let text = &SYMMETRIC[..length];
        let error = read(text).expect_err(text);
        assert!(error.diagnostics().iter().all(|diagnostic| !diagnostic.message().is_empty()));
        assert!(read(&format!("{text}\n")).is_err() || length + 12 > end, "{text}");
    }
}

/// Sizes that a small file states are refused before memory is taken for them.
#[test]
fn absurd_sizes_are_refused() {
    let head = |n: u64, entries: u64| {
        let lines = |count: u64| count.div_ceil(10);
        let counts = [lines(n + 1), lines(entries), lines(entries)];
        let total: u64 = counts.iter().sum();
        format!(
            "K\n{total:>14}{:>14}{:>14}{:>14}\nRSA           {n:>14}{n:>14}{entries:>14}{:>14}\n(10I8) (10I8) (10E20.12)\n       1\n",
            counts[0], counts[1], counts[2], 0
        )
    };
    for (n, entries, code) in [
        (5_000_000_000, 5_000_000_000, Code::MatrixTooLarge),
        (4_000_000, 1, Code::MatrixSyntax),
        (12, 99_999_999_999, Code::MatrixCount),
        (4_000_000_000, 4_000_000_000_000, Code::MatrixCount),
        (100_000, 600_000_000_000, Code::MatrixCount),
    ] {
        let error = read(&head(n, entries)).expect_err("refused");
        assert!(error.has(code), "{n} {entries}: {error}");
    }
}
