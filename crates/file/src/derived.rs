//! Comparison of derived entries of a file with the values that follow from the body.

use super::extents::index;
use super::item::{DERIVED_TOLERANCE, Origin, Per, SHORT_TOLERANCE, SchemaGroup};
use super::names::place;
use super::scan::{Scan, key};
use super::schema::TABLE;
use super::value::{Value, View};
use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::Parts;

/// Adds a problem for every derived entry of the scanned file that contradicts `body`, which was assembled from the
/// primary entries.
pub(super) fn check_derived(scan: &mut Scan, body: &Parts) {
    for group in TABLE {
        let links: Vec<Option<String>> = match group.per {
            Per::Body => vec![None],
            _ => scan.instances(group.parent()).into_iter().map(|(_, link)| Some(link)).collect(),
        };
        for ((_, view), link) in group.instances(body).into_iter().zip(links) {
            check_group(scan, group, &place(group, link.as_deref()), &view);
        }
    }
}

fn check_group(scan: &mut Scan, group: &SchemaGroup, path: &str, view: &View<'_>) {
    for item in group.entries() {
        let Origin::Derived(get, scale) = item.origin else { continue };
        let name = key(path, item);
        let (Some(found), Some(expected)) = (scan.values.remove(&name), get(view)) else { continue };
        match (&found, &expected) {
            (Value::Floats(found), Value::Floats(expected)) => {
                let largest = match group.entries().find(|i| i.name == scale).and_then(|i| i.value(view)) {
                    Some(Value::Floats(values)) => values.iter().fold(0.0f64, |m, v| m.max(v.abs())),
                    _ => 0.0,
                };
                let tolerance =
                    if item.is_short(view.body.storage) { SHORT_TOLERANCE } else { DERIVED_TOLERANCE };
                let differs = |(a, b): (&f64, &f64)| (a - b).abs() > tolerance * largest;
                if let Some(i) = found.iter().zip(expected).position(differs) {
                    let at = index(i, &item.dims(view));
                    let (found, expected) = (found[i], expected[i]);
                    scan.add_as(
                        Code::BodyIdentity,
                        format!("{name}: found {found:e} at {at}, but the primary data give {expected:e}"),
                    );
                }
            }
            (Value::Int(a), Value::Int(b)) if a != b => scan.add(format!("{name}: expected {b}, found {a}")),
            (Value::Text(a), Value::Text(b)) if a != b => {
                scan.add(format!("{name}: expected `{b}`, found {a:?}"));
            }
            _ => {}
        }
    }
}
