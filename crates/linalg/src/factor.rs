//! Sparse Cholesky factor of K + tau M by the multifrontal method (Duff and Reid, ACM TOMS 9 (1983) 302; Liu, SIAM
//! Review 34 (1992) 82), in double or single precision. One symbolic analysis serves all shifts.

use super::assembly_tree::{AssemblyTree, Needs, TreeWalk};
use super::dense::largest;
use super::front::{self, Real, Trapezoid, extend_add};
use super::ordering::{nested_dissection, smallest_graph, vertex_graph};
use super::{Pencil, SymmetricMatrix, parallel, substitution};
use faer::prelude::ReborrowMut;
use faer::{MatMut, MatRef};
use libm::{exp2, log2};
use std::convert::Infallible;
use std::sync::{Arc, OnceLock};

/// Elimination order of one pencil: computed for the first factor, and kept for all later ones.
#[derive(Debug, Clone, Default)]
pub struct EliminationOrder(OnceLock<Arc<Analysis>>);

impl EliminationOrder {
    /// Returns the analysis of `pencil`, which must be the same at every call; `None` if memory runs out.
    pub fn of(&self, pencil: &Pencil<'_>) -> Option<Arc<Analysis>> {
        if let Some(known) = self.0.get() {
            return Some(Arc::clone(known));
        }
        // Not inside `get_or_init`: a thread that waits there could block the tasks of the analysis.
        let found = Arc::new(Analysis::new(pencil)?);
        Some(Arc::clone(self.0.get_or_init(|| found)))
    }
}

/// Elimination order and structure of the factor of K - sigma M, valid for every sigma.
#[derive(Debug)]
pub struct Analysis {
    pub(super) tree: Arc<AssemblyTree>,
    pub(super) walk: TreeWalk,
    /// Number of rows per vertex of the tree.
    pub(super) block: usize,
    flops: f64,
    len: usize,
}

impl Analysis {
    /// Orders and analyses the pencil; `None` if memory runs out.
    pub fn new(pencil: &Pencil<'_>) -> Option<Self> {
        let (mut graph, rows) = smallest_graph(pencil)?;
        let order = nested_dissection(&mut graph)?;
        Some(Self::with_tree(Arc::new(AssemblyTree::new(&graph, &order, rows)), rows))
    }

    fn with_tree(tree: Arc<AssemblyTree>, block: usize) -> Self {
        let work: Vec<f64> = (0..tree.len()).map(|s| elimination_flops(tree.front(s, block))).collect();
        let walk = TreeWalk::new(&tree, &work);
        let pivots = |(width, rest)| Trapezoid::<f64>::stored(width + rest, width);
        let len = (0..tree.len()).map(|s| pivots(tree.front(s, block))).sum();
        Self { walk, block, flops: work.iter().sum(), len, tree }
    }

    /// Returns the number of entries stored in a factor.
    pub fn factor_len(&self) -> usize {
        self.len
    }

    /// Returns the multiplications and additions of one Cholesky factorisation.
    pub fn flops(&self) -> f64 {
        self.flops
    }

    /// Returns the largest number of entries held at a time, if `threads` subtrees are factored in parallel.
    pub fn peaks(&self, threads: usize) -> Peaks {
        let pivots = |s: usize| {
            let (width, rest) = self.tree.front(s, self.block);
            Trapezoid::<f64>::stored(width + rest, width)
        };
        let rest = |s: usize| {
            let (_, rest) = self.tree.front(s, self.block);
            Trapezoid::<f64>::stored(rest, rest)
        };
        let numbers = |needs: &dyn Fn(usize) -> Needs| self.walk.peak(&self.tree, threads, needs) as u64;
        Peaks {
            factor: self.len as u64,
            cholesky: numbers(&|s| Needs { retained: pivots(s), handed_on: rest(s), in_work: 0 }),
            // An inertia count holds L and L B.
            inertia: numbers(&|s| Needs { retained: 0, handed_on: rest(s), in_work: 2 * pivots(s) }),
            retained_inertia: numbers(&|s| Needs {
                retained: pivots(s),
                handed_on: rest(s),
                in_work: pivots(s),
            }),
        }
    }

    /// Returns zeros for the columns of a front and for its Schur complement.
    pub(super) fn new_front<T: Real>(&self, s: usize) -> (Trapezoid<T>, Trapezoid<T>) {
        let (width, rest) = self.tree.front(s, self.block);
        (Trapezoid::zeros(width + rest, width), Trapezoid::zeros(rest, rest))
    }

    /// Returns the row of the parent's front for each row below the columns of `s`.
    pub(super) fn places(&self, s: usize) -> Vec<usize> {
        let rows = |&place: &u32| (0..self.block).map(move |b| place as usize * self.block + b);
        self.tree.places(s).iter().flat_map(rows).collect()
    }

    /// Returns K - sigma M scaled to a diagonal of about one by powers of two. The scaling is exact, and keeps the
    /// entries within the range of single precision in any units.
    pub(super) fn scaled<'a>(&'a self, pencil: &'a Pencil<'a>, sigma: f64) -> Scaled<'a> {
        let diagonals = pencil.stiffness().diagonal().into_iter().zip(pencil.mass_diagonal());
        let scale = diagonals.map(|(k, m)| {
            let diagonal = k.abs() + (sigma * m).abs();
            if diagonal > 0.0 && diagonal.is_finite() { exp2((-0.5 * log2(diagonal)).round()) } else { 1.0 }
        });
        Scaled { analysis: self, pencil, sigma, scale: scale.collect() }
    }
}

/// Largest numbers of entries held at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Peaks {
    /// Entries of a finished Cholesky factor.
    pub factor: u64,
    /// Entries during a Cholesky factorisation.
    pub cholesky: u64,
    /// Entries during an inertia count that does not keep its factor.
    pub inertia: u64,
    /// Entries during an inertia count that keeps its factor.
    pub retained_inertia: u64,
}

/// Returns the multiplications and additions for the elimination of `width` columns with `rest` rows below them.
fn elimination_flops((width, rest): (usize, usize)) -> f64 {
    let (w, r) = (width as f64, rest as f64);
    w * w * w / 3.0 + w * w * r + w * r * r
}

/// Scaled matrix S (K - sigma M) S with the diagonal S, row by row.
pub(super) struct Scaled<'a> {
    analysis: &'a Analysis,
    pencil: &'a Pencil<'a>,
    sigma: f64,
    pub(super) scale: Vec<f64>,
}

impl Scaled<'_> {
    /// Adds the columns of supernode `s` to its front.
    pub(super) fn assemble<T: Real>(&self, s: usize, front: &mut Trapezoid<T>) {
        let columns = self.analysis.tree.columns(s);
        for column in columns.clone() {
            let mut places = FrontPlaces { tree: &self.analysis.tree, s, column, known: Vec::new() };
            let local = (column - columns.start) * self.analysis.block;
            self.assemble_stiffness(local, &mut places, front);
            self.assemble_mass(local, &mut places, front);
        }
    }

    /// Adds the columns of K of one vertex; the first of them has index `local` in the front.
    fn assemble_stiffness<T: Real>(
        &self,
        local: usize,
        places: &mut FrontPlaces<'_>,
        front: &mut Trapezoid<T>,
    ) {
        let block = self.analysis.block;
        let vertex = places.vertex();
        for b in 0..block {
            let (j, local) = (vertex * block + b, local + b);
            let (rows, values) = self.pencil.stiffness().row(j);
            let mut at = 0;
            for (&i, &value) in rows.iter().zip(values) {
                let (other, component) = (i as usize / block, i as usize % block);
                if let Some(row) = places.of(other, &mut at).map(|place| place * block + component)
                    && row >= local
                {
                    front.add(row, local, T::of(value * self.scale[i as usize] * self.scale[j]));
                }
            }
        }
    }

    /// Adds the columns of -sigma M of one vertex. Each row of Ms stands for as many rows of M as the pencil's block
    /// has.
    fn assemble_mass<T: Real>(&self, local: usize, places: &mut FrontPlaces<'_>, front: &mut Trapezoid<T>) {
        let block = self.analysis.block;
        let vertex = places.vertex();
        let (copies, heavy) = (self.pencil.block(), block / self.pencil.block());
        for heavy_row in 0..heavy {
            let (others, masses) = self.pencil.mass().row(vertex * heavy + heavy_row);
            let mut at = 0;
            for (&other, &mass) in others.iter().zip(masses) {
                let (other, part) = (other as usize / heavy, other as usize % heavy);
                let Some(place) = places.of(other, &mut at) else { continue };
                for copy in 0..copies {
                    let (b, c) = (part * copies + copy, heavy_row * copies + copy);
                    let (row, local) = (place * block + b, local + c);
                    if row >= local {
                        let scale = self.scale[other * block + b] * self.scale[vertex * block + c];
                        front.add(row, local, T::of(-self.sigma * mass * scale));
                    }
                }
            }
        }
    }
}

/// Indices of vertices in the front of a supernode, for the entries of one column of vertices. Each vertex is looked up
/// once for all rows of that column.
struct FrontPlaces<'a> {
    tree: &'a AssemblyTree,
    s: usize,
    column: usize,
    /// Vertices, ascending, with their indices; `None` for a vertex that is eliminated earlier.
    known: Vec<(usize, Option<usize>)>,
}

impl FrontPlaces<'_> {
    /// Returns the vertex of the column.
    fn vertex(&self) -> usize {
        self.tree.order()[self.column] as usize
    }

    /// Returns the index of a vertex in the front; `None` if it is eliminated before the column. The vertices of a row
    /// must be asked for in ascending order: `at` is the search position of the last one, zero at first.
    fn of(&mut self, vertex: usize, at: &mut usize) -> Option<usize> {
        while self.known.get(*at).is_some_and(|known| known.0 < vertex) {
            *at += 1;
        }
        if let Some(&(known, place)) = self.known.get(*at)
            && known == vertex
        {
            return place;
        }
        let place = self.found(vertex);
        self.known.insert(*at, (vertex, place));
        place
    }

    fn found(&self, vertex: usize) -> Option<usize> {
        let columns = self.tree.columns(self.s);
        let position = self.tree.position()[vertex] as usize;
        if position < self.column {
            None
        } else if position < columns.end {
            Some(position - columns.start)
        } else {
            let below = self.tree.rows(self.s).binary_search(&(position as u32));
            Some(columns.len() + below.expect("the structure holds every entry"))
        }
    }
}

/// Solver for K + tau M: a sparse factor, or the dense factor of a small model.
pub trait Solve {
    /// Returns the shift tau.
    fn shift(&self) -> f64;

    /// Replaces X (n x k) by (K + tau M)^-1 X.
    fn solve_in_place(&self, x: MatMut<'_, f64>);
}

/// Cholesky factor of K + tau M with numbers of type `T`.
#[derive(Debug)]
pub struct Cholesky<'a, T = f64> {
    analysis: &'a Analysis,
    fronts: Vec<Trapezoid<T>>,
    /// Scale of each row.
    scale: Vec<f64>,
    tau: f64,
}

impl<'a, T: Real> Cholesky<'a, T> {
    /// Factors K + tau M; `None` if the matrix is not positive definite.
    pub fn new(analysis: &'a Analysis, pencil: &Pencil<'_>, tau: f64) -> Option<Self> {
        let tree = &analysis.tree;
        let matrix = analysis.scaled(pencil, -tau);
        let mut fronts: Vec<Trapezoid<T>> = (0..tree.len()).map(|_| Trapezoid::default()).collect();
        let visit = |s: usize, slot: &mut Trapezoid<T>, children: Vec<Trapezoid<T>>| {
            let (pivots, rest) = eliminate_front(analysis, &matrix, s, children).ok_or(())?;
            *slot = pivots;
            Ok::<_, ()>(rest)
        };
        analysis.walk.up(tree, &mut fronts, &visit).ok()?;
        Some(Self { analysis, fronts, scale: matrix.scale, tau })
    }

    /// Solves for the columns of `x`, at most `K`, in the precision of the factor.
    fn solve_block<const K: usize>(&self, x: MatMut<'_, f64>) {
        let forward = |s: usize, front: &mut [[T; K]]| substitution::forward(&self.fronts[s], front);
        let backward = |s: usize, front: &mut [[T; K]]| substitution::backward(&self.fronts[s], front);
        substitute(self.analysis, &self.scale, x, forward, backward);
    }
}

/// Assembles the front of supernode `s` from the entries of `matrix` and the contributions of its children, and
/// eliminates its columns. Returns the columns of the factor and the contribution to the parent; `None` if a pivot is
/// not positive.
fn eliminate_front<T: Real>(
    analysis: &Analysis,
    matrix: &Scaled<'_>,
    s: usize,
    children: Vec<Trapezoid<T>>,
) -> Option<(Trapezoid<T>, Trapezoid<T>)> {
    let (mut pivots, mut rest) = analysis.new_front::<T>(s);
    matrix.assemble(s, &mut pivots);
    for (&c, child) in analysis.tree.children(s).iter().zip(children) {
        extend_add(&mut pivots, &mut rest, &child, &analysis.places(c as usize));
    }
    front::cholesky(&mut pivots, &mut rest)?;
    Some((pivots, rest))
}

/// Returns true if a matrix has a Cholesky factor with numbers of type `T`. The factor is not kept.
fn is_positive_definite<T: Real>(analysis: &Analysis, matrix: &SymmetricMatrix) -> bool {
    let pencil = Pencil::new(matrix, matrix, 1);
    let matrix = analysis.scaled(&pencil, 0.0);
    let visit = |s: usize, (): &mut (), children: Vec<Trapezoid<T>>| {
        eliminate_front(analysis, &matrix, s, children).map(|(_, rest)| rest).ok_or(())
    };
    analysis.walk.up(&analysis.tree, &mut vec![(); analysis.tree.len()], &visit).is_ok()
}

/// Smallest number of rows that a task reorders, so that the work is far longer than the start of the task.
const MIN_ROWS_PER_TASK: usize = 4096;

/// Substitutes upward and downward over the tree for the columns of `x`, at most `K`, with the `scale` of each row.
/// `forward` eliminates the leading rows of the front of a supernode; `backward` computes them from the rows below.
pub(super) fn substitute<T: Real, const K: usize>(
    analysis: &Analysis,
    scale: &[f64],
    x: MatMut<'_, f64>,
    forward: impl Fn(usize, &mut [[T; K]]) + Sync,
    backward: impl Fn(usize, &mut [[T; K]]) + Sync,
) {
    let (tree, block) = (&analysis.tree, analysis.block);
    let mut values: Vec<[T; K]> = in_elimination_order(analysis, scale, x.as_ref());
    // One slot of pivot rows for each supernode.
    let mut slots: Vec<&mut [[T; K]]> = Vec::with_capacity(tree.len());
    let mut rest = values.as_mut_slice();
    for s in 0..tree.len() {
        let (pivots, tail) = rest.split_at_mut(tree.columns(s).len() * block);
        slots.push(pivots);
        rest = tail;
    }
    // Upward: collect the contributions of the children, eliminate, hand on the rest.
    let up = |s: usize, pivots: &mut &mut [[T; K]], children: Vec<Vec<[T; K]>>| {
        let (width, below) = tree.front(s, block);
        let mut front = vec![[T::default(); K]; width + below];
        front[..pivots.len()].copy_from_slice(pivots);
        for (&c, update) in tree.children(s).iter().zip(&children) {
            for (&place, update) in tree.places(c as usize).iter().zip(update.chunks_exact(block)) {
                for (to, from) in front[place as usize * block..].iter_mut().zip(update) {
                    to.iter_mut().zip(from).for_each(|(to, from)| *to += *from);
                }
            }
        }
        forward(s, &mut front);
        pivots.copy_from_slice(&front[..pivots.len()]);
        Ok::<_, Infallible>(front.split_off(pivots.len()))
    };
    let Ok(()) = analysis.walk.up(tree, &mut slots, &up);
    // Downward: append the solution of the rows below, solve, and send each child its rows.
    let down = |s: usize, pivots: &mut &mut [[T; K]], below: Option<Vec<[T; K]>>| {
        let mut front = pivots.to_vec();
        front.extend(below.unwrap_or_default());
        backward(s, &mut front);
        pivots.copy_from_slice(&front[..pivots.len()]);
        let message = |c: u32| {
            let places = tree.places(c as usize);
            let mut rows = Vec::with_capacity(places.len() * block);
            for &place in places {
                rows.extend_from_slice(&front[place as usize * block..][..block]);
            }
            rows
        };
        tree.children(s).iter().map(|&c| message(c)).collect()
    };
    analysis.walk.down(tree, &mut slots, &down);
    // Back to the order and scale of the model.
    let columns_per_task = (MIN_ROWS_PER_TASK / x.nrows().max(1)).max(1);
    let mut columns: Vec<_> = x.col_iter_mut().collect();
    parallel::for_each_mut(&mut columns, columns_per_task, |j, to| {
        for (&vertex, from) in tree.order().iter().zip(values.chunks_exact(block)) {
            for (row, from) in (vertex as usize * block..).zip(from) {
                to[row] = from[j].wide() * scale[row];
            }
        }
    });
}

/// Returns the scaled rows of at most `K` columns of `x` in elimination order.
fn in_elimination_order<T: Real, const K: usize>(
    analysis: &Analysis,
    scale: &[f64],
    x: MatRef<'_, f64>,
) -> Vec<[T; K]> {
    let (order, block) = (analysis.tree.order(), analysis.block);
    let scaled = |i: usize| {
        let row = order[i / block] as usize * block + i % block;
        let mut values = [T::default(); K];
        for (j, value) in values.iter_mut().take(x.ncols()).enumerate() {
            *value = T::of(x[(row, j)] * scale[row]);
        }
        values
    };
    parallel::values(x.nrows(), MIN_ROWS_PER_TASK, scaled)
}

/// Number of columns that are solved together: the factor is read from memory once for all of them.
pub(super) const COLUMNS_PER_SOLVE: usize = 8;

impl<T: Real> Solve for Cholesky<'_, T> {
    fn shift(&self) -> f64 {
        self.tau
    }

    fn solve_in_place(&self, mut x: MatMut<'_, f64>) {
        let mut start = 0;
        while start < x.ncols() {
            let width = COLUMNS_PER_SOLVE.min(x.ncols() - start);
            let columns = x.rb_mut().subcols_mut(start, width);
            // In single precision eight columns are one vector: four would not be faster.
            if width > COLUMNS_PER_SOLVE / 2 || size_of::<T>() < size_of::<f64>() {
                self.solve_block::<COLUMNS_PER_SOLVE>(columns);
            } else {
                self.solve_block::<{ COLUMNS_PER_SOLVE / 2 }>(columns);
            }
            start += width;
        }
    }
}

/// Ratio of the number of entries of M to that of K, both counted in blocks of vertices, above which the factor of M
/// uses the structure of the joint factor: computing its own structure would take longer than it saves.
const SHARED_STRUCTURE_RATIO: f64 = 0.5;

/// Part of the largest diagonal entry of M up to which entries of a row without a positive diagonal are rounding.
const ROUNDING_MASS_FRACTION: f64 = 1e-14;

/// Returns true when a row without a positive diagonal entry has entries beyond rounding: no semidefinite matrix has
/// such a row, since m_ij^2 <= m_ii m_jj.
fn has_coupled_massless_row(mass: &SymmetricMatrix) -> bool {
    let diagonal = mass.diagonal();
    let noise = ROUNDING_MASS_FRACTION * largest(diagonal.iter().copied());
    let couples = |row: usize| mass.row(row).1.iter().any(|entry| entry.abs() > noise);
    diagonal.iter().enumerate().any(|(row, entry)| *entry <= 0.0 && couples(row))
}

/// Returns true if M is positive semidefinite up to rounding. Its Cholesky factorisation must succeed after the
/// diagonal is raised by 1e-9 of itself (massless nodes get a one, which couples to nothing in such a matrix).
///
/// Most masses of displacements are far from singular: if the factorisation succeeds in single precision with a
/// diagonal lowered by 1e-3, the answer is found in half the time. Masses of rotations are nearly singular. The order
/// is that of `analysis`, which must belong to the pencil.
pub fn is_positive_semidefinite(pencil: &Pencil<'_>, analysis: &Analysis) -> bool {
    let mass = pencil.mass();
    if has_coupled_massless_row(mass) {
        return false;
    }
    // The order by vertices of M, which may be coarser or finer than that of the pencil.
    let order = analysis.tree.order();
    let rows = (mass.n() / order.len().max(1)).max(1);
    // Count the entries of both matrices in blocks of vertices.
    let by_vertices =
        |matrix: &SymmetricMatrix, rows: usize| matrix.as_csc().nnz() as f64 / (rows * rows) as f64;
    let full = by_vertices(pencil.stiffness(), rows * pencil.block());
    let tree = if by_vertices(mass, rows) >= SHARED_STRUCTURE_RATIO * full {
        Arc::clone(&analysis.tree)
    } else {
        let Some(graph) = vertex_graph(&Pencil::new(mass, mass, 1), rows) else { return false };
        Arc::new(AssemblyTree::new(&graph, order, rows))
    };
    let analysis = Analysis::with_tree(tree, rows);
    if rows == 1 {
        let lowered = mass.with_raised_diagonal(1.0 - 1e-3);
        if is_positive_definite::<f32>(&analysis, &lowered) {
            return true;
        }
    }
    let raised = mass.with_raised_diagonal(1.0 + 1e-9);
    is_positive_definite::<f64>(&analysis, &raised)
}
