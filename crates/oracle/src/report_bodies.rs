//! Two small bodies: one of literal numbers, whose report is the same on every machine, and one condensed from a mesh.

#![allow(dead_code)]

use super::cuboid::Cuboid;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::provenance::SourceFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    Certificate, FlexBody, Interface, LumpedBody, MassStructure, Modes, Parts, ReferenceConditions, Source,
    Storage,
};
use flexbody_body::invariants::{
    BodyFrame, ERROR_NORMS, Frame, Invariants, PrimaryData, TermGroups, choose_frame, condense,
};
use flexbody_linalg::SymmetricMatrix;
use flexbody_model::{Coupling, Description, Nodes};
use flexbody_report::{Phase, RunData, SearchAttempt};
use nalgebra::{Matrix3, Vector3};

/// Returns the eigenvalue lambda of a frequency in hertz.
fn eigenvalue(hz: f64) -> f64 {
    (std::f64::consts::TAU * hz) * (std::f64::consts::TAU * hz)
}

/// Returns a body of literal numbers with eight modes, two of which are repeated.
pub fn engine_mount() -> FlexBody {
    let hz = [812.5, 812.5, 1204.0, 1890.25, 2411.0, 3020.0, 3999.0, 4412.5];
    let nf = hz.len();
    let invariants = |mass: f64, inertia: f64| {
        Invariants::new(PrimaryData {
            mass,
            first_moment: Vector3::zeros(),
            second_moment: Matrix3::from_diagonal(&Vector3::new(3.0e-3, 2.0e-3, 0.5e-3)) * inertia,
            c1: Mat::zeros(3, nf),
            ibar: [(); 3].map(|()| [(); 3].map(|()| vec![0.0; nf])),
            s: std::array::from_fn(|k| {
                std::array::from_fn(|l| {
                    Mat::from_fn(nf, nf, |p, q| if k == l && p == q { 1.0 / 3.0 } else { 0.0 })
                })
            }),
            modal_stiffness: Mat::from_fn(nf, nf, |p, q| if p == q { eigenvalue(hz[p]) } else { 0.0 }),
            general: None,
            groups: TermGroups::ALL,
        })
    };
    let lumped = |scheme: &str, negative_masses: usize, factor: f64| LumpedBody {
        scheme: scheme.to_owned(),
        invariants: invariants(1.25, 1.0 + factor),
        negative_masses,
        comparison: ERROR_NORMS
            .iter()
            .map(|(name, _)| {
                let value = match name.split('_').next().unwrap() {
                    "mass" | "com" => 0.0,
                    "I0" => 0.801,
                    "W1" => 0.125,
                    "W2" => 0.31,
                    "W3" => 0.24,
                    "modal" => 0.0625,
                    _ => 2.5e-4,
                };
                let largest = if name.ends_with("max") { 1.0 } else { 0.25 };
                (name.to_string(), value * largest * factor)
            })
            .collect(),
    };
    let file = |role: &str, name: &str, digit: &str| SourceFile {
        role: role.to_owned(),
        name: name.to_owned(),
        sha256: digit.repeat(64),
    };
    FlexBody::new(Parts {
        description: Description::new("engine mount", UnitSystem::parse("m", "kg", "s").unwrap()),
        source: Source {
            files: vec![
                file("stiffness", "K.mtx.gz", "1"),
                file("mass", "M.mtx.gz", "2"),
                file("nodes", "nodes.csv", "3"),
            ],
            n_dofs: 24,
            mass_structure: MassStructure::RotationInvariant,
            approximation: None,
            settings: serde_json::json!({ "accuracy": "standard", "frame": "principal", "modes": 8 }),
        },
        dimension: 3,
        frame: Frame { origin: Vector3::new(0.125, 0.0, -0.0625), axes: Matrix3::identity() },
        conditions: ReferenceConditions::MeanAxes,
        nodes: Nodes {
            ids: (1..=8).collect(),
            positions: (0..8)
                .map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 0.05 } else { -0.05 }))
                .collect(),
        },
        modes: Modes {
            eigenvalue: hz.map(eigenvalue).to_vec(),
            residual: (0..nf).map(|j| (1.0 + j as f64) * 1e-13).collect(),
            provenance: vec![],
            truncation: vec![],
            rotation: None,
            internal: None,
            damping_ratio: vec![0.0; nf],
            modal_damping: None,
            shape: Mat::from_fn(24, nf, |i, j| if i == j { 1.0 } else { 0.0 }),
        },
        invariants: invariants(1.25, 1.0),
        geometric_stiffness: vec![],
        rotated_stiffness: vec![],
        estimated_stiffness: Vec::new(),
        inertia_stiffness: None,
        lumped: vec![lumped("row-sum", 312, 1.0), lumped("diagonal-scaling", 0, 0.125)],
        certificate: Certificate {
            proved_modes: Some(8),
            shift: eigenvalue(5000.0),
            negative_pivots: Some(14),
            rigid_modes: 6,
            remark: String::new(),
            rigid_noise: 3.2e-9,
            rigid_residual: 1.1e-15,
            eigenvalue_rounding: 0.0,
            inertia_rounding: 0.0,
            guarantee: None,
            fixed_interface: None,
        },
        interfaces: vec![Interface {
            name: "base".to_owned(),
            nodes: vec![0, 1, 2, 3],
            coupling: Some(Coupling::Averaging),
            reference: Some([0.0, 0.0, 0.0]),
        }],
        coordinates: None,
        recoveries: vec![],
        named_loads: vec![],
        terms: Vec::new(),
        mesh: None,
        storage: Storage::F64,
    })
    .unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the run data of [`engine_mount`].
pub fn run_data() -> RunData {
    let phase = |name: &str, wall_seconds: f64, cpu_seconds: f64| Phase {
        name: name.to_owned(),
        wall_seconds,
        cpu_seconds,
    };
    RunData {
        phases: vec![
            phase("read", 0.21, 0.4),
            phase("check", 0.015, 0.02),
            phase("modes", 2.9, 5.6),
            phase("invariants", 0.125, 0.24),
        ],
        peak_memory_bytes: Some(512_345_678),
        memory_estimate_bytes: Some(498_000_000),
        threads: 2,
        instructions: "AVX2, FMA".to_owned(),
        diagnostics: vec![
            Diagnostic::new(Code::NoiseFloor, "rigid modes reach 3.2e-9 of the first eigenvalue")
                .in_file("K.mtx.gz"),
            Diagnostic::new(Code::NodesUnused, "2 nodes have no degree of freedom: 101, 102")
                .in_file("nodes.csv")
                .at_line(9),
        ],
        counters: vec![("factorisations".to_owned(), 2), ("solves".to_owned(), 96)],
        attempts: vec![attempt("cycles", Some("3 of 20 modes converged")), attempt("double precision", None)],
        accuracy: "standard".to_owned(),
        offered_stiffness: Vec::new(),
        output: Some(("mount.flex.h5".to_owned(), 1_234_567)),
        lumped_modes: vec![],
    }
}

/// An attempt to find the modes, which failed for a reason or found them.
fn attempt(way: &str, failure: Option<&str>) -> SearchAttempt {
    SearchAttempt { way: way.to_owned(), bytes: 412_000_000, failure: failure.map(str::to_owned) }
}

/// Returns a cuboid 3 x 2 x 1 of mass 6 with its corner at the origin: trilinear hexahedra, consistent mass.
pub fn mesh(cells: [usize; 3]) -> (SymmetricMatrix, Vec<[f64; 3]>) {
    let cuboid = Cuboid { cells, low: [0.0; 3], size: [3.0, 2.0, 1.0], density: 1.0 };
    (cuboid.scalar_mass(), cuboid.positions())
}

/// Squares of the circular frequencies of [`block`]: two pairs are repeated, one of them up to rounding.
pub const EIGENVALUES: [f64; 6] = [100.0, 100.0 * (1.0 + 1e-13), 250.0, 400.0, 400.0, 900.0];

/// Returns mass-normalised free-surface shapes of the cuboid: polynomials, M-orthonormal to each other and M-orthogonal
/// to rigid motion.
pub fn shapes(mass: &SymmetricMatrix, positions: &[[f64; 3]]) -> Mat<f64> {
    let fields: [fn([f64; 3]) -> [f64; 3]; 12] = [
        |_| [1.0, 0.0, 0.0],
        |_| [0.0, 1.0, 0.0],
        |_| [0.0, 0.0, 1.0],
        |[_, y, z]| [0.0, -z, y],
        |[x, _, z]| [z, 0.0, -x],
        |[x, y, _]| [-y, x, 0.0],
        |[x, _, z]| [-2.0 * x * z, 0.1 * x, x * x],
        |[x, y, z]| [-2.0 * x * y, x * x + y, 0.2 * z],
        |[x, y, z]| [x, -0.3 * y, -0.3 * z + 0.1 * x * y],
        |[x, y, z]| [0.1 * y * z, -x * z, x * y],
        |[x, y, z]| [y, x + 0.2 * y * z, 0.3 * x * y * z],
        |[x, y, z]| [y * y * z, z * x * x, 0.3 * z * z * x + y * y],
    ];
    let n = positions.len();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let times = |v: &[f64]| -> Vec<f64> {
        let mut product = vec![0.0; 3 * n];
        for i in 0..n {
            let (columns, values) = mass.row(i);
            for (&j, &m) in columns.iter().zip(values) {
                (0..3).for_each(|k| product[3 * i + k] += m * v[3 * j as usize + k]);
            }
        }
        product
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for field in fields {
        let centred = |x: &[f64; 3]| field([x[0] - 1.5, x[1] - 1.0, x[2] - 0.5]);
        let mut v: Vec<f64> = positions.iter().flat_map(centred).collect();
        // Two passes are enough.
        for _ in 0..2 {
            for b in &basis {
                let along = dot(b, &times(&v));
                v.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
            }
        }
        let norm = dot(&v, &times(&v)).sqrt();
        basis.push(v.iter().map(|v| v / norm).collect());
    }
    Mat::from_fn(3 * n, 6, |i, j| basis[6 + j][i])
}

/// Returns a body of any mesh, with any shapes in model axes, in any frame.
pub fn condensed(
    mass: &SymmetricMatrix,
    ids: Vec<i64>,
    positions: &[[f64; 3]],
    mut shape: Mat<f64>,
    frame: Frame,
) -> FlexBody {
    frame.rotate_shapes(&mut shape);
    let positions = frame.to_body(positions);
    let stiffness = Mat::from_fn(6, 6, |p, q| if p == q { EIGENVALUES[p] } else { 0.0 });
    let invariants = condense(mass, &positions, shape.as_ref(), stiffness);
    FlexBody::new(Parts {
        description: Description::new("block", UnitSystem::default()),
        source: Source {
            files: vec![],
            n_dofs: 3 * ids.len(),
            mass_structure: MassStructure::RotationInvariant,
            approximation: None,
            settings: serde_json::json!({}),
        },
        dimension: 3,
        frame,
        conditions: ReferenceConditions::MeanAxes,
        nodes: Nodes { ids, positions },
        modes: Modes {
            eigenvalue: EIGENVALUES.to_vec(),
            residual: vec![1e-14; 6],
            provenance: vec![],
            truncation: vec![],
            rotation: None,
            internal: None,
            damping_ratio: vec![0.0; 6],
            modal_damping: None,
            shape,
        },
        invariants,
        geometric_stiffness: vec![],
        rotated_stiffness: vec![],
        estimated_stiffness: Vec::new(),
        inertia_stiffness: None,
        lumped: vec![],
        certificate: Certificate {
            proved_modes: None,
            shift: 0.0,
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
        interfaces: vec![],
        coordinates: None,
        recoveries: vec![],
        named_loads: vec![],
        terms: Vec::new(),
        mesh: None,
        storage: Storage::F64,
    })
    .unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the cuboid of 3 x 3 x 2 elements in a frame.
pub fn block(frame: BodyFrame) -> FlexBody {
    let (mass, positions) = mesh([3, 3, 2]);
    let (frame, _) = choose_frame(&mass, &positions, frame).unwrap();
    let shape = shapes(&mass, &positions);
    condensed(&mass, (1..=positions.len() as i64).collect(), &positions, shape, frame)
}
