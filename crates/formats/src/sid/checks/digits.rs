//! Check of the digits that were lost in writing.

use crate::import::AuditCheck;
use crate::sid::read::arrays::{Array, Arrays, FrameArrays};
use crate::sid::read::parse::Listed;
use flexbody_base::diagnostic::Code;

/// Largest relative rounding of an array that is not reported as lost digits. A larger value accepts files
/// with fewer digits.
const MAX_DIGIT_ROUNDING: f64 = 1e-8;

/// Constant (order 0) or linear (order 1) part of an array, with half a unit of its last digit and its
/// largest number.
struct Part {
    array: &'static str,
    order: usize,
    rounding: f64,
    size: f64,
}

impl Part {
    fn lost(&self) -> f64 {
        if self.size > 0.0 { self.rounding / self.size } else { 0.0 }
    }
}

/// Returns the check of the part with the largest loss of digits.
pub(super) fn digits(listed: &Listed<'_>, arrays: &Arrays, frames: &[FrameArrays]) -> AuditCheck {
    let mut parts = parts_of_body(arrays);
    parts.extend(parts_of_frames(frames));
    parts.push(Part { array: "mass", order: 0, rounding: arrays.mass_rounding, size: arrays.mass.abs() });
    let most = parts.iter().max_by(|a, b| a.lost().total_cmp(&b.lost()));
    let (value, place) = most.map_or((0.0, String::new()), |most| {
        let Part { array, order, size, .. } = most;
        (most.lost(), format!("{array} (m{order}), whose largest is {size:.1e}"))
    });
    AuditCheck {
        name: "digits",
        formula: "half a unit of the last digit / largest number of each array",
        value,
        limit: MAX_DIGIT_ROUNDING,
        code: Code::AuditDigits,
        meaning: format!("numbers have {}; the loss is largest in {place}", listed.digits().words()),
    }
}

fn parts_of_body(arrays: &Arrays) -> Vec<Part> {
    let named = [
        ("mdCM", &arrays.first_moment),
        ("J", &arrays.inertia),
        ("Ct", &arrays.ct),
        ("Cr", &arrays.cr),
        ("Me", &arrays.me),
        ("Gr", &arrays.gr),
        ("Ge", &arrays.ge),
        ("Oe", &arrays.oe),
        ("Ke", &arrays.ke),
        ("De", &arrays.de),
    ];
    let both_orders = |(name, array): (&'static str, &Array)| {
        let sizes = array.sizes();
        [0, 1].map(|order| Part { array: name, order, rounding: array.rounding[order], size: sizes[order] })
    };
    named.into_iter().flat_map(both_orders).collect()
}

/// Returns the constant parts of the arrays of frames, each from the frame with the largest loss.
fn parts_of_frames(frames: &[FrameArrays]) -> [Part; 3] {
    type Chosen = fn(&FrameArrays) -> Option<&Array>;
    let named: [(&'static str, Chosen); 3] = [
        ("origin", |frame| Some(&frame.origin)),
        ("phi", |frame| Some(&frame.phi)),
        ("psi", |frame| frame.psi.as_ref()),
    ];
    named.map(|(name, chosen)| {
        let rounding_and_size = |frame: &FrameArrays| {
            chosen(frame).map_or((0.0, 0.0), |array| (array.rounding[0], array.sizes()[0]))
        };
        let most = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.max(b.1));
        let (rounding, size) = frames.iter().map(rounding_and_size).fold((0.0, 0.0), most);
        Part { array: name, order: 0, rounding, size }
    })
}
