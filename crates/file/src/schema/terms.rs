//! The rows of `/terms`: decisions about the groups of the kinetic energy.

use super::super::item::Item;
use super::super::item::ItemKind::{Float, Int, Text};
use super::super::item::{EntrySet, both, put, written};
use super::super::value::{Stored, Value, View, text};
use super::{ONE, attribute};
use flexbody_body::flex_body::{TermDecision, TermGroup};

/// Text of a group that the body holds.
pub(in super::super) const KEPT: &str = "kept";
/// Text of a group that the body does not hold.
pub(in super::super) const DROPPED: &str = "dropped";

fn decision<'a>(view: &View<'a>, group: TermGroup) -> Option<&'a TermDecision> {
    view.body.terms.iter().find(|term| term.group == group)
}

fn held(view: &View<'_>, group: TermGroup) -> Option<Value> {
    text(if view.body.invariants.groups().has(group) { KEPT } else { DROPPED })
}

fn number(value: f64) -> Option<Value> {
    value.is_finite().then_some(Value::Float(value))
}

/// Sets of entries of the decision about each group: reason and tier are required, bounds and limits optional.
static DECISIONS: [EntrySet; 3] = [const { EntrySet { problem: reason_and_tier } }; 3];

fn reason_and_tier(entries: &[(String, bool)]) -> String {
    let first = entries.iter().find(|(_, there)| *there).map_or("", |(name, _)| name);
    format!("{first}: expected with {} and {}, one of which is missing", entries[0].0, entries[1].0)
}

/// Makes the rows of every group.
macro_rules! of_groups {
    ($($index:literal $group:ident $name:literal,)*) => {
        &[
            $(attribute(
                $name,
                Text,
                ONE,
                concat!(
                    "`kept`, or `dropped`: the body has no group ", $name,
                    " of the kinetic energy, and the file none of its datasets (files up to 1.2: always `kept`)"
                ),
                written(|v| held(v, TermGroup::$group)),
            ),)*
            attribute("reason", Text, ONE, "why", written(|v| {
                text(if v.body.terms.is_empty() {
                    "no scene was given: every term is kept"
                } else {
                    "every group that was decided about has its own"
                })
            })),
            $(
                attribute(concat!($name, "_reason"), Text, ONE, "reason of the decision; absent: no decision", both(
                    |v| decision(v, TermGroup::$group)?.reason.value(),
                    put!(|d, read| d.decision(TermGroup::$group).reason = Stored::take(read)?),
                ))
                .with(&DECISIONS[$index])
                .added(3),
                attribute(
                    concat!($name, "_tier"),
                    Int,
                    ONE,
                    "tier of the decision: 0 bounds from I0 and frequencies, 1 norms of the invariants, 2 a motion that was integrated",
                    both(
                        |v| Some(Value::Int(decision(v, TermGroup::$group)?.tier.into())),
                        |d, read| {
                            let number = usize::take(read)?;
                            let tier = u8::try_from(number);
                            d.decision(TermGroup::$group).tier =
                                tier.map_err(|_| format!("expected 0, 1 or 2, found {number}"))?;
                            Ok(())
                        },
                    ),
                )
                .with(&DECISIONS[$index])
                .added(3),
                attribute(
                    concat!($name, "_bound"),
                    Float,
                    ONE,
                    "largest error from dropping the group, in the quantity that the reason names; absent: not known",
                    both(
                        |v| number(decision(v, TermGroup::$group)?.bound),
                        put!(|d, read| d.decision(TermGroup::$group).bound = Stored::take(read)?),
                    ),
                )
                .beside(&DECISIONS[$index])
                .added(3),
                attribute(
                    concat!($name, "_limit"),
                    Float,
                    ONE,
                    "largest error that is allowed; absent: no limit",
                    both(
                        |v| number(decision(v, TermGroup::$group)?.limit),
                        put!(|d, read| d.decision(TermGroup::$group).limit = Stored::take(read)?),
                    ),
                )
                .beside(&DECISIONS[$index])
                .added(3),
            )*
        ]
    };
}

pub(super) const TERMS: &[Item] = of_groups![
    0 W1 "W1",
    1 W2 "W2",
    2 W3 "W3",
];
