//! Checks that K leaves rigid motion free and that M gives it the inertia of a body, and diagnosis of wrong
//! labels if not.

use crate::accepted::acceptance;
use crate::checks::ground::ground_springs;
use crate::checks::strained::Strained;
use crate::fe_model::assemble::Assembled;
use crate::rows::{Recovered, Rows, centre_and_length, rigid_count, rigid_fields, rigid_residuals};
use crate::wording::name_some;
use crate::{DofLabel, Nodes};
use faer::Mat;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::numbers::significant;
use flexbody_linalg::ties::sort_descending;
use flexbody_linalg::{Analysis, Cholesky, CscMatrix, Pencil, Solve, SymmetricMatrix, gram, largest};
use nalgebra::Matrix3;

/// Returns max |K R|_i / sum_j |K_ij| over the rows. Adds an error if rigid motion strains the body, above
/// `limit`: node tables with few digits leave up to 1e-6, supports 0.01 to 1. Springs to ground are an error
/// below the limit as well. Above `rounded` a warning reports the accuracy of the positions, since the
/// invariants have no more digits.
pub(crate) fn check_rigid_motion(
    body: &Assembled,
    rounded: f64,
    limit: f64,
    diagnostics: &mut Vec<Diagnostic>,
) -> f64 {
    let Assembled { origin, nodes, rows, stiffness, .. } = body;
    let (centre, length) = centre_and_length(&nodes.positions);
    let fields = rows.rigid_fields(&nodes.positions, centre, length);
    let residuals = rigid_residuals(stiffness, &fields, &rows.field_sizes(length));
    let worst = largest(residuals.iter().copied());
    let ground = ground_springs(body);
    if worst.is_nan() || worst > limit {
        report_strained(&Strained::new(body, &fields, &residuals, limit), ground, diagnostics);
    } else if ground.is_some() {
        diagnostics.extend(ground);
    } else if worst > rounded {
        let message = format!(
            "|K R| reaches {worst:.1e} of the row sum of |K|: node positions fit the stiffness to about this part of the size of the body"
        );
        diagnostics.push(Diagnostic::new(Code::NodesRounded, message).in_file(&origin.nodes_path));
    }
    worst
}

/// Adds the error for rigid motions that strain the body, with its cause: translations need no coordinates, so that
/// rows that resist them are supported or wrongly labelled; rotations alone strain a body whose coordinates or labels are
/// wrong, or a stiffness that does not follow rotations exactly, which the user may accept.
fn report_strained(strained: &Strained<'_>, ground: Option<Diagnostic>, diagnostics: &mut Vec<Diagnostic>) {
    let body = strained.body;
    let origin = &body.origin;
    let are_few = strained.rows.len() * 2 < strained.residuals.len();
    let known = mislabelled(body, strained.limit).map(str::to_owned).or_else(|| {
        let is_stressed = is_stressed(body, strained.fields, &strained.rows, strained.limit);
        is_stressed.then(|| "write K of the unloaded body, and give the stress stiffness as [[geometric_stiffness]]: at these nodes K resists rotations but not translations, so that it contains the stress of a preload (pretension of a member, contact, pressure)".to_owned())
    });
    if let Some(ground) = ground {
        diagnostics.push(ground);
        if known.is_none() && are_few {
            return;
        }
    }
    let mut error = Diagnostic::new(Code::RigidMotionStrained, strained.message());
    let help = match (known, are_few) {
        (Some(help), _) => help,
        (None, true) if strained.by_translations => {
            "export the free body: these degrees of freedom are supported or tied to ground, since translations strain them, which need no coordinates".to_owned()
        }
        (None, false) if strained.by_translations => {
            "check the order and the labels of the rows, and that K is the stiffness of a free body: nearly all rows resist translations, which need no coordinates".to_owned()
        }
        _ => match strained.exchanged() {
            Some([first, second]) => format!(
                "exchange the coordinates of nodes {first} and {second}: with these exchanged, K leaves rigid motion free"
            ),
            None if strained.may_be_accepted() && origin.allow_implausible.accepts(Code::RigidMotionStrained) => {
                let message = format!("{}; accepted", strained.message());
                diagnostics.push(Diagnostic::new(Code::NodesRounded, message).in_file(&origin.stiffness.path).with_help(
                    "nothing to do if the frequencies of the rigid body lie far below that of the first mode, which is checked with the modes",
                ));
                return;
            }
            None => rotations_alone(strained, are_few),
        },
    };
    error = error.in_file(&origin.stiffness.path).with_help(help);
    diagnostics.push(error);
}

/// Returns advice for a stiffness that only rotations strain.
fn rotations_alone(strained: &Strained<'_>, are_few: bool) -> String {
    let at = if are_few { "of these nodes" } else { "of all nodes" };
    let check = format!(
        "check unit, order and digits of the coordinates {at}, and the labels of rotations: translations, which need no coordinates, do not strain K, so that nothing supports it"
    );
    if !strained.may_be_accepted() {
        return check;
    }
    format!(
        "{check}; if the elements of K do not follow rotations exactly (warped shells, offsets), compare {} of the rigid body with the first mode, and use {}",
        strained.highest_frequency().map_or("the frequencies".to_owned(), |hertz| format!("{hertz} Hz")),
        acceptance(Code::RigidMotionStrained)
    )
}

/// Returns true if K leaves translations free, and rotations (angle theta about each axis) cause forces
/// theta x F at the strained rows: K belongs to a body under a load F that is in equilibrium with its
/// stress. `fields` are the rigid motions, with rotations divided by a length.
fn is_stressed(body: &Assembled, fields: &Mat<f64>, strained: &[usize], limit: f64) -> bool {
    /// Part of the forces that may deviate from theta x F.
    const MAX_FORCE_DEVIATION: f64 = 1e-3;
    let d = body.rows.dimension;
    let force = |row: usize, field: usize| {
        let (columns, values) = body.stiffness.row(row);
        columns.iter().zip(values).map(|(&j, k)| k * fields[(j as usize, field)]).sum::<f64>()
    };
    let size = |row: usize| body.stiffness.row(row).1.iter().map(|k| k.abs()).sum::<f64>();
    let mut vertices: Vec<usize> = strained.iter().map(|row| row / 3).collect();
    vertices.sort_unstable();
    vertices.dedup();
    d == 3
        && strained.iter().all(|row| *row < 3 * body.nodes.len())
        && strained.iter().all(|&row| (0..3).all(|k| force(row, k).abs() <= limit * size(row)))
        && vertices.iter().all(|vertex| {
            let block = [0, 1, 2].map(|k| [3, 4, 5].map(|field| force(3 * vertex + k, field)));
            let pairs = || (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            let largest = pairs().map(|(k, l)| block[k][l].abs()).fold(0.0, f64::max);
            pairs().all(|(k, l)| (block[k][l] + block[l][k]).abs() <= MAX_FORCE_DEVIATION * largest)
        })
}

/// Returns advice if K leaves the rigid motions free that belong to another interpretation of the labels.
fn mislabelled(body: &Assembled, limit: f64) -> Option<&'static str> {
    let readings = Readings::new(body, limit);
    readings.of_three_rows().or_else(|| readings.swapped())
}

/// Other interpretations of the labels of a body in space.
struct Readings<'a> {
    body: &'a Assembled,
    /// Residual of rigid motion due to rounding.
    limit: f64,
    length: f64,
    /// Rigid fields of the nodes in space.
    fields: Mat<f64>,
}

impl<'a> Readings<'a> {
    fn new(body: &'a Assembled, limit: f64) -> Self {
        let (centre, length) = centre_and_length(&body.nodes.positions);
        Self { body, limit, length, fields: rigid_fields(&body.nodes.positions, 3, centre, length) }
    }

    /// Returns true if K leaves these motions free; `rotation` returns true for rows that count as
    /// rotations.
    fn are_free(&self, fields: &Mat<f64>, rotation: impl Fn(usize) -> bool) -> bool {
        let size = |row: usize| if rotation(row) { 1.0 / self.length } else { 1.0 };
        let sizes: Vec<f64> = (0..fields.nrows()).map(size).collect();
        rigid_residuals(&self.body.stiffness, fields, &sizes).iter().all(|&r| r <= self.limit)
    }

    /// Returns the value of a rigid field in a direction of a node: translations, then rotations.
    fn motion(&self, node: usize, direction: usize, field: usize) -> f64 {
        match (direction < 3, field >= 3) {
            (true, _) => self.fields[(3 * node + direction, field)],
            (false, true) => f64::from(u8::from(direction == field)) / self.length,
            (false, false) => 0.0,
        }
    }

    /// Tests if the three rows of each node are other directions than its displacements, or in another
    /// order.
    fn of_three_rows(&self) -> Option<&'static str> {
        if self.body.rows.dimension != 3 || !self.body.rows.are_plain() {
            return None;
        }
        // Motions that such rows cannot represent vanish.
        let readings = [
            (
                [0, 1, 5],
                "set `dimension = 2` and label the rotations with direction 6: the rows are ux, uy, rz of a plane frame",
            ),
            (
                [0, 2, 4],
                "label the rows 1, 3, 5 in space, or rotate the model to the plane x, y and set `dimension = 2`: the rows are ux, uz, ry of a plane frame",
            ),
            (
                [2, 3, 4],
                "label the rows 3, 4, 5 and give the displacements in the plane as well: the rows are uz, rx, ry of a plate in bending",
            ),
        ];
        let n = self.body.nodes.len();
        for (directions, help) in readings {
            let fields = Mat::from_fn(3 * n, 6, |row, c| self.motion(row / 3, directions[row % 3], c));
            if self.are_free(&fields, |row| directions[row % 3] >= 3) {
                return Some(help);
            }
        }
        let blocked = Mat::from_fn(3 * n, 6, |row, c| self.fields[(3 * (row % n) + row / n, c)]);
        self.are_free(&blocked, |_| false)
            .then_some("give a dofs table: the rows are those of x for all nodes, then y, then z")
    }

    /// Tests if displacements and rotations of every node are labelled as each other.
    fn swapped(&self) -> Option<&'static str> {
        let (rows, n) = (&self.body.rows, self.body.nodes.len());
        if rows.dimension != 3 || rows.rotations().len() != 3 * n {
            return None;
        }
        let swapped = Mat::from_fn(rows.len(), 6, |row, c| match row.checked_sub(3 * n) {
            _ if rows.vertex(row) >= n => 0.0,
            None => self.motion(row / 3, 3 + row % 3, c),
            Some(turn) => self.motion(turn / 3, turn % 3, c),
        });
        self.are_free(&swapped, |row| row < 3 * n).then_some(
            "label ux, uy, uz as 1, 2, 3 and rx, ry, rz as 4, 5, 6: here rotations are labelled as displacements and displacements as rotations",
        )
    }
}

/// Checks that a mass that does not commute with rotations gives rigid motion the inertia of a rigid body:
/// R'MR = \[m I, -c~; c~, I0\].
pub(crate) fn check_inertia(body: &Assembled, tolerance: f64, diagnostics: &mut Vec<Diagnostic>) {
    let Assembled { origin, nodes, rows, mass, stiffness, .. } = body;
    let (centre, length) = centre_and_length(&nodes.positions);
    let rigid = rows.rigid_fields(&nodes.positions, centre, length);
    let d = rows.dimension;
    let g = gram(rigid.as_ref(), Pencil::new(stiffness, mass, 1).apply_mass(rigid.as_ref()).as_ref());
    let m = (0..d).map(|k| g[(k, k)]).sum::<f64>() / d as f64;
    let mut refuse = |message: String| {
        diagnostics.push(Diagnostic::new(Code::MassDirectional, message).in_file(&origin.mass.path));
    };
    let directional = (0..d).flat_map(|k| (0..d).map(move |l| (k, l)));
    let spread =
        directional.fold(0.0f64, |s, (k, l)| s.max((g[(k, l)] - if k == l { m } else { 0.0 }).abs()));
    if spread > tolerance * m {
        let along: Vec<String> =
            (0..d).map(|k| format!("{} along {}", significant(g[(k, k)], 12), ["x", "y", "z"][k])).collect();
        return refuse(format!("total mass is {}, coupled by up to {:.1e}", along.join(", "), spread));
    }
    if d == 3 {
        // T_k' M (e_l x r) = -T_l' M (e_k x r), zero for k = l.
        let skew = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
        let spread = skew.fold(0.0f64, |s, (k, l)| s.max((g[(k, 3 + l)] + g[(l, 3 + k)]).abs()));
        if spread > tolerance * m {
            refuse(format!(
                "centres of mass along x, y and z differ by {:.1e}: the mass matrix is not that of a body",
                0.5 * spread / m * length
            ));
        }
    }
}

// Rows without a position and massless rows: rigid motion of the former, and the check that the latter are
// held by stiffness.

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
pub(crate) fn recover(stiffness: &SymmetricMatrix, rows: &mut Rows, nodes: &Nodes) -> Result<(), Diagnostic> {
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

/// Returns an error for nodes whose coordinates are missing: K moves them like any node, along axes of their own where
/// the program has such (CD of Nastran), and they carry mass. The error states the position that K gives to the first of
/// them.
pub(crate) fn misplaced(rows: &Rows) -> Option<Diagnostic> {
    let d = rows.dimension;
    let known = &rows.recovered;
    let part = |at: usize, first: usize| {
        Matrix3::from_fn(|k, c| {
            let is_there = k < d && c < d && first + c < known.fields.ncols();
            if is_there { known.fields[(d * at + k, first + c)] } else { f64::from(u8::from(k == c)) }
        })
    };
    // A unit translation of the body moves a node by a unit vector: the columns are the axes of the body in those of the
    // rows.
    let is_node = |at: &usize| {
        let axes = part(*at, 0);
        (axes.tr_mul(&axes) - Matrix3::identity()).amax() < MAX_NODE_DEVIATION
    };
    // e_z x r moves along y by r_x and along x by -r_y; e_x x r along y by -r_z.
    let place = |at: usize| {
        let turns = part(at, 0).tr_mul(&part(at, d)) * known.length;
        match d {
            2 => [turns[(1, 0)] + known.centre[0], -turns[(0, 0)] + known.centre[1], 0.0],
            _ => [
                turns[(1, 2)] + known.centre[0],
                -turns[(0, 2)] + known.centre[1],
                -turns[(1, 0)] + known.centre[2],
            ],
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
pub(crate) fn check_massless(
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
        sort_descending(&mut free, |&i| x[(i, 0)].abs());
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
