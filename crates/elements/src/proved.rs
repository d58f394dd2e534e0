//! Elements that the stiffness matrix proves: stress stiffness and stresses.

use crate::places::Places;
use crate::stress::extrapolated;
use crate::{DescribedElements, ElementGroup, Formulation};
use faer::{Mat, MatRef};
use flexbody_linalg::{CscMatrix, SymmetricMatrix, parallel};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// Elements of a parallel task.
const ELEMENTS_PER_TASK: usize = 64;

/// Elements whose matrices are in memory at a time.
const ELEMENTS_AT_ONCE: usize = 1024;

/// Places with stresses of a parallel task.
const PLACES_PER_TASK: usize = 16;

/// Nodes of a parallel task.
const NODES_PER_TASK: usize = 1024;

/// Elements whose assembled stiffness is the stiffness of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ProvedElements {
    described: DescribedElements,
    /// Formulation of each group.
    formulations: Vec<Formulation>,
    places: Places,
    /// Number of rows of the stiffness.
    rows: usize,
    /// Elements with their nodes in `places`, those of the groups one after the other.
    members: Vec<Member>,
    /// Nodes that share an element with each node, ascending, as columns of a matrix.
    neighbours: Neighbours,
}

/// Operator of stresses at nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalStresses<'a> {
    /// Node and material of each place, ascending. A node at which materials meet has one place for each.
    pub places: Vec<(i64, &'a str)>,
    /// R' by the rows of the stiffness: the columns of each place are its stresses xx, yy, zz, xy, yz, xz.
    pub transposed: CscMatrix,
}

/// Element of a group, with its nodes in `Places`: those of the deck, then those inside.
#[derive(Debug, Clone, PartialEq)]
struct Member {
    group: u32,
    nodes: Vec<u32>,
}

/// Stress stiffness of an element.
struct ElementStiffness {
    /// Places of its entries, row by row, among those of the matrix of all nodes.
    places: Vec<usize>,
    /// Entries for each column of displacements.
    matrices: Vec<Vec<f64>>,
}

/// Pattern of a symmetric matrix with one row per node.
#[derive(Debug, Clone, PartialEq)]
struct Neighbours {
    pointers: Vec<usize>,
    nodes: Vec<u32>,
}

impl ProvedElements {
    pub(crate) fn new(
        described: DescribedElements,
        formulations: Vec<Formulation>,
        places: Places,
        rows: usize,
    ) -> Self {
        let mut members = Vec::new();
        for (group, of) in described.groups.iter().enumerate() {
            members.extend(of.elements().map(|(_, nodes, inside)| Member {
                group: group as u32,
                nodes: nodes.iter().chain(inside).map(|node| places.index(*node) as u32).collect(),
            }));
        }
        let neighbours = Neighbours::of(&members, places.nodes.len());
        Self { described, formulations, places, rows, members, neighbours }
    }

    /// Returns the groups of elements with their formulations.
    pub fn groups(&self) -> impl Iterator<Item = (&ElementGroup, Formulation)> {
        self.described.groups.iter().zip(self.formulations.iter().copied())
    }

    /// Returns the nodes of elements that are in the deck, ascending.
    pub fn deck_nodes(&self) -> &[i64] {
        &self.places.nodes[..self.places.positions.len()]
    }

    /// Returns the number of nodes of elements, those inside elements included.
    pub fn n_nodes(&self) -> usize {
        self.places.nodes.len()
    }

    /// Returns the displacements of the nodes of elements (3 x nodes rows, node by node) for displacements of all rows of the
    /// stiffness (N x c).
    ///
    /// # Panics
    /// If `x` has another number of rows than the stiffness.
    pub fn displacements(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(x.nrows(), self.rows, "rows of the stiffness");
        Mat::from_fn(3 * self.n_nodes(), x.ncols(), |at, column| {
            self.places.of_nodes[at / 3][at % 3].value(|row| x[(row, column)])
        })
    }

    /// Returns the stiffness g of the stress that each column of displacements causes, a matrix with one row per node of the
    /// elements: the stress stiffness is its Kronecker product with I3,
    ///
    /// g_ab = sum over points of w det J grad N_a' s grad N_b.
    ///
    /// All columns share the geometry of the elements; their matrices are in memory together.
    ///
    /// * `displacements`: of the nodes of elements, three rows for each.
    ///
    /// # Panics
    /// If the number of rows is not three for each node.
    pub fn stress_stiffness(&self, displacements: MatRef<'_, f64>) -> Vec<SymmetricMatrix> {
        assert_eq!(displacements.nrows(), 3 * self.n_nodes(), "three displacements per node");
        let mut values = vec![vec![0.0; self.neighbours.nodes.len()]; displacements.ncols()];
        for part in self.members.chunks(ELEMENTS_AT_ONCE) {
            let all = parallel::values(part.len(), ELEMENTS_PER_TASK, |at| {
                self.stiffness_of(&part[at], displacements)
            });
            // The order of the sums is that of the elements.
            for ElementStiffness { places, matrices } in all {
                for (values, matrix) in values.iter_mut().zip(matrices) {
                    places.iter().zip(matrix).for_each(|(place, value)| values[*place] += value);
                }
            }
        }
        let (n, Neighbours { pointers, nodes }) = (self.n_nodes(), &self.neighbours);
        let matrix = |values| CscMatrix::from_parts(n, n, pointers.clone(), nodes.clone(), values);
        values.into_iter().map(|values| SymmetricMatrix::symmetrised(matrix(values))).collect()
    }

    /// Returns the stress stiffness of an element for each column of displacements.
    fn stiffness_of(&self, member: &Member, displacements: MatRef<'_, f64>) -> ElementStiffness {
        let (formulation, group) = (self.formulations[member.group as usize], member.group as usize);
        let of_node =
            |node: &u32, c: usize| std::array::from_fn(|k| displacements[(3 * *node as usize + k, c)]);
        let moved: Vec<Vec<[f64; 3]>> = (0..displacements.ncols())
            .map(|c| member.nodes.iter().map(|node| of_node(node, c)).collect())
            .collect();
        let section = &self.described.groups[group].section;
        let matrices = formulation.stress_stiffness(&self.positions_of(member), &moved, section);
        let pairs =
            member.nodes.iter().flat_map(|row| member.nodes.iter().map(move |column| (*row, *column)));
        ElementStiffness {
            places: pairs.map(|(row, column)| self.neighbours.place(row, column)).collect(),
            matrices: matrices.expect("elements with a stiffness have stresses"),
        }
    }

    /// Returns the operator of stresses at nodes: for each node of `nodes`, and each material around it, the mean over its
    /// elements of this material of their stresses extrapolated to the node. Nodes of no element are left out.
    pub fn nodal_stresses(&self, nodes: &[i64]) -> NodalStresses<'_> {
        let mut around: BTreeMap<(i64, &str), Vec<(usize, usize)>> = BTreeMap::new();
        let wanted: HashSet<i64> = nodes.iter().copied().collect();
        for (at, member) in self.members.iter().enumerate() {
            let material = self.described.groups[member.group as usize].section.material.as_str();
            let count = self.formulations[member.group as usize].n_nodes();
            for (corner, node) in member.nodes[..count].iter().enumerate() {
                let node = self.places.nodes[*node as usize];
                if wanted.contains(&node) {
                    around.entry((node, material)).or_default().push((at, corner));
                }
            }
        }
        let places: Vec<(i64, &str)> = around.keys().copied().collect();
        let corners: Vec<Vec<(usize, usize)>> = around.into_values().collect();
        // The weights of the points at the nodes are those of the formulation.
        let weights: Vec<Vec<Vec<f64>>> =
            self.formulations.iter().map(|formulation| formulation.nodal_extrapolation()).collect();
        let blocks =
            parallel::values(corners.len(), PLACES_PER_TASK, |at| self.mean_stress(&corners[at], &weights));
        let entries = blocks.into_iter().enumerate().flat_map(|(at, block)| {
            let of_row = move |(row, values): (u32, [f64; 6])| {
                values.into_iter().enumerate().map(move |(k, value)| (row, (6 * at + k) as u32, value))
            };
            block.into_iter().flat_map(of_row)
        });
        let entries: Vec<(u32, u32, f64)> = entries.collect();
        let transposed = CscMatrix::from_triplets(self.rows, 6 * places.len(), &entries);
        NodalStresses { places, transposed }
    }

    /// Returns the mean stress of elements at their corners: six values for each row of the stiffness.
    ///
    /// * `weights`: of the points at the nodes, for each group.
    fn mean_stress(&self, corners: &[(usize, usize)], weights: &[Vec<Vec<f64>>]) -> BTreeMap<u32, [f64; 6]> {
        let mut sums: BTreeMap<u32, [f64; 6]> = BTreeMap::new();
        for &(at, corner) in corners {
            let member = &self.members[at];
            let formulation = self.formulations[member.group as usize];
            let section = &self.described.groups[member.group as usize].section;
            let rows = formulation.stress_rows(&self.positions_of(member), section);
            let rows = rows.expect("elements with a stiffness have stresses");
            let stresses = extrapolated(&rows, &weights[member.group as usize][corner]);
            for (column, place) in
                member.nodes.iter().flat_map(|node| &self.places.of_nodes[*node as usize]).enumerate()
            {
                let mean = |stress: &Vec<f64>| stress[column] / corners.len() as f64;
                place.for_each(|row, factor| {
                    let sum = sums.entry(row).or_default();
                    sum.iter_mut().zip(&stresses).for_each(|(sum, stress)| *sum += factor * mean(stress));
                });
            }
        }
        sums
    }

    fn positions_of(&self, member: &Member) -> Vec<[f64; 3]> {
        let count = self.formulations[member.group as usize].n_nodes();
        member.nodes[..count].iter().map(|node| self.places.positions[*node as usize]).collect()
    }
}

impl Neighbours {
    fn of(members: &[Member], count: usize) -> Self {
        let mut of_nodes: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (at, member) in members.iter().enumerate() {
            member.nodes.iter().for_each(|node| of_nodes[*node as usize].push(at as u32));
        }
        let lists = parallel::values(count, NODES_PER_TASK, |node| {
            let nodes = of_nodes[node].iter().flat_map(|at| &members[*at as usize].nodes);
            nodes.copied().collect::<BTreeSet<u32>>().into_iter().collect::<Vec<u32>>()
        });
        let mut pointers = vec![0];
        let mut nodes = Vec::new();
        for list in lists {
            nodes.extend(list);
            pointers.push(nodes.len());
        }
        Self { pointers, nodes }
    }

    /// Returns the place of an entry.
    fn place(&self, row: u32, column: u32) -> usize {
        let (from, to) = (self.pointers[row as usize], self.pointers[row as usize + 1]);
        from + self.nodes[from..to].binary_search(&column).expect("nodes of one element are neighbours")
    }
}
