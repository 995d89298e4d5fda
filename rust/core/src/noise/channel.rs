//! The noise of a channel, from coefficients that the signal does not reach: the highest degrees of polynomials in
//! short windows.
//!
//! White noise of variance `σ²` puts `σ²` into every coefficient `c_j` of a window of `M` samples, while a smooth
//! signal puts next to nothing into those of high degree. With windows of half-width 12, 20 and 35,
//!
//! ```text
//! σ² = min over the windows' lengths of the mean of (c_16² + … + c_19²)/4.
//! ```
//!
//! The longest window has the smallest variance, the shortest the least bias from the signal. Coloured noise is
//! underestimated.
//!
//! A channel that was rounded to a step `q` has noise of at least `q²/12`, also at rest, where all coefficients are
//! zero.

use crate::error::Error;
use crate::local_polynomials::basis::MOST_DEGREES;
use crate::local_polynomials::coefficients::{CoefficientScratch, Projected};
use crate::local_polynomials::tables::{TablesWanted, tables};
use crate::noise::passed::{CHANCE, PassedNoise, Shown};
use crate::noise::quantisation::{STRETCHES, quantisation_step};
use crate::noise::spectrum::{mean_weight, power_of_whole_segments};
use crate::record::samples::{Samples, is_usable};
use crate::record::subsample::stretches;
use crate::simd::instructions::Instructions;

/// Half-widths of the windows that the noise is estimated from.
const HALVES: [usize; 3] = [12, 20, 35];

/// The degrees whose coefficients are noise: four of them.
const LOWEST_DEGREE: usize = MOST_DEGREES - 4;

/// The fewest samples that noise can be estimated from: one of the shortest windows.
pub const FEWEST_SAMPLES: usize = 2 * HALVES[0] + 1;

/// The most windows that are used: so many determine the variance to 0.7 %.
const MOST_WINDOWS: usize = 1 << 17;

/// Bands of frequencies that are searched for one without signal, samples of a segment whose spectrum is taken, and how many segments a
/// record must hold.
const BANDS: usize = 16;
const SEGMENT: usize = 512;
const FEWEST_SEGMENTS: usize = 8;

/// The noise of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Its standard deviation: at least that of quantisation and rounding.
    pub sigma: f64,
    /// Step of the quantisation, or zero where there is none.
    pub quantisation: f64,
}

/// Estimates the noise of a channel, and its quantisation where that is not given. NaN if no window is free of unusable samples. Where the
/// variance of every sample's noise is one over its weight, it is that of a sample of weight one.
///
/// Costs `O(n)`, some 60 ns per sample, for up to 130 000 samples, and no more for longer records.
///
/// # Errors
/// If there are fewer than [`FEWEST_SAMPLES`].
pub fn noise(
    record: &dyn Samples,
    weights: Option<&[f64]>,
    quantisation: Option<f64>,
    instructions: Instructions,
) -> Result<Noise, Error> {
    let samples = enough_samples(record)?;
    let quantisation = quantisation.unwrap_or_else(|| quantisation_step(record));
    let halves = HALVES.iter().filter(|&half| 2 * half < samples);
    let variance = halves.map(|&half| variance(record, half, weights, instructions)).fold(f64::NAN, f64::min);
    let least = rounding_variance(quantisation, weights).max((f64::EPSILON * largest(record)).powi(2));
    let sigma = if variance.is_nan() { f64::NAN } else { variance.max(least).sqrt() };
    Ok(Noise { sigma, quantisation })
}

/// How many samples there are.
///
/// # Errors
/// If there are fewer than [`FEWEST_SAMPLES`].
fn enough_samples(record: &dyn Samples) -> Result<usize, Error> {
    let samples = record.len();
    if samples < FEWEST_SAMPLES {
        return Err(Error::RecordTooShort { samples, least: FEWEST_SAMPLES });
    }
    Ok(samples)
}

/// The variance of a channel's noise for the weights of equations: that of [`noise`], but at most the power in the
/// quietest frequency band. This bound holds where a signal with only a few samples per cycle reaches even the shortest
/// windows. Zero for a record that is too short.
pub(crate) fn channel_variance(record: &dyn Samples, quantisation: Option<f64>, instructions: Instructions) -> f64 {
    weighted_variance(record, None, quantisation, instructions)
}

/// The same of a sample of weight one, where samples have weights.
pub(crate) fn weighted_variance(
    record: &dyn Samples,
    weights: Option<&[f64]>,
    quantisation: Option<f64>,
    instructions: Instructions,
) -> f64 {
    let Ok(found) = noise(record, weights, quantisation, instructions) else { return 0.0 };
    if found.sigma.is_nan() {
        return 0.0;
    }
    let least = rounding_variance(found.quantisation, weights);
    (found.sigma * found.sigma).min(quietest_band(record, weights)).max(least)
}

/// The variance that rounding to a step leaves; it does not know of weights, so it is that of a sample of mean weight.
pub(crate) fn rounding_variance(quantisation: f64, weights: Option<&[f64]>) -> f64 {
    let mean = weights.map_or(1.0, |weights| {
        let used = weights.iter().filter(|weight| **weight > 0.0);
        used.clone().sum::<f64>() / used.count().max(1) as f64
    });
    mean * quantisation * quantisation / 12.0
}

/// The same of a channel that may have been resampled: what white noise must have had that became what the channel shows, and its density at low frequencies.
#[must_use]
pub fn variance_after(
    passed: Option<&PassedNoise>,
    record: &dyn Samples,
    weights: Option<&[f64]>,
    quantisation: Option<f64>,
    instructions: Instructions,
) -> f64 {
    let Some(passed) = passed else { return weighted_variance(record, weights, quantisation, instructions) };
    let variance = shown(record, weights, instructions).over(&passed.shown);
    if variance.is_nan() {
        return 0.0;
    }
    let quantisation = quantisation.unwrap_or(0.0);
    passed.gain * variance.max(rounding_variance(quantisation, weights)).max((f64::EPSILON * largest(record)).powi(2))
}

/// The noise of a channel that was resampled: that of [`variance_after`], and its quantisation where that is not given.
///
/// # Errors
/// If there are fewer than [`FEWEST_SAMPLES`].
pub fn noise_after(
    passed: &PassedNoise,
    record: &dyn Samples,
    weights: Option<&[f64]>,
    quantisation: Option<f64>,
    instructions: Instructions,
) -> Result<Noise, Error> {
    enough_samples(record)?;
    let sigma = variance_after(Some(passed), record, weights, quantisation, instructions).sqrt();
    Ok(Noise { sigma, quantisation: quantisation.unwrap_or_else(|| quantisation_step(record)) })
}

/// What a channel shows where its signal does not reach, or hardly, of a sample of weight one.
pub(crate) fn shown(record: &dyn Samples, weights: Option<&[f64]>, instructions: Instructions) -> Shown {
    let of =
        |half: usize| if 2 * half < record.len() { variance(record, half, weights, instructions) } else { f64::NAN };
    let (bands, powers) = bands(record, weights);
    Shown { variances: HALVES.map(of).to_vec(), bands, powers }
}

/// An upper confidence bound of the mean power in the quietest frequency band; infinite for a record that is too short.
fn quietest_band(record: &dyn Samples, weights: Option<&[f64]>) -> f64 {
    let (bands, powers) = bands(record, weights);
    let quietest = bands.into_iter().fold(f64::INFINITY, f64::min);
    // The power at a frequency of a segment scatters by as much as it is.
    quietest * (1.0 + CHANCE / powers.sqrt())
}

/// The mean power in every frequency band, and of how many independent powers each is the mean; none for a record that is too short.
pub(crate) fn bands(record: &dyn Samples, weights: Option<&[f64]>) -> (Vec<f64>, f64) {
    if record.len() < FEWEST_SEGMENTS * SEGMENT {
        return (Vec::new(), 1.0);
    }
    let (power, segments) = power_of_whole_segments(record, weights, SEGMENT);
    if segments == 0 {
        return (Vec::new(), 1.0);
    }
    let width = SEGMENT / 2 / BANDS;
    let bands = power[1..].chunks_exact(width).map(|band| band.iter().sum::<f64>() / band.len() as f64);
    (bands.collect(), (segments * width) as f64)
}

/// The mean of the squared highest coefficients of windows of one half-width, each times the weight of its window.
fn variance(record: &dyn Samples, half: usize, weights: Option<&[f64]>, instructions: Instructions) -> f64 {
    let length = 2 * half + 1;
    let wanted = TablesWanted { half, highest: MOST_DEGREES - 1, first: LOWEST_DEGREE, step: 1, instructions };
    // Windows are short, and little memory is not asked for.
    let Ok(tables) = tables(wanted) else { return f64::NAN };
    let plan = tables.coefficients();
    let (mut scratch, mut projected) = (CoefficientScratch::default(), Projected::default());
    let (mut sum, mut count) = (0.0, 0);
    let ones = vec![1.0; length];
    for windows in stretches(record.len() + 1 - length, MOST_WINDOWS, STRETCHES) {
        plan.project(record, windows.clone(), 1, &mut projected, &mut scratch);
        let weight =
            |window: usize| weights.map_or(1.0, |weights| mean_weight(&weights[window..window + length], &ones));
        let weights: Vec<f64> = windows.map(weight).collect();
        for row in &projected.coefficients {
            for (c, weight) in row.iter().zip(&weights).filter(|(c, _)| !c.is_nan()) {
                sum += weight * c * c;
                count += 1;
            }
        }
    }
    if count == 0 { f64::NAN } else { sum / f64::from(count) }
}

/// The largest magnitude of a usable sample.
pub(crate) fn largest(record: &dyn Samples) -> f64 {
    let mut samples = Vec::new();
    let mut largest = 0.0_f64;
    for places in stretches(record.len(), MOST_WINDOWS, STRETCHES) {
        samples.resize(places.len(), 0.0);
        record.read(places.start, &mut samples);
        largest = samples.iter().filter(|value| is_usable(**value)).fold(largest, |most, value| most.max(value.abs()));
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    /// 6000 samples tell the variance to 5 to 8 %, by the length of the windows, and the smallest of three such is some
    /// 3 % too small; 20 of them tell that to 2 %. The quietest of sixteen bands would be 13 % too small.
    #[test]
    fn the_quietest_band_of_white_noise_is_no_bound() {
        let samples = uniform(20 * 6000);
        let variances =
            samples.chunks_exact(6000).map(|one| 12.0 * channel_variance(&one, None, Instructions::current()));
        let mean = variances.sum::<f64>() / 20.0;
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
    }
}
