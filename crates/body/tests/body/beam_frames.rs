//! Frames of beams in space and in the plane, with lumped and consistent masses, interfaces of every kind, every basis and
//! every frame: each of them is a body.

use faer::Mat;
use flexbody_base::error::Result;
use flexbody_body::basis::{BasisChoice, CraigBampton, CraigChang};
use flexbody_body::convert::{ConvertSettings, convert};
use flexbody_body::flex_body::FlexBody;
use flexbody_body::invariants::{BodyFrame, FrameChoice};
use flexbody_body::verification::body_identities;
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{Coupling, FeModel, LoadKind, NodeSet, RawModel, Reference, UnitLoad};
use nalgebra::{DMatrix, DVector, Vector3};
use oracle::beams::{BeamMass, shaft, tree};
use oracle::random::Random;
use oracle::turning::dense;

const MASSES: [BeamMass; 4] =
    [BeamMass::Consistent, BeamMass::Rotary, BeamMass::Lumped, BeamMass::LumpedRotary];

fn choose<T: Clone>(random: &mut Random, all: &[T]) -> T {
    all[(random.next_u64() % all.len() as u64) as usize].clone()
}

fn body_of(raw: RawModel, basis: BasisChoice, frame: FrameChoice, modes: usize) -> FlexBody {
    made_of(raw, basis, frame, modes).expect("converts")
}

fn made_of(raw: RawModel, basis: BasisChoice, frame: FrameChoice, modes: usize) -> Result<FlexBody> {
    let model = FeModel::from_raw(raw)?.model;
    let mut settings = ConvertSettings { basis, frame, lumped: Vec::new(), ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(modes);
    Ok(convert(&model, &settings, &Context::QUIET)?.body)
}

fn failed(body: &FlexBody) -> Vec<String> {
    let broken = body_identities(body).into_iter().filter(|check| !check.passed);
    broken.map(|check| format!("{} {:e} > {:e}", check.name, check.value, check.limit)).collect()
}

/// Returns interfaces of one to three nodes, half of them with a reference point beside the nodes. Some nodes belong to
/// none.
fn interfaces(raw: &RawModel, count: usize, random: &mut Random) -> Vec<NodeSet> {
    let ids = &raw.nodes.ids;
    let mut free = random.permutation(ids.len());
    free.truncate(ids.len() - 1);
    let mut sets = Vec::new();
    while sets.len() < count && !free.is_empty() {
        let taken = (1 + (random.next_u64() % 6) as usize / 4).min(free.len());
        let nodes: Vec<usize> = free.split_off(free.len() - taken);
        let [x, y, z] = random.vector::<3>();
        let middle = raw.nodes.positions[nodes[0]];
        let beside = [middle[0] + x, middle[1] + y, if raw.dimension == 2 { 0.0 } else { middle[2] + z }];
        sets.push(NodeSet {
            coupling: Some(choose(random, &[Coupling::Rigid, Coupling::Averaging])),
            reference: choose(random, &[Reference::Point(beside), Reference::Centre]),
            ..NodeSet::new(format!("i{}", sets.len()), nodes.iter().map(|&i| ids[i]).collect())
        });
    }
    sets
}

/// Converts a random frame of beams. Returns what the body is, and the identities that fail.
///
/// # Errors
/// The errors of the conversion.
fn random_frame(seed: u64) -> Result<(String, Vec<String>)> {
    let random = &mut Random(seed);
    let (is_plane, mass) = (choose(random, &[false, true]), choose(random, &MASSES));
    let count = choose(random, &[4, 7, 12, 25]);
    let raw = tree(random, count, is_plane, mass);
    let sets = interfaces(&raw, choose(random, &[2, 3, count / 2, count]), random);
    let basis = match random.next_u64() % 4 {
        0 => BasisChoice::default(),
        1 => BasisChoice::CraigChang(CraigChang::default()),
        _ => BasisChoice::CraigBampton(CraigBampton),
    };
    let on = FrameChoice::Interface(sets[sets.len() - 1].name.clone());
    let frame = choose(random, &[BodyFrame::Com.into(), BodyFrame::Principal.into(), on.clone(), on]);
    let modes = 1 + (random.next_u64() % (2 * count as u64)) as usize;
    let about = format!(
        "seed {seed}: plane {is_plane}, {mass:?}, {count} nodes, {} interfaces, {basis:?}, {frame:?}, {modes} modes",
        sets.len()
    );
    let body = made_of(raw.with(|data| data.interfaces = sets), basis, frame, modes)?;
    Ok((about, failed(&body)))
}

#[test]
fn random_frames_of_beams_are_bodies() {
    for seed in 0..40 {
        let (about, failed) = random_frame(seed).expect("converts");
        assert_eq!(failed, [""; 0], "{about}");
    }
}

/// Of frames whose nodes have next to no rotary inertia beside their mass some are at the limit of rounding: two in a hundred
/// may fail an identity or have no factor. That of the plain test is none.
#[test]
#[ignore = "slow: hundreds of conversions"]
fn hundreds_of_random_frames_of_beams_are_bodies() {
    const COUNT: u64 = 600;
    let fails = |seed: &u64| match random_frame(*seed) {
        Ok((about, failed)) => {
            failed.iter().for_each(|check| println!("{about}: {check}"));
            !failed.is_empty()
        }
        Err(error) => {
            println!("seed {seed}: {error}");
            true
        }
    };
    let failures = (0..COUNT).filter(fails).count() as u64;
    assert!(50 * failures <= COUNT, "{failures} of {COUNT}");
}

/// Node of a plane frame with lumped mass in the frame of its body.
struct Lump {
    mass: f64,
    turning: f64,
    place: Vector3<f64>,
    row: usize,
}

/// Momentum of a plane body and its parts, from the masses of its nodes alone: the sums over nodes that move by
/// V + w x (x + u) + du/dt and turn by w + dtheta/dt.
#[test]
fn plane_frames_with_lumped_masses_have_the_inertia_of_their_nodes() {
    let random = &mut Random(3);
    let raw = tree(random, 6, true, BeamMass::LumpedRotary);
    let m = dense(&raw.mass.matrix);
    let end = NodeSet { reference: Reference::Point([0.3, -0.8, 0.0]), ..NodeSet::new("end", vec![6]) };
    let raw = raw.with(|data| data.interfaces = vec![end]);
    for frame in
        [BodyFrame::Com.into(), BodyFrame::Principal.into(), FrameChoice::Interface("end".to_owned())]
    {
        let body = body_of(raw.clone(), BasisChoice::default(), frame.clone(), 12);
        let nf = body.n_modes();
        let nodes: Vec<Lump> = (0..6)
            .map(|i| Lump {
                mass: m[(3 * i, 3 * i)],
                turning: m[(3 * i + 2, 3 * i + 2)],
                place: body.nodes().positions[i].into(),
                row: 3 * i,
            })
            .collect();
        let (shape, rotation) = (&body.modes().shape, body.modes().rotation.as_ref().expect("rotations"));
        let q = DVector::from_fn(nf, |_, _| 0.3 * random.signed());
        let moved = |node: &Lump| {
            let u = |k: usize| (0..nf).map(|j| shape[(node.row + k, j)] * q[j]).sum::<f64>();
            node.place + Vector3::new(u(0), u(1), 0.0)
        };
        let inertia: f64 =
            nodes.iter().map(|node| node.mass * moved(node).norm_squared() + node.turning).sum();
        let coupling = |j: usize| {
            let of_node = |node: &Lump| {
                let (x, psi) = (moved(node), [shape[(node.row, j)], shape[(node.row + 1, j)]]);
                node.mass * (x.x * psi[1] - x.y * psi[0]) + node.turning * rotation[(node.row + 2, j)]
            };
            nodes.iter().map(of_node).sum::<f64>()
        };
        // I(q) = I0 + W1 q + q'W2 q - q'K q and C(q) = C2 + q'W3 + q'K about z.
        let invariants = body.invariants();
        let (w1, w2, w3) = (invariants.w1(), invariants.w2(), invariants.w3());
        let (w1, w2, w3) = (w1.expect("all"), w2.expect("all"), w3.expect("all"));
        let of_inertia = |kind: LoadKind, component: usize| {
            let load = UnitLoad { kind, component };
            let all = &body.inertia_stiffness().expect("turning nodes").stiffness;
            all.iter().find(|own| own.load == load).expect("the load").matrix.clone()
        };
        let about_z = LoadKind::SPIN.iter().position(|pair| *pair == (2, 2)).expect("about z");
        let (spin, turn) =
            (of_inertia(LoadKind::Spin, about_z), of_inertia(LoadKind::AngularAcceleration, 2));
        let pairs = || (0..nf).flat_map(|i| (0..nf).map(move |j| (i, j)));
        let squares = |i: usize, j: usize| w2[(2 * nf + i, 2 * nf + j)] - spin[(i, j)];
        let own = invariants.inertia()[(2, 2)]
            + (0..nf).map(|j| w1[(2, 2 * nf + j)] * q[j]).sum::<f64>()
            + pairs().map(|(i, j)| q[i] * squares(i, j) * q[j]).sum::<f64>();
        assert!((own / inertia - 1.0).abs() < 1e-12, "{frame:?}: {own} {inertia}");
        let size = inertia.sqrt();
        for j in 0..nf {
            let own = invariants.c2()[(2, j)]
                + (0..nf).map(|i| q[i] * (w3[(2 * nf + i, j)] + turn[(i, j)])).sum::<f64>();
            let right = coupling(j);
            assert!((own - right).abs() < 1e-11 * size, "{frame:?}, mode {j}: {own} {right}");
        }
    }
}

/// A torsion of a straight shaft displaces none of its nodes, and the reference point beside its end by as much as rounding.
#[test]
fn a_frame_stands_beside_the_end_of_a_straight_shaft() {
    for mass in [2, 5] {
        let end = NodeSet { reference: Reference::Point([0.0, 0.0, 0.05]), ..NodeSet::new("end", vec![1]) };
        let raw = shaft(mass, 0.05).with(|data| data.interfaces = vec![end]);
        let body = body_of(raw, BasisChoice::default(), FrameChoice::Interface("end".to_owned()), 6);
        assert_eq!(failed(&body), [""; 0]);
        // A body whose carrier turns is found.
        let mut parts = body.into_parts();
        let rotation = parts.modes.rotation.as_mut().expect("rotations");
        let size = rotation.norm_max();
        rotation[(0, 5)] += 1e-6 * size;
        let turned = failed(&FlexBody::new(parts).expect("no shape changed"));
        assert!(turned.iter().any(|check| check.starts_with("frame_on_interface")), "{turned:?}");
    }
}

/// Changed entries of the matrices in the coordinates of many interfaces are found.
#[test]
fn changed_matrices_of_many_interfaces_are_found() {
    let random = &mut Random(8);
    let raw = tree(random, 60, false, BeamMass::Consistent);
    let sets = interfaces(&raw, 40, random);
    let basis = BasisChoice::CraigBampton(CraigBampton);
    let body = body_of(raw.with(|data| data.interfaces = sets), basis, BodyFrame::Com.into(), 3);
    assert_eq!(failed(&body), [""; 0]);
    type Change = fn(&mut Mat<f64>);
    let changes: [(&str, Change); 2] =
        [("one entry", |a| a[(7, 7)] *= 1.0 + 1e-6), ("all", |a| *a *= 1.0 + 1e-8)];
    for (name, change) in changes {
        for (matrix, check) in [("stiffness", "interface_stiffness"), ("mass", "interface_mass")] {
            let mut parts = body.clone().into_parts();
            let coordinates = parts.coordinates.as_mut().expect("interface coordinates");
            change(if matrix == "mass" { &mut coordinates.mass } else { &mut coordinates.stiffness });
            let broken = failed(&FlexBody::new(parts).expect("no shape changed"));
            assert!(broken.iter().any(|name| name.starts_with(check)), "{name} {matrix}: {broken:?}");
        }
    }
}

/// Returns the flexibility of the free body with inertia relief, G = (K + M R R'M)^-1 - R R', for M-orthonormal rigid
/// motions R.
fn flexibility(raw: &RawModel) -> DMatrix<f64> {
    let (k, m) = (dense(&raw.stiffness.matrix), dense(&raw.mass.matrix));
    let rigid = DMatrix::from_fn(k.nrows(), 6, |row, c| {
        let x = Vector3::from(raw.nodes.positions[row / 6]);
        let unit = |k: usize| Vector3::<f64>::ith(k, 1.0);
        match (row % 6, c) {
            (i, c) if i < 3 && c < 3 => f64::from(i == c),
            (i, c) if i < 3 => unit(c - 3).cross(&x)[i],
            (i, c) => f64::from(i == c),
        }
    });
    let lower = (rigid.transpose() * &m * &rigid).cholesky().expect("a mass").l();
    let rigid = lower.solve_lower_triangular(&rigid.transpose()).expect("regular").transpose();
    let coupled = &m * &rigid;
    (k + &coupled * coupled.transpose()).try_inverse().expect("regular") - &rigid * rigid.transpose()
}

/// A lumped frame with few fixed-interface modes has the static compliance of the nodes between its interfaces, for forces and
/// torques in equilibrium. With most of them shapes without mass are left out: it keeps the compliance to forces, and no mode
/// is higher than its masses allow.
#[test]
fn lumped_frames_keep_the_compliance_of_their_interfaces() {
    let raw = tree(&mut Random(21), 10, false, BeamMass::Lumped);
    let exact = flexibility(&raw);
    let ends = [("first", 1), ("last", 10)];
    let places = [0, 9].map(|node: usize| Vector3::from(raw.nodes.positions[node]));
    let sets = ends
        .map(|(name, node)| NodeSet { coupling: Some(Coupling::Rigid), ..NodeSet::new(name, vec![node]) });
    let raw = raw.with(|data| data.interfaces = sets.to_vec());
    let highest = |body: &FlexBody| body.modes().eigenvalue.last().copied().expect("modes");
    // All modes that the masses have.
    let all = body_of(raw.clone(), BasisChoice::default(), BodyFrame::Com.into(), 24);
    // Loads at the second end are balanced by those at the first.
    let arm = places[1] - places[0];
    let balanced = |load: DVector<f64>| {
        let (force, torque) =
            (Vector3::new(load[0], load[1], load[2]), Vector3::new(load[3], load[4], load[5]));
        let moment = torque + arm.cross(&force);
        let first = force.iter().chain(moment.iter()).map(|value| -value);
        DVector::from_iterator(12, first.chain(load.iter().copied()))
    };
    let along = [balanced(DVector::from_iterator(6, arm.iter().copied().chain([0.0; 3])))];
    let general = (0..6).map(|k| balanced(DVector::from_fn(6, |i, _| f64::from(i == k)))).collect::<Vec<_>>();
    let rows: Vec<usize> = [0, 9].into_iter().flat_map(|node| (0..6).map(move |k| 6 * node + k)).collect();
    for (modes, loads, allowed) in
        [(2, general.as_slice(), 1e-8), (17, along.as_slice(), 1e-3), (24, along.as_slice(), 1e-3)]
    {
        let body =
            body_of(raw.clone(), BasisChoice::CraigBampton(CraigBampton), BodyFrame::Com.into(), modes);
        assert_eq!(failed(&body), [""; 0], "{modes} modes");
        assert!(highest(&body) <= 100.0 * highest(&all), "{modes} modes");
        let (shape, rotation) = (&body.modes().shape, body.modes().rotation.as_ref().expect("rotations"));
        let motion = |row: usize, j: usize| {
            let at = row / 6 * 3 + row % 3;
            if row % 6 < 3 { shape[(at, j)] } else { rotation[(at, j)] }
        };
        for load in loads {
            let work =
                |j: usize| rows.iter().zip(load.iter()).map(|(row, f)| motion(*row, j) * f).sum::<f64>();
            let own: f64 =
                body.modes().eigenvalue.iter().enumerate().map(|(j, lambda)| work(j).powi(2) / lambda).sum();
            let right: f64 = rows
                .iter()
                .zip(load.iter())
                .flat_map(|a| rows.iter().zip(load.iter()).map(move |b| (a, b)))
                .map(|((a, fa), (b, fb))| fa * exact[(*a, *b)] * fb)
                .sum();
            assert!((own / right - 1.0).abs() < allowed, "{modes} modes: {own} {right}");
        }
    }
}
