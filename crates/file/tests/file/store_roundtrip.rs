//! The file stores a body exactly: bits, order, names; equal bodies give equal bytes.

use oracle::file_bodies::{body, fingerprint, wild_body};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn what_is_written_is_read_bit_for_bit(
        seed in any::<u64>(), n in 1usize..12, modes in 1usize..20, schemes in 0usize..4, interfaces in 0usize..4,
    ) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("body.flex.h5");
        let written = wild_body(seed, n, modes.min(3 * n), schemes, interfaces);
        flexbody_file::write(&written, &path).unwrap();
        let read = flexbody_file::read(&path).unwrap_or_else(|e| panic!("{e}"));
        prop_assert_eq!(fingerprint(&read), fingerprint(&written));
        prop_assert_eq!(&read, &written);
        prop_assert_eq!(flexbody_file::validate(&path), vec![]);
    }
}

#[test]
fn equal_bodies_are_equal_bytes_whatever_the_time_and_the_path() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("elsewhere")).unwrap();
    let (a, b) = (folder.path().join("a.flex.h5"), folder.path().join("elsewhere/another-name.flex.h5"));
    let body = body(7, 9, 8, 3, 3);
    flexbody_file::write(&body, &a).unwrap();
    // Time stamps of HDF5 have a resolution of one second.
    std::thread::sleep(std::time::Duration::from_millis(1100));
    std::thread::scope(|s| s.spawn(|| flexbody_file::write(&body, &b).unwrap()).join().unwrap());
    assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap());
}

#[test]
fn a_body_read_and_written_again_is_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.flex.h5"), folder.path().join("b.flex.h5"));
    flexbody_file::write(&body(11, 5, 4, 2, 2), &a).unwrap();
    flexbody_file::write(&flexbody_file::read(&a).unwrap(), &b).unwrap();
    assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap());
}
