//! Matrices in structs of MATLAB, in files of version 5 and 7.3.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_input::{MatrixLocation, MatrixRole, read_matrix};
use flexbody_model::RawMatrix;
use std::io::Write;

/// Returns an element of a MAT-file, padded to a multiple of eight bytes.
fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut element = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
    element.extend(bytes);
    element.resize(element.len().next_multiple_of(8), 0);
    element
}

fn integers(values: &[i32]) -> Vec<u8> {
    element(5, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>())
}

fn reals(values: &[f64]) -> Vec<u8> {
    element(9, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>())
}

/// Returns a variable of this class.
fn variable(class: u8, extents: [i32; 2], name: &str, content: &[Vec<u8>]) -> Vec<u8> {
    let head = [element(6, &[class, 0, 0, 0, 1, 0, 0, 0]), integers(&extents), element(1, name.as_bytes())];
    element(14, &[head.concat(), content.concat()].concat())
}

/// Returns the full matrix [[k, 1], [1, 3]].
fn full(name: &str, k: f64) -> Vec<u8> {
    variable(6, [2, 2], name, &[reals(&[k, 1.0, 1.0, 3.0])])
}

/// Returns the sparse matrix [[k, 1], [1, 3]].
fn sparse(name: &str, k: f64) -> Vec<u8> {
    variable(5, [2, 2], name, &[integers(&[0, 1, 0, 1]), integers(&[0, 2, 4]), reals(&[k, 1.0, 1.0, 3.0])])
}

fn structs(extents: [i32; 2], name: &str, fields: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut names = Vec::new();
    for (field, _) in fields {
        names.extend(field.as_bytes());
        names.resize(names.len().next_multiple_of(8), 0);
    }
    let mut content = vec![integers(&[8]), element(1, &names)];
    content.extend(fields.iter().map(|(_, field)| field.clone()));
    variable(2, extents, name, &content)
}

fn file(variables: &[Vec<u8>], compressed: bool) -> Vec<u8> {
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend(b"\x00\x01IM");
    for variable in variables {
        if compressed {
            let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            packed.write_all(variable).expect("memory");
            let packed = packed.finish().expect("memory");
            file.extend([15u32.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat());
            file.extend(packed);
        } else {
            file.extend(variable);
        }
    }
    file
}

fn read(bytes: &[u8], group: Option<&str>, role: MatrixRole) -> Result<RawMatrix> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.mat");
    std::fs::write(&path, bytes).expect("written");
    read_matrix(&MatrixLocation { path, group: group.map(str::to_owned) }, role)
}

/// A struct with a text, an empty field, K and another struct with K and M.
fn model() -> Vec<u8> {
    let text = variable(4, [1, 1], "", &[element(4, &[b'x', 0])]);
    let inner = structs([1, 1], "", &[("K", full("", 5.0)), ("M", sparse("", 6.0))]);
    structs(
        [1, 1],
        "model",
        &[("name", text), ("empty", element(14, &[])), ("K", sparse("", 4.0)), ("more", inner)],
    )
}

#[test]
fn fields_of_structs_are_named_by_their_path() {
    for compressed in [false, true] {
        let bytes = file(&[variable(6, [1, 1], "n", &[reals(&[2.0])]), model()], compressed);
        for (group, corner) in [
            ("/model.K", 4.0),
            ("/model/K", 4.0),
            ("model.more.K", 5.0),
            ("/model.more/M", 6.0),
            ("/model/more/M/", 6.0),
        ] {
            let raw =
                read(&bytes, Some(group), MatrixRole::Stiffness).unwrap_or_else(|e| panic!("{group}: {e}"));
            let entries = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(row, col)| raw.matrix.get(row, col));
            assert_eq!(entries, [corner, 1.0, 1.0, 3.0], "{group}");
        }
        for (group, code, words) in [
            ("/model", Code::MatrixKind, "variable `model` holds a struct"),
            ("/model.D", Code::Hdf5Layout, "`model/D` is not in the file"),
            ("/model.D", Code::Hdf5Layout, "/n, /model/name, /model/K, /model/more/K, /model/more/M"),
            ("/model.name", Code::MatrixKind, "holds a text"),
            ("/n.K", Code::Hdf5Layout, "within the variable `n`"),
        ] {
            let error = read(&bytes, Some(group), MatrixRole::Stiffness).expect_err("refused");
            assert!(error.has(code) && error.to_string().contains(words), "{group}: {error}");
        }
    }
}

/// Without a name a variable precedes fields, and the role decides among several.
#[test]
fn the_role_chooses_among_fields() {
    let both = structs([1, 1], "s", &[("K", full("", 7.0)), ("mass", full("", 8.0))]);
    let corner = |bytes: &[u8], role| read(bytes, None, role).map(|raw| raw.matrix.get(0, 0));
    let only = file(std::slice::from_ref(&both), true);
    assert_eq!(corner(&only, MatrixRole::Stiffness).expect("K"), 7.0);
    assert_eq!(corner(&only, MatrixRole::Mass).expect("M"), 8.0);
    let beside = file(&[both, full("K", 9.0)], false);
    assert_eq!(corner(&beside, MatrixRole::Stiffness).expect("K"), 9.0);
    let two = file(&[structs([1, 1], "s", &[("A", full("", 7.0)), ("B", full("", 8.0))])], false);
    let error = corner(&two, MatrixRole::Stiffness).expect_err("two");
    assert!(error.to_string().contains("the file has /s/A, /s/B"), "{error}");
}

#[test]
fn damaged_structs_are_refused() {
    let fields = [("K", full("", 7.0)), ("K", full("", 8.0))];
    let many = file(&[structs([1, 2], "s", &fields)], false);
    let error = read(&many, Some("/s.K"), MatrixRole::Stiffness).expect_err("an array of structs");
    assert!(error.has(Code::Hdf5Layout) && error.to_string().contains("an array of structs"), "{error}");
    let nan = file(&[structs([1, 1], "s", &[("K", full("", f64::NAN))])], true);
    assert!(read(&nan, Some("/s.K"), MatrixRole::Stiffness).expect_err("NaN").has(Code::MatrixNotFinite));
    let wide = structs([1, 1], "s", &[("K", variable(6, [2, 3], "", &[reals(&[1.0; 6])]))]);
    let error = read(&file(&[wide], true), Some("/s.K"), MatrixRole::Stiffness).expect_err("not square");
    assert!(error.has(Code::MatrixNotSquare), "{error}");
    let few = structs([1, 1], "s", &[("K", variable(6, [2, 2], "", &[reals(&[1.0; 3])]))]);
    let error = read(&file(&[few], false), Some("/s.K"), MatrixRole::Stiffness).expect_err("three values");
    assert!(error.has(Code::MatrixCount), "{error}");
    let nameless = variable(2, [1, 1], "s", &[integers(&[0]), element(1, b"K"), full("", 1.0)]);
    let error = read(&file(&[nameless], false), Some("/s.K"), MatrixRole::Stiffness).expect_err("no length");
    assert!(error.has(Code::MatrixSyntax), "{error}");
    for compressed in [false, true] {
        let whole = file(&[model()], compressed);
        for length in 128..whole.len() - 8 {
            assert!(
                read(&whole[..length], Some("/model.more.M"), MatrixRole::Mass).is_err(),
                "{length} bytes"
            );
        }
        // Any byte that is changed gives a matrix or an error, never a panic.
        for at in 128..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0xff;
            let _ = read(&bytes, Some("/model.more.K"), MatrixRole::Stiffness);
        }
    }
    let mut deep = full("", 2.0);
    for _ in 0..2000 {
        deep = structs([1, 1], "", &[("s", deep)]);
    }
    let deep = file(&[structs([1, 1], "top", &[("s", deep)])], false);
    assert!(read(&deep, None, MatrixRole::Stiffness).expect_err("deep").has(Code::Hdf5Layout));
}

#[test]
fn full_datasets_of_version_7_3_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.mat");
    {
        let file = hdf5_metno::File::create(&path).expect("a file");
        let group = file.create_group("model").expect("a group");
        let write = |name: &str, shape: (usize, usize), values: &[f64]| {
            let dataset = group.new_dataset::<f64>().shape(shape).create(name).expect("a dataset");
            dataset.write_raw(values).expect("written");
        };
        write("K", (2, 2), &[4.0, 1.0, 1.0, 3.0]);
        write("mass", (2, 2), &[5.0, 0.0, 0.0, 6.0]);
        write("nan", (2, 2), &[5.0, f64::NAN, f64::NAN, 6.0]);
        write("lower", (2, 2), &[5.0, 1.0, 0.0, 6.0]);
        write("wide", (2, 3), &[1.0; 6]);
        let huge =
            group.new_dataset::<f64>().chunk((1, 1)).shape((4_000_000_000, 4_000_000_000)).create("huge");
        huge.expect("a dataset without values");
    }
    let read = |group: Option<&str>, role| {
        read_matrix(&MatrixLocation { path: path.clone(), group: group.map(str::to_owned) }, role)
    };
    for (group, role, corner) in [
        (None, MatrixRole::Stiffness, 4.0),
        (None, MatrixRole::Mass, 5.0),
        (Some("/model.K"), MatrixRole::Stiffness, 4.0),
        (Some("/model/mass"), MatrixRole::Stiffness, 5.0),
    ] {
        assert_eq!(read(group, role).expect("a matrix").matrix.get(0, 0), corner, "{group:?}");
    }
    for (group, code) in [
        ("/model.nan", Code::MatrixNotFinite),
        ("/model.lower", Code::MatrixAsymmetric),
        ("/model.wide", Code::MatrixNotSquare),
        ("/model.huge", Code::MatrixCount),
        ("/model.D", Code::Hdf5Layout),
    ] {
        let error = read(Some(group), MatrixRole::Stiffness).expect_err("refused");
        assert!(error.has(code) && error.to_string().contains("model.mat"), "{group}: {error}");
    }
    let error = read(Some("/model.D"), MatrixRole::Stiffness).expect_err("no D").to_string();
    assert!(error.contains("/model/K") && error.contains("/model/mass"), "{error}");
}
