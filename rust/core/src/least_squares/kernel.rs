//! Least squares in blocks of windows side by side.
//!
//! A window of `w` rows that begins in one block of `w` rows and ends in the next is a suffix of the one and a prefix of the other. So
//! every window's factor is one merge of two factors that were built by appending rows only (see `givens_factor`): a row enters once and
//! leaves with its block, and nothing is subtracted.

use std::ops::Range;

use crate::exec::pool::GoOn;
use crate::lanes::output::Outputs;
use crate::lanes::store::Write;
use crate::least_squares::givens_factor::{Dimensions, append, merge};
use crate::least_squares::plan::Equations;
use crate::least_squares::side_by_side::{Load, RollingRun, RollingScratch, SEGMENT};
use crate::least_squares::solutions::{Counts, Solutions};
use crate::least_squares::window_summary::WindowSummary;
use crate::simd::vectors::{Kernel, Lanes, apart};

/// Rows of every lane between two calls of `go_on`: some 10 ms with 16 regressors.
const ASK: usize = 256;

/// The kernel of a run. Where rows are `PLAIN`, they have no weights and nothing fades: known to the compiler, factors then stay in registers.
pub(crate) struct RollingKernel<'a, 'b, 'c, H: Dimensions, const PLAIN: bool> {
    pub(crate) run: RollingRun<'a>,
    pub(crate) shape: H,
    pub(crate) equations: &'a Equations<'a>,
    pub(crate) scratch: &'b mut RollingScratch,
    pub(crate) outputs: &'b mut Outputs<'c>,
    pub(crate) go_on: &'b GoOn<'b>,
}

impl<H: Dimensions, const PLAIN: bool> Kernel for RollingKernel<'_, '_, '_, H, PLAIN> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let full = apart(simd, Load { run: &self.run, equations: self.equations, scratch: self.scratch });
        let window = self.run.plan.window;
        let size = self.run.plan.summary(self.shape.size() * S::F64_LANES);
        let segments = window.div_ceil(SEGMENT);
        let mut row = self.shape.factor(simd.splat_f64s(0.0));
        let mut suffix = self.nothing(simd);
        for segment in (1..segments).rev() {
            let rows = segment * SEGMENT..window.min((segment + 1) * SEGMENT);
            for offset in rows.rev() {
                if offset % ASK == 0 && !(self.go_on)() {
                    return;
                }
                self.append(simd, &mut suffix, offset, 0, &mut row);
            }
            suffix.store(simd, self.shape, &mut self.scratch.checkpoints[(segment - 1) * size..segment * size]);
        }
        let places = self.scratch.tile.places();
        let mut prefix = self.nothing(simd);
        for segment in 0..segments {
            let rows = segment * SEGMENT..window.min((segment + 1) * SEGMENT);
            suffix = self.nothing(simd);
            if segment + 1 < segments {
                suffix.load(simd, self.shape, &self.scratch.checkpoints[segment * size..][..size]);
            }
            for offset in rows.clone().rev() {
                if offset % ASK == 0 && !(self.go_on)() {
                    return;
                }
                self.append(simd, &mut suffix, offset, 0, &mut row);
                let place = (offset - rows.start) * size;
                suffix.store(simd, self.shape, &mut self.scratch.suffixes[place..place + size]);
            }
            // Merging depends on the step before, solving does not: in separate loops each keeps the processor busy.
            let mut first = rows.start;
            while first < rows.end {
                if first % ASK == 0 && !(self.go_on)() {
                    return;
                }
                let some = first..rows.end.min(first - first % places + places);
                for offset in some.clone() {
                    let place = (offset - rows.start) * size;
                    suffix.load(simd, self.shape, &self.scratch.suffixes[place..place + size]);
                    if PLAIN {
                        merge(simd, self.shape, &mut suffix.factor, &prefix.factor, &mut row);
                    } else {
                        let left = simd.splat_f64s(self.run.plan.left_at(offset));
                        suffix.merge(simd, self.shape, self.run.plan, &prefix, left, &mut row);
                    }
                    suffix.store(simd, self.shape, &mut self.scratch.suffixes[place..place + size]);
                    self.append(simd, &mut prefix, offset, 1, &mut row);
                }
                self.solve(simd, some.clone(), rows.start, full);
                // The last windows are written together with some that were written before, to fill the vectors.
                if some.end % places == 0 || some.end == window {
                    self.write(simd, some.end.saturating_sub(places)..some.end);
                }
                first = some.end;
            }
        }
        self.run.mark(self.scratch, full, self.outputs);
    }
}

impl<H: Dimensions, const PLAIN: bool> RollingKernel<'_, '_, '_, H, PLAIN> {
    /// The summary of no rows.
    #[inline(always)]
    fn nothing<S: Lanes>(&self, simd: S) -> WindowSummary<H::Factor<S::f64s>> {
        WindowSummary::nothing(simd, self.shape, !PLAIN && self.run.plan.fading.is_some())
    }

    /// Appends the row at an offset of each lane's block, or of the block after it.
    #[inline(always)]
    fn append<S: Lanes>(
        &self,
        simd: S,
        summary: &mut WindowSummary<H::Factor<S::f64s>>,
        offset: usize,
        block: usize,
        row: &mut H::Factor<S::f64s>,
    ) {
        let (shape, plan) = (self.shape, self.run.plan);
        let columns = shape.regressors() + shape.rhs_count();
        let strips = &self.scratch.strips[..=columns];
        let place = strips[0].place(offset, block);
        for column in 0..columns {
            row[column] = strips[column].in_place(simd, place);
        }
        if PLAIN {
            append(simd, shape, &mut summary.factor, row, 0, simd.splat_f64s(1.0));
            return;
        }
        let is_weighted = plan.is_weighted(self.equations);
        let weight = if is_weighted { strips[columns].in_place(simd, place) } else { simd.splat_f64s(1.0) };
        summary.append(simd, shape, plan, (offset, block), row, weight);
    }

    /// Solves the windows at some offsets of each lane's block. Suffixes, which are whole windows now, are held from a first offset on.
    #[inline(always)]
    fn solve<S: Lanes>(&mut self, simd: S, offsets: Range<usize>, first: usize, full: bool) {
        let (run, shape) = (&self.run, self.shape);
        let RollingScratch { strips, tile, suffixes, counts, .. } = &mut *self.scratch;
        let size = run.plan.summary(shape.size() * S::F64_LANES);
        let summaries = &suffixes[(offsets.start - first) * size..(offsets.end - first) * size];
        let count = |lane: usize, offset: usize| run.count(counts, run.first(lane) + offset);
        let counts = if full { Counts::All } else { Counts::Asked(&count) };
        apart(simd, Solutions { shape, plan: run.plan, offsets, summaries, counts, rows: Some(strips), tile });
    }

    /// Writes out the windows at some offsets of each lane's block.
    #[inline(always)]
    fn write<S: Lanes>(&mut self, simd: S, rows: Range<usize>) {
        let plan = self.run.plan;
        let write = Write {
            tile: &self.scratch.tile,
            rows,
            base: self.run.base.cast_signed(),
            block: plan.window,
            records: None,
            windows: self.run.windows.clone(),
            ahead: plan.before.cast_signed() - plan.window.cast_signed(),
            fixed_order: None,
            outputs: &mut *self.outputs,
        };
        apart(simd, write);
    }
}
