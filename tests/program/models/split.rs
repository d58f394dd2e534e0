//! Several bodies in one pair of matrices: detected, named, and with `--split` converted like separate
//! models.

use flexbody_base::diagnostic::Code;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{BodyNumber, Damping, DofLabel, FeModel, NodeSet, Nodes, RawMatrix, RawModel};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::members;
use oracle::mesh::{Mesh, entries};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn labels(raw: &RawModel) -> Vec<DofLabel> {
    let implied = |&node: &i64| (1..=3).map(move |direction| DofLabel { node, direction });
    raw.dofs.clone().unwrap_or_else(|| raw.nodes.ids.iter().flat_map(implied).collect())
}

/// Returns a model of several bodies with rows and nodes interleaved. Node i of body b of k gets the number k
/// i + b.
fn interleaved(bodies: &[RawModel]) -> RawModel {
    /// Returns the positions in the whole of the items of each body.
    fn places(sizes: &[usize]) -> Vec<Vec<usize>> {
        let mut places = vec![Vec::new(); sizes.len()];
        let mut next = 0;
        for item in 0..*sizes.iter().max().expect("bodies") {
            for (body, _) in sizes.iter().enumerate().filter(|(_, size)| item < **size) {
                places[body].push(next);
                next += 1;
            }
        }
        places
    }
    let rows = places(&bodies.iter().map(|b| b.stiffness.matrix.n_cols()).collect::<Vec<_>>());
    let table = places(&bodies.iter().map(|b| b.nodes.len()).collect::<Vec<_>>());
    let (n, nodes) = (rows.iter().map(Vec::len).sum(), table.iter().map(Vec::len).sum());
    let id = |body: usize, id: i64| id * bodies.len() as i64 + body as i64;
    let merged = |matrix: &dyn Fn(&RawModel) -> &RawMatrix| {
        let mut all = Vec::new();
        for (body, rows) in bodies.iter().zip(&rows) {
            let moved = |(r, c, v): (u32, u32, f64)| (rows[r as usize] as u32, rows[c as usize] as u32, v);
            all.extend(entries(&matrix(body).matrix).map(moved));
        }
        RawMatrix { matrix: CscMatrix::from_triplets(n, n, &all), ..matrix(&bodies[0]).clone() }
    };
    let mut dofs = vec![DofLabel { node: 0, direction: 0 }; n];
    let mut whole = Nodes { ids: vec![0; nodes], positions: vec![[0.0; 3]; nodes] };
    for (b, body) in bodies.iter().enumerate() {
        for (label, &row) in labels(body).iter().zip(&rows[b]) {
            dofs[row] = DofLabel { node: id(b, label.node), ..*label };
        }
        for (i, &at) in table[b].iter().enumerate() {
            (whole.ids[at], whole.positions[at]) = (id(b, body.nodes.ids[i]), body.nodes.positions[i]);
        }
    }
    let interfaces = bodies.iter().enumerate().flat_map(|(b, body)| {
        let nodes = move |set: &NodeSet| set.nodes.iter().map(|&node| id(b, node)).collect();
        body.data.interfaces.iter().map(move |set| NodeSet::new(format!("{}{b}", set.name), nodes(set)))
    });
    RawModel {
        stiffness: merged(&|body| &body.stiffness),
        mass: merged(&|body| &body.mass),
        nodes: whole,
        dofs: Some(dofs),
        ..bodies[0].clone().with(|data| data.interfaces = interfaces.collect())
    }
}

/// Returns a single body with the node numbers of the whole.
fn alone(bodies: &[RawModel], body: usize) -> RawModel {
    let number = |node: i64| node * bodies.len() as i64 + body as i64;
    let mut raw = bodies[body].clone();
    raw.dofs = Some(labels(&raw).iter().map(|l| DofLabel { node: number(l.node), ..*l }).collect());
    raw.nodes.ids.iter_mut().for_each(|node| *node = number(*node));
    for set in &mut raw.data.interfaces {
        set.name = format!("{}{body}", set.name);
        set.nodes.iter_mut().for_each(|node| *node = number(*node));
    }
    raw
}

/// Asserts that the bodies are equal bit by bit, except for the provenance.
#[track_caller]
fn assert_same(a: &FlexBody, b: &FlexBody) {
    let (mut a, mut b) = (a.clone().into_parts(), b.clone().into_parts());
    for parts in [&mut a, &mut b] {
        parts.description.number = None;
        parts.description.name.clear();
        parts.source.files.clear();
    }
    assert!(a == b, "frequencies {:?} and {:?}", a.modes.eigenvalue, b.modes.eigenvalue);
}

#[test]
fn two_cubes_dealt_out_in_turn_are_converted_as_each_alone() {
    let manifest = oracle::fixtures().join("models/cube_hex8/model.toml");
    let first = read_model(&read_manifest(manifest).unwrap()).unwrap();
    let mut second = first.clone();
    let scale = |m: &CscMatrix, factor: f64| {
        let all: Vec<_> = entries(m).map(|(r, c, v)| (r, c, v * factor)).collect();
        CscMatrix::from_triplets(m.n_rows(), m.n_cols(), &all)
    };
    second.stiffness.matrix = scale(&first.stiffness.matrix, 3.0);
    second.mass.matrix = scale(&first.mass.matrix, 0.7);
    second.nodes.positions.iter_mut().for_each(|x| x[0] += 0.01);
    let bodies = [first, second];

    let mut settings = ConvertSettings::default();
    settings.modes.wanted = Wanted::Lowest(8);
    let split = FeModel::bodies_from_raw(interleaved(&bodies)).unwrap();
    assert_eq!(split.len(), 2);
    for (b, checked) in split.iter().enumerate() {
        assert_eq!(checked.model.number(), Some(BodyNumber { number: b + 1, of: 2 }));
        assert_eq!(checked.model.name(), format!("{}-{}", bodies[0].data.description.name, b + 1));
        let own = FeModel::from_raw(alone(&bodies, b)).unwrap().model;
        assert_eq!(checked.model.stiffness(), own.stiffness());
        assert_eq!(checked.model.scalar_mass(), own.scalar_mass());
        let found = convert(&checked.model, &settings, &Context::QUIET).unwrap().body;
        assert_same(&found, &convert(&own, &settings, &Context::QUIET).unwrap().body);
        assert_eq!(found.description().number, checked.model.number());
    }
}

#[test]
fn mass_coupling_joins_bodies_and_a_part_that_only_mass_holds_is_a_mechanism() {
    let bodies = [block(2), block(3)];
    let mut raw = interleaved(&bodies);
    let mut all: Vec<_> = entries(&raw.mass.matrix).collect();
    all.extend((0..3).flat_map(|k| [(2 * k, 2 * k + 1, 1e-9), (2 * k + 1, 2 * k, 1e-9)]));
    let n = raw.mass.matrix.n_cols();
    raw.mass.matrix = CscMatrix::from_triplets(n, n, &all);
    for error in
        [FeModel::from_raw(raw.clone()).unwrap_err(), FeModel::bodies_from_raw(raw).map(|_| ()).unwrap_err()]
    {
        assert!(error.has(Code::Mechanism) && !error.has(Code::BodiesSeveral), "{error}");
        assert!(error.to_string().contains("2 parts that only the mass matrix couples"), "{error}");
    }
}

#[test]
fn a_damping_matrix_is_taken_apart_too_and_must_not_couple_bodies() {
    let scaled = |matrix: &RawMatrix| {
        let all: Vec<_> = entries(&matrix.matrix).map(|(r, c, v)| (r, c, 1e-6 * v)).collect();
        let n = matrix.matrix.n_cols();
        RawMatrix { matrix: CscMatrix::from_triplets(n, n, &all), ..matrix.clone() }
    };
    let with_damping = |mut raw: RawModel| {
        raw.data.damping = Some(Damping::Matrix(scaled(&raw.stiffness)));
        raw
    };
    let bodies = [block(2), block(3)];
    let mut whole = with_damping(interleaved(&bodies));
    for (b, checked) in FeModel::bodies_from_raw(whole.clone()).unwrap().iter().enumerate() {
        let own = FeModel::from_raw(with_damping(alone(&bodies, b))).unwrap().model;
        assert_eq!(checked.model.damping(), own.damping());
    }
    let Some(Damping::Matrix(d)) = &mut whole.data.damping else { unreachable!("just made") };
    let mut all: Vec<_> = entries(&d.matrix).collect();
    all.extend([(0, 1, -1.0), (1, 0, -1.0)]);
    let n = d.matrix.n_cols();
    d.matrix = CscMatrix::from_triplets(n, n, &all);
    let error = FeModel::bodies_from_raw(whole).unwrap_err();
    assert!(error.to_string().contains("damping couples node 2 of body 1 with node 3 of body 2"), "{error}");
}

/// Returns a steel block with an interface at its first nodes.
fn block(cells: i32) -> RawModel {
    let mesh = Mesh::block(ElementKind::Hex8, [cells, 2, 1], [0.1 * f64::from(cells), 0.15, 0.07]);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.data.description.name = "pair".to_owned();
    raw.data.interfaces = vec![NodeSet::new("root", raw.nodes.ids[..3].to_vec())];
    raw
}

fn flexbody(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexbody"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap()
}

fn files(raw: &RawModel) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let manifest = write_model(folder.path(), raw, Triangle::Lower);
    let mut text = std::fs::read_to_string(&manifest).unwrap();
    for set in &raw.data.interfaces {
        text.push_str(&format!("[[interface]]\nname = \"{}\"\nnodes = {:?}\n", set.name, set.nodes));
    }
    std::fs::write(manifest, text).unwrap();
    folder
}

#[test]
fn every_body_gets_files_of_its_own() {
    let bodies = [block(2), block(3)];
    let folder = files(&interleaved(&bodies));
    let before = members(folder.path());
    let options = "--modes 5 --report r.html --report r.json --json";
    let refused = flexbody(folder.path(), "convert model.toml -o pair.flex.h5");
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(3), "{said}");
    assert!(said.contains("2 separate bodies: 18 nodes (") && said.contains("--split"), "{said}");
    assert_eq!(members(folder.path()), before);

    let run = flexbody(folder.path(), &format!("convert model.toml -o pair.flex.h5 --split {options}"));
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    let mut after = before.clone();
    for name in ["pair-1.flex.h5", "pair-2.flex.h5"] {
        after.push(name.to_owned());
    }
    after.extend(["r-1.html", "r-1.json", "r-2.html", "r-2.json"].map(str::to_owned));
    after.sort();
    assert_eq!(members(folder.path()), after);

    let reports: Value = serde_json::from_slice(&run.stdout).unwrap();
    let schema = serde_json::from_str(include_str!("../../../schemas/report.schema.json")).unwrap();
    let schema = jsonschema::validator_for(&schema).unwrap();
    for (b, raw) in bodies.iter().enumerate() {
        let name = format!("pair-{}.flex.h5", b + 1);
        let body = flexbody_file::read(folder.path().join(&name)).unwrap();
        assert_eq!(body.description().name, format!("pair-{}", b + 1));
        assert_eq!(body.description().number, Some(BodyNumber { number: b + 1, of: 2 }));
        let sets: Vec<_> = body.interfaces().iter().map(|i| (i.name.clone(), i.nodes.clone())).collect();
        assert_eq!(sets, [(format!("root{b}"), vec![0, 1, 2])]);
        let own = files(&alone(&bodies, b));
        let run = flexbody(own.path(), "convert model.toml -o own.h5 --modes 5");
        assert_eq!(run.status.code(), Some(0));
        assert_same(&body, &flexbody_file::read(own.path().join("own.h5")).unwrap());

        let report = &reports["results"]["bodies"][b];
        assert!(schema.is_valid(report));
        assert_eq!(report["model"]["body"]["number"], b + 1);
        assert_eq!(report["model"]["n_nodes"], raw.nodes.len());
        assert_eq!(report["run"]["output"]["name"], name);
        let saved = std::fs::read_to_string(folder.path().join(format!("r-{}.json", b + 1))).unwrap();
        assert_eq!(&serde_json::from_str::<Value>(&saved).unwrap(), report);
        let html = std::fs::read_to_string(folder.path().join(format!("r-{}.html", b + 1))).unwrap();
        assert!(html.contains(&format!("body {} of 2 in the matrices", b + 1)));
        let check = flexbody(folder.path(), &format!("check {name} --against model.toml"));
        assert_eq!(check.status.code(), Some(0), "{}", String::from_utf8_lossy(&check.stdout));
    }
    // The body cannot be checked against the model of another body.
    let own = files(&alone(&bodies, 0));
    let elsewhere = own.path().join("model.toml");
    let line = format!("check pair-1.flex.h5 --against {}", elsewhere.display());
    let check = flexbody(folder.path(), &line);
    assert_eq!(check.status.code(), Some(2));
    let said = String::from_utf8_lossy(&check.stderr).into_owned();
    assert!(said.contains("the file states body 1 of 2, but the matrices of the model hold 1"), "{said}");
}

#[test]
fn a_body_that_fails_leaves_no_file_of_any() {
    // Bodies 2 and 3 are coupled by a negligible entry.
    let bodies = [block(2), block(3), block(3)];
    let mut raw = interleaved(&bodies);
    let mut all: Vec<_> = entries(&raw.stiffness.matrix).collect();
    all.extend([(1, 2, 1e-30), (2, 1, 1e-30)]);
    let n = raw.stiffness.matrix.n_cols();
    raw.stiffness.matrix = CscMatrix::from_triplets(n, n, &all);
    let folder = files(&raw);
    std::fs::write(folder.path().join("b-1.flex.h5"), "old").unwrap();
    let before = members(folder.path());
    let run = flexbody(folder.path(), "convert model.toml -o b.flex.h5 --split --modes 10 --report r.txt");
    let said = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(3), "{said}");
    assert!(said.contains("error[FB502]: body 2 of 2: 12 zero-energy modes"), "{said}");
    assert!(said.contains("2 separate bodies have as many"), "{said}");
    assert_eq!(members(folder.path()), before);
    assert_eq!(std::fs::read(folder.path().join("b-1.flex.h5")).unwrap(), b"old");
}

#[test]
fn a_single_body_is_number_one_of_one_and_numbered_outputs_do_not_hit_inputs() {
    let folder = files(&block(2));
    let run = flexbody(folder.path(), "convert model.toml -o b.h5 --split --modes 2 --quiet");
    assert_eq!(run.status.code(), Some(0));
    assert_eq!(
        flexbody_file::read(folder.path().join("b-1.h5")).unwrap().description().number.unwrap().of,
        1
    );

    let folder = files(&interleaved(&[block(2), block(3)]));
    std::fs::rename(folder.path().join("K.mtx"), folder.path().join("b-2.h5")).unwrap();
    let manifest = folder.path().join("model.toml");
    let text = std::fs::read_to_string(&manifest).unwrap().replace("K.mtx", "b-2.h5");
    std::fs::write(&manifest, text).unwrap();
    let run = flexbody(folder.path(), "convert model.toml -o b.h5 --split --modes 2");
    let said = String::from_utf8(run.stderr).unwrap();
    assert!(said.contains("output b-2.h5 is an input"), "{said}");
    assert_eq!(run.status.code(), Some(2));
}
