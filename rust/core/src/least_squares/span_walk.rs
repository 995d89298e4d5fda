//! Least squares in windows that hold different numbers of rows, as those of a duration do on irregular times.
//!
//! Windows that reach up to a boundary between two rows, or over it, are a run: each is a suffix of the rows before the boundary and a prefix
//! of those after it, so every row is appended once to either and every window is one merge of two factors, as where all windows hold as
//! many rows. Suffixes and prefixes of several runs are made side by side, one run a lane; then neighbouring windows of a run are merged and
//! solved, one a lane.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{self, GoOn, Piece, Watch};
use crate::lanes::output::Outputs;
use crate::lanes::store::write_block;
use crate::lanes::tile::Tile;
use crate::least_squares::givens_factor::{Dimensions, Few, Many, append, empty, merge, store};
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares, Slots};
use crate::least_squares::solutions::{Counts, Solutions};
use crate::least_squares::span_factors::FactorStorage;
use crate::least_squares::spans::{Run, Spans};
use crate::record::samples::{all_usable, is_usable};
use crate::simd::aligned::{Aligned, bring_near};
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES, apart, dispatch, dispatch_vectors};
use crate::status::Status;

/// Rows of every lane between two calls of `go_on`.
const ASK: usize = 256;

/// Windows in a piece of work, about.
const PIECE: usize = 1 << 14;

/// The most vectors of neighbouring windows of a run that are solved together. Other runs follow, whose factors lie in the same cache lines.
const TOGETHER: usize = 4;

/// Memory of one thread.
#[derive(Default)]
struct SpanScratch {
    /// The rows of some runs, column by column, zero where they do not count, with a margin of zeros on both sides; weights come last, where
    /// there are any.
    rows: Vec<Vec<f64>>,
    margin: usize,
    /// Whether all of them count; otherwise those that count before each, and those that are missing.
    whole: bool,
    counts: Vec<u32>,
    missing: Vec<u32>,
    /// Rows before each lane's boundary, from there on backwards, and those after it: `[step][column][lane]`.
    laid: [Aligned; 2],
    /// Factors of the last rows before each lane's boundary, and of the first after it: none, one, two … of them.
    suffixes: Aligned,
    prefixes: Aligned,
    windows: Aligned,
    tile: Option<Tile>,
}

impl RollingLeastSquares {
    /// Solves windows that hold different numbers of rows, one for every row. The plan says how many rows they must hold, what results they
    /// have, and the most rows that one holds.
    ///
    /// # Errors
    /// If there is not the memory for the windows, or the watch cancels.
    ///
    /// # Panics
    /// If there are not as many windows as rows.
    pub fn run_spans(
        &self,
        equations: &Equations<'_>,
        spans: &Spans,
        mut regressions: Regressions<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let total = equations.columns.first().map_or(0, |column| column.len());
        assert_eq!(spans.count(), total, "one window for every row");
        let (runs, lanes) = (spans.runs(), self.instructions.lanes());
        let mut pieces = Vec::new();
        for runs in runs.chunks((PIECE / (lanes * self.window)).max(1) * lanes) {
            let windows = runs[0].windows.start..runs[runs.len() - 1].windows.end;
            let part = regressions.split_off_before(windows.end);
            pieces.push(Piece { size: windows.len(), content: (runs, part) });
        }
        let most = runs.iter().map(|run| run.before.max(run.after)).max().unwrap_or(0);
        let factor = Many { regressors: self.regressors, rhs_count: self.rhs_count }.size();
        let numbers = most.saturating_mul(2 * lanes).saturating_mul(factor + 2 * self.columns() + 2);
        memory::ask_for_numbers(numbers.saturating_mul(workers.get().min(pieces.len())))?;
        let work = |(runs, mut part): (&[Run], Regressions<'_>), scratch: &mut SpanScratch, go_on: &GoOn<'_>| {
            let mut outputs = Slots::of(self).outputs(&mut part);
            for runs in runs.chunks(lanes) {
                if !go_on() {
                    return;
                }
                let group = SomeRuns { plan: self, equations, spans, runs };
                let outputs = &mut outputs;
                match self.few() {
                    Some(1) => group.solve(Few::<1>, scratch, outputs, go_on),
                    Some(2) => group.solve(Few::<2>, scratch, outputs, go_on),
                    Some(3) => group.solve(Few::<3>, scratch, outputs, go_on),
                    Some(4) => group.solve(Few::<4>, scratch, outputs, go_on),
                    Some(5) => group.solve(Few::<5>, scratch, outputs, go_on),
                    Some(6) => group.solve(Few::<6>, scratch, outputs, go_on),
                    _ => {
                        let shape = Many { regressors: self.regressors, rhs_count: self.rhs_count };
                        dispatch(self.instructions, SpanKernel { group, shape, scratch, outputs, go_on });
                    }
                }
            }
        };
        pool::run_long(pieces, workers, SpanScratch::default, work, watch)
    }
}

/// Runs that are worked on side by side.
#[derive(Clone, Copy)]
struct SomeRuns<'a> {
    plan: &'a RollingLeastSquares,
    equations: &'a Equations<'a>,
    spans: &'a Spans,
    runs: &'a [Run],
}

impl SomeRuns<'_> {
    /// Solves the windows of the runs, with vectors.
    fn solve<H: Dimensions>(self, shape: H, scratch: &mut SpanScratch, outputs: &mut Outputs<'_>, go_on: &GoOn<'_>) {
        dispatch_vectors(self.plan.instructions, SpanKernel { group: self, shape, scratch, outputs, go_on });
    }

    fn windows(&self) -> Range<usize> {
        self.runs[0].windows.start..self.runs[self.runs.len() - 1].windows.end
    }

    /// The rows of all windows.
    fn rows(&self) -> Range<usize> {
        let last = &self.runs[self.runs.len() - 1];
        self.runs[0].boundary - self.runs[0].before..last.boundary + last.after
    }

    /// The most rows that a run has before its boundary, and from it on.
    fn longest(&self) -> [usize; 2] {
        let longest = |of: fn(&Run) -> usize| self.runs.iter().map(of).max().unwrap_or(0);
        [longest(|run| run.before), longest(|run| run.after)]
    }

    /// Reads the rows of all windows. Those that do not count become zero.
    fn read(&self, scratch: &mut SpanScratch) {
        let SpanScratch { rows, margin, whole, counts, missing, .. } = scratch;
        let of = self.rows();
        // As many rows of every run are laid side by side, up to whole vectors.
        let [before, after] = self.longest().map(|longest| longest.next_multiple_of(MOST_LANES));
        let beyond = |run: &Run| {
            (of.start + before).saturating_sub(run.boundary).max((run.boundary + after).saturating_sub(of.end))
        };
        *margin = self.runs.iter().map(beyond).max().unwrap_or(0);
        let places = *margin..*margin + of.len();
        let sources = self.equations.columns.iter().copied().chain(self.equations.weights);
        rows.resize_with(self.plan.columns() + usize::from(self.equations.weights.is_some()), Vec::new);
        for (into, source) in rows.iter_mut().zip(sources) {
            into.resize(places.end + *margin, 0.0);
            into[..places.start].fill(0.0);
            into[places.end..].fill(0.0);
            source.read(of.start, &mut into[places.clone()]);
        }
        let (columns, weights) = rows.split_at_mut(self.plan.columns());
        *whole = weights.is_empty() && columns.iter().all(|column| all_usable(&column[places.clone()]));
        if *whole {
            return;
        }
        counts.clear();
        missing.clear();
        let (mut count, mut lost) = (0, 0);
        counts.push(count);
        missing.push(lost);
        for place in places {
            let has_weight = weights.iter().all(|weights| weights[place] > 0.0);
            if has_weight && columns.iter().all(|column| is_usable(column[place])) {
                count += 1;
            } else {
                for column in columns.iter_mut().chain(weights.iter_mut()) {
                    column[place] = 0.0;
                }
                lost += u32::from(has_weight);
            }
            counts.push(count);
            missing.push(lost);
        }
    }
}

/// The kernel that solves the windows of some runs.
struct SpanKernel<'a, 'b, 'c, H: Dimensions> {
    group: SomeRuns<'a>,
    shape: H,
    scratch: &'b mut SpanScratch,
    outputs: &'b mut Outputs<'c>,
    go_on: &'b GoOn<'b>,
}

impl<H: Dimensions> Kernel for SpanKernel<'_, '_, '_, H> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(mut self, simd: S) {
        self.group.read(self.scratch);
        apart(simd, LayOut { group: self.group, scratch: self.scratch });
        if !self.build(simd) {
            return;
        }
        let together = together(self.shape) * S::F64_LANES;
        let longest = self.group.runs.iter().map(|run| run.windows.len()).max().unwrap_or(0);
        let [before, after] = self.group.longest();
        let storages = [FactorStorage::of::<S, H>(self.shape, before), FactorStorage::of::<S, H>(self.shape, after)];
        for first in (0..longest).step_by(together) {
            if first % ASK == 0 && !(self.go_on)() {
                return;
            }
            for lane in 0..self.group.runs.len() {
                // Runs take turns, each at places in memory of its own, whose beginnings no processor foresees.
                let is_last = lane + 1 == self.group.runs.len();
                let (next, after) = if is_last { (0, first + together) } else { (lane + 1, first) };
                self.bring_near(self.group.runs[next].some(after, together));
                let some = self.group.runs[lane].some(first, together);
                if !some.is_empty() {
                    self.solve(simd, lane, some, storages);
                }
            }
        }
        self.leave_residuals();
        self.mark();
    }
}

/// The kernel that lays the rows before each boundary and after it side by side.
struct LayOut<'a, 'b> {
    group: SomeRuns<'a>,
    scratch: &'b mut SpanScratch,
}

impl Kernel for LayOut<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let (group, lanes) = (self.group, S::F64_LANES);
        let SpanScratch { rows, margin, laid, .. } = self.scratch;
        let start = group.rows().start;
        let columns = rows.len();
        for (side, (laid, length)) in laid.iter_mut().zip(group.longest()).enumerate() {
            let length = length.next_multiple_of(lanes);
            if laid.len() < length * columns * lanes {
                *laid = Aligned::zeros(length * columns * lanes);
            }
            let mut square = [simd.splat_f64s(0.0); MOST_LANES];
            for (column, values) in rows.iter().enumerate() {
                for step in (0..length).step_by(lanes) {
                    for (run, vector) in group.runs.iter().zip(&mut square) {
                        let boundary = *margin + run.boundary - start;
                        let place = if side == 0 { boundary - step - lanes } else { boundary + step };
                        *vector = simd.load(values, place);
                    }
                    simd.transpose(&mut square[..lanes]);
                    for (row, &vector) in square[..lanes].iter().enumerate() {
                        let step = if side == 0 { step + lanes - 1 - row } else { step + row };
                        simd.store(laid, (step * columns + column) * lanes, vector);
                    }
                }
            }
        }
    }
}

impl<H: Dimensions> SpanKernel<'_, '_, '_, H> {
    /// Makes the factors of all suffixes and prefixes. Returns whether the work goes on.
    #[inline(always)]
    fn build<S: Lanes>(&mut self, simd: S) -> bool {
        let shape = self.shape;
        let SpanScratch { rows, laid, suffixes, prefixes, .. } = &mut *self.scratch;
        let columns = shape.regressors() + shape.rhs_count();
        let apart = rows.len() * S::F64_LANES;
        let mut row = shape.factor(simd.splat_f64s(0.0));
        for ((laid, factors), length) in laid.iter().zip([suffixes, prefixes]).zip(self.group.longest()) {
            let storage = FactorStorage::of::<S, H>(shape, length);
            if factors.len() < storage.numbers {
                *factors = Aligned::zeros(storage.numbers);
            }
            let mut factor = empty(simd, shape);
            storage.put(simd, shape, factors, 0, &factor);
            for step in 0..length {
                if step % ASK == 0 && !(self.go_on)() {
                    return false;
                }
                let values = &laid[step * apart..][..apart];
                for column in 0..columns {
                    row[column] = simd.load(values, column * S::F64_LANES);
                }
                // Rows that do not count are zero: whatever their weight, they change nothing.
                let weight = if apart > columns * S::F64_LANES {
                    simd.load(values, columns * S::F64_LANES)
                } else {
                    simd.splat_f64s(1.0)
                };
                append(simd, shape, &mut factor, &mut row, 0, weight);
                storage.put(simd, shape, factors, step + 1, &factor);
            }
        }
        true
    }

    /// Has what some windows need, and where their results will be, brought near while others are solved.
    #[inline(always)]
    fn bring_near(&self, some: Range<usize>) {
        let (before, after) = self.group.spans.around_boundary(some.clone());
        bring_near(before);
        bring_near(after);
        let elements = self.outputs.elements.of(some);
        for values in self.outputs.values.iter().filter(|values| !values.is_empty()) {
            bring_near(&values[elements.clone()]);
        }
    }

    /// Solves some neighbouring windows of the run of a lane, whose factors are stored before its boundary and after it.
    #[inline(always)]
    fn solve<S: Lanes>(&mut self, simd: S, lane: usize, some: Range<usize>, storages: [FactorStorage; 2]) {
        let (shape, group) = (self.shape, self.group);
        let plan = group.plan;
        let size = shape.size() * S::F64_LANES;
        let (before, after) = group.spans.around_boundary(some.clone());
        let (mut suffix, mut prefix) = (empty(simd, shape), empty(simd, shape));
        let mut row = shape.factor(simd.splat_f64s(0.0));
        let boundary = group.runs[lane].boundary - group.rows().start;
        let SpanScratch { suffixes, prefixes, windows, tile, counts, whole, .. } = &mut *self.scratch;
        if windows.len() < TOGETHER * size {
            *windows = Aligned::zeros(TOGETHER * size);
        }
        let vectors = some.len().div_ceil(S::F64_LANES);
        let mut held = [0.0; TOGETHER * MOST_LANES];
        for (vector, held) in held.chunks_exact_mut(S::F64_LANES).enumerate().take(vectors) {
            let first = vector * S::F64_LANES;
            let (mut last_before, mut last_after) = ([0; MOST_LANES], [0; MOST_LANES]);
            // Read in their place, but for the last windows: what was just copied in parts would have to be waited for.
            let (before, after) = if first + S::F64_LANES <= some.len() {
                (&before[first..first + S::F64_LANES], &after[first..first + S::F64_LANES])
            } else {
                (filled_up::<S>(&before[first..], &mut last_before), filled_up::<S>(&after[first..], &mut last_after))
            };
            for (held, (&before, &after)) in held.iter_mut().zip(before.iter().zip(after)) {
                *held = if *whole {
                    f64::from(before + after)
                } else {
                    f64::from(counts[boundary + after as usize] - counts[boundary - before as usize])
                };
            }
            storages[0].get(simd, shape, suffixes, (lane, before), &mut suffix);
            storages[1].get(simd, shape, prefixes, (lane, after), &mut prefix);
            merge(simd, shape, &mut suffix, &prefix, &mut row);
            store(simd, shape, &mut windows[vector * size..][..size], &suffix);
        }
        let tile = tile.get_or_insert_with(|| Tile::new(Slots::of(plan).fields(), TOGETHER, S::F64_LANES));
        let summaries = &windows[..vectors * size];
        let counts = Counts::Listed(&held);
        apart(simd, Solutions { shape, plan, offsets: 0..vectors, summaries, counts, rows: None, tile: &mut *tile });
        let elements = self.outputs.elements.of(some);
        write_block(simd, tile, elements, self.outputs);
    }

    /// Writes what windows leave at their own rows, where that is asked for.
    fn leave_residuals(&mut self) {
        let (plan, group) = (self.group.plan, self.group);
        if !plan.fit {
            return;
        }
        let (p, q, slots) = (plan.regressors, plan.rhs_count, Slots::of(plan));
        let SpanScratch { rows: columns, margin, whole, counts, .. } = &*self.scratch;
        let (windows, rows) = (group.windows(), group.rows());
        // Of windows that do not hold their own rows these may be elsewhere.
        let inside = windows.start.max(rows.start)..windows.end.min(rows.end);
        let elements = self.outputs.elements;
        let (results, left) = self.outputs.values.split_at_mut(slots.own_residuals);
        for (rhs, left) in left[..q].iter_mut().enumerate().filter(|(_, left)| !left.is_empty()) {
            if inside != windows {
                left[elements.of(windows.clone())].fill(f64::NAN);
            }
            if inside.is_empty() {
                continue;
            }
            let places = inside.start - rows.start..inside.end - rows.start;
            let held = *margin + places.start..*margin + places.end;
            let left = &mut left[elements.of(inside.clone())];
            left.copy_from_slice(&columns[p + rhs][held.clone()]);
            for (regressor, column) in columns[..p].iter().enumerate() {
                let values = &results[regressor * q + rhs][elements.of(inside.clone())];
                for ((left, value), x) in left.iter_mut().zip(values).zip(&column[held.clone()]) {
                    *left -= x * value;
                }
            }
            for (left, place) in left.iter_mut().zip(places).filter(|_| !whole) {
                if counts[place + 1] == counts[place] {
                    *left = f64::NAN;
                }
            }
        }
    }

    /// Flags windows that lack rows, and invalidates those that have too few or hold an unusable value.
    fn mark(&mut self) {
        let (plan, group) = (self.group.plan, self.group);
        let SpanScratch { whole, counts, missing, .. } = &*self.scratch;
        let enough = plan.at_least.unwrap_or(0).max(plan.regressors + 1);
        if *whole && group.spans.most_and_fewest().1 >= enough {
            return;
        }
        let zero = group.rows().start;
        let of_run = |run: &Run| run.windows.clone().zip(std::iter::repeat(run.boundary - zero));
        for (window, boundary) in group.runs.iter().flat_map(of_run) {
            let (before, after) = group.spans.around_boundary(window..window + 1);
            let (first, end) = (boundary - before[0] as usize, boundary + after[0] as usize);
            let (count, lost) = if *whole {
                (end - first, 0)
            } else {
                ((counts[end] - counts[first]) as usize, missing[end] - missing[first])
            };
            let flags = if lost > 0 && plan.at_least.is_some() { Status::GAP } else { Status::GOOD };
            let is_spoilt = lost > 0 && plan.at_least.is_none();
            if is_spoilt || plan.at_least.is_some_and(|least| count < least) {
                self.outputs.invalidate(window..window + 1, flags | Status::INVALID);
            } else if count <= plan.regressors {
                self.outputs.invalidate(window..window + 1, flags | Status::INVALID | Status::RANK_DEFICIENT);
                let elements = self.outputs.elements.of(window..window + 1);
                if let Some(condition) = self.outputs.values.last_mut().filter(|condition| !condition.is_empty()) {
                    condition[elements].fill(f64::INFINITY);
                }
            } else if flags != Status::GOOD && !self.outputs.status.is_empty() {
                let elements = self.outputs.elements.of(window..window + 1);
                self.outputs.status[elements].iter_mut().for_each(|status| *status |= flags.bits());
            }
        }
    }
}

/// Rows of the last few windows, and of the last of them in the lanes beyond: it is solved again there.
#[inline(always)]
fn filled_up<'a, S: Lanes>(rows: &[u32], into: &'a mut [u32; MOST_LANES]) -> &'a [u32] {
    into.fill(rows[rows.len() - 1]);
    into[..rows.len()].copy_from_slice(rows);
    &into[..S::F64_LANES]
}

/// Vectors of neighbouring windows that are solved together.
fn together<H: Dimensions>(shape: H) -> usize {
    if shape.size() <= 10 { TOGETHER } else { TOGETHER / 2 }
}
