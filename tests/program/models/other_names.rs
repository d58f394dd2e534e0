//! Jobs of Abaqus whose matrices have another name than the deck: `abaqus job=A input=B.inp`.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{ModelFiles, ModelSource, read_model};
use flexbody_model::RawModel;
use oracle::jobs::small;
use std::fs;
use std::path::Path;

fn read(path: &Path, matrices: Option<[&str; 2]>) -> Result<RawModel, Error> {
    let mut files = ModelFiles::from_job(path, None, Vec::new(), Some("m,kg,s")).expect("files");
    if let ModelSource::Job(job) = &mut files.source {
        job.matrices = matrices.map(|names| names.map(str::to_owned));
    }
    read_model(&files)
}

#[test]
fn the_only_pair_of_matrices_that_fits_the_deck_is_taken_and_of_several_the_named_one() {
    let own = small("abaqus");
    let expected = read(&own, None).expect("the job by its own name");
    let folder = tempfile::tempdir().expect("a folder");
    let place = |name: &str| folder.path().join(name);
    let copy = |from: &str, to: &str| fs::copy(own.with_file_name(from), place(to)).expect("copied");
    let deck = place("part.inp");
    copy("job.inp", "part.inp");
    assert!(read(&deck, None).expect_err("no matrices").has(Code::JobUnknown));
    copy("job_STIF1.mtx", "Run-1_STIF2.mtx");
    copy("job_MASS1.mtx", "Run-1_MASS2.mtx");
    // Another pair, of a smaller model.
    fs::write(place("small_STIF1.mtx"), "1 1 2.0\n2 2 2.0\n").expect("written");
    fs::write(place("small_MASS1.mtx"), "1 1 2.0\n2 2 2.0\n").expect("written");
    let found = read(&deck, None).expect("the pair that fits");
    assert_eq!((&found.stiffness.matrix, &found.dofs), (&expected.stiffness.matrix, &expected.dofs));
    let note = found.diagnostics.iter().find(|note| note.code() == Code::JobStep).expect("a note");
    assert!(note.message().contains("Run-1_STIF2.mtx and Run-1_MASS2.mtx"), "{note}");

    copy("job_STIF1.mtx", "Run-2_STIF1.mtx");
    copy("job_MASS1.mtx", "Run-2_MASS1.mtx");
    let refused = read(&deck, None).expect_err("two pairs").to_string();
    assert!(
        ["FB111", "Run-1_STIF2.mtx and", "Run-2_STIF1.mtx and"].iter().all(|part| refused.contains(part)),
        "{refused}"
    );
    for names in [["Run-2_STIF1.mtx", "Run-2_MASS1.mtx"], ["Run-2_STIF1", "Run-2_MASS1"]] {
        let named = read(&deck, Some(names)).expect("the named pair");
        assert_eq!(named.mass.matrix, expected.mass.matrix);
    }
    let absent =
        read(&deck, Some(["Run-3_STIF1.mtx", "Run-2_MASS1.mtx"])).expect_err("no such file").to_string();
    assert!(absent.contains("FB109") && absent.contains("Run-3_STIF1.mtx"), "{absent}");

    // Matrices with the name of another deck are those of that deck.
    copy("job.inp", "run-1.inp");
    let found = read(&deck, None).expect("the pair without a deck of its own");
    let note = found.diagnostics.iter().find(|note| note.code() == Code::JobStep).expect("a note");
    assert!(note.message().contains("Run-2_STIF1.mtx"), "{note}");
}
