//! Pins, hinges and sliders: grids some of whose components follow others by constraints of the deck, while the others
//! have rows of their own.

use crate::program::flexbody;
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_input::{ModelFiles, read_model};
use flexbody_model::{FeModel, RawModel};
use oracle::beams::chain;
use oracle::jobs::body;
use oracle::reference::modes_of;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Numbers of the grids of the two chains, which make a ring: 14 is rigidly fixed to 1, and some components of 11 to 4.
const GRIDS: [[i64; 4]; 2] = [[1, 2, 3, 4], [11, 12, 13, 14]];

/// Row of a component of a grid in the g-set.
fn row(grid: i64, component: usize) -> usize {
    let at = GRIDS.concat().iter().position(|id| *id == grid).expect("a grid");
    6 * at + component - 1
}

/// Two chains of beams that nothing joins, with their g-set matrices.
struct Chains {
    places: Vec<[f64; 3]>,
    stiffness: Mat<f64>,
    mass: Mat<f64>,
}

impl Chains {
    /// Puts the first grid of the second chain at `gap` from the last one of the first chain.
    fn new(gap: [f64; 3]) -> Self {
        let first = [[0.0, 0.0, 0.0], [0.3, 0.05, 0.0], [0.6, 0.0, 0.1], [0.9, 0.1, 0.1]];
        let steps = [[0.0; 3], [0.1, 0.25, 0.05], [0.1, 0.45, 0.2], [0.3, 0.7, 0.2]];
        let second = steps.map(|step| [0, 1, 2].map(|k| first[3][k] + gap[k] + step[k]));
        let mut stiffness = Mat::zeros(48, 48);
        let mut mass = Mat::zeros(48, 48);
        for (number, places) in [first, second].iter().enumerate() {
            let raw = chain("chain", places);
            let label = raw.dofs.as_deref().expect("labels");
            let to = |at: usize| {
                let node = raw.nodes.ids.iter().position(|id| *id == label[at].node).expect("a node");
                row(GRIDS[number][node], usize::from(label[at].direction))
            };
            for (all, part) in [(&mut stiffness, &raw.stiffness), (&mut mass, &raw.mass)] {
                for column in 0..part.matrix.n_cols() {
                    let (rows, values) = part.matrix.column(column);
                    rows.iter().zip(values).for_each(|(at, v)| all[(to(*at as usize), to(column))] = *v);
                }
            }
        }
        Self { places: [first, second].concat(), stiffness, mass }
    }

    /// Writes the deck with `control` and `cards`, and the matrices by the rows `kept`, named K and M with `set`.
    fn write(
        &self,
        folder: &Path,
        [control, cards]: [&str; 2],
        matrices: [&Mat<f64>; 2],
        set: &str,
    ) -> PathBuf {
        let mut deck = format!("SOL 103\nCEND\n{control}BEGIN BULK\nPARAM,COUPMASS,1\n");
        for (id, [x, y, z]) in GRIDS.concat().iter().zip(&self.places) {
            writeln!(deck, "GRID*,{id},,{x},{y}\n*,{z}").expect("memory");
        }
        write!(deck, "CBAR,1,1,1,2,0.,0.,1.\n{cards}ENDDATA\n").expect("memory");
        let mut text = String::new();
        for (letter, matrix) in ["K", "M"].iter().zip(matrices) {
            let n = matrix.nrows();
            let name = format!("{letter}{set}");
            writeln!(text, "{n:8}{:8}{:8}{:8}{name:8}1P,3E24.16", -(n as i64), 6, 2).expect("memory");
            for j in 0..n {
                writeln!(text, "{:8}{:8}{:8}\n{:8}{:8}", j + 1, 0, 2 * n + 2, 2 * n + 1, 1).expect("memory");
                for first in (0..n).step_by(3) {
                    let of_line = (first..n.min(first + 3)).map(|i| format!("{:24.16E}", matrix[(i, j)]));
                    writeln!(text, "{}", of_line.collect::<String>()).expect("memory");
                }
            }
            writeln!(text, "{:8}{:8}{:8}\n{:24.16E}", n + 1, 1, 1, 2f64.sqrt()).expect("memory");
        }
        let path = folder.join("job.bdf");
        fs::write(&path, deck).expect("written");
        fs::write(folder.join("job.op4"), text).expect("written");
        path
    }

    /// Returns T' A T without the dependent rows: each is the sum of rows with factors.
    fn reduced(&self, dependent: &[(usize, Vec<(usize, f64)>)]) -> [Mat<f64>; 2] {
        let kept: Vec<usize> = (0..48).filter(|row| dependent.iter().all(|(of, _)| of != row)).collect();
        let place = |row: usize| kept.iter().position(|other| *other == row).expect("independent");
        let mut t = Mat::zeros(48, kept.len());
        kept.iter().enumerate().for_each(|(column, row)| t[(*row, column)] = 1.0);
        for (of, sum) in dependent {
            sum.iter().for_each(|(to, factor)| t[(*of, place(*to))] = *factor);
        }
        [&self.stiffness, &self.mass].map(|a| t.transpose() * a * &t)
    }
}

/// Card that closes the ring.
const CLOSED: &str = "RBE2,51,1,123456,14\n";

/// Returns the dependent rows of a grid for these components, by a rigid arm from another grid.
fn rigid([from, to]: [i64; 2], components: &[usize], arm: [f64; 3]) -> Vec<(usize, Vec<(usize, f64)>)> {
    let follow = |&component: &usize| {
        let mut sum = vec![(row(from, component), 1.0)];
        if component <= 3 {
            // Component k of theta x r.
            let (k, l) = (component % 3 + 1, (component + 1) % 3 + 1);
            sum.extend([(row(from, 3 + k), arm[l - 1]), (row(from, 3 + l), -arm[k - 1])]);
        }
        (row(to, component), sum)
    };
    components.iter().map(follow).collect()
}

fn read(path: &Path) -> RawModel {
    read_model(&ModelFiles::from_job(path, None, Vec::new(), Some("m,kg,s")).expect("files"))
        .expect("a model")
}

/// Every form has the modes of the constrained matrices, and grid 11 is a node whose motion fulfils the constraint.
#[test]
fn released_components_of_grids_leave_a_model_with_the_modes_of_the_constrained_matrices() {
    const MPC: &str = "MPC,7,11,1,1.,4,1,-1.\nMPC,7,11,2,1.,4,2,-1.\nMPC,7,11,3,1.,4,3,-1.\n";
    let at_place = [0.0; 3];
    let arm = [0.03, -0.02, 0.05];
    for (name, gap, control, cards, components) in [
        ("pin", at_place, "", "RBE2,50,4,123,11\n", &[1, 2, 3][..]),
        ("pin by sums", at_place, "MPC = 7\n", MPC, &[1, 2, 3]),
        ("pin on an arm", arm, "", "RBE2,50,4,123,11\n", &[1, 2, 3]),
        ("hinge", at_place, "", "RBE2,50,4,12345,11\n", &[1, 2, 3, 4, 5]),
        ("hinge on an arm", arm, "", "RBE2,50,4,12346,11\n", &[1, 2, 3, 4, 6]),
        ("slider", at_place, "", "RBE2,50,4,13456,11\n", &[1, 3, 4, 5, 6]),
    ] {
        let chains = Chains::new(gap);
        let dependent = rigid([4, 11], components, gap);
        let across = [0, 1, 2].map(|k| chains.places[7][k] - chains.places[0][k]);
        let closing = rigid([1, 14], &[1, 2, 3, 4, 5, 6], across);
        let reduced = chains.reduced(&[dependent.clone(), closing].concat());
        let cards = format!("{cards}{CLOSED}");
        let expected = modes_of(&reduced[0], &reduced[1]).eigenvalues;
        let before = [&chains.stiffness, &chains.mass];
        for (matrices, set) in [(before, "GG"), ([&reduced[0], &reduced[1]], "AA")] {
            let folder = tempfile::tempdir().expect("a folder");
            let path = chains.write(folder.path(), [control, &cards], matrices, set);
            let body = body(read(&path), 8);
            let modes = body.modes();
            let own = &modes.eigenvalue;
            for (own, expected) in own.iter().zip(&expected) {
                assert!((own / expected - 1.0).abs() < 1e-8, "{name}, {set}: {own:e} {expected:e}");
            }
            let at = |grid: i64| body.nodes().ids.iter().position(|id| *id == grid).expect("a node");
            let rotation = modes.rotation.as_ref().expect("rotations");
            for j in 0..own.len() {
                let value = |of: usize| {
                    let (grid, k) = (GRIDS.concat()[of / 6], of % 6);
                    let shapes = if k < 3 { &modes.shape } else { rotation };
                    shapes[(3 * at(grid) + k % 3, j)]
                };
                for (of, sum) in &dependent {
                    let follows: f64 = sum.iter().map(|(row, factor)| factor * value(*row)).sum();
                    // Shapes of unit mass have displacements of about 10; rounding of the condensed rows.
                    assert!((value(*of) - follows).abs() < 1e-9, "{name}, {set}: {} {follows}", value(*of));
                }
            }
        }
    }
}

/// A load at a dependent component acts on those that it follows: the interface is refused by their names.
#[test]
fn an_interface_at_a_pinned_grid_names_the_grid_that_it_follows() {
    let chains = Chains::new([0.0; 3]);
    let folder = tempfile::tempdir().expect("a folder");
    let matrices = [&chains.stiffness, &chains.mass];
    let path = chains.write(folder.path(), ["", &format!("RBE2,50,4,123,11\n{CLOSED}")], matrices, "GG");
    let words = |node: &'static str| {
        ["convert", "job.bdf", "--units", "m,kg,s", "--modes", "4", "-o", "b.h5", "--interface", node]
    };
    let refused = flexbody(folder.path(), &words("a=nodes:11,rigid"));
    let told = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{told}");
    assert!(
        told.contains("error[FB209]") && told.contains("name the nodes that they follow instead: 4"),
        "{told}"
    );
    assert!(flexbody(folder.path(), &words("a=nodes:4,rigid")).status.success());
    let checked = FeModel::from_raw(read(&path)).expect("a model");
    let mut notes = checked.diagnostics.iter().filter(|note| note.code() == Code::DeckConstrained);
    assert!(notes.any(|note| note.message().contains("nodes 11")));
}
