//! Which order fits one window, and what is estimated by it: of windows with polynomials of their own.

use crate::local_polynomials::options::Order;
use crate::local_polynomials::order_table::OrderTable;
use crate::local_polynomials::sliding_projection::ROUNDING;
use crate::local_polynomials::weighted_samples::{MOST, OwnPolynomials};

/// The fits of all orders to one window.
pub(crate) struct OwnOrders<'a> {
    own: &'a OwnPolynomials,
    /// Of so many samples as are there.
    table: &'a OrderTable,
    /// Residual sum of squares by order, and what rounding or quantisation leaves of it at least.
    residuals: [f64; MOST],
    floor: f64,
}

/// A derivative by every order, and its variance over that of the noise.
pub(crate) struct OrderSums {
    pub(crate) values: [f64; MOST],
    pub(crate) gains: [f64; MOST],
}

impl<'a> OwnOrders<'a> {
    /// The fits of a window whose residuals a quantisation makes so large at least, per sample of weight 1.
    pub(crate) fn new(own: &'a OwnPolynomials, table: &'a OrderTable, quantised: f64) -> Self {
        let mut residuals = [0.0; MOST];
        let mut left = own.left;
        for order in (0..own.columns).rev() {
            residuals[order] = left;
            left += own.projections[order].powi(2);
        }
        let floor = (quantised * own.weight).max(ROUNDING * own.energy);
        Self { own, table, residuals, floor }
    }

    /// Orders that are no more than the samples tell.
    pub(crate) fn orders(&self) -> usize {
        self.own.columns.min(self.table.degrees)
    }

    /// What weights were multiplied by.
    pub(crate) fn unit(&self) -> f64 {
        self.own.unit
    }

    /// What of each order is left, at least the floor.
    fn residual(&self, order: usize) -> f64 {
        self.residuals[order].max(self.floor)
    }

    /// What is least for the order that is chosen.
    fn scores(&self) -> impl Iterator<Item = f64> {
        (0..self.orders()).map(|order| self.residual(order) * self.table.weights[order])
    }

    /// The order of the window: the lowest of the best; `None` if the samples do not determine one.
    pub(crate) fn order(&self, order: Order) -> Option<usize> {
        match order {
            Order::Fixed(order) => (order < self.orders()).then_some(order),
            Order::Chosen { .. } => {
                let better = |best: (usize, f64), one: (usize, f64)| if one.1 < best.1 { one } else { best };
                self.scores().enumerate().reduce(better).map(|(order, _)| order)
            }
        }
    }

    /// The criterion of every candidate; NaN for those that the samples do not determine.
    pub(crate) fn criteria(&self, order: Order) -> Vec<f64> {
        let Order::Chosen { criterion, .. } = order else { return vec![f64::NAN] };
        let of = |order| criterion.score(self.residual(order) / self.own.unit, order, self.table.length);
        (0..self.table.degrees).map(|order| if order < self.orders() { of(order) } else { f64::NAN }).collect()
    }

    /// Variance of the noise of a sample of weight 1, from what an order leaves; NaN where that has no degrees of freedom.
    pub(crate) fn variance(&self, order: usize) -> f64 {
        let free = self.table.length - order - 1;
        if free == 0 { f64::NAN } else { self.residual(order) / free as f64 }
    }

    /// Whether an order leaves rounding or quantisation only.
    pub(crate) fn is_exact(&self, order: usize) -> bool {
        self.residuals[order] <= self.floor
    }

    /// What each order's share in the estimate would be, by Akaike's weights.
    pub(crate) fn shares(&self) -> [f64; MOST] {
        let (mut shares, mut least) = ([0.0; MOST], f64::INFINITY);
        for (share, score) in shares.iter_mut().zip(self.scores()) {
            *share = score.max(f64::MIN_POSITIVE);
            least = least.min(*share);
        }
        let (half, mut total) = (-0.5 * self.table.length as f64, 0.0);
        for share in &mut shares[..self.orders()] {
            let ratio = least / *share;
            *share = if ratio > self.table.least { (half * ratio.recip().ln()).exp() } else { 0.0 };
            total += *share;
        }
        shares.map(|share| share / total)
    }

    /// A derivative by every order.
    pub(crate) fn sums(&self, derivative: usize) -> OrderSums {
        let mut sums = OrderSums { values: [0.0; MOST], gains: [0.0; MOST] };
        let (mut value, mut gain) = (0.0, 0.0);
        let polynomials = self.own.derivatives[derivative].iter().zip(&self.own.projections);
        for (order, (polynomial, projection)) in polynomials.enumerate().take(self.orders()) {
            value += polynomial * projection;
            gain += polynomial * polynomial;
            (sums.values[order], sums.gains[order]) = (value, gain);
        }
        sums
    }

    /// The standard error of an order's estimate that knows of the choice (Burnham and Anderson 2002).
    pub(crate) fn error(&self, sums: &OrderSums, taken: usize, shares: &[f64; MOST]) -> f64 {
        let mut error = 0.0;
        for (order, share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let off = sums.values[order] - sums.values[taken];
            error += share * (self.variance(order) * sums.gains[order] + off * off).sqrt();
        }
        error
    }
}

impl OrderSums {
    /// The order with the least estimated squared bias plus variance off the centre, from `lowest` to `top` (see `off_centre`).
    pub(crate) fn best(&self, top: usize, lowest: usize, variance: f64) -> usize {
        if variance.is_nan() {
            return top;
        }
        let (mut best, mut least) = (top, variance * self.gains[top]);
        for order in (lowest..top).rev() {
            let chance = variance * (self.gains[top] - self.gains[order]);
            let bias = ((self.values[order] - self.values[top]).powi(2) - chance).max(0.0);
            let error = bias + variance * self.gains[order];
            if error <= least {
                (best, least) = (order, error);
            }
        }
        best
    }
}
