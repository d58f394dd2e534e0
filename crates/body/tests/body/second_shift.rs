//! A search for many modes continues at a second shift among them: the modes equal those of dense algebra,
//! for easy and hard bodies, with equal bits on any number of threads.

use flexbody_body::basis::{ModalBasis, ModeSettings, free_surface};
use flexbody_eigen::{Accuracy, Method, Wanted, Way};
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::context::Context;
use flexbody_linalg::gram;
use flexbody_model::{FeModel, check};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::{Assembly, Mesh};

fn fixture(name: &str) -> FeModel {
    let manifest = oracle::fixtures().join("models").join(name).join("model.toml");
    let raw = read_model(&read_manifest(&manifest).expect("a manifest")).expect("readable files");
    FeModel::from_raw(raw).expect("a sound model").model
}

fn modes(model: &FeModel, method: Method, accuracy: Accuracy) -> ModalBasis {
    let settings = ModeSettings { wanted: Wanted::Lowest(60), accuracy, method, ..ModeSettings::default() };
    free_surface(model, &settings, &Context::QUIET).expect("modes")
}

/// Returns the modes of a search that tried a second shift; for hard bodies it may fail.
fn with_second_shift(model: &FeModel, accuracy: Accuracy) -> ModalBasis {
    let found = modes(model, Method::Lanczos, accuracy);
    let plan = found.solution.plan.as_ref().expect("no dense path");
    assert_eq!(plan.attempts[0].way, Way::SecondShift, "{plan:?}");
    found
}

fn checked(assembly: &Assembly) -> FeModel {
    check(assembly.raw_model()).expect("a sound model").model
}

fn block(cells: [i32; 3], lengths: [f64; 3], material: Material) -> FeModel {
    checked(&Mesh::block(ElementKind::Hex8, cells, lengths).assemble(&material, MassRule::Consistent))
}

/// Returns quadratic tetrahedra with a singular mass matrix.
fn singular_mass() -> FeModel {
    checked(
        &Mesh::block(ElementKind::Tet10, [5, 2, 2], [1.0, 0.42, 0.4])
            .assemble(&Material::STEEL, MassRule::Reduced),
    )
}

/// Returns a block whose left half is 10^8 times as stiff as the right.
fn contrast() -> FeModel {
    let mesh = Mesh::block(ElementKind::Hex8, [12, 5, 4], [1.2, 0.5, 0.41]);
    let half = |left: bool, youngs: f64| {
        let kept = move |x: [f64; 3]| (x[0] < 0.6) == left;
        mesh.part(kept).assemble(&Material { youngs, ..Material::STEEL }, MassRule::Consistent)
    };
    checked(&half(true, 2e11).plus(&half(false, 2e3)))
}

/// Returns easy and hard models.
fn models() -> Vec<(String, FeModel)> {
    let steel = Material::STEEL;
    let own = ["cube_hex8", "bracket_hex20", "shell_folded", "frame_beams", "hex8_bubbles"];
    let others = [
        ("thin plate", block([14, 11, 1], [1.0, 0.7, 0.001], steel)),
        ("needle", block([60, 1, 1], [1.0, 0.004, 0.003], steel)),
        ("contrast", contrast()),
        ("nearly incompressible", block([9, 5, 4], [0.9, 0.5, 0.41], Material { poisson: 0.49999, ..steel })),
        ("tetrahedra of the second order", singular_mass()),
        ("cube", block([7, 7, 7], [1.0, 1.0, 1.0], steel)),
    ];
    let own = own.map(|name| (name.to_owned(), fixture(name)));
    own.into_iter().chain(others.map(|(name, model)| (name.to_owned(), model))).collect()
}

/// Returns the largest relative difference of an eigenvalue, and of the square of a mode in the span of the
/// others, allowed between two searches. (Rounding of the stiffness of the slender body is 1e-9 of the energy
/// of its first mode.)
fn same(accuracy: Accuracy) -> (f64, f64) {
    if accuracy == Accuracy::Fast { (1e-8, 1e-5) } else { (1e-9, 1e-9) }
}

#[test]
#[ignore = "slow"]
fn modes_with_a_second_shift_are_those_of_dense_algebra() {
    for (name, model) in models() {
        let dense = modes(&model, Method::Dense, Accuracy::Standard).solution;
        for accuracy in [Accuracy::Standard, Accuracy::Fast] {
            let own = with_second_shift(&model, accuracy).solution;
            let (same_value, same_span) = same(accuracy);
            assert_eq!(own.eigenvalues.len(), dense.eigenvalues.len(), "{name}");
            for (j, (own, dense)) in own.eigenvalues.iter().zip(&dense.eigenvalues).enumerate() {
                assert!(
                    (own / dense - 1.0).abs() < same_value,
                    "{name}, {accuracy:?}, mode {j}: {own:e} {dense:e}"
                );
            }
            // The modes are M-orthonormal and span the same space: all singular values are one.
            let mass = model.pencil().apply_mass(own.vectors.as_ref());
            let identity = gram(own.vectors.as_ref(), mass.as_ref());
            let cosines = gram(dense.vectors.as_ref(), mass.as_ref());
            for j in 0..own.vectors.ncols() {
                let off =
                    (0..j).map(|i| identity[(i, j)].abs()).fold((identity[(j, j)] - 1.0).abs(), f64::max);
                assert!(off < 1e-9, "{name}, {accuracy:?}, mode {j}: off by {off:e}");
                let square: f64 = cosines.col(j).iter().map(|c| c * c).sum();
                assert!((square - 1.0).abs() < same_span, "{name}, {accuracy:?}, mode {j}: cosine {square}");
            }
        }
    }
}

#[test]
#[ignore = "slow"]
fn modes_with_a_second_shift_have_the_same_bits_on_any_number_of_threads() {
    for name in ["cube_hex8", "shell_folded"] {
        let model = fixture(name);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| with_second_shift(&model, Accuracy::Standard).solution)
        };
        let one = on(1);
        for threads in [2, 3] {
            let other = on(threads);
            assert_eq!(one.eigenvalues, other.eigenvalues, "{name}");
            assert!(one.vectors == other.vectors, "{name}: vectors differ");
        }
    }
}
