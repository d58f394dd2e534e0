//! Shapes of a body from which a selection picks: its modes, or the fixed-interface modes of a Craig-Bampton body, which keeps
//! all motions of its interfaces beside them.
//!
//! The modes of a Craig-Bampton body mix motions of the interfaces with fixed-interface modes, so that hardly one can go. The
//! fixed-interface modes can: without them the response to loads at the interfaces is still that of statics.

use super::situation::PointRows;
use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::combine;
use flexbody_motion::dynamics::BodyPoint;
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

/// Contribution of a mode to the motion of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShare {
    /// Largest |q|.
    pub amplitude: f64,
    /// Largest deflection of a watched point (or of any node if none is watched) by this mode alone, relative to the
    /// largest of all modes together.
    pub deflection: f64,
    /// Root of its largest elastic energy, relative to the largest of all modes together.
    pub stress: f64,
    /// Largest contribution to a recovery over its limit, without the part that static columns hold; `None` if no
    /// recovery has a limit.
    pub recovery: Option<f64>,
    /// True if the mode is kept.
    pub kept: bool,
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

    /// Returns their number.
    pub(super) fn len(&self) -> usize {
        self.eigenvalues.len()
    }

    /// Returns the eigenvalues. Unit: 1/time^2.
    pub(super) fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// Returns the deformations in the modes of the body (nf x number).
    pub(super) fn shapes(&self) -> &Mat<f64> {
        &self.shapes
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

    /// Returns the contribution of every fixed-interface mode to a motion of the whole body, `framed` in the frame of the
    /// scene; deflections are those of the `watched` points or, without any, of all nodes.
    pub(super) fn shares(&self, framed: &FlexBody, watched: &[BodyPoint], trace: &Trace) -> Vec<ModeShare> {
        let rows = PointRows::new(framed);
        let mut longest = vec![0.0f64; self.len()];
        let mut look_at = |rows: &DMatrix<f64>| {
            let moved = PointRows::combined(rows, &self.shapes);
            longest
                .iter_mut()
                .zip(moved.column_iter())
                .for_each(|(most, column)| *most = most.max(column.norm()));
        };
        match watched {
            [] => (0..framed.n_nodes()).for_each(|node| look_at(&rows.of_node(node))),
            points => points.iter().for_each(|point| look_at(&rows.of(point))),
        }
        let deflection = match trace.extremes.watched.as_slice() {
            [] => trace.extremes.deflection.value * framed.extent(),
            peaks => peaks.iter().map(|peak| peak.value).fold(0.0, f64::max),
        };
        let energy = trace.extremes.elastic.sqrt();
        let share = |at: usize| {
            let own =
                |q: &Vec<f64>| q.iter().enumerate().map(|(j, q)| self.amplitudes[(at, j)] * q).sum::<f64>();
            let amplitude = trace.q.iter().map(|q| own(q).abs()).fold(0.0, f64::max);
            let moved = longest[at] * amplitude;
            let root_energy = (0.5 * self.eigenvalues[at]).sqrt() * amplitude;
            ModeShare {
                amplitude,
                deflection: moved / deflection.max(trace.resolution.deflection),
                stress: root_energy / energy.max(trace.resolution.root_energy),
                recovery: None,
                kept: true,
            }
        };
        (0..self.len()).map(share).collect()
    }
}
