//! Groups of neighbouring nodes, each of which becomes one node of the next coarser level (Vanek, Mandel and Brezina,
//! Computing 56 (1996) 179, section 5.1).

/// Marks a node without a group.
const UNASSIGNED: u32 = u32::MAX;

/// Strongly coupled neighbours of each node, without the node itself, with the strength of the coupling.
pub(super) struct Strong {
    pointers: Vec<usize>,
    neighbours: Vec<(u32, f32)>,
}

impl Strong {
    pub(super) fn from_rows(rows: Vec<Vec<(u32, f32)>>) -> Self {
        let mut pointers = vec![0];
        for row in &rows {
            pointers.push(pointers[pointers.len() - 1] + row.len());
        }
        Self { pointers, neighbours: rows.into_iter().flatten().collect() }
    }

    fn around(&self, node: usize) -> &[(u32, f32)] {
        &self.neighbours[self.pointers[node]..self.pointers[node + 1]]
    }
}

/// Returns the group of each node, and the number of groups. A node whose neighbours are all free forms a group with
/// them. Other nodes join the neighbouring group with the strongest coupling. Nodes that touch no group form their own.
pub(super) fn aggregates(strong: &Strong) -> (Vec<u32>, usize) {
    let n = strong.pointers.len() - 1;
    let (mut group, mut count) = (vec![UNASSIGNED; n], 0u32);
    // Groups of a node and its free neighbours.
    for node in 0..n {
        let around = strong.around(node);
        let all_free = || around.iter().all(|&(other, _)| group[other as usize] == UNASSIGNED);
        if group[node] == UNASSIGNED && !around.is_empty() && all_free() {
            group[node] = count;
            around.iter().for_each(|&(other, _)| group[other as usize] = count);
            count += 1;
        }
    }
    // Remaining nodes join the group of their strongest neighbour.
    let first = group.clone();
    for (node, assigned) in group.iter_mut().enumerate().filter(|(_, assigned)| **assigned == UNASSIGNED) {
        let grouped = strong.around(node).iter().filter(|(other, _)| first[*other as usize] != UNASSIGNED);
        if let Some(&(other, _)) = grouped.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))) {
            *assigned = first[other as usize];
        }
    }
    // Nodes without a neighbouring group form new groups.
    for node in 0..n {
        if group[node] == UNASSIGNED {
            group[node] = count;
            for &(other, _) in strong.around(node) {
                if group[other as usize] == UNASSIGNED {
                    group[other as usize] = count;
                }
            }
            count += 1;
        }
    }
    (group, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_of_a_chain_has_a_group_of_neighbours() {
        let n = 20u32;
        let row = |k: u32| {
            let others = [k.checked_sub(1), (k + 1 < n).then_some(k + 1)];
            others.into_iter().flatten().map(|other| (other, 1.0)).collect()
        };
        let (group, count) = aggregates(&Strong::from_rows((0..n).map(row).collect()));
        assert!(group.is_sorted() && group.iter().all(|assigned| (*assigned as usize) < count), "{group:?}");
        let sizes =
            (0..count as u32).map(|assigned| group.iter().filter(|other| **other == assigned).count());
        assert!(sizes.clone().all(|size| (2..=4).contains(&size)), "{group:?}");
    }

    #[test]
    fn a_node_that_is_coupled_to_nothing_is_a_group() {
        let strong = Strong::from_rows(vec![vec![(1, 1.0)], vec![(0, 1.0)], vec![]]);
        assert_eq!(aggregates(&strong), (vec![0, 0, 1], 2));
    }
}
