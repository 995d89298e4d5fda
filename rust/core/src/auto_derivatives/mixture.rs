//! Averages of candidates along rows, where all of them are known: eight samples at a time, without a look for what is missing.

use std::ops::Range;

use crate::auto_derivatives::differences::total;
use crate::auto_derivatives::local_weights::{Between, DerivativeOutputs, LocalWeights};
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::vectors::{Kernel, Lanes};

/// The weights of a block add up to one, or they are all zero: more than this tells.
const COMPLETE: f64 = 0.5;

/// Averages a run of samples.
pub(crate) struct Mixture<'a, 'b> {
    /// By candidate: estimates at all samples of the run, from some place of the row on, and order.
    pub(crate) rows: &'a [Vec<f64>],
    pub(crate) first: usize,
    pub(crate) orders: &'a [u8],
    pub(crate) local: &'a LocalWeights<'a>,
    /// Places in the run that lie between the same centres of blocks.
    pub(crate) parts: &'a [(Range<usize>, Between)],
    pub(crate) outputs: &'a mut DerivativeOutputs<'b>,
}

/// What candidates contribute to a part: numbers at its first sample, and by how much they grow from sample to sample; whole vectors of candidates.
struct ShareLines {
    weights: Vec<Packet>,
    growths: Vec<Packet>,
    /// Squared bias and variance.
    squares: Vec<Packet>,
    square_growths: Vec<Packet>,
    /// The candidates that share in it, how many these are, and their weights at some samples.
    shared: Vec<usize>,
    count: usize,
    at_samples: Vec<Packet>,
}

impl ShareLines {
    fn new(candidates: usize) -> Self {
        let zeros = || vec![Packet::ZERO; candidates.div_ceil(WIDTH)];
        Self {
            weights: zeros(),
            growths: zeros(),
            squares: zeros(),
            square_growths: zeros(),
            shared: vec![0; candidates],
            count: 0,
            at_samples: vec![Packet::ZERO; candidates],
        }
    }
}

/// The number of one candidate.
#[inline(always)]
fn of(numbers: &[Packet], candidate: usize) -> Packet {
    Packet::splat(numbers[candidate / WIDTH].0[candidate % WIDTH])
}

impl Kernel for Mixture<'_, '_> {
    /// The parts that could not be averaged: something is missing there, or it is the end of the run.
    type Output = Vec<usize>;

    #[inline(always)]
    fn run<S: Lanes>(mut self, _: S) -> Vec<usize> {
        let (mut left, mut lines) = (Vec::new(), ShareLines::new(self.orders.len()));
        for (index, (part, place)) in self.parts.iter().enumerate() {
            if !self.lines(place, &mut lines) || !self.average(part.clone(), &mut lines) {
                left.push(index);
            }
        }
        left
    }
}

impl Mixture<'_, '_> {
    /// The candidates that share in a part. Returns whether there are weights on both of its sides.
    #[inline(always)]
    fn lines(&self, place: &Between, lines: &mut ShareLines) -> bool {
        let ShareLines { weights, growths, squares, square_growths, shared, count, .. } = lines;
        let [low_weights, high_weights] = self.local.beside(self.local.weights, place);
        let [low_biases, high_biases] = self.local.beside(self.local.biases, place);
        let (distance, advance) = (Packet::splat(place.distance), Packet::splat(place.advance));
        let mut totals = [Packet::ZERO; 2];
        for packet in 0..weights.len() {
            let at = packet * WIDTH;
            let (low, high) = (Packet::load(&low_weights[at..]), Packet::load(&high_weights[at..]));
            totals[0] += low;
            totals[1] += high;
            weights[packet] = low + (high - low) * distance;
            growths[packet] = (high - low) * advance;
            let bias = Packet::load(&low_biases[at..]);
            let more = Packet::load(&high_biases[at..]) - bias;
            squares[packet] = bias + more * distance + Packet::load(&self.local.variances[at..]);
            square_growths[packet] = more * advance;
        }
        // Which candidates share changes from part to part: each is written, and some are written over.
        *count = 0;
        for (candidate, (low, high)) in low_weights.iter().zip(high_weights).take(shared.len()).enumerate() {
            shared[*count] = candidate;
            *count += usize::from(low + high != 0.0);
        }
        total(totals[0]) > COMPLETE && total(totals[1]) > COMPLETE
    }

    /// Averages a part, and whatever follows it in its last vector. Returns whether all could be averaged.
    #[inline(always)]
    fn average(&mut self, part: Range<usize>, lines: &mut ShareLines) -> bool {
        let ShareLines { weights, growths, squares, square_growths, shared, count, at_samples } = lines;
        let (shared, at_samples) = (&shared[..*count], &mut at_samples[..*count]);
        let mut distance = Packet(std::array::from_fn(|lane| lane as f64));
        for at in part.clone().step_by(WIDTH) {
            if at + WIDTH > self.outputs.values.len() {
                return false;
            }
            let mut values = Packet::ZERO;
            for (&candidate, weight) in shared.iter().zip(at_samples.iter_mut()) {
                *weight = of(weights, candidate) + of(growths, candidate) * distance;
                values += *weight * Packet::load(&self.rows[candidate][self.first + at..]);
            }
            if values.0[..WIDTH.min(part.end - at)].iter().any(|value| value.is_nan()) {
                return false;
            }
            values.store(&mut self.outputs.values[at..]);
            if !self.outputs.errors.is_empty() {
                let mut sum = Packet::ZERO;
                for (&candidate, &weight) in shared.iter().zip(&*at_samples) {
                    let away = Packet::load(&self.rows[candidate][self.first + at..]) - values;
                    let own = of(squares, candidate) + of(square_growths, candidate) * distance;
                    sum += weight * (own + away * away);
                }
                sum.sqrt().store(&mut self.outputs.errors[at..]);
            }
            if !self.outputs.order.is_empty() {
                self.heaviest(at, shared, at_samples);
            }
            distance += Packet::splat(WIDTH as f64);
        }
        true
    }

    /// The order of the candidate of most weight.
    #[inline(always)]
    fn heaviest(&mut self, at: usize, shared: &[usize], weights: &[Packet]) {
        let (mut largest, mut best) = (Packet::ZERO, Packet::ZERO);
        for (&candidate, &weights) in shared.iter().zip(weights) {
            let order = f64::from(self.orders[candidate]);
            for lane in 0..WIDTH {
                best.0[lane] = if weights.0[lane] > largest.0[lane] { order } else { best.0[lane] };
            }
            largest = largest.max(weights);
        }
        for (slot, order) in self.outputs.order[at..at + WIDTH].iter_mut().zip(best.0) {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was a byte")]
            let order = order as u8;
            *slot = order;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::dispatch;

    #[test]
    fn rows_are_averaged_as_defined_and_parts_with_something_missing_are_left() {
        let (count, each, candidates) = (40, 7, 3);
        let row = |candidate: usize| (0..count).map(|i| ((candidate + 2) as f64 * i as f64 * 0.1).sin()).collect();
        let mut rows: Vec<Vec<f64>> = (0..candidates).map(row).collect();
        rows[1][15] = f64::NAN;
        // The second candidate has no weight from the fourth centre on, and after the sixth nothing is known.
        let of_block = |block: usize| match block {
            0..=2 => [0.5, 0.25, 0.25],
            3..=5 => [0.75, 0.0, 0.25],
            _ => [0.0; 3],
        };
        // Beside the candidates of every block there is nothing.
        let (stride, beyond) = (WIDTH, [0.0; WIDTH - 3]);
        let weights: Vec<f64> = (0..8).flat_map(|block| of_block(block).into_iter().chain(beyond)).collect();
        let biases: Vec<f64> = (0..weights.len()).map(|i| i as f64 * 0.1).collect();
        let (variances, orders) = ([1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0], [4, 6, 8]);
        let local = LocalWeights {
            first: 0,
            stride,
            logarithms: &[],
            biases: &biases,
            weights: &weights,
            variances: &variances,
            used: vec![true; candidates],
        };
        let part = |index: usize| {
            let place =
                Between { low: index, high: index + 1, distance: 0.5 / each as f64, advance: 1.0 / each as f64 };
            (index * each..count.min((index + 1) * each), place)
        };
        let parts: Vec<_> = (0..6).map(part).collect();
        let mut first_path: Option<Vec<f64>> = None;
        for instructions in Instructions::available() {
            let (mut values, mut errors, mut order) = (vec![0.0; count], vec![0.0; count], vec![0; count]);
            let outputs = &mut DerivativeOutputs { values: &mut values, errors: &mut errors, order: &mut order };
            let mixture = Mixture { rows: &rows, first: 0, orders: &orders, local: &local, parts: &parts, outputs };
            // Something missing; no weights on one side, and the end of the run.
            assert_eq!(dispatch(instructions, mixture), [2, 5]);
            for (index, (part, place)) in parts.iter().enumerate().filter(|(index, _)| ![2, 5].contains(index)) {
                for at in part.clone() {
                    let distance = place.distance + place.advance * (at - part.start) as f64;
                    let between = |numbers: &[f64], one: usize| {
                        let at = |block: usize| numbers[block * stride + one];
                        at(index) * (1.0 - distance) + at(index + 1) * distance
                    };
                    let all = || (0..candidates).map(|one| (one, between(&weights, one)));
                    let value: f64 =
                        all().map(|(one, weight)| if weight > 0.0 { weight * rows[one][at] } else { 0.0 }).sum();
                    let square = |(one, weight): (usize, f64)| {
                        let away = rows[one][at] - value;
                        weight * (between(&biases, one) + variances[one] + away * away)
                    };
                    let error = all().filter(|(_, weight)| *weight > 0.0).map(square).sum::<f64>().sqrt();
                    assert!((values[at] - value).abs() < 8.0 * f64::EPSILON, "{at}");
                    assert!((errors[at] / error - 1.0).abs() < 8.0 * f64::EPSILON, "{at}");
                    assert_eq!(order[at], 4, "{at}");
                }
            }
            let known: Vec<f64> = values.iter().zip(&errors).take(14).flat_map(|(a, b)| [*a, *b]).collect();
            assert_eq!(*first_path.get_or_insert_with(|| known.clone()), known, "the same bits on every path");
        }
    }
}
