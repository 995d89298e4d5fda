//! How the noise of an angle enters rows, where the angle was fused from several channels or integrated: by other kernels than the angle itself.
//!
//! White noise that was integrated enters by the sums of the kernel from each sample on. What it adds slowly is no noise of the row: an offset that changes
//! takes it, as it takes the angle's zero. Noise that fusing made smaller at some frequencies enters by the kernel filtered with the square root of what is
//! left there.

use crate::noise::fused::AngleNoise;
use crate::noise::transform::filtered;
use crate::weak_form::test_function::{Kernels, TestFunction, sum};

/// Half-widths beyond the test function over which noise counts as noise of a row rather than as a slow drift, times that fused noise is
/// correlated over and that count too, and rows over which they do at most.
const BEYOND: usize = 3;
const TIMES: f64 = 3.0;
const MOST_ROWS: usize = 128;

/// The kernels by which white noise of variance one enters.
pub(crate) fn entered(kernels: &Kernels, noise: Option<&AngleNoise>, delta: f64) -> Kernels {
    let Some(noise) = noise.filter(|noise| noise.integrations > 0 || !noise.beside.is_empty()) else {
        return kernels.clone();
    };
    let length = kernels.values[0].len();
    let half = length / 2;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most some rows")]
    let long = (TIMES * noise.correlated()).min((MOST_ROWS * TestFunction::stride_of(half)) as f64) as usize;
    let beyond = (BEYOND * half).max(long);
    let taper = |place: usize| {
        // Where the kernel of the angle itself ends, the slow part of its noise begins to fade.
        let outside = (beyond.saturating_sub(place)).max(place.saturating_sub(beyond + length - 1)) as f64;
        0.5 + 0.5 * (std::f64::consts::PI * outside / beyond.max(1) as f64).cos()
    };
    let size = (length + 2 * beyond).next_power_of_two() * 2;
    let gains: Vec<f64> =
        (0..=size / 2).map(|bin| noise.left(2.0 * std::f64::consts::PI * bin as f64 / size as f64)).collect();
    let one = |kernel: &Vec<f64>| {
        let mut wide = vec![0.0; length + 2 * beyond];
        wide[beyond..beyond + length].copy_from_slice(kernel);
        for _ in 0..noise.integrations {
            integrate(&mut wide, delta);
        }
        if !noise.beside.is_empty() {
            wide = filtered(&wide, &gains);
            wide.iter_mut().enumerate().for_each(|(place, value)| *value *= taper(place));
        }
        wide
    };
    Kernels { values: kernels.values.each_ref().map(one), slopes: kernels.slopes.each_ref().map(one) }
}

/// Replaces a kernel by that for the noise before it was integrated: its sums from each sample on, by the trapezoidal rule.
fn integrate(kernel: &mut [f64], delta: f64) {
    let (total, last) = (sum(kernel), (kernel.len() - 1) as f64);
    let mut left = 0.0;
    for (place, value) in kernel.iter_mut().enumerate().rev() {
        let own = *value;
        *value = delta * (left + own / 2.0 - total * (1.0 - place as f64 / last));
        left += own;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::fused::Beside;
    use crate::weak_form::test_function::TestFunction;

    const DELTA: f64 = 1e-3;

    fn dot(one: &[f64], other: &[f64]) -> f64 {
        one.iter().zip(other).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn noise_that_was_integrated_enters_as_its_sums() {
        let kernels = TestFunction::new(20, 5, DELTA).unwrap().kernels(0.0);
        let noise: Vec<f64> =
            (0..161).map(|place| (f64::from(place) * 1.7).sin() + (f64::from(place) * 0.3).cos()).collect();
        let mut angle = vec![0.0; 161];
        for place in 1..161 {
            angle[place] = angle[place - 1] + DELTA * f64::midpoint(noise[place - 1], noise[place]);
        }
        // What an offset takes is a mean of the noise before and after.
        let drift: f64 =
            noise.iter().enumerate().map(|(place, value)| DELTA * value * (1.0 - place as f64 / 160.0)).sum();
        let told = AngleNoise { variance: 1.0, integrations: 1, beside: Vec::new() };
        let found = entered(&kernels, Some(&told), DELTA);
        let pairs = kernels.values.iter().zip(&found.values).chain(kernels.slopes.iter().zip(&found.slopes));
        for (kernel, found) in pairs {
            let expected = dot(kernel, &angle[60..101]) - drift * kernel.iter().sum::<f64>();
            // The first sample of all counts for half in the sums.
            let scale: f64 = kernel.iter().map(|value| value.abs()).sum::<f64>() * DELTA;
            assert!((dot(found, &noise) - expected).abs() < scale, "{} {expected} {scale}", dot(found, &noise));
        }
    }

    #[test]
    fn fused_noise_is_least_where_the_other_channel_tells_most() {
        let kernels = TestFunction::new(100, 9, DELTA).unwrap().kernels(0.0);
        let squares = |kernel: &[f64]| dot(kernel, kernel);
        let velocity = |noise: f64| {
            let beside = vec![Beside { derivative: 1, noise }];
            entered(&kernels, Some(&AngleNoise { variance: 1.0, integrations: 0, beside }), DELTA)
        };
        // A velocity that is so good that the angle tells nothing more of inertia leaves its own noise: `σ_v φ′`, in units of a sample.
        let noise = 1e-3;
        let found = squares(&velocity(noise).values[0]);
        let expected = (noise / DELTA).powi(2) * squares(&kernels.values[1]);
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        // One that tells nothing leaves the angle's, but for what tapers cut off.
        for (kernel, found) in kernels.values.iter().zip(&velocity(1e6).values) {
            assert!((squares(found) / squares(kernel) - 1.0).abs() < 1e-9);
        }
        assert_eq!(entered(&kernels, None, DELTA), kernels);
    }
}
