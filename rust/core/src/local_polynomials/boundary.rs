//! The ends of a record: the first and the last full window evaluated off their centres.
//!
//! The gain of noise towards a window's end is steep: that of the second derivative grows 15 fold for order 5 and 49 fold for order 9.
//! The order that fits the window best need not be the best to evaluate there. So each derivative takes, at each position, the order
//! `n` with the least estimated squared bias plus variance. With `d_n` its estimate by order `n`, and `top` the window's order,
//!
//! ```text
//! bias_n² = max(0, (d_n - d_top)² - var(d_n - d_top)),   var(d_n - d_top) = σ² Σ_{n<j≤top} q_j^(d)(x)²,   var(d_n) = σ² Σ_{j≤n} q_j^(d)(x)².
//! ```
//!
//! Orders below the derivative's are left out where the window's own order is not one of them: zero with an error of zero is no estimate.
//!
//! Where several orders share in a window (see [`crate::local_polynomials::order_selection`]), each of them is `top` in
//! its turn, and what comes of it is averaged.

use std::ops::Range;

use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::{Order, PolynomialOptions};
use crate::local_polynomials::order_shares::Wanted;
use crate::local_polynomials::single_window::Window;
use crate::record::samples::Samples;
use crate::status::Status;

/// One end of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The samples before the centre of the first full window.
    First,
    /// The samples after the centre of the last full window.
    Last,
}

/// Plan of the ends.
#[derive(Debug)]
pub(crate) struct Ends {
    order: Order,
    derivatives: Vec<usize>,
    delta: f64,
    /// Residuals are at least this.
    floor: f64,
}

/// A derivative at one position and its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

impl Ends {
    pub(crate) fn new(options: &PolynomialOptions) -> Self {
        let (order, floor) = (options.order, options.quantisation_floor());
        Self { order, derivatives: options.derivatives.clone(), delta: options.delta, floor }
    }

    /// Writes what is wanted of the given samples, all of them at one end of the record. `orders` are those that share in the window
    /// there and their shares, where it does not choose for itself.
    #[allow(clippy::too_many_arguments, reason = "which samples of which record, and where they go")]
    pub(crate) fn estimate(
        &self,
        basis: &Basis,
        record: &dyn Samples,
        end: End,
        orders: Option<Vec<(usize, f64)>>,
        samples: Range<usize>,
        wanted: Wanted,
        estimates: &mut Estimates<'_>,
    ) {
        let (first, fit) = self.fit(basis, record, end, orders);
        for element in estimates.elements.of(samples) {
            let sample = estimates.elements.sample(element);
            if let Some(fit) = &fit {
                self.evaluate(basis, fit, sample - first, |slot, estimate| {
                    estimates.derivatives[slot][element] = match wanted {
                        Wanted::Derivatives => estimate.value,
                        Wanted::Errors => estimate.error,
                    };
                });
                estimates.diagnose(element, fit.order, Status::EDGE | fit.status, fit.sigma);
            } else {
                estimates.invalidate(element);
                estimates.diagnose(element, 0, Status::EDGE | Status::INVALID, f64::NAN);
            }
        }
    }

    /// The window at an end and its first sample.
    fn fit(
        &self,
        basis: &Basis,
        record: &dyn Samples,
        end: End,
        orders: Option<Vec<(usize, f64)>>,
    ) -> (usize, Option<BoundaryFit>) {
        let length = basis.length();
        let first = match end {
            End::First => 0,
            End::Last => record.len() - length,
        };
        let mut samples = vec![0.0; length];
        record.read(first, &mut samples);
        let window = Window::project(basis, &samples, self.floor);
        (first, window.map(|window| BoundaryFit::new(window, self.order, orders, length)))
    }

    /// Gives every derivative at sample `place` of the window to `give`, with its place among those asked for.
    fn evaluate(&self, basis: &Basis, fit: &BoundaryFit, place: usize, mut give: impl FnMut(usize, Estimate)) {
        let degrees = basis.degrees();
        let highest = self.derivatives.iter().max().copied().unwrap_or(0);
        let mut polynomials = [0.0; MOST_DEGREES];
        for (degree, value) in polynomials[..degrees].iter_mut().enumerate() {
            *value = basis.value(degree, place);
        }
        let mut scale = 1.0;
        for derivative in 0..=highest {
            if derivative > 0 {
                scale /= self.delta;
                basis.differentiate(place, derivative, &mut polynomials);
            }
            let mut wanted =
                self.derivatives.iter().enumerate().filter(|(_, wanted)| **wanted == derivative).peekable();
            if wanted.peek().is_some() {
                let Estimate { value, error } = fit.best(&polynomials, derivative);
                let level = if derivative == 0 { fit.window.reference } else { 0.0 };
                wanted
                    .for_each(|(slot, _)| give(slot, Estimate { value: value * scale + level, error: error * scale }));
            }
        }
    }
}

/// A window at an end, its order and noise.
struct BoundaryFit {
    window: Window,
    /// The orders that share in the window, their shares and noise.
    tops: Vec<Top>,
    order: usize,
    sigma: f64,
    status: Status,
    chosen: bool,
}

/// An order that the window is fitted with.
struct Top {
    order: usize,
    share: f64,
    variance: f64,
}

impl BoundaryFit {
    fn new(window: Window, order: Order, shares: Option<Vec<(usize, f64)>>, length: usize) -> Self {
        let chosen = matches!(order, Order::Chosen { .. });
        let shares = shares.unwrap_or_else(|| vec![(window.order(order, length), 1.0)]);
        let variance = |order: usize| {
            let freedom = length - order - 1;
            if freedom == 0 { f64::NAN } else { window.residuals[order].max(window.floor) / freedom as f64 }
        };
        let tops: Vec<Top> =
            shares.into_iter().map(|(order, share)| Top { order, share, variance: variance(order) }).collect();
        let largest = tops.iter().reduce(|best, top| if top.share > best.share { top } else { best });
        let order = largest.map_or(0, |top| top.order);
        let mut status = Status::GOOD;
        if chosen && window.residuals.len() > 1 {
            if order == 0 {
                status |= Status::LOWEST_ORDER;
            }
            if order + 1 == window.residuals.len() {
                status |= Status::HIGHEST_ORDER;
            }
        }
        if window.residuals[order] <= window.floor {
            status |= Status::EXACT;
        }
        let sigma = tops.iter().map(|top| top.share * top.variance).sum::<f64>().sqrt();
        Self { window, tops, order, sigma, status, chosen }
    }

    /// The sum `Σ c_j q_j` up to the best order for it, with its standard error. Orders below `lowest` are not looked at.
    fn best(&self, polynomials: &[f64; MOST_DEGREES], lowest: usize) -> Estimate {
        // Value and gain of every order.
        let mut sums = [(0.0, 0.0); MOST_DEGREES];
        let (mut value, mut gain) = (0.0, 0.0);
        for ((sum, c), q) in sums.iter_mut().zip(&self.window.coefficients).zip(polynomials) {
            value += c * q;
            gain += q * q;
            *sum = (value, gain);
        }
        if let [top] = self.tops.as_slice() {
            return self.best_below(top, &sums, lowest);
        }
        let estimates: Vec<Estimate> = self.tops.iter().map(|top| self.best_below(top, &sums, lowest)).collect();
        let shared = |number: &dyn Fn(&Estimate) -> f64| -> f64 {
            self.tops.iter().zip(&estimates).map(|(top, estimate)| top.share * number(estimate)).sum()
        };
        let value = shared(&|estimate| estimate.value);
        Estimate { value, error: shared(&|estimate| estimate.error.hypot(estimate.value - value)) }
    }

    /// The best of the orders up to one that fits the window.
    fn best_below(&self, top: &Top, sums: &[(f64, f64); MOST_DEGREES], lowest: usize) -> Estimate {
        let (order, variance) = (top.order, top.variance);
        let (top_value, top_gain) = sums[order];
        if !self.chosen || variance.is_nan() {
            return Estimate { value: top_value, error: (variance * top_gain).sqrt() };
        }
        let mut best = (variance * top_gain, order);
        for (order, &(value, gain)) in sums[..order].iter().enumerate().skip(lowest).rev() {
            let bias = ((value - top_value).powi(2) - variance * (top_gain - gain)).max(0.0);
            let error = bias + variance * gain;
            if error <= best.0 {
                best = (error, order);
            }
        }
        let (value, gain) = sums[best.1];
        Estimate { value, error: (variance * gain).sqrt() }
    }
}
