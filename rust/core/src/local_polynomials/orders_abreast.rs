//! The order of windows side by side, their derivatives and standard errors: as [`crate::local_polynomials::own_orders`] has them for a window alone.

use crate::local_polynomials::chebyshev_sums::{DERIVATIVES, MOST};
use crate::local_polynomials::table_columns::TableColumns;
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
pub(crate) struct ChosenOrders<S: Lanes> {
    pub(crate) order: S::f64s,
    pub(crate) variance: S::f64s,
    pub(crate) exact: S::m64s,
}

/// What a derivative follows from.
pub(crate) struct DerivativeParts<'a, S: Lanes> {
    /// Of the orthogonal polynomials, what the samples have in these, and one over their sums of squares.
    pub(crate) polynomials: &'a [S::f64s; MOST],
    pub(crate) coefficients: &'a [S::f64s; MOST],
    pub(crate) inverse: &'a [S::f64s; MOST],
    /// That of the fit of the highest order.
    pub(crate) full: S::f64s,
    /// Its number, and which windows have samples off their centre: these take the order that is the best for it.
    pub(crate) off_centre: Option<(usize, S::m64s)>,
}

/// What every order's share in the error of each window is.
pub(crate) struct OrderShares<S: Lanes> {
    /// By order; their sum is one.
    shares: OnLines<S::f64s, MOST>,
    /// Whether an order has a share in any lane.
    counts: [bool; MOST],
}

impl<S: Lanes> ChosenOrders<S> {
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
    pub(crate) fn fixed(&self, simd: S, columns: &TableColumns) -> ChosenOrders<S> {
        let order = self.degrees - 1;
        let residual = self.residuals.0[order];
        ChosenOrders {
            order: simd.splat_f64s(order as f64),
            variance: simd.mul_f64s(residual, simd.load(&columns.freedom, order * S::F64_LANES)),
            exact: simd.less_than_or_equal_f64s(residual, self.floor),
        }
    }

    /// The order of the least weighted residual, the lowest of equals.
    #[inline(always)]
    pub(crate) fn choose(&self, simd: S, columns: &TableColumns) -> ChosenOrders<S> {
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
        ChosenOrders { order, variance: simd.mul_f64s(variance, residual), exact }
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

    /// A derivative and its standard error.
    #[inline(always)]
    pub(crate) fn estimate(
        &self,
        simd: S,
        columns: &TableColumns,
        (choice, shares): (&ChosenOrders<S>, Option<&OrderShares<S>>),
        derivative: &DerivativeParts<'_, S>,
    ) -> (S::f64s, S::f64s) {
        let zero = simd.splat_f64s(0.0);
        let DerivativeParts { polynomials, coefficients, inverse, full, off_centre } = *derivative;
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
        if let Some(lowest) = off_centre {
            (taken, of_taken) = self.best(simd, choice, lowest, [&values.0, &gains.0], [taken, of_taken]);
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

impl<S: Lanes> OrderResiduals<S> {
    /// The value and the gain of the order with the least estimated squared bias plus variance (see `off_centre`), from that of the derivative to the
    /// one that was chosen; where windows are full those of that one.
    #[inline(always)]
    fn best(
        &self,
        simd: S,
        choice: &ChosenOrders<S>,
        (derivative, is_off_centre): (usize, S::m64s),
        [values, gains]: [&[S::f64s; MOST]; 2],
        [value, gain]: [S::f64s; 2],
    ) -> (S::f64s, S::f64s) {
        let (mut taken, mut of_taken) = (value, gain);
        let mut least = simd.mul_f64s(choice.variance, gain);
        for order in (derivative..self.degrees).rev() {
            let is_lower = simd.less_than_f64s(simd.splat_f64s(order as f64), choice.order);
            let chance = simd.mul_f64s(choice.variance, simd.sub_f64s(gain, gains[order]));
            let off = simd.sub_f64s(values[order], value);
            let bias = simd.max_f64s(simd.sub_f64s(simd.mul_f64s(off, off), chance), simd.splat_f64s(0.0));
            let error = simd.mul_add_f64s(choice.variance, gains[order], bias);
            let is_better = simd.and_m64s(is_lower, simd.less_than_or_equal_f64s(error, least));
            let is_taken = simd.and_m64s(is_better, is_off_centre);
            taken = simd.select_f64s(is_taken, values[order], taken);
            of_taken = simd.select_f64s(is_taken, gains[order], of_taken);
            least = simd.select_f64s(is_taken, error, least);
        }
        (taken, of_taken)
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
