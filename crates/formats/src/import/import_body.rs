//! Conversion of the file of another program into a flexible body.

use super::{ImportedBody, ImportedFile, ImportedFrame};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_base::provenance::SourceFile;
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    Certificate, FlexBody, Frame, GeometricStiffness, Interface, MAX_TURNING_PART, MassStructure,
    ModalChange, Modes, Parts, ReferenceConditions, Source, Storage, TermDecision, TermGroup,
    diagonal_eigenvalues, diagonal_ratios, reduced_residuals, rigid_motions,
};
use flexbody_body::invariants::{
    BodyFrame, Expected, FrameChoice, IdentityCheck, Invariants, Numbered, Turning, identities,
    symmetric_part,
};
use flexbody_body::verification::body_identities;
use flexbody_linalg::larger;
use flexbody_model::{Description, Nodes};
use nalgebra::Matrix3;
use std::collections::HashSet;

/// Largest violation of the inertia identities with which a body can still be computed, relative to their
/// terms. The rounding of files with few digits is far below.
const BROKEN: f64 = 1e-2;

/// Body made from a file, with the diagnostics of the conversion.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The body, in the frame of the file.
    pub body: FlexBody,
    /// Notes and warnings on changed and missing properties.
    pub diagnostics: Vec<Diagnostic>,
}

/// Makes a body of `file`, which was read from `source`; `units` apply if the file states none.
///
/// Without a `frame` the body keeps the frame of the file, tied to the body by the modes of the file, so that
/// a model that holds the frame remains valid. In mean axes the rigid motion is removed from the modes. A
/// frame may be placed at an interface, or at a node with rotations, by its name.
///
/// Modes that are mass-normalised with a diagonal stiffness to 1e-9 are kept bit by bit if the frame is kept
/// or if they contain no rigid motion. Other modes are normalised by the small eigenproblem, with the
/// products held by the invariants (theory 5.2); the body is the same in other coordinates. Rigid motions
/// among the modes are removed.
///
/// # Errors
/// [`ForeignUnsound`](Code::ForeignUnsound) for defects found by the reader;
/// [`ForeignIncomplete`](Code::ForeignIncomplete) if no place of the body is known, the modes are linearly
/// dependent, or the stiffness is not positive; the errors of [`FlexBody::new`],
/// [`FlexBody::in_mean_axes_at`] and [`FlexBody::on_interface`].
pub fn import_body(
    file: &ImportedFile,
    source: SourceFile,
    units: UnitSystem,
    frame: Option<&FrameChoice>,
) -> Result<Imported> {
    refuse_unsound(file)?;
    let given = &file.body;
    let omitted = |omission: &String| Diagnostic::new(Code::ForeignDropped, omission.clone());
    let mut diagnostics: Vec<Diagnostic> = given.omissions.iter().map(omitted).collect();
    // Mass-normalise the modes and remove rigid motions, unless the modes are kept.
    let mut coordinates = ModalCoordinates::new(given)?;
    if let Some((change, note)) = normalising(&coordinates.invariants)? {
        diagnostics.push(note);
        coordinates = coordinates.changed(&change, &given.frames);
    }
    // Free-surface modes imply mean axes; other modes do not state their reference conditions.
    let conditions = match beside_free_surface(&coordinates.invariants) {
        None => ReferenceConditions::MeanAxes,
        Some(_) => ReferenceConditions::Unstated,
    };
    let body = FlexBody::new(parts(file, coordinates, conditions, source, units))?;
    let (body, warning) = with_own_rounding(body)?;
    diagnostics.extend(warning);
    // Move the body to the requested frame.
    let body = match frame {
        None => body,
        Some(FrameChoice::Mean(at)) => body.in_mean_axes_at(*at)?,
        Some(FrameChoice::Interface(name)) => with_interface(body, name)?.on_interface(name)?,
    };
    Ok(Imported { body, diagnostics })
}

/// Returns the change to normalised modes in the frame of the file, with a note; `None` if the modes are
/// kept.
fn normalising(invariants: &Invariants) -> Result<Option<(ModalChange, Diagnostic)>> {
    let refuse = |reason: String| {
        let help = "run flexbody audit on the file, correct what it finds, and write the file again";
        Diagnostic::new(Code::ForeignIncomplete, reason).with_help(help)
    };
    let beside = beside_normalised(invariants);
    let rigid = rigid_motions(invariants).map_err(refuse)?;
    if beside.is_none() && rigid.count == 0 {
        return Ok(None);
    }
    let change = ModalChange::in_present_frame(invariants, 3).map_err(refuse)?;
    let message = match (change.left_out().in_words(), beside) {
        (Some(rigid), _) => format!("{rigid}: these modes were removed and the others normalised"),
        (None, by) => format!(
            "the modes of the file are not mass-normalised with a diagonal stiffness (relative difference {:.1e}): they were replaced by linear combinations that are",
            by.unwrap_or(0.0)
        ),
    };
    Ok(Some((change, Diagnostic::new(Code::ForeignChanged, message))))
}

/// Returns the body with an interface `name`: an existing interface, or the node of this number made an
/// interface.
fn with_interface(body: FlexBody, name: &str) -> Result<FlexBody> {
    let known = body.interfaces().iter().any(|interface| interface.name == name);
    let node = name.parse().ok().and_then(|id: i64| body.nodes().ids.iter().position(|own| *own == id));
    let Some(node) = node.filter(|_| !known) else { return Ok(body) };
    let mut parts = body.into_parts();
    let reference = Some(parts.nodes.positions[node]);
    let interface = Interface { name: name.to_owned(), nodes: vec![node], coupling: None, reference };
    parts.interfaces.push(interface);
    FlexBody::new(parts)
}

/// Returns an error for defects found by the reader, and for a file without frames.
fn refuse_unsound(file: &ImportedFile) -> Result<()> {
    if !file.unsound.is_empty() {
        let refused = |why: &String| Diagnostic::new(Code::ForeignUnsound, why.clone());
        return Err(Error::new(file.unsound.iter().map(refused).collect()));
    }
    if file.body.frames.is_empty() {
        let message = "the file has no node: positions and mode shapes are missing";
        return Err(Diagnostic::new(Code::ForeignIncomplete, message).into());
    }
    Ok(())
}

/// Parts of a body that depend on its modal coordinates.
struct ModalCoordinates {
    invariants: Invariants,
    /// Displacements of the frames (3n x nf).
    shape: Mat<f64>,
    rotation: Option<Mat<f64>>,
    damping: Option<Mat<f64>>,
    geometric_stiffness: Vec<GeometricStiffness<Mat<f64>>>,
}

impl ModalCoordinates {
    /// Takes the parts from the file and enforces the symmetries that hold for every body.
    fn new(given: &ImportedBody) -> Result<Self> {
        let turns = given.frames.iter().any(|frame| frame.rotation.is_some());
        let invariants = with_turning_nodes(given, sound_invariants(given)?);
        let mut geometric_stiffness = given.geometric_stiffness.clone();
        for stiffness in &mut geometric_stiffness {
            stiffness.matrix = symmetric_part(&stiffness.matrix);
        }
        Ok(Self {
            invariants,
            shape: stacked(&given.frames, |frame| Some(&frame.translation)),
            rotation: turns.then(|| stacked(&given.frames, |frame| frame.rotation.as_ref())),
            damping: given.modal_damping.as_ref().map(symmetric_part),
            geometric_stiffness,
        })
    }

    /// Returns the parts in other modal coordinates.
    fn changed(self, change: &ModalChange, frames: &[ImportedFrame]) -> Self {
        let positions: Vec<[f64; 3]> = frames.iter().map(|frame| frame.position).collect();
        Self {
            invariants: change.invariants(&self.invariants),
            shape: change.shapes(&self.shape, &positions),
            rotation: self.rotation.map(|rotation| change.rotations(&rotation, &self.shape)),
            damping: self.damping.map(|damping| change.congruent(&damping)),
            geometric_stiffness: self
                .geometric_stiffness
                .into_iter()
                .map(|stiffness| GeometricStiffness {
                    matrix: change.congruent(&stiffness.matrix),
                    load: stiffness.load,
                })
                .collect(),
        }
    }
}

/// Returns the largest violation of an identity of points of mass by a body with node rotations, if nodes whose rotations
/// carry mass [explain](MAX_TURNING_PART) it. Beams and shells have such nodes, and formats that derive all inertia from one
/// set of integrals have no place for their second moments.
pub(crate) fn turning_part(given: &ImportedBody, invariants: &Invariants) -> Option<f64> {
    let turns = given.frames.iter().any(|frame| frame.rotation.is_some());
    if !turns || invariants.general().is_some() {
        return None;
    }
    let broken = identities(invariants, &ANY_BODY)
        .into_iter()
        .filter(|check| is_of_points(check.name) && !check.passed)
        .map(|check| check.value)
        .fold(0.0, larger);
    (broken > DIGITS && broken <= MAX_TURNING_PART).then_some(broken)
}

/// Returns true for identities of products of modes that hold for points of mass, not for nodes that turn.
pub(crate) fn is_of_points(name: &str) -> bool {
    matches!(name, "s_psd" | "s_bounded" | "ibar_bounded" | "w3_bounded" | "scalar_gram_psd")
}

/// Returns the invariants as those of a mass that does not commute with rotations, if the file has [nodes that
/// turn](turning_part).
fn with_turning_nodes(given: &ImportedBody, invariants: Invariants) -> Invariants {
    match turning_part(given, &invariants) {
        Some(_) => {
            let modal_mass = invariants.modal_mass();
            invariants.with_modal_mass(modal_mass)
        }
        None => invariants,
    }
}

/// Returns the invariants of the file, after checking the identities that hold for every body.
fn sound_invariants(given: &ImportedBody) -> Result<Invariants> {
    let stiffness = symmetric_part(&given.modal_stiffness);
    let invariants = Invariants::from_numbered(&given.inertia, stiffness, DIGITS).with_symmetries();
    if let Some(broken) = identities(&invariants, &ANY_BODY).into_iter().find(|check| {
        matches!(check.name, "finite" | "mass_positive" | "second_moment_psd" | "inertia_psd")
            && check.value > BROKEN
    }) {
        let message = format!("no body has this inertia: {} does not hold", broken.formula);
        return Err(Diagnostic::new(Code::ForeignIncomplete, message).into());
    }
    if axes_without_inertia(&given.inertia) != 0.0 {
        return Err(Diagnostic::new(Code::ForeignIncomplete, NO_INERTIA).into());
    }
    Ok(invariants)
}

/// Assembles the parts of the body in its final coordinates.
fn parts(
    file: &ImportedFile,
    coordinates: ModalCoordinates,
    conditions: ReferenceConditions,
    source: SourceFile,
    units: UnitSystem,
) -> Parts {
    let given = &file.body;
    let invariants = &coordinates.invariants;
    Parts {
        description: Description::new(&file.body.name, given.units.clone().unwrap_or(units)),
        source: source_facts(file, invariants, source),
        dimension: 3,
        frame: Frame::model(),
        conditions,
        nodes: nodes(&given.frames),
        mesh: given.mesh.clone(),
        lumped: Vec::new(),
        certificate: certificate(file, invariants),
        interfaces: interfaces(given),
        coordinates: None,
        recoveries: Vec::new(),
        named_loads: Vec::new(),
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
        rotated_stiffness: Vec::new(),
        estimated_stiffness: Vec::new(),
        inertia_stiffness: None,
    }
}

/// Returns the provenance of the body.
fn source_facts(file: &ImportedFile, invariants: &Invariants, source: SourceFile) -> Source {
    Source {
        files: vec![source],
        // The file does not state the degrees of freedom of the model.
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
    let eigenvalue = diagonal_eigenvalues(invariants);
    let damping_ratio = match &damping {
        Some(damping) => diagonal_ratios(damping, &eigenvalue),
        None => vec![0.0; eigenvalue.len()],
    };
    Modes {
        residual: reduced_residuals(invariants, &eigenvalue),
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

/// Returns a certificate without proof: the system matrices of the modes are not available.
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
        // Rounding of K_ff in the file, estimated from its entries off the diagonal.
        rigid_noise: beside_diagonal(invariants),
        rigid_residual: 0.0,
        eigenvalue_rounding: 0.0,
        inertia_rounding: 0.0,
        guarantee: None,
        fixed_interface: None,
    }
}

/// Returns the body with the violation of the inertia identities recorded as rounding of its file, and a
/// warning if the violation exceeds double precision.
fn with_own_rounding(body: FlexBody) -> Result<(FlexBody, Option<Diagnostic>)> {
    let missed = body.identities(BodyFrame::Model).into_iter().filter(|check| !check.passed);
    let missed = missed.map(|check| check.value).fold(0.0, larger);
    if missed == 0.0 || missed.is_nan() || missed > BROKEN {
        return Ok((body, None));
    }
    let mut parts = body.into_parts();
    parts.certificate.inertia_rounding = missed;
    let message =
        format!("the inertia data of the file agree with each other only to {missed:.1e} of their size");
    Ok((FlexBody::new(parts)?, Some(Diagnostic::new(Code::ForeignRounded, message))))
}

/// Stacks the rows of all frames (3n x nf), with zeros for frames without rows.
fn stacked<'f>(
    frames: &'f [ImportedFrame],
    rows: impl Fn(&'f ImportedFrame) -> Option<&'f Mat<f64>>,
) -> Mat<f64> {
    let nf = frames.first().map_or(0, |frame| frame.translation.ncols());
    Mat::from_fn(3 * frames.len(), nf, |row, j| rows(&frames[row / 3]).map_or(0.0, |rows| rows[(row % 3, j)]))
}

fn not_in_file(group: TermGroup, format: &str) -> TermDecision {
    TermDecision {
        group,
        kept: false,
        tier: 0,
        bound: f64::INFINITY,
        limit: f64::INFINITY,
        reason: format!("missing in the {format} file"),
    }
}

/// Returns the nodes with their labels as numbers. Labels that are names get numbers above all others, in
/// their order, like reference points that are no nodes. Nodes are numbered 1, 2, ... if no label is a number
/// or two numbers coincide.
fn nodes(frames: &[ImportedFrame]) -> Nodes {
    let numbers: Vec<Option<i64>> = frames.iter().map(|frame| frame.label.parse().ok()).collect();
    let mut seen = HashSet::new();
    let distinct = numbers.iter().flatten().all(|number| seen.insert(*number));
    let highest = numbers.iter().flatten().max().copied();
    let numbered = highest.filter(|_| distinct).and_then(|highest| {
        let mut above = highest;
        let mut next = || {
            above = above.checked_add(1)?;
            Some(above)
        };
        numbers.iter().map(|number| number.map_or_else(&mut next, Some)).collect::<Option<Vec<i64>>>()
    });
    let ids = numbered.unwrap_or_else(|| (1..=frames.len() as i64).collect());
    Nodes { ids, positions: frames.iter().map(|frame| frame.position).collect() }
}

/// Returns the frames that the file calls interfaces, as single nodes with their reference points there.
fn interfaces(given: &ImportedBody) -> Vec<Interface> {
    let mut found: Vec<Interface> = Vec::new();
    for (i, frame) in given.frames.iter().enumerate() {
        let Some(name) = &frame.interface else { continue };
        match found.iter_mut().find(|interface| interface.name == *name) {
            // For several nodes with one interface name the reference point is their mean position.
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

// Tests of the modes of a file: mass-normalised with a diagonal stiffness, free of rigid motion.

/// Largest entry of K_ff off its diagonal for which it counts as diagonal, above the rounding of FE matrices.
/// Eigenvalues then differ from the diagonal by the square of this value, relative.
const NEARLY_DIAGONAL: f64 = 1e-5;

/// Returns the distance of the modes from mass-normalised free-surface modes, the largest violation of their
/// identities; `None` if they are such modes.
pub(crate) fn beside_free_surface(invariants: &Invariants) -> Option<f64> {
    beside(invariants, &["modal_mass_identity", "c1_zero", "c2_zero"])
}

/// Returns the distance of the modes from mass-normalised modes with a diagonal stiffness, for any reference
/// conditions; `None` if they are such modes.
fn beside_normalised(invariants: &Invariants) -> Option<f64> {
    beside(invariants, &["modal_mass_identity"])
}

/// Returns the largest value of the failed identities `about_modes`; `None` if all hold and K_ff is diagonal,
/// positive and ascending.
fn beside(invariants: &Invariants, about_modes: &[&str]) -> Option<f64> {
    let missed = of_modes(invariants)
        .into_iter()
        .filter(|check| about_modes.contains(&check.name) && !check.passed)
        .map(|check| check.value)
        .fold(0.0, larger);
    let beside = beside_diagonal(invariants);
    let k = invariants.modal_stiffness();
    let nearly = |j: usize| k[(j - 1, j - 1)] - k[(j, j)] <= DIGITS * k[(j, j)];
    let ascending = k[(0, 0)] > 0.0 && (1..k.ncols()).all(nearly);
    let diagonal = beside <= NEARLY_DIAGONAL;
    let missed = if diagonal { missed } else { missed.max(beside) };
    // A NaN is not zero and counts as a failure.
    (missed != 0.0 || !diagonal || !ascending).then_some(missed)
}

/// Returns the largest entry of K_ff off its diagonal, relative to the diagonal entries of its row and
/// column.
fn beside_diagonal(invariants: &Invariants) -> f64 {
    let diagonal = of_modes(invariants).into_iter().find(|check| check.name == "modal_stiffness_diagonal");
    diagonal.map_or(f64::NAN, |check| check.value)
}

/// Returns the identities of mass-normalised free-surface modes with the frequencies from the diagonal of
/// K_ff.
fn of_modes(invariants: &Invariants) -> Vec<IdentityCheck> {
    let eigenvalues: Vec<f64> =
        (0..invariants.n_modes()).map(|j| invariants.modal_stiffness()[(j, j)]).collect();
    let expected =
        Expected { mass_normalised: true, free_surface: true, eigenvalues: Some(&eigenvalues), ..ANY_BODY };
    identities(invariants, &expected)
}

// Requirements on every body, for any modes.

/// Expectations for identities that hold for any modes.
pub(crate) const ANY_BODY: Expected<'static> = Expected {
    mass_normalised: false,
    free_surface: false,
    frame: BodyFrame::Model,
    origin: nalgebra::Vector3::new(0.0, 0.0, 0.0),
    eigenvalues: None,
    eigenvalue_noise: 0.0,
    eigenvalue_rounding: 0.0,
    turning: Turning::None,
};

/// Rounding in files with 10 digits and more, relative to Cauchy-Schwarz bounds. Redundant numbers may differ
/// by this much.
pub(crate) const DIGITS: f64 = 1e-9;

/// Meaning of a principal moment of zero.
pub(crate) const NO_INERTIA: &str = "rotation about an axis through the centre of mass has no inertia: all masses lie on a line, or the inertia of the nodes is missing";

/// Returns the number of principal moments about the centre of mass that are zero up to rounding; NaN if they
/// cannot be computed.
pub(crate) fn axes_without_inertia(inertia: &Numbered) -> f64 {
    const ZERO_MOMENT: f64 = 1e-12;
    let centre = inertia.i2 / inertia.i1;
    let steiner = (Matrix3::identity() * centre.norm_squared() - centre * centre.transpose()) * inertia.i1;
    let about_centre = inertia.i7 - steiner;
    if about_centre.iter().any(|entry| !entry.is_finite()) {
        return f64::NAN;
    }
    // The scale of rounding is that of the moments about the origin.
    let size = inertia.i7.amax();
    let moments = (0.5 * (about_centre + about_centre.transpose())).symmetric_eigenvalues();
    moments.iter().filter(|moment| moment.abs() <= ZERO_MOMENT * size).count() as f64
}

/// Returns an error for an imported body that violates an identity of theory section 10: its file contradicts
/// itself.
///
/// # Errors
/// [`ForeignUnsound`](Code::ForeignUnsound), one diagnostic for every violated identity.
pub fn accept_imported(imported: &Imported) -> Result<()> {
    let broken = body_identities(&imported.body).into_iter().filter(|check| !check.passed);
    let diagnostics: Vec<Diagnostic> = broken
        .map(|check| {
            let message = format!(
                "the numbers of the file violate the identity `{}` ({}): {:.1e}, and at most {:.1e} is rounding",
                check.name, check.formula, check.value, check.limit
            );
            Diagnostic::new(Code::ForeignUnsound, message)
        })
        .collect();
    if diagnostics.is_empty() { Ok(()) } else { Err(Error::new(diagnostics)) }
}
