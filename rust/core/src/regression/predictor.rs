//! Predictions of rows from the windowed unknowns of solved windows.

use crate::regression::problem::Problem;
use crate::regression::solved::{Solved, is_determined};

/// The windowed unknowns of solved windows for given constants, ready to predict rows.
#[derive(Clone, Debug)]
pub(crate) struct Predictor<'a> {
    solved: &'a Solved,
    /// By unknown, by window.
    values: Vec<Vec<f64>>,
    usable: Vec<bool>,
}

impl<'a> Predictor<'a> {
    pub(crate) fn new(solved: &'a Solved, constants: &[f64]) -> Self {
        let (fields, layout) = (solved.fields, solved.fields.layout);
        let value = |unknown: usize| {
            let mut values = solved.field(fields.solution(unknown, layout.constant)).to_vec();
            for (constant, factor) in constants.iter().enumerate() {
                let column = solved.field(fields.solution(unknown, constant));
                values.iter_mut().zip(column).for_each(|(value, slope)| *value -= slope * factor);
            }
            values
        };
        let values = (0..layout.local()).map(value).collect();
        let usable = (0..solved.len()).map(|window| is_determined(solved, window)).collect();
        Self { solved, values, usable }
    }

    /// The place of a window, or `None` if it is not there or not determined.
    pub(crate) fn place(&self, window: isize) -> Option<usize> {
        self.solved.place(window).filter(|&place| self.usable[place])
    }

    /// A windowed unknown at a time, in seconds after the window's centre.
    pub(crate) fn value(&self, place: usize, windowed: usize, later: f64) -> f64 {
        let layout = self.solved.fields.layout;
        let slope = if layout.linear { self.values[layout.windowed + windowed][place] } else { 0.0 };
        self.values[windowed][place] + later * slope
    }

    /// Its variance there.
    pub(crate) fn variance(&self, place: usize, windowed: usize, later: f64) -> f64 {
        let (fields, layout) = (self.solved.fields, self.solved.fields.layout);
        let entry = |i, j| self.solved.field(fields.covariance(i, j))[place];
        let mut variance = entry(windowed, windowed);
        if layout.linear {
            let slope = layout.windowed + windowed;
            variance += 2.0 * later * entry(windowed, slope) + later * later * entry(slope, slope);
        }
        variance
    }

    /// The contribution of the windowed unknowns to a row's right-hand side.
    pub(crate) fn predict(&self, problem: &Problem<'_>, place: usize, row: usize, later: f64) -> f64 {
        let layout = problem.layout;
        let mut sum = 0.0;
        for windowed in 0..layout.windowed {
            sum += self.value(place, windowed, later) * problem.windowed[windowed][row];
            if layout.linear {
                sum += self.values[layout.windowed + windowed][place] * problem.companions[windowed][row];
            }
        }
        sum
    }
}

/// The right-hand side minus the contribution of the constants.
pub(crate) fn without_constants(problem: &Problem<'_>, constants: &[f64]) -> Vec<f64> {
    let mut rhs = problem.rhs.to_vec();
    for (column, value) in problem.constants.iter().zip(constants) {
        rhs.iter_mut().zip(*column).for_each(|(rhs, factor)| *rhs -= value * factor);
    }
    rhs
}
