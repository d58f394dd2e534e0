//! Jobs of FE programs: matrices, labels, node sets and regions from the files of the programs.

use crate::program::flexbody;
use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::FlexBody;
use flexbody_input::{ModelFiles, Region, job_programs, read_manifest, read_model};
use flexbody_model::FeModel;
use oracle::damage::{apply, damage};
use oracle::fixtures;
use oracle::jobs::{assert_has_inertia_of_the_block, body, job, set, small};
use proptest::prelude::*;
use std::fs;
use std::path::Path;

/// Copies all files of a job.
fn copy_job(name: &str, place: &Path) {
    for file in fs::read_dir(fixtures().join("small").join(name)).expect("a folder") {
        let file = file.expect("a file");
        fs::copy(file.path(), place.join(file.file_name())).expect("copied");
    }
}

fn assert_is_the_block(body: &FlexBody) {
    assert_has_inertia_of_the_block(body, 1e-11);
}

/// Bricks with incompatible modes, whose internal rows CalculiX numbers above the nodes of the deck; an
/// included file; and a rigid body whose rotation node represents the rotations of its reference node.
#[test]
fn a_job_of_calculix_is_read_with_its_internal_rows_and_rotations() {
    let raw = job(&small("calculix"), vec![set("right", "RIGHT"), set("all", "ALL")]);
    let labels = raw.dofs.as_ref().expect("labels");
    let of =
        |node: i64| labels.iter().filter(|label| label.node == node).map(|l| l.direction).collect::<Vec<_>>();
    assert_eq!(of(900), [1, 2, 3, 4, 5, 6], "the reference node moves and turns");
    assert_eq!(of(901), [] as [u8; 0], "the rotation node is no node");
    assert!(!raw.nodes.ids.contains(&901));
    assert_eq!(of(906), [1, 2, 3], "an internal node of the first brick");
    assert_eq!(raw.data.interfaces[0].nodes.len(), 4);
    assert!(raw.data.interfaces[1].nodes.iter().all(|node| !of(*node).is_empty()), "nodes with rows only");
    let roles: Vec<&str> = raw.data.sources.iter().map(|source| source.role.as_str()).collect();
    assert_eq!(roles, ["deck", "deck", "stiffness", "mass", "dofs"]);
    let names: Vec<&str> = raw.data.sources.iter().map(|source| source.name.as_str()).collect();
    assert_eq!(names, ["job.inp", "nodes.inp", "job.sti", "job.mas", "job.dof"]);
    assert_is_the_block(&body(raw, 6));
}

/// The reference node of a distributing coupling is the weighted mean of its nodes, whatever its position in
/// the deck: the body is the block without the coupling, in other coordinates.
#[test]
fn a_distributing_coupling_has_its_node_at_the_mean_of_its_nodes() {
    let raw = job(&small("calculix_distributing"), Vec::new());
    let told: Vec<_> = raw.diagnostics.iter().map(|told| (told.code(), told.message().to_owned())).collect();
    assert!(
        matches!(&told[..], [(Code::DeckReference, message)] if message.contains("900 at (0, 0.048, 0.024)")),
        "{told:?}"
    );
    let at = raw.nodes.ids.iter().position(|id| *id == 900).expect("the reference node");
    let place = raw.nodes.positions[at];
    assert!(place.iter().zip([0.0, 0.048, 0.024]).all(|(a, b)| (a - b).abs() < 1e-16), "{place:?}");
    let (coupled, free) = (body(raw, 8), body(job(&small("abaqus"), Vec::new()), 8));
    assert_is_the_block(&coupled);
    for (a, b) in coupled.modes().eigenvalue.iter().zip(&free.modes().eigenvalue) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    // The first node of the coupling has no rows, so that the interface has three nodes, about the centre of
    // all four.
    let end = job(&small("calculix_distributing"), vec![set("end", "left")]);
    let model = FeModel::from_raw(end).expect("a body").model;
    assert_eq!(model.interfaces()[0].nodes, [17, 14, 20]);
    let point = model.interfaces()[0].reference.point().expect("a point");
    assert!(point.iter().zip([0.0, 0.04, 0.03]).all(|(a, b)| (a - b).abs() < 1e-16), "{point:?}");
    // A coupling without a reference node or nodes is refused with its line.
    let place = tempfile::tempdir().expect("a folder");
    copy_job("calculix_distributing", place.path());
    let deck = place.path().join("job.inp");
    let text = fs::read_to_string(&deck).expect("the deck");
    for (from, to, said) in [
        ("ELSET=MEAN\n11", "ELSET=NONE\n11", "element set `NONE` is unknown"),
        ("ELSET=MEAN\n11", "ELSET=BRICKS\n11", "is not one element of type DCOUP3D"),
        ("REST, 1.", "REST", "`REST` is not a node or node set and its weight"),
        ("REST, 1.", "NOWHERE, 1.", "`NOWHERE, 1.` is not a node"),
        ("REST, 1.", "REST, -1.5", "add up to zero"),
        ("REST, 1.", "REST, nan", "is not a node"),
    ] {
        assert!(text.contains(from), "{from}");
        fs::write(&deck, text.replace(from, to)).expect("written");
        let files = ModelFiles::from_job(&deck, None, Vec::new(), Some("m,kg,s")).expect("units");
        let error = read_model(&files).expect_err(to);
        assert!(error.has(Code::DeckUnsupported) && error.to_string().contains(said), "{error}");
    }
}

/// Each of two kinematic couplings gives its reference node the rotations that CalculiX labels as
/// displacements of a node outside the deck. They equal those of *RIGID BODY with ROT NODE.
#[test]
fn kinematic_couplings_have_the_rotations_of_their_reference_nodes() {
    let raw = job(&small("calculix_couplings"), Vec::new());
    let labels = raw.dofs.clone().expect("labels");
    let of =
        |node: i64| labels.iter().filter(|label| label.node == node).map(|l| l.direction).collect::<Vec<_>>();
    for (node, directions) in [(900, 1..7), (970, 1..7), (971, 1..1), (980, 1..1), (985, 1..4)] {
        assert_eq!(of(node), directions.collect::<Vec<u8>>(), "{node}");
    }
    // The reference nodes lie beside their faces, so that a rotation moves the mass of that face and no
    // other.
    let row = |node, direction| {
        labels.iter().position(|own| (own.node, own.direction) == (node, direction)).expect("a row")
    };
    let coupled = |a: (i64, u8), b: (i64, u8)| {
        let (a, b) = (row(a.0, a.1), row(b.0, b.1));
        raw.mass.matrix.get(a, b).abs().max(raw.mass.matrix.get(b, a).abs())
    };
    for (own, other) in [(900, 970), (970, 900)] {
        assert!(coupled((own, 2), (own, 6)) > 1e-3, "{own}");
        assert_eq!(coupled((own, 2), (other, 6)), 0.0, "{own}");
    }
    assert_is_the_block(&body(raw, 6));

    let place = tempfile::tempdir().expect("a folder");
    copy_job("calculix_couplings", place.path());
    let deck = place.path().join("job.inp");
    let text = fs::read_to_string(&deck).expect("a deck");
    let (head, rest) = text.split_once("*COUPLING").expect("couplings");
    let (_, rest) = rest.split_once("*NODE\n").expect("nodes");
    let rigid = "*RIGID BODY, NSET=RIGHT, REF NODE=970, ROT NODE=971\n*RIGID BODY, NSET=LEFT, REF NODE=900, ROT NODE=980\n";
    let rotations = "*NODE\n971, 0, 0, 0\n980, 0, 0, 0\n";
    fs::write(&deck, format!("{head}{rigid}{rotations}{rest}")).expect("written");
    assert_eq!(job(&deck, Vec::new()).dofs.expect("labels"), labels);
}

/// A set may name the reference node, and a deck whose couplings do not explain the rows is refused.
#[test]
fn couplings_that_do_not_explain_the_rows_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    copy_job("calculix_couplings", place.path());
    let deck = place.path().join("job.inp");
    let text = fs::read_to_string(&deck).expect("a deck");
    let read = |from: &str, to: &str| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        fs::write(&deck, text.replace(from, to)).expect("written");
        read_model(&ModelFiles::from_job(&deck, None, Vec::new(), None).expect("files"))
    };
    let of_a_set = read("REF NODE=970", "REF NODE=Pin").expect_err("refused");
    assert!(of_a_set.to_string().contains("REF NODE `Pin` of *COUPLING is neither"), "{of_a_set}");
    let pin = "*NSET, NSET=PIN\n970\n*COUPLING, REF NODE=pin, SURFACE=FACES";
    let named = read("*COUPLING, REF NODE=970, SURFACE=FACES", pin).expect("a model").dofs;
    assert_eq!(named, job(&small("calculix_couplings"), Vec::new()).dofs);
    let third = "*COUPLING, REF NODE=23, SURFACE=NODES, CONSTRAINT NAME=C3\n*KINEMATIC\n1, 3\n*MATERIAL";
    for (from, to, line, part) in [
        (
            "2, S4",
            "2, SPOS",
            30,
            "REF NODE 900 cannot be identified: the nodes of the surface of a coupling above",
        ),
        ("1, 2\n3\n", "1, 3\n", 29, "belong to node 976, but node 980 has rows"),
        ("REF NODE=970", "REF NODE=900", 30, "REF NODE 900 of *COUPLING is also the REF NODE of another"),
        ("970, 0.23", "975, 0, 0, 0\n970, 0.23", 26, "belong to node 976, but node 971 has rows"),
        ("*MATERIAL", third, 36, "belong to node 985, but node 986 has rows"),
        (
            "*KINEMATIC\n1, 3\n",
            "*DISTRIBUTING\n1, 3\n",
            26,
            "belong to node 971, and elements have 6 internal nodes, but 8 nodes",
        ),
    ] {
        let refused = read(from, to).err().unwrap_or_else(|| panic!("{to} is read")).to_string();
        assert!(refused.contains(part), "{to}: {refused}");
        assert!(refused.contains(&format!("job.inp, line {line}")), "{to}: {refused}");
    }
}

/// Shells that CalculiX expands into solids: the nodes between the faces lie at the positions of the deck,
/// those on the faces half a thickness beside them. Mass and inertia agree with the plate, frequencies with
/// the table printed by CalculiX.
#[test]
fn quadratic_shells_of_calculix_are_told_apart() {
    let raw = job(&small("calculix_shells"), vec![set("left", "LEFT")]);
    assert_eq!(
        raw.data.interfaces[0].nodes.len(),
        8,
        "an edge has the nodes on both faces and those between them"
    );
    let faces = raw.nodes.positions.iter().filter(|x| ((x[2] / 0.005).abs() - 1.0).abs() < 1e-9).count();
    assert_eq!(faces, 26, "two for each node of the deck");
    let body = body(raw, 4);
    let (mass, [a, b, c]) = (7850.0 * 0.2 * 0.1 * 0.01, [0.2, 0.1, 0.01]);
    let invariants = body.invariants();
    assert!((invariants.mass() / mass - 1.0).abs() < 1e-12, "{}", invariants.mass());
    let mut own: Vec<f64> = (0..3).map(|k| invariants.inertia()[(k, k)]).collect();
    own.sort_by(f64::total_cmp);
    let exact: Vec<f64> =
        [b * b + c * c, a * a + c * c, a * a + b * b].iter().map(|sum| mass * sum / 12.0).collect();
    assert!(own.iter().zip(&exact).all(|(own, exact)| (own / exact - 1.0).abs() < 1e-9), "{own:?} {exact:?}");
    let table = [9.464613e7, 1.078615e8, 6.691027e8, 7.267380e8];
    for (own, printed) in body.modes().eigenvalue.iter().zip(table) {
        assert!((own / printed - 1.0).abs() < 1e-6, "{own} {printed}");
    }
}

/// Matrices with and without labels give one model: rows and positions come from the part and its instance.
#[test]
fn both_forms_of_abaqus_are_one_model() {
    let bodies = ["abaqus", "abaqus_labels"].map(|name| {
        let raw = job(&small(name), vec![set("left", "left")]);
        assert_eq!(raw.data.interfaces[0].nodes.len(), 4);
        let lies_left = |node: &i64| {
            let at = raw.nodes.ids.iter().position(|id| id == node).expect("a node");
            raw.nodes.positions[at][0].abs() < 1e-12
        };
        assert!(raw.data.interfaces[0].nodes.iter().all(lies_left), "the instance turns and moves the part");
        body(raw, 8)
    });
    bodies.iter().for_each(assert_is_the_block);
    let [a, b] = bodies.map(|body| body.modes().eigenvalue.clone());
    assert!(a.iter().zip(&b).all(|(a, b)| (a / b - 1.0).abs() < 1e-10), "{a:?} {b:?}");
}

/// A manifest names a job, and interfaces by set and by region; the command line names sets.
#[test]
fn manifests_and_command_lines_take_jobs() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    copy_job("calculix", place);
    let text = "[model.units]\nlength = \"m\"\nmass = \"kg\"\ntime = \"s\"\n[files]\njob = \"job.inp\"\nprogram = \"calculix\"\n\
        [[interface]]\nname = \"right\"\nset = \"right\"\n\
        [[interface]]\nname = \"box\"\nbox = { min = [0.15, -1, -1], max = [0.25, 1, 1] }\n\
        [[interface]]\nname = \"plane\"\nplane = { point = [0.2, 0, 0], normal = [3, 0, 0], within = 0.001 }\n\
        [[interface]]\nname = \"cylinder\"\ncylinder = { from = [0.2, 0.04, 0.03], to = [0.3, 0.04, 0.03], radius = [0.04, 0.06] }\n\
        [[interface]]\nname = \"near\"\nnearest = { point = [0.3, 0.04, 0.03], count = 4 }\n";
    fs::write(place.join("model.toml"), text).expect("written");
    let raw = read_model(&read_manifest(place.join("model.toml")).expect("a manifest")).expect("readable");
    let right = &raw.data.interfaces[0].nodes;
    assert_eq!(right.len(), 4);
    for interface in &raw.data.interfaces[1..] {
        let mut nodes = interface.nodes.clone();
        nodes.sort_unstable();
        let mut right = right.clone();
        right.sort_unstable();
        assert_eq!(nodes, right, "{}", interface.name);
    }
    let one = ["convert", "model.toml", "--modes", "4", "-o", "one.flex.h5", "--quiet"];
    assert!(flexbody(place, &one).status.success());
    let two = [
        "convert",
        "job.inp",
        "--units",
        "m,kg,s",
        "--interface",
        "right,rigid",
        "--modes",
        "4",
        "-o",
        "two.flex.h5",
    ];
    let run = flexbody(place, &two);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    // The manifest names more interfaces, and no coupling; otherwise the bodies are equal.
    let compared = flexbody(place, &["compare", "one.flex.h5", "two.flex.h5"]);
    let told = String::from_utf8_lossy(&compared.stdout);
    let differing: Vec<&str> = told.lines().filter(|line| line.ends_with("DIFFERS")).collect();
    assert!(differing.len() == 1 && differing[0].starts_with("interfaces  "), "{told}");
    assert!(
        told.contains("interface `right` is `not stated` in the first body and `rigid` in the second"),
        "{told}"
    );
    // No output replaces a file of the job.
    let run = flexbody(place, &["convert", "job.inp", "--modes", "4", "-o", "job.mas"]);
    assert_eq!(run.status.code(), Some(2));
}

/// Every command that takes a model also takes a job, with the settings of a manifest as options.
#[test]
fn jobs_stand_for_manifests_in_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    copy_job("calculix", place);
    let manifest = "[model]\nname = \"job\"\n[model.units]\nlength = \"m\"\nmass = \"kg\"\ntime = \"s\"\n\
        [files]\njob = \"job.inp\"\n[[interface]]\nname = \"tip\"\nset = \"right\"\ncoupling = \"rigid\"\n";
    fs::write(place.join("model.toml"), manifest).expect("written");
    let scene = "[run]\nduration = 0.00002\noutputs = 4\n[initial]\nangular_velocity = [10, 30, 5]\n[[watch]]\ninterface = \"tip\"\n";
    fs::write(place.join("scene.toml"), scene).expect("written");
    let run = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        flexbody(place, &words)
    };
    let said = |line: &str| {
        let run = run(line);
        assert!(run.status.success(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
        let text = String::from_utf8(run.stdout).expect("text");
        text.lines()
            .filter(|line| !line.starts_with("Time"))
            // The command of the verdict names the model as the user did.
            .take_while(|line| !line.starts_with("Command"))
            .map(|line| format!("{line}\n"))
            .collect::<String>()
    };
    said("convert model.toml --modes 6 -o body.flex.h5");
    let job = "job.inp --format calculix --units m,kg,s --interface tip=RIGHT,rigid";
    let band = "--band 0..3000 --from tip:x --to tip:x --points 20 --solves 4 --tolerance 1";
    for line in [
        "check body.flex.h5 --against MODEL",
        &format!("response MODEL --modes 6 {band}"),
        "select MODEL --scene scene.toml --modes 2",
    ] {
        let [by_manifest, by_job] = ["model.toml", job].map(|model| said(&line.replace("MODEL", model)));
        assert_eq!(by_manifest, by_job, "{line}");
    }
    said(&format!("trade {job} --scene scene.toml --modes 2 --repeat 1"));
    said(&format!("convert {job} --modes 2 --scene scene.toml -o small.flex.h5"));
    // No output replaces a file of the job.
    let refused = run(&format!("response {job} {band} --csv job.mas"));
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("is an input"));
}

#[test]
fn regions_hold_their_nodes_in_the_order_of_the_model() {
    let region = Region::Nearest { point: [0.0; 3], count: 2 };
    let nodes = [(5, [3.0, 0.0, 0.0]), (9, [1.0, 0.0, 0.0]), (2, [2.0, 0.0, 0.0])];
    assert_eq!(region.nodes(nodes.into_iter()), [9, 2]);
}

/// Jobs of the FE programs themselves, if available, give the frequencies printed by CalculiX.
#[test]
fn jobs_of_the_programs_give_what_the_programs_say() {
    let samples = oracle::shared().join("samples");
    let calculix = samples.join("calculix/beam_c3d20.inp");
    if !calculix.exists() {
        return;
    }
    let beam = body(job(&calculix, Vec::new()), 6);
    let mass = 7850.0 * 1.0 * 0.04 * 0.02;
    assert!((beam.invariants().mass() / mass - 1.0).abs() < 1e-12);
    let printed = [0.4488001e6, 0.1771818e7, 0.3470427e7, 0.1332602e8, 0.1371875e8, 0.3901634e8];
    for (own, printed) in beam.modes().eigenvalue.iter().zip(printed) {
        assert!((own / printed - 1.0).abs() < 2e-7, "{own} {printed}");
    }
    // The expected masses are those of steel discs and aluminium blocks described by the decks.
    let block = body(job(&samples.join("abaqus/blockC3D4.inp"), vec![set("all", "Set-1")]), 6);
    assert!((block.invariants().mass() / (2900.0 * 4.0) - 1.0).abs() < 1e-6, "{}", block.invariants().mass());
    let rotor = body(job(&samples.join("abaqus/rotorDiscTest.inp"), Vec::new()), 6);
    assert!(rotor.invariants().mass() > 0.0);
}

/// Main files of the jobs of the fixtures.
const MAIN_FILES: [&str; 3] = ["job.inp", "job.bdf", "job.pch"];

/// Returns folder and name of every job file of the fixtures; each FE program has a folder of its name.
fn job_files() -> Vec<(String, String)> {
    let small = fixtures().join("small");
    for program in job_programs() {
        assert!(small.join(program).is_dir(), "no job of {program}");
    }
    let names = |folder: &Path| -> Vec<String> {
        let entries =
            fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
        entries.map(|name| name.to_string_lossy().into_owned()).collect()
    };
    let mut files = Vec::new();
    for folder in names(&small) {
        let own = names(&small.join(&folder));
        if MAIN_FILES.iter().any(|main| own.iter().any(|name| name == main)) {
            files.extend(own.into_iter().map(|name| (folder.clone(), name)));
        }
    }
    files.sort();
    files
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Damaged job files are read or refused and never cause a panic.
    #[test]
    fn damaged_jobs_never_panic(
        (folder, file) in prop::sample::select(job_files()),
        damages in proptest::collection::vec(damage(), 1..4),
    ) {
        let place = tempfile::tempdir().expect("a folder");
        for entry in fs::read_dir(fixtures().join("small").join(&folder)).expect("a folder") {
            let path = entry.expect("a file").path();
            let name = path.file_name().expect("a name");
            let mut bytes = fs::read(&path).expect("a file");
            if name == file.as_str() {
                damages.iter().for_each(|damage| apply(&mut bytes, damage));
            }
            fs::write(place.path().join(name), bytes).expect("written");
        }
        let main = MAIN_FILES.map(|name| place.path().join(name));
        let main = main.into_iter().find(|path| path.exists()).expect("a main file");
        let sets = if folder.starts_with("nastran") { vec![] } else { vec![set("left", "LEFT")] };
        let files = ModelFiles::from_job(main, None, sets, None);
        if let Ok(raw) = read_model(&files.expect("files")) {
            let _ = FeModel::from_raw(raw);
        }
    }
}
