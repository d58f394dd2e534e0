//! Last stage of a conversion: the body, the lumped comparators, and diagnostics.

use super::modal_matrices::softening_warning;
use super::node_inertia::unusual_node_inertia;
use super::recovery::Recovered;
use super::{Condensation, ConvertSettings, LumpedPipeline, ModalModel, lumped, modal_damping};
use crate::flex_body::{
    Certificate, FlexBody, Guarantee, Interface, InterfaceCoordinates, LumpedBody, MassStructure, Modes,
    Parts, ReferenceConditions, Source, Storage,
};
use crate::invariants::{FrameChoice, Invariants, MassProperties};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_base::numbers::significant;
use flexbody_eigen::{Plan, Proof, energy_noise};
use flexbody_linalg::context::{Context, Work};
use flexbody_linalg::ties::first_largest;
use flexbody_model::{Coupling, FeModel, rigid_count};

/// A finished conversion.
#[derive(Debug, Clone)]
pub struct Conversion {
    /// Converted body.
    pub body: FlexBody,
    /// Mass properties in model axes.
    pub mass_properties: MassProperties,
    /// Results of the fully lumped pipelines that were requested.
    pub lumped_modes: Vec<LumpedPipeline>,
    /// Work of the eigen-solver.
    pub work: Work,
    /// Number of columns that the condensation of the consistent mass multiplied by M.
    pub condensed_columns: u64,
    /// Memory and precision as decided before the work; `None` on the dense path.
    pub plan: Option<Plan>,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
}

/// Converts a checked model to a body.
///
/// # Errors
/// The errors of [`ModalModel::find`]; an error for damping that adds energy to the modes.
pub fn convert(model: &FeModel, settings: &ConvertSettings, context: &Context<'_>) -> Result<Conversion> {
    let modal = ModalModel::find(model, settings, context)?;
    let condensed = modal.condense();
    modal.finish(condensed, context)
}

impl ModalModel<'_> {
    /// Returns the body with the groups condensed so far, without comparators and recoveries. A selection for a scene
    /// works on this body.
    ///
    /// # Errors
    /// An error for damping that adds energy to the modes.
    pub fn body(&self, condensed: &Condensation) -> Result<FlexBody> {
        let recovered = Recovered { named_loads: self.of_model().named_loads(), ..Recovered::default() };
        FlexBody::new(self.parts(condensed, Vec::new(), recovered)?.0)
    }

    /// Finishes the conversion with the condensed data.
    ///
    /// # Errors
    /// Errors for damping that adds energy to the modes, for a comparator and for a recovery that fail.
    pub fn finish(self, condensed: Condensation, context: &Context<'_>) -> Result<Conversion> {
        let exact = &condensed.invariants;
        context.phase("lumped comparison");
        let lumped = self.schemes.iter().map(|masses| lumped::comparator(&self, masses, exact)).collect();
        let without_counter = context.without_counter();
        let pipelines = if self.settings.lumped_modes { self.schemes.as_slice() } else { &[] };
        let lumped_modes = pipelines
            .iter()
            .map(|masses| lumped::pipeline(&self, masses, exact, &without_counter))
            .collect::<Result<_>>()?;
        let mut recovered = self.of_model().recoveries(condensed.invariants.groups(), &without_counter)?;
        let of_recoveries = std::mem::take(&mut recovered.diagnostics);
        let (parts, overdamped) = self.parts(&condensed, lumped, recovered)?;
        let body = FlexBody::new(parts)?;
        let mut diagnostics = self.remarks(overdamped, &body);
        diagnostics.extend(of_recoveries);
        let solution = self.found.solution;
        Ok(Conversion {
            body,
            mass_properties: self.mass_properties,
            lumped_modes,
            work: self.work,
            condensed_columns: condensed.columns,
            plan: solution.plan,
            diagnostics,
        })
    }

    /// Returns all parts of the body, and a warning about modes damped beyond critical damping.
    fn parts(
        &self,
        condensed: &Condensation,
        lumped: Vec<LumpedBody>,
        recovered: Recovered,
    ) -> Result<(Parts, Option<Diagnostic>)> {
        let (modes, overdamped) = self.damped_modes(&condensed.invariants)?;
        let parts = Parts {
            description: self.model.description().clone(),
            source: self.source(),
            dimension: self.model.dimension(),
            frame: self.place.frame,
            conditions: match &self.settings.frame {
                FrameChoice::Interface(name) => ReferenceConditions::Interface(name.clone()),
                FrameChoice::Mean(_) => ReferenceConditions::MeanAxes,
            },
            interfaces: self.interfaces.clone(),
            coordinates: self.coordinates(),
            nodes: self.nodes.clone(),
            mesh: self.settings.surface(self.model),
            modes,
            invariants: condensed.invariants.clone(),
            geometric_stiffness: self.geometric_stiffness.clone(),
            rotated_stiffness: self.rotated_stiffness.clone(),
            estimated_stiffness: self.estimated_stiffness.clone(),
            inertia_stiffness: self.inertia_stiffness.clone(),
            lumped,
            certificate: self.certificate(condensed.guarantee.clone()),
            recoveries: recovered.recoveries,
            named_loads: recovered.named_loads,
            terms: condensed.terms.clone(),
            storage: Storage::default(),
        };
        Ok((parts, overdamped))
    }

    /// Returns the provenance of the body.
    fn source(&self) -> Source {
        let (model, settings) = (self.model, self.settings);
        Source {
            files: model.sources().iter().chain(settings.basis.sources()).cloned().collect(),
            n_dofs: model.stiffness().n(),
            mass_structure: match model.scalar_mass() {
                None => MassStructure::General,
                Some(_) if model.has_diagonal_mass() => MassStructure::Diagonal,
                Some(_) => MassStructure::RotationInvariant,
            },
            approximation: self.approximation(),
            settings: settings.described(model),
        }
    }

    /// Returns a text about the part of the mass that does not turn with the nodes, if there is any.
    fn approximation(&self) -> Option<String> {
        let share = self.model.fixed_mass_share();
        (share > 0.0).then(|| {
            format!(
                "exact: m, c, I0, C1, C2, m_ff; W1, W2 and W3 keep a part of the mass matrix, entries of up to {share:.1e} of its diagonal, along the axes of the body while the nodes turn: of beams and shells an error that falls with the square of the element size to that of the rotary inertia of their sections"
            )
        })
    }

    /// Returns the modes with the damping of the model, and a warning about overdamped modes.
    fn damped_modes(&self, invariants: &Invariants) -> Result<(Modes, Option<Diagnostic>)> {
        let solution = &self.found.solution;
        let eigenvalues = &solution.eigenvalues;
        let damping = modal_damping(self.model, self.modes.vectors.as_ref(), eigenvalues, invariants)?;
        let (damping_ratio, modal_damping, overdamped) = match damping {
            Some(damping) => (damping.ratio, Some(damping.matrix), damping.warning),
            None => (vec![0.0; eigenvalues.len()], None, None),
        };
        let modes = Modes {
            damping_ratio,
            modal_damping,
            eigenvalue: eigenvalues.clone(),
            residual: solution.residuals.clone(),
            provenance: self.found.provenance.clone(),
            truncation: self.found.truncation.clone(),
            shape: self.modes.of_body_nodes(),
            rotation: self.modes.rotations.clone(),
            internal: self.modes.internal.clone(),
        };
        Ok((modes, overdamped))
    }

    /// Returns K and M in interface coordinates, in body axes, for bases that have them.
    fn coordinates(&self) -> Option<InterfaceCoordinates> {
        let coordinates = self.found.coordinates.as_ref()?;
        let axes = &self.place.frame.axes;
        Some(coordinates.in_axes(axes, self.model.dimension(), &self.modes.signs))
    }

    /// Returns warnings and notes about the finished body.
    fn remarks(&self, overdamped: Option<Diagnostic>, body: &FlexBody) -> Vec<Diagnostic> {
        let softening = softening_warning(self.model, &self.settings.basis, body);
        let found = self.found.diagnostics.iter().cloned();
        found
            .chain(overdamped)
            .chain(softening)
            .chain(poor_fits(body))
            .chain(unusual_node_inertia(body, Some(self.model)))
            .chain(free_frequencies(body))
            .chain(interface_compliance(body))
            .collect()
    }
}

// Certificate of a body: proofs about its modes, and bounds of rounding.

/// Number of standard deviations of its rounding error that an entry of Psi' K Psi may deviate: large
/// enough for all of many entries.
const ROUNDING_DEVIATIONS: f64 = 10.0;

impl ModalModel<'_> {
    /// Returns the certificate of the body.
    pub(super) fn certificate(&self, guarantee: Option<Guarantee>) -> Certificate {
        let Self { model, found, .. } = self;
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
            eigenvalue_rounding: self.eigenvalue_rounding(),
            inertia_rounding: 0.0,
            guarantee,
            fixed_interface: found.fixed_interface.clone(),
        }
    }

    /// Returns a bound of the rounding errors of products with K in Psi' K Psi, relative to sqrt(lambda_p
    /// lambda_q).
    ///
    /// Rounding errors in the entries of K change psi_p' K psi_q by sum_ij dK_ij psi_ip psi_jq. The
    /// Cauchy-Schwarz inequality bounds the standard deviation by the geometric mean of those of psi_p' K
    /// psi_p and psi_q' K psi_q, since the matrix of the squares K_ij^2 is positive semidefinite like K.
    /// The largest of these relative to its eigenvalue bounds every entry.
    fn eigenvalue_rounding(&self) -> f64 {
        let noise = energy_noise(self.model.stiffness(), self.modes.vectors.as_ref(), f64::EPSILON);
        let relative =
            noise.iter().zip(&self.found.solution.eigenvalues).map(|(noise, lambda)| noise / lambda);
        ROUNDING_DEVIATIONS * relative.fold(0.0, f64::max)
    }
}

// Notes and warnings about a finished body.

/// Relative error of a frequency above which a note reports it.
const REPORTED_FREQUENCY_ERROR: f64 = 0.01;

/// Returns a note about the frequencies of the free body that a Craig-Bampton body does not reproduce.
fn free_frequencies(body: &FlexBody) -> Option<Diagnostic> {
    let free = body.certificate().fixed_interface.as_ref()?.free.as_ref()?;
    let (theta, hertz) = (&body.modes().eigenvalue, body.frequencies_hz());
    let holding = free.holding(theta, REPORTED_FREQUENCY_ERROR);
    let first = *theta.get(holding)?;
    let kept = if body.has_rigid_interfaces() { " with the same rigid interfaces" } else { "" };
    let holds = match holding {
        0 => format!("none is within 1 % of that of the free body{kept}"),
        count => format!(
            "the lowest {count} (up to {} Hz) are within 1 % of those of the free body{kept}",
            significant(hertz[count - 1], 5)
        ),
    };
    let percent = |part: f64| format!("{:.2} %", 100.0 * part);
    let most = free.largest_excess(holding, first).map(|most| format!(", {} at most", percent(most)));
    let message = format!(
        "of the {} frequencies of the Craig-Bampton body {holds}; that of mode {}, {} Hz, is too high by {}{}",
        theta.len(),
        holding + 1,
        significant(hertz[holding], 5),
        percent(free.excess(holding, first)),
        most.unwrap_or_default(),
    );
    Some(Diagnostic::new(Code::FreeFrequencies, message))
}

/// Part of the static compliance at an interface above which a note reports it.
const REPORTED_COMPLIANCE: f64 = 0.01;

/// Returns a note about the truncated part of the static compliance at each interface, if it is known and
/// above one percent. Compliance is f'K^+ f of a unit force or moment f, the square of the norm in
/// [`Truncation`].
///
/// [`Truncation`]: crate::flex_body::Truncation
pub fn interface_compliance(body: &FlexBody) -> Option<Diagnostic> {
    let worst = |interface: &Interface| {
        let of_interface = body.modes().truncation.iter().filter_map(|truncation| {
            let direction = truncation.load.strip_prefix(interface.name.as_str())?.strip_prefix(' ')?;
            Some((truncation.after.powi(2), direction))
        });
        let (missing, direction) = first_largest(of_interface, |pair| pair.0)?;
        let named = || format!("`{}` {:.0} % ({direction})", interface.name, 100.0 * missing);
        (missing > REPORTED_COMPLIANCE).then(named)
    };
    let found: Vec<String> = body.interfaces().iter().filter_map(worst).collect();
    (!found.is_empty()).then(|| {
        let message = format!(
            "the {} modes do not contain the whole static compliance at the interfaces: missing {}",
            body.n_modes(),
            found.join(", ")
        );
        Diagnostic::new(Code::InterfaceCompliance, message)
    })
}

/// Deformation of an interface, relative to its motion, that counts as rounding.
const ROUNDING_DEFORMATION: f64 = 1e-8;

/// Returns warnings about interfaces that are declared rigid but deform in the modes of the body.
pub fn poor_fits(body: &FlexBody) -> Vec<Diagnostic> {
    body.interfaces().iter().filter_map(|interface| poor_fit(interface, body)).collect()
}

fn poor_fit(interface: &Interface, body: &FlexBody) -> Option<Diagnostic> {
    if interface.coupling != Some(Coupling::Rigid) {
        return None;
    }
    let modes = body.modes();
    let rotations = modes.rotation.as_ref().map(Mat::as_ref);
    let rows = interface.rows(body.nodes(), modes.shape.as_ref(), rotations, body.dimension())?;
    let (mode, part) = rows.deformation();
    (part > ROUNDING_DEFORMATION + 4.0 * body.storage().rounding()).then(|| {
        let message = format!(
            "interface `{}` was declared rigid, but deforms by {:.2} % of its largest motion in mode {}: its mean rigid motion is used",
            interface.name,
            100.0 * part,
            mode + 1
        );
        Diagnostic::new(Code::InterfaceFit, message)
    })
}
