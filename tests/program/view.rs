//! Page of `flexbody view`: its contents, and its display in a browser.

use crate::program::flexbody;
use flexbody_body::flex_body::{FlexBody, SurfaceMesh};
use flexbody_file::{self, read_simulation};
use flexbody_report::{Facts, Format, RunData, View, render};
use oracle::file_bodies::{Random, parts};
use oracle::fixtures;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Runs `flexbody`, asserts that it succeeds, and returns its output.
fn done(folder: &Path, line: &str) -> String {
    let run = flexbody(folder, &line.split_whitespace().collect::<Vec<_>>());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(run.status.success(), "{line}: {}{}", text(&run.stdout), text(&run.stderr));
    text(&run.stdout)
}

/// Creates a folder with the body of the block of `fixtures/small/abaqus_labels` as `body.flex.h5`.
fn block(options: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let job = fixtures().join("small/abaqus_labels/job.inp");
    let job = job.to_str().expect("a path in UTF-8");
    let interface = "--interface left=Left,rigid";
    done(
        folder.path(),
        &format!("convert {job} --units m,kg,s --modes 4 {interface} -o body.flex.h5 {options}"),
    );
    folder
}

/// Option for residual vectors of loads at the interface, in addition to the free modes.
const WITH_RESIDUAL_VECTORS: &str = "--residual-vectors interfaces";

/// Returns the element of a page with this id.
fn element(page: &str, id: &str) -> String {
    let (_, after) = page.split_once(&format!("id=\"{id}\">")).unwrap_or_else(|| panic!("no {id}"));
    after.split_once("</script>").expect("an end").0.to_owned()
}

#[test]
fn the_page_has_everything_in_it() {
    let folder = block(WITH_RESIDUAL_VECTORS);
    let said: Value =
        serde_json::from_str(&done(folder.path(), "view body.flex.h5 -o view.html --json")).expect("JSON");
    let facts = &said["results"];
    assert_eq!((facts["drawn"].as_str(), facts["triangles"].as_u64()), (Some("surface"), Some(20)));
    let page = fs::read_to_string(folder.path().join("view.html")).expect("a page");
    assert_eq!(facts["bytes"].as_u64(), Some(page.len() as u64));
    // The page loads nothing from elsewhere.
    for mark in ["http:", "https:", "src=", "@import", "url(", "{{"] {
        assert!(!page.contains(mark), "{mark}");
    }
    let data: Value = serde_json::from_str(&element(&page, "data")).expect("JSON");
    let modes = data["modes"].as_array().expect("modes");
    assert_eq!(modes.len() as u64, facts["modes"].as_u64().expect("a count"));
    let statics =
        modes.iter().filter(|mode| mode["kind"].as_str().expect("a text").starts_with("residual vector"));
    assert!(statics.count() > 0, "residual vectors are named as such");
    assert_eq!(data["interfaces"][0]["name"], "left");
    assert_eq!(data["interfaces"][0]["nodes"].as_array().map(Vec::len), Some(4));
    // Base64 writes three bytes as four letters: a position has six bytes per node, a shape six bytes per
    // node and mode.
    let nodes = facts["drawn_nodes"].as_u64().expect("a count") as usize;
    assert_eq!(element(&page, "data-positions").len(), (6 * nodes).div_ceil(3) * 4);
    assert_eq!(element(&page, "data-shapes").len(), (6 * nodes * modes.len()).div_ceil(3) * 4);
    assert_eq!(element(&page, "data-triangles").len(), 20 * 6 / 3 * 4);
}

/// A body without a surface is drawn as points; the number of triangles can be reduced; equal commands write
/// equal pages.
#[test]
fn pages_draw_what_there_is() {
    let points = block("--no-mesh");
    let said = done(points.path(), "view body.flex.h5 -o view.html");
    assert!(said.contains("points on 12 of 12 nodes"), "{said}");
    let folder = block("");
    let said = done(folder.path(), "view body.flex.h5 -o few.html --triangles 12");
    assert!(said.contains("triangles of the surface on "), "{said}");
    for name in ["a.html", "b.html"] {
        done(folder.path(), &format!("view body.flex.h5 -o {name}"));
    }
    let [a, b] = ["a.html", "b.html"].map(|name| fs::read(folder.path().join(name)).expect("a page"));
    assert!(a == b);
}

/// A simulation is played only with its own body.
#[test]
fn simulations_are_played_by_their_body() {
    let folder = block("");
    let scene = "[initial]\nangular_velocity = [0, 0, 50]\n[run]\nduration = 0.01\noutputs = 20\n";
    fs::write(folder.path().join("spin.toml"), scene).expect("written");
    done(folder.path(), "simulate body.flex.h5 --scene spin.toml -o spin.h5");
    let said = done(folder.path(), "view body.flex.h5 --simulation spin.h5 -o spin.html");
    assert!(said.contains("a simulation of 21 instants"), "{said}");
    let page = fs::read_to_string(folder.path().join("spin.html")).expect("a page");
    assert_eq!(element(&page, "data-times").len(), (4 * 21usize).div_ceil(3) * 4);
    // The colour scale reaches the largest deflection, which may lie between the output times.
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let motion = flexbody_file::read_simulation(folder.path().join("spin.h5")).expect("a motion");
    let shape = &body.modes().shape;
    let deflection = |q: &[f64], node: usize| {
        let along = |k: usize| q.iter().enumerate().map(|(j, q)| q * shape[(3 * node + k, j)]).sum::<f64>();
        (0..3).map(|k| along(k).powi(2)).sum::<f64>().sqrt()
    };
    let instants = motion.q.chunks(motion.modes);
    let seen =
        instants.flat_map(|q| (0..body.n_nodes()).map(move |node| deflection(q, node))).fold(0.0, f64::max);
    let data: Value = serde_json::from_str(&element(&page, "data")).expect("JSON");
    let largest = data["motion"]["largest"].as_f64().expect("a number");
    assert!((0.999 * seen..2.0 * seen).contains(&largest), "{largest} {seen}");
    let other = block(WITH_RESIDUAL_VECTORS);
    fs::copy(folder.path().join("spin.h5"), other.path().join("spin.h5")).expect("copied");
    for (line, part) in [
        ("view body.flex.h5 --simulation spin.h5 -o view.html", "error[FB735]"),
        ("view body.flex.h5 --simulation body.flex.h5 -o view.html", "error[FB734]"),
    ] {
        let run = flexbody(other.path(), &line.split_whitespace().collect::<Vec<_>>());
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(run.status.code() == Some(2) && said.contains(part), "{line}: {said}");
        assert!(!other.path().join("view.html").exists());
    }
}

/// A damaged file of a simulation is refused, or read as it was written: never as another motion.
#[test]
fn damaged_simulations_are_refused() {
    let folder = block("");
    fs::write(folder.path().join("spin.toml"), "[run]\nduration = 0.001\noutputs = 2\n").expect("written");
    done(folder.path(), "simulate body.flex.h5 --scene spin.toml -o spin.h5");
    let whole = fs::read(folder.path().join("spin.h5")).expect("a file");
    let right = read_simulation(folder.path().join("spin.h5")).expect("a motion");
    let path = folder.path().join("damaged.h5");
    for k in 0..300usize {
        let mut bytes = whole.clone();
        // The damaged positions are a fixed sequence, spread over the file.
        let at = k * 7919 % whole.len();
        match k % 3 {
            0 => bytes.truncate(at),
            1 => bytes[at] ^= 0xff,
            _ => bytes[at..(at + 8).min(whole.len())].fill(0xff),
        }
        fs::write(&path, bytes).expect("written");
        // Damage in unused bytes is not seen.
        if let Ok(motion) = read_simulation(&path) {
            assert_eq!(motion, right, "damage {k} at byte {at}");
        }
    }
}

/// A body carried at an interface is drawn in its carried form.
#[test]
fn carried_bodies_are_drawn_as_they_are_carried() {
    let folder = block("");
    let scene =
        "gravity = [0, 0, -9.81]\n[carried]\ninterface = \"left\"\n[run]\nduration = 0.001\noutputs = 4\n";
    fs::write(folder.path().join("hang.toml"), scene).expect("written");
    done(folder.path(), "simulate body.flex.h5 --scene hang.toml -o hang.h5");
    done(folder.path(), "view body.flex.h5 --simulation hang.h5 -o hang.html");
    let page = fs::read_to_string(folder.path().join("hang.html")).expect("a page");
    let data: Value = serde_json::from_str(&element(&page, "data")).expect("JSON");
    // The interface is at rest in the frame of the scene.
    let motion = data["interfaces"][0]["motion"].as_array().expect("numbers");
    let largest =
        data["modes"].as_array().expect("modes").iter().map(|m| m["largest"].as_f64().expect("a number"));
    let largest = largest.fold(0.0, f64::max);
    assert!(motion.iter().all(|x| x.as_f64().expect("a number").abs() < 1e-9 * largest), "{motion:?}");
}

/// Returns a plate with 100,000 nodes and 20 modes.
fn plate() -> FlexBody {
    let (rows, columns) = (250usize, 400usize);
    let mut parts = parts(Random::new(3), rows * columns, 20, 0, 0);
    let at = |i: usize, j: usize| (i * columns + j) as u32;
    let place = |k: usize| [(k / columns) as f64, (k % columns) as f64, 0.0];
    parts.nodes.positions = (0..rows * columns).map(place).collect();
    let cells = (0..rows - 1).flat_map(|i| (0..columns - 1).map(move |j| (i, j)));
    let halves = |(i, j): (usize, usize)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let triangles: Vec<[u32; 3]> = cells.flat_map(halves).collect();
    parts.mesh = SurfaceMesh::new(triangles, Vec::new(), rows * columns).ok();
    FlexBody::new(parts).expect("a body")
}

/// A large surface is thinned to the size limit of a page.
#[test]
fn a_hundred_thousand_nodes_fit_into_a_page() {
    let body = plate();
    let view = View::new(&body, None, None, None).expect("a page");
    assert!((5_000_000..10_000_000).contains(&view.html().len()), "{}", view.html().len());
    let report = render(&Facts::new(&body, &RunData::default()), Format::Html).len();
    assert!((1_500_000..4_000_000).contains(&report), "{report}");
}

/// Returns a browser of this machine, if there is one.
pub fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    std::env::split_paths(&path)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|file| file.is_file())
}

/// Number of attempts to start a browser: on a machine that is busy with other work its processes may end each other.
const ATTEMPTS: usize = 3;

/// Returns the document and the messages of the browser for a page; with an option for a screenshot it writes
/// that instead. A page always has a document: a browser that prints none has not come so far, and is started again.
pub fn browse(browser: &Path, page: &Path, asked: &str, options: &[&str]) -> (String, String) {
    let (mut document, mut messages) = browse_once(browser, page, asked, options);
    for _ in 1..ATTEMPTS {
        if !document.is_empty() || !options.contains(&"--dump-dom") {
            break;
        }
        (document, messages) = browse_once(browser, page, asked, options);
    }
    (document, messages)
}

fn browse_once(browser: &Path, page: &Path, asked: &str, options: &[&str]) -> (String, String) {
    let own = tempfile::tempdir().expect("a folder");
    let usual = "--headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic \
        --no-first-run --disable-background-networking --disable-component-update --disable-sync --enable-logging=stderr";
    let run = Command::new(browser)
        .args(usual.split_whitespace())
        .arg(format!("--user-data-dir={}", own.path().display()))
        .args(options)
        .arg(format!("file://{}{asked}", page.display()))
        .stdin(Stdio::null())
        .output()
        .expect("the browser runs");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (text(run.stdout), text(run.stderr))
}

/// A browser draws the body of a report without errors, written by the run or from the file.
#[test]
fn a_browser_draws_the_body_of_a_report() {
    let Some(browser) = browser() else {
        eprintln!("no Chromium on the PATH: the report is not drawn");
        return;
    };
    let folder = block("--report run.html");
    done(folder.path(), "inspect body.flex.h5 --report file.html");
    for name in ["run.html", "file.html"] {
        let page = folder.path().join(name);
        let (document, said) = browse(&browser, &page, "#mode=2&phase=0.25", &["--dump-dom"]);
        assert!(!said.contains("CONSOLE"), "{said}");
        for part in ["data-live", "data-drawn=\"surface\"", "data-mode=\"2\"", "<option value=\"3\">4: "] {
            assert!(document.contains(part), "{part}: {document}");
        }
        assert!(!document.contains("data-failed="), "{document}");
    }
    // The pictures of the run and of the file are equal.
    let [run, file] =
        ["run.html", "file.html"].map(|name| fs::read_to_string(folder.path().join(name)).expect("a report"));
    for id in ["data", "data-positions", "data-shapes", "data-triangles"] {
        assert_eq!(element(&run, id), element(&file, id), "{id}");
    }
}

/// A page reports the time of its frames for a body of any size.
#[test]
#[ignore = "slow"]
fn a_browser_turns_a_hundred_thousand_nodes() {
    let Some(browser) = browser() else {
        eprintln!("no Chromium on the PATH: no frame is drawn");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("plate.html");
    fs::write(&page, View::new(&plate(), None, None, None).expect("a page").html()).expect("written");
    let (document, said) = browse(&browser, &page, "#mode=3&frames=20", &["--dump-dom"]);
    assert!(!said.contains("CONSOLE"), "{said}");
    let (_, rest) = document.split_once("data-frame-time=\"").expect("the time of a frame");
    let (time, _) = rest.split_once(" ms\"").expect("milliseconds");
    println!("{time} ms for a frame of 100,000 nodes");
    assert!(time.parse::<f64>().is_ok_and(|time| time > 0.0), "{time}");
}

/// The page draws without errors; two phases of a mode look different, and one phase drawn twice looks equal.
#[test]
#[ignore = "slow"]
fn a_browser_draws_the_page() {
    let Some(browser) = browser() else {
        eprintln!("no Chromium on the PATH: the page is not drawn");
        return;
    };
    let folder = block("");
    done(folder.path(), "view body.flex.h5 -o view.html");
    let page = folder.path().join("view.html");
    let (document, said) = browse(&browser, &page, "#mode=2&phase=0.25", &["--dump-dom"]);
    assert!(!said.contains("CONSOLE"), "{said}");
    assert!(
        document.contains("data-drawn=\"surface\"") && document.contains("data-mode=\"2\""),
        "{document}"
    );
    assert!(!document.contains("data-failed"), "{document}");
    let scene = "[initial]\nangular_velocity = [0, 0, 50]\n[run]\nduration = 0.01\noutputs = 20\n";
    fs::write(folder.path().join("spin.toml"), scene).expect("written");
    done(folder.path(), "simulate body.flex.h5 --scene spin.toml -o spin.h5");
    done(folder.path(), "view body.flex.h5 --simulation spin.h5 -o spin.html");
    let (document, said) = browse(&browser, &folder.path().join("spin.html"), "#time=0.005", &["--dump-dom"]);
    assert!(!said.contains("CONSOLE"), "{said}");
    assert!(document.contains("<output id=\"now\">0.005 s</output>"), "{document}");
    let picture = |name: &str, asked: &str| {
        let file = folder.path().join(name);
        let shot = format!("--screenshot={}", file.display());
        browse(&browser, &page, asked, &[&shot, "--window-size=800,600"]);
        fs::read(file).expect("a picture")
    };
    let up = picture("up.png", "#mode=1&phase=0.25");
    assert!(up != picture("down.png", "#mode=1&phase=0.75"), "the body moves");
    assert!(up == picture("again.png", "#mode=1&phase=0.25"), "the same instant looks the same");
}
