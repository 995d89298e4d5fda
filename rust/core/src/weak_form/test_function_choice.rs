//! The choice of the test function: the half-width and exponent with the smallest error of inertia, damping and stiffness.
//!
//! From the spectrum `P` of the angle and the noise of both channels, the covariance of the three and two kinds of bias
//! follow for any test function. With `F = (φ̂, -φ̂′, φ̂″)` the responses of its kernels, the noise of a row is
//! `S = σ_T²|F_0|² + σ_θ²|K F_0 + C F_1 + I F_2|²`. With `A = Σ F*Fᵀ P` and `M = Σ F*Fᵀ P S` the covariance is `A⁻¹ M A⁻¹`.
//! The first bias is the difference between `φ″` and `-φ′` and the derivatives of `φ` at the sampled frequencies. The
//! second is a tenth of what the noise of the angle adds to `A`, which is assumed to remain after the correction. The
//! choice minimises the determinant of the sum.

use faer::Mat;
use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::noise::fused::AngleNoise;
use crate::noise::transform::Transform;
use crate::weak_form::test_function::{LEAST_HALF_WIDTH, TestFunction};

/// Exponents tried.
const EXPONENTS: [usize; 2] = [5, 9];

/// The share of the angle's noise that is assumed to remain after its correction.
const LEFT_BY_CORRECTION: f64 = 0.1;

/// A frequency holds signal if its power exceeds that of the noise so many times: the mean of as few as three segments
/// does so by chance once in ten million.
const ABOVE_NOISE: f64 = 8.0;

/// The data that the choice is made from.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    /// The angle's power by frequency.
    pub(crate) power: Vec<f64>,
    /// Samples of the record.
    pub(crate) samples: usize,
    /// Variance of the noise of angle and torque.
    pub(crate) noise: [f64; 2],
    /// Variance of the angle's noise by frequency, where it is not white.
    pub(crate) coloured: Option<Vec<f64>>,
    /// Seconds from one sample to the next.
    pub(crate) delta: f64,
    /// Which of inertia, damping and stiffness are unknown.
    pub(crate) unknown: [bool; 3],
}

impl Evidence {
    /// Variance of the angle's noise at a frequency.
    fn noise_at(&self, bin: usize) -> f64 {
        self.coloured.as_ref().map_or(self.noise[0], |coloured| coloured[bin])
    }

    /// The evidence of an angle whose noise is not white.
    pub(crate) fn with_noise(mut self, noise: Option<&AngleNoise>) -> Self {
        let step = AngleNoise::lowest(2 * (self.power.len() - 1));
        // Nothing is known of the zero of what was integrated.
        let at = |noise: &AngleNoise, bin: usize| noise.power(step * bin.max(1) as f64, self.delta);
        self.coloured = noise.map(|noise| (0..self.power.len()).map(|bin| at(noise, bin)).collect());
        self
    }

    /// The evidence of an angle that shows motion up to a frequency, in cycles per sample, and nothing but noise above: as much noise below as just there.
    pub(crate) fn with_motion_until(mut self, frequency: f64) -> Self {
        let length = 2 * (self.power.len() - 1);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the bins")]
        let first = ((frequency * length as f64).ceil() as usize).clamp(1, self.power.len() - 1);
        let above = &self.power[first..(first + first.div_ceil(4)).min(self.power.len())];
        let level = (above.iter().sum::<f64>() / above.len() as f64).max(self.noise[0]);
        let below = self.power[..first].iter().map(|&power| level.min(power));
        self.coloured = Some(below.chain(self.power[first..].iter().copied()).collect());
        self
    }

    /// Samples in a typical cycle of the signal, by the mean frequency of its velocity.
    pub(crate) fn period(&self) -> f64 {
        let length = 2 * (self.power.len() - 1);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (bin, &power) in self.power.iter().enumerate().skip(1) {
            let frequency = bin as f64 / length as f64;
            // Power that scatters about the noise does not count: high frequencies are many and weigh most.
            let noise = self.noise_at(bin);
            let signal = if power > ABOVE_NOISE * noise { power - noise } else { 0.0 };
            let weight = signal * frequency * frequency;
            sum += weight * frequency;
            weights += weight;
        }
        if sum > 0.0 { weights / sum } else { length as f64 }
    }
}

/// Length of spectra that resolve test functions up to a half-width.
pub(crate) fn spectrum_length(samples: usize, widest: usize) -> usize {
    let wanted = (8 * (2 * widest + 1)).next_power_of_two();
    let possible = 1 << samples.max(1).ilog2();
    wanted.min(possible).max(16)
}

/// Half-widths tried, in steps of √2, up to a number of samples.
pub(crate) fn half_widths(widest: usize) -> Vec<usize> {
    let mut widths = Vec::new();
    let mut width = LEAST_HALF_WIDTH as f64;
    while width.round() <= widest as f64 {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand at most")]
        let whole = width.round() as usize;
        if widths.last() != Some(&whole) {
            widths.push(whole);
        }
        width *= std::f64::consts::SQRT_2;
    }
    widths
}

/// The test functions that are tried, with all that does not depend on the parameters.
pub(crate) struct Candidates {
    evidence: Evidence,
    tried: Vec<Tried>,
}

struct Tried {
    function: TestFunction,
    /// Responses of the kernels for inertia, damping and stiffness, by frequency, within their passband: real, imaginary, real.
    responses: [Vec<f64>; 3],
    /// Products of the kernels with each other.
    gram: [[f64; 3]; 3],
    /// The usable share of its rows.
    share: f64,
}

/// The passband ends where the response falls below this share of its maximum.
const NOTHING: f64 = 1e-9;

impl Candidates {
    /// Test functions of some half-widths, and of one exponent or all that are tried.
    ///
    /// `share` gives the share of a half-width's rows without a missing sample.
    pub(crate) fn new(
        evidence: Evidence,
        widths: &[usize],
        exponent: Option<usize>,
        share: impl Fn(usize) -> f64 + Sync,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Self, Error> {
        let exponents = exponent.map_or_else(|| EXPONENTS.to_vec(), |exponent| vec![exponent]);
        let length = 2 * (evidence.power.len() - 1);
        let functions = exponents.iter().flat_map(|&exponent| {
            let delta = evidence.delta;
            widths.iter().filter_map(move |&width| TestFunction::new(width, exponent, delta).ok())
        });
        let transform = Transform::new(length);
        let pieces = functions.map(|function| Piece { size: 1, content: function });
        let of = |function: TestFunction, (): &mut ()| Tried::new(function, &transform, share(function.half_width()));
        let tried = stages.map(pieces.collect(), || (), of)?;
        Ok(Self { evidence, tried })
    }

    /// The test function with the smallest error for given inertia, damping and stiffness, the narrowest of equals, or
    /// `None` if every one is dominated by the noise of the angle.
    pub(crate) fn best(&self, parameters: [f64; 3]) -> Option<TestFunction> {
        let scores: Vec<f64> = self.tried.iter().map(|tried| tried.score(&self.evidence, parameters)).collect();
        let least = scores.iter().copied().fold(f64::INFINITY, f64::min);
        let good = self.tried.iter().zip(&scores).filter(|(_, score)| **score <= least && score.is_finite());
        good.map(|(tried, _)| tried.function).min_by_key(TestFunction::half_width)
    }
}

impl Tried {
    fn new(function: TestFunction, transform: &Transform, share: f64) -> Self {
        let kernels = function.kernels(0.0).values;
        // The kernels of inertia and stiffness are even and so have real responses, that of damping is odd.
        let [inertia, damping, stiffness] = &kernels;
        let inertia = transform.response(inertia).into_iter().map(|[real, _]| real).collect();
        let second = function.half_width() as f64 * function.delta();
        let both: Vec<f64> = stiffness.iter().zip(damping).map(|(even, odd)| even + second * odd).collect();
        let both = transform.response(&both);
        let (damping, stiffness) = both.into_iter().map(|[real, imaginary]| (imaginary / second, real)).unzip();
        let mut responses: [Vec<f64>; 3] = [inertia, damping, stiffness];
        let through = |response: &[f64]| {
            let largest = response.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
            response.iter().rposition(|value| value.abs() > NOTHING * largest).map_or(0, |last| last + 1)
        };
        let bins = responses.iter().map(|response| through(response)).max().unwrap_or(0);
        for response in &mut responses {
            response.truncate(bins);
        }
        let dot = |i: usize, j: usize| kernels[i].iter().zip(&kernels[j]).map(|(a, b)| a * b).sum();
        let gram = std::array::from_fn(|i| std::array::from_fn(|j| dot(i, j)));
        Self { function, responses, gram, share }
    }

    /// Half the logarithm of the determinant of the expected squared errors; infinite if the noise of the angle dominates.
    fn score(&self, evidence: &Evidence, parameters: [f64; 3]) -> f64 {
        let length = 2 * (evidence.power.len() - 1);
        let torque_noise = evidence.noise[1];
        let mut added = [[0.0; 3]; 3];
        let mut information = [[0.0; 3]; 3];
        let mut noisy = [[0.0; 3]; 3];
        let mut quadrature = [0.0; 3];
        for (bin, &power) in evidence.power.iter().enumerate().take(self.responses[0].len()) {
            let both = if bin == 0 || bin == length / 2 { 1.0 } else { 2.0 };
            let weight = both * evidence.samples as f64 / length as f64;
            let angle_noise = evidence.noise_at(bin);
            let omega = 2.0 * std::f64::consts::PI * bin as f64 / (length as f64 * evidence.delta);
            let [inertia, damping, stiffness] = std::array::from_fn(|i| self.responses[i][bin]);
            let [even, odd] = [parameters[0] * inertia + parameters[2] * stiffness, parameters[1] * damping];
            let row = torque_noise * stiffness * stiffness + angle_noise * (even * even + odd * odd);
            // The error of I θ̈ + C θ̇ when the kernels replace the derivatives of φ.
            let error =
                [parameters[0] * (inertia + omega * omega * stiffness), parameters[1] * (damping - omega * stiffness)];
            let signal = (power - angle_noise).max(0.0);
            // An even and an odd response are a quarter of a turn apart: their products have no real part.
            for (i, j, product) in [
                (0, 0, inertia * inertia),
                (0, 2, inertia * stiffness),
                (1, 1, damping * damping),
                (2, 2, stiffness * stiffness),
            ] {
                information[i][j] += weight * product * power;
                added[i][j] += weight * product * angle_noise;
                noisy[i][j] += weight * product * power * row;
            }
            for (i, product) in [(0, inertia * error[0]), (1, damping * error[1]), (2, stiffness * error[0])] {
                quadrature[i] += weight * product * signal;
            }
        }
        information[2][0] = information[0][2];
        noisy[2][0] = noisy[0][2];
        added[2][0] = added[0][2];
        let gram = |i: usize, j: usize| match evidence.coloured {
            Some(_) => added[i][j],
            None => evidence.samples as f64 * evidence.noise[0] * self.gram[i][j],
        };
        let chosen: Vec<usize> = (0..3).filter(|&i| evidence.unknown[i]).collect();
        let size = chosen.len();
        let scale: Vec<f64> = chosen.iter().map(|&i| (information[i][i] - gram(i, i)).abs().sqrt().recip()).collect();
        let scaled = |entry: &dyn Fn(usize, usize) -> f64| {
            Mat::from_fn(size, size, |i, j| scale[i] * scale[j] * entry(chosen[i], chosen[j]))
        };
        let normal = scaled(&|i, j| information[i][j] - gram(i, j));
        let Ok(factor) = Llt::new(normal.as_ref(), faer::Side::Lower) else { return f64::INFINITY };
        let inverse = factor.inverse();
        let vector = |entry: &dyn Fn(usize) -> f64| Mat::from_fn(size, 1, |i, _| scale[i] * entry(chosen[i]));
        let quadrature = factor.solve(vector(&|i| quadrature[i]));
        let left = vector(&|i| LEFT_BY_CORRECTION * (0..3).map(|j| gram(i, j) * parameters[j]).sum::<f64>());
        let left = factor.solve(left);
        let errors = &inverse * scaled(&|i, j| noisy[i][j]) * &inverse
            + &quadrature * quadrature.transpose()
            + &left * left.transpose();
        let Ok(errors) = Llt::new(errors.as_ref(), faer::Side::Lower) else { return f64::INFINITY };
        let factor = errors.L();
        // Half the rows double every variance; without rows the sum is infinite.
        (0..size).map(|i| factor[(i, i)].ln() + scale[i].ln() - 0.5 * self.share.ln()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_above_the_motion_is_noise_and_as_much_of_it_is_below() {
        let power: Vec<f64> = (0..=64).map(|bin| if bin < 16 { 100.0 } else { 64.0 / f64::from(bin) }).collect();
        let evidence = Evidence {
            power: power.clone(),
            samples: 1000,
            noise: [1e-9, 1.0],
            coloured: None,
            delta: 1.0,
            unknown: [true; 3],
        };
        let told = evidence.clone().with_motion_until(16.0 / 128.0);
        let noise = told.coloured.clone().unwrap();
        assert_eq!(noise[16..], power[16..]);
        let level = (16..20).map(|bin| power[bin]).sum::<f64>() / 4.0;
        assert!(noise[..16].iter().all(|noise| (noise / level - 1.0).abs() < 1e-12));
        // Of a band that ends at 1/8 the mean frequency of velocities is 3/4 of that.
        assert!((told.period() / (8.0 * 4.0 / 3.0) - 1.0).abs() < 0.1, "{}", told.period());
        assert!(evidence.period() < 8.0);
    }
}
