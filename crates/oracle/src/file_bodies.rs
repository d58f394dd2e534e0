//! Random flexible bodies for the tests of the file: valid parts without mechanical meaning.
#![allow(dead_code)] // every test file uses a part of this module

use faer::Mat;
use flexbody_base::provenance::{SourceFile, sha256_hex};
use flexbody_base::units::UnitSystem;
use flexbody_body::flex_body::{
    Certificate, FixedInterface, FlexBody, Frame, FreeEstimate, GeometricStiffness, Guarantee, Interface,
    InterfaceCoordinates, InternalRows, LoadColumns, LoadKind, LumpedBody, MassStructure, Modes,
    MotionColumns, MotionLoad, NamedLoad, Parts, Quantity, Recovery, RecoveryRow, ReferenceConditions,
    RotatedStiffness, Source, Storage, SurfaceMesh, Truncation, UnitLoad,
};
use flexbody_body::invariants::{
    DIGITS, GeneralTerms, InertiaStiffness, Invariants, PrimaryData, TermGroups,
};
use flexbody_model::{BodyNumber, Coupling, Description, NodeMoments, Nodes};
use hdf5::types::VarLenUnicode;
use hdf5_metno as hdf5;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::collections::BTreeMap;
use std::path::Path;

/// SplitMix64: a small seeded generator with the same numbers on every machine.
pub struct Random {
    state: u64,
    wild: bool,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        Self { state: seed, wild: false }
    }

    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Returns a number between -1 and 1. A wild generator also returns zero, negative zero, subnormal, tiny and huge
    /// numbers.
    pub fn value(&mut self) -> f64 {
        let unit = (self.bits() >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0;
        if !self.wild {
            return unit;
        }
        match self.below(40) {
            0 => 0.0,
            1 => -0.0,
            2 => f64::from_bits(self.bits() % (1 << 52)),
            3 => unit * 1e-200,
            4 => unit * 1e200,
            _ => unit,
        }
    }

    pub fn positive(&mut self) -> f64 {
        self.value().abs().max(1e-300)
    }

    pub fn matrix(&mut self, rows: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| self.value())
    }

    pub fn name(&mut self) -> String {
        const PARTS: [&str; 12] =
            ["left", "/", ".", "%", "..", " ", "Lager außen", "\n", "日本", "%2F", "\"quoted\"", "\u{1}"];
        let mut name = format!("{}", self.below(1000));
        for _ in 0..self.below(4) {
            name.insert_str(0, PARTS[self.below(PARTS.len())]);
        }
        name
    }

    pub fn invariants(&mut self, nf: usize) -> Invariants {
        Invariants::new(PrimaryData {
            mass: self.positive(),
            first_moment: Vector3::from_fn(|_, _| self.value()),
            second_moment: Matrix3::from_fn(|_, _| self.value()),
            c1: self.matrix(3, nf),
            ibar: [(); 3].map(|()| [(); 3].map(|()| (0..nf).map(|_| self.value()).collect())),
            s: [(); 3].map(|()| [(); 3].map(|()| self.matrix(nf, nf))),
            modal_stiffness: self.matrix(nf, nf),
            general: None,
            groups: TermGroups::ALL,
        })
    }

    fn general(&mut self, nf: usize) -> GeneralTerms {
        GeneralTerms {
            w0: self.matrix(3, 3 * nf),
            w3: self.matrix(3 * nf, nf),
            modal_mass: self.matrix(nf, nf),
            plane: false,
        }
    }

    fn internal(&mut self, nf: usize) -> Option<InternalRows> {
        let rows = self.below(4);
        let dofs = (0..rows).map(|i| [1000 + i as i64, 1 + self.below(6) as i64]).collect();
        (rows > 0).then(|| InternalRows { dofs, shape: self.matrix(rows, nf) })
    }

    /// Returns a surface of triangles, edges or both on the last of `n` nodes and others; `None` for few nodes.
    fn mesh(&mut self, n: usize) -> Option<SurfaceMesh> {
        let (triangles, edges) = (self.below(4), self.below(4));
        let mut other = |last: u32, apart: u32| {
            let width = last - 1 - apart;
            apart + self.below(width as usize + 1) as u32
        };
        let last = u32::try_from(n).expect("few nodes").checked_sub(1).filter(|last| *last >= 2)?;
        let triangles = (0..triangles).map(|_| [last, 0, other(last, 1)]).collect();
        let edges = (0..edges).map(|_| [other(last, 0), last]).collect();
        SurfaceMesh::new(triangles, edges, n).ok()
    }
}

fn guarantee(r: &mut Random, eigenvalue: &[f64]) -> Guarantee {
    Guarantee {
        shift_below: 0.25 * eigenvalue[0],
        pivots_below: 6,
        eigenvalue_lower: eigenvalue.iter().map(|l| 0.5 * l).collect(),
        eigenvalue_upper: eigenvalue.to_vec(),
        shape_error: eigenvalue.iter().map(|_| r.positive().min(1.0)).collect(),
        digits: DIGITS.map(|_| r.positive().min(16.0)),
    }
}

/// Returns a recovery of a few rows with loads at the `loaded` interfaces.
fn recovery(r: &mut Random, number: usize, nf: usize, loaded: &[String], named: usize) -> Recovery {
    let rows = 1 + r.below(3);
    let row = |(i, r): (usize, &mut Random)| RecoveryRow {
        name: format!("{}-{i}", r.name()),
        quantity: Quantity::ALL[r.below(Quantity::ALL.len())],
        component: "xx".to_owned(),
        unit: r.name(),
        node: (r.below(2) == 1).then_some(-7),
        element: (r.below(2) == 1).then_some(i as i64),
    };
    Recovery {
        name: format!("{}-{number}", r.name()),
        rows: (0..rows).map(|i| row((i, r))).collect(),
        offset: (0..rows).map(|_| r.value()).collect(),
        modes: r.matrix(rows, nf),
        spin: r.matrix(rows, 6),
        loads: loaded
            .iter()
            .map(|interface| LoadColumns { interface: interface.clone(), columns: r.matrix(rows, 6) })
            .collect(),
        named: r.matrix(rows, named),
        motion: MotionLoad::ALL
            .iter()
            .filter(|_| r.below(3) == 0)
            .collect::<Vec<_>>()
            .into_iter()
            .map(|&load| MotionColumns { load, columns: r.matrix(rows, load.components() * nf) })
            .collect(),
    }
}

/// Returns a named load.
fn named_load(r: &mut Random, number: usize, nf: usize) -> NamedLoad {
    NamedLoad {
        name: format!("{}-load{number}", r.name()),
        preload: r.below(2) == 1,
        modal: (0..nf).map(|_| r.value()).collect(),
        force: Vector3::from_fn(|_, _| r.value()),
        torque: Vector3::from_fn(|_, _| r.value()),
        moments: Matrix3::from_fn(|_, _| r.value()),
        turning: r.matrix(3, nf),
        compliance: (r.below(2) == 1).then(|| r.positive()),
    }
}

/// Returns up to `count` loads, each of a different kind.
fn geometric_stiffness(r: &mut Random, nf: usize, count: usize) -> Vec<GeometricStiffness<Mat<f64>>> {
    let kinds = [
        LoadKind::Force(r.name()),
        LoadKind::Spin,
        LoadKind::Named(r.name()),
        LoadKind::Acceleration,
        LoadKind::Moment(r.name()),
        LoadKind::AngularAcceleration,
    ];
    let load = |kind: LoadKind, r: &mut Random| {
        let component = r.below(kind.components().len());
        GeometricStiffness { load: UnitLoad { kind, component }, matrix: r.matrix(nf, nf) }
    };
    kinds.into_iter().take(count).map(|kind| load(kind, r)).collect()
}

fn coordinates(r: &mut Random, size: usize, nf: usize) -> InterfaceCoordinates {
    let symmetric = |r: &mut Random| {
        let a = r.matrix(size, size);
        Mat::from_fn(size, size, |i, j| a[(i.min(j), i.max(j))])
    };
    InterfaceCoordinates {
        names: (0..size).map(|_| r.name()).collect(),
        stiffness: symmetric(r),
        mass: symmetric(r),
        of_modes: r.matrix(size, nf),
    }
}

/// Returns moments of nodes, some of which are zero.
fn moments(r: &mut Random, n: usize) -> Vec<NodeMoments> {
    let of_node = |r: &mut Random| match r.below(3) {
        0 => NodeMoments { first: Vector3::zeros(), second: Matrix3::zeros() },
        _ => NodeMoments {
            first: Vector3::from_fn(|_, _| r.value()),
            second: Matrix3::from_fn(|_, _| r.value()),
        },
    };
    (0..n).map(|_| of_node(r)).collect()
}

/// Returns the parts of a valid body with `n` nodes, `nf` modes (certified if both are odd), `schemes` lumping schemes
/// and `interfaces` interfaces.
pub fn parts(mut r: Random, n: usize, nf: usize, schemes: usize, interfaces: usize) -> Parts {
    let mut eigenvalue: Vec<f64> = (0..nf).map(|_| r.positive()).collect();
    eigenvalue.sort_by(f64::total_cmp);
    let units = [
        UnitSystem::default(),
        UnitSystem::parse("mm", "tonne", "s").unwrap(),
        UnitSystem::parse("0.0254", "2.5e-3", "ms").unwrap(),
    ];
    let axes = Rotation3::from_euler_angles(0.3, -1.2, 2.5)
        * Rotation3::from_euler_angles(r.positive().min(1.0), 0.1, 0.2);
    let lumped = (0..schemes)
        .map(|i| LumpedBody {
            scheme: format!("{i}{}", r.name()),
            invariants: r.invariants(nf),
            negative_masses: r.below(100),
            comparison: (0..r.below(5)).map(|k| (format!("{}{k}", r.name()), r.value())).collect(),
        })
        .collect();
    let bounded = eigenvalue.clone();
    let mass_structure = MassStructure::ALL[r.below(3)];
    let general = (mass_structure == MassStructure::General).then(|| r.general(nf));
    let wild = r.wild;
    let name = r.name();
    let files = (0..r.below(4))
        .map(|i| SourceFile {
            role: format!("role{i}"),
            name: r.name(),
            sha256: format!("{:064x}", r.bits()),
        })
        .collect();
    let number = (r.below(2) == 1).then(|| BodyNumber { number: 2, of: 2 + r.below(3) });
    let mut parts = Parts {
        source: Source {
            files,
            n_dofs: 3 * n,
            mass_structure,
            approximation: (mass_structure == MassStructure::General).then(|| "Ω \"10 %\"".to_owned()),
            settings: serde_json::json!({
                "modes": nf, "shift": r.value(), "nul": "\u{0}", "list": [null, true, "ß"], "big": u64::MAX,
            }),
        },
        description: Description { name, number, units: units[r.below(3)].clone() },
        dimension: 3,
        frame: Frame { origin: Vector3::from_fn(|_, _| r.value()), axes: *axes.matrix() },
        conditions: ReferenceConditions::MeanAxes,
        nodes: Nodes {
            ids: (0..n as i64).map(|i| (i * 7 + 3) * if i % 2 == 0 { 1 } else { -1 }).collect(),
            positions: (0..n).map(|_| [(); 3].map(|()| r.value())).collect(),
        },
        modes: Modes {
            eigenvalue,
            residual: (0..nf).map(|_| r.value().abs()).collect(),
            provenance: (0..nf).filter(|_| n * nf % 2 == 1).map(|_| r.name()).collect(),
            truncation: (0..nf)
                .filter(|_| n * nf % 2 == 1)
                .map(|_| Truncation { load: r.name(), before: r.value(), after: r.value() })
                .collect(),
            rotation: (r.below(2) == 1).then(|| r.matrix(3 * n, nf)),
            internal: r.internal(nf),
            damping_ratio: (0..nf).map(|_| r.value().abs()).collect(),
            modal_damping: (r.below(2) == 1).then(|| Mat::from_fn(nf, nf, |_, _| r.value())),
            shape: r.matrix(3 * n, nf),
        },
        invariants: {
            let mut invariants = r.invariants(nf);
            invariants.primary_mut().general = general;
            invariants
        },
        geometric_stiffness: geometric_stiffness(&mut r, nf, interfaces),
        rotated_stiffness: Vec::new(),
        estimated_stiffness: Vec::new(),
        inertia_stiffness: None,
        lumped,
        certificate: Certificate {
            proved_modes: (r.below(2) == 0).then(|| r.below(100)),
            shift: r.value(),
            negative_pivots: (r.below(2) == 0).then(|| r.below(100)),
            rigid_modes: 6,
            remark: if r.below(2) == 0 { String::new() } else { r.name() },
            rigid_noise: r.value(),
            rigid_residual: r.value(),
            eigenvalue_rounding: 1.5e-9,
            inertia_rounding: 2.5e-7,
            guarantee: (n * nf % 2 == 1).then(|| guarantee(&mut r, &bounded)),
            fixed_interface: (n * nf % 2 == 1).then(|| FixedInterface {
                modes: nf,
                interface_motions: 6,
                counted: Some(nf),
                shift: 2.5,
                next: Some(3.5),
                residual: 1e-12,
                // With and without a list of eigenvalues, with and without estimates of the free body.
                eigenvalues: (1..=nf)
                    .filter(|_| nf % 4 == 3 || nf % 8 == 5)
                    .map(|j| 0.5 * j as f64)
                    .collect(),
                free: (nf % 4 == 3 || nf == 1).then(|| FreeEstimate {
                    estimate: bounded.iter().map(|lambda| 0.75 * lambda).collect(),
                    lower: bounded.iter().map(|lambda| 0.5 * lambda).collect(),
                }),
            }),
        },
        interfaces: (0..interfaces)
            .map(|i| Interface {
                name: format!("{}{i}", r.name()),
                nodes: (0..1 + r.below(2 * n)).map(|_| r.below(n)).collect(),
                coupling: [None, Some(Coupling::Rigid), Some(Coupling::Averaging)][r.below(3)],
                reference: (n * nf % 2 == 1 || r.below(4) > 0).then(|| [(); 3].map(|()| r.value())),
            })
            .map(|i| Interface {
                coupling: if i.reference.is_none() { Some(Coupling::Free) } else { i.coupling },
                ..i
            })
            .collect(),
        coordinates: (n * nf % 2 == 1).then(|| coordinates(&mut r, 1 + interfaces, nf)),
        recoveries: Vec::new(),
        named_loads: Vec::new(),
        terms: Vec::new(),
        mesh: r.mesh(n),
        storage: Storage::F64,
    };
    // Products of wild numbers would overflow.
    if let Some(rotation) = parts.modes.rotation.as_ref().filter(|_| !wild && r.below(2) == 1) {
        parts.inertia_stiffness = Some(InertiaStiffness::new(moments(&mut r, n), rotation.as_ref(), 3));
    }
    if n * nf % 2 == 1 {
        let loaded = parts.interfaces.iter().filter(|interface| interface.reference.is_some());
        let loaded: Vec<String> = loaded.map(|interface| interface.name.clone()).collect();
        parts.recoveries = (0..2).map(|i| recovery(&mut r, i, nf, &loaded, 2)).collect();
        parts.named_loads = (0..2).map(|i| named_load(&mut r, i, nf)).collect();
        let rotated = |given: &GeometricStiffness<_>| RotatedStiffness {
            load: given.load.clone(),
            modes: r.matrix(nf, 3),
            rotation: r.matrix(3, 3),
        };
        parts.rotated_stiffness = parts.geometric_stiffness.iter().map(rotated).collect();
        let estimated = |component| GeometricStiffness {
            load: UnitLoad { kind: LoadKind::Spin, component },
            matrix: r.matrix(nf, nf),
        };
        parts.estimated_stiffness = [0, 2, 5].map(estimated).into();
    }
    parts
}

/// Returns a body of moderate numbers.
pub fn body(seed: u64, n: usize, nf: usize, schemes: usize, interfaces: usize) -> FlexBody {
    FlexBody::new(parts(Random::new(seed), n, nf, schemes, interfaces)).expect("random parts are valid")
}

/// Returns a body with every kind of finite number.
pub fn wild_body(seed: u64, n: usize, nf: usize, schemes: usize, interfaces: usize) -> FlexBody {
    let random = Random { state: seed, wild: true };
    FlexBody::new(parts(random, n, nf, schemes, interfaces)).expect("random parts are valid")
}

/// Returns every number of a body, bit for bit, and every text.
pub fn fingerprint(body: &FlexBody) -> (Vec<u64>, String) {
    let p = body.parts();
    let mut bits: Vec<u64> = Vec::new();
    let matrix = |bits: &mut Vec<u64>, m: &Mat<f64>| {
        bits.extend([m.nrows() as u64, m.ncols() as u64]);
        for j in 0..m.ncols() {
            bits.extend((0..m.nrows()).map(|i| m[(i, j)].to_bits()));
        }
    };
    let all = [&p.invariants].into_iter().chain(p.lumped.iter().map(|l| &l.invariants));
    for invariants in all {
        let i = invariants.clone().primary_mut().clone();
        bits.push(i.mass.to_bits());
        bits.extend(i.first_moment.iter().chain(i.second_moment.iter()).map(|v| v.to_bits()));
        matrix(&mut bits, &i.c1);
        bits.extend(i.ibar.iter().flatten().flatten().map(|v| v.to_bits()));
        i.s.iter().flatten().for_each(|m| matrix(&mut bits, m));
        matrix(&mut bits, &i.modal_stiffness);
    }
    matrix(&mut bits, &p.modes.shape);
    p.geometric_stiffness.iter().for_each(|g| matrix(&mut bits, &g.matrix));
    p.estimated_stiffness.iter().for_each(|g| matrix(&mut bits, &g.matrix));
    for follower in &p.rotated_stiffness {
        matrix(&mut bits, &follower.modes);
        matrix(&mut bits, &follower.rotation);
    }
    if let Some(own) = &p.inertia_stiffness {
        own.stiffness.iter().for_each(|g| matrix(&mut bits, &g.matrix));
        let moments = own.moments.iter().flat_map(|m| m.first.iter().chain(m.second.iter()));
        bits.extend(moments.map(|v| v.to_bits()));
    }
    let m = &p.modes;
    let c = &p.certificate;
    bits.extend(m.eigenvalue.iter().chain(&m.residual).chain(&m.damping_ratio).map(|v| v.to_bits()));
    bits.extend(p.nodes.positions.iter().flatten().map(|v| v.to_bits()));
    bits.extend(p.frame.origin.iter().chain(p.frame.axes.iter()).map(|v| v.to_bits()));
    bits.extend(
        [c.shift, c.rigid_noise, c.rigid_residual, c.eigenvalue_rounding, c.inertia_rounding]
            .map(f64::to_bits),
    );
    if let Some(g) = &c.guarantee {
        let columns = [&g.eigenvalue_lower, &g.eigenvalue_upper, &g.shape_error];
        bits.extend(columns.into_iter().flatten().chain(&g.digits).map(|v| v.to_bits()));
        bits.extend([g.shift_below.to_bits(), g.pivots_below as u64]);
    }
    if let Some(c) = &p.coordinates {
        [&c.stiffness, &c.mass, &c.of_modes].into_iter().for_each(|m| matrix(&mut bits, m));
    }
    for recovery in &p.recoveries {
        bits.extend(recovery.offset.iter().map(|v| v.to_bits()));
        let columns = recovery.loads.iter().map(|load| &load.columns);
        [&recovery.modes, &recovery.spin, &recovery.named]
            .into_iter()
            .chain(columns)
            .for_each(|m| matrix(&mut bits, m));
    }
    for load in &p.named_loads {
        let resultant = load.force.iter().chain(&load.torque).chain(&load.moments);
        bits.extend(load.modal.iter().chain(resultant).chain(&load.compliance).map(|v| v.to_bits()));
        matrix(&mut bits, &load.turning);
    }
    bits.extend(p.lumped.iter().flat_map(|l| &l.comparison).map(|(_, v)| v.to_bits()));
    let texts = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?}",
        p.named_loads.iter().map(|load| (&load.name, load.preload)).collect::<Vec<_>>(),
        p.recoveries
            .iter()
            .map(|recovery| (
                &recovery.name,
                &recovery.rows,
                recovery.loads.iter().map(|load| &load.interface).collect::<Vec<_>>()
            ))
            .collect::<Vec<_>>(),
        p.source,
        p.description.units,
        p.nodes.ids,
        p.interfaces,
        p.geometric_stiffness.iter().map(|g| &g.load).collect::<Vec<_>>(),
        (c.proved_modes, c.negative_pivots, c.rigid_modes, &c.remark),
        p.lumped.iter().map(|l| (&l.scheme, l.negative_masses, &l.comparison)).collect::<Vec<_>>(),
        p.coordinates.as_ref().map(|c| &c.names),
    );
    (bits, texts)
}

/// Recomputes the digests of a file, as `docs/reference/file_format.md` describes them.
pub fn seal(file: &hdf5::File) {
    let mut found = BTreeMap::new();
    digest_group(&file.as_group().unwrap(), "", &mut found);
    let list: String = found.iter().map(|(path, digest)| format!("{digest}  {path}\n")).collect();
    for (name, text) in [("sha256", sha256_hex(list.as_bytes())), ("digests", list)] {
        let _ = file.delete_attr(name);
        let text: VarLenUnicode = text.parse().unwrap();
        file.new_attr::<VarLenUnicode>().create(name).unwrap().write_scalar(&text).unwrap();
    }
}

/// Makes the file at `path` one of version 1.`minor`, which had no digests: without what later versions added, which
/// `refusal` names, the first message of the reader if it refuses the file.
///
/// # Panics
/// When the file cannot be changed, or is refused for another reason.
pub fn age(path: &Path, minor: i64, refusal: impl Fn() -> Option<String>) {
    let changed = |change: &dyn Fn(&hdf5::File)| {
        let file = hdf5::File::open_rw(path).unwrap();
        change(&file);
        file.close().unwrap();
    };
    changed(&|file| {
        ["digests", "sha256"].iter().for_each(|name| file.delete_attr(name).unwrap());
        file.attr("format_minor").unwrap().write_scalar(&minor).unwrap();
        // These come together.
        let names = ["nodes/rotational_first_moment", "nodes/rotational_second_moment", "inertia_stiffness"];
        names.iter().filter(|name| file.link_exists(name)).for_each(|name| file.unlink(name).unwrap());
    });
    while let Some(message) = refusal() {
        let newer = message.split_once("holds ").and_then(|(_, rest)| rest.split_once(", which"));
        let (newer, _) = newer.unwrap_or_else(|| panic!("{message}"));
        changed(&|file| match newer.split_once('@') {
            Some((group, name)) => file.group(group).unwrap().delete_attr(name).unwrap(),
            None => file.unlink(newer).unwrap(),
        });
    }
}

fn digest_group(group: &hdf5::Group, path: &str, found: &mut BTreeMap<String, String>) {
    let own = if path.is_empty() { "/" } else { path };
    found.insert(own.to_owned(), sha256_hex(&attribute_records(group, path.is_empty())));
    for name in group.member_names().unwrap() {
        let inner = format!("{path}/{name}");
        match group.group(&name) {
            Ok(member) => digest_group(&member, &inner, found),
            Err(_) => {
                let dataset = group.dataset(&name).unwrap();
                let content = [record("", &dataset), attribute_records(&dataset, false)].concat();
                found.insert(inner, sha256_hex(&content));
            }
        }
    }
}

fn attribute_records(place: &hdf5::Location, is_root: bool) -> Vec<u8> {
    let mut names = place.attr_names().unwrap();
    names.sort();
    names.retain(|name| !is_root || !["digests", "sha256"].contains(&name.as_str()));
    names.iter().flat_map(|name| record(name, &place.attr(name).unwrap())).collect()
}

/// Returns the record `LENGTH NAME TYPE SHAPE BYTES`, a line feed, and the content.
fn record(name: &str, place: &hdf5::Container) -> Vec<u8> {
    use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
    let (kind, content): (&str, Vec<u8>) = match place.dtype().unwrap().to_descriptor().unwrap() {
        TypeDescriptor::Float(FloatSize::U8) => {
            ("float64", place.read_raw::<f64>().unwrap().iter().flat_map(|v| v.to_le_bytes()).collect())
        }
        TypeDescriptor::Integer(IntSize::U8) => {
            ("int64", place.read_raw::<i64>().unwrap().iter().flat_map(|v| v.to_le_bytes()).collect())
        }
        TypeDescriptor::Integer(IntSize::U4) => {
            ("int32", place.read_raw::<i32>().unwrap().iter().flat_map(|v| v.to_le_bytes()).collect())
        }
        _ => ("text", place.read_scalar::<VarLenUnicode>().unwrap().as_bytes().to_vec()),
    };
    let shape: Vec<String> = place.shape().iter().map(usize::to_string).collect();
    let head = format!("{} {name} {kind} {} {}\n", name.len(), shape.join("x"), content.len());
    [head.into_bytes(), content].concat()
}
