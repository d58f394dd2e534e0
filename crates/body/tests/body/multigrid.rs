//! Modes without a factor: equal to those with a factor within the accuracy `fast`, or computed by a factor
//! after all.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;
use flexbody_body::basis::ModeSettings;
use flexbody_body::convert::{Conversion, ConvertSettings, convert};
use flexbody_body::invariants::error_norms;
use flexbody_eigen::{Accuracy, FactorChoice, Method, Plan, Precision, Wanted, Way};
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, check};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;
use oracle::plane::rectangle;

const DOUBLE: FactorChoice = FactorChoice::Always(Precision::Double);

fn run(model: &FeModel, count: usize, factor: FactorChoice) -> Result<Conversion> {
    let modes = ModeSettings {
        wanted: Wanted::Lowest(count),
        accuracy: Accuracy::Fast,
        method: if factor == FactorChoice::Auto { Method::Auto } else { Method::Lanczos },
        factor,
        multigrid_pays: 0.0,
        ..ModeSettings::default()
    };
    convert(model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
}

fn steel(mesh: &Mesh) -> FeModel {
    check(mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model()).expect("a sound model").model
}

fn cube(kind: ElementKind, cells: i32) -> FeModel {
    steel(&Mesh::block(kind, [cells; 3], [0.1; 3]))
}

/// Returns the modes with a factor and without one.
fn both(name: &str, model: &FeModel, count: usize) -> [Conversion; 2] {
    let found = [DOUBLE, FactorChoice::Auto]
        .map(|factor| run(model, count, factor).unwrap_or_else(|e| panic!("{name}: {e}")));
    let (a, b) = (found[0].body.modes(), found[1].body.modes());
    assert_eq!(a.eigenvalue.len(), b.eigenvalue.len(), "{name}");
    for (j, (x, y)) in a.eigenvalue.iter().zip(&b.eigenvalue).enumerate() {
        // The eigenvalue error is the square of the residual, in the norm of the residual.
        assert!((x / y - 1.0).abs() < 1e-7, "{name}, mode {j}: {x} {y}");
    }
    for (j, (x, y)) in a.residual.iter().zip(&b.residual).enumerate() {
        // For slender bodies the rounding of K exceeds the tolerance in both ways.
        assert!(*y <= f64::max(1e-6, 2.0 * x), "{name}, mode {j}: K-residual {y:e}, by a factor {x:e}");
    }
    for (what, error) in error_norms(found[0].body.invariants(), found[1].body.invariants()) {
        assert!(error < 1e-5, "{name}: {what} differs by {error:e}");
    }
    found
}

fn plan(found: &Conversion) -> &Plan {
    found.plan.as_ref().expect("no dense path")
}

fn way(found: &Conversion) -> Way {
    plan(found).current().way
}

/// Returns the messages about the factor.
fn said(found: &Conversion) -> Vec<&str> {
    let about = |d: &&Diagnostic| d.code() == Code::FactorPrecision;
    found.diagnostics.iter().filter(about).map(Diagnostic::message).collect()
}

#[test]
#[ignore = "slow"]
fn compact_bodies_of_every_element_have_the_modes_of_a_factor() {
    for (kind, cells) in
        [(ElementKind::Hex8, 12), (ElementKind::Tet4, 9), (ElementKind::Tet10, 5), (ElementKind::Hex20, 6)]
    {
        let name = format!("{kind:?}");
        let [_, found] = both(&name, &cube(kind, cells), 20);
        assert_eq!(way(&found), Way::Cycles, "{name}");
        assert!(said(&found)[0].contains("without a factor"), "{:?}", said(&found));
        let work = found.work;
        assert_eq!((work.factorizations, work.factor_bytes), (0, 0), "{name}");
        // Number of columns of cycles, and of products with K in double precision. Second-order elements need
        // more.
        let [most_solved, most_products] = match kind {
            ElementKind::Hex20 => [60, 20],
            ElementKind::Tet10 => [40, 15],
            _ => [22, 13],
        };
        assert!(work.solved_columns <= 20 * most_solved, "{name}: {work:?}");
        assert!(work.stiffness_columns <= 20 * most_products, "{name}: {work:?}");
    }
}

/// If the requested number of modes ends within a repeated eigenvalue, `fast` computes all of its modes and
/// keeps the same part.
#[test]
#[ignore = "slow"]
fn the_last_modes_of_a_cube_are_those_of_a_factor() {
    let model = cube(ElementKind::Hex8, 9);
    for count in 1..=24 {
        let [_, found] = both(&format!("{count} modes"), &model, count);
        assert_eq!(way(&found), Way::Cycles, "{count} modes");
    }
}

#[test]
#[ignore = "slow"]
fn plane_bodies_and_bodies_with_arms_have_them_too() {
    let plane = check(rectangle(60, 40, 0.7, [1.0, 2.0])).expect("a sound model").model;
    let [_, found] = both("rectangle", &plane, 12);
    assert_eq!(way(&found), Way::Cycles);
    let bracket = steel(&Mesh::bracket(ElementKind::Hex8, 14, 12, 0.01));
    let [_, found] = both("bracket", &bracket, 12);
    assert_eq!(way(&found), Way::Cycles);
}

/// Materials with stiffness contrasts of 1e4 and 1e8, and a nearly incompressible one: the modes equal those
/// of a factor in any way.
#[test]
#[ignore = "slow"]
fn contrasts_of_stiffness_and_of_volume_give_the_modes_of_a_factor() {
    let mesh = Mesh::block(ElementKind::Hex8, [10; 3], [0.1; 3]);
    for contrast in [1e4, 1e8] {
        let soft = Material { youngs: Material::STEEL.youngs / contrast, ..Material::STEEL };
        let stiff = mesh.part(|x| x[0] < 0.05).assemble(&Material::STEEL, MassRule::Consistent);
        let raw = stiff.plus(&mesh.part(|x| x[0] >= 0.05).assemble(&soft, MassRule::Consistent)).raw_model();
        both(&format!("contrast {contrast:e}"), &check(raw).expect("a sound model").model, 10);
    }
    let rubber = Material { poisson: 0.4999, ..Material::STEEL };
    let raw = mesh.assemble(&rubber, MassRule::Consistent).raw_model();
    both("nearly incompressible", &check(raw).expect("a sound model").model, 10);
}

#[test]
#[ignore = "slow"]
fn a_thin_plate_is_factored_after_all_with_a_note() {
    let plate = steel(&Mesh::block(ElementKind::Hex8, [40, 30, 1], [1.0, 0.7, 1e-3]));
    let [factored, found] = both("plate", &plate, 10);
    assert!(plan(&found).has_failed(Way::Cycles));
    assert!(said(&found)[0].starts_with("multigrid cycles did not converge"), "{:?}", said(&found));
    assert_eq!(factored.body.modes().eigenvalue, found.body.modes().eigenvalue, "the same search");
}

#[test]
fn mechanisms_are_refused_as_with_a_factor() {
    let hinge = steel(&Mesh::hinge(ElementKind::Hex8, 6));
    let [by_factor, without] =
        [DOUBLE, FactorChoice::Auto].map(|factor| run(&hinge, 8, factor).expect_err("a hinge"));
    assert_eq!(by_factor.diagnostics()[0].code(), without.diagnostics()[0].code());
}

#[test]
#[ignore = "slow"]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let model = cube(ElementKind::Hex8, 14);
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let found = pool.install(|| run(&model, 10, FactorChoice::Auto)).expect("modes");
        assert_eq!(way(&found), Way::Cycles);
        let shapes = &found.body.modes().shape;
        let entries =
            (0..shapes.ncols()).flat_map(|j| (0..shapes.nrows()).map(move |i| shapes[(i, j)].to_bits()));
        entries.collect::<Vec<u64>>()
    };
    let one = bits(1);
    assert!(one == bits(2) && one == bits(3));
}

/// Small bodies, guaranteed bounds and a requested factor exclude the cycles.
#[test]
#[ignore = "slow"]
fn a_factor_stays_where_it_is_cheaper_or_asked_for() {
    let model = cube(ElementKind::Hex8, 10);
    let with = |accuracy: Accuracy, multigrid_pays: f64| {
        let modes =
            ModeSettings { wanted: Wanted::Lowest(10), accuracy, multigrid_pays, ..ModeSettings::default() };
        way(&convert(&model, &ConvertSettings { modes, ..ConvertSettings::default() }, &Context::QUIET)
            .expect("modes"))
    };
    assert_eq!(with(Accuracy::Fast, ModeSettings::default().multigrid_pays), Way::DoublePrecision);
    assert_eq!(with(Accuracy::Certified, 0.0), Way::DoublePrecision);
    assert_eq!(with(Accuracy::Standard, 0.0), Way::Cycles);
    assert_eq!(with(Accuracy::Fast, 0.0), Way::Cycles);
}

/// Returns a compact block with thin bars on one of its faces, whose bending no coarse level represents.
fn whiskers(cells: i32, long: i32) -> FeModel {
    let size = 0.1 / f64::from(cells);
    let all = [cells, cells, cells + long];
    let mesh = Mesh::block(ElementKind::Hex8, all, all.map(|count| size * f64::from(count)));
    let is_bar = |x: f64| ((x / size) as i32) % 4 == 1;
    steel(&mesh.part(|[x, y, z]| z < 0.1 || (is_bar(x) && is_bar(y))))
}

/// Ineffective corrections are abandoned after two rounds at any accuracy: four rounds took longer than the
/// factor with all its columns.
#[test]
#[ignore = "slow"]
fn thin_bars_on_a_block_are_factored_before_many_cycles() {
    let model = whiskers(16, 30);
    for accuracy in [Accuracy::Fast, Accuracy::Standard] {
        let modes = ModeSettings {
            wanted: Wanted::Lowest(20),
            accuracy,
            multigrid_pays: 0.0,
            ..ModeSettings::default()
        };
        let settings = ConvertSettings { modes, ..ConvertSettings::default() };
        let found = convert(&model, &settings, &Context::QUIET).expect("modes");
        assert!(plan(&found).has_failed(Way::Cycles), "{accuracy:?}: {:?}", found.plan);
        assert!(found.work.solved_columns < 350, "{accuracy:?}: {:?}", found.work);
    }
}
