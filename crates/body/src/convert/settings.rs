//! Settings of a conversion.

use super::stress_loads::StressLoads;
use crate::basis::{BasisChoice, Loads, ModeSettings};
use crate::invariants::{FrameChoice, LumpedScheme};
use flexbody_eigen::Wanted;
use flexbody_elements::ProvedElements;
use flexbody_linalg::instruction_set;
use flexbody_model::{Damping, FeModel, SurfaceMesh};
use std::collections::BTreeMap;

/// Kind of lumped comparator.
#[derive(Debug, Clone, PartialEq)]
pub enum Lumping {
    /// Row sums of Ms.
    RowSum,
    /// Diagonal of Ms scaled to the total mass.
    DiagonalScaling,
    /// Nodal masses by node number, as a multibody package would import them.
    User(Vec<(i64, f64)>),
}

impl Lumping {
    fn scheme(&self) -> LumpedScheme {
        match self {
            Self::RowSum => LumpedScheme::RowSum,
            Self::DiagonalScaling => LumpedScheme::DiagonalScaling,
            Self::User(_) => LumpedScheme::User,
        }
    }
}

/// Choice of the surface that draws the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MeshChoice {
    /// Surface of the model, if it has one.
    #[default]
    Whole,
    /// Surface of the model, reduced to at most this number of triangles.
    AtMost(usize),
    /// No surface.
    Without,
}

/// Settings of a conversion.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertSettings {
    /// Number and accuracy of the modes.
    pub modes: ModeSettings,
    /// Choice of the basis.
    pub basis: BasisChoice,
    /// Body frame.
    pub frame: FrameChoice,
    /// Lumped comparators to compute.
    pub lumped: Vec<Lumping>,
    /// True if the modes of each lumped mass are computed as well.
    pub lumped_modes: bool,
    /// Surface of the body.
    pub mesh: MeshChoice,
    /// Loads whose stress stiffness is computed from the elements of the deck.
    pub stress_stiffness: StressLoads,
}

impl Default for ConvertSettings {
    /// Returns the default settings: 20 modes, a frame at the centre of mass along the axes of the model,
    /// and the two comparators that need only the matrices.
    fn default() -> Self {
        Self {
            modes: ModeSettings::default(),
            basis: BasisChoice::default(),
            frame: FrameChoice::default(),
            lumped: vec![Lumping::RowSum, Lumping::DiagonalScaling],
            lumped_modes: false,
            mesh: MeshChoice::default(),
            stress_stiffness: StressLoads::default(),
        }
    }
}

impl ConvertSettings {
    /// Returns the settings that can change the result, for the file.
    pub(super) fn described(&self, model: &FeModel) -> serde_json::Value {
        let (modes, below) = match self.modes.wanted {
            Wanted::Lowest(count) => ((count < usize::MAX).then_some(count), None),
            Wanted::Below(lambda) => (None, Some(lambda)),
        };
        let schemes: Vec<&str> = self.lumped.iter().map(|lumping| lumping.scheme().name()).collect();
        let loads: Vec<String> = self.basis.residual_vectors().iter().map(Loads::name).collect();
        let mut described = serde_json::json!({
            "accuracy": self.modes.accuracy.name(),
            "basis": self.basis.basis().kind().name(),
            "frame": self.frame.text(),
            "instructions": instruction_set(),
            "lumped": schemes,
            "max_eigenvalue": below,
            "modes": modes,
            "residual_vectors": loads,
        });
        if let Some(damping) = model.damping() {
            described["damping"] = serde_json::json!({ damping.name(): damping_numbers(damping) });
        }
        if let Some(engine) = self.basis.engine() {
            described["engine"] = serde_json::json!(engine);
        }
        if !self.stress_stiffness.is_empty() {
            described["stress_stiffness"] = serde_json::json!(self.stress_stiffness.names());
            described["elements"] =
                model.proved_elements().map_or(serde_json::Value::Null, |elements| counts(&elements));
        }
        // The file itself shows if there is a surface.
        if let (MeshChoice::AtMost(most), Some(_)) = (self.mesh, model.mesh()) {
            described["mesh_triangles"] = serde_json::json!(most);
        }
        described
    }

    /// Returns the surface of the body.
    pub(super) fn surface(&self, model: &FeModel) -> Option<SurfaceMesh> {
        let mesh = model.mesh()?;
        match self.mesh {
            MeshChoice::Whole => Some(mesh.clone()),
            MeshChoice::AtMost(most) => mesh.decimated(&model.nodes().positions, most),
            MeshChoice::Without => None,
        }
    }
}

/// Returns the number of elements of each type with their formulation.
fn counts(elements: &ProvedElements) -> serde_json::Value {
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for (group, formulation) in elements.groups() {
        *counts.entry((&group.kind, formulation.name())).or_default() += group.ids.len();
    }
    let one = |((kind, formulation), count): (&(&str, &str), &usize)| serde_json::json!({ "type": kind, "formulation": formulation, "count": count });
    counts.iter().map(one).collect()
}

/// Returns the numbers that define a damping; null for a matrix.
fn damping_numbers<D>(damping: &Damping<D>) -> serde_json::Value {
    match damping {
        Damping::Ratio(ratio) => serde_json::json!(ratio),
        Damping::Bands(bands) => {
            let end = |hertz: f64| hertz.is_finite().then_some(hertz);
            bands.iter().map(|b| serde_json::json!({ "to_hz": end(b.to_hz), "ratio": b.ratio })).collect()
        }
        Damping::Rayleigh { alpha, beta } => serde_json::json!({ "alpha": alpha, "beta": beta }),
        Damping::Matrix(_) => serde_json::Value::Null,
    }
}
