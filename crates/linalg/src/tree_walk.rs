//! Parallel walks over the assembly tree: upward (factorisation, forward substitution) and downward (back
//! substitution). Heavy subtrees run in parallel. The work at a supernode, and the order in which it receives the
//! results of its children, do not depend on the number of threads.

use super::assembly_tree::AssemblyTree;
use super::parallel;
use std::ops::Range;

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
