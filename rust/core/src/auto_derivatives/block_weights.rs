//! Weights of candidates from their logarithms, block by block, in vectors.

use crate::auto_derivatives::differences::total;
use crate::simd::f64x8::{Packet, WIDTH};
use crate::simd::vectors::{Kernel, Lanes};

/// Candidates of less weight are left out, unless they add more than that to the variance: a window of an eighth has the weight of a millionth where
/// its variance is as much larger.
const NEGLIGIBLE: f64 = 1e-5;
const NEGLIGIBLE_VARIANCE: f64 = 1e-3;

/// The logarithm of a weight that is left out whatever it adds to the variance, and of one that is where its variance is at most so many times
/// that of the best.
const NOTHING: f64 = -46.0;
const LITTLE: f64 = -11.6;
const MANY_TIMES: f64 = 100.0;

/// `ln 2` in two parts, of which the first has so few digits that small multiples of it are exact.
const LN_2: [f64; 2] = [f64::from_bits(0x3FE6_2E42_FEE0_0000), f64::from_bits(0x3DEA_39EF_3579_3C76)];

/// Added to a number below `2⁵¹`, it leaves the nearest whole number in the lowest bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Bits of the digits of a number, below those of its exponent.
const DIGITS: u32 = 52;

/// `1/k!` from 13 down to 0: what follows is below `2⁻⁵⁷` for half of `ln 2`.
const TERMS: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// Turns the logarithms of blocks' weights, of which the largest is zero, into weights. Where all are left out there is nothing to average.
pub(crate) struct BlockWeights<'a> {
    /// Block by block, as many as there are variances.
    pub(crate) weights: &'a mut [f64],
    /// Of the candidates, then zeros: whole vectors.
    pub(crate) variances: &'a [f64],
    /// Whether a candidate has weight in any block.
    pub(crate) used: &'a mut [bool],
}

impl Kernel for BlockWeights<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _: S) {
        let Self { weights, variances, used } = self;
        let mut largest = vec![Packet::ZERO; variances.len() / WIDTH];
        for row in weights.chunks_exact_mut(variances.len()) {
            // The last of the best: all others are below zero, or the negative zero.
            let mut variance = 0.0;
            for (weight, own) in row.iter().zip(variances) {
                variance = if weight.to_bits() == 0 { *own } else { variance };
            }
            let (many, enough) = (MANY_TIMES * variance, NEGLIGIBLE_VARIANCE * variance);
            let mut sum = Packet::ZERO;
            for (weights, variances) in row.chunks_exact_mut(WIDTH).zip(variances.chunks_exact(WIDTH)) {
                let (mut logarithms, variances) = (Packet::load(weights), Packet::load(variances));
                let mut counted = Packet::ZERO;
                for lane in 0..WIDTH {
                    let counts = logarithms.0[lane] > if variances.0[lane] > many { NOTHING } else { LITTLE };
                    logarithms.0[lane] = if counts { logarithms.0[lane] } else { 0.0 };
                    counted.0[lane] = if counts { 1.0 } else { 0.0 };
                }
                let found = exponential(logarithms) * counted;
                sum += found;
                found.store(weights);
            }
            let (all, mut kept) = (Packet::splat(total(sum)), Packet::ZERO);
            for (weights, variances) in row.chunks_exact_mut(WIDTH).zip(variances.chunks_exact(WIDTH)) {
                let mut shares = Packet::load(weights) / all;
                let added = shares * Packet::load(variances);
                for lane in 0..WIDTH {
                    let counts = shares.0[lane] > NEGLIGIBLE || added.0[lane] > enough;
                    shares.0[lane] = if counts { shares.0[lane] } else { 0.0 };
                }
                kept += shares;
                shares.store(weights);
            }
            let kept = Packet::splat(total(kept));
            for (weights, largest) in row.chunks_exact_mut(WIDTH).zip(&mut largest) {
                let mut shares = Packet::load(weights) / kept;
                for lane in 0..WIDTH {
                    // Nothing of nothing is none.
                    shares.0[lane] = if kept.0[lane] > 0.0 { shares.0[lane] } else { 0.0 };
                }
                *largest = largest.max(shares);
                shares.store(weights);
            }
        }
        for (used, largest) in used.iter_mut().zip(largest.iter().flat_map(|largest| largest.0)) {
            *used = largest > 0.0;
        }
    }
}

/// The exponential function of numbers from -700 to zero, to two roundings.
#[inline(always)]
fn exponential(of: Packet) -> Packet {
    let shifted = of * Packet::splat(std::f64::consts::LOG2_E) + Packet::splat(WHOLE);
    let whole = shifted - Packet::splat(WHOLE);
    let rest = (of - whole * Packet::splat(LN_2[0])) - whole * Packet::splat(LN_2[1]);
    let mut sum = Packet::splat(TERMS[0]);
    for &term in &TERMS[1..] {
        sum = sum * rest + Packet::splat(term);
    }
    for lane in 0..WIDTH {
        // Times a power of two.
        let power = shifted.0[lane].to_bits() << DIGITS;
        sum.0[lane] = f64::from_bits(sum.0[lane].to_bits().wrapping_add(power));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::instructions::Instructions;
    use crate::simd::vectors::dispatch;

    #[test]
    fn exponentials_are_right_but_for_rounding() {
        for i in 0..100_000_i32 {
            let numbers = Packet(std::array::from_fn(|lane| -46.0 * f64::from(8 * i) / 8e5 - 1e-7 * lane as f64));
            for (number, found) in numbers.0.into_iter().zip(exponential(numbers).0) {
                assert!((found / number.exp() - 1.0).abs() <= 2.0 * f64::EPSILON, "{number}");
            }
        }
        assert_eq!(exponential(Packet::ZERO), Packet::ONE);
    }

    #[test]
    fn weights_are_those_of_the_definition_on_every_path() {
        let variances = [1.0, 2.0, 500.0, 3.0, 1.0, 4.0, 1e4, 1.0, 2.0, 1.0, 7.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let (candidates, infinite) = (11, f64::NEG_INFINITY);
        // Of the second block nothing is known; of the third, two are the best. Beyond the last candidate anything may stand that is below zero or no number.
        let blocks = [
            [-1.0, 0.0, -12.0, -12.0, -3.0, -0.5, -40.0, -11.5, -1e3, infinite, -5.0],
            [infinite; 11],
            [0.0, -2.0, -47.0, -0.0, 0.0, -9.0, -11.7, -11.7, -7.0, -1.0, -20.0],
        ];
        let beyond = [infinite, f64::NAN, infinite, -1e9, infinite];
        let rows: Vec<f64> = blocks.iter().flat_map(|block| block.iter().chain(&beyond)).copied().collect();
        let mut first_path: Option<Vec<u64>> = None;
        for instructions in Instructions::available() {
            let (mut weights, mut used) = (rows.clone(), [true; 11]);
            dispatch(instructions, BlockWeights { weights: &mut weights, variances: &variances, used: &mut used });
            let mut expected_used = [false; 11];
            for (block, found) in blocks.iter().zip(weights.chunks_exact(variances.len())) {
                let best = block.iter().rposition(|log| log.to_bits() == 0);
                let variance = best.map_or(0.0, |best| variances[best]);
                let limit = |one: usize| if variances[one] > 100.0 * variance { -46.0 } else { -11.6 };
                let raw = |one: usize| if block[one] > limit(one) { block[one].exp() } else { 0.0 };
                let all: f64 = (0..candidates).map(raw).sum();
                let counts = |share: f64, one: usize| share > 1e-5 || share * variances[one] > 1e-3 * variance;
                let share = |one: usize| Some(raw(one) / all).filter(|&share| counts(share, one)).unwrap_or(0.0);
                let kept: f64 = (0..candidates).map(share).sum();
                for (one, used) in expected_used.iter_mut().enumerate() {
                    let weight = if kept > 0.0 { share(one) / kept } else { 0.0 };
                    assert!(
                        (found[one] - weight).abs() <= 8.0 * f64::EPSILON * weight,
                        "{one}: {} {weight}",
                        found[one]
                    );
                    *used |= weight > 0.0;
                }
                assert!(found[candidates..].iter().all(|&beyond| beyond == 0.0));
            }
            assert_eq!(used, expected_used);
            let bits: Vec<u64> = weights.iter().map(|weight| weight.to_bits()).collect();
            assert_eq!(*first_path.get_or_insert_with(|| bits.clone()), bits, "the same bits on every path");
        }
    }
}
