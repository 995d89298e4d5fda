//! Blocks of windows that are computed side by side: their rows, their memory and their incomplete windows.

use std::ops::Range;

use crate::lanes::interleaved::Strips;
use crate::lanes::output::Outputs;
use crate::lanes::tile::{TILE, Tile};
use crate::least_squares::givens_factor::{Dimensions, Many};
use crate::least_squares::plan::{Equations, RollingLeastSquares, Slots};
use crate::record::samples::{Samples, all_usable, is_usable};
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Kernel, Lanes};
use crate::status::Status;

/// Suffix factors that are kept at a time. Longer windows keep one of so many and recompute the others.
pub(crate) const SEGMENT: usize = 2048;

/// With so many fields a full tile takes 32 KB of the first-level cache: what is written of a lane then lies in a few whole cache lines. With
/// more of them a tile has room for fewer windows.
const MOST_FIELDS: usize = 16;

/// Memory of one thread.
#[derive(Debug)]
pub struct RollingScratch {
    /// One column of a run's rows.
    column: Vec<f64>,
    /// Rows of the run with an unusable value that spoils their windows, in order.
    pub(crate) unusable: Vec<usize>,
    /// Rows that are left out since values are missing, and all that are left out, in order.
    missing: Vec<usize>,
    left_out: Vec<usize>,
    /// Rows that count before each row of the run. Not made where every window is full.
    pub(crate) counts: Vec<u32>,
    pub(crate) strips: Vec<Strips>,
    pub(crate) suffixes: Aligned,
    pub(crate) checkpoints: Aligned,
    pub(crate) tile: Tile,
}

impl RollingScratch {
    pub(crate) fn new(plan: &RollingLeastSquares) -> Self {
        let lanes = plan.instructions.lanes();
        let columns = plan.regressors + plan.rhs_count;
        let strips = Strips::new(plan.window, plan.window, lanes);
        let factor = Many { regressors: plan.regressors, rhs_count: plan.rhs_count }.size() * lanes;
        let factor = plan.summary(factor);
        let fields = Slots::of(plan).fields();
        let places = if fields <= MOST_FIELDS { TILE } else { lanes.next_multiple_of(8) };
        Self {
            column: vec![0.0; strips.samples()],
            unusable: Vec::new(),
            missing: Vec::new(),
            left_out: Vec::new(),
            counts: Vec::new(),
            strips: vec![strips; columns + 1],
            suffixes: Aligned::zeros(plan.window.min(SEGMENT) * factor),
            checkpoints: Aligned::zeros((plan.window.div_ceil(SEGMENT) - 1) * factor),
            tile: Tile::new(fields, places, lanes),
        }
    }
}

/// Blocks of windows side by side: lane `l` works on those that begin at `base + l w`, of which `windows` are wanted.
pub(crate) struct RollingRun<'a> {
    pub(crate) plan: &'a RollingLeastSquares,
    pub(crate) base: usize,
    pub(crate) windows: Range<usize>,
    /// Rows that are equations.
    pub(crate) rows: Range<usize>,
}

/// The kernel that lays out the rows of a run. Rows that are no equations, or hold an unusable value, become zero. Tells whether every row of
/// every window counts.
pub(crate) struct Load<'a, 'b> {
    pub(crate) run: &'b RollingRun<'a>,
    pub(crate) equations: &'b Equations<'a>,
    pub(crate) scratch: &'b mut RollingScratch,
}

impl Kernel for Load<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> bool {
        self.run.load(simd, self.equations, self.scratch)
    }
}

impl RollingRun<'_> {
    /// Lays out the rows of the run. Returns whether every row of every window counts.
    #[inline(always)]
    fn load<S: Lanes>(&self, simd: S, equations: &Equations<'_>, scratch: &mut RollingScratch) -> bool {
        let RollingScratch { column, unusable, missing, left_out, counts, strips, .. } = scratch;
        let before = self.plan.window;
        let end = self.base + column.len();
        let present = (self.rows.start + before).clamp(self.base, end)..(self.rows.end + before).clamp(self.base, end);
        let places = present.start - self.base..present.end - self.base;
        unusable.clear();
        left_out.clear();
        missing.clear();
        let (columns, weights) = strips.split_at_mut(self.plan.columns());
        let read = |record: &dyn Samples, column: &mut [f64]| {
            column[..places.start].fill(0.0);
            column[places.end..].fill(0.0);
            record.read(present.start.saturating_sub(before), &mut column[places.clone()]);
        };
        for (strips, record) in columns.iter_mut().zip(&equations.columns) {
            read(*record, column);
            if !all_usable(column) {
                unusable.extend((0..column.len()).filter(|&row| !is_usable(column[row])));
            }
            strips.fill(simd, column);
        }
        unusable.sort_unstable();
        unusable.dedup();
        if let Some(weights) = equations.weights {
            read(weights, column);
            left_out.extend(places.clone().filter(|&row| column[row] == 0.0));
            unusable.retain(|&row| column[row] != 0.0);
        } else if self.plan.fading.is_some() {
            column.fill(0.0);
            column[places.clone()].fill(1.0);
        }
        if self.plan.at_least.is_some() {
            missing.append(unusable);
            left_out.extend(&*missing);
            left_out.sort_unstable();
        }
        if self.plan.is_weighted(equations) {
            for &row in &*missing {
                column[row] = 0.0;
            }
            weights[0].fill(simd, column);
        }
        for strips in columns {
            for &row in unusable.iter().chain(&*left_out) {
                strips.clear(row);
            }
        }
        let full = left_out.is_empty() && self.is_whole(S::F64_LANES);
        if !full {
            counts.clear();
            counts.resize(column.len() + 1, 0);
            counts[places.start + 1..=places.end].fill(1);
            for &row in &*left_out {
                counts[row + 1] = 0;
            }
            for row in 1..counts.len() {
                counts[row] += counts[row - 1];
            }
        }
        full
    }

    /// How many equations a window spans, whether they count or not.
    pub(crate) fn spanned(&self, window: usize) -> usize {
        let first = window.max(self.rows.start + self.plan.window);
        let end = (window + self.plan.window).min(self.rows.end + self.plan.window);
        end.saturating_sub(first)
    }

    /// How many rows of a window count, where not every window is full.
    pub(crate) fn count(&self, counts: &[u32], window: usize) -> usize {
        let first = window - self.base;
        (counts[first + self.plan.window] - counts[first]) as usize
    }

    /// The window that begins in row 0 of a lane.
    pub(crate) fn first(&self, lane: usize) -> usize {
        self.base + lane * self.plan.window
    }

    /// Whether every row of every window is an equation.
    fn is_whole(&self, lanes: usize) -> bool {
        self.spanned(self.base) == self.plan.window && self.spanned(self.first(lanes) - 1) == self.plan.window
    }

    /// Flags windows with fewer rows, and invalidates those that have too few or hold an unusable value.
    pub(crate) fn mark(&self, scratch: &RollingScratch, full: bool, outputs: &mut Outputs<'_>) {
        let RollingScratch { unusable, missing, left_out, .. } = scratch;
        if full && unusable.is_empty() {
            return;
        }
        let missing = if self.plan.spans_half() { left_out } else { missing };
        let count = |window| if full { self.spanned(window) } else { self.count(&scratch.counts, window) };
        self.mark_windows(unusable, missing, count, outputs);
        self.forget_residuals(&scratch.left_out, outputs);
    }

    /// The same with places that are unusable or missing, in order, and rows of a window that count.
    pub(crate) fn mark_windows(
        &self,
        unusable: &[usize],
        missing: &[usize],
        count: impl Fn(usize) -> usize,
        outputs: &mut Outputs<'_>,
    ) {
        let plan = self.plan;
        let (mut next_unusable, mut next_missing) = (0, 0);
        for window in self.windows.clone() {
            let row = window + plan.before - plan.window;
            let (spanned, count) = (self.spanned(window), count(window));
            let rows = window - self.base..window - self.base + plan.window;
            let mut flags = if spanned < plan.window { Status::EDGE } else { Status::GOOD };
            if is_among(missing, &mut next_missing, &rows) {
                flags |= Status::GAP;
            }
            let spans_enough = 2 * spanned >= plan.window || (plan.at_least.is_some() && !plan.spans_half());
            let enough = spans_enough && plan.at_least.is_none_or(|least| count >= least);
            if !enough || is_among(unusable, &mut next_unusable, &rows) {
                outputs.invalidate(row..row + 1, flags | Status::INVALID);
            } else if count <= plan.regressors {
                outputs.invalidate(row..row + 1, flags | Status::INVALID | Status::RANK_DEFICIENT);
                let elements = outputs.elements.of(row..row + 1);
                if let Some(condition) = outputs.values.last_mut().filter(|condition| !condition.is_empty()) {
                    condition[elements].fill(f64::INFINITY);
                }
            } else if flags != Status::GOOD {
                let elements = outputs.elements.of(row..row + 1);
                if !outputs.status.is_empty() {
                    outputs.status[elements].iter_mut().for_each(|status| *status |= flags.bits());
                }
            }
        }
    }

    /// Rows that are left out have no residual: nothing is known of what they hold.
    fn forget_residuals(&self, left_out: &[usize], outputs: &mut Outputs<'_>) {
        let (plan, slots) = (self.plan, Slots::of(self.plan));
        for window in left_out.iter().filter_map(|row| (self.base + row).checked_sub(plan.before)) {
            if self.windows.contains(&window) {
                let row = window + plan.before - plan.window;
                let elements = outputs.elements.of(row..row + 1);
                for values in &mut outputs.values[slots.own_residuals..slots.rsquared] {
                    if !values.is_empty() {
                        values[elements.clone()].fill(f64::NAN);
                    }
                }
            }
        }
    }
}

/// Whether one of some places, which are in order, is among some rows that move on from call to call.
fn is_among(places: &[usize], next: &mut usize, rows: &Range<usize>) -> bool {
    while places.get(*next).is_some_and(|place| *place < rows.start) {
        *next += 1;
    }
    places.get(*next).is_some_and(|place| *place < rows.end)
}
