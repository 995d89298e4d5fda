//! The weight of every candidate in every block of a record, from its local risk.

use std::ops::Range;

use crate::auto_derivatives::candidates::{self, Bank, Target, correlated};
use crate::auto_derivatives::global_choice::{CLOSELY, OPTIMISM, Pair, rounded, squared_distance};
use crate::auto_derivatives::symmetric_grid::Blocks;
use crate::record::samples::Samples;

/// The windows over the record's best.
const WINDOWS: [f64; 5] = [0.125, 0.25, 0.5, 1.0, 2.0];

/// The reference has a window so much shorter.
const REFERENCE: f64 = 1.189_207_115_002_721;

/// Half-widths of the best window in half a neighbourhood, and blocks in a half-width.
const NEIGHBOURHOOD: f64 = 5.0;
const BLOCKS: usize = 4;

/// Samples in a block of records that are not short, at least: sums over more blocks cost more than the estimates in them.
const SHORTEST_BLOCK: usize = 4;

/// Samples in a piece of work, about.
const PIECE: usize = 1 << 13;

/// The candidates of a record's neighbourhoods.
#[derive(Debug)]
pub(crate) struct Refinement {
    pub(crate) banks: Vec<Bank>,
    reference: Reference,
    pub(crate) blocks: Blocks,
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
    /// Logarithms of weights.
    pub(crate) logarithms: Vec<f64>,
    /// Squared biases.
    pub(crate) biases: Vec<f64>,
}

/// Memory of one thread.
pub(crate) struct AverageScratch {
    pub(crate) banks: Vec<candidates::CandidateScratch>,
    reference: candidates::CandidateScratch,
    compare: Vec<f64>,
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
        Some(Self { banks, reference, blocks, reach, offsets, differences, temperatures, variances, orders })
    }

    /// Ranges of blocks that form one piece of work.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = Range<usize>> {
        let (count, together) = (self.blocks.count(), PIECE.div_ceil(self.blocks.length));
        (0..count).step_by(together).map(move |first| first..(first + together).min(count))
    }

    pub(crate) fn samples(&self, blocks: &Range<usize>) -> Range<usize> {
        self.blocks.samples(blocks.start).start..self.blocks.samples(blocks.end - 1).end
    }

    pub(crate) fn scratch(&self) -> AverageScratch {
        AverageScratch {
            banks: self.banks.iter().map(Bank::scratch).collect(),
            reference: self.reference.bank.scratch(),
            compare: Vec::new(),
            rows: vec![Vec::new(); self.offsets.len()],
        }
    }

    /// Sums the squared differences from the reference in every block, and counts the samples that can be compared: candidate by
    /// candidate, and bank by bank, for each block.
    pub(crate) fn compare(
        &self,
        record: &dyn Samples,
        blocks: Range<usize>,
        sums: &mut [f64],
        counts: &mut [f64],
        scratch: &mut AverageScratch,
    ) {
        let samples = self.samples(&blocks);
        let AverageScratch { banks, reference, compare, .. } = scratch;
        let own = &self.reference;
        let centres = within(&samples, &own.bank.centres(record.len()));
        compare.clear();
        compare.resize(samples.len(), f64::NAN);
        if !centres.is_empty() {
            let estimates = own.bank.estimates(record, centres.clone(), 1, reference);
            compare[centres.start - samples.start..centres.end - samples.start]
                .copy_from_slice(&estimates[own.candidate]);
        }
        let (candidates, mut column) = (self.offsets.len(), 0);
        for (place, (bank, scratch)) in self.banks.iter().zip(banks).enumerate() {
            let centres = within(&centres, &bank.centres(record.len()));
            if !centres.is_empty() {
                let rows = bank.estimates(record, centres.clone(), 1, scratch);
                for block in self.blocks.of(centres.start)..=self.blocks.of(centres.end - 1) {
                    let part = within(&self.blocks.samples(block), &centres);
                    let compare = &compare[part.start - samples.start..part.end - samples.start];
                    let index = block - blocks.start;
                    for (candidate, row) in rows.iter().enumerate() {
                        let row = &row[part.start - centres.start..part.end - centres.start];
                        let (sum, count) = squared_differences(row, compare);
                        sums[index * candidates + column + candidate] = sum;
                        counts[index * self.banks.len() + place] = count;
                    }
                }
            }
            column += bank.orders.len();
        }
    }

    /// The logarithm of every candidate's weight and its squared bias in every block, from the risk around it.
    pub(crate) fn weigh(&self, sums: &[f64], counts: &[f64]) -> Weighed {
        let (blocks, candidates, length) = (self.blocks.count(), self.offsets.len(), self.blocks.length as f64);
        let bank_of: Vec<usize> =
            self.banks.iter().enumerate().flat_map(|(place, bank)| vec![place; bank.orders.len()]).collect();
        let reach = rounded((self.reach / length).floor());
        let bell = |distance: usize| {
            let u = distance as f64 * length / (self.reach + length / 2.0);
            (1.0 - u * u).powi(2)
        };
        let bell: Vec<f64> = (0..=reach).map(bell).collect();
        let neighbourhood = length * (2.0 * bell.iter().sum::<f64>() - bell[0]);
        let mut weights = vec![0.0; blocks * candidates];
        let mut biases = vec![0.0; blocks * candidates];
        let mut sum = vec![0.0; candidates];
        let mut count = vec![0.0; self.banks.len()];
        let rows = weights.chunks_exact_mut(candidates).zip(biases.chunks_exact_mut(candidates));
        for (block, (weights, biases)) in rows.enumerate() {
            sum.fill(0.0);
            count.fill(0.0);
            for other in block.saturating_sub(reach)..(block + reach + 1).min(blocks) {
                let weight = bell[block.abs_diff(other)];
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
        Weighed { logarithms: weights, biases }
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

/// The intersection of two ranges.
pub(crate) fn within(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    let start = one.start.max(other.start);
    start..one.end.min(other.end).max(start)
}

/// Adds numbers with a weight.
fn add(sums: &mut [f64], numbers: &[f64], weight: f64) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += weight * number;
    }
}
