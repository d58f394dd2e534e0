//! Comparison of invariants: error norms of lumped invariants against the exact ones (theory section 9), upper bounds of
//! the entries, which are the scales of all comparisons, and the alignment of two sets of modes.

use super::Invariants;
use super::transform::{frobenius_norm, spectral_norm};
use faer::{Mat, MatRef};
use flexbody_linalg::{larger, largest};
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::ops::Range;

/// Name and meaning of every number of [`error_norms`], in its order. X stands for the exact invariant, D
/// for the lumped one minus X. Every number is dimensionless, and zero without difference.
///
/// Each invariant has one scale. `I0`, `W2` and the modal mass never vanish: their norms are relative to
/// the norm of X. `W1` and `W3` vanish for symmetric bodies, `C1` and `C2` for free-surface modes: their
/// norms are relative to the norm of X or, if that is smaller, to the bound of theory section 7 for a unit
/// of modal coordinate, with mu^2 the largest eigenvalue of m_ff (1 for mass-normalised modes) and I_max
/// that of I0. The `max` numbers are relative to the Cauchy-Schwarz bound ([`CauchySchwarz`]) entry by
/// entry, which shows an error about a slender axis that a norm hides.
pub const ERROR_NORMS: [(&str, &str); 23] = [
    ("mass", "|m_l - m| / m"),
    ("com_shift", "distance of the centres of mass / radius of gyration sqrt(tr J_com / m)"),
    ("modal_mass_frobenius", "|D|_F / |X|_F of m_ff = Psi' M Psi: lost orthonormality of the modes"),
    ("modal_mass_spectral", "|D|_2 / |X|_2"),
    ("modal_mass_max", "largest |D_pq| / (|psi_p| |psi_q|)"),
    ("I0_frobenius", "|D|_F / |X|_F of I0"),
    ("I0_spectral", "|D|_2 / |X|_2"),
    ("I0_max", "largest |D_kl| / sqrt(I0_kk I0_ll)"),
    ("W1_frobenius", "|D|_F / max(|X|_F, 2 mu sqrt(I_max)) of W1"),
    ("W1_spectral", "|D|_2 / max(|X|_2, 2 mu sqrt(I_max))"),
    ("W1_max", "largest |D_kl,p| / (2 sqrt(I0_kk) |psi_p|), for l != k / (sqrt(I0_mm) |psi_p|)"),
    ("W2_frobenius", "|D|_F / |X|_F of W2"),
    ("W2_spectral", "|D|_2 / |X|_2"),
    ("W2_max", "largest |D_pq| / (|psi_p| |psi_q|)"),
    ("W3_frobenius", "|D|_F / max(|X|_F, mu^2) of W3"),
    ("W3_spectral", "|D|_2 / max(|X|_2, mu^2)"),
    ("W3_max", "largest |D_pq| / (|psi_p| |psi_q|)"),
    ("C1_frobenius", "|D|_F / max(|X|_F, mu sqrt(m)) of C1"),
    ("C1_spectral", "|D|_2 / max(|X|_2, mu sqrt(m))"),
    ("C1_max", "largest |D_kp| / (sqrt(m) |psi_p|)"),
    ("C2_frobenius", "|D|_F / max(|X|_F, mu sqrt(I_max)) of C2"),
    ("C2_spectral", "|D|_2 / max(|X|_2, mu sqrt(I_max))"),
    ("C2_max", "largest |D_kp| / (sqrt(I0_kk) |psi_p|)"),
];

/// Returns the error norms of `other` against `exact`, by name, in the order of [`ERROR_NORMS`]. Norms of
/// W1, W2 and W3 are omitted if one of the two does not hold them. Both must belong to the same modes and
/// frame; NaN in either gives NaN.
///
/// # Panics
/// When the numbers of modes differ.
pub fn error_norms(exact: &Invariants, other: &Invariants) -> Vec<(String, f64)> {
    assert_eq!(exact.n_modes(), other.n_modes(), "modes of the two bodies");
    let nf = exact.n_modes().max(1); // columns exist only with modes, so the divisions below never see a zero
    let bound = CauchySchwarz::of(exact);
    let (a, b) = (exact.derived(), other.derived());
    let mode_norm = spectral_norm(a.modal_mass.as_ref()).sqrt();
    let largest_moment = spectral_norm(matrix(&a.inertia).as_ref());
    let rotation = mode_norm * largest_moment.sqrt();
    let translation = mode_norm * exact.0.mass.sqrt();
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);

    let mut values = vec![
        Some(scaled(other.0.mass - exact.0.mass, exact.0.mass.abs())),
        Some(scaled(com_shift(exact, other), gyration_radius(exact))),
    ];
    let mut group =
        |x: Option<&Mat<f64>>, y: Option<&Mat<f64>>, least: f64, bound: &dyn Fn(usize, usize) -> f64| {
            values.extend(match x.zip(y) {
                Some((x, y)) => norms(x, y, least, bound).map(Some),
                None => [None; 3],
            });
        };
    let (inertia, others) = (matrix(&a.inertia), matrix(&b.inertia));
    group(Some(&a.modal_mass), Some(&b.modal_mass), 0.0, &by_modes);
    group(Some(&inertia), Some(&others), 0.0, &|k, l| bound.inertia(k, l));
    let w1_bound = |k: usize, column: usize| bound.w1(k, column / nf, column % nf);
    group(a.w1.as_ref(), b.w1.as_ref(), 2.0 * rotation, &w1_bound);
    group(a.w2.as_ref(), b.w2.as_ref(), 0.0, &by_modes);
    group(a.w3.as_ref(), b.w3.as_ref(), mode_norm * mode_norm, &by_modes);
    group(Some(&exact.0.c1), Some(&other.0.c1), translation, &|_, p| bound.c1(p));
    group(Some(&a.c2), Some(&b.c2), rotation, &|k, p| bound.c2(k, p));
    let named = ERROR_NORMS.iter().zip(values);
    named.filter_map(|((name, _), value)| Some(((*name).to_owned(), value?))).collect()
}

/// Returns the Frobenius norm, the spectral norm and the largest scaled entry of b - a. The first two are
/// relative to the norm of a, but at least to `least`.
fn norms(a: &Mat<f64>, b: &Mat<f64>, least: f64, bound: impl Fn(usize, usize) -> f64) -> [f64; 3] {
    let difference = Mat::from_fn(a.nrows(), a.ncols(), |p, q| b[(p, q)] - a[(p, q)]);
    let relative =
        |norm: fn(MatRef<'_, f64>) -> f64| scaled(norm(difference.as_ref()), larger(norm(a.as_ref()), least));
    let mut largest = 0.0;
    for q in 0..a.ncols() {
        for p in 0..a.nrows() {
            largest = larger(largest, scaled(difference[(p, q)], bound(p, q)));
        }
    }
    [relative(frobenius_norm), relative(spectral_norm), largest]
}

fn matrix(a: &Matrix3<f64>) -> Mat<f64> {
    Mat::from_fn(3, 3, |k, l| a[(k, l)])
}

fn centre_of_mass(invariants: &Invariants) -> Vector3<f64> {
    invariants.0.first_moment / invariants.0.mass
}

fn com_shift(exact: &Invariants, other: &Invariants) -> f64 {
    (centre_of_mass(other) - centre_of_mass(exact)).norm()
}

/// Returns the radius of gyration sqrt(tr J_com / m).
fn gyration_radius(body: &Invariants) -> f64 {
    (body.0.second_moment.trace() / body.0.mass - centre_of_mass(body).norm_squared()).max(0.0).sqrt()
}

// Upper bounds of the entries of the invariants: the scales of all comparisons.

/// Cauchy-Schwarz bounds of the entries of a body's invariants, in the inner product of its mass.
///
/// With |x_k| = sqrt(J_kk) and |psi_p| = sqrt(m_ff,pp): |Ibar_kl,p| <= |x_k| |psi_p|, |S_kl,pq| <= |psi_p|
/// |psi_q| and so on. A rounding error or a lumping error divided by its bound is meaningful even if the
/// exact entry is zero by symmetry, and in any units.
#[derive(Debug, Clone, PartialEq)]
pub struct CauchySchwarz {
    mass: f64,
    second_moment: Vector3<f64>,
    /// I0_kk of a mass whose inertia does not follow from positions; `None` if it does.
    inertia: Option<Vector3<f64>>,
    mode: Vec<f64>,
}

impl CauchySchwarz {
    /// Returns the bounds of the entries of a body. A direction without extent gets the rounding of the
    /// others, J_kk >= 2.2e-16 tr J.
    pub fn of(invariants: &Invariants) -> Self {
        let floor = f64::EPSILON * invariants.0.second_moment.trace();
        let norm = |p| {
            let moved = (0..3).map(|k| invariants.0.s[k][k][(p, p)]).sum::<f64>();
            // Nodal rotations carry mass that S does not contain, and S contains mass that m_ff does not.
            let whole = invariants.0.general.as_ref().map_or(moved, |general| general.modal_mass[(p, p)]);
            moved.max(whole).max(0.0).sqrt()
        };
        let inertia = invariants.0.general.as_ref().map(|_| {
            let floor = f64::EPSILON * invariants.inertia().trace();
            invariants.inertia().diagonal().map(|i| i.max(floor).max(0.0))
        });
        Self {
            mass: invariants.0.mass,
            inertia,
            second_moment: invariants.0.second_moment.diagonal().map(|j| j.max(floor).max(0.0)),
            mode: (0..invariants.n_modes()).map(norm).collect(),
        }
    }

    /// Returns |psi_p| = sqrt(m_ff,pp): 1 for a mass-normalised mode. If M does not commute with rotations,
    /// returns the larger of this and sqrt(tr S_pp).
    pub fn mode(&self, p: usize) -> f64 {
        self.mode[p]
    }

    /// Returns the bound |c_k| <= sqrt(m) |x_k|. For a mass that does not commute with rotations, c_k
    /// couples a translation to the rotations about the other axes: |c_k| <= sqrt(m I0_ll).
    pub fn first_moment(&self, k: usize) -> f64 {
        let size = match &self.inertia {
            Some(inertia) => inertia[(k + 1) % 3].max(inertia[(k + 2) % 3]),
            None => self.second_moment[k],
        };
        (self.mass * size).sqrt()
    }

    /// Returns the bound |J_kl| <= |x_k| |x_l|. For a mass that does not commute with rotations J
    /// represents I0, and the bound is that of I0.
    pub fn second_moment(&self, k: usize, l: usize) -> f64 {
        match &self.inertia {
            Some(_) if k == l => self.largest_moment(),
            Some(_) => self.inertia(k, l),
            None => (self.second_moment[k] * self.second_moment[l]).sqrt(),
        }
    }

    /// Returns the bound |C1_k,p| <= sqrt(m) |psi_p|.
    pub fn c1(&self, p: usize) -> f64 {
        self.mass.sqrt() * self.mode[p]
    }

    /// Returns the bound |Ibar_kl,p| <= |x_k| |psi_p|. For a mass that does not commute with rotations Ibar
    /// represents W1 and C2, and the bound is of their size.
    pub fn ibar(&self, k: usize, p: usize) -> f64 {
        let size = if self.inertia.is_some() { self.largest_moment() } else { self.second_moment[k] };
        size.sqrt() * self.mode[p]
    }

    /// Returns the bound |S_kl,pq| <= |psi_p| |psi_q|, which also bounds the entries of m_ff, W2 and W3.
    pub fn s(&self, p: usize, q: usize) -> f64 {
        self.mode[p] * self.mode[q]
    }

    /// Returns the bound |I0_kl| <= sqrt(I0_kk I0_ll).
    pub fn inertia(&self, k: usize, l: usize) -> f64 {
        (self.moment(k) * self.moment(l)).sqrt()
    }

    /// Returns the bound |C2_k,p| <= sqrt(I0_kk) |psi_p|.
    pub fn c2(&self, k: usize, p: usize) -> f64 {
        self.moment(k).sqrt() * self.mode[p]
    }

    /// Returns the bound |W1_kk,p| <= 2 sqrt(I0_kk) |psi_p|, or |W1_kl,p| <= sqrt(I0_mm) |psi_p| with m the
    /// third axis.
    pub fn w1(&self, k: usize, l: usize, p: usize) -> f64 {
        if k == l { 2.0 * self.c2(k, p) } else { self.c2(3 - k - l, p) }
    }

    /// Returns I0_kk.
    fn moment(&self, k: usize) -> f64 {
        if let Some(inertia) = &self.inertia {
            return inertia[k];
        }
        self.second_moment[(k + 1) % 3] + self.second_moment[(k + 2) % 3]
    }

    /// Returns the largest I0_kk, the scale of entries of J and Ibar that are sums of several entries of
    /// I0, W1 and C2.
    fn largest_moment(&self) -> f64 {
        (0..3).map(|k| self.moment(k)).fold(0.0, f64::max)
    }
}

/// Returns |difference| relative to its bound: zero without difference, infinite if a bound of zero is
/// exceeded.
pub(super) fn scaled(difference: f64, bound: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.abs() / bound }
}

/// Returns the largest difference of each primary quantity of two bodies with equal nodes, frame and basis,
/// relative to the Cauchy-Schwarz bounds of `a`: `mass`, `first_moment`, `second_moment`, `C1`, `Ibar`,
/// `S`, and `modal_stiffness` relative to sqrt(K_pp K_qq); also `W0`, `W3` and `modal_mass` if M does not
/// commute with rotations. NaN if any number is NaN. J and Ibar of such a body represent I0, W1 and C2 and
/// have their bounds.
///
/// Only data held by both bodies are compared: C2 in place of Ibar if one does not hold W1, W3 and m_ff in
/// place of S if one does not hold W2.
///
/// Two independent evaluations agree to 1e-12 in all of them.
///
/// # Panics
/// When the numbers of modes differ.
pub fn primary_differences(a: &Invariants, b: &Invariants) -> Vec<(String, f64)> {
    let nf = a.n_modes();
    assert_eq!(nf, b.n_modes(), "modes of the two bodies");
    let pair =
        Pair { a, b, bound: CauchySchwarz::of(a), general: a.0.general.is_some() || b.0.general.is_some() };
    let groups = a.0.groups.and(b.0.groups);
    let bound = &pair.bound;
    let by_modes = |row: usize, column: usize| bound.s(row % nf, column % nf);
    let mut table = vec![
        ("mass", scaled(a.0.mass - b.0.mass, a.0.mass.abs())),
        ("first_moment", pair.first_moment()),
        ("second_moment", pair.second_moment()),
        ("C1", entries(&a.0.c1, &b.0.c1, |_, p| bound.c1(p))),
        if groups.w1 {
            ("Ibar", pair.ibar())
        } else {
            ("C2", entries(&a.c2(), &b.c2(), |k, p| bound.c2(k, p)))
        },
    ];
    if groups.w2 {
        let block = |(k, l): (usize, usize)| entries(&a.0.s[k][l], &b.0.s[k][l], by_modes);
        table.push(("S", largest(axes().map(block))));
    }
    table.push(("modal_stiffness", pair.modal_stiffness()));
    if pair.general {
        table.push(("W0", entries(&a.w0(), &b.w0(), |_, column| bound.c1(column % nf))));
    }
    if pair.general || !groups.w2 {
        table.extend(a.w3().zip(b.w3()).map(|(w3, other)| ("W3", entries(&w3, &other, by_modes))));
        table.push(("modal_mass", entries(&a.modal_mass(), &b.modal_mass(), by_modes)));
    }
    table.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Returns all pairs of axes.
fn axes() -> impl Iterator<Item = (usize, usize)> {
    (0..3).flat_map(|k| (0..3).map(move |l| (k, l)))
}

/// Returns the largest difference of the entries of two matrices, relative to their bounds.
fn entries(x: &Mat<f64>, y: &Mat<f64>, bound: impl Fn(usize, usize) -> f64) -> f64 {
    let all = (0..x.nrows()).flat_map(|i| (0..x.ncols()).map(move |j| (i, j)));
    largest(all.map(|(i, j)| scaled(x[(i, j)] - y[(i, j)], bound(i, j))))
}

/// Two bodies, and the bounds of the first.
struct Pair<'a> {
    a: &'a Invariants,
    b: &'a Invariants,
    bound: CauchySchwarz,
    /// True if one mass does not commute with rotations: J and Ibar then represent I0, W1 and C2 and have
    /// their bounds.
    general: bool,
}

impl Pair<'_> {
    fn first_moment(&self) -> f64 {
        let difference = self.a.0.first_moment - self.b.0.first_moment;
        largest((0..3).map(|k| scaled(difference[k], self.bound.first_moment(k))))
    }

    fn second_moment(&self) -> f64 {
        let bound = |k: usize, l: usize| match self.general {
            false => self.bound.second_moment(k, l),
            true if k == l => self.bound.largest_moment(),
            true => self.bound.inertia(k, l),
        };
        let difference = self.a.0.second_moment - self.b.0.second_moment;
        largest(axes().map(|(k, l)| scaled(difference[(k, l)], bound(k, l))))
    }

    fn ibar(&self) -> f64 {
        let bound = |k: usize, l: usize, p: usize| match self.general {
            false => self.bound.ibar(k, p),
            true if k == l => self.bound.largest_moment().sqrt() * self.bound.mode(p),
            true => self.bound.c2(3 - k - l, p),
        };
        let (a, b) = (&self.a.0.ibar, &self.b.0.ibar);
        let places = axes().flat_map(|(k, l)| (0..self.a.n_modes()).map(move |p| (k, l, p)));
        largest(places.map(|(k, l, p)| scaled(a[k][l][p] - b[k][l][p], bound(k, l, p))))
    }

    fn modal_stiffness(&self) -> f64 {
        let (a, b) = (&self.a.0.modal_stiffness, &self.b.0.modal_stiffness);
        let largest_stiffness = (0..a.ncols()).fold(0.0, |m: f64, p| m.max(a[(p, p)].abs()));
        let size = |p: usize| a[(p, p)].abs().max(f64::EPSILON * largest_stiffness);
        entries(a, b, |p, q| (size(p) * size(q)).sqrt())
    }
}

// Comparison of two sets of modes that differ in sign, or by a rotation within repeated eigenvalues.

/// Limit of the iterations of a small singular value decomposition, which needs a few per singular value.
const MAX_SVD_ITERATIONS: usize = 10_000;

/// Basis change that maps the modes of one body to those of another.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// T (nf x nf), orthogonal, block-diagonal over the groups: Psi_b T is closest to Psi_a.
    pub basis: Mat<f64>,
    /// Smallest singular value of the blocks of the cross-Gram matrix. For mass-normalised modes and the M
    /// inner product it is the smallest cosine between the subspaces of a group, 1 if all agree. NaN if an
    /// entry of a block is not finite.
    pub agreement: f64,
}

/// Finds the orthogonal T, block-diagonal over `groups`, that minimises |Psi_a - Psi_b T|.
///
/// `cross_gram` (nf x nf) = Psi_a' G Psi_b for an inner product G. For each group T is the orthogonal polar
/// factor of the transposed block. If the modes of a group span one space, Psi_b = Psi_a R, the block is P
/// R with P positive definite for any such G, and T = R' exactly. Without the mass matrix, G = I (the plain
/// product of the nodal components) serves as well. `groups` are the clusters of repeated eigenvalues,
/// ascending and disjoint; a mode outside of them forms its own group, and T is its sign.
///
/// # Panics
/// When the matrix is not square, or the groups overlap or go beyond it.
pub fn align(cross_gram: MatRef<'_, f64>, groups: &[Range<usize>]) -> Alignment {
    let nf = cross_gram.nrows();
    assert_eq!(nf, cross_gram.ncols(), "the same number of modes");
    let mut alignment = Alignment { basis: Mat::identity(nf, nf), agreement: f64::INFINITY };
    let mut next = 0;
    for group in groups {
        assert!(
            next <= group.start && group.start <= group.end && group.end <= nf,
            "groups ascending, disjoint"
        );
        (next..group.start).for_each(|p| alignment.align_group(cross_gram, p..p + 1));
        alignment.align_group(cross_gram, group.clone());
        next = group.end;
    }
    (next..nf).for_each(|p| alignment.align_group(cross_gram, p..p + 1));
    alignment
}

impl Alignment {
    fn align_group(&mut self, cross_gram: MatRef<'_, f64>, group: Range<usize>) {
        let (start, size) = (group.start, group.len());
        if size == 0 {
            return;
        }
        let transposed = DMatrix::from_fn(size, size, |p, q| cross_gram[(start + q, start + p)]);
        let svd = transposed
            .iter()
            .all(|v| v.is_finite())
            .then(|| transposed.try_svd(true, true, f64::EPSILON, MAX_SVD_ITERATIONS))
            .flatten();
        let polar = svd.and_then(|svd| Some((svd.u? * svd.v_t?, svd.singular_values.min())));
        let Some((polar, smallest)) = polar else {
            self.agreement = f64::NAN;
            return;
        };
        // min() would drop an earlier NaN.
        if !self.agreement.is_nan() {
            self.agreement = self.agreement.min(smallest);
        }
        for p in 0..size {
            for q in 0..size {
                self.basis[(start + p, start + q)] = polar[(p, q)];
            }
        }
    }
}

/// Compares the primary data of two bodies whose modes may differ in sign and within repeated eigenvalues:
/// aligns `b` to `a` ([`align`]) and returns the alignment and the differences of [`primary_differences`].
///
/// # Panics
/// When the sizes disagree.
pub fn compare_invariants(
    a: &Invariants,
    b: &Invariants,
    cross_gram: MatRef<'_, f64>,
    groups: &[Range<usize>],
) -> (Alignment, Vec<(String, f64)>) {
    let alignment = align(cross_gram, groups);
    let differences = primary_differences(a, &b.with_basis(alignment.basis.as_ref()));
    (alignment, differences)
}
