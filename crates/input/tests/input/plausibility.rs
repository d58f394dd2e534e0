//! Plausibility of mass, stiffness and positions: M in another order or from another mesh, contradictory
//! units, exchanged matrices. Every mistake is made in a valid model that gives no message.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::{Error, ExitCode};
use flexbody_base::units::UnitSystem;
use flexbody_linalg::CscMatrix;
use flexbody_model::{Coupling, DofLabel, FeModel, NodeSet, Plausibility, RawModel, Reference};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::general::raw_fixture;
use oracle::mesh::{Mesh, entries};
use oracle::random::Random;
use std::collections::BTreeMap;

const NEW: [Code; 7] = [
    Code::MassOrder,
    Code::MassPairs,
    Code::MassesExchanged,
    Code::SpeedImplausible,
    Code::DensityImplausible,
    Code::MatricesExchanged,
    Code::InterfaceFar,
];

/// Solids, beams, shells, a plane model, eliminated constraints, lumped and singular masses, bubbles,
/// springs.
const ALL: [&str; 19] = [
    "bar_c3d8r",
    "bracket_hex20",
    "car_frame",
    "connecting_rod",
    "conveyor_plate",
    "cube_hex8",
    "frame_beams",
    "frame_lumped",
    "gear_disc",
    "hex8_bubbles",
    "hex8_edges",
    "mems_gyroscope",
    "mpc_block",
    "plane_frame",
    "robot_link",
    "satellite",
    "shell_folded",
    "spring_ends",
    "turbine_blade",
];

fn told(raw: RawModel) -> Vec<Code> {
    let diagnostics = match FeModel::from_raw(raw) {
        Ok(checked) => checked.diagnostics,
        Err(error) => error.into_diagnostics(),
    };
    let mut codes: Vec<Code> = diagnostics.iter().map(|d| d.code()).collect();
    codes.retain(|code| NEW.contains(code) || *code == Code::InertiaImplausible);
    codes.dedup();
    codes
}

fn facts(raw: RawModel) -> Plausibility {
    FeModel::from_raw(raw).expect("a sound model").plausibility
}

fn refused(raw: RawModel) -> Error {
    FeModel::from_raw(raw).expect_err("a mistake")
}

/// Returns the matrix rows of each node, by direction.
fn rows_of_nodes(raw: &RawModel) -> Vec<Vec<u32>> {
    let implied = || {
        let d = raw.dimension;
        raw.nodes
            .ids
            .iter()
            .flat_map(|&node| (1..=d).map(move |direction| DofLabel { node, direction }))
            .collect()
    };
    let labels: Vec<DofLabel> = raw.dofs.clone().unwrap_or_else(implied);
    let mut rows: BTreeMap<i64, BTreeMap<u8, u32>> = BTreeMap::new();
    for (row, label) in labels.iter().enumerate() {
        rows.entry(label.node).or_default().insert(label.direction, row as u32);
    }
    rows.into_values().map(|own| own.into_values().collect()).collect()
}

/// Moves the mass of node i to node `to[i]` if both have the same number of rows.
fn with_mass_moved(raw: &RawModel, to: &[usize]) -> RawModel {
    let rows = rows_of_nodes(raw);
    let mut place: Vec<u32> = (0..raw.mass.matrix.n_cols() as u32).collect();
    for (own, &other) in rows.iter().zip(to) {
        assert_eq!(own.len(), rows[other].len());
        own.iter().zip(&rows[other]).for_each(|(&from, &at)| place[from as usize] = at);
    }
    let mut moved = raw.clone();
    moved.mass.matrix = raw.mass.matrix.permuted(&place);
    moved
}

fn exchanged(raw: &RawModel, a: usize, b: usize) -> RawModel {
    let mut to: Vec<usize> = (0..rows_of_nodes(raw).len()).collect();
    to.swap(a, b);
    with_mass_moved(raw, &to)
}

fn scaled(matrix: &CscMatrix, factor: f64) -> CscMatrix {
    let all: Vec<_> = entries(matrix).map(|(r, c, v)| (r, c, factor * v)).collect();
    CscMatrix::from_triplets(matrix.n_rows(), matrix.n_cols(), &all)
}

fn in_units(raw: &RawModel, units: [&str; 3]) -> RawModel {
    let [length, mass, time] = units;
    raw.clone().with(|data| data.description.units = UnitSystem::parse(length, mass, time).expect("units"))
}

fn with_stiffness_times(raw: &RawModel, factor: f64) -> RawModel {
    let mut changed = raw.clone();
    changed.stiffness.matrix = scaled(&raw.stiffness.matrix, factor);
    changed
}

fn with_mass_times(raw: &RawModel, factor: f64) -> RawModel {
    let mut changed = raw.clone();
    changed.mass.matrix = scaled(&raw.mass.matrix, factor);
    changed
}

fn with_nodes_times(raw: &RawModel, factor: f64) -> RawModel {
    let mut changed = raw.clone();
    changed.nodes.positions.iter_mut().flatten().for_each(|x| *x *= factor);
    changed
}

#[test]
fn nothing_is_told_of_the_right_order_and_units() {
    for name in ALL {
        assert_eq!(told(raw_fixture(name)), [], "{name}");
    }
}

#[test]
fn a_random_order_of_the_mass_is_refused() {
    for name in [
        "bar_c3d8r",
        "bracket_hex20",
        "connecting_rod",
        "cube_hex8",
        "frame_beams",
        "mems_gyroscope",
        "plane_frame",
        "satellite",
        "shell_folded",
    ] {
        let raw = raw_fixture(name);
        let error = refused(with_mass_moved(&raw, &Random(7).permutation(rows_of_nodes(&raw).len())));
        assert!(error.has(Code::MassOrder), "{name}: {error}");
        assert_eq!(error.exit_code(), ExitCode::BadInput, "{name}");
    }
}

/// On linear elements every exchange of two nodes is reported. On quadratic elements some nodes of one
/// element have equal mass, so that their exchange changes little.
#[test]
fn two_exchanged_nodes_are_told() {
    for (name, all) in [
        ("cube_hex8", true),
        ("bar_c3d8r", true),
        ("frame_beams", true),
        ("shell_folded", true),
        ("connecting_rod", false),
        ("bracket_hex20", false),
    ] {
        let raw = raw_fixture(name);
        let rows = rows_of_nodes(&raw);
        let node_of: BTreeMap<u32, usize> =
            rows.iter().enumerate().flat_map(|(i, own)| own.iter().map(move |&row| (row, i))).collect();
        let mut random = Random(3);
        let (mut tried, mut missed) = (0, Vec::new());
        while tried < 25 {
            let a = random.next_u64() as usize % rows.len();
            let coupled = raw.stiffness.matrix.column(rows[a][0] as usize).0;
            let b = node_of[&coupled[random.next_u64() as usize % coupled.len()]];
            if a == b || rows[a].len() != rows[b].len() {
                continue;
            }
            tried += 1;
            let wrong = exchanged(&raw, a, b);
            if told(wrong.clone()).is_empty() {
                let sum =
                    |raw: &RawModel| -> f64 { raw.mass.matrix.column(rows[a][0] as usize).1.iter().sum() };
                missed.push((sum(&wrong) / sum(&raw) - 1.0).abs());
            }
        }
        assert!(!all || missed.is_empty(), "{name}: {missed:?}");
        assert!(missed.len() <= 8 && missed.iter().all(|change| *change < 0.4), "{name}: {missed:?}");
    }
}

#[test]
fn nodes_of_one_element_that_are_exchanged_are_named() {
    // A corner and the middle of an edge that belong to one element only: K couples both with the same nodes.
    let raw = Mesh::block(ElementKind::Hex20, [3, 1, 1], [3.0, 1.0, 1.0])
        .assemble(&Material::STEEL, MassRule::Consistent)
        .raw_model();
    let at = |x: [f64; 3]| raw.nodes.positions.iter().position(|p| *p == x).expect("a node");
    let (corner, middle) = (at([0.0, 0.0, 0.0]), at([0.5, 0.0, 0.0]));
    assert_eq!(told(raw.clone()), []);
    let checked = FeModel::from_raw(exchanged(&raw, corner, middle)).expect("a warning only");
    let found = checked.diagnostics.iter().find(|d| d.code() == Code::MassesExchanged).expect("told");
    assert!(
        found.message().contains(&format!("{} and {}", corner.min(middle) + 1, corner.max(middle) + 1)),
        "{found}"
    );
}

#[test]
fn mass_of_another_mesh_with_as_many_nodes_is_refused() {
    let block = |cells| {
        Mesh::block(ElementKind::Hex8, cells, [3.0, 2.0, 1.0])
            .assemble(&Material::STEEL, MassRule::Consistent)
            .raw_model()
    };
    let (one, other) = (block([2, 3, 5]), block([5, 3, 2]));
    let mixed = RawModel { mass: other.mass, ..one };
    assert!(refused(mixed).has(Code::MassOrder));
}

#[test]
fn other_orders_of_rows_are_recognised() {
    let raw = raw_fixture("connecting_rod");
    let n = raw.mass.matrix.n_cols() as u32;
    let help = |place: Vec<u32>| {
        let mut moved = raw.clone();
        moved.mass.matrix = raw.mass.matrix.permuted(&place);
        let error = refused(moved);
        error.diagnostics().iter().find(|d| d.code() == Code::MassOrder).expect("told").help().to_owned()
    };
    let reversed = help((0..n).map(|row| n - 1 - row).collect());
    assert!(reversed.contains("reverse"), "{reversed}");
    let blocked = help((0..n).map(|row| (row % 3) * (n / 3) + row / 3).collect());
    assert!(blocked.contains("direction"), "{blocked}");
    assert!(
        help(Random(5).permutation(n as usize).into_iter().map(|row| row as u32).collect())
            .contains("same analysis")
    );
}

/// A mass distributed over several nodes without stiffness between them couples every pair of these nodes.
#[test]
fn a_mass_spread_over_nodes_is_a_warning() {
    let mut raw = raw_fixture("cube_hex8");
    let rows = rows_of_nodes(&raw);
    let held = [0, 40, 80, 650, 700, 728];
    let mut all: Vec<_> = entries(&raw.mass.matrix).collect();
    for a in held {
        for b in held {
            all.extend(rows[a].iter().zip(&rows[b]).map(|(&a, &b)| (a, b, 1e-3)));
        }
    }
    let n = raw.mass.matrix.n_cols();
    raw.mass.matrix = CscMatrix::from_triplets(n, n, &all);
    assert_eq!(told(raw), [Code::MassPairs]);
}

#[test]
fn what_a_person_has_looked_at_is_a_warning() {
    let raw = raw_fixture("cube_hex8");
    let allowed = |raw: RawModel| told(RawModel { allow_implausible: true.into(), ..raw });
    assert_eq!(allowed(exchanged(&raw, 0, 5)), [Code::MassPairs]);
    assert_eq!(allowed(with_mass_times(&raw, 1e-3))[0], Code::InertiaImplausible);
}

/// Densities and speeds of sound of affine elements are exact.
#[test]
fn densities_and_speeds_are_those_of_the_material() {
    // 2 lambda + 3 mu.
    let modulus = |young: f64, poisson: f64| {
        2.0 * young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)) + 1.5 * young / (1.0 + poisson)
    };
    for (name, density, young, poisson) in
        [("cube_hex8", 2700.0, 7e10, 0.33), ("bar_c3d8r", 7850.0, 2.1e11, 0.3)]
    {
        let facts = facts(raw_fixture(name));
        let quartiles = facts.densities.expect("solid elements").quartiles;
        assert!(quartiles.iter().all(|found| (found / density - 1.0).abs() < 1e-9), "{name}: {quartiles:?}");
        let speed = (modulus(young, poisson) / density).sqrt();
        let found = facts.sound_speed.expect("stretched");
        assert!(
            (found.whole / speed - 1.0).abs() < 1e-9 && (found.median / speed - 1.0).abs() < 1e-9,
            "{name}: {found:?}"
        );
    }
    for (name, density, spread) in
        [("connecting_rod", 7.85e-9, 0.02), ("bracket_hex20", 7.85e-9, 0.06), ("robot_link", 2.7e-9, 0.01)]
    {
        let [lower, median, upper] = facts(raw_fixture(name)).densities.expect("solid elements").quartiles;
        assert!(
            (median / density - 1.0).abs() < spread && upper / lower < 1.2,
            "{name}: {lower} {median} {upper}"
        );
    }
    // For bars the speed of sound along them is known, but not their density.
    let frame = facts(raw_fixture("frame_beams"));
    assert!(frame.densities.is_none());
    let speed = (7e10f64 / 2700.0 / 3.0).sqrt();
    assert!((frame.sound_speed.expect("stretched").median / speed - 1.0).abs() < 1e-3, "{frame:?}");
}

#[test]
fn beams_shells_and_planes_have_no_density_of_solids() {
    for name in ["car_frame", "frame_beams", "frame_lumped", "plane_frame", "shell_folded"] {
        assert!(facts(raw_fixture(name)).densities.is_none(), "{name}");
    }
}

#[test]
fn densities_of_no_matter_are_refused() {
    let bracket = raw_fixture("bracket_hex20");
    let cases = [
        ("tonnes called kilograms", in_units(&bracket, ["mm", "kg", "s"])),
        ("millimetres called metres", in_units(&bracket, ["m", "t", "s"])),
        ("nodes in metres", with_nodes_times(&bracket, 1e-3)),
        ("nodes in inches", with_nodes_times(&bracket, 1.0 / 25.4)),
        ("7.85 for 7850", with_mass_times(&raw_fixture("bar_c3d8r"), 1e-3)),
    ];
    for (case, raw) in cases {
        let error = refused(raw.clone());
        assert!(error.has(Code::DensityImplausible), "{case}: {error}");
        assert_eq!(error.exit_code(), ExitCode::BadInput, "{case}");
        assert!(FeModel::from_raw(RawModel { allow_implausible: true.into(), ..raw }).is_ok(), "{case}");
    }
    let error = refused(in_units(&bracket, ["mm", "kg", "s"]));
    let help =
        error.diagnostics().iter().find(|d| d.code() == Code::DensityImplausible).expect("told").help();
    assert!(help.contains("mm, t, s"), "{help}");
}

/// Numbers without stated units are taken as m, kg, s. Implausible numbers are refused with units that would
/// make them plausible: densities of solids, speeds of sound of other models.
#[test]
fn numbers_without_units_are_those_of_matter() {
    let unstated = |raw: RawModel| raw.with(|data| data.description.units = UnitSystem::default());
    let bracket = unstated(raw_fixture("bracket_hex20"));
    let shell = unstated(with_stiffness_times(&raw_fixture("shell_folded"), 1e6));
    let frame = unstated(with_stiffness_times(&raw_fixture("frame_beams"), 1e6));
    for (raw, said) in
        [(&bracket, "e-9 kg/m^3"), (&shell, "a speed of sound of 5.0"), (&frame, "a speed of sound of 2.9")]
    {
        let error = refused(raw.clone());
        let found = error.diagnostics().iter().find(|d| d.code() == Code::DensityImplausible).expect("told");
        assert!(
            found.message().contains(said) && found.message().contains("assumed since no units are given"),
            "{error}"
        );
        assert!(
            found.help().starts_with("state the units with --units")
                && found.help().contains("the numbers fit materials in mm, t, s;"),
            "{error}"
        );
        let codes = told(RawModel { allow_implausible: true.into(), ..raw.clone() });
        assert!(!codes.is_empty() && !codes.contains(&Code::DensityImplausible), "{codes:?}");
    }
    // Plausible numbers in m, kg, s need no units.
    for name in ["cube_hex8", "shell_folded", "frame_beams", "bar_c3d8r"] {
        assert_eq!(told(unstated(raw_fixture(name))), [], "{name}");
    }
    // Matrices in memory have no path.
    let mut in_memory = bracket.clone();
    in_memory.stiffness.path = Default::default();
    assert_eq!(told(in_memory), [Code::InertiaImplausible]);
}

#[test]
fn speeds_of_sound_of_no_matter_are_told() {
    let cases = [
        ("a rubber of the density of steel", with_stiffness_times(&raw_fixture("bar_c3d8r"), 1e-5)),
        (
            "Young's modulus in MPa beside metres and kilograms, of beams",
            with_stiffness_times(&raw_fixture("frame_beams"), 1e-6),
        ),
        ("the same of shells", with_stiffness_times(&raw_fixture("shell_folded"), 1e-6)),
        ("the same of a plane frame", with_stiffness_times(&raw_fixture("plane_frame"), 1e-6)),
        ("frame of 7.85 for 7850", with_mass_times(&raw_fixture("frame_beams"), 1e-3)),
    ];
    for (case, raw) in cases {
        assert!(told(raw).contains(&Code::SpeedImplausible), "{case}");
    }
}

fn implausible(raw: &RawModel) -> Diagnostic {
    let found = refused(raw.clone()).into_diagnostics();
    found.into_iter().find(|d| d.code() == Code::DensityImplausible).expect("told")
}

/// Coordinates in metres beside matrices in mm, t, s: the numbers are consistent in m, t, s.
#[test]
fn mixtures_of_metric_units_are_advised_first() {
    let mixed = with_nodes_times(&raw_fixture("bracket_hex20"), 1e-3);
    let unstated = mixed.clone().with(|data| data.description.units = UnitSystem::default());
    for raw in [&mixed, &unstated, &in_units(&mixed, ["m", "kg", "s"]), &in_units(&mixed, ["cm", "kg", "s"])]
    {
        let help = implausible(raw).help().to_owned();
        assert!(help.contains("the numbers fit materials in m, t, s;") && !help.contains("slug"), "{help}");
    }
    assert_eq!(told(in_units(&mixed, ["m", "t", "s"])), []);
}

#[test]
fn other_units_in_which_metric_numbers_are_no_metal_are_confirmed() {
    let mixed = with_nodes_times(&raw_fixture("bracket_hex20"), 1e-3);
    for units in [["ft", "slug", "s"], ["cm", "g", "s"]] {
        let raw = in_units(&mixed, units);
        let found = implausible(&raw);
        assert!(found.message().contains("in m, t, s the same numbers are those of steel"), "{found}");
        assert!(found.help().contains("--allow-implausible"), "{found}");
        assert_eq!(
            told(RawModel { allow_implausible: true.into(), ..raw }),
            [Code::SpeedImplausible],
            "{units:?}"
        );
    }
    // Steel and aluminium in inches and feet.
    for (name, metre, kilogram) in [("bracket_hex20", 1e3, 1e-3), ("cube_hex8", 1.0, 1.0)] {
        for (units, length, mass) in [
            (["in", "slinch", "s"], 0.0254, 175.126_835_246_476_36),
            (["ft", "slug", "s"], 0.3048, 14.593_902_937_206_364),
        ] {
            let raw = with_nodes_times(&raw_fixture(name), 1.0 / metre / length);
            let raw = with_mass_times(&raw, 1.0 / kilogram / mass);
            let raw = in_units(&with_stiffness_times(&raw, 1.0 / kilogram / mass), units);
            assert_eq!(told(raw.clone()), [], "{name} in {units:?}");
            let help = implausible(&raw.with(|data| data.description.units = UnitSystem::default()))
                .help()
                .to_owned();
            assert!(help.contains(&format!("materials in {};", units.join(", "))), "{help}");
        }
    }
}

/// The density of a metal, and a speed of sound that is off by the root of a ratio of units of stress.
#[test]
fn stiffness_in_another_unit_of_stress_is_refused() {
    let bracket = in_units(&with_mass_times(&raw_fixture("bracket_hex20"), 1e3), ["mm", "kg", "s"]);
    let bar = raw_fixture("bar_c3d8r");
    let [kilopascals, megapascals, pascals] =
        [1e-3, 1e-6, 1e3].map(|factor| with_stiffness_times(&bar, factor));
    for (raw, metal, ratio) in [
        (bracket, "steel", "31.62"),
        (kilopascals, "steel", "31.62"),
        (megapascals, "steel", "1000"),
        (pascals, "steel", "0.03162"),
        (with_stiffness_times(&raw_fixture("cube_hex8"), 1e-3), "aluminium", "31.62"),
    ] {
        let found = implausible(&raw);
        let said = format!("the density is that of {metal}, and so is {ratio} times the speed");
        assert!(found.message().ends_with(&said), "{found}");
        assert_eq!(told(RawModel { allow_implausible: true.into(), ..raw }), [Code::SpeedImplausible]);
    }
    // No metal has this density and this speed.
    assert_eq!(told(with_stiffness_times(&bar, 1e-3 / 5.0)), [Code::SpeedImplausible]);
    let light = with_mass_times(&bar, 0.4);
    assert_eq!(told(with_stiffness_times(&light, 4e-4)), [Code::SpeedImplausible]);
}

/// Mass between nodes that stiffness does not join may be that of points that the deck makes follow others.
#[test]
fn mass_of_points_that_follow_others_has_advice_of_its_own() {
    let mut raw = exchanged(&raw_fixture("cube_hex8"), 0, 5);
    let help = |raw: RawModel| {
        let found = refused(raw).into_diagnostics();
        found.into_iter().find(|d| d.code() == Code::MassOrder).expect("told").help().to_owned()
    };
    assert!(!help(raw.clone()).contains("RBE3"));
    raw.diagnostics.push(Diagnostic::new(Code::DeckConstrained, "6 rows depend on others"));
    assert!(help(raw).contains("RBE3"));
}

#[test]
fn exchanged_matrices_are_named_as_such() {
    for name in [
        "bar_c3d8r",
        "connecting_rod",
        "cube_hex8",
        "frame_beams",
        "frame_lumped",
        "hex8_edges",
        "mpc_block",
        "plane_frame",
        "shell_folded",
    ] {
        let raw = raw_fixture(name);
        let error = refused(RawModel { stiffness: raw.mass.clone(), mass: raw.stiffness.clone(), ..raw });
        assert_eq!(
            error.diagnostics().iter().filter(|d| d.code() == Code::MatricesExchanged).count(),
            1,
            "{name}: {error}"
        );
        assert_eq!(error.exit_code(), ExitCode::BadInput, "{name}");
    }
}

#[test]
fn a_reference_point_far_from_its_nodes_is_told() {
    let raw = raw_fixture("bracket_hex20");
    let with = |reference| {
        let nodes = raw.data.interfaces[0].nodes.clone();
        let set = NodeSet { coupling: Some(Coupling::Rigid), reference, ..NodeSet::new("bolt", nodes) };
        told(raw.clone().with(|data| data.interfaces = vec![set]))
    };
    assert_eq!(with(Reference::Centre), []);
    assert_eq!(with(Reference::Point([300.0, 0.0, 0.0])), [Code::InterfaceFar]);
}

#[test]
fn the_figures_do_not_depend_on_threads() {
    let raw = raw_fixture("connecting_rod");
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| facts(raw.clone()))
    };
    assert_eq!(with(1), with(3));
}
