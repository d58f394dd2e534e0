//! Reader and checks of MBSim files. Names follow external_flexible_ffr_body.cc.

use crate::import::hdf5_arrays::{Hdf5Arrays, surface};
use crate::import::redundant::{ROUNDING, asymmetry, relative};
use crate::import::{AuditCheck, ImportFormat, ImportedBody, ImportedFile, ImportedFrame};
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;
use flexbody_body::invariants::{Invariants, Numbered, PrimaryData, TermGroups};
use flexbody_linalg::larger;
use flexbody_model::SurfaceMesh;
use nalgebra::{Matrix3, Vector3};

/// Import format of MBSim.
pub(crate) struct Mbsim;

const REQUIRED: [&str; 7] = [
    "mass",
    "position integral",
    "position position integral",
    "shape function integral",
    "stiffness matrix",
    "position shape function integral",
    "shape function shape function integral",
];
const DAMPING: &str = "damping matrix";
const NUMBERS: &str = "node numbers";
const POSITIONS: &str = "nodal relative position";
const TRANSLATIONS: &str = "nodal shape matrix of translation";
const STRESSES: &str = "nodal stress matrix";
const INDICES: &str = "openmbv indices";
const ROTATIONS: &str = "nodal shape matrix of rotation";

/// Largest entry off the diagonal of the stiffness matrix, relative to the diagonal, for which the modes
/// count as eigenmodes. A larger value demands a diagonal modal mass of modes that are coupled by stiffness.
const DIAGONAL: f64 = 1e-8;

impl ImportFormat for Mbsim {
    fn name(&self) -> &'static str {
        "mbsim"
    }

    fn recognises(&self, file: &InputFile) -> bool {
        Hdf5Arrays::is_with(file, &["position position integral", "shape function integral"])
    }

    fn read(&self, file: &InputFile) -> Result<ImportedFile> {
        let mut arrays = Hdf5Arrays::open(file)?;
        arrays.require(&REQUIRED)?;
        let (_, nf) = arrays.extents("shape function integral")?;
        let integrals = Integrals::read(&mut arrays, nf)?;
        let damping = arrays.has(DAMPING).then(|| arrays.matrix(DAMPING, nf, nf)).transpose()?;
        let frames = frames(&mut arrays, nf)?;
        let mut omissions = Vec::new();
        if arrays.has(STRESSES) {
            omissions.push(format!("`{STRESSES}`: stresses of the modes are not converted"));
        }
        let mesh = mesh(&mut arrays, frames.len(), &mut omissions)?;
        let stiffness = arrays.matrix("stiffness matrix", nf, nf)?;
        let inertia = integrals.numbered();
        let mut notes = vec![format!("{} nodes, {nf} modes", frames.len())];
        notes.push(
            "the modal mass is the sum of the shape function shape function integrals, as MBSim computes it"
                .to_owned(),
        );
        Ok(ImportedFile {
            format: "mbsim",
            dialect: String::new(),
            notes,
            checks: checks(&integrals, &inertia, &stiffness, damping.as_ref()),
            unsound: Vec::new(),
            body: ImportedBody {
                name: String::new(),
                units: None,
                inertia,
                modal_stiffness: stiffness,
                modal_damping: damping,
                geometric_stiffness: Vec::new(),
                frames,
                mesh,
                omissions,
            },
        })
    }
}

/// Integrals over the mass in the file.
struct Integrals {
    mass: f64,
    /// Integral of x_a.
    first: Vector3<f64>,
    /// Integral of x_a x_b.
    second: Mat<f64>,
    /// Integral of S_a (3 x nf).
    shape: Mat<f64>,
    /// Integral of x_a S_b (9 x nf), row 3 a + b.
    position_shape: Mat<f64>,
    /// Integral of S_a S_b (6 nf x nf), blocks 11, 12, 13, 22, 23, 33.
    shape_shape: Mat<f64>,
}

impl Integrals {
    fn read(arrays: &mut Hdf5Arrays, nf: usize) -> Result<Self> {
        Ok(Self {
            mass: arrays.number("mass")?,
            first: Vector3::from_column_slice(&arrays.floats("position integral", &[3])?),
            second: arrays.matrix("position position integral", 3, 3)?,
            shape: arrays.matrix("shape function integral", 3, nf)?,
            position_shape: arrays.matrix("position shape function integral", 9, nf)?,
            shape_shape: arrays.matrix("shape function shape function integral", 6 * nf, nf)?,
        })
    }

    fn nf(&self) -> usize {
        self.shape.ncols()
    }

    /// Returns S_ab of two modes. A block below the diagonal is the transpose of the one above, as in MBSim.
    fn s(&self, a: usize, b: usize, j: usize, k: usize) -> f64 {
        if a > b {
            return self.s(b, a, k, j);
        }
        let block = [0, 3, 5][a] + b - a;
        self.shape_shape[(block * self.nf() + j, k)]
    }

    fn numbered(&self) -> Numbered {
        let nf = self.nf();
        let ibar = |a: usize, b: usize| (0..nf).map(|j| self.position_shape[(3 * a + b, j)]).collect();
        let s = |a: usize, b: usize| Mat::from_fn(nf, nf, |j, k| self.s(a, b, j, k));
        let body = PrimaryData {
            mass: self.mass,
            first_moment: self.first,
            second_moment: Matrix3::from_fn(|i, j| self.second[(i, j)]),
            c1: self.shape.clone(),
            ibar: [0, 1, 2].map(|a| [0, 1, 2].map(|b| ibar(a, b))),
            s: [0, 1, 2].map(|a| [0, 1, 2].map(|b| s(a, b))),
            modal_stiffness: Mat::zeros(nf, nf),
            general: None,
            groups: TermGroups::ALL,
        };
        Invariants::new(body).numbered()
    }
}

fn frames(arrays: &mut Hdf5Arrays, nf: usize) -> Result<Vec<ImportedFrame>> {
    // A place without known motion is not imported.
    if !(arrays.has(POSITIONS) && arrays.has(TRANSLATIONS)) {
        return Ok(Vec::new());
    }
    let positions = arrays.values::<f64>(POSITIONS)?.values;
    let n = positions.len() / 3;
    if !positions.len().is_multiple_of(3) {
        return Err(
            arrays.refuse(POSITIONS, &format!("expected three numbers per node, found {}", positions.len()))
        );
    }
    let labels: Vec<String> = if arrays.has(NUMBERS) {
        arrays.integers(NUMBERS)?.iter().map(i64::to_string).collect()
    } else {
        (1..=n).map(|number| number.to_string()).collect()
    };
    if labels.len() != n {
        return Err(arrays.refuse(NUMBERS, &format!("expected {n} numbers, found {}", labels.len())));
    }
    let translations = arrays.matrix(TRANSLATIONS, 3 * n, nf)?;
    let rotations = arrays.has(ROTATIONS).then(|| arrays.matrix(ROTATIONS, 3 * n, nf)).transpose()?;
    let rows = |shapes: &Mat<f64>, i: usize| shapes.as_ref().subrows(3 * i, 3).to_owned();
    let frame = |(i, label): (usize, String)| ImportedFrame {
        label,
        interface: None,
        position: [positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]],
        translation: rows(&translations, i),
        rotation: rotations.as_ref().map(|shapes| rows(shapes, i)),
    };
    Ok(labels.into_iter().enumerate().map(frame).collect())
}

/// Returns the surface from lines and faces of OpenMBV: node indices from 0, each line or face ended by -1.
fn mesh(arrays: &mut Hdf5Arrays, n: usize, omissions: &mut Vec<String>) -> Result<Option<SurfaceMesh>> {
    if !arrays.has(INDICES) {
        return Ok(None);
    }
    let indices = arrays.integers(INDICES)?;
    let polygons: Vec<Vec<i64>> = indices.split(|index| *index == -1).map(<[i64]>::to_vec).collect();
    Ok(surface(INDICES, &polygons, n, omissions))
}

fn checks(
    integrals: &Integrals,
    numbered: &Numbered,
    stiffness: &Mat<f64>,
    damping: Option<&Mat<f64>>,
) -> Vec<AuditCheck> {
    let nf = integrals.nf();
    let check = |name, formula, value, code, meaning: &str| AuditCheck {
        name,
        formula,
        value,
        limit: ROUNDING,
        code,
        meaning: meaning.to_owned(),
    };
    let block = |a: usize| Mat::from_fn(nf, nf, |j, k| integrals.s(a, a, j, k));
    let mut all = vec![
        check(
            "position_position_symmetric",
            "position position integral = its transpose",
            asymmetry(&integrals.second),
            Code::AuditIdentity,
            "the matrix is not symmetric, and MBSim reads only one triangle of it",
        ),
        check(
            "shape_shape_symmetric",
            "blocks 11, 22 and 33 of the shape function shape function integral = their transposes",
            (0..3).map(|a| asymmetry(&block(a))).fold(0.0, larger),
            Code::AuditIdentity,
            "the integral of a pair of shape functions differs between (j, k) and (k, j)",
        ),
    ];
    if let Some(damping) = damping {
        all.push(check(
            "damping_symmetric",
            "damping matrix = its transpose",
            asymmetry(damping),
            Code::AuditIdentity,
            "the matrix is not symmetric, and MBSim reads only one triangle of it",
        ));
    }
    // Eigenmodes are orthogonal with respect to their mass.
    if beside_diagonal(stiffness) <= DIAGONAL {
        all.push(check(
            "modal_mass_diagonal",
            "sum of blocks 11, 22 and 33 diagonal where the stiffness matrix is",
            beside_diagonal(&numbered.i6),
            Code::AuditLumped,
            "modes that are orthogonal in stiffness are not orthogonal in mass: the integrals and the modes come from different mass matrices, for example lumped and consistent ones",
        ));
    }
    all
}

/// Returns the largest entry off the diagonal, relative to the geometric mean of the two diagonal entries.
fn beside_diagonal(a: &Mat<f64>) -> f64 {
    let pairs = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j)));
    let size = |i: usize, j: usize| (a[(i, i)] * a[(j, j)]).abs().sqrt();
    pairs.filter(|(i, j)| i != j).map(|(i, j)| relative(a[(i, j)].abs(), size(i, j))).fold(0.0, larger)
}
