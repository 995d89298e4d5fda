//! The plan of least squares in every window of rows: how long windows are, what their rows hold and where results go.
//!
//! Windows are numbered by their first row, which may lie up to a window before the record; rows that do not exist are zero and have
//! no effect. Blocks lie on a grid of absolute row numbers and lanes keep apart, so any cutting of a record gives the same bits.

use std::ops::Range;

use crate::error::Error;
use crate::lanes::output::{Elements, Outputs, split_off};
use crate::least_squares::givens_factor::MOST_REGRESSORS;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;

/// The condition number at which parameters have lost half of their digits.
pub const HALF_OF_THE_DIGITS: f64 = 1e8;

/// The plan of least squares with some regressors and right-hand sides in windows of some rows.
#[derive(Clone, Debug)]
pub struct RollingLeastSquares {
    pub(crate) window: usize,
    pub(crate) regressors: usize,
    pub(crate) rhs_count: usize,
    pub(crate) covariances: Vec<(usize, usize)>,
    pub(crate) ill_conditioned: f64,
    pub(crate) instructions: Instructions,
}

/// Rows of equations: one record for every regressor, then one for every right-hand side.
pub struct Equations<'a> {
    /// All of the same length.
    pub columns: Vec<&'a dyn Samples>,
    /// The rows that are equations; rows before and after are ignored.
    pub rows: Range<usize>,
}

/// Where results are written. Windows belong to the row at their centre: row `i` to the rows `i - w/2 … i - w/2 + w - 1`.
///
/// An empty slice stands for what is not wanted.
#[derive(Debug, Default)]
pub struct Regressions<'a> {
    /// Which rows the elements of every slice belong to.
    pub elements: Elements,
    /// Parameters: one slice for every regressor and, within it, right-hand side.
    pub parameters: Vec<&'a mut [f64]>,
    /// Their standard errors.
    pub errors: Vec<&'a mut [f64]>,
    /// Covariances of the pairs asked for, one slice for every pair and, within it, right-hand side.
    pub covariances: Vec<&'a mut [f64]>,
    /// Residual sum of squares of every right-hand side.
    pub residuals: Vec<&'a mut [f64]>,
    /// Standard deviation of the residuals of every right-hand side.
    pub deviations: Vec<&'a mut [f64]>,
    /// Condition number of the regressors, each scaled to the same norm.
    pub condition: &'a mut [f64],
    /// Bits of [`crate::Status`].
    pub status: &'a mut [u16],
}

impl Regressions<'_> {
    /// Cuts off what belongs to the rows before `row`.
    pub(crate) fn split_off_before(&mut self, row: usize) -> Self {
        let (elements, count) = (self.elements, self.elements.of(0..row).len());
        self.elements = elements.from(count);
        Regressions {
            elements,
            parameters: self.parameters.iter_mut().map(|values| split_off(values, count)).collect(),
            errors: self.errors.iter_mut().map(|values| split_off(values, count)).collect(),
            covariances: self.covariances.iter_mut().map(|values| split_off(values, count)).collect(),
            residuals: self.residuals.iter_mut().map(|values| split_off(values, count)).collect(),
            deviations: self.deviations.iter_mut().map(|values| split_off(values, count)).collect(),
            condition: split_off(&mut self.condition, count),
            status: split_off(&mut self.status, count),
        }
    }
}

impl RollingLeastSquares {
    /// Prepares windows of `window` rows of `regressors` regressors and `rhs_count` right-hand sides. Of every pair of regressors in
    /// `covariances` the covariance is wanted too. Condition numbers above `ill_conditioned` are flagged.
    ///
    /// # Errors
    /// If there are no regressors or more than 16, or no more rows than regressors.
    pub fn new(
        window: usize,
        regressors: usize,
        rhs_count: usize,
        covariances: Vec<(usize, usize)>,
        ill_conditioned: f64,
        instructions: Instructions,
    ) -> Result<Self, Error> {
        if !(1..=MOST_REGRESSORS).contains(&regressors) {
            return Err(Error::Regressors { regressors, most: MOST_REGRESSORS });
        }
        if window <= regressors {
            return Err(Error::RowsTooFew { window, regressors });
        }
        Ok(Self { window, regressors, rhs_count, covariances, ill_conditioned, instructions })
    }

    /// Number of windows computed side by side. A record may be cut anywhere, but multiples of this waste no work.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.window * self.instructions.lanes()
    }

    /// Rows of a window.
    pub(crate) fn window(&self) -> usize {
        self.window
    }

    /// Number of columns of a row, the right-hand sides included.
    pub(crate) fn columns(&self) -> usize {
        self.regressors + self.rhs_count
    }

    /// Cuts the rows of a record into pieces of about so many, so that no run is cut.
    pub(crate) fn pieces(&self, rows: usize, about: usize) -> Vec<Range<usize>> {
        let piece = about.next_multiple_of(self.stride());
        let mut pieces = Vec::new();
        let mut first = 0;
        while first < rows {
            let end = ((self.first_row(first) / piece + 1) * piece - self.first_row(0)).min(rows);
            pieces.push(first..end);
            first = end;
        }
        pieces
    }

    /// The rows that lie in the windows around some rows.
    pub(crate) fn rows_needed(&self, around: Range<usize>, rows: usize) -> Range<usize> {
        around.start.saturating_sub(self.window / 2)..(around.end + self.window).min(rows)
    }

    /// First row of the window around a row, counted from one window before the record.
    pub(crate) fn first_row(&self, row: usize) -> usize {
        row + self.window - self.window / 2
    }
}

/// Where the fields of a window are in the tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slots {
    pub(crate) errors: usize,
    pub(crate) covariances: usize,
    pub(crate) residuals: usize,
    pub(crate) deviations: usize,
    pub(crate) condition: usize,
}

impl Slots {
    pub(crate) fn of(plan: &RollingLeastSquares) -> Self {
        let (p, q, pairs) = (plan.regressors, plan.rhs_count, plan.covariances.len());
        let errors = p * q;
        let covariances = errors + p * q;
        let residuals = covariances + pairs * q;
        Self { errors, covariances, residuals, deviations: residuals + q, condition: residuals + 2 * q }
    }

    /// All fields: the last holds flags.
    pub(crate) fn fields(self) -> usize {
        self.condition + 2
    }

    /// The outputs in the order of the fields.
    pub(crate) fn outputs<'a>(self, regressions: &'a mut Regressions<'_>) -> Outputs<'a> {
        let Regressions { elements, parameters, errors, covariances, residuals, deviations, condition, status } =
            regressions;
        let mut values: Vec<&'a mut [f64]> = Vec::with_capacity(self.fields());
        let groups = [
            (parameters, self.errors),
            (errors, self.covariances),
            (covariances, self.residuals),
            (residuals, self.deviations),
            (deviations, self.condition),
        ];
        for (group, end) in groups {
            values.extend(group.iter_mut().map(|values| &mut **values));
            values.resize_with(end, Default::default);
        }
        values.push(condition);
        Outputs { elements: *elements, values, order: Default::default(), status }
    }
}
