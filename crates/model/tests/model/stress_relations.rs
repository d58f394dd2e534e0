//! Checks of geometric stiffness by its behaviour under rigid motion: true stress stiffness of solids and
//! beams for every load, and matrices that are no stress stiffness or belong to another load.

use flexbody_base::diagnostic::Code;
use flexbody_linalg::CscMatrix;
use flexbody_model::{FeModel, GeometricStiffness, LoadKind, NodeSet, RawMatrix, RawModel, UnitLoad};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Rotation3, SMatrix, Vector3};
use oracle::beams::chain;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Mesh, entries, grid};
use oracle::plane::rectangle;
use std::path::PathBuf;

const CODES: [Code; 3] =
    [Code::GeometricStiffnessMotion, Code::GeometricStiffnessLoad, Code::GeometricStiffnessRough];

/// A body with dense matrices, free or held at some rows.
struct Body {
    raw: RawModel,
    k: DMatrix<f64>,
    m: DMatrix<f64>,
    rigid: DMatrix<f64>,
    held: Vec<usize>,
}

fn dense(matrix: &CscMatrix) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(matrix.n_rows(), matrix.n_cols());
    entries(matrix).for_each(|(r, c, v)| all[(r as usize, c as usize)] += v);
    all
}

fn sparse(a: &DMatrix<f64>) -> CscMatrix {
    let n = a.nrows();
    let half = 0.5 * (a + a.transpose());
    let all = (0..n * n).map(|e| ((e % n) as u32, (e / n) as u32, half[(e % n, e / n)]));
    CscMatrix::from_triplets(n, n, &all.filter(|e| e.2 != 0.0).collect::<Vec<_>>())
}

impl Body {
    /// Builds the body; `rows` is the number of rows of each node, three displacements and optionally three
    /// rotations.
    fn new(raw: RawModel, rows: usize, held: &[usize]) -> Self {
        let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
        let mut rigid = DMatrix::zeros(k.nrows(), 6);
        for (i, x) in raw.nodes.positions.iter().enumerate() {
            for c in 0..3 {
                let turned = Vector3::ith(c, 1.0).cross(&Vector3::from(*x));
                rigid[(rows * i + c, c)] = 1.0;
                (0..3).for_each(|a| rigid[(rows * i + a, 3 + c)] = turned[a]);
                if rows == 6 {
                    rigid[(rows * i + 3 + c, 3 + c)] = 1.0;
                }
            }
        }
        let held = held.iter().flat_map(|&i| rows * i..rows * (i + 1)).collect();
        Self { raw, k, m, rigid, held }
    }

    /// Returns the displacements under a load: with rows held, or free with balancing inertia forces.
    fn response(&self, load: &DVector<f64>) -> DVector<f64> {
        let n = self.k.nrows();
        if self.held.is_empty() {
            let mass: Matrix6<f64> =
                (self.rigid.transpose() * &self.m * &self.rigid).fixed_view::<6, 6>(0, 0).into();
            let inverse = mass.try_inverse().expect("a mass");
            let balanced = load - &self.m * &self.rigid * inverse * (self.rigid.transpose() * load);
            let stiff = self.k.amax() * &self.rigid * self.rigid.transpose() + &self.k;
            return stiff.lu().solve(&balanced).expect("stiff");
        }
        let free: Vec<usize> = (0..n).filter(|row| !self.held.contains(row)).collect();
        let k = self.k.select_rows(&free).select_columns(&free);
        let u = k.lu().solve(&load.select_rows(&free)).expect("held");
        let mut all = DVector::zeros(n);
        free.iter().zip(u.iter()).for_each(|(&row, &u)| all[row] = u);
        all
    }

    /// Returns the forces -M a of an acceleration field.
    fn inertia(&self, rows: usize, a: impl Fn(Vector3<f64>) -> Vector3<f64>) -> DVector<f64> {
        let mut field = DVector::zeros(self.k.nrows());
        for (i, x) in self.raw.nodes.positions.iter().enumerate() {
            field.fixed_rows_mut::<3>(rows * i).copy_from(&a(Vector3::from(*x)));
        }
        -(&self.m * field)
    }

    fn centre(&self) -> Vector3<f64> {
        let momenta = self.rigid.transpose() * &self.m * &self.rigid;
        Vector3::new(momenta[(1, 5)], momenta[(2, 3)], momenta[(0, 4)]) / momenta[(0, 0)]
    }

    /// Returns the codes on geometric stiffness, and the messages, for the model with one geometric
    /// stiffness.
    fn told(&self, kind: LoadKind, component: usize, matrix: &DMatrix<f64>) -> (Vec<Code>, String) {
        let matrix = RawMatrix { matrix: sparse(matrix), digits: 17, path: PathBuf::from("Kg.mtx") };
        let given = GeometricStiffness { load: UnitLoad { kind, component }, matrix };
        told(self.raw.clone().with(|data| data.geometric_stiffness = vec![given]))
    }
}

fn told(raw: RawModel) -> (Vec<Code>, String) {
    let found = match FeModel::from_raw(raw) {
        Ok(checked) => checked.diagnostics,
        Err(error) => error.diagnostics().to_vec(),
    };
    let found: Vec<_> = found.iter().filter(|diagnostic| CODES.contains(&diagnostic.code())).collect();
    let text = found.iter().map(|one| format!("{one}\n")).collect();
    (found.iter().map(|diagnostic| diagnostic.code()).collect(), text)
}

/// Returns a bent and tapered bar of hexahedra, rotated in space, with its first layer of nodes held or free.
fn solid(is_held: bool) -> (Mesh, Body) {
    let mesh = Mesh::from_cells(ElementKind::Hex8, &grid([6, 2, 2]), |p| {
        [
            0.1 * p[0],
            0.05 * p[1] * (1.0 - 0.06 * p[0]) + 0.004 * p[0] * p[0],
            0.04 * p[2] + 0.003 * p[0] * p[1],
        ]
    });
    let mesh = mesh.moved(Rotation3::from_euler_angles(0.4, -0.7, 1.1).matrix(), [0.3, -0.2, 0.5]);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    let line = |i: usize| Vector3::from(mesh.nodes[i]) - Vector3::from(mesh.nodes[0]);
    let along = (0..mesh.nodes.len()).map(line).max_by(|a, b| a.norm().total_cmp(&b.norm())).expect("nodes");
    let mut order: Vec<usize> = (0..mesh.nodes.len()).collect();
    order.sort_by(|&a, &b| line(a).dot(&along).total_cmp(&line(b).dot(&along)));
    let ids = |nodes: &[usize]| nodes.iter().map(|&i| i as i64 + 1).collect::<Vec<_>>();
    raw.data.interfaces = vec![NodeSet::new("tip", ids(&order[order.len() - 9..]))];
    let body = Body::new(raw, 3, if is_held { &order[..9] } else { &[] });
    (mesh, body)
}

/// Returns every kind of load of a body with three rows per node: kind, component and forces.
fn loads(body: &Body) -> Vec<(LoadKind, usize, DVector<f64>)> {
    let (centre, tip) = (body.centre(), || "tip".to_owned());
    let e = |k: usize| Vector3::ith(k, 1.0);
    let mut all = Vec::new();
    for k in 0..3 {
        all.push((LoadKind::Acceleration, k, body.inertia(3, |_| e(k))));
        all.push((LoadKind::AngularAcceleration, k, body.inertia(3, |x| e(k).cross(&(x - centre)))));
        all.push((LoadKind::Force(tip()), k, at_tip(body, e(k), Vector3::zeros())));
        all.push((LoadKind::Moment(tip()), k, at_tip(body, Vector3::zeros(), e(k))));
    }
    for (component, (k, l)) in LoadKind::SPIN.into_iter().enumerate() {
        let pair = |x: Vector3<f64>| {
            if k == l {
                e(k).cross(&e(k).cross(&x))
            } else {
                e(k).cross(&e(l).cross(&x)) + e(l).cross(&e(k).cross(&x))
            }
        };
        all.push((LoadKind::Spin, component, body.inertia(3, |x| pair(x - centre))));
        // Spin about another point, like with `--frame model`.
        all.push((LoadKind::Spin, component, body.inertia(3, pair)));
    }
    all.push((
        LoadKind::Named("heat".to_owned()),
        0,
        body.inertia(3, |x| Vector3::new(x.y * x.z, x.x.sin(), 0.1)),
    ));
    all
}

/// Returns a force and a moment at the mean of the nodes of the tip, distributed unequally over its nodes.
fn at_tip(body: &Body, force: Vector3<f64>, moment: Vector3<f64>) -> DVector<f64> {
    let nodes: Vec<usize> = body.raw.data.interfaces[0].nodes.iter().map(|&id| id as usize - 1).collect();
    let place = |i: usize| Vector3::from(body.raw.nodes.positions[i]);
    let mean = nodes.iter().map(|&i| place(i)).sum::<Vector3<f64>>() / nodes.len() as f64;
    let mut wrench = SMatrix::<f64, 6, 1>::zeros();
    wrench.fixed_rows_mut::<3>(0).copy_from(&force);
    wrench.fixed_rows_mut::<3>(3).copy_from(&moment);
    // f_i = w_i (a + b x r_i) with the wrench as resultant.
    let columns: Vec<SMatrix<f64, 3, 6>> = nodes
        .iter()
        .map(|&i| {
            let r = place(i) - mean;
            let cross = Matrix3::from_columns(&[0, 1, 2].map(|k| Vector3::ith(k, 1.0).cross(&r)));
            let mut both = SMatrix::<f64, 3, 6>::zeros();
            both.fixed_columns_mut::<3>(0).copy_from(&Matrix3::identity());
            both.fixed_columns_mut::<3>(3).copy_from(&cross);
            both
        })
        .collect();
    let weight = |at: usize| 1.0 + 0.3 * at as f64;
    let mut normal = Matrix6::zeros();
    columns.iter().enumerate().for_each(|(at, c)| normal += c.transpose() * c * weight(at));
    let by = normal.try_inverse().expect("spread nodes") * wrench;
    let mut load = DVector::zeros(body.k.nrows());
    for (at, (&i, c)) in nodes.iter().zip(&columns).enumerate() {
        load.fixed_rows_mut::<3>(3 * i).copy_from(&(c * by * weight(at)));
    }
    load
}

/// Returns K(u) - K(0) of total-Lagrangian hexahedra with St. Venant-Kirchhoff material, per unit of u.
fn difference_of_tangents(mesh: &Mesh, material: &Material, u: &DVector<f64>) -> DMatrix<f64> {
    let small = 1e-7 / u.amax();
    let n = 3 * mesh.nodes.len();
    let [moved, still] = [small, 0.0].map(|s| {
        let mut k = DMatrix::zeros(n, n);
        mesh.elements
            .iter()
            .for_each(|(kind, nodes)| add_tangent(&mut k, mesh, *kind, nodes, material, &(u * s)));
        k
    });
    (moved - still) / small
}

fn add_tangent(
    k: &mut DMatrix<f64>,
    mesh: &Mesh,
    kind: ElementKind,
    nodes: &[usize],
    material: &Material,
    u: &DVector<f64>,
) {
    let (lambda, mu) = material.lame();
    let g = 1.0 / 3f64.sqrt();
    for point in 0..8 {
        let xi = [0, 1, 2].map(|a| if point >> a & 1 == 0 { -g } else { g });
        let (_, reference) = kind.shape(xi);
        let jacobian: Matrix3<f64> = nodes
            .iter()
            .zip(&reference)
            .map(|(&i, s)| Vector3::from(mesh.nodes[i]) * Vector3::from(*s).transpose())
            .sum();
        let inverse = jacobian.try_inverse().expect("an element").transpose();
        let slopes: Vec<Vector3<f64>> = reference.iter().map(|s| inverse * Vector3::from(*s)).collect();
        let gradient: Matrix3<f64> =
            nodes.iter().zip(&slopes).map(|(&i, s)| u.fixed_rows::<3>(3 * i) * s.transpose()).sum();
        let f = Matrix3::identity() + gradient;
        let strain = 0.5 * (gradient + gradient.transpose() + gradient.transpose() * gradient);
        let stress = Matrix3::identity() * (lambda * strain.trace()) + strain * (2.0 * mu);
        let weight = jacobian.determinant();
        for (a, &na) in nodes.iter().enumerate() {
            for (b, &nb) in nodes.iter().enumerate() {
                let (sa, sb) = (slopes[a], slopes[b]);
                // Green's strain under e_i at a: sym(F' e_i sa').
                let b_t_b = f
                    * (lambda * sa * sb.transpose()
                        + mu * sb * sa.transpose()
                        + Matrix3::identity() * (mu * sa.dot(&sb)))
                    * f.transpose();
                let block = (b_t_b + Matrix3::identity() * sa.dot(&(stress * sb))) * weight;
                let mut own = k.fixed_view_mut::<3, 3>(3 * na, 3 * nb);
                own += block;
            }
        }
    }
}

fn stress_stiffness(mesh: &Mesh, u: &DVector<f64>) -> DMatrix<f64> {
    dense(&mesh.geometric_stiffness(&Material::STEEL, u.as_slice()))
}

#[test]
fn the_stress_stiffness_of_a_solid_is_taken_for_every_load_held_and_free() {
    for is_held in [false, true] {
        let (mesh, body) = solid(is_held);
        for (kind, component, load) in loads(&body) {
            let matrix = stress_stiffness(&mesh, &body.response(&load));
            let (codes, text) = body.told(kind.clone(), component, &matrix);
            assert!(codes.is_empty(), "held {is_held}, {kind:?} {component}: {text}");
        }
    }
}

#[test]
fn the_difference_of_tangents_is_refused_for_every_load() {
    for is_held in [false, true] {
        let (mesh, body) = solid(is_held);
        for (kind, component, load) in loads(&body) {
            // The acceleration of its origin does not stress a free body.
            if !is_held && matches!(kind, LoadKind::Acceleration | LoadKind::AngularAcceleration) {
                continue;
            }
            let matrix = difference_of_tangents(&mesh, &Material::STEEL, &body.response(&load));
            let (codes, text) = body.told(kind.clone(), component, &matrix);
            assert_eq!(
                codes,
                [Code::GeometricStiffnessMotion],
                "held {is_held}, {kind:?} {component}: {text}"
            );
            assert!(text.contains("Kg.mtx"), "{text}");
        }
    }
}

/// A centrifugal load that is active when the tangent is assembled adds minus its change with displacement.
#[test]
fn the_softening_of_a_centrifugal_load_is_refused_by_its_name() {
    for is_held in [false, true] {
        let (mesh, body) = solid(is_held);
        let all = loads(&body);
        let spins = all.iter().filter(|pair| pair.0 == LoadKind::Spin);
        for (kind, component, load) in spins {
            let (k, l) = LoadKind::SPIN[*component];
            let skew = |k: usize| Vector3::ith(k, 1.0).cross_matrix();
            let twice: Matrix3<f64> =
                if k == l { skew(k) * skew(k) } else { skew(k) * skew(l) + skew(l) * skew(k) };
            let softening = &body.m
                * DMatrix::from_fn(body.m.nrows(), body.m.nrows(), |i, j| {
                    if i / 3 == j / 3 { twice[(i % 3, j % 3)] } else { 0.0 }
                });
            let matrix = stress_stiffness(&mesh, &body.response(load)) + softening;
            let (codes, text) = body.told(kind.clone(), *component, &matrix);
            assert_eq!(codes, [Code::GeometricStiffnessMotion], "held {is_held}, {component}: {text}");
            assert!(text.contains("softening of a centrifugal load"), "held {is_held}, {component}: {text}");
        }
    }
}

#[test]
fn free_expansion_has_no_stress_and_only_the_blocks_tell() {
    let (mesh, body) = solid(false);
    let u = DVector::from_vec(mesh.nodes.iter().flatten().map(|x| 1e-3 * x).collect());
    let matrix = difference_of_tangents(&mesh, &Material::STEEL, &u) - stress_stiffness(&mesh, &u);
    let (codes, text) = body.told(LoadKind::Named("heat".to_owned()), 0, &matrix);
    assert_eq!(codes, [Code::GeometricStiffnessMotion], "{text}");
    assert!(text.contains("depends on directions"), "{text}");
}

#[test]
fn the_stiffness_of_another_load_is_refused() {
    for is_held in [false, true] {
        let (mesh, body) = solid(is_held);
        let all = loads(&body);
        for (i, (kind, component, load)) in all.iter().enumerate() {
            if matches!(kind, LoadKind::Named(_)) {
                continue;
            }
            let own = stress_stiffness(&mesh, &body.response(load));
            // Inertia relief applies to all of these loads.
            if !is_held && matches!(kind, LoadKind::Acceleration | LoadKind::AngularAcceleration) {
                let (_, _, other) = &all[(i + 2) % 12];
                let matrix = stress_stiffness(&mesh, &body.response(other));
                let (codes, text) = body.told(kind.clone(), *component, &matrix);
                assert_eq!(codes, [Code::GeometricStiffnessLoad], "{kind:?} {component}: {text}");
                continue;
            }
            for (factor, expected) in [
                (1.0 + 1e-8, None),
                (1.005, Some(Code::GeometricStiffnessRough)),
                (1.02, Some(Code::GeometricStiffnessLoad)),
                (-1.0, Some(Code::GeometricStiffnessLoad)),
                (1e4, Some(Code::GeometricStiffnessLoad)),
                (0.01, Some(Code::GeometricStiffnessLoad)),
            ] {
                let (codes, text) = body.told(kind.clone(), *component, &(&own * factor));
                let expected: Vec<Code> = expected.into_iter().collect();
                assert_eq!(codes, expected, "held {is_held}, {kind:?} {component} x {factor}: {text}");
            }
        }
        let spin = |component: usize| {
            &all.iter().filter(|pair| pair.0 == LoadKind::Spin).nth(2 * component).expect("spins").2
        };
        for (given, own) in [(0, 1), (1, 2), (3, 4), (5, 0)] {
            let matrix = stress_stiffness(&mesh, &body.response(spin(own)));
            let (codes, text) = body.told(LoadKind::Spin, given, &matrix);
            assert_eq!(codes, [Code::GeometricStiffnessLoad], "held {is_held}, {given} is {own}: {text}");
            assert!(text.contains("belongs to another load"), "{text}");
        }
    }
}

#[test]
fn rows_that_supports_took_away_are_told() {
    let (mesh, body) = solid(true);
    let (kind, component, load) = loads(&body).swap_remove(2);
    let mut matrix = stress_stiffness(&mesh, &body.response(&load));
    for &row in &body.held {
        matrix.row_mut(row).fill(0.0);
        matrix.column_mut(row).fill(0.0);
    }
    let (codes, text) = body.told(kind, component, &matrix);
    assert_eq!(codes, [Code::GeometricStiffnessMotion], "{text}");
    assert!(text.contains("resists translation") && text.contains("supported nodes"), "{text}");
}

#[test]
fn a_stress_with_small_errors_is_taken_with_a_warning() {
    let (mesh, body) = solid(false);
    let (kind, component, load) =
        loads(&body).into_iter().find(|load| load.0 == LoadKind::Spin).expect("spin");
    let u = body.response(&load);
    let own = stress_stiffness(&mesh, &u);
    let other = difference_of_tangents(&mesh, &Material::STEEL, &u) - &own;
    // The part of initial displacements that is small compared with the stress stiffness.
    let part = own.amax() / other.amax();
    let (codes, text) = body.told(kind.clone(), component, &(&own + &other * (2e-3 * part)));
    assert_eq!(codes, [Code::GeometricStiffnessRough], "{text}");
    let (codes, text) = body.told(kind, component, &(&own + &other * (0.5 * part)));
    assert_eq!(codes, [Code::GeometricStiffnessMotion], "{text}");
}

/// Returns a chain of beams with six rows per node, held at its first node or free.
fn beams(places: &[[f64; 3]], is_held: bool) -> Body {
    let mut raw = chain("beams", places);
    raw.data.interfaces = vec![NodeSet::new("tip", vec![places.len() as i64])];
    Body::new(raw, 6, if is_held { &[0] } else { &[] })
}

/// Returns K_geo of a straight chain under normal forces (Przemieniecki): 6/5, l/10, 2 l^2/15, -l^2/30.
fn normal_force_stiffness(body: &Body, u: &DVector<f64>) -> DMatrix<f64> {
    let places = &body.raw.nodes.positions;
    let mut all = DMatrix::zeros(6 * places.len(), 6 * places.len());
    for i in 1..places.len() {
        let [a, b] = [i - 1, i].map(|i| Vector3::from(places[i]));
        let (l, x) = ((b - a).norm(), (b - a).normalize());
        let force =
            4.0 * 0.05 * 0.05 / l * (u.fixed_rows::<3>(6 * i) - u.fixed_rows::<3>(6 * (i - 1))).dot(&x);
        let across = Matrix3::identity() - x * x.transpose();
        let turn = x.cross_matrix();
        // v = across u; the slope of v is theta x x.
        let slope = [(0, -1.0), (1, 1.0)];
        for (p, sp) in slope {
            for (q, sq) in slope {
                let (rp, rq) = (6 * (i - 1 + p), 6 * (i - 1 + q));
                let mut part = |r: usize, c: usize, block: Matrix3<f64>| {
                    let mut own = all.fixed_view_mut::<3, 3>(r, c);
                    own += block;
                };
                part(rp, rq, across * (1.2 * force / l * sp * sq));
                let slopes = -turn; // theta x x = -(x x theta)
                part(rp, rq + 3, slopes * (-0.1 * force * sp));
                part(rp + 3, rq, slopes.transpose() * (-0.1 * force * sq));
                let both = if p == q { 2.0 / 15.0 } else { -1.0 / 30.0 };
                part(rp + 3, rq + 3, slopes.transpose() * slopes * (both * force * l));
            }
        }
    }
    all
}

#[test]
fn beams_are_held_to_the_relations_of_their_points() {
    let line = Vector3::new(0.6, -0.5, 0.4).normalize();
    let places: Vec<[f64; 3]> =
        (0..9).map(|i| (line * (0.15 * i as f64) + Vector3::new(1.0, 2.0, 0.5)).into()).collect();
    for is_held in [false, true] {
        let body = beams(&places, is_held);
        let centre = body.centre();
        // Loads that pull along the line: the trace of the spin, and a force at the tip.
        let along = body.inertia(6, |x| -(x - centre));
        let own = normal_force_stiffness(&body, &body.response(&along));
        let named = || LoadKind::Named("pulled".to_owned());
        let (codes, text) = body.told(named(), 0, &own);
        assert!(codes.is_empty(), "held {is_held}: {text}");
        let straight: Vec<[f64; 3]> = (0..9).map(|i| [0.15 * i as f64, 0.0, 0.0]).collect();
        let body = beams(&straight, is_held);
        let centre = body.centre();
        for (component, held_axes) in [(1, [-1.0, 0.0, -1.0]), (2, [-1.0, -1.0, 0.0])] {
            let load = body.inertia(6, |x| (x - centre).component_mul(&Vector3::from(held_axes)));
            let own = normal_force_stiffness(&body, &body.response(&load));
            let (codes, text) = body.told(LoadKind::Spin, component, &own);
            assert!(!codes.contains(&Code::GeometricStiffnessMotion), "held {is_held}: {text}");
            assert!(!codes.contains(&Code::GeometricStiffnessLoad), "held {is_held}: {text}");
            let (codes, text) = body.told(LoadKind::Spin, component, &(&own * 39.478));
            assert_eq!(codes, [Code::GeometricStiffnessLoad], "held {is_held}: {text}");
        }
        let mut load = DVector::zeros(body.k.nrows());
        load[6 * 8] = 1.0;
        let own = normal_force_stiffness(&body, &body.response(&load));
        let (codes, text) = body.told(LoadKind::Force("tip".to_owned()), 0, &own);
        assert!(codes.is_empty(), "held {is_held}: {text}");
        let (codes, text) = body.told(LoadKind::Force("tip".to_owned()), 1, &own);
        assert_eq!(codes, [Code::GeometricStiffnessLoad], "held {is_held}: {text}");
    }
}

#[test]
fn beams_that_were_displaced_hold_more_than_their_stress() {
    let places: Vec<[f64; 3]> = (0..9)
        .map(|i| {
            let s = 0.15 * i as f64;
            [s, 0.3 * s * s, 0.2 * s * s * s]
        })
        .collect();
    let body = beams(&places, true);
    let mut load = DVector::zeros(body.k.nrows());
    load[6 * 8] = 1.0;
    let u = body.response(&load);
    let small = 1e-7 / u.amax();
    let moved: Vec<[f64; 3]> =
        places.iter().enumerate().map(|(i, x)| [0, 1, 2].map(|k| x[k] + small * u[6 * i + k])).collect();
    let difference = (dense(&chain("beams", &moved).stiffness.matrix) - &body.k) / small;
    for kind in [LoadKind::Force("tip".to_owned()), LoadKind::Named("pulled".to_owned())] {
        let (codes, text) = body.told(kind, 0, &difference);
        assert_eq!(codes, [Code::GeometricStiffnessMotion], "{text}");
    }
}

#[test]
fn plane_bodies_are_held_to_the_relations_of_the_plane() {
    let raw = rectangle(4, 2, 0.7, [1.0, 2.0]);
    let n = raw.nodes.len();
    let [a, b] = [0, n - 1].map(|i| Vector3::from(raw.nodes.positions[i]));
    let string = |tension: f64, across: bool| {
        let line = (b - a).normalize();
        let mut all = DMatrix::zeros(2 * n, 2 * n);
        for (r, s) in [(0, 1.0), (1, -1.0)] {
            for (c, t) in [(0, 1.0), (1, -1.0)] {
                for k in 0..2 {
                    for l in 0..2 {
                        let block = f64::from(k == l) - if across { line[k] * line[l] } else { 0.0 };
                        all[(2 * r * (n - 1) + k, 2 * c * (n - 1) + l)] +=
                            s * t * block * tension / (b - a).norm();
                    }
                }
            }
        }
        all
    };
    let raw = raw.with(|data| data.interfaces = vec![NodeSet::new("end", vec![n as i64])]);
    let told_of = |kind: LoadKind, component: usize, matrix: &DMatrix<f64>| {
        let matrix = RawMatrix { matrix: sparse(matrix), ..raw.stiffness.clone() };
        let given = GeometricStiffness { load: UnitLoad { kind, component }, matrix };
        told(raw.clone().with(|data| data.geometric_stiffness = vec![given]))
    };
    let named = || LoadKind::Named("string".to_owned());
    for across in [false, true] {
        let (codes, text) = told_of(named(), 0, &string(1.0, across));
        assert!(codes.is_empty(), "{text}");
    }
    let (codes, text) = told_of(named(), 0, &(dense(&raw.stiffness.matrix) * 1e-6));
    assert_eq!(codes, [Code::GeometricStiffnessMotion], "{text}");
    // The string pulls along a line between both axes.
    let (codes, text) = told_of(LoadKind::Force("end".to_owned()), 0, &string(1.0, false));
    assert_eq!(codes, [Code::GeometricStiffnessLoad], "{text}");
    let (codes, text) = told_of(LoadKind::Spin, 2, &string(1.0, false));
    assert_eq!(codes, [Code::GeometricStiffnessLoad], "{text}");
}
