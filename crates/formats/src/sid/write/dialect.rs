//! Differences of the dialects of SID_FEM.

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
pub(crate) enum ModeIndex {
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
    pub(crate) mode_index: ModeIndex,
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
