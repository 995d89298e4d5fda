//! Windows of a record solved round by round: what errors need of them is used soon after it was made, and its memory anew.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use crate::error::Error;
use crate::exec::huge_pages::zeros;
use crate::exec::pool::{self, GoOn, Piece};
use crate::exec::stages::Stages;
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::least_squares::side_by_side::RollingScratch;

/// Rows in a piece of work, about, and numbers above their diagonals: what is kept of them stays in the second nearest cache.
const PIECE: usize = 3 << 11;
const NUMBERS: usize = 1 << 16;

/// Pieces in a round for every thread, where there is more than one: all wait for the last.
const AT_A_TIME: usize = 4;

/// The windows of a record, and which of them are solved.
pub(crate) struct Rounds<'a, 'b> {
    plan: &'a RollingLeastSquares,
    equations: &'a Equations<'a>,
    pub(crate) regressions: Regressions<'b>,
    pub(crate) pieces: Vec<SomeWindows>,
    /// Memory that was used and is not needed now.
    unused: Vec<Vec<f64>>,
    scratch: Lender<RollingScratch>,
}

/// Memory of threads that is kept from round to round.
pub(crate) struct Lender<S>(Mutex<Vec<S>>);

/// The memory of one thread.
pub(crate) struct Lent<'a, S> {
    from: &'a Lender<S>,
    /// One, until it is given back.
    own: Vec<S>,
}

impl<S> Lender<S> {
    pub(crate) fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// Lends what was kept, or makes it.
    pub(crate) fn lend(&self, make: impl FnOnce() -> S) -> Lent<'_, S> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Lent { from: self, own: vec![kept.unwrap_or_else(make)] }
    }
}

impl<S> Lent<'_, S> {
    pub(crate) fn get(&mut self) -> &mut S {
        &mut self.own[0]
    }
}

impl<S> Drop for Lent<'_, S> {
    fn drop(&mut self) {
        self.from.0.lock().unwrap_or_else(PoisonError::into_inner).append(&mut self.own);
    }
}

/// The windows around some rows.
pub(crate) struct SomeWindows {
    pub(crate) rows: Range<usize>,
    /// What is above the diagonals of the inverses of their normal matrices, row by row, once they are solved.
    normal: Option<Vec<f64>>,
}

/// Pairs of different regressors.
fn pairs(plan: &RollingLeastSquares) -> usize {
    plan.regressors * (plan.regressors - 1) / 2
}

impl SomeWindows {
    /// What is above the diagonals, one column for every pair of regressors.
    pub(crate) fn normal(&self) -> Vec<&[f64]> {
        let columns = self.normal.iter().flat_map(|normal| normal.chunks_exact(self.rows.len()));
        columns.collect()
    }
}

impl<'a, 'b> Rounds<'a, 'b> {
    /// Of a plan that wants the normal matrices. The outputs must belong to every row.
    pub(crate) fn new(
        plan: &'a RollingLeastSquares,
        equations: &'a Equations<'a>,
        regressions: Regressions<'b>,
        workers: NonZeroUsize,
    ) -> Result<Self, Error> {
        let rows = equations.columns.first().map_or(0, |column| column.len());
        let about = PIECE.min(NUMBERS / pairs(plan).max(1)).max(8 * plan.window);
        let pieces = plan.pieces(rows, about).into_iter();
        let pieces: Vec<SomeWindows> = pieces.map(|rows| SomeWindows { rows, normal: None }).collect();
        plan.ask_for_scratch(workers.get().min(pieces.len()))?;
        Ok(Self { plan, equations, regressions, pieces, unused: Vec::new(), scratch: Lender::new() })
    }

    /// The pieces of every round.
    pub(crate) fn all(&self, workers: NonZeroUsize) -> Vec<Range<usize>> {
        let (count, workers) = (self.pieces.len(), workers.get());
        let size = if workers > 1 { AT_A_TIME * workers } else { 1 };
        (0..count).step_by(size).map(|first| first..count.min(first + size)).collect()
    }

    /// The rows of some pieces.
    pub(crate) fn rows_of(&self, pieces: &Range<usize>) -> Range<usize> {
        self.pieces[pieces.start].rows.start..self.pieces[pieces.end - 1].rows.end
    }

    /// Solves the windows around some rows, unless they are solved.
    pub(crate) fn solve(&mut self, rows: &Range<usize>, stages: &mut Stages<'_, '_>) -> Result<(), Error> {
        let Self { plan, equations, regressions, pieces, unused, scratch } = self;
        let pairs = pairs(plan);
        let mut found = Vec::new();
        let first = pieces.partition_point(|piece| piece.rows.end <= rows.start);
        let hold = pieces[first..].iter_mut().take_while(|piece| piece.rows.start < rows.end);
        for piece in hold.filter(|piece| piece.normal.is_none()) {
            let size = pairs * piece.rows.len();
            let used = unused.pop().filter(|used| used.len() >= size);
            let normal = used.map_or_else(|| zeros(size), Ok)?;
            found.push((piece, normal));
        }
        if found.is_empty() {
            return Ok(());
        }
        let (mut work, mut rest) = (Vec::new(), regressions.reborrow());
        for (piece, normal) in &mut found {
            let rows = piece.rows.clone();
            rest.split_off_before(rows.start);
            let mut part = rest.split_off_before(rows.end);
            part.normal = normal.chunks_exact_mut(rows.len()).take(pairs).collect();
            work.push(Piece { size: rows.len(), content: (rows, part) });
        }
        let workers = stages.workers;
        let solve = |(rows, mut part): (Range<usize>, Regressions<'_>), lent: &mut Lent<'_, _>, go_on: &GoOn<'_>| {
            plan.solve_while(equations, rows, &mut part, lent.get(), go_on);
        };
        let lend = || scratch.lend(|| plan.scratch());
        stages.stage(|watch| pool::run_long(work, workers, lend, solve, watch))?;
        for (piece, normal) in found {
            piece.normal = Some(normal);
        }
        Ok(())
    }

    /// Forgets what is above the diagonals for the windows of some pieces, and lends its memory to others.
    pub(crate) fn forget(&mut self, pieces: Range<usize>) {
        // Lent first is what was used last.
        self.unused
            .extend(self.pieces[pieces].iter_mut().filter_map(|piece| piece.normal.as_mut().map(std::mem::take)));
    }
}
