//! Estimates of a record that is a polynomial of low degree and noise, from all of it at once.
//!
//! No window is too long there, so the coefficients `c_j` of one polynomial over the record give every derivative. Of the orders from the
//! derivative's own on, each is weighed by how far its coefficients exceed their noise, and their estimates are averaged:
//!
//! ```text
//! w_k ∝ exp(½ Σ_{j≤k} (c_j²/var c_j - λ)),   λ = 10.
//! ```
//!
//! `λ` is what a degree must gain to count. A record that bends a little less than that still bends, and the next degree would have moved
//! derivatives by several times the noise of this one. So errors are those of the same average with `λ = 2`, what Akaike's criterion asks, and hold
//! the distance of each order from the estimate.

use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::auto_derivatives::block_means::{BlockMeans, Grid};
use crate::auto_derivatives::knots::interpolated;
use crate::auto_derivatives::local_weights::DerivativeOutputs;
use crate::auto_derivatives::slopes::SampleSlopes;
use crate::error::Error;
use crate::exec::memory;
use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::tables::basis;
use crate::noise::correlated::CorrelatedNoise;
use crate::record::samples::Samples;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Degrees of the polynomials of a record.
pub(crate) const DEGREES: usize = 16;

/// Long records are made of means, of which there are at least so many.
const LEAST_MEANS: usize = 1 << 10;

/// The highest order that is weighed, unless the derivative is higher.
const HIGHEST: usize = 6;

/// What a degree must gain to count in estimates, and in their errors.
const CHARGE: f64 = 10.0;
const CHARGE_OF_ERRORS: f64 = 2.0;

/// Places in half a record at which errors are computed; between them they are interpolated.
const PLACES: usize = 64;

/// The coefficients of one polynomial over all of a record.
pub(crate) struct WholeRecord {
    pub(crate) basis: Arc<Basis>,
    /// Samples of a mean, and those before the first.
    pub(crate) step: usize,
    before: usize,
    samples: usize,
    /// What was taken off the samples.
    reference: f64,
    pub(crate) coefficients: [f64; DEGREES],
}

/// What is asked of a whole record.
#[derive(Clone, Copy)]
pub(crate) struct WholeTarget<'a> {
    pub(crate) derivative: usize,
    /// The highest order, which is the only one where it is fixed.
    pub(crate) highest: usize,
    pub(crate) fixed: bool,
    pub(crate) delta: f64,
    /// Covariances of the coefficients.
    pub(crate) covariances: &'a [[f64; DEGREES]],
    pub(crate) instructions: Instructions,
}

impl WholeTarget<'_> {
    /// The orders that are weighed.
    fn orders(&self) -> RangeInclusive<usize> {
        let first = if self.fixed { self.highest } else { self.derivative };
        first..=self.highest.min(HIGHEST).max(first)
    }
}

impl WholeRecord {
    /// Finds the coefficients; NaN where a sample is unusable. The record must hold more samples than there are degrees.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn new(means: &BlockMeans<'_>, instructions: Instructions) -> Result<Self, Error> {
        let samples = means.record().len();
        let step = means.coarsest(samples, LEAST_MEANS);
        let grid = Grid::new(samples, step);
        memory::ask_for_numbers(grid.count)?;
        let mut values = vec![0.0; grid.count];
        means.of(step).read(0, &mut values);
        let basis = basis(grid.count, DEGREES)?;
        let coefficients = dispatch(instructions, WindowCoefficients { window: &values, basis: &basis });
        let reference = values[grid.count / 2];
        Ok(Self { basis, step, before: grid.first - step / 2, samples, reference, coefficients })
    }

    /// The covariances of the coefficients.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn covariances(&self, noise: &CorrelatedNoise) -> Result<Vec<[f64; DEGREES]>, Error> {
        if !noise.is_white() {
            // A row at the samples, and what it becomes.
            memory::ask_for_numbers(self.samples.saturating_mul(2))?;
        }
        let (length, share) = (self.basis.length(), 1.0 / self.step as f64);
        let variance = noise.variance();
        let row = |degree: usize| {
            if noise.is_white() {
                return std::array::from_fn(|other| if other == degree { variance * share } else { 0.0 });
            }
            let own: Vec<f64> = (0..length).map(|mean| self.basis.value(degree, mean)).collect();
            let mut sums = [0.0; DEGREES];
            for (index, value) in noise.covariances_of_means(&own, self.step).into_iter().enumerate() {
                let (row, mirrored) = self.basis.row(index);
                for (other, (sum, q)) in sums.iter_mut().zip(row).enumerate() {
                    *sum += if mirrored && other % 2 == 1 { -value * q } else { value * q };
                }
            }
            // Even and odd degrees are uncorrelated; sums of what cancels would leave rounding.
            let kept = |(other, sum): (usize, f64)| if (other + degree) % 2 == 0 { sum } else { 0.0 };
            let mut sums = sums.into_iter().enumerate().map(kept);
            std::array::from_fn(|_| sums.next().unwrap_or(0.0))
        };
        Ok((0..DEGREES).map(row).collect())
    }

    /// Estimates a derivative at all samples. Returns the order of most weight.
    pub(crate) fn estimate(&self, target: &WholeTarget<'_>, outputs: &mut DerivativeOutputs<'_>) -> usize {
        let &WholeTarget { derivative, delta, instructions, .. } = target;
        let orders = target.orders();
        let weights = self.weights(target, CHARGE);
        let power = i32::try_from(derivative).unwrap_or(i32::MAX);
        let scale = (delta * self.step as f64).powi(power).recip();
        let slopes = SampleSlopes::new(&self.basis, self.step, derivative, orders.end() + 1).after(self.before);
        // A coefficient counts in every order that is not below it.
        let counts = |degree: usize| weights[degree.saturating_sub(*orders.start())..].iter().sum::<f64>();
        let counted: Vec<f64> = (0..=*orders.end()).map(|degree| self.coefficients[degree] * counts(degree)).collect();
        let constant = if derivative == 0 { self.reference } else { 0.0 };
        let sums = slopes.sums(&slopes.combined(&counted), self.samples, instructions);
        for (value, sum) in outputs.values.iter_mut().zip(sums) {
            *value = scale * sum + constant;
        }
        if !outputs.errors.is_empty() {
            let places = places(self.samples);
            let of_errors = self.weights(target, CHARGE_OF_ERRORS);
            let at_places = slopes.of_coefficients_at(&places, instructions);
            let error = |slopes: &[f64; MOST_DEGREES]| scale * self.error(target, slopes, &counted, &of_errors);
            let errors: Vec<f64> = at_places.iter().map(error).collect();
            outputs.errors.copy_from_slice(&interpolated(&places, &errors));
        }
        let heaviest = weights.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(place, _)| place);
        let order = orders.start() + heaviest;
        outputs.order.fill(u8::try_from(order).unwrap_or(u8::MAX));
        order
    }

    /// The weights of the orders.
    fn weights(&self, target: &WholeTarget<'_>, charge: f64) -> Vec<f64> {
        let orders = target.orders();
        let gain = |degree: usize| {
            let excess = self.coefficients[degree].powi(2) / target.covariances[degree][degree] - charge;
            if degree > *orders.start() { 0.5 * excess } else { 0.0 }
        };
        let logarithms: Vec<f64> = orders
            .clone()
            .scan(0.0, |sum, degree| {
                *sum += gain(degree);
                Some(*sum)
            })
            .collect();
        let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logarithms.iter().map(|logarithm| (logarithm - largest).exp()).collect();
        let total: f64 = weights.iter().sum();
        weights.iter().map(|weight| weight / total).collect()
    }

    /// The error at a place, from the derivative there of what every coefficient belongs to, the coefficients that the estimate is made of, and the
    /// weights of the orders: `√Σ w_k (var d_k + (d_k - d)²)`.
    fn error(&self, target: &WholeTarget<'_>, slopes: &[f64; MOST_DEGREES], counted: &[f64], weights: &[f64]) -> f64 {
        let estimate: f64 = counted.iter().zip(slopes).map(|(c, slope)| c * slope).sum();
        let (mut value, mut variance, mut square) = (0.0, 0.0, 0.0);
        let orders = target.orders();
        for degree in 0..=*orders.end() {
            value += self.coefficients[degree] * slopes[degree];
            let covariances = &target.covariances[degree];
            let others: f64 = covariances[..degree].iter().zip(slopes).map(|(one, slope)| one * slope).sum();
            variance += slopes[degree] * (2.0 * others + slopes[degree] * covariances[degree]);
            if let Some(place) = degree.checked_sub(*orders.start()) {
                square += weights[place] * (variance + (value - estimate).powi(2));
            }
        }
        square.sqrt()
    }
}

/// Places at which errors are computed, the same from both ends.
fn places(samples: usize) -> Vec<usize> {
    let near: Vec<usize> = (0..=PLACES).map(|index| index * (samples - 1) / (2 * PLACES)).collect();
    let far = near.iter().rev().map(|place| samples - 1 - place);
    let mut places: Vec<usize> = near.iter().copied().chain(far).collect();
    places.dedup();
    places
}

/// The coefficients of one window, less the sample in its middle.
pub(crate) struct WindowCoefficients<'a> {
    pub(crate) window: &'a [f64],
    pub(crate) basis: &'a Basis,
}

impl WindowCoefficients<'_> {
    #[inline(always)]
    pub(crate) fn sums(&self) -> [Packet; DEGREES / WIDTH] {
        let Self { window, basis } = self;
        let mut sums = [Packet::ZERO; DEGREES / WIDTH];
        for (index, value) in window.iter().enumerate() {
            // The reference keeps the digits of a small motion on a large offset.
            let value = value - window[window.len() / 2];
            let (row, mirrored) = basis.row(index);
            let odd = if mirrored { -value } else { value };
            let values = Packet([value, odd, value, odd, value, odd, value, odd]);
            for (sum, row) in sums.iter_mut().zip(row.chunks_exact(WIDTH)) {
                *sum += values * Packet::load(row);
            }
        }
        sums
    }
}

impl Kernel for WindowCoefficients<'_> {
    type Output = [f64; DEGREES];

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> [f64; DEGREES] {
        let mut all = [0.0; DEGREES];
        for (all, sums) in all.chunks_mut(WIDTH).zip(self.sums()) {
            all.copy_from_slice(&sums.0);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    /// A parabola and noise of some variance, and what is found of a derivative, with one order or any: estimates, errors and the order.
    fn found(
        samples: usize,
        noise: &CorrelatedNoise,
        derivative: usize,
        only: Option<usize>,
    ) -> (Vec<f64>, Vec<f64>, usize) {
        let sigma = noise.variance().sqrt() * 12.0_f64.sqrt();
        let parabola = |(i, e): (usize, f64)| sigma * e + parabola(i as f64 / samples as f64, 0);
        let record: Vec<f64> = uniform(samples).into_iter().enumerate().map(parabola).collect();
        let record = record.as_slice();
        let (means, instructions) = (BlockMeans::new(&record, samples / 4).expect("memory"), Instructions::current());
        let whole = WholeRecord::new(&means, instructions).expect("memory");
        let covariances = whole.covariances(noise).expect("memory");
        let delta = 1.0 / samples as f64;
        let (highest, fixed) = (only.unwrap_or(15), only.is_some());
        let target = WholeTarget { derivative, highest, fixed, delta, covariances: &covariances, instructions };
        let (mut values, mut errors, mut order) = (vec![0.0; samples], vec![0.0; samples], vec![0; samples]);
        let outputs = &mut DerivativeOutputs { values: &mut values, errors: &mut errors, order: &mut order };
        let order = whole.estimate(&target, outputs);
        (values, errors, order)
    }

    fn parabola(t: f64, derivative: usize) -> f64 {
        [2.0 + 3.0 * t - 5.0 * t * t, 3.0 - 10.0 * t, -10.0][derivative]
    }

    #[test]
    fn a_parabola_is_found_by_samples_and_by_means() {
        for samples in [1000, 1001, 70_000, 70_001, 300_002] {
            for derivative in 0..3 {
                let (values, errors, order) = found(samples, &CorrelatedNoise::white(1e-4), derivative, None);
                assert_eq!(order, 2, "{samples}, {derivative}");
                for (i, (value, error)) in values.iter().zip(&errors).enumerate() {
                    let away = value - parabola(i as f64 / samples as f64, derivative);
                    assert!(away.abs() < 4.5 * error, "{samples}, {derivative}, {i}: {away} {error}");
                }
                // The variance of the derivative of highest order is known: 720 σ²/n of a parabola over a time of one. Less than two means,
                // of 27 in 70 000 samples, have no part in it: 2.5 times their share of the record. Higher orders have their share.
                if derivative == 2 {
                    let expected = (720.0 * 1e-4 / samples as f64).sqrt();
                    let (_, alone, _) = found(samples, &CorrelatedNoise::white(1e-4), derivative, Some(2));
                    assert!((alone[samples / 2] / expected - 1.0).abs() < 2e-3, "{samples}: {}", alone[samples / 2]);
                    assert!(errors[samples / 2] > 0.999 * expected, "{samples}: {}", errors[samples / 2]);
                }
            }
        }
    }

    #[test]
    fn noise_that_is_correlated_makes_errors_larger() {
        let white = found(2000, &CorrelatedNoise::white(1e-4), 2, Some(2)).1;
        let other = found(2000, &CorrelatedNoise::new(0.0, vec![(0.8, 1e-4)]), 2, Some(2)).1;
        // Its density at low frequencies is nine times that of white noise.
        let ratio = other[1000] / white[1000];
        assert!((ratio / 3.0 - 1.0).abs() < 0.3, "{ratio}");
    }

    #[test]
    fn covariances_by_means_are_those_by_samples() {
        let samples = 70_000;
        let record = uniform(samples);
        let record = record.as_slice();
        let means = BlockMeans::new(&record, samples / 4).expect("memory");
        let whole = WholeRecord::new(&means, Instructions::current()).expect("memory");
        assert_eq!(whole.step, 27);
        let noise = CorrelatedNoise::new(1.0, vec![(0.9, 1.0), (0.999, 0.1)]);
        let covariances = whole.covariances(&noise).expect("memory");
        // A coefficient of degree j sees frequencies of some j/2 cycles a record.
        for (degree, row) in covariances.iter().enumerate().take(4) {
            let ratio = row[degree] * whole.step as f64 / noise.density(0.0);
            assert!((0.9..1.01).contains(&ratio), "{degree}: {ratio}");
        }
        let white = whole.covariances(&CorrelatedNoise::white(2.0)).expect("memory");
        assert!((white[3][3] * 27.0 / 2.0 - 1.0).abs() < 1e-9 && white[3][1].abs() < 1e-9);
    }

    #[test]
    fn places_are_the_same_from_both_ends() {
        for samples in [64, 100, 129, 5000] {
            let places = places(samples);
            assert!(places.windows(2).all(|pair| pair[0] < pair[1]), "{samples}");
            assert_eq!((places[0], places[places.len() - 1]), (0, samples - 1));
            assert!(places.iter().zip(places.iter().rev()).all(|(one, other)| one + other == samples - 1));
        }
    }
}
