//! Named loads of a body: modal loads, resultants and moments of the nodal forces of its model.

use super::recovery::BodyOfModel;
use crate::flex_body::NamedLoad;
use faer::Mat;
use flexbody_linalg::gram;
use flexbody_model::{ModelLoad, rigid_axes};
use nalgebra::{Matrix3, Vector3};

impl BodyOfModel<'_> {
    /// Returns the named loads of the model in the modes and in the frame of the body, without their compliances.
    pub(crate) fn named_loads(&self) -> Vec<NamedLoad> {
        self.model.named_loads().iter().map(|load| self.named_load(load)).collect()
    }

    fn named_load(&self, load: &ModelLoad) -> NamedLoad {
        let (model, axes) = (self.model, &self.place.frame.axes);
        let forces = Mat::from_fn(load.forces.len(), 1, |i, _| load.forces[i]);
        let modal = gram(self.modes.vectors.as_ref(), forces.as_ref());
        // Resultants about the origin of the frame, along the axes of the model, then of the body.
        let fields = model.rigid_fields(self.place.frame.origin.into(), 1.0);
        let resultants = gram(fields.as_ref(), forces.as_ref());
        let mut along_model = [0.0; 6];
        rigid_axes(model.dimension())
            .iter()
            .enumerate()
            .for_each(|(c, &k)| along_model[k] = resultants[(c, 0)]);
        let [force, torque] =
            [0, 3].map(|first| axes.tr_mul(&Vector3::from_fn(|k, _| along_model[first + k])));
        // First moments and their change with the modes.
        let (d, nf) = (model.dimension(), self.modes.vectors.ncols());
        let (mut moments, mut turning) = (Matrix3::zeros(), Mat::zeros(3, nf));
        for (node, position) in self.place.positions.iter().enumerate() {
            let at = |k: usize| if k < d { load.forces[d * node + k] } else { 0.0 };
            let force = axes.tr_mul(&Vector3::from_fn(|k, _| at(k)));
            if force == Vector3::zeros() {
                continue;
            }
            moments += Vector3::from(*position) * force.transpose();
            for j in 0..nf {
                let moved = Vector3::from_fn(|k, _| self.modes.displacements[(3 * node + k, j)]);
                let torque = moved.cross(&force);
                (0..3).for_each(|k| turning[(k, j)] += torque[k]);
            }
        }
        NamedLoad {
            name: load.name.clone(),
            preload: load.preload,
            modal: (0..nf).map(|j| modal[(j, 0)]).collect(),
            force,
            torque,
            moments,
            turning,
            compliance: None,
        }
    }
}
