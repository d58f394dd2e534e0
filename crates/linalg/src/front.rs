//! Dense fronts: trapezoids in panels of columns, each panel row-major, and the kernels that eliminate the leading
//! columns of a front. Work is cut into fixed pieces of rows, so that the bits do not depend on the number of threads.

use super::parallel;
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef, Par, Spec};
use std::ops::{AddAssign, Mul, Neg};

/// Number of columns of a panel: large enough for products at full speed, small enough for its triangles to cost
/// little.
pub(super) const PANEL_COLUMNS: usize = 128;

/// Number of rows in a piece of parallel work.
pub(super) const ROWS_PER_PIECE: usize = 256;

/// Number of multiplications below which work is not divided into tasks.
pub(super) const MIN_PARALLEL_MULTIPLICATIONS: usize = 4_000_000;

/// Number type of a factor.
pub trait Real:
    faer::traits::RealField
    + pulp::bytemuck::Pod
    + Default
    + Send
    + Sync
    + PartialOrd
    + AddAssign
    + Mul<Output = Self>
    + Neg<Output = Self>
{
    /// Unit roundoff.
    const ROUNDOFF: f64;
    /// Magnitude below which entries of a factor are set to zero, for a diagonal of about one: products of larger
    /// entries stay above the smallest normal number. Subnormal numbers are up to a hundred times slower on some
    /// processors, and the factor of a mass matrix decays to them within a few elements. Zero if no factor comes near
    /// the smallest normal number.
    const NEGLIGIBLE: f64;
    /// Returns the number rounded from double precision.
    fn of(x: f64) -> Self;
    /// Returns the number in double precision.
    fn wide(self) -> f64;
    /// Returns the numbers in double precision: themselves, or converted into `buffer`.
    fn all_wide<'a>(numbers: &'a [Self], buffer: &'a mut Vec<f64>) -> &'a [f64];
}

impl Real for f64 {
    const ROUNDOFF: f64 = f64::EPSILON / 2.0;
    const NEGLIGIBLE: f64 = 0.0;
    fn of(x: f64) -> Self {
        x
    }
    fn wide(self) -> f64 {
        self
    }
    fn all_wide<'a>(numbers: &'a [Self], _: &'a mut Vec<f64>) -> &'a [f64] {
        numbers
    }
}

impl Real for f32 {
    const ROUNDOFF: f64 = f32::EPSILON as f64 / 2.0;
    const NEGLIGIBLE: f64 = 1e-18;
    fn of(x: f64) -> Self {
        x as f32
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
    fn all_wide<'a>(numbers: &'a [Self], buffer: &'a mut Vec<f64>) -> &'a [f64] {
        buffer.clear();
        buffer.extend(numbers.iter().map(|x| x.wide()));
        buffer
    }
}

/// Columns 0..width of the lower triangle of a symmetric matrix with `height` rows. Panel p holds the columns from p
/// [`PANEL_COLUMNS`] and the rows from there down, row by row. The entries above the diagonal of its leading square are
/// unused.
#[derive(Debug, Default)]
pub(crate) struct Trapezoid<T> {
    height: usize,
    width: usize,
    pub(super) panels: Vec<Vec<T>>,
}

impl<T: Real> Trapezoid<T> {
    pub(crate) fn zeros(height: usize, width: usize) -> Self {
        let panel = |p: usize| {
            vec![T::default(); (height - p * PANEL_COLUMNS) * PANEL_COLUMNS.min(width - p * PANEL_COLUMNS)]
        };
        Self { height, width, panels: (0..width.div_ceil(PANEL_COLUMNS)).map(panel).collect() }
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of entries stored for this shape.
    pub(crate) fn stored(height: usize, width: usize) -> usize {
        (0..width.div_ceil(PANEL_COLUMNS))
            .map(|p| (height - p * PANEL_COLUMNS) * PANEL_COLUMNS.min(width - p * PANEL_COLUMNS))
            .sum()
    }

    pub(super) fn panel_width(&self, p: usize) -> usize {
        PANEL_COLUMNS.min(self.width - p * PANEL_COLUMNS)
    }

    pub(crate) fn add(&mut self, row: usize, column: usize, value: T) {
        let p = column / PANEL_COLUMNS;
        let at = (row - p * PANEL_COLUMNS) * self.panel_width(p) + column - p * PANEL_COLUMNS;
        self.panels[p][at] += value;
    }

    /// Returns the rows `from..` (counted in the trapezoid) of panel `p`.
    pub(super) fn below(&self, p: usize, from: usize) -> MatRef<'_, T> {
        let width = self.panel_width(p);
        let skipped = from - p * PANEL_COLUMNS;
        MatRef::from_row_major_slice(&self.panels[p][skipped * width..], self.height - from, width)
    }
}

/// Adds `source` to the front with columns `pivots` and Schur complement `rest`. `places` are the indices of its rows
/// and columns in the front.
pub(super) fn extend_add<T: Real>(
    pivots: &mut Trapezoid<T>,
    rest: &mut Trapezoid<T>,
    source: &Trapezoid<T>,
    places: &[usize],
) {
    let w = pivots.width;
    for (p, panel) in source.panels.iter().enumerate() {
        // Entries of the source panel go to the pivots or to the Schur complement of the front.
        let (first, width) = (p * PANEL_COLUMNS, source.panel_width(p));
        // Columns that stay adjacent are added run by run.
        let runs = runs(&places[first..first + width], w);
        for (i, row) in panel.chunks_exact(width).enumerate() {
            let place = places[first + i];
            // The leading square is unused above the diagonal.
            let used = (i + 1).min(width);
            for run in &runs {
                if run.source >= used {
                    break;
                }
                let length = run.length.min(used - run.source);
                let (target, row_place) =
                    if run.rest { (&mut *rest, place - w) } else { (&mut *pivots, place) };
                let target_width = target.panel_width(run.panel);
                let at = (row_place - run.panel * PANEL_COLUMNS) * target_width + run.column;
                let to = &mut target.panels[run.panel][at..at + length];
                for (to, from) in to.iter_mut().zip(&row[run.source..run.source + length]) {
                    *to += *from;
                }
            }
        }
    }
}

/// Consecutive columns that are added to consecutive columns of one panel.
struct Run {
    source: usize,
    length: usize,
    rest: bool,
    panel: usize,
    column: usize,
}

fn runs(places: &[usize], pivots: usize) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (source, &place) in places.iter().enumerate() {
        let rest = place >= pivots;
        let column = if rest { place - pivots } else { place };
        let (panel, column) = (column / PANEL_COLUMNS, column % PANEL_COLUMNS);
        match runs.last_mut() {
            Some(run) if run.rest == rest && run.panel == panel && run.column + run.length == column => {
                run.length += 1;
            }
            _ => runs.push(Run { source, length: 1, rest, panel, column }),
        }
    }
    runs
}

/// Runs `work(index, piece)` on pieces of [`ROWS_PER_PIECE`] rows of a row-major block, in parallel if `cost`
/// multiplications are worth it.
pub(super) fn by_rows<T: Real>(
    block: &mut [T],
    width: usize,
    cost: usize,
    work: impl Fn(usize, &mut [T]) + Sync,
) {
    if cost < MIN_PARALLEL_MULTIPLICATIONS {
        block.chunks_mut(ROWS_PER_PIECE * width).enumerate().for_each(|(i, piece)| work(i, piece));
    } else {
        parallel::for_each(block.chunks_mut(ROWS_PER_PIECE * width).enumerate(), |(i, piece)| work(i, piece));
    }
}

/// Subtracts A B' from the lower triangle of a square C.
fn subtract_lower<T: Real>(c: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>) {
    triangular::matmul(
        c,
        BlockStructure::TriangularLower,
        Accum::Add,
        a,
        BlockStructure::Rectangular,
        b.transpose(),
        BlockStructure::Rectangular,
        T::of(-1.0),
        Par::Seq,
    );
}

/// Subtracts A B' from C.
fn subtract<T: Real>(c: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>) {
    matmul(c, Accum::Add, a, b.transpose(), T::of(-1.0), Par::Seq);
}

/// Subtracts the product of the eliminated panels `left` and `right` from one panel (its rows start at its own first
/// column): A -= sum over p of L_p R_p'. For Cholesky both are L; otherwise R = L B.
pub(super) fn subtract_eliminated<T: Real>(
    target: &mut [T],
    width: usize,
    left: &[MatRef<'_, T>],
    right: &[MatRef<'_, T>],
) {
    let depth: usize = left.iter().map(|l| l.ncols()).sum();
    let cost = target.len() * depth;
    // Rows below the square, in pieces; then the lower triangle of the square.
    let (square, below) = target.split_at_mut(width * width);
    by_rows(below, width, cost, |piece, rows| {
        let count = rows.len() / width;
        let mut c = MatMut::from_row_major_slice_mut(rows, count, width);
        for (l, r) in left.iter().zip(right) {
            subtract(c.as_mut(), l.subrows(width + piece * ROWS_PER_PIECE, count), r.subrows(0, width));
        }
    });
    let mut c = MatMut::from_row_major_slice_mut(square, width, width);
    for (l, r) in left.iter().zip(right) {
        subtract_lower(c.as_mut(), l.subrows(0, width), r.subrows(0, width));
    }
}

/// Computes X <- X L^-T for the rows of a panel below its square, with a lower triangle L. `unit` means a unit
/// diagonal.
pub(super) fn divide_rows<T: Real>(below: &mut [T], l: MatRef<'_, T>, unit: bool) {
    let width = l.ncols();
    by_rows(below, width, below.len() * width, |_, rows| {
        let count = rows.len() / width;
        let x = MatMut::from_row_major_slice_mut(rows, count, width).transpose_mut();
        if unit {
            faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place(l, x, Par::Seq);
        } else {
            solve_lower_triangular_in_place(l, x, Par::Seq);
        }
    });
}

/// Sets entries below [`Real::NEGLIGIBLE`] to zero.
pub(super) fn drop_negligible<T: Real>(entries: &mut [T]) {
    if T::NEGLIGIBLE == 0.0 {
        return;
    }
    let (least, zero) = (T::of(T::NEGLIGIBLE), T::default());
    for entry in entries {
        if *entry < least && *entry > -least {
            *entry = zero;
        }
    }
}

/// Computes the Cholesky factor of the columns `pivots` of a front and subtracts their contribution from `rest`.
/// Returns `None` if a pivot is not positive.
pub(super) fn cholesky<T: Real>(pivots: &mut Trapezoid<T>, rest: &mut Trapezoid<T>) -> Option<()> {
    let mut memory = dyn_stack::MemBuffer::new(llt::factor::cholesky_in_place_scratch::<T>(
        PANEL_COLUMNS.min(pivots.width),
        Par::Seq,
        Spec::default(),
    ));
    for p in 0..pivots.panels.len() {
        let (first, width) = (p * PANEL_COLUMNS, pivots.panel_width(p));
        let mut panel = std::mem::take(&mut pivots.panels[p]);
        let left: Vec<MatRef<'_, T>> = (0..p).map(|q| pivots.below(q, first)).collect();
        // Panel p: subtract the panels before it, factor its square, divide the rows below.
        subtract_eliminated(&mut panel, width, &left, &left);
        let (square, below) = panel.split_at_mut(width * width);
        let mut diagonal = MatRef::from_row_major_slice(&*square, width, width).to_owned();
        let stack = dyn_stack::MemStack::new(&mut memory);
        llt::factor::cholesky_in_place(
            diagonal.as_mut(),
            Default::default(),
            Par::Seq,
            stack,
            Spec::default(),
        )
        .ok()?;
        // A failed pivot may also appear as NaN.
        if (0..width).any(|j| diagonal[(j, j)].wide().is_nan() || diagonal[(j, j)] <= T::default()) {
            return None;
        }
        MatMut::from_row_major_slice_mut(square, width, width).copy_from_triangular_lower(&diagonal);
        drop_negligible(below);
        divide_rows(below, diagonal.as_ref(), false);
        drop_negligible(below);
        pivots.panels[p] = panel;
    }
    subtract_from_rest(pivots, pivots, rest);
    Some(())
}

/// Computes the Schur complement: rest -= L R' of all eliminated columns.
pub(super) fn subtract_from_rest<T: Real>(
    left: &Trapezoid<T>,
    right: &Trapezoid<T>,
    rest: &mut Trapezoid<T>,
) {
    let (w, total) = (left.width, rest.width);
    let work = |p: usize, panel: &mut Vec<T>| {
        let from = w + p * PANEL_COLUMNS;
        let l: Vec<MatRef<'_, T>> = (0..left.panels.len()).map(|q| left.below(q, from)).collect();
        let r: Vec<MatRef<'_, T>> = (0..right.panels.len()).map(|q| right.below(q, from)).collect();
        subtract_eliminated(panel, PANEL_COLUMNS.min(total - p * PANEL_COLUMNS), &l, &r);
    };
    if total * total * w / 2 < MIN_PARALLEL_MULTIPLICATIONS {
        rest.panels.iter_mut().enumerate().for_each(|(p, panel)| work(p, panel));
    } else {
        parallel::for_each(rest.panels.iter_mut().enumerate(), |(p, panel)| work(p, panel));
    }
}
