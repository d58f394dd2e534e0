//! Vector functions of time.

use super::samples::Samples;
use super::{History, Sizes};
use nalgebra::{Matrix3, Vector3};

/// A vector as a function of time.
#[derive(Debug, Clone, PartialEq)]
pub enum VectorHistory {
    /// Constant direction times a history of its value.
    Along {
        /// Direction, of any length.
        direction: Vector3<f64>,
        /// Value over time.
        factor: History,
    },
    /// Three components, each with a history of its own.
    Columns(Samples<3>),
}

/// Value, rate and second derivative at a time.
type Derivatives = [Vector3<f64>; 3];

impl VectorHistory {
    /// Returns the zero vector at all times.
    pub fn nothing() -> Self {
        Self::constant(Vector3::zeros())
    }

    /// Returns a constant vector.
    pub fn constant(direction: Vector3<f64>) -> Self {
        Self::Along { direction, factor: History::Constant(1.0) }
    }

    /// Returns true if the vector is zero at all times.
    pub fn is_nothing(&self) -> bool {
        match self {
            Self::Along { direction, .. } => *direction == Vector3::zeros(),
            Self::Columns(columns) => columns.rows().all(|(_, row)| row == Vector3::zeros()),
        }
    }

    /// Returns the vector and its rate at a time. At a kink the rate is that after it.
    pub fn at(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Along { direction, .. } if *direction == Vector3::zeros() => (*direction, *direction),
            Self::Along { direction, factor } => {
                let (value, rate) = factor.at(time);
                (direction * value, direction * rate)
            }
            Self::Columns(columns) => {
                let sample = columns.at(time);
                (sample.value, sample.rate)
            }
        }
    }

    /// Returns the vector, its rate and its second derivative at a time, for a smooth history.
    pub fn derivatives(&self, time: f64) -> Derivatives {
        match self {
            Self::Along { direction, factor } => {
                let (value, rate) = factor.at(time);
                [direction * value, direction * rate, direction * factor.curvature(time)]
            }
            Self::Columns(columns) => {
                let sample = columns.at(time);
                [sample.value, sample.rate, sample.second]
            }
        }
    }

    /// Returns the integral from time zero to a time.
    pub fn integral(&self, time: f64) -> Vector3<f64> {
        match self {
            Self::Along { direction, factor } => direction * factor.integral(time),
            Self::Columns(columns) => columns.integral(time),
        }
    }

    /// Returns the times at which the history is not smooth.
    pub fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Along { factor, .. } => factor.breaks(),
            Self::Columns(columns) => columns.breaks(),
        }
    }

    /// Returns the constant direction; `None` if the direction may change.
    pub fn direction(&self) -> Option<&Vector3<f64>> {
        match self {
            Self::Along { direction, .. } => Some(direction),
            Self::Columns(_) => None,
        }
    }

    /// Returns a direction of the vector: the constant one, or that of the longest row. Returns `None` for
    /// a zero vector.
    pub fn main_direction(&self) -> Option<Vector3<f64>> {
        let longest = match self {
            Self::Along { direction, .. } => *direction,
            Self::Columns(columns) => {
                let rows = columns.rows().map(|(_, row)| row);
                rows.reduce(|a, b| if b.norm_squared() > a.norm_squared() { b } else { a })?
            }
        };
        longest.try_normalize(0.0)
    }

    /// Returns directions that span all values: the constant direction, or the axes of the components that
    /// are not always zero.
    pub fn directions(&self) -> Vec<Vector3<f64>> {
        match self {
            Self::Along { direction, .. } => vec![*direction],
            Self::Columns(_) => {
                (0..3).filter(|&k| self.has_component(k)).map(|k| Vector3::ith(k, 1.0)).collect()
            }
        }
    }

    /// Returns true if a component is not always zero.
    pub fn has_component(&self, component: usize) -> bool {
        match self {
            Self::Along { direction, .. } => direction[component] != 0.0,
            Self::Columns(columns) => columns.rows().any(|(_, row)| row[component] != 0.0),
        }
    }

    /// Returns the largest length of the vector and of its rate from time zero to a time.
    pub fn largest_until(&self, end: f64) -> (f64, f64) {
        match self {
            Self::Along { direction, factor } => {
                let ((value, rate), length) = (factor.largest_until(end), direction.norm());
                (length * value, length * rate)
            }
            Self::Columns(columns) => {
                let Sizes { largest, rate, .. } = columns.sizes_until(end);
                (largest, rate)
            }
        }
    }

    /// Returns the largest magnitudes of the components, and of their rates, from time zero to a time.
    pub fn components_until(&self, end: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Along { direction, factor } => {
                let (value, rate) = factor.largest_until(end);
                (direction.abs() * value, direction.abs() * rate)
            }
            Self::Columns(columns) => {
                let sizes = [0, 1, 2].map(|k| columns.component(k).sizes_until(end));
                (Vector3::from(sizes.map(|s| s.largest)), Vector3::from(sizes.map(|s| s.rate)))
            }
        }
    }

    /// Returns true if the vector is zero from time zero to a time.
    pub fn is_zero_until(&self, end: f64) -> bool {
        match self {
            Self::Along { direction, factor } => *direction == Vector3::zeros() || factor.is_zero_until(end),
            Self::Columns(columns) => columns.is_zero_until(end),
        }
    }

    /// Returns the frequency of the fastest part, in oscillations per time; zero without oscillation.
    pub fn frequency_until(&self, end: f64) -> f64 {
        match self {
            Self::Along { factor, .. } => factor.frequency_until(end),
            Self::Columns(columns) => columns.frequency_until(end),
        }
    }

    /// Returns the shortest spacing of rows between which the history is smooth; `None` if the breaks
    /// already give the shortest time of change.
    pub fn spacing(&self) -> Option<f64> {
        match self {
            Self::Along { factor: History::Samples(samples), .. } => samples.smooth_spacing(),
            Self::Along { .. } => None,
            Self::Columns(columns) => columns.smooth_spacing(),
        }
    }

    /// Returns true if the history has two derivatives everywhere except at its ends.
    pub fn is_smooth(&self) -> bool {
        match self {
            Self::Along { factor, .. } => factor.is_smooth(),
            Self::Columns(columns) => columns.is_smooth(),
        }
    }

    /// Returns the vector multiplied by a matrix.
    pub fn turned(&self, matrix: &Matrix3<f64>) -> Self {
        match self {
            Self::Along { direction, factor } => {
                Self::Along { direction: matrix * direction, factor: factor.clone() }
            }
            Self::Columns(columns) => Self::Columns(columns.turned(matrix)),
        }
    }

    /// Returns the vector multiplied by a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Along { direction, factor: own } => {
                Self::Along { direction: *direction, factor: own.scaled(factor) }
            }
            Self::Columns(columns) => Self::Columns(columns.scaled(factor)),
        }
    }
}
