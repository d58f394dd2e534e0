//! Forces of second order of nodes whose rotations carry mass: fixed nodal vectors times products of the amplitudes of the
//! modes.

use super::principal::principal_directions;
use super::residual::NodalView;
use faer::Mat;
use flexbody_linalg::{combine, side_by_side};
use flexbody_motion::scene::Instant;
use nalgebra::Vector3;

/// Largest number of combinations of modes. Their number of products is about the square of it, times ten.
const MOST_COMBINATIONS: usize = 12;

/// Part of the sum of squares of the amplitudes (of their rates, of their accelerations) that the combinations may leave
/// out: a thousandth of the amplitudes.
const LEFT_OUT: f64 = 1e-6;

/// Inertia forces of second order along a motion. With combinations y_p of the modes, q = T a, q' = T a', q'' = T a'',
/// a director moves by sum_p a_p theta_p x e_a and, to second order, by the sum of s_pq u_pq (theory 6.2a), s_pq = a_p a_q
/// for p < q and a_p^2 / 2 for p = q. In a frame that turns, an amplitude s of a displacement x has the acceleration
///
/// ```text
/// x s'' + S_k x (omega'_k s + 2 omega_k s') + S_k S_l x omega_k omega_l s,     S_k x = e_k x x
/// ```
///
/// and the forces are those of u_pq on all rows, and the moments that the forces of y_q gain as the nodes turn by a_p theta_p.
pub(super) struct TurningProducts {
    /// T (nf x r), orthonormal columns.
    combinations: Mat<f64>,
    /// Axes about which the body turns.
    turns: Vec<usize>,
}

impl TurningProducts {
    /// Chooses the combinations for a motion. `None` if no rotation of a node carries mass.
    pub(super) fn new(view: &NodalView<'_>, motion: &[Instant]) -> Option<Self> {
        if !view.rows.have_directors() {
            return None;
        }
        let turns_about = |axis: &usize| {
            let about = |now: &Instant| {
                (view.axes * now.omega)[*axis].abs() + (view.axes * now.omega_rate)[*axis].abs()
            };
            motion.iter().any(|now| about(now) > 0.0)
        };
        Some(Self {
            combinations: combinations(view.vectors.ncols(), motion),
            turns: (0..3).filter(turns_about).collect(),
        })
    }

    /// Returns the projected nodal vectors, in parts. `project` projects forces on the rows of the model.
    pub(super) fn vectors(
        &self,
        view: &NodalView<'_>,
        project: impl Fn(Mat<f64>) -> Mat<f64>,
    ) -> Vec<Mat<f64>> {
        let rows = &view.rows;
        let shapes = combine(view.vectors.as_ref(), self.combinations.as_ref());
        let columns: Vec<&[f64]> = (0..shapes.ncols()).map(|p| shapes.col_as_slice(p)).collect();
        let mut parts = Vec::new();
        // Forces of the displacements of second order.
        for (p, turn) in columns.iter().enumerate() {
            let motions = rows.second_order_motions(turn, &columns[p..]);
            self.each_acceleration(view, rows.weigh(motions.as_ref()), |forces| {
                parts.push(project(rows.restrict(forces.clone())));
            });
        }
        // Moments that forces of first order gain as the nodes turn.
        self.each_acceleration(view, rows.weigh(rows.extend(&shapes).as_ref().as_ref()), |forces| {
            parts.extend(columns.iter().map(|turn| project(rows.turned_moments(forces, |_| turn))));
        });
        parts
    }

    /// Calls `put` with the amplitude of every vector at an instant, in the order of [`TurningProducts::vectors`].
    pub(super) fn amplitudes(&self, view: &NodalView<'_>, now: &Instant, put: &mut impl FnMut(f64)) {
        let [a, ad, add] = [&now.q, &now.qd, &now.qdd].map(|x| gram_vector(&self.combinations, x));
        let turning = [now.omega, now.omega_rate].map(|x| view.axes * x);
        let count = a.len();
        for p in 0..count {
            let product = |q: usize| {
                let half = if p == q { 0.5 } else { 1.0 };
                let second = a[p] * add[q] + 2.0 * ad[p] * ad[q] + add[p] * a[q];
                let amplitude = [a[p] * a[q], a[p] * ad[q] + ad[p] * a[q], second];
                self.acceleration_factors(amplitude.map(|value| half * value), &turning)
            };
            let factors: Vec<Vec<f64>> = (p..count).map(product).collect();
            (0..self.kinds()).for_each(|kind| factors.iter().for_each(|own| put(own[kind])));
        }
        let single = |q: usize| self.acceleration_factors([a[q], ad[q], add[q]], &turning);
        let factors: Vec<Vec<f64>> = (0..count).map(single).collect();
        for kind in 0..self.kinds() {
            a.iter().for_each(|turn| factors.iter().for_each(|own| put(turn * own[kind])));
        }
    }

    /// Returns the number of vectors of [`TurningProducts::each_acceleration`].
    fn kinds(&self) -> usize {
        let axes = self.turns.len();
        1 + axes + axes * axes
    }

    /// Calls `hear` with x, then for every axis k with S_k x and all S_l S_k x.
    fn each_acceleration(&self, view: &NodalView<'_>, x: Mat<f64>, mut hear: impl FnMut(&Mat<f64>)) {
        let turned = |axis: usize, x: &Mat<f64>| view.rows.turned(&Vector3::ith(axis, 1.0), x);
        hear(&x);
        for &k in &self.turns {
            let once = turned(k, &x);
            hear(&once);
            self.turns.iter().for_each(|&l| hear(&turned(l, &once)));
        }
    }

    /// Returns the factors of [`TurningProducts::each_acceleration`] for an amplitude with its two derivatives.
    /// `turning`: omega and its rate.
    fn acceleration_factors(&self, amplitude: [f64; 3], turning: &[Vector3<f64>; 2]) -> Vec<f64> {
        let [value, first, second] = amplitude;
        let [omega, rate] = turning;
        let mut factors = Vec::with_capacity(self.kinds());
        factors.push(second);
        for &k in &self.turns {
            factors.push(rate[k] * value + 2.0 * omega[k] * first);
            factors.extend(self.turns.iter().map(|&l| omega[l] * omega[k] * value));
        }
        factors
    }
}

/// Returns the principal combinations T (nf x r) of the amplitudes, rates and accelerations of a motion.
fn combinations(modes: usize, motion: &[Instant]) -> Mat<f64> {
    if modes <= MOST_COMBINATIONS {
        return Mat::identity(modes, modes);
    }
    let mut columns = Mat::<f64>::zeros(modes, 0);
    for of in [|now: &Instant| &now.q, |now: &Instant| &now.qd, |now: &Instant| &now.qdd]
        as [fn(&Instant) -> &Vec<f64>; 3]
    {
        let amplitudes = Mat::from_fn(modes, motion.len(), |j, i| of(&motion[i])[j]);
        let size = amplitudes.norm_l2();
        if size > 0.0 {
            let own = amplitudes * faer::Scale(size.recip());
            columns = side_by_side(&[columns.as_ref(), own.as_ref()]);
        }
    }
    principal_directions(&columns, LEFT_OUT, MOST_COMBINATIONS).unwrap_or_else(|| Mat::zeros(modes, 0))
}

/// Returns A'x.
fn gram_vector(a: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    (0..a.ncols()).map(|j| a.col_as_slice(j).iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}
