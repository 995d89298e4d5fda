//! The mean squared error with which windows of one length predict the rows of a record, by the weights of rows.

/// Rows whose weights spread by less than this part have one weight, but for rounding.
const EVEN: f64 = 1e-9;

/// The mean squared error of rows over the record, which grows with their weight: noise is the same in all, what windows do not follow is not.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OverRecord {
    mean: f64,
    /// By how much the error grows with the weight, and the weight at which it is the mean.
    growth: f64,
    middle: f64,
}

impl OverRecord {
    pub(crate) const UNUSED: Self = Self { mean: f64::INFINITY, growth: 0.0, middle: 1.0 };

    /// The error that is expected of rows of a weight.
    pub(crate) fn at(self, weight: f64) -> f64 {
        (self.mean + self.growth * (weight - self.middle)).max(0.0)
    }
}

/// Sums over rows, of which a line of their squared errors by their weights follows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ErrorSums {
    pub(crate) count: f64,
    error: f64,
    weight: f64,
    squared_weight: f64,
    product: f64,
}

impl ErrorSums {
    pub(crate) fn add(&mut self, error: f64, weight: f64) {
        self.merge(Self { count: 1.0, error, weight, squared_weight: weight * weight, product: weight * error });
    }

    pub(crate) fn merge(&mut self, other: Self) {
        self.count += other.count;
        self.error += other.error;
        self.weight += other.weight;
        self.squared_weight += other.squared_weight;
        self.product += other.product;
    }

    pub(crate) fn over_record(self) -> OverRecord {
        let (mean, middle) = (self.error / self.count, self.weight / self.count);
        let spread = self.squared_weight - middle * self.weight;
        let growth = (self.product - middle * self.error) / spread;
        let differ = spread > EVEN * self.squared_weight;
        OverRecord { mean, growth: if differ { growth.max(0.0) } else { 0.0 }, middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error over a record of rows with some errors and weights.
    fn over(rows: &[[f64; 2]]) -> OverRecord {
        let mut sums = ErrorSums::default();
        for &[error, weight] in rows {
            sums.add(error, weight);
        }
        sums.over_record()
    }

    #[test]
    fn an_error_that_grows_with_the_weight_is_a_line() {
        let found = over(&[[2.0, 1.0], [3.0, 2.0], [4.0, 3.0]]);
        for (weight, error) in [(1.0, 2.0), (2.0, 3.0), (5.0, 6.0)] {
            assert!((found.at(weight) - error).abs() < 1e-12, "{weight}: {}", found.at(weight));
        }
    }

    #[test]
    fn what_does_not_grow_is_the_mean() {
        for rows in [[[1.0, 1.0], [3.0, 1.0]], [[3.0, 1.0], [1.0, 2.0]]] {
            assert_eq!(over(&rows).at(10.0), 2.0);
        }
        assert_eq!(OverRecord::UNUSED.at(1.0), f64::INFINITY);
    }
}
