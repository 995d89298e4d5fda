//! Test functions `φ(x) = (1 - x²)^p` and the kernels they give.
//!
//! Multiplied by a function that vanishes with its slope at both ends of a window and integrated by parts, the equation of motion
//! `I θ̈ + C θ̇ + K θ = T` becomes `I⟨φ″θ⟩ - C⟨φ′θ⟩ + K⟨φθ⟩ = ⟨φT⟩` (Shinbrot 1957): no derivative of the angle is ever estimated.
//! The kernels are the analytic derivatives of `φ` at the samples. Their sums equal the integrals up to the part of `φ`'s spectrum
//! beyond the sample rate, which falls as the power `p + 1` of the half-width; differences of a sampled `φ` would be wrong by the square
//! of the frequency instead.
//!
//! The remaining error of narrow test functions matters most where an angle has a large constant part: multiplied with
//! a sum of `φ″` that is not quite zero, it looks like a torque. So each kernel is corrected by a multiple of `φ` to be
//! exact for constants. At half-width 10 this takes 0.5 N off the error of a 3.2 N offset of a carriage of 95 kg at 0.2
//! m; from half-width 80 on it changes nothing beyond the tenth digit. (A quadratic times `φ`, which makes parabolas
//! exact as well, is worse where there are only nine samples a cycle.)

use crate::error::Error;

/// The lowest exponent for which `φ″` vanishes at the ends.
const LEAST_EXPONENT: usize = 3;
/// The highest exponent: beyond it most of the window is almost zero.
const MOST_EXPONENT: usize = 20;
/// The fewest samples on either side of the centre.
pub(crate) const LEAST_HALF_WIDTH: usize = 4;
/// Rows to the half-width: about, at most where fewer will do, and the fewest of these, twice as many.
const ROWS: usize = 6;
const MANY_ROWS: usize = 8;
const TWICE_FEWEST_ROWS: usize = 11;

/// A test function on the samples `-h … h`, scaled to a sum of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestFunction {
    half_width: usize,
    exponent: usize,
    /// Sample period in seconds.
    delta: f64,
    /// One over the sum of `φ` at the samples.
    scale: f64,
}

/// Kernels of a test function that is shifted by a fraction of a sample, to be multiplied with the samples `-h … h` and summed.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernels {
    /// Multiply the angle: `φ″` for inertia, `-φ′` for damping, `φ` for stiffness.
    pub values: [Vec<f64>; 3],
    /// The same for coefficients that grow in proportion to the time `τ` from the centre: `(τφ)″`, `-(τφ)′` and `τφ`.
    pub slopes: [Vec<f64>; 3],
}

/// Cycles in a half-width of the frequency of which half the power passes.
fn half_power(exponent: usize) -> f64 {
    (2.0 * exponent as f64 * std::f64::consts::LN_2).sqrt() / (2.0 * std::f64::consts::PI)
}

impl TestFunction {
    /// `(1 - x²)^exponent` on `2 half_width + 1` samples that are `delta` seconds apart.
    ///
    /// # Errors
    /// If the exponent or the half-width is too small or too large.
    pub fn new(half_width: usize, exponent: usize, delta: f64) -> Result<Self, Error> {
        if !(LEAST_EXPONENT..=MOST_EXPONENT).contains(&exponent) {
            return Err(Error::Exponent { exponent, least: LEAST_EXPONENT, most: MOST_EXPONENT });
        }
        if half_width < LEAST_HALF_WIDTH {
            return Err(Error::WindowTooShort { window_length: 2 * half_width + 1, least: 2 * LEAST_HALF_WIDTH + 1 });
        }
        let mut function = Self { half_width, exponent, delta, scale: 1.0 };
        function.scale = 1.0 / function.positions(0.0).map(|x| function.at(x)[0]).sum::<f64>();
        Ok(function)
    }

    /// Samples on either side of the centre.
    #[must_use]
    pub fn half_width(&self) -> usize {
        self.half_width
    }

    /// The exponent.
    #[must_use]
    pub fn exponent(&self) -> usize {
        self.exponent
    }

    /// Seconds from one sample to the next.
    #[must_use]
    pub fn delta(&self) -> f64 {
        self.delta
    }

    /// Samples of the window.
    #[must_use]
    pub fn window_length(&self) -> usize {
        2 * self.half_width + 1
    }

    /// The variance of times with the function as their weights, in squared samples.
    #[must_use]
    pub fn variance(&self) -> f64 {
        (self.half_width as f64).powi(2) / (2.0 * self.exponent as f64 + 3.0)
    }

    /// Where half the power passes, in hertz: the function is nearly a bell, `(1 - x²)^p ≈ exp(-p x²)`.
    #[must_use]
    pub fn band(&self) -> f64 {
        half_power(self.exponent) / (self.half_width as f64 * self.delta)
    }

    /// The smallest half-width whose band ends at so many cycles per sample or below.
    pub(crate) fn half_width_of(band: f64, exponent: usize) -> usize {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some multiple of a cycle")]
        let half_width = (half_power(exponent) / band).ceil() as usize;
        half_width
    }

    /// Samples from one row to the next that carry all the information of every row: a sixth of the half-width in whole samples, and one more where more
    /// than eight rows to the half-width are left without it and five and a half with it. From half the rate of rows on the power of `φ″` is below 1/5000 of
    /// its largest value, for exponents from 5 to 12.
    #[must_use]
    pub fn stride(&self) -> usize {
        Self::stride_of(self.half_width)
    }

    /// The same for a half-width.
    pub(crate) fn stride_of(half_width: usize) -> usize {
        let stride = (half_width / ROWS).max(1);
        let is_many = half_width > MANY_ROWS * stride;
        let is_enough = 2 * half_width >= TWICE_FEWEST_ROWS * (stride + 1);
        stride + usize::from(is_many && is_enough)
    }

    /// The kernels for samples that come `shift` sample periods late.
    #[must_use]
    pub fn kernels(&self, shift: f64) -> Kernels {
        let length = self.window_length();
        let mut kernels = Kernels { values: [(); 3].map(|()| Vec::with_capacity(length)), slopes: Default::default() };
        // A derivative by x is one by time times the half-width in seconds.
        let second = 1.0 / (self.half_width as f64 * self.delta);
        for x in self.positions(shift) {
            let [value, slope, curvature] = self.at(x);
            let time = x / second;
            let (slope, curvature) = (slope * second, curvature * second * second);
            kernels.values.iter_mut().zip([curvature, -slope, value]).for_each(|(kernel, value)| kernel.push(value));
            let slopes = [time * curvature + 2.0 * slope, -time * slope - value, time * value];
            kernels.slopes.iter_mut().zip(slopes).for_each(|(kernel, value)| kernel.push(value));
        }
        Self::correct(&mut kernels);
        kernels
    }

    /// Makes every kernel exact for constants, by adding a multiple of `φ`.
    fn correct(kernels: &mut Kernels) {
        let weight = kernels.values[2].clone();
        let total = sum(&weight);
        let derivatives = kernels.values[..2].iter_mut().chain(&mut kernels.slopes);
        for kernel in derivatives {
            let left = sum(kernel) / total;
            kernel.iter_mut().zip(&weight).for_each(|(value, weight)| *value -= left * weight);
        }
        // Of a constant, φ alone must keep its sum of one.
        kernels.values[2].iter_mut().for_each(|value| *value /= total);
    }

    /// `φ` and its first two derivatives by `x`, scaled; zero outside the window.
    fn at(&self, x: f64) -> [f64; 3] {
        let inside = 1.0 - x * x;
        if inside <= 0.0 {
            return [0.0; 3];
        }
        let p = self.exponent as f64;
        let power = self.scale * inside.powi(i32::try_from(self.exponent).unwrap_or(i32::MAX) - 2);
        [power * inside * inside, -2.0 * p * x * power * inside, 2.0 * p * power * ((2.0 * p - 1.0) * x * x - 1.0)]
    }

    /// Where the samples lie, as fractions of the half-width.
    fn positions(&self, shift: f64) -> impl Iterator<Item = f64> + use<> {
        let half = self.half_width;
        (0..=2 * half).map(move |index| (index as f64 - half as f64 - shift) / half as f64)
    }
}

/// The sum of a kernel from both ends inwards, so that an odd kernel sums to exactly zero.
pub(crate) fn sum(kernel: &[f64]) -> f64 {
    let half = kernel.len() / 2;
    let pairs = kernel[..half].iter().zip(kernel.iter().rev()).map(|(left, right)| left + right);
    pairs.sum::<f64>() + if kernel.len() % 2 == 1 { kernel[half] } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The power of a kernel at some frequency, in cycles a sample.
    fn power(kernel: &[f64], frequency: f64) -> f64 {
        let turn = |place: usize| 2.0 * std::f64::consts::PI * frequency * place as f64;
        let sum = |part: fn(f64) -> f64| {
            kernel.iter().enumerate().map(|(place, value)| value * part(turn(place))).sum::<f64>()
        };
        sum(f64::cos).powi(2) + sum(f64::sin).powi(2)
    }

    #[test]
    fn the_smallest_half_width_of_a_band_ends_there() {
        for (band, exponent) in [(0.02, 9), (0.05, 5)] {
            let half = TestFunction::half_width_of(band, exponent);
            let [wider, narrower] = [half, half - 1].map(|half| TestFunction::new(half, exponent, 1.0).unwrap().band());
            assert!(wider <= band && band < narrower, "{wider} {narrower}");
        }
    }

    #[test]
    fn rows_a_stride_apart_carry_what_every_row_does() {
        for half in [11, 12, 17, 18, 22, 23, 35, 91] {
            for exponent in [5, 9, 12] {
                let function = TestFunction::new(half, exponent, 1.0).expect("a test function");
                let [accelerated, ..] = function.kernels(0.0).values;
                let all: Vec<f64> = (0..=500).map(|place| power(&accelerated, f64::from(place) / 1000.0)).collect();
                let most = all.iter().copied().fold(0.0, f64::max);
                let seen = 500 / function.stride();
                let lost = all[seen + 1..].iter().copied().fold(0.0, f64::max);
                assert!(lost < most / 5000.0, "{half}, {exponent}: {}", lost / most);
                let rows = half as f64 / function.stride() as f64;
                assert!((5.5..=8.0).contains(&rows), "{half}: {rows}");
            }
        }
    }
}
