//! Windows whose rows weigh the less the farther they are from the row that a window belongs to.
//!
//! Weights `f` halve every half-life. They say how much a row counts and nothing of its noise, so least squares with them have the
//! covariance `σ² N⁻¹ M N⁻¹` with `N = Σ f x xᵀ` and `M = Σ f² x xᵀ`, and their squared residuals add up to `σ² (Σ f - tr N⁻¹ M)` on average.
//! `M` and `Σ f` are kept beside a window's factor, in the places of a factor: entry `(i, k)` of `M` where that of `U` would be.

use crate::least_squares::givens_factor::{Dimensions, MOST_REGRESSORS, NOTHING, covariance};
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

/// Makes a factor and its sums weigh a part of what they did.
#[inline(always)]
pub(crate) fn fade<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    factor: &mut H::Factor<S::f64s>,
    sums: &mut H::Factor<S::f64s>,
    part: S::f64s,
) {
    let p = shape.regressors();
    for i in 0..p {
        let weight = simd.mul_f64s(factor[shape.row(i)], part);
        // Something must stay, or appending a row of zeros would divide by zero.
        factor[shape.row(i)] = simd.max_f64s(weight, simd.splat_f64s(NOTHING));
    }
    for s in 0..shape.rhs_count() {
        let rss = shape.row(p) + s;
        factor[rss] = simd.mul_f64s(factor[rss], part);
    }
    let squared = simd.mul_f64s(part, part);
    for i in 0..p {
        for k in i..p {
            let entry = shape.entry(i, k);
            sums[entry] = simd.mul_f64s(sums[entry], squared);
        }
    }
    let count = shape.row(p);
    sums[count] = simd.mul_f64s(sums[count], part);
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
            let entry = shape.entry(i, k);
            sums[entry] = simd.mul_add_f64s(weighted, row[k], sums[entry]);
        }
    }
    let zero = simd.splat_f64s(0.0);
    let counts = simd.select_f64s(simd.greater_than_f64s(weight, zero), part, zero);
    let count = shape.row(p);
    sums[count] = simd.add_f64s(sums[count], counts);
}

/// Adds the sums of other rows.
#[inline(always)]
pub(crate) fn merge<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    sums: &mut H::Factor<S::f64s>,
    other: &H::Factor<S::f64s>,
) {
    for entry in 0..=shape.row(shape.regressors()) {
        sums[entry] = simd.add_f64s(sums[entry], other[entry]);
    }
}

/// What the squared residuals are divided by for the variance of the noise. The variances of the parameters over it are left in the places
/// of the weights of `variances`.
#[inline(always)]
pub(crate) fn freedom<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    inverse: &H::Factor<S::f64s>,
    sums: &H::Factor<S::f64s>,
    variances: &mut H::Factor<S::f64s>,
) -> S::f64s {
    let p = shape.regressors();
    let mut normal = shape.square(simd.splat_f64s(0.0));
    let mut trace = simd.splat_f64s(0.0);
    for i in 0..p {
        for k in i..p {
            let one = covariance(simd, shape, inverse, i, k);
            (normal[i * p + k], normal[k * p + i]) = (one, one);
            let twice = simd.splat_f64s(if i == k { 1.0 } else { 2.0 });
            trace = simd.mul_add_f64s(simd.mul_f64s(one, twice), sums[shape.entry(i, k)], trace);
        }
    }
    // The innermost loops run over the parameters, which do not wait for each other.
    let mut inner = [simd.splat_f64s(0.0); MOST_REGRESSORS];
    for a in 0..p {
        inner[..p].fill(simd.splat_f64s(0.0));
        for b in a + 1..p {
            let sum = sums[shape.entry(a, b)];
            for i in 0..p {
                inner[i] = simd.mul_add_f64s(sum, normal[b * p + i], inner[i]);
            }
        }
        let sum = sums[shape.entry(a, a)];
        for i in 0..p {
            // What is off the diagonal counts twice.
            let twice = simd.add_f64s(inner[i], inner[i]);
            let whole = simd.mul_add_f64s(sum, normal[a * p + i], twice);
            let variance = &mut variances[shape.row(i)];
            *variance = simd.mul_add_f64s(normal[a * p + i], whole, *variance);
        }
    }
    simd.sub_f64s(sums[shape.row(p)], trace)
}
