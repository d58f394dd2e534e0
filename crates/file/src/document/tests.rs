//! The JSON schema misses an entry of a written file if the table requires the entry, and only then.

use super::format_schema;
use crate::item::ItemKind;
use crate::names;
use crate::per::Per;
use crate::schema::TABLE;
use serde_json::Value;

/// Returns the JSON pointer of a group in the structure of a file.
fn pointer(path: &str) -> String {
    let names = path.split('/').filter(|name| !name.is_empty());
    names.map(|name| format!("/groups/{}", name.replace('~', "~0").replace('/', "~1"))).collect()
}

#[test]
fn every_required_entry_is_missed_when_it_is_not_there() {
    let schema: Value = serde_json::from_str(&format_schema()).expect("JSON");
    let validator = jsonschema::validator_for(&schema).expect("a schema");
    // Certified bodies have every optional entry.
    let body = oracle::file_bodies::body(1, 3, 3, 1, 1);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    crate::write(&body, &path).expect("written");
    let whole = crate::structure(&path).expect("a structure");
    let mut removed = 0;
    let mut check = |parent: &str, key: &str, is_required: bool| {
        let mut broken = whole.clone();
        let members = broken.pointer_mut(parent).and_then(Value::as_object_mut);
        if members.is_some_and(|members| members.remove(key).is_some()) {
            assert_eq!(validator.is_valid(&broken), !is_required, "{parent} {key}");
            removed += 1;
        }
    };
    for group in TABLE {
        let (above, last) = group.path.rsplit_once('/').expect("a path from the root");
        if group.per != Per::Body {
            let (above, parent) = above.rsplit_once('/').expect("a path from the root");
            check(&format!("{}/groups", pointer(above)), parent, group.since() == 0);
            check(&format!("{}/groups/{parent}", pointer(above)), "groups", true);
        } else if !last.is_empty() {
            check(&format!("{}/groups", pointer(above)), last, group.since() == 0);
        }
        for (name, _) in group.instances(body.parts()) {
            let link = name.as_deref().map(names::encode);
            let place = pointer(&group.place(link.as_deref()));
            if let Some(link) = &link {
                check(&format!("{}/groups", pointer(above)), link, false);
            }
            for item in group.entries().filter(|item| item.kind != ItemKind::Named) {
                let section = if item.shape().is_some() { "datasets" } else { "attributes" };
                check(&format!("{place}/{section}"), item.name, item.required);
                for described in ["type", "shape", "units", "symbol", "description"] {
                    check(&format!("{place}/{section}/{}", item.name), described, true);
                }
            }
            for (section, of_datasets) in [("attributes", false), ("datasets", true)] {
                let is_described = group.entries().any(|item| item.shape().is_some() == of_datasets);
                check(&place, section, is_described);
            }
        }
    }
    assert!(removed > 400, "{removed}");
}
