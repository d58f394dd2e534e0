//! Largest rows and stresses of a recovery over a motion, or of the difference between two, without the evaluation of
//! all rows at all instants.
//!
//! A row is linear in the state z, and a stress measure of a point is bounded by a norm of few rows. With z = D U a and
//! the directions U in which the history Z varies (the eigenvectors of Z Z'/D^2, with eigenvalues s^2),
//!
//! ```text
//! |F_i z| <= sqrt(max_t sum_j a_j^2 / s_j^2) |F_i D U s|_F        and        |F_i z| <= | |F_i D U| max_t |a| |
//! ```
//!
//! hold at every instant. Rows and points are evaluated in descending order of the smaller bound, until the next bound
//! is below the largest value found.

use super::row_states::SampledStates;
use super::{Peak, RowLayout, RowMap, RowStates, StressPoint};
use faer::{Mat, MatRef};
use flexbody_linalg::{SymmetricEigen, parallel, symmetric_eigen};
use flexbody_model::RecoveryRow;
use strum::VariantArray;

/// Directions with a smaller part of the largest eigenvalue of the history are rounding: their part is bounded by
/// amplitudes alone.
const ROUNDING: f64 = 1e-24;

/// Relative margin for the rounding of a bound.
const MARGIN: f64 = 1e-9;

/// Largest magnitude of a row or of a stress measure, with its place and time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowExtreme {
    /// Index of the row, or of the point for stress measures.
    pub place: usize,
    /// Time.
    pub time: f64,
    /// Value, with its sign.
    pub value: f64,
}

/// Largest values of a recovery over a motion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RowExtremes {
    /// Row of the largest magnitude of each quantity and unit, in the order of [`RecoveryRow::by_unit`].
    pub rows: Vec<RowExtreme>,
    /// Point of the largest equivalent stress of von Mises; `None` without points.
    pub von_mises: Option<RowExtreme>,
    /// Point of the largest principal stress, if any is positive.
    pub tension: Option<RowExtreme>,
    /// Point of the smallest principal stress, if any is negative.
    pub compression: Option<RowExtreme>,
    /// Largest number of rows or points that one of these searches evaluated.
    pub evaluated: usize,
}

/// Rows as linear forms of states.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinearRows<'a> {
    /// Coefficients (rows x length of a state).
    pub matrix: MatRef<'a, f64>,
    /// Points with all six stresses among the rows.
    pub points: &'a [StressPoint],
}

impl<'a> LinearRows<'a> {
    pub(super) fn of(map: &'a RowMap) -> Self {
        Self { matrix: map.matrix.as_ref(), points: &map.points }
    }
}

/// Magnitude of a row, or of the stress at a point, that is searched. A norm of its linear forms bounds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, VariantArray)]
pub(super) enum Magnitude {
    Row,
    VonMises,
    Tension,
    Compression,
}

impl Magnitude {
    /// Returns the linear forms (k x length of z) of one place, whose norm is not below the measure.
    pub(super) fn forms(self, rows: &LinearRows<'_>, place: usize) -> Mat<f64> {
        let m = rows.matrix.ncols();
        if self == Self::Row {
            return Mat::from_fn(1, m, |_, c| rows.matrix[(place, c)]);
        }
        let [xx, yy, zz, xy, yz, xz] = rows.points[place].rows;
        let row = |i: Option<usize>, c: usize| i.map_or(0.0, |i| rows.matrix[(i, c)]);
        let (difference, shear) = (0.5f64.sqrt(), 3.0f64.sqrt());
        match self {
            // The sum of squares is the square of the equivalent stress.
            Self::VonMises => Mat::from_fn(6, m, |form, c| match form {
                0 => difference * (row(xx, c) - row(yy, c)),
                1 => difference * (row(yy, c) - row(zz, c)),
                2 => difference * (row(zz, c) - row(xx, c)),
                form => shear * row([xy, yz, xz][form - 3], c),
            }),
            // The Frobenius norm of the stress is not below any principal stress.
            _ => Mat::from_fn(6, m, |form, c| {
                let weight = if form < 3 { 1.0 } else { std::f64::consts::SQRT_2 };
                weight * row([xx, yy, zz, xy, yz, xz][form], c)
            }),
        }
    }

    /// Returns the measure of the values of all forms of a place; not negative.
    pub(super) fn of(self, forms: &[f64]) -> f64 {
        let weight = std::f64::consts::FRAC_1_SQRT_2;
        let principal = || {
            let s = |i: usize| if i < 3 { forms[i] } else { weight * forms[i] };
            StressPoint::principal_of(&[s(0), s(1), s(2), s(3), s(4), s(5)])
        };
        match self {
            Self::Row => forms[0].abs(),
            Self::VonMises => forms.iter().map(|v| v * v).sum::<f64>().sqrt(),
            Self::Tension => principal()[0].max(0.0),
            Self::Compression => (-principal()[2]).max(0.0),
        }
    }
}

/// Directions in which a history varies, and how far.
pub(super) struct Directions {
    /// D U (length of z x directions).
    vectors: Mat<f64>,
    /// Eigenvalues s^2.
    squares: Vec<f64>,
    /// Largest |a| of each direction.
    amplitudes: Vec<f64>,
    /// Largest sum of a^2 / s^2 over the directions above rounding.
    leverage: f64,
    /// Largest eigenvalue below which a direction is rounding.
    least: f64,
}

impl Directions {
    /// Returns the directions of a history, by which most of `places` need not be evaluated; `None` if it has numbers that
    /// are not finite, or if evaluating all places is cheaper: one takes a product for each number of a state, the
    /// directions take as many for each of these numbers.
    pub(super) fn new(states: SampledStates<'_>, places: usize) -> Option<Self> {
        let m = states.width;
        if places <= m {
            return None;
        }
        // Numbers of one size: unit and kind of the coordinates do not matter.
        let mut scale = vec![0.0f64; m];
        for z in states.iter() {
            scale.iter_mut().zip(z).for_each(|(most, z)| *most = most.max(z.abs()));
        }
        let used: Vec<usize> = (0..m).filter(|&c| scale[c] > 0.0).collect();
        let mut gram = Mat::<f64>::zeros(used.len(), used.len());
        for z in states.iter() {
            for (b, &cb) in used.iter().enumerate() {
                let right = z[cb] / scale[cb];
                for (a, &ca) in used[..=b].iter().enumerate() {
                    gram[(a, b)] += z[ca] / scale[ca] * right;
                }
            }
        }
        let gram = Mat::from_fn(used.len(), used.len(), |a, b| gram[(a.min(b), a.max(b))]);
        let SymmetricEigen { values: squares, vectors: turned } = symmetric_eigen(gram.as_ref())?;
        let least = ROUNDING * squares.iter().fold(0.0f64, |most, s| most.max(*s));
        // Amplitudes along the directions at every instant.
        let mut amplitudes = vec![0.0f64; used.len()];
        let mut leverage = 0.0f64;
        for z in states.iter() {
            let mut own = 0.0;
            for (j, most) in amplitudes.iter_mut().enumerate() {
                let a: f64 = used.iter().enumerate().map(|(p, &c)| turned[(p, j)] * z[c] / scale[c]).sum();
                *most = most.max(a.abs());
                if squares[j] > least {
                    own += a * a / squares[j];
                }
            }
            leverage = leverage.max(own);
        }
        let mut vectors = Mat::zeros(m, used.len());
        for (p, &c) in used.iter().enumerate() {
            (0..used.len()).for_each(|j| vectors[(c, j)] = scale[c] * turned[(p, j)]);
        }
        Some(Self { vectors, squares, amplitudes, leverage, least })
    }

    /// Returns a bound of the norm of F z at all instants, for forms F (k x length of z).
    fn bound(&self, forms: MatRef<'_, f64>) -> f64 {
        let along = forms * &self.vectors;
        let (mut of_amplitudes, mut of_energy) = (0.0, 0.0);
        let mut of_rounding = 0.0;
        for i in 0..along.nrows() {
            let (mut sum, mut rest) = (0.0, 0.0);
            for (j, amplitude) in self.amplitudes.iter().enumerate() {
                let part = along[(i, j)].abs() * amplitude;
                sum += part;
                if self.squares[j] > self.least {
                    of_energy += along[(i, j)].powi(2) * self.squares[j];
                } else {
                    rest += part;
                }
            }
            of_amplitudes += sum * sum;
            of_rounding += rest * rest;
        }
        let of_energy = (self.leverage * of_energy).sqrt() + of_rounding.sqrt();
        of_amplitudes.sqrt().min(of_energy) * (1.0 + MARGIN)
    }
}

/// Search for the extremes of recoveries over a history that arrives in pieces.
#[derive(Debug, Clone)]
pub struct ExtremeSearch {
    /// True if values between the instants are estimated by parabolas.
    between: bool,
    found: Vec<RowExtremes>,
}

impl ExtremeSearch {
    /// Creates a search over `recoveries` recoveries.
    ///
    /// * `between`: true to estimate the largest value between neighbouring instants, for a history that resolves every
    ///   oscillation.
    pub fn new(recoveries: usize, between: bool) -> Self {
        Self { between, found: vec![RowExtremes::default(); recoveries] }
    }

    /// Takes the next piece of the history.
    pub fn see(&mut self, maps: &[RowMap], states: &RowStates) {
        if states.times.is_empty() {
            return;
        }
        let states = states.sampled();
        let places = maps.iter().map(|map| map.rows.len() + map.points.len()).sum();
        let directions = Directions::new(states, places);
        for (map, found) in maps.iter().zip(&mut self.found) {
            let rows = LinearRows::of(map);
            for &magnitude in Magnitude::VARIANTS {
                let search = LargestSearch {
                    magnitude,
                    rows,
                    states,
                    directions: directions.as_ref(),
                    between: self.between,
                };
                let mut raise = |places: &[usize], best: &mut Option<RowExtreme>| {
                    let evaluated = search.raise(places.iter().copied(), best, |_| {});
                    found.evaluated = found.evaluated.max(evaluated);
                };
                let points: Vec<usize> = (0..map.points.len()).collect();
                match magnitude {
                    Magnitude::Row => {
                        let of_unit = |(at, places): (usize, Vec<usize>)| {
                            let mut best = found.rows.get(at).copied();
                            raise(&places, &mut best);
                            best
                        };
                        let groups = RecoveryRow::by_unit(&map.rows).into_iter().enumerate();
                        found.rows = groups.filter_map(of_unit).collect();
                    }
                    Magnitude::VonMises => raise(&points, &mut found.von_mises),
                    Magnitude::Tension => raise(&points, &mut found.tension),
                    Magnitude::Compression => raise(&points, &mut found.compression),
                }
            }
        }
    }

    /// Returns the extremes of every recovery.
    pub fn finish(self) -> Vec<RowExtremes> {
        self.found
    }
}

/// Search for the place with the largest magnitude over sampled states.
pub(super) struct LargestSearch<'a> {
    pub magnitude: Magnitude,
    pub rows: LinearRows<'a>,
    pub states: SampledStates<'a>,
    /// Directions of the states; `None` if nothing bounds the values.
    pub directions: Option<&'a Directions>,
    /// True if values between the instants are estimated by parabolas.
    pub between: bool,
}

impl LargestSearch<'_> {
    /// Raises `best` to the largest value at any of `places`. `see` receives the values of every evaluated place at all
    /// instants. Returns the number of evaluated places.
    pub(super) fn raise(
        &self,
        places: impl Iterator<Item = usize>,
        best: &mut Option<RowExtreme>,
        mut see: impl FnMut(&[f64]),
    ) -> usize {
        // Places in descending order of their bounds.
        let bound = |place: usize| {
            let forms = || self.magnitude.forms(&self.rows, place);
            (self.directions.map_or(f64::INFINITY, |known| known.bound(forms().as_ref())), place)
        };
        let mut places: Vec<(f64, usize)> = places.map(bound).collect();
        places.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // The largest value at an instant decides where to stop, the largest one between instants what is found.
        let mut sampled = 0.0f64;
        let mut evaluated = 0;
        for (bound, place) in places {
            let beaten =
                sampled.max(if self.between { 0.0 } else { best.map_or(0.0, |best| best.value.abs()) });
            if bound < beaten {
                break;
            }
            evaluated += 1;
            let own = self.place(place);
            see(&own.values);
            sampled = sampled.max(own.sampled);
            let first = matches!(self.magnitude, Magnitude::Row | Magnitude::VonMises);
            let is_larger = match best {
                None => first || own.extreme.value != 0.0,
                Some(best) => own.extreme.value.abs() > best.value.abs() || own.extreme.value.is_nan(),
            };
            if is_larger {
                *best = Some(own.extreme);
            }
        }
        evaluated
    }

    /// Evaluates a place at all instants.
    fn place(&self, place: usize) -> Place {
        let forms = self.magnitude.forms(&self.rows, place);
        let mut peak = Peak::default();
        let (mut sampled, mut sign, mut time) = (0.0, 1.0, self.states.times[0]);
        let mut own = vec![0.0; forms.nrows()];
        let mut values = Vec::with_capacity(self.states.times.len());
        for (z, &now) in self.states.iter().zip(self.states.times) {
            for (i, value) in own.iter_mut().enumerate() {
                *value = z.iter().enumerate().map(|(c, z)| forms[(i, c)] * z).sum();
            }
            let value = self.magnitude.of(&own);
            values.push(value);
            peak.see(now, value);
            if value > sampled || value.is_nan() {
                (sampled, time) = (value, now);
                sign = match self.magnitude {
                    Magnitude::Row => own[0].signum(),
                    Magnitude::Compression => -1.0,
                    _ => 1.0,
                };
            }
        }
        let (value, time) = if self.between { (peak.value, peak.time) } else { (sampled, time) };
        Place { extreme: RowExtreme { place, time, value: sign * value }, sampled, values }
    }
}

/// Values of a magnitude at one place.
struct Place {
    extreme: RowExtreme,
    /// Largest value at an instant.
    sampled: f64,
    /// Values at all instants.
    values: Vec<f64>,
}

/// Largest stresses of one point over a motion, each with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointEnvelope {
    /// Largest equivalent stress of von Mises.
    pub von_mises: Peak,
    /// Largest principal stress; zero if none is positive.
    pub tension: Peak,
    /// Magnitude of the smallest principal stress; zero if none is negative.
    pub compression: Peak,
}

impl PointEnvelope {
    /// Creates the envelope of a point over no instant.
    fn new() -> Self {
        Self { von_mises: Peak::default(), tension: Peak::default(), compression: Peak::default() }
    }

    /// Takes the states of a point whose stresses are `forms` (6 x length of z) times them, in the weights of
    /// [`Magnitude::Tension`].
    fn see(&mut self, forms: &Mat<f64>, states: &RowStates, between: bool) {
        let mut values = [0.0; 6];
        for (z, &time) in states.iter().zip(&states.times) {
            for (i, value) in values.iter_mut().enumerate() {
                *value = z.iter().enumerate().map(|(c, z)| forms[(i, c)] * z).sum();
            }
            let von_mises = von_mises_of(&values);
            if between {
                self.von_mises.see(time, von_mises)
            } else {
                raise(&mut self.von_mises, time, von_mises)
            }
            // The norm bounds the principal stresses, whose computation is the costly part.
            let norm = values.iter().map(|v| v * v).sum::<f64>().sqrt();
            if norm.is_nan() || norm > self.tension.value.min(self.compression.value) {
                raise(&mut self.tension, time, Magnitude::Tension.of(&values));
                raise(&mut self.compression, time, Magnitude::Compression.of(&values));
            }
        }
    }
}

/// Keeps the larger of a peak and a value at a time.
fn raise(peak: &mut Peak, time: f64, value: f64) {
    if value > peak.value || value.is_nan() {
        *peak = Peak::at(time, value);
    }
}

/// Returns the equivalent stress of the weighted stresses of [`Magnitude::Tension`].
fn von_mises_of([xx, yy, zz, xy, yz, xz]: &[f64; 6]) -> f64 {
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 1.5 * (xy * xy + yz * yz + xz * xz)).sqrt()
}

/// Largest stresses of every point of recoveries over a history that arrives in pieces.
#[derive(Debug, Clone)]
pub struct EnvelopeSearch {
    between: bool,
    found: Vec<Vec<PointEnvelope>>,
}

impl EnvelopeSearch {
    /// Creates a search for `recoveries`; `between` as for [`ExtremeSearch::new`].
    pub fn new(recoveries: &[RowMap], between: bool) -> Self {
        Self {
            between,
            found: recoveries
                .iter()
                .map(|recovery| vec![PointEnvelope::new(); recovery.points.len()])
                .collect(),
        }
    }

    /// Takes the next piece of the history.
    pub fn see(&mut self, maps: &[RowMap], states: &RowStates) {
        let between = self.between;
        for (map, found) in maps.iter().zip(&mut self.found) {
            let known = found.clone();
            let envelope = |point: usize| {
                let mut own = known[point];
                own.see(&Magnitude::Tension.forms(&LinearRows::of(map), point), states, between);
                own
            };
            *found = parallel::concat(known.len(), POINTS, |points| points.map(envelope).collect());
        }
    }

    /// Returns the envelopes of the points of every recovery.
    pub fn finish(self) -> Vec<Vec<PointEnvelope>> {
        self.found
    }
}

/// Number of points that one thread takes at once.
const POINTS: usize = 64;

/// Observer of a motion that keeps a piece of the history and searches it when it is full.
#[derive(Debug)]
pub(super) struct RowSurvey {
    piece: RowStates,
    search: ExtremeSearch,
    envelope: Option<EnvelopeSearch>,
    most: usize,
}

/// Number of values of a piece of the history: 32 MiB.
const PIECE: usize = 1 << 22;
/// Number of last instants that the next piece begins with, so that a peak between two pieces is found.
const OVERLAP: usize = 2;

impl RowSurvey {
    /// Creates an observer; `envelope` asks for the largest stresses of every point.
    pub(super) fn new(maps: &[RowMap], layout: RowLayout, envelope: bool) -> Self {
        let most = (PIECE / layout.len()).max(4 * OVERLAP);
        let envelope = envelope.then(|| EnvelopeSearch::new(maps, true));
        Self { piece: RowStates::new(layout), search: ExtremeSearch::new(maps.len(), true), envelope, most }
    }

    fn search(&mut self, maps: &[RowMap]) {
        self.search.see(maps, &self.piece);
        if let Some(envelope) = &mut self.envelope {
            envelope.see(maps, &self.piece);
        }
    }

    pub(super) fn see(&mut self, maps: &[RowMap], time: f64, z: &[f64]) {
        self.piece.push(time, z);
        if self.piece.times.len() >= self.most {
            self.search(maps);
            self.piece.keep_last(OVERLAP);
        }
    }

    /// Returns the extremes of every recovery and, if asked for, the envelopes of its points.
    pub(super) fn finish(mut self, maps: &[RowMap]) -> (Vec<RowExtremes>, Option<Vec<Vec<PointEnvelope>>>) {
        self.search(maps);
        (self.search.finish(), self.envelope.map(EnvelopeSearch::finish))
    }
}
