//! Sums over neighbouring rows of numbers that stand side by side, by blocks: nothing is ever subtracted.
//!
//! So many rows from any row on are a suffix of one block and a prefix of the next. The prefixes of a block and its suffixes are made in
//! one loop, from both of its ends: each addition waits for the one before it, and two chains of them keep the processor busy.

use crate::simd::vectors::Lanes;

/// Which numbers of a row are summed. No closure: a large one is compiled on its own, without the instructions of the kernel that calls it.
pub(crate) trait Summed<T, const N: usize>: Copy {
    fn of<S: Lanes>(self, simd: S, row: &T) -> [f64; N];
}

/// All of them.
#[derive(Clone, Copy)]
pub(crate) struct All;

impl<const N: usize> Summed<[f64; N], N> for All {
    #[inline(always)]
    fn of<S: Lanes>(self, _simd: S, row: &[f64; N]) -> [f64; N] {
        *row
    }
}

/// Replaces the suffixes of a block by the sums over as many rows as a block has, from each of its rows on, and writes the suffixes of the
/// next block.
#[inline(always)]
pub(crate) fn slide<S: Lanes, T, const N: usize>(
    simd: S,
    next: &[T],
    summed: impl Summed<T, N>,
    sums: &mut [[f64; N]],
    suffixes: &mut [[f64; N]],
) {
    let (mut prefix, mut suffix) = ([0.0; N], [0.0; N]);
    let ends = next.iter().zip(next.iter().rev());
    for ((sum, into), (first, last)) in sums.iter_mut().zip(suffixes.iter_mut().rev()).zip(ends) {
        add(sum, &prefix);
        add(&mut prefix, &summed.of(simd, first));
        add(&mut suffix, &summed.of(simd, last));
        *into = suffix;
    }
}

/// The suffixes of a first block, which [`slide`] takes for sums to be.
#[inline(always)]
pub(crate) fn begin<S: Lanes, T, const N: usize>(
    simd: S,
    block: &[T],
    summed: impl Summed<T, N>,
    suffixes: &mut [[f64; N]],
) {
    let mut suffix = [0.0; N];
    for (row, into) in block.iter().zip(suffixes).rev() {
        add(&mut suffix, &summed.of(simd, row));
        *into = suffix;
    }
}

/// Sums of `length` rows from each row on. The first block begins with the first row; there must be a block of rows more than there are sums,
/// which are those of whole blocks.
#[inline(always)]
pub(crate) fn sliding_sums<S: Lanes, const N: usize>(simd: S, length: usize, rows: &[[f64; N]], sums: &mut [[f64; N]]) {
    let (Some(first), blocks) = (rows.get(..length), sums.len() / length) else { return };
    let mut beyond = vec![[0.0; N]; length];
    begin(simd, first, All, &mut sums[..length]);
    for block in 1..=blocks {
        let (before, after) = sums.split_at_mut(block * length);
        let suffixes = if block < blocks { &mut after[..length] } else { &mut beyond[..] };
        slide(simd, &rows[block * length..][..length], All, &mut before[(block - 1) * length..], suffixes);
    }
}

#[inline(always)]
fn add<const N: usize>(sum: &mut [f64; N], row: &[f64; N]) {
    for (sum, number) in sum.iter_mut().zip(row) {
        *sum += number;
    }
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;

    #[test]
    fn sums_slide_over_blocks() {
        for (length, count) in [(1, 7), (4, 16), (5, 5), (3, 21)] {
            let rows: Vec<[f64; 4]> = (0..count + length).map(|row| [row as f64, 1.0, 0.0, -1.0]).collect();
            let mut sums = vec![[f64::NAN; 4]; count];
            sliding_sums(Scalar::new(), length, &rows, &mut sums);
            for (first, sum) in sums.iter().enumerate() {
                let expected = (first..first + length).map(|row| row as f64).sum::<f64>();
                assert_eq!(*sum, [expected, length as f64, 0.0, -(length as f64)]);
            }
        }
    }
}
