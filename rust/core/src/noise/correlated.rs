//! Coloured noise as a sum of white noise and of noises that forget exponentially.
//!
//! A first-order noise has the autocovariance `a ρ^|l|`. Sums of several of them with `a ≥ 0`, their memories doubled from one to the next,
//! come near every spectrum that falls at most with the square of the frequency: autoregressive noise of the first order, and noise of
//! density `1/f` (a sum of relaxations, as Bernamont found it in resistors in 1937). A sequence is multiplied by such a covariance
//! matrix in two recursions. All of them may have gone through one filter, whose autocovariances are few: those of the noise are convolved with them.

/// What is left of a correlation over a mean of samples, if means next to each other share nothing.
const FORGOTTEN: f64 = 1e-9;

/// White noise and first-order noises, as they are or behind a filter.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrelatedNoise {
    white: f64,
    /// `ρ` and `a` of each.
    first_order: Vec<(f64, f64)>,
    /// Autocovariances of white noise of variance one behind the filter, from lag zero on; none without a filter.
    filter: Vec<f64>,
}

impl CorrelatedNoise {
    /// White noise of some variance.
    #[must_use]
    pub fn white(variance: f64) -> Self {
        Self::new(variance, Vec::new())
    }

    /// White noise and noises with the autocovariances `variance · correlation^|lag|`, given as correlation and variance.
    #[must_use]
    pub fn new(white: f64, first_order: Vec<(f64, f64)>) -> Self {
        Self { white, first_order, filter: Vec::new() }
    }

    /// The same noise behind a filter, which makes such autocovariances of white noise of variance one.
    pub(crate) fn behind(self, filter: Vec<f64>) -> Self {
        Self { filter, ..self }
    }

    /// The variance of a sample.
    #[must_use]
    pub fn variance(&self) -> f64 {
        let Some((&own, others)) = self.filter.split_first() else {
            return self.white + self.first_order.iter().map(|(_, variance)| variance).sum::<f64>();
        };
        let of = |&(correlation, variance): &(f64, f64)| {
            let others = others.iter().rev().fold(0.0, |sum, other| correlation * (sum + other));
            variance * (own + 2.0 * others)
        };
        self.white * own + self.first_order.iter().map(of).sum::<f64>()
    }

    /// Whether samples are independent.
    #[must_use]
    pub fn is_white(&self) -> bool {
        self.first_order.is_empty() && self.filter.is_empty()
    }

    /// Of noises that went through no filter, the noise whose covariances are the means of those of some noises.
    pub(crate) fn mean(noises: &[&Self]) -> Self {
        let share = 1.0 / noises.len().max(1) as f64;
        let mut mean = Self::white(noises.iter().map(|noise| share * noise.white).sum());
        for &(correlation, variance) in noises.iter().flat_map(|noise| &noise.first_order) {
            match mean.first_order.iter_mut().find(|(other, _)| *other == correlation) {
                Some((_, sum)) => *sum += share * variance,
                None => mean.first_order.push((correlation, share * variance)),
            }
        }
        mean
    }

    /// The same white noise with a part of the others.
    pub(crate) fn with_part(&self, part: f64) -> Self {
        let first_order = self.first_order.iter().map(|&(correlation, variance)| (correlation, part * variance));
        let first_order = if part > 0.0 { first_order.collect() } else { Vec::new() };
        Self { white: self.white, first_order, filter: self.filter.clone() }
    }

    /// Samples over which the slowest of the noises falls to a part of `1/e`.
    pub(crate) fn memory(&self) -> f64 {
        self.first_order.iter().map(|(correlation, _)| -1.0 / correlation.abs().ln()).fold(0.0, f64::max)
    }

    /// The density at an angular frequency per sample: that of white noise is its variance.
    #[must_use]
    pub fn density(&self, frequency: f64) -> f64 {
        let of = |&(correlation, variance): &(f64, f64)| {
            variance * (1.0 - correlation * correlation)
                / (1.0 + correlation * correlation - 2.0 * correlation * frequency.cos())
        };
        let before = self.white + self.first_order.iter().map(of).sum::<f64>();
        let Some((own, others)) = self.filter.split_first() else { return before };
        let others: f64 = others.iter().zip(1..).map(|(other, lag)| other * (frequency * f64::from(lag)).cos()).sum();
        before * (own + 2.0 * others).max(0.0)
    }

    /// The product of the matrix of correlations (its diagonal is one) and a sequence.
    pub(crate) fn correlate(&self, sequence: &[f64]) -> Vec<f64> {
        if self.is_white() {
            return sequence.to_vec();
        }
        let total = self.variance();
        let Some((own, others)) = self.filter.split_first() else { return self.before_filter(sequence, total) };
        let (reach, length) = (others.len(), sequence.len());
        let mut padded = vec![0.0; length + 2 * reach];
        padded[reach..reach + length].copy_from_slice(sequence);
        let before = self.before_filter(&padded, total);
        let mut product: Vec<f64> = before[reach..reach + length].iter().map(|value| own * value).collect();
        for (other, lag) in others.iter().zip(1..) {
            let (earlier, later) = (&before[reach - lag..], &before[reach + lag..]);
            for ((product, one), two) in product.iter_mut().zip(earlier).zip(later) {
                *product += other * (one + two);
            }
        }
        product
    }

    /// The product of the matrix of covariances of the means of so many neighbouring samples, side by side, and a sequence.
    pub(crate) fn covariances_of_means(&self, sequence: &[f64], step: usize) -> Vec<f64> {
        if !self.filter.is_empty() && step > 1 {
            let share = 1.0 / step as f64;
            let at_samples = sequence.iter().flat_map(|value| std::iter::repeat_n(share * value, step));
            let product = self.correlate(&at_samples.collect::<Vec<f64>>());
            return product.chunks_exact(step).map(|part| share * self.variance() * part.iter().sum::<f64>()).collect();
        }
        let of_means = if step > 1 { &self.of_means(step) } else { self };
        let variance = of_means.variance();
        of_means.correlate(sequence).into_iter().map(|product| variance * product).collect()
    }

    /// The noise of such means, without a filter: `ρ^r` from one to the next, and what the variance has less than their covariances promise.
    fn of_means(&self, step: usize) -> Self {
        let (count, mut of_means) = (step as f64, Self::white(self.white / step as f64));
        for &(correlation, variance) in &self.first_order {
            let share = variance / count;
            // Of a mean alone: a/r² Σ (r - |l|) ρ^|l|, up to what is forgotten within a mean.
            let long_run = share * (1.0 + correlation) / (1.0 - correlation);
            let power = correlation.abs().powf(count);
            if power < FORGOTTEN {
                of_means.white += long_run;
                continue;
            }
            let next = if correlation < 0.0 && step % 2 == 1 { -power } else { power };
            let beside = (1.0 - next) / (1.0 - correlation);
            let own = long_run - 2.0 * share * correlation * beside / ((1.0 - correlation) * count);
            let neighbours = share * correlation * beside * beside / (count * next);
            of_means.first_order.push((next, neighbours));
            of_means.white += own - neighbours;
        }
        of_means
    }

    /// The product of the covariances before the filter, over some variance, and a sequence.
    fn before_filter(&self, sequence: &[f64], total: f64) -> Vec<f64> {
        let mut product: Vec<f64> = sequence.iter().map(|value| value * (self.white / total)).collect();
        for &(correlation, variance) in &self.first_order {
            let share = variance / total;
            let mut sum = 0.0;
            for (product, value) in product.iter_mut().zip(sequence) {
                sum = correlation * sum + value;
                *product += share * sum;
            }
            // The recursion backwards begins with what comes after: a sample itself counted above.
            let mut sum = 0.0;
            for (product, value) in product.iter_mut().zip(sequence).rev() {
                *product += share * correlation * sum;
                sum = correlation * sum + value;
            }
        }
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_is_multiplied_by_the_matrix_of_correlations() {
        let noise = CorrelatedNoise::new(1.0, vec![(0.5, 2.0), (0.9, 1.0)]);
        assert_eq!(noise.variance(), 4.0);
        let sequence: [f64; 6] = [1.0, -2.0, 0.5, 0.0, 3.0, -1.0];
        for (i, found) in noise.correlate(&sequence).into_iter().enumerate() {
            let row = (0..6).map(|j| {
                let lag = i32::try_from(i.abs_diff(j)).unwrap_or(i32::MAX);
                let white = if lag == 0 { 1.0 } else { 0.0 };
                sequence[j] * (white + 2.0 * 0.5_f64.powi(lag) + 0.9_f64.powi(lag)) / 4.0
            });
            assert!((found - row.sum::<f64>()).abs() < 1e-14, "row {i}");
        }
        assert_eq!(CorrelatedNoise::white(9.0).correlate(&sequence), sequence);
    }

    #[test]
    fn the_mean_of_noises_has_the_mean_of_their_covariances() {
        let [one, other] = [vec![(0.5, 2.0), (0.9, 1.0)], vec![(0.9, 3.0)]].map(|each| CorrelatedNoise::new(1.0, each));
        let mean = CorrelatedNoise::mean(&[&one, &other]);
        assert_eq!(mean, CorrelatedNoise::new(1.0, vec![(0.5, 1.0), (0.9, 2.0)]));
        assert!((mean.memory() + 0.9_f64.ln().recip()).abs() < 1e-12);
        assert_eq!(CorrelatedNoise::white(2.0).memory(), 0.0);
        assert_eq!(mean.with_part(0.5), CorrelatedNoise::new(1.0, vec![(0.5, 0.5), (0.9, 1.0)]));
        assert!(mean.with_part(0.0).is_white());
    }

    #[test]
    fn means_are_correlated_as_the_samples_that_they_are_made_of() {
        let noise = CorrelatedNoise::new(0.3, vec![(0.05, 1.0), (0.8, 2.0), (0.999, 1.0), (-0.7, 1.5)]);
        let sequence: Vec<f64> = (0..40).map(|i| (f64::from(i) * 0.1).cos()).collect();
        for noise in [noise.clone(), noise.behind(vec![0.5, 0.25])] {
            for step in [1, 3, 9, 27] {
                let at_samples: Vec<f64> =
                    sequence.iter().flat_map(|value| std::iter::repeat_n(value / step as f64, step)).collect();
                let product = noise.correlate(&at_samples);
                let found = noise.covariances_of_means(&sequence, step);
                for (index, (found, part)) in found.iter().zip(product.chunks(step)).enumerate() {
                    let expected = noise.variance() * part.iter().sum::<f64>() / step as f64;
                    // Of what is forgotten within a mean only the density at low frequencies is known.
                    let allowed = if index == 0 || index == 39 { 0.02 } else { 2e-3 };
                    assert!((found / expected - 1.0).abs() < allowed, "{step}, {index}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn behind_a_filter_covariances_are_convolved_with_its_own() {
        let noise = CorrelatedNoise::new(0.5, vec![(0.6, 2.0)]);
        // Means of two neighbours.
        let filtered = noise.clone().behind(vec![0.5, 0.25]);
        let before = |lag: i32| if lag == 0 { 2.5 } else { 2.0 * 0.6_f64.powi(lag.abs()) };
        let after = |lag: i32| 0.5 * before(lag) + 0.25 * (before(lag - 1) + before(lag + 1));
        assert!((filtered.variance() - after(0)).abs() < 1e-14);
        let sequence: [f64; 5] = [1.0, -2.0, 0.5, 0.0, 3.0];
        for (i, found) in (0..).zip(filtered.correlate(&sequence)) {
            let row: f64 = (0..).zip(sequence).map(|(j, value)| value * after(i - j)).sum();
            assert!((found - row / after(0)).abs() < 1e-14, "row {i}");
        }
        for frequency in [0.0, 0.7, 3.0_f64] {
            let expected = noise.density(frequency) * (frequency / 2.0).cos().powi(2);
            assert!((filtered.density(frequency) - expected).abs() < 1e-14);
        }
        assert!(!CorrelatedNoise::white(1.0).behind(vec![0.5, 0.25]).is_white());
    }

    #[test]
    fn the_density_is_the_transform_of_the_autocovariance() {
        let noise = CorrelatedNoise::new(0.3, vec![(0.8, 1.0)]);
        for frequency in [0.0, 0.1, 1.0, 3.0] {
            let sum: f64 = (1..400).map(|lag| 2.0 * 0.8_f64.powi(lag) * (frequency * f64::from(lag)).cos()).sum();
            assert!((noise.density(frequency) - (1.3 + sum)).abs() < 1e-12);
        }
    }
}
