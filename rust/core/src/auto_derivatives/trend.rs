//! Whether a record is no more than a parabola and noise.
//!
//! Then no window is too long. Risks of candidates cannot tell that: of windows as long as a good part of the record there are few, and by
//! chance one of high order seems to follow what others miss. So a constant, a line or a parabola is tested for what is left of it: in
//! windows of all the record, of an eighth, of an eighth of that and so on, the coefficients of the degrees above have the variance of
//! the noise alone,
//!
//! ```text
//! mean of c_j² / q_jᵀΓq_j ≤ (1 - 2/9ν + z √(2/9ν))³.
//! ```
//!
//! The cube root of such a mean of `ν` squares is all but normally distributed (Wilson and Hilferty 1931); the mean of few is not, and of four that
//! are noise alone one in a hundred would be more than 3.5 of its standard deviations too large.
//!
//! A mean over all windows would not see what happens in one of them, so no window by itself may exceed chance either.

use std::f64::consts::PI;

use crate::auto_derivatives::block_means::BlockMeans;
use crate::auto_derivatives::whole_record::{DEGREES, WholeRecord, WindowCoefficients};
use crate::error::Error;
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::tables::basis;
use crate::noise::correlated::CorrelatedNoise;
use crate::record::samples::Samples;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Degrees of a trend.
const TRENDS: usize = 3;

/// Windows are so much shorter from one test to the next, to these last.
const SHORTER: usize = 8;
const SHORTEST: usize = DEGREES + 1;

/// Windows of long records are made of means, at least so many.
const LEAST_MEANS: usize = 512;

/// Samples that are read at a time, at least.
const TOGETHER: usize = 1 << 14;

/// Degrees that are tested together: a band of frequencies. Where a motion adds less to a band than its noise, no polynomial gains by following it.
const GROUP: usize = 4;

/// What is left may exceed the noise by so many standard deviations, the cube roots of mean squares taken, and white noise and coloured noise at
/// low frequencies are known to so much.
const CHANCE: f64 = 3.0;
const WHITE: f64 = 0.05;
const COLOURED: f64 = 0.25;

/// The logarithm of how rarely one window of many exceeds the noise by chance.
const RARELY: f64 = 7.0;

/// A polynomial of low degree that is all there is but noise.
pub(crate) struct ParabolicTrend {
    /// Its degree, 0 to 2.
    pub(crate) degree: usize,
    pub(crate) whole: WholeRecord,
    /// Covariances of the coefficients.
    pub(crate) covariances: Vec<[f64; DEGREES]>,
}

impl ParabolicTrend {
    /// The trend that is all there is, or `None`.
    ///
    /// # Errors
    /// If there is not the memory.
    pub(crate) fn new(
        means: &BlockMeans<'_>,
        noise: &CorrelatedNoise,
        instructions: Instructions,
    ) -> Result<Option<Self>, Error> {
        let samples = means.record().len();
        if samples <= 2 * SHORTEST || noise.variance().is_nan() || noise.variance() <= 0.0 {
            return Ok(None);
        }
        let whole = WholeRecord::new(means, instructions)?;
        // No noise is denser than at the lowest or the highest frequencies: most motions need no more.
        let densest = noise.density(0.0).max(noise.density(PI)) / whole.step as f64;
        let test = NoiseAlone::new(noise, 1.0);
        if test.degree_from(0, &whole.coefficients.map(|c| c * c / densest)).is_none() {
            return Ok(None);
        }
        let covariances = whole.covariances(noise)?;
        let power = std::array::from_fn(|degree| whole.coefficients[degree].powi(2) / covariances[degree][degree]);
        let Some(mut degree) = test.degree_from(0, &power) else { return Ok(None) };
        let shorter = std::iter::successors(Some(samples / SHORTER), |length| Some(length / SHORTER));
        // The shortest windows see the highest frequencies.
        for length in shorter.take_while(|&length| length > 2 * SHORTEST).chain([SHORTEST]) {
            let step = means.coarsest(length, LEAST_MEANS);
            let windows = TestedWindows::new(means.of(step), length / step, step, noise, instructions)?;
            let test = NoiseAlone::new(noise, windows.count);
            let Some(found) = test.degree_from(degree, &windows.power) else { return Ok(None) };
            if windows.largest > test.largest() {
                return Ok(None);
            }
            degree = found;
        }
        Ok(Some(Self { degree, whole, covariances }))
    }
}

/// What noise alone leaves in so many windows.
struct NoiseAlone {
    count: f64,
    known: f64,
}

impl NoiseAlone {
    fn new(noise: &CorrelatedNoise, count: f64) -> Self {
        Self { count, known: if noise.is_white() { WHITE } else { COLOURED } }
    }

    /// The lowest degree, of some or a higher one, above which there is noise alone, by the power of every degree over that of the noise.
    fn degree_from(&self, degree: usize, power: &[f64; DEGREES]) -> Option<usize> {
        let noise_alone = |group: &[f64]| {
            let freedom = self.count * group.len() as f64;
            let mean = group.iter().sum::<f64>() / group.len() as f64;
            // Of a cube root, a ninth of the relative variance.
            let variance = (2.0 / freedom + self.known * self.known) / 9.0;
            mean.cbrt() <= 1.0 - 2.0 / (9.0 * freedom) + CHANCE * variance.sqrt()
        };
        (degree..TRENDS).find(|&degree| power[degree + 1..].chunks(GROUP).all(noise_alone))
    }

    /// The largest sum of squares above a parabola in any of the windows: `k + 2√(kx) + 2x` is exceeded with a probability below `exp(-x)`
    /// (Laurent and Massart 2000).
    fn largest(&self) -> f64 {
        let (freedom, x) = ((DEGREES - TRENDS) as f64, self.count.ln() + RARELY);
        (1.0 + self.known) * (freedom + 2.0 * (freedom * x).sqrt() + 2.0 * x)
    }
}

/// The coefficients of windows side by side, over those of the noise.
struct TestedWindows {
    count: f64,
    /// By degree, their mean square.
    power: [f64; DEGREES],
    /// Of one window, the largest sum of squares above a parabola.
    largest: f64,
}

impl TestedWindows {
    /// Looks at windows of so many means of so many samples.
    fn new(
        record: &dyn Samples,
        length: usize,
        step: usize,
        noise: &CorrelatedNoise,
        instructions: Instructions,
    ) -> Result<Self, Error> {
        let basis = basis(length, DEGREES)?;
        let norms = dispatch(instructions, BasisNorms(&basis));
        let share = noise.variance() / step as f64;
        let expected: [f64; DEGREES] = std::array::from_fn(|degree| {
            if noise.is_white() {
                return share * norms[degree];
            }
            let row: Vec<f64> = (0..length).map(|index| basis.value(degree, index)).collect();
            row.iter().zip(noise.covariances_of_means(&row, step)).map(|(a, b)| a * b).sum()
        });
        let count = record.len() / length;
        let together = (TOGETHER / length).max(1);
        let mut samples = vec![0.0; length * together.min(count)];
        let (mut squares, mut largest) = ([0.0; DEGREES], 0.0_f64);
        for first in (0..count).step_by(together) {
            let samples = &mut samples[..length * together.min(count - first)];
            record.read(first * length, samples);
            let part = dispatch(instructions, CoefficientSquares { samples, basis: &basis, expected: &expected });
            squares.iter_mut().zip(part.squares).for_each(|(square, part)| *square += part);
            // What is no number shows in the squares.
            largest = largest.max(part.largest);
        }
        let count = count as f64;
        let power = std::array::from_fn(|degree| squares[degree] / count / expected[degree]);
        Ok(Self { count, power, largest })
    }
}

/// By degree, the sum of the squares of a basis: one but for rounding.
struct BasisNorms<'a>(&'a Basis);

impl Kernel for BasisNorms<'_> {
    type Output = [f64; DEGREES];

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> [f64; DEGREES] {
        let mut sums = [0.0; DEGREES];
        for index in 0..self.0.length() {
            for (sum, q) in sums.iter_mut().zip(self.0.row(index).0) {
                *sum += q * q;
            }
        }
        sums
    }
}

/// The squared coefficients of windows side by side.
struct CoefficientSquares<'a> {
    samples: &'a [f64],
    basis: &'a Basis,
    /// By degree, those of the noise.
    expected: &'a [f64; DEGREES],
}

/// By degree their sum, and the largest sum over the degrees above a parabola in one window, over those of the noise.
struct SquareSums {
    squares: [f64; DEGREES],
    largest: f64,
}

impl Kernel for CoefficientSquares<'_> {
    type Output = SquareSums;

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> SquareSums {
        let mut squares = [Packet::ZERO; DEGREES / WIDTH];
        let mut inverses = self.expected.map(f64::recip);
        inverses[..TRENDS].fill(0.0);
        let mut largest = 0.0_f64;
        for window in self.samples.chunks_exact(self.basis.length()) {
            let sums = WindowCoefficients { window, basis: self.basis }.sums();
            let mut weighted = Packet::ZERO;
            for ((square, sum), inverses) in squares.iter_mut().zip(sums).zip(inverses.chunks_exact(WIDTH)) {
                let own = sum * sum;
                *square += own;
                weighted += own * Packet::load(inverses);
            }
            largest = largest.max(weighted.0.iter().sum());
        }
        let mut all = [0.0; DEGREES];
        for (all, square) in all.chunks_mut(WIDTH).zip(squares) {
            all.copy_from_slice(&square.0);
        }
        SquareSums { squares: all, largest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::quantisation::tests::uniform;

    /// Noise of variance one.
    fn noise() -> Vec<f64> {
        uniform(4000).into_iter().map(|value| value * 12.0_f64.sqrt()).collect()
    }

    /// The degree of the trend that is found.
    fn degree_of(samples: &[f64], variance: f64) -> Option<usize> {
        let means = BlockMeans::new(&samples, samples.len() / 4).expect("little memory");
        let found = ParabolicTrend::new(&means, &CorrelatedNoise::white(variance), Instructions::current());
        found.expect("little memory").map(|trend| trend.degree)
    }

    fn found(signal: impl Fn(f64) -> f64) -> Option<usize> {
        let samples: Vec<f64> = noise().iter().enumerate().map(|(i, e)| e + signal(i as f64 / 4000.0)).collect();
        degree_of(&samples, 1.0)
    }

    #[test]
    fn a_constant_a_line_and_a_parabola_are_trends() {
        assert_eq!(found(|_| 1e6), Some(0));
        assert_eq!(found(|t| 10.0 * t - 3.0), Some(1));
        assert_eq!(found(|t| 10.0 * t * t), Some(2));
    }

    #[test]
    fn few_records_seem_to_bend_by_chance() {
        let (records, samples) = (500, 1000);
        let noise: Vec<f64> =
            uniform(records * samples).into_iter().map(|value| value * 12.0_f64.sqrt() + 3.0).collect();
        let bent = noise.chunks(samples).filter(|record| degree_of(record, 1.0).is_none()).count();
        // One is expected; were mean squares taken to be normally distributed, 14 would be.
        assert!(bent <= 4, "{bent} of {records}");
    }

    #[test]
    fn motions_slow_and_fast_are_none() {
        for cycles in [1.0, 5.0, 30.0, 200.0, 1000.0] {
            assert_eq!(found(|t| (cycles * std::f64::consts::TAU * t).sin()), None, "{cycles}");
        }
        assert_eq!(found(|t| if t > 0.6 { 1.0 } else { 0.0 }), None);
    }

    #[test]
    fn missing_samples_and_no_noise_are_no_trend() {
        let mut samples = noise();
        assert_eq!(degree_of(&samples, 1.0), Some(0));
        assert_eq!(degree_of(&samples, 0.0), None);
        samples[100] = f64::NAN;
        assert_eq!(degree_of(&samples, 1.0), None);
    }

    #[test]
    fn what_happens_anywhere_in_a_long_record_is_no_trend() {
        let samples = 200_000;
        let noise: Vec<f64> = uniform(samples).into_iter().map(|value| value * 12.0_f64.sqrt()).collect();
        let found = |signal: &dyn Fn(f64) -> f64| {
            let samples: Vec<f64> = noise.iter().enumerate().map(|(i, e)| e + signal(i as f64)).collect();
            degree_of(&samples, 1.0)
        };
        assert_eq!(found(&|_| 1e6), Some(0));
        assert_eq!(found(&|i| 1e-5 * i), Some(1));
        assert_eq!(found(&|i| 1e-9 * i * i), Some(2));
        assert_eq!(found(&|i| 1e-5 * (i - 120_000.0).max(0.0)), None, "a bend");
        assert_eq!(found(&|i| 0.1 * (i * std::f64::consts::TAU / 200_000.0).sin()), None, "one slow cycle");
        for long in [20.0, 300.0, 4000.0] {
            let bump = |i: f64| 20.0 / f64::sqrt(long) * (-((i - 77_777.0) / long).powi(2)).exp();
            assert_eq!(found(&bump), None, "a bump of {long} samples");
        }
    }
}
