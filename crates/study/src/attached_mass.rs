//! Point mass attached to a free body: its share of the inertia, and the first frequency with it.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::flex_body::{FlexBody, Interface};
use flexbody_linalg::symmetric_eigen;
use flexbody_linalg::ties::first_largest;
use flexbody_motion::dynamics::{BodyPoint, Terms};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Smallest singular value of I0, relative to the largest, that counts as inertia.
const LEAST_INERTIA: f64 = 1e-12;

/// Point mass attached to a body.
#[derive(Debug, Clone, PartialEq)]
pub struct AttachedMass {
    /// Mass, in the unit of mass of the body.
    pub mass: f64,
    /// Name of the interface that carries it; `None` for the node farthest from the centre of mass.
    pub interface: Option<String>,
}

/// Mass m_a at a place of a body of the mass m in mean axes, whose motion is relative to the common centre of mass.
pub(crate) struct Carried<'b> {
    body: &'b FlexBody,
    mass: f64,
    /// Place relative to the centre of mass of the body, body axes.
    arm: Vector3<f64>,
    /// Displacements of the place by the modes (3 x nf), body axes.
    shape: DMatrix<f64>,
}

impl<'b> Carried<'b> {
    /// Places an attached mass on `body`.
    ///
    /// # Errors
    /// FB801 if the body does not have the interface.
    pub(crate) fn new(body: &'b FlexBody, attached: &AttachedMass) -> Result<Self> {
        let centre = body.invariants().first_moment() / body.invariants().mass();
        let (place, shape) = match &attached.interface {
            Some(name) => at_interface(body, interface_of(body, name)?),
            None => {
                let node = farthest_node(body, &centre);
                (node_place(body, node), rows_of(body, &BodyPoint::node(body, node)))
            }
        };
        Ok(Self { body, mass: attached.mass, arm: place - centre, shape })
    }

    /// Returns the inertia that the mass adds, mu (|r|^2 I - r r') with mu = m m_a / (m + m_a): that of both about their
    /// common centre of mass is I0 with this.
    pub(crate) fn inertia(&self) -> Matrix3<f64> {
        let (own, arm) = (self.body.invariants().mass(), &self.arm);
        let reduced = own * self.mass / (own + self.mass);
        (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * reduced
    }

    /// Returns the first circular frequency of the free body with the mass, from the modes of the body. A force at the
    /// place moves the rigid body by Y = 1/m - r~ I0^-1 r~ per unit, so that the mass adds psi' (1/m_a + Y)^-1 psi to the
    /// modal mass, with psi the displacements of the place. Returns `None` without a mass.
    pub(crate) fn first_rate(&self) -> Option<f64> {
        if self.mass == 0.0 {
            return None;
        }
        let (invariants, eigenvalues) = (self.body.invariants(), &self.body.modes().eigenvalue);
        let mobility = self.rigid_mobility(invariants.mass(), &invariants.inertia())?;
        let effective = (Matrix3::identity() / self.mass + mobility).try_inverse()?;
        // The largest eigenvalue of Lambda^(-1/2) (1 + psi' mu psi) Lambda^(-1/2) is 1 / omega_1^2.
        let nf = eigenvalues.len();
        let added = self.shape.transpose() * effective * &self.shape;
        let flexibility = faer::Mat::from_fn(nf, nf, |i, j| {
            let own = if i == j { 1.0 } else { 0.0 };
            (own + added[(i, j)]) / (eigenvalues[i] * eigenvalues[j]).sqrt()
        });
        let largest = *symmetric_eigen(flexibility.as_ref())?.values.last()?;
        Some(1.0 / largest.sqrt())
    }

    /// Returns the acceleration of the place of the rigid body per unit of force at it.
    fn rigid_mobility(&self, mass: f64, inertia: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        let turned = if self.body.dimension() == 2 {
            Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0 / inertia[(2, 2)]))
        } else {
            inertia.pseudo_inverse(LEAST_INERTIA * inertia.norm()).ok()?
        };
        let arm = self.arm.cross_matrix();
        Some(Matrix3::identity() / mass - arm * turned * arm)
    }
}

fn interface_of<'b>(body: &'b FlexBody, name: &str) -> Result<&'b Interface> {
    body.interfaces().iter().find(|interface| interface.name == name).ok_or_else(|| {
        let names: Vec<&str> = body.interfaces().iter().map(|interface| interface.name.as_str()).collect();
        let help = if names.is_empty() {
            "leave the interface out: the mass is then at the node farthest from the centre".to_owned()
        } else {
            format!("its interfaces are {}", names.join(", "))
        };
        Diagnostic::new(Code::Usage, format!("the body has no interface `{name}`")).with_help(help).into()
    })
}

/// Returns the place of an interface and its displacements by the modes (3 x nf): of its reference point, without one
/// the means over its nodes.
fn at_interface(body: &FlexBody, interface: &Interface) -> (Vector3<f64>, DMatrix<f64>) {
    let point = BodyPoint::interface(body, interface, Terms::NONE);
    if let Some((reference, point)) = interface.reference.zip(point) {
        return (Vector3::from(reference), rows_of(body, &point));
    }
    let count = interface.nodes.len() as f64;
    let place = interface.nodes.iter().map(|&node| node_place(body, node)).sum::<Vector3<f64>>();
    let rows = interface.nodes.iter().map(|&node| rows_of(body, &BodyPoint::node(body, node)));
    let sum = rows.fold(DMatrix::zeros(3, body.n_modes()), |sum, rows| sum + rows);
    (place / count, sum / count)
}

/// Returns the displacements of a point by the modes (3 x nf).
fn rows_of(body: &FlexBody, point: &BodyPoint) -> DMatrix<f64> {
    let nf = body.n_modes();
    let unit = |j: usize| (0..nf).map(|i| f64::from(i == j)).collect::<Vec<_>>();
    let columns: Vec<Vector3<f64>> = (0..nf).map(|j| point.deflection(&unit(j))).collect();
    DMatrix::from_fn(3, nf, |k, j| columns[j][k])
}

fn node_place(body: &FlexBody, node: usize) -> Vector3<f64> {
    Vector3::from(body.nodes().positions[node])
}

/// Returns the index of the node farthest from `centre`.
fn farthest_node(body: &FlexBody, centre: &Vector3<f64>) -> usize {
    let distance = |node: &usize| (node_place(body, *node) - centre).norm_squared();
    first_largest(0..body.n_nodes(), distance).unwrap_or(0)
}
