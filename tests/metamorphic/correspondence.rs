//! Relations between outputs of a transformed subject and outputs of the original.

use crate::outputs::{Along, Output, Values};
use nalgebra::{Matrix3, Vector3};

/// Map from the outputs of the original to those of the transformed subject.
#[derive(Debug, Clone)]
pub struct Correspondence {
    /// Rotation or reflection of the world.
    pub world: Matrix3<f64>,
    /// Rotation or reflection of the model.
    pub model: Matrix3<f64>,
    /// Position at time zero, velocity and acceleration of the old origin of the world.
    pub shift: [Vector3<f64>; 3],
    /// Ratios of the new to the original numbers of a length, a mass and a time.
    pub units: [f64; 3],
    /// Number of output times of the original before the first of the transformed subject.
    pub skipped: usize,
    /// Number of output times of the transformed subject before the first of the original.
    pub delayed: usize,
    /// Number of output times of the transformed subject per one of the original.
    pub finer: usize,
    /// True if the largest values of the whole motion correspond.
    pub whole: bool,
    /// Largest difference, relative to the size of the output.
    pub allowed: f64,
}

/// Largest relative difference of motions integrated with other steps, or of models with rounded matrices.
pub const INTEGRATED: f64 = 2e-7;

impl Default for Correspondence {
    fn default() -> Self {
        Self {
            world: Matrix3::identity(),
            model: Matrix3::identity(),
            shift: [Vector3::zeros(); 3],
            units: [1.0; 3],
            skipped: 0,
            delayed: 0,
            finer: 1,
            whole: true,
            allowed: INTEGRATED,
        }
    }
}

impl Correspondence {
    /// Returns the factor of a quantity with these exponents of length, mass and time.
    fn factor(&self, unit: [i32; 3]) -> f64 {
        self.units.iter().zip(unit).map(|(factor, exponent)| factor.powi(exponent)).product()
    }

    /// Returns the matrix for vectors along these axes.
    fn turn(&self, along: Along, axial: bool) -> Matrix3<f64> {
        let matrix = if along == Along::World { self.world } else { self.model };
        if axial { matrix * matrix.determinant() } else { matrix }
    }

    /// Returns the values that the transformed subject must have, from those of the original at its times.
    pub fn expected(&self, output: &Output, times: &[f64]) -> Values {
        let factor = self.factor(output.unit);
        let [place, velocity, acceleration] = self.shift;
        match &output.values {
            Values::Numbers(numbers) => Values::Numbers(numbers.iter().map(|x| x * factor).collect()),
            Values::Facts(facts) => Values::Facts(facts.clone()),
            Values::Attitudes(axes) => {
                Values::Attitudes(axes.iter().map(|a| self.world * a * self.model.transpose()).collect())
            }
            Values::Vectors { along, axial, rates } => {
                let turn = self.turn(*along, *axial) * factor;
                let moved = |(x, t): (&Vector3<f64>, &f64)| match output.derivative {
                    Some(0) => turn * x + place + velocity * *t + acceleration * (0.5 * t * t),
                    Some(1) => turn * x + velocity + acceleration * *t,
                    Some(_) => turn * x + acceleration,
                    None => turn * x,
                };
                let rates = match output.derivative {
                    Some(_) => rates.iter().zip(times).map(moved).collect(),
                    None => rates.iter().map(|x| turn * x).collect(),
                };
                Values::Vectors { along: *along, axial: *axial, rates }
            }
        }
    }

    /// Returns the number below which differences of this output do not count.
    pub fn least(&self, output: &Output) -> f64 {
        output.least * self.factor(output.unit)
    }
}
