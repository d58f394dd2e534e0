//! Where loads of a scene or of a response act on the nodes of a model.

use crate::base::error::Result;
use crate::body::basis::interface_loads;
use crate::model::FeModel;
use crate::motion::scene::Point;
use faer::Mat;

/// Nodal forces (N x 6, in the plane N x 3) of unit forces and unit torques along the axes of the model at `point`, which are also the weights
/// that take the motion of the point from the displacements; zero columns for torques at a node without rotations. `None` where the model has
/// no such node, or no such interface with a reference point.
///
/// # Errors
/// [`InterfaceNode`](crate::base::diagnostic::Code::InterfaceNode).
pub(super) fn point_loads(model: &FeModel, point: &Point) -> Result<Option<Mat<f64>>> {
    let (d, n) = (model.dimension(), model.rows().len());
    Ok(match point {
        Point::Interface(name) => interface_loads(model, name)?,
        Point::Node(number) => model.nodes().ids.iter().position(|id| id == number).map(|node| {
            let rigid = if d == 2 { 3 } else { 6 };
            let mut loads = Mat::zeros(n, rigid);
            (0..d).for_each(|k| loads[(d * node + k, k)] = 1.0);
            let first = model.rows().displacements();
            for (row, &(of, axis)) in (first..).zip(model.rows().rotations()) {
                if of as usize == node {
                    loads[(row, if d == 2 { 2 } else { d + usize::from(axis) })] = 1.0;
                }
            }
            loads
        }),
    })
}
