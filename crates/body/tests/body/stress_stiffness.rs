//! Stress stiffness and stresses from the elements of a deck, beside other element code, dense solutions and the identities
//! of rigid motion.

use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_body::basis::interface_loads;
use flexbody_body::convert::{ConvertSettings, StressLoads, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_eigen::Wanted;
use flexbody_elements::{Axes, DescribedElements, Elasticity, ElementGroup, Section};
use flexbody_linalg::CscMatrix;
use flexbody_linalg::context::Context;
use flexbody_model::{
    Coupling, FeModel, GeometricStiffness, LoadKind, ModelLoad, NodalStress, NodeSet, RawMatrix, RawModel,
    StressNodes, UnitLoad,
};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, entries, grid};
use std::path::PathBuf;
use std::sync::Arc;

const MATERIAL: Material = Material { youngs: 1e7, poisson: 0.3, density: 1000.0 };

/// Kinds that both codes integrate with the same points. Of C3D10 the four points of FE programs do not integrate K_geo exactly;
/// `crates/elements/tests` compares it with CalculiX.
const KINDS: [(ElementKind, &str); 3] =
    [(ElementKind::Tet4, "C3D4"), (ElementKind::Hex8, "C3D8"), (ElementKind::Hex20, "C3D20")];

/// Places of the nodes of a hexahedron in the order of Abaqus and CalculiX.
const HEXAHEDRON: [[i32; 3]; 20] = [
    [-1, -1, -1],
    [1, -1, -1],
    [1, 1, -1],
    [-1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [1, 1, 1],
    [-1, 1, 1],
    [0, -1, -1],
    [1, 0, -1],
    [0, 1, -1],
    [-1, 0, -1],
    [0, -1, 1],
    [1, 0, 1],
    [0, 1, 1],
    [-1, 0, 1],
    [-1, -1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 1, 0],
];

/// A skew bar with two interfaces, its elements as a deck describes them, and its dense matrices.
struct Bar {
    mesh: Mesh,
    raw: RawModel,
    k: DMatrix<f64>,
    m: DMatrix<f64>,
}

fn dense(matrix: &CscMatrix) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(matrix.n_rows(), matrix.n_cols());
    entries(matrix).for_each(|(r, c, v)| all[(r as usize, c as usize)] += v);
    all
}

/// Returns the elements of a mesh as a deck describes them.
fn described(mesh: &Mesh, kind: &str) -> DescribedElements {
    let elasticity = Elasticity::isotropic(MATERIAL.youngs, MATERIAL.poisson).expect("a material");
    let in_order = |(kind, nodes): &(ElementKind, Vec<usize>)| -> Vec<i64> {
        let order: Vec<usize> = match kind {
            ElementKind::Tet4 | ElementKind::Tet10 => (0..nodes.len()).collect(),
            ElementKind::Hex8 | ElementKind::Hex20 => {
                let signs = kind.hex_signs();
                let place = |wanted: &[i32; 3]| signs.iter().position(|own| own == wanted).expect("a node");
                HEXAHEDRON[..nodes.len()].iter().map(place).collect()
            }
        };
        order.into_iter().map(|at| nodes[at] as i64 + 1).collect()
    };
    let group = ElementGroup {
        kind: kind.to_owned(),
        section: Section { material: "rubber".to_owned(), elasticity, axes: Axes::Model },
        ids: (1..=mesh.elements.len() as i64).collect(),
        nodes: mesh.elements.iter().flat_map(in_order).collect(),
        internal: Vec::new(),
    };
    let positions = (1..).zip(&mesh.nodes).map(|(id, x)| (id, *x)).collect();
    DescribedElements { groups: vec![group], positions, ..DescribedElements::default() }
}

impl Bar {
    fn new(kind: ElementKind, name: &str) -> Self {
        let mesh = Mesh::from_cells(kind, &grid([3, 1, 1]), |p| {
            [0.4 + 0.3 * p[0] + 0.02 * p[1], 0.2 + 0.12 * p[1] + 0.03 * p[0] * p[2], 0.09 * p[2] - 0.1]
        });
        let mut raw = mesh.assemble(&MATERIAL, MassRule::Consistent).raw_model();
        let end = |at: f64| -> Vec<i64> {
            let near = |x: &[f64; 3]| (x[0] - 0.02 * (x[1] - 0.2) / 0.12 - at).abs() < 0.05;
            (1..).zip(&mesh.nodes).filter(|(_, x)| near(x)).map(|(id, _)| id).collect()
        };
        raw.data.interfaces = [("root", 0.4), ("tip", 1.3)]
            .map(|(name, at)| NodeSet { coupling: Some(Coupling::Averaging), ..NodeSet::new(name, end(at)) })
            .to_vec();
        let forces = (0..3 * mesh.nodes.len()).map(|row| (1.3 * row as f64).sin()).collect();
        let load = ModelLoad { name: "bolts".to_owned(), forces, preload: false, path: PathBuf::new() };
        raw.data.named_loads = vec![load];
        raw.data.elements = Some(Arc::new(described(&mesh, name)));
        let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
        Self { mesh, raw, k, m }
    }

    /// Returns rigid motions about the origin (3n x 6).
    fn rigid(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.k.nrows(), 6, |row, c| {
            let arm = Vector3::from(self.mesh.nodes[row / 3]);
            let unit = |axis: usize| Vector3::ith(axis, 1.0);
            if c < 3 { unit(c)[row % 3] } else { unit(c - 3).cross(&arm)[row % 3] }
        })
    }

    /// Returns the static response of the free body to a load that its inertia balances.
    fn response(&self, load: &DVector<f64>) -> DVector<f64> {
        let rigid = self.rigid();
        let mass = rigid.transpose() * &self.m * &rigid;
        let relief = mass.lu().solve(&(rigid.transpose() * load)).expect("a mass");
        let balanced = load - &self.m * &rigid * relief;
        let stiff = &self.k + &rigid * rigid.transpose() * (self.k.amax() / rigid.norm_squared());
        stiff.lu().solve(&balanced).expect("stiff")
    }

    /// Returns the unit loads with their nodal forces: spin, forces and moments at both interfaces, the named load.
    fn loads(&self) -> Vec<(UnitLoad, DVector<f64>)> {
        let unit = |axis: usize| Vector3::<f64>::ith(axis, 1.0);
        let spin = |component: usize| {
            let (k, l) = LoadKind::SPIN[component];
            let pair = |k: usize, l: usize, x: &Vector3<f64>| unit(k).cross(&unit(l).cross(x));
            let acceleration = DVector::from_fn(self.k.nrows(), |row, _| {
                let x = Vector3::from(self.mesh.nodes[row / 3]);
                let both = if k == l { pair(k, k, &x) } else { pair(k, l, &x) + pair(l, k, &x) };
                both[row % 3]
            });
            (UnitLoad { kind: LoadKind::Spin, component }, -(&self.m * acceleration))
        };
        let model = FeModel::from_raw(self.raw.clone()).expect("a sound model").model;
        let mut all: Vec<_> = (0..6).map(spin).collect();
        for name in ["root", "tip"] {
            let own = interface_loads(&model, name).expect("loads").expect("a reference point");
            for (c, load) in UnitLoad::at_interface(name).into_iter().enumerate() {
                all.push((load, DVector::from_fn(own.nrows(), |row, _| own[(row, c)])));
            }
        }
        let named = DVector::from_row_slice(&self.raw.data.named_loads[0].forces);
        all.push((UnitLoad { kind: LoadKind::Named("bolts".to_owned()), component: 0 }, named));
        all
    }

    /// Returns the model with the stress stiffness of other element code under all loads, and without elements.
    fn stressed(&self) -> RawModel {
        let stiffness = |(load, forces): (UnitLoad, DVector<f64>)| {
            let moved = self.response(&forces);
            let matrix = self.mesh.geometric_stiffness(&MATERIAL, moved.as_slice());
            GeometricStiffness { load, matrix: RawMatrix { matrix, digits: 17, path: PathBuf::new() } }
        };
        let all = self.loads().into_iter().map(stiffness).collect();
        self.raw.clone().with(|data| {
            data.geometric_stiffness = all;
            data.elements = None;
        })
    }
}

fn body_of(raw: RawModel, stress_stiffness: StressLoads) -> FlexBody {
    let model = FeModel::from_raw(raw).expect("a sound model").model;
    let mut settings = ConvertSettings { lumped: Vec::new(), stress_stiffness, ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(12);
    convert(&model, &settings, &Context::QUIET).expect("a body").body
}

const ALL: StressLoads = StressLoads { spin: true, interfaces: true, loads: true };

fn assert_near(found: &Mat<f64>, expected: &Mat<f64>, what: &str) {
    let difference = (found - expected).norm_max();
    assert!(difference <= 1e-8 * expected.norm_max(), "{what}: {difference:e} of {:e}", expected.norm_max());
}

#[test]
fn the_stress_stiffness_of_every_load_is_that_of_other_element_code() {
    for (kind, name) in KINDS {
        let bar = Bar::new(kind, name);
        let (own, given) = (body_of(bar.raw.clone(), ALL), body_of(bar.stressed(), StressLoads::default()));
        let loads: Vec<&UnitLoad> =
            own.geometric_stiffness().iter().map(|stiffness| &stiffness.load).collect();
        let expected: Vec<&UnitLoad> =
            given.geometric_stiffness().iter().map(|stiffness| &stiffness.load).collect();
        assert_eq!(loads, expected, "{name}");
        assert_eq!(loads.len(), 6 + 12 + 1, "{name}");
        for (own, given) in own.geometric_stiffness().iter().zip(given.geometric_stiffness()) {
            assert_near(&own.matrix, &given.matrix, &format!("{name} {}", own.load));
        }
        let rotated = own.parts().rotated_stiffness.iter().zip(&given.parts().rotated_stiffness);
        for (own, given) in rotated {
            assert_near(&own.modes, &given.modes, &format!("{name} rotated"));
        }
    }
}

#[test]
fn a_stated_stress_stiffness_is_kept_and_only_wanted_loads_are_computed() {
    let bar = Bar::new(ElementKind::Hex8, "C3D8");
    let mut raw = bar.stressed();
    raw.data.elements = bar.raw.data.elements.clone();
    raw.data.geometric_stiffness.truncate(1);
    let [stated] = &raw.data.geometric_stiffness[..] else { panic!("one") };
    let stated = stated.load.clone();
    let body = body_of(raw, StressLoads { interfaces: true, ..StressLoads::default() });
    let loads: Vec<&UnitLoad> = body.geometric_stiffness().iter().map(|stiffness| &stiffness.load).collect();
    assert_eq!(loads.len(), 1 + 12);
    assert_eq!(*loads[0], stated);
}

#[test]
fn stresses_at_nodes_become_a_recovery_with_static_columns() {
    let bar = Bar::new(ElementKind::Hex20, "C3D20");
    let asked = NodalStress { name: "all".to_owned(), nodes: StressNodes::All, path: PathBuf::new() };
    let raw = bar.raw.clone().with(|data| data.nodal_stresses = vec![asked]);
    let body = body_of(raw, StressLoads::default());
    let [recovery] = body.recoveries() else { panic!("one recovery") };
    assert_eq!(recovery.rows.len(), 6 * bar.mesh.nodes.len());
    // With all modes the static columns vanish; with some, modes and columns together are the static stress of the load.
    let (load, forces) = bar.loads().swap_remove(6 + 6);
    assert_eq!(load.label(), "force_x_tip");
    let u = bar.response(&forces);
    let rows = FeModel::from_raw(bar.raw.clone().with(|data| {
        data.nodal_stresses =
            vec![NodalStress { name: "all".into(), nodes: StressNodes::All, path: PathBuf::new() }];
    }))
    .expect("a model");
    let field = Mat::from_fn(u.len(), 1, |i, _| u[i]);
    let model = &rows.model;
    let expected =
        flexbody_body::convert::recovered_rows(model, &model.recoveries()[0], &field).expect("rows");
    let modal =
        DMatrix::from_fn(body.n_modes(), body.n_modes(), |i, j| body.invariants().modal_stiffness()[(i, j)]);
    let shapes =
        DMatrix::from_fn(3 * bar.mesh.nodes.len(), body.n_modes(), |i, j| body.modes().shape[(i, j)]);
    let amplitudes = modal.lu().solve(&(shapes.transpose() * &forces)).expect("stiff");
    let column = &recovery.loads.iter().find(|load| load.interface == "tip").expect("the tip").columns;
    for row in 0..recovery.rows.len() {
        let of_modes: f64 = (0..body.n_modes()).map(|j| recovery.modes[(row, j)] * amplitudes[j]).sum();
        let found = of_modes + column[(row, 0)];
        let allowed = 1e-8 * expected.norm_max();
        assert!(
            (found - expected[(row, 0)]).abs() < allowed,
            "{}: {found} {}",
            recovery.rows[row].name,
            expected[(row, 0)]
        );
    }
}

#[test]
fn elements_that_are_not_proved_are_refused() {
    let bar = Bar::new(ElementKind::Hex8, "C3D8");
    let convert_with = |raw: RawModel| {
        let model = FeModel::from_raw(raw).expect("a sound model").model;
        let settings = ConvertSettings { stress_stiffness: ALL, ..ConvertSettings::default() };
        let error = convert(&model, &settings, &Context::QUIET).expect_err("refused");
        error.first_error().clone()
    };
    let unknown = convert_with(bar.raw.clone().with(|data| data.elements = None));
    assert_eq!(unknown.code(), Code::ElementsUnproved);
    assert!(unknown.message().contains("not known"), "{}", unknown.message());
    let other = convert_with(bar.raw.clone().with(|data| {
        let mut changed = data.elements.as_deref().expect("elements").clone();
        changed.groups[0].section.elasticity = Elasticity::isotropic(1.000_001e7, 0.3).expect("a material");
        data.elements = Some(Arc::new(changed));
    }));
    assert_eq!(other.code(), Code::ElementsUnproved);
    assert!(other.message().contains("all 3 elements of type C3D8"), "{}", other.message());
}
