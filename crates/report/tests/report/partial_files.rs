//! Files of bodies without some groups of the kinetic energy: they hold the terms of the body and state the
//! dropped groups.

use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::{FlexBody, TermGroup, TermGroups};
use flexbody_body::invariants::BodyFrame;
use flexbody_report::{Facts, Format, RunData, Tolerances, compare_common, dropped_text, render};
use hdf5_metno as hdf5;
use oracle::file_bodies::{fingerprint, wild_body};
use oracle::flexible::{body_of, fixture, soft_block};
use oracle::partial::{combinations, decisions, with_groups};
use oracle::plane::rectangle;
use proptest::prelude::*;
use serde_json::Value;

/// Returns solids, a general mass, and both in the plane.
fn bodies() -> [FlexBody; 4] {
    [
        soft_block(5),
        fixture("frame_beams", 5, BodyFrame::Model),
        body_of(rectangle(5, 2, 0.7, [1.0, 2.0]), 5, BodyFrame::Com),
        fixture("plane_frame", 5, BodyFrame::Principal),
    ]
}

fn written(body: &FlexBody) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(body, &path).expect("writes");
    (folder, path)
}

fn names(structure: &Value, group: &str) -> Vec<String> {
    let datasets = structure.pointer(&format!("/groups/{group}/datasets")).and_then(Value::as_object);
    datasets.expect("a group").keys().cloned().collect()
}

#[test]
fn every_combination_of_groups_is_read_as_it_was_written() {
    let schema: Value = serde_json::from_str(&flexbody_file::format_schema()).expect("JSON");
    let validator = jsonschema::validator_for(&schema).expect("a schema");
    for body in bodies() {
        for groups in combinations() {
            let partial = with_groups(&body, groups);
            let (folder, path) = written(&partial);
            assert_eq!(flexbody_file::read(&path).unwrap_or_else(|e| panic!("{groups:?}: {e}")), partial);
            let structure = flexbody_file::structure(&path).expect("a structure");
            let errors: Vec<_> = validator.iter_errors(&structure).map(|e| e.to_string()).collect();
            assert!(errors.is_empty(), "{groups:?}: {errors:#?}");
            for place in ["invariants", "lumped/groups/row-sum"] {
                let there = names(&structure, place);
                for (name, group) in [
                    ("Ibar", TermGroup::W1),
                    ("W1", TermGroup::W1),
                    ("S", TermGroup::W2),
                    ("W2", TermGroup::W2),
                    ("W3", TermGroup::W3),
                ] {
                    assert_eq!(
                        there.iter().any(|n| n == name),
                        groups.has(group),
                        "{groups:?}: {place}/{name}"
                    );
                }
                assert!(["C1", "C2", "I0", "modal_mass"].iter().all(|name| there.iter().any(|n| n == name)));
            }
            let again = folder.path().join("again.flex.h5");
            flexbody_file::write(&flexbody_file::read(&path).expect("read"), &again).expect("writes");
            assert!(std::fs::read(&path).expect("bytes") == std::fs::read(&again).expect("bytes"));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn any_numbers_are_read_bit_for_bit(
        seed in any::<u64>(), n in 1usize..6, modes in 1usize..8, bits in 0usize..8,
    ) {
        let groups = combinations().nth(bits).expect("one of eight");
        // The columns of recoveries take over what a dropped group leaves out: such sums of wild numbers overflow.
        let mut parts = wild_body(seed, n, modes.min(3 * n), 0, 1).into_parts();
        parts.recoveries.clear();
        let body = with_groups(&FlexBody::new(parts).expect("a body"), groups);
        let (_folder, path) = written(&body);
        let read = flexbody_file::read(&path).unwrap_or_else(|e| panic!("{e}"));
        prop_assert_eq!(fingerprint(&read), fingerprint(&body));
        prop_assert_eq!(&read, &body);
    }
}

#[test]
fn bounds_and_limits_that_are_not_known_are_absent() {
    let body = soft_block(3);
    let mut terms = decisions(TermGroups::NONE);
    (terms[0].bound, terms[0].limit, terms[1].tier) = (f64::INFINITY, f64::INFINITY, 2);
    terms.reverse(); // the body sorts them into the order of the groups
    let partial = body.reduced(&[0, 1, 2], TermGroups::NONE, terms).expect("a body");
    let (_folder, path) = written(&partial);
    let structure = flexbody_file::structure(&path).expect("a structure");
    let attributes = structure.pointer("/groups/terms/attributes").expect("attributes");
    assert_eq!(attributes["W1"], "dropped");
    assert_eq!((attributes.get("W1_bound"), attributes.get("W1_limit")), (None, None));
    assert_eq!((&attributes["W2_bound"], &attributes["W2_tier"]), (&Value::from(1e-4), &Value::from(2)));
    assert_eq!(flexbody_file::read(&path).expect("read"), partial);
}

/// Damages the file of a body without W1 and returns the message of the reader.
fn refused(body: &FlexBody, damage: impl FnOnce(&hdf5::File)) -> String {
    let (_folder, path) = written(body);
    let file = hdf5::File::open_rw(&path).expect("opens");
    damage(&file);
    file.close().expect("closes");
    let error = flexbody_file::read(&path).expect_err("the file contradicts itself");
    assert!(error.diagnostics().iter().all(|d| d.code() == Code::BodySchema), "{error}");
    error.to_string()
}

fn set_text(file: &hdf5::File, name: &str, value: &str) {
    let terms = file.group("terms").expect("a group");
    let text: hdf5::types::VarLenUnicode = value.parse().expect("text");
    terms.delete_attr(name).ok();
    terms
        .new_attr::<hdf5::types::VarLenUnicode>()
        .create(name)
        .expect("new")
        .write_scalar(&text)
        .expect("written");
}

#[test]
fn files_that_keep_what_is_not_there_or_drop_what_is_are_refused() {
    let body = soft_block(3);
    let partial = with_groups(&body, TermGroups { w1: false, ..TermGroups::ALL });
    let says = |error: String, text: &str| assert!(error.contains(text), "no {text:?} in\n{error}");
    let error = refused(&partial, |f| set_text(f, "W1", "kept"));
    says(error.clone(), "/invariants/W1: expected a dataset of 64-bit floats, found nothing");
    says(error, "/lumped/row-sum/Ibar: expected a dataset of 64-bit floats, found nothing");
    let error = refused(&partial, |f| set_text(f, "W3", "dropped"));
    says(error, "/invariants/W3: expected nothing, since /terms@W3 is `dropped`, found a dataset");
    let error = refused(&partial, |f| f.unlink("invariants/W2").expect("unlinked"));
    says(error, "/invariants/W2: expected a dataset of 64-bit floats, found nothing");
    let error = refused(&partial, |f| f.unlink("invariants/C2").expect("unlinked"));
    says(error, "/invariants/C2: expected a dataset of 64-bit floats, found nothing");
    let error = refused(&partial, |f| set_text(f, "W1", "perhaps"));
    says(error, "/terms@W1: expected `kept` or `dropped`, found \"perhaps\"");
    let attribute = |name: &'static str| {
        move |f: &hdf5::File| f.group("terms").expect("a group").delete_attr(name).expect("gone")
    };
    says(refused(&partial, attribute("W1")), "/terms@W1: expected a text attribute, found nothing");
    says(refused(&partial, attribute("W1_reason")), "/terms@W1_tier: expected with /terms@W1_reason");
    let error = refused(&partial, |f| {
        let tier = f.group("terms").expect("a group").attr("W1_tier").expect("a tier");
        tier.write_scalar(&300_i64).expect("written");
    });
    says(error, "/terms@W1_tier: expected 0, 1 or 2, found 300");
    // All entries of one decision are removed: no reason for dropping the group remains.
    let error = refused(&partial, |f| {
        ["W1_reason", "W1_tier", "W1_bound", "W1_limit"].into_iter().for_each(|name| attribute(name)(f));
    });
    says(error, "`invariants` does not hold W1, but no decision of `terms` drops it");
    // A group is declared as dropped and its datasets are removed, but not those of the lumped masses.
    let error = refused(&body, |f| {
        set_text(f, "W3", "dropped");
        f.unlink("invariants/W3").expect("unlinked");
    });
    says(error, "/lumped/row-sum/W3: expected nothing, since /terms@W3 is `dropped`, found a dataset");
}

#[test]
fn reports_say_what_was_dropped() {
    let body = soft_block(4);
    let partial = with_groups(&body, TermGroups { w2: true, ..TermGroups::NONE });
    let facts = Facts::new(&partial, &RunData::default());
    let text = render(&facts, Format::Text);
    assert!(text.contains("W1 dropped, error without it up to 0.0001, tolerance 0.001: a test"), "{text}");
    assert!(text.contains("W2 kept") && text.contains("W3 dropped"), "{text}");
    let json: Value = serde_json::from_str(&render(&facts, Format::Json)).expect("JSON");
    assert_eq!(
        (&json["terms"][0]["kept"], &json["terms"][1]["kept"]),
        (&Value::Bool(false), &Value::Bool(true))
    );
    let norms = json["lumped"][0]["error_norms"].as_object().expect("an object");
    assert!(!norms.keys().any(|name| name.starts_with("W1") || name.starts_with("W3")));
    let schema: Value =
        serde_json::from_str(include_str!("../../../../schemas/report.schema.json")).expect("JSON");
    let validator = jsonschema::validator_for(&schema).expect("a schema");
    assert!(
        validator.is_valid(&json),
        "{:?}",
        validator.iter_errors(&json).map(|e| e.to_string()).collect::<Vec<_>>()
    );
    let html = render(&facts, Format::Html);
    assert!(html.contains("W3 dropped"));
    // Without W2 the report does not claim that the centrifugal term softens no motion.
    let without =
        render(&Facts::new(&with_groups(&body, TermGroups::NONE), &RunData::default()), Format::Text);
    assert!(!without.contains("soften"), "{without}");
    assert_eq!(
        dropped_text(&partial),
        "note: W1 was dropped and is not checked\nnote: W3 was dropped and is not checked\n"
    );
}

#[test]
fn a_partial_body_compares_in_what_both_hold() {
    for body in bodies() {
        for groups in combinations() {
            let partial = with_groups(&body, groups);
            let comparison = compare_common(&body, &partial, &Tolerances::default()).expect("comparable");
            assert!(comparison.passed(), "{groups:?}: {}", comparison.text());
            for group in TermGroup::ALL {
                let note = format!("{} was dropped from the second body: it is not compared", group.name());
                assert_eq!(comparison.notes().contains(&note), !groups.has(group), "{groups:?}");
            }
            let row = |name: &str| comparison.rows().iter().any(|row| row.quantity == name);
            assert_eq!((row("Ibar (W1, C2)"), row("C2")), (groups.w1, !groups.w1));
            assert_eq!(row("S (W2, W3, m_ff)"), groups.w2);
        }
    }
    // Compared groups are reported if they differ.
    let body = soft_block(4);
    let groups = TermGroups { w3: true, ..TermGroups::NONE };
    let mut parts = with_groups(&body, groups).into_parts();
    for (l, m, sign) in [(0, 1, 1.0), (1, 0, -1.0)] {
        parts.invariants.primary_mut().s[l][m][(0, 1)] += sign * 1e-6;
        parts.invariants.primary_mut().s[l][m][(1, 0)] -= sign * 1e-6;
    }
    parts.lumped.clear();
    let changed = FlexBody::new(parts).expect("a body");
    let comparison = compare_common(&body, &changed, &Tolerances::default()).expect("comparable");
    let failed: Vec<_> = comparison.rows().iter().filter(|row| !row.passed).map(|row| row.quantity).collect();
    assert_eq!(failed, ["W3"]);
}
