//! What the rows of a window, or of a part of one, are summarised by: their factor, and sums where they fade.

use crate::least_squares::fading;
use crate::least_squares::givens_factor::{Dimensions, append, empty, load, merge, store, take};
use crate::least_squares::plan::RollingLeastSquares;
use crate::simd::vectors::Lanes;

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
            fading::store(simd, shape, &mut to[half..], sums);
        }
    }

    /// Reads it from memory.
    #[inline(always)]
    pub(crate) fn load<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(&mut self, simd: S, shape: H, from: &[f64]) {
        load(simd, shape, from, &mut self.factor);
        if let Some(sums) = &mut self.sums {
            fading::load(simd, shape, &from[from.len() / 2..], sums);
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
                fading::fade(simd, shape, &mut self.factor, simd.splat_f64s(fading.left[1]));
                fading::fade_sums(simd, shape, sums, simd.splat_f64s(fading.left[1]));
                1.0
            } else {
                fading.left[if block == 0 { plan.window - 1 - offset } else { offset }]
            };
            fading::add(simd, shape, sums, row, weight, part);
            weight = simd.mul_f64s(weight, simd.splat_f64s(part));
        }
        append(simd, shape, &mut self.factor, row, 0, weight);
    }

    /// Takes some lanes of another summary.
    #[inline(always)]
    pub(crate) fn take<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(
        &mut self,
        simd: S,
        shape: H,
        lanes: S::m64s,
        from: &Self,
    ) {
        take(simd, shape, lanes, &from.factor, &mut self.factor);
        if let (Some(from), Some(sums)) = (&from.sums, &mut self.sums) {
            take(simd, shape, lanes, from, sums);
        }
    }

    /// Merges the rows of a block from an offset on with those of the block after it up to that offset, of which [`RollingLeastSquares::left_at`]
    /// says what is left. `row` is scratch memory.
    #[inline(always)]
    pub(crate) fn merge<S: Lanes, H: Dimensions<Factor<S::f64s> = F>>(
        &mut self,
        simd: S,
        shape: H,
        plan: &RollingLeastSquares,
        prefix: &Self,
        left: S::f64s,
        row: &mut F,
    ) where
        F: Clone,
    {
        let (Some(fading), Some(sums), Some(others)) = (&plan.fading, &mut self.sums, &prefix.sums) else {
            merge(simd, shape, &mut self.factor, &prefix.factor, row);
            return;
        };
        if fading.newest_first {
            fading::fade(simd, shape, &mut self.factor, left);
            merge(simd, shape, &mut self.factor, &prefix.factor, row);
        } else {
            let mut factor = prefix.factor.clone();
            fading::fade(simd, shape, &mut factor, left);
            merge(simd, shape, &mut self.factor, &factor, row);
        }
        fading::merge(simd, shape, sums, others, left, !fading.newest_first);
    }
}
