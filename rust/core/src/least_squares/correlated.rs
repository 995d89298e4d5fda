//! Standard errors of windows whose residuals are correlated (Newey and West 1987), by sliding sums.
//!
//! With `u = x e`, a regressor times the residual, least squares have the covariance `N⁻¹ S N⁻¹`, where `S` is the variance of the sum of
//! `u` over a window. With Bartlett's weights over `B` rows it is the sum of `g gᵀ / B`, where `g` is the sum of `u` over `B` neighbouring
//! rows: never negative, and a sliding sum of `g gᵀ`. The residual of a row is what the window around it leaves there, so it depends on no
//! other window. Sums are made by blocks, from suffixes and prefixes; nothing is subtracted.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::huge_pages::zeros;
use crate::exec::pool::{Piece, Watch};
use crate::exec::stages::Stages;
use crate::least_squares::bandwidth::{Bandwidth, Neighbours};
use crate::least_squares::error_scale::{ErrorScale, TILE};
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::least_squares::sliding_sums::{sliding_sums, sums_of_block};
use crate::record::samples::is_usable;
use crate::record::subsample::stretches;
use crate::simd::vectors::{Kernel, Lanes, dispatch};
use crate::status::Status;

/// Rows in a piece of work, about: what is kept of them stays in the second nearest cache.
const PIECE: usize = 3 << 11;

/// Rows of which the correlation of the residuals is learnt: it is known to a few thousandths then.
const LEARNT_OF: usize = 1 << 17;

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
        let pairs = self.regressors * (self.regressors - 1) / 2;
        // One array: every one of its own has small pages at its ends, which cost as much as a tenth of the work.
        let mut normal = zeros(pairs.saturating_mul(rows))?;
        self.normal = true;
        let mut stages = Stages::new(workers, rows, 2, watch);
        let mut inner = regressions.reborrow();
        inner.normal = normal.chunks_exact_mut(rows.max(1)).collect();
        stages.stage(|watch| self.run(equations, inner, workers, watch))?;
        let normal: Vec<&[f64]> = normal.chunks_exact(rows.max(1)).collect();
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
    /// What is above the diagonal of the inverse of every window's normal matrix, row by row; the diagonal is where errors are to be.
    normal: &'a [&'a [f64]],
    status: &'a [u16],
}

/// Regressors times residuals of some rows, side by side, zero where there are none.
#[derive(Default)]
struct RowProducts {
    first: isize,
    /// As many numbers a row as [`numbers_of_a_row`] says.
    values: Vec<f64>,
    /// Rows that count before each row.
    counts: Vec<u32>,
    /// The columns that a row's products are made of, one after the other: regressors, the right-hand side, weights.
    columns: Vec<f64>,
}

/// Memory of one thread.
#[derive(Default)]
struct Scratch {
    products: RowProducts,
    /// Sums of neighbouring rows, then of one block and of the next the products of each pair of these, and the sums of the block.
    neighbours: Vec<f64>,
    here: Vec<f64>,
    next: Vec<f64>,
    sums: Vec<f64>,
}

/// Numbers of a row that stand side by side for so many regressors: whole vectors.
const fn numbers_of_a_row(regressors: usize) -> usize {
    if regressors <= 4 {
        4
    } else if regressors <= 8 {
        8
    } else {
        16
    }
}

/// So many numbers of each of some rows. What they held before is left there.
fn side_by_side<const N: usize>(numbers: &mut Vec<f64>, rows: usize) -> &mut [[f64; N]] {
    if numbers.len() < rows * N {
        numbers.resize(rows * N, 0.0);
    }
    numbers[..rows * N].as_chunks_mut::<N>().0
}

impl Fits<'_> {
    fn rows(&self) -> usize {
        self.status.len()
    }

    /// The result whose window would lie best around a row, if it is valid: at the ends the first and the last full windows do.
    fn centre(&self, row: usize) -> usize {
        let (plan, total) = (self.plan, self.rows());
        (row.saturating_sub(plan.window / 2).min(total.saturating_sub(plan.window)) + plan.before).min(total - 1)
    }

    fn is_valid(&self, row: usize) -> bool {
        self.status[row] & Status::INVALID.bits() == 0
    }

    /// The results around some rows where these are one after the other.
    fn own_fits(&self, rows: &Range<usize>) -> Option<Range<usize>> {
        let fits = self.centre(rows.start)..self.centre(rows.end - 1) + 1;
        let is_inside = rows.start >= self.plan.window / 2 && fits.len() == rows.len();
        (is_inside && fits.clone().all(|row| self.is_valid(row))).then_some(fits)
    }

    /// The result whose window lies best around each of some rows, or the number of rows where there is none.
    fn nearest(&self, rows: Range<usize>) -> Vec<usize> {
        let (plan, total) = (self.plan, self.rows());
        let (is_valid, centre) = (|row: usize| self.is_valid(row), |row: usize| self.centre(row));
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
    #[inline(always)]
    fn products(&self, range: Range<isize>, products: &mut RowProducts) {
        let (p, row_size, total) = (self.plan.regressors, numbers_of_a_row(self.plan.regressors), self.rows());
        let clamp = |row: isize| row.clamp(0, total.cast_signed()).unsigned_abs();
        let rows = clamp(range.start)..clamp(range.end);
        let length = (range.end - range.start).max(0).unsigned_abs();
        products.first = range.start;
        products.values.clear();
        products.values.resize(length * row_size, 0.0);
        products.counts.clear();
        products.counts.resize(length + 1, 0);
        if !rows.is_empty() {
            let RowProducts { values, counts, columns, .. } = products;
            let sources = self.equations.columns[..p].iter().chain([&self.equations.columns[p + self.rhs]]);
            if columns.len() < (p + 2) * rows.len() {
                columns.resize((p + 2) * rows.len(), 0.0);
            }
            let columns = &mut columns[..(p + 2) * rows.len()];
            columns[(p + 1) * rows.len()..].fill(1.0);
            for (source, into) in sources.chain(&self.equations.weights).zip(columns.chunks_mut(rows.len())) {
                source.read(rows.start, into);
            }
            let (columns, rest) = columns.split_at_mut(p * rows.len());
            let (residuals, weights) = rest.split_at_mut(rows.len());
            self.take_off_fits(&rows, columns, residuals);
            let skipped = (rows.start.cast_signed() - range.start).unsigned_abs();
            let (values, counts) = (&mut values[skipped * row_size..], &mut counts[skipped + 1..]);
            for ((count, residual), weight) in counts.iter_mut().zip(&mut *residuals).zip(&*weights) {
                let counted = is_usable(*residual) && *weight > 0.0;
                *count = u32::from(counted);
                *residual = if counted { weight * *residual } else { 0.0 };
            }
            for (place, (row, &residual)) in values.chunks_exact_mut(row_size).zip(&*residuals).enumerate() {
                for (product, column) in row.iter_mut().zip(columns.chunks_exact(rows.len())) {
                    // A row that does not count may hold what is no number.
                    *product = if residual == 0.0 { 0.0 } else { residual * column[place] };
                }
            }
        }
        let mut before = 0;
        for count in &mut products.counts {
            before += *count;
            *count = before;
        }
    }

    /// Takes off what fits explain of some rows, whose regressors stand one after the other.
    #[inline(always)]
    fn take_off_fits(&self, rows: &Range<usize>, columns: &[f64], residuals: &mut [f64]) {
        let all = columns.chunks(rows.len()).zip(&self.parameters);
        if let Some(fits) = self.own_fits(rows) {
            for (column, parameters) in all {
                for ((residual, x), parameter) in residuals.iter_mut().zip(column).zip(&parameters[fits.clone()]) {
                    *residual -= x * parameter;
                }
            }
            return;
        }
        let fits = self.nearest(rows.clone());
        for (column, parameters) in all {
            for ((residual, x), &fit) in residuals.iter_mut().zip(column).zip(&fits) {
                *residual -= x * parameters.get(fit).copied().unwrap_or(f64::NAN);
            }
        }
    }

    /// Over how many rows residuals are correlated, as stretches of the record show.
    fn bandwidth(&self, stages: &mut Stages<'_, '_>) -> Result<Bandwidth, Error> {
        let pieces = stretches(self.rows(), LEARNT_OF.max(8 * self.plan.window), 8)
            .map(|rows| Piece { size: rows.len(), content: rows })
            .collect();
        let (p, row_size) = (self.plan.regressors, numbers_of_a_row(self.plan.regressors));
        let of_rows = |rows: Range<usize>, products: &mut RowProducts| {
            self.products(rows.start.cast_signed()..rows.end.cast_signed(), products);
            let mut sums = vec![Neighbours::default(); p];
            for (regressor, sums) in sums.iter_mut().enumerate() {
                let at = |row: usize| products.values[row * row_size + regressor];
                for row in 1..rows.len() {
                    sums.add(at(row - 1), at(row));
                }
            }
            sums
        };
        let found = stages.map(pieces, RowProducts::default, of_rows)?;
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
        let work = |(rows, part): (Range<usize>, Vec<&mut [f64]>), scratch: &mut Scratch| {
            dispatch(self.plan.instructions, Sandwich { fits: self, bandwidth, rows, errors: part, scratch });
        };
        stages.map(pieces, Scratch::default, work)?;
        Ok(())
    }
}

/// The kernel that writes the standard errors of the windows of some rows.
struct Sandwich<'a, 'b, 'c> {
    fits: &'a Fits<'b>,
    bandwidth: &'a Bandwidth,
    rows: Range<usize>,
    errors: Vec<&'c mut [f64]>,
    scratch: &'c mut Scratch,
}

impl Kernel for Sandwich<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, _simd: S) {
        // Numbers of a row side by side, of the pairs of them, and of the regressors where these are few.
        match self.fits.plan.regressors {
            1 => self.run_with::<4, 1, 1>(),
            2 => self.run_with::<4, 4, 2>(),
            3 => self.run_with::<4, 8, 3>(),
            4 => self.run_with::<4, 16, 4>(),
            5 => self.run_with::<8, 16, 0>(),
            ..=8 => self.run_with::<8, 40, 0>(),
            _ => self.run_with::<16, 136, 0>(),
        }
    }
}

impl Sandwich<'_, '_, '_> {
    #[inline(always)]
    fn run_with<const N: usize, const P: usize, const R: usize>(self) {
        let Self { fits, bandwidth, rows, mut errors, scratch } = self;
        let p = if R == 0 { fits.plan.regressors } else { R };
        let Scratch { products, neighbours, here, next, sums } = scratch;
        let (correlated, length) = (bandwidth.rows, fits.plan.window - bandwidth.rows + 1);
        let first = rows.start.cast_signed() - fits.plan.before.cast_signed();
        // Blocks are tied to the rows of the record: those of windows, and those of neighbours before them.
        let of_block = |row: isize, length: usize| row.div_euclid(length.cast_signed()) * length.cast_signed();
        let begin = of_block(first, length);
        let begin_of_neighbours = of_block(begin, correlated);
        let end = of_block(first + rows.len().cast_signed(), length) + 2 * length.cast_signed();
        fits.products(begin_of_neighbours..end + correlated.cast_signed(), products);
        let of_rows = products.values.as_chunks::<N>().0;
        let count = (end - begin_of_neighbours).unsigned_abs();
        let neighbours = if correlated == 1 {
            &of_rows[..count]
        } else {
            let sums = side_by_side::<N>(neighbours, count);
            sliding_sums(correlated, of_rows, sums);
            sums
        };
        let neighbours = &neighbours[(begin - begin_of_neighbours).unsigned_abs()..];
        let [mut here, mut next, sums] = [here, next, sums].map(|vectors| side_by_side::<P>(vectors, length));
        squares(p, &neighbours[..length], next);
        let scale = ErrorScale::new(fits.plan, fits.normal, fits.rows(), bandwidth);
        let mut tile = vec![[0.0; TILE]; p * (p + 1) / 2];
        let skipped = (first - begin).unsigned_abs();
        let mut done = 0;
        for (block, after) in neighbours[length..].chunks_exact(length).enumerate() {
            // What was next is here, and stays in the nearest cache until its sums are used.
            std::mem::swap(&mut here, &mut next);
            squares(p, after, next);
            sums_of_block(here, next, sums);
            let wanted = skipped.max(block * length)..(skipped + rows.len()).min((block + 1) * length);
            if wanted.is_empty() {
                break;
            }
            for some in sums[wanted.start - block * length..wanted.end - block * length].chunks(TILE) {
                for (pair, tile) in tile.iter_mut().enumerate() {
                    for (into, sum) in tile.iter_mut().zip(some) {
                        *into = sum[pair];
                    }
                }
                let places = done..done + some.len();
                let some_rows = rows.start + places.start..rows.start + places.end;
                let into = errors.iter_mut().map(|errors| &mut errors[places.clone()]);
                scale.write::<R>(some_rows, &tile, (products.first, &products.counts), into);
                done = places.end;
            }
        }
    }
}

/// The products of each pair of the first numbers of rows.
#[inline(always)]
fn squares<const N: usize, const P: usize>(numbers: usize, rows: &[[f64; N]], products: &mut [[f64; P]]) {
    for (products, row) in products.iter_mut().zip(rows) {
        let mut pair = 0;
        for i in 0..numbers {
            for k in i..numbers {
                products[pair] = row[i] * row[k];
                pair += 1;
            }
        }
    }
}
