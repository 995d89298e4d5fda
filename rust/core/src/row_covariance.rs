//! The covariance of rows: known from the noise of both channels, or taken from the residuals.

use crate::test_function::Kernels;
use crate::windows::Correlated;

/// Correlations that exceed their standard deviation so many times are no chance.
const CHANCE: f64 = 5.0;

/// Covariance of rows by their distance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RowCovariance {
    /// By distance in rows, from the variance on.
    pub(crate) lags: Vec<f64>,
}

impl RowCovariance {
    /// What noise of both channels makes of rows `stride` samples apart. `parameters` are inertia, damping and stiffness; the noise is
    /// given by its variance, that of the angle first.
    pub(crate) fn known(
        kernels: &Kernels,
        torque: &[f64],
        parameters: [f64; 3],
        noise: [f64; 2],
        stride: usize,
    ) -> Self {
        let [inertia, damping, stiffness] = &kernels.values;
        let mixed: Vec<f64> = (0..inertia.len())
            .map(|k| parameters[0] * inertia[k] + parameters[1] * damping[k] + parameters[2] * stiffness[k])
            .collect();
        let lags = (0..inertia.len())
            .step_by(stride)
            .map(|lag| noise[0] * products(&mixed, lag) + noise[1] * products(torque, lag));
        Self { lags: lags.collect() }
    }

    /// The covariance that residuals show up to some distance, tapered so that it stays one. Missing residuals are zero.
    pub(crate) fn of_residuals(residuals: &[f64], usable: &[bool], farthest: usize) -> Self {
        let lags = (0..=farthest).map(|lag| {
            let (mut sum, mut count) = (0.0, 0.0_f64);
            for row in lag..residuals.len() {
                if usable[row] && usable[row - lag] {
                    sum += residuals[row] * residuals[row - lag];
                    count += 1.0;
                }
            }
            (1.0 - lag as f64 / (farthest + 1) as f64) * sum / count.max(1.0)
        });
        Self { lags: lags.collect() }
    }

    /// Whether rows so far apart that they share no sample are correlated, by more than a part of the variance and than chance.
    pub(crate) fn is_coloured(&self, reach: usize, part: f64, rows: usize) -> bool {
        let chance = CHANCE * (self.redundancy() / rows.max(1) as f64).sqrt();
        self.lags.iter().skip(reach + 1).any(|lag| lag.abs() > part.max(chance) * self.lags[0])
    }

    /// Variance of a row.
    pub(crate) fn variance(&self) -> f64 {
        self.lags[0]
    }

    /// How many rows stand for one independent row: the sum of the squared correlations.
    pub(crate) fn redundancy(&self) -> f64 {
        let squared = |lag: &f64| (lag / self.lags[0]).powi(2);
        1.0 + 2.0 * self.lags[1..].iter().map(squared).sum::<f64>()
    }

    /// The covariance times a column.
    pub(crate) fn times(&self, column: &[f64]) -> Vec<f64> {
        let mut result: Vec<f64> = column.iter().map(|value| self.lags[0] * value).collect();
        for (lag, &covariance) in self.lags.iter().enumerate().skip(1) {
            if lag >= column.len() {
                break;
            }
            let (early, late) = (&column[..column.len() - lag], &column[lag..]);
            result[..early.len()].iter_mut().zip(late).for_each(|(sum, value)| *sum += covariance * value);
            result[lag..].iter_mut().zip(early).for_each(|(sum, value)| *sum += covariance * value);
        }
        result
    }

    /// The covariance times windowed regressors and their companions, whose times count from their own row.
    pub(crate) fn correlated(&self, windowed: &[&[f64]], companions: &[&[f64]], period: f64) -> Correlated {
        let slope = |value: &[f64], companion: &[f64]| {
            let mut result = self.times(companion);
            for (lag, &covariance) in self.lags.iter().enumerate().skip(1) {
                if lag >= value.len() {
                    break;
                }
                let weight = covariance * lag as f64 * period;
                let (early, late) = (&value[..value.len() - lag], &value[lag..]);
                result[..early.len()].iter_mut().zip(late).for_each(|(sum, value)| *sum += weight * value);
                result[lag..].iter_mut().zip(early).for_each(|(sum, value)| *sum -= weight * value);
            }
            result
        };
        Correlated {
            variance: self.variance(),
            windowed: windowed.iter().map(|value| self.times(value)).collect(),
            companions: windowed.iter().zip(companions).map(|(value, companion)| slope(value, companion)).collect(),
        }
    }
}

/// `Σ_k a(k) a(k + lag)`.
fn products(kernel: &[f64], lag: usize) -> f64 {
    kernel.iter().zip(&kernel[lag..]).map(|(a, b)| a * b).sum()
}
