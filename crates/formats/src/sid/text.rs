//! Text of SID_FEM: objects, their entries and numbers.

use faer::Mat;
use std::fmt::Write;

/// Reason why `write!` cannot fail here.
const TO_A_STRING: &str = "writing to a String cannot fail";

/// Meaning of the listed entries of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Structure {
    /// All entries are zero.
    Zero,
    Symmetric,
    Full,
}

/// An object M0 + sum_k M1_k q_k of the file.
pub(crate) struct Taylor {
    pub(crate) name: &'static str,
    pub(crate) structure: Structure,
    /// Constant part (nrow x ncol).
    pub(crate) m0: Mat<f64>,
    /// Linear parts, nq matrices of nrow x ncol; `None` for an object of order 0.
    pub(crate) m1: Option<Vec<Mat<f64>>>,
}

impl Taylor {
    pub(crate) fn constant(name: &'static str, m0: Mat<f64>) -> Self {
        Self { name, structure: Structure::Full, m0, m1: None }
    }

    pub(crate) fn symmetric(name: &'static str, m0: Mat<f64>) -> Self {
        Self { structure: Structure::Symmetric, ..Self::constant(name, m0) }
    }

    pub(crate) fn zero(name: &'static str, nrow: usize, ncol: usize) -> Self {
        Self { structure: Structure::Zero, ..Self::constant(name, Mat::zeros(nrow, ncol)) }
    }

    pub(crate) fn linear(name: &'static str, m0: Mat<f64>, m1: Vec<Mat<f64>>) -> Self {
        Self { m1: Some(m1), ..Self::constant(name, m0) }
    }

    fn is_diagonal(&self) -> bool {
        let m0 = &self.m0;
        (0..m0.ncols()).all(|j| (0..m0.nrows()).all(|i| i == j || m0[(i, j)] == 0.0))
    }
}

/// Text of a file under construction.
pub(crate) struct Text<'d> {
    pub(crate) out: String,
    dialect: &'d Dialect,
    nq: usize,
}

impl<'d> Text<'d> {
    pub(crate) fn new(dialect: &'d Dialect, nq: usize) -> Self {
        Self { out: String::new(), dialect, nq }
    }

    /// Writes a line that is no assignment.
    pub(crate) fn line(&mut self, indent: usize, line: &str) {
        writeln!(self.out, "{:indent$}{line}", "").expect(TO_A_STRING);
    }

    /// Writes `key = value` with aligned signs of equality.
    pub(crate) fn value(&mut self, indent: usize, key: &str, value: impl std::fmt::Display) {
        let width = 48usize.saturating_sub(indent);
        writeln!(self.out, "{:indent$}{key:width$}= {value}", "").expect(TO_A_STRING);
    }

    /// Returns a number with 17 significant digits and an exponent of at least two digits:
    /// ` 1.2345678901234567D+00`.
    pub(crate) fn number(&self, value: f64) -> String {
        let text = format!("{value: >23.16e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let (sign, digits) = exponent.strip_prefix('-').map_or(('+', exponent), |digits| ('-', digits));
        format!("{mantissa}{}{sign}{digits:0>2}", self.dialect.exponent)
    }

    /// Writes an object with its nonzero entries.
    pub(crate) fn taylor(&mut self, indent: usize, object: &Taylor) {
        let Taylor { name, structure, m0, m1 } = object;
        self.line(indent, name);
        let symmetric = *structure == Structure::Symmetric;
        let code = match structure {
            Structure::Zero => 0,
            Structure::Symmetric if m1.is_none() && object.is_diagonal() => 1,
            Structure::Symmetric => 2,
            Structure::Full => 3,
        };
        let (inner, order) = (indent + 5, usize::from(m1.is_some()));
        let sizes = [("order", order), ("nrow", m0.nrows()), ("ncol", m0.ncols()), ("nq", self.nq)];
        for (key, value) in sizes.into_iter().chain([("nqn", 0), ("structure", code)]) {
            self.value(inner, key, format_args!("{value:4}"));
        }
        for i in 0..m0.nrows() {
            let columns = if symmetric && self.dialect.triangle { i + 1 } else { m0.ncols() };
            for j in 0..columns {
                let value = m0[(i, j)];
                if value != 0.0 {
                    let value = self.number(value);
                    self.value(inner, &format!("m0({:2},{:2})", i + 1, j + 1), value);
                }
            }
        }
        for (k, m1) in m1.iter().flatten().enumerate() {
            for i in 0..m1.nrows() {
                for j in 0..m1.ncols() {
                    let value = m1[(i, j)];
                    if value == 0.0 {
                        continue;
                    }
                    let indices = self.dialect.mode_index.indices([i, j, k], m1.nrows(), self.nq);
                    let [first, middle, last] = indices.map(|i| i + 1);
                    let value = self.number(value);
                    self.value(inner, &format!("m1({first:2},{middle:2},{last:2})"), value);
                }
            }
        }
        self.line(indent, &format!("end {name}"));
    }
}

// Differences of the dialects of SID_FEM.

/// Order of the columns of Gr and Ge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Blocks {
    /// Column a nq + k: the modes of one axis are adjacent.
    Component,
    /// Column 3 k + a: the axes of one mode are adjacent.
    Mode,
}

impl Blocks {
    /// Returns the column of axis `a` and mode `k`.
    pub(crate) fn column(self, a: usize, k: usize, nq: usize) -> usize {
        match self {
            Self::Component => a * nq + k,
            Self::Mode => 3 * k + a,
        }
    }
}

/// Meaning of the three indices of an entry `m1(., ., .)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ModeIndex {
    /// Order (row, mode, column).
    Middle,
    /// Order (row, column, mode).
    Last,
    /// Order for EMBSlib. Entries are counted row by row, then mode by mode, then by columns; the file lists
    /// for each entry the indices (row, mode, column) that the same count has mode by mode, then row by row.
    /// EMBSlib stores M1 in the second order and passes the numbers to a Modelica array, which takes them in
    /// the first.
    Rows,
}

impl ModeIndex {
    /// Returns the three indices, from 0, of an entry of an array with `nrow` rows and `nq` modes.
    pub(crate) fn indices(self, [row, column, mode]: [usize; 3], nrow: usize, nq: usize) -> [usize; 3] {
        match self {
            Self::Middle => [row, mode, column],
            Self::Last => [row, column, mode],
            Self::Rows => {
                let count = row * nq + mode;
                [count % nrow, count / nrow, column]
            }
        }
    }
}

/// Text after `new modal`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ModalName {
    /// Neither a name nor a sign of equality follows.
    Absent,
    /// Name of the body, after a sign of equality at which readers of these files split the line.
    OfBody,
    /// Word that is fixed for all bodies, because a reader searches the whole line for names of arrays.
    Fixed(&'static str),
}

/// Limits of a reader that writes beyond its memory if they are exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Limits {
    /// Largest number of frames, modes and columns.
    pub(crate) count: usize,
    /// Largest length of the first line in bytes.
    pub(crate) first_line: usize,
}

/// A dialect of SID_FEM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dialect {
    pub(crate) name: &'static str,
    /// Names of the first moment and of the inertia.
    pub(crate) moments: [&'static str; 2],
    /// True if J is a symmetric 3 x 3 matrix instead of a column of six.
    pub(crate) square_inertia: bool,
    pub(crate) gr: Blocks,
    pub(crate) ge: Blocks,
    mode_index: ModeIndex,
    /// True if symmetric matrices list one triangle instead of both.
    pub(crate) triangle: bool,
    pub(crate) modal_name: ModalName,
    /// Largest frame number that the reader accepts; `None` without a limit. If a node has another number
    /// than 1 to this one, the frames are numbered 1, 2, ... instead. `Some(0)` always numbers them.
    pub(crate) largest_frame: Option<i64>,
    pub(crate) limits: Option<Limits>,
    /// Letter of exponents.
    pub(crate) exponent: char,
}

const FEMBS: Dialect = Dialect {
    name: "fembs",
    moments: ["mdCM", "J"],
    square_inertia: false,
    gr: Blocks::Component,
    ge: Blocks::Component,
    mode_index: ModeIndex::Middle,
    triangle: false,
    modal_name: ModalName::OfBody,
    largest_frame: None,
    limits: None,
    exponent: 'D',
};

/// All dialects, the default first.
pub(crate) const DIALECTS: [Dialect; 5] = [
    FEMBS,
    Dialect {
        name: "morembs",
        moments: ["mCM", "mmi"],
        triangle: true,
        modal_name: ModalName::Absent,
        // matflex has an array of structures for all numbers up to the largest one.
        largest_frame: Some(1_000_000),
        exponent: 'E',
        ..FEMBS
    },
    Dialect { name: "py-sid", gr: Blocks::Mode, ..FEMBS },
    Dialect {
        name: "fembeam",
        square_inertia: true,
        gr: Blocks::Mode,
        ge: Blocks::Mode,
        mode_index: ModeIndex::Last,
        // FEMBeam lists one triangle, but its reader mirrors none: the products of inertia above the diagonal
        // of J would be lost.
        triangle: false,
        modal_name: ModalName::Absent,
        exponent: 'E',
        ..FEMBS
    },
    EMBS,
];

/// EMBSlib (Modelica, github.com/vwaurich/EMBS_ModelicaLib), from the source of its reader, `ReadSID_C.h` of
/// 2022-06-30. EMBSlib accepts the letter D only in exponents, five digits of an integer and 511 bytes of a
/// line. It takes any line that contains one of mdCM, J, Ct, Cr, Me, Gr, Ge, Oe, ksigma, Ke, De, frame,
/// refmod for the head of an array.
pub(crate) const EMBS: Dialect = Dialect {
    name: "embs",
    gr: Blocks::Mode,
    ge: Blocks::Mode,
    mode_index: ModeIndex::Rows,
    modal_name: ModalName::Fixed("body"),
    largest_frame: Some(0),
    limits: Some(Limits { count: 99_999, first_line: 511 }),
    ..FEMBS
};

/// Names of all dialects.
pub(crate) const NAMES: [&str; 5] =
    [DIALECTS[0].name, DIALECTS[1].name, DIALECTS[2].name, DIALECTS[3].name, DIALECTS[4].name];
