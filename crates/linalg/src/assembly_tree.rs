//! Elimination order and structure of the factor: supernodes on the graph with one vertex per node of the model. They
//! are computed once for all shifts. Positions are indices in the elimination order, counted in vertices.
//!
//! The structure of column j is the structure of the matrix below the diagonal, united with the structures of its
//! children in the elimination tree, without j (Liu, SIAM J. Matrix Anal. Appl. 11 (1990) 134). Columns of equal
//! structure form supernodes. Small supernodes are merged with their parents if few explicit zeros give larger dense
//! blocks (Ashcraft and Grimes, ACM TOMS 15 (1989) 291, with the thresholds of CHOLMOD).

use super::parallel;
use std::ops::Range;

/// Marks a root of a tree: no parent.
const NO_PARENT: u32 = u32::MAX;

/// Adjacency lists of a graph without self loops.
#[derive(Debug)]
pub(crate) struct Graph {
    /// Start of each vertex's neighbours, with one more entry at the end.
    pub pointers: Vec<i32>,
    /// Neighbours of all vertices.
    pub neighbours: Vec<i32>,
}

impl Graph {
    /// Returns the number of vertices.
    pub(crate) fn len(&self) -> usize {
        self.pointers.len() - 1
    }

    fn neighbours(&self, vertex: usize) -> &[i32] {
        &self.neighbours[self.pointers[vertex] as usize..self.pointers[vertex + 1] as usize]
    }
}

/// Supernodes in elimination order: children before parents, every subtree contiguous.
#[derive(Debug)]
pub(crate) struct AssemblyTree {
    /// Vertex at each position.
    order: Vec<u32>,
    /// Position of each vertex.
    position: Vec<u32>,
    /// First position of each supernode, with one more entry at the end.
    begin: Vec<u32>,
    /// Start of each supernode's rows, with one more entry at the end.
    rows_at: Vec<usize>,
    /// Positions below the columns of each supernode, ascending.
    rows: Vec<u32>,
    /// Index of each of these rows in the front of the parent.
    places: Vec<u32>,
    parent: Vec<u32>,
    children_at: Vec<u32>,
    children: Vec<u32>,
}

impl AssemblyTree {
    /// Computes the structure of the factor of a matrix with this graph. The elimination order is `order` up to
    /// postordering; a vertex has `block` rows.
    pub(crate) fn new(graph: &Graph, order: &[u32], block: usize) -> Self {
        let columns = EliminationTree::new(graph, order);
        let fundamental = Supernode::fundamental(graph, &columns);
        Self::assemble(&columns, amalgamate(fundamental, block))
    }

    /// Numbers the supernodes in postorder, and their columns accordingly.
    fn assemble(columns: &EliminationTree, supernodes: Vec<Supernode>) -> Self {
        let count = supernodes.len();
        let vertices = columns.order.len();
        // Children lists, in the order that needs the least memory.
        let mut children: Vec<Vec<u32>> = vec![Vec::new(); count];
        let mut roots = Vec::new();
        for (i, s) in supernodes.iter().enumerate().filter(|(_, s)| !s.columns.is_empty()) {
            match s.parent {
                NO_PARENT => roots.push(i as u32),
                parent => children[parent as usize].push(i as u32),
            }
        }
        sort_for_memory(&supernodes, &mut children);
        let sequence = postorder(&roots, |s| &children[s as usize]);
        let mut number = vec![NO_PARENT; count];
        for (new, &old) in sequence.iter().enumerate() {
            number[old as usize] = new as u32;
        }
        // Number the columns supernode by supernode.
        let mut renumbered = vec![NO_PARENT; vertices];
        let (mut order, mut begin) = (Vec::with_capacity(vertices), vec![0]);
        for &s in &sequence {
            for &column in &supernodes[s as usize].columns {
                renumbered[column as usize] = order.len() as u32;
                order.push(columns.order[column as usize]);
            }
            begin.push(order.len() as u32);
        }
        let mut position = vec![0; vertices];
        for (place, &vertex) in order.iter().enumerate() {
            position[vertex as usize] = place as u32;
        }
        // Renumber rows and parents.
        let (mut rows, mut rows_at) = (Vec::new(), vec![0]);
        let mut parent = Vec::with_capacity(sequence.len());
        for &s in &sequence {
            let s = &supernodes[s as usize];
            let start = rows.len();
            rows.extend(s.rows.iter().map(|&row| renumbered[row as usize]));
            rows[start..].sort_unstable();
            rows_at.push(rows.len());
            parent.push(if s.parent == NO_PARENT { NO_PARENT } else { number[s.parent as usize] });
        }
        let (children_at, children) = children_of(&parent);
        let mut tree =
            Self { order, position, begin, rows_at, rows, places: Vec::new(), parent, children_at, children };
        tree.places = (0..tree.len()).flat_map(|s| tree.places_in_parent(s)).collect();
        tree
    }

    fn places_in_parent(&self, s: usize) -> Vec<u32> {
        let Some(parent) = self.parent(s) else { return Vec::new() };
        let columns = self.columns(parent);
        let below = self.rows(parent);
        let mut at = 0;
        let place = |&row: &u32| {
            if (row as usize) < columns.end {
                return row - columns.start as u32;
            }
            while below[at] != row {
                at += 1;
            }
            (columns.len() + at) as u32
        };
        self.rows(s).iter().map(place).collect()
    }

    /// Returns the number of eliminated rows of the front of `s` and the number of rows below, with `block` rows per
    /// vertex.
    pub(crate) fn front(&self, s: usize, block: usize) -> (usize, usize) {
        (self.columns(s).len() * block, self.rows(s).len() * block)
    }

    /// Returns the number of supernodes.
    pub(crate) fn len(&self) -> usize {
        self.parent.len()
    }

    /// Returns the positions of the columns of a supernode.
    pub(crate) fn columns(&self, s: usize) -> Range<usize> {
        self.begin[s] as usize..self.begin[s + 1] as usize
    }

    /// Returns the positions of the rows below the columns of a supernode, ascending.
    pub(crate) fn rows(&self, s: usize) -> &[u32] {
        &self.rows[self.rows_at[s]..self.rows_at[s + 1]]
    }

    /// Returns the indices of the rows of `s` in the front of its parent (columns, then rows).
    pub(crate) fn places(&self, s: usize) -> &[u32] {
        &self.places[self.rows_at[s]..self.rows_at[s + 1]]
    }

    /// Returns the supernode that receives the contribution of `s`; `None` for a root.
    pub(crate) fn parent(&self, s: usize) -> Option<usize> {
        (self.parent[s] != NO_PARENT).then_some(self.parent[s] as usize)
    }

    /// Returns the supernodes that contribute to `s`, ascending.
    pub(crate) fn children(&self, s: usize) -> &[u32] {
        &self.children[self.children_at[s] as usize..self.children_at[s + 1] as usize]
    }

    /// Returns the vertex at each position.
    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    /// Returns the position of each vertex.
    pub(crate) fn position(&self) -> &[u32] {
        &self.position
    }
}

/// Elimination tree of single columns, numbered in postorder.
struct EliminationTree {
    /// Vertex at each position.
    order: Vec<u32>,
    position: Vec<u32>,
    parent: Vec<u32>,
}

impl EliminationTree {
    fn new(graph: &Graph, order: &[u32]) -> Self {
        let n = graph.len();
        let mut position = vec![0u32; n];
        for (place, &vertex) in order.iter().enumerate() {
            position[vertex as usize] = place as u32;
        }
        // Liu's algorithm with path compression.
        let (mut parent, mut ancestor) = (vec![NO_PARENT; n], vec![NO_PARENT; n]);
        for j in 0..n as u32 {
            for &neighbour in graph.neighbours(order[j as usize] as usize) {
                let mut i = position[neighbour as usize];
                while i < j {
                    let next = std::mem::replace(&mut ancestor[i as usize], j);
                    if next == NO_PARENT {
                        parent[i as usize] = j;
                        break;
                    }
                    i = next;
                }
            }
        }
        // Renumber in postorder.
        let (at, children) = children_of(&parent);
        let roots: Vec<u32> = (0..n as u32).filter(|&j| parent[j as usize] == NO_PARENT).collect();
        let sequence = postorder(&roots, |j| &children[at[j as usize] as usize..at[j as usize + 1] as usize]);
        let mut number = vec![NO_PARENT; n];
        for (new, &old) in sequence.iter().enumerate() {
            number[old as usize] = new as u32;
        }
        let renumbered = |p: u32| if p == NO_PARENT { NO_PARENT } else { number[p as usize] };
        Self {
            order: sequence.iter().map(|&old| order[old as usize]).collect(),
            position: position.iter().map(|&old| number[old as usize]).collect(),
            parent: sequence.iter().map(|&old| renumbered(parent[old as usize])).collect(),
        }
    }
}

/// Columns of equal structure. A supernode without columns has been merged into its parent.
struct Supernode {
    columns: Vec<u32>,
    /// Rows below the last column, unordered.
    rows: Vec<u32>,
    parent: u32,
    /// Number of explicit zeros added by amalgamation, counted in vertices.
    zeros: f64,
}

impl Supernode {
    /// Returns the fundamental supernodes: maximal runs of columns, each the only child of the next, with equal
    /// structure.
    fn fundamental(graph: &Graph, columns: &EliminationTree) -> Vec<Self> {
        let n = columns.order.len();
        let (children_at, children) = children_of(&columns.parent);
        let mut supernodes: Vec<Self> = Vec::new();
        let mut supernode_of = vec![NO_PARENT; n];
        let mut seen = vec![NO_PARENT; n];
        for j in 0..n {
            let mut rows: Vec<u32> = Vec::new();
            seen[j] = j as u32;
            let mut add = |row: u32| {
                if seen[row as usize] != j as u32 {
                    seen[row as usize] = j as u32;
                    rows.push(row);
                }
            };
            // Structure of column j: the matrix below the diagonal and the rows of the children.
            for &neighbour in graph.neighbours(columns.order[j] as usize) {
                let row = columns.position[neighbour as usize];
                if row > j as u32 {
                    add(row);
                }
            }
            let below = &children[children_at[j] as usize..children_at[j + 1] as usize];
            for &child in below {
                supernodes[supernode_of[child as usize] as usize].rows.iter().for_each(|&row| add(row));
            }
            // Join the only child if its structure is that of column j plus j itself.
            if let &[only] = below {
                let index = supernode_of[only as usize];
                let supernode = &mut supernodes[index as usize];
                if supernode.rows.len() == rows.len() + 1 {
                    supernode.columns.push(j as u32);
                    supernode.rows = rows;
                    supernode_of[j] = index;
                    continue;
                }
            }
            for &child in below {
                supernodes[supernode_of[child as usize] as usize].parent = supernodes.len() as u32;
            }
            supernode_of[j] = supernodes.len() as u32;
            rows.shrink_to_fit();
            supernodes.push(Self { columns: vec![j as u32], rows, parent: NO_PARENT, zeros: 0.0 });
        }
        supernodes
    }

    /// Returns the number of entries of the factor, in vertices: the triangle of `width` columns with `below` rows
    /// under it.
    fn size(width: usize, below: usize) -> f64 {
        let width = width as f64;
        width * (0.5 * (width + 1.0) + below as f64)
    }
}

/// Merges supernodes into their parents as long as explicit zeros are a small part of the block.
fn amalgamate(mut supernodes: Vec<Supernode>, block: usize) -> Vec<Supernode> {
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); supernodes.len()];
    for (i, s) in supernodes.iter().enumerate().filter(|(_, s)| s.parent != NO_PARENT) {
        children[s.parent as usize].push(i as u32);
    }
    for s in 0..supernodes.len() {
        // Children come first in this numbering: their merges are known.
        let mut candidates = std::mem::take(&mut children[s]);
        // The child with the most rows shares most of its structure with the parent.
        candidates.sort_by_key(|&c| (std::cmp::Reverse(supernodes[c as usize].rows.len()), c));
        let mut kept = Vec::new();
        for c in candidates {
            // Zeros of the merged block: its size minus the structural entries of both.
            let (child, parent) = (&supernodes[c as usize], &supernodes[s]);
            let width = child.columns.len() + parent.columns.len();
            let merged = Supernode::size(width, parent.rows.len());
            let zeros = child.zeros + parent.zeros + merged
                - Supernode::size(child.columns.len(), child.rows.len())
                - Supernode::size(parent.columns.len(), parent.rows.len());
            let tolerated = match width * block {
                ..=4 => 1.0,
                5..=16 => 0.8,
                17..=48 => 0.1,
                _ => 0.05,
            };
            if zeros > tolerated * merged {
                kept.push(c);
                continue;
            }
            // Merge: the parent takes the columns and the children of the child.
            let mut columns = std::mem::take(&mut supernodes[c as usize].columns);
            supernodes[c as usize].rows = Vec::new();
            columns.append(&mut supernodes[s].columns);
            supernodes[s].columns = columns;
            supernodes[s].zeros = zeros;
            for grandchild in std::mem::take(&mut children[c as usize]) {
                supernodes[grandchild as usize].parent = s as u32;
                kept.push(grandchild);
            }
        }
        children[s] = kept;
    }
    for s in &mut supernodes {
        s.columns.sort_unstable();
    }
    supernodes
}

/// Sorts children by descending peak memory of their subtree minus the memory of their contribution, which minimises
/// the peak of the parent (Liu, ACM TOMS 12 (1986) 249).
fn sort_for_memory(supernodes: &[Supernode], children: &mut [Vec<u32>]) {
    let mut peak = vec![0.0f64; supernodes.len()];
    let left = |s: u32| Supernode::size(supernodes[s as usize].rows.len(), 0);
    // Parents come after their children in this numbering.
    for s in 0..supernodes.len() {
        children[s].sort_by(|&a, &b| {
            let need = |c: u32| peak[c as usize] - left(c);
            need(b).total_cmp(&need(a)).then(a.cmp(&b))
        });
        // Peak of the subtree: children in this order, each leaving its contribution, then the front.
        let mut held = 0.0;
        let mut most = 0.0f64;
        for &c in &children[s] {
            most = most.max(held + peak[c as usize]);
            held += left(c);
        }
        let front = supernodes[s].columns.len() + supernodes[s].rows.len();
        peak[s] = most.max(held + Supernode::size(front, 0));
    }
}

/// Returns the children lists in compressed form, ascending.
fn children_of(parent: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let n = parent.len();
    let mut at = vec![0u32; n + 1];
    for &p in parent.iter().filter(|&&p| p != NO_PARENT) {
        at[p as usize + 1] += 1;
    }
    for j in 0..n {
        at[j + 1] += at[j];
    }
    let mut next = at.clone();
    let mut children = vec![0; at[n] as usize];
    for (j, &p) in parent.iter().enumerate().filter(|(_, p)| **p != NO_PARENT) {
        children[next[p as usize] as usize] = j as u32;
        next[p as usize] += 1;
    }
    (at, children)
}

/// Returns a postorder: children before parents. Without recursion, since trees of slender bodies are as deep as the
/// bodies are long.
fn postorder<'a>(roots: &[u32], children: impl Fn(u32) -> &'a [u32]) -> Vec<u32> {
    let mut sequence = Vec::new();
    let mut stack: Vec<(u32, usize)> = Vec::new();
    for &root in roots {
        stack.push((root, 0));
        while let Some((vertex, next)) = stack.last_mut() {
            if let Some(&child) = children(*vertex).get(*next) {
                *next += 1;
                stack.push((child, 0));
            } else {
                sequence.push(*vertex);
                stack.pop();
            }
        }
    }
    sequence
}

// Parallel walks over the assembly tree: upward (factorisation, forward substitution) and downward (back
// substitution). Heavy subtrees run in parallel. The work at a supernode, and the order in which it receives the
// results of its children, do not depend on the number of threads.

/// Smallest part of all work in a heavy subtree: enough subtrees for eight threads.
const HEAVY_WORK_FRACTION: f64 = 1.0 / 32.0;

/// Amount of work below which a subtree is not divided.
const MIN_DIVIDED_OPERATIONS: f64 = 1e7;

/// Subtree with the heavy subtrees below its lowest branching. These run in parallel, the rest after them.
#[derive(Debug)]
struct Segment {
    supernodes: Range<usize>,
    branches: Vec<Segment>,
}

/// Memory for the work at one supernode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Needs {
    /// Memory held until the end of the walk.
    pub retained: usize,
    /// Memory held until the parent has been visited.
    pub handed_on: usize,
    /// Memory held during the visit only.
    pub in_work: usize,
}

/// Division of the tree into subtrees for parallel walks.
#[derive(Debug)]
pub(crate) struct TreeWalk {
    trees: Segment,
}

impl TreeWalk {
    /// Divides the tree by the work at each supernode.
    pub(crate) fn new(tree: &AssemblyTree, work: &[f64]) -> Self {
        // Work of each subtree, and its first supernode.
        let mut below = work.to_vec();
        let mut first: Vec<usize> = (0..tree.len()).collect();
        for s in 0..tree.len() {
            for &c in tree.children(s) {
                below[s] += below[c as usize];
            }
            if let Some(&c) = tree.children(s).first() {
                first[s] = first[c as usize];
            }
        }
        let roots: Vec<usize> = (0..tree.len()).filter(|&s| tree.parent(s).is_none()).collect();
        let all: f64 = roots.iter().map(|&r| below[r]).sum();
        let heavy = (HEAVY_WORK_FRACTION * all).max(MIN_DIVIDED_OPERATIONS);
        // Parents come after children, so that the branches of their segments exist already.
        let mut branches: Vec<Vec<Segment>> = (0..tree.len()).map(|_| Vec::new()).collect();
        let gather = |children: Vec<usize>, branches: &mut Vec<Vec<Segment>>| -> Vec<Segment> {
            let heavy: Vec<usize> = children.into_iter().filter(|&c| below[c] >= heavy).collect();
            // A single heavy child extends the segment downward.
            if let [one] = heavy[..] {
                return std::mem::take(&mut branches[one]);
            }
            let segment = |c: usize, branches: &mut Vec<Vec<Segment>>| Segment {
                supernodes: first[c]..c + 1,
                branches: std::mem::take(&mut branches[c]),
            };
            heavy.into_iter().map(|c| segment(c, branches)).collect()
        };
        for s in (0..tree.len()).filter(|&s| below[s] >= heavy) {
            branches[s] = gather(tree.children(s).iter().map(|&c| c as usize).collect(), &mut branches);
        }
        let top = gather(roots, &mut branches);
        Self { trees: Segment { supernodes: 0..tree.len(), branches: top } }
    }

    /// Returns the largest memory that an upward walk holds at a time, in the units of `needs`, with `threads` branches
    /// in parallel: those that need most beyond what they leave.
    pub(crate) fn peak(&self, tree: &AssemblyTree, threads: usize, needs: &dyn Fn(usize) -> Needs) -> usize {
        peak(tree, &self.trees, threads.max(1), needs).0
    }

    /// Calls `visit(supernode, slot, results of its children)` for every supernode, children first. The results of
    /// roots are dropped.
    ///
    /// # Errors
    /// The first error, in elimination order, among those that occurred.
    pub(crate) fn up<S: Send, U: Send, E: Send>(
        &self,
        tree: &AssemblyTree,
        slots: &mut [S],
        visit: &(impl Fn(usize, &mut S, Vec<U>) -> Result<U, E> + Sync),
    ) -> Result<(), E> {
        up(tree, &self.trees, slots, visit).map(|_| ())
    }

    /// Calls `visit(supernode, slot, message of its parent)` for every supernode, parents first. `visit` returns the
    /// messages to its children, in their order. Roots receive `None`.
    pub(crate) fn down<S: Send, D: Send>(
        &self,
        tree: &AssemblyTree,
        slots: &mut [S],
        visit: &(impl Fn(usize, &mut S, Option<D>) -> Vec<D> + Sync),
    ) {
        down(tree, &self.trees, slots, Vec::new(), visit);
    }
}

/// Returns the slots of each branch of a segment.
fn split<'a, 'b, S>(segment: &'a Segment, slots: &'b mut [S]) -> Vec<(&'a Segment, &'b mut [S])> {
    let (mut rest, mut at) = (slots, segment.supernodes.start);
    let mut parts = Vec::with_capacity(segment.branches.len());
    for branch in &segment.branches {
        let (_, tail) = rest.split_at_mut(branch.supernodes.start - at);
        let (of_branch, tail) = tail.split_at_mut(branch.supernodes.len());
        parts.push((branch, of_branch));
        (rest, at) = (tail, branch.supernodes.end);
    }
    parts
}

/// Returns the supernodes of a segment outside its branches, ascending.
fn supernodes_of(segment: &Segment) -> impl DoubleEndedIterator<Item = usize> {
    let ends = segment.branches.iter().map(|b| b.supernodes.end);
    let starts = segment.branches.iter().map(|b| b.supernodes.start).chain([segment.supernodes.end]);
    let begins: Vec<usize> = std::iter::once(segment.supernodes.start).chain(ends).collect();
    let gaps: Vec<Range<usize>> = begins.into_iter().zip(starts).map(|(a, b)| a..b).collect();
    gaps.into_iter().flatten()
}

/// Returns the largest memory that a segment holds at a time, and the memory held at its end.
fn peak(
    tree: &AssemblyTree,
    segment: &Segment,
    threads: usize,
    needs: &dyn Fn(usize) -> Needs,
) -> (usize, usize) {
    let branches: Vec<(usize, usize)> =
        segment.branches.iter().map(|branch| peak(tree, branch, threads, needs)).collect();
    // Branches in parallel: all leave their results, and the largest needs occur together.
    let mut held: usize = branches.iter().map(|b| b.1).sum();
    let mut beyond: Vec<usize> = branches.iter().map(|b| b.0 - b.1).collect();
    beyond.sort_unstable();
    let mut most = held + beyond.iter().rev().take(threads).sum::<usize>();
    for s in supernodes_of(segment) {
        let Needs { retained, handed_on, in_work } = needs(s);
        held += retained + handed_on;
        most = most.max(held + in_work);
        held -= tree.children(s).iter().map(|&c| needs(c as usize).handed_on).sum::<usize>();
    }
    (most, held)
}

/// Results of the supernodes of a segment whose parents lie outside the segment.
type Open<U> = Vec<(usize, U)>;

fn up<S: Send, U: Send, E: Send>(
    tree: &AssemblyTree,
    segment: &Segment,
    slots: &mut [S],
    visit: &(impl Fn(usize, &mut S, Vec<U>) -> Result<U, E> + Sync),
) -> Result<Open<U>, E> {
    let start = segment.supernodes.start;
    let results: Vec<Result<Open<U>, E>> =
        parallel::map(split(segment, slots), |(branch, slots)| up(tree, branch, slots, visit));
    // Branches in parallel, then the rest of the segment in elimination order.
    let mut pending: Vec<Option<U>> = segment.supernodes.clone().map(|_| None).collect();
    for result in results {
        for (s, value) in result? {
            pending[s - start] = Some(value);
        }
    }
    for s in supernodes_of(segment) {
        let children = tree.children(s).iter();
        let below =
            children.map(|&c| pending[c as usize - start].take().expect("children come first")).collect();
        pending[s - start] = Some(visit(s, &mut slots[s - start], below)?);
    }
    let left = pending.into_iter().enumerate().filter_map(|(i, value)| Some((start + i, value?)));
    Ok(left.filter(|(s, _)| tree.parent(*s).is_some()).collect())
}

fn down<S: Send, D: Send>(
    tree: &AssemblyTree,
    segment: &Segment,
    slots: &mut [S],
    messages: Open<D>,
    visit: &(impl Fn(usize, &mut S, Option<D>) -> Vec<D> + Sync),
) {
    let start = segment.supernodes.start;
    let mut pending: Vec<Option<D>> = segment.supernodes.clone().map(|_| None).collect();
    for (s, message) in messages {
        pending[s - start] = Some(message);
    }
    for s in supernodes_of(segment).rev() {
        let message = pending[s - start].take();
        let below = visit(s, &mut slots[s - start], message);
        for (&c, message) in tree.children(s).iter().zip(below) {
            pending[c as usize - start] = Some(message);
        }
    }
    // The rest of the segment is done: each branch receives its messages.
    let parts = split(segment, slots);
    let mut tasks = Vec::with_capacity(parts.len());
    for (branch, slots) in parts {
        let messages =
            branch.supernodes.clone().filter_map(|s| Some((s, pending[s - start].take()?))).collect();
        tasks.push((branch, slots, messages));
    }
    parallel::for_each(tasks, |(branch, slots, messages)| down(tree, branch, slots, messages, visit));
}
