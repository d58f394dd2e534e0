//! Mass of every node compared with the stiffness around it: speeds of sound, and masses exchanged between
//! nodes.
//!
//! e_i = -1/2 sum_j r_ij' K_ij r_ij with r_ij = x_j - x_i is the stiffness along the lines to the nodes
//! around a node, times the squares of their lengths. Summed over an isotropic solid with Lame's constants
//! l and m it is (6 l + 9 m) V for any elements, and E A L for a bar. Bending does not contribute, so that
//! beams and shells count with their membrane stiffness. Divided by d times the mass it is the square of a
//! speed of sound: (2 l + 3 m) / density in solids, E / (3 density) in bars.

use super::assembled::Assembled;
use super::common_units::{state_units, units_of_speed};
use super::node_pairs::neighbours;
use super::wording::name_some;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{SymmetricMatrix, parallel};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Range of plausible speeds of sound in m/s with a margin: the softest foams have about 30, beryllium and
/// diamond 15,000 to 20,000.
const PLAUSIBLE_SPEEDS: (f64, f64) = (20.0, 25_000.0);

/// Density (kg/m^3) above which no material has a speed of sound below [`MIN_HEAVY_SPEED`]: filled rubbers
/// are lighter.
const MIN_HEAVY_DENSITY: f64 = 2500.0;
/// Lower bound of that speed of sound (m/s): lead has 3500, aluminium 8000.
const MIN_HEAVY_SPEED: f64 = 1000.0;

/// Row sum of a node, relative to its diagonal entry, below which it is too small to divide by.
const MIN_ROW_SUM: f64 = 0.01;

/// Largest difference of the mass of a node from the mass expected from its stiffness, relative to the
/// largest expected mass of its group, for a mass that fits. Nodes of equal elements stay within 0.12 on all
/// models in docs/validation/plausibility.md.
const MAX_FITTING_DIFFERENCE: f64 = 0.15;
/// Smallest such difference that is reported.
const MIN_REPORTED_DIFFERENCE: f64 = 0.3;

/// Stiffness and mass of every node.
pub(super) struct LocalMass {
    /// e_i.
    pub dilation: Vec<f64>,
    /// Row sum of the mass over the nodes, mean of the directions.
    pub mass: Vec<f64>,
    /// Diagonal entry of the mass, mean of the directions.
    pub diagonal: Vec<f64>,
}

/// Speeds of sound of a body in the units of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoundSpeed {
    /// Speed from the sums over the body.
    pub whole: f64,
    /// Median over the nodes, which is insensitive to point masses and stiff connections.
    pub median: f64,
}

impl LocalMass {
    /// Computes the sums from K and the mean over the directions of the mass between nodes.
    pub(crate) fn new(body: &Assembled, scalar_mass: &SymmetricMatrix) -> Self {
        let Assembled { nodes, rows, stiffness, .. } = body;
        let (n, d) = (nodes.len(), rows.dimension);
        let x = &nodes.positions;
        let sums = |i: usize| {
            let mut dilation = 0.0;
            for k in 0..d {
                let (columns, values) = stiffness.row(d * i + k);
                let mut sum = 0.0;
                for (&column, &value) in columns.iter().zip(values) {
                    let (j, l) = (column as usize / d, column as usize % d);
                    if j >= n {
                        break;
                    }
                    sum += value * (x[j][l] - x[i][l]) * (x[j][k] - x[i][k]);
                }
                dilation -= 0.5 * sum;
            }
            let (columns, values) = scalar_mass.row(i);
            let entries = columns.iter().zip(values).take_while(|(j, _)| (**j as usize) < n);
            let (mut mass, mut diagonal) = (0.0, 0.0);
            for (&j, &value) in entries {
                mass += value;
                if j as usize == i {
                    diagonal = value;
                }
            }
            [dilation, mass, diagonal]
        };
        let sums: Vec<[f64; 3]> = parallel::concat(n, 1024, |nodes| nodes.map(sums).collect());
        let all = |k: usize| sums.iter().map(|node| node[k]).collect();
        Self { dilation: all(0), mass: all(1), diagonal: all(2) }
    }

    /// Returns the speeds of sound of a body of the given dimension; `None` if nothing is stretched.
    pub(crate) fn sound_speed(&self, dimension: usize) -> Option<SoundSpeed> {
        let d = dimension as f64;
        let mut ratios: Vec<f64> = (0..self.mass.len())
            .filter(|&i| self.mass[i].abs() > MIN_ROW_SUM * self.diagonal[i].abs())
            .map(|i| self.dilation[i] / self.mass[i])
            .filter(|ratio| ratio.is_finite())
            .collect();
        ratios.sort_by(f64::total_cmp);
        let median = *ratios.get(ratios.len() / 2)?;
        let whole = self.dilation.iter().sum::<f64>() / self.mass.iter().sum::<f64>();
        let speeds = SoundSpeed { whole: (whole / d).sqrt(), median: (median / d).sqrt() };
        (speeds.whole > 0.0 && speeds.median > 0.0).then_some(speeds)
    }

    /// Returns the pairs of nodes whose masses fit the stiffness only if exchanged. Only nodes of the same
    /// elements are compared, those that K couples with the same others, since these share a material.
    pub(crate) fn exchanged(&self, body: &Assembled) -> Vec<[usize; 2]> {
        let mut pairs = Vec::new();
        for group in self.groups(body) {
            let (sum_mass, sum_dilation) = group
                .iter()
                .fold((0.0, 0.0), |(mass, dilation), &i| (mass + self.mass[i], dilation + self.dilation[i]));
            let density = sum_mass / sum_dilation;
            if !(density > 0.0 && density.is_finite()) {
                continue;
            }
            let expected = |i: usize| density * self.dilation[i];
            let size =
                group.iter().fold(0.0f64, |size, &i| size.max(self.mass[i].abs()).max(expected(i).abs()));
            let off = |mass: f64, i: usize| (mass - expected(i)).abs() / size;
            let wrong: Vec<usize> =
                group.into_iter().filter(|&i| off(self.mass[i], i) > MIN_REPORTED_DIFFERENCE).collect();
            for (at, &i) in wrong.iter().enumerate() {
                let fits = |j: &&usize| {
                    off(self.mass[**j], i) < MAX_FITTING_DIFFERENCE
                        && off(self.mass[i], **j) < MAX_FITTING_DIFFERENCE
                };
                pairs.extend(wrong[at + 1..].iter().find(fits).map(|&j| [i, j]));
            }
        }
        pairs
    }

    /// Returns groups of two or more nodes that K couples with each other and with the same others.
    fn groups(&self, body: &Assembled) -> Vec<Vec<usize>> {
        let Assembled { nodes, rows, stiffness, .. } = body;
        let around = |i: usize| {
            let mut closed = neighbours(stiffness, rows, i, |_, _, value| value != 0.0);
            closed.insert(closed.partition_point(|&j| (j as usize) < i), i as u32);
            closed
        };
        let key = |i: usize| {
            let mut hasher = DefaultHasher::new();
            around(i).hash(&mut hasher);
            hasher.finish()
        };
        let keys: Vec<u64> = parallel::concat(nodes.len(), 1024, |nodes| nodes.map(key).collect());
        let mut groups: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        keys.iter().enumerate().for_each(|(i, &key)| groups.entry(key).or_default().push(i));
        let same =
            |group: &Vec<usize>| group.len() > 1 && group.iter().all(|&i| around(i) == around(group[0]));
        let mut groups: Vec<Vec<usize>> = groups.into_values().filter(same).collect();
        groups.sort();
        groups
    }
}

/// Adds a warning for masses that belong to another node; returns the number of pairs.
pub(super) fn check_exchanged(body: &Assembled, local: &LocalMass, found: &mut Vec<Diagnostic>) -> usize {
    let pairs = local.exchanged(body);
    if pairs.is_empty() {
        return 0;
    }
    let number = |i: usize| body.rows.number(&body.nodes, i);
    let named: Vec<String> = pairs.iter().map(|&[i, j]| format!("{} and {}", number(i), number(j))).collect();
    let message = format!(
        "masses of nodes of the same elements fit their stiffness only when exchanged: {}",
        name_some(&named)
    );
    found.push(Diagnostic::new(Code::MassesExchanged, message).in_file(&body.raw.mass.path));
    pairs.len()
}

/// Adds a warning if the speed of sound is implausible; `density` is in SI units, if known. Adds an error
/// if units are not stated and the speed is plausible in other common units: K and M of beams and shells
/// determine no density.
pub(super) fn check_speed(
    body: &Assembled,
    local: &LocalMass,
    density: Option<f64>,
    found: &mut Vec<Diagnostic>,
) {
    let units = &body.raw.units;
    let Some(speeds) = local.sound_speed(body.rows.dimension).filter(|_| body.raw.has_units()) else {
        return;
    };
    let to_si = units.length.to_si() / units.time.to_si();
    let (whole, median) = (speeds.whole * to_si, speeds.median * to_si);
    let heavy = density.filter(|density| *density > MIN_HEAVY_DENSITY);
    let slowest = if heavy.is_some() { MIN_HEAVY_SPEED } else { PLAUSIBLE_SPEEDS.0 };
    if whole.min(median) > PLAUSIBLE_SPEEDS.1 || whole.max(median) < slowest {
        let matter = heavy.map_or(String::new(), |density| format!(" in a material of {density:.0} kg/m^3"));
        let message = format!(
            "stiffness, mass and coordinates give a speed of sound of {median:.3e} m/s{matter} (median of the nodes; {whole:.3e} m/s of the whole body)"
        );
        let fitting = units_of_speed(speeds.median).join(", or in ");
        let unstated = !units.stated && !body.raw.allow_implausible && !fitting.is_empty();
        found.push(
            if unstated && !found.iter().any(|diagnostic| diagnostic.code() == Code::DensityImplausible) {
                Diagnostic::new(
                    Code::DensityImplausible,
                    format!("{message}, with numbers in m, kg, s, assumed since no units are given"),
                )
                .with_help(state_units(&fitting))
            } else {
                Diagnostic::new(Code::SpeedImplausible, message)
            },
        );
    }
}
