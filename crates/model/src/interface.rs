//! Interfaces: named node sets, their reference points for joints, and the common motion of both.

use crate::{centre_and_length, rigid_count, rigid_fields};
use faer::{Mat, MatRef};
use flexbody_linalg::gram;
use nalgebra::{Matrix3, Vector3};
use strum::{EnumString, IntoStaticStr, VariantArray, VariantNames};

/// Width of a node set across its best-fit line, relative to its length, below which it determines no
/// rotation about that line.
const COLLINEAR_WIDTH: f64 = 1e-6;

/// Coupling between the nodes of an interface and its reference point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, EnumString, IntoStaticStr, VariantArray, VariantNames)]
#[strum(serialize_all = "lowercase")]
pub enum Coupling {
    /// The nodes move as one rigid body with the reference point (RBE2).
    Rigid,
    /// The reference point follows the mean rigid motion of the nodes with equal weights (RBE3).
    Averaging,
    /// No reference point: every degree of freedom of the nodes belongs to the interface.
    Free,
}

impl Coupling {
    /// All couplings.
    pub const ALL: &'static [Self] = <Self as VariantArray>::VARIANTS;

    /// Names of all couplings, in the order of `ALL`.
    pub const NAMES: &'static [&'static str] = <Self as VariantNames>::VARIANTS;

    /// Returns the name in manifests, files and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the coupling with the given name.
    pub fn from_name(name: &str) -> Option<Self> {
        name.parse().ok()
    }
}

/// Position of the reference point of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Reference {
    /// Centre of its faces (weighted by area) or, without faces, of its edges (by length) or, without
    /// edges, mean of its nodes.
    #[default]
    Centre,
    /// Point of an axis, at the middle of the extent of the nodes along it.
    Axis {
        /// A point of the axis, in model axes.
        point: [f64; 3],
        /// Direction of the axis, of any length.
        direction: [f64; 3],
    },
    /// Position of the default, [`Reference::Centre`] or [`Reference::Axis`], in a checked model, in model
    /// axes.
    Default([f64; 3]),
    /// Given point in model axes.
    Point([f64; 3]),
    /// Node of the node table, with or without degrees of freedom.
    Node(i64),
}

/// Named set of nodes: an interface of the manifest.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeSet {
    /// Name, unique within the model.
    pub name: String,
    /// Node numbers.
    pub nodes: Vec<i64>,
    /// Coupling to the reference point, if stated.
    pub coupling: Option<Coupling>,
    /// Reference point; in a checked model a position, except for a free interface.
    pub reference: Reference,
    /// Node numbers whose faces and edges define the default reference point, if they are more than
    /// `nodes`: a set of an FE program may have nodes without rows. Empty: `nodes`.
    pub outline: Vec<i64>,
}

impl Reference {
    /// Returns true if a user stated the point, as a position or a node.
    pub fn is_stated(&self) -> bool {
        matches!(self, Self::Point(_) | Self::Node(_))
    }

    /// Returns the position in model axes, if it is known.
    pub fn point(&self) -> Option<[f64; 3]> {
        match *self {
            Self::Default(point) | Self::Point(point) => Some(point),
            Self::Centre | Self::Axis { .. } | Self::Node(_) => None,
        }
    }
}

impl NodeSet {
    /// Creates a set without a stated coupling and reference point.
    pub fn new(name: impl Into<String>, nodes: Vec<i64>) -> Self {
        Self {
            name: name.into(),
            nodes,
            coupling: None,
            reference: Reference::default(),
            outline: Vec::new(),
        }
    }

    /// Returns the stated coupling, or averaging.
    pub fn coupling(&self) -> Coupling {
        self.coupling.unwrap_or(Coupling::Averaging)
    }
}

/// Mean rotation of nodes from their displacements alone.
struct MeanTurning {
    dimension: usize,
    centre: Vector3<f64>,
    /// Vectors from the centre to the nodes, scaled to unit size so that squares of coordinates in any unit
    /// stay in the range of numbers.
    arms: Vec<Vector3<f64>>,
    /// Matrix from the sum of r x u to the rotation; zero about axes about which the nodes determine no
    /// rotation.
    inverse: Matrix3<f64>,
    /// Smallest moment of the arms about an axis that the nodes may turn about, and the threshold above
    /// which the rotation is determined.
    moment: f64,
    threshold: f64,
}

impl MeanTurning {
    fn new(positions: &[[f64; 3]], dimension: usize) -> Self {
        let (centre, length) = centre_and_length(positions);
        let centre = Vector3::from(centre);
        let arms: Vec<Vector3<f64>> =
            positions.iter().map(|&x| (Vector3::from(x) - centre) / length).collect();
        let inertia: Matrix3<f64> =
            arms.iter().map(|r| Matrix3::identity() * r.norm_squared() - r * r.transpose()).sum();
        let threshold = COLLINEAR_WIDTH * COLLINEAR_WIDTH * inertia.trace();
        let (mut inverse, mut moment) = (Matrix3::zeros(), 0.0);
        if threshold.is_finite() {
            // Nodes on one line determine no rotation about it, a single node none at all.
            inverse = inertia.pseudo_inverse(threshold).unwrap_or_else(|_| Matrix3::zeros()) / length;
            moment = if dimension == 2 { inertia[(2, 2)] } else { inertia.symmetric_eigenvalues().min() };
        }
        Self { dimension, centre, arms, inverse, moment, threshold }
    }

    /// Returns true if the displacements determine every rotation.
    fn is_determined(&self) -> bool {
        self.moment > self.threshold
    }

    /// Returns the weights of the rows in the motion of a point at `offset` from the centre. With
    /// `by_rotations` the rotation is the mean of the nodal rotations.
    fn weights(&self, all_rows: usize, offset: &Vector3<f64>, by_rotations: bool) -> Mat<f64> {
        let (d, count) = (self.dimension, self.arms.len() as f64);
        let axes = if d == 2 { 2..3 } else { 0..3 };
        let turn = |axis: usize, r: &Vector3<f64>| (self.inverse * Vector3::ith(axis, 1.0)).cross(r);
        let (first_turn, turns) = (d * self.arms.len(), axes.len());
        let mut average = Mat::zeros(all_rows, rigid_count(d));
        for (i, r) in self.arms.iter().enumerate() {
            for k in 0..d {
                average[(d * i + k, k)] = 1.0 / count;
            }
            for (column, axis) in axes.clone().enumerate() {
                let weight = if by_rotations { Vector3::zeros() } else { turn(axis, r) };
                let lever = Vector3::ith(axis, 1.0).cross(offset);
                for k in 0..d {
                    average[(d * i + k, d + column)] = weight[k];
                    for along in 0..d {
                        average[(d * i + k, along)] += lever[along] * weight[k];
                    }
                }
                if by_rotations {
                    let row = first_turn + turns * i + column;
                    average[(row, d + column)] = 1.0 / count;
                    (0..d).for_each(|along| average[(row, along)] = lever[along] / count);
                }
            }
        }
        average
    }
}

/// Rigid motion of k nodes and a reference point: r = 6 unit motions, translations and rotations along the
/// axes, in the plane (d = 2) r = 3. Rows: the displacements of the nodes (d each), then their rotations,
/// if any (three each, in the plane one).
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceMotion {
    reference: [f64; 3],
    rigid: Mat<f64>,
    average: Mat<f64>,
    determined: bool,
}

impl InterfaceMotion {
    /// Creates the motion for nodes at `positions` (at least one), all with or all without `rotations`, and
    /// a reference point, by default the mean of the positions. The displacements determine the rotation of
    /// the reference point; if the nodes lie on one line, the mean of their rotations does.
    pub fn new(
        positions: &[[f64; 3]],
        rotations: bool,
        dimension: usize,
        reference: Option<[f64; 3]>,
    ) -> Self {
        let turning = MeanTurning::new(positions, dimension);
        let reference = reference.unwrap_or(turning.centre.into());
        let (d, turns) = (dimension, rigid_count(dimension) - dimension);
        let count_rows = d * positions.len();
        let all_rows = count_rows + if rotations { turns * positions.len() } else { 0 };
        let mut rigid = rigid_fields(positions, d, reference, 1.0);
        rigid.resize_with(all_rows, rigid_count(d), |row, column| {
            f64::from(row >= count_rows && column == d + (row - count_rows) % turns)
        });
        let by_rotations = rotations && turning.moment <= turning.threshold;
        // Weights about the centre: the translation of the reference point adds the rotation times its
        // distance.
        let offset = Vector3::from(reference) - turning.centre;
        let average = turning.weights(all_rows, &offset, by_rotations);
        Self { reference, rigid, average, determined: by_rotations || turning.is_determined() }
    }

    /// Returns the reference point.
    pub fn reference(&self) -> [f64; 3] {
        self.reference
    }

    /// Returns R (rows x r): displacements and rotations of the nodes for unit motions of the reference
    /// point.
    pub fn rigid(&self) -> MatRef<'_, f64> {
        self.rigid.as_ref()
    }

    /// Returns A (rows x r) with A'R = I: the nodal loads of a unit force or torque at the reference point.
    /// A' u is the least-squares rigid motion for the displacements u, all nodes with equal weight, A = R
    /// (R'R)^-1. Nodal rotations are used only if the displacements do not determine the rotation.
    pub fn average(&self) -> MatRef<'_, f64> {
        self.average.as_ref()
    }

    /// Returns true if the nodes determine the rotation: they do not lie on one line (in the plane at one
    /// point), or have rotations.
    pub fn is_determined(&self) -> bool {
        self.determined
    }

    /// Returns the rigid motion A' u (r x m) that best fits the rows u (rows x m) of the nodes.
    pub fn fit(&self, u: MatRef<'_, f64>) -> Mat<f64> {
        gram(self.average.as_ref(), u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.1], [1.0, 0.0, 0.0], [0.3, 2.0, 0.0], [0.5, 0.5, 3.0], [7.0, -1.0, 0.2]];

    fn off_identity(a: &Mat<f64>) -> f64 {
        (a - Mat::<f64>::identity(a.nrows(), a.ncols())).norm_max()
    }

    #[test]
    fn the_average_of_a_rigid_motion_is_that_motion_about_any_point() {
        for reference in [None, Some([0.0; 3]), Some([1e3, -2e3, 5e2])] {
            let motion = InterfaceMotion::new(&NODES, false, 3, reference);
            assert!(motion.is_determined());
            let scale = motion.reference().iter().fold(1.0f64, |m, x| m.max(x.abs()));
            assert!(off_identity(&motion.fit(motion.rigid())) < 1e-15 * scale * scale, "{reference:?}");
            // Least squares: the residual is orthogonal to all rigid motions.
            let u = Mat::from_fn(15, 2, |i, j| ((7 * i + 3 * j) as f64).sin());
            let left = &u - motion.rigid() * motion.fit(u.as_ref());
            assert!(gram(motion.rigid(), left.as_ref()).norm_max() < 1e-12 * scale, "{reference:?}");
        }
        let flat: Vec<[f64; 3]> = NODES.iter().map(|x| [x[0], x[1], 0.0]).collect();
        let motion = InterfaceMotion::new(&flat, false, 2, Some([3.0, 4.0, 0.0]));
        assert_eq!(motion.rigid().ncols(), 3);
        assert!(off_identity(&motion.fit(motion.rigid())) < 1e-14);
    }

    #[test]
    fn nodes_on_a_line_determine_no_rotation() {
        let line = [[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0 + 1e-9]];
        assert!(!InterfaceMotion::new(&line, false, 3, None).is_determined());
        assert!(!InterfaceMotion::new(&line[..1], false, 3, None).is_determined());
        let flat = [[0.0; 3], [1.0, 2.0, 0.0]];
        assert!(InterfaceMotion::new(&flat, false, 2, None).is_determined());
        assert!(!InterfaceMotion::new(&flat[..1], false, 2, None).is_determined());
        // Nodal rotations determine it about any point; nodes in space determine it without them.
        for nodes in [&line[..], &line[..1], &NODES[..]] {
            let motion = InterfaceMotion::new(nodes, true, 3, Some([3.0, -1.0, 2.0]));
            assert!(motion.is_determined());
            assert_eq!(motion.rigid().nrows(), 6 * nodes.len());
            assert!(off_identity(&motion.fit(motion.rigid())) < 1e-13);
        }
        assert!(InterfaceMotion::new(&flat[..1], true, 2, None).is_determined());
        // A single node still transmits forces.
        let one = InterfaceMotion::new(&line[..1], false, 3, None);
        assert_eq!((one.average()[(1, 1)], one.average()[(1, 4)]), (1.0, 0.0));
    }
}
