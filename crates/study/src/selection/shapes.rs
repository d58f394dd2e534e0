//! Shapes of a body from which a selection picks: its modes, or the fixed-interface modes of a Craig-Bampton body, which keeps
//! all motions of its interfaces beside them.
//!
//! The modes of a Craig-Bampton body mix motions of the interfaces with fixed-interface modes, so that hardly one can go. The
//! fixed-interface modes can: without them the response to loads at the interfaces is still that of statics.

use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::combine;
use flexbody_motion::scene::{FramedScene, Scene, Trace, damped_once};
use nalgebra::DMatrix;
use std::borrow::Cow;

/// Kind of the shapes from which a selection picks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Pool {
    /// Modes of the body.
    #[default]
    Modes,
    /// Fixed-interface modes of a Craig-Bampton body, beside all motions of its interfaces.
    FixedInterface,
}

/// Fixed-interface modes that a selection keeps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FixedInterfaceChoice {
    /// Indices of the kept ones (from 0, ascending).
    pub kept: Vec<usize>,
    /// Number of those of the body.
    pub of: usize,
}

/// Fixed-interface modes of a Craig-Bampton body, and the scene in which bodies with some of them are tried.
pub struct FixedInterfaceModes<'b> {
    whole: &'b FlexBody,
    scene: &'b Scene,
    /// Amplitudes in the modes of the body (number x nf).
    amplitudes: Mat<f64>,
    /// Deformations in the modes of the body (nf x number).
    shapes: Mat<f64>,
    /// Eigenvalues. Unit: 1/time^2.
    eigenvalues: Vec<f64>,
}

impl<'b> FixedInterfaceModes<'b> {
    /// Returns the fixed-interface modes of `whole`, a body as it is before `scene` carries it. `None` for another basis, and
    /// for a scene that starts modes by their numbers.
    pub(super) fn new(whole: &'b FlexBody, scene: &'b Scene) -> Option<Self> {
        let starts_modes = !scene.initial.modes.is_empty();
        let amplitudes = whole.fixed_interface_amplitudes().filter(|_| !starts_modes)?;
        let (shapes, eigenvalues) = (whole.fixed_interface_shapes()?, whole.fixed_interface_eigenvalues()?);
        // A body without shapes of hardly any mass may have fewer modes than fixed-interface modes.
        (eigenvalues.len() <= whole.n_modes()).then_some(Self {
            whole,
            scene,
            amplitudes,
            shapes,
            eigenvalues,
        })
    }

    /// Returns the body with the fixed-interface modes `kept` in the frame and with the damping of the scene, and the stiffness
    /// Psi'K Psi_r that couples its modes to those of the whole body.
    ///
    /// # Errors
    /// The errors of [`FramedScene::new`] and of the damping.
    pub(super) fn body(&self, kept: &[usize]) -> Result<(FlexBody, Mat<f64>)> {
        let (fewer, modes) = self.whole.fewer_fixed_interface_modes(kept)?;
        let shared = combine(modes.as_ref().transpose(), self.whole.invariants().modal_stiffness().as_ref());
        let FramedScene { body, scene, .. } = FramedScene::new(&fewer, self.scene)?;
        let (body, _) = damped_once(Cow::Owned(body.into_owned()), scene)?;
        Ok((body.into_owned(), shared))
    }
}

/// Shapes of a pool, in terms of the modes of a body.
#[derive(Clone, Copy)]
pub(super) struct PoolShapes<'a> {
    body: &'a FlexBody,
    /// The fixed-interface modes of a pool of these.
    fixed: Option<&'a FixedInterfaceModes<'a>>,
}

impl<'a> PoolShapes<'a> {
    /// Returns the shapes of a pool: modes of `body`, or its fixed-interface modes `fixed`.
    pub(super) fn new(pool: Pool, body: &'a FlexBody, fixed: Option<&'a FixedInterfaceModes<'a>>) -> Self {
        Self { body, fixed: fixed.filter(|_| pool == Pool::FixedInterface) }
    }

    /// Returns the name of a shape.
    pub(super) fn noun(&self) -> &'static str {
        if self.fixed.is_some() { "fixed-interface mode" } else { "mode" }
    }

    /// Returns the eigenvalue of each shape. Unit: 1/time^2.
    pub(super) fn eigenvalues(&self) -> &'a [f64] {
        self.fixed.map_or(&self.body.modes().eigenvalue, |fixed| &fixed.eigenvalues)
    }

    /// Returns the damping ratio of each shape; those of fixed-interface modes are not known and count as zero.
    pub(super) fn damping_ratio(&self, at: usize) -> f64 {
        if self.fixed.is_some() { 0.0 } else { self.body.modes().damping_ratio[at] }
    }

    /// Returns rows of the modes (k x nf) in the shapes of the pool.
    pub(super) fn rows(&self, of_modes: DMatrix<f64>) -> DMatrix<f64> {
        let Some(FixedInterfaceModes { shapes, .. }) = self.fixed else { return of_modes };
        let entry = |k: usize, at: usize| {
            (0..of_modes.ncols()).map(|j| of_modes[(k, j)] * shapes[(j, at)]).sum::<f64>()
        };
        DMatrix::from_fn(of_modes.nrows(), shapes.ncols(), entry)
    }

    /// Returns the largest amplitude of each shape in a motion of the body.
    pub(super) fn largest_amplitudes(&self, trace: &Trace) -> Vec<f64> {
        let Some(FixedInterfaceModes { amplitudes, .. }) = self.fixed else {
            return trace.extremes.amplitudes.clone();
        };
        let largest = |at: usize| {
            let own = |q: &Vec<f64>| q.iter().enumerate().map(|(j, q)| amplitudes[(at, j)] * q).sum::<f64>();
            trace.q.iter().map(|q| own(q).abs()).fold(0.0, f64::max)
        };
        (0..amplitudes.nrows()).map(largest).collect()
    }
}
