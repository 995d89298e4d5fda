//! Polynomials that are orthonormal on the samples of one window, whatever their times: the QR decomposition of its design.
//!
//! Column `j + 1` of `Q` is column `j` times the time, made orthogonal to those before it (Stieltjes 1884; as a QR decomposition "Vandermonde with
//! Arnoldi", Brubeck, Nakatsukasa, Trefethen 2021). On a line only the last two columns are not orthogonal beforehand, but for rounding, which grows where
//! the degree is more than twice the root of the number of samples: there all columns are taken off, twice.

/// Below so many times the root of the number of samples rounding leaves columns orthogonal (Björck, Numerical methods for least squares problems, 8.2).
const STABLE: f64 = 1.8;

/// What is left of a column that depends on the ones before it; of samples with weights some may hardly count.
const DEPENDENT: f64 = 1e-13;
const HARDLY_THERE: f64 = 1e-6;

/// Partial sums of a product, so that the compiler can take several at once.
const SUMS: usize = 8;

/// Memory of one thread.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnBasis {
    samples: usize,
    /// The polynomial of degree zero.
    constant: f64,
    /// Columns of `Q`, one after the other; where samples have weights, times their roots.
    columns: Vec<f64>,
    /// What was taken off each column, and what it was divided by: `h[j][m]`, `m ≤ j + 1`.
    steps: Vec<Vec<f64>>,
}

impl OwnBasis {
    /// Makes the basis of at most so many polynomials at some times, of samples that have the roots of their weights, or all count alike.
    pub(crate) fn make(&mut self, times: &[f64], roots: Option<&[f64]>, degrees: usize) {
        let samples = times.len();
        self.samples = samples;
        self.constant = roots.map_or(samples as f64, |roots| dot(roots, roots)).sqrt().recip();
        self.columns.clear();
        match roots {
            Some(roots) => self.columns.extend(roots.iter().map(|root| root * self.constant)),
            None => self.columns.resize(samples, self.constant),
        }
        self.steps.clear();
        let stable = roots.is_none() && degrees as f64 <= STABLE * (samples as f64).sqrt();
        let dependent = if roots.is_none() { DEPENDENT } else { HARDLY_THERE };
        for degree in 1..degrees.min(samples) {
            let (before, last) = self.columns.split_at((degree - 1) * samples);
            let mut next: Vec<f64> = last.iter().zip(times).map(|(value, time)| value * time).collect();
            let whole = dot(&next, &next).sqrt();
            let mut taken = vec![0.0; degree + 1];
            let from = if stable { degree.saturating_sub(2) } else { 0 };
            for _ in 0..if stable { 1 } else { 2 } {
                for (place, taken) in taken.iter_mut().enumerate().take(degree).skip(from) {
                    let column =
                        if place + 1 == degree { last } else { &before[place * samples..(place + 1) * samples] };
                    let part = dot(&next, column);
                    next.iter_mut().zip(column).for_each(|(value, column)| *value -= part * column);
                    *taken += part;
                }
            }
            let length = dot(&next, &next).sqrt();
            if length <= dependent * whole {
                return;
            }
            for value in &mut next {
                *value /= length;
            }
            taken[degree] = length;
            self.columns.append(&mut next);
            self.steps.push(taken);
        }
    }

    /// Coefficients of some samples; what is left of the samples takes their place.
    pub(crate) fn project(&self, samples: &mut [f64]) -> Vec<f64> {
        let project = |column: &[f64]| {
            let part = dot(samples, column);
            samples.iter_mut().zip(column).for_each(|(value, column)| *value -= part * column);
            part
        };
        self.columns.chunks_exact(self.samples).map(project).collect()
    }

    /// Every polynomial and its derivatives at a time: by derivative, then by degree.
    pub(crate) fn at(&self, time: f64, derivatives: usize) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = Vec::with_capacity(derivatives + 1);
        for derivative in 0..=derivatives {
            let mut values = Vec::with_capacity(self.steps.len() + 1);
            values.push(if derivative == 0 { self.constant } else { 0.0 });
            for (degree, taken) in self.steps.iter().enumerate() {
                let slope = if derivative == 0 { 0.0 } else { derivative as f64 * all[derivative - 1][degree] };
                let off: f64 = taken[..=degree].iter().zip(&values).map(|(taken, value)| taken * value).sum();
                values.push((time * values[degree] + slope - off) / taken[degree + 1]);
            }
            all.push(values);
        }
        all
    }
}

/// The product of two sequences.
pub(crate) fn dot(one: &[f64], other: &[f64]) -> f64 {
    let (ones, others) = (one.chunks_exact(SUMS), other.chunks_exact(SUMS));
    let rest: f64 = ones.remainder().iter().zip(others.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; SUMS];
    for (one, other) in ones.zip(others) {
        for ((sum, a), b) in sums.iter_mut().zip(one).zip(other) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_orthonormal_at_any_times() {
        for (samples, degrees) in [(5, 4), (17, 16), (51, 16), (201, 16), (400, 16)] {
            let shift = |place: usize| 0.4 * (2.3 * place as f64).sin();
            let half = (samples - 1) as f64 / 2.0;
            let times: Vec<f64> = (0..samples).map(|place| (place as f64 + shift(place)) / half - 1.0).collect();
            let uneven: Vec<f64> = (0..samples).map(|place| (3.0 * (1.7 * place as f64).sin()).exp()).collect();
            for roots in [None, Some(&uneven[..])] {
                assert_orthonormal(&times, roots, degrees);
            }
        }
    }

    /// Whether all columns of the basis at some times are orthonormal, and the polynomials at their times.
    fn assert_orthonormal(times: &[f64], roots: Option<&[f64]>, degrees: usize) {
        let samples = times.len();
        let mut basis = OwnBasis::default();
        basis.make(times, roots, degrees);
        assert_eq!(basis.steps.len() + 1, degrees);
        let columns: Vec<&[f64]> = basis.columns.chunks_exact(samples).collect();
        for (i, one) in columns.iter().enumerate() {
            for (j, other) in columns.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((dot(one, other) - expected).abs() < 1e-11, "{samples} samples, {i} and {j}");
            }
        }
        for (place, &time) in times.iter().enumerate() {
            for (degree, value) in basis.at(time, 0)[0].iter().enumerate() {
                let column = value * roots.map_or(1.0, |roots| roots[place]);
                assert!((column - columns[degree][place]).abs() < 1e-9, "{samples} samples, degree {degree}");
            }
        }
    }
}
