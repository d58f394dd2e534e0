//! Elements that the manifest names: those of decks and meshes.

use super::model_matrices::JobFileRead;
use super::open_files::OpenFiles;
use crate::bulk_cards::is_bulk_data;
use crate::element_source::ElementSource;
use crate::jobs::{describe_deck, elements_of_bulk, is_described_by_deck};
use crate::mesh::in_order_of_shape;
use crate::node_file::NodeFile;
use crate::node_files::read_node_file;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_elements::{Axes, DescribedElements, Elasticity, ElementGroup, NotDescribed, Section};
use flexbody_model::DofLabel;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

/// Number of bytes in which bulk data are recognised: comments may precede their first card.
const HEAD: usize = 1 << 20;

/// Type of the elements of a mesh whose type is not stated.
const UNSTATED_KIND: &str = "SOLID";

/// Name of a material that the manifest states.
const STATED_MATERIAL: &str = "stated";

/// Elements of the files of a model, and further files that were read for them.
#[derive(Default)]
pub(super) struct DescribedFiles {
    pub elements: Option<DescribedElements>,
    pub files: Vec<JobFileRead>,
}

/// Reads the elements of files. `labels` are those of the rows of K.
///
/// # Errors
/// FB101 to FB111 for files that cannot be read; FB220 for unknown sets; FB201 for meshes without a stated elasticity.
pub(super) fn described_of_files(
    sources: &[ElementSource],
    opened: &OpenFiles,
    labels: &[DofLabel],
) -> Diagnosed<DescribedFiles> {
    let mut all = DescribedFiles::default();
    for source in sources {
        let file = opened.get(&source.path)?;
        let described = if is_described_by_deck(file) {
            let (described, files) = describe_deck(source, labels)?;
            all.files.extend(files.into_iter().map(|file| ("elements", file)));
            described
        } else if source.elasticity.is_none() && source.set.is_none() && is_bulk_data(&file.first_bytes(HEAD))
        {
            elements_of_bulk(&source.path)?
        } else {
            of_mesh(file, source)?
        };
        match &mut all.elements {
            Some(others) => merge(others, described),
            None => all.elements = Some(described),
        }
    }
    Ok(all)
}

/// Adds elements of another file. Equations and springs of a deck that is named twice count once.
fn merge(all: &mut DescribedElements, more: DescribedElements) {
    all.groups.extend(more.groups);
    all.positions.extend(more.positions);
    let direct = more.direct.into_iter().filter(|one| !all.direct.contains(one)).collect::<Vec<_>>();
    all.direct.extend(direct);
    let known: HashSet<(i64, u8)> = all.equations.iter().map(|equation| equation.dependent).collect();
    all.equations.extend(more.equations.into_iter().filter(|equation| !known.contains(&equation.dependent)));
    let others = more.not_described.into_iter().filter(|one| !all.not_described.contains(one));
    let others = others.collect::<Vec<_>>();
    all.not_described.extend(others);
}

/// Reads the solid elements of a mesh with a stated elasticity.
fn of_mesh(file: &InputFile, source: &ElementSource) -> Diagnosed<DescribedElements> {
    let refuse = |code, message: String, help: &str| {
        vec![Diagnostic::new(code, message).in_file(file.path()).with_help(help)]
    };
    let Some(elasticity) = source.elasticity else {
        let message = "file has no materials".to_owned();
        let help = "state youngs_modulus and poisson_ratio, or elasticity, in [[elements]]";
        return Err(refuse(Code::ManifestSyntax, message, help));
    };
    let mesh = read_node_file(file, 3)?;
    let members = match &source.set {
        Some(name) => {
            let found = mesh.sets.find(name).ok_or_else(|| {
                let names: Vec<String> = mesh.sets.names().take(MAX_NAMED).collect();
                let message = format!("node set `{name}` is not in the file");
                refuse(Code::NodeSetUnknown, message, &format!("name one of its sets: {}", names.join(", ")))
            })?;
            let members = found.map_err(|diagnostic| vec![diagnostic])?;
            Some(members.into_iter().collect::<HashSet<i64>>())
        }
        None => None,
    };
    let kind = source.kind.as_deref().unwrap_or(UNSTATED_KIND);
    let described = solids(&mesh, members.as_ref(), kind, elasticity);
    if described.groups.is_empty() && described.not_described.is_empty() {
        let message = "file has no solid elements".to_owned();
        return Err(refuse(Code::DeckUnsupported, message, "name a mesh of solid elements, or another set"));
    }
    Ok(DescribedElements { path: file.path().to_path_buf(), ..described })
}

/// Number of sets that a message names.
const MAX_NAMED: usize = 6;

/// Returns the solid elements all of whose nodes are among `members`, numbered from 1 in the order of the file.
fn solids(
    mesh: &NodeFile,
    members: Option<&HashSet<i64>>,
    kind: &str,
    elasticity: Elasticity,
) -> DescribedElements {
    let section = Section { material: STATED_MATERIAL.to_owned(), elasticity, axes: Axes::Model };
    let places: HashMap<i64, [f64; 3]> =
        mesh.nodes.ids.iter().copied().zip(mesh.nodes.positions.iter().copied()).collect();
    let is_meant =
        |nodes: &[i64]| members.is_none_or(|members| nodes.iter().all(|node| members.contains(node)));
    let (mut groups, mut repeated) = (BTreeMap::new(), Vec::new());
    let mut described = DescribedElements::default();
    for ((shape, nodes), id) in mesh.elements.iter().zip(1..) {
        if !shape.is_solid() || !is_meant(nodes) || !nodes.iter().all(|node| places.contains_key(node)) {
            continue;
        }
        // Programs drop functions of such elements, each in its own way.
        if nodes.iter().collect::<HashSet<_>>().len() < nodes.len() {
            repeated.push(nodes);
            continue;
        }
        described.positions.extend(nodes.iter().map(|node| (*node, places[node])));
        let group = groups.entry((shape, nodes.len())).or_insert_with(|| ElementGroup {
            kind: kind.to_owned(),
            section: section.clone(),
            ids: Vec::new(),
            nodes: Vec::new(),
            internal: Vec::new(),
        });
        group.ids.push(id);
        // Types of Nastran have the middles of upright edges before those of the upper face.
        let is_of_nastran = ["CHEXA", "CPENTA"].contains(&kind);
        if is_of_nastran {
            group.nodes.extend(in_order_of_shape(shape, nodes));
        } else {
            group.nodes.extend(nodes);
        }
    }
    described.groups = groups.into_values().collect();
    if !repeated.is_empty() {
        let elements = if repeated.len() == 1 { "element" } else { "elements" };
        let what = format!("{} {elements} with repeated nodes", repeated.len());
        let nodes: BTreeSet<i64> = repeated.into_iter().flatten().copied().collect();
        let nodes = nodes.into_iter().collect();
        described.not_described.push(NotDescribed { what, line: None, nodes });
    }
    described
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ModelFiles, ModelSource, read_manifest, read_model};
    use std::fs;
    use std::path::{Path, PathBuf};

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(name)
    }

    /// Returns a source without a set, a type and an elasticity.
    fn source(path: PathBuf) -> ElementSource {
        ElementSource { path, set: None, kind: None, elasticity: None }
    }

    fn with(elements: Vec<ElementSource>) -> ModelFiles {
        let files = read_manifest(fixture("models/bar_c3d8r/model.toml")).expect("a manifest");
        ModelFiles { elements, ..files }
    }

    #[test]
    fn a_packed_deck_describes_the_elements_of_matrices_in_other_files() {
        let deck = fixture("models/bar_c3d8r/matrices.inp.gz");
        let model = read_model(&with(vec![source(deck.clone())])).expect("a model");
        let described = model.data.elements.expect("elements");
        let [group] = described.groups.as_slice() else { panic!("{:?}", described.groups) };
        assert_eq!((group.kind.as_str(), group.section.material.as_str()), ("C3D8R", "STEEL"));
        assert_eq!(group.nodes[..8], [1, 2, 13, 12, 45, 46, 57, 56]);
        assert_eq!(group.nodes.len(), 8 * group.ids.len());
        assert_eq!(described.positions.len(), model.nodes.len());
        assert!(described.not_described.is_empty() && described.equations.is_empty());
        let roles: Vec<&str> = model.data.sources.iter().map(|source| source.role.as_str()).collect();
        assert_eq!(roles, ["manifest", "stiffness", "mass", "nodes", "dofs", "elements"]);
        // A stated elasticity, type and set replace those of the deck.
        let soft = Elasticity::isotropic(1000.0, 0.2);
        let stated = ElementSource {
            set: Some("nall".to_owned()),
            kind: Some("C3D8".to_owned()),
            elasticity: soft,
            ..source(deck.clone())
        };
        let described = read_model(&with(vec![stated])).expect("a model").data.elements.expect("elements");
        assert_eq!(described.groups[0].kind, "C3D8");
        assert_eq!(Some(described.groups[0].section.elasticity), soft);
        assert_eq!(described.groups[0].ids.len(), group.ids.len());
        let unknown = ElementSource { set: Some("NONE".to_owned()), ..source(deck) };
        let refused = read_model(&with(vec![unknown])).expect_err("refused");
        assert!(refused.first_error().message().contains("no elements in the set `NONE`"), "{refused}");
    }

    #[test]
    fn a_job_describes_its_elements_when_they_are_requested() {
        let folder = tempfile::tempdir().expect("a folder");
        let brick = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT,TYPE=C3D4,ELSET=E\n5,1,2,3,4\n\
            *MATERIAL,NAME=M\n*ELASTIC\n1000.,.2\n*SOLID SECTION,ELSET=E,MATERIAL=M\n";
        let path = folder.path().join("job.inp");
        fs::write(&path, brick).expect("written");
        let write = |name: &str, text: String| fs::write(folder.path().join(name), text).expect("written");
        write("job.dof", (1..=4).flat_map(|node| (1..=3).map(move |k| format!("{node}.{k}\n"))).collect());
        for name in ["job.sti", "job.mas"] {
            write(name, (1..=12).map(|row| format!("{row} {row} 1.0\n")).collect());
        }
        let files = ModelFiles::from_job(&path, None, Vec::new(), None).expect("files");
        assert!(matches!(files.source, ModelSource::Job(_)));
        assert_eq!(read_model(&files).expect("a model").data.elements, None);
        let asked = ModelFiles { describe_elements: true, ..files.clone() };
        let described = read_model(&asked).expect("a model").data.elements.expect("elements");
        assert_eq!(described.groups[0].ids, [5]);
        assert_eq!(described.path, path);
    }

    #[test]
    fn a_mesh_needs_a_stated_elasticity() {
        let folder = tempfile::tempdir().expect("a folder");
        let mesh = folder.path().join("mesh.msh");
        let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"steel\"\n$EndPhysicalNames\n\
            $Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n\
            $Elements\n3\n1 2 2 0 1 1 2 3\n2 4 2 7 1 1 2 3 4\n3 4 2 0 2 2 3 4 5\n$EndElements\n";
        fs::write(&mesh, text).expect("written");
        let refused = read_model(&with(vec![source(mesh.clone())])).expect_err("refused");
        assert!(refused.first_error().message().contains("no materials"), "{refused}");
        let steel = ElementSource { elasticity: Elasticity::isotropic(210e3, 0.3), ..source(mesh) };
        let all = read_model(&with(vec![steel.clone()])).expect("a model").data.elements.expect("elements");
        assert_eq!((all.groups.len(), all.groups[0].kind.as_str()), (1, "SOLID"));
        assert_eq!(all.groups[0].nodes, [1, 2, 3, 4, 2, 3, 4, 5]);
        let wedge = fs::read_to_string(&steel.path).expect("read").replace("2 2 3 4 5", "2 2 2 4 5");
        let degenerate = ElementSource { path: folder.path().join("wedge.msh"), ..steel.clone() };
        fs::write(&degenerate.path, wedge).expect("written");
        let found = read_model(&with(vec![degenerate])).expect("a model").data.elements.expect("elements");
        assert_eq!(found.groups[0].ids, [2]);
        assert_eq!(
            (found.not_described[0].what.as_str(), &found.not_described[0].nodes[..]),
            ("1 element with repeated nodes", &[2, 4, 5][..])
        );
        let part = ElementSource { set: Some("steel".to_owned()), ..steel };
        let part = read_model(&with(vec![part])).expect("a model").data.elements.expect("elements");
        assert_eq!(part.groups[0].nodes, [1, 2, 3, 4]);
    }
}
