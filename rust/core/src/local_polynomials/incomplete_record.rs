//! A record with missing samples, and its parts between gaps.

use std::ops::Range;

use crate::record::samples::is_usable;

/// The parts of a record between gaps that are longer than some samples, from the first sample that is there.
pub(crate) fn parts_between_gaps(
    count: usize,
    longest_gap: usize,
    is_there: impl Fn(usize) -> bool,
) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    for sample in (0..count).filter(|&sample| is_there(sample)) {
        match parts.last_mut() {
            Some(part) if sample - part.end <= longest_gap => part.end = sample + 1,
            _ => parts.push(sample..sample + 1),
        }
    }
    parts
}

/// The parts of a record that windows do not reach out of: they go across gaps of at most so many samples, at its ends too.
///
/// The parts that hold a sample are the same wherever the record is cut farther than the longest gap from it.
#[must_use]
pub fn parts_of(samples: &[f64], weights: Option<&[f64]>, longest_gap: usize) -> Vec<Range<usize>> {
    let is_there = |sample: usize| is_usable(samples[sample]) && weights.is_none_or(|weights| weights[sample] > 0.0);
    let mut parts = parts_between_gaps(samples.len(), longest_gap, is_there);
    if let Some(first) = parts.first_mut().filter(|first| first.start <= longest_gap) {
        first.start = 0;
    }
    if let Some(last) = parts.last_mut().filter(|last| samples.len() - last.end <= longest_gap) {
        last.end = samples.len();
    }
    parts
}

/// A record with missing samples.
#[derive(Debug)]
pub struct Incomplete<'a> {
    /// Samples of the record.
    pub samples: &'a [f64],
    /// Weights of the samples: one over the variances of their noise, relative to the others; 0 is a sample that is missing.
    pub weights: Option<&'a [f64]>,
    /// Parts of the record that windows do not reach out of, in order.
    pub parts: &'a [Range<usize>],
    /// Samples that a window must hold.
    pub least: usize,
}

impl Incomplete<'_> {
    /// The weight of a sample, 0 where it is missing.
    pub(crate) fn weight(&self, sample: usize) -> f64 {
        let weight = self.weights.map_or(1.0, |weights| weights[sample]);
        if is_usable(self.samples[sample]) { weight } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of which some are missing.
    fn record() -> (Vec<f64>, Vec<f64>) {
        let is_lost = |sample: usize| sample < 3 || (40..44).contains(&sample) || (60..80).contains(&sample);
        let samples = (0..120).map(|sample| if is_lost(sample) { f64::NAN } else { 1.0 }).collect();
        let weights =
            (0..120).map(|sample| if (100..105).contains(&sample) || sample > 114 { 0.0 } else { 2.0 }).collect();
        (samples, weights)
    }

    #[test]
    fn parts_lie_between_gaps_that_are_longer() {
        let (samples, weights) = record();
        assert_eq!(parts_of(&samples, None, 4), [0..60, 80..120]);
        assert_eq!(parts_of(&samples, None, 2), [3..40, 44..60, 80..120]);
        assert_eq!(parts_of(&samples, Some(&weights), 4), [0..60, 80..100, 105..115]);
        assert_eq!(parts_of(&samples, Some(&weights), 5), [0..60, 80..120]);
        assert!(parts_of(&[f64::NAN; 9], None, 4).is_empty());
    }

    #[test]
    fn the_part_around_a_sample_does_not_change_where_a_record_is_cut_farther_than_the_gap() {
        let (samples, weights) = record();
        for longest in [2, 4, 7] {
            for sample in 0..120 {
                let of = |first: usize, end: usize| {
                    let parts = parts_of(&samples[first..end], Some(&weights[first..end]), longest);
                    parts.into_iter().find(|part| part.contains(&(sample - first)))
                };
                let reach = longest + 5;
                let (first, end) = (sample.saturating_sub(reach), (sample + reach + 1).min(120));
                let near = |part: Option<Range<usize>>, by: usize| {
                    part.map(|part| ((part.start + by).max(sample.saturating_sub(5)), (part.end + by).min(sample + 6)))
                };
                assert_eq!(near(of(0, 120), 0), near(of(first, end), first), "{longest} {sample}");
            }
        }
    }
}
