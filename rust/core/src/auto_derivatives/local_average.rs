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

use crate::auto_derivatives::block_means::{BlockMeans, Grid};
use crate::auto_derivatives::block_weights::BlockWeights;
use crate::auto_derivatives::candidate_weights::{AverageScratch, Refinement};
use crate::auto_derivatives::interpolated_average::{POINTS, fill_between};
use crate::auto_derivatives::local_weights::{DerivativeOutputs, LocalWeights, Weighed};
use crate::auto_derivatives::mixture::Mixture;
use crate::error::Error;
use crate::exec::pool::{self, Piece, Watch};
use crate::lanes::output::split_off;
use crate::simd::vectors::dispatch;

impl Refinement {
    /// Estimates wherever a window of any candidate lies in the record; NaN elsewhere.
    pub(crate) fn estimate(
        &self,
        means: &BlockMeans<'_>,
        outputs: &mut DerivativeOutputs<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let (samples, total) = (self.samples, 2 * self.samples);
        let DerivativeOutputs { values, errors, order } = outputs;
        let mut rest = DerivativeOutputs { values, errors, order };
        if self.at_every_sample() {
            let work = |(part, mut outputs): (Range<usize>, DerivativeOutputs<'_>), scratch: &mut AverageScratch| {
                let weighed = self.weigh_alone(means, &part, scratch);
                self.average(means, part, &weighed, &mut outputs, scratch);
            };
            let pieces = self.chunks().flat_map(|chunk| self.pieces_of(&chunk, &mut rest)).collect();
            pool::run(pieces, workers, || self.scratch(), work, &mut |done, _| watch(2 * done, total))?;
            return if watch(2 * samples, total) { Ok(()) } else { Err(Error::Cancelled) };
        }
        for chunk in self.chunks() {
            // What is done of both passes.
            let (before, size) = (2 * self.samples(&chunk).start, self.samples(&chunk).len());
            let weighed =
                self.weigh_around(means, &chunk, workers, &mut |done, _| watch(before + done.min(size), total))?;
            let pieces = self.pieces_of(&chunk, &mut rest);
            let work = |(part, mut outputs): (Range<usize>, DerivativeOutputs<'_>), scratch: &mut AverageScratch| {
                self.average(means, part, &weighed, &mut outputs, scratch);
            };
            pool::run(pieces, workers, || self.scratch(), work, &mut |done, _| watch(before + size + done, total))?;
        }
        if watch(2 * samples, total) { Ok(()) } else { Err(Error::Cancelled) }
    }

    /// Pieces of some blocks, each with its outputs, which are taken off the rest.
    fn pieces_of<'b>(
        &self,
        blocks: &Range<usize>,
        rest: &mut DerivativeOutputs<'b>,
    ) -> Vec<Piece<(Range<usize>, DerivativeOutputs<'b>)>> {
        let mut piece = |part: Range<usize>| {
            let size = self.samples(&part).len();
            let own = DerivativeOutputs {
                values: split_off(&mut rest.values, size),
                errors: split_off(&mut rest.errors, size),
                order: split_off(&mut rest.order, size),
            };
            Piece { size, content: (part, own) }
        };
        self.pieces(blocks).map(&mut piece).collect()
    }

    /// The weights of some blocks and of those beside them, on one thread. The estimates that were compared stay where they are averaged.
    fn weigh_alone(&self, means: &BlockMeans<'_>, blocks: &Range<usize>, scratch: &mut AverageScratch) -> Weighed {
        let around = self.blocks_around(blocks, self.blocks_beside());
        let known = self.blocks_around(&around, self.reach());
        let mut sums = vec![0.0; known.len() * self.stride()];
        let mut counts = vec![0.0; known.len() * self.banks.len()];
        self.compare(means, known.clone(), &mut sums, &mut counts, scratch);
        self.weigh(around, known.start, &sums, &counts)
    }

    /// The weights of some blocks and of those beside them.
    fn weigh_around(
        &self,
        means: &BlockMeans<'_>,
        chunk: &Range<usize>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<Weighed, Error> {
        let around = self.blocks_around(chunk, self.blocks_beside());
        let known = self.blocks_around(&around, self.reach());
        let mut sums = vec![0.0; known.len() * self.stride()];
        let mut counts = vec![0.0; known.len() * self.banks.len()];
        let (mut all, mut all_counts) = (sums.as_mut_slice(), counts.as_mut_slice());
        let mut pieces = Vec::new();
        for part in self.pieces(&known) {
            let own = split_off(&mut all, part.len() * self.stride());
            let own_counts = split_off(&mut all_counts, part.len() * self.banks.len());
            pieces.push(Piece { size: self.samples(&part).len(), content: (part, own, own_counts) });
        }
        let work = |(part, sums, counts): (Range<usize>, &mut [f64], &mut [f64]), scratch: &mut AverageScratch| {
            self.compare(means, part, sums, counts, scratch);
        };
        pool::run(pieces, workers, || self.scratch(), work, watch)?;
        Ok(self.weigh(around, known.start, &sums, &counts))
    }

    /// Averages the candidates of some blocks' samples.
    fn average(
        &self,
        means: &BlockMeans<'_>,
        blocks: Range<usize>,
        weighed: &Weighed,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &mut AverageScratch,
    ) {
        let (samples, stride) = (self.samples(&blocks), self.stride());
        // Weights are linear between the centres of neighbouring blocks.
        let around = self.blocks_around(&blocks, self.blocks_beside());
        let part = (around.start - weighed.first) * stride..(around.end - weighed.first) * stride;
        let (logarithms, biases) = (&weighed.logarithms[part.clone()], &weighed.biases[part]);
        let (mut weights, mut used) = (logarithms.to_vec(), vec![false; self.offsets.len()]);
        let mut variances = self.variances.clone();
        variances.resize(stride, 0.0);
        let variances = &*variances;
        dispatch(self.instructions, BlockWeights { weights: &mut weights, variances, used: &mut used });
        let (first, weights) = (around.start, &*weights);
        let local = LocalWeights { first, stride, logarithms, biases, weights, variances, used };
        for run in self.interpolate(means, &samples, &local, outputs, scratch) {
            self.average_run(means, &run, samples.start, &local, outputs, scratch);
        }
    }

    /// Averages the candidates at every sample of a run, wherever any of them fits.
    fn average_run(
        &self,
        means: &BlockMeans<'_>,
        run: &Range<usize>,
        begin: usize,
        local: &LocalWeights<'_>,
        outputs: &mut DerivativeOutputs<'_>,
        scratch: &mut AverageScratch,
    ) {
        let candidates = self.offsets.len();
        let inside = run.start - begin..run.end - begin;
        let wanted = |all: &mut [f64]| if all.is_empty() { 0..0 } else { inside.clone() };
        let (in_errors, in_order) =
            (wanted(outputs.errors), if outputs.order.is_empty() { 0..0 } else { inside.clone() });
        let outputs = &mut DerivativeOutputs {
            values: &mut outputs.values[inside],
            errors: &mut outputs.errors[in_errors],
            order: &mut outputs.order[in_order],
        };
        if !scratch.kept.as_ref().is_some_and(|kept| kept.start <= run.start && run.end <= kept.end) {
            self.fill(means, run, &local.used, scratch);
        }
        let first = scratch.kept.as_ref().map_or(0, |kept| run.start - kept.start);
        let mut parts = Vec::new();
        self.between_centres(Grid::new(self.samples, 1), run.clone(), |part, place| {
            parts.push((part.start - run.start..part.end - run.start, place));
        });
        let (rows, orders) = (&*scratch.rows, &*self.orders);
        let left = dispatch(self.instructions, Mixture { rows, first, orders, local, parts: &parts, outputs });
        let mut missing = Vec::new();
        for (part, place) in left.into_iter().map(|index| parts[index].clone()) {
            let shares = (0..candidates).filter(|&one| local.used[one]);
            let shares = shares.map(|one| Share {
                candidate: one,
                weight: local.weight(one, place),
                bias: local.bias(one, place),
            });
            let active: Vec<Share> = shares.filter(|share| share.weight != (0.0, 0.0)).collect();
            // A few samples between the same centres.
            for begin in part.clone().step_by(TOGETHER) {
                let distance = |i: usize| place.advance * (begin - part.start + i) as f64;
                let places = begin..part.end.min(begin + TOGETHER);
                for place in self.mix(&active, &std::array::from_fn(distance), places, outputs, (first, scratch)) {
                    missing.push((place, self.blocks.of(run.start + place)));
                }
            }
        }
        if missing.is_empty() {
            return;
        }
        // Near the ends and near unusable samples the best windows do not fit: take the best of those that do.
        let rest: Vec<bool> = local.used.iter().map(|used| !used).collect();
        if scratch.kept.is_none() {
            self.fill(means, run, &rest, scratch);
        }
        for (place, block) in missing {
            let begin = (block - local.first) * local.stride;
            let own = begin..begin + candidates;
            let (row, biases) = (&local.logarithms[own.clone()], &local.biases[own]);
            let fits = (0..candidates)
                .filter(|&one| !scratch.rows[one][first + place].is_nan() && row[one] > f64::NEG_INFINITY);
            let best = fits.max_by(|&a, &b| row[a].total_cmp(&row[b]));
            let share = best.map(|candidate| Share { candidate, weight: (1.0, 0.0), bias: (biases[candidate], 0.0) });
            let _ = self.mix(share.as_slice(), &[0.0; TOGETHER], place..place + 1, outputs, (first, scratch));
        }
    }

    /// Fills the rows of the candidates wanted at all samples of a run; NaN where a window does not fit.
    fn fill(&self, means: &BlockMeans<'_>, run: &Range<usize>, wanted: &[bool], scratch: &mut AverageScratch) {
        scratch.kept = None;
        for bank in 0..self.banks.len() {
            let (own, grid) = (self.candidates_of(bank), self.grid(bank));
            if !wanted[own.clone()].contains(&true) {
                continue;
            }
            let margin = POINTS * (grid.step - 1);
            let around = run.start.saturating_sub(margin)..(run.end + margin).min(self.samples);
            let (first, _) = self.fill_own(means, bank, &around, scratch);
            let rows = &mut scratch.rows[own.clone()];
            if grid.step == 1 && rows[0].len() == run.len() {
                continue;
            }
            let known: Vec<Vec<f64>> = rows.iter_mut().map(std::mem::take).collect();
            for row in &mut *rows {
                row.resize(run.len(), f64::NAN);
            }
            if grid.step > 1 {
                fill_between(rows, run, grid, first, &known);
                continue;
            }
            for (row, known) in rows.iter_mut().zip(known) {
                row[first.max(run.start) - run.start..][..known.len()].copy_from_slice(&known);
            }
        }
    }

    /// Writes the average of some candidates at a few places, or NaN. Returns the places where there is none. Rows begin so much before the run.
    fn mix(
        &self,
        shares: &[Share],
        distances: &[f64; TOGETHER],
        places: Range<usize>,
        outputs: &mut DerivativeOutputs<'_>,
        (before, scratch): (usize, &AverageScratch),
    ) -> impl Iterator<Item = usize> + use<> {
        let count = places.len();
        // Estimates and weights, zero where there is no estimate.
        let known = |share: &Share| {
            let mut estimates = [f64::NAN; TOGETHER];
            estimates[..count].copy_from_slice(&scratch.rows[share.candidate][before + places.start..][..count]);
            let mut weights = line(share.weight, distances);
            for (estimate, weight) in estimates.iter_mut().zip(&mut weights) {
                let usable = *weight > 0.0 && !estimate.is_nan();
                *weight = if usable { *weight } else { 0.0 };
                *estimate = if usable { *estimate } else { 0.0 };
            }
            (estimates, weights)
        };
        let (mut total, mut values, mut largest) = ([0.0; TOGETHER], [0.0; TOGETHER], [0.0; TOGETHER]);
        let mut best = [None; TOGETHER];
        for share in shares {
            let (estimates, weights) = known(share);
            for i in 0..TOGETHER {
                total[i] += weights[i];
                values[i] += weights[i] * estimates[i];
            }
            for i in 0..TOGETHER {
                if weights[i] > largest[i] {
                    (largest[i], best[i]) = (weights[i], Some(share.candidate));
                }
            }
        }
        values.iter_mut().zip(&total).for_each(|(value, total)| *value /= total);
        outputs.values[places.clone()].copy_from_slice(&values[..count]);
        if !outputs.order.is_empty() {
            for (slot, best) in outputs.order[places.clone()].iter_mut().zip(best) {
                *slot = best.map_or(*slot, |best| self.orders[best]);
            }
        }
        if !outputs.errors.is_empty() {
            let mut squares = [0.0; TOGETHER];
            for share in shares {
                let ((estimates, weights), biases) = (known(share), line(share.bias, distances));
                let variance = self.variances[share.candidate];
                for i in 0..TOGETHER {
                    let away = estimates[i] - values[i];
                    // Where the weight is zero nothing is added, whatever there is no value of.
                    let square = weights[i] * (biases[i] + variance + away * away);
                    squares[i] += if weights[i] > 0.0 { square } else { 0.0 };
                }
            }
            for ((slot, square), total) in outputs.errors[places.clone()].iter_mut().zip(squares).zip(total) {
                *slot = (square / total).sqrt();
            }
        }
        let first = places.start;
        (0..count).filter(move |&i| best[i].is_none()).map(move |i| first + i)
    }
}

/// Samples that are averaged together.
const TOGETHER: usize = 8;

/// What a candidate contributes between two centres: numbers at the first, and by how much they grow.
#[derive(Clone, Copy)]
struct Share {
    candidate: usize,
    weight: (f64, f64),
    /// Its squared bias there.
    bias: (f64, f64),
}

/// Numbers on a line, at some distances from its start.
fn line((start, growth): (f64, f64), distances: &[f64; TOGETHER]) -> [f64; TOGETHER] {
    distances.map(|distance| start + distance * growth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auto_derivatives::candidates::Target;
    use crate::auto_derivatives::global_choice::Pair;
    use crate::noise::correlated::CorrelatedNoise;
    use crate::noise::quantisation::tests::uniform;
    use crate::simd::instructions::Instructions;

    #[test]
    fn what_was_compared_at_every_sample_is_averaged_as_it_is() {
        let samples = 40_000;
        let mut sum = 0.0;
        let walk = |e: f64| {
            sum += e;
            sum
        };
        let mut record: Vec<f64> = uniform(samples).into_iter().map(walk).collect();
        record[12_345] = f64::NAN;
        let (record, noise) = (record.as_slice(), CorrelatedNoise::white(0.02));
        let means = BlockMeans::new(&record, 40).expect("little memory");
        let instructions = Instructions::current();
        let target = Target {
            derivative: 1,
            highest: 15,
            fixed: false,
            shortest: 4,
            of_means: true,
            delta: 1.0,
            noise: &noise,
            instructions,
        };
        let of = Refinement::new(samples, Pair { half: 5, order: 3 }, &target);
        let of = of.expect("little memory").expect("long enough");
        assert!(of.at_every_sample());
        let (mut values, mut errors, mut order) = (vec![0.0; samples], vec![0.0; samples], vec![0; samples]);
        let mut outputs = DerivativeOutputs { values: &mut values, errors: &mut errors, order: &mut order };
        of.estimate(&means, &mut outputs, NonZeroUsize::MIN, &mut |_, _| true).expect("nobody cancels");
        let (mut again, mut of_errors, mut of_order) = (vec![0.0; samples], vec![0.0; samples], vec![0; samples]);
        let mut rest = DerivativeOutputs { values: &mut again, errors: &mut of_errors, order: &mut of_order };
        for chunk in of.chunks() {
            let weighed = of.weigh_around(&means, &chunk, NonZeroUsize::MIN, &mut |_, _| true).expect("nobody cancels");
            for Piece { content: (part, mut own), .. } in of.pieces_of(&chunk, &mut rest) {
                // Nothing is kept: all is estimated anew.
                of.average(&means, part, &weighed, &mut own, &mut of.scratch());
            }
        }
        let bits = |numbers: &[f64]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&values), bits(&again));
        assert_eq!(bits(&errors), bits(&of_errors));
        assert_eq!(order, of_order);
        assert!(values[12_345].is_nan() && values.iter().filter(|value| value.is_nan()).count() < 60);
    }
}
