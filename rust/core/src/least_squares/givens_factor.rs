//! The triangular factor of a few columns by Givens rotations: append a row, merge two factors, solve. One factor per lane.
//!
//! Rows `[a | b]` of a least-squares problem are summarised by the factor `R` of their QR decomposition. It is kept free of square
//! roots as `R = W^{1/2} U` with `W` diagonal and `U` unit upper triangular (Gentleman 1973): appending a row costs one division a
//! column. Nothing is ever subtracted from what was summed, so a row that is not appended leaves no trace.

use std::ops::IndexMut;

use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// The initial weight of a column, so that no division is by zero. Squares of samples that matter are far above it.
pub(crate) const NOTHING: f64 = 1e-300;

/// Weights up to this belong to columns that are zero in every row.
const UNDETERMINED: f64 = 1e-290;

/// The most regressors a problem may have.
pub(crate) const MOST_REGRESSORS: usize = 16;

/// The most pairs of different regressors.
pub(crate) const MOST_PAIRS: usize = MOST_REGRESSORS * (MOST_REGRESSORS - 1) / 2;

/// Number of regressors and right-hand sides, known at compile time or not.
pub(crate) trait Dimensions: Copy + Send + Sync {
    /// The numbers of one factor, as many as [`Dimensions::size`].
    type Factor<V: Copy>: Clone + IndexMut<usize, Output = V>;

    /// Numbers of a square matrix by regressors.
    type Square<V: Copy>: IndexMut<usize, Output = V>;

    fn regressors(self) -> usize;
    fn rhs_count(self) -> usize;

    /// A factor full of one value.
    fn factor<V: Copy>(self, value: V) -> Self::Factor<V>;

    /// A square full of one value.
    fn square<V: Copy>(self, value: V) -> Self::Square<V>;

    /// Numbers in a factor: for each regressor its weight, the rest of its row of `U` and its right-hand sides; then the residual
    /// sums of squares.
    #[inline(always)]
    fn size(self) -> usize {
        self.row(self.regressors()) + self.rhs_count()
    }

    /// Where the row of a regressor begins; its weight comes first.
    #[inline(always)]
    fn row(self, regressor: usize) -> usize {
        let (p, q) = (self.regressors(), self.rhs_count());
        regressor * (p + q) - regressor * regressor.saturating_sub(1) / 2
    }

    /// Where an entry of a row is: a later regressor, or `p + s` for right-hand side `s`.
    #[inline(always)]
    fn entry(self, regressor: usize, column: usize) -> usize {
        self.row(regressor) + column - regressor
    }
}

/// `P` regressors and one right-hand side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Few<const P: usize>;

/// Any number of either.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Many {
    pub(crate) regressors: usize,
    pub(crate) rhs_count: usize,
}

macro_rules! few {
    ($($regressors:literal has $size:literal),*) => {$(
        impl Dimensions for Few<$regressors> {
            type Factor<V: Copy> = OnLines<V, $size>;
            type Square<V: Copy> = OnLines<V, { $regressors * $regressors }>;

            #[inline(always)]
            fn regressors(self) -> usize {
                $regressors
            }

            #[inline(always)]
            fn rhs_count(self) -> usize {
                1
            }

            #[inline(always)]
            fn factor<V: Copy>(self, value: V) -> OnLines<V, $size> {
                OnLines([value; $size])
            }

            #[inline(always)]
            fn square<V: Copy>(self, value: V) -> Self::Square<V> {
                OnLines([value; $regressors * $regressors])
            }
        }
    )*};
}
few!(1 has 3, 2 has 6, 3 has 10, 4 has 15, 5 has 21, 6 has 28, 7 has 36, 8 has 45);

impl Dimensions for Many {
    type Factor<V: Copy> = Vec<V>;
    type Square<V: Copy> = Vec<V>;

    fn regressors(self) -> usize {
        self.regressors
    }

    fn rhs_count(self) -> usize {
        self.rhs_count
    }

    fn factor<V: Copy>(self, value: V) -> Vec<V> {
        vec![value; self.size()]
    }

    fn square<V: Copy>(self, value: V) -> Vec<V> {
        vec![value; self.regressors * self.regressors]
    }
}

/// The factor of no rows.
#[inline(always)]
pub(crate) fn empty<S: Lanes, H: Dimensions>(simd: S, shape: H) -> H::Factor<S::f64s> {
    let mut factor = shape.factor(simd.splat_f64s(0.0));
    for i in 0..shape.regressors() {
        factor[shape.row(i)] = simd.splat_f64s(NOTHING);
    }
    factor
}

/// Appends a row of each lane, `weight` times over, of which the columns before `first` are zero. The row is overwritten.
#[inline(always)]
pub(crate) fn append<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    factor: &mut H::Factor<S::f64s>,
    row: &mut H::Factor<S::f64s>,
    first: usize,
    mut weight: S::f64s,
) {
    let (p, q) = (shape.regressors(), shape.rhs_count());
    for i in first..p {
        let x = row[i];
        let old = factor[shape.row(i)];
        let weighted = simd.mul_f64s(weight, x);
        let new = simd.mul_add_f64s(weighted, x, old);
        let inverse = simd.div_f64s(simd.splat_f64s(1.0), new);
        // The share of what was there and of the row. Adding a multiple of the changed row instead would save a product, but cancels
        // where a row with a small pivot came first.
        let (stays, enters) = (simd.mul_f64s(old, inverse), simd.mul_f64s(weighted, inverse));
        weight = simd.mul_f64s(weight, stays);
        factor[shape.row(i)] = new;
        for k in i + 1..p + q {
            let entry = shape.entry(i, k);
            let (before, value) = (factor[entry], row[k]);
            row[k] = simd.negate_mul_add_f64s(x, before, value);
            factor[entry] = simd.mul_add_f64s(enters, value, simd.mul_f64s(stays, before));
        }
    }
    for s in 0..q {
        let rss = shape.row(p) + s;
        factor[rss] = simd.mul_add_f64s(simd.mul_f64s(weight, row[p + s]), row[p + s], factor[rss]);
    }
}

/// Merges the rows of another factor into this one. `row` is scratch memory.
#[inline(always)]
pub(crate) fn merge<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    factor: &mut H::Factor<S::f64s>,
    other: &H::Factor<S::f64s>,
    row: &mut H::Factor<S::f64s>,
) {
    let (p, q) = (shape.regressors(), shape.rhs_count());
    for i in 0..p {
        row[i] = simd.splat_f64s(1.0);
        for k in i + 1..p + q {
            row[k] = other[shape.entry(i, k)];
        }
        append(simd, shape, factor, row, i, other[shape.row(i)]);
    }
    for s in 0..q {
        let rss = shape.row(p) + s;
        factor[rss] = simd.add_f64s(factor[rss], other[rss]);
    }
}

/// The parameters of right-hand side `rhs`, by substitution from the last.
#[inline(always)]
pub(crate) fn solve<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    factor: &H::Factor<S::f64s>,
    rhs: usize,
    parameters: &mut H::Factor<S::f64s>,
) {
    let p = shape.regressors();
    for i in (0..p).rev() {
        let mut value = factor[shape.entry(i, p + rhs)];
        for k in i + 1..p {
            value = simd.negate_mul_add_f64s(factor[shape.entry(i, k)], parameters[k], value);
        }
        parameters[i] = value;
    }
}

/// `U⁻¹` in the place of `U`, and the inverse of every weight in its place: infinite for columns that are zero in every row.
///
/// `(AᵀA)⁻¹` is `U⁻¹ W⁻¹ U⁻ᵀ`: see [`covariance`].
#[inline(always)]
pub(crate) fn invert<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    factor: &H::Factor<S::f64s>,
    inverse: &mut H::Factor<S::f64s>,
) {
    for j in 0..shape.regressors() {
        for i in (0..j).rev() {
            let mut sum = factor[shape.entry(i, j)];
            for k in i + 1..j {
                sum = simd.mul_add_f64s(factor[shape.entry(i, k)], inverse[shape.entry(k, j)], sum);
            }
            inverse[shape.entry(i, j)] = simd.neg_f64s(sum);
        }
        let weight = factor[shape.row(j)];
        let determined = simd.greater_than_f64s(weight, simd.splat_f64s(UNDETERMINED));
        let reciprocal = simd.div_f64s(simd.splat_f64s(1.0), weight);
        inverse[shape.row(j)] = simd.select_f64s(determined, reciprocal, simd.splat_f64s(f64::INFINITY));
    }
}

/// Entry `(i, j)` of `(AᵀA)⁻¹`, `i ≤ j`, from an inverted factor: the covariance of two parameters over the noise variance.
#[inline(always)]
pub(crate) fn covariance<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    inverse: &H::Factor<S::f64s>,
    i: usize,
    j: usize,
) -> S::f64s {
    let at_j = inverse[shape.row(j)];
    let mut sum = if i == j { at_j } else { simd.mul_f64s(inverse[shape.entry(i, j)], at_j) };
    for k in j + 1..shape.regressors() {
        let product = simd.mul_f64s(inverse[shape.entry(i, k)], inverse[shape.entry(j, k)]);
        sum = simd.mul_add_f64s(product, inverse[shape.row(k)], sum);
    }
    sum
}

/// The squared norm of regressor `i`, summed over the rows.
#[inline(always)]
pub(crate) fn squared_norm<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    factor: &H::Factor<S::f64s>,
    i: usize,
) -> S::f64s {
    let mut sum = factor[shape.row(i)];
    for j in 0..i {
        let entry = factor[shape.entry(j, i)];
        sum = simd.mul_add_f64s(simd.mul_f64s(entry, entry), factor[shape.row(j)], sum);
    }
    sum
}

/// The squares of right-hand side `rhs` that the regressors from one on explain beyond those before it.
#[inline(always)]
pub(crate) fn explained<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    factor: &H::Factor<S::f64s>,
    rhs: usize,
    from: usize,
) -> S::f64s {
    let mut sum = simd.splat_f64s(0.0);
    for i in from..shape.regressors() {
        let entry = factor[shape.entry(i, shape.regressors() + rhs)];
        sum = simd.mul_add_f64s(simd.mul_f64s(entry, entry), factor[shape.row(i)], sum);
    }
    sum
}

/// Writes a factor to memory.
#[inline(always)]
pub(crate) fn store<S: Lanes, H: Dimensions>(simd: S, shape: H, to: &mut [f64], factor: &H::Factor<S::f64s>) {
    let to = &mut to[..shape.size() * S::F64_LANES];
    for i in 0..shape.size() {
        simd.store(to, i * S::F64_LANES, factor[i]);
    }
}

/// Reads a factor from memory.
#[inline(always)]
pub(crate) fn load<S: Lanes, H: Dimensions>(simd: S, shape: H, from: &[f64], factor: &mut H::Factor<S::f64s>) {
    let from = &from[..shape.size() * S::F64_LANES];
    for i in 0..shape.size() {
        factor[i] = simd.load(from, i * S::F64_LANES);
    }
}

/// Takes some lanes of a factor into another.
#[inline(always)]
pub(crate) fn take<S: Lanes, H: Dimensions>(
    simd: S,
    shape: H,
    lanes: S::m64s,
    from: &H::Factor<S::f64s>,
    into: &mut H::Factor<S::f64s>,
) {
    for i in 0..shape.size() {
        into[i] = simd.select_f64s(lanes, from[i], into[i]);
    }
}
