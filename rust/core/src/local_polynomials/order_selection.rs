//! Selection of orders beyond a window's own criterion: pooled over neighbours, or averaged over orders.
//!
//! The best order of one window follows the noise in that window: on the simulated rig at 20 dB the second derivative of the best order
//! in every window is 3.2 times as wrong as that of the order that is best for all of them. Two remedies:
//!
//! * *pooled*: the criterion (8) is summed over all windows that share a sample with a window, and the order chosen by the sum: 1.12
//!   times as wrong. (Half as many neighbours leave 1.5; twice as many gain no more than a tenth, and know less of where they are.)
//! * *average*: no order is chosen. With `Δ_n` the criterion of order `n` less the smallest, the estimate is the average of the
//!   estimates `d_n` with Akaike's weights `w_n ∝ exp(-Δ_n/2)`, and its standard error `Σ w_n √(σ_n² g_n² + (d_n - d)²)`, `g_n` the gain
//!   of noise (Burnham and Anderson 2002, sections 2.9 and 4.3.2).
//!
//! Where one order is chosen, its own noise is not all of its error: another recording would have chosen another. On the same
//! rig the error of θ̈ is 1.4 to 2.2 times `σ_n g_n` where every window chooses, 1.1 to 1.5 times where neighbours are pooled.
//! The standard error is that of the average, but around the estimate `d` of the order chosen:
//! `Σ w_n √(σ_n² g_n² + (d_n - d)²)`, the weights from what chose it. A sum over `C` windows of `M` samples counts most samples
//! many times. With `v` how often a sample is in it, it holds what `(Σv)²/(M Σv²) = s l²/(M (s l - (s² - 1)/3))` windows that
//! share no sample do, `s` and `l` the smaller and the larger of `C` and `M`: 1 for one window and 2.4 for all that share a
//! sample with a window. The weights are `exp(-Δ_n/2)` of that many times the mean criterion.

use std::ops::Range;

use crate::local_polynomials::estimates::Estimates;
use crate::local_polynomials::options::Selection;
use crate::local_polynomials::order_shares::{Derivative, SelectionScratch, Selector, Wanted, choose};
use crate::record::samples::Samples;
use crate::status::Status;

/// Windows worked on at a time, at least.
const BATCH: usize = 1 << 11;

impl Selector {
    /// Estimates of some windows of a record.
    pub(crate) fn estimate(
        &self,
        record: &dyn Samples,
        windows: Range<usize>,
        wanted: Wanted,
        estimates: &mut Estimates<'_>,
        scratch: &mut SelectionScratch,
    ) {
        let (batch, before) = (BATCH.max(self.least_piece()), (self.length - 1) / 2);
        for first in windows.clone().step_by(batch) {
            let end = windows.end.min(first + batch);
            let elements = estimates.elements.of(first + before..end + before);
            if !elements.is_empty() {
                let first = estimates.elements.sample(elements.start) - before;
                let (place, step) = self.share(record, first..end, estimates.elements.step, wanted, scratch);
                self.put(elements, place, step, wanted, estimates, scratch);
            }
        }
    }

    /// The orders that stand for one window, each with its share.
    pub(crate) fn orders(
        &self,
        record: &dyn Samples,
        window: usize,
        scratch: &mut SelectionScratch,
    ) -> Vec<(usize, f64)> {
        let (place, _) = self.share(record, window..window + 1, 1, Wanted::Derivatives, scratch);
        let shares = scratch.shares.iter().map(|row| row[place]).enumerate();
        shares.filter(|(_, share)| *share > 0.0).collect()
    }

    /// Writes the estimates of windows at every `step`-th place.
    fn put(
        &self,
        elements: Range<usize>,
        place: usize,
        step: usize,
        wanted: Wanted,
        estimates: &mut Estimates<'_>,
        scratch: &mut SelectionScratch,
    ) {
        if wanted == Wanted::Errors {
            choose(scratch);
        }
        for (derivative, values) in self.derivatives.iter().zip(&mut estimates.derivatives) {
            self.average(derivative, wanted, scratch);
            let found = if wanted == Wanted::Errors { &scratch.error } else { &scratch.mean };
            for (value, found) in values[elements.clone()].iter_mut().zip(found[place..].iter().step_by(step)) {
                *value = *found;
            }
        }
        for (place, element) in (place..).step_by(step).zip(elements) {
            if scratch.projected.level[place].is_nan() {
                estimates.invalidate(element);
            } else {
                self.diagnose(place, element, estimates, scratch);
            }
        }
    }

    /// The average over orders of a derivative, and its error where it is wanted, at all places.
    fn average(&self, derivative: &Derivative, wanted: Wanted, scratch: &mut SelectionScratch) {
        let SelectionScratch { projected, residuals, shares, chosen, row: value, mean, error, .. } = scratch;
        let start = |row: &mut Vec<f64>| {
            row.clear();
            row.extend(projected.level.iter().map(|level| derivative.constant * level));
        };
        // A coefficient has the share of all orders that reach it: summed from the highest down.
        start(mean);
        value.clear();
        value.resize(mean.len(), 0.0);
        for ((shares, row), weight) in shares.iter().zip(&projected.coefficients).zip(&derivative.weights).rev() {
            for (((mean, reach), share), c) in mean.iter_mut().zip(&mut *value).zip(shares).zip(row) {
                *reach += share;
                *mean += *reach * weight * c;
            }
        }
        if wanted == Wanted::Derivatives {
            return;
        }
        if self.selection != Selection::Average {
            // The estimate is that of the order chosen.
            start(value);
            for (order, (row, weight)) in projected.coefficients.iter().zip(&derivative.weights).enumerate() {
                for (((value, mean), c), chosen) in value.iter_mut().zip(&mut *mean).zip(row).zip(&*chosen) {
                    *value += weight * c;
                    if order == *chosen {
                        *mean = *value;
                    }
                }
            }
        }
        start(value);
        error.clear();
        error.resize(mean.len(), 0.0);
        let mut gain = 0.0;
        for (order, (row, weight)) in projected.coefficients.iter().zip(&derivative.weights).enumerate() {
            gain += weight * weight;
            let variance = gain / (self.length - order - 1) as f64;
            for place in 0..mean.len() {
                value[place] += weight * row[place];
                let share = shares[order][place];
                error[place] +=
                    share * (variance * residuals[order][place] + (value[place] - mean[place]).powi(2)).sqrt();
            }
        }
    }

    /// Writes order, flags and noise of one window.
    fn diagnose(&self, place: usize, element: usize, estimates: &mut Estimates<'_>, scratch: &SelectionScratch) {
        let (mut order, mut largest, mut variance) = (0, 0.0, 0.0);
        for (candidate, (shares, residuals)) in scratch.shares.iter().zip(&scratch.residuals).enumerate() {
            let share = shares[place];
            variance += share * residuals[place] / (self.length - candidate - 1) as f64;
            if share > largest {
                (order, largest) = (candidate, share);
            }
        }
        let mut status = Status::GOOD;
        if self.weights.len() > 1 {
            if order == 0 {
                status |= Status::LOWEST_ORDER;
            }
            if order + 1 == self.weights.len() {
                status |= Status::HIGHEST_ORDER;
            }
        }
        if scratch.residuals[order][place] <= scratch.floor[place] {
            status |= Status::EXACT;
        }
        estimates.diagnose(element, order, status, variance.sqrt());
    }
}
