//! Windows that lack samples, or whose samples have weights: each is fitted on what is there, by the QR decomposition of its own design.
//!
//! The columns are those of a full window's basis at the samples that are there. With `R` and `c = Qᵀy` of them the fit of every order is
//! a part of the same triangle: order `n` leaves `Σ_{j>n} c_j²` and the last residual, and has the derivative `Σ_{j≤n} g_j c_j` with
//! `Rᵀ g` the basis's derivatives at the sample. Where samples are missing a window is not symmetric, and noise is amplified as near the
//! ends of a record; so each derivative takes the order with the least estimated squared bias plus variance (see `off_centre`). Errors
//! know that the order was chosen, from the shares of all orders, as those of full windows do: with that of one order alone intervals of
//! 95 % covered 67 to 90 % beside gaps of simulated records, and 72 to 93 % where all weights were 1.

use std::num::NonZeroUsize;
use std::ops::Range;

use faer::Mat;
use faer::linalg::solvers::Qr;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{self, GoOn, Piece, Watch};
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::options::{Order, PolynomialOptions};
use crate::local_polynomials::plan::LocalPolynomials;
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::record::samples::is_usable;
use crate::status::Status;

/// Windows in a piece of work.
const PIECE: usize = 64;

/// Columns whose part that is new is smaller than this, of one, are not told from those before.
const TOLD_APART: f64 = 1e-6;

/// The parts of a record between gaps that are longer than some samples, from the first sample that is there.
pub(crate) fn parts_between_gaps(
    count: usize,
    longest_gap: usize,
    is_there: impl Fn(usize) -> bool,
) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    for sample in (0..count).filter(|&sample| is_there(sample)) {
        match parts.last_mut() {
            Some(part) if sample - part.end <= longest_gap => part.end = sample + 1,
            _ => parts.push(sample..sample + 1),
        }
    }
    parts
}

/// The parts of a record that windows do not reach out of: they go across gaps of at most so many samples, at its ends too.
///
/// The parts that hold a sample are the same wherever the record is cut farther than the longest gap from it.
#[must_use]
pub fn parts_of(samples: &[f64], weights: Option<&[f64]>, longest_gap: usize) -> Vec<Range<usize>> {
    let is_there = |sample: usize| is_usable(samples[sample]) && weights.is_none_or(|weights| weights[sample] > 0.0);
    let mut parts = parts_between_gaps(samples.len(), longest_gap, is_there);
    if let Some(first) = parts.first_mut().filter(|first| first.start <= longest_gap) {
        first.start = 0;
    }
    if let Some(last) = parts.last_mut().filter(|last| samples.len() - last.end <= longest_gap) {
        last.end = samples.len();
    }
    parts
}

/// A record with missing samples.
#[derive(Debug)]
pub struct Incomplete<'a> {
    /// Samples of the record.
    pub samples: &'a [f64],
    /// Weights of the samples: one over the variances of their noise, relative to the others; 0 is a sample that is missing.
    pub weights: Option<&'a [f64]>,
    /// Parts of the record that windows do not reach out of, in order.
    pub parts: &'a [Range<usize>],
    /// Samples that a window must hold.
    pub least: usize,
}

/// What was found around one sample.
#[derive(Clone, Debug)]
pub struct IncompleteEstimate {
    /// Derivatives as the plan's options name them, and their standard errors.
    pub derivatives: Vec<(f64, f64)>,
    /// The order of the window.
    pub order: usize,
    /// Flags of [`crate::Status`].
    pub status: Status,
    /// Standard deviation of the noise of a sample of weight 1.
    pub sigma: f64,
}

impl IncompleteEstimate {
    fn invalid(derivatives: usize, status: Status) -> Self {
        let derivatives = vec![(f64::NAN, f64::NAN); derivatives];
        Self { derivatives, order: 0, status: status | Status::INVALID, sigma: f64::NAN }
    }
}

/// One window's triangle.
struct Triangle {
    factor: Mat<f64>,
    /// `Qᵀy`, as far as columns are told apart.
    projections: Vec<f64>,
    /// Residual sum of squares by order.
    residuals: Vec<f64>,
    /// Residuals are at least this.
    floor: f64,
    /// What was subtracted from all samples.
    reference: f64,
    /// Samples that are there.
    count: usize,
}

impl LocalPolynomials {
    /// Estimates at some samples of a record, each from what its window holds.
    ///
    /// # Errors
    /// If the record is shorter than the window, there is not the memory, or the watch cancels.
    pub fn run_incomplete(
        &self,
        record: &Incomplete<'_>,
        places: &[usize],
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<IncompleteEstimate>, Error> {
        self.windows(record.samples.len())?;
        let window = self.options().window_length.saturating_mul(2 * self.orders() + 4);
        memory::ask_for_numbers(window.saturating_mul(workers.get()))?;
        let mut found: Vec<Option<IncompleteEstimate>> = vec![None; places.len()];
        let pieces: Vec<_> = places
            .chunks(PIECE)
            .zip(found.chunks_mut(PIECE))
            .map(|content| Piece { size: content.0.len(), content })
            .collect();
        let work = |(places, found): (&[usize], &mut [Option<IncompleteEstimate>]), (): &mut (), go_on: &GoOn<'_>| {
            for (place, found) in places.iter().zip(found) {
                if !go_on() {
                    return;
                }
                *found = Some(self.incomplete(record, *place));
            }
        };
        pool::run_long(pieces, workers, || (), work, watch)?;
        let derivatives = self.options().derivatives.len();
        let or_nothing = |one: Option<_>| one.unwrap_or_else(|| IncompleteEstimate::invalid(derivatives, Status::GOOD));
        Ok(found.into_iter().map(or_nothing).collect())
    }

    /// The estimate at one sample.
    pub(crate) fn incomplete(&self, record: &Incomplete<'_>, place: usize) -> IncompleteEstimate {
        let (options, basis) = (self.options(), self.basis());
        let (length, wanted) = (basis.length(), options.derivatives.len());
        let next = record.parts.partition_point(|part| part.end <= place);
        let Some(part) = record.parts.get(next).filter(|part| part.contains(&place)) else {
            return IncompleteEstimate::invalid(wanted, Status::GAP);
        };
        // The window stays within its part, and the record, as it does near the ends of a record without gaps.
        let last = part.end.saturating_sub(length).max(part.start).min(record.samples.len() - length);
        let first = place.saturating_sub(self.before_centre()).clamp(part.start.min(last), last);
        let there = first.max(part.start)..(first + length).min(part.end);
        let mut flags = Status::GOOD;
        if place - first != self.before_centre() {
            flags |= Status::EDGE;
        }
        let weight = |sample: usize| {
            let weight = record.weights.map_or(1.0, |weights| weights[sample]);
            if is_usable(record.samples[sample]) { weight } else { 0.0 }
        };
        let held: Vec<(usize, f64)> =
            there.map(|sample| (sample, weight(sample))).filter(|(_, weight)| *weight > 0.0).collect();
        if held.len() < length {
            flags |= Status::GAP;
        }
        if held.len() < record.least.max(1) {
            return IncompleteEstimate::invalid(wanted, flags);
        }
        let triangle = Triangle::new(basis, options, record.samples, first, &held);
        let Some(order) = triangle.order(options) else { return IncompleteEstimate::invalid(wanted, flags) };
        let is_full = flags == Status::GOOD;
        let is_chosen = matches!(options.order, Order::Chosen { .. });
        if is_chosen && self.orders() > 1 {
            if order == 0 {
                flags |= Status::LOWEST_ORDER;
            }
            if order + 1 == self.orders() {
                flags |= Status::HIGHEST_ORDER;
            }
        }
        if triangle.residuals[order] <= triangle.floor {
            flags |= Status::EXACT;
        }
        let freedom = triangle.count - order - 1;
        let variance =
            if freedom == 0 { f64::NAN } else { triangle.residuals[order].max(triangle.floor) / freedom as f64 };
        let shares = triangle.shares(options);
        let position = basis.position(place - first);
        let one = |derivative: &usize| {
            let scale = options.delta.powi(-i32::try_from(*derivative).unwrap_or(i32::MAX));
            let functional = triangle.functional(&basis.evaluate(position, *derivative));
            // A full window around its sample has the order that fits it, as everywhere.
            let lowest = if is_chosen && !is_full { (*derivative).min(order) } else { order };
            let (value, own) = triangle.best(&functional, lowest..order, order, variance);
            let error = if shares.is_empty() { own } else { triangle.error(&functional, value, &shares) };
            let level = if *derivative == 0 { triangle.reference } else { 0.0 };
            (value * scale + level, error * scale)
        };
        let derivatives = options.derivatives.iter().map(one).collect();
        IncompleteEstimate { derivatives, order, status: flags, sigma: variance.sqrt() }
    }
}

impl Triangle {
    fn new(basis: &Basis, options: &PolynomialOptions, samples: &[f64], first: usize, held: &[(usize, f64)]) -> Self {
        let degrees = basis.degrees();
        let reference = samples[held[held.len() / 2].0];
        let rows = Mat::from_fn(held.len(), degrees + 1, |row, column| {
            let (sample, weight) = held[row];
            let value =
                if column < degrees { basis.value(column, sample - first) } else { samples[sample] - reference };
            weight.sqrt() * value
        });
        let energy = (0..held.len()).map(|row| rows[(row, degrees)].powi(2)).sum::<f64>();
        let weights = held.iter().map(|(_, weight)| weight).sum::<f64>();
        let norms: Vec<f64> = (0..degrees).map(|column| rows.col(column).norm_l2()).collect();
        let factor = Qr::new(rows.as_ref()).thin_R().to_owned();
        let is_told = |column: &usize| factor[(*column, *column)].abs() > TOLD_APART * norms[*column];
        let columns = (0..degrees.min(held.len())).take_while(is_told).count();
        let projections: Vec<f64> = (0..columns).map(|row| factor[(row, degrees)]).collect();
        let mut left = (columns..factor.nrows()).map(|row| factor[(row, degrees)].powi(2)).sum::<f64>();
        let mut residuals = vec![left; columns];
        for order in (0..columns.saturating_sub(1)).rev() {
            left += projections[order + 1].powi(2);
            residuals[order] = left;
        }
        let quantised = options.quantisation_floor() * weights / basis.length() as f64;
        let floor = quantised.max(ROUNDING * energy);
        Self { factor, projections, residuals, floor, reference, count: held.len() }
    }

    /// The order of the window; `None` if the samples of the window do not determine one.
    fn order(&self, options: &PolynomialOptions) -> Option<usize> {
        match options.order {
            Order::Fixed(order) => (order < self.projections.len()).then_some(order),
            Order::Chosen { criterion, .. } => {
                let score = |order: usize| self.residuals[order].max(self.floor) * criterion.weight(order, self.count);
                let candidates = (0..self.projections.len()).filter(|&n| criterion.penalty(n, self.count).is_some());
                candidates.reduce(|best, order| if score(order) < score(best) { order } else { best })
            }
        }
    }

    /// What each order's share in the estimate would be, by Akaike's weights; empty if the order is fixed.
    fn shares(&self, options: &PolynomialOptions) -> Vec<f64> {
        let Order::Chosen { criterion, .. } = options.order else { return Vec::new() };
        let scores = self.residuals.iter().enumerate().map(|(order, residual)| {
            residual.max(self.floor).max(f64::MIN_POSITIVE) * criterion.weight(order, self.count)
        });
        let scores: Vec<f64> = scores.collect();
        let least = scores.iter().copied().fold(f64::INFINITY, f64::min);
        let shares: Vec<f64> = scores.iter().map(|score| (least / score).powf(0.5 * self.count as f64)).collect();
        let total: f64 = shares.iter().sum();
        shares.iter().map(|share| share / total).collect()
    }

    /// The standard error of an estimate that knows that the order was chosen (Burnham and Anderson 2002), as windows without gaps have it.
    fn error(&self, functional: &[f64], estimate: f64, shares: &[f64]) -> f64 {
        let (mut value, mut gain, mut error) = (0.0, 0.0, 0.0);
        for (order, ((g, c), share)) in functional.iter().zip(&self.projections).zip(shares).enumerate() {
            (value, gain) = (value + g * c, gain + g * g);
            if *share > 0.0 {
                let variance = self.residuals[order].max(self.floor) / (self.count - order - 1) as f64;
                error += share * (variance * gain + (value - estimate).powi(2)).sqrt();
            }
        }
        error
    }

    /// What projections are multiplied by for a derivative, from that of every polynomial of the basis.
    fn functional(&self, derivatives: &[f64]) -> Vec<f64> {
        let mut found: Vec<f64> = Vec::with_capacity(self.projections.len());
        for (column, derivative) in derivatives.iter().enumerate().take(self.projections.len()) {
            let known: f64 = found.iter().enumerate().map(|(row, value)| self.factor[(row, column)] * value).sum();
            found.push((derivative - known) / self.factor[(column, column)]);
        }
        found
    }

    /// The estimate by the best order of some below `top`, or by that, and its standard error.
    fn best(&self, functional: &[f64], lower: Range<usize>, top: usize, variance: f64) -> (f64, f64) {
        let value =
            |order: usize| functional.iter().zip(&self.projections).take(order + 1).map(|(g, c)| g * c).sum::<f64>();
        let gain = |order: usize| functional.iter().take(order + 1).map(|g| g * g).sum::<f64>();
        let (top_value, top_gain) = (value(top), gain(top));
        let (mut best, mut least) = (top_value, variance * top_gain);
        for order in lower.rev().filter(|_| !variance.is_nan()) {
            let (lower_value, lower_gain) = (value(order), gain(order));
            let chance = variance * (top_gain - lower_gain);
            let error = ((lower_value - top_value).powi(2) - chance).max(0.0) + variance * lower_gain;
            if error <= least {
                (best, least) = (lower_value, error);
            }
        }
        (best, least.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of which some are missing.
    fn record() -> (Vec<f64>, Vec<f64>) {
        let is_lost = |sample: usize| sample < 3 || (40..44).contains(&sample) || (60..80).contains(&sample);
        let samples = (0..120).map(|sample| if is_lost(sample) { f64::NAN } else { 1.0 }).collect();
        let weights =
            (0..120).map(|sample| if (100..105).contains(&sample) || sample > 114 { 0.0 } else { 2.0 }).collect();
        (samples, weights)
    }

    #[test]
    fn parts_lie_between_gaps_that_are_longer() {
        let (samples, weights) = record();
        assert_eq!(parts_of(&samples, None, 4), [0..60, 80..120]);
        assert_eq!(parts_of(&samples, None, 2), [3..40, 44..60, 80..120]);
        assert_eq!(parts_of(&samples, Some(&weights), 4), [0..60, 80..100, 105..115]);
        assert_eq!(parts_of(&samples, Some(&weights), 5), [0..60, 80..120]);
        assert!(parts_of(&[f64::NAN; 9], None, 4).is_empty());
    }

    #[test]
    fn the_part_around_a_sample_does_not_change_where_a_record_is_cut_farther_than_the_gap() {
        let (samples, weights) = record();
        for longest in [2, 4, 7] {
            for sample in 0..120 {
                let of = |first: usize, end: usize| {
                    let parts = parts_of(&samples[first..end], Some(&weights[first..end]), longest);
                    parts.into_iter().find(|part| part.contains(&(sample - first)))
                };
                let reach = longest + 5;
                let (first, end) = (sample.saturating_sub(reach), (sample + reach + 1).min(120));
                let near = |part: Option<Range<usize>>, by: usize| {
                    part.map(|part| ((part.start + by).max(sample.saturating_sub(5)), (part.end + by).min(sample + 6)))
                };
                assert_eq!(near(of(0, 120), 0), near(of(first, end), first), "{longest} {sample}");
            }
        }
    }
}
