//! Noise that went through a low-pass filter with the channel: an amplifier's, an anti-alias filter, means of neighbours.
//!
//! Sums of first-order noises fall at most with the square of the frequency, so [`crate::noise::colour`] cannot tell such noise from motion. It is
//! told by what lies below its filter: there it is as flat as white noise, or as a sum of first-order noises, and motion rises from it. So the
//! sum is looked for behind Butterworth filters of some corners and orders,
//!
//! ```text
//! S(ω) = (white + Σ_m a_m …) / (1 + (tan(ω/2) / tan(ω_c/2))^2p),
//! ```
//!
//! behind Gaussian ones or means of neighbouring samples, and the filter is taken that explains most of what is measured. Butterworth's of the first order with a corner
//! of a quarter of the sample rate is the mean of two.
//!
//! The noise must be seen an octave below the corner. Where no motion rises from it, a motion of limited band looks the same: then the corner must be
//! higher than a motion's would be whose derivatives are worth asking for.

use std::cell::LazyCell;
use std::f64::consts::{LN_2, PI};
use std::ops::RangeInclusive;
use std::sync::{Arc, OnceLock};

use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::tables::Kept;
use crate::noise::colour::{FEWEST, Statistic, coloured, corners, explained, measure, missed};
use crate::noise::correlated::CorrelatedNoise;
use crate::noise::transform::Transform;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;

/// The lowest corner in radians a sample, corners in an octave and in all, and the highest order.
const LOWEST: f64 = 0.2;
const EACH_OCTAVE: f64 = 16.0;
const CORNERS: i32 = 57;
const HIGHEST_ORDER: i32 = 4;

/// Means of so many samples, and half of the power they pass, in radians.
const MEANS: RangeInclusive<i32> = 3..=12;
const HALF_OF_MEAN: f64 = 2.78;

/// The least corner of noise that no motion rises from: a seventh of the sample rate.
const ALONE: f64 = 0.9;

/// Filters that are tried on all windows, of those that come near the shortest.
const NEAREST: usize = 12;

/// Times that the lowest frequency at which the noise must be seen lies below the corner.
const BELOW: f64 = 2.0;

/// Windows that a transform is long, at least: what is correlated over more is not told apart.
const TIMES: usize = 4;
const SHORTEST: usize = 512;

/// Frequencies that autocovariances are summed from, and what is left out of the largest.
const FREQUENCIES: usize = 4096;
const NEGLIGIBLE: f64 = 1e-9;

/// What windows take of every noise of variance one, at frequencies from zero to half the sample rate.
type Spectra = Arc<[Vec<f64>]>;

/// What windows take of every noise, behind every filter.
type BehindAll = Arc<[Arc<[f64]>]>;

/// The same where only some filters are asked for.
type BehindSome = Arc<[OnceLock<Arc<[f64]>>]>;

/// By half-width and first degree: spectra, what short windows take behind every filter, and what long ones take behind those that came near. What
/// filters leave counts as so large.
static SPECTRA: Kept<(usize, usize), Spectra> = Kept::new();
static BEHIND: Kept<(usize, usize), BehindAll> = Kept::new();
static BEHIND_NEAR: Kept<(usize, usize), BehindSome> = Kept::new();
const FILTERS: usize = 400;

/// A filter that passes low frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LowPass {
    /// Where half the power passes, in radians a sample.
    corner: f64,
    rolloff: Rolloff,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Rolloff {
    /// Of some order.
    Butterworth(i32),
    /// The mean of so many samples.
    Mean(i32),
    /// Many means after one another, or a smooth weight.
    Gaussian,
}

impl LowPass {
    fn all() -> impl Iterator<Item = Self> {
        let corners = (0..CORNERS).map(|place| LOWEST * (f64::from(place) / EACH_OCTAVE).exp2());
        let of_corner = |corner: f64| {
            let rolloffs = (1..=HIGHEST_ORDER).map(Rolloff::Butterworth).chain([Rolloff::Gaussian]);
            rolloffs.map(move |rolloff| Self { corner, rolloff })
        };
        let mean = |samples: i32| Self { corner: HALF_OF_MEAN / f64::from(samples), rolloff: Rolloff::Mean(samples) };
        corners.flat_map(of_corner).chain(MEANS.map(mean))
    }

    /// What it leaves of a density.
    fn gain(self, frequency: f64) -> f64 {
        match self.rolloff {
            Rolloff::Butterworth(order) => {
                let ratio = (frequency / 2.0).tan() / (self.corner / 2.0).tan();
                1.0 / (1.0 + ratio.powi(2 * order))
            }
            // Sines in place of frequencies: without a bend at half the sample rate autocovariances are few.
            Rolloff::Gaussian => (-LN_2 * ((frequency / 2.0).sin() / (self.corner / 2.0).sin()).powi(2)).exp(),
            Rolloff::Mean(_) if frequency == 0.0 => 1.0,
            Rolloff::Mean(samples) => {
                let samples = f64::from(samples);
                ((samples * frequency / 2.0).sin() / (samples * (frequency / 2.0).sin())).powi(2)
            }
        }
    }

    /// What it leaves of densities at so many frequencies from zero to half the sample rate.
    fn gains(self, frequencies: usize) -> Vec<f64> {
        let last = frequencies.saturating_sub(1).max(1) as f64;
        (0..frequencies).map(|bin| self.gain(PI * bin as f64 / last)).collect()
    }

    /// The autocovariances of white noise of variance one behind it.
    fn autocovariances(self) -> Vec<f64> {
        let gains = self.gains(FREQUENCIES + 1);
        let symmetric: Vec<f64> = gains.iter().chain(gains[1..FREQUENCIES].iter().rev()).copied().collect();
        let sums = Transform::new(2 * FREQUENCIES).of(&symmetric);
        let found: Vec<f64> = sums.iter().map(|[sum, _]| sum / (2 * FREQUENCIES) as f64).collect();
        let last = found.iter().rposition(|one| one.abs() > NEGLIGIBLE * found[0]).unwrap_or(0);
        found[..=last].to_vec()
    }
}

/// The noise of a channel, white, coloured or low-passed, whose variance is given for the case that it is white or that its colour cannot be told.
pub fn coloured_or_low_passed_noise(
    record: &dyn Samples,
    variance: f64,
    instructions: Instructions,
) -> CorrelatedNoise {
    let white = CorrelatedNoise::white(variance);
    let Some(measured) = measure(record, variance, instructions) else { return white };
    let as_it_is = coloured(&measured, record.len()).map(|found| found.noise).filter(|noise| !noise.is_white());
    as_it_is.or_else(|| low_passed(&measured, record.len())).unwrap_or(white)
}

/// The noise that explains what is measured of so many samples behind a filter, or `None`.
fn low_passed(measured: &[Statistic], samples: usize) -> Option<CorrelatedNoise> {
    let (short, long) = measured.split_at_checked(FEWEST)?;
    let kept = |one: &Statistic| BEHIND.try_get(one.key(), FILTERS, || behind_all(one).ok_or(()));
    let short_behind: Vec<BehindAll> = short.iter().map(kept).collect::<Result<_, ()>>().ok()?;
    let beside = |place: usize| short.iter().zip(&short_behind).map(move |(one, all)| one.beside(all[place].clone()));
    let mut filters: Vec<_> = LowPass::all().enumerate().map(|(place, filter)| (place, filter, 0.0)).collect();
    for (place, _, missing) in &mut filters {
        *missing = missed(&beside(*place).collect::<Vec<_>>());
    }
    filters.sort_by(|a, b| a.2.total_cmp(&b.2));
    let spectra_of = |one: &Statistic| SPECTRA.try_get(one.key(), one.half, || spectra(one).ok_or(()));
    let of_long: Vec<Spectra> = long.iter().map(spectra_of).collect::<Result<_, ()>>().ok()?;
    let longest = of_long.iter().map(|spectra| spectra[0].len()).max().unwrap_or(1);
    let none = || (0..filters.len()).map(|_| OnceLock::new()).collect();
    let kept = |one: &Statistic| BEHIND_NEAR.get(one.key(), FILTERS, none);
    let long_behind: Vec<BehindSome> = long.iter().map(kept).collect();
    let judged = |&(place, filter, _): &(usize, LowPass, f64)| {
        let gains = LazyCell::new(|| filter.gains(longest));
        let of =
            |(spectra, some): (&Spectra, &BehindSome)| Arc::clone(some[place].get_or_init(|| behind(spectra, &gains)));
        let behind = long.iter().zip(of_long.iter().zip(&long_behind).map(of)).map(|(one, of)| one.beside(of));
        let statistics: Vec<Statistic> = beside(place).chain(behind).collect();
        let explained = explained(&statistics)?;
        let missed = missed(&statistics[..explained]);
        Some((explained, missed, filter, statistics))
    };
    let nearest = filters.iter().take(NEAREST).filter_map(judged);
    let best = nearest.max_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let (_, _, filter, statistics) = best?;
    let found = coloured(&statistics, samples)?;
    let is_seen = BELOW * found.lowest <= filter.corner && (!found.whole || filter.corner >= ALONE);
    is_seen.then(|| found.noise.behind(filter.autocovariances()))
}

/// What some degrees of a window take of every noise behind every filter.
fn behind_all(one: &Statistic) -> Option<BehindAll> {
    let spectra = spectra(one)?;
    Some(LowPass::all().map(|filter| behind(&spectra, &filter.gains(spectra[0].len()))).collect())
}

/// What is taken of every noise behind a filter of some gains, at as many frequencies as the spectra have or times as many less one.
fn behind(spectra: &[Vec<f64>], gains: &[f64]) -> Arc<[f64]> {
    let step = (gains.len() - 1) / (spectra[0].len() - 1);
    let power = |of: &Vec<f64>| of.iter().zip(gains.iter().step_by(step)).map(|(power, gain)| power * gain).sum();
    spectra.iter().map(power).collect()
}

/// What some degrees of a window take of every noise of variance one, white and then by octave, at frequencies from zero to half the sample rate.
fn spectra(of: &Statistic) -> Option<Spectra> {
    // Windows are short, and little memory is not asked for.
    let basis = Basis::new(2 * of.half + 1, of.degrees.end).ok()?;
    let length = (TIMES * basis.length()).next_power_of_two().max(SHORTEST);
    let transform = Transform::new(length);
    let mut white = vec![0.0; length / 2 + 1];
    for degree in of.degrees.clone() {
        let mut padded: Vec<f64> = (0..basis.length()).map(|index| basis.value(degree, index)).collect();
        padded.resize(length, 0.0);
        for (power, [real, imaginary]) in white.iter_mut().zip(transform.of(&padded)) {
            *power += (real * real + imaginary * imaginary) / of.degrees.len() as f64;
        }
    }
    for (bin, power) in white.iter_mut().enumerate() {
        // All but the first and the last stand for a negative frequency, too.
        *power *= if bin == 0 || bin == length / 2 { 1.0 } else { 2.0 } / length as f64;
    }
    let of_octave = |corner: f64| {
        let noise = CorrelatedNoise::new(0.0, vec![((-corner).exp(), 1.0)]);
        let density = |bin: usize| noise.density(2.0 * PI * bin as f64 / length as f64);
        white.iter().enumerate().map(|(bin, power)| power * density(bin)).collect()
    };
    let octaves: Vec<Vec<f64>> = corners().map(of_octave).collect();
    Some(std::iter::once(white).chain(octaves).collect::<Vec<_>>().into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    /// Means of neighbours, rough enough to be noise and too smooth to be a sum of first-order noises.
    fn smoothed(samples: usize, first: usize) -> Vec<f64> {
        uniform(samples + first + 2)[first..].windows(3).map(|three| three.iter().sum::<f64>()).collect()
    }

    #[test]
    fn what_is_kept_of_a_filter_is_what_gains_at_more_frequencies_give() {
        let of = measure(&smoothed(4000, 0).as_slice(), 0.1, Instructions::current()).expect("noise");
        let spectra = spectra(&of[FEWEST]).expect("little memory");
        let frequencies = spectra[0].len();
        for filter in LowPass::all().step_by(7) {
            let own = behind(&spectra, &filter.gains(frequencies));
            for times in [2, 8] {
                assert_eq!(own, behind(&spectra, &filter.gains(times * (frequencies - 1) + 1)), "{filter:?}");
            }
        }
    }

    #[test]
    fn the_second_call_finds_the_noise_of_the_first() {
        let found = |first: usize| {
            let noise = coloured_or_low_passed_noise(&smoothed(4000, first).as_slice(), 0.1, Instructions::current());
            assert!(!noise.is_white());
            format!("{noise:?}")
        };
        let first = found(0);
        // Other noise keeps other filters.
        assert_ne!(found(100), first);
        assert_eq!(found(0), first);
    }
}
