//! Project Chrono: matrices for `ChModalAssembly::DoModalReduction(M, K, Cq, ...)` and
//! `ChModalDampingReductionR(R)` as Matrix Market files.
//!
//! These calls take the matrices of boundary nodes, then of internal nodes, six coordinates each. The
//! boundary nodes are the frames; [`Assembly`] defines the internal nodes. The format also writes a table of the
//! nodes.

use crate::export::Holding::{Lost, NotApplicable};
use crate::export::matrices::{InterfaceMatrices, matrix_checklist};
use crate::export::{ExportChecklist, ExportFormat, ExportOptions, Exported};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::FlexBody;
use flexbody_linalg::combine;
use nalgebra::Matrix3;
use std::fmt::Write;

/// Export format of Project Chrono.
pub(crate) struct Chrono;

impl ExportFormat for Chrono {
    fn name(&self) -> &'static str {
        "chrono"
    }

    fn reader(&self) -> &'static str {
        "Project Chrono, ChModalAssembly: matrices for DoModalReduction"
    }

    fn checklist(&self, body: &FlexBody, options: &ExportOptions) -> ExportChecklist {
        ExportChecklist {
            gravity: Lost(
                "the point of action of gravity on the deformed body: Chrono distributes the weight over the nodes as on the undeformed body"
                    .to_owned(),
            ),
            units: NotApplicable,
            ..matrix_checklist(body, options)
        }
    }

    fn needs(&self, body: &FlexBody, _: &ExportOptions) -> Vec<String> {
        let Ok(given) = InterfaceMatrices::of(body, "chrono") else { return Vec::new() };
        let modes = Assembly::modes_to_request(given.mass.nrows() - 6 * given.frames.len());
        vec![
            format!(
                "DoModalReduction must request {modes} modes with SetReductionType(CRAIG_BAMPTON) and SetUseStaticCorrection(false): the body has no more"
            ),
            "gravity acts with SetModalAutomaticGravity(true) alone, the default: nodes and meshes have no mass \
             of their own"
                .to_owned(),
        ]
    }

    fn write(&self, body: &FlexBody, _: &ExportOptions) -> Result<Exported> {
        let given = InterfaceMatrices::of(body, "chrono")?;
        let assembly = Assembly::of(&given)?;
        let mut beside = vec![
            ("M.mtx".into(), matrix_market(&assembly.mass)),
            ("K.mtx".into(), matrix_market(&assembly.stiffness)),
        ];
        beside.extend(assembly.damping.as_ref().map(|damping| ("R.mtx".into(), matrix_market(damping))));
        Ok(Exported { file: table(&given, &assembly, centre_of_mass(body)), beside })
    }
}

/// Returns the centre of mass in the body frame.
fn centre_of_mass(body: &FlexBody) -> [f64; 3] {
    (body.invariants().first_moment() / body.invariants().mass()).into()
}

/// Returns the table of the boundary nodes, with a remark about the internal ones.
fn table(given: &InterfaceMatrices<'_>, assembly: &Assembly, [x, y, z]: [f64; 3]) -> Vec<u8> {
    let internal = assembly.mass.nrows() / 6 - given.frames.len();
    let mut table = format!(
        "# boundary nodes in the order of the matrices, then {internal} internal nodes, all at the centre of mass \
         {x:e} {y:e} {z:e}; modes to request: {}\nname,x,y,z\n",
        Assembly::modes_to_request(assembly.n_modes)
    );
    for (name, [x, y, z]) in &given.frames {
        let name = name.replace('"', "\"\"");
        writeln!(table, "\"{name}\",{x:e},{y:e},{z:e}").expect("writing to a String cannot fail");
    }
    table.into_bytes()
}

/// Returns a symmetric matrix with all its nonzero entries in the general form of Matrix Market, which more
/// readers support than the symmetric form.
fn matrix_market(a: &Mat<f64>) -> Vec<u8> {
    let size = a.nrows();
    let places = (0..size).flat_map(|j| (0..size).map(move |i| (i, j)));
    let entries: Vec<(usize, usize, f64)> =
        places.map(|(i, j)| (i + 1, j + 1, a[(i, j)])).filter(|(_, _, v)| *v != 0.0).collect();
    let mut text =
        format!("%%MatrixMarket matrix coordinate real general\n{size} {size} {}\n", entries.len());
    for (i, j, v) in entries {
        writeln!(text, "{i} {j} {v:e}").expect("writing to a String cannot fail");
    }
    text.into_bytes()
}

// Coordinates of a Chrono assembly in which the automatic gravity of Chrono acts correctly on the body.
//
// `ChModalAssembly` multiplies M with the acceleration of gravity on the translations of all nodes,
// including internal nodes, and keeps the rows of translations only. Modal amplitudes in the place of
// internal translations would get a weight that they do not have, and torques of gravity at the boundary
// nodes would be lost. Both are correct if gravity on all translations is a rigid translation of the body,
// and if M times it has no rows of rotations.
//
// The translation of the first internal node is therefore the displacement of the centre of mass,
// `N^-1 R' M q`, with the rigid translations R in the coordinates q and N = R' M R. All of the weight then
// acts there, and the reduction of Chrono transfers it to boundary nodes and modes with its torques.
// Translations of further internal nodes are modal amplitudes on top of that displacement; rotations are
// amplitudes alone.
//
// The modes need not move the centre of mass in all directions. Three further coordinates, displacements of
// the mass that moves in no mode (the *rest*), complete the basis. Uncoupled modes fill the last node: the
// eigensolvers of Chrono require fewer modes than coordinates and a positive definite mass matrix.
// Frequencies of both lie above those of all modes. A reduction to the number of modes of the body thus
// removes them and reproduces the body.

/// Frequency of the rest mass relative to the highest fixed-interface mode. Higher values cost digits of the
/// stiffness: 4 has an error of 3e-11 of a deflection, 10 of 4e-10 (cantilever with two interfaces and six
/// modes).
const REST_FREQUENCY: f64 = 4.0;

/// Frequency of the modes that fill the last node, relative to that of the rest mass. With [`REST_FREQUENCY`]
/// it keeps these modes above all modes of the body, so that a reduction removes them.
const FILL_FREQUENCY: f64 = 2.0;

/// Share of the mass that is added to the rest mass, so that the basis is complete even if the modes move all
/// of the mass.
const REST_MASS_SHARE: f64 = 0.01;

/// Matrices of boundary nodes and internal nodes, six coordinates each.
struct Assembly {
    /// Mass matrix M.
    mass: Mat<f64>,
    /// Stiffness matrix K.
    stiffness: Mat<f64>,
    /// Damping matrix R; `None` for a body without damping.
    damping: Option<Mat<f64>>,
    /// Number of fixed-interface modes.
    n_modes: usize,
}

impl Assembly {
    /// Returns the number of modes to request from Chrono. Its eigensolvers need at least one: for a body
    /// without fixed-interface modes the three of the rest mass are requested.
    fn modes_to_request(n_modes: usize) -> usize {
        if n_modes == 0 { 3 } else { n_modes }
    }

    /// Transforms `given` to the coordinates of the assembly.
    ///
    /// # Errors
    /// [`ExportLoses`](Code::ExportLoses) if the mass matrix is not that of a body, or numbers leave double
    /// precision.
    fn of(given: &InterfaceMatrices<'_>) -> Result<Self> {
        let refuse = |what: &str| {
            let message = format!(
                "chrono needs the centre of mass of the body, which its matrices do not determine: {what}"
            );
            let help = "convert the model again with flexbody convert --basis craig-bampton";
            Diagnostic::new(Code::ExportLoses, message).with_help(help)
        };
        let extended = Extended::of(given);
        let change = extended.change().ok_or_else(|| {
            refuse("its coordinates have no mass, or its fixed-interface modes have more than the total mass")
        })?;
        let in_nodes = |a: &Mat<f64>| {
            let half = combine(change.transpose(), a.as_ref());
            let whole = combine(half.as_ref(), change.as_ref());
            Mat::from_fn(whole.nrows(), whole.ncols(), |i, j| 0.5 * (whole[(i, j)] + whole[(j, i)]))
        };
        let (mass, stiffness) = (in_nodes(&extended.mass), in_nodes(&extended.stiffness));
        let damping = given.damping.as_ref().map(|damping| in_nodes(&extended.padded(damping)));
        let finite = |a: &Mat<f64>| a.col_iter().all(|column| column.iter().all(|v| v.is_finite()));
        if ![Some(&mass), Some(&stiffness), damping.as_ref()].into_iter().flatten().all(finite) {
            return Err(refuse("they overflow double precision").into());
        }
        Ok(Self { mass, stiffness, damping, n_modes: extended.n_modes })
    }
}

/// Matrices of a body with the rest mass. Coordinates: interfaces, amplitudes of the fixed-interface modes,
/// amplitudes that fill the last node, three displacements of the rest mass.
struct Extended {
    /// Number of coordinates of the interfaces.
    n_boundary: usize,
    /// Number of fixed-interface modes.
    n_modes: usize,
    /// Number of amplitudes that fill the last node.
    n_fill: usize,
    mass: Mat<f64>,
    stiffness: Mat<f64>,
    /// Momentum of rigid translations R' M without the rest mass (3 x coordinates of the body).
    momentum: Mat<f64>,
    /// Total mass N = R' M R.
    total: Matrix3<f64>,
    /// Momentum of rigid translations per displacement of the rest mass.
    rest: Matrix3<f64>,
}

impl Extended {
    fn of(given: &InterfaceMatrices<'_>) -> Self {
        let n_boundary = 6 * given.frames.len();
        let m = given.mass;
        let n_modes = m.nrows() - n_boundary;
        let momentum = Mat::from_fn(3, m.nrows(), |a, j| (a..n_boundary).step_by(6).map(|i| m[(i, j)]).sum());
        let total = Matrix3::from_fn(|a, b| (b..n_boundary).step_by(6).map(|j| momentum[(a, j)]).sum());
        let modal = momentum.subcols(n_boundary, n_modes);
        let of_modes = combine(modal, modal.transpose());
        // Mass that moves in no mode, R'(M_BB - M_Bf M_fB) R, plus a share of the total mass.
        let rest = (1.0 + REST_MASS_SHARE) * total - Matrix3::from_fn(|a, b| of_modes[(a, b)]);
        let mut extended = Self {
            n_boundary,
            n_modes,
            n_fill: (n_modes + 3).next_multiple_of(6) - n_modes - 3,
            mass: Mat::new(),
            stiffness: Mat::new(),
            momentum,
            total,
            rest,
        };
        (extended.mass, extended.stiffness) = extended.matrices(given);
        extended
    }

    /// Returns M and K of all coordinates.
    fn matrices(&self, given: &InterfaceMatrices<'_>) -> (Mat<f64>, Mat<f64>) {
        let (nb, nf) = (self.n_boundary, self.n_modes);
        let (mut mass, mut stiffness) = (self.padded(given.mass), self.padded(given.stiffness));
        let (filled, first) = (nb + nf, self.size() - 3);
        let square = self.rest_frequency_squared(given);
        // Modes that fill the last node are uncoupled.
        for i in filled..first {
            (mass[(i, i)], stiffness[(i, i)]) = (1.0, FILL_FREQUENCY.powi(2) * square);
        }
        // The rest mass couples to the interfaces by R'(M_BB - M_Bf M_fB), and to no mode.
        let modal = self.momentum.as_ref().subcols(nb, nf);
        let of_modes = combine(modal, given.mass.as_ref().submatrix(nb, 0, nf, nb));
        for a in 0..3 {
            for j in 0..nb {
                let coupling = (1.0 + REST_MASS_SHARE) * self.momentum[(a, j)] - of_modes[(a, j)];
                (mass[(first + a, j)], mass[(j, first + a)]) = (coupling, coupling);
            }
            for b in 0..3 {
                // Twice the momentum of the rest mass keeps M positive definite.
                mass[(first + a, first + b)] = 2.0 * self.rest[(a, b)];
                stiffness[(first + a, first + b)] = 2.0 * square * self.rest[(a, b)];
            }
        }
        (mass, stiffness)
    }

    /// Returns the number of coordinates.
    fn size(&self) -> usize {
        self.n_boundary + self.n_modes + self.n_fill + 3
    }

    /// Returns a matrix of the body, padded with zeros for all other coordinates.
    fn padded(&self, a: &Mat<f64>) -> Mat<f64> {
        let inner = self.n_boundary + self.n_modes;
        let of_body = |i: usize, j: usize| if i < inner && j < inner { a[(i, j)] } else { 0.0 };
        Mat::from_fn(self.size(), self.size(), of_body)
    }

    /// Returns the eigenvalue of the rest mass: above those of all fixed-interface modes or, without modes,
    /// above the ratios K_ii / M_ii of the interface coordinates.
    fn rest_frequency_squared(&self, given: &InterfaceMatrices<'_>) -> f64 {
        let all = if self.n_modes == 0 { 0..self.n_boundary } else { self.n_boundary..given.mass.nrows() };
        let highest = all.map(|i| given.stiffness[(i, i)] / given.mass[(i, i)]);
        REST_FREQUENCY.powi(2) * highest.filter(|v| v.is_finite()).fold(0.0, f64::max)
    }

    /// Returns the square matrix from the coordinates of the nodes to all coordinates; `None` if the mass is
    /// not positive.
    fn change(&self) -> Option<Mat<f64>> {
        let (nb, nf) = (self.n_boundary, self.n_modes + self.n_fill);
        self.total.cholesky()?;
        let inverse = self.rest.cholesky()?.inverse();
        let mut change = Mat::zeros(self.size(), self.size());
        (0..nb).for_each(|i| change[(i, i)] = 1.0);
        // Nodes have amplitudes divided by sqrt(m), which are lengths like the first three columns.
        let scale = (self.total.trace() / 3.0).sqrt();
        for k in 0..nf {
            let (row, column) = (nb + k, nb + 3 + k);
            change[(row, column)] = scale;
            if (3 + k) % 6 < 3 {
                change[(row, nb + k % 3)] = -scale;
            }
        }
        // N u = R' M q + rest z gives z for the displacement u of the first internal node.
        let of_body = combine(self.momentum.as_ref(), change.as_ref().subrows(0, nb + self.n_modes));
        let moment = |a: usize, j: usize| {
            let own = if (nb..nb + 3).contains(&j) { self.total[(a, j - nb)] } else { 0.0 };
            own - of_body[(a, j)]
        };
        for j in 0..change.ncols() {
            for a in 0..3 {
                change[(nb + nf + a, j)] = (0..3).map(|b| inverse[(a, b)] * moment(b, j)).sum();
            }
        }
        Some(change)
    }
}
