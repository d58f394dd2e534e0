//! Versions of the format, and the version that the file of a body states.

use super::item::{EntrySet, SchemaGroup};
use flexbody_body::flex_body::Parts;

/// Major version of the format. Readers refuse a newer major version; a newer minor version only adds entries.
pub(super) const MAJOR: i64 = 1;
/// Minor version with all entries, see [`MAJOR`]. A file states the lowest version that has all entries which it holds
/// ([`least_minor`]).
pub(super) const MINOR: i64 = 13;
/// Minor version from which on every file has digests.
pub(super) const DIGESTS_SINCE: i64 = 4;
/// Minor version since which a group without members is left out. Files always have groups of earlier versions, so that
/// their bytes stay the same.
#[cfg(feature = "hdf5")]
pub(super) const EMPTY_GROUPS_LEFT_OUT_SINCE: i64 = 8;
/// Minor version since which files state the order of members ([`SchemaGroup::order`]).
const ORDER_SINCE: i64 = 12;

/// Returns the lowest minor version whose readers understand the file of `body`, at least the first one with digests.
pub(super) fn least_minor(table: &[SchemaGroup], body: &Parts) -> i64 {
    let is_needed = |minor: &i64| table.iter().any(|group| needs(table, group, body, *minor));
    (DIGESTS_SINCE + 1..=MINOR).rev().find(is_needed).unwrap_or(DIGESTS_SINCE)
}

/// Returns true if the file of `body` has an entry of `group` that the version `minor` added, lacks one that this version
/// made optional, or states an order of the members, which is an addition too.
fn needs(table: &[SchemaGroup], group: &SchemaGroup, body: &Parts, minor: i64) -> bool {
    let added = || group.entries().filter(|item| item.since == minor);
    let made_optional = || group.entries().filter_map(|item| Some((item, item.optional_member(minor)?)));
    if minor != ORDER_SINCE && added().next().is_none() && made_optional().next().is_none() {
        return false;
    }
    let instances = group.instances(body);
    let states_order = minor == ORDER_SINCE && group.order(&instances).is_some();
    states_order
        || instances.iter().any(|(_, view)| {
            added().any(|item| item.value(view).is_some())
                || made_optional().any(|(item, set)| item.value(view).is_none() && holds(table, set, body))
        })
}

/// Returns true if the file of `body` holds entries that `set` requires.
fn holds(table: &[SchemaGroup], set: &'static EntrySet, body: &Parts) -> bool {
    table.iter().any(|group| {
        let required = || group.entries().filter(|item| item.is_required_by(set));
        required().next().is_some()
            && group.instances(body).iter().any(|(_, view)| required().any(|item| item.value(view).is_some()))
    })
}
