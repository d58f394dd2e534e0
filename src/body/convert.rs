//! The main job: from a checked model to a flexible body, with what lumped masses would have given.

use crate::base::diagnostic::{Code, Diagnostic};
use crate::base::error::Result;
use crate::base::progress::{Event, Watch};
use crate::body::basis::{
    self, BasisChoice, Loads, ModalBasis, ModeSettings, Task, Truncation as Lacking, free_surface_of,
};
use crate::body::flex_body::{
    Certificate, FixedInterface, FlexBody, Group, Groups, Guarantee, Interface, InterfaceCoordinates,
    LumpedBody, MassStructure, Modes, Parts, Source, Storage, TermDecision, Truncation,
};
use crate::body::invariants::{
    BodyFrame, Frame, Invariants, LumpedMasses, LumpedScheme, MassProperties, align, choose_frame,
    choose_general_frame, choose_plane_frame, condense_certified, condense_lumped, condense_lumped_linear,
    error_norms,
};
use crate::model::{Coupling, Damping, FeModel, Nodes, Reference, rigid_count};
use crate::numerics::eigen::{Accuracy, Counters, Plan, Proof, Resume, Wanted, energy_noise};
use crate::numerics::linalg::{SymmetricMatrix, gram, multiply};
use faer::{Mat, MatRef};
use std::collections::HashMap;

mod body_modes;
mod damping;
mod geometric_stiffness;

pub(crate) use damping::modal_damping;
pub(crate) use geometric_stiffness::modal_geometric_stiffness;

pub(crate) use body_modes::{BodyModes, Place, rigid_mass};

/// A lumped comparator that is wanted.
#[derive(Debug, Clone, PartialEq)]
pub enum Lumping {
    /// Row sums of Ms.
    RowSum,
    /// Diagonal of Ms scaled to the total mass.
    DiagonalScaling,
    /// Nodal masses by node number, as a multibody package would import them.
    User(Vec<(i64, f64)>),
}

/// Settings of a conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertSettings {
    /// Which modes and how good.
    pub modes: ModeSettings,
    /// Which basis.
    pub basis: BasisChoice,
    /// Body frame.
    pub frame: BodyFrame,
    /// Comparators.
    pub lumped: Vec<Lumping>,
    /// Also compute the modes of each lumped mass.
    pub lumped_modes: bool,
}

impl Default for ConvertSettings {
    /// 20 modes, principal frame, and the two comparators that need nothing but the matrices.
    fn default() -> Self {
        Self {
            modes: ModeSettings::default(),
            basis: BasisChoice::default(),
            frame: BodyFrame::default(),
            lumped: vec![Lumping::RowSum, Lumping::DiagonalScaling],
            lumped_modes: false,
        }
    }
}

/// The fully lumped pipeline of one scheme: modes from the lumped mass as well.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedPipeline {
    /// Scheme.
    pub scheme: String,
    /// Its eigenvalues, ascending; empty when it has no real modes.
    pub eigenvalues: Vec<f64>,
    /// Smallest singular value of Psi' M Psi_l: the cosine of the largest angle between the two modal subspaces.
    pub subspace_cosine: f64,
    /// Error norms of its invariants after the subspaces were aligned.
    pub comparison: Vec<(String, f64)>,
    /// Why there is no result; empty when there is one.
    pub remark: String,
}

/// Decides about the groups of the kinetic energy of a body; what it does not name is kept.
pub type Decide<'a> = &'a dyn Fn(&FlexBody) -> Result<Vec<TermDecision>>;

/// A finished conversion.
#[derive(Debug, Clone)]
pub struct Conversion {
    /// The product.
    pub body: FlexBody,
    /// Mass properties in model axes.
    pub mass_properties: MassProperties,
    /// Fully lumped pipelines, where asked for.
    pub lumped_modes: Vec<LumpedPipeline>,
    /// Work of the eigen-solver.
    pub counters: Counters,
    /// Columns that the condensation multiplied by M, for the consistent mass.
    pub condensed_columns: u64,
    /// Memory and precision as decided before the work; none on the dense path.
    pub plan: Option<Plan>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

/// Converts a checked model.
///
/// # Errors
/// Those of [`free_surface`](crate::body::basis::free_surface) and [`choose_frame`]; [`LumpedMassTable`](Code::LumpedMassTable) when user masses do not
/// fit the nodes (found before any work).
pub fn convert(model: &FeModel, settings: &ConvertSettings, watch: Watch<'_>) -> Result<Conversion> {
    convert_for(model, settings, None, Resume::default(), watch)
}

/// The same with what `decide` leaves of the kinetic energy, and with a search for modes that starts where an earlier one stood, or that
/// is kept (a checkpoint).
///
/// `decide` is asked when the modes are known, about a body that holds W1 but not W2 and W3. Without these, no product with M is formed but that of
/// rigid motion, and of solids no nf x nf array but K_ff and m_ff; lumped comparators hold the same groups. Accuracy `certified` condenses
/// everything first: its digits are about the whole.
///
/// # Errors
/// As [`convert`], and those of `decide`.
pub fn convert_for(
    model: &FeModel,
    settings: &ConvertSettings,
    decide: Option<Decide<'_>>,
    resume: Resume<'_>,
    watch: Watch<'_>,
) -> Result<Conversion> {
    // Rows that are no displacements have no place in the double-double condensation.
    let plain = model.scalar_mass().is_some() && model.rows().len() == model.rows().displacements();
    if settings.modes.accuracy == Accuracy::Certified && !plain {
        let message = "accuracy certified covers displacements whose mass commutes with rotations";
        return Err(Diagnostic::new(Code::Usage, message).with_help("use --accuracy standard").into());
    }
    let schemes =
        settings.lumped.iter().map(|lumping| lumped_masses(model, lumping)).collect::<Result<Vec<_>>>()?;
    let task = Task { model, settings: &settings.modes, resume, watch };
    let found = settings.basis.basis().modes(&task)?;
    watch(Event::Phase("invariants"));
    let positions = &model.nodes().positions;
    let (frame, mass_properties) = match (model.scalar_mass(), model.dimension()) {
        (Some(mass), 2) => choose_plane_frame(mass, positions, settings.frame)?,
        (Some(mass), _) => choose_frame(mass, positions, settings.frame)?,
        (None, d) => choose_general_frame(|about| rigid_mass(model, &about), positions, d, settings.frame)?,
    };
    let place = Place::new(model, frame);
    let modes = BodyModes::new(model, &place, &found.solution.vectors);
    let nodes = Nodes { ids: model.nodes().ids.clone(), positions: place.positions.clone() };
    let coupled = matches!(settings.basis, BasisChoice::CraigBampton(_) | BasisChoice::CraigChang(_));
    let interfaces = interfaces(model, &frame, coupled);
    let (eigenvalues, modal_stiffness) =
        (&found.solution.eigenvalues, reduced(model.stiffness(), modes.vectors.as_ref()));
    let geometric_stiffness = modal_geometric_stiffness(model, modes.vectors.as_ref(), &frame.axes)?;
    let mut diagnostics = found.diagnostics.clone();
    let coordinates = found.coordinates.as_ref().map(|own| {
        let turned = own.clone().in_axes(&frame.axes, model.dimension(), &modes.signs);
        let basis::InterfaceCoordinates { names, stiffness, mass, of_modes, .. } = turned;
        InterfaceCoordinates { names, stiffness, mass, of_modes }
    });
    let truncation = found.truncation.iter().cloned();
    // A body with these invariants. What is not computed yet is not there.
    let of = |invariants: Invariants| -> Result<(Parts, Option<Diagnostic>)> {
        let damping = modal_damping(model, modes.vectors.as_ref(), eigenvalues, &invariants)?;
        let (damping_ratio, modal_damping, warning) = match damping {
            Some(damping) => (damping.ratio, Some(damping.matrix), damping.warning),
            None => (vec![0.0; eigenvalues.len()], None, None),
        };
        let parts = Parts {
            source: Source {
                name: model.name().to_owned(),
                files: model.sources().iter().chain(settings.basis.sources()).cloned().collect(),
                number: model.number(),
                n_dofs: model.stiffness().n(),
                mass_structure: match model.scalar_mass() {
                    None => MassStructure::General,
                    Some(_) if model.has_diagonal_mass() => MassStructure::Diagonal,
                    Some(_) => MassStructure::RotationInvariant,
                },
                settings: describe(settings, model),
            },
            dimension: model.dimension(),
            units: model.units().clone(),
            frame,
            interfaces: interfaces.clone(),
            coordinates: coordinates.clone(),
            nodes: nodes.clone(),
            modes: Modes {
                damping_ratio,
                modal_damping,
                eigenvalue: eigenvalues.clone(),
                residual: found.solution.residuals.clone(),
                provenance: found.provenance.clone(),
                truncation: truncation
                    .clone()
                    .map(|Lacking { load, before, after }| Truncation { load, before, after })
                    .collect(),
                shape: modes.of_nodes().to_owned(),
                rotation: modes.rotations.clone(),
                internal: modes.internal.clone(),
            },
            invariants,
            geometric_stiffness: geometric_stiffness.clone(),
            lumped: Vec::new(),
            certificate: certificate(model, &found, None),
            terms: Vec::new(),
            storage: Storage::default(),
        };
        Ok((parts, warning))
    };

    // Nothing but products of M with rigid motion is formed for a decision.
    let linear = decide.map(|_| modes.condensed_linear(model, &place, modal_stiffness.clone()));
    let mut condensed_columns = decide.map_or(0, |_| modes.condensed_columns(model, true));
    let terms = match (decide, &linear) {
        (Some(decide), Some(linear)) => {
            let (mut parts, _) = of(linear.clone())?;
            parts.terms = linear.groups.dropped().map(not_computed).collect();
            decide(&FlexBody::new(parts)?)?
        }
        _ => Vec::new(),
    };
    let dropped = terms.iter().filter(|term| !term.kept);
    let groups = dropped.fold(Groups::ALL, |groups, term| groups.and(Groups::without(term.group)));
    let (invariants, guarantee) = match (&found.solution.bounds, model.scalar_mass(), linear) {
        (Some(bounds), Some(mass), _) => {
            condensed_columns += modes.condensed_columns(model, false);
            let shapes = modes.displacements.as_ref();
            let own = condense_certified(mass, &place.positions, shapes, model.stiffness(), &frame.axes);
            let guarantee = Guarantee {
                shift_below: bounds.shift_below,
                pivots_below: bounds.pivots_below,
                eigenvalue_lower: bounds.lower.clone(),
                eigenvalue_upper: bounds.upper.clone(),
                shape_error: bounds.shape_error.clone(),
                digits: own.digits,
            };
            (own.invariants, Some(guarantee))
        }
        (_, _, Some(linear)) if !groups.w2 && !groups.w3 => (linear, None),
        _ => {
            condensed_columns += modes.condensed_columns(model, false);
            (modes.condensed(model, &place, modal_stiffness), None)
        }
    };
    let invariants = invariants.with_groups(groups);
    watch(Event::Phase("lumped comparison"));
    let lumped: Vec<LumpedBody> = schemes
        .iter()
        .map(|masses| {
            let modal_stiffness = invariants.modal_stiffness.clone();
            let other = lumped_invariants(model, &place, masses, modes.of_nodes(), modal_stiffness, groups);
            LumpedBody {
                scheme: masses.scheme().name().to_owned(),
                comparison: error_norms(&invariants, &other),
                invariants: other,
                negative_masses: masses.negative(),
            }
        })
        .collect();
    let lumped_modes = if settings.lumped_modes {
        let exact = Exact { model, place: &place, modes: &modes, invariants: &invariants };
        schemes
            .iter()
            .map(|masses| lumped_pipeline(&exact, masses, settings, watch))
            .collect::<Result<_>>()?
    } else {
        Vec::new()
    };
    let softening = geometric_stiffness::softening_warning(model, &settings.basis, &invariants);
    let (parts, warning) = of(invariants)?;
    let fits = interfaces.iter().filter_map(|i| poor_fit(i, &nodes, &modes, model.dimension()));
    diagnostics.extend(warning.into_iter().chain(softening).chain(fits));
    let body =
        FlexBody::new(Parts { lumped, certificate: certificate(model, &found, guarantee), terms, ..parts })?;
    diagnostics.extend(free_frequencies(&body));
    let solution = found.solution;
    Ok(Conversion {
        body,
        mass_properties,
        lumped_modes,
        counters: solution.counters,
        condensed_columns,
        plan: solution.plan,
        diagnostics,
    })
}

/// The decision about a group before there is one.
fn not_computed(group: Group) -> TermDecision {
    TermDecision {
        group,
        kept: false,
        tier: 0,
        bound: 0.0,
        limit: 0.0,
        reason: "not computed yet".to_owned(),
    }
}

/// Psi' A Psi, where the matrix A and the modes are in model axes.
fn reduced(a: &SymmetricMatrix, vectors: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = Mat::zeros(vectors.nrows(), vectors.ncols());
    multiply(a, 1, vectors, product.as_mut());
    let k = gram(vectors, product.as_ref());
    Mat::from_fn(k.nrows(), k.ncols(), |i, j| 0.5 * (k[(i, j)] + k[(j, i)]))
}

/// Whether nothing but the rotation about z is known of a body: lumped masses are compared in this alone then.
fn only_about_z(model: &FeModel) -> bool {
    model.dimension() == 2 && model.scalar_mass().is_none()
}

/// What lumped masses make of the groups that the body holds.
fn lumped_invariants(
    model: &FeModel,
    place: &Place,
    masses: &LumpedMasses,
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
    groups: Groups,
) -> Invariants {
    let condense = if groups.w2 || groups.w3 { condense_lumped } else { condense_lumped_linear };
    let own = condense(masses, &place.positions, shapes, modal_stiffness);
    if only_about_z(model) { own.about_z() } else { own }.with_groups(groups)
}

fn lumped_masses(model: &FeModel, lumping: &Lumping) -> Result<LumpedMasses> {
    match lumping {
        Lumping::RowSum => Ok(LumpedMasses::row_sum(&model.nodal_mass())),
        Lumping::DiagonalScaling => LumpedMasses::diagonal_scaling(&model.nodal_mass()),
        Lumping::User(table) => {
            let ids = &model.nodes().ids;
            let by_node: HashMap<i64, f64> = table.iter().copied().collect();
            let refuse = |message: String| Diagnostic::new(Code::LumpedMassTable, message).into();
            if by_node.len() < table.len() {
                return Err(refuse(format!(
                    "{} nodes are given more than once",
                    table.len() - by_node.len()
                )));
            }
            let missing: Vec<i64> = ids.iter().filter(|id| !by_node.contains_key(id)).copied().collect();
            if let Some(first) = missing.first() {
                return Err(refuse(format!("{} nodes have no mass, node {first} first", missing.len())));
            }
            LumpedMasses::user(ids.iter().map(|id| by_node[id]).collect(), ids.len())
        }
    }
}

/// The exact result that a lumped pipeline is compared with.
struct Exact<'a> {
    model: &'a FeModel,
    place: &'a Place,
    modes: &'a BodyModes,
    invariants: &'a Invariants,
}

/// Modes and invariants from the lumped mass, aligned with the exact subspace before they are compared.
fn lumped_pipeline(
    exact: &Exact<'_>,
    masses: &LumpedMasses,
    settings: &ConvertSettings,
    watch: Watch<'_>,
) -> Result<LumpedPipeline> {
    let scheme = masses.scheme().name().to_owned();
    let none = |remark: String| LumpedPipeline {
        scheme: scheme.clone(),
        eigenvalues: Vec::new(),
        subspace_cosine: f64::NAN,
        comparison: Vec::new(),
        remark,
    };
    if masses.negative() > 0 {
        return Ok(none(format!("{} nodal masses are negative: no real modes", masses.negative())));
    }
    let nf = exact.modes.vectors.ncols();
    // A comparison needs no guarantees.
    let accuracy = match settings.modes.accuracy {
        Accuracy::Certified => Accuracy::Standard,
        other => other,
    };
    let modes = ModeSettings { wanted: Wanted::Lowest(nf), accuracy, ..settings.modes };
    let found = match free_surface_of(exact.model, masses.masses(), &modes, watch) {
        Ok(found) => found.solution,
        Err(error) => return Ok(none(error.diagnostics()[0].message().to_owned())),
    };
    if found.eigenvalues.len() < nf {
        return Ok(none(format!("the lumped mass has {} modes only", found.eigenvalues.len())));
    }
    let modes = BodyModes::new(exact.model, exact.place, &found.vectors);
    let cross =
        gram(exact.modes.vectors.as_ref(), exact.model.pencil().apply_mass(modes.vectors.as_ref()).as_ref());
    let alignment = align(cross.as_ref(), std::slice::from_ref(&(0..nf)));
    let shapes = modes.of_nodes();
    let stiffness = reduced(exact.model.stiffness(), modes.vectors.as_ref());
    let groups = exact.invariants.groups;
    let own = lumped_invariants(exact.model, exact.place, masses, shapes, stiffness, groups);
    Ok(LumpedPipeline {
        scheme,
        eigenvalues: found.eigenvalues,
        subspace_cosine: alignment.agreement,
        comparison: error_norms(exact.invariants, &own.with_basis(alignment.basis.as_ref())),
        remark: String::new(),
    })
}

fn certificate(model: &FeModel, found: &ModalBasis, guarantee: Option<Guarantee>) -> Certificate {
    let completeness = &found.solution.completeness;
    let proved = completeness.proof == Proof::InertiaCount;
    Certificate {
        proved_modes: proved.then_some(completeness.modes_below),
        shift: completeness.shift,
        negative_pivots: completeness.negative_pivots,
        rigid_modes: rigid_count(model.dimension()),
        remark: completeness.remark.clone(),
        rigid_noise: found.rigid_noise,
        rigid_residual: model.rigid_residual(),
        eigenvalue_rounding: eigenvalue_rounding(model, found),
        inertia_rounding: 0.0,
        guarantee,
        fixed_interface: found.fixed_interface.clone().map(fixed_interface),
    }
}

/// What rounding of the products with K may leave in Psi' K Psi, relative to sqrt(lambda_p lambda_q).
///
/// Errors of the size of a roundoff in the entries of K change psi_p' K psi_q by sum_ij dK_ij psi_ip psi_jq, whose standard deviation the
/// Cauchy-Schwarz inequality bounds by the root of those of psi_p' K psi_p and psi_q' K psi_q: the matrix of the squares K_ij^2 is positive
/// semidefinite like K. The largest of these relative to its eigenvalue bounds every entry.
fn eigenvalue_rounding(model: &FeModel, found: &ModalBasis) -> f64 {
    let solution = &found.solution;
    let noise = energy_noise(model.stiffness(), solution.vectors.as_ref(), f64::EPSILON);
    let relative = noise.iter().zip(&solution.eigenvalues).map(|(noise, lambda)| noise / lambda);
    ROUNDINGS * relative.fold(0.0, f64::max)
}

/// The same of the body; written out, so that neither room need know the other.
fn fixed_interface(found: basis::FixedInterface) -> FixedInterface {
    let basis::FixedInterface {
        modes,
        interface_motions,
        counted,
        shift,
        next,
        residual,
        free_estimate,
        free_lower,
    } = found;
    FixedInterface { modes, interface_motions, counted, shift, next, residual, free_estimate, free_lower }
}

/// Part by which a frequency may be too high before the user is told.
const TOO_HIGH: f64 = 0.01;

/// A note about the frequencies of the free body that a Craig-Bampton body does not hold.
fn free_frequencies(body: &FlexBody) -> Option<Diagnostic> {
    let fixed = body.certificate().fixed_interface.as_ref()?;
    let (theta, hertz) = (&body.modes().eigenvalue, body.frequencies_hz());
    let holding = fixed.holding(theta, TOO_HIGH);
    let first = *theta.get(holding)?;
    let kept = if body.has_rigid_interfaces() { " with the same rigid interfaces" } else { "" };
    let holds = match holding {
        0 => format!("none is within 1 % of that of the free body{kept}"),
        count => format!(
            "the lowest {count} (up to {:.6} Hz) are within 1 % of those of the free body{kept}",
            hertz[count - 1]
        ),
    };
    let percent = |part: f64| format!("{:.2} %", 100.0 * part);
    let most = fixed.largest_excess(holding, first).map(|most| format!(", {} at most", percent(most)));
    let message = format!(
        "of the {} frequencies of the Craig-Bampton body {holds}; that of mode {}, {:.6} Hz, is too high by {}{}",
        theta.len(),
        holding + 1,
        hertz[holding],
        percent(fixed.excess(holding, first)),
        most.unwrap_or_default(),
    );
    Some(Diagnostic::new(Code::FreeFrequencies, message))
}

/// The interfaces of a model in the body frame; of a `coupled` basis with the coupling that it took where none was stated.
fn interfaces(model: &FeModel, frame: &Frame, coupled: bool) -> Vec<Interface> {
    let index: HashMap<i64, usize> = model.nodes().ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    model
        .interfaces()
        .iter()
        .map(|set| {
            let nodes: Vec<usize> = set.nodes.iter().filter_map(|id| index.get(id)).copied().collect();
            let reference = match set.reference {
                Reference::Point(x) => Some(x),
                _ => None,
            };
            Interface {
                name: set.name.clone(),
                nodes,
                coupling: if coupled { Some(set.coupling()) } else { set.coupling },
                reference: reference.map(|x| frame.to_body(&[x])[0]),
            }
        })
        .collect()
}

/// How many standard deviations of its rounding an entry of Psi' K Psi may be off: none of many is.
const ROUNDINGS: f64 = 10.0;

/// Part of the motion of an interface that is rounding.
const RIGID_FIT: f64 = 1e-8;

/// A warning about an interface that was declared rigid, but is not in these modes.
fn poor_fit(interface: &Interface, nodes: &Nodes, modes: &BodyModes, dimension: usize) -> Option<Diagnostic> {
    if interface.coupling != Some(Coupling::Rigid) {
        return None;
    }
    let rotations = modes.rotations.as_ref().map(Mat::as_ref);
    let rows = interface.rows(nodes, modes.of_nodes(), rotations, dimension)?;
    let (mode, part) = rows.deformation();
    (part > RIGID_FIT).then(|| {
        let message = format!(
            "interface `{}` was declared rigid, but deforms by {:.2} % of its largest motion in mode {}: its rows are its mean rigid motion",
            interface.name,
            100.0 * part,
            mode + 1
        );
        Diagnostic::new(Code::InterfaceFit, message)
    })
}

/// The settings that can change the result, for the file.
fn describe(settings: &ConvertSettings, model: &FeModel) -> serde_json::Value {
    let (modes, below) = match settings.modes.wanted {
        Wanted::Lowest(count) => ((count < usize::MAX).then_some(count), None),
        Wanted::Below(lambda) => (None, Some(lambda)),
    };
    let schemes: Vec<&str> = settings
        .lumped
        .iter()
        .map(|lumping| match lumping {
            Lumping::RowSum => LumpedScheme::RowSum.name(),
            Lumping::DiagonalScaling => LumpedScheme::DiagonalScaling.name(),
            Lumping::User(_) => LumpedScheme::User.name(),
        })
        .collect();
    let loads: Vec<&str> = settings.basis.residual_vectors().iter().map(Loads::name).collect();
    let mut described = serde_json::json!({
        "accuracy": settings.modes.accuracy.name(),
        "basis": settings.basis.basis().name(),
        "frame": settings.frame.name(),
        "lumped": schemes,
        "max_eigenvalue": below,
        "modes": modes,
        "residual_vectors": loads,
    });
    if let Some(damping) = model.damping() {
        let numbers = match damping {
            Damping::Ratio(ratio) => serde_json::json!(ratio),
            Damping::Bands(bands) => {
                let end = |hertz: f64| hertz.is_finite().then_some(hertz);
                bands.iter().map(|b| serde_json::json!({ "to_hz": end(b.to_hz), "ratio": b.ratio })).collect()
            }
            Damping::Rayleigh { alpha, beta } => serde_json::json!({ "alpha": alpha, "beta": beta }),
            Damping::Matrix(_) => serde_json::Value::Null,
        };
        described["damping"] = serde_json::json!({ damping.name(): numbers });
    }
    described
}
