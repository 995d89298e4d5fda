//! A derivative of a window that is fitted alone: by every order, with what its error is.

/// A derivative by every order, and its variance over that of the noise.
pub(crate) struct OrderSums {
    pub(crate) values: Vec<f64>,
    pub(crate) gains: Vec<f64>,
}

impl OrderSums {
    pub(crate) fn new(polynomials: &[f64], coefficients: &[f64]) -> Self {
        let (mut value, mut gain) = (0.0, 0.0);
        let [values, gains] = [(); 2].map(|()| Vec::with_capacity(coefficients.len()));
        let mut sums = Self { values, gains };
        for (polynomial, coefficient) in polynomials.iter().zip(coefficients) {
            value += polynomial * coefficient;
            gain += polynomial * polynomial;
            sums.values.push(value);
            sums.gains.push(gain);
        }
        sums
    }

    /// The order with the least estimated squared bias plus variance off the centre (see [`crate::local_polynomials`]).
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

    /// The standard error of an order's estimate that knows of the choice (Burnham and Anderson 2002).
    pub(crate) fn error(&self, taken: usize, shares: &[f64], variance: impl Fn(usize) -> f64) -> f64 {
        let total: f64 = shares.iter().sum();
        let of = |(order, share): (usize, &f64)| {
            let off = self.values[order] - self.values[taken];
            if *share > 0.0 { share / total * (variance(order) * self.gains[order] + off * off).sqrt() } else { 0.0 }
        };
        shares.iter().enumerate().map(of).sum()
    }
}
