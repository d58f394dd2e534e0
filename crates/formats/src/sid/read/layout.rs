//! Dialect of a file, from its names and from its numbers.

use super::arrays::Arrays;
use super::parse::Listed;
use super::taylor::ModeIndex;
use crate::import::digits::Digits;
use nalgebra::Matrix3;

/// Order of the columns of Gr and Ge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Blocks {
    /// Column a nq + k for axis a and mode k.
    Component,
    /// Column 3 k + a for axis a and mode k.
    Mode,
}

impl Blocks {
    /// Both column orders.
    const ALL: [Self; 2] = [Self::Component, Self::Mode];

    /// Returns the order in words: `component-blocked` or `mode-blocked`.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Component => "component-blocked",
            Self::Mode => "mode-blocked",
        }
    }

    fn column(self, a: usize, k: usize, nq: usize) -> usize {
        match self {
            Self::Component => a * nq + k,
            Self::Mode => 3 * k + a,
        }
    }

    /// Returns Gr_k.
    pub(crate) fn gr(self, arrays: &Arrays, k: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|row, a| arrays.gr.m0[(row, self.column(a, k, arrays.nq))])
    }

    /// Returns max |sym(Gr_k) - J1_k| and max |skew(Gr_k) + Cr0_k~|.
    pub(crate) fn gr_misfit(self, arrays: &Arrays) -> [f64; 2] {
        let misfit = |k: usize| {
            let gr = self.gr(arrays, k);
            let (even, odd) = (0.5 * (gr + gr.transpose()), 0.5 * (gr - gr.transpose()));
            [(even - arrays.j1(k)).amax(), (odd + arrays.cr0(k).cross_matrix()).amax()]
        };
        (0..arrays.nq).map(misfit).fold([0.0; 2], |most, now| [most[0].max(now[0]), most[1].max(now[1])])
    }

    /// Returns max |Ge(k; l, a) - (Cr1(k, l, a) - Cr1(l, k, a))|.
    pub(crate) fn ge_misfit(self, arrays: &Arrays) -> f64 {
        self.ge_beside(arrays, |k, l, a| arrays.cr1_skew(k, l, a))
    }

    /// Returns max |Ge(k; l, a) - 2 Cr1(k, l, a)|, which equals the other misfit if Cr1 is skew in the modes.
    pub(crate) fn ge_doubled(self, arrays: &Arrays) -> f64 {
        self.ge_beside(arrays, |k, l, a| 2.0 * arrays.cr.linear(l, k, a))
    }

    fn ge_beside(self, arrays: &Arrays, expected: impl Fn(usize, usize, usize) -> f64) -> f64 {
        let nq = arrays.nq;
        let mut most = 0.0f64;
        for l in 0..nq {
            for a in 0..3 {
                let column = self.column(a, l, nq);
                for k in 0..nq {
                    most = most.max((arrays.ge.m0[(k, column)] - expected(k, l, a)).abs());
                }
            }
        }
        most
    }
}

/// Largest ratio of the misfits of two layouts for which the smaller one decides. A larger value decides on
/// less evidence.
const MAX_MISFIT_RATIO: f64 = 0.1;

/// Returns the layout with the clearly smaller misfit; `None` if both are similar.
fn fitting(misfit: impl Fn(Blocks) -> f64) -> Option<Blocks> {
    let [component, mode] = Blocks::ALL.map(misfit);
    if component < MAX_MISFIT_RATIO * mode {
        Some(Blocks::Component)
    } else if mode < MAX_MISFIT_RATIO * component {
        Some(Blocks::Mode)
    } else {
        None
    }
}

/// Dialects with their layouts; the first dialect of a layout is assumed if names do not decide.
const DIALECTS: [(&str, Blocks, Blocks); 5] = [
    ("fembs", Blocks::Component, Blocks::Component),
    ("py-sid", Blocks::Mode, Blocks::Component),
    ("embs", Blocks::Mode, Blocks::Mode),
    ("morembs", Blocks::Component, Blocks::Component),
    ("fembeam", Blocks::Mode, Blocks::Mode),
];

/// Earlier name of the layout of `embs`.
const MODE_BLOCKED: &str = "mode-blocked";

/// Detected dialect.
pub(crate) struct Layout {
    pub(crate) dialect: &'static str,
    /// Dialect and layout declared by names; `None` if the names do not decide.
    pub(crate) declared: Option<(&'static str, Blocks, Blocks)>,
    /// Orders of Gr and Ge found from the numbers.
    pub(crate) gr: Blocks,
    pub(crate) ge: Blocks,
    pub(crate) reason: String,
}

impl Layout {
    pub(crate) fn detect(listed: &Listed<'_>, arrays: &Arrays) -> Self {
        let (name, reason) = declared(listed);
        let dialect_named = |name: &str| DIALECTS.into_iter().find(|(known, ..)| *known == name);
        let declared = name.and_then(dialect_named);
        let found = [
            fitting(|blocks| {
                let [even, odd] = blocks.gr_misfit(arrays);
                even.max(odd)
            }),
            fitting(|blocks| blocks.ge_misfit(arrays).min(blocks.ge_doubled(arrays))),
        ];
        let usual = declared.map_or((Blocks::Component, Blocks::Component), |(_, gr, ge)| (gr, ge));
        let (gr, ge) = (found[0].unwrap_or(usual.0), found[1].unwrap_or(usual.1));
        let by_numbers = DIALECTS.into_iter().find(|&(_, a, b)| (a, b) == (gr, ge)).map(|(name, ..)| name);
        let dialect = match declared {
            Some((name, ..)) => name,
            None => by_numbers.unwrap_or("none"),
        };
        let reason =
            format!("{reason}; Gr is {}, Ge is {}, {}", gr.words(), ge.words(), listed.modes.words());
        Self { dialect, declared, gr, ge, reason }
    }
}

/// Reads the arrays. If no name states the dialect, `m1` is taken as counted by rows if J1 is the symmetric
/// part of Gr only in that order.
pub(crate) fn arrays_in_order(listed: &mut Listed<'_>, digits: Digits) -> Arrays {
    let arrays = Arrays::new(listed, digits);
    if listed.modes != ModeIndex::Middle || declared(listed).0.is_some() || arrays.inertia.m1.is_none() {
        return arrays;
    }
    let misfit = |arrays: &Arrays, blocks: Blocks| blocks.gr_misfit(arrays)[0];
    let usual = Blocks::ALL.map(|blocks| misfit(&arrays, blocks)).into_iter().fold(f64::INFINITY, f64::min);
    listed.modes = ModeIndex::Rows;
    let by_rows = Arrays::new(listed, digits);
    if misfit(&by_rows, Blocks::Mode) < MAX_MISFIT_RATIO * usual {
        return by_rows;
    }
    listed.modes = ModeIndex::Middle;
    arrays
}

/// Returns the dialect declared by names, and the reason.
fn declared<'l>(listed: &'l Listed<'_>) -> (Option<&'l str>, String) {
    if let Some(name) = listed.named_dialect() {
        let name = if name == MODE_BLOCKED { "embs" } else { name };
        (Some(name), format!("the first line names the dialect {name}"))
    } else if listed.has_morembs_names() {
        (Some("morembs"), "the first moment is called mCM or the inertia mmi".to_owned())
    } else if listed.comment.contains("PY_SID") {
        (Some("py-sid"), "the first line names PY_SID".to_owned())
    } else if listed.has_square_inertia() || listed.modes == ModeIndex::Last {
        (Some("fembeam"), "J is 3 x 3 or m1 has the mode last".to_owned())
    } else {
        (None, "no name in the file tells the dialect".to_owned())
    }
}
