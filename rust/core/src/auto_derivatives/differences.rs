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
        let mut known = compare.len();
        for row in rows {
            known = known.min(row.len());
        }
        // The bits of the lanes within a part: most parts are of one length.
        let (mut count, mut within) = (0, [0_u64; WIDTH]);
        for (part, sums) in parts.iter().zip(sums.chunks_exact_mut(rows.len().max(1))) {
            if part.len() > WIDTH || part.start + WIDTH > known {
                for (row, sum) in rows.iter().zip(sums) {
                    *sum = squared_distance(row, compare, part);
                }
                continue;
            }
            if part.len() != count {
                count = part.len();
                for (lane, within) in within.iter_mut().enumerate() {
                    *within = if lane < count { u64::MAX } else { 0 };
                }
            }
            let compare_at = Packet::load(&compare[part.start..]);
            for (row, sum) in rows.iter().zip(sums) {
                let mut differences = Packet::load(&row[part.start..]) - compare_at;
                for (difference, within) in differences.0.iter_mut().zip(&within) {
                    *difference = f64::from_bits(difference.to_bits() & within);
                }
                *sum = total(differences * differences);
            }
        }
    }
}

/// `Σ (a - b)²` over a part of some rows and another one, each in eight sums side by side.
pub(crate) struct SquaredDistances<'a> {
    pub(crate) rows: &'a [&'a [f64]],
    pub(crate) compare: &'a [f64],
    pub(crate) part: &'a Range<usize>,
    pub(crate) sums: &'a mut [f64],
}

/// Rows that are summed at once: as many as hide how long a sum takes.
const ROWS: usize = 4;

impl Kernel for SquaredDistances<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        let Self { rows, compare, part, sums } = self;
        let (whole, rest) = rows.as_chunks::<ROWS>();
        let (first, last) = sums.split_at_mut(whole.len() * ROWS);
        for (rows, sums) in whole.iter().zip(first.chunks_exact_mut(ROWS)) {
            sums.copy_from_slice(&squared_distances(rows, compare, part));
        }
        for (row, sum) in rest.iter().zip(last) {
            *sum = squared_distance(row, compare, part);
        }
    }
}

/// The sums of several rows, with the bits of each.
#[inline(always)]
fn squared_distances<const COUNT: usize>(rows: &[&[f64]; COUNT], compare: &[f64], part: &Range<usize>) -> [f64; COUNT] {
    let (mut sums, mut at) = ([Packet::ZERO; COUNT], part.start);
    while at + WIDTH <= part.end {
        let other = Packet::load(&compare[at..]);
        for (sum, row) in sums.iter_mut().zip(rows) {
            let differences = Packet::load(&row[at..]) - other;
            *sum += differences * differences;
        }
        at += WIDTH;
    }
    let mut totals = [0.0; COUNT];
    for ((slot, mut sum), row) in totals.iter_mut().zip(sums).zip(rows) {
        for lane in 0..part.end - at {
            let difference = row[at + lane] - compare[at + lane];
            sum.0[lane] += difference * difference;
        }
        *slot = total(sum);
    }
    totals
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
pub(crate) fn total(sums: Packet) -> f64 {
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
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::dispatch;

    #[test]
    fn several_rows_have_the_bits_of_each() {
        let row = |index: usize| (0..100).map(|i| ((i * (index + 3)) as f64 * 0.37).sin()).collect::<Vec<f64>>();
        let all: Vec<Vec<f64>> = (0..6).map(row).collect();
        let rows: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
        let compare = row(9);
        for part in [0..100, 5..90, 3..11, 1..4, 7..7] {
            for instructions in Instructions::available() {
                let mut sums = [0.0; 6];
                let distances = SquaredDistances { rows: &rows, compare: &compare, part: &part, sums: &mut sums };
                dispatch(instructions, distances);
                for (sum, row) in sums.iter().zip(&rows) {
                    assert_eq!(sum.to_bits(), squared_distance(row, &compare, &part).to_bits(), "{part:?}");
                }
            }
        }
    }

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
