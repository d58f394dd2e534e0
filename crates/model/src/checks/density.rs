//! Densities of solid elements, from the mass of nodes and the volumes of the elements around them.
//!
//! No elements are given, but K couples all nodes of an element: elements are the maximal sets of mutually
//! coupled nodes (cliques). If a set is an affine image of one of the usual elements, its volume is a known
//! multiple of the root of the determinant of the covariance of its positions, and each node has a known
//! part of its mass. Beams, shells, bars and other elements have no such sets, or are excluded by their
//! characteristics. Curved elements are measured by their corners, which changes their volume by some
//! percent.

use crate::accepted::acceptance;
use crate::checks::materials::{
    MetalIn, Solid, StiffnessUnit, fitting_units, metal_in_metric_units, stiffness_unit, units_of_speed,
};
use crate::fe_model::assemble::Assembled;
use crate::rows::neighbours::neighbours;
use crate::wording::name_some;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_linalg::{SymmetricMatrix, parallel};
use libm::pow;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Range of densities of materials in kg/m^3, from light foams to osmium.
const MATERIAL_DENSITIES: (f64, f64) = (10.0, 25_000.0);

/// Largest number of sampled nodes, at equal distances in the node table.
const MAX_SAMPLED_NODES: usize = 400;

/// Largest number of nodes coupled with a sampled node: the bits of a word.
const MAX_COUPLED_NODES: usize = 63;

/// Largest number of cliques of one node; elements of a mesh are fewer.
const MAX_CLIQUES: usize = 200;

/// Root of the determinant of the covariance, relative to that of a ball with equal trace, below which
/// nodes lie in a plane.
const FLAT_VOLUME: f64 = 1e-6;
/// Limit in place of [`FLAT_VOLUME`] for linear elements of four nodes: those of a curved membrane come close
/// to a plane.
const FLAT_TETRAHEDRON: f64 = 0.02;

/// Largest deviation of the squared Mahalanobis distance of a corner from that of an affine element.
const MAX_CORNER_DEVIATION: f64 = 1.0;

/// Distance of a mid-edge node of a curved element from the middle between the ends of the edge, relative
/// to the length of the edge.
const MAX_CURVED_OFFSET: f64 = 0.2;

/// Solid element with `nodes` nodes, `corners` of them corners and the others mid-edge nodes. Its volume is
/// `volume` times the root of the determinant of the covariance of the corners, and the row sums of the
/// consistent mass give each corner and each mid-edge node these parts of its mass.
struct Element {
    nodes: usize,
    corners: usize,
    volume: f64,
    corner: f64,
    middle: f64,
}

const ELEMENTS: [Element; 5] = [
    Element { nodes: 4, corners: 4, volume: 8.0 / 3.0, corner: 0.25, middle: 0.0 },
    // 3 sqrt(3): a triangle of three nodes times a line of two.
    Element { nodes: 6, corners: 6, volume: 5.196_152_422_706_632, corner: 1.0 / 6.0, middle: 0.0 },
    Element { nodes: 8, corners: 8, volume: 8.0, corner: 0.125, middle: 0.0 },
    Element { nodes: 10, corners: 4, volume: 8.0 / 3.0, corner: -0.05, middle: 0.2 },
    Element { nodes: 20, corners: 8, volume: 8.0, corner: -0.125, middle: 1.0 / 6.0 },
];

/// Densities of the elements of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Densities {
    /// Lower quartile, median and upper quartile of the nodes, in the units of the model.
    pub quartiles: [f64; 3],
    /// Number of evaluated nodes.
    pub nodes: usize,
}

impl Densities {
    /// Computes the densities of a body in space; `None` if too few nodes belong to solid elements only.
    pub(crate) fn new(body: &Assembled, local: &LocalMass, diagonal_mass: bool) -> Option<Self> {
        let n = body.nodes.len();
        if body.rows.dimension != 3 {
            return None;
        }
        let count = n.min(MAX_SAMPLED_NODES);
        let density = |i: usize| Some(local.mass[i] / around(body, i, diagonal_mass)?);
        let sampled = (0..count).map(|s| s * n / count);
        let mut densities: Vec<f64> = parallel::map(sampled, density).into_iter().flatten().collect();
        let judged = densities.len();
        if judged < 4 || judged * 20 < count {
            return None;
        }
        densities.sort_by(f64::total_cmp);
        let quartiles = [1, 2, 3].map(|q| densities[(q * (judged - 1) + 2) / 4]);
        Some(Self { quartiles, nodes: judged })
    }
}

/// Returns the part of a node in the volumes of the solid elements around it. Returns `None` if there are
/// other elements, or too many to separate.
fn around(body: &Assembled, node: usize, diagonal_mass: bool) -> Option<f64> {
    let Assembled { nodes, rows, stiffness, .. } = body;
    let coupled = |i: usize| neighbours(stiffness, rows, i, |_, _, value| value != 0.0);
    let n = nodes.len();
    let turns = |i: u32| rows.rotations().binary_search_by_key(&i, |&(row, _)| row).is_ok();
    let mut near = coupled(node);
    near.retain(|&j| (j as usize) < n);
    // Nodes with rotations, bars and crowded nodes are not evaluated.
    if turns(node as u32) || near.iter().any(|&j| turns(j)) || near.is_empty() {
        return None;
    }
    if near.len() > MAX_COUPLED_NODES || near.iter().all(|&j| is_bar(body, node, j as usize)) {
        return None;
    }
    // Coupling among the neighbours as bit masks.
    let mask = |i: &u32| {
        let others = coupled(*i as usize);
        let shared = near.iter().enumerate().filter(|(_, other)| others.binary_search(other).is_ok());
        shared.fold(0u64, |mask, (bit, _)| mask | 1 << bit)
    };
    let adjacent: Vec<u64> = near.iter().map(mask).collect();
    // Every maximal clique with the node is an element around it.
    let mut cliques = Vec::new();
    if !maximal_cliques(&adjacent, 0, (1 << near.len()) - 1, 0, &mut cliques) {
        return None;
    }
    let part = |clique: u64| {
        let members = (0..near.len()).filter(|bit| clique >> bit & 1 == 1).map(|bit| near[bit] as usize);
        let positions: Vec<Vector3<f64>> =
            std::iter::once(node).chain(members).map(|i| Vector3::from(nodes.positions[i])).collect();
        part_of_first(&positions, diagonal_mass)
    };
    cliques.into_iter().map(part).sum()
}

/// Returns true if K couples two nodes only along the line between them.
fn is_bar(body: &Assembled, i: usize, j: usize) -> bool {
    let x = &body.nodes.positions;
    let along = (Vector3::from(x[j]) - Vector3::from(x[i])).normalize();
    let block = Matrix3::from_fn(|k, l| {
        let (columns, values) = body.stiffness.row(3 * i + k);
        columns.binary_search(&((3 * j + l) as u32)).map_or(0.0, |at| values[at])
    });
    let axial = along * along.transpose() * along.dot(&(block * along));
    (block - axial).norm() <= 1e-6 * block.norm()
}

/// Runs the search of Bron and Kerbosch with a pivot: finds every maximal extension of `chosen` by
/// `candidates`, none with `excluded`. Returns false if there are too many.
fn maximal_cliques(
    adjacent: &[u64],
    chosen: u64,
    mut candidates: u64,
    mut excluded: u64,
    found: &mut Vec<u64>,
) -> bool {
    if candidates | excluded == 0 {
        found.push(chosen);
        return found.len() <= MAX_CLIQUES;
    }
    let bits = |set: u64| (0..adjacent.len()).filter(move |bit| set >> bit & 1 == 1);
    let pivot = bits(candidates | excluded)
        .max_by_key(|&bit| (candidates & adjacent[bit]).count_ones())
        .expect("one of the sets has a member");
    for bit in bits(candidates & !adjacent[pivot]) {
        let near = adjacent[bit];
        if !maximal_cliques(adjacent, chosen | 1 << bit, candidates & near, excluded & near, found) {
            return false;
        }
        candidates &= !(1 << bit);
        excluded |= 1 << bit;
    }
    true
}

/// Returns the part of the volume of an element that belongs to its first node; `None` if the nodes form no
/// known element. The diagonal mass of quadratic elements is distributed in more than one way and gives
/// `None`.
fn part_of_first(positions: &[Vector3<f64>], diagonal_mass: bool) -> Option<f64> {
    let element = ELEMENTS.iter().find(|element| element.nodes == positions.len())?;
    let linear = element.corners == element.nodes;
    if diagonal_mass && !linear {
        return None;
    }
    let at_corner = |i: &usize| linear || !is_middle(positions, *i);
    let corners: Vec<Vector3<f64>> = (0..positions.len()).filter(at_corner).map(|i| positions[i]).collect();
    if corners.len() != element.corners {
        return None;
    }
    let count = corners.len() as f64;
    let middle = corners.iter().sum::<Vector3<f64>>() / count;
    let arms: Vec<Vector3<f64>> = corners.iter().map(|x| x - middle).collect();
    let covariance = arms.iter().map(|r| r * r.transpose()).sum::<Matrix3<f64>>() / count;
    let root = covariance.determinant().max(0.0).sqrt();
    let ball = pow(covariance.trace() / 3.0, 1.5);
    if root <= ball * if linear && corners.len() == 4 { FLAT_TETRAHEDRON } else { FLAT_VOLUME } {
        return None;
    }
    let inverse = covariance.try_inverse()?;
    if arms.iter().any(|r| (r.dot(&(inverse * r)) - 3.0).abs() > MAX_CORNER_DEVIATION) {
        return None;
    }
    let part = if at_corner(&0) { element.corner } else { element.middle };
    Some(element.volume * root * part)
}

/// Returns true if a node lies in the middle between two others.
fn is_middle(positions: &[Vector3<f64>], node: usize) -> bool {
    let x = positions[node];
    let others = |i: usize| (i + 1..positions.len()).map(move |j| (i, j));
    (0..positions.len()).flat_map(others).filter(|&(i, j)| i != node && j != node).any(|(i, j)| {
        let (a, b) = (positions[i], positions[j]);
        ((a + b) / 2.0 - x).norm() < MAX_CURVED_OFFSET * (a - b).norm()
    })
}

/// Adds an error for impossible densities, or a warning if they may be intended; returns the density in SI
/// units if it is known. Numbers without stated units count as m, kg, s; for matrices in memory, which may
/// be dimensionless, the finding is a warning.
pub(crate) fn check_density(
    body: &Assembled,
    densities: Option<Densities>,
    local: &LocalMass,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<f64> {
    let units = &body.data.description.units;
    let Densities { quartiles, nodes } = densities?;
    let to_si = units.mass.to_si() / units.length.to_si().powi(3);
    let [lower, median, upper] = quartiles.map(|density| density * to_si);
    if upper >= MATERIAL_DENSITIES.0 && lower <= MATERIAL_DENSITIES.1 {
        return Some(median);
    }
    let assumption = if units.stated { "" } else { ", assumed since no units are given" };
    let message = format!(
        "the elements have a density of {} kg/m^3 (median of {nodes} nodes; half of them between {} and {}), with length in {}, mass in {}{assumption}",
        significant(median, 4),
        significant(lower, 4),
        significant(upper, 4),
        units.length.name(),
        units.mass.name()
    );
    if allows_density(body) || !body.has_units() {
        diagnostics.push(Diagnostic::new(Code::InertiaImplausible, message));
        return None;
    }
    let mut diagnostic = Diagnostic::new(Code::DensityImplausible, message);
    let speed = local.sound_speed(3).map_or(0.0, |speed| speed.median);
    let fitting = fitting_units(Solid { density: quartiles[1], speed }).join(", or in ");
    if !units.stated {
        diagnostic = diagnostic.with_help(state_units(&fitting));
    } else if !fitting.is_empty() {
        diagnostic = diagnostic.with_help(format!(
            "check the units of the manifest and of the coordinates: the numbers fit materials in {fitting}; use {} if the density is intended",
            acceptance(Code::DensityImplausible)
        ));
    }
    diagnostics.push(diagnostic);
    None
}

// Mass of every node compared with the stiffness around it: speeds of sound, and masses exchanged between
// nodes.
//
// e_i = -1/2 sum_j r_ij' K_ij r_ij with r_ij = x_j - x_i is the stiffness along the lines to the nodes
// around a node, times the squares of their lengths. Summed over an isotropic solid with Lame's constants
// l and m it is (6 l + 9 m) V for any elements, and E A L for a bar. Bending does not contribute, so that
// beams and shells count with their membrane stiffness. Divided by d times the mass it is the square of a
// speed of sound: (2 l + 3 m) / density in solids, E / (3 density) in bars.

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
/// models in evidence/pages/plausibility.md.
const MAX_FITTING_DIFFERENCE: f64 = 0.15;
/// Smallest such difference that is reported.
const MIN_REPORTED_DIFFERENCE: f64 = 0.3;

/// Stiffness and mass of every node.
pub(crate) struct LocalMass {
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
pub(crate) fn check_exchanged(
    body: &Assembled,
    local: &LocalMass,
    diagnostics: &mut Vec<Diagnostic>,
) -> usize {
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
    diagnostics.push(Diagnostic::new(Code::MassesExchanged, message).in_file(&body.origin.mass.path));
    pairs.len()
}

/// Adds a warning if the speed of sound is implausible; `density` is in SI units, if known. Adds an error
/// if units are not stated and the speed is plausible in other common units, since K and M of beams and shells
/// determine no density, and if density and speed are those of a metal in other units.
pub(crate) fn check_speed(
    body: &Assembled,
    local: &LocalMass,
    density: Option<f64>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let units = &body.data.description.units;
    let Some(speeds) = local.sound_speed(body.rows.dimension).filter(|_| body.has_units()) else {
        return;
    };
    let to_si = units.length.to_si() / units.time.to_si();
    let (whole, median) = (speeds.whole * to_si, speeds.median * to_si);
    let heavy = density.filter(|density| *density > MIN_HEAVY_DENSITY);
    let slowest = if heavy.is_some() { MIN_HEAVY_SPEED } else { PLAUSIBLE_SPEEDS.0 };
    let is_implausible = whole.min(median) > PLAUSIBLE_SPEEDS.1 || whole.max(median) < slowest;
    let metal =
        density.and_then(|density| metal_in_other_units(body, density, speeds.median, is_implausible));
    if let Some(diagnostic) = metal {
        diagnostics.push(diagnostic);
    } else if is_implausible {
        let matter = heavy.map_or(String::new(), |density| format!(" in a material of {density:.0} kg/m^3"));
        let message = format!(
            "stiffness, mass and coordinates give a speed of sound of {median:.3e} m/s{matter} (median of the nodes; {whole:.3e} m/s of the whole body)"
        );
        let fitting = match density {
            Some(density) => fitting_units(solid(body, density, speeds.median)).join(", or in "),
            None => units_of_speed(speeds.median).join(", or in "),
        };
        let unstated = !units.stated && !allows_density(body) && !fitting.is_empty();
        diagnostics.push(
            if unstated && !diagnostics.iter().any(|diagnostic| diagnostic.code() == Code::DensityImplausible)
            {
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

/// Returns a finding if density (kg/m^3) and speed of sound (in the units of the model) are those of a metal in
/// other units than the stated ones: an error, or a warning if implausible numbers are allowed.
fn metal_in_other_units(
    body: &Assembled,
    density: f64,
    speed: f64,
    is_implausible: bool,
) -> Option<Diagnostic> {
    let units = &body.data.description.units;
    let names = format!("{}, {}, {}", units.length.name(), units.mass.name(), units.time.name());
    let speed_si = speed * units.length.to_si() / units.time.to_si();
    let assumed = if units.stated { "" } else { " (assumed since no units are given)" };
    let told = format!(
        "in {names}{assumed} the elements have a density of {} kg/m^3 and a speed of sound of {} m/s",
        significant(density, 4),
        significant(speed_si, 4)
    );
    let solid = solid(body, density, speed);
    let (message, help) = if let Some(MetalIn { metal, units }) =
        metal_in_metric_units(solid, units, is_implausible)
    {
        let help = format!(
            "state the units {units}, or write coordinates and matrices in one system of units; use {} to confirm {names}",
            acceptance(Code::DensityImplausible)
        );
        (format!("{told}, which no known metal has; in {units} the same numbers are those of {metal}"), help)
    } else {
        let StiffnessUnit { metal, factor } = stiffness_unit(density, speed_si)?;
        let (factor, ratio) = (significant(factor, 6), significant(factor.sqrt(), 4));
        let help = format!(
            "write stiffness and mass in one system of units: K times {factor} fits {names} (MPa are N/mm^2: with lengths in mm they belong to mass in t, density in t/mm^3); use {} if the stiffness is intended",
            acceptance(Code::DensityImplausible)
        );
        (format!("{told}: the density is that of {metal}, and so is {ratio} times the speed"), help)
    };
    let code = if allows_density(body) { Code::SpeedImplausible } else { Code::DensityImplausible };
    Some(Diagnostic::new(code, message).with_help(help))
}

/// Returns true if the user accepts density and speed of sound as they are.
fn allows_density(body: &Assembled) -> bool {
    body.origin.allow_implausible.accepts(Code::DensityImplausible)
}

/// Returns the numbers of the model for a density in kg/m^3 and a speed in the units of the model.
fn solid(body: &Assembled, density: f64, speed: f64) -> Solid {
    let units = &body.data.description.units;
    Solid { density: density * units.length.to_si().powi(3) / units.mass.to_si(), speed }
}

/// Returns advice on numbers without stated units, with the units in which they are plausible.
fn state_units(fitting: &str) -> String {
    let reason =
        if fitting.is_empty() { String::new() } else { format!(": the numbers fit materials in {fitting}") };
    format!(
        "state the units with --units LENGTH,MASS,TIME, or [model.units] in the manifest{reason}; use {} if m, kg, s are intended",
        acceptance(Code::DensityImplausible)
    )
}
