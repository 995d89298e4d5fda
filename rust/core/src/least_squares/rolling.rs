//! Least squares in every window of a record, in parallel.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{self, GoOn, Piece, Watch};
use crate::lanes::output::Outputs;
use crate::least_squares::givens_factor::{Dimensions, Few, Many};
use crate::least_squares::kernel::RollingKernel;
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares, Slots};
use crate::least_squares::side_by_side::{RollingRun, RollingScratch, SEGMENT};
use crate::simd::vectors::dispatch;

/// Rows in a piece of work, about.
const PIECE: usize = 1 << 14;

impl RollingLeastSquares {
    /// Memory for one thread.
    #[must_use]
    pub fn scratch(&self) -> RollingScratch {
        RollingScratch::new(self)
    }

    /// Asks for what the scratch memory of so many threads will take.
    pub(crate) fn ask_for_scratch(&self, threads: usize) -> Result<(), Error> {
        let run = self.window.saturating_mul(self.instructions.lanes() + 2).saturating_mul(self.columns() + 2);
        let factors = self.window.min(SEGMENT) + self.window / SEGMENT;
        let factor = Many { regressors: self.regressors, rhs_count: self.rhs_count }.size() * self.instructions.lanes();
        let factor = self.summary(factor);
        let numbers = run.saturating_add(factors.saturating_mul(factor));
        memory::ask_for_numbers(numbers.saturating_mul(threads))
    }

    /// Solves the windows around all rows, in parallel. Every element of the outputs must belong to a row.
    ///
    /// The numbers do not depend on the number of workers.
    ///
    /// # Errors
    /// If there is not the memory for the windows, or the watch cancels.
    pub fn run(
        &self,
        equations: &Equations<'_>,
        mut regressions: Regressions<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let rows = equations.columns.first().map_or(0, |column| column.len());
        let mut pieces = Vec::new();
        for piece in self.pieces(rows, PIECE) {
            let part = regressions.split_off_before(piece.end);
            pieces.push(Piece { size: piece.len(), content: (piece, part) });
        }
        self.ask_for_scratch(workers.get().min(pieces.len()))?;
        let work =
            |(rows, mut part): (Range<usize>, Regressions<'_>), scratch: &mut RollingScratch, go_on: &GoOn<'_>| {
                self.solve_while(equations, rows, &mut part, scratch, go_on);
            };
        pool::run_long(pieces, workers, || self.scratch(), work, watch)
    }

    /// Solves the windows around some rows.
    pub fn solve(
        &self,
        equations: &Equations<'_>,
        rows: Range<usize>,
        regressions: &mut Regressions<'_>,
        scratch: &mut RollingScratch,
    ) {
        self.solve_while(equations, rows, regressions, scratch, &|| true);
    }

    /// The same, stopped once `go_on` returns false. It is called every few hundred rows of every lane.
    pub(crate) fn solve_while(
        &self,
        equations: &Equations<'_>,
        rows: Range<usize>,
        regressions: &mut Regressions<'_>,
        scratch: &mut RollingScratch,
        go_on: &GoOn<'_>,
    ) {
        let mut outputs = Slots::of(self).outputs(regressions);
        let mut window = self.first_row(rows.start);
        let end = self.first_row(rows.end);
        while window < end && go_on() {
            let first = window - window % self.window;
            let next = end.min(first + self.stride());
            let run = RollingRun { plan: self, base: first, windows: window..next, rows: equations.rows.clone() };
            let scratch = &mut *scratch;
            let outputs = &mut outputs;
            match (self.regressors, self.rhs_count) {
                (1, 1) => self.solve_blocks(Few::<1>, run, equations, scratch, outputs, go_on),
                (2, 1) => self.solve_blocks(Few::<2>, run, equations, scratch, outputs, go_on),
                (3, 1) => self.solve_blocks(Few::<3>, run, equations, scratch, outputs, go_on),
                (4, 1) => self.solve_blocks(Few::<4>, run, equations, scratch, outputs, go_on),
                (5, 1) => self.solve_blocks(Few::<5>, run, equations, scratch, outputs, go_on),
                (6, 1) => self.solve_blocks(Few::<6>, run, equations, scratch, outputs, go_on),
                (7, 1) => self.solve_blocks(Few::<7>, run, equations, scratch, outputs, go_on),
                (8, 1) => self.solve_blocks(Few::<8>, run, equations, scratch, outputs, go_on),
                (regressors, rhs_count) => {
                    self.solve_blocks(Many { regressors, rhs_count }, run, equations, scratch, outputs, go_on);
                }
            }
            window = next;
        }
    }

    /// Solves the windows of some blocks side by side.
    fn solve_blocks<H: Dimensions>(
        &self,
        shape: H,
        run: RollingRun<'_>,
        equations: &Equations<'_>,
        scratch: &mut RollingScratch,
        outputs: &mut Outputs<'_>,
        go_on: &GoOn<'_>,
    ) {
        if self.is_weighted(equations) {
            dispatch(self.instructions, RollingKernel::<_, false> { run, shape, equations, scratch, outputs, go_on });
        } else {
            dispatch(self.instructions, RollingKernel::<_, true> { run, shape, equations, scratch, outputs, go_on });
        }
    }
}
