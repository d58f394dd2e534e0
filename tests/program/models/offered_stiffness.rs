//! Line of the summary that names `--geometric-stiffness` where the deck describes its elements.

use crate::program::flexbody;
use std::path::Path;

/// Option and loads that the line of the bracket names.
const OFFER: &str = "--geometric-stiffness spin,interfaces computes it from the elements of the deck";

/// Converts a model of the fixtures with four modes and `more` words. Returns the summary on one line.
fn summary(model: &str, more: &[&str]) -> String {
    let place = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = root.join("fixtures/models").join(model).join("model.toml");
    let manifest = manifest.to_str().expect("text");
    let words = ["convert", manifest, "--modes", "4", "-o", "body.flex.h5"];
    let run = flexbody(place.path(), &[&words[..], more].concat());
    let text = String::from_utf8(run.stdout).expect("text");
    assert!(run.status.success(), "{text}{}", String::from_utf8_lossy(&run.stderr));
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn the_summary_names_the_option_where_the_deck_describes_its_elements() {
    let told = summary("bracket_hex20", &[]);
    assert!(told.contains("spin no geometric stiffness") && told.contains(OFFER), "{told}");
    // A stated choice has no further line.
    let without = summary("bracket_hex20", &["--geometric-stiffness", "none"]);
    assert!(without.contains("spin no geometric stiffness"), "{without}");
    assert!(!without.contains("--geometric-stiffness"), "{without}");
    let with = summary("bracket_hex20", &["--geometric-stiffness", "spin"]);
    assert!(with.contains("stress K spin, from"), "{with}");
    assert!(!with.contains("--geometric-stiffness"), "{with}");
    // The manifest names no elements.
    let unknown = summary("bar_c3d8r", &[]);
    assert!(!unknown.contains("--geometric-stiffness"), "{unknown}");
}
