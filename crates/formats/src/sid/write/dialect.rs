//! What the dialects of SID_FEM differ in.

/// Which index runs fastest in the columns of Gr and Ge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Blocks {
    /// Column a nq + k: the modes of one axis beside each other.
    Component,
    /// Column 3 k + a: the axes of one mode beside each other.
    Mode,
}

impl Blocks {
    /// Column of axis `a` and mode `k`.
    pub(crate) fn column(self, a: usize, k: usize, nq: usize) -> usize {
        match self {
            Self::Component => a * nq + k,
            Self::Mode => 3 * k + a,
        }
    }
}

/// Places of the indices of an entry of M1 in `m1(., ., .)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ModeIndex {
    /// (row, mode, column).
    Middle,
    /// (row, column, mode).
    Last,
    /// Entries are counted row by row, then mode by mode, then by columns; the file has for each the place (row, mode,
    /// column) that it has when entries are counted mode by mode, then row by row. EMBSlib stores M1 in the second
    /// order and hands the numbers on to an array of Modelica, which takes them in the first.
    Rows,
}

impl ModeIndex {
    /// The three indices, from 0, of an entry of an array of `nrow` rows and `nq` modes.
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

/// Word behind `new modal =`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ModalName {
    /// Neither a word nor a sign of equality.
    Absent,
    /// The name of the body. Readers of these files split the line at the sign of equality.
    OfBody,
    /// A word that is fixed for all bodies: a reader looks for names of arrays in all of the line.
    Fixed(&'static str),
}

/// Limits of a reader that overruns its memory beyond them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Limits {
    /// Largest number of frames, modes and columns.
    pub(crate) count: usize,
    /// Bytes of the first line.
    pub(crate) first_line: usize,
}

/// A dialect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dialect {
    pub(crate) name: &'static str,
    /// Names of the first moment and of the inertia.
    pub(crate) moments: [&'static str; 2],
    /// Whether J is a symmetric 3 x 3 matrix instead of a column of six.
    pub(crate) square_inertia: bool,
    pub(crate) gr: Blocks,
    pub(crate) ge: Blocks,
    pub(crate) mode_index: ModeIndex,
    /// True if symmetric matrices list one triangle instead of both.
    pub(crate) triangle: bool,
    pub(crate) modal_name: ModalName,
    /// Largest number of a frame, for a reader that has room for no other than 1 to this one: frames are counted if one
    /// of their nodes has another. `Some(0)` always counts them.
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

/// All dialects, the usual one first.
pub(crate) const DIALECTS: [Dialect; 5] = [
    FEMBS,
    Dialect {
        name: "morembs",
        moments: ["mCM", "mmi"],
        triangle: true,
        modal_name: ModalName::Absent,
        // matflex has an array of structures with all numbers up to the largest one.
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
        // FEMBeam lists one triangle, but its reader mirrors none: of J it would lose the products of inertia
        // above the diagonal.
        triangle: false,
        modal_name: ModalName::Absent,
        exponent: 'E',
        ..FEMBS
    },
    EMBS,
];

/// EMBSlib (Modelica, github.com/vwaurich/EMBS_ModelicaLib), by the source of its reader, `ReadSID_C.h` of 2022-06-30.
/// EMBSlib knows the letter D alone in exponents, holds five digits of a whole number and 511 bytes of a line, and takes a
/// line for the head of an array wherever one of mdCM, J, Ct, Cr, Me, Gr, Ge, Oe, ksigma, Ke, De, frame, refmod
/// stands in it.
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

/// Their names.
pub(crate) const NAMES: [&str; 5] =
    [DIALECTS[0].name, DIALECTS[1].name, DIALECTS[2].name, DIALECTS[3].name, DIALECTS[4].name];
