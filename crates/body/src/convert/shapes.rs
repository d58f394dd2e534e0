//! Shapes whose stresses an FE program is asked for: the modes of a body, and the static responses to loads and spin
//! outside the modes.

use super::free_basis::{FreeBasis, StaticLoads};
use crate::flex_body::FlexBody;
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_linalg::context::Context;
use flexbody_linalg::{gram, largest_entry, side_by_side};
use flexbody_model::{FeModel, LoadKind, ModelLoad, STRAIN_NAMES, UnitLoad, extents, uniform_strains};

/// Difference of Psi'K Psi from the stored K_ff, relative to its largest entry, above which the model is another one.
const MAX_STIFFNESS_DIFFERENCE: f64 = 1e-5;

/// Size of a static response outside the modes, relative to the whole response, below which it is rounding.
const MIN_RESPONSE: f64 = 1e-9;

/// Largest displacement of a shape, relative to the diagonal of the box around the nodes. Stresses of metals then have the size of their
/// strength, so that values in tables with few decimals keep their digits.
const SHAPE_SIZE: f64 = 1e-3;

/// Beginning of the names of steps of uniform strain.
pub const UNIFORM_STRAIN: &str = "uniform strain ";

/// Mode or static column that a shape is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ShapeColumn {
    /// Mode, counted from 1.
    Mode(usize),
    /// Static response, outside the modes, to the load of this name.
    Static(String),
    /// Whole static response to a unit load.
    Load(UnitLoad),
    /// Uniform strain of this component, in the order of [`STRAIN_NAMES`].
    Strain(usize),
}

impl std::fmt::Display for ShapeColumn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Mode(number) => write!(f, "mode {number}"),
            Self::Static(name) => f.write_str(name),
            Self::Load(load) => write!(f, "{load}"),
            Self::Strain(component) => write!(f, "{UNIFORM_STRAIN}{}", STRAIN_NAMES[*component]),
        }
    }
}

/// Shapes of a body, without rigid motion.
#[derive(Debug, Clone)]
pub struct RecoveryShapes {
    /// Mode or column of each shape.
    pub columns: Vec<ShapeColumn>,
    /// Factor of each shape: a shape is the factor times its mode or column.
    pub factors: Vec<f64>,
    /// Displacements by internal rows of the model (N x s).
    pub fields: Mat<f64>,
}

impl RecoveryShapes {
    /// Returns the shapes with those of the six uniform strains of `model`, whose stresses the stiffness knows.
    ///
    /// # Errors
    /// [`Usage`](Code::Usage) for a plane model.
    pub fn with_uniform_strains(self, model: &FeModel) -> Result<Self> {
        if model.dimension() != 3 {
            let message = "the model is plane: uniform strains are those of solids";
            return Err(Diagnostic::new(Code::Usage, message).into());
        }
        let columns: Vec<ShapeColumn> = (0..STRAIN_NAMES.len()).map(ShapeColumn::Strain).collect();
        let all: Vec<usize> = (0..columns.len()).collect();
        let strains = scaled(model, &columns, &uniform_strains(model), &all);
        Ok(Self {
            columns: self.columns.into_iter().chain(strains.columns).collect(),
            factors: self.factors.into_iter().chain(strains.factors).collect(),
            fields: side_by_side(&[self.fields.as_ref(), strains.fields.as_ref()]),
        })
    }
}

/// Returns the shapes of `body`, whose combinations are its modes and the static columns of every recovery, except
/// static columns that the modes contain.
///
/// * `deformed_inertia`: true for the columns of the inertia of the deformation too.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) if the body is not of `model`; failures of the factor.
pub fn recovery_shapes(
    body: &FlexBody,
    model: &FeModel,
    deformed_inertia: bool,
    context: &Context<'_>,
) -> Result<RecoveryShapes> {
    let (groups, vectors) = (body.groups(), vectors_of(body, model)?);
    let basis = basis_of(body, model, &vectors)?;
    context.phase("static responses");
    let loads = StaticLoads::new(model, &basis, &vectors, deformed_inertia)?;
    let mut responses = basis.responses(&loads, body.modes().eigenvalue[0], groups, context)?;
    let sizes = basis.sizes_of_responses(&responses, &loads, groups);
    basis.remove_rigid_motion(&mut responses);
    let norms = basis.norms(&responses);
    let modes = basis.modes.ncols();
    let names = loads.names();
    let columns = (0..modes).map(|j| ShapeColumn::Mode(j + 1));
    let columns: Vec<ShapeColumn> = columns.chain(names.into_iter().map(ShapeColumn::Static)).collect();
    let fields = side_by_side(&[basis.modes.as_ref(), responses.as_ref()]);
    let is_kept = |j: &usize| {
        j.checked_sub(modes).is_none_or(|at| norms[at] > MIN_RESPONSE * sizes[at] && norms[at] > 0.0)
    };
    let kept: Vec<usize> = (0..columns.len()).filter(is_kept).collect();
    Ok(scaled(model, &columns, &fields, &kept))
}

/// Returns the whole static responses G F of `model` to unit spin, unit loads at its interfaces and named loads, balanced by
/// inertia relief: the displacements of the stress of each load. Preloads are left out, since their stress stiffness
/// belongs into K. Interfaces that `body` keeps rigid are rigid. Loads
/// without a response are left out.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) if the body is not of `model`; failures of the factor.
pub fn load_shapes(body: &FlexBody, model: &FeModel, context: &Context<'_>) -> Result<RecoveryShapes> {
    let basis = basis_of(body, model, &vectors_of(body, model)?)?;
    context.phase("static responses");
    let loads = StaticLoads::of_model(model)?;
    let mut responses = basis.whole_responses(&loads, body.modes().eigenvalue[0], context)?;
    basis.remove_rigid_motion(&mut responses);
    let norms = basis.norms(&responses);
    let unit_loads = loads.unit_loads();
    let of_kind = |load: &UnitLoad| {
        let same = unit_loads.iter().zip(&norms).filter(|(other, _)| other.kind.name() == load.kind.name());
        same.map(|(_, norm)| *norm).fold(0.0, f64::max)
    };
    // The stress stiffness of a preload belongs into K.
    let is_preload = |load: &UnitLoad| {
        let named = |one: &ModelLoad| one.preload && load.kind == LoadKind::Named(one.name.clone());
        model.named_loads().iter().any(named)
    };
    let is_kept =
        |j: &usize| norms[*j] > MIN_RESPONSE * of_kind(&unit_loads[*j]) && !is_preload(&unit_loads[*j]);
    let kept: Vec<usize> = (0..unit_loads.len()).filter(is_kept).collect();
    let columns: Vec<ShapeColumn> = unit_loads.iter().cloned().map(ShapeColumn::Load).collect();
    Ok(scaled(model, &columns, &responses, &kept))
}

/// Returns the modes `vectors` of `body` as fields of `model`.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) if the body is not of `model`.
fn basis_of<'m>(body: &FlexBody, model: &'m FeModel, vectors: &Mat<f64>) -> Result<FreeBasis<'m>> {
    let stored = body.invariants().modal_stiffness();
    let computed = gram(vectors.as_ref(), model.pencil().apply_stiffness(vectors.as_ref()).as_ref());
    let apart = largest_entry((&computed - stored).as_ref());
    let allowed = (MAX_STIFFNESS_DIFFERENCE + body.storage().rounding()) * largest_entry(stored.as_ref());
    if apart.is_nan() || apart > allowed {
        return Err(incomparable("the stiffness of the body's modes is not that of the model"));
    }
    FreeBasis::new(model, vectors, stored.clone())
}

/// Returns the modes of `body` by the rows of `model` (N x nf), in the frame of the body and along the axes of the model.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) if the body has other nodes or rows than `model`.
fn vectors_of(body: &FlexBody, model: &FeModel) -> Result<Mat<f64>> {
    let vectors = (body.nodes().ids == model.nodes_of_body().ids).then(|| body.vectors_of(model)).flatten();
    vectors.ok_or_else(|| incomparable("the nodes and rows of the body are not those of the model"))
}

fn incomparable(message: &str) -> Error {
    Diagnostic::new(Code::BodyIncomparable, message).into()
}

/// Returns the columns `kept` of the fields (N x m), each with its largest displacement set to the size of a shape.
fn scaled(model: &FeModel, columns: &[ShapeColumn], fields: &Mat<f64>, kept: &[usize]) -> RecoveryShapes {
    let size =
        extents(&model.nodes().positions).into_iter().map(|extent| extent * extent).sum::<f64>().sqrt();
    let displaced = model.dimension() * model.nodes().len();
    let factors: Vec<f64> = kept
        .iter()
        .map(|&j| SHAPE_SIZE * size / fields.as_ref().subrows(0, displaced).col(j).norm_max())
        .collect();
    RecoveryShapes {
        columns: kept.iter().map(|&j| columns[j].clone()).collect(),
        fields: Mat::from_fn(fields.nrows(), kept.len(), |i, j| fields[(i, kept[j])] * factors[j]),
        factors,
    }
}
