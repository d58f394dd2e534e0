//! Comparison of the recoveries of two bodies: their rows in the modes, under constant unit loads and under forces of motion.

use super::body_comparison::BodyComparison;
use super::modal_rows::ModalRows;
use super::pair::Pair;
use super::relative_difference::{relative, relative_difference};
use faer::{Mat, MatRef};
use flexbody_base::error::Result;
use flexbody_base::named_unit::NamedUnit;
use flexbody_body::flex_body::{
    FlexBody, LoadColumns, MotionColumns, MotionLoad, Quantity, Recovery, RecoveryRow,
};
use flexbody_linalg::larger;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;

/// Largest difference of the axes of two bodies in one frame: rounding.
const SAME_AXES: f64 = 1e-6;

/// Kinds of unit loads of a recovery: their columns have units of their own.
const COLUMNS: [Range<usize>; 2] = [0..3, 3..6];

/// Largest differences of the recoveries of two bodies.
#[derive(Default)]
struct Largest {
    /// Number of recoveries that differ in name, rows or loads.
    unlike: usize,
    in_modes: f64,
    at_rest: f64,
    /// Rows of forces of motion; `None` if no recovery has them.
    in_motion: Option<f64>,
}

impl BodyComparison {
    /// Compares the recoveries of the same names: labels and loads, rows in the modes by groups of modes, values of the
    /// undeformed body, and rows under constant unit loads, which depend neither on the basis nor on the frame. Rows of the second
    /// body are converted to the units of the first. `basis` transforms the modes of the second body to those of the first.
    pub(super) fn recoveries(
        &mut self,
        pair: &Pair<'_>,
        basis: Option<&Mat<f64>>,
        tolerance: f64,
    ) -> Result<()> {
        let has = |body: &FlexBody| !body.recoveries().is_empty();
        let neither = !has(pair.a) && !has(pair.b);
        if neither || self.leave_out(pair, "recoveries", "/recovery", has) {
            return Ok(());
        }
        // Forces of motion are along the axes of the body.
        let turned = pair.second_along_axes_of_first()?;
        let (a, b) = (pair.a.recoveries(), turned.recoveries());
        let mut found = Largest::default();
        let mut units = BTreeSet::new();
        for own in a {
            let other = b.iter().find(|other| other.name == own.name);
            let alike = other.and_then(|other| Some((other, pair.conversion(own, other, &mut units)?)));
            let Some((other, conversion)) = alike else {
                let what = if other.is_some() {
                    "differs in its rows or loads"
                } else {
                    "is in the first body only"
                };
                self.notes.push(format!("recovery `{}` {what}", own.name));
                found.unlike += 1;
                continue;
            };
            if !own.motion.is_empty() && pair.a.conditions() != pair.b.conditions() {
                let what = "forces of motion are not compared under different reference conditions";
                self.notes.push(format!("recovery `{}`: {what}", own.name));
            }
            found.compare(pair, &turned, basis, [own, other], &conversion);
        }
        for other in b.iter().filter(|other| a.iter().all(|own| own.name != other.name)) {
            self.notes.push(format!("recovery `{}` is in the second body only", other.name));
            found.unlike += 1;
        }
        if !units.is_empty() {
            let units: Vec<String> = units.into_iter().collect();
            self.notes.push(format!("rows of the second body were converted: {}", units.join(", ")));
        }
        self.rows_of_recoveries(&found, tolerance);
        Ok(())
    }

    fn rows_of_recoveries(&mut self, found: &Largest, tolerance: f64) {
        let meaning = "number of recoveries that differ in name, rows or loads";
        self.row("recoveries", meaning, found.unlike as f64, 0.0);
        let meaning = "rows over a group of modes / largest norm of a row";
        self.row("rows in the modes", meaning, found.in_modes, tolerance);
        let meaning = "under constant unit loads and undeformed / largest row of the load";
        self.row("rows at rest", meaning, found.at_rest, tolerance);
        if let Some(in_motion) = found.in_motion {
            let meaning =
                "static rows of damping and inertia of the deformation over a group of modes / largest";
            self.row("rows of forces of motion", meaning, in_motion, tolerance);
        }
    }
}

impl Largest {
    /// Compares two recoveries of one name. `second` is the second body along the axes of the first, and `conversion` takes its
    /// recovery to the units and loads of the first.
    fn compare(
        &mut self,
        pair: &Pair<'_>,
        second: &FlexBody,
        basis: Option<&Mat<f64>>,
        [own, other]: [&Recovery; 2],
        conversion: &Conversion,
    ) {
        let groups = RowGroup::of(own, pair.a);
        let converted = conversion.of(other);
        let in_modes = ModalRows::new(&own.modes, &converted.modes, basis);
        for group in &groups {
            self.in_modes = larger(self.in_modes, in_modes.difference(&group.rows, &pair.groups));
        }
        let have_one_frame = pair.a.conditions() == pair.b.conditions();
        for load in own.motion.iter().map(|one| one.load).filter(|_| have_one_frame) {
            if let Some((a, b)) = pair.a.motion_rows(own, load).zip(second.motion_rows(&converted, load)) {
                let found = difference_in_motion(&[a, b], load, basis, &groups, &pair.groups);
                self.in_motion = Some(larger(self.in_motion.unwrap_or(0.0), found));
            }
        }
        let (own, other) = (pair.a.static_rows(own), conversion.of(&second.static_rows(other)));
        for group in &groups {
            self.at_rest = larger(self.at_rest, group.difference_at_rest(&own, &other));
        }
    }
}

/// Returns the largest difference of the rows under forces of motion of one kind, relative to the largest norm over a group of
/// modes of all components.
fn difference_in_motion(
    bodies: &[Mat<f64>; 2],
    load: MotionLoad,
    basis: Option<&Mat<f64>>,
    rows: &[RowGroup],
    groups: &[Range<usize>],
) -> f64 {
    let modes = bodies[0].ncols() / load.components();
    let mut largest = 0.0;
    for RowGroup { rows } in rows {
        let (mut difference, mut size) = (0.0, 0.0);
        for component in 0..load.components() {
            let [a, b] = bodies.each_ref().map(|of| of.as_ref().subcols(component * modes, modes).to_owned());
            let found = ModalRows::new(&a, &b, basis);
            difference = larger(difference, found.largest_difference(rows, groups));
            size = larger(size, found.size(rows, groups));
        }
        largest = larger(largest, relative(difference, size));
    }
    largest
}

impl Pair<'_> {
    /// Returns the second body along the axes of the first. Its rows of forces of motion are then comparable.
    fn second_along_axes_of_first(&self) -> Result<Cow<'_, FlexBody>> {
        let has_motion = self.b.recoveries().iter().any(|recovery| !recovery.motion.is_empty());
        if !has_motion || (self.a.frame().axes - self.b.frame().axes).norm() <= SAME_AXES {
            return Ok(Cow::Borrowed(self.b));
        }
        self.b.in_frame(Vector3::zeros(), self.change.axes).map(Cow::Owned)
    }

    /// Returns the conversion of the recovery `other` of the second body to the units and named loads of `own` of the first; `None`
    /// if their labels, loads or kinds of forces of motion differ. Adds converted units to `units`, in words.
    fn conversion(
        &self,
        own: &Recovery,
        other: &Recovery,
        units: &mut BTreeSet<String>,
    ) -> Option<Conversion> {
        let loads = |recovery: &Recovery| -> BTreeSet<String> {
            recovery.loads.iter().map(|load| load.interface.clone()).collect()
        };
        let kinds = |recovery: &Recovery| recovery.motion.iter().map(|own| own.load).collect::<Vec<_>>();
        if loads(own) != loads(other) || kinds(own) != kinds(other) || own.rows.len() != other.rows.len() {
            return None;
        }
        let order = self.order_of_named_loads()?;
        let factors: Vec<f64> = own
            .rows
            .iter()
            .zip(&other.rows)
            .map(|(own, other)| factor_of(own, other))
            .collect::<Option<_>>()?;
        for (own, other) in own.rows.iter().zip(&other.rows).filter(|(own, other)| own.unit != other.unit) {
            units.insert(format!("{} to {}", other.unit, own.unit));
        }
        Some(Conversion { factors, order })
    }

    /// Returns the place in the second body of each named load of the first; `None` if their names differ.
    fn order_of_named_loads(&self) -> Option<Vec<usize>> {
        let (a, b) = (self.a.named_loads(), self.b.named_loads());
        let place = |name: &str| b.iter().position(|other| other.name == name);
        (a.len() == b.len()).then(|| a.iter().map(|load| place(&load.name)).collect()).flatten()
    }
}

/// Returns the factor that takes the values of the row `other` to the unit of `own`; `None` if the labels differ.
fn factor_of(own: &RecoveryRow, other: &RecoveryRow) -> Option<f64> {
    let relabelled = RecoveryRow { unit: own.unit.clone(), ..other.clone() };
    if *own != relabelled {
        return None;
    }
    if own.unit == other.unit {
        return Some(1.0);
    }
    NamedUnit::parse(&other.unit)?.factor_to(NamedUnit::parse(&own.unit)?)
}

/// Conversion of a recovery to the units and named loads of another one.
struct Conversion {
    /// Factor of each row.
    factors: Vec<f64>,
    /// Column of each named load.
    order: Vec<usize>,
}

impl Conversion {
    fn of(&self, other: &Recovery) -> Recovery {
        let Self { factors, order } = self;
        let times = |a: &Mat<f64>| Mat::from_fn(a.nrows(), a.ncols(), |i, j| factors[i] * a[(i, j)]);
        let named = |i: usize, c: usize| factors[i] * other.named[(i, order[c])];
        let load =
            |columns: &LoadColumns| LoadColumns { columns: times(&columns.columns), ..columns.clone() };
        let motion = |columns: &MotionColumns| MotionColumns { columns: times(&columns.columns), ..*columns };
        Recovery {
            offset: other.offset.iter().zip(factors).map(|(value, factor)| factor * value).collect(),
            modes: times(&other.modes),
            spin: times(&other.spin),
            named: Mat::from_fn(factors.len(), order.len(), named),
            loads: other.loads.iter().map(load).collect(),
            motion: other.motion.iter().map(motion).collect(),
            ..other.clone()
        }
    }
}

/// Rows of a recovery that have one size: those of one quantity and unit. Moments over the extent of the body belong to the
/// forces, since those of a section may vanish where its forces do not.
struct RowGroup {
    /// Rows with their factors.
    rows: Vec<(usize, f64)>,
}

impl RowGroup {
    /// Returns the groups of `recovery` of `body`.
    fn of(recovery: &Recovery, body: &FlexBody) -> Vec<Self> {
        let units = RecoveryRow::by_unit(&recovery.rows);
        let first = |group: &[usize]| &recovery.rows[group[0]];
        let is_moment_of = |group: &[usize], force: &[usize]| {
            let (moment, force) = (first(group), first(force));
            (moment.quantity, force.quantity) == (Quantity::Moment, Quantity::Force)
                && moment.unit == format!("{} {}", force.unit, body.units().length_name())
        };
        let plain = |group: &[usize]| group.iter().map(|row| (*row, 1.0)).collect::<Vec<_>>();
        let mut groups = Vec::new();
        for group in &units {
            if units.iter().any(|force| is_moment_of(group, force)) {
                continue;
            }
            let mut rows = plain(group);
            let moments = units.iter().filter(|other| is_moment_of(other, group)).flatten();
            rows.extend(moments.map(|row| (*row, 1.0 / body.extent())));
            groups.push(Self { rows });
        }
        groups
    }

    /// Returns the largest difference of the static rows, relative to the largest of them under the same kind of load.
    fn difference_at_rest(&self, a: &Recovery, b: &Recovery) -> f64 {
        let offsets = self.rows.iter().map(|&(i, factor)| (factor, a.offset[i], b.offset[i]));
        let mut worst = relative_difference(offsets);
        let mut see = |a: MatRef<'_, f64>, b: MatRef<'_, f64>| {
            let entries = self
                .rows
                .iter()
                .flat_map(|&(i, factor)| (0..a.ncols()).map(move |c| (factor, a[(i, c)], b[(i, c)])));
            worst = larger(worst, relative_difference(entries));
        };
        see(a.spin.as_ref(), b.spin.as_ref());
        for c in 0..a.named.ncols() {
            see(a.named.as_ref().subcols(c, 1), b.named.as_ref().subcols(c, 1));
        }
        for own in &a.loads {
            let other =
                b.loads.iter().find(|other| other.interface == own.interface).expect("the same loads");
            for kind in COLUMNS {
                let of = |columns: &Mat<f64>| columns.as_ref().subcols(kind.start, kind.len()).to_owned();
                see(of(&own.columns).as_ref(), of(&other.columns).as_ref());
            }
        }
        worst
    }
}
