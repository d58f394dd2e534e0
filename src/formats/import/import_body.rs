//! A body of a file of another program as a body of ours.

use super::any_body::{ANY_BODY, DIGITS, NO_INERTIA, axes_without_inertia};
use super::free_surface::{FreeSurface, beside_diagonal, is_free_surface};
use super::{ImportedBody, ImportedFile, ImportedFrame};
use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::{Error, Result};
use crate::base::provenance::SourceFile;
use crate::base::units::UnitSystem;
use crate::body::flex_body::{
    Certificate, FlexBody, Frame, GeometricStiffness, Group, Interface, MassStructure, Modes, Parts, Source,
    Storage, TermDecision,
};
use crate::body::invariants::{BodyFrame, Invariants, identities, symmetric_part};
use crate::model::Nodes;
use crate::numerics::linalg::larger;
use faer::Mat;
use std::collections::HashSet;

/// How far inertia may be from that of a body before nothing can be computed with it: rounding of few digits
/// is far below.
const BROKEN: f64 = 1e-2;

/// A body that was made of a file, and the diagnostics of the way.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The body, in the frame of the file.
    pub body: FlexBody,
    /// What was changed, what is missing.
    pub diagnostics: Vec<Diagnostic>,
}

/// Makes a body of `file`, which was read from `source`; `units` count where the file states none.
///
/// Modes that are mass-normalised, free-surface and diagonal in K to 1e-9 are taken as they are, to the last
/// bit. Others are made so: the rigid part is removed and the small eigenproblem solved, with the products
/// that the invariants hold (theory 5.2). The body is the same, in other coordinates; its frame is that which
/// rides on the mean motion.
///
/// # Errors
/// [`ForeignUnsound`](Code::ForeignUnsound) for what the reader says;
/// [`ForeignIncomplete`](Code::ForeignIncomplete) when no place of the body is known, modes are rigid motions
/// or depend on each other, or the stiffness is not positive; those of [`FlexBody::new`].
pub fn import_body(file: &ImportedFile, source: SourceFile, units: UnitSystem) -> Result<Imported> {
    refuse_unsound(file)?;
    let given = &file.body;
    let lacking = |lack: &String| Diagnostic::new(Code::ForeignDropped, lack.clone());
    let mut diagnostics: Vec<Diagnostic> = given.lacks.iter().map(lacking).collect();
    let mut coordinates = ModalCoordinates::new(given)?;
    if let Some(missed) = is_free_surface(&coordinates.invariants) {
        let change = FreeSurface::new(&coordinates.invariants)?;
        diagnostics.push(change.note(missed));
        coordinates = coordinates.changed(&change, &given.frames);
    }
    let body = FlexBody::new(parts(file, coordinates, source, units))?;
    let (body, warning) = with_own_rounding(body)?;
    diagnostics.extend(warning);
    Ok(Imported { body, diagnostics })
}

/// Refuses what the reader found unsound, and a file without places.
fn refuse_unsound(file: &ImportedFile) -> Result<()> {
    if !file.unsound.is_empty() {
        let refused = |why: &String| Diagnostic::new(Code::ForeignUnsound, why.clone());
        return Err(Error::new(file.unsound.iter().map(refused).collect()));
    }
    if file.body.frames.is_empty() {
        let message = "the file has no node: neither positions nor shapes of the body are known";
        return Err(Diagnostic::new(Code::ForeignIncomplete, message).into());
    }
    Ok(())
}

/// Everything of a body that depends on its modal coordinates.
struct ModalCoordinates {
    invariants: Invariants,
    /// 3n x nf.
    shape: Mat<f64>,
    rotation: Option<Mat<f64>>,
    damping: Option<Mat<f64>>,
    geometric_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
}

impl ModalCoordinates {
    /// Those of the file, with the symmetries that every body has.
    fn new(given: &ImportedBody) -> Result<Self> {
        let invariants = sound_invariants(given)?;
        let turns = given.frames.iter().any(|frame| frame.rotation.is_some());
        let mut geometric_stiffness = given.geometric_stiffness.clone();
        for one in &mut geometric_stiffness {
            one.matrix = symmetric_part(&one.matrix);
        }
        Ok(Self {
            invariants,
            shape: stacked(&given.frames, |frame| Some(&frame.translation)),
            rotation: turns.then(|| stacked(&given.frames, |frame| frame.rotation.as_ref())),
            damping: given.modal_damping.as_ref().map(symmetric_part),
            geometric_stiffness,
        })
    }

    /// The same body in the coordinates of free-surface modes.
    fn changed(self, change: &FreeSurface, frames: &[ImportedFrame]) -> Self {
        let positions: Vec<[f64; 3]> = frames.iter().map(|frame| frame.position).collect();
        let turns: Vec<bool> = frames.iter().map(|frame| frame.rotation.is_some()).collect();
        Self {
            invariants: change.invariants(&self.invariants),
            shape: change.shapes(&self.shape, &positions),
            rotation: self.rotation.map(|rotation| change.rotations(&rotation, &turns)),
            damping: self.damping.map(|damping| change.congruent(&damping)),
            geometric_stiffness: self
                .geometric_stiffness
                .into_iter()
                .map(|one| GeometricStiffness { matrix: change.congruent(&one.matrix), load: one.load })
                .collect(),
        }
    }
}

/// The invariants of the file, which must be those of some body.
fn sound_invariants(given: &ImportedBody) -> Result<Invariants> {
    let stiffness = symmetric_part(&given.modal_stiffness);
    let invariants = Invariants::from_numbered(&given.inertia, stiffness, DIGITS).with_symmetries();
    if let Some(broken) = identities(&invariants, &ANY_BODY).into_iter().find(|check| {
        matches!(check.name, "finite" | "mass_positive" | "second_moment_psd" | "inertia_psd")
            && check.value > BROKEN
    }) {
        let message = format!("inertia is not that of a body: {} does not hold", broken.formula);
        return Err(Diagnostic::new(Code::ForeignIncomplete, message).into());
    }
    if axes_without_inertia(&given.inertia) != 0.0 {
        return Err(Diagnostic::new(Code::ForeignIncomplete, NO_INERTIA).into());
    }
    Ok(invariants)
}

/// The parts of the body in its final coordinates.
fn parts(file: &ImportedFile, coordinates: ModalCoordinates, source: SourceFile, units: UnitSystem) -> Parts {
    let given = &file.body;
    let invariants = &coordinates.invariants;
    Parts {
        source: source_facts(file, invariants, source),
        dimension: 3,
        units: given.units.clone().unwrap_or(units),
        frame: Frame { origin: nalgebra::Vector3::zeros(), axes: nalgebra::Matrix3::identity() },
        nodes: nodes(&given.frames),
        mesh: None,
        lumped: Vec::new(),
        certificate: certificate(file, invariants),
        interfaces: interfaces(given),
        coordinates: None,
        terms: invariants.groups().dropped().map(|group| not_in_file(group, file.format)).collect(),
        storage: Storage::F64,
        modes: modes(
            file,
            &coordinates.invariants,
            coordinates.shape,
            coordinates.rotation,
            coordinates.damping,
        ),
        invariants: coordinates.invariants,
        geometric_stiffness: coordinates.geometric_stiffness,
        inertia_stiffness: None,
    }
}

/// Where the body comes from.
fn source_facts(file: &ImportedFile, invariants: &Invariants, source: SourceFile) -> Source {
    Source {
        name: file.body.name.clone(),
        files: vec![source],
        number: None,
        // The file does not tell the degrees of freedom of the model.
        n_dofs: 0,
        mass_structure: match invariants.general() {
            Some(_) => MassStructure::General,
            None => MassStructure::RotationInvariant,
        },
        approximation: None,
        settings: serde_json::json!({
            "from": file.format,
            "dialect": file.dialect,
            "frame": BodyFrame::Model.name(),
        }),
    }
}

fn modes(
    file: &ImportedFile,
    invariants: &Invariants,
    shape: Mat<f64>,
    rotation: Option<Mat<f64>>,
    damping: Option<Mat<f64>>,
) -> Modes {
    let eigenvalue = eigenvalues(invariants);
    let damping_ratio = match &damping {
        Some(d) => {
            eigenvalue.iter().enumerate().map(|(j, l)| (0.5 * d[(j, j)] / l.sqrt()).max(0.0)).collect()
        }
        None => vec![0.0; eigenvalue.len()],
    };
    Modes {
        residual: residuals(invariants, &eigenvalue),
        provenance: (1..=eigenvalue.len()).map(|j| format!("mode {j} of a {} file", file.format)).collect(),
        truncation: Vec::new(),
        damping_ratio,
        modal_damping: damping,
        shape,
        rotation,
        internal: None,
        eigenvalue,
    }
}

/// Nothing is proved of modes whose matrices are not there.
fn certificate(file: &ImportedFile, invariants: &Invariants) -> Certificate {
    Certificate {
        proved_modes: None,
        shift: 0.0,
        negative_pivots: None,
        rigid_modes: 6,
        remark: format!(
            "read from a {} file: the FE matrices are not known; residuals are those of the reduced matrices",
            file.format
        ),
        // What digits of K leave of the modes, as far as the file shows it.
        rigid_noise: beside_diagonal(invariants),
        rigid_residual: 0.0,
        eigenvalue_rounding: 0.0,
        inertia_rounding: 0.0,
        guarantee: None,
        fixed_interface: None,
    }
}

/// The body with what the digits of its file leave of the identities of inertia, and a warning where this is
/// more than rounding.
fn with_own_rounding(body: FlexBody) -> Result<(FlexBody, Option<Diagnostic>)> {
    let missed = body.identities(BodyFrame::Model).into_iter().filter(|check| !check.passed);
    let missed = missed.map(|check| check.value).fold(0.0, larger);
    if missed == 0.0 || missed.is_nan() || missed > BROKEN {
        return Ok((body, None));
    }
    let mut parts = body.into_parts();
    parts.certificate.inertia_rounding = missed;
    let message = format!("the inertia data of the file are those of a body to {missed:.1e} of their size");
    Ok((FlexBody::new(parts)?, Some(Diagnostic::new(Code::ForeignRounded, message))))
}

/// 3n x nf of the rows of all frames, zeros where one has none.
fn stacked<'f>(
    frames: &'f [ImportedFrame],
    rows: impl Fn(&'f ImportedFrame) -> Option<&'f Mat<f64>>,
) -> Mat<f64> {
    let nf = frames.first().map_or(0, |frame| frame.translation.ncols());
    Mat::from_fn(3 * frames.len(), nf, |row, j| rows(&frames[row / 3]).map_or(0.0, |rows| rows[(row % 3, j)]))
}

/// The diagonal of K_ff, ascending: rounding may have exchanged what is repeated.
fn eigenvalues(invariants: &Invariants) -> Vec<f64> {
    let mut largest = 0.0f64;
    let mut next = |j: usize| {
        largest = largest.max(invariants.modal_stiffness()[(j, j)]);
        largest
    };
    (0..invariants.n_modes()).map(&mut next).collect()
}

/// |K x - lambda x| of each unit vector x, relative to lambda.
fn residuals(invariants: &Invariants, eigenvalue: &[f64]) -> Vec<f64> {
    let k = invariants.modal_stiffness();
    let beside = |j: usize| (0..eigenvalue.len()).filter(|i| *i != j).map(|i| k[(i, j)].powi(2)).sum::<f64>();
    eigenvalue.iter().enumerate().map(|(j, l)| beside(j).sqrt() / (2.0 * l)).collect()
}

fn not_in_file(group: Group, format: &str) -> TermDecision {
    TermDecision {
        group,
        kept: false,
        tier: 0,
        bound: f64::INFINITY,
        limit: f64::INFINITY,
        reason: format!("not told by the {format} file"),
    }
}

/// Node numbers are the labels where all of them are numbers, each once; else 1, 2, ...
fn nodes(frames: &[ImportedFrame]) -> Nodes {
    let numbers: Option<Vec<i64>> = frames.iter().map(|frame| frame.label.parse().ok()).collect();
    let mut seen = HashSet::new();
    let ids = numbers
        .filter(|ids| ids.iter().all(|id| seen.insert(*id)))
        .unwrap_or_else(|| (1..=frames.len() as i64).collect());
    Nodes { ids, positions: frames.iter().map(|frame| frame.position).collect() }
}

/// Frames that the file calls interfaces: single nodes with their reference point there.
fn interfaces(given: &ImportedBody) -> Vec<Interface> {
    let mut found: Vec<Interface> = Vec::new();
    for (i, frame) in given.frames.iter().enumerate() {
        let Some(name) = &frame.interface else { continue };
        match found.iter_mut().find(|interface| interface.name == *name) {
            // Several nodes of one name: their mean is the reference point.
            Some(interface) => {
                interface.nodes.push(i);
                interface.reference = Some(mean_position(given, &interface.nodes));
            }
            None => found.push(Interface {
                name: name.clone(),
                nodes: vec![i],
                coupling: None,
                reference: Some(frame.position),
            }),
        }
    }
    found
}

fn mean_position(given: &ImportedBody, nodes: &[usize]) -> [f64; 3] {
    let sum = |k: usize| nodes.iter().map(|&i| given.frames[i].position[k]).sum::<f64>();
    [0, 1, 2].map(|k| sum(k) / nodes.len() as f64)
}
