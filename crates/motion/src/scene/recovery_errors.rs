//! Errors of recoveries: the distance between the rows of two motions, relative to the limits of a scene.

use super::row_extremes::{Directions, LargestSearch, LinearRows, Magnitude, RowExtreme};
use super::row_states::{RowSampler, SampledStates};
use super::{
    RecoveredMotion, RecoveryLimit, RecoveryTolerance, Resolution, RowLayout, RowMap, RowStates, Scene,
};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Recovery};
use flexbody_linalg::larger;
use flexbody_model::{RecoveryRow, pascals};

/// Recoveries with a limit along a motion, in the order of the limits of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct TracedRecoveries {
    /// Rows of every recovery, as maps of the states.
    pub maps: Vec<RowMap>,
    /// States at the instants of the motion.
    pub states: RowStates,
}

impl TracedRecoveries {
    /// Creates a history without instants for `body` in `scene`, both in one frame, with what samples its states; `None`
    /// for a scene without limits of recoveries.
    ///
    /// # Errors
    /// [`RecoveryUnknown`](Code::RecoveryUnknown) if the body does not have a recovery with a limit; FB212 for a limit
    /// whose unit is not that of the rows.
    pub(super) fn new(body: &FlexBody, scene: &Scene) -> Result<Option<(Self, RowSampler)>> {
        let limits = &scene.requirements.recoveries;
        if limits.is_empty() {
            return Ok(None);
        }
        let chosen = limits.iter().map(|limit| limited(body, limit)).collect::<Result<Vec<_>>>()?;
        let layout = RowLayout::new(body, chosen.iter().copied());
        let maps = chosen.iter().map(|one| RowMap::new(one, &layout)).collect();
        let sampler = RowSampler::new(layout.clone(), body, scene);
        Ok(Some((Self { maps, states: RowStates::new(layout) }, sampler)))
    }

    /// Returns these recoveries over a motion with other modal coordinates `q` and the same loads and spin, for a body
    /// whose rows are `own`.
    pub(super) fn with_coordinates(&self, own: Self, q: &[Vec<f64>]) -> Self {
        let mut states = RowStates::new(own.states.layout.clone());
        for (at, q) in q.iter().enumerate() {
            let z = own.states.layout.with_loads_of(&self.states.layout, self.states.state(at), q);
            states.push(self.states.times[at], &z);
        }
        Self { maps: own.maps, states }
    }

    /// Returns the number of bytes of an instant.
    pub(super) fn bytes_of_instant(&self) -> usize {
        size_of::<f64>() * (1 + self.states.layout.len())
    }

    /// Returns, for every mode of `body`, the largest part of its coordinate that is not the static response to the
    /// loads and the spin at that instant.
    pub fn dynamic_amplitudes(&self, body: &FlexBody) -> Vec<f64> {
        let follows = self.states.layout.static_coordinates(&body.static_modal_coordinates());
        let mut largest = vec![0.0f64; body.n_modes()];
        for z in self.states.iter() {
            for (j, largest) in largest.iter_mut().enumerate() {
                let still: f64 = z.iter().enumerate().map(|(c, z)| follows[(j, c)] * z).sum();
                *largest = larger(*largest, (z[1 + j] - still).abs());
            }
        }
        largest
    }
}

/// Returns the recovery of `body` that has a limit.
fn limited<'b>(body: &'b FlexBody, tolerance: &RecoveryTolerance) -> Result<&'b Recovery> {
    let name = &tolerance.recovery;
    let Some(found) = body.recoveries().iter().find(|recovery| recovery.name == *name) else {
        let known: Vec<&str> = body.recoveries().iter().map(|recovery| recovery.name.as_str()).collect();
        let has =
            if known.is_empty() { "it has none".to_owned() } else { format!("it has {}", known.join(", ")) };
        let message =
            format!("[tolerance] limits the error of recovery `{name}`, which the body does not have: {has}");
        return Err(Diagnostic::new(Code::RecoveryUnknown, message)
            .with_help("convert a model whose manifest has this [[recovery]], or remove the limit")
            .into());
    };
    if let RecoveryLimit::Absolute { unit, .. } = &tolerance.limit
        && let Some(row) = found.rows.iter().find(|row| factor(unit, &row.unit).is_none())
    {
        let message = format!(
            "the limit of recovery `{name}` is in `{unit}`, but its row `{}` is in `{}`",
            row.name, row.unit
        );
        return Err(Diagnostic::new(Code::SceneBody, message)
            .with_help("give the limit in the unit of the rows, or as a part of the largest value")
            .into());
    }
    Ok(found)
}

/// Returns the factor from values in `from` to values in `to`; `None` if the units are not known to be of one kind.
fn factor(from: &str, to: &str) -> Option<f64> {
    if from == to { Some(1.0) } else { Some(pascals(from)? / pascals(to)?) }
}

/// Limits of the errors of recoveries along a reference motion.
#[derive(Debug, Clone)]
pub struct RecoveryMeasure {
    recoveries: Vec<MeasuredRecovery>,
}

/// Recovery whose error is measured.
#[derive(Debug, Clone)]
struct MeasuredRecovery {
    map: RowMap,
    n_modes: usize,
    static_columns: bool,
    groups: Vec<RowGroup>,
}

/// Rows of one quantity and unit, or points with all six stresses, whose errors have one scale.
#[derive(Debug, Clone)]
struct RowGroup {
    magnitude: Magnitude,
    /// Rows or points.
    places: Vec<usize>,
    limit: Limit,
    /// Largest value of the reference motion.
    largest: f64,
    /// Largest value for |Lambda^(1/2) q| = 1.
    reach: f64,
}

/// Limit of the errors of a group.
#[derive(Debug, Clone, Copy)]
enum Limit {
    /// Part of the largest value, which counts as `least` at least.
    Relative {
        part: f64,
        least: f64,
    },
    Absolute(f64),
}

impl RowGroup {
    /// Returns the largest allowed error, if the largest value of the reference may be smaller by `uncertain`.
    fn allowed(&self, uncertain: f64) -> f64 {
        match self.limit {
            Limit::Relative { part, least } => part * (self.largest - uncertain).max(least),
            Limit::Absolute(value) => value,
        }
    }
}

impl RecoveryMeasure {
    /// Creates the measure for a reference motion of `body`; `None` for a scene without limits of recoveries.
    pub fn new(body: &FlexBody, scene: &Scene, reference: Option<&TracedRecoveries>) -> Option<Self> {
        let reference = reference?;
        let maps: Vec<&RowMap> = reference.maps.iter().collect();
        let states = Some(reference.states.sampled());
        let limits = &scene.requirements.recoveries;
        Some(Self::of_maps(body, limits.iter().zip(maps), states))
    }

    /// Creates the measure for the motion `recovered` of `body`, or for a motion of unknown size; `None` for a scene
    /// without limits of recoveries.
    pub fn of_recording(body: &FlexBody, scene: &Scene, recovered: Option<&RecoveredMotion>) -> Option<Self> {
        let limits = &scene.requirements.recoveries;
        if limits.is_empty() {
            return None;
        }
        let own: Vec<RowMap> = match recovered {
            Some(motion) => motion.recoveries.clone(),
            None => {
                let layout = RowLayout::new(body, body.recoveries());
                body.recoveries().iter().map(|recovery| RowMap::new(recovery, &layout)).collect()
            }
        };
        let named = limits
            .iter()
            .filter_map(|limit| Some((limit, own.iter().find(|map| map.name == limit.recovery)?)));
        let states = recovered.map(|motion| motion.states.sampled());
        Some(Self::of_maps(body, named, states))
    }

    fn of_maps<'r>(
        body: &FlexBody,
        limits: impl Iterator<Item = (&'r RecoveryTolerance, &'r RowMap)>,
        states: Option<SampledStates<'_>>,
    ) -> Self {
        let limits: Vec<_> = limits.collect();
        let places = limits.iter().map(|(_, map)| map.rows.len()).sum();
        let directions = states.and_then(|states| Directions::new(states, places));
        // A limit of a stress holds however small the deflections are.
        let rounding = Resolution::root_energy_of_rounding(body);
        let unit_energy: Vec<f64> =
            body.modes().eigenvalue.iter().map(|lambda| 1.0 / lambda.sqrt()).collect();
        let measured = |(limit, map): (&RecoveryTolerance, &'r RowMap)| {
            let groups = groups_of(map).into_iter().map(|(magnitude, places)| {
                let rows = LinearRows::of(map);
                let largest = states.map_or(0.0, |states| {
                    let search = LargestSearch {
                        magnitude,
                        rows,
                        states,
                        directions: directions.as_ref(),
                        between: true,
                    };
                    largest_of(&search, &places, |_| {})
                });
                let of_place = |place: &usize| {
                    let forms = magnitude.forms(&rows, *place);
                    let square = |j: usize| -> f64 {
                        (0..forms.nrows()).map(|i| (forms[(i, 1 + j)] * unit_energy[j]).powi(2)).sum()
                    };
                    (0..unit_energy.len()).map(square).sum::<f64>().sqrt()
                };
                let reach = places.iter().map(of_place).fold(0.0, larger);
                let unit = &map.rows[first_row(map, magnitude, places[0])].unit;
                let limit = match &limit.limit {
                    RecoveryLimit::Relative(part) => {
                        Limit::Relative { part: *part, least: reach * 2f64.sqrt() * rounding }
                    }
                    RecoveryLimit::Absolute { value, unit: of_value } => {
                        Limit::Absolute(value * factor(of_value, unit).unwrap_or(1.0))
                    }
                };
                RowGroup { magnitude, places, limit, largest, reach }
            });
            MeasuredRecovery {
                groups: groups.collect(),
                n_modes: body.n_modes(),
                static_columns: limit.static_columns,
                map: map.clone(),
            }
        };
        Self { recoveries: limits.into_iter().map(measured).collect() }
    }

    /// Returns the names of the recoveries.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.recoveries.iter().map(|recovery| recovery.map.name.as_str())
    }

    /// Returns the errors of `candidate` over time, relative to the limits, at the instants of `reference`. They are
    /// infinite for a candidate without these recoveries. Between the largest errors the values are lower bounds.
    pub fn errors(&self, reference: &TracedRecoveries, candidate: Option<&TracedRecoveries>) -> Vec<f64> {
        let times = &reference.states.times;
        let Some(candidate) = candidate else { return vec![f64::INFINITY; times.len()] };
        let (own, other) = (candidate.states.sampled(), reference.states.sampled());
        let joined: Vec<f64> =
            own.iter().zip(other.iter()).flat_map(|(a, b)| a.iter().chain(b)).copied().collect();
        let difference = |(at, one): (usize, &MeasuredRecovery)| {
            let (a, b) = (&candidate.maps[at].matrix, &reference.maps[at].matrix);
            let superposed = 1 + candidate.states.layout.modes();
            Mat::from_fn(a.nrows(), own.width + other.width, |i, c| match c.checked_sub(own.width) {
                Some(c) => -b[(i, c)],
                None if c < superposed || one.static_columns => a[(i, c)],
                None => 0.0,
            })
        };
        let differences: Vec<Mat<f64>> = self.recoveries.iter().enumerate().map(difference).collect();
        self.of_differences(&differences, times, &joined)
    }

    /// Returns errors over time, relative to the limits.
    ///
    /// * `differences`: for each recovery, coefficients (rows x k) of the difference of its rows.
    /// * `states`: k numbers at each of `times`, one instant after the other.
    pub fn of_differences(&self, differences: &[Mat<f64>], times: &[f64], states: &[f64]) -> Vec<f64> {
        let width = states.len() / times.len().max(1);
        let states = SampledStates { times, values: states, width };
        let mut history = vec![0.0; times.len()];
        if times.is_empty() || width == 0 {
            return history;
        }
        let places = self
            .recoveries
            .iter()
            .flat_map(|recovery| &recovery.groups)
            .map(|group| group.places.len())
            .sum();
        let directions = Directions::new(states, places);
        for (one, matrix) in self.recoveries.iter().zip(differences) {
            let rows = LinearRows { matrix: matrix.as_ref(), points: &one.map.points };
            for group in &one.groups {
                let magnitude = group.magnitude;
                let search = LargestSearch {
                    magnitude,
                    rows,
                    states,
                    directions: directions.as_ref(),
                    between: false,
                };
                let allowed = group.allowed(0.0);
                largest_of(&search, &group.places, |values| raise(&mut history, values, allowed));
            }
        }
        history
    }

    /// Returns errors, relative to the limits, of every column of the given differences of rows.
    ///
    /// * `rows`: for each recovery, differences of its rows (rows x instants).
    pub fn of_rows(&self, rows: &[Mat<f64>]) -> Vec<f64> {
        let instants = rows.first().map_or(0, Mat::ncols);
        let mut history = vec![0.0; instants];
        for (one, matrix) in self.recoveries.iter().zip(rows) {
            let linear = LinearRows { matrix: matrix.as_ref(), points: &one.map.points };
            for group in &one.groups {
                let allowed = group.allowed(0.0);
                for &place in &group.places {
                    raise(&mut history, &magnitudes(group.magnitude, &linear, place), allowed);
                }
            }
        }
        history
    }

    /// Returns the rows of the recovery `at` in the states z of `candidate` at the given instants, with or without its
    /// static columns as the limit states.
    pub fn rows_of(
        &self,
        at: usize,
        candidate: &TracedRecoveries,
        instants: std::ops::Range<usize>,
    ) -> Mat<f64> {
        let (matrix, layout) = (&candidate.maps[at].matrix, &candidate.states.layout);
        let count = if self.recoveries[at].static_columns { layout.len() } else { 1 + layout.modes() };
        let z = Mat::from_fn(count, instants.len(), |c, i| candidate.states.state(instants.start + i)[c]);
        matrix.as_ref().subcols(0, count) * z
    }

    /// Returns the difference of the recovery `at` between displacements with the `rows` (rows x k) beyond the modes and the
    /// static columns of the body: coefficients of k amplitudes and of the numbers of a state after its modal coordinates.
    pub fn beyond_columns(&self, at: usize, rows: &Mat<f64>) -> Mat<f64> {
        let one = &self.recoveries[at];
        let first = 1 + one.n_modes;
        let columns = one.map.matrix.ncols() - first;
        Mat::from_fn(rows.nrows(), rows.ncols() + columns, |i, c| match c.checked_sub(rows.ncols()) {
            None => rows[(i, c)],
            Some(c) if one.static_columns => -one.map.matrix[(i, first + c)],
            Some(_) => 0.0,
        })
    }

    /// Returns a bound of the errors, relative to the limits, of a motion whose deformation e differs from the reference by
    /// |Lambda^(1/2) e| = `energy`, with the same loads and spin.
    pub fn bound(&self, energy: f64) -> f64 {
        let of_group = |group: &RowGroup| {
            let error = group.reach * energy;
            if error == 0.0 { 0.0 } else { error / group.allowed(error) }
        };
        self.recoveries.iter().flat_map(|recovery| &recovery.groups).map(of_group).fold(0.0, larger)
    }

    /// Returns the largest contribution of every mode over its limit.
    ///
    /// * `whole`, `dynamic`: largest coordinate of every mode, and its part beyond the static response to the loads and
    ///   the spin, which is what a body with static columns lacks without the mode.
    pub fn contributions(&self, whole: &[f64], dynamic: &[f64]) -> Vec<f64> {
        let mut most = vec![0.0; whole.len()];
        for recovery in &self.recoveries {
            let rows = LinearRows::of(&recovery.map);
            let amplitudes = if recovery.static_columns { dynamic } else { whole };
            for group in &recovery.groups {
                let allowed = group.allowed(0.0);
                for &place in &group.places {
                    let values = magnitudes(group.magnitude, &rows, place);
                    for ((most, value), amplitude) in most.iter_mut().zip(&values[1..]).zip(amplitudes) {
                        *most = larger(*most, value * amplitude / allowed);
                    }
                }
            }
        }
        most
    }
}

/// Returns the groups of rows and points of a recovery.
fn groups_of(map: &RowMap) -> Vec<(Magnitude, Vec<usize>)> {
    let mut of_points = vec![false; map.rows.len()];
    map.points.iter().flat_map(|point| point.rows).flatten().for_each(|row| of_points[row] = true);
    let apart = |group: Vec<usize>| group.into_iter().filter(|row| !of_points[*row]).collect::<Vec<usize>>();
    let groups = RecoveryRow::by_unit(&map.rows).into_iter().map(apart).filter(|rows| !rows.is_empty());
    let points = (!map.points.is_empty()).then(|| (Magnitude::VonMises, (0..map.points.len()).collect()));
    points.into_iter().chain(groups.map(|rows| (Magnitude::Row, rows))).collect()
}

/// Returns a row of a place.
fn first_row(map: &RowMap, magnitude: Magnitude, place: usize) -> usize {
    if magnitude == Magnitude::Row { place } else { map.points[place].first_row() }
}

/// Returns the largest magnitude at any of `places`.
fn largest_of(search: &LargestSearch<'_>, places: &[usize], see: impl FnMut(&[f64])) -> f64 {
    let mut best: Option<RowExtreme> = None;
    search.raise(places.iter().copied(), &mut best, see);
    best.map_or(0.0, |best| best.value.abs())
}

/// Returns the magnitude of one place in every column of the rows.
fn magnitudes(magnitude: Magnitude, rows: &LinearRows<'_>, place: usize) -> Vec<f64> {
    let forms: Mat<f64> = magnitude.forms(rows, place);
    let forms: MatRef<'_, f64> = forms.as_ref();
    (0..forms.ncols()).map(|c| magnitude.of(&forms.col(c).iter().copied().collect::<Vec<_>>())).collect()
}

/// Raises a history to the values over what is allowed.
fn raise(history: &mut [f64], values: &[f64], allowed: f64) {
    for (most, value) in history.iter_mut().zip(values) {
        *most = larger(*most, if *value == 0.0 { 0.0 } else { value / allowed });
    }
}
