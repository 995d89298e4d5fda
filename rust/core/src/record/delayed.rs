//! A channel with its delay removed: by whole samples or fractions of a sample.

use crate::record::samples::{Samples, read_around};

/// Neighbours that a fraction of a sample is interpolated from.
const NEIGHBOURS: usize = 8;

/// A channel without its delay: sample `i` is the one recorded `lag` sample periods later.
///
/// Between samples the polynomial through the nearest eight is evaluated. Samples beyond an end are missing.
pub(crate) struct Delayed<'a> {
    channel: &'a dyn Samples,
    /// The first neighbour, relative to the sample.
    first: isize,
    weights: Vec<f64>,
}

impl<'a> Delayed<'a> {
    pub(crate) fn new(channel: &'a dyn Samples, lag: f64) -> Self {
        let whole = lag.floor();
        let part = lag - whole;
        #[allow(clippy::cast_possible_truncation, reason = "a lag of a few samples")]
        let whole = whole as isize;
        if part == 0.0 {
            return Self { channel, first: whole, weights: vec![1.0] };
        }
        let before = NEIGHBOURS.cast_signed() / 2 - 1;
        let place = |neighbour: usize| (neighbour.cast_signed() - before) as f64;
        let factor = |one: usize, other: usize| (part - place(other)) / (place(one) - place(other));
        let weight =
            |one: usize| (0..NEIGHBOURS).filter(|&other| other != one).map(|other| factor(one, other)).product();
        Self { channel, first: whole - before, weights: (0..NEIGHBOURS).map(weight).collect() }
    }
}

impl Samples for Delayed<'_> {
    fn len(&self) -> usize {
        self.channel.len()
    }

    fn read(&self, first: usize, into: &mut [f64]) {
        let mut samples = vec![0.0; into.len() + self.weights.len() - 1];
        read_around(self.channel, first.cast_signed() + self.first, &mut samples);
        for (value, samples) in into.iter_mut().zip(samples.windows(self.weights.len())) {
            *value = samples.iter().zip(&self.weights).map(|(sample, weight)| sample * weight).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_read_between_its_samples() {
        let samples: Vec<f64> = (0..60).map(|i| (f64::from(i) / 10.0).powi(5) - f64::from(i)).collect();
        let channel = samples.as_slice();
        for lag in [0.0, 3.0, -2.0, 0.4, -1.7] {
            let mut found = vec![0.0; 20];
            Delayed::new(&channel, lag).read(20, &mut found);
            for (i, value) in (20..).zip(found) {
                let expected = ((f64::from(i) + lag) / 10.0).powi(5) - (f64::from(i) + lag);
                assert!((value - expected).abs() < 1e-9, "{lag} {i}: {value} {expected}");
            }
        }
    }

    #[test]
    fn what_lies_beyond_an_end_is_missing() {
        let samples: Vec<f64> = (0..10).map(f64::from).collect();
        let mut found = vec![0.0; 10];
        Delayed::new(&samples.as_slice(), 2.0).read(0, &mut found);
        assert_eq!(found[..8], samples[2..]);
        assert!(found[8..].iter().all(|value| value.is_nan()));
    }
}
