//! Comparison of two bodies that does not depend on the signs of modes, the basis inside repeated
//! eigenvalues, the order of the nodes or the body frame.

mod comparable;
mod entries;
mod groups;
mod modal_rows;
mod modes;
mod named_loads;
mod recoveries;

pub(super) use modes::by_shape;
pub(super) use modes::signed_percent;
pub use modes::{ModePair, Pairing};

use comparable::{Comparable, in_own_frame, is_placed};
use groups::OneSidedGroups;
use modal_rows::ModalRows;

use crate::common_modes::{CommonModes, clusters};
use crate::comparison_report::{ComparisonFormat, ComparisonReport};
use crate::mass_properties::{centre_of_mass, gyration_radius, inertia_about_com};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
#[cfg(doc)]
use flexbody_base::diagnostic::Code;
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{CauchySchwarz, Invariants, compare_invariants};
use flexbody_linalg::larger;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

/// Largest relative differences that pass.
///
/// The defaults suit two computations of one model on different machines. Bodies from matrices that were
/// written with few digits, or from another mesh, need larger tolerances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Tolerance of each frequency, relative. Default 1e-9: a residual of 1e-10 bounds eigenvalues far below
    /// 1e-9.
    pub frequency: f64,
    /// Tolerance of the mass, relative. Default 1e-9: three orders above rounding; detects a single missing
    /// element of a large model.
    pub mass: f64,
    /// Tolerance of the inertia about the centre of mass, each entry relative to sqrt(I_kk I_ll). Default
    /// 1e-9.
    pub inertia: f64,
    /// Tolerance of invariants and shapes, relative to the Cauchy-Schwarz bounds, and of damping and of the
    /// stiffness of unit loads, relative to their largest entries. Default 1e-8: the error of a mode shape is
    /// residual / gap, larger than that of its eigenvalue.
    pub invariants: f64,
    /// Tolerance of the centre of mass, of node positions and of the reference points of interfaces, relative
    /// to the radius of gyration. Default 1e-9.
    pub centre_of_mass: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self { frequency: 1e-9, mass: 1e-9, inertia: 1e-9, invariants: 1e-8, centre_of_mass: 1e-9 }
    }
}

/// One compared quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparisonRow {
    /// Stable name of the quantity.
    pub quantity: &'static str,
    /// Reference value that the difference is divided by, in words.
    pub meaning: &'static str,
    /// Largest difference, dimensionless; 0 is equal.
    pub difference: f64,
    /// Largest difference that passes: the requested tolerance plus the rounding error of a shift to a
    /// distant origin.
    pub tolerance: f64,
    /// True if `difference <= tolerance`; a NaN never passes.
    pub passed: bool,
}

/// Result of [`compare`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodyComparison {
    a: String,
    b: String,
    passed: bool,
    same_nodes: bool,
    paired: Pairing,
    modes: Vec<ModePair>,
    rows: Vec<ComparisonRow>,
    notes: Vec<String>,
    not_compared: Vec<String>,
}

/// Compares `b` with `a`, in the frame of `a`.
///
/// If both bodies have the same node numbers (in any order), `b` is rotated and shifted into the frame of `a`
/// and its modes are aligned inside each cluster of close eigenvalues
/// ([`align`](flexbody_body::invariants::align), plain product of the nodal components). Positions, shapes
/// and every primary invariant are then compared. Otherwise the comparison covers the quantities that need no
/// common node: mass, centre of mass, inertia, frequencies, and the norms of the invariants over clusters of
/// modes, which do not depend on signs or basis. Damping, geometric stiffness, stiffness of inertia and
/// interfaces are compared in both cases. [`BodyComparison::not_compared`] lists the entries of the file that
/// are not compared.
///
/// A group of the kinetic energy that one body has dropped is a difference of its own size; [`compare_common`] leaves it out.
/// Bodies with different reference conditions are compared in mean axes.
///
/// The place of the body frame in the model is unknown for a body imported from another program. If one body
/// is such an import, the two body frames are assumed to coincide.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) when dimensions or numbers of modes differ, units of which only one
/// body states its own, or reference conditions that cannot be changed to mean axes; [`compare_common`] compares bodies with
/// different numbers of modes.
pub fn compare(a: &FlexBody, b: &FlexBody, tolerances: &Tolerances) -> Result<BodyComparison> {
    let bodies = Comparable::of(a, b)?;
    bodies.require_equal_numbers_of_modes()?;
    let mut comparison = compared(&bodies, tolerances, OneSidedGroups::Differ)?;
    comparison.say_of_modes();
    Ok(comparison)
}

/// Returns the comparison of [`compare`] without the notes on modes.
fn compared(
    bodies: &Comparable<'_>,
    tolerances: &Tolerances,
    one_sided: OneSidedGroups,
) -> Result<BodyComparison> {
    let (a, b) = (&*bodies.a, &*bodies.b);
    let placed = is_placed(a) && is_placed(b);
    let (in_own_a, in_own_b);
    // A body without a known place in the model is compared in its own frame.
    let (a, b) = if placed {
        (a, b)
    } else {
        (in_own_a, in_own_b) = (in_own_frame(a)?, in_own_frame(b)?);
        (&in_own_a, &in_own_b)
    };
    let mut comparison = BodyComparison {
        a: a.source().name.clone(),
        b: b.source().name.clone(),
        passed: true,
        same_nodes: false,
        paired: Pairing::Order,
        modes: Vec::new(),
        rows: Vec::new(),
        notes: bodies.notes.clone(),
        not_compared: Vec::new(),
    };
    // Quantities that need no common basis or node.
    comparison.rigid(a, b, tolerances);
    // Invariants of b in the frame of a.
    let change = FrameChange::new(a, b);
    let in_a = b.invariants().shifted(change.shift).rotated(&change.axes);
    let groups = clusters(&a.modes().eigenvalue, &b.modes().eigenvalue);
    let pair = Pair { a, b, change, in_a, groups };
    // Mode by mode with common nodes, otherwise by norms over clusters of modes.
    let order = common_nodes(&a.nodes().ids, &b.nodes().ids);
    comparison.not_compared = entries::not_compared(a, b, order.is_some());
    comparison.not_compared.extend(bodies.left_out.iter().cloned());
    let common = match order {
        Some(order) => Some(comparison.mode_by_mode(&pair, &order, tolerances)),
        None => {
            comparison.norms_only(&pair, tolerances.invariants);
            None
        }
    };
    let (basis, assurance) = common.map(|common| (common.basis, common.assurance)).unzip();
    comparison.frequencies(a, b, assurance.as_ref(), tolerances.frequency);
    comparison.modal_matrices(&pair, basis.as_ref(), tolerances.invariants);
    comparison.recoveries(&pair, basis.as_ref(), tolerances.invariants)?;
    comparison.named_loads(&pair, basis.as_ref(), tolerances.invariants);
    comparison.interfaces(&pair, tolerances.centre_of_mass);
    // Notes on the limits of the comparison.
    if !placed {
        let note = "a body comes from a file of another program, which does not state the position of its frame in the model: the body frames are assumed to be the same";
        comparison.notes.push(note.to_owned());
    }
    comparison.groups(a, b, one_sided, tolerances.invariants);
    if a.storage() != b.storage() {
        comparison.notes.push("one of the bodies is rounded to 32-bit floats".to_owned());
    }
    if a.units().stated != b.units().stated {
        comparison
            .notes
            .push("only one of the bodies has stated units, the other assumes m, kg, s".to_owned());
    }
    comparison.passed = comparison.rows.iter().all(|row| row.passed);
    Ok(comparison)
}

/// Compares what two bodies have in common: one may have fewer modes, and groups of the kinetic energy that one has dropped are
/// left out. Each mode of the smaller body is paired with a mode
/// of the larger one: with that of its shape, others in ascending order, so that the frequencies deviate least. The notes list the
/// modes that were compared, and the modes and groups that were left out.
///
/// # Errors
/// [`BodyIncomparable`](Code::BodyIncomparable) when units or dimensions differ, when reference conditions cannot be changed to
/// mean axes, or when the bodies have no mode in common.
pub fn compare_common(a: &FlexBody, b: &FlexBody, tolerances: &Tolerances) -> Result<BodyComparison> {
    let bodies = Comparable::of(a, b)?;
    let (a, b) = (&*bodies.a, &*bodies.b);
    if a.n_modes() == b.n_modes() {
        let mut comparison = compared(&bodies, tolerances, OneSidedGroups::LeftOut)?;
        comparison.say_of_modes();
        return Ok(comparison);
    }
    let common = CommonModes::of(a, b, assurance_of_all(a, b).as_ref())?;
    let some = |body: &FlexBody, modes: &[usize]| body.reduced(modes, body.groups(), Vec::new());
    let reduced = Comparable {
        a: Cow::Owned(some(a, &common.a)?),
        b: Cow::Owned(some(b, &common.b)?),
        notes: bodies.notes.clone(),
        left_out: bodies.left_out.clone(),
    };
    let mut comparison = compared(&reduced, tolerances, OneSidedGroups::LeftOut)?;
    comparison.number_modes(&common.a, &common.b);
    comparison.say_of_modes();
    comparison.notes.splice(0..0, common.notes);
    Ok(comparison)
}

/// Two bodies brought into one frame.
struct Pair<'a> {
    a: &'a FlexBody,
    b: &'a FlexBody,
    change: FrameChange,
    /// Invariants of `b` in the frame of `a`, in the modal basis of `b`.
    in_a: Invariants,
    /// Clusters of close eigenvalues.
    groups: Vec<Range<usize>>,
}

/// Modes of two bodies with common nodes.
struct CommonShapes {
    /// Basis change from the modes of `b` to those of `a`.
    basis: Mat<f64>,
    /// Modal assurance criterion of each mode of `a` with each mode of `b`, which is aligned inside clusters.
    assurance: Mat<f64>,
}

/// Transformation from the frame of `b` to that of `a`: x_a = axes' (x_b - shift).
struct FrameChange {
    shift: Vector3<f64>,
    axes: Matrix3<f64>,
}

impl FrameChange {
    fn new(a: &FlexBody, b: &FlexBody) -> Self {
        let (a, b) = (a.frame(), b.frame());
        // Equal frames must change nothing, not even the last bit.
        let axes = if a.axes == b.axes { Matrix3::identity() } else { b.axes.transpose() * a.axes };
        Self { shift: b.axes.transpose() * (a.origin - b.origin), axes }
    }

    fn point(&self, x: &[f64; 3]) -> Vector3<f64> {
        self.axes.transpose() * (Vector3::from(*x) - self.shift)
    }
}

/// Returns the index into `b` of each node of `a`; `None` if the node numbers differ.
fn common_nodes(a: &[i64], b: &[i64]) -> Option<Vec<usize>> {
    let places: HashMap<i64, usize> = b.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    (a.len() == b.len()).then(|| a.iter().map(|id| places.get(id).copied()).collect()).flatten()
}

/// Returns |difference| / scale; 0 if the difference is zero, even if the scale is zero.
fn relative(difference: f64, scale: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.abs() / scale }
}

/// Returns the largest difference of pairs of numbers, relative to the largest number; each pair has a factor.
fn relative_difference(pairs: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for (factor, a, b) in pairs {
        difference = larger(difference, factor * (a - b).abs());
        size = larger(size, factor * larger(a.abs(), b.abs()));
    }
    relative(difference, size)
}

/// Returns the rounding error of a shift of J by `distance`, relative to the smallest diagonal entry of J.
/// About a distant origin J is dominated by m d^2, and the moments of the body itself are in its last digits.
fn lost_by_shift(mass: f64, distance: f64, smallest: f64) -> f64 {
    8.0 * f64::EPSILON * relative(mass * distance * distance, smallest)
}

impl BodyComparison {
    /// Returns true if every difference is within its tolerance.
    pub fn passed(&self) -> bool {
        self.passed
    }

    /// Returns the compared quantities.
    pub fn rows(&self) -> &[ComparisonRow] {
        &self.rows
    }

    /// Returns true if shapes and invariants were compared mode by mode, which requires the same node numbers
    /// in both bodies.
    pub fn same_nodes(&self) -> bool {
        self.same_nodes
    }

    /// Returns the pairs of modes with their frequencies, in the order of the modes of the first body.
    pub fn modes(&self) -> &[ModePair] {
        &self.modes
    }

    /// Returns the way in which the modes are paired.
    pub fn paired(&self) -> Pairing {
        self.paired
    }

    /// Returns the notes on the limits of the comparison.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns the entries of the flex-body file that were not compared, each with its paths: `lumped
    /// comparators (/lumped, /comparison)`.
    pub fn not_compared(&self) -> &[String] {
        &self.not_compared
    }

    /// Returns the notes, and a sentence for every entry that was not compared.
    pub(super) fn remarks(&self) -> Vec<String> {
        let left_out = self.not_compared.iter().map(|entry| format!("not compared: {entry}"));
        self.notes.iter().cloned().chain(left_out).collect()
    }

    /// Returns the comparison as JSON: `a`, `b`, `passed`, `same_nodes`, `paired`, `modes`, `rows`, `notes`,
    /// `not_compared`.
    pub fn json(&self) -> serde_json::Value {
        serde_json::to_value(self).expect("plain data with text keys")
    }

    /// Returns the comparison as a table for a terminal.
    pub fn text(&self) -> String {
        ComparisonReport { comparison: self, a: &self.a, b: &self.b }.render(ComparisonFormat::Text)
    }

    /// Returns true if a quantity cannot be compared because a body imported from another program does not
    /// have it: the format may not hold the data that `has` looks for. If the other body has such data, `name
    /// (paths)` is added to the entries that were not compared.
    fn leave_out(
        &mut self,
        pair: &Pair<'_>,
        name: &str,
        paths: &str,
        has: impl Fn(&FlexBody) -> bool,
    ) -> bool {
        let may_lack = |body: &FlexBody| !is_placed(body) && !has(body);
        let left_out = may_lack(pair.a) || may_lack(pair.b);
        if left_out && (has(pair.a) || has(pair.b)) {
            let entry = format!("{name}, which a body of another program does not have ({paths})");
            self.not_compared.push(entry);
        }
        left_out
    }

    fn row(&mut self, quantity: &'static str, meaning: &'static str, difference: f64, tolerance: f64) {
        self.rows.push(ComparisonRow {
            quantity,
            meaning,
            difference,
            tolerance,
            passed: difference <= tolerance,
        });
    }

    /// Compares mass, centre of mass and inertia about it.
    fn rigid(&mut self, a: &FlexBody, b: &FlexBody, tolerances: &Tolerances) {
        let (ia, ib) = (a.invariants(), b.invariants());
        self.row(
            "mass",
            "mass of the first body",
            relative(ib.mass() - ia.mass(), ia.mass()),
            tolerances.mass,
        );
        let radius = gyration_radius(ia);
        let com =
            |body: &FlexBody| body.frame().origin + body.frame().axes * centre_of_mass(body.invariants());
        let spacing = relative(com(a).amax().max(com(b).amax()), radius) * f64::EPSILON;
        self.row(
            "centre of mass",
            "distance / radius of gyration",
            relative((com(b) - com(a)).norm(), radius),
            tolerances.centre_of_mass + 8.0 * spacing,
        );
        let axes = FrameChange::new(a, b).axes;
        let (ja, jb) = (inertia_about_com(ia), axes.transpose() * inertia_about_com(ib) * axes);
        let mut largest = 0.0;
        for k in 0..3 {
            for l in 0..3 {
                let scale = (ja[(k, k)] * ja[(l, l)]).sqrt();
                largest = larger(largest, relative(jb[(k, l)] - ja[(k, l)], scale));
            }
        }
        let offset = centre_of_mass(ia).norm().max(centre_of_mass(ib).norm());
        let lost = lost_by_shift(ia.mass(), offset, ja.diagonal().min());
        self.row("inertia", "largest entry / sqrt(I_kk I_ll)", largest, tolerances.inertia + lost);
    }

    /// Compares positions, shapes and invariants. `order` gives the node of `b` for each node of `a`.
    fn mode_by_mode(&mut self, pair: &Pair<'_>, order: &[usize], tolerances: &Tolerances) -> CommonShapes {
        let Pair { a, b, change, in_a, groups } = pair;
        self.same_nodes = true;
        let (pa, pb) = (&a.nodes().positions, &b.nodes().positions);
        let distance = |(x, &i): (&[f64; 3], &usize)| (change.point(&pb[i]) - Vector3::from(*x)).norm();
        let largest = pa.iter().zip(order).map(distance).fold(0.0, larger);
        let radius = gyration_radius(a.invariants());
        let origin = a.frame().origin.amax().max(b.frame().origin.amax());
        self.row(
            "node positions",
            "largest distance / radius of gyration",
            relative(largest, radius),
            tolerances.centre_of_mass + 8.0 * f64::EPSILON * relative(origin, radius),
        );

        let shapes_a = a.modes().shape.as_ref();
        let shapes_b = turned(b.modes().shape.as_ref(), &change.axes, order);
        let gram = product(shapes_a.transpose(), shapes_b.as_ref());
        let (alignment, differences) = compare_invariants(a.invariants(), in_a, gram.as_ref(), groups);
        let aligned = product(shapes_b.as_ref(), alignment.basis.as_ref());
        let by_group: Vec<f64> =
            groups.iter().map(|g| shape_difference(shapes_a, aligned.as_ref(), g)).collect();
        let largest = by_group.iter().copied().fold(0.0, larger);
        self.row("mode shapes", "|psi_a - psi_b| / |psi_a|, nodal norm", largest, tolerances.invariants);
        let rest = &by_group[..by_group.len().saturating_sub(1)];
        let shapes_agree = largest <= tolerances.invariants;
        if !shapes_agree && rest.iter().all(|d| *d <= tolerances.invariants) {
            self.notes.push(
                "only the last modes differ: other modes of the same repeated eigenvalue may have been left out"
                    .to_owned(),
            );
        }
        // J of a mass with rotary inertia of its nodes may have a diagonal entry that is not positive.
        let smallest = match a.invariants().general() {
            Some(_) => a.invariants().inertia().diagonal().min(),
            None => a.invariants().second_moment().diagonal().min(),
        };
        let lost = lost_by_shift(a.invariants().mass(), change.shift.norm(), smallest);
        for (name, difference) in differences {
            // The mass has a row of its own.
            if let Some((_, quantity, meaning)) = PRIMARY.iter().find(|(known, ..)| *known == name) {
                let lost = if name == "second_moment" { lost } else { 0.0 };
                self.row(quantity, meaning, difference, tolerances.invariants + lost);
            }
        }
        self.nodal_rows(pair, order, alignment.basis.as_ref(), tolerances.invariants);
        CommonShapes { assurance: modes::assurance(shapes_a, aligned.as_ref()), basis: alignment.basis }
    }

    /// Compares norms of the invariants over groups of modes. No orthogonal change of basis inside a group
    /// alters these norms.
    fn norms_only(&mut self, pair: &Pair<'_>, tolerance: f64) {
        let Pair { a, b, in_a, groups, .. } = pair;
        let (na, nb) = (a.n_nodes(), b.n_nodes());
        let count = if na == nb { format!("{na} with different numbers") } else { format!("{na} and {nb}") };
        self.notes.push(format!(
            "the bodies have different nodes ({count}): shapes are not compared, invariants only by their norms over groups of modes"
        ));
        let exact = a.invariants();
        let bound = CauchySchwarz::of(exact);
        let size = |g: &Range<usize>| g.clone().map(|p| bound.mode(p).powi(2)).sum::<f64>().sqrt();
        let norm = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |sum, v| sum.hypot(v));
        let (mut c1, mut ibar, mut s) = (0.0, 0.0, 0.0);
        for g in groups {
            for k in 0..3 {
                let x = |body: &Invariants| norm(&mut g.clone().map(|p| body.c1()[(k, p)]));
                c1 = larger(c1, relative(x(in_a) - x(exact), exact.mass().sqrt() * size(g)));
                for l in 0..3 {
                    let x = |body: &Invariants| {
                        body.ibar().map_or(0.0, |ibar| norm(&mut g.clone().map(|p| ibar[k][l][p])))
                    };
                    // ibar(k, p) is sqrt(J_kk) |psi_p|.
                    let scale = norm(&mut g.clone().map(|p| bound.ibar(k, p)));
                    ibar = larger(ibar, relative(x(in_a) - x(exact), scale));
                    for h in groups {
                        let x = |body: &Invariants| {
                            let products = |block: &Mat<f64>| {
                                norm(&mut g.clone().flat_map(|p| h.clone().map(move |q| block[(p, q)])))
                            };
                            body.s().map_or(0.0, |s| products(&s[k][l]))
                        };
                        s = larger(s, relative(x(in_a) - x(exact), size(g) * size(h)));
                    }
                }
            }
        }
        self.row("norms of C1", "over groups of modes / sqrt(m) |psi|", c1, tolerance);
        let held = exact.groups().and(in_a.groups());
        if held.w1 {
            self.row("norms of Ibar", "over groups of modes / sqrt(J_kk) |psi|", ibar, tolerance);
        }
        if held.w2 {
            self.row("norms of S", "over groups of modes / |psi_p| |psi_q|", s, tolerance);
        }
    }
}

/// Names in `primary_differences`, names of the rows, and reference values in words.
const PRIMARY: [(&str, &str, &str); 10] = [
    ("first_moment", "first moment", "about the frame origin of the first body / sqrt(m J_kk)"),
    ("second_moment", "second moment", "about the frame origin of the first body / sqrt(J_kk J_ll)"),
    ("C1", "C1", "largest entry / sqrt(m) |psi_p|"),
    ("Ibar", "Ibar (W1, C2)", "largest entry / sqrt(J_kk) |psi_p|"),
    ("C2", "C2", "largest entry / sqrt(I0_kk) |psi_p|"),
    ("S", "S (W2, W3, m_ff)", "largest entry / |psi_p| |psi_q|"),
    ("modal_stiffness", "modal stiffness", "largest entry / sqrt(K_pp K_qq)"),
    ("W0", "W0", "largest entry / sqrt(m) |psi_p|"),
    ("W3", "W3", "largest entry / |psi_p| |psi_q|"),
    ("modal_mass", "modal mass", "largest entry / |psi_p| |psi_q|"),
];

/// Returns A B, computed on one thread so that the bits do not depend on the number of threads.
fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut c, Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

/// Returns shapes (3n x nf) with the nodes in the given order and components along the given axes.
fn turned(shapes: MatRef<'_, f64>, axes: &Matrix3<f64>, order: &[usize]) -> Mat<f64> {
    Mat::from_fn(3 * order.len(), shapes.ncols(), |row, p| {
        let (node, k) = (order[row / 3], row % 3);
        (0..3).map(|l| axes[(l, k)] * shapes[(3 * node + l, p)]).sum()
    })
}

/// Returns the modal assurance criterion of each mode of `a` with each mode of `b`; `None` if the node numbers differ.
fn assurance_of_all(a: &FlexBody, b: &FlexBody) -> Option<Mat<f64>> {
    let order = common_nodes(&a.nodes().ids, &b.nodes().ids)?;
    let axes = if is_placed(a) && is_placed(b) { FrameChange::new(a, b).axes } else { Matrix3::identity() };
    let shapes = turned(b.modes().shape.as_ref(), &axes, &order);
    Some(modes::assurance(a.modes().shape.as_ref(), shapes.as_ref()))
}

/// Returns |A - B|_F / |A|_F of a group of columns.
fn shape_difference(a: MatRef<'_, f64>, b: MatRef<'_, f64>, group: &Range<usize>) -> f64 {
    let square = |value: &dyn Fn(usize, usize) -> f64| {
        group.clone().map(|p| (0..a.nrows()).map(|i| value(i, p).powi(2)).sum::<f64>()).sum::<f64>()
    };
    relative(square(&|i, p| a[(i, p)] - b[(i, p)]).sqrt(), square(&|i, p| a[(i, p)]).sqrt())
}
