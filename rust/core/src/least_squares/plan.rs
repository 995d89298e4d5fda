//! The plan of least squares in every window of rows: how long windows are, what their rows hold and where results go.
//!
//! Windows are numbered by their first row, which may lie up to a window before the record; rows that do not exist are zero and have
//! no effect. Blocks lie on a grid of absolute row numbers and lanes keep apart, so any cutting of a record gives the same bits.

use std::ops::Range;

use crate::error::Error;
use crate::lanes::output::{Elements, Outputs, split_off};
use crate::least_squares::fading::Fading;
use crate::least_squares::givens_factor::MOST_REGRESSORS;
use crate::record::samples::Samples;
use crate::simd::instructions::Instructions;

/// The condition number at which parameters have lost half of their digits.
pub const HALF_OF_THE_DIGITS: f64 = 1e8;

/// Where in its window the row is that a window belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Alignment {
    /// In the middle: row `i` has the rows `i - w/2 … i - w/2 + w - 1`.
    #[default]
    Centre,
    /// At the end: row `i` has the rows `i - w + 1 … i`.
    Trailing,
    /// At the beginning: row `i` has the rows `i … i + w - 1`.
    Leading,
}

impl Alignment {
    /// Rows of a window before the row that it belongs to.
    pub(crate) fn before(self, window: usize) -> usize {
        match self {
            Self::Centre => window / 2,
            Self::Trailing => window - 1,
            Self::Leading => 0,
        }
    }
}

/// What rows are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowKind {
    /// What a caller gives.
    Any,
    /// Equations of motion: windows must span half of their rows whatever is missing, and say so where they lack any.
    Equations,
}

/// The plan of least squares with some regressors and right-hand sides in windows of some rows.
#[derive(Clone, Debug)]
pub struct RollingLeastSquares {
    pub(crate) window: usize,
    /// Rows of a window before the row that it belongs to.
    pub(crate) before: usize,
    /// Rows that a window must hold, where those that are missing are left out; otherwise a missing row spoils its windows, and they must
    /// hold half of their rows.
    pub(crate) at_least: Option<usize>,
    /// Whether rows are equations of motion.
    pub(crate) rows_are: RowKind,
    /// Whether the residual of each window at its own row, and R², are wanted.
    pub(crate) fit: bool,
    /// Whether the inverse of every window's normal matrix is wanted: its diagonal in the place of the errors.
    pub(crate) normal: bool,
    /// How weights become less away from the row that a window belongs to.
    pub(crate) fading: Option<Fading>,
    /// Whether the first regressor is a constant, so that R² is that of what varies around it.
    pub(crate) constant_first: bool,
    pub(crate) regressors: usize,
    pub(crate) rhs_count: usize,
    pub(crate) covariances: Vec<(usize, usize)>,
    pub(crate) ill_conditioned: f64,
    pub(crate) instructions: Instructions,
}

/// Rows of equations: one record for every regressor, then one for every right-hand side.
#[derive(Default)]
pub struct Equations<'a> {
    /// All of the same length.
    pub columns: Vec<&'a dyn Samples>,
    /// Weights of the rows, finite and not negative. Rows of weight 0 are left out, whatever they hold.
    pub weights: Option<&'a dyn Samples>,
    /// The rows that are equations; rows before and after are ignored.
    pub rows: Range<usize>,
}

/// Where results are written. Windows belong to a row as the plan's [`Alignment`] says.
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
    /// What each window leaves of the right-hand sides at its own row, where the plan is [`RollingLeastSquares::with_fit`].
    pub own_residuals: Vec<&'a mut [f64]>,
    /// The part of the squares of every right-hand side that is explained, likewise.
    pub rsquared: Vec<&'a mut [f64]>,
    /// What is above the diagonal of the inverse of the normal matrix, row by row, where the plan asks for it.
    pub normal: Vec<&'a mut [f64]>,
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
            own_residuals: self.own_residuals.iter_mut().map(|values| split_off(values, count)).collect(),
            rsquared: self.rsquared.iter_mut().map(|values| split_off(values, count)).collect(),
            normal: self.normal.iter_mut().map(|values| split_off(values, count)).collect(),
            condition: split_off(&mut self.condition, count),
            status: split_off(&mut self.status, count),
        }
    }

    /// The same outputs for one more call.
    pub(crate) fn reborrow(&mut self) -> Regressions<'_> {
        fn all<'b>(columns: &'b mut [&mut [f64]]) -> Vec<&'b mut [f64]> {
            columns.iter_mut().map(|values| &mut **values).collect()
        }
        Regressions {
            elements: self.elements,
            parameters: all(&mut self.parameters),
            errors: all(&mut self.errors),
            covariances: all(&mut self.covariances),
            residuals: all(&mut self.residuals),
            deviations: all(&mut self.deviations),
            own_residuals: all(&mut self.own_residuals),
            rsquared: all(&mut self.rsquared),
            normal: all(&mut self.normal),
            condition: self.condition,
            status: self.status,
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
        Ok(Self {
            window,
            before: Alignment::Centre.before(window),
            at_least: None,
            rows_are: RowKind::Any,
            fit: false,
            normal: false,
            fading: None,
            constant_first: false,
            regressors,
            rhs_count,
            covariances,
            ill_conditioned,
            instructions,
        })
    }

    /// Whether windows must span half of their rows whatever is missing, and say so where they lack any.
    pub(crate) fn spans_half(&self) -> bool {
        self.rows_are == RowKind::Equations
    }

    /// The same with windows that belong to another of their rows.
    #[must_use]
    pub fn aligned(mut self, alignment: Alignment) -> Self {
        self.before = alignment.before(self.window);
        self
    }

    /// The same with weights that halve every so many rows away from the row that a window belongs to, which must be at one of its ends.
    #[must_use]
    pub fn with_half_life(mut self, rows: f64) -> Self {
        self.fading = Some(Fading::new(rows, self.window, self.before > 0));
        self
    }

    /// The same with missing rows left out, of windows that hold so many others.
    #[must_use]
    pub fn of_at_least(mut self, rows: usize) -> Self {
        self.at_least = Some(rows);
        self
    }

    /// The same for equations of motion: windows lack rows near the ends of a record, down to half of them, and where some are missing or
    /// have no weight. With `leaves_out` missing rows are left out; otherwise they spoil their windows.
    #[must_use]
    pub(crate) fn of_equations(mut self, leaves_out: bool) -> Self {
        (self.rows_are, self.at_least) = (RowKind::Equations, leaves_out.then_some(0));
        self
    }

    /// The same with the residual at each window's own row and R²: of what varies around a constant, if the first regressor is one.
    #[must_use]
    pub fn with_fit(mut self, constant_first: bool) -> Self {
        (self.fit, self.constant_first) = (true, constant_first);
        self
    }

    /// Number of windows computed side by side. A record may be cut anywhere, but multiples of this waste no work.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.window * self.instructions.lanes()
    }

    /// Numbers that a window's rows are summarised by, of so many of a factor.
    pub(crate) fn summary(&self, factor: usize) -> usize {
        if self.fading.is_some() { 2 * factor } else { factor }
    }

    /// What is left of the part of a window that weighs less for the other, where it begins at an offset of a block.
    #[inline(always)]
    pub(crate) fn left_at(&self, offset: usize) -> f64 {
        let left = |fading: &Fading| fading.left[if fading.newest_first { offset } else { self.window - offset }];
        self.fading.as_ref().map_or(1.0, left)
    }

    /// Whether rows have weights.
    pub(crate) fn is_weighted(&self, equations: &Equations<'_>) -> bool {
        equations.weights.is_some() || self.fading.is_some()
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
        around.start.saturating_sub(self.before)..(around.end + self.window).min(rows)
    }

    /// First row of the window around a row, counted from one window before the record.
    pub(crate) fn first_row(&self, row: usize) -> usize {
        row + self.window - self.before
    }
}

/// Where the fields of a window are in the tile. Those of every plan come first: in a kernel that is compiled for so many regressors the compiler
/// knows where they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slots {
    pub(crate) errors: usize,
    pub(crate) residuals: usize,
    pub(crate) deviations: usize,
    pub(crate) covariances: usize,
    pub(crate) own_residuals: usize,
    pub(crate) rsquared: usize,
    pub(crate) normal: usize,
    pub(crate) condition: usize,
}

impl Slots {
    pub(crate) fn of(plan: &RollingLeastSquares) -> Self {
        Self::of_shape(plan, plan.regressors, plan.rhs_count)
    }

    /// The same with the numbers of regressors and right-hand sides, which are those of the plan.
    #[inline(always)]
    pub(crate) fn of_shape(plan: &RollingLeastSquares, p: usize, q: usize) -> Self {
        let errors = p * q;
        let residuals = errors + p * q;
        let deviations = residuals + q;
        let covariances = deviations + q;
        let own_residuals = covariances + plan.covariances.len() * q;
        let fits = if plan.fit { q } else { 0 };
        let rsquared = own_residuals + fits;
        let normal = rsquared + fits;
        let condition = normal + if plan.normal { p * (p - 1) / 2 } else { 0 };
        Self { errors, residuals, deviations, covariances, own_residuals, rsquared, normal, condition }
    }

    /// All fields: the last holds flags.
    pub(crate) fn fields(self) -> usize {
        self.condition + 2
    }

    /// The outputs in the order of the fields.
    pub(crate) fn outputs<'a>(self, regressions: &'a mut Regressions<'_>) -> Outputs<'a> {
        let Regressions {
            elements,
            parameters,
            errors,
            covariances,
            residuals,
            deviations,
            own_residuals,
            rsquared,
            normal,
            condition,
            status,
        } = regressions;
        let mut values: Vec<&'a mut [f64]> = Vec::with_capacity(self.fields());
        let groups = [
            (parameters, self.errors),
            (errors, self.residuals),
            (residuals, self.deviations),
            (deviations, self.covariances),
            (covariances, self.own_residuals),
            (own_residuals, self.rsquared),
            (rsquared, self.normal),
            (normal, self.condition),
        ];
        for (group, end) in groups {
            values.extend(group.iter_mut().map(|values| &mut **values));
            values.resize_with(end, Default::default);
        }
        values.push(condition);
        Outputs { elements: *elements, values, order: Default::default(), status }
    }
}
