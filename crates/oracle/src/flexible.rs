//! Flexible bodies for tests of their equations of motion, with their oracles.

use super::elements::{ElementKind, MassRule, Material};
use super::equations::{ReducedBody, State};
use super::general::{GeneralBody, dense, quasi_velocities};
use super::mesh::{Mesh, grid};
use super::nodal::reduced;
use super::random::Random;
use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{
    Certificate, FlexBody, Frame, MassStructure, Modes, Parts, ReferenceConditions, Source, Storage,
};
use flexbody_body::invariants::{BodyFrame, GeneralTerms, Invariants, PrimaryData, TermGroups};
use flexbody_eigen::Wanted;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_model::{Description, FeModel, GeometricStiffness, LoadKind, Nodes, RawModel, UnitLoad};
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Converts a model with its lowest modes.
pub fn body_of(raw: RawModel, modes: usize, frame: BodyFrame) -> FlexBody {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, frame: frame.into(), ..ConvertSettings::default() };
    convert(&model, &settings, &Context::QUIET).expect("converts").body
}

/// Converts a model of the fixtures.
pub fn fixture(name: &str, modes: usize, frame: BodyFrame) -> FlexBody {
    let folder = crate::fixtures().join("models").join(name);
    let raw = read_model(&read_manifest(folder.join("model.toml")).expect("manifest")).expect("readable");
    body_of(raw, modes, frame)
}

/// Returns a rubber-like block without symmetry, in which W1, W2 and W3 all matter.
pub fn soft_block(modes: usize) -> FlexBody {
    let rubber = Material { youngs: 4.0, poisson: 0.3, density: 1.0 };
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([6, 4, 2]), |[x, y, z]| {
        [0.2 * x + 0.03 * y, 0.2 * y * (1.0 - 0.05 * x), 0.2 * z * (1.0 + 0.1 * y)]
    });
    body_of(mesh.assemble(&rubber, MassRule::Consistent).raw_model(), modes, BodyFrame::Principal)
}

/// Returns the body with a geometric stiffness of spin that is zero: its motion is the same, and nothing is missing in it.
pub fn unstressed(body: FlexBody) -> FlexBody {
    let nf = body.n_modes();
    let zero = |&component: &usize| GeometricStiffness {
        load: UnitLoad { kind: LoadKind::Spin, component },
        matrix: Mat::zeros(nf, nf),
    };
    let geometric_stiffness = LoadKind::Spin.of_dimension(body.dimension()).iter().map(zero).collect();
    let parts = Parts { geometric_stiffness, estimated_stiffness: Vec::new(), ..body.into_parts() };
    FlexBody::new(parts).expect("a body")
}

/// Returns the oracle with the invariants of the body.
pub fn oracle(body: &FlexBody) -> GeneralBody {
    let own = body.invariants();
    GeneralBody { reduced: reduced(own), w0: dense(&own.w0()) }
}

/// Returns the primary data of given invariants; `solid` if M = Ms kron I3.
pub fn invariants_of(body: &GeneralBody, solid: bool) -> Invariants {
    let GeneralBody { reduced, w0 } = body;
    let ReducedBody { c1, c2, w1, w2, w3, .. } = reduced;
    let nf = c1.ncols();
    let faer = |a: &DMatrix<f64>| Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)]);
    // Diagonal entries follow from the trace of W1, off-diagonal ones from W1 and the skew part C2.
    let ibar = |k: usize, l: usize, j: usize| {
        if k == l {
            let trace: f64 = (0..3).map(|b| w1[(b, b * nf + j)]).sum();
            return 0.25 * trace - 0.5 * w1[(k, k * nf + j)];
        }
        let skew = if (k + 1) % 3 == l { c2[(3 - k - l, j)] } else { -c2[(3 - k - l, j)] };
        0.5 * (skew - w1[(k, l * nf + j)])
    };
    // S follows from W2 alike.
    let s = |k: usize, l: usize, i: usize, j: usize| {
        if k == l {
            let trace: f64 = (0..3).map(|b| w2[(b * nf + i, b * nf + j)]).sum();
            return 0.5 * trace - w2[(k * nf + i, k * nf + j)];
        }
        -w2[(l * nf + i, k * nf + j)]
    };
    Invariants::new(PrimaryData {
        mass: reduced.mass,
        first_moment: reduced.first_moment,
        second_moment: Matrix3::identity() * (0.5 * reduced.inertia.trace()) - reduced.inertia,
        c1: faer(c1),
        ibar: [0, 1, 2].map(|k| [0, 1, 2].map(|l| (0..nf).map(|j| ibar(k, l, j)).collect())),
        s: [0, 1, 2].map(|k| [0, 1, 2].map(|l| Mat::from_fn(nf, nf, |i, j| s(k, l, i, j)))),
        modal_stiffness: faer(&reduced.modal_stiffness),
        general: (!solid).then(|| GeneralTerms {
            w0: faer(w0),
            w3: faer(w3),
            modal_mass: faer(&reduced.modal_mass),
            plane: false,
        }),
        groups: TermGroups::ALL,
    })
}

/// Returns a body with these invariants, some nodes and damping.
pub fn made_of(
    invariants: Invariants,
    positions: Vec<[f64; 3]>,
    shape: Mat<f64>,
    damping: Mat<f64>,
) -> FlexBody {
    let nf = invariants.n_modes();
    let general = invariants.general().is_some();
    FlexBody::new(Parts {
        description: Description::new("random", UnitSystem::default()),
        source: Source {
            files: Vec::new(),
            n_dofs: 3 * positions.len(),
            mass_structure: if general { MassStructure::General } else { MassStructure::RotationInvariant },
            approximation: None,
            settings: serde_json::Value::Null,
        },
        dimension: 3,
        frame: Frame::model(),
        conditions: ReferenceConditions::MeanAxes,
        nodes: Nodes { ids: (1..=positions.len() as i64).collect(), positions },
        modes: Modes {
            eigenvalue: (1..=nf).map(|j| j as f64).collect(),
            residual: vec![0.0; nf],
            provenance: Vec::new(),
            truncation: Vec::new(),
            damping_ratio: vec![0.0; nf],
            modal_damping: Some(damping),
            shape,
            rotation: None,
            internal: None,
        },
        invariants,
        geometric_stiffness: Vec::new(),
        rotated_stiffness: Vec::new(),
        estimated_stiffness: Vec::new(),
        inertia_stiffness: None,
        lumped: Vec::new(),
        certificate: Certificate {
            proved_modes: None,
            shift: 1.0,
            negative_pivots: None,
            rigid_modes: 6,
            remark: String::new(),
            rigid_noise: 0.0,
            rigid_residual: 0.0,
            eigenvalue_rounding: 0.0,
            inertia_rounding: 0.0,
            guarantee: None,
            fixed_interface: None,
        },
        interfaces: Vec::new(),
        coordinates: None,
        recoveries: Vec::new(),
        named_loads: Vec::new(),
        terms: Vec::new(),
        mesh: None,
        storage: Storage::F64,
    })
    .expect("valid parts")
}

/// Returns `body` without the second-order terms of its rotating nodes, as oracles of first order describe it.
pub fn to_first_order(body: FlexBody) -> FlexBody {
    let mut parts = body.into_parts();
    parts.inertia_stiffness = None;
    FlexBody::new(parts).expect("valid parts")
}

/// Returns `body` with random geometric stiffness for all loads of the given kinds, with entries up to `size`.
pub fn stressed(body: FlexBody, kinds: &[LoadKind], size: f64, random: &mut Random) -> FlexBody {
    let (nf, dimension) = (body.n_modes(), body.dimension());
    let mut parts = body.into_parts();
    parts.rotated_stiffness.clear();
    for kind in kinds {
        for &component in kind.of_dimension(dimension) {
            let a = Mat::from_fn(nf, nf, |_, _| 0.5 * size * random.signed());
            let matrix = Mat::from_fn(nf, nf, |i, j| a[(i, j)] + a[(j, i)]);
            let load = UnitLoad { kind: kind.clone(), component };
            parts.geometric_stiffness.push(GeometricStiffness { load, matrix });
        }
    }
    FlexBody::new(parts).expect("valid parts")
}

/// Sets an evaluation to the state of an oracle.
pub fn set(evaluation: &mut Evaluation<'_>, state: &State) {
    evaluation.set(state.q.as_slice(), quasi_velocities(state).as_slice());
}

/// Returns the accelerations (R'' world, alpha body, q'') under the forces that `load` adds.
pub fn accelerations(
    equations: &EquationsOfMotion,
    state: &State,
    load: impl Fn(&Evaluation<'_>, &mut [f64]),
) -> DVector<f64> {
    let mut evaluation = Evaluation::new(equations);
    set(&mut evaluation, state);
    let mut forces = vec![0.0; equations.n_velocities()];
    load(&evaluation, &mut forces);
    let mut found = DVector::zeros(forces.len());
    evaluation.accelerations(&forces, found.as_mut_slice()).expect("a body with mass");
    let own = found.fixed_rows::<3>(0).into_owned();
    let velocity = state.axes.transpose() * state.velocity;
    found.rows_mut(0, 3).copy_from(&(state.axes * (own + state.omega.cross(&velocity))));
    found
}

/// Returns a state with spin and modal rates on one time scale, so that no force hides the others.
pub fn moving_state(random: &mut Random, body: &FlexBody) -> State {
    let (nf, inertia) = (body.n_modes(), body.invariants().inertia());
    let size = inertia.norm().sqrt();
    let lambda = &body.modes().eigenvalue;
    let rate = lambda[0].sqrt();
    State {
        origin: Vector3::from(random.vector::<3>()),
        axes: random.rotation(),
        velocity: Vector3::from(random.vector::<3>()) * (rate * size / body.invariants().mass().sqrt()),
        omega: Vector3::from(random.vector::<3>()) * (0.5 * rate),
        q: DVector::from_fn(nf, |j, _| 0.1 * size * lambda[0] / lambda[j] * random.signed()),
        qd: DVector::from_fn(nf, |j, _| 0.1 * size * rate * (lambda[0] / lambda[j]).sqrt() * random.signed()),
    }
}
