//! Arrays of SID from the numbered invariants and the geometric stiffness of a body.

use super::dialect::{Blocks, Dialect};
use super::text::Taylor;
use crate::export::losses::is_damped;
use crate::export::stresses::NodalStresses;
use crate::export::{ExportFrame, frames};
use faer::Mat;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::Numbered;
use flexbody_model::LoadKind;
use flexbody_motion::dynamics::{Stiffening, stiffness_under};
use nalgebra::Matrix3;

/// Indices of the components (11, 22, 33, 12, 13, 23), the order of J.
const INERTIA: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Returns (K + K') / 2 for the components of a kind of load; `None` if the body has none of them.
fn stiffness(body: &FlexBody, kind: &LoadKind) -> Option<Vec<Mat<f64>>> {
    let (nf, entry) = (body.n_modes(), stiffness_under(body, kind, Stiffening::All)?);
    let symmetric_part = |component: usize| Mat::from_fn(nf, nf, |i, j| entry(component, i, j));
    Some((0..kind.components().len()).map(symmetric_part).collect())
}

fn per_mode(nf: usize, matrix: impl FnMut(usize) -> Mat<f64>) -> Vec<Mat<f64>> {
    (0..nf).map(matrix).collect()
}

/// Returns J in the form of the dialect.
fn inertia(dialect: &Dialect, i: &Matrix3<f64>) -> Mat<f64> {
    let i = 0.5 * (i + i.transpose());
    if dialect.square_inertia {
        Mat::from_fn(3, 3, |k, l| i[(k, l)])
    } else {
        Mat::from_fn(6, 1, |at, _| i[INERTIA[at]])
    }
}

/// Returns the columns of Gr or Ge in the order of the dialect, from `entry(row, axis, mode)`.
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

/// Returns the arrays from mdCM to De in the order of the file.
///
/// The elastic forces (7.3) of theory section 7 are in Ct(q) (a - g), Cr(q) alpha and Oe(q) of the spin
/// products. The rows of translation and rotation then have the same Ct(q), Cr(q) as (7.4).
pub(crate) fn modal(body: &FlexBody, dialect: &Dialect) -> Vec<Taylor> {
    let terms = Terms::new(body);
    let Terms { numbered, nf, w1, .. } = &terms;
    let nf = *nf;
    let [first_moment, inertia_name] = dialect.moments;
    vec![
        Taylor::linear(
            first_moment,
            Mat::from_fn(3, 1, |a, _| numbered.i2[a]),
            per_mode(nf, |k| Mat::from_fn(3, 1, |a, _| numbered.i3[(a, k)])),
        ),
        Taylor {
            structure: if dialect.square_inertia {
                super::text::Structure::Symmetric
            } else {
                super::text::Structure::Full
            },
            ..Taylor::linear(
                inertia_name,
                inertia(dialect, &numbered.i7),
                per_mode(nf, |k| inertia(dialect, &w1[k])),
            )
        },
        terms.ct(),
        terms.cr(),
        Taylor::symmetric("Me", numbered.i6.clone()),
        Taylor::constant("Gr", blocks(3, nf, dialect.gr, |row, a, k| 2.0 * numbered.i8[k][(row, a)])),
        // The Coriolis force needs the skew part only; for a solid the symmetric part is zero.
        Taylor::constant("Ge", blocks(nf, nf, dialect.ge, |k, a, l| terms.w3(a, l, k) - terms.w3(a, k, l))),
        terms.oe(),
        Taylor::zero("ksigma", nf, 1),
        Taylor::symmetric("Ke", body.invariants().modal_stiffness().clone()),
        if is_damped(body) { Taylor::symmetric("De", body.damping()) } else { Taylor::zero("De", nf, nf) },
    ]
}

/// Terms of a body from which the arrays are formed.
struct Terms {
    numbered: Numbered,
    nf: usize,
    /// I8 + I8' of every mode.
    w1: Vec<Matrix3<f64>>,
    /// Geometric stiffness for acceleration, angular acceleration and spin; `None` without.
    acceleration: Option<Vec<Mat<f64>>>,
    turn: Option<Vec<Mat<f64>>>,
    spin: Option<Vec<Mat<f64>>>,
}

impl Terms {
    fn new(body: &FlexBody) -> Self {
        let numbered = body.invariants().numbered();
        Self {
            nf: body.n_modes(),
            w1: numbered.i8.iter().map(|i8| i8 + i8.transpose()).collect(),
            numbered,
            acceleration: stiffness(body, &LoadKind::Acceleration),
            turn: stiffness(body, &LoadKind::AngularAcceleration),
            spin: stiffness(body, &LoadKind::Spin),
        }
    }

    /// Returns entry (l, k) of the block of I5 for an axis; zero without W3.
    fn w3(&self, a: usize, l: usize, k: usize) -> f64 {
        self.numbered.i5.as_ref().map_or(0.0, |i5| i5[(a * self.nf + l, k)])
    }

    fn ct(&self) -> Taylor {
        let nf = self.nf;
        let mut ct = Taylor::constant("Ct", Mat::from_fn(nf, 3, |k, a| self.numbered.i3[(a, k)]));
        let linear = |stiff: &Vec<Mat<f64>>| per_mode(nf, |l| Mat::from_fn(nf, 3, |k, a| stiff[a][(k, l)]));
        ct.m1 = self.acceleration.as_ref().map(linear);
        ct
    }

    fn cr(&self) -> Taylor {
        let nf = self.nf;
        let turned = |a: usize, k: usize, l: usize| entry(self.turn.as_ref(), a, k, l);
        Taylor::linear(
            "Cr",
            Mat::from_fn(nf, 3, |k, a| self.numbered.i4[(a, k)]),
            per_mode(nf, |l| Mat::from_fn(nf, 3, |k, a| self.w3(a, l, k) + turned(a, k, l))),
        )
    }

    fn oe(&self) -> Taylor {
        let nf = self.nf;
        let constant = |k: usize, pair: usize| {
            let (a, b) = LoadKind::SPIN[pair];
            if a == b { -0.5 * self.w1[k][(a, a)] } else { -self.w1[k][(a, b)] }
        };
        Taylor::linear(
            "Oe",
            Mat::from_fn(nf, 6, constant),
            per_mode(nf, |l| Mat::from_fn(nf, 6, |k, pair| self.centrifugal(k, l, pair))),
        )
    }

    /// Returns an entry of Oe1 for a pair of axes: W2 plus geometric stiffness for spin.
    fn centrifugal(&self, k: usize, l: usize, pair: usize) -> f64 {
        let nf = self.nf;
        let (a, b) = LoadKind::SPIN[pair];
        let both = |i9: &Mat<f64>| {
            let sum = i9[(a * nf + k, b * nf + l)] + i9[(a * nf + l, b * nf + k)];
            if a == b { 0.5 * sum } else { sum }
        };
        self.numbered.i9.as_ref().map_or(0.0, both) + entry(self.spin.as_ref(), pair, k, l)
    }
}

/// Returns an entry of a component of geometric stiffness; zero without.
fn entry(stiffness: Option<&Vec<Mat<f64>>>, component: usize, i: usize, j: usize) -> f64 {
    stiffness.map_or(0.0, |stiffness| stiffness[component][(i, j)])
}

/// A frame with the stiffness of a unit force and a unit moment at it.
pub(crate) struct StiffenedFrame {
    pub(crate) frame: ExportFrame,
    force: Option<Vec<Mat<f64>>>,
    moment: Option<Vec<Mat<f64>>>,
    /// Stresses of the undeformed body (6 x 1) and in every mode; `None` for a body without stresses of nodes.
    stresses: Option<(Mat<f64>, Vec<Mat<f64>>)>,
}

impl StiffenedFrame {
    /// Returns origin, phi, psi, AP and, for a body with stresses of nodes, sigma (xx, yy, zz, xy, yz, xz). The second-order motion (7.5) is in phi1 and psi1.
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
        let sigma = self.stresses.clone().map(|(rest, modes)| Taylor::linear("sigma", rest, modes));
        let objects = vec![
            Taylor::linear(
                "origin",
                Mat::from_fn(3, 1, |a, _| position[a]),
                per_mode(nf, |k| Mat::from_fn(3, 1, |a, _| translation[(a, k)])),
            ),
            phi,
            psi,
            Taylor::linear("AP", Mat::identity(3, 3), per_mode(nf, turned)),
        ];
        objects.into_iter().chain(sigma).collect()
    }

    /// Returns true if a force or moment of this kind acts at the frame and the file has its stiffness.
    pub(crate) fn holds(&self, kind: &LoadKind) -> bool {
        kind.interface() == self.frame.name.as_deref()
            && match kind {
                LoadKind::Force(_) => self.force.is_some(),
                LoadKind::Moment(_) => self.moment.is_some(),
                _ => false,
            }
    }
}

/// Returns the frames of the file. Stiffness of forces at an interface belongs to the reference point.
pub(crate) fn places(body: &FlexBody, points: &crate::export::Points) -> Vec<StiffenedFrame> {
    let frames = frames(body, points);
    let stresses = NodalStresses::new(body, frames.iter().map(|frame| frame.id));
    let place = |(at, frame): (usize, ExportFrame)| {
        let interface = body
            .interfaces()
            .iter()
            .find(|one| Some(&one.name) == frame.name.as_ref() && one.reference == Some(frame.position));
        let stiffness_for = |kind: fn(String) -> LoadKind| {
            interface.and_then(|interface| stiffness(body, &kind(interface.name.clone())))
        };
        let moment = if frame.rotation.is_some() { stiffness_for(LoadKind::Moment) } else { None };
        let column = |values: [f64; 6]| Mat::from_fn(6, 1, |c, _| values[c]);
        let of_modes = |own: &NodalStresses<'_>| per_mode(body.n_modes(), |k| column(own.in_mode(at, k)));
        let stresses = stresses.as_ref().map(|own| (column(own.at_rest(at)), of_modes(own)));
        StiffenedFrame { force: stiffness_for(LoadKind::Force), moment, stresses, frame }
    };
    frames.into_iter().enumerate().map(place).collect()
}
