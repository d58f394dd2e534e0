//! Recoveries of a model: operators by the rows of its files, shapes with answers, and sections.

use super::diagnostics::take;
use super::interfaces::NodeLookup;
use super::open_files::OpenFiles;
use super::recovery_files::{read_offset, read_operator};
use crate::fe_results::{AnswerFiles, read_answers};
use crate::matrices::operator::OperatorColumns;
use crate::model_files::{
    InterfaceNodes, InterfaceSource, MatrixLocation, ModelFiles, NodalStressSource, OperatorSource,
    RecoverySource, StressNodesSource,
};
use crate::tables::read_recovery_rows;
use flexbody_base::diagnostic::{Code, Diagnosed, Diagnostic};
use flexbody_linalg::CscMatrix;
use flexbody_model::{GivenRows, ModelRecovery, NodalStress, RecoveryOperator, Reference, StressNodes};
use std::borrow::Cow;

/// Returns the recoveries of the model; adds errors and warnings.
pub(super) fn recoveries(
    lookup: &NodeLookup<'_>,
    opened: &OpenFiles,
    files: &ModelFiles,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<ModelRecovery> {
    let mut read = Vec::with_capacity(files.recoveries.len());
    for one in &files.recoveries {
        if let Some((recovery, found)) = take(diagnostics, recovery(lookup, one, opened, files)) {
            diagnostics.extend(found);
            read.push(recovery);
        }
    }
    read
}

/// Returns the stresses at nodes that are asked for, with the numbers of their nodes; adds errors.
pub(super) fn nodal_stresses(
    lookup: &NodeLookup<'_>,
    opened: &OpenFiles,
    files: &ModelFiles,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<NodalStress> {
    let mut read = Vec::with_capacity(files.nodal_stresses.len());
    for NodalStressSource { name, nodes } in &files.nodal_stresses {
        let nodes = match nodes {
            StressNodesSource::All => StressNodes::All,
            StressNodesSource::Surface => StressNodes::Surface,
            StressNodesSource::Set(set) => {
                let (nodes, reference) = (InterfaceNodes::Set(set.clone()), Reference::Centre);
                let as_set = InterfaceSource { name: name.clone(), nodes, coupling: None, reference };
                let found = lookup.node_set(&format!("recovery `{name}`"), &as_set, opened, files);
                let Some(found) = take(diagnostics, found) else { continue };
                StressNodes::These(found.nodes)
            }
        };
        read.push(NodalStress {
            name: name.clone(),
            nodes,
            path: files.manifest.clone().unwrap_or_default(),
        });
    }
    read
}

/// Returns the transposed operator by the rows of the files.
///
/// # Errors
/// FB322 for labels that are no rows of the matrices, and for labelled rows of a model whose rows are combinations of
/// those of its files.
fn by_matrix_rows(
    lookup: &NodeLookup<'_>,
    given: OperatorColumns,
    location: &MatrixLocation,
    dimension: u8,
) -> Diagnosed<CscMatrix> {
    let refuse = |diagnostic: Diagnostic| vec![diagnostic.in_file(&location.path)];
    let labels = match (&given, lookup.matrices) {
        (OperatorColumns::Matrix(_), _) => Cow::Borrowed(&[][..]),
        (OperatorColumns::Labelled(..), Some(known)) if known.given_rows == GivenRows::default() => {
            known.plain(dimension).labels
        }
        (OperatorColumns::Labelled(..), Some(_)) => {
            let message =
                "DMIG operator names grids, but the rows of the model are combinations of those of its files";
            let help = "give the operator as a matrix with one column for each matrix row";
            return Err(refuse(Diagnostic::new(Code::RecoverySize, message).with_help(help)));
        }
        // The files of the model report why there are no rows.
        (OperatorColumns::Labelled(..), None) => return Err(Vec::new()),
    };
    given.by_rows(&labels).map_err(refuse)
}

/// Returns a recovery with an operator by the rows of the files, with shapes, or with the nodes of its cut; and
/// warnings about it.
fn recovery(
    lookup: &NodeLookup<'_>,
    source: &RecoverySource,
    opened: &OpenFiles,
    files: &ModelFiles,
) -> Diagnosed<(ModelRecovery, Vec<Diagnostic>)> {
    let (name, deformed_inertia) = (source.name.clone(), source.deformed_inertia);
    match &source.operator {
        OperatorSource::Rows { operator, rows, offset } => {
            let given = read_operator(opened.get(&operator.path)?, operator.group.as_deref())?;
            let transposed = by_matrix_rows(lookup, given, operator, files.dimension)?;
            let labels = read_recovery_rows(opened.get(rows)?)?;
            let offset = offset.as_ref();
            let offset = offset.map(|place| read_offset(opened.get(&place.path)?, place.group.as_deref()));
            let operator_path = operator.path.clone();
            let operator = RecoveryOperator::Rows { transposed, labels, offset: offset.transpose()? };
            Ok((ModelRecovery { name, operator, path: operator_path, deformed_inertia }, Vec::new()))
        }
        OperatorSource::Shapes { answers, displacements, energies, listed } => {
            let answer_files = AnswerFiles {
                answers: opened.unread(answers)?,
                displacements: opened.unread(displacements)?,
                energies: energies.as_ref().map(|path| opened.unread(path)).transpose()?,
                listed: listed.iter().map(|path| opened.unread(path)).collect::<Diagnosed<_>>()?,
            };
            let (operator, found) = read_answers(&answer_files, &files.description.units)?;
            Ok((ModelRecovery { name, operator, path: answers.clone(), deformed_inertia }, found))
        }
        OperatorSource::Cut { nodes, about } => {
            let (coupling, reference) = (None, Reference::Centre);
            let as_set = InterfaceSource { name: name.clone(), nodes: nodes.clone(), coupling, reference };
            let nodes = lookup.node_set(&format!("recovery `{name}`"), &as_set, opened, files)?.nodes;
            let path = match &as_set.nodes {
                InterfaceNodes::File(path) => path.clone(),
                _ => files.manifest.clone().unwrap_or_default(),
            };
            let operator = RecoveryOperator::Cut { nodes, about: about.unwrap_or_default() };
            let assumed = about.is_none().then(|| {
                let message =
                    format!("recovery `{name}`: moments of the section are about the origin of the model");
                Diagnostic::new(Code::SectionAbout, message).in_file(&path)
            });
            Ok((ModelRecovery { name, operator, path, deformed_inertia }, assumed.into_iter().collect()))
        }
    }
}
