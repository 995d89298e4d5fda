//! The solutions of windows: parameters, standard errors, residuals and condition numbers from the factors of their rows.

use std::ops::Range;

use crate::lanes::interleaved::Strips;
use crate::lanes::tile::{Tile, WindowFields};
use crate::least_squares::fading;
use crate::least_squares::givens_factor::{Dimensions, covariance, explained, invert, solve, squared_norm};
use crate::least_squares::plan::{RollingLeastSquares, Slots};
use crate::least_squares::window_summary::WindowSummary;
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};
use crate::status::Status;

/// How many rows of a lane's window at an offset count.
pub(crate) type Count<'a> = dyn Fn(usize, usize) -> usize + 'a;

/// How many rows of windows count.
#[derive(Clone, Copy)]
pub(crate) enum Counts<'a> {
    /// All that windows have.
    All,
    Asked(&'a Count<'a>),
    /// Those of one window after the other, lane by lane.
    Listed(&'a [f64]),
}

/// The kernel that solves neighbouring windows of each lane. All kernels that make factors use it.
pub(crate) struct Solutions<'a, 'b, H: Dimensions> {
    pub(crate) shape: H,
    pub(crate) plan: &'a RollingLeastSquares,
    /// Offsets of the windows in their blocks, and their summaries one after the other.
    pub(crate) offsets: Range<usize>,
    pub(crate) summaries: &'a [f64],
    pub(crate) counts: Counts<'a>,
    /// The columns of the rows, where what is left of them can be told.
    pub(crate) rows: Option<&'a [Strips]>,
    pub(crate) tile: &'b mut Tile,
}

impl<H: Dimensions> Kernel for Solutions<'_, '_, H> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        let Self { shape, plan, offsets, summaries, counts, rows, tile } = self;
        let size = plan.summary(shape.size() * S::F64_LANES);
        let mut summary = WindowSummary::nothing(simd, shape, plan.fading.is_some());
        let mut values = shape.factor(simd.splat_f64s(0.0));
        let one = simd.splat_f64s(1.0);
        let parameters = simd.splat_f64s(shape.regressors() as f64);
        let beyond = |counts| simd.max_f64s(simd.sub_f64s(counts, parameters), simd.splat_f64s(0.0));
        let mut freedom = simd.div_f64s(one, beyond(simd.splat_f64s(plan.window as f64)));
        for (place, (offset, numbers)) in offsets.zip(summaries.chunks_exact(size)).enumerate() {
            summary.load(simd, shape, numbers);
            match counts {
                Counts::All => {}
                Counts::Asked(count) => {
                    let mut lanes = [0.0; MOST_LANES];
                    for (lane, rows) in lanes[..S::F64_LANES].iter_mut().enumerate() {
                        *rows = count(lane, offset) as f64;
                    }
                    freedom = simd.div_f64s(one, beyond(simd.load(&lanes, 0)));
                }
                Counts::Listed(listed) => {
                    freedom = simd.div_f64s(one, beyond(simd.load(listed, place * S::F64_LANES)));
                }
            }
            let own = offset + plan.before;
            let (own, block) = if own < plan.window { (own, 0) } else { (own - plan.window, 1) };
            let own = |column: usize| match rows {
                Some(strips) => strips[column].in_place(simd, strips[0].place(own, block)),
                None => simd.splat_f64s(f64::NAN),
            };
            finish(simd, shape, plan, &summary, freedom, &mut tile.fields_of::<S>(offset), &mut values, own);
        }
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
