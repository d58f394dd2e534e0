//! An object of the file: its sizes and listed entries.

use super::lines::{Line, Lines};
use crate::import::digits::Digits;
use faer::Mat;
use flexbody_base::diagnostic::Diagnostic;

/// An entry with indices from 0; the third index is unused for `m0`.
#[derive(Debug, Clone, Copy)]
struct Entry {
    index: [usize; 3],
    line: usize,
    value: f64,
}

/// A parsed object M0 + sum_k M1_k q_k.
#[derive(Debug)]
pub(crate) struct Taylor {
    pub(crate) name: String,
    /// Line of the name of the object.
    pub(crate) line: usize,
    pub(crate) nrow: usize,
    pub(crate) ncol: usize,
    nq: usize,
    structure: usize,
    /// True if the file states no `structure` for the object.
    pub(crate) inferred: bool,
    m0: Vec<Entry>,
    m1: Vec<Entry>,
    /// Number format of the entries.
    pub(crate) digits: Digits,
}

/// Meaning of the three indices of an entry `m1(., ., .)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ModeIndex {
    /// Order (row, mode, column).
    Middle,
    /// Order (row, column, mode).
    Last,
    /// Order for EMBSlib. Entries are counted row by row, then mode by mode; the file lists the indices (row,
    /// mode, column) that the same count has mode by mode, then row by row.
    Rows,
}

impl ModeIndex {
    /// Returns the index order in words, as a reason for a layout.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Middle => "m1 has the mode as its middle index",
            Self::Last => "m1 has the mode as its last index",
            Self::Rows => "m1 is counted by rows, as EMBSlib reads it",
        }
    }

    /// Returns [row, column, mode] for the three indices of an entry of an array with `nrow` rows and `nq`
    /// modes.
    fn place(self, [first, second, third]: [usize; 3], nrow: usize, nq: usize) -> [usize; 3] {
        match self {
            Self::Middle => [first, third, second],
            Self::Last => [first, second, third],
            // An index that is too large remains too large, so that the check detects it.
            Self::Rows if first >= nrow || second >= nq => [first, third, second],
            Self::Rows => {
                let count = second * nrow + first;
                [count / nq, third, count % nq]
            }
        }
    }
}

const SIZES: [&str; 6] = ["order", "nrow", "ncol", "nq", "nqn", "structure"];

impl Taylor {
    /// Reads an object up to `end NAME`.
    pub(crate) fn read(lines: &mut Lines<'_>, head: &Line<'_>) -> Result<Self, Diagnostic> {
        let name = head.key.clone();
        let Listing { sizes, m0, m1, digits } = Listing::read(lines, &name)?;
        let size = |at: usize| {
            let message = format!("`{name}` has no `{}`", SIZES[at]);
            sizes[at].ok_or_else(|| lines.unreadable(head.number, message))
        };
        let object = Self {
            line: head.number,
            nrow: size(1)?,
            ncol: size(2)?,
            nq: size(3)?,
            structure: sizes[5].unwrap_or_else(|| inferred_structure(&name, &m0, &m1)),
            inferred: sizes[5].is_none(),
            name: name.clone(),
            m0,
            m1,
            digits,
        };
        match object.wrong(size(0)?, sizes[4]) {
            Some(wrong) => Err(lines.unreadable(head.number, format!("`{name}` {wrong}"))),
            None => Ok(object),
        }
    }

    /// Returns the reason why an object with this `order` and `nqn` cannot be read, if there is one.
    fn wrong(&self, order: usize, nqn: Option<usize>) -> Option<&'static str> {
        if order > 1 || nqn.is_some_and(|nqn| nqn > 0) {
            Some("has an order above 1")
        } else if order == 0 && !self.m1.is_empty() {
            Some("has order 0, but entries `m1`")
        } else if self.structure > 4 {
            Some("has a `structure` other than 0 to 4")
        } else {
            None
        }
    }

    /// Returns the number of entries.
    pub(crate) fn n_entries(&self) -> usize {
        self.m0.len() + self.m1.len()
    }

    /// Returns true if no entry is listed and the structure implies none.
    pub(crate) fn is_empty(&self) -> bool {
        self.n_entries() == 0 && self.structure != 4
    }

    /// Returns true if the indices of `m1` are valid in the order `modes`.
    pub(crate) fn admits(&self, modes: ModeIndex, nq: usize) -> bool {
        self.m1.iter().all(|entry| {
            let [_, column, mode] = modes.place(entry.index, self.nrow, nq);
            column < self.ncol && mode < nq
        })
    }

    /// Checks sizes and indices for a body with `nq` modes and the expected `shape` (nrow, ncol).
    pub(crate) fn check(
        &self,
        lines: &Lines<'_>,
        shape: (usize, usize),
        nq: usize,
        modes: ModeIndex,
    ) -> Result<(), Diagnostic> {
        if self.is_empty() {
            return Ok(());
        }
        let name = &self.name;
        if (self.nrow, self.ncol) != shape {
            let message = format!(
                "`{name}` is {} x {}, expected {} x {} for {nq} modes",
                self.nrow, self.ncol, shape.0, shape.1
            );
            return Err(lines.unreadable(self.line, message));
        }
        // Some programs leave nq at 0 if nothing depends on q.
        if self.nq != nq && !(self.nq == 0 && self.m1.is_empty()) {
            let message = format!("`{name}` has nq = {}, expected the {nq} modes of the body", self.nq);
            return Err(lines.unreadable(self.line, message));
        }
        for order in 0..2 {
            self.check_entries(lines, order, nq, modes)?;
        }
        Ok(())
    }

    /// Checks that the indices of M0 or M1 are within their limits and occur once.
    fn check_entries(
        &self,
        lines: &Lines<'_>,
        order: usize,
        nq: usize,
        modes: ModeIndex,
    ) -> Result<(), Diagnostic> {
        let name = &self.name;
        let entries = [&self.m0, &self.m1][order];
        let mut places: Vec<([usize; 3], usize)> =
            entries.iter().map(|entry| (entry.index, entry.line)).collect();
        for &(index, line) in &places {
            let [row, column, mode] =
                if order == 0 { [index[0], index[1], 0] } else { modes.place(index, self.nrow, nq) };
            if row >= self.nrow || column >= self.ncol || mode >= nq {
                let message = format!(
                    "an entry of `{name}` is outside its {} x {} numbers for {nq} modes",
                    self.nrow, self.ncol
                );
                return Err(lines.unreadable(line, message));
            }
            if order == 0 && self.structure == 1 && index[0] != column {
                let message =
                    format!("an entry of `{name}` is off the diagonal, but its `structure` is 1 (diagonal)");
                return Err(lines.unreadable(line, message));
            }
        }
        places.sort_unstable();
        if let Some(pair) = places.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let message = format!("an entry of `{name}` is repeated: it is in line {} already", pair[0].1);
            return Err(lines.unreadable(pair[1].1, message));
        }
        Ok(())
    }

    /// Returns M0.
    ///
    /// # Panics
    /// Panics if [`Taylor::check`] did not pass.
    pub(crate) fn constant(&self, (nrow, ncol): (usize, usize)) -> Mat<f64> {
        if self.structure == 4 && self.m0.is_empty() {
            return Mat::identity(nrow, ncol);
        }
        let mut all = Mat::zeros(nrow, ncol);
        self.m0.iter().for_each(|entry| all[(entry.index[0], entry.index[1])] = entry.value);
        self.mirror(&mut all);
        all
    }

    /// Returns M1_k of every mode; `None` if all are zero. Panics if [`Taylor::check`] did not pass.
    pub(crate) fn linear(
        &self,
        (nrow, ncol): (usize, usize),
        nq: usize,
        modes: ModeIndex,
    ) -> Option<Vec<Mat<f64>>> {
        if self.m1.iter().all(|entry| entry.value == 0.0) {
            return None;
        }
        let mut all = vec![Mat::zeros(nrow, ncol); nq];
        for entry in &self.m1 {
            let [row, column, mode] = modes.place(entry.index, nrow, nq);
            all[mode][(row, column)] = entry.value;
        }
        all.iter_mut().for_each(|one| self.mirror(one));
        Some(all)
    }

    /// Copies the listed triangle of a symmetric matrix to the other triangle.
    fn mirror(&self, a: &mut Mat<f64>) {
        if self.structure != 2 || a.nrows() != a.ncols() {
            return;
        }
        for i in 0..a.nrows() {
            for j in 0..i {
                if a[(i, j)] == 0.0 {
                    a[(i, j)] = a[(j, i)];
                } else if a[(j, i)] == 0.0 {
                    a[(j, i)] = a[(i, j)];
                }
            }
        }
    }
}

/// Lines of an object.
#[derive(Default)]
struct Listing {
    /// Sizes in the order of [`SIZES`].
    sizes: [Option<usize>; 6],
    m0: Vec<Entry>,
    m1: Vec<Entry>,
    digits: Digits,
}

impl Listing {
    fn read(lines: &mut Lines<'_>, name: &str) -> Result<Self, Diagnostic> {
        let end = format!("end {name}");
        let mut listing = Self::default();
        loop {
            let line = lines.next(name)?;
            if line.key == end {
                return Ok(listing);
            }
            if let Some(at) = SIZES.iter().position(|size| *size == line.key) {
                if listing.sizes[at].replace(lines.count(&line)?).is_some() {
                    return Err(lines.unreadable(line.number, format!("`{}` is given twice", line.key)));
                }
                continue;
            }
            let Some((order, index)) = place(&line.key) else {
                let message = format!("`{}` in `{name}`, expected a size, an entry or `{end}`", line.key);
                return Err(lines.unreadable(line.number, message));
            };
            let (value, text) = lines.number(&line)?;
            listing.digits.see(text);
            [&mut listing.m0, &mut listing.m1][order].push(Entry { index, line: line.number, value });
        }
    }
}

/// Returns the `structure` of an object that states none (ccx2sid writes none), inferred from its entries.
/// Objects that are symmetric by definition may list one triangle.
fn inferred_structure(name: &str, m0: &[Entry], m1: &[Entry]) -> usize {
    const SYMMETRIC: [&str; 5] = ["j", "mmi", "me", "ke", "de"];
    let all = || m0.iter().chain(m1);
    let beside = |sign: std::cmp::Ordering| all().any(|entry| entry.index[0].cmp(&entry.index[1]) == sign);
    let one_triangle = beside(std::cmp::Ordering::Less) != beside(std::cmp::Ordering::Greater);
    if all().next().is_none() {
        0
    } else if m1.is_empty() && SYMMETRIC.contains(&name) && one_triangle {
        2
    } else {
        3
    }
}

/// Parses `m0( 1, 2)` or `m1(1,2,3)`: order and indices from 0.
fn place(key: &str) -> Option<(usize, [usize; 3])> {
    let (name, rest) = key.split_once('(')?;
    let order = match name.trim_end() {
        "m0" => 0,
        "m1" => 1,
        _ => return None,
    };
    let indices = rest.strip_suffix(')')?;
    let mut index = [1usize; 3];
    let mut count = 0;
    for text in indices.split(',') {
        *index.get_mut(count)? = text.trim().parse().ok().filter(|i| *i >= 1)?;
        count += 1;
    }
    (count == 2 + order).then(|| (order, index.map(|i| i - 1)))
}
