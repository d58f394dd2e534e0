//! Transformation of modes between a model and the frame of its body.

use crate::basis::ModalBasis;
use crate::flex_body::{FlexBody, Frame, Interface, InternalRows};
use crate::invariants::{
    InertiaStiffness, Invariants, MassProduct, RigidMotion, condense, condense_general,
    condense_general_linear, condense_linear, rigid_first_moment, symmetric_part,
};
use faer::{Mat, MatRef};
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_eigen::{Completeness, Proof, canonical_sign, relative_residual};
use flexbody_linalg::{
    SymmetricMatrix, combine, contiguous_mut, copied, dense_cholesky, gram, largest_entry,
    left_singular_vectors, multiply, parallel, projection_compensated, solve_lower, solve_upper,
    subtract_combination, zeros,
};
use flexbody_model::{Coupling, DirectorMass, FeModel, NodeMoments, Nodes, rigid_axes, rigid_count};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// Body frame and the node positions in it.
pub struct NodesInFrame {
    /// Origin and axes of the body frame in model coordinates.
    pub frame: Frame,
    /// Positions of the nodes (n) in the body frame.
    pub positions: Vec<[f64; 3]>,
}

impl NodesInFrame {
    /// Transforms the nodes of `model` to `frame`.
    pub fn new(model: &FeModel, frame: Frame) -> Self {
        Self { frame, positions: frame.to_body(&model.nodes().positions) }
    }
}

/// Returns unit translations along the axes of a frame and unit rotations about them (rows of the model).
fn rigid_fields(model: &FeModel, frame: &Frame) -> Mat<f64> {
    let mut fields = model.rigid_fields(frame.origin.into(), 1.0);
    frame.rotate_rigid(&mut fields);
    fields
}

/// Returns R'MR of the unit translations and rotations of a frame.
pub fn rigid_mass(model: &FeModel, frame: &Frame) -> Mat<f64> {
    let rigid = rigid_fields(model, frame);
    gram(rigid.as_ref(), model.pencil().apply_mass(rigid.as_ref()).as_ref())
}

/// Returns Psi' A Psi for a matrix A and modes in model axes.
pub(super) fn reduced(a: &SymmetricMatrix, vectors: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = zeros(vectors.nrows(), vectors.ncols());
    multiply(a, 1, vectors, product.as_mut());
    symmetric_part(&gram(vectors, product.as_ref()))
}

/// Returns Psi' A Psi as [`reduced`] does, accumulated in twice the precision and rounded once at the end.
pub(super) fn reduced_in_twice_the_precision(a: &SymmetricMatrix, vectors: MatRef<'_, f64>) -> Mat<f64> {
    let projection = projection_compensated(a, vectors);
    Mat::from_fn(vectors.ncols(), vectors.ncols(), |i, j| projection[i][j].hi)
}

/// Modes of a body in model axes and in body axes.
pub struct BodyModes {
    /// Modes in the rows and axes of the model (N x nf).
    pub vectors: Mat<f64>,
    /// Displacements in body axes: three per node, then three per vector without a position.
    pub displacements: Mat<f64>,
    /// Displacements in body axes of the points that follow nodes, three each.
    pub followers: Mat<f64>,
    /// Rotations in body axes, three per node and then per point that follows nodes, zero at nodes without
    /// rotations.
    pub rotations: Option<Mat<f64>>,
    /// Rows without a position: vectors in body axes, then massless rows.
    pub internal: Option<InternalRows>,
    /// Sign that each mode of the search was multiplied by.
    pub signs: Vec<f64>,
    nodes: usize,
}

impl BodyModes {
    /// Creates the modes of a body from `vectors` (N x nf, model axes) with canonical signs in body axes:
    /// the component of largest magnitude is positive, where rotations of nodes count times the size of the
    /// body.
    pub fn new(model: &FeModel, place: &NodesInFrame, mut vectors: Mat<f64>) -> Self {
        let rows = model.rows();
        let (nodes, nf) = (model.nodes().len(), vectors.ncols());
        // Displacements and rotations along the body axes.
        let mut displacements =
            in_space(vectors.as_ref().subrows(0, rows.displacements()), model.dimension());
        place.frame.rotate_shapes(&mut displacements);
        let [mut followers, turned] = motion_of_followers(model, &vectors);
        place.frame.rotate_shapes(&mut followers);
        let mut rotations = model.has_rotations().then(|| {
            let mut rotations = zeros(3 * nodes + turned.nrows(), nf);
            rotations.subrows_mut(3 * nodes, turned.nrows()).copy_from(&turned);
            for (row, &(node, axis)) in (rows.displacements()..).zip(rows.rotations()) {
                for j in 0..nf {
                    rotations[(3 * node as usize + usize::from(axis), j)] = vectors[(row, j)];
                }
            }
            place.frame.rotate_shapes(&mut rotations);
            rotations
        });
        // Sign of each mode by its largest component; rotations count times the size of the body.
        let size = place.positions.iter().map(|x| Vector3::from(*x).norm()).fold(0.0, f64::max);
        let sign = |j: usize| {
            let moved = displacements.col_as_slice(j)[..3 * nodes].iter().copied();
            let turned = rotations.iter().flat_map(|turned| turned.col_as_slice(j)).map(|angle| size * angle);
            canonical_sign(moved.chain(turned))
        };
        let signs = parallel::map(0..nf, sign);
        // Turn the modes with a negative sign.
        for shapes in [&mut vectors, &mut displacements, &mut followers].into_iter().chain(&mut rotations) {
            let reversed = shapes.col_iter_mut().zip(&signs).filter(|(_, sign)| **sign < 0.0);
            parallel::for_each(reversed, |(shape, _)| {
                contiguous_mut(shape).iter_mut().for_each(|x| *x = -*x)
            });
        }
        let internal = internal(model, &vectors, &displacements);
        Self { vectors, displacements, followers, rotations, internal, signs, nodes }
    }

    /// Returns the modes of a body that was made from `model`; `None` if the body has other rows than the
    /// model.
    pub fn of_body(model: &FeModel, body: &FlexBody) -> Option<Self> {
        let modes = body.modes();
        let displacements = body.displacements_of(model)?;
        let nodes = model.nodes().len();
        let points = modes.shape.nrows() - 3 * nodes;
        Some(Self {
            followers: copied(modes.shape.as_ref().subrows(3 * nodes, points)),
            vectors: body.vectors_of(model)?,
            displacements,
            rotations: modes.rotation.clone(),
            internal: modes.internal.clone(),
            signs: vec![1.0; body.n_modes()],
            nodes,
        })
    }

    /// Returns the displacements of the nodes of the body: those of the model, then the points that follow them.
    pub fn of_body_nodes(&self) -> Mat<f64> {
        let nodes = self.of_nodes();
        let all = nodes.nrows() + self.followers.nrows();
        Mat::from_fn(all, nodes.ncols(), |row, j| match row.checked_sub(nodes.nrows()) {
            Some(after) => self.followers[(after, j)],
            None => nodes[(row, j)],
        })
    }

    /// Returns the displacements of the nodes (3n x nf).
    pub fn of_nodes(&self) -> MatRef<'_, f64> {
        self.displacements.as_ref().subrows(0, 3 * self.nodes)
    }

    /// Condenses the modes by the formulas that fit the mass of `model`.
    pub fn condensed(&self, model: &FeModel, place: &NodesInFrame, modal_stiffness: Mat<f64>) -> Invariants {
        self.by(model, place, modal_stiffness, condense, condense_general)
    }

    /// Condenses mass-normalised modes without W2 and W3: only rigid motion is multiplied by M.
    pub fn condensed_linear(
        &self,
        model: &FeModel,
        place: &NodesInFrame,
        modal_stiffness: Mat<f64>,
    ) -> Invariants {
        self.by(model, place, modal_stiffness, condense_linear, condense_general_linear)
    }

    /// Returns the stiffness of inertia of nodes with rotational mass; `None` if there are none.
    pub fn inertia_stiffness(&self, model: &FeModel, frame: &Frame) -> Option<InertiaStiffness> {
        let (mass, rotations) = (model.director_mass()?, self.rotations.as_ref()?);
        let mut fields = mass.extend_rigid(model.rigid_fields(frame.origin.into(), 1.0).as_ref());
        frame.rotate_rigid(&mut fields);
        let nothing = NodeMoments { first: Vector3::zeros(), second: nalgebra::Matrix3::zeros() };
        let mut moments = vec![nothing; rotations.nrows() / 3];
        for (&node, moment) in mass.nodes().iter().zip(mass.moments(fields.as_ref(), &frame.axes)) {
            moments[model.node_of_body(node)] = moment;
        }
        Some(InertiaStiffness::new(moments, rotations.as_ref(), model.dimension()))
    }

    /// Returns the number of columns that the condensation multiplies by M; `linear` omits W2 and W3.
    pub fn condensed_columns(&self, model: &FeModel, linear: bool) -> u64 {
        let nf = self.vectors.ncols() as u64;
        match (model.scalar_mass(), linear) {
            (Some(_), true) => 4,
            (Some(_), false) => 4 + 3 * nf,
            (None, true) => rigid_count(model.dimension()) as u64,
            (None, false) if model.dimension() == 2 => 3 + 2 * nf,
            (None, false) => 6 + 4 * nf,
        }
    }

    /// Condenses by the formulas `solid` or `general`, depending on the mass of `model`.
    fn by(
        &self,
        model: &FeModel,
        place: &NodesInFrame,
        modal_stiffness: Mat<f64>,
        solid: impl Fn(&SymmetricMatrix, &[[f64; 3]], MatRef<'_, f64>, Mat<f64>) -> Invariants,
        general: impl Fn(&(dyn MassProduct + 'static), &RigidMotion<'_>, MatRef<'_, f64>, Mat<f64>) -> Invariants,
    ) -> Invariants {
        if let Some(mass) = model.scalar_mass() {
            return solid(mass, &place.positions, self.displacements.as_ref(), modal_stiffness);
        }
        if let Some(mass) = model.director_mass() {
            return self.of_directors(model, mass, place, |mass, motion, shapes| {
                general(mass, motion, shapes, modal_stiffness)
            });
        }
        let fields = rigid_fields(model, &place.frame);
        let motion = RigidMotion {
            fields: fields.as_ref(),
            displacements: model.rows().displacements(),
            axes: place.frame.axes,
        };
        general(model.pencil().mass(), &motion, self.vectors.as_ref(), modal_stiffness)
    }

    /// Condenses a mass of points and directors about the centre of mass, then shifts the result to the
    /// origin of the frame. The part of the mass that does not turn with the nodes depends on the frame of
    /// the condensation; with the centre of mass the body does not depend on the frame of its description.
    fn of_directors(
        &self,
        model: &FeModel,
        mass: &DirectorMass,
        place: &NodesInFrame,
        condensed: impl FnOnce(&DirectorMass, &RigidMotion<'_>, MatRef<'_, f64>) -> Invariants,
    ) -> Invariants {
        let offset = centre_of_mass(model, &place.frame);
        let frame = Frame { origin: place.frame.origin + place.frame.axes * offset, axes: place.frame.axes };
        let mut fields = mass.extend_rigid(model.rigid_fields(frame.origin.into(), 1.0).as_ref());
        frame.rotate_rigid(&mut fields);
        let motion =
            RigidMotion { fields: fields.as_ref(), displacements: mass.turning_rows(), axes: frame.axes };
        let shapes = mass.extend(self.vectors.as_ref());
        condensed(mass, &motion, shapes.as_ref()).with_w0_of_c1().shifted(-offset)
    }
}

/// Returns displacements and rotations, along the axes of the model, of the points that follow nodes.
fn motion_of_followers(model: &FeModel, vectors: &Mat<f64>) -> [Mat<f64>; 2] {
    let Some(followers) = model.followers() else {
        return [Mat::zeros(0, vectors.ncols()), Mat::zeros(0, vectors.ncols())];
    };
    let rows = 3 * followers.points().len();
    let mut motion = [Mat::zeros(rows, vectors.ncols()), Mat::zeros(rows, vectors.ncols())];
    for j in 0..vectors.ncols() {
        let columns = followers.motion(vectors.col_as_slice(j));
        motion
            .iter_mut()
            .zip(columns)
            .for_each(|(to, column)| to.col_as_slice_mut(j).copy_from_slice(&column));
    }
    motion
}

/// Returns the centre of mass in a frame.
fn centre_of_mass(model: &FeModel, frame: &Frame) -> Vector3<f64> {
    let (mass, first_moment) = rigid_first_moment(rigid_mass(model, frame).as_ref());
    first_moment / mass
}

/// Returns the rows without a position of modes in model rows (`vectors`); `displacements` holds their
/// vectors in body axes.
fn internal(model: &FeModel, vectors: &Mat<f64>, displacements: &Mat<f64>) -> Option<InternalRows> {
    let [moving, massless] = model.rows().without_place();
    let label = |row: usize| {
        let label = model.label(row);
        [label.node, i64::from(label.direction)]
    };
    // Vectors have two rows in a plane model and three in the body, as nodes do.
    let of_vectors = moving.step_by(model.dimension()).flat_map(|row| {
        let [node, _] = label(row);
        (1..=3).map(move |direction| [node, direction])
    });
    let dofs: Vec<[i64; 2]> = of_vectors.chain(massless.clone().map(label)).collect();
    let first = 3 * model.nodes().len();
    let split = displacements.nrows() - first;
    let shape = Mat::from_fn(dofs.len(), vectors.ncols(), |row, j| match row.checked_sub(split) {
        None => displacements[(first + row, j)],
        Some(after) => vectors[(massless.start + after, j)],
    });
    (!dofs.is_empty()).then_some(InternalRows { dofs, shape })
}

/// Returns shapes with three components per node; shapes of a plane model (2n x nf) get zeros along z.
fn in_space(shapes: MatRef<'_, f64>, dimension: usize) -> Mat<f64> {
    if dimension == 3 {
        return copied(shapes);
    }
    Mat::from_fn(shapes.nrows() / 2 * 3, shapes.ncols(), |row, j| match row % 3 {
        2 => 0.0,
        k => shapes[(row / 3 * 2 + k, j)],
    })
}

// Modes of a body whose frame is fixed to an interface.
//
// With R the rigid motions about the reference point (model rows) and t (6 x nf) the motion of the interface in
// the free modes Psi, the shapes
//
// ```text
// Psi' = Psi - R t,    m' = Psi''M Psi' = I + t'(R'M R) t,    Psi''K Psi' = diag(lambda)
// ```
//
// leave the interface at rest. Together with the motion of the frame they have the span of the free modes.
// The constrained modes are Psi' X with X'm'X = I and X'diag(lambda)X = diag(mu): the modes of the body
// held at the interface, within that span.

/// Returns the frame at interface `name` of `model`: its reference point and the axes of the model.
///
/// # Errors
/// [`SceneBody`](Code::SceneBody) if the model has no such interface, [`CarrierImpossible`](Code::CarrierImpossible)
/// if it has no reference point.
pub(super) fn frame_of_interface(model: &FeModel, name: &str) -> Result<Frame> {
    let Some(set) = model.interfaces().iter().find(|set| set.name == name) else {
        let names: Vec<&str> = model.interfaces().iter().map(|set| set.name.as_str()).collect();
        let known = if names.is_empty() { "it has none".to_owned() } else { names.join(", ") };
        let message = format!("the model has no interface `{name}` for the frame: {known}");
        return Err(Diagnostic::new(Code::SceneBody, message).into());
    };
    match set.reference.point() {
        Some(point) if set.coupling != Some(Coupling::Free) => {
            Ok(Frame { origin: Vector3::from(point), axes: Matrix3::identity() })
        }
        _ => Err(impossible(format!("interface `{name}` is free and has no reference point for the frame"))),
    }
}

/// Returns the interfaces of a model in the body frame. For a `coupled` basis, interfaces without a stated
/// coupling get the coupling that the basis used.
pub fn interfaces_in_frame(model: &FeModel, frame: &Frame, coupled: bool) -> Vec<Interface> {
    let index: HashMap<i64, usize> = model.nodes().ids.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    let sets = model.interfaces().iter();
    sets.map(|set| Interface {
        name: set.name.clone(),
        nodes: set.nodes.iter().filter_map(|id| index.get(id)).copied().collect(),
        coupling: if coupled { Some(set.coupling()) } else { set.coupling },
        reference: set.reference.point().map(|x| frame.to_body(&[x])[0]),
    })
    .collect()
}

fn impossible(message: String) -> Error {
    Diagnostic::new(Code::CarrierImpossible, message).into()
}

/// Replaces the free modes of `found` by the modes of the body held at interface `name`; `place` is the
/// frame of [`frame_of_interface`].
///
/// # Errors
/// [`CarrierImpossible`](Code::CarrierImpossible) if the nodes of the interface do not determine its rotation.
pub(super) fn constrain(
    model: &FeModel,
    place: &NodesInFrame,
    name: &str,
    coupled: bool,
    found: &mut ModalBasis,
) -> Result<()> {
    let free = BodyModes::new(model, place, std::mem::replace(&mut found.solution.vectors, Mat::new()));
    let taken = motion_of_interface(model, place, name, coupled, &free)?;

    // Psi' = Psi - R t.
    let mut shapes = free.vectors;
    let rigid = model.rigid_fields(place.frame.origin.into(), 1.0);
    subtract_combination(shapes.as_mut(), rigid.as_ref(), taken.as_ref());

    let unresolved =
        || impossible(format!("the modes of the body held at interface `{name}` were not found"));
    let nf = taken.ncols();
    let added = taken.transpose() * rigid_mass(model, &place.frame) * &taken;
    let mass = symmetric_part(&(added + Mat::<f64>::identity(nf, nf)));
    let (mut eigenvalues, change) = normalised(mass, &found.solution.eigenvalues).ok_or_else(unresolved)?;
    let mut modes = combine(shapes.as_ref(), change.as_ref());
    let pencil = model.pencil();
    // Where rigid motion is most of a mode, its mass is a small part of that of both.
    let mass = gram(modes.as_ref(), pencil.apply_mass(modes.as_ref()).as_ref());
    if largest_entry((&mass - Mat::<f64>::identity(nf, nf)).as_ref()) > MAX_MASS_ROUNDING {
        let (values, change) = normalised(symmetric_part(&mass), &eigenvalues).ok_or_else(unresolved)?;
        (eigenvalues, modes) = (values, combine(modes.as_ref(), change.as_ref()));
    }

    // Residuals refer to the equations of the free body and include the reaction at the interface.
    let (kx, mx) = (pencil.apply_stiffness(modes.as_ref()), pencil.apply_mass(modes.as_ref()));
    let residual = |(j, mu): (usize, &f64)| relative_residual(kx.col(j), mx.col(j), *mu);
    let solution = &mut found.solution;
    solution.residuals = eigenvalues.iter().enumerate().map(residual).collect();
    solution.completeness = not_proved(&solution.completeness, name, nf);
    (solution.eigenvalues, solution.vectors) = (eigenvalues, modes);
    (solution.rounding_floors, solution.bounds, solution.next_eigenvalue) = (Vec::new(), None, None);
    found.provenance = vec![format!("constrained mode: held at {name}"); nf];
    let coordinates = found.coordinates.take().map(|all| all.coordinates);
    found.fixed_interface =
        found.fixed_interface.take().map(|fixed| fixed.with_other_modes(coordinates.as_ref()));
    Ok(())
}

/// Deviation of the modal mass from the unit matrix above which the modes are normalised again. Bodies that deviate by
/// 1e-9 are refused.
const MAX_MASS_ROUNDING: f64 = 1e-11;

/// Returns the eigenvalues, and the modes in terms of the shapes, of shapes with this `mass` and the stiffness
/// diag(lambda): m = L L' and L^-1 diag(lambda)^(1/2) = U diag(mu)^(1/2) V' give X = L^-T U. Returns `None` if the mass is
/// not positive definite.
fn normalised(mass: Mat<f64>, lambda: &[f64]) -> Option<(Vec<f64>, Mat<f64>)> {
    let lower = dense_cholesky(mass)?;
    let root = Mat::from_fn(lambda.len(), lambda.len(), |i, j| if i == j { lambda[i].sqrt() } else { 0.0 });
    let (roots, left) = left_singular_vectors(solve_lower(&lower, &root))?;
    Some((roots.iter().map(|root| root * root).collect(), solve_upper(&lower, &left)))
}

/// Returns translation and rotation (6 x nf, in the plane 3 x nf) of the reference point of interface
/// `name` in the modes.
fn motion_of_interface(
    model: &FeModel,
    place: &NodesInFrame,
    name: &str,
    coupled: bool,
    modes: &BodyModes,
) -> Result<Mat<f64>> {
    let interfaces = interfaces_in_frame(model, &place.frame, coupled);
    let interface = interfaces.iter().find(|interface| interface.name == name);
    let nodes = Nodes { ids: model.nodes().ids.clone(), positions: place.positions.clone() };
    let rows = |interface: &Interface| {
        let rotations = modes.rotations.as_ref().map(Mat::as_ref);
        interface.rows(&nodes, modes.of_nodes(), rotations, model.dimension())
    };
    let Some(motion) = interface.and_then(rows).and_then(|rows| rows.rigid_motion()) else {
        return Err(impossible(format!(
            "the nodes of interface `{name}` lie on one line: its orientation is not known, no frame can stand on it"
        )));
    };
    let axes = rigid_axes(model.dimension());
    Ok(Mat::from_fn(axes.len(), motion.ncols(), |i, j| motion[(axes[i], j)]))
}

/// Returns the completeness of the constrained modes, for which nothing is proved; the proof about the free
/// modes becomes a remark.
fn not_proved(of_free: &Completeness, name: &str, nf: usize) -> Completeness {
    let free = match of_free.proof {
        Proof::InertiaCount => format!("the {nf} free modes are proved complete below the shift"),
        Proof::NotProved if of_free.remark.is_empty() => format!("{nf} free modes"),
        Proof::NotProved => of_free.remark.clone(),
    };
    Completeness {
        proof: Proof::NotProved,
        negative_pivots: None,
        remark: format!("modes of the body held at interface `{name}` in the span of its free modes; {free}"),
        ..of_free.clone()
    }
}
