//! Windows whose rows weigh the less the farther they are from the row that a window belongs to.
//!
//! Weights `f` halve every half-life. They say how much a row counts and nothing of its noise, so least squares with them have the
//! covariance `σ² N⁻¹ M N⁻¹` with `N = Σ f x xᵀ` and `M = Σ f² x xᵀ`, and their squared residuals add up to `σ² (Σ f - tr N⁻¹ M)` on average.
//! `M` and `Σ f` are kept beside a window's factor, in memory of its size: `M` on and above its diagonal row by row, then `Σ f`.

use crate::least_squares::givens_factor::{Dimensions, MOST_REGRESSORS, NOTHING};
use crate::simd::vectors::Lanes;

/// Half-lives after which a row weighs nothing: far below rounding, and far above where doubles end.
const NOTHING_LEFT: f64 = 300.0;

/// How weights become less from row to row.
#[derive(Clone, Debug)]
pub(crate) struct Fading {
    /// What is left after so many rows, up to a window of them.
    pub(crate) left: Vec<f64>,
    /// Whether the newest row of a window weighs most; otherwise the oldest does.
    pub(crate) newest_first: bool,
}

impl Fading {
    pub(crate) fn new(half_life: f64, window: usize, newest_first: bool) -> Self {
        let left = |rows: usize| {
            let half_lives = rows as f64 / half_life;
            if half_lives > NOTHING_LEFT { 0.0 } else { (-half_lives).exp2() }
        };
        Self { left: (0..=window).map(left).collect(), newest_first }
    }
}

/// Where entry `(i, k)` of `M` is, `i ≤ k`.
#[inline(always)]
fn place<H: Dimensions>(shape: H, i: usize, k: usize) -> usize {
    shape.entry(i, k) - i * shape.rhs_count()
}

/// Where `Σ f` is, after `M`.
#[inline(always)]
fn last<H: Dimensions>(shape: H) -> usize {
    shape.row(shape.regressors()) - shape.regressors() * shape.rhs_count()
}

/// Writes sums to memory.
#[inline(always)]
pub(crate) fn store<S: Lanes, H: Dimensions>(simd: S, shape: H, to: &mut [f64], sums: &H::Factor<S::f64s>) {
    let to = &mut to[..(last(shape) + 1) * S::F64_LANES];
    for i in 0..=last(shape) {
        simd.store(to, i * S::F64_LANES, sums[i]);
    }
}

/// Reads sums from memory.
#[inline(always)]
pub(crate) fn load<S: Lanes, H: Dimensions>(simd: S, shape: H, from: &[f64], sums: &mut H::Factor<S::f64s>) {
    let from = &from[..(last(shape) + 1) * S::F64_LANES];
    for i in 0..=last(shape) {
        sums[i] = simd.load(from, i * S::F64_LANES);
    }
}

/// Makes a factor weigh a part of what it did.
#[inline(always)]
pub(crate) fn fade<S: Lanes, H: Dimensions>(simd: S, shape: H, factor: &mut H::Factor<S::f64s>, part: S::f64s) {
    let p = shape.regressors();
    for i in 0..p {
        let weight = &mut factor[shape.row(i)];
        // Something must stay, or appending a row of zeros would divide by zero.
        *weight = simd.mul_add_f64s(*weight, part, simd.splat_f64s(NOTHING));
    }
    for s in 0..shape.rhs_count() {
        let rss = shape.row(p) + s;
        factor[rss] = simd.mul_f64s(factor[rss], part);
    }
}

/// Makes sums weigh a part of what they did.
#[inline(always)]
pub(crate) fn fade_sums<S: Lanes, H: Dimensions>(simd: S, shape: H, sums: &mut H::Factor<S::f64s>, part: S::f64s) {
    let squared = simd.mul_f64s(part, part);
    let last = last(shape);
    for sum in 0..last {
        sums[sum] = simd.mul_f64s(sums[sum], squared);
    }
    sums[last] = simd.mul_f64s(sums[last], part);
}

/// Adds a row to the sums. `weight` is that of its noise, `part` what is left of it.
#[inline(always)]
pub(crate) fn add<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    sums: &mut H::Factor<S::f64s>,
    row: &H::Factor<S::f64s>,
    weight: S::f64s,
    part: f64,
) {
    let (p, part) = (shape.regressors(), simd.splat_f64s(part));
    let squared = simd.mul_f64s(weight, simd.mul_f64s(part, part));
    for i in 0..p {
        let weighted = simd.mul_f64s(squared, row[i]);
        for k in i..p {
            let sum = place(shape, i, k);
            sums[sum] = simd.mul_add_f64s(weighted, row[k], sums[sum]);
        }
    }
    let zero = simd.splat_f64s(0.0);
    let counts = simd.select_f64s(simd.greater_than_f64s(weight, zero), part, zero);
    let last = last(shape);
    sums[last] = simd.add_f64s(sums[last], counts);
}

/// Adds the sums of other rows. Of those that were there, or else of the others, a part is left.
#[inline(always)]
pub(crate) fn merge<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    sums: &mut H::Factor<S::f64s>,
    others: &H::Factor<S::f64s>,
    part: S::f64s,
    others_fade: bool,
) {
    let squared = simd.mul_f64s(part, part);
    let last = last(shape);
    for sum in 0..last {
        let (fades, stays) = if others_fade { (others[sum], sums[sum]) } else { (sums[sum], others[sum]) };
        sums[sum] = simd.mul_add_f64s(fades, squared, stays);
    }
    let (fades, stays) = if others_fade { (others[last], sums[last]) } else { (sums[last], others[last]) };
    sums[last] = simd.mul_add_f64s(fades, part, stays);
}

/// What the squared residuals are divided by for the variance of the noise. The variances of the parameters over it are left in the places
/// of the weights of `variances`, which must be zero there.
#[inline(always)]
pub(crate) fn freedom<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    inverse: &H::Factor<S::f64s>,
    sums: &H::Factor<S::f64s>,
    variances: &mut H::Factor<S::f64s>,
) -> S::f64s {
    let p = shape.regressors();
    // Entries of the inverse times the weights of their columns, so that each of their products is one operation.
    for i in 0..p {
        for k in i + 1..p {
            variances[shape.entry(i, k)] = simd.mul_f64s(inverse[shape.entry(i, k)], inverse[shape.row(k)]);
        }
    }
    let mut normal = shape.square(simd.splat_f64s(0.0));
    for i in 0..p {
        for j in i..p {
            let mut one = if i == j { inverse[shape.row(j)] } else { variances[shape.entry(i, j)] };
            for k in j + 1..p {
                one = simd.mul_add_f64s(variances[shape.entry(i, k)], inverse[shape.entry(j, k)], one);
            }
            (normal[i * p + j], normal[j * p + i]) = (one, one);
        }
    }
    let mut trace = simd.splat_f64s(0.0);
    // The innermost loops run over the parameters, which do not wait for each other.
    let mut inner = [simd.splat_f64s(0.0); MOST_REGRESSORS];
    for a in 0..p {
        for i in 0..p {
            inner[i] = simd.mul_f64s(sums[place(shape, a, a)], normal[a * p + i]);
        }
        for b in a + 1..p {
            // What is off the diagonal counts twice.
            let sum = sums[place(shape, a, b)];
            let sum = simd.add_f64s(sum, sum);
            for i in 0..p {
                inner[i] = simd.mul_add_f64s(sum, normal[b * p + i], inner[i]);
            }
        }
        for i in 0..p {
            let variance = &mut variances[shape.row(i)];
            *variance = simd.mul_add_f64s(normal[a * p + i], inner[i], *variance);
        }
        trace = simd.add_f64s(trace, inner[a]);
    }
    simd.sub_f64s(sums[last(shape)], trace)
}
