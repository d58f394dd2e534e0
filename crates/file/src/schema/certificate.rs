//! The rows of `/certificate`, proofs about a body, and of `/terms`, decisions about the groups of the kinetic energy.

use super::super::item::Extent::{FixedInterfaceModes, Modes};
use super::super::item::ItemKind::{Float, Floats, Int, Text};
use super::super::item::{EntrySet, Item, both, field, put, written};
use super::super::units::{ONE, PER_TIME2};
use super::super::value::{Stored, Value, View, text};
use super::entry::{attribute, dataset};
use flexbody_body::flex_body::{TermDecision, TermGroup};

/// Entries that accuracy `certified` adds.
pub(super) static CERTIFIED: EntrySet =
    EntrySet { problem: |entries| missing(entries, "accuracy `certified`") };

/// Entries of a Craig-Bampton body.
pub(super) static CRAIG_BAMPTON: EntrySet =
    EntrySet { problem: |entries| missing(entries, "a Craig-Bampton body") };

/// Returns the message about the first missing entry.
fn missing(entries: &[(String, bool)], of: &str) -> String {
    let first = entries.iter().find(|(_, there)| !there).map_or("", |(name, _)| name);
    format!("{first}: expected with the other entries of {of}, found nothing")
}

/// Makes both directions of an optional entry of a Craig-Bampton body, which is ignored in files of other bodies.
macro_rules! beside_fixed_interface {
    ($field:ident) => {
        both(
            |v| v.fixed_interface()?.$field.value(),
            |d, read| {
                if let Some(own) = &mut d.body.certificate.fixed_interface {
                    own.$field = Stored::take(read)?;
                }
                Ok(())
            },
        )
    };
}

/// Makes both directions of an estimate of the free body, which a Craig-Bampton body in mean axes has.
macro_rules! estimate_of_free_body {
    ($field:ident) => {
        both(
            |v| v.fixed_interface()?.free.as_ref()?.$field.value(),
            put!(|d, read| d.free_estimate().$field = Stored::take(read)?),
        )
    };
}

/// Estimated eigenvalues of the free body, an entry of `/modes`. Files up to 1.10 have them for every Craig-Bampton body.
pub(super) const FREE_EIGENVALUE: Item = dataset(
    "free_eigenvalue",
    Floats(&[Modes]),
    PER_TIME2,
    "lambda~",
    "eigenvalues of the free body as estimated, upper bounds of them; Craig-Bampton bodies only, whose own are larger",
    estimate_of_free_body!(estimate),
)
.needed_before(11, &CRAIG_BAMPTON)
.added(4);

/// Lower bounds of the eigenvalues of the free body, an entry of `/modes` beside [`FREE_EIGENVALUE`].
pub(super) const FREE_EIGENVALUE_LOWER: Item = dataset(
    "free_eigenvalue_lower",
    Floats(&[Modes]),
    PER_TIME2,
    "lambda~-",
    "lower bounds of the eigenvalues of the free body, to rounding; 0: none; Craig-Bampton bodies only",
    estimate_of_free_body!(lower),
)
.needed_before(11, &CRAIG_BAMPTON)
.added(4);

pub(super) const CERTIFICATE: &[Item] = &[
    attribute(
        "proved",
        Int,
        ONE,
        "1: the inertia count proves that no mode is missing; 0: not proved",
        written(|v| Some(Value::Int(v.body.certificate.proved_modes.is_some().into()))),
    )
    .derived(""),
    attribute(
        "proved_modes",
        Int,
        ONE,
        "flexible modes below `shift` that the count proves; absent: not proved",
        field!(certificate.proved_modes),
    )
    .optional(),
    attribute("shift", Float, PER_TIME2, "shift sigma of the count", field!(certificate.shift)),
    attribute(
        "negative_pivots",
        Int,
        ONE,
        "negative pivots of K - sigma M: rigid and flexible modes below sigma; absent: not counted",
        field!(certificate.negative_pivots),
    )
    .optional(),
    attribute("rigid_modes", Int, ONE, "number of rigid modes", field!(certificate.rigid_modes)),
    attribute(
        "remark",
        Text,
        ONE,
        "reason why the proof is missing or limited; empty if it is neither",
        field!(certificate.remark),
    ),
    attribute(
        "rigid_noise",
        Float,
        ONE,
        "largest |lambda| of the exact rigid modes over the first flexible lambda: the input's noise floor",
        field!(certificate.rigid_noise),
    ),
    attribute(
        "rigid_residual",
        Float,
        ONE,
        "max |K R| / (|K| |R|) over the rows: digits of the stiffness matrix",
        field!(certificate.rigid_residual),
    ),
    attribute(
        "eigenvalue_rounding",
        Float,
        ONE,
        "bound of the rounding error of any entry of Psi' K Psi, relative to sqrt(lambda_p lambda_q); 0: not known",
        field!(certificate.eigenvalue_rounding),
    )
    .added(4),
    attribute(
        "inertia_rounding",
        Float,
        ONE,
        "error of the inertia data before this file, relative to their Cauchy-Schwarz bounds, from the digits of a file of another program; 0: the rounding of 64-bit floats",
        field!(certificate.inertia_rounding),
    )
    .added(4),
    attribute(
        "shift_below",
        Float,
        PER_TIME2,
        "shift sigma of a second count, between the rigid modes and the first flexible one; accuracy `certified` only",
        field!(guarantee: shift_below),
    )
    .with(&CERTIFIED)
    .added(1),
    attribute(
        "negative_pivots_below",
        Int,
        ONE,
        "negative pivots of K - shift_below M: the number of rigid modes; accuracy `certified` only",
        field!(guarantee: pivots_below),
    )
    .with(&CERTIFIED)
    .added(1),
    attribute(
        "fixed_interface_modes",
        Int,
        ONE,
        "fixed-interface modes of a Craig-Bampton body; 0: static condensation",
        field!(fixed_interface: modes),
    )
    .with(&CRAIG_BAMPTON)
    .added(4),
    attribute(
        "interface_motions",
        Int,
        ONE,
        "motions of the interfaces (constraint modes) of a Craig-Bampton body",
        field!(fixed_interface: interface_motions),
    )
    .with(&CRAIG_BAMPTON)
    .added(4),
    attribute(
        "fixed_interface_counted",
        Int,
        ONE,
        "fixed-interface modes below `fixed_interface_shift`: negative pivots of K - sigma M with the interfaces held; absent: not counted",
        beside_fixed_interface!(counted),
    )
    .added(4),
    attribute(
        "fixed_interface_shift",
        Float,
        PER_TIME2,
        "shift sigma of the count with the interfaces held",
        field!(fixed_interface: shift),
    )
    .with(&CRAIG_BAMPTON)
    .added(4),
    attribute(
        "fixed_interface_next",
        Float,
        PER_TIME2,
        "eigenvalue of the first fixed-interface mode that is left out; absent: not computed",
        beside_fixed_interface!(next),
    )
    .added(4),
    attribute(
        "fixed_interface_residual",
        Float,
        ONE,
        "largest residual of a fixed-interface mode, as those of `/modes/residual`; 0 without any",
        field!(fixed_interface: residual),
    )
    .with(&CRAIG_BAMPTON)
    .added(4),
    dataset(
        "fixed_interface_eigenvalue",
        Floats(&[FixedInterfaceModes]),
        PER_TIME2,
        "mu",
        "eigenvalues of the fixed-interface modes, ascending, of a Craig-Bampton body whose frame is on an interface; absent: `/interface_coordinates/stiffness` holds them, or they are not known",
        both(
            |v| Some(v.fixed_interface()?.eigenvalues.clone()).filter(|all| !all.is_empty())?.value(),
            put!(|d, read| d.fixed_interface().eigenvalues = Stored::take(read)?),
        ),
    )
    .beside(&CRAIG_BAMPTON)
    .added(11),
];

/// Makes one attribute per invariant, in the order of [`flexbody_body::invariants::DIGITS`].
macro_rules! digits {
    ($($index:literal $name:literal,)*) => {
        &[$(attribute(
            concat!("digits_", $name),
            Float,
            ONE,
            concat!(
                "guaranteed digits of `/invariants/", $name,
                "`: -log10 of the rounding of its worst entry, relative to the Cauchy-Schwarz bound; accuracy `certified` only"
            ),
            field!(guarantee: digits[$index]),
        )
        .with(&CERTIFIED)
        .added(1),)*]
    };
}

pub(super) const INVARIANT_DIGITS: &[Item] = digits![
    0 "mass",
    1 "first_moment",
    2 "second_moment",
    3 "C1",
    4 "Ibar",
    5 "S",
    6 "modal_stiffness",
    7 "I0",
    8 "W1",
    9 "W2",
    10 "W3",
    11 "C2",
    12 "modal_mass",
];

/// Text of a group that the body holds.
pub(crate) const KEPT: &str = "kept";
/// Text of a group that the body does not hold.
pub(crate) const DROPPED: &str = "dropped";

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

#[cfg(test)]
mod tests {
    use super::*;
    use flexbody_body::invariants::DIGITS;

    #[test]
    fn digits_are_named_as_their_invariants() {
        let names: Vec<_> = INVARIANT_DIGITS.iter().map(|i| i.name.trim_start_matches("digits_")).collect();
        assert_eq!(names, DIGITS);
        assert!(DIGITS.iter().all(|name| super::super::INVARIANTS.iter().any(|item| item.name == *name)));
    }
}
