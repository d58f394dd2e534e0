//! OpenRadioss: data file of `/FXBODY`, as the starter reads it (`hm_read_fxb.F`) and derives it from a DMIG
//! file (`ini_fxbody.F`).
//!
//! Twelve rigid modes move a node at x (body axes) by the velocities of four points in space: the ends p_I of
//! the body axes and their origin p_0. Rigid mode 3 (I - 1) + J is x_I e_J, rigid mode 9 + J is (1 - x_1 -
//! x_2 - x_3) e_J. The columns of the rotation matrix are p_I - p_0. If nodes have rotations, three more
//! modes rotate all nodes about the axes in space. Local modes rotate with the body.
//!
//! With s_I = x_I, s_0 = 1 - sum x_I and E_ab = e_a e_b', the products follow from J, c, m, Ibar and C1: s_I'
//! Ms s_K = J_IK, s_0' Ms s_I = c_I - sum_K J_IK, s_I' Ms Psi_k = `Ibar_Ik`, s_0' Ms Psi_k = C1_k - sum_I
//! Ibar_Ik. They give the exact kinetic energy of the undeformed body for any mass: J, Ibar and C1 represent
//! its I0, C2 and W1. The rows of the three rotations are zero: their inertia is contained in the other
//! twelve modes, to which the program ties them.

use super::export::Holding::{Held, NotApplicable};
use super::export::frames::{ExportFrame, frames};
use super::export::{ExportChecklist, ExportFormat, ExportOptions, Exported, losses};
use crate::export::stresses::{without_named_loads, without_recoveries};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use nalgebra::Vector3;
use std::fmt::Write;

/// Export format of OpenRadioss.
pub(crate) struct OpenRadioss;

impl ExportFormat for OpenRadioss {
    fn name(&self) -> &'static str {
        "openradioss"
    }

    fn reader(&self) -> &'static str {
        "OpenRadioss and Radioss, /FXBODY"
    }

    fn has_points(&self) -> bool {
        true
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        let other = losses::is_damped(body) && rayleigh(body).is_none();
        let what = "damping of the modes other than alpha M + beta K";
        ExportChecklist {
            rigid_coupling: Held,
            plane: losses::plane(body),
            // The velocities of the program omit the rotation of the deformation (`fxbodvp.F`).
            deformed_inertia: losses::changing_inertia(
                body,
                options,
                "W1 except its centrifugal load",
                "OpenRadioss takes the inertia of the undeformed body",
            ),
            general_w0: losses::general_w0(body),
            // Terms of W2 and W3 are lost together with the inertia of the deformed body.
            coriolis_force: NotApplicable,
            general_w3: NotApplicable,
            separate_w2: NotApplicable,
            geometric_stiffness: losses::geometric_stiffness(body, options, |_| false),
            inertia_stiffness: losses::inertia_stiffness(body, options, |_| false),
            damping: if other { losses::damping(body, options, what) } else { Held },
            shapes: Held,
            rotations: Held,
            internal_rows: losses::internal_rows(body),
            gravity: Held,
            interfaces: Held,
            surface: NotApplicable,
            origins_of_modes: NotApplicable,
            units: NotApplicable,
            storage: NotApplicable,
            named_loads: without_named_loads(body),
            recoveries: without_recoveries(body),
        }
    }

    fn write(&self, body: &FlexBody, options: &ExportOptions) -> Result<Exported> {
        let frames = frames(body, &options.points);
        if let Some(frame) = frames.iter().find(|frame| !(1..=LARGEST).contains(&frame.id)) {
            let message = format!("openradioss cannot hold node number {}: it has eight columns", frame.id);
            let help = format!("number the nodes from 1 to {LARGEST}, or choose other nodes with --points");
            return Err(Diagnostic::new(Code::ExportLoses, message).with_help(help).into());
        }
        let deck = Deck::of(body, &frames);
        if !deck.finite {
            let message = "openradioss needs products of stiffness and inertia, which overflow double precision for this body";
            return Err(Diagnostic::new(Code::ExportLoses, message).with_help("--to-units").into());
        }
        Ok(Exported::single(deck.text.into_bytes()))
    }
}

/// Largest integer that fits into eight columns.
const LARGEST: i64 = 99_999_999;

/// Width of a number in columns.
const WIDTH: usize = 16;

/// Returns alpha and beta of D = alpha I + beta diag(lambda) if the modal damping has this form.
fn rayleigh(body: &FlexBody) -> Option<[f64; 2]> {
    /// Rounding error of a projected matrix, relative.
    const ROUNDING: f64 = 1e-9;
    // alpha and beta from the first and the last diagonal entry; all entries must then agree.
    let (d, lambda) = (body.damping(), &body.modes().eigenvalue);
    let last = lambda.len() - 1;
    let slope = (d[(last, last)] - d[(0, 0)]) / (lambda[last] - lambda[0]);
    let beta = if slope.is_finite() { slope } else { 0.0 };
    let alpha = d[(0, 0)] - beta * lambda[0];
    let size = |j: usize| (alpha.abs() + beta.abs() * lambda[j]).sqrt();
    let fitted = |i: usize, j: usize| if i == j { alpha + beta * lambda[j] } else { 0.0 };
    let is_fitted = |i: usize, j: usize| (d[(i, j)] - fitted(i, j)).abs() <= ROUNDING * size(i) * size(j);
    (0..=last).all(|i| (0..=last).all(|j| is_fitted(i, j))).then_some([alpha, beta])
}

/// Text of the file under construction.
struct Deck {
    text: String,
    /// True if all products of numbers of the body are in the range of double precision.
    finite: bool,
}

impl Deck {
    fn of(body: &FlexBody, frames: &[ExportFrame]) -> Self {
        let (nf, invariants) = (body.n_modes(), body.invariants());
        let turning = frames.iter().any(|frame| frame.rotation.is_some());
        let damping = losses::is_damped(body).then(|| rayleigh(body)).flatten();
        let mut deck = Self { text: String::new(), finite: true };
        // Sizes, nodes and the positions where the deck needs them.
        deck.remark("flexible body of /FXBODY, written by flexbody");
        deck.remark("  NMOD    NMST    NBNO    IROT   IDAMP    IBLO   IFILE");
        deck.integers(&[nf, 0, frames.len(), turning.into(), damping.is_some().into(), 0, 0], 7);
        deck.remark("nodes");
        deck.place(body, "the main node, which is not one of these,", &[0.0; 3]);
        for frame in frames {
            if let Some(name) = &frame.name {
                let which = format!("node {} of {}", frame.id, name.escape_default());
                deck.place(body, &which, &frame.position);
            }
        }
        let ids: Vec<i64> = frames.iter().map(|frame| frame.id).collect();
        deck.integers(&ids, 10);
        // Orientation of the body axes, and the highest natural frequency sqrt(lambda) / (2 pi).
        deck.remark("rotation matrix, row by row, and the highest frequency");
        let highest = body.modes().eigenvalue.iter().copied().fold(0.0, f64::max).sqrt();
        let mut rotation: Vec<f64> = body.frame().axes.transpose().iter().copied().collect();
        rotation.push(highest / std::f64::consts::TAU);
        deck.numbers(rotation);
        if let Some(damping) = damping {
            deck.remark("damping alpha M + beta K");
            deck.numbers(damping);
        }
        // Rigid modes: the four points with their weights s, then the rotations.
        let sets = if turning { 5 } else { 4 };
        for (set, axis) in (0..sets).flat_map(|set| [0, 1, 2].map(|axis| (set, axis))) {
            deck.remark(&format!("rigid mode {}", 3 * set + axis + 1));
            for frame in frames {
                let (s, mut moved) = (weights(&frame.position), [0.0; 6]);
                if set < 4 {
                    moved[axis] = s[set];
                } else {
                    moved[3 + axis] = 1.0;
                }
                deck.numbers(moved);
            }
        }
        // Local modes, node by node: displacement and rotation.
        for j in 0..nf {
            deck.remark(&format!("local mode {}", j + 1));
            for frame in frames {
                let turned = |k: usize| frame.rotation.as_ref().map_or(0.0, |rotation| rotation[(k, j)]);
                let moved = |k: usize| if k < 3 { frame.translation[(k, j)] } else { turned(k - 3) };
                deck.numbers((0..6).map(moved));
            }
        }
        // Diagonal mass and stiffness of the local modes, then the coupling products.
        let diagonal = |a: &faer::Mat<f64>| (0..nf).map(|j| a[(j, j)]).collect::<Vec<f64>>();
        deck.remark("mass of the local modes");
        deck.numbers(diagonal(&invariants.modal_mass()));
        deck.remark("stiffness of the local modes");
        deck.numbers(diagonal(invariants.modal_stiffness()));
        deck.products(body, 3 * sets);
        deck
    }

    /// Writes the products of the rigid modes with the mass, and of rigid and local modes with mass and
    /// stiffness.
    fn products(&mut self, body: &FlexBody, rigid: usize) {
        let (nf, invariants) = (body.n_modes(), body.invariants());
        let (mass, c, moment) = (invariants.mass(), invariants.first_moment(), invariants.second_moment());
        let scalar = |p: usize, q: usize| match (p, q) {
            (3, 3) => mass - 2.0 * c.sum() + moment.sum(),
            (3, axis) | (axis, 3) => c[axis] - moment.row(axis).sum(),
            (p, q) => moment[(p, q)],
        };
        let pair =
            |l: usize, r: usize| if l % 3 == r % 3 && l.max(r) < 12 { scalar(l / 3, r / 3) } else { 0.0 };
        self.remark("mass of the rigid modes, upper triangle");
        self.numbers((0..rigid).flat_map(|l| (l..rigid).map(move |r| (l, r))).map(|(l, r)| pair(l, r)));
        let ibar_stored = invariants.ibar_or_half_c2();
        let ibar = |set: usize, axis: usize, j: usize| match set {
            3 => invariants.c1()[(axis, j)] - (0..3).map(|k| ibar_stored[k][axis][j]).sum::<f64>(),
            _ => ibar_stored[set][axis][j],
        };
        // Product of rigid mode l along e_a with E_ab psi_j: component b of the mode.
        for (a, b) in (0..3).flat_map(|a| [0, 1, 2].map(|b| (a, b))) {
            self.remark(&format!("mass that couples rigid and local modes, E{}{}", a + 1, b + 1));
            let entry = |l: usize, j: usize| if l % 3 == a && l < 12 { ibar(l / 3, b, j) } else { 0.0 };
            self.numbers((0..rigid).flat_map(|l| (0..nf).map(move |j| (l, j))).map(|(l, j)| entry(l, j)));
        }
        // By K psi_j = lambda_j M psi_j. A rigid motion causes no strain, so that the antisymmetric part and
        // C1 are rounding.
        let strained = |set: usize, axis: usize, j: usize| {
            let symmetric_along = |k: usize| 0.5 * (ibar_stored[k][axis][j] + ibar_stored[axis][k][j]);
            let symmetric =
                if set == 3 { -(0..3).map(symmetric_along).sum::<f64>() } else { symmetric_along(set) };
            invariants.modal_stiffness()[(j, j)] * symmetric
        };
        for (a, b) in (0..3).flat_map(|a| [0, 1, 2].map(|b| (a, b))) {
            self.remark(&format!("stiffness that couples rigid and local modes, E{}{}", a + 1, b + 1));
            let entry = |l: usize, j: usize| if l % 3 == b && l < 12 { strained(l / 3, a, j) } else { 0.0 };
            self.numbers((0..rigid).flat_map(|l| (0..nf).map(move |j| (l, j))).map(|(l, j)| entry(l, j)));
        }
    }

    /// Writes a comment line; the reader skips lines that begin with #.
    fn remark(&mut self, text: &str) {
        writeln!(self.text, "# {text}").expect("writing to a String cannot fail");
    }

    /// Writes a comment with the position in the model where the deck needs a node.
    fn place(&mut self, body: &FlexBody, which: &str, position: &[f64; 3]) {
        let frame = body.frame();
        let [x, y, z] = (frame.origin + frame.axes * Vector3::from(*position)).into();
        self.remark(&format!("{which} lies at {x:e} {y:e} {z:e} in model axes"));
    }

    fn integers<T: std::fmt::Display>(&mut self, values: &[T], per_line: usize) {
        for line in values.chunks(per_line) {
            line.iter()
                .for_each(|value| write!(self.text, "{value:>8}").expect("writing to a String cannot fail"));
            self.text.push('\n');
        }
    }

    /// Writes five numbers per line.
    fn numbers(&mut self, values: impl IntoIterator<Item = f64>) {
        let mut on_line = 0;
        for value in values {
            if !value.is_finite() {
                self.finite = false;
                return;
            }
            if on_line == 5 {
                self.text.push('\n');
                on_line = 0;
            }
            write!(self.text, "{:>WIDTH$}", number(value)).expect("writing to a String cannot fail");
            on_line += 1;
        }
        self.text.push('\n');
    }
}

/// Returns s_1, s_2, s_3, s_0 of a node.
fn weights(x: &[f64; 3]) -> [f64; 4] {
    [x[0], x[1], x[2], 1.0 - x[0] - x[1] - x[2]]
}

/// Returns a number with as many digits as its columns hold: 15 for numbers from 0.1, 11 to 13 for others,
/// one less for negative numbers. Fortran reads exponents without a letter.
fn number(value: f64) -> String {
    let fits = |text: &String| text.len() <= WIDTH;
    for digits in (1..=15).rev() {
        let scientific = format!("{value:.*e}", digits - 1);
        let Some((mantissa, exponent)) = scientific.split_once('e') else { continue };
        let power: i32 = exponent.parse().unwrap_or(0);
        let decimals = usize::try_from(digits as i32 - 1 - power).ok();
        let plain = decimals.map(|decimals| trimmed(&format!("{value:.decimals$}")));
        let short = format!("{}{}{exponent}", trimmed(mantissa), if power < 0 { "" } else { "+" });
        if let Some(text) = plain.filter(fits).or(Some(short).filter(fits)) {
            return text;
        }
    }
    unreachable!("one digit with sign, point and exponent takes seven columns")
}

/// Returns a number with a decimal point and without redundant zeros.
fn trimmed(text: &str) -> String {
    let mut text =
        if text.contains('.') { text.trim_end_matches('0').to_owned() } else { format!("{text}.") };
    let start = usize::from(text.starts_with('-'));
    if text[start..].starts_with("0.") && text.len() > start + 2 {
        text.remove(start);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_keep_the_digits_that_sixteen_columns_take() {
        let shown = [
            (0.0, "0."),
            (1.0, "1."),
            (-0.5, "-.5"),
            (1.0 / 3.0, ".333333333333333"),
            (-1.0 / 3.0, "-.33333333333333"),
            (123_456.789_012_345_67, "123456.789012346"),
            (1.234_567_890_123_456_7e-5, "1.234567890123-5"),
            (-1.234_567_890_123_456_7e-12, "-1.2345678901-12"),
            (2.5e100, "2.5+100"),
            (9.999_999_999_999_999e-6, ".00001"),
            (-1.234_567_890_123_456_7e-308, "-1.23456789-308"),
        ];
        for (value, text) in shown {
            assert_eq!(number(value), text);
        }
    }
}
