//! Reports describe the body in three formats and claim no more than is proved.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_body::flex_body::{FlexBody, Guarantee, MassStructure, Parts, Storage};
use flexbody_body::invariants::{BodyFrame, DIGITS, ERROR_NORMS, Expected, Turning, identities};
use flexbody_model::{BodyNumber, Coupling};
use flexbody_report::{
    Facts, Format, LumpedModes, RunData, Screen, diagnostics_json, identities_json, identities_text, render,
    summary,
};
use nalgebra::Vector3;
use oracle::report_bodies::{engine_mount, run_data};
use proptest::prelude::*;
use std::path::Path;

fn changed(change: impl FnOnce(&mut Parts)) -> FlexBody {
    let mut parts = engine_mount().into_parts();
    change(&mut parts);
    FlexBody::new(parts).unwrap_or_else(|e| panic!("{e}"))
}

fn text(body: &FlexBody, run: &RunData) -> String {
    render(&Facts::new(body, run), Format::Text)
}

fn json(body: &FlexBody, run: &RunData) -> serde_json::Value {
    serde_json::from_str(&render(&Facts::new(body, run), Format::Json)).unwrap()
}

fn schema() -> jsonschema::Validator {
    let schema = serde_json::from_str(include_str!("../../../../schemas/report.schema.json")).unwrap();
    jsonschema::validator_for(&schema).unwrap()
}

fn line<'a>(text: &'a str, label: &str) -> &'a str {
    text.lines().find(|l| l.starts_with(label)).unwrap_or_else(|| panic!("no line `{label}` in\n{text}"))
}

/// Relative difference up to which two printed numbers are equal: last digits differ between processors.
const DIGITS_OF_ROUNDING: f64 = 1e-9;

/// Difference of two printed numbers that is rounding of a value of one.
const ROUNDING_OF_ZERO: f64 = 1e-14;

/// Returns true if two lines have the same words, and numbers that are equal up to rounding.
fn is_same_line(found: &str, expected: &str) -> bool {
    let words = |line: &str| -> Vec<String> {
        line.split([' ', ',', '[', ']', ':']).filter(|word| !word.is_empty()).map(str::to_owned).collect()
    };
    let is_same = |(found, expected): (&String, &String)| {
        found == expected
            || match (found.parse::<f64>(), expected.parse::<f64>()) {
                (Ok(a), Ok(b)) => (a - b).abs() <= DIGITS_OF_ROUNDING * b.abs() + ROUNDING_OF_ZERO,
                _ => false,
            }
    };
    let (found, expected) = (words(found), words(expected));
    found.len() == expected.len() && found.iter().zip(&expected).all(is_same)
}

/// Compares with a file of the repository, line by line; FLEXBODY_BLESS=1 writes it instead.
fn golden(name: &str, found: &str) {
    let path = oracle::root().join("tests/golden").join(name);
    let found = found.replace(&flexbody_base::provenance::generator(), "flexbody VERSION");
    if std::env::var_os("FLEXBODY_BLESS").is_some() {
        std::fs::write(&path, found).unwrap();
        return;
    }
    let expected = std::fs::read_to_string(&path).unwrap();
    for (i, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
        assert!(is_same_line(found, expected), "{name}, line {}: {found}, expected {expected}", i + 1);
    }
    assert_eq!(found.lines().count(), expected.lines().count(), "lines of {name}");
}

#[test]
fn a_golden_line_differs_by_more_than_rounding() {
    assert!(is_same_line("  \"a\": 759.7143445263114,", "  \"a\": 759.714344526311,"));
    assert!(!is_same_line("  \"a\": 759.7143445,", "  \"a\": 759.7143465,"));
    assert!(!is_same_line("  \"a\": 1.0,", "  \"b\": 1.0,"));
}

#[test]
fn the_three_formats_are_these_lines() {
    let body = engine_mount();
    let facts = Facts::new(&body, &run_data());
    golden("summary.txt", &summary(&facts, Screen::default()));
    golden("report.txt", &render(&facts, Format::Text));
    golden("report.json", &render(&facts, Format::Json));
    let (page, scripts) = without_scripts(&render(&facts, Format::Html));
    assert!(scripts.iter().any(|script| script.contains("getContext(\"webgl2\"")), "the body is drawn");
    golden("report.html", &page);
}

#[test]
fn guarantees_are_said_with_no_more_digits_than_they_have() {
    let body = changed(|parts| {
        let eigenvalue = &parts.modes.eigenvalue;
        // The fourth mode has the widest bounds, and an upper bound only.
        let width = |j: usize| if j == 3 { 2e-9 } else { 1e-14 };
        let mut digits = DIGITS.map(|_| 15.75);
        digits[8] = 15.29;
        parts.certificate.guarantee = Some(Guarantee {
            shift_below: eigenvalue[0] / 4.0,
            pivots_below: 6,
            eigenvalue_lower: eigenvalue.clone(),
            eigenvalue_upper: eigenvalue.iter().enumerate().map(|(j, l)| l * (1.0 + width(j))).collect(),
            shape_error: (0..eigenvalue.len()).map(|j| 1e-12 * (j + 1) as f64).collect(),
            digits,
        });
    });
    let words = text(&body, &RunData::default()).split_whitespace().collect::<Vec<_>>().join(" ");
    let half = 0.5 * body.frequencies_hz()[0];
    assert!(words.contains("guaranteed every eigenvalue to 8.6 digits or more (mode 4 worst)"), "{words}");
    assert!(words.contains("only 6 rigid modes below") && words.contains("(inertia count 6)"), "{words}");
    assert!(
        words.contains("to 15.2 digits or more (W1 worst); modes within 8e-12 of the exact modes"),
        "{words}"
    );
    let json = json(&body, &RunData::default());
    assert!(
        schema().is_valid(&json),
        "{:?}",
        schema().iter_errors(&json).map(|e| e.to_string()).collect::<Vec<_>>()
    );
    let guarantee = &json["guarantee"];
    assert!((guarantee["eigenvalue_digits"][3].as_f64().unwrap() - 8.699).abs() < 1e-3);
    assert_eq!(guarantee["invariant_digits"]["W1"], 15.29);
    assert!((guarantee["shift_below_hz"].as_f64().unwrap() / half - 1.0).abs() < 1e-15);
    let html = render(&Facts::new(&body, &RunData::default()), Format::Html);
    for cell in ["Lower bound</th>", "<td>8.6</td>", "<th scope=\"row\">W1</th><td>15.2</td>"] {
        assert_eq!(html.matches(cell).count(), 1, "{cell}");
    }
    assert!(self::json(&engine_mount(), &RunData::default())["guarantee"].is_null());
}

#[test]
fn the_file_name_says_the_format() {
    for (name, format) in [
        ("a.json", Some(Format::Json)),
        ("a.b/C.HTML", Some(Format::Html)),
        ("a.txt", Some(Format::Text)),
        ("a.json.gz", None),
        ("json", None),
        (".json", None),
        ("", None),
    ] {
        assert_eq!(Format::from_path(Path::new(name)), format, "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Names with control characters, numbers from 1e-300 to 1e300: every report of a valid body is
    /// well-formed.
    #[test]
    fn every_valid_body_has_a_well_formed_report(
        seed in any::<u64>(), n in 1usize..12, modes in 1usize..20, schemes in 0usize..9, interfaces in 0usize..4,
    ) {
        let body = oracle::file_bodies::body(seed, n, modes.min(3 * n), schemes, interfaces);
        let mut run = if seed % 2 == 0 { run_data() } else { RunData::default() };
        run.diagnostics.extend((0..seed % 20).map(|_| Diagnostic::new(Code::NodesUnused, "x".repeat(300))));
        let facts = Facts::new(&body, &run);
        let json: serde_json::Value = serde_json::from_str(&render(&facts, Format::Json)).unwrap();
        let errors: Vec<_> = schema().iter_errors(&json).map(|e| e.to_string()).collect();
        prop_assert!(errors.is_empty(), "{errors:?}");
        for text in [render(&facts, Format::Text), summary(&facts, Screen::default())] {
            for line in text.lines() {
                prop_assert!(line.chars().count() <= 80, "{line}");
                prop_assert!(!line.contains(|c: char| c.is_control()), "{line:?}");
            }
        }
        for (columns, longest) in [(1, 40), (57, 57), (1000, 100)] {
            for line in summary(&facts, Screen::default().with_columns(columns)).lines() {
                prop_assert!(line.chars().count() <= longest, "{line}");
            }
        }
        well_formed(&render(&facts, Format::Html));
    }
}

/// Lines break at other places, and terms with short lines get more of them.
#[test]
fn a_narrow_terminal_shows_what_a_wide_one_shows() {
    let (body, run) = (engine_mount(), run_data());
    let facts = Facts::new(&body, &run);
    let words = |screen: Screen| {
        summary(&facts, screen).split_whitespace().map(str::to_owned).collect::<Vec<String>>()
    };
    let usual = words(Screen::default());
    assert_eq!(words(Screen::default().with_columns(57)), usual);
    assert_eq!(words(Screen::default().with_columns(100)), usual);
}

/// Warnings and interfaces add lines to the summary of this body.
#[test]
fn the_summary_of_a_usual_body_is_read_in_seconds() {
    let body = changed(|parts| parts.interfaces.clear());
    let run = RunData { diagnostics: Vec::new(), ..run_data() };
    let told = summary(&Facts::new(&body, &run), Screen::default());
    let lines = told.lines().filter(|line| !line.is_empty()).count();
    assert!(lines <= 14 && told.lines().count() <= 18, "{told}");
}

/// Limitations of a body are always in the summary, not in the report alone.
#[test]
fn the_summary_keeps_what_the_body_cannot_do() {
    let told = |change: &dyn Fn(&mut Parts)| {
        let text = summary(&Facts::new(&changed(change), &RunData::default()), Screen::default());
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let has = |change: &dyn Fn(&mut Parts), part: &str| {
        let told = told(change);
        assert!(told.contains(part), "{part}: {told}");
    };
    has(&|_| {}, "row sums: NEGATIVE masses at 312 nodes, smallest inertia +100 %, W2 31 % off");
    has(&|p| p.certificate.proved_modes = None, "NOT PROVED");
    has(
        &|p| p.description.units = flexbody_base::units::UnitSystem::default(),
        "m, kg, s assumed, none stated",
    );
    has(&|p| p.source.mass_structure = MassStructure::Diagonal, "DIAGONAL (lumped) mass");
    has(&|p| p.storage = Storage::F32, "rounded to 32-bit floats");
    has(&|p| p.description.number = Some(BodyNumber { number: 1, of: 2 }), "body 1 of 2");
    has(&|p| p.interfaces[0].coupling = Some(Coupling::Rigid), "rigid but DEFORMS");
    // A text has the warnings; with the summary and on a terminal they are printed apart.
    let mount = engine_mount();
    let facts = Facts::new(&mount, &run_data());
    let warned = render(&facts, Format::Text);
    assert!(line(&warned, "warnings").contains("FB510 rigid modes reach"), "{warned}");
    for printed in [summary(&facts, Screen::default()), render(&facts, Format::Terminal)] {
        assert!(!printed.contains("FB510"), "{printed}");
    }
}

#[test]
fn colours_are_in_the_summary_where_they_are_asked_for_alone() {
    let body = changed(|p| p.certificate.proved_modes = None);
    let facts = Facts::new(&body, &run_data());
    let (plain, coloured) =
        (summary(&facts, Screen::default()), summary(&facts, Screen::default().coloured(true)));
    assert!(!plain.contains('\u{1b}') && coloured.contains("\u{1b}[31mNOT PROVED"), "{coloured}");
    let mut without = String::new();
    for (i, piece) in coloured.split("\u{1b}[").enumerate() {
        without.push_str(if i == 0 { piece } else { piece.split_once('m').expect("a code ends").1 });
    }
    assert_eq!(without, plain, "colours change nothing else");
}

#[test]
fn json_floats_are_those_of_the_body_to_the_last_bit() {
    let body = oracle::report_bodies::block(BodyFrame::Principal);
    let json = json(&body, &RunData::default());
    let read = |key: &str| -> Vec<u64> {
        json["modes"][key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap().to_bits()).collect()
    };
    let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|v| v.to_bits()).collect() };
    assert_eq!(read("eigenvalue"), bits(&body.modes().eigenvalue));
    assert_eq!(read("frequency_hz"), bits(&body.frequencies_hz()));
    assert_eq!(json["body"]["mass"].as_f64().unwrap().to_bits(), body.invariants().mass().to_bits());
}

#[test]
fn the_schema_refuses_what_is_missing_misspelt_or_new() {
    let schema = schema();
    let good = json(&engine_mount(), &run_data());
    assert!(schema.is_valid(&good));
    let break_it = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut bad = good.clone();
        change(&mut bad);
        assert_ne!(bad, good);
        assert!(!schema.is_valid(&bad));
    };
    for key in good.as_object().unwrap().keys() {
        break_it(&|bad| drop(bad.as_object_mut().unwrap().remove(key)));
    }
    break_it(&|bad| bad["extra"] = 1.into());
    break_it(&|bad| bad["modes"]["extra"] = 1.into());
    break_it(&|bad| bad["format_major"] = 2.into());
    break_it(&|bad| bad["body"]["mass"] = "heavy".into());
    break_it(&|bad| bad["diagnostics"][0]["code"] = "E1".into());
    break_it(&|bad| bad["lumped"][0]["negative_masses"] = (-1).into());
}

#[test]
fn mass_properties_do_not_depend_on_the_body_frame() {
    let facts = |frame| json(&oracle::report_bodies::block(frame), &RunData::default());
    let [principal, com, model] = [BodyFrame::Principal, BodyFrame::Com, BodyFrame::Model].map(facts);
    for other in [&com, &model] {
        for (key, size) in [("centre_of_mass", 1.0), ("principal_inertia", 6.5), ("radii_of_gyration", 1.0)] {
            for k in 0..3 {
                let (a, b) =
                    (principal["body"][key][k].as_f64().unwrap(), other["body"][key][k].as_f64().unwrap());
                assert!((a - b).abs() <= 1e-13 * size, "{key}: {a} {b}");
            }
        }
    }
    // Cuboid of the test: m = 6, I = m (b^2 + c^2) / 12 with sides 3, 2, 1, centred at (1.5, 1, 0.5).
    let exact = [6.0 * 5.0 / 12.0, 6.0 * 10.0 / 12.0, 6.0 * 13.0 / 12.0];
    for k in 0..3 {
        assert!((principal["body"]["principal_inertia"][k].as_f64().unwrap() - exact[k]).abs() < 1e-13);
        assert!(
            (principal["body"]["centre_of_mass"][k].as_f64().unwrap() - [1.5, 1.0, 0.5][k]).abs() < 1e-14
        );
    }
    let words = |facts: &serde_json::Value| facts["body"]["frame"].as_str().unwrap().to_owned();
    assert_eq!(words(&principal), "origin at the centre of mass, axes of the model, which are principal");
    // The sides of the cuboid are parallel to the model axes, which are therefore principal.
    assert_eq!(words(&com), "origin at the centre of mass, axes of the model, which are principal");
    assert_eq!(words(&model), "origin of the model, axes of the model, which are principal");
}

#[test]
fn completeness_claims_only_what_the_certificate_proves() {
    let sentence = |body: &FlexBody| {
        let completeness = &json(body, &RunData::default())["completeness"];
        (completeness["proved"].as_bool().unwrap(), completeness["sentence"].as_str().unwrap().to_owned())
    };
    let of = |change: &dyn Fn(&mut Parts)| sentence(&changed(change));
    assert_eq!(
        of(&|_| {}),
        (true, "proved: 8 flexible + 6 rigid modes below 5 kHz (inertia count 14)".to_owned())
    );
    assert_eq!(
        of(&|p| p.certificate.proved_modes = None),
        (false, "NOT PROVED: no inertia count was made".to_owned())
    );
    let (proved, why) = of(&|p| {
        p.certificate.proved_modes = None;
        p.certificate.remark = "pivots were unsafe".to_owned();
    });
    assert!(!proved && why == "NOT PROVED: pivots were unsafe");
    // A count that contradicts itself or the modes is no proof.
    for change in [
        &(|p: &mut Parts| p.certificate.negative_pivots = None) as &dyn Fn(&mut Parts),
        &|p| p.certificate.negative_pivots = Some(15),
        &|p| p.certificate.rigid_modes = 7,
        &|p| p.certificate.shift = 1.0,
        &|p| p.certificate.shift = -1.0,
        &|p| p.certificate.shift = p.modes.eigenvalue[6] * 1.001,
        &|p| p.certificate.rigid_modes = usize::MAX,
    ] {
        let (proved, why) = of(change);
        assert!(!proved && why.starts_with("NOT PROVED: "), "{why}");
    }
    let (proved, why) = of(&|p| {
        p.certificate.proved_modes = Some(7);
        p.certificate.negative_pivots = Some(13);
        p.certificate.shift = p.modes.eigenvalue[6] * 1.001;
    });
    assert!(
        !proved
            && why.starts_with("PROVED IN PART: 7 flexible")
            && why.ends_with("; 1 mode above this frequency not proved")
    );
    let (proved, why) = of(&|p| {
        p.certificate.proved_modes = Some(9);
        p.certificate.negative_pivots = Some(15);
    });
    assert!(proved && why.ends_with("the lowest 8 of them kept"), "{why}");
}

#[test]
fn the_lumped_errors_of_every_invariant_are_told_with_the_negative_masses() {
    let body = engine_mount();
    let summary = text(&body, &RunData::default());
    let told = "row-sum: errors modal mass 6.25 %, I0 80.1 %, W1 12.5 %, W2 31 %, W3 24 %, C1 0.025 %, C2 0.025 %; \
                NEGATIVE masses of this scheme at 312 nodes";
    let words = summary.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains(told), "{summary}");
    let facts = json(&body, &RunData::default());
    let worst = &facts["lumped"][0]["worst"];
    assert_eq!(worst["name"], "I0_max");
    assert_eq!(worst["value"], 0.801);
    let meaning = ERROR_NORMS.iter().find(|(name, _)| *name == "I0_max").unwrap().1;
    assert_eq!(worst["meaning"], meaning);
    assert_eq!(facts["lumped"][0]["error_norms"].as_object().unwrap().len(), ERROR_NORMS.len());
}

#[test]
fn lumped_modes_say_how_far_frequencies_move_or_why_there_are_none() {
    let body = engine_mount();
    let mut hz = body.frequencies_hz();
    hz[3] *= 0.9;
    hz[1] *= 1.02;
    let done = LumpedModes {
        scheme: "diagonal-scaling".to_owned(),
        frequencies_hz: hz,
        subspace_cosine: 0.97,
        comparison: vec![("W2_max".to_owned(), 0.2)],
        remark: String::new(),
        caution: "8 modes cut a group of equal frequencies".to_owned(),
    };
    let refused = LumpedModes {
        scheme: "row-sum".to_owned(),
        frequencies_hz: vec![],
        subspace_cosine: f64::NAN,
        comparison: vec![],
        remark: "312 nodal masses are negative".to_owned(),
        caution: String::new(),
    };
    let run = RunData { lumped_modes: vec![done, refused], ..RunData::default() };
    let summary = text(&body, &run);
    let words = summary.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("frequency 4 off by -10 %, subspace cosine 0.97; 8 modes cut"), "{summary}");
    assert!(
        render(&Facts::new(&body, &run), Format::Html).contains("8 modes cut a group of equal frequencies")
    );
    assert!(summary.contains("row-sum           not done: 312 nodal masses are negative"), "{summary}");
    let facts = json(&body, &run);
    assert!(schema().is_valid(&facts));
    assert!(facts["run"].is_null(), "lumped modes alone are no data of a run");
    assert!(facts["lumped_modes"][1]["subspace_cosine"].is_null());
}

#[test]
fn assumed_units_and_lumped_input_are_not_passed_over() {
    let body = changed(|p| {
        p.description.units = flexbody_base::units::UnitSystem::default();
        p.source.mass_structure = flexbody_body::flex_body::MassStructure::Diagonal;
    });
    let summary = text(&body, &RunData::default());
    assert!(line(&summary, "body").contains("m, kg, s assumed, none stated"));
    assert!(line(&summary, "model").contains("DIAGONAL"));
    let sized = changed(|p| {
        p.description.units = flexbody_base::units::UnitSystem::parse("0.0254", "lb", "ms").unwrap()
    });
    assert!(line(&text(&sized, &RunData::default()), "inertia").ends_with("lb [0.0254 m]^2 (principal)"));
}

#[test]
fn names_cannot_inject_markup_or_terminal_codes() {
    let nasty = "<script>alert('x')</script> & \"q\" \u{1b}[31m";
    let body = changed(|p| {
        p.description.name = nasty.to_owned();
        p.source.files[0].name = nasty.to_owned();
        p.source.settings = serde_json::json!({ nasty: nasty });
        p.lumped[0].scheme = nasty.to_owned();
        p.lumped[0].comparison.push((nasty.to_owned(), 2.0));
        p.interfaces[0].name = nasty.to_owned();
        p.certificate.remark = nasty.to_owned();
    });
    let mut run = run_data();
    run.diagnostics.push(Diagnostic::new(Code::NodesUnused, nasty).in_file(nasty).with_help(nasty));
    run.counters.push((nasty.to_owned(), 1));
    run.phases[0].name = nasty.to_owned();
    run.output = Some((nasty.to_owned(), 1));
    let facts = Facts::new(&body, &run);
    let html = render(&facts, Format::Html);
    well_formed(&html);
    let (page, scripts) = without_scripts(&html);
    assert!(!html.contains("<script>alert") && !html.contains('\u{1b}') && page.contains("&lt;script&gt;"));
    // Names beside bars are cut, so that the end of the element may be missing.
    let escaped = page.matches("&lt;script&gt;alert('x')").count();
    assert!(!page.contains("alert('x')</"), "ends of elements are escaped");
    assert_eq!(page.matches("alert('x')").count(), escaped, "texts are escaped");
    let data = scripts.iter().find(|script| script.starts_with('{')).expect("what the script is told");
    assert!(data.contains("\\u003cscript>alert") && !data.contains('<'), "{data}");
    assert!(!render(&facts, Format::Text).contains('\u{1b}'));
    assert!(schema().is_valid(&serde_json::from_str(&render(&facts, Format::Json)).unwrap()));
}

#[test]
fn the_page_loads_nothing() {
    let html = render(&Facts::new(&engine_mount(), &run_data()), Format::Html);
    for outside in ["http:", "https:", "src=", "href=", "url(", "@import", "<link", "onload", "{{"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.contains("default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"));
}

/// Without scripts the page still has a picture, words and numbers; only the animation is missing.
#[test]
fn the_page_is_whole_without_scripts() {
    let body = engine_mount();
    let (page, _) = without_scripts(&render(&Facts::new(&body, &run_data()), Format::Html));
    for part in [
        "<svg class=\"still\"",
        "812.5",
        "kg m\u{b2}",
        "<span class=\"error\">NEGATIVE masses at 312 nodes (made by this scheme; the model has no such masses)</span>, smallest principal moment of inertia 100 % too large",
        "the centrifugal forces on the modes (W2) 31 % off",
        "<summary>All error norms</summary>",
        "<abbr title=\"The invariant (3 n x 3 n)",
        "Heat map of W3",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Every nonzero entry has a cell: only the diagonal of W2 of this body.
    assert_eq!(page.matches("<title>mode 1: 0.67</title>").count(), 1);
    assert!(!page.contains("<title>modes "), "no entry of two modes");
    let frequencies = body.frequencies_hz().len();
    assert!(page.matches("<tr><th scope=\"row\">").count() > frequencies);
}

#[test]
fn identities_and_diagnostics_are_told_as_they_are() {
    let body = oracle::report_bodies::block(BodyFrame::Principal);
    let mut invariants = body.invariants().clone();
    let expected = Expected {
        mass_normalised: true,
        free_surface: true,
        frame: BodyFrame::Principal,
        origin: Vector3::zeros(),
        eigenvalues: Some(&body.modes().eigenvalue),
        eigenvalue_noise: 0.0,
        eigenvalue_rounding: 0.0,
        turning: Turning::None,
    };
    let good = identities(&invariants, &expected);
    assert!(identities_text(&good).ends_with(&format!("all {} identities hold\n", good.len())));
    invariants.primary_mut().c1[(0, 0)] = f64::NAN;
    let bad = identities(&invariants, &expected);
    let failed = bad.iter().filter(|c| !c.passed).count();
    assert!(failed > 0);
    let table = identities_text(&bad);
    assert_eq!(table.matches("  FAILED\n").count(), failed);
    let array = identities_json(&bad);
    assert_eq!(array.as_array().unwrap().len(), bad.len());
    assert!(array.as_array().unwrap().iter().any(|c| c["value"].is_null() && c["passed"] == false));

    let found = diagnostics_json(&run_data().diagnostics);
    assert_eq!(
        (found["errors"].as_u64(), found["warnings"].as_u64(), found["notes"].as_u64()),
        (Some(0), Some(1), Some(1))
    );
    assert_eq!(found["diagnostics"][0]["code"], "FB510");
}

/// Returns a page with empty scripts, and the texts of the scripts.
fn without_scripts(html: &str) -> (String, Vec<String>) {
    let (mut page, mut scripts, mut rest) = (String::new(), Vec::new(), html);
    while let Some(start) = rest.find("<script") {
        let inside = start + rest[start..].find('>').expect("tag ends") + 1;
        let end = inside + rest[inside..].find("</script>").expect("script ends");
        page.push_str(&rest[..inside]);
        scripts.push(rest[inside..end].to_owned());
        rest = &rest[end..];
    }
    (page + rest, scripts)
}

/// Asserts that every element is closed in order, and that every `<` and `&` is markup.
fn well_formed(html: &str) {
    let (html, _) = without_scripts(html);
    let style = html.find("<style>").unwrap()..html.find("</style>").unwrap();
    let mut rest = html.replacen(&html[style.start + 7..style.end], "", 1);
    let mut open: Vec<String> = Vec::new();
    while let Some(start) = rest.find('<') {
        assert!(!rest[..start].contains('>'), "stray > in {}", &rest[..start]);
        let end = start + rest[start..].find('>').expect("tag ends");
        let tag = &rest[start + 1..end];
        let name: String =
            tag.trim_start_matches('/').chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
        if tag.starts_with('/') {
            assert_eq!(open.pop().as_deref(), Some(name.as_str()), "closing tag");
        } else if !(tag.starts_with('!') || tag.ends_with('/') || name == "meta") {
            assert!(!name.is_empty(), "not a tag: <{tag}>");
            open.push(name);
        }
        rest = rest[end + 1..].to_owned();
    }
    assert!(open.is_empty(), "left open: {open:?}");
    for (i, _) in html.match_indices('&') {
        let entity = html[i + 1..].split(';').next().unwrap();
        assert!(
            entity.len() < 8 && entity.chars().all(|c| c.is_ascii_alphanumeric() || c == '#'),
            "&{entity}"
        );
    }
}
