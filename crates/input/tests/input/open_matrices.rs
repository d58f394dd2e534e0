//! Matrices of MATLAB and PETSc: written matrices are read back, and other files are refused with the reason.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_input::{MatrixLocation, MatrixRole, read_matrix};
use flexbody_linalg::CscMatrix;
use flexbody_model::RawMatrix;
use proptest::prelude::*;
use std::io::Write;

fn read(name: &str, bytes: &[u8], group: Option<&str>, role: MatrixRole) -> Result<RawMatrix> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    read_matrix(&MatrixLocation { path, group: group.map(str::to_owned) }, role)
}

fn fixture(name: &str) -> Vec<u8> {
    let path = oracle::fixtures().join("readers").join(name);
    std::fs::read(path).expect("a fixture")
}

/// Compressed columns of a symmetric matrix.
#[derive(Debug, Clone)]
struct Columns {
    n: usize,
    pointers: Vec<i64>,
    indices: Vec<i64>,
    values: Vec<f64>,
}

impl Columns {
    fn of(matrix: &CscMatrix) -> Self {
        let n = matrix.n_cols();
        let pointers = matrix.col_ptr().iter().map(|&at| at as i64).collect();
        let indices = matrix.row_idx().iter().map(|&row| i64::from(row)).collect();
        Self { n, pointers, indices, values: matrix.values().to_vec() }
    }

    fn petsc(&self, whole: fn(i64) -> Vec<u8>, real: fn(f64) -> Vec<u8>) -> Vec<u8> {
        let lengths: Vec<i64> = self.pointers.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let head = [1_211_216, self.n as i64, self.n as i64, self.values.len() as i64];
        let numbers = head.iter().chain(&lengths).chain(&self.indices);
        let mut bytes: Vec<u8> = numbers.flat_map(|number| whole(*number)).collect();
        bytes.extend(self.values.iter().flat_map(|value| real(*value)));
        bytes
    }

    fn mat5(&self, order: Order, packed: bool) -> Vec<u8> {
        let whole = |numbers: &[i64]| {
            let bytes: Vec<u8> = numbers.iter().flat_map(|&number| order.four(number as u32)).collect();
            order.element(5, &bytes)
        };
        let values: Vec<u8> = self.values.iter().flat_map(|value| order.eight(value.to_bits())).collect();
        let flags = [order.four(5), order.four(self.values.len() as u32)].concat();
        let parts = [
            order.element(6, &flags),
            whole(&[self.n as i64, self.n as i64]),
            order.short_element(1, b"K"),
            whole(&self.indices),
            whole(&self.pointers),
            order.element(9, &values),
        ];
        let variable = order.element(14, &parts.concat());
        let mut file = b"MATLAB 5.0 MAT-file".to_vec();
        file.resize(124, b' ');
        file.extend(match order {
            Order::Little => b"\x00\x01IM",
            Order::Big => b"\x01\x00MI",
        });
        if !packed {
            return [file, variable].concat();
        }
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(&variable).expect("packed");
        let packed = encoder.finish().expect("packed");
        [file, order.four(15), order.four(packed.len() as u32), packed].concat()
    }
}

#[derive(Debug, Clone, Copy)]
enum Order {
    Little,
    Big,
}

impl Order {
    fn four(self, number: u32) -> Vec<u8> {
        match self {
            Self::Little => number.to_le_bytes().to_vec(),
            Self::Big => number.to_be_bytes().to_vec(),
        }
    }

    fn eight(self, number: u64) -> Vec<u8> {
        match self {
            Self::Little => number.to_le_bytes().to_vec(),
            Self::Big => number.to_be_bytes().to_vec(),
        }
    }

    fn element(self, kind: u32, bytes: &[u8]) -> Vec<u8> {
        let mut element = [self.four(kind), self.four(bytes.len() as u32), bytes.to_vec()].concat();
        element.resize(element.len().next_multiple_of(8), 0);
        element
    }

    /// Writes up to four bytes within the tag.
    fn short_element(self, kind: u32, bytes: &[u8]) -> Vec<u8> {
        let mut element = [self.four((bytes.len() as u32) << 16 | kind), bytes.to_vec()].concat();
        element.resize(8, 0);
        element
    }
}

fn symmetric() -> impl Strategy<Value = CscMatrix> {
    let entry = (0..9u32, 0..9u32, -1e9..1e9f64);
    (1..10usize, proptest::collection::vec(entry, 1..40)).prop_map(|(n, entries)| {
        let mut triplets = vec![(0, 0, 1.0)];
        for (i, j, value) in entries {
            let (i, j) = (i % n as u32, j % n as u32);
            triplets.push((i, j, value));
            if i != j {
                triplets.push((j, i, value));
            }
        }
        CscMatrix::from_triplets(n, n, &triplets)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn matrices_of_petsc_come_back(matrix in symmetric(), long in any::<bool>(), single in any::<bool>()) {
        let whole = |number: i64| (number as i32).to_be_bytes().to_vec();
        let long_whole = |number: i64| number.to_be_bytes().to_vec();
        let real = |value: f64| value.to_be_bytes().to_vec();
        let short_real = |value: f64| (value as f32).to_be_bytes().to_vec();
        let bytes = Columns::of(&matrix)
            .petsc(if long { long_whole } else { whole }, if single { short_real } else { real });
        let raw = read("K.dat", &bytes, None, MatrixRole::Stiffness)
            .map_err(|error| TestCaseError::fail(error.to_string()))?;
        if single {
            prop_assert!(raw.digits <= 7);
            prop_assert!(raw.matrix.values().iter().zip(matrix.values()).all(|(a, b)| *a == f64::from(*b as f32)));
        } else {
            prop_assert_eq!(raw.matrix, matrix);
        }
    }

    #[test]
    fn matrices_of_matlab_come_back(matrix in symmetric(), big in any::<bool>(), packed in any::<bool>()) {
        let bytes = Columns::of(&matrix).mat5(if big { Order::Big } else { Order::Little }, packed);
        let raw = read("K", &bytes, None, MatrixRole::Stiffness)
            .map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!(&raw.matrix, &matrix);
        let named = read("K", &bytes, Some("/K"), MatrixRole::Mass);
        prop_assert_eq!(named.map_err(|error| TestCaseError::fail(error.to_string()))?.matrix, matrix);
    }
}

/// K and M are in one file together with arrays, texts, structs and cells.
#[test]
fn variables_of_matlab_are_taken_by_role_or_by_name() {
    let one = CscMatrix::from_triplets(6, 6, &[0, 1, 2, 3, 4, 5].map(|k| (k, k, 1.0)));
    for name in ["matlab/scipy_compressed.mat", "matlab/octave_v7.mat"] {
        let bytes = fixture(name);
        let of = |group: Option<&str>, role| read("a.mat", &bytes, group, role);
        assert_eq!(of(None, MatrixRole::Mass).expect("M").matrix, one, "{name}");
        assert_eq!(of(Some("/M"), MatrixRole::Stiffness).expect("M").matrix, one, "{name}");
        assert_eq!(of(None, MatrixRole::Stiffness).expect("K").matrix.nnz(), 24, "{name}");
        let error = of(None, MatrixRole::Damping).expect_err("no damping");
        assert!(error.has(Code::Hdf5Layout) && error.to_string().contains("/K, /M"), "{name}: {error}");
    }
    let only = fixture("matlab/octave_v6.mat");
    let error = read("a.mat", &only, None, MatrixRole::Mass).expect_err("it is K");
    assert!(error.to_string().contains("named like the stiffness matrix"), "{error}");
    let many = fixture("matlab/octave_v7.mat");
    for (group, code, part) in [
        ("/s", Code::MatrixKind, "a struct"),
        ("/c", Code::MatrixKind, "a cell array"),
        ("/k", Code::Hdf5Layout, "not in the file"),
    ] {
        let error = read("a.mat", &many, Some(group), MatrixRole::Stiffness).expect_err(part);
        assert!(error.has(code) && error.to_string().contains(part), "{part}: {error}");
    }
}

#[test]
fn damaged_matrices_are_refused_by_what_is_wrong() {
    let good =
        Columns::of(&CscMatrix::from_triplets(2, 2, &[(0, 0, 2.0), (1, 1, 3.0), (0, 1, 1.0), (1, 0, 1.0)]));
    let whole = |number: i64| (number as i32).to_be_bytes().to_vec();
    let real = |value: f64| value.to_be_bytes().to_vec();
    let petsc = |change: fn(&mut Columns)| {
        let mut changed = good.clone();
        change(&mut changed);
        changed.petsc(whole, real)
    };
    let matlab = |change: fn(&mut Columns)| {
        let mut changed = good.clone();
        change(&mut changed);
        changed.mat5(Order::Little, true)
    };
    let mut little_endian = petsc(|_| ());
    little_endian[..4].reverse();
    for (bytes, code) in [
        (petsc(|a| a.indices[1] = 2), Code::MatrixIndex),
        (petsc(|a| a.indices[1] = -1), Code::MatrixIndex),
        (petsc(|a| a.pointers[1] = 3), Code::MatrixAsymmetric),
        (petsc(|a| a.pointers[2] = 3), Code::MatrixSyntax),
        (petsc(|a| a.pointers[1] = -1), Code::MatrixSyntax),
        (petsc(|a| a.values[3] = f64::NAN), Code::MatrixNotFinite),
        (petsc(|a| a.values[2] = 0.0), Code::MatrixAsymmetric),
        (petsc(|a| a.n = 1_000_000_000), Code::MatrixSyntax),
        (little_endian, Code::FileFormatUnknown),
        (matlab(|a| a.indices[1] = 2), Code::MatrixIndex),
        (matlab(|a| a.pointers[1] = 5), Code::MatrixSyntax),
        (matlab(|a| a.pointers[2] = 5), Code::MatrixSyntax),
        (matlab(|a| a.pointers.push(4)), Code::MatrixCount),
        (matlab(|a| a.values[0] = f64::INFINITY), Code::MatrixNotFinite),
        (matlab(|a| a.values[2] = 0.0), Code::MatrixAsymmetric),
        (matlab(|a| a.n = 2_000_000_000), Code::MatrixSyntax),
    ] {
        let error = read("K", &bytes, None, MatrixRole::Stiffness).expect_err("refused");
        assert!(error.has(code), "{code:?}: {error}");
    }
}
