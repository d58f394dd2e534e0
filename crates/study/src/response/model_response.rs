//! Model of the body: the equations of all its nodes, and the enriched response that estimates the error.

use super::direct::DirectSolver;
use super::framed_body::{FramedBody, Read};
use super::modal_sum::{ModalSum, NodalModes};
use super::place::Place;
use faer::{Mat, Scale};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::{CoupledModel, rigid_modes};
use flexbody_linalg::context::Context;
use flexbody_linalg::{gram, largest, side_by_side};
use flexbody_model::FeModel;

/// Largest deviation from one of the modal masses (and relative modal stiffnesses) of a body in its own model. It
/// allows for arrays of 32 bits; a larger deviation means another model.
const MODAL_MASS: f64 = 1e-4;

/// Largest number of outputs whose static responses improve the estimate of the error. More cost more.
const MOST_IMPROVED: usize = 36;

/// Model of the body, with the enriched response that estimates the error.
pub(super) struct ModelResponse<'m> {
    pub nodal: NodalModes<'m>,
    /// Response with static responses added to the modes, which estimates the error; `None` if the modes leave no
    /// unbalanced force.
    pub enriched: Option<ModalSum>,
    /// Displacements of the coordinates of this response (N x n).
    pub shapes: Option<Mat<f64>>,
    damping: Option<Mat<f64>>,
    context: Context<'m>,
}

impl<'m> ModelResponse<'m> {
    pub(super) fn new(
        model: &'m FeModel,
        framed: &FramedBody,
        read: &Read<'_>,
        damping: Option<&Mat<f64>>,
        context: &Context<'m>,
    ) -> Result<Self> {
        context.phase("estimate of the error");
        let body = &framed.damped;
        let nodal = nodal_modes(model, framed, read, damping)?;
        let (enriched, shapes) = nodal.enriched(body, damping)?.unzip();
        Ok(Self { nodal, enriched, shapes, damping: damping.cloned(), context: *context })
    }

    /// Returns the model.
    pub(super) fn model(&self) -> &FeModel {
        self.nodal.model.model()
    }

    /// Prepares the equations of all nodes of `model`, with the couplings of the body or without, for `solves`
    /// frequencies.
    pub(super) fn direct_solver<'s>(
        &'s self,
        model: &'s CoupledModel<'_>,
        solves: usize,
    ) -> Result<DirectSolver<'s>> {
        let NodalModes { inertial, loads, measured, moving, whole, .. } = &self.nodal;
        let damping = self.damping.as_ref().map(|c| (inertial, c));
        DirectSolver::new(model, [loads, measured], moving, damping, whole.clone(), solves, &self.context)
    }

    /// Returns the model with deformable interfaces; `None` if no interface of the body is rigid.
    pub(super) fn deforming(&self) -> Option<CoupledModel<'m>> {
        let coupled = &self.nodal.model;
        (!coupled.rigid_interfaces().is_empty()).then(|| CoupledModel::uncoupled(coupled.model()))
    }
}

/// Expresses the body in the rows of the model that it was made of, and refuses a body of another model.
fn nodal_modes<'m>(
    model: &'m FeModel,
    framed: &FramedBody,
    read: &Read<'_>,
    damping: Option<&Mat<f64>>,
) -> Result<NodalModes<'m>> {
    let body = &framed.damped;
    let foreign = |why: &str| {
        let message = format!("the body was not made from this model: {why}");
        let help = "give the model that the body was converted from";
        Diagnostic::new(Code::BodyIncomparable, message).with_help(help)
    };
    let vectors = body.vectors_of(model).ok_or_else(|| foreign("its matrix rows differ"))?;
    let pencil = model.pencil();
    // Modes of this model have modal mass 1 and modal stiffness lambda.
    let (inertial, elastic) = (pencil.apply_mass(vectors.as_ref()), pencil.apply_stiffness(vectors.as_ref()));
    let mass = gram(vectors.as_ref(), inertial.as_ref());
    let eigenvalue = &body.modes().eigenvalue;
    let stiffness = gram(vectors.as_ref(), elastic.as_ref());
    let apart = largest(
        (0..eigenvalue.len())
            .flat_map(|j| [(mass[(j, j)] - 1.0).abs(), (stiffness[(j, j)] / eigenvalue[j] - 1.0).abs()]),
    );
    if apart.is_nan() || apart > MODAL_MASS {
        let why = format!("modal masses or stiffnesses of its modes differ by up to {apart:.1e}");
        return Err(foreign(&why).into());
    }
    let whole = damping.filter(|_| framed.lag > 0.0).map(|c| (framed.lag, c - stiffness * Scale(framed.lag)));
    let unit_loads = |places: &[Place]| -> Result<Mat<f64>> {
        if places.is_empty() {
            return Ok(Mat::zeros(model.rows().len(), 0));
        }
        let loads = places.iter().map(|place| place.loads(model)).collect::<Result<Vec<_>>>()?;
        Ok(side_by_side(&loads.iter().map(|load| load.as_ref()).collect::<Vec<_>>()))
    };
    let of_recoveries = read.rows.iter().map(|row| row.loads(model)).collect::<Result<Vec<_>>>()?;
    let places = unit_loads(&read.to)?;
    let outputs: Vec<_> = std::iter::once(&places).chain(&of_recoveries).map(Mat::as_ref).collect();
    let measured = side_by_side(&outputs);
    let improved = if measured.ncols() > MOST_IMPROVED { places.ncols() } else { measured.ncols() };
    Ok(NodalModes {
        model: body.coupled_model(model, vectors.as_ref()),
        rigid: rigid_modes(model, &pencil)?,
        vectors,
        inertial,
        elastic,
        loads: unit_loads(&read.from)?,
        measured,
        moving: read.moving(model.dimension()),
        improved,
        whole,
    })
}
