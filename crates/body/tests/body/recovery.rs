//! Recovery of stresses and section forces: modes plus static columns, against static solutions of all nodes.

use faer::linalg::solvers::Solve;
use faer::{Mat, Scale, Side};
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::{BasisChoice, CraigBampton, FreeSurface, Loads};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{FlexBody, ModalMotion, Quantity, RecoveryState, TermGroup, TermGroups};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, ModelRecovery, NodeSet, RawModel, RecoveryOperator, RecoveryRow};
use nalgebra::Vector3;
use oracle::beams::elbow;
use oracle::craig_bampton::{lowest, model};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;
use oracle::random::Random;
use oracle::reference::{dense, dense_modes};
use std::path::PathBuf;

const CELL: f64 = 0.05;

/// Returns an L-shaped bracket without symmetry, turned and away from the origin.
pub(crate) fn mesh() -> Mesh {
    straight().moved(&Random(3).rotation(), [0.7, -0.2, 1.1])
}

fn straight() -> Mesh {
    let mesh = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL);
    let skewed = |x: &[f64; 3]| [x[0] + 0.1 * x[1], x[1] * (1.0 + x[0]), x[2] - 0.2 * x[0] * x[1]];
    Mesh { nodes: mesh.nodes.iter().map(skewed).collect(), elements: mesh.elements }
}

/// Returns the nodes of the two ends of the bracket.
fn ends() -> [Vec<i64>; 2] {
    let lattice = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL).nodes;
    [0, 2].map(|axis| {
        let kept = lattice.iter().enumerate().filter(|(_, x)| (x[axis] - 4.0 * CELL).abs() < 1e-9);
        kept.map(|(i, _)| i as i64 + 1).collect()
    })
}

/// Returns the bracket with its stresses, a section of one arm and interfaces of this coupling at its ends.
pub(crate) fn bracket(mesh: &Mesh, coupling: Coupling) -> RawModel {
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let set =
        |(name, nodes): (&str, Vec<i64>)| NodeSet { coupling: Some(coupling), ..NodeSet::new(name, nodes) };
    raw.data.interfaces = ["first", "second"].into_iter().zip(ends()).map(set).collect();
    let lattice = Mesh::bracket(ElementKind::Hex8, 4, 2, CELL).nodes;
    let side = (1..).zip(&lattice).filter(|(_, x)| x[0] > 2.9 * CELL).map(|(id, _)| id).collect();
    let cut = RecoveryOperator::Cut { nodes: side, about: mesh.nodes[0] };
    let cut = ModelRecovery {
        name: "arm".to_owned(),
        operator: cut,
        path: PathBuf::new(),
        deformed_inertia: false,
    };
    raw.data.recoveries = vec![mesh.stresses(&Material::STEEL), cut];
    raw
}

pub(crate) fn body(
    raw: RawModel,
    basis: BasisChoice,
    modes: usize,
    frame: impl Into<FrameChoice>,
) -> FlexBody {
    let settings =
        ConvertSettings { modes: lowest(modes), basis, frame: frame.into(), ..ConvertSettings::default() };
    convert(&model(raw), &settings, &Context::QUIET).expect("converts").body
}

/// Load case in the axes of the model: force and torque at both interfaces, angular velocity.
#[derive(Clone, Copy)]
struct Case {
    loads: [[Vector3<f64>; 2]; 2],
    spin: Vector3<f64>,
}

impl Case {
    fn random(seed: u64, spin: f64, load: f64) -> Self {
        let mut random = Random(seed);
        let mut vector = |size: f64| Vector3::from(random.vector::<3>()) * size;
        let loads = [(); 2].map(|()| [vector(load), vector(load * CELL)]);
        Self { loads, spin: vector(spin) }
    }
}

/// Returns the values of a recovery of the body that rests in its frame under constant loads and spin: the modes at
/// their static amplitudes; `columns` adds the static columns.
fn static_values(body: &FlexBody, name: &str, case: &Case, columns: bool) -> Vec<f64> {
    let axes = body.frame().axes.transpose();
    let (w, nf) = (axes * case.spin, body.n_modes());
    let modes = body.modes();
    let mut load = vec![0.0; nf];
    if let Some(w1) = body.invariants().w1() {
        for j in 0..nf {
            for k in 0..3 {
                load[j] += (0..3).map(|l| 0.5 * w[k] * w[l] * w1[(l, k * nf + j)]).sum::<f64>();
            }
        }
    }
    let mut at_interfaces = Vec::new();
    for (interface, [force, torque]) in body.interfaces().iter().zip(case.loads) {
        let rotation = modes.rotation.as_ref().map(Mat::as_ref);
        let rows =
            interface.rows(body.nodes(), modes.shape.as_ref(), rotation, 3).expect("a reference point");
        let motion = rows.rigid_motion().expect("a rotation");
        let (force, torque) = (axes * force, axes * torque);
        let components = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        for j in 0..nf {
            load[j] += (0..6).map(|a| motion[(a, j)] * components[a]).sum::<f64>();
        }
        at_interfaces.push(components);
    }
    // A frame on an interface does not balance the rigid motion: the modes of such a body follow inertia as well.
    let stiffness = body.invariants().modal_stiffness();
    let q: Vec<f64> = (0..nf).map(|j| load[j] / stiffness[(j, j)]).collect();
    let recovery = body.recoveries().iter().find(|recovery| recovery.name == name).expect("a recovery");
    let nothing = [[0.0; 6]; 2];
    let (w, loads) = if columns { (w, at_interfaces.as_slice()) } else { (Vector3::zeros(), &nothing[..]) };
    recovery.values(&RecoveryState { motion: ModalMotion::steady(&q, w), loads, named: &[] })
}

/// Static solution of all nodes under inertia relief, dense: u = T y of a body whose interfaces are rigid if T says so.
pub(crate) struct Statics {
    k: Mat<f64>,
    m: Mat<f64>,
    /// T (N x y).
    coupling: Mat<f64>,
    nodes: Vec<[f64; 3]>,
}

impl Statics {
    pub(crate) fn new(raw: &RawModel, rigid: bool) -> Self {
        let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
        let nodes = raw.nodes.positions.clone();
        let n = k.nrows();
        let taken: Vec<usize> = if rigid {
            raw.data.interfaces.iter().flat_map(|set| &set.nodes).map(|id| *id as usize - 1).collect()
        } else {
            Vec::new()
        };
        let free: Vec<usize> = (0..n).filter(|row| !taken.contains(&(row / 3))).collect();
        let sets = if rigid { raw.data.interfaces.len() } else { 0 };
        let mut coupling = Mat::zeros(n, free.len() + 6 * sets);
        for (j, &row) in free.iter().enumerate() {
            coupling[(row, j)] = 1.0;
        }
        for (s, set) in raw.data.interfaces.iter().take(sets).enumerate() {
            let centre = centre_of(&nodes, &set.nodes);
            for id in &set.nodes {
                let i = *id as usize - 1;
                let motion = rigid_of(&nodes[i], &centre);
                for c in 0..6 {
                    (0..3).for_each(|r| coupling[(3 * i + r, free.len() + 6 * s + c)] = motion[c][r]);
                }
            }
        }
        Self { k, m, coupling, nodes }
    }

    /// Returns u of K u = f - M R a, with the acceleration a that balances the loads.
    pub(crate) fn solve(&self, f: &Mat<f64>) -> Mat<f64> {
        let n = self.k.nrows();
        let rigid =
            Mat::from_fn(n, 6, |row, c| rigid_of(&self.nodes[row / 3], &Vector3::zeros())[c][row % 3]);
        let m_rigid = &self.m * &rigid;
        let inertia = rigid.transpose() * &m_rigid;
        let a = inertia.partial_piv_lu().solve(rigid.transpose() * f);
        let balanced = f - &m_rigid * a;
        let t = &self.coupling;
        let k = t.transpose() * &self.k * t;
        let held = t.transpose() * &m_rigid;
        let scale = (0..k.nrows()).map(|i| k[(i, i)]).sum::<f64>() / held.squared_norm_l2();
        let raised = &k + &held * held.transpose() * Scale(scale);
        let factor = raised.llt(Side::Lower).expect("positive definite");
        let wanted = t.transpose() * &balanced;
        let mut y = factor.solve(&wanted);
        for _ in 0..3 {
            let left = &wanted - &k * &y;
            y += factor.solve(&left);
        }
        t * y
    }

    /// Returns the resultant about a point of the inner forces K u of the nodes on one side.
    pub(crate) fn section(&self, u: &Mat<f64>, side: &[i64], about: &[f64; 3]) -> Vec<f64> {
        let inner = &self.k * u;
        let mut resultant = vec![0.0; 6];
        for id in side {
            let i = *id as usize - 1;
            let motion = rigid_of(&self.nodes[i], &Vector3::from(*about));
            for c in 0..6 {
                resultant[c] += (0..3).map(|k| motion[c][k] * inner[(3 * i + k, 0)]).sum::<f64>();
            }
        }
        resultant
    }

    /// Returns the nodal forces of a case: forces at the means of the interface nodes and -M (w x (w x x)).
    fn forces(&self, raw: &RawModel, case: &Case) -> Mat<f64> {
        let n = self.k.nrows();
        let acceleration = Mat::from_fn(n, 1, |row, _| {
            case.spin.cross(&case.spin.cross(&Vector3::from(self.nodes[row / 3])))[row % 3]
        });
        let mut f = &self.m * acceleration * Scale(-1.0);
        for (set, [force, torque]) in raw.data.interfaces.iter().zip(case.loads) {
            let centre = centre_of(&self.nodes, &set.nodes);
            // A = R (R'R)^-1 spreads the resultant.
            let rows = 3 * set.nodes.len();
            let r = Mat::from_fn(rows, 6, |row, c| {
                rigid_of(&self.nodes[set.nodes[row / 3] as usize - 1], &centre)[c][row % 3]
            });
            let wanted = Mat::from_fn(6, 1, |i, _| if i < 3 { force[i] } else { torque[i - 3] });
            let spread = &r * (r.transpose() * &r).partial_piv_lu().solve(&wanted);
            for row in 0..rows {
                f[(3 * (set.nodes[row / 3] as usize - 1) + row % 3, 0)] += spread[(row, 0)];
            }
        }
        f
    }
}

fn centre_of(nodes: &[[f64; 3]], ids: &[i64]) -> Vector3<f64> {
    ids.iter().map(|id| Vector3::from(nodes[*id as usize - 1])).sum::<Vector3<f64>>() / ids.len() as f64
}

/// Returns the displacements of a point by unit translations and rotations about `centre`.
fn rigid_of(x: &[f64; 3], centre: &Vector3<f64>) -> [Vector3<f64>; 6] {
    std::array::from_fn(|c| match c {
        0..3 => Vector3::ith(c, 1.0),
        _ => Vector3::ith(c - 3, 1.0).cross(&(Vector3::from(*x) - centre)),
    })
}

/// Returns R u.
pub(crate) fn rows_of(transposed: &CscMatrix, u: &Mat<f64>) -> Vec<f64> {
    let row = |j: usize| {
        let (rows, values) = transposed.column(j);
        rows.iter().zip(values).map(|(r, v)| v * u[(*r as usize, 0)]).sum()
    };
    (0..transposed.n_cols()).map(row).collect()
}

/// Returns the largest difference, relative to the largest value expected.
pub(crate) fn error(found: &[f64], expected: &[f64]) -> f64 {
    let size = expected.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    found.iter().zip(expected).fold(0.0f64, |most, (a, b)| most.max((a - b).abs())) / size
}

/// Returns the stresses of the static solution of all nodes.
fn exact(raw: &RawModel, case: &Case, rigid: bool) -> Vec<f64> {
    let statics = Statics::new(raw, rigid);
    let u = statics.solve(&statics.forces(raw, case));
    let RecoveryOperator::Rows { transposed, .. } = &raw.data.recoveries[0].operator else {
        panic!("an operator")
    };
    rows_of(transposed, &u)
}

/// Cases of spin alone, of loads alone, and of both, with stresses of one size.
fn cases() -> [(&'static str, Case); 3] {
    [
        ("spin", Case::random(5, 2e3, 0.0)),
        ("loads", Case::random(6, 0.0, 1e4)),
        ("both", Case::random(7, 2e3, 1e4)),
    ]
}

#[test]
fn stresses_under_constant_loads_and_spin_are_those_of_all_nodes() {
    let raw = bracket(&mesh(), Coupling::Averaging);
    for frame in [BodyFrame::Com, BodyFrame::Principal] {
        let body = body(raw.clone(), BasisChoice::default(), 6, frame);
        for (name, case) in cases() {
            let expected = exact(&raw, &case, false);
            let found = error(&static_values(&body, "stress", &case, true), &expected);
            let alone = error(&static_values(&body, "stress", &case, false), &expected);
            println!("{name}: {found:.1e}, modes alone {alone:.1e}");
            assert!(found < 1e-10, "{name}: {found:e}");
            assert!(alone > 1e-2, "{name}: modes alone {alone:e}");
        }
    }
}

#[test]
fn interfaces_that_the_modes_keep_rigid_stay_rigid_in_the_columns() {
    let raw = bracket(&mesh(), Coupling::Rigid);
    let body = body(raw.clone(), BasisChoice::CraigBampton(CraigBampton), 3, BodyFrame::Principal);
    for (name, case) in cases() {
        let found = static_values(&body, "stress", &case, true);
        let rigid = error(&found, &exact(&raw, &case, true));
        let deforming = error(&found, &exact(&raw, &case, false));
        println!("{name}: {rigid:.1e} with rigid interfaces, {deforming:.1e} with others");
        assert!(rigid < 1e-10, "{name}: {rigid:e}");
        assert!(deforming > 1e-2, "{name}: {deforming:e}");
    }
}

/// The static values do not depend on the basis, on modes that are dropped later, or on the number of modes.
#[test]
fn static_values_do_not_depend_on_the_basis() {
    let raw = bracket(&mesh(), Coupling::Averaging);
    let reference = body(raw.clone(), BasisChoice::default(), 6, BodyFrame::Principal);
    let with_vectors = FreeSurface { residual_vectors: vec![Loads::Interfaces, Loads::Centrifugal] };
    let twelve = body(raw.clone(), BasisChoice::default(), 12, BodyFrame::Com);
    let without_w1 = TermGroups::without(TermGroup::W1);
    let dropped = |group| flexbody_body::flex_body::TermDecision {
        group,
        kept: false,
        tier: 2,
        bound: 0.0,
        limit: 0.0,
        reason: String::new(),
    };
    let some = [0, 2, 3, 7];
    let bodies = [
        ("residual vectors", body(raw.clone(), BasisChoice::Free(with_vectors), 4, BodyFrame::Com)),
        ("Craig-Bampton", body(raw, BasisChoice::CraigBampton(CraigBampton), 3, BodyFrame::Com)),
        ("fewer modes", twelve.reduced(&some, TermGroups::ALL, Vec::new()).expect("reduced")),
        ("no W1", twelve.reduced(&some, without_w1, vec![dropped(TermGroup::W1)]).expect("reduced")),
        ("twelve modes", twelve),
    ];
    for (name, case) in cases() {
        for recovery in ["stress", "arm"] {
            let expected = static_values(&reference, recovery, &case, true);
            for (which, body) in &bodies {
                let found = error(&static_values(body, recovery, &case, true), &expected);
                assert!(found < 1e-9, "{which}, {recovery}, {name}: {found:e}");
            }
            let few = error(&static_values(&bodies[2].1, recovery, &case, false), &expected);
            assert!(few > 1e-2, "{recovery}, {name}: without columns {few:e}");
        }
    }
}

#[test]
fn columns_of_fewer_modes_are_those_of_a_conversion_with_fewer_modes() {
    let raw = bracket(&mesh(), Coupling::Averaging);
    for frame in [FrameChoice::from(BodyFrame::Principal), FrameChoice::Interface("first".to_owned())] {
        let many = body(raw.clone(), BasisChoice::default(), 9, frame.clone());
        let reduced = many.reduced(&[0, 1, 2, 3, 4], TermGroups::ALL, Vec::new()).expect("reduced");
        // The modes of a body held at an interface are combinations of all free modes: there only the sum is equal.
        if frame.interface().is_some() {
            continue;
        }
        let few = body(raw.clone(), BasisChoice::default(), 5, frame);
        for (a, b) in reduced.recoveries().iter().zip(few.recoveries()) {
            let size = |m: &Mat<f64>| m.norm_max();
            assert!(size(&(&a.spin - &b.spin)) < 1e-8 * size(&b.spin), "{}", a.name);
            for (a, b) in a.loads.iter().zip(&b.loads) {
                assert!(size(&(&a.columns - &b.columns)) < 1e-8 * size(&b.columns), "{}", a.interface);
            }
        }
    }
}

/// Stresses of the straight bracket are those of the turned one, turned back; the order of the nodes does not matter.
#[test]
fn values_turn_with_the_model_and_do_not_depend_on_its_order() {
    let turn = Random(3).rotation();
    let turned = body(bracket(&mesh(), Coupling::Averaging), BasisChoice::default(), 6, BodyFrame::Principal);
    let straight_mesh = straight();
    let plain = bracket(&straight_mesh, Coupling::Averaging);
    let mut renumbered = plain.clone();
    let n = plain.nodes.len();
    // Node i of the new order is node n - 1 - i.
    let reversed: Vec<u32> = (0..3 * n as u32).map(|row| 3 * (n as u32 - 1 - row / 3) + row % 3).collect();
    renumbered.stiffness.matrix = plain.stiffness.matrix.permuted(&reversed);
    renumbered.mass.matrix = plain.mass.matrix.permuted(&reversed);
    renumbered.nodes.ids.reverse();
    renumbered.nodes.positions.reverse();
    let RecoveryOperator::Rows { transposed, labels, .. } = &plain.data.recoveries[0].operator else {
        panic!()
    };
    let entries: Vec<(u32, u32, f64)> = oracle::mesh::entries(transposed)
        .map(|(row, column, v)| (reversed[row as usize], column, v))
        .collect();
    renumbered.data.recoveries[0].operator = RecoveryOperator::Rows {
        transposed: CscMatrix::from_triplets(3 * n, transposed.n_cols(), &entries),
        labels: labels.clone(),
        offset: None,
    };
    let plain = body(plain, BasisChoice::default(), 6, BodyFrame::Com);
    let renumbered = body(renumbered, BasisChoice::default(), 6, BodyFrame::Com);
    for (name, case) in cases() {
        let back = |v: Vector3<f64>| turn.transpose() * v;
        let of_plain = Case { loads: case.loads.map(|load| load.map(back)), spin: back(case.spin) };
        let expected = static_values(&plain, "stress", &of_plain, true);
        let same = error(&static_values(&renumbered, "stress", &of_plain, true), &expected);
        assert!(same < 1e-9, "{name}: {same:e} in another order");
        let found = static_values(&turned, "stress", &case, true);
        let tensor = |v: &[f64]| nalgebra::Matrix3::new(v[0], v[3], v[5], v[3], v[1], v[4], v[5], v[4], v[2]);
        let mut turned_back = Vec::new();
        for six in found.chunks_exact(6) {
            let t = turn.transpose() * tensor(six) * turn;
            turned_back.extend([t[(0, 0)], t[(1, 1)], t[(2, 2)], t[(0, 1)], t[(1, 2)], t[(0, 2)]]);
        }
        let found = error(&turned_back, &expected);
        assert!(found < 1e-9, "{name}: {found:e} when turned");
        let section = |body: &FlexBody, case: &Case| static_values(body, "arm", case, true);
        let (a, b) = (section(&plain, &of_plain), section(&turned, &case));
        for first in [0, 3] {
            let vector = |v: &[f64]| Vector3::new(v[first], v[first + 1], v[first + 2]);
            let difference = (vector(&a) - back(vector(&b))).norm();
            assert!(difference < 1e-9 * vector(&a).norm(), "{name}: section {difference:e}");
        }
    }
}

/// A sine load at 0.4 of the first frequency from rest, against the sum over all modes in closed form,
/// q_p = g_p / (lambda_p - w^2) (sin w t - w / omega_p sin omega_p t). Without dynamics a mode that is left out has g_p /
/// lambda_p sin w t: its error is at most |g_p| / (lambda_p - w^2) (w / omega_p + w^2 / lambda_p).
#[test]
fn stresses_under_a_slow_sine_load_follow_those_of_all_nodes() {
    let raw = bracket(&mesh(), Coupling::Averaging);
    let all = dense_modes(&mesh().assemble(&Material::STEEL, MassRule::Consistent));
    let case = Case::random(6, 0.0, 1e4);
    let statics = Statics::new(&raw, false);
    let load = all.shapes.transpose() * statics.forces(&raw, &case);
    let RecoveryOperator::Rows { transposed, .. } = &raw.data.recoveries[0].operator else {
        panic!("an operator")
    };
    let stress_of_modes: Vec<Vec<f64>> = (0..all.eigenvalues.len())
        .map(|p| rows_of(transposed, &all.shapes.as_ref().subcols(p, 1).to_owned()))
        .collect();
    let w = 0.4 * all.eigenvalues[0].sqrt();
    let response = |lambda: f64, load: f64, t: f64| {
        let omega = lambda.sqrt();
        load / (lambda - w * w) * ((w * t).sin() - w / omega * (omega * t).sin())
    };
    for (count, most) in [(5, 0.03), (12, 0.015)] {
        let body = body(raw.clone(), BasisChoice::default(), count, BodyFrame::Com);
        let recovery = &body.recoveries()[0];
        let lambda = &body.modes().eigenvalue;
        let at_interfaces = case.loads.map(|[f, t]| [f.x, f.y, f.z, t.x, t.y, t.z]);
        let mut modal = vec![0.0; count];
        for (interface, load) in body.interfaces().iter().zip(&at_interfaces) {
            let rows = interface.rows(body.nodes(), body.modes().shape.as_ref(), None, 3).expect("rows");
            let motion = rows.rigid_motion().expect("a rotation");
            (0..count).for_each(|j| modal[j] += (0..6).map(|a| motion[(a, j)] * load[a]).sum::<f64>());
        }
        let (mut size, mut with, mut alone) = (0.0f64, 0.0f64, 0.0f64);
        for step in 1..200 {
            let t = f64::from(step) * 0.05 / w;
            let mut exact = vec![0.0; recovery.rows.len()];
            for (p, stress) in stress_of_modes.iter().enumerate() {
                let q = response(all.eigenvalues[p], load[(p, 0)], t);
                exact.iter_mut().zip(stress).for_each(|(sum, stress)| *sum += stress * q);
            }
            let q: Vec<f64> = (0..count).map(|j| response(lambda[j], modal[j], t)).collect();
            let now = |loads: [[f64; 6]; 2]| {
                recovery.values(&RecoveryState {
                    motion: ModalMotion::steady(&q, Vector3::zeros()),
                    loads: &loads,
                    named: &[],
                })
            };
            let loaded = at_interfaces.map(|load| load.map(|f| f * (w * t).sin()));
            let difference = |found: Vec<f64>| {
                found.iter().zip(&exact).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()))
            };
            size = exact.iter().fold(size, |most, v| most.max(v.abs()));
            with = with.max(difference(now(loaded)));
            alone = alone.max(difference(now([[0.0; 6]; 2])));
        }
        println!("{count} modes: {:.2e}, modes alone {:.2e}", with / size, alone / size);
        let bound = (0..recovery.rows.len()).map(|row| {
            let of_mode = |p: usize| {
                let (lambda, omega) = (all.eigenvalues[p], all.eigenvalues[p].sqrt());
                let part = (w / omega + w * w / lambda) / (lambda - w * w);
                (stress_of_modes[p][row] * load[(p, 0)]).abs() * part
            };
            (count..all.eigenvalues.len()).map(of_mode).sum::<f64>()
        });
        let bound = bound.fold(0.0, f64::max);
        assert!(with < bound && with < most * size, "{count}: {:e}, bound {:e}", with / size, bound / size);
        assert!(alone > 0.2 * size, "{count}: modes alone {:e}", alone / size);
    }
}

/// Section forces of a cut: loads less inertia of one side, from the accelerations of all nodes in the static state.
#[test]
fn section_forces_are_the_loads_less_the_inertia_of_one_side() {
    for (coupling, rigid) in [(Coupling::Averaging, false), (Coupling::Rigid, true)] {
        let raw = bracket(&mesh(), coupling);
        let basis = if rigid { BasisChoice::CraigBampton(CraigBampton) } else { BasisChoice::default() };
        let body = body(raw.clone(), basis, 5, BodyFrame::Principal);
        let statics = Statics::new(&raw, rigid);
        let RecoveryOperator::Cut { nodes, about } = &raw.data.recoveries[1].operator else {
            panic!("a cut")
        };
        for (name, case) in cases() {
            let f = statics.forces(&raw, &case);
            let u = statics.solve(&f);
            // The inner forces of one side, K u of its nodes, by the definition of the resultant.
            let expected = statics.section(&u, nodes, about);
            let found = static_values(&body, "arm", &case, true);
            let alone = static_values(&body, "arm", &case, false);
            for part in [0..3, 3..6] {
                let (found, expected) = (&found[part.clone()], &expected[part.clone()]);
                let (with, without) = (error(found, expected), error(&alone[part], expected));
                println!("{coupling:?} {name}: {with:.1e}, modes alone {without:.1e}");
                assert!(with < 1e-9, "{coupling:?} {name}: {with:e}");
                assert!(without > 1e-2, "{coupling:?} {name}: {without:e}");
            }
        }
    }
}

/// End forces of one beam, from its stiffness alone, equal the section forces of the cut through it.
#[test]
fn cuts_of_a_frame_are_the_end_forces_of_its_beams() {
    let mut raw = elbow(4);
    let n = raw.nodes.len();
    let ends = [1, n as i64];
    raw.data.interfaces = ends.map(|id| NodeSet::new(format!("end {id}"), vec![id])).to_vec();
    // Rows of K that couple nodes 1 to 3 with the others belong to the beam between nodes 3 and 4 alone: the resultant
    // of these nodes about node 3 is the end force of this beam there.
    let side: Vec<i64> = vec![1, 2, 3];
    let about = raw.nodes.positions[2];
    let other = raw.nodes.positions[3];
    let k = &raw.stiffness.matrix;
    // End force at node 3: K_34 u_4 + K_beam33 u_3 with K_beam33 = -K_34 T, T the rigid motion of node 4 by node 3.
    let mut entries = Vec::new();
    let arm = Vector3::from(other) - Vector3::from(about);
    for c in 0..6 {
        let coupled: Vec<f64> = (0..6).map(|j| k.get(12 + c, 18 + j)).collect();
        for j in 0..6 {
            entries.push(((18 + j) as u32, c as u32, coupled[j]));
            let moved: Vec<f64> = if j < 3 {
                (0..6).map(|r| f64::from(u8::from(r == j))).collect()
            } else {
                let turned = Vector3::ith(j - 3, 1.0).cross(&arm);
                let mut all = vec![turned.x, turned.y, turned.z, 0.0, 0.0, 0.0];
                all[j] = 1.0;
                all
            };
            let own: f64 = coupled.iter().zip(&moved).map(|(a, b)| a * b).sum();
            entries.push(((12 + j) as u32, c as u32, -own));
        }
    }
    let label = |c: usize| RecoveryRow {
        name: format!("end {c}"),
        quantity: if c < 3 { Quantity::Force } else { Quantity::Moment },
        component: (c + 1).to_string(),
        unit: "N".to_owned(),
        node: Some(3),
        element: Some(3),
    };
    let rows = RecoveryOperator::Rows {
        transposed: CscMatrix::from_triplets(6 * n, 6, &entries),
        labels: (0..6).map(label).collect(),
        offset: None,
    };
    let recovery = |name: &str, operator| ModelRecovery {
        name: name.to_owned(),
        operator,
        path: PathBuf::new(),
        deformed_inertia: false,
    };
    raw.data.recoveries =
        vec![recovery("beam", rows), recovery("cut", RecoveryOperator::Cut { nodes: side, about })];
    let body = body(raw, BasisChoice::default(), 4, BodyFrame::Principal);
    for (name, case) in [("spin", Case::random(5, 0.1, 0.0)), ("loads", Case::random(6, 0.0, 1e-3))] {
        let beam = static_values(&body, "beam", &case, true);
        let cut = static_values(&body, "cut", &case, true);
        let alone = error(&static_values(&body, "cut", &case, false), &beam);
        let found = error(&cut, &beam);
        println!("{name}: {found:.1e}, modes alone {alone:.1e}");
        assert!(found < 1e-9, "{name}: {found:e}");
        assert!(alone > 1e-2, "{name}: {alone:e}");
    }
}

#[test]
fn operators_of_another_model_are_refused_by_name() {
    let plain = bracket(&mesh(), Coupling::Averaging);
    let refused = |change: &dyn Fn(&mut RawModel)| {
        let mut raw = plain.clone();
        change(&mut raw);
        let error = FeModel::from_raw(raw).expect_err("refused");
        (error.first_error().code(), error.to_string())
    };
    let with_rows = |change: &dyn Fn(&CscMatrix, &mut Vec<RecoveryRow>) -> CscMatrix| {
        refused(&|raw: &mut RawModel| {
            let RecoveryOperator::Rows { transposed, labels, .. } = &mut raw.data.recoveries[0].operator
            else {
                panic!("an operator")
            };
            *transposed = change(transposed, labels);
        })
    };
    let entries = |r: &CscMatrix| oracle::mesh::entries(r).collect::<Vec<_>>();
    let renamed = |r: &CscMatrix, to: &dyn Fn(u32) -> u32| {
        let moved: Vec<_> = entries(r).into_iter().map(|(row, column, v)| (to(row), column, v)).collect();
        CscMatrix::from_triplets(r.n_rows(), r.n_cols(), &moved)
    };
    // Two nodes exchanged, and rows by directions instead of by nodes.
    let n = plain.nodes.len() as u32;
    let (code, message) = with_rows(&|r, _| {
        renamed(r, &|row| match row / 3 {
            40 => 123 + row % 3,
            41 => 120 + row % 3,
            _ => row,
        })
    });
    assert_eq!(code, Code::RecoveryStrained, "{message}");
    assert!(message.contains("`stress`") && message.contains("rigid motion"), "{message}");
    let (code, message) = with_rows(&|r, _| renamed(r, &|row| n * (row % 3) + row / 3));
    assert_eq!(code, Code::RecoveryStrained, "{message}");
    // Another number of rows, labels that do not fit, units that are missing.
    let (code, message) =
        with_rows(&|r, _| CscMatrix::from_triplets(r.n_rows() + 3, r.n_cols(), &entries(r)));
    assert_eq!(code, Code::RecoverySize, "{message}");
    let (code, message) = with_rows(&|r, labels| {
        labels.pop();
        r.clone()
    });
    assert_eq!(code, Code::RecoveryRows, "{message}");
    let (code, message) = with_rows(&|r, labels| {
        labels[7].unit.clear();
        r.clone()
    });
    assert!(code == Code::RecoveryRows && message.contains("without a unit"), "{message}");
    let (code, message) = with_rows(&|r, labels| {
        labels[7].name = labels[3].name.clone();
        r.clone()
    });
    assert!(code == Code::RecoveryRows && message.contains("twice"), "{message}");
    // Displacements may follow rigid motion.
    let mut raw = plain.clone();
    let RecoveryOperator::Rows { transposed, labels, .. } = &mut raw.data.recoveries[0].operator else {
        panic!()
    };
    *transposed = CscMatrix::from_triplets(transposed.n_rows(), 1, &[(5, 0, 1.0)]);
    labels.truncate(1);
    labels[0].quantity = Quantity::Displacement;
    FeModel::from_raw(raw).expect("a displacement");
    // Cuts.
    for (nodes, says) in
        [(vec![], "no node"), (vec![1, 99_999], "unknown nodes: 99999"), (plain.nodes.ids.clone(), "all")]
    {
        let (code, message) = refused(&|raw: &mut RawModel| {
            let operator = RecoveryOperator::Cut { nodes: nodes.clone(), about: [0.0; 3] };
            raw.data.recoveries[1].operator = operator;
        });
        assert!(code == Code::RecoveryCut && message.contains(says), "{message}");
    }
    let (code, message) = refused(&|raw: &mut RawModel| raw.data.recoveries[1].name = "stress".to_owned());
    assert!(code == Code::ManifestSyntax && message.contains("twice"), "{message}");
}

#[test]
fn a_cut_through_a_rigid_interface_is_refused() {
    let mut raw = bracket(&mesh(), Coupling::Rigid);
    let side: Vec<i64> = raw.data.interfaces[0].nodes[1..].to_vec();
    raw.data.recoveries[1].operator = RecoveryOperator::Cut { nodes: side, about: [0.0; 3] };
    let settings = ConvertSettings {
        modes: lowest(3),
        basis: BasisChoice::CraigBampton(CraigBampton),
        ..ConvertSettings::default()
    };
    let error = convert(&model(raw), &settings, &Context::QUIET).expect_err("refused");
    assert_eq!(error.first_error().code(), Code::RecoveryCut, "{error}");
}
