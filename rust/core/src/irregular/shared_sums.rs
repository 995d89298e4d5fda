//! Sums of Chebyshev polynomials over the samples of windows that share a basis: a window in each lane.
//!
//! Since `2 T_i T_j = T_{i+j} + T_{|i-j|}`, the sums of `T_0 .. T_{2p}` are the normal matrix of all orders up to `p`.

use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// Polynomials at most.
pub(crate) const MOST: usize = 16;

/// Sums over some samples.
#[derive(Clone)]
pub(crate) struct ChebyshevSums<S: Lanes> {
    /// `Σ T_k`.
    pub(crate) moments: OnLines<S::f64s, { 2 * MOST }>,
    /// `Σ T_k y`.
    pub(crate) products: OnLines<S::f64s, MOST>,
}

impl<S: Lanes> ChebyshevSums<S> {
    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        let zero = simd.splat_f64s(0.0);
        Self { moments: OnLines([zero; 2 * MOST]), products: OnLines([zero; MOST]) }
    }

    /// Adds samples at some times, each with a weight.
    #[inline(always)]
    pub(crate) fn add<const N: usize>(
        &mut self,
        simd: S,
        degrees: usize,
        times: &[S::f64s; N],
        weights: &[S::f64s; N],
        samples: &[S::f64s; N],
    ) {
        let degrees = degrees.min(MOST);
        let mut twice = *times;
        // The weight multiplies every polynomial, for their recurrence is linear. The one before the last has the other sign.
        let (mut last, mut before) = (*weights, *times);
        for n in 0..N {
            twice[n] = simd.add_f64s(times[n], times[n]);
            before[n] = simd.neg_f64s(simd.mul_f64s(times[n], weights[n]));
        }
        for k in 0..degrees {
            let (mut moment, mut product) = (self.moments.0[k], self.products.0[k]);
            for n in 0..N {
                moment = simd.add_f64s(moment, last[n]);
                product = simd.mul_add_f64s(last[n], samples[n], product);
                (last[n], before[n]) = (simd.mul_add_f64s(twice[n], last[n], before[n]), simd.neg_f64s(last[n]));
            }
            (self.moments.0[k], self.products.0[k]) = (moment, product);
        }
        for k in degrees..2 * degrees - 1 {
            let mut moment = self.moments.0[k];
            for n in 0..N {
                moment = simd.add_f64s(moment, last[n]);
                (last[n], before[n]) = (simd.mul_add_f64s(twice[n], last[n], before[n]), simd.neg_f64s(last[n]));
            }
            self.moments.0[k] = moment;
        }
    }
}

/// A sum of polynomials that is taken off samples, and sums of what is left of them.
pub(crate) struct TakenOff<S: Lanes, const N: usize> {
    pub(crate) coefficients: OnLines<S::f64s, MOST>,
    /// `Σ T_k y` of what is left, weighted, and `Σ y²`.
    pub(crate) products: OnLines<S::f64s, MOST>,
    pub(crate) square: S::f64s,
    /// Polynomials at some times.
    polynomials: OnLines<[S::f64s; N], MOST>,
}

impl<S: Lanes, const N: usize> TakenOff<S, N> {
    #[inline(always)]
    pub(crate) fn new(simd: S, coefficients: OnLines<S::f64s, MOST>) -> Self {
        let zero = simd.splat_f64s(0.0);
        let (products, polynomials) = (OnLines([zero; MOST]), OnLines([[zero; N]; MOST]));
        Self { coefficients, products, square: zero, polynomials }
    }

    /// What is left of samples at some times.
    #[inline(always)]
    pub(crate) fn take_off(
        &mut self,
        simd: S,
        degrees: usize,
        times: &[S::f64s; N],
        weights: &[S::f64s; N],
        samples: &mut [S::f64s; N],
    ) {
        let degrees = degrees.min(MOST);
        let (mut twice, mut before, mut last) = (*times, *times, [simd.splat_f64s(1.0); N]);
        for n in 0..N {
            twice[n] = simd.add_f64s(times[n], times[n]);
            before[n] = simd.neg_f64s(times[n]);
        }
        // From the highest coefficient down would need no table, but products need the polynomials.
        for k in 0..degrees {
            self.polynomials.0[k] = last;
            for n in 0..N {
                samples[n] = simd.negate_mul_add_f64s(self.coefficients.0[k], last[n], samples[n]);
                (last[n], before[n]) = (simd.mul_add_f64s(twice[n], last[n], before[n]), simd.neg_f64s(last[n]));
            }
        }
        let mut weighted = *samples;
        for n in 0..N {
            weighted[n] = simd.mul_f64s(samples[n], weights[n]);
            self.square = simd.mul_add_f64s(weighted[n], samples[n], self.square);
        }
        for k in 0..degrees {
            let mut product = self.products.0[k];
            for (polynomial, sample) in self.polynomials.0[k].iter().zip(&weighted) {
                product = simd.mul_add_f64s(*polynomial, *sample, product);
            }
            self.products.0[k] = product;
        }
    }
}

/// The polynomials and their derivatives at a time: by derivative, then by degree.
#[inline(always)]
pub(crate) fn at<S: Lanes>(simd: S, degrees: usize, time: S::f64s, derivatives: &mut [[S::f64s; MOST]]) {
    let (zero, twice) = (simd.splat_f64s(0.0), simd.add_f64s(time, time));
    for derivative in 0..derivatives.len() {
        // T_{k+1} = 2 u T_k - T_{k-1}, differentiated; T_{-1} = T_1 = u.
        let factor = simd.splat_f64s(2.0 * derivative as f64);
        let (mut last, mut before) = match derivative {
            0 => (simd.splat_f64s(1.0), simd.neg_f64s(time)),
            1 => (zero, simd.splat_f64s(-1.0)),
            _ => (zero, zero),
        };
        #[allow(clippy::needless_range_loop, reason = "two rows of one table")]
        for k in 0..degrees.min(MOST) {
            derivatives[derivative][k] = last;
            let lower = if derivative == 0 { zero } else { derivatives[derivative - 1][k] };
            let next = simd.mul_add_f64s(factor, lower, simd.mul_add_f64s(twice, last, before));
            (last, before) = (next, simd.neg_f64s(last));
        }
    }
}
