//! Proof of elements: their assembled stiffness is the stiffness matrix of the model.

use crate::difference::Difference;
use crate::places::{Place, Places, Rows};
use crate::{DescribedElements, ElementGroup, Formulation, NodeDirection, ProvedElements};
use flexbody_linalg::{SymmetricMatrix, parallel};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Largest accepted difference of an entry of the stiffness, relative to the sum of the magnitudes of its row.
const MAX_DIFFERENCE: f64 = 1e-9;

/// Units in the last digit of the matrix that a rounded entry may deviate by.
const ROUNDED_UNITS: f64 = 2.0;

/// Elements whose matrices are in memory at a time.
const ELEMENTS_AT_ONCE: usize = 2048;

/// Elements of a parallel task.
const ELEMENTS_PER_TASK: usize = 32;

/// Nodes by which the formulation of a type of elements is found.
const PROBES: usize = 8;

/// Entries that are left by which elements are named.
const MAX_APART: usize = 4_000_000;

/// Part of the stiffness of an element whose entries differ, above which the element itself is named.
const NAMED_SHARE: f64 = 0.8;

/// Reason why elements are not proved.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The stiffness has parts that the description of the elements leaves out.
    NotDescribed(crate::NotDescribed),
    /// No formulation is known for a type of elements.
    UnknownType {
        /// Type, as the program names it.
        kind: String,
        /// Number of nodes of each element.
        nodes: usize,
        /// Number of elements.
        count: usize,
    },
    /// Elements are inverted, or the axes of their material are not defined.
    Degenerate {
        /// Type, as the program names it.
        kind: String,
        /// Numbers of the elements.
        ids: Vec<i64>,
    },
    /// Degrees of freedom of elements have neither a row in the stiffness nor an equation.
    WithoutRow(Vec<NodeDirection>),
    /// The stiffness of elements is not that in the matrix.
    Differs {
        /// Type, as the program names it.
        kind: String,
        /// Name of the material.
        material: String,
        /// Numbers of the elements.
        ids: Vec<i64>,
        /// Number of all elements with this type and section.
        of: usize,
        /// Formulation that is nearest to the matrix.
        formulation: &'static str,
        /// Largest difference of an entry, relative to the sum of the magnitudes of its row.
        largest: f64,
    },
    /// Entries of the stiffness are not those of the elements around them, and no element explains it.
    Unexplained {
        /// Number of entries.
        entries: usize,
        /// Degrees of freedom of the entry with the largest difference.
        at: [NodeDirection; 2],
        /// Largest difference, relative to the sum of the magnitudes of its row.
        largest: f64,
    },
}

/// Proves elements: finds the formulation of each type by which the sum of all elements, springs and constraints is the
/// stiffness, entry by entry.
///
/// * `stiffness`: K with the rows `labels`.
/// * `digits`: significant decimal digits of its values.
///
/// # Errors
/// Every reason why the elements are not proved.
pub fn prove(
    mut described: DescribedElements,
    stiffness: &SymmetricMatrix,
    labels: &[NodeDirection],
    digits: u8,
) -> Result<ProvedElements, Vec<Refusal>> {
    let mut refusals: Vec<Refusal> =
        described.not_described.iter().cloned().map(Refusal::NotDescribed).collect();
    refusals.extend(unknown_types(&described));
    if !refusals.is_empty() {
        return Err(refusals);
    }
    described.groups.iter_mut().for_each(order_nodes);
    let places = Places::of(&described, labels).map_err(|missing| vec![Refusal::WithoutRow(missing)])?;
    let allowed = MAX_DIFFERENCE.max(ROUNDED_UNITS * 10f64.powi(1 - i32::from(digits)));
    let whole = Whole { described: &described, places: &places, stiffness, labels };
    let formulations = whole.formulations();
    whole.compare(&formulations, allowed)?;
    let formulations = described.groups.iter().map(|group| formulations[&kind_of(group)]).collect();
    Ok(ProvedElements::new(described, formulations, places, labels.len()))
}

impl DescribedElements {
    /// Returns true if K may prove the elements: there are elements, all are of types with a known formulation, and the
    /// description leaves nothing out. No matrix is computed.
    pub fn may_be_proved(&self) -> bool {
        !self.groups.is_empty() && self.not_described.is_empty() && unknown_types(self).is_empty()
    }
}

/// Type and number of nodes of the elements of a group, which decide about their formulation.
type Kind<'g> = (&'g str, usize);

fn kind_of(group: &ElementGroup) -> Kind<'_> {
    (&group.kind, group.nodes.len() / group.ids.len().max(1))
}

/// Returns a refusal for each type without a formulation, or with another number of internal nodes.
fn unknown_types(described: &DescribedElements) -> Vec<Refusal> {
    let mut unknown: BTreeMap<Kind<'_>, usize> = BTreeMap::new();
    for group in described.groups.iter().filter(|group| candidates(group).is_empty()) {
        *unknown.entry(kind_of(group)).or_default() += group.ids.len();
    }
    let refusal = |((kind, nodes), count): (Kind<'_>, usize)| Refusal::UnknownType {
        kind: kind.to_owned(),
        nodes,
        count,
    };
    unknown.into_iter().map(refusal).collect()
}

/// Puts the nodes of the elements of a group into the order of the formulations.
fn order_nodes(group: &mut ElementGroup) {
    let (kind, count) = kind_of(group);
    let Some(order) = Formulation::node_order(kind, count) else { return };
    let ordered = |nodes: &[i64]| order.iter().map(|&at| nodes[at]).collect::<Vec<i64>>();
    group.nodes = group.nodes.chunks(count.max(1)).flat_map(ordered).collect();
}

/// Returns the formulations that elements of a group may have.
fn candidates(group: &ElementGroup) -> Vec<Formulation> {
    let (kind, nodes) = kind_of(group);
    let inside = group.internal.len() / group.ids.len().max(1);
    let all = Formulation::candidates(kind, nodes);
    all.into_iter().filter(|one| one.n_nodes() == nodes && one.n_internal() == inside).collect()
}

/// Elements, the places of their nodes, and the matrix that proves them.
struct Whole<'a> {
    described: &'a DescribedElements,
    places: &'a Places,
    stiffness: &'a SymmetricMatrix,
    labels: &'a [NodeDirection],
}

/// Element of a group by its index, with its nodes in `Places`.
struct Member<'a> {
    group: &'a ElementGroup,
    id: i64,
    nodes: Vec<usize>,
    positions: Vec<[f64; 3]>,
}

impl<'a> Whole<'a> {
    /// Returns the elements of a group.
    fn members(&self, group: &'a ElementGroup) -> impl Iterator<Item = Member<'a>> {
        group.elements().map(|(id, nodes, inside)| Member {
            group,
            id,
            nodes: nodes.iter().chain(inside).map(|node| self.places.index(*node)).collect(),
            positions: nodes.iter().map(|node| self.places.positions[self.places.index(*node)]).collect(),
        })
    }

    /// Returns the places of the degrees of freedom of an element, node by node.
    fn places_of(&self, member: &Member<'_>) -> Vec<&'a Place> {
        member.nodes.iter().flat_map(|&node| &self.places.of_nodes[node]).collect()
    }

    /// Returns the formulation of each type: the candidate that is nearest to the rows of nodes around which all elements have
    /// this type, else the first.
    fn formulations(&self) -> HashMap<Kind<'a>, Formulation> {
        let mut groups: BTreeMap<Kind<'a>, Vec<&'a ElementGroup>> = BTreeMap::new();
        for group in &self.described.groups {
            groups.entry(kind_of(group)).or_default().push(group);
        }
        let mut owners: Vec<Option<Kind<'a>>> = vec![None; self.places.nodes.len()];
        let mut is_shared = vec![false; owners.len()];
        for (kind, groups) in &groups {
            let nodes = groups.iter().flat_map(|group| group.nodes.iter().chain(&group.internal));
            for node in nodes.map(|node| self.places.index(*node)) {
                is_shared[node] |= owners[node].replace(*kind).is_some_and(|other| other != *kind);
            }
        }
        let is_pure = |kind: Kind<'a>, node: usize| {
            let plain = |place: &Place| matches!(place, Place::Row(_));
            owners[node] == Some(kind) && !is_shared[node] && self.places.of_nodes[node].iter().all(plain)
        };
        let chosen = groups.into_iter().map(|(kind, groups)| {
            let candidates = candidates(groups[0]);
            let [first, _, ..] = candidates[..] else { return (kind, candidates[0]) };
            let pure = (0..owners.len()).filter(|&node| is_pure(kind, node));
            let probes: BTreeSet<usize> = pure.take(PROBES).collect();
            let nearest = self.nearest(&candidates, &groups, &probes);
            (kind, nearest.unwrap_or(first))
        });
        chosen.collect()
    }

    /// Returns the candidate whose elements are nearest to the stiffness in the rows of the nodes `probes`.
    fn nearest(
        &self,
        candidates: &[Formulation],
        groups: &[&'a ElementGroup],
        probes: &BTreeSet<usize>,
    ) -> Option<Formulation> {
        let members: Vec<Member<'a>> = groups
            .iter()
            .flat_map(|group| self.members(group))
            .filter(|member| member.nodes.iter().any(|node| probes.contains(node)))
            .collect();
        let is_row_of_probe = |row: u32| {
            let own = |node: &usize| self.places.of_nodes[*node].contains(&Place::Row(row));
            probes.iter().any(own)
        };
        let mut nearest: Option<(f64, Formulation)> = None;
        for &formulation in candidates {
            let mut sums: BTreeMap<(u32, u32), f64> = BTreeMap::new();
            for member in &members {
                let Some(matrix) = formulation.stiffness(&member.positions, &member.group.section) else {
                    continue;
                };
                let places = self.places_of(member);
                for (a, place) in places.iter().enumerate() {
                    let Place::Row(row) = place else { continue };
                    if !is_row_of_probe(*row) {
                        continue;
                    }
                    for (b, other) in places.iter().enumerate() {
                        let value = matrix[a * places.len() + b];
                        other.for_each(|column, factor| {
                            *sums.entry((*row, column)).or_default() += factor * value
                        });
                    }
                }
            }
            let mut error = 0.0f64;
            for (&(row, column), sum) in &sums {
                error = error.max((sum - self.stiffness.as_csc().get(row as usize, column as usize)).abs());
            }
            if !sums.is_empty() && nearest.is_none_or(|(least, _)| error < least) {
                nearest = Some((error, formulation));
            }
        }
        nearest.map(|(_, formulation)| formulation)
    }

    /// Compares the sum of all elements with the stiffness.
    ///
    /// # Errors
    /// Elements that are degenerate, and those whose stiffness is not that in the matrix.
    fn compare(
        &self,
        formulations: &HashMap<Kind<'_>, Formulation>,
        allowed: f64,
    ) -> Result<(), Vec<Refusal>> {
        let mut difference = Difference::new(self.stiffness);
        let mut degenerate = Vec::new();
        // Elements, a part of them at a time.
        for group in &self.described.groups {
            let formulation = formulations[&kind_of(group)];
            let mut inverted = Vec::new();
            self.with_matrices(group, formulation, |member, matrix| match matrix {
                Some(matrix) => difference.subtract(&matrix, &self.places_of(member)),
                None => inverted.push(member.id),
            });
            if !inverted.is_empty() {
                degenerate.push(Refusal::Degenerate { kind: group.kind.clone(), ids: inverted });
            }
        }
        if !degenerate.is_empty() {
            return Err(degenerate);
        }
        // Springs.
        let rows = Rows::new(self.labels, &self.described.equations);
        for spring in &self.described.direct {
            let places: Option<Vec<Place>> = spring.rows.iter().map(|&at| rows.place(at)).collect();
            let Some(places) = places else { return Err(vec![Refusal::WithoutRow(spring.rows.clone())]) };
            difference.subtract(&spring.matrix, &places.iter().collect::<Vec<_>>());
        }
        // Entries that are left.
        let apart: HashMap<(u32, u32), f64> = difference
            .entries()
            .filter(|(.., share)| share.is_nan() || *share > allowed)
            .take(MAX_APART)
            .map(|(row, column, share)| ((row, column), share))
            .collect();
        if apart.is_empty() { Ok(()) } else { Err(self.named(formulations, &apart)) }
    }

    /// Calls `with` with each element of a group and its stiffness, in their order.
    fn with_matrices(
        &self,
        group: &'a ElementGroup,
        formulation: Formulation,
        mut with: impl FnMut(&Member<'a>, Option<Vec<f64>>),
    ) {
        let mut members = self.members(group).peekable();
        while members.peek().is_some() {
            let part: Vec<Member<'a>> = members.by_ref().take(ELEMENTS_AT_ONCE).collect();
            let stiffness = |at: usize| formulation.stiffness(&part[at].positions, &group.section);
            let matrices = parallel::values(part.len(), ELEMENTS_PER_TASK, stiffness);
            part.iter().zip(matrices).for_each(|(member, matrix)| with(member, matrix));
        }
    }

    /// Returns the elements that differ from the stiffness, by the entries that are left.
    fn named(
        &self,
        formulations: &HashMap<Kind<'_>, Formulation>,
        apart: &HashMap<(u32, u32), f64>,
    ) -> Vec<Refusal> {
        let touched: BTreeSet<u32> = apart.keys().flat_map(|&(row, column)| [row, column]).collect();
        let mut refusals = Vec::new();
        for group in &self.described.groups {
            let formulation = formulations[&kind_of(group)];
            let (mut ids, mut largest) = (Vec::new(), 0.0f64);
            self.with_matrices(group, formulation, |member, matrix| {
                let places = self.places_of(member);
                let is_touched =
                    places.iter().any(|place| matches!(place, Place::Row(row) if touched.contains(row)));
                if !is_touched {
                    return;
                }
                let Some(matrix) = matrix else { return };
                let (share, most) = share_apart(&matrix, &places, apart);
                if share > NAMED_SHARE {
                    ids.push(member.id);
                    largest = largest.max(most);
                }
            });
            if !ids.is_empty() {
                refusals.push(Refusal::Differs {
                    kind: group.kind.clone(),
                    material: group.section.material.clone(),
                    of: group.ids.len(),
                    ids,
                    formulation: formulation.name(),
                    largest,
                });
            }
        }
        if refusals.is_empty() {
            let mut worst = ((0, 0), 0.0);
            for (&at, &share) in apart {
                if share > worst.1 || (share == worst.1 && at < worst.0) || share.is_nan() {
                    worst = (at, share);
                }
            }
            let ((row, column), largest) = worst;
            let at = [row, column].map(|row| self.labels[row as usize]);
            refusals.push(Refusal::Unexplained { entries: apart.len(), at, largest });
        }
        refusals
    }
}

/// Returns the part of the stiffness between different degrees of freedom of an element whose entries are `apart`, and the
/// largest of their differences.
fn share_apart(matrix: &[f64], places: &[&Place], apart: &HashMap<(u32, u32), f64>) -> (f64, f64) {
    let (mut all, mut left, mut largest) = (0.0, 0.0, 0.0f64);
    for (a, place) in places.iter().enumerate() {
        for (b, other) in places.iter().enumerate().skip(a + 1) {
            let (Place::Row(row), Place::Row(column)) = (place, other) else { continue };
            let size = matrix[a * places.len() + b].abs();
            all += size;
            if let Some(share) = apart.get(&(*row.min(column), *row.max(column))) {
                left += size;
                largest = largest.max(*share);
            }
        }
    }
    (if all > 0.0 { left / all } else { 0.0 }, largest)
}
