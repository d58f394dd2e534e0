//! Nodes of interfaces and of sides of cuts: listed, from tables, from sets of the model, or in a region.

use super::model_matrices::{ModelMatrices, moving};
use super::open_files::OpenFiles;
use crate::model_files::{InterfaceNodes, InterfaceSource, ModelFiles, ModelSource};
use crate::tables::read_node_list;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_base::error::{Error, Result};
use flexbody_model::{NodeSet, RawModel};
use std::collections::HashSet;

/// Node positions and sets of a model, for interfaces that refer to them.
pub(super) struct NodeLookup<'m> {
    pub matrices: Option<&'m ModelMatrices>,
    /// Nodes with stiffness or mass, if the rows are known.
    moving: Option<HashSet<i64>>,
}

impl<'m> NodeLookup<'m> {
    pub(super) fn of(matrices: Option<&'m ModelMatrices>, dimension: u8) -> Self {
        Self { matrices, moving: matrices.and_then(|matrices| matrices.moving(dimension)) }
    }

    /// Returns the nodes of an interface, as [`node_set`](Self::node_set).
    pub(super) fn interface(
        &self,
        interface: &InterfaceSource,
        opened: &OpenFiles,
        files: &ModelFiles,
    ) -> Diagnosed<NodeSet> {
        self.node_set(&format!("interface `{}`", interface.name), interface, opened, files)
    }

    /// Returns the nodes of an interface, or of one side of a cut. Regions and sets of a model that could not be read are empty; its
    /// files report the reason.
    ///
    /// * `owner`: entry of the manifest that messages name.
    pub(super) fn node_set(
        &self,
        owner: &str,
        interface: &InterfaceSource,
        opened: &OpenFiles,
        files: &ModelFiles,
    ) -> Diagnosed<NodeSet> {
        let mut outline = Vec::new();
        let nodes = match &interface.nodes {
            InterfaceNodes::Listed(nodes) => nodes.clone(),
            InterfaceNodes::File(path) => read_node_list(opened.get(path)?)?,
            InterfaceNodes::Set(name) => {
                let nodes = self.of_set(owner, name, files, &mut outline)?;
                self.refuse_empty(
                    owner,
                    nodes,
                    &format!("no node of the set `{name}` has degrees of freedom"),
                    files,
                )?
            }
            InterfaceNodes::Region(region) => {
                let all = self.matrices.iter().flat_map(|matrices| {
                    matrices.nodes.ids.iter().copied().zip(matrices.nodes.positions.iter().copied())
                });
                let all = all.filter(|(id, _)| self.moves(*id));
                let nodes = region.nodes(all.clone());
                let why = if nodes.is_empty() { region.empty(all) } else { String::new() };
                self.refuse_empty(owner, nodes, &why, files)?
            }
        };
        let (name, coupling, reference) = (interface.name.clone(), interface.coupling, interface.reference);
        Ok(NodeSet { name, nodes, coupling, reference, outline })
    }

    fn moves(&self, node: i64) -> bool {
        self.moving.as_ref().is_none_or(|moving| moving.contains(&node))
    }

    /// Returns the nodes of a set that have rows. `outline` receives all nodes of the set.
    fn of_set(
        &self,
        owner: &str,
        name: &str,
        files: &ModelFiles,
        outline: &mut Vec<i64>,
    ) -> Diagnosed<Vec<i64>> {
        let Some(matrices) = self.matrices else { return Ok(Vec::new()) };
        match matrices.sets.find(name) {
            Some(Ok(nodes)) => *outline = nodes,
            Some(Err(refused)) => return Err(vec![refused.about(owner)]),
            None => {
                let names: Vec<String> = matrices.sets.names().take(20).collect();
                let message = format!("{owner}: the model has no node set `{name}`");
                let help = if names.is_empty() {
                    "list the nodes, or give a region: the files of the model have no node sets".to_owned()
                } else {
                    format!("name one of the node sets: {}", names.join(", "))
                };
                let unknown = Diagnostic::new(Code::NodeSetUnknown, message);
                return Err(vec![said_in(files, unknown).with_help(help)]);
            }
        }
        Ok(outline.iter().copied().filter(|id| self.moves(*id)).collect())
    }

    fn refuse_empty(
        &self,
        owner: &str,
        nodes: Vec<i64>,
        why: &str,
        files: &ModelFiles,
    ) -> Diagnosed<Vec<i64>> {
        if nodes.is_empty() && self.matrices.is_some() {
            let message = format!("{owner}: {why}");
            return Err(vec![said_in(files, Diagnostic::new(Code::NodeSetUnknown, message))]);
        }
        Ok(nodes)
    }
}

fn said_in(files: &ModelFiles, diagnostic: Diagnostic) -> Diagnostic {
    match (&files.manifest, &files.source) {
        (Some(path), _) => diagnostic.in_file(path),
        (None, ModelSource::Job(job)) => diagnostic.in_file(&job.path),
        _ => diagnostic,
    }
}

/// Returns an interface of a model in memory: its nodes are listed, or lie in a region.
///
/// # Errors
/// FB220 for a region without nodes; FB801 for a set or a table, which a model in memory does not have.
pub fn interface_in_memory(interface: &InterfaceSource, raw: &RawModel) -> Result<NodeSet> {
    let about = |code: Code, what: &str| {
        Error::from(Diagnostic::new(code, format!("interface `{}`: {what}", interface.name)))
    };
    let nodes = match &interface.nodes {
        InterfaceNodes::Listed(nodes) => nodes.clone(),
        InterfaceNodes::Region(region) => {
            let matrices = [&raw.stiffness, &raw.mass];
            let moving = moving(matrices, &raw.nodes.ids, raw.dofs.as_deref(), raw.dimension);
            let moves = |id: i64| moving.as_ref().is_none_or(|moving| moving.contains(&id));
            let all = raw.nodes.ids.iter().copied().zip(raw.nodes.positions.iter().copied());
            let all = all.filter(|(id, _)| moves(*id));
            let nodes = region.nodes(all.clone());
            if nodes.is_empty() {
                return Err(about(Code::NodeSetUnknown, &region.empty(all)));
            }
            nodes
        }
        InterfaceNodes::File(_) | InterfaceNodes::Set(_) => {
            let what =
                "matrices in memory have neither node sets nor tables: list the nodes, or give a region";
            return Err(about(Code::Usage, what));
        }
    };
    let (name, coupling, reference) = (interface.name.clone(), interface.coupling, interface.reference);
    Ok(NodeSet { name, nodes, coupling, reference, outline: Vec::new() })
}
