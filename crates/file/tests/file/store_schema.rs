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
fn every_required_entry_is_missed_when_it_is_not_there() {
    let validator = validator();
    let whole = structure_of(&body(1, 3, 3, 1, 1)); // certified bodies have every optional entry
    let mut removed = 0;
    for pointer in pointers(&whole) {
        let mut broken = whole.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let key = key.replace("~1", "/").replace("~0", "~");
        broken.pointer_mut(parent).unwrap().as_object_mut().unwrap().remove(&key);
        let optional = ["comparison", "lumped", "interfaces", "geometric_stiffness", "rotated_stiffness", "inertia_stiffness", "recovery", "named_loads"]
            .iter()
            .any(|g| parent == format!("/groups/{g}/groups"))
            || ["geometric_stiffness", "rotated_stiffness", "inertia_stiffness", "interface", "recovery"].contains(&key.as_str())
            || key.starts_with("rotational_")
            || (parent.starts_with("/groups/comparison/groups/") && parent.ends_with("/attributes"))
            || ["proved_modes", "negative_pivots", "shift_below", "negative_pivots_below"]
                .contains(&key.as_str())
            || ["eigenvalue_lower", "eigenvalue_upper", "shape_error", "provenance", "truncation"]
                .contains(&key.as_str())
            || ["body_number", "bodies", "modal_damping"].contains(&key.as_str())
            || ["rotation", "internal", "internal_dof", "W0", "approximation"].contains(&key.as_str())
            || ["reference_conditions", "digests", "sha256", "eigenvalue_rounding", "inertia_rounding"]
                .contains(&key.as_str())
            || key.starts_with("fixed_interface_")
            || ["interface_motions", "free_eigenvalue", "free_eigenvalue_lower"].contains(&key.as_str())
            || ["coupling", "reference"].contains(&key.as_str())
            || ["translation", "rotation", "misfit", "interface_coordinates"].contains(&key.as_str())
            || ["datasets", "attributes"]
                .iter()
                .any(|s| parent == format!("/groups/interface_coordinates/{s}"))
            || ["loaded_interfaces", "loads", "named_loads", "named", "compliance"].contains(&key.as_str())
            || parent.starts_with("/groups/recovery/")
                && ["damping", "acceleration", "turning", "centrifugal"].contains(&key.as_str())
            || key.starts_with("digits_")
            || pointer == "/groups/named_loads/attributes"
            || pointer == "/groups/recovery/attributes"
            || key == "order"
            || ["mesh", "triangles", "edges"].contains(&key.as_str())
            // All attributes of the frame are optional, but the section of a group with attributes is always
            // present.
            || pointer != "/groups/frame/attributes" && whole.pointer(&pointer) == Some(&serde_json::json!({}));
        assert_eq!(validator.is_valid(&broken), optional, "{pointer}");
        removed += 1;
    }
    assert!(removed > 100);
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

/// Returns JSON pointers of all members of all objects.
fn pointers(value: &Value) -> Vec<String> {
    let Value::Object(map) = value else { return Vec::new() };
    let mut out = Vec::new();
    for (key, member) in map {
        let head = format!("/{}", key.replace('~', "~0").replace('/', "~1"));
        out.push(head.clone());
        out.extend(pointers(member).into_iter().map(|tail| format!("{head}{tail}")));
    }
    out
}
