//! Keyword decks: names with dots and blanks, unresolved sets, files named by cards, matrices of other steps
//! and other jobs.

use flexbody_base::diagnostic::Code;
use flexbody_base::error::Error;
use flexbody_input::{InterfaceSource, ModelFiles, read_model};
use flexbody_model::RawModel;
use oracle::fixtures;
use oracle::jobs::{body, job, set};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Copies a small job with a changed deck.
fn changed(name: &str, change: impl Fn(&str) -> String) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in fs::read_dir(fixtures().join("small").join(name)).expect("a folder") {
        let path = entry.expect("a file").path();
        fs::copy(&path, folder.path().join(path.file_name().expect("a name"))).expect("copied");
    }
    let path = folder.path().join("job.inp");
    let text = fs::read_to_string(&path).expect("a deck");
    fs::write(&path, change(&text)).expect("written");
    (folder, path)
}

fn read(path: &Path, interfaces: Vec<InterfaceSource>) -> Result<RawModel, Error> {
    read_model(&ModelFiles::from_job(path, None, interfaces, Some("m,kg,s")).expect("files"))
}

fn nodes(path: &Path, name: &str) -> Vec<i64> {
    let mut raw = read(path, vec![set("a", name)]).unwrap_or_else(|error| panic!("{name}: {error}"));
    raw.data.interfaces.remove(0).nodes
}

/// Without instances a dot belongs to the name of a set; blanks are ignored.
#[test]
fn sets_of_a_deck_without_instances_may_have_dots() {
    let sets = "*NSET, NSET=TIP.1\n5, 35\n*NSET, NSET=A.1\nTIP.1, 75\n*NSET,NSET=A B\na.1\n*MATERIAL";
    let (_folder, path) = changed("calculix_shells", |text| text.replace("*MATERIAL", sets));
    let raw = read(&path, vec![set("tip", "tip.1"), set("all", "A.1"), set("blank", "AB")]).expect("read");
    let of = |at: usize| raw.data.interfaces[at].nodes.clone();
    // A set on a line takes the nodes on both faces: two of each, and of 75, which has no row of its own.
    assert_eq!((&of(0)[..2], of(0).len()), (&[5, 35][..], 6));
    assert_eq!((&of(1)[..6], of(1).len()), (&of(0)[..], 8));
    assert_eq!(of(1), of(2));
}

/// An unresolved set, or a set that contains one, is an error only if it is requested.
#[test]
fn sets_that_cannot_be_resolved_are_told_when_they_are_asked_for() {
    let sets = "*NSET, NSET=BROKEN\n5, NOWHERE\n*NSET, NSET=MADE\nBROKEN\n*NSET, NSET=BY, ELSET=NONE\n*ELSET, ELSET=ODD\n1, NONE\n*MATERIAL";
    let (_folder, path) = changed("calculix_shells", |text| text.replace("*MATERIAL", sets));
    assert_eq!(nodes(&path, "LEFT").len(), 8);
    for (name, part) in [("BROKEN", "`NOWHERE`"), ("made", "`BROKEN`"), ("BY", "`NONE`")] {
        let error = read(&path, vec![set("a", name)]).expect_err(name);
        assert!(error.has(Code::DeckSyntax) && error.to_string().contains(part), "{name}: {error}");
    }
}

const ASSEMBLY: &str = "*Part, name=P\n*Node\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n\
    *Element, type=C3D4, elset=E\n1, 1, 2, 3, 4\n*Nset, nset=TIP\n3, 4\n*Nset, nset=X.2\n1\n*End Part\n\
    *Part, name=Q\n*Node\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n\
    *Element, type=C3D4\n1, 1, 2, 3, 4\n*Nset, nset=BASE\n2, 3\n*EndPart\n\
    *Assembly, name=All\n*Instance, name=A, part=P\n*Nset, nset=INNER\n2\n*End Instance\n\
    *Instance, name=B, part=P\n5., 0., 0.\n*EndInstance\n*Instance, name=C, part=Q\n0., 5., 0.\n*End Instance\n\
    *Nset, nset=DOTTED\nA.1, B.1\n*Nset, nset=OF_SETS\nb.tip, C.BASE, A.X.2\n*Nset, nset=ONE, instance=B\nTIP, 1\n\
    *Nset, nset=FACES, elset=E, instance=B\n*Nset, nset=BOTH\nDOTTED, ONE\n*Nset, nset=LOST, instance=D\n1\n*End Assembly\n";

/// Sets of the assembly name nodes and sets of instances, and interfaces do so too: `A.TIP`. A name that two
/// instances share is refused.
#[test]
fn sets_of_instances_are_named_with_their_instance() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("job.inp");
    fs::write(&path, ASSEMBLY).expect("written");
    let rows: String = [1, 2, 3, 4, 11, 12, 13, 14, 21, 22, 23, 24]
        .iter()
        .flat_map(|node| (1..=3).map(move |k| format!("{node},{k}, {node},{k}, 1.0\n")))
        .collect();
    for name in ["job_STIF1.mtx", "job_MASS1.mtx"] {
        fs::write(folder.path().join(name), &rows).expect("written");
    }
    for (name, expected) in [
        ("DOTTED", vec![1, 11]),
        ("OF_SETS", vec![13, 14, 22, 23, 1]),
        ("ONE", vec![13, 14, 11]),
        ("FACES", vec![11, 12, 13, 14]),
        ("BOTH", vec![1, 11, 13, 14]),
        ("A.TIP", vec![3, 4]),
        ("b.TIP", vec![13, 14]),
        ("BASE", vec![22, 23]),
        ("C.BASE", vec![22, 23]),
        ("INNER", vec![2]),
        ("B.X.2", vec![11]),
    ] {
        let mut own = nodes(&path, name);
        let mut expected = expected;
        own.sort_unstable();
        expected.sort_unstable();
        expected.dedup();
        assert_eq!(own, expected, "{name}");
    }
    for (name, code, part) in [
        ("TIP", Code::NodeSetUnknown, "A.TIP, B.TIP"),
        ("LOST", Code::DeckSyntax, "instance `D`"),
        ("D.TIP", Code::NodeSetUnknown, "no node set"),
    ] {
        let error = read(&path, vec![set("a", name)]).expect_err(name);
        assert!(error.has(code) && error.to_string().contains(part), "{name}: {error}");
    }
}

/// Keywords are compared without blanks, and a shell with OFFSET lies beside its nodes.
#[test]
fn blanks_in_keywords_do_not_count() {
    let section = "*SHELL SECTION, ELSET=PLATE, MATERIAL=STEEL\n";
    let centre = |to: &str| {
        let (_folder, path) = changed("calculix_shells", |text| {
            assert_eq!(text.matches(section).count(), 1);
            text.replace(section, to)
        });
        let raw = job(&path, vec![set("left", "LEFT")]);
        let positions: Vec<f64> = raw.data.interfaces[0]
            .nodes
            .iter()
            .map(|node| {
                raw.nodes.positions[raw.nodes.ids.iter().position(|id| id == node).expect("a node")][2]
            })
            .collect();
        (body(raw, 2).frame().origin[2], positions)
    };
    let near = |own: f64, exact: f64| assert!((own - exact).abs() < 1e-12, "{own} {exact}");
    for (to, middle) in [
        ("*SHELLSECTION, ELSET=PLATE, MATERIAL=STEEL, OFFSET=.5\n", -0.005),
        (" * shell section,elset=PL ATE, MATERIAL=STEEL, OFF SET = -.5\n", 0.005),
        ("*SHELL SECTION, ELSET=PLATE, MATERIAL=STEEL, OFFSET=SPOS\n", -0.005),
        ("*SHELL SECTION, ELSET=PLATE, MATERIAL=STEEL, OFFSET=0.2\n", -0.002),
        ("*SHELL SECTION, ELSET=PLATE, MATERIAL=STEEL, OFFSET=0\n", 0.0),
    ] {
        let (centre, interface) = centre(to);
        near(centre, middle);
        // The two nodes of the deck lie at its places or, without points there, between the faces. Those of the edge on
        // both faces lie around the middle.
        let own = if middle.abs() == 0.002 { middle } else { 0.0 };
        assert_eq!(interface.len(), 8);
        interface[..2].iter().for_each(|z| near(*z, own));
        near(interface.iter().sum::<f64>() / 8.0, middle);
    }
    let (_folder, path) =
        changed("calculix_shells", |text| text.replace(section, "*SHELLSECTION, ELSET=PLATE, OFFSET=x\n"));
    let error = read(&path, Vec::new()).expect_err("no number");
    assert!(error.to_string().contains("OFFSET"), "{error}");
    let (_folder, path) = changed("calculix", |text| text.replace("*RIGID BODY", "*RigidBody"));
    let labels = read(&path, Vec::new()).expect("read").dofs.expect("labels");
    assert_eq!(labels.iter().filter(|label| label.node == 900).count(), 6);
}

/// Files named by cards are searched in the folder of the job, then beside the file that names them.
#[test]
fn included_files_and_files_of_data_lie_where_the_job_is() {
    let (folder, path) = changed("calculix", str::to_owned);
    let expected = read(&path, Vec::new()).expect("read");
    let place = |name: &str| folder.path().join(name);
    fs::create_dir_all(place("sub/sub")).expect("a folder");
    fs::rename(place("nodes.inp"), place("sub/nodes.inp")).expect("moved");
    let text = fs::read_to_string(&path).expect("a deck").replace("nodes.inp", "sub\\nodes.inp");
    fs::write(place("sub/all.inp"), text).expect("written");
    fs::write(&path, "*INCLUDE, INPUT=sub/all.inp\n").expect("written");
    assert_eq!(read(&path, Vec::new()).expect("read").nodes, expected.nodes);
    fs::rename(place("sub/nodes.inp"), place("sub/sub/nodes.inp")).expect("moved");
    assert_eq!(read(&path, Vec::new()).expect("read").nodes, expected.nodes, "beside the file that names it");

    let (folder, path) = changed("abaqus_labels", |text| {
        let (head, rest) = text.split_once("*Node\n").expect("nodes");
        let (nodes, rest) = rest.split_once("*Element, type=C3D8\n").expect("elements");
        let (elements, rest) = rest.split_once("*Nset").expect("sets");
        format!(
            "{head}*Node, input=n.txt\n*Element, type=C3D8, elset=E, INPUT=e.txt\n*Nset{rest}**N{nodes}**E{elements}"
        )
    });
    let text = fs::read_to_string(&path).expect("a deck");
    let (text, rest) = text.split_once("**N").expect("nodes");
    let (nodes, elements) = rest.split_once("**E").expect("elements");
    fs::write(folder.path().join("n.txt"), format!("** nodes\n{nodes}")).expect("written");
    fs::write(folder.path().join("e.txt"), elements).expect("written");
    fs::write(&path, text).expect("written");
    let (raw, expected) =
        (job(&path, vec![set("l", "Left")]), job(&oracle::jobs::small("abaqus_labels"), Vec::new()));
    assert_eq!(
        (&raw.nodes, &raw.dofs, raw.data.interfaces[0].nodes.len()),
        (&expected.nodes, &expected.dofs, 4)
    );
    let names: Vec<&str> = raw.data.sources.iter().map(|source| source.name.as_str()).collect();
    assert_eq!(names[..3], ["job.inp", "n.txt", "e.txt"]);
    fs::remove_file(folder.path().join("e.txt")).expect("removed");
    let error = read(&path, Vec::new()).expect_err("no elements");
    assert!(error.has(Code::FileUnreadable) && error.to_string().contains("e.txt"), "{error}");
}

/// Stiffness and mass of two steps are a pair if no step has both; matrices of other jobs are ignored.
#[test]
fn matrices_belong_to_their_job() {
    let (folder, path) = changed("abaqus", str::to_owned);
    let expected = read(&path, Vec::new()).expect("read");
    let place = |name: &str| folder.path().join(name);
    fs::rename(place("job_MASS1.mtx"), place("job_MASS2.mtx")).expect("moved");
    let raw = read(&path, Vec::new()).expect("read");
    assert_eq!(raw.mass.matrix, expected.mass.matrix);
    let told = raw.diagnostics.iter().find(|found| found.code() == Code::JobStep).expect("told");
    assert!(told.message().contains("stiffness of step 1 and the mass of step 2"), "{}", told.message());
    fs::rename(place("job_MASS2.mtx"), place("job2_MASS1.mtx")).expect("moved");
    assert!(read(&path, Vec::new()).expect_err("no mass").has(Code::JobUnknown));
}

/// The error about rows that do not fit names elements with internal nodes; with labels these are internal
/// rows.
#[test]
fn internal_nodes_of_beams_are_named_and_read_with_labels() {
    let beam = "*Element, type=B33\n7, 11, 14\n*Nset";
    let (_folder, path) = changed("abaqus", |text| text.replacen("*Nset", beam, 1));
    let error = read(&path, Vec::new()).expect_err("rows of rotations");
    assert!(error.has(Code::DeckRows) && error.to_string().contains("B33 have internal nodes"), "{error}");
    let (folder, path) = changed("abaqus_labels", |text| text.replacen("*Nset", beam, 1));
    let place = folder.path().join("job_STIF1.mtx");
    let text = fs::read_to_string(&place).expect("a matrix");
    // A row of the internal node -3 that follows the extension from node 11 to node 23 along y.
    let (terms, k) = ([(-3, 1, 1.0), (11, 1, -1.0), (23, 1, 1.0)], 1e9);
    // The file has every entry once.
    let mut entries: BTreeMap<[i64; 4], f64> = BTreeMap::new();
    for line in text.lines().filter(|line| !line.starts_with('*')) {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let label = [0, 1, 2, 3].map(|k| fields[k].parse().expect("a label"));
        entries.insert(label, fields[4].parse().expect("a value"));
    }
    for (a, i, x) in terms {
        for (b, j, y) in terms {
            *entries.entry([a, i, b, j]).or_default() += k * x * y;
        }
    }
    let lines = entries.iter().map(|([a, i, b, j], value)| format!("{a},{i}, {b},{j}, {value:?}\n"));
    fs::write(&place, lines.collect::<String>()).expect("written");
    let raw = read(&path, Vec::new()).expect("read");
    assert!(raw.dofs.expect("labels").iter().any(|label| (label.node, label.direction) == (-3, 1)));
}
