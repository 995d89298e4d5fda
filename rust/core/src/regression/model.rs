//! Which unknowns of the equation of motion belong to every window and which are the same over the record, and what windows of one
//! length say of both.

use std::ops::Range;
use std::sync::Arc;

use crate::equation::rows::{Regressor, Rows};
use crate::error::Error;
use crate::exec::pool::Piece;
use crate::exec::stages::Run;
use crate::regression::constants::{
    Expected, Pooled, between, influence, is_determined, local, pool, products, sandwich,
};
use crate::regression::dyadic_windows::{Correlated, Problem, Shape, Solved, solve_windows};
use crate::regression::factor::{Layout, RowNoise};
use crate::regression::row_covariance::RowCovariance;
use crate::regression::window_length::Scale;
use crate::simd::vectors::Instructions;

/// Blocks that a record without windowed unknowns is cut into.
const BLOCKS: usize = 64;

/// Windows that begin within the length of one.
const DENSITY: usize = 8;

/// Regressors of the rows by what is known of their factors.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Model {
    pub(crate) windowed: Vec<usize>,
    pub(crate) constant: Vec<usize>,
    /// Whether windowed factors may grow linearly within a window.
    pub(crate) linear: bool,
}

impl Model {
    /// Sorts unknowns by whether they belong to windows.
    pub(crate) fn new(unknowns: &[usize], windowed: impl Iterator<Item = bool>, linear: bool) -> Self {
        let mut model = Self { linear, ..Self::default() };
        for (&index, windowed) in unknowns.iter().zip(windowed) {
            if windowed { model.windowed.push(index) } else { model.constant.push(index) }
        }
        model
    }

    pub(crate) fn layout(&self) -> Layout {
        Layout { windowed: self.windowed.len(), linear: self.linear, constant: self.constant.len() }
    }

    /// What the covariance of rows makes of the windowed regressors.
    pub(crate) fn correlated(
        &self,
        rows: &Rows,
        covariance: &RowCovariance,
        run: &mut Run<'_, '_>,
    ) -> Result<Arc<Correlated>, Error> {
        let of = |pick: fn(&Regressor) -> &Vec<f64>| -> Vec<&[f64]> {
            self.windowed.iter().map(|&index| pick(&rows.regressors[index]).as_slice()).collect()
        };
        let (values, companions) = (of(|regressor| &regressor.value), of(|regressor| &regressor.companion));
        covariance.correlated(&values, &companions, rows.period, run).map(Arc::new)
    }

    /// The least-squares problem of some rows, with a right-hand side. `noise` is the variance of the angle's.
    pub(crate) fn problem<'a>(
        &self,
        rows: &'a Rows,
        side: &'a [f64],
        noise: f64,
        correlated: Option<&Arc<Correlated>>,
    ) -> Problem<'a> {
        let of = |regressors: &[usize], pick: fn(&Regressor) -> &Vec<f64>| -> Vec<&'a [f64]> {
            regressors.iter().map(|&index| pick(&rows.regressors[index]).as_slice()).collect()
        };
        Problem {
            layout: self.layout(),
            correlated: correlated.cloned(),
            windowed: of(&self.windowed, |regressor| &regressor.value),
            companions: of(&self.windowed, |regressor| &regressor.companion),
            constants: of(&self.constant, |regressor| &regressor.value),
            side,
            usable: &rows.usable,
            jumps: &rows.jumps,
            period: rows.period,
            noise: self.row_noise(rows, &rows.side_noise, noise),
        }
    }

    /// What is left of a problem once the constants are known: the same windows with fewer columns, whose numbers are the same.
    pub(crate) fn without_constants<'a>(
        &self,
        rows: &Rows,
        whole: &Problem<'a>,
        side: &'a [f64],
        constants: &[f64],
        noise: f64,
    ) -> Problem<'a> {
        let rest = Self { constant: Vec::new(), ..self.clone() };
        let mut side_noise = rows.side_noise.clone();
        for (&regressor, constant) in self.constant.iter().zip(constants) {
            let kernel = &rows.regressors[regressor].noise[0];
            side_noise.resize(side_noise.len().max(kernel.len()), 0.0);
            side_noise.iter_mut().zip(kernel).for_each(|(sum, value)| *sum -= constant * value);
        }
        let noise = rest.row_noise(rows, &side_noise, noise);
        Problem { layout: rest.layout(), constants: Vec::new(), side, noise, ..whole.clone() }
    }

    fn row_noise(&self, rows: &Rows, side: &[f64], noise: f64) -> RowNoise {
        let kernels = |regressors: &[usize], which: usize| -> Vec<&[f64]> {
            regressors.iter().map(|&index| rows.regressors[index].noise[which].as_slice()).collect()
        };
        let windowed = [kernels(&self.windowed, 0), kernels(&self.windowed, 1)];
        RowNoise::new(&[windowed.concat(), kernels(&self.constant, 0), vec![side]].concat(), noise)
    }
}

/// What windows of one length, or the whole record, say of a model.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// Nothing where the windows' length was given, or no unknown belongs to a window.
    pub(crate) scale: Option<Scale>,
    /// Windows on both sides of the rows between them, where they are wanted.
    pub(crate) hollow: Option<Solved>,
    /// The windows that all unknowns are taken from.
    pub(crate) full: Solved,
    pub(crate) pooled: Pooled,
    /// Rows from one window to the next, and rows of a window.
    pub(crate) step: usize,
    pub(crate) span: usize,
}

impl Fit {
    /// Solves a problem in windows of one length, or in one piece; nothing where the constants are not determined.
    pub(crate) fn new(
        problem: &Problem<'_>,
        scale: Option<Scale>,
        expected: Expected,
        instructions: Instructions,
        run: &mut Run<'_, '_>,
    ) -> Result<Option<Self>, Error> {
        let Some(scale) = scale else {
            let step = problem.rows().div_ceil(BLOCKS).max(1);
            return Ok(Self::in_windows(problem, step, BLOCKS, expected, instructions));
        };
        let full = scale.solve_full(problem, instructions, run)?;
        let pooled = pool(&full, 0..full.len(), expected, instructions);
        let (scale, step, span) = (Some(scale), scale.step, scale.span());
        Ok(pooled.map(|pooled| Self { scale, hollow: None, full, pooled, step, span }))
    }

    /// As [`Fit::new`], with windows on both sides of the rows between them as well.
    pub(crate) fn with_hollow(
        problem: &Problem<'_>,
        scale: Scale,
        expected: Expected,
        instructions: Instructions,
        run: &mut Run<'_, '_>,
    ) -> Result<Option<Self>, Error> {
        let (hollow, full) = scale.solve_hollow(problem, instructions, run)?;
        let pooled = pool(&full, 0..full.len(), expected, instructions);
        let (step, span) = (scale.step, scale.span());
        Ok(pooled.map(|pooled| Self { scale: Some(scale), hollow: Some(hollow), full, pooled, step, span }))
    }

    /// Solves another problem in the same windows.
    pub(crate) fn again(
        &self,
        problem: &Problem<'_>,
        expected: Expected,
        instructions: Instructions,
        run: &mut Run<'_, '_>,
    ) -> Result<Option<Self>, Error> {
        if self.scale.is_none() && problem.layout.local() > 0 {
            return Ok(Self::in_rows(problem, self.span, expected, instructions));
        }
        Self::new(problem, self.scale, expected, instructions, run)
    }

    /// The covariance of the constants of the problem that was solved, row by row.
    pub(crate) fn covariance(
        &self,
        problem: &Problem<'_>,
        covariance: &RowCovariance,
        run: &mut Run<'_, '_>,
    ) -> Result<Vec<f64>, Error> {
        let each = || (0..problem.layout.constant).map(|constant| Piece { size: problem.rows(), content: constant });
        let windows = 0..self.full.len();
        let influence =
            |constant: usize, (): &mut ()| self.influence(problem, &windows, &self.pooled.weights, constant);
        let columns = run.map(each().collect(), || (), influence)?;
        let products = |constant: usize, (): &mut ()| products(&columns, constant, covariance);
        let products = run.map(each().collect(), || (), products)?;
        Ok(between(&products.concat(), &self.pooled.inverse, columns.len()))
    }

    /// The same for constants that were taken from some of the windows.
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
        sandwich(&columns, &pooled.inverse, covariance)
    }

    /// How every row within some windows moves a constant that was taken from them.
    pub(crate) fn influence(
        &self,
        problem: &Problem<'_>,
        windows: &Range<usize>,
        weights: &[f64],
        constant: usize,
    ) -> Vec<f64> {
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
        let shapes = [Shape::of(0..blocks, step)];
        let full = solve_windows(problem, step, &(0..windows.cast_signed()), &shapes, instructions).swap_remove(0);
        let pooled = pool(&full, 0..full.len(), expected, instructions)?;
        Some(Self { scale: None, hollow: None, full, pooled, step, span })
    }

    /// The middle of a window, in rows.
    pub(crate) fn centre(&self, window: usize) -> f64 {
        let first = (self.full.first + window.cast_signed()) * self.step.cast_signed();
        first as f64 + (self.span as f64 - 1.0) / 2.0
    }

    /// The window whose middle is nearest to a row.
    pub(crate) fn nearest(&self, row: usize) -> usize {
        let place = (row as f64 - (self.span as f64 - 1.0) / 2.0) / self.step as f64;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the windows")]
        let place = place.round().clamp(0.0, self.full.len() as f64 - 1.0) as usize;
        place
    }

    /// The median over all windows of what they say of a windowed unknown.
    pub(crate) fn median(&self, unknown: usize) -> f64 {
        let windows = (0..self.full.len()).filter(|&window| is_determined(&self.full, window));
        let mut values: Vec<f64> = windows
            .map(|window| local(&self.full, window, &self.pooled.values, unknown))
            .filter(|v| v.is_finite())
            .collect();
        if values.is_empty() {
            return 0.0;
        }
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

/// What windows say of their own unknowns, for given constants, ready to predict rows.
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

    /// Where a window is, if it is there and determined.
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

    /// What the windowed unknowns add to a row's right-hand side.
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

/// What is left of a right-hand side once the constants are taken off.
pub(crate) fn without_constants(problem: &Problem<'_>, constants: &[f64]) -> Vec<f64> {
    let mut side = problem.side.to_vec();
    for (column, value) in problem.constants.iter().zip(constants) {
        side.iter_mut().zip(*column).for_each(|(side, factor)| *side -= value * factor);
    }
    side
}
