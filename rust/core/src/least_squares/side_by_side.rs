//! Blocks of windows that are computed side by side: their rows, their memory and their incomplete windows.

use std::ops::Range;

use crate::lanes::interleaved::Strips;
use crate::lanes::output::Outputs;
use crate::lanes::tile::Tile;
use crate::least_squares::givens_factor::{Dimensions, Many};
use crate::least_squares::plan::{Equations, RollingLeastSquares, Slots};
use crate::record::samples::{all_usable, is_usable};
use crate::simd::aligned::Aligned;
use crate::simd::vectors::Lanes;
use crate::status::Status;

/// Suffix factors that are kept at a time. Longer windows keep one of so many and recompute the others.
pub(crate) const SEGMENT: usize = 2048;

/// Memory of one thread.
#[derive(Debug)]
pub struct RollingScratch {
    /// One column of a run's rows.
    column: Vec<f64>,
    /// Rows of the run with an unusable value, in order.
    pub(crate) unusable: Vec<usize>,
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
        Self {
            column: vec![0.0; strips.samples()],
            unusable: Vec::new(),
            strips: vec![strips; columns],
            suffixes: Aligned::zeros(plan.window.min(SEGMENT) * factor),
            checkpoints: Aligned::zeros((plan.window.div_ceil(SEGMENT) - 1) * factor),
            tile: Tile::new(Slots::of(plan).fields(), lanes.next_multiple_of(8), lanes),
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

impl RollingRun<'_> {
    /// Lays out the rows of the run. Rows that are no equations, or hold an unusable value, become zero.
    #[inline(always)]
    pub(crate) fn load<S: Lanes>(&self, simd: S, equations: &Equations<'_>, scratch: &mut RollingScratch) {
        let RollingScratch { column, unusable, strips, .. } = scratch;
        let before = self.plan.window;
        let end = self.base + column.len();
        let present = (self.rows.start + before).clamp(self.base, end)..(self.rows.end + before).clamp(self.base, end);
        let places = present.start - self.base..present.end - self.base;
        unusable.clear();
        for (strips, record) in strips.iter_mut().zip(&equations.columns) {
            column[..places.start].fill(0.0);
            column[places.end..].fill(0.0);
            record.read(present.start.saturating_sub(before), &mut column[places.clone()]);
            if !all_usable(column) {
                unusable.extend((0..column.len()).filter(|&row| !is_usable(column[row])));
            }
            strips.fill(simd, column);
        }
        unusable.sort_unstable();
        unusable.dedup();
        for strips in strips {
            for &row in unusable.iter() {
                strips.clear(row);
            }
        }
    }

    /// How many equations a window holds.
    pub(crate) fn count(&self, window: usize) -> usize {
        let first = window.max(self.rows.start + self.plan.window);
        let end = (window + self.plan.window).min(self.rows.end + self.plan.window);
        end.saturating_sub(first)
    }

    /// The window that begins in row 0 of a lane.
    pub(crate) fn first(&self, lane: usize) -> usize {
        self.base + lane * self.plan.window
    }

    /// Whether every row of every window is an equation.
    pub(crate) fn is_full(&self, lanes: usize) -> bool {
        self.count(self.base) == self.plan.window && self.count(self.first(lanes) - 1) == self.plan.window
    }

    /// Flags windows with missing rows as lying at an edge, and invalidates those that are less than half full or hold an unusable
    /// value.
    pub(crate) fn mark(&self, unusable: &[usize], full: bool, outputs: &mut Outputs<'_>) {
        if full && unusable.is_empty() {
            return;
        }
        let plan = self.plan;
        for window in self.windows.clone() {
            let row = window + plan.window / 2 - plan.window;
            let count = self.count(window);
            let edge = if count < plan.window { Status::EDGE } else { Status::GOOD };
            let rows = window - self.base..window - self.base + plan.window;
            let next = unusable.partition_point(|&bad| bad < rows.start);
            if 2 * count < plan.window || unusable.get(next).is_some_and(|bad| *bad < rows.end) {
                outputs.invalidate(row..row + 1, edge | Status::INVALID);
            } else if count <= plan.regressors {
                outputs.invalidate(row..row + 1, edge | Status::INVALID | Status::RANK_DEFICIENT);
                let elements = outputs.elements.of(row..row + 1);
                if let Some(condition) = outputs.values.last_mut().filter(|condition| !condition.is_empty()) {
                    condition[elements].fill(f64::INFINITY);
                }
            } else if edge != Status::GOOD {
                let elements = outputs.elements.of(row..row + 1);
                if !outputs.status.is_empty() {
                    outputs.status[elements].iter_mut().for_each(|status| *status |= edge.bits());
                }
            }
        }
    }
}
