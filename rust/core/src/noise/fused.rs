//! One record of a motion from several channels: an angle from itself, its velocity and its acceleration.
//!
//! With the noise `σ_d` of the channels the most likely motion minimises
//!
//! ```text
//! Σ (θ - y)²/σ_0² + Σ (θ_{i+1} - θ_i - s_i)²/(σ_1 Δ)² + Σ (θ_{i+1} - 2 θ_i + θ_{i-1} - q_i)²/(σ_2 Δ²)²
//! ```
//!
//! `s = Δ (13 (v_i + v_{i+1}) - v_{i-1} - v_{i+2})/24` is what the velocity goes from one sample to the next and `q = Δ² (a_{i-1} + 10 a_i + a_{i+1})/12` the
//! same for the acceleration, both exact for cubics. The equations have five diagonals at most. At a frequency `ω` the noise of the result has the power
//! `1/(1/σ_0² + ω²/σ_1² + ω⁴/σ_2²)`, the least there can be, so no equation of motion is told less by it than by all the channels.

use std::f64::consts::PI;

use crate::record::samples::is_usable;

/// Rounds of solving for what rounding left.
const REFINEMENTS: usize = 2;

/// A channel that was measured beside another: which derivative of it, and the noise's standard deviation over the other's, in its unit a sample: times the
/// sample period to the power of the derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beside {
    /// 1 or 2.
    pub derivative: usize,
    /// The standard deviation.
    pub noise: f64,
}

/// The noise of an angle that was made from other channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AngleNoise {
    /// Variance of the channel with the lowest derivative.
    pub variance: f64,
    /// How often that was integrated to become the angle.
    pub integrations: usize,
    /// What it was fused with before.
    pub beside: Vec<Beside>,
}

impl AngleNoise {
    /// The square root of the power that fusing leaves of the first channel's noise, at a frequency in radians a sample.
    #[must_use]
    pub fn left(&self, frequency: f64) -> f64 {
        let half = frequency / 2.0;
        let (mut all, mut noisy) = (1.0, 1.0);
        for one in &self.beside {
            // What differences see of the motion, and what the sums of the channel see of it, which is less near half the sample rate.
            let (seen, passed) = match one.derivative {
                1 => (2.0 * half.sin(), (26.0 * half.cos() - 2.0 * (3.0 * half).cos()) / 24.0),
                _ => ((2.0 * half.sin()).powi(2), (10.0 + 2.0 * frequency.cos()) / 12.0),
            };
            let weight = (seen / one.noise).powi(2);
            all += weight;
            noisy += weight * passed * passed;
        }
        noisy.sqrt() / all
    }

    /// The power of the angle's noise at a frequency in radians a sample.
    pub(crate) fn power(&self, frequency: f64, delta: f64) -> f64 {
        let seen = (frequency / delta).powi(2).powi(i32::try_from(self.integrations).unwrap_or(i32::MAX));
        self.variance * self.left(frequency).powi(2) / seen
    }

    /// Samples over which what fusing left is correlated, about.
    pub(crate) fn correlated(&self) -> f64 {
        let corner = |one: &Beside| if one.derivative == 1 { one.noise } else { one.noise.sqrt() };
        self.beside.iter().map(|one| corner(one).recip()).fold(0.0, f64::max)
    }

    /// The lowest frequency that a record of some samples shows.
    pub(crate) fn lowest(samples: usize) -> f64 {
        2.0 * PI / samples.max(1) as f64
    }
}

/// The most likely motion of a record. Samples that are missing in any channel are NaN; parts between them are fused on their own.
#[must_use]
pub fn fuse(first: &[f64], others: &[(Beside, &[f64])], delta: f64) -> Vec<f64> {
    let usable = |sample: usize| is_usable(first[sample]) && others.iter().all(|(_, other)| is_usable(other[sample]));
    let mut fused = vec![f64::NAN; first.len()];
    let mut begin = 0;
    while begin < first.len() {
        if !usable(begin) {
            begin += 1;
            continue;
        }
        let end = (begin..first.len()).find(|&sample| !usable(sample)).unwrap_or(first.len());
        let part: Vec<(Beside, &[f64])> = others.iter().map(|(one, other)| (*one, &other[begin..end])).collect();
        fused[begin..end].copy_from_slice(&fuse_part(&first[begin..end], &part, delta));
        begin = end;
    }
    fused
}

fn fuse_part(first: &[f64], others: &[(Beside, &[f64])], delta: f64) -> Vec<f64> {
    let count = first.len();
    let steps: Vec<(usize, f64, Vec<f64>)> = others
        .iter()
        .map(|(one, samples)| (one.derivative, one.noise.powi(-2), steps(samples, one.derivative, delta)))
        .collect();
    let mut matrix = Banded::identity(count);
    for (derivative, weight, steps) in &steps {
        matrix.add(*derivative, *weight, steps.len());
    }
    let factor = matrix.factor();
    let mut motion = first.to_vec();
    for _ in 0..REFINEMENTS {
        // The gradient at what was found so far, from differences: no digits are lost to the size of the angle.
        let mut left: Vec<f64> = first.iter().zip(&motion).map(|(recorded, found)| recorded - found).collect();
        for (derivative, weight, steps) in &steps {
            for (place, step) in steps.iter().enumerate() {
                let kernel = difference(*derivative);
                let gone: f64 = kernel.iter().zip(&motion[place..]).map(|(factor, value)| factor * value).sum();
                let error = weight * (step - gone);
                left[place..].iter_mut().zip(kernel).for_each(|(sum, factor)| *sum += factor * error);
            }
        }
        factor.solve(&mut left);
        motion.iter_mut().zip(left).for_each(|(value, more)| *value += more);
    }
    motion
}

/// The difference of neighbours that is the derivative times the sample period to its power.
fn difference(derivative: usize) -> &'static [f64] {
    if derivative == 1 { &[-1.0, 1.0] } else { &[1.0, -2.0, 1.0] }
}

/// What a motion with these derivatives goes in every difference.
fn steps(samples: &[f64], derivative: usize, delta: f64) -> Vec<f64> {
    let last = samples.len() - 1;
    // Beyond the ends as a line.
    let at = |place: usize, by: isize| match place.checked_add_signed(by) {
        None => 2.0 * samples[0] - samples[1.min(last)],
        Some(place) if place > last => 2.0 * samples[last] - samples[last.saturating_sub(1)],
        Some(place) => samples[place],
    };
    if derivative == 1 {
        let step = |place: usize| 13.0 * (at(place, 0) + at(place, 1)) - at(place, -1) - at(place, 2);
        (0..last).map(|place| delta * step(place) / 24.0).collect()
    } else {
        let step = |place: usize| at(place, 0) + 10.0 * at(place, 1) + at(place, 2);
        (0..last.saturating_sub(1)).map(|place| delta * delta * step(place) / 12.0).collect()
    }
}

/// A symmetric matrix with two diagonals below the main one.
struct Banded {
    main: Vec<f64>,
    below: [Vec<f64>; 2],
}

impl Banded {
    fn identity(count: usize) -> Self {
        Self { main: vec![1.0; count], below: [(); 2].map(|()| vec![0.0; count]) }
    }

    /// Adds the squares of differences.
    fn add(&mut self, derivative: usize, weight: f64, count: usize) {
        let kernel = difference(derivative);
        for first in 0..count {
            for (i, one) in kernel.iter().enumerate() {
                self.main[first + i] += weight * one * one;
                for (j, other) in kernel[..i].iter().enumerate() {
                    self.below[i - j - 1][first + i] += weight * one * other;
                }
            }
        }
    }

    /// The factor `L D Lᵀ` in its place.
    fn factor(mut self) -> Self {
        for row in 0..self.main.len() {
            let mut pivot = self.main[row];
            let far = if row >= 2 { self.below[1][row] / self.main[row - 2] } else { 0.0 };
            let mut near = if row >= 1 { self.below[0][row] } else { 0.0 };
            if row >= 2 {
                near -= far * self.main[row - 2] * self.below[0][row - 1];
                pivot -= far * far * self.main[row - 2];
            }
            if row >= 1 {
                near /= self.main[row - 1];
                pivot -= near * near * self.main[row - 1];
            }
            (self.main[row], self.below[0][row], self.below[1][row]) = (pivot, near, far);
        }
        self
    }

    /// Solves with the factor.
    fn solve(&self, rhs: &mut [f64]) {
        let count = rhs.len();
        for row in 1..count {
            let far = if row >= 2 { self.below[1][row] * rhs[row - 2] } else { 0.0 };
            rhs[row] -= self.below[0][row] * rhs[row - 1] + far;
        }
        for row in (0..count).rev() {
            let near = if row + 1 < count { self.below[0][row + 1] * rhs[row + 1] } else { 0.0 };
            let far = if row + 2 < count { self.below[1][row + 2] * rhs[row + 2] } else { 0.0 };
            rhs[row] = rhs[row] / self.main[row] - near - far;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DELTA: f64 = 1e-3;

    /// Numbers of mean zero and variance one that look random.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..20).for_each(|_| {
            next();
        });
        (0..count).map(|_| next() * 12.0_f64.sqrt()).collect()
    }

    fn beside(derivative: usize, noise: f64) -> Beside {
        Beside { derivative, noise }
    }

    /// The equations' gradient vanishes, whatever the weights.
    #[test]
    fn the_motion_is_the_minimum() {
        let [y, v, a] = [1, 2, 3].map(|seed| noise(seed, 300));
        for (one, two) in [(0.1, 0.01), (1.0, 1e-3), (1e-3, 1.0), (1e-4, 1e-5)] {
            let others = [(beside(1, one), v.as_slice()), (beside(2, two), a.as_slice())];
            let found = fuse(&y, &others, 1.0);
            let cost = |motion: &[f64]| -> f64 {
                let own: f64 = motion.iter().zip(&y).map(|(a, b)| (a - b) * (a - b)).sum();
                let more = others.iter().map(|(beside, samples)| {
                    let squares =
                        steps(samples, beside.derivative, 1.0).into_iter().enumerate().map(|(place, step)| {
                            let gone: f64 =
                                difference(beside.derivative).iter().zip(&motion[place..]).map(|(a, b)| a * b).sum();
                            (gone - step).powi(2)
                        });
                    squares.sum::<f64>() / beside.noise.powi(2)
                });
                own + more.sum::<f64>()
            };
            let least = cost(&found);
            for place in [0, 1, 150, 299] {
                for by in [-1e-4, 1e-4] {
                    let mut moved = found.clone();
                    moved[place] += by;
                    // Beside a minimum of a quadratic form, rounding of the sum aside.
                    assert!(cost(&moved) >= least * (1.0 - 1e-12), "{one} {two} {place}");
                }
            }
        }
    }

    #[test]
    fn a_motion_without_noise_stays_as_it_is() {
        let time = |place: usize| place as f64 * DELTA;
        let angle: Vec<f64> = (0..2000).map(|place| 1e3 + (20.0 * time(place)).sin()).collect();
        let velocity: Vec<f64> = (0..2000).map(|place| 20.0 * (20.0 * time(place)).cos()).collect();
        let acceleration: Vec<f64> = (0..2000).map(|place| -400.0 * (20.0 * time(place)).sin()).collect();
        let others = [(beside(1, 1e-4), velocity.as_slice()), (beside(2, 1e-4), acceleration.as_slice())];
        let found = fuse(&angle, &others, DELTA);
        // The sums are exact for cubics, so each step is wrong by 11/720 (ωΔ)^5 at most, inside; the ends go on as lines.
        let error = found[10..1990].iter().zip(&angle[10..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-6, "{error}");
    }

    #[test]
    fn the_noise_has_the_power_that_is_said() {
        let others = [beside(1, 0.1), beside(2, 0.02)];
        let told = AngleNoise { variance: 1.0, integrations: 0, beside: others.to_vec() };
        let (mut sum, mut count) = (0.0, 0.0);
        for seed in 0..20 {
            let [y, v, a] = [1, 2, 3].map(|channel| noise(10 * seed + channel, 2000));
            let v: Vec<f64> = v.iter().map(|value| 0.1 * value).collect();
            let a: Vec<f64> = a.iter().map(|value| 0.02 * value).collect();
            let found = fuse(&y, &[(others[0], &v), (others[1], &a)], 1.0);
            sum += found[200..1800].iter().map(|value| value * value).sum::<f64>();
            count += 1600.0;
        }
        let frequencies = (0..10_000).map(|bin| PI * (f64::from(bin) + 0.5) / 10_000.0);
        let expected = frequencies.map(|frequency| told.left(frequency).powi(2)).sum::<f64>() / 10_000.0;
        let variance = noise(1, 20_000).iter().map(|value| value * value).sum::<f64>() / 20_000.0;
        // About 30 samples are correlated: 1000 independent ones tell a variance to 4.5 %.
        assert!((sum / count / (expected * variance) - 1.0).abs() < 0.14, "{} {}", sum / count, expected * variance);
    }

    #[test]
    fn parts_between_missing_samples_are_fused_alone() {
        let (mut y, v) = (noise(1, 100), noise(2, 100));
        y[40] = f64::NAN;
        let others = [(beside(1, 0.1), v.as_slice())];
        let found = fuse(&y, &others, 1.0);
        assert!(found[40].is_nan());
        assert_eq!(found[41..], fuse(&y[41..], &[(others[0].0, &v[41..])], 1.0)[..]);
    }
}
