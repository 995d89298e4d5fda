//! Numbers of twice the precision: an unevaluated sum of two `f64`, about 32 decimal digits.
//!
//! Only tables are computed with it (see [`crate::local_polynomials::basis`]): three-term recurrences lose digits from
//! degree to degree, and a table that is rounded once, at the end, leaves every later error to the arithmetic on the
//! samples. The operations are the classic error-free transformations of Dekker and Knuth.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// An unevaluated sum `high + low` with `|low| ≤ ulp(high) / 2`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DoubleDouble {
    high: f64,
    low: f64,
}

/// `a + b` and its rounding error, exact for any two numbers.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// `a + b` and its rounding error, exact where `|a| ≥ |b|`.
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    DoubleDouble { high, low: b - (high - a) }
}

/// `a · b` and its rounding error, exact barring underflow.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

impl DoubleDouble {
    pub(crate) const ZERO: Self = Self { high: 0.0, low: 0.0 };
    pub(crate) const ONE: Self = Self { high: 1.0, low: 0.0 };

    /// The nearest `f64`.
    pub(crate) fn to_f64(self) -> f64 {
        self.high
    }

    /// The square root of a positive number: one Newton step from the root of the high part.
    pub(crate) fn sqrt(self) -> Self {
        debug_assert!(self.high > 0.0, "square roots are taken of norms and recurrence coefficients only");
        let root = self.high.sqrt();
        let (square, error) = two_product(root, root);
        let remainder = self - Self { high: square, low: error };
        quick_two_sum(root, remainder.high / (2.0 * root))
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;

    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (high, high_error) = two_sum(self.high, other.high);
        let (low, low_error) = two_sum(self.low, other.low);
        let sum = quick_two_sum(high, high_error + low);
        quick_two_sum(sum.high, sum.low + low_error)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + (-other)
    }
}

impl Mul for DoubleDouble {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let (product, error) = two_product(self.high, other.high);
        let cross = self.high.mul_add(other.low, self.low * other.high);
        quick_two_sum(product, error + cross)
    }
}

impl Div for DoubleDouble {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let remainder = self - other * Self::from(first);
        let second = remainder.high / other.high;
        let remainder = remainder - other * Self::from(second);
        let third = remainder.high / other.high;
        let sum = quick_two_sum(first, second);
        sum + Self::from(third)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Relative error allowed for one operation: a few units in the last of 106 bits.
    const TOLERANCE: f64 = 1e-30;

    fn operand() -> impl Strategy<Value = DoubleDouble> {
        (1e-3..1e3_f64, -1.0..1.0_f64)
            .prop_map(|(high, low)| DoubleDouble::from(high) + DoubleDouble::from(low * high * 1e-17))
    }

    fn relative(difference: DoubleDouble, scale: DoubleDouble) -> f64 {
        (difference.to_f64() / scale.to_f64()).abs()
    }

    proptest! {
        #[test]
        fn division_undoes_multiplication(a in operand(), b in operand()) {
            prop_assert!(relative(a * b / b - a, a) < TOLERANCE);
        }

        #[test]
        fn the_root_squared_is_the_number(a in operand()) {
            prop_assert!(relative(a.sqrt() * a.sqrt() - a, a) < TOLERANCE);
        }

        #[test]
        fn subtraction_keeps_what_single_precision_drops(a in operand(), tiny in 1e-30..1e-20_f64) {
            let tiny = DoubleDouble::from(tiny);
            prop_assert!(relative(((a + tiny) - a) - tiny, a) < TOLERANCE);
        }
    }
}
