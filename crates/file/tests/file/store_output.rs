//! Output files appear as a whole or not at all, and an unusable path is reported before the work.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::ExitCode;
use flexbody_base::output::OutputSlot;
use oracle::file_bodies::body;
use oracle::members;

#[test]
fn a_dropped_slot_leaves_nothing_and_keeps_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    drop(flexbody_file::prepare_output(&path).unwrap());
    assert!(members(folder.path()).is_empty());
    std::fs::write(&path, "old").unwrap();
    let slot = flexbody_file::prepare_output(&path).unwrap();
    std::fs::write(slot.temporary(), "half of the n").unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old", "replaced before the commit");
    drop(slot);
    assert_eq!(members(folder.path()), ["body.flex.h5"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
}

#[test]
fn a_commit_replaces_the_old_file_and_leaves_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    std::fs::write(&path, "old").unwrap();
    flexbody_file::write(&body(1, 3, 2, 0, 0), &path).unwrap();
    assert_eq!(members(folder.path()), ["body.flex.h5"]);
    assert_eq!(flexbody_file::read(&path).unwrap(), body(1, 3, 2, 0, 0));
    let report = folder.path().join("report.txt");
    OutputSlot::prepare(&report).unwrap().write(b"ten seconds").unwrap();
    assert_eq!(std::fs::read(&report).unwrap(), b"ten seconds");
    assert_eq!(members(folder.path()), ["body.flex.h5", "report.txt"]);
}

#[test]
fn a_shorter_text_leaves_nothing_of_what_the_slot_held() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.txt");
    let slot = OutputSlot::prepare(&path).unwrap();
    std::fs::write(slot.temporary(), "a long first attempt").unwrap();
    slot.write(b"short").unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"short");
}

#[test]
fn a_missing_folder_is_known_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let error = flexbody_file::prepare_output(folder.path().join("no/such/body.flex.h5")).unwrap_err();
    assert!(error.has(Code::OutputFolderMissing), "{error}");
    assert_eq!(error.exit_code(), ExitCode::BadInput);
    std::fs::write(folder.path().join("file"), "").unwrap();
    let error = flexbody_file::prepare_output(folder.path().join("file/body.flex.h5")).unwrap_err();
    assert!(error.has(Code::OutputFolderMissing) || error.has(Code::OutputUnwritable), "{error}");
}

#[test]
fn folders_and_empty_names_are_no_outputs() {
    let folder = tempfile::tempdir().unwrap();
    for path in [
        folder.path().to_path_buf(),
        "".into(),
        "/".into(),
        folder.path().join(".."),
        folder.path().join(""),
        folder.path().join("new/"),
    ] {
        let error = flexbody_file::prepare_output(&path).unwrap_err();
        assert!(error.has(Code::OutputNotFile), "{path:?}: {error}");
        assert_eq!(error.exit_code(), ExitCode::BadInput);
    }
    assert!(members(folder.path()).is_empty());
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn devices_are_not_replaced() {
        let error = flexbody_file::prepare_output("/dev/null").unwrap_err();
        assert!(error.has(Code::OutputNotFile), "{error}");
        assert!(error.to_string().contains("not a regular file"), "{error}");
    }

    #[test]
    fn write_protected_files_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("body.flex.h5");
        std::fs::write(&path, "reference").unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o444)).unwrap();
        let error = flexbody_file::prepare_output(&path).unwrap_err();
        assert!(error.has(Code::OutputForbidden), "{error}");
        assert_eq!(members(folder.path()), ["body.flex.h5"]);
    }

    #[test]
    fn a_link_stays_a_link_and_its_target_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("target.h5"), folder.path().join("link.h5"));
        std::fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        OutputSlot::prepare(&link).unwrap().write(b"new").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read(&target).unwrap(), b"new");
    }

    #[test]
    fn a_link_to_a_file_that_is_not_there_yet_makes_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("data")).unwrap();
        std::os::unix::fs::symlink("data/target.h5", at("first")).unwrap();
        std::os::unix::fs::symlink("first", at("second")).unwrap();
        OutputSlot::prepare(at("second")).unwrap().write(b"new").unwrap();
        assert_eq!(members(folder.path()), ["data", "first", "second"]);
        assert_eq!(members(&at("data")), ["target.h5"]);
        assert_eq!(std::fs::read(at("second")).unwrap(), b"new");
        std::os::unix::fs::symlink("no/such.h5", at("nowhere")).unwrap();
        let error = OutputSlot::prepare(at("nowhere")).unwrap_err();
        assert!(error.has(Code::OutputFolderMissing), "{error}");
        std::os::unix::fs::symlink("circle", at("circle")).unwrap();
        let error = OutputSlot::prepare(at("circle")).unwrap_err();
        assert!(error.has(Code::OutputNotFile) && error.to_string().contains("circle"), "{error}");
    }

    #[test]
    fn outputs_appear_together_or_what_was_there_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a"), "old a").unwrap();
        let slots: Vec<_> = ["a", "b", "c"].map(|name| OutputSlot::prepare(at(name)).unwrap()).into();
        for slot in &slots {
            slot.fill(b"new").unwrap();
        }
        // A folder, which no rename can replace, is in the place of the last file.
        std::fs::create_dir(at("c")).unwrap();
        assert!(OutputSlot::commit_all(slots).is_err());
        assert_eq!(members(folder.path()), ["a", "c"]);
        assert_eq!(std::fs::read_to_string(at("a")).unwrap(), "old a");
        let slots: Vec<_> = ["a", "b"].map(|name| OutputSlot::prepare(at(name)).unwrap()).into();
        OutputSlot::commit_all(slots).unwrap();
        assert_eq!(members(folder.path()), ["a", "b", "c"]);
        assert_eq!(std::fs::read_to_string(at("a")).unwrap(), "");
    }

    #[test]
    fn what_a_killed_process_left_goes_and_what_a_living_one_holds_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (held, left) =
            (folder.path().join(".flexbody-aaaaaa.tmp"), folder.path().join(".flexbody-bbbbbb.tmp"));
        for path in [&held, &left] {
            std::fs::write(path, "half").unwrap();
        }
        std::fs::write(folder.path().join("else.tmp"), "of somebody else").unwrap();
        let holder = std::fs::File::open(&held).unwrap();
        holder.lock().unwrap();
        drop(OutputSlot::prepare(folder.path().join("body.flex.h5")).unwrap());
        assert_eq!(members(folder.path()), [".flexbody-aaaaaa.tmp", "else.tmp"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_path_that_hdf5_cannot_take_is_written_and_read() {
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().unwrap();
        let odd = folder.path().join(std::ffi::OsStr::from_bytes(b"caf\xe9"));
        std::fs::create_dir(&odd).unwrap();
        let written = body(3, 4, 2, 1, 1);
        flexbody_file::write(&written, odd.join("body.flex.h5")).unwrap();
        assert_eq!(flexbody_file::read(odd.join("body.flex.h5")).unwrap(), written);
        OutputSlot::prepare(odd.join("report.txt")).unwrap().write(b"fine").unwrap();
        assert_eq!(members(&odd), ["body.flex.h5", "report.txt"]);
    }

    #[test]
    fn outputs_have_the_permissions_of_ordinary_files() {
        let folder = tempfile::tempdir().unwrap();
        let (ordinary, output) = (folder.path().join("ordinary"), folder.path().join("output"));
        std::fs::write(&ordinary, "").unwrap();
        OutputSlot::prepare(&output).unwrap().write(b"").unwrap();
        let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&output), mode(&ordinary));
    }
}

#[test]
fn a_lock_that_another_process_holds_does_not_keep_a_body_from_being_read() {
    // A child program inherits the lock of an open file, and holds it until it ends.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    let written = body(3, 4, 2, 1, 1);
    flexbody_file::write(&written, &path).unwrap();
    let locked = std::fs::File::open(&path).unwrap();
    locked.lock().unwrap();
    assert_eq!(flexbody_file::read(&path).unwrap(), written);
    assert_eq!(flexbody_file::validate(&path), vec![]);
}
