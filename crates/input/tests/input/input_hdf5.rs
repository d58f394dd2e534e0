//! HDF5 matrices: layouts, types, roles, declared triangles.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_input::{MatrixLocation, MatrixRole, read_matrix};
use flexbody_linalg::CscMatrix;
use flexbody_model::RawMatrix;
use hdf5_metno::types::VarLenUnicode;
use hdf5_metno::{File, Group, H5Type};
use proptest::prelude::*;
use std::path::Path;
use std::str::FromStr;

type Entries = Vec<(usize, usize, f64)>;

/// Builds a file with `build` and reads a matrix from it.
fn read(group: Option<&str>, role: MatrixRole, build: impl FnOnce(&File)) -> Result<RawMatrix> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.h5");
    let file = File::create(&path).unwrap();
    build(&file);
    file.close().unwrap();
    read_matrix(&MatrixLocation { path, group: group.map(str::to_owned) }, role)
}

fn put<T: H5Type>(group: &Group, name: &str, values: &[T], packed: bool) {
    let builder = group.new_dataset_builder();
    if packed && !values.is_empty() {
        builder.chunk(3.min(values.len())).deflate(1).with_data(values).create(name).unwrap();
    } else {
        builder.with_data(values).create(name).unwrap();
    }
}

fn text(group: &Group, name: &str, value: &str) {
    let value = VarLenUnicode::from_str(value).unwrap();
    group.new_attr::<VarLenUnicode>().create(name).unwrap().write_scalar(&value).unwrap();
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Layout {
    Columns,
    Rows,
    Coordinates,
}

#[derive(Debug, Clone, Copy)]
enum Index {
    I32,
    I64,
    U32,
    U64,
    F64,
}

fn put_index(group: &Group, name: &str, values: &[usize], index: Index, packed: bool) {
    match index {
        Index::I32 => put(group, name, &values.iter().map(|&v| v as i32).collect::<Vec<_>>(), packed),
        Index::I64 => put(group, name, &values.iter().map(|&v| v as i64).collect::<Vec<_>>(), packed),
        Index::U32 => put(group, name, &values.iter().map(|&v| v as u32).collect::<Vec<_>>(), packed),
        Index::U64 => put(group, name, &values.iter().map(|&v| v as u64).collect::<Vec<_>>(), packed),
        Index::F64 => put(group, name, &values.iter().map(|&v| v as f64).collect::<Vec<_>>(), packed),
    }
}

/// Stores entries (in any order, duplicates allowed) in a group.
fn store(group: &Group, n: usize, entries: &Entries, layout: Layout, index: Index, packed: bool) {
    let mut entries = entries.clone();
    match layout {
        Layout::Columns => entries.sort_by_key(|e| e.1), // a stable sort keeps the order of duplicates
        Layout::Rows => entries.sort_by_key(|e| e.0),
        Layout::Coordinates => {}
    }
    let values: Vec<f64> = entries.iter().map(|e| e.2).collect();
    let rows: Vec<usize> = entries.iter().map(|e| e.0).collect();
    let cols: Vec<usize> = entries.iter().map(|e| e.1).collect();
    put(group, "data", &values, packed);
    if layout == Layout::Coordinates {
        put_index(group, "row", &rows, index, packed);
        put_index(group, "col", &cols, index, packed);
        put_index(group, "shape", &[n, n], index, false);
        return;
    }
    let (major, minor) = if layout == Layout::Columns { (cols, rows) } else { (rows, cols) };
    let pointers: Vec<usize> = (0..=n).map(|j| major.partition_point(|&m| m < j)).collect();
    put_index(group, "indices", &minor, index, packed);
    put_index(group, "indptr", &pointers, index, packed);
    text(group, "encoding-type", if layout == Layout::Rows { "csr_matrix" } else { "csc_matrix" });
    let shape = [n as i64, n as i64];
    group.new_attr_builder().with_data(&shape).create("shape").unwrap();
}

fn expected(n: usize, entries: &Entries) -> CscMatrix {
    let triplets: Vec<_> = entries.iter().map(|&(i, j, v)| (i as u32, j as u32, v)).collect();
    CscMatrix::from_triplets(n, n, &triplets)
}

fn small() -> Entries {
    vec![(0, 0, 2.5), (1, 0, -1.25), (0, 1, -1.25), (1, 1, 2.5), (2, 2, 1.0 / 3.0)]
}

fn lower(entries: &Entries) -> Entries {
    entries.iter().copied().filter(|e| e.0 >= e.1).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    /// The result does not depend on layout, index type, chunks and a declared triangle, and asymmetry is
    /// detected.
    #[test]
    fn any_layout_comes_back(
        n in 2..8usize,
        raw in proptest::collection::vec((0..8usize, 0..8usize, 0.1..9.0f64), 1..30),
        layout in prop_oneof![Just(Layout::Columns), Just(Layout::Rows), Just(Layout::Coordinates)],
        index in prop_oneof![Just(Index::I32), Just(Index::I64), Just(Index::U32), Just(Index::U64), Just(Index::F64)],
        packed in any::<bool>(),
        triangle in any::<bool>(),
    ) {
        let mut entries: Entries = raw.into_iter().map(|(i, j, v)| (i % n, j % n, v)).collect();
        if triangle {
            entries.iter_mut().for_each(|e| *e = (e.0.max(e.1), e.0.min(e.1), e.2));
        } else {
            entries.extend([(1, 0, 3.0), (0, 1, 4.0)]); // entries in both triangles, not symmetric
        }
        let full: Entries = if triangle {
            entries.iter().flat_map(|&(i, j, v)| [Some((i, j, v)), (i != j).then_some((j, i, v))]).flatten().collect()
        } else if layout == Layout::Rows {
            // Rows are read as columns: the transpose, which is equally asymmetric.
            entries.iter().map(|&(i, j, v)| (j, i, v)).collect()
        } else {
            entries.clone()
        };
        let raw = read(None, MatrixRole::Stiffness, |file| {
            let group = file.create_group("matrix").unwrap();
            store(&group, n, &entries, layout, index, packed);
            if triangle {
                text(&group, "symmetric", "lower");
            }
        });
        let raw = raw.map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert_eq!(raw.matrix, expected(n, &full));
    }
}

#[test]
fn the_role_chooses_among_several_matrices() {
    let stiffness = small();
    let mass: Entries = (0..3).map(|i| (i, i, 0.5 + i as f64)).collect();
    let build = |names: [&'static str; 2]| {
        let (stiffness, mass) = (&stiffness, &mass);
        move |file: &File| {
            for (name, entries) in names.into_iter().zip([stiffness, mass]) {
                let group = file.create_group(name).unwrap();
                store(&group, 3, entries, Layout::Columns, Index::I32, false);
            }
        }
    };
    for names in [["K", "M"], ["k", "mass"], ["fe/Stiffness", "fe/Mass"], ["K", "other"]] {
        let raw = read(None, MatrixRole::Stiffness, build(names)).unwrap();
        assert_eq!(raw.matrix, expected(3, &stiffness), "{names:?}");
    }
    let raw = read(None, MatrixRole::Mass, build(["K", "M"])).unwrap();
    assert_eq!(raw.matrix, expected(3, &mass));
    let raw = read(Some("/fe/b"), MatrixRole::Stiffness, build(["fe/a", "fe/b"])).unwrap();
    assert_eq!(raw.matrix, expected(3, &mass));
    // If none or both are named after the role, the user must select one.
    for names in [["a", "b"], ["x/K", "y/K"], ["M", "mass"]] {
        let error = read(None, MatrixRole::Stiffness, build(names)).unwrap_err();
        assert!(error.has(Code::Hdf5Layout), "{names:?}: {error}");
        for name in names {
            assert!(error.to_string().contains(&format!("/{name}")), "{name} is listed: {error}");
        }
    }
}

#[test]
fn one_triangle_needs_a_word_about_it() {
    let build = |attribute: Option<&'static str>| {
        move |file: &File| {
            let group = file.create_group("K").unwrap();
            store(&group, 3, &lower(&small()), Layout::Columns, Index::I32, false);
            if let Some(word) = attribute {
                text(&group, "symmetric", word);
            }
        }
    };
    for word in ["lower", "upper", "L", "true"] {
        // A triangle by columns or by rows gives the same matrix.
        let raw = read(None, MatrixRole::Stiffness, build(Some(word))).unwrap();
        assert_eq!(raw.matrix, expected(3, &small()), "{word}");
    }
    for word in [None, Some("false"), Some("general")] {
        let error = read(None, MatrixRole::Stiffness, build(word)).unwrap_err();
        assert!(error.has(Code::MatrixAsymmetric), "{word:?}: {error}");
    }
}

#[test]
fn a_full_matrix_may_be_called_symmetric() {
    let raw = read(None, MatrixRole::Stiffness, |file| {
        let group = file.create_group("K").unwrap();
        store(&group, 3, &small(), Layout::Rows, Index::U64, false);
        group.new_attr::<bool>().create("symmetric").unwrap().write_scalar(&true).unwrap();
    });
    assert_eq!(raw.unwrap().matrix, expected(3, &small()));
}

#[test]
fn single_precision_has_seven_digits() {
    let raw = read(None, MatrixRole::Mass, |file| {
        let group = file.create_group("M").unwrap();
        let values: Vec<f32> = (1..=4).map(|i| (i as f32).sqrt()).collect();
        put(&group, "values", &values, false);
        put(&group, "rows", &[0u32, 1, 2, 3], false);
        put(&group, "cols", &[0u32, 1, 2, 3], false);
        put(&group, "shape", &[4i64, 4], false);
    });
    let raw = raw.unwrap();
    assert_eq!(raw.digits, 7);
    assert_eq!(raw.matrix.get(1, 1), f64::from(2f32.sqrt()));
}

#[test]
fn indices_that_no_matrix_has_are_refused() {
    let with = |row: f64| {
        read(None, MatrixRole::Stiffness, |file| {
            let group = file.create_group("K").unwrap();
            put(&group, "data", &[1.0, 2.0], false);
            put(&group, "row", &[0.0, row], false);
            put(&group, "col", &[0.0, 1.0], false);
            put(&group, "shape", &[2i32, 2], false);
        })
    };
    assert!(with(1.0).is_ok());
    for bad in [2.0, -1.0, 0.5, 1e300, f64::NAN, f64::INFINITY] {
        assert!(with(bad).unwrap_err().has(Code::MatrixIndex), "{bad}");
    }
    let error = read(None, MatrixRole::Stiffness, |file| {
        let group = file.create_group("K").unwrap();
        put(&group, "data", &[1.0], false);
        put(&group, "row", &[u64::MAX], false);
        put(&group, "col", &[0u64], false);
        put(&group, "shape", &[2u64, 2], false);
    });
    assert!(error.unwrap_err().has(Code::MatrixIndex));
}

#[test]
fn a_declared_size_asks_for_no_memory() {
    for shape in [[4_000_000_000i64, 4_000_000_000], [i64::MAX, i64::MAX], [-1, -1], [2, 3]] {
        let result = read(None, MatrixRole::Stiffness, |file| {
            let group = file.create_group("K").unwrap();
            put(&group, "data", &[1.0], false);
            put(&group, "row", &[0], false);
            put(&group, "col", &[0], false);
            put(&group, "shape", &shape, false);
        });
        assert!(result.is_err(), "{shape:?}");
    }
}

#[test]
fn groups_that_contain_themselves_do_not_trap_the_search() {
    let raw = read(None, MatrixRole::Stiffness, |file| {
        let group = file.create_group("a/b").unwrap();
        group.link_hard("/a", "again").unwrap();
        file.link_soft("/a", "soft").unwrap();
        let matrix = file.create_group("z").unwrap();
        store(&matrix, 3, &small(), Layout::Columns, Index::I32, false);
    });
    assert_eq!(raw.unwrap().matrix, expected(3, &small()));
}

#[test]
fn links_to_other_files_are_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.h5");
    let file = File::create(&other).unwrap();
    store(&file.create_group("K").unwrap(), 3, &small(), Layout::Columns, Index::I32, false);
    file.close().unwrap();
    for group in [None, Some("/K")] {
        let error = read(group, MatrixRole::Stiffness, |file| {
            file.link_external(other.to_str().unwrap(), "/K", "K").unwrap();
        });
        assert!(error.unwrap_err().has(Code::Hdf5Layout), "{group:?}");
    }
}

/// A soft link may lead through an external link: the numbers are then in another file, which the fingerprint
/// of this one does not cover.
#[test]
fn soft_links_are_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.h5");
    let file = File::create(&other).unwrap();
    store(&file.create_group("K").unwrap(), 3, &small(), Layout::Columns, Index::I32, false);
    file.close().unwrap();
    for group in [None, Some("/K"), Some("/soft")] {
        let error = read(group, MatrixRole::Stiffness, |file| {
            file.link_external(other.to_str().unwrap(), "/K", "ext").unwrap();
            file.link_soft("/ext", "soft").unwrap();
            let matrix = file.create_group("K").unwrap();
            for name in ["data", "indices", "indptr", "shape"] {
                matrix.link_soft(&format!("/ext/{name}"), name).unwrap();
            }
        });
        assert!(error.unwrap_err().has(Code::Hdf5Layout), "{group:?}");
    }
}

/// A path that HDF5 cannot open gives an error, not a panic.
#[test]
fn names_with_blanks_and_accents_are_fine() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Träger mit Blank.h5");
    let file = File::create(&path).unwrap();
    store(&file.create_group("Steifigkeit ü").unwrap(), 3, &small(), Layout::Columns, Index::I32, false);
    file.close().unwrap();
    let location = MatrixLocation::parse(format!("{}:/Steifigkeit ü", path.display()));
    assert!(Path::exists(&location.path));
    assert_eq!(read_matrix(&location, MatrixRole::Stiffness).unwrap().matrix, expected(3, &small()));
}
