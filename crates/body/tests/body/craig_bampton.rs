//! Craig-Bampton and Craig-Chang bases compared with dense solutions that use only the matrix type of the
//! library.

mod free_body;
mod sharing;
mod slender;
mod without_mass;

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton, CraigChang, Loads, ModalBasis, ModeSettings};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::BodyFrame;
use flexbody_body::verification::{body_identities, verify};
use flexbody_eigen::{Accuracy, FactorChoice, Method, Precision, Wanted};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_linalg::{CscMatrix, gram};
use flexbody_model::{Coupling, NodeSet, RawModel, Reference};
use oracle::brackets::{bracket, strip};
use oracle::craig_bampton::{
    body, close, converted, craig_bampton, fixed, lowest, model, modes_of, modes_within,
};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;
use oracle::reference::{dense, symmetric_eigen};
use std::collections::HashSet;

const COUPLINGS: [[Coupling; 2]; 5] = [
    [Coupling::Rigid, Coupling::Rigid],
    [Coupling::Averaging, Coupling::Averaging],
    [Coupling::Rigid, Coupling::Averaging],
    [Coupling::Averaging, Coupling::Free],
    [Coupling::Free, Coupling::Rigid],
];

fn models() -> Vec<RawModel> {
    let apart = COUPLINGS.into_iter().flat_map(|c| [bracket(c), strip(c)]);
    apart.chain(sharing::models()).collect()
}

/// Dense oracle from definitions: K, M, D, a basis Z of the motions with zero interface coordinates, and the
/// weights C that give the coordinates.
struct Dense {
    k: Mat<f64>,
    m: Mat<f64>,
    motion: Mat<f64>,
    held: Mat<f64>,
    weights: Mat<f64>,
    rigid: Mat<f64>,
}

impl Dense {
    fn new(raw: &RawModel) -> Self {
        let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
        let (n, d) = (k.nrows(), usize::from(raw.dimension));
        let x = &raw.nodes.positions;
        let mut motion: Vec<Vec<f64>> = Vec::new();
        let mut weights: Vec<Vec<f64>> = Vec::new();
        let mut constraints: Vec<Vec<f64>> = Vec::new();
        // Nodes whose displacements an interface prescribes do not contribute to the mean of another
        // interface.
        let prescribed: HashSet<i64> = raw
            .data
            .interfaces
            .iter()
            .filter(|set| set.coupling != Some(Coupling::Averaging))
            .flat_map(|set| set.nodes.iter().copied())
            .collect();
        for set in &raw.data.interfaces {
            let nodes: Vec<usize> = set.nodes.iter().map(|id| (*id - 1) as usize).collect();
            let rows: Vec<usize> = nodes.iter().flat_map(|i| (0..d).map(move |c| d * i + c)).collect();
            let column = |values: &dyn Fn(usize) -> f64| {
                let mut column = vec![0.0; n];
                rows.iter().enumerate().for_each(|(i, &row)| column[row] = values(i));
                column
            };
            let coupling = set.coupling.expect("stated");
            let first = weights.len();
            if coupling == Coupling::Free {
                for j in 0..rows.len() {
                    motion.push(column(&|i| f64::from(i == j)));
                    weights.push(column(&|i| f64::from(i == j)));
                }
            } else {
                let mean = |c: usize| nodes.iter().map(|&i| x[i][c]).sum::<f64>() / nodes.len() as f64;
                let reference = match set.reference {
                    Reference::Point(x) => x,
                    _ => [mean(0), mean(1), mean(2)],
                };
                let r = rigid(&nodes.iter().map(|&i| x[i]).collect::<Vec<_>>(), d, reference);
                let normal = r.transpose() * &r;
                let a = normal.partial_piv_lu().solve(r.transpose()).transpose().to_owned();
                let follows =
                    |i: usize| coupling == Coupling::Rigid || !prescribed.contains(&set.nodes[i / d]);
                for j in 0..r.ncols() {
                    motion.push(column(&|i| if follows(i) { r[(i, j)] } else { 0.0 }));
                    weights.push(column(&|i| a[(i, j)]));
                }
            }
            if coupling == Coupling::Averaging {
                // Weights are normalised because rotations have other units.
                constraints.extend(weights[first..].iter().map(|w| {
                    let size = w.iter().map(|v| v * v).sum::<f64>().sqrt();
                    w.iter().map(|v| v / size).collect::<Vec<_>>()
                }));
            } else {
                let unit = |&row: &usize| (0..n).map(|i| f64::from(i == row)).collect::<Vec<_>>();
                constraints.extend(rows.iter().map(unit));
            }
        }
        let matrix = |columns: &[Vec<f64>]| Mat::from_fn(n, columns.len(), |i, j| columns[j][i]);
        let held = complement(&matrix(&constraints));
        let rigid = rigid(x, d, [0.0; 3]);
        let (motion, weights) = (matrix(&motion), matrix(&weights));
        let free = |row: usize| !prescribed.contains(&((row / d) as i64 + 1));
        let motion = sharing::with_unit_coordinates(motion, &weights, free);
        Self { k, m, motion, held, weights, rigid }
    }

    /// Returns the eigenvalues of K, M within the span of `basis`, ascending, without the zero ones.
    fn eigenvalues(&self, basis: MatRef<'_, f64>, zero: usize) -> Vec<f64> {
        let (k, m) = (basis.transpose() * &self.k * basis, basis.transpose() * &self.m * basis);
        let shift = 1e-4 * trace(&k) / trace(&m);
        let l = (&k + faer::Scale(shift) * &m).llt(faer::Side::Lower).expect("positive definite");
        let half = |a: &Mat<f64>| l.L().partial_piv_lu().solve(a);
        let reduced = half(&half(&m).transpose().to_owned());
        let (theta, _) = symmetric_eigen(reduced.as_ref());
        theta.iter().rev().skip(zero).map(|t| 1.0 / t - shift).collect()
    }

    /// Returns a basis of all motions that the couplings allow.
    fn allowed(&self) -> Mat<f64> {
        let columns: Vec<_> = self.motion.col_iter().chain(self.held.col_iter()).collect();
        Mat::from_fn(self.k.nrows(), columns.len(), |i, j| columns[j][i])
    }

    /// Returns the unit loads on the interface coordinates minus the inertia forces of the rigid motion that
    /// they cause.
    fn relieved(&self) -> Mat<f64> {
        let mass = self.rigid.transpose() * &self.m * &self.rigid;
        let resultants = self.rigid.transpose() * &self.weights;
        &self.weights - &self.m * (&self.rigid * mass.partial_piv_lu().solve(resultants))
    }

    /// Returns the deformations within the span of `basis`, M-orthogonal to rigid motion, caused by
    /// self-equilibrated forces.
    fn responses(&self, basis: Mat<f64>, forces: MatRef<'_, f64>) -> Mat<f64> {
        let (values, vectors) = symmetric_eigen((basis.transpose() * &self.k * &basis).as_ref());
        let largest = values[values.len() - 1];
        let amplitudes = vectors.transpose() * (basis.transpose() * forces);
        let amplitudes = Mat::from_fn(amplitudes.nrows(), amplitudes.ncols(), |i, j| {
            if values[i] > 1e-11 * largest { amplitudes[(i, j)] / values[i] } else { 0.0 }
        });
        let u = &basis * (vectors * amplitudes);
        let mass = self.rigid.transpose() * &self.m * &self.rigid;
        let along = mass.partial_piv_lu().solve(self.rigid.transpose() * (&self.m * &u));
        &u - &self.rigid * along
    }

    /// Returns loads on the coordinates without resultants: a basis of the null space of their rigid motion.
    fn equilibrated(&self) -> Mat<f64> {
        complement(&(self.weights.transpose() * &self.rigid))
    }
}

/// Returns an orthonormal basis of the complement of the independent columns of `a`.
fn complement(a: &Mat<f64>) -> Mat<f64> {
    let q = a.qr().compute_Q();
    q.as_ref().subcols(a.ncols(), a.nrows() - a.ncols()).to_owned()
}

fn trace(a: &Mat<f64>) -> f64 {
    (0..a.nrows()).map(|i| a[(i, i)]).sum()
}

/// Returns the rigid motions of points about another point.
fn rigid(x: &[[f64; 3]], d: usize, about: [f64; 3]) -> Mat<f64> {
    let turns: &[[f64; 3]] =
        if d == 2 { &[[0.0, 0.0, 1.0]] } else { &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };
    Mat::from_fn(d * x.len(), d + turns.len(), |row, j| {
        let (i, c) = (row / d, row % d);
        if j < d {
            return f64::from(c == j);
        }
        let (w, r) = (turns[j - d], [0, 1, 2].map(|c| x[i][c] - about[c]));
        [w[1] * r[2] - w[2] * r[1], w[2] * r[0] - w[0] * r[2], w[0] * r[1] - w[1] * r[0]][c]
    })
}

/// Returns Psi Lambda^-1 Psi' F.
fn modal_responses(basis: &ModalBasis, forces: MatRef<'_, f64>) -> Mat<f64> {
    let (vectors, lambda) = (&basis.solution.vectors, &basis.solution.eigenvalues);
    let modal = vectors.transpose() * forces;
    vectors * Mat::from_fn(modal.nrows(), modal.ncols(), |p, j| modal[(p, j)] / lambda[p])
}

#[test]
fn fixed_interface_modes_are_those_of_the_held_body() {
    for raw in models() {
        let (what, oracle) = (format!("{:?}", raw.data.interfaces), Dense::new(&raw));
        let expected = oracle.eigenvalues(oracle.held.as_ref(), 0);
        let model = model(raw);
        for (method, factor) in [
            (Method::Dense, FactorChoice::Auto),
            (Method::Lanczos, FactorChoice::Always(Precision::Double)),
            (Method::Lanczos, FactorChoice::Always(Precision::Single)),
        ] {
            let settings = ModeSettings { method, factor, ..lowest(9) };
            let basis = modes_of(&model, &CraigBampton, &settings).expect("a basis");
            let found = fixed(&basis);
            assert_eq!(found.len(), 9);
            for (found, expected) in found.iter().zip(&expected) {
                close(*found, *expected, 1e-9, &what);
            }
        }
        let remark = craig_bampton(&model, 9).solution.completeness.remark;
        assert!(remark.contains("its 9 fixed-interface modes are all there are below"), "{remark}");
    }
}

#[test]
fn static_responses_to_interface_loads_are_exact() {
    for raw in models() {
        let (what, oracle, d) =
            (format!("{:?}", raw.data.interfaces), Dense::new(&raw), usize::from(raw.dimension));
        let loads = oracle.equilibrated();
        assert_eq!(loads.ncols(), oracle.weights.ncols() - if d == 2 { 3 } else { 6 });
        let forces = &oracle.weights * &loads;
        let exact = oracle.responses(oracle.allowed(), forces.as_ref());
        // Only the static shapes matter for these responses.
        let found = modal_responses(&craig_bampton(&model(raw), 1), forces.as_ref());
        for j in 0..loads.ncols() {
            let error = (found.col(j) - exact.col(j)).norm_l2() / exact.col(j).norm_l2();
            assert!(error < 1e-9, "{what}, load {j}: {error:e}");
        }
    }
}

#[test]
#[ignore = "slow"]
fn free_frequencies_come_from_above_to_those_of_the_body() {
    for raw in models() {
        let (what, oracle) = (format!("{:?}", raw.data.interfaces), Dense::new(&raw));
        let zero = if raw.dimension == 2 { 3 } else { 6 };
        let exact = oracle.eigenvalues(oracle.allowed().as_ref(), zero);
        let model = model(raw);
        let mut before = [f64::INFINITY; 8];
        for count in [4, 10, 25, usize::MAX] {
            let found = craig_bampton(&model, count).solution.eigenvalues;
            for (j, before) in before.iter_mut().enumerate().take(found.len()) {
                assert!(found[j] <= *before * (1.0 + 1e-10), "{what}, mode {j}: {} after {before}", found[j]);
                assert!(
                    found[j] >= exact[j] * (1.0 - 1e-9),
                    "{what}, mode {j}: {} below {}",
                    found[j],
                    exact[j]
                );
                *before = found[j];
            }
        }
        for (j, found) in before.iter().enumerate() {
            close(*found, exact[j], 1e-9, &what);
        }
    }
}

/// The rows of the interfaces give the modal amplitudes of loads at the reference points: they equal those of
/// the nodal loads.
#[test]
fn rows_of_the_interfaces_are_the_motion_of_the_reference_points() {
    for raw in models() {
        let (oracle, d) = (Dense::new(&raw), usize::from(raw.dimension));
        let couplings: Vec<_> = raw.data.interfaces.iter().map(|set| set.coupling.expect("stated")).collect();
        let model = model(raw);
        let body = body(&model, 6);
        let axes = body.frame().axes;
        let nf = body.n_modes();
        // Shapes in model axes, by matrix rows, which are in internal order here.
        let shape = &body.modes().shape;
        let in_model = Mat::from_fn(oracle.k.nrows(), nf, |row, j| {
            (0..3).map(|l| axes[(row % d, l)] * shape[(3 * (row / d) + l, j)]).sum::<f64>()
        });
        let measured = oracle.weights.transpose() * &in_model;
        let mut first = 0;
        for (interface, coupling) in body.interfaces().iter().zip(couplings) {
            assert_eq!(interface.coupling, Some(coupling));
            let Some(rows) = interface.rows(body.nodes(), shape.as_ref(), None, d) else {
                assert_eq!(coupling, Coupling::Free);
                first += d * interface.nodes.len();
                continue;
            };
            let rotation = rows.rotation.as_ref().expect("nodes on no line");
            for j in 0..nf {
                let turned = |v: &Mat<f64>, c: usize| (0..3).map(|l| axes[(c, l)] * v[(l, j)]).sum::<f64>();
                let scale = measured.norm_max();
                for c in 0..d {
                    assert!((turned(&rows.translation, c) - measured[(first + c, j)]).abs() < 1e-12 * scale);
                }
                for (row, c) in if d == 2 { vec![(2, 2)] } else { vec![(3, 0), (4, 1), (5, 2)] } {
                    assert!((turned(rotation, c) - measured[(first + row, j)]).abs() < 1e-12 * scale);
                }
            }
            let (_, deformation) = rows.deformation();
            if coupling == Coupling::Rigid {
                assert!(deformation < 1e-12, "{deformation:e}");
            } else {
                assert!(deformation > 1e-3, "{deformation:e}");
            }
            first += if d == 2 { 3 } else { 6 };
        }
    }
}

#[test]
fn every_identity_holds() {
    for raw in models() {
        let model = model(raw);
        for &frame in BodyFrame::ALL {
            let basis = BasisChoice::CraigBampton(CraigBampton);
            let body = converted(&model, basis, 7, frame).body;
            assert_eq!(body.parts().interface_identities().len(), 4);
            let mut checks = body_identities(&body);
            checks.extend(verify(&body, &model).expect("the same nodes"));
            for check in checks {
                assert!(check.passed, "{}: {:e} > {:e}", check.name, check.value, check.limit);
            }
        }
    }
}

#[test]
fn interface_coordinates_hold_the_modes_and_as_many_rigid_motions() {
    for raw in models() {
        let zero = if raw.dimension == 2 { 3 } else { 6 };
        let body = body(&model(raw), 6);
        let coordinates = body.coordinates().expect("a Craig-Bampton basis");
        let size = coordinates.names.len();
        assert_eq!(size, body.n_modes() + zero);
        let energies = symmetric_eigen(coordinates.stiffness.as_ref()).0;
        let positive = energies.iter().filter(|e| **e > 1e-13 * energies[size - 1]).count();
        assert_eq!(positive, size - zero, "{energies:?}");
        // K x = lambda M x is reduced by the Cholesky factor of M, which is positive definite.
        let l = coordinates.mass.llt(faer::Side::Lower).expect("positive definite");
        let half = |a: &Mat<f64>| l.L().partial_piv_lu().solve(a);
        let reduced = half(&half(&coordinates.stiffness).transpose().to_owned());
        let lambda = symmetric_eigen(reduced.as_ref()).0;
        let first = body.modes().eigenvalue[0];
        assert!(lambda[..zero].iter().all(|l| l.abs() < 1e-7 * first), "{lambda:?}");
        for (found, expected) in lambda[zero..].iter().zip(&body.modes().eigenvalue) {
            close(*found, *expected, 1e-8, "lambda");
        }
    }
}

/// Returns the names of the failed checks of the interface coordinates.
fn broken(body: &FlexBody) -> Vec<String> {
    let checks = body.parts().interface_identities();
    assert_eq!(checks.len(), 4);
    let wrong = checks.iter().filter(|check| !check.passed);
    wrong.map(|check| format!("{}: {:e} > {:e}", check.name, check.value, check.limit)).collect()
}

/// A K with few digits annihilates rigid motion poorly, and a slender body amplifies that: the rigid mass
/// must remain exact.
#[test]
fn few_digits_of_a_slender_body_do_not_reach_its_rigid_motion() {
    let mesh = Mesh::block(ElementKind::Hex8, [30, 1, 1], [3.0, 0.05, 0.04]);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let digits = 11;
    let rounded = |v: f64| format!("{v:.*e}", digits - 1).parse::<f64>().expect("a number");
    let entries: Vec<_> =
        oracle::mesh::entries(&raw.stiffness.matrix).map(|(r, c, v)| (r, c, rounded(v))).collect();
    let n = raw.stiffness.matrix.n_cols();
    raw.stiffness.matrix = CscMatrix::from_triplets(n, n, &entries);
    raw.stiffness.digits = digits as u8;
    let x = &raw.nodes.positions;
    let end = |at: f64| (0..x.len()).filter(|&i| (x[i][0] - at).abs() < 1e-9).map(|i| i as i64 + 1).collect();
    let ends: [Vec<i64>; 2] = [end(0.0), end(3.0)];
    for coupling in [Coupling::Rigid, Coupling::Averaging, Coupling::Free] {
        raw.data.interfaces = ["first", "second"]
            .into_iter()
            .zip(&ends)
            .map(|(name, nodes)| NodeSet { coupling: Some(coupling), ..NodeSet::new(name, nodes.clone()) })
            .collect();
        let body = body(&model(raw.clone()), 6);
        assert!(body.certificate().rigid_noise > 1e-9, "{:e}", body.certificate().rigid_noise);
        assert_eq!(broken(&body), [""; 0], "{coupling:?}");
        let coordinates = body.coordinates().expect("coordinates");
        assert_eq!(coordinates.names.len(), body.n_modes() + 6);
    }
}

/// Reduced integration leaves patterns without mass, also among motions of single nodes: they are removed and
/// reported, and the other modes keep their digits.
#[test]
fn motions_without_mass_are_left_out_and_told() {
    let folder = oracle::fixtures().join("models/bar_c3d8r");
    let files = read_manifest(folder.join("model.toml")).expect("a fixture");
    let mut raw = read_model(&files).expect("a fixture");
    let along = |axis: usize| {
        let x = raw.nodes.positions.iter().map(|x| x[axis]);
        (x.clone().fold(f64::INFINITY, f64::min), x.fold(f64::NEG_INFINITY, f64::max))
    };
    let axis = (0..3).max_by(|&a, &b| (along(a).1 - along(a).0).total_cmp(&(along(b).1 - along(b).0)));
    let axis = axis.expect("three axes");
    let (low, high) = along(axis);
    let end = |at: f64| {
        let near = |i: &usize| (raw.nodes.positions[*i][axis] - at).abs() < 1e-6 * (high - low);
        (0..raw.nodes.len()).filter(near).map(|i| raw.nodes.ids[i]).collect::<Vec<_>>()
    };
    let free = |name: &str, nodes| NodeSet { coupling: Some(Coupling::Free), ..NodeSet::new(name, nodes) };
    raw.data.interfaces = vec![free("low", end(low)), free("high", end(high))];
    let done = converted(&model(raw), BasisChoice::CraigBampton(CraigBampton), 8, BodyFrame::Principal);
    let told = done.diagnostics.iter().find(|d| d.code() == Code::ShapesDependent).expect("told");
    assert!(told.message().contains("move no mass"), "{}", told.message());
    assert_eq!(broken(&done.body), [""; 0]);
}

#[test]
fn the_same_bits_at_any_number_of_threads() {
    let model = model(bracket([Coupling::Rigid, Coupling::Averaging]));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| body(&model, 8))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(3));
}

/// The position of the reference point changes the coordinates, but not their span.
#[test]
fn the_span_does_not_depend_on_the_reference_points() {
    for couplings in &COUPLINGS[..3] {
        let near = craig_bampton(&model(bracket(*couplings)), 5).solution;
        let mut raw = bracket(*couplings);
        raw.data.interfaces[0].reference = Reference::Node(raw.nodes.ids[0]);
        raw.data.interfaces[1].reference = Reference::Centre;
        let far = craig_bampton(&model(raw), 5).solution;
        for (a, b) in near.eigenvalues.iter().zip(&far.eigenvalues) {
            close(*a, *b, 1e-10, "lambda");
        }
    }
}

/// Interfaces without a stated coupling are averaging.
#[test]
fn averaging_is_the_default() {
    let stated = bracket([Coupling::Averaging, Coupling::Averaging]);
    let mut raw = stated.clone();
    raw.data.interfaces.iter_mut().for_each(|set| set.coupling = None);
    let body = body(&model(raw), 4);
    let expected = craig_bampton(&model(stated), 4).solution.eigenvalues;
    assert_eq!(body.modes().eigenvalue, expected);
    assert!(body.interfaces().iter().all(|interface| interface.coupling == Some(Coupling::Averaging)));
}

#[test]
fn one_interface_gives_fixed_interface_modes_alone() {
    let mut raw = bracket([Coupling::Rigid, Coupling::Rigid]);
    raw.data.interfaces.pop();
    let basis = craig_bampton(&model(raw), 5);
    assert_eq!(basis.solution.eigenvalues.len(), 5);
    let provenance = &basis.provenance;
    assert!(provenance.iter().all(|p| p.starts_with("fixed-interface mode: ")), "{provenance:?}");
    let told: Vec<_> = basis.diagnostics.iter().map(|d| d.code()).collect();
    assert_eq!(told, [Code::ShapesRigid]);
}

/// Unit loads at the interfaces of the free body are balanced by the inertia forces of its rigid motion.
#[test]
fn attachment_modes_carry_the_loads_of_the_interfaces() {
    for raw in models() {
        let (what, oracle) = (format!("{:?}", raw.data.interfaces), Dense::new(&raw));
        let model = model(raw);
        let basis = modes_of(&model, &CraigChang::default(), &lowest(6)).expect("a basis");
        let count = basis.provenance.iter().filter(|p| *p == "free mode").count();
        assert_eq!(count, 6, "{what}");
        assert!(basis.provenance[6..].iter().all(|p| p.starts_with("attachment mode: ")), "{what}");
        let n = oracle.k.nrows();
        let exact = oracle.responses(Mat::identity(n, n), oracle.relieved().as_ref());
        let found = modal_responses(&basis, oracle.weights.as_ref());
        for j in 0..exact.ncols() {
            let error = (found.col(j) - exact.col(j)).norm_l2() / exact.col(j).norm_l2();
            assert!(error < 1e-9, "{what}, load {j}: {error:e}");
        }
        assert!(basis.truncation.iter().all(|t| t.after < 1e-8), "{:?}", basis.truncation);
    }
}

#[test]
fn further_loads_join_attachment_modes() {
    let model = model(bracket([Coupling::Averaging, Coupling::Averaging]));
    let choice = CraigChang { residual_vectors: vec![Loads::Centrifugal, Loads::Interfaces] };
    let basis = modes_of(&model, &choice, &lowest(4)).expect("a basis");
    assert_eq!(basis.truncation.len(), 12 + 6);
    assert!(basis.truncation.iter().all(|t| t.after < 1e-8), "{:?}", basis.truncation);
}

#[test]
fn an_interface_that_was_declared_rigid_but_is_not_is_told() {
    let model = model(bracket([Coupling::Rigid, Coupling::Averaging]));
    let told = |basis: BasisChoice| -> Vec<String> {
        let found = converted(&model, basis, 5, BodyFrame::Principal).diagnostics;
        found.iter().filter(|d| d.code() == Code::InterfaceFit).map(|d| d.message().to_owned()).collect()
    };
    let free = told(BasisChoice::default());
    assert_eq!(free.len(), 1);
    assert!(free[0].starts_with("interface `first` was declared rigid, but deforms by"), "{free:?}");
    assert!(told(BasisChoice::CraigBampton(CraigBampton)).is_empty());
}

#[test]
fn what_cannot_be_a_craig_bampton_basis_is_refused() {
    let refused = |raw: RawModel, settings: &ModeSettings| {
        modes_of(&model(raw), &CraigBampton, settings).expect_err("no basis")
    };
    let sound = || bracket([Coupling::Rigid, Coupling::Averaging]);
    let certified = ModeSettings { accuracy: Accuracy::Certified, ..lowest(5) };
    assert!(refused(sound(), &certified).has(Code::Usage));
    let short_of_memory = |raw: RawModel, bytes| {
        let few = Context { memory: Some(bytes), ..Context::QUIET };
        modes_within(&model(raw), &CraigBampton, &lowest(5), &few)
            .is_err_and(|error| error.has(Code::MemoryShort))
    };
    assert!(short_of_memory(sound(), 10_000), "the rows of the averaging interface");
    let rigid = bracket([Coupling::Rigid, Coupling::Rigid]);
    assert!(short_of_memory(rigid, 100_000), "the constraint modes");
    let mut raw = sound();
    let all = raw.nodes.ids.clone();
    raw.data.interfaces = vec![NodeSet { coupling: Some(Coupling::Free), ..NodeSet::new("all", all) }];
    assert!(refused(raw, &lowest(5)).has(Code::InterfaceCoupling));
    let mut raw = sound();
    raw.data.interfaces[0].nodes.truncate(2);
    raw.data.interfaces[0].coupling = Some(Coupling::Free);
    raw.data.interfaces.pop();
    assert!(refused(raw, &lowest(5)).has(Code::InterfaceCoupling), "two nodes hold nothing");
    let mut raw = bracket([Coupling::Rigid, Coupling::Averaging]);
    raw.data.interfaces.pop();
    let below = ModeSettings { wanted: Wanted::Below(1.0), ..ModeSettings::default() };
    assert!(refused(raw, &below).has(Code::ShapesNone), "nothing but rigid motion");
}

/// Two blocks that share an edge are a mechanism if one interface is held, and also if both are, because the
/// interfaces move.
#[test]
fn mechanisms_are_found_whether_the_interfaces_hold_them_or_not() {
    let mesh = Mesh::hinge(ElementKind::Hex8, 2);
    let face = |at: f64| -> Vec<i64> {
        let kept = mesh.nodes.iter().enumerate().filter(|(_, x)| (x[0] - at).abs() < 1e-9);
        kept.map(|(i, _)| i as i64 + 1).collect()
    };
    for method in [Method::Dense, Method::Lanczos] {
        for ends in [vec![face(0.0)], vec![face(0.0), face(4.0)]] {
            let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
            let sets = ends.into_iter().enumerate();
            raw.data.interfaces = sets.map(|(i, nodes)| NodeSet::new(format!("end {i}"), nodes)).collect();
            let settings = ModeSettings { method, ..lowest(3) };
            let error = modes_of(&model(raw), &CraigBampton, &settings).expect_err("a mechanism");
            assert!(error.has(Code::Mechanism), "{error}");
            assert!(error.to_string().contains("7 zero-energy modes: 6 rigid ones and 1 more"), "{error}");
        }
    }
}

/// The coordinates of a plane body are two translations and a rotation for each interface.
#[test]
fn plane_bodies_have_three_coordinates_for_each_interface() {
    let body = body(&model(strip([Coupling::Rigid, Coupling::Averaging])), 4);
    let names = &body.coordinates().expect("coordinates").names;
    assert_eq!(names[..6], ["first ux", "first uy", "first rz", "second ux", "second uy", "second rz"]);
    let rows =
        body.interfaces()[0].rows(body.nodes(), body.modes().shape.as_ref(), None, 2).expect("a point");
    let rotation = rows.rotation.expect("nodes on no point");
    assert!((0..body.n_modes()).all(|j| rotation[(0, j)] == 0.0 && rows.translation[(2, j)] == 0.0));
    assert!(rotation.norm_max() > 0.0);
    let along = gram(rows.translation.as_ref(), rows.translation.as_ref());
    assert!((0..body.n_modes()).any(|j| along[(j, j)] > 0.0));
}
