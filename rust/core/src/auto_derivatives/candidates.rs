//! The candidates of windows of one length for a derivative: one estimate per order, all from the same coefficients.
//!
//! At a window's centre the `d`-th derivative is the same for orders `d + 2i` and `d + 2i + 1`, so the candidates are
//! `d, d + 2, …`, and each of them has one more coefficient than the one before:
//!
//! ```text
//! d_i = Σ_{l≤i} w_l c_{d+2l},   w_l = q_{d+2l}^(d)(0) / Δ^d,   variance σ² g_i,   g_i = Σ_{l≤i} w_l².
//! ```
//!
//! Long windows are made of means of `r` samples ([`crate::auto_derivatives::block_means`]): `w_l` are those of the polynomial whose means are
//! `q_{d+2l}`, and variances `r` times as small.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use crate::auto_derivatives::block_means::{BlockMeans, Grid, step_for};
use crate::auto_derivatives::deconvolution::AtCentre;
use crate::auto_derivatives::slopes::BasisSums;
use crate::auto_derivatives::symmetric_grid::within;
use crate::error::Error;
use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};
use crate::local_polynomials::mirrored_kernels::{LONGEST, MirroredKernels};
use crate::local_polynomials::tables::{TablesWanted, WindowTables, tables};
use crate::noise::correlated::CorrelatedNoise;
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// The derivative to be estimated, and its orders.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target<'a> {
    pub(crate) derivative: usize,
    /// The highest order, which is the only one where it is fixed.
    pub(crate) highest: usize,
    pub(crate) fixed: bool,
    /// Half-width of the shortest window.
    pub(crate) shortest: usize,
    /// Whether long windows are made of means.
    pub(crate) of_means: bool,
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
    /// Samples of a mean that the windows are made of; one where they are made of samples.
    pub(crate) step: usize,
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
    /// The candidates as sums over the samples of short windows, made when they are first needed.
    mirrored: OnceLock<MirroredKernels>,
    pub(crate) instructions: Instructions,
}

impl Bank {
    /// Prepares the tables of windows of about this length, or returns `None` if they have no candidate.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn new(half: usize, target: &Target<'_>) -> Result<Option<Self>, Error> {
        let step = if target.of_means { step_for(half) } else { 1 };
        let inner = half / step;
        let half = inner * step + step / 2;
        let orders = target.orders(inner);
        let derivative = target.derivative;
        let Some(&highest) = orders.last() else { return Ok(None) };
        // One basis serves all derivatives.
        let (all, instructions) = (target.highest(inner), target.instructions);
        let tables = tables(TablesWanted { half: inner, highest: all, first: derivative, step: 2, instructions })?;
        let at_centre = AtCentre::new(&tables.basis, step);
        let degrees: Vec<usize> = (derivative..=highest).step_by(2).collect();
        let first = degrees.len() - orders.len();
        let (scale, share) = (target.scale(), 1.0 / step as f64);
        let weights: Vec<f64> =
            degrees.iter().map(|&degree| at_centre.derivative(derivative, degree) * scale).collect();
        let gains = running_sums(weights.iter().map(|weight| weight * weight * share)).skip(first).collect();
        let leverage = |degree: usize| at_centre.derivative(0, degree) * at_centre.of_means[0][degree] * share;
        let leverages: Vec<f64> = running_sums((0..=highest).map(leverage)).collect();
        let leverages = orders.iter().map(|&order| leverages[order]).collect();
        let constant = f64::from(u8::from(derivative == 0));
        let mirrored = OnceLock::new();
        let mut bank = Self {
            half,
            step,
            orders,
            gains,
            leverages,
            tables,
            weights,
            first,
            derivative,
            constant,
            mirrored,
            instructions,
        };
        if !target.noise.is_white() {
            let gain = |candidate| {
                let kernel = bank.kernel(candidate);
                kernel.iter().zip(target.noise.correlate(&kernel)).map(|(a, b)| a * b).sum()
            };
            bank.gains = (0..bank.orders.len()).map(gain).collect();
        }
        Ok(Some(bank))
    }

    /// The same with one of the candidates.
    pub(crate) fn only(mut self, candidate: usize) -> Self {
        self.first += candidate;
        self.weights.truncate(self.first + 1);
        self.orders = vec![self.orders[candidate]];
        self.gains = vec![self.gains[candidate]];
        self.leverages = vec![self.leverages[candidate]];
        self.mirrored = OnceLock::new();
        self
    }

    /// Samples that are worked on together.
    pub(crate) fn run(&self) -> usize {
        self.tables.coefficients().run() * self.step
    }

    /// Means in half a window.
    fn inner(&self) -> usize {
        self.tables.basis.length() / 2
    }

    /// The means, or samples, of a record that can be centres of windows.
    pub(crate) fn centres(&self, samples: usize) -> Range<usize> {
        let (inner, count) = (self.inner(), Grid::new(samples, self.step).count);
        inner..count.saturating_sub(inner).max(inner)
    }

    /// The places of a grid, out of some, at which windows fit, and the means, or samples, there. The grid is not finer than that of the means.
    pub(crate) fn places(&self, samples: usize, grid: Grid, wanted: &Range<usize>) -> (Range<usize>, Range<usize>) {
        let (own, centres) = (Grid::new(samples, self.step), self.centres(samples));
        let fits = within(wanted, &grid.means(&(own.sample(centres.start)..own.sample(centres.end))));
        if centres.is_empty() || fits.is_empty() {
            return (0..0, 0..0);
        }
        let mean = |place: usize| (grid.sample(place) - own.first) / own.step;
        (fits.clone(), mean(fits.start)..mean(fits.end - 1) + 1)
    }

    /// Estimates of every candidate at every `every`-th of some centres, a row each; NaN where a window holds an unusable sample.
    pub(crate) fn estimates<'a>(
        &self,
        means: &BlockMeans<'_>,
        centres: Range<usize>,
        every: usize,
        scratch: &mut CoefficientScratch,
        projected: &'a mut Projected,
    ) -> &'a mut [Vec<f64>] {
        let windows = centres.start - self.inner()..centres.end - self.inner();
        let record = means.of(self.step);
        let degrees = self.tables.basis.degrees();
        if let Some(mirrored) = self.mirrored().filter(|mirrored| mirrored.serve(every, degrees)) {
            let rows = &mut projected.coefficients;
            // Never fewer than there are: what is let go would be asked for again.
            rows.resize_with(rows.len().max(self.orders.len()), Vec::new);
            let count = windows.len().div_ceil(every);
            let rows = &mut rows[..self.orders.len()];
            for row in &mut *rows {
                row.resize(count, 0.0);
            }
            let mut slices: Vec<&mut [f64]> = rows.iter_mut().map(Vec::as_mut_slice).collect();
            mirrored.apply(record, windows, every, (&mut [], &mut slices), &mut scratch.mirrored);
            return rows;
        }
        self.tables.coefficients().project(record, windows, every, projected, scratch);
        let Projected { level: sums, coefficients: rows, .. } = projected;
        for sum in sums.iter_mut() {
            // NaN stays NaN.
            *sum *= self.constant;
        }
        dispatch(self.instructions, Accumulate { sums, rows, weights: &self.weights });
        &mut rows[self.first..]
    }

    /// The candidates of a short window as sums over its samples.
    fn mirrored(&self) -> Option<&MirroredKernels> {
        let inner = self.inner();
        let (odd, constant) = (self.derivative % 2 == 1, self.constant);
        let make = || {
            let fill = |distance: usize, weights: &mut [f64]| {
                let row = &self.tables.basis.row(inner + distance).0[self.derivative..];
                let mut sum = 0.0;
                for (l, (weight, q)) in self.weights.iter().zip(row.iter().step_by(2)).enumerate() {
                    sum += weight * q;
                    // What comes before the first candidate is overwritten.
                    weights[l.saturating_sub(self.first)] = sum;
                }
            };
            MirroredKernels::of_one_parity(inner, self.orders.len(), (odd, constant), fill, self.instructions)
        };
        (inner <= LONGEST).then(|| self.mirrored.get_or_init(make))
    }

    /// The same from the coefficients of all degrees.
    pub(crate) fn combine(&self, projected: &Projected) -> Vec<Vec<f64>> {
        let Projected { level, coefficients, .. } = projected;
        let coefficients: Vec<&[f64]> =
            coefficients[self.derivative..].iter().step_by(2).take(self.weights.len()).map(Vec::as_slice).collect();
        let mut rows: Vec<Vec<f64>> = self.orders.iter().map(|_| Vec::with_capacity(level.len())).collect();
        let mut sums = [0.0; TOGETHER];
        for first in (0..level.len()).step_by(TOGETHER) {
            let sums = &mut sums[..TOGETHER.min(level.len() - first)];
            for (sum, level) in sums.iter_mut().zip(&level[first..]) {
                *sum = level * self.constant;
            }
            for (l, (row, &weight)) in coefficients.iter().zip(&self.weights).enumerate() {
                dispatch(self.instructions, AddWeighted { sums, row: &row[first..], weight });
                if let Some(place) = l.checked_sub(self.first) {
                    rows[place].extend_from_slice(sums);
                }
            }
        }
        rows
    }

    /// The products of every candidate's kernel and a sequence around its centre that is even or odd as the kernels are.
    pub(crate) fn products(&self, sequence: &[f64]) -> Vec<f64> {
        let outwards = &sequence[sequence.len() / 2..];
        let (own, others) = outwards.split_at((self.step / 2 + 1).min(outwards.len()));
        // Both halves of what is at the centre.
        let at_centre = own[0] + 2.0 * own[1..].iter().sum::<f64>();
        let (basis, inner) = (&self.tables.basis, self.inner());
        let centre = basis.rows().next().unwrap_or_default();
        let values: Vec<f64> = others.chunks(self.step).take(inner).map(|part| part.iter().sum()).collect();
        let all = dispatch(self.instructions, BasisSums { basis, first: inner + 1, values: &values });
        let sums = all[self.derivative..].iter().step_by(2).take(self.weights.len());
        let products = sums.enumerate().map(|(l, sum)| {
            let at_centre = centre.get(self.derivative + 2 * l).map_or(0.0, |q| q * at_centre);
            self.weights[l] * (2.0 * sum + at_centre) / self.step as f64
        });
        running_sums(products).skip(self.first).collect()
    }

    /// The weights of a window's samples in a candidate.
    pub(crate) fn kernel(&self, candidate: usize) -> Vec<f64> {
        let (odd, length) = (self.derivative % 2 == 1, self.tables.basis.length());
        let mut kernel = vec![0.0; length * self.step];
        // From the centre outwards: on the left an odd kernel has the other sign.
        for (distance, row) in self.tables.basis.rows().enumerate() {
            let products = self.weights[..=self.first + candidate].iter().zip(row[self.derivative..].iter().step_by(2));
            let weight = products.map(|(weight, q)| weight * q).sum::<f64>() / self.step as f64;
            let mirrored = if odd { -weight } else { weight };
            for (index, weight) in [(length / 2 - distance, mirrored), (length / 2 + distance, weight)] {
                kernel[index * self.step..][..self.step].fill(weight);
            }
        }
        kernel
    }
}

/// Samples whose sums stay in the nearest cache.
const TOGETHER: usize = 1 << 10;

/// Adds a row of numbers with their weight to sums.
struct AddWeighted<'a> {
    sums: &'a mut [f64],
    row: &'a [f64],
    weight: f64,
}

impl Kernel for AddWeighted<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        for (sum, value) in self.sums.iter_mut().zip(self.row) {
            *sum += self.weight * *value;
        }
    }
}

/// Turns rows of coefficients into the sums of all up to each, with their weights.
struct Accumulate<'a> {
    sums: &'a mut [f64],
    rows: &'a mut [Vec<f64>],
    weights: &'a [f64],
}

impl Kernel for Accumulate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        for (row, weight) in self.rows.iter_mut().zip(self.weights) {
            for (sum, value) in self.sums.iter_mut().zip(row) {
                *sum += weight * *value;
                *value = *sum;
            }
        }
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
