//! Modes from lumped masses: arbitrary figures are marked as such.

use flexbody_body::convert::{ConvertSettings, LumpedPipeline, Lumping, convert};
use flexbody_eigen::Wanted;
use flexbody_linalg::context::Context;
use flexbody_model::{FeModel, check};
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::mesh::Mesh;

/// Returns a bar whose bending modes come in pairs of equal frequencies.
fn square_bar() -> FeModel {
    let mesh = Mesh::block(ElementKind::Hex8, [6, 2, 2], [0.6, 0.1, 0.1]);
    check(mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model()).expect("a sound body").model
}

fn pipeline(model: &FeModel, lumping: Lumping, count: usize) -> (LumpedPipeline, Vec<f64>) {
    let mut settings =
        ConvertSettings { lumped: vec![lumping], lumped_modes: true, ..ConvertSettings::default() };
    settings.modes.wanted = Wanted::Lowest(count);
    let mut made = convert(model, &settings, &Context::QUIET).expect("converts");
    (made.lumped_modes.remove(0), made.body.modes().eigenvalue.clone())
}

#[test]
fn a_count_that_cuts_a_pair_of_equal_frequencies_is_named() {
    let model = square_bar();
    let (_, lambda) = pipeline(&model, Lumping::RowSum, 8);
    assert!((lambda[1] - lambda[0]) / lambda[0] < 1e-9, "the first two are a pair: {lambda:?}");
    for count in 1..8 {
        let cut = (lambda[count] - lambda[count - 1]) / lambda[count] < 1e-6;
        let (found, _) = pipeline(&model, Lumping::RowSum, count);
        assert!(found.remark.is_empty());
        let said = found
            .caution
            .contains(&format!("{count} modes divide a group of equal frequencies of the model"));
        assert_eq!(said, cut, "{count} modes: {}", found.caution);
        assert_eq!(found.caution.contains("of the lumped mass"), cut, "{count} modes: {}", found.caution);
        // Six modes differ in one: the lumped mass changes the order of the next two.
        let disjoint = found.subspace_cosine < 0.5f64.sqrt();
        assert_eq!(found.caution.is_empty(), !cut && !disjoint, "{count} modes: {}", found.caution);
    }
}

/// With nearly all mass at one end the lowest modes of the lumped mass are different ones.
#[test]
fn subspaces_with_little_in_common_are_named() {
    let model = square_bar();
    let positions = &model.nodes().positions;
    let mass = |x: f64| if x < 0.05 { 1.0 } else { 1e-4 };
    let table = model.nodes().ids.iter().zip(positions).map(|(&id, x)| (id, mass(x[0]))).collect();
    let (found, _) = pipeline(&model, Lumping::User(table), 2);
    assert!(found.subspace_cosine < 0.7, "{}", found.subspace_cosine);
    assert!(found.caution.contains("the subspaces differ by"), "{}", found.caution);
    assert!(found.caution.contains("degrees: other modes are among the lowest 2"), "{}", found.caution);
}
