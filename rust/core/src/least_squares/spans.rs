//! Least squares in windows that hold different numbers of rows, as those of a duration do on irregular times.
//!
//! No window begins or ends before the one before it. Windows that reach up to a boundary between two rows, or over it, are a run: each is
//! a suffix of the rows before the boundary and a prefix of those after it, so every row is appended once to either and every window is
//! one merge of two factors, as where all windows hold as many rows. The first window of a run ends at its boundary; runs follow from the
//! windows alone. Suffixes and prefixes of several runs are made side by side, one run a lane, then neighbouring windows of a run are merged
//! and solved, one a lane.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{self, GoOn, Piece, Watch};
use crate::lanes::interleaved::Strips;
use crate::lanes::output::Outputs;
use crate::lanes::store::write_block;
use crate::lanes::tile::{TILE, Tile};
use crate::least_squares::givens_factor::{Dimensions, Few, Many, append, empty, load, merge, store};
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares, Slots};
use crate::least_squares::solutions::{Count, Solutions};
use crate::record::samples::{all_usable, is_usable};
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES, apart, dispatch, dispatch_vectors};
use crate::status::Status;

/// Rows of every lane between two calls of `go_on`.
const ASK: usize = 256;

/// The rows of every window: from one on, up to before another. Neither may be less than that of the window before.
#[derive(Clone, Copy, Debug)]
pub struct Spans<'a> {
    /// First rows.
    pub first: &'a [usize],
    /// Rows after the last.
    pub end: &'a [usize],
}

/// Windows that reach up to a boundary or over it.
#[derive(Clone, Debug)]
struct Run {
    windows: Range<usize>,
    /// Rows before this one, and from it on.
    boundary: usize,
    before: usize,
    after: usize,
}

/// For each of some times that never decrease, the first of others that is not before it.
///
/// The others must not decrease either.
#[must_use]
pub fn not_before(times: &[f64], from: impl Iterator<Item = f64>) -> Vec<usize> {
    let mut place = 0;
    let next = |from: f64| {
        while times.get(place).is_some_and(|time| *time < from) {
            place += 1;
        }
        place
    };
    from.map(next).collect()
}

impl Spans<'_> {
    /// Whether there is a window for each of some rows, and windows are in order and within the record.
    #[must_use]
    pub fn are_of(&self, rows: usize) -> bool {
        let in_order = |numbers: &[usize]| numbers.is_sorted();
        self.first.len() == rows
            && self.end.len() == rows
            && in_order(self.first)
            && in_order(self.end)
            && self.first.iter().zip(self.end).all(|(first, end)| first <= end && *end <= rows)
    }

    fn runs(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        let mut window = 0;
        while window < self.first.len() {
            let boundary = self.end[window];
            let end = window + self.first[window..].partition_point(|first| *first <= boundary);
            let (before, after) = (boundary - self.first[window], self.end[end - 1] - boundary);
            runs.push(Run { windows: window..end, boundary, before, after });
            window = end;
        }
        runs
    }
}

/// Memory of one thread.
#[derive(Default)]
struct SpanScratch {
    /// The rows of some runs, column by column, zero where they do not count; weights come last, where there are any.
    rows: Vec<Vec<f64>>,
    /// Whether all of them count; otherwise those that count before each, and those that are missing.
    whole: bool,
    counts: Vec<u32>,
    missing: Vec<u32>,
    lane: Vec<f64>,
    strips: Vec<[Strips; 2]>,
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
    /// If the windows are not [`Spans::are_of`] the rows.
    pub fn run_spans(
        &self,
        equations: &Equations<'_>,
        spans: Spans<'_>,
        mut regressions: Regressions<'_>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<(), Error> {
        let total = equations.columns.first().map_or(0, |column| column.len());
        assert!(spans.are_of(total), "windows in order, one for every row");
        let (runs, lanes) = (spans.runs(), self.instructions.lanes());
        let mut pieces = Vec::new();
        for runs in runs.chunks(lanes) {
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
            let group = SomeRuns { plan: self, equations, spans, runs };
            match self.few() {
                Some(1) => group.solve(Few::<1>, scratch, &mut outputs, go_on),
                Some(2) => group.solve(Few::<2>, scratch, &mut outputs, go_on),
                Some(3) => group.solve(Few::<3>, scratch, &mut outputs, go_on),
                Some(4) => group.solve(Few::<4>, scratch, &mut outputs, go_on),
                _ => {
                    let shape = Many { regressors: self.regressors, rhs_count: self.rhs_count };
                    dispatch(self.instructions, SpanKernel { group, shape, scratch, outputs: &mut outputs, go_on });
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
    spans: Spans<'a>,
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
        let windows = self.windows();
        self.spans.first[windows.start]..self.spans.end[windows.end - 1]
    }

    /// Reads the rows of all windows. Those that do not count become zero.
    fn read(&self, scratch: &mut SpanScratch) {
        let SpanScratch { rows, whole, counts, missing, .. } = scratch;
        let of = self.rows();
        let sources = self.equations.columns.iter().copied().chain(self.equations.weights);
        rows.resize_with(self.plan.columns() + usize::from(self.equations.weights.is_some()), Vec::new);
        for (into, source) in rows.iter_mut().zip(sources) {
            into.resize(of.len(), 0.0);
            source.read(of.start, into);
        }
        let (columns, weights) = rows.split_at_mut(self.plan.columns());
        *whole = weights.is_empty() && columns.iter().all(|column| all_usable(column));
        if *whole {
            return;
        }
        counts.clear();
        missing.clear();
        let (mut count, mut lost) = (0, 0);
        counts.push(count);
        missing.push(lost);
        for row in 0..of.len() {
            let has_weight = weights.iter().all(|weights| weights[row] > 0.0);
            if has_weight && columns.iter().all(|column| is_usable(column[row])) {
                count += 1;
            } else {
                for column in columns.iter_mut().chain(weights.iter_mut()) {
                    column[row] = 0.0;
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
        self.lay_out(simd);
        if !self.build(simd) {
            return;
        }
        for lane in 0..self.group.runs.len() {
            if !(self.go_on)() {
                return;
            }
            self.solve(simd, lane);
        }
        self.leave_residuals();
        self.mark();
    }
}

impl<H: Dimensions> SpanKernel<'_, '_, '_, H> {
    /// Lays the rows before each boundary and after it side by side.
    #[inline(always)]
    fn lay_out<S: Lanes>(&mut self, simd: S) {
        let SpanScratch { rows, lane, strips, .. } = &mut *self.scratch;
        let (runs, first) = (self.group.runs, self.group.rows().start);
        let longest = |of: &dyn Fn(&Run) -> usize| runs.iter().map(of).max().unwrap_or(0).max(S::F64_LANES);
        let lengths = [longest(&|run| run.before), longest(&|run| run.after)];
        let make = |length: usize| Strips::new(length, length, S::F64_LANES);
        let fits = |strips: &Strips, length: usize| (length..=2 * length).contains(&strips.block());
        if strips.len() != rows.len()
            || !lengths.iter().enumerate().all(|(side, &length)| fits(&strips[0][side], length))
        {
            strips.clear();
            strips.resize_with(rows.len(), || lengths.map(make));
        }
        for (column, strips) in rows.iter().zip(strips) {
            for (side, strips) in strips.iter_mut().enumerate() {
                let block = strips.block();
                lane.clear();
                lane.resize(strips.samples(), 0.0);
                for (run, lane) in runs.iter().zip(lane.chunks_mut(block)) {
                    let middle = run.boundary - first;
                    if side == 0 {
                        lane[block - run.before..].copy_from_slice(&column[middle - run.before..middle]);
                    } else {
                        lane[..run.after].copy_from_slice(&column[middle..middle + run.after]);
                    }
                }
                strips.fill(simd, lane);
            }
        }
    }

    /// Makes the factors of all suffixes and prefixes. Returns whether the work goes on.
    #[inline(always)]
    fn build<S: Lanes>(&mut self, simd: S) -> bool {
        let (shape, runs) = (self.shape, self.group.runs);
        let size = shape.size() * S::F64_LANES;
        let SpanScratch { strips, suffixes, prefixes, .. } = &mut *self.scratch;
        let columns = shape.regressors() + shape.rhs_count();
        let mut row = shape.factor(simd.splat_f64s(0.0));
        for (side, factors) in [suffixes, prefixes].into_iter().enumerate() {
            let length = runs.iter().map(|run| if side == 0 { run.before } else { run.after }).max().unwrap_or(0);
            if factors.len() < (length + 1) * size {
                *factors = Aligned::zeros((length + 1) * size);
            }
            let block = strips[0][side].block();
            let mut factor = empty(simd, shape);
            store(simd, shape, &mut factors[..size], &factor);
            for step in 0..length {
                if step % ASK == 0 && !(self.go_on)() {
                    return false;
                }
                let place = strips[0][side].place(if side == 0 { block - 1 - step } else { step }, 0);
                for (column, strips) in strips[..columns].iter().enumerate() {
                    row[column] = strips[side].in_place(simd, place);
                }
                // Rows that do not count are zero: whatever their weight, they change nothing.
                let weight = match strips.get(columns) {
                    Some(weights) => weights[side].in_place(simd, place),
                    None => simd.splat_f64s(1.0),
                };
                append(simd, shape, &mut factor, &mut row, 0, weight);
                store(simd, shape, &mut factors[(step + 1) * size..][..size], &factor);
            }
        }
        true
    }

    /// Solves the windows of the run of a lane.
    #[inline(always)]
    fn solve<S: Lanes>(&mut self, simd: S, lane: usize) {
        let (shape, group) = (self.shape, self.group);
        let (plan, run) = (group.plan, &group.runs[lane]);
        let size = shape.size() * S::F64_LANES;
        let places = TILE.min(1024 / S::F64_LANES / Slots::of(plan).fields()).max(1);
        let places = if places.is_power_of_two() { places } else { places.next_power_of_two() / 2 };
        let first_row = group.rows().start;
        let (mut suffix, mut prefix) = (empty(simd, shape), empty(simd, shape));
        let mut row = shape.factor(simd.splat_f64s(0.0));
        let mut gathered = [Aligned::zeros(size), Aligned::zeros(size)];
        for first in run.windows.clone().step_by(places * S::F64_LANES) {
            let some = first..run.windows.end.min(first + places * S::F64_LANES);
            let SpanScratch { suffixes, prefixes, windows, tile, counts, whole, .. } = &mut *self.scratch;
            if windows.len() < places * size {
                *windows = Aligned::zeros(places * size);
            }
            let vectors = some.len().div_ceil(S::F64_LANES);
            for vector in 0..vectors {
                for place in 0..S::F64_LANES {
                    // Beyond the last window the last is solved again.
                    let window = (first + vector * S::F64_LANES + place).min(some.end - 1);
                    let (before, after) =
                        (run.boundary - group.spans.first[window], group.spans.end[window] - run.boundary);
                    let [of_suffix, of_prefix] = &mut gathered;
                    take(&suffixes[before * size..][..size], lane, of_suffix, place, S::F64_LANES);
                    take(&prefixes[after * size..][..size], lane, of_prefix, place, S::F64_LANES);
                }
                load(simd, shape, &gathered[0], &mut suffix);
                load(simd, shape, &gathered[1], &mut prefix);
                merge(simd, shape, &mut suffix, &prefix, &mut row);
                store(simd, shape, &mut windows[vector * size..][..size], &suffix);
            }
            let count = |lane: usize, vector: usize| {
                let window = (first + vector * S::F64_LANES + lane).min(some.end - 1);
                let (first, end) = (group.spans.first[window], group.spans.end[window]);
                if *whole { end - first } else { (counts[end - first_row] - counts[first - first_row]) as usize }
            };
            let tile = tile.get_or_insert_with(|| Tile::new(Slots::of(plan).fields(), places, S::F64_LANES));
            let summaries = &windows[..vectors * size];
            let count = Some(&count as &Count<'_>);
            apart(simd, Solutions { shape, plan, offsets: 0..vectors, summaries, count, rows: None, tile: &mut *tile });
            let elements = self.outputs.elements.of(some);
            write_block(tile, S::F64_LANES, elements, self.outputs);
        }
    }

    /// Writes what windows leave at their own rows, where that is asked for.
    fn leave_residuals(&mut self) {
        let (plan, group) = (self.group.plan, self.group);
        if !plan.fit {
            return;
        }
        let (p, q, slots) = (plan.regressors, plan.rhs_count, Slots::of(plan));
        let SpanScratch { rows: columns, whole, counts, .. } = &*self.scratch;
        let (windows, rows) = (group.windows(), group.rows());
        // Of windows that do not hold their own rows these may be elsewhere.
        let inside = windows.start.max(rows.start)..windows.end.min(rows.end);
        let elements = self.outputs.elements;
        let (results, left) = self.outputs.values.split_at_mut(slots.own_residuals);
        for (rhs, left) in left[..q].iter_mut().enumerate().filter(|(_, left)| !left.is_empty()) {
            left[elements.of(windows.clone())].fill(f64::NAN);
            if inside.is_empty() {
                continue;
            }
            let places = inside.start - rows.start..inside.end - rows.start;
            let left = &mut left[elements.of(inside.clone())];
            left.copy_from_slice(&columns[p + rhs][places.clone()]);
            for (regressor, column) in columns[..p].iter().enumerate() {
                let values = &results[regressor * q + rhs][elements.of(inside.clone())];
                for ((left, value), x) in left.iter_mut().zip(values).zip(&column[places.clone()]) {
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
        let start = group.rows().start;
        for window in group.windows() {
            let (first, end) = (group.spans.first[window] - start, group.spans.end[window] - start);
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

/// Copies the factor of one lane to a place of others.
#[inline(always)]
fn take(factor: &[f64], lane: usize, into: &mut [f64], place: usize, lanes: usize) {
    debug_assert!(lanes <= MOST_LANES);
    for (from, into) in factor.chunks_exact(lanes).zip(into.chunks_exact_mut(lanes)) {
        into[place] = from[lane];
    }
}
