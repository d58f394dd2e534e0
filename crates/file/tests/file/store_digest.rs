//! A flex-body file that was changed after it was written is refused with the names of the changed entries;
//! the HDF5 layout does not matter.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::FlexBody;
use hdf5::types::{FixedUnicode, VarLenUnicode};
use hdf5_metno as hdf5;
use oracle::file_bodies::{age, body, fingerprint, seal};
use std::path::PathBuf;

struct Case {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

/// Returns a body with 4 nodes, 3 modes with damping, one lumping scheme, one interface.
fn sample() -> FlexBody {
    let mut parts = body(5, 4, 3, 1, 1).into_parts();
    parts.modes.modal_damping = Some(Mat::identity(3, 3));
    FlexBody::new(parts).unwrap()
}

fn valid() -> Case {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(&sample(), &path).unwrap();
    Case { _folder: folder, path }
}

/// Returns the file after `change`.
fn changed(change: impl FnOnce(&hdf5::File)) -> Case {
    let case = valid();
    let file = hdf5::File::open_rw(&case.path).unwrap();
    change(&file);
    file.close().unwrap();
    case
}

/// Returns the error for the changed contents.
fn refusal(change: impl FnOnce(&hdf5::File)) -> String {
    let error = flexbody_file::read(changed(change).path).expect_err("the file was changed");
    assert_eq!(error.diagnostics().len(), 1, "{error}");
    assert_eq!(error.diagnostics()[0].code(), Code::BodyChanged, "{error}");
    error.diagnostics()[0].message().to_owned()
}

fn scale(file: &hdf5::File, path: &str, factor: f64) {
    let dataset = file.dataset(path).unwrap();
    let values: Vec<f64> = dataset.read_raw().unwrap();
    dataset.write_raw(&values.iter().map(|v| v * factor).collect::<Vec<_>>()).unwrap();
}

fn put(place: &hdf5::Location, name: &str, value: &str) {
    let value: VarLenUnicode = value.parse().unwrap();
    place.new_attr::<VarLenUnicode>().create(name).unwrap().write_scalar(&value).unwrap();
}

#[test]
fn numbers_that_were_changed_are_named() {
    for path in ["/invariants/mass", "/modes/damping_ratio", "/modes/residual", "/frame/origin"] {
        let said = refusal(|f| scale(f, path, 1.5));
        assert!(said.ends_with(&format!("changed: {path}")), "{said}");
    }
    let said = refusal(|f| {
        scale(f, "/invariants/mass", 1.5);
        scale(f, "/modes/damping_ratio", 0.5);
    });
    assert!(said.ends_with("changed: /invariants/mass, /modes/damping_ratio"), "{said}");
}

#[test]
fn one_bit_of_one_number_is_a_change() {
    let said = refusal(|f| {
        let dataset = f.dataset("/modes/residual").unwrap();
        let mut values: Vec<f64> = dataset.read_raw().unwrap();
        values[1] = f64::from_bits(values[1].to_bits() ^ 1);
        dataset.write_raw(&values).unwrap();
    });
    assert!(said.ends_with("changed: /modes/residual"), "{said}");
}

#[test]
fn attributes_additions_and_removals_are_named() {
    let said = refusal(|f| {
        let place = f.dataset("/invariants/mass").unwrap();
        place.delete_attr("description").unwrap();
        put(&place, "description", "something else");
    });
    assert!(said.ends_with("changed: /invariants/mass"), "{said}");
    let said = refusal(|f| put(&f.group("/source").unwrap(), "remark", "mine"));
    assert!(said.ends_with("changed: /source"), "{said}");
    let said = refusal(|f| {
        f.new_dataset::<f64>().shape([2]).create("more").unwrap().write_raw(&[1.0, 2.0]).unwrap();
    });
    assert!(said.ends_with("added: /more"), "{said}");
    let said = refusal(|f| {
        f.create_group("extra").unwrap();
        f.group("/certificate").unwrap().attr("shift").unwrap().write_scalar(&1.0).unwrap();
    });
    assert!(said.ends_with("changed: /certificate; added: /extra"), "{said}");
    // An optional entry is removed.
    let said = refusal(|f| f.unlink("/invariants/modal_damping").unwrap());
    assert!(said.ends_with("removed: /invariants/modal_damping"), "{said}");
    let said = refusal(|f| f.link_soft("/modes/shape", "/shape").unwrap());
    assert!(said.contains("/shape: not an entry of a flex-body file"), "{said}");
}

#[test]
fn the_digests_themselves_are_held_to_each_other() {
    let other = "0".repeat(64);
    let said = refusal(|f| {
        f.delete_attr("sha256").unwrap();
        put(f, "sha256", &other);
    });
    assert!(said.contains("/@digests does not have the SHA-256"), "{said}");
    let said = refusal(|f| f.delete_attr("sha256").unwrap());
    assert!(said.contains("were removed"), "{said}");
}

/// Computes the digests by following the documentation.
#[test]
fn digests_are_those_of_the_documentation() {
    let case = valid();
    let stated = |f: &hdf5::File| {
        ["digests", "sha256"]
            .map(|name| f.attr(name).unwrap().read_scalar::<VarLenUnicode>().unwrap().to_string())
    };
    let file = hdf5::File::open_rw(&case.path).unwrap();
    let before = stated(&file);
    assert!(before[0].contains("  /\n") && before[0].contains("  /invariants/W1\n"), "{}", before[0]);
    seal(&file);
    assert_eq!(stated(&file), before);
}

/// A program that changes a file on purpose states new digests.
#[test]
fn a_file_that_was_changed_and_sealed_is_read() {
    let case = changed(|f| {
        scale(f, "/modes/damping_ratio", 0.5);
        f.create_group("stress").unwrap();
        f.new_dataset::<i32>().shape([2]).create("stress/first").unwrap().write_raw(&[1, 2]).unwrap();
        seal(f);
    });
    let read = flexbody_file::read(case.path).expect("its digests are its own");
    assert_eq!(read.modes().damping_ratio[1], 0.5 * sample().modes().damping_ratio[1]);
}

/// Another layout of the same contents: chunks, compression, order, fixed texts.
#[test]
fn the_layout_of_the_file_does_not_matter() {
    let case = changed(|f| {
        let old = f.dataset("/invariants/S").unwrap();
        let (values, shape): (Vec<f64>, _) = (old.read_raw().unwrap(), old.shape());
        let texts = ["description", "symbol", "units"]
            .map(|name| (name, old.attr(name).unwrap().read_scalar::<VarLenUnicode>().unwrap()));
        f.unlink("/invariants/S").unwrap();
        let chunk: Vec<usize> = shape.iter().map(|_| 1).collect();
        let new = f.new_dataset::<f64>().chunk(chunk).shuffle().deflate(9).shape(shape);
        let new = new.create("/invariants/S").unwrap();
        new.write_raw(&values).unwrap();
        for (name, text) in texts {
            let fixed: FixedUnicode<400> = text.as_str().parse().unwrap();
            new.new_attr::<FixedUnicode<400>>().create(name).unwrap().write_scalar(&fixed).unwrap();
        }
        // A recreated integer attribute comes after the others.
        let value: i64 = f.attr("dimension").unwrap().read_scalar().unwrap();
        f.delete_attr("dimension").unwrap();
        f.new_attr::<i64>().create("dimension").unwrap().write_scalar(&value).unwrap();
    });
    let read = flexbody_file::read(&case.path).expect("the content is the same");
    assert_eq!(fingerprint(&read), fingerprint(&sample()));
}

#[test]
fn a_file_without_digests_that_states_an_older_version_than_its_entries_is_refused() {
    let message = refusal(|f| {
        f.delete_attr("sha256").unwrap();
        f.delete_attr("digests").unwrap();
        f.attr("format_minor").unwrap().write_scalar(&3i64).unwrap();
    });
    assert!(message.contains("states version 1.3 and has no digests, but holds"), "{message}");
}

#[test]
fn the_order_of_interfaces_is_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    let mut parts = body(5, 4, 3, 1, 2).into_parts();
    parts.interfaces[0].name = "zbase".to_owned();
    parts.interfaces[1].name = "arm".to_owned();
    let body = FlexBody::new(parts).unwrap();
    flexbody_file::write(&body, &path).unwrap();
    let names = |body: &FlexBody| -> Vec<String> {
        body.interfaces().iter().map(|interface| interface.name.clone()).collect()
    };
    // A copy by a tool that does not track the order of members lists them by name.
    let file = hdf5::File::open_rw(&path).unwrap();
    let group = file.group("interfaces").unwrap();
    group.relink("zbase", "kept").unwrap();
    group.relink("kept", "zbase").unwrap();
    drop(group);
    file.close().unwrap();
    assert_eq!(names(&flexbody_file::read(&path).unwrap()), names(&body));
    // The attribute has the digest of its group.
    let file = hdf5::File::open_rw(&path).unwrap();
    let group = file.group("interfaces").unwrap();
    group.delete_attr("order").unwrap();
    put(&group, "order", "[\"arm\",\"zbase\"]");
    drop(group);
    file.close().unwrap();
    let error = flexbody_file::read(&path).expect_err("another order");
    assert!(error.has(Code::BodyChanged), "{error}");
}

#[test]
fn files_of_older_versions_are_read_with_a_note() {
    let case = valid();
    age(&case.path, 3, || {
        let error = flexbody_file::read(&case.path).err()?;
        Some(error.diagnostics()[0].message().to_owned())
    });
    let (body, notes) = flexbody_file::read_with_notes(&case.path).expect("an older file");
    assert_eq!((body.certificate().eigenvalue_rounding, body.certificate().inertia_rounding), (0.0, 0.0));
    assert_eq!(notes.iter().map(|note| note.code()).collect::<Vec<_>>(), [Code::BodyWithoutDigest]);
    assert!(notes[0].message().contains("1.3"), "{}", notes[0].message());
    let (_, notes) = flexbody_file::read_with_notes(valid().path).expect("a new file");
    assert!(notes.is_empty());
}
