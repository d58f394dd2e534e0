//! Laws of the table, and what the table states about the changes of a body that crates below this one make.

use super::TABLE;
use crate::item::{Extent, Item, Origin};
use crate::value::{Value, View};
use flexbody_body::flex_body::{FlexBody, MotionLoad};
use oracle::file_bodies::body;

/// Files of earlier versions of a group stay readable.
#[test]
fn entries_newer_than_their_group_are_optional() {
    for group in TABLE {
        let mut newer = group.entries().filter(|item| item.since > group.since());
        assert!(newer.all(|item| !item.required), "{}", group.path);
    }
}

/// Calls `check` with the path and the values of every primary array of floats that both bodies have.
fn for_arrays(a: &FlexBody, b: &FlexBody, mut check: impl FnMut(&str, &Item, &View<'_>, [Vec<f64>; 2])) {
    for group in TABLE {
        let pairs = group.instances(a.parts()).into_iter().zip(group.instances(b.parts()));
        for ((_, of_a), (_, of_b)) in pairs {
            for item in group.entries().filter(|item| matches!(item.origin, Origin::Primary(_))) {
                if let (Some(Value::Floats(a)), Some(Value::Floats(b))) =
                    (item.value(&of_a), item.value(&of_b))
                {
                    check(&format!("{}/{}", group.path, item.name), item, &of_a, [a, b]);
                }
            }
        }
    }
}

/// Returns the elements of an array whose indices along the modes are those of `modes`.
fn selected(item: &Item, dims: &[usize], values: &[f64], modes: &[usize], nf: usize) -> Vec<f64> {
    let shape = item.shape().expect("an array");
    let is_kept = |&at: &usize| {
        let mut rest = at;
        shape.iter().zip(dims).rev().all(|(extent, size)| {
            let index = rest % size;
            rest /= size;
            match extent {
                Extent::Modes | Extent::ThreeModes | Extent::SixModes => modes.contains(&(index % nf)),
                _ => true,
            }
        })
    };
    (0..values.len()).filter(is_kept).map(|at| values[at]).collect()
}

/// Static columns of recoveries take the response of the modes that are dropped.
fn takes_dropped_modes(path: &str) -> bool {
    let mut of_motion = MotionLoad::ALL.iter().map(|load| format!("/recovery/<name>/{}", load.name()));
    ["spin", "named", "loads"].iter().any(|name| path == format!("/recovery/<name>/{name}"))
        || of_motion.any(|own| own == path)
}

#[test]
fn fewer_modes_are_those_of_every_extent_of_modes() {
    let modes = [0, 2, 3];
    let mut arrays = 0;
    for seed in 0..8 {
        // Random invariants have no bounds to which those of a lumped mass could be compared.
        let whole = body(seed, 3, 5, 0, 2);
        let some = whole.reduced(&modes, whole.groups(), Vec::new()).expect("three of five modes");
        for_arrays(&whole, &some, |path, item, view, [a, b]| {
            if !takes_dropped_modes(path) {
                assert_eq!(selected(item, &item.dims(view), &a, &modes, whole.n_modes()), b, "{path}");
                arrays += 1;
            }
        });
    }
    assert!(arrays > 200, "{arrays}");
}

#[test]
fn short_floats_are_those_of_large_arrays() {
    let mut arrays = 0;
    for seed in 0..8 {
        let whole = body(seed, 3, 5, 1, 2);
        let short = whole.rounded_to_f32().expect("moderate numbers");
        for_arrays(&whole, &short, |path, item, _, [a, b]| {
            #[allow(clippy::cast_possible_truncation)] // rounding is the purpose
            let rounded = |value: &f64| if item.large { f64::from(*value as f32) } else { *value };
            assert_eq!(a.iter().map(rounded).collect::<Vec<_>>(), b, "{path}");
            arrays += 1;
        });
    }
    assert!(arrays > 200, "{arrays}");
}
