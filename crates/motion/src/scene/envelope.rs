//! Largest stresses of every point of the recoveries, over one run or over several load cases.

use super::{Peak, PointEnvelope, RecoveredMotion, RowMap, StressPoint};

/// Largest stresses of the points of recoveries over one run, or over several load cases.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Names of the load cases; empty for a run that is no load case.
    pub cases: Vec<String>,
    /// Points of every recovery.
    pub recoveries: Vec<RecoveryEnvelope>,
}

/// Largest stresses of the points of one recovery.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveryEnvelope {
    /// Name of the recovery.
    pub name: String,
    /// Points with all six stresses.
    pub points: Vec<PointPeaks>,
}

/// Largest stresses of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct PointPeaks {
    /// Name of the point.
    pub name: String,
    /// Node of the point.
    pub node: Option<i64>,
    /// Element of the point.
    pub element: Option<i64>,
    /// Unit of the stresses.
    pub unit: String,
    /// Largest equivalent stress of von Mises.
    pub von_mises: CasePeak,
    /// Largest principal stress; zero if none is positive.
    pub largest_principal: CasePeak,
    /// Smallest principal stress; zero if none is negative.
    pub smallest_principal: CasePeak,
}

/// Extreme value with its time and load case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CasePeak {
    /// Value.
    pub value: f64,
    /// Time within the load case.
    pub time: f64,
    /// Index of the load case in [`Envelope::cases`]; zero for a run that is no load case.
    pub case: usize,
}

impl Envelope {
    /// Returns the envelope of a motion, of the load case `case` if there are several; `None` for a motion whose
    /// envelopes were not asked for.
    pub fn of(motion: &RecoveredMotion, case: Option<&str>) -> Option<Self> {
        let all = motion.envelopes.as_ref()?;
        let of_recovery = |(map, peaks): (&RowMap, &Vec<PointEnvelope>)| RecoveryEnvelope {
            name: map.name.clone(),
            points: map
                .points
                .iter()
                .zip(peaks)
                .map(|(point, own)| PointPeaks::new(map, point, own))
                .collect(),
        };
        Some(Self {
            cases: case.map(str::to_owned).into_iter().collect(),
            recoveries: motion.recoveries.iter().zip(all).map(of_recovery).collect(),
        })
    }

    /// Adds the envelope of further load cases of the same body; of two equal extremes the former is kept.
    pub fn join(&mut self, other: Self) {
        let first = self.cases.len();
        self.cases.extend(other.cases);
        for mut recovery in other.recoveries {
            for point in &mut recovery.points {
                for peak in
                    [&mut point.von_mises, &mut point.largest_principal, &mut point.smallest_principal]
                {
                    peak.case += first;
                }
            }
            match self.recoveries.iter_mut().find(|known| known.name == recovery.name) {
                Some(known) => known.join(recovery),
                None => self.recoveries.push(recovery),
            }
        }
    }

    /// Returns the name of the load case of an extreme; `None` for a run that is no load case.
    pub fn case_of(&self, peak: &CasePeak) -> Option<&str> {
        self.cases.get(peak.case).map(String::as_str)
    }
}

impl RecoveryEnvelope {
    fn join(&mut self, other: Self) {
        for (known, new) in self.points.iter_mut().zip(other.points) {
            known.von_mises.raise(new.von_mises, f64::gt);
            known.largest_principal.raise(new.largest_principal, f64::gt);
            known.smallest_principal.raise(new.smallest_principal, f64::lt);
        }
    }

    /// Returns the point of the largest equivalent stress; `None` without points.
    pub fn largest(&self) -> Option<&PointPeaks> {
        let larger = |best: Option<&PointPeaks>, own: &PointPeaks| {
            best.is_none_or(|best| own.von_mises.value > best.von_mises.value || own.von_mises.value.is_nan())
        };
        self.points.iter().fold(None, |best, own| if larger(best, own) { Some(own) } else { best })
    }
}

impl PointPeaks {
    fn new(map: &RowMap, point: &StressPoint, own: &PointEnvelope) -> Self {
        let row = &map.rows[point.first_row()];
        let peak = |sign: f64, peak: &Peak| CasePeak { value: sign * peak.value, time: peak.time, case: 0 };
        Self {
            name: point.name.clone(),
            node: row.node,
            element: row.element,
            unit: point.unit.clone(),
            von_mises: peak(1.0, &own.von_mises),
            largest_principal: peak(1.0, &own.tension),
            smallest_principal: peak(-1.0, &own.compression),
        }
    }
}

impl CasePeak {
    /// Takes `new` if it `exceeds` the value; NaN exceeds every number.
    fn raise(&mut self, new: Self, exceeds: fn(&f64, &f64) -> bool) {
        if exceeds(&new.value, &self.value) || new.value.is_nan() && !self.value.is_nan() {
            *self = new;
        }
    }
}
