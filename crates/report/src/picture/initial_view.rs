//! Initial view of a picture, and the places of a drawn body that other parts of its surface hide.

use super::drawing::Drawing;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Depth of a surface in front of a place, relative to the radius of the drawing, from which it hides the place. The wall of a
/// plate that is thinner hides nothing.
const LEAST_DEPTH: f64 = 1e-3;

/// Depth of a surface for a place that is no vertex of a thinned surface, which may pass in front of it.
const LEAST_DEPTH_BESIDE_VERTICES: f64 = 0.02;

/// Rotation about x of a view from above, and of one from below. Unit: rad.
const ABOUT_X: [f64; 2] = [-1.12, -2.02];
/// Rotation about z of the usual view. Unit: rad.
const ABOUT_Z: f64 = -0.6;
/// Rotation about x of a plane body. Unit: rad.
const ABOUT_X_OF_PLANE: f64 = -0.35;

/// Steps about z away from the usual view, in eighths of a turn, in the order in which they are preferred.
const STEPS: [i32; 8] = [0, 1, -1, 2, -2, 3, -3, 4];

/// Place on a body that a view should show.
#[derive(Debug, Clone, Copy)]
pub(super) struct MarkedPlace {
    /// Undeformed position in model coordinates. Unit: length.
    pub position: [f64; 3],
    /// Vertex of the drawing; `None` if the place is not drawn.
    pub vertex: Option<u32>,
}

/// View by a rotation about z of the model, then about x of the page; its third axis points to the viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InitialView {
    /// Rotations about x and about z. Unit: rad.
    pub angles: [f64; 2],
}

impl InitialView {
    /// Returns the usual view of a body or, if that hides `place`, the nearest one that shows it; the usual view if every side hides
    /// it.
    pub(super) fn of(drawing: &Drawing<'_>, is_plane: bool, place: Option<&MarkedPlace>) -> Self {
        if is_plane {
            return Self { angles: [ABOUT_X_OF_PLANE, 0.0] };
        }
        let usual = Self { angles: [ABOUT_X[0], ABOUT_Z] };
        let Some(place) = place else { return usual };
        let around = |step: &i32| ABOUT_Z + f64::from(*step) * std::f64::consts::FRAC_PI_4;
        let all = ABOUT_X
            .into_iter()
            .flat_map(|x| STEPS.iter().map(move |step| Self { angles: [x, around(step)] }));
        all.into_iter().find(|view| !place.is_hidden(drawing, &view.turn())).unwrap_or(usual)
    }

    /// Returns the rotation from model coordinates to the axes of the page.
    pub(super) fn turn(self) -> Matrix3<f64> {
        let [x, z] = self.angles;
        let turned = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
        (turned(Vector3::x_axis(), x) * turned(Vector3::z_axis(), z)).into_inner()
    }
}

impl MarkedPlace {
    /// Returns true if a triangle of the drawing is between the place and a viewer on the third axis of `turn`. Triangles at the
    /// vertex of the place do not hide it.
    pub(super) fn is_hidden(&self, drawing: &Drawing<'_>, turn: &Matrix3<f64>) -> bool {
        let least = if self.vertex.is_some() { LEAST_DEPTH } else { LEAST_DEPTH_BESIDE_VERTICES };
        let place = turn * Vector3::from(self.position);
        let front = place.z + least * drawing.radius();
        let seen: Vec<Vector3<f64>> = drawing.places().iter().map(|x| turn * Vector3::from(*x)).collect();
        let hides = |corners: [u32; 3]| {
            if self.vertex.is_some_and(|vertex| corners.contains(&vertex)) {
                return false;
            }
            let corners = corners.map(|vertex| seen[vertex as usize]);
            depth_at(&corners, place.x, place.y).is_some_and(|depth| depth > front)
        };
        drawing.triangle_corners().into_iter().any(hides)
    }
}

/// Returns the third coordinate of a triangle at a point of the page; `None` beside the triangle and for one that is seen from its
/// edge.
fn depth_at([a, b, c]: &[Vector3<f64>; 3], x: f64, y: f64) -> Option<f64> {
    let area = |p: &Vector3<f64>, q: &Vector3<f64>, x: f64, y: f64| {
        (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)
    };
    let whole = area(a, b, c.x, c.y);
    let parts = [area(b, c, x, y), area(c, a, x, y), area(a, b, x, y)].map(|part| part / whole);
    let is_inside = parts.iter().all(|part| *part >= 0.0);
    is_inside.then(|| parts[0] * a.z + parts[1] * b.z + parts[2] * c.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_a_depth_inside_it_only() {
        let triangle = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 5.0]].map(Vector3::from);
        assert_eq!(depth_at(&triangle, 1.0, 1.0), Some(2.0));
        let [a, b, c] = triangle;
        assert_eq!(depth_at(&[a, c, b], 1.0, 1.0), Some(2.0));
        assert_eq!(depth_at(&triangle, 3.0, 3.0), None);
        assert_eq!(depth_at(&triangle, -0.1, 1.0), None);
        let edge_on = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [2.0, 0.0, 5.0]].map(Vector3::from);
        assert_eq!(depth_at(&edge_on, 1.0, 0.0), None);
    }
}
