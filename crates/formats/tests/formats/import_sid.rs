//! SID_FEM text of other writers: every defect gives its own finding and no other, and no file makes the
//! reader panic.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_base::provenance::SourceFile;
use flexbody_base::text::InputFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::invariants::BodyFrame;
use flexbody_formats::export::{ExportOptions, Points};
use flexbody_formats::import::{ImportFormat, ImportedFile, audit, import_body};
use flexbody_formats::{export, find_format};
use flexbody_formats::{find_import_format, recognise};
use flexbody_model::LoadKind;
use oracle::flexible::{fixture, stressed};
use oracle::random::Random;
use proptest::prelude::*;
use std::path::Path;
use std::sync::LazyLock;

/// A solid with three modes and a few frames, in every dialect.
static FILES: LazyLock<Vec<(&str, String)>> = LazyLock::new(|| {
    let body = fixture("bracket_hex20", 3, BodyFrame::Model);
    let points = Points::Some(body.nodes().ids.iter().step_by(97).copied().collect());
    let sid = find_format("sid").expect("a format");
    let write = |name: &&'static str| {
        let options = ExportOptions {
            dialect: Some((*name).to_owned()),
            points: points.clone(),
            ..ExportOptions::default()
        };
        let (exported, told) = export(&body, sid, &options, false).expect("nothing is lost");
        assert!(told.iter().all(|told| told.code() == Code::ExportNeeds));
        (*name, String::from_utf8(exported.file).expect("text"))
    };
    sid.dialects().iter().map(write).collect()
});

fn file(dialect: &str) -> &'static str {
    &FILES.iter().find(|(name, _)| *name == dialect).expect("a dialect").1
}

fn reader() -> &'static dyn ImportFormat {
    find_import_format("sid").expect("a format")
}

fn try_read(bytes: &[u8]) -> Result<ImportedFile, Error> {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("body.SID_FEM");
    std::fs::write(&path, bytes).expect("writes");
    reader().read(&InputFile::open(&path).map_err(Error::from)?)
}

fn read(text: &str) -> ImportedFile {
    try_read(text.as_bytes()).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns findings in the form `CODE check`.
fn findings(imported: &ImportedFile) -> Vec<String> {
    let failed = imported.checks.iter().filter(|check| !check.passed());
    failed.map(|check| format!("{} {}", check.code.id(), check.name)).collect()
}

/// Returns the file with every entry of its objects replaced by `change`, which takes object, key without
/// blanks, and value; `None` removes the entry.
fn edited(text: &str, change: impl Fn(&str, &str, &str) -> Option<(String, String)>) -> String {
    let mut inside: Vec<&str> = Vec::new();
    let mut out = String::new();
    for line in text.lines() {
        let words = line.trim();
        let kept = match line.split_once('=') {
            Some((key, value)) => {
                if words.starts_with("new node") {
                    inside.push("node");
                }
                let compact: String = key.split_whitespace().collect();
                let object = inside.last().copied().unwrap_or("");
                change(object, &compact, value.trim()).map(|(new, value)| {
                    let key = if new == compact { key } else { &new };
                    format!("{key} = {value}")
                })
            }
            None => {
                if words.starts_with("end") {
                    inside.pop();
                } else if !words.contains(':') {
                    inside.push(words);
                }
                Some(line.to_owned())
            }
        };
        if let Some(line) = kept {
            out.push_str(&line);
            out.push('\n');
        }
    }
    out
}

fn same(key: &str, value: &str) -> Option<(String, String)> {
    Some((key.to_owned(), value.to_owned()))
}

/// Returns the indices of `m0(1,2)` or `m1(1,2,3)`.
fn indices(key: &str) -> Vec<usize> {
    let inner = key[3..].trim_end_matches(')');
    inner.split(',').map(|i| i.parse().expect("an index")).collect()
}

fn value(text: &str) -> f64 {
    text.replace('D', "e").parse().expect("a number")
}

fn scaled(key: &str, text: &str, factor: f64) -> Option<(String, String)> {
    Some((key.to_owned(), format!("{:.16e}", factor * value(text))))
}

#[test]
fn sound_files_have_no_findings_and_name_their_dialect() {
    for (name, text) in FILES.iter() {
        let imported = read(text);
        assert_eq!(findings(&imported), Vec::<String>::new(), "{name}");
        assert_eq!(imported.dialect, *name);
        assert!(imported.checks.len() >= 15, "{name}: {}", imported.checks.len());
        assert!(imported.body.omissions.is_empty());
    }
}

#[test]
fn the_numbers_alone_tell_the_dialect() {
    // The name of the writer is removed from the first line.
    let anonymous = |text: &str| text.replacen("flexbody", "someone", 1);
    for (name, text) in FILES.iter() {
        let imported = read(&anonymous(text));
        assert_eq!(imported.dialect, *name);
        assert_eq!(findings(&imported), Vec::<String>::new(), "{name}");
    }
}

/// Files with both arrays ordered by modes had the dialect name mode-blocked earlier; their m1 has the mode
/// in the middle.
#[test]
fn files_by_modes_are_embs_also_under_the_earlier_name() {
    let by_modes = edited(file("fembs"), |object, key, v| match object {
        "Gr" | "Ge" if entry(key) => same(&reblocked(key), v),
        _ => same(key, v),
    });
    for text in [
        by_modes.replacen("dialect fembs", "dialect mode-blocked", 1),
        by_modes.replacen("flexbody", "someone", 1),
    ] {
        let imported = read(&text);
        assert_eq!(imported.dialect, "embs");
        assert_eq!(findings(&imported), Vec::<String>::new());
        assert!(imported.notes[0].contains("m1 has the mode as its middle index"), "{:?}", imported.notes);
        assert_eq!(imported.body.inertia, read(file("fembs")).body.inertia);
    }
    assert!(read(file("embs")).notes[0].contains("as EMBSlib reads it"));
}

#[test]
fn indentation_case_exponents_line_ends_and_the_first_line_do_not_matter() {
    let plain = read(file("fembs"));
    let without_first = file("fembs").split_once('\n').expect("lines").1;
    for text in [
        file("fembs").replace("D+", "E+").replace("D-", "e-"),
        file("fembs").replace("D+", "d").replace("D-", "d-"),
        file("fembs").lines().map(|line| format!("  {}\r\n\n", line.trim())).collect(),
        file("fembs").replace("Oe", "OE").replace("refmod", "REFMOD").replace("mdCM", "MDcm"),
        file("fembs").replace("new modal", "new modal   ="),
        file("fembs").replace(" frame\n", " new frame\n").replace("end new frame", "end frame"),
        without_first.to_owned(),
    ] {
        let other = read(&text);
        assert_eq!(other.body.inertia, plain.body.inertia);
        assert_eq!(other.body.frames, plain.body.frames);
        assert_eq!(findings(&other), Vec::<String>::new());
    }
}

/// Returns the column of Gr or Ge in the other order.
fn reblocked(key: &str) -> String {
    // The file has three modes and three axes.
    let (row, column) = (indices(key)[0], indices(key)[1] - 1);
    format!("m0({row},{})", 3 * (column % 3) + column / 3 + 1)
}

type Change = fn(&str, &str, &str) -> Option<(String, String)>;

/// Returns true if a line of an object is an entry.
fn entry(key: &str) -> bool {
    key.starts_with('m') && key.contains('(')
}

fn swapped_gr(object: &str, key: &str, v: &str) -> Option<(String, String)> {
    if object != "Gr" || !entry(key) {
        return same(key, v);
    }
    let (row, column) = (indices(key)[0], indices(key)[1]);
    let column = [0, 2, 1, 3, 4, 5, 6, 7, 8, 9][column];
    same(&format!("m0({row},{column})"), v)
}

#[test]
fn every_fault_gives_the_finding_that_names_it() {
    let text = file("fembs");
    let cases: Vec<(&str, Change, Vec<&str>)> = vec![
        (
            "two columns of Gr are exchanged",
            swapped_gr,
            vec!["FB740 gr_symmetric_is_j1", "FB740 gr_skew_is_cr0"],
        ),
        (
            "Gr is mode-blocked",
            |object, key, v| match object {
                "Gr" if entry(key) => same(&reblocked(key), v),
                _ => same(key, v),
            },
            vec!["FB742 gr_layout"],
        ),
        (
            "Ge is mode-blocked",
            |object, key, v| match object {
                "Ge" if entry(key) => same(&reblocked(key), v),
                _ => same(key, v),
            },
            vec!["FB742 ge_layout"],
        ),
        (
            "the last columns of Oe are swapped",
            |object, key, v| {
                if object != "Oe" || !entry(key) {
                    return same(key, v);
                }
                let mut at = indices(key);
                let last = at.len() - 1;
                at[last] = [0, 1, 2, 3, 4, 6, 5][at[last]];
                let at: Vec<String> = at.iter().map(usize::to_string).collect();
                same(&format!("{}({})", &key[..2], at.join(",")), v)
            },
            vec!["FB742 oe_layout"],
        ),
        (
            "six decimals",
            |_, key, v| if entry(key) { same(key, &format!("{:.6}", value(v))) } else { same(key, v) },
            vec!["FB743 digits"],
        ),
        (
            "seven significant digits",
            |_, key, v| if entry(key) { same(key, &format!("{:.6e}", value(v))) } else { same(key, v) },
            vec!["FB743 digits"],
        ),
        (
            "no Ge",
            |object, key, v| if object == "Ge" && entry(key) { None } else { same(key, v) },
            vec!["FB745 coupling_is_there"],
        ),
        (
            "no Gr",
            |object, key, v| if object == "Gr" && entry(key) { None } else { same(key, v) },
            vec!["FB745 coupling_is_there"],
        ),
        (
            "no Oe1",
            |object, key, v| if object == "Oe" && key.starts_with("m1") { None } else { same(key, v) },
            vec!["FB745 coupling_is_there"],
        ),
        (
            "no Cr1",
            |object, key, v| if object == "Cr" && key.starts_with("m1") { None } else { same(key, v) },
            vec!["FB745 coupling_is_there"],
        ),
        (
            "centrifugal forces of lumped masses",
            |object, key, v| {
                if object == "Oe" && key.starts_with("m1") { scaled(key, v, 1.03) } else { same(key, v) }
            },
            vec!["FB741 oe1_is_me"],
        ),
        (
            "forces at frames do other work",
            |object, key, v| {
                if object == "phi" && key == "m0(1,2)" { scaled(key, v, 1.001) } else { same(key, v) }
            },
            vec!["FB740 origin_m1_is_phi"],
        ),
        (
            "an entry of Oe1 has the wrong sign",
            |object, key, v| {
                if object == "Oe" && key == "m1(1,2,4)" { scaled(key, v, -1.0) } else { same(key, v) }
            },
            vec!["FB740 oe1_symmetric"],
        ),
        (
            "J in other units",
            |object, key, v| {
                if object == "J" && key.starts_with("m1") { scaled(key, v, 1e-3) } else { same(key, v) }
            },
            vec!["FB740 gr_symmetric_is_j1", "FB740 oe0_is_j1"],
        ),
    ];
    for (what, change, expected) in cases {
        let imported = read(&edited(text, change));
        assert_eq!(findings(&imported), expected, "{what}: {:#?}", imported.checks);
        for check in &imported.checks {
            let finding = check.finding();
            assert!(finding.is_none_or(|finding| finding.message().contains(check.formula)));
        }
    }
    // This check applies to every format: lengths in two units.
    let millimetres = read(&edited(text, |object, key, v| {
        if object == "origin" && key.starts_with("m0") { scaled(key, v, 1000.0) } else { same(key, v) }
    }));
    let found = audit(&millimetres, 1e-6).findings();
    assert!(found.iter().any(|finding| finding.code() == Code::AuditUnits), "{found:?}");
    assert!(audit(&read(text), 1e-6).passed());
    assert!(read(&edited(text, in_radians)).checks.iter().any(|check| check.meaning.contains("2 pi")));
}

/// Replaces the frequencies in the texts by angular frequencies.
fn in_radians(_: &str, key: &str, v: &str) -> Option<(String, String)> {
    match v.strip_prefix("Eigen Mode").and_then(|rest| rest.split_once(':')) {
        Some((mode, frequency)) => {
            let f = value(frequency.trim().trim_end_matches("Hz").trim());
            same(key, &format!("Eigen Mode {mode}: {:.3} Hz", std::f64::consts::TAU * f))
        }
        None => same(key, v),
    }
}

/// Without a declaration in the first line, a Ct of order 1 implies geometric stiffness, also in Oe1; without
/// it an Oe1 that disagrees with Me is a finding.
#[test]
fn geometric_stiffness_is_known_by_ct_where_nothing_declares_it() {
    let sid = find_format("sid").expect("a format");
    let findings_of = |kinds: &[LoadKind]| {
        let plain = fixture("bracket_hex20", 3, BodyFrame::Model);
        let size = 0.1 * plain.modes().eigenvalue[0];
        let body = stressed(plain, kinds, size, &mut Random(7));
        let (exported, _) = export(&body, sid, &ExportOptions::default(), true).expect("written");
        let text = String::from_utf8(exported.file).expect("text");
        let undeclared: Vec<&str> = text.lines().skip(1).collect();
        let imported = read(&undeclared.join("\n"));
        (findings(&imported), imported.body.geometric_stiffness.len())
    };
    assert_eq!(findings_of(&[LoadKind::Spin, LoadKind::Acceleration]), (Vec::new(), 9));
    assert_eq!(findings_of(&[LoadKind::Spin]), (vec!["FB741 oe1_is_me".to_owned()], 6));
}

/// Returns the value of an entry of an object in the order of `fembs`; zeros are not listed.
fn value_of(text: &str, object: &str, key: &str) -> f64 {
    let (_, rest) = text.split_once(&format!("\n           {object}\n")).expect("an object");
    let (inside, _) = rest.split_once(&format!("end {object}")).expect("its end");
    let found = inside
        .lines()
        .filter_map(|line| line.split_once('='))
        .find(|(name, _)| name.split_whitespace().collect::<String>() == key);
    found.map_or(0.0, |(_, v)| value(v.trim()))
}

/// Returns the findings about the coupling of a file after this change, and their words.
fn coupling_of(
    text: &str,
    change: impl Fn(&str, &str, &str) -> Option<(String, String)>,
) -> (Vec<String>, String) {
    let imported = read(&edited(text, change));
    let failed = imported.checks.iter().filter(|check| !check.passed());
    (findings(&imported), failed.map(|check| check.meaning.as_str()).collect::<Vec<_>>().join("; "))
}

#[test]
fn couplings_that_are_zero_are_told_for_what_they_are() {
    let text = file("fembs");
    // Free modes have no Cr0, so that a skew part of Gr is an error of Gr.
    let size = 0.01 * value_of(text, "Gr", "m0(1,1)").abs().max(value_of(text, "Gr", "m0(2,4)").abs());
    let moved = |key: &str, v: &str, by: f64| same(key, &format!("{:.16e}", value(v) + by));
    let (found, words) = coupling_of(text, |object, key, v| match (object, key) {
        ("Cr", key) if key.starts_with("m0") => None,
        ("Gr", "m0(1,4)") => moved(key, v, size),
        ("Gr", "m0(2,1)") => moved(key, v, -size),
        _ => same(key, v),
    });
    assert_eq!(found, ["FB740 gr_skew_is_cr0"], "{words}");
    assert!(words.contains("Gr is wrong"), "{words}");
    // Cr1 is present, but Ge cannot come from it.
    let (found, words) = coupling_of(text, |object, key, v| match object {
        "Cr" if key.starts_with("m1") => same(key, &format!("{:e}", value(v).abs())),
        _ => same(key, v),
    });
    assert_eq!(found, ["FB745 coupling_is_there"]);
    assert!(words.contains("Cr1 is symmetric in the modes") && !words.contains("Cr1 is zero"), "{words}");
    let (_, words) = coupling_of(text, |object, key, v| match object {
        "Cr" if key.starts_with("m1") => None,
        _ => same(key, v),
    });
    assert!(words.contains("Cr1 is zero although Ge is not"), "{words}");
}

/// FEMBS writes all of 2 Cr1 into Ge, including the geometric stiffness for angular acceleration in Cr1.
#[test]
fn ge_with_the_symmetric_part_of_cr1_is_named() {
    let sid = find_format("sid").expect("a format");
    let plain = fixture("bracket_hex20", 3, BodyFrame::Model);
    let size = 0.1 * plain.modes().eigenvalue[0];
    let body = stressed(plain, &[LoadKind::AngularAcceleration], size, &mut Random(5));
    let (exported, _) = export(&body, sid, &ExportOptions::default(), true).expect("written");
    let text = String::from_utf8(exported.file).expect("text");
    assert_eq!(findings(&read(&text)), Vec::<String>::new());
    let mut entries = String::new();
    for (k, l, a) in (0..27).map(|at| (at / 9 + 1, at / 3 % 3 + 1, at % 3 + 1)) {
        let value = 2.0 * value_of(&text, "Cr", &format!("m1({k},{l},{a})"));
        entries += &format!("m0({k},{}) = {value:.16e}\n", (a - 1) * 3 + l);
    }
    let (before, rest) = text.split_once("\n           Ge\n").expect("Ge");
    let (_, after) = rest.split_once("end Ge").expect("its end");
    let sizes = "order = 0\nnrow = 3\nncol = 9\nnq = 3\nnqn = 0\nstructure = 3\n";
    let imported = read(&format!("{before}\nGe\n{sizes}{entries}end Ge{after}"));
    assert_eq!(findings(&imported), ["FB740 ge_is_twice_cr1"]);
    let check = imported.checks.iter().find(|check| check.name == "ge_is_twice_cr1").expect("a check");
    assert!(check.meaning.contains("Ge is 2 Cr1") && check.meaning.contains("FEMBS"), "{}", check.meaning);
}

/// Frames that are mirrored or not orthonormal are detected, and no body is made of the file.
#[test]
fn axes_that_are_no_rotation_are_refused() {
    let cases: [(Change, &str); 2] = [
        (
            |object, key, v| {
                if (object, key) == ("AP", "m0(2,2)") { scaled(key, v, -1.0) } else { same(key, v) }
            },
            "mirror image",
        ),
        (
            |object, key, v| {
                if (object, key) == ("AP", "m0(2,2)") { scaled(key, v, 1.1) } else { same(key, v) }
            },
            "not orthonormal",
        ),
    ];
    for (change, words) in cases {
        let imported = read(&edited(file("fembs"), change));
        assert_eq!(findings(&imported), ["FB748 ap_is_a_rotation"]);
        let source = SourceFile::new("body", Path::new("body.SID_FEM"), "0".repeat(64));
        let error = import_body(&imported, source, UnitSystem::default(), None).expect_err(words);
        assert!(error.has(Code::ForeignUnsound) && error.to_string().contains(words), "{error}");
    }
}

/// Rotated axes of a frame are valid; a note states that they are not taken over.
#[test]
fn turned_axes_of_a_frame_are_noted() {
    let note =
        |imported: &ImportedFile| imported.notes.iter().any(|note| note.contains("the axes of frames (AP)"));
    assert!(!note(&read(file("fembs"))));
    let turned = read(&edited(file("fembs"), |object, key, v| match (object, key) {
        ("AP", "m0(1,1)" | "m0(2,2)") => scaled(key, v, -1.0),
        _ => same(key, v),
    }));
    assert_eq!(findings(&turned), Vec::<String>::new());
    assert!(note(&turned), "{:?}", turned.notes);
}

#[test]
fn first_lines_of_fembeam_and_objects_without_structure_are_read() {
    for dialect in ["fembs", "morembs", "py-sid", "fembeam", "embs"] {
        let own = read(file(dialect));
        let (first, rest) = file(dialect).split_once('\n').expect("lines");
        let stated: Vec<&str> = first.split_whitespace().take(2).collect();
        let head = format!(
            "{} nodes, {} modes, generated by FEMBeam2SID MATLAB script on 01-Jan-2026 12:00:00 by a\nread and written again",
            stated[0], stated[1]
        );
        let text = format!("{head}\n{rest}");
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("body.SID_FEM");
        std::fs::write(&path, &text).expect("writes");
        assert_eq!(recognise(&InputFile::open(&path).expect("opens")).expect("a format").name(), "sid");
        assert_eq!(read(&text).body.inertia, own.body.inertia);
        let more = text.replacen(stated[0], "9999", 1);
        assert_eq!(findings(&read(&more)), ["FB740 number_of_frames"]);

        let lines = file(dialect).lines().filter(|line| !line.contains("structure"));
        let inferred = read(&lines.collect::<Vec<_>>().join("\n"));
        assert_eq!(inferred.body, own.body, "{dialect}");
        assert!(inferred.notes.iter().any(|note| note.contains("no `structure`")), "{:?}", inferred.notes);
        assert!(!own.notes.iter().any(|note| note.contains("no `structure`")));
    }
}

#[test]
fn fewer_frames_than_stated_are_found() {
    let text = file("fembs");
    let stated: usize = text.split_whitespace().next().expect("a count").parse().expect("a number");
    let more = text.replacen(&format!("{stated:5}"), &format!("{:5}", stated + 1), 1);
    assert_eq!(findings(&read(&more)), ["FB740 number_of_frames"]);
}

#[test]
fn unreadable_files_are_told_with_their_line() {
    let text = file("fembs");
    let line_of = |part: &str| text.lines().position(|line| line.contains(part)).expect("a line") + 1;
    let first_entry = line_of("m0(");
    let broken = |line: usize, new: &str| {
        let lines = text.lines().enumerate().map(|(i, old)| if i + 1 == line { new } else { old });
        lines.collect::<Vec<_>>().join("\n")
    };
    for (line, new, said) in [
        (first_entry, "m0( 1, 1) = NaN", "expected a finite number"),
        (first_entry, "m0( 1, 1) = 1.0D+999", "expected a finite number"),
        (first_entry, "m0( 9, 1) = 1.0", "outside its 3 x 1"),
        (first_entry, "m0( 0, 1) = 1.0", "expected a size, an entry"),
        (first_entry, "m0( 1, 99999999999999999999) = 1.0", "expected a size, an entry"),
        (first_entry, "m2( 1, 1, 1) = 1.0", "expected a size, an entry"),
        (line_of("nelastq"), "nelastq = 4", "first line states 3 modes"),
        (line_of("nelastq"), "nelastq = -1", "expected a whole number"),
        (line_of("order"), "order = 2", "an order above 1"),
        (line_of("nrow"), "nrow = 4000000000", "expected 3 x 1"),
        (line_of("rframe"), "colour = red", "expected one of its objects"),
        (line_of("part"), "parts", "expected `part`"),
    ] {
        let error = try_read(broken(line, new).as_bytes()).expect_err(said);
        assert!(error.to_string().contains(said), "{new}: {error}");
        assert!(error.has(Code::ForeignUnreadable), "{error}");
        assert!(error.diagnostics()[0].line().is_some(), "{error}");
    }
    let first = text.lines().nth(first_entry - 1).expect("an entry");
    let again = text.replacen(first, &format!("{first}\n{first}"), 1);
    assert!(try_read(again.as_bytes()).expect_err("twice").to_string().contains("is repeated"));
    let half: String = text.lines().take(first_entry).map(|line| format!("{line}\n")).collect();
    assert!(try_read(half.as_bytes()).expect_err("cut").to_string().contains("ends inside of `origin`"));
    let more = format!("{text}\npart\n");
    assert!(try_read(more.as_bytes()).expect_err("more").to_string().contains("follows `end part`"));
    for missing in ["Ke", "Me", "mdCM", "J"] {
        let start = text.find(&format!("           {missing}\n")).expect("an object");
        let end = text.find(&format!("end {missing}\n")).expect("its end") + 5 + missing.len();
        let error =
            try_read(format!("{}{}", &text[..start], &text[end..]).as_bytes()).expect_err("incomplete");
        assert!(error.has(Code::ForeignIncomplete), "{missing}: {error}");
    }
    // A single number declares many modes.
    let many = broken(line_of("nelastq"), "nelastq = 100000000");
    let many = many.split_once('\n').expect("lines").1;
    assert!(try_read(many.as_bytes()).expect_err("modes").has(Code::ForeignIncomplete));
}

#[test]
fn samples_of_other_programs_have_the_findings_that_they_are_known_for() {
    let root = oracle::shared();
    for (name, dialect, modes, expected) in [
        // Columns 4 to 6 of Oe1 are not symmetric; rotary inertia of the nodes is in Me and Cr, but not in Oe
        // and Gr.
        (
            "Beam_3m.SID_FEM",
            "py-sid",
            4,
            vec!["FB740 oe1_symmetric", "FB741 oe1_is_me", "FB741 gr_skew_is_cr0"],
        ),
        ("matflex_straight_beam.SID_FEM", "morembs", 8, vec!["FB741 oe1_is_me", "FB741 gr_skew_is_cr0"]),
    ] {
        let path = root.join("samples/sid").join(name);
        if !path.is_file() {
            continue;
        }
        let file = InputFile::open(&path).expect("opens");
        assert_eq!(recognise(&file).expect("a format").name(), "sid");
        let imported = reader().read(&file).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((imported.dialect.as_str(), imported.body.n_modes()), (dialect, modes));
        assert_eq!(findings(&imported), expected, "{name}");
        assert!(imported.body.modal_damping.is_some());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// A damaged file is read or refused.
    #[test]
    fn damaged_files_are_read_or_refused(
        dialect in 0..5usize,
        changes in proptest::collection::vec((0.0..1.0f64, prop_oneof![any::<u8>(), prop::sample::select(b"0123456789 \n=-+.DE(),m".to_vec())]), 0..6),
        cut in prop_oneof![3 => Just(1.0), 1 => 0.0..1.0f64],
        inserted in prop_oneof![2 => Just(""), 1 => Just("99999999999999"), 1 => Just("\nend"), 1 => Just("=")],
    ) {
        let mut bytes = FILES[dialect].1.clone().into_bytes();
        let len = bytes.len() as f64;
        for (at, byte) in changes {
            bytes[(at * len) as usize] = byte;
        }
        let at = (0.37 * len) as usize;
        bytes.splice(at..at, inserted.bytes());
        bytes.truncate(((cut * bytes.len() as f64) as usize).max(1));
        if let Ok(imported) = try_read(&bytes) {
            for check in &imported.checks {
                prop_assert!(check.passed() || check.finding().is_some());
            }
        }
    }
}
