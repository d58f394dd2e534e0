//! Geometric stiffness of the stresses that CalculiX printed, beside element code: `fixtures/small/stress_*` has the results
//! of CalculiX for the decks that the program writes here.

use crate::program::flexbody;
use flexbody_input::{ElementDeck, read_manifest, read_model};
use flexbody_linalg::CscMatrix;
use flexbody_model::{DofLabel, LoadKind, RawModel};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use oracle::elements::{ElementKind, Material};
use oracle::fixtures;
use oracle::mesh::{Mesh, entries};
use std::collections::HashMap;
use std::fs;
use std::io::Read;
use std::path::Path;
use tempfile::TempDir;

/// Corners of the bricks of CalculiX, then the ends of their edges.
const CORNERS: [[i32; 3]; 8] =
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]];
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

fn run(place: &Path, line: &str) -> (bool, String) {
    let words: Vec<&str> = line.split_whitespace().collect();
    let done = flexbody(place, &words);
    let text = [done.stdout, done.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    (done.status.success(), text)
}

fn done(place: &Path, line: &str) -> String {
    let (success, text) = run(place, line);
    assert!(success, "{line}: {text}");
    text
}

fn refused(place: &Path, line: &str) -> String {
    let (success, text) = run(place, line);
    assert!(!success, "{line}: {text}");
    text
}

/// Copies the results of CalculiX, and writes the decks that belong to them.
fn folder(kind: &str) -> TempDir {
    let (folder, from) = (tempfile::tempdir().expect("a folder"), fixtures().join("small").join(kind));
    let place = folder.path();
    for entry in fs::read_dir(from).expect("the fixture") {
        let entry = entry.expect("a file");
        fs::copy(entry.path(), place.join(entry.file_name())).expect("copied");
    }
    let packed = fs::File::open(place.join("stiff.dat.gz")).expect("results");
    let mut text = String::new();
    flate2::read::GzDecoder::new(packed).read_to_string(&mut text).expect("unpacked");
    fs::write(place.join("stiff.dat"), text).expect("written");
    done(place, "convert model.toml --modes 6 --lumped none --quiet -o plain.h5");
    done(place, "shapes plain.h5 --model model.toml --geometric-stiffness -o stiff.inp");
    done(
        place,
        "shapes plain.h5 --model model.toml --geometric-stiffness --stresses stiff.dat -o stiff.toml",
    );
    folder
}

/// Writes the manifest with the geometric stiffness whose matrices are in the folder.
fn stressed(place: &Path) {
    let mut manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    let tables = fs::read_to_string(place.join("stiff.toml")).expect("tables");
    for table in tables.split("[[geometric_stiffness]]\n").skip(1) {
        let file = table.split('"').nth(1).expect("a file");
        if place.join(format!("{file}.gz")).exists() {
            manifest += &format!("[[geometric_stiffness]]\n{}", table.replace(".sti", ".sti.gz"));
        }
    }
    fs::write(place.join("stressed.toml"), manifest).expect("written");
}

/// Model of the deck in the order of the rows of its matrices, by element code.
struct Reference {
    mesh: Mesh,
    /// Row of the files for each of three rows per node of the mesh.
    rows: Vec<usize>,
    ids: Vec<i64>,
    k: DMatrix<f64>,
    m: DMatrix<f64>,
}

impl Reference {
    fn new(place: &Path, raw: &RawModel) -> Self {
        let deck = ElementDeck::read(&place.join("job.inp")).expect("a deck");
        let (ids, nodes): (Vec<i64>, Vec<[f64; 3]>) = deck.nodes.into_iter().unzip();
        let at = |id: &i64| ids.binary_search(id).expect("a node");
        let elements = deck.solids.iter().map(|(_, own)| {
            let kind = if own.len() == 8 { ElementKind::Hex8 } else { ElementKind::Hex20 };
            let middle = |[a, b]: [usize; 2]| [0, 1, 2].map(|k| (CORNERS[a][k] + CORNERS[b][k]) / 2);
            let order: Vec<[i32; 3]> = CORNERS.into_iter().chain(EDGES.map(middle)).collect();
            let place = |sign: &[i32; 3]| order.iter().position(|one| one == sign).expect("a node");
            (kind, kind.hex_signs().iter().map(|sign| at(&own[place(sign)])).collect())
        });
        let mesh = Mesh { elements: elements.collect(), nodes };
        let labels: HashMap<DofLabel, usize> =
            raw.dofs.as_ref().expect("labels").iter().copied().zip(0..).collect();
        let rows = ids.iter().flat_map(|&node| (1..=3).map(move |direction| DofLabel { node, direction }));
        let rows: Vec<usize> = rows.map(|label| labels[&label]).collect();
        let mut new = Self { mesh, rows, ids, k: DMatrix::zeros(0, 0), m: DMatrix::zeros(0, 0) };
        (new.k, new.m) = (new.by_nodes(&raw.stiffness.matrix), new.by_nodes(&raw.mass.matrix));
        new
    }

    /// Returns a matrix of the files by the nodes of the mesh.
    fn by_nodes(&self, matrix: &CscMatrix) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows.len(), self.rows.len(), |i, j| matrix.get(self.rows[i], self.rows[j]))
    }

    fn rigid(&self, about: Vector3<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(self.k.nrows(), 6, |row, c| {
            let unit = Vector3::ith(c % 3, 1.0);
            let arm = Vector3::from(self.mesh.nodes[row / 3]) - about;
            if c < 3 { unit[row % 3] } else { unit.cross(&arm)[row % 3] }
        })
    }

    /// Returns the unit load without the inertia forces that balance it.
    fn load(&self, raw: &RawModel, kind: &LoadKind, component: usize) -> DVector<f64> {
        let at = |name: &String, column: usize| {
            let set = raw.data.interfaces.iter().find(|set| set.name == *name).expect("an interface");
            let reference = Vector3::from(set.reference.point().expect("a point"));
            let is_member = |row: usize| set.nodes.contains(&self.ids[row / 3]);
            let mut own = self.rigid(reference);
            (0..own.nrows()).filter(|&row| !is_member(row)).for_each(|row| own.row_mut(row).fill(0.0));
            let inverse = (own.transpose() * &own).try_inverse().expect("spread nodes");
            (own * inverse).column(column).into_owned()
        };
        match kind {
            LoadKind::Force(name) => at(name, component),
            LoadKind::Moment(name) => at(name, 3 + component),
            LoadKind::Spin => {
                let (k, l) = LoadKind::SPIN[component];
                let skew = |k: usize| Vector3::ith(k, 1.0).cross_matrix();
                let twice: Matrix3<f64> =
                    if k == l { skew(k) * skew(k) } else { skew(k) * skew(l) + skew(l) * skew(k) };
                let field = |row: usize| (twice * Vector3::from(self.mesh.nodes[row / 3]))[row % 3];
                -(&self.m * DVector::from_fn(self.k.nrows(), |row, _| field(row)))
            }
            _ => panic!("no load of the script"),
        }
    }

    /// Returns the stress stiffness of the free body under a load, by element code.
    fn stress_stiffness(&self, load: &DVector<f64>) -> DMatrix<f64> {
        let rigid = self.rigid(Vector3::zeros());
        let mass = rigid.transpose() * &self.m * &rigid;
        let relief = mass.lu().solve(&(rigid.transpose() * load)).expect("a mass");
        let balanced = load - &self.m * &rigid * relief;
        let stiff = &self.k + &rigid * rigid.transpose() * (self.k.amax() / rigid.norm_squared());
        let moved = stiff.lu().solve(&balanced).expect("stiff");
        let matrix = self.mesh.geometric_stiffness(&Material::STEEL, moved.as_slice());
        let mut dense = DMatrix::zeros(self.k.nrows(), self.k.nrows());
        entries(&matrix).for_each(|(r, c, v)| dense[(r as usize, c as usize)] += v);
        dense
    }
}

#[test]
fn stress_stiffness_of_calculix_is_that_of_element_code() {
    for kind in ["stress_c3d8", "stress_c3d20"] {
        let folder = folder(kind);
        let place = folder.path();
        stressed(place);
        let told = done(place, "convert stressed.toml --modes 6 --lumped none -o body.h5");
        assert!(told.contains("FB451") && !told.contains("FB442"), "{told}");
        let raw =
            read_model(&read_manifest(place.join("stressed.toml")).expect("a manifest")).expect("a model");
        let reference = Reference::new(place, &raw);
        let kinds: Vec<&str> = raw.data.geometric_stiffness.iter().map(|one| one.load.kind.name()).collect();
        assert_eq!(kinds, ["spin", "force", "moment"]);
        for one in &raw.data.geometric_stiffness {
            let load = reference.load(&raw, &one.load.kind, one.load.component);
            let expected = reference.stress_stiffness(&load);
            let error = (reference.by_nodes(&one.matrix.matrix) - &expected).amax() / expected.amax();
            println!("{kind} {}: {error:.1e}, {} digits", one.load, one.matrix.digits);
            assert!(
                error < 1e-6 && one.matrix.digits >= 10,
                "{kind} {}: {error:e}, {} digits",
                one.load,
                one.matrix.digits
            );
        }
    }
}

#[test]
fn decks_have_the_stresses_and_hold_all_nodes() {
    let folder = folder("stress_c3d8");
    let place = folder.path();
    let script = fs::read_to_string(place.join("stiff.sh")).expect("a script");
    let line = "flexbody shapes plain.h5 --model model.toml --geometric-stiffness --stresses stiff.dat -o stiff.toml\n";
    assert!(script.contains(line) && script.ends_with("ccx -i stiff_17\nccx -i stiff_18\n"), "{script}");
    let deck = fs::read_to_string(place.join("stiff_04.inp")).expect("a deck");
    let (_, stresses) = deck.split_once("*INITIAL CONDITIONS, TYPE=STRESS\n").expect("stresses");
    let (stresses, steps) = stresses.split_once("*STEP\n").expect("steps");
    // Eight points of two elements.
    assert_eq!(stresses.lines().count(), 16);
    assert_eq!(
        steps,
        "*STATIC\n*BOUNDARY\nFLEXBODY_ALL, 1, 3\n*END STEP\n*STEP, PERTURBATION\n\
         *FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n*BOUNDARY, OP=NEW\n*END STEP\n"
    );
    let tables: toml::Table =
        fs::read_to_string(place.join("stiff.toml")).expect("tables").parse().expect("TOML");
    let tables = tables["geometric_stiffness"].as_array().expect("tables");
    assert_eq!(tables.len(), 18);
    assert_eq!(tables[3]["with_stress"].as_str(), Some("stiff_04.sti"));
    assert_eq!(tables[3]["spin"].as_str(), Some("xy"));
    assert_eq!((tables[17]["moment"].as_str(), tables[17]["interface"].as_str()), (Some("z"), Some("tip")));
    // The stress is as large as the modulus, so that the difference from K keeps its digits.
    let largest = stresses
        .lines()
        .flat_map(|line| line.split(", ").skip(2).map(|word| word.parse::<f64>().expect("a number")));
    let largest = largest.fold(0.0f64, |most, stress| most.max(stress.abs()));
    assert!((0.05..20.0).contains(&(largest / Material::STEEL.youngs)), "{largest:e}");
}

#[test]
fn other_stresses_and_matrices_without_stress_are_refused() {
    let folder = folder("stress_c3d8");
    let place = folder.path();
    let words = "shapes plain.h5 --model model.toml --geometric-stiffness";
    let printed = fs::read_to_string(place.join("stiff.dat")).expect("results");
    // Results of another body, or of a part of the loads.
    let (first, _) = printed.split_once("time  0.2000000E+01").expect("two steps");
    let first = &first[..first.rfind('\n').expect("lines")];
    fs::write(place.join("first.dat"), first).expect("written");
    let told = refused(place, &format!("{words} --stresses first.dat -o again.toml"));
    assert!(told.contains("FB326") && told.contains("expected those of 18 unit loads"), "{told}");
    // The first decimal of the first displacement.
    let at = printed.find("displacements").expect("displacements");
    let digit = at + printed[at..].find("E-0").expect("a number") - 6;
    let changed = if &printed[digit..=digit] == "5" { "6" } else { "5" };
    let other = [&printed[..digit], changed, &printed[digit + 1..]].concat();
    fs::write(place.join("other.dat"), other).expect("written");
    let told = refused(place, &format!("{words} --stresses other.dat -o again.toml"));
    assert!(told.contains("FB326") && told.contains("differ from those of its unit load"), "{told}");
    assert!(!place.join("again.toml").exists() && !place.join("again_01.inp").exists());
    // K itself.
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    for (file, code, part) in [
        ("job.sti", "FB452", "matrix with stress is K itself: it was written without the stress"),
        ("stiff_04.dof", "FB305", "one number on each line"),
    ] {
        let table = format!("[[geometric_stiffness]]\nwith_stress = \"{file}\"\nspin = \"xx\"\n");
        fs::write(place.join("wrong.toml"), format!("{manifest}{table}")).expect("written");
        let told = refused(place, "convert wrong.toml --modes 6 -o body.h5");
        assert!(told.contains(code) && told.contains(part), "{told}");
    }
    for (line, part) in [
        ("--to csv -o a.csv", "--geometric-stiffness applies to --to calculix"),
        ("-o a.txt", "give it the extension .inp"),
        ("--stresses stiff.dat -o a.inp", "give it the extension .toml"),
        ("--nodes all -o a.inp", "--nodes does not apply to --geometric-stiffness"),
    ] {
        let told = refused(place, &format!("{words} {line}"));
        assert!(told.contains(part), "{told}");
    }
}
