//! Outputs of a command in a form to which transformations apply.

use crate::correspondence::Correspondence;
use nalgebra::{Matrix3, Vector3};

/// Axes of a vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// Axes that are fixed in space.
    World,
    /// Axes of the model, which turn with the body.
    Model,
}

/// Values of an output, at each output time or once.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Vectors; axial vectors change sign under reflection.
    Vectors {
        /// Axes of the components.
        along: Along,
        /// True for angular velocities and torques.
        axial: bool,
        /// Vector at each output time.
        rates: Vec<Vector3<f64>>,
    },
    /// Rotations from model axes to world axes.
    Attitudes(Vec<Matrix3<f64>>),
    /// Numbers without direction.
    Numbers(Vec<f64>),
    /// Decisions, counts and codes of findings, in words.
    Facts(String),
}

/// An output of a command.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name of the output.
    pub name: String,
    /// Exponents of length, mass and time.
    pub unit: [i32; 3],
    /// Values of the output.
    pub values: Values,
    /// Number of time derivatives of a world position; `None` for quantities that do not move with the world.
    pub derivative: Option<u8>,
    /// Smallest scale for relative differences.
    pub least: f64,
    /// True if there is a value for each output time.
    pub by_instant: bool,
    /// Factor of the allowed difference.
    pub slack: f64,
}

/// All outputs of a command.
#[derive(Debug, Clone, Default)]
pub struct Outputs {
    /// Output times.
    pub times: Vec<f64>,
    /// Outputs of the command.
    pub all: Vec<Output>,
}

/// A difference between two subjects that must agree.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// Name of the output.
    pub output: String,
    /// Difference divided by the allowed difference.
    pub size: f64,
    /// The two values, in words.
    pub detail: String,
}

impl Values {
    /// Returns one of every `every` values from `first` on, at most `count`.
    fn picked(&self, first: usize, every: usize, count: usize) -> Self {
        fn some<T: Clone>(all: &[T], first: usize, every: usize, count: usize) -> Vec<T> {
            all.iter().skip(first).step_by(every).take(count).cloned().collect()
        }
        match self {
            Self::Vectors { along, axial, rates } => {
                Self::Vectors { along: *along, axial: *axial, rates: some(rates, first, every, count) }
            }
            Self::Attitudes(all) => Self::Attitudes(some(all, first, every, count)),
            Self::Numbers(all) => Self::Numbers(some(all, first, every, count)),
            Self::Facts(facts) => Self::Facts(facts.clone()),
        }
    }

    /// Returns the number of values.
    fn len(&self) -> usize {
        match self {
            Self::Vectors { rates, .. } => rates.len(),
            Self::Attitudes(all) => all.len(),
            Self::Numbers(all) => all.len(),
            Self::Facts(_) => 1,
        }
    }

    /// Returns the size of the largest value.
    fn size(&self) -> f64 {
        let sizes: Vec<f64> = match self {
            Self::Vectors { rates, .. } => rates.iter().map(|x| x.norm()).collect(),
            Self::Attitudes(_) | Self::Facts(_) => vec![1.0],
            Self::Numbers(all) => all.iter().map(|x| x.abs()).collect(),
        };
        sizes.into_iter().fold(0.0, f64::max)
    }

    /// Returns the distances to other values.
    fn distances(&self, other: &Self) -> Vec<f64> {
        match (self, other) {
            (Self::Vectors { rates: a, .. }, Self::Vectors { rates: b, .. }) => {
                a.iter().zip(b).map(|(a, b)| (a - b).norm()).collect()
            }
            (Self::Attitudes(a), Self::Attitudes(b)) => {
                a.iter().zip(b).map(|(a, b)| (a - b).norm()).collect()
            }
            (Self::Numbers(a), Self::Numbers(b)) => a.iter().zip(b).map(|(a, b)| (a - b).abs()).collect(),
            (Self::Facts(a), Self::Facts(b)) => vec![if a == b { 0.0 } else { f64::INFINITY }],
            _ => vec![f64::INFINITY],
        }
    }

    /// Returns one value in words.
    fn word(&self, at: usize) -> String {
        match self {
            Self::Vectors { rates, .. } => format!("{:?}", rates[at].as_slice()),
            Self::Attitudes(all) => format!("{:?}", all[at].as_slice()),
            Self::Numbers(all) => format!("{:e}", all[at]),
            Self::Facts(facts) => facts.clone(),
        }
    }
}

impl Outputs {
    /// Returns the worst violation of `map` by the outputs `found` of a transformed subject, among outputs
    /// for which `counts` returns true, and the largest difference over the allowed one.
    pub fn compare(
        &self,
        found: &Self,
        map: &Correspondence,
        counts: impl Fn(&str) -> bool,
    ) -> (f64, Option<Violation>) {
        let mut worst = (0.0f64, None);
        for own in self.all.iter().filter(|own| counts(&own.name)) {
            if !own.by_instant && !map.whole {
                continue;
            }
            let violation = match found.all.iter().find(|other| other.name == own.name) {
                Some(other) => self.compare_output(own, other, map),
                // Outputs of an enriched body have a longer name; enrichment itself may differ.
                None if found.all.iter().any(|other| other.name.starts_with(&own.name)) => continue,
                None => {
                    Violation { output: own.name.clone(), size: f64::INFINITY, detail: "missing".to_owned() }
                }
            };
            if violation.size > worst.0 || violation.size.is_nan() {
                worst = (violation.size, Some(violation));
            }
        }
        let violation = worst.1.filter(|violation| violation.size > 1.0 || violation.size.is_nan());
        (worst.0, violation)
    }

    fn compare_output(&self, own: &Output, other: &Output, map: &Correspondence) -> Violation {
        let Correspondence { skipped, delayed, finer, .. } = *map;
        let (mut a, mut b) = (own.clone(), other.values.clone());
        let mut times: Vec<f64> = self.times.clone();
        if own.by_instant {
            let count = own.values.len() - skipped;
            (a.values, times) = (a.values.picked(skipped, 1, count), times[skipped..].to_vec());
            b = b.picked(delayed, finer, count);
        }
        let wanted = map.expected(&a, &times);
        let scale = wanted.size().max(map.least(own));
        let allowed = map.allowed * own.slack * scale;
        let distances = wanted.distances(&b);
        let size = |distance: f64| match (distance == 0.0, allowed > 0.0) {
            (true, _) => 0.0,
            (_, true) => distance / allowed,
            _ => f64::INFINITY,
        };
        let same = if wanted.len() == b.len() { 0.0 } else { f64::INFINITY };
        let worst = (0..distances.len()).max_by(|&i, &j| distances[i].total_cmp(&distances[j]));
        let at = worst.unwrap_or(0);
        let detail = match worst {
            Some(at) => format!("at {at} of {}: expected {}, found {}", b.len(), wanted.word(at), b.word(at)),
            None => "no values".to_owned(),
        };
        let largest = distances.get(at).map_or(0.0, |distance| size(*distance));
        Violation { output: own.name.clone(), size: largest.max(same), detail }
    }
}
