//! Shapes of a body for an FE program, and the recovery from its answers, through the command line.

use crate::program::flexbody;
use flexbody_body::flex_body::Recovery;
use flexbody_model::RecoveryOperator;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{Triangle, write_model};
use oracle::mesh::{Mesh, entries};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const OPTIONS: &[&str] = &["--modes", "5", "--lumped", "none", "--quiet"];

fn mesh() -> Mesh {
    Mesh::from_cells(ElementKind::Hex8, &oracle::mesh::grid([4, 1, 1]), |[x, y, z]| {
        [0.1 * x + 0.01 * y, 0.05 * y, 0.04 * z]
    })
}

/// Writes a block with its stresses as operator and two interfaces, its deck, and its body.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let (place, mesh) = (folder.path(), mesh());
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.data.recoveries = vec![mesh.stresses(&Material::STEEL)];
    write_model(place, &raw, Triangle::Lower);
    let RecoveryOperator::Rows { transposed, labels, .. } = &raw.data.recoveries[0].operator else {
        panic!("rows")
    };
    let (rows, columns) = (transposed.n_cols(), transposed.n_rows());
    let mut operator =
        format!("%%MatrixMarket matrix coordinate real general\n{rows} {columns} {}\n", transposed.nnz());
    for (row, column, value) in entries(transposed) {
        writeln!(operator, "{} {} {value:.17e}", column + 1, row + 1).expect("memory");
    }
    let mut table = "row,name,quantity,component,unit\n".to_owned();
    for (i, label) in labels.iter().enumerate() {
        writeln!(table, "{i},{},stress,{},Pa", label.name, label.component).expect("memory");
    }
    let ends = |x: f64| {
        let at_end = (1..).zip(&mesh.nodes).filter(|(_, p)| (p[0] - 0.01 * p[1] / 0.05 - x).abs() < 1e-9);
        at_end.map(|(id, _): (i64, _)| id.to_string()).collect::<Vec<_>>().join(", ")
    };
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    let manifest = format!(
        "{manifest}\n[[interface]]\nname = \"left\"\nnodes = [{}]\n[[interface]]\nname = \"right\"\nnodes = [{}]\n\
         [[recovery]]\nname = \"stress\"\noperator = \"R.mtx\"\nrows = \"rows.csv\"\n",
        ends(0.0),
        ends(0.4)
    );
    let mut deck = "*HEADING\n a block\n*NODE, NSET=NALL\n".to_owned();
    for (id, [x, y, z]) in (1..).zip(&mesh.nodes) {
        writeln!(deck, "{id}, {x:.15}, {y:.15}, {z:.15}").expect("memory");
    }
    deck += "*ELEMENT, TYPE=C3D8, ELSET=EALL\n";
    for (id, element) in (1..).zip(&mesh.elements) {
        let nodes: Vec<String> = element.1.iter().map(|node| (node + 1).to_string()).collect();
        writeln!(deck, "{id}, {}", nodes.join(", ")).expect("memory");
    }
    deck += "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*EXPANSION\n1e-5\n\
        *SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n*EQUATION\n2\n1, 1, 1., 2, 1, -1.\n*STEP\n*FREQUENCY\n5\n*END STEP\n";
    for (name, text) in
        [("R.mtx", operator), ("rows.csv", table), ("model.toml", manifest), ("part.inp", deck)]
    {
        fs::write(place.join(name), text).expect("written");
    }
    let words = [&["convert", "model.toml", "-o", "plain.h5"], OPTIONS].concat();
    assert!(flexbody(place, &words).status.success());
    folder
}

/// Runs a command that succeeds, and returns what it prints.
fn done(place: &Path, line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    let run = flexbody(place, &words);
    assert!(run.status.success(), "{line}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8_lossy(&run.stdout).into_owned()
}

/// Runs a command that fails, and returns its message.
fn refused(place: &Path, line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    let run = flexbody(place, &words);
    assert_eq!(run.status.code(), Some(2), "{line}");
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// Writes what an FE program answers to the shapes in `ask.csv`: the stresses at as many points of the elements as there
/// are nodes, as those of the nodes.
fn answer(place: &Path, decimals: usize) {
    let shapes = fs::read_to_string(place.join("ask.csv")).expect("shapes");
    let mut steps: Vec<Vec<f64>> = Vec::new();
    for line in shapes.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let step: usize = fields[0].parse().expect("a step");
        steps.resize(step.max(steps.len()), Vec::new());
        steps[step - 1].extend(fields[3..].iter().map(|value| value.parse::<f64>().expect("a number")));
    }
    let RecoveryOperator::Rows { transposed, .. } = mesh().stresses(&Material::STEEL).operator else {
        panic!("rows")
    };
    let mut out = "step,node,ux,uy,uz,sxx,syy,szz,sxy,syz,sxz\n".to_owned();
    for (step, u) in steps.iter().enumerate() {
        for at in 0..u.len() / 3 {
            write!(out, "{},{}", step + 1, at + 1).expect("memory");
            for value in &u[3 * at..3 * at + 3] {
                write!(out, ",{value:.decimals$e}").expect("memory");
            }
            for row in 6 * at..6 * at + 6 {
                let (rows, values) = transposed.column(row);
                let stress: f64 = rows.iter().zip(values).map(|(row, value)| value * u[*row as usize]).sum();
                write!(out, ",{stress:.decimals$e}").expect("memory");
            }
            out.push('\n');
        }
    }
    fs::write(place.join("answers.csv"), out).expect("written");
}

/// Returns the largest difference of the arrays of two recoveries in the rows of the first, relative to the largest entry
/// of each.
fn difference(a: &Recovery, b: &Recovery) -> f64 {
    let mut worst = 0.0f64;
    let loads = a.loads.iter().zip(&b.loads).map(|(a, b)| (&a.columns, &b.columns));
    for (a, b) in [(&a.modes, &b.modes), (&a.spin, &b.spin)].into_iter().chain(loads) {
        let same = b.as_ref().subrows(0, a.nrows());
        worst = worst.max((a - same).norm_max() / same.norm_max());
    }
    worst
}

#[test]
fn answers_to_shapes_are_the_recovery_of_the_operator() {
    let folder = folder();
    let place = folder.path();
    let text = done(place, "shapes plain.h5 --model model.toml --to csv -o ask.csv");
    assert!(text.contains("23 shapes: 5 modes and 18 static columns"), "{text}");
    let manifest = fs::read_to_string(place.join("model.toml")).expect("a manifest");
    let recovery = "[[recovery]]\nname = \"asked\"\nshapes = \"answers.csv\"\ndisplacements = \"ask.npz\"\n";
    fs::write(place.join("both.toml"), manifest + recovery).expect("written");
    for (decimals, limit) in [(15, 1e-9), (6, 1e-5)] {
        answer(place, decimals);
        done(place, &format!("convert both.toml -o body.h5 {}", OPTIONS.join(" ")));
        let body = flexbody_file::read(place.join("body.h5")).expect("a body");
        let [expected, found] = body.recoveries() else { panic!("two recoveries") };
        assert_eq!((found.rows[0].name.as_str(), found.rows[0].unit.as_str()), ("n1 xx", "Pa"));
        assert!(difference(found, expected) < limit, "{decimals}: {}", difference(found, expected));
    }
    // Results of other shapes: those of a body with other modes.
    done(place, "convert model.toml -o other.h5 --modes 4 --lumped none --quiet");
    done(place, "shapes other.h5 --model model.toml --to npz -o ask.npz");
    let message = refused(place, &format!("convert both.toml -o new.h5 {}", OPTIONS.join(" ")));
    assert!(message.contains("FB326") && message.contains("23 steps"), "{message}");
    assert!(!place.join("new.h5").exists());
}

#[test]
fn a_deck_has_a_step_with_the_displacements_of_each_shape() {
    let folder = folder();
    let place = folder.path();
    let text = done(place, "shapes plain.h5 --model model.toml --deck part.inp --nodes all -o ask.inp");
    assert!(text.contains("cards of the deck that are left out: *EXPANSION, *EQUATION"), "{text}");
    assert!(text.contains("ccx ask") && text.contains("shapes = \"ask.frd\""), "{text}");
    let deck = fs::read_to_string(place.join("ask.inp")).expect("a deck");
    assert_eq!(deck.matches("*STEP\n*STATIC\n*BOUNDARY\n").count(), 23);
    assert!(!deck.contains("EQUATION") && !deck.contains("FREQUENCY") && !deck.contains("EXPANSION"));
    assert!(
        deck.contains("*ELEMENT, TYPE=C3D8, ELSET=EALL\n1, ") && deck.contains("*ELASTIC\n2.1e11, 0.3\n")
    );
    let boundaries: Vec<&str> = deck.lines().filter(|line| line.matches(',').count() == 3).collect();
    let given: Vec<&&str> = boundaries.iter().filter(|line| line.contains('e')).collect();
    assert_eq!(given.len(), 23 * 3 * mesh().nodes.len());
    assert!(given.iter().all(|line| line.split(',').all(|field| field.len() <= 20)));
    // The largest displacement of each shape is a thousandth of the size of the part.
    let last =
        |line: &&&str| line.rsplit(',').next().expect("a value").parse::<f64>().expect("a number").abs();
    let largest = given.iter().map(last).fold(0.0, f64::max);
    assert!((4.0e-4..4.2e-4).contains(&largest), "{largest}");
    let points = "shapes plain.h5 --model model.toml --deck part.inp --at integration-points -o points.inp";
    assert!(done(place, points).contains("shapes = \"points.dat\""));
}

#[test]
fn bodies_and_decks_of_other_models_are_refused() {
    let folder = folder();
    let place = folder.path();
    let deck = fs::read_to_string(place.join("part.inp")).expect("a deck");
    let ask = "shapes plain.h5 --model model.toml -o ask.inp";
    assert!(refused(place, ask).contains("--to calculix needs the deck"));
    for (from, to, part) in [
        ("1, 0.000000000000000, 0", "1, 0.010000000000000, 0", "FB125"),
        ("*EQUATION", "*SHELL SECTION, ELSET=EALL", "FB111"),
        ("TYPE=C3D8", "TYPE=S8", "FB111"),
        (
            "*STEP\n",
            "*ELEMENT, TYPE=C3D4\n99, 1, 2, 3, 777\n*STEP\n",
            "node 777 of the elements is not a node",
        ),
    ] {
        fs::write(place.join("other.inp"), deck.replacen(from, to, 1)).expect("written");
        let message = refused(place, &format!("{ask} --deck other.inp"));
        assert!(message.contains(part), "{to}: {message}");
    }
    assert!(
        refused(place, &format!("{ask} --to csv --deck part.inp"))
            .contains("--deck applies to --to calculix")
    );
    assert!(
        refused(place, "shapes plain.h5 --model model.toml --deck part.inp -o ask.npz").contains("FB801")
    );
    fs::write(place.join("some.csv"), "node\n1\n888\n").expect("written");
    assert!(refused(place, &format!("{ask} --deck part.inp --nodes some.csv")).contains("888"));
    // A model of another stiffness.
    let mesh = mesh();
    let softer = Material { youngs: 0.9 * Material::STEEL.youngs, ..Material::STEEL };
    let soft = place.join("soft");
    fs::create_dir(&soft).expect("a folder");
    write_model(&soft, &mesh.assemble(&softer, MassRule::Consistent).raw_model(), Triangle::Lower);
    let message = refused(place, "shapes plain.h5 --model soft/model.toml --to csv -o ask.csv");
    assert!(message.contains("FB707") && message.contains("stiffness"), "{message}");
    assert!(!place.join("ask.inp").exists() && !place.join("ask.npz").exists());
}
