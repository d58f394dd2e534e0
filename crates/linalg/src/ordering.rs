//! Fill-reducing ordering and connectivity of the node graph.
//!
//! Nested dissection by METIS runs on the graph with one vertex per node: it gives the fill of the graph of degrees of
//! freedom in half the time, and a quarter of the factorisation work of minimum degree on compact solids.

use super::assembly_tree::Graph;
use super::parallel;
use super::{Pencil, SymmetricMatrix};
use std::sync::Mutex;

/// Lock for METIS, which has one random state per process: one call at a time keeps the ordering reproducible.
static METIS_LOCK: Mutex<()> = Mutex::new(());

/// Calls `take` with every neighbour of a vertex of `S` rows, ascending: the vertices that K or M couples to it. The
/// vertex has `H` rows of Ms.
fn neighbours<const S: usize, const H: usize>(pencil: &Pencil<'_>, vertex: u32, mut take: impl FnMut(u32)) {
    // Merge the sorted rows, without a list of visited vertices.
    let at = vertex as usize;
    let mut stiffness: [&[u32]; S] = std::array::from_fn(|b| pencil.stiffness().row(at * S + b).0);
    let mut mass: [&[u32]; H] = std::array::from_fn(|b| pencil.mass().row(at * H + b).0);
    let (rows, heavy) = (S as u32, H as u32);
    loop {
        let coupled = stiffness.iter().filter_map(|row| row.first()).min().map(|&column| column / rows);
        let light = mass.iter().filter_map(|row| row.first()).min().map(|&column| column / heavy);
        let Some(next) = coupled.into_iter().chain(light).min() else { return };
        stiffness.iter_mut().for_each(|row| skip(row, (next + 1) * rows));
        mass.iter_mut().for_each(|row| skip(row, (next + 1) * heavy));
        if next != vertex {
            take(next);
        }
    }
}

/// Skips the columns before `end`.
#[inline(always)]
fn skip(columns: &mut &[u32], end: u32) {
    while let Some((&column, after)) = columns.split_first()
        && column < end
    {
        *columns = after;
    }
}

/// Returns the graph of the nodes of a pencil: two are neighbours if K or M couples them. Returns `None` if it is too
/// large for the 32-bit indices of METIS.
///
/// # Panics
/// If a node does not have one, two or three rows.
pub(super) fn node_graph(pencil: &Pencil<'_>) -> Option<Graph> {
    vertex_graph(pencil, pencil.block())
}

/// Sizes of vertices that are tested for a pencil without nodes (a node with rotations, or parts of it), each with the
/// largest accepted ratio of the entries of the block graph, all rows of two neighbours taken as coupled, to those of
/// K. Rows with individual couplings are better as separate vertices. Three rows, however, are the displacements or the
/// rotations of a node, which elimination couples soon: frames along the axes have three times the entries, but less
/// work than with single rows, which take ten times as long to be ordered.
const NODE_SIZES: [(usize, f64); 3] = [(6, 1.6), (3, 4.0), (2, 1.6)];

/// Returns a graph whose vertices are nodes, also if the pencil has single rows, and the number of rows per vertex.
/// Consecutive rows with common couplings belong to a node. The graph of the rows of shells has 36 times the edges, and
/// ordering takes longer by the same factor. Returns `None` if the graph is too large for the 32-bit indices of METIS.
pub(super) fn smallest_graph(pencil: &Pencil<'_>) -> Option<(Graph, usize)> {
    if pencil.block() == 1 {
        let (n, entries) = (pencil.n(), pencil.stiffness().as_csc().nnz() as f64);
        for (size, most) in NODE_SIZES.into_iter().filter(|(size, _)| n > 0 && n % size == 0) {
            let graph = vertex_graph(pencil, size)?;
            let coupled = (size * size * (graph.neighbours.len() + graph.len())) as f64;
            if coupled <= most * entries {
                return Some((graph, size));
            }
        }
    }
    Some((node_graph(pencil)?, pencil.block()))
}

/// Returns the graph with one vertex for every `size` rows; `None` if it is too large for the 32-bit indices of METIS.
pub(super) fn vertex_graph(pencil: &Pencil<'_>, size: usize) -> Option<Graph> {
    match (size, size / pencil.block()) {
        (1, 1) => graph::<1, 1>(pencil),
        (2, 1) => graph::<2, 1>(pencil),
        (3, 1) => graph::<3, 1>(pencil),
        (2, 2) => graph::<2, 2>(pencil),
        (3, 3) => graph::<3, 3>(pencil),
        (6, 6) => graph::<6, 6>(pencil),
        _ => panic!("vertices of {size} rows, nodes of {}", pencil.block()),
    }
}

fn graph<const S: usize, const H: usize>(pencil: &Pencil<'_>) -> Option<Graph> {
    /// Number of vertices per parallel task.
    const VERTICES_PER_TASK: usize = 1024;
    let vertices = pencil.n() / S;
    let mut pointers = vec![0i32; vertices + 1];
    parallel::for_each_mut(&mut pointers[1..], VERTICES_PER_TASK, |vertex, count| {
        neighbours::<S, H>(pencil, vertex as u32, |_| *count += 1);
    });
    for vertex in 0..vertices {
        pointers[vertex + 1] = pointers[vertex].checked_add(pointers[vertex + 1])?;
    }
    // Count first, then fill: each task writes the neighbours of its vertices.
    let mut lists = vec![0i32; pointers[vertices] as usize];
    let mut shares = Vec::with_capacity(vertices / VERTICES_PER_TASK + 1);
    let mut rest = lists.as_mut_slice();
    for first in (0..vertices).step_by(VERTICES_PER_TASK) {
        let end = (first + VERTICES_PER_TASK).min(vertices);
        let (share, after) = rest.split_at_mut((pointers[end] - pointers[first]) as usize);
        shares.push((first as u32..end as u32, share));
        rest = after;
    }
    parallel::for_each(shares, |(range, share)| {
        let mut places = share.iter_mut();
        for vertex in range {
            neighbours::<S, H>(pencil, vertex, |other| {
                *places.next().expect("as many neighbours as were counted") = other as i32;
            });
        }
    });
    Some(Graph { pointers, neighbours: lists })
}

/// Returns the elimination order of the vertices of a graph: entry i is eliminated as the i-th. Returns `None` if METIS
/// fails (out of memory). The graph is not changed; METIS requires mutable arrays.
pub(super) fn nested_dissection(graph: &mut Graph) -> Option<Vec<u32>> {
    let vertices = graph.len();
    if graph.neighbours.is_empty() || vertices < 3 {
        return Some((0..vertices as u32).collect());
    }
    let order = metis(&mut graph.pointers, &mut graph.neighbours)?;
    Some(order.into_iter().map(|vertex| vertex as u32).collect())
}

/// Largest imbalance of the halves of a graph, in thousandths: half the default of METIS. Measured on bars, cubes,
/// tetrahedra, plates, shells and frames of 50,000 to 200,000 rows: down to half the time, with factors equal to within
/// a hundredth.
const MAX_IMBALANCE_THOUSANDTHS: i32 = 100;

// The only call of the C library; the arrays outlive the call and have the lengths that its manual requires.
#[allow(unsafe_code)]
fn metis(pointers: &mut [i32], neighbours: &mut [i32]) -> Option<Vec<i32>> {
    let mut vertices = (pointers.len() - 1) as i32;
    let mut order = vec![0i32; pointers.len() - 1];
    let mut inverse = order.clone();
    let mut options = [0i32; metis_sys::METIS_NOPTIONS as usize];
    let _one_at_a_time = METIS_LOCK.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let status = unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
        options[metis_sys::moptions_et_METIS_OPTION_UFACTOR as usize] = MAX_IMBALANCE_THOUSANDTHS;
        metis_sys::METIS_NodeND(
            &mut vertices,
            pointers.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            std::ptr::null_mut(),
            options.as_mut_ptr(),
            order.as_mut_ptr(),
            inverse.as_mut_ptr(),
        )
    };
    (status == metis_sys::rstatus_et_METIS_OK).then_some(order)
}

/// Returns the connected component of every block of rows, numbered from 0 in the order of their first block. Any entry
/// of any of the matrices, which must be of one size, connects.
///
/// # Panics
/// If there is no matrix.
pub fn connected_components(matrices: &[&SymmetricMatrix], block: usize) -> Vec<usize> {
    let vertices = matrices[0].n() / block;
    let mut component = vec![usize::MAX; vertices];
    let mut count = 0;
    let mut stack = Vec::new();
    for first in 0..vertices {
        if component[first] != usize::MAX {
            continue;
        }
        component[first] = count;
        stack.push(first);
        while let Some(vertex) = stack.pop() {
            let rows = vertex * block..(vertex + 1) * block;
            for list in matrices.iter().flat_map(|matrix| rows.clone().map(|row| matrix.row(row).0)) {
                // Entries of one block are adjacent: look the block up once.
                let mut known = rows.clone();
                for &column in list {
                    if known.contains(&(column as usize)) {
                        continue;
                    }
                    let other = column as usize / block;
                    known = other * block..(other + 1) * block;
                    if component[other] == usize::MAX {
                        component[other] = count;
                        stack.push(other);
                    }
                }
            }
        }
        count += 1;
    }
    component
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Analysis, Cholesky, CscMatrix, Solve, is_positive_semidefinite};
    use faer::Mat;
    use std::collections::BTreeSet;

    /// Returns blocks of three rows, coupled through any one of their nine entries; the last two blocks are isolated.
    fn scattered(vertices: u32) -> (SymmetricMatrix, Vec<BTreeSet<i32>>) {
        let mut entries = Vec::new();
        let mut adjacent = vec![BTreeSet::new(); vertices as usize];
        for i in 0..3 * vertices {
            entries.push((i, i, 4.0));
        }
        for v in 0..vertices - 2 {
            for step in [1, 7, 300] {
                let w = v + step;
                if w < vertices - 2 {
                    let (r, c) = (3 * v + (v + step) % 3, 3 * w + v % 3);
                    entries.extend([(r, c, 1.0), (c, r, 1.0)]);
                    adjacent[v as usize].insert(w as i32);
                    adjacent[w as usize].insert(v as i32);
                }
            }
        }
        let n = 3 * vertices as usize;
        let matrix = SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric");
        (matrix, adjacent)
    }

    #[test]
    fn the_graph_has_one_vertex_per_block_and_every_neighbour_once() {
        let (matrix, mut adjacent) = scattered(2500);
        // The mass couples vertices 0 and 9, which K does not, and 0 and 1, which K does.
        let mut entries: Vec<(u32, u32, f64)> = (0..2500).map(|i| (i, i, 1.0)).collect();
        entries.extend([(0, 9, 0.1), (9, 0, 0.1), (0, 1, 0.1), (1, 0, 0.1)]);
        let mass = SymmetricMatrix::new(CscMatrix::from_triplets(2500, 2500, &entries)).expect("symmetric");
        adjacent[0].insert(9);
        adjacent[9].insert(0);
        let mut graph = node_graph(&Pencil::new(&matrix, &mass, 3)).expect("small");
        for (v, expected) in adjacent.iter().enumerate() {
            let list = &graph.neighbours[graph.pointers[v] as usize..graph.pointers[v + 1] as usize];
            assert!(list.iter().eq(expected), "vertex {v}");
        }
        let order = nested_dissection(&mut graph).expect("small");
        assert_eq!(order.iter().collect::<BTreeSet<_>>().len(), 2500);
    }

    /// Returns a matrix of nodes with six rows, all coupled to those of the neighbours along a chain and a loop;
    /// `holes` removes some couplings.
    fn of_six_rows(nodes: u32, holes: u32) -> SymmetricMatrix {
        let mut entries = Vec::new();
        for v in 0..nodes {
            for w in [v, v + 1, v + 11].into_iter().filter(|&w| w < nodes) {
                for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
                    if v == w || (i + j + v) % 6 >= holes {
                        let value = if v == w && i == j { 90.0 } else { f64::from(i + j + 1) / 9.0 };
                        entries.push((6 * v + i, 6 * w + j, value));
                        if v != w {
                            entries.push((6 * w + j, 6 * v + i, value));
                        }
                    }
                }
            }
        }
        let n = 6 * nodes as usize;
        SymmetricMatrix::new(CscMatrix::from_triplets(n, n, &entries)).expect("symmetric")
    }

    /// Six rows of a node become one vertex if they are coupled alike, three if they are not, and rows with individual
    /// couplings stay single. The solution is correct in all cases.
    #[test]
    fn nodes_are_found_among_rows() {
        let alone = scattered(60).0;
        for (k, expected) in
            [(of_six_rows(60, 0), 6), (of_six_rows(60, 1), 6), (of_six_rows(60, 5), 3), (alone, 1)]
        {
            let n = k.n();
            let m = of_six_rows(n as u32 / 6, 4);
            let pencil = Pencil::new(&k, &m, 1);
            let (graph, rows) = smallest_graph(&pencil).expect("small");
            assert_eq!((rows, graph.len()), (expected, n / expected));
            let analysis = Analysis::new(&pencil).expect("small");
            let factor = Cholesky::<f64>::new(&analysis, &pencil, 0.37).expect("definite");
            let b = Mat::from_fn(n, 3, |i, j| ((i * 7 + j * 5) % 13) as f64 - 6.0);
            let mut x = b.clone();
            factor.solve_in_place(x.as_mut());
            let product =
                pencil.apply_stiffness(x.as_ref()) + pencil.apply_mass(x.as_ref()) * faer::Scale(0.37);
            assert!((&product - &b).norm_max() < 1e-12, "{expected}");
            assert!(is_positive_semidefinite(&pencil, &analysis), "{expected}");
        }
    }

    #[test]
    fn components_are_numbered_in_the_order_of_their_first_block() {
        let (matrix, _) = scattered(500);
        let component = connected_components(&[&matrix], 3);
        assert!(component[..498].iter().all(|&c| c == 0));
        assert_eq!(component[498..], [1, 2]);
        let tie = [(3 * 499, 4, 1e-300), (4, 3 * 499, 1e-300)];
        let other = SymmetricMatrix::new(CscMatrix::from_triplets(1500, 1500, &tie)).expect("symmetric");
        assert_eq!(connected_components(&[&matrix, &other], 3)[498..], [1, 0]);
    }
}
