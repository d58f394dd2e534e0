//! Files beside a Nastran deck, names of matrices in them, continuations and replication of cards.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{MatrixLocation, MatrixRole, ModelFiles, read_manifest, read_matrix, read_model};
use flexbody_model::RawModel;
use oracle::fixtures;
use std::fs;
use std::path::{Path, PathBuf};

fn copied(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in fs::read_dir(fixtures().join("small").join(name)).expect("a folder") {
        let path = entry.expect("a file").path();
        fs::copy(&path, folder.path().join(path.file_name().expect("a name"))).expect("copied");
    }
    let path = folder.path().join("job.bdf");
    (folder, path)
}

fn read(path: &Path) -> Result<RawModel, Error> {
    read_model(&ModelFiles::from_job(path, None, Vec::new(), Some("m,kg,s")).expect("files"))
}

fn replace(path: &Path, old: &str, new: &str) {
    let text = fs::read_to_string(path).expect("a text");
    assert_eq!(text.matches(old).count(), 1, "{old}");
    fs::write(path, text.replace(old, new)).expect("written");
}

/// Matrix files belong to the deck with the same name, except those distinguished by a number or another
/// deck.
#[test]
fn matrices_of_another_job_are_not_taken() {
    let (folder, path) = copied("nastran_op4");
    let mut last = folder.path().join("job.op4");
    for (name, is_own) in [
        ("job_k.op4", true),
        ("job.matrices.op4", true),
        ("JOB-kgg.OP4", true),
        ("job2.op4", false),
        ("job_2.op4", false),
        ("job.v2.op4", false),
        ("jobs.op4", false),
        ("job_other.op4", true),
    ] {
        let next = folder.path().join(name);
        fs::rename(&last, &next).expect("moved");
        let found = read(&path);
        assert_eq!(found.is_ok(), is_own, "{name}");
        if let Err(error) = found {
            assert!(error.has(Code::JobIncomplete), "{name}: {error}");
        }
        last = next;
    }
    fs::copy(&path, folder.path().join("job_other.dat")).expect("copied");
    assert!(read(&path).expect_err("those of the other deck").has(Code::JobIncomplete));
}

/// Returns the text of a dense OUTPUT4 matrix.
fn output4(name: &str, n: usize, entry: impl Fn(usize, usize) -> f64) -> String {
    let mut text = format!("{n:8}{n:8}{:8}{:8}{name:8}1P,3E24.16\n", 6, 2);
    for j in 0..n {
        text += &format!("{:8}{:8}{n:8}\n", j + 1, 1);
        for three in (0..n).collect::<Vec<_>>().chunks(3) {
            three.iter().for_each(|i| text += &format!("{:24.16E}", entry(*i, j)));
            text += "\n";
        }
    }
    text + &format!("{:8}{:8}{:8}\n{:24.16E}\n", n + 1, 1, 1, 1.0)
}

/// Matrices with one row, empty matrices and loads form no pair; the user selects one of several pairs.
#[test]
fn of_several_pairs_one_is_named() {
    let (folder, path) = copied("nastran_op4");
    let expected = read(&path).expect("read");
    let (n, raw) = (73, &expected);
    let rows: Vec<usize> = {
        let ids = [11, 14, 17, 20, 23, 26, 29, 32, 35, 38, 41, 44];
        let labels = raw.dofs.as_ref().expect("labels");
        labels
            .iter()
            .map(|own| {
                6 * ids.iter().position(|id| *id == own.node).expect("a grid") + usize::from(own.direction)
                    - 1
            })
            .collect()
    };
    let of = |matrix: &flexbody_linalg::CscMatrix, i: usize, j: usize| {
        let place = |row: usize| rows.iter().position(|own| *own == row);
        place(i).zip(place(j)).map_or(0.0, |(i, j)| matrix.get(i, j))
    };
    let k = |name: &str, scale: f64| output4(name, n, |i, j| scale * of(&raw.stiffness.matrix, i, j));
    let m = |name: &str| output4(name, n, |i, j| of(&raw.mass.matrix, i, j));
    let small = |name: &str| output4(name, 1, |_, _| 0.0);
    let file = folder.path().join("job.op4");
    let write = |all: &[String]| fs::write(&file, all.concat()).expect("written");
    write(&[k("KAA\0\0\0\0\0", 1.0), m("MAA\0"), small("KASMX"), small("MASMX"), small("BXX")]);
    let raw = read(&path).expect("one pair has the rows of the deck");
    assert_eq!(raw.stiffness.matrix, expected.stiffness.matrix);
    write(&[k("KGG", 1.0), k("KAA", 4.0), m("MGG"), m("MAA")]);
    let error = read(&path).expect_err("two pairs");
    assert!(error.has(Code::DeckUnsupported) && error.to_string().contains("--matrices KGG,MGG"), "{error}");
    let convert = |words: &[&str]| {
        let words: Vec<&str> =
            ["convert"].iter().chain(words).chain(&["--modes", "1", "-o", "b.h5"]).copied().collect();
        flexbody(folder.path(), &words)
    };
    let done = convert(&["job.bdf", "--units", "m,kg,s", "--matrices", "kaa,MAA"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    for (words, part) in [
        (["job.bdf", "--matrices", "KXX,MAA"], "the matrices KXX and MAA"),
        (["job.bdf", "--matrices", "KAA"], "expected two names"),
    ] {
        let refused = convert(&words);
        let told = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && told.contains(part), "{told}");
    }
    let manifest = folder.path().join("model.toml");
    let read_named = |line: &str| {
        fs::write(&manifest, format!("[files]\njob = \"job.bdf\"\nmatrices = {line}\n")).expect("written");
        read_model(&read_manifest(&manifest)?)
    };
    let raw = read_named("[\"KAA\", \"/MGG\"]").expect("named");
    assert_eq!(raw.stiffness.matrix.get(0, 0), 4.0 * expected.stiffness.matrix.get(0, 0));
    for line in ["\"KAA\"", "[\"KAA\"]", "[1, 2]"] {
        assert!(read_named(line).expect_err(line).has(Code::ManifestSyntax));
    }
}

/// OUTPUT4 with eight-byte words has four letters of a name in each word.
#[test]
fn names_in_words_of_eight_bytes_are_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("K.op4");
    let mut bytes = Vec::new();
    let mut record = |words: &[i64], name: &[u8], values: &[f64]| {
        let own: Vec<u8> = words
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .chain(name.iter().copied())
            .chain(values.iter().flat_map(|value| value.to_le_bytes()))
            .collect();
        let length = (own.len() as i32).to_le_bytes();
        bytes.extend([&length[..], &own, &length].concat());
    };
    for name in [b"KGGX    B       ", b"KASMX\0\0\0\0\0\0\0\0\0\0\0", b"KJJ             "] {
        record(&[2, 2, 6, 2], name, &[]);
        record(&[1, 1, 2], b"", &[4.0, -1.0]);
        record(&[2, 1, 2], b"", &[-1.0, 3.0]);
        record(&[3, 1, 1], b"", &[1.0]);
    }
    fs::write(&path, bytes).expect("written");
    for name in ["KGGXB", "KASMX", "KJJ"] {
        let location = MatrixLocation { path: path.clone(), group: Some(format!("/{name}")) };
        let raw = read_matrix(&location, MatrixRole::Stiffness).expect(name);
        assert_eq!(raw.matrix.get(1, 1), 3.0);
    }
}

/// The rows of a separately read punch file exclude those of its loads.
#[test]
fn loads_of_a_punch_file_are_no_rows() {
    let (folder, _) = copied("nastran");
    let path = folder.path().join("job.pch");
    let text = fs::read_to_string(&path).expect("a punch file");
    fs::write(&path, text + "DMIG,PAX,0,9,2,0,,,2\nDMIG,PAX,1,0,,11,3,5.0\nDMIG,PAX,2,0,,44,1,5.0\n")
        .expect("written");
    let location = MatrixLocation { path, group: Some("/KAAX".to_owned()) };
    assert_eq!(read_matrix(&location, MatrixRole::Stiffness).expect("a matrix").matrix.n_cols(), 36);
}

/// Continuation names may have any case, and continuations may be anywhere in the file.
#[test]
fn continuations_are_found_by_their_names() {
    let (_folder, path) = copied("nastran_op4");
    let expected = read(&path).expect("read");
    let card =
        "CHEXA   2       1       23      35      41      29      26      38      +E2\n+E2     44      32\n";
    for (old, new) in [
        ("+E2     44", "+e2     44"),
        (
            card,
            "+E2     44      32\nPARAM,A,1\nCHEXA   2       1       23      35      41      29      26      38      +E2\n",
        ),
        (card, "CHEXA,2,1,23,35,41,29,26,38,+E2\nGRID,90,,0.,0.,0.\n+e2,44,32\n"),
    ] {
        let (_folder, path) = copied("nastran_op4");
        replace(&path, old, new);
        let with_grid = new.contains("GRID,90");
        let found = read(&path);
        if with_grid {
            // The additional grid point has no rows.
            assert!(found.expect_err("79 rows").has(Code::DeckRows));
            replace(&path, "GRID,90,,0.,0.,0.", "PARAM,B,2");
        } else {
            assert_eq!(found.expect("read").data.mesh, expected.data.mesh, "{new}");
        }
        assert_eq!(read(&path).expect("read").data.mesh, expected.data.mesh, "{new}");
    }
}

/// Equal GRID and CORD2R cards may be repeated; different cards of one number may not.
#[test]
fn the_same_card_may_stand_twice() {
    for (cards, is_well) in [
        (
            "GRID,11,,0.0,0.0,0.0\nCORD2R,5,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nCORD2R,5,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.0\n",
            true,
        ),
        ("GRID,11,,0.0,0.0,0.1\n", false),
        ("CORD2R,5,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nCORD2R,5,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n", false),
    ] {
        let (_folder, path) = copied("nastran_op4");
        replace(&path, "ENDDATA", &format!("{cards}ENDDATA"));
        assert_eq!(read(&path).is_ok(), is_well, "{cards}");
    }
}

/// Replication gives the cards that would be written out.
#[test]
fn replicated_cards_are_those_that_they_stand_for() {
    let grids =
        "GRID,35,,0.2,0.0,0.0\nGRID,41,,0.2,0.08,0.0\nGRID,38,,0.2,0.0,0.06\nGRID,44,,0.2,0.08,0.06\n";
    let (_folder, path) = copied("nastran_op4");
    let expected = read(&path).expect("read");
    for new in [
        "GRID,35,,0.2,0.0,0.0\n=,*(3),=,==\n=,*3,=,*(0.0),0.08,==\n=(1)\n",
        "GRID    35              0.2     0.0     0.0\n=       *(3)    =       =       =       0.06\n=       41      =       =       0.08    0.0\n=       44      =       ==\n",
    ] {
        let (_folder, path) = copied("nastran_op4");
        replace(&path, grids, new);
        let raw = read(&path).unwrap_or_else(|error| panic!("{new}{error}"));
        assert_eq!(raw.nodes.ids, expected.nodes.ids, "{new}");
        if new.contains("GRID    35") {
            let z = |raw: &RawModel, id: i64| {
                raw.nodes.positions[raw.nodes.ids.iter().position(|own| *own == id).expect("a node")]
            };
            assert_eq!([35, 38, 41].map(|id| z(&raw, id)), [35, 38, 41].map(|id| z(&expected, id)));
        }
    }
    for (new, part) in [
        ("=,*(1)\n", "continuations is not read"),
        ("=(0)\n", "number of repetitions"),
        ("CHEXA,9,1,11,23,29,17,14,26\n,32,20\n=,*(1),==\n", "continuations is not read"),
        ("GRID,90,,0.,0.,0.\n=,*(x),==\n", "not a number that can be incremented"),
    ] {
        let (_folder, path) = copied("nastran_op4");
        replace(&path, "ENDDATA", &format!("{new}ENDDATA"));
        let error = read(&path).expect_err(new);
        assert!(error.has(Code::DeckSyntax) && error.to_string().contains(part), "{new}{error}");
    }
}
