//! Candidates weighed where they are used: a record's best window and order need not be the best everywhere in it.
//!
//! The risk of [`crate::auto_derivatives::global_choice`] is averaged over a neighbourhood of five half-widths of the record's best window, with the weight
//! `(1 - u²)²`. There the candidates are the record's best window, one twice and others 2, 4 and 8 times as short, with all orders. None is
//! chosen: with `S_c` the local risk, they are averaged with weights
//!
//! ```text
//! w_c ∝ exp(-n (S_c - S_min) / (2 T)),   T = 3 σ² g / v,
//! ```
//!
//! `n` the samples of the neighbourhood, `g` and `v` gain and leverage of the best there: `T` is the noise of the derivative per degree of
//! freedom, for a fit has some `v` degrees of freedom a sample, and `σ² g/v` is a third of that of its highest frequency.
//!
//! The least error has bias: where `b² + v` is least over windows, with `b` of the power `p` of the half-width and `v` of the power
//! `-(2d + 1)`, `b² = (2d + 1)/(2p) v`, a third of the variance for θ̈. So the standard error holds both. The squared bias of a
//! candidate is its mean squared difference from the reference in the neighbourhood less the variance of that difference, or nothing
//! where that is negative. The standard error of an average is `√Σ w_c (b_c² + σ² g_c + (d_c - d)²)` (Burnham and Anderson 2002, section 4.3.2).
//!
//! Sums are kept for blocks of a quarter of the half-width, and weights are linear between the blocks' centres.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::auto_derivatives::candidates::{self, Bank, Target, product};
use crate::auto_derivatives::global_choice::{OPTIMISM, Pair, rounded};
use crate::auto_derivatives::symmetric_grid::Blocks;
use crate::error::Error;
use crate::exec::pool::{self, Piece, Watch};
use crate::lanes::output::split_off;
use crate::record::samples::Samples;

/// The windows over the record's best.
const WINDOWS: [f64; 5] = [0.125, 0.25, 0.5, 1.0, 2.0];

/// The reference has a window so much shorter.
const REFERENCE: f64 = 1.189_207_115_002_721;

/// Half-widths of the best window in half a neighbourhood, and blocks in a half-width.
const NEIGHBOURHOOD: f64 = 5.0;
const BLOCKS: usize = 4;

/// Samples in a piece of work, about.
const PIECE: usize = 1 << 13;

/// Candidates of less weight are left out.
const NEGLIGIBLE: f64 = 1e-9;

/// The candidates of a record's neighbourhoods.
#[derive(Debug)]
pub(crate) struct Refinement {
    banks: Vec<Bank>,
    reference: Reference,
    blocks: Blocks,
    /// Samples in half a neighbourhood.
    reach: f64,
    /// By candidate of all banks: twice the covariance with the reference and what optimism adds; variance of the difference from the
    /// reference; `T`; variance; order.
    offsets: Vec<f64>,
    differences: Vec<f64>,
    temperatures: Vec<f64>,
    variances: Vec<f64>,
    orders: Vec<u8>,
}

/// What candidates are compared with.
#[derive(Debug)]
pub(crate) struct Reference {
    pub(crate) bank: Bank,
    pub(crate) candidate: usize,
}

impl Reference {
    /// The same order in a window so much shorter, or else in the same window.
    pub(crate) fn new(pair: Pair, shorter: f64, target: &Target) -> Option<Self> {
        let with_order = |half: usize| {
            let bank = Bank::new(half, target)?;
            let candidate = bank.orders.iter().position(|&order| order == pair.order)?;
            Some(Self { bank, candidate })
        };
        with_order(rounded(pair.half as f64 / shorter).max(target.shortest)).or_else(|| with_order(pair.half))
    }
}

/// Where the estimates of one record go. Slices that are empty are not wanted.
#[derive(Debug)]
pub(crate) struct DerivativeOutputs<'a> {
    pub(crate) values: &'a mut [f64],
    pub(crate) errors: &'a mut [f64],
    pub(crate) order: &'a mut [u8],
}

/// What is known of every candidate in every block, block by block.
struct Weighed {
    /// Logarithms of weights.
    logarithms: Vec<f64>,
    /// Squared biases.
    biases: Vec<f64>,
}

/// Memory of one thread.
struct AverageScratch {
    banks: Vec<candidates::CandidateScratch>,
    reference: candidates::CandidateScratch,
    compare: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

impl Refinement {
    /// Prepares the candidates around a record's best pair.
    pub(crate) fn new(samples: usize, pair: Pair, target: &Target, variance: f64) -> Option<Self> {
        let half = pair.half as f64;
        let reference = Reference::new(pair, REFERENCE, target)?;
        let mut halves: Vec<usize> = WINDOWS.iter().map(|ratio| rounded(half * ratio)).collect();
        halves.dedup();
        halves.retain(|&half| half >= target.shortest && 2 * half < samples / 2);
        let banks: Vec<Bank> = halves.into_iter().filter_map(|half| Bank::new(half, target)).collect();
        let compared = reference.bank.kernel(reference.candidate);
        let reference_gain = reference.bank.gains[reference.candidate];
        let (mut offsets, mut differences, mut temperatures) = (Vec::new(), Vec::new(), Vec::new());
        let (mut variances, mut orders) = (Vec::new(), Vec::new());
        for bank in &banks {
            for (candidate, (gain, leverage)) in bank.gains.iter().zip(&bank.leverages).enumerate() {
                let shared = product(&bank.kernel(candidate), &compared, bank.half);
                offsets.push(variance * (2.0 * shared + (OPTIMISM - 1.0) * gain));
                differences.push(variance * (gain + reference_gain - 2.0 * shared));
                temperatures.push((3.0 * variance * gain / leverage).max(f64::MIN_POSITIVE));
                variances.push(variance * gain);
            }
            orders.extend(bank.orders.iter().map(|&order| u8::try_from(order).unwrap_or(u8::MAX)));
        }
        let blocks = Blocks::new(samples, (pair.half / BLOCKS).max(1));
        let reach = NEIGHBOURHOOD * half;
        Some(Self { banks, reference, blocks, reach, offsets, differences, temperatures, variances, orders })
    }

    /// Estimates wherever a window of any candidate lies in the record; NaN elsewhere.
    pub(crate) fn estimate(
        &self,
        record: &dyn Samples,
        outputs: &mut DerivativeOutputs<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let (blocks, candidates) = (self.blocks.count(), self.offsets.len());
        let mut sums = vec![0.0; blocks * candidates];
        let mut counts = vec![0.0; blocks * self.banks.len()];
        let total = 2 * record.len();
        {
            let (mut sums, mut counts) = (sums.as_mut_slice(), counts.as_mut_slice());
            let mut pieces = Vec::new();
            for part in self.pieces() {
                let own = split_off(&mut sums, part.len() * candidates);
                let own_counts = split_off(&mut counts, part.len() * self.banks.len());
                pieces.push(Piece { size: self.samples(&part).len(), content: (part, own, own_counts) });
            }
            let work = |(part, sums, counts): (Range<usize>, &mut [f64], &mut [f64]), scratch: &mut AverageScratch| {
                self.compare(record, part, sums, counts, scratch);
            };
            pool::run(pieces, workers, || self.scratch(), work, &mut |done, _| watch(done, total))?;
        }
        let weighed = self.weigh(&sums, &counts);
        drop((sums, counts));
        let mut pieces = Vec::new();
        let DerivativeOutputs { values, errors, order } = outputs;
        let (mut values, mut errors, mut order) = (&mut **values, &mut **errors, &mut **order);
        for part in self.pieces() {
            let size = self.samples(&part).len();
            let own = DerivativeOutputs {
                values: split_off(&mut values, size),
                errors: split_off(&mut errors, size),
                order: split_off(&mut order, size),
            };
            pieces.push(Piece { size, content: (part, own) });
        }
        let work = |(part, mut outputs): (Range<usize>, DerivativeOutputs<'_>), scratch: &mut AverageScratch| {
            self.average(record, part, &weighed, &mut outputs, scratch);
        };
        let samples = record.len();
        pool::run(pieces, workers, || self.scratch(), work, &mut |done, _| watch(samples + done, total))
    }

    /// Blocks that are worked on together.
    fn pieces(&self) -> impl Iterator<Item = Range<usize>> {
        let (count, together) = (self.blocks.count(), PIECE.div_ceil(self.blocks.length));
        (0..count).step_by(together).map(move |first| first..(first + together).min(count))
    }

    fn samples(&self, blocks: &Range<usize>) -> Range<usize> {
        self.blocks.samples(blocks.start).start..self.blocks.samples(blocks.end - 1).end
    }

    fn scratch(&self) -> AverageScratch {
        AverageScratch {
            banks: self.banks.iter().map(Bank::scratch).collect(),
            reference: self.reference.bank.scratch(),
            compare: Vec::new(),
            rows: vec![Vec::new(); self.offsets.len()],
        }
    }

    /// Sums the squared differences from the reference in every block, and counts the samples that can be compared: candidate by
    /// candidate, and bank by bank, for each block.
    fn compare(
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
                        let squares = row.iter().zip(compare).map(|(a, b)| (a - b) * (a - b));
                        let (sum, count) = squares
                            .filter(|square| !square.is_nan())
                            .fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
                        sums[index * candidates + column + candidate] = sum;
                        counts[index * self.banks.len() + place] = count;
                    }
                }
            }
            column += bank.orders.len();
        }
    }

    /// The logarithm of every candidate's weight and its squared bias in every block, from the risk around it.
    fn weigh(&self, sums: &[f64], counts: &[f64]) -> Weighed {
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
                // In this order, since what is too hot is nought, and nought times infinity is no number.
                *weight = (least - *weight) / (2.0 * temperature) * neighbourhood;
            }
        }
        Weighed { logarithms: weights, biases }
    }

    /// Averages the candidates of some blocks' samples.
    fn average(
        &self,
        record: &dyn Samples,
        blocks: Range<usize>,
        weighed: &Weighed,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &mut AverageScratch,
    ) {
        let (samples, candidates) = (self.samples(&blocks), self.offsets.len());
        // Weights are linear between the centres of neighbouring blocks.
        let around = blocks.start.saturating_sub(1)..(blocks.end + 1).min(self.blocks.count());
        let part = around.start * candidates..around.end * candidates;
        let (logarithms, biases) = (&weighed.logarithms[part.clone()], &weighed.biases[part]);
        let mut weights = logarithms.to_vec();
        weights.chunks_exact_mut(candidates).for_each(normalise);
        let weighed = |candidate: usize| weights[candidate..].iter().step_by(candidates).any(|&weight| weight > 0.0);
        let used: Vec<bool> = (0..candidates).map(weighed).collect();
        self.fill(record, &samples, &used, scratch);
        let mut missing = Vec::new();
        for (place, sample) in samples.clone().enumerate() {
            let (low, high, distance) = self.blocks.between(sample);
            let between = |numbers: &[f64], candidate: usize| {
                let of = |block: usize| numbers[(block - around.start) * candidates + candidate];
                of(low) + distance * (of(high) - of(low))
            };
            let (weight, bias) = (|one: usize| between(&weights, one), |one: usize| between(biases, one));
            if !self.mix(weight, bias, &used, place, outputs, scratch) {
                missing.push((place, self.blocks.of(sample)));
            }
        }
        if missing.is_empty() {
            return;
        }
        // Near the ends, and what cannot be used, the windows that are best do not fit: the best of those that do.
        let rest: Vec<bool> = used.iter().map(|used| !used).collect();
        self.fill(record, &samples, &rest, scratch);
        let all = vec![true; candidates];
        for (place, block) in missing {
            let own = (block - around.start) * candidates..(block - around.start + 1) * candidates;
            let (row, biases) = (&logarithms[own.clone()], &biases[own]);
            let fits =
                (0..candidates).filter(|&one| !scratch.rows[one][place].is_nan() && row[one] > f64::NEG_INFINITY);
            let best = fits.max_by(|&a, &b| row[a].total_cmp(&row[b]));
            let chosen = |candidate| f64::from(u8::from(Some(candidate) == best));
            self.mix(chosen, |candidate| biases[candidate], &all, place, outputs, scratch);
        }
    }

    /// Fills the rows of the candidates wanted; NaN where a window does not fit.
    fn fill(&self, record: &dyn Samples, samples: &Range<usize>, wanted: &[bool], scratch: &mut AverageScratch) {
        let AverageScratch { banks, rows, .. } = scratch;
        let mut first = 0;
        for (bank, scratch) in self.banks.iter().zip(banks) {
            let own = first..first + bank.orders.len();
            first = own.end;
            let centres = within(samples, &bank.centres(record.len()));
            if !wanted[own.clone()].contains(&true) {
                continue;
            }
            for row in &mut rows[own.clone()] {
                row.clear();
                row.resize(samples.len(), f64::NAN);
            }
            if !centres.is_empty() {
                let estimates = bank.estimates(record, centres.clone(), 1, scratch);
                for (row, estimates) in rows[own].iter_mut().zip(estimates) {
                    row[centres.start - samples.start..centres.end - samples.start].copy_from_slice(estimates);
                }
            }
        }
    }

    /// Writes the average of some candidates at one place, or NaN and the news that there is none.
    fn mix(
        &self,
        weight: impl Fn(usize) -> f64,
        bias: impl Fn(usize) -> f64,
        used: &[bool],
        place: usize,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &AverageScratch,
    ) -> bool {
        let known = || {
            let weighed =
                (0..used.len()).filter(|&candidate| used[candidate]).map(|candidate| (candidate, weight(candidate)));
            weighed.filter(|&(candidate, weight)| weight > 0.0 && !scratch.rows[candidate][place].is_nan())
        };
        let (mut total, mut sum, mut largest, mut best) = (0.0, 0.0, 0.0, None);
        for (candidate, weight) in known() {
            total += weight;
            sum += weight * scratch.rows[candidate][place];
            if weight > largest {
                (largest, best) = (weight, Some(candidate));
            }
        }
        let value = sum / total;
        outputs.values[place] = value;
        if let (Some(slot), Some(best)) = (outputs.order.get_mut(place), best) {
            *slot = self.orders[best];
        }
        if let Some(error) = outputs.errors.get_mut(place) {
            let square = |(candidate, weight): (usize, f64)| {
                weight
                    * (bias(candidate) + self.variances[candidate] + (scratch.rows[candidate][place] - value).powi(2))
            };
            *error = (known().map(square).sum::<f64>() / total).sqrt();
        }
        best.is_some()
    }
}

/// Turns logarithms of weights, of which the largest is zero, into weights.
fn normalise(weights: &mut [f64]) {
    let total: f64 = weights.iter().map(|weight| weight.exp()).sum();
    for weight in weights {
        let share = weight.exp() / total;
        *weight = if share > NEGLIGIBLE { share } else { 0.0 };
    }
}

/// What two ranges share.
fn within(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    let start = one.start.max(other.start);
    start..one.end.min(other.end).max(start)
}

/// Adds numbers with a weight.
fn add(sums: &mut [f64], numbers: &[f64], weight: f64) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += weight * number;
    }
}
