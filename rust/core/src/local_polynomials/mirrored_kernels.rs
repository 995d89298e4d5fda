//! Even and odd kernels on short windows: every window by itself, as many neighbours side by side as a vector holds.
//!
//! With `r` the sample at the centre, which keeps the digits of what is small beside it,
//!
//! ```text
//! a r + Σ_k w_k ((y_k - r) ± (y_{-k} - r)),   k = 1 … half,
//! ```
//!
//! where an even kernel has the sum and an odd one the difference. Windows that are stepped from one to the next (`engine.rs`) cost the same
//! however long they are, but much more than a short sum.

use std::ops::Range;

use crate::lanes::output::Elements;
use crate::record::buffer::Stretch;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;
use crate::simd::unroll::unroll;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES, dispatch};

/// Half-width of the longest windows that kernels are tabulated for.
pub(crate) const LONGEST: usize = 256;

/// Windows that are worked on together: their samples and sums stay in the nearest cache.
const TOGETHER: usize = 512;

/// The most kernels of one parity that are summed at once, and vectors of windows that these are summed for where there are 32 registers.
const MOST_KERNELS: usize = 8;
const MOST_VECTORS: usize = 4;

/// What a pair of samples costs beside its products, and what a step from one window to the next costs a degree, in products. Measured.
const PAIR: usize = 3;
const STEP: usize = 32;

/// Samples from one window to the next, at most: beyond, hardly any sample is in two windows.
const MOST_APART: usize = 32;

/// A kernel that is even or odd.
#[derive(Clone, Debug)]
pub(crate) struct MirroredKernel {
    pub(crate) odd: bool,
    /// What a constant signal of one gives.
    pub(crate) constant: f64,
    /// The weights of the samples after the centre.
    pub(crate) outwards: Vec<f64>,
}

/// The plan of some kernels of one length.
#[derive(Debug)]
pub(crate) struct MirroredKernels {
    half: usize,
    groups: Vec<Group>,
    instructions: Instructions,
}

/// Kernels of one parity that are summed at once.
#[derive(Debug)]
struct Group {
    /// Which of all they are.
    rows: Vec<usize>,
    /// By kernel, as many as are summed at once.
    constants: [f64; MOST_KERNELS],
    sign: f64,
    width: usize,
    /// By distance from the centre, one weight a kernel.
    weights: Vec<f64>,
}

/// Memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct MirroredScratch {
    stretch: Stretch,
    /// Where windows are some samples apart, these samples by their remainder.
    apart: Vec<f64>,
    /// Where the samples of the first window are, on the right and on the left, from the centre outwards.
    pairs: Vec<(usize, usize)>,
}

impl MirroredKernels {
    /// Prepares kernels with weights for `half` samples after the centre.
    pub(crate) fn new(half: usize, kernels: &[MirroredKernel], instructions: Instructions) -> Self {
        let mut groups = Vec::new();
        for odd in [false, true] {
            let rows: Vec<usize> = (0..kernels.len()).filter(|&row| kernels[row].odd == odd).collect();
            for rows in rows.chunks(MOST_KERNELS) {
                let width = rows.len().next_power_of_two().max(2);
                let mut constants = [0.0; MOST_KERNELS];
                let mut weights = vec![0.0; half * width];
                for (place, &row) in rows.iter().enumerate() {
                    constants[place] = kernels[row].constant;
                    let slots = weights[place..].iter_mut().step_by(width);
                    slots.zip(&kernels[row].outwards).for_each(|(slot, weight)| *slot = *weight);
                }
                let sign = if odd { -1.0 } else { 1.0 };
                groups.push(Group { rows: rows.to_vec(), constants, sign, width, weights });
            }
        }
        Self { half, groups, instructions }
    }

    /// Prepares so many kernels that are all odd, or all even, with what a constant signal of one gives. `fill` gives the weights of all at a distance from
    /// the centre, which is one at least.
    pub(crate) fn of_one_parity(
        half: usize,
        count: usize,
        (odd, constant): (bool, f64),
        mut fill: impl FnMut(usize, &mut [f64]),
        instructions: Instructions,
    ) -> Self {
        let group = |rows: &[usize]| {
            let width = rows.len().next_power_of_two().max(2);
            let mut constants = [0.0; MOST_KERNELS];
            constants[..rows.len()].fill(constant);
            let sign = if odd { -1.0 } else { 1.0 };
            Group { rows: rows.to_vec(), constants, sign, width, weights: vec![0.0; half * width] }
        };
        let rows: Vec<usize> = (0..count).collect();
        let mut groups: Vec<Group> = rows.chunks(MOST_KERNELS).map(group).collect();
        let mut weights = vec![0.0; count];
        for distance in 1..=half {
            fill(distance, &mut weights);
            for (group, own) in groups.iter_mut().zip(weights.chunks(MOST_KERNELS)) {
                group.weights[(distance - 1) * group.width..][..own.len()].copy_from_slice(own);
            }
        }
        Self { half, groups, instructions }
    }

    /// Whether every `every`-th window costs less by itself than all windows do with polynomials of so many degrees in steps.
    pub(crate) fn serve(&self, every: usize, degrees: usize) -> bool {
        let sums: usize = self.groups.iter().map(|group| group.width + PAIR).sum();
        every <= MOST_APART && self.half * sums <= (STEP * degrees).saturating_mul(every)
    }

    /// Gives a row for each kernel at every `every`-th of some windows, known by their first samples, and the samples at the centres where
    /// they are wanted; NaN where a window holds an unusable sample.
    pub(crate) fn apply(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        every: usize,
        (level, rows): (&mut [f64], &mut [&mut [f64]]),
        scratch: &mut MirroredScratch,
    ) {
        let (half, count) = (self.half, windows.len().div_ceil(every));
        let beyond = MOST_VECTORS * MOST_LANES;
        // Samples of one remainder, where windows are apart.
        let plane = if every == 1 { 0 } else { TOGETHER + beyond + 2 * half / every + 1 };
        let place = |sample: usize| sample % every * plane + sample / every;
        let MirroredScratch { stretch, apart, pairs } = scratch;
        pairs.clear();
        pairs.extend((1..=half).map(|distance| (place(half + distance), place(half - distance))));
        for first in (0..count).step_by(TOGETHER) {
            let some = first..count.min(first + TOGETHER);
            let begin = windows.start + first * every;
            let read = (some.len() - 1) * every + 2 * half + 1;
            // Vectors reach beyond the last window.
            let spare = if every == 1 { beyond } else { 0 };
            let from = begin.cast_signed();
            stretch.load(record, from..from + (read + spare).cast_signed());
            let mut samples = stretch.from(from, read + spare);
            if every > 1 {
                apart.resize(every * plane, 0.0);
                for (remainder, plane) in apart.chunks_exact_mut(plane).enumerate().take(read) {
                    let own = samples[remainder..].iter().step_by(every);
                    plane.iter_mut().zip(own).for_each(|(slot, sample)| *slot = *sample);
                }
                samples = &*apart;
            }
            let centre = place(half);
            if !level.is_empty() {
                level[some.clone()].copy_from_slice(&samples[centre..centre + some.len()]);
            }
            for group in &self.groups {
                let sum = PairSum { group, samples, pairs, centre, some: some.clone(), rows };
                match group.width {
                    2 => dispatch(self.instructions, PairSums::<2>(sum)),
                    4 => dispatch(self.instructions, PairSums::<4>(sum)),
                    _ => dispatch(self.instructions, PairSums::<MOST_KERNELS>(sum)),
                }
            }
            let elements = Elements { first: windows.start, step: every };
            for &sample in stretch.unusable(from..from + read.cast_signed()) {
                let part = elements.of(sample.saturating_sub(2 * half)..sample + 1);
                let part = part.start.max(some.start)..part.end.min(some.end);
                for row in rows.iter_mut().map(|row| &mut **row).chain([&mut *level]).filter(|row| !row.is_empty()) {
                    row[part.clone()].fill(f64::NAN);
                }
            }
        }
    }
}

/// The sums of a group for some windows.
struct PairSum<'a, 'b> {
    group: &'a Group,
    samples: &'a [f64],
    pairs: &'a [(usize, usize)],
    /// The place of the first window's centre.
    centre: usize,
    some: Range<usize>,
    rows: &'a mut [&'b mut [f64]],
}

/// The same for so many kernels.
struct PairSums<'a, 'b, const WIDTH: usize>(PairSum<'a, 'b>);

impl<const WIDTH: usize> Kernel for PairSums<'_, '_, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        // As many sums as hide how long each takes, and as there are registers for.
        if S::F64_LANES < MOST_LANES {
            match WIDTH {
                2 => self.0.run::<S, 2, 4>(simd),
                4 => self.0.run::<S, 4, 2>(simd),
                _ => self.0.run::<S, MOST_KERNELS, 1>(simd),
            }
        } else {
            match WIDTH {
                2 => self.0.run::<S, 2, 4>(simd),
                4 => self.0.run::<S, 4, 4>(simd),
                _ => self.0.run::<S, MOST_KERNELS, 2>(simd),
            }
        }
    }
}

impl PairSum<'_, '_> {
    #[inline(always)]
    fn run<S: Lanes, const WIDTH: usize, const VECTORS: usize>(self, simd: S) {
        let Self { group, samples, pairs, centre, some, rows } = self;
        let (lanes, count) = (S::F64_LANES, some.len());
        let (weights, sign) = (group.weights.as_chunks::<WIDTH>().0, simd.splat_f64s(group.sign));
        for first in (0..count).step_by(VECTORS * lanes) {
            let mut references = [sign; VECTORS];
            unroll!(V < VECTORS, { references[V] = simd.load(samples, centre + first + V * lanes) });
            let mut sums = [[sign; VECTORS]; WIDTH];
            unroll!(W < WIDTH, {
                let constant = simd.splat_f64s(group.constants[W % MOST_KERNELS]);
                unroll!(V < VECTORS, { sums[W][V] = simd.mul_f64s(constant, references[V]) });
            });
            for (&(right, left), weights) in pairs.iter().zip(weights) {
                let mut pair = [sign; VECTORS];
                unroll!(V < VECTORS, {
                    let at = first + V * lanes;
                    let right = simd.sub_f64s(simd.load(samples, right + at), references[V]);
                    let left = simd.sub_f64s(simd.load(samples, left + at), references[V]);
                    pair[V] = simd.mul_add_f64s(left, sign, right);
                });
                unroll!(W < WIDTH, {
                    let weight = simd.splat_f64s(weights[W]);
                    unroll!(V < VECTORS, { sums[W][V] = simd.mul_add_f64s(weight, pair[V], sums[W][V]) });
                });
            }
            // A row that is not wanted is empty. Written out: sums that a loop goes through would be kept in memory.
            unroll!(W < WIDTH, {
                let row = group.rows.get(W).and_then(|&row| rows[row].get_mut(some.start + first..some.end));
                match row {
                    Some(row) if row.len() >= VECTORS * lanes => {
                        unroll!(V < VECTORS, { simd.store(row, V * lanes, sums[W][V]) });
                    }
                    Some(row) => store_some(simd, row, sums[W]),
                    None => {}
                }
            });
        }
    }
}

/// Writes the numbers of some vectors, as many as there is room for.
#[inline(always)]
fn store_some<S: Lanes, const VECTORS: usize>(simd: S, row: &mut [f64], vectors: [S::f64s; VECTORS]) {
    for (part, vector) in row.chunks_mut(S::F64_LANES).zip(vectors) {
        let mut values = [0.0; MOST_LANES];
        simd.store(&mut values, 0, vector);
        part.copy_from_slice(&values[..part.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    /// Kernels of both parities, more of one than are summed at once.
    fn kernels(half: usize) -> Vec<MirroredKernel> {
        let one = |index: usize| MirroredKernel {
            odd: index % 3 == 1,
            constant: f64::from(u8::from(index == 0)),
            outwards: (1..=half).map(|k| ((index + 1) as f64 * k as f64 * 0.1).cos() / half as f64).collect(),
        };
        (0..15).map(one).collect()
    }

    fn applied(
        plan: &MirroredKernels,
        record: &[f64],
        windows: Range<usize>,
        every: usize,
    ) -> (Vec<f64>, Vec<Vec<f64>>) {
        let count = windows.len().div_ceil(every);
        let (mut level, mut rows) = (vec![1.0; count], vec![vec![1.0; count]; 15]);
        let mut slices: Vec<&mut [f64]> = rows.iter_mut().map(Vec::as_mut_slice).collect();
        let into = (level.as_mut_slice(), slices.as_mut_slice());
        plan.apply(&record, windows, every, into, &mut MirroredScratch::default());
        (level, rows)
    }

    #[test]
    fn sums_are_those_of_the_definition_on_every_path() {
        for (half, every, samples) in [(1, 1, 40), (4, 1, 1300), (10, 3, 2000), (7, 20, 9000), (3, 9, 700)] {
            let mut record: Vec<f64> = uniform(samples).iter().map(|value| value + 1e6).collect();
            (record[samples / 2], record[samples / 3]) = (f64::NAN, 1e200);
            let kernels = kernels(half);
            let windows = 3..samples - 2 * half - 1;
            let mut first_path = None;
            for instructions in Instructions::available() {
                let plan = MirroredKernels::new(half, &kernels, instructions);
                let (level, rows) = applied(&plan, &record, windows.clone(), every);
                for (place, begin) in windows.clone().step_by(every).enumerate() {
                    let window = &record[begin..=begin + 2 * half];
                    let usable = window.iter().all(|value| value.abs() < 1e100);
                    assert_eq!(level[place].is_nan(), !usable, "{half} {every} {place}");
                    for (kernel, row) in kernels.iter().zip(&rows) {
                        let centre = window[half];
                        let pair = |k: usize| {
                            let (right, left) = (window[half + k] - centre, window[half - k] - centre);
                            kernel.outwards[k - 1] * if kernel.odd { right - left } else { right + left }
                        };
                        let sum = kernel.constant * centre + (1..=half).map(pair).sum::<f64>();
                        // A rounding for each of the sums.
                        let close = (row[place] - sum).abs() <= 8.0 * f64::EPSILON * sum.abs().max(1.0);
                        assert!(
                            close || row[place].is_nan() && !usable,
                            "{half} {every} {place}: {} {sum}",
                            row[place]
                        );
                    }
                }
                // The same bits on every path and however windows are cut.
                let bits = |rows: &[Vec<f64>]| -> Vec<Vec<u64>> {
                    rows.iter().map(|row| row.iter().map(|value| value.to_bits()).collect()).collect()
                };
                let cut = windows.start + 11 * every;
                let (mut parts, (_, rest)) = (
                    applied(&plan, &record, windows.start..cut, every).1,
                    applied(&plan, &record, cut..windows.end, every),
                );
                parts.iter_mut().zip(rest).for_each(|(part, rest)| part.extend(rest));
                assert_eq!(bits(&parts), bits(&rows));
                let first = first_path.get_or_insert_with(|| bits(&rows));
                assert_eq!(*first, bits(&rows));
            }
        }
    }
}
