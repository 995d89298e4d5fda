//! Least squares in sliding windows of rows that go on coming: the batch's numbers, each a fixed number of rows after its own.

use std::ops::Range;

use crate::error::Error;
use crate::lanes::output::Elements;
use crate::least_squares::one_by_one::OneByOne;
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::least_squares::side_by_side::RollingScratch;
use crate::record::samples::Samples;
use crate::stream::rows::{RecentRows, in_pieces};

/// Windows of rows that come piece by piece.
///
/// Pieces may have any length; every window has the bits that [`RollingLeastSquares::run`] gives it, since blocks lie at the same absolute
/// row numbers. Many windows at a time are solved side by side, few of them one by one; a row that comes alone costs the same
/// whatever the window, but the one that ends a block of rows, which costs an append for each of its rows more.
#[derive(Debug)]
pub struct RollingStream {
    plan: RollingLeastSquares,
    step: usize,
    /// Whether every row comes with a weight, after its right-hand sides.
    weighted: bool,
    /// The first row that is an equation, and the end of equations, once it is known.
    first: usize,
    end: Option<usize>,
    rows: RecentRows,
    given: usize,
    walk: OneByOne,
    /// For many windows at a time; made when first needed.
    side_by_side: Option<RollingScratch>,
    column: Vec<Vec<f64>>,
}

/// What a stream of windows resumes from.
#[derive(Clone, Debug, Default)]
pub struct RollingState {
    /// Number of the first row in `rows`.
    pub first: usize,
    /// The latest rows, row by row.
    pub rows: Vec<f64>,
    /// Rows around which windows were given.
    pub given: usize,
    /// Whether the stream has ended.
    pub ended: bool,
}

impl RollingStream {
    /// Begins a stream of every `step`-th window.
    ///
    /// # Errors
    /// If there is not the memory for the window.
    pub fn new(plan: RollingLeastSquares, step: usize) -> Result<Self, Error> {
        Self::resume(plan, step, RollingState::default())
    }

    /// Goes on from a state of a stream with the same plan.
    ///
    /// # Errors
    /// As [`RollingStream::new`].
    pub fn resume(plan: RollingLeastSquares, step: usize, state: RollingState) -> Result<Self, Error> {
        Self::with_weights(plan, step, false, state)
    }

    /// Begins a stream whose rows have weights, one more record beside the columns, or goes on from its state. Weights are finite and not
    /// negative; rows of weight 0 are left out, whatever they hold.
    ///
    /// # Errors
    /// As [`RollingStream::new`].
    pub fn weighted(plan: RollingLeastSquares, step: usize, state: RollingState) -> Result<Self, Error> {
        Self::with_weights(plan, step, true, state)
    }

    /// A stream whose rows have weights, or not.
    pub(crate) fn with_weights(
        plan: RollingLeastSquares,
        step: usize,
        weighted: bool,
        state: RollingState,
    ) -> Result<Self, Error> {
        plan.ask_for_scratch(1)?;
        let walk = OneByOne::new(&plan);
        let RollingState { first, rows, given, ended } = state;
        let rows = RecentRows::of(plan.columns(), weighted, first, rows);
        let end = ended.then(|| rows.len());
        let column = vec![Vec::new(); plan.columns() + usize::from(weighted)];
        Ok(Self { plan, step, weighted, first: 0, end, rows, given, walk, side_by_side: None, column })
    }

    /// The same where equations begin with a row: those before it are ignored.
    pub(crate) fn with_equations_from(mut self, first: usize) -> Self {
        self.first = first;
        self
    }

    /// The state to resume from.
    #[must_use]
    pub fn state(&self) -> RollingState {
        let (first, rows) = self.rows.from(self.plan.reads_from(self.given));
        RollingState { first, rows: rows.to_vec(), given: self.given, ended: self.end.is_some() }
    }

    /// Rows from one to its window: the window of a row is given with the row so many later.
    #[must_use]
    pub fn delay(&self) -> usize {
        self.plan.window() - 1 - self.plan.before
    }

    /// Rows taken in so far.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// The rows whose windows are given next, once `count` more have been taken in.
    #[must_use]
    pub fn upcoming(&self, count: usize) -> Range<usize> {
        self.given..(self.rows.len() + count).saturating_sub(self.delay()).max(self.given)
    }

    /// The rows whose windows are given at the end.
    #[must_use]
    pub fn at_end(&self) -> Range<usize> {
        self.given..if self.end.is_some() { self.given } else { self.rows.len() }
    }

    /// Takes in rows, one record a column and the weights last where there are any, and gives the windows of [`RollingStream::upcoming`].
    ///
    /// The elements of the outputs must begin with the first that is given.
    pub fn push(&mut self, columns: &[&dyn Samples], regressions: &mut Regressions<'_>) {
        let mut held = std::mem::take(&mut self.column);
        in_pieces(columns, &mut held, |count, held| {
            self.push_rows(count, held.iter().map(Vec::as_slice), regressions);
        });
        self.column = held;
    }

    /// The same with columns that are in memory, as long as one piece.
    pub(crate) fn push_rows<'a>(
        &mut self,
        count: usize,
        columns: impl Iterator<Item = &'a [f64]>,
        regressions: &mut Regressions<'_>,
    ) {
        self.append(count, columns);
        self.solve(self.upcoming(0), regressions);
    }

    /// Takes in rows without solving any window.
    pub(crate) fn append<'a>(&mut self, count: usize, columns: impl Iterator<Item = &'a [f64]>) {
        self.rows.extend(count, columns);
    }

    /// Ends the stream and gives the windows of [`RollingStream::at_end`]: those that lack rows.
    pub fn finish(&mut self, regressions: &mut Regressions<'_>) {
        self.finish_with(self.rows.len(), regressions);
    }

    /// The same where equations end before a row.
    pub(crate) fn finish_with(&mut self, end: usize, regressions: &mut Regressions<'_>) {
        let around = self.at_end();
        self.end.get_or_insert(end);
        self.solve(around, regressions);
    }

    fn solve(&mut self, around: Range<usize>, regressions: &mut Regressions<'_>) {
        let Self { plan, rows, .. } = self;
        let equations = self.first..self.end.unwrap_or(rows.len()).max(self.first);
        let wanted = (Elements { first: 0, step: self.step }).of(around.clone()).len();
        // A run of blocks side by side costs as much as one block alone, and lays out its rows.
        if wanted > plan.window() {
            let columns = rows.columns();
            let mut columns: Vec<&dyn Samples> = columns.iter().map(|column| column as &dyn Samples).collect();
            let weights = if self.weighted { columns.pop() } else { None };
            let scratch = self.side_by_side.get_or_insert_with(|| plan.scratch());
            plan.solve(&Equations { columns, weights, rows: equations }, around.clone(), regressions, scratch);
        } else {
            plan.solve_one_by_one(rows, &equations, around.clone(), regressions, &mut self.walk);
        }
        self.given = around.end;
        rows.forget_before(plan.reads_from(self.given));
    }
}
