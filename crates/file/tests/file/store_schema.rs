//! The JSON schema describes the structure of every written file, and rejects others.

use oracle::file_bodies::{body, wild_body};
use serde_json::Value;

fn structure_of(body: &flexbody_body::flex_body::FlexBody) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(body, &path).unwrap();
    flexbody_file::structure(&path).unwrap()
}

fn validator() -> jsonschema::Validator {
    let schema: Value = serde_json::from_str(&flexbody_file::format_schema()).unwrap();
    jsonschema::draft202012::meta::validate(&schema).expect("the schema is a schema");
    jsonschema::validator_for(&schema).unwrap()
}

#[test]
fn written_files_follow_the_schema() {
    let validator = validator();
    for seed in 0..5 {
        for body in [body(seed, 5, 4, 2, 2), wild_body(seed, 1, 1, 0, 0)] {
            let structure = structure_of(&body);
            let errors: Vec<_> = validator.iter_errors(&structure).map(|e| e.to_string()).collect();
            assert!(errors.is_empty(), "{errors:#?}");
        }
    }
}

#[test]
fn constants_and_shapes_are_checked() {
    let validator = validator();
    let whole = structure_of(&body(1, 3, 2, 1, 1));
    for (pointer, value) in [
        ("/attributes/format", serde_json::json!("else")),
        ("/attributes/format_major", serde_json::json!(2)),
        ("/groups/terms/attributes/W3", serde_json::json!("dropped")),
        ("/groups/modes/datasets/shape/shape", serde_json::json!([2, 3, 2])),
        ("/groups/invariants/datasets/W1/shape", serde_json::json!([3, 7])),
        ("/groups/invariants/datasets/W1/type", serde_json::json!("float16")),
        ("/groups/invariants/datasets/C1/type", serde_json::json!("float32")),
        ("/groups/nodes/datasets/id/shape", serde_json::json!([0])),
    ] {
        let mut broken = whole.clone();
        *broken.pointer_mut(pointer).unwrap() = value;
        assert!(!validator.is_valid(&broken), "{pointer}");
    }
}

#[test]
fn groups_that_contain_themselves_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(&body(1, 3, 2, 1, 1), &path).unwrap();
    let file = hdf5_metno::File::open_rw(&path).unwrap();
    for i in 0..20 {
        file.link_hard("/terms", &format!("terms/again{i}")).unwrap();
    }
    file.close().unwrap();
    let error = flexbody_file::read(&path).unwrap_err();
    assert!(error.to_string().contains("not an entry of a flex-body file"), "{error}");
    let error = flexbody_file::structure(&path).unwrap_err();
    assert!(error.to_string().contains("more than 20000 members"), "{error}");
}
