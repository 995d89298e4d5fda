//! The colour of the angles' noise: how it is shared by rows of merged equations, and what it adds to products of their columns.
//!
//! Noise that is stronger at low frequencies than at the highest, where a channel's noise is read, would be corrected by too little, and the
//! errors that it makes would be told too small.

use crate::noise::correlated::CorrelatedNoise;
use crate::weak_form::test_function::Kernels;

/// Times by which a first-order noise is forgotten: a twentieth of it is left.
const FORGOTTEN: f64 = 3.0;
/// Lengths of a kernel after which noise counts as forgotten at the latest.
const LONGEST: f64 = 3.0;
/// What is added to the diagonal of products, each column scaled to one, so that rounding leaves a factor.
const ROUNDING: f64 = 1e-13;

/// What noise makes of a kernel's sums: its factor, and the sequence whose product with another kernel, so many samples before, is its share.
pub(crate) fn noisy(noise: &CorrelatedNoise, kernel: &[f64]) -> (f64, Vec<f64>) {
    let mut longer = kernel.to_vec();
    longer.resize(kernel.len() + memory(noise, kernel.len()), 0.0);
    (noise.variance(), noise.correlate(&longer))
}

/// Samples after which noise is forgotten, at most three times the length of a kernel.
pub(crate) fn memory(noise: &CorrelatedNoise, length: usize) -> usize {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few kernels at most")]
    let samples = (FORGOTTEN * noise.memory()).min(LONGEST * length as f64).ceil() as usize;
    samples
}

/// What is taken of a covariance at a distance in samples, where it counts up to some: all of it, but less and less with the distance where noise is
/// remembered for longer. A covariance that ends at once is none: variances of what many rows say would be negative.
pub(crate) fn taper(noise: &CorrelatedNoise, length: usize, distance: usize) -> f64 {
    if FORGOTTEN * noise.memory() <= LONGEST * length as f64 {
        return 1.0;
    }
    1.0 - (distance as f64 / (length + memory(noise, length)) as f64).min(1.0)
}

/// Columns as long as the kernels whose products are those of the kernels with coloured noise between: values first, then slopes.
pub(crate) fn coloured_kernels(noise: &CorrelatedNoise, kernels: &Kernels) -> [[Vec<f64>; 3]; 2] {
    let each: Vec<&Vec<f64>> = kernels.values.iter().chain(&kernels.slopes).collect();
    let (count, length, variance) = (each.len(), each[0].len(), noise.variance());
    let correlated: Vec<Vec<f64>> = each.iter().map(|kernel| noise.correlate(kernel)).collect();
    let product = |i: usize, j: usize| variance * each[i].iter().zip(&correlated[j]).map(|(a, b)| a * b).sum::<f64>();
    let scale: Vec<f64> = (0..count).map(|i| product(i, i).sqrt().max(f64::MIN_POSITIVE)).collect();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for i in 0..count {
        let mut row = vec![0.0; length];
        for j in 0..=i {
            let before: f64 =
                if j < i { (0..j).map(|k| row[k] * rows[j][k]).sum() } else { row[..i].iter().map(|v| v * v).sum() };
            let left = product(i, j) / (scale[i] * scale[j]) - before;
            row[j] = if j < i { left / rows[j][j] } else { left.max(ROUNDING).sqrt() };
        }
        rows.push(row);
    }
    let mut columns =
        rows.into_iter().zip(scale).map(|(row, scale)| row.into_iter().map(|v| v * scale).collect::<Vec<f64>>());
    [(); 2].map(|()| [(); 3].map(|()| columns.next().unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weak_form::test_function::TestFunction;

    #[test]
    fn columns_have_the_products_of_kernels_with_noise_between() {
        let noise = CorrelatedNoise::new(0.1, vec![(0.9, 0.5), (0.5, 0.2)]);
        let kernels = TestFunction::new(9, 5, 1e-3).expect("a test function").kernels(0.0);
        let columns = coloured_kernels(&noise, &kernels);
        let pairs = || [&kernels.values, &kernels.slopes].into_iter().zip(&columns).flat_map(|(a, b)| a.iter().zip(b));
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (one, column) in pairs() {
            for (other, with) in pairs() {
                let exact = noise.variance() * dot(one, &noise.correlate(other));
                let size = (dot(column, column) * dot(with, with)).sqrt();
                assert!((dot(column, with) - exact).abs() < 1e-9 * size, "{exact}");
            }
        }
    }

    #[test]
    fn covariances_that_are_cut_stay_those_of_a_noise() {
        // Noise of density 1/f, about: sums of what many rows say would have negative variances without a taper.
        let first_order = (1..12).map(|octave| (1.0 - 0.5_f64.powi(octave), 1.0)).collect();
        let noise = CorrelatedNoise::new(0.1, first_order);
        let kernel = &TestFunction::new(16, 5, 1e-3).expect("a test function").kernels(0.0).values[2];
        let (variance, noisy) = noisy(&noise, kernel);
        let covariance = |lag: usize| {
            let products = kernel.iter().zip(noisy.get(lag..).unwrap_or_default()).map(|(a, b)| a * b);
            variance * products.sum::<f64>()
        };
        let least = |tapered: bool| {
            let of = |lag: usize| if tapered { taper(&noise, kernel.len(), lag) } else { 1.0 } * covariance(lag);
            let density = |frequency: f64| {
                (1..noisy.len()).map(|lag| 2.0 * of(lag) * (frequency * lag as f64).cos()).sum::<f64>() + of(0)
            };
            (0..200).map(|place| density(std::f64::consts::PI * f64::from(place) / 200.0)).fold(f64::INFINITY, f64::min)
        };
        assert!(least(false) < -1e-3 * covariance(0));
        assert!(least(true) > -1e-9 * covariance(0), "{}", least(true));
    }

    #[test]
    fn noise_reaches_rows_that_share_no_sample() {
        let noise = CorrelatedNoise::new(0.0, vec![(0.9, 2.0)]);
        let (variance, noisy) = noisy(&noise, &[1.0, 1.0]);
        assert_eq!((variance, noisy.len(), memory(&noise, 100)), (2.0, 8, 29));
        assert!((noisy[3] - (0.9_f64.powi(3) + 0.9_f64.powi(2))).abs() < 1e-12);
    }
}
