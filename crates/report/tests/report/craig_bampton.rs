//! Craig-Bampton bodies in reports and files.

use flexbody_body::basis::{BasisChoice, CraigChang};
use flexbody_body::invariants::BodyFrame;
use flexbody_model::Coupling;
use flexbody_report::{Facts, Format, RunData, render};
use oracle::brackets::bracket;
use oracle::craig_bampton::{body, close, converted, craig_bampton, fixed, model, record};

#[test]
fn reports_call_a_healthy_body_healthy() {
    let raw = bracket([Coupling::Rigid, Coupling::Averaging]);
    let model = model(raw);
    for (count, head) in [(10, "No fixed-interface mode is missing."), (0, "Static condensation.")] {
        let body = body(&model, count);
        let facts = Facts::new(&body, &RunData::default());
        let html = render(&facts, Format::Html);
        assert!(
            html.contains(head) && !html.contains("verdict open") && !html.contains("ot proved"),
            "{html}"
        );
        let text = render(&facts, Format::Text);
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let made_of = format!(
            "craig-bampton: {count} fixed-interface modes ({count} requested) + 12 interface motions - 6"
        );
        assert!(text.contains(&made_of) && text.contains("of the free body"), "{text}");
        assert!(text.contains("proved:") && !text.contains("NOT PROVED"), "{text}");
        let json: serde_json::Value = serde_json::from_str(&render(&facts, Format::Json)).expect("JSON");
        assert!(json["modes"]["worst_residual"].as_f64().expect("a number") < 1e-9);
        assert_eq!(json["completeness"]["verdict"], "proved");
        let own = &json["modes"]["craig_bampton"];
        assert_eq!(own["fixed_interface_modes"], count);
        assert_eq!(own["fixed_interface_asked"], count);
        let held: Vec<f64> = own["fixed_interface_hz"]
            .as_array()
            .expect("a list")
            .iter()
            .map(|hz| hz.as_f64().expect("a number"))
            .collect();
        let expected = fixed(&craig_bampton(&model, count));
        assert_eq!(held.len(), expected.len());
        for (hz, lambda) in held.iter().zip(&expected) {
            close(*hz, lambda.sqrt() / std::f64::consts::TAU, 1e-12, "held");
        }
        assert_eq!(text.contains("Hz (fixed-interface modes)"), count > 0, "{text}");
        assert!(!text.contains("x fixed-interface"), "{text}");
        assert_eq!(own["free_hz"].as_array().expect("a list").len(), body.n_modes());
    }
    let attached =
        converted(&model, BasisChoice::CraigChang(CraigChang::default()), 10, BodyFrame::Principal).body;
    let facts = Facts::new(&attached, &RunData::default());
    let (html, text) = (render(&facts, Format::Html), render(&facts, Format::Text));
    assert!(html.contains("No free mode is missing.") && html.contains("<td>static shape</td>"), "{html}");
    assert!(text.contains("static shapes are not modes"), "{text}");
    let json: serde_json::Value = serde_json::from_str(&render(&facts, Format::Json)).expect("JSON");
    assert!(json["modes"]["worst_residual"].as_f64().expect("a number") < 1e-8);
}

/// The record of the fixed-interface modes is stored in the file, follows a change of units, and is kept when
/// modes are selected.
#[test]
fn the_record_goes_with_the_body() {
    let body = body(&model(bracket([Coupling::Rigid, Coupling::Rigid])), 5);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("body.flex.h5");
    flexbody_file::write(&body, &path).expect("written");
    assert_eq!(record(&flexbody_file::read(&path).expect("read")), record(&body));
    let milliseconds = flexbody_base::units::UnitSystem::parse("mm", "t", "ms").expect("units");
    let other = flexbody_file::in_units(&body, &milliseconds).expect("in other units");
    let estimate = |body| &record(body).free.as_ref().expect("estimates").estimate;
    for (a, b) in estimate(&other).iter().zip(estimate(&body)) {
        close(*a, 1e-6 * b, 1e-14, "lambda");
    }
    let some = body.reduced(&[0, 2, 3], body.groups(), Vec::new()).expect("some modes");
    assert_eq!(*estimate(&some), [0, 2, 3].map(|j: usize| estimate(&body)[j]));
}
