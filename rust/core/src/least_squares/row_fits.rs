//! What windows say of the rows of a record: the residual of each, which the window around it leaves, times its regressors.

use std::ops::Range;

use crate::least_squares::givens_factor::MOST_REGRESSORS;
use crate::least_squares::plan::{Equations, Regressions, RollingLeastSquares};
use crate::least_squares::row_products::{RowProducts, multiply, side_by_side};
use crate::simd::vectors::{Kernel, Lanes, MOST_LANES};
use crate::status::Status;

/// What the windows of a record found for one right-hand side.
pub(crate) struct Fits<'a> {
    pub(crate) plan: &'a RollingLeastSquares,
    equations: &'a Equations<'a>,
    rhs: usize,
    /// Rows of the record.
    total: usize,
    /// The windows around rows from this one on, which are held.
    first: usize,
    parameters: Vec<&'a [f64]>,
    status: &'a [u16],
}

impl<'a> Fits<'a> {
    /// These of one right-hand side, and where their errors are to be: now the diagonals of the inverses of normal matrices are there.
    pub(crate) fn of(
        plan: &'a RollingLeastSquares,
        equations: &'a Equations<'a>,
        (rhs, total): (usize, usize),
        regressions: &'a mut Regressions<'_>,
    ) -> (Self, Vec<&'a mut [f64]>) {
        let Regressions { elements, parameters, errors, status, .. } = regressions;
        let first = elements.first;
        let parameters = parameters.iter().skip(rhs).step_by(plan.rhs_count).map(|values| &**values).collect();
        let errors = errors.iter_mut().skip(rhs).step_by(plan.rhs_count).map(|values| &mut **values).collect();
        (Self { plan, equations, rhs, total, first, parameters, status }, errors)
    }
}

impl Fits<'_> {
    pub(crate) fn rows(&self) -> usize {
        self.total
    }

    /// The windows around these rows are held.
    fn held(&self) -> Range<usize> {
        self.first..self.first + self.status.len()
    }

    /// The result whose window would lie best around a row, if it is valid: at the ends the first and the last full windows do.
    fn centre(&self, row: usize) -> usize {
        let (plan, total) = (self.plan, self.rows());
        (row.saturating_sub(plan.window / 2).min(total.saturating_sub(plan.window)) + plan.before).min(total - 1)
    }

    fn is_valid(&self, row: usize) -> bool {
        self.status[row - self.first] & Status::INVALID.bits() == 0
    }

    /// Whether every window that lies best around one of some rows is held and valid.
    pub(crate) fn are_valid(&self, rows: &Range<usize>) -> bool {
        let (held, fits) = (self.held(), self.centre(rows.start)..self.centre(rows.end.max(1) - 1) + 1);
        let is_held = held.start <= fits.start && fits.end <= held.end;
        is_held && self.any_flags(&fits) & Status::INVALID.bits() == 0
    }

    /// The flags of some windows, which are held.
    fn any_flags(&self, windows: &Range<usize>) -> u16 {
        // No early return, so that the loop becomes vector instructions.
        let places = windows.start - self.first..windows.end - self.first;
        self.status[places].iter().fold(0, |any, flags| any | flags)
    }

    /// The results around some rows where these are one after the other.
    fn own_fits(&self, rows: &Range<usize>) -> Option<Range<usize>> {
        let fits = self.centre(rows.start)..self.centre(rows.end - 1) + 1;
        let held = self.held();
        let is_held = held.start <= fits.start && fits.end <= held.end;
        let is_inside = is_held && rows.start >= self.plan.window / 2 && fits.len() == rows.len();
        (is_inside && self.any_flags(&fits) & Status::INVALID.bits() == 0).then_some(fits)
    }

    /// The result whose window lies best around each of some rows, or the number of rows where there is none.
    fn nearest(&self, rows: Range<usize>) -> Vec<usize> {
        let (plan, total) = (self.plan, self.rows());
        let (is_valid, centre) = (|row: usize| self.is_valid(row), |row: usize| self.centre(row));
        // A window that holds a row lies no farther from it, and errors of no other ask for the row.
        let held = self.held();
        let begin = centre(rows.start).saturating_sub(plan.window).max(held.start);
        let end = held.end.min(centre(rows.end - 1) + plan.window).max(begin);
        let is_held = |row: usize| (begin..end).contains(&centre(row));
        if (begin..end).all(is_valid) && is_held(rows.start) && is_held(rows.end - 1) {
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
            let Some(place) = centre.checked_sub(begin).filter(|place| *place < before.len()) else { return total };
            let (before, after) = (before[place], after[place]);
            if before < total && (after == total || centre - before <= after - centre) { before } else { after }
        };
        rows.map(nearest).collect()
    }

    /// The products of some rows; those outside of the record, and those that are not before an end, are zero.
    #[inline(always)]
    pub(crate) fn products<S: Lanes, const N: usize, const R: usize>(
        &self,
        simd: S,
        range: Range<isize>,
        end: usize,
        products: &mut RowProducts,
    ) {
        let p = if R == 0 { self.plan.regressors } else { R };
        let clamp = |row: isize| row.clamp(0, end.min(self.rows()).cast_signed()).unsigned_abs();
        let rows = clamp(range.start)..clamp(range.end);
        let (length, count) = ((range.end - range.start).max(0).unsigned_abs(), rows.len());
        let RowProducts { first, values, counts, columns } = products;
        *first = range.start;
        let values = side_by_side::<N>(values, length + MOST_LANES);
        counts.resize(length + 1, 0);
        if rows.is_empty() {
            values.fill([0.0; N]);
            counts.fill(0);
            return;
        }
        let skipped = (rows.start.cast_signed() - range.start).unsigned_abs();
        values[..skipped].fill([0.0; N]);
        counts[..=skipped].fill(0);
        let given = p + 1 + usize::from(self.equations.weights.is_some());
        let own_fits = self.own_fits(&rows);
        let wanted = (given + if own_fits.is_some() { 0 } else { p }) * count;
        if columns.len() < wanted {
            columns.resize(wanted, 0.0);
        }
        let (columns, rest) = columns[..wanted].split_at_mut(given * count);
        let sources = self.equations.columns[..p].iter().chain([&self.equations.columns[p + self.rhs]]);
        for (source, into) in sources.chain(&self.equations.weights).zip(columns.chunks_mut(count)) {
            source.read(rows.start, into);
        }
        let mut parameters: [&[f64]; MOST_REGRESSORS] = Default::default();
        if let Some(fits) = own_fits {
            let fits = fits.start - self.first..fits.end - self.first;
            parameters.iter_mut().zip(&self.parameters).for_each(|(into, all)| *into = &all[fits.clone()]);
        } else {
            let fits = self.nearest(rows);
            for ((into, all), place) in parameters.iter_mut().zip(&self.parameters).zip(rest.chunks_mut(count)) {
                for (parameter, &fit) in place.iter_mut().zip(&fits) {
                    *parameter = fit.checked_sub(self.first).and_then(|fit| all.get(fit)).copied().unwrap_or(f64::NAN);
                }
                *into = place;
            }
        }
        let places = skipped..skipped + count;
        let counted = &mut counts[places.start + 1..=places.end];
        let all = multiply(simd, columns, &parameters[..p], &mut values[places.start..], counted);
        values[places.end..].fill([0.0; N]);
        counts[places.end + 1..].fill(all);
    }
}

/// The kernel that makes the products of some rows, of `R` regressors, or of up to `N` where that is zero.
pub(crate) struct ProductsOfRows<'a, 'b, 'c, const N: usize, const R: usize> {
    pub(crate) fits: &'a Fits<'b>,
    pub(crate) range: Range<isize>,
    pub(crate) end: usize,
    pub(crate) into: &'c mut RowProducts,
}

impl<const N: usize, const R: usize> Kernel for ProductsOfRows<'_, '_, '_, N, R> {
    type Output = ();

    #[inline(always)]
    fn run<S: Lanes>(self, simd: S) {
        self.fits.products::<S, N, R>(simd, self.range, self.end, self.into);
    }
}
