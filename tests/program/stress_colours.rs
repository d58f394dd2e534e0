//! Pages that colour a body by stresses: of its modes, and the largest ones of load cases.

use crate::program::flexbody;
use crate::view::{browse, browser};
use faer::Mat;
use flexbody::{LoadedHistory, Progress, RecordedMotion, Recovered, Scene};
use flexbody_body::flex_body::{FlexBody, Interface, Recovery};
use flexbody_model::{Coupling, Quantity, RecoveryRow, StressPoint};
use oracle::fixtures;
use serde_json::Value;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use tempfile::TempDir;

const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Runs `flexbody`. Returns its exit status and both outputs.
fn run(folder: &Path, line: &str) -> (Option<i32>, String, String) {
    let run = flexbody(folder, &line.split_whitespace().collect::<Vec<_>>());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (run.status.code(), text(&run.stdout), text(&run.stderr))
}

fn done(folder: &Path, line: &str) -> String {
    let (code, out, said) = run(folder, line);
    assert_eq!(code, Some(0), "{line}: {out}{said}");
    out
}

/// Returns a stress of a mode at a node: smooth, with its largest value at another node in each mode.
fn stress(node: usize, k: usize, j: usize) -> f64 {
    let at = node as f64 + 1.7 * k as f64;
    (0.9 * at + 2.3 * j as f64).sin() * (1.0 + 0.1 * ((j + 1) * node % 7) as f64)
}

/// Returns a recovery with six rows for every id; `of` makes node and element of an id.
fn recovery(
    body: &FlexBody,
    name: &str,
    ids: &[i64],
    of: impl Fn(i64) -> (Option<i64>, Option<i64>),
) -> Recovery {
    let label = |(id, component): (&i64, &str)| RecoveryRow {
        name: format!("p{id} {component}"),
        quantity: Quantity::Stress,
        component: component.to_owned(),
        unit: "kPa".to_owned(),
        node: of(*id).0,
        element: of(*id).1,
    };
    let rows: Vec<RecoveryRow> = ids.iter().flat_map(|id| COMPONENTS.map(|c| label((id, c)))).collect();
    let n = rows.len();
    Recovery {
        name: name.to_owned(),
        offset: vec![0.0; n],
        modes: Mat::from_fn(n, body.n_modes(), |row, j| stress(row / 6, row % 6, j)),
        // Spin about x strains every second node, spin about z the others.
        spin: Mat::from_fn(n, 6, |row, k| match (row / 6 % 2, k) {
            (0, 0) | (1, 2) => 1e-2 * stress(row / 6, row % 6, 11 + k),
            _ => 0.0,
        }),
        loads: Vec::new(),
        named: Mat::zeros(n, 0),
        motion: Vec::new(),
        rows,
    }
}

/// Creates a folder with the body of a block with stresses at its nodes (two nodes less), and at elements.
fn block() -> (TempDir, FlexBody) {
    let folder = tempfile::tempdir().expect("a folder");
    let job = fixtures().join("small/abaqus_labels/job.inp");
    done(folder.path(), &format!("convert {} --units m,kg,s --modes 4 -o body.flex.h5", job.display()));
    let body = flexbody_file::read(folder.path().join("body.flex.h5")).expect("a body");
    let ids = &body.nodes().ids;
    let skin = recovery(&body, "skin", &ids[..ids.len() - 2], |id| (Some(id), None));
    let inside = recovery(&body, "inside", &[1, 2], |id| (None, Some(id)));
    let mut parts = body.into_parts();
    parts.recoveries = vec![inside, skin];
    let body = FlexBody::new(parts).expect("a body");
    flexbody_file::write(&body, folder.path().join("body.flex.h5")).expect("written");
    (folder, body)
}

/// Returns the element of a page with this id.
fn element<'p>(page: &'p str, id: &str) -> &'p str {
    let (_, after) = page.split_once(&format!("id=\"{id}\">")).unwrap_or_else(|| panic!("no {id}"));
    after.split_once("</script>").expect("an end").0
}

/// Returns the 16-bit numbers of an array of a page.
fn numbers(page: &str, id: &str) -> Vec<i16> {
    const LETTERS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let text = element(page, id).trim_end_matches('=');
    let (mut bytes, mut bits, mut count) = (Vec::new(), 0u32, 0);
    for letter in text.chars() {
        bits = bits << 6 | LETTERS.find(letter).expect("a letter of base64") as u32;
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    bytes.chunks_exact(2).map(|pair| i16::from_le_bytes([pair[0], pair[1]])).collect()
}

/// Returns rows of a table by the name of their point, with the value of one column.
fn column(folder: &Path, file: &str, name: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.join(file)).expect("a table");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().expect("a header");
    let at = head.iter().position(|known| *known == name).unwrap_or_else(|| panic!("{name}: {head:?}"));
    lines.map(|line| line[at].to_owned()).collect()
}

#[test]
fn modes_have_the_colours_of_their_equivalent_stress() {
    let (folder, body) = block();
    let said: Value =
        serde_json::from_str(&done(folder.path(), "view body.flex.h5 --recovery skin -o view.html --json"))
            .expect("JSON");
    assert_eq!(said["results"]["colours"], serde_json::json!(["skin: von Mises"]));
    let page = fs::read_to_string(folder.path().join("view.html")).expect("a page");
    let data: Value = serde_json::from_str(element(&page, "data")).expect("JSON");
    let field = &data["fields"][0];
    assert_eq!(field["unit"], "kPa per m of the largest displacement");
    assert_eq!((field["isPerMode"].as_bool(), data["startsWithField"].as_bool()), (Some(true), Some(true)));
    let (values, n) = (numbers(&page, "data-values"), body.n_nodes());
    assert_eq!(values.len(), n * body.n_modes());
    for j in 0..body.n_modes() {
        let size = body.largest_displacement(j);
        let expected =
            |node: usize| StressPoint::von_mises_of(&[0, 1, 2, 3, 4, 5].map(|k| stress(node, k, j))) / size;
        let largest = (0..n - 2).map(expected).fold(0.0, f64::max);
        let set = &field["sets"][j];
        assert!((set["largest"].as_f64().expect("a number") / largest - 1.0).abs() < 1e-14);
        let top = (0..n - 2).find(|node| expected(*node) == largest).expect("a node");
        assert_eq!(set["words"], format!("at node {}", body.nodes().ids[top]));
        let place = body.frame().to_model(body.nodes().positions[top]);
        assert_eq!(set["place"], serde_json::json!(place));
        for node in 0..n {
            let value = f64::from(values[j * n + node]);
            let wanted = if node < n - 2 { expected(node) / largest * 32767.0 } else { -1.0 };
            assert!((value - wanted).abs() <= 0.5 + 1e-6, "mode {j}, node {node}: {value} {wanted}");
        }
    }
}

/// FB563: a largest stress at a node of a rigid interface is pointed out, with the largest one away from all interfaces.
#[test]
fn a_largest_stress_at_a_rigid_interface_is_pointed_out() {
    let (folder, body) = block();
    let place = folder.path();
    let scene = "[run]\nduration = 0.002\noutputs = 10\n[initial]\nangular_velocity = [9, 0.5, 0]\n";
    fs::write(place.join("spin.toml"), scene).expect("written");
    let told = |file: &str, more: &str| -> Vec<String> {
        let run = done(place, &format!("simulate {file} --scene spin.toml --json{more}"));
        let run: Value = serde_json::from_str(&run).expect("JSON");
        let all = run["results"]["diagnostics"].as_array().expect("diagnostics").clone();
        let own = all.iter().filter(|one| one["code"] == "FB563");
        own.map(|one| one["message"].as_str().expect("a message").to_owned()).collect()
    };
    assert!(told("body.flex.h5", " --envelope all.csv").is_empty(), "the body has no rigid interface");
    // The nodes with the two largest stresses, in the recovery with nodes.
    let rows = column(place, "all.csv", "von_mises").into_iter().zip(column(place, "all.csv", "node"));
    let mut rows: Vec<(f64, i64)> = rows
        .filter(|(_, node)| !node.is_empty())
        .map(|(value, node)| (value.parse().expect("a number"), node.parse().expect("a node")))
        .collect();
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    let index = |id: i64| body.nodes().ids.iter().position(|known| *known == id).expect("a node");
    for (coupling, is_told) in [(Coupling::Rigid, true), (Coupling::Averaging, false)] {
        let mut parts = body.clone().into_parts();
        let nodes: Vec<usize> = rows[..3].iter().map(|(_, node)| index(*node)).collect();
        let reference = Some(body.nodes().positions[nodes[0]]);
        parts.interfaces =
            vec![Interface { name: "bore".to_owned(), nodes, coupling: Some(coupling), reference }];
        let body = FlexBody::new(parts).expect("a body");
        flexbody_file::write(&body, place.join("held.flex.h5")).expect("written");
        let found = told("held.flex.h5", " --envelope held.csv");
        assert_eq!(found.len(), usize::from(is_told), "{found:?}");
        if let [message] = &found[..] {
            let [(_, top), away] = [rows[0], rows[3]];
            assert!(message.contains(&format!("at node {top} of the rigid interface `bore`")), "{message}");
            let value: f64 = format!("{:.4e}", away.0).parse().expect("a number");
            assert!(
                message.contains(&format!("away from interfaces is {value} kPa, p{}", away.1)),
                "{message}"
            );
            assert!(
                told("held.flex.h5", "")[0].contains("--envelope finds"),
                "without the stresses of all points"
            );
        }
    }
}

/// The envelope over load cases is the largest of those of each case; reports and pages draw it and mark it.
#[test]
fn the_envelope_is_that_of_all_load_cases() {
    let (folder, body) = block();
    let case = |name: &str, spin: &str| {
        format!("[[case]]\nname = \"{name}\"\n[case.initial]\nangular_velocity = [{spin}]\n")
    };
    let (slow, fast) = (case("slow-x", "9, 0.5, 0"), case("fast", "0.5, 0, 9"));
    let scene = |cases: &str| format!("[run]\nduration = 0.002\noutputs = 10\n{cases}");
    fs::write(folder.path().join("spin.toml"), scene(&(slow.clone() + &fast))).expect("written");
    fs::write(folder.path().join("other.toml"), scene(&(fast + &slow))).expect("written");
    let report = "--envelope all.csv --report run.html --json";
    let said = done(folder.path(), &format!("simulate body.flex.h5 --scene spin.toml {report}"));
    done(folder.path(), "simulate body.flex.h5 --scene other.toml --envelope other.csv");
    done(folder.path(), "simulate body.flex.h5 --scene spin.toml --case fast --envelope fast.csv");
    let only_slow = flexbody(
        folder.path(),
        &["simulate", "body.flex.h5", "--scene", "spin.toml", "--case", "slow-x", "--envelope", "slow.csv"],
    );
    assert!(only_slow.status.success());
    let parsed = |file: &str, name: &str| -> Vec<f64> {
        column(folder.path(), file, name).iter().map(|text| text.parse().expect("a number")).collect()
    };
    for name in ["von_mises", "largest_principal", "smallest_principal"] {
        let [all, slow, fast] = ["all.csv", "slow.csv", "fast.csv"].map(|file| parsed(file, name));
        assert_eq!(all.len(), 2 + body.n_nodes() - 2);
        let expected = slow.iter().zip(&fast).map(|(a, b)| match name {
            "smallest_principal" => a.min(*b),
            _ => a.max(*b),
        });
        assert_eq!(all, expected.collect::<Vec<f64>>(), "{name}");
        assert_eq!(all, parsed("other.csv", name), "{name}: in any order of the cases");
    }
    let [slow, fast] = ["slow.csv", "fast.csv"].map(|file| parsed(file, "von_mises"));
    let text = fs::read_to_string(folder.path().join("all.csv")).expect("a table");
    let of_fast = |at: usize| fast[at] > slow[at];
    assert!((0..fast.len()).any(of_fast) && !(0..fast.len()).all(of_fast), "{slow:?} {fast:?}");
    for (at, line) in text.lines().skip(1).enumerate() {
        // The first of the three columns of cases is that of the equivalent stress.
        let cases = line.splitn(12, ',').last().expect("cases");
        let case = if of_fast(at) { "fast," } else { "slow-x," };
        assert!(cases.starts_with(case), "{line}");
    }
    // The summary, the reports of both cases and the page have the same largest value.
    let values = &parsed("all.csv", "von_mises")[2..];
    let top = (0..values.len()).fold(0, |top, at| if values[at] > values[top] { at } else { top });
    let said: Value = serde_json::from_str(&said).expect("JSON");
    let of_skin = &said["results"]["envelope"]["recoveries"][1];
    assert_eq!((of_skin["name"].as_str(), of_skin["von_mises"].as_f64()), (Some("skin"), Some(values[top])));
    let (case, words) =
        if of_fast(top + 2) { ("fast", "of load case `fast`") } else { ("slow-x", "of load case `slow-x`") };
    assert_eq!((&of_skin["case"], &of_skin["node"]), (&case.into(), &body.nodes().ids[top].into()));
    done(folder.path(), "view body.flex.h5 --envelope all.csv -o view.html");
    let mut pages = vec![(folder.path().join("view.html"), 0)];
    let reports = fs::read_dir(folder.path()).expect("a folder").map(|file| file.expect("a file").path());
    pages.extend(reports.filter(|path| path.to_string_lossy().contains("run-")).map(|path| (path, 1)));
    assert_eq!(pages.len(), 3);
    for (path, field) in pages {
        let page = fs::read_to_string(&path).expect("a page");
        let data: Value = serde_json::from_str(element(&page, "data")).expect("JSON");
        let shown = &data["fields"][field]["sets"][0];
        assert_eq!(shown["largest"].as_f64(), Some(values[top]), "{}", path.display());
        assert!(shown["words"].as_str().expect("words").ends_with(words), "{shown}");
        assert_eq!(data["fields"][field]["unit"], "kPa");
        // Stresses of elements cannot be drawn, and the page says so.
        assert!(page.contains("recovery inside is not drawn: its points belong to elements"));
    }
}

#[test]
fn stresses_that_cannot_be_drawn_are_refused_with_the_reason() {
    let (folder, _) = block();
    fs::write(folder.path().join("spin.toml"), "[run]\nduration = 0.001\noutputs = 2\n").expect("written");
    done(folder.path(), "simulate body.flex.h5 --scene spin.toml --envelope env.csv -o run.h5");
    let table = fs::read_to_string(folder.path().join("env.csv")).expect("a table");
    let without_skin: Vec<&str> = table.lines().filter(|line| !line.starts_with("skin,")).collect();
    fs::write(folder.path().join("inside.csv"), without_skin.join("\n") + "\n").expect("written");
    let foreign = table.replace(",kPa,", ",MPa,").replacen(",MPa,", ",kPa,", 1);
    fs::write(folder.path().join("units.csv"), foreign).expect("written");
    let numbers = "recovery,point,node,unit,von_mises\nskin,p,1,kPa,-2\n";
    fs::write(folder.path().join("negative.csv"), numbers).expect("written");
    let strangers = "recovery,point,node,unit,von_mises\nskin,p,999999,kPa,2\n";
    fs::write(folder.path().join("strangers.csv"), strangers).expect("written");
    for (options, code, part) in [
        ("--recovery inside", "FB221", "its points belong to elements, and only nodes are drawn"),
        ("--recovery gone", "FB221", "the body has no recovery `gone`"),
        ("--envelope inside.csv", "FB221", "recovery inside is not drawn"),
        ("--envelope strangers.csv", "FB221", "its nodes are not nodes of the body"),
        ("--envelope units.csv", "FB204", "has stresses in"),
        ("--envelope negative.csv", "FB204", "an equivalent stress from 0"),
        ("--envelope spin.toml", "FB203", ""),
    ] {
        let (exit, _, said) = run(folder.path(), &format!("view body.flex.h5 {options} -o view.html"));
        assert_eq!(exit, Some(2), "{options}: {said}");
        assert!(said.contains(code) && said.contains(part), "{options}: {said}");
        assert!(!folder.path().join("view.html").exists());
    }
    let (exit, _, said) =
        run(folder.path(), "view body.flex.h5 --simulation run.h5 --recovery skin -o view.html");
    assert_eq!(exit, Some(2), "{said}");
    // The largest stresses of a simulation colour its motion.
    done(folder.path(), "view body.flex.h5 --simulation run.h5 --envelope env.csv -o motion.html");
    let page = fs::read_to_string(folder.path().join("motion.html")).expect("a page");
    let data: Value = serde_json::from_str(element(&page, "data")).expect("JSON");
    assert!(data["motion"].is_object() && data["fields"].as_array().is_some_and(|all| all.len() == 1));
}

/// The library draws the pages and writes the envelope of the command; it refuses load cases that do not fit each other.
#[test]
fn the_library_draws_the_pages_of_the_command() {
    let (folder, _) = block();
    let path = |name: &str| folder.path().join(name);
    let case = |name: &str, spin: &str| {
        format!("[[case]]\nname = \"{name}\"\n[case.initial]\nangular_velocity = [{spin}]\n")
    };
    let cases = case("slow-x", "9, 0.5, 0") + &case("fast", "0.5, 0, 9");
    fs::write(path("spin.toml"), format!("[run]\nduration = 0.002\noutputs = 10\n{cases}")).expect("written");
    done(folder.path(), "simulate body.flex.h5 --scene spin.toml --envelope command.csv");
    done(folder.path(), "simulate body.flex.h5 --scene spin.toml --case fast -o fast.h5");
    done(folder.path(), "view body.flex.h5 --recovery skin -o modes.html");
    done(folder.path(), "view body.flex.h5 --envelope command.csv -o still.html");
    done(folder.path(), "view body.flex.h5 --envelope command.csv --simulation fast.h5 -o motion.html");
    let body = flexbody::FlexBody::read(path("body.flex.h5")).expect("a body");
    let page = |name: &str| fs::read_to_string(path(name)).expect("a page");
    assert_eq!(body.view_recovery("skin", None).expect("a page").html(), page("modes.html"));
    let motion = RecordedMotion::read(path("fast.h5")).expect("a motion");
    let table = path("command.csv");
    assert_eq!(body.view_envelope(&table, None, None).expect("a page").html(), page("still.html"));
    let moving = body.view_envelope(&table, Some(&motion), None).expect("a page");
    assert_eq!(moving.html(), page("motion.html"));
    let go_on = |_: Progress<'_>| ControlFlow::Continue(());
    let recovered = |case: &str| {
        let scene = Scene::read_case(path("spin.toml"), Some(case)).expect("a scene");
        let motion = body.simulate_with_envelope(&scene, &go_on).expect("a motion");
        motion.recovered().expect("recoveries")
    };
    let (slow, fast) = (recovered("slow-x"), recovered("fast"));
    let write =
        |cases: &[(&str, &Recovered)]| Recovered::write_envelope_of_cases(cases, &body, path("library.csv"));
    write(&[("slow-x", &slow), ("fast", &fast)]).expect("written");
    assert_eq!(page("library.csv"), page("command.csv"));
    let history = LoadedHistory::new(vec![0.0], vec![vec![0.0; body.n_modes()]]).expect("a history");
    let history = history.angular_velocity(&[[0.0; 3]]).expect("a spin");
    let skin = body.recover(&history, &["skin"]).expect("rows");
    let refused = |cases: &[(&str, &Recovered)]| write(cases).expect_err("refused").to_string();
    let other = refused(&[("slow-x", &slow), ("skin", &skin)]);
    assert!(other.contains("FB804") && other.contains("other recoveries or points"), "{other}");
    assert!(refused(&[("fast", &slow), ("fast", &fast)]).contains("two load cases have the name `fast`"));
}

/// A browser draws the colours, the scale with its unit and the mark of the largest value without errors.
#[test]
fn a_browser_draws_the_colours() {
    let Some(browser) = browser() else {
        eprintln!("no Chromium on the PATH: the page is not drawn");
        return;
    };
    let (folder, _) = block();
    fs::write(
        folder.path().join("spin.toml"),
        "[run]\nduration = 0.001\noutputs = 2\n[initial]\nangular_velocity = [9, 5, 1]\n",
    )
    .expect("written");
    done(
        folder.path(),
        "simulate body.flex.h5 --scene spin.toml --envelope env.csv -o run.h5 --report run.html",
    );
    done(folder.path(), "view body.flex.h5 --envelope env.csv -o still.html");
    done(folder.path(), "view body.flex.h5 --envelope env.csv --simulation run.h5 -o motion.html");
    done(folder.path(), "view body.flex.h5 --recovery skin -o modes.html");
    done(folder.path(), "inspect body.flex.h5 --report body.html");
    for (name, asked, part) in [
        ("run.html", "", "data-field=\"skin: largest von Mises of the run\""),
        ("still.html", "", "data-field=\"skin: largest von Mises of the run\""),
        ("motion.html", "#time=0.0005", "data-field=\"skin: largest von Mises of the run\""),
        ("modes.html", "#mode=2&phase=0.25", "data-field=\"skin: von Mises\""),
        ("body.html", "#mode=2&phase=0.25", "data-field=\"\""),
        ("body.html", "#mode=2&phase=0.25&colours=1", "data-field=\"skin: von Mises\""),
    ] {
        let (document, said) = browse(&browser, &folder.path().join(name), asked, &["--dump-dom"]);
        assert!(!said.contains("CONSOLE"), "{name}: {said}");
        assert!(!document.contains("data-failed="), "{name}");
        assert!(document.contains(part) && document.contains("data-drawn=\"surface\""), "{name}: {document}");
        if !part.ends_with("=\"\"") {
            assert!(document.contains("Largest: ") && document.contains("; marked."), "{name}");
            let (_, most) = document.split_once("id=\"most\">").expect("a scale");
            assert!(most.split_once('<').is_some_and(|(text, _)| text.contains(" kPa")), "{name}");
        }
    }
}
