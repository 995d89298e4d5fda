//! Sums over rows and their neighbours, as vector kernels: products at every distance, and neighbours with weights.

use std::ops::Range;

use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Adds a column to some of its rows, each row's neighbours with a weight for those that come later and one for those that came before.
pub(crate) struct AddNeighbours<'a, W> {
    /// Neighbours nearer than that are added, each row itself among them.
    pub(crate) lags: usize,
    pub(crate) column: &'a [f64],
    pub(crate) rows: Range<usize>,
    /// By distance.
    pub(crate) weights: W,
    pub(crate) sums: &'a mut [f64],
}

impl<W: Fn(usize) -> [f64; 2]> Kernel for AddNeighbours<'_, W> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let Self { lags, column, rows, weights, sums } = self;
        let weights: Vec<[f64; 2]> = (0..lags).map(weights).collect();
        // Rows that have all neighbours, as many as are summed at once.
        let first = rows.start.max(lags).min(rows.end);
        let whole = column.len().saturating_sub(lags).min(rows.end).saturating_sub(first) / BESIDE * BESIDE;
        let (before, rest) = sums.split_at_mut(first - rows.start);
        let (inside, after) = rest.split_at_mut(whole);
        add_at_ends(&weights, column, rows.start..first, before);
        for (sums, row) in inside.as_chunks_mut::<BESIDE>().0.iter_mut().zip((first..).step_by(BESIDE)) {
            add_inside(&weights, column, row, sums);
        }
        add_at_ends(&weights, column, first + whole..rows.end, after);
    }
}

/// Rows whose sums are kept in registers.
const BESIDE: usize = 32;

/// Adds all neighbours of some rows. In the order of [`add_at_ends`].
#[inline(always)]
fn add_inside(weights: &[[f64; 2]], column: &[f64], row: usize, into: &mut [f64; BESIDE]) {
    let mut sums = *into;
    for (lag, &[later, before]) in weights.iter().enumerate() {
        let (late, early) = (column[row + lag..].first_chunk::<BESIDE>(), column[row - lag..].first_chunk::<BESIDE>());
        let (Some(late), Some(early)) = (late, early) else { return };
        for (sum, value) in sums.iter_mut().zip(late) {
            *sum += later * value;
        }
        if lag > 0 {
            for (sum, value) in sums.iter_mut().zip(early) {
                *sum += before * value;
            }
        }
    }
    *into = sums;
}

/// Adds the neighbours that some rows have.
#[inline(always)]
fn add_at_ends(weights: &[[f64; 2]], column: &[f64], rows: Range<usize>, sums: &mut [f64]) {
    for (lag, &[later, before]) in weights.iter().enumerate() {
        // The last rows have no neighbours so far behind them.
        let late = column.get(rows.start + lag..).unwrap_or_default();
        for (sum, value) in sums.iter_mut().zip(late) {
            *sum += later * value;
        }
        if lag > 0 && rows.end > lag {
            let first = rows.start.max(lag);
            let early = &column[first - lag..rows.end - lag];
            for (sum, value) in sums[first - rows.start..].iter_mut().zip(early) {
                *sum += before * value;
            }
        }
    }
}

/// The dot product of two columns.
pub(crate) fn sum_of_products(one: &[f64], other: &[f64]) -> f64 {
    let mut sum = SumOfProducts::default();
    sum.add(one, other);
    sum.value()
}

/// The dot product of two columns that come in pieces, in eight sums side by side: a single one would wait for every addition. Whatever the
/// pieces are, the bits are the same.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SumOfProducts {
    lanes: [f64; 8],
    /// What the rows beyond the last eight add.
    rest: f64,
}

impl SumOfProducts {
    /// Adds a piece of both columns: a multiple of eight rows, but for the last.
    pub(crate) fn add(&mut self, one: &[f64], other: &[f64]) {
        dispatch(Instructions::current(), DotProduct { one, other, sum: self });
    }

    pub(crate) fn value(&self) -> f64 {
        self.lanes.iter().sum::<f64>() + self.rest
    }
}

/// What [`SumOfProducts::add`] does.
struct DotProduct<'a> {
    one: &'a [f64],
    other: &'a [f64],
    sum: &'a mut SumOfProducts,
}

impl Kernel for DotProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let ((one, one_rest), (other, other_rest)) = (self.one.as_chunks::<8>(), self.other.as_chunks::<8>());
        let mut sums = self.sum.lanes;
        for (one, other) in one.iter().zip(other) {
            for lane in 0..8 {
                sums[lane] += one[lane] * other[lane];
            }
        }
        self.sum.lanes = sums;
        self.sum.rest = one_rest.iter().zip(other_rest).map(|(a, b)| a * b).sum();
    }
}

/// Distances whose products are summed at once.
const TOGETHER: usize = 8;

/// Chunks of eight rows that all distances see before the next: they stay in the nearest cache.
const CHUNKS: usize = 256;

/// The products of a column with itself at every distance, summed: several distances at once, with the bits of [`sum_of_products`].
pub(crate) struct LaggedProducts<'a> {
    pub(crate) values: &'a [f64],
    /// By distance.
    pub(crate) sums: &'a mut [f64],
}

impl Kernel for LaggedProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        let Self { values, sums } = self;
        // Chunks of eight that all distances of a group have.
        let common = |group: usize| values.len().saturating_sub((group + 1) * TOGETHER) / 8;
        let (early, _) = values.as_chunks::<8>();
        let mut groups = vec![[[0.0; 8]; TOGETHER]; sums.len().div_ceil(TOGETHER)];
        for first in (0..early.len()).step_by(CHUNKS) {
            for (group, kept) in groups.iter_mut().enumerate() {
                let mut all = *kept;
                let chunks = first..common(group).min(first + CHUNKS);
                for (early, chunk) in early[first..].iter().zip(chunks) {
                    let late = values[chunk * 8 + group * TOGETHER..].first_chunk::<{ TOGETHER + 8 }>();
                    let Some(late) = late else { break };
                    for (lag, sums) in all.iter_mut().enumerate() {
                        for lane in 0..8 {
                            sums[lane] += early[lane] * late[lag + lane];
                        }
                    }
                }
                *kept = all;
            }
        }
        for (group, (sums, all)) in sums.chunks_mut(TOGETHER).zip(groups).enumerate() {
            let common = common(group);
            for (lag, (sum, mut lanes)) in (group * TOGETHER..).zip(sums.iter_mut().zip(all)) {
                let rows = values.len().saturating_sub(lag);
                let (early, late) = (&values[..rows], &values[values.len() - rows..]);
                let ((early, early_rest), (late, late_rest)) = (early.as_chunks::<8>(), late.as_chunks::<8>());
                for (early, late) in early.iter().zip(late).skip(common) {
                    for lane in 0..8 {
                        lanes[lane] += early[lane] * late[lane];
                    }
                }
                let rest: f64 = early_rest.iter().zip(late_rest).map(|(a, b)| a * b).sum();
                *sum = lanes.iter().sum::<f64>() + rest;
            }
        }
    }
}

/// `Σ_k a(k) b(k + lag)` for two kernels of one length.
pub(crate) fn products(one: &[f64], other: &[f64], lag: usize) -> f64 {
    if lag >= one.len() {
        return 0.0;
    }
    sum_of_products(&one[..one.len() - lag], &other[lag..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_added_in_the_same_order_everywhere() {
        let weights: Vec<[f64; 2]> = (0..9).map(|lag| [1.0 / f64::from(lag + 1), 0.3 - f64::from(lag)]).collect();
        for count in [0, 5, 9, 18, 41, 50, 120] {
            let column: Vec<f64> = (0..count).map(|row| (row as f64 * 0.7).sin()).collect();
            for rows in [0..count, count / 3..count, 0..count / 2, count / 4..count - count / 4] {
                let lags = weights.len().min(count);
                let (mut expected, mut found) = (vec![0.1; rows.len()], vec![0.1; rows.len()]);
                add_at_ends(&weights[..lags], &column, rows.clone(), &mut expected);
                let (column, sums) = (&*column, &mut *found);
                let weights = |lag: usize| weights[lag];
                dispatch(Instructions::current(), AddNeighbours { lags, column, rows: rows.clone(), weights, sums });
                let bits = |sums: &[f64]| sums.iter().map(|sum| sum.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&found), bits(&expected), "{rows:?} of {count}");
            }
        }
    }

    #[test]
    fn products_at_several_distances_have_the_bits_of_each() {
        for count in [0_usize, 1, 7, 8, 9, 30, 100, 1003] {
            let values: Vec<f64> = (0..count).map(|row| (row as f64 * 0.7).sin()).collect();
            for farthest in [0, 3, 7, 8, 20, 110] {
                let mut sums = vec![1.0; farthest + 1];
                dispatch(Instructions::current(), LaggedProducts { values: &values, sums: &mut sums });
                for (lag, found) in sums.iter().enumerate() {
                    let rows = count.saturating_sub(lag);
                    let expected = sum_of_products(&values[..rows], &values[count - rows..]);
                    assert_eq!(found.to_bits(), expected.to_bits(), "{lag} of {count}");
                }
            }
        }
    }
}
