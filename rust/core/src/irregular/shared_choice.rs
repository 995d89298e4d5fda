//! The order of windows side by side, their derivatives and standard errors: as [`crate::irregular::window_fit`] has them for a window alone.

use crate::irregular::shared_sums::{DERIVATIVES, MOST};
use crate::irregular::table_columns::TableColumns;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// Residuals of all orders.
pub(crate) struct OrderResiduals<S: Lanes> {
    /// None below the floor, which residuals of rounding or quantisation have at least.
    residuals: OnLines<S::f64s, MOST>,
    floor: S::f64s,
    pub(crate) degrees: usize,
}

/// The order of each window.
pub(crate) struct SharedChoice<S: Lanes> {
    pub(crate) order: S::f64s,
    pub(crate) variance: S::f64s,
    pub(crate) exact: S::m64s,
}

/// What every order's share in the error of each window is.
pub(crate) struct OrderShares<S: Lanes> {
    /// By order; their sum is one.
    shares: OnLines<S::f64s, MOST>,
    /// Whether an order has a share in any lane.
    counts: [bool; MOST],
}

impl<S: Lanes> SharedChoice<S> {
    /// What of orthogonal polynomials is to be added to the one that was taken off: all of `own` up to the order, and above it minus what that has,
    /// over each polynomial's sum of squares.
    #[inline(always)]
    pub(crate) fn left(
        &self,
        simd: S,
        degrees: usize,
        [own, off, inverse]: [&[S::f64s; MOST]; 3],
        left: &mut [S::f64s; MOST],
    ) {
        for k in 0..degrees.min(MOST) {
            let is_above = simd.less_than_f64s(self.order, simd.splat_f64s(k as f64));
            let part = simd.select_f64s(is_above, simd.neg_f64s(off[k]), own[k]);
            left[k] = simd.mul_f64s(part, inverse[k]);
        }
    }
}

impl<S: Lanes> OrderResiduals<S> {
    /// From the residual of the highest order, and coefficients of polynomials whose squares have inverses `inverse`.
    #[inline(always)]
    pub(crate) fn new(
        simd: S,
        degrees: usize,
        last: S::f64s,
        coefficients: &[S::f64s; MOST],
        inverse: &[S::f64s; MOST],
        floor: S::f64s,
    ) -> Self {
        let degrees = degrees.min(MOST);
        let mut residuals = OnLines([floor; MOST]);
        let mut residual = last;
        for order in (0..degrees).rev() {
            residuals.0[order] = simd.max_f64s(residual, floor);
            let square = simd.mul_f64s(coefficients[order], coefficients[order]);
            residual = simd.mul_add_f64s(square, inverse[order], residual);
        }
        Self { residuals, floor, degrees }
    }

    /// An order that is given.
    #[inline(always)]
    pub(crate) fn fixed(&self, simd: S, columns: &TableColumns) -> SharedChoice<S> {
        let order = self.degrees - 1;
        let residual = self.residuals.0[order];
        SharedChoice {
            order: simd.splat_f64s(order as f64),
            variance: simd.mul_f64s(residual, simd.load(&columns.freedom, order * S::F64_LANES)),
            exact: simd.less_than_or_equal_f64s(residual, self.floor),
        }
    }

    /// The order of the least weighted residual, the lowest of equals.
    #[inline(always)]
    pub(crate) fn choose(&self, simd: S, columns: &TableColumns) -> SharedChoice<S> {
        let (zero, lanes) = (simd.splat_f64s(0.0), S::F64_LANES);
        let (mut least, mut order) = (simd.splat_f64s(f64::INFINITY), zero);
        let (mut variance, mut residual) = (zero, zero);
        for one in 0..self.degrees {
            let score = simd.mul_f64s(self.residuals.0[one], simd.load(&columns.weights, one * lanes));
            let better = simd.less_than_f64s(score, least);
            least = simd.select_f64s(better, score, least);
            order = simd.select_f64s(better, simd.splat_f64s(one as f64), order);
            residual = simd.select_f64s(better, self.residuals.0[one], residual);
            variance = simd.select_f64s(better, simd.load(&columns.freedom, one * lanes), variance);
        }
        let exact = simd.less_than_or_equal_f64s(residual, self.floor);
        SharedChoice { order, variance: simd.mul_f64s(variance, residual), exact }
    }

    /// The share of every order in what is known of each window.
    #[inline(always)]
    pub(crate) fn shares(&self, simd: S, columns: &TableColumns) -> OrderShares<S> {
        let (zero, lanes) = (simd.splat_f64s(0.0), S::F64_LANES);
        // For a window of zeros, ratios must be numbers.
        let smallest = simd.splat_f64s(f64::MIN_POSITIVE);
        let (mut scores, mut least) = (OnLines([zero; MOST]), simd.splat_f64s(f64::INFINITY));
        for one in 0..self.degrees {
            let score = simd.mul_f64s(self.residuals.0[one], simd.load(&columns.weights, one * lanes));
            scores.0[one] = simd.max_f64s(score, smallest);
            least = simd.min_f64s(least, scores.0[one]);
        }
        let (mut shares, mut counts, mut total) = (OnLines([zero; MOST]), [false; MOST], zero);
        #[allow(clippy::needless_range_loop, reason = "three columns of one table")]
        for one in 0..self.degrees {
            let ratio = simd.div_f64s(least, scores.0[one]);
            let some = simd.greater_than_f64s(ratio, simd.load(&columns.least, 0));
            counts[one] = simd.bits(some) != 0;
            if counts[one] {
                shares.0[one] = simd.select_f64s(some, power(simd, ratio, columns), zero);
                total = simd.add_f64s(total, shares.0[one]);
            }
        }
        let scale = simd.div_f64s(simd.splat_f64s(1.0), total);
        for share in &mut shares.0[..self.degrees] {
            *share = simd.mul_f64s(*share, scale);
        }
        OrderShares { shares, counts }
    }

    /// A derivative and its standard error: `full` is that of the highest order, `polynomials` the row of the derivative below the factor.
    #[inline(always)]
    pub(crate) fn estimate(
        &self,
        simd: S,
        columns: &TableColumns,
        (choice, shares): (&SharedChoice<S>, Option<&OrderShares<S>>),
        parts: [&[S::f64s; MOST]; 3],
        full: S::f64s,
    ) -> (S::f64s, S::f64s) {
        let zero = simd.splat_f64s(0.0);
        let [polynomials, coefficients, inverse] = parts;
        let (mut values, mut gains) = (OnLines([full; MOST]), OnLines([zero; MOST]));
        let (mut value, mut gain) = (full, zero);
        for order in (0..self.degrees).rev() {
            values.0[order] = value;
            let scaled = simd.mul_f64s(polynomials[order], inverse[order]);
            value = simd.negate_mul_add_f64s(scaled, coefficients[order], value);
            gains.0[order] = simd.mul_f64s(scaled, polynomials[order]);
        }
        let (mut taken, mut of_taken) = (full, zero);
        for order in 0..self.degrees {
            gain = simd.add_f64s(gain, gains.0[order]);
            gains.0[order] = gain;
            let is_taken = simd.equal_f64s(choice.order, simd.splat_f64s(order as f64));
            taken = simd.select_f64s(is_taken, values.0[order], taken);
            of_taken = simd.select_f64s(is_taken, gain, of_taken);
        }
        let Some(OrderShares { shares, counts }) = shares else {
            return (taken, simd.sqrt_f64s(simd.mul_f64s(choice.variance, of_taken)));
        };
        let mut error = zero;
        for order in (0..self.degrees).filter(|order| counts[*order]) {
            let free = simd.load(&columns.freedom, order * S::F64_LANES);
            let variance = simd.mul_f64s(self.residuals.0[order], free);
            let off = simd.sub_f64s(values.0[order], taken);
            let square = simd.mul_add_f64s(off, off, simd.mul_f64s(variance, gains.0[order]));
            let part = simd.mul_f64s(shares.0[order], simd.sqrt_f64s(square));
            // An order without a share in this lane may have no degrees of freedom: nothing times no number.
            let has_share = simd.greater_than_f64s(shares.0[order], zero);
            error = simd.add_f64s(error, simd.select_f64s(has_share, part, zero));
        }
        (taken, error)
    }
}

/// A ratio to the power of half each window's length.
#[inline(always)]
fn power<S: Lanes>(simd: S, ratio: S::f64s, columns: &TableColumns) -> S::f64s {
    let (half, one) = (simd.splat_f64s(0.5), simd.splat_f64s(1.0));
    let odd = simd.greater_than_f64s(simd.load(&columns.odd, 0), half);
    let mut power = simd.select_f64s(odd, simd.sqrt_f64s(ratio), one);
    let mut square = ratio;
    for digits in &columns.digits {
        let is_set = simd.greater_than_f64s(simd.load(digits, 0), half);
        power = simd.select_f64s(is_set, simd.mul_f64s(power, square), power);
        square = simd.mul_f64s(square, square);
    }
    power
}

/// The value of each derivative by a sum of the polynomials with some coefficients.
#[inline(always)]
pub(crate) fn sums<S: Lanes>(
    simd: S,
    degrees: usize,
    polynomials: &[[S::f64s; MOST]],
    coefficients: &[S::f64s; MOST],
) -> [S::f64s; DERIVATIVES] {
    let mut values = [simd.splat_f64s(0.0); DERIVATIVES];
    for (value, row) in values.iter_mut().zip(polynomials) {
        // In a register: sums of several rows side by side would wait for memory at every coefficient.
        let mut sum = simd.splat_f64s(0.0);
        for (polynomial, coefficient) in row.iter().zip(coefficients).take(degrees) {
            sum = simd.mul_add_f64s(*polynomial, *coefficient, sum);
        }
        *value = sum;
    }
    values
}
