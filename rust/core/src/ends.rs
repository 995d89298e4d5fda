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

use std::ops::Range;

use crate::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::{Estimates, Options, Order};
use crate::samples::Samples;
use crate::status::Status;
use crate::window::Window;

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
}

/// A derivative at one position and its standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

impl Ends {
    pub(crate) fn new(options: &Options) -> Self {
        Self { order: options.order, derivatives: options.derivatives.clone(), delta: options.delta }
    }

    /// Writes the estimates of the given samples, all of them at one end of the record.
    pub(crate) fn estimate(
        &self,
        basis: &Basis,
        record: &dyn Samples,
        end: End,
        samples: Range<usize>,
        estimates: &mut Estimates<'_>,
    ) {
        let (first, fit) = self.fit(basis, record, end);
        for element in estimates.elements.of(samples) {
            let sample = estimates.elements.sample(element);
            let mut status = Status::EDGE;
            if let Some(fit) = &fit {
                self.evaluate(basis, fit, sample - first, |slot, estimate| {
                    estimates.derivatives[slot][element] = estimate.value;
                });
                status |= fit.status;
            } else {
                estimates.derivatives.iter_mut().for_each(|derivative| derivative[element] = f64::NAN);
                status |= Status::INVALID;
            }
            let (order, sigma) = fit.as_ref().map_or((0, f64::NAN), |fit| (fit.order, fit.sigma));
            put(estimates.order, element, u8::try_from(order).unwrap_or(u8::MAX));
            put(estimates.sigma, element, sigma);
            put(estimates.status, element, status.bits());
        }
    }

    /// Standard errors at an end: one row a derivative, in the order of the samples.
    pub(crate) fn errors(&self, basis: &Basis, record: &dyn Samples, end: End) -> Vec<Vec<f64>> {
        let (_, fit) = self.fit(basis, record, end);
        let length = basis.length();
        let places = match end {
            End::First => 0..length / 2,
            End::Last => length - length / 2..length,
        };
        let mut errors = vec![vec![f64::NAN; places.len()]; self.derivatives.len()];
        if let Some(fit) = fit {
            for (column, place) in places.enumerate() {
                self.evaluate(basis, &fit, place, |slot, estimate| errors[slot][column] = estimate.error);
            }
        }
        errors
    }

    /// The window at an end and its first sample.
    fn fit(&self, basis: &Basis, record: &dyn Samples, end: End) -> (usize, Option<Fit>) {
        let length = basis.length();
        let first = match end {
            End::First => 0,
            End::Last => record.len() - length,
        };
        let mut samples = vec![0.0; length];
        record.read(first, &mut samples);
        (first, Window::project(basis, &samples).map(|window| Fit::new(window, self.order, length)))
    }

    /// Gives every derivative at sample `place` of the window to `give`, with its place among those asked for.
    fn evaluate(&self, basis: &Basis, fit: &Fit, place: usize, mut give: impl FnMut(usize, Estimate)) {
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
struct Fit {
    window: Window,
    order: usize,
    sigma: f64,
    status: Status,
    chosen: bool,
}

impl Fit {
    fn new(window: Window, order: Order, length: usize) -> Self {
        let chosen = matches!(order, Order::Chosen { .. });
        let order = window.order(order, length);
        let residual = window.residuals[order];
        let freedom = length - order - 1;
        let sigma = if freedom == 0 { f64::NAN } else { (residual.max(window.floor) / freedom as f64).sqrt() };
        let mut status = Status::GOOD;
        if chosen && window.residuals.len() > 1 {
            if order == 0 {
                status |= Status::LOWEST_ORDER;
            }
            if order + 1 == window.residuals.len() {
                status |= Status::HIGHEST_ORDER;
            }
        }
        if residual <= window.floor {
            status |= Status::EXACT;
        }
        Self { window, order, sigma, status, chosen }
    }

    /// The sum `Σ c_j q_j` up to the best order for it, with its standard error. Orders below `lowest` are not looked at.
    fn best(&self, polynomials: &[f64; MOST_DEGREES], lowest: usize) -> Estimate {
        // Value and gain of every order.
        let mut sums = [(0.0, 0.0); MOST_DEGREES];
        let (mut value, mut gain) = (0.0, 0.0);
        for ((sum, c), q) in sums[..=self.order].iter_mut().zip(&self.window.coefficients).zip(polynomials) {
            value += c * q;
            gain += q * q;
            *sum = (value, gain);
        }
        let (top_value, top_gain) = (value, gain);
        let top = Estimate { value: top_value, error: self.sigma * top_gain.sqrt() };
        let variance = self.sigma * self.sigma;
        if !self.chosen || variance.is_nan() {
            return top;
        }
        let mut best = (variance * top_gain, self.order);
        for (order, &(value, gain)) in sums[..self.order].iter().enumerate().skip(lowest).rev() {
            let bias = ((value - top_value).powi(2) - variance * (top_gain - gain)).max(0.0);
            let error = bias + variance * gain;
            if error <= best.0 {
                best = (error, order);
            }
        }
        let (value, gain) = sums[best.1];
        Estimate { value, error: self.sigma * gain.sqrt() }
    }
}

fn put<T>(values: &mut [T], element: usize, value: T) {
    if let Some(place) = values.get_mut(element) {
        *place = value;
    }
}
