//! The discrete Fourier transform of real sequences.
//!
//! Two neighbouring samples are one complex number, so a transform of half the length does all the work; the sums of the even and of
//! the odd samples are separated afterwards. Lengths are powers of two, so that one small algorithm serves: a planner for every
//! length would take a third of the time that this crate takes to compile.

use std::f64::consts::TAU;

use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};

/// The transform of real sequences of one length, a power of two.
pub(crate) struct Transform {
    length: usize,
    pairs: Radix4<f64>,
    /// `e^(-2πik/N)`, for the frequencies up to half the sample rate.
    turns: Vec<Complex<f64>>,
}

impl Transform {
    pub(crate) fn new(length: usize) -> Self {
        debug_assert!(length.is_power_of_two(), "transforms are of lengths that are powers of two");
        let length = length.next_power_of_two();
        let turns = (0..=length / 2).map(|k| Complex::from_polar(1.0, -TAU * k as f64 / length as f64)).collect();
        Self { length, pairs: Radix4::new((length / 2).max(1), FftDirection::Forward), turns }
    }

    /// Frequencies from zero to half the sample rate, real and imaginary parts.
    pub(crate) fn of(&self, samples: &[f64]) -> Vec<[f64; 2]> {
        debug_assert_eq!(samples.len(), self.length, "a transform is for sequences of its length");
        if self.length == 1 {
            return vec![[samples[0], 0.0]];
        }
        let pairs: Vec<_> = samples.chunks_exact(2).map(|pair| Complex::new(pair[0], pair[1])).collect();
        let mut sums = vec![Complex::ZERO; pairs.len()];
        let mut scratch = vec![Complex::ZERO; self.pairs.get_immutable_scratch_len()];
        self.pairs.process_immutable_with_scratch(&pairs, &mut sums, &mut scratch);
        sums.push(sums[0]);
        let turned = self.turns.iter().zip(&sums).zip(sums.iter().rev()).map(|((turn, one), mirrored)| {
            let mirrored = mirrored.conj();
            let (even, odd) = ((one + mirrored) * 0.5, (one - mirrored) * Complex::new(0.0, -0.5));
            let value = even + odd * turn;
            [value.re, value.im]
        });
        turned.collect()
    }

    /// The frequency response of a kernel that is centred on its middle sample.
    pub(crate) fn response(&self, kernel: &[f64]) -> Vec<[f64; 2]> {
        let (half, length) = (kernel.len() / 2, self.length);
        let mut padded = vec![0.0; length];
        for (k, &value) in kernel.iter().enumerate() {
            // A dot product reads forwards in time, so the response is that of the kernel turned round.
            padded[(length + half - k) % length] += value;
        }
        self.of(&padded)
    }
}

/// A kernel whose responses are multiplied by real gains: at the frequencies of a transform of a power of two, from zero to half the sample rate.
pub(crate) fn filtered(kernel: &[f64], gains: &[f64]) -> Vec<f64> {
    let length = 2 * (gains.len() - 1);
    let (forward, back) =
        [FftDirection::Forward, FftDirection::Inverse].map(|direction| Radix4::new(length, direction)).into();
    let mut padded: Vec<Complex<f64>> = kernel.iter().map(|value| Complex::new(*value, 0.0)).collect();
    padded.resize(length, Complex::ZERO);
    let mut scratch = vec![Complex::ZERO; forward.get_inplace_scratch_len().max(back.get_inplace_scratch_len())];
    forward.process_with_scratch(&mut padded, &mut scratch);
    for (bin, value) in padded.iter_mut().enumerate() {
        *value *= gains[bin.min(length - bin)] / length as f64;
    }
    back.process_with_scratch(&mut padded, &mut scratch);
    padded[..kernel.len()].iter().map(|value| value.re).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn a_transform_is_the_sum_it_is_defined_by() {
        for length in [1_u32, 2, 4, 8, 16, 64, 256] {
            let samples: Vec<f64> = (0..length).map(|i| (f64::from(i) * 1.7).sin() + 0.1 * f64::from(i)).collect();
            let found = Transform::new(samples.len()).of(&samples);
            assert_eq!(found.len(), samples.len() / 2 + 1);
            // What the reference itself loses: each term its angle's rounding, which grows with the angle.
            let largest: f64 = samples.iter().map(|value| value.abs()).sum();
            let tolerance = 4.0 * f64::EPSILON * PI * f64::from(length) * largest;
            for (k, [real, imaginary]) in found.into_iter().enumerate() {
                let angle = |i: usize| -2.0 * PI * (k * i) as f64 / f64::from(length);
                let expected = [
                    samples.iter().enumerate().map(|(i, value)| value * angle(i).cos()).sum::<f64>(),
                    samples.iter().enumerate().map(|(i, value)| value * angle(i).sin()).sum::<f64>(),
                ];
                assert!((real - expected[0]).abs() <= tolerance && (imaginary - expected[1]).abs() <= tolerance);
            }
        }
    }

    #[test]
    fn a_response_tells_what_a_kernel_makes_of_a_sine() {
        let kernel: Vec<f64> = (-3..=3).map(|k| f64::from(k * k + k)).collect();
        let found = Transform::new(32).response(&kernel)[5];
        let omega = 2.0 * PI * 5.0 / 32.0;
        let expected = kernel.iter().enumerate().fold([0.0, 0.0], |[real, imaginary], (k, value)| {
            let angle = omega * (k as f64 - 3.0);
            [real + value * angle.cos(), imaginary + value * angle.sin()]
        });
        assert!((found[0] - expected[0]).abs() < 1e-12 && (found[1] - expected[1]).abs() < 1e-12);
    }
}
