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
    /// Whether the mode is the last index of `m1` instead of the middle one.
    pub(crate) mode_last: bool,
    /// Whether symmetric matrices list one triangle instead of both.
    pub(crate) triangle: bool,
    /// Whether `new modal` has a sign of equality and a name after it: readers of these files split the line
    /// there.
    pub(crate) named_modal: bool,
    /// Letter of exponents.
    pub(crate) exponent: char,
}

const FEMBS: Dialect = Dialect {
    name: "fembs",
    moments: ["mdCM", "J"],
    square_inertia: false,
    gr: Blocks::Component,
    ge: Blocks::Component,
    mode_last: false,
    triangle: false,
    named_modal: true,
    exponent: 'D',
};

/// All dialects, the usual one first.
pub(crate) const DIALECTS: [Dialect; 4] = [
    FEMBS,
    Dialect {
        name: "morembs",
        moments: ["mCM", "mmi"],
        triangle: true,
        named_modal: false,
        exponent: 'E',
        ..FEMBS
    },
    Dialect { name: "py-sid", gr: Blocks::Mode, ..FEMBS },
    Dialect {
        name: "fembeam",
        square_inertia: true,
        gr: Blocks::Mode,
        ge: Blocks::Mode,
        mode_last: true,
        // FEMBeam lists one triangle, but its reader mirrors none: of J it would lose the products of inertia
        // above the diagonal.
        triangle: false,
        named_modal: false,
        exponent: 'E',
        ..FEMBS
    },
];

/// Their names.
pub(crate) const NAMES: [&str; 4] = [DIALECTS[0].name, DIALECTS[1].name, DIALECTS[2].name, DIALECTS[3].name];
