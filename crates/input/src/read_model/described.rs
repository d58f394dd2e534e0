//! Elements that the manifest names: those of decks and meshes.

use super::model_matrices::JobFileRead;
use super::open_files::OpenFiles;
use crate::element_source::ElementSource;
use crate::jobs::{describe_deck, is_described_by_deck};
use crate::node_file::NodeFile;
use crate::node_files::read_node_file;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::text::InputFile;
use flexbody_elements::{Axes, DescribedElements, Elasticity, ElementGroup, Section};
use flexbody_model::DofLabel;
use std::collections::{BTreeMap, HashMap, HashSet};

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
/// FB101 to FB111 for files that cannot be read; FB116 for unknown sets; FB201 for meshes without a stated elasticity.
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
    all.equations.extend(more.equations.into_iter().filter(|one| !known.contains(&one.dependent)));
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
    if described.groups.is_empty() {
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
    let mut groups = BTreeMap::new();
    let mut described = DescribedElements::default();
    for ((shape, nodes), id) in mesh.elements.iter().zip(1..) {
        if !shape.is_solid() || !is_meant(nodes) || !nodes.iter().all(|node| places.contains_key(node)) {
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
        group.nodes.extend(nodes);
    }
    described.groups = groups.into_values().collect();
    described
}
