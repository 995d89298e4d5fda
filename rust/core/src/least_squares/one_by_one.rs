//! The same windows one by one, as their rows come.
//!
//! When a block of rows is complete the factors of its suffixes are built; from then on every row that comes costs one append, and every window
//! one merge and one solution. These are the operations of `kernel.rs` on the same rows in the same order, so the bits are the same. Rows
//! are appended to all lanes alike; windows are merged and solved together, as many as there are lanes, which hold one each.

use std::ops::Range;

use crate::lanes::output::Outputs;
use crate::lanes::store::write_row;
use crate::lanes::tile::Tile;
use crate::least_squares::givens_factor::{Dimensions, Few, Many};
use crate::least_squares::plan::{Regressions, RollingLeastSquares, Slots};
use crate::least_squares::side_by_side::{RollingRun, SEGMENT};
use crate::least_squares::solutions::{Counts, Solutions};
use crate::least_squares::window_summary::WindowSummary;
use crate::record::samples::is_usable;
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES, apart, dispatch, dispatch_vectors};

/// Rows by their numbers.
pub(crate) trait RowSource {
    /// A row that exists: regressors, then right-hand sides.
    fn row(&self, row: usize) -> &[f64];
    /// Numbers of the rows that hold an unusable value, in order; those of weight zero are not among them.
    fn unusable(&self) -> &[usize];
    /// The weight of a row that exists.
    fn weight(&self, row: usize) -> f64;
    /// Numbers of the rows of weight zero, in order.
    fn without_weight(&self) -> &[usize];
}

/// Where the walk is, and its memory.
#[derive(Debug)]
pub(crate) struct OneByOne {
    /// The current block: the window that begins in its first row.
    base: Option<usize>,
    /// Rows of the next block that the prefix holds, and the segment whose suffixes are held.
    done: usize,
    segment: usize,
    prefix: Aligned,
    suffixes: Aligned,
    /// The windows that are solved, one a lane.
    windows: Aligned,
    checkpoints: Aligned,
    tile: Tile,
    unusable: Vec<usize>,
}

impl OneByOne {
    pub(crate) fn new(plan: &RollingLeastSquares) -> Self {
        let lanes = plan.instructions.lanes();
        let factor = Many { regressors: plan.regressors, rhs_count: plan.rhs_count }.size() * lanes;
        let factor = plan.summary(factor);
        Self {
            base: None,
            done: 0,
            segment: usize::MAX,
            prefix: Aligned::zeros(factor),
            suffixes: Aligned::zeros(plan.window.min(SEGMENT) * factor),
            windows: Aligned::zeros(factor),
            checkpoints: Aligned::zeros((plan.window.div_ceil(SEGMENT) - 1) * factor),
            tile: Tile::new(Slots::of(plan).fields(), 1, lanes),
            unusable: Vec::new(),
        }
    }
}

impl RollingLeastSquares {
    /// The first row that windows around a row and those after it need here: that of the current block.
    pub(crate) fn reads_from(&self, row: usize) -> usize {
        let window = self.first_row(row);
        (window - window % self.window).saturating_sub(self.window)
    }

    /// Solves the windows around some rows one by one. `equations` are the rows that exist and are equations.
    pub(crate) fn solve_one_by_one(
        &self,
        source: &dyn RowSource,
        equations: &Range<usize>,
        around: Range<usize>,
        regressions: &mut Regressions<'_>,
        state: &mut OneByOne,
    ) {
        let mut outputs = Slots::of(self).outputs(regressions);
        let (mut window, end) = (self.first_row(around.start), self.first_row(around.end));
        while window < end {
            let base = window - window % self.window;
            let next = end.min(base + self.window);
            let run = RollingRun { plan: self, base, windows: window..next, rows: equations.clone() };
            let outputs = &mut outputs;
            match self.few() {
                Some(1) => self.one_by_one(Few::<1>, run, source, state, outputs),
                Some(2) => self.one_by_one(Few::<2>, run, source, state, outputs),
                Some(3) => self.one_by_one(Few::<3>, run, source, state, outputs),
                Some(4) => self.one_by_one(Few::<4>, run, source, state, outputs),
                _ => {
                    let shape = Many { regressors: self.regressors, rhs_count: self.rhs_count };
                    dispatch(self.instructions, OneByOneKernel { run, shape, source, state, outputs });
                }
            }
            window = next;
        }
    }

    /// Solves windows of one block, with vectors.
    fn one_by_one<H: Dimensions>(
        &self,
        shape: H,
        run: RollingRun<'_>,
        source: &dyn RowSource,
        state: &mut OneByOne,
        outputs: &mut Outputs<'_>,
    ) {
        dispatch_vectors(self.instructions, OneByOneKernel { run, shape, source, state, outputs });
    }
}

/// The kernel for windows of one block.
struct OneByOneKernel<'a, 'b, 'c, H: Dimensions> {
    run: RollingRun<'a>,
    shape: H,
    source: &'a dyn RowSource,
    state: &'b mut OneByOne,
    outputs: &'b mut Outputs<'c>,
}

/// Windows that are solved together, in order: one in each of the first lanes, and whatever was there in the others.
struct Together<F> {
    count: usize,
    offsets: [usize; MOST_LANES],
    suffixes: WindowSummary<F>,
    prefixes: WindowSummary<F>,
}

impl<F> Together<F> {
    /// Puts a window into the next lane: its suffix and its prefix, of which all lanes hold the same.
    #[inline(always)]
    fn put<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(
        &mut self,
        simd: S,
        shape: H,
        offset: usize,
        (suffix, prefix): (&WindowSummary<F>, &WindowSummary<F>),
    ) {
        // The lanes after it hold it as well, until others are put there.
        let mut lanes = [0.0; MOST_LANES];
        lanes[self.count..].fill(1.0);
        let lanes = simd.greater_than_f64s(simd.load(&lanes, 0), simd.splat_f64s(0.0));
        self.suffixes.take(simd, shape, lanes, suffix);
        self.prefixes.take(simd, shape, lanes, prefix);
        self.offsets[self.count..].fill(offset);
        self.count += 1;
    }
}

impl<H: Dimensions> Kernel for OneByOneKernel<'_, '_, '_, H> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        let window = self.run.plan.window;
        let offsets = self.run.windows.start - self.run.base..self.run.windows.end - self.run.base;
        if self.state.base != Some(self.run.base) || self.state.done > offsets.start {
            self.begin(simd);
        }
        let shape = self.shape;
        let size = self.run.plan.summary(shape.size() * S::F64_LANES);
        let mut row = shape.factor(simd.splat_f64s(0.0));
        let mut prefix = self.nothing(simd);
        prefix.load(simd, shape, &self.state.prefix);
        let mut some =
            Together { count: 0, offsets: [0; MOST_LANES], suffixes: self.nothing(simd), prefixes: self.nothing(simd) };
        let mut suffix = self.nothing(simd);
        for offset in offsets.clone() {
            // Only now: the row after a window need not have come.
            for done in self.state.done..offset {
                self.append(simd, &mut prefix, window + done, &mut row);
            }
            self.state.done = offset;
            let own = self.own(offset);
            if !self.outputs.elements.of(own..own + 1).is_empty() {
                self.hold_suffixes(simd, offset / SEGMENT, &mut row);
                suffix.load(simd, shape, &self.state.suffixes[offset % SEGMENT * size..][..size]);
                some.put(simd, shape, offset, (&suffix, &prefix));
            }
            if some.count == S::F64_LANES || (some.count > 0 && offset + 1 == offsets.end) {
                self.solve(simd, &mut some, &mut row);
            }
        }
        prefix.store(simd, shape, &mut self.state.prefix);
        self.mark();
    }
}

impl<H: Dimensions> OneByOneKernel<'_, '_, '_, H> {
    /// The row that the window at an offset belongs to.
    #[inline(always)]
    fn own(&self, offset: usize) -> usize {
        self.run.base + offset + self.run.plan.before - self.run.plan.window
    }

    /// Solves some windows and writes them out.
    #[inline(always)]
    fn solve<S: Lanes>(&mut self, simd: S, some: &mut Together<H::Factor<S::f64s>>, row: &mut H::Factor<S::f64s>) {
        let Together { count, offsets, suffixes, prefixes } = some;
        let (shape, plan) = (self.shape, self.run.plan);
        let mut left = [1.0; MOST_LANES];
        left.iter_mut().zip(offsets.iter()).for_each(|(left, &offset)| *left = plan.left_at(offset));
        suffixes.merge(simd, shape, plan, prefixes, simd.load(&left, 0), row);
        suffixes.store(simd, shape, &mut self.state.windows);
        let counted = |lane: usize, _: usize| counted(&self.run, self.source, self.run.base + offsets[lane]);
        let OneByOne { tile, windows: summaries, .. } = &mut *self.state;
        let counts = Counts::Asked(&counted);
        apart(simd, Solutions { shape, plan, offsets: 0..1, summaries, counts, rows: None, tile });
        let rows = self.own(offsets[0])..self.own(offsets[*count - 1]) + 1;
        let elements = self.outputs.elements.of(rows);
        write_row(&self.state.tile, S::F64_LANES, elements, None, self.outputs);
        *count = 0;
    }

    /// The summary of no rows.
    #[inline(always)]
    fn nothing<S: Lanes>(&self, simd: S) -> WindowSummary<H::Factor<S::f64s>> {
        WindowSummary::nothing(simd, self.shape, self.run.plan.fading.is_some())
    }

    /// Begins a block: nothing of the next one came yet, and the suffixes that others are built from.
    #[inline(always)]
    fn begin<S: Lanes>(&mut self, simd: S) {
        let (shape, window) = (self.shape, self.run.plan.window);
        let size = self.run.plan.summary(shape.size() * S::F64_LANES);
        let mut row = shape.factor(simd.splat_f64s(0.0));
        let mut suffix = self.nothing(simd);
        suffix.store(simd, shape, &mut self.state.prefix);
        for segment in (1..window.div_ceil(SEGMENT)).rev() {
            for offset in (segment * SEGMENT..window.min((segment + 1) * SEGMENT)).rev() {
                self.append(simd, &mut suffix, offset, &mut row);
            }
            suffix.store(simd, shape, &mut self.state.checkpoints[(segment - 1) * size..][..size]);
        }
        self.state.base = Some(self.run.base);
        self.state.done = 0;
        self.state.segment = usize::MAX;
    }

    /// Builds the suffixes of a segment, unless they are held.
    #[inline(always)]
    fn hold_suffixes<S: Lanes>(&mut self, simd: S, segment: usize, row: &mut H::Factor<S::f64s>) {
        if self.state.segment == segment {
            return;
        }
        let (shape, window) = (self.shape, self.run.plan.window);
        let size = self.run.plan.summary(shape.size() * S::F64_LANES);
        let mut suffix = self.nothing(simd);
        if segment + 1 < window.div_ceil(SEGMENT) {
            suffix.load(simd, shape, &self.state.checkpoints[segment * size..][..size]);
        }
        for offset in (segment * SEGMENT..window.min((segment + 1) * SEGMENT)).rev() {
            self.append(simd, &mut suffix, offset, row);
            suffix.store(simd, shape, &mut self.state.suffixes[offset % SEGMENT * size..][..size]);
        }
        self.state.segment = segment;
    }

    /// Appends the row at an offset from the block's first. One that is no equation or holds an unusable value is zero.
    #[inline(always)]
    fn append<S: Lanes>(
        &self,
        simd: S,
        summary: &mut WindowSummary<H::Factor<S::f64s>>,
        offset: usize,
        row: &mut H::Factor<S::f64s>,
    ) {
        let (shape, plan, place) = (self.shape, self.run.plan, self.run.base + offset);
        let number = place.checked_sub(plan.window).filter(|number| self.run.rows.contains(number));
        let values = number.map(|number| self.source.row(number));
        let own = number.map_or(0.0, |number| self.source.weight(number));
        let usable = values.filter(|values| own > 0.0 && values.iter().all(|value| is_usable(*value)));
        for column in 0..shape.regressors() + shape.rhs_count() {
            row[column] = simd.splat_f64s(usable.map_or(0.0, |values| values[column]));
        }
        // What fades counts its rows, and those that are left out are none.
        let counts = if plan.at_least.is_some() { usable.is_some() } else { values.is_some() };
        let weight = if counts { own } else { 0.0 };
        let (block, offset) = (offset / plan.window, offset % plan.window);
        summary.append(simd, shape, plan, (offset, block), row, simd.splat_f64s(weight));
    }

    /// Flags windows that are incomplete, lack rows or hold an unusable value.
    fn mark(&mut self) {
        let (base, before) = (self.run.base, self.run.plan.window);
        let mut places = std::mem::take(&mut self.state.unusable);
        places.clear();
        let bad = self.source.unusable().iter().filter(|row| self.run.rows.contains(row));
        places.extend(bad.filter_map(|row| (row + before).checked_sub(base)));
        let leaves_out = self.run.plan.at_least.is_some();
        let mut missing = if leaves_out { std::mem::take(&mut places) } else { Vec::new() };
        if self.run.plan.spans_half() {
            let without = self.source.without_weight().iter().filter(|row| self.run.rows.contains(row));
            missing.extend(without.filter_map(|row| (row + before).checked_sub(base)));
            missing.sort_unstable();
        }
        let count = |window| counted(&self.run, self.source, window);
        self.run.mark_windows(&places, &missing, count, self.outputs);
        self.state.unusable = places;
    }
}

/// How many rows of a window count.
fn counted(run: &RollingRun<'_>, source: &dyn RowSource, window: usize) -> usize {
    let first = window.saturating_sub(run.plan.window).max(run.rows.start);
    let among = |rows: &[usize]| {
        let before = |row: usize| rows.partition_point(|&bad| bad < row);
        before(window.min(run.rows.end)).saturating_sub(before(first))
    };
    let missing = if run.plan.at_least.is_some() { among(source.unusable()) } else { 0 };
    run.spanned(window) - missing - among(source.without_weight())
}
