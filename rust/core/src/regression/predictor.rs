//! Predictions of rows from the windowed unknowns of solved windows.

use std::borrow::Cow;

use crate::regression::problem::Problem;
use crate::regression::solved::{Solved, fewest_rows};

/// Rows that the constants are taken off at a time: they stay in the nearest cache.
const PIECE: usize = 1 << 11;

/// The windowed unknowns of solved windows for given constants, ready to predict rows.
#[derive(Clone, Debug)]
pub(crate) struct Predictor<'a> {
    solved: &'a Solved,
    /// By unknown, by window.
    values: Vec<Cow<'a, [f64]>>,
    /// Rows of every window.
    counts: &'a [f64],
}

impl<'a> Predictor<'a> {
    /// Without constants nothing is copied: around a single row that costs next to nothing, however many windows there are.
    pub(crate) fn new(solved: &'a Solved, constants: &[f64]) -> Self {
        let (fields, layout) = (solved.fields, solved.fields.layout);
        let value = |unknown: usize| {
            let mut values = Cow::Borrowed(solved.field(fields.solution(unknown, layout.constant)));
            for (constant, factor) in constants.iter().enumerate() {
                let column = solved.field(fields.solution(unknown, constant));
                values.to_mut().iter_mut().zip(column).for_each(|(value, slope)| *value -= slope * factor);
            }
            values
        };
        let values = (0..layout.local()).map(value).collect();
        Self { solved, values, counts: solved.field(fields.count()) }
    }

    /// The place of a window, or `None` if it is not there or not determined.
    pub(crate) fn place(&self, window: isize) -> Option<usize> {
        let fewest = fewest_rows(self.solved.fields.layout);
        self.solved.place(window).filter(|&place| self.counts[place] >= fewest)
    }

    /// A windowed unknown at a time, in seconds after the window's centre.
    pub(crate) fn value(&self, place: usize, windowed: usize, later: f64) -> f64 {
        self.line(place, windowed).value(later)
    }

    /// Its variance there.
    pub(crate) fn variance(&self, place: usize, windowed: usize, later: f64) -> f64 {
        self.track(place, windowed).variance(later)
    }

    /// The contribution of the windowed unknowns to a row's right-hand side.
    pub(crate) fn predict(&self, problem: &Problem<'_>, place: usize, row: usize, later: f64) -> f64 {
        let mut sum = 0.0;
        for windowed in 0..problem.layout.windowed {
            sum = self.line(place, windowed).add_to(sum, problem, (windowed, row), later);
        }
        sum
    }

    /// A windowed unknown without its variances.
    pub(crate) fn line(&self, place: usize, windowed: usize) -> UnknownInWindow {
        let layout = self.solved.fields.layout;
        let slope = if layout.linear { self.values[layout.windowed + windowed][place] } else { 0.0 };
        UnknownInWindow { value: self.values[windowed][place], slope, variances: [0.0; 3] }
    }

    /// All windowed unknowns without their variances.
    pub(crate) fn lines(&self, place: usize, tracks: &mut [UnknownInWindow]) {
        for (windowed, track) in tracks.iter_mut().enumerate() {
            *track = self.line(place, windowed);
        }
    }

    /// All windowed unknowns.
    pub(crate) fn tracks(&self, place: usize, tracks: &mut [UnknownInWindow]) {
        for (windowed, track) in tracks.iter_mut().enumerate() {
            *track = self.track(place, windowed);
        }
    }

    /// A windowed unknown.
    fn track(&self, place: usize, windowed: usize) -> UnknownInWindow {
        let (fields, layout) = (self.solved.fields, self.solved.fields.layout);
        let entry = |i, j| self.solved.field(fields.covariance(i, j))[place];
        let mut track = self.line(place, windowed);
        track.variances[0] = entry(windowed, windowed);
        if layout.linear {
            let slope = layout.windowed + windowed;
            track.variances = [track.variances[0], entry(windowed, slope), entry(slope, slope)];
        }
        track
    }
}

/// A windowed unknown in a window: its value at the centre, its growth per second, and the variances of both, with what they share between.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct UnknownInWindow {
    value: f64,
    slope: f64,
    variances: [f64; 3],
}

impl UnknownInWindow {
    /// Its value at a time after the window's centre.
    pub(crate) fn value(&self, later: f64) -> f64 {
        self.value + later * self.slope
    }

    /// Its growth per second, as its values show it.
    pub(crate) fn slope(&self) -> f64 {
        self.value(1.0) - self.value(0.0)
    }

    /// The variance of its value then.
    pub(crate) fn variance(&self, later: f64) -> f64 {
        let [own, shared, of_slope] = self.variances;
        own + (2.0 * later * shared + later * later * of_slope)
    }

    /// What all windowed unknowns contribute to a row's right-hand side.
    pub(crate) fn predict(tracks: &[Self], problem: &Problem<'_>, row: usize, later: f64) -> f64 {
        let mut sum = 0.0;
        for (windowed, track) in tracks.iter().enumerate() {
            sum = track.add_to(sum, problem, (windowed, row), later);
        }
        sum
    }

    /// Adds what one contributes.
    fn add_to(&self, sum: f64, problem: &Problem<'_>, (windowed, row): (usize, usize), later: f64) -> f64 {
        let sum = sum + self.value(later) * problem.windowed[windowed][row];
        if problem.layout.linear { sum + self.slope * problem.companions[windowed][row] } else { sum }
    }
}

/// The right-hand side minus the contribution of the constants.
pub(crate) fn without_constants(problem: &Problem<'_>, constants: &[f64]) -> Vec<f64> {
    let mut left = Vec::with_capacity(problem.rhs.len());
    for rhs in problem.rhs.chunks(PIECE) {
        let first = left.len();
        left.extend_from_slice(rhs);
        for (column, value) in problem.constants.iter().zip(constants) {
            left[first..].iter_mut().zip(&column[first..]).for_each(|(left, factor)| *left -= value * factor);
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regression::dyadic_windows::{WindowShape, solve_windows};
    use crate::regression::row_covariance::RowCovariance;
    use crate::regression::simulated::{CONSTANTS, PERIOD, assert_near, model, rows, staged};
    use crate::simd::instructions::Instructions;

    const SPAN: usize = 16;

    fn line(time: f64) -> [f64; 2] {
        [4.0 + 0.3 * time, 0.3]
    }

    #[test]
    fn rows_that_follow_a_line_are_predicted_exactly() {
        let rows = rows(64, line, 0.0);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let solved = solve_windows(&problem, 1, &(-4..49), &[WindowShape::of(0..SPAN, 1)], Instructions::Scalar);
        let predictor = Predictor::new(&solved[0], &CONSTANTS);
        let rest = without_constants(&problem, &CONSTANTS);
        let place = predictor.place(10).expect("a window");
        let centre = 10.0 + (SPAN as f64 - 1.0) / 2.0;
        for (row, rest) in rest.into_iter().enumerate() {
            let later = (row as f64 - centre) * PERIOD;
            assert_near(predictor.value(place, 0, later), line(row as f64 * PERIOD)[0], 1e-10);
            assert_near(predictor.predict(&problem, place, row, later), rest, 1e-10);
        }
        assert_eq!(predictor.place(-5), None);
        assert_eq!(predictor.place(49), None);
    }

    #[test]
    fn a_window_of_too_few_rows_predicts_nothing() {
        let mut rows = rows(64, line, 0.0);
        rows.exclude(0..SPAN - 5);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let solved = solve_windows(&problem, 1, &(0..2), &[WindowShape::of(0..SPAN, 1)], Instructions::Scalar);
        let predictor = Predictor::new(&solved[0], &CONSTANTS);
        // Five rows for four unknowns are not one more than these, six are.
        assert_eq!([0, 1].map(|window| predictor.place(window)), [None, Some(1)]);
    }

    #[test]
    fn the_variance_of_a_line_is_least_near_its_middle() {
        let rows = rows(64, line, 0.1);
        let covariance = RowCovariance::by_distance(vec![0.01]);
        let correlated = staged(|stages| model().correlated(&rows, &covariance, stages));
        let problem = model().problem(&rows, &rows.rhs, 0.0, Some(&correlated));
        let solved = solve_windows(&problem, 1, &(0..40), &[WindowShape::of(0..SPAN, 1)], Instructions::Scalar);
        let (predictor, fields) = (Predictor::new(&solved[0], &CONSTANTS), solved[0].fields);
        let entry = |i, j| solved[0].field(fields.covariance(i, j))[3];
        for later in [-3.0, 0.0, 2.5] {
            let expected = entry(0, 0) + 2.0 * later * entry(1, 0) + later * later * entry(1, 1);
            assert_near(predictor.variance(3, 0, later), expected, 1e-15);
        }
        assert!(predictor.variance(3, 0, 20.0) > 4.0 * predictor.variance(3, 0, 0.0));
    }
}
