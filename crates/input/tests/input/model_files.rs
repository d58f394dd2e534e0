//! Test models as files: any stored triangle and order of the matrices gives the same model.

use flexbody_base::units::UnitSystem;
use flexbody_input::{read_manifest, read_model};
use flexbody_linalg::CscMatrix;
use oracle::elements::{ElementKind, MassRule, Material};
use oracle::files::{DofOrder, Numbering, Triangle, reordered, write_model};
use oracle::mesh::{Mesh, entries};

/// Returns the nonzero entries: readers drop zeros, and sums of element matrices may cancel.
fn nonzeros(matrix: &CscMatrix) -> Vec<(u32, u32, f64)> {
    entries(matrix).filter(|(_, _, value)| *value != 0.0).collect()
}

#[test]
fn a_model_read_from_files_is_the_one_written() {
    let mesh = Mesh::bracket(ElementKind::Tet10, 3, 1, 0.1);
    let mut raw = mesh.assemble(&Material::STEEL, MassRule::Consistent).raw_model();
    raw.data.description.units = UnitSystem::parse("m", "kg", "s").expect("known units");
    for (order, numbering) in [
        (None, Numbering::Consecutive),
        (Some(DofOrder::NodeMajor), Numbering::Gaps(1)),
        (Some(DofOrder::ComponentMajor), Numbering::Consecutive),
        (Some(DofOrder::Shuffled(2)), Numbering::Gaps(3)),
    ] {
        let model = order.map_or_else(|| raw.clone(), |order| reordered(&raw, order, numbering));
        for triangle in [Triangle::Lower, Triangle::Upper, Triangle::General] {
            let folder = tempfile::tempdir().expect("a temporary folder");
            let manifest = write_model(folder.path(), &model, triangle);
            let read = read_model(&read_manifest(manifest).expect("manifest")).expect("a readable model");
            let what = format!("{order:?} {triangle:?}");
            assert!(
                nonzeros(&read.stiffness.matrix) == nonzeros(&model.stiffness.matrix),
                "{what}: stiffness"
            );
            assert!(nonzeros(&read.mass.matrix) == nonzeros(&model.mass.matrix), "{what}: mass");
            assert_eq!(read.nodes, model.nodes, "{what}");
            assert_eq!(read.dofs, model.dofs, "{what}");
            assert_eq!(read.data.description.units, model.data.description.units, "{what}");
            assert_eq!(read.data.description.name, model.data.description.name, "{what}");
        }
    }
}
