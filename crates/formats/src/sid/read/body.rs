//! Conversion of the arrays of a file into a body.

use super::arrays::{Array, Arrays, FrameArrays, largest};
use super::parse::Listed;
use crate::import::{ImportedBody, ImportedFrame};
use faer::Mat;
use flexbody_base::units::UnitSystem;
use flexbody_body::invariants::{Numbered, TermGroups};
use flexbody_model::{GeometricStiffness, LoadKind, UnitLoad};
use nalgebra::Vector3;

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
