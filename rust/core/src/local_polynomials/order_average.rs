//! The average over orders in each lane's window, with Akaike's weights (see [`crate::local_polynomials::order_selection`]).
//!
//! With `s_n = RSS_n · exp(penalty_n / M)` and `s` the smallest of them, the weight of order `n` is `(s / s_n)^(M/2)`: products and one
//! square root instead of a logarithm and an exponential. Rounding errors of the ratio grow by a factor of `M/2`, as they do by way of
//! the logarithm.

use crate::local_polynomials::options::{Order, PolynomialOptions, Selection};
use crate::local_polynomials::sliding_projection::{ROUNDING, State};
use crate::simd::unroll::unroll;
use crate::simd::vectors::{Lanes, TABLE};

/// An order whose criterion is twice this much above the best has no share: it would be less than 1e-17.
const NEGLIGIBLE: f64 = 40.0;

/// What the average knows of every order.
#[derive(Clone, Debug)]
pub(crate) struct Akaike {
    /// Samples in a window.
    length: usize,
    /// What residuals are multiplied by before orders are compared; infinite for what is no candidate.
    weights: [f64; TABLE],
    /// One over the degrees of freedom of the residual; zero for what is no candidate.
    freedom: [f64; TABLE],
    /// No residual is taken to be smaller.
    floor: f64,
    /// A ratio below this gives no share.
    least: f64,
}

/// What stands for each lane's window.
pub(crate) struct Average<S: Lanes, const D: usize> {
    /// What share of the estimate each coefficient has: that of all orders that reach it.
    pub(crate) reach: [S::f64s; D],
    /// The order of the largest share, the lowest of equals.
    pub(crate) order: S::f64s,
    /// Whether its residual is at the floor.
    pub(crate) exact: S::m64s,
    pub(crate) variance: S::f64s,
}

impl Akaike {
    /// What averages as options say, or `None` where an order is fixed or chosen.
    pub(crate) fn of(options: &PolynomialOptions, degrees: usize) -> Option<Self> {
        match (options.order, options.selection) {
            (Order::Chosen { criterion, .. }, Selection::Average) => {
                let length = options.window_length;
                let weights: Vec<f64> = (0..degrees).map(|order| criterion.weight(order, length)).collect();
                Some(Self::new(&weights, length, options.quantisation_floor()))
            }
            _ => None,
        }
    }

    /// For the weights of the candidates in a window of so many samples.
    pub(crate) fn new(weights: &[f64], length: usize, floor: f64) -> Self {
        let freedom = |order: usize| weights.get(order).map_or(0.0, |_| ((length - order - 1) as f64).recip());
        Self {
            length,
            weights: std::array::from_fn(|order| weights.get(order).copied().unwrap_or(f64::INFINITY)),
            freedom: std::array::from_fn(freedom),
            // For a window of zeros, ratios must be numbers.
            floor: floor.max(f64::MIN_POSITIVE),
            least: (-2.0 * NEGLIGIBLE / length as f64).exp(),
        }
    }

    /// The share of every order in one window, from its residuals, of which none is zero.
    pub(crate) fn shares(&self, residuals: &[f64]) -> Vec<f64> {
        let scores = || residuals.iter().zip(&self.weights).map(|(residual, weight)| residual * weight);
        let best = scores().fold(f64::INFINITY, f64::min);
        let mut shares: Vec<f64> = scores().map(|score| best / score).collect();
        self.raise(&mut shares);
        let total: f64 = shares.iter().sum();
        for share in &mut shares {
            *share /= total;
        }
        shares
    }

    /// Makes weights of ratios.
    pub(crate) fn raise(&self, ratios: &mut [f64]) {
        for ratios in ratios.chunks_mut(64) {
            let (mut powers, mut squares) = ([1.0; 64], [0.0; 64]);
            for (square, ratio) in squares.iter_mut().zip(&*ratios) {
                *square = if *ratio < self.least { 0.0 } else { *ratio };
            }
            if self.length % 2 == 1 {
                powers.iter_mut().zip(&squares).for_each(|(power, ratio)| *power = ratio.sqrt());
            }
            let mut exponent = self.length / 2;
            loop {
                if exponent % 2 == 1 {
                    powers.iter_mut().zip(&squares).for_each(|(power, square)| *power *= square);
                }
                exponent /= 2;
                if exponent == 0 {
                    break;
                }
                for square in &mut squares {
                    *square *= *square;
                }
            }
            ratios.iter_mut().zip(powers).for_each(|(ratio, power)| *ratio = power);
        }
    }

    /// The average of each lane's window.
    #[inline(always)]
    pub(crate) fn average<S: Lanes, const D: usize>(&self, simd: S, state: &State<S, D>) -> Average<S, D> {
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let floor = simd.max_f64s(simd.mul_f64s(state.energy, simd.splat_f64s(ROUNDING)), simd.splat_f64s(self.floor));
        let (mut residuals, mut scores) = ([zero; D], [zero; D]);
        let mut residual = state.residual;
        let mut best = simd.splat_f64s(f64::MAX);
        unroll!(rev N < D, {
            residuals[N] = simd.max_f64s(residual, floor);
            scores[N] = simd.mul_f64s(residuals[N], simd.splat_f64s(self.weights[N % TABLE]));
            best = simd.min_f64s(scores[N], best);
            residual = simd.mul_add_f64s(state.coefficients[N], state.coefficients[N], residual);
        });
        let _ = residual;
        let mut shares = [zero; D];
        let (mut total, mut variance) = (zero, zero);
        let (mut largest, mut order, mut of_order) = (zero, zero, zero);
        unroll!(rev N < D, {
            let ratio = simd.div_f64s(best, scores[N]);
            let counts = simd.greater_than_or_equal_f64s(ratio, simd.splat_f64s(self.least));
            let mut square = simd.select_f64s(counts, ratio, zero);
            let mut share = if self.length % 2 == 1 { simd.sqrt_f64s(square) } else { one };
            let mut exponent = self.length / 2;
            while exponent > 0 {
                if exponent % 2 == 1 {
                    share = simd.mul_f64s(share, square);
                }
                square = simd.mul_f64s(square, square);
                exponent /= 2;
            }
            shares[N] = share;
            total = simd.add_f64s(total, share);
            let more = simd.mul_f64s(residuals[N], simd.splat_f64s(self.freedom[N % TABLE]));
            variance = simd.mul_add_f64s(share, more, variance);
            let leads = simd.greater_than_or_equal_f64s(share, largest);
            largest = simd.select_f64s(leads, share, largest);
            order = simd.select_f64s(leads, simd.splat_f64s(N as f64), order);
            of_order = simd.select_f64s(leads, residuals[N], of_order);
        });
        let _ = largest;
        let scale = simd.div_f64s(one, total);
        let mut reach = [zero; D];
        let mut sum = zero;
        unroll!(rev N < D, {
            sum = simd.mul_add_f64s(shares[N], scale, sum);
            reach[N] = sum;
        });
        let exact = simd.less_than_or_equal_f64s(of_order, floor);
        Average { reach, order, exact, variance: simd.mul_f64s(variance, scale) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_the_powers_that_logarithms_give() {
        for length in [5, 51, 202, 2001, 20_001] {
            let weights: Vec<f64> = (0..4).map(|order| (f64::from(order) / length as f64).exp()).collect();
            let plan = Akaike::new(&weights, length, 0.0);
            let residuals = [1.0, 0.99999, 0.9, 0.9 * (1.0 - 1.0 / length as f64)];
            let half = length as f64 / 2.0;
            let logs: Vec<f64> = residuals.iter().zip(&weights).map(|(r, w)| half * (r * w).ln()).collect();
            let least = logs.iter().copied().fold(f64::INFINITY, f64::min);
            let expected: Vec<f64> = logs.iter().map(|log| (least - log).exp()).collect();
            let total: f64 = expected.iter().sum();
            for (share, expected) in plan.shares(&residuals).iter().zip(expected) {
                // Both ways multiply the roundings of a ratio or its logarithm, three of them, by half the length; what is left out is 1e-17.
                let tolerance = 4.0 * half * f64::EPSILON + 1e-17;
                assert!((share - expected / total).abs() <= tolerance, "{length}: {share} {}", expected / total);
            }
        }
    }
}
