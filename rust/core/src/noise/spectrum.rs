//! Power spectra: the averaged spectrum of a record.

use std::f64::consts::PI;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::noise::transform::Transform;
use crate::record::samples::{Samples, all_usable, is_usable};

/// The most segments that are averaged, spread over the record: so many, or fewer long ones with so many samples together.
const MOST_SEGMENTS: usize = 256;
const MOST_SAMPLES: usize = 1 << 20;
const FEWEST_SEGMENTS: usize = 32;

/// Segments that a piece of work sums.
const TOGETHER: usize = 16;

/// The power of a record by frequency, so that its mean over all frequencies, both signs, is the mean square: of segments of `length`
/// samples that overlap by half and fade in and out. Unusable samples are bridged by a line, and segments with a majority of them
/// are left out.
///
/// Only the changes are of interest, so the mean of each segment is taken off.
pub(crate) fn power(record: &dyn Samples, length: usize) -> Vec<f64> {
    Segments::new(record, None, length).power().0
}

/// The same from segments that fade in and out more smoothly: a strong motion at low frequencies leaks less into the highest.
pub(crate) fn power_with_little_leakage(record: &dyn Samples, length: usize) -> Vec<f64> {
    let mut segments = Segments::new(record, None, length);
    segments.fade.iter_mut().for_each(|factor| *factor *= *factor);
    segments.energy = segments.fade.iter().map(|factor| factor * factor).sum();
    segments.power().0
}

/// The power from segments without unusable samples only, and their number: a line that bridges samples has no noise. Segments are
/// multiplied by their weight where samples have weights: noise is then that of a sample of weight one.
pub(crate) fn power_of_whole_segments(
    record: &dyn Samples,
    weights: Option<&[f64]>,
    length: usize,
) -> (Vec<f64>, usize) {
    Segments { whole: true, ..Segments::new(record, weights, length) }.power()
}

/// That of all segments with a majority of usable samples, in parallel.
pub(crate) fn power_in_pieces(
    record: &dyn Samples,
    weights: Option<&[f64]>,
    length: usize,
    stages: &mut Stages<'_, '_>,
) -> Result<Vec<f64>, Error> {
    let segments = Segments::new(record, weights, length);
    let pieces = segments.parts().map(|part| Piece { size: part.len(), content: part });
    let sums = stages.map(pieces.collect(), || (), |part, (): &mut ()| segments.sum(part))?;
    Ok(segments.mean(sums.into_iter()).0)
}

/// The segments of a record whose power is averaged.
struct Segments<'a> {
    record: &'a dyn Samples,
    weights: Option<&'a [f64]>,
    length: usize,
    /// How many there are, and samples from one to the next.
    count: usize,
    every: usize,
    fade: Vec<f64>,
    /// The sum of squares of the taper.
    energy: f64,
    transform: Transform,
    /// Whether segments with unusable samples are left out.
    whole: bool,
}

impl<'a> Segments<'a> {
    fn new(record: &'a dyn Samples, weights: Option<&'a [f64]>, length: usize) -> Self {
        let fade: Vec<f64> = (0..length).map(|k| (PI * (k as f64 + 0.5) / length as f64).sin().powi(2)).collect();
        let energy = fade.iter().map(|value| value * value).sum();
        let most = (MOST_SAMPLES / length).clamp(FEWEST_SEGMENTS, MOST_SEGMENTS);
        let last = record.len().checked_sub(length);
        let every = (length / 2).max(last.unwrap_or(0) / most).max(1);
        let count = last.map_or(0, |last| last / every + 1);
        Self { record, weights, length, count, every, fade, energy, transform: Transform::new(length), whole: false }
    }

    /// Segments that are summed together.
    fn parts(&self) -> impl Iterator<Item = Range<usize>> {
        let count = self.count;
        (0..count).step_by(TOGETHER).map(move |first| first..count.min(first + TOGETHER))
    }

    /// The mean power of all segments that count, and their number.
    fn power(&self) -> (Vec<f64>, usize) {
        self.mean(self.parts().map(|part| self.sum(part)))
    }

    /// The sum of the power of some segments, and how many of them count.
    fn sum(&self, segments: Range<usize>) -> (Vec<f64>, usize) {
        let mut sum = vec![0.0; self.length / 2 + 1];
        let mut count = 0;
        let mut samples = vec![0.0; self.length];
        for segment in segments {
            self.record.read(segment * self.every, &mut samples);
            if (self.whole && !all_usable(&samples)) || !bridge(&mut samples) {
                continue;
            }
            let mean = samples.iter().sum::<f64>() / self.length as f64;
            samples.iter_mut().zip(&self.fade).for_each(|(value, fade)| *value = (*value - mean) * fade);
            let energy = self.energy / self.weight(segment);
            for (sum, [real, imaginary]) in sum.iter_mut().zip(self.transform.of(&samples)) {
                *sum += (real * real + imaginary * imaginary) / energy;
            }
            count += 1;
        }
        (sum, count)
    }

    /// One over the variance of a segment's noise, in units of that of samples of weight one.
    fn weight(&self, segment: usize) -> f64 {
        let first = segment * self.every;
        self.weights.map_or(1.0, |weights| mean_weight(&weights[first..first + self.length], &self.fade))
    }

    /// The mean of all segments that count, and their number.
    fn mean(&self, sums: impl Iterator<Item = (Vec<f64>, usize)>) -> (Vec<f64>, usize) {
        let (mut mean, mut all) = (vec![0.0; self.length / 2 + 1], 0);
        for (sum, count) in sums {
            mean.iter_mut().zip(sum).for_each(|(mean, sum)| *mean += sum);
            all += count;
        }
        (mean.into_iter().map(|value| value / all.max(1) as f64).collect(), all)
    }
}

/// One over the mean variance of noise that enters samples with some factors, where their variance is one over their weight. Samples of
/// weight zero are missing, and others stand in for them.
pub(crate) fn mean_weight(weights: &[f64], factors: &[f64]) -> f64 {
    let (mut squares, mut variance) = (0.0, 0.0);
    for (factor, &weight) in factors.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        squares += factor * factor;
        variance += factor * factor / weight;
    }
    if variance > 0.0 { squares / variance } else { 0.0 }
}

/// Bridges unusable samples by a line. Returns whether at least half of the samples are usable.
pub(crate) fn bridge(samples: &mut [f64]) -> bool {
    if samples.iter().all(|&value| is_usable(value)) {
        return true;
    }
    let usable: Vec<usize> = (0..samples.len()).filter(|&place| is_usable(samples[place])).collect();
    let (Some(&first), Some(&last)) = (usable.first(), usable.last()) else { return false };
    for pair in usable.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let (start, slope) = (samples[from], (samples[to] - samples[from]) / (to - from) as f64);
        (from + 1..to).for_each(|place| samples[place] = start + slope * (place - from) as f64);
    }
    let (start, end) = (samples[first], samples[last]);
    samples[..first].fill(start);
    samples[last + 1..].fill(end);
    2 * usable.len() >= samples.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_missing_samples_cost_next_to_nothing() {
        let whole: Vec<f64> = (0..8192).map(|i| (2.0 * PI * 0.01 * f64::from(i)).sin()).collect();
        let mut holed = whole.clone();
        holed.iter_mut().step_by(100).for_each(|value| *value = f64::NAN);
        let total = |samples: &[f64]| power(&samples, 512).iter().sum::<f64>();
        // A line over two samples of 100 a cycle misses the sine by at most half the square of 2π/100.
        assert!((total(&holed) / total(&whole) - 1.0).abs() < 0.5 * (2.0 * PI / 100.0_f64).powi(2));
    }

    #[test]
    fn a_sine_has_its_power_at_its_frequency() {
        let samples: Vec<f64> = (0..4096).map(|i| 3.0 + 2.0 * (2.0 * PI * 0.125 * f64::from(i)).sin()).collect();
        let spectrum = power(&samples.as_slice(), 512);
        let total = 2.0 * spectrum[1..256].iter().sum::<f64>() / 512.0;
        assert!((total - 2.0).abs() < 1e-6, "{total}");
        assert!(2.0 * spectrum[62..=66].iter().sum::<f64>() / 512.0 > 1.999);
    }
}
