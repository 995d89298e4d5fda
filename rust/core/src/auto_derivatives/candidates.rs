//! The candidates of windows of one length for a derivative: one estimate per order, all from the same coefficients.
//!
//! At a window's centre the `d`-th derivative is the same for orders `d + 2i` and `d + 2i + 1`, so the candidates are
//! `d, d + 2, …`, and each of them has one more coefficient than the one before:
//!
//! ```text
//! d_i = Σ_{l≤i} w_l c_{d+2l},   w_l = q_{d+2l}^(d)(0) / Δ^d,   variance σ² g_i,   g_i = Σ_{l≤i} w_l².
//! ```

use std::ops::Range;
use std::sync::Arc;

use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};
use crate::local_polynomials::tables::{TablesWanted, WindowTables, tables};
use crate::noise::correlated::CorrelatedNoise;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;

/// The derivative to be estimated, and its orders.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target<'a> {
    pub(crate) derivative: usize,
    /// The highest order, which is the only one where it is fixed.
    pub(crate) highest: usize,
    pub(crate) fixed: bool,
    /// Half-width of the shortest window.
    pub(crate) shortest: usize,
    pub(crate) delta: f64,
    pub(crate) noise: &'a CorrelatedNoise,
    pub(crate) instructions: Instructions,
}

impl Target<'_> {
    /// `1/Δ^d`.
    pub(crate) fn scale(&self) -> f64 {
        self.delta.powi(i32::try_from(self.derivative).unwrap_or(i32::MAX)).recip()
    }

    /// The highest order in a window: at least two degrees of freedom remain.
    pub(crate) fn highest(&self, half: usize) -> usize {
        self.highest.min(2 * half - 2)
    }

    /// The candidates in a window, lowest first.
    pub(crate) fn orders(&self, half: usize) -> Vec<usize> {
        let all: Vec<usize> = (self.derivative..=self.highest(half)).step_by(2).collect();
        if !self.fixed {
            return all;
        }
        let one = all.last().filter(|_| self.highest(half) == self.highest);
        one.into_iter().copied().collect()
    }
}

/// The candidates of windows of `2 half + 1` samples.
#[derive(Debug)]
pub(crate) struct Bank {
    pub(crate) half: usize,
    /// By candidate: order, variance over that of the noise, and weight of a sample in the value at its own place.
    pub(crate) orders: Vec<usize>,
    pub(crate) gains: Vec<f64>,
    pub(crate) leverages: Vec<f64>,
    tables: Arc<WindowTables>,
    /// `w_l`, and how many coefficients the first candidate has.
    weights: Vec<f64>,
    first: usize,
    derivative: usize,
    /// What a constant signal of one gives.
    constant: f64,
}

impl Bank {
    /// Prepares the tables, or returns `None` if windows of this length have no candidate.
    pub(crate) fn new(half: usize, target: &Target<'_>) -> Option<Self> {
        let orders = target.orders(half);
        let (derivative, highest) = (target.derivative, *orders.last()?);
        // One basis serves all derivatives.
        let (all, instructions) = (target.highest(half), target.instructions);
        let wanted = TablesWanted { half, highest: all, first: derivative, step: 2, instructions };
        let tables = tables(wanted);
        let basis = &tables.basis;
        let degrees: Vec<usize> = (derivative..=highest).step_by(2).collect();
        let first = degrees.len() - orders.len();
        let (at_centre, scale) = (basis.evaluate(0.0, derivative), target.scale());
        let weights: Vec<f64> = degrees.iter().map(|&degree| at_centre[degree] * scale).collect();
        let gains: Vec<f64> = running_sums(weights.iter().map(|weight| weight * weight)).skip(first).collect();
        let values = basis.evaluate(0.0, 0);
        let leverages: Vec<f64> = running_sums(values.iter().map(|value| value * value)).collect();
        let leverages = orders.iter().map(|&order| leverages[order]).collect();
        let constant = f64::from(u8::from(derivative == 0));
        let mut bank = Self { half, orders, gains, leverages, tables, weights, first, derivative, constant };
        if !target.noise.is_white() {
            let gain = |candidate| {
                let kernel = bank.kernel(candidate);
                kernel.iter().zip(target.noise.correlate(&kernel)).map(|(a, b)| a * b).sum()
            };
            bank.gains = (0..bank.orders.len()).map(gain).collect();
        }
        Some(bank)
    }

    pub(crate) fn scratch(&self) -> CoefficientScratch {
        self.tables.coefficients().scratch()
    }

    /// Centres that are worked on together.
    pub(crate) fn run(&self) -> usize {
        self.tables.coefficients().run()
    }

    /// The samples of a record that can be centres of windows.
    pub(crate) fn centres(&self, samples: usize) -> Range<usize> {
        self.half..samples.saturating_sub(self.half).max(self.half)
    }

    /// Estimates of every candidate at every `step`-th of some centres, a row each; NaN where a window holds an unusable sample.
    pub(crate) fn estimates<'a>(
        &self,
        record: &dyn Samples,
        centres: Range<usize>,
        step: usize,
        scratch: &mut CoefficientScratch,
        projected: &'a mut Projected,
    ) -> &'a mut [Vec<f64>] {
        let windows = centres.start - self.half..centres.end - self.half;
        self.tables.coefficients().project(record, windows, step, projected, scratch);
        let Projected { level: sums, coefficients: rows, .. } = projected;
        for sum in sums.iter_mut() {
            // NaN stays NaN.
            *sum *= self.constant;
        }
        for (row, weight) in rows.iter_mut().zip(&self.weights) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += weight * *value;
                *value = *sum;
            }
        }
        &mut rows[self.first..]
    }

    /// The same from the coefficients of all degrees.
    pub(crate) fn combine(&self, projected: &Projected) -> Vec<Vec<f64>> {
        let mut sums: Vec<f64> = projected.level.iter().map(|level| level * self.constant).collect();
        let mut rows = Vec::with_capacity(self.orders.len());
        for (l, weight) in self.weights.iter().enumerate() {
            let coefficients = &projected.coefficients[self.derivative + 2 * l];
            for (sum, value) in sums.iter_mut().zip(coefficients) {
                *sum += weight * *value;
            }
            if l >= self.first {
                rows.push(sums.clone());
            }
        }
        rows
    }

    /// The products of every candidate's kernel and a sequence around its centre that is even or odd as the kernels are.
    pub(crate) fn products(&self, sequence: &[f64]) -> Vec<f64> {
        let middle = sequence.len() / 2;
        let mut sums = vec![0.0; self.weights.len()];
        for (row, value) in self.tables.basis.rows().zip(&sequence[middle..]).skip(1) {
            for (sum, q) in sums.iter_mut().zip(row[self.derivative..].iter().step_by(2)) {
                *sum += q * value;
            }
        }
        let centre = self.tables.basis.rows().next().unwrap_or_default();
        let products = sums.iter().enumerate().map(|(l, sum)| {
            let at_centre = centre.get(self.derivative + 2 * l).map_or(0.0, |q| q * sequence[middle]);
            self.weights[l] * (2.0 * sum + at_centre)
        });
        running_sums(products).skip(self.first).collect()
    }

    /// The weights of a window's samples in a candidate.
    pub(crate) fn kernel(&self, candidate: usize) -> Vec<f64> {
        let weights = &self.weights[..=self.first + candidate];
        let weight = |index| {
            weights
                .iter()
                .enumerate()
                .map(|(l, weight)| weight * self.tables.basis.value(self.derivative + 2 * l, index))
                .sum()
        };
        (0..self.tables.basis.length()).map(weight).collect()
    }
}

/// A kernel times the matrix of the noise's correlations, at the samples of its own window and at least as far as `half` from its centre.
/// The product with another kernel is their covariance over the noise's variance.
pub(crate) fn correlated(kernel: Vec<f64>, half: usize, noise: &CorrelatedNoise) -> Vec<f64> {
    if noise.is_white() {
        return kernel;
    }
    let more = half.saturating_sub(kernel.len() / 2);
    let mut padded = vec![0.0; more];
    padded.extend(kernel);
    padded.resize(padded.len() + more, 0.0);
    noise.correlate(&padded)
}

/// The sum of all numbers up to each.
fn running_sums(numbers: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    numbers.scan(0.0, |sum, number| {
        *sum += number;
        Some(*sum)
    })
}
