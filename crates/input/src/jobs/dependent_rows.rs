//! Directions of nodes that a constraint of the deck eliminated while the node has other rows: pins, hinges, sliders.
//!
//! Such a direction gets a row without mass again, whose displacement the constraint states: u_d = sum of w_i u_i. K gains
//!
//! ```text
//! c (u_d - sum w_i u_i)^2 / 2
//! ```
//!
//! Neither mass nor force acts on u_d, so that the spring c > 0 is never strained: every motion, frequency and static
//! response is that of the constrained model for any c. A rigid motion fulfils the constraint and leaves it free.

use super::job::JobModel;
use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_elements::{Equation, NodeDirection, NotDescribed};
use flexbody_linalg::CscMatrix;
use flexbody_model::{DependentRow, DofLabel};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Number of nodes that a message names.
const MAX_NAMED: usize = 5;

/// Number of equations that may follow one another.
const MAX_DEPTH: usize = 64;

/// Returns the job with a row for each direction of its nodes that follows others by `equations`, along the axes of the
/// model. Nodes without any row stay without.
pub(super) fn with_dependent_rows(job: JobModel, equations: &[Equation]) -> JobModel {
    let rows: HashMap<NodeDirection, u32> =
        job.dofs.iter().map(|label| (label.node, label.direction)).zip(0..).collect();
    let moving: BTreeSet<i64> = job.dofs.iter().map(|label| label.node).collect();
    let by_dependent: BTreeMap<NodeDirection, &Equation> = equations
        .iter()
        .filter(|equation| moving.contains(&equation.dependent.0) && !rows.contains_key(&equation.dependent))
        .map(|equation| (equation.dependent, equation))
        .collect();
    let all: HashMap<NodeDirection, &Equation> =
        equations.iter().map(|equation| (equation.dependent, equation)).collect();
    let dependent = |(&(node, direction), equation): (&NodeDirection, &&Equation)| {
        let terms = resolved(equation, &rows, &all, MAX_DEPTH)?;
        let leaders = terms.keys().map(|row| job.dofs[*row as usize]).collect();
        let terms = terms.into_iter().collect();
        Some(DependentRow { label: DofLabel { node, direction }, terms, leaders })
    };
    let dependent: Vec<DependentRow> = by_dependent.iter().filter_map(dependent).collect();
    if dependent.is_empty() { job } else { extended(job, dependent) }
}

/// Returns the sum of rows that an equation is; `None` if a term has neither a row nor an equation, or if nothing moves.
fn resolved(
    equation: &Equation,
    rows: &HashMap<NodeDirection, u32>,
    all: &HashMap<NodeDirection, &Equation>,
    depth: usize,
) -> Option<BTreeMap<u32, f64>> {
    let mut sum: BTreeMap<u32, f64> = BTreeMap::new();
    for (term, factor) in &equation.terms {
        match rows.get(term) {
            Some(row) => *sum.entry(*row).or_default() += factor,
            None => {
                let inner = resolved(all.get(term)?, rows, all, depth.checked_sub(1)?)?;
                inner.into_iter().for_each(|(row, weight)| *sum.entry(row).or_default() += factor * weight);
            }
        }
    }
    sum.retain(|_, weight| *weight != 0.0);
    (!sum.is_empty()).then_some(sum)
}

fn extended(mut job: JobModel, dependent: Vec<DependentRow>) -> JobModel {
    let n = job.dofs.len();
    let all = n + dependent.len();
    let (stiffness, mass) = (&job.stiffness.matrix, &job.mass.matrix);
    let mut springs: Vec<(u32, u32, f64)> = stiffness.triplets().collect();
    let diagonal: Vec<f64> = (0..n).map(|row| stiffness.get(row, row)).collect();
    for (at, row) in (n as u32..).zip(&dependent) {
        let size = spring(row, &diagonal, &job.dofs);
        let terms = || row.terms.iter().map(|(to, weight)| (*to, -weight)).chain([(at, 1.0)]);
        for (to, a) in terms() {
            springs.extend(terms().map(|(from, b)| (to, from, size * a * b)));
        }
    }
    let mass = CscMatrix::from_triplets(all, all, &mass.triplets().collect::<Vec<_>>());
    job.stiffness.matrix = CscMatrix::from_triplets(all, all, &springs);
    job.mass.matrix = mass;
    job.dofs.extend(dependent.iter().map(|row| row.label));
    job.followers = job.followers.map(|followers| followers.with_more_rows(dependent.len()));
    let nodes: Vec<i64> =
        dependent.iter().map(|row| row.label.node).collect::<BTreeSet<i64>>().into_iter().collect();
    let message = format!(
        "{} of the directions that follow others by constraints belong to nodes with other rows, and have rows without mass: nodes {}{}",
        dependent.len(),
        nodes.iter().take(MAX_NAMED).map(i64::to_string).collect::<Vec<_>>().join(", "),
        if nodes.len() > MAX_NAMED { " and others" } else { "" }
    );
    job.diagnostics.push(Diagnostic::new(Code::DeckConstrained, message).in_file(&job.stiffness.path));
    if let Some(described) = &mut job.described {
        let what = "constraints of some directions of nodes".to_owned();
        described.not_described.push(NotDescribed { what, line: None, nodes });
    }
    job.given_rows = job.given_rows.with_dependent(n, dependent);
    job
}

/// Returns the spring that holds a row: the largest stiffness of the rows of its kind (displacements, or rotations) that
/// it follows, less if their factors enlarge it. Entries of K then grow by a factor of about two, and lose one bit.
fn spring(row: &DependentRow, diagonal: &[f64], labels: &[DofLabel]) -> f64 {
    let turns = row.label.direction > 3;
    let largest = |of: &mut dyn Iterator<Item = usize>| of.fold(0.0f64, |most, at| most.max(diagonal[at]));
    let is_like = |at: &usize| (labels[*at].direction > 3) == turns;
    let terms = || row.terms.iter().map(|(at, weight)| (*at as usize, *weight));
    let of_terms = largest(&mut terms().map(|(at, _)| at).filter(is_like));
    let size = if of_terms > 0.0 { of_terms } else { largest(&mut (0..diagonal.len()).filter(is_like)) };
    let weight: f64 = terms().filter(|(at, _)| is_like(at)).map(|(_, weight)| weight * weight).sum();
    if size > 0.0 { size / weight.max(1.0) } else { 1.0 }
}
