//! Inertia, stiffness and damping of a body in the coordinates of other programs: matrices in the motions of interface
//! frames, and the nine invariants.

use super::Holding::{Held, NotApplicable};
use super::{ExportChecklist, ExportOptions, losses};
use crate::export::stresses::{without_named_loads, without_recoveries};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::Numbered;
use flexbody_linalg::combine;

/// The body in interface coordinates \[q; eta\]: translations and rotations of each frame along body axes, in
/// the order of the frames, then the amplitudes of the fixed-interface modes.
pub(crate) struct InterfaceMatrices<'a> {
    /// Name and origin of each frame, body axes. Unit: length.
    pub frames: Vec<(&'a str, [f64; 3])>,
    /// Stiffness matrix K (nc x nc).
    pub stiffness: &'a Mat<f64>,
    /// Mass matrix M (nc x nc).
    pub mass: &'a Mat<f64>,
    /// Damping matrix D (nc x nc); `None` without damping. D = M B D_ff B' M, so that B' D B = D_ff and rigid
    /// motion is not damped.
    pub damping: Option<Mat<f64>>,
}

impl<'a> InterfaceMatrices<'a> {
    /// Returns the matrices of a body in space with Craig-Bampton coordinates, all of whose interfaces have
    /// reference points. Messages name the `format`.
    ///
    /// # Errors
    /// [`ExportLoses`](Code::ExportLoses) for any other body.
    pub(crate) fn of(body: &'a FlexBody, format: &str) -> Result<Self> {
        let refuse = |what: String, help: &str| {
            let message =
                format!("{format} needs K and M in the motions of interfaces with reference points: {what}");
            Err(Diagnostic::new(Code::ExportLoses, message).with_help(help).into())
        };
        let Some(coordinates) = body.coordinates() else {
            if !body.conditions().is_mean() {
                let help = "convert the model with --basis craig-bampton --frame com: its matrices hold the motion of every interface";
                return refuse(body.conditions().to_string(), help);
            }
            let what = "the body has free modes only".to_owned();
            return refuse(what, "convert the model again with flexbody convert --basis craig-bampton");
        };
        if body.dimension() != 3 {
            return refuse(
                "the matrices of a plane body have no inertia out of the plane".to_owned(),
                "export a body of a model in space",
            );
        }
        if let Some(free) = body.interfaces().iter().find(|interface| interface.reference.is_none()) {
            let help = "couple the interface rigidly or by averaging, and convert the body again";
            return refuse(format!("interface `{}` is free and has no reference point", free.name), help);
        }
        let frames: Vec<(&str, [f64; 3])> = body
            .interfaces()
            .iter()
            .filter_map(|interface| Some((interface.name.as_str(), interface.reference?)))
            .collect();
        // Files may come from anywhere: the names of the coordinates must agree with their expected meaning.
        let names = &coordinates.names;
        let expected = frames.iter().flat_map(|(name, _)| AXES.map(|axis| format!("{name} {axis}")));
        let modal = |name: &String| name.starts_with("fixed-interface mode ");
        let fits = expected.zip(names).filter(|(expected, name)| expected == *name).count()
            == 6 * frames.len()
            && names.iter().skip(6 * frames.len()).all(modal);
        if !fits {
            let what = "the coordinates in the file do not match its interfaces".to_owned();
            return refuse(what, "convert the model again with flexbody convert --basis craig-bampton");
        }
        let damping = losses::is_damped(body).then(|| {
            let weighted = combine(coordinates.mass.as_ref(), coordinates.of_modes.as_ref());
            let half = combine(weighted.as_ref(), body.damping().as_ref());
            let whole = combine(half.as_ref(), weighted.as_ref().transpose());
            Mat::from_fn(whole.nrows(), whole.ncols(), |i, j| 0.5 * (whole[(i, j)] + whole[(j, i)]))
        });
        let finite = |a: &Mat<f64>| a.col_iter().all(|column| column.iter().all(|v| v.is_finite()));
        if !damping.as_ref().is_none_or(finite) {
            let what = "their damping overflows double precision".to_owned();
            return refuse(what, "--to-units");
        }
        Ok(Self { frames, stiffness: &coordinates.stiffness, mass: &coordinates.mass, damping })
    }
}

const AXES: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];

/// Returns the holdings of a format with these matrices. The matrices describe the motions of the frames:
/// nodes and their modes are not in the file.
pub(crate) fn matrix_checklist(body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
    let small = "K and M hold for small motions only";
    ExportChecklist {
        rigid_coupling: Held,
        // Plane bodies were rejected before.
        plane: NotApplicable,
        deformed_inertia: losses::changing_inertia(body, options, "W1", small),
        general_w0: losses::general_w0(body),
        // These terms are lost with the inertia of the deformed body.
        coriolis_force: NotApplicable,
        general_w3: NotApplicable,
        separate_w2: NotApplicable,
        geometric_stiffness: losses::geometric_stiffness(body, options, |_| false),
        inertia_stiffness: losses::inertia_stiffness(body, options, |_| false),
        damping: Held,
        shapes: NotApplicable,
        rotations: NotApplicable,
        internal_rows: NotApplicable,
        gravity: Held,
        interfaces: Held,
        surface: NotApplicable,
        origins_of_modes: NotApplicable,
        units: Held,
        storage: NotApplicable,
        named_loads: without_named_loads(body),
        recoveries: without_recoveries(body),
    }
}

// The nine invariants for programs whose mass commutes with rotations.

/// Returns I1 to I9 of a body for programs that take I5_jk as antisymmetric in j and k and use I9 twice: its
/// part that is symmetric in a and b for W2, the other part for W3 (Coriolis). I5 and I9 are always present,
/// zero if the body does not hold them.
///
/// For a mass that commutes with rotations the result is
/// [`Invariants::numbered`](flexbody_body::invariants::Invariants::numbered). For other masses, and for a
/// body that holds only one of W2 and W3, I9_jk(a,b) = -(W2 + W2')/2 -+ W3_c / 2 is assembled from the terms
/// of the body, with the antisymmetric part of W3: the equations then conserve momentum and energy like those
/// of the body. The omitted part is the loss reported by [`general_w3`](super::losses::general_w3).
pub(crate) fn inertia(body: &FlexBody) -> Numbered {
    let invariants = body.invariants();
    let nf = body.n_modes();
    let mut numbered = invariants.numbered();
    if invariants.general().is_none() && numbered.groups.w2 && numbered.groups.w3 {
        return numbered;
    }
    let w3 = numbered.i5.take().unwrap_or_else(|| Mat::zeros(3 * nf, nf));
    let w2 = numbered.i9.take().unwrap_or_else(|| Mat::zeros(3 * nf, 3 * nf));
    let i5 = |c: usize, j: usize, k: usize| 0.5 * (w3[(c * nf + j, k)] - w3[(c * nf + k, j)]);
    let i9 = |row: usize, column: usize| {
        let (a, j, b, k) = (row / nf, row % nf, column / nf, column % nf);
        let symmetric = 0.5 * (w2[(row, column)] + w2[(b * nf + j, a * nf + k)]);
        match (3 + b - a) % 3 {
            0 => symmetric,
            1 => symmetric - 0.5 * i5(3 - a - b, j, k),
            _ => symmetric + 0.5 * i5(3 - a - b, j, k),
        }
    };
    numbered.i9 = Some(Mat::from_fn(3 * nf, 3 * nf, i9));
    numbered.i5 = Some(Mat::from_fn(3 * nf, nf, |row, k| i5(row / nf, row % nf, k)));
    numbered
}
