//! The arrays of SID from the numbered invariants and geometric stiffness of a body.

use super::dialect::{Blocks, Dialect};
use super::text::Taylor;
use crate::body::flex_body::FlexBody;
use crate::body::invariants::Numbered;
use crate::formats::export::losses::is_damped;
use crate::formats::export::{ExportFrame, frames};
use crate::model::LoadKind;
use crate::motion::dynamics::geometric_stiffness;
use faer::Mat;
use nalgebra::Matrix3;

/// Places of (11, 22, 33, 12, 13, 23), the order of J.
const INERTIA: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// (K + K') / 2 of the components of a kind of load, `None` where not one is given.
fn stiffness(body: &FlexBody, kind: &LoadKind) -> Option<Vec<Mat<f64>>> {
    let (nf, entry) = (body.n_modes(), geometric_stiffness(body, kind)?);
    let symmetric_part = |component: usize| Mat::from_fn(nf, nf, |i, j| entry(component, i, j));
    Some((0..kind.components().len()).map(symmetric_part).collect())
}

fn per_mode(nf: usize, matrix: impl FnMut(usize) -> Mat<f64>) -> Vec<Mat<f64>> {
    (0..nf).map(matrix).collect()
}

/// J as the dialect has it.
fn inertia(dialect: &Dialect, i: &Matrix3<f64>) -> Mat<f64> {
    let i = 0.5 * (i + i.transpose());
    if dialect.square_inertia {
        Mat::from_fn(3, 3, |k, l| i[(k, l)])
    } else {
        Mat::from_fn(6, 1, |at, _| i[INERTIA[at]])
    }
}

/// Columns of Gr or Ge in the order of the dialect: `entry(row, axis, mode)`.
fn blocks(nrow: usize, nf: usize, order: Blocks, entry: impl Fn(usize, usize, usize) -> f64) -> Mat<f64> {
    let mut all = Mat::zeros(nrow, 3 * nf);
    for row in 0..nrow {
        for a in 0..3 {
            for k in 0..nf {
                all[(row, order.column(a, k, nf))] = entry(row, a, k);
            }
        }
    }
    all
}

/// mdCM to De, in the order of the file.
///
/// The elastic forces (7.3) of theory section 7 are in Ct(q) (a - g), Cr(q) alpha and Oe(q) of the spin products; with them the rows of
/// translation and rotation get the same Ct(q), Cr(q) as (7.4) has.
pub(crate) fn modal(body: &FlexBody, dialect: &Dialect) -> Vec<Taylor> {
    let Numbered { i2, i3, i4, i5, i6, i7, i8, i9, .. } = body.invariants().numbered();
    let nf = body.n_modes();
    let [acceleration, turn, spin] = [LoadKind::Acceleration, LoadKind::AngularAcceleration, LoadKind::Spin]
        .map(|kind| stiffness(body, &kind));
    let stiffness_entry = |k: &Option<Vec<Mat<f64>>>, component: usize, i: usize, j: usize| {
        k.as_ref().map_or(0.0, |k| k[component][(i, j)])
    };
    let i5 = |a: usize, l: usize, k: usize| i5.as_ref().map_or(0.0, |i5| i5[(a * nf + l, k)]);
    let w1: Vec<Matrix3<f64>> = i8.iter().map(|i8| i8 + i8.transpose()).collect();
    let centrifugal = |k: usize, l: usize, pair: usize| {
        let (a, b) = LoadKind::SPIN[pair];
        let both = |i9: &Mat<f64>| {
            let sum = i9[(a * nf + k, b * nf + l)] + i9[(a * nf + l, b * nf + k)];
            if a == b { 0.5 * sum } else { sum }
        };
        i9.as_ref().map_or(0.0, both) + stiffness_entry(&spin, pair, k, l)
    };
    let oe0 = |k: usize, pair: usize| {
        let (a, b) = LoadKind::SPIN[pair];
        if a == b { -0.5 * w1[k][(a, a)] } else { -w1[k][(a, b)] }
    };
    let mut ct = Taylor::constant("Ct", Mat::from_fn(nf, 3, |k, a| i3[(a, k)]));
    ct.m1 = acceleration.as_ref().map(|stiff| per_mode(nf, |l| Mat::from_fn(nf, 3, |k, a| stiff[a][(k, l)])));
    let [first_moment, inertia_name] = dialect.moments;
    vec![
        Taylor::linear(
            first_moment,
            Mat::from_fn(3, 1, |a, _| i2[a]),
            per_mode(nf, |k| Mat::from_fn(3, 1, |a, _| i3[(a, k)])),
        ),
        Taylor {
            structure: if dialect.square_inertia {
                super::text::Structure::Symmetric
            } else {
                super::text::Structure::Full
            },
            ..Taylor::linear(inertia_name, inertia(dialect, &i7), per_mode(nf, |k| inertia(dialect, &w1[k])))
        },
        ct,
        Taylor::linear(
            "Cr",
            Mat::from_fn(nf, 3, |k, a| i4[(a, k)]),
            per_mode(nf, |l| Mat::from_fn(nf, 3, |k, a| i5(a, l, k) + stiffness_entry(&turn, a, k, l))),
        ),
        Taylor::symmetric("Me", i6),
        Taylor::constant("Gr", blocks(3, nf, dialect.gr, |row, a, k| 2.0 * i8[k][(row, a)])),
        // The Coriolis force takes the skew part only, which is all of a solid.
        Taylor::constant("Ge", blocks(nf, nf, dialect.ge, |k, a, l| i5(a, l, k) - i5(a, k, l))),
        Taylor::linear(
            "Oe",
            Mat::from_fn(nf, 6, oe0),
            per_mode(nf, |l| Mat::from_fn(nf, 6, |k, pair| centrifugal(k, l, pair))),
        ),
        Taylor::zero("ksigma", nf, 1),
        Taylor::symmetric("Ke", body.invariants().modal_stiffness.clone()),
        if is_damped(body) { Taylor::symmetric("De", body.damping()) } else { Taylor::zero("De", nf, nf) },
    ]
}

/// A frame with the stiffness of a unit force and a unit moment there.
pub(crate) struct FrameArrays {
    pub(crate) frame: ExportFrame,
    force: Option<Vec<Mat<f64>>>,
    moment: Option<Vec<Mat<f64>>>,
}

impl FrameArrays {
    /// origin, phi, psi and AP. The motion of second order (7.5) is phi1 and psi1.
    pub(crate) fn objects(&self) -> Vec<Taylor> {
        let ExportFrame { position, translation, rotation, .. } = &self.frame;
        let nf = translation.ncols();
        let second = |stiff: &Option<Vec<Mat<f64>>>| {
            let second_order =
                |stiff: &Vec<Mat<f64>>, l: usize| Mat::from_fn(3, nf, |a, k| -stiff[a][(k, l)]);
            stiff.as_ref().map(|stiff| per_mode(nf, |l| second_order(stiff, l)))
        };
        let phi = Taylor { m1: second(&self.force), ..Taylor::constant("phi", translation.clone()) };
        let psi = match rotation {
            Some(rotation) => {
                Taylor { m1: second(&self.moment), ..Taylor::constant("psi", rotation.clone()) }
            }
            None => Taylor::zero("psi", 3, nf),
        };
        let turned = |k: usize| {
            let skew = rotation.as_ref().map_or_else(Matrix3::zeros, |rotation| {
                nalgebra::Vector3::from_fn(|a, _| rotation[(a, k)]).cross_matrix()
            });
            Mat::from_fn(3, 3, |i, j| skew[(i, j)])
        };
        vec![
            Taylor::linear(
                "origin",
                Mat::from_fn(3, 1, |a, _| position[a]),
                per_mode(nf, |k| Mat::from_fn(3, 1, |a, _| translation[(a, k)])),
            ),
            phi,
            psi,
            Taylor::linear("AP", Mat::identity(3, 3), per_mode(nf, turned)),
        ]
    }

    /// Whether a force or moment of this kind acts here and the file has its stiffness.
    pub(crate) fn holds(&self, kind: &LoadKind) -> bool {
        kind.interface() == self.frame.name.as_deref()
            && match kind {
                LoadKind::Force(_) => self.force.is_some(),
                LoadKind::Moment(_) => self.moment.is_some(),
                _ => false,
            }
    }
}

/// The frames of the file. Stiffness of forces at an interface belongs to its reference point.
pub(crate) fn places(body: &FlexBody, points: &crate::formats::export::Points) -> Vec<FrameArrays> {
    let place = |frame: ExportFrame| {
        let interface = body
            .interfaces()
            .iter()
            .find(|one| Some(&one.name) == frame.name.as_ref() && one.reference == Some(frame.position));
        let stiffness_for = |kind: fn(String) -> LoadKind| {
            interface.and_then(|interface| stiffness(body, &kind(interface.name.clone())))
        };
        let moment = if frame.rotation.is_some() { stiffness_for(LoadKind::Moment) } else { None };
        FrameArrays { force: stiffness_for(LoadKind::Force), moment, frame }
    };
    frames(body, points).into_iter().map(place).collect()
}
