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
use crate::simd::vectors::{dispatch, dispatch_vectors};

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
            match self.few() {
                Some(1) => self.solve_few(Few::<1>, run, equations, scratch, outputs, go_on),
                Some(2) => self.solve_few(Few::<2>, run, equations, scratch, outputs, go_on),
                Some(3) => self.solve_few(Few::<3>, run, equations, scratch, outputs, go_on),
                Some(4) => self.solve_few(Few::<4>, run, equations, scratch, outputs, go_on),
                Some(5) => self.solve_few(Few::<5>, run, equations, scratch, outputs, go_on),
                Some(6) => self.solve_few(Few::<6>, run, equations, scratch, outputs, go_on),
                Some(7) => self.solve_few(Few::<7>, run, equations, scratch, outputs, go_on),
                Some(8) => self.solve_few(Few::<8>, run, equations, scratch, outputs, go_on),
                _ => {
                    let shape = Many { regressors: self.regressors, rhs_count: self.rhs_count };
                    let kernel = RollingKernel::<_, false> { run, shape, equations, scratch, outputs, go_on };
                    dispatch(self.instructions, kernel);
                }
            }
            window = next;
        }
    }

    /// The number of regressors, where it is small and kernels that know it pay: with one right-hand side, and vectors.
    pub(crate) fn few(&self) -> Option<usize> {
        (self.rhs_count == 1 && self.instructions.lanes() > 1).then_some(self.regressors)
    }

    /// Solves the windows of some blocks side by side, with vectors.
    fn solve_few<H: Dimensions>(
        &self,
        shape: H,
        run: RollingRun<'_>,
        equations: &Equations<'_>,
        scratch: &mut RollingScratch,
        outputs: &mut Outputs<'_>,
        go_on: &GoOn<'_>,
    ) {
        if self.is_weighted(equations) {
            let kernel = RollingKernel::<_, false> { run, shape, equations, scratch, outputs, go_on };
            dispatch_vectors(self.instructions, kernel);
        } else {
            let kernel = RollingKernel::<_, true> { run, shape, equations, scratch, outputs, go_on };
            dispatch_vectors(self.instructions, kernel);
        }
    }
}
