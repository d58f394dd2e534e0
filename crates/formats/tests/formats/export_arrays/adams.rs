//! Format `adams-invariants`: the file is complete by its own conventions, in both dialects.

use flexbody_formats::export::{Points, frames};
use nalgebra::Matrix3;
use oracle::exported::{bodies, file};
use oracle::random::Random;
use serde_json::Value;

fn numbers(value: &Value, flat: &mut Vec<f64>) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| numbers(item, flat)),
        other => flat.push(other.as_f64().expect("a number")),
    }
}

/// Returns the values of a quantity and its extents; `None` if the body does not have this group.
fn quantity(document: &Value, name: &str) -> Option<(Vec<f64>, Vec<usize>)> {
    let all = document["quantities"].as_array().expect("a list");
    let one = all.iter().find(|one| one["name"] == name).expect("a quantity");
    let shape: Vec<usize> = serde_json::from_value(one["shape"].clone()).expect("extents");
    if one["values"].is_null() {
        return None;
    }
    let mut values = Vec::new();
    numbers(&one["values"], &mut values);
    assert_eq!(values.len(), shape.iter().product::<usize>(), "{name}");
    Some((values, shape))
}

/// Compares I7 - sum_j (I8_j + I8_j') q_j - sum_jk I9_jk q_j q_k with I0 + W1 Q + Q'W2 Q.
#[test]
fn the_inertia_of_a_deformed_body_follows_by_the_formula_of_the_file() {
    let mut random = Random(5);
    for (name, body) in bodies() {
        let document: Value = serde_json::from_slice(&file(body, "adams-invariants", None)).expect("JSON");
        let (invariants, nf) = (body.invariants(), body.n_modes());
        let size = invariants.inertia().norm().sqrt();
        let q: Vec<f64> = (0..nf).map(|_| size * random.signed()).collect();
        let (i7, _) = quantity(&document, "I7").expect("always there");
        let (i8, shape) = quantity(&document, "I8").expect("always there");
        assert_eq!(shape, [nf, 3, 3]);
        let i9 = quantity(&document, "I9");
        let (w1, w2) = (invariants.w1(), invariants.w2());
        assert_eq!((i9.is_some(), quantity(&document, "I5").is_some()), (body.groups().w2, body.groups().w3));
        let found = Matrix3::from_fn(|a, b| {
            let linear: f64 = (0..nf).map(|j| (i8[9 * j + 3 * a + b] + i8[9 * j + 3 * b + a]) * q[j]).sum();
            let pair = |(j, k): (usize, usize)| {
                i9.as_ref().map_or(0.0, |(i9, _)| i9[9 * (nf * j + k) + 3 * a + b]) * q[j] * q[k]
            };
            let pairs = (0..nf).flat_map(|j| (0..nf).map(move |k| (j, k)));
            i7[3 * a + b] - linear - pairs.map(pair).sum::<f64>()
        });
        let own = Matrix3::from_fn(|a, b| {
            let linear: f64 = w1.as_ref().map_or(0.0, |w1| (0..nf).map(|j| w1[(a, b * nf + j)] * q[j]).sum());
            let square: f64 = w2.as_ref().map_or(0.0, |w2| {
                (0..nf * nf).map(|p| w2[(a * nf + p / nf, b * nf + p % nf)] * q[p / nf] * q[p % nf]).sum()
            });
            invariants.inertia()[(a, b)] + linear + square
        });
        let scale = size * size * (1.0 + nf as f64).powi(2);
        assert!((found - own).amax() <= 1e-14 * scale, "{name}: {found} for {own}");
    }
}

#[test]
fn the_other_invariants_are_those_of_the_body_bit_by_bit() {
    for (name, body) in bodies() {
        let document: Value = serde_json::from_slice(&file(body, "adams-invariants", None)).expect("JSON");
        let (invariants, nf) = (body.invariants(), body.n_modes());
        let of = |quantity_name: &str| quantity(&document, quantity_name).expect("always there").0;
        let rows =
            |a: &faer::Mat<f64>| -> Vec<f64> { a.row_iter().flat_map(|row| row.iter().copied()).collect() };
        assert_eq!(of("I1"), [invariants.mass()], "{name}");
        assert_eq!(of("I2"), invariants.first_moment().as_slice(), "{name}");
        assert_eq!(of("I3"), rows(invariants.c1()), "{name}");
        assert_eq!(of("I4"), rows(&invariants.c2()), "{name}");
        assert_eq!(of("I6"), rows(&invariants.modal_mass()), "{name}");
        assert_eq!(of("K"), rows(invariants.modal_stiffness()), "{name}");
        if let (Some((i5, shape)), Some(w3)) = (quantity(&document, "I5"), invariants.w3()) {
            assert_eq!(shape, [nf, 3, nf]);
            let own = |p: usize| w3[(p / nf % 3 * nf + p / nf / 3, p % nf)];
            assert_eq!(i5, (0..3 * nf * nf).map(own).collect::<Vec<f64>>(), "{name}");
        }
        let damping = quantity(&document, "D").map(|(values, _)| values);
        assert_eq!(damping, body.modes().modal_damping.as_ref().map(rows), "{name}");
        let places = frames(body, &Points::Usual);
        let told = document["frames"].as_array().expect("a list");
        assert_eq!(told.len(), places.len());
        for (told, place) in told.iter().zip(&places) {
            assert_eq!(
                (told["node"].as_i64(), told["name"].as_str()),
                (Some(place.id), place.name.as_deref())
            );
            for (key, own) in
                [("translation", Some(&place.translation)), ("rotation", place.rotation.as_ref())]
            {
                let mut values = Vec::new();
                if !told[key].is_null() {
                    numbers(&told[key], &mut values);
                }
                assert_eq!(values, own.map(rows).unwrap_or_default(), "{name}, {key}");
            }
        }
    }
}

/// Asserts that a heading and rows of these numbers follow.
fn follows<'a>(lines: &mut impl Iterator<Item = &'a str>, heading: &str, columns: usize, values: &[f64]) {
    assert_eq!(lines.next(), Some(heading));
    for row in values.chunks(columns) {
        let line = lines.next().expect("a row");
        let found: Vec<f64> = line.split(' ').map(|v| v.parse().expect("a number")).collect();
        assert_eq!(found, row, "{heading}");
    }
}

/// Both dialects have the same numbers in the same order.
#[test]
fn the_text_says_what_the_json_says() {
    for (_, body) in bodies() {
        let document: Value =
            serde_json::from_slice(&file(body, "adams-invariants", Some("json"))).expect("JSON");
        let text = String::from_utf8(file(body, "adams-invariants", Some("text"))).expect("UTF-8");
        let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
        for one in document["quantities"].as_array().expect("a list") {
            let name = one["name"].as_str().expect("a name");
            match quantity(&document, name) {
                Some((values, shape)) => {
                    let extents: Vec<String> = shape.iter().map(ToString::to_string).collect();
                    let heading = format!("{name} {}", extents.join(" "));
                    follows(&mut lines, &heading, shape[shape.len() - 1], &values);
                }
                None => assert_eq!(lines.next(), Some(format!("{name} none").as_str())),
            }
        }
        for place in document["frames"].as_array().expect("a list") {
            let mut position = Vec::new();
            numbers(&place["position"], &mut position);
            let [x, y, z] = position[..] else { panic!("{position:?}") };
            assert_eq!(lines.next(), Some(format!("frame {} {x:e} {y:e} {z:e}", place["node"]).as_str()));
            for kind in ["translation", "rotation"].into_iter().filter(|kind| !place[kind].is_null()) {
                let mut values = Vec::new();
                numbers(&place[kind], &mut values);
                follows(&mut lines, &format!("{kind} 3 {}", body.n_modes()), body.n_modes(), &values);
            }
        }
        assert_eq!(lines.next(), None);
    }
}
