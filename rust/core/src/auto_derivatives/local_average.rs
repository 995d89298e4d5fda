//! Candidates averaged locally: the best window and order of a record need not be the best everywhere in it.
//!
//! The risk of [`crate::auto_derivatives::global_choice`] is averaged over a neighbourhood of five half-widths of the
//! record's best window, with the weight `(1 - u²)²`. There the candidates are the record's best window, one twice and
//! others 2, 4 and 8 times as short, with all orders. None is chosen: with `S_c` the local risk, they are averaged with
//! weights
//!
//! ```text
//! w_c ∝ exp(-n (S_c - S_min) / (2 T)),   T = 3 σ² g / v,
//! ```
//!
//! `n` the samples of the neighbourhood, `g` and `v` gain and leverage of the best there: `T` is the noise of the derivative per degree of
//! freedom, for a fit has some `v` degrees of freedom a sample, and `σ² g/v` is a third of that of its highest frequency.
//!
//! The least error has bias: where `b² + v` is least over windows, with `b` of the power `p` of the half-width and `v` of the
//! power `-(2d + 1)`, `b² = (2d + 1)/(2p) v`, a third of the variance for θ̈. So the standard error holds both. The squared
//! bias of a candidate is its mean squared difference from the reference in the neighbourhood less the variance of that
//! difference, or zero if that is negative. The standard error of an average is `√Σ w_c (b_c² + σ² g_c + (d_c - d)²)` (Burnham
//! and Anderson 2002, section 4.3.2).
//!
//! Sums are kept for blocks of a quarter of the half-width, and weights are linear between the blocks' centres.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::auto_derivatives::candidate_weights::{AverageScratch, Refinement, Weighed, within};
use crate::error::Error;
use crate::exec::pool::{self, Piece, Watch};
use crate::lanes::output::split_off;
use crate::record::samples::Samples;

/// Candidates of less weight are left out.
const NEGLIGIBLE: f64 = 1e-9;

/// Where the estimates of one record go. Slices that are empty are not wanted.
#[derive(Debug)]
pub(crate) struct DerivativeOutputs<'a> {
    pub(crate) values: &'a mut [f64],
    pub(crate) errors: &'a mut [f64],
    pub(crate) order: &'a mut [u8],
}

/// Turns logarithms of weights, of which the largest is zero, into weights.
fn normalise(weights: &mut [f64]) {
    let total: f64 = weights.iter().map(|weight| weight.exp()).sum();
    for weight in weights {
        let share = weight.exp() / total;
        *weight = if share > NEGLIGIBLE { share } else { 0.0 };
    }
}
impl Refinement {
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
        let (mut between, mut active) = ((usize::MAX, usize::MAX), Vec::new());
        for (place, sample) in samples.clone().enumerate() {
            let (low, high, distance) = self.blocks.between(sample);
            if between != (low, high) {
                between = (low, high);
                active.clear();
                let of = |numbers: &[f64], one: usize| {
                    let of = |block: usize| numbers[(block - around.start) * candidates + one];
                    (of(low), of(high) - of(low))
                };
                let candidates = (0..candidates).filter(|&one| used[one]);
                let candidates = candidates.map(|one| (one, of(&weights, one), of(biases, one)));
                active.extend(candidates.filter(|(_, weight, _)| *weight != (0.0, 0.0)));
            }
            let line = |(start, growth): (f64, f64)| start + distance * growth;
            let shares = active.iter().map(|&(candidate, weight, bias)| Share {
                candidate,
                weight: line(weight),
                bias: line(bias),
            });
            if !self.mix(&shares, place, outputs, scratch) {
                missing.push((place, self.blocks.of(sample)));
            }
        }
        if missing.is_empty() {
            return;
        }
        // Near the ends and near unusable samples the best windows do not fit: take the best of those that do.
        let rest: Vec<bool> = used.iter().map(|used| !used).collect();
        self.fill(record, &samples, &rest, scratch);
        for (place, block) in missing {
            let own = (block - around.start) * candidates..(block - around.start + 1) * candidates;
            let (row, biases) = (&logarithms[own.clone()], &biases[own]);
            let fits =
                (0..candidates).filter(|&one| !scratch.rows[one][place].is_nan() && row[one] > f64::NEG_INFINITY);
            let best = fits.max_by(|&a, &b| row[a].total_cmp(&row[b]));
            let share = best.into_iter().map(|candidate| Share { candidate, weight: 1.0, bias: biases[candidate] });
            self.mix(&share, place, outputs, scratch);
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

    /// Writes the average of some candidates at one place, or NaN. Returns whether there is one.
    fn mix(
        &self,
        shares: &(impl Iterator<Item = Share> + Clone),
        place: usize,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &AverageScratch,
    ) -> bool {
        let estimate = |candidate: usize| scratch.rows[candidate][place];
        let known = || shares.clone().filter(|share| share.weight > 0.0 && !estimate(share.candidate).is_nan());
        let (mut total, mut sum, mut largest, mut best) = (0.0, 0.0, 0.0, None);
        for Share { candidate, weight, .. } in known() {
            total += weight;
            sum += weight * estimate(candidate);
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
            let square = |Share { candidate, weight, bias }: Share| {
                weight * (bias + self.variances[candidate] + (estimate(candidate) - value).powi(2))
            };
            *error = (known().map(square).sum::<f64>() / total).sqrt();
        }
        best.is_some()
    }
}

/// What a candidate contributes to one sample.
#[derive(Clone, Copy)]
struct Share {
    candidate: usize,
    weight: f64,
    /// Its squared bias there.
    bias: f64,
}
