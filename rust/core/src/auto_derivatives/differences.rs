//! Sums of squared differences of rows.

use std::ops::Range;

use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::vectors::{Kernel, Lanes};

/// Sums the squared differences of some rows from another over parts of them.
pub(crate) struct SquaredDifferences<'a> {
    pub(crate) rows: &'a [Vec<f64>],
    pub(crate) compare: &'a [f64],
    pub(crate) parts: &'a [Range<usize>],
    /// A sum for each row of a part, part by part.
    pub(crate) sums: &'a mut Vec<f64>,
}

impl Kernel for SquaredDifferences<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        self.sums.clear();
        for part in self.parts {
            self.sums.extend(self.rows.iter().map(|row| squared_distance(row, self.compare, part)));
        }
    }
}

/// `Σ (a - b)²` over a part of two rows, in eight sums side by side.
#[inline(always)]
pub(crate) fn squared_distance(a: &[f64], b: &[f64], part: &Range<usize>) -> f64 {
    let mut sums = Packet::ZERO;
    for at in part.clone().step_by(WIDTH) {
        let mut differences = Packet::ZERO;
        let count = part.end - at;
        if at + WIDTH <= a.len().min(b.len()) {
            differences = Packet::load(&a[at..]) - Packet::load(&b[at..]);
            if count < WIDTH {
                // Beyond the part.
                for lane in 0..WIDTH {
                    differences.0[lane] = if lane < count { differences.0[lane] } else { 0.0 };
                }
            }
        } else {
            for lane in 0..count.min(WIDTH) {
                differences.0[lane] = a[at + lane] - b[at + lane];
            }
        }
        sums += differences * differences;
    }
    let [a, b, c, d, e, f, g, h] = sums.0;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// The same where both have a number, and how many these are.
pub(crate) fn known_squared_distance(a: &[f64], b: &[f64], part: &Range<usize>) -> (f64, f64) {
    let squares = a[part.clone()].iter().zip(&b[part.clone()]).map(|(a, b)| (a - b) * (a - b));
    squares.filter(|square| !square.is_nan()).fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_any_length_are_summed_wherever_they_lie() {
        let a: Vec<f64> = (0..30).map(f64::from).collect();
        let mut b = vec![1.0; 30];
        b[28] = f64::NAN;
        for first in 0..28 {
            for end in first..28 {
                let expected: f64 = (first..end).map(|i| (i as f64 - 1.0).powi(2)).sum();
                // Whole numbers are exact.
                assert_eq!(squared_distance(&a, &b, &(first..end)), expected);
                assert_eq!(known_squared_distance(&a, &b, &(first..end)), (expected, (end - first) as f64));
            }
        }
        assert!(squared_distance(&a, &b, &(20..29)).is_nan());
        assert_eq!(known_squared_distance(&a, &b, &(27..30)), (26.0 * 26.0 + 28.0 * 28.0, 2.0));
    }
}
