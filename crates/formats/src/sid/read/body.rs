//! Conversion of the arrays of a file into a body.

use super::arrays::{Array, Arrays, FrameArrays, largest};
use super::parse::Listed;
use super::taylor::ModeIndex;
use crate::import::digits::Digits;
use crate::import::{ImportedBody, ImportedFrame};
use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::invariants::{Numbered, TermGroups};
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};
use nalgebra::{Matrix3, Vector3};

/// Largest entries of Cr1 and Oe1 that count as rounding, relative to their largest entry. A smaller value
/// takes rounding for geometric stiffness.
const ROUNDING: f64 = 1e-10;

/// Facts of the body declared in the first line.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Declared {
    pub(crate) name: String,
    pub(crate) units: Option<UnitSystem>,
    /// True if Oe1 has geometric stiffness; `None` if the line does not state it.
    pub(crate) stiffened: Option<bool>,
    /// True if the line states that Cr1 has geometric stiffness.
    pub(crate) turned: bool,
    /// True if the mass does not commute with rotations.
    pub(crate) general: bool,
    /// True if W2 is omitted on purpose.
    pub(crate) without_w2: bool,
}

impl Declared {
    pub(crate) fn of(comment: &str) -> Self {
        // Blanks are removed: `Geo_Stiff=no` and `Geo_Stiff= yes` are both in use.
        let words: String = comment.to_lowercase().split_whitespace().collect();
        let mut found = Self::default();
        if let Some(facts) = comment.strip_prefix("flexbody ") {
            let (facts, name) = facts.split_once(", body ").unwrap_or((facts, ""));
            found.name = name.trim().to_owned();
            found.stiffened = Some(false);
            for fact in facts.split(", ") {
                match fact {
                    "geometric stiffness for spin" => found.stiffened = Some(true),
                    "geometric stiffness for angular acceleration" => found.turned = true,
                    "general mass" => found.general = true,
                    fact if fact.starts_with("without ") => {
                        found.without_w2 = fact.split(' ').any(|group| group == "W2");
                    }
                    fact => {
                        let units = fact.strip_prefix("units ").unwrap_or("");
                        if let [length, mass, time] = units.split(' ').collect::<Vec<_>>()[..] {
                            found.units = UnitSystem::parse(length, mass, time).ok();
                        }
                    }
                }
            }
        } else if words.contains("geo_stiff=no") || words.contains("nogeometricalstiffness") {
            found.stiffened = Some(false);
        } else if words.contains("geo_stiff=yes") {
            found.stiffened = Some(true);
        }
        found
    }
}

/// Returns the body of a file, and notes on the interpretation of its arrays. If `spin_in_oe` is true, Oe1
/// holds more than Me implies and is taken as geometric stiffness for spin.
pub(crate) fn body(
    listed: &Listed<'_>,
    arrays: &Arrays,
    frames: Vec<FrameArrays>,
    declared: &Declared,
    spin_in_oe: bool,
) -> (ImportedBody, Vec<String>) {
    let mut terms = Terms { arrays, stiffness: Vec::new(), notes: Vec::new() };
    // W3, W2 and geometric stiffness are separated from arrays that hold them as sums.
    let i5 = terms.coupling(declared.general && !declared.turned);
    let i9 = terms.centrifugal(i5.as_ref(), spin_in_oe);
    terms.accelerated();
    if frames.iter().any(has_own_axes) {
        terms.notes.push(
            "the axes of frames (AP) are not converted: a flex-body file has frames with the axes of the body only"
                .to_owned(),
        );
    }
    let Terms { mut stiffness, notes, .. } = terms;
    let listed_frames = listed.frames.iter().zip(frames);
    let frames = listed_frames.map(|(frame, arrays)| place(&frame.label, arrays, &mut stiffness)).collect();
    let damped = largest(&arrays.de.m0) > 0.0;
    let body = ImportedBody {
        name: declared.name.clone(),
        units: declared.units.clone(),
        inertia: numbered(arrays, i5, i9),
        modal_stiffness: arrays.ke.m0.clone(),
        modal_damping: damped.then(|| arrays.de.m0.clone()),
        geometric_stiffness: stiffness,
        frames,
        mesh: None,
        omissions: omissions(arrays),
    };
    (body, notes)
}

/// Returns the nine invariants; `i5` and `i9` are those of W3 and W2 if the file has them.
fn numbered(arrays: &Arrays, i5: Option<Mat<f64>>, i9: Option<Mat<f64>>) -> Numbered {
    let nq = arrays.nq;
    let i8 = |k: usize| 0.5 * (arrays.j1(k) - arrays.cr0(k).cross_matrix());
    let w1 = (0..nq).any(|k| arrays.j1(k).amax() > 0.0);
    Numbered {
        i1: arrays.mass,
        i2: Vector3::from_fn(|a, _| arrays.first_moment.m0[(a, 0)]),
        i3: Mat::from_fn(3, nq, |a, k| arrays.ct.m0[(k, a)]),
        i4: Mat::from_fn(3, nq, |a, k| arrays.cr.m0[(k, a)]),
        groups: TermGroups { w1, w2: i9.is_some(), w3: i5.is_some() },
        i5,
        i6: arrays.me.m0.clone(),
        i7: arrays.j0(),
        i8: (0..nq).map(i8).collect(),
        i9,
    }
}

/// Returns the data of the file that a flexible body cannot hold.
fn omissions(arrays: &Arrays) -> Vec<String> {
    let mut omissions = Vec::new();
    if largest(&arrays.ksigma.m0) > 0.0 {
        omissions.push("ksigma: forces of initial stress on the modes are not converted".to_owned());
    }
    if arrays.gr.m1.is_some() {
        omissions.push("Gr1 is ignored: it follows from the other arrays".to_owned());
    }
    omissions
}

/// Terms separated from arrays that hold kinetic energy and geometric stiffness together.
struct Terms<'a> {
    arrays: &'a Arrays,
    stiffness: Vec<GeometricStiffness<Mat<f64>>>,
    notes: Vec<String>,
}

impl Terms<'_> {
    /// Returns W3 from the skew part of Cr1. The part that is symmetric in the modes is geometric stiffness
    /// for angular acceleration or, for a mass that does not commute with rotations (`general`), also W3.
    fn coupling(&mut self, general: bool) -> Option<Mat<f64>> {
        let (arrays, nq) = (self.arrays, self.arrays.nq);
        arrays.cr.m1.as_ref()?;
        if general {
            return Some(Mat::from_fn(3 * nq, nq, |row, k| arrays.cr.linear(row % nq, k, row / nq)));
        }
        let even = |a: usize| symmetric_part(nq, |k, l| arrays.cr.linear(l, k, a));
        let size = arrays.cr.sizes()[1];
        let rounding = ROUNDING * size + 2.0 * arrays.cr.rounding[1];
        if (0..3).any(|a| largest(&even(a)) > rounding) {
            push(&mut self.stiffness, &LoadKind::AngularAcceleration, (0..3).map(even));
            self.notes.push(
                "the part of Cr1 that is symmetric in the modes is converted to geometric stiffness for angular acceleration: the equations are the same"
                    .to_owned(),
            );
        }
        let i5 = Mat::from_fn(3 * nq, nq, |row, k| 0.5 * arrays.cr1_skew(k, row % nq, row / nq));
        (largest(&i5) > 0.0).then_some(i5)
    }

    /// Returns I9 from Oe1; `None` if Oe1 is taken as geometric stiffness for spin.
    fn centrifugal(&mut self, i5: Option<&Mat<f64>>, spin_in_oe: bool) -> Option<Mat<f64>> {
        let (arrays, nq) = (self.arrays, self.arrays.nq);
        arrays.oe.m1.as_ref()?;
        let oe1 = |k: usize, l: usize, pair: usize| {
            0.5 * (arrays.oe.linear(l, k, pair) + arrays.oe.linear(k, l, pair))
        };
        if !spin_in_oe {
            return Some(centrifugal(nq, oe1, i5));
        }
        let load = |pair| Mat::from_fn(nq, nq, |k, l| oe1(k, l, pair));
        push(&mut self.stiffness, &LoadKind::Spin, (0..6).map(load));
        self.notes.push(
            "Oe1 is converted to geometric stiffness for spin as a whole, since W2 cannot be separated from it: the equations are the same"
                .to_owned(),
        );
        None
    }

    /// Takes the geometric stiffness for acceleration from Ct1.
    fn accelerated(&mut self) {
        let Some(m1) = &self.arrays.ct.m1 else { return };
        let along = |a: usize| symmetric_part(self.arrays.nq, |k, l| m1[l][(k, a)]);
        push(&mut self.stiffness, &LoadKind::Acceleration, (0..3).map(along));
        self.notes.push("Ct1 is converted to geometric stiffness for acceleration".to_owned());
    }
}

/// Returns I9 = -W2: the part symmetric in the modes comes from Oe1, the other part from W3.
fn centrifugal(nq: usize, oe1: impl Fn(usize, usize, usize) -> f64, i5: Option<&Mat<f64>>) -> Mat<f64> {
    Mat::from_fn(3 * nq, 3 * nq, |row, column| {
        let (a, k, b, l) = (row / nq, row % nq, column / nq, column % nq);
        if a == b {
            return oe1(k, l, a);
        }
        let pair = match a + b {
            1 => 3,
            3 => 4,
            _ => 5,
        };
        let c = (3 - a - b) * nq;
        let w3 = i5.map_or(0.0, |i5| 0.5 * (i5[(c + k, l)] - i5[(c + l, k)]));
        0.5 * (oe1(k, l, pair) - if (a + 1) % 3 == b { w3 } else { -w3 })
    })
}

/// Returns the symmetric part of the matrix with these entries.
fn symmetric_part(nq: usize, entry: impl Fn(usize, usize) -> f64) -> Mat<f64> {
    Mat::from_fn(nq, nq, |k, l| 0.5 * (entry(k, l) + entry(l, k)))
}

/// Adds the components that are not zero.
fn push(
    stiffness: &mut Vec<GeometricStiffness<Mat<f64>>>,
    kind: &LoadKind,
    components: impl Iterator<Item = Mat<f64>>,
) {
    for (component, matrix) in components.enumerate().filter(|(_, matrix)| largest(matrix) > 0.0) {
        stiffness.push(GeometricStiffness { load: UnitLoad { kind: kind.clone(), component }, matrix });
    }
}

/// Returns true if the axes of a frame differ from those of the body by more than rounding.
fn has_own_axes(frame: &FrameArrays) -> bool {
    let beside = |ap: &Array| (&ap.m0 - Mat::<f64>::identity(3, 3)).norm_max();
    frame.ap.as_ref().is_some_and(|ap| beside(ap) > ROUNDING + ap.rounding[0])
}

/// Returns a frame. A frame with phi1 or psi1 is an interface whose forces or moments have geometric
/// stiffness.
fn place(
    label: &str,
    arrays: FrameArrays,
    stiffness: &mut Vec<GeometricStiffness<Mat<f64>>>,
) -> ImportedFrame {
    let FrameArrays { origin, phi, psi, .. } = arrays;
    let mut loaded = false;
    let mut take = |array: &Array, kind: fn(String) -> LoadKind| {
        if let Some(m1) = &array.m1 {
            loaded = true;
            let along = |a: usize| symmetric_part(m1.len(), |k, l| -m1[l][(a, k)]);
            push(stiffness, &kind(label.to_owned()), (0..3).map(along));
        }
    };
    take(&phi, LoadKind::Force);
    if let Some(psi) = &psi {
        take(psi, LoadKind::Moment);
    }
    ImportedFrame {
        label: label.to_owned(),
        interface: loaded.then(|| label.to_owned()),
        position: [0, 1, 2].map(|a| origin.m0[(a, 0)]),
        translation: phi.m0,
        rotation: psi.map(|psi| psi.m0),
    }
}

// Dialect of a file, from its names and from its numbers.

/// Order of the columns of Gr and Ge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Blocks {
    /// Column a nq + k for axis a and mode k.
    Component,
    /// Column 3 k + a for axis a and mode k.
    Mode,
}

impl Blocks {
    /// Both column orders.
    const ALL: [Self; 2] = [Self::Component, Self::Mode];

    /// Returns the order in words: `component-blocked` or `mode-blocked`.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Component => "component-blocked",
            Self::Mode => "mode-blocked",
        }
    }

    fn column(self, a: usize, k: usize, nq: usize) -> usize {
        match self {
            Self::Component => a * nq + k,
            Self::Mode => 3 * k + a,
        }
    }

    /// Returns Gr_k.
    pub(crate) fn gr(self, arrays: &Arrays, k: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|row, a| arrays.gr.m0[(row, self.column(a, k, arrays.nq))])
    }

    /// Returns max |sym(Gr_k) - J1_k| and max |skew(Gr_k) + Cr0_k~|.
    pub(crate) fn gr_misfit(self, arrays: &Arrays) -> [f64; 2] {
        let misfit = |k: usize| {
            let gr = self.gr(arrays, k);
            let (even, odd) = (0.5 * (gr + gr.transpose()), 0.5 * (gr - gr.transpose()));
            [(even - arrays.j1(k)).amax(), (odd + arrays.cr0(k).cross_matrix()).amax()]
        };
        (0..arrays.nq).map(misfit).fold([0.0; 2], |most, now| [most[0].max(now[0]), most[1].max(now[1])])
    }

    /// Returns max |Ge(k; l, a) - (Cr1(k, l, a) - Cr1(l, k, a))|.
    pub(crate) fn ge_misfit(self, arrays: &Arrays) -> f64 {
        self.ge_beside(arrays, |k, l, a| arrays.cr1_skew(k, l, a))
    }

    /// Returns max |Ge(k; l, a) - 2 Cr1(k, l, a)|, which equals the other misfit if Cr1 is skew in the modes.
    pub(crate) fn ge_doubled(self, arrays: &Arrays) -> f64 {
        self.ge_beside(arrays, |k, l, a| 2.0 * arrays.cr.linear(l, k, a))
    }

    fn ge_beside(self, arrays: &Arrays, expected: impl Fn(usize, usize, usize) -> f64) -> f64 {
        let nq = arrays.nq;
        let mut most = 0.0f64;
        for l in 0..nq {
            for a in 0..3 {
                let column = self.column(a, l, nq);
                for k in 0..nq {
                    most = most.max((arrays.ge.m0[(k, column)] - expected(k, l, a)).abs());
                }
            }
        }
        most
    }
}

/// Largest ratio of the misfits of two layouts for which the smaller one decides. A larger value decides on
/// less evidence.
const MAX_MISFIT_RATIO: f64 = 0.1;

/// Returns the layout with the clearly smaller misfit; `None` if both are similar.
fn fitting(misfit: impl Fn(Blocks) -> f64) -> Option<Blocks> {
    let [component, mode] = Blocks::ALL.map(misfit);
    if component < MAX_MISFIT_RATIO * mode {
        Some(Blocks::Component)
    } else if mode < MAX_MISFIT_RATIO * component {
        Some(Blocks::Mode)
    } else {
        None
    }
}

/// Dialects with their layouts; the first dialect of a layout is assumed if names do not decide.
const DIALECTS: [(&str, Blocks, Blocks); 5] = [
    ("fembs", Blocks::Component, Blocks::Component),
    ("py-sid", Blocks::Mode, Blocks::Component),
    ("embs", Blocks::Mode, Blocks::Mode),
    ("morembs", Blocks::Component, Blocks::Component),
    ("fembeam", Blocks::Mode, Blocks::Mode),
];

/// Earlier name of the layout of `embs`.
const MODE_BLOCKED: &str = "mode-blocked";

/// Detected dialect.
pub(crate) struct Layout {
    pub(crate) dialect: &'static str,
    /// Dialect and layout declared by names; `None` if the names do not decide.
    pub(crate) declared: Option<(&'static str, Blocks, Blocks)>,
    /// Orders of Gr and Ge found from the numbers.
    pub(crate) gr: Blocks,
    pub(crate) ge: Blocks,
    pub(crate) reason: String,
}

impl Layout {
    pub(crate) fn detect(listed: &Listed<'_>, arrays: &Arrays) -> Self {
        let (name, reason) = declared(listed);
        let dialect_named = |name: &str| DIALECTS.into_iter().find(|(known, ..)| *known == name);
        let declared = name.and_then(dialect_named);
        let found = [
            fitting(|blocks| {
                let [even, odd] = blocks.gr_misfit(arrays);
                even.max(odd)
            }),
            fitting(|blocks| blocks.ge_misfit(arrays).min(blocks.ge_doubled(arrays))),
        ];
        let usual = declared.map_or((Blocks::Component, Blocks::Component), |(_, gr, ge)| (gr, ge));
        let (gr, ge) = (found[0].unwrap_or(usual.0), found[1].unwrap_or(usual.1));
        let by_numbers = DIALECTS.into_iter().find(|&(_, a, b)| (a, b) == (gr, ge)).map(|(name, ..)| name);
        let dialect = match declared {
            Some((name, ..)) => name,
            None => by_numbers.unwrap_or("none"),
        };
        let reason =
            format!("{reason}; Gr is {}, Ge is {}, {}", gr.words(), ge.words(), listed.modes.words());
        Self { dialect, declared, gr, ge, reason }
    }
}

/// Reads the arrays. If no name states the dialect, `m1` is taken as counted by rows if J1 is the symmetric
/// part of Gr only in that order.
pub(crate) fn arrays_in_order(listed: &mut Listed<'_>, digits: Digits) -> Arrays {
    let arrays = Arrays::new(listed, digits);
    if listed.modes != ModeIndex::Middle || declared(listed).0.is_some() || arrays.inertia.m1.is_none() {
        return arrays;
    }
    let misfit = |arrays: &Arrays, blocks: Blocks| blocks.gr_misfit(arrays)[0];
    let usual = Blocks::ALL.map(|blocks| misfit(&arrays, blocks)).into_iter().fold(f64::INFINITY, f64::min);
    listed.modes = ModeIndex::Rows;
    let by_rows = Arrays::new(listed, digits);
    if misfit(&by_rows, Blocks::Mode) < MAX_MISFIT_RATIO * usual {
        return by_rows;
    }
    listed.modes = ModeIndex::Middle;
    arrays
}

/// Returns the dialect declared by names, and the reason.
fn declared<'l>(listed: &'l Listed<'_>) -> (Option<&'l str>, String) {
    if let Some(name) = listed.named_dialect() {
        let name = if name == MODE_BLOCKED { "embs" } else { name };
        (Some(name), format!("the first line names the dialect {name}"))
    } else if listed.has_morembs_names() {
        (Some("morembs"), "the first moment is called mCM or the inertia mmi".to_owned())
    } else if listed.comment.contains("PY_SID") {
        (Some("py-sid"), "the first line names PY_SID".to_owned())
    } else if listed.has_square_inertia() || listed.modes == ModeIndex::Last {
        (Some("fembeam"), "J is 3 x 3 or m1 has the mode last".to_owned())
    } else {
        (None, "no name in the file tells the dialect".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_lines_of_three_writers() {
        let own = Declared::of(
            "flexbody 1.0, dialect fembs, units mm tonne s, geometric stiffness for spin, body a, body b",
        );
        assert_eq!((own.name.as_str(), own.stiffened, own.general), ("a, body b", Some(true), false));
        assert_eq!(own.units.map(|units| units.mass.name().to_owned()), Some("tonne".to_owned()));
        let other = Declared::of("SID generated by MATLABMORInterface Geo_Stiff=no");
        assert_eq!(other, Declared { stiffened: Some(false), ..Declared::default() });
        assert_eq!(Declared::of("FEMBS including Geo_Stiff= yes at May 26").stiffened, Some(true));
        assert_eq!(Declared::of("Geo_Stiff = No").stiffened, Some(false));
        assert_eq!(Declared::of("").stiffened, None);
    }
}
