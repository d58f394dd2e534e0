//! Stress stiffness of unit loads, from elements that the stiffness of the model proves.

use super::modal_matrices::unit_rotations;
use super::recovery::{FreeBasis, StaticLoads};
use crate::flex_body::Frame;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_elements::ProvedElements;
use flexbody_linalg::context::Context;
use flexbody_linalg::{contiguous, gram, multiply, side_by_side, zeros};
use flexbody_model::{FeModel, GeometricStiffness, LoadKind, UnitLoad};

/// Size of a static response, relative to the largest of its kind, below which the load stresses nothing.
const MIN_RESPONSE: f64 = 1e-9;

/// Loads whose stress stiffness is computed from the elements of the deck.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StressLoads {
    /// Centrifugal loads of unit spin.
    pub spin: bool,
    /// Unit forces and moments at interfaces.
    pub interfaces: bool,
    /// Named loads, except preloads, whose stress stiffness belongs to K.
    pub loads: bool,
}

impl StressLoads {
    /// Returns true if no load is wanted.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// Names of the kinds of loads, in the order of the documentation.
    pub const NAMES: [&'static str; 3] = ["spin", "interfaces", "loads"];

    /// Returns the kinds of loads with the given names, separated by commas: `none` and an empty text are no loads.
    ///
    /// # Errors
    /// The first name that is not known.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut wanted = Self::default();
        for name in text.split(',').map(str::trim).filter(|name| !name.is_empty() && *name != "none") {
            match name {
                "spin" => wanted.spin = true,
                "interfaces" => wanted.interfaces = true,
                "loads" => wanted.loads = true,
                _ => return Err(name.to_owned()),
            }
        }
        Ok(wanted)
    }

    /// Returns the kinds of loads that the settings of a body record.
    pub fn recorded(settings: &serde_json::Value) -> Self {
        let names = settings["stress_stiffness"].as_array().into_iter().flatten();
        let names: Vec<&str> = names.filter_map(serde_json::Value::as_str).collect();
        Self::parse(&names.join(",")).unwrap_or_default()
    }

    /// Returns the names of the kinds of loads that are wanted.
    pub fn names(self) -> Vec<&'static str> {
        let kinds = [self.spin, self.interfaces, self.loads];
        Self::NAMES.into_iter().zip(kinds).filter(|(_, wanted)| *wanted).map(|(name, _)| name).collect()
    }

    fn wants(self, model: &FeModel, load: &UnitLoad) -> bool {
        match &load.kind {
            LoadKind::Spin => self.spin,
            LoadKind::Force(_) | LoadKind::Moment(_) => self.interfaces,
            LoadKind::Named(name) => {
                let is_preload = model.named_loads().iter().any(|one| one.preload && one.name == *name);
                self.loads && !is_preload
            }
            LoadKind::Acceleration | LoadKind::AngularAcceleration => false,
        }
    }
}

/// Modes whose stress stiffness is wanted.
pub(crate) struct StressedModes<'a> {
    /// Modes of the body by the rows of the model (N x nf).
    pub modes: &'a Mat<f64>,
    /// Psi' K Psi.
    pub modal_stiffness: &'a Mat<f64>,
    /// About the first flexible eigenvalue.
    pub lowest: f64,
    /// Frame of the body.
    pub frame: &'a Frame,
}

/// Returns S' K_geo S for each wanted load that the model does not state a stiffness for, where S are the modes and then the
/// unit rotations about the frame: K_geo of the stress of the static response G f, balanced by inertia relief.
///
/// # Errors
/// [`ElementsUnproved`](flexbody_base::diagnostic::Code::ElementsUnproved); failures of the factor.
pub(crate) fn stress_stiffness(
    model: &FeModel,
    wanted: StressLoads,
    of: &StressedModes<'_>,
    context: &Context<'_>,
) -> Result<Vec<GeometricStiffness<Mat<f64>>>> {
    let loads = StaticLoads::of_model(model)?;
    let is_given = |load: &UnitLoad| model.geometric_stiffness().iter().any(|one| one.load.kind == load.kind);
    let unit_loads = loads.unit_loads();
    let columns: Vec<usize> = (0..unit_loads.len())
        .filter(|&at| wanted.wants(model, &unit_loads[at]) && !is_given(&unit_loads[at]))
        .collect();
    if columns.is_empty() {
        return Ok(Vec::new());
    }
    let elements = model.proved_elements()?;
    context.phase("stress stiffness");
    let basis = FreeBasis::new(model, of.modes, of.modal_stiffness.clone())?;
    let mut responses = basis.responses_to(loads.forces_of(&columns), of.lowest, context)?;
    basis.remove_rigid_motion(&mut responses);
    let norms = basis.norms(&responses);
    let shapes = side_by_side(&[of.modes.as_ref(), unit_rotations(model, of.frame).as_ref()]);
    let shapes = elements.displacements(shapes.as_ref());
    let moved = elements.displacements(responses.as_ref());
    let of_load = |(column, &at): (usize, &usize)| {
        let load = &unit_loads[at];
        let alike = columns.iter().zip(&norms).filter(|(at, _)| unit_loads[**at].kind == load.kind);
        let largest = alike.map(|(_, norm)| *norm).fold(0.0, f64::max);
        (norms[column] > MIN_RESPONSE * largest).then(|| {
            let matrix = reduced_by_nodes(&elements, contiguous(moved.col(column)), &shapes);
            GeometricStiffness { load: load.clone(), matrix }
        })
    };
    Ok(columns.iter().enumerate().filter_map(of_load).collect())
}

/// Returns S' (g kron I3) S for the stress stiffness g of displacements, and shapes S by the nodes of the elements.
fn reduced_by_nodes(elements: &ProvedElements, moved: &[f64], shapes: &Mat<f64>) -> Mat<f64> {
    let by_nodes = elements.stress_stiffness(moved);
    let mut product = zeros(shapes.nrows(), shapes.ncols());
    multiply(&by_nodes, 3, shapes.as_ref(), product.as_mut());
    let reduced = gram(shapes.as_ref(), product.as_ref());
    Mat::from_fn(reduced.nrows(), reduced.ncols(), |i, j| 0.5 * (reduced[(i, j)] + reduced[(j, i)]))
}
