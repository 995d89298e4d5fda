//! Least squares in sliding windows of rows that go on coming, with standard errors that know of correlated residuals: the batch's numbers.
//!
//! The residual of a row is what the window around it leaves, and errors sum those of all rows of a window: so they wait for the windows
//! after it, and for those that stand for them where rows are missing. Windows are solved for as many rows at a time as a window has, at
//! multiples of that, with those around them that are needed on the way; results are given one by one.

use std::ops::Range;

use crate::error::Error;
use crate::lanes::output::Elements;
use crate::least_squares::bandwidth::Bandwidth;
use crate::least_squares::correlated::CorrelatedScratch;
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::record::samples::Samples;
use crate::stream::rolling::RollingState;
use crate::stream::rows::{RecentRows, in_pieces};

/// Windows of rows that come piece by piece, as [`RollingLeastSquares::run_correlated`] solves them with given lags.
///
/// Pieces may have any length; every window has the bits that the batch gives it, since all sums lie at the same absolute row numbers.
#[derive(Debug)]
pub struct CorrelatedStream {
    plan: RollingLeastSquares,
    bandwidth: Bandwidth,
    /// Whether every row comes with a weight, after its right-hand sides.
    weighted: bool,
    ended: bool,
    rows: RecentRows,
    /// Rows around which windows were solved, and given.
    made: usize,
    given: usize,
    found: SolvedWindows,
    scratch: CorrelatedScratch,
    column: Vec<Vec<f64>>,
}

/// Windows that are solved, one element a row: those from `given` on are still to be given.
#[derive(Debug, Default)]
struct SolvedWindows {
    /// Row of the first.
    first: usize,
    /// Parameters, errors, residuals, condition.
    columns: Vec<Vec<f64>>,
    status: Vec<u16>,
}

impl CorrelatedStream {
    /// Begins a stream of windows whose residuals are correlated over so many lags, or goes on from its state. With weights
    /// rows have one record more, as in [`crate::stream::RollingStream::weighted`].
    ///
    /// # Errors
    /// If there is not the memory for the window.
    pub fn resume(
        mut plan: RollingLeastSquares,
        lags: usize,
        weighted: bool,
        state: RollingState,
    ) -> Result<Self, Error> {
        plan.normal = true;
        plan.ask_for_scratch(1)?;
        let rows = RecentRows::of(plan.columns(), weighted, state.first, state.rows);
        let made = state.given - state.given % plan.window();
        let mut stream = Self {
            bandwidth: Bandwidth::given(lags + 1, plan.regressors),
            scratch: CorrelatedScratch::new(&plan),
            column: vec![Vec::new(); plan.columns() + usize::from(weighted)],
            found: SolvedWindows { first: made, ..SolvedWindows::default() },
            ended: state.ended,
            given: state.given,
            plan,
            weighted,
            rows,
            made,
        };
        if !stream.ended {
            stream.make();
        }
        Ok(stream)
    }

    /// The state to resume from.
    #[must_use]
    pub fn state(&self) -> RollingState {
        let (first, rows) = self.rows.from(self.needed_from(self.given));
        RollingState { first, rows: rows.to_vec(), given: self.given, ended: self.ended }
    }

    /// The first row that windows around one and those after it need.
    fn needed_from(&self, row: usize) -> usize {
        self.plan.reads_from((row - row % self.plan.window()).saturating_sub(2 * self.plan.window()))
    }

    /// Rows of a window after the one that it belongs to.
    fn after(&self) -> usize {
        self.plan.window() - 1 - self.plan.before
    }

    /// Rows from one to its window.
    #[must_use]
    pub fn delay(&self) -> usize {
        self.after() + 2 * self.plan.window()
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
        self.given..if self.ended { self.given } else { self.rows.len() }
    }

    /// Takes in rows, one record a column and the weights last where there are any, and gives the windows of
    /// [`CorrelatedStream::upcoming`]. The elements of the outputs must begin with the first that is given.
    pub fn push(&mut self, columns: &[&dyn Samples], regressions: &mut Regressions<'_>) {
        let mut held = std::mem::take(&mut self.column);
        in_pieces(columns, &mut held, |count, held| {
            self.rows.extend(count, held.iter().map(Vec::as_slice));
            self.make();
            self.give(self.upcoming(0), regressions);
            self.rows.forget_before(self.needed_from(self.given));
        });
        self.column = held;
    }

    /// Ends the stream and gives the windows of [`CorrelatedStream::at_end`].
    pub fn finish(&mut self, regressions: &mut Regressions<'_>) {
        let rest = self.at_end();
        if !self.ended {
            let total = self.rows.len();
            while self.made < total {
                self.solve(total.min(self.made + self.plan.window()), total);
            }
            self.ended = true;
        }
        self.give(rest, regressions);
    }

    /// Solves what can be solved.
    fn make(&mut self) {
        let window = self.plan.window();
        while self.made + 2 * window + self.after() <= self.rows.len() {
            // Windows that are whole.
            self.solve(self.made + window, self.made + 2 * window);
        }
    }

    /// Solves the windows up to a row, for which those before another are known.
    fn solve(&mut self, end: usize, known: usize) {
        let (wanted, window) = (self.made..end, self.plan.window());
        let around = wanted.start.saturating_sub(2 * window)..known.min(end + 2 * window);
        let columns = self.rows.columns();
        let mut columns: Vec<&dyn Samples> = columns.iter().map(|column| column as &dyn Samples).collect();
        let weights = if self.weighted { columns.pop() } else { None };
        let equations = Equations { columns, weights, rows: 0..self.rows.len() };
        let (pq, q) = (self.plan.regressors * self.plan.rhs_count, self.plan.rhs_count);
        let mut values = vec![vec![0.0; around.len()]; 2 * pq + q + 1];
        let mut status = vec![0; around.len()];
        {
            let mut each = values.iter_mut().map(Vec::as_mut_slice);
            let mut regressions = Regressions {
                elements: Elements { first: around.start, step: 1 },
                parameters: each.by_ref().take(pq).collect(),
                errors: each.by_ref().take(pq).collect(),
                residuals: each.by_ref().take(q).collect(),
                condition: each.next().unwrap_or_default(),
                status: &mut status,
                ..Regressions::default()
            };
            let rows = (wanted.clone(), around.clone());
            self.plan.solve_correlated(&equations, rows, &self.bandwidth, &mut regressions, &mut self.scratch);
        }
        let own = wanted.start - around.start..wanted.end - around.start;
        let SolvedWindows { first, columns, status: flags } = &mut self.found;
        let gone = self.given.saturating_sub(*first).min(flags.len());
        *first += gone;
        flags.drain(..gone);
        flags.extend_from_slice(&status[own.clone()]);
        columns.resize_with(values.len(), Vec::new);
        for (column, values) in columns.iter_mut().zip(&values) {
            column.drain(..gone.min(column.len()));
            column.extend_from_slice(&values[own.clone()]);
        }
        self.made = end;
    }

    /// Gives the windows around some rows, which are solved.
    fn give(&mut self, rows: Range<usize>, regressions: &mut Regressions<'_>) {
        let SolvedWindows { first, columns, status } = &self.found;
        let elements = regressions.elements;
        let Regressions { parameters, errors, residuals, condition, .. } = regressions;
        let outputs = parameters.iter_mut().chain(errors).chain(residuals).chain([condition]);
        let places = rows.start.saturating_sub(*first)..rows.end.saturating_sub(*first);
        for (output, values) in outputs.zip(columns) {
            elements.put(output, rows.start, &values[places.clone()]);
        }
        if let Some(flags) = status.get(places).filter(|flags| !flags.is_empty()) {
            elements.put(regressions.status, rows.start, flags);
        }
        self.given = rows.end;
    }
}
