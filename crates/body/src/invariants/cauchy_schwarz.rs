//! Upper bounds of the entries of the invariants: the scales of all comparisons.

use super::Invariants;
use faer::Mat;
use flexbody_linalg::largest;
use nalgebra::Vector3;

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
