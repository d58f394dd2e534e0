//! Rotation, reflection and shift of a subject in world and model.

use super::model::{conjugated, geometric};
use super::scene::start_axes;
use crate::subject::Subject;
use crate::{carried_mass, named_loads, recoveries};
use flexbody_model::{Damping, RawMatrix, RawModel, Reference};
use flexbody_motion::dynamics::{Orientation, RotationVector};
use flexbody_motion::scene::{Axes, Drive, Scene, VectorHistory};
use nalgebra::{Matrix3, Vector3};

/// A rotation or reflection of the world, and one of the model with a shift.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Rotation or reflection of the world axes.
    pub world: Matrix3<f64>,
    /// Rotation or reflection of the model axes.
    pub model: Matrix3<f64>,
    /// Coordinates of the old origin of the model.
    pub shift: Vector3<f64>,
}

impl Motion {
    /// Returns a rotation of the world alone.
    pub fn of_world(world: Matrix3<f64>) -> Self {
        Self { world, model: Matrix3::identity(), shift: Vector3::zeros() }
    }

    /// Returns a rotation and a shift of the model alone.
    pub fn of_model(model: Matrix3<f64>, shift: Vector3<f64>) -> Self {
        Self { world: Matrix3::identity(), model, shift }
    }

    /// Returns the matrix for vectors along these axes; axial vectors change sign under reflection.
    fn of(&self, axes: Axes, axial: bool) -> Matrix3<f64> {
        let matrix = if axes == Axes::World { self.world } else { self.model };
        if axial { matrix * matrix.determinant() } else { matrix }
    }

    /// Returns the subject after the motion.
    pub fn applied(&self, subject: &Subject) -> Subject {
        let mut moved = subject.clone();
        moved.scene = self.scene(&subject.scene);
        if self.model != Matrix3::identity() || self.shift != Vector3::zeros() {
            moved.raw = self.raw(&subject.raw);
        }
        moved
    }

    fn place(&self, x: [f64; 3]) -> [f64; 3] {
        (self.model * Vector3::from(x) + self.shift).into()
    }

    fn raw(&self, raw: &RawModel) -> RawModel {
        let mut moved = raw.clone();
        moved.nodes.positions.iter_mut().for_each(|x| *x = self.place(*x));
        for set in &mut moved.data.interfaces {
            if let Reference::Point(x) = set.reference {
                set.reference = Reference::Point(self.place(x));
            }
        }
        moved.data.recoveries = recoveries::moved(raw, &self.model, |x| self.place(x));
        moved.data.named_loads = named_loads::turned(raw, &self.model);
        moved.followers = carried_mass::moved(raw, &self.model, |x| self.place(x));
        if self.model != Matrix3::identity() {
            let turned = |matrix: &RawMatrix| RawMatrix {
                matrix: conjugated(raw, &matrix.matrix, &self.model),
                ..matrix.clone()
            };
            (moved.stiffness, moved.mass) = (turned(&raw.stiffness), turned(&raw.mass));
            if let Some(Damping::Matrix(matrix)) = &raw.data.damping {
                moved.data.damping = Some(Damping::Matrix(turned(matrix)));
            }
            moved.data.geometric_stiffness = geometric(raw, &self.model);
        }
        moved
    }

    fn attitude(&self, rotation: &Vector3<f64>) -> Vector3<f64> {
        RotationVector::of_axes(&(self.world * RotationVector(*rotation).axes() * self.model.transpose())).0
    }

    fn scene(&self, scene: &Scene) -> Scene {
        let mut moved = scene.clone();
        let initial = &mut moved.initial;
        initial.rotation = self.attitude(&initial.rotation);
        let axes = self.world * start_axes(scene) * self.model.transpose();
        initial.origin = self.world * initial.origin - axes * self.shift;
        initial.velocity = self.world * initial.velocity;
        initial.angular_velocity = self.of(initial.axes, true) * initial.angular_velocity;
        moved.gravity = scene.gravity.map(|gravity| self.world * gravity);
        for load in moved.loads.iter_mut().filter(|load| !load.is_named()) {
            load.force = load.force.turned(&self.of(load.axes, false));
            load.torque = load.torque.turned(&self.of(load.axes, true));
        }
        let turn =
            |velocity: &mut VectorHistory, axes: Axes| *velocity = velocity.turned(&self.of(axes, true));
        let start =
            |start: &mut Option<RotationVector>| *start = start.map(|s| RotationVector(self.attitude(&s.0)));
        if let Some(spin) = &mut moved.spin {
            turn(&mut spin.velocity, spin.axes);
            start(&mut spin.start);
        }
        if let Some(carried) = &mut moved.carried {
            if let Some(spin) = &mut carried.spin {
                turn(&mut spin.velocity, spin.axes);
                start(&mut spin.start);
                spin.through = spin.through.map(|x| self.model * x + self.shift);
            }
            if let Some(Drive::Displacement(way) | Drive::Velocity(way) | Drive::Acceleration(way)) =
                &mut carried.translation
            {
                *way = way.turned(&self.world);
            }
        }
        // The attached inertia rotates with the body.
        let inertia = &mut moved.requirements.attachment.inertia;
        *inertia = self.model * *inertia * self.model.transpose();
        moved
    }
}
