//! What rounding changes of a fit that follows from sums over a window's samples: such a fit is kept where that is little.

use crate::local_polynomials::chebyshev_factor::ChebyshevFactor;
use crate::local_polynomials::chebyshev_sums::MOST;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// What rounding may change of a residual sum of squares, at most, as a part of it.
pub(crate) const LOST: f64 = 1e-8;

/// The rounding of the polynomial that is taken off, at most, as a part of the residual sum of squares: where that is rounding itself, or nearly.
const ROUNDED: f64 = 1e-6;

/// Squares of the sums of a polynomial's coefficients' magnitudes, each from one on.
#[inline(always)]
pub(crate) fn tails_of<S: Lanes>(simd: S, degrees: usize, coefficients: &[S::f64s; MOST]) -> OnLines<S::f64s, MOST> {
    let zero = simd.splat_f64s(0.0);
    let (mut tails, mut size) = (OnLines([zero; MOST]), zero);
    for k in (0..degrees.min(MOST)).rev() {
        size = simd.add_f64s(size, simd.abs_f64s(coefficients[k]));
        tails.0[k] = simd.mul_f64s(size, size);
    }
    tails
}

/// What a fit of the highest order leaves, and by how much rounding is amplified.
pub(crate) struct KeptDigits<S: Lanes> {
    pub(crate) residual: S::f64s,
    /// Of a row that is made to grow.
    far: S::f64s,
    weakest: S::f64s,
    /// Of the polynomial that was taken off.
    tails: S::f64s,
}

impl<S: Lanes> KeptDigits<S> {
    /// Of windows that were decomposed, given the squares of their samples and the tails of the polynomial that was taken off these.
    #[inline(always)]
    pub(crate) fn new(
        simd: S,
        degrees: usize,
        factor: &ChebyshevFactor<S>,
        square: S::f64s,
        tails: &[S::f64s; MOST],
    ) -> Self {
        let zero = simd.splat_f64s(0.0);
        let (mut residual, mut far, mut rounded) = (square, zero, zero);
        for (k, (&left, &inverse)) in factor.own.0.iter().zip(&factor.inverse.0).enumerate().take(degrees) {
            let end = factor.grown.0[k];
            residual = simd.negate_mul_add_f64s(simd.mul_f64s(left, left), inverse, residual);
            far = simd.mul_add_f64s(simd.mul_f64s(end, end), inverse, far);
            rounded = simd.mul_add_f64s(tails[k], inverse, rounded);
        }
        Self { residual, far, weakest: factor.weakest, tails: rounded }
    }

    /// Whether rounding changes each window's residual by no more than it may.
    ///
    /// Rounding changes the normal matrix by `ε` times the sum of the weights, and the right-hand side by the same part of its largest sum of squares.
    /// That changes a residual by as much as solutions are amplified: as one that is made to grow, or where a diagonal is large beside
    /// its pivot. The polynomial that was taken off adds the rounding of its own sums, divided by each pivot.
    #[inline(always)]
    pub(crate) fn are_enough(
        &self,
        simd: S,
        degrees: usize,
        (length, weight): (S::f64s, S::f64s),
        (floor, peak): (S::f64s, S::f64s),
    ) -> S::m64s {
        let epsilon = simd.splat_f64s(f64::EPSILON);
        let (rounding, of_weight) = (simd.mul_f64s(length, epsilon), simd.mul_f64s(weight, epsilon));
        let far = simd.mul_f64s(simd.mul_f64s(self.far, simd.splat_f64s(degrees as f64)), of_weight);
        let worst = simd.max_f64s(far, simd.mul_f64s(self.weakest, rounding));
        let lost = simd.mul_f64s(worst, peak);
        let known = simd.max_f64s(self.residual, floor);
        let is_kept = simd.less_than_or_equal_f64s(lost, simd.mul_f64s(known, simd.splat_f64s(LOST)));
        let rounded = simd.mul_f64s(simd.mul_f64s(self.tails, of_weight), simd.splat_f64s(16.0 * f64::EPSILON));
        let is_told = simd.less_than_or_equal_f64s(rounded, simd.mul_f64s(known, simd.splat_f64s(ROUNDED)));
        simd.and_m64s(is_kept, is_told)
    }
}
