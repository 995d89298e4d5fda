//! The mean over windows of several lengths at every row, weighted, with errors that know what the windows differ by.

/// Weighted sums over windows, by row.
pub(crate) struct WeightedWindows {
    windowed: usize,
    weights: Vec<f64>,
    /// The least exponent so far, which all weights are relative to.
    least: Vec<f64>,
    /// Of values, slopes and standard errors.
    sums: Vec<f64>,
    /// Of squared distances of the values from their mean.
    spreads: Vec<f64>,
}

impl WeightedWindows {
    pub(crate) fn new(rows: usize, windowed: usize) -> Self {
        Self {
            windowed,
            weights: vec![0.0; rows],
            least: vec![f64::INFINITY; rows],
            sums: vec![0.0; rows * 3 * windowed],
            spreads: vec![0.0; rows * windowed],
        }
    }

    /// Whether a row has no number yet, row by row.
    pub(crate) fn are_missing(&self) -> impl Iterator<Item = bool> {
        self.weights.iter().map(|&weight| weight == 0.0)
    }

    /// Adds the numbers of a window at a row.
    pub(crate) fn add(&mut self, place: usize, exponent: f64, numbers: &[f64]) {
        let sums = &mut self.sums[place * numbers.len()..(place + 1) * numbers.len()];
        let spreads = &mut self.spreads[place * self.windowed..(place + 1) * self.windowed];
        if exponent < self.least[place] {
            let shrink = (exponent - self.least[place]).exp();
            self.weights[place] *= shrink;
            for sum in sums.iter_mut().chain(&mut *spreads) {
                *sum *= shrink;
            }
            self.least[place] = exponent;
        }
        let (weight, before) = ((self.least[place] - exponent).exp(), self.weights[place]);
        self.weights[place] += weight;
        if before > 0.0 {
            // Off the mean so far: differences of sums of squares would lose what is small.
            let share = weight * (before / (before + weight));
            for ((spread, sum), number) in spreads.iter_mut().zip(&*sums).zip(numbers) {
                *spread += share * (number - sum / before).powi(2);
            }
        }
        for (sum, number) in sums.iter_mut().zip(numbers) {
            *sum += weight * number;
        }
    }

    /// Puts the means into columns of values, slopes and standard errors, those with what windows differ by.
    pub(crate) fn into_means(self, columns: &mut [&mut [f64]]) {
        let (windowed, numbers) = (self.windowed, 3 * self.windowed);
        for (place, weight) in self.weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            for (number, column) in columns.iter_mut().enumerate() {
                column[place] = self.sums[place * numbers + number] / weight;
            }
            for (unknown, spread) in self.spreads[place * windowed..(place + 1) * windowed].iter().enumerate() {
                let error = &mut columns[2 * windowed + unknown][place];
                *error = error.hypot((spread / weight).sqrt());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value, slope and error of one unknown at the only row.
    fn mean(windows: &[(f64, [f64; 3])]) -> [f64; 3] {
        let mut weighted = WeightedWindows::new(1, 1);
        for (exponent, numbers) in windows {
            weighted.add(0, *exponent, numbers);
        }
        let mut columns = [[f64::NAN]; 3];
        let mut columns_of_rows: Vec<&mut [f64]> = columns.iter_mut().map(|column| &mut column[..]).collect();
        weighted.into_means(&mut columns_of_rows);
        columns.map(|column| column[0])
    }

    #[test]
    fn what_windows_differ_by_is_in_the_error() {
        assert_eq!(mean(&[(3.0, [5.0, 1.0, 0.3]), (3.0, [5.0, 3.0, 0.5])]), [5.0, 2.0, 0.4]);
        let [value, _, error] = mean(&[(3.0, [4.7, 1.0, 0.4]), (3.0, [5.3, 1.0, 0.4])]);
        assert!((value - 5.0).abs() < 1e-12 && (error - 0.5).abs() < 1e-12, "{value} {error}");
    }

    #[test]
    fn the_order_of_windows_does_not_matter() {
        let windows = [(9.0, [4.7, 1.0, 0.4]), (7.0, [5.3, 1.0, 0.2]), (8.0, [5.1, 0.0, 0.3])];
        let weights = windows.map(|(exponent, _)| (7.0_f64 - exponent).exp());
        let all: f64 = weights.iter().sum();
        let of = |number: &dyn Fn(&[f64; 3]) -> f64| {
            weights.iter().zip(&windows).map(|(weight, (_, numbers))| weight * number(numbers)).sum::<f64>() / all
        };
        let centre = of(&|numbers| numbers[0]);
        let expected = of(&|numbers| numbers[2]).hypot(of(&|numbers| (numbers[0] - centre).powi(2)).sqrt());
        for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2], [0, 2, 1]] {
            let [value, _, error] = mean(&order.map(|place| windows[place]));
            assert!((value - centre).abs() < 1e-12 && (error - expected).abs() < 1e-12, "{order:?}");
        }
    }

    #[test]
    fn a_window_that_is_far_worse_leaves_the_mean_as_it_is() {
        for order in [[0, 1], [1, 0]] {
            let windows = [(800.0, [1e9, 1.0, 1.0]), (1.0, [5.0, 2.0, 0.4])];
            assert_eq!(mean(&order.map(|place| windows[place])), [5.0, 2.0, 0.4]);
        }
        // Nothing was added.
        assert!(mean(&[]).iter().all(|number| number.is_nan()));
    }
}
