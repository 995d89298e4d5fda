//! Window length and order chosen together: for a record as a whole, then locally.
//!
//! For each derivative of each record `global_choice` finds the window and the order of least mean squared error.
//! A record that is a parabola and noise has no such window: `trend` finds out, and `whole_record` estimates from all of it. Around them `candidate_weights` weighs candidates sample by sample, and `local_average` averages them. Within half a
//! window of the ends, `boundary` estimates with shrunk coefficients. Each derivative of a record has its own windows,
//! since the best ones differ.

use std::num::NonZeroUsize;

use crate::auto_derivatives::boundary;
use crate::auto_derivatives::candidate_weights::Refinement;
use crate::auto_derivatives::candidates::Target;
use crate::auto_derivatives::global_choice::{Pair, SHORTEST, rounded};
use crate::auto_derivatives::local_weights::DerivativeOutputs;
use crate::auto_derivatives::survey::{CLOSELY, Survey};
use crate::auto_derivatives::trend::ParabolicTrend;
use crate::auto_derivatives::whole_record::WholeTarget;
use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::Watch;
use crate::local_polynomials::boundary::End;
use crate::local_polynomials::options::HIGHEST_ORDER;
use crate::noise::correlated::CorrelatedNoise;
use crate::noise::quantisation::quantisation_step;
use crate::record::samples::{Samples, is_usable};
use crate::record::subsample::stretches;
use crate::simd::instructions::Instructions;
use crate::status::Status;

/// The fewest samples of a record for which a window can be chosen.
pub const FEWEST_SAMPLES: usize = 64;

/// What to estimate.
#[derive(Clone, Copy, Debug)]
pub struct AutomaticOptions {
    /// Which derivative; 0 is the value.
    pub derivative: usize,
    /// The highest order, which is the only one where it is fixed.
    pub highest: usize,
    /// Whether the order is fixed.
    pub fixed: bool,
    /// Sample period in seconds.
    pub delta: f64,
}

/// A record whose derivatives are to be estimated, and what all of them need to know of it.
pub struct AutomaticRecord<'a> {
    survey: Survey<'a>,
    noise: CorrelatedNoise,
    /// Half-width of the shortest window.
    shortest: usize,
    /// The parabola that is all there is.
    trend: Option<ParabolicTrend>,
    instructions: Instructions,
}

impl<'a> AutomaticRecord<'a> {
    /// Prepares a record for orders up to the highest, with the noise that [`crate::noise`] finds.
    ///
    /// # Errors
    /// If there is not the memory.
    pub fn new(
        record: &'a dyn Samples,
        noise: &CorrelatedNoise,
        highest: usize,
        instructions: Instructions,
    ) -> Result<Self, Error> {
        let variance = noise.variance();
        let (shortest, noise) = match samples_per_step(record, variance.sqrt()) {
            // A caller who denies quantisation may give less noise than rounding makes.
            Some((step, each)) => {
                let rounding = variance.min(step * step / 12.0);
                let noise = CorrelatedNoise::white(variance.max(rounding * crowding(each)));
                (shortest_window(each, record.len()), noise)
            }
            None => (SHORTEST, noise.clone()),
        };
        let survey = Survey::new(record, highest.min(HIGHEST_ORDER), instructions)?;
        let trend = ParabolicTrend::new(survey.means(), &noise, instructions)?;
        Ok(Self { survey, noise, shortest, trend, instructions })
    }
}

impl std::fmt::Debug for AutomaticRecord<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("AutomaticRecord")
            .field("noise", &self.noise)
            .field("trend", &self.trend.as_ref().map(|trend| trend.degree))
            .finish_non_exhaustive()
    }
}

/// Where the estimates of all samples go. Slices that are empty are not wanted.
#[derive(Debug)]
pub struct AutomaticEstimates<'a> {
    /// The derivative.
    pub values: &'a mut [f64],
    /// Its standard errors, with the disagreement of the candidates.
    pub errors: &'a mut [f64],
    /// The order of most weight.
    pub order: &'a mut [u8],
    /// Bits of [`Status`].
    pub status: &'a mut [u16],
}

/// The window and the order that suit a record as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AutomaticChoice {
    /// Samples in the window.
    pub window_length: usize,
    /// Order of the polynomial.
    pub order: usize,
}

/// Of a record that is a trend, a part of one over this on either side is near an end: in its middle errors are smaller.
const NEAR_END: usize = 4;

/// Numbers that are kept of a sample at most, beside the estimates.
const NUMBERS: usize = 4;

/// Steps of a quantised signal that half of the shortest window must span, on average.
const STEPS: f64 = 2.0;

/// `6 ζ(3)/π³`: see [`crowding`].
const CROWDING: f64 = 0.232_609;

/// A signal rests where it stays constant so many times longer than on average: much longer than at the peak of a sine.
const REST: f64 = 32.0;

/// Differences of neighbours that tell how fast a signal moves, at most, and in how many stretches.
const MOST_DIFFERENCES: usize = 1 << 14;
const STRETCHES: usize = 64;

/// Estimates one derivative of one record with window and order chosen. Returns the pair that suits the record as a whole, or `None` if
/// no window is free of unusable samples.
///
/// The numbers do not depend on the number of workers.
///
/// # Errors
/// If the record has fewer than [`FEWEST_SAMPLES`], if the derivative is higher than the order or the order too high, or if the watch cancels.
pub fn estimate_automatically(
    prepared: &AutomaticRecord<'_>,
    options: &AutomaticOptions,
    estimates: &mut AutomaticEstimates<'_>,
    workers: NonZeroUsize,
    watch: &mut Watch<'_>,
) -> Result<Option<AutomaticChoice>, Error> {
    let AutomaticRecord { survey, noise, shortest, trend, instructions } = prepared;
    let (record, &AutomaticOptions { derivative, highest, fixed, delta }) = (survey.record(), options);
    let samples = record.len();
    if samples < FEWEST_SAMPLES {
        return Err(Error::RecordTooShort { samples, least: FEWEST_SAMPLES });
    }
    if highest > HIGHEST_ORDER {
        let name = if fixed { "order" } else { "max_order" };
        return Err(Error::OrderTooHigh { name, order: highest, most: HIGHEST_ORDER });
    }
    if highest < derivative {
        return Err(Error::OrderTooLow { order: highest, derivative });
    }
    memory::ask_for_numbers(samples.saturating_mul(NUMBERS))?;
    let (shortest, instructions, of_means) = (*shortest, *instructions, samples > CLOSELY);
    let target = Target { derivative, highest, fixed, shortest, of_means, delta, noise, instructions };
    let total = 2 * samples;
    if let Some(trend) = trend.as_ref().filter(|trend| highest >= trend.degree) {
        check_cancelled(watch, samples, total)?;
        let choice = of_trend(trend, &target, estimates);
        check_cancelled(watch, total, total)?;
        return Ok(Some(choice));
    }
    let best = survey.best(&target, &mut || check_cancelled(watch, 0, total))?;
    let planned = best.map(|pair| Ok((pair, Refinement::new(samples, pair, &target)?))).transpose()?;
    let Some((pair, Some(refinement))) = planned else {
        estimates.values.fill(f64::NAN);
        estimates.errors.fill(f64::NAN);
        estimates.order.fill(0);
        estimates.status.fill(Status::INVALID.bits());
        check_cancelled(watch, total, total)?;
        return Ok(None);
    };
    let mut outputs = DerivativeOutputs { values: estimates.values, errors: estimates.errors, order: estimates.order };
    refinement.estimate(survey.means(), &mut outputs, workers, watch)?;
    let both = boundary::estimate(survey, pair, &target, &mut || check_cancelled(watch, total, total))?;
    for (end, at_end) in both {
        for (place, (&value, &error)) in at_end.values.iter().zip(&at_end.errors).enumerate() {
            let sample = if end == End::First { place } else { samples - 1 - place };
            // Places that the windows at the end do not reach may still be reached by shorter ones inside.
            if !value.is_nan() {
                put(estimates.values, sample, value);
                put(estimates.errors, sample, error);
                put(estimates.order, sample, u8::try_from(at_end.order).unwrap_or(u8::MAX));
            }
        }
    }
    flag(estimates, pair.half);
    let Pair { half, order } = pair;
    Ok(Some(AutomaticChoice { window_length: 2 * half + 1, order }))
}

/// Estimates from all of a record that is a trend.
fn of_trend(trend: &ParabolicTrend, target: &Target<'_>, estimates: &mut AutomaticEstimates<'_>) -> AutomaticChoice {
    let &Target { derivative, highest, fixed, delta, instructions, .. } = target;
    let covariances = &trend.covariances;
    let target = WholeTarget { derivative, highest, fixed, delta, covariances, instructions };
    let samples = estimates.values.len();
    let AutomaticEstimates { values, errors, order, .. } = estimates;
    let order = trend.whole.estimate(&target, &mut DerivativeOutputs { values, errors, order });
    flag(estimates, samples / NEAR_END);
    AutomaticChoice { window_length: samples - (samples + 1) % 2, order }
}

/// Sets the status of all samples, of which some are near an end.
fn flag(estimates: &mut AutomaticEstimates<'_>, near_end: usize) {
    let (good, invalid) = (Status::GOOD.bits(), Status::INVALID.bits());
    for (status, value) in estimates.status.iter_mut().zip(&*estimates.values) {
        *status = if value.is_nan() { invalid } else { good };
    }
    let samples = estimates.status.len();
    for end in [0..near_end, samples.saturating_sub(near_end)..samples] {
        let of_end = estimates.status.get_mut(end).unwrap_or_default();
        for status in of_end {
            *status |= Status::EDGE.bits();
        }
    }
}

/// The step of a quantised signal that the noise does not hide, and how many samples it needs to move by one where it does not rest.
fn samples_per_step(record: &dyn Samples, sigma: f64) -> Option<(f64, f64)> {
    let step = quantisation_step(record);
    if sigma > step / 2.0 {
        return None;
    }
    // How long the signal stayed before it moved, and by how much.
    let (mut samples, mut moves) = (Vec::new(), Vec::new());
    for places in stretches(record.len(), MOST_DIFFERENCES, STRETCHES) {
        samples.resize(places.len(), 0.0);
        record.read(places.start, &mut samples);
        let mut stayed = 0.0;
        for pair in samples.windows(2).filter(|pair| is_usable(pair[0]) && is_usable(pair[1])) {
            stayed += 1.0;
            if pair[1] != pair[0] {
                moves.push((stayed, (pair[1] - pair[0]).abs()));
                stayed = 0.0;
            }
        }
    }
    loop {
        let (time, distance) = moves.iter().fold((0.0, 0.0), |(t, d), (stayed, by)| (t + stayed, d + by));
        let (count, longest) = (moves.len(), REST * time / moves.len() as f64);
        moves.retain(|&(stayed, _)| stayed <= longest);
        if moves.len() == count {
            let each = step * time / distance;
            return each.is_finite().then_some((step, each));
        }
    }
}

/// Half-width of the shortest window that may be tried. Rounding errors are white only if the signal crosses a step or more from sample to
/// sample. If it needs several samples to do so, shorter windows mistake the staircase for signal.
fn shortest_window(samples_per_step: f64, samples: usize) -> usize {
    rounded(STEPS * samples_per_step).clamp(SHORTEST, (samples / 16).max(SHORTEST))
}

/// The density that the error of rounding has at the frequencies of the signal, over that of white noise of its variance.
///
/// The error is a saw of `v/q` teeth a sample where the signal moves by `v`: its `k`-th harmonic, of variance `q²/(2π²k²)`, is spread over
/// the frequencies `kv/q` as `v` is distributed (Woodward 1952), so at low ones the density is
///
/// ```text
/// Σ_k q²/(2π²k²) · (q/k) p(0) = q²/12 · (6 ζ(3)/π²) q p(0) = q²/12 · (6 ζ(3)/π³) q/⟨|v|⟩    for a Gaussian v,
/// ```
///
/// twice that of white noise where a step takes nine samples. Taken for white noise, what is above would count as signal, and the
/// shortest window would seem the best. A signal of several steps a sample folds all frequencies, which makes it white.
fn crowding(samples_per_step: f64) -> f64 {
    (CROWDING * samples_per_step).max(1.0)
}

fn check_cancelled(watch: &mut Watch<'_>, done: usize, total: usize) -> Result<(), Error> {
    if watch(done, total) { Ok(()) } else { Err(Error::Cancelled) }
}

fn put<T>(values: &mut [T], place: usize, value: T) {
    if let Some(slot) = values.get_mut(place) {
        *slot = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::spectrum::power;

    #[test]
    fn rounding_errors_of_a_slow_signal_crowd_at_its_frequencies() {
        // A sum of sines of 2 to 9 cycles in 1000 samples, four steps high: nearly Gaussian, as is its rate.
        let signal: Vec<f64> = (0..1 << 16)
            .map(|i| {
                let sines = (0..15).map(|j| (f64::from(i) * 0.00314 * (4.0 + f64::from(j)) + f64::from(j * j)).sin());
                4.0 * sines.sum::<f64>() * (2.0_f64 / 15.0).sqrt()
            })
            .collect();
        let rounded: Vec<f64> = signal.iter().map(|value| value.round()).collect();
        let error: Vec<f64> = signal.iter().zip(&rounded).map(|(signal, rounded)| rounded - signal).collect();
        let record = rounded.as_slice();
        let (step, each) = samples_per_step(&record, (1.0_f64 / 12.0).sqrt()).expect("a record that was rounded");
        assert!((step - 1.0).abs() < 1e-12);
        // Densities from 0.5 to 1.5 times the highest frequency; 1 is that of white noise.
        let spectrum = power(&error.as_slice(), 4096);
        let band = &spectrum[18..54];
        let density = 12.0 * band.iter().sum::<f64>() / band.len() as f64;
        assert!((crowding(each) / density - 1.0).abs() < 0.15, "{} of {density}", crowding(each));
    }
}
