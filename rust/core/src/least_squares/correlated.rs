//! Standard errors of windows whose residuals are correlated (Newey and West 1987), by sliding sums.
//!
//! With `u = x e`, a regressor times the residual, least squares have the covariance `N⁻¹ S N⁻¹`, where `S` is the variance of the sum of
//! `u` over a window. With Bartlett's weights over `B` rows it is the sum of `g gᵀ / B`, where `g` is the sum of `u` over `B` neighbouring
//! rows: never negative, and a sliding sum of `g gᵀ`. The residual of a row is what the window around it leaves there, so it depends on no
//! other window. Sums are made by blocks, from suffixes and prefixes; nothing is subtracted.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::memory;
use crate::exec::pool::{Piece, Watch};
use crate::exec::stages::Stages;
use crate::least_squares::bandwidth::{Bandwidth, Neighbours};
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::record::samples::is_usable;
use crate::record::subsample::stretches;
use crate::simd::vectors::{Kernel, Lanes, dispatch};
use crate::status::Status;

/// Rows in a piece of work, about.
const PIECE: usize = 1 << 14;

/// Windows that are finished together.
const TILE: usize = 256;

/// Numbers that are added together.
const WIDTH: usize = 8;

/// Rows of which the correlation of the residuals is learnt: it is known to a few thousandths then.
const LEARNT_OF: usize = 1 << 17;

/// Windows that keep less of the variance than this beside what their fit takes have no standard error.
const LEAST_LEFT: f64 = 0.05;

impl RollingLeastSquares {
    /// The same as [`RollingLeastSquares::run`], with standard errors that know of correlated residuals: over so many rows, or over as
    /// many as the residuals of the record ask for. Returns how many. The outputs must belong to every row.
    ///
    /// # Errors
    /// If there is not the memory, or the watch cancels.
    pub fn run_correlated(
        mut self,
        equations: &Equations<'_>,
        mut regressions: Regressions<'_>,
        lags: Option<usize>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<usize, Error> {
        let rows = equations.columns.first().map_or(0, |column| column.len());
        let pairs = self.regressors * (self.regressors + 1) / 2;
        memory::ask_for_numbers(rows.saturating_mul(pairs))?;
        let mut normal = vec![vec![0.0; rows]; pairs];
        self.normal = true;
        let mut stages = Stages::new(workers, rows, 2, watch);
        let mut inner = regressions.reborrow();
        inner.normal = normal.iter_mut().map(Vec::as_mut_slice).collect();
        stages.stage(|watch| self.run(equations, inner, workers, watch))?;
        let Regressions { parameters, errors, status, .. } = &mut regressions;
        let (q, mut most) = (self.rhs_count, 0);
        for rhs in 0..q {
            let fits = Fits {
                plan: &self,
                equations,
                rhs,
                parameters: parameters.iter().skip(rhs).step_by(q).map(|values| &**values).collect(),
                normal: &normal,
                status,
            };
            let bandwidth = match lags {
                Some(lags) => Bandwidth::given(lags + 1, self.regressors),
                None => fits.bandwidth(&mut stages)?,
            };
            most = most.max(bandwidth.rows - 1);
            let errors = errors.iter_mut().skip(rhs).step_by(q).map(|values| &mut **values).collect();
            fits.run(&bandwidth, errors, &mut stages)?;
        }
        stages.finish()?;
        Ok(most)
    }
}

/// What the windows of a record found for one right-hand side.
struct Fits<'a> {
    plan: &'a RollingLeastSquares,
    equations: &'a Equations<'a>,
    rhs: usize,
    parameters: Vec<&'a [f64]>,
    /// The inverse of every window's normal matrix, its upper triangle row by row.
    normal: &'a [Vec<f64>],
    status: &'a [u16],
}

/// Regressors times residuals of some rows, side by side, zero where there are none.
struct RowProducts {
    first: isize,
    /// Vectors of `WIDTH` numbers a row.
    values: Vec<[f64; WIDTH]>,
    /// Rows that count before each row.
    counts: Vec<u32>,
}

impl Fits<'_> {
    fn rows(&self) -> usize {
        self.status.len()
    }

    /// Vectors that the products of a row take.
    fn vectors(&self) -> usize {
        self.plan.regressors.div_ceil(WIDTH)
    }

    /// The result whose window lies best around each of some rows, or the number of rows where there is none.
    fn nearest(&self, rows: Range<usize>) -> Vec<usize> {
        let (plan, total) = (self.plan, self.rows());
        let is_valid = |row: usize| self.status[row] & Status::INVALID.bits() == 0;
        // Full windows lie around rows; at the ends the first and the last of them do for the rows beyond.
        let last = total.saturating_sub(plan.window);
        let centre = |row: usize| (row.saturating_sub(plan.window / 2).min(last) + plan.before).min(total - 1);
        let begin = centre(rows.start).saturating_sub(plan.window);
        let end = total.min(centre(rows.end - 1) + plan.window);
        if (begin..end).all(is_valid) {
            return rows.map(centre).collect();
        }
        let mut before = Vec::with_capacity(end - begin);
        for row in begin..end {
            before.push(if is_valid(row) { row } else { before.last().copied().unwrap_or(total) });
        }
        let mut after = vec![total; end - begin + 1];
        for row in (begin..end).rev() {
            after[row - begin] = if is_valid(row) { row } else { after[row - begin + 1] };
        }
        let nearest = |row: usize| {
            let centre = centre(row);
            let (before, after) = (before[centre - begin], after[centre - begin]);
            if before < total && (after == total || centre - before <= after - centre) { before } else { after }
        };
        rows.map(nearest).collect()
    }

    /// The products of some rows; those outside of the record are zero.
    fn products(&self, range: Range<isize>) -> RowProducts {
        let (p, vectors, total) = (self.plan.regressors, self.vectors(), self.rows());
        let clamp = |row: isize| row.clamp(0, total.cast_signed()).unsigned_abs();
        let rows = clamp(range.start)..clamp(range.end);
        let length = (range.end - range.start).max(0).unsigned_abs();
        let mut values = vec![[0.0; WIDTH]; length * vectors];
        let mut counts = vec![0; length + 1];
        let read = |column: usize| {
            let mut into = vec![0.0; rows.len()];
            if !rows.is_empty() {
                self.equations.columns[column].read(rows.start, &mut into);
            }
            into
        };
        if !rows.is_empty() {
            let fits = self.nearest(rows.clone());
            let columns: Vec<Vec<f64>> = (0..p).map(read).collect();
            let mut residuals = read(p + self.rhs);
            for (column, parameters) in columns.iter().zip(&self.parameters) {
                for ((residual, x), &fit) in residuals.iter_mut().zip(column).zip(&fits) {
                    *residual -= x * parameters.get(fit).copied().unwrap_or(f64::NAN);
                }
            }
            let weights = self.equations.weights.map(|weights| {
                let mut into = vec![0.0; rows.len()];
                weights.read(rows.start, &mut into);
                into
            });
            let skipped = (rows.start.cast_signed() - range.start).unsigned_abs();
            for (place, &residual) in residuals.iter().enumerate() {
                let weight = weights.as_ref().map_or(1.0, |weights| weights[place]);
                if is_usable(residual) && weight > 0.0 {
                    let row = &mut values[(skipped + place) * vectors..][..vectors];
                    for (regressor, column) in columns.iter().enumerate() {
                        row[regressor / WIDTH][regressor % WIDTH] = weight * residual * column[place];
                    }
                    counts[skipped + place + 1] = 1;
                }
            }
        }
        for row in 0..length {
            counts[row + 1] += counts[row];
        }
        RowProducts { first: range.start, values, counts }
    }

    /// Over how many rows residuals are correlated, as stretches of the record show.
    fn bandwidth(&self, stages: &mut Stages<'_, '_>) -> Result<Bandwidth, Error> {
        let pieces = stretches(self.rows(), LEARNT_OF.max(8 * self.plan.window), 8)
            .map(|rows| Piece { size: rows.len(), content: rows })
            .collect();
        let (p, vectors) = (self.plan.regressors, self.vectors());
        let of_rows = |rows: Range<usize>, (): &mut ()| {
            let products = self.products(rows.start.cast_signed()..rows.end.cast_signed());
            let mut sums = vec![Neighbours::default(); p];
            for (regressor, sums) in sums.iter_mut().enumerate() {
                let at = |row: usize| products.values[row * vectors + regressor / WIDTH][regressor % WIDTH];
                for row in 1..rows.len() {
                    sums.add(at(row - 1), at(row));
                }
            }
            sums
        };
        let found = stages.map(pieces, || (), of_rows)?;
        let mut all = vec![Neighbours::default(); p];
        for sums in &found {
            all.iter_mut().zip(sums).for_each(|(all, sums)| all.merge(sums));
        }
        Ok(Bandwidth::of(&all, self.plan.window))
    }

    /// Writes the standard errors of every regressor.
    fn run(&self, bandwidth: &Bandwidth, errors: Vec<&mut [f64]>, stages: &mut Stages<'_, '_>) -> Result<(), Error> {
        let block = self.plan.window - bandwidth.rows + 1;
        let size = PIECE.max(8 * block);
        let (mut pieces, mut rest) = (Vec::new(), errors);
        for first in (0..self.rows()).step_by(size) {
            let rows = first..self.rows().min(first + size);
            let part: Vec<&mut [f64]> =
                rest.iter_mut().filter_map(|values| values.split_off_mut(..rows.len())).collect();
            pieces.push(Piece { size: rows.len(), content: (rows, part) });
        }
        let work = |(rows, part): (Range<usize>, Vec<&mut [f64]>), (): &mut ()| {
            dispatch(self.plan.instructions, Sandwich { fits: self, bandwidth, rows, errors: part });
        };
        stages.map(pieces, || (), work)?;
        Ok(())
    }
}

/// The kernel that writes the standard errors of the windows of some rows.
struct Sandwich<'a, 'b, 'c> {
    fits: &'a Fits<'b>,
    bandwidth: &'a Bandwidth,
    rows: Range<usize>,
    errors: Vec<&'c mut [f64]>,
}

impl Kernel for Sandwich<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        // Vectors that hold the products of a row, and those of pairs of them.
        match self.fits.plan.regressors {
            0..=3 => self.run_with::<1, 1>(),
            4..=5 => self.run_with::<1, 2>(),
            6..=8 => self.run_with::<1, 5>(),
            _ => self.run_with::<2, 17>(),
        }
    }
}

impl Sandwich<'_, '_, '_> {
    #[inline(always)]
    fn run_with<const V: usize, const P: usize>(mut self) {
        let (fits, plan, correlated) = (self.fits, self.fits.plan, self.bandwidth.rows);
        let (p, length) = (plan.regressors, plan.window - correlated + 1);
        let pairs = p * (p + 1) / 2;
        let first = self.rows.start.cast_signed() - plan.before.cast_signed();
        // Sums of neighbours are wanted from the block of the first window to the end of the block after that of the last one.
        let span = length.cast_signed();
        let begin = first.div_euclid(span) * span;
        let end = ((first + self.rows.len().cast_signed()).div_euclid(span) + 2) * span;
        let products = fits.products(begin..end + correlated.cast_signed());
        let mut neighbours = vec![[[0.0; WIDTH]; V]; (end - begin).unsigned_abs()];
        let of_product = |row: isize| {
            let mut found = [[0.0; WIDTH]; V];
            let place = usize::try_from(row - begin).ok();
            if let Some(values) = place.and_then(|place| products.values.get(place * V..(place + 1) * V)) {
                found.copy_from_slice(values);
            }
            found
        };
        sliding_sums(correlated, begin..end, of_product, |place, sum| neighbours[place] = sum);
        let square = |row: isize| {
            let of = &neighbours[(row - begin).unsigned_abs()];
            let (mut found, mut pair) = ([[0.0; WIDTH]; P], 0);
            for i in 0..p {
                for k in i..p {
                    found[pair / WIDTH][pair % WIDTH] = of[i / WIDTH][i % WIDTH] * of[k / WIDTH][k % WIDTH];
                    pair += 1;
                }
            }
            found
        };
        let mut tile = vec![[0.0; TILE]; pairs];
        let (last, windows) = (self.rows.len() - 1, first..first + self.rows.len().cast_signed());
        let finish = |place: usize, sum: [[f64; WIDTH]; P]| {
            for (tile, sum) in tile.iter_mut().zip(sum.as_flattened()) {
                tile[place % TILE] = *sum;
            }
            if place % TILE == TILE - 1 || place == last {
                self.write(place - place % TILE..place + 1, &tile, &products);
            }
        };
        sliding_sums(length, windows, square, finish);
    }

    /// Writes the errors of some windows of the piece from the sums of squares of each.
    #[inline(always)]
    fn write(&mut self, places: Range<usize>, sums: &[[f64; TILE]], products: &RowProducts) {
        let (p, count) = (self.fits.plan.regressors, places.len());
        let pair = |i: usize, k: usize| {
            let (i, k) = (i.min(k), i.max(k));
            i * p - i * i.saturating_sub(1) / 2 + k - i
        };
        let rows = self.rows.start + places.start..self.rows.start + places.end;
        let mut scale = [0.0; TILE];
        for (scale, row) in scale.iter_mut().zip(rows.clone()) {
            *scale = self.scale(row, products);
        }
        let kept: Vec<f64> = self.bandwidth.kept.iter().map(|kept| kept.sqrt().recip()).collect();
        for a in 0..p {
            let mut variance = [0.0; TILE];
            for b in 0..p {
                let mut inner = [0.0; TILE];
                for c in 0..p {
                    let kept = kept[b] * kept[c];
                    let (of, sum) = (&self.fits.normal[pair(c, a)][rows.clone()], &sums[pair(b, c)]);
                    for ((inner, of), sum) in inner.iter_mut().zip(of).zip(sum) {
                        *inner += kept * of * sum;
                    }
                }
                let of = &self.fits.normal[pair(b, a)][rows.clone()];
                for ((variance, of), inner) in variance.iter_mut().zip(of).zip(&inner) {
                    *variance += of * inner;
                }
            }
            let into = &mut self.errors[a][places.clone()];
            for ((error, variance), scale) in into.iter_mut().zip(&variance[..count]).zip(&scale) {
                // Where there are no parameters there is no error, and it stays NaN.
                *error = (scale * variance).sqrt() + 0.0 * *error;
            }
        }
    }

    /// What the sum over the window of a row is to be multiplied by.
    #[inline(always)]
    fn scale(&self, row: usize, products: &RowProducts) -> f64 {
        let (plan, correlated) = (self.fits.plan, self.bandwidth.rows as f64);
        let first = row.cast_signed() - plan.before.cast_signed();
        let end = first + plan.window.cast_signed();
        let there = first.max(0)..end.min(self.fits.rows().cast_signed());
        // Sums that reach out of a window are left out, but for those over an end of the record, of which a part is there.
        let over = |rows: isize| {
            let rows = rows.min(self.bandwidth.rows.cast_signed() - 1) as f64;
            rows * (1.0 - (rows + 1.0) / (2.0 * correlated))
        };
        let spanned = (there.end - there.start) as f64;
        let complete = spanned - correlated + 1.0 + over(there.start - first) + over(end - there.end);
        let at = |row: isize| (row - products.first).unsigned_abs();
        let count = f64::from(products.counts[at(there.end)] - products.counts[at(there.start)]);
        // What fits take of the sums of neighbours: of one row the part p / w, of B rows about (B + p - 1) / w.
        let left = 1.0 - (correlated + plan.regressors as f64 - 1.0) / count;
        if left < LEAST_LEFT || complete <= 0.0 { f64::NAN } else { spanned / (complete * correlated * left) }
    }
}

/// Sums of `length` rows from each of some rows on, as a suffix of one block and a prefix of the next. `row` gives a row.
#[inline(always)]
fn sliding_sums<const V: usize>(
    length: usize,
    wanted: Range<isize>,
    row: impl Fn(isize) -> [[f64; WIDTH]; V],
    mut give: impl FnMut(usize, [[f64; WIDTH]; V]),
) {
    let add = |one: &[[f64; WIDTH]; V], other: &[[f64; WIDTH]; V]| {
        let mut sum = *one;
        for (sum, other) in sum.as_flattened_mut().iter_mut().zip(other.as_flattened()) {
            *sum += other;
        }
        sum
    };
    let span = length.cast_signed();
    let mut suffixes = vec![[[0.0; WIDTH]; V]; length];
    let mut block = wanted.start.div_euclid(span) * span;
    while block < wanted.end {
        let mut suffix = [[0.0; WIDTH]; V];
        for (offset, kept) in suffixes.iter_mut().enumerate().rev() {
            suffix = add(&suffix, &row(block + offset.cast_signed()));
            *kept = suffix;
        }
        let mut prefix = [[0.0; WIDTH]; V];
        for (offset, suffix) in suffixes.iter().enumerate() {
            let place = block + offset.cast_signed();
            if place >= wanted.end {
                break;
            }
            if place >= wanted.start {
                give((place - wanted.start).unsigned_abs(), add(suffix, &prefix));
            }
            prefix = add(&prefix, &row(place + span));
        }
        block += span;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_slide_over_blocks_from_any_row_on() {
        for (length, wanted) in [(1, -3..4_isize), (4, -7..9), (5, 0..1), (3, 2..20)] {
            let mut found = Vec::new();
            let row = |row: isize| [[row as f64; WIDTH]];
            sliding_sums(length, wanted.clone(), row, |place, sum| found.push((place, sum[0][3])));
            let expected = |(place, first): (usize, isize)| {
                (place, (first..first + length.cast_signed()).map(|row| row as f64).sum::<f64>())
            };
            assert_eq!(found, wanted.enumerate().map(expected).collect::<Vec<_>>());
        }
    }
}
