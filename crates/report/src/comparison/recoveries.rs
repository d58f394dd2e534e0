//! Comparison of the recoveries of two bodies: their rows in the modes, under constant unit loads and under forces of motion.

use super::{BodyComparison, Pair, relative_difference};
use faer::{Mat, MatRef};
use flexbody_body::flex_body::{FlexBody, MotionLoad, Quantity, Recovery, RecoveryRow};
use flexbody_linalg::larger;
use std::collections::BTreeSet;
use std::ops::Range;

/// Largest difference of the axes of two bodies in one frame: rounding.
const SAME_AXES: f64 = 1e-6;

/// Kinds of unit loads of a recovery: their columns have units of their own.
const COLUMNS: [Range<usize>; 2] = [0..3, 3..6];

impl BodyComparison {
    /// Compares the recoveries of the same names: labels and loads, rows in the modes by groups of modes, values of the
    /// undeformed body, and rows under constant unit loads, which depend neither on the basis nor on the frame.
    pub(super) fn recoveries(&mut self, pair: &Pair<'_>, tolerance: f64) {
        let has = |body: &FlexBody| !body.recoveries().is_empty();
        let neither = !has(pair.a) && !has(pair.b);
        if neither || self.leave_out(pair, "recoveries", "/recovery", has) {
            return;
        }
        let (a, b) = (pair.a.recoveries(), pair.b.recoveries());
        let (mut differing, mut in_modes, mut at_rest) = (0, 0.0, 0.0);
        let mut in_motion: Option<f64> = None;
        let same_loads = pair.named_loads_alike();
        for own in a {
            let other = b.iter().find(|other| other.name == own.name);
            let Some(other) = other.filter(|other| same_loads && are_alike(own, other)) else {
                let what = if other.is_some() {
                    "differs in its rows or loads"
                } else {
                    "is in the first body only"
                };
                self.notes.push(format!("recovery `{}` {what}", own.name));
                differing += 1;
                continue;
            };
            let groups = RowGroup::of(own, pair.a);
            for group in &groups {
                in_modes = larger(in_modes, group.difference_in_modes(own, other, &pair.groups));
            }
            if own.motion.is_empty() || have_frames_alike(pair) {
                for (load, group) in
                    own.motion.iter().flat_map(|one| groups.iter().map(|group| (one.load, group)))
                {
                    let difference = group.difference_in_motion(pair, own, other, load);
                    in_motion = difference.map(|found| larger(in_motion.unwrap_or(0.0), found)).or(in_motion);
                }
            } else {
                let what = "forces of motion are not compared in different frames";
                self.notes.push(format!("recovery `{}`: {what}", own.name));
            }
            let (own, other) = (pair.a.static_rows(own), pair.b.static_rows(other));
            for group in &groups {
                at_rest = larger(at_rest, group.difference_at_rest(&own, &other));
            }
        }
        for other in b.iter().filter(|other| a.iter().all(|own| own.name != other.name)) {
            self.notes.push(format!("recovery `{}` is in the second body only", other.name));
            differing += 1;
        }
        let meaning = "number of recoveries that differ in name, rows or loads";
        self.row("recoveries", meaning, differing as f64, 0.0);
        let meaning = "norm of a row over a group of modes / largest norm";
        self.row("rows in the modes", meaning, in_modes, tolerance);
        let meaning = "under constant unit loads and undeformed / largest row of the load";
        self.row("rows at rest", meaning, at_rest, tolerance);
        if let Some(in_motion) = in_motion {
            let meaning =
                "static rows of damping and inertia of the deformation over a group of modes / largest";
            self.row("rows of forces of motion", meaning, in_motion, tolerance);
        }
    }
}

impl Pair<'_> {
    /// Returns true if both bodies have the same named loads in the same order.
    fn named_loads_alike(&self) -> bool {
        self.a.named_loads().iter().map(|load| &load.name).eq(self
            .b
            .named_loads()
            .iter()
            .map(|load| &load.name))
    }
}

/// Returns true if two recoveries have the same labels, loads and kinds of forces of motion.
fn are_alike(a: &Recovery, b: &Recovery) -> bool {
    let loads = |one: &Recovery| -> BTreeSet<String> {
        one.loads.iter().map(|load| load.interface.clone()).collect()
    };
    let kinds = |one: &Recovery| one.motion.iter().map(|own| own.load).collect::<Vec<_>>();
    a.rows == b.rows && loads(a) == loads(b) && kinds(a) == kinds(b)
}

/// Returns true if both bodies have the same frame, to whose motion the forces of motion belong.
fn have_frames_alike(pair: &Pair<'_>) -> bool {
    let (a, b) = (pair.a, pair.b);
    a.conditions() == b.conditions() && (a.frame().axes - b.frame().axes).norm() <= SAME_AXES
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

    /// Returns the largest difference of the norms of a row over a group of modes, relative to the largest norm. Norms are the
    /// same in every basis of a repeated eigenvalue.
    fn difference_in_modes(&self, a: &Recovery, b: &Recovery, groups: &[Range<usize>]) -> f64 {
        let norm = |of: &Recovery, i: usize, g: &Range<usize>| {
            g.clone().map(|j| of.modes[(i, j)].powi(2)).sum::<f64>().sqrt()
        };
        relative_difference(
            self.rows
                .iter()
                .flat_map(|&(i, factor)| groups.iter().map(move |g| (factor, norm(a, i, g), norm(b, i, g)))),
        )
    }

    /// Returns the largest difference of the norms of the rows under forces of motion of one kind, over a group of modes, relative
    /// to the largest; `None` for a body without them.
    fn difference_in_motion(
        &self,
        pair: &Pair<'_>,
        own: &Recovery,
        other: &Recovery,
        load: MotionLoad,
    ) -> Option<f64> {
        let (rows_a, rows_b) = (pair.a.motion_rows(own, load)?, pair.b.motion_rows(other, load)?);
        let norm = |rows: &Mat<f64>, i: usize, component: usize, g: &Range<usize>| {
            let modes = rows.ncols() / load.components();
            g.clone().map(|j| rows[(i, component * modes + j)].powi(2)).sum::<f64>().sqrt()
        };
        let places = self.rows.iter().flat_map(|&row| (0..load.components()).map(move |c| (row, c)));
        let norms = places.flat_map(|((i, factor), c)| {
            let both = |g: &Range<usize>| (factor, norm(&rows_a, i, c, g), norm(&rows_b, i, c, g));
            pair.groups.iter().map(both).collect::<Vec<_>>()
        });
        Some(relative_difference(norms))
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
