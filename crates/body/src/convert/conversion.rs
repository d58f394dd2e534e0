//! Last stage of a conversion: the body, the lumped comparators, and diagnostics.

use super::geometric_stiffness::softening_warning;
use super::remarks::{free_frequencies, interface_compliance, poor_fits};
use super::{Condensation, ConvertSettings, LumpedPipeline, ModalModel, lumped, modal_damping};
use crate::flex_body::{
    FlexBody, InterfaceCoordinates, LumpedBody, MassStructure, Modes, Parts, Recovery, ReferenceConditions,
    Source, Storage,
};
use crate::invariants::{FrameChoice, Invariants, MassProperties};
use flexbody_base::diagnostic::Diagnostic;
use flexbody_base::error::Result;
use flexbody_eigen::Plan;
use flexbody_linalg::context::{Context, Work};
use flexbody_linalg::copied;
use flexbody_model::FeModel;

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
        FlexBody::new(self.parts(condensed, Vec::new(), Vec::new())?.0)
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
        let recoveries = self.recoveries(condensed.invariants.groups().w1, &without_counter)?;
        let (parts, overdamped) = self.parts(&condensed, lumped, recoveries)?;
        let body = FlexBody::new(parts)?;
        let diagnostics = self.remarks(overdamped, &body);
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
        recoveries: Vec<Recovery>,
    ) -> Result<(Parts, Option<Diagnostic>)> {
        let (modes, overdamped) = self.damped_modes(&condensed.invariants)?;
        let parts = Parts {
            source: self.source(),
            dimension: self.model.dimension(),
            units: self.model.units().clone(),
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
            inertia_stiffness: self.inertia_stiffness.clone(),
            lumped,
            certificate: self.certificate(condensed.guarantee.clone()),
            recoveries,
            terms: condensed.terms.clone(),
            storage: Storage::default(),
        };
        Ok((parts, overdamped))
    }

    /// Returns the provenance of the body.
    fn source(&self) -> Source {
        let (model, settings) = (self.model, self.settings);
        Source {
            name: model.name().to_owned(),
            files: model.sources().iter().chain(settings.basis.sources()).cloned().collect(),
            number: model.number(),
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
            shape: copied(self.modes.of_nodes()),
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
            .chain(free_frequencies(body))
            .chain(interface_compliance(body))
            .collect()
    }
}
