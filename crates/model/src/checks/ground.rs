//! Springs to ground that a stiffness matrix holds.
//!
//! A translation strains no free body, and its forces K t need no coordinate: they are sums of the entries of
//! each row, and vanish to the digits of these entries. Forces above that are those of springs to ground if
//! they resist the translation: errors of other kinds (axes of nodes, coefficients of constraints, the motion
//! of rows without a position) change its energy only by their square.

use crate::fe_model::assemble::Assembled;
use crate::rows::centre_and_length;
use crate::wording::name_some;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_linalg::ties::{first_largest, sort_descending};
use flexbody_linalg::{Pencil, gram, parallel};
use libm::log10;
use std::ops::Range;

/// Decimal digits of a value from which on its binary digits limit the accuracy.
const BINARY_DIGITS: u8 = 16;

/// Relative rounding error of a number of 64 bits.
const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Rounding errors per half unit in the last digit of every value: 1 for values that were rounded, 2 for
/// values that were cut off.
const DIGIT_MARGIN: f64 = 2.0;

/// Largest |K t| relative to the row sum of |K| that the sums of an FE program leave in double precision. Models
/// that elements assemble have 4e-16 or less; the margin is for condensed models. A larger value hides springs to
/// ground: with this one a body of 66 Hz may have suspensions up to 0.1 Hz.
const SUMMATION_ERROR: f64 = 1e-11;

/// Smallest sum of the forces along the translations that cause them, relative to the sum of the sizes of all
/// forces: springs at nodes reach a third (along a diagonal) to one, rounding errors of random signs stay
/// below this from some twenty rows on.
const MIN_COHERENCE: f64 = 0.2;

/// Forces that translations cause at the displacements of nodes.
struct Forces {
    /// Row, and force along each axis under the unit translation along it, of rows above their limit.
    rows: Vec<(usize, [f64; 3])>,
    /// Largest force relative to the row sum of |K|.
    worst: f64,
    /// Limit of the row with this force, relative to the same sum.
    limit: f64,
}

/// Returns an error if K holds springs to ground that the digits of its values show. The rows need the motion
/// of rows without a position.
pub(crate) fn ground_springs(body: &Assembled) -> Option<Diagnostic> {
    let found = Forces::new(body, body.origin.stiffness.digits)?;
    // Values that were rounded before the file was written in full have fewer digits in these rows.
    let shown = shown_digits(body, &found);
    let found = if shown < body.origin.stiffness.digits { Forces::new(body, shown)? } else { found };
    found.resist_translations(body.rows.dimension).then(|| found.diagnostic(body))
}

/// Returns the number of digits (1 to 17) that the values of the rows show: 7 for single precision.
fn shown_digits(body: &Assembled, found: &Forces) -> u8 {
    /// Largest number of rows that are read.
    const ROWS: usize = 1000;
    /// Bits of a number of 64 bits that one of 32 bits does not have.
    const BITS_BELOW_SINGLE: u32 = 29;
    let values = || found.rows.iter().take(ROWS).flat_map(|&(row, _)| body.stiffness.row(row).1);
    if values().all(|value| value.to_bits().trailing_zeros() >= BITS_BELOW_SINGLE) {
        return 7;
    }
    values().map(|&value| decimal_digits(value)).max().unwrap_or(17)
}

/// Returns the number of digits of the shortest decimal number that reads back as `value`.
fn decimal_digits(value: f64) -> u8 {
    let text = format!("{:e}", value.abs());
    text.bytes().take_while(|b| *b != b'e').filter(u8::is_ascii_digit).count() as u8
}

/// Returns the largest error of a value that was written with some digits.
fn rounding_error(value: f64, digits: u8) -> f64 {
    let binary = value.abs() * UNIT_ROUNDOFF;
    if digits >= BINARY_DIGITS || value == 0.0 {
        return binary;
    }
    let last_digit = log10(value.abs()).floor() as i32 + 1 - i32::from(digits);
    0.5 * 10f64.powi(last_digit) + binary
}

impl Forces {
    /// Computes the forces of values with `digits` digits; `None` if rounding explains all of them.
    fn new(body: &Assembled, digits: u8) -> Option<Self> {
        let Assembled { nodes, rows, stiffness, .. } = body;
        let (d, of_nodes) = (rows.dimension, rows.dimension * nodes.len());
        let (centre, length) = centre_and_length(&nodes.positions);
        let fields = rows.rigid_fields(&nodes.positions, centre, length);
        let turns = rows.displacements()..rows.displacements() + rows.rotations().len();
        let of_row = |row: usize| {
            let (columns, values) = stiffness.row(row);
            // Translations do not turn nodes.
            let entries =
                || columns.iter().map(|&j| j as usize).zip(values).filter(|(j, _)| !turns.contains(j));
            let (mut force, mut size) = ([0.0; 3], 0.0);
            for (column, &value) in entries() {
                (0..d).for_each(|axis| force[axis] += value * fields[(column, axis)]);
                size += value.abs();
            }
            let largest = force.iter().fold(0.0f64, |most, force| most.max(force.abs()));
            if largest <= SUMMATION_ERROR * size {
                return None;
            }
            let written: f64 = entries().map(|(_, &value)| rounding_error(value, digits)).sum();
            let limit = DIGIT_MARGIN * written + SUMMATION_ERROR * size;
            (largest > limit).then(|| (row, force, largest / size, limit / size))
        };
        let rows_of = |range: Range<usize>| range.filter_map(of_row).collect();
        let above = parallel::concat(of_nodes, 1024, rows_of);
        let &(_, _, worst, limit) = first_largest(&above, |row| row.2)?;
        let rows = above.into_iter().map(|(row, force, ..)| (row, force)).collect();
        Some(Self { rows, worst, limit })
    }

    /// Returns the sums over the rows of the forces along each axis under the translation along it.
    fn total(&self, dimension: usize) -> [f64; 3] {
        let mut total = [0.0; 3];
        for &(row, force) in &self.rows {
            total[row % dimension] += force[row % dimension];
        }
        total
    }

    /// Returns true if the forces resist the translations, as those of springs do.
    fn resist_translations(&self, dimension: usize) -> bool {
        let sizes: f64 = self.rows.iter().flat_map(|(_, force)| force).map(|force| force.abs()).sum();
        let total = self.total(dimension);
        total.iter().sum::<f64>() >= MIN_COHERENCE * sizes
    }

    fn diagnostic(&self, body: &Assembled) -> Diagnostic {
        let Assembled { data, origin, nodes, rows, stiffness, mass, .. } = body;
        let (d, units) = (rows.dimension, &data.description.units);
        let (centre, length) = centre_and_length(&nodes.positions);
        let rigid = rows.rigid_fields(&nodes.positions, centre, length);
        let inertia =
            gram(rigid.as_ref(), Pencil::new(stiffness, mass, 1).apply_mass(rigid.as_ref()).as_ref());
        let along = |axis: usize, value: String| format!("{value} along {}", ["x", "y", "z"][axis]);
        let total = self.total(d);
        let stiffness_of = |k: usize| {
            along(k, format!("{} {}/{}", significant(total[k], 3), units.force_name(), units.length_name()))
        };
        let frequency_of = |k: usize| {
            let hertz = units.frequency_of(total[k].max(0.0) / inertia[(k, k)]);
            along(k, format!("{} Hz", significant(hertz, 3)))
        };
        let joined = |of: &dyn Fn(usize) -> String| (0..d).map(of).collect::<Vec<_>>().join(", ");
        let mut grounded = self.rows.clone();
        sort_descending(&mut grounded, |(_, force)| force.iter().fold(0.0f64, |most, f| most.max(f.abs())));
        let named: Vec<String> =
            grounded.iter().map(|&(row, _)| rows.label(nodes, row).to_string()).collect();
        let message = format!(
            "K ties the body to ground at {} row{}: {}; translations, which need no coordinates, give |K t| up to {:.1e} of the row sum of |K| (digits and sums explain {:.0e}); stiffness of these rows to ground {}; the rigid body on these springs has {}",
            named.len(),
            if named.len() == 1 { "" } else { "s" },
            name_some(&named),
            self.worst,
            self.limit,
            joined(&stiffness_of),
            joined(&frequency_of)
        );
        Diagnostic::new(Code::RigidMotionStrained, message).in_file(&origin.stiffness.path).with_help(
            "write K without the springs to ground (mounts, soil, bungees), and give them to the multibody program as force elements at interfaces of the body",
        )
    }
}
