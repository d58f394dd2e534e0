//! What was proved about a body: the rows of `/certificate`.

use super::super::item::Item;
use super::super::item::ItemKind::{Float, Int, Text};
use super::super::value::{Value, View, count, text};
use super::{ONE, PER_TIME2, attribute};
use flexbody_body::flex_body::{FixedInterface, Guarantee};

pub(super) const CERTIFICATE: &[Item] = &[
    attribute(
        "proved",
        Int,
        ONE,
        "1: the inertia count proves that no mode is missing; 0: not proved",
        |v| Some(Value::Int(v.body.certificate.proved_modes.is_some().into())),
    )
    .derived(""),
    attribute(
        "proved_modes",
        Int,
        ONE,
        "flexible modes below `shift` that the count proves; absent: not proved",
        |v| v.body.certificate.proved_modes.and_then(count),
    )
    .optional(),
    attribute("shift", Float, PER_TIME2, "shift sigma of the count", |v| {
        Some(Value::Float(v.body.certificate.shift))
    }),
    attribute(
        "negative_pivots",
        Int,
        ONE,
        "negative pivots of K - sigma M: rigid and flexible modes below sigma; absent: not counted",
        |v| v.body.certificate.negative_pivots.and_then(count),
    )
    .optional(),
    attribute("rigid_modes", Int, ONE, "number of rigid modes", |v| count(v.body.certificate.rigid_modes)),
    attribute(
        "remark",
        Text,
        ONE,
        "why the proof is missing or what limits it; empty when nothing does",
        |v| text(v.body.certificate.remark.as_str()),
    ),
    attribute(
        "rigid_noise",
        Float,
        ONE,
        "largest |lambda| of the exact rigid modes over the first flexible lambda: the input's noise floor",
        |v| Some(Value::Float(v.body.certificate.rigid_noise)),
    ),
    attribute(
        "rigid_residual",
        Float,
        ONE,
        "max |K R| / (|K| |R|) over the rows: digits of the stiffness matrix",
        |v| Some(Value::Float(v.body.certificate.rigid_residual)),
    ),
    attribute(
        "eigenvalue_rounding",
        Float,
        ONE,
        "what rounding of products with K may leave in any entry of Psi' K Psi, relative to sqrt(lambda_p lambda_q); 0: not known",
        |v| Some(Value::Float(v.body.certificate.eigenvalue_rounding)),
    )
    .added(4),
    attribute(
        "inertia_rounding",
        Float,
        ONE,
        "to what part of their Cauchy-Schwarz bounds the inertia data were known before this file: the digits of a file of another program; 0: to the rounding of 64-bit floats",
        |v| Some(Value::Float(v.body.certificate.inertia_rounding)),
    )
    .added(4),
    attribute(
        "shift_below",
        Float,
        PER_TIME2,
        "shift sigma of a second count, between the rigid modes and the first flexible one; accuracy `certified` only",
        |v| Some(Value::Float(guarantee(v)?.shift_below)),
    )
    .added(1),
    attribute(
        "negative_pivots_below",
        Int,
        ONE,
        "negative pivots of K - shift_below M: the number of rigid modes; accuracy `certified` only",
        |v| count(guarantee(v)?.pivots_below),
    )
    .added(1),
    attribute(
        "fixed_interface_modes",
        Int,
        ONE,
        "fixed-interface modes of a Craig-Bampton body; 0: static condensation",
        |v| count(fixed_interface(v)?.modes),
    )
    .added(4),
    attribute(
        "interface_motions",
        Int,
        ONE,
        "motions of the interfaces (constraint modes) of a Craig-Bampton body",
        |v| count(fixed_interface(v)?.interface_motions),
    )
    .added(4),
    attribute(
        "fixed_interface_counted",
        Int,
        ONE,
        "fixed-interface modes below `fixed_interface_shift`: negative pivots of K - sigma M with the interfaces held; absent: not counted",
        |v| fixed_interface(v)?.counted.and_then(count),
    )
    .added(4),
    attribute(
        "fixed_interface_shift",
        Float,
        PER_TIME2,
        "shift sigma of the count with the interfaces held",
        |v| Some(Value::Float(fixed_interface(v)?.shift)),
    )
    .added(4),
    attribute(
        "fixed_interface_next",
        Float,
        PER_TIME2,
        "eigenvalue of the first fixed-interface mode that is left out; absent: not computed",
        |v| Some(Value::Float(fixed_interface(v)?.next?)),
    )
    .added(4),
    attribute(
        "fixed_interface_residual",
        Float,
        ONE,
        "largest residual of a fixed-interface mode, as those of `/modes/residual`; 0 without any",
        |v| Some(Value::Float(fixed_interface(v)?.residual)),
    )
    .added(4),
];

pub(super) fn fixed_interface<'a>(view: &View<'a>) -> Option<&'a FixedInterface> {
    view.body.certificate.fixed_interface.as_ref()
}

pub(super) fn guarantee<'a>(view: &View<'a>) -> Option<&'a Guarantee> {
    view.body.certificate.guarantee.as_ref()
}

/// One attribute per invariant, in the order of [`flexbody_body::invariants::DIGITS`].
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
            |v| Some(Value::Float(guarantee(v)?.digits[$index])),
        )
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
