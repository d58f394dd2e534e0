//! Small files that would unpack to a very large size: no more is unpacked than the header and the shape of
//! the matrix allow, and nothing beyond the memory.

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{MatrixLocation, MatrixRole, ModelFiles, read_manifest, read_matrix, read_model};
use oracle::fixtures;
use std::fs;
use std::io::Write;
use std::path::Path;

fn refused(path: &Path) -> Error {
    let location = MatrixLocation { path: path.to_path_buf(), group: None };
    read_matrix(&location, MatrixRole::Stiffness).expect_err("refused")
}

#[track_caller]
fn assert_refused(path: &Path, code: Code, words: &str) {
    let error = refused(path);
    assert_eq!(error.first_error().code(), code, "{error}");
    assert!(error.to_string().contains(words), "{error}");
}

fn gzip(path: &Path, head: &str, line: &str, times: usize) {
    let mut out = GzEncoder::new(fs::File::create(path).expect("a file"), Compression::fast());
    out.write_all(head.as_bytes()).expect("written");
    let many = line.repeat(1 << 16);
    (0..times).for_each(|_| out.write_all(many.as_bytes()).expect("written"));
    out.finish().expect("written");
}

const BANNER: &str = "%%MatrixMarket matrix coordinate real symmetric\n";

#[test]
fn a_matrix_market_file_is_read_up_to_its_first_entry_too_many() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.mtx.gz");
    gzip(&path, &format!("{BANNER}12 12 99999999999\n"), "1 1 0\n", 1);
    assert_refused(&path, Code::MatrixCount, "matrix of 12 rows declares 99999999999 entries");
    gzip(&path, &format!("{BANNER}12 12 78\n"), "1 1 1\n", 30);
    assert_refused(&path, Code::MatrixCount, "header announces 78 entries, the file has more");
}

/// Returns a file of the tetrahedron with `times` times 65536 lines behind its text.
fn with_tail(folder: &Path, name: &str, text: &str, line: &str, times: usize) -> std::path::PathBuf {
    let path = folder.join(name);
    gzip(&path, text, line, times);
    path
}

/// Blank lines and comments behind the entries, which a small file may unpack to without end. Few of them are no error.
#[test]
fn a_text_is_read_up_to_16_mib_of_blank_lines_and_comments() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = fs::read_to_string(fixtures().join("small/tet4/K.mtx")).expect("a matrix");
    let blanks = format!("{}\n", " ".repeat(63));
    for (line, times) in [("\n", 400), ("% of a comment, of many\n", 20), (&blanks, 8)] {
        let path = with_tail(folder.path(), "K.mtx.gz", &text, line, times);
        assert_refused(&path, Code::MatrixCount, "bytes with 42 values among them");
        let path = with_tail(folder.path(), "K.mtx.gz", &text, line, 1);
        let location = MatrixLocation { path, group: None };
        let read = read_matrix(&location, MatrixRole::Stiffness).expect("a matrix with a short tail");
        assert_eq!(read.matrix.n_rows(), 12);
    }
    let text = "%%MatrixMarket matrix array real general\n12 1\n".to_owned() + &"1\n".repeat(12);
    let path = with_tail(folder.path(), "shapes.mtx.gz", &text, &blanks, 8);
    let location = MatrixLocation { path, group: None };
    let error = flexbody_input::read_shapes(&location, &[12], "shapes").expect_err("refused");
    assert!(error.to_string().contains("bytes with 12 values among them"), "{error}");
    // Lines that cannot be read are named as well.
    let line = format!("no entry{blanks}");
    let path = with_tail(folder.path(), "K.mtx.gz", &format!("{BANNER}12 12 900000\n"), &line, 5);
    assert_refused(&path, Code::MatrixSyntax, "no entry");
}

/// Matrices without a header have the rows of their job.
#[test]
fn lines_without_a_head_are_no_more_than_their_rows_can_have() {
    let folder = tempfile::tempdir().expect("a folder");
    let from = fixtures().join("small/calculix");
    for entry in fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry");
        fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("copied");
    }
    let deck = folder.path().join("job.inp");
    let files = ModelFiles::from_job(&deck, None, Vec::new(), Some("m,kg,s")).expect("units");
    gzip(&folder.path().join("job.sti"), "", "1 1 1\n", 40);
    let error = read_model(&files).expect_err("refused");
    assert!(error.to_string().contains("declares") && error.has(Code::MatrixCount), "{error}");
    gzip(&folder.path().join("job.sti"), "1 1 1\n", "\n", 400);
    let error = read_model(&files).expect_err("refused");
    assert!(error.to_string().contains("bytes with 1 values among them"), "{error}");
}

/// Returns a NumPy array with this header and data.
fn npy(descr: &str, shape: &str, data: Vec<u8>) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\0".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn whole(numbers: &[i64]) -> Vec<u8> {
    let data = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    npy("<i8", &format!("({},)", numbers.len()), data)
}

fn npz(path: &Path, members: &[(&str, Vec<u8>)]) {
    let mut archive = zip::ZipWriter::new(fs::File::create(path).expect("a file"));
    let options =
        zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    for (name, bytes) in members {
        archive.start_file(format!("{name}.npy"), options).expect("a member");
        archive.write_all(bytes).expect("written");
    }
    archive.finish().expect("written");
}

#[test]
fn an_archive_of_scipy_is_unpacked_as_its_headers_announce() {
    const MANY: usize = 4_000_000;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.npz");
    let of = |data: Vec<u8>, indices: Vec<u8>| {
        let head = [("format", npy("|S3", "()", b"csc".to_vec())), ("shape", whole(&[12, 12]))];
        let rest = [("data", data), ("indices", indices), ("indptr", whole(&[0; 13]))];
        npz(&path, &[head.as_slice(), rest.as_slice()].concat());
    };
    let floats = |count: usize, data: usize| npy("<f8", &format!("({count},)"), vec![0; 8 * data]);
    of(floats(MANY, MANY), whole(&[0]));
    assert_refused(&path, Code::MatrixCount, "matrix of 12 rows declares 4000000 entries");
    of(floats(1, MANY), whole(&[0]));
    assert_refused(&path, Code::MatrixCount, "bytes follow");
    of(floats(1, 1), whole(&vec![0; MANY]));
    assert_refused(&path, Code::MatrixCount, "1 values have 4000000 indices");
    npz(&path, &[("format", vec![0; 8 * MANY]), ("shape", whole(&[12, 12])), ("data", floats(1, 1))]);
    assert_refused(&path, Code::MatrixKind, "stored in the form");
}

/// Returns an element of a MAT-file, padded to a multiple of eight bytes.
fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut own = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
    own.extend(bytes);
    own.resize(own.len().next_multiple_of(8), 0);
    own
}

/// Returns a MAT-file with one compressed variable.
fn mat_file(variable: &[u8]) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(&[14u32.to_le_bytes(), (variable.len() as u32).to_le_bytes()].concat()).expect("memory");
    packed.write_all(variable).expect("memory");
    let packed = packed.finish().expect("memory");
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend(b"\x00\x01IM");
    file.extend([15u32.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat());
    file.extend(packed);
    file
}

#[test]
fn a_variable_of_matlab_has_no_more_bytes_than_its_extents_leave() {
    let head =
        [element(6, &[5, 0, 0, 0, 1, 0, 0, 0]), element(5, &[12, 0, 0, 0, 12, 0, 0, 0]), element(1, b"K")];
    let mut variable = head.concat();
    variable.extend(element(5, &vec![0; 32_000_000]));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.mat");
    fs::write(&path, mat_file(&variable)).expect("written");
    assert_refused(
        &path,
        Code::MatrixCount,
        "a variable has 32000000 bytes, but its extents allow at most 4000000",
    );
}

/// Zeros behind the numbers of a packed variable.
#[test]
fn a_variable_of_matlab_ends_with_its_numbers() {
    let value = |count: usize| {
        let head = [element(6, &[6, 0, 0, 0, 0, 0, 0, 0]), element(5, &[2, 0, 0, 0, 2, 0, 0, 0])];
        let numbers = [element(1, b"K"), element(9, &[2.0f64, 1.0, 1.0, 2.0].map(f64::to_le_bytes).concat())];
        let mut variable = [head.concat(), numbers.concat()].concat();
        variable.resize(variable.len() + count, 0);
        mat_file(&variable)
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.mat");
    fs::write(&path, value(1 << 20)).expect("written");
    assert_refused(
        &path,
        Code::MatrixCount,
        "a compressed variable has more than 65536 bytes after its numbers",
    );
    fs::write(&path, value(8)).expect("written");
    let location = MatrixLocation { path, group: None };
    assert_eq!(read_matrix(&location, MatrixRole::Stiffness).expect("a matrix").matrix.get(0, 0), 2.0);
}

#[test]
fn points_of_vtk_are_unpacked_as_many_as_there_are() {
    const BLOCK: usize = 1 << 22;
    let mut one = ZlibEncoder::new(Vec::new(), Compression::fast());
    one.write_all(&vec![0; BLOCK]).expect("memory");
    let one = one.finish().expect("memory");
    let head = [12, BLOCK as u64, 0].into_iter().chain([one.len() as u64; 12]);
    let mut data: Vec<u8> = head.flat_map(u64::to_le_bytes).collect();
    (0..12).for_each(|_| data.extend(&one));
    let before = "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" \
        header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\
        <Piece NumberOfPoints=\"4\" NumberOfCells=\"0\"><Points><DataArray type=\"Float64\" \
        NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_";
    let file = [before.as_bytes(), &data, b"</AppendedData></VTKFile>"].concat();
    let folder = tempfile::tempdir().expect("a folder");
    for file in ["K.mtx", "M.mtx", "dofs.csv", "model.toml"] {
        fs::copy(fixtures().join("small/tet4").join(file), folder.path().join(file)).expect("copied");
    }
    fs::write(folder.path().join("nodes.vtu"), file).expect("written");
    let manifest = folder.path().join("model.toml");
    let text = fs::read_to_string(&manifest).expect("a manifest").replace("nodes.csv", "nodes.vtu");
    fs::write(&manifest, text).expect("written");
    let files = read_manifest(&manifest).expect("a manifest");
    let error = read_model(&files).expect_err("refused");
    assert!(error.to_string().contains("unpacks to 50331648 bytes, 96 are expected"), "{error}");
}

#[test]
fn pointers_and_chunks_of_hdf5_are_those_of_the_matrix() {
    const MANY: usize = 4_000_000;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.h5");
    let zeros = |group: &hdf5_metno::Group| {
        let zeros = group.new_dataset::<i64>().chunk(1 << 20).deflate(1).shape(MANY + 1).create("indptr");
        zeros.and_then(|dataset| dataset.write_raw(&vec![0_i64; MANY + 1])).expect("pointers");
        group.new_dataset_builder().with_data(&[1.0]).create("data").expect("values");
    };
    written(&path, zeros);
    assert_refused(&path, Code::MatrixSyntax, "declares 4000000 rows but stores only 1 entries");
    let chunk = |group: &hdf5_metno::Group| {
        let values = group.new_dataset::<f64>().chunk(2 * MANY).deflate(1).shape(0..).create("data");
        let values = values.expect("values");
        values.resize(1).and_then(|()| values.write_raw(&[1.0])).expect("one value");
        group.new_dataset_builder().with_data(&[0_i32, 1]).create("indptr").expect("pointers");
    };
    written(&path, chunk);
    assert_refused(&path, Code::MatrixCount, "has chunks of 8000000 values for 1 values");
}

/// Writes a file with the group K, whose only index is 0; no handle stays open.
fn written(path: &Path, fill: impl Fn(&hdf5_metno::Group)) {
    let file = hdf5_metno::File::create(path).expect("a file");
    let group = file.create_group("K").expect("a group");
    group.new_dataset_builder().with_data(&[0_i32]).create("indices").expect("indices");
    fill(&group);
}

/// Short lines of a deck of Nastran that stand for a million grids each.
#[test]
fn lines_of_nastran_stand_for_a_million_grids_in_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("nodes.bdf");
    let small = |name: &str| fixtures().join("small/tet4").join(name);
    let dofs = Some(small("dofs.csv"));
    let files = ModelFiles::from_arguments(small("K.mtx"), small("M.mtx"), &path, dofs, Some("m,kg,s"))
        .expect("units");
    let head = "SOL 103\nCEND\nBEGIN BULK\nGRID,10,,0.,0.,0.\nGRID,20,,.1,0.,0.\nGRID,30,,0.,.2,0.\nGRID,40,,0.,0.,.3\n";
    let ranges =
        |last: u32| format!("RBE2,1,10,123,100,THRU,{last}\nRBE2,2,10,123,100,THRU,{last}\nENDDATA\n");
    let repeated = |count: u32| format!("GRID,100,,0.,0.,0.\n=,*1,==\n=({count}),\n=({count}),\nENDDATA\n");
    for (lines, part) in [(ranges(600_000), "RBE2"), (repeated(600_000), "more than 1000000 cards")] {
        fs::write(&path, format!("{head}{lines}")).expect("written");
        let error = read_model(&files).expect_err("refused");
        assert_eq!(error.first_error().code(), Code::DeckSyntax, "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
    for lines in [ranges(60_000), repeated(60_000)] {
        fs::write(&path, format!("{head}{lines}")).expect("written");
        if let Err(error) = read_model(&files) {
            assert!(!error.has(Code::DeckSyntax), "{error}");
        }
    }
}

/// Several names of one dataset, each of which would be read.
#[test]
fn datasets_of_exodus_store_no_more_than_their_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("nodes.exo");
    let write = |sets: usize| {
        let file = hdf5_metno::File::create(&path).expect("a file");
        for (name, values) in [
            ("coordx", [0.0, 0.1, 0.0, 0.0]),
            ("coordy", [0.0, 0.0, 0.2, 0.0]),
            ("coordz", [0.0, 0.0, 0.0, 0.3]),
        ] {
            file.new_dataset_builder().with_data(&values).create(name).expect("coordinates");
        }
        file.new_dataset_builder().with_data(&[10, 20, 30, 40]).create("node_num_map").expect("numbers");
        file.new_dataset_builder().with_data(&[1; 20_000]).create("node_ns1").expect("a set");
        (2..=sets).for_each(|k| file.link_hard("node_ns1", &format!("node_ns{k}")).expect("a name"));
    };
    let small = |name: &str| fixtures().join("small/tet4").join(name);
    let dofs = Some(small("dofs.csv"));
    let files = ModelFiles::from_arguments(small("K.mtx"), small("M.mtx"), &path, dofs, Some("m,kg,s"))
        .expect("units");
    write(1);
    read_model(&files).expect("a set with a node many times");
    write(200);
    let error = read_model(&files).expect_err("refused");
    assert_eq!(error.first_error().code(), Code::NodeFileSyntax, "{error}");
    assert!(error.to_string().contains("node_ns2` has several names"), "{error}");
}
