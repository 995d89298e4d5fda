//! A fit: a model solved in windows of one length, or over the whole record at once.

use std::borrow::Cow;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Stages;
use crate::noise::median::median;
use crate::regression::block_sums::BlockSums;
use crate::regression::constants::{Expected, Pooled, pool};
use crate::regression::dyadic_windows::{WindowShape, solve_windows};
use crate::regression::problem::Problem;
use crate::regression::row_covariance::RowCovariance;
use crate::regression::sandwich::{between, influence, products, sandwich};
use crate::regression::solved::{Solved, is_determined, local};
use crate::regression::window_length::Scale;
use crate::simd::instructions::Instructions;

/// Blocks that a record without windowed unknowns is cut into.
const BLOCKS: usize = 64;

/// Windows that begin within the length of one.
const DENSITY: usize = 8;

/// A model solved in windows of one length, or over the whole record.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// `None` if the windows' length was given, or no unknown is windowed.
    pub(crate) scale: Option<Scale>,
    /// Windows that leave a gap out around the rows that they predict, if they are wanted.
    pub(crate) leave_gap_out: Option<Solved>,
    /// The windows that all unknowns are estimated from.
    pub(crate) full: Solved,
    pub(crate) pooled: Pooled,
    /// Rows from one window to the next, and rows of a window.
    pub(crate) step: usize,
    pub(crate) span: usize,
}

impl Fit {
    /// Solves a problem in windows of one length, or in one piece. Returns `None` if the constants are not determined.
    pub(crate) fn new(
        problem: &Problem<'_>,
        scale: Option<Scale>,
        expected: Expected,
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<Self>, Error> {
        let Some(scale) = scale else {
            let step = problem.rows().div_ceil(BLOCKS).max(1);
            return Ok(Self::in_windows(problem, step, BLOCKS, expected, instructions));
        };
        let full = scale.solve_full(problem, instructions, stages)?;
        let pooled = pool(&full, 0..full.len(), expected, instructions);
        let (scale, step, span) = (Some(scale), scale.step, scale.span());
        Ok(pooled.map(|pooled| Self { scale, leave_gap_out: None, full, pooled, step, span }))
    }

    /// As [`Fit::new`], together with windows that leave a gap out.
    pub(crate) fn with_leave_gap_out(
        problem: &Problem<'_>,
        scale: Scale,
        expected: Expected,
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<Self>, Error> {
        Ok(Self::of_lengths((problem, None), &[scale], expected, instructions, stages)?.pop().flatten())
    }

    /// The same for several lengths of windows, which have one step, with the sums of blocks where they are known.
    pub(crate) fn of_lengths(
        (problem, sums): (&Problem<'_>, Option<&BlockSums>),
        scales: &[Scale],
        expected: Expected,
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<Option<Self>>, Error> {
        let solved = Scale::solve_leave_gap_out(scales, (problem, sums), instructions, stages)?;
        let fit = |(&scale, [leave_gap_out, full]): (&Scale, [Solved; 2])| {
            let pooled = pool(&full, 0..full.len(), expected, instructions)?;
            let (step, span) = (scale.step, scale.span());
            Some(Self { scale: Some(scale), leave_gap_out: Some(leave_gap_out), full, pooled, step, span })
        };
        Ok(scales.iter().zip(solved).map(fit).collect())
    }

    /// Solves another problem in the same windows.
    pub(crate) fn again(
        &self,
        problem: &Problem<'_>,
        expected: Expected,
        instructions: Instructions,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Option<Self>, Error> {
        if self.scale.is_none() && problem.layout.local() > 0 {
            return Ok(Self::in_rows(problem, self.span, expected, instructions));
        }
        Self::new(problem, self.scale, expected, instructions, stages)
    }

    /// The covariance of the constants of the problem that was solved, row by row.
    pub(crate) fn covariance(
        &self,
        problem: &Problem<'_>,
        covariance: &RowCovariance,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<f64>, Error> {
        let columns = self.influences(problem, 0..problem.layout.constant, stages)?;
        let each = (0..columns.len()).map(|constant| Piece { size: problem.rows(), content: constant });
        let products = |constant: usize, (): &mut ()| products(&columns, constant, covariance);
        let products = stages.map(each.collect(), || (), products)?;
        Ok(between(&products.concat(), &self.pooled.inverse, columns.len()))
    }

    /// The variance of one of these constants alone: that of what all rows together move it by.
    pub(crate) fn variance_of(
        &self,
        problem: &Problem<'_>,
        constant: usize,
        covariance: &RowCovariance,
        stages: &mut Stages<'_, '_>,
    ) -> Result<f64, Error> {
        Ok(self.variances_of(problem, constant..constant + 1, covariance, stages)?.into_iter().sum())
    }

    /// The same of several, with the influences of all rows made once.
    pub(crate) fn variances_of(
        &self,
        problem: &Problem<'_>,
        some: Range<usize>,
        covariance: &RowCovariance,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<f64>, Error> {
        let moved = self.moved_by_rows(problem, some, stages)?;
        let of = |moved: &Vec<f64>, stages: &mut Stages<'_, '_>| -> Result<f64, Error> {
            let mut noisy = vec![0.0; moved.len()];
            stages.fill([&mut noisy], |rows, parts| {
                for part in parts {
                    covariance.add_product(moved, rows.clone(), part);
                }
            })?;
            Ok(moved.iter().zip(&noisy).map(|(a, b)| a * b).sum())
        };
        moved.iter().map(|moved| of(moved, stages)).collect()
    }

    /// What every row moves some of these constants by, times what is on its right-hand side.
    pub(crate) fn moved_by_rows(
        &self,
        problem: &Problem<'_>,
        some: Range<usize>,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let constants = problem.layout.constant;
        let mut moved = vec![Vec::new(); some.len()];
        // As many columns at a time as there are threads.
        for first in (0..constants).step_by(stages.workers.get()) {
            let here = first..constants.min(first + stages.workers.get());
            for (column, other) in self.influences(problem, here, stages)?.iter().zip(first..) {
                for (moved, constant) in moved.iter_mut().zip(some.clone()) {
                    let weight = self.pooled.inverse[constant * constants + other];
                    moved.resize(column.len(), 0.0);
                    moved.iter_mut().zip(&**column).for_each(|(sum, value)| *sum += weight * value);
                }
            }
        }
        Ok(moved)
    }

    /// The influence of every row on each of some constants.
    fn influences<'a>(
        &self,
        problem: &Problem<'a>,
        constants: Range<usize>,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<Cow<'a, [f64]>>, Error> {
        let each = constants.map(|constant| Piece { size: problem.rows(), content: constant });
        let windows = 0..self.full.len();
        let influence =
            |constant: usize, (): &mut ()| self.influence(problem, &windows, &self.pooled.weights, constant);
        stages.map(each.collect(), || (), influence)
    }

    /// The same for constants estimated from some of the windows.
    pub(crate) fn covariance_of(
        &self,
        problem: &Problem<'_>,
        windows: Range<usize>,
        pooled: &Pooled,
        covariance: &RowCovariance,
    ) -> Vec<f64> {
        let constants = 0..problem.layout.constant;
        let columns: Vec<_> =
            constants.map(|constant| self.influence(problem, &windows, &pooled.weights, constant)).collect();
        let first = (self.full.first + windows.start.cast_signed()) * self.step.cast_signed();
        sandwich(&columns, &pooled.inverse, &covariance.beginning_at(usize::try_from(first).unwrap_or(0)))
    }

    /// The influence of every row within some windows on a constant estimated from them.
    pub(crate) fn influence<'a>(
        &self,
        problem: &Problem<'a>,
        windows: &Range<usize>,
        weights: &[f64],
        constant: usize,
    ) -> Cow<'a, [f64]> {
        let centre = |window| self.centre(window);
        influence(problem, (&self.full, windows.clone()), weights, [self.step, self.span], centre, constant)
    }

    /// Solves a problem in windows of so many rows, or in one piece if that is all of them.
    pub(crate) fn in_rows(
        problem: &Problem<'_>,
        window: usize,
        expected: Expected,
        instructions: Instructions,
    ) -> Option<Self> {
        let step = (window / DENSITY).max(1);
        Self::in_windows(problem, step, window / step, expected, instructions)
    }

    fn in_windows(
        problem: &Problem<'_>,
        step: usize,
        blocks: usize,
        expected: Expected,
        instructions: Instructions,
    ) -> Option<Self> {
        let span = blocks * step;
        let windows = problem.rows().saturating_sub(span) / step + 1;
        let shapes = [WindowShape::of(0..blocks, step)];
        let full = solve_windows(problem, step, &(0..windows.cast_signed()), &shapes, instructions).swap_remove(0);
        let pooled = pool(&full, 0..full.len(), expected, instructions)?;
        Some(Self { scale: None, leave_gap_out: None, full, pooled, step, span })
    }

    /// The middle of a window, in rows.
    pub(crate) fn centre(&self, window: usize) -> f64 {
        let first = (self.full.first + window.cast_signed()) * self.step.cast_signed();
        first as f64 + (self.span as f64 - 1.0) / 2.0
    }

    /// The window whose middle is nearest to a row.
    pub(crate) fn nearest(&self, row: usize) -> usize {
        // Halves away from zero, as `round` has it: a call of its own, which cost more than all the rest.
        let place = ((row as f64 - (self.span as f64 - 1.0) / 2.0) / self.step as f64).max(0.0);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not below zero, and clamped to the windows"
        )]
        let whole = place as usize;
        (whole + usize::from(place - whole as f64 >= 0.5)).min(self.full.len().saturating_sub(1))
    }

    /// Variances of the constants, over that of the noise of a row.
    pub(crate) fn variances(&self) -> impl Iterator<Item = f64> {
        let count = self.pooled.values.len();
        let overlap = self.span as f64 / self.step as f64;
        (0..count).map(move |place| overlap * self.pooled.inverse[place * (count + 1)])
    }

    /// The median of a windowed unknown over all windows.
    pub(crate) fn median(&self, unknown: usize) -> f64 {
        let mut values = self.values(unknown);
        median(&mut values).unwrap_or(0.0)
    }

    /// A windowed unknown in all windows that determine it.
    pub(crate) fn values(&self, unknown: usize) -> Vec<f64> {
        let windows = (0..self.full.len()).filter(|&window| is_determined(&self.full, window));
        windows
            .map(|window| local(&self.full, window, &self.pooled.values, unknown))
            .filter(|value| value.is_finite())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::rows::Rows;
    use crate::regression::simulated::{CONSTANTS, assert_near, model, rows, staged, white};

    /// Lines are followed exactly, and so are constants beside them.
    fn line(time: f64) -> [f64; 2] {
        [5.0 - 0.02 * time, -0.02]
    }

    #[test]
    fn a_line_is_found_in_windows_of_any_length_and_in_the_record() {
        let rows = rows(500, line, 0.0);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let scales = Scale::all(500, 3);
        for scale in std::iter::once(None).chain(scales.into_iter().map(Some)) {
            let fit = staged(|stages| Fit::new(&problem, scale, white(1.0), Instructions::Scalar, stages));
            let fit = fit.expect("constants");
            for (found, expected) in fit.pooled.values.iter().zip(CONSTANTS) {
                assert_near(*found, expected, 1e-9);
            }
            for window in (0..fit.full.len()).filter(|&window| is_determined(&fit.full, window)) {
                let [value, rate] = line(fit.centre(window) * problem.period);
                assert_near(local(&fit.full, window, &fit.pooled.values, 0), value, 1e-8);
                assert_near(local(&fit.full, window, &fit.pooled.values, 1), rate, 1e-8);
            }
        }
    }

    #[test]
    fn windows_of_a_given_number_of_rows_begin_eight_in_their_length() {
        let rows = rows(500, line, 0.0);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let fit = Fit::in_rows(&problem, 83, white(1.0), Instructions::Scalar).expect("constants");
        assert_eq!((fit.step, fit.span, fit.full.len()), (10, 80, 43));
        assert_eq!((fit.centre(0), fit.centre(42)), (39.5, 459.5));
        assert_eq!([0, 44, 45, 250, 499].map(|row| fit.nearest(row)), [0, 0, 1, 21, 42]);
        // The line in the middle of the record.
        assert_near(fit.median(0), line(fit.centre(21) * problem.period)[0], 1e-8);
    }

    #[test]
    fn the_same_windows_serve_another_problem() {
        let (one, other) = (rows(300, line, 0.0), rows(300, |_| [7.0, 0.0], 0.0));
        let problem = |rows| model().problem(rows, &rows.rhs, 0.0, None);
        let fit = Fit::in_rows(&problem(&one), 40, white(1.0), Instructions::Scalar).expect("constants");
        let again = staged(|stages| fit.again(&problem(&other), white(1.0), Instructions::Scalar, stages));
        let again = again.expect("constants");
        assert_eq!((again.step, again.span, again.full.len()), (fit.step, fit.span, fit.full.len()));
        assert_near(again.median(0), 7.0, 1e-9);
    }

    #[test]
    fn constants_of_independent_rows_have_the_errors_of_least_squares() {
        let mut rows = rows(400, |_| [0.0, 0.0], 0.5);
        let mut model = model();
        (model.windowed, model.linear) = (Vec::new(), false);
        rows.rhs.iter_mut().for_each(|rhs| *rhs *= 2.0);
        let problem = model.problem(&rows, &rows.rhs, 0.0, None);
        let fit =
            staged(|stages| Fit::new(&problem, None, white(1.0), Instructions::Scalar, stages)).expect("constants");
        let covariance = RowCovariance::by_distance(vec![3.0]);
        let found = staged(|stages| fit.covariance(&problem, &covariance, stages));
        for (found, inverse) in found.iter().zip(&fit.pooled.inverse) {
            assert_near(*found, 3.0 * inverse, 1e-12);
        }
        assert_eq!(fit.covariance_of(&problem, 0..1, &fit.pooled, &covariance), found);
    }

    #[test]
    fn constants_alone_are_found_in_one_piece_wherever_windows_would_end() {
        let mut rows = rows(400, |_| [0.0, 0.0], 0.5);
        let mut model = model();
        (model.windowed, model.linear) = (Vec::new(), false);
        let found = |rows: &Rows| {
            let problem = model.problem(rows, &rows.rhs, 0.0, None);
            let fit = staged(|stages| Fit::new(&problem, None, white(1.0), Instructions::Scalar, stages));
            fit.expect("constants").pooled.values
        };
        let without = found(&rows);
        rows.jumps = vec![100, 350];
        assert_eq!(found(&rows), without);
    }

    #[test]
    fn the_variance_of_one_constant_is_that_in_the_covariance_of_all() {
        let rows = rows(3000, |time| [1.0 + 0.1 * time, 0.1], 0.5);
        let problem = model().problem(&rows, &rows.rhs, 0.0, None);
        let fit = Fit::in_rows(&problem, 200, white(0.25), Instructions::Scalar).expect("constants");
        let covariance = RowCovariance::by_distance(vec![0.5, 0.2, -0.1, 0.05]);
        let all = staged(|stages| fit.covariance(&problem, &covariance, stages));
        let size = problem.layout.constant;
        for constant in 0..size {
            let alone = staged(|stages| fit.variance_of(&problem, constant, &covariance, stages));
            // Sums over 3000 rows.
            assert_near(alone, all[constant * (size + 1)], 1e-11);
        }
    }
}
