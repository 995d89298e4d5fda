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
        let Self { rows, compare, parts, sums } = self;
        sums.clear();
        sums.resize(parts.len() * rows.len(), 0.0);
        // Plain loops: what extends a vector would be compiled by itself, without the instructions of the kernel.
        for (part, sums) in parts.iter().zip(sums.chunks_exact_mut(rows.len().max(1))) {
            let short = part.len() <= WIDTH && part.start + WIDTH <= compare.len();
            let compare_at = if short { Packet::load(&compare[part.start..]) } else { Packet::ZERO };
            for (row, sum) in rows.iter().zip(sums) {
                *sum = if short && part.start + WIDTH <= row.len() {
                    let differences = Packet::load(&row[part.start..]) - compare_at;
                    total(squares_of(differences, part.len()))
                } else {
                    squared_distance(row, compare, part)
                };
            }
        }
    }
}

/// `Σ (a - b)²` over a part of two rows, in eight sums side by side.
pub(crate) struct SquaredDistance<'a> {
    pub(crate) rows: [&'a [f64]; 2],
    pub(crate) part: &'a Range<usize>,
}

impl Kernel for SquaredDistance<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> f64 {
        squared_distance(self.rows[0], self.rows[1], self.part)
    }
}

#[inline(always)]
fn squared_distance(a: &[f64], b: &[f64], part: &Range<usize>) -> f64 {
    let (mut sums, mut at) = (Packet::ZERO, part.start);
    while at < part.end {
        let mut differences = Packet::ZERO;
        let count = part.end - at;
        if at + WIDTH <= a.len().min(b.len()) {
            differences = Packet::load(&a[at..]) - Packet::load(&b[at..]);
        } else {
            for lane in 0..count.min(WIDTH) {
                differences.0[lane] = a[at + lane] - b[at + lane];
            }
        }
        sums += squares_of(differences, count);
        at += WIDTH;
    }
    total(sums)
}

/// Squares of as many differences as there are, and zeros.
#[inline(always)]
fn squares_of(mut differences: Packet, count: usize) -> Packet {
    for lane in 0..WIDTH {
        differences.0[lane] = if lane < count { differences.0[lane] } else { 0.0 };
    }
    differences * differences
}

#[inline(always)]
fn total(sums: Packet) -> f64 {
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
