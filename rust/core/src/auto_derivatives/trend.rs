//! Whether a record is no more than a parabola and noise.
//!
//! Then no window is too long. Risks of candidates cannot tell that: of windows as long as a good part of the record there are few, and by
//! chance one of high order seems to follow what others miss. So a constant, a line or a parabola is tested for what is left of it: in
//! windows of all the record, of an eighth, of an eighth of that and so on, the coefficients of the degrees above have the variance of
//! the noise alone,
//!
//! ```text
//! mean of c_j² / q_jᵀΓq_j = 1 ± √(2/ν).
//! ```

use crate::error::Error;
use crate::exec::memory;
use crate::local_polynomials::basis::Basis;
use crate::local_polynomials::tables::basis;
use crate::noise::correlated::CorrelatedNoise;
use crate::record::samples::{Samples, is_usable};
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::instructions::Instructions;
use crate::simd::vectors::{Kernel, Lanes, dispatch};

/// Degrees of a trend, and those that are tested.
const TRENDS: usize = 3;
const DEGREES: usize = 16;

/// Windows are so much shorter from one test to the next, to these last.
const SHORTER: usize = 8;
const SHORTEST: usize = DEGREES + 1;

/// Degrees that are tested together: a band of frequencies. Where a motion adds less to a band than its noise, no polynomial gains by following it.
const GROUP: usize = 4;

/// Of longer records windows are chosen: there are many of any length.
const LONGEST: usize = 1 << 16;

/// What is left may exceed the noise by so many standard deviations, and white noise and coloured noise at low frequencies are known to so much.
const CHANCE: f64 = 3.5;
const WHITE: f64 = 0.05;
const COLOURED: f64 = 0.25;

/// The degree of the trend that is all there is, 0 to 2, or `None`.
///
/// # Errors
/// If there is not the memory.
pub(crate) fn trend(
    record: &dyn Samples,
    noise: &CorrelatedNoise,
    instructions: Instructions,
) -> Result<Option<usize>, Error> {
    let samples = record.len();
    if samples > LONGEST || noise.variance().is_nan() || noise.variance() <= 0.0 {
        return Ok(None);
    }
    memory::ask_for_numbers(samples)?;
    let mut values = vec![0.0; samples];
    record.read(0, &mut values);
    if !values.iter().all(|&value| is_usable(value)) {
        return Ok(None);
    }
    let known = if noise.is_white() { WHITE } else { COLOURED };
    let mut degree = 0;
    let halving = std::iter::successors(Some(samples), |length| Some(length / SHORTER));
    // The shortest windows see the highest frequencies.
    for length in halving.take_while(|&length| length > 2 * SHORTEST).chain([SHORTEST]) {
        let power = powers(&values, length, noise, instructions)?;
        let count = (samples / length) as f64;
        let noise_alone = |group: &[f64]| {
            let freedom = count * group.len() as f64;
            let excess = group.iter().sum::<f64>() / group.len() as f64 - 1.0;
            excess <= CHANCE * (2.0 / freedom + known * known).sqrt()
        };
        let found = (degree..TRENDS).find(|&degree| power[degree + 1..].chunks(GROUP).all(noise_alone));
        let Some(found) = found else { return Ok(None) };
        degree = found;
    }
    Ok(Some(degree))
}

/// By degree, the mean square of the coefficients of windows side by side, over that of the noise.
fn powers(
    values: &[f64],
    length: usize,
    noise: &CorrelatedNoise,
    instructions: Instructions,
) -> Result<Vec<f64>, Error> {
    let basis = basis(length, DEGREES)?;
    let (total, count) = (noise.variance(), (values.len() / length) as f64);
    let squares = dispatch(instructions, CoefficientSquares { values, basis: &basis });
    let norms = dispatch(instructions, BasisNorms(&basis));
    let power = |(degree, square): (usize, f64)| {
        let expected = if noise.is_white() {
            norms[degree]
        } else {
            let row: Vec<f64> = (0..length).map(|index| basis.value(degree, index)).collect();
            row.iter().zip(noise.correlate(&row)).map(|(a, b)| a * b).sum()
        };
        square / count / (expected * total)
    };
    Ok(squares.into_iter().enumerate().map(power).collect())
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

/// By degree, the sum of the squared coefficients of windows side by side.
struct CoefficientSquares<'a> {
    values: &'a [f64],
    basis: &'a Basis,
}

impl Kernel for CoefficientSquares<'_> {
    type Output = [f64; DEGREES];

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) -> [f64; DEGREES] {
        let length = self.basis.length();
        let mut squares = [Packet::ZERO; DEGREES / WIDTH];
        for window in self.values.chunks_exact(length) {
            let mut sums = [Packet::ZERO; DEGREES / WIDTH];
            for (index, value) in window.iter().enumerate() {
                // The reference keeps the digits of a small motion on a large offset.
                let value = value - window[length / 2];
                let (row, mirrored) = self.basis.row(index);
                let odd = if mirrored { -value } else { value };
                let values = Packet([value, odd, value, odd, value, odd, value, odd]);
                for (sum, row) in sums.iter_mut().zip(row.chunks_exact(WIDTH)) {
                    *sum += values * Packet::load(row);
                }
            }
            for (square, sum) in squares.iter_mut().zip(sums) {
                *square += sum * sum;
            }
        }
        let mut all = [0.0; DEGREES];
        for (all, square) in all.chunks_mut(WIDTH).zip(squares) {
            all.copy_from_slice(&square.0);
        }
        all
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

    fn found(signal: impl Fn(f64) -> f64) -> Option<usize> {
        let samples: Vec<f64> = noise().iter().enumerate().map(|(i, e)| e + signal(i as f64 / 4000.0)).collect();
        trend(&samples.as_slice(), &CorrelatedNoise::white(1.0), Instructions::current()).expect("little memory")
    }

    #[test]
    fn a_constant_a_line_and_a_parabola_are_trends() {
        assert_eq!(found(|_| 1e6), Some(0));
        assert_eq!(found(|t| 10.0 * t - 3.0), Some(1));
        assert_eq!(found(|t| 10.0 * t * t), Some(2));
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
        let found = |samples: &[f64], variance: f64| {
            trend(&samples, &CorrelatedNoise::white(variance), Instructions::current())
        };
        assert_eq!(found(&samples, 0.0), Ok(None));
        samples[100] = f64::NAN;
        assert_eq!(found(&samples, 1.0), Ok(None));
    }
}
