//! Format `openradioss`: the data file of /FXBODY, read like `hm_read_fxb.F`, with energies and forces
//! assembled like in the engine.

use super::readers::Deck;
use flexbody_base::diagnostic::Code;
use flexbody_body::flex_body::FlexBody;
use flexbody_formats::export::{ExportOptions, Points, frames};
use flexbody_formats::{export, find_format};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};
use oracle::exported::{bodies, exported, file};
use oracle::file_bodies::wild_body;
use oracle::general::raw_fixture;
use oracle::mesh::entries;
use oracle::random::Random;

/// Relative rounding of eleven digits, the least of all numbers: negative ones with two-digit exponents.
const DIGITS: f64 = 1e-10;

struct Fxb {
    nodes: Vec<i64>,
    irot: i64,
    rotation: Matrix3<f64>,
    highest: f64,
    damping: Option<[f64; 2]>,
    /// Rigid modes, node by node.
    rigid: Vec<Vec<Vector6<f64>>>,
    local: Vec<Vec<Vector6<f64>>>,
    mass: Vec<f64>,
    stiffness: Vec<f64>,
    rigid_mass: DMatrix<f64>,
    /// Nine blocks of rigid by local modes, E11, E12, ...
    coupled_mass: Vec<DMatrix<f64>>,
    coupled_stiffness: Vec<DMatrix<f64>>,
}

fn read(bytes: &[u8]) -> Fxb {
    let mut deck = Deck::new(std::str::from_utf8(bytes).expect("ASCII"));
    let [nmod, nmst, nbno, irot, idamp, iblo, ifile] = deck.integers(7, 7)[..] else { panic!() };
    assert_eq!((nmst, iblo, ifile), (0, 0, 0));
    let (nmod, nbno) = (nmod as usize, nbno as usize);
    let nodes = deck.integers(nbno, 10);
    let head = deck.numbers(10);
    let damping = (idamp == 1).then(|| deck.numbers(2).try_into().expect("two"));
    let nme = if irot == 1 { 15 } else { 12 };
    let mut modes = |count: usize| -> Vec<Vec<Vector6<f64>>> {
        (0..count).map(|_| (0..nbno).map(|_| Vector6::from_vec(deck.numbers(6))).collect()).collect()
    };
    let (rigid, local) = (modes(nme), modes(nmod));
    let (mass, stiffness) = (deck.numbers(nmod), deck.numbers(nmod));
    let triangle = deck.numbers(nme * (nme + 1) / 2);
    let at = |l: usize, r: usize| {
        let (l, r) = (l.min(r), l.max(r));
        triangle[l * (2 * nme - l + 1) / 2 + r - l]
    };
    let rigid_mass = DMatrix::from_fn(nme, nme, at);
    let mut blocks = || -> Vec<DMatrix<f64>> {
        (0..9).map(|_| DMatrix::from_row_slice(nme, nmod, &deck.numbers(nme * nmod))).collect()
    };
    let (coupled_mass, coupled_stiffness) = (blocks(), blocks());
    deck.end();
    Fxb {
        nodes,
        irot,
        rotation: Matrix3::from_row_slice(&head[..9]),
        highest: head[9],
        damping,
        rigid,
        local,
        mass,
        stiffness,
        rigid_mass,
        coupled_mass,
        coupled_stiffness,
    }
}

impl Fxb {
    /// Returns MC of `FXBMAJP2`: the rotation matrix row by row times the blocks.
    fn mass_at(&self, rotation: &Matrix3<f64>) -> DMatrix<f64> {
        (0..9).map(|i| &self.coupled_mass[i] * rotation[(i / 3, i % 3)]).sum()
    }

    /// Returns RC of `FXBMAJP2`: the transposed rotation matrix times the blocks.
    fn stiffness_at(&self, rotation: &Matrix3<f64>) -> DMatrix<f64> {
        (0..9).map(|i| &self.coupled_stiffness[i] * rotation[(i % 3, i / 3)]).sum()
    }

    /// Returns the rates of the rigid modes for the velocity of the origin and a spin, both in space:
    /// velocities of the ends of the axes and of their origin, and the spin if there are modes for it.
    fn rates(&self, rotation: &Matrix3<f64>, velocity: &Vector3<f64>, spin: &Vector3<f64>) -> DVector<f64> {
        let ends = (0..3).map(|axis| velocity + spin.cross(&rotation.column(axis)));
        let sets: Vec<Vector3<f64>> = ends.chain([*velocity, *spin]).collect();
        DVector::from_fn(self.rigid.len(), |l, _| sets[l / 3][l % 3])
    }

    /// Returns `ECIN` of `FXBODVP1`.
    fn kinetic_energy(&self, rotation: &Matrix3<f64>, rates: &DVector<f64>, qd: &DVector<f64>) -> f64 {
        let local: f64 = self.mass.iter().zip(qd).map(|(m, v)| m * v * v).sum();
        0.5 * rates.dot(&(&self.rigid_mass * rates)) + rates.dot(&(self.mass_at(rotation) * qd)) + 0.5 * local
    }

    /// Returns the velocities of a node as in `FXBODVP2`.
    fn velocity(
        &self,
        node: usize,
        rotation: &Matrix3<f64>,
        rates: &DVector<f64>,
        qd: &DVector<f64>,
    ) -> Vector6<f64> {
        let rigid: Vector6<f64> = self.rigid.iter().zip(rates).map(|(mode, v)| mode[node] * *v).sum();
        let local: Vector6<f64> = self.local.iter().zip(qd).map(|(mode, v)| mode[node] * *v).sum();
        let turned = |part: usize| rotation * local.fixed_rows::<3>(3 * part);
        rigid + Vector6::from_iterator(turned(0).iter().chain(turned(1).iter()).copied())
    }
}

fn matrix(a: &faer::Mat<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

/// Rotation, velocities and modal rates: arbitrary in space, in its plane for a plane body.
struct Motion {
    rotation: Matrix3<f64>,
    velocity: Vector3<f64>,
    omega: Vector3<f64>,
    qd: DVector<f64>,
}

/// Returns a motion in which every part of the energy has the same size.
fn motion(random: &mut Random, body: &FlexBody) -> Motion {
    let (invariants, nf) = (body.invariants(), body.n_modes());
    let size = invariants.inertia().norm().sqrt();
    let (mut velocity, mut omega) =
        (Vector3::from(random.vector::<3>()), Vector3::from(random.vector::<3>()));
    let mut rotation = random.rotation();
    if body.dimension() == 2 {
        rotation =
            nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 3.0 * random.signed()).into_inner();
        velocity.z = 0.0;
        (omega.x, omega.y) = (0.0, 0.0);
    }
    Motion {
        rotation,
        velocity: velocity / invariants.mass().sqrt(),
        omega: omega / size,
        qd: DVector::from_fn(nf, |_, _| random.signed()),
    }
}

#[test]
fn the_kinetic_energy_of_any_motion_of_the_undeformed_body_is_that_of_the_body() {
    let mut random = Random(1);
    for (name, body) in bodies() {
        let fxb = read(&file(body, "openradioss", None));
        let invariants = body.invariants();
        let (c1, c2, m_ff) =
            (matrix(invariants.c1()), matrix(&invariants.c2()), matrix(&invariants.modal_mass()));
        for _ in 0..5 {
            let Motion { rotation, velocity, omega, qd } = motion(&mut random, body);
            let rates = fxb.rates(&rotation, &(rotation * velocity), &(rotation * omega));
            let coupling = velocity.dot(&omega.cross(&invariants.first_moment()));
            // Mass-normalised: entries off the diagonal are the rounding of the body.
            assert!(
                (&m_ff - DMatrix::identity(qd.len(), qd.len())).amax() <= body.storage().rounding().max(1e-9)
            );
            let normal: f64 = (0..qd.len()).map(|j| m_ff[(j, j)] * qd[j] * qd[j]).sum();
            let modes = velocity.dot(&(&c1 * &qd)) + omega.dot(&(&c2 * &qd)) + 0.5 * normal;
            let own = 0.5 * invariants.mass() * velocity.norm_squared()
                + coupling
                + 0.5 * omega.dot(&(invariants.inertia() * omega))
                + modes;
            // The four points are as far from the body as its axes are long, so that the terms of the sum
            // exceed the energy.
            let (rates_size, qd_size) = (rates.abs(), qd.abs());
            let parts = rates_size.dot(&(fxb.rigid_mass.abs() * &rates_size))
                + rates_size.dot(&(fxb.mass_at(&rotation).abs() * &qd_size))
                + own;
            let found = fxb.kinetic_energy(&rotation, &rates, &qd);
            assert!((found - own).abs() <= DIGITS * parts, "{name}: {found} for {own}, parts {parts}");
        }
    }
}

#[test]
fn nodes_move_with_the_body_and_its_modes() {
    let mut random = Random(2);
    for (name, body) in bodies() {
        let fxb = read(&file(body, "openradioss", None));
        let places = frames(body, &Points::Usual);
        assert_eq!(fxb.nodes, places.iter().map(|place| place.id).collect::<Vec<i64>>(), "{name}");
        assert_eq!(fxb.irot == 1, places.iter().any(|place| place.rotation.is_some()), "{name}");
        assert!((fxb.rotation - body.frame().axes).amax() <= DIGITS, "{name}");
        let Motion { rotation, velocity, omega, qd } = motion(&mut random, body);
        let rates = fxb.rates(&rotation, &(rotation * velocity), &(rotation * omega));
        for (node, place) in places.iter().enumerate() {
            let deformed = matrix(&place.translation) * &qd;
            let own = rotation * (velocity + omega.cross(&Vector3::from(place.position)) + &deformed);
            let found = fxb.velocity(node, &rotation, &rates, &qd);
            let parts = rates.amax() * (1.0 + 6.0 * Vector3::from(place.position).amax()) + deformed.amax();
            assert!((found.fixed_rows::<3>(0) - own).amax() <= DIGITS * parts, "{name}, node {node}");
            if fxb.irot == 1 {
                let turned = place.rotation.as_ref().map_or_else(Vector3::zeros, |rows| {
                    Vector3::from_column_slice((matrix(rows) * &qd).as_slice())
                });
                let own = rotation * (omega + turned);
                assert!(
                    (found.fixed_rows::<3>(3) - own).amax() <= DIGITS * 3.0 * own.amax().max(turned.amax()),
                    "{name}, node {node}"
                );
            }
        }
    }
}

/// Each number is rounded by itself: half a unit of the eleventh digit, or of the tenth for three-digit
/// exponents.
#[test]
fn every_number_is_rounded_to_its_own_digits() {
    let wild = (0..30).map(|seed| {
        let mut parts = wild_body(seed, 3, 4, 0, 0).into_parts();
        parts.nodes.ids = vec![1, 99_999_999, 7];
        (format!("seed {seed}"), FlexBody::new(parts).expect("a body"), 5e-10)
    });
    let mut refused = 0;
    for (name, body, rounding) in bodies().iter().cloned().map(|(name, body)| (name, body, 5e-11)).chain(wild)
    {
        let done = match exported(&body, "openradioss", None) {
            Ok(done) => done,
            Err(error) => {
                // Products of huge numbers in random bodies overflow.
                assert!(error.diagnostics()[0].message().contains("overflow double precision"), "{error}");
                refused += 1;
                continue;
            }
        };
        let fxb = read(&done.file);
        for (node, place) in frames(&body, &Points::Usual).iter().enumerate() {
            for (j, k) in (0..body.n_modes()).flat_map(|j| [0, 1, 2].map(|k| (j, k))) {
                let (found, own) = (fxb.local[j][node][k], place.translation[(k, j)]);
                assert!(
                    (found - own).abs() <= rounding * own.abs() + f64::MIN_POSITIVE * f64::EPSILON,
                    "{name}: {found:e} for {own:e}"
                );
            }
        }
    }
    assert!((1..20).contains(&refused), "{refused} of 30");
}

/// A spinning body loads its modes with -[w1 I, w2 I, w3 I] W1'/2 w; in the file the accelerations of the
/// ends of the axes give this load.
#[test]
fn the_centrifugal_load_of_the_modes_is_that_of_w1() {
    let mut random = Random(3);
    for (name, body) in bodies() {
        let (fxb, nf) = (read(&file(body, "openradioss", None)), body.n_modes());
        let Motion { rotation, omega, .. } = motion(&mut random, body);
        let spin = rotation * omega;
        let ends = [0, 1, 2].map(|axis| spin.cross(&spin.cross(&rotation.column(axis))));
        let accelerations =
            DVector::from_fn(fxb.rigid.len(), |l, _| ends.get(l / 3).map_or(0.0, |end| end[l % 3]));
        let found = fxb.mass_at(&rotation).tr_mul(&accelerations);
        let w1 = body.invariants().w1();
        for j in 0..nf {
            let entry = |k: usize, b: usize| w1.as_ref().map_or(0.0, |w1| w1[(k, b * nf + j)]);
            let own: f64 =
                -(0..9).map(|i| 0.5 * omega[i / 3] * entry(i % 3, i / 3) * omega[i % 3]).sum::<f64>();
            let parts = 9.0 * omega.norm_squared() * body.invariants().second_moment().trace().sqrt();
            assert!((found[j] - own).abs() <= DIGITS * parts, "{name}, mode {j}: {} for {own}", found[j]);
        }
    }
}

#[test]
fn stiffness_damping_and_frequency_are_those_of_the_body_and_rigid_motion_strains_nothing() {
    let mut random = Random(4);
    let mut damped = 0;
    for (name, body) in bodies() {
        let fxb = read(&file(body, "openradioss", None));
        let (lambda, invariants) = (&body.modes().eigenvalue, body.invariants());
        let near = |found: f64, own: f64| (found - own).abs() <= DIGITS * own.abs();
        for j in 0..body.n_modes() {
            assert!(near(fxb.stiffness[j], invariants.modal_stiffness()[(j, j)]), "{name}");
            assert!(near(fxb.mass[j], invariants.modal_mass()[(j, j)]), "{name}");
        }
        let highest = lambda[lambda.len() - 1].sqrt() / std::f64::consts::TAU;
        assert!(near(fxb.highest, highest), "{name}");
        if let Some([alpha, beta]) = fxb.damping {
            damped += 1;
            for (lambda, ratio) in lambda.iter().zip(&body.modes().damping_ratio) {
                let own = 2.0 * ratio * lambda.sqrt();
                assert!((alpha + beta * lambda - own).abs() <= 1e-9 * own, "{name}");
            }
        }
        let Motion { rotation, velocity, omega, .. } = motion(&mut random, body);
        let rates = fxb.rates(&rotation, &(rotation * velocity), &(rotation * omega));
        let coupled = fxb.stiffness_at(&rotation);
        let force = coupled.tr_mul(&rates);
        let parts = coupled.abs().tr_mul(&rates.abs());
        assert!(
            force.iter().zip(&parts).all(|(force, parts)| force.abs() <= DIGITS * parts),
            "{name}: {force}"
        );
    }
    assert_eq!(damped, 6, "the bodies with Rayleigh damping");
}

/// Oracle without invariants: products of nodal fields with M and K of the model, in model axes at rest.
#[test]
fn products_are_those_of_the_finite_element_matrices() {
    for name in ["cube_hex8", "connecting_rod", "satellite"] {
        let (_, body) = bodies().iter().find(|(own, _)| own == name).expect("a fixture");
        let options = ExportOptions { points: Points::Nodes, ..ExportOptions::default() };
        let (done, _) =
            export(body, find_format("openradioss").expect("a format"), &options, true).expect("writes");
        let (fxb, raw) = (read(&done.file), raw_fixture(name));
        let index = |id: i64| fxb.nodes.iter().position(|node| *node == id).expect("every node");
        let labels = raw.dofs.as_ref().expect("labels");
        let rows: Vec<(usize, usize)> =
            labels.iter().map(|label| (index(label.node), usize::from(label.direction) - 1)).collect();
        let field = |modes: &[Vec<Vector6<f64>>], turn: &Matrix3<f64>| {
            DMatrix::from_fn(rows.len(), modes.len(), |row, mode| {
                let (node, axis) = rows[row];
                (turn * modes[mode][node].fixed_rows::<3>(0))[axis]
            })
        };
        let rotation = fxb.rotation;
        let (rigid, local) = (field(&fxb.rigid, &Matrix3::identity()), field(&fxb.local, &rotation));
        let times = |matrix: &flexbody_linalg::CscMatrix, fields: &DMatrix<f64>| {
            let mut product = DMatrix::zeros(fields.nrows(), fields.ncols());
            for (r, c, v) in entries(matrix) {
                (0..fields.ncols()).for_each(|j| product[(r as usize, j)] += v * fields[(c as usize, j)]);
            }
            product
        };
        let norms = |fields: &DMatrix<f64>, products: &DMatrix<f64>| -> Vec<f64> {
            fields.column_iter().zip(products.column_iter()).map(|(f, p)| f.dot(&p).abs().sqrt()).collect()
        };
        let (m_rigid, m_local) = (times(&raw.mass.matrix, &rigid), times(&raw.mass.matrix, &local));
        let (of_rigid, of_local) = (norms(&rigid, &m_rigid), norms(&local, &m_local));
        let close =
            |found: &DMatrix<f64>, own: &DMatrix<f64>, bound: &dyn Fn(usize, usize) -> f64, what: &str| {
                for i in 0..own.nrows() {
                    for j in 0..own.ncols() {
                        let error = (found[(i, j)] - own[(i, j)]).abs();
                        assert!(
                            error <= bound(i, j),
                            "{name}, {what} {i} {j}: {error:e}, bound {:e}",
                            bound(i, j)
                        );
                    }
                }
            };
        // Sums over all nodes have more rounding than a single number.
        close(
            &fxb.rigid_mass,
            &rigid.tr_mul(&m_rigid),
            &|i, j| 1e-9 * of_rigid[i] * of_rigid[j],
            "rigid mass",
        );
        let coupled = |i: usize, j: usize| 1e-9 * of_rigid[i] * of_local[j];
        close(&fxb.mass_at(&rotation), &rigid.tr_mul(&m_local), &coupled, "coupled mass");
        let k_local = times(&raw.stiffness.matrix, &local);
        // |psi' (K phi - lambda M phi)| <= |psi| |residual| for vectors.
        let residual: Vec<f64> = (0..local.ncols())
            .map(|j| (k_local.column(j) - m_local.column(j) * body.modes().eigenvalue[j]).norm())
            .collect();
        let strained = |i: usize, j: usize| {
            rigid.column(i).norm() * residual[j]
                + 1e-9 * body.modes().eigenvalue[j] * of_rigid[i] * of_local[j]
        };
        close(&fxb.stiffness_at(&rotation), &rigid.tr_mul(&k_local), &strained, "coupled stiffness");
    }
}

#[test]
fn node_numbers_that_eight_columns_cannot_hold_are_refused() {
    for id in [0, -5, 100_000_000] {
        let (_, body) = &bodies()[0];
        let mut parts = body.clone().into_parts();
        parts.nodes.ids[3] = id;
        let body = FlexBody::new(parts).expect("a body");
        let format = find_format("openradioss").expect("a format");
        let error = export(&body, format, &ExportOptions::default(), true).expect_err("no place");
        let [diagnostic] = error.diagnostics() else { panic!("{error}") };
        assert_eq!(diagnostic.code(), Code::ExportLoses);
        assert!(diagnostic.message().contains(&format!("node number {id}:")), "{}", diagnostic.message());
    }
}
