//! The noise of a channel, from what no signal reaches: the highest of many polynomials in short windows.
//!
//! In a window of `M` samples white noise of variance `σ²` puts `σ²` into every coefficient `c_j`, while a smooth signal puts next to
//! nothing into those of high degree. So, with windows of half-width 12, 20 and 35,
//!
//! ```text
//! σ² = min over the windows' lengths of the mean of (c_16² + … + c_19²)/4.
//! ```
//!
//! The longest window knows the noise best, the shortest is reached by the least of the signal. Coloured noise is underestimated.
//!
//! A channel that was rounded to a step `q` holds noise of at least `q²/12`, also while it rests and all its coefficients are zero.

use crate::error::Error;
use crate::local_polynomials::basis::{Basis, MOST_DEGREES};
use crate::local_polynomials::coefficients::{Coefficients, Projected};
use crate::noise::spectrum::power_of_whole_segments;
use crate::record::samples::{Samples, is_usable};
use crate::record::subsample::stretches;
use crate::simd::vectors::Instructions;

/// Half-widths of the windows that the noise is read from.
const HALVES: [usize; 3] = [12, 20, 35];

/// The degrees whose coefficients are noise: four of them.
const LOWEST_DEGREE: usize = MOST_DEGREES - 4;

/// The fewest samples that noise can be read from: one of the shortest windows.
pub const FEWEST_SAMPLES: usize = 2 * HALVES[0] + 1;

/// Windows that are looked at, at most: so many know the variance to 0.7 %.
const MOST_WINDOWS: usize = 1 << 17;

/// Differences that a step is sought in, at most, and those that must be whole steps before it is believed.
const MOST_DIFFERENCES: usize = 1 << 12;
const FEWEST_DIFFERENCES: usize = 16;

/// Stretches that a longer record is looked at in.
const STRETCHES: usize = 64;

/// Rounding of differences of numbers of single and of double precision, in units of the largest number. Single precision comes first,
/// since its own last place is a step too.
const PRECISIONS: [f64; 2] = [8.0 * f32::EPSILON as f64, 8.0 * f64::EPSILON];

/// A step must be so many times as large as rounding.
const ABOVE_ROUNDING: f64 = 64.0;

/// Bands of frequencies that are searched for one without signal, samples of a segment whose spectrum is taken, and how many segments a
/// record must hold.
const BANDS: usize = 16;
const SEGMENT: usize = 512;
const FEWEST_SEGMENTS: usize = 8;

/// So many standard deviations are added to the power of the quietest band: of sixteen bands of white noise one is two of them too quiet by chance.
const CHANCE: f64 = 3.0;

/// What a channel's noise is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Its standard deviation: at least that of quantisation and rounding.
    pub sigma: f64,
    /// Step of the quantisation, or zero where there is none.
    pub quantisation: f64,
}

/// The noise of a channel, whose quantisation is looked for where it is not known. NaN where no window is without values that cannot be
/// used.
///
/// Costs `O(n)`, some 60 ns a sample up to 130 000 samples and nothing more beyond.
///
/// # Errors
/// If there are fewer than [`FEWEST_SAMPLES`].
pub fn noise(record: &dyn Samples, quantisation: Option<f64>, instructions: Instructions) -> Result<Noise, Error> {
    let samples = record.len();
    if samples < FEWEST_SAMPLES {
        return Err(Error::RecordTooShort { samples, least: FEWEST_SAMPLES });
    }
    let quantisation = quantisation.unwrap_or_else(|| quantisation_step(record));
    let halves = HALVES.iter().filter(|&half| 2 * half < samples);
    let variance = halves.map(|&half| variance(record, half, instructions)).fold(f64::NAN, f64::min);
    let least = (quantisation * quantisation / 12.0).max((f64::EPSILON * largest(record)).powi(2));
    let sigma = if variance.is_nan() { f64::NAN } else { variance.max(least).sqrt() };
    Ok(Noise { sigma, quantisation })
}

/// The variance of a channel's noise for whoever weighs equations by it: as [`noise`] finds it, but no more than the power in the quietest
/// band of frequencies, which bounds it where a signal with only a few samples a cycle reaches even the shortest windows. Zero for a
/// record that is too short to tell.
pub(crate) fn channel_variance(record: &dyn Samples, quantisation: Option<f64>, instructions: Instructions) -> f64 {
    let Ok(found) = noise(record, quantisation, instructions) else { return 0.0 };
    if found.sigma.is_nan() {
        return 0.0;
    }
    let least = found.quantisation * found.quantisation / 12.0;
    (found.sigma * found.sigma).min(quietest_band(record)).max(least)
}

/// The most that the mean power in the quietest band of frequencies may be, chance aside; infinite for a record that is too short.
fn quietest_band(record: &dyn Samples) -> f64 {
    if record.len() < FEWEST_SEGMENTS * SEGMENT {
        return f64::INFINITY;
    }
    let (power, segments) = power_of_whole_segments(record, SEGMENT);
    if segments == 0 {
        return f64::INFINITY;
    }
    let width = SEGMENT / 2 / BANDS;
    let bands = power[1..].chunks_exact(width);
    let quietest = bands.map(|band| band.iter().sum::<f64>() / band.len() as f64).fold(f64::INFINITY, f64::min);
    // The power at a frequency of a segment scatters by as much as it is.
    quietest * (1.0 + CHANCE / ((segments * width) as f64).sqrt())
}

/// The mean of the squared highest coefficients of windows of one half-width.
fn variance(record: &dyn Samples, half: usize, instructions: Instructions) -> f64 {
    let length = 2 * half + 1;
    let basis = Basis::new(length, MOST_DEGREES);
    let degrees: Vec<usize> = (LOWEST_DEGREE..MOST_DEGREES).collect();
    let plan = Coefficients::new(&basis, &degrees, false, instructions);
    let (mut scratch, mut projected) = (plan.scratch(), Projected::default());
    let (mut sum, mut count) = (0.0, 0);
    for windows in stretches(record.len() + 1 - length, MOST_WINDOWS, STRETCHES) {
        plan.project(record, windows, 1, &mut projected, &mut scratch);
        for row in &projected.coefficients {
            for c in row.iter().filter(|c| !c.is_nan()) {
                sum += c * c;
                count += 1;
            }
        }
    }
    if count == 0 { f64::NAN } else { sum / f64::from(count) }
}

/// The step that all differences of neighbouring samples are multiples of, or zero where there is none.
///
/// Costs nothing to speak of: at most 4096 differences are looked at.
#[must_use]
pub fn quantisation_step(record: &dyn Samples) -> f64 {
    let mut differences = Vec::new();
    let mut largest = 0.0_f64;
    let mut samples = Vec::new();
    for places in stretches(record.len(), MOST_DIFFERENCES, STRETCHES) {
        samples.resize(places.len(), 0.0);
        record.read(places.start, &mut samples);
        let usable = samples.iter().filter(|value| is_usable(**value));
        largest = usable.fold(largest, |largest, value| largest.max(value.abs()));
        differences.extend(samples.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    }
    differences.retain(|&difference| is_usable(difference) && difference > 0.0);
    differences.sort_unstable_by(f64::total_cmp);
    if differences.len() < FEWEST_DIFFERENCES {
        return 0.0;
    }
    let step = |precision: &f64| common_step(&differences, precision * largest);
    PRECISIONS.iter().find_map(step).unwrap_or(0.0)
}

/// The largest step of which all differences, in rising order, are multiples within rounding: Euclid's algorithm for numbers that
/// are rounded.
fn common_step(differences: &[f64], rounding: f64) -> Option<f64> {
    let mut step = *differences.first()?;
    'smaller: loop {
        if step < ABOVE_ROUNDING * rounding {
            return None;
        }
        // The larger the multiple, the better it knows the step.
        let mut known = step;
        for &difference in differences {
            let multiple = (difference / known).round();
            let rest = (difference - multiple * known).abs();
            if rest > rounding {
                step = rest;
                continue 'smaller;
            }
            known = difference / multiple;
        }
        return Some(known);
    }
}

/// The largest number of a record in magnitude, as far as it can be used.
fn largest(record: &dyn Samples) -> f64 {
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

    /// Numbers between -0.5 and 0.5 of variance 1/12.
    fn uniform(count: usize) -> Vec<f64> {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    #[allow(clippy::cast_possible_truncation, reason = "that is what is tested")]
    fn a_step_is_found_in_double_and_single_precision_and_with_an_offset() {
        for step in [1.0, 0.1, std::f64::consts::TAU / 4096.0] {
            let whole: Vec<f64> =
                (0..3000).map(|i| (100.0 * (f64::from(i) * 0.01).sin()).round() * step + 7.3).collect();
            let single: Vec<f64> = whole.iter().map(|&value| f64::from(value as f32)).collect();
            assert!((quantisation_step(&whole.as_slice()) / step - 1.0).abs() < 1e-9);
            assert!((quantisation_step(&single.as_slice()) / step - 1.0).abs() < 1e-3);
        }
    }

    /// 6000 samples tell the variance to 5 to 8 %, by the length of the windows, and the smallest of three such is some 3 % too small; 20 of them
    /// tell that to 2 %. The quietest of sixteen bands would be 13 % too small.
    #[test]
    fn the_quietest_band_of_white_noise_is_no_bound() {
        let samples = uniform(20 * 6000);
        let variances =
            samples.chunks_exact(6000).map(|one| 12.0 * channel_variance(&one, None, Instructions::current()));
        let mean = variances.sum::<f64>() / 20.0;
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
    }

    #[test]
    fn steps_that_are_never_single_are_found_too() {
        // Differences of 6, 10 and 15 steps have nothing in common but one.
        let mut level = 0.0;
        let samples: Vec<f64> = (0..90)
            .map(|i| {
                level += [6.0, -10.0, 15.0][i % 3] * 0.01;
                level
            })
            .collect();
        assert!((quantisation_step(&samples.as_slice()) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn jumps_of_a_quiet_record_are_no_steps() {
        let quiet: Vec<f64> =
            uniform(500).iter().enumerate().map(|(i, e)| 1e-7 * e + f64::from(u8::from(i % 20 == 0))).collect();
        assert_eq!(quantisation_step(&quiet.as_slice()), 0.0);
    }

    #[test]
    fn nothing_is_found_where_there_is_no_step() {
        assert_eq!(quantisation_step(&uniform(5000).as_slice()), 0.0);
        assert_eq!(quantisation_step(&[3.0; 100].as_slice()), 0.0);
        assert_eq!(quantisation_step(&[f64::NAN; 100].as_slice()), 0.0);
        assert_eq!(quantisation_step(&[].as_slice()), 0.0);
    }
}
