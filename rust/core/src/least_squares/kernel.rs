//! Least squares in blocks of windows side by side.
//!
//! A window of `w` rows that begins in one block of `w` rows and ends in the next is a suffix of the one and a prefix of the other. So
//! every window's factor is one merge of two factors that were built by appending rows only (see `givens_factor`): a row enters once and
//! leaves with its block, and nothing is subtracted.

use std::ops::Range;

use crate::exec::pool::GoOn;
use crate::lanes::output::Outputs;
use crate::lanes::store::Write;
use crate::lanes::tile::WindowFields;
use crate::least_squares::fading;
use crate::least_squares::givens_factor::{
    Dimensions, append, covariance, empty, explained, invert, load, merge, solve, squared_norm, store,
};
use crate::least_squares::plan::{Equations, RollingLeastSquares, Slots};
use crate::least_squares::side_by_side::{RollingRun, RollingScratch, SEGMENT};
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};
use crate::status::Status;

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
        let full = self.run.load(simd, self.equations, self.scratch);
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
                    suffix.merge(simd, self.shape, self.run.plan, &prefix, offset, &mut row);
                    suffix.store(simd, self.shape, &mut self.scratch.suffixes[place..place + size]);
                    self.append(simd, &mut prefix, offset, 1, &mut row);
                }
                for offset in some.clone() {
                    let place = (offset - rows.start) * size;
                    suffix.load(simd, self.shape, &self.scratch.suffixes[place..place + size]);
                    let (freedom, own) = (self.freedom(simd, offset, full), offset + self.run.plan.before);
                    let RollingScratch { strips, tile, .. } = &mut *self.scratch;
                    let place = if own < window { strips[0].place(own, 0) } else { strips[0].place(own - window, 1) };
                    let at = |column: usize| strips[column].in_place(simd, place);
                    let fields = &mut tile.fields_of::<S>(offset);
                    finish(simd, self.shape, self.run.plan, &suffix, freedom, fields, &mut row, at);
                }
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

/// What some rows of each lane are summarised by.
#[derive(Clone)]
pub(crate) struct WindowSummary<F> {
    pub(crate) factor: F,
    /// Sums for the errors of windows that fade: see `fading`.
    pub(crate) sums: Option<F>,
}

impl<F> WindowSummary<F> {
    /// Writes it to memory, which holds it exactly.
    #[inline(always)]
    pub(crate) fn store<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(&self, simd: S, shape: H, to: &mut [f64]) {
        store(simd, shape, to, &self.factor);
        if let Some(sums) = &self.sums {
            let half = to.len() / 2;
            store(simd, shape, &mut to[half..], sums);
        }
    }

    /// Reads it from memory.
    #[inline(always)]
    pub(crate) fn load<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(&mut self, simd: S, shape: H, from: &[f64]) {
        load(simd, shape, from, &mut self.factor);
        if let Some(sums) = &mut self.sums {
            load(simd, shape, &from[from.len() / 2..], sums);
        }
    }

    /// The summary of no rows, with sums where windows fade.
    #[inline(always)]
    pub(crate) fn nothing<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(simd: S, shape: H, fades: bool) -> Self {
        let sums = fades.then(|| shape.factor(simd.splat_f64s(0.0)));
        Self { factor: empty(simd, shape), sums }
    }

    /// Appends the row at an offset of a block, or of the block after it, with the weight of its noise. The row is overwritten.
    #[inline(always)]
    pub(crate) fn append<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(
        &mut self,
        simd: S,
        shape: H,
        plan: &RollingLeastSquares,
        (offset, block): (usize, usize),
        row: &mut F,
        mut weight: S::f64s,
    ) {
        if let (Some(fading), Some(sums)) = (&plan.fading, &mut self.sums) {
            // The block's rows are appended from its last to its first, those of the next block from its first to its last.
            let part = if fading.newest_first == (block == 1) {
                fading::fade(simd, shape, &mut self.factor, sums, fading.left[1]);
                1.0
            } else {
                fading.left[if block == 0 { plan.window - 1 - offset } else { offset }]
            };
            fading::add(simd, shape, sums, row, weight, part);
            weight = simd.mul_f64s(weight, simd.splat_f64s(part));
        }
        append(simd, shape, &mut self.factor, row, 0, weight);
    }

    /// Merges the rows of a block from an offset on with those of the block after it up to that offset. `row` is scratch memory.
    #[inline(always)]
    pub(crate) fn merge<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(
        &mut self,
        simd: S,
        shape: H,
        plan: &RollingLeastSquares,
        prefix: &Self,
        offset: usize,
        row: &mut F,
    ) where
        F: Clone,
    {
        let (Some(fading), Some(sums), Some(others)) = (&plan.fading, &mut self.sums, &prefix.sums) else {
            merge(simd, shape, &mut self.factor, &prefix.factor, row);
            return;
        };
        if fading.newest_first {
            fading::fade(simd, shape, &mut self.factor, sums, fading.left[offset]);
            merge(simd, shape, &mut self.factor, &prefix.factor, row);
            fading::merge(simd, shape, sums, others);
        } else {
            let (mut factor, mut others) = (prefix.factor.clone(), others.clone());
            fading::fade(simd, shape, &mut factor, &mut others, fading.left[plan.window - offset]);
            merge(simd, shape, &mut self.factor, &factor, row);
            fading::merge(simd, shape, sums, &others);
        }
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

    /// One over the degrees of freedom of each lane's window.
    #[inline(always)]
    fn freedom<S: Lanes>(&self, simd: S, offset: usize, full: bool) -> S::f64s {
        let (plan, p) = (self.run.plan, self.shape.regressors());
        if full {
            return simd.splat_f64s(1.0 / (plan.window - p) as f64);
        }
        let mut freedom = [0.0; MOST_LANES];
        for (lane, freedom) in freedom[..S::F64_LANES].iter_mut().enumerate() {
            let count = self.run.count(self.scratch, self.run.first(lane) + offset);
            *freedom = 1.0 / count.saturating_sub(p) as f64;
        }
        simd.load(&freedom, 0)
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
        write.run(simd);
    }
}

/// Flags as the tile holds them.
#[inline(always)]
fn code<S: Lanes>(simd: S, status: Status) -> S::f64s {
    simd.splat_f64s(256.0 * f64::from(status.bits()))
}

/// Solves each lane's window: what is known of it goes to its fields in the tile. `values` is scratch memory; `own` gives columns of the
/// window's own row, where what is left of that is asked for.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "a window and where its results go")]
pub(crate) fn finish<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    plan: &RollingLeastSquares,
    summary: &WindowSummary<H::Factor<S::f64s>>,
    mut freedom: S::f64s,
    fields: &mut WindowFields<'_>,
    values: &mut H::Factor<S::f64s>,
    own: impl Fn(usize) -> S::f64s,
) {
    let factor = &summary.factor;
    let (p, q) = (shape.regressors(), shape.rhs_count());
    let slots = Slots::of_shape(plan, p, q);
    // The condition number comes first: where it exceeds the precision, no result has any digits.
    invert(simd, shape, factor, values);
    let mut squares = simd.splat_f64s(0.0);
    for i in 0..p {
        let variance = covariance(simd, shape, values, i, i);
        squares = simd.mul_add_f64s(squared_norm(simd, shape, factor, i), variance, squares);
    }
    let condition = simd.sqrt_f64s(simd.mul_f64s(squares, simd.splat_f64s(p as f64)));
    let greatest = simd.splat_f64s(1.0 / (f64::EPSILON * plan.window as f64));
    let determined = simd.less_than_f64s(condition, greatest);
    let ill = simd.greater_than_f64s(condition, simd.splat_f64s(plan.ill_conditioned));
    let flags = simd.select_f64s(ill, code(simd, Status::ILL_CONDITIONED), simd.splat_f64s(0.0));
    let deficient = code(simd, Status::INVALID | Status::RANK_DEFICIENT);
    let condition = simd.select_f64s(determined, condition, simd.splat_f64s(f64::INFINITY));
    fields.put(simd, slots.condition, condition);
    fields.put(simd, slots.condition + 1, simd.select_f64s(determined, flags, deficient));

    let mut faded = None;
    // No closure: a large one is compiled on its own, without the instructions that were chosen.
    if let Some(sums) = &summary.sums {
        let mut variances = shape.factor(simd.splat_f64s(0.0));
        freedom = simd.div_f64s(simd.splat_f64s(1.0), fading::freedom(simd, shape, values, sums, &mut variances));
        faded = Some(variances);
    }
    if plan.normal {
        let pairs = (0..p).flat_map(|i| (i + 1..p).map(move |k| (i, k)));
        for (pair, (i, k)) in pairs.enumerate() {
            fields.put(simd, slots.normal + pair, covariance(simd, shape, values, i, k));
        }
    }
    for rhs in 0..q {
        let residual = factor[shape.row(p) + rhs];
        let variance = simd.mul_f64s(residual, freedom);
        fields.put(simd, slots.residuals + rhs, residual);
        for (pair, &(i, j)) in plan.covariances.iter().enumerate() {
            let one = covariance(simd, shape, values, i.min(j), i.max(j));
            fields.put(simd, slots.covariances + pair * q + rhs, simd.mul_f64s(one, variance));
        }
        let deviation = simd.sqrt_f64s(variance);
        fields.put(simd, slots.deviations + rhs, deviation);
        for i in 0..p {
            let over = match &faded {
                Some(variances) => variances[shape.row(i)],
                None => covariance(simd, shape, values, i, i),
            };
            let error = if plan.normal { over } else { simd.mul_f64s(simd.sqrt_f64s(over), deviation) };
            fields.put(simd, slots.errors + i * q + rhs, error);
        }
    }
    for rhs in 0..q {
        solve(simd, shape, factor, rhs, values);
        for i in 0..p {
            fields.put(simd, i * q + rhs, values[i]);
        }
        if plan.fit {
            let mut residual = own(p + rhs);
            for i in 0..p {
                residual = simd.negate_mul_add_f64s(own(i), values[i], residual);
            }
            fields.put(simd, slots.own_residuals + rhs, residual);
            let explained = explained(simd, shape, factor, rhs, usize::from(plan.constant_first));
            let all = simd.add_f64s(explained, factor[shape.row(p) + rhs]);
            fields.put(simd, slots.rsquared + rhs, simd.div_f64s(explained, all));
        }
    }
    // Few windows are not determined, and they are written twice. Selected, not added: of two that are no number, addition gives either,
    // and which one is the compiler's choice in every path.
    if simd.bits(determined) != (1 << S::F64_LANES) - 1 {
        for slot in 0..slots.condition {
            let value = fields.get(simd, slot);
            fields.put(simd, slot, simd.select_f64s(determined, value, simd.splat_f64s(f64::NAN)));
        }
    }
}
