//! Sums of Chebyshev polynomials over the samples of windows that share a basis: a window in each lane.
//!
//! Since `2 T_i T_j = T_{i+j} + T_{|i-j|}`, the sums of `T_0 .. T_{2p}` are the normal matrix of all orders up to `p`.

use crate::local_polynomials::options::HIGHEST_ORDER;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// Polynomials at most.
pub(crate) const MOST: usize = HIGHEST_ORDER + 1;

/// Derivatives at most, the value among them.
pub(crate) const DERIVATIVES: usize = 6;

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
        // The weight multiplies every polynomial, for their recurrence is linear.
        let mut pair = NeighbouringDegrees::new(simd, times, weights);
        let (moments, higher) = self.moments.0[..2 * degrees - 1].split_at_mut(degrees);
        let (moments, last_moment) = moments.as_chunks_mut::<2>();
        let (products, last_product) = self.products.0[..degrees].as_chunks_mut::<2>();
        for (moments, products) in moments.iter_mut().zip(products) {
            add_all(simd, &mut moments[0], &pair.lower);
            add_products(simd, &mut products[0], &pair.lower, samples);
            pair.raise_lower(simd);
            add_all(simd, &mut moments[1], &pair.upper);
            add_products(simd, &mut products[1], &pair.upper, samples);
            pair.raise_upper(simd);
        }
        if let ([moment], [product]) = (last_moment, last_product) {
            add_all(simd, moment, &pair.lower);
            add_products(simd, product, &pair.lower, samples);
            pair.raise_lower(simd);
            std::mem::swap(&mut pair.lower, &mut pair.upper);
        }
        pair.add_each(simd, higher);
    }
}

/// Polynomials of two degrees that follow each other, at some times: by turns each is raised above the other, in its place.
struct NeighbouringDegrees<S: Lanes, const N: usize> {
    twice: [S::f64s; N],
    lower: [S::f64s; N],
    upper: [S::f64s; N],
}

impl<S: Lanes, const N: usize> NeighbouringDegrees<S, N> {
    /// The lowest two, times a weight.
    #[inline(always)]
    fn new(simd: S, times: &[S::f64s; N], weights: &[S::f64s; N]) -> Self {
        let (mut twice, mut upper) = (*times, *times);
        for n in 0..N {
            twice[n] = simd.add_f64s(times[n], times[n]);
            upper[n] = simd.mul_f64s(times[n], weights[n]);
        }
        Self { twice, lower: *weights, upper }
    }

    /// Adds each polynomial, from the lower degree on, to a sum of its own.
    #[inline(always)]
    fn add_each(mut self, simd: S, sums: &mut [S::f64s]) {
        let (sums, last) = sums.as_chunks_mut::<2>();
        for sums in sums {
            add_all(simd, &mut sums[0], &self.lower);
            self.raise_lower(simd);
            add_all(simd, &mut sums[1], &self.upper);
            self.raise_upper(simd);
        }
        if let [last] = last {
            add_all(simd, last, &self.lower);
        }
    }

    #[inline(always)]
    fn raise_lower(&mut self, simd: S) {
        for n in 0..N {
            self.lower[n] = simd.mul_add_f64s(self.twice[n], self.upper[n], simd.neg_f64s(self.lower[n]));
        }
    }

    #[inline(always)]
    fn raise_upper(&mut self, simd: S) {
        for n in 0..N {
            self.upper[n] = simd.mul_add_f64s(self.twice[n], self.lower[n], simd.neg_f64s(self.upper[n]));
        }
    }
}

#[inline(always)]
fn add_all<S: Lanes, const N: usize>(simd: S, sum: &mut S::f64s, values: &[S::f64s; N]) {
    let mut total = *sum;
    for value in values {
        total = simd.add_f64s(total, *value);
    }
    *sum = total;
}

#[inline(always)]
fn add_products<S: Lanes, const N: usize>(simd: S, sum: &mut S::f64s, ones: &[S::f64s; N], others: &[S::f64s; N]) {
    let mut total = *sum;
    for (one, other) in ones.iter().zip(others) {
        total = simd.mul_add_f64s(*one, *other, total);
    }
    *sum = total;
}

/// A sum of polynomials that is taken off samples, and sums of what is left of them.
pub(crate) struct TakenOff<S: Lanes> {
    pub(crate) coefficients: OnLines<S::f64s, MOST>,
    /// `Σ T_k y` of what is left, weighted, and `Σ y²`.
    pub(crate) products: OnLines<S::f64s, MOST>,
    pub(crate) square: S::f64s,
}

impl<S: Lanes> TakenOff<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, coefficients: OnLines<S::f64s, MOST>) -> Self {
        let zero = simd.splat_f64s(0.0);
        Self { coefficients, products: OnLines([zero; MOST]), square: zero }
    }

    /// What is left of samples at some times.
    ///
    /// The sum is made from its last coefficient down (Clenshaw 1955), so that polynomials need no memory until products are made with them.
    #[inline(always)]
    pub(crate) fn take_off<const N: usize>(
        &mut self,
        simd: S,
        degrees: usize,
        times: &[S::f64s; N],
        weights: &[S::f64s; N],
        samples: &mut [S::f64s; N],
    ) {
        let degrees = degrees.min(MOST);
        let zero = simd.splat_f64s(0.0);
        let (mut twice, mut last, mut before) = ([zero; N], [zero; N], [zero; N]);
        for n in 0..N {
            twice[n] = simd.add_f64s(times[n], times[n]);
        }
        let (pairs, top) = self.coefficients.0[1..degrees].as_chunks::<2>();
        if let [top] = top {
            last = [*top; N];
        }
        // Two steps at a time, each in the place of the one before the last.
        for [lower, upper] in pairs.iter().rev() {
            for n in 0..N {
                before[n] = simd.mul_add_f64s(twice[n], last[n], simd.sub_f64s(*upper, before[n]));
            }
            for n in 0..N {
                last[n] = simd.mul_add_f64s(twice[n], before[n], simd.sub_f64s(*lower, last[n]));
            }
        }
        let mut weighted = *samples;
        for n in 0..N {
            let value = simd.mul_add_f64s(times[n], last[n], simd.sub_f64s(self.coefficients.0[0], before[n]));
            samples[n] = simd.sub_f64s(samples[n], value);
            weighted[n] = simd.mul_f64s(samples[n], weights[n]);
            self.square = simd.mul_add_f64s(weighted[n], samples[n], self.square);
        }
        // What is left multiplies every polynomial, for their recurrence is linear.
        NeighbouringDegrees::new(simd, times, &weighted).add_each(simd, &mut self.products.0[..degrees]);
    }
}

/// The polynomials and their derivatives at a time: by derivative, then by degree.
#[inline(always)]
pub(crate) fn at<S: Lanes>(simd: S, degrees: usize, time: S::f64s, derivatives: &mut [[S::f64s; MOST]]) {
    // What goes from degree to degree stays in registers where the compiler knows how many there are.
    match derivatives {
        [_] => at_with::<S, 1>(simd, degrees, time, derivatives),
        [_, _] => at_with::<S, 2>(simd, degrees, time, derivatives),
        [_, _, _] => at_with::<S, 3>(simd, degrees, time, derivatives),
        _ => at_with::<S, DERIVATIVES>(simd, degrees, time, derivatives),
    }
}

#[inline(always)]
fn at_with<S: Lanes, const N: usize>(simd: S, degrees: usize, time: S::f64s, derivatives: &mut [[S::f64s; MOST]]) {
    let (zero, one, twice) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0), simd.add_f64s(time, time));
    // T_{k+1} = 2 u T_k - T_{k-1}, differentiated; T_{-1} = T_1 = u.
    let (mut last, mut before) = ([zero; N], [zero; N]);
    (last[0], before[0]) = (one, simd.neg_f64s(time));
    if let Some(before) = before.get_mut(1) {
        *before = simd.neg_f64s(one);
    }
    for k in 0..degrees.min(MOST) {
        let mut lower = zero;
        for derivative in 0..N {
            if let Some(values) = derivatives.get_mut(derivative) {
                values[k] = last[derivative];
            }
            let factor = simd.splat_f64s(2.0 * derivative as f64);
            let raised = simd.mul_add_f64s(twice, last[derivative], before[derivative]);
            (before[derivative], lower, last[derivative]) =
                (simd.neg_f64s(last[derivative]), last[derivative], simd.mul_add_f64s(factor, lower, raised));
        }
    }
}
