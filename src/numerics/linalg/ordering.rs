//! Fill-reducing ordering and connectivity of the node graph.
//!
//! Nested dissection by METIS on the graph with one vertex per node: the same fill as on the graph of degrees
//! of freedom in half the time, and a quarter of the factorisation work of minimum degree on compact solids.

use super::assembly_tree::Graph;
use super::{Pencil, SymmetricMatrix};
use rayon::prelude::*;
use std::sync::Mutex;

/// METIS seeds and uses one random state per process: one call at a time keeps the ordering reproducible.
static METIS: Mutex<()> = Mutex::new(());

/// Calls `take` with every neighbour of a node, ascending: those that K or M couples it to.
fn neighbours(pencil: &Pencil<'_>, vertex: u32, mut take: impl FnMut(u32)) {
    let block = pencil.block() as u32;
    let row = |b: u32| pencil.stiffness().row((vertex * block + b) as usize).0;
    // Blocks of up to three rows are merged without a list of what has been met.
    let mut stiffness: [&[u32]; 3] =
        std::array::from_fn(|b| if (b as u32) < block { row(b as u32) } else { &[] });
    let mut mass = pencil.mass().row(vertex as usize).0;
    loop {
        let coupled = stiffness.iter().filter_map(|row| row.first()).min().map(|&column| column / block);
        let Some(next) = coupled.into_iter().chain(mass.first().copied()).min() else { return };
        for row in &mut stiffness {
            // At most `block` columns belong to one neighbour.
            while let Some((&column, after)) = row.split_first()
                && column < (next + 1) * block
            {
                *row = after;
            }
        }
        if mass.first() == Some(&next) {
            mass = &mass[1..];
        }
        if next != vertex {
            take(next);
        }
    }
}

/// Graph of the nodes of a pencil: two are neighbours where K or M couples them. `None` when it is too large
/// for the 32-bit numbers of the ordering library.
///
/// # Panics
/// When a node has not one, two or three rows.
pub(super) fn node_graph(pencil: &Pencil<'_>) -> Option<Graph> {
    /// Vertices per parallel task.
    const VERTICES: usize = 1024;
    assert!((1..=3).contains(&pencil.block()), "nodes of 1, 2 or 3 rows, not {}", pencil.block());
    let vertices = pencil.mass().n();
    let mut pointers = vec![0i32; vertices + 1];
    pointers[1..].par_iter_mut().with_min_len(VERTICES).enumerate().for_each(|(vertex, count)| {
        neighbours(pencil, vertex as u32, |_| *count += 1);
    });
    for vertex in 0..vertices {
        pointers[vertex + 1] = pointers[vertex].checked_add(pointers[vertex + 1])?;
    }
    let mut lists = vec![0i32; pointers[vertices] as usize];
    let mut shares = Vec::with_capacity(vertices / VERTICES + 1);
    let mut rest = lists.as_mut_slice();
    for first in (0..vertices).step_by(VERTICES) {
        let end = (first + VERTICES).min(vertices);
        let (share, after) = rest.split_at_mut((pointers[end] - pointers[first]) as usize);
        shares.push((first as u32..end as u32, share));
        rest = after;
    }
    shares.into_par_iter().for_each(|(range, share)| {
        let mut places = share.iter_mut();
        for vertex in range {
            neighbours(pencil, vertex, |other| {
                *places.next().expect("as many neighbours as were counted") = other as i32;
            });
        }
    });
    Some(Graph { pointers, neighbours: lists })
}

/// Elimination order of the vertices of a graph: entry i is eliminated as the i-th. `None` when the ordering
/// library fails (it runs out of memory). The graph is only borrowed mutably because the library asks for it.
pub(super) fn nested_dissection(graph: &mut Graph) -> Option<Vec<u32>> {
    let vertices = graph.len();
    if graph.neighbours.is_empty() || vertices < 3 {
        return Some((0..vertices as u32).collect());
    }
    let order = metis(&mut graph.pointers, &mut graph.neighbours)?;
    Some(order.into_iter().map(|vertex| vertex as u32).collect())
}

// The one call of the C library; the arrays outlive it and have the lengths its manual asks for.
#[allow(unsafe_code)]
fn metis(pointers: &mut [i32], neighbours: &mut [i32]) -> Option<Vec<i32>> {
    let mut vertices = (pointers.len() - 1) as i32;
    let mut order = vec![0i32; pointers.len() - 1];
    let mut inverse = order.clone();
    let mut options = [0i32; metis_sys::METIS_NOPTIONS as usize];
    let _one_at_a_time = METIS.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let status = unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
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

/// Connected component of every block of rows, numbered from 0 in the order of their first block. Any entry
/// of any of the matrices, all of one size, connects.
///
/// # Panics
/// When there is no matrix.
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
                // Entries of one block stand side by side: it is looked up once.
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
    use crate::numerics::linalg::CscMatrix;
    use std::collections::BTreeSet;

    /// Blocks of three rows, coupled through any one of their nine entries; the last two blocks stand alone.
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
        // A mass that couples vertices 0 and 9, which K does not, and 0 and 1, which it does.
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
