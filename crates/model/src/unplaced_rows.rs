//! Rows without a position and massless rows: rigid motion of the former, and the check that the latter are
//! held by stiffness.

use super::rigid::{centre_and_length, rigid_count};
use super::rows::{Recovered, Rows};
use super::wording::name_some;
use super::{DofLabel, Nodes};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_linalg::{Analysis, Cholesky, CscMatrix, Pencil, Solve, SymmetricMatrix};

/// Eigenvalue of a stiffness with unit diagonal below which the stiffness does not resist a motion:
/// rounding of sums leaves 1e-14.
const ZERO_EIGENVALUE: f64 = 1e-12;

/// Largest deviation of the motion of a vector from a unit translation for a node whose coordinates are
/// missing.
const MAX_NODE_DEVIATION: f64 = 1e-6;

/// Finds the rigid motion R_p of the rows without a position, K_pp R_p = -K_pn R_n: the null space of K
/// from its values R_n at all other rows. Exact if K R = 0 holds, which is checked for these rows with all
/// others.
///
/// # Errors
/// [`RowsUnheld`](Code::RowsUnheld) if K leaves some of the rows free.
pub(super) fn recover(stiffness: &SymmetricMatrix, rows: &mut Rows, nodes: &Nodes) -> Result<(), Diagnostic> {
    let placeless: Vec<usize> = rows.without_place().into_iter().flatten().collect();
    if placeless.is_empty() {
        return Ok(());
    }
    let (centre, length) = centre_and_length(&nodes.positions);
    let known = rows.rigid_fields(&nodes.positions, centre, length);
    let count = rigid_count(rows.dimension);
    let restricted = Restricted::new(stiffness, &placeless);
    let mut fields = Mat::zeros(placeless.len(), count);
    for (to, &row) in placeless.iter().enumerate() {
        let (columns, values) = stiffness.row(row);
        for (&j, &v) in columns.iter().zip(values) {
            // Fields of rows without a position are still zero.
            for c in 0..count {
                fields[(to, c)] -= v * known[(j as usize, c)];
            }
        }
    }
    restricted.solve(&mut fields).map_err(|free| {
        let labels: Vec<DofLabel> = free.iter().map(|&i| rows.label(nodes, placeless[i])).collect();
        let message = format!("stiffness does not hold rows without coordinates: {}", name_some(&labels));
        Diagnostic::new(Code::RowsUnheld, message)
    })?;
    rows.recovered = Recovered { fields, centre, length };
    Ok(())
}

/// Returns an error for nodes whose coordinates are missing: K moves them like any node, and they carry
/// mass. The error states the position that K gives to the first of them.
pub(super) fn misplaced(rows: &Rows) -> Option<Diagnostic> {
    let d = rows.dimension;
    let known = &rows.recovered;
    let is_node = |at: &usize| {
        (0..d).all(|k| {
            (0..d).all(|c| {
                (known.fields[(d * at + k, c)] - f64::from(u8::from(k == c))).abs() < MAX_NODE_DEVIATION
            })
        })
    };
    // e_z x r moves along y by r_x and along x by -r_y; e_x x r along y by -r_z.
    let place = |at: usize| {
        let turn = |row: usize, axis: usize| known.fields[(d * at + row, d + axis)] * known.length;
        match d {
            2 => [turn(1, 0) + known.centre[0], -turn(0, 0) + known.centre[1], 0.0],
            _ => [turn(1, 2) + known.centre[0], -turn(0, 2) + known.centre[1], -turn(1, 0) + known.centre[2]],
        }
    };
    let found: Vec<usize> = (0..rows.vectors.len()).filter(is_node).collect();
    let first = *found.first()?;
    let mut missing: Vec<i64> = found.iter().map(|&at| rows.vectors[at]).collect();
    missing.sort_unstable();
    let message = format!("{} nodes have no coordinates: {}", missing.len(), name_some(&missing));
    // Round to nine digits of the size of the body, since zeros have rounding errors.
    let unit = 1e-9 * known.length;
    let place = place(first).map(|x| format!("{:.6e}", (x / unit).round() * unit + 0.0));
    Some(Diagnostic::new(Code::NodesMissing, message).with_help(format!(
        "add the nodes to the node table; the stiffness moves node {} like a point at ({})",
        rows.vectors[first],
        place[..d].join(", ")
    )))
}

/// Returns an error for massless rows that the stiffness does not hold: K and M then have a common null
/// vector.
pub(super) fn check_massless(
    stiffness: &SymmetricMatrix,
    mass: &SymmetricMatrix,
    label: impl Fn(usize) -> DofLabel,
) -> Result<(), Diagnostic> {
    let massless: Vec<usize> = (0..mass.n()).filter(|&i| mass.row(i).0.is_empty()).collect();
    if massless.is_empty() {
        return Ok(());
    }
    Restricted::new(stiffness, &massless).held().map_err(|free| {
        let labels: Vec<DofLabel> = free.iter().map(|&i| label(massless[i])).collect();
        let message = format!(
            "{} of {} massless rows are free although all others are held: {}",
            free.len(),
            massless.len(),
            name_some(&labels)
        );
        Diagnostic::new(Code::PencilSingular, message)
    })
}

/// Stiffness of some rows with all others held, scaled to a unit diagonal.
struct Restricted {
    matrix: SymmetricMatrix,
    one: SymmetricMatrix,
    /// 1 / sqrt(K_ii), or zero if K_ii is zero.
    scale: Vec<f64>,
}

impl Restricted {
    fn new(stiffness: &SymmetricMatrix, rows: &[usize]) -> Self {
        let n = rows.len();
        let block = stiffness.principal(rows);
        let inverse_root = |d: f64| if d > 0.0 { d.sqrt().recip() } else { 0.0 };
        let scale: Vec<f64> = block.diagonal().into_iter().map(inverse_root).collect();
        let matrix = block.scaled(&scale);
        let unit: Vec<(u32, u32, f64)> = (0..n as u32).map(|i| (i, i, 1.0)).collect();
        let one = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &unit)).expect("diagonal");
        Self { matrix, one, scale }
    }

    /// # Errors
    /// The rows that move most in a motion without energy, in descending order.
    fn held(&self) -> Result<(), Vec<usize>> {
        let n = self.scale.len();
        let loose: Vec<usize> = (0..n).filter(|&i| self.scale[i] == 0.0).collect();
        if !loose.is_empty() {
            return Err(loose);
        }
        let pencil = Pencil::new(&self.matrix, &self.one, 1);
        // If the matrix is too large for an ordering, or indefinite, the search for modes reports it.
        let Some(analysis) = Analysis::new(&pencil) else { return Ok(()) };
        let Some(factor) = Cholesky::<f64>::new(&analysis, &pencil, 1e3 * ZERO_EIGENVALUE) else {
            return Ok(());
        };
        // Inverse iterations: in each of them loose motions grow by 1e9 relative to held ones.
        let mut x = Mat::from_fn(n, 1, |i, _| 1.0 + 0.5 * (i as f64 * 0.7).sin());
        for _ in 0..3 {
            factor.solve_in_place(x.as_mut());
            x /= faer::Scale(x.norm_l2());
        }
        let energy = (x.transpose() * pencil.apply_stiffness(x.as_ref()))[(0, 0)];
        if energy > ZERO_EIGENVALUE {
            return Ok(());
        }
        let largest = x.norm_max();
        let mut free: Vec<usize> = (0..n).filter(|&i| x[(i, 0)].abs() > 0.01 * largest).collect();
        free.sort_by(|&a, &b| x[(b, 0)].abs().total_cmp(&x[(a, 0)].abs()).then(a.cmp(&b)));
        Err(free)
    }

    /// Computes X <- K^-1 X.
    ///
    /// # Errors
    /// The errors of [`held`](Self::held).
    fn solve(&self, x: &mut Mat<f64>) -> Result<(), Vec<usize>> {
        self.held()?;
        let pencil = Pencil::new(&self.matrix, &self.one, 1);
        let scaled = |x: &mut Mat<f64>| {
            for j in 0..x.ncols() {
                x.col_as_slice_mut(j).iter_mut().zip(&self.scale).for_each(|(x, s)| *x *= s);
            }
        };
        let analysis = Analysis::new(&pencil);
        let factor = analysis.as_ref().and_then(|analysis| Cholesky::<f64>::new(analysis, &pencil, 0.0));
        let factor = factor.ok_or_else(|| (0..self.scale.len()).collect::<Vec<_>>())?;
        scaled(x);
        let load = x.clone();
        factor.solve_in_place(x.as_mut());
        // Correct once with the residual: the motion becomes as accurate as K.
        let mut rest = &load - pencil.apply_stiffness(x.as_ref());
        factor.solve_in_place(rest.as_mut());
        *x += &rest;
        scaled(x);
        Ok(())
    }
}
