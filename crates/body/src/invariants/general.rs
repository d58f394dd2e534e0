//! Condensation of mass matrices that do not commute with rotations (theory section 6): models with nodal
//! rotations, eliminated constraints, or vectors without a position that turn with the body.
//!
//! One Gram matrix X' M X of the columns X = [Phi_t, B_x, B_1, ..., B_nf, Psi] holds every product. With rows
//! of -psi_j~ at the displacements and zeros at the rotations in B_j, the body-frame velocities of all rows
//! are (Phi_t, B_x + sum_j q_j B_j, Psi) times (V, omega, qd).

use super::{GeneralTerms, Invariants, PrimaryData, TermGroups};
use faer::{ColMut, Mat, MatMut, MatRef};
use flexbody_linalg::{SymmetricMatrix, Tall, gram, multiply, parallel};
use flexbody_model::DirectorMass;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Number of columns of X multiplied by M at a time. A larger block needs more memory.
const COLUMNS_PER_BLOCK: usize = 32;

/// Product of a symmetric mass matrix with columns.
pub trait MassProduct: Sync {
    /// Returns the number of rows of M.
    fn n_rows(&self) -> usize;

    /// Computes y = M x.
    fn times(&self, x: MatRef<'_, f64>, y: MatMut<'_, f64>);
}

/// The mass matrix of the rows of a model.
impl MassProduct for SymmetricMatrix {
    fn n_rows(&self) -> usize {
        self.n()
    }

    fn times(&self, x: MatRef<'_, f64>, y: MatMut<'_, f64>) {
        multiply(self, 1, x, y);
    }
}

/// The mass of points and directors acts on extended rows.
impl MassProduct for DirectorMass {
    fn n_rows(&self) -> usize {
        self.rows()
    }

    fn times(&self, x: MatRef<'_, f64>, y: MatMut<'_, f64>) {
        self.multiply(x, y);
    }
}

/// Rigid motion of the rows of a mass matrix, components along the model axes, and the axes of the body
/// frame.
#[derive(Debug, Clone, Copy)]
pub struct RigidMotion<'a> {
    /// Rigid fields (N x 6): unit translations along the body axes, then unit rotations about them; N x 3
    /// for a plane body. They are turned to the body axes before they are multiplied
    /// ([`Frame::rotate_rigid`](super::Frame::rotate_rigid)), so that slender bodies keep the digits of
    /// their small moments.
    pub fields: MatRef<'a, f64>,
    /// Number of leading rows that hold vectors turning with the body, d rows per vector. All other rows
    /// keep their values when the body turns.
    pub displacements: usize,
    /// Columns are the body axes in model axes.
    pub axes: Matrix3<f64>,
}

/// Condenses the nodal equations of motion for any symmetric M (theory section 6).
///
/// I0 = B_x' M B_x, C1 = Phi_t' M Psi, C2 = B_x' M Psi, m_ff = Psi' M Psi; block b, column j: W0 = Phi_t' M
/// B_j e_b, W1 = (B_x' M B_j + B_j' M B_x) e_b; W2 = e_a' B_i' M B_j e_b at row a nf + i, column b nf + j; W3
/// = e_a' B_i' M psi_j at row a nf + i.
///
/// * `mass`: M (N x N), model axes. For a model with nodal rotations the matrix E of points and directors;
///   then motion and shapes have extended rows.
/// * `motion`: rigid motion of the rows of `mass`.
/// * `shapes`: modes (N x nf), model axes.
/// * `modal_stiffness`: Psi' K Psi (nf x nf), passed through.
///
/// The result is in body axes about the origin of the body frame. For a plane body only the rotation about
/// z is known: the entries about the other axes are set to a lamina with equal inertia about z. The result
/// does not depend on the number of threads.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_general<M: MassProduct + ?Sized>(
    mass: &M,
    motion: &RigidMotion<'_>,
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let columns = GeneralColumns::new(mass, motion, shapes);
    columns.products(columns.gram(mass)).invariants(modal_stiffness)
}

/// Condenses mass-normalised modes without W2 and W3 (see [`condense_general`]): multiplies only the
/// columns \[Phi_t, B_x\] by M and assumes m_ff = I.
///
/// # Panics
/// When the sizes disagree.
pub fn condense_general_linear<M: MassProduct + ?Sized>(
    mass: &M,
    motion: &RigidMotion<'_>,
    shapes: MatRef<'_, f64>,
    modal_stiffness: Mat<f64>,
) -> Invariants {
    let columns = GeneralColumns::new(mass, motion, shapes);
    let whole = columns.products(columns.rigid_gram(mass)).invariants(modal_stiffness);
    whole.with_groups(TermGroups { w1: true, ..TermGroups::NONE })
}

/// Columns X = [Phi_t, B_x, B_j e_b for each axis b and mode j, Psi].
struct GeneralColumns<'a> {
    motion: &'a RigidMotion<'a>,
    shapes: MatRef<'a, f64>,
}

impl<'a> GeneralColumns<'a> {
    /// # Panics
    /// When mass, motion and shapes differ in their numbers of rows.
    fn new(mass: &(impl MassProduct + ?Sized), motion: &'a RigidMotion<'a>, shapes: MatRef<'a, f64>) -> Self {
        let n = mass.n_rows();
        assert!(shapes.nrows() == n && motion.fields.nrows() == n, "one row per row of M");
        Self { motion, shapes }
    }

    fn products(&self, gram: Mat<f64>) -> Products {
        Products { gram, rigid: self.rigid(), nf: self.shapes.ncols() }
    }

    fn rigid(&self) -> usize {
        self.motion.fields.ncols()
    }

    /// Returns the axes that the body turns about: all three, or z for a plane body.
    fn axes(&self) -> Range<usize> {
        if self.rigid() == 3 { 2..3 } else { 0..3 }
    }

    fn count(&self) -> usize {
        self.rigid() + (self.axes().len() + 1) * self.shapes.ncols()
    }

    /// Returns a range of columns of X, each filled by one thread.
    fn block(&self, columns: Range<usize>) -> Tall {
        let mut block = Tall::zeros(self.shapes.nrows(), columns.len());
        parallel::for_each(columns.zip(block.as_mut().col_iter_mut()), |(column, to)| self.fill(column, to));
        block
    }

    /// Writes a column of X into `to`, which must hold zeros.
    fn fill(&self, column: usize, mut to: ColMut<'_, f64>) {
        let Some(after) = column.checked_sub(self.rigid()) else {
            return to.copy_from(self.motion.fields.col(column));
        };
        let (block, j) = (after / self.shapes.ncols(), after % self.shapes.ncols());
        let shape = self.shapes.col(j);
        if block == self.axes().len() {
            return to.copy_from(shape);
        }
        // e_b x psi of every displacement psi.
        let axis = Vector3::from(self.motion.axes.column(self.axes().start + block));
        let d = if self.rigid() == 3 { 2 } else { 3 };
        for first in (0..self.motion.displacements).step_by(d) {
            let psi = Vector3::from_fn(|k, _| if k < d { shape[first + k] } else { 0.0 });
            let turned = axis.cross(&psi);
            (0..d).for_each(|k| to[first + k] = turned[k]);
        }
    }

    /// Returns X' M X with the rows and columns of rigid motion, the identity for the modes, and zeros
    /// elsewhere.
    fn rigid_gram(&self, mass: &(impl MassProduct + ?Sized)) -> Mat<f64> {
        let (count, r) = (self.count(), self.rigid());
        // M times the rigid motion only.
        let mut y = Mat::zeros(self.shapes.nrows(), r);
        mass.times(self.motion.fields, y.as_mut());
        // Modes are M-orthonormal: the identity in their block.
        let first_mode = count - self.shapes.ncols();
        let mut all = Mat::from_fn(count, count, |i, j| if i == j && i >= first_mode { 1.0 } else { 0.0 });
        for start in (0..count).step_by(COLUMNS_PER_BLOCK) {
            let columns = start..(start + COLUMNS_PER_BLOCK).min(count);
            // X' M R, mirrored.
            let part = gram(self.block(columns.clone()).as_ref(), y.as_ref());
            for (k, column) in columns.enumerate() {
                for row in 0..r.min(column + 1) {
                    all[(row, column)] = part[(k, row)];
                    all[(column, row)] = part[(k, row)];
                }
            }
        }
        all
    }

    /// Returns X' M X, exactly symmetric.
    fn gram(&self, mass: &(impl MassProduct + ?Sized)) -> Mat<f64> {
        let count = self.count();
        let blocks: Vec<Range<usize>> = (0..count)
            .step_by(COLUMNS_PER_BLOCK)
            .map(|start| start..(start + COLUMNS_PER_BLOCK).min(count))
            .collect();
        let mut all = Mat::zeros(count, count);
        for (right, columns) in blocks.iter().enumerate() {
            // M times a block of columns, then its products with all blocks up to it.
            let x = self.block(columns.clone());
            let mut y = Tall::zeros(self.shapes.nrows(), x.ncols());
            mass.times(x.as_ref(), y.as_mut());
            for rows in &blocks[..=right] {
                let part = if rows == columns {
                    gram(x.as_ref(), y.as_ref())
                } else {
                    gram(self.block(rows.clone()).as_ref(), y.as_ref())
                };
                for (c, column) in columns.clone().enumerate() {
                    for (r, row) in rows.clone().enumerate().take_while(|(_, row)| *row <= column) {
                        all[(row, column)] = part[(r, c)];
                        all[(column, row)] = part[(r, c)];
                    }
                }
            }
        }
        all
    }
}

/// Gram matrix of [`GeneralColumns`]; from [`condense_general_linear`] without the entries of W2 and W3.
struct Products {
    gram: Mat<f64>,
    rigid: usize,
    nf: usize,
}

impl Products {
    /// Returns the column of B_j e_b; `b` counts the axes that the body turns about.
    fn turned(&self, b: usize, j: usize) -> usize {
        self.rigid + b * self.nf + j
    }

    /// Returns the column of psi_j.
    fn mode(&self, j: usize) -> usize {
        self.gram.ncols() - self.nf + j
    }

    fn modal_mass(&self) -> Mat<f64> {
        Mat::from_fn(self.nf, self.nf, |i, j| self.gram[(self.mode(i), self.mode(j))])
    }

    fn invariants(&self, modal_stiffness: Mat<f64>) -> Invariants {
        match self.rigid {
            3 => self.in_plane(modal_stiffness),
            _ => self.in_space(modal_stiffness),
        }
    }

    /// Returns m, c and J of rigid motion.
    fn rigid_inertia(&self) -> (f64, Vector3<f64>, Matrix3<f64>) {
        rigid_inertia(self.gram.as_ref().submatrix(0, 0, self.rigid, self.rigid))
    }

    fn in_space(&self, modal_stiffness: Mat<f64>) -> Invariants {
        let (g, nf) = (&self.gram, self.nf);
        let (mass, first_moment, second_moment) = self.rigid_inertia();
        // Ibar from B_x' M B_j and B_x' M psi_j.
        let ibar: Vec<Matrix3<f64>> = (0..nf)
            .map(|j| {
                let half = Matrix3::from_fn(|k, b| g[(3 + k, self.turned(b, j))]);
                ibar_of(&half, &Vector3::from_fn(|k, _| g[(3 + k, self.mode(j))]))
            })
            .collect();
        // S from W2 = B_i' M B_j.
        let mut s = [(); 3].map(|()| [(); 3].map(|()| Mat::zeros(nf, nf)));
        for i in 0..nf {
            for j in 0..nf {
                let entry = s_of(&Matrix3::from_fn(|a, b| g[(self.turned(a, i), self.turned(b, j))]));
                for (k, row) in s.iter_mut().enumerate() {
                    for (l, s) in row.iter_mut().enumerate() {
                        s[(i, j)] = entry[(k, l)];
                    }
                }
            }
        }
        symmetrise(&mut s);
        Invariants(PrimaryData {
            mass,
            first_moment,
            second_moment,
            c1: self.c1(),
            ibar: by_axes(&ibar),
            s,
            modal_stiffness,
            general: Some(GeneralTerms {
                w0: Mat::from_fn(3, 3 * nf, |k, column| g[(k, self.turned(column / nf, column % nf))]),
                w3: Mat::from_fn(3 * nf, nf, |row, j| g[(self.turned(row / nf, row % nf), self.mode(j))]),
                modal_mass: self.modal_mass(),
                plane: false,
            }),
            groups: TermGroups::ALL,
        })
    }

    fn in_plane(&self, modal_stiffness: Mat<f64>) -> Invariants {
        let (g, nf) = (&self.gram, self.nf);
        let (mass, first_moment, second_moment) = self.rigid_inertia();
        let ibar: Vec<Matrix3<f64>> =
            (0..nf).map(|j| plane_ibar(g[(2, self.turned(0, j))], g[(2, self.mode(j))])).collect();
        // S from W2 about z: equal halves for the two axes in the plane.
        let w2 = |i: usize, j: usize| g[(self.turned(0, i), self.turned(0, j))];
        let half = || Mat::from_fn(nf, nf, |i, j| 0.5 * w2(i, j));
        let zero = || Mat::zeros(nf, nf);
        Invariants(PrimaryData {
            mass,
            first_moment,
            second_moment,
            c1: self.c1(),
            ibar: by_axes(&ibar),
            s: [[half(), zero(), zero()], [zero(), half(), zero()], [zero(), zero(), zero()]],
            modal_stiffness,
            general: Some(GeneralTerms {
                w0: Mat::from_fn(3, 3 * nf, |k, c| match c.checked_sub(2 * nf) {
                    Some(j) if k < 2 => g[(k, self.turned(0, j))],
                    _ => 0.0,
                }),
                w3: Mat::from_fn(3 * nf, nf, |row, j| match row.checked_sub(2 * nf) {
                    Some(i) => g[(self.turned(0, i), self.mode(j))],
                    None => 0.0,
                }),
                modal_mass: self.modal_mass(),
                plane: true,
            }),
            groups: TermGroups::ALL,
        })
    }

    /// Returns Phi_t' M Psi; the row of z is zero for a plane body.
    fn c1(&self) -> Mat<f64> {
        let d = if self.rigid == 3 { 2 } else { 3 };
        Mat::from_fn(3, self.nf, |k, j| if k < d { self.gram[(k, self.mode(j))] } else { 0.0 })
    }
}

/// Returns Ibar of all modes, sorted by its two axes.
fn by_axes(ibar: &[Matrix3<f64>]) -> [[Vec<f64>; 3]; 3] {
    [0, 1, 2].map(|k| [0, 1, 2].map(|l| ibar.iter().map(|ibar| ibar[(k, l)]).collect()))
}

/// Returns m, c and J from R'MR = \[m I, -c~; c~, I0\] for unit translations and unit rotations R. For a
/// plane body R'MR is \[m I, (-c_y, c_x)'; ., I0_zz\], and J is the tensor of a lamina.
pub(super) fn rigid_inertia(g: MatRef<'_, f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
    if g.ncols() == 3 {
        let (mass, c) = (0.5 * (g[(0, 0)] + g[(1, 1)]), Vector3::new(g[(1, 2)], -g[(0, 2)], 0.0));
        return (mass, c, plane_second_moment(g[(2, 2)], mass, &c));
    }
    let mass = (0..3).map(|k| g[(k, k)]).sum::<f64>() / 3.0;
    let moment = |k: usize| {
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        0.5 * (g[(l, 3 + m)] - g[(m, 3 + l)])
    };
    let inertia = Matrix3::from_fn(|k, l| 0.5 * (g[(3 + k, 3 + l)] + g[(3 + l, 3 + k)]));
    (mass, Vector3::from_fn(|k, _| moment(k)), second_moment_of(&inertia))
}

/// Returns m and c from the matrix R'MR of unit translations and unit rotations R.
pub fn rigid_first_moment(g: MatRef<'_, f64>) -> (f64, Vector3<f64>) {
    let (mass, first_moment, _) = rigid_inertia(g);
    (mass, first_moment)
}

/// Returns J with I0 = tr(J) I - J. The two largest moments are subtracted first: their difference is small
/// if the third moment is small, so that a needle keeps the digits of its small moment J_ll + J_mm.
pub(super) fn second_moment_of(inertia: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|k, l| {
        let (a, b) = (inertia[((k + 1) % 3, (k + 1) % 3)], inertia[((k + 2) % 3, (k + 2) % 3)]);
        if k == l { 0.5 * (a.min(b) + (a.max(b) - inertia[(k, k)])) } else { -inertia[(k, l)] }
    })
}

/// Returns J of a plane body from its moment about z alone: isotropic in the plane about the centre of
/// mass, so that the tensor changes with the origin as J does.
fn plane_second_moment(about_z: f64, mass: f64, c: &Vector3<f64>) -> Matrix3<f64> {
    lamina(about_z - c.norm_squared() / mass) + c * c.transpose() / mass
}

/// Returns Ibar of a mode of a plane body from W1_zz = 2 (Ibar_xx + Ibar_yy), half of which is given, and
/// C2_z = Ibar_xy - Ibar_yx.
pub(super) fn plane_ibar(half_w1: f64, c2: f64) -> Matrix3<f64> {
    let mut ibar = lamina(half_w1);
    (ibar[(0, 1)], ibar[(1, 0)]) = (0.5 * c2, -0.5 * c2);
    ibar
}

/// Returns the entries of W0 (3 x 3nf) that a plane body has, those of translations in the plane and of the rotation about
/// z, and zeros elsewhere.
pub(super) fn plane_w0(w0: &Mat<f64>) -> Mat<f64> {
    let about_z = w0.ncols() / 3 * 2;
    let exists = |k: usize, column: usize| k < 2 && column >= about_z;
    Mat::from_fn(3, w0.ncols(), |k, column| if exists(k, column) { w0[(k, column)] } else { 0.0 })
}

/// Returns the isotropic tensor in the plane with J_xx + J_yy = `about_z`.
fn lamina(about_z: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(0.5, 0.5, 0.0)) * about_z
}

impl Invariants {
    /// Returns these invariants with another modal mass m_ff (nf x nf) and all other data unchanged: the
    /// data of a program that takes the modal mass from the FE program and sums the couplings over nodal
    /// masses. S no longer determines m_ff, so the result stores general terms.
    ///
    /// # Panics
    /// When the modal mass has another number of modes.
    pub fn with_modal_mass(mut self, modal_mass: Mat<f64>) -> Self {
        let nf = self.n_modes();
        assert_eq!((modal_mass.nrows(), modal_mass.ncols()), (nf, nf), "modal mass");
        if let Some(general) = &mut self.0.general {
            general.modal_mass = modal_mass;
        } else {
            let w3 = self.w3().unwrap_or_else(|| Mat::zeros(3 * nf, nf));
            self.0.general = Some(GeneralTerms { w0: self.w0(), w3, modal_mass, plane: false });
        }
        self
    }

    /// Returns the body reduced to its rotation about z: J, Ibar and S of a lamina with equal I0, W1, W2
    /// and C2 about z. The result is the reference for a plane body whose mass does not commute with
    /// rotations.
    pub fn about_z(mut self) -> Self {
        let half = |a: f64, b: f64| 0.5 * (a + b);
        let j = &self.0.second_moment;
        self.0.second_moment = plane_second_moment(j[(0, 0)] + j[(1, 1)], self.0.mass, &self.0.first_moment);
        for p in 0..self.n_modes() {
            let mean = half(self.0.ibar[0][0][p], self.0.ibar[1][1][p]);
            let skew = half(self.0.ibar[0][1][p], -self.0.ibar[1][0][p]);
            (self.0.ibar[0][0][p], self.0.ibar[1][1][p]) = (mean, mean);
            (self.0.ibar[0][1][p], self.0.ibar[1][0][p]) = (skew, -skew);
        }
        let nf = self.n_modes();
        let [[xx, xy, _], [yx, yy, _], _] = &self.0.s;
        let mean = Mat::from_fn(nf, nf, |p, q| half(xx[(p, q)], yy[(p, q)]));
        let skew = Mat::from_fn(nf, nf, |p, q| half(xy[(p, q)], -yx[(p, q)]));
        let zero = || Mat::zeros(nf, nf);
        let back = skew.transpose().to_owned();
        self.0.s = [[mean.clone(), skew, zero()], [back, mean, zero()], [zero(), zero(), zero()]];
        self
    }
}

/// Returns Ibar of a mode from W1_j = G + G' with G = B_x' M B_j and from C2_j, by the formulas of theory
/// section 2: W1_kk = 2 (Ibar_ll + Ibar_mm), W1_kl = -(Ibar_kl + Ibar_lk), C2_k = Ibar_lm - Ibar_ml.
pub(super) fn ibar_of(half: &Matrix3<f64>, c2: &Vector3<f64>) -> Matrix3<f64> {
    let w1 = half + half.transpose();
    let trace = 0.25 * w1.trace();
    Matrix3::from_fn(|k, l| {
        if k == l {
            return trace - 0.5 * w1[(k, k)];
        }
        let skew = if (k + 1) % 3 == l { c2[3 - k - l] } else { -c2[3 - k - l] };
        0.5 * (skew - w1[(k, l)])
    })
}

/// Returns S of two modes from W2 = B_i' M B_j, with W2_kk = S_ll + S_mm and W2_kl = -S_lk.
pub(super) fn s_of(w2: &Matrix3<f64>) -> Matrix3<f64> {
    let half_trace = 0.5 * w2.trace();
    Matrix3::from_fn(|k, l| if k == l { half_trace - w2[(k, k)] } else { -w2[(l, k)] })
}

/// Restores S_lk = S_kl' exactly after a transformation with rounding errors.
pub(crate) fn symmetrise(s: &mut [[Mat<f64>; 3]; 3]) {
    let mean =
        |a: &Mat<f64>, b: &Mat<f64>| Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + b[(j, i)]));
    let [[s00, s01, s02], [s10, s11, s12], [s20, s21, s22]] = s;
    for (upper, lower) in [(s01, s10), (s02, s20), (s12, s21)] {
        *lower = mean(lower, upper);
        *upper = lower.transpose().to_owned();
    }
    for diagonal in [s00, s11, s22] {
        *diagonal = mean(diagonal, diagonal);
    }
}
