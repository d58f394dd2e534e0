//! Double-double arithmetic: a number is the unevaluated sum of two, with 106 bits.
//!
//! The crate `twofloat` is not used: its sums take six times as long, because its products call the fused multiply-add
//! as a function and its sums do not vectorise. Algorithms and error bounds: M. Joldes, J.-M. Muller, V. Popescu,
//! *Tight and rigorous error bounds for basic building blocks of double-word arithmetic*, ACM Trans. Math. Softw. 44
//! (2017). With u = 2^-53, relative errors are at most 3 u^2 for a sum, 4 u^2 for a product and 15 u^2 for a quotient,
//! without overflow or underflow.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number hi + lo, where hi is the sum rounded to the nearest f64.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DoubleDouble {
    /// Number rounded to f64.
    pub hi: f64,
    /// Remainder.
    pub lo: f64,
}

/// Returns s and e with a + b = s + e exactly.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// Returns s and e with a + b = s + e exactly, for |a| >= |b|.
#[inline(always)]
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

/// Returns p and e with a b = p + e exactly.
#[inline(always)]
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    (p, a.mul_add(b, -p))
}

impl DoubleDouble {
    /// Returns a + b exactly.
    pub fn sum(a: f64, b: f64) -> Self {
        let (hi, lo) = two_sum(a, b);
        Self { hi, lo }
    }

    /// Returns a b exactly.
    pub fn product(a: f64, b: f64) -> Self {
        let (hi, lo) = two_product(a, b);
        Self { hi, lo }
    }

    /// Returns the square root; NaN for negative numbers.
    pub fn sqrt(self) -> Self {
        if self.hi == 0.0 {
            return self;
        }
        // One Newton step from the root of the leading part.
        let root = self.hi.sqrt();
        let (p, e) = two_product(root, root);
        let (hi, lo) = fast_two_sum(root, ((self.hi - p) - e + self.lo) / (2.0 * root));
        Self { hi, lo }
    }

    /// Returns a lower bound in f64, at most three units in the last place below the number.
    pub fn below(self) -> f64 {
        self.hi.next_down().next_down()
    }

    /// Returns an upper bound in f64, at most three units in the last place above the number.
    pub fn above(self) -> f64 {
        self.hi.next_up().next_up()
    }
}

impl From<f64> for DoubleDouble {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (s, e) = two_sum(self.hi, other.hi);
        let (t, f) = two_sum(self.lo, other.lo);
        let (s, e) = fast_two_sum(s, e + t);
        let (hi, lo) = fast_two_sum(s, e + f);
        Self { hi, lo }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let (p, e) = two_product(self.hi, other.hi);
        let cross = self.hi.mul_add(other.lo, self.lo * other.lo);
        let (hi, lo) = fast_two_sum(p, e + self.lo.mul_add(other.hi, cross));
        Self { hi, lo }
    }
}

impl Mul<f64> for DoubleDouble {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        let (p, e) = two_product(self.hi, factor);
        let (hi, lo) = fast_two_sum(p, self.lo.mul_add(factor, e));
        Self { hi, lo }
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let quotient = self.hi / other.hi;
        let rest = self - other * quotient;
        let (hi, lo) = fast_two_sum(quotient, (rest.hi + rest.lo) / other.hi);
        Self { hi, lo }
    }
}

/// Adds a x to hi + lo, lane by lane, with exact products.
///
/// After N additions the error of a lane is at most 4 u^2 (N + 1) times its sum of all |a x|.
#[inline(always)]
pub fn accumulate<const W: usize>(hi: &mut [f64; W], lo: &mut [f64; W], a: f64, x: &[f64; W]) {
    for w in 0..W {
        let (p, e) = two_product(a, x[w]);
        let (s, t) = two_sum(hi[w], p);
        (hi[w], lo[w]) = fast_two_sum(s, t + (e + lo[w]));
    }
}

/// Adds a (x + y) to hi + lo, lane by lane, for |y| <= u |x|. After N additions the error of a lane is at most
/// 4 u^2 (N + 3) times its sum of all |a x|.
#[inline(always)]
pub fn accumulate_pair<const W: usize>(
    hi: &mut [f64; W],
    lo: &mut [f64; W],
    a: f64,
    (x, y): (&[f64; W], &[f64; W]),
) {
    for w in 0..W {
        let (p, e) = two_product(a, x[w]);
        let (s, t) = two_sum(hi[w], p);
        (hi[w], lo[w]) = fast_two_sum(s, t + (a.mul_add(y[w], e) + lo[w]));
    }
}

/// Runs `work` compiled for the instruction set of this processor. The result has the same bits on every processor.
pub fn with_fma<R>(work: impl FnOnce() -> R) -> R {
    struct Work<F>(F);
    impl<R, F: FnOnce() -> R> pulp::NullaryFnOnce for Work<F> {
        type Output = R;
        #[inline(always)]
        fn call(self) -> R {
            (self.0)()
        }
    }
    pulp::Arch::new().dispatch(Work(work))
}
