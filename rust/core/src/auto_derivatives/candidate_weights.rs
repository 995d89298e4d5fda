//! The weight of every candidate in every block of a record, from its local risk.

use std::ops::Range;

use crate::auto_derivatives::candidates::{Bank, Target, correlated};
use crate::auto_derivatives::global_choice::{CLOSELY, OPTIMISM, Pair, rounded, squared_distance};
use crate::auto_derivatives::symmetric_grid::{Blocks, within};
use crate::lanes::output::Elements;
use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};
use crate::record::samples::Samples;

/// The windows over the record's best.
const WINDOWS: [f64; 5] = [0.125, 0.25, 0.5, 1.0, 2.0];

/// The reference has a window so much shorter.
const REFERENCE: f64 = 1.189_207_115_002_721;

/// Half-widths of the best window in half a neighbourhood, and blocks in a half-width.
const NEIGHBOURHOOD: f64 = 5.0;
const BLOCKS: usize = 4;

/// Samples in a block of records that are not short, at least: sums over more blocks cost more than the estimates in them.
const SHORTEST_BLOCK: usize = 7;

/// Samples that are worked on from sums to averages before the next are, at least, and in reaches of a block: so little is kept, and little is summed
/// twice.
const CHUNK: usize = 1 << 17;
const REACHES: f64 = 16.0;

/// Samples in a piece of work, at least, and in runs of the longest window: what a run computes before and after a piece is lost.
const PIECE: usize = 1 << 14;
const RUNS: usize = 2;

/// Places in a half-width at which candidates are compared, at least, and samples from one to the next, at most. The shortest wave that order 15
/// follows is `2π/15` half-widths long, three places: mean squares over them are nearly those over all samples.
const PLACES: usize = 8;
const LONGEST_STEP: usize = 8;

/// The candidates of a record's neighbourhoods.
#[derive(Debug)]
pub(crate) struct Refinement {
    pub(crate) banks: Vec<Bank>,
    reference: Reference,
    pub(crate) blocks: Blocks,
    samples: usize,
    /// Samples in half a neighbourhood.
    reach: f64,
    /// By candidate of all banks: twice the covariance with the reference and what optimism adds; variance of the difference from the
    /// reference; `T`; variance; order.
    pub(crate) offsets: Vec<f64>,
    differences: Vec<f64>,
    temperatures: Vec<f64>,
    pub(crate) variances: Vec<f64>,
    pub(crate) orders: Vec<u8>,
}

/// The reference that candidates are compared with.
#[derive(Debug)]
pub(crate) struct Reference {
    pub(crate) bank: Bank,
    pub(crate) candidate: usize,
}

impl Reference {
    /// The same order in a window so much shorter, or else in the same window.
    pub(crate) fn new(pair: Pair, shorter: f64, target: &Target<'_>) -> Option<Self> {
        let with_order = |half: usize| {
            let bank = Bank::new(half, target)?;
            let candidate = bank.orders.iter().position(|&order| order == pair.order)?;
            Some(Self { bank, candidate })
        };
        with_order(rounded(pair.half as f64 / shorter).max(target.shortest)).or_else(|| with_order(pair.half))
    }
}

/// The weight and bias of every candidate, block by block.
pub(crate) struct Weighed {
    /// The first of the blocks.
    pub(crate) first: usize,
    /// Logarithms of weights.
    pub(crate) logarithms: Vec<f64>,
    /// Squared biases.
    pub(crate) biases: Vec<f64>,
}

/// Memory of one thread.
pub(crate) struct AverageScratch {
    pub(crate) banks: Vec<CoefficientScratch>,
    reference: CoefficientScratch,
    /// One for all banks: it stays near the processor.
    pub(crate) projected: Projected,
    /// The reference at its own places and at those of a bank.
    compare: Vec<f64>,
    compare_at: Vec<f64>,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Refinement {
    /// Prepares the candidates around a record's best pair.
    pub(crate) fn new(samples: usize, pair: Pair, target: &Target<'_>) -> Option<Self> {
        let variance = target.noise.variance();
        let half = pair.half as f64;
        let reference = Reference::new(pair, REFERENCE, target)?;
        let mut halves: Vec<usize> = WINDOWS.iter().map(|ratio| rounded(half * ratio)).collect();
        halves.dedup();
        halves.retain(|&half| half >= target.shortest && 2 * half < samples / 2);
        let banks: Vec<Bank> = halves.into_iter().filter_map(|half| Bank::new(half, target)).collect();
        let reference_gain = reference.bank.gains[reference.candidate];
        let (mut offsets, mut differences, mut temperatures) = (Vec::new(), Vec::new(), Vec::new());
        let (mut variances, mut orders) = (Vec::new(), Vec::new());
        for bank in &banks {
            let compared = correlated(reference.bank.kernel(reference.candidate), bank.half, target.noise);
            let shared = bank.products(&compared);
            for ((gain, leverage), shared) in bank.gains.iter().zip(&bank.leverages).zip(shared) {
                offsets.push(variance * (2.0 * shared + (OPTIMISM - 1.0) * gain));
                differences.push(variance * (gain + reference_gain - 2.0 * shared));
                temperatures.push((3.0 * variance * gain / leverage).max(f64::MIN_POSITIVE));
                variances.push(variance * gain);
            }
            orders.extend(bank.orders.iter().map(|&order| u8::try_from(order).unwrap_or(u8::MAX)));
        }
        let shortest = if samples > CLOSELY { SHORTEST_BLOCK } else { 1 };
        let blocks = Blocks::new(samples, (pair.half / BLOCKS).max(shortest));
        let reach = NEIGHBOURHOOD * half;
        Some(Self { banks, reference, blocks, samples, reach, offsets, differences, temperatures, variances, orders })
    }

    /// Ranges of blocks that are worked on one after the other.
    pub(crate) fn chunks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        self.together(&(0..self.blocks.count()), CHUNK.max(rounded(REACHES * self.reach)))
    }

    /// Ranges of some blocks that form one piece of work.
    pub(crate) fn pieces(&self, blocks: &Range<usize>) -> impl Iterator<Item = Range<usize>> + use<> {
        let run = self.banks.iter().map(Bank::run).max().unwrap_or(0);
        self.together(blocks, PIECE.max(RUNS * run))
    }

    /// Ranges of some blocks, of about so many samples each.
    fn together(&self, blocks: &Range<usize>, samples: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let (end, count) = (blocks.end, samples.div_ceil(self.blocks.length));
        blocks.clone().step_by(count).map(move |first| first..(first + count).min(end))
    }

    /// Some blocks and so many on either side, as far as there are.
    pub(crate) fn blocks_around(&self, blocks: &Range<usize>, more: usize) -> Range<usize> {
        blocks.start.saturating_sub(more)..(blocks.end + more).min(self.blocks.count())
    }

    /// Blocks in half a neighbourhood.
    pub(crate) fn reach(&self) -> usize {
        rounded((self.reach / self.blocks.length as f64).floor())
    }

    pub(crate) fn samples(&self, blocks: &Range<usize>) -> Range<usize> {
        self.blocks.samples(blocks.start).start..self.blocks.samples(blocks.end - 1).end
    }

    pub(crate) fn scratch(&self) -> AverageScratch {
        AverageScratch {
            banks: self.banks.iter().map(Bank::scratch).collect(),
            reference: self.reference.bank.scratch(),
            projected: Projected::default(),
            compare: Vec::new(),
            compare_at: Vec::new(),
            rows: vec![Vec::new(); self.offsets.len()],
        }
    }

    /// Sums the squared differences from the reference over the places in every block, and counts the places that can be compared: candidate by
    /// candidate, and bank by bank, for each block.
    pub(crate) fn compare(
        &self,
        record: &dyn Samples,
        blocks: Range<usize>,
        sums: &mut [f64],
        counts: &mut [f64],
        scratch: &mut AverageScratch,
    ) {
        let (samples, own) = (self.samples(&blocks), &self.reference);
        let step = self.banks.iter().map(|bank| self.step(bank)).min().unwrap_or(1);
        let AverageScratch { banks, reference, projected, compare, compare_at, .. } = scratch;
        for (side, place) in self.sides(&samples) {
            let known = places(&within(&side, &own.bank.centres(self.samples)), place, step);
            compare.clear();
            if !known.is_empty() {
                let estimates = own.bank.estimates(record, known.clone(), step, reference, projected);
                compare.extend(&estimates[own.candidate]);
            }
            let mut column = 0;
            for (index, (bank, scratch)) in self.banks.iter().zip(&mut *banks).enumerate() {
                let own_step = self.step(bank);
                let own = places(&within(&known, &bank.centres(self.samples)), place, own_step);
                if !own.is_empty() {
                    compare_at.clear();
                    compare_at.extend(compare[(own.start - known.start) / step..].iter().step_by(own_step / step));
                    let elements = Elements { first: own.start, step: own_step };
                    let rows = bank.estimates(record, own.clone(), own_step, scratch, projected);
                    for block in self.blocks.of(own.start)..=self.blocks.of(own.end - 1) {
                        let part = elements.of(within(&self.blocks.samples(block), &own));
                        let (compare, from) = (&compare_at[part.clone()], block - blocks.start);
                        let sums = &mut sums[from * self.offsets.len() + column..];
                        let mut count = 0.0;
                        for (row, sum) in rows.iter().zip(sums) {
                            let (squares, compared) = squared_differences(&row[part.clone()], compare);
                            *sum += squares;
                            count = compared;
                        }
                        counts[from * self.banks.len() + index] += count;
                    }
                }
                column += bank.orders.len();
            }
        }
    }

    /// Samples from one place of a bank to the next.
    fn step(&self, bank: &Bank) -> usize {
        let wanted = if self.samples > CLOSELY { (bank.half / PLACES).clamp(1, LONGEST_STEP) } else { 1 };
        1 << wanted.ilog2()
    }

    /// The parts of some samples on both sides of the record's middle, with a place of all banks: places are the same from both ends.
    fn sides(&self, samples: &Range<usize>) -> [(Range<usize>, usize); 2] {
        let (end, middle) = (self.samples, self.samples / 2);
        [(within(samples, &(0..middle)), 0), (within(samples, &(middle..end)), end - 1)]
    }

    /// The logarithm of every candidate's weight and its squared bias in some blocks, from the risk around each. Sums and counts begin with a block.
    pub(crate) fn weigh(&self, blocks: Range<usize>, begin: usize, sums: &[f64], counts: &[f64]) -> Weighed {
        let (candidates, length) = (self.offsets.len(), self.blocks.length as f64);
        let bank_of: Vec<usize> =
            self.banks.iter().enumerate().flat_map(|(place, bank)| vec![place; bank.orders.len()]).collect();
        let reach = self.reach();
        let bell = |distance: usize| {
            let u = distance as f64 * length / (self.reach + length / 2.0);
            (1.0 - u * u).powi(2)
        };
        let bell: Vec<f64> = (0..=reach).map(bell).collect();
        let neighbourhood = length * (2.0 * bell.iter().sum::<f64>() - bell[0]);
        let mut weights = vec![0.0; blocks.len() * candidates];
        let mut biases = vec![0.0; blocks.len() * candidates];
        let mut sum = vec![0.0; candidates];
        let mut count = vec![0.0; self.banks.len()];
        let rows = weights.chunks_exact_mut(candidates).zip(biases.chunks_exact_mut(candidates));
        for (block, (weights, biases)) in blocks.clone().zip(rows) {
            sum.fill(0.0);
            count.fill(0.0);
            for other in self.blocks_around(&(block..block + 1), reach) {
                let weight = bell[block.abs_diff(other)];
                let other = other - begin;
                add(&mut sum, &sums[other * candidates..(other + 1) * candidates], weight);
                add(&mut count, &counts[other * self.banks.len()..(other + 1) * self.banks.len()], weight);
            }
            for (candidate, (weight, bias)) in weights.iter_mut().zip(&mut *biases).enumerate() {
                let count = count[bank_of[candidate]];
                *weight = f64::INFINITY;
                if count > 0.0 {
                    let difference = sum[candidate] / count;
                    *weight = difference + self.offsets[candidate];
                    *bias = (difference - self.differences[candidate]).max(0.0);
                }
            }
            let best = (0..candidates).min_by(|&a, &b| weights[a].total_cmp(&weights[b]));
            let Some(best) = best.filter(|&best| weights[best].is_finite()) else {
                weights.fill(f64::NEG_INFINITY);
                continue;
            };
            let (least, temperature) = (weights[best], self.temperatures[best]);
            for weight in weights {
                // In this order: for an infinite temperature the quotient is zero, and zero times infinity would be NaN.
                *weight = (least - *weight) / (2.0 * temperature) * neighbourhood;
            }
        }
        Weighed { first: blocks.start, logarithms: weights, biases }
    }
}

/// The sum of the squared differences of two rows where both have a number, and how many these are. NaN of a bank is NaN of all its rows.
fn squared_differences(row: &[f64], compare: &[f64]) -> (f64, f64) {
    let sum = squared_distance(row, compare);
    if !sum.is_nan() {
        return (sum, row.len() as f64);
    }
    let squares = row.iter().zip(compare).map(|(a, b)| (a - b) * (a - b)).filter(|square| !square.is_nan());
    squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0))
}

/// Samples from the first on that is a multiple of a step away from a place.
fn places(samples: &Range<usize>, place: usize, step: usize) -> Range<usize> {
    let before = samples.start % step;
    let first = samples.start + (step + place % step - before) % step;
    first..samples.end.max(first)
}

/// Adds numbers with a weight.
fn add(sums: &mut [f64], numbers: &[f64], weight: f64) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += weight * number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::correlated::CorrelatedNoise;
    use crate::noise::quantisation::tests::uniform;
    use crate::simd::instructions::Instructions;

    #[test]
    fn a_few_places_tell_what_all_samples_do() {
        let samples = 20_000;
        let noisy = |(i, e): (usize, f64)| (i as f64 / 300.0).sin() + 0.1 * e;
        let record: Vec<f64> = uniform(samples).into_iter().enumerate().map(noisy).collect();
        let (record, noise) = (record.as_slice(), CorrelatedNoise::white(0.01 / 12.0));
        for derivative in 0..3 {
            let instructions = Instructions::current();
            let target =
                Target { derivative, highest: 15, fixed: false, shortest: 4, delta: 1.0, noise: &noise, instructions };
            let of = Refinement::new(samples, Pair { half: 100, order: derivative + 2 }, &target).expect("long enough");
            let (mut sums, mut counts) =
                (vec![0.0; of.blocks.count() * of.offsets.len()], vec![0.0; of.blocks.count() * of.banks.len()]);
            of.compare(&record, 0..of.blocks.count(), &mut sums, &mut counts, &mut of.scratch());
            let mut column = 0;
            for (index, bank) in of.banks.iter().enumerate() {
                let (from, end) = (400, samples - 400);
                let (mut scratch, mut reference) = (bank.scratch(), of.reference.bank.scratch());
                let (mut of_reference, mut of_bank) = (Projected::default(), Projected::default());
                let compare = of.reference.bank.estimates(&record, from..end, 1, &mut reference, &mut of_reference);
                let rows = bank.estimates(&record, from..end, 1, &mut scratch, &mut of_bank);
                let count: f64 = counts[index..].iter().step_by(of.banks.len()).sum();
                assert!(count > (samples / 10) as f64);
                for row in rows {
                    let (all, of_all) = squared_differences(row, &compare[of.reference.candidate]);
                    let few: f64 = sums[column..].iter().step_by(of.offsets.len()).sum();
                    let ratio = few / count / (all / of_all);
                    // As much as a mean square over so many places scatters if no place tells of another.
                    let chance = 3.5 * (2.0 / count).sqrt();
                    assert!((ratio - 1.0).abs() < chance, "{derivative}, {}: {ratio}", bank.half);
                    column += 1;
                }
            }
        }
    }
}
