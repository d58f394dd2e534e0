//! A mass that weighted nodes of a sheet carry, and its points.

use super::turning::{dense, sparse};
use flexbody_model::{DofLabel, Nodes, RawFollowers, RawModel};
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};

/// Number of the point that follows.
pub const POINT: i64 = 900;
/// Weight of each node that the point follows.
const FEET: [(i64, f64); 4] = [(1, 1.0), (4, 2.5), (9, 0.7), (12, 1.6)];
const PLACE: [f64; 3] = [0.16, 0.14, 0.21];
const MASS: f64 = 5.0;
/// Positions of six equal masses about the point, which give it rotary inertia.
const OFFSETS: [f64; 3] = [0.05, 0.03, 0.08];

/// Sheet with a mass on four nodes, in the axes and units of its model.
pub struct Carrier {
    /// Model with the point as a reader delivers it.
    pub raw: RawModel,
    /// Motion of the point: u_d, theta_d by rows of the model.
    pub follows: DMatrix<f64>,
    /// Positions of the masses: six about the point.
    pub masses: Vec<Vector3<f64>>,
    /// Position of the point.
    pub place: Vector3<f64>,
    /// Weighted mean of the nodes.
    pub centre: Vector3<f64>,
}

impl Carrier {
    /// Carries six masses about the point, or one at the point without rotary inertia.
    ///
    /// # Panics
    /// Panics if the model is no sheet.
    pub fn new(raw: RawModel, turn: &Rotation3<f64>, scale: f64, with_inertia: bool) -> Self {
        let place = turn * Vector3::from(PLACE) * scale;
        let labels = raw.dofs.clone().expect("labels");
        let position = |id: i64| {
            Vector3::from(
                raw.nodes.positions[raw.nodes.ids.iter().position(|one| *one == id).expect("a node")],
            )
        };
        let total: f64 = FEET.iter().map(|foot| foot.1).sum();
        let centre = FEET.iter().map(|foot| position(foot.0) * foot.1).sum::<Vector3<f64>>() / total;
        let spread: Matrix3<f64> =
            FEET.iter().map(|foot| -foot.1 * (position(foot.0) - centre).cross_matrix().pow(2)).sum();
        let inverse = spread.try_inverse().expect("feet on no line");
        let n = labels.len();
        let mut follows = DMatrix::zeros(6, n);
        for (row, label) in labels.iter().enumerate().filter(|(_, label)| label.direction <= 3) {
            let Some(foot) = FEET.iter().find(|foot| foot.0 == label.node) else { continue };
            let unit = Vector3::ith(usize::from(label.direction) - 1, 1.0);
            let theta = inverse * (position(label.node) - centre).cross(&unit) * foot.1;
            let moved = unit * (foot.1 / total) + theta.cross(&(place - centre));
            follows.view_mut((0, row), (3, 1)).copy_from(&moved);
            follows.view_mut((3, row), (3, 1)).copy_from(&theta);
        }
        let offsets = OFFSETS.iter().enumerate().flat_map(|(k, size)| [*size, -size].map(|size| (k, size)));
        let masses: Vec<Vector3<f64>> = if with_inertia {
            offsets.map(|(k, size)| place + turn * Vector3::ith(k, size * scale)).collect()
        } else {
            vec![place; 6]
        };
        let mut own = DMatrix::zeros(6, 6);
        for x in &masses {
            let mut motion = DMatrix::zeros(3, 6);
            motion.view_mut((0, 0), (3, 3)).copy_from(&Matrix3::identity());
            motion.view_mut((0, 3), (3, 3)).copy_from(&-(x - place).cross_matrix());
            // Units of the sheet: the unit of force stays, so that masses are divided by the scale.
            own += MASS / 6.0 / scale * motion.transpose() * motion;
        }
        let raw = with_point(raw, &follows, &own, place);
        Self { raw, follows, masses, place, centre }
    }

    /// Returns the displacements of the masses in `vectors` (by rows of the model as read).
    pub fn motions(&self, vectors: &DMatrix<f64>) -> DMatrix<f64> {
        let of_point = &self.follows * vectors;
        let mut motions = DMatrix::zeros(3 * self.masses.len(), vectors.ncols());
        for (k, x) in self.masses.iter().enumerate() {
            for j in 0..vectors.ncols() {
                let theta = Vector3::from(of_point.fixed_view::<3, 1>(3, j));
                let moved = of_point.fixed_view::<3, 1>(0, j) + theta.cross(&(x - self.place));
                motions.view_mut((3 * k, j), (3, 1)).copy_from(&moved);
            }
        }
        motions
    }
}

/// Returns the model with a point at `place` with the mass `own` that moves by `follows`, as a reader delivers it.
fn with_point(
    mut raw: RawModel,
    follows: &DMatrix<f64>,
    own: &DMatrix<f64>,
    place: Vector3<f64>,
) -> RawModel {
    let m = dense(&raw.mass.matrix);
    let n = m.nrows();
    let reduced = &m + follows.transpose() * own * follows;
    raw.mass.matrix = sparse(&(0.5 * (&reduced + reduced.transpose())));
    let mut whole = DMatrix::zeros(n + 6, n + 6);
    whole.view_mut((0, 0), (n, n)).copy_from(&m);
    whole.view_mut((n, n), (6, 6)).copy_from(own);
    raw.followers = Some(RawFollowers {
        points: Nodes { ids: vec![POINT], positions: vec![place.into()] },
        labels: (1..=6).map(|direction| DofLabel { node: POINT, direction }).collect(),
        follows: sparse(&follows.transpose()),
        mass: sparse(&whole),
        others: 0,
    });
    raw
}
