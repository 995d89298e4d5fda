//! Standard errors of windows from sums over their rows: between the inverses of the normal matrices, and scaled by what sums and fits leave out.

use std::ops::Range;

use crate::least_squares::bandwidth::Bandwidth;
use crate::least_squares::plan::RollingLeastSquares;
use crate::least_squares::row_products::load_some;
use crate::simd::aligned::OnLines;
use crate::simd::vectors::{Lanes, MOST_LANES};

/// Windows that are finished together.
const TILE: usize = 256;

/// Windows that keep less of the variance than this beside what their fit takes have no standard error.
const LEAST_LEFT: f64 = 0.05;

/// Makes standard errors of the sums over windows.
pub(crate) struct ErrorScale<'a> {
    plan: &'a RollingLeastSquares,
    /// Rows of the record.
    total: usize,
    correlated: f64,
    /// By pair of regressors, what sums are to be multiplied by: what those of neighbours keep of the variance is given back, and pairs off the
    /// diagonal count twice.
    factors: Vec<f64>,
    /// For a window all of whose rows count.
    whole: f64,
}

impl<'a> ErrorScale<'a> {
    #[inline(always)]
    pub(crate) fn new(plan: &'a RollingLeastSquares, total: usize, bandwidth: &Bandwidth) -> Self {
        let kept: Vec<f64> = bandwidth.kept.iter().map(|kept| kept.sqrt().recip()).collect();
        let of_pair = |i: usize, k: usize| kept[i] * kept[k] * if i == k { 1.0 } else { 2.0 };
        let factors =
            (0..kept.len()).flat_map(|i| (i..kept.len()).map(move |k| (i, k))).map(|(i, k)| of_pair(i, k)).collect();
        let scale = Self { plan, total, correlated: bandwidth.rows as f64, factors, whole: 0.0 };
        let rows = plan.window as f64;
        Self { whole: scale.of(rows, 0.0, rows), ..scale }
    }

    /// Writes the errors of some windows, where the diagonals of their normal matrices are, from the sums of the products of each pair, of
    /// which `P` stand side by side. `normal` is above the diagonals of the normal matrices, row by row, and `counts` are the rows that count before each row from a first one on. There are `R` regressors, or up
    /// to `N` where that is zero: then the compiler does not know how many.
    #[inline(always)]
    pub(crate) fn write<S: Lanes, const N: usize, const P: usize, const R: usize>(
        &self,
        simd: S,
        rows: Range<usize>,
        sums: &[[f64; P]],
        counts: (isize, &[u32]),
        normal: &[&[f64]],
        errors: &mut [&mut [f64]],
    ) {
        let mut scales = [0.0; TILE];
        for (sums, first) in sums.chunks(TILE).zip(rows.clone().step_by(TILE)) {
            let scales = &mut scales[..sums.len()];
            self.of_windows(first, counts, scales);
            for (place, sums) in (0..).step_by(S::F64_LANES).zip(sums.chunks(S::F64_LANES)) {
                let into = (first + place - rows.start, normal, &mut *errors);
                if sums.len() == S::F64_LANES {
                    self.write_some::<S, N, P, R, true>(simd, sums, &scales[place..], into);
                } else {
                    self.write_some::<S, N, P, 0, false>(simd, sums, &scales[place..], into);
                }
            }
        }
    }

    /// The same for as many windows as a vector holds, or where they are not `WHOLE` for fewer.
    #[inline(always)]
    fn write_some<S: Lanes, const N: usize, const P: usize, const R: usize, const WHOLE: bool>(
        &self,
        simd: S,
        sums: &[[f64; P]],
        scales: &[f64],
        (place, normal, errors): (usize, &[&[f64]], &mut [&mut [f64]]),
    ) {
        let (p, count) = (if R == 0 { self.plan.regressors } else { R }, sums.len());
        let some = |numbers: &[f64]| load_some::<S, WHOLE>(simd, numbers, count);
        let mut of_pairs = OnLines([simd.splat_f64s(0.0); P]);
        turn(simd, sums, &mut of_pairs.0);
        for (sum, &factor) in of_pairs.0.iter_mut().zip(&self.factors) {
            *sum = simd.mul_f64s(*sum, simd.splat_f64s(factor));
        }
        let mut of_normal = OnLines([[simd.splat_f64s(0.0); N]; N]);
        let mut above = normal.iter();
        for i in 0..p {
            of_normal[i][i] = some(&errors[i][place..]);
            for (k, column) in (i + 1..p).zip(&mut above) {
                let one = some(&column[place..]);
                (of_normal[i][k], of_normal[k][i]) = (one, one);
            }
        }
        // The innermost loops run over the parameters, which do not wait for each other.
        let (mut variances, mut of_pair) = (OnLines([simd.splat_f64s(0.0); N]), of_pairs.0.iter());
        for b in 0..p {
            let mut inner = OnLines([simd.splat_f64s(0.0); N]);
            for (c, &sum) in (b..p).zip(&mut of_pair) {
                for a in 0..p {
                    inner[a] = simd.mul_add_f64s(sum, of_normal[c][a], inner[a]);
                }
            }
            for a in 0..p {
                variances[a] = simd.mul_add_f64s(inner[a], of_normal[b][a], variances[a]);
            }
        }
        let scale = some(scales);
        for (errors, &variance) in errors[..p].iter_mut().zip(&variances.0) {
            // Where there are no parameters the diagonal is NaN, and so is the error.
            let error = simd.sqrt_f64s(simd.mul_f64s(scale, variance));
            let into = &mut errors[place..];
            if WHOLE {
                simd.store(into, 0, error);
            } else {
                simd.partial_store_f64s(&mut into[..count], error);
            }
        }
    }

    /// What the sums over the windows of some rows are to be multiplied by.
    #[inline(always)]
    fn of_windows(&self, first: usize, (begin, counts): (isize, &[u32]), scales: &mut [f64]) {
        let start = first.cast_signed() - self.plan.before.cast_signed();
        let end = start + (scales.len() + self.plan.window - 1).cast_signed();
        if start >= 0 && end <= self.total.cast_signed() {
            let at = |row: isize| counts[(row - begin).unsigned_abs()] as usize;
            if at(end) - at(start) == (end - start).unsigned_abs() {
                scales.fill(self.whole);
                return;
            }
        }
        for (scale, row) in scales.iter_mut().zip(first..) {
            *scale = self.of_window(row, (begin, counts));
        }
    }

    /// What the sum over the window of a row is to be multiplied by.
    #[inline(always)]
    fn of_window(&self, row: usize, (begin, counts): (isize, &[u32])) -> f64 {
        let plan = self.plan;
        let first = row.cast_signed() - plan.before.cast_signed();
        let end = first + plan.window.cast_signed();
        let there = first.max(0)..end.min(self.total.cast_signed());
        let at = |row: isize| (row - begin).unsigned_abs();
        let count = counts[at(there.end)] - counts[at(there.start)];
        if count as usize == plan.window {
            return self.whole;
        }
        // Sums that reach out of a window are left out, but for those over an end of the record, of which a part is there.
        let over = |rows: isize| {
            let rows = (rows as f64).min(self.correlated - 1.0);
            rows * (1.0 - (rows + 1.0) / (2.0 * self.correlated))
        };
        let outside = over(there.start - first) + over(end - there.end);
        self.of((there.end - there.start) as f64, outside, f64::from(count))
    }

    /// The same for a window that spans so many rows, beside sums over the ends that are partly there, of which so many count.
    #[inline(always)]
    fn of(&self, spanned: f64, outside: f64, count: f64) -> f64 {
        let complete = spanned - self.correlated + 1.0 + outside;
        // What fits take of the sums of neighbours: of one row the part p / w, of B rows about (B + p - 1) / w.
        let left = 1.0 - (self.correlated + self.plan.regressors as f64 - 1.0) / count;
        if left < LEAST_LEFT || complete <= 0.0 { f64::NAN } else { spanned / (complete * self.correlated * left) }
    }
}

/// The numbers of some rows, of which there are at most as many as a vector holds, one vector for each number.
#[inline(always)]
fn turn<S: Lanes, const P: usize>(simd: S, rows: &[[f64; P]], columns: &mut [S::f64s; P]) {
    let mut square = [simd.splat_f64s(0.0); MOST_LANES];
    let square = &mut square[..S::F64_LANES];
    if P < S::F64_LANES {
        for (number, column) in columns.iter_mut().enumerate() {
            let mut values = [0.0; MOST_LANES];
            values.iter_mut().zip(rows).for_each(|(value, row)| *value = row[number]);
            *column = simd.load(&values, 0);
        }
        return;
    }
    for number in (0..P).step_by(S::F64_LANES) {
        // The last vector begins among the numbers of the one before it where it would end beyond them.
        let number = number.min(P - S::F64_LANES);
        for (vector, row) in square.iter_mut().zip(rows) {
            *vector = simd.load(row, number);
        }
        simd.transpose(square);
        columns[number..number + S::F64_LANES].copy_from_slice(square);
    }
}
