//! The factor of the normal matrix of windows that share a basis: a window in each lane.
//!
//! `G = L D L'` by columns. Rows below the matrix are what is solved for: of `b` there stays `L⁻¹ b`, whose place `k` belongs to the polynomial of order `k`
//! that is orthogonal to all lower ones in this window.

use pulp::NullaryFnOnce;

use crate::irregular::shared_sums::{DERIVATIVES, MOST};
use crate::simd::aligned::OnLines;
use crate::simd::vectors::Lanes;

/// Numbers of a row that are solved for together.
const ABREAST: usize = 4;

/// Rows below the matrix at most: the samples, one for the condition, and derivatives.
const BELOW: usize = 2 + DERIVATIVES;

/// Rows that are eliminated together, if there are more than half as many; otherwise half as many are. Those after the last belong to nothing.
const TOGETHER: usize = 8;
const BEYOND: usize = TOGETHER / 2;

/// A matrix and what is solved with it.
pub(crate) struct SharedFactor<S: Lanes> {
    /// `L D`.
    pub(crate) rows: OnLines<[S::f64s; MOST], { MOST + BEYOND }>,
    /// `L⁻¹ b`: that of the samples, of one for the condition, and of derivatives.
    pub(crate) below: OnLines<[S::f64s; MOST], BELOW>,
    /// One over each pivot.
    pub(crate) inverse: OnLines<S::f64s, MOST>,
    /// The largest ratio of a diagonal to its pivot.
    pub(crate) weakest: S::f64s,
    /// Halves of moments, and minus the row of a pivot over the pivots before.
    halves: OnLines<S::f64s, { 2 * MOST + BEYOND }>,
    factors: OnLines<S::f64s, MOST>,
}

impl<S: Lanes> SharedFactor<S> {
    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        let zero = simd.splat_f64s(0.0);
        let (rows, below) = (OnLines([[zero; MOST]; MOST + BEYOND]), OnLines([[zero; MOST]; BELOW]));
        let (halves, factors) = (OnLines([zero; 2 * MOST + BEYOND]), OnLines([zero; MOST]));
        Self { rows, below, inverse: OnLines([zero; MOST]), weakest: zero, halves, factors }
    }

    /// Decomposes the matrix that moments make; so many rows below it hold what is to be solved for.
    #[inline(always)]
    pub(crate) fn decompose(&mut self, simd: S, degrees: usize, moments: &[S::f64s; 2 * MOST], below: usize) {
        let (degrees, half) = (degrees.min(MOST), simd.splat_f64s(0.5));
        if below > 1 {
            self.below.0[1][..degrees].fill(simd.splat_f64s(0.0));
        }
        for (value, moment) in self.halves.0.iter_mut().zip(moments).take(2 * degrees - 1) {
            *value = simd.mul_f64s(*moment, half);
        }
        self.weakest = simd.splat_f64s(1.0);
        simd.vectorize(EliminatedColumns { simd, factor: self, degrees, below });
    }

    /// The solution `G⁻¹ b` of what stays of `b`, in its place.
    #[inline(always)]
    pub(crate) fn solve(&self, simd: S, degrees: usize, solution: &mut OnLines<S::f64s, MOST>) {
        let degrees = degrees.min(MOST);
        for first in (0..degrees).step_by(ABREAST).rev() {
            let end = degrees.min(first + ABREAST);
            let mut sums = [simd.splat_f64s(0.0); ABREAST];
            sums.copy_from_slice(&solution.0[first..][..ABREAST]);
            // A row of `L D` is a column of `D L'`, and what is on the other side has not been divided by `D` yet.
            for (row, scaled) in self.rows.0[end..degrees].iter().zip(&solution.0[end..degrees]).rev() {
                let row = &row[first..][..ABREAST];
                for n in 0..ABREAST {
                    sums[n] = simd.negate_mul_add_f64s(row[n], *scaled, sums[n]);
                }
            }
            let (rows, inverse) = (&self.rows.0[first..][..ABREAST], &self.inverse.0[first..][..ABREAST]);
            for n in (0..ABREAST).rev() {
                if first + n < end {
                    let (row, scaled) = (&rows[n][first..][..ABREAST], simd.mul_f64s(sums[n], inverse[n]));
                    for (sum, factor) in sums.iter_mut().zip(row).take(n) {
                        *sum = simd.negate_mul_add_f64s(*factor, scaled, *sum);
                    }
                    sums[n] = scaled;
                }
            }
            solution.0[first..][..ABREAST].copy_from_slice(&sums);
        }
    }

    /// `V' a`: what the polynomial with coefficients `a` in the shared basis has in the orthogonal one of each window.
    #[inline(always)]
    pub(crate) fn turned(&self, simd: S, degrees: usize, coefficients: &[S::f64s; MOST], turned: &mut [S::f64s; MOST]) {
        let degrees = degrees.min(MOST);
        for first in (0..degrees).step_by(ABREAST) {
            let end = degrees.min(first + ABREAST);
            let mut sums = [simd.splat_f64s(0.0); ABREAST];
            for last in 0..ABREAST {
                if first + last < end {
                    let row = &self.rows.0[first + last][first..][..ABREAST];
                    for (sum, value) in sums.iter_mut().zip(row).take(last + 1) {
                        *sum = simd.mul_add_f64s(*value, coefficients[first + last], *sum);
                    }
                }
            }
            for (row, coefficient) in self.rows.0[end..degrees].iter().zip(&coefficients[end..degrees]) {
                let row = &row[first..][..ABREAST];
                for n in 0..ABREAST {
                    sums[n] = simd.mul_add_f64s(row[n], *coefficient, sums[n]);
                }
            }
            turned[first..][..ABREAST].copy_from_slice(&sums);
        }
    }

    /// Takes the columns before off a column, and finds its pivot.
    #[inline(always)]
    fn column(&mut self, simd: S, (degrees, below): (usize, usize), column: usize) {
        let diagonal = simd.add_f64s(self.halves.0[2 * column], self.halves.0[0]);
        let (halves, factors) = (&self.halves.0, &mut self.factors.0);
        let pivots = self.rows.0[column].iter().zip(&self.inverse.0);
        for (factor, (value, inverse)) in factors.iter_mut().zip(pivots).take(column) {
            *factor = simd.neg_f64s(simd.mul_f64s(*value, *inverse));
        }
        // Two rows below the matrix go with its first ones: alone they would wait for each other.
        let (pair, others) = self.below.0.split_at_mut(2);
        let mut pair = &mut *pair;
        let mut row = column;
        while row < degrees {
            let is_long = row + BEYOND < degrees;
            let sums = [&halves[row + column..], &halves[row - column..]];
            if let (true, Some(rows)) = (is_long, self.rows.0[row..].first_chunk_mut::<TOGETHER>()) {
                eliminate_with(simd, rows, std::mem::take(&mut pair), (factors, column), sums);
            } else if let Some(rows) = self.rows.0[row..].first_chunk_mut::<BEYOND>() {
                eliminate_with(simd, rows, std::mem::take(&mut pair), (factors, column), sums);
            }
            row += if is_long { TOGETHER } else { BEYOND };
        }
        for rows in others.as_chunks_mut::<2>().0.iter_mut().take(below.div_ceil(2) - 1) {
            eliminate::<S, 0, 2>(simd, &mut [], rows, (factors, column), [&[]; 2]);
        }
        if below > 1 {
            let grown = &mut self.below.0[1][column];
            let is_negative = simd.less_than_f64s(*grown, simd.splat_f64s(0.0));
            let one = simd.splat_f64s(1.0);
            *grown = simd.add_f64s(*grown, simd.select_f64s(is_negative, simd.neg_f64s(one), one));
        }
        let inverse = simd.div_f64s(simd.splat_f64s(1.0), self.rows.0[column][column]);
        self.inverse.0[column] = inverse;
        let ratio = simd.mul_f64s(diagonal, inverse);
        // Where a pivot is negative or no number, so is the ratio: it counts as infinite.
        let counts = simd.greater_than_or_equal_f64s(ratio, simd.splat_f64s(0.5));
        let ratio = simd.select_f64s(counts, ratio, simd.splat_f64s(f64::INFINITY));
        self.weakest = simd.max_f64s(self.weakest, ratio);
    }
}

/// All columns, one after the other: compiled apart from what uses them, each for itself.
struct EliminatedColumns<'a, S: Lanes> {
    simd: S,
    factor: &'a mut SharedFactor<S>,
    degrees: usize,
    below: usize,
}

impl<S: Lanes> NullaryFnOnce for EliminatedColumns<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd, factor, degrees, below } = self;
        for column in 0..degrees.min(MOST) {
            factor.column(simd, (degrees, below), column);
        }
    }
}

/// Takes the columns before off a column of some rows of the matrix, and of two rows below it where they are given.
#[inline(always)]
fn eliminate_with<S: Lanes, const N: usize>(
    simd: S,
    rows: &mut [[S::f64s; MOST]; N],
    pair: &mut [[S::f64s; MOST]],
    factors: (&[S::f64s; MOST], usize),
    sums: [&[S::f64s]; 2],
) {
    if let Some(pair) = pair.first_chunk_mut::<2>() {
        eliminate(simd, rows, pair, factors, sums);
    } else {
        eliminate(simd, rows, &mut [], factors, sums);
    }
}

/// Takes the columns before off a column of some rows of the matrix, and of some below it. That of the matrix is the sum of halves of moments,
/// from the sum of row and column on and from their difference on.
#[inline(always)]
fn eliminate<S: Lanes, const N: usize, const BELOW: usize>(
    simd: S,
    rows: &mut [[S::f64s; MOST]; N],
    below: &mut [[S::f64s; MOST]; BELOW],
    (factors, column): (&[S::f64s; MOST], usize),
    [plus, minus]: [&[S::f64s]; 2],
) {
    let column = column.min(MOST - 1);
    let (mut sums, mut of_below) = ([factors[0]; N], [factors[0]; BELOW]);
    let (plus, minus) = (&plus[..N], &minus[..N]);
    for n in 0..N {
        sums[n] = simd.add_f64s(plus[n], minus[n]);
    }
    for n in 0..BELOW {
        of_below[n] = below[n][column];
    }
    for k in 0..column {
        for n in 0..N {
            sums[n] = simd.mul_add_f64s(rows[n][k], factors[k], sums[n]);
        }
        for n in 0..BELOW {
            of_below[n] = simd.mul_add_f64s(below[n][k], factors[k], of_below[n]);
        }
    }
    for n in 0..N {
        rows[n][column] = sums[n];
    }
    for n in 0..BELOW {
        below[n][column] = of_below[n];
    }
}
