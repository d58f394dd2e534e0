//! Detection of arrays that are zero although other arrays require them.

use super::missed::largest_entry;
use crate::import::AuditCheck;
use crate::sid::read::arrays::{Array, Arrays};
use crate::sid::read::body::Declared;
use crate::sid::read::layout::Layout;
use flexbody_base::diagnostic::Code;
use nalgebra::Matrix3;

/// Largest part of its bound for which an array counts as zero. A larger value reports small arrays as
/// missing.
const ZERO_ARRAY: f64 = 1e-9;

/// Missing arrays, and the contradictions in words.
pub(crate) struct Missing {
    arrays: Vec<&'static str>,
    why: Vec<String>,
}

/// Largest entries of arrays and of their parts.
struct Sizes {
    mdcm1: f64,
    ct0: f64,
    cr0: f64,
    /// All of Cr1, and its part that is skew in the modes.
    cr1: [f64; 2],
    j1: f64,
    gr0: f64,
    /// Symmetric and skew part of the blocks of Gr.
    gr_parts: [f64; 2],
    ge: f64,
    oe0: f64,
    oe1: f64,
}

impl Sizes {
    fn of(arrays: &Arrays, layout: &Layout) -> Self {
        let nq = arrays.nq;
        let [constant, linear] = [0, 1].map(|order| move |array: &Array| array.sizes()[order]);
        let largest = |part: &dyn Fn(Matrix3<f64>) -> Matrix3<f64>| {
            (0..nq).map(|k| 0.5 * part(layout.gr.gr(arrays, k)).amax()).fold(0.0, f64::max)
        };
        let skew = |a: usize| largest_entry(nq, nq, |k, l| arrays.cr1_skew(k, l, a));
        Self {
            mdcm1: linear(&arrays.first_moment),
            ct0: constant(&arrays.ct),
            cr0: constant(&arrays.cr),
            cr1: [linear(&arrays.cr), (0..3).map(skew).fold(0.0, f64::max)],
            j1: linear(&arrays.inertia),
            gr0: constant(&arrays.gr),
            gr_parts: [largest(&|gr| gr + gr.transpose()), largest(&|gr| gr - gr.transpose())],
            ge: constant(&arrays.ge),
            oe0: constant(&arrays.oe),
            oe1: linear(&arrays.oe),
        }
    }

    /// Returns true if the modes move neither the centre of mass nor the angular momentum, like free modes,
    /// for which Cr0 is zero.
    fn are_free(&self, arrays: &Arrays) -> bool {
        let [bound_t, bound_r, _] = arrays.bounds();
        self.ct0.max(self.mdcm1) <= ZERO_ARRAY * bound_t && self.cr0 <= ZERO_ARRAY * bound_r
    }
}

/// Returns true if Cr0 is zero like for free modes, so that a skew part of Gr is an error of Gr.
pub(crate) fn is_free(arrays: &Arrays, layout: &Layout) -> bool {
    Sizes::of(arrays, layout).are_free(arrays)
}

impl Missing {
    pub(crate) fn find(arrays: &Arrays, layout: &Layout, declared: &Declared) -> Self {
        let mut found = Self { arrays: Vec::new(), why: Vec::new() };
        let sizes = Sizes::of(arrays, layout);
        let [bound_t, bound_r, bound_e] = arrays.bounds();
        let is = |size: f64, bound: f64| size > ZERO_ARRAY * bound;
        let [gr_even, gr_skew] = sizes.gr_parts.map(|part| is(part, bound_r));
        let [j1, cr0, oe0] = [sizes.j1, sizes.cr0, sizes.oe0].map(|size| is(size, bound_r));

        found.add_if_missing("Ct", sizes.ct0, &[(is(sizes.mdcm1, bound_t), "mdCM1 is not")]);
        found.add_if_missing("mdCM1", sizes.mdcm1, &[(is(sizes.ct0, bound_t), "Ct is not")]);
        if !sizes.are_free(arrays) {
            found.add_if_missing("Cr0", sizes.cr0, &[(gr_skew, "Gr has a skew part")]);
        }
        found.add_if_missing("Gr", sizes.gr0, &[(j1, "J1 is not"), (cr0, "Cr0 is not")]);
        found.add_if_missing("J1", sizes.j1, &[(gr_even, "Gr has a symmetric part"), (oe0, "Oe0 is not")]);
        found.add_if_missing("Oe0", sizes.oe0, &[(j1, "J1 is not")]);
        found.add_if_missing("Ge", sizes.ge, &[(is(sizes.cr1[1], bound_e), "Cr1 is not")]);
        let ge = is(sizes.ge, bound_e);
        if sizes.cr1[0] == 0.0 {
            found.add_if_missing("Cr1", 0.0, &[(ge, "Ge is not")]);
        } else if sizes.cr1[1] == 0.0 && ge {
            found.arrays.push("Cr1");
            found.why.push("Cr1 is symmetric in the modes although Ge is not zero".to_owned());
        }
        found.add_if_missing("Oe1", sizes.oe1, &[(bound_e > 0.0 && !declared.without_w2, "Me is not")]);
        found
    }

    fn add_if_missing(&mut self, name: &'static str, size: f64, witnesses: &[(bool, &str)]) {
        let because: Vec<&str> = witnesses.iter().filter(|(is, _)| *is).map(|(_, why)| *why).collect();
        if size == 0.0 && !because.is_empty() {
            self.arrays.push(name);
            self.why.push(format!("{name} is zero although {}", because.join(" and ")));
        }
    }

    /// Returns true if none of the arrays `names` is missing.
    pub(crate) fn none_of(&self, names: &[&str]) -> bool {
        names.iter().all(|name| !self.arrays.contains(name))
    }

    pub(crate) fn check(&self) -> AuditCheck {
        let why = if self.why.is_empty() { "nothing".to_owned() } else { self.why.join(", ") };
        AuditCheck {
            name: "coupling_is_there",
            formula: "number of arrays that are zero but must not be",
            value: self.arrays.len() as f64,
            limit: 0.0,
            code: Code::AuditCoupling,
            meaning: format!("the coupling of rigid motion and deformation is incomplete: {why}"),
        }
    }
}
