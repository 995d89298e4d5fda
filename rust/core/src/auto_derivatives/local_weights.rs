//! The weights of candidates in every block, and at any place: linear between the centres of blocks.

use std::ops::Range;

use crate::auto_derivatives::block_means::{BlockMeans, Grid};
use crate::auto_derivatives::candidate_weights::{AverageScratch, Refinement};
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Where the estimates of one record go. Slices that are empty are not wanted.
#[derive(Debug)]
pub(crate) struct DerivativeOutputs<'a> {
    pub(crate) values: &'a mut [f64],
    pub(crate) errors: &'a mut [f64],
    pub(crate) order: &'a mut [u8],
}

/// The weight and bias of every candidate, block by block.
pub(crate) struct Weighed {
    /// The first of the blocks.
    pub(crate) first: usize,
    /// Logarithms of weights, so many a block as vectors are filled with.
    pub(crate) logarithms: Vec<f64>,
    /// Squared biases.
    pub(crate) biases: Vec<f64>,
}

/// The weights of all candidates in some blocks.
pub(crate) struct LocalWeights<'a> {
    /// The first of the blocks.
    pub(crate) first: usize,
    /// Numbers of a block: one for every candidate, and some more to fill whole vectors.
    pub(crate) stride: usize,
    pub(crate) logarithms: &'a [f64],
    pub(crate) biases: &'a [f64],
    pub(crate) weights: &'a [f64],
    /// Of the candidates, then zeros.
    pub(crate) variances: &'a [f64],
    /// Candidates that have any weight.
    pub(crate) used: Vec<bool>,
}

/// A place between the centres of two blocks.
#[derive(Clone, Copy)]
pub(crate) struct Between {
    pub(crate) low: usize,
    pub(crate) high: usize,
    /// From the first centre, in blocks, and from one place to the next.
    pub(crate) distance: f64,
    pub(crate) advance: f64,
}

impl LocalWeights<'_> {
    /// The weight of a candidate at a place, and by how much it grows in a block.
    pub(crate) fn weight(&self, candidate: usize, place: Between) -> (f64, f64) {
        self.line(self.weights, candidate, place)
    }

    /// The same of its squared bias.
    pub(crate) fn bias(&self, candidate: usize, place: Between) -> (f64, f64) {
        self.line(self.biases, candidate, place)
    }

    /// The numbers of all candidates at the centres beside a place.
    pub(crate) fn beside<'b>(&self, numbers: &'b [f64], place: &Between) -> [&'b [f64]; 2] {
        [place.low, place.high].map(|block| &numbers[(block - self.first) * self.stride..][..self.stride])
    }

    fn line(&self, numbers: &[f64], candidate: usize, place: Between) -> (f64, f64) {
        let of = |block: usize| numbers[(block - self.first) * self.stride + candidate];
        let growth = of(place.high) - of(place.low);
        (of(place.low) + growth * place.distance, growth)
    }

    /// The sum of a candidate's weights.
    pub(crate) fn total(&self, candidate: usize) -> f64 {
        self.weights[candidate..].iter().step_by(self.stride).sum()
    }

    /// Whether any candidate of each bank is used.
    pub(crate) fn banks<'b>(&'b self, of: &'b Refinement) -> impl Iterator<Item = bool> + use<'b> {
        (0..of.banks.len()).map(|bank| self.used[of.candidates_of(bank)].contains(&true))
    }
}

impl Refinement {
    /// The logarithm of every candidate's weight and its squared bias in some blocks, from the risk around each. Sums and counts begin with a block.
    pub(crate) fn weigh(&self, blocks: Range<usize>, begin: usize, sums: &[f64], counts: &[f64]) -> Weighed {
        let (stride, length) = (self.stride(), self.blocks.length as f64);
        let bell = |distance: usize| {
            let u = distance as f64 * length / (self.reach + length / 2.0);
            (1.0 - u * u).powi(2)
        };
        let bell: Vec<f64> = (0..=self.reach()).map(bell).collect();
        let columns: Vec<Range<usize>> = (0..self.banks.len()).map(|bank| self.candidates_of(bank)).collect();
        let (first, all) = (blocks.start, blocks.len() * stride);
        let mut weighed = Weighed { first, logarithms: vec![0.0; all], biases: vec![0.0; all] };
        let (refinement, bell, columns) = (self, &*bell, &*columns);
        let weighing = Weighing { refinement, blocks, begin, sums, counts, bell, columns, weighed: &mut weighed };
        dispatch(self.instructions, weighing);
        weighed
    }

    /// Calls for all means of a part of a grid that lie between the same centres of blocks.
    pub(crate) fn between_centres(&self, grid: Grid, means: Range<usize>, mut with: impl FnMut(Range<usize>, Between)) {
        let length = self.blocks.length;
        let mut first = means.start;
        while first < means.end {
            let sample = grid.sample(first);
            let (low, high, distance) = self.blocks.between(sample);
            // Before the first centre and beyond the last one weights stay as they are.
            let until = self.blocks.next_centre(sample);
            let end = (first + (until - sample).div_ceil(grid.step)).min(means.end);
            let advance = if low == high { 0.0 } else { grid.step as f64 / length as f64 };
            with(first..end, Between { low, high, distance, advance });
            first = end;
        }
    }

    /// Fills the rows of a bank at its own means around some samples. Returns the first mean, and one of its rows.
    pub(crate) fn fill_own(
        &self,
        means: &BlockMeans<'_>,
        bank: usize,
        around: &Range<usize>,
        scratch: &mut AverageScratch,
    ) -> (usize, usize) {
        let (own, grid) = (self.candidates_of(bank), self.grid(bank));
        let (_, centres) = self.banks[bank].places(self.samples, grid, &grid.means(around));
        let AverageScratch { banks, projected, rows, firsts, .. } = scratch;
        firsts[bank] = centres.start;
        if centres.is_empty() {
            rows[own.clone()].iter_mut().for_each(Vec::clear);
        } else {
            let estimates = self.banks[bank].estimates(means, centres.clone(), 1, &mut banks[bank], projected);
            rows[own.clone()].iter_mut().zip(estimates).for_each(|(row, estimates)| std::mem::swap(row, estimates));
        }
        (centres.start, own.start)
    }
}

/// Weighs the candidates of some blocks.
struct Weighing<'a> {
    refinement: &'a Refinement,
    blocks: Range<usize>,
    /// The block that sums and counts begin with.
    begin: usize,
    sums: &'a [f64],
    counts: &'a [f64],
    /// The weights of blocks in a neighbourhood by their distance, and the candidates of every bank.
    bell: &'a [f64],
    columns: &'a [Range<usize>],
    weighed: &'a mut Weighed,
}

impl Kernel for Weighing<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        let Self { refinement, blocks, begin, sums, counts, bell, columns, weighed } = self;
        let (candidates, banks) = (refinement.offsets.len(), columns.len());
        let (stride, packets) = (refinement.stride(), candidates.div_ceil(WIDTH));
        let padded = |numbers: &[f64]| -> Vec<Packet> { (0..packets).map(|at| packet(numbers, at * WIDTH)).collect() };
        let (offsets, differences) = (padded(&refinement.offsets), padded(&refinement.differences));
        let neighbourhood = refinement.blocks.length as f64 * (2.0 * bell.iter().sum::<f64>() - bell[0]);
        let (mut sum, mut risks) = (vec![Packet::ZERO; packets], vec![0.0; packets * WIDTH]);
        // Counts change near what is missing only.
        let (mut count, mut last, mut spread) = (vec![0.0; banks], Vec::new(), vec![Packet::ZERO; packets]);
        let rows = weighed.logarithms.chunks_exact_mut(stride).zip(weighed.biases.chunks_exact_mut(stride));
        for (block, (weights, biases)) in blocks.zip(rows) {
            let around = refinement.blocks_around(&(block..block + 1), bell.len() - 1);
            // As many at once as hide how long each sum takes.
            let mut at = 0;
            while at < packets {
                let of = |other: usize| (bell[block.abs_diff(other)], (other - begin) * stride + at * WIDTH);
                let weighted = around.clone().map(of);
                match packets - at {
                    1 => sum[at..][..1].copy_from_slice(&weighted_sums::<1>(sums, weighted)),
                    2 | 3 => sum[at..][..2].copy_from_slice(&weighted_sums::<2>(sums, weighted)),
                    _ => sum[at..][..4].copy_from_slice(&weighted_sums::<4>(sums, weighted)),
                }
                at += if packets - at > 3 { 4 } else { (packets - at).min(2) };
            }
            for (bank, all) in count.iter_mut().enumerate() {
                *all = 0.0;
                for other in around.clone() {
                    *all += bell[block.abs_diff(other)] * counts[(other - begin) * banks + bank];
                }
            }
            if count != last {
                last.clone_from(&count);
                for (own, &count) in columns.iter().zip(&count) {
                    own.clone().for_each(|candidate| spread[candidate / WIDTH].0[candidate % WIDTH] = count);
                }
            }
            for (at, (&sum, &count)) in sum.iter().zip(&spread).enumerate() {
                let difference = sum / count;
                let (mut risk, mut bias) = (difference + offsets[at], (difference - differences[at]).max(Packet::ZERO));
                for lane in 0..WIDTH {
                    let known = count.0[lane] > 0.0;
                    risk.0[lane] = if known { risk.0[lane] } else { f64::INFINITY };
                    bias.0[lane] = if known { bias.0[lane] } else { 0.0 };
                }
                risk.store(&mut risks[at * WIDTH..]);
                bias.store(&mut biases[at * WIDTH..]);
            }
            let best = least(&risks[..candidates]);
            let (least, temperature) = (risks[best], refinement.temperatures[best]);
            if !least.is_finite() {
                weights.fill(f64::NEG_INFINITY);
                continue;
            }
            let (least, twice) = (Packet::splat(least), Packet::splat(2.0 * temperature));
            for (at, weights) in weights.chunks_exact_mut(WIDTH).enumerate() {
                // In this order: for an infinite temperature the quotient is zero, and zero times infinity would be NaN.
                let risks = Packet::load(&risks[at * WIDTH..]);
                let logarithms = (least - risks) / twice * Packet::splat(neighbourhood);
                logarithms.store(weights);
            }
        }
    }
}

/// Some packets side by side, each the sum of what begins at some places times their weights.
#[inline(always)]
fn weighted_sums<const PACKETS: usize>(
    numbers: &[f64],
    weighted: impl Iterator<Item = (f64, usize)>,
) -> [Packet; PACKETS] {
    let mut sums = [Packet::ZERO; PACKETS];
    for (weight, from) in weighted {
        for (at, sum) in sums.iter_mut().enumerate() {
            *sum += Packet::splat(weight) * Packet::load(&numbers[from + at * WIDTH..]);
        }
    }
    sums
}

/// The place of the first of the least numbers.
#[inline(always)]
fn least(numbers: &[f64]) -> usize {
    let (mut best, mut least, mut sum) = (0, numbers[0], 0.0);
    for (place, &number) in numbers.iter().enumerate() {
        best = if number < least { place } else { best };
        least = if number < least { number } else { least };
        sum += number;
    }
    if sum.is_nan() {
        // What is no number is rare.
        return (0..numbers.len()).min_by(|&a, &b| numbers[a].total_cmp(&numbers[b])).unwrap_or(0);
    }
    best
}

/// Eight numbers from a place on, zero beyond the last.
#[inline(always)]
pub(crate) fn packet(numbers: &[f64], from: usize) -> Packet {
    if from + WIDTH <= numbers.len() {
        return Packet::load(&numbers[from..]);
    }
    let mut packet = Packet::ZERO;
    for (slot, number) in packet.0.iter_mut().zip(numbers.get(from..).unwrap_or_default()) {
        *slot = *number;
    }
    packet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_the_least_numbers_is_found() {
        assert_eq!(least(&[3.0, 1.0, 2.0, 1.0]), 1);
        assert_eq!(least(&[f64::INFINITY, f64::INFINITY]), 0);
        // What is no number comes after all others, or before them, by its sign.
        assert_eq!(least(&[f64::NAN, 2.0, 1.0]), 2);
        assert_eq!(least(&[2.0, -f64::NAN, 1.0]), 1);
    }

    #[test]
    fn packets_end_with_zeros() {
        let numbers: Vec<f64> = (1..12).map(f64::from).collect();
        assert_eq!(packet(&numbers, 3).0, [4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0]);
        assert_eq!(packet(&numbers, 9).0, [10.0, 11.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(packet(&numbers, 20), Packet::ZERO);
    }
}
