//! Standard errors of windows whose residuals are correlated (Newey and West 1987), by sliding sums.
//!
//! With `u = x e`, a regressor times the residual, least squares have the covariance `N⁻¹ S N⁻¹`, where `S` is the variance of the sum of
//! `u` over a window. With Bartlett's weights over `B` rows it is the sum of `g gᵀ / B`, where `g` is the sum of `u` over `B` neighbouring
//! rows: never negative, and a sliding sum of `g gᵀ`. The residual of a row is what the window around it leaves there, so it depends on no
//! other window. Sums are made by blocks, from suffixes and prefixes; nothing is subtracted.

use std::num::NonZeroUsize;
use std::ops::Range;

use crate::error::Error;
use crate::exec::pool::{Piece, Watch};
use crate::exec::stages::Stages;
use crate::lanes::output::split_off;
use crate::least_squares::bandwidth::{Bandwidth, Neighbours};
use crate::least_squares::error_scale::ErrorScale;
use crate::least_squares::givens_factor::{MOST_PAIRS, MOST_REGRESSORS};
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::least_squares::rounds::{Lender, Lent, Rounds, SomeWindows};
use crate::least_squares::row_fits::{Fits, ProductsOfRows};
use crate::least_squares::row_products::{Pairs, RowProducts, side_by_side};
use crate::least_squares::side_by_side::RollingScratch;
use crate::least_squares::sliding_sums::{begin, slide, sliding_sums};
use crate::record::subsample::stretches;
use crate::simd::aligned::Aligned;
use crate::simd::vectors::{Kernel, Lanes, apart, dispatch};

/// Rows of which the correlation of the residuals is learnt: it is known to a few thousandths then.
const LEARNT_OF: usize = 1 << 17;

/// Rows of it whose products are made at once, and stay in a near cache.
const AT_ONCE: usize = 1 << 10;

impl RollingLeastSquares {
    /// The same as [`RollingLeastSquares::run`], with standard errors that know of correlated residuals: over so many rows, or over as
    /// many as the residuals of the record ask for. Returns how many. The outputs must belong to every row.
    ///
    /// # Errors
    /// If there is not the memory, or the watch cancels.
    pub fn run_correlated(
        mut self,
        equations: &Equations<'_>,
        regressions: Regressions<'_>,
        lags: Option<usize>,
        workers: NonZeroUsize,
        watch: &mut Watch<'_>,
    ) -> Result<usize, Error> {
        let total = equations.columns.first().map_or(0, |column| column.len());
        self.normal = true;
        let mut rounds = Rounds::new(&self, equations, regressions, workers)?;
        let all = rounds.all(workers);
        let mut stages = Stages::new(workers, total, all.len() * (1 + self.rhs_count), watch);
        let bandwidths = match lags {
            Some(lags) => vec![Bandwidth::given(lags + 1, self.regressors); self.rhs_count],
            None => self.bandwidths(equations, &mut rounds, total, &mut stages)?,
        };
        let scratch = Lender::new();
        for round in all {
            rounds.solve(&self.needed_by(&rounds.rows_of(&round)), &mut stages)?;
            for (rhs, bandwidth) in bandwidths.iter().enumerate() {
                let (fits, errors) = Fits::of(&self, equations, (rhs, total), &mut rounds.regressions);
                fits.run(bandwidth, &rounds.pieces[round.clone()], errors, &scratch, &mut stages)?;
            }
            rounds.forget(round);
        }
        stages.finish()?;
        Ok(bandwidths.iter().map(|bandwidth| bandwidth.rows - 1).max().unwrap_or(0))
    }

    /// Over how many rows the residuals of every right-hand side are correlated, as stretches of the record show.
    fn bandwidths(
        &self,
        equations: &Equations<'_>,
        rounds: &mut Rounds<'_, '_>,
        total: usize,
        stages: &mut Stages<'_, '_>,
    ) -> Result<Vec<Bandwidth>, Error> {
        let some: Vec<Range<usize>> = stretches(total, LEARNT_OF.max(8 * self.window), 8).collect();
        for rows in &some {
            rounds.solve(&self.needed_by(rows), stages)?;
        }
        let of_rhs = |rhs| Fits::of(self, equations, (rhs, total), &mut rounds.regressions).0.bandwidth(&some, stages);
        (0..self.rhs_count).map(of_rhs).collect()
    }

    /// Solves the windows around some rows, which are `wanted`, and others `around` them that their errors need, as
    /// [`RollingLeastSquares::run_correlated`] does with a given bandwidth. Of the equations those in the windows must be there. The plan
    /// wants the normal matrices, and the outputs belong to every row from the first of those around on.
    pub(crate) fn solve_correlated(
        &self,
        equations: &Equations<'_>,
        (wanted, around): (Range<usize>, Range<usize>),
        bandwidth: &Bandwidth,
        regressions: &mut Regressions<'_>,
        scratch: &mut CorrelatedScratch,
    ) {
        let CorrelatedScratch { windows, sums, normal } = scratch;
        for column in normal.iter_mut() {
            column.resize(around.len(), 0.0);
        }
        {
            let mut outputs = regressions.reborrow();
            outputs.normal = normal.iter_mut().map(Vec::as_mut_slice).collect();
            self.solve(equations, around.clone(), &mut outputs, windows);
        }
        let own = wanted.start - around.start..wanted.end - around.start;
        for rhs in 0..self.rhs_count {
            let (fits, errors) = Fits::of(self, equations, (rhs, equations.rows.end), regressions);
            let errors = errors.into_iter().map(|errors| &mut errors[own.clone()]).collect();
            let normal = normal.iter().map(|column| &column[own.clone()]).collect();
            let rows = wanted.clone();
            dispatch(self.instructions, Sandwich { fits: &fits, bandwidth, rows, normal, errors, scratch: sums });
        }
    }

    /// The windows around these rows are needed for the errors of windows around some rows, beside those before.
    fn needed_by(&self, rows: &Range<usize>) -> Range<usize> {
        rows.start.saturating_sub(2 * self.window)..rows.end + 2 * self.window
    }
}

/// Memory for windows of rows that go on coming.
#[derive(Debug)]
pub(crate) struct CorrelatedScratch {
    windows: RollingScratch,
    sums: Scratch,
    normal: Vec<Vec<f64>>,
}

impl CorrelatedScratch {
    pub(crate) fn new(plan: &RollingLeastSquares) -> Self {
        let pairs = plan.regressors * (plan.regressors - 1) / 2;
        Self { windows: plan.scratch(), sums: Scratch::default(), normal: vec![Vec::new(); pairs] }
    }
}

/// Memory of one thread.
#[derive(Debug, Default)]
struct Scratch {
    products: RowProducts,
    /// Sums of neighbouring rows, then of the products of each pair of these: the sums of one block, and the suffixes of the next.
    neighbours: Aligned,
    here: Aligned,
    next: Aligned,
}

impl Fits<'_> {
    /// Over how many rows residuals are correlated, as some rows show.
    fn bandwidth(&self, some: &[Range<usize>], stages: &mut Stages<'_, '_>) -> Result<Bandwidth, Error> {
        let pieces = some.iter().map(|rows| Piece { size: rows.len(), content: rows.clone() }).collect();
        let p = self.plan.regressors;
        let of_rows = |rows: Range<usize>, products: &mut RowProducts| {
            dispatch(self.plan.instructions, Correlations { fits: self, rows, products })
        };
        let found = stages.map(pieces, RowProducts::default, of_rows)?;
        let mut all = vec![Neighbours::default(); p];
        for sums in &found {
            all.iter_mut().zip(sums).for_each(|(all, sums)| all.merge(sums));
        }
        Ok(Bandwidth::of(&all, self.plan.window))
    }

    /// Writes the standard errors of every regressor, for the windows of some pieces.
    fn run(
        &self,
        bandwidth: &Bandwidth,
        windows: &[SomeWindows],
        mut errors: Vec<&mut [f64]>,
        scratch: &Lender<Scratch>,
        stages: &mut Stages<'_, '_>,
    ) -> Result<(), Error> {
        let (mut pieces, mut done) = (Vec::new(), 0);
        for some in windows {
            let rows = some.rows.clone();
            let part = errors.iter_mut().map(|values| {
                split_off(values, rows.start - done);
                split_off(values, rows.len())
            });
            let part = part.collect();
            done = rows.end;
            pieces.push(Piece { size: rows.len(), content: (some, part) });
        }
        let work = |(some, errors): (&SomeWindows, Vec<&mut [f64]>), lent: &mut Lent<'_, Scratch>| {
            let scratch = lent.get();
            let normal = some.normal();
            let rows = some.rows.clone();
            dispatch(self.plan.instructions, Sandwich { fits: self, bandwidth, rows, normal, errors, scratch });
        };
        stages.map(pieces, || scratch.lend(Scratch::default), work)?;
        Ok(())
    }
}

/// The kernel that learns how neighbours in some rows are correlated, by regressor.
struct Correlations<'a, 'b, 'c> {
    fits: &'a Fits<'b>,
    rows: Range<usize>,
    products: &'c mut RowProducts,
}

impl Kernel for Correlations<'_, '_, '_> {
    type Output = Vec<Neighbours>;

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) -> Vec<Neighbours> {
        match self.fits.plan.regressors {
            ..=4 if S::F64_LANES == 1 => self.run_with::<S, 4, 0>(simd),
            1 => self.run_with::<S, 4, 1>(simd),
            2 => self.run_with::<S, 4, 2>(simd),
            3 => self.run_with::<S, 4, 3>(simd),
            4 => self.run_with::<S, 4, 4>(simd),
            ..=8 => self.run_with::<S, 8, 0>(simd),
            _ => self.run_with::<S, 16, 0>(simd),
        }
    }
}

impl Correlations<'_, '_, '_> {
    #[inline(always)]
    fn run_with<S: Lanes, const N: usize, const R: usize>(self, simd: S) -> Vec<Neighbours> {
        let Self { fits, rows, products } = self;
        let mut sums: [Neighbours; N] = std::array::from_fn(|_| Neighbours::default());
        // Where rows look for windows that are valid, they look as far as these rows go.
        let at_once = if fits.are_valid(&rows) { AT_ONCE } else { rows.len().max(1) };
        for first in rows.clone().step_by(at_once) {
            // The last of them is the first of the next.
            let some = first..rows.end.min(first + at_once + 1);
            let range = some.start.cast_signed()..some.end.cast_signed();
            apart(simd, ProductsOfRows::<N, R> { fits, range, end: rows.end, into: &mut *products });
            for rows in products.values.as_chunks::<N>().0[..some.len()].windows(2) {
                for (regressor, sums) in sums.iter_mut().enumerate() {
                    sums.add(rows[0][regressor], rows[1][regressor]);
                }
            }
        }
        sums[..fits.plan.regressors].to_vec()
    }
}

/// The kernel that writes the standard errors of the windows of some rows.
struct Sandwich<'a, 'b, 'c> {
    fits: &'a Fits<'b>,
    bandwidth: &'a Bandwidth,
    rows: Range<usize>,
    /// What is above the diagonals of the inverses of their normal matrices.
    normal: Vec<&'c [f64]>,
    errors: Vec<&'c mut [f64]>,
    scratch: &'c mut Scratch,
}

impl Kernel for Sandwich<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        // Numbers of a row side by side, of the pairs of them, and of the regressors where these are few and vectors pay for kernels of
        // their own.
        match self.fits.plan.regressors {
            ..=4 if S::F64_LANES == 1 => self.run_with::<S, 4, 12, 0>(simd),
            ..=8 if S::F64_LANES == 1 => self.run_with::<S, 8, 40, 0>(simd),
            1 => self.run_with::<S, 4, 1, 1>(simd),
            2 => self.run_with::<S, 4, 8, 2>(simd),
            3 => self.run_with::<S, 4, 8, 3>(simd),
            4 => self.run_with::<S, 4, 12, 4>(simd),
            5 => self.run_with::<S, 8, 16, 5>(simd),
            6 => self.run_with::<S, 8, 24, 6>(simd),
            7 => self.run_with::<S, 8, 32, 7>(simd),
            8 => self.run_with::<S, 8, 40, 8>(simd),
            _ => self.run_with::<S, 16, 136, 0>(simd),
        }
    }
}

impl Sandwich<'_, '_, '_> {
    #[inline(always)]
    fn run_with<S: Lanes, const N: usize, const P: usize, const R: usize>(self, simd: S) {
        let Self { fits, bandwidth, rows, normal, mut errors, scratch } = self;
        let p = if R == 0 { fits.plan.regressors } else { R };
        let Scratch { products, neighbours, here, next } = scratch;
        let (correlated, length) = (bandwidth.rows, fits.plan.window - bandwidth.rows + 1);
        let first = rows.start.cast_signed() - fits.plan.before.cast_signed();
        // Blocks are tied to the rows of the record: those of windows, and those of neighbours before them.
        let of_block = |row: isize, length: usize| row.div_euclid(length.cast_signed()) * length.cast_signed();
        let from = of_block(first, length);
        let from_neighbours = of_block(from, correlated);
        let end = of_block(first + rows.len().cast_signed(), length) + 2 * length.cast_signed();
        let count = (end - from_neighbours).unsigned_abs().next_multiple_of(correlated);
        let until = from_neighbours + (count + correlated).cast_signed();
        // Of rows after the last window nothing is asked, and nothing may be known.
        let known = rows.end - 1 + fits.plan.window - fits.plan.before;
        let (range, end) = (from_neighbours..until, known);
        match R {
            5.. => apart(simd, ProductsOfRows::<N, 0> { fits, range, end, into: &mut *products }),
            _ => apart(simd, ProductsOfRows::<N, R> { fits, range, end, into: &mut *products }),
        }
        let of_rows = products.values.as_chunks::<N>().0;
        let neighbours = if correlated == 1 {
            &of_rows[..count]
        } else {
            let sums = side_by_side::<N>(neighbours, count);
            sliding_sums(simd, correlated, of_rows, sums);
            sums
        };
        let neighbours = &neighbours[(from - from_neighbours).unsigned_abs()..];
        let [mut here, mut next] = [here, next].map(|vectors| side_by_side::<P>(vectors, length));
        let pairs = Pairs::<R>(p);
        begin(simd, &neighbours[..length], pairs, next);
        let scale = ErrorScale::new(fits.plan, fits.rows(), bandwidth);
        let counts = (products.first, &*products.counts);
        let skipped = (first - from).unsigned_abs();
        for (block, after) in neighbours[length..].chunks_exact(length).enumerate() {
            std::mem::swap(&mut here, &mut next);
            slide(simd, after, pairs, here, next);
            // Windows by where they begin after the first block.
            let wanted = skipped.max(block * length)..(skipped + rows.len()).min((block + 1) * length);
            if wanted.is_empty() {
                break;
            }
            let done = wanted.start - skipped..wanted.end - skipped;
            let some_rows = rows.start + done.start..rows.start + done.end;
            let sums = &here[wanted.start - block * length..wanted.end - block * length];
            let mut into: [&mut [f64]; MOST_REGRESSORS] = Default::default();
            into.iter_mut().zip(&mut errors).for_each(|(into, errors)| *into = &mut errors[done.clone()]);
            let mut between: [&[f64]; MOST_PAIRS] = [&[]; MOST_PAIRS];
            between.iter_mut().zip(&normal).for_each(|(between, normal)| *between = &normal[done.clone()]);
            scale.write::<S, N, P, R>(simd, some_rows, sums, counts, &between, &mut into[..p]);
        }
    }
}
