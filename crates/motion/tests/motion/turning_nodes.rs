//! Rotating nodes that carry mass: rigid regions, offset masses, discs. The oracles do not use directors: all
//! nodes of a rigid region with the mass of the solid and finite rotations of the region, masses as points on
//! rigid arms, closed forms of the rotor.

use faer::Mat;
use flexbody_body::basis::{BasisChoice, CraigBampton, ModeSettings};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::{Carrier, FlexBody, LoadKind, UnitLoad};
use flexbody_body::invariants::BodyFrame;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, DofLabel, FeModel, NodeSet, RawModel, Reference};
use flexbody_motion::dynamics::{EquationsOfMotion, Evaluation, Terms};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use oracle::beams::elbow;
use oracle::elements::ElementKind;
use oracle::general::raw_fixture;
use oracle::turning::{Block, block, dense, disc_on_shaft, hang, sparse};

/// Step of the modal coordinates for differences, relative to one radian of the region.
const STEP: f64 = 1e-4;

fn converted(raw: RawModel, modes: usize, frame: BodyFrame) -> (FeModel, FlexBody) {
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(modes), ..ModeSettings::default() };
    let settings = ConvertSettings { modes, frame: frame.into(), ..ConvertSettings::default() };
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    (model, body)
}

/// All nodes of a block in the body frame at modal coordinates q, with the rigid region rotated by a finite
/// rotation.
struct AllNodes<'b> {
    block: &'b Block,
    body: &'b FlexBody,
}

impl AllNodes<'_> {
    fn start(&self, i: usize) -> Vector3<f64> {
        Vector3::from(self.body.frame().to_body(&[self.block.positions[i]])[0])
    }

    fn of_reference(&self, q: &DVector<f64>) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
        let node = self.body.n_nodes() - 1;
        let modes = self.body.modes();
        let rotation = modes.rotation.as_ref().expect("rotations");
        let sum = |shape: &Mat<f64>| {
            Vector3::from_fn(|k, _| (0..q.len()).map(|j| shape[(3 * node + k, j)] * q[j]).sum())
        };
        let place = Vector3::from(self.body.frame().to_body(&[self.block.reference])[0]);
        (place, sum(&modes.shape), sum(rotation))
    }

    /// Returns the positions (n x 3).
    fn places(&self, q: &DVector<f64>) -> DMatrix<f64> {
        let (at, moved, turned) = self.of_reference(q);
        let shape = &self.body.modes().shape;
        let n = self.block.positions.len();
        let mut places = DMatrix::zeros(n, 3);
        for i in 0..n {
            let start = self.start(i);
            let place = if self.block.rigid.contains(&i) {
                at + moved + Rotation3::new(turned) * (start - at)
            } else {
                start + Vector3::from_fn(|k, _| (0..q.len()).map(|j| shape[(3 * i + k, j)] * q[j]).sum())
            };
            places.set_row(i, &place.transpose());
        }
        places
    }

    /// Returns mode j of all nodes (n x 3), with the region rotated to first order.
    fn mode(&self, j: usize) -> DMatrix<f64> {
        let mut unit = DVector::zeros(self.body.n_modes());
        unit[j] = 1.0;
        let (at, moved, turned) = self.of_reference(&unit);
        let shape = &self.body.modes().shape;
        let n = self.block.positions.len();
        let mut mode = DMatrix::zeros(n, 3);
        for i in 0..n {
            let own = if self.block.rigid.contains(&i) {
                moved + turned.cross(&(self.start(i) - at))
            } else {
                Vector3::from_fn(|k, _| shape[(3 * i + k, j)])
            };
            mode.set_row(i, &own.transpose());
        }
        mode
    }

    /// Returns the second moments x_k' Ms y_l (3 x 3).
    fn moments(&self, x: &DMatrix<f64>, y: &DMatrix<f64>) -> Matrix3<f64> {
        let product = x.transpose() * (&self.block.mass * y);
        Matrix3::from_fn(|k, l| product[(k, l)])
    }

    /// Returns the first moment of the deformed body.
    fn first_moment(&self, q: &DVector<f64>) -> Vector3<f64> {
        let sums = &self.block.mass * self.places(q);
        Vector3::from_fn(|k, _| sums.column(k).sum())
    }

    /// Returns the inertia of the deformed body about the origin of the frame.
    fn inertia(&self, q: &DVector<f64>) -> Matrix3<f64> {
        let x = self.places(q);
        let j = self.moments(&x, &x);
        Matrix3::identity() * j.trace() - j
    }

    /// Returns C(q)_kj, the angular momentum about axis k of a unit rate of mode j, by central differences.
    fn coupling(&self, q: &DVector<f64>, step: f64) -> DMatrix<f64> {
        let x = self.places(q);
        let mut coupling = DMatrix::zeros(3, q.len());
        for j in 0..q.len() {
            let mut unit = DVector::zeros(q.len());
            unit[j] = step;
            let rate = (self.places(&(q + &unit)) - self.places(&(q - &unit))) / (2.0 * step);
            let s = self.moments(&x, &rate);
            coupling.set_column(
                j,
                &Vector3::new(s[(1, 2)] - s[(2, 1)], s[(2, 0)] - s[(0, 2)], s[(0, 1)] - s[(1, 0)]),
            );
        }
        coupling
    }
}

fn stiffness(body: &FlexBody, kind: LoadKind, component: usize) -> DMatrix<f64> {
    let own = body.inertia_stiffness().expect("nodes that turn");
    let wanted = UnitLoad { kind, component };
    let found = own.stiffness.iter().find(|one| one.load == wanted).expect("all twelve");
    DMatrix::from_fn(body.n_modes(), body.n_modes(), |i, j| found.matrix[(i, j)])
}

fn largest(a: impl IntoIterator<Item = f64>) -> f64 {
    a.into_iter().map(f64::abs).fold(0.0, f64::max)
}

#[test]
fn a_rigid_region_has_the_invariants_of_all_its_nodes() {
    for (kind, frame) in [
        (ElementKind::Hex8, BodyFrame::Principal),
        (ElementKind::Tet10, BodyFrame::Model),
        (ElementKind::Hex8, BodyFrame::Model),
    ] {
        let block = block(kind);
        let (_, body) = converted(block.raw.clone(), 6, frame);
        let nodes = AllNodes { block: &block, body: &body };
        let nf = body.n_modes();
        let x = nodes.places(&DVector::zeros(nf));
        let modes: Vec<_> = (0..nf).map(|j| nodes.mode(j)).collect();
        let own = body.invariants();
        let size = own.mass() * largest(x.iter().copied());
        let mut errors = [0.0f64; 3];
        for j in 0..nf {
            let ibar = nodes.moments(&x, &modes[j]);
            for (k, l) in (0..3).flat_map(|k| (0..3).map(move |l| (k, l))) {
                errors[0] = errors[0].max((own.ibar().expect("held")[k][l][j] - ibar[(k, l)]).abs() / size);
                for i in 0..nf {
                    let s = nodes.moments(&modes[i], &modes[j]);
                    errors[1] = errors[1].max((own.s().expect("held")[k][l][(i, j)] - s[(k, l)]).abs());
                    if l == 0 {
                        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                        let w3 = own.w3().expect("held")[(k * nf + i, j)];
                        errors[2] = errors[2].max((w3 - (s[(a, b)] - s[(b, a)])).abs());
                    }
                }
            }
        }
        assert!(errors.iter().all(|error| *error < 1e-10), "{kind:?}, {frame:?}: {errors:?}");
        let flight = own.as_solid().w0() - own.w0();
        assert!(flight.norm_max() < 1e-14 * own.w0().norm_max().max(1e-3), "W0 = -C1~");
    }
}

#[test]
fn the_stiffness_of_inertia_is_what_a_finite_rotation_of_the_region_does() {
    for frame in [BodyFrame::Principal, BodyFrame::Model] {
        let block = block(ElementKind::Hex8);
        let (_, body) = converted(block.raw.clone(), 6, frame);
        let nodes = AllNodes { block: &block, body: &body };
        let nf = body.n_modes();
        let zero = DVector::zeros(nf);
        for trial in 0..3 {
            let direction = DVector::from_fn(nf, |j, _| (1.3 * (j + 7 * trial) as f64).sin());
            let (_, _, turned) = nodes.of_reference(&direction);
            let step = STEP / turned.norm();
            let q = &direction * step;
            let quadratic = |k: &DMatrix<f64>| direction.dot(&(k * &direction));

            let second = (nodes.first_moment(&q) + nodes.first_moment(&-&q)
                - nodes.first_moment(&zero) * 2.0)
                / step.powi(2);
            let found = Vector3::from_fn(|k, _| quadratic(&stiffness(&body, LoadKind::Acceleration, k)));
            assert!((second - found).norm() < 1e-6 * found.norm(), "K^a: {second} {found}");

            let second =
                (nodes.inertia(&q) + nodes.inertia(&-&q) - nodes.inertia(&zero) * 2.0) / (2.0 * step.powi(2));
            let w2 = body.invariants().w2().expect("held");
            let mut found = Matrix3::from_fn(|k, l| {
                (0..nf * nf)
                    .map(|at| {
                        direction[at / nf] * w2[(k * nf + at / nf, l * nf + at % nf)] * direction[at % nf]
                    })
                    .sum()
            });
            for (component, (k, l)) in LoadKind::SPIN.into_iter().enumerate() {
                let taken = quadratic(&stiffness(&body, LoadKind::Spin, component));
                if k == l {
                    found[(k, k)] -= taken
                } else {
                    found[(k, l)] -= 0.5 * taken;
                    found[(l, k)] -= 0.5 * taken;
                }
            }
            found = (found + found.transpose()) * 0.5;
            assert!((second - found).norm() < 1e-6 * found.norm(), "I(q): {second} {found}");

            let rate = (nodes.coupling(&q, step) - nodes.coupling(&-&q, step)) / (2.0 * step);
            let w3 = body.invariants().w3().expect("held");
            let found = DMatrix::from_fn(3, nf, |k, j| {
                let turning = stiffness(&body, LoadKind::AngularAcceleration, k);
                (0..nf).map(|i| direction[i] * (w3[(k * nf + i, j)] + turning[(i, j)])).sum()
            });
            assert!((&rate - &found).norm() < 1e-6 * found.norm(), "C(q): {rate} {found}");
        }
    }
}

/// A body described about two origins and along different axes has the same forces.
#[test]
fn two_frames_describe_one_body() {
    for raw in [
        block(ElementKind::Hex8).raw,
        raw_fixture("shell_folded"),
        raw_fixture("frame_beams"),
        raw_fixture("plane_frame"),
    ] {
        let name = raw.data.description.name.clone();
        let (_, a) = converted(raw.clone(), 6, BodyFrame::Com);
        let (_, b) = converted(raw, 6, BodyFrame::Model);
        let moved = a
            .in_model_axes(a.frame().axes.transpose() * (b.frame().origin - a.frame().origin))
            .expect("a body");
        let (own, other) = (moved.inertia_stiffness().expect("turns"), b.inertia_stiffness().expect("turns"));
        // The modes are equal including signs, which the frame does not change here.
        let difference = other.largest_difference(own);
        assert!(difference < 1e-12, "{name}: {difference:e}");
        let w1 = |body: &FlexBody| body.invariants().w1().expect("held");
        let size = w1(&b).norm_max().max(1e-3 * b.invariants().inertia().norm().sqrt());
        assert!((w1(&moved) - w1(&b)).norm_max() < 1e-11 * size, "{name}: W1");
    }
}

/// Returns the accelerations of the modes and of the frame, along its axes, of a freely moving body.
fn free_accelerations(
    body: &FlexBody,
    velocity: Vector3<f64>,
    omega: Vector3<f64>,
    q: &[f64],
    qd: &[f64],
) -> Vec<f64> {
    let equations = EquationsOfMotion::new(body, Terms::ALL);
    let mut evaluation = Evaluation::new(&equations);
    let rigid: Vec<f64> = match equations.n_rigid() {
        3 => vec![velocity.x, velocity.y, omega.z],
        _ => velocity.iter().chain(&omega).copied().collect(),
    };
    let nu: Vec<f64> = rigid.iter().chain(qd).copied().collect();
    evaluation.set(q, &nu);
    let (free, mut found) = (vec![0.0; nu.len()], vec![0.0; nu.len()]);
    evaluation.accelerations(&free, &mut found).expect("a body with mass");
    // V' + omega x V is the acceleration of the origin in space.
    let turned = omega.cross(&velocity);
    let kept = if equations.n_rigid() == 3 { 2 } else { 3 };
    (0..kept).for_each(|k| found[k] += turned[k]);
    found
}

#[test]
fn a_constant_velocity_changes_nothing() {
    let names = ["frame_beams", "frame_lumped", "shell_folded", "plane_frame", "spring_ends"];
    let raws =
        names.iter().map(|name| raw_fixture(name)).chain([block(ElementKind::Hex8).raw, disc_on_shaft(2.0)]);
    for raw in raws {
        let name = raw.data.description.name.clone();
        let (model, body) = converted(raw, 6, BodyFrame::Principal);
        if model.director_mass().is_none() {
            continue;
        }
        let nf = body.n_modes();
        let rate = body.modes().eigenvalue[0].sqrt();
        let extent = body.extent();
        let plane = body.dimension() == 2;
        let omega = if plane { Vector3::z() } else { Vector3::new(0.4, -0.7, 0.6) } * (0.3 * rate);
        let flight = if plane { Vector3::new(0.6, -0.8, 0.0) } else { Vector3::new(0.5, -0.6, 0.62) }
            * (10.0 * rate * extent);
        let rotation = body.modes().rotation.as_ref().expect("rotations");
        let turned = |j: usize| largest((0..rotation.nrows()).map(|row| rotation[(row, j)]));
        let amplitude = |j: usize| 0.05 * extent / body.largest_displacement(j).max(extent * turned(j));
        let q: Vec<f64> = (0..nf).map(|j| amplitude(j) * (1.0 + j as f64).sin()).collect();
        let qd: Vec<f64> = (0..nf).map(|j| amplitude(j) * rate * (2.0 + j as f64).cos()).collect();
        let at_rest = free_accelerations(&body, Vector3::zeros(), omega, &q, &qd);
        let flying = free_accelerations(&body, flight, omega, &q, &qd);
        let size = largest(at_rest.iter().copied());
        for (at, (a, b)) in at_rest.iter().zip(&flying).enumerate() {
            assert!((a - b).abs() < 1e-10 * size, "{name}, {at}: {a:e} {b:e}");
        }
    }
}

/// Returns the natural frequencies of the rotor spinning with `spin` about its shaft, in the rotating frame,
/// from the classical equations in space: M x'' + Omega G x' + K x = 0 for the deflections and inclinations
/// of all discs, whose frequencies are shifted by the spin. The rigid motions of the shaft across its axis
/// are held, like for a body with prescribed motion of its frame.
fn classical_whirl(raw: &RawModel, spin: f64) -> Vec<f64> {
    let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
    // Rows uy, uz, ry, rz of every node.
    let lateral: Vec<usize> = (0..k.nrows()).filter(|row| [1, 2, 4, 5].contains(&(row % 6))).collect();
    let part =
        |a: &DMatrix<f64>| DMatrix::from_fn(lateral.len(), lateral.len(), |i, j| a[(lateral[i], lateral[j])]);
    let (k, own) = (part(&k), part(&m));
    let n = lateral.len();
    // The angular momentum Ip Omega along the shaft axis e_x rotates with it: moments Ip Omega (-rz', ry')
    // about y and z.
    let mut g = DMatrix::zeros(n, n);
    for node in 0..n / 4 {
        let polar = m[(6 * node + 3, 6 * node + 3)];
        g[(4 * node + 2, 4 * node + 3)] = polar;
        g[(4 * node + 3, 4 * node + 2)] = -polar;
    }
    // Transforms to the modes of the shaft at rest, without its four rigid ones.
    let lower = own.cholesky().expect("mass").l();
    let inverse = lower.try_inverse().expect("regular");
    let modes = (&inverse * k * inverse.transpose()).symmetric_eigen();
    let stiffest = modes.eigenvalues.max();
    let elastic: Vec<usize> = (0..n).filter(|&j| modes.eigenvalues[j] > 1e-9 * stiffest).collect();
    let shapes = inverse.transpose() * modes.eigenvectors.select_columns(&elastic);
    let (lateral, n) = (n, elastic.len());
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    a.view_mut((0, n), (n, n)).copy_from(&DMatrix::identity(n, n));
    (0..n).for_each(|j| a[(n + j, j)] = -modes.eigenvalues[elastic[j]]);
    a.view_mut((n, n), (n, n)).copy_from(&(-shapes.transpose() * g * &shapes * spin));
    // e^{i w t} in space is e^{i (w -+ Omega) t} in the rotating frame; forward whirl has w > 0 with the
    // spin. The sign comes from the eigenvector: uz = -i uy for a circle from y to z.
    let eigenvalues = a.complex_eigenvalues();
    let complex = a.map(|value| nalgebra::Complex::new(value, 0.0));
    let mut seen = Vec::new();
    for value in eigenvalues.iter().filter(|value| value.im > 1.0) {
        // Inverse iteration for the eigenvector.
        let shifted = &complex
            - DMatrix::identity(2 * n, 2 * n) * (value + nalgebra::Complex::new(1e-7, 1e-7) * value.im);
        let lu = shifted.lu();
        let mut x = DVector::from_fn(2 * n, |i, _| {
            nalgebra::Complex::new((1.0 + i as f64).sin(), (2.0 + i as f64).cos())
        });
        for _ in 0..4 {
            x = lu.solve(&x).expect("regular");
            x /= nalgebra::Complex::new(x.norm(), 0.0);
        }
        let moved = shapes.map(|value| nalgebra::Complex::new(value, 0.0)) * x.rows(0, n);
        let forwards: f64 =
            (0..lateral / 4).map(|node| (moved[4 * node].conj() * moved[4 * node + 1]).im).sum();
        let shift = if forwards < 0.0 { -spin } else { spin };
        seen.push((value.im + shift).abs());
    }
    seen.sort_by(f64::total_cmp);
    seen
}

#[test]
fn discs_whirl_as_classical_rotors_do() {
    for ratio in [0.5, 1.0, 2.0] {
        let raw = disc_on_shaft(ratio);
        let (_, body) = converted(raw.clone(), 24, BodyFrame::Com);
        let nf = body.n_modes();
        let spin = 0.4 * body.modes().eigenvalue[0].sqrt();
        let own = body.invariants();
        let (w2, w3) = (own.w2().expect("held"), own.w3().expect("held"));
        // q'' + 2 w G q' + (Lambda - w^2 (W2_xx - K_xx)) q = 0 with G = W3_x'.
        let of_inertia = stiffness(&body, LoadKind::Spin, 0);
        let k = DMatrix::from_fn(nf, nf, |i, j| {
            own.modal_stiffness()[(i, j)] - spin * spin * (w2[(i, j)] - of_inertia[(i, j)])
        });
        let g = DMatrix::from_fn(nf, nf, |i, j| 2.0 * spin * w3[(j, i)]);
        let mut a = DMatrix::zeros(2 * nf, 2 * nf);
        a.view_mut((0, nf), (nf, nf)).copy_from(&DMatrix::identity(nf, nf));
        a.view_mut((nf, 0), (nf, nf)).copy_from(&-k);
        a.view_mut((nf, nf), (nf, nf)).copy_from(&-g);
        let mut found: Vec<f64> =
            a.complex_eigenvalues().iter().map(|value| value.im).filter(|w| *w > 0.0).collect();
        found.sort_by(f64::total_cmp);
        let expected = classical_whirl(&raw, spin);
        let near = |w: f64| found.iter().map(|own| (own - w).abs()).fold(f64::INFINITY, f64::min);
        let missing: Vec<f64> = expected.iter().copied().filter(|w| near(*w) > 1e-7 * w.max(spin)).collect();
        assert!(missing.is_empty(), "ratio {ratio}: {missing:?} of {expected:?}, found {found:?}");
        assert_eq!(expected.len(), 16, "modes of the shaft across its axis");
    }
}

/// A mass on a rigid arm as inertia of the node that carries it is equivalent to a point on a stiff massless
/// arm.
#[test]
fn an_offset_mass_is_a_point_on_a_stiff_arm() {
    let offset = Vector3::new(0.05, 0.3, -0.2);
    let mass = 3.0;
    let mut hung = disc_on_shaft(2.0);
    let (k, mut m) = (dense(&hung.stiffness.matrix), dense(&hung.mass.matrix));
    let (last, first) = (4, 24);
    hang(&mut m, last, mass, &offset);
    hung.mass.matrix = sparse(&m);
    let (_, eliminated) = converted(hung.clone(), 8, BodyFrame::Com);

    let plain = disc_on_shaft(2.0);
    let mut m = dense(&plain.mass.matrix).resize(33, 33, 0.0);
    (30..33).for_each(|row| m[(row, row)] = mass);
    let mut arm = k.resize(33, 33, 0.0);
    // Springs of 1e12 along every axis between the point and the end of the rigid arm: u - t - theta x r.
    for c in 0..3 {
        let mut tie = DVector::zeros(33);
        tie[30 + c] = 1.0;
        tie[first + c] = -1.0;
        (0..3).for_each(|a| tie[first + 3 + a] -= Vector3::ith(a, 1.0).cross(&offset)[c]);
        arm += &tie * tie.transpose() * 1e12;
    }
    let mut nodes = plain.nodes.clone();
    nodes.ids.push(6);
    nodes.positions.push((Vector3::from(nodes.positions[4]) + offset).into());
    let mut dofs = plain.dofs.clone().expect("labels");
    dofs.extend((1..=3).map(|direction| DofLabel { node: 6, direction }));
    let as_node = RawModel {
        dofs: Some(dofs),
        ..RawModel::in_memory("mass on an arm", sparse(&arm), sparse(&m), nodes)
    };
    let (_, point) = converted(as_node, 8, BodyFrame::Com);

    // The static load f(w) on the modes has the energy f' K^-1 f / 2, which does not depend on the signs of
    // modes.
    for axis in [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.3, -0.8, 0.5), Vector3::new(0.0, 0.6, 0.8)] {
        let energy = |body: &FlexBody| {
            let (w1, nf) = (body.invariants().w1().expect("held"), body.n_modes());
            let lambda = &body.modes().eigenvalue;
            let load = |j: usize| -> f64 {
                (0..9).map(|at| axis[at / 3] * w1[(at / 3, (at % 3) * nf + j)] * axis[at % 3]).sum::<f64>()
                    * 0.5
            };
            (0..nf).map(|j| load(j).powi(2) / lambda[j]).sum::<f64>()
        };
        let (a, b) = (energy(&eliminated), energy(&point));
        assert!((a - b).abs() < 1e-5 * b, "{axis}: {a} {b}");
    }
    let frequencies = |body: &FlexBody| body.modes().eigenvalue.clone();
    for (a, b) in frequencies(&eliminated).iter().zip(frequencies(&point)) {
        assert!((a - b).abs() < 1e-5 * b, "{a} {b}");
    }
}

/// Gravity is equivalent to an acceleration of the frame: the motion is that without gravity, in a falling
/// frame.
#[test]
fn gravity_is_an_acceleration_of_the_frame() {
    for raw in [raw_fixture("shell_folded"), block(ElementKind::Hex8).raw, disc_on_shaft(2.0)] {
        let name = raw.data.description.name.clone();
        let (_, body) = converted(raw, 6, BodyFrame::Model);
        let equations = EquationsOfMotion::new(&body, Terms::ALL);
        let mut evaluation = Evaluation::new(&equations);
        let (nf, rate, extent) = (body.n_modes(), body.modes().eigenvalue[0].sqrt(), body.extent());
        let rotation = body.modes().rotation.as_ref().expect("rotations");
        let turned = |j: usize| largest((0..rotation.nrows()).map(|row| rotation[(row, j)]));
        let q: Vec<f64> = (0..nf).map(|j| 0.03 * (1.0 + j as f64).sin() / turned(j)).collect();
        let nu: Vec<f64> = (0..6 + nf)
            .map(|k| {
                if k < 3 {
                    rate * extent
                } else if k < 6 {
                    0.2 * rate
                } else {
                    0.0
                }
            })
            .collect();
        evaluation.set(&q, &nu);
        let gravity = Vector3::new(0.3, -0.8, 0.5) * (0.2 * rate * rate * extent);
        let accelerations = |evaluation: &mut Evaluation<'_>, gravity: Vector3<f64>| {
            let mut forces = vec![0.0; nu.len()];
            evaluation.add_gravity(&gravity, &mut forces);
            let mut found = vec![0.0; nu.len()];
            evaluation.accelerations(&forces, &mut found).expect("a body with mass");
            found
        };
        let falling = accelerations(&mut evaluation, gravity);
        let floating = accelerations(&mut evaluation, Vector3::zeros());
        let size = largest(falling.iter().copied());
        for (at, (a, b)) in falling.iter().zip(&floating).enumerate() {
            let expected = if at < 3 { b + gravity[at] } else { *b };
            assert!((a - expected).abs() < 1e-12 * size, "{name}, {at}: {a:e} {expected:e}");
        }
    }
}

/// A cantilever of small point masses with a mass on a rigid arm at its tip, spinning about axes through its
/// root. The deflection of the tip is F L^3 / 3 E I + M L^2 / 2 E I for the centrifugal force F at the mass
/// and its moment M about the tip, plus F a^2 (3 L - a) / 6 E I for the forces of the points at a.
#[test]
fn a_cantilever_with_an_offset_mass_has_the_closed_form() {
    let plain = disc_on_shaft(1.0);
    let n = 30;
    let small = 1e-2;
    let mut m = DMatrix::identity(n, n) * small;
    let (mass, arm) = (2.0, Vector3::new(0.1, 0.25, -0.15));
    hang(&mut m, 4, mass, &arm);
    let mut raw = plain;
    raw.mass.matrix = sparse(&m);
    let set = |name: &str, node: i64| NodeSet {
        name: name.to_owned(),
        nodes: vec![node],
        coupling: Some(Coupling::Rigid),
        reference: Reference::Centre,
        outline: Vec::new(),
    };
    raw.data.interfaces = vec![set("root", 1), set("tip", 5)];
    let model = FeModel::from_raw(raw).expect("a body").model;
    let modes = ModeSettings { wanted: Wanted::Lowest(2), ..ModeSettings::default() };
    let basis = BasisChoice::CraigBampton(CraigBampton);
    let settings =
        ConvertSettings { modes, basis, frame: BodyFrame::Model.into(), ..ConvertSettings::default() };
    let body = convert(&model, &settings, &Context::QUIET).expect("converts").body;
    let carried = body.carried(&Carrier::Interface("root".to_owned())).expect("carried");

    let (length, extension, bending) = (1.0, 1e6, 2e3);
    for spin in [Vector3::z(), Vector3::y(), Vector3::new(0.2, 0.5, -0.8)] {
        let nf = carried.n_modes();
        let w1 = carried.invariants().w1().expect("held");
        let load = DVector::from_fn(nf, |j, _| {
            (0..9).map(|at| spin[at / 3] * w1[(at / 3, (at % 3) * nf + j)] * spin[at % 3]).sum::<f64>() * 0.5
        });
        let k = DMatrix::from_fn(nf, nf, |i, j| carried.invariants().modal_stiffness()[(i, j)]);
        let q = k.cholesky().expect("held").solve(&load);
        let shape = &carried.modes().shape;
        let found = Vector3::from_fn(|c, _| (0..nf).map(|j| shape[(12 + c, j)] * q[j]).sum());

        let place = Vector3::new(length, 0.0, 0.0) + arm;
        let force = (place * spin.norm_squared() - spin * spin.dot(&place)) * mass;
        let moment = arm.cross(&force);
        let [cubic, square] = [length.powi(3) / (3.0 * bending), length.powi(2) / (2.0 * bending)];
        let mut expected = Vector3::new(
            force.x * length / extension,
            force.y * cubic + moment.z * square,
            force.z * cubic - moment.y * square,
        );
        for a in [0.25, 0.5, 0.75, 1.0] {
            let at = Vector3::new(a, 0.0, 0.0);
            let force = (at * spin.norm_squared() - spin * spin.dot(&at)) * small;
            let bent = a * a * (3.0 * length - a) / (6.0 * bending);
            expected += Vector3::new(force.x * a / extension, force.y * bent, force.z * bent);
        }
        assert!((found - expected).norm() < 1e-9 * expected.norm(), "{spin}: {found} {expected}");
    }
}

/// An inclined elbow of consistent beams: the mass that does not rotate with the nodes changes the response
/// to spin by an amount that falls with the square of the element size.
#[test]
fn refinement_takes_what_does_not_turn_away() {
    let response = |parts: usize| {
        let (model, body) = converted(elbow(parts), 10, BodyFrame::Com);
        assert!(model.fixed_mass_share() > 0.01, "consistent beams differ by direction");
        let (w2, nf) = (body.invariants().w2().expect("held"), body.n_modes());
        let spin = Vector3::new(0.3, -0.9, 0.4);
        let lambda = &body.modes().eigenvalue;
        // Softening of the first mode by spin, and the response to its load.
        let softening: f64 =
            (0..9).map(|at| spin[at / 3] * w2[((at / 3) * nf, (at % 3) * nf)] * spin[at % 3]).sum();
        let stiffening: f64 = LoadKind::SPIN
            .iter()
            .enumerate()
            .map(|(component, (k, l))| {
                spin[*k] * spin[*l] * stiffness(&body, LoadKind::Spin, component)[(0, 0)]
            })
            .sum();
        (softening - stiffening) / lambda[0]
    };
    let found: Vec<f64> = [2, 4, 8, 16].map(response).to_vec();
    let changes: Vec<f64> = found.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    assert!(changes[0] > 3.5 * changes[1] && changes[1] > 3.5 * changes[2], "{found:?}: {changes:?}");
}
