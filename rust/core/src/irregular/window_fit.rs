//! Local polynomials where samples have times of their own: every window has a design of its own.
//!
//! The choice of the order, the derivatives near the ends and the standard errors are those of windows on a uniform grid
//! ([`crate::local_polynomials`]); a window holds so many samples, or those of so many seconds.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{Piece, Watch, map};
use crate::irregular::own_basis::{OwnBasis, dot};
use crate::local_polynomials::options::Order;
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::record::samples::is_usable;
use crate::status::Status;

/// Windows of a piece of work.
const WINDOWS: usize = 256;

/// The fewest samples of a window.
pub const FEWEST: usize = 5;

/// An order whose criterion is so much above the best has no weight.
const NEGLIGIBLE: f64 = 80.0;

/// How long windows are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowSpan {
    /// So many samples, an odd number.
    Samples(usize),
    /// The samples of so many seconds.
    Seconds(f64),
}

/// Local polynomials at given times.
#[derive(Clone, Debug)]
pub struct WindowFit {
    /// Time of every sample in seconds, increasing.
    pub times: Vec<f64>,
    /// How long windows are.
    pub span: WindowSpan,
    /// How the order is determined.
    pub order: Order,
    /// The highest derivative that is wanted.
    pub derivatives: usize,
    /// Step of the samples' quantisation, or zero.
    pub quantisation: f64,
}

/// What was found in some windows, one after the other.
#[derive(Clone, Debug, Default)]
pub struct WindowFits {
    /// Derivatives from 0 on, and their standard errors.
    pub derivatives: Vec<Vec<f64>>,
    /// Standard errors of the derivatives.
    pub errors: Vec<Vec<f64>>,
    /// Order of the window.
    pub order: Vec<u8>,
    /// Bits of [`Status`].
    pub status: Vec<u16>,
    /// Standard deviation of the noise.
    pub sigma: Vec<f64>,
}

/// Where a window lies.
struct PlacedWindow {
    samples: Range<usize>,
    /// Its middle and its half length in seconds.
    middle: f64,
    half: f64,
    edge: bool,
}

/// One window's polynomials.
struct FittedWindow {
    coefficients: Vec<f64>,
    /// Residual sum of squares of every order, and what rounding or quantisation leaves of it at least.
    residuals: Vec<f64>,
    floor: f64,
    reference: f64,
}

impl WindowFit {
    /// Fits the window around every `step`-th sample.
    ///
    /// # Errors
    /// If the watch cancels.
    pub fn fit(
        &self,
        record: &[f64],
        step: usize,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<WindowFits, Error> {
        let count = record.len().div_ceil(step);
        let pieces = (0..count).step_by(WINDOWS).map(|first| first..count.min(first + WINDOWS));
        let pieces = pieces.map(|content| Piece { size: content.len(), content }).collect();
        let work = |windows: Range<usize>, basis: &mut OwnBasis| {
            let mut fits = WindowFits::new(self.derivatives);
            windows.for_each(|window| self.one(record, window * step, basis, &mut fits));
            fits
        };
        let parts = map(pieces, workers, OwnBasis::default, work, watch)?;
        let mut all = WindowFits::new(self.derivatives);
        for part in parts {
            all.append(part);
        }
        Ok(all)
    }

    /// The criterion of every candidate order in the window around a sample; NaN where it cannot be fitted.
    #[must_use]
    pub fn scores(&self, record: &[f64], sample: usize) -> Vec<f64> {
        let mut basis = OwnBasis::default();
        let window = self.window(sample);
        let Order::Chosen { criterion, highest } = self.order else { return vec![f64::NAN] };
        let score = |fitted: FittedWindow| {
            let length = window.samples.len();
            let of = |(order, residual): (usize, &f64)| criterion.score(residual.max(fitted.floor), order, length);
            fitted.residuals.iter().enumerate().map(of).collect()
        };
        self.fitted(record, &window, &mut basis).map_or_else(|| vec![f64::NAN; highest + 1], score)
    }

    /// The window around a sample, within the record.
    fn window(&self, sample: usize) -> PlacedWindow {
        let (times, count) = (&self.times, self.times.len());
        let (first, last) = (times[0], times[count - 1]);
        match self.span {
            WindowSpan::Samples(length) => {
                let half = length / 2;
                let begin = sample.saturating_sub(half).min(count - length.min(count));
                let samples = begin..count.min(begin + length);
                let (from, to) = (times[samples.start], times[samples.end - 1]);
                let edge = sample < half || sample + half >= count;
                PlacedWindow { samples, middle: f64::midpoint(from, to), half: (to - from) / 2.0, edge }
            }
            WindowSpan::Seconds(length) => {
                let half = length / 2.0;
                let middle = times[sample].min(last - half).max(first + half);
                let begin = times.partition_point(|&time| time < middle - half);
                let end = times.partition_point(|&time| time <= middle + half);
                let edge = (middle - times[sample]).abs() > 0.0;
                PlacedWindow { samples: begin..end, middle, half, edge }
            }
        }
    }

    /// Candidates in a window of so many samples: how many orders from 0 on.
    fn candidates(&self, length: usize) -> usize {
        match self.order {
            Order::Fixed(order) => {
                if length > order {
                    order + 1
                } else {
                    0
                }
            }
            Order::Chosen { criterion, highest } => {
                (0..=highest).take_while(|&order| criterion.penalty(order, length).is_some()).count()
            }
        }
    }

    /// Fits all candidates to a window, or `None` where it holds an unusable sample or too few.
    fn fitted(&self, record: &[f64], window: &PlacedWindow, basis: &mut OwnBasis) -> Option<FittedWindow> {
        let (samples, length) = (&record[window.samples.clone()], window.samples.len());
        let candidates = self.candidates(length);
        if length < FEWEST || candidates == 0 || !samples.iter().all(|&value| is_usable(value)) {
            return None;
        }
        let times: Vec<f64> =
            self.times[window.samples.clone()].iter().map(|time| (time - window.middle) / window.half).collect();
        basis.make(&times, candidates);
        let reference = samples[length / 2];
        let mut left: Vec<f64> = samples.iter().map(|value| value - reference).collect();
        let energy = dot(&left, &left);
        let coefficients = basis.project(&mut left);
        let mut residuals = vec![dot(&left, &left); coefficients.len()];
        for order in (0..coefficients.len() - 1).rev() {
            residuals[order] = residuals[order + 1] + coefficients[order + 1].powi(2);
        }
        let quantised = length as f64 * self.quantisation * self.quantisation / 12.0;
        Some(FittedWindow { coefficients, residuals, floor: quantised.max(ROUNDING * energy), reference })
    }

    /// Fits the window around one sample.
    fn one(&self, record: &[f64], sample: usize, basis: &mut OwnBasis, fits: &mut WindowFits) {
        let window = self.window(sample);
        let Some(fitted) = self.fitted(record, &window, basis) else {
            fits.invalidate();
            return;
        };
        let (length, degrees) = (window.samples.len(), fitted.coefficients.len());
        let variance = |order: usize| {
            let free = length - order - 1;
            if free == 0 { f64::NAN } else { fitted.residuals[order].max(fitted.floor) / free as f64 }
        };
        let (order, shares) = match self.order {
            Order::Fixed(order) => (order.min(degrees - 1), None),
            Order::Chosen { criterion, .. } => {
                let weight = |order: usize| fitted.residuals[order].max(fitted.floor) * criterion.weight(order, length);
                let best = (0..degrees).fold(0, |best, one| if weight(one) < weight(best) { one } else { best });
                let least = weight(best).max(f64::MIN_POSITIVE);
                let share = |order: usize| {
                    let above = length as f64 * (weight(order).max(f64::MIN_POSITIVE) / least).ln();
                    if above < NEGLIGIBLE { (-above / 2.0).exp() } else { 0.0 }
                };
                (best, Some((0..degrees).map(share).collect::<Vec<f64>>()))
            }
        };
        let polynomials = basis.at((self.times[sample] - window.middle) / window.half, self.derivatives);
        for (derivative, polynomials) in polynomials.iter().enumerate() {
            let scale = window.half.powi(-i32::try_from(derivative).unwrap_or(i32::MAX));
            let level = if derivative == 0 { fitted.reference } else { 0.0 };
            let sums = OrderSums::new(polynomials, &fitted.coefficients);
            let taken = match shares {
                Some(_) if window.edge => sums.best(order, derivative, variance(order)),
                _ => order,
            };
            let error = match &shares {
                Some(shares) if !window.edge => sums.error(taken, shares, variance),
                _ => (variance(order) * sums.gains[taken]).sqrt(),
            };
            fits.derivatives[derivative].push(level + sums.values[taken] * scale);
            fits.errors[derivative].push(error * scale);
        }
        let mut status = if window.edge { Status::EDGE } else { Status::GOOD };
        if shares.is_some() && degrees > 1 {
            if order == 0 {
                status |= Status::LOWEST_ORDER;
            }
            if order + 1 == degrees {
                status |= Status::HIGHEST_ORDER;
            }
        }
        if fitted.residuals[order] <= fitted.floor {
            status |= Status::EXACT;
        }
        fits.order.push(u8::try_from(order).unwrap_or(u8::MAX));
        fits.status.push(status.bits());
        fits.sigma.push(variance(order).sqrt());
    }
}

/// A derivative by every order, and its variance over that of the noise.
struct OrderSums {
    values: Vec<f64>,
    gains: Vec<f64>,
}

impl OrderSums {
    fn new(polynomials: &[f64], coefficients: &[f64]) -> Self {
        let (mut value, mut gain) = (0.0, 0.0);
        let mut sums = Self { values: Vec::new(), gains: Vec::new() };
        for (polynomial, coefficient) in polynomials.iter().zip(coefficients) {
            value += polynomial * coefficient;
            gain += polynomial * polynomial;
            sums.values.push(value);
            sums.gains.push(gain);
        }
        sums
    }

    /// The order with the least estimated squared bias plus variance off the centre (see [`crate::local_polynomials`]).
    fn best(&self, top: usize, lowest: usize, variance: f64) -> usize {
        if variance.is_nan() {
            return top;
        }
        let (mut best, mut least) = (top, variance * self.gains[top]);
        for order in (lowest..top).rev() {
            let chance = variance * (self.gains[top] - self.gains[order]);
            let bias = ((self.values[order] - self.values[top]).powi(2) - chance).max(0.0);
            let error = bias + variance * self.gains[order];
            if error <= least {
                (best, least) = (order, error);
            }
        }
        best
    }

    /// The standard error of an order's estimate that knows of the choice (Burnham and Anderson 2002).
    fn error(&self, taken: usize, shares: &[f64], variance: impl Fn(usize) -> f64) -> f64 {
        let total: f64 = shares.iter().sum();
        let of = |(order, share): (usize, &f64)| {
            let off = self.values[order] - self.values[taken];
            if *share > 0.0 { share / total * (variance(order) * self.gains[order] + off * off).sqrt() } else { 0.0 }
        };
        shares.iter().enumerate().map(of).sum()
    }
}

impl WindowFits {
    fn new(derivatives: usize) -> Self {
        let columns = vec![Vec::new(); derivatives + 1];
        Self { derivatives: columns.clone(), errors: columns, ..Self::default() }
    }

    fn append(&mut self, mut other: Self) {
        let pairs = self.derivatives.iter_mut().zip(&mut other.derivatives);
        pairs.chain(self.errors.iter_mut().zip(&mut other.errors)).for_each(|(one, other)| one.append(other));
        self.order.append(&mut other.order);
        self.status.append(&mut other.status);
        self.sigma.append(&mut other.sigma);
    }

    fn invalidate(&mut self) {
        self.derivatives.iter_mut().chain(&mut self.errors).for_each(|column| column.push(f64::NAN));
        self.order.push(0);
        self.status.push(Status::INVALID.bits());
        self.sigma.push(f64::NAN);
    }
}
