//! Reader and checks of Exudyn files. Names follow FEM.py of Exudyn 1.13.6; row or column 3 j + a of a large
//! array belongs to axis a of mode j.

use crate::import::hdf5_arrays::{Hdf5Arrays, surface};
use crate::import::redundant::{ROUNDING, Redundant, asymmetry, has_no_w2, in_other_order, relative};
use crate::import::{AuditCheck, ImportFormat, ImportedBody, ImportedFile, ImportedFrame};
use faer::Mat;
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_base::text::InputFile;
use flexbody_body::invariants::{Numbered, TermGroups};
use flexbody_linalg::larger;
use flexbody_model::SurfaceMesh;
use nalgebra::{Matrix3, Vector3};
use std::collections::HashSet;

/// Import format of Exudyn.
pub(crate) struct Exudyn;

const REQUIRED: [&str; 16] = [
    "modeBasis",
    "xRef",
    "massMatrixReduced",
    "stiffnessMatrixReduced",
    "infoList",
    "inertiaLocal",
    "Mtt",
    "totalMass",
    "chiU",
    "chiUtilde",
    "mPsiTildePsi",
    "mPsiTildePsiTilde",
    "mPhitTPsi",
    "mPhitTPsiTilde",
    "mXRefTildePsi",
    "mXRefTildePsiTilde",
];

const NUMBERS: &str = "nodeNumbers";
const TRIANGLES: &str = "trigList";
/// Damping of the modes, in files of flexbody; the loader of Exudyn ignores it.
const DAMPING: &str = "dampingMatrixReduced";
const STRESSES: &str = "postProcessingModes";

impl ImportFormat for Exudyn {
    fn name(&self) -> &'static str {
        "exudyn"
    }

    fn recognises(&self, file: &InputFile) -> bool {
        Hdf5Arrays::is_with(file, &["modeBasis", "mPsiTildePsi"])
    }

    fn read(&self, file: &InputFile) -> Result<ImportedFile> {
        let mut arrays = Hdf5Arrays::open(file)?;
        arrays.require(&REQUIRED)?;
        // Sizes, shapes and positions, which must agree with each other.
        let (rows, nf) = arrays.extents("modeBasis")?;
        let n = rows / 3;
        if !rows.is_multiple_of(3) {
            return Err(arrays.refuse("modeBasis", &format!("expected three rows per node, found {rows}")));
        }
        let shapes = arrays.matrix("modeBasis", rows, nf)?;
        let positions = arrays.floats("xRef", &[rows])?;
        let info = arrays.integers("infoList")?;
        if info.len() != 6 || info[..3] != [nf as i64, n as i64, 3] {
            let what = format!("expected {nf} modes, {n} nodes and dimension 3 first, found {info:?}");
            return Err(arrays.refuse("infoList", &what));
        }
        // Inertia arrays and their identities.
        let given = Given::read(&mut arrays, nf)?;
        let numbered = given.numbered();
        let general = arrays.attribute("massMatrixReduced", "mass_structure").as_deref() == Some("general");
        let damping = arrays.has(DAMPING).then(|| arrays.matrix(DAMPING, nf, nf)).transpose()?;
        let mut checks = given.checks(&numbered, general);
        checks.extend(damping.as_ref().map(damping_is_symmetric));
        let labels = labels(&mut arrays, n)?;
        let frame = |i: usize| ImportedFrame {
            label: labels[i].to_string(),
            interface: None,
            position: [positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]],
            translation: shapes.as_ref().subrows(3 * i, 3).to_owned(),
            rotation: None,
        };
        let counted = if arrays.has(NUMBERS) { "" } else { "; nodes count from 0" };
        let mut notes = vec![format!("{n} nodes, {nf} modes{counted}")];
        if general {
            notes.push("the file states that the mass does not commute with rotations: modal mass and mPsiTildePsiTilde need not agree".to_owned());
        }
        // Parts that a body cannot hold, or that the file lacks.
        let mut omissions = Vec::new();
        let mesh = mesh(&mut arrays, n, &mut omissions)?;
        if arrays.has_members(STRESSES) {
            omissions.push(format!("`{STRESSES}`: stresses of the modes are not converted"));
        }
        let mut inertia = numbered;
        if has_no_w2(&inertia) {
            inertia.i9 = None;
            omissions.push("mPsiTildePsiTilde is zero: the body is converted without W2".to_owned());
        }
        Ok(ImportedFile {
            format: "exudyn",
            dialect: String::new(),
            notes,
            checks,
            unsound: Vec::new(),
            body: ImportedBody {
                name: String::new(),
                units: None,
                inertia,
                modal_stiffness: given.stiffness,
                modal_damping: damping,
                geometric_stiffness: Vec::new(),
                frames: (0..n).map(frame).collect(),
                mesh,
                omissions,
            },
        })
    }
}

fn damping_is_symmetric(damping: &Mat<f64>) -> AuditCheck {
    AuditCheck {
        name: "damping_symmetric",
        formula: "dampingMatrixReduced = its transpose",
        value: asymmetry(damping),
        limit: ROUNDING,
        code: Code::AuditIdentity,
        meaning: "the damping of mode j by mode k differs from that of mode k by mode j".to_owned(),
    }
}

/// Returns the node numbers of the FE model, which files of flexbody state; otherwise the numbers of Exudyn,
/// from 0.
fn labels(arrays: &mut Hdf5Arrays, n: usize) -> Result<Vec<i64>> {
    let counted = || (0..n as i64).collect();
    if !arrays.has(NUMBERS) {
        return Ok(counted());
    }
    let numbers = arrays.integers(NUMBERS)?;
    if numbers.len() != n {
        return Err(arrays.refuse(NUMBERS, &format!("expected {n} numbers, found {}", numbers.len())));
    }
    // The nodes of an interface cross share one number.
    let distinct: HashSet<i64> = numbers.iter().copied().collect();
    Ok(if distinct.len() == n { numbers } else { counted() })
}

/// Returns the triangles for drawing and contact (k x 3 node indices) as a surface; `None` if there are none.
fn mesh(arrays: &mut Hdf5Arrays, n: usize, omissions: &mut Vec<String>) -> Result<Option<SurfaceMesh>> {
    if !arrays.has(TRIANGLES) {
        return Ok(None);
    }
    // Files of Exudyn store an empty list as floats.
    let corners = match arrays.values::<f64>(TRIANGLES) {
        Ok(found) if found.values.is_empty() => return Ok(None),
        _ => arrays.integers(TRIANGLES)?,
    };
    let triangles: Vec<Vec<i64>> = corners.chunks(3).map(<[i64]>::to_vec).collect();
    Ok(surface(TRIANGLES, &triangles, n, omissions))
}

/// Arrays of the file.
struct Given {
    mass: f64,
    mtt: Mat<f64>,
    chi: Vector3<f64>,
    chi_tilde: Mat<f64>,
    inertia: Mat<f64>,
    modal_mass: Mat<f64>,
    stiffness: Mat<f64>,
    psi_tilde_psi: Mat<f64>,
    psi_tilde_psi_tilde: Mat<f64>,
    phi_psi: Mat<f64>,
    phi_psi_tilde: Mat<f64>,
    x_psi: Mat<f64>,
    x_psi_tilde: Mat<f64>,
}

impl Given {
    fn read(arrays: &mut Hdf5Arrays, nf: usize) -> Result<Self> {
        Ok(Self {
            mass: arrays.number("totalMass")?,
            mtt: arrays.matrix("Mtt", 3, 3)?,
            chi: Vector3::from_column_slice(&arrays.floats("chiU", &[3])?),
            chi_tilde: arrays.matrix("chiUtilde", 3, 3)?,
            inertia: arrays.matrix("inertiaLocal", 3, 3)?,
            modal_mass: arrays.matrix("massMatrixReduced", nf, nf)?,
            stiffness: arrays.matrix("stiffnessMatrixReduced", nf, nf)?,
            psi_tilde_psi: arrays.matrix("mPsiTildePsi", 3 * nf, nf)?,
            psi_tilde_psi_tilde: arrays.matrix("mPsiTildePsiTilde", 3 * nf, 3 * nf)?,
            phi_psi: arrays.matrix("mPhitTPsi", 3, nf)?,
            phi_psi_tilde: arrays.matrix("mPhitTPsiTilde", 3, 3 * nf)?,
            x_psi: arrays.matrix("mXRefTildePsi", 3, nf)?,
            x_psi_tilde: arrays.matrix("mXRefTildePsiTilde", 3, 3 * nf)?,
        })
    }

    fn nf(&self) -> usize {
        self.phi_psi.ncols()
    }

    fn numbered(&self) -> Numbered {
        self.numbered_with(|axis, mode| 3 * mode + axis)
    }

    /// Returns the numbered invariants; `at(axis, mode)` gives the position of an axis of a mode in large
    /// arrays.
    fn numbered_with(&self, at: impl Fn(usize, usize) -> usize) -> Numbered {
        let nf = self.nf();
        let i9 = |row: usize, column: usize| {
            -self.psi_tilde_psi_tilde[(at(row / nf, row % nf), at(column / nf, column % nf))]
        };
        Numbered {
            i1: self.mass,
            i2: self.chi * self.mass,
            i3: self.phi_psi.clone(),
            i4: Mat::from_fn(3, nf, |a, j| -self.x_psi[(a, j)]),
            i5: Some(Mat::from_fn(3 * nf, nf, |row, k| -self.psi_tilde_psi[(at(row / nf, row % nf), k)])),
            i6: self.modal_mass.clone(),
            i7: Matrix3::from_fn(|i, j| self.inertia[(i, j)]),
            i8: (0..nf).map(|j| Matrix3::from_fn(|a, b| self.x_psi_tilde[(a, at(b, j))])).collect(),
            i9: Some(Mat::from_fn(3 * nf, 3 * nf, i9)),
            groups: TermGroups::ALL,
        }
    }

    fn checks(&self, numbered: &Numbered, general: bool) -> Vec<AuditCheck> {
        let redundant = Redundant::new(numbered);
        let identity = |name, formula, value, meaning: &str| AuditCheck {
            name,
            formula,
            value,
            limit: ROUNDING,
            code: Code::AuditIdentity,
            meaning: meaning.to_owned(),
        };
        let mut checks = vec![
            identity(
                "mtt_is_mass",
                "Mtt = totalMass I",
                self.mtt_missed(),
                "the mass of translations differs from the mass of the body",
            ),
            identity(
                "chi_tilde_is_chi",
                "chiUtilde = skew(chiU)",
                self.chi_missed(numbered),
                "the file states the centre of mass twice, with different coordinates",
            ),
            identity(
                "phi_tilde_is_phi",
                "mPhitTPsiTilde_j = skew(mPhitTPsi_j)",
                self.phi_missed(|axis, mode| 3 * mode + axis),
                "the two arrays for the motion of the centre of mass by the modes differ",
            ),
            identity(
                "x_psi_of_x_psi_tilde",
                "mXRefTildePsi_j = -skew part of mXRefTildePsiTilde_j",
                redundant.i4_of_i8(),
                "the two arrays for the coupling of modes and rotation differ",
            ),
            identity(
                "psi_tilde_psi_antisymmetric",
                "mPsiTildePsi_jk = -mPsiTildePsi_kj",
                redundant.i5_antisymmetric(),
                "a mode has moment of momentum with itself",
            ),
            identity(
                "psi_tilde_psi_tilde_symmetric",
                "mPsiTildePsiTilde = its transpose",
                redundant.i9_symmetric(),
                "the inertia of a pair of modes differs between (j, k) and (k, j)",
            ),
            identity(
                "psi_tilde_psi_of_psi_tilde_psi_tilde",
                "mPsiTildePsi_jk = skew part of mPsiTildePsiTilde_jk",
                redundant.i5_of_i9(),
                "pairs of the two arrays for the coupling of modes and rotation differ",
            ),
        ];
        if !general && !has_no_w2(numbered) {
            checks.push(redundant.lumped(
                "modal_mass_of_psi_tilde_psi_tilde",
                "massMatrixReduced = trace of mPsiTildePsiTilde_jk / 2",
                "mPsiTildePsiTilde",
            ));
        }
        self.layout(&mut checks);
        checks
    }

    /// Detects large arrays ordered by axes: their identities fail in the order by modes and hold in the
    /// order by axes.
    fn layout(&self, checks: &mut [AuditCheck]) {
        let nf = self.nf();
        let by_axes = |axis: usize, mode: usize| axis * nf + mode;
        let other = self.numbered_with(by_axes);
        let redundant = Redundant::new(&other);
        let seen_by = [
            ("phi_tilde_is_phi", self.phi_missed(by_axes)),
            ("x_psi_of_x_psi_tilde", redundant.i4_of_i8()),
            ("psi_tilde_psi_antisymmetric", redundant.i5_antisymmetric()),
            ("psi_tilde_psi_of_psi_tilde_psi_tilde", redundant.i5_of_i9()),
            ("modal_mass_of_psi_tilde_psi_tilde", redundant.i6_of_i9()),
        ];
        let meaning =
            "rows and columns are ordered by axes, then modes; Exudyn takes them by modes, then axes";
        in_other_order(checks, &seen_by, meaning);
    }

    fn mtt_missed(&self) -> f64 {
        let entries = (0..9).map(|ij| {
            let (i, j) = (ij / 3, ij % 3);
            (self.mtt[(i, j)] - if i == j { self.mass } else { 0.0 }).abs()
        });
        relative(entries.fold(0.0, larger), self.mass.abs())
    }

    fn chi_missed(&self, numbered: &Numbered) -> f64 {
        let skew = self.chi.cross_matrix();
        let entries = (0..9).map(|ij| (self.chi_tilde[(ij / 3, ij % 3)] - skew[(ij / 3, ij % 3)]).abs());
        // The scale is the radius of gyration, for a centre of mass at the origin.
        let gyration = (0.5 * numbered.i7.trace() / self.mass).abs().sqrt();
        relative(entries.fold(0.0, larger), gyration)
    }

    fn phi_missed(&self, at: impl Fn(usize, usize) -> usize) -> f64 {
        let missed_by_mode = |j: usize| {
            let skew = Vector3::from_fn(|a, _| self.phi_psi[(a, j)]).cross_matrix();
            let entry = |a: usize, b: usize| (self.phi_psi_tilde[(a, at(b, j))] - skew[(a, b)]).abs();
            let missed = (0..9).map(|ab| entry(ab / 3, ab % 3)).fold(0.0, larger);
            relative(missed, (self.mass * self.modal_mass[(j, j)]).abs().sqrt())
        };
        (0..self.nf()).map(missed_by_mode).fold(0.0, larger)
    }
}
