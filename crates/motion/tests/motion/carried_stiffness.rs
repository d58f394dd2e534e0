//! Geometric stiffness of a body that an interface carries, beside the unreduced nodal equations: the stress of all
//! loads with the reaction, and the frequencies of the held body that spins.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::interface_loads;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody};
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_eigen::Wanted;
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{
    Coupling, FeModel, GeometricStiffness, LoadKind, ModelLoad, NodeSet, RawMatrix, RawModel, UnitLoad,
};
use flexbody_motion::scene::{Carried, FramedScene, LoadCases, Point, Scene};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, entries};
use oracle::random::Random;
use std::fs;
use std::path::PathBuf;

const MATERIAL: Material = Material { youngs: 1e7, poisson: 0.3, density: 1000.0 };

/// A skew bar away from the origin, with the interfaces `root` and `tip`, and its dense matrices.
struct Bar {
    mesh: Mesh,
    raw: RawModel,
    k: DMatrix<f64>,
    m: DMatrix<f64>,
    root: DMatrix<f64>,
    tip: DMatrix<f64>,
    /// Reference point of the root.
    origin: Vector3<f64>,
}

fn dense(matrix: &CscMatrix) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(matrix.n_rows(), matrix.n_cols());
    entries(matrix).for_each(|(r, c, v)| all[(r as usize, c as usize)] += v);
    all
}

fn converted_matrix(a: &Mat<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

fn unit(axis: usize) -> Vector3<f64> {
    Vector3::ith(axis, 1.0)
}

impl Bar {
    fn new() -> Self {
        let mesh = Mesh::from_cells(ElementKind::Hex8, &oracle::mesh::grid([3, 1, 1]), |p| {
            [0.4 + 0.3 * p[0] + 0.02 * p[1], 0.2 + 0.12 * p[1] + 0.03 * p[0] * p[2], 0.09 * p[2] - 0.1]
        });
        let mut raw = mesh.assemble(&MATERIAL, MassRule::Consistent).raw_model();
        let layer = |first: usize| -> Vec<i64> {
            let start = mesh.nodes.iter().map(|x| x[0]).fold(f64::INFINITY, f64::min) + 0.3 * first as f64;
            let near = |x: &[f64; 3]| (x[0] - start).abs() < 0.05;
            (1..).zip(&mesh.nodes).filter(|(_, x)| near(x)).map(|(id, _)| id).collect()
        };
        raw.data.interfaces = [("root", 0), ("tip", 3)]
            .map(|(name, first)| NodeSet {
                coupling: Some(Coupling::Averaging),
                ..NodeSet::new(name, layer(first))
            })
            .to_vec();
        let model = FeModel::from_raw(raw.clone()).expect("a sound model").model;
        let loads = |name: &str| {
            converted_matrix(&interface_loads(&model, name).expect("loads").expect("a reference point"))
        };
        let set = raw.data.interfaces.iter().find(|set| set.name == "root").expect("an interface");
        let sum: Vector3<f64> = set.nodes.iter().map(|&id| Vector3::from(mesh.nodes[id as usize - 1])).sum();
        let origin = sum / set.nodes.len() as f64;
        let (root, tip) = (loads("root"), loads("tip"));
        let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
        Self { mesh, raw, k, m, root, tip, origin }
    }

    /// Returns rigid motions about the root (3n x 6).
    fn rigid(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.k.nrows(), 6, |row, c| {
            let arm = Vector3::from(self.mesh.nodes[row / 3]) - self.origin;
            if c < 3 { unit(c)[row % 3] } else { unit(c - 3).cross(&arm)[row % 3] }
        })
    }

    /// Returns the stress stiffness under a load that is in equilibrium.
    fn stress_stiffness(&self, load: &DVector<f64>) -> CscMatrix {
        let rigid = self.rigid();
        let left = (rigid.transpose() * load).norm();
        assert!(left < 1e-9 * load.norm(), "a load in equilibrium: {left:e}");
        let stiff = &self.k + &rigid * rigid.transpose() * (self.k.amax() / rigid.norm_squared());
        let moved = stiff.lu().solve(load).expect("stiff");
        self.mesh.geometric_stiffness(&MATERIAL, moved.as_slice())
    }

    /// Returns a load with the inertia forces that balance it.
    fn balanced(&self, load: DVector<f64>) -> DVector<f64> {
        let rigid = self.rigid();
        let mass = rigid.transpose() * &self.m * &rigid;
        let relief = mass.lu().solve(&(rigid.transpose() * &load)).expect("a mass");
        load - &self.m * rigid * relief
    }

    /// Returns the inertia forces of an acceleration of every node, by its position relative to the root.
    fn inertia(&self, acceleration: impl Fn(Vector3<f64>) -> Vector3<f64>) -> DVector<f64> {
        let field = DVector::from_fn(self.k.nrows(), |row, _| {
            acceleration(Vector3::from(self.mesh.nodes[row / 3]) - self.origin)[row % 3]
        });
        -(&self.m * field)
    }

    /// Returns the model with the geometric stiffness of the free body under spin and loads at both interfaces.
    fn stressed(&self) -> RawModel {
        let mut all = Vec::new();
        let mut give = |kind: LoadKind, component: usize, load: DVector<f64>| {
            let matrix = self.stress_stiffness(&self.balanced(load));
            let matrix = RawMatrix { matrix, digits: 17, path: PathBuf::new() };
            all.push(GeometricStiffness { load: UnitLoad { kind, component }, matrix });
        };
        for (component, (k, l)) in LoadKind::SPIN.into_iter().enumerate() {
            let pair = |k: usize, l: usize, x: &Vector3<f64>| unit(k).cross(&unit(l).cross(x));
            let load =
                self.inertia(|x| if k == l { pair(k, k, &x) } else { pair(k, l, &x) + pair(l, k, &x) });
            give(LoadKind::Spin, component, load);
        }
        for (name, loads) in [("root", &self.root), ("tip", &self.tip)] {
            for c in 0..3 {
                give(LoadKind::Force(name.to_owned()), c, loads.column(c).into());
                give(LoadKind::Moment(name.to_owned()), c, loads.column(3 + c).into());
            }
        }
        give(LoadKind::Named("bolts".to_owned()), 0, self.named());
        let bolts = ModelLoad {
            name: "bolts".to_owned(),
            forces: self.named().as_slice().to_vec(),
            preload: false,
            path: PathBuf::new(),
        };
        self.raw.clone().with(|data| {
            data.geometric_stiffness = all;
            data.named_loads = vec![bolts];
        })
    }

    /// Returns the forces of a named load with a resultant force and moment.
    fn named(&self) -> DVector<f64> {
        let mut random = Random(17);
        DVector::from_fn(self.k.nrows(), |_, _| random.signed())
    }
}

/// Returns the body of all modes of a model.
fn body_of(raw: RawModel, frame: FrameChoice) -> FlexBody {
    let modes = raw.stiffness.matrix.n_cols() - 6;
    let model = FeModel::from_raw(raw).expect("a sound model").model;
    let mut settings = ConvertSettings { frame, lumped: Vec::new(), ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(modes);
    convert(&model, &settings, &Context::QUIET).expect("a body").body
}

fn on_root() -> FrameChoice {
    FrameChoice::Interface("root".to_owned())
}

fn root() -> Carrier {
    Carrier::Interface("root".to_owned())
}

fn shapes(body: &FlexBody) -> DMatrix<f64> {
    converted_matrix(&body.modes().shape)
}

/// Returns the sum of the geometric stiffness of `body` under loads with these sizes.
fn under(body: &FlexBody, amount: impl Fn(&UnitLoad) -> f64) -> DMatrix<f64> {
    let nf = body.n_modes();
    let all = body.geometric_stiffness().iter();
    all.fold(DMatrix::zeros(nf, nf), |sum, one| sum + converted_matrix(&one.matrix) * amount(&one.load))
}

/// The carrier is at rest in the modes of the body or moves in them.
fn frames() -> [FrameChoice; 3] {
    [on_root(), BodyFrame::Com.into(), BodyFrame::Principal.into()]
}

#[test]
fn the_reaction_is_one_of_the_loads_that_stress_a_carried_body() {
    let bar = Bar::new();
    for frame in frames() {
        let body = body_of(bar.stressed(), frame.clone()).carried(&root()).expect("a carrier");
        assert!(
            body.geometric_stiffness()
                .iter()
                .all(|stiffness| stiffness.load.kind.interface() != Some("root"))
        );
        let (psi, mut random) = (shapes(&body), Random(5));
        for _ in 0..3 {
            let [a, alpha, w, force, moment] = std::array::from_fn(|_| Vector3::from(random.vector::<3>()));
            let (force, moment) = (force * 300.0, moment * 40.0);
            let named = 25.0 * random.signed();
            let mut load = bar.inertia(|x| a + alpha.cross(&x) + w.cross(&w.cross(&x)));
            let at_tip = DVector::from_iterator(6, force.iter().chain(moment.iter()).copied());
            load += &bar.tip * at_tip + bar.named() * named;
            let reaction = -(bar.rigid().transpose() * &load);
            load += &bar.root * reaction;
            let expected = psi.transpose() * dense(&bar.stress_stiffness(&load)) * &psi;
            let found = under(&body, |unit_load| {
                let c = unit_load.component;
                match &unit_load.kind {
                    LoadKind::Acceleration => a[c],
                    LoadKind::AngularAcceleration => alpha[c],
                    LoadKind::Spin => w[LoadKind::SPIN[c].0] * w[LoadKind::SPIN[c].1],
                    LoadKind::Force(_) => force[c],
                    LoadKind::Moment(_) => moment[c],
                    LoadKind::Named(_) => named,
                }
            });
            let error = (&found - &expected).amax() / expected.amax();
            assert!(error < 1e-10, "{frame:?}: {error:e}");
        }
        // A body that is carried already does not change.
        let again = body.carried(&root()).expect("a carrier");
        assert_eq!(again.geometric_stiffness(), body.geometric_stiffness());
    }
}

/// The geometric stiffness of a body on its root that nothing carries is that of the nodes in its modes in mean axes.
#[test]
fn a_body_on_an_interface_keeps_its_geometric_stiffness_in_mean_axes() {
    let bar = Bar::new();
    let raw = bar.stressed();
    let body = body_of(raw.clone(), on_root());
    let free = body.in_mean_axes().expect("the stiffness of rotations is known");
    let psi = shapes(&free);
    assert!((psi.transpose() * &bar.m * bar.rigid()).amax() < 1e-9 * psi.amax() * bar.m.amax());
    assert_eq!(free.geometric_stiffness().len(), raw.data.geometric_stiffness.len());
    for given in &raw.data.geometric_stiffness {
        let own = free.geometric_stiffness().iter().find(|own| own.load == given.load).expect("the load");
        let expected = psi.transpose() * dense(&given.matrix.matrix) * &psi;
        let error = (converted_matrix(&own.matrix) - &expected).amax() / expected.amax();
        assert!(error < 1e-9, "{:?}: {error:e}", given.load);
    }
    let mut parts = body.into_parts();
    parts.rotated_stiffness.clear();
    let unknown = FlexBody::new(parts).expect("a body");
    let refused = unknown.in_mean_axes().expect_err("the stiffness of rotations is not known");
    assert!(refused.has(Code::CarrierImpossible), "{refused}");
}

/// Returns a basis of all displacements without motion of the root (3n x (3n - 6)).
fn at_rest(bar: &Bar) -> DMatrix<f64> {
    let projector =
        &bar.root * (bar.root.transpose() * &bar.root).try_inverse().expect("a root") * bar.root.transpose();
    let eigen = (DMatrix::identity(bar.k.nrows(), bar.k.nrows()) - projector).symmetric_eigen();
    let kept: Vec<usize> = (0..bar.k.nrows()).filter(|j| eigen.eigenvalues[*j] > 0.5).collect();
    assert_eq!(kept.len(), bar.k.nrows() - 6);
    eigen.eigenvectors.select_columns(&kept)
}

/// Returns the eigenvalues of (K, M), ascending.
fn eigenvalues(k: &DMatrix<f64>, m: &DMatrix<f64>) -> Vec<f64> {
    let lower = m.clone().cholesky().expect("a mass").l();
    let half = lower.solve_lower_triangular(k).expect("regular");
    let both = lower.solve_lower_triangular(&half.transpose()).expect("regular");
    let mut values: Vec<f64> =
        (0.5 * (&both + both.transpose())).symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

#[test]
fn a_blade_on_a_rotor_has_the_frequencies_of_its_nodal_equations() {
    for frame in frames() {
        assert_blade_frequencies(frame);
    }
}

fn assert_blade_frequencies(frame: FrameChoice) {
    let bar = Bar::new();
    let body = body_of(bar.stressed(), frame).carried(&root()).expect("a carrier");
    let (w2, nf) = (converted_matrix(&body.invariants().w2().expect("all groups")), body.n_modes());
    let rest = at_rest(&bar);
    let reduced = |a: &DMatrix<f64>| rest.transpose() * a * &rest;
    let still = eigenvalues(&reduced(&bar.k), &reduced(&bar.m));
    // The rotor axis is not through the root, and along no axis of the model.
    let hub = bar.origin - Vector3::new(0.5, 0.1, -0.2);
    let w = Vector3::new(0.3, -0.5, 0.8).normalize() * (0.8 * still[0].sqrt());
    let turn = |x: Vector3<f64>| w.cross(&w.cross(&x));
    let load = bar.inertia(|x| turn(x + bar.origin - hub));
    let load = &load - &bar.root * (bar.rigid().transpose() * &load);
    let softening = &bar.m
        * DMatrix::from_fn(bar.k.nrows(), bar.k.nrows(), |i, j| {
            if i / 3 == j / 3 { -turn(unit(j % 3))[i % 3] } else { 0.0 }
        });
    let nodal = &bar.k + dense(&bar.stress_stiffness(&load)) - softening;
    let expected = eigenvalues(&reduced(&nodal), &reduced(&bar.m));
    let a = turn(bar.origin - hub);
    let geometric = under(&body, |unit_load| match unit_load.kind {
        LoadKind::Acceleration => a[unit_load.component],
        LoadKind::Spin => w[LoadKind::SPIN[unit_load.component].0] * w[LoadKind::SPIN[unit_load.component].1],
        _ => 0.0,
    });
    let of_spin = DMatrix::from_fn(nf, nf, |i, j| {
        (0..9).map(|p| w[p / 3] * w[p % 3] * w2[(p / 3 * nf + i, p % 3 * nf + j)]).sum::<f64>()
    });
    let elastic = converted_matrix(body.invariants().modal_stiffness());
    let mass = converted_matrix(&body.invariants().modal_mass());
    let found = eigenvalues(&(elastic + geometric - 0.5 * (&of_spin + of_spin.transpose())), &mass);
    for mode in 0..6 {
        let error = (found[mode] / expected[mode] - 1.0).abs();
        assert!(error < 1e-9, "mode {mode}: {error:e}");
    }
    assert!(expected[0] > 1.05 * still[0], "{} {}", expected[0], still[0]);
}

fn carried_scene() -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, "[run]\nduration = 1e-3\n").expect("written");
    let mut scene = LoadCases::read_single(&path, None).expect("a scene");
    scene.carried = Some(Carried { by: Point::Interface("root".to_owned()), spin: None, translation: None });
    scene
}

#[test]
fn only_a_body_without_the_stiffness_of_rotations_loses_geometric_stiffness() {
    let raw = Bar::new().stressed();
    for (frame, is_known, is_lost) in [
        (on_root(), false, false),
        (BodyFrame::Com.into(), true, false),
        (BodyFrame::Com.into(), false, true),
    ] {
        let mut parts = body_of(raw.clone(), frame).into_parts();
        if !is_known {
            parts.rotated_stiffness.clear();
        }
        let body = FlexBody::new(parts).expect("a body");
        let scene = carried_scene();
        let framed = FramedScene::new(&body, &scene).expect("a carrier");
        let warned =
            framed.diagnostics.iter().any(|diagnostic| diagnostic.code() == Code::CarriedGeometricStiffness);
        assert_eq!((warned, framed.body.geometric_stiffness().is_empty()), (is_lost, is_lost));
    }
}
